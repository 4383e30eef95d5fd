"""PLY files (G. Turk, "The PLY polygon file format", 1994), ascii and binary: their vertices.

What follows the vertices, faces mostly, is carried along byte for byte.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.support import number_of

__all__ = ["CloudError", "Ply", "read_ply"]

_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_END = b"end_header"
_SHOWN = 60  # letters of a line in a message


class CloudError(ValueError):
    """What is wrong with the content of a file, a sentence."""


@dataclass(frozen=True, eq=False)
class Ply:
    """A PLY file: its header, its vertices as a structured array, and what follows them."""

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
        """Shape (M, 3), if there are any."""
        names = ["nx", "ny", "nz"]
        return self._columns(names) if {*names, "z"} <= set(self.names) else None

    def column(self, name: str) -> FloatArray | None:
        """A property of the vertices, None where there is none."""
        return self._columns([name])[:, 0] if name in self.names else None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the vertices' properties."""
        return self.vertices.dtype.names or ()

    def _columns(self, names: list[str]) -> FloatArray:
        return np.stack([self.vertices[name].astype(float) for name in names], axis=1)

    def moved(self, points: FloatArray, normals: FloatArray | None) -> bytes:
        """The file with other points, and other normals if it has some; in the types that it has."""
        vertices = self.vertices.copy()
        for names, values in (("x", "y", "z"), points), (("nx", "ny", "nz"), normals):
            if values is not None:
                for name, column in zip(names, values.T, strict=False):
                    vertices[name] = column
        if not self.ascii:
            return self.header + vertices.tobytes() + self.tail
        # str of numpy's numbers is the shortest text that is read as the same number of that type.
        lines = "".join(
            " ".join(str(value) for value in row) + "\n" for row in zip(*map(list, _cells(vertices)), strict=True)
        )
        return self.header + lines.encode() + self.tail


def _cells(vertices: AnyArray) -> list[AnyArray]:
    return [vertices[name] for name in vertices.dtype.names or ()]


def read_ply(data: bytes) -> Ply:
    """The parts of a file; raises CloudError."""
    end = data.find(_END)
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise CloudError("It is no PLY file: its header must begin with ply and end with end_header.")
    header = data[: line_end + 1]
    order, count, properties = _vertex(header.decode("ascii", errors="replace").splitlines())
    kinds = dict(properties)
    if len(kinds) < len(properties):
        raise CloudError("Its vertices have two properties of one name.")
    dtype = np.dtype([(name, _ORDERS[order] + kind) for name, kind in properties])
    if not all(kinds.get(name, "").startswith("f") for name in ("x", "y")) or kinds.get("z", "f").startswith(
        ("i", "u")
    ):
        raise CloudError("Its vertices must have x, y and perhaps z of type float or double.")
    if count < 1:
        raise CloudError("There are no points in it.")
    if order != "ascii":
        size = count * dtype.itemsize
        if len(data) < len(header) + size:
            raise CloudError(f"It ends before its {count} vertices do.")
        vertices = np.frombuffer(data, dtype, count, len(header))
        return Ply(header, vertices, data[len(header) + size :], False)
    # A header may claim more vertices than there are numbers for: what there are of lines counts.
    content = data[len(header) :]
    *lines, tail = content.split(b"\n", min(count, len(content)))
    if len(lines) < count:
        lines, tail = [*lines, tail], b""
    return Ply(header, _ascii_vertices(lines, count, dtype), tail, True)


def _ascii_vertices(lines: list[bytes], count: int, dtype: np.dtype[np.void]) -> AnyArray:
    """The vertices of the first lines; raises CloudError for the first one that its properties cannot hold."""
    names = dtype.names or ()
    rows = []
    for k in range(count):
        try:
            rows.append([number_of(cell.decode("ascii")) for cell in lines[k].split()])
        except (ValueError, IndexError):  # that is no number or ASCII, or behind the end
            rows.append([])
        if len(rows[k]) != len(names):
            raise CloudError(f"Vertex {k + 1} must have {len(names)} numbers.")
    vertices = np.empty(count, dtype)
    for name, column in zip(names, np.array(rows).T, strict=True):
        kind = vertices.dtype[name]
        wrong = ~_is_held(column, kind)
        if wrong.any():
            k = int(np.argmax(wrong))
            raise CloudError(f"Vertex {k + 1} has {column[k]:g} for {name}, which its type {kind.name} cannot hold.")
        vertices[name] = column
    return vertices


def _is_held(column: FloatArray, kind: np.dtype[Any]) -> BoolArray:
    """Whether a type can hold numbers: an integer one whole numbers within its limits, others all that are finite."""
    if kind.kind == "f":
        return ~(np.isfinite(column) & (np.abs(column) > np.finfo(kind).max))
    limits = np.iinfo(kind)
    return (column == np.rint(column)) & (column >= limits.min) & (column <= limits.max)


def _vertex(lines: list[str]) -> tuple[str, int, list[tuple[str, str]]]:
    """The format of a header, and how many vertices with which properties; they must come first."""
    order, count, properties, elements = "", -1, list[tuple[str, str]](), list[str]()
    for line in lines:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = words[1]
            elif words[:1] == ["element"]:
                elements.append(words[1])
                count = int(words[2]) if words[1] == "vertex" else count
            elif words[:1] == ["property"] and elements == ["vertex"]:
                properties.append((words[2], _TYPES[words[1]]))
        except (IndexError, KeyError, ValueError) as error:
            raise CloudError(f"The line '{line.strip()[:_SHOWN]}' of its header is not understood.") from error
    if order not in _ORDERS or elements[:1] != ["vertex"]:
        raise CloudError("Its header must name a format and, as the first element, its vertices.")
    return order, count, properties
