"""Polynomials through 10 x 10 Gauss nodes on the square [-1, 1]^2: derivatives, coefficients, values elsewhere."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray

ORDER = 10
NODES, WEIGHTS = np.polynomial.legendre.leggauss(ORDER)
PLANE_WEIGHTS = WEIGHTS[:, None] * WEIGHTS


def _differentiation_matrix(x: FloatArray) -> FloatArray:
    """D with (D f)_i = f'(x_i) for polynomials through the nodes (Berrut & Trefethen 2004, section 9.3)."""
    gap = x[:, None] - x[None, :] + np.eye(len(x))
    barycentric = 1.0 / np.prod(gap, axis=1)
    D = (barycentric[None, :] / barycentric[:, None]) / gap
    np.fill_diagonal(D, 0.0)
    np.fill_diagonal(D, -D.sum(axis=1))
    return D


DIFFERENTIATE = _differentiation_matrix(NODES)
# Values at the nodes to Legendre coefficients.
LEGENDRE = (np.arange(ORDER) + 0.5)[:, None] * np.polynomial.legendre.legvander(NODES, ORDER - 1).T * WEIGHTS


def interpolate(values: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Values at the nodes (n, p, p) to values at points r, s (m,) in [-1, 1]: shape (n, m)."""
    at_r, at_s = (np.polynomial.legendre.legvander(t, ORDER - 1) @ LEGENDRE for t in (r, s))
    both = (at_r[:, :, None] * at_s[:, None, :]).reshape(len(r), -1)
    return values.reshape(len(values), -1) @ both.T
