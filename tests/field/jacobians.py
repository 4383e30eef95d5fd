"""Points, ellipsoids and projections for tests of Jacobians."""

import math

import numpy as np
from scipy.special import ellipeinc

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
    e2, sin = ellipsoid.eccentricity_squared, np.sin(phi)
    if e2 == 0:
        return 2 * sin
    e = math.sqrt(e2)
    return (1 - e2) * (sin / (1 - e2 * sin**2) + np.arctanh(e * sin) / e)


def q_from_pole(ellipsoid, colat):
    """q at the north pole less q at the colatitude, without cancellation."""
    # dq / dphi = 2 (1 - e2) cos / (1 - e2 sin^2)^2: Gauss-Legendre over the colatitude.
    nodes, weights = np.polynomial.legendre.leggauss(40)
    e2 = ellipsoid.eccentricity_squared
    theta = 0.5 * np.multiply.outer(colat, nodes + 1)
    return 0.5 * colat * ((2 * (1 - e2) * np.sin(theta) / (1 - e2 * np.cos(theta) ** 2) ** 2) @ weights)


def arc_of(ellipsoid, phi):
    """3-21 in closed form: the meridian's arc over a, by the incomplete elliptic integral."""
    e2 = ellipsoid.eccentricity_squared
    return ellipeinc(phi, e2) - e2 * np.sin(phi) * np.cos(phi) / np.sqrt(1 - e2 * np.sin(phi) ** 2)


def mercator(ellipsoid, phi):
    """7-8: h = k = 1 / m."""
    return 1 / m_of(ellipsoid, phi), 1 / m_of(ellipsoid, phi)


def lambert_conformal(ellipsoid, phi, one=33.0, two=45.0):
    """15-4, 15-8, 15-10 and 15-7."""
    p1, p2 = math.radians(one), math.radians(two)
    m1, m2 = m_of(ellipsoid, p1), m_of(ellipsoid, p2)
    t1, t2 = t_of(ellipsoid, p1), t_of(ellipsoid, p2)
    n = math.log(m1 / m2) / math.log(t1 / t2)
    k = m1 * (t_of(ellipsoid, phi) / t1) ** n / m_of(ellipsoid, phi)
    return k, k


def albers(ellipsoid, phi, one=29.5, two=45.5):
    """14-13, 14-14, 14-12 and 14-16, 14-18."""
    p1, p2 = math.radians(one), math.radians(two)
    m1, m2 = m_of(ellipsoid, p1), m_of(ellipsoid, p2)
    n = (m1**2 - m2**2) / (q_of(ellipsoid, p2) - q_of(ellipsoid, p1))
    k = np.sqrt(m1**2 + n * (q_of(ellipsoid, p1) - q_of(ellipsoid, phi))) / m_of(ellipsoid, phi)
    return 1 / k, k


def polar_stereographic(ellipsoid, phi):
    """21-33 and 21-32 with k_0 = 1 at the north pole."""
    e = eccentricity(ellipsoid)
    rho = 2 * t_of(ellipsoid, phi) / math.sqrt((1 + e) ** (1 + e) * (1 - e) ** (1 - e))
    return rho / m_of(ellipsoid, phi), rho / m_of(ellipsoid, phi)


def equidistant_conic(ellipsoid, phi, one=20.0, two=60.0):
    """16-10, 16-11, 16-7 and 16-8 (h = 1)."""
    p1, p2 = math.radians(one), math.radians(two)
    m1, m2 = m_of(ellipsoid, p1), m_of(ellipsoid, p2)
    n = (m1 - m2) / (arc_of(ellipsoid, p2) - arc_of(ellipsoid, p1))
    k = (m1 + n * (arc_of(ellipsoid, p1) - arc_of(ellipsoid, phi))) / m_of(ellipsoid, phi)
    return np.ones_like(k), k


def equal_area_cylindrical(ellipsoid, phi, true=30.0):
    """10-15: k = m_s / m, h = 1 / k."""
    k = m_of(ellipsoid, math.radians(true)) / m_of(ellipsoid, phi)
    return 1 / k, k


def polar_equal_area(ellipsoid, phi):
    """24-23: rho = a sqrt(q_p - q), k = rho / (a m)."""
    k = np.sqrt(q_from_pole(ellipsoid, math.pi / 2 - phi)) / m_of(ellipsoid, phi)
    return 1 / k, k


def polar_equidistant(ellipsoid, phi):
    """25-16: k = rho / (a m), rho the arc from the pole; h = 1."""
    e2 = ellipsoid.eccentricity_squared
    nodes, weights = np.polynomial.legendre.leggauss(40)
    colat = math.pi / 2 - phi
    theta = 0.5 * np.multiply.outer(colat, nodes + 1)
    rho = 0.5 * colat * (((1 - e2) / (1 - e2 * np.cos(theta) ** 2) ** 1.5) @ weights)
    k = rho / m_of(ellipsoid, phi)
    return np.ones_like(k), k


FORMS = {
    "merc": ("+proj=merc", mercator),
    "lcc": ("+proj=lcc +lat_1=33 +lat_2=45", lambert_conformal),
    "aea": ("+proj=aea +lat_1=29.5 +lat_2=45.5", albers),
    "stere": ("+proj=stere +lat_0=90", polar_stereographic),
    "eqdc": ("+proj=eqdc +lat_1=20 +lat_2=60", equidistant_conic),
    "cea": ("+proj=cea +lat_ts=30", equal_area_cylindrical),
    "laea": ("+proj=laea +lat_0=90", polar_equal_area),
    "aeqd": ("+proj=aeqd +lat_0=90", polar_equidistant),
}


def arc_distance(lon, lat, lon_0, lat_0):
    """The angle between points of the sphere, good to rounding at any distance."""

    def unit(lon, lat):
        lam, phi = np.radians(lon), np.radians(lat)
        return np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=-1)

    p, centre = unit(np.asarray(lon), np.asarray(lat)), unit(lon_0, lat_0)
    return 2 * np.arctan2(np.linalg.norm(p - centre, axis=-1), np.linalg.norm(p + centre, axis=-1))
