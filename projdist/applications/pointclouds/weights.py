"""What points count: by a column of the clouds' files, or by a file with a number a row, or an id and a number."""

from __future__ import annotations

import math
import os
from collections import defaultdict
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.pointclouds.affine import checked_weights
from projdist.applications.pointclouds.files import CloudFile
from projdist.support import is_number, listed, number_of, numbered_rows, tell

__all__ = ["WeightsFile", "column_weights", "read_weights"]

_NAMED = 3  # clouds in a notice


class WeightsFile(NamedTuple):
    """Numbers (M,) of the rows of all clouds, or of ids, if the file has them."""

    path: Path
    numbers: FloatArray
    ids: tuple[str, ...] | None

    def of_rows(self) -> FloatArray:
        """Of points that correspond by rows."""
        return self.numbers

    def of_ids(self, cloud: CloudFile) -> FloatArray:
        """Of the points of a cloud, by ids; raises ValueError for those that the file does not have."""
        if self.ids is None:
            raise ValueError(f"Invalid weights '{self.path}'. By ids it must have two columns, id and number.")
        known = dict(zip(self.ids, self.numbers.tolist(), strict=True))
        absent = next((mark for mark in cloud.ids or () if mark not in known), None)
        if absent is not None:
            raise ValueError(f"Invalid weights '{self.path}'. It has none for the id '{absent}' of '{cloud.path}'.")
        return np.array([known[mark] for mark in cloud.ids or ()])


def read_weights(path: str | os.PathLike[str]) -> WeightsFile:
    """The weights of a text file: a number a line, or id and number, perhaps after a header. Raises ValueError."""
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
    ids = tuple(row[0].strip() for _, row in rows) if width == 2 else None
    return WeightsFile(Path(path), np.array(numbers), ids)


def column_weights(clouds: Sequence[CloudFile], column: str, correspond: str) -> list[FloatArray]:
    """Of each cloud, by its column, which one of them must have; raises ValueError, for wrong numbers, too.

    A point of a cloud without the column weighs as its partners do on average, and as all points do where no partner
    has a weight or nobody knows which it is: whatever the numbers' unit. That is told.
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
            checked_weights(cloud.weights, missing, f"Invalid weights of cloud '{cloud.path}'.")
    _tell_of_lacking(clouds, column, correspond)
    marks = [_marks(cloud, correspond) for cloud in clouds]
    known = _mean_weights(clouds, marks)
    typical = float(np.nanmean(np.concatenate(numbers)))
    return [
        np.array([known.get(mark, typical) for mark in some]) if cloud.weights is None else cloud.weights
        for cloud, some in zip(clouds, marks, strict=True)
    ]


def _tell_of_lacking(clouds: Sequence[CloudFile], column: str, correspond: str) -> None:
    """Which clouds do not have a column, and what is done."""
    lacking = [f"'{cloud.path}'" for cloud in clouds if cloud.weights is None]
    shown = listed(lacking, "and") if len(lacking) <= _NAMED else f"{len(lacking)} of {len(clouds)} clouds"
    like = "the others do on average" if correspond == "icp" else "their partners do"
    tell(f"No column '{column}' in {shown}: the points there weigh as {like}.")


def _marks(cloud: CloudFile, correspond: str) -> Sequence[Hashable]:
    """What points that may be partners have in common: an id, a row, or nothing that tells them apart."""
    if correspond == "id" and cloud.ids is not None:
        return cloud.ids
    return range(len(cloud.points)) if correspond == "rows" else [None] * len(cloud.points)


def _mean_weights(clouds: Sequence[CloudFile], marks: Sequence[Sequence[Hashable]]) -> dict[Hashable, float]:
    """The mean of what is given to points with the same mark."""
    given = defaultdict(list)
    for cloud, some in zip(clouds, marks, strict=True):
        for mark, number in zip(some, [] if cloud.weights is None else cloud.weights.tolist(), strict=False):
            if not math.isnan(number):
                given[mark].append(number)
    return {mark: math.fsum(numbers) / len(numbers) for mark, numbers in given.items()}
