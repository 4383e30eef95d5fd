"""Regions from tables and files of points and polygons: formats, CRSs, edges and repairs, and what is refused."""

import json
import math
import re
import sys

import numpy as np
import pyproj
import pytest
import shapely
from region_texts import area, refused
from tables import each

from projdist import Notice
from projdist.answers.points_and_lines import factors
from projdist.answers.summaries import compare, summarize
from projdist.regions import Box, PointSet, get_region, line_of

SQUARE = [[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]]


def geojson(path, *rings, kind="Polygon", **members):
    """A file with one feature."""
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": list(rings)}}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature], **members}))
    return path


def test_geojson(tmp_path):
    """A GeoJSON file, the same object in Python, and shapely's geometry are one region."""
    path = geojson(tmp_path / "square.geojson", SQUARE)
    truth = Box(0, 0, 10, 10).area_km2
    assert area(f"file:{path}") == pytest.approx(truth, rel=1e-12)
    assert get_region(json.loads(path.read_text())).area_km2 == pytest.approx(truth, rel=1e-12)
    assert get_region(shapely.box(0, 0, 10, 10)).area_km2 == pytest.approx(truth, rel=1e-12)
    assert get_region(f"file:{path}").name == f"file:{path}"


@pytest.mark.parametrize("name", ["a - b (1).geojson", "a & b.geojson", "with#mark.geojson", 'plus + ".geojson'])
def test_awkward_paths(tmp_path, name):
    """Paths with blanks, operators, brackets and marks can be given in quotation marks."""
    path = geojson(tmp_path / name.replace('"', ""), SQUARE)
    assert area(f'file:"{path}" & box:0,0,5,5') == pytest.approx(area("box:0,0,5,5"), rel=1e-12)


def test_another_crs(tmp_path):
    """Edges are straight in the file's CRS: a rectangle in Web Mercator is a box, one in Switzerland is as wide."""
    to_mercator = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:3857", always_xy=True)
    corners = [to_mercator.transform(*corner) for corner in [(5, 45), (10, 45), (10, 50), (5, 50), (5, 45)]]
    name = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}
    assert area(f"file:{geojson(tmp_path / 'm.geojson', corners, crs=name)}") == pytest.approx(
        area("box:5,45,10,50"), rel=1e-9
    )
    ring = [[2.55e6, 1.1e6], [2.75e6, 1.1e6], [2.75e6, 1.25e6], [2.55e6, 1.25e6], [2.55e6, 1.1e6]]
    name["properties"]["name"] = "EPSG:2056"
    found = area(f"file:{geojson(tmp_path / 's.geojson', ring, crs=name)}")
    dense = shapely.get_coordinates(shapely.segmentize(shapely.Polygon(ring), 100.0))
    lonlat = pyproj.Transformer.from_crs("EPSG:2056", "EPSG:4326", always_xy=True).transform(*dense.T)
    truth = abs(pyproj.Geod(ellps="WGS84").polygon_area_perimeter(*lonlat)[0]) / 1e6
    assert found == pytest.approx(truth, rel=1e-7)


def test_geodesic_edges(tmp_path):
    """Three geodesics have GeographicLib's area, also across the antimeridian; straight edges another one."""
    for west in (0, 170):
        ring = [[west, 20], [west + 40, 35], [west + 10, 60], [west, 20]]
        path = geojson(tmp_path / "t.geojson", ring)
        truth = abs(pyproj.Geod(ellps="WGS84").polygon_area_perimeter(*np.array(ring, dtype=float).T)[0]) / 1e6
        assert area(f"geodesic:{path}") == pytest.approx(truth, rel=1e-8)
        assert area(f"file:{path}") != pytest.approx(truth, rel=1e-3)


