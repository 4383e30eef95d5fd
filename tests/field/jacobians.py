"""Points, ellipsoids and projections for tests of Jacobians."""

import math

import numpy as np

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS
from projdist.field.at_points import Quality
from projdist.matrices.measures import get_measure
from projdist.projections import Projection

R = MEAN_EARTH_RADIUS
UNDEFINED = (Quality.SEAM, Quality.SINGULAR, Quality.OUTSIDE)

# The relative accuracy of a and b that the stencils promise, with a margin of 10 over the target of their own check.
ACCURACY = 1e-11


def make(value):
    return Projection.from_user_input(value)


def value(name, J, H=None):
    return get_measure(name)(J, H)


def matrices(*entries):
    """Matrices (n, 2, 2) of the entries (n,), or numbers, of their first row and their second."""
    return np.moveaxis(np.array(np.broadcast_arrays(*entries)).reshape(2, 2, -1), -1, 0)


def random_points(n=10_000, limit=89.9, seed=3):
    """Points of uniform density on the sphere, those beyond the limit spread over the last degrees to it."""
    rng = np.random.default_rng(seed)
    lat = np.degrees(np.arcsin(rng.uniform(-1, 1, n)))
    lat[: n // 5] = rng.choice([-1, 1], n // 5) * rng.uniform(limit - 9.9, limit, n // 5)
    lat[n // 5 : n // 4] = rng.choice([-1, 1], n // 4 - n // 5) * rng.uniform(limit - 1, limit, n // 4 - n // 5)
    return rng.uniform(-179.9, 179.9, n), np.clip(lat, -limit, limit)


def eccentricity(ellipsoid):
    return math.sqrt(ellipsoid.eccentricity_squared)


def m_of(ellipsoid, phi):
    """14-15, the radius of the parallel over a."""
    return np.cos(phi) / np.sqrt(1 - ellipsoid.eccentricity_squared * np.sin(phi) ** 2)


def t_of(ellipsoid, phi):
    """15-9, with the half-angle as cos / (1 + sin), or its inverse, which loses no digits at either pole."""
    e, sin, cos = eccentricity(ellipsoid), np.sin(phi), np.cos(phi)
    half = np.where(sin > 0, cos / (1 + np.abs(sin)), (1 + np.abs(sin)) / cos)
    return half * np.exp(e * np.arctanh(e * sin))


def q_of(ellipsoid, phi):
    """3-12."""
    e, sin = eccentricity(ellipsoid), np.sin(phi)
    return (1 - e * e) * (sin / (1 - (e * sin) ** 2) + np.arctanh(e * sin) / e) if e else 2 * sin


def gauss(a, b, n=48):
    """Gauss-Legendre nodes and weights on [a, b]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (a + b) + 0.5 * (b - a) * x, 0.5 * (b - a) * w


def from_pole(phi, density):
    """The integral of a density over the colatitude from the north pole, without cancellation."""
    theta, weight = gauss(0.0, (math.pi / 2 - phi)[..., None])
    return (density(theta) * weight).sum(axis=-1)


def mercator(ellipsoid, phi):
    """7-8: h = k = 1 / m."""
    return 1 / m_of(ellipsoid, phi), 1 / m_of(ellipsoid, phi)


def lambert_conformal(ellipsoid, phi, one=33.0, two=45.0):
    """15-4, 15-8, 15-10 and 15-7."""
    m1, m2, t1, t2 = (f(ellipsoid, math.radians(lat)) for f in (m_of, t_of) for lat in (one, two))
    n = math.log(m1 / m2) / math.log(t1 / t2)
    k = m1 * (t_of(ellipsoid, phi) / t1) ** n / m_of(ellipsoid, phi)
    return k, k


def albers(ellipsoid, phi, one=29.5, two=45.5):
    """14-13, 14-14, 14-12 and 14-16, 14-18."""
    m1, m2, q1, q2 = (f(ellipsoid, math.radians(lat)) for f in (m_of, q_of) for lat in (one, two))
    n = (m1**2 - m2**2) / (q2 - q1)
    k = np.sqrt(m1**2 + n * (q1 - q_of(ellipsoid, phi))) / m_of(ellipsoid, phi)
    return 1 / k, k


def polar_stereographic(ellipsoid, phi):
    """21-33 and 21-32 with k_0 = 1 at the north pole."""
    e = eccentricity(ellipsoid)
    rho = 2 * t_of(ellipsoid, phi) / math.sqrt((1 + e) ** (1 + e) * (1 - e) ** (1 - e))
    return rho / m_of(ellipsoid, phi), rho / m_of(ellipsoid, phi)


def polar_equal_area(ellipsoid, phi):
    """24-23: rho = a sqrt(q_p - q), k = rho / (a m); dq / dphi = 2 (1 - e2) cos / (1 - e2 sin^2)^2."""
    e2 = ellipsoid.eccentricity_squared
    q = from_pole(phi, lambda theta: 2 * (1 - e2) * np.sin(theta) / (1 - e2 * np.cos(theta) ** 2) ** 2)
    k = np.sqrt(q) / m_of(ellipsoid, phi)
    return 1 / k, k


FORMS = {
    "merc": ("+proj=merc", mercator),
    "lcc": ("+proj=lcc +lat_1=33 +lat_2=45", lambert_conformal),
    "aea": ("+proj=aea +lat_1=29.5 +lat_2=45.5", albers),
    "stere": ("+proj=stere +lat_0=90", polar_stereographic),
    "laea": ("+proj=laea +lat_0=90", polar_equal_area),
}


def recorded(function):
    """A map, and the longitudes and latitudes of each of its calls."""
    calls = []

    def recording(lon, lat):
        calls.append((lon.ravel(), lat.ravel()))
        return function(lon, lat)

    return recording, calls


def arc_distance(lon, lat, lon_0, lat_0):
    """The angle between points of the sphere, good to rounding at any distance."""

    def unit(lon, lat):
        lam, phi = np.radians(lon), np.radians(lat)
        return np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=-1)

    p, centre = unit(np.asarray(lon), np.asarray(lat)), unit(lon_0, lat_0)
    return 2 * np.arctan2(np.linalg.norm(p - centre, axis=-1), np.linalg.norm(p + centre, axis=-1))
