"""Derivatives by formulas for the methods of most CRSs, wherever PROJ's coordinates are those of the formulas."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from projdist._typing import BoolArray, ComplexArray, FloatArray
from projdist.earth import Ellipsoid, wrapped
from projdist.projections.operations import CrsOperation, Function, Pipeline

_EPS, _RADIAN = float(np.finfo(float).eps), math.radians(1.0)
_HIGHEST, _NEAR_POLE = 88.0, 89.99  # degrees; beyond, formulas lose digits, those of straight conformal maps later
_chebyshev, _polynomial = np.polynomial.chebyshev, np.polynomial.polynomial


Second = tuple[ComplexArray, ComplexArray, ComplexArray]
"""Second derivatives by metres along geodesics: east-east, east-north and north-north."""


class Place(NamedTuple):
    """Points (n,) or one: longitude in radians from the central meridian, sine and cosine of the latitude, ..."""

    ellipsoid: Ellipsoid
    lon: Any
    sin: Any
    cos: Any
    w2: Any  # 1 - e^2 sin^2
    parallel: Any  # radius in metres

    @classmethod
    def of(cls, ellipsoid: Ellipsoid, lon: Any, lat: Any) -> Place:
        """The points of longitudes and latitudes in degrees."""
        phi = _RADIAN * lat  # `np.radians` takes four times as long
        sin, cos = np.sin(phi), np.cos(phi)
        w2 = 1.0 - ellipsoid.eccentricity_squared * sin * sin
        return cls(ellipsoid, _RADIAN * lon, sin, cos, w2, ellipsoid.a * cos / np.sqrt(w2))

    @property
    def flattened(self) -> Any:
        """artanh(e sin) / e, by its series; it lessens isometric latitudes by e^2 times itself."""
        e2 = self.ellipsoid.eccentricity_squared
        terms = math.ceil(math.log(_EPS) / math.log(e2)) if e2 else 1
        return self.sin * _polynomial.polyval(e2 * self.sin * self.sin, 1.0 / (2.0 * np.arange(terms) + 1.0))

    @property
    def isometric(self) -> Any:
        """Isometric latitude in radians, to rounding of 1; `arcsinh` of the tangent takes three times as long."""
        spherical = np.copysign(np.log((1.0 + np.abs(self.sin)) / self.cos), self.sin)
        return spherical - self.ellipsoid.eccentricity_squared * self.flattened

    @property
    def below(self) -> Any:
        """Area from the equator per radian of longitude, in half squares of the semi-major axis: Snyder's q (3-12)."""
        return (1.0 - self.ellipsoid.eccentricity_squared) * (self.sin / self.w2 + self.flattened)


class Plane(NamedTuple):
    """x + iy of points (n,) up to a constant, and its derivatives per metre east and north."""

    w: ComplexArray
    east: ComplexArray
    north: ComplexArray
    good: BoolArray | bool = True
    second: Callable[[], Second] | None = None  # computed when asked for
    highest: float = _HIGHEST

    @property
    def jacobian(self) -> FloatArray:
        """J (n, 2, 2)."""
        return np.stack([self.east.view(float).reshape(-1, 2), self.north.view(float).reshape(-1, 2)], axis=-1)


Formula = Callable[[Place], Plane]


@dataclass(frozen=True)
class ClosedForm:
    """The formula of a map relative to its central meridian."""

    ellipsoid: Ellipsoid
    formula: Formula
    meridian: float  # degrees from Greenwich
    origin: complex = 0.0

    def plane(self, lon: FloatArray, lat: FloatArray) -> tuple[Plane, FloatArray]:
        """The plane at points (n,) in degrees, and relative errors of its derivatives, NaN where they are not good."""
        lon = wrapped(lon - self.meridian)
        place = Place.of(self.ellipsoid, lon, lat)
        with np.errstate(all="ignore"):
            plane = self.formula(place)
            plane = plane._replace(w=plane.w + self.origin)
            good = plane.good & (np.abs(lat) <= plane.highest) & (np.abs(lon) <= _WIDEST)
            error = np.where(good, _ROUNDINGS * _EPS / np.maximum(place.cos * place.cos, _LEAST), np.nan)
        return plane, error

    def checked(self, lon: FloatArray, lat: FloatArray, x: FloatArray, y: FloatArray) -> tuple[Plane, FloatArray]:
        """As `plane`, with errors NaN also where PROJ's x and y differ from the formula's by more than rounding."""
        plane, error = self.plane(lon, lat)
        gap = np.abs(plane.w.real - x) + np.abs(plane.w.imag - y)
        error[~(gap <= _DISAGREEMENT * (self.ellipsoid.a + np.abs(x) + np.abs(y)))] = np.nan
        return plane, error


