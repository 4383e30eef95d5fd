"""Which points of clouds correspond, where nobody says so: affine iterative closest points (Besl & McKay 1992).

The clouds start as they lie and, where that finds few partners, with equal moments, in two and three dimensions turned
all around. Pairs are mutual nearest neighbours between a cloud and the template, the cloud with the most points, and
the fits are symmetric: the usual one-sided pairs and least squares shrink an affine map to a point. Distances are taken
where the template is whitened, so that an affine map of all clouds changes nothing.
"""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.applications.pointclouds.affine import fit_whitened, rank, whitened
from projdist.applications.pointclouds.groupwise import consensus, kept_clouds
from projdist.matrices import Affine

__all__ = ["nearest_points"]

_STEPS = 100  # at most; some 20 do, and partners that come again end it sooner
_TURNS = 24  # starts all around the plane
_BEST = 4  # of them, which are fitted affinely
_ENOUGH = 0.95  # of the points of the smaller cloud: with so many partners there is nothing to look for
_FAR = 4.0  # median distances of the pairs, beyond which a pair is none


def nearest_points(clouds: list[FloatArray]) -> tuple[FloatArray, BoolArray]:
    """The points of clouds (M_i, n) that correspond to the template's, shape (N, M, n), NaN where none does; and which.

    Clouds of which too few points find partners have none.
    """
    first = int(np.argmax([len(cloud) if rank(cloud) == cloud.shape[1] else 0 for cloud in clouds]))
    if rank(clouds[first]) < clouds[first].shape[1]:
        nothing = np.full((len(clouds), *clouds[first].shape), np.nan)
        return nothing, np.asarray(np.isfinite(nothing).all(axis=2))
    frame = whitened(clouds[first])
    clouds = [np.asarray(np.linalg.solve(frame.root.T, (cloud - frame.centre).T).T) for cloud in clouds]
    template = clouds[first]
    partners = [_pairwise(cloud, template) for cloud in clouds]
    partners[first] = np.arange(len(template))
    known: set[bytes] = set()
    while not _again(np.stack(partners), known):
        points, seen = _arranged(clouds, partners)
        kept = kept_clouds(points, seen).clouds
        if first not in kept or len(kept) < 2:
            break
        group = consensus(points[kept], seen[kept])
        moved = [Affine(A, shift)(clouds[i]) for i, A, shift in zip(kept, group.A, group.shift, strict=True)]
        total = np.sum([cloud[partners[i]] * seen[i][:, None] for i, cloud in zip(kept, moved, strict=True)], axis=0)
        mean = total / seen[kept].sum(axis=0)[:, None]
        for i, cloud in zip(kept, moved, strict=True):
            if i != first:
                partners[i] = _partners(cloud, mean)
    points, seen = _arranged(clouds, partners)
    return points @ frame.root + frame.centre, seen


def _pairwise(cloud: FloatArray, template: FloatArray) -> IntArray:
    """For each point of the template the number of a cloud's point, or -1, once a cloud is laid onto the template.

    It starts as it lies and, if few points find partners so, with equal moments and turned. The start counts that finds
    the most partners, of equally many that of the nearer ones.
    """
    if min(rank(cloud), rank(template)) < cloud.shape[1]:
        return np.full(len(template), -1)
    found = [_laid(cloud, cloud, template)]
    if found[0].paired < _ENOUGH * min(len(cloud), len(template)):
        turned = sorted((_turned(cloud, template, turn) for turn in _turns(cloud.shape[1])), key=lambda one: -one[1])
        found += [_laid(cloud, start, template) for start, _ in turned[:_BEST]]
    return min(found, key=lambda laid: (-laid.paired, laid.distance)).partners


class _Laid(NamedTuple):
    """The partners where affine fits and partners agree, how many, and the median distance of nearest points."""

    partners: IntArray
    paired: int
    distance: float


def _turns(n: int) -> list[FloatArray]:
    """Rotations to start from: evenly all around in the plane, those of a cube in space, else none."""
    if n == 2:
        angles = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
        return [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    if n != 3:
        return [np.eye(n)]
    signed = [
        np.eye(3)[list(order)] * signs for order in permutations(range(3)) for signs in product([1.0, -1.0], repeat=3)
    ]
    return [one for one in signed if np.linalg.det(one) > 0]


def _turned(cloud: FloatArray, template: FloatArray, turn: FloatArray) -> tuple[FloatArray, int]:
    """A cloud with the moments of the template, turned onto it by closest points from a start, and their number."""
    y, z = whitened(cloud), whitened(template)
    scale = np.sqrt(len(template))
    # The roots are symmetric, so that whitening turns neither.
    basis, target = scale * _round(cloud - y.centre), scale * _round(template - z.centre)
    basis *= np.sqrt(len(cloud) / len(template))
    known: set[bytes] = set()
    while True:
        found = _partners(basis @ turn.T, target)
        if _again(found, known):
            break
        pairs = found >= 0
        U, _, V = np.linalg.svd(target[pairs].T @ basis[found[pairs]])
        U[:, -1] *= np.linalg.det(U @ V)
        turn = U @ V
    back = np.linalg.lstsq(target, template - z.centre, rcond=None)[0]
    return basis @ turn.T @ back + z.centre, int(np.sum(found >= 0))


def _laid(cloud: FloatArray, start: FloatArray, template: FloatArray) -> _Laid:
    """A cloud laid onto the template by affine fits to closest points, from a start."""
    moved, known = start, set[bytes]()
    while True:
        partners = _partners(moved, template)
        if _again(partners, known):
            break
        pairs = partners >= 0
        if min(rank(cloud[partners[pairs]]), rank(template[pairs])) < cloud.shape[1]:
            return _Laid(np.full(len(template), -1), 0, np.inf)
        fit = fit_whitened(whitened(cloud[partners[pairs]]), whitened(template[pairs]), "symmetric")
        moved = fit(cloud)
    return _Laid(partners, int(np.sum(partners >= 0)), float(np.median(_nearest(moved, template)[1])))


def _again(partners: IntArray, known: set[bytes]) -> bool:
    """Whether these partners have been met, or steps enough have been made; else they are met now."""
    mark = partners.tobytes()
    ended = mark in known or len(known) >= _STEPS
    known.add(mark)
    return ended


def _partners(cloud: FloatArray, template: FloatArray) -> IntArray:
    """Mutual nearest neighbours that lie no farther apart than most."""
    there, distance = _nearest(cloud, template)
    back, _ = _nearest(template, cloud)
    mutual = back[there] == np.arange(len(template))
    mutual &= distance <= _FAR * np.median(distance[mutual]) if mutual.any() else False
    return np.where(mutual, there, -1)


def _nearest(cloud: FloatArray, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """The numbers of a cloud's points that are nearest to points, and how far they are."""
    from scipy.spatial import KDTree  # imported here: scipy is slow to load, and few need it

    distance, number = KDTree(cloud).query(points)
    return np.asarray(number), np.asarray(distance)


def _round(points: FloatArray) -> FloatArray:
    """The nearest orthonormal columns."""
    U, _, V = np.linalg.svd(points, full_matrices=False)
    return U @ V


def _arranged(clouds: list[FloatArray], partners: list[IntArray]) -> tuple[FloatArray, BoolArray]:
    seen = np.stack(partners) >= 0
    points = np.stack([cloud[pairs] for cloud, pairs in zip(clouds, partners, strict=True)])
    points[~seen] = np.nan
    return points, seen
