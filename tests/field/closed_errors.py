"""Airy-Kavrayskiy errors of maps by quadrature of their closed forms."""

import functools
import math
from typing import NamedTuple

import numpy as np
import pyproj
import scipy.integrate
import scipy.optimize

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, WGS84

R = MEAN_EARTH_RADIUS
HALF_PI = math.pi / 2
L2 = math.log(2)
PLATE_CARREE = math.sqrt(2 - 2 * L2 + L2**2 - math.pi**2 / 12)

# ---- quadrature -------------------------------------------------------------------------------


def double_exponential(a, b, step=0.06, last=3.3):
    """Nodes and weights on [a, b] for integrands with any singularity at the ends (Takahasi & Mori 1974).

    Nodes keep their digits towards a end, so singular ends are put at a = 0.
    """
    t = np.arange(-last, last + step / 2, step)
    g = HALF_PI * np.sinh(t)
    share = 1 / (1 + np.exp(-2 * g))
    return a + (b - a) * share, (b - a) * step * math.pi * np.cosh(t) / (2 * np.cosh(g)) ** 2


def gauss(a, b, n=48):
    """Gauss-Legendre nodes and weights on [a, b]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (a + b) + 0.5 * (b - a) * x, 0.5 * (b - a) * w


class Field(NamedTuple):
    """Jacobians (..., 2, 2) at the nodes of a rule of our own, and weights in proportion to area."""

    J: np.ndarray
    weight: np.ndarray


def field(xx, xy, yx, yy, weight):
    """A field from the entries dx/east, dx/north, dy/east, dy/north; all broadcast."""
    xx, xy, yx, yy, weight = np.broadcast_arrays(xx, xy, yx, yy, weight)
    return Field(np.stack([np.stack([xx, xy], axis=-1), np.stack([yx, yy], axis=-1)], axis=-2), weight)


def joined(*fields):
    """Several fields as one."""
    J = np.concatenate([f.J.reshape(-1, 2, 2) for f in fields])
    return Field(J, np.concatenate([f.weight.ravel() for f in fields]))


def square_logs(J, det):
    """ln^2 a + ln^2 b = (ln^2(ab) + ln^2(a/b)) / 2; ln(a/b) = 2 arsinh((a - b) / (2 sqrt(ab))), ab = det > 0."""
    gap = (J[..., 0, 0] - J[..., 1, 1]) ** 2 + (J[..., 0, 1] + J[..., 1, 0]) ** 2
    return 0.5 * np.log(det) ** 2 + 2 * np.arcsinh(np.sqrt(gap / (4 * det))) ** 2


def errors_of(f):
    """The raw, the scaled and the affine error of a field; the last by a general minimiser over linear maps."""
    J, w = f.J.reshape(-1, 2, 2), f.weight.ravel() / f.weight.sum()
    det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    raw, shift = w @ square_logs(J, det), w @ np.log(det)
    scaled = raw - 0.5 * shift**2

    def cost(entries):
        v, shear = entries
        inverse = math.exp(-shift / 2) * np.array([[math.exp(-v), 0.0], [-shear, math.exp(v)]])
        return w @ square_logs(inverse @ J, math.exp(-shift) * det)

    # The minimum is quadratic: gradients good to 1e-7 are 1e-14 in the cost.
    affine = scipy.optimize.minimize(cost, [0.0, 0.0], method="BFGS", options={"gtol": 1e-7}).fun
    return tuple(math.sqrt(max(value, 0.0)) for value in (raw, scaled, affine))


# ---- maps of the sphere, from the colatitude c and the longitude lam in radians ---------------


def cylindrical(h, k):
    """A map with scales h and k, functions of the colatitude, on the globe; one hemisphere stands for both."""
    c, w = double_exponential(0.0, HALF_PI)
    return field(k(c), 0.0, 0.0, h(c), w * np.sin(c))


def turned(f):
    """A field and itself turned by 90 degrees: of all azimuths these two suffice, as the means are isotropic."""
    return joined(f, Field(np.array([[0.0, -1.0], [1.0, 0.0]]) @ f.J, f.weight))


def azimuthal(h, k, angle):
    """A map with scales h and k, functions of the distance c from its centre, on a cap about it."""
    c, w = double_exponential(0.0, angle)
    return turned(field(k(c), 0.0, 0.0, h(c), w * np.sin(c)))


def azimuthal_globe(h, k):
    """As `azimuthal` on the globe; h and k take c / 2 and its complement, which keeps its digits at the antipode."""
    near, w = double_exponential(0.0, math.pi / 4)
    parts = [(near, HALF_PI - near), (HALF_PI - near, near)]
    return turned(joined(*(field(k(a, b), 0.0, 0.0, h(a, b), w * np.sin(2 * near)) for a, b in parts)))


def by_complex_step(position, lam, c, weight):
    """A map given by position(lam, c) -> x, y in radii, differentiated by the complex step, exact to rounding."""
    lam, c, weight = np.broadcast_arrays(lam, c, weight)
    tiny = 1e-30
    east = [value.imag / tiny / np.sin(c) for value in position(lam + 1j * tiny, c + 0j)]
    north = [-value.imag / tiny for value in position(lam + 0j, c + 1j * tiny)]
    return field(east[0], north[0], east[1], north[1], weight)


def symmetric_globe(position):
    """A quarter of the globe for a map whose quarters are mirror images: two, so that the MDT is diagonal."""
    lam, wl = gauss(0.0, math.pi)
    c, wc = double_exponential(0.0, HALF_PI)
    weight = wl[:, None] * wc * np.sin(c)
    return joined(*(by_complex_step(position, sign * lam[:, None], c, weight) for sign in (1, -1)))


def both_sides(make, low=0.0, high=math.pi):
    """The field make(lam) for longitudes low..high and their mirror image."""
    lam, w = gauss(low, high)
    one = make(lam[:, None], w[:, None])
    return joined(one, Field(one.J * [[1, -1], [-1, 1]], one.weight))


def sinusoidal(lam, w, low=0.0, high=HALF_PI):
    """Snyder 1987, 30-1 and 30-2, between two latitudes: x = lam cos phi, y = phi."""
    phi, wp = gauss(low, high)
    return field(1.0, -lam * np.sin(phi), 0.0, 1.0, w * wp * np.cos(phi))


def mollweide(lam, w, start=HALF_PI):
    """Snyder 1987, 31-1 to 31-4, in tau = 90 degrees - theta from the pole to tau = start."""
    tau, wt = double_exponential(0.0, start)
    sin, cos = np.sin(tau), np.cos(tau)
    # 1 - sin phi = (2 tau - sin 2 tau) / pi; below 0.1 its series, which loses no digits.
    t = 2 * tau
    gap = np.where(t < 0.2, t**3 / 6 * (1 - t**2 / 20 * (1 - t**2 / 42 * (1 - t**2 / 72))), t - np.sin(t)) / math.pi
    cos_phi = np.sqrt(gap * (2 - gap))
    k = math.sqrt(8) / math.pi * sin / cos_phi
    shear = -lam / math.sqrt(2) * cos * cos_phi / sin**2
    return field(k, shear, 0.0, 1 / k, w * wt * sin**2)


def eckert_4(lam, w):
    """Snyder 1987, page 256: x = 2 lam (1 + cos t) / sqrt(4 pi + pi^2), y = 2 sqrt(pi / (4 + pi)) sin t."""
    tau, wt = double_exponential(0.0, HALF_PI)
    t = HALF_PI - tau
    # (2 + pi/2) sin phi = t + sin t cos t + 2 sin t; 1 - sin phi by its series where it cancels.
    gap = (tau - np.sin(tau) * np.cos(tau) + 4 * np.sin(tau / 2) ** 2) / (2 + HALF_PI)
    cos_phi = np.sqrt(gap * (2 - gap))
    dphi_dt = (2 * np.cos(t) ** 2 + 2 * np.cos(t)) / ((2 + HALF_PI) * cos_phi)
    scale = 2 / math.sqrt(math.pi * (4 + math.pi))
    k = scale * (1 + np.cos(t)) / cos_phi
    h = 2 * math.sqrt(math.pi / (4 + math.pi)) * np.cos(t) / dphi_dt
    shear = -scale * lam * np.sin(t) / dphi_dt
    return field(k, shear, 0.0, h, w * wt * dphi_dt * cos_phi)


def hammer(lam, c):
    """Snyder & Voxland 1989, page 232."""
    d = np.sqrt((1 + np.sin(c) * np.cos(lam / 2)) / 2)
    return 2 * np.sin(c) * np.sin(lam / 2) / d, np.cos(c) / d


def aitoff(lam, c):
    """Snyder & Voxland 1989, page 231."""
    cos = np.sin(c) * np.cos(lam / 2)
    over_sin = np.arccos(cos) / np.sqrt(1 - cos * cos)
    return 2 * over_sin * np.sin(c) * np.sin(lam / 2), over_sin * np.cos(c)


def winkel_tripel(lam, c):
    """Snyder & Voxland 1989, page 234: the mean of Aitoff and the plate carree with cos phi_1 = 2 / pi."""
    x, y = aitoff(lam, c)
    return (x + lam * 2 / math.pi) / 2, (y + HALF_PI - c) / 2


def natural_earth(lam, c):
    """Savric, Jenny, Patterson, Petrovic & Hurni 2011, equations 1 and 2 with table 1."""
    p2 = (HALF_PI - c) ** 2
    x = lam * (0.8707 + p2 * (-0.131979 + p2 * (-0.013791 + p2**3 * (0.003971 - 0.001529 * p2))))
    y = (HALF_PI - c) * (1.007226 + p2 * (0.015085 + p2**2 * (-0.044475 + p2 * (0.028874 - 0.005916 * p2))))
    return x, y


def equal_earth(lam, c):
    """Savric, Patterson & Jenny 2018, equations 5 and 6."""
    a1, a2, a3, a4 = 1.340264, -0.081106, 0.000893, 0.003796
    t = np.arcsin(math.sqrt(3) / 2 * np.cos(c))
    dy = a1 + 3 * a2 * t**2 + t**6 * (7 * a3 + 9 * a4 * t**2)
    return 2 * math.sqrt(3) * lam * np.cos(t) / (3 * dy), t * (a1 + a2 * t**2 + t**6 * (a3 + a4 * t**2))


GOODE = math.radians(40 + 44 / 60 + 11.8 / 3600)  # where the sinusoidal and Mollweide's map have equal parallels
PROJ_GOODE = math.radians(40 + 44 / 60)  # where PROJ's `goode` joins them, which tears the map by some metres
NORTH_LOBES = [(-180, -40, -100), (-40, 180, 30)]
SOUTH_LOBES = [(-180, -100, -160), (-100, -20, -60), (-20, 80, 20), (80, 180, 140)]


def mollweide_tau(phi):
    """The parameter tau of `mollweide` at a latitude."""
    return HALF_PI - scipy.optimize.brentq(
        lambda t: 2 * t + math.sin(2 * t) - math.pi * math.sin(phi), 0.0, HALF_PI, xtol=1e-15
    )


def lobe(west, east, centre, parts, mirror):
    """Fields of the parts make(lam, w) of a lobe; a southern one is mirrored."""
    lam, w = gauss(math.radians(west - centre), math.radians(east - centre))
    fields = [make(lam[:, None], w[:, None]) for make in parts]
    return joined(*(Field(f.J * [[1, -1], [-1, 1]] if mirror else f.J, f.weight) for f in fields))


def interrupted(*parts):
    """All lobes of an interrupted map that has these parts in the northern hemisphere."""
    lobes = [lobe(*limits, parts, False) for limits in NORTH_LOBES] + [
        lobe(*limits, parts, True) for limits in SOUTH_LOBES
    ]
    return joined(*lobes)


def goode_parts(limit):
    """The sinusoidal part below a latitude, and Mollweide's above it."""

    # Weights of `sinusoidal` are d(sin phi); those of `mollweide` are sin^2 tau dtau = pi/4 d(sin phi).
    def upper(lam, w):
        return mollweide(lam, w * 4 / math.pi, mollweide_tau(limit))

    return functools.partial(sinusoidal, low=0.0, high=limit), upper