def test_repaired(tmp_path):
    """A self-intersecting polygon is repaired, with a note of the area that came or went; others have no notes."""
    path = geojson(tmp_path / "bow.geojson", [[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]])
    region = get_region(f"file:{path}")
    (note,) = region.notes
    assert note.startswith(f"file:{path}: 1 self-intersecting polygon(s) repaired; the area changed by ")
    assert float(note.split()[-2]) == pytest.approx(region.area_km2, rel=0.02)  # the two halves nearly cancelled
    assert get_region(f"file:{geojson(path, SQUARE)}").notes == ()
    wide = get_region(f"file:{geojson(path, [[-100, 0], [100, 0], [100, 10], [-100, 10], [-100, 0]])}")
    assert wide.notes == (
        f"file:{path}: 2 edge(s) wider than 180 degrees run the shorter way, across the antimeridian.",
    )
    assert wide.bounds == pytest.approx((100, 0, 260, 10))


UNCLOSED = "Each of its rings must end where it begins; one begins at 0, 0 and ends at 0, 10."
ELSEWHERE = (
    "Its coordinates must be longitudes within -360 and 360 and latitudes within -90 and 90, or the file must state "
    "another CRS; it has"
)


@each(
    ("content", "reason"),
    [
        (SQUARE[:-1], UNCLOSED),
        ([[0, 0], [10, 0], [0, 0]], "Each of its rings must have four positions or more; one has 3."),
        ([[26e5, 12e5], [27e5, 12e5], [27e5, 13e5], [26e5, 12e5]], f"{ELSEWHERE} 2600000, 1200000."),
        ([[45, 170], [45, 175], [50, 175], [45, 170]], f"{ELSEWHERE} 45, 170."),
        ([[0, 0], [math.nan, 0], [10, 10], [0, 0]], "Its coordinates must be finite numbers."),
        ([["a", "b"], [1, 0], [10, 10], ["a", "b"]], "Its coordinates must be numbers."),
        ([[0, 0], [10, 10], [5, 5], [0, 0]], "Its polygons have no area."),
        ("", "It must be GeoJSON: Expecting value: line 1 column 1 (char 0)."),
        ("[1]", "It must be GeoJSON; it has an object of type None."),
        ('{"type": "Topology"}', "It must be GeoJSON; it has an object of type 'Topology'."),
        ('{"type": "FeatureCollection", "features": []}', "It holds no polygons."),
        ('{"type": "Feature", "geometry": null}', "It holds no polygons."),
        ('{"type": "Point", "coordinates": [1, 2]}', "It must hold polygons only; it holds a Point."),
    ],
)
def test_wrong_files(tmp_path, content, reason):
    """A ring that is no polygon in longitude and latitude, or a text without one, is refused in one line."""
    path = tmp_path / "wrong.geojson"
    path.write_text(content) if isinstance(content, str) else geojson(path, content)
    assert refused(f"file:{path}") == f"Invalid region file '{path}'. {reason}"


def test_files_that_cannot_be_read(tmp_path, monkeypatch):
    """One that is not there or not named, and one whose format needs an extra, which is named."""
    path = tmp_path / "none.geojson"
    assert refused(f"file:{path}") == f"Invalid region file '{path}'. It cannot be read: No such file or directory."
    assert refused("file:") == "Invalid region 'file:'. It must have the path of a file behind the colon."
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    assert refused("file:a.gpkg#roads") == (
        "Invalid region file 'a.gpkg'. Without pyogrio only GeoJSON can be read: pip install 'projdist[gis]' reads "
        "other formats."
    )


@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
def test_vector_files(tmp_path, suffix):
    """GeoPackage, Shapefile and FlatGeobuf are read in their CRS, polygons and points."""
    pyogrio = pytest.importorskip("pyogrio")
    path = tmp_path / f"a.{suffix}"
    to_mercator = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:3857", always_xy=True)
    ring = shapely.Polygon([to_mercator.transform(lon, lat) for lon, lat in [(5, 45), (10, 45), (10, 50), (5, 50)]])
    no_fields = {"field_data": [], "fields": []}
    pyogrio.raw.write(path, np.array([ring.wkb]), geometry_type="Polygon", crs="EPSG:3857", **no_fields)
    assert area(f"file:{path}") == pytest.approx(area("box:5,45,10,50"), rel=1e-9)
    assert "Invalid points file" in refused(f"points:{path}")
    point = shapely.Point(to_mercator.transform(5, 45))
    weights = {"field_data": [np.array([2.5])], "fields": np.array(["weight"])}
    path = tmp_path / f"b.{suffix}"
    pyogrio.raw.write(path, np.array([point.wkb]), geometry_type="Point", crs="EPSG:3857", **weights)
    points = get_region(f"points:{path}")
    assert (points.lon[0], points.lat[0], points.weight[0]) == pytest.approx((5, 45, 2.5))
    if suffix == "gpkg":
        assert refused(f"points:{path}#no").startswith(f"Invalid points file '{path}'. It cannot be read: Layer 'no'")


