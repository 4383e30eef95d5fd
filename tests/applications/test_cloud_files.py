"""Files of points: what is read of each kind, what is written, and what is refused."""

import struct

import numpy as np
import pytest
from refusals import refuses
from tables import each

from projdist import Notice
from projdist.applications.pointclouds import read_cloud

POINTS = np.array([[0.1, -2.0, 3e5], [4.0, 5.5, 6.0], [7.25, 8.0, 9.0]])
A, SHIFT = np.array([[0.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.5]]), np.array([1.0, 2.0, 3.0])
MOVED = [[5.0, 2.1, 150003.0], [-10.0, 6.0, 6.0], [-15.0, 9.25, 7.5]]  # by hand
NORMAL, TURNED = [0.6, 0.8, 0.0], [-0.4, 0.6, 0.0]  # A^-T takes it to (-0.4, 0.6, 0), of length root 0.52

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def header(order, *lines):
    """The header of a PLY file, by hand."""
    return "\n".join(["ply", f"format {order} 1.0", *lines, "end_header", ""])


def triangle(order, kind="double"):
    """The header of a file of three vertices with colours and normals."""
    lines = [f"property {kind} x", "property uchar red", f"property {kind} y", f"property {kind} z"]
    lines += [*(f"property float n{axis}" for axis in "xyz"), "element face 1"]
    return header(order, "comment a triangle", "element vertex 3", *lines, "property list uchar int vertex_indices")


def ply(order, kind="double", points=POINTS, normal=NORMAL):
    """A PLY file, by hand."""
    head = triangle(order, kind).encode()
    if order == "ascii":
        rows = [f"{x!r} {k} {y!r} {z!r} {' '.join(map(repr, normal))}" for k, (x, y, z) in enumerate(points.tolist())]
        return head + "\n".join([*rows, "3 0 1 2", ""]).encode()
    mark = ORDERS[order] + ("dBdd" if kind == "double" else "fBff") + "3f"
    rows = [struct.pack(mark, x, k, y, z, *normal) for k, (x, y, z) in enumerate(points.tolist())]
    return head + b"".join(rows) + struct.pack(ORDERS[order] + "B3i", 3, 0, 1, 2)


PCD = """# .PCD v.7 - Point Cloud Data file format
VERSION .7
FIELDS x y z more normal
SIZE 4 8 4 2 4
TYPE F F F U F
COUNT 1 1 1 1 2
WIDTH 3
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 3
DATA {form}
"""
ASCII_PCD = PCD.format(form="ascii")


def pcd(form):
    """A PCD file with columns of several types and several numbers, by hand."""
    rows = [(x, y, z, 60000 + k, 0.5, -k) for k, (x, y, z) in enumerate(POINTS.tolist())]
    if form == "ascii":
        return PCD.format(form=form).encode() + "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode()
    return PCD.format(form=form).encode() + b"".join(struct.pack("<fdfHff", *row) for row in rows)


def faces_first(order):
    """A PLY file with faces of three and four corners and an element of numbers before its vertices, by hand."""
    lines = ["element face 2", "property uchar flag", "property list uchar int vertex_indices", "element range 1"]
    lines += ["property short low", "property double high", "element vertex 3"]
    lines += [*(f"property double {x}" for x in "xyz"), "element edge 1", "property int one"]
    head = header(order, *lines).encode()
    if order == "ascii":
        points = "".join(" ".join(map(repr, row)) + "\n" for row in POINTS.tolist())
        return head + f"7 3 0 1 2\n7 4 0 1 2 0\n-5 0.5\n{points}42\n".encode()

    def pack(mark, *values):
        return struct.pack(ORDERS[order] + mark, *values)

    faces = pack("BB3i", 7, 3, 0, 1, 2) + pack("BB4i", 7, 4, 0, 1, 2, 0)
    return head + faces + pack("hd", -5, 0.5) + pack("9d", *POINTS.ravel()) + pack("i", 42)


@pytest.fixture
def file(tmp_path):
    """Write a file and read it as a cloud."""

    def read(name, data):
        path = tmp_path / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return read_cloud(path)

    return read


