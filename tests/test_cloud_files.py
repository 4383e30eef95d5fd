"""Files of points: what is read of each kind, what is written, and what is refused."""

import struct

import numpy as np
import pytest

from projdist.pointclouds import read_cloud

POINTS = np.array([[0.1, -2.0, 3e5], [4.0, 5.5, 6.0], [7.25, 8.0, 9.0]])
A, SHIFT = np.array([[0.0, -2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.5]]), np.array([1.0, 2.0, 3.0])
MOVED = [[5.0, 2.1, 150003.0], [-10.0, 6.0, 6.0], [-15.0, 9.25, 7.5]]  # by hand
NORMAL, TURNED = [0.6, 0.8, 0.0], [-0.4, 0.6, 0.0]  # A^-T takes it to (-0.4, 0.6, 0), of length root 0.52

HEADER = """ply
format {order} 1.0
comment a triangle
element vertex 3
property {kind} x
property uchar red
property {kind} y
property {kind} z
property float nx
property float ny
property float nz
element face 1
property list uchar int vertex_indices
end_header
"""
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(order, kind="double", points=POINTS, normal=NORMAL):
    """A PLY file, by hand."""
    head = HEADER.format(order=order, kind=kind).encode()
    if order == "ascii":
        rows = [f"{x!r} {k} {y!r} {z!r} {' '.join(map(repr, normal))}" for k, (x, y, z) in enumerate(points.tolist())]
        return head + "\n".join([*rows, "3 0 1 2", ""]).encode()
    mark = ORDERS[order] + ("dBdd" if kind == "double" else "fBff") + "3f"
    rows = [struct.pack(mark, x, k, y, z, *normal) for k, (x, y, z) in enumerate(points.tolist())]
    return head + b"".join(rows) + struct.pack(ORDERS[order] + "B3i", 3, 0, 1, 2)


@pytest.fixture
def file(tmp_path):
    """Write a file and read it as a cloud."""

    def read(name, data):
        path = tmp_path / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return read_cloud(path)

    return read


@pytest.mark.parametrize(
    ("text", "columns", "ids"),
    [
        ("0.1,-2,3e5\n4,5.5,6\n7.25,8,9\n", 3, None),
        ("\ufeffx;y;z\r\n0.1;-2;3e5\r\n4;5.5;6\r\n7.25;8;9\r\n", 3, None),
        ("# a comment\nname\tx\ty\na\t0.1\t-2\nb\t4\t5.5\nc\t7.25\t8\n", 2, ("a", "b", "c")),
        ("p,0.1,-2,3e5\nq,4,5.5,6\nr,7.25,8,9\n", 3, ("p", "q", "r")),
        ("colour,Z,Y,X,ID\nred,3e5,-2,0.1,1\nred,6,5.5,4,2\nred,9,8,7.25,3\n", 3, ("1", "2", "3")),
        ("first,second,third\n0.1,-2,3e5\n4,5.5,6\n7.25,8,9\n", 3, None),
    ],
)
def test_csv(file, text, columns, ids):
    """CSV with and without a header, with any separator, with ids and other columns."""
    cloud = file("a.csv", text)
    np.testing.assert_array_equal(cloud.points, POINTS[:, :columns])
    assert cloud.ids == ids


def test_any_dimension(file):
    """A CSV file may have any number of coordinates; an empty cell is a missing point."""
    cloud = file("a.csv", "1,2,3,4,5\n6,7,,9,10\n")
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3, 4, 5], [np.nan] * 5])


def test_csv_is_written(file, tmp_path):
    """Moved points stand in the place of the old ones, in full precision; missing ones and other columns stay."""
    cloud = file("a.csv", "id,x,text,y,z\n1,0.1,b,-2,3e5\n2,,c,,\n3,7.25,d,8,9\n")
    cloud.write(tmp_path / "b.csv", A, SHIFT)
    assert (tmp_path / "b.csv").read_text() == "id,x,text,y,z\n1,5.0,b,2.1,150003.0\n2,,c,,\n3,-15.0,d,9.25,7.5\n"
    with pytest.raises(FileExistsError, match="It exists; --overwrite replaces it"):
        cloud.write(tmp_path / "b.csv", A, SHIFT)
    cloud.write(tmp_path / "b.csv", A, SHIFT + 1, overwrite=True)
    assert "6.0,b,3.1" in (tmp_path / "b.csv").read_text()


