"""Affine maps of many clouds into one frame, from points of which each is in some of the clouds.

Weights (N, M) tell what each point counts, 0 where a cloud does not have it; the mean is one by weights. The symmetric
answer is self-consistent: each cloud lies by its symmetric fit onto the mean of all, and no cloud is the reference. The
mean is known up to an affine map, and is kept whitened. With every point in every cloud this is a
generalised Procrustes analysis (Gower 1975) of whitened clouds. It starts from the largest roots of generalised
canonical correlations (Kettenring 1971; with missing points, van de Velden & Takane 2012), a symmetric eigenproblem.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.pointclouds.affine import AffineFit, fit_whitened, pair_weights, rank, whitened
from projdist.matrices import Rotation, mean_rotation, principal_scales

_STEPS = 300  # 3 to 30 do, but for chains of thirty clouds with noise of a tenth of their spread
_SETTLED, _SETTLED_ENOUGH = 1e-14, 1e-10  # of the spread of the mean: where steps stop, and what still is an answer
_ROUNDING = 1e-10  # of a squared length of 1


class Group(NamedTuple):
    """The maps A_i y + shift_i of N clouds, their canonical correlations with the mean."""

    A: FloatArray  # (N, n, n)
    shift: FloatArray  # (N, n)
    correlations: FloatArray  # (N, n), greatest first
    settled: bool  # whether the steps came to an end


class Kept(NamedTuple):
    """The clouds that can be registered together, and why the others cannot, by number."""

    clouds: list[int]
    reasons: dict[int, str]


# ---- which clouds ---------------------------------------------------------------------------


def kept_clouds(points: FloatArray, weights: FloatArray, *, first_only: bool = False) -> Kept:
    """The most clouds that hang together: points (N, M, n), and what they count in each cloud, (N, M).

    A cloud joins where the points that it shares with those already there span all n dimensions;
    with `first_only` where those that it shares with the first cloud do.
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
    """How many dimensions the points of cloud i span, or those of them that are there."""
    some = (weights[i] > 0.0) if there is None else there & (weights[i] > 0.0)
    return rank(points[i][some], weights[i][some])


def _grown(points: FloatArray, weights: FloatArray, able: list[int], seed: int, first_only: bool) -> list[int]:
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
    if count <= n:
        return f"{what} {count} point{'s' if count != 1 else ''}, and {n + 1} are needed"
    return f"the {count} points that {what} span {dimensions} of {n} dimensions"


# ---- the maps -------------------------------------------------------------------------------


def onto_first(points: FloatArray, weights: FloatArray) -> Group:
    """Least squares onto the first cloud, one cloud after the other: what shrinks, for comparison."""
    fits = []
    for cloud, counts in zip(points, weights, strict=True):
        both = (counts > 0.0) & (weights[0] > 0.0)
        w = pair_weights(counts[both], weights[0, both])
        fits.append(fit_whitened(whitened(cloud[both], w), whitened(points[0][both], w), "least_squares"))
    return _grouped(fits, True)


def consensus(points: FloatArray, weights: FloatArray) -> Group:
    """The self-consistent symmetric fit of clouds that hang together (see `kept_clouds`).

    Laying all clouds on their mean anew converges slowly along chains of clouds, so that each step
    goes as far as all those that would follow it, were the fits linear.
    """
    shared = (weights > 0.0).sum(axis=0) > 1
    clouds = _Clouds(points[:, shared], weights[:, shared])
    mean = clouds.start
    for _ in range(_STEPS):
        move = clouds.laid_anew(mean) - mean
        change = float(np.linalg.norm(clouds.roots * move)) / np.sqrt(mean.size)
        if change < _SETTLED:
            break
        mean = clouds.rounded(mean + clouds.prolonged(move))
    return _grouped(clouds.fits(mean), change < _SETTLED_ENOUGH)


def _grouped(fits: list[AffineFit], settled: bool) -> Group:
    A, shift, correlations = map(
        np.stack, zip(*((one.matrix, one.shift, one.correlations) for one in fits), strict=True)
    )
    return Group(A, shift, correlations, settled)