@each(("text", "points", "ids"), [
    ("0.1,-2,3e5\n4,5.5,6\n7.25,8,9\n", POINTS, None),
    ("\ufeffx;y;z\r\n0.1;-2;3e5\r\n4;5.5;6\r\n7.25;8;9\r\n", POINTS, None),
    ("# a comment\nname\tx\ty\na\t0.1\t-2\nb\t4\t5.5\nc\t7.25\t8\n", POINTS[:, :2], ("a", "b", "c")),
    ("p,0.1,-2,3e5\nq,4,5.5,6\nr,7.25,8,9\n", POINTS, ("p", "q", "r")),
    ("colour,Z,Y,X,ID\nred,3e5,-2,0.1,1\nred,6,5.5,4,2\nred,9,8,7.25,3\n", POINTS, ("1", "2", "3")),
    ("first,second,third\n0.1,-2,3e5\n4,5.5,6\n7.25,8,9\n", POINTS, None),
    ("1,5;2,25\n-3;4,0\n", [[1.5, 2.25], [-3, 4]], None),
    # A row of empty cells is a missing point, one may end before its id.
    ("1,2,3,4,5\n,,,,\n", [[1, 2, 3, 4, 5], [np.nan] * 5], None),
    ("x,y,id\n1,2,a\n3,4\n", [[1, 2], [3, 4]], ("a", "")),
])  # fmt: skip
def test_csv(file, text, points, ids):
    """CSV with and without a header, with any separator and decimal commas, with ids and other columns."""
    cloud = file("a.csv", text)
    np.testing.assert_array_equal(cloud.points, points)
    assert cloud.ids == ids


def test_missing_coordinates(file):
    """A point that lacks one is missing, which is told with its number."""
    with pytest.warns(Notice, match=r"^2 point\(s\) of '.*' lack a coordinate and are taken as missing: 2, 4\.$"):
        cloud = file("a.csv", "x,y,z\n1,2,3\n6,,8\n,,\n1,2,\n")
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], *[[np.nan] * 3] * 3])
    nan = [[0.0, 1.0, 2.0], [3.0, np.nan, 4.0], [5.0, 6.0, 7.0]]
    with pytest.warns(Notice, match=r"^1 point\(s\) .*: 2\.$"):
        cloud = file("a.ply", ply("binary_little_endian", points=np.array(nan)))
    np.testing.assert_array_equal(cloud.points, [nan[0], [np.nan] * 3, nan[2]])


def test_weights(tmp_path):
    """They are a column of a header, which is then no coordinate, or a property of PLY, or missing; empty is NaN."""
    (tmp_path / "a.csv").write_text("first,second,Quality\n1,2,3\n4,5,\n")
    cloud = read_cloud(tmp_path / "a.csv", weights="quality")
    np.testing.assert_array_equal(cloud.points, [[1, 2], [4, 5]])
    np.testing.assert_array_equal(cloud.weights, [3, np.nan])
    (tmp_path / "a.ply").write_bytes(ply("ascii"))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ply", weights="red").weights, [0, 1, 2])
    (tmp_path / "b.csv").write_text("x,y,Quality\n1,2,3\n")
    (tmp_path / "a.xyz").write_text("1 2 3\n")
    columns_of = {"b.csv": ("x", "y", "quality"), "a.ply": ("x", "red", "y", "z", "nx", "ny", "nz"), "a.xyz": ()}
    for name, columns in columns_of.items():
        found = read_cloud(tmp_path / name, weights="w")
        assert (found.weights, found.columns) == (None, columns)


HEADS = [("a.xyz", "//X Y Z R\n"), ("a.asc", "//X Y Z R\n3\n"), ("b.asc", "# scan\n"), ("c.asc", "x y z r\n")]
ROWS = "0.1 -2  3e5 255\n\n4 5.5 6 0\n7.25\t8 9 1\n", "5.0 2.1 150003.0 255\n-10.0 6.0 6.0 0\n-15.0 9.25 7.5 1\n"
TABLE = "id,x,text,y,z\n1,0.1,b,-2,3e5\n2,,c,,\n3,7.25,d,8,9\n"