@pytest.mark.parametrize("kind", ["file", "geodesic"])
def test_tables_are_no_polygons(kind, tmp_path):
    """A table without geometries, which GDAL reads, is one line (it was a traceback)."""
    pytest.importorskip("pyogrio")
    path = tmp_path / "p.csv"
    path.write_text("name,lon,lat\na,1,2\n")
    assert refused(f"{kind}:{path}") == f"Invalid region file '{path}'. It has no geometries."


def test_parquet_without_its_driver(tmp_path, monkeypatch):
    """What GDAL's reader of nothing says names libraries that nobody asked for."""
    pyogrio = pytest.importorskip("pyogrio")
    monkeypatch.setattr(pyogrio, "list_drivers", lambda: {"GPKG": "rw"})
    (tmp_path / "p.parquet").write_bytes(b"PAR1")
    assert refused(f"file:{tmp_path / 'p.parquet'}").endswith("reads no Parquet; GeoPackage and GeoJSON are read.")


WKT = {
    "POLYGON((0 0,10 0,10 10,0 10,0 0))": "box:0,0,10,10",
    "POLYGON ((0 0, 10 0,\n10 10, 0 10, 0 0))\nPOLYGON((8 0,30 0,30 10,8 10,8 0))": "box:0,0,30,10",
    "GEOMETRYCOLLECTION(MULTIPOLYGON(((0 0,10 0,10 10,0 10,0 0))), POLYGON EMPTY)": "box:0,0,10,10",
    # x = a lon, y = a ln tan(45 + lat / 2) of 10 degrees, to a tenth of a millimetre.
    "SRID=3857;POLYGON((0 0,1113194.9079 0,1113194.9079 1118889.9749,0 1118889.9749,0 0))": "box:0,0,10,10",
}


@pytest.mark.parametrize("text", WKT)
def test_well_known_text(text, tmp_path):
    """One geometry or more, collections, and a CRS by its SRID."""
    (tmp_path / "r.wkt").write_text(text)
    assert get_region(f"file:{tmp_path / 'r.wkt'}").area_km2 == pytest.approx(get_region(WKT[text]).area_km2, rel=1e-9)
    (tmp_path / "p.wkt").write_text("POINT(1 2) POINT Z (3 4 5)\n")
    assert get_region(f"points:{tmp_path / 'p.wkt'}").lat.tolist() == [2.0, 4.0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        *(("", "It holds no polygons."), ("POLYGON EMPTY", "It holds no polygons.")),
        ("POINT(1 2)", "It must hold polygons only; it holds a Point."),
        ("POLYGON((0 0,10 0,10 10", "It must hold WKT of geometries: ParseException: Expected word"),
        ('PROJCS["WGS 84"]', "It must hold WKT of geometries: ParseException: Unknown type"),
        ("CURVEPOLYGON(CIRCULARSTRING(0 0,4 0,4 4,0 4,0 0))", "It must hold WKT of geometries: "),
        ("POLYGON((1e400 0,1 0,1 1,1e400 0))", "Its coordinates must be finite numbers."),
        ("SRID=3857;POINT(1 2)SRID=4326;POINT(1 2)", "Its geometries must have one SRID; they have 3857, 4326."),
    ],
)
def test_wrong_well_known_text(text, reason, tmp_path):
    """One line."""
    (tmp_path / "r.wkt").write_text(text)
    assert refused(f"file:{tmp_path / 'r.wkt'}").startswith(f"Invalid region file '{tmp_path / 'r.wkt'}'. {reason}")


