"""Which points of several clouds are the same one: by rows, by ids, or by closest points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.pointclouds.icp import WeightedCloud, nearest_points
from projdist.support import listed

__all__ = ["CORRESPONDENCES", "arranged"]

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
