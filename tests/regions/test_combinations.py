"""Regions combined and taken apart: their algebra, the main part, the word on parts far away, shares in boxes."""

import math
from types import SimpleNamespace

import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import given, strategies as st
from tables import each

from projdist.earth import MEAN_EARTH_RADIUS
from projdist.regions import GLOBE, Box, Cap, PointSet, Region, combine, get_region, main_part, share_in
from projdist.regions.combinations import FAR_KM

# ---- points and areas of `&`, `-` and `+`, for any boxes and caps ---------------------------------
GEOD = pyproj.Geod(ellps="WGS84")
RADIUS_KM = MEAN_EARTH_RADIUS / 1000.0
RIM = 1e-5  # of a degree: ten times by how much the polygon of a cap leaves its rim
SAME_AREA = 2e-6  # relative to the larger region: a rim of 0.1 m about 100 km
# Points uniform in area, and none of them on the whole degrees where boxes end.
rng = np.random.default_rng(3)
LON, LAT = rng.uniform(-180.0, 180.0, 2000), np.degrees(np.arcsin(rng.uniform(-1.0, 1.0, 2000)))


def within(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Which of the points are in a box or a cap, and which are too near to its rim to say."""
    kind, _, numbers = text.partition(":")
    first, second, *more = (int(number) for number in numbers.split(","))
    if kind == "box":
        east, north = more
        return ((LON - first) % 360.0 < east - first) & (second < LAT) & (north > LAT), np.zeros(LON.shape, bool)
    *_, distance = GEOD.inv(np.full(LON.shape, first), np.full(LAT.shape, second), LON, LAT)
    beyond = np.degrees((np.asarray(distance) / 1000.0 - more[0]) / RADIUS_KM)
    return beyond < 0.0, np.abs(beyond) < RIM


def box(west: int, south: int, width: int, height: int) -> str:
    """Within the degrees that a box may have."""
    west -= 360 if west + width > 360 else 0
    return f"box:{west},{south},{west + width},{min(south + height, 90)}"


BOXES = st.builds(box, st.integers(-180, 179), st.integers(-90, 80), st.integers(2, 350), st.integers(2, 180))
CAPS = st.builds("cap:{},{},{}".format, st.integers(-180, 180), st.integers(-90, 90), st.integers(100, 15_000))
SHAPES = BOXES | CAPS
MEMBERSHIP = {"&": lambda a, b: a & b, "-": lambda a, b: a & ~b, "+": lambda a, b: a | b}


def left_of(a: str, operator: str, b: str) -> Region | None:
    """None where nothing is left."""
    try:
        return combine(operator, get_region(a), get_region(b), f"{a} {operator} {b}")
    except ValueError as error:
        if "Nothing is left of it." not in str(error):
            raise
        return None


@pytest.mark.slow
@given(SHAPES, SHAPES, st.sampled_from(sorted(MEMBERSHIP)))
def test_points_are_members_as_the_operator_says(a: str, b: str, operator: str) -> None:
    """A point is in `a & b` if it is in both, in `a - b` if in a alone, in `a + b` if in either."""
    (in_a, near_a), (in_b, near_b) = within(a), within(b)
    expected, clear = MEMBERSHIP[operator](in_a, in_b), ~(near_a | near_b)
    region = left_of(a, operator, b)
    found = np.zeros(LON.shape, bool) if region is None else region.contains(LON, LAT)
    np.testing.assert_array_equal(found[clear], expected[clear])


@pytest.mark.slow
@given(SHAPES, SHAPES)
def test_areas_add_up(a: str, b: str) -> None:
    """|a + b| + |a & b| = |a| + |b|, and a is what `a - b` and `a & b` leave of it."""
    regions = get_region(a), get_region(b), *(left_of(a, operator, b) for operator in "&+-")
    one, other, both, either, rest = (0.0 if region is None else region.area_km2 for region in regions)
    allowed = SAME_AREA * max(one, other)
    assert (either + both, rest + both) == pytest.approx((one + other, one), rel=0.0, abs=allowed)


# ---- parts, against distances and countries as people know them -----------------------------------
# Points of each country that its main part holds, and others that it leaves out.
MAIN = {
    "FR": ([(2.35, 48.85), (9.1, 42.2)], [(-53.0, 4.0), (55.5, -21.1), (-61.0, 14.65)]),  # Corsica; Guiana, Réunion
    "US": ([(-95.0, 38.0), (-81.5, 27.5)], [(-150.0, 65.0), (-155.5, 19.6)]),  # Florida; Alaska, Hawaii
    "NO": ([(9.0, 61.0), (25.0, 70.0)], [(17.0, 77.5), (-8.4, 71.0)]),  # Finnmark; Svalbard, Jan Mayen
    "NL": ([(5.5, 52.0)], [(-68.28, 12.18)]),  # Bonaire
    "ES": ([(-4.0, 40.0), (2.9, 39.6)], [(-16.6, 28.27)]),  # Mallorca; Tenerife
    "PT": ([(-8.0, 39.5)], [(-16.95, 32.75), (-25.4, 37.8)]),  # Madeira, São Miguel
    "CL": ([(-70.5, -33.0), (-69.5, -54.0)], [(-109.35, -27.12)]),  # Tierra del Fuego; Easter Island
    "EC": ([(-78.5, -1.0)], [(-91.1, -0.7)]),  # Isabela of the Galapagos
    "NZ": ([(175.5, -39.0), (171.0, -43.5), (167.9, -47.0)], [(-176.5, -44.0)]),  # Stewart Island; Chatham
    "FJ": ([(178.0, -17.8), (179.2, -16.6), (-179.97, -16.85)], []),  # both sides of the antimeridian
    "KI": ([(-157.4, 1.85)], []),  # Kiritimati, the largest atoll
}


@pytest.mark.slow
@each(("code", "points"), MAIN.items())
def test_main_parts_of_countries(code: str, points: tuple[list[tuple[float, float]], ...]) -> None:
    """The mainland and the islands that are mapped with it, without what lies overseas."""
    whole, main = get_region(f"country:{code}"), get_region(f"country:{code}@main")
    for some, inside in zip(points, (True, False), strict=True):
        for point in some:
            assert (bool(whole.contains(*point)), bool(main.contains(*point))) == (True, inside), point
    assert main.name == f"country:{code}@main"
    assert main.area_km2 < whole.area_km2


@pytest.mark.slow
@each("code", ["ID", "GB", "DK", "GR", "PH", "RU", "CA", "HR", "BS"])
def test_archipelagos_stay_whole(code: str) -> None:
    """What hangs together is the region itself, and there is no word on it; Russia crosses the antimeridian."""
    whole = get_region(f"country:{code}")
    assert main_part(whole) is whole
    assert (whole.far, whole.notes) == ("", ())


def squares(*corners: tuple[float, float]) -> dict[str, object]:
    """A multi-polygon of squares of a degree, the first one twice as wide."""
    boxes = [shapely.box(lon, lat, lon + (1 if k else 2), lat + 1) for k, (lon, lat) in enumerate(corners)]
    return shapely.geometry.mapping(shapely.MultiPolygon(boxes))


@each("lon", [0.0, 175.0])
def test_gaps_are_distances_on_the_ground(lon: float) -> None:
    """Three squares at the equator, 3 and 4 degrees apart: a chain of which each gap counts; so it does across 180."""
    region = get_region(squares((lon, 0), (lon + 5, 0), (lon + 10, 0)))
    parts = [main_part(region, km) for km in (333.0, 334.5, 446.0)]
    # A degree of a great circle of the mean sphere is 111.195 km: gaps of 333.58 and 444.78 km at the equator.
    areas = [Box(0, 0, width, 1).area_km2 for width in (2, 3, 4)]
    assert [part.area_km2 for part in parts] == pytest.approx(areas, rel=1e-9)
    assert parts[2] is region


def test_gaps_near_a_pole_and_beside_long_edges() -> None:
    """At 80 N five degrees are 97 km; an island beside the middle of a box without a vertex there belongs to it."""
    beside = shapely.MultiPolygon([shapely.box(0, 0, 60, 20), shapely.box(30, 21, 31, 22)])
    north, south, long = map(get_region, (squares((0, 80), (7, 80)), squares((0, 0), (7, 0)), beside))
    whole = [main_part(one, km) is one for one, km in ((north, 100), (south, 100), (long, 112), (long, 110))]
    assert whole == [True, False, True, False]


def test_what_has_no_parts() -> None:
    """Boxes, caps and points are their own main parts."""
    for region in (GLOBE, Cap(0, 0, 100), PointSet(np.array([0.0, 90.0]), np.zeros(2), np.ones(2))):
        assert main_part(region) is region
        assert region.far == ""


@each("text", [
    *("country:FR@main", "country:FR@110m@main", "country:FR@main:1300", "continent:Oceania@110m@main"),
    *("(country:FR + country:IT)@main", "country:FR@all"),
    *("(country:FR - box:0,40,10,50)@all", "country:FR@main - box:0,40,10,50"),
])  # fmt: skip
def test_names_are_texts(text: str) -> None:
    region = get_region(text)
    assert (region.name, region.notes) == (text, ())
    assert get_region(text.replace("@main", " @MAIN")).area_km2 == region.area_km2


def test_suffixes_in_any_order() -> None:
    """Detail and part may stand in either order; all parts are the same polygons without the word on them."""
    assert get_region("country:FR@main:1300@110m").name == "country:FR@110m@main:1300"
    assert get_region("country:FR@all@110m").area_km2 == get_region("country:FR@110m").area_km2
    assert get_region("country:FR@all").geometry is get_region("country:FR").geometry


def test_the_word_on_parts_far_away() -> None:
    """Its share, and the distances of the nearest and the farthest part, are those of two squares."""
    region = get_region(squares((0, 0), (12, 0), (22, 0)))
    near, far = math.radians(10) * 6371.0088, math.radians(20) * 6371.0088
    assert near > FAR_KM
    assert region.notes == (region.far,)
    said = f"polygons: 50 % of the area lies {near:.0f} to {far:.0f} km from the main part; @main leaves it out"
    assert region.far.startswith(said)


@each(("text", "told"), [
    *(("country:FR", True), ("country:FR - box:-3,42,5,50", True), ("country:FR & cap:2,48,900", False)),
    *(("country:MY", False), ("land@110m", False), ("continent:Oceania@110m", False)),
    *(("land@110m & box:-180,-30,180,30", False), ("country:FR@main + country:US@main", False)),
])  # fmt: skip
def test_when_there_is_a_word(text: str, told: bool) -> None:
    """Where places are named, of which parts may not be meant, and of what is left of them."""
    assert bool(get_region(text).far) == told


# ---- the share that lies in a box, against counts of points and closed forms ----------------------
EUROPE = Box(-35.58, 24.6, 44.83, 84.73)
PACIFIC = Box(150, -60, -120, 10)


def counted(box: Box, region: Region) -> float:
    """The share of a region in a box, by points on a golden spiral, which are spread evenly over the sphere."""
    k = np.arange(400_000) + 0.5
    lon, lat = np.mod(360.0 * k / ((1 + 5**0.5) / 2), 360.0) - 180.0, np.degrees(np.arcsin(1 - 2 * k / k.size))
    here = region.contains(lon, lat)
    return float(np.mean(box.contains(lon[here], lat[here])))


@each(("box", "region", "share"), [
    *((Box(0, 0, 90, 90), GLOBE, 1 / 8), (Box(-180, -90, 0, 90), GLOBE, 1 / 2)),
    (Box(170, 0, -170, 90), Box(0, -90, 180, 90), 10 / 360),
    *((Box(170, 0, 190, 90), Box(-190, 0, -175, 90), 1.0), (Box(-180, 0, 180, 90), PACIFIC, None)),
    (Box(0, -10, 20, 10), Box(170, -10, 10, 10), 10 / 200),  # which is 170 to 370
    (GLOBE, Cap(10, 50, 300), 1.0),
    (Box(10, -90, 100, 90), Cap(10, 50, 300), 1 / 2),  # on either side of its meridian
    *((Box(-170, 0, 170, 90), Cap(180, 0, 300), 0.0), (Box(0, 60, 90, 90), Cap(30, 90, 2000), 1 / 4)),
    *((Box(0, 0, 90, 50), Cap(30, 80, 1000), 0.0), (EUROPE, get_region("country:DE"), 1.0)),
    *((EUROPE, get_region("country:FJ"), 0.0), (PACIFIC, get_region("country:FJ"), 1.0)),
    (Box(6.0, 40.0, 12.0, 60.0), get_region("country:DE"), None),
])  # fmt: skip
def test_share(box, region, share):
    """By symmetry, or else by counting; caps are round on the sphere, polygons to 0.1 m."""
    truth = pytest.approx(counted(box, region), abs=0.02) if share is None else pytest.approx(share, abs=1e-5)
    assert share_in(box, region) == truth


def test_share_of_other_regions():
    """That of points is that of their weights; that of a region that someone has made, of its bounds."""
    points = PointSet(np.array([0.0, 10.0, 20.0]), np.array([50.0, 50.0, 50.0]), np.array([1.0, 2.0, 5.0]))
    assert share_in(Box(5, 40, 30, 60), points) == 7 / 8
    assert share_in(Box(10, 0, 90, 90), SimpleNamespace(bounds=(0.0, -10.0, 20.0, 10.0))) == pytest.approx(1 / 4)
