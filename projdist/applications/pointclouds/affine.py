"""Affine maps of corresponding points in any dimension, from one cloud to another and of many into one frame; outliers.

Two sets are whitened, Y - mean = U R with orthonormal columns U. The singular values of U_z^T U_y are the canonical
correlations of the sets (Hotelling 1936), which affine maps of either set do not change. Least squares, z = A y + t
with errors in z alone, multiplies each canonical axis by its correlation: noise makes it shrink the points. The
symmetric fit uses the orthogonal polar factor of U_z^T U_y instead: exchanging the sets gives the inverse map, the
mapped points have the covariance of their targets, and nothing shrinks. In one dimension it is the reduced major axis.

Of many clouds the symmetric answer is self-consistent: each is placed by its symmetric fit onto the weighted mean of
all, and no cloud is the reference. The mean is determined up to an affine map and kept whitened. With every point in
every cloud this is a generalised Procrustes analysis (Gower 1975) of whitened clouds. It starts from the largest roots
of generalised canonical correlations (Kettenring 1971; with missing points, van de Velden & Takane 2012), a symmetric
eigenproblem. Weights (N, M) are 0 where a cloud lacks a point.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray
from projdist.matrices import Affine, principal_scales
from projdist.support import check_choice

_FLAT = 1e-12  # of the largest extent: a smaller extent is rounding
_ROUNDING = 8.0 * float(np.finfo(float).eps)  # of the coordinates themselves, which may be far from the origin


@dataclass(frozen=True, eq=False)
class AffineFit(Affine):
    """The map z = A y + shift, with the n canonical correlations in descending order, 1 if the sets agree exactly."""

    correlations: FloatArray


class WhitenedPoints(NamedTuple):
    """Weighted points (M, n), factored: the roots of the weights times (points - centre) are basis @ root."""

    centre: FloatArray  # (n,)
    basis: FloatArray  # (M, n), with orthonormal columns
    root: FloatArray  # (n, n)


FITS = ("symmetric", "least_squares")


def affine_fit(
    source: ArrayLike, target: ArrayLike, *, method: str = "symmetric", weights: ArrayLike | None = None
) -> AffineFit:
    """The affine map of points (M, n) onto as many others; row k of one corresponds to row k of the other.

    `method`: "symmetric", for which exchanging the sets gives the inverse map, or "least_squares", with all errors in
    the target, which shrinks. `weights` (M,): a row of weight 2 counts as two rows, one of weight 0 as none.
    Raises ValueError for points that are not finite or too few to span all dimensions, and for weights likewise.

    >>> affine_fit([[0, 0], [1, 0], [0, 1]], [[5, 5], [7, 5], [5, 6]]).matrix.round(12) + 0.0
    array([[2., 0.],
           [0., 1.]])
    """
    check_choice("method", method, FITS)
    y, z = (np.asarray(points, dtype=float) for points in (source, target))
    if y.ndim != 2 or y.shape != z.shape or y.size == 0:
        raise ValueError(f"Invalid shapes {y.shape} and {z.shape} of points. Both must be (M, n).")
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise ValueError("Invalid points. They must be finite.")
    w = checked_weights(np.ones(len(y)) if weights is None else weights, np.zeros(len(y), bool), "Invalid weights.")
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
        raise ValueError(f"{invalid} There must be {len(missing)}, one per point; their shape is {weights.shape}.")
    weights = np.where(missing, 0.0, weights)
    wrong = ~(np.isfinite(weights) & (weights >= 0.0))
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ValueError(f"{invalid} That of point {k + 1} is {weights[k]:g}; it must be finite and not negative.")
    if not weights.any():
        raise ValueError(f"{invalid} They must not all be 0.")
    return weights


def pair_weights(one: FloatArray, other: FloatArray) -> FloatArray:
    """Weights of pairs of points whose variances, the inverse weights, add up; two weights w give w."""
    return np.asarray(2.0 * one * other / (one + other))


def rank(points: FloatArray, weights: FloatArray) -> int:
    """Number of dimensions that points (M, n) with weights (M,) above 0 span beyond rounding."""
    if not len(points):
        return 0
    extents = np.linalg.svd(np.sqrt(weights)[:, None] * (points - (weights @ points / weights.sum())), compute_uv=False)
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
    correlations = np.minimum(np.linalg.svd(link, compute_uv=False), 1.0)
    if method == "symmetric":
        U, _, V = np.linalg.svd(link)
        link = U @ V
    # z - centre = root_z^T w for the whitened w, and w_z = link w_y.
    A = z.root.T @ np.linalg.solve(y.root, link.T).T
    return AffineFit(A, z.centre - A @ y.centre, correlations)


# ---- outliers ------------------------------------------------------------------------------------

FALSE_ALARM = 0.05  # probability that a point is named in clouds without wrong partners
_KERNEL = 4.685  # standard deviations beyond which a point has no weight
_STEPS = 50
_RESIDUAL_ROUNDING = 1e-9  # of the spread: smaller residuals are rounding, not noise
_SAME = 1e-10  # change of weights in a step below which they have converged


def wrong_partners(placed: FloatArray, weights: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Flags of wrong partners among clouds in one frame, (N, M, n), with weights (N, M), and distances (N, M)."""
    # Distances are those from the places that the other clouds give, by the fit without the point; NaN if unknown.
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
    # Of each point only the farthest cloud counts as wrong: it shifted the place that the others were compared with.
    far = np.where(wrong, left_out, -np.inf)
    worst = wrong & (far == far.max(axis=0))
    return np.asarray(worst & (np.cumsum(worst, axis=0) == 1)), left_out


