"""Lines from numbers, geometries and files: vertices with longitude, latitude and height."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from projdist._typing import FloatArray
from projdist.projections import to_lonlat
from projdist.regions.language import layer_path
from projdist.support import quoted

if TYPE_CHECKING:
    from projdist.regions.vector_files import ReadShapes

_ALLOWED = "LON,LAT,LON,LAT,..., positions (n, 2) or (n, 3), a line, or the path of a file with one"
_LARGEST = 360.0  # degrees of longitude


def line_of(line: Any) -> FloatArray:
    """The vertices (n, 3) of a line in degrees and metres; unknown heights are NaN. Raises ValueError."""
    if isinstance(line, str | os.PathLike):
        return _of_text(os.fspath(line))
    shape = getattr(line, "__geo_interface__", line)
    if isinstance(shape, Mapping):
        from projdist.regions.vector_files import (  # shapely is slow to load
            ReadShapes,
            shapes_of,
            stated_transform,
            tell_of_geojson_in_degrees,
        )

        text = "Invalid line."
        crs = getattr(line, "crs", None)
        transform = stated_transform(shape, text) if crs is None else to_lonlat(crs)
        found = _joined(ReadShapes([*shapes_of(dict(shape), text)], transform), text)
        tell_of_geojson_in_degrees(shape, crs, text)
        return found
    text = f"Invalid line {quoted(line)}."
    if not isinstance(line, list | tuple | np.ndarray):
        raise ValueError(f"{text} It must be {_ALLOWED}.")
    return _checked(_vertices(line, text), text)


def _of_text(text: Any) -> FloatArray:
    """The line of numbers with commas, or of a file."""
    said = f"Invalid line {quoted(text)}."
    if not isinstance(text, str) or not text:
        raise ValueError(f"{said} It must be {_ALLOWED}.")
    words = [word.strip() for word in text.split(",")]
    unread = [word for word in words if not _is_number(word)]
    if unread and len(unread) < 0.5 * len(words) and not os.path.exists(text):
        raise ValueError(f"{said} Coordinates must be numbers LON,LAT,LON,LAT,...; {quoted(unread[0])} is none.")
    if unread:
        from projdist.regions.vector_files import read  # as above

        path, layer = layer_path(text)
        said = f"Invalid line file '{path}'."
        return _joined(read(path, layer, said, [], ("LineString", "MultiLineString")), said)
    if len(words) < 4 or len(words) % 2:
        raise ValueError(f"{said} It must be LON,LAT,LON,LAT,..., two numbers a point.")
    return _checked(_vertices(np.reshape([float(word) for word in words], (-1, 2)), said), said)


def _is_number(word: str) -> bool:
    """True if a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def _joined(source: ReadShapes, text: str) -> FloatArray:
    """The single line that the lines of shapes form when joined end to end."""
    parts: list[Any] = []
    for shape in source.shapes:
        if shape.kind not in ("", "LineString", "MultiLineString"):
            raise ValueError(f"{text} It must hold lines only; it holds a {shape.kind}.")
        parts += [shape.coordinates] if shape.kind == "LineString" else shape.coordinates or []
    lines = [_vertices(part, text) for part in parts if part is not None and len(part)]
    if not lines:
        raise ValueError(f"{text} It holds no line.")
    line, rest = lines[0], lines[1:]
    while rest:
        found = next(((k, both) for k, other in enumerate(rest) if (both := _chained(line, other)) is not None), None)
        if found is None:
            raise ValueError(f"{text} It must hold one line, or lines that join end to end; it holds {len(lines)}.")
        line = found[1]
        del rest[found[0]]
    if source.transform is not None:
        line[:, :2] = np.column_stack(source.transform(*line[:, :2].T))
    return _checked(line, text)


def _chained(line: FloatArray, other: FloatArray) -> FloatArray | None:
    """Two lines joined in the direction of the first; None if they share no end."""
    for turned in (other, other[::-1]):
        if np.array_equal(line[-1, :2], turned[0, :2]):
            return np.vstack([line, turned[1:]])
        if np.array_equal(turned[-1, :2], line[0, :2]):
            return np.vstack([turned, line[1:]])
    return None


def _vertices(given: Any, text: str) -> FloatArray:
    """Positions with two or three numbers as an array (n, 3)."""
    from projdist.regions.vector_files import positions  # as above

    plane = positions(given, text)
    heights = [position[2] if len(position) > 2 else np.nan for position in given]
    try:
        return np.column_stack([plane, np.array(heights, dtype=float)])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{text} Its heights must be numbers.") from error


def _checked(line: FloatArray, text: str) -> FloatArray:
    """The line without repeated vertices; raises ValueError off the globe or for fewer than two places."""
    if not (np.abs(line[:, :2]) <= [_LARGEST, 90.0]).all():
        raise ValueError(
            f"{text} Its longitudes must lie within -360 and 360 degrees, and its latitudes within -90 and 90, or the "
            "file must state another CRS."
        )
    moves = np.append(True, (np.diff(line[:, :2], axis=0) != 0.0).any(axis=1))
    if moves.sum() < 2:
        raise ValueError(f"{text} It must have two places or more.")
    return line[moves]