# ---- maps of boxes and caps -------------------------------------------------------------------

E2 = WGS84.f * (2 - WGS84.f)
E = math.sqrt(E2)


def m_of(phi):
    """Radius of the parallel over a on WGS 84 (Snyder 1987, 14-15)."""
    return np.cos(phi) / np.sqrt(1 - E2 * np.sin(phi) ** 2)


def t_of(phi):
    """Snyder 1987, 15-9."""
    return np.exp(-np.arcsinh(np.tan(phi)) + E * np.arctanh(E * np.sin(phi)))


def area_density(phi):
    """M N cos phi on WGS 84, in a^2 (Snyder 1987, 4-18 and 4-20)."""
    return (1 - E2) * np.cos(phi) / (1 - E2 * np.sin(phi) ** 2) ** 2


def conformal_box(k, south, north):
    """A conformal map whose scale k(phi) depends on the latitude alone, on an ellipsoidal box."""
    phi, w = gauss(math.radians(south), math.radians(north))
    return field(k(phi), 0.0, 0.0, k(phi), w * area_density(phi))


def lambert_conformal_scale(phi, one=33.0, two=45.0):
    """Snyder 1987, 15-4, 15-8 and 15-10."""
    m1, m2, t1, t2 = (f(math.radians(lat)) for f in (m_of, t_of) for lat in (one, two))
    n = math.log(m1 / m2) / math.log(t1 / t2)
    return m1 * (t_of(phi) / t1) ** n / m_of(phi)