_WIDEST = 179.9  # degrees; beyond, seams are near
_LEAST = math.cos(math.radians(_HIGHEST)) ** 2
_ROUNDINGS = 8.0
_DISAGREEMENT = 1e-13  # of coordinates: what cone constants of two near parallels lose, by a hundred roundings
# From the central meridian and the equator, in degrees: parameters that a formula does not know are seen from afar.
_WIDE_LON, _WIDE_LAT = (part.ravel() for part in np.meshgrid([-41.0, -5.0, 3.0, 37.0], [-57.0, -19.0, 23.0, 61.0]))
_TOKEN = re.compile(r"\+?(\w+)(?:=(\S+))?")
_NOT_MAPS = ("", "pipeline", "unitconvert", "axisswap", "longlat", "noop")


def closed_form(function: Function, ellipsoid: Ellipsoid) -> ClosedForm | None:
    """The closed form of a PROJ operation, if its method has one that agrees with PROJ on a wide grid."""
    # Functions of the user's need not have a hash.
    return _form_of(function, ellipsoid) if isinstance(function, CrsOperation | Pipeline) else None


@functools.lru_cache(maxsize=512)
def _form_of(operation: CrsOperation | Pipeline, ellipsoid: Ellipsoid) -> ClosedForm | None:
    steps = [dict(_TOKEN.findall(step)) for step in re.split(r"\bstep\b", operation.definition)]
    steps = [stated for stated in steps if stated.get("proj", "") not in _NOT_MAPS]
    if len(steps) != 1 or steps[0]["proj"] not in _METHODS:
        return None
    stated = Stated(steps[0], ellipsoid)
    try:
        with np.errstate(all="ignore"):  # a cone that is a cylinder has no size
            formula, meridian = _METHODS[steps[0]["proj"]](stated), stated.meridian
    except (ValueError, ZeroDivisionError):  # degrees with minutes; a cone that is a cylinder
        return None
    if isinstance(operation, CrsOperation):
        meridian += operation.angles.greenwich
    form = ClosedForm(ellipsoid, formula, meridian)
    lon, lat = wrapped(meridian + _WIDE_LON), _WIDE_LAT
    x, y = operation(lon, lat)
    plane, error = form.plane(lon, lat)
    used = np.flatnonzero((error >= 0.0) & np.isfinite(x))
    if not used.size:
        return None
    nearest = used[np.abs(plane.w[used]).argmin()]
    form = replace(form, origin=complex(x[nearest], y[nearest]) - complex(plane.w[nearest]))
    return form if np.isfinite(form.checked(lon, lat, x, y)[1][used]).all() else None


# ---- parameters of methods -----------------------------------------------------------------------


@dataclass(frozen=True)
class Stated:
    """The parameters of a method on an ellipsoid."""

    texts: dict[str, str]
    ellipsoid: Ellipsoid

    def number(self, *keys: str, default: float = 0.0) -> float:
        """The value of the first parameter that is stated; raises ValueError for what is no number."""
        return next((float(self.texts[key]) for key in keys if key in self.texts), default)

    @property
    def scale(self) -> float:
        """k_0."""
        return self.number("k_0", "k", default=1.0)

    @property
    def meridian(self) -> float:
        """Longitude in degrees of the central meridian, from which formulas count."""
        return 6.0 * self.number("zone") - 183.0 if "zone" in self.texts else self.number("lonc", "lon_0")

    def at(self, key: str) -> Place:
        """The point on the central meridian at a stated latitude."""
        return Place.of(self.ellipsoid, 0.0, self.number(key))

    @property
    def true_scale(self) -> float:
        """The scale along the equator of a cylinder, by `lat_ts` or k_0."""
        return float(self.at("lat_ts").parallel) / self.ellipsoid.a if "lat_ts" in self.texts else self.scale

    @property
    def pole(self) -> float:
        """1 for maps about the north pole, -1 about the south pole, else 0."""
        lat = self.number("lat_0")
        return math.copysign(1.0, lat) if abs(lat) > 90.0 - 1e-9 else 0.0


