"""Regions from tables and files of points and polygons: formats, CRSs, edges and repairs, and what is refused."""

import json
import math
import re
import sys

import numpy as np
import pyproj
import pytest
import shapely
from refusals import refuses
from region_texts import area, geodesic_area, refused, square
from tables import each

from projdist import Notice
from projdist.answers.points_and_lines import factors
from projdist.answers.summaries import compare, summarize
from projdist.regions import Box, PointSet, get_region, line_of

SQUARE = square(0, 0, 10, 10)
METRES = {"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}}


def collection(*rings, kind="Polygon", **members):
    """GeoJSON of one feature."""
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": kind, "coordinates": list(rings)}}
    return {"type": "FeatureCollection", "features": [feature], **members}


def geojson(path, *rings, **members):
    path.write_text(json.dumps(collection(*rings, **members)))
    return path


def mercator(*points):
    """Longitudes and latitudes in Web Mercator."""
    return np.transpose(
        pyproj.Transformer.from_crs(4326, 3857, always_xy=True).transform(*np.transpose(points))
    ).tolist()


def test_geojson(tmp_path):
    """A GeoJSON file, the same object in Python, and shapely's geometry are one region."""
    path = geojson(tmp_path / "square.geojson", SQUARE)
    regions = [get_region(one) for one in (f"file:{path}", json.loads(path.read_text()), shapely.box(0, 0, 10, 10))]
    assert [one.area_km2 for one in regions] == pytest.approx([Box(0, 0, 10, 10).area_km2] * 3, rel=1e-12)
    assert regions[0].name == f"file:{path}"


@each("name", ["a - b (1).geojson", "a & b.geojson", "with#mark.geojson", 'plus + ".geojson'])
def test_awkward_paths(tmp_path, name):
    """Paths with blanks, operators, brackets and marks can be given in quotation marks."""
    path = geojson(tmp_path / name.replace('"', ""), SQUARE)
    assert area(f'file:"{path}" & box:0,0,5,5') == pytest.approx(area("box:0,0,5,5"), rel=1e-12)


def test_another_crs(tmp_path):
    """Edges are straight in the file's CRS: a rectangle in Web Mercator is a box, one in Switzerland is as wide."""
    corners = mercator((5, 45), (10, 45), (10, 50), (5, 50), (5, 45))
    path = geojson(tmp_path / "m.geojson", corners, **METRES)
    assert area(f"file:{path}") == pytest.approx(area("box:5,45,10,50"), rel=1e-9)
    ring = square(2.55e6, 1.1e6, 2.75e6, 1.25e6)
    path = geojson(path, ring, crs={"type": "name", "properties": {"name": "EPSG:2056"}})
    dense = shapely.get_coordinates(shapely.segmentize(shapely.Polygon(ring), 100.0))
    lonlat = pyproj.Transformer.from_crs("EPSG:2056", "EPSG:4326", always_xy=True).transform(*dense.T)
    assert area(f"file:{path}") == pytest.approx(geodesic_area(np.transpose(lonlat)), rel=1e-7)


def test_geodesic_edges(tmp_path):
    """Three geodesics have GeographicLib's area, also across the antimeridian; straight edges another one."""
    for west in (0, 170):
        ring = [[west, 20], [west + 40, 35], [west + 10, 60], [west, 20]]
        path, truth = geojson(tmp_path / "t.geojson", ring), geodesic_area(ring)
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
    wide = get_region(f"file:{geojson(path, square(-100, 0, 100, 10))}")
    said = "2 edge(s) wider than 180 degrees run the shorter way, across the antimeridian."
    assert wide.notes == (f"file:{path}: {said}",)
    assert wide.bounds == pytest.approx((100, 0, 260, 10))


POLYGONS = "It holds no polygons."
POINT = "It must hold polygons only; it holds a Point."
UNNAMED = "It must be GeoJSON; its crs must have properties with the name of a CRS, a text."
NUMBERS = "Its coordinates must be numbers."
NO_WKT = "It must hold WKT of geometries: "
ELSEWHERE = (
    "Its coordinates must be longitudes within -360 and 360 and latitudes within -90 and 90, or the file must state "
    "another CRS; it has"
)


RINGS = [
    (SQUARE[:-1], "Each of its rings must end where it begins; one begins at 0, 0 and ends at 0, 10."),
    ([[0, 0], [10, 0], [0, 0]], "Each of its rings must have four positions or more; one has 3."),
    ([[26e5, 12e5], [27e5, 12e5], [27e5, 13e5], [26e5, 12e5]], f"{ELSEWHERE} 2600000, 1200000."),
    ([[45, 170], [45, 175], [50, 175], [45, 170]], f"{ELSEWHERE} 45, 170."),
    ([[0, 0], [math.nan, 0], [10, 10], [0, 0]], "Its coordinates must be finite numbers."),
    *(([["a", "b"], [1, 0], [10, 10], ["a", "b"]], NUMBERS), ([[10**400, 0], *SQUARE], NUMBERS)),
    ([[0, 0], [10, 10], [5, 5], [0, 0]], "Its polygons have no area."),
]
OBJECTS = [
    ("", "It must be GeoJSON: Expecting value: line 1 column 1 (char 0)."),
    ([1], "It must be GeoJSON; it has an object of type None."),
    ({"type": "Topology"}, "It must be GeoJSON; it has an object of type 'Topology'."),
    *(({"type": "FeatureCollection", "features": []}, POLYGONS), ({"type": "Feature", "geometry": None}, POLYGONS)),
    ({"type": "Point", "coordinates": [1, 2]}, POINT),
    (collection(SQUARE, crs="EPSG:4326"), "It must be GeoJSON; its crs must be an object."),
    *((collection(SQUARE, crs=crs), UNNAMED) for crs in ({}, {"foo": 1}, {"type": "name"})),
    (collection(SQUARE, crs={"properties": {"name": [1]}}), UNNAMED),
    (collection(SQUARE, crs={"type": "link", "properties": {"href": "x"}}), UNNAMED),
    ({"type": "Polygon"}, "Its polygons must have coordinates, lists of rings."),
    ({"type": "MultiPolygon", "coordinates": [3]}, "Its polygons must have coordinates, lists of rings."),
]
WKT = [
    *(("", POLYGONS), ("POLYGON EMPTY", POLYGONS), ("POINT(1 2)", POINT)),
    ("POLYGON((0 0,10 0,10 10", f"{NO_WKT}ParseException: Expected word"),
    ('PROJCS["WGS 84"]', f"{NO_WKT}ParseException: Unknown type"),
    ("CURVEPOLYGON(CIRCULARSTRING(0 0,4 0,4 4,0 4,0 0))", NO_WKT),
    ("POLYGON((1e400 0,1 0,1 1,1e400 0))", "Its coordinates must be finite numbers."),
    ("SRID=3857;POINT(1 2)SRID=4326;POINT(1 2)", "Its geometries must have one SRID; they have 3857, 4326."),
]
SOME_POINT = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}}
POINTS = [
    *(({"type": "Point", "coordinates": [[]]}, NUMBERS), ({"type": "Point"}, NUMBERS)),
    ({"type": "FeatureCollection", "features": 5}, "It must be GeoJSON; its features must be a list."),
    (SOME_POINT | {"properties": [1]}, "It must be GeoJSON; its properties must be an object."),
    (SOME_POINT | {"properties": {"weight": "cow"}}, "Point 1 must have a number for weight."),
    (SOME_POINT | {"properties": {"height": [2]}}, "Point 1 must have a number for height."),
]
COMMAS = " Decimal commas are read where all numbers have them and cells are separated by semicolons, tabs or blanks."
TABLES = [
    *(("", "It is empty."), ("x,y\n1,2\n", "Its header must have lon and lat; it has x, y.")),
    *(("lon,lat\n", "It has no points."), ("lon,lat\n1,2\n3,north\n", "Line 3 must have numbers for lon, lat.")),
    ("lon,lat,weight\n1,2\n", "Line 2 must have numbers for lon, lat, weight."),
    ("lon,lat,name\n,2,a\n3,,b\n", "It has no points with a longitude and a latitude."),
    ("lon,lat,weight\n1,2,\n", "Line 2 must have numbers for lon, lat, weight."),
    ("lon,lat\n1,2\n8,5,47,a\n", "Line 3 has 4 cells; it must have 2."),
    ("lon,lat\n1,2\n8,5,47,3\n", f"Line 3 has 4 cells; it must have 2.{COMMAS}"),
    ("lon;lat\n1.5;2\n8,5;47,3\n", f"Line 3 must have numbers for lon, lat.{COMMAS}"),
    ("lon,lat\n1,2\n1_0,2\n", "Line 3 must have numbers for lon, lat."),
    (
        'lon,lat,name\n1,2,a\n3,4,"b\n5,6,c\n7,8,d"\n',
        "Line 3 has a quotation mark that does not end its cell on the line.",
    ),
    ("lon,lat,name\n1,2," + 200_000 * "a" + "\n", "Line 2 has a cell of more than 131072 letters."),
]


