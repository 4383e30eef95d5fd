"""Land and lakes on the map, and coasts, shores and borders as lines."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import FloatArray, IntArray
from projdist.earth import borders, coastlines, lakes, lakes_within, land, land_within, shores
from projdist.regions import Polygons
from projdist.surfaces.areas import Area, cells_in
from projdist.surfaces.domain import Bounds, ground_size, longitude_width
from projdist.surfaces.lines import project_lines
from projdist.surfaces.surface import Surface

_FINEST = "10m"
_POLAR = 86.0  # degrees; no coast is beyond


_WORLD, _SMALL, _LARGEST_FINE = 100.0, 3.0, 30.0  # degrees


def coast_resolution(surface: Surface) -> str:
    """Finer coasts for parts of the world, the finest for cities; about a country those of the data that it is of."""
    region = surface.domain.region
    size = max(ground_size(region.bounds))
    if size > _WORLD:
        return "110m"
    usual = "10m" if size < _SMALL else "50m"
    own = region.resolution if isinstance(region, Polygons) else ""
    # Fine coasts of a continent take a second, and are not seen.
    return usual if own == "" or (own == "10m" and size > _LARGEST_FINE) else own


def land_polygons(surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """The land of a surface: triangles of vertices, (m, 3), and polygons of (x, y) along the coast."""
    is_wide = _is_wide(surface) and resolution != _FINEST
    return _polygons(surface, _all_land(resolution) if is_wide else _land_about(surface, resolution))


def land_rings(surface: Surface, resolution: str, size: float) -> list[FloatArray] | None:
    """The rings (x, y) about the land of a surface, and about its holes; None where the map may be torn there.

    `size` is the width or height of the map in metres. It mostly takes a quarter of the time of `land_polygons`.
    """
    rows, columns = surface.shape
    # A turned map is singular at a point that a ring may be around.
    turned = surface.frame.axes is not None
    if turned or len(surface.whole) != (rows - 1) * (columns if _is_wide(surface) else columns - 1):
        return None
    bounds = _window(surface.domain.box.bounds, -_INSET)
    if _is_wide(surface) and resolution != _FINEST:
        found = shapely.clip_by_rect(land(resolution), *bounds)
    else:
        found = land_within(bounds, resolution)
    rings = shapely.segmentize(shapely.get_rings(shapely.get_parts(found)), max(ground_size(bounds)) / _ALONG)
    images = project_lines(surface.domain, [shapely.get_coordinates(ring) for ring in rings], size)
    are_whole = len(images) == len(rings) and all((image[0] == image[-1]).all() for image in images)
    return images if are_whole else None


def lake_polygons(surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """The lakes of a surface, as `land_polygons` has the land; at 1 : 10 million there are those at 1 : 50 million."""
    scale = _of_lakes(resolution)
    return _polygons(surface, _all_lakes(scale) if _is_wide(surface) else _lakes_about(surface, scale))


def _polygons(surface: Surface, area: Area) -> tuple[IntArray, list[FloatArray]]:
    found = cells_in(surface, area)
    return surface.covering(found.inside), found.pieces


def _is_wide(surface: Surface) -> bool:
    return longitude_width(surface.domain.box.bounds) == 360.0


@functools.cache
def _all_land(resolution: str) -> Area:
    """The land, with its coast but for where the data cuts it."""
    return Area.of(land(resolution), _segments(coastlines(resolution)), end=_POLAR)


def _land_about(surface: Surface, resolution: str) -> Area:
    """The land where a surface is: all takes seconds to make of the finest, and half a second of others."""
    bounds = surface.domain.box.bounds
    return Area.of(land_within(_window(bounds), resolution), _segments(coast(bounds, resolution, np.inf)), end=_POLAR)


@functools.cache
def _all_lakes(resolution: str) -> Area:
    return Area.of(lakes(resolution), _segments(shores(resolution)))


def _lakes_about(surface: Surface, resolution: str) -> Area:
    bounds = surface.domain.box.bounds
    return Area.of(lakes_within(_window(bounds), resolution), _segments(lake_shores(bounds, resolution, np.inf)))


def _segments(lines: Sequence[FloatArray]) -> FloatArray:
    """The steps of lines, (n, 2, 2)."""
    return np.concatenate([np.empty((0, 2, 2)), *(np.stack([line[:-1], line[1:]], axis=1) for line in lines)])


# Of the region's width and height: lines run on past its edge, where the projecting of them finds their ends.
_MARGIN = 0.02
_ALONG = 60.0  # steps along the size of a part of the world
_INSET = 1e-9  # so that points on the edge are within, however they are rounded


def _window(bounds: Bounds, margin: float = _MARGIN) -> Bounds:
    """Bounds and a little more."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    beside, above = margin * width, margin * (north - south)
    return west - beside, south - above, west + width + beside, north + above


def coast(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The coastlines within bounds and a little farther: lines of (lon, lat) with steps of at most `step` degrees."""
    return _within(_coast_lines(resolution), bounds, step)


def lake_shores(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The shores of lakes, as `coast` has those of the sea."""
    return _within(_shore_lines(_of_lakes(resolution)), bounds, step)


def country_borders(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The land borders of countries, as `coast` has the coast."""
    return _within(_border_lines(resolution), bounds, step)


def _within(lines: NDArray[np.object_], bounds: Bounds, step: float) -> list[FloatArray]:
    """What of lines lies within bounds and a little farther."""
    west, south, east, north = _window(bounds)
    if longitude_width(bounds) == 360.0:
        west, east, turns = -1000.0, 1000.0, np.zeros(1)  # all lines, wherever they run on to
    else:
        low, _, high, _ = shapely.total_bounds(lines)
        turns = 360.0 * np.arange(np.ceil((west - high) / 360.0), (east - low) / 360.0)
    parts = []
    for turn in turns:
        clipped = shapely.get_parts(shapely.clip_by_rect(lines, west - turn, south, east - turn, north))
        points, line = shapely.get_coordinates(shapely.segmentize(clipped, step), return_index=True)
        points[:, 0] += turn
        parts += np.split(points, np.flatnonzero(np.diff(line)) + 1)
    return [part for part in parts if len(part)]


@functools.cache
def _coast_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(line) for line in coastlines(resolution)])


def _of_lakes(resolution: str) -> str:
    return "50m" if resolution == _FINEST else resolution


@functools.cache
def _shore_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(line) for line in shores(resolution)])


@functools.cache
def _border_lines(resolution: str) -> NDArray[np.object_]:
    return np.array([shapely.linestrings(border.line) for border in borders(resolution)])
