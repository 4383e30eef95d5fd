"""Maps over regions and their Airy-Kavrayskiy errors by quadrature of closed forms; lam and colatitude c in radians."""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.optimize
from jacobians import R, albers, eccentricity, gauss, lambert_conformal, m_of, mercator, q_of

from projdist.answers.summaries import summarize
from projdist.earth.ellipsoid import WGS84
from projdist.field.sampling import DEFAULT_TOLERANCE

HALF_PI = math.pi / 2
L2 = math.log(2)
PLATE_CARREE = math.sqrt(2 - 2 * L2 + L2**2 - math.pi**2 / 12)
E, E2 = eccentricity(WGS84), WGS84.eccentricity_squared
MIRROR = [[1, -1], [-1, 1]]


def double_exponential(a, b, step=0.06, last=3.3):
    """Nodes and weights on [a, b], for any singularity at a, where digits are kept, and at b (Takahasi & Mori 1974)."""
    t = np.arange(-last, last + step / 2, step)
    g = HALF_PI * np.sinh(t)
    share = 1 / (1 + np.exp(-2 * g))
    return a + (b - a) * share, (b - a) * step * math.pi * np.cosh(t) / (2 * np.cosh(g)) ** 2


class Field(NamedTuple):
    """Jacobians (..., 2, 2) at the nodes of a rule of our own, and weights in proportion to area."""

    J: np.ndarray
    weight: np.ndarray


def field(xx, xy, yx, yy, weight):
    """A field from the entries dx/east, dx/north, dy/east, dy/north; all broadcast."""
    xx, xy, yx, yy, weight = np.broadcast_arrays(xx, xy, yx, yy, weight)
    return Field(np.stack([xx, xy, yx, yy], axis=-1).reshape(*weight.shape, 2, 2), weight)


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

    def cost(entries):
        v, shear = entries
        inverse = math.exp(-shift / 2) * np.array([[math.exp(-v), 0.0], [-shear, math.exp(v)]])
        return w @ square_logs(inverse @ J, math.exp(-shift) * det)

    # The minimum is quadratic: gradients good to 1e-7 are 1e-14 in the cost.
    affine = scipy.optimize.minimize(cost, [0.0, 0.0], method="BFGS", options={"gtol": 1e-7}).fun
    return tuple(math.sqrt(max(value, 0.0)) for value in (raw, raw - 0.5 * shift**2, affine))


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
    return joined(one, Field(one.J * MIRROR, one.weight))


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


GOODE = math.radians(40 + 44 / 60 + 11.8 / 3600)  # where the sinusoidal and Mollweide's map have equal parallels
PROJ_GOODE = math.radians(40 + 44 / 60)  # where PROJ's `goode` joins them, which tears the map by some metres
NORTH_LOBES = [(-180, -40, -100), (-40, 180, 30)]
SOUTH_LOBES = [(-180, -100, -160), (-100, -20, -60), (-20, 80, 20), (80, 180, 140)]


def interrupted(*parts):
    """All lobes of an interrupted map with parts make(lam, w) in the northern hemisphere; southern ones mirrored."""
    fields = []
    for lobe in NORTH_LOBES + SOUTH_LOBES:
        west, east, centre = np.radians(lobe)
        lam, w = gauss(west - centre, east - centre)
        mirror = MIRROR if lobe in SOUTH_LOBES else np.ones((2, 2))
        fields += [Field(J * mirror, weight) for J, weight in (make(lam[:, None], w[:, None]) for make in parts)]
    return joined(*fields)


def goode_parts(limit):
    """The sinusoidal part below a latitude, and Mollweide's above it."""
    sine = math.pi * math.sin(limit)
    tau = HALF_PI - scipy.optimize.brentq(lambda t: 2 * t + math.sin(2 * t) - sine, 0.0, HALF_PI, xtol=1e-15)

    # Weights of `sinusoidal` are d(sin phi); those of `mollweide` are sin^2 tau dtau = pi/4 d(sin phi).
    def upper(lam, w):
        return mollweide(lam, w * 4 / math.pi, tau)

    return functools.partial(sinusoidal, low=0.0, high=limit), upper


