"""The symmetric positive definite matrices SPD(n) with the Fisher (affine-invariant) metric.

<V, W>_P = tr(P^-1 V P^-1 W); the distance d_F(P, Q) is the root of the sum of ln^2 over the eigenvalues of P^-1 Q, and
d_F(A A^T, B B^T) is twice the Fisher distortion of A^-1 B (D. Ozeri, "Riemannian Geometry Approach for Minimizing
Distortion and its Applications"; Bhatia 2007, Positive Definite Matrices, chapter 6). All goes through factors,
P = L L^T: products square the condition and lose what factors keep. Matrices stand on the trailing axes, (..., n, n),
and the leading ones broadcast.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.matrices.distortions import principal_scales

__all__ = [
    "distance",
    "exp",
    "factor_distance",
    "from_lower",
    "geodesic",
    "log",
    "lower_factor",
    "lower_metric",
    "lq",
    "metric",
    "place",
    "symmetric_exp",
    "to_lower",
    "transposed",
]

_ASYMMETRY = 1e-8  # of the largest entry: more is no rounding


# ---- factors --------------------------------------------------------------------------------


def lq(A: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """The unique factors of A = L Q: L lower triangular with a positive diagonal, Q orthogonal.

    L is the Cholesky factor of A A^T. Raises ValueError, with the index, where A is singular or not finite.
    """
    A = _check_square(A)
    _refuse(np.asarray(~np.isfinite(A).all(axis=(-1, -2))), "finite and invertible")
    Q, R = np.linalg.qr(transposed(A))
    diagonal = np.einsum("...kk->...k", R)
    _refuse((diagonal == 0).any(axis=-1), "finite and invertible")
    signs = np.sign(diagonal)[..., None, :]
    return transposed(R) * signs, transposed(Q * signs)


def lower_factor(A: FloatArray) -> FloatArray:
    """L of A = L Q without Q and without checks."""
    L = transposed(np.asarray(np.linalg.qr(transposed(A), mode="r")))
    return np.asarray(L * np.where(np.einsum("...kk->...k", L) < 0, -1.0, 1.0)[..., None, :])


def to_lower(P: ArrayLike) -> FloatArray:
    """The Cholesky map: L with P = L L^T, lower triangular with a positive diagonal.

    Raises ValueError, with the index, where P is not symmetric and positive definite.
    """
    P = _check_square(P)
    must = "symmetric and positive definite"
    with np.errstate(invalid="ignore"):
        gap = np.abs(P - transposed(P)).max(axis=(-1, -2))
    _refuse(~(gap <= _ASYMMETRY * np.abs(P).max(axis=(-1, -2))), must)
    try:
        return np.asarray(np.linalg.cholesky(P), dtype=float)
    except np.linalg.LinAlgError:
        _refuse(~(np.linalg.eigvalsh(P)[..., 0] > 0), must)
        raise


def from_lower(L: ArrayLike) -> FloatArray:
    """The inverse of the Cholesky map: P = L L^T."""
    L = _check_square(L)
    return L @ transposed(L)


# ---- the metric -----------------------------------------------------------------------------


def metric(P: ArrayLike, V: ArrayLike, W: ArrayLike) -> FloatArray:
    """The inner product tr(P^-1 V P^-1 W) of symmetric tangents V, W at P, shape (...)."""
    L = to_lower(P)
    return np.asarray(np.einsum("...ij,...ij->...", _whiten(L, V), _whiten(L, W)))


def lower_metric(L: ArrayLike, X: ArrayLike, Y: ArrayLike) -> FloatArray:
    """The metric pulled back by L -> L L^T: of lower triangular tangents X, Y at L, shape (...).

    With Z = L^-1 X and the same for Y it is the trace of the product of Z + Z^T and its like.
    """
    L = _check_square(L)
    Z, W = _solve(L, _check_square(X)), _solve(L, _check_square(Y))
    return np.asarray(np.einsum("...ij,...ij->...", Z + transposed(Z), W + transposed(W)))


def distance(P: ArrayLike, Q: ArrayLike) -> FloatArray:
    """The Fisher distance sqrt(sum ln^2 lambda(P^-1 Q)), shape (...)."""
    return factor_distance(to_lower(P), to_lower(Q))


def factor_distance(A: ArrayLike, B: ArrayLike) -> FloatArray:
    """The Fisher distance of A A^T and B B^T for any A, B in GL(n): 2 Dist_F(A^-1 B), shape (...)."""
    scales = principal_scales(_solve(_check_square(A), _check_square(B)))
    return 2.0 * np.sqrt(np.sum(np.log(scales) ** 2, axis=-1))


def geodesic(P: ArrayLike, Q: ArrayLike, t: ArrayLike) -> FloatArray:
    """The point at `t` of the geodesic from P (t = 0) to Q (t = 1); t of shape (...) broadcasts."""
    L = to_lower(P)
    U, scales, _ = np.linalg.svd(_solve(L, to_lower(Q)))
    return from_lower(L @ (U * scales[..., None, :] ** np.asarray(t, dtype=float)[..., None, None]))


def exp(P: ArrayLike, V: ArrayLike) -> FloatArray:
    """The end of the geodesic that leaves P with the symmetric velocity V, at time 1."""
    L = to_lower(P)
    return from_lower(L @ symmetric_exp(0.5 * _whiten(L, V))[0])


def log(P: ArrayLike, Q: ArrayLike) -> FloatArray:
    """The velocity at P of the geodesic that reaches Q at time 1: the inverse of `exp`."""
    L = to_lower(P)
    U, scales, _ = np.linalg.svd(_solve(L, to_lower(Q)))
    M = L @ U
    return np.asarray((M * (2.0 * np.log(scales))[..., None, :]) @ transposed(M))


# ---- small tools ----------------------------------------------------------------------------


def transposed(A: FloatArray) -> FloatArray:
    """A with its last two axes exchanged."""
    return A.swapaxes(-1, -2)


def symmetric_exp(V: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The exponentials of symmetric matrices V and of -V."""
    values, U = np.linalg.eigh(V)
    scales = np.exp(values)[..., None, :]
    return (U * scales) @ transposed(U), (U / scales) @ transposed(U)


def place(wrong: BoolArray) -> str:
    """Where the first true one stands, for messages: ` at index 3`, ` at index (1, 3)`, or nothing for a single one."""
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    return "" if not index else f" at index {index[0] if len(index) == 1 else index}"


def _whiten(L: FloatArray, V: ArrayLike) -> FloatArray:
    """L^-1 V L^-T for a symmetric V."""
    return _solve(L, transposed(_solve(L, _check_square(V))))


def _solve(A: FloatArray, B: FloatArray) -> FloatArray:
    """A^-1 B. Stacked alike, since numpy below 2 takes a B with one axis less than A has for vectors."""
    B = np.broadcast_to(B, (*np.broadcast_shapes(A.shape[:-2], B.shape[:-2]), *B.shape[-2:]))
    return np.asarray(np.linalg.solve(A, B), dtype=float)


def _check_square(A: ArrayLike) -> FloatArray:
    A = np.asarray(A, dtype=float)
    if A.ndim < 2 or A.shape[-1] != A.shape[-2] or A.shape[-1] == 0:
        raise ValueError(f"Invalid shape {A.shape} of a matrix. It must be (..., n, n).")
    return A


def _refuse(wrong: BoolArray, must: str) -> None:
    if wrong.any():
        raise ValueError(f"Invalid matrix{place(wrong)}. It must be {must}.")