# ---- straight meridians: cones, cylinders and maps about a pole ----------------------------------


Spacing = Literal["angles", "areas"] | Callable[[Place], Any]
"""What determines the scale along meridians: the property that the map keeps, or metres per radian of latitude."""


def _straight(n: float, width: float, distance: Callable[[Place], FloatArray], spacing: Spacing) -> Formula:
    """Maps with straight meridians, at `distance` from the apex by the cone constant n, or from the equator (n = 0)."""
    # A map with n = 0 has the scale `width` / radius along parallels.
    highest = _NEAR_POLE if spacing == "angles" else _HIGHEST

    def formula(place: Place) -> Plane:
        away, e2 = distance(place), place.ellipsoid.eccentricity_squared
        turn: Any = np.cos(n * place.lon) + 1j * np.sin(n * place.lon) if n else 1.0 + 0.0j
        k = (n * away if n else width) / place.parallel
        w = away * turn * -1j if n else width * place.lon + 1j * away
        h = k if spacing == "angles" else 1.0 / k
        if callable(spacing):
            h = spacing(place) * place.w2 * np.sqrt(place.w2) / place.ellipsoid.a / (1.0 - e2)

        def second() -> Second:
            k_n = (k * place.sin - n * h) / place.parallel
            h_n = k_n if spacing == "angles" else -h * h * k_n
            by_east = (n * k - place.sin * h) / place.parallel
            return 1j * by_east * turn, k_n * turn, 1j * h_n * turn

        east = k * turn
        north = 1j * (east if spacing == "angles" else h * turn)
        return Plane(w, east, north, True, None if callable(spacing) else second, highest)

    return formula


def _mercator(stated: Stated) -> Formula:
    """Snyder 1987, page 44."""
    width = stated.ellipsoid.a * stated.true_scale
    return _straight(0.0, width, lambda place: width * place.isometric, "angles")


def _web_mercator(stated: Stated) -> Formula:
    """Mercator's map of a sphere, of geodetic latitudes."""
    a = stated.ellipsoid.a
    return _straight(0.0, a, lambda place: a * np.arcsinh(place.sin / place.cos), lambda place: a / place.cos)


def _lambert_conic(stated: Stated) -> Formula:
    """Snyder 1987, page 108, with one or two parallels."""
    first = stated.at("lat_1")
    last = stated.at("lat_2") if "lat_2" in stated.texts else first
    n, psi = float(first.sin), first.isometric
    if last.sin != first.sin:
        n = float(np.log(first.parallel / last.parallel) / (last.isometric - psi))
    size = stated.scale * first.parallel / n
    return _straight(n, 0.0, lambda place: size * np.exp(n * (psi - place.isometric)), "angles")


def _albers(stated: Stated) -> Formula:
    """Snyder 1987, page 101."""
    a, first, last = stated.ellipsoid.a, stated.at("lat_1"), stated.at("lat_2")
    m, n = (first.parallel / a) ** 2, float(first.sin)
    if abs(first.sin - last.sin) > 1e-10:
        n = float((m - (last.parallel / a) ** 2) / (last.below - first.below))
    constant = m + n * first.below
    return _straight(n, 0.0, lambda place: a * np.sqrt(constant - n * place.below) / n, "areas")


def _cylindrical_equal_area(stated: Stated) -> Formula:
    """Snyder 1987, page 81."""
    a, k = stated.ellipsoid.a, stated.true_scale
    return _straight(0.0, a * k, lambda place: a / (2.0 * k) * place.below, "areas")


def _equirectangular(stated: Stated) -> Formula:
    """Snyder 1987, page 91: that of a sphere, of geodetic latitudes."""
    a = stated.ellipsoid.a
    width = a * float(stated.at("lat_ts").cos)
    return _straight(0.0, width, lambda place: a * np.arctan2(place.sin, place.cos), lambda _: a)