def area_density(phi):
    """M N cos phi on WGS 84, in a^2 (Snyder 1987, 4-18 and 4-20)."""
    return (1 - E2) * np.cos(phi) / (1 - E2 * np.sin(phi) ** 2) ** 2


def box_rule(west, south, east, north):
    """Longitudes (n, 1), latitudes (m,) and weights by area (n, m) of a box of WGS 84."""
    (lam, wl), (phi, wp) = (gauss(*np.radians(sides)) for sides in ((west, east), (south, north)))
    return lam[:, None], phi, wl[:, None] * wp * area_density(phi)


def conformal_box(form, *bounds):
    """A conformal map whose scale depends on the latitude alone, on a box of WGS 84."""
    _, phi, w = box_rule(*bounds)
    k, _ = form(WGS84, phi)
    return field(k, 0.0, 0.0, k, w)


def albers_box(*bounds, one=29.5, two=45.5):
    """Snyder 1987, 14-12 to 14-18 on WGS 84, longitudes from the central meridian: h = 1 / k."""
    lam, phi, w = box_rule(*bounds)
    m1, m2, q1, q2 = (f(WGS84, math.radians(lat)) for f in (m_of, q_of) for lat in (one, two))
    n = (m1**2 - m2**2) / (q2 - q1)
    (h, k), cos, sin = albers(WGS84, phi, one, two), np.cos(n * lam), np.sin(n * lam)  # of the convergence
    return field(k * cos, -sin * h, k * sin, cos * h, w)


def transverse_mercator_scale(phi, lam, k_0=0.9996):
    """Scale of the ellipsoidal transverse Mercator, lam from the central meridian (Lee 1976, section 4)."""
    # The meridian's arc, continued analytically in the isometric latitude psi: with psi(phi') = psi(phi) + i lam
    # k = k_0 |N(phi') cos phi'| / (N(phi) cos phi).
    psi = np.arcsinh(np.tan(phi)) - E * np.arctanh(E * np.sin(phi)) + 1j * lam
    complex_phi = np.arcsin(np.tanh(psi))
    for _ in range(20):  # the step is contracted by e^2
        complex_phi = np.arcsin(np.tanh(psi + E * np.arctanh(E * np.sin(complex_phi))))
    return k_0 * np.abs(m_of(WGS84, complex_phi)) / m_of(WGS84, phi)


def utm_box(*bounds):
    """A UTM zone's box, longitudes from the central meridian."""
    lam, phi, w = box_rule(*bounds)
    k = transverse_mercator_scale(phi, lam)
    return field(k, 0.0, 0.0, k, w)


def sphere_box(position, west, south, east, north):
    """A map of the sphere on a box, by the complex step."""
    (lam, wl), (c, wc) = (gauss(*np.radians(sides)) for sides in ((west, east), (90 - north, 90 - south)))
    return by_complex_step(position, lam[:, None], c, wl[:, None] * wc * np.sin(c))


def oblique_equal_area(lam, c, lon_0=10.0, lat_0=52.0):
    """Snyder 1987, 22-4, 22-5 and 24-2."""
    dlam, phi_0 = lam - math.radians(lon_0), math.radians(lat_0)
    k = np.sqrt(2 / (1 + math.sin(phi_0) * np.cos(c) + math.cos(phi_0) * np.sin(c) * np.cos(dlam)))
    x = k * np.sin(c) * np.sin(dlam)
    return x, k * (math.cos(phi_0) * np.cos(c) - math.sin(phi_0) * np.sin(c) * np.cos(dlam))