def _medians(places: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted medians, axis by axis, of the places (N, m, n) of m points with weights (N, m)."""
    places = np.where((weights > 0.0)[..., None], places, np.inf)
    order = np.argsort(places, axis=0)
    places = np.take_along_axis(places, order, axis=0)
    sums = np.cumsum(np.take_along_axis(np.broadcast_to(weights[..., None], places.shape), order, axis=0), axis=0)
    half = 0.5 * sums[-1]
    # Where the weights split into exact halves, up to rounding, the median is the middle of two places.
    both = (np.argmax(sums >= (1.0 + way * _RESIDUAL_ROUNDING) * half, axis=0) for way in (-1.0, 1.0))
    return np.asarray(0.5 * sum(np.take_along_axis(places, k[None], axis=0)[0] for k in both))


def _wrong_rows(
    place: FloatArray, points: FloatArray, weights: FloatArray, level: float
) -> tuple[BoolArray, FloatArray]:
    """Flags of a cloud's points (m, n) that are not at their places (m, n), and distances by fits without the point."""
    from scipy.stats import chi2, f  # imported here: scipy is slow to load, and few need it

    n = points.shape[1]
    root = np.sqrt(weights / weights.mean())[:, None]
    scale = float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())
    X, points = root * np.column_stack([np.ones(len(place)), place]), root * points
    bad = _robust_squares(X, points, scale) > chi2.isf(level, n)
    _, distances = _left_out_squares(X, points, np.ones(len(points), dtype=bool), scale)
    for _ in range(_STEPS):
        kept = ~bad
        if kept.sum() < 2 * n + 3:
            return np.zeros(len(points), dtype=bool), distances / root[:, 0]
        statistic, distances = _left_out_squares(X, points, kept, scale)
        freedom = kept.sum() - kept.astype(int) - (n + 1)  # of the covariance, without the point itself
        found = f.sf(statistic * (freedom - n + 1) / (n * freedom), n, freedom - n + 1) < level
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
    residual = y - X @ np.linalg.solve(R, Q.T @ y[kept])
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
            again = np.maximum(1.0 - squares / (_KERNEL**2 * n), 0.0) ** 2
            inside = residual * np.sqrt(again)[:, None]
            covariance = inside.T @ inside / max(again.sum(), 1.0) + (_RESIDUAL_ROUNDING * scale) ** 2 * np.eye(n)
        if step > _STEPS and np.abs(again - w).max() < _SAME:
            break
        w = np.maximum(again, 1e-12)
    return squares


# ---- many clouds ---------------------------------------------------------------------------------

_MEAN_STEPS = 300  # 3 to 30 suffice, except for chains of thirty clouds with noise of a tenth of their spread
_CONVERGED, _ACCEPTED = 1e-14, 1e-10  # of the spread of the mean: steps at which to stop, and that still count
_VANISHING = 1e-10  # of a squared length of 1