# ---- conformal maps by complex functions ---------------------------------------------------------


def _conformal(
    place: Place, w: ComplexArray, first: ComplexArray, second: Callable[[], ComplexArray], good: BoolArray
) -> Plane:
    """A function of longitude + i isometric latitude, with its first and second derivatives."""
    east = first / place.parallel

    def bends() -> Second:
        bend = (second() - 1j * place.sin * first) / (place.parallel * place.parallel)
        return bend, 1j * bend, -bend

    return Plane(w, east, 1j * east, good, bends)


def _transverse_mercator(stated: Stated) -> Formula:
    """Karney 2011, Transverse Mercator with an accuracy of a few nanometers, equations 7 to 12 and 35."""
    n = stated.ellipsoid.f / (2.0 - stated.ellipsoid.f)
    scale = 0.9996 if stated.texts["proj"] == "utm" else stated.scale
    size = stated.ellipsoid.a / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0 + n**6 / 256.0) * scale
    series = np.array([np.polyval([*reversed(row), *[0.0] * (k + 1)], n) for k, row in enumerate(_KRUEGER)])
    order = 2.0 * np.arange(1, 7)
    # In powers of cos(t): the sum of order series cos(k t), and of series and order^2 series sin(k t), over sin(t).
    cosines: FloatArray = _chebyshev.cheb2poly([0.0, *series * order])
    sines, bends = (_polynomial.polyder(_chebyshev.cheb2poly([0.0, *2.0 * series * order**power])) for power in (-1, 1))

    def formula(place: Place) -> Plane:
        growth = np.exp(place.isometric)
        sinh, cosh = 0.5 * (growth - 1.0 / growth), 0.5 * (growth + 1.0 / growth)
        sin, cos = np.sin(place.lon), np.cos(place.lon)
        # The map of the sphere is i times the Gudermannian of -i z, and the series is in twice that.
        away = np.copysign(np.log((np.abs(sin) + cosh) / np.sqrt(sinh * sinh + cos * cos)), sin)
        sine, slope = cosh * sin + 1j * (sinh * cos), 1.0 / (cosh * cos - 1j * (sinh * sin))
        square = slope * slope
        double, by_sine = 2.0 * square - 1.0, 2.0 * (square * sine)
        factor = 1.0 + _polynomial.polyval(double, cosines)
        w = size * (away + 1j * np.arctan(sinh / cos) + by_sine * _polynomial.polyval(double, sines))

        def second() -> ComplexArray:
            return size * square * (factor * sine + by_sine * _polynomial.polyval(double, bends))

        return _conformal(place, w, size * factor * slope, second, np.abs(place.lon) <= _FROM_CENTRE)

    return formula


_FROM_CENTRE = math.radians(70.0)
# By powers of the third flattening from k on, for k = 1 to 6.
_KRUEGER = (
    (1 / 2, -2 / 3, 5 / 16, 41 / 180, -127 / 288, 7891 / 37800),
    (13 / 48, -3 / 5, 557 / 1440, 281 / 630, -1983433 / 1935360),
    (61 / 240, -103 / 140, 15061 / 26880, 167603 / 181440),
    (49561 / 161280, -179 / 168, 6601661 / 7257600),
    (34729 / 80640, -3418889 / 1995840),
    (212378941 / 319334400,),
)


_Sphere = tuple[float, float, float]
"""The factor of longitudes and isometric latitudes, and the shifts of the latitudes and of the longitudes."""


