"""Affine maps of many clouds into one frame, from points that some of the clouds have in common.

Weights (N, M) are 0 where a cloud lacks a point; the mean is weighted. The symmetric answer is self-consistent: each
cloud is placed by its symmetric fit onto the mean of all, and no cloud is the reference. The mean is determined up to
an affine map and kept whitened. With every point in every cloud this is a generalised Procrustes analysis (Gower 1975)
of whitened clouds. It starts from the largest roots of generalised canonical correlations (Kettenring 1971; with
missing points, van de Velden & Takane 2012), a symmetric eigenproblem.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.pointclouds.affine import AffineFit, fit_whitened, pair_weights, rank, whitened
from projdist.matrices import Rotation, mean_rotation, principal_scales

_STEPS = 300  # 3 to 30 suffice, except for chains of thirty clouds with noise of a tenth of their spread
_CONVERGED, _ACCEPTED = 1e-14, 1e-10  # of the spread of the mean: steps at which to stop, and that still count
_ROUNDING = 1e-10  # of a squared length of 1


class Group(NamedTuple):
    """The maps A_i y + shift_i of N clouds, and their canonical correlations with the mean."""

    A: FloatArray  # (N, n, n)
    shift: FloatArray  # (N, n)
    correlations: FloatArray  # (N, n), in descending order
    converged: bool


class Kept(NamedTuple):
    """Numbers of the clouds that can be registered together, and the reasons why others cannot."""

    clouds: list[int]
    reasons: dict[int, str]


# ---- which clouds ---------------------------------------------------------------------------


def kept_clouds(points: FloatArray, weights: FloatArray, *, first_only: bool = False) -> Kept:
    """The largest connected set of clouds, points (N, M, n) with weights (N, M).

    A cloud joins the set if the points that it shares with it span all n dimensions; with `first_only`, if those that
    it shares with the first cloud do.
    """
    n = points.shape[-1]
    reasons = {}
    for i in range(len(points)):
        if (dimensions := _span(points, weights, i)) < n:
            reasons[i] = _reason(int((weights[i] > 0.0).sum()), dimensions, n, "it has")
    able = [i for i in range(len(points)) if i not in reasons]
    best: list[int] = []
    for seed in able[:1] if first_only and able[:1] == [0] else [] if first_only else able:
        found = _grown(points, weights, able, seed, first_only)
        if len(found) > len(best):
            best = found
        if len(best) == len(able):
            break
    there = np.asarray(weights[best].any(axis=0))
    for i in set(able) - set(best):
        shared = int((there & (weights[i] > 0.0)).sum())
        reasons[i] = _reason(shared, _span(points, weights, i, there), n, "it shares with the others")
    return Kept(best, dict(sorted(reasons.items())))


def _span(points: FloatArray, weights: FloatArray, i: int, there: BoolArray | None = None) -> int:
    """Number of dimensions that the points of cloud i span, or those of them marked in `there`."""
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
    """Why so many points, which span so many dimensions, are too few."""
    if count <= n:
        return f"{what} {count} point{'s' if count != 1 else ''}, and {n + 1} are needed"
    return f"the {count} points that {what} span {dimensions} of {n} dimensions"


# ---- the maps -------------------------------------------------------------------------------


def onto_first(points: FloatArray, weights: FloatArray) -> Group:
    """Least-squares fits of each cloud onto the first, which shrink, for comparison."""
    fits = []
    for cloud, counts in zip(points, weights, strict=True):
        both = (counts > 0.0) & (weights[0] > 0.0)
        w = pair_weights(counts[both], weights[0, both])
        fits.append(fit_whitened(whitened(cloud[both], w), whitened(points[0][both], w), "least_squares"))
    return _grouped(fits, True)


def consensus(points: FloatArray, weights: FloatArray) -> Group:
    """The self-consistent symmetric fit of connected clouds (see `kept_clouds`).

    Alternating fits and means converges slowly along chains of clouds; each step is therefore extrapolated to the limit
    that it would have if the fits were linear.
    """
    shared = (weights > 0.0).sum(axis=0) > 1
    clouds = _Clouds(points[:, shared], weights[:, shared])
    mean = clouds.start
    for _ in range(_STEPS):
        move = clouds.next_mean(mean) - mean
        change = float(np.linalg.norm(clouds.roots * move)) / np.sqrt(mean.size)
        if change < _CONVERGED:
            break
        mean = clouds.whitened_mean(mean + clouds.extrapolated(move))
    return _grouped(clouds.fits(mean), change < _ACCEPTED)


def _grouped(fits: list[AffineFit], converged: bool) -> Group:
    """Fits of clouds as one group."""
    A, shift, correlations = map(
        np.stack, zip(*((one.matrix, one.shift, one.correlations) for one in fits), strict=True)
    )
    return Group(A, shift, correlations, converged)


class _Clouds:
    """Clouds to be fitted onto a mean of M points, each in at least two of the clouds."""

    def __init__(self, points: FloatArray, weights: FloatArray) -> None:
        self.rows = [np.flatnonzero(counts) for counts in weights]
        self.points = [cloud[row] for cloud, row in zip(points, self.rows, strict=True)]
        self.weights = [counts[row] for counts, row in zip(weights, self.rows, strict=True)]
        self.whitened = [whitened(cloud, w) for cloud, w in zip(self.points, self.weights, strict=True)]
        self.roots = np.sqrt(weights.sum(axis=0))[:, None]
        self.start, self.values, self.vectors = self._linear(points.shape[-1])

    def _linear(self, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The mean that simultaneous least-squares fits change least, and the other eigenvalues and vectors.

        The fits are projections onto the affine functions of each cloud. The n + 1 largest eigenvalues of their mean
        belong to the mean of the clouds and to the constant; the others say how much of a move each step keeps.
        """
        F = np.zeros((len(self.roots), len(self.rows) * (n + 1)))
        for i, (row, cloud, w) in enumerate(zip(self.rows, self.whitened, self.weights, strict=True)):
            root = np.sqrt(w)[:, None]
            F[row, i * (n + 1) : (i + 1) * (n + 1)] = root * np.hstack([root / np.sqrt(w.sum()), cloud.basis])
        F /= self.roots
        values, V = np.linalg.eigh(F.T @ F)
        some = values > _ROUNDING
        values, U = values[some], F @ V[:, some] / np.sqrt(values[some])
        mean = self.roots * self._centred(U[:, -n - 1 :] / self.roots)
        basis = np.linalg.svd(mean, full_matrices=False)[0][:, :n]
        return basis / self.roots, np.minimum(values[: -n - 1], 1.0 - _ROUNDING), U[:, : -n - 1]

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

    def extrapolated(self, move: FloatArray) -> FloatArray:
        """The sum of a move and all moves that would follow it if the fits were linear."""
        parts = self.vectors.T @ (self.roots * move)
        return move + self.vectors @ ((self.values / (1.0 - self.values))[:, None] * parts) / self.roots

    def whitened_mean(self, points: FloatArray) -> FloatArray:
        """The nearest centred points whose columns, times the square roots of the weights, are orthonormal."""
        U, _, V = np.linalg.svd(self.roots * self._centred(points), full_matrices=False)
        return U @ V / self.roots

    def _centred(self, points: FloatArray) -> FloatArray:
        """Points minus their weighted mean."""
        w = self.roots**2
        return np.asarray(points - (w * points).sum(axis=0) / w.sum())


