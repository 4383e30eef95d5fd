"""What no conformal map can beat, against caps, strips and ellipses, and against maps that are as good as they get."""

import math

import numpy as np
import pytest
import shapely
from tables import each

from projdist import Box, Cap, Projection, design, get_region, recommend
from projdist.designs import conformal_bounds
from projdist.designs.conformal_bounds import least_log_range, proven_least
from projdist.earth import SPHERE, WGS84

pytestmark = pytest.mark.slow

# Of the least range: what the best map has more, as u is not constant along the border, and between its points.
CLOSE = 2e-3
RADIANS, R = math.pi / 180.0, SPHERE.a


def assert_just_below(found: float, truth: float, close: float = CLOSE) -> None:
    assert (1.0 - close) * truth < found <= truth * (1.0 + 1e-9)


@each(("lat", "kilometres"), [(50.0, 400.0), (0.0, 3.0), (-30.0, 3000.0)])
def test_caps(lat: float, kilometres: float) -> None:
    """The stereographic map is the best, of scales from 1 to 1 / cos^2(r / 2) (Milnor 1969, theorem 2)."""
    found = least_log_range(Cap(10.0, lat, kilometres, SPHERE), SPHERE)
    assert_just_below(found, -2.0 * math.log(math.cos(500.0 * kilometres / R)))


def test_strips() -> None:
    """Mercator's map is the best of a strip along the equator, of scales from 1 to 1 / cos(lat)."""
    assert_just_below(least_log_range(Box(-20.0, -1.0, 20.0, 1.0), SPHERE), -math.log(math.cos(RADIANS)))


def test_ellipses() -> None:
    """Of small ones ln k is the torsion function: a range of a^2 b^2 / 2 (a^2 + b^2) R^2 between axes a and b."""
    turn = 2.0 * np.pi * (np.arange(401) % 400) / 400
    shape = np.column_stack([20.0 + 0.2 * np.cos(turn), 0.1 * np.sin(turn)]).tolist()
    a, b = 0.2 * RADIANS, 0.1 * RADIANS
    truth = a * a * b * b / (2.0 * (a * a + b * b))
    # An inscribed polygon of 400 corners is smaller by 4e-5, and latitudes are no distances, by 2e-6.
    assert_just_below(least_log_range(get_region({"type": "Polygon", "coordinates": [shape]}), SPHERE), truth)


def test_boxes_across_the_antimeridian() -> None:
    """They have the bound of the same box elsewhere."""
    sides = ((10.0, 25.0), (170.0, -175.0))
    here, there = (least_log_range(Box(west, 10.0, east, 20.0), WGS84) for west, east in sides)
    assert there == pytest.approx(here, rel=1e-3)


def test_charges_are_outside() -> None:
    """Of a region with a hole there is one in the hole, and none within, or nothing would be proven."""
    ring = [[5.0, 45.0], [10.0, 45.0], [10.0, 50.0], [5.0, 50.0], [5.0, 45.0]]
    hole = [[6.0, 46.0], [6.0, 49.0], [9.0, 49.0], [9.0, 46.0], [6.0, 46.0]]
    base = Projection.from_user_input("+proj=stere +lat_0=47.5 +lon_0=7.5 +ellps=WGS84")
    for holes in ([hole], [hole[::-1]]):
        border = conformal_bounds._Border.of(shapely.Polygon(ring, holes), base, 0.01)
        found = conformal_bounds._charges(border)
        outer, inner = (shapely.Polygon(np.column_stack([one.real, one.imag])) for one in border.rings)
        inside = shapely.contains_xy(inner, found.real, found.imag)
        assert inside.sum() == 1
        assert not shapely.contains_xy(outer, found.real[~inside], found.imag[~inside]).any()
    square = conformal_bounds._Border.of(shapely.Polygon(ring), base, 0.01)
    assert conformal_bounds._outside(np.array([0.0 + 0.0j, 3.0 + 0.0j]), square).tolist() == [False, True]


def test_figures_of_a_range() -> None:
    """The scale that is best lies between both ends: (k - 1) / (k + 1), and half the logarithm."""
    box = Box(5.0, 45.0, 10.0, 50.0)
    log_range = least_log_range(box, WGS84)
    assert proven_least("max_scale_error_ppm", box, WGS84) == pytest.approx(1e6 * np.tanh(log_range / 2.0))
    assert proven_least("max_log_scale", box, WGS84) == pytest.approx(log_range / 2.0)
    assert proven_least("airy_kavrayskiy", box, WGS84) is None


@pytest.mark.slow
def test_a_border_that_folds_when_it_is_cut_finely() -> None:
    """GEOS mends the polygon of Siberia's coast with points 3 km apart to several; a wide region has some bound."""
    assert 5e3 < proven_least("max_scale_error_ppm", get_region("area:Asian Russia"), WGS84) < 2e4


