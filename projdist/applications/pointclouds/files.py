"""Files of points, which are read, and written with the points moved and everything else unchanged.

PLY and PCD are read by `records`, which keeps everything else byte for byte; the library plyfile is under the GPL.
"""

from __future__ import annotations

import csv
import functools
import io
import math
import operator
import os
import re
from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.applications.pointclouds.affine import checked_weights
from projdist.applications.pointclouds.records import CloudError, Records, read_pcd, read_ply
from projdist.support import (
    cells_of,
    comma_hint,
    has_decimal_comma,
    is_number,
    listed,
    number_of,
    numbered_rows,
    replacing,
    separator_of,
    tell,
    with_decimal_points,
)

_IDS = ("id", "name", "label", "point")
_NAMED = 5  # rows in a notice
_AXES, _NORMALS = ("x", "y", "z"), ("nx", "ny", "nz")
_CLOUDCOMPARE = "//"  # before the names of the columns


@dataclass(frozen=True, eq=False)
class CloudFile:
    """The points of a file, shape (M, n), NaN where missing; their ids if it has any, else None.

    `weights` (M,): the requested column, NaN where it is empty; None if none was requested or it is missing.
    """

    path: Path
    points: FloatArray
    ids: tuple[str, ...] | None
    normals: FloatArray | None
    content: _CellTable | Records
    weights: FloatArray | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """The names in the file's header in lower case, or of PLY's properties; empty without a header."""
        return self.content.names

    def write(self, path: str | os.PathLike[str], A: FloatArray, shift: FloatArray, *, overwrite: bool = False) -> None:
        """Write the file with its points y at A y + shift, and normals, columns nx, ny, nz, transformed accordingly.

        Raises FileExistsError for an existing file that is not to be overwritten, and OSError.
        """
        normals = None if self.normals is None else _turned(self.normals, A)
        with replacing(Path(path), overwrite=overwrite) as new:
            new.write_bytes(self.content.moved(self.points @ A.T + shift, normals))