def mercator_cap(lat, angle):
    """Mercator's map on a cap of the sphere, in degrees."""
    azimuth = np.arange(128)[:, None] * (2 * math.pi / 128)  # the trapezoidal rule of a periodic function
    c, w = gauss(0.0, math.radians(angle))
    phi_0 = math.radians(lat)
    k = 1 / np.sqrt(1 - (math.sin(phi_0) * np.cos(c) + math.cos(phi_0) * np.sin(c) * np.cos(azimuth)) ** 2)
    return field(k, 0.0, 0.0, k, w * np.sin(c))


class Case(NamedTuple):
    """A projection over a region, and its true field."""

    id: str
    projection: str
    region: str
    field: Callable[[], Field]


FLOORS = {  # the errors that PROJ's own rounding leaves at any tolerance
    "laea-equatorial": 1e-5,  # 1 + cos c loses its digits near the antipode
    "laea-oblique": 1e-5,
    "aeqd-oblique": 1e-7,
    "oblique-sinusoidal": 1e-5,
    "igh": 1e-6,
}


def cap(lon, lat, angle):
    """The cap of so many degrees of the sphere."""
    return f"cap:{lon},{lat},{math.radians(angle) * R / 1000!r}"


def sec(x):
    return 1 / np.cos(x)


def csc(x):
    return 1 / np.sin(x)


AZIMUTHAL = {  # h and k by the distance c from the centre (Snyder 1987, chapters 20 to 25)
    "aeqd": (np.ones_like, lambda c: c / np.sin(c)),
    "laea": (lambda c: np.cos(c / 2), lambda c: sec(c / 2)),
    "stere": (lambda c: sec(c / 2) ** 2, lambda c: sec(c / 2) ** 2),
    "gnom": (lambda c: sec(c) ** 2, sec),
    "ortho": (np.cos, np.ones_like),
}
AZIMUTHAL_GLOBE = {  # by c / 2 and its complement
    "aeqd": (lambda a, b: 0 * a + 1, lambda a, b: np.where(a < b, a, HALF_PI - b) / (np.sin(a) * np.sin(b))),
    "laea": (lambda a, b: np.sin(b), lambda a, b: csc(b)),
    "stere": (lambda a, b: csc(b) ** 2, lambda a, b: csc(b) ** 2),
}
ASPECTS = {"polar": (0, 90), "equatorial": (0, 0), "oblique": (25, 40)}
# PROJ refuses 1 + cos c < 1e-10, and 1e-8 of a radian about the pole opposite a polar aspect.
ANTIPODE = math.pi - math.sqrt(2e-10)

COS_30, COS_45 = math.cos(math.pi / 6), math.sqrt(0.5)
SMOOTH_GLOBE = {
    "plate-carree": lambda: cylindrical(np.ones_like, csc),
    "mercator": lambda: cylindrical(csc, csc),
    "lambert-cylindrical": lambda: cylindrical(np.sin, csc),
    "behrmann": lambda: cylindrical(lambda c: np.sin(c) / COS_30, lambda c: COS_30 * csc(c)),
    "gall-isographic": lambda: cylindrical(np.ones_like, lambda c: COS_45 * csc(c)),
    "miller": lambda: cylindrical(lambda c: sec(0.8 * (HALF_PI - c)), csc),
    "sinusoidal": lambda: both_sides(sinusoidal),
    "mollweide": lambda: both_sides(mollweide),
    "hammer": lambda: symmetric_globe(hammer),
    "aitoff": lambda: symmetric_globe(aitoff),
    "winkel-tripel": lambda: symmetric_globe(winkel_tripel),
}


def azimuthal_cases():
    """Azimuthal maps of the whole globe, as far as PROJ maps it, and of caps."""
    for aspect, (lon, lat) in ASPECTS.items():
        for name, scales in AZIMUTHAL.items():
            projection = f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}"
            on_cap = functools.partial(azimuthal, *scales, math.radians(70))
            yield Case(f"{name}-{aspect}-cap", projection, cap(lon, lat, 70), on_cap)
            if name in AZIMUTHAL_GLOBE:
                make = functools.partial(azimuthal_globe, *AZIMUTHAL_GLOBE[name])
                if name == "stere" and aspect != "polar":
                    make = functools.partial(azimuthal, *scales, ANTIPODE)
                yield Case(f"{name}-{aspect}", projection, "globe", make)