@each(("name", "text", "written"), [
    ("a.csv", TABLE, "id,x,text,y,z\n1,5.0,b,2.1,150003.0\n2,,c,,\n3,-15.0,d,9.25,7.5\n"),
    # Without anything the cells behind missing ones would take their place, or the row be a header.
    ("a.csv", ",\n4,5\n7,8\n", "nan,nan\n-9.0,6.0\n-15.0,9.0\n"),
    ("a.xyz", "nan nan nan 1\n4 5 6 2\n", "nan nan nan 1\n-9.0 6.0 6.0 2\n"),
    # Decimal commas are written as they were.
    ("a.csv", "x;name;y\n1,5;a,b;2,25\n-3;c;4,0\n", "x;name;y\n-3,5;a,b;3,5\n-7,0;c;-1,0\n"),
    # The names of columns, and the number of points, stand before them as in CloudCompare's files.
    *((name, head + ROWS[0], head + ROWS[1]) for name, head in HEADS),
])  # fmt: skip
def test_files_are_written(file, tmp_path, name, text, written):
    """Moved points stand in the place of the old ones, in full precision; missing ones and other columns stay."""
    cloud = file(name, text)
    n = cloud.points.shape[1]
    cloud.write(tmp_path / f"new-{name}", A[:n, :n], SHIFT[:n], overwrite=True)
    assert (tmp_path / f"new-{name}").read_text() == written


def test_files_that_exist(file, tmp_path):
    """They are replaced only if that is said."""
    refuses(r"^Invalid cloud '.*a\.csv'\. The file cannot be read: No such file", read_cloud, tmp_path / "a.csv")
    cloud = file("a.csv", TABLE)
    with pytest.raises(FileExistsError, match="It exists; --overwrite replaces it"):
        cloud.write(tmp_path / "a.csv", A, SHIFT)
    cloud.write(tmp_path / "a.csv", A, SHIFT + 1, overwrite=True)
    assert "6.0,b,3.1" in (tmp_path / "a.csv").read_text()


