"""Frechet means of matrices of any size in the affine-invariant metric, by named algorithms.

All take A of shape (B, N, n, n), B sets of N matrices, weights w of shape (B, N) and sum 1, and a start T of shape
(B, n, n), best `middle`'s; `METHODS` lists them. They work on the factors A_i and never form A_i A_i^T without T^-1
around it. At the mean the logarithms of T^-1 A_i A_i^T T^-T have the weighted mean 0 (Karcher's equation).

Sources: Bini & Iannazzo 2013, Computing the Karcher mean of symmetric positive definite matrices, Linear Algebra and
its Applications 438 (gradient); Congedo, Barachant & Bhatia 2017, Fixed point algorithms for estimating power means of
positive definite matrices, IEEE Transactions on Signal Processing 65 (mpm); Lin 2019, Riemannian geometry of symmetric
positive definite matrices via Cholesky decomposition, and Arsigny, Fillard, Pennec & Ayache 2007, Geometric means in a
novel vector space structure, both SIAM Journal on Matrix Analysis and Applications (log_cholesky, log_euclidean).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.matrices.frechet_sets import EPS, JacobiSet, LapackSets, View, Whitened, pieces
from projdist.matrices.spd import lower_factor, symmetric_exp, transposed

__all__ = ["METHODS", "Mean", "damping", "gradient", "middle", "newton", "settled"]

_NEWTON_STEPS = 100  # 3 to 5 do, from far away some 15
_GRADIENT_STEPS = 1000  # some 15; conditions of 1e6 take 300
# Where the Jacobi rotations of many matrices at once are faster than a LAPACK call for each.
_SMALL, _MANY = 4, 256
_POOR = 100.0  # of |T^-1| |T|, which a scaling of rows does not change: from here on a refinement is worth its price


class Mean(NamedTuple):
    """The means T of B sets of N matrices and how good they are."""

    T: FloatArray  # (B, n, n), lower triangular with a positive diagonal
    cost: FloatArray  # (B,), the weighted mean of the distances
    gradient_norm: FloatArray  # (B,), of the weighted mean of ln(T^-1 A_i A_i^T T^-T)
    iterations: IntArray  # (B,)
    floor: FloatArray  # (B,), the gradient's rounding: n eps times the mean of cosh r, r the log of a condition
    distances: FloatArray  # (B, N), Dist_F(T^-1 A_i)^2


def newton(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """Newton's method with the exact Hessian."""
    if A.shape[-1] in range(3, _SMALL + 1) and A.shape[1] >= _MANY:
        one = [slice(b, b + 1) for b in range(len(A))]
        found = [_descend(JacobiSet(A[b], w[b], start[b]), _newton_step, _NEWTON_STEPS) for b in one]
        mean = Mean(*(np.concatenate(parts) for parts in zip(*found, strict=True)))
    else:
        mean = _descend(LapackSets(A, w, start), _newton_step, _NEWTON_STEPS)
    return _refined(A, w, mean)


