"""Which points of several clouds are the same one: by rows, by ids, or by closest points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.applications.pointclouds.affine import fit_whitened, pair_weights, rank, whitened
from projdist.applications.pointclouds.groupwise import consensus, kept_clouds
from projdist.matrices import Affine
from projdist.support import listed

_EXACT = 1e-6  # of the spacing: what is nearer is no better proof
_SHARES = -700.0, 5.0  # logarithms of the volumes around points: what is less or more rounds to chances of 0 or 1


def log_false_alarms(distances: FloatArray, apart: float, n: int) -> float:
    """The logarithm of the number of false alarms of an affine map in n dimensions, the least of all precisions.

    `distances` (M,): of points from the nearest of a cloud that was mapped onto them; `apart`: their spacing. By chance
    the nearest is within r with the probability p = 1 - 2^(-(r / apart)^n), as among points spread evenly. That k of
    them are has (M - n - 1) C(M, k) p^(k - n - 1) false alarms: n + 1 may have made the map, so many k are tried.
    """
    near, least = np.sort(distances), n + 1
    k = np.arange(least + 1, len(near) + 1)
    if not k.size:
        return np.inf
    shares = np.exp(np.clip(n * np.log(np.maximum(near[least:] / apart, _EXACT)), *_SHARES))
    chance = -np.expm1(-np.log(2.0) * shares)
    factorials = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, len(near) + 1)))])
    choices = factorials[-1] - factorials[k] - factorials[len(near) - k]
    return float(np.log(len(k)) + np.min(choices + (k - least) * np.log(chance)))


# ---- icp -----------------------------------------------------------------------------------------


_STEPS = 100  # at most; some 20 do, and partners that come again end it sooner
_TURNS = 48  # starts all around the plane; 24 miss one in twenty sets with noise, missing and strange points
_TURNS_IN_SPACE = 1000  # of which the nearest is 12 degrees off on average, 22 at most
_SPIRAL = np.sqrt(2.0), 1.533751168755204288118041  # Alexa's constants: the second solves x^4 = x + 4
_LOOKED_AT = 200  # points of a cloud, by which starts are compared
_PROMISING = 12  # of the starts in space; 24 find no more of the benchmark's sets
_ENOUGH = 0.95  # of the points of the smaller cloud: with so many partners there is nothing to look for
_FAR = 4.0  # median distances of the pairs, beyond which a pair is none


class WeightedCloud(NamedTuple):
    """Points (M, n), and what each counts in fits, (M,), above 0."""

    points: FloatArray
    weights: FloatArray

    @property
    def is_flat(self) -> bool:
        """Whether the points span fewer dimensions than they have."""
        return rank(*self) < self.points.shape[1]


def nearest_points(clouds: list[WeightedCloud]) -> tuple[FloatArray, FloatArray]:
    """The points of clouds that correspond to the template's, (N, M, n), NaN where none does, and their weights (N, M).

    Clouds of which too few points find partners have none.
    """
    first = int(np.argmax([0 if cloud.is_flat else len(cloud.points) for cloud in clouds]))
    if clouds[first].is_flat:
        nothing = np.full((len(clouds), *clouds[first].points.shape), np.nan)
        return nothing, np.zeros(nothing.shape[:2])
    frame = whitened(*clouds[first])
    clouds = [WeightedCloud(np.asarray(np.linalg.solve(frame.root.T, (y - frame.centre).T).T), w) for y, w in clouds]
    template = clouds[first]
    partners = [_pairwise(cloud, template) for cloud in clouds]
    partners[first] = np.arange(len(template.points))
    known: set[bytes] = set()
    while not _again(np.stack(partners), known):
        points, weights = _arranged(clouds, partners)
        kept = kept_clouds(points, weights).clouds
        if first not in kept or len(kept) < 2:
            break
        group = consensus(points[kept], weights[kept])
        moved = [Affine(A, shift)(clouds[i].points) for i, A, shift in zip(kept, group.A, group.shift, strict=True)]
        parts = [weights[i][:, None] * cloud[partners[i]] for i, cloud in zip(kept, moved, strict=True)]
        mean = np.sum(parts, axis=0) / weights[kept].sum(axis=0)[:, None]
        for i, cloud in zip(kept, moved, strict=True):
            if i != first:
                partners[i] = _partners(cloud, mean)
    points, weights = _arranged(clouds, partners)
    return points @ frame.root + frame.centre, weights


def _pairwise(cloud: WeightedCloud, template: WeightedCloud) -> IntArray:
    """For each point of the template the number of a cloud's point, or -1, once a cloud is laid onto the template.

    It starts as it lies and, if few points find partners so, with equal moments and turned. The start counts that would
    be as good by chance most seldom.
    """
    if cloud.is_flat:
        return np.full(len(template.points), -1)
    apart = _spacing(template.points)
    found = [_laid(cloud, cloud.points, template, apart)]
    if np.sum(found[0].partners >= 0) < _ENOUGH * min(len(cloud.points), len(template.points)):
        found += [_laid(cloud, start, template, apart) for start in _turned(cloud, template)]
    # Where chance would do as well as all of them, the most pairs are the best guess.
    return min(found, key=lambda laid: (min(laid.false_alarms, 0.0), -int(np.sum(laid.partners >= 0)))).partners


class _Laid(NamedTuple):
    """The partners where affine fits and partners agree, and the logarithm of the number of false alarms."""

    partners: IntArray
    false_alarms: float


def _turns(n: int) -> FloatArray:
    """Rotations (k, n, n) to start from: evenly all around in the plane and in space, else none."""
    if n == 2:
        a = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
        return np.moveaxis(np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]), -1, 0)
    if n != 3:
        return np.eye(n)[None]
    from scipy.spatial.transform import Rotation  # imported here: scipy is slow to load, and few need it

    k = np.arange(_TURNS_IN_SPACE) + 0.5
    one, other = np.sqrt(k / _TURNS_IN_SPACE), np.sqrt(1.0 - k / _TURNS_IN_SPACE)
    first, second = (2.0 * np.pi * k / turn for turn in _SPIRAL)
    parts = [one * np.sin(first), one * np.cos(first), other * np.sin(second), other * np.cos(second)]
    return np.asarray(Rotation.from_quat(np.stack(parts, axis=-1)).as_matrix())


def _turned(cloud: WeightedCloud, template: WeightedCloud) -> list[FloatArray]:
    """A cloud with the moments of the template, turned onto it in each way to which closest points lead."""
    (basis, _), (target, laid) = _equal_moments(cloud), _equal_moments(template)
    starts = _promising(basis.points, target.points, _turns(basis.points.shape[1]))
    found = dict(_closest_turn(basis, target, turn) for turn in starts)
    return [laid(basis.points @ turn.T) for turn in found.values()]


def _equal_moments(cloud: WeightedCloud) -> tuple[WeightedCloud, Affine]:
    """A cloud about 0 with the variance 1 along all axes, not turned: by a symmetric root; and the way back."""
    white = whitened(*cloud)
    _, extents, V = np.linalg.svd(white.root)
    back = Affine((V.T * extents) @ V / np.sqrt(cloud.weights.sum()), white.centre)
    return WeightedCloud(back.inverse()(cloud.points), cloud.weights), back


def _promising(basis: FloatArray, target: FloatArray, turns: FloatArray) -> FloatArray:
    """Of many rotations those that bring most of a cloud's points next to some of the target."""
    if len(turns) <= _TURNS:
        return turns
    some = basis[:: -(-len(basis) // _LOOKED_AT)]
    distance = _nearest(target, some @ turns.swapaxes(1, 2))[1]
    return turns[np.argsort(np.median(distance, axis=1), kind="stable")[:_PROMISING]]


def _closest_turn(basis: WeightedCloud, target: WeightedCloud, turn: FloatArray) -> tuple[bytes, FloatArray]:
    """Where closest points lead to from a rotation: a mark of the partners, and the rotation."""
    known: set[bytes] = set()
    while True:
        found = _partners(basis.points @ turn.T, target.points)
        if _again(found, known):
            return found.tobytes(), turn
        one, other, w = _pairs(basis, target, found)
        U, _, V = np.linalg.svd(other.T @ (w[:, None] * one))
        U[:, -1] *= np.linalg.det(U @ V)
        turn = U @ V


def _pairs(
    cloud: WeightedCloud, template: WeightedCloud, partners: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The points of both that are partners, and what each pair counts."""
    there = partners >= 0
    pairs = partners[there]
    return cloud.points[pairs], template.points[there], pair_weights(cloud.weights[pairs], template.weights[there])


def _laid(cloud: WeightedCloud, start: FloatArray, template: WeightedCloud, apart: float) -> _Laid:
    """A cloud laid onto the template, whose points are so far apart, by affine fits to closest points, from a start."""
    moved, known = start, set[bytes]()
    while True:
        partners = _partners(moved, template.points)
        if _again(partners, known):
            break
        y, z, w = _pairs(cloud, template, partners)
        if min(rank(y, w), rank(z, w)) < y.shape[1]:
            return _Laid(np.full(len(partners), -1), np.inf)
        moved = fit_whitened(whitened(y, w), whitened(z, w), "symmetric")(cloud.points)
    return _Laid(partners, log_false_alarms(_nearest(moved, template.points)[1], apart, moved.shape[1]))


def _spacing(points: FloatArray) -> float:
    """The median distance of points from their nearest neighbours, those at one place being one."""
    from scipy.spatial import KDTree  # imported here: scipy is slow to load, and few need it

    places = np.unique(points, axis=0)
    distances, _ = KDTree(places).query(places, k=2)
    return float(np.median(np.asarray(distances)[:, 1]))


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


def _arranged(clouds: list[WeightedCloud], partners: list[IntArray]) -> tuple[FloatArray, FloatArray]:
    seen = np.stack(partners) >= 0
    points = np.stack([cloud.points[pairs] for cloud, pairs in zip(clouds, partners, strict=True)])
    points[~seen] = np.nan
    weights = np.stack([cloud.weights[pairs] for cloud, pairs in zip(clouds, partners, strict=True)])
    return points, np.where(seen, weights, 0.0)


# ---- correspondence ------------------------------------------------------------------------------


CORRESPONDENCES = ("rows", "id", "icp")

_FARTHEST = 1e50  # in any unit; of far larger numbers squares are infinite, of which LAPACK prints on the terminal


def arranged(
    clouds: list[FloatArray],
    weights: list[FloatArray],
    names: Sequence[str],
    correspond: str,
    ids: Sequence[Sequence[str]] | None,
) -> tuple[FloatArray, FloatArray]:
    """Points (N, M, n) of which those with the same number are the same, and their weights (N, M), 0 where missing.

    Raises ValueError for an unknown way, and for clouds that do not have what it needs.
    """
    if correspond not in CORRESPONDENCES:
        raise ValueError(f"Invalid correspondence '{correspond}'. It must be {listed(CORRESPONDENCES, 'or')}.")
    missing = [np.isnan(cloud).all(axis=1) for cloud in clouds]
    for name, cloud, gaps in zip(names, clouds, missing, strict=True):
        wrong = ~np.isfinite(cloud).all(axis=1) & ~gaps
        if wrong.any():
            raise ValueError(f"Invalid cloud '{name}'. Point {int(np.argmax(wrong)) + 1} must be finite, or all NaN.")
        far = (np.abs(cloud) > _FARTHEST).any(axis=1)
        if far.any():
            raise ValueError(f"Invalid cloud '{name}'. Point {int(np.argmax(far)) + 1} must lie within {_FARTHEST:g}.")
    if correspond == "icp":
        there = [~gaps & (w > 0.0) for gaps, w in zip(missing, weights, strict=True)]
        pairs = zip(clouds, weights, there, strict=True)
        return nearest_points([WeightedCloud(cloud[some], w[some]) for cloud, w, some in pairs])
    together = [np.column_stack(pair) for pair in zip(clouds, weights, strict=True)]
    found = _by_rows(together, names) if correspond == "rows" else _by_ids(together, names, ids)
    return found[..., :-1], np.where(np.isnan(found).any(axis=2), 0.0, found[..., -1])


def _by_rows(clouds: list[FloatArray], names: Sequence[str]) -> FloatArray:
    for name, cloud in zip(names, clouds, strict=True):
        if len(cloud) != len(clouds[0]):
            raise ValueError(
                f"Invalid cloud '{name}'. It has {len(cloud)} points, '{names[0]}' {len(clouds[0])}; rows that "
                "correspond must be as many. Where they do not, there is the correspondence id or icp."
            )
    return np.stack(clouds)


def _by_ids(clouds: list[FloatArray], names: Sequence[str], ids: Sequence[Sequence[str]] | None) -> FloatArray:
    if ids is None or len(ids) != len(clouds):
        raise ValueError("Invalid ids. There must be a list of them for each cloud.")
    for name, cloud, marks in zip(names, clouds, ids, strict=True):
        if len(marks) != len(cloud):
            raise ValueError(f"Invalid ids of cloud '{name}'. They are {len(marks)}; its points are {len(cloud)}.")
        if len(set(marks)) < len(marks):
            twice = next(mark for k, mark in enumerate(marks) if mark in marks[:k])
            raise ValueError(f"Invalid cloud '{name}'. It has two points with the id '{twice}'.")
    numbers = {mark: k for k, mark in enumerate(dict.fromkeys(mark for marks in ids for mark in marks))}
    points = np.full((len(clouds), len(numbers), clouds[0].shape[1]), np.nan)
    for row, cloud, marks in zip(points, clouds, ids, strict=True):
        row[[numbers[mark] for mark in marks]] = cloud
    return points
