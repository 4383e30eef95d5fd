"""Symmetric positive definite matrices with the Fisher (affine-invariant) metric: distances, geodesics, means."""

from __future__ import annotations

import numpy as np

from projdist._typing import ArrayLike, FloatArray
from projdist.matrices.mean_transformation import mdt
from projdist.matrices.measures import principal_scales
from projdist.matrices.whitened_sets import check_square, lq, refuse, solve, symmetric_exp, transposed

__all__ = [
    "distance",
    "exp",
    "factor_distance",
    "from_lower",
    "geodesic",
    "log",
    "lower_metric",
    "lq",
    "mean",
    "metric",
    "to_lower",
]

_ASYMMETRY = 1e-8  # of the largest entry: a larger difference is not rounding


def mean(P: ArrayLike, weights: ArrayLike | None = None, *, method: str = "auto") -> FloatArray:
    """The mean of SPD matrices (..., N, n, n): the matrix of least weighted mean squared distance from them.

    Weights and methods are those of `projdist.mdt`, whose T is the Cholesky factor of this mean, and which gives its
    accuracy, too. Raises ValueError, with the index, where P is not symmetric and positive definite.
    """
    return from_lower(mdt(to_lower(P), weights, method=method).T)


def to_lower(P: ArrayLike) -> FloatArray:
    """The Cholesky map: L with P = L L^T, lower triangular with a positive diagonal; ValueError where P is not SPD."""
    P = check_square(P)
    must = "symmetric and positive definite"
    with np.errstate(invalid="ignore"):
        gap = np.abs(P - transposed(P)).max(axis=(-1, -2))
    refuse(~(gap <= _ASYMMETRY * np.abs(P).max(axis=(-1, -2))), must)
    try:
        return np.asarray(np.linalg.cholesky(P), dtype=float)
    except np.linalg.LinAlgError:
        refuse(~(np.linalg.eigvalsh(P)[..., 0] > 0), must)
        raise


def from_lower(L: ArrayLike) -> FloatArray:
    """The inverse of the Cholesky map: P = L L^T."""
    L = check_square(L)
    return L @ transposed(L)


def metric(P: ArrayLike, V: ArrayLike, W: ArrayLike) -> FloatArray:
    """The inner product tr(P^-1 V P^-1 W) of symmetric tangents V, W at P, shape (...)."""
    L = to_lower(P)
    return np.asarray(np.einsum("...ij,...ij->...", _whiten(L, V), _whiten(L, W)))


def lower_metric(L: ArrayLike, X: ArrayLike, Y: ArrayLike) -> FloatArray:
    """The metric pulled back by L -> L L^T: the inner product of lower triangular tangents X, Y at L, shape (...)."""
    L = check_square(L)
    Z, W = solve(L, check_square(X)), solve(L, check_square(Y))
    return np.asarray(np.einsum("...ij,...ij->...", Z + transposed(Z), W + transposed(W)))


def distance(P: ArrayLike, Q: ArrayLike) -> FloatArray:
    """The Fisher distance sqrt(sum ln^2 lambda(P^-1 Q)), shape (...)."""
    return factor_distance(to_lower(P), to_lower(Q))


def factor_distance(A: ArrayLike, B: ArrayLike) -> FloatArray:
    """The Fisher distance of A A^T and B B^T for any A, B in GL(n): 2 Dist_F(A^-1 B), shape (...)."""
    scales = principal_scales(solve(check_square(A), check_square(B)))
    return 2.0 * np.sqrt(np.sum(np.log(scales) ** 2, axis=-1))


def geodesic(P: ArrayLike, Q: ArrayLike, t: ArrayLike) -> FloatArray:
    """The point at `t` of the geodesic from P (t = 0) to Q (t = 1); t of shape (...) broadcasts."""
    L = to_lower(P)
    U, scales, _ = np.linalg.svd(solve(L, to_lower(Q)))
    return from_lower(L @ (U * scales[..., None, :] ** np.asarray(t, dtype=float)[..., None, None]))


def exp(P: ArrayLike, V: ArrayLike) -> FloatArray:
    """The end of the geodesic that leaves P with the symmetric velocity V, at time 1."""
    L = to_lower(P)
    return from_lower(L @ symmetric_exp(0.5 * _whiten(L, V))[0])


def log(P: ArrayLike, Q: ArrayLike) -> FloatArray:
    """The velocity at P of the geodesic that reaches Q at time 1: the inverse of `exp`."""
    L = to_lower(P)
    U, scales, _ = np.linalg.svd(solve(L, to_lower(Q)))
    M = L @ U
    return np.asarray((M * (2.0 * np.log(scales))[..., None, :]) @ transposed(M))


def _whiten(L: FloatArray, V: ArrayLike) -> FloatArray:
    """L^-1 V L^-T for a symmetric V."""
    return solve(L, transposed(solve(L, check_square(V))))
