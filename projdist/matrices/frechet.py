"""Frechet means and geometric medians of matrices of any size in the affine-invariant metric."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.matrices.spd import (
    EPS,
    JacobiSet,
    LapackSets,
    View,
    WhitenedSets,
    logarithms,
    lower_factor,
    pieces,
    symmetric_exp,
    transposed,
)

_NEWTON_STEPS = 100  # 3 to 5 suffice, from far away about 15
_GRADIENT_STEPS = 1000  # about 15 suffice; conditions of 1e6 take 300
# Largest n, and smallest N, for which vectorised Jacobi rotations are faster than LAPACK calls.
_SMALL, _MANY = 4, 256
_POOR = 100.0  # of |T^-1| |T|, invariant under scaling of rows: above it a refinement pays


class Mean(NamedTuple):
    """The means T of B sets of N matrices and their accuracy."""

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


def _newton_step(sets: WhitenedSets, view: View) -> FloatArray:
    V = sets.newton_step(view.logarithm)
    if np.abs(V).max() * V.shape[-1] < 1.0:
        return V  # all eigenvalues are below 1
    values = np.linalg.eigvalsh(V)
    return V * damping(0.5 * (values[:, -1] - values[:, 0]), view.bend)[:, None, None]


def _gradient_step(_: WhitenedSets, view: View) -> FloatArray:
    return view.logarithm * (2.0 / (1.0 + view.bend))[:, None, None]


def damping(length: FloatArray, bend: FloatArray) -> FloatArray:
    """Factor of a long Newton step, by its length in the hyperbolic plane and the mean of r coth r.

    Along a geodesic of unit speed the third derivative of the cost is at most twice the second, and far less where the
    points are near (bend 1); ln(1 + b) / b is the step that such a bound allows. Half of the bound proved enough.
    """
    b = np.maximum(length * (1.0 - 1.0 / bend), 1.0)
    return np.asarray(np.where(b > 1.0, np.log1p(b) / b, 1.0))


def settled(size: FloatArray, previous: FloatArray, floor: FloatArray) -> BoolArray:
    """Mask of gradients that are rounding: below the floor, or near it and no longer falling.

    The floor is a pessimistic bound that grows without limit for matrices far apart: it is capped at 1e-6.
    """
    return (size <= np.minimum(floor, 1e-6)) | ((size <= np.minimum(4.0 * floor, 1e-4)) & (size > 0.5 * previous))


def _descend(sets: WhitenedSets, step: Callable[[WhitenedSets, View], FloatArray], limit: int) -> Mean:
    """Steps until each set has settled; half of a step that raised the cost is undone."""
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
    """Bound of the gradient's rounding."""
    return 2.0 * view.logarithm.shape[-1] * EPS * (view.cosh + np.sqrt(view.cost))


def _refined(A: FloatArray, w: FloatArray, mean: Mean) -> Mean:
    """One more Newton step from T itself if its condition let rounding accumulate over the steps.

    The rounding of A and T remains, some eps times the condition: a third to a tenth of the error before.
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
    """The midpoint of the arithmetic and the harmonic mean, and a mask (B, N) of singular matrices.

    It is affine-invariant like the Frechet mean and near it: ten times nearer than the log-Cholesky mean for moderate
    spread. Both means are computed as triangular factors of stacked matrices, so that no condition is squared.
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
    """A^-1, and a mask of singular matrices, whose inverse is set to the identity."""
    one = np.eye(A.shape[-1])
    try:
        inverse = np.asarray(np.linalg.inv(A), dtype=float)
    except np.linalg.LinAlgError:
        zero = np.linalg.slogdet(A)[0] == 0
        inverse = np.asarray(np.linalg.inv(np.where(zero[..., None, None], one, A)), dtype=float)
        inverse[zero] = np.inf
    # The inverse norm of a column of A^-1 is the distance of a row of A from the span of the others (here 1-norms).
    ratio = np.abs(A).sum(axis=-1) * np.abs(inverse).sum(axis=-2)
    wrong = ~(ratio.max(axis=-1) < 1.0 / EPS)
    inverse[wrong] = one
    return inverse, wrong