def test_normals(file, tmp_path):
    """Normals in a CSV file are turned, and stay normal to what was a surface; where there is none there is none."""
    cloud = file("a.csv", "x,y,z,nx,ny,nz\n1,2,3,0.6,0.8,0\n1,2,3,0,0,0\n")
    cloud.write(tmp_path / "b.csv", A, SHIFT)
    normals = read_cloud(tmp_path / "b.csv").normals
    np.testing.assert_allclose(normals, [np.array(TURNED) / np.linalg.norm(TURNED), [0, 0, 0]], rtol=1e-15)
    assert normals[0] @ A @ [-0.8, 0.6, 5.0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("order", ORDERS)
def test_ply(file, order, tmp_path):
    """PLY is read and written in each of its forms: but for points and turned normals it is what it was."""
    file("a.ply", ply(order, "float")).write(tmp_path / "single.ply", A, SHIFT)
    np.testing.assert_allclose(read_cloud(tmp_path / "single.ply").points, MOVED, rtol=6e-8)  # floats stay floats
    cloud = file("a.ply", ply(order))
    np.testing.assert_array_equal(cloud.points, POINTS)
    cloud.write(tmp_path / "b.ply", A, SHIFT)
    normal = np.float32(np.array(TURNED) / np.linalg.norm(TURNED))
    again = read_cloud(tmp_path / "b.ply")
    np.testing.assert_allclose(again.points, MOVED, rtol=1e-15)
    np.testing.assert_allclose(again.normals, [normal] * 3, rtol=1e-7)
    np.testing.assert_array_equal(again.content.vertices["red"], [0, 1, 2])
    assert again.content.header == triangle(order).encode()
    assert again.content.tail == cloud.content.tail != b""
    # The vertices may stand behind other elements, which stay what they are.
    data = faces_first(order)
    cloud = file("a.ply", data)
    np.testing.assert_array_equal(cloud.points, POINTS)
    cloud.write(tmp_path / "d.ply", np.eye(3), np.zeros(3))
    assert (tmp_path / "d.ply").read_bytes() == data


# Turk 1994, and the names with sizes that followed: the struct module's letter and the ends of each type's range.
SCALARS = {
    **dict.fromkeys(["char", "int8"], ("b", -128, 127)),
    **dict.fromkeys(["uchar", "uint8"], ("B", 0, 255)),
    **dict.fromkeys(["short", "int16"], ("h", -32768, 32767)),
    **dict.fromkeys(["ushort", "uint16"], ("H", 0, 65535)),
    **dict.fromkeys(["int", "int32"], ("i", -(2**31), 2**31 - 1)),
    **dict.fromkeys(["uint", "uint32"], ("I", 0, 2**32 - 1)),
    **dict.fromkeys(["float", "float32"], ("f", -1.5, 2.0**100)),
    **dict.fromkeys(["double", "float64"], ("d", -0.1, 1e300)),
}


@each("order", ORDERS)
@each("kind", SCALARS)
def test_types_of_ply(file, order, kind, tmp_path):
    """Each type of PLY has its size, its sign and its order of bytes, and is written as it was."""
    letter, *ends = SCALARS[kind]
    lines = ["element vertex 2", "property float x", f"property {kind} more", "property float y"]
    data = header(order, *lines).encode()
    if order == "ascii":
        data += "".join(f"{float(k)} {end} {k + 0.5}\n" for k, end in enumerate(ends)).encode()
    else:
        data += b"".join(struct.pack(f"{ORDERS[order]}f{letter}f", k, end, k + 0.5) for k, end in enumerate(ends))
    cloud = file("a.ply", data)
    assert cloud.content.vertices["more"].tolist() == ends
    assert cloud.points.tolist() == [[0.0, 0.5], [1.0, 1.5]]
    cloud.write(tmp_path / "b.ply", np.eye(2), np.zeros(2), overwrite=True)
    # Large floats have another text, as 1.2676506e+30, for the same number.
    assert (tmp_path / "b.ply").read_bytes() == data or (order == "ascii" and letter in "fd")


ENDS_EARLY = "It ends before its vertices, among those of its element"
TEXT, SINGLE, HALF = ply("ascii"), ply("ascii", "float"), triangle("ascii", "half")


@each(("name", "data", "said"), [
    ("a.obj", "v 1 2 3", r"Its suffix must be \.csv, \.xyz, \.asc, \.ply or \.pcd"),
    ("a.csv", "", "There are no points in it"),
    ("a.csv", "x,y\n", "There are no points in it"),
    ("a.csv", "1 2\n3 4\n", "Its cells must be separated by commas, semicolons or tabs"),
    ("a.csv", "x,y\n1,2\n3,b\n", "Row 2 must have 2 numbers for its point"),
    ("a.csv", "1,2\n3\n4,5\n", "Row 2 must have 2 numbers for its point"),
    ("a.csv", "1,2\n3,4,5\n6,7,8\n", "Its row 2 has 3 cells, the first one 2"),
    ("a.csv", "x,y,name\n1,2,a\n3,4,b,5\n", "Its row 3 has 4 cells, the first one 3"),
    ("a.csv", 'x,y,name\n1,2,a\n3,4,"b\n5,6,c\n', "Its row 3 has a quotation mark that does not end its cell"),
    ("a.csv", "1,2,\n3,4,\n", "No point in it has all of its coordinates"),
    ("a.csv", "1,2\n3,1_0\n", "Row 2 must have 2 numbers for its point"),
    ("a.csv", "1,2\n3,inf\n", "Point 2 is infinitely far away"),
    ("a.csv", "# one\n# two\n", "There are no points in it"),
    ("a.xyz", "1 2\n3 4 5\n", "Row 1 has 2 numbers, row 2 more"),
    ("a.csv", b"\xff\xfe1,2", "It must be text in UTF-8"),
    ("a.xyz", "1 2 3\n4 5\n", "Row 2 must have 3 numbers for its point"),
    ("a.csv", "x;y\n1.5;2\n3,5;4\n", "Row 2 must have 2 numbers for its point. Decimal commas are read where all"),
    ("a.asc", "ncols 2\nnrows 1\n1 2\n", "It is an Esri grid, not a cloud"),
    ("a.asc", "//X Y Z\n", "There are no points in it"),
    ("a.pcd", "solid\n", "It is not a PCD file: 'solid' does not belong in such a header"),
    ("a.pcd", PCD.format(form="binary_compressed"), "Its data are binary_compressed; they must be ascii or binary"),
    ("a.pcd", PCD.format(form="zip"), "It is not a PCD file: its header must end with DATA"),
    ("a.pcd", ASCII_PCD.replace("SIZE 4", "SIZE 3"), "Its header must have FIELDS, SIZE, TYPE and"),
    ("a.pcd", ASCII_PCD.replace("SIZE 4 ", "SIZE "), "Its header must have FIELDS, SIZE, TYPE and"),
    ("a.pcd", ASCII_PCD.replace("FIELDS x", "FIELDS u"), "Its FIELDS must have x, y and perhaps z"),
    ("a.pcd", ASCII_PCD + "1 2 3 4 5\n", "Point 1 must have 6 numbers"),
    ("a.pcd", ASCII_PCD + "1,5 2 3 4 5 6\n", "Point 1 must have 6 numbers, with decimal points, not"),
    ("a.pcd", PCD.format(form="binary") + "12345678", "It ends before its 3 points do"),
    ("a.ply", faces_first("ascii").partition(b"5.5")[0], "Vertex 2 must have 3 numbers"),
    ("a.ply", faces_first("ascii").partition(b"3 0 1")[0], ENDS_EARLY),
    ("a.ply", faces_first("binary_big_endian")[:-106], ENDS_EARLY),
    ("a.ply", "solid", "It is not a PLY file: its header must begin with ply"),
    ("a.ply", ply("binary_little_endian")[:-50], "It ends before its 3 vertices do"),
    ("a.ply", ply("ascii")[:-50], "Vertex 2 must have 7 numbers"),
    ("a.ply", ply("ascii").replace(b"vertex 3", b"vertex 1000000000000000000"), "Vertex 4 must have 7 numbers"),
    ("a.ply", ply("binary_big_endian").replace(b"vertex 3", b"vertex 1" + 18 * b"0"), "It ends before its 10"),
    ("a.ply", TEXT.replace(b" 1 5.5", b" 256 5.5"), "Vertex 2 has 256 for red, which its type uint8 cannot"),
    ("a.ply", TEXT.replace(b" 1 5.5", b" 1.5 5.5"), "Vertex 2 has 1.5 for red, which its type uint8 can"),
    ("a.ply", SINGLE.replace(b"4.0 1", b"1e39 1"), "Vertex 2 has 1e.39 for x, which its type float32"),
    ("a.ply", TEXT.replace(b"float ny", b"float nx"), "Its vertices have two properties of one name"),
    ("a.ply", ply("ascii", "int"), "Its vertices must have x, y and perhaps z of type float or double"),
    ("a.ply", triangle("zip"), "Its header must name a format and an element vertex"),
    ("a.ply", HALF, "The line 'property half x' of its header is not understood"),
])  # fmt: skip
def test_refused(file, name, data, said):
    """What cannot be read is one line with the file's name."""
    refuses(rf"^Invalid cloud '.*{name}'\. {said}", file, name, data)


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_pcd(file, form, tmp_path):
    """Points, whatever else there is beside them, which stays what it is."""
    data = pcd(form)
    cloud = file("a.pcd", data)
    np.testing.assert_array_equal(cloud.points, np.column_stack([np.float32(POINTS[:, 0]), POINTS[:, 1:]]))
    assert cloud.columns == ("x", "y", "z", "more", "normal")
    cloud.write(tmp_path / "b.pcd", np.eye(3), np.zeros(3))
    assert read_cloud(tmp_path / "b.pcd").content.vertices.tobytes() == cloud.content.vertices.tobytes()
    assert form == "ascii" or (tmp_path / "b.pcd").read_bytes() == data
    cloud.write(tmp_path / "c.pcd", A, SHIFT)
    np.testing.assert_allclose(read_cloud(tmp_path / "c.pcd").points, MOVED, rtol=1e-7)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.pcd", weights="more").weights, [60000, 60001, 60002])
    assert read_cloud(tmp_path / "a.pcd", weights="normal").weights is None


def test_pcd_with_missing_points_and_columns_of_one_name(file):
    """Organised clouds have nan where nothing was seen; padding has the same name again and again."""
    head = ASCII_PCD.replace("z more normal", "z _ _").replace("2 4\nTYPE F F F U F", "4 4\nTYPE F F F F F")
    head = head.replace("COUNT 1 1 1 1 2\n", "").replace("HEIGHT 1", "HEIGHT 2").replace("POINTS 3\n", "")
    cloud = file("a.pcd", head.replace("WIDTH 3", "WIDTH 1") + "1 2 3 0 0\nnan nan nan 0 0\n")
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [np.nan] * 3])


def test_headers_of_cloudcompare(file, tmp_path):
    """Columns are in any order, with weights and normals, semicolons, blanks and decimal commas."""
    path = tmp_path / "d.asc"
    path.write_text("//Nx;Ny;Nz;Quality;X;Y;Z\n0,6;0,8;0;2,5;0,1;-2;300000\n0;0;1;1;4;5,5;6\n")
    cloud = read_cloud(path, weights="quality")
    np.testing.assert_array_equal(cloud.points, POINTS[:2])
    np.testing.assert_array_equal(cloud.weights, [2.5, 1])
    np.testing.assert_array_equal(cloud.normals, [[0.6, 0.8, 0], [0, 0, 1]])
    np.testing.assert_array_equal(file("a.xyz", "1,5 2,25 0\n-3 4,0 1\n").points, [[1.5, 2.25, 0], [-3, 4, 1]])
