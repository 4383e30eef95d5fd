"""The mean distorting transformation (MDT) of 2 x 2 matrices.

Among all linear maps T, the MDT is the one that minimises the weighted mean of
Dist_F(T^-1 A_i)^2, Dist_F the Fisher distortion (D. Ozeri, "Riemannian Geometry Approach for
Minimizing Distortion and its Applications"). It is the Cholesky factor of the Frechet mean of
A_i A_i^T. The space of these matrices is a line (ln sqrt |det A|, whose mean is the plain one)
times the hyperbolic plane, here the upper half-plane of points (X, Y) = (l21, l22) / l11 with
l the lower-triangular LQ factor of A; no product A A^T is formed, so no condition is squared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray

__all__ = ["MDT", "mdt"]

_MAX_STEPS = 50  # Newton takes 3 to 6


@dataclass(frozen=True)
class MDT:
    """`T`, lower triangular with a positive diagonal, and `distances`: Dist_F(T^-1 A_i)^2, shape (N,)."""

    T: FloatArray
    cost: float
    distances: FloatArray


def mdt(A: ArrayLike, weights: ArrayLike | None = None) -> MDT:
    """The mean distorting transformation of matrices A of shape (N, 2, 2), weights of shape (N,).

    `cost` is the weighted mean of `distances`. Raises ValueError for singular or non-finite
    matrices, and for weights that are negative or all zero.
    """
    A = np.asarray(A, dtype=float)
    if A.ndim != 3 or A.shape[1:] != (2, 2) or len(A) == 0:
        raise ValueError(f"Invalid shape {A.shape} of matrices. It must be (N, 2, 2) with N at least 1.")
    w = _check_weights(weights, len(A))
    with np.errstate(invalid="ignore", over="ignore"):
        row = A[:, 0, 0] ** 2 + A[:, 0, 1] ** 2
        det = np.abs(A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0])
    bad = np.flatnonzero(~(np.isfinite(A).all(axis=(1, 2)) & (det > 0)))
    if bad.size:
        raise ValueError(f"Invalid matrix at index {bad[0]}. It must be finite and invertible.")
    u = 0.5 * np.log(det)
    x = (A[:, 0, 0] * A[:, 1, 0] + A[:, 0, 1] * A[:, 1, 1]) / row
    y = det / row
    u_mean = _mean(w, u)
    x_mean, y_mean, r = _hyperbolic_mean(x, y, w)
    l11 = np.exp(u_mean) / np.sqrt(y_mean)
    T = np.array([[l11, 0.0], [x_mean * l11, y_mean * l11]])
    distances = 2.0 * (u - u_mean) ** 2 + 0.5 * r * r
    return MDT(T, _mean(w, distances), distances)


def _check_weights(weights: ArrayLike | None, count: int) -> FloatArray:
    if weights is None:
        return np.full(count, 1.0 / count)
    w = np.asarray(weights, dtype=float)
    if w.shape != (count,):
        raise ValueError(f"Invalid shape {w.shape} of weights. It must be ({count},), as many as matrices.")
    if not (np.isfinite(w).all() and (w >= 0).all() and w.any()):
        raise ValueError("Invalid weights. They must be finite, not negative, and not all zero.")
    return np.asarray(w / w.sum())


def _mean(w: FloatArray, values: FloatArray) -> float:
    # Not w @ values: threads of a BLAS take longer to start than the sum does.
    return float(np.einsum("i,i->", w, values))


def _hyperbolic_mean(x: FloatArray, y: FloatArray, w: FloatArray) -> tuple[float, float, FloatArray]:
    """The Frechet mean of points of the upper half-plane by Newton steps, and the distances to it."""
    x0, y0 = _mean(w, x), float(np.exp(_mean(w, np.log(y))))
    previous = np.inf
    for _ in range(_MAX_STEPS):
        # An isometry puts the present point at i; sinh(r) times the direction to (p, q) is (s1, s2).
        p, q = (x - x0) / y0, y / y0
        s1, s2 = p / q, (p * p + (q - 1.0) * (q + 1.0)) / (2.0 * q)
        sinh = np.hypot(s1, s2)
        r = np.arcsinh(sinh)
        with np.errstate(invalid="ignore", divide="ignore"):
            r_over_sinh = np.where(sinh > 0, r / sinh, 1.0)
            n1, n2 = np.where(sinh > 0, [s1, s2] / sinh, 0.0)
        g1, g2 = _mean(w, r_over_sinh * s1), _mean(w, r_over_sinh * s2)
        size = np.hypot(g1, g2)
        # Below the rounding of the sum the gradient is noise: it stops falling.
        if size <= 1e-15 * (1.0 + _mean(w, r)) or (size < 1e-8 and size >= 0.5 * previous):
            break
        previous = size
        # The Hessian of r^2 / 2 is 1 along the geodesic and r coth r across it.
        across = r_over_sinh * np.hypot(1.0, sinh)
        h11 = _mean(w, across + (1.0 - across) * n1 * n1)
        h22 = _mean(w, across + (1.0 - across) * n2 * n2)
        h12 = _mean(w, (1.0 - across) * n1 * n2)
        det = h11 * h22 - h12 * h12
        d1, d2 = (h22 * g1 - h12 * g2) / det, (h11 * g2 - h12 * g1) / det
        step = np.hypot(d1, d2)
        height = 1.0 / (np.cosh(step) - d2 * np.sinh(step) / step)
        x0 += y0 * d1 * np.sinh(step) / step * height
        y0 *= height
    return x0, y0, r