# ---- placing -------------------------------------------------------------------------------------


def dist_squares(T: FloatArray, A: FloatArray) -> FloatArray:
    """Dist_F(T^-1 A_i)^2 of matrices (N, n, n)."""
    return np.asarray(np.sum(np.log(principal_scales(np.linalg.solve(T, A))) ** 2, axis=-1))


def upright(group: Group) -> tuple[Group, BoolArray]:
    """The maps into a frame in which most clouds are not mirrored, and flags of the mirrored ones.

    With equally many of both the first cloud is not mirrored.
    """
    signs = np.linalg.slogdet(group.A)[0]
    most = np.sign(signs.sum()) or signs[0]
    flip = np.ones(group.shift.shape[1])
    flip[-1] = most
    return group._replace(A=flip[:, None] * group.A, shift=flip * group.shift), np.asarray(signs != most)


def into_cloud(group: Group, reference: int) -> tuple[FloatArray, FloatArray]:
    """Matrices and shifts into the coordinates of a cloud."""
    frame = group.A[reference]
    shift = np.linalg.solve(frame, (group.shift - group.shift[reference]).T).T
    return np.asarray(np.linalg.solve(frame, group.A)), np.asarray(shift)


def into_mdt(
    group: Group, T: FloatArray, mirrored: BoolArray, points: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, Rotation]:
    """Matrices and shifts into the frame of the MDT; points (N, M, n) keep their mean rotation and position."""
    rotation = mean_rotation(group.A[~mirrored], T=T)
    A, shift = (np.einsum("ij,nj...->ni...", rotation.q @ np.linalg.inv(T), part) for part in (group.A, group.shift))
    moves, there = points - placed(A, shift, points), weights > 0.0
    moved = np.average(moves[there], axis=0, weights=weights[there])
    return A, shift + moved, rotation


def placed(A: FloatArray, shift: FloatArray, points: FloatArray) -> FloatArray:
    """Points (N, M, n) mapped into the frame."""
    return np.einsum("nij,nmj->nmi", A, points) + shift[:, None]


def squared_residuals(places: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted sums of squared distances from the points' mean places, and sums of the weights, both (N,).

    Points of only one cloud do not count.
    """
    shared = (weights > 0.0).sum(axis=0) > 1
    places, weights = places[:, shared], weights[:, shared]
    places = np.where((weights > 0.0)[..., None], places, 0.0)
    mean = np.einsum("im,imn->mn", weights, places) / weights.sum(axis=0)[:, None]
    squares = weights * np.sum((places - mean) ** 2, axis=2)
    return squares.sum(axis=1), weights.sum(axis=1)