def test_normals(file, tmp_path):
    """Normals in a CSV file are turned, and stay normal to what was a surface; where there is none there is none."""
    cloud = file("a.csv", "x,y,z,nx,ny,nz\n1,2,3,0.6,0.8,0\n1,2,3,0,0,0\n")
    cloud.write(tmp_path / "b.csv", A, SHIFT)
    normals = read_cloud(tmp_path / "b.csv").normals
    np.testing.assert_allclose(normals, [np.array(TURNED) / np.linalg.norm(TURNED), [0, 0, 0]], rtol=1e-15)
    along = A @ [-0.8, 0.6, 5.0]
    assert normals[0] @ along == pytest.approx(0.0, abs=1e-15)


def test_xyz(file, tmp_path):
    """XYZ has three coordinates in each line, whatever follows them."""
    cloud = file("a.xyz", "# scan\n0.1 -2  3e5 255 0\n\n4 5.5 6 0 0\n7.25\t8 9 0 1\n")
    np.testing.assert_array_equal(cloud.points, POINTS)
    cloud.write(tmp_path / "b.xyz", A, SHIFT)
    assert (tmp_path / "b.xyz").read_text() == (
        "# scan\n5.0 2.1 150003.0 255 0\n-10.0 6.0 6.0 0 0\n-15.0 9.25 7.5 0 1\n"
    )


@pytest.mark.parametrize("order", ORDERS)
def test_ply(file, order, tmp_path):
    """PLY is read and written in each of its forms: but for points and turned normals it is what it was."""
    cloud = file("a.ply", ply(order))
    np.testing.assert_array_equal(cloud.points, POINTS)
    cloud.write(tmp_path / "b.ply", A, SHIFT)
    normal = np.float32(np.array(TURNED) / np.linalg.norm(TURNED))
    again = read_cloud(tmp_path / "b.ply")
    np.testing.assert_allclose(again.points, MOVED, rtol=1e-15)
    np.testing.assert_allclose(again.normals, [normal] * 3, rtol=1e-7)
    again.write(tmp_path / "c.ply", np.linalg.inv(A), -np.linalg.solve(A, SHIFT))
    back = read_cloud(tmp_path / "c.ply")
    np.testing.assert_allclose(back.points, POINTS, rtol=1e-15)
    np.testing.assert_array_equal(back.content.vertices["red"], [0, 1, 2])
    assert back.content.header == HEADER.format(order=order, kind="double").encode()
    assert back.content.tail == cloud.content.tail != b""


@pytest.mark.parametrize("order", ORDERS)
def test_ply_in_single_precision(file, order, tmp_path):
    """Coordinates keep their type: floats are good to 6e-8."""
    cloud = file("a.ply", ply(order, "float"))
    cloud.write(tmp_path / "b.ply", A, SHIFT)
    np.testing.assert_allclose(read_cloud(tmp_path / "b.ply").points, MOVED, rtol=6e-8)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.obj", "v 1 2 3", r"Its suffix must be \.csv, \.xyz or \.ply"),
        ("a.csv", "", "There are no points in it"),
        ("a.csv", "x,y\n", "There are no points in it"),
        ("a.csv", "1 2\n3 4\n", "Its cells must stand apart by commas, semicolons or tabs"),
        ("a.csv", "x,y\n1,2\n3,b\n", "Row 2 must have 2 numbers for its point"),
        ("a.csv", "1,2\n3\n4,5\n", "Row 2 must have 2 numbers for its point"),
        ("a.csv", b"\xff\xfe1,2", "It must be text in UTF-8"),
        ("a.xyz", "1 2 3\n4 5\n", "Row 2 must have 3 numbers for its point"),
        ("a.ply", "solid", "It is no PLY file: its header must begin with ply"),
        ("a.ply", ply("binary_little_endian")[:-50], "It ends before its 3 vertices do"),
        ("a.ply", ply("ascii")[:-50], "Vertex 2 must have 7 numbers"),
        ("a.ply", ply("ascii", "int"), "Its vertices must have x, y and perhaps z of type float or double"),
        ("a.ply", HEADER.format(order="zip", kind="float"), "Its header must name a format and, as the first element"),
        (
            "a.ply",
            HEADER.format(order="ascii", kind="half"),
            "The line 'property half x' of its header is not understood",
        ),
    ],
)
def test_refused(file, name, data, said):
    """What cannot be read is one line with the file's name."""
    with pytest.raises(ValueError, match=rf"^Invalid cloud '.*{name}'\. {said}"):
        file(name, data)


def test_there_is_no_file(tmp_path):
    """A file that is not there is named."""
    with pytest.raises(ValueError, match=r"^Invalid cloud '.*a\.csv'\. The file cannot be read: No such file"):
        read_cloud(tmp_path / "a.csv")
