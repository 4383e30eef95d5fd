"""The shipped land, lakes, borders and states: decoded, cut at the antimeridian, of the right areas and lengths."""

import itertools

import numpy as np
import pyproj
import pytest
import shapely
from refusals import refuses
from tables import each

from projdist.earth import data_rows, even_odd, natural_earth as earth, state_outline
from projdist.earth.natural_earth import borders, coastlines, country, lakes, land, polygons_within

WITH_LAKES = earth.RESOLUTIONS[:2]
EVERY = [*WITH_LAKES, pytest.param("10m", marks=pytest.mark.slow)]  # the finest land takes seconds

LAND_AREA = 148.94 / 510.07  # million km2, CIA World Factbook; without Natural Earth's ice shelves 1 % less


def spherical_share(area: shapely.MultiPolygon) -> float:
    """Share of the unit sphere: the area in longitude and sine of latitude, with short steps."""
    dense, degree = shapely.segmentize(area, 0.2), np.pi / 180.0
    return shapely.transform(dense, lambda at: np.stack([degree * at[:, 0], np.sin(degree * at[:, 1])], 1)).area / (
        4 * np.pi
    )


@pytest.mark.slow
@each("resolution", EVERY)
def test_land(resolution: str) -> None:
    """29 % of the Earth, valid, no longitude beyond 180; with known places, also at the poles and the antimeridian."""
    area = land(resolution)
    assert spherical_share(area) == pytest.approx(LAND_AREA, rel=0.03 if resolution == "110m" else 0.02)
    assert area.is_valid
    *sides, north = area.bounds
    assert sides == [-180.0, -90.0, 180.0]
    assert 83.0 < north < 84.0
    dry = np.array([(2.35, 48.85), (-58.4, -34.9), (0.0, -89.5), (179.0, 67.0), (-179.0, 67.0), (134.0, -25.0)])
    wet = np.array([(0.0, 0.0), (-150.0, 0.0), (0.0, 90.0), (51.0, 42.0), (180.0, 0.0), (60.0, -30.0)])
    assert shapely.contains_xy(area, *dry.T).all()
    assert not shapely.contains_xy(area, *wet.T).any()


@each("resolution", EVERY)
def test_coastlines_have_no_cuts(resolution: str) -> None:
    """No step is long, none runs along the antimeridian or round the pole; all points lie on the edge of the land."""
    for line in coastlines(resolution):
        assert np.abs(np.diff(line, axis=0)).max() < 10.0
        on_cut = np.abs(np.abs(line[:, 0]) - 180.0) < 1e-6
        assert not (on_cut[1:] & on_cut[:-1]).any()
        assert np.abs(line[:, 1]).max() < 89.9
    if resolution == "110m":
        lon, lat = np.concatenate(coastlines(resolution)).T
        points = shapely.points(np.mod(lon + 180.0, 360.0) - 180.0, lat)
        assert shapely.distance(shapely.boundary(land(resolution)), points).max() < 1e-9  # degrees


# km2 of land and lakes, as statistical offices have them.
AREAS = {"756": 41_285.0, "056": 30_528.0, "442": 2_586.0, "208": 42_947.0, "372": 70_273.0, "705": 20_271.0}
AREAS |= {"398": 2_724_900.0}
# Russia's, Canada's and Norway's mainlands are there: made valid, they are polygons beside lines.
CROSSED = {"643": 17_098_000.0, "124": 9_985_000.0, "578": 385_000.0}


@pytest.mark.slow
@each("key", AREAS | CROSSED)
def test_areas_of_countries_at_the_finest_scale(key: str) -> None:
    """To 1.5 %, lakes and leased places included; to 2 % where rounding made rings cross."""
    area = country(key, "10m")
    assert area.is_valid
    assert area_km2(area) == pytest.approx((AREAS | CROSSED)[key], rel=0.02 if key in CROSSED else 0.015)


# km2, as encyclopaedias have them, and boxes around them: Malta and Gozo, Oahu, Bornholm, Jersey, and Wrangel Island on
# the antimeridian.
ISLANDS = {(14.1, 35.75, 14.6, 36.1): 313.0, (-158.4, 21.1, -157.5, 21.8): 1545.0, (14.6, 54.95, 15.2, 55.35): 588.0}
ISLANDS |= {(-2.3, 49.15, -2.0, 49.28): 118.2, (177.0, 70.5, 183.5, 72.0): 7600.0}


