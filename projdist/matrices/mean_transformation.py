"""The mean distorting transformation (MDT), and geometric medians.

Among all linear maps T, the MDT is the one that minimises the weighted mean of Dist_F(T^-1 A_i)^2, Dist_F the Fisher
distortion (D. Ozeri, "Riemannian Geometry Approach for Minimizing Distortion and its Applications"). It is the Cholesky
factor of the Frechet mean of A_i A_i^T, unique up to an orthogonal factor from the right. T acts on the left: where the
A_i are the Jacobians of a map f, T^-1 o f is its least distorting linear correction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import ArrayLike, FloatArray
from projdist.matrices import frechet, whitened_sets
from projdist.matrices.whitened_sets import EPS, logarithms, lower_factor, pieces, place, symmetric_exp, transposed
from projdist.support import Answer, check_choice, check_numbers

_GROUP = 1 << 15  # doubles in the sets of matrices processed together
_TOO_FAR = "Invalid matrices. They lie so far apart that their squares leave the range of doubles."


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MDT(Answer):
    """A mean distorting transformation and its accuracy, in numbers, or arrays (...) for leading axes.

    The rounding of A and T themselves comes on top of `floor`: eps times the condition of T, in which the scales of its
    rows do not count. Of the method "median" `cost` is the weighted mean of Dist_F, and `gradient_norm` that of the
    weighted mean of the unit directions to the matrices, less the weight of those at T.
    """

    T: FloatArray  #: (..., n, n), lower triangular with a positive diagonal
    cost: Any  #: the weighted mean of `distances`
    gradient_norm: Any  #: of the weighted mean of ln(T^-1 A_i A_i^T T^-T), 0 at the MDT; bounds the distance from it
    iterations: Any  #: number of steps
    floor: Any  #: bound of the gradient's rounding, some n eps times the mean of cosh ln cond(T^-1 A_i)
    unique: Any  #: False if other medians are as good: then T is in their middle
    distances: FloatArray  #: (..., N), Dist_F(T^-1 A_i)^2

    def _line(self) -> str:
        T = np.array2string(np.asarray(self.T), precision=4, threshold=16).replace("\n", "")
        return f"T {T}, cost {self.cost}"

    def _table(self) -> dict[str, FloatArray]:
        """One row per set of matrices: the figures, and T as T_00, T_01, ..."""
        figures = ("cost", "gradient_norm", "iterations", "floor", "unique")
        columns = {name: np.ravel(getattr(self, name)) for name in figures}
        n = self.T.shape[-1]
        return columns | {f"T_{i}{j}": np.ravel(self.T[..., i, j]) for i in range(n) for j in range(n)}


def mdt(A: ArrayLike, weights: ArrayLike | None = None, *, method: str = "auto") -> MDT:
    """The mean distorting transformation of matrices A_i: the linear T that minimises the mean of Dist_F(T^-1 A_i)^2.

    T is unique up to an orthogonal factor from the right. Where the A_i are the Jacobians of a map, T^-1 after the map
    is its least distorting linear correction.

    Parameters
    ----------
    A : array_like (..., N, n, n)
        N matrices, of any dimension n; leading axes are sets of their own.
    weights : array_like (N,) or (..., N), optional
        Not negative, of any sum; equal ones if there are none.
    method : str
        "auto" and "newton" are exact to rounding, by Newton's method, for n = 2 in coordinates of the hyperbolic plane;
        "gradient" leaves up to 4 times the `floor`, and is slower. "median" is the geometric median, which minimises
        the mean of Dist_F itself, to rounding, and is robust against outliers. The others are for comparison, with
        their own `cost` and `gradient_norm`: "mpm" (multiplicative power means),
        "log_euclidean", "log_cholesky" and "arithmetic".

    Returns
    -------
    MDT
        T (..., n, n), lower triangular with a positive diagonal, its distances, and its accuracy.

    Raises
    ------
    ValueError
        With the index, for singular or non-finite matrices (n > 2: singular to rounding) and for negative or undefined
        weights; for weights that are all zero; and for matrices so far apart that their squares leave the range of
        doubles.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications, Algorithm 1.
    Bini & Iannazzo 2013, Linear Algebra and its Applications 438 (gradient).
    Fletcher, Venkatasubramanian & Joshi 2009, NeuroImage 45 (median).
    Congedo, Barachant & Bhatia 2017, IEEE Transactions on Signal Processing 65 (mpm).
    Lin 2019, SIAM Journal on Matrix Analysis and Applications (log_cholesky).
    Arsigny, Fillard, Pennec & Ayache 2007, the same journal (log_euclidean).

    Examples
    --------
    Of diagonal matrices it is the geometric mean, here of 1 and 4, and of 2 and 2:

    >>> mdt([[[1, 0], [0, 2]], [[4, 0], [0, 2]]]).T
    array([[2., 0.],
           [0., 2.]])

    The median of scales is that of their logarithms:

    >>> float(mdt([[[1]], [[2]], [[100]]], method="median").T[0, 0])
    2.0
    """
    A = check_matrices(A)
    w = check_weights(weights, A.shape[:-2])
    check_choice("method", method, ("auto", *frechet.METHODS, "median"))
    return field_mdt(A, w, method)


def field_mdt(A: FloatArray, w: FloatArray, method: str = "auto", noise: float = 0.0) -> MDT:
    """The means of sets of matrices (..., N, n, n) with weights (..., N) of sum 1; ValueError for singular matrices."""
    # Weights at the nodes of a rule over polygons may be negative, except for medians, for which distances and
    # directions below `noise` count as 0. Some sets are taken at a time.
    shape, (count, n, _) = A.shape[:-3], A.shape[-3:]
    A, w = A.reshape(-1, count, n, n), w.reshape(-1, count)
    rows, in_plane = max(1, _GROUP // (count * n * n)), n == 2 and method in ("auto", "newton")
    found: list[frechet.Mean] = []
    for first in range(0, len(A), rows):
        part = slice(first, first + rows)
        singular = np.zeros((len(A), count), dtype=bool)
        try:
            with np.errstate(all="ignore"):
                if in_plane:
                    points, singular[part] = frechet.plane_points(A[part])
                else:
                    singular[part] = ~np.isfinite(A[part]).all(axis=(-1, -2))
                    if not singular.any():
                        start, singular[part] = frechet.middle(A[part], w[part])
                if singular.any():
                    whitened_sets.refuse(singular.reshape(*shape, count), "finite and invertible")
                if in_plane:
                    found.append(frechet.newton_in_plane(points, w[part]))
                elif method == "median":
                    found.append(medians(A[part], w[part], start, noise))
                else:
                    found.append(frechet.METHODS["newton" if method == "auto" else method](A[part], w[part], start))
        except np.linalg.LinAlgError as error:
            raise ValueError(_TOO_FAR) from error
        if not np.isfinite(found[-1].cost).all():
            raise ValueError(_TOO_FAR)
    parts: Any = found[0] if len(found) == 1 else [np.concatenate(part) for part in zip(*found, strict=True)]
    shaped = (part.reshape(shape + part.shape[1:])[()] for part in parts)
    return MDT(**dict(zip(frechet.Mean._fields, shaped, strict=True)))


def check_matrices(A: ArrayLike) -> FloatArray:
    """A as an array of shape (..., N, n, n), N and n at least 1."""
    if not isinstance(A, list | tuple) and np.iscomplexobj(A):
        raise ValueError("Invalid matrices. They must be real.")
    A = check_numbers("matrices", A)
    if A.ndim < 3 or A.shape[-1] != A.shape[-2] or A.size == 0:
        raise ValueError(f"Invalid shape {A.shape} of matrices. It must be (..., N, n, n) with N and n at least 1.")
    return A


def check_weights(weights: ArrayLike | None, shape: tuple[int, ...]) -> FloatArray:
    """Weights of matrices of shape (..., N), divided by their sums over N; equal ones for None."""
    if weights is None:
        return np.broadcast_to(np.full(shape[-1], 1.0 / shape[-1]), shape)
    w = check_numbers("weights", weights)
    if w.shape not in (shape, shape[-1:]):
        either = f"{shape[-1:]} or {shape}" if len(shape) > 1 else f"{shape}"
        raise ValueError(f"Invalid shape {w.shape} of weights. It must be {either}, as many as matrices.")
    if not (w.min() >= 0 and w.max() < np.inf):
        wrong = ~((w >= 0) & (w < np.inf))
        raise ValueError(f"Invalid weight {w[wrong][0]}{place(wrong)}. It must be finite and not negative.")
    w = w / np.maximum(w.max(axis=-1, keepdims=True), np.finfo(float).tiny)  # so that sums do not overflow
    total = w.sum(axis=-1, keepdims=True)
    if not (total > 0).all():
        raise ValueError(f"Invalid weights{place(total[..., 0] == 0)}. They must not all be zero.")
    return np.broadcast_to(w / total, shape)


# ---- geometric medians ---------------------------------------------------------------------------

_STEPS = 500  # about ten suffice; more if many matrices are near the median
_WHOLE = 20  # largest n for which the full Hessian, n (n + 1) / 2 on a side, is used
_SAME = 64.0 * EPS  # times the condition: matrices nearer than this are equal
_FLAT = 1e-12  # of the largest curvature: smaller ones are rounding
_LINE = 1e-6  # of distances: with a smaller mean distance from a geodesic the median is near that on the geodesic
_ENOUGH = 0.05  # of the bound of the gradient's rounding, which is pessimistic: a smaller gradient suffices
_GAIN = 0.1  # of the gain that the gradient predicts: a step must gain as much
_SEEN = 1e-11  # of the sum of distances: whether smaller gains are real is judged by the gradient


class _View(NamedTuple):
    """N matrices relative to T."""

    Z: FloatArray  # (N, n, n), ln(T^-1 A_i A_i^T T^-T)
    spread: FloatArray  # (N,), r, the logarithm of the condition of T^-1 A_i
    far: FloatArray  # (N,), |Z|, 0 for matrices that lie at T
    total: float  # of the weighted distances
    pull: FloatArray  # (n, n), the weighted sum of the directions to matrices that do not lie at T
    held: float  # the weight of matrices that lie at T
    floor: float  # bound of the rounding of `pull`

    @property
    def size(self) -> float:
        """The norm of the least subgradient."""
        return max(float(np.linalg.norm(self.pull)) - self.held, 0.0)


def medians(A: FloatArray, w: FloatArray, start: FloatArray, noise: float = 0.0) -> frechet.Mean:
    """Medians of sets A (B, N, n, n) with weights w (B, N) of sum 1, from a start T (B, n, n)."""
    # Matrices within `noise` of a geodesic count as on it; with noise directions balance only up to the largest weight.
    found = []
    for every, weights, T in zip(A, w, start, strict=True):
        some, counting, count = every[weights > 0], weights[weights > 0], 0
        T, on_line, is_unique = _on_a_line(some, counting, T, noise)
        if not on_line:
            T, count = _descend(some, counting, T, noise)
        T = lower_factor(T)
        view = _look(some, counting, T)
        Z = logarithms(_whitened(T, every))[0]
        found.append((T, 0.5 * view.total, view.size, count, view.floor, 0.25 * whitened_sets.dot(Z, Z), is_unique))
    return frechet.Mean(*(np.array(values) for values in zip(*found, strict=True)))


def _descend(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, int]:
    """The median found from the start T, and the number of steps."""
    view, tried, enough = _look(A, w, T), -1, float(w.max()) if noise > 0 else 0.0
    for count in range(_STEPS):
        if view.size <= max(_ENOUGH * view.floor, enough):
            return T, count
        nearest = int(np.argmin(view.far))
        if nearest != tried:
            tried = nearest
            there = lower_factor(A[nearest])
            other = _look(A, w, there)
            if other.total <= view.total * (1.0 + EPS) or (other.held > 0 and other.size <= other.floor):
                T, view = there, other
                if view.held > 0 and view.size <= view.floor:
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
    """Steps to try: Newton's if it exists, and Weiszfeld's corrected for curvature."""
    pull, ratio = view.pull, np.divide(w, view.far, out=np.zeros_like(w), where=view.far > 0)
    length = 1.0 - view.held / float(np.linalg.norm(pull))
    weiszfeld = pull * (length / float(ratio @ whitened_sets.bend(view.spread)))
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
        # Unit tangents (N, P, n, n) along which the Hessian of |Z|^2 / 2 exceeds 1, and its excess (N, P).
        if n == 2:
            half = np.stack([-Z[:, 0, 1], 0.5 * (Z[:, 0, 0] - Z[:, 1, 1])], axis=-1)
            p, q = half.T / (np.sqrt(2.0) * np.maximum(np.hypot(*half.T), 1e-300))
            across = np.stack([p, q, q, -p], axis=-1).reshape(-1, 1, 2, 2)
            excess = whitened_sets.bend(view.spread[part])[:, None] - 1.0
        else:
            eigenvalues, U = np.linalg.eigh(Z)
            a, b = np.triu_indices(n, 1)
            products = transposed(U)[:, a, :, None] * transposed(U)[:, b, None, :]
            across = (products + transposed(products)) / np.sqrt(2.0)
            excess = whitened_sets.bend(0.5 * np.abs(eigenvalues[:, a] - eigenvalues[:, b])) - 1.0
        across = across[..., i, j] * root
        hessian += np.einsum("mpc,mp,mpd->cd", across, excess * weight[:, None], across, optimize=True)
        directions = Z[:, i, j] * (root / np.maximum(view.far[part], 1e-300)[:, None])
        hessian -= (directions * weight[:, None]).T @ directions
    values, vectors = np.linalg.eigh(hessian)
    if not values[0] > _FLAT * values[-1]:
        return None
    V = np.zeros((n, n))
    V[i, j] = V[j, i] = vectors @ ((view.pull[i, j] * root) @ vectors / values) / root
    size = float(np.linalg.norm(V))
    return V if size <= 1.0 else V / size


def _look(A: FloatArray, w: FloatArray, T: FloatArray) -> _View:
    """Matrices (N, n, n) with weights (N,) relative to T."""
    n = A.shape[-1]
    Z, spread = logarithms(_whitened(T, A))
    far = np.sqrt(whitened_sets.dot(Z, Z))
    condition = float(whitened_sets.row_condition(T))
    far = np.where(far > _SAME * n * condition, far, 0.0)
    away = far > 0
    ratio = np.divide(w, far, out=np.zeros_like(w), where=away)
    floor = 4.0 * n * EPS * float((w[away] + condition * ratio[away]) @ np.cosh(spread[away]))
    return _View(Z, spread, far, float(w @ far), np.einsum("m,mij->ij", ratio, Z), float(w[~away].sum()), floor)


def _whitened(T: FloatArray, A: FloatArray) -> FloatArray:
    """T^-1 A_i of matrices (N, n, n), by one solution for all."""
    n = A.shape[-1]
    return np.asarray(np.linalg.solve(T, A.swapaxes(0, 1).reshape(n, -1)).reshape(n, -1, n).swapaxes(0, 1))


def _on_a_line(A: FloatArray, w: FloatArray, T: FloatArray, noise: float) -> tuple[FloatArray, bool, bool]:
    """A matrix T, and flags: True if it is the median as all matrices lie on one geodesic; True if that is unique."""
    # For matrices near a geodesic the matrix is one near the median, for others the given T.
    Z = logarithms(_whitened(T, A))[0]
    base = lower_factor(A[np.argmin(whitened_sets.dot(Z, Z))])
    Z, spread = logarithms(_whitened(base, A))
    far = np.sqrt(whitened_sets.dot(Z, Z))
    longest = float(far.max())
    same = _SAME * A.shape[-1] * float(whitened_sets.row_condition(base)) * float(np.cosh(spread.max()))
    if longest <= same:
        return base, True, True
    sides = np.where(np.einsum("mij,ij->m", Z, Z[np.argmax(far)]) < 0, -w, w)
    direction = np.einsum("m,mij->ij", sides, Z)
    direction /= np.linalg.norm(direction)
    t = np.einsum("mij,ij->m", Z, direction)
    across = Z - t[:, None, None] * direction
    off = np.sqrt(whitened_sets.dot(across, across))
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
    return base @ symmetric_exp(0.25 * (t[k] + t[k + 1]) * direction)[0], on_line, not on_line
