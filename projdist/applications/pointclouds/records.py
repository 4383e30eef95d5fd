"""Readers of PLY and PCD, files of points behind a header that names their columns, ascii or binary.

PLY: G. Turk, "The PLY polygon file format", 1994. Data before and after the vertices, mostly faces, are kept byte for
byte. PCD: the Point Cloud Library's documentation, "The PCD (Point Cloud Data) file format", version .7.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.support import has_decimal_comma, number_of

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_END = b"end_header"
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
        return self._columns([name for name in ("x", "y", "z") if name in self.names])

    @property
    def normals(self) -> FloatArray | None:
        """Shape (M, 3), None if there are none."""
        names = ["nx", "ny", "nz"]
        return self._columns(names) if {*names, "z"} <= set(self.names) else None

    def column(self, name: str) -> FloatArray | None:
        """A column by its name; None if it is missing or has several numbers per point."""
        there = name in self.names and not self.vertices.dtype[name].shape
        return self._columns([name])[:, 0] if there else None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.vertices.dtype.names or ()

    def _columns(self, names: list[str]) -> FloatArray:
        """Columns by their names, (M, k)."""
        return np.stack([self.vertices[name].astype(float) for name in names], axis=1)

    def moved(self, points: FloatArray, normals: FloatArray | None) -> bytes:
        """The content of the file with other points and normals, in the file's own types."""
        vertices = self.vertices.copy()
        for names, values in (("x", "y", "z"), points), (("nx", "ny", "nz"), normals):
            if values is not None:
                for name, column in zip(names, values.T, strict=False):
                    vertices[name] = column
        if not self.ascii:
            return self.header + vertices.tobytes() + self.tail
        # str of numpy's numbers is the shortest text that is read as the same number of that type.
        lines = "".join(" ".join(map(str, row)) + "\n" for row in zip(*_flat(vertices), strict=True))
        return self.header + lines.encode() + self.tail


def _flat(vertices: AnyArray) -> list[list[Any]]:
    """Columns of single numbers; a column of several numbers per point becomes several."""
    columns = [vertices[name].reshape(len(vertices), -1) for name in vertices.dtype.names or ()]
    return [list(column) for several in columns for column in several.T]


# ---- PLY ------------------------------------------------------------------------------------


class _Property(NamedTuple):
    """A property of an element: its name, its type, and the type of its length if it is a list, else ""."""

    name: str
    kind: str
    length: str = ""


@dataclass(frozen=True)
class _Element:
    """An element of a header: its name, its number and its properties."""

    name: str
    count: int
    properties: list[_Property]


