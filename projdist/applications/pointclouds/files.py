"""Files of points, which are read, and written again with moved points and everything else unchanged.

PLY: G. Turk, "The PLY polygon file format", 1994 (the library plyfile is under the GPL). Data before and after the
vertices are kept byte for byte. PCD: the Point Cloud Library, "The PCD file format", version .7. Others are text.
"""

from __future__ import annotations

import csv
import functools
import io
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from projdist import support
from projdist._typing import AnyArray, AnyPath, FloatArray

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_AXES, _NORMALS = ("x", "y", "z"), ("nx", "ny", "nz")
_SHOWN = 60  # characters of a line in a message


class CloudError(ValueError):
    """An error in the content of a file; the message is a sentence."""


@dataclass(frozen=True, eq=False)
class Records:
    """A PLY or PCD file: the bytes before its points, the points as a structured array, and the bytes after them."""

    header: bytes
    vertices: AnyArray
    tail: bytes
    ascii: bool
    ids: None = None

    @property
    def points(self) -> FloatArray:
        """Shape (M, 2) or (M, 3)."""
        return self._columns([name for name in _AXES if name in self.names])

    @property
    def normals(self) -> FloatArray | None:
        """Shape (M, 3), None if there are none."""
        return self._columns(_NORMALS) if {*_NORMALS, "z"} <= set(self.names) else None

    def column(self, name: str) -> FloatArray | None:
        """A column by its name; None if it is missing or has several numbers per point."""
        there = name in self.names and not self.vertices.dtype[name].shape
        return self._columns([name])[:, 0] if there else None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.vertices.dtype.names or ()

    def _columns(self, names: Sequence[str]) -> FloatArray:
        """Columns by their names, (M, k)."""
        return np.stack([self.vertices[name].astype(float) for name in names], axis=1)

    def moved(self, points: FloatArray, normals: FloatArray | None) -> bytes:
        """The content of the file with other points and normals, in the file's own types."""
        vertices = self.vertices.copy()
        for names, values in (_AXES, points), (_NORMALS, normals):
            if values is not None:
                for name, column in zip(names, values.T, strict=False):
                    vertices[name] = column
        if not self.ascii:
            return self.header + vertices.tobytes() + self.tail
        several = [vertices[name].reshape(len(vertices), -1).T for name in self.names]
        # str of a NumPy number is the shortest text that is read as the same number of its type.
        rows = zip(*(list(column) for columns in several for column in columns), strict=True)
        lines = "".join(" ".join(map(str, row)) + "\n" for row in rows)
        return self.header + lines.encode() + self.tail


# ---- PLY ------------------------------------------------------------------------------------


class _Element(NamedTuple):
    """An element of a header."""

    name: str
    rows: int
    properties: list[tuple[str, str, str]]  # name, type, and for lists the type of the length, else ""


def read_ply(data: bytes) -> Records:
    """The records of a PLY file; raises CloudError."""
    end = data.find(b"end_header")
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise CloudError("It is not a PLY file: its header must begin with ply and end with end_header.")
    order, elements = _elements(data[:line_end].decode("ascii", errors="replace").splitlines())
    place = next((k for k, element in enumerate(elements) if element.name == "vertex"), None)
    if order not in _ORDERS or place is None:
        raise CloudError("Its header must name a format and an element vertex.")
    vertex = elements[place]
    kinds = {name: kind for name, kind, _ in vertex.properties}
    if len(kinds) < len(vertex.properties):
        raise CloudError("Its vertices have two properties of one name.")
    if any(length for *_, length in vertex.properties):
        raise CloudError("Its vertices must have no lists.")
    dtype = np.dtype([(name, _ORDERS[order] + kind) for name, kind in kinds.items()])
    start = line_end + 1
    for element in elements[:place]:
        start = _end_of(data, start, element, order)
    return _records(data, start, vertex.rows, dtype, is_ascii=order == "ascii")


def _elements(lines: list[str]) -> tuple[str, list[_Element]]:
    """The format and the elements that a header names."""
    order, elements = "", list[_Element]()
    for line in lines:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = words[1]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[:1] == ["property"] and "vertex" in [element.name for element in elements[:-1]]:
                continue  # of an element after the vertices
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], _TYPES[words[3]], _TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], _TYPES[words[1]], ""))
        except (IndexError, KeyError, ValueError) as error:
            raise CloudError(f"The line '{line.strip()[:_SHOWN]}' of its header is not understood.") from error
    return order, elements


