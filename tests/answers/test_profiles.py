"""Profiles along lines, against printed tables, closed forms and the map's own distances."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose
from pyproj import Geod, Proj
from refusals import refuses
from tables import each

from projdist import SPHERE, WGS84, Notice, factors, profile
from projdist.answers import Profile
from projdist.answers.points_and_lines import _round_step

R = SPHERE.a
UTM = "EPSG:32632"


def test_snyders_example_of_utm() -> None:
    """USGS Professional Paper 1395, page 270: 40 30' N, 73 30' W, on Clarke 1866 from 75 W, printed to 7 decimals."""
    found = profile("+proj=tmerc +lon_0=-75 +k_0=0.9996 +ellps=clrk66", [(-75, 40.5), (-73.5, 40.5)])
    assert (found.x[-1], found.y[-1]) == pytest.approx((127106.5, 4484124.4), abs=0.05)
    assert found.scale[-1] == pytest.approx(0.9997989, abs=5e-8)
    assert found.scale[0] == pytest.approx(0.9996, abs=1e-10)


def test_scale_in_the_direction_of_the_line() -> None:
    """On the plate carree h = 1 and k = 1 / cos(lat); a great circle keeps sin(azimuth) cos(lat) (Clairaut)."""
    found = profile(f"+proj=eqc +R={R}", [(0, 0), (100, 50)], measures=["k"])
    lat = np.radians(found.lat)
    sin = math.sin(math.radians(found.azimuth[0])) / np.cos(lat)  # at the equator cos(lat) = 1
    assert_allclose(np.abs(np.sin(np.radians(found.azimuth))), sin, atol=1e-12)
    assert_allclose(found.scale, np.sqrt((sin / np.cos(lat)) ** 2 + 1.0 - sin**2), rtol=1e-10)
    assert_allclose(found.measures["k"], 1.0 / np.cos(lat), rtol=1e-10)


def test_mean_scale_of_mercator_along_a_meridian() -> None:
    """The image of a meridian is as long as ln tan(45 + lat / 2) says."""
    found = profile(f"+proj=merc +R={R}", [(7, 0), (7, 80)])
    image = R * math.log(math.tan(math.radians(45 + 40)))
    truth = image, R * math.radians(80), image / (R * math.radians(80))
    assert (found.map_length_m, found.length_m, found.mean_scale) == pytest.approx(truth, rel=1e-10)
    assert found.error < 1e-9


def test_line_scale_factor() -> None:
    """Grid distance over geodesic, as surveyors have it, and Simpson's rule of three scales (NOS NGS 5, section 4)."""
    line = [(10.5, 48.0), (10.54, 48.03)]
    found, proj, geod = profile(UTM, line), Proj(UTM), Geod(ellps="WGS84")
    azimuth, _, length = geod.inv(*line[0], *line[1])
    grid = math.dist(*(proj(*point) for point in line))
    assert (found.length_m, found.grid_distance_m) == pytest.approx((length, grid), abs=1e-6)
    # The image of 4.5 km, 115 km from the axis, bends by 4.5 * 115 km2 / R^2 = 1.3e-5 rad, and is longer than its chord
    # by the square of that over 24, 7e-12; derivatives are good to 1e-11.
    assert found.mean_scale == pytest.approx(grid / length, rel=2e-11)
    lon, lat, _ = geod.fwd(*line[0], azimuth, length / 2)
    first, middle, last = (float(factors(UTM, *point).k) for point in (line[0], (lon, lat), line[1]))
    # The rule's error is its fourth derivative's: (4.5 km / R)^4 / 2880, far below 1e-12.
    assert found.mean_scale == pytest.approx((first + 4 * middle + last) / 6, rel=2e-11)


def test_combined_factor() -> None:
    """k R / (R + h) with R = sqrt(M N), here written out; the ground's length is that of a raised arc."""
    found = profile(UTM, [(9, 45), (9.1, 45.05)], height=1000.0)
    e2 = WGS84.f * (2 - WGS84.f)
    radius = WGS84.a * math.sqrt(1 - e2) / (1 - e2 * np.sin(np.radians(found.lat)) ** 2)
    assert_allclose(found.combined_factor, found.scale * radius / (radius + 1000.0), rtol=1e-13)
    assert found.ground_length_m == pytest.approx(found.length_m * (1 + 1000.0 / radius.mean()), rel=1e-8)
    assert found.mean_combined_factor == pytest.approx(found.map_length_m / found.ground_length_m, rel=1e-15)