class Group(NamedTuple):
    """The maps A_i y + shift_i of N clouds, and their canonical correlations with the mean."""

    A: FloatArray  # (N, n, n)
    shift: FloatArray  # (N, n)
    correlations: FloatArray  # (N, n), in descending order
    converged: bool


def kept_clouds(
    points: FloatArray, weights: FloatArray, *, first_only: bool = False
) -> tuple[list[int], dict[int, str]]:
    """Numbers of the clouds in the largest connected set, and reasons why others are not in it; points (N, M, n)."""
    # A cloud joins the set if the points that it shares with it, or with the first cloud only, span all n dimensions.
    n = points.shape[-1]
    reasons = {}
    for i in range(len(points)):
        if (dimensions := _span(points, weights, i)) < n:
            reasons[i] = _reason(int((weights[i] > 0.0).sum()), dimensions, n, "it has")
    able = [i for i in range(len(points)) if i not in reasons]
    best: list[int] = []
    seeds = [i for i in able if i == 0] if first_only else able
    for seed in seeds:
        found = _grown(points, weights, able, seed, first_only)
        if len(found) > len(best):
            best = found
        if len(best) == len(able):
            break
    there = np.asarray(weights[best].any(axis=0))
    for i in set(able) - set(best):
        shared = int((there & (weights[i] > 0.0)).sum())
        reasons[i] = _reason(shared, _span(points, weights, i, there), n, "it shares with the others")
    return best, dict(sorted(reasons.items()))


def _span(points: FloatArray, weights: FloatArray, i: int, there: BoolArray | None = None) -> int:
    """Number of dimensions spanned by the points of cloud i, or by those of them marked in `there`."""
    some = (weights[i] > 0.0) if there is None else there & (weights[i] > 0.0)
    return rank(points[i][some], weights[i][some])


def _grown(points: FloatArray, weights: FloatArray, able: list[int], seed: int, first_only: bool) -> list[int]:
    """The connected set of clouds that contains the cloud `seed`."""
    members, there = [seed], weights[seed] > 0.0
    waiting = [i for i in able if i != seed]
    while True:
        joined = [i for i in waiting if _span(points, weights, i, there) == points.shape[-1]]
        if not joined:
            return sorted(members)
        members += joined
        waiting = [i for i in waiting if i not in joined]
        if first_only:
            return sorted(members)
        there |= weights[joined].any(axis=0)


def _reason(count: int, dimensions: int, n: int, what: str) -> str:
    """The reason why `count` points that span so many dimensions are too few."""
    if count <= n:
        return f"{what} {count} point{'s' if count != 1 else ''}, and {n + 1} are needed"
    return f"the {count} points that {what} span {dimensions} of {n} dimensions"


def onto_first(points: FloatArray, weights: FloatArray) -> Group:
    """Least-squares fits of each cloud onto the first, which shrink, for comparison."""
    fits = []
    for cloud, counts in zip(points, weights, strict=True):
        both = (counts > 0.0) & (weights[0] > 0.0)
        w = pair_weights(counts[both], weights[0, both])
        fits.append(fit_whitened(whitened(cloud[both], w), whitened(points[0][both], w), "least_squares"))
    return _grouped(fits, True)


def consensus(points: FloatArray, weights: FloatArray) -> Group:
    """The self-consistent symmetric fit of connected clouds (see `kept_clouds`)."""
    # Along chains of clouds this converges slowly, so each step is extrapolated to the limit of linear fits.
    shared = (weights > 0.0).sum(axis=0) > 1
    clouds = _Clouds(points[:, shared], weights[:, shared])
    mean = clouds.start
    for _ in range(_MEAN_STEPS):
        move = clouds.next_mean(mean) - mean
        change = float(np.linalg.norm(clouds.roots * move)) / np.sqrt(mean.size)
        if change < _CONVERGED:
            break
        parts = clouds.vectors.T @ (clouds.roots * move)
        following = clouds.vectors @ ((clouds.values / (1.0 - clouds.values))[:, None] * parts) / clouds.roots
        mean = clouds.whitened_mean(mean + (move + following))
    return _grouped(clouds.fits(mean), change < _ACCEPTED)


def _grouped(fits: list[AffineFit], converged: bool) -> Group:
    """Fits of clouds as one group."""
    A, shift = np.stack([one.matrix for one in fits]), np.stack([one.shift for one in fits])
    return Group(A, shift, np.stack([one.correlations for one in fits]), converged)


