"""Sketches: the map-independent part of previews, a grid and lines of coasts, borders and the region."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from projdist._typing import FloatArray, IntArray
from projdist.earth import GEOS_ARITHMETIC, land_within
from projdist.regions import GLOBE, Place, RegionLike, get_region, polygons_of
from projdist.surfaces import (
    Bounds,
    coast,
    country_borders,
    graticule,
    graticule_steps,
    ground_size,
    is_part,
    longitude_width,
    normalised,
    shown_part,
)

_COLUMNS, _ROWS = 145, 73
_EDGE = 1e-5  # degrees, on which side of a cut or a pole its nodes are
_WORLD, _SMALL = 100.0, 3.0  # degrees
_SEEN = 1e-3  # of a region's size
_ALONG = 60.0  # steps along it
_MARGIN = 0.3


@dataclass(frozen=True)
class Lines:
    """Concatenated points of lines, the line of each, and the slice of each name."""

    lon: FloatArray
    lat: FloatArray
    line: IntArray
    where: Mapping[str, slice]
    areas: frozenset[str] = frozenset({"region", "land"})


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """A grid of longitudes `u` and latitudes `v`, the area weights of its nodes, and lines.

    `regional`: surroundings are drawn, too; `whole`: the grid is global; `partial`: far parts of the region miss.
    """

    regional: bool
    whole: bool
    partial: bool
    u: FloatArray
    v: FloatArray
    weights: FloatArray
    lines: Lines


@functools.lru_cache(maxsize=32)
def sketch_of(region: str | Place) -> Sketch:
    """The sketch of a region or its text; raises ValueError."""
    return make_sketch(region)


@GEOS_ARITHMETIC
def make_sketch(region: RegionLike) -> Sketch:
    """The sketch of a region; raises ValueError."""
    region = get_region(region)
    place = shown_part(region)
    if not place.area_km2 or (place.bounds == GLOBE.bounds and not is_part(place)):
        return _of_globe()
    u, v = _grid(place.bounds)
    lon, lat = np.meshgrid(u, v)
    inside = place.contains(normalised(lon), lat)
    weights = np.cos(np.radians(lat))
    if inside.any():  # else it is smaller than a cell
        weights = np.where(inside, weights, 0.0)
    regional = is_part(place)
    lines = _lines_about(place) if regional else _world_lines()
    return Sketch(regional=regional, whole=False, partial=place is not region, u=u, v=v, weights=weights, lines=lines)


def _grid(bounds: Bounds) -> tuple[FloatArray, FloatArray]:
    """Grid with as many nodes as that of the globe, its cells nearly square where the region is widest."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    columns = int(np.clip(np.sqrt(_COLUMNS * _ROWS * width * longest / (north - south)), 24, 400))
    lat = np.linspace(south, north, _COLUMNS * _ROWS // columns)
    return west + np.linspace(0.0, width, columns), np.clip(lat, _EDGE - 90.0, 90.0 - _EDGE)


def _of_globe() -> Sketch:
    u = np.linspace(_EDGE - 180.0, 180.0 - _EDGE, _COLUMNS)
    v = np.linspace(_EDGE - 90.0, 90.0 - _EDGE, _ROWS)
    weights = np.repeat(np.cos(np.radians(v))[:, None], u.size, axis=1)
    return Sketch(regional=False, whole=True, partial=False, u=u, v=v, weights=weights, lines=_world_lines())


def _world_lines() -> Lines:
    return _packed({"graticule": graticule(GLOBE.bounds, 30.0, 30.0), "coast": coast(GLOBE.bounds, "110m", 2.0)})


def _lines_about(region: Place) -> Lines:
    """Lines of a region and its surroundings."""
    bounds = _wider(region.bounds)
    size = max(ground_size(region.bounds))
    detail = "110m" if size > _WORLD else "10m" if size < _SMALL else "50m"
    step, seen = size / _ALONG, _SEEN * size
    rings = [_in_steps(ring, step) for ring in _rings(polygons_of(region), seen)]
    found = {
        "graticule": graticule(bounds, *graticule_steps(region.bounds)),
        "coast": _simplified(coast(bounds, detail, np.inf), step, seen),
        "borders": _simplified(country_borders(bounds, detail, np.inf), step, seen),
        "border": rings,
        "region": rings,
        "land": [_in_steps(ring, step) for ring in _rings(land_within(bounds, detail), seen)],
    }
    return _packed(found)


def _wider(bounds: Bounds) -> Bounds:
    """Bounds with a margin."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    reach = _MARGIN * max(ground_size(bounds))
    south, north = max(south - reach, -90.0), min(north + reach, 90.0)
    beside = reach / max(np.cos(np.radians(max(-south, north))), 0.05)
    if width + 2.0 * beside >= 360.0:
        return -180.0, south, 180.0, north
    return west - beside, south, west + width + beside, north


def _rings(geometry: shapely.Geometry, seen: float) -> Iterator[FloatArray]:
    """Rings of polygons, simplified."""
    for ring in shapely.get_rings(shapely.get_parts(shapely.simplify(geometry, seen))):
        yield shapely.get_coordinates(ring)


def _simplified(lines: Sequence[FloatArray], step: float, seen: float) -> list[FloatArray]:
    simple = shapely.simplify([shapely.linestrings(line) for line in lines if len(line) > 1], seen)
    return [_in_steps(shapely.get_coordinates(line), step) for line in simple]


def _in_steps(line: FloatArray, step: float) -> FloatArray:
    """A line with further points, its steps at most `step` degrees."""
    return shapely.get_coordinates(shapely.segmentize(shapely.linestrings(line), step))


def _packed(found: Mapping[str, Sequence[FloatArray]]) -> Lines:
    points, numbers, where, start = [np.empty((0, 2))], [np.empty(0, dtype=int)], {}, 0
    for name, lines in found.items():
        count = sum(map(len, lines))
        points += lines
        numbers += [np.full(len(line), k) for k, line in enumerate(lines)]
        where[name] = slice(start, start + count)
        start += count
    lon, lat = np.concatenate(points).T
    return Lines(lon, lat, np.concatenate(numbers), where)
