"""The Airy-Kavrayskiy errors against closed forms, over globe, boxes and caps; what the cubature says of its accuracy.

Every truth is a textbook formula of the map, written here once more, and double exponential or Gauss
quadrature: see `Field`. No figure comes from PROJ or from projdist.
"""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

from projdist.bending import flexion
from projdist.cubature import sample
from projdist.ellipsoid import MEAN_EARTH_RADIUS, WGS84
from projdist.hessians import hessian
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, PointSet, get_region
from projdist.results import DEFAULT_TOLERANCE, summarize

R = MEAN_EARTH_RADIUS
HALF_PI = math.pi / 2

# ---- quadrature -----------------------------------------------------------------------------


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


# ---- maps of the sphere, from the colatitude c and the longitude lam in radians --------------


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


# ---- maps of boxes and caps -----------------------------------------------------------------

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
    """Mercator's map on a cap in degrees, whose latitudes count as spherical."""
    azimuth = np.arange(128)[:, None] * (2 * math.pi / 128)  # the trapezoidal rule of a periodic function
    c, w = gauss(0.0, math.radians(angle))
    phi_0 = math.radians(lat)
    phi = np.arcsin(math.sin(phi_0) * np.cos(c) + math.cos(phi_0) * np.sin(c) * np.cos(azimuth))
    if not ellipsoidal:
        return field(1 / np.cos(phi), 0.0, 0.0, 1 / np.cos(phi), w * np.sin(c))
    return field(1 / m_of(phi), 0.0, 0.0, 1 / m_of(phi), w * np.sin(c) * area_density(phi) / np.cos(phi))


# ---- the cases ------------------------------------------------------------------------------


class Case(NamedTuple):
    """A projection over a region, its true field, and the error that PROJ's own rounding leaves at any tolerance."""

    id: str
    projection: str
    region: str
    field: Callable[[], Field]
    floor: float = 0.0


def km(angle):
    """The radius in km of a cap of so many degrees."""
    return math.radians(angle) * R / 1000


def cap(lon, lat, angle):
    return f"cap:{lon},{lat},{km(angle)!r}"


def one(x):
    return np.ones_like(x)


def sec(x):
    return 1 / np.cos(x)


def csc(x):
    return 1 / np.sin(x)


AZIMUTHAL = {  # h and k by the distance c from the centre (Snyder 1987, chapters 20 to 25)
    "aeqd": (one, lambda c: c / np.sin(c)),
    "laea": (lambda c: np.cos(c / 2), lambda c: sec(c / 2)),
    "stere": (lambda c: sec(c / 2) ** 2, lambda c: sec(c / 2) ** 2),
    "gnom": (lambda c: sec(c) ** 2, sec),
    "ortho": (np.cos, one),
}
AZIMUTHAL_GLOBE = {  # by c / 2 and its complement
    "aeqd": (lambda a, b: one(a), lambda a, b: np.where(a < b, a, HALF_PI - b) / (np.sin(a) * np.sin(b))),
    "laea": (lambda a, b: np.sin(b), lambda a, b: csc(b)),
    "stere": (lambda a, b: csc(b) ** 2, lambda a, b: csc(b) ** 2),
}
ASPECTS = {"polar": (0, 90), "equatorial": (0, 0), "oblique": (25, 40)}

SMOOTH_GLOBE = {
    "plate-carree": lambda: cylindrical(one, csc),
    "mercator": lambda: cylindrical(csc, csc),
    "lambert-cylindrical": lambda: cylindrical(np.sin, csc),
    "behrmann": lambda: cylindrical(
        lambda c: np.sin(c) / math.cos(math.pi / 6), lambda c: math.cos(math.pi / 6) * csc(c)
    ),
    "gall-isographic": lambda: cylindrical(one, lambda c: math.sqrt(0.5) * csc(c)),
    "miller": lambda: cylindrical(lambda c: sec(0.8 * (HALF_PI - c)), csc),
    "gall-stereographic": lambda: cylindrical(
        lambda c: (1 + math.sqrt(0.5)) / 2 * sec((HALF_PI - c) / 2) ** 2, lambda c: math.sqrt(0.5) * csc(c)
    ),
    "sinusoidal": lambda: both_sides(sinusoidal),
    "mollweide": lambda: both_sides(mollweide),
    "eckert-4": lambda: both_sides(eckert_4),
    "hammer": lambda: symmetric_globe(hammer),
    "aitoff": lambda: symmetric_globe(aitoff),
    "winkel-tripel": lambda: symmetric_globe(winkel_tripel),
    "natural-earth": lambda: symmetric_globe(natural_earth),
    "equal-earth": lambda: symmetric_globe(equal_earth),
}