@each(("kind", "suffix", "content", "reason"), [
    *(("file", "geojson", collection(ring), reason) for ring, reason in RINGS),
    *((kind, "geojson", *one) for one in OBJECTS for kind in ("file", "geodesic")),
    *(*(("file", "wkt", *one) for one in WKT), *(("points", "geojson", *one) for one in POINTS)),
    *(("points", "csv", *one) for one in TABLES),
])  # fmt: skip
def test_wrong_files(kind, suffix, content, reason, tmp_path):
    """What is no region is refused in one line, with what is wrong, and in tables where."""
    path = tmp_path / f"wrong.{suffix}"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    said = refused(f"{kind}:{path}")
    expected = f"Invalid {'points' if kind == 'points' else 'region'} file '{path}'. {reason}"
    assert said == expected if reason.endswith(".") else said.startswith(expected)


def test_files_that_cannot_be_read(tmp_path, monkeypatch):
    """One that is not there or not named, and one whose format needs an extra, which is named."""
    path = tmp_path / "none.geojson"
    assert refused(f"file:{path}") == f"Invalid region file '{path}'. It cannot be read: No such file or directory."
    assert refused("file:") == "Invalid region 'file:'. It must have the path of a file after the colon."
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    needed = "Without pyogrio only GeoJSON can be read: pip install 'projdist[gis]' reads other formats."
    assert refused("file:a.gpkg#roads") == f"Invalid region file 'a.gpkg'. {needed}"


