"""Lines and areas of a map in grid steps: coasts, borders, graticule, outline, land and the region."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import FloatArray
from projdist.earth import GEOS_ARITHMETIC
from projdist.surfaces import (
    Bounds,
    Surface,
    coast,
    coast_resolution,
    country_borders,
    graticule,
    graticule_steps,
    ground_size,
    land_polygons,
    land_rings,
    project_lines,
)

_STEPS = 65535
_SEEN = 16.0  # steps: a quarter of a pixel of a picture of 1000
_MARK_CELLS = 2000.0  # in the region's width: no mark is drawn finer
_MARK_STEPS = 60.0  # of these at most between two points of a mark, as longer steps are taken for cuts
_LINES, _POLYGON, _MULTI = (1, 2), 3, 4  # shapely's types; those of several parts follow
_FARTHER = 2**32  # steps, than any place is away
_SMALL = 300.0  # square steps, less than a pixel

PackedLines = tuple[NDArray[np.uint16], NDArray[np.uint32]]


@dataclass(frozen=True)
class Grid:
    """Equal steps in x and y from a corner, covering the picture."""

    west: float
    south: float
    step: float

    @classmethod
    def of(cls, surface: Surface) -> Grid:
        """Grid over a picture's view and all vertices of its surface."""
        used = np.unique(surface.triangles)
        west, east, south, north = surface.view
        x = np.concatenate([surface.x[used], [west, east]])
        y = np.concatenate([surface.y[used], [south, north]])
        size = max(float(np.ptp(x)), float(np.ptp(y)))
        return cls(float(x.min()), float(y.min()), size / _STEPS)

    @classmethod
    def about(cls, view: Sequence[float]) -> Grid:
        """Grid over twice a view, for cells that cross its edge."""
        west, east, south, north = view
        size = max(east - west, north - south)
        return cls(west - 0.5 * size, south - 0.5 * size, 2.0 * size / _STEPS)

    def steps(self, xy: FloatArray) -> NDArray[np.uint16]:
        """Places (n, 2) in whole steps; 0 for NaN."""
        return np.nan_to_num(np.clip(np.rint(self.exact(xy)), 0, _STEPS), nan=0.0).astype(np.uint16)

    def exact(self, xy: FloatArray) -> FloatArray:
        """Places in steps."""
        return np.asarray((xy - [self.west, self.south]) / self.step)


@GEOS_ARITHMETIC
def mark_lines(
    surface: Surface, grid: Grid, marks: Mapping[str, Any]
) -> tuple[dict[str, PackedLines], list[list[Any]]]:
    """Outlines of geometries in longitude and latitude, and their names with places in steps."""
    drawn = surface if surface.ground is None else surface.ground
    west, east, south, north = surface.view
    size = max(east - west, north - south)
    spacing = max(ground_size(drawn.domain.box.bounds)) / _MARK_CELLS
    names, lines = [], []
    for name, geometry in marks.items():
        geometry = shapely.segmentize(shapely.simplify(geometry, spacing), _MARK_STEPS * spacing)
        parts = [shapely.get_coordinates(part) for part in _outlines_of(geometry)]
        images = project_lines(drawn.domain, parts, size)
        if images:
            longest = max(images, key=lambda line: shapely.length(shapely.linestrings(line)))
            middle = grid.steps(0.5 * (longest.min(axis=0) + longest.max(axis=0)))
            names.append([name, *middle.tolist()])
            lines += images
    corners = np.array([[west, south], [east, north]])
    return {"marks": _packed(_simplified(lines, grid, shapely.box(*grid.exact(corners).ravel())))}, names


def _outlines_of(geometry: Any) -> Iterator[Any]:
    """The rings and lines of a geometry."""
    for part in np.atleast_1d(shapely.get_parts(geometry)):
        if shapely.get_type_id(part) >= _MULTI:
            yield from _outlines_of(part)
        elif shapely.get_type_id(part) == _POLYGON:
            yield from shapely.get_rings(part)
        elif shapely.get_type_id(part) in _LINES:
            yield part


@GEOS_ARITHMETIC
def map_lines(surface: Surface, grid: Grid) -> dict[str, PackedLines]:
    """Lines and areas by name, as concatenated points and the number of points of each."""
    drawn = surface if surface.ground is None else surface.ground
    west, east, south, north = surface.view
    window = shapely.box(*grid.exact(np.array([west, south])), *grid.exact(np.array([east, north])))
    size = max(east - west, north - south)
    bounds = drawn.domain.box.bounds
    meridians = graticule(bounds, *graticule_steps(surface.domain.region.bounds if surface.is_local else bounds))
    found = {
        "graticule": project_lines(drawn.domain, meridians, size),
        "outline": [*drawn.outline],
        "border": [*surface.border],
    }
    areas: dict[str, list[FloatArray]] = {"region": [*surface.pieces], "land": []}
    if not surface.domain.projection.is_of_another_body:
        found["coast"] = _earthly(surface, drawn, coast, size)
        if surface.is_local:
            found["borders"] = _earthly(surface, drawn, country_borders, size)
        if surface.ground is not None:
            areas["land"] = _land(surface, surface.ground, size)
    return {
        **{name: _packed(_simplified(lines, grid, window)) for name, lines in found.items()},
        **{name: _packed(_united(polygons, grid, window)) for name, polygons in areas.items()},
    }