def read_cloud(path: str | os.PathLike[str], *, weights: str | None = None) -> CloudFile:
    """The points of a .csv, .xyz, .asc, .ply or .pcd file.

    CSV, with commas, semicolons or tabs: with a header, the columns x, y and perhaps z, or, without these, all; a
    column id, name, label or point has the ids. Without a header all columns are coordinates, except a first column
    that has no numbers, which has the ids. Empty cells are missing; a point that lacks some coordinates is missing,
    too, with a notice. XYZ and ASC: the first three numbers of each line, or the columns that a header names, as
    CloudCompare's `//X Y Z`. PLY and PCD: ascii or binary. Numbers may have decimal commas if commas do not separate
    cells. `weights`: the name of a column, which is then not a coordinate; a file may lack it. Raises ValueError.
    """
    path = Path(path)
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise ValueError(f"Invalid cloud '{path}'. Its suffix must be {listed(SUFFIXES, 'or')}.")
    try:
        content = read(path.read_bytes(), weights)
        counts = None if weights is None else content.column(weights)
        return CloudFile(path, _whole(content.points, path), content.ids, content.normals, content, counts)
    except OSError as error:
        raise ValueError(f"Invalid cloud '{path}'. The file cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"Invalid cloud '{path}'. It must be text in UTF-8.") from error
    except CloudError as error:
        raise ValueError(f"Invalid cloud '{path}'. {error}") from error


def _whole(points: FloatArray, path: Path) -> FloatArray:
    """Points, all NaN if any coordinate is missing, with a notice; raises CloudError for infinite ones."""
    infinite = np.flatnonzero(np.isinf(points).any(axis=1))
    if infinite.size:
        raise CloudError(f"Point {infinite[0] + 1} is infinitely far away.")
    absent = np.isnan(points)
    partly = np.flatnonzero(absent.any(axis=1) & ~absent.all(axis=1))
    if absent.any(axis=1).all():
        raise CloudError("No point in it has all of its coordinates.")
    if partly.size:
        shown = ", ".join(str(row + 1) for row in partly[:_NAMED]) + (", ..." if partly.size > _NAMED else "")
        tell(f"{partly.size} point(s) of '{path}' lack a coordinate and are taken as missing: {shown}.")
    return np.where(absent.any(axis=1, keepdims=True), np.nan, points)


def _turned(normals: FloatArray, A: FloatArray) -> FloatArray:
    """Unit normals of a surface after the map A; a normal (0, 0, 0) stays 0."""
    turned = np.linalg.solve(A.T, normals.T).T
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return turned / np.where(length == 0.0, 1.0, length)


# ---- text -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class _CellTable:
    """Rows of cells below lines of a head, and the numbers of the columns with coordinates and ids.

    `missing` is written for missing numbers: "" below a header, else nan.
    """

    head: list[str]
    rows: list[list[str]]
    separator: str
    axes: list[int]
    id_column: int | None = None
    names: tuple[str, ...] = ()
    missing: str = "nan"

    @functools.cached_property
    def plain(self) -> list[list[str]]:
        """Rows with decimal points; the same list objects for rows that had them."""
        return [row for _, row in with_decimal_points(list(enumerate(self.rows)))]

    @property
    def normal_axes(self) -> list[int]:
        """The columns of normals; empty unless there are as many as coordinates."""
        found = [self.names.index(name) for name in _NORMALS[: len(self.axes)] if name in self.names]
        return found if len(found) == len(self.axes) else []

    @property
    def points(self) -> FloatArray:
        """Shape (M, n), NaN where a cell is empty."""
        return self._numbers(self.axes)

    @property
    def normals(self) -> FloatArray | None:
        """Shape (M, n), None without such columns."""
        if not self.normal_axes:
            return None
        normals = self._numbers(self.normal_axes)
        return np.where(np.isnan(normals).any(axis=1, keepdims=True), np.nan, normals)

    @property
    def ids(self) -> tuple[str, ...] | None:
        """The texts of the column with ids, None without one."""
        k = self.id_column
        return None if k is None else tuple(row[k].strip() if k < len(row) else "" for row in self.rows)

    def column(self, name: str) -> FloatArray | None:
        """The numbers of a column, NaN where a cell is empty; None without that column; raises CloudError."""
        if name.lower() not in self.names:
            return None
        k = self.names.index(name.lower())
        cells = [row[k].strip() if k < len(row) else "" for row in self.plain]
        wrong = next((number for number, cell in enumerate(cells, start=1) if cell and not is_number(cell)), None)
        if wrong is not None:
            raise CloudError(f"Row {wrong} must have a number for '{name}'.")
        return np.array([number_of(cell or "nan") for cell in cells])

    def _numbers(self, columns: Sequence[int]) -> FloatArray:
        """The numbers of columns, NaN where a cell is empty; raises CloudError."""
        numbers = []
        for number, row in enumerate(self.plain, start=1):
            cells = [row[column].strip() if column < len(row) else "?" for column in columns]
            if not all(cell == "" or is_number(cell) for cell in cells):
                hint = comma_hint(cells)
                raise CloudError(f"Row {number} must have {len(columns)} numbers for its point.{hint}")
            numbers.append([number_of(cell or "nan") for cell in cells])
        if not numbers:
            raise CloudError("There are no points in it.")
        return np.array(numbers)

    def moved(self, points: FloatArray, normals: FloatArray | None) -> bytes:
        """The content of the file with other points and normals."""
        text = io.StringIO()
        writer = csv.writer(text, delimiter=self.separator, lineterminator="\n")
        columns = self.axes + self.normal_axes
        values = points if normals is None else np.hstack([points, normals])
        mark = "." if all(map(operator.is_, self.rows, self.plain)) else ","
        for row, numbers in zip(self.rows, values.tolist(), strict=True):
            cells = list(row)
            for column, number in zip(columns, numbers, strict=True):
                cells[column] = self.missing if math.isnan(number) else repr(number).replace(".", mark)
            writer.writerow(cells)
        return ("".join(f"{line}\n" for line in self.head) + text.getvalue()).encode()


def _read_csv(data: bytes, weights: str | None) -> _CellTable:
    comments, lines = _split_comments(_lines(data), "#")
    separator = separator_of(lines[-1])
    if separator is None:
        raise CloudError("Its cells must stand apart by commas, semicolons or tabs.")
    rows = _rows(lines, separator)
    header = [cell.strip().lower() for cell in rows[0]]
    if any(map(is_number, header)) or any(map(has_decimal_comma, header)) or not any(header):
        ids = 0 if header[0] and not _is_decimal(header[0]) else None
        axes = [k for k in range(len(header)) if k != ids]
        return _CellTable(head=comments, rows=rows, separator=separator, axes=axes, id_column=ids)
    header[0] = header[0].removeprefix(_CLOUDCOMPARE)
    ids = next((header.index(name) for name in _IDS if name in header), None)
    axes = [header.index(name) for name in _AXES if name in header]
    if not {"x", "y"} <= set(header):
        beside = (ids, header.index(weights.lower()) if weights and weights.lower() in header else None)
        axes = [k for k in range(len(header)) if k not in beside]
    return _CellTable(
        head=[*comments, lines[0]],
        rows=rows[1:],
        separator=separator,
        axes=axes,
        id_column=ids,
        names=tuple(header),
        missing="",
    )


def _is_decimal(cell: str) -> bool:
    """True for a number, perhaps with a decimal comma."""
    return is_number(cell) or has_decimal_comma(cell)


def _read_xyz(data: bytes, weights: str | None) -> _CellTable:
    head, lines = _split_comments(_lines(data), ("#", _CLOUDCOMPARE))
    names = _names_of(head[-1].removeprefix(_CLOUDCOMPARE)) if head and head[-1].startswith(_CLOUDCOMPARE) else ()
    if _names_of(lines[0])[0] == "ncols":
        raise CloudError("It is a grid of Esri's, no cloud.")
    if lines[0].strip().isdigit() and int(lines[0]) == len(lines) - 1:  # of points
        head, lines = [*head, lines[0]], lines[1:]
    elif not names and not any(map(_is_decimal, _names_of(lines[0]))):
        head, lines, names = [*head, lines[0]], lines[1:], _names_of(lines[0])
    if not lines:
        raise CloudError("There are no points in it.")
    first = lines[0].split()
    separator = None if len(first) > 1 and all(map(_is_decimal, first[:3])) else separator_of(lines[0])
    rows = [_cells(line, separator, number) for number, line in enumerate(lines, start=1)]
    axes = [names.index(name) for name in _AXES if name in names]
    if not {"x", "y"} <= set(names):
        axes = list(range(min(3, len(rows[0]))))
        longer = next((k for k, row in enumerate(rows, start=1) if len(row) > len(axes)), None)
        if len(axes) < 3 and longer is not None:
            raise CloudError(f"Row 1 has {len(axes)} numbers, row {longer} more.")
    return _CellTable(head=head, rows=rows, separator=separator or " ", axes=axes, names=names)


def _names_of(line: str) -> tuple[str, ...]:
    """The words of a header in lower case."""
    return tuple(re.split(r"[\s,;]+", line.strip().lower()))


def _cells(line: str, separator: str | None, number: int) -> list[str]:
    """The cells of a line; raises CloudError with the number of its row."""
    try:
        return cells_of(line, separator)
    except ValueError as error:
        raise CloudError(f"Its row {number} has {error}.") from error


def _rows(lines: Sequence[str], separator: str) -> list[list[str]]:
    """The cells of lines; CloudError for a line with more cells than the first, except empty ones."""
    rows: list[list[str]] = []
    for number, line in enumerate(lines, start=1):
        rows.append(_cells(line, separator, number))
        if any(cell.strip() for cell in rows[-1][len(rows[0]) :]):
            raise CloudError(f"Its row {number} has {len(rows[-1])} cells, the first one {len(rows[0])}.")
    return rows


def _lines(data: bytes) -> list[str]:
    """The lines of a text that are not blank."""
    return [line for line in data.decode("utf-8-sig").splitlines() if line.strip()]


def _split_comments(lines: list[str], marks: str | tuple[str, ...]) -> tuple[list[str], list[str]]:
    """The leading comment lines, which begin with marks, and the other lines; raises CloudError without others."""
    first = next((k for k, line in enumerate(lines) if not line.startswith(marks)), None)
    if first is None:
        raise CloudError("There are no points in it.")
    return lines[:first], lines[first:]


_READERS: dict[str, Callable[[bytes, str | None], _CellTable | Records]] = {
    ".csv": _read_csv,
    ".xyz": _read_xyz,
    ".asc": _read_xyz,
    ".ply": lambda data, _: read_ply(data),
    ".pcd": lambda data, _: read_pcd(data),
}
SUFFIXES = tuple(_READERS)


# ---- weights -------------------------------------------------------------------------------------


_NAMED_CLOUDS = 3  # clouds in a notice


class WeightsFile(NamedTuple):
    """Weights (M,) for the rows of all clouds, or for ids if the file has them."""

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


def read_weights(path: str | os.PathLike[str]) -> WeightsFile:
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
    ids = tuple(row[0].strip() for _, row in rows) if width == 2 else None
    return WeightsFile(Path(path), np.array(numbers), ids)


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
    """Give notice of clouds without a column, and of their points' weights."""
    lacking = [f"'{cloud.path}'" for cloud in clouds if cloud.weights is None]
    shown = listed(lacking, "and") if len(lacking) <= _NAMED_CLOUDS else f"{len(lacking)} of {len(clouds)} clouds"
    like = "the others do on average" if correspond == "icp" else "their partners do"
    tell(f"No column '{column}' in {shown}: the points there weigh as {like}.")


def _marks(cloud: CloudFile, correspond: str) -> Sequence[Hashable]:
    """Keys that partners share: ids, or rows, or None for all points if partners are unknown."""
    if correspond == "id" and cloud.ids is not None:
        return cloud.ids
    return range(len(cloud.points)) if correspond == "rows" else [None] * len(cloud.points)


def _mean_weights(clouds: Sequence[CloudFile], marks: Sequence[Sequence[Hashable]]) -> dict[Hashable, float]:
    """The mean weight of points with the same key."""
    given = defaultdict(list)
    for cloud, some in zip(clouds, marks, strict=True):
        for mark, number in zip(some, [] if cloud.weights is None else cloud.weights.tolist(), strict=False):
            if not math.isnan(number):
                given[mark].append(number)
    return {mark: math.fsum(numbers) / len(numbers) for mark, numbers in given.items()}