# PROJ refuses 1 + cos c < 1e-10, and 1e-8 of a radian about the pole opposite a polar aspect.
ANTIPODE = math.pi - math.sqrt(2e-10)
FLOORS = {
    "eckert-4": 1e-6,  # PROJ snaps to the pole line
    "laea-equatorial": 1e-5,  # 1 + cos c loses its digits near the antipode
    "laea-oblique": 1e-5,
    "aeqd-oblique": 1e-7,
    "oblique-sinusoidal": 1e-5,
    "igh": 1e-6,
}


def azimuthal_case(name, aspect):
    """An azimuthal map of the whole globe, as far as PROJ maps it."""
    lon, lat = ASPECTS[aspect]
    make = functools.partial(azimuthal_globe, *AZIMUTHAL_GLOBE[name])
    if name == "stere" and aspect != "polar":
        make = functools.partial(azimuthal, *AZIMUTHAL[name], ANTIPODE)
    case_id = f"{name}-{aspect}"
    return Case(case_id, f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}", "globe", make, FLOORS.get(case_id, 0.0))


SMOOTH = [
    *(Case(name, name, "globe", make, FLOORS.get(name, 0.0)) for name, make in SMOOTH_GLOBE.items()),
    *(azimuthal_case(name, aspect) for name in AZIMUTHAL_GLOBE for aspect in ASPECTS),
    *(
        Case(
            f"{name}-{aspect}-cap",
            f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}",
            cap(lon, lat, 70),
            functools.partial(azimuthal, *scales, math.radians(70)),
        )
        for name, scales in AZIMUTHAL.items()
        for aspect, (lon, lat) in ASPECTS.items()
    ),
    Case("mercator-cap", "mercator", cap(10, 50, 20), lambda: mercator_cap(50, 20, False)),
    Case("mercator-wgs84-cap", "EPSG:3395", cap(-170, 50, 20), lambda: mercator_cap(50, 20, True)),
    Case(
        "mercator-wgs84-box", "EPSG:3395", "box:-20,35,40,70", lambda: conformal_box(lambda phi: 1 / m_of(phi), 35, 70)
    ),
    Case(
        "lcc-wgs84-box",
        "+proj=lcc +lat_1=33 +lat_2=45 +lat_0=39 +lon_0=-96 +ellps=WGS84",
        "box:-125,25,-65,50",
        lambda: conformal_box(lambert_conformal_scale, 25, 50),
    ),
    Case(
        "albers-wgs84-box",
        "+proj=aea +lat_1=29.5 +lat_2=45.5 +lat_0=37.5 +lon_0=-96 +ellps=WGS84",
        "box:-125,25,-65,50",
        lambda: albers_box(-29, 25, 31, 50),
    ),
    Case("utm-box", "EPSG:32631", "box:0,0,6,84", lambda: utm_box(-3, 0, 3, 84)),
    Case("utm-wide-box", "EPSG:32631", "box:-9,40,7,60", lambda: utm_box(-12, 40, 4, 60)),
    Case("winkel-tripel-box", "winkel-tripel", "box:60,20,150,75", lambda: sphere_box(winkel_tripel, 60, 20, 150, 75)),
    Case(
        "hammer-antimeridian-box",
        "+proj=hammer +lon_0=180 +R=6371008.7714",
        "box:150,-60,-120,10",
        lambda: sphere_box(hammer, -30, -60, 60, 10),
    ),
    Case("sinusoidal-box", "sinusoidal", "box:20,10,100,60", lambda: sinusoidal_box(20, 10, 100, 60)),
    Case(
        "laea-box",
        f"+proj=laea +lon_0=10 +lat_0=52 +R={R}",
        "box:-25,34,45,72",
        lambda: sphere_box(oblique_equal_area, -25, 34, 45, 72),
    ),
]


