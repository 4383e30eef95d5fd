"""Control points of old maps, from files."""

import numpy as np
import pytest
from pyproj import CRS, Transformer
from refusals import refuses
from tables import each

from projdist import Notice
from projdist.applications.oldmaps import read_control_points

ROWS = [(1.0, 2.0, 600000.0, 200000.0), (5.0, 2.5, 604000.0, 200100.0), (2.0, 9.0, 601500.0, 207000.0)]


def lines(form, rows=ROWS):
    """A line for each row by a form of its number, x_old, y_old, x_new and y_new."""
    return "".join(form.format(k, *row) for k, row in enumerate(rows, 1))


FORMS = {
    "": "{},{},{},{},{}\n",
    "# a comment\n\n": "{1} {2}   {3} {4}\n",
    "y_new;x_new;y_old;x_old;id\n": "{4};{3};{2};{1};{0}\n",
    "X_old\tY_old\tEasting\tNorthing\n": "{1}\t{2}\t{3}\t{4}\n",
    "mapX,mapY,pixelX,pixelY,enable\n": "{3},{4},{1},{2},1\n",
    "Link,X Source,Y Source,X Map,Y_Map\n": "{},{},{},{},{}\n",  # of ArcGIS, with blanks and underscores
}
LINKS = [lines("{} {} {} {} {} 0.1 -0.2 0.25\n".replace(" ", mark)) for mark in "\t; "]
COMMANDS = [
    lines("-gcp {1} {2} {3} {4}\n"),
    lines("-gcp {1} {2} {3} {4} 12.5 "),
    "# a comment\ngdal_translate -of GTiff \\\n" + lines("-gcp {1} {2} {3} {4} \\\n") + '"a map.tif" out.tif\n',
    "gdal raster edit " + lines("--gcp {1},{2},{3},{4},0 ") + "in.tif",
]
TABLES = [*(head + lines(form) for head, form in FORMS.items()), *LINKS, *(one.replace(".", ",") for one in LINKS)]
FOOT = 1200.0 / 3937.0  # of the US survey, in metres
FEET = [(0.0, 0.0, 6500000.0, 1900000.0), (10.0, 0.0, 6500100.0, 1900000.0), (0.0, 10.0, 6500000.0, 1900100.0)]
DEGREES = [(0.0, 0.0, 7.5, 47.5), (1.0, 0.0, 7.9, 47.4), (0.0, 1.0, 7.7, 47.6)]


def planes(source, target):
    """The places of DEGREES in a plane, by pyproj."""
    places = Transformer.from_crs(source, target, always_xy=True).transform(*np.transpose(DEGREES)[2:])
    return np.stack(places, axis=-1)


@pytest.fixture
def read(tmp_path):
    """Write a file and read its control points."""

    def read(text, **words):
        path = tmp_path / "a.points"
        path.write_text(text, encoding="utf-8")
        return read_control_points(path, **words)

    return read


@each("text", [*TABLES, *COMMANDS])
def test_files(text, read):
    """Points are the same in tables, whatever parts and names their columns, in links of ArcGIS, and for GDAL."""
    points = read(text)
    np.testing.assert_array_equal(np.hstack([points.old, points.new]), ROWS)
    assert (points.names, points.note, points.crs) == (("1", "2", "3"), "", None)


def test_longitudes_and_latitudes(read):
    """Degrees are projected with a CRS, as pyproj does it; truth without names that could be degrees is noted."""
    text = "x_old,y_old,lon,lat\n" + lines("{1},{2},{3},{4}\n", DEGREES)
    np.testing.assert_allclose(read(text, crs="EPSG:32632").new, planes("EPSG:4326", "EPSG:32632"), atol=1e-6)
    refuses(r"Its truth is longitudes and latitudes; a CRS is needed that makes a plane", read, text)
    assert "if these are degrees" in read("0,0,7.5,47.5\n1,0,7.6,47.5\n0,1,7.5,47.6\n").note
    assert read("0,0,7.5,47.5\n1,0,7.6,97.5\n0,1,7.5,47.6\n").note == ""  # no latitude


def test_names_and_points_that_are_not_enabled(read):
    """An id may be any text. QGIS's points that are switched off are left out, which is told."""
    text = 'name,x_old,y_old,x_new,y_new\n"Basel, Münster",0,0,0,0\nb,1,0,900,0\nc,0,1,0,900\n'
    assert read(text).names == ("Basel, Münster", "b", "c")
    text = "#CRS: none\nmapX,mapY,sourceX,sourceY,enable,dX,dY,residual\n" + lines("{3},{4},{1},{2},1,0,0,0\n")
    with pytest.warns(Notice, match=r"^1 control point\(s\) of '.*' are not enabled and are left out\.$"):
        points = read(text + "0,0,7,7,0,0,0,0\n")
    np.testing.assert_array_equal(np.hstack([points.old, points.new]), ROWS)


COLUMNS = "Without a header it must have 4 columns, x_old, y_old, x_new, y_new, or 5, an id first, or 8, with "
COLUMNS += "residuals last; it has 3"
NO_LINKS = "1,5,2,5,600,5,200,5\n5,5,2,5,604,5,200,5\n2,5,9,5,601,5,207,5\n"


