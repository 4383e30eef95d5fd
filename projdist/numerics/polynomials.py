"""Polynomials on Gauss nodes of a square, orthonormal polynomials over weighted points, and harmonic fits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.numerics.minima import least_largest

ORDER = 10
NODES, WEIGHTS = np.polynomial.legendre.leggauss(ORDER)
PLANE_WEIGHTS = WEIGHTS[:, None] * WEIGHTS


# D with (D f)_i = f'(x_i) for polynomials through the nodes (Berrut & Trefethen 2004, section 9.3).
_GAP = NODES[:, None] - NODES[None, :] + np.eye(ORDER)
_BARYCENTRIC = 1.0 / np.prod(_GAP, axis=1)
DIFFERENTIATE = (_BARYCENTRIC[None, :] / _BARYCENTRIC[:, None]) / _GAP
np.fill_diagonal(DIFFERENTIATE, 0.0)
np.fill_diagonal(DIFFERENTIATE, -DIFFERENTIATE.sum(axis=1))
# From values at the nodes to Legendre coefficients.
LEGENDRE = (np.arange(ORDER) + 0.5)[:, None] * np.polynomial.legendre.legvander(NODES, ORDER - 1).T * WEIGHTS


def interpolate(values: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Values (n, m) at points r, s (m,) in [-1, 1] from values (n, p, p) at the nodes."""
    at_r, at_s = (np.polynomial.legendre.legvander(t, ORDER - 1) @ LEGENDRE for t in (r, s))
    both = (at_r[:, :, None] * at_s[:, None, :]).reshape(len(r), -1)
    return values.reshape(len(values), -1) @ both.T


# ---- graded polynomials --------------------------------------------------------------------------


@dataclass(frozen=True)
class PlanePolynomials:
    """Graded polynomials of x, y in about [-1, 1], orthonormal over weighted points (n,)."""

    degree: int
    values: FloatArray  # (n, m), at these points; the first polynomial is constant
    gradients: FloatArray  # (n, m, 2)
    recurrence: tuple[tuple[int, int, FloatArray, float], ...]  # variable, parent, overlaps, norm

    @classmethod
    def over(cls, x: FloatArray, y: FloatArray, weights: FloatArray, degree: int) -> PlanePolynomials:
        """The polynomials up to a degree over points; raises ValueError if the points do not determine them."""
        count = (degree + 1) * (degree + 2) // 2
        root = np.sqrt(weights / weights.sum())
        variables = np.stack([x, y])
        values, gradients = np.empty((count, x.size)), np.zeros((count, 2, x.size))
        values[0] = 1.0
        recurrence: list[tuple[int, int, FloatArray, float]] = []
        for k, (variable, parent) in enumerate(_steps(degree), start=1):
            gradient = variables[variable] * gradients[parent]
            gradient[variable] += values[parent]
            values[k], overlaps, norm = _orthonormal(variables[variable] * values[parent], values[:k], root, degree)
            gradients[k] = (gradient - np.tensordot(overlaps, gradients[:k], axes=1)) / norm
            recurrence.append((variable, parent, overlaps, norm))
        return cls(degree, values.T, np.moveaxis(gradients, -1, 0), tuple(recurrence))

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (n, m) and gradients (n, m, 2) at other points."""
        count = len(self.recurrence) + 1
        variables = np.stack([x, y])
        values, gradients = np.empty((count, x.size)), np.zeros((count, 2, x.size))
        values[0] = 1.0
        for k, (variable, parent, overlaps, norm) in enumerate(self.recurrence, start=1):
            gradient = variables[variable] * gradients[parent]
            gradient[variable] += values[parent]
            values[k] = (variables[variable] * values[parent] - overlaps @ values[:k]) / norm
            gradients[k] = (gradient - np.tensordot(overlaps, gradients[:k], axes=1)) / norm
        return values.T, np.moveaxis(gradients, -1, 0)

    def powers(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients (..., d + 1, d + 1) of x^i y^j from coefficients (..., m) of these polynomials."""
        size = self.degree + 1
        basis = np.zeros((len(self.recurrence) + 1, size, size))
        basis[0, 0, 0] = 1.0
        for k, (variable, parent, overlaps, norm) in enumerate(self.recurrence, start=1):
            basis[k] = (np.roll(basis[parent], 1, axis=variable) - np.tensordot(overlaps, basis[:k], axes=1)) / norm
        return np.tensordot(coefficients, basis, axes=1)