def _turned(
    stated: Stated, sphere: _Sphere, pole: float, size: complex, seam: float = 0.0, middle: float = 0.0
) -> Formula:
    """Conformal maps of a sphere about a new pole, at an angle from its own along the meridian 0.

    They are `size` times the stereographic map, in which the old pole is at a negative number, or, with a `seam` so far
    from the `middle` longitude, times -i its logarithm.
    """
    t, (stretch, shift, east) = math.tan(0.5 * pole), sphere

    def formula(place: Place) -> Plane:
        lon, psi = stretch * place.lon + east, stretch * place.isometric + shift
        zeta = np.exp(-psi) * (np.cos(lon) + 1j * np.sin(lon))  # stereographic about the old pole
        inverse = 1.0 / (1.0 + t * zeta)
        m, m_1, turn = (zeta - t) * inverse, (1.0 + t * t) * inverse * inverse, 1j * stretch * zeta
        far = np.square(m.real) + np.square(m.imag)
        good, w, slope = far <= _FROM_POLE**2, m, m_1
        if seam:
            ahead = m * complex(math.cos(middle), -math.sin(middle))
            angle = 2.0 * np.arctan(ahead.imag / (np.sqrt(far) + ahead.real))  # in half the time of `arctan2`
            good &= (far >= 1.0 / _FROM_POLE**2) & (np.abs(angle) <= seam)
            w, slope = angle - 0.5j * np.log(far), -1j * m_1 / m

        def second() -> ComplexArray:
            m_2 = -2.0 * t * m_1 * inverse
            bend = -1j * (m_2 / m + slope * slope) if seam else m_2
            return size * (bend * turn + 1j * stretch * slope) * turn

        return _conformal(place, size * w, size * slope * turn, second, good)

    return formula


_FROM_POLE = 10.0  # a distance of 169 degrees


def _gauss_sphere(stated: Stated) -> tuple[_Sphere, float, float]:
    """The sphere that osculates the ellipsoid at `lat_0`, its radius by k_0, and that latitude on it."""
    e2, centre = stated.ellipsoid.eccentricity_squared, stated.at("lat_0")
    stretch = math.sqrt(1.0 + e2 / (1.0 - e2) * centre.cos**4)
    there = math.asin(centre.sin / stretch)
    radius = stated.scale * stated.ellipsoid.a * math.sqrt(1.0 - e2) / (1.0 - e2 * centre.sin**2)
    return (stretch, math.asinh(math.tan(there)) - stretch * float(centre.isometric), 0.0), radius, there


def _swiss(stated: Stated) -> Formula:
    """Swiss oblique Mercator: Mercator's map of the sphere about a new pole, within 85 degrees of longitude."""
    sphere, radius, there = _gauss_sphere(stated)
    return _turned(stated, sphere, -there, radius, math.radians(85.0))


def _oblique_stereographic(stated: Stated) -> Formula:
    """IOGP Guidance Note 7-2, 3.2.5.1: that of the osculating sphere."""
    sphere, radius, there = _gauss_sphere(stated)
    return _turned(stated, sphere, 0.5 * math.pi - there, -2j * radius)


def _stereographic(stated: Stated) -> Formula:
    """Snyder 1987, page 160: of the sphere of conformal latitudes."""
    if n := stated.pole:
        e = math.sqrt(stated.ellipsoid.eccentricity_squared)
        size = 2.0 * stated.scale * stated.ellipsoid.a / math.sqrt((1.0 + e) ** (1.0 + e) * (1.0 - e) ** (1.0 - e))
        if abs(stated.number("lat_ts", default=90.0)) < 90.0 - 1e-9:
            true = stated.at("lat_ts")
            size = float(true.parallel * np.exp(np.abs(true.isometric)))
        return _straight(n, 0.0, lambda place: n * size * np.exp(-n * place.isometric), "angles")
    centre = stated.at("lat_0")
    sinh = math.sinh(centre.isometric)
    size = float(stated.scale * centre.parallel * math.hypot(1.0, sinh))
    return _turned(stated, (1.0, 0.0, 0.0), 0.5 * math.pi - math.atan(sinh), -2j * size)


