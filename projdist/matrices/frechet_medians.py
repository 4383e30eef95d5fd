"""Geometric medians of matrices of any size in the affine-invariant metric: the least weighted sum of distances.

Seen from T, the matrix A_i lies at Z_i = ln(T^-1 A_i A_i^T T^-T), |Z_i| = 2 Dist_F(T^-1 A_i) away. The sum of distances
is convex, its gradient minus the weighted sum of the directions Z_i / |Z_i|; it has a kink at each A_i. A step is
Newton's where that lowers the sum, else Weiszfeld's, which always does: the mean of the Z_i with weights w_i / |Z_i|.
Whenever another matrix comes to be the nearest, it is tried itself: it is the median where the directions of the others
do not outweigh it (Kuhn's condition), and else left against the sum of directions, as Vardi & Zhang do.

Of matrices on one geodesic the median is that of numbers. It is not unique where a gap of the geodesic has half of the
weight on either side, and only there: then it is the gap's middle.

Sources: Fletcher, Venkatasubramanian & Joshi 2009, The geometric median on Riemannian manifolds with application to
robust atlas estimation, NeuroImage 45; Vardi & Zhang 2000, The multivariate L1-median and associated data depth,
Proceedings of the National Academy of Sciences 97.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.matrices.frechet_sets import EPS, logarithms, pieces
from projdist.matrices.spd import lower_factor, symmetric_exp, transposed

__all__ = ["Median", "medians"]

_STEPS = 500  # some ten; more where many matrices lie about the median
_WHOLE = 20  # the largest n whose Hessian, n (n + 1) / 2 on a side, is made
_SAME = 64.0 * EPS  # times the condition: what is nearer is the same matrix
_FLAT = 1e-12  # of the largest curvature: a smaller one is rounding
_LINE = 1e-6  # of distances: what is nearer to a geodesic than that on average has a median near that of numbers
_ENOUGH = 0.05  # of the gradient's rounding, whose bound is wide
_GAIN = 0.1  # of what the gradient promises, that a step must bring
_SEEN = 1e-11  # of a sum of distances: gains below it are not seen in the sum, but in the gradient


class Median(NamedTuple):
    """The medians T of B sets of N matrices and how good they are."""

    T: FloatArray  # (B, n, n), lower triangular with a positive diagonal
    cost: FloatArray  # (B,), the weighted mean of Dist_F
    gradient_norm: FloatArray  # (B,), of the weighted sum of directions, less the weight of a matrix that is the median
    iterations: IntArray  # (B,)
    floor: FloatArray  # (B,), the gradient's rounding
    distances: FloatArray  # (B, N), Dist_F(T^-1 A_i)^2
    unique: BoolArray  # (B,)


class _View(NamedTuple):
    """N matrices seen from T."""

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
        """Whether T is the median, to rounding."""
        return self.size <= self.floor


def medians(A: FloatArray, w: FloatArray, start: FloatArray, noise: float = 0.0) -> Median:
    """The medians of sets A (B, N, n, n), weights w (B, N) of sum 1, from a start T (B, n, n).

    What is no farther from a geodesic than `noise` lies on it; where there is some, one matrix more or less does not
    matter, and directions are balanced to the largest weight.
    """
    found = [_median(*each, noise) for each in zip(A, w, start, strict=True)]
    return Median(*(np.array(values) for values in zip(*found, strict=True)))


def _median(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[Any, ...]:
    """What `Median` has, of one set."""
    counts = w > 0
    T, on_line, is_unique = _on_a_line(A[counts], w[counts], T, noise)
    count = 0
    if not on_line:
        T, count = _descend(A[counts], w[counts], T, noise)
    T = lower_factor(T)
    view = _look(A[counts], w[counts], T)
    distances = 0.25 * _squares(logarithms(_whitened(T, A))[0])
    return T, 0.5 * view.total, view.size, count, view.floor, distances, is_unique


def _descend(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, int]:
    """The median and the steps to it, from T."""
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
            return T, count  # no step is known to be one to the better: what is left is rounding
    return T, _STEPS


def _steps(view: _View, w: FloatArray) -> list[FloatArray]:
    """Newton's step, where there is one, and Weiszfeld's with the bend of the manifold."""
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
    """The step of the whole Hessian: the sum of w / |Z| (Hessian of |Z|^2 / 2 - that of the direction itself)."""
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
    """Unit tangents (N, P, n, n) along which the Hessian of |Z|^2 / 2 is not 1, and by how much it is more, (N, P)."""
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
    """That of T, in which the scales of its rows do not count."""
    return float((np.abs(np.linalg.inv(T)) @ np.abs(T)).max())


def _whitened(T: FloatArray, A: FloatArray) -> FloatArray:
    n = A.shape[-1]
    columns = np.linalg.solve(T, A.swapaxes(0, 1).reshape(n, -1))
    return np.asarray(columns.reshape(n, -1, n).swapaxes(0, 1))


def _squares(Z: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("mij,mij->m", Z, Z))


# ---- matrices on one geodesic -----------------------------------------------------------------


def _on_a_line(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, bool, bool]:
    """The median of matrices that lie on one geodesic to rounding, whether they do, and whether it is unique.

    Of those that nearly do it is near the median, else it is T.
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
