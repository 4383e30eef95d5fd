"""The algebra of regions: membership of points and areas of `&`, `-` and `+`, for any boxes and caps."""

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from projdist import get_region
from projdist.earth import MEAN_EARTH_RADIUS
from projdist.regions import Region, combine

GEOD = pyproj.Geod(ellps="WGS84")
RADIUS_KM = MEAN_EARTH_RADIUS / 1000.0
RIM = 1e-5  # of a degree: ten times by how much the polygon of a cap leaves its rim
SAME_AREA = 2e-6  # relative to the larger region: a rim of 0.1 m about 100 km


def points() -> tuple[np.ndarray, np.ndarray]:
    """Points all over the Earth, uniform in area, and none of them on the whole degrees where boxes end."""
    rng = np.random.default_rng(3)
    return rng.uniform(-180.0, 180.0, 2000), np.degrees(np.arcsin(rng.uniform(-1.0, 1.0, 2000)))


LON, LAT = points()


class Shape:
    """A box or a cap, as text; and which points are within it, or too near to its rim to say."""

    def __init__(self, kind: str, numbers: tuple[int, ...]) -> None:
        self.kind, self.numbers, self.text = kind, numbers, f"{kind}:{','.join(map(str, numbers))}"

    def __repr__(self) -> str:
        return self.text

    def within(self) -> tuple[np.ndarray, np.ndarray]:
        """Which of the points are, and which nobody can tell."""
        if self.kind == "box":
            west, south, east, north = self.numbers
            inside = ((LON - west) % 360.0 < east - west) & (np.abs(2.0 * LAT - south - north) < north - south)
            return inside, np.zeros(LON.shape, bool)
        lon, lat, radius = self.numbers
        *_, distance = GEOD.inv(np.full(LON.shape, lon), np.full(LAT.shape, lat), LON, LAT)
        beyond = np.degrees((np.asarray(distance) / 1000.0 - radius) / RADIUS_KM)
        return beyond < 0.0, np.abs(beyond) < RIM


def box(west: int, south: int, width: int, height: int) -> Shape:
    """Within the degrees that a box may have."""
    west -= 360 if west + width > 360 else 0
    return Shape("box", (west, south, west + width, min(south + height, 90)))


BOXES = st.builds(box, st.integers(-180, 179), st.integers(-90, 80), st.integers(2, 350), st.integers(2, 180))
CAPS = st.tuples(st.integers(-180, 180), st.integers(-90, 90), st.integers(100, 15_000)).map(
    lambda cap: Shape("cap", cap)
)
SHAPES = BOXES | CAPS
MEMBERSHIP = {"&": lambda a, b: a & b, "-": lambda a, b: a & ~b, "+": lambda a, b: a | b}


def combined(a: Shape, operator: str, b: Shape) -> Region | None:
    """None where nothing is left."""
    try:
        return combine(operator, get_region(str(a)), get_region(str(b)), f"{a} {operator} {b}")
    except ValueError as error:
        if "Nothing is left of it." not in str(error):
            raise
        return None


def area(region: Region | None) -> float:
    """Square kilometres."""
    return 0.0 if region is None else region.area_km2


@pytest.mark.slow
@given(SHAPES, SHAPES, st.sampled_from(sorted(MEMBERSHIP)))
def test_points_are_members_as_the_operator_says(a: Shape, b: Shape, operator: str) -> None:
    """A point is in `a & b` if it is in both, in `a - b` if in a alone, in `a + b` if in either."""
    (in_a, near_a), (in_b, near_b) = a.within(), b.within()
    expected, clear = MEMBERSHIP[operator](in_a, in_b), ~(near_a | near_b)
    region = combined(a, operator, b)
    found = np.zeros(LON.shape, bool) if region is None else region.contains(LON, LAT)
    np.testing.assert_array_equal(found[clear], expected[clear])


@pytest.mark.slow
@given(SHAPES, SHAPES)
def test_areas_add_up(a: Shape, b: Shape) -> None:
    """|a + b| + |a & b| = |a| + |b|, and a is what `a - b` and `a & b` leave of it."""
    one, other, both = area(get_region(str(a))), area(get_region(str(b))), area(combined(a, "&", b))
    allowed = SAME_AREA * max(one, other)
    assert area(combined(a, "+", b)) + both == pytest.approx(one + other, rel=0.0, abs=allowed)
    assert area(combined(a, "-", b)) + both == pytest.approx(one, rel=0.0, abs=allowed)
