"""Maps of the world as triangles, which PROJ's tinshift runs: a file, and the pipeline that reads it.

https://proj.org/en/stable/operations/transformations/tinshift.html
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.designs.spline_sheets import SplineMap

__all__ = ["pipeline_with", "triangulation"]

_ROUNDING = 1e-9  # of a step, and of degrees
_BEYOND = 1e-13  # of a latitude: PROJ may miss triangles on whose edges the poles lie


def triangulation(given: SplineMap, name: str, step: float) -> dict[str, Any]:
    """The file's contents: triangles between lines of a graticule that are at most `step` degrees apart.

    They go from longitudes and latitudes in the frame of the map's cut, degrees, to x and y, and cover the longitudes
    from -180 to 180. At their corners they are the map; between them they are linear.
    """
    u, v = (_divided(splines.breaks, step) for splines in (given.u, given.v))
    if given.cut.is_straight:  # no triangle passes the longitude 180
        u = np.union1d(u, np.radians(np.mod(180.0 - given.cut.points[0][0], 360.0) - 180.0))
    x, y = given.on_sheet(*(axis.ravel() for axis in np.meshgrid(u, v)))
    lat = np.repeat(np.degrees(v), u.size)
    lon = np.tile(np.degrees(u), v.size) + given.cut.at(lat)[0] - 180.0
    lon = np.where(np.abs(np.mod(lon, 360.0) - 180.0) < _ROUNDING, np.round(lon), lon)
    lat *= 1.0 + _BEYOND
    triangles = _triangles(v.size, u.size)
    vertices: list[FloatArray] = []
    found: list[IntArray] = []
    for turn in (-360.0, 0.0, 360.0):
        corners = (lon + turn)[triangles]
        shown = triangles[(corners.max(axis=1) > -180.0) & (corners.min(axis=1) < 180.0)]
        used, places = np.unique(shown, return_inverse=True)
        found.append(places.reshape(-1, 3) + sum(len(part) for part in vertices))
        vertices.append(np.column_stack([lon + turn, lat, x, y])[used])
    return {
        "file_type": "triangulation_file",
        "format_version": "1.0",
        "name": name,
        "transformed_components": ["horizontal"],
        "vertices_columns": ["source_x", "source_y", "target_x", "target_y"],
        "triangles_columns": ["idx_vertex1", "idx_vertex2", "idx_vertex3"],
        "vertices": np.concatenate(vertices).tolist(),
        "triangles": np.concatenate(found).tolist(),
    }


def pipeline_with(path: Path, given: SplineMap) -> str:
    """PROJ's operation from degrees to metres that reads the file."""
    shift = f'+proj=tinshift +file="{path}"' if " " in str(path) else f"+proj=tinshift +file={path}"
    if given.cut.frame is None:
        return shift
    to_radians, to_degrees = (f"+proj=unitconvert +xy_in={a} +xy_out={b}" for a, b in (("deg", "rad"), ("rad", "deg")))
    return f"+proj=pipeline +step {to_radians} +step {given.cut.frame.step} +step {to_degrees} +step {shift}"


def _divided(breaks: FloatArray, step: float) -> FloatArray:
    """The breaks, and values between them, so that they are no more than `step` degrees apart.

    As many between any two: about the ends of the cut, where the map is steep, breaks are close together.
    """
    pieces = int(np.ceil(np.degrees(np.diff(breaks).max()) / step - _ROUNDING))
    parts = np.linspace(breaks[:-1], breaks[1:], pieces, endpoint=False, axis=1)
    return np.append(parts.ravel(), breaks[-1])


def _triangles(rows: int, columns: int) -> IntArray:
    """The corners (n, 3) of the halves of a grid's cells, in counterclockwise order, symmetric about the middle."""
    j, i = (axis.ravel() for axis in np.mgrid[: rows - 1, : columns - 1])
    a = j * columns + i
    b, c, d = a + 1, a + columns, a + columns + 1
    rising = ((2 * i < columns - 1) == (2 * j < rows - 1))[:, None]
    first = np.where(rising, np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(rising, np.stack([a, d, c], axis=1), np.stack([b, d, c], axis=1))
    return np.concatenate([first, second])