def test_points() -> None:
    """At even distances and at the vertices, which are what was given to the last bit."""
    line = [(9.0, 48.0), (9.3, 48.2), (9.9, 48.1)]
    found = profile(UTM, line, spacing_km=10)
    inner = ~np.isin(found.distance_km, found.vertices)
    assert_allclose(found.distance_km[inner], 10.0 * np.arange(1, inner.sum() + 1), rtol=1e-12)
    assert list(zip(found.lon[~inner], found.lat[~inner], strict=True)) == line
    way = np.hypot(np.diff(found.x), np.diff(found.y)) / np.diff(found.distance_km)
    assert_allclose(way, 1e3, rtol=1e-3)
    # Usual steps are 1, 2 or 5 times a power of ten, the largest that is not above; a round one is itself.
    steps = {2000.0: 2000.0, 1999.0: 1000.0, 5.0: 5.0, 1e4: 1e4, 0.49: 0.2}
    assert {given: _round_step(given) for given in steps} == pytest.approx(steps, rel=1e-12)


def test_heights_run_straight_between_vertices() -> None:
    """Of a line that has them at all vertices; else there are none."""
    found = profile(UTM, [(9, 48, 100), (9, 49, 300), (9, 50, 200)], spacing_km=10)
    assert_allclose(found.height, np.interp(found.distance_km, found.vertices, [100, 300, 200]), rtol=1e-12)
    with pytest.warns(Notice, match=r"^1 of 2 vertices of the line have no height; no heights are used\.$"):
        assert profile(UTM, [(9, 48, 100), (9, 49, math.nan)]).combined_factor is None
    assert profile(UTM, [(9, 48, 100), (9, 49, math.nan)], height=5).height is not None


def test_what_the_map_leaves_out_is_undefined_and_cuts_are_told() -> None:
    """A line that leaves an orthographic map has no mean there; what can be measured is."""
    found = profile("+proj=ortho +R=6371000", [(0, 0), (170, 0)])
    assert np.isnan(found.mean_scale)
    assert found.scale[0] == pytest.approx(1.0, rel=1e-9)
    assert found.to_dict()["mean_scale"] is None
    json.loads(found.to_json())
    # The antimeridian, where Mercator's map ends, is crossed once, half way.
    found = profile("EPSG:3857", [(170, 0), (-170, 0)], spacing_km=100)
    (k,) = found.torn
    assert found.distance_km[k - 1] <= 0.5 * found.length_m / 1e3 <= found.distance_km[k]
    assert not profile("EPSG:3857", [(150, 0), (170, 60)]).torn.size
    assert found.mean_scale == pytest.approx(1.0, rel=1e-9)


def same(one: Profile, other: Profile) -> None:
    assert_allclose((one.lon, one.scale), (other.lon, other.scale), rtol=0, atol=1e-9)


def test_lines_of_any_kind(tmp_path: Path) -> None:
    points = [(9.0, 48.0, 300.0), (9.5, 48.3, 650.0), (10.4, 48.2, 500.0)]
    line = shapely.LineString(points)
    expected = profile(UTM, points)
    path = tmp_path / "road.geojson"
    path.write_text(shapely.to_geojson(shapely.force_2d(line)))
    text = "9,48,9.5,48.3,10.4,48.2"
    for given in (text, np.array(points), line, shapely.geometry.mapping(line), str(path), path):
        same(profile(UTM, given), expected)
    assert profile(UTM, line).height is not None


def test_files_of_other_programs(tmp_path: Path) -> None:
    """A GeoPackage in another CRS, with heights, and parts in any order that join end to end."""
    geopandas = pytest.importorskip("geopandas")
    points = [(9.0, 48.0, 300.0), (9.5, 48.3, 650.0), (10.4, 48.2, 500.0), (11.0, 48.4, 10.0)]
    parts = [points[1:3], points[:2], points[:1:-1]]
    frame = geopandas.GeoDataFrame(geometry=[shapely.LineString(part) for part in parts], crs="EPSG:4326")
    path = tmp_path / "roads.gpkg"
    frame.to_crs("EPSG:25832").to_file(path, layer="roads")
    expected = profile(UTM, points)
    for line in (f"{path}#roads", frame, frame.to_crs("EPSG:3857").geometry):
        found = profile(UTM, line)
        same(found, expected)
        assert_allclose(found.combined_factor, expected.combined_factor, rtol=1e-9)


DIAGONAL, NUMBERS = [(0, 0), (1, 1)], "Coordinates must be numbers"
APART = shapely.MultiLineString([[(0, 0), (1, 1)], [(2, 2), (3, 3)]])