# ---- other means ------------------------------------------------------------------------------


def _known(A: FloatArray, w: FloatArray, T: FloatArray, iterations: int = 0) -> Mean:
    """The `Mean` of factors T found by another method."""
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


_ORDER = 0.01  # of the two power means of `mpm`; its error is of the order of the square
_POWER_STEPS, _POWER_TOLERANCE = 500, 1e-12


def mpm(A: FloatArray, w: FloatArray, start: FloatArray) -> Mean:
    """The midpoint of the power means of orders 0.01 and -0.01 (Congedo, Barachant & Bhatia 2017).

    Near the Frechet mean only: off by 1e-5 where conditions are below 100, by more where matrices lie farther apart.
    """
    (above, up), (below, down) = (_power_mean(A, w, start, order) for order in (_ORDER, -_ORDER))
    U, scales, _ = np.linalg.svd(np.linalg.solve(above, below))
    return _known(A, w, above @ (U * np.sqrt(scales)[:, None, :]), up + down)


def _power_mean(A: FloatArray, w: FloatArray, T: FloatArray, order: float) -> tuple[FloatArray, int]:
    """T with the mean of (T^-1 A_i A_i^T T^-T)^order = 1, by that paper's fixed point, and the number of steps."""
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


# ---- geometric medians ---------------------------------------------------------------------------


_STEPS = 500  # about ten suffice; more if many matrices are near the median
_WHOLE = 20  # largest n for which the full Hessian, n (n + 1) / 2 on a side, is used
_SAME = 64.0 * EPS  # times the condition: matrices nearer than that are equal
_FLAT = 1e-12  # of the largest curvature: smaller ones are rounding
_LINE = 1e-6  # of distances: mean distance from a geodesic below which the median is near that on the geodesic
_ENOUGH = 0.05  # of the bound of the gradient's rounding, which is pessimistic
_GAIN = 0.1  # of the gain predicted by the gradient, required of a step
_SEEN = 1e-11  # of a sum of distances: smaller gains are judged by the gradient


class Median(NamedTuple):
    """The medians T of B sets of N matrices and their accuracy."""

    T: FloatArray  # (B, n, n), lower triangular with a positive diagonal
    cost: FloatArray  # (B,), the weighted mean of Dist_F
    gradient_norm: FloatArray  # (B,), of the weighted sum of directions, less the weight of a matrix that is the median
    iterations: IntArray  # (B,)
    floor: FloatArray  # (B,), the gradient's rounding
    distances: FloatArray  # (B, N), Dist_F(T^-1 A_i)^2
    unique: BoolArray  # (B,)


class _View(NamedTuple):
    """N matrices relative to T."""

    Z: FloatArray  # (N, n, n)
    spread: FloatArray  # (N,), r, the logarithm of the condition of T^-1 A_i
    far: FloatArray  # (N,), |Z|, 0 for what lies at T itself
    total: float  # of the weighted distances
    pull: FloatArray  # (n, n), the weighted sum of the directions of what does not lie at T
    held: float  # the weight of what lies at T
    floor: float

    @property
    def size(self) -> float:
        """The norm of the least subgradient."""
        return max(float(np.linalg.norm(self.pull)) - self.held, 0.0)

    @property
    def is_least(self) -> bool:
        """True if T is the median to rounding."""
        return self.size <= self.floor


def medians(A: FloatArray, w: FloatArray, start: FloatArray, noise: float = 0.0) -> Median:
    """Medians of sets A (B, N, n, n) with weights w (B, N) of sum 1, from a start T (B, n, n).

    Matrices within `noise` of a geodesic count as on it; with noise, directions are balanced only to the largest
    weight, as a single matrix does not matter.
    """
    found = [_median(*each, noise) for each in zip(A, w, start, strict=True)]
    return Median(*(np.array(values) for values in zip(*found, strict=True)))