@each("region", ["cap:0,90,500", "box:-170,-60,170,60", "country:AQ"])
def test_nothing_is_proven_of_poles_and_half_the_world(region: str) -> None:
    assert least_log_range(get_region(region), WGS84) is None


def test_the_proof_is_of_the_whole_border(monkeypatch: pytest.MonkeyPatch) -> None:
    """With fewer points along it less is proven, and never more."""
    box, found = Box(5.0, 45.0, 10.0, 50.0), []
    for finer in (1, 4):
        monkeypatch.setattr(conformal_bounds, "_FINER", finer)
        found.append(least_log_range(box, WGS84))
    assert found == sorted(found)


DEGREE = conformal_bounds._DEGREE
HALF = 0.3


def along_a_chord(powers: dict[int, float], charges: list[complex], q: list[float], half: float = HALF) -> float:
    """The lower bound of the sum of powers' real parts and of q ln|z - p| from -half to half, where ln k is 0."""
    c = np.zeros(2 * DEGREE + len(q))
    c[[power - 1 for power in powers]] = [*powers.values()]
    c[2 * DEGREE :] = q
    ends = np.array([-half + 0j, half + 0j])
    border = conformal_bounds._Border(ends, np.zeros(2), np.array([1, 0]), 1.0, [ends])
    return conformal_bounds._least_along(border, np.array(charges, dtype=complex), c, 1e9, 0.0)


def test_between_two_points() -> None:
    """A parabola's bound is its least value; what bends more in the middle than at the ends is seen, too."""
    assert -1e-9 < along_a_chord({2: 1.0}, [], []) <= 0.0
    # z^4 / 12 - h^2 z^2 / 2, less, is straight at both ends, and 0 in the middle.
    assert along_a_chord({4: -1.0 / 12.0, 2: 0.5 * HALF**2}, [], []) <= 0.0
    for half in (HALF, 0.003):
        assert along_a_chord({}, [0.2j], [1.0], half) <= math.log(0.2)
    assert along_a_chord({}, [2j], [1.0]) == pytest.approx(math.log(2.0), abs=2e-2)


@each("kind", ["linear", "powers", "all"])
def test_the_bound_along_a_border_is_below_all_of_it(kind: str) -> None:
    """Of any functions, between few points of curved parallels, by what they are at many points."""
    box = shapely.box(5.0, 60.0, 25.0, 70.0)
    base = Projection.from_user_input("+proj=stere +lat_0=65 +lon_0=15 +ellps=GRS80")
    coarse, fine = (conformal_bounds._Border.of(box, base, step) for step in (1.0, 0.004))
    charges, rng = conformal_bounds._charges(coarse), np.random.default_rng(3)
    degree = np.concatenate([np.tile(np.arange(1, DEGREE + 1), 2), np.full(charges.size, 99)])
    size, missed = np.where(degree <= {"linear": 1, "powers": 5, "all": 99}[kind], 1.0, 0.0), 0
    size[0] *= 0.05 if kind == "linear" else 1.0  # most is along meridians: the least, on a parallel
    z, radius = fine.z * fine.size / coarse.size, 6335439.0 / coarse.size
    for _ in range(10):
        c = size * rng.normal(size=degree.size)
        u = fine.log_k.copy()
        for k, (re, im) in enumerate(c[: 2 * DEGREE].reshape(2, -1).T, start=1):
            u += np.abs(z) ** k * (re * np.cos(k * np.angle(z)) + im * np.sin(k * np.angle(z)))
        for q, p in zip(c[2 * DEGREE :], charges, strict=True):
            u += q * np.log(np.hypot(z.real - p.real, z.imag - p.imag))
        at_points = (coarse.log_k + conformal_bounds._functions(coarse.z, charges) @ c).min()
        bound = conformal_bounds._least_along(coarse, charges, c, radius, math.tan(math.radians(70.0)))
        assert bound <= u.min() <= at_points + 1e-9
        missed += u.min() < at_points - 1e-6
    assert missed > 2  # else there is nothing to bound


@each(("region", "least"), [("country:CH", 0.7), ("state:CO", 0.99), ("country:KE", 0.94)])
def test_designs_are_above_and_near(region: str, least: float) -> None:
    """A made map of degree 20, and each CRS that keeps angles, has more than is proven; and not much more."""
    made = design(region, kind="conformal", criterion="max_scale_error_ppm", degree=20, against=())
    assert least < made.proven / made.value < 1.0
    k = [one.distortion for one in recommend(region, purpose="conformal", criterion="max_scale_error_ppm").results]
    assert min(one.max_scale_error_ppm for one in k) > made.proven
