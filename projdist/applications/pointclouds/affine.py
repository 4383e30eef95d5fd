"""The affine map between two sets of corresponding points in any dimension, and points that do not correspond.

Both sets are whitened, Y - mean = U R with orthonormal columns U. The singular values of U_z^T U_y are the canonical
correlations of the sets (Hotelling 1936), which affine maps of either set do not change. Least squares, z = A y + t
with errors in z alone, multiplies each canonical axis by its correlation: noise makes it shrink the points. The
symmetric fit uses the orthogonal polar factor of U_z^T U_y instead: exchanging the sets gives the inverse map, the
mapped points have the covariance of their targets, and nothing shrinks. In one dimension it is the reduced major axis.
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

_FLAT = 1e-12  # of the largest extent: a smaller extent is rounding
_ROUNDING = 8.0 * float(np.finfo(float).eps)  # of the coordinates themselves, which may be far from the origin


@dataclass(frozen=True, eq=False)
class AffineFit(Affine):
    """The map z = A y + shift, and the n canonical correlations in descending order; 1 for sets that agree exactly."""

    correlations: FloatArray


class WhitenedPoints(NamedTuple):
    """Points (M, n) as centre + basis @ root, the basis (M, n) with orthonormal columns.

    For weighted points the rows of the basis are multiplied by the square roots of the weights.
    """

    centre: FloatArray
    basis: FloatArray
    root: FloatArray


def _polar(link: FloatArray) -> FloatArray:
    """The orthogonal polar factor."""
    U, _, V = np.linalg.svd(link)
    return U @ V


FITS: dict[str, Callable[[FloatArray], FloatArray]] = {"symmetric": _polar, "least_squares": np.asarray}
"""The map between whitened coordinates, by the method, of their covariance U_z^T U_y."""


def affine_fit(
    source: ArrayLike, target: ArrayLike, *, method: str = "symmetric", weights: ArrayLike | None = None
) -> AffineFit:
    """The affine map of points (M, n) onto as many others; row k of one corresponds to row k of the other.

    `method`: "symmetric", for which exchanging the sets gives the inverse map, or "least_squares", with all errors in
    the target, which shrinks. `weights` (M,): a row of weight 2 counts as two rows, one of weight 0 as none.
    Raises ValueError for points that are not finite, for too few points or points in a subspace of fewer dimensions,
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
    """Weights of points, 0 for missing ones; raises ValueError, whose message begins with `invalid`."""
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
    """Weights of pairs of points, whose variances, the inverse weights, add up; of equal weights w it is w."""
    return np.asarray(2.0 * one * other / (one + other))


def check_fit(method: str) -> None:
    """Raise ValueError for an unknown method."""
    if method not in FITS:
        raise ValueError(f"Invalid method '{method}'. It must be {listed(list(FITS), 'or')}.")


def rank(points: FloatArray, weights: FloatArray) -> int:
    """Number of dimensions that points (M, n) with weights (M,) above 0 span beyond rounding."""
    if not len(points):
        return 0
    centre = weights @ points / weights.sum()
    extents = np.linalg.svd(np.sqrt(weights)[:, None] * (points - centre), compute_uv=False)
    rounding = _ROUNDING * np.abs(points).max() * np.sqrt(weights.sum())
    return int(np.sum(extents > max(_FLAT * extents[0], rounding)))


def whitened(points: FloatArray, weights: FloatArray) -> WhitenedPoints:
    """Whitened form of points (M, n) of rank n with weights (M,) above 0."""
    centre = weights @ points / weights.sum()
    U, extents, V = np.linalg.svd(np.sqrt(weights)[:, None] * (points - centre), full_matrices=False)
    return WhitenedPoints(centre, U, extents[:, None] * V)