@pytest.mark.parametrize("kind", ["file", "points"])
def test_files_of_no_format(kind, tmp_path):
    """GDAL's reason, without its advice on how to call it; `check` and `factors --at` say the same."""
    pytest.importorskip("pyogrio")
    gis = pytest.importorskip("projdist.gis")
    path = tmp_path / "x.gpkg"
    path.write_text("no data")
    said = f"'{path}' not recognized as being in a supported file format."
    assert refused(f"{kind}:{path}").endswith(f"It cannot be read: {said}")
    with pytest.raises(ValueError, match=rf"It cannot be read: {re.escape(said)}$"):
        gis.read_data(path)


DEGREES = [[11.0, 48.0], [11.1, 48.0], [11.1, 48.1], [11.0, 48.1], [11.0, 48.0]]
METRES = {"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}}


def test_degrees_that_are_stated_to_be_metres(tmp_path):
    """A field of 7.4 by 11 km in metres is one of 0.1 m, which is told; so it is of the same object in Python."""
    told = r"^1 of 1 feature\(s\) of {} look like degrees, as that at 11, 48, but WGS 84 / Pseudo-Mercator is in"
    path = geojson(tmp_path / "field.geojson", DEGREES, **METRES)
    with pytest.warns(Notice, match=told.format(f"'{path}'")):
        assert get_region(f"file:{path}").area_km2 < 1e-7
    with pytest.warns(Notice, match=told.format("the geometries")):
        get_region(json.loads(path.read_text()))
    path = geojson(tmp_path / "place.geojson", *DEGREES[0], kind="Point", **METRES)
    with pytest.warns(Notice, match=told.format(f"'{path}'")):
        get_region(f"points:{path}")
    path = geojson(tmp_path / "way.geojson", *DEGREES[:2], kind="LineString", **METRES)
    with pytest.warns(Notice, match=told.format(f"'{path}'")):
        line_of(path)
    square = np.array(DEGREES)
    moved = pyproj.Transformer.from_crs(4326, 3857, always_xy=True).transform(*square.T)
    geojson(path, np.transpose(moved).tolist(), **METRES)
    assert area(f"file:{path}") == pytest.approx(area("box:11,48,11.1,48.1"), rel=1e-9)


# ---- points ---------------------------------------------------------------------------------------
CSV = "name,lon,lat,weight,height\nA,2.35,48.85,2,35\nB,13.4,52.5,1,34\nC,-3.7,40.4,3,660\n\n"


def test_points(tmp_path):
    """The errors over points are weighted means of their factors; so are a measure's statistics."""
    path = tmp_path / "cities.csv"
    path.write_text(CSV)
    region = get_region(f"points:{path}")
    assert region.height.tolist() == [35, 34, 660]
    found = summarize("robin", region, measures=["omega"])
    at = factors("robin", region.lon, region.lat)
    square = np.average(np.log(at.a) ** 2 + np.log(at.b) ** 2, weights=[2, 1, 3])
    assert found.airy_kavrayskiy == pytest.approx(math.sqrt(square), rel=1e-12)
    assert found.error_estimate < 1e-10
    assert found.measures["omega"].mean == pytest.approx(np.average(at.omega, weights=[2, 1, 3]), rel=1e-12)
    assert found.measures["omega"].max == pytest.approx(at.omega.max(), rel=1e-15)
    assert found.measures["omega"].max_at == pytest.approx(
        (region.lon[at.omega.argmax()], region.lat[at.omega.argmax()])
    )
    assert compare(["robin"], region).to_dict()["region"] == {"name": f"points:{path}", "area_km2": 0.0, "points": 3}


def test_points_beyond_the_map(tmp_path):
    """Points that a map does not show are not covered, by their share of the weight."""
    points = PointSet(np.array([0.0, 10.0, 180.0]), np.zeros(3), np.array([1.0, 2.0, 1.0]))
    assert summarize("+proj=ortho", points).coverage == 0.75


@pytest.mark.slow
def test_points_combine(tmp_path):
    """Points may be chosen by regions, and stand on the left only."""
    path = tmp_path / "cities.csv"
    path.write_text(CSV.replace(",", ";"))
    assert get_region(f"points:{path} & country:DE").weight.tolist() == [1]
    assert get_region(f"points:{path} - country:DE").weight.tolist() == [2, 3]
    assert refused(f"points:{path} & country:JP").endswith("Nothing is left of it.")
    assert refused(f"land & points:{path}").endswith("Points can only stand on the left of & and -.")


def points_of(*coordinates):
    """Features of points as GeoJSON, without a geometry where there are no coordinates."""
    shapes = [None if one is None else {"type": "Point", "coordinates": one} for one in coordinates]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    return json.dumps({"type": "FeatureCollection", "features": features})


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("p.csv", "name,lon,lat,weight,h\na,1,2,1,5\nb,,2,1,6\nc,3,NA,1,7\nd,4,5,2,8\ne,nan,5,2,9\n"),
        ("p.geojson", points_of([1, 2], None, [], [4, 5], None)),
    ],
)
def test_points_without_coordinates_are_left_out(file, text, tmp_path):
    """The others are read, and a note says how many are not."""
    (tmp_path / file).write_text(text)
    points = get_region(f"points:{tmp_path / file}")
    assert (points.lon.tolist(), points.lat.tolist()) == ([1.0, 4.0], [2.0, 5.0])
    assert points.notes == (f"{points.name}: 3 of 5 points have no longitude or no latitude, and are left out.",)
    if file.endswith(".csv"):
        assert (points.weight.tolist(), points.height.tolist()) == ([1.0, 2.0], [5.0, 8.0])