@each("line, options, message", [
    *(
        (line, {}, r"^Invalid line .* It must have two places or more\.$")
        for line in ([], [(1, 2)], [(1, 2), (1, 2)])
    ),
    ([(1, 2), (361, 2)], {}, r"^Invalid line .* Its longitudes must lie within -360 and 360"),
    (shapely.Point(1, 2), {}, r"^Invalid line\. It must hold lines only; it holds a Point\.$"),
    (APART, {}, r"^Invalid line\. It must hold one line, or lines that join end to end; it holds 2\.$"),
    ("9,50,x,51", {}, rf"^Invalid line '9,50,x,51'\. {NUMBERS} LON,LAT,LON,LAT,.*; 'x' is none\.$"),
    ("9,50,,51", {}, rf"^Invalid line '9,50,,51'\. {NUMBERS} .*; '' is none\.$"),
    ("9,roads", {}, r"^Invalid line file '9,roads'\. (It cannot be read|Without pyogrio)"),
    (5, {}, r"^Invalid line '5'\. It must be LON,LAT,LON,LAT,\.\.\., positions"),
    *((DIAGONAL, {"spacing_km": km}, rf"^Invalid spacing '{km}'\.") for km in (0, 1e-9, math.nan)),
    (DIAGONAL, {"height": 1e5}, r"^Invalid height '100000'\. It must lie within -12000 and 9000 m\.$"),
    (DIAGONAL, {"measures": "foo"}, r"^Invalid measure 'foo'"),
])  # fmt: skip
def test_what_is_refused(line: object, options: dict[str, object], message: str) -> None:
    refuses(message, profile, "robin", line, **options)


GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="a test" xmlns="http://www.topografix.com/GPX/1/1">{}</gpx>
"""
WAYPOINT = '<wpt lat="47" lon="11"><ele>5</ele></wpt>'
PLACES = [(11.0, 47.0, 1000.0), (11.01, 47.01, 1100.0), (11.03, 47.02, 900.0)]


def ways(kind: str, heights: int = len(PLACES)) -> str:
    """A track of two segments or a route of GPX, the first points of which have heights."""
    told = [f"<ele>{h}</ele>" if k < heights else "" for k, (*_, h) in enumerate(PLACES)]
    points = [
        f'<{kind}pt lat="{lat}" lon="{lon}">{h}</{kind}pt>' for (lon, lat, _), h in zip(PLACES, told, strict=True)
    ]
    if kind == "rte":
        return f"<rte>{''.join(points)}</rte>"
    return f"<trk><trkseg>{points[0]}{points[1]}</trkseg><trkseg>{points[1]}{points[2]}</trkseg></trk>"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Of a file of GPX, which needs pyogrio."""
    pytest.importorskip("pyogrio")
    return tmp_path / "way.gpx"


ALONE = [ways("trk"), ways("rte"), WAYPOINT + ways("trk")]
SEVERAL = [ways("rte") + ways("trk"), ways("trk") + ways("rte", 0)]


@each("content, layer", [*((one, "") for one in ALONE), *((one, "#tracks") for one in SEVERAL)])
def test_ways_of_gpx(content: str, layer: str, path: Path) -> None:
    """Tracks and routes with their heights are what the same points are that are given as numbers."""
    path.write_text(GPX.format(content))
    found, truth = profile(UTM, f"{path}{layer}"), profile(UTM, PLACES)
    assert_allclose(found.elevation_factor, truth.elevation_factor, rtol=1e-12)
    assert found.ground_length_m == pytest.approx(truth.ground_length_m, rel=1e-12)
    # R / (R + h), R the radius of Gauss.
    radius = np.sqrt(np.prod(WGS84.radii(47.0)))
    assert found.elevation_factor[0] == pytest.approx(radius / (radius + 1000.0), rel=1e-12)


def test_ways_of_gpx_without_all_heights_or_a_layer(path: Path) -> None:
    """GDAL's 0 m, where a point has no height, is none, which is told; a layer must be named, with lines in it."""
    path.write_text(GPX.format(ways("trk", 2)))
    with pytest.warns(Notice, match=r"^1 of 4 points of '.*way\.gpx#tracks' have no height; no heights are used\.$"):
        assert profile(UTM, path).height is None
    path.write_text(GPX.format(ways("trk", 0)))
    assert profile(UTM, path).height is None
    path.write_text(GPX.format(ways("trk") + ways("rte")))
    refuses(r"It must name a layer, such as '.*way\.gpx#routes'; it has routes, tracks\.$", profile, UTM, path)
    path.write_text(GPX.format(WAYPOINT))
    refuses(r"^Invalid line file '.*'\. It must hold lines only; it holds a Point\.$", profile, UTM, path)
