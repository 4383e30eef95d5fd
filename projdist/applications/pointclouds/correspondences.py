"""Corresponding points of several clouds, by rows, by ids, or by closest points (ICP), and their weights from files."""

import math
from collections import defaultdict
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import AnyPath, FloatArray, IntArray
from projdist.applications.pointclouds import affine
from projdist.applications.pointclouds.files import CloudFile
from projdist.matrices import Affine
from projdist.support import check_choice, is_number, listed, number_of, numbered_rows, tell

_EXACT = 1e-6  # of the spacing: smaller distances are no better evidence
_SHARES = -700.0, 5.0  # logarithms of volumes around points: beyond these, probabilities round to 0 or 1


def log_false_alarms(distances: FloatArray, apart: float, n: int) -> float:
    """Logarithm of the number of false alarms of an affine map in n dimensions, the least over all precisions."""
    # Of points (M,) at distances from the nearest of a cloud mapped onto them, at a spacing of `apart`, one is within r
    # by chance with probability p = 1 - 2^(-(r / apart)^n). For k of them that makes (M - n - 1) C(M, k) p^(k - n - 1)
    # false alarms: n + 1 points may have determined the map, and M - n - 1 values of k are tried.
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

_STEPS = 100  # at most; about 20 suffice, and partners that repeat end it sooner
_TURNS = 48  # starts in the plane; 24 miss one in twenty sets with noise, missing and extra points
_TURNS_IN_SPACE = 1000  # starts in space; the nearest is 12 degrees off on average, 22 at most
_SPIRAL = np.sqrt(2.0), 1.533751168755204288118041  # Alexa's constants: the second solves x^4 = x + 4
_LOOKED_AT = 200  # points of a cloud that are used to compare starts
_PROMISING = 12  # starts in space that are followed; 24 find no more of the benchmark's sets
_ENOUGH = 0.95  # of the points of the smaller cloud: with so many partners no other start is tried
_FAR = 4.0  # median distances beyond which a pair is dropped


class WeightedCloud(NamedTuple):
    """Points (M, n) and their weights (M,), above 0."""

    points: FloatArray
    weights: FloatArray

    @property
    def is_flat(self) -> bool:
        """True if the points span fewer than n dimensions."""
        return affine.rank(*self) < self.points.shape[1]


def nearest_points(clouds: list[WeightedCloud]) -> tuple[FloatArray, FloatArray]:
    """Points of each cloud closest to the largest cloud's, (N, M, n), NaN without a partner, and weights (N, M)."""
    # A cloud in which too few points find partners gets none.
    first = int(np.argmax([0 if cloud.is_flat else len(cloud.points) for cloud in clouds]))
    if clouds[first].is_flat:
        nothing = np.full((len(clouds), *clouds[first].points.shape), np.nan)
        return nothing, np.zeros(nothing.shape[:2])
    frame = affine.whitened(*clouds[first])
    clouds = [WeightedCloud(np.asarray(np.linalg.solve(frame.root.T, (y - frame.centre).T).T), w) for y, w in clouds]
    template = clouds[first]
    partners = [_pairwise(cloud, template) for cloud in clouds]
    partners[first] = np.arange(len(template.points))
    known: set[bytes] = set()
    while not _settled(np.stack(partners), known):
        points, weights = _arranged(clouds, partners)
        kept = affine.kept_clouds(points, weights)[0]
        if first not in kept or len(kept) < 2:
            break
        group = affine.consensus(points[kept], weights[kept])
        moved = [Affine(A, shift)(clouds[i].points) for i, A, shift in zip(kept, group.A, group.shift, strict=True)]
        parts = [weights[i][:, None] * cloud[partners[i]] for i, cloud in zip(kept, moved, strict=True)]
        mean = np.sum(parts, axis=0) / weights[kept].sum(axis=0)[:, None]
        for i, cloud in zip(kept, moved, strict=True):
            if i != first:
                partners[i] = _partners(cloud, mean)
    points, weights = _arranged(clouds, partners)
    return points @ frame.root + frame.centre, weights


def _pairwise(cloud: WeightedCloud, template: WeightedCloud) -> IntArray:
    """Number of the cloud's partner of each point of the template, or -1, after a fit by closest points."""
    # It starts from the cloud as given and, if few points find partners, also from turns of it with equal moments.
    if cloud.is_flat:
        return np.full(len(template.points), -1)
    apart = _spacing(template.points)
    found = [_icp(cloud, cloud.points, template, apart)]
    if np.sum(found[0][0] >= 0) < _ENOUGH * min(len(cloud.points), len(template.points)):
        found += [_icp(cloud, start, template, apart) for start in _turned(cloud, template)]
    # If no fit is better than chance, that with the most pairs is the best guess.
    return min(found, key=lambda fit: (min(fit[1], 0.0), -int(np.sum(fit[0] >= 0))))[0]


