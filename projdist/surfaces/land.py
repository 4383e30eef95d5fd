"""Land and lakes on the map, and coasts, shores and borders as lines."""

from __future__ import annotations

import functools

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import FloatArray, IntArray
from projdist.earth import borders, coastlines, lakes, land
from projdist.surfaces.areas import Area, cells_in
from projdist.surfaces.domain import Bounds, longitude_width
from projdist.surfaces.surface import Surface

_POLAR = 86.0  # degrees; no coast is beyond


def land_polygons(surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """The land of a surface: triangles of vertices, (m, 3), and polygons of (x, y) along the coast."""
    found = cells_in(surface, _land_area(resolution))
    return surface.triangles_of(found.inside), found.pieces


@functools.cache
def _land_area(resolution: str) -> Area:
    """The land, with its coast but for where the data cuts it."""
    segments = [np.stack([line[:-1], line[1:]], axis=1) for line in coastlines(resolution)]
    return Area.of(land(resolution), np.concatenate(segments), end=_POLAR)


# Of the region's width and height: lines run on past its edge, where the projecting of them finds their ends.
_MARGIN = 0.02


def lake_polygons(surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """The lakes of a surface, as `land_polygons` has the land."""
    found = cells_in(surface, _lake_area(resolution))
    return surface.triangles_of(found.inside), found.pieces


@functools.cache
def _lake_area(resolution: str) -> Area:
    segments = [np.stack([line[:-1], line[1:]], axis=1) for line in _shores(resolution)]
    return Area.of(lakes(resolution), np.concatenate(segments))


def coast(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The coastlines within bounds and a little farther: lines of (lon, lat) with steps of at most `step` degrees."""
    return _within(_coast_lines(resolution), bounds, step)


def lake_shores(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The shores of lakes, as `coast` has those of the sea."""
    return _within(_shore_lines(resolution), bounds, step)


def country_borders(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The land borders of countries, as `coast` has the coast."""
    return _within(_border_lines(resolution), bounds, step)


def _within(lines: NDArray[np.object_], bounds: Bounds, step: float) -> list[FloatArray]:
    """What of lines lies within bounds and a little farther."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    beside, above = _MARGIN * width, _MARGIN * (north - south)
    if width == 360.0:
        west, width, turns = -1000.0, 2000.0, np.zeros(1)  # all lines, wherever they run on to
    else:
        low, _, high, _ = shapely.total_bounds(lines)
        turns = 360.0 * np.arange(np.ceil((west - beside - high) / 360.0), (west + width + beside - low) / 360.0)
    parts = []
    for turn in turns:
        window = west - beside - turn, south - above, west + width + beside - turn, north + above
        clipped = shapely.get_parts(shapely.clip_by_rect(lines, *window))
        points, line = shapely.get_coordinates(shapely.segmentize(clipped, step), return_index=True)
        points[:, 0] += turn
        parts += np.split(points, np.flatnonzero(np.diff(line)) + 1)
    return [part for part in parts if len(part)]


@functools.cache
def _coast_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(line) for line in coastlines(resolution)])


@functools.cache
def _shores(resolution: str) -> list[FloatArray]:
    return [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(lakes(resolution)))]


@functools.cache
def _shore_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(line) for line in _shores(resolution)])


@functools.cache
def _border_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(border.line) for border in borders(resolution)])
