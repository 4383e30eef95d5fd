"""Harmonic polynomials, the real parts of complex ones, that cancel given values best by a norm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.numerics.graded_polynomials import ComplexPolynomials
from projdist.numerics.minima import least_largest

__all__ = ["HarmonicFit", "fit_harmonic"]

_ROUNDS = 200  # of weights; they settle in some twenty
_SETTLED = 1e-10  # of the largest rest


@dataclass(frozen=True)
class HarmonicFit:
    """Re p with `powers` (degree + 1,) of p by powers of z, and what is left, values + Re p, at all points (n,)."""

    powers: Any
    rest: FloatArray


def fit_harmonic(z: Any, values: FloatArray, weights: FloatArray, degree: int, norm: float = 2.0) -> HarmonicFit:
    """The p of a degree for which the sum of |values + Re p|^norm over points z (n,), |z| <= 1 or so, is least.

    Points of no weight count for an infinite norm only. Raises ValueError for a degree that the points do not resolve.
    """
    counts = weights > 0.0
    basis = ComplexPolynomials.over(z[counts], weights[counts], degree)
    columns = _real_columns(basis.at(z))
    if np.isinf(norm):
        found = least_largest(columns, values)
    else:
        found = _by_norm(columns[counts], values[counts], weights[counts], norm)
    powers = basis.powers(found[: degree + 1] - 1j * np.append(0.0, found[degree + 1 :]))
    powers[0] = powers[0].real  # the rest of it has no real part
    return HarmonicFit(powers, values + columns @ found)


def _real_columns(values: Any) -> FloatArray:
    """Columns (n, 2 degree + 1) of which Re p is a sum: a constant, then real and imaginary parts."""
    return np.hstack([values.real, values.imag[:, 1:]])


def _by_norm(columns: FloatArray, values: FloatArray, weights: FloatArray, norm: float) -> FloatArray:
    """Least squares, whose weights follow what is left where the norm is above 2."""
    rest, found = values, np.zeros(columns.shape[1])
    for turn in range(_ROUNDS):
        root = np.sqrt(weights * (np.abs(rest) / np.abs(rest).max(initial=1e-300)) ** (norm - 2.0) + 1e-14 * weights)
        new = np.linalg.lstsq(columns * root[:, None], -values * root, rcond=None)[0]
        if norm == 2.0:
            return new
        # From the second round on the steps of Newton, which are shorter.
        change = (new - found) * (1.0 if turn == 0 else 1.0 / (norm - 1.0))
        found = found + change
        rest = values + columns @ found
        if np.abs(columns @ change).max() <= _SETTLED * np.abs(rest).max():
            break
    return found
