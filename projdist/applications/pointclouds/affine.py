"""The affine map between two sets of points that correspond, in any dimension.

Both sets are whitened, Y - mean = U R with orthonormal columns U. The singular values of U_z^T U_y are the canonical
correlations of the sets (Hotelling 1936), which no affine map of either changes. Least squares, z = A y + t with errors
in z alone, multiplies each canonical axis by its correlation: it shrinks what it maps wherever there is noise. The
symmetric fit has the orthogonal polar factor in the place of U_z^T U_y: the map back is its inverse, the covariance of
the mapped points is that of their targets, and nothing shrinks. In one dimension it is the reduced major axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.matrices import Affine
from projdist.support import listed

__all__ = [
    "FITS",
    "AffineFit",
    "Whitened",
    "affine_fit",
    "check_fit",
    "checked_weights",
    "fit_whitened",
    "pair_weights",
    "rank",
    "whitened",
]

_FLAT = 1e-12  # of the greatest extent: an extent below it is rounding
_ROUNDING = 8.0 * float(np.finfo(float).eps)  # of the coordinates themselves, which may lie far from their origin


@dataclass(frozen=True, eq=False)
class AffineFit(Affine):
    """The map z = A y + shift, and the n canonical correlations, greatest first; 1 where the sets agree exactly."""

    correlations: FloatArray


class Whitened(NamedTuple):
    """Points (M, n) as centre + basis @ root, the basis (M, n) with orthonormal columns.

    Of points with weights its rows are times their roots.
    """

    centre: FloatArray
    basis: FloatArray
    root: FloatArray


def _polar(link: FloatArray) -> FloatArray:
    U, _, V = np.linalg.svd(link)
    return U @ V


def _itself(link: FloatArray) -> FloatArray:
    return link


FITS: dict[str, Callable[[FloatArray], FloatArray]] = {"symmetric": _polar, "least_squares": _itself}


def affine_fit(
    source: ArrayLike, target: ArrayLike, *, method: str = "symmetric", weights: ArrayLike | None = None
) -> AffineFit:
    """The affine map of points (M, n) onto as many others; row k of one corresponds to row k of the other.

    `method` "symmetric": exchanging the sets gives the inverse map. "least_squares": errors are all in
    the target; it shrinks. `weights` (M,): what each row counts; one of weight 2 is as two rows, one of 0 as none.
    Raises ValueError for points that are not finite, for sets that are too few or lie in a plane of fewer dimensions,
    and for weights that are negative, not finite, or all 0.

    >>> affine_fit([[0, 0], [1, 0], [0, 1]], [[5, 5], [7, 5], [5, 6]]).matrix.round(12) + 0.0
    array([[2., 0.],
           [0., 1.]])
    """
    check_fit(method)
    y, z = (np.asarray(points, dtype=float) for points in (source, target))
    if y.ndim != 2 or y.shape != z.shape or y.size == 0:
        raise ValueError(f"Invalid shapes {y.shape} and {z.shape} of points. Both must be (M, n).")
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise ValueError("Invalid points. They must be finite.")
    w = (
        np.ones(len(y))
        if weights is None
        else checked_weights(weights, np.zeros(len(y), dtype=bool), "Invalid weights.")
    )
    y, z, w = y[w > 0.0], z[w > 0.0], w[w > 0.0]
    for points in (y, z):
        if (span := rank(points, w)) < points.shape[1]:
            raise ValueError(f"Invalid points. They must span {points.shape[1]} dimensions, and span {span}.")
    return fit_whitened(whitened(y, w), whitened(z, w), method)


def checked_weights(given: ArrayLike, missing: BoolArray, invalid: str) -> FloatArray:
    """Weights of points, 0 of those that are missing; raises ValueError, which begins as told."""
    try:
        weights = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{invalid} They must be numbers.") from error
    if weights.shape != missing.shape:
        raise ValueError(f"{invalid} There must be one a point, {len(missing)}; their shape is {weights.shape}.")
    weights = np.where(missing, 0.0, weights)
    wrong = ~(np.isfinite(weights) & (weights >= 0.0))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"{invalid} That of point {k + 1} is {weights[k]:g}; it must be finite and not negative.")
    if not weights.any():
        raise ValueError(f"{invalid} They must not all be 0.")
    return weights


def pair_weights(one: FloatArray, other: FloatArray) -> FloatArray:
    """What pairs of points count: weights are inverse variances, and the variances of the two add up."""
    return np.asarray(2.0 * one * other / (one + other))


def check_fit(method: str) -> None:
    """Raise ValueError for a method that there is not."""
    if method not in FITS:
        raise ValueError(f"Invalid method '{method}'. It must be {listed(list(FITS), 'or')}.")


def rank(points: FloatArray, weights: FloatArray) -> int:
    """How many dimensions points (M, n) with weights (M,) above 0 span; rounding spans none."""
    if not len(points):
        return 0
    centre = weights @ points / weights.sum()
    extents = np.linalg.svd(np.sqrt(weights)[:, None] * (points - centre), compute_uv=False)
    rounding = _ROUNDING * np.abs(points).max() * np.sqrt(weights.sum())
    return int(np.sum(extents > max(_FLAT * extents[0], rounding)))


def whitened(points: FloatArray, weights: FloatArray) -> Whitened:
    """Points (M, n), whose rank is n, with weights (M,) above 0, whitened."""
    centre = weights @ points / weights.sum()
    U, extents, V = np.linalg.svd(np.sqrt(weights)[:, None] * (points - centre), full_matrices=False)
    return Whitened(centre, U, extents[:, None] * V)


def fit_whitened(y: Whitened, z: Whitened, method: str) -> AffineFit:
    """The fit of one whitened set onto another."""
    link = z.basis.T @ y.basis
    # z - centre = root_z^T w for the whitened w, and w_z = O w_y.
    A = z.root.T @ np.linalg.solve(y.root, FITS[method](link).T).T
    correlations = np.minimum(np.linalg.svd(link, compute_uv=False), 1.0)
    return AffineFit(A, z.centre - A @ y.centre, correlations)
