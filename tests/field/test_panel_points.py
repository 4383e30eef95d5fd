"""Jacobians of very many points by polynomials on panels, against closed forms; and what must not be given to them."""

import math

import numpy as np
import pytest
from jacobians import ACCURACY, FORMS, R, arc_distance, make, value
from tables import each

from projdist.earth.ellipsoid import SPHERE, WGS84
from projdist.field.at_points import Quality, derivatives
from projdist.field.chebyshev_panels import panels_for
from projdist.matrices.measures import principal_scales
from projdist.projections import Projection

MANY = 50_000
# What is told of an error is told within this factor, and not below the rounding of J's own entries.
HONEST, ROUNDING = 10.0, 1e-12


def scattered(n=MANY, limit=89.0, seed=11):
    """Points of uniform density on the sphere up to a latitude."""
    rng = np.random.default_rng(seed)
    sin = math.sin(math.radians(limit))
    return rng.uniform(-179.5, 179.5, n), np.degrees(np.arcsin(rng.uniform(-sin, sin, n)))


class Counted:
    """A map that counts where it was evaluated, and how far out."""

    def __init__(self, function):
        self.function, self.count, self.box = function, 0, [np.inf, np.inf, -np.inf, -np.inf]

    def __call__(self, lon, lat):
        """The map at points."""
        self.count += lon.size
        low, high = np.fmin, np.fmax
        west, south, east, north = self.box
        self.box = [low(west, lon.min()), low(south, lat.min()), high(east, lon.max()), high(north, lat.max())]
        return self.function(lon, lat)


def smooth(lon, lat):
    """A map with J known, and full in either direction: x = R sin(lam) cos(phi), y = R (phi + sin^2(lam) / 5)."""
    lam, phi = np.radians(lon), np.radians(lat)
    return R * np.sin(lam) * np.cos(phi), R * (phi + 0.2 * np.sin(lam) ** 2)


def smooth_jacobian(lon, lat):
    """J of `smooth` (n, 2, 2) by hand."""
    lam, phi = np.radians(lon), np.radians(lat)
    J = np.empty((lon.size, 2, 2))
    J[:, 0, 0], J[:, 0, 1] = np.cos(lam), -np.sin(lam) * np.sin(phi)
    J[:, 1, 0], J[:, 1, 1] = 0.4 * np.sin(lam) * np.cos(lam) / np.cos(phi), 1.0
    return J


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
    """a and b of 50,000 points up to 60 degrees are the closed form's to 1e-11 of a, and the quality is OK."""
    definition, form = FORMS[name]
    projection = make(f"{definition} {earth}")
    lon, lat = scattered(limit=60.0)
    lon /= 3.0
    assert (panels_for(projection, lon, lat).at(lon, lat) > 0).mean() > 0.9
    found = derivatives(projection, lon, lat)
    h, k = form(ellipsoid, np.radians(lat))
    a, b = principal_scales(found.jacobian).T
    assert (np.abs(a - np.maximum(h, k)) / np.maximum(h, k)).max() <= ACCURACY
    assert (np.abs(b - np.minimum(h, k)) / np.maximum(h, k)).max() <= ACCURACY
    assert (found.quality == Quality.OK).all()


def test_a_full_jacobian():
    """All entries of J, of a map that has them, are right, and the error that is told is honest."""
    lon, lat = scattered()
    counted = Counted(smooth)
    truth = smooth_jacobian(lon, lat)
    found = assert_honest(counted, lon, lat, truth)
    assert (np.abs(found.jacobian - truth).max(axis=(1, 2)) <= ACCURACY * np.abs(truth).max(axis=(1, 2))).all()
    assert counted.count < 2 * MANY
    np.testing.assert_array_equal((found.x, found.y), smooth(lon, lat))


