"""Points that are no partners of those they are said to be: found by what chance lets no residual be.

Each cloud is fitted, by an affine regression, to the places that the other clouds give its points. First robustly, by
iteratively reweighted least squares with Tukey's biweight (4.685 standard deviations), started from least absolute
distances; what lies far from that is suspect. Then by least squares to the others: a suspect is wrong where Hotelling's
T^2 of its residual, left out of the fit and of the covariance, exceeds what normal errors reach with a chance of 5 % in
any point of any cloud (Bonferroni). T^2 does not see affine maps, and covariances may differ from cloud to cloud.
Weights are inverse variances, up to a factor: rows of a regression are times their roots.

Sources: Beaton & Tukey 1974, The fitting of power series, Technometrics 16 (the kernel); Caroni 1987, Residuals and
influence in the multivariate linear model, The Statistician 36 (residuals of points left out).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.pointclouds.affine import pair_weights

__all__ = ["FALSE_ALARM", "Suspects", "wrong_partners"]

FALSE_ALARM = 0.05  # the chance that any point of clouds without wrong partners is named
_KERNEL = 4.685  # standard deviations, beyond which a point does not count
_STEPS = 50
_ROUNDING = 1e-9  # of the spread: residuals below are rounding, which chance has no part in
_SAME = 1e-10  # of weights, from step to step


class Suspects(NamedTuple):
    """What lies where it should not, (N, M), and the distances of all points from where the others have them.

    `left_out` (N, M): as the fit of the cloud without the point has it, in the frame; NaN where it cannot be told.
    """

    wrong: BoolArray
    left_out: FloatArray


def wrong_partners(placed: FloatArray, weights: FloatArray) -> Suspects:
    """The wrong points among clouds that were placed in one frame, (N, M, n), with weights (N, M)."""
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
    """Of each point the worst cloud alone: where it is wrong, it has drawn away the place that the others have."""
    far = np.where(wrong, left_out, -np.inf)
    return np.asarray(wrong & (far == far.max(axis=0)) & (np.cumsum(wrong & (far == far.max(axis=0)), axis=0) == 1))


def _medians(places: FloatArray, weights: FloatArray) -> FloatArray:
    """Of each of m points the median, axis by axis, of its places (N, m, n) with weights (N, m)."""
    places = np.where((weights > 0.0)[..., None], places, np.inf)
    order = np.argsort(places, axis=0)
    places = np.take_along_axis(places, order, axis=0)
    sums = np.cumsum(np.take_along_axis(np.broadcast_to(weights[..., None], places.shape), order, axis=0), axis=0)
    half = 0.5 * sums[-1]
    # Where the weights halve exactly, but for rounding, the median is in the middle of two places.
    low, high = (np.argmax(sums >= (1.0 + rounding) * half, axis=0) for rounding in (-_ROUNDING, _ROUNDING))
    return np.asarray(0.5 * sum(np.take_along_axis(places, k[None], axis=0)[0] for k in (low, high)))


def _wrong_rows(
    place: FloatArray, points: FloatArray, weights: FloatArray, level: float
) -> tuple[BoolArray, FloatArray]:
    """Which of a cloud's points (m, n) are not at their place (m, n), and how far each is, left out of the fit."""
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
        freedom = kept.sum() - kept.astype(int) - (n + 1)  # of the covariance, to which a kept point does not count
        F = statistic * (freedom - n + 1) / (n * freedom)
        found = f.sf(F, n, freedom - n + 1) < level
        # What is as near as chance lets it be comes back; of those that were kept only the worst may go at a time.
        worst = found & kept
        if worst.any():
            worst &= statistic == statistic[worst].max()
        again = (bad & found) | worst
        if (again == bad).all():
            break
        bad = again
    return bad, distances / root[:, 0]


def _left_out_squares(X: FloatArray, y: FloatArray, kept: BoolArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """T^2 of each point as the fit to the kept ones without it has it, and its distance from there."""
    Q, R = np.linalg.qr(X[kept])
    beta = np.linalg.solve(R, Q.T @ y[kept])
    residual = y - X @ beta
    leverage = np.sum(np.linalg.solve(R.T, X.T) ** 2, axis=0)
    leverage = np.minimum(leverage, np.where(kept, 1.0 - 1e-9, np.inf))
    n, count = y.shape[1], int(kept.sum())
    total = residual[kept].T @ residual[kept] + (_ROUNDING * scale) ** 2 * count * np.eye(n)
    # A kept point leaves the sum of squares: Sherman & Morrison's formula for the inverse of what remains.
    factor = np.where(kept, 1.0 / (1.0 - leverage), 1.0 / (1.0 + leverage))
    whole = np.einsum("mi,ij,mj->m", residual, np.linalg.inv(total), residual)
    square = np.where(kept, whole / np.maximum(1.0 - factor * whole, 1e-12), whole)
    freedom = count - kept.astype(int) - X.shape[1]
    out = np.where(kept[:, None], residual / (1.0 - np.minimum(leverage, 1.0 - 1e-9))[:, None], residual)
    return freedom * factor * square, np.linalg.norm(out, axis=1)


def _robust_squares(X: FloatArray, y: FloatArray, scale: float) -> FloatArray:
    """The squared distances, in robust standard deviations, from the robust fit."""
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
            # Of normal errors half have less than the median of chi^2; a fit of p numbers to m points leaves less.
            sigma2 = np.median(squares) / half * len(y) / (len(y) - X.shape[1])
            squares = squares / max(sigma2, 1e-300)
            u = squares / (_KERNEL**2 * n)
            again = np.maximum(1.0 - u, 0.0) ** 2
            inside = residual * np.sqrt(again)[:, None]
            covariance = inside.T @ inside / max(again.sum(), 1.0) + (_ROUNDING * scale) ** 2 * np.eye(n)
        if step > _STEPS and np.abs(again - w).max() < _SAME:
            break
        w = np.maximum(again, 1e-12)
    return squares
