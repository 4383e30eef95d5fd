"""What no conformal map can beat, against caps, strips and ellipses, and against maps that are as good as they get."""

import math

import numpy as np
import pytest
from tables import each

from projdist import Box, Cap, design, get_region, recommend
from projdist.designs import conformal_bounds
from projdist.designs.conformal_bounds import least_log_range, proven_least
from projdist.earth import SPHERE, WGS84

# Of the least range: what the best map has more, as u is not constant along the border, and between its points.
CLOSE = 2e-3
RADIANS, R = math.pi / 180.0, SPHERE.a


def assert_just_below(found: float, truth: float, close: float = CLOSE) -> None:
    assert (1.0 - close) * truth < found <= truth * (1.0 + 1e-9)


@each(
    ("lat", "kilometres"),
    [(50.0, 400.0), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0.0, 3.0), (-30.0, 3000.0)))],
)
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


def test_figures_of_a_range() -> None:
    """The scale that is best lies between both ends: (k - 1) / (k + 1), and half the logarithm."""
    box = Box(5.0, 45.0, 10.0, 50.0)
    log_range = least_log_range(box, WGS84)
    assert proven_least("max_scale_error_ppm", box, WGS84) == pytest.approx(1e6 * np.tanh(log_range / 2.0))
    assert proven_least("max_log_scale", box, WGS84) == pytest.approx(log_range / 2.0)
    assert proven_least("airy_kavrayskiy", box, WGS84) is None


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


@pytest.mark.slow
@each(("region", "least"), [("country:CH", 0.7), ("state:CO", 0.99), ("country:KE", 0.94)])
def test_designs_are_above_and_near(region: str, least: float) -> None:
    """A made map of degree 20, and each CRS that keeps angles, has more than is proven; and not much more."""
    made = design(region, kind="conformal", criterion="max_scale_error_ppm", degree=20, against=())
    assert least < made.proven / made.value < 1.0
    k = [one.distortion for one in recommend(region, purpose="conformal", criterion="max_scale_error_ppm").results]
    assert min(one.max_scale_error_ppm for one in k) > made.proven
