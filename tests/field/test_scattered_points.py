"""Jacobians of points all over the globe against closed forms, of maps that are smooth, torn, holed or nowhere."""

import math

import numpy as np
from jacobians import ACCURACY, R, matrices
from tables import each

from projdist.field.at_points import Quality, derivatives
from projdist.matrices.measures import principal_scales

MANY = 10_000  # more than are taken together
HONEST, ROUNDING = 10.0, 1e-12  # an error is told within this factor, and not below the rounding of J's own entries


def scattered(n=MANY, limit=89.0):
    """Points of uniform density on the sphere up to a latitude."""
    rng, sin = np.random.default_rng(11), math.sin(math.radians(limit))
    return rng.uniform(-179.5, 179.5, n), np.degrees(np.arcsin(rng.uniform(-sin, sin, n)))


def smooth(lon, lat):
    """A map with J known, and full in either direction: x = R sin(lam) cos(phi), y = R (phi + sin^2(lam) / 5)."""
    lam, phi = np.radians(lon), np.radians(lat)
    return R * np.sin(lam) * np.cos(phi), R * (phi + 0.2 * np.sin(lam) ** 2)


def smooth_jacobian(lon, lat):
    """J of `smooth` (n, 2, 2) by hand."""
    lam, phi = np.radians(lon), np.radians(lat)
    return matrices(np.cos(lam), -np.sin(lam) * np.sin(phi), 0.2 * np.sin(2 * lam) / np.cos(phi), 1.0)


def excess(found, truth):
    """By how much the errors of J (n,) are larger than what is told of them; 0 where no good J is given."""
    actual = np.abs(found.jacobian - truth).sum(axis=(1, 2)) / np.abs(truth).sum(axis=(1, 2))
    return np.where(found.quality <= Quality.ONE_SIDED, actual / (HONEST * found.error + ROUNDING), 0.0)


def assert_honest(projection, lon, lat, truth):
    """J is what it should be, and its error what is told, but where steps just reach over a kink of 1e-9."""
    found = derivatives(projection, lon, lat)
    assert (found.quality <= Quality.ONE_SIDED).mean() > 0.99
    assert np.count_nonzero(excess(found, truth) > 1.0) <= 2
    return found


def test_a_full_jacobian():
    """All entries of J, of a map that has them, are right, and the error that is told is honest."""
    lon, lat = scattered()
    truth = smooth_jacobian(lon, lat)
    found = assert_honest(smooth, lon, lat, truth)
    assert (np.abs(found.jacobian - truth).max(axis=(1, 2)) <= ACCURACY * np.abs(truth).max(axis=(1, 2))).all()
    np.testing.assert_array_equal((found.x, found.y), smooth(lon, lat))


def test_seams_and_poles_among_many():
    """Points on the antimeridian have the derivative of their side, and a pole that is a line has none, as ever."""
    lon, lat = scattered()
    lon[:500], lat[500:1000] = np.where(np.arange(500) % 2, 180.0, -180.0), 90.0
    found = derivatives("winkel-tripel", lon, lat)
    alone = derivatives("winkel-tripel", lon[:1000], lat[:1000])
    np.testing.assert_array_equal(found.quality[:1000], alone.quality)
    assert (found.quality[:500] == Quality.ONE_SIDED).all()
    np.testing.assert_allclose(found.jacobian[:500], alone.jacobian[:500], rtol=1e-10, atol=1e-10)


def test_missing_points_among_many():
    """Points without a longitude, and beyond the poles, have no figures, and do not touch those of others."""
    lon, lat = scattered()
    lon[::7], lat[::11], lat[::13], lon[::17] = np.nan, 91.0, -1e9, np.inf
    missing = ~np.isfinite(lon) | (np.abs(lat) > 90)
    found = derivatives("mercator", lon, lat)
    assert (found.quality[missing] == Quality.OUTSIDE).all()
    assert np.isnan(found.jacobian[missing]).all()
    k = 1 / np.cos(np.radians(lat[~missing]))
    np.testing.assert_allclose(principal_scales(found.jacobian[~missing]), k[:, None] * [1, 1], rtol=ACCURACY)
    assert (derivatives("mercator", np.full(MANY, np.nan), 0.0).quality == Quality.OUTSIDE).all()
    # The meridians may be counted from anywhere.
    lon, lat = np.linspace(-360.0, 539.0, MANY), np.linspace(-60.0, 60.0, MANY)
    J, shear = (
        derivatives("sinusoidal", lon, lat).jacobian,
        np.radians((lon + 180) % 360 - 180) * np.sin(np.radians(lat)),
    )
    np.testing.assert_allclose(J[:, 0, 1], -shear, atol=1e-10)


@each(("size", "jump"), [(1.0, 0.0), (1e-3, 0.0), (1e-6, 0.0), (1e-9, 0.0), (1e-11, 0.0), (0.0, 1e6)])
def test_kinks_and_tears_between_points(size, jump):
    """A map whose scale or x jumps at a meridian by however little has J on either side, and none that reaches over."""
    lon, lat = scattered(limit=80.0)

    def broken(lon, lat):
        x, y = smooth(lon, lat)
        return x + size * R * np.radians(np.maximum(lon - 3.7, 0.0)) + np.where(lon > 33.21, jump, 0.0), y

    truth = smooth_jacobian(lon, lat)
    truth[:, 0, 0] += np.where(lon > 3.7, size, 0.0) / np.cos(np.radians(lat))
    found = assert_honest(broken, lon, lat, truth)
    assert not jump or (found.quality <= Quality.ONE_SIDED).all()


def test_a_hole_between_points():
    lon, lat = scattered()
    lon[:100], lat[:100] = 41.3 + np.linspace(-0.1, 0.1, 100), 17.7

    def holed(lon, lat):
        x, y = smooth(lon, lat)
        hole = np.hypot(lon - 41.3, lat - 17.7) < 0.05
        return np.where(hole, np.nan, x), np.where(hole, np.nan, y)

    found, inside = derivatives(holed, lon, lat), np.hypot(lon - 41.3, lat - 17.7) < 0.05
    assert inside.sum() > 40
    np.testing.assert_array_equal(found.quality == Quality.OUTSIDE, inside)
    good = found.quality <= Quality.ONE_SIDED
    assert np.abs(found.jacobian - smooth_jacobian(lon, lat))[good].max() <= 1e-8
    assert good[~inside].mean() > 0.999
