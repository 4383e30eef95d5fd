"""Which points of clouds correspond, where nobody says so: affine iterative closest points (Besl & McKay 1992).

The clouds start as they lie. Pairs are mutual nearest neighbours between a cloud and the template, the cloud with the
most points, and the fits are symmetric: the usual one-sided pairs and least squares shrink an affine map to a point.
Distances are taken where the template is whitened, so that an affine map of all clouds changes nothing.
"""

from __future__ import annotations

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.applications.pointclouds.affine import fit_whitened, rank, whitened
from projdist.applications.pointclouds.groupwise import consensus, kept_clouds
from projdist.matrices import Affine

__all__ = ["nearest_points"]

_STEPS = 100  # at most; some 20 do, and partners that come again end it sooner
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

    Of two starts, as they lie and with equal moments, the one counts that leaves the nearer neighbours.
    """
    if min(rank(cloud), rank(template)) < cloud.shape[1]:
        return np.full(len(template), -1)
    found = [_laid(cloud, start, template) for start in (cloud, _turned(cloud, template))]
    return min(found, key=lambda laid: laid[1])[0]


def _turned(cloud: FloatArray, template: FloatArray) -> FloatArray:
    """A cloud with the centre and the covariance of the template, turned onto it by closest points."""
    y, z = whitened(cloud), whitened(template)
    scale = np.sqrt(len(template))
    # The roots are symmetric, so that whitening turns neither.
    basis, target = scale * _round(cloud - y.centre), scale * _round(template - z.centre)
    basis *= np.sqrt(len(cloud) / len(template))
    turn = np.eye(cloud.shape[1])
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
    return basis @ turn.T @ back + z.centre


def _laid(cloud: FloatArray, start: FloatArray, template: FloatArray) -> tuple[IntArray, float]:
    """The partners where affine fits and partners agree, and the median distance of the template's nearest points."""
    moved, known = start, set[bytes]()
    while True:
        partners = _partners(moved, template)
        if _again(partners, known):
            break
        pairs = partners >= 0
        if min(rank(cloud[partners[pairs]]), rank(template[pairs])) < cloud.shape[1]:
            return np.full(len(template), -1), np.inf
        fit = fit_whitened(whitened(cloud[partners[pairs]]), whitened(template[pairs]), "symmetric")
        moved = fit(cloud)
    return partners, float(np.median(_nearest(moved, template)[1]))


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