def _earthly(
    surface: Surface, drawn: Surface, lines: Callable[[Bounds, str, float], list[FloatArray]], size: float
) -> list[FloatArray]:
    """Projected coasts or borders."""
    bounds = drawn.domain.box.bounds
    spacing = min(1.0, max(ground_size(bounds)) / 60.0)
    return project_lines(drawn.domain, lines(bounds, coast_resolution(surface), spacing), size)


def _land(surface: Surface, ground: Surface, size: float) -> list[FloatArray]:
    """Land around a region: rings for even-odd filling, or many adjacent polygons."""
    resolution = coast_resolution(surface)
    rings = land_rings(ground, resolution, size)
    if rings is not None:
        return rings
    triangles, pieces = land_polygons(ground, resolution)
    xy = np.column_stack([ground.x, ground.y])
    return [*xy[triangles], *pieces]


def _simplified(lines: Sequence[FloatArray], grid: Grid, window: shapely.Polygon) -> Iterator[FloatArray]:
    """Lines joined, simplified and clipped to the picture."""
    if not lines:
        return
    points, sizes = grid.exact(np.concatenate(lines)), [len(line) for line in lines]
    steps = shapely.linestrings(points, indices=np.repeat(np.arange(len(lines)), sizes))
    merged = shapely.line_merge(shapely.multilinestrings(steps))
    parts = shapely.get_parts(merged)
    seen = shapely.simplify(parts, _SEEN, preserve_topology=False)
    # Smaller rings collapse to a line of no length, which is not drawn; islands stay as dots.
    shown = shapely.clip_by_rect(np.where(shapely.length(seen) > 0.0, seen, parts), *window.bounds)
    for line in shapely.get_parts(shapely.get_parts(shown)):
        yield shapely.get_coordinates(line)


def _united(polygons: Sequence[FloatArray], grid: Grid, window: shapely.Polygon) -> Iterator[FloatArray]:
    """Rings around adjacent polygons."""
    rings = [*_rings_around(polygons, grid)]
    if not rings:
        return
    indices = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    shapes = shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=indices))
    shapes = shapes[shapely.area(shapes) > _SMALL]
    west, south, east, north = shapely.bounds(shapes).reshape(-1, 4).T
    left, low, right, top = window.bounds
    whole = (west >= left) & (south >= low) & (east <= right) & (north <= top)
    clipped = shapely.get_parts(shapely.intersection(shapely.make_valid(shapes[~whole]), window))
    areas = np.concatenate([shapes[whole], clipped[shapely.get_type_id(clipped) == shapely.GeometryType.POLYGON]])
    seen = shapely.get_rings(shapely.simplify(areas, _SEEN))
    for ring in seen[shapely.area(shapely.polygons(seen)) > _SMALL]:
        yield shapely.get_coordinates(ring)


def _rings_around(polygons: Sequence[FloatArray], grid: Grid) -> Iterator[FloatArray]:
    """Rings of edges, in whole steps, that belong to one polygon only: shared edges cancel.

    Takes a twentieth of the time of a union, with the same even-odd filling.
    """
    if not polygons:
        return
    points = np.rint(grid.exact(np.concatenate(polygons))).astype(np.int64)
    sizes = np.array([len(polygon) for polygon in polygons])
    last = np.cumsum(sizes) - 1
    follower = np.arange(1, points.shape[0] + 1)
    follower[last] = last - sizes + 1
    after = points[follower]
    areas = np.add.reduceat(points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0], last - sizes + 1)
    turned = np.repeat(areas < 0, sizes)[:, None]
    ends = np.stack([np.where(turned, after, points), np.where(turned, points, after)]).reshape(-1, 2)
    _, first, vertex = np.unique(ends[:, 0] * _FARTHER + ends[:, 1], return_index=True, return_inverse=True)
    places = ends[first]
    start, stop = vertex.reshape(2, -1)
    edge, index = np.unique(np.minimum(start, stop) * len(places) + np.maximum(start, stop), return_inverse=True)
    net = np.bincount(index, np.sign(stop - start)).astype(int)
    # Edges of borders lead to a point as often as away from it.
    edge, net = np.repeat(edge, np.abs(net)), np.repeat(net, np.abs(net))
    low, high = edge // len(places), edge % len(places)
    start, stop = np.where(net > 0, low, high), np.where(net > 0, high, low)
    for ring in _traced(start, stop):
        if len(ring) > 2:
            yield places[start[[*ring, ring[0]]]].astype(float)


def _traced(start: NDArray[np.int_], stop: NDArray[np.int_]) -> Iterator[list[int]]:
    """Closed walks along directed edges, as lists of edge numbers."""
    follower = np.empty(len(start), dtype=int)
    follower[np.argsort(stop, kind="stable")] = np.argsort(start, kind="stable")
    after = follower.tolist()
    for first in range(len(after)):
        walk = []
        while after[first] >= 0:
            walk.append(first)
            after[first], first = -1, after[first]
        if walk:
            yield walk


def _packed(lines: Iterator[FloatArray]) -> PackedLines:
    found = [np.rint(line) for line in lines if len(line) > 1]
    points = np.concatenate([np.empty((0, 2)), *found])
    return np.clip(points, 0, _STEPS).astype(np.uint16), np.array([len(line) for line in found], dtype=np.uint32)
