"""The limit of all maps: caps by the Euler-Lagrange equation, ellipses by the clamped plate, countries by made maps."""

import math

import numpy as np
import pytest
import shapely
from tables import each

from projdist import get_region, optimize, recommend, summarize
from projdist.decisions import least_error
from projdist.earth import SPHERE, WGS84, Ellipsoid, destination
from projdist.regions import RegionLike

R = 6371.0087714
# Airy-Kavrayskiy errors of the best maps of caps on the sphere, by the Euler-Lagrange equation of azimuthal maps; the
# stereographic and Lambert's equal-area map, in their best scales, over that.
CAPS = {10.0: 0.002199607140, 30.0: 0.019884009428, 60.0: 0.080699486621, 90.0: 0.185752206759}
STEREOGRAPHIC = {10.0: 1.415225, 30.0: 1.423410, 60.0: 1.452342, 90.0: 1.505345}
LAEA = {10.0: 1.413877, 30.0: 1.411218, 60.0: 1.402630, 90.0: 1.389597}
# The best conformal map is the stereographic one; what is predicted for all others from it is off by its ratio to the
# best, less sqrt(2): 0.1 % at 10 degrees, 6 % at 90.
EXACT = 1e-6  # the nodes' Gauss rule, and the printed digits of the ratios


def cap(angle: float, lat: float = 20.0) -> str:
    return f"cap:10,{lat:g},{math.radians(angle) * R:.9f}"


def limit(region: RegionLike, purpose: str = "any", ellipsoid: Ellipsoid = SPHERE) -> float | None:
    return least_error(get_region(region, ellipsoid), purpose, ellipsoid)


@each("lat", [20.0, -90.0])
@each("angle", CAPS)
def test_caps(angle: float, lat: float) -> None:
    """Of conformal maps the limit is the stereographic one's error; of all, that over sqrt(2)."""
    conformal = STEREOGRAPHIC[angle] * CAPS[angle]
    found = limit(cap(angle, lat), "conformal")
    assert found == pytest.approx(conformal, rel=EXACT)
    assert limit(cap(angle, lat)) == pytest.approx(conformal / math.sqrt(2.0), rel=EXACT)
    assert limit(cap(angle, lat), "equal-area") == found


@pytest.mark.parametrize("angle", [10.0, 30.0])
def test_the_azimuthal_maps_of_a_cap_over_their_limits(angle: float) -> None:
    """The stereographic map is at its limit; LAEA, which is the best equal-area one, to what the prediction is off."""
    scaled = {
        name: summarize(f"+proj={name} +lat_0=20 +lon_0=10 +R=6371008.7714", cap(angle)).airy_kavrayskiy_scaled
        for name in ("stere", "laea")
    }
    assert scaled["stere"] / limit(cap(angle), "conformal") == pytest.approx(1.0, rel=EXACT)
    ratio = scaled["laea"] / limit(cap(angle), "equal-area")
    assert ratio == pytest.approx(LAEA[angle] / STEREOGRAPHIC[angle], rel=EXACT)
    assert ratio == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("wide", [2.0, 4.0])
def test_ellipses(wide: float) -> None:
    """2 and 4 by 1 degrees, by the plate: K^2 / (24 (3/p^4 + 2/(p^2 q^2) + 3/q^4)) is the square."""
    p, q = math.radians(wide), math.radians(1.0)
    least = math.sqrt(1.0 / (24.0 * (3.0 / p**4 + 2.0 / (p * q) ** 2 + 3.0 / q**4)))
    t = np.linspace(0.0, 2.0 * np.pi, 721)[:-1]
    azimuth, distance = np.degrees(np.arctan2(wide * np.cos(t), np.sin(t))), np.hypot(wide * np.cos(t), np.sin(t))
    ellipse = shapely.Polygon(np.column_stack(destination(10.0, 0.0, azimuth, distance)))
    # The middles of 2000 cells leave out what varies within a cell, and the theory what is of higher order.
    assert limit(ellipse) == pytest.approx(least, rel=3e-3)


@pytest.mark.parametrize(
    ("region", "printed"),
    [
        ("country:US & box:-125,24,-66,50", 0.003129),
        ("continent:Africa", 0.01124),
        ("country:CA", 0.00527),
        pytest.param("continent:Europe & box:-26,34,60,72", 0.00635, marks=pytest.mark.slow),
    ],
)
def test_countries(region: str, printed: float) -> None:
    """What prototypes on another base and other nodes had at degree 8."""
    assert limit(region) == pytest.approx(printed, rel=5e-3)


@pytest.mark.slow
def test_what_has_no_limit() -> None:
    """The globe, a few points, other figures than the Airy-Kavrayskiy errors."""
    assert limit("globe") is None
    found = recommend(cap(10.0), criterion="max_omega", authorities=["ESRI"], limit=1)
    assert found.limit is None
    assert found.results[0].over_limit is None
    assert optimize("laea", cap(10.0), criterion="max_areal_error_ppm").limit is None


@pytest.mark.slow
def test_an_optimum_has_it() -> None:
    """The best stereographic map of a cap is sqrt(2) times the limit of all maps."""
    found = optimize("stere", cap(10.0), ellipsoid="sphere", criterion="airy_kavrayskiy_scaled")
    assert found.value / found.limit == pytest.approx(math.sqrt(2.0), rel=EXACT)
    assert found.to_dict()["limit"] == found.limit


@pytest.mark.slow
@pytest.mark.parametrize("purpose", ["any", "conformal", "equal-area"])
def test_recommended_maps_are_over_it(purpose: str) -> None:
    """The ratio of figure and limit; no map of Switzerland is below 1."""
    found = recommend("country:CH", purpose=purpose, limit=3)
    assert found.limit == limit("country:CH", purpose, WGS84)
    for one in found.results:
        assert one.over_limit == one.value / found.limit
        assert one.over_limit > 1.0
        assert one.to_dict()["over_limit"] == one.over_limit
    assert found.to_dict()["limit"] == found.limit
    assert [row["over_limit"] for row in found.rows()] == [one.over_limit for one in found.results]