def albers_box(west, south, east, north, one=29.5, two=45.5):
    """Snyder 1987, 14-12 to 14-18 on WGS 84, longitudes from the central meridian: h = 1 / k."""

    def q(phi):
        sin = np.sin(phi)
        return (1 - E2) * (sin / (1 - E2 * sin**2) + np.arctanh(E * sin) / E)

    phi, wp = gauss(math.radians(south), math.radians(north))
    lam, wl = gauss(math.radians(west), math.radians(east))
    p1, p2 = math.radians(one), math.radians(two)
    n = (m_of(p1) ** 2 - m_of(p2) ** 2) / (q(p2) - q(p1))
    k = np.sqrt(m_of(p1) ** 2 + n * (q(p1) - q(phi))) / m_of(phi)
    cos, sin = np.cos(n * lam[:, None]), np.sin(n * lam[:, None])  # the convergence
    return field(k * cos, -sin / k, k * sin, cos / k, wl[:, None] * wp * area_density(phi))


def transverse_mercator_scale(phi, lam, k_0=0.9996):
    """Scale of the ellipsoidal transverse Mercator, lam from the central meridian.

    The map is the meridian's arc, continued analytically in the isometric latitude psi: with
    psi(phi') = psi(phi) + i lam, k = k_0 |N(phi') cos phi'| / (N(phi) cos phi) (Lee 1976, section 4).
    """
    psi = np.arcsinh(np.tan(phi)) - E * np.arctanh(E * np.sin(phi)) + 1j * lam
    complex_phi = np.arcsin(np.tanh(psi))
    for _ in range(20):  # the step is contracted by e^2
        complex_phi = np.arcsin(np.tanh(psi + E * np.arctanh(E * np.sin(complex_phi))))
    return k_0 * np.abs(m_of(complex_phi)) / m_of(phi)