def _end_of(data: bytes, start: int, element: _Element, order: str) -> int:
    """The end of an element's data; raises CloudError if the file ends before."""
    early = CloudError(f"It ends before its vertices, among those of its element '{element.name}'.")
    if order == "ascii":  # a line each
        for _ in range(element.rows):
            start = data.find(b"\n", start) + 1
            if start == 0:
                raise early
        return start
    sizes = [np.dtype(kind).itemsize for _, kind, _ in element.properties]
    lengths = [np.dtype(_ORDERS[order] + (length or "V0")) for *_, length in element.properties]
    if not any(length.itemsize for length in lengths):
        return start + max(0, element.rows) * sum(sizes)
    for _ in range(element.rows):
        for size, length in zip(sizes, lengths, strict=True):
            if start + (length.itemsize or size) > len(data):
                raise early
            count = max(0, int(np.frombuffer(data, length, 1, start)[0])) if length.itemsize else 1
            start += length.itemsize + count * size
    return start


# ---- PCD ------------------------------------------------------------------------------------

_PCD_KINDS = {"F": "f", "I": "i", "U": "u"}
_PCD_HEADER = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")


def read_pcd(data: bytes) -> Records:
    """The records of a PCD file; raises CloudError."""
    words, start = _pcd_header(data)
    form = " ".join(words.get("DATA", [])).lower()
    if form == "binary_compressed":
        raise CloudError("Its data are binary_compressed; they must be ascii or binary.")
    if form not in ("ascii", "binary"):
        raise CloudError("It is not a PCD file: its header must end with DATA ascii or DATA binary.")
    names = words.get("FIELDS", [])
    try:
        counts = [int(count) for count in words.get("COUNT", ["1"] * len(names))]
        kinds = zip(words.get("TYPE", []), words.get("SIZE", []), strict=True)
        codes = ["<" + _PCD_KINDS[kind.upper()] + size for kind, size in kinds]
        # Columns of padding all have the same name.
        unique = [name if names.count(name) == 1 else f"{name} {number}" for number, name in enumerate(names)]
        columns = zip(unique, codes, counts, strict=True)
        dtype = np.dtype([(name, code, (count,)) if count != 1 else (name, code) for name, code, count in columns])
        points = int(words["POINTS"][0]) if "POINTS" in words else int(words["WIDTH"][0]) * int(words["HEIGHT"][0])
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise CloudError("Its header must have FIELDS, SIZE, TYPE and POINTS that fit together.") from error
    return _records(data, start, points, dtype, is_ascii=form == "ascii", named="Point")


def _pcd_header(data: bytes) -> tuple[dict[str, list[str]], int]:
    """The words of a header's lines by their keywords, and the end of the header."""
    words: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in words:
        end = data.find(b"\n", start)
        if end < 0:
            break
        line = data[start:end].decode("ascii", errors="replace").partition("#")[0].split()
        start = end + 1
        if line and line[0].upper() not in _PCD_HEADER:
            raise CloudError(f"It is not a PCD file: '{' '.join(line)[:_SHOWN]}' does not belong in such a header.")
        if line:
            words[line[0].upper()] = line[1:]
    return words, start


def _records(
    data: bytes, start: int, count: int, dtype: np.dtype[Any], *, is_ascii: bool, named: str = "Vertex"
) -> Records:
    """The records of a file with `count` points from `start` on; raises CloudError."""
    names = dtype.names or ()
    if not {"x", "y"} <= set(names) or any(dtype[name].kind != "f" for name in names if name in _AXES):
        where, kind = ("vertices", "type float or double") if named == "Vertex" else ("FIELDS", "the TYPE F")
        raise CloudError(f"Its {where} must have x, y and perhaps z of {kind}.")
    if count < 1:
        raise CloudError("There are no points in it.")
    if not is_ascii:
        size = count * dtype.itemsize
        if len(data) < start + size:
            raise CloudError(f"It ends before its {count} {'vertices' if named == 'Vertex' else 'points'} do.")
        return Records(data[:start], np.frombuffer(data, dtype, count, start), data[start + size :], False)
    # A header may claim more points than there are lines.
    content = data[start:]
    *lines, tail = content.split(b"\n", min(count, len(content)))
    if len(lines) < count:
        lines, tail = [*lines, tail], b""
    return Records(data[:start], _ascii_points(lines, count, dtype, named), tail, True)