def _orthonormal(value: Any, before: Any, root: FloatArray, degree: int) -> tuple[Any, Any, float]:
    """A value (n,) made orthonormal to the rows before it, its overlaps and its norm; `root`: roots of the weights."""
    size = float(np.linalg.norm(value * root))
    overlaps = np.zeros(len(before), dtype=value.dtype)
    for _ in range(2):  # passes of Gram-Schmidt, for orthogonality to rounding
        part = (before.conj() * root) @ (value * root)
        value = value - part @ before
        overlaps += part
    norm = float(np.linalg.norm(value * root))
    if not norm > 1e-10 * size:
        raise ValueError(f"{value.size} points do not tell polynomials of degree {degree} apart.")
    return value / norm, overlaps, norm


def _steps(degree: int) -> list[tuple[int, int]]:
    """The variable and the earlier polynomial whose product each polynomial but the first is made from."""
    # Those of a degree are x times all of the degree below, and y times the last of these.
    steps, first = [], 0
    for d in range(1, degree + 1):
        steps += [(0, first + k) for k in range(d)] + [(1, first + d - 1)]
        first += d
    return steps


@dataclass(frozen=True)
class ComplexPolynomials:
    """Polynomials of complex z, |z| up to about 1, orthonormal over weighted points (n,)."""

    values: Any  # (n, m), at these points
    recurrence: tuple[tuple[Any, float], ...]  # overlaps, norm

    @classmethod
    def over(cls, z: Any, weights: FloatArray, degree: int) -> ComplexPolynomials:
        """The polynomials up to a degree over points; raises ValueError if the points do not determine them."""
        root = np.sqrt(weights / weights.sum())
        values = np.empty((degree + 1, z.size), dtype=complex)
        values[0] = 1.0
        recurrence = []
        for k in range(1, degree + 1):
            values[k], overlaps, norm = _orthonormal(z * values[k - 1], values[:k], root, degree)
            recurrence.append((overlaps, norm))
        return cls(values.T, tuple(recurrence))

    def at(self, z: Any) -> Any:
        """Values (n, m) at other points."""
        values = np.empty((len(self.recurrence) + 1, z.size), dtype=complex)
        values[0] = 1.0
        for k, (overlaps, norm) in enumerate(self.recurrence, start=1):
            values[k] = (z * values[k - 1] - overlaps @ values[:k]) / norm
        return values.T

    def powers(self, coefficients: Any) -> Any:
        """Coefficients (m,) of z^k from coefficients (m,) of these polynomials."""
        count = len(self.recurrence) + 1
        basis = np.eye(1, count, dtype=complex).repeat(count, axis=0)
        for k, (overlaps, norm) in enumerate(self.recurrence, start=1):
            basis[k] = (np.roll(basis[k - 1], 1) - overlaps @ basis[:k]) / norm
        return coefficients @ basis


# ---- harmonic fits -------------------------------------------------------------------------------

_ROUNDS = 200  # of reweighting; some twenty suffice
_SETTLED = 1e-10  # relative to the largest residual


@dataclass(frozen=True)
class HarmonicFit:
    """A fit by Re p, the real part of a polynomial."""

    powers: Any  # coefficients (degree + 1,) of z^k in p
    rest: FloatArray  # residuals (n,), values + Re p


def fit_harmonic(z: Any, values: FloatArray, weights: FloatArray, degree: int, norm: float = 2.0) -> HarmonicFit:
    """The polynomial p with the least weighted sum of |values + Re p|^norm over points z (n,), |z| up to about 1."""
    # Points of weight 0 count for an infinite norm only. Raises ValueError if the points do not determine p.
    counts = weights > 0.0
    basis = ComplexPolynomials.over(z[counts], weights[counts], degree)
    at = basis.at(z)
    columns = np.hstack([at.real, at.imag[:, 1:]])  # they span Re p: a constant, then real and imaginary parts
    if np.isinf(norm):
        found = least_largest(columns, values)
    else:
        found = _by_norm(columns[counts], values[counts], weights[counts], norm)
    powers = basis.powers(found[: degree + 1] - 1j * np.append(0.0, found[degree + 1 :]))
    powers[0] = powers[0].real  # its imaginary part does not matter
    return HarmonicFit(powers, values + columns @ found)


def _by_norm(columns: FloatArray, values: FloatArray, weights: FloatArray, norm: float) -> FloatArray:
    """Least squares, iteratively reweighted for norms above 2."""
    rest, found = values, np.zeros(columns.shape[1])
    for turn in range(_ROUNDS):
        root = np.sqrt(weights * (np.abs(rest) / np.abs(rest).max(initial=1e-300)) ** (norm - 2.0) + 1e-14 * weights)
        new = np.linalg.lstsq(columns * root[:, None], -values * root, rcond=None)[0]
        if norm == 2.0:
            return new
        # From the second round on these are Newton's steps, which are shorter.
        change = (new - found) * (1.0 if turn == 0 else 1.0 / (norm - 1.0))
        found = found + change
        rest = values + columns @ found
        if np.abs(columns @ change).max() <= _SETTLED * np.abs(rest).max():
            break
    return found
