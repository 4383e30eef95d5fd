"""Jacobians of many points, over regions and on rasters, against closed forms; what polynomials must not get."""

import math

import numpy as np
import pytest
from jacobians import ACCURACY, FORMS, R, arc_distance, make, matrices, recorded
from tables import each

from projdist.earth.ellipsoid import SPHERE, WGS84
from projdist.field.at_points import Quality, derivatives
from projdist.field.chebyshev_panels import panels_for
from projdist.matrices.measures import principal_scales

MANY = 40_000  # of the globe, for which polynomials on panels pay
HONEST, ROUNDING = 10.0, 1e-12  # an error is told within this factor, and not below the rounding of J's own entries
SLOW_MAPS = ["+proj=tmerc +lon_0=9 +R=6371000", "gnom", "isea"]
BOUNDS = (-20.0, 30.0, 40.0, 70.0)


def scattered(n=MANY, limit=89.0):
    """Points of uniform density on the sphere up to a latitude."""
    rng, sin = np.random.default_rng(11), math.sin(math.radians(limit))
    return rng.uniform(-179.5, 179.5, n), np.degrees(np.arcsin(rng.uniform(-sin, sin, n)))


def points(n=3000, bounds=BOUNDS, seed=1):
    """Points of a box."""
    return np.random.default_rng(seed).uniform(bounds[:2], bounds[2:], (n, 2)).T


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
    """J is what it should be and its error what is told, or at least no less so than at points that are few."""
    many = derivatives(projection, lon, lat)
    assert (many.quality <= Quality.ONE_SIDED).mean() > 0.99
    over = np.flatnonzero(excess(many, truth) > 1.0)
    if over.size:
        few = derivatives(projection, lon[over], lat[over])
        assert (excess(many, truth)[over] <= 1.01 * excess(few, truth[over])).all()
    return many


@each(("earth", "ellipsoid"), [pytest.param(f"+R={R}", SPHERE, marks=pytest.mark.slow), ("+ellps=WGS84", WGS84)])
@each("name", FORMS)
def test_scales_of_closed_forms_at_many_points(name, earth, ellipsoid):
    """a and b of many points up to 60 degrees are the closed form's to 1e-11 of a, and the quality is OK."""
    definition, form = FORMS[name]
    projection = make(f"{definition} {earth}")
    lon, lat = scattered(20_000, limit=60.0)
    lon /= 6.0
    assert (panels_for(projection, lon, lat).at(lon, lat) > 0).mean() > 0.9
    found = derivatives(projection, lon, lat)
    scales = np.sort(form(ellipsoid, np.radians(lat)), axis=0)[::-1]
    assert (np.abs(principal_scales(found.jacobian).T - scales) / scales[0]).max() <= ACCURACY
    assert (found.quality == Quality.OK).all()


def test_a_full_jacobian():
    """All entries of J, of a map that has them, are right, and the error that is told is honest."""
    lon, lat = scattered()
    recording, calls = recorded(smooth)
    truth = smooth_jacobian(lon, lat)
    found = assert_honest(recording, lon, lat, truth)
    assert (np.abs(found.jacobian - truth).max(axis=(1, 2)) <= ACCURACY * np.abs(truth).max(axis=(1, 2))).all()
    assert sum(lon.size for lon, _ in calls) < 2 * MANY
    np.testing.assert_array_equal((found.x, found.y), smooth(lon, lat))


def test_an_oblique_aspect():
    """1 / cos(c / 2) and cos(c / 2) are the scales of an oblique equal-area map, whose pole lies within panels."""
    lon, lat = points(MANY, (-40.0, 20.0, 80.0, 89.0))
    found = derivatives(make(f"+proj=laea +lat_0=52 +lon_0=20 +R={R}"), lon, lat)
    c = arc_distance(lon, lat, 20.0, 52.0)
    np.testing.assert_allclose(principal_scales(found.jacobian).T, (1 / np.cos(c / 2), np.cos(c / 2)), rtol=ACCURACY)