def fit_whitened(y: WhitenedPoints, z: WhitenedPoints, method: str) -> AffineFit:
    """The fit of one whitened set onto another."""
    link = z.basis.T @ y.basis
    # z - centre = root_z^T w for the whitened w, and w_z = O w_y.
    A = z.root.T @ np.linalg.solve(y.root, FITS[method](link).T).T
    correlations = np.minimum(np.linalg.svd(link, compute_uv=False), 1.0)
    return AffineFit(A, z.centre - A @ y.centre, correlations)


# ---- outliers ------------------------------------------------------------------------------------


FALSE_ALARM = 0.05  # probability that a point is named in clouds without wrong partners
_KERNEL = 4.685  # standard deviations, beyond which a point has no weight
_STEPS = 50
_RESIDUAL_ROUNDING = 1e-9  # of the spread: smaller residuals are rounding, not noise
_SAME = 1e-10  # of weights, from step to step


class Suspects(NamedTuple):
    """Flags of wrong partners (N, M), and distances of points from the places that other clouds give them, (N, M).

    `left_out` is in the frame, from the fit of the cloud without the point; NaN if unknown.
    """

    wrong: BoolArray
    left_out: FloatArray


def wrong_partners(placed: FloatArray, weights: FloatArray) -> Suspects:
    """The wrong partners among clouds placed in one frame, (N, M, n), with weights (N, M)."""
    count, n, seen = len(placed), placed.shape[-1], weights > 0.0
    wrong, left_out = np.zeros(seen.shape, dtype=bool), np.full(seen.shape, np.nan)
    shared = seen & (seen.sum(axis=0) > 1)
    level = FALSE_ALARM / max(int(shared.sum()) if count > 2 else int(shared.sum()) // 2, 1)
    for i in range(count):
        rows = np.flatnonzero(shared[i])
        if len(rows) < 2 * n + 3:
            continue
        others = weights[:, rows].copy()
        others[i] = 0.0
        mean = others.sum(axis=0) / (others > 0.0).sum(axis=0)
        place = _medians(placed[:, rows], others)
        bad, distance = _wrong_rows(place, placed[i, rows], pair_weights(weights[i, rows], mean), level)
        wrong[i, rows], left_out[i, rows] = bad, distance
    return Suspects(_of_one_cloud(wrong, left_out), left_out)


def _of_one_cloud(wrong: BoolArray, left_out: FloatArray) -> BoolArray:
    """For each point only the worst cloud, which shifted the place that the others were compared with."""
    far = np.where(wrong, left_out, -np.inf)
    return np.asarray(wrong & (far == far.max(axis=0)) & (np.cumsum(wrong & (far == far.max(axis=0)), axis=0) == 1))


def _medians(places: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted medians, axis by axis, of the places (N, m, n) of m points with weights (N, m)."""
    places = np.where((weights > 0.0)[..., None], places, np.inf)
    order = np.argsort(places, axis=0)
    places = np.take_along_axis(places, order, axis=0)
    sums = np.cumsum(np.take_along_axis(np.broadcast_to(weights[..., None], places.shape), order, axis=0), axis=0)
    half = 0.5 * sums[-1]
    # Where the weights split into exact halves, up to rounding, the median is the middle of two places.
    low, high = (
        np.argmax(sums >= (1.0 + rounding) * half, axis=0) for rounding in (-_RESIDUAL_ROUNDING, _RESIDUAL_ROUNDING)
    )
    return np.asarray(0.5 * sum(np.take_along_axis(places, k[None], axis=0)[0] for k in (low, high)))


def _wrong_rows(
    place: FloatArray, points: FloatArray, weights: FloatArray, level: float
) -> tuple[BoolArray, FloatArray]:
    """Which of a cloud's points (m, n) are not at their place (m, n), and their distances from it, each left out."""
    from scipy.stats import chi2, f  # imported here: scipy is slow to load, and few need it

    n = points.shape[1]
    root = np.sqrt(weights / weights.mean())[:, None]
    scale = float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())
    X, points = root * np.column_stack([np.ones(len(place)), place]), root * points
    squares = _robust_squares(X, points, scale)
    bad = squares > chi2.isf(level, n)
    everything = np.ones(len(points), dtype=bool)
    _, distances = _left_out_squares(X, points, everything, scale)
    for _ in range(_STEPS):
        kept = ~bad
        if kept.sum() < 2 * n + 3:
            return np.zeros(len(points), dtype=bool), distances / root[:, 0]
        statistic, distances = _left_out_squares(X, points, kept, scale)
        freedom = kept.sum() - kept.astype(int) - (n + 1)  # of the covariance, without the point itself
        F = statistic * (freedom - n + 1) / (n * freedom)
        found = f.sf(F, n, freedom - n + 1) < level
        # Points that are near enough come back; of the kept points only the worst is dropped at a time.
        worst = found & kept
        if worst.any():
            worst &= statistic == statistic[worst].max()
        again = (bad & found) | worst
        if (again == bad).all():
            break
        bad = again
    return bad, distances / root[:, 0]


def _left_out_squares(X: FloatArray, y: FloatArray, kept: BoolArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """Hotelling's T^2 and distance of each point from the fit to the kept points without it."""
    Q, R = np.linalg.qr(X[kept])
    beta = np.linalg.solve(R, Q.T @ y[kept])
    residual = y - X @ beta
    leverage = np.sum(np.linalg.solve(R.T, X.T) ** 2, axis=0)
    leverage = np.minimum(leverage, np.where(kept, 1.0 - 1e-9, np.inf))
    n, count = y.shape[1], int(kept.sum())
    total = residual[kept].T @ residual[kept] + (_RESIDUAL_ROUNDING * scale) ** 2 * count * np.eye(n)
    # A kept point leaves the sum of squares: the Sherman-Morrison formula gives the inverse of what remains.
    factor = np.where(kept, 1.0 / (1.0 - leverage), 1.0 / (1.0 + leverage))
    whole = np.einsum("mi,ij,mj->m", residual, np.linalg.inv(total), residual)
    square = np.where(kept, whole / np.maximum(1.0 - factor * whole, 1e-12), whole)
    freedom = count - kept.astype(int) - X.shape[1]
    out = np.where(kept[:, None], residual / (1.0 - np.minimum(leverage, 1.0 - 1e-9))[:, None], residual)
    return freedom * factor * square, np.linalg.norm(out, axis=1)


def _robust_squares(X: FloatArray, y: FloatArray, scale: float) -> FloatArray:
    """Squared distances from a robust fit, in robust standard deviations."""
    from scipy.stats import chi2

    n = y.shape[1]
    half = chi2.median(n)
    w = np.ones(len(y))
    covariance = np.eye(n)
    for step in range(2 * _STEPS):
        root = np.sqrt(w)[:, None]
        residual = y - X @ np.linalg.lstsq(root * X, root * y, rcond=None)[0]
        squares = np.einsum("mi,ij,mj->m", residual, np.linalg.inv(covariance), residual)
        if step < _STEPS:  # least absolute distances
            again = 1.0 / np.maximum(np.sqrt(squares), 1e-6 * np.sqrt(np.mean(squares)) + 1e-300)
            again /= again.max()
        else:
            # Half of normal errors are below the median of chi^2; a fit of p parameters to m points makes them smaller.
            sigma2 = np.median(squares) / half * len(y) / (len(y) - X.shape[1])
            squares = squares / max(sigma2, 1e-300)
            u = squares / (_KERNEL**2 * n)
            again = np.maximum(1.0 - u, 0.0) ** 2
            inside = residual * np.sqrt(again)[:, None]
            covariance = inside.T @ inside / max(again.sum(), 1.0) + (_RESIDUAL_ROUNDING * scale) ** 2 * np.eye(n)
        if step > _STEPS and np.abs(again - w).max() < _SAME:
            break
        w = np.maximum(again, 1e-12)
    return squares