def _median(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[Any, ...]:
    """The fields of `Median` for one set."""
    counts = w > 0
    T, on_line, is_unique = _on_a_line(A[counts], w[counts], T, noise)
    count = 0
    if not on_line:
        T, count = _descend_to_median(A[counts], w[counts], T, noise)
    T = lower_factor(T)
    view = _look(A[counts], w[counts], T)
    distances = 0.25 * _squares(logarithms(_whitened(T, A))[0])
    return T, 0.5 * view.total, view.size, count, view.floor, distances, is_unique


def _descend_to_median(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, int]:
    """The median from the start T, and the number of steps."""
    view, tried, enough = _look(A, w, T), -1, float(w.max()) if noise > 0 else 0.0
    for count in range(_STEPS):
        if view.size <= max(_ENOUGH * view.floor, enough):
            return T, count
        nearest = int(np.argmin(view.far))
        if nearest != tried:
            tried = nearest
            there = lower_factor(A[nearest])
            other = _look(A, w, there)
            if other.total <= view.total * (1.0 + EPS) or (other.held > 0 and other.is_least):
                T, view = there, other
                if view.held > 0 and view.is_least:
                    return T, count
        for V in _steps(view, w):
            there = T @ symmetric_exp(0.5 * V)[0]
            other = _look(A, w, there)
            promised = float(np.einsum("ij,ij", view.pull, V)) * (1.0 - view.held / float(np.linalg.norm(view.pull)))
            seen = promised > _SEEN * view.total
            if view.total - other.total > _GAIN * promised if seen else other.size < view.size:
                T, view = there, other
                break
        else:
            return T, count  # no step improves: the rest is rounding
    return T, _STEPS


def _steps(view: _View, w: FloatArray) -> list[FloatArray]:
    """Candidate steps: Newton's if it exists, and Weiszfeld's corrected for curvature."""
    away = view.far > 0
    pull, ratio = view.pull, np.divide(w, view.far, out=np.zeros_like(w), where=away)
    bend = _bend(view.spread)
    length = 1.0 - view.held / float(np.linalg.norm(pull))
    weiszfeld = pull * (length / float(ratio @ bend))
    if view.held > 0 or view.Z.shape[-1] > _WHOLE:
        return [weiszfeld]
    newton = _newton(view, ratio)
    return [weiszfeld] if newton is None else [newton, 0.25 * newton, weiszfeld]


def _newton(view: _View, ratio: FloatArray) -> FloatArray | None:
    """Newton step by the full Hessian: the sum of w / |Z| (Hessian of |Z|^2 / 2 - projector on the direction)."""
    n = view.Z.shape[-1]
    i, j = np.triu_indices(n)
    root = np.where(i == j, 1.0, np.sqrt(2.0))
    hessian = ratio.sum() * np.eye(i.size)
    for part in pieces(view.Z[None]):
        Z, weight = view.Z[part], ratio[part]
        across, excess = _across(Z, view.spread[part])
        across = across[..., i, j] * root
        hessian += np.einsum("mpc,mp,mpd->cd", across, excess * weight[:, None], across, optimize=True)
        directions = Z[:, i, j] * (root / np.maximum(view.far[part], 1e-300)[:, None])
        hessian -= (directions * weight[:, None]).T @ directions
    values, vectors = np.linalg.eigh(hessian)
    if not values[0] > _FLAT * values[-1]:
        return None
    coordinates = vectors @ ((view.pull[i, j] * root) @ vectors / values) / root
    V = np.zeros((n, n))
    V[i, j] = V[j, i] = coordinates
    size = float(np.linalg.norm(V))
    return V if size <= 1.0 else V / size


def _across(Z: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit tangents (N, P, n, n) along which the Hessian of |Z|^2 / 2 exceeds 1, and its excess (N, P)."""
    n = Z.shape[-1]
    if n == 2:
        half = np.stack([-Z[:, 0, 1], 0.5 * (Z[:, 0, 0] - Z[:, 1, 1])], axis=-1)
        length = np.maximum(np.hypot(*half.T), 1e-300)
        p, q = half.T / (np.sqrt(2.0) * length)
        return np.stack([p, q, q, -p], axis=-1).reshape(-1, 1, 2, 2), _bend(spread)[:, None] - 1.0
    values, U = np.linalg.eigh(Z)
    a, b = np.triu_indices(n, 1)
    left, right = transposed(U)[:, a], transposed(U)[:, b]
    products = left[..., :, None] * right[..., None, :]
    return (products + transposed(products)) / np.sqrt(2.0), _bend(0.5 * np.abs(values[:, a] - values[:, b])) - 1.0


def _bend(r: FloatArray) -> FloatArray:
    """r coth r."""
    r = np.maximum(r, 1e-8)
    return np.asarray(r / np.tanh(r))


def _look(A: FloatArray, w: FloatArray, T: FloatArray) -> _View:
    n = A.shape[-1]
    Z, spread = logarithms(_whitened(T, A))
    far = np.sqrt(_squares(Z))
    condition = _condition(T)
    far = np.where(far > _SAME * n * condition, far, 0.0)
    away = far > 0
    ratio = np.divide(w, far, out=np.zeros_like(w), where=away)
    floor = 4.0 * n * EPS * float((w[away] + condition * ratio[away]) @ np.cosh(spread[away]))
    pull = np.einsum("m,mij->ij", ratio, Z)
    return _View(Z, spread, far, float(w @ far), pull, float(w[~away].sum()), floor)


def _condition(T: FloatArray) -> float:
    """Condition of T, invariant under scaling of rows."""
    return float((np.abs(np.linalg.inv(T)) @ np.abs(T)).max())


def _whitened(T: FloatArray, A: FloatArray) -> FloatArray:
    n = A.shape[-1]
    columns = np.linalg.solve(T, A.swapaxes(0, 1).reshape(n, -1))
    return np.asarray(columns.reshape(n, -1, n).swapaxes(0, 1))


def _squares(Z: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("mij,mij->m", Z, Z))


# ---- matrices on one geodesic -----------------------------------------------------------------


def _on_a_line(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, bool, bool]:
    """The median of matrices on one geodesic to rounding, True if they are on one, and True if it is unique.

    For matrices near a geodesic it is near the median; for others it is T.
    """
    base = lower_factor(A[np.argmin(_squares(logarithms(_whitened(T, A))[0]))])
    Z, spread = logarithms(_whitened(base, A))
    far = np.sqrt(_squares(Z))
    longest = float(far.max())
    same = _SAME * A.shape[-1] * _condition(base) * float(np.cosh(spread.max()))
    if longest <= same:
        return base, True, True
    sides = np.where(np.einsum("mij,ij->m", Z, Z[np.argmax(far)]) < 0, -w, w)
    direction = np.einsum("m,mij->ij", sides, Z)
    direction /= np.linalg.norm(direction)
    t = np.einsum("mij,ij->m", Z, direction)
    off = np.sqrt(_squares(Z - t[:, None, None] * direction))
    if w @ off > max(same, _LINE * float(w @ far)):
        return T, False, True
    on_line = bool(off.max() <= max(same, noise))
    order = np.argsort(t, kind="stable")
    t, up_to = t[order], np.cumsum(w[order])
    half, rounding = 0.5 * up_to[-1], EPS * len(t)
    k = int(np.searchsorted(up_to, half - rounding))
    is_even = bool(abs(up_to[k] - half) <= rounding) and k + 1 < len(t) and bool(t[k + 1] - t[k] > same)
    if not is_even:
        return lower_factor(A[order[k]]), on_line, True
    middle = base @ symmetric_exp(0.25 * (t[k] + t[k + 1]) * direction)[0]
    return middle, on_line, not on_line