@each(("text", "message"), [
    (None, "It cannot be read as text: No such file"),
    (b"\xff\xfe\x00", "It cannot be read as text"),
    ("", "It is empty"),
    ("1,2,3\n", COLUMNS),
    ("a,b,c,d\n1,2,3,4\n", "Its header must name x_old, y_old, x_new and y_new; it has no x_old"),
    ("1,2,3,4\n1,2,x,4\n", "Line 2 must have numbers for x_old, y_old, x_new, y_new"),
    ("1,2,3,4\n1,2\n", "Line 2 must have numbers"),
    ("1,2,3,4\n1,2,3,4,5\n", "Line 2 has 5 cells; it must have 4"),
    ("1,2,3,4\n2,3,4,5\n", "It has 2 control points; there must be at least 3"),
    ("0,0,3,4\n1,1,4,9\n2,2,9,5\n", "must not lie on one line, as they do on the old map"),
    ("0,0,0,0\n1,2,1,0\n2,2,3,0\n", "must not lie on one line, as they do in truth"),
    ("a,0,0,0,0\nb,1,2,1,0\na,2,2,3,9\n", "There are two 'a'"),
    ("0,0,0,0\n1,1e303,1,0\n2,2,3,0\n", "Invalid control point '2'. It must lie within 1e.15 on the old map"),
    ("0,0,0,0\n1,3,1,0\n2,2,3,-1e16\n", "Invalid control point '3'. It must lie within 1e.15 in truth"),
    ("1,1,0,0\n1,1,1,0\n1,1,3,9\n", "Invalid control points. They must not be in one place, as they are on the"),
    ("0,0,0,0\n1,nan,1,0\n2,2,3,0\n", "Invalid control point '2'. Its places must be finite"),
    (NO_LINKS, "It has 8 columns of whole numbers. With decimal commas, semicolons must separate"),
    ("-gcp 1 2 3\n", r"Line 1 must have -gcp pixel line easting northing \[elevation\]\.$"),
    ("-gcp 1 2 3 4\n-gcp 1,5 2,5 3,5 4,5\n", r"Line 2 must have -gcp pixel line"),
    ('-gcp 1 2 3 4 "in.tif\n', r"Line 1 has a quotation mark that does not end on the line\.$"),
    ("-gcp 1 2 3 4\n", r"It has 1 control points; there must be at least 3\.$"),
])  # fmt: skip
def test_wrong_files(text, message, tmp_path):
    """One line says what is wrong, and where."""
    path = tmp_path / "points.csv"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    refuses(rf"^Invalid points file '{path}'[^\n]*{message}[^\n]*$", read_control_points, path)


def test_coordinates_of_a_crs(read):
    """With a CRS truth that is no degrees is its coordinates, here of US survey feet, but for a stray one."""
    command = "gdal_translate -a_srs EPSG:2230 " + lines("-gcp {1} {2} {3} {4} ", FEET) + "in.tif out.tif\n"
    for found in (read(lines("{1},{2},{3},{4}\n", FEET), crs="EPSG:2230"), read(command)):
        np.testing.assert_allclose(found.new[1] / FOOT, [6500100, 1900000], rtol=1e-12)
    refuses(r"Its lat is .480", read, "0,0,7,47\n10,0,8,47\n0,10,7,48\n10,10,8,480\n", crs="EPSG:32632")


def stating(crs, rows=FEET):
    """QGIS's file of points with a CRS in its first line."""
    return f"#CRS: {crs}\nmapX,mapY,sourceX,sourceY,enable\n" + lines("{3},{4},{1},{2},1\n", rows)


@each("crs", ["EPSG:2230", CRS("EPSG:2230").to_wkt(), CRS("EPSG:2230").to_wkt("WKT1_GDAL")])
def test_the_crs_that_a_file_states(crs, read):
    """Is the plane of its coordinates, in its unit, with a word neither for the same one nor for the same given."""
    for given in (None, "EPSG:2230"):
        found = read(stating(crs), crs=given)
        np.testing.assert_allclose(found.new[1] / FOOT, [6500100, 1900000], rtol=1e-12)
        assert found.chosen(np.array([True, True, True])).crs is found.crs is not None


def test_another_crs_than_a_file_states(read):
    """What is given holds, which is told; the same zone in metres is another."""
    for given in ("EPSG:32611", "EPSG:26946"):
        with pytest.warns(Notice, match=rf"^'.*' states the CRS NAD83 / California zone 6 \(ftUS\); .* of {given}\.$"):
            np.testing.assert_array_equal(read(stating("EPSG:2230"), crs=given).new[1], [6500100, 1900000])


def test_degrees_in_a_file_that_states_a_crs(read):
    """They are brought to the given plane, over the datum, as pyproj does it; where metres are stated, told of."""
    truth = planes("EPSG:4149", "EPSG:25832")
    np.testing.assert_allclose(read(stating("EPSG:4149", DEGREES), crs="EPSG:25832").new, truth, atol=1e-3)
    refuses(r"Its truth is longitudes and latitudes; a CRS is needed", read, stating("EPSG:4149", DEGREES))
    told = r"^3 of 3 control point\(s\) of '.*' look like degrees, as that at 7\.5, 47\.5, but"
    with pytest.warns(Notice, match=told):
        found = read(stating("EPSG:32632", DEGREES))
    np.testing.assert_allclose(found.new, planes("EPSG:4326", "EPSG:32632"), atol=1e-6)


@each("crs", ["EPSG:99999", 'LOCAL_CS["x",UNIT["metre",1]]', 'PROJCRS["x"'])
def test_a_crs_that_is_none(crs, read):
    """It is refused in one line, unless another is given."""
    refuses(r"^Invalid points file '.*'\. It states a CRS that is not a plane of the Earth", read, stating(crs))
    assert read(stating(crs), crs="EPSG:2230").crs is not None