def _turns(n: int) -> FloatArray:
    """Rotations (k, n, n) to start from, evenly spread in the plane and in space; the identity in other dimensions."""
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
    """A cloud with the moments of the template, in each of the rotations to which closest points converge."""
    (basis, _), (target, back) = _equal_moments(cloud), _equal_moments(template)
    starts = _turns(basis.points.shape[1])
    if len(starts) > _TURNS:  # those with the least median distance of the cloud's points from the template
        some = basis.points[:: -(-len(basis.points) // _LOOKED_AT)]
        distance = _nearest(target.points, some @ starts.swapaxes(1, 2))[1]
        starts = starts[np.argsort(np.median(distance, axis=1), kind="stable")[:_PROMISING]]
    found: dict[bytes, FloatArray] = {}
    for turn in starts:
        known: set[bytes] = set()
        while not _settled(partners := _partners(basis.points @ turn.T, target.points), known):
            one, other, w = _pairs(basis, target, partners)
            U, _, V = np.linalg.svd(other.T @ (w[:, None] * one))
            U[:, -1] *= np.linalg.det(U @ V)
            turn = U @ V
        found[partners.tobytes()] = turn
    return [back(basis.points @ turn.T) for turn in found.values()]


def _equal_moments(cloud: WeightedCloud) -> tuple[WeightedCloud, Affine]:
    """A cloud about 0 with variance 1 along all axes, by a symmetric root, which does not turn it; and the map back."""
    white = affine.whitened(*cloud)
    _, extents, V = np.linalg.svd(white.root)
    back = Affine((V.T * extents) @ V / np.sqrt(cloud.weights.sum()), white.centre)
    return WeightedCloud(back.inverse()(cloud.points), cloud.weights), back


def _pairs(
    cloud: WeightedCloud, template: WeightedCloud, partners: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The points of both clouds that are partners, and the weights of the pairs."""
    there = partners >= 0
    pairs = partners[there]
    weights = affine.pair_weights(cloud.weights[pairs], template.weights[there])
    return cloud.points[pairs], template.points[there], weights


def _icp(cloud: WeightedCloud, start: FloatArray, template: WeightedCloud, apart: float) -> tuple[IntArray, float]:
    """Partners after repeated affine fits to closest points, and the logarithm of the number of false alarms."""
    # The fits of the cloud to the template, whose spacing is `apart`, begin at `start` and end when partners repeat.
    moved, known = start, set[bytes]()
    while True:
        partners = _partners(moved, template.points)
        if _settled(partners, known):
            break
        y, z, w = _pairs(cloud, template, partners)
        if min(affine.rank(y, w), affine.rank(z, w)) < y.shape[1]:
            return np.full(len(partners), -1), np.inf
        moved = affine.fit_whitened(affine.whitened(y, w), affine.whitened(z, w), "symmetric")(cloud.points)
    return partners, log_false_alarms(_nearest(moved, template.points)[1], apart, moved.shape[1])


def _spacing(points: FloatArray) -> float:
    """Median distance of distinct points from their nearest neighbours."""
    from scipy.spatial import KDTree  # imported here: scipy is slow to load, and few need it

    places = np.unique(points, axis=0)
    distances, _ = KDTree(places).query(places, k=2)
    return float(np.median(np.asarray(distances)[:, 1]))


def _settled(partners: IntArray, known: set[bytes]) -> bool:
    """True if these partners were known or there were too many steps; adds them to the known ones."""
    mark = partners.tobytes()
    ended = mark in known or len(known) >= _STEPS
    known.add(mark)
    return ended


def _partners(cloud: FloatArray, template: FloatArray) -> IntArray:
    """Numbers of mutual nearest neighbours, -1 without one or if it is much farther away than most."""
    there, distance = _nearest(cloud, template)
    back, _ = _nearest(template, cloud)
    mutual = back[there] == np.arange(len(template))
    mutual &= distance <= _FAR * np.median(distance[mutual]) if mutual.any() else False
    return np.where(mutual, there, -1)


def _nearest(cloud: FloatArray, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of a cloud's points that are nearest to points, and their distances."""
    from scipy.spatial import KDTree  # imported here: scipy is slow to load, and few need it

    distance, number = KDTree(cloud).query(points)
    return np.asarray(number), np.asarray(distance)


def _arranged(clouds: list[WeightedCloud], partners: list[IntArray]) -> tuple[FloatArray, FloatArray]:
    """Points (N, M, n), NaN without a partner, and weights (N, M)."""
    seen = np.stack(partners) >= 0
    points = np.stack([cloud.points[pairs] for cloud, pairs in zip(clouds, partners, strict=True)])
    points[~seen] = np.nan
    weights = np.stack([cloud.weights[pairs] for cloud, pairs in zip(clouds, partners, strict=True)])
    return points, np.where(seen, weights, 0.0)


# ---- correspondence ------------------------------------------------------------------------------

CORRESPONDENCES = ("rows", "id", "icp")

_FARTHEST = 1e50  # in any unit; squares of much larger numbers are infinite, and LAPACK prints on the terminal


def corresponding_points(
    clouds: list[FloatArray],
    weights: list[FloatArray],
    names: Sequence[str],
    correspond: str,
    ids: Sequence[Sequence[str]] | None,
) -> tuple[FloatArray, FloatArray]:
    """Points (N, M, n) in the order in which they correspond, and weights (N, M), 0 if missing; raises ValueError."""
    check_choice("correspondence", correspond, CORRESPONDENCES)
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
    if correspond == "id":
        found = _by_ids(together, names, ids)
    else:
        for name, cloud in zip(names, clouds, strict=True):
            if len(cloud) != len(clouds[0]):
                has = f"It has {len(cloud)} points, '{names[0]}' {len(clouds[0])}; rows that correspond must be as many"
                other = "Where they do not, there is the correspondence id or icp."
                raise ValueError(f"Invalid cloud '{name}'. {has}. {other}")
        found = np.stack(together)
    return found[..., :-1], np.where(np.isnan(found).any(axis=2), 0.0, found[..., -1])


def _by_ids(clouds: list[FloatArray], names: Sequence[str], ids: Sequence[Sequence[str]] | None) -> FloatArray:
    """Clouds (N, M, n) with a row for each id of any of them, NaN where a cloud lacks the id; raises ValueError."""
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


# ---- weights -------------------------------------------------------------------------------------


class WeightsFile(NamedTuple):
    """Weights (M,) of the rows of each cloud, or of ids if the file has them."""

    path: Path
    numbers: FloatArray
    ids: tuple[str, ...] | None

    def of_ids(self, cloud: CloudFile) -> FloatArray:
        """Weights of a cloud's points by their ids; raises ValueError for ids missing from the file."""
        if self.ids is None:
            raise ValueError(f"Invalid weights '{self.path}'. By ids it must have two columns, id and number.")
        known = dict(zip(self.ids, self.numbers.tolist(), strict=True))
        absent = next((mark for mark in cloud.ids or () if mark not in known), None)
        if absent is not None:
            raise ValueError(f"Invalid weights '{self.path}'. It has none for the id '{absent}' of '{cloud.path}'.")
        return np.array([known[mark] for mark in cloud.ids or ()])


def read_weights(path: AnyPath) -> WeightsFile:
    """The weights in a text file: a number per line, or id and number, perhaps below a header. Raises ValueError."""
    text = f"Invalid weights '{path}'."
    rows = numbered_rows(Path(path), text)
    width = len(rows[0][1])
    if width > 2:
        raise ValueError(f"{text} It must have one column, of numbers, or two, id and number; it has {width}.")
    if not is_number(rows[0][1][-1]):
        rows = rows[1:]
    numbers = []
    for line, row in rows:
        if len(row) < width or not is_number(row[-1]):
            raise ValueError(f"{text} Line {line} must end with a number.")
        numbers.append(number_of(row[-1]))
    return WeightsFile(Path(path), np.array(numbers), tuple(row[0].strip() for _, row in rows) if width == 2 else None)


def column_weights(clouds: Sequence[CloudFile], column: str, correspond: str) -> list[FloatArray]:
    """Weights of each cloud's points from a column, which at least one cloud must have; raises ValueError.

    A point of a cloud without the column gets the mean weight of its partners, or of all points if no partner has a
    weight or the partners are unknown, in whatever unit. A notice says so.
    """
    numbers = [cloud.weights for cloud in clouds if cloud.weights is not None]
    if not numbers:
        there = f"; '{clouds[0].path}' has {listed(clouds[0].columns, 'and')}" if clouds[0].columns else ""
        raise ValueError(f"Invalid weights '{column}'. No cloud has such a column{there}.")
    if len(numbers) == len(clouds):
        return numbers
    for cloud in clouds:
        if cloud.weights is not None:
            missing = np.asarray(np.isnan(cloud.points).all(axis=1))
            affine.checked_weights(cloud.weights, missing, f"Invalid weights of cloud '{cloud.path}'.")
    lacking = [f"'{cloud.path}'" for cloud in clouds if cloud.weights is None]
    shown = listed(lacking, "and") if len(lacking) <= 3 else f"{len(lacking)} of {len(clouds)} clouds"
    like = "the others do on average" if correspond == "icp" else "their partners do"
    tell(f"No column '{column}' in {shown}: the points there weigh as {like}.")
    # Keys that partners share: ids, or rows, or None for all points if partners are unknown.
    marks: list[Sequence[Hashable]] = [range(len(cloud.points)) for cloud in clouds]
    if correspond != "rows":
        marks = [(correspond == "id" and cloud.ids) or [None] * len(cloud.points) for cloud in clouds]
    given = defaultdict(list)
    for cloud, some in zip(clouds, marks, strict=True):
        for mark, number in zip(some, [] if cloud.weights is None else cloud.weights.tolist(), strict=False):
            if not math.isnan(number):
                given[mark].append(number)
    known = {mark: math.fsum(those) / len(those) for mark, those in given.items()}
    typical = float(np.nanmean(np.concatenate(numbers)))
    return [
        np.array([known.get(mark, typical) for mark in some]) if cloud.weights is None else cloud.weights
        for cloud, some in zip(clouds, marks, strict=True)
    ]