def sinusoidal_box(west, south, east, north):
    lam, w = gauss(math.radians(west), math.radians(east))
    return sinusoidal(lam[:, None], w[:, None], math.radians(south), math.radians(north))


def oblique(name, lat_p=35.0):
    return f"+proj=ob_tran +o_proj={name} +o_lat_p={lat_p:g} +o_lon_p=20 +lon_0=-15 +R={R}"


# Seams or an end of the map cross the region.
TORN = [
    Case(
        "goode",
        "goode-homolosine",
        "globe",
        lambda: both_sides(lambda lam, w: joined(*(f(lam, w) for f in goode_parts(PROJ_GOODE)))),
    ),
    Case("igh", "interrupted-goode-homolosine", "globe", lambda: interrupted(*goode_parts(GOODE)), FLOORS["igh"]),
    Case("imoll", "interrupted-mollweide", "globe", lambda: interrupted(mollweide)),
    Case("oblique-plate-carree", oblique("eqc"), "globe", SMOOTH_GLOBE["plate-carree"]),
    Case("oblique-mercator", oblique("merc"), "globe", SMOOTH_GLOBE["mercator"]),
    Case("oblique-mollweide", oblique("moll"), "globe", SMOOTH_GLOBE["mollweide"]),
    Case(
        "oblique-sinusoidal", oblique("sinu", 60.0), "globe", SMOOTH_GLOBE["sinusoidal"], FLOORS["oblique-sinusoidal"]
    ),
    Case("transverse-hammer", oblique("hammer", 0.0), "globe", SMOOTH_GLOBE["hammer"]),
]


@functools.cache
def truth_of(case_id):
    return errors_of(next(case for case in SMOOTH + TORN if case.id == case_id).field())


@functools.cache
def summary_of(case_id, tolerance):
    case = next(case for case in SMOOTH + TORN if case.id == case_id)
    return summarize(case.projection, case.region, tolerance=tolerance)


def triple(summary):
    """The raw, scaled and affine errors of a summary."""
    return summary.airy_kavrayskiy, summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine


# ---- the errors and their estimates ---------------------------------------------------------

ROUNDING = 1e-12  # of sums over 10^5 nodes, on either side
TOLERANCES = [1e-4, 1e-6, 1e-8]


def is_slow(case):
    """Whether a singular point or a seam off the panels' sides makes a case cost a good part of a second."""
    return case in TORN or case.id.endswith(("-equatorial", "-oblique")) or case.id == "stere-polar"


def cases_with_tolerances():
    """All cases at all tolerances."""
    params = []
    for case in SMOOTH + TORN:
        for tolerance in TOLERANCES:
            marks = [pytest.mark.slow] if is_slow(case) else []
            params.append(pytest.param(case, tolerance, id=f"{case.id}-{tolerance:g}", marks=marks))
    return params


@pytest.mark.parametrize(("case", "tolerance"), cases_with_tolerances())
def test_errors_are_within_their_estimate(case, tolerance):
    """The raw, scaled and affine errors differ from the truth by no more than three times the error estimate."""
    found = summary_of(case.id, tolerance)
    np.testing.assert_allclose(triple(found), truth_of(case.id), rtol=0, atol=3 * found.error_estimate + ROUNDING)


@pytest.mark.parametrize(("case", "tolerance"), cases_with_tolerances())
def test_estimates_meet_the_tolerance(case, tolerance):
    """The estimate is the tolerance at most, or PROJ's floor; twice for the affine error, which is not steered by."""
    found = summary_of(case.id, tolerance)
    assert found.error_estimate <= max(2 * tolerance, case.floor)
    assert found.limit in ("", "rounding")
    if found.limit == "":
        assert found.error_estimate <= 2 * tolerance
    assert found.coverage == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, id=case.id, marks=[pytest.mark.slow] if is_slow(case) else []) for case in SMOOTH + TORN],
)
def test_accuracy_by_default(case):
    """Without a tolerance smooth maps are right to 1e-8, interrupted and oblique ones to 1e-6 (PROJ's floors apart)."""
    atol = max(1e-8 if case in SMOOTH else 1e-6, case.floor)
    np.testing.assert_allclose(triple(summary_of(case.id, DEFAULT_TOLERANCE)), truth_of(case.id), rtol=0, atol=atol)


