"""The mean distorting transformation (MDT).

Among all linear maps T, the MDT is the one that minimises the weighted mean of
Dist_F(T^-1 A_i)^2, Dist_F the Fisher distortion (D. Ozeri, "Riemannian Geometry Approach for
Minimizing Distortion and its Applications"). It is the Cholesky factor of the Frechet mean of
A_i A_i^T, unique up to an orthogonal factor from the right. T acts on the left: where the A_i are
the Jacobians of a map f, T^-1 o f is its least distorting linear correction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.matrices import frechet, frechet_plane
from projdist.matrices.spd import place
from projdist.support import Answer, check_choice, check_numbers

_GROUP = 1 << 15  # doubles in the sets of matrices processed together
_TOO_FAR = "Invalid matrices. They lie so far apart that their squares leave the range of doubles."


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MDT(Answer):
    """A mean distorting transformation and its accuracy.

    `T`: shape (..., n, n), lower triangular with a positive diagonal. `distances`: Dist_F(T^-1 A_i)^2,
    shape (..., N). The others are numbers, or of shape (...) for the leading axes. `cost`: the
    weighted mean of `distances`. `gradient_norm`: that of the weighted mean of
    ln(T^-1 A_i A_i^T T^-T), which vanishes at the MDT and bounds the Fisher distance from it.
    `iterations`: the steps taken. `floor`: what rounding may leave of the gradient, some n eps times
    the mean of cosh ln cond(T^-1 A_i). The rounding of A and T themselves comes on top: eps times the
    condition of T, in which the scales of its rows do not count. Of the method "median" `cost` is the weighted mean of
    Dist_F, `gradient_norm` that of the weighted mean of the unit directions to the matrices, less the weight of what
    lies at T, and `unique` is False where others are as good: then T is in their middle.
    """

    T: FloatArray
    cost: Any
    gradient_norm: Any
    iterations: Any
    floor: Any
    unique: Any
    distances: FloatArray

    def _line(self) -> str:
        return (
            f"T {np.array2string(np.asarray(self.T), precision=4, threshold=16).replace(chr(10), '')}, cost {self.cost}"
        )

    def _table(self) -> dict[str, FloatArray]:
        """One row per set of matrices: the figures, and T as T_00, T_01, ..."""
        columns = {name: np.ravel(getattr(self, name)) for name in _FIGURES}
        n = self.T.shape[-1]
        return columns | {f"T_{i}{j}": np.ravel(self.T[..., i, j]) for i in range(n) for j in range(n)}


_FIGURES = ("cost", "gradient_norm", "iterations", "floor", "unique")


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
        weights; for weights that are all zero; and for matrices so far apart, in condition beyond 1e150, that their
        squares leave the range of doubles.

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
    return _solved(A, w, method)


def field_mdt(J: FloatArray, weights: FloatArray) -> MDT:
    """The MDT of a smooth field of matrices J (N, n, n) at the nodes of a quadrature rule.

    The rule's weights may be negative, as those of `Samples` over polygons are: the mean is that of the field, and
    the field's weight is positive. Raises ValueError for singular or non-finite matrices.
    """
    return _solved(J, weights / weights.sum(), "auto")


def field_median(J: FloatArray, weights: FloatArray, noise: float) -> MDT:
    """The geometric median of many samples J (N, n, n) of a smooth field, with non-negative weights.

    Distances and directions below `noise` count as 0. Raises ValueError for singular or non-finite matrices.
    """
    return _solved(J, weights / weights.sum(), "median", noise)


def _solved(A: FloatArray, w: FloatArray, method: str, noise: float = 0.0) -> MDT:
    shape, (count, n, _) = A.shape[:-3], A.shape[-3:]
    A, w = A.reshape(-1, count, n, n), w.reshape(-1, count)
    rows = max(1, _GROUP // (count * n * n))
    found: list[frechet.Mean | frechet.Median] = []
    for first in range(0, len(A), rows):
        part = slice(first, first + rows)
        try:
            with np.errstate(all="ignore"):
                found.append(_mean(A[part], w[part], method, noise))
        except _Singular as singular:
            row, column = singular.args
            index = (*(int(i) for i in np.unravel_index(first + row, shape)), column) if shape else column
            raise ValueError(f"Invalid matrix at index {index}. It must be finite and invertible.") from None
        except np.linalg.LinAlgError as error:
            raise ValueError(_TOO_FAR) from error
        if not np.isfinite(found[-1].cost).all():
            raise ValueError(_TOO_FAR)
    parts: Any = found[0] if len(found) == 1 else [np.concatenate(part) for part in zip(*found, strict=True)]
    shaped = (part.reshape(shape + part.shape[1:])[()] for part in parts)
    values: dict[str, Any] = dict(zip(found[0]._fields, shaped, strict=True))
    return MDT(**({"unique": np.ones(shape, dtype=bool)[()]} | values))


class _Singular(Exception):
    """The first singular matrix: index of its set, and index in the set."""


def _mean(A: FloatArray, w: FloatArray, method: str, noise: float) -> frechet.Mean | frechet.Median:
    """The means of sets of matrices, shape (B, N, n, n)."""
    if A.shape[-1] == 2 and method in ("auto", "newton"):
        points, wrong = frechet_plane.points(A)
        _refuse(wrong)
        found = frechet_plane.newton(points, w)
    else:
        _refuse(np.asarray(~np.isfinite(A).all(axis=(-1, -2))))
        start, wrong = frechet.middle(A, w)
        _refuse(wrong)
        if method == "median":
            return frechet.medians(A, w, start, noise)
        found = frechet.METHODS["newton" if method == "auto" else method](A, w, start)
    return found


def _refuse(wrong: BoolArray) -> None:
    if wrong.any():
        raise _Singular(*(int(i) for i in np.argwhere(wrong)[0]))


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
    w = w / np.maximum(w.max(axis=-1, keepdims=True), np.finfo(float).tiny)  # avoids overflow of sums
    total = w.sum(axis=-1, keepdims=True)
    if not (total > 0).all():
        raise ValueError(f"Invalid weights{place(total[..., 0] == 0)}. They must not all be zero.")
    return np.broadcast_to(w / total, shape)