def _oblique_mercator(stated: Stated) -> Formula:
    """Snyder 1987, page 71, Hotine's, by a point and an azimuth."""
    e2, a, centre = stated.ellipsoid.eccentricity_squared, stated.ellipsoid.a, stated.at("lat_0")
    stretch, ratio = math.sqrt(1.0 + e2 / (1.0 - e2) * centre.cos**4), math.sqrt(1.0 - e2) / (1.0 - e2 * centre.sin**2)
    d = max(1.0, stretch * ratio * a / float(centre.parallel))
    f = d + math.copysign(math.sqrt(d * d - 1.0), centre.sin)
    alpha = math.radians(stated.number("alpha"))
    if "alpha" not in stated.texts:
        alpha = math.asin(d * math.sin(math.radians(stated.number("gamma"))))
    gamma = math.asin(math.sin(alpha) / d)
    # From the point, where the central line has the azimuth alpha, back to where it meets the equator of the sphere.
    back = math.asin(0.5 * (f - 1.0 / f) * math.tan(gamma))
    turn = math.radians(stated.number("gamma", default=math.degrees(alpha)))
    shift = math.log(f) - stretch * float(centre.isometric)
    rotated = 1j * a * stated.scale * ratio * complex(math.cos(turn), -math.sin(turn))
    quarter, seam = 0.5 * math.pi, math.radians(178.0)
    return _turned(stated, (stretch, shift, quarter + back), quarter - gamma, rotated, seam, quarter)


# ---- equal-area about a point --------------------------------------------------------------------


def _lambert_azimuthal(stated: Stated) -> Formula:
    """Snyder 1987, page 187: of the sphere of authalic latitudes."""
    a, whole = stated.ellipsoid.a, float(Place.of(stated.ellipsoid, 0.0, 90.0).below)
    radius = a * math.sqrt(0.5 * whole)
    if n := stated.pole:
        return _straight(n, 0.0, lambda place: n * a * np.sqrt(whole - n * place.below), "areas")
    centre = stated.at("lat_0")
    sin_0 = float(centre.below) / whole
    cos_0 = math.sqrt(1.0 - sin_0 * sin_0)
    widened = float(centre.parallel) / (radius * cos_0)

    def formula(place: Place) -> Plane:
        sin_b = place.below / whole
        cos_b = np.sqrt((1.0 - sin_b) * (1.0 + sin_b))
        sin_l, cos_l = np.sin(place.lon), np.cos(place.lon)
        right, up = cos_b * sin_l, cos_0 * sin_b - sin_0 * cos_b * cos_l
        ahead = 1.0 + sin_0 * sin_b + cos_0 * cos_b * cos_l
        far = radius * np.sqrt(2.0 / ahead)
        by_lon, by_lat = 0.5 * cos_0 * right / ahead, -0.5 * (sin_0 * cos_b - cos_0 * sin_b * cos_l) / ahead
        # By metres: the sphere has the ellipsoid's areas.
        per_east, per_north = far / place.parallel, far * place.parallel / (radius * radius * cos_b)
        east = widened * (cos_b * cos_l + by_lon * right) + 1j / widened * (sin_0 * right + by_lon * up)
        rise = cos_0 * cos_b + sin_0 * sin_b * cos_l
        north = widened * (by_lat * right - sin_b * sin_l) + 1j / widened * (rise + by_lat * up)
        w = far * (widened * right + 1j / widened * up)
        return Plane(w, per_east * east, per_north * north, ahead > _FROM_ANTIPODE)

    return formula


_FROM_ANTIPODE = 0.01  # of 2


# ---- maps of the world with straight parallels ---------------------------------------------------


Curve = Callable[[FloatArray], tuple[Any, Any]]
"""A function of a parameter of latitude, and its derivative."""


def _equal_area_world(stated: Stated, share: Curve, width: Curve, height: Curve, authalic: bool = False) -> Formula:
    """Equal-area maps by a parameter t of latitude, where `share` is its sine, or that of the authalic latitude."""
    # x = radius * longitude * width(t), y = radius * height(t).
    a, whole = stated.ellipsoid.a, float(Place.of(stated.ellipsoid, 0.0, 90.0).below)
    radius = a * math.sqrt(0.5 * whole) if authalic else a
    meridian = a * (1.0 - stated.ellipsoid.eccentricity_squared)  # times w^-3, the radius of curvature
    shares = share(_ANGLES)[0]

    def formula(place: Place) -> Plane:
        sine = place.below / whole if authalic else place.sin
        t = np.interp(sine, shares, _ANGLES)
        for _ in range(_MOST_STEPS):
            value, slope = share(t)
            step = (sine - value) / slope
            t = t + step
            if np.nanmax(np.abs(step), initial=0.0) < _SQUARE_IS_ROUNDING:
                break
        (x, x_t), (y, y_t), slope = width(t), height(t), share(t)[1]
        # By metres to the north: the authalic sphere has the ellipsoid's areas.
        by_metre = place.parallel / radius**2 if authalic else place.cos * place.w2 * np.sqrt(place.w2) / meridian
        north = radius * by_metre / slope
        lon = place.lon
        return Plane(radius * (lon * x + 1j * y), radius * x / place.parallel + 0j, north * (lon * x_t + 1j * y_t))

    return formula