def _ascii_points(lines: list[bytes], count: int, dtype: np.dtype[Any], named: str) -> AnyArray:
    """The points of the first lines; raises CloudError for the first that does not fit the columns."""
    width = sum(int(np.prod(dtype[name].shape)) for name in dtype.names or ())
    rows = []
    for k in range(count):
        cells = lines[k].decode("ascii", errors="replace").split() if k < len(lines) else []
        try:
            rows.append([support.number_of(cell) for cell in cells])
        except ValueError:
            rows.append([])
        if len(rows[k]) != width:
            commas = ", with decimal points, not commas" if any(map(support.has_decimal_comma, cells)) else ""
            raise CloudError(f"{named} {k + 1} must have {width} numbers{commas}.")
    points, table, first = np.empty(count, dtype), np.array(rows), 0
    for name in dtype.names or ():
        kind = dtype[name]
        columns = table[:, first : first + int(np.prod(kind.shape))]
        if kind.base.kind == "f":
            wrong = np.isfinite(columns) & (np.abs(columns) > np.finfo(kind.base).max)
        else:
            limits = np.iinfo(kind.base)
            wrong = ~((columns == np.rint(columns)) & (columns >= limits.min) & (columns <= limits.max))
        if wrong.any():
            k, column = np.argwhere(wrong)[0]
            held = f"{columns[k, column]:g} for {name}"
            raise CloudError(f"{named} {k + 1} has {held}, which its type {kind.base.name} cannot hold.")
        points[name] = columns.reshape((count, *kind.shape))
        first += columns.shape[1]
    return points


_IDS = ("id", "name", "label", "point")
_NAMED = 5  # rows in a notice

_CLOUDCOMPARE = "//"  # before the names of the columns


@dataclass(frozen=True, eq=False)
class CloudFile:
    """The points of a file; ids and normals are None if it has none."""

    path: Path
    points: FloatArray  #: (M, n), NaN where missing
    ids: tuple[str, ...] | None
    normals: FloatArray | None
    content: _CellTable | Records
    weights: FloatArray | None = None  #: (M,), the requested column, NaN where it is empty; None without one

    @property
    def columns(self) -> tuple[str, ...]:
        """The names in the file's header in lower case, or of PLY's properties; empty without a header."""
        return self.content.names

    def write(self, path: AnyPath, A: FloatArray, shift: FloatArray, *, overwrite: bool = False) -> None:
        """Write the file with its points y at A y + shift, and normals, columns nx, ny, nz, transformed accordingly.

        Raises FileExistsError for an existing file that is not to be overwritten, and OSError.
        """
        normals = None
        if self.normals is not None:
            turned = np.linalg.solve(A.T, self.normals.T).T
            length = np.linalg.norm(turned, axis=1, keepdims=True)
            normals = np.asarray(turned / np.where(length == 0.0, 1.0, length))  # a normal (0, 0, 0) stays 0
        with support.replacing(Path(path), overwrite=overwrite) as new:
            new.write_bytes(self.content.moved(self.points @ A.T + shift, normals))