@pytest.mark.slow
@each("bounds, known", ISLANDS.items())
def test_areas_of_islands_within_windows(bounds: tuple[float, float, float, float], known: float) -> None:
    """To 5 %, at 1 : 10 million; Hawaii's other islands and Gotland are not in the boxes."""
    area = polygons_within("land", bounds, "10m")
    assert area_km2(area) == pytest.approx(known, rel=0.05)
    assert -180.0 <= area.bounds[0] < area.bounds[2] <= 180.0
    assert not polygons_within("land", (-40.0, 30.0, -39.0, 31.0), "10m").geoms


def assert_is_part(what: str, window: tuple[float, float, float, float], resolution: str) -> None:
    """The polygons within a window are those of all that lie in it, of which what is beyond 180 is in the west."""
    west, south, east, north = window
    boxes = [shapely.box(west + turn, south, east + turn, north) for turn in (0.0, -360.0)]
    box = shapely.intersection(shapely.union(*boxes), shapely.box(-180.0, -90.0, 180.0, 90.0))
    found = polygons_within(what, window, resolution)
    assert found.is_valid
    expected = shapely.intersection({"land": land, "lakes": lakes}[what](resolution), box)
    assert shapely.symmetric_difference(found, expected).area < 1e-10  # square degrees: 1 m2


@pytest.mark.slow
@pytest.mark.parametrize(("resolution", "size"), [("50m", 20.0), *itertools.product(["50m", "10m"], [0.3, 3.0])])
def test_land_within_windows_is_that_part_of_all_land(resolution: str, size: float) -> None:
    """Along coasts of all continents, over the antimeridian and the South Pole: not a square metre more or less."""
    corners = np.concatenate(coastlines("110m"))[::97] - 0.4 * size
    corners = np.vstack([corners, [(179.9, -17.0), (170.0, 60.0), (-180.0, 71.0), (20.0, -90.0)]])
    for west, south in np.column_stack([np.mod(corners[:, 0] + 180.0, 360.0) - 180.0, corners[:, 1].clip(-90.0)]):
        assert_is_part("land", (west, south, west + size, south + size), resolution)


# km2 and places in them, as encyclopaedias have them: Victoria, Baikal, Ladoga, the Great Bear Lake, Ontario and Taupo;
# Michigan and Huron are one at the Straits of Mackinac, and with Superior at 1 : 50 million, by the river between them.
GREAT = (-88.0, 47.7, 82_103.0 + 59_590.0 + 57_800.0)
LAKES = [GREAT, (33.0, -1.0, 68_870.0), (108.0, 53.4, 31_722.0), (31.5, 61.0, 17_700.0)]
LAKES += [(-121.0, 66.0, 31_153.0), (-78.0, 43.6, 18_960.0), (175.9, -38.8, 616.0)]


def area_km2(area: shapely.Geometry) -> float:
    """On WGS84, by GeographicLib."""
    return abs(float(pyproj.Geod(ellps="WGS84").geometry_area_perimeter(area)[0])) / 1e6


@pytest.mark.slow
@each("resolution", WITH_LAKES)
def test_shores_are_the_edges_of_lakes(resolution: str) -> None:
    """Without the edges between parts of one lake, as at the Straits of Mackinac."""
    lines = shapely.union_all([shapely.linestrings(line) for line in earth.shores(resolution)])
    edges = lakes(resolution).boundary
    assert lines.length == pytest.approx(edges.length, rel=1e-12)
    assert shapely.symmetric_difference(lines, edges).length < 1e-6  # degrees


@each("window", [(-90.0, 40.0, -80.0, 50.0), (25.0, -10.0, 35.0, 2.0), (100.0, 50.0, 110.0, 56.0)])
def test_lakes_within_windows_are_that_part_of_all_lakes(window: tuple[float, float, float, float]) -> None:
    """The Great Lakes, those of Africa, and Baikal with its island."""
    assert_is_part("lakes", window, "50m")
    assert polygons_within("lakes", window, "50m").area > 1.0


@pytest.mark.slow
@each("resolution", WITH_LAKES)
def test_lakes_are_valid_and_on_land(resolution: str) -> None:
    """Islands are not lake, and the Caspian Sea is neither lake nor land; areas are to 3 %, as the data is smoothed."""
    area = lakes(resolution)
    assert area.is_valid
    at_all_scales = [(29.4, -6.0, 32_900.0), (74.9, 46.6, 16_400.0)]  # Tanganyika and Balkhash, as coarse as at 110m
    for lon, lat, known in [*at_all_scales, *(LAKES if resolution == "50m" else [])]:
        (lake,) = (lake for lake in area.geoms if shapely.contains_xy(lake, lon, lat))
        assert area_km2(lake) == pytest.approx(known, rel=0.03 if (lon, lat, known) in LAKES else 0.35)
    assert shapely.covers(land(resolution), area)
    assert not shapely.contains_xy(area, [51.0, 2.35], [42.0, 48.85]).any()
    # Manitoulin: at 110m lakes have no islands.
    assert shapely.contains_xy(area, -82.2, 45.75) == (resolution == "110m")