def read_ply(data: bytes) -> Records:
    """The records of a PLY file; raises CloudError."""
    end = data.find(_END)
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise CloudError("It is no PLY file: its header must begin with ply and end with end_header.")
    order, elements = _elements(data[:line_end].decode("ascii", errors="replace").splitlines())
    place = next((k for k, element in enumerate(elements) if element.name == "vertex"), None)
    if order not in _ORDERS or place is None:
        raise CloudError("Its header must name a format and an element vertex.")
    vertex = elements[place]
    kinds = {one.name: one.kind for one in vertex.properties}
    if len(kinds) < len(vertex.properties):
        raise CloudError("Its vertices have two properties of one name.")
    if any(one.length for one in vertex.properties):
        raise CloudError("Its vertices must have no lists.")
    dtype = np.dtype([(name, _ORDERS[order] + kind) for name, kind in kinds.items()])
    _check_axes(dtype, "Its vertices must have x, y and perhaps z of type float or double.")
    start = line_end + 1
    for element in elements[:place]:
        start = _behind(data, start, element, order)
    return _records(data, start, vertex.count, dtype, is_ascii=order == "ascii")


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
                elements[-1].properties.append(_Property(words[4], _TYPES[words[3]], _TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_Property(words[2], _TYPES[words[1]]))
        except (IndexError, KeyError, ValueError) as error:
            raise CloudError(f"The line '{line.strip()[:_SHOWN]}' of its header is not understood.") from error
    return order, elements


def _behind(data: bytes, start: int, element: _Element, order: str) -> int:
    """The end of an element's data; raises CloudError if the file ends before."""
    if order == "ascii":  # a line each
        for _ in range(max(0, element.count)):
            start = data.find(b"\n", start) + 1
            if start == 0:
                raise CloudError(f"It ends before its vertices, among those of its element '{element.name}'.")
        return start
    sizes = [(np.dtype(_ORDERS[order] + (one.length or one.kind)), np.dtype(one.kind)) for one in element.properties]
    lists = [bool(one.length) for one in element.properties]
    if not any(lists):
        return start + max(0, element.count) * sum(size.itemsize for size, _ in sizes)
    for _ in range(max(0, element.count)):
        for (first, each), is_list in zip(sizes, lists, strict=True):
            if start + first.itemsize > len(data):
                raise CloudError(f"It ends before its vertices, among those of its element '{element.name}'.")
            count = int(np.frombuffer(data, first, 1, start)[0]) if is_list else 0
            start += first.itemsize + max(0, count) * each.itemsize
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
        raise CloudError("It is no PCD file: its header must end with DATA ascii or DATA binary.")
    names = words.get("FIELDS", [])
    dtype = np.dtype([])
    try:
        counts = [int(count) for count in words.get("COUNT", ["1"] * len(names))]
        kinds = zip(words.get("TYPE", []), words.get("SIZE", []), strict=True)
        codes = ["<" + _PCD_KINDS[kind.upper()] + size for kind, size in kinds]
        # Padding between columns has the same name again and again.
        unique = [name if names.count(name) == 1 else f"{name} {number}" for number, name in enumerate(names)]
        columns = zip(unique, codes, counts, strict=True)
        dtype = np.dtype([(name, code, (count,)) if count != 1 else (name, code) for name, code, count in columns])
        points = int(words["POINTS"][0]) if "POINTS" in words else int(words["WIDTH"][0]) * int(words["HEIGHT"][0])
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise CloudError("Its header must have FIELDS, SIZE, TYPE and POINTS that fit together.") from error
    _check_axes(dtype, "Its FIELDS must have x, y and perhaps z of the TYPE F.")
    return _records(data, start, points, dtype, is_ascii=form == "ascii", named="Point")


def _pcd_header(data: bytes) -> tuple[dict[str, list[str]], int]:
    """The words of a header's lines by the keyword before them, and the end of the header."""
    words: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in words:
        end = data.find(b"\n", start)
        if end < 0:
            break
        line = data[start:end].decode("ascii", errors="replace").partition("#")[0].split()
        start = end + 1
        if line and line[0].upper() not in _PCD_HEADER:
            raise CloudError(f"It is no PCD file: '{' '.join(line)[:_SHOWN]}' is no line of such a header.")
        if line:
            words[line[0].upper()] = line[1:]
    return words, start


# ---- both -----------------------------------------------------------------------------------


def _check_axes(dtype: np.dtype[Any], otherwise: str) -> None:
    """Raise CloudError unless x, y and z, if present, are columns of floating-point numbers."""
    names = dtype.names or ()
    axes = [name for name in ("x", "y", "z") if name in names]
    if not {"x", "y"} <= set(axes) or any(dtype[name].kind != "f" for name in axes):
        raise CloudError(otherwise)


def _records(
    data: bytes, start: int, count: int, dtype: np.dtype[Any], *, is_ascii: bool, named: str = "Vertex"
) -> Records:
    """The records of a file with `count` points from `start` on; raises CloudError."""
    if count < 1:
        raise CloudError("There are no points in it.")
    if not is_ascii:
        size = count * dtype.itemsize
        if len(data) < start + size:
            what = "vertices do" if named == "Vertex" else "points do"
            raise CloudError(f"It ends before its {count} {what}.")
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
            rows.append([number_of(cell) for cell in cells])
        except ValueError:
            rows.append([])
        if len(rows[k]) != width:
            commas = ", with decimal points, not commas" if any(map(has_decimal_comma, cells)) else ""
            raise CloudError(f"{named} {k + 1} must have {width} numbers{commas}.")
    points, table, first = np.empty(count, dtype), np.array(rows), 0
    for name in dtype.names or ():
        kind = dtype[name]
        columns = table[:, first : first + int(np.prod(kind.shape))]
        wrong = ~_is_held(columns, kind.base)
        if wrong.any():
            k, column = np.argwhere(wrong)[0]
            held = f"{columns[k, column]:g} for {name}"
            raise CloudError(f"{named} {k + 1} has {held}, which its type {kind.base.name} cannot hold.")
        points[name] = columns.reshape((count, *kind.shape))
        first += columns.shape[1]
    return points


def _is_held(columns: FloatArray, kind: np.dtype[Any]) -> BoolArray:
    """True for numbers that a type can hold: of integers whole ones within limits, of floats finite ones."""
    if kind.kind == "f":
        return ~(np.isfinite(columns) & (np.abs(columns) > np.finfo(kind).max))
    limits = np.iinfo(kind)
    return (columns == np.rint(columns)) & (columns >= limits.min) & (columns <= limits.max)