# ---- known figures --------------------------------------------------------------------------

L2 = math.log(2)
KNOWN = {  # (raw, scaled, affine) in closed form, None where none is known
    "plate-carree": (math.sqrt(2 - 2 * L2 + L2**2 - math.pi**2 / 12), None, 0.4213466110),
    "mercator": (0.7371453308, 0.5958740917, 0.5958740917),
    "lambert-cylindrical": (0.7371453308, 0.7371453308, 0.5958740917),
    "eckert-4": (0.50701912122, 0.50701912122, None),
    "laea-polar": (1.0, 1.0, 1.0),
    "laea-oblique": (1.0, 1.0, 1.0),
    "stere-polar": (2.0, math.sqrt(2), math.sqrt(2)),
}


@pytest.mark.parametrize("case_id", KNOWN)
def test_the_quadrature_of_these_tests(case_id):
    """The truths of this module agree with closed forms and with figures worked out elsewhere to ten digits."""
    for value, known in zip(truth_of(case_id), KNOWN[case_id], strict=True):
        assert known is None or value == pytest.approx(known, abs=1e-10)


def test_the_quadrature_against_mpmath():
    """Two of the truths again with 30 digits: the azimuthal equidistant globe, and the Lambert conformal box."""
    with mpmath.workdps(30):
        square = mpmath.quad(lambda c: mpmath.log(c / mpmath.sin(c)) ** 2 * mpmath.sin(c) / 2, [0, 1, 3, mpmath.pi])
        assert truth_of("aeqd-polar")[0] == pytest.approx(float(mpmath.sqrt(square)), abs=1e-12)

        def box(phi):
            e2 = mpmath.mpf(WGS84.f) * (2 - mpmath.mpf(WGS84.f))
            e = mpmath.sqrt(e2)

            def m(p):
                return mpmath.cos(p) / mpmath.sqrt(1 - e2 * mpmath.sin(p) ** 2)

            def t(p):
                es = e * mpmath.sin(p)
                return mpmath.tan(mpmath.pi / 4 - p / 2) / ((1 - es) / (1 + es)) ** (e / 2)

            one, two = mpmath.radians(33), mpmath.radians(45)
            n = mpmath.log(m(one) / m(two)) / mpmath.log(t(one) / t(two))
            k = m(one) * (t(phi) / t(one)) ** n / m(phi)
            weight = mpmath.cos(phi) / (1 - e2 * mpmath.sin(phi) ** 2) ** 2
            return 2 * mpmath.log(k) ** 2 * weight, weight

        limits = [mpmath.radians(25), mpmath.radians(50)]
        top, bottom = (mpmath.quad(lambda phi, i=i: box(phi)[i], limits) for i in (0, 1))
        assert truth_of("lcc-wgs84-box")[0] == pytest.approx(float(mpmath.sqrt(top / bottom)), abs=1e-13)


@pytest.mark.parametrize("name", ["plate-carree", "natural-earth", "winkel-tripel"])
def test_the_tolerance_is_honest(name):
    """The error is below a tenth of each tolerance, and a hundred times finer costs less than ten times as much."""
    errors, costs = [], []
    for tolerance in TOLERANCES:
        found = summary_of(name, tolerance)
        errors.append(max(abs(v - t) for v, t in zip(triple(found), truth_of(name), strict=True)))
        costs.append(found.evaluations)
    assert all(error < 0.1 * tolerance for error, tolerance in zip(errors, TOLERANCES, strict=True))
    for coarse, fine in ((0, 1), (1, 2)):
        assert costs[coarse] <= costs[fine] < 10 * costs[coarse]


# ---- maps that end --------------------------------------------------------------------------


def logs_beyond(edge):
    """The means of ln u and ln^2 u over u from `edge` to 1."""
    ln = math.log(edge)
    return -1 - edge * ln / (1 - edge), 2 - edge * (ln * ln - 2 * ln) / (1 - edge)


# With u = cos c uniform over the hemisphere: ln a + ln b and ln^2 a + ln^2 b in units of ln u and ln^2 u.
ENDING = {"ortho": (1, 1, 1e-300), "gnom": (-3, 5, 4e-10 / math.pi)}
# The gnomonic map is cut where |x| + |y| is 1e10 radii: at u = 1e-10 times 4 / pi, the mean of |cos| + |sin|.
ENDING_ACCURACY = {"ortho": 1e-5, "gnom": 1e-3}