@pytest.mark.parametrize("suffix", ["gpkg", "shp", "fgb"])
def test_vector_files(tmp_path, suffix):
    """GeoPackage, Shapefile and FlatGeobuf are read in their CRS, polygons and points."""
    write = pytest.importorskip("pyogrio").raw.write
    ring = np.array([shapely.Polygon(mercator((5, 45), (10, 45), (10, 50), (5, 50))).wkb])
    write(path := tmp_path / f"a.{suffix}", ring, geometry_type="Polygon", crs="EPSG:3857", field_data=[], fields=[])
    assert area(f"file:{path}") == pytest.approx(area("box:5,45,10,50"), rel=1e-9)
    assert "Invalid points file" in refused(f"points:{path}")
    weights = {"field_data": [np.array([2.5])], "fields": np.array(["weight"])}
    point = np.array([shapely.Point(*mercator((5, 45))).wkb])
    write(path := tmp_path / f"b.{suffix}", point, geometry_type="Point", crs="EPSG:3857", **weights)
    points = get_region(f"points:{path}")
    assert (points.lon[0], points.lat[0], points.weight[0]) == pytest.approx((5, 45, 2.5))
    if suffix == "gpkg":
        assert refused(f"points:{path}#no").startswith(f"Invalid points file '{path}'. It cannot be read: Layer 'no'")


def test_what_gdal_cannot_read(tmp_path, monkeypatch):
    """Tables without geometries, and other files with its reason, but not its advice; so it is in `check`."""
    pyogrio, gis = pytest.importorskip("pyogrio"), pytest.importorskip("projdist.gis")
    table, path, parquet = tmp_path / "p.csv", tmp_path / "x.gpkg", tmp_path / "p.parquet"
    table.write_text("name,lon,lat\na,1,2\n")
    path.write_text("no data")
    parquet.write_bytes(b"PAR1")
    for kind in ("file", "geodesic"):
        assert refused(f"{kind}:{table}") == f"Invalid region file '{table}'. It has no geometries."
    said = f"It cannot be read: '{path}' not recognized as being in a supported file format."
    for kind in ("file", "points"):
        assert refused(f"{kind}:{path}").endswith(said)
    refuses(f"{re.escape(said)}$", gis.read_data, path)
    # What GDAL's reader of nothing says names libraries that nobody asked for.
    monkeypatch.setattr(pyogrio, "list_drivers", lambda: {"GPKG": "rw"})
    assert refused(f"file:{parquet}").endswith("reads no Parquet; GeoPackage and GeoJSON are read.")


SHAPES = {
    "POLYGON((0 0,10 0,10 10,0 10,0 0))": "box:0,0,10,10",
    "POLYGON ((0 0, 10 0,\n10 10, 0 10, 0 0))\nPOLYGON((8 0,30 0,30 10,8 10,8 0))": "box:0,0,30,10",
    "GEOMETRYCOLLECTION(MULTIPOLYGON(((0 0,10 0,10 10,0 10,0 0))), POLYGON EMPTY)": "box:0,0,10,10",
    # x = a lon, y = a ln tan(45 + lat / 2) of 10 degrees, to a tenth of a millimetre.
    "SRID=3857;POLYGON((0 0,1113194.9079 0,1113194.9079 1118889.9749,0 1118889.9749,0 0))": "box:0,0,10,10",
}


@each("text, box", SHAPES.items())
def test_well_known_text(text, box, tmp_path):
    (tmp_path / "r.wkt").write_text(text)
    assert area(f"file:{tmp_path / 'r.wkt'}") == pytest.approx(area(box), rel=1e-9)
    (tmp_path / "p.wkt").write_text("POINT(1 2) POINT Z (3 4 5)\n")
    assert get_region(f"points:{tmp_path / 'p.wkt'}").lat.tolist() == [2.0, 4.0]


