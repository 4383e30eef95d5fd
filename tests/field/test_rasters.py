"""The Jacobian on a raster, against closed forms, and against the Jacobian at points."""

import numpy as np
import pytest
from tables import each

from projdist import jacobian, jacobian_grid
from projdist.earth.ellipsoid import WGS84

# Differences of eighth order over neighbours half a degree apart: h^8 / 630 of a ninth derivative is 1e-13 of one that
# doubles with each order beside 60 degrees of latitude. Points that are no better than 1e-9 are done one by one.
CLOSE = 1e-9


def test_mercator() -> None:
    """On the ellipsoid h = k = 1 / (cos lat sqrt(1 - e2 sin2 lat)) in the raster's inside and at its rim."""
    lon, lat = np.linspace(-10.0, 10.0, 41), np.linspace(40.0, 60.0, 41)
    found = jacobian_grid("+proj=merc +ellps=WGS84", lon, lat)
    phi, e2 = np.radians(lat), WGS84.f * (2.0 - WGS84.f)
    scale = np.sqrt(1.0 - e2 * np.sin(phi) ** 2) / np.cos(phi)
    assert found.shape == (41, 41, 2, 2)
    np.testing.assert_allclose(found, scale[:, None, None, None] * np.eye(2) * np.ones((41, 41, 1, 1)), atol=CLOSE)


@pytest.mark.parametrize("projection", ["moll", "+proj=igh +R=6371000", "+proj=ortho +lat_0=20 +R=6371000"])
def test_points_of_a_raster(projection: str) -> None:
    """Pole lines, cuts and the edge of the map do not show in a raster's Jacobian: it is that of the points."""
    lon, lat = np.linspace(-60.0, 60.0, 25), np.linspace(-69.0, 84.0, 32)
    truth = jacobian(projection, *np.meshgrid(lon, lat))
    found = jacobian_grid(projection, lon, lat)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(truth))
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-7)


@each("first", [-80.0, -79.3])
@each("step", [5.0, 2.0, 1.0, 0.5])
def test_kinks_between_and_on_the_points(step: float, first: float) -> None:
    """Robinson's map has other polynomials every five degrees: two orders agree beside these by accident."""
    lon, lat = np.arange(0.0, 12 * step, step), np.arange(first, 80.0, step)
    truth = jacobian("robin", *np.meshgrid(lon, lat))
    np.testing.assert_allclose(jacobian_grid("robin", lon, lat), truth, rtol=0, atol=5e-9)


@pytest.mark.parametrize("lon", [[0.0, 1.0, 3.0], [[0.0, 1.0]]])
def test_uneven_rasters_are_refused(lon: object) -> None:
    """Neighbours are a stencil where they stand evenly."""
    with pytest.raises(ValueError, match=r"^Invalid longitudes of a raster\. They must be evenly spaced"):
        jacobian_grid("merc", lon, [0.0, 1.0])
