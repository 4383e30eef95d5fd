"""Derivatives of the methods of most CRSs by their formulas, wherever PROJ has the formulas' coordinates."""

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

_EPS = float(np.finfo(float).eps)


Second = tuple[ComplexArray, ComplexArray, ComplexArray]
"""Derivatives by metres along geodesics: by east twice, by east and north, and by north twice."""


class Place(NamedTuple):
    """Points (n,) of an ellipsoid as formulas need them, with longitudes in radians from the central meridian."""

    lon: FloatArray
    sin: FloatArray  # of the latitude
    cos: FloatArray
    meridian: FloatArray  # radius of curvature in metres
    parallel: FloatArray  # radius in metres


class Plane(NamedTuple):
    """x + iy of points (n,) up to a constant, and its derivatives by metres to the east and to the north."""

    w: ComplexArray
    east: ComplexArray
    north: ComplexArray
    good: BoolArray | bool = True
    second: Callable[[], Second] | None = None  # computed when asked for

    @property
    def jacobian(self) -> FloatArray:
        """J (n, 2, 2)."""
        return np.stack([self.east.view(float).reshape(-1, 2), self.north.view(float).reshape(-1, 2)], axis=-1)


Formula = Callable[[Place], Plane]


@dataclass(frozen=True)
class ClosedForm:
    """The formula of a map about its central meridian."""

    ellipsoid: Ellipsoid
    formula: Formula
    meridian: float  # degrees from Greenwich
    origin: complex = 0.0

    def plane(self, lon: FloatArray, lat: FloatArray) -> tuple[Plane, FloatArray]:
        """The plane at points (n,) in degrees, and its derivatives' relative errors, NaN where they are not good."""
        lon, phi = wrapped(lon - self.meridian), np.radians(lat)
        cos = np.cos(phi)
        meridian, vertical = self.ellipsoid.radii(lat)
        with np.errstate(all="ignore"):
            plane = self.formula(Place(np.radians(lon), np.sin(phi), cos, meridian, vertical * cos))
            good = plane.good & (np.abs(lat) <= _HIGHEST) & (np.abs(lon) <= _WIDEST)
            error = np.where(good, _ROUNDINGS * _EPS / (cos * cos), np.nan)
        return plane._replace(w=plane.w + self.origin), error

    def checked(self, lon: FloatArray, lat: FloatArray, x: FloatArray, y: FloatArray) -> tuple[Plane, FloatArray]:
        """The plane and the errors, NaN also where x and y, as PROJ has them, are not the formula's to rounding."""
        plane, error = self.plane(lon, lat)
        gap = np.abs(plane.w.real - x) + np.abs(plane.w.imag - y)
        error[~(gap <= _DISAGREEMENT * (self.ellipsoid.a + np.abs(x) + np.abs(y)))] = np.nan
        return plane, error


_HIGHEST, _WIDEST = 88.0, 179.9  # degrees; beyond, formulas lose digits, and seams are near
_ROUNDINGS = 8.0
_DISAGREEMENT = 1e-13  # of coordinates: what cone constants of two near parallels lose, by a hundred roundings
# From the central meridian and the equator, in degrees: parameters that a formula does not know are seen from afar.
_WIDE_LON, _WIDE_LAT = (part.ravel() for part in np.meshgrid([-41.0, -5.0, 3.0, 37.0], [-57.0, -19.0, 23.0, 61.0]))
_TOKEN = re.compile(r"\+?(\w+)(?:=(\S+))?")
_NOT_MAPS = ("", "pipeline", "unitconvert", "axisswap", "longlat", "noop")


def closed_form(function: Function, ellipsoid: Ellipsoid) -> ClosedForm | None:
    """The closed form of a PROJ operation, if its method has one that has PROJ's coordinates on a wide grid."""
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
        formula, meridian = _METHODS[steps[0]["proj"]](stated), stated.meridian
    except (ValueError, ZeroDivisionError):  # degrees with minutes; a cone that is none
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


# ---- what methods are given ----------------------------------------------------------------------


@dataclass(frozen=True)
class Stated:
    """The parameters of a method on an ellipsoid."""

    texts: dict[str, str]
    ellipsoid: Ellipsoid

    def number(self, *keys: str, default: float = 0.0) -> float:
        """The value of the first of the parameters that is stated; raises ValueError for what is no number."""
        return next((float(self.texts[key]) for key in keys if key in self.texts), default)

    def radians(self, key: str) -> float:
        """An angle that is stated in degrees, 0 by default."""
        return math.radians(self.number(key))

    @property
    def scale(self) -> float:
        """k_0."""
        return self.number("k_0", "k", default=1.0)

    @property
    def meridian(self) -> float:
        """Longitude in degrees of the central meridian, from which formulas count."""
        return 6.0 * self.number("zone") - 183.0 if "zone" in self.texts else self.number("lonc", "lon_0")

    def at(self, *keys: str) -> list[tuple[float, float, float]]:
        """Sine of stated latitudes, radius of the parallel in semi-major axes, and isometric latitude."""
        found = []
        for phi in map(self.radians, keys):
            sin, cos = math.sin(phi), math.cos(phi)
            radius = cos / math.sqrt(1.0 - self.ellipsoid.eccentricity_squared * sin * sin)
            found.append((sin, radius, float(_isometric(self.ellipsoid, sin, cos))))
        return found

    @property
    def pole(self) -> float:
        """1 and -1 for maps about a pole, else 0."""
        lat = self.number("lat_0")
        return math.copysign(1.0, lat) if abs(lat) > 90.0 - 1e-9 else 0.0


def _isometric(ellipsoid: Ellipsoid, sin: Any, cos: Any) -> Any:
    """Isometric latitude in radians."""
    e = math.sqrt(ellipsoid.eccentricity_squared)
    return np.arcsinh(sin / cos) - e * np.arctanh(e * sin)


def _authalic(ellipsoid: Ellipsoid, sin: Any) -> Any:
    """q of Snyder's 3-12: areas from the equator to latitudes, in half squares of the semi-major axis by longitude."""
    e2 = ellipsoid.eccentricity_squared
    e = math.sqrt(e2)
    return (1.0 - e2) * (sin / (1.0 - e2 * sin * sin) + (np.arctanh(e * sin) / e if e else sin))


# ---- straight meridians: cones, cylinders and maps about a pole ----------------------------------


Spacing = Literal["angles", "areas"] | Callable[[Place], FloatArray]
"""What a map keeps, of which the scale along meridians follows, or that scale."""


def _straight(n: float, width: float, distance: Callable[[Place], FloatArray], spacing: Spacing) -> Formula:
    """Maps with straight meridians, at `distance` from the apex by the cone constant n, or from the equator (n = 0)."""
    # A map with n = 0 has the scale `width` / radius along parallels.

    def formula(place: Place) -> Plane:
        away = distance(place)
        turn: ComplexArray = np.cos(n * place.lon) + 1j * np.sin(n * place.lon)
        k = (n * away if n else width) / place.parallel
        w = -1j * away * turn if n else width * place.lon + 1j * away
        h = spacing(place) if callable(spacing) else k if spacing == "angles" else 1.0 / k

        def second() -> Second:
            k_n = (k * place.sin - n * h) / place.parallel
            h_n = k_n if spacing == "angles" else -h * h * k_n
            by_east = (n * k - place.sin * h) / place.parallel
            return 1j * by_east * turn, k_n * turn, 1j * h_n * turn

        return Plane(w, k * turn, 1j * h * turn, second=None if callable(spacing) else second)

    return formula


def _mercator(stated: Stated) -> Formula:
    """Snyder 1987, page 44."""
    ellipsoid = stated.ellipsoid
    width = ellipsoid.a * (stated.at("lat_ts")[0][1] if "lat_ts" in stated.texts else stated.scale)
    return _straight(0.0, width, lambda place: width * _isometric(ellipsoid, place.sin, place.cos), "angles")


def _web_mercator(stated: Stated) -> Formula:
    """Mercator's map of a sphere, of geodetic latitudes."""
    a = stated.ellipsoid.a
    distance, spacing = (
        (lambda place: a * np.arcsinh(place.sin / place.cos)),
        (lambda place: a / place.cos / place.meridian),
    )
    return _straight(0.0, a, distance, spacing)


def _lambert_conic(stated: Stated) -> Formula:
    """Snyder 1987, page 108, with one or two parallels."""
    first, last = stated.at("lat_1", "lat_2" if "lat_2" in stated.texts else "lat_1")
    n = first[0] if first == last else math.log(first[1] / last[1]) / (last[2] - first[2])
    size = stated.ellipsoid.a * stated.scale * first[1] / n
    return _straight(
        n,
        0.0,
        lambda place: size * np.exp(n * (first[2] - _isometric(stated.ellipsoid, place.sin, place.cos))),
        "angles",
    )


def _albers(stated: Stated) -> Formula:
    """Snyder 1987, page 101."""
    a = stated.ellipsoid.a
    first, last = stated.at("lat_1", "lat_2")
    q, other = (_authalic(stated.ellipsoid, sin) for sin, _, _ in (first, last))
    n = first[0] if abs(first[0] - last[0]) < 1e-10 else (first[1] ** 2 - last[1] ** 2) / (other - q)
    constant = first[1] ** 2 + n * q
    return _straight(
        n, 0.0, lambda place: a * np.sqrt(constant - n * _authalic(stated.ellipsoid, place.sin)) / n, "areas"
    )


def _cylindrical_equal_area(stated: Stated) -> Formula:
    """Snyder 1987, page 81."""
    a, e = stated.ellipsoid.a, stated.ellipsoid
    k = stated.at("lat_ts")[0][1] if "lat_ts" in stated.texts else stated.scale
    return _straight(0.0, a * k, lambda place: a / (2.0 * k) * _authalic(e, place.sin), "areas")


def _equirectangular(stated: Stated) -> Formula:
    """Snyder 1987, page 91: that of a sphere, of geodetic latitudes."""
    a = stated.ellipsoid.a
    distance, spacing = (lambda place: a * np.arctan2(place.sin, place.cos)), (lambda place: a / place.meridian)
    return _straight(0.0, a * math.cos(stated.radians("lat_ts")), distance, spacing)


# ---- conformal maps by complex functions ---------------------------------------------------------


def _conformal(
    place: Place,
    w: ComplexArray,
    first: ComplexArray,
    second: Callable[[], ComplexArray],
    good: BoolArray | bool,
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

    def formula(place: Place) -> Plane:
        sinh = np.sinh(_isometric(stated.ellipsoid, place.sin, place.cos))
        cosh, sin, cos = np.sqrt(1.0 + sinh * sinh), np.sin(place.lon), np.cos(place.lon)
        # The map of the sphere is the Gudermannian of -i z, and the series is in twice that.
        sphere = np.arctan2(sinh, cos) - 1j * np.arcsinh(sin / np.hypot(sinh, cos))
        sine, slope = cosh * sin + 1j * (sinh * cos), 1.0 / (cosh * cos - 1j * (sinh * sin))
        square = slope * slope
        double = 2.0 * square - 1.0, -2j * (sine * square)
        factor = 1.0 + _clenshaw(series * order, *double)[1]
        w = 1j * size * (sphere + _clenshaw(series, *double)[0])

        def second() -> ComplexArray:
            return size * square * (factor * sine + 1j * _clenshaw(series * order * order, *double)[0])

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


def _clenshaw(series: FloatArray, cosine: ComplexArray, sine: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Sums of the series times sin(k t) and cos(k t), k = 1.., by cos(t) and sin(t)."""
    before, last = np.zeros_like(cosine), np.zeros_like(cosine)
    for value in series[::-1]:
        before, last = last, value + 2.0 * cosine * last - before
    return sine * last, cosine * last - before


def _turned(
    stated: Stated,
    stretch: float,
    shift: float,
    pole: float,
    east: float,
    size: complex,
    seam: float = 0.0,
    middle: float = 0.0,
) -> Formula:
    """Conformal maps of a sphere turned to a new pole, by way of which the ellipsoid is conformal, too.

    The sphere has `stretch` times the longitudes, and the isometric latitudes with a shift besides. The pole is at an
    angle from the sphere's own, and `east` the longitude from its meridian to that of the map. The map is `size` times
    the stereographic one, towards the old pole negative, or, with a `seam` so far from its `middle` longitude, times -i
    its logarithm.
    """
    t = math.tan(0.5 * pole)

    def formula(place: Place) -> Plane:
        lon, psi = stretch * place.lon + east, stretch * _isometric(stated.ellipsoid, place.sin, place.cos) + shift
        zeta = np.exp(-psi) * (np.cos(lon) + 1j * np.sin(lon))  # stereographic about the old pole
        inverse = 1.0 / (1.0 + t * zeta)
        m, m_1 = (zeta - t) * inverse, (1.0 + t * t) * inverse * inverse
        far, ratio, turn = np.abs(m), m_1 / m, 1j * stretch * zeta
        good = far <= _FROM_POLE

        def second() -> ComplexArray:
            m_2 = -2.0 * t * m_1 * inverse
            if not seam:
                return size * (m_2 * turn + 1j * stretch * m_1) * turn
            return -1j * size * ((m_2 / m - ratio * ratio) * turn + 1j * stretch * ratio) * turn

        if not seam:
            return _conformal(place, size * m, size * m_1 * turn, second, good)
        ahead = m * complex(math.cos(middle), -math.sin(middle))
        angle = np.arctan2(ahead.imag, ahead.real)
        good &= (far >= 1.0 / _FROM_POLE) & (np.abs(angle) <= seam)
        return _conformal(place, size * (angle - 1j * np.log(far)), -1j * size * ratio * turn, second, good)

    return formula


_FROM_POLE = 10.0  # a distance of 169 degrees


def _gauss_sphere(stated: Stated, phi: float) -> tuple[float, float, float, float]:
    """Stretch, shift and radius of the sphere that osculates the ellipsoid at a latitude, and that latitude on it."""
    ellipsoid = stated.ellipsoid
    e2, sin, cos = ellipsoid.eccentricity_squared, math.sin(phi), math.cos(phi)
    stretch = math.sqrt(1.0 + e2 / (1.0 - e2) * cos**4)
    there = math.asin(sin / stretch)
    shift = math.asinh(math.tan(there)) - stretch * float(_isometric(ellipsoid, sin, cos))
    return stretch, shift, ellipsoid.a * math.sqrt(1.0 - e2) / (1.0 - e2 * sin * sin), there


def _swiss(stated: Stated) -> Formula:
    """Swiss oblique Mercator: that of the sphere, turned; by PROJ up to 90 degrees of its equator."""
    stretch, shift, radius, there = _gauss_sphere(stated, stated.radians("lat_0"))
    return _turned(stated, stretch, shift, -there, 0.0, radius * stated.scale, math.radians(85.0))


def _oblique_stereographic(stated: Stated) -> Formula:
    """IOGP Guidance Note 7-2, 3.2.5.1: that of the osculating sphere."""
    stretch, shift, radius, there = _gauss_sphere(stated, stated.radians("lat_0"))
    return _turned(stated, stretch, shift, 0.5 * math.pi - there, 0.0, -2j * radius * stated.scale)


def _stereographic(stated: Stated) -> Formula:
    """Snyder 1987, page 160: of the sphere of conformal latitudes."""
    ellipsoid, e2 = stated.ellipsoid, stated.ellipsoid.eccentricity_squared
    if n := stated.pole:
        if abs(stated.number("lat_ts", default=90.0)) < 90.0 - 1e-9:
            ((_, radius, psi),) = stated.at("lat_ts")
            size = radius * math.exp(abs(psi))
        else:
            e = math.sqrt(e2)
            size = 2.0 * stated.scale / math.sqrt((1.0 + e) ** (1.0 + e) * (1.0 - e) ** (1.0 - e))
        size *= ellipsoid.a * n
        return _straight(
            n, 0.0, lambda place: size * np.exp(-n * _isometric(ellipsoid, place.sin, place.cos)), "angles"
        )
    ((_, radius, psi),) = stated.at("lat_0")
    size = ellipsoid.a * stated.scale * radius * math.cosh(psi)
    return _turned(stated, 1.0, 0.0, 0.5 * math.pi - math.atan(math.sinh(psi)), 0.0, -2j * size)


def _oblique_mercator(stated: Stated) -> Formula:
    """Snyder 1987, page 71, Hotine's, by a point and an azimuth."""
    ellipsoid, e2 = stated.ellipsoid, stated.ellipsoid.eccentricity_squared
    ((sin, radius, psi),) = stated.at("lat_0")
    stretch = math.sqrt(1.0 + e2 / (1.0 - e2) * (1.0 - sin * sin) ** 2)
    d = max(1.0, stretch * math.sqrt(1.0 - e2) / (radius * (1.0 - e2 * sin * sin)))
    f = d + math.copysign(math.sqrt(d * d - 1.0), sin)
    alpha = stated.radians("alpha") if "alpha" in stated.texts else math.asin(d * math.sin(stated.radians("gamma")))
    gamma = math.asin(math.sin(alpha) / d)
    # From the point, where the central line has the azimuth alpha, back to where it meets the equator of the sphere.
    back = math.asin(0.5 * (f - 1.0 / f) * math.tan(gamma))
    turn = math.radians(stated.number("gamma", default=math.degrees(alpha)))
    size = ellipsoid.a * stated.scale * math.sqrt(1.0 - e2) / (1.0 - e2 * sin * sin)
    shift = math.log(f) - stretch * psi
    rotated = 1j * size * complex(math.cos(turn), -math.sin(turn))
    quarter, seam = 0.5 * math.pi, math.radians(178.0)
    return _turned(stated, stretch, shift, quarter - gamma, quarter + back, rotated, seam, quarter)


# ---- equal-area about a point --------------------------------------------------------------------


def _lambert_azimuthal(stated: Stated) -> Formula:
    """Snyder 1987, page 187: of the sphere of authalic latitudes."""
    ellipsoid, whole = stated.ellipsoid, float(_authalic(stated.ellipsoid, 1.0))
    a, radius = ellipsoid.a, ellipsoid.a * math.sqrt(0.5 * whole)
    if n := stated.pole:
        return _straight(n, 0.0, lambda place: n * a * np.sqrt(whole - n * _authalic(ellipsoid, place.sin)), "areas")
    ((sin, parallel, _),) = stated.at("lat_0")
    sin_0 = float(_authalic(ellipsoid, sin)) / whole
    cos_0 = math.sqrt(1.0 - sin_0 * sin_0)
    widened = a * parallel / (radius * cos_0)

    def formula(place: Place) -> Plane:
        sin_b = _authalic(ellipsoid, place.sin) / whole
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
        return Plane(
            far * (widened * right + 1j / widened * up), per_east * east, per_north * north, ahead > _FROM_ANTIPODE
        )

    return formula


_FROM_ANTIPODE = 0.01  # of 2

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
}
