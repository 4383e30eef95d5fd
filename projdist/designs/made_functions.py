"""Projections that are made of others or of numbers, as functions of longitude and latitude that can be pickled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.designs.plane_maps import Polynomials
from projdist.earth import Ellipsoid
from projdist.projections import Projection

__all__ = ["Average", "BoxPolynomials", "Corrected", "box_gradients"]

Sides = tuple[float, float, float, float]
_BESIDE = 1e-9  # degrees: rounding of points on the edge


@dataclass(frozen=True, eq=False)
class Average:
    """The weighted average of the coordinates of maps, each after its turn."""

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
    """A map after another."""

    base: Projection
    plane_map: Polynomials

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.base(lon, lat)
        return self.plane_map.at(x, y)[:2]


@dataclass(frozen=True, eq=False)
class BoxPolynomials:
    """x, y in metres as sums of T_i(s) T_j(t), Chebyshev's polynomials, with coefficients (2, d + 1, d + 1).

    s and t go from -1 to 1 from west to east and from south to north of a box in degrees. Beyond it there is nothing.
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
        """The map followed by a turn and a shift of x + i y."""
        c, s = turn.real, turn.imag
        coefficients = np.tensordot(np.array([[c, -s], [s, c]]), self.coefficients, axes=1)
        coefficients[:, 0, 0] += (shift.real, shift.imag)
        return BoxPolynomials(self.box, coefficients)


def box_gradients(box: Sides, degree: int, lon: FloatArray, lat: FloatArray, ellipsoid: Ellipsoid) -> FloatArray:
    """Derivatives (n, (degree + 1)^2, 2) of T_i(s) T_j(t) by metres to the east and north, T_0 T_0 the first."""
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