@pytest.mark.slow
@pytest.mark.slow
@pytest.mark.parametrize(
    "tolerance", [pytest.param(1e-4, marks=pytest.mark.slow), 1e-6, pytest.param(1e-8, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("aspect", ["polar", "equatorial", "oblique"])
@pytest.mark.parametrize("name", ["ortho", "gnom"])
def test_maps_of_a_hemisphere(name, aspect, tolerance):
    """Orthographic and gnomonic maps of the globe have sqrt(2) and sqrt(10), and a coverage of one half."""
    lon, lat = ASPECTS[aspect]
    log_area, square, edge = ENDING[name]
    mean, mean_square = logs_beyond(edge)
    raw = math.sqrt(square * mean_square)
    assert raw == pytest.approx(math.sqrt({"ortho": 2, "gnom": 10}[name]), abs=1e-7)
    scaled = math.sqrt(square * mean_square - 0.5 * (log_area * mean) ** 2)
    found = summarize(f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}", tolerance=tolerance)
    # By symmetry the best linear map is a uniform scale.
    truth = (raw, scaled, scaled)
    np.testing.assert_allclose(triple(found), truth, rtol=0, atol=3 * found.error_estimate + 1e-9)
    np.testing.assert_allclose(triple(found), truth, rtol=0, atol=ENDING_ACCURACY[name])
    assert found.coverage == pytest.approx(0.5, abs=1e-7)


@pytest.mark.slow
def test_coverage_of_a_box():
    """Of a box 60 degrees wide of which 15 lie beyond the horizon three quarters are covered."""
    # The horizon of the equatorial orthographic map about 0 is the meridian 90 E.
    found = summarize(f"+proj=ortho +R={R}", "box:45,-30,105,30", tolerance=1e-6)
    assert found.coverage == pytest.approx(0.75, abs=1e-8)


# ---- what is reported -----------------------------------------------------------------------


@pytest.mark.parametrize("region", ["globe", "box:-10,20,30,70", "cap:0,50,3000"])
def test_evaluations(region):
    """`evaluations` is the number of points that were projected."""
    points = []

    def plate_carree(lon, lat):
        points.append(lon.size)
        return R * np.radians(lon), R * np.radians(lat)

    samples = sample(Projection.from_function(plate_carree), get_region(region), tolerance=1e-6)
    assert samples.evaluations == sum(points)


def test_budget():
    """A search that ends at the largest number of evaluations says so, and has not gone beyond it."""
    samples = sample(Projection.from_user_input("mercator"), GLOBE, tolerance=1e-12, max_evaluations=8_000)
    assert samples.limit == "budget"
    assert 6_000 < samples.evaluations <= 8_000


@pytest.mark.slow
def test_limit_of_rounding():
    """Where the projection's own rounding forbids the tolerance the limit is `rounding`, long before the budget."""
    samples = sample(Projection.from_user_input("+proj=laea +R=6371000"), GLOBE, tolerance=1e-9)
    assert samples.limit == "rounding"
    assert samples.evaluations < 900_000


@pytest.mark.slow
@pytest.mark.parametrize(
    "region", ["globe", "box:-10,20,30,70", "box:170,-20,-150,5", "cap:0,50,3000", "cap:30,-90,2000"]
)
@pytest.mark.parametrize("projection", ["mollweide", "EPSG:3395"])
def test_weights_are_areas(projection, region):
    """The weights sum up to the region's true area: on WGS 84 that of the region, on the sphere by its own formula."""
    region = get_region(region)
    projection = Projection.from_user_input(projection)
    area = float(sample(projection, region, tolerance=1e-4).weight.sum())
    if projection.ellipsoid.is_sphere:
        if isinstance(region, Box):
            west, south, east, north = np.radians(region.bounds)
            truth = R**2 * (east - west) * (math.sin(north) - math.sin(south))
        else:
            truth = 2 * math.pi * R**2 * (1 - math.cos(region.radius_km * 1000 / R))
    else:
        truth = region.area_km2 * 1e6
    # PROJ does not map the poles to Mercator's plane; a panel resolves its own area to 1e-9.
    assert area == pytest.approx(truth, rel=1e-9)


def test_samples_are_in_the_region():
    """The nodes lie in the region, and J is that of the map there."""
    cap_region = Cap(20, 60, 2000)
    samples = sample(Projection.from_user_input("mercator"), cap_region, tolerance=1e-8)
    assert cap_region.contains(samples.lon, samples.lat).all()
    k = 1 / np.cos(np.radians(samples.lat))
    # Panels are refined until their integrals are good to 1e-8; the derivatives at single nodes are less so.
    np.testing.assert_allclose(samples.jacobian, k[..., None, None] * np.eye(2), atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1.0, 1_737_400.0])
def test_the_size_of_the_globe_does_not_matter(radius):
    """A torn map of the Moon, or of a globe of one metre, has the errors of the Earth's, for the same evaluations."""
    on_earth = summarize(f"+proj=igh +R={R}", tolerance=1e-3)
    found = summarize(f"+proj=igh +R={radius}", tolerance=1e-3)
    assert found.evaluations == on_earth.evaluations
    assert triple(found) == pytest.approx(triple(on_earth), rel=1e-10)


# ---- seams between the last nodes and a side ------------------------------------------------


@pytest.mark.parametrize("name", ["moll", "eqearth", "wintri"])
@pytest.mark.parametrize("meridian", [1e-5, 0.3, -1.5, 2.34, 179.9])
def test_seams_beside_the_first_panels(name: str, meridian: float) -> None:
    """The figure of the globe does not depend on the central meridian, wherever the seam then is."""
    truth = summarize(f"+proj={name} +R=6371008.7714")
    found = summarize(f"+proj={name} +R=6371008.7714 +lon_0={meridian}")
    error = abs(found.airy_kavrayskiy - truth.airy_kavrayskiy)
    assert error <= 3.0 * (found.error_estimate + truth.error_estimate)
    assert error < 2e-8


@pytest.mark.slow
@pytest.mark.parametrize("west", [178.5, 179.0, 179.7])
@pytest.mark.parametrize(("name", "good"), [("sinu", 1e-8), ("igh", 1e-6)])
def test_boxes_whose_edge_is_beside_a_seam(name: str, good: float, west: float) -> None:
    """A box across a seam has the mean of its parts."""
    whole = summarize(name, Box(west, -60.0, -60.0, 60.0))
    parts = [summarize(name, Box(west, -60.0, 180.0, 60.0)), summarize(name, Box(-180.0, -60.0, -60.0, 60.0))]
    areas = np.array([part.region.area_km2 for part in parts])
    square = np.sum(areas * [part.airy_kavrayskiy**2 for part in parts]) / areas.sum()
    assert whole.airy_kavrayskiy == pytest.approx(np.sqrt(square), abs=good)


# ---- second derivatives ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("projection", "region"),
    [
        ("+proj=wintri +R=6371000", "box:-60,-50,70,60"),
        ("+proj=merc +ellps=bessel", "cap:10,50,3000"),
        ("+proj=stere +lat_0=90 +ellps=WGS84", "cap:5,70,900"),
    ],
)
def test_second_derivatives_at_the_nodes(projection, region):
    """H from the panels agrees with H from stencils along geodesics, in any chart and on ellipsoids."""
    projection = Projection.from_user_input(projection)
    found = sample(projection, get_region(region), second_order=[flexion])
    truth = hessian(projection, found.lon, found.lat) * projection.ellipsoid.a
    # Stencils are good to 1e-8; panels are refined for the mean of the flexion to 1e-5, nodes at their ends less.
    np.testing.assert_allclose(found.hessian, truth, atol=2e-4)


def test_no_second_derivatives_are_kept_unless_asked_for():
    """They cost memory."""
    assert sample(Projection.from_user_input("moll"), GLOBE, tolerance=1e-3).hessian is None


def test_second_derivatives_at_points():
    """Over points with weights the mean flexion of Mercator's map is that of 2 / pi tan(lat)."""
    points = PointSet(np.array([10.0, 20.0]), np.array([45.0, 60.0]), np.array([1.0, 3.0]))
    found = summarize("mercator", points, measures=["flexion"]).measures["flexion"].mean
    assert found == pytest.approx(2 / math.pi * (1 + 3 * math.sqrt(3)) / 4, abs=1e-7)