class _Clouds:
    """Clouds to be fitted onto a mean of M points, each in at least two of the clouds.

    `start` is the mean that changes least by simultaneous least-squares fits, projections onto each cloud's affine
    functions. Of the eigenvalues of the mean projection the n + 1 largest belong to the mean of the clouds and to the
    constant; the others, `values`, are the shares of a move along `vectors` that each step keeps.
    """

    def __init__(self, points: FloatArray, weights: FloatArray) -> None:
        self.rows = [np.flatnonzero(counts) for counts in weights]
        self.points = [cloud[row] for cloud, row in zip(points, self.rows, strict=True)]
        self.weights = [counts[row] for counts, row in zip(weights, self.rows, strict=True)]
        self.whitened = [whitened(cloud, w) for cloud, w in zip(self.points, self.weights, strict=True)]
        self.roots = np.sqrt(weights.sum(axis=0))[:, None]
        n = points.shape[-1]
        F = np.zeros((len(self.roots), len(self.rows) * (n + 1)))
        for i, (row, cloud, w) in enumerate(zip(self.rows, self.whitened, self.weights, strict=True)):
            root = np.sqrt(w)[:, None]
            F[row, i * (n + 1) : (i + 1) * (n + 1)] = root * np.hstack([root / np.sqrt(w.sum()), cloud.basis])
        F /= self.roots
        values, V = np.linalg.eigh(F.T @ F)
        some = values > _VANISHING
        values, U = values[some], F @ V[:, some] / np.sqrt(values[some])
        mean = self.roots * self._centred(U[:, -n - 1 :] / self.roots)
        self.start = np.linalg.svd(mean, full_matrices=False)[0][:, :n] / self.roots
        self.values, self.vectors = np.minimum(values[: -n - 1], 1.0 - _VANISHING), U[:, : -n - 1]

    def fits(self, mean: FloatArray) -> list[AffineFit]:
        """Symmetric fits of each cloud onto the mean."""
        clouds = zip(self.rows, self.whitened, self.weights, strict=True)
        return [fit_whitened(cloud, whitened(mean[row], w), "symmetric") for row, cloud, w in clouds]

    def next_mean(self, mean: FloatArray) -> FloatArray:
        """The whitened mean of the clouds fitted onto a mean, rotated onto that, as whitening leaves axes free."""
        total = np.zeros_like(mean)
        for row, cloud, w, fit in zip(self.rows, self.points, self.weights, self.fits(mean), strict=True):
            total[row] += w[:, None] * fit(cloud)
        image = self.whitened_mean(total / self.roots**2)
        U, _, V = np.linalg.svd((self.roots * image).T @ (self.roots * mean))
        return image @ U @ V

    def whitened_mean(self, points: FloatArray) -> FloatArray:
        """The nearest centred points whose columns, times the square roots of the weights, are orthonormal."""
        U, _, V = np.linalg.svd(self.roots * self._centred(points), full_matrices=False)
        return U @ V / self.roots

    def _centred(self, points: FloatArray) -> FloatArray:
        """Points minus their weighted mean."""
        w = self.roots**2
        return np.asarray(points - (w * points).sum(axis=0) / w.sum())


def dist_squares(T: FloatArray, A: FloatArray) -> FloatArray:
    """Dist_F(T^-1 A_i)^2 of matrices (N, n, n)."""
    return np.asarray(np.sum(np.log(principal_scales(np.linalg.solve(T, A))) ** 2, axis=-1))


def upright(group: Group) -> tuple[Group, BoolArray]:
    """The maps into a frame in which most clouds are not mirrored, and flags of the mirrored ones."""
    # With equally many of both the first cloud is not mirrored.
    signs = np.linalg.slogdet(group.A)[0]
    most = np.sign(signs.sum()) or signs[0]
    flip = np.ones(group.shift.shape[1])
    flip[-1] = most
    return group._replace(A=flip[:, None] * group.A, shift=flip * group.shift), np.asarray(signs != most)


def placed(A: FloatArray, shift: FloatArray, points: FloatArray) -> FloatArray:
    """Points (N, M, n) mapped into the frame."""
    return np.einsum("nij,nmj->nmi", A, points) + shift[:, None]