def test_an_oblique_aspect():
    """1 / cos(c / 2) and cos(c / 2) are the scales of an oblique equal-area map, whose pole lies within panels."""
    rng = np.random.default_rng(2)
    lon, lat = rng.uniform(-40, 80, MANY), rng.uniform(20, 89, MANY)
    found = derivatives(make(f"+proj=laea +lat_0=52 +lon_0=20 +R={R}"), lon, lat)
    c = arc_distance(lon, lat, 20.0, 52.0)
    a, b = principal_scales(found.jacobian).T
    assert np.abs(a * np.cos(c / 2) - 1).max() <= ACCURACY
    assert np.abs(b / np.cos(c / 2) - 1).max() <= ACCURACY


def test_points_within_a_metre():
    """Points that crowd in one place are no harder than others."""
    rng = np.random.default_rng(4)
    lon, lat = 7.3 + rng.uniform(0, 1e-5, MANY), 47.1 + rng.uniform(0, 1e-5, MANY)
    found = derivatives("mercator", lon, lat)
    np.testing.assert_allclose(
        principal_scales(found.jacobian), 1 / np.cos(np.radians(lat))[:, None] * [1, 1], rtol=ACCURACY
    )
    counted = Counted(smooth)
    assert_honest(counted, lon, lat, smooth_jacobian(lon, lat))


@pytest.mark.parametrize("turns", [-1, 0, 1])
def test_longitudes_of_other_turns(turns):
    """The meridians may be counted from anywhere."""
    lon, lat = scattered()
    lon = lon + 360.0 * turns
    found = derivatives("sinusoidal", lon, lat)
    shear = np.radians(lon - 360.0 * turns) * np.sin(np.radians(lat))
    np.testing.assert_allclose(value("s", found.jacobian), 1.0, rtol=10 * ACCURACY)
    np.testing.assert_allclose(found.jacobian[:, 0, 1], -shear, atol=1e-10)


def test_seams_and_poles_among_many():
    """Points on the antimeridian have the derivative of their side, and a pole that is a line has none, as ever."""
    lon, lat = scattered()
    lon[:500], lat[500:1000] = np.where(np.arange(500) % 2, 180.0, -180.0), 90.0
    found = derivatives("winkel-tripel", lon, lat)
    alone = derivatives("winkel-tripel", lon[:1000], lat[:1000])
    np.testing.assert_array_equal(found.quality[:1000], alone.quality)
    assert (found.quality[:500] == Quality.ONE_SIDED).all()
    np.testing.assert_allclose(found.jacobian[:500], alone.jacobian[:500], rtol=1e-10, atol=1e-10)


def test_points_on_few_meridians_and_parallels():
    """Points on the lines of a graticule, where panels end, are measured as they are alone."""
    lon = np.tile(np.arange(-175.0, 180, 5), 400)
    lat = np.repeat(np.linspace(-80.0, 80.0, 400), 71)
    k = 1 / np.cos(np.radians(lat))
    found = derivatives("mercator", lon, lat)
    np.testing.assert_allclose(principal_scales(found.jacobian), k[:, None] * [1, 1], rtol=ACCURACY)
    assert (found.quality == Quality.OK).all()


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
    assert np.isfinite(derivatives("mercator", np.linspace(-360.0, 539.0, MANY), 10.0).jacobian).all()


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6, 1e-9, 1e-11])
def test_a_kink_within_a_panel(size):
    """A map whose scale jumps at a meridian by however little has J on either side as it is told."""
    lon, lat = scattered(limit=80.0)

    def kinked(lon, lat):
        x, y = smooth(lon, lat)
        return x + size * R * np.radians(np.maximum(lon - 3.7, 0.0)), y

    truth = smooth_jacobian(lon, lat)
    truth[:, 0, 0] += np.where(lon > 3.7, size, 0.0) / np.cos(np.radians(lat))
    assert_honest(kinked, lon, lat, truth)


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
    rng = np.random.default_rng(8)
    lon[:200], lat[:200] = 41.3 + width * rng.uniform(-1, 1, 200), 17.7 + width * rng.uniform(-1, 1, 200)

    def hilly(lon, lat):
        x, y = smooth(lon, lat)
        return x, y + height * bump(lon, lat, width)[0]

    truth = smooth_jacobian(lon, lat)
    _, east, north = bump(lon, lat, width)
    truth[:, 1, 0] += height * np.degrees(east) / (R * np.cos(np.radians(lat)))
    truth[:, 1, 1] += height * np.degrees(north) / R
    assert_honest(hilly, lon, lat, truth)