def gradient(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The gradient method with the automatic step 2 / (1 + mean of r coth r) (Bini & Iannazzo 2013)."""
    return _refined(A, w, _descend(LapackSets(A, w, start), _gradient_step, _GRADIENT_STEPS))


def _newton_step(sets: Whitened, view: View) -> FloatArray:
    V = sets.newton_step(view.logarithm)
    if np.abs(V).max() * V.shape[-1] < 1.0:
        return V  # no eigenvalue of which is above 1
    values = np.linalg.eigvalsh(V)
    return V * damping(0.5 * (values[:, -1] - values[:, 0]), view.bend)[:, None, None]


def _gradient_step(_: Whitened, view: View) -> FloatArray:
    return view.logarithm * (2.0 / (1.0 + view.bend))[:, None, None]


def damping(length: FloatArray, bend: FloatArray) -> FloatArray:
    """The part of a long Newton step to take, for its length in the hyperbolic plane and the mean of r coth r.

    Along a geodesic of unit speed the third derivative of the cost is at most twice the second, and far less where the
    points are near (bend 1); ln(1 + b) / b is the step that such a bound allows. Half of it is found to be enough.
    """
    b = np.maximum(length * (1.0 - 1.0 / bend), 1.0)
    return np.asarray(np.where(b > 1.0, np.log1p(b) / b, 1.0))


def settled(size: FloatArray, previous: FloatArray, floor: FloatArray) -> BoolArray:
    """Whether a gradient is rounding: below the floor, or near it and no longer falling.

    The floor bounds what is mostly less, and matrices far apart raise it without end: then 1e-6 stands in for it.
    """
    return (size <= np.minimum(floor, 1e-6)) | ((size <= np.minimum(4.0 * floor, 1e-4)) & (size > 0.5 * previous))


def _descend(sets: Whitened, step: Callable[[Whitened, View], FloatArray], limit: int) -> Mean:
    """Steps until each set has settled; one that made the cost rise is taken back by half."""
    b, n, _ = sets.T.shape
    active, iterations = np.ones(b, dtype=bool), np.zeros(b, dtype=int)
    best, previous, V = np.full(b, np.inf), np.full(b, np.inf), np.zeros((b, n, n))
    for count in range(limit + 1):
        view = sets.look()
        size, floor = np.linalg.norm(view.logarithm, axis=(-1, -2)), _floor(view)
        active &= ~settled(size, previous, floor)
        if count == limit or not active.any():
            break
        risen = active & (view.cost > best * (1.0 + 1e-9) + 10.0 * floor * np.sqrt(view.cost))
        fresh = active & ~risen
        view = view._replace(logarithm=np.where(fresh[:, None, None], view.logarithm, 0.0))
        V = np.where(risen[:, None, None], -0.5 * V, step(sets, view))
        best, previous = np.where(fresh, view.cost, best), np.where(fresh, size, previous)
        iterations += active
        sets.move(V)
    return Mean(lower_factor(sets.T), view.cost, size, iterations, floor, view.distances)


def _floor(view: View) -> FloatArray:
    """What rounding may leave of the gradient."""
    return 2.0 * view.logarithm.shape[-1] * EPS * (view.cosh + np.sqrt(view.cost))


def _refined(A: FloatArray, w: FloatArray, mean: Mean) -> Mean:
    """One more Newton step from T itself, where its condition let the rounding of the steps pile up.

    What remains is the rounding of A and T, some eps times the condition: a third to a tenth of it before.
    """
    poor = (np.abs(np.linalg.inv(mean.T)) @ np.abs(mean.T)).max(axis=(-1, -2)) > _POOR
    if not poor.any():
        return mean
    T = mean.T[poor]
    sets = LapackSets(A[poor], w[poor], T)
    # exp(V / 2) = (1 + K) Q to first order, where the lower triangular K has K + K^T = V.
    K = np.tril(sets.newton_step(sets.look().logarithm))
    np.einsum("bkk->bk", K)[...] *= 0.5
    refined = mean.T.copy()
    refined[poor] += T @ K
    return mean._replace(T=refined, iterations=mean.iterations + poor)


# ---- starts ---------------------------------------------------------------------------------


def middle(A: FloatArray, w: FloatArray) -> tuple[FloatArray, BoolArray]:
    """The midpoint of the arithmetic and the harmonic mean, and where A is singular, shape (B, N).

    Invariant as the Frechet mean is, and near it: ten times nearer than the log-Cholesky mean on matrices of moderate
    spread. Both means come as triangular factors of stacked matrices, so that no condition is squared.
    """
    b, count, n, _ = A.shape
    straight, inverse = np.zeros((b, n, n)), np.zeros((b, n, n))
    wrong = np.zeros((b, count), dtype=bool)
    for part in pieces(A):
        A_inv, wrong[:, part] = _inverses(A[:, part])
        root = np.sqrt(w[:, part])[:, :, None, None]
        straight = _stack(straight, transposed(A[:, part]) * root)
        inverse = _stack(inverse, A_inv * root)
    # With R^T R and S^T S the means of A A^T and of its inverse: S R^T = U s V^T, T = R^T V s^-1/2.
    _, scales, V = np.linalg.svd(inverse @ transposed(straight))
    return transposed(straight) @ (transposed(V) / np.sqrt(scales)[:, None, :]), wrong


def _stack(R: FloatArray, rows: FloatArray) -> FloatArray:
    """The triangular factor of R on top of matrices of shape (B, M, n, n)."""
    b, n, _ = R.shape
    return np.asarray(np.linalg.qr(np.concatenate([R, rows.reshape(b, -1, n)], axis=1), mode="r"))


def _inverses(A: FloatArray) -> tuple[FloatArray, BoolArray]:
    """A^-1, and where a row of A is, to rounding, a combination of the others; there the identity."""
    one = np.eye(A.shape[-1])
    try:
        inverse = np.asarray(np.linalg.inv(A), dtype=float)
    except np.linalg.LinAlgError:
        zero = np.linalg.slogdet(A)[0] == 0
        inverse = np.asarray(np.linalg.inv(np.where(zero[..., None, None], one, A)), dtype=float)
        inverse[zero] = np.inf
    # 1 over a column of the inverse is the distance of a row from the span of the others; here in sums of moduli.
    ratio = np.abs(A).sum(axis=-1) * np.abs(inverse).sum(axis=-2)
    wrong = ~(ratio.max(axis=-1) < 1.0 / EPS)
    inverse[wrong] = one
    return inverse, wrong


# ---- means that are not the Frechet mean ------------------------------------------------------


def _known(A: FloatArray, w: FloatArray, T: FloatArray, iterations: int = 0) -> Mean:
    """What is to be said of means T that were found otherwise."""
    T = lower_factor(T)
    view = LapackSets(A, w, T).look()
    size = np.linalg.norm(view.logarithm, axis=(-1, -2))
    count = np.full(len(T), iterations)
    return Mean(T, view.cost, size, count, _floor(view), view.distances)


def arithmetic(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The arithmetic mean of A_i A_i^T."""
    R = np.zeros_like(start)
    for part in pieces(A):
        R = _stack(R, transposed(A[:, part]) * np.sqrt(w[:, part])[:, :, None, None])
    return _known(A, w, transposed(R))


def log_cholesky(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The mean of the Cholesky factors, their diagonals geometric (Lin 2019)."""
    T, logs = np.zeros_like(start), np.zeros(start.shape[:2])
    for part in pieces(A):
        L = lower_factor(A[:, part])
        T += np.einsum("bi,bikl->bkl", w[:, part], L)
        logs += np.einsum("bi,bik->bk", w[:, part], np.log(np.einsum("bikk->bik", L)))
    np.einsum("bkk->bk", T)[...] = np.exp(logs)
    return _known(A, w, T)


def log_euclidean(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """exp of the mean of ln(A_i A_i^T) (Arsigny et al. 2007)."""
    logs = np.zeros_like(start)
    for part in pieces(A):
        U, scales, _ = np.linalg.svd(A[:, part])
        logs += np.einsum("bi,bija,bia,bika->bjk", w[:, part], U, np.log(scales), U, optimize=True)
    return _known(A, w, symmetric_exp(logs)[0])


_ORDER = 0.01  # of the two power means whose midpoint `mpm` takes; their distance is of this size, its error the square
_POWER_STEPS, _POWER_TOLERANCE = 500, 1e-12


def mpm(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The midpoint of the power means of orders 0.01 and -0.01 (Congedo, Barachant & Bhatia 2017).

    Near the Frechet mean only: off by 1e-5 where conditions are below 100, by more where matrices lie farther apart.
    """
    (above, up), (below, down) = (_power_mean(A, w, start, order) for order in (_ORDER, -_ORDER))
    U, scales, _ = np.linalg.svd(np.linalg.solve(above, below))
    return _known(A, w, above @ (U * np.sqrt(scales)[:, None, :]), up + down)


def _power_mean(A: FloatArray, w: FloatArray, T: FloatArray, order: float) -> tuple[FloatArray, int]:
    """T with the mean of (T^-1 A_i A_i^T T^-T)^order = 1, by the fixed point of that paper, and the steps it took."""
    for count in range(_POWER_STEPS):  # noqa: B007 the steps taken
        inverse = np.linalg.inv(T)[:, None]
        power = np.zeros_like(T)
        for part in pieces(A):
            U, scales, _ = np.linalg.svd(inverse @ A[:, part])
            power += np.einsum("bi,bija,bia,bika->bjk", w[:, part], U, scales ** (2.0 * order), U, optimize=True)
        values, U = np.linalg.eigh(power)
        if np.abs(values - 1.0).max() <= _POWER_TOLERANCE:
            break
        # 3/8 of the step that commuting matrices would need; in terms of T T^T it is 3/4.
        T = T @ ((U * values[:, None, :] ** (0.375 / order)) @ transposed(U))
    return T, count


METHODS: dict[str, Callable[[FloatArray, FloatArray, FloatArray], Mean]] = {
    "newton": newton,
    "gradient": gradient,
    "mpm": mpm,
    "log_euclidean": log_euclidean,
    "log_cholesky": log_cholesky,
    "arithmetic": arithmetic,
}