AMERICA, LCC = "box:-125,25,-65,50", "+proj=lcc +lat_1=33 +lat_2=45 +lat_0=39 +lon_0=-96 +ellps=WGS84"
AEA = "+proj=aea +lat_1=29.5 +lat_2=45.5 +lat_0=37.5 +lon_0=-96 +ellps=WGS84"
LAEA, PACIFIC = f"+proj=laea +lon_0=10 +lat_0=52 +R={R}", f"+proj=hammer +lon_0=180 +R={R}"
SMOOTH = [
    *(Case(name, name, "globe", make) for name, make in SMOOTH_GLOBE.items()),
    *azimuthal_cases(),
    Case("mercator-cap", "mercator", cap(10, 50, 20), lambda: mercator_cap(50, 20)),
    Case("mercator-wgs84-box", "EPSG:3395", "box:-20,35,40,70", lambda: conformal_box(mercator, 0, 35, 1, 70)),
    Case("lcc-wgs84-box", LCC, AMERICA, lambda: conformal_box(lambert_conformal, 0, 25, 1, 50)),
    Case("albers-wgs84-box", AEA, AMERICA, lambda: albers_box(-29, 25, 31, 50)),
    Case("utm-box", "EPSG:32631", "box:0,0,6,84", lambda: utm_box(-3, 0, 3, 84)),
    Case("winkel-tripel-box", "winkel-tripel", "box:60,20,150,75", lambda: sphere_box(winkel_tripel, 60, 20, 150, 75)),
    Case("hammer-antimeridian-box", PACIFIC, "box:150,-60,-120,10", lambda: sphere_box(hammer, -30, -60, 60, 10)),
    Case("laea-box", LAEA, "box:-25,34,45,72", lambda: sphere_box(oblique_equal_area, -25, 34, 45, 72)),
]


def proj_goode():
    """PROJ's `goode`, whole."""
    return both_sides(lambda lam, w: joined(*(f(lam, w) for f in goode_parts(PROJ_GOODE))))


def oblique(case_id, name, truth, lat_p=35.0):
    """A map of the globe by another pole, which changes none of its errors."""
    projection = f"+proj=ob_tran +o_proj={name} +o_lat_p={lat_p:g} +o_lon_p=20 +lon_0=-15 +R={R}"
    return Case(case_id, projection, "globe", SMOOTH_GLOBE[truth])


# Seams or an end of the map cross the region.
TORN = [
    Case("goode", "goode-homolosine", "globe", proj_goode),
    Case("igh", "interrupted-goode-homolosine", "globe", lambda: interrupted(*goode_parts(GOODE))),
    Case("imoll", "interrupted-mollweide", "globe", lambda: interrupted(mollweide)),
    oblique("oblique-plate-carree", "eqc", "plate-carree"),
    oblique("oblique-mercator", "merc", "mercator"),
    oblique("oblique-mollweide", "moll", "mollweide"),
    oblique("oblique-sinusoidal", "sinu", "sinusoidal", 60.0),
    oblique("transverse-hammer", "hammer", "hammer", 0.0),
]
CASES = {case.id: case for case in SMOOTH + TORN}
TOLERANCES = [1e-4, 1e-6, DEFAULT_TOLERANCE]


@functools.cache
def truth_of(case_id):
    return errors_of(CASES[case_id].field())


@functools.cache
def summary_of(case_id, tolerance):
    return summarize(CASES[case_id].projection, CASES[case_id].region, tolerance=tolerance)


def triple(summary):
    """The raw, scaled and affine errors of a summary."""
    return summary.airy_kavrayskiy, summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine
