"""Maps of the plane onto itself that correct a projection, and PROJ's operations for them.

PROJ's horner is a polynomial about an origin, whose values are the new coordinates. Its inverse iterates unless one is
given. Unless its range is widened it refuses points farther than 500 km.

Each map has `at(x, y)`, the new coordinates (n,) in metres and the Jacobian (n, 2, 2); `moved`, the map followed by
a similarity of x + i y and a shift; and `steps`, PROJ's operations, one after the other.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections import Projection

_LIMITS = "+range=1e8 +inv_tolerance=1e-6"  # metres


def _similar(coefficients: FloatArray, similarity: complex, shift: complex) -> FloatArray:
    """Coefficients (2, d + 1, d + 1) of x and y after a similarity of x + i y."""
    c, s = similarity.real, similarity.imag
    found = np.tensordot(np.array([[c, -s], [s, c]]), coefficients, axes=1)
    found[:, 0, 0] += (shift.real, shift.imag)
    return found


@dataclass(frozen=True)
class PolynomialMap:
    """x and y as polynomials of u = (x - x0) / size, v = (y - y0) / size: coefficients (2, d + 1, d + 1) of u^i v^j."""

    origin: complex
    size: float
    coefficients: FloatArray

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        u, v = (x - self.origin.real) / self.size, (y - self.origin.imag) / self.size
        polyval, polyder = np.polynomial.polynomial.polyval2d, np.polynomial.polynomial.polyder
        new_x, new_y = (polyval(u, v, c) for c in self.coefficients)
        slopes = (polyder(self.coefficients, axis=axis) for axis in (1, 2))  # by u and by v
        J = np.stack([np.stack([polyval(u, v, c) for c in slope], axis=-1) for slope in slopes], axis=-1)
        return new_x, new_y, J / self.size

    def moved(self, similarity: complex, shift: complex) -> PolynomialMap:
        """The map followed by a similarity."""
        return replace(self, coefficients=_similar(self.coefficients, similarity, shift))

    @property
    def steps(self) -> tuple[str, ...]:
        """One horner."""
        degree = self.coefficients.shape[1] - 1
        powers = np.add.outer(np.arange(degree + 1), np.arange(degree + 1))
        u, v = self.coefficients / self.size**powers
        origin = _listed(self.origin.real, self.origin.imag)
        return (f"+proj=horner +deg={degree} {_LIMITS} {_horner('fwd', origin, u, v)}",)


def _horner(way: str, origin: str, u: FloatArray, v: FloatArray) -> str:
    """PROJ's parameters of a polynomial, by the coefficients of x^i y^j, in its two orders."""
    count = len(u)
    by_u = [u[i, j] for j in range(count) for i in range(count - j)]
    by_v = [v[i, j] for i in range(count) for j in range(count - i)]
    return f"+{way}_origin={origin} +{way}_u={_listed(*by_u)} +{way}_v={_listed(*by_v)}"


def _listed(*values: float) -> str:
    """Numbers as the shortest texts that are read back as the same."""
    return ",".join(repr(float(value)) for value in values)


@dataclass(frozen=True)
class ComplexPolynomial:
    """A conformal map: x + i y as a polynomial of t = (z - z0) / size, z = x + i y; coefficients (d + 1,) of t^k."""

    origin: complex
    size: float
    coefficients: Any

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        t = (x + 1j * y - self.origin) / self.size
        new = np.polynomial.polynomial.polyval(t, self.coefficients)
        slope = np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyder(self.coefficients)) / self.size
        columns = [np.stack([w.real, w.imag], axis=-1) for w in (slope, 1j * slope)]
        return new.real, new.imag, np.stack(columns, axis=-1)

    def moved(self, similarity: complex, shift: complex) -> ComplexPolynomial:
        """The map followed by a similarity."""
        coefficients = similarity * self.coefficients
        coefficients[0] += shift
        return replace(self, coefficients=coefficients)

    @property
    def steps(self) -> tuple[str, ...]:
        """One complex horner, in which the real part is north."""
        k = np.arange(len(self.coefficients))
        northern = 1j * (-1j) ** k * np.conj(self.coefficients / self.size**k)
        pairs = np.stack([northern.real, northern.imag], axis=-1).ravel()
        return (
            f"+proj=horner +deg={k[-1]} {_LIMITS} +fwd_origin={_listed(self.origin.real, self.origin.imag)} "
            f"+fwd_c={_listed(*pairs)}",
        )


@dataclass(frozen=True)
class Shears:
    """An equal-area map: shears one after the other, about an origin, then a similarity.

    Each turns the plane by minus its angle, moves x by size times a polynomial of y / size, with coefficients
    (k, d + 1), and turns back.
    """

    origin: complex
    size: float
    angles: FloatArray
    coefficients: FloatArray
    _: KW_ONLY
    similarity: complex = 1.0
    shift: complex = 0.0

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """New coordinates and Jacobians."""
        z = (x + 1j * y - self.origin) / self.size
        columns = np.stack([np.ones_like(z), np.full_like(z, 1j)], axis=-1)
        for angle, coefficients in zip(self.angles, self.coefficients, strict=True):
            turn = np.exp(-1j * angle)
            z, columns = z * turn, columns * turn
            slope = np.polynomial.polynomial.polyval(z.imag, np.polynomial.polynomial.polyder(coefficients))
            z = z + np.polynomial.polynomial.polyval(z.imag, coefficients)
            columns = columns + slope[..., None] * columns.imag
            z, columns = z / turn, columns / turn
        z, columns = self.size * self.similarity * z + self.shift, columns * self.similarity
        return z.real, z.imag, np.stack([columns.real, columns.imag], axis=-2)

    def moved(self, similarity: complex, shift: complex) -> Shears:
        """The map followed by a similarity."""
        return replace(self, similarity=similarity * self.similarity, shift=similarity * self.shift + shift)

    @property
    def steps(self) -> tuple[str, ...]:
        """A rotation and a horner with its exact inverse for each shear, then the similarity."""
        steps, turned = [_affine(np.exp(-1j * self.angles[0]), -self.origin * np.exp(-1j * self.angles[0]))], 0.0
        for k, (angle, coefficients) in enumerate(zip(self.angles, self.coefficients, strict=True)):
            if k:
                steps.append(_affine(np.exp(1j * (turned - angle)), 0.0))
            steps.append(_shear(self.size * coefficients / self.size ** np.arange(len(coefficients))))
            turned = angle
        steps.append(_affine(self.similarity * np.exp(1j * turned), self.shift))
        return tuple(steps)


def _affine(similarity: complex, shift: complex) -> str:
    c, s = float(np.real(similarity)), float(np.imag(similarity))
    x, y = float(np.real(shift)), float(np.imag(shift))
    return f"+proj=affine +xoff={x!r} +yoff={y!r} +s11={c!r} +s12={-s!r} +s21={s!r} +s22={c!r}"


def _shear(coefficients: FloatArray) -> str:
    """PROJ's horner for x + f(y), y, with its inverse."""
    degree = len(coefficients) - 1
    moved, kept = (np.zeros((degree + 1, degree + 1)) for _ in range(2))
    moved[0] = coefficients
    kept[0, 1] = 1.0
    texts = []
    for way, sign in (("fwd", 1.0), ("inv", -1.0)):
        c = sign * moved
        c[1, 0] = 1.0
        texts.append(_horner(way, "0,0", c, kept))
    return f"+proj=horner +deg={degree} +range=1e8 {' '.join(texts)}"


PlaneMap = PolynomialMap | ComplexPolynomial | Shears


# ---- projections as functions --------------------------------------------------------------------


Sides = tuple[float, float, float, float]
_BESIDE = 1e-9  # degrees: rounding of points on the edge


@dataclass(frozen=True, eq=False)
class Average:
    """The weighted average of the coordinates of maps, each rotated by its turn."""

    maps: tuple[Projection, ...]
    shares: FloatArray
    turns: tuple[complex, ...]

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        z = np.zeros(np.shape(lon), dtype=complex)
        for projection, share, turn in zip(self.maps, self.shares, self.turns, strict=True):
            x, y = projection(lon, lat)
            z = z + share * turn * (x + 1j * y)
        return z.real, z.imag


@dataclass(frozen=True, eq=False)
class Corrected:
    """A base projection followed by a map of its plane."""

    base: Projection
    plane_map: PolynomialMap

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.base(lon, lat)
        return self.plane_map.at(x, y)[:2]

    def moved(self, turn: complex, shift: complex) -> Corrected:
        """The map followed by a rotation and a shift of x + i y."""
        return Corrected(self.base, self.plane_map.moved(turn, shift))


@dataclass(frozen=True, eq=False)
class BoxPolynomials:
    """x, y in metres as sums of T_i(s) T_j(t), Chebyshev's polynomials, with coefficients (2, d + 1, d + 1).

    s and t run from -1 to 1 from west to east and from south to north of a box in degrees, beyond which the map is
    undefined.
    """

    box: Sides
    coefficients: FloatArray

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres; NaN outside of the box."""
        s, t = _in_box(self.box, lon, lat)
        x, y = (np.polynomial.chebyshev.chebval2d(s, t, c) for c in self.coefficients)
        west, south, east, north = self.box
        reach = 1.0 + 2.0 * _BESIDE / min(east - west, north - south)
        outside = ~((np.abs(s) <= reach) & (np.abs(t) <= reach))
        return np.where(outside, np.nan, x), np.where(outside, np.nan, y)

    def moved(self, turn: complex, shift: complex) -> BoxPolynomials:
        """The map followed by a rotation and a shift of x + i y."""
        return replace(self, coefficients=_similar(self.coefficients, turn, shift))


def box_gradients(box: Sides, degree: int, lon: FloatArray, lat: FloatArray, ellipsoid: Ellipsoid) -> FloatArray:
    """Derivatives (n, (degree + 1)^2, 2) of T_i(s) T_j(t) by metres east and north, T_0 T_0 first."""
    s, t = _in_box(box, lon, lat)
    west, south, east, north = box
    meridian, vertical = ellipsoid.radii(lat)
    chebyshev = np.polynomial.chebyshev
    slopes = chebyshev.chebder(np.eye(degree + 1), axis=0)
    by_s = chebyshev.chebvander(s, degree - 1) @ slopes / (0.5 * np.radians(east - west))
    by_t = chebyshev.chebvander(t, degree - 1) @ slopes / (0.5 * np.radians(north - south))
    of_s, of_t = chebyshev.chebvander(s, degree), chebyshev.chebvander(t, degree)
    eastward = by_s[:, :, None] * of_t[:, None, :] / (vertical * np.cos(np.radians(lat)))[:, None, None]
    northward = of_s[:, :, None] * by_t[:, None, :] / meridian[:, None, None]
    return np.stack([eastward, northward], axis=-1).reshape(lon.size, -1, 2)


def _in_box(box: Sides, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
    west, south, east, north = box
    away = np.asarray(lon, dtype=float) - 0.5 * (west + east)
    away = np.where(np.abs(away) > 180.0, np.mod(away + 180.0, 360.0) - 180.0, away)
    return away / (0.5 * (east - west)), (lat - 0.5 * (south + north)) / (0.5 * (north - south))
