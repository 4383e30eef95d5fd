"""Maps over regions as polynomials, against closed forms, and how often they call the map."""

import numpy as np
import pytest
from jacobians import ACCURACY, R

from projdist.field.at_points import Quality, derivatives, interpolant
from projdist.projections import Projection

BOUNDS = (-20.0, 30.0, 40.0, 70.0)


def points(n=3000, bounds=BOUNDS):
    """Points of a box."""
    west, south, east, north = bounds
    rng = np.random.default_rng(1)
    return rng.uniform(west, east, n), rng.uniform(south, north, n)


def test_values_and_derivatives():
    """x, y and J of Mercator's map (Snyder 1987, 7-1 to 7-3), with an error that is no larger than is told."""
    lon, lat = points()
    found = interpolant("mercator", BOUNDS)(lon, lat)
    phi = np.radians(lat)
    np.testing.assert_allclose(found.x, R * np.radians(lon), atol=1e-7)
    np.testing.assert_allclose(found.y, R * np.arctanh(np.sin(phi)), atol=1e-7)
    gap = np.abs(found.jacobian - np.eye(2) / np.cos(phi)[:, None, None]).sum(axis=(1, 2)) * np.cos(phi)
    assert gap.max() <= ACCURACY
    assert (gap <= 10 * found.error + 1e-13).all()
    assert (found.quality == Quality.OK).all()


def test_the_map_is_not_called_again():
    """Where there are polynomials the map is not called; elsewhere it is, and answers as ever."""
    calls = []

    def conic(lon, lat):
        calls.append(lon.size)
        rho, theta = 1.8 - np.radians(lat), 0.7 * np.radians(lon)
        return R * rho * np.sin(theta), -R * rho * np.cos(theta)

    f = interpolant(conic, BOUNDS)
    assert sum(calls) < 10_000
    calls.clear()
    lon, lat = points(100_000)
    found = f(lon, lat)
    assert not calls
    rho = 1.8 - np.radians(lat)
    k = 0.7 * rho / np.cos(np.radians(lat))
    np.testing.assert_allclose(np.hypot(found.jacobian[:, 0, 0], found.jacobian[:, 1, 0]), k, rtol=ACCURACY)
    np.testing.assert_allclose(np.hypot(found.jacobian[:, 0, 1], found.jacobian[:, 1, 1]), 1.0, rtol=ACCURACY)
    beyond = f(100.0, 10.0)
    assert calls
    np.testing.assert_array_equal(beyond.jacobian, derivatives(conic, 100.0, 10.0).jacobian)


GLOBAL = ["robinson", "igh", "EPSG:3035", "+proj=tmerc +lon_0=9 +R=6371000"]


@pytest.mark.parametrize("name", [*GLOBAL, *(pytest.param(name, marks=pytest.mark.slow) for name in ("gnom", "isea"))])
def test_any_map_of_the_globe(name):
    """Seams, kinks, horizons and noise: the same qualities but beside edges, and J to 1e-9 of what differences have."""
    lon, lat = points(3000, (-180.0, -90.0, 180.0, 90.0))
    found, truth = interpolant(name, (-180, -90, 180, 90))(lon, lat), derivatives(name, lon, lat)
    np.testing.assert_array_equal(found.quality == Quality.OUTSIDE, truth.quality == Quality.OUTSIDE)
    both = (found.quality <= Quality.ONE_SIDED) & (truth.quality <= Quality.ONE_SIDED)
    size = np.abs(truth.jacobian[both]).sum(axis=(1, 2))
    assert (np.abs(found.jacobian - truth.jacobian)[both].sum(axis=(1, 2)) <= 1e-8 * size).all()
    np.testing.assert_allclose(found.x[both], truth.x[both], atol=1e-6, rtol=1e-12)


def test_shapes_and_missing_points():
    """Points have any shape, and what is no number has no figures."""
    f = interpolant(Projection.from_user_input("mercator"), BOUNDS)
    found = f([[0.0, 10.0], [np.nan, 20.0]], 60.0)
    assert found.jacobian.shape == (2, 2, 2, 2)
    assert np.isnan(found.x).tolist() == [[False, False], [True, False]]
    np.testing.assert_allclose(found.jacobian[0, :, 0, 0], 2.0, rtol=ACCURACY)