class _Clouds:
    """Clouds to be laid onto a mean, M points that are in two clouds at least."""

    def __init__(self, points: FloatArray, weights: FloatArray) -> None:
        self.rows = [np.flatnonzero(counts) for counts in weights]
        self.points = [cloud[row] for cloud, row in zip(points, self.rows, strict=True)]
        self.weights = [counts[row] for counts, row in zip(weights, self.rows, strict=True)]
        self.whitened = [whitened(cloud, w) for cloud, w in zip(self.points, self.weights, strict=True)]
        self.roots = np.sqrt(weights.sum(axis=0))[:, None]
        self.start, self.values, self.vectors = self._linear(points.shape[-1])

    def _linear(self, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The mean that least-squares fits, all at once, leave nearest to itself; and how far they take other moves.

        Those fits are projections onto the affine functions of each cloud. The largest n + 1
        eigenvalues of their mean belong to the mean of the clouds and to the constant.
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
        """Of each cloud onto the mean."""
        clouds = zip(self.rows, self.whitened, self.weights, strict=True)
        return [fit_whitened(cloud, whitened(mean[row], w), "symmetric") for row, cloud, w in clouds]

    def laid_anew(self, mean: FloatArray) -> FloatArray:
        """The whitened mean of the clouds laid onto a mean, turned onto that: nothing else tells their axes."""
        total = np.zeros_like(mean)
        for row, cloud, w, fit in zip(self.rows, self.points, self.weights, self.fits(mean), strict=True):
            total[row] += w[:, None] * fit(cloud)
        image = self.rounded(total / self.roots**2)
        U, _, V = np.linalg.svd((self.roots * image).T @ (self.roots * mean))
        return image @ U @ V

    def prolonged(self, move: FloatArray) -> FloatArray:
        """The sum of all the moves that would follow a move, were the fits linear."""
        parts = self.vectors.T @ (self.roots * move)
        return move + self.vectors @ ((self.values / (1.0 - self.values))[:, None] * parts) / self.roots

    def rounded(self, points: FloatArray) -> FloatArray:
        """Points about their centre, the nearest whose columns, times the roots of the weights, are orthonormal."""
        U, _, V = np.linalg.svd(self.roots * self._centred(points), full_matrices=False)
        return U @ V / self.roots

    def _centred(self, points: FloatArray) -> FloatArray:
        w = self.roots**2
        return np.asarray(points - (w * points).sum(axis=0) / w.sum())


# ---- placing -------------------------------------------------------------------------------------


def dist_squares(T: FloatArray, A: FloatArray) -> FloatArray:
    """Dist_F(T^-1 A_i)^2 of matrices (N, n, n)."""
    return np.asarray(np.sum(np.log(principal_scales(np.linalg.solve(T, A))) ** 2, axis=-1))


def upright(group: Group) -> tuple[Group, BoolArray]:
    """The same maps into a frame that most clouds are no mirror images in, and which clouds are.

    Of equally many the first is none.
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
    """Matrices and shifts into the frame of the MDT, where points (N, M, n) keep their mean orientation and place."""
    rotation = mean_rotation(group.A[~mirrored], T=T)
    A, shift = (np.einsum("ij,nj...->ni...", rotation.q @ np.linalg.inv(T), part) for part in (group.A, group.shift))
    moves, there = points - placed(A, shift, points), weights > 0.0
    moved = np.average(moves[there], axis=0, weights=weights[there])
    return A, shift + moved, rotation


def placed(A: FloatArray, shift: FloatArray, points: FloatArray) -> FloatArray:
    """The places of points (N, M, n)."""
    return np.einsum("nij,nmj->nmi", A, points) + shift[:, None]


def squared_residuals(places: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of each cloud the sum by weights of the squared distances from the points' mean places, and that of the weights.

    Points of one cloud alone do not count.
    """
    shared = (weights > 0.0).sum(axis=0) > 1
    places, weights = places[:, shared], weights[:, shared]
    places = np.where((weights > 0.0)[..., None], places, 0.0)
    mean = np.einsum("im,imn->mn", weights, places) / weights.sum(axis=0)[:, None]
    squares = weights * np.sum((places - mean) ** 2, axis=2)
    return squares.sum(axis=1), weights.sum(axis=1)