def test_degrees_that_are_stated_to_be_metres(tmp_path):
    """A field of 7.4 by 11 km in metres is one of 0.1 m, which is told; so it is of the same object in Python."""
    told = r"^1 of 1 feature\(s\) of {} look like degrees, as that at 11, 48, but WGS 84 / Pseudo-Mercator is in"
    field, path = square(11.0, 48.0, 11.1, 48.1), tmp_path / "field.geojson"
    with pytest.warns(Notice, match=told.format("the geometries")):
        assert get_region(collection(field, **METRES)).area_km2 < 1e-7
    for kind, rings, read in (
        ("Polygon", [field], lambda path: get_region(f"file:{path}")),
        ("Point", field[0], lambda path: get_region(f"points:{path}")),
        ("LineString", field[:2], line_of),
    ):
        geojson(path, *rings, kind=kind, **METRES)
        with pytest.warns(Notice, match=told.format(f"'{path}'")):
            read(path)
    geojson(path, mercator(*field), **METRES)
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
    omega, worst = found.measures["omega"], at.omega.argmax()
    assert omega.mean == pytest.approx(np.average(at.omega, weights=[2, 1, 3]), rel=1e-12)
    assert omega.max == pytest.approx(at.omega[worst], rel=1e-15)
    assert omega.max_at == pytest.approx((region.lon[worst], region.lat[worst]))
    assert compare(["robin"], region).to_dict()["region"] == {"name": f"points:{path}", "area_km2": 0.0, "points": 3}


def test_points_beyond_the_map():
    """Points that a map does not show are not covered, by their share of the weight."""
    points = PointSet(np.array([0.0, 10.0, 180.0]), np.zeros(3), np.array([1.0, 2.0, 1.0]))
    assert summarize("+proj=ortho", points).coverage == 0.75


def test_points_combine(tmp_path):
    """Points may be chosen by regions, and stand on the left only."""
    path, germany = tmp_path / "cities.csv", "country:DE@110m"
    path.write_text(CSV.replace(",", ";"))
    assert get_region(f"points:{path} & {germany}").weight.tolist() == [1]
    assert get_region(f"points:{path} - {germany}").weight.tolist() == [2, 3]
    assert refused(f"points:{path} & box:0,0,1,1").endswith("Nothing is left of it.")
    assert refused(f"globe & points:{path}").endswith("Points can only stand on the left of & and -.")


def points_of(*coordinates):
    """Features of points as GeoJSON, without a geometry where there are no coordinates."""
    shapes = [None if one is None else {"type": "Point", "coordinates": one} for one in coordinates]
    features = [{"type": "Feature", "properties": {}, "geometry": shape} for shape in shapes]
    return json.dumps({"type": "FeatureCollection", "features": features})


@each(("file", "text"), [
    ("p.csv", "name,lon,lat,weight,h\na,1,2,1,5\nb,,2,1,6\nc,3,NA,1,7\nd,4,5,2,8\ne,nan,5,2,9\n"),
    ("p.geojson", points_of([1, 2], None, [], [4, 5], None)),
])  # fmt: skip
def test_points_without_coordinates_are_left_out(file, text, tmp_path):
    """The others are read, and a note says how many are not."""
    (tmp_path / file).write_text(text)
    points = get_region(f"points:{tmp_path / file}")
    assert (points.lon.tolist(), points.lat.tolist()) == ([1.0, 4.0], [2.0, 5.0])
    assert points.notes == (f"{points.name}: 3 of 5 points have no longitude or no latitude, and are left out.",)
    if file.endswith(".csv"):
        assert (points.weight.tolist(), points.height.tolist()) == ([1.0, 2.0], [5.0, 8.0])


ON_EARTH = "it must have a longitude within -360 and 360, a latitude within -90 and 90."


@each(("row", "reason"), [
    *(("1,95,1", f"Point 1 is at 1, 95; {ON_EARTH}"), ("inf,5,1", f"Point 1 is at inf, 5; {ON_EARTH}")),
    ("1,5,-1", "Point 1 has the weight -1; it must be finite and not negative."),
    ("1,5,nan", "Point 1 has the weight nan; it must be finite and not negative."),
    ("1,5,0", "Their weights must not all be zero."),
])  # fmt: skip
def test_wrong_points(tmp_path, row, reason):
    path = tmp_path / "points.csv"
    path.write_text(f"lon,lat,weight\n{row}\n")
    assert refused(f"points:{path}") == f"Invalid points 'points:{path}'. {reason}"