def test_a_hole_within_a_panel():
    """Points in a hole are outside, those around it have J."""
    lon, lat = scattered()
    lon[:100], lat[:100] = 41.3 + np.linspace(-0.1, 0.1, 100), 17.7

    def holed(lon, lat):
        x, y = smooth(lon, lat)
        hole = np.hypot(lon - 41.3, lat - 17.7) < 0.05
        return np.where(hole, np.nan, x), np.where(hole, np.nan, y)

    found = derivatives(holed, lon, lat)
    inside = np.hypot(lon - 41.3, lat - 17.7) < 0.05
    assert inside.sum() > 40
    np.testing.assert_array_equal(found.quality == Quality.OUTSIDE, inside)
    good = found.quality <= Quality.ONE_SIDED
    truth = smooth_jacobian(lon, lat)
    assert np.abs(found.jacobian - truth)[good].max() <= 1e-8
    assert good[~inside].mean() > 0.999


def test_a_torn_map():
    """A map that jumps at a meridian of no round number has J on both sides, and none that reaches over."""
    lon, lat = scattered(limit=80.0)

    def torn(lon, lat):
        x, y = smooth(lon, lat)
        return x + np.where(lon > 33.21, 1e6, 0.0), y

    found = assert_honest(torn, lon, lat, smooth_jacobian(lon, lat))
    assert (found.quality <= Quality.ONE_SIDED).all()


@pytest.mark.slow
def test_noise_costs_little():
    """A map that no polynomial resolves costs a fifth of an evaluation a point more."""
    lon, lat = scattered()

    def rough(lon, lat):
        x, y = smooth(lon, lat)
        return x + 1e-3 * np.sin(1e5 * lon) * np.sin(1e5 * lat), y

    counted = Counted(rough)
    derivatives(counted, lon, lat)
    few = Counted(rough)
    for start in range(0, MANY, 5000):
        derivatives(few, lon[start : start + 5000], lat[start : start + 5000])
    assert counted.count - few.count <= 0.2 * MANY


@pytest.mark.slow
def test_a_map_that_looks_at_all_its_points():
    """A function whose answer depends on what else it is asked is compared with itself at every point."""
    lon, lat = scattered(limit=60.0)

    def centred(lon, lat):
        x, y = smooth(lon, lat)
        return x - x.mean(), y

    found, alone = derivatives(centred, lon, lat), derivatives(centred, lon[:5000], lat[:5000])
    assert found.error.min() > 1e-10
    assert alone.error.min() > 1e-10


def test_functions_are_asked_within_the_points():
    """A function is not asked for places beyond the points, but for the steps of differences."""
    rng = np.random.default_rng(5)
    counted = Counted(smooth)
    derivatives(counted, rng.uniform(5.0, 9.0, MANY), rng.uniform(45.0, 49.0, MANY))
    west, south, east, north = counted.box
    assert min(west - 4.9, south - 44.9, 9.1 - east, 49.1 - north) > 0


@pytest.mark.slow
def test_many_and_few_agree():
    """Among many a point has the J that it has alone, within what is told of both."""
    lon, lat = scattered()
    for name in ("robinson", "igh", "goode", "EPSG:3035", "isea", "gnom"):
        projection = Projection.from_user_input(name)
        many, few = derivatives(projection, lon, lat), derivatives(projection, lon[:3000], lat[:3000])
        both = (many.quality[:3000] <= Quality.ONE_SIDED) & (few.quality <= Quality.ONE_SIDED)
        gap = np.abs(many.jacobian[:3000] - few.jacobian)[both].sum(axis=(1, 2))
        size = np.abs(few.jacobian[both]).sum(axis=(1, 2))
        told = HONEST * (many.error[:3000] + few.error)[both] + ROUNDING
        if name != "robinson":  # whose table has kinks that differences near them feel, and tell too little of
            assert (gap <= told * size).all()
        assert np.quantile(gap / size, 0.99) <= ACCURACY
