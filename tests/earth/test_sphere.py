"""Points of the sphere, against pyproj's geodesics."""

import numpy as np
import pytest
from pyproj import Geod

from projdist.earth.ellipsoid import destination


def test_destination():
    """The ends of great circles are those of geographiclib on a sphere, poles and half turns included."""
    rng = np.random.default_rng(1)
    lon, azimuth = rng.uniform(-180, 180, (2, 1000))
    lat, distance = rng.uniform(-90, 90, 1000), rng.uniform(0, 180, 1000)
    lat[:2] = 90.0, -90.0
    radius = 6371008.7714
    truth = Geod(a=radius, b=radius).fwd(lon, lat, azimuth, np.radians(distance) * radius)
    found = destination(lon, lat, azimuth, distance)
    np.testing.assert_allclose(found[1], truth[1], atol=1e-12)
    np.testing.assert_allclose(np.mod(found[0] - truth[0] + 180.0, 360.0), 180.0, atol=1e-11)


def test_destination_broadcasts():
    """Points and directions broadcast."""
    lon, lat = destination(np.zeros((3, 1)), np.full((3, 1), 10.0), np.arange(4) * 90.0, 5.0)
    assert lon.shape == lat.shape == (3, 4)
    assert lat[2, 0] == pytest.approx(15.0, abs=1e-13)