def read_cloud(path: AnyPath, *, weights: str | None = None) -> CloudFile:
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
        raise ValueError(f"Invalid cloud '{path}'. Its suffix must be {support.listed(SUFFIXES, 'or')}.")
    try:
        content = read(path.read_bytes(), weights)
        counts = None if weights is None else content.column(weights)
        points = content.points
        if (infinite := np.flatnonzero(np.isinf(points).any(axis=1))).size:
            raise CloudError(f"Point {infinite[0] + 1} is infinitely far away.")
        absent = np.isnan(points)
        if absent.any(axis=1).all():
            raise CloudError("No point in it has all of its coordinates.")
        partly = np.flatnonzero(absent.any(axis=1) & ~absent.all(axis=1))
        if partly.size:
            shown = ", ".join(str(row + 1) for row in partly[:_NAMED]) + (", ..." if partly.size > _NAMED else "")
            support.tell(f"{partly.size} point(s) of '{path}' lack a coordinate and are taken as missing: {shown}.")
        points = np.where(absent.any(axis=1, keepdims=True), np.nan, points)
        return CloudFile(path, points, content.ids, content.normals, content, counts)
    except OSError as error:
        raise ValueError(f"Invalid cloud '{path}'. The file cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"Invalid cloud '{path}'. It must be text in UTF-8.") from error
    except CloudError as error:
        raise ValueError(f"Invalid cloud '{path}'. {error}") from error


@dataclass(frozen=True, eq=False, kw_only=True)
class _CellTable:
    """Rows of cells below the lines of a head, and the numbers of the columns with coordinates and ids."""

    head: list[str]
    rows: list[list[str]]
    separator: str
    axes: list[int]
    id_column: int | None = None
    names: tuple[str, ...] = ()
    missing: str = "nan"  # for missing numbers: "" below a header

    @functools.cached_property
    def plain(self) -> list[list[str]]:
        """Rows with decimal points, which are the given lists if there are no decimal commas."""
        return [row for _, row in support.with_decimal_points(list(enumerate(self.rows)))]

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
        normals = self._numbers(self.normal_axes) if self.normal_axes else None
        return None if normals is None else np.where(np.isnan(normals).any(axis=1, keepdims=True), np.nan, normals)

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
        wrong = [number for number, cell in enumerate(cells, start=1) if cell and not support.is_number(cell)]
        if wrong:
            raise CloudError(f"Row {wrong[0]} must have a number for '{name}'.")
        return np.array([support.number_of(cell or "nan") for cell in cells])

    def _numbers(self, columns: Sequence[int]) -> FloatArray:
        """The numbers of columns, NaN where a cell is empty; raises CloudError."""
        numbers = []
        for number, row in enumerate(self.plain, start=1):
            cells = [row[column].strip() if column < len(row) else "?" for column in columns]
            if not all(cell == "" or support.is_number(cell) for cell in cells):
                hint = support.comma_hint(cells)
                raise CloudError(f"Row {number} must have {len(columns)} numbers for its point.{hint}")
            numbers.append([support.number_of(cell or "nan") for cell in cells])
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
                cells[column] = self.missing if np.isnan(number) else repr(number).replace(".", mark)
            writer.writerow(cells)
        return ("".join(f"{line}\n" for line in self.head) + text.getvalue()).encode()


def _read_csv(data: bytes, weights: str | None) -> _CellTable:
    comments, lines = _split_comments(data, "#")
    separator = support.separator_of(lines[-1])
    if separator is None:
        raise CloudError("Its cells must be separated by commas, semicolons or tabs.")
    rows = [_cells(line, separator, number) for number, line in enumerate(lines, start=1)]
    for number, row in enumerate(rows, start=1):
        if any(cell.strip() for cell in row[len(rows[0]) :]):
            raise CloudError(f"Its row {number} has {len(row)} cells, the first one {len(rows[0])}.")
    header = [cell.strip().lower() for cell in rows[0]]
    if any(map(_is_decimal, header)) or not any(header):
        ids = 0 if header[0] and not _is_decimal(header[0]) else None
        axes = [k for k in range(len(header)) if k != ids]
        return _CellTable(head=comments, rows=rows, separator=separator, axes=axes, id_column=ids)
    header[0] = header[0].removeprefix(_CLOUDCOMPARE)
    ids = next((header.index(name) for name in _IDS if name in header), None)
    axes = [header.index(name) for name in _AXES if name in header]
    if not {"x", "y"} <= set(header):
        beside = (ids, header.index(weights.lower()) if weights and weights.lower() in header else None)
        axes = [k for k in range(len(header)) if k not in beside]
    head, names = [*comments, lines[0]], tuple(header)
    return _CellTable(head=head, rows=rows[1:], separator=separator, axes=axes, id_column=ids, names=names, missing="")


def _is_decimal(cell: str) -> bool:
    """True for a number, perhaps with a decimal comma."""
    return support.is_number(cell) or support.has_decimal_comma(cell)


def _read_xyz(data: bytes, weights: str | None) -> _CellTable:
    head, lines = _split_comments(data, ("#", _CLOUDCOMPARE))
    names = _names_of(head[-1].removeprefix(_CLOUDCOMPARE)) if head and head[-1].startswith(_CLOUDCOMPARE) else ()
    if _names_of(lines[0])[0] == "ncols":
        raise CloudError("It is an Esri grid, not a cloud.")
    if lines[0].strip().isdigit() and int(lines[0]) == len(lines) - 1:  # of points
        head, lines = [*head, lines[0]], lines[1:]
    elif not names and not any(map(_is_decimal, _names_of(lines[0]))):
        head, lines, names = [*head, lines[0]], lines[1:], _names_of(lines[0])
    if not lines:
        raise CloudError("There are no points in it.")
    first = lines[0].split()
    separator = None if len(first) > 1 and all(map(_is_decimal, first[:3])) else support.separator_of(lines[0])
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
        return support.cells_of(line, separator)
    except ValueError as error:
        raise CloudError(f"Its row {number} has {error}.") from error


def _split_comments(data: bytes, marks: str | tuple[str, ...]) -> tuple[list[str], list[str]]:
    """The first lines, as far as they are comments, which begin with the marks, and the others that are not blank."""
    lines = [line for line in data.decode("utf-8-sig").splitlines() if line.strip()]
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