ON_EARTH = "it must have a longitude within -360 and 360, a latitude within -90 and 90."
COMMAS = " Decimal commas are read where all numbers have them and cells stand apart by semicolons, tabs or blanks."
QUOTED = 'lon,lat,name\n1,2,a\n3,4,"b\n5,6,c\n7,8,d"\n'


@each(
    ("text", "reason"),
    [
        *(("", "It is empty."), ("x,y\n1,2\n", "Its header must have lon and lat; it has x, y.")),
        ("lon,lat\n", "It has no points."),
        ("lon,lat\n1,2\n3,north\n", "Line 3 must have numbers for lon, lat."),
        ("lon,lat,weight\n1,2\n", "Line 2 must have numbers for lon, lat, weight."),
        ("lon,lat,name\n,2,a\n3,,b\n", "It has no points with a longitude and a latitude."),
        ("lon,lat,weight\n1,2,\n", "Line 2 must have numbers for lon, lat, weight."),
        ("lon,lat\n1,2\n8,5,47,a\n", "Line 3 has 4 cells; it must have 2."),
        ("lon,lat\n1,2\n8,5,47,3\n", f"Line 3 has 4 cells; it must have 2.{COMMAS}"),
        ("lon;lat\n1.5;2\n8,5;47,3\n", f"Line 3 must have numbers for lon, lat.{COMMAS}"),
        ("lon,lat\n1,2\n1_0,2\n", "Line 3 must have numbers for lon, lat."),
        (QUOTED, "Line 3 has a quotation mark that does not end its cell on the line."),
        ("lon,lat,name\n1,2," + 200_000 * "a" + "\n", "Line 2 has a cell of more than 131072 letters."),
    ],
)
def test_wrong_points_files(tmp_path, text, reason):
    """A table without points is refused with the line that is wrong."""
    path = tmp_path / "points.csv"
    path.write_text(text)
    assert refused(f"points:{path}") == f"Invalid points file '{path}'. {reason}"


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        *(("1,95,1", f"Point 1 is at 1, 95; {ON_EARTH}"), ("inf,5,1", f"Point 1 is at inf, 5; {ON_EARTH}")),
        ("1,5,-1", "Point 1 has the weight -1; it must be finite and not negative."),
        ("1,5,nan", "Point 1 has the weight nan; it must be finite and not negative."),
        ("1,5,0", "Their weights must not all be zero."),
    ],
)
def test_wrong_points(tmp_path, row, reason):
    """So are points off the Earth, and weights that are none."""
    path = tmp_path / "points.csv"
    path.write_text(f"lon,lat,weight\n{row}\n")
    assert refused(f"points:{path}") == f"Invalid points 'points:{path}'. {reason}"