def test_points_that_crowd():
    """Within a metre, and on the lines of a graticule, where panels end, points are no harder than others."""
    near = points(MANY, (7.3, 47.1, 7.3 + 1e-5, 47.1 + 1e-5))
    assert_honest(smooth, *near, smooth_jacobian(*near))
    lines = np.tile(np.arange(-175.0, 180, 5), 400), np.repeat(np.linspace(-80.0, 80.0, 400), 71)
    for lon, lat in (near, lines):
        found = derivatives("mercator", lon, lat)
        k = 1 / np.cos(np.radians(lat))
        np.testing.assert_allclose(principal_scales(found.jacobian), k[:, None] * [1, 1], rtol=ACCURACY)
        assert (found.quality == Quality.OK).all()


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
def test_kinks_and_tears_within_a_panel(size, jump):
    """A map whose scale or x jumps at a meridian by however little has J on either side, and none that reaches over."""
    lon, lat = scattered(limit=80.0)

    def broken(lon, lat):
        x, y = smooth(lon, lat)
        return x + size * R * np.radians(np.maximum(lon - 3.7, 0.0)) + np.where(lon > 33.21, jump, 0.0), y

    truth = smooth_jacobian(lon, lat)
    truth[:, 0, 0] += np.where(lon > 3.7, size, 0.0) / np.cos(np.radians(lat))
    found = assert_honest(broken, lon, lat, truth)
    assert not jump or (found.quality <= Quality.ONE_SIDED).all()


def bump(lon, lat, width):
    """A smooth hill of 1 at 41.3 E 17.7 N, 0 from so many degrees on, and its slopes a degree."""
    u, v = (lon - 41.3) / width, (lat - 17.7) / width
    rest = np.maximum(1.0 - u * u - v * v, 0.0)
    return rest**6, -12.0 * u * rest**5 / width, -12.0 * v * rest**5 / width


@each("width", [20.0, *(pytest.param(width, marks=pytest.mark.slow) for width in (3.0, 0.4)), 0.05])
@each("height", [1e5, 1.0, 1e-3])
def test_a_hill_within_a_panel(width, height):
    """A hill that no node of a panel may see is seen by the points that are on it."""
    lon, lat = scattered()
    lon[:200], lat[:200] = points(200, (41.3 - width, 17.7 - width, 41.3 + width, 17.7 + width))

    def hilly(lon, lat):
        x, y = smooth(lon, lat)
        return x, y + height * bump(lon, lat, width)[0]

    truth = smooth_jacobian(lon, lat)
    _, east, north = bump(lon, lat, width)
    truth[:, 1, 0] += height * np.degrees(east) / (R * np.cos(np.radians(lat)))
    truth[:, 1, 1] += height * np.degrees(north) / R
    assert_honest(hilly, lon, lat, truth)


def test_a_hole_within_a_panel():
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


@pytest.mark.slow
def test_noise_costs_little():
    """A map that no polynomial resolves costs a fifth of an evaluation a point more."""
    lon, lat = scattered()

    def rough(lon, lat):
        x, y = smooth(lon, lat)
        return x + 1e-3 * np.sin(1e5 * lon) * np.sin(1e5 * lat), y

    (many, of_many), (few, of_few) = recorded(rough), recorded(rough)
    derivatives(many, lon, lat)
    for start in range(0, MANY, 5000):
        derivatives(few, lon[start : start + 5000], lat[start : start + 5000])
    cost, least = (sum(lon.size for lon, _ in calls) for calls in (of_many, of_few))
    assert cost - least <= 0.2 * MANY


@pytest.mark.slow
def test_a_map_that_looks_at_all_its_points():
    """A function whose answer depends on what else it is asked is compared with itself at every point."""
    lon, lat = scattered(limit=60.0)

    def centred(lon, lat):
        x, y = smooth(lon, lat)
        return x - x.mean(), y

    for count in (MANY, 5000):
        assert derivatives(centred, lon[:count], lat[:count]).error.min() > 1e-10


def test_functions_are_asked_within_the_points():
    """A function is not asked for places beyond the points, but for the steps of differences."""
    recording, calls = recorded(smooth)
    derivatives(recording, *points(MANY, (5.0, 45.0, 9.0, 49.0)))
    lon, lat = np.hstack(calls)
    assert np.nanmin([lon - 4.9, lat - 44.9, 9.1 - lon, 49.1 - lat]) > 0
