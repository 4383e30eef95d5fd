"""The ellipsoid against pyproj's geodesics, quadrature, published constants and identities."""

import dataclasses
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st
from pyproj import Geod
from refusals import refuses
from tables import each

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, SPHERE, WGS84, Ellipsoid, destination

FLATTENINGS, LATITUDES = st.floats(0.0, 0.5), st.floats(-90.0, 90.0)
ROUNDING = 1e-14  # of a handful of float64 operations


def test_wgs84_radii_at_pole_and_equator():
    """At the pole M = N = a^2 / b, at the equator N = a and M = b^2 / a (Snyder 1987, page 25)."""
    b = WGS84.a * (1 - WGS84.f)
    np.testing.assert_allclose(WGS84.radii(np.array([90.0, -90.0])), WGS84.a**2 / b, rtol=ROUNDING)
    np.testing.assert_allclose(WGS84.radii(0.0), (b**2 / WGS84.a, WGS84.a), rtol=ROUNDING)
    # NGA.STND.0036 "World Geodetic System 1984", 2014, table 3.5: polar radius of curvature, square of eccentricity.
    assert WGS84.radii(90.0)[0] == pytest.approx(6399593.6258, abs=5e-5)
    assert WGS84.eccentricity_squared == pytest.approx(0.00669437999014, abs=5e-15)
    assert SPHERE.eccentricity_squared == 0.0
    np.testing.assert_allclose(SPHERE.radii(np.array([-90.0, 0.0, 12.3])), SPHERE.a, rtol=ROUNDING)


@each("lat", [-80.0, -37.0, 0.5, 20.0, 45.0, 71.0, 89.0])
def test_radii_against_geodesic_lengths(lat):
    """M and N cos(lat) are metres per radian along the meridian and the parallel, as pyproj measures them."""
    # A chord of 1e-3 degrees (100 m) differs from the arc by 1e-11; Geod is good to 15 nm, 1e-10 of it.
    geod, (M, N), half = Geod(a=WGS84.a, f=WGS84.f), WGS84.radii(lat), 5e-4
    north = geod.inv(10.0, lat - half, 10.0, lat + half)[2]
    east = geod.inv(10.0 - half, lat, 10.0 + half, lat)[2]
    truth = np.radians(2 * half) * np.array([M, N * math.cos(math.radians(lat))])
    assert (north, east) == pytest.approx(truth, rel=1e-9)


def test_areas_of_the_earth():
    """Areas of WGS 84 and of the sphere are 510 065 621.724 and 4 pi R^2 square kilometres, with R = (2 a + b) / 3."""
    # NGA.STND.0036, 2014 (and Moritz 1980 for GRS 80, 5.10065622e14): 510 065 621.724 km^2.
    assert WGS84.area / 1e6 == pytest.approx(510_065_621.724, abs=5e-4)
    assert pytest.approx(4 * math.pi * MEAN_EARTH_RADIUS**2, rel=ROUNDING) == SPHERE.area
    assert pytest.approx(WGS84.a * (1 - WGS84.f / 3), abs=1e-4) == MEAN_EARTH_RADIUS
    assert Ellipsoid(MEAN_EARTH_RADIUS, 0.0) == SPHERE
    assert (SPHERE.is_sphere, WGS84.is_sphere) == (True, False)


@each("f", [0.0, 1e-12, 1e-6, 1 / 298.257223563, 0.1, 0.4])
def test_area_below_is_the_integral_of_m_n_cos(f):
    """`area_below` is the integral of M N cos(lat), by mpmath's quadrature."""
    lats = [-90.0, -33.0, 1e-3, 45.0, 89.5]
    with mpmath.workdps(20):
        e2 = mpmath.mpf(f) * (2 - mpmath.mpf(f))
        ends = [mpmath.sin(mpmath.radians(lat)) for lat in lats]
        truth = [float(mpmath.quad(lambda s: (1 - e2) / (1 - e2 * s * s) ** 2, [0, end])) for end in ends]
    assert Ellipsoid(6378137.0, f).area_below(np.array(lats)) == pytest.approx(
        6378137.0**2 * np.array(truth), rel=1e-13
    )


@given(f=FLATTENINGS, lat=LATITUDES)
def test_symmetry_and_bounds(f, lat):
    """M <= N, both even in latitude and between b^2 / a and a^2 / b; the area is odd and below a hemisphere's."""
    ellipsoid, b = Ellipsoid(1.0, f), 1.0 - f
    M, N = ellipsoid.radii(lat)
    assert M <= N * (1 + ROUNDING)
    assert b * b * (1 - ROUNDING) <= M <= (1 + ROUNDING) / b
    assert 1 - ROUNDING <= N <= (1 + ROUNDING) / b
    assert ellipsoid.radii(-lat) == (M, N)
    assert ellipsoid.area_below(-lat) == -ellipsoid.area_below(lat)
    assert abs(ellipsoid.area_below(lat)) <= ellipsoid.area / (4 * math.pi) * (1 + ROUNDING)


def test_what_is_no_ellipsoid():
    """A semi-major axis that is not positive and finite, and a flattening outside [0, 1), as an inverse one."""
    for a in (0.0, -1.0, math.inf, math.nan):
        refuses(rf"^Invalid semi-major axis '{a}'\. It must be positive, in metres\.$", Ellipsoid, a, 0.0)
    for f in (-1e-3, 1.0, 298.257, math.nan):
        refuses(rf"^Invalid flattening '{f}'\. It must be at least 0 and below 1\.$", Ellipsoid, 1.0, f)


def test_an_ellipsoid_is_a_value():
    """Equal by content, hashable, not changed in place; latitudes of any shape give radii and areas of that shape."""
    lat, again = np.linspace(-90, 90, 12).reshape(3, 4), Ellipsoid(6378137.0, 1 / 298.257223563)
    assert {values.shape for values in (*WGS84.radii(lat), WGS84.area_below(lat))} == {(3, 4)}
    assert np.isnan(WGS84.radii(np.nan)).all()
    assert again == WGS84
    assert len({WGS84, again, SPHERE}) == 2
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'a'"):
        WGS84.a = 1.0


def test_destination():
    """The ends of great circles are those of geographiclib on a sphere, poles and half turns included."""
    rng, radius = np.random.default_rng(1), 6371008.7714
    lon, azimuth = rng.uniform(-180, 180, (2, 1000))
    lat, distance = rng.uniform(-90, 90, 1000), rng.uniform(0, 180, 1000)
    lat[:2] = 90.0, -90.0
    both = destination(lon[:, None], lat[:, None], azimuth[:3], 5.0)
    assert [values.shape for values in both] == [(1000, 3)] * 2  # points and directions broadcast
    truth = Geod(a=radius, b=radius).fwd(lon, lat, azimuth, np.radians(distance) * radius)
    found = destination(lon, lat, azimuth, distance)
    np.testing.assert_allclose(found[1], truth[1], atol=1e-12)
    np.testing.assert_allclose(np.mod(found[0] - truth[0] + 180.0, 360.0), 180.0, atol=1e-11)
