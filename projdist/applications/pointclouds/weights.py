"""Files of weights: a number a row, or an id and a number."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.pointclouds.files import CloudFile
from projdist.support import is_number, number_of, numbered_rows

__all__ = ["WeightsFile", "read_weights"]


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