def utm_box(west, south, east, north):
    """A UTM zone's box, longitudes from the central meridian."""
    lam, wl = gauss(math.radians(west), math.radians(east), 24)
    phi, wp = gauss(math.radians(south), math.radians(north), 48)
    k = transverse_mercator_scale(phi, lam[:, None])
    return field(k, 0.0, 0.0, k, wl[:, None] * wp * area_density(phi))


def sphere_box(position, west, south, east, north):
    """A map of the sphere on a box, by the complex step."""
    lam, wl = gauss(math.radians(west), math.radians(east), 48)
    c, wc = gauss(HALF_PI - math.radians(north), HALF_PI - math.radians(south), 48)
    return by_complex_step(position, lam[:, None], c, wl[:, None] * wc * np.sin(c))


def oblique_equal_area(lam, c, lon_0=10.0, lat_0=52.0):
    """Snyder 1987, 22-4, 22-5 and 24-2."""
    dlam, phi_0 = lam - math.radians(lon_0), math.radians(lat_0)
    k = np.sqrt(2 / (1 + math.sin(phi_0) * np.cos(c) + math.cos(phi_0) * np.sin(c) * np.cos(dlam)))
    x = k * np.sin(c) * np.sin(dlam)
    return x, k * (math.cos(phi_0) * np.cos(c) - math.sin(phi_0) * np.sin(c) * np.cos(dlam))


def mercator_cap(lat, angle, ellipsoidal):
    """Mercator's map on a cap in degrees of the mean radius: on a sphere, or of geodesics on WGS 84."""
    if ellipsoidal:
        phi, w = geodesic_rows(lat, math.radians(angle) * MEAN_EARTH_RADIUS)
        return field(1 / m_of(phi), 0.0, 0.0, 1 / m_of(phi), w * area_density(phi))
    azimuth = np.arange(128)[:, None] * (2 * math.pi / 128)  # the trapezoidal rule of a periodic function
    c, w = gauss(0.0, math.radians(angle))
    phi_0 = math.radians(lat)
    phi = np.arcsin(math.sin(phi_0) * np.cos(c) + math.cos(phi_0) * np.sin(c) * np.cos(azimuth))
    return field(1 / np.cos(phi), 0.0, 0.0, 1 / np.cos(phi), w * np.sin(c))


def geodesic_rows(lat, metres):
    """Latitudes within a distance on WGS 84, and how wide it is there: by GeographicLib, and roots of its distances."""
    geod = pyproj.Geod(ellps="WGS84")
    (_, south, _), (_, north, _) = (geod.fwd(0.0, lat, azimuth, metres) for azimuth in (180.0, 0.0))
    t, w = gauss(-HALF_PI, HALF_PI)  # the width has square roots at its ends
    phi = np.radians(0.5 * (north + south) + 0.5 * (north - south) * np.sin(t))

    def width(row):
        def beyond(lon):
            return geod.inv(0.0, lat, lon, math.degrees(row))[2] - metres

        return math.radians(scipy.optimize.brentq(beyond, 0.0, 179.0, xtol=1e-12))

    return phi, w * np.cos(t) * np.array([width(row) for row in phi])