_ANGLES = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 513)  # from which two of Newton's steps suffice
_MOST_STEPS, _SQUARE_IS_ROUNDING = 30, 1e-9


def _sinusoidal(stated: Stated) -> Formula:
    """Snyder 1987, page 243, of a sphere."""
    return _equal_area_world(
        stated, lambda t: (np.sin(t), np.cos(t)), lambda t: (np.cos(t), -np.sin(t)), lambda t: (t, 1.0)
    )


def _mollweide(stated: Stated) -> Formula:
    """Snyder 1987, page 249."""
    x, y = math.sqrt(8.0) / math.pi, math.sqrt(2.0)
    return _equal_area_world(
        stated,
        lambda t: ((2.0 * t + np.sin(2.0 * t)) / math.pi, 4.0 / math.pi * np.cos(t) ** 2),
        lambda t: (x * np.cos(t), -x * np.sin(t)),
        lambda t: (y * np.sin(t), y * np.cos(t)),
    )


def _eckert_iv(stated: Stated) -> Formula:
    """Snyder 1987, page 253."""
    pole, x = 2.0 + 0.5 * math.pi, 2.0 / math.sqrt(math.pi * (4.0 + math.pi))
    y = math.pi * x
    return _equal_area_world(
        stated,
        lambda t: ((t + 0.5 * np.sin(2.0 * t) + 2.0 * np.sin(t)) / pole, 2.0 * np.cos(t) * (1.0 + np.cos(t)) / pole),
        lambda t: (x * (1.0 + np.cos(t)), -x * np.sin(t)),
        lambda t: (y * np.sin(t), y * np.cos(t)),
    )


def _eckert_vi(stated: Stated) -> Formula:
    """Snyder 1987, page 253."""
    pole, size = 1.0 + 0.5 * math.pi, 1.0 / math.sqrt(2.0 + math.pi)
    return _equal_area_world(
        stated,
        lambda t: ((t + np.sin(t)) / pole, (1.0 + np.cos(t)) / pole),
        lambda t: (size * (1.0 + np.cos(t)), -size * np.sin(t)),
        lambda t: (2.0 * size * t, 2.0 * size),
    )


def _equal_earth(stated: Stated) -> Formula:
    """Savric, Patterson and Jenny 2018, International Journal of Geographical Information Science 33:454."""
    height = np.polynomial.Polynomial([0.0, 1.340264, 0.0, -0.081106, 0.0, 0.0, 0.0, 0.000893, 0.0, 0.003796])
    slope, bend, half = height.deriv(), height.deriv(2), 0.5 * math.sqrt(3.0)

    def width(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        x = np.cos(t) / (half * slope(t))
        return x, -np.sin(t) / (half * slope(t)) - x * bend(t) / slope(t)

    return _equal_area_world(
        stated, lambda t: (np.sin(t) / half, np.cos(t) / half), width, lambda t: (height(t), slope(t)), authalic=True
    )


_METHODS: dict[str, Callable[[Stated], Formula]] = {
    "merc": _mercator,
    "webmerc": _web_mercator,
    "lcc": _lambert_conic,
    "aea": _albers,
    "cea": _cylindrical_equal_area,
    "eqc": _equirectangular,
    "tmerc": _transverse_mercator,
    "utm": _transverse_mercator,
    "somerc": _swiss,
    "sterea": _oblique_stereographic,
    "stere": _stereographic,
    "omerc": _oblique_mercator,
    "laea": _lambert_azimuthal,
    "sinu": _sinusoidal,
    "moll": _mollweide,
    "eck4": _eckert_iv,
    "eck6": _eckert_vi,
    "eqearth": _equal_earth,
}
