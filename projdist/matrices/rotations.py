"""The rigid correction that follows the mean distorting transformation: a rotation and a shift.

The MDT is unique up to a rotation. The rotation q removes the mean orientation of the corrected matrices q T^-1 A_i; it
is on the left of T^-1, where distances do not change. A shift then brings the corrected points to the axes (D. Ozeri,
"Riemannian Geometry Approach for Minimizing Distortion and its Applications").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray
from projdist.matrices.mean_transformation import check_matrices, check_weights, mdt
from projdist.matrices.whitened_sets import lq, refuse, transposed
from projdist.support import Answer, check_choice, check_numbers


@dataclass(frozen=True, eq=False)
class Affine:
    """The map p -> matrix p + shift of points (..., n).

    Examples
    --------
    >>> import numpy as np
    >>> there = Affine(np.diag([2.0, 4.0]), np.array([1.0, 0.0]))
    >>> there.inverse()(there(np.array([[3.0, 5.0]])))
    array([[3., 5.]])
    """

    matrix: FloatArray
    shift: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """The images of points."""
        return np.asarray(points @ self.matrix.T + self.shift)

    def inverse(self) -> Affine:
        """The map back."""
        back = np.asarray(np.linalg.inv(self.matrix), dtype=float)
        return Affine(back, -back @ self.shift)


_NO_ORDER = 0.1  # mean resultant length below which there is no order; that of N random ones is about 1 / sqrt(N)
_HALF_TURN = 1e-8  # sine of an angle near 180 degrees below which the plane of rotation is undetermined
_SHOWN = 10  # indices in one message


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Rotation(Answer):
    """The rotation that removes the mean orientation of T^-1 A_i."""

    q: FloatArray  #: (..., n, n), of determinant 1, applied on the left: q T^-1 A_i
    reflection: Any  #: True if all A_i mirror: the mean orientation of q T^-1 A_i is then diag(1, .., 1, -1), not 1
    mean_resultant_length: Any  #: 1 if all orientations agree, 0 if they cancel

    def _line(self) -> str:
        return np.array2string(np.asarray(self.q), precision=4, threshold=16).replace("\n", "")

    def to_dict(self) -> dict[str, Any]:
        """The fields by name, arrays as lists; and the note."""
        return super().to_dict() | {"note": self.note}

    def _table(self) -> dict[str, Any]:
        """One row per rotation, q as q_00, q_01, ..."""
        columns = {name: np.ravel(getattr(self, name)) for name in ("reflection", "mean_resultant_length")}
        n = self.q.shape[-1]
        return columns | {f"q_{i}{j}": np.ravel(self.q[..., i, j]) for i in range(n) for j in range(n)}

    @property
    def note(self) -> str:
        """Note on a meaningless mean orientation; usually ""."""
        least = float(np.min(self.mean_resultant_length))
        if least >= _NO_ORDER:
            return ""
        return f"There is no meaningful mean orientation: the mean resultant length is {least:.2g}."


def mean_rotation(
    A: ArrayLike, weights: ArrayLike | None = None, *, T: ArrayLike | None = None, method: str = "chordal"
) -> Rotation:
    """The rotation q of the rigid correction, which removes the mean orientation of T^-1 A_i.

    Parameters
    ----------
    A : array_like (..., N, n, n)
        Matrices, as for `mdt`; all of a set mirror, or none.
    weights : array_like (N,) or (..., N), optional
        As for `mdt`.
    T : array_like (..., n, n), optional
        The MDT if not given.
    method : str
        "chordal": the rotation nearest to the mean of the orthogonal polar factors of T^-1 A_i, whatever axes and
        whatever T Q stand for T. "log": exp of minus the mean logarithm of the LQ factors q_i of T^-1 A_i, as the
        source paper has it; it depends on the axes, and for n > 2 it is a mean only of rotations that are near to 1. In
        the plane the angles are counted from the chordal mean, so that 170, -170 and 175 degrees have the mean 178.3.

    Returns
    -------
    Rotation
        Its q (..., n, n), of determinant 1, stands on the left: q T^-1 A_i.

    Raises
    ------
    ValueError
        With the indices, where some matrices mirror and others do not, for matrices and weights as `mdt` does, for a T
        that is singular or of another shape, and for "log" where n > 2 and a q_i turns by 180 degrees.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.
    Moakher 2002, Means and averaging in the group of rotations, SIAM Journal on Matrix Analysis and Applications 24.

    Examples
    --------
    Turns by 20 and 40 degrees are turned back by 30:

    >>> import numpy as np
    >>> cos, sin = (function(np.radians([20.0, 40.0])) for function in (np.cos, np.sin))
    >>> q = mean_rotation(np.moveaxis([[cos, -sin], [sin, cos]], -1, 0)).q
    >>> round(float(np.degrees(np.arctan2(q[1, 0], q[0, 0]))), 9)
    -30.0
    """
    A = check_matrices(A)
    w = check_weights(weights, A.shape[:-2])
    check_choice("method", method, ROTATIONS)
    factor = mdt(A, w).T if T is None else check_numbers("T", T)
    if factor.shape != A.shape[:-3] + A.shape[-2:]:
        raise ValueError(f"Invalid shape {factor.shape} of T. It must be {A.shape[:-3] + A.shape[-2:]}.")
    return _rotation(A, w, factor, method)


def field_rotation(J: FloatArray, weights: FloatArray, T: FloatArray) -> Rotation:
    """The chordal rotation of J (N, n, n) at nodes, as `field_mdt`; ValueError if J is singular or mirrors in part."""
    return _rotation(J, weights / weights.sum(), T, "chordal")


def _rotation(A: FloatArray, w: FloatArray, factor: FloatArray, method: str) -> Rotation:
    reflection = _common((_orientation(factor, "T")[..., None] * _orientation(A, "matrix")) < 0)
    B = np.asarray(np.linalg.solve(factor[..., None, :, :], A), dtype=np.float64)
    # A reflection of the last axis on the right, common to all, leaves rotations.
    B[..., -1] *= np.where(reflection, -1.0, 1.0)[..., None, None]
    R, length = ROTATIONS[method](B, w)
    return Rotation(q=transposed(R), reflection=reflection[()], mean_resultant_length=length[()])


def axes_shift(points: ArrayLike) -> FloatArray:
    """The shift that brings points to the axes: the minimum of each coordinate becomes 0.

    Parameters
    ----------
    points : array_like (..., M, n)
        M points of any dimension n, in any unit; leading axes are sets of their own.

    Returns
    -------
    ndarray (..., n)
        To be added to the points.

    Raises
    ------
    ValueError
        For arrays of another shape or without points, and, with the index, points that are not finite.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    >>> axes_shift([[3.0, -1.0], [5.0, 2.0]])
    array([-3.,  1.])
    """
    points = check_numbers("points", points)
    if points.ndim < 2 or points.size == 0:
        raise ValueError(f"Invalid shape {points.shape} of points. It must be (..., M, n) with M and n at least 1.")
    refuse(np.asarray(~np.isfinite(points).all(axis=-1)), "finite", "point")
    return 0.0 - points.min(axis=-2)


def turns(w: FloatArray) -> FloatArray:
    """The rotations (..., 3, 3) about vectors w (..., 3) by their lengths in radians: the exponential of [w]_x."""
    # By Rodrigues' formula, I + sin(t)/t W + (1 - cos(t))/t^2 W^2 with t = |w|, the second factor without cancellation.
    t = np.linalg.norm(w, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(w, -1, 0)
    none = np.zeros_like(x)
    W = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(*w.shape, 3)
    return np.asarray(np.eye(3) + np.sinc(t / np.pi) * W + 0.5 * np.sinc(0.5 * t / np.pi) ** 2 * (W @ W))


def _orientation(A: FloatArray, what: str) -> FloatArray:
    """Signs of determinants, 1 or -1; raises ValueError for singular ones."""
    with np.errstate(invalid="ignore"):
        sign, logarithm = np.linalg.slogdet(A)
    refuse(np.asarray(~np.isfinite(logarithm)), "finite and invertible", what)
    return np.asarray(sign)


def _common(mirrors: BoolArray) -> BoolArray:
    """Mask of sets (...) whose matrices mirror; raises ValueError if only some of a set do."""
    share = mirrors.mean(axis=-1)
    mixed = (share > 0) & (share < 1)
    if mixed.any():
        few = mirrors if share[mixed].flat[0] <= 0.5 else ~mirrors
        first = tuple(np.argwhere(mixed)[0])
        culprits = [(*(int(i) for i in first), int(k)) for k in np.flatnonzero(few[first])]
        names = ", ".join(str(index if first else index[0]) for index in culprits[:_SHOWN])
        more = f" and {len(culprits) - _SHOWN} more" if len(culprits) > _SHOWN else ""
        does = "mirrors" if mirrors[culprits[0]] else "does not mirror"
        raise ValueError(f"Invalid orientation at index {names}{more}: it {does}, the others differ. All must agree.")
    return np.asarray(share > 0)


def _chordal(O: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: E741 an orthogonal matrix
    """The rotation R nearest to the mean of rotations O_i, and the mean resultant length, that of tr(R^T O_i) / n."""
    U, scales, V = np.linalg.svd(np.einsum("...i,...ikl->...kl", w, O))
    sign = np.linalg.slogdet(U @ V)[0]
    U[..., -1] *= sign[..., None]
    scales[..., -1] *= sign
    return U @ V, scales.mean(axis=-1)


def _polar(B: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    U, _, V = np.linalg.svd(B)
    return _chordal(U @ V, w)


def _logarithmic(B: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    Q = lq(B)[1]
    R, length = _chordal(Q, w)
    if Q.shape[-1] == 2:
        base = np.arctan2(R[..., 1, 0], R[..., 0, 0])
        turned = transposed(R)[..., None, :, :] @ Q
        angle = base + np.einsum("...i,...i->...", w, np.arctan2(turned[..., 1, 0], turned[..., 0, 0]))
        cos, sin = np.cos(angle), np.sin(angle)
        return np.stack([np.stack([cos, -sin], axis=-1), np.stack([sin, cos], axis=-1)], axis=-2), length
    # The exponential of the skew-symmetric mean X, by the Hermitian i X.
    values, U = np.linalg.eigh(1j * np.einsum("...i,...ikl->...kl", w, _rotation_log(Q)))
    return np.asarray(((U * np.exp(-1j * values)[..., None, :]) @ transposed(U).conj()).real), length


def _rotation_log(Q: FloatArray) -> FloatArray:
    """The principal logarithm of rotations: in each rotated plane, angle / sine times the skew part."""
    cos, U = np.linalg.eigh(0.5 * (Q + transposed(Q)))
    skew = 0.5 * (Q - transposed(Q))
    sin = np.linalg.norm(skew @ U, axis=-2)
    wrong = ((cos < 0) & (sin < _HALF_TURN)).any(axis=-1)
    refuse(wrong, "less than 180 degrees for 'log'; try 'chordal'", "rotation")
    ratio = np.where(sin > 0, np.arctan2(sin, cos) / np.where(sin > 0, sin, 1.0), 1.0)
    return np.asarray((U * ratio[..., None, :]) @ transposed(U) @ skew)


ROTATIONS: dict[str, Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]] = {
    "chordal": _polar,
    "log": _logarithmic,
}