# km, CIA World Factbook: borders along parallels and straight lines, whose lengths no smoothing changes.
STRAIGHT = {("818", "729"): 1276.0, ("434", "148"): 1050.0, ("012", "562"): 951.0, ("682", "512"): 658.0}
# Borders along rivers and ridges, which maps shorten.
WINDING = {("250", "724"): 646.0, ("124", "840"): 8891.0, ("032", "152"): 6691.0, ("578", "752"): 1666.0}


def border_km(one: str, other: str, resolution: str) -> float:
    lines = [line for countries, line in borders(resolution) if countries == {one, other}]
    return float(sum(pyproj.Geod(ellps="WGS84").line_length(*line.T) for line in lines)) / 1e3


def test_lengths_of_borders() -> None:
    """Of straight ones to 1 %; finer ones are longer, none longer than on the ground, where sources agree to 3 %."""
    for pair, known in STRAIGHT.items():
        assert border_km(*pair, "50m") == pytest.approx(known, rel=0.01)
    for pair, known in WINDING.items():
        coarse, finer, finest = (border_km(*pair, resolution) for resolution in earth.RESOLUTIONS)
        assert 0.6 * known < coarse < finer < finest < 1.03 * known


def test_number_of_neighbours() -> None:
    """By land, Kaliningrad and French Guiana included."""
    neighbours = {"276": 9, "643": 14, "076": 10, "710": 6, "120": 6, "840": 2, "624": 2, "036": 0, "352": 0}
    around = {key: set().union(*(keys for keys, _ in borders("50m") if key in keys)) for key in neighbours}
    assert {key: len(others - {key}) for key, others in around.items()} == neighbours


@pytest.mark.slow
@each("resolution", EVERY)
def test_borders_are_no_coast(resolution: str) -> None:
    """They run inland, but for their ends and what follows a strait."""
    middles = np.concatenate([0.5 * (line[1:] + line[:-1]) for _, line in borders(resolution)])
    points = shapely.points(np.mod(middles[:, 0] + 180.0, 360.0) - 180.0, middles[:, 1])
    shapely.prepare(land(resolution))  # or minutes with old shapely
    assert np.mean(shapely.contains(land(resolution), points)) > 0.99
    assert max(np.abs(np.diff(line, axis=0)).max() for _, line in borders(resolution)) < 30.0  # degrees


@pytest.mark.slow
def test_countries_about() -> None:
    """No country that holds a point is left out, and few that do not."""
    for key in (row["iso_n3"] or row["name"] for row in data_rows("countries.csv")):
        for place in (part.representative_point() for part in country(key).geoms):
            about = earth.countries_about(np.array([place.x]), np.array([place.y]))
            assert key in about
            assert len(about) < 20


def test_outlines_of_states_and_cuba() -> None:
    """Each of the file has its row, and no code stands for two; all are valid, and no part is without an area."""
    # Cuba's outline is one: it has Guantanamo Bay, which the data has apart.
    assert shapely.contains_xy(country("192", "10m"), [-75.12, -82.38], [19.93, 23.1]).all()
    rows = data_rows("states.csv")
    assert sorted(row["fips"] for row in rows) == sorted(one.key for one in earth.topology("states", "10m")[0])
    assert len({row["postal"] for row in rows}) == len({row["name"] for row in rows}) == len(rows) == 56
    for row in rows:  # also those of which rounding has made rings cross themselves
        outline = state_outline(row["fips"])
        assert outline.is_valid
        assert min(part.area for part in outline.geoms) > 0.0


def test_polygons_beside_lines_are_kept_and_unknown_resolutions_refused() -> None:
    """A ring that crosses itself and runs out and back along a line: two triangles of area 1."""
    refuses(r"Invalid resolution '1m'. It must be one of 110m, 50m, 10m.", land, "1m")
    refuses(r"Invalid resolution '10m'. It must be one of 110m, 50m.", lakes, "10m")
    ring = np.array([(0, 0), (2, 2), (2, 0), (3, 0), (2, 0), (0, 2), (0, 0)], dtype=float)
    assert even_odd([ring]).area == pytest.approx(2.0, rel=1e-12)
