"""Polynomials of one complex or two real variables, orthonormal over weighted points, degree by degree.

Each is a variable times an earlier one, less its part along those before it (the Arnoldi process; P. Brubeck,
Y. Nakatsukasa, L. N. Trefethen 2021, SIAM Review 63:405). A fit by them is well conditioned where powers are not, and
the same recurrence gives values, derivatives, and coefficients of powers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray

__all__ = ["ComplexPolynomials", "PlanePolynomials"]

_TWICE = 2  # Gram and Schmidt, so that rounding is orthogonal, too


@dataclass(frozen=True)
class PlanePolynomials:
    """Graded polynomials of x, y in [-1, 1] or so, made orthonormal at points (n,) with weights.

    `values` (n, m) and `gradients` (n, m, 2) are theirs at these points; the first of them is constant.
    """

    degree: int
    values: FloatArray
    gradients: FloatArray
    recurrence: tuple[tuple[int, int, FloatArray, float], ...]  # variable, parent, overlaps, norm

    @classmethod
    def over(cls, x: FloatArray, y: FloatArray, weights: FloatArray, degree: int) -> PlanePolynomials:
        """Those up to a degree over points; raises ValueError where the points do not tell them apart."""
        count = (degree + 1) * (degree + 2) // 2
        root = np.sqrt(weights / weights.sum())
        variables = np.stack([x, y])
        values, gradients = np.empty((count, x.size)), np.zeros((count, 2, x.size))
        values[0] = 1.0
        recurrence: list[tuple[int, int, FloatArray, float]] = []
        for variable, parent in _steps(degree):
            k = len(recurrence) + 1
            value = variables[variable] * values[parent]
            gradient = variables[variable] * gradients[parent]
            gradient[variable] += values[parent]
            size = float(np.linalg.norm(value * root))
            overlaps = np.zeros(k)
            for _ in range(_TWICE):
                part = (values[:k] * root) @ (value * root)
                value = value - part @ values[:k]
                overlaps += part
            norm = float(np.linalg.norm(value * root))
            if not norm > 1e-10 * size:
                raise ValueError(f"{x.size} points do not tell polynomials of degree {degree} apart.")
            gradient -= np.tensordot(overlaps, gradients[:k], axes=1)
            values[k], gradients[k] = value / norm, gradient / norm
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
        """Coefficients (..., d + 1, d + 1) of x^i y^j, of sums of these polynomials with coefficients (..., m)."""
        size = self.degree + 1
        basis = np.zeros((len(self.recurrence) + 1, size, size))
        basis[0, 0, 0] = 1.0
        for k, (variable, parent, overlaps, norm) in enumerate(self.recurrence, start=1):
            basis[k] = (np.roll(basis[parent], 1, axis=variable) - np.tensordot(overlaps, basis[:k], axes=1)) / norm
        return np.tensordot(coefficients, basis, axes=1)


def _steps(degree: int) -> list[tuple[int, int]]:
    """The variable and the earlier polynomial of each but the first: y times the last of a degree, x times all."""
    steps, first = [], 0
    for d in range(1, degree + 1):
        steps += [(0, first + k) for k in range(d)] + [(1, first + d - 1)]
        first += d
    return steps


@dataclass(frozen=True)
class ComplexPolynomials:
    """Polynomials of z, |z| <= 1 or so, made orthonormal at points (n,) with weights; `values` (n, m)."""

    values: Any
    recurrence: tuple[tuple[Any, float], ...]  # overlaps, norm

    @classmethod
    def over(cls, z: Any, weights: FloatArray, degree: int) -> ComplexPolynomials:
        """Those up to a degree over points; raises ValueError where the points do not tell them apart."""
        root = np.sqrt(weights / weights.sum())
        values = np.empty((degree + 1, z.size), dtype=complex)
        values[0] = 1.0
        recurrence = []
        for k in range(1, degree + 1):
            value = z * values[k - 1]
            size = float(np.linalg.norm(value * root))
            overlaps = np.zeros(k, dtype=complex)
            for _ in range(_TWICE):
                part = (values[:k].conj() * root) @ (value * root)
                value = value - part @ values[:k]
                overlaps += part
            norm = float(np.linalg.norm(value * root))
            if not norm > 1e-10 * size:
                raise ValueError(f"{z.size} points do not tell polynomials of degree {degree} apart.")
            values[k] = value / norm
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
        """Coefficients (m,) of z^k of the sum of these polynomials with coefficients (m,)."""
        count = len(self.recurrence) + 1
        basis = np.eye(1, count, dtype=complex).repeat(count, axis=0)
        for k, (overlaps, norm) in enumerate(self.recurrence, start=1):
            basis[k] = (np.roll(basis[k - 1], 1) - overlaps @ basis[:k]) / norm
        return coefficients @ basis
