"""Land, lakes and other areas on a map, as parts of a surface's cells, with coasts and borders as lines."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray, IntArray, NDArray
from projdist.earth import GEOS_ARITHMETIC, borders, coastlines, lakes, land, polygons_within, shores, wrapped
from projdist.regions import Polygons
from projdist.surfaces.domain import Bounds, ground_size, longitude_width, project_lines
from projdist.surfaces.surface import Surface

_TURNS = (-360.0, 0.0, 360.0)
_REACH = 200.0  # degrees of longitude, as cells lie within 180 and a little more
_STRAIGHT = 1e-12  # relative difference in area between a cell and its bounding box
_TILES = 36  # an area is cut into at most 36 by 36 tiles, which makes intersections with small cells cheap


@dataclass(frozen=True)
class PreparedArea:
    """Polygons in degrees, indexed for intersection with cells."""

    polygons: shapely.MultiPolygon
    steps: FloatArray  # the edges as points, (n, 2, 2)
    edges: shapely.STRtree  # of the border, also shifted by 360 degrees either way
    tiles: shapely.STRtree  # parts of the polygons, likewise
    end: float = 90.0  # cells that reach beyond this latitude are taken as wholly inside or outside

    @classmethod
    @GEOS_ARITHMETIC
    def of(cls, polygons: shapely.MultiPolygon, edges: FloatArray, end: float = 90.0) -> PreparedArea:
        """The area of polygons whose border has the segments (n, 2, 2)."""
        turned = np.concatenate([edges + np.array([turn, 0.0]) for turn in _TURNS])
        near = turned[np.abs(turned[..., 0]).min(axis=1) < _REACH]
        shapely.prepare(polygons)
        tiles: list[shapely.Geometry] = []
        if not polygons.is_empty:
            west, south, east, north = shapely.bounds(polygons)
            lons, lats = np.linspace(west, east, _TILES + 1), np.linspace(south, north, _TILES + 1)
            for k in range(_TILES):
                strip = clipped(polygons, lons[k], south, lons[k + 1], north)
                if not strip.is_empty:
                    tiles += [clipped(strip, lons[k], low, lons[k + 1], high) for low, high in pairwise(lats)]
        # A coast that a tile's side cuts many times may cross itself there.
        tiles = [tile if tile.is_valid else shapely.make_valid(tile) for tile in tiles if not tile.is_empty]
        pairs = ((turn, tile) for turn in _TURNS for tile in tiles if abs(tile.centroid.x + turn) < _REACH)
        beside = [shapely.transform(tile, lambda xy, turn=turn: xy + np.array([turn, 0.0])) for turn, tile in pairs]
        return cls(polygons, near, shapely.STRtree(shapely.linestrings(near)), shapely.STRtree(beside), end)

    def contains(self, lon: FloatArray, lat: FloatArray) -> BoolArray:
        """True for points inside; longitudes -180 to 180."""
        return np.asarray(shapely.contains_xy(self.polygons, lon, lat))

    def may_border(self, lons: FloatArray, lats: FloatArray) -> IntArray:
        """Numbers of the cells, corners (n, m), whose bounding boxes the border may touch."""
        # Boxes are compared on a grid of about as many pixels as there are cells, without making geometries.
        low = np.column_stack([lons.min(axis=0), lats.min(axis=0)])
        high = np.column_stack([lons.max(axis=0), lats.max(axis=0)])
        start, size = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
        size = np.maximum((1.0 + 1e-9) * size, 1e-300)  # so that the last cell ends within the last pixel
        pixels = np.ceil(np.sqrt(len(low)) * size / size.max())

        def pixel(points: FloatArray) -> IntArray:
            """Column and row of points in the grid, whose rim stands for everything outside."""
            return np.clip(np.floor((points - start) * (pixels / size)), -1.0, pixels).astype(int) + 1

        covered = np.zeros(pixels.astype(int) + 3, dtype=int)
        first, end = pixel(self.steps.min(axis=1)), pixel(self.steps.max(axis=1)) + 1
        for one, other, change in ((first, first, 1), (end, end, 1), (first, end, -1), (end, first, -1)):
            np.add.at(covered, (one[:, 0], other[:, 1]), change)
        boxes = covered.cumsum(axis=0).cumsum(axis=1)[:-1, :-1]  # how many border segments' boxes cover each pixel
        total = np.pad((boxes > 0).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        (west, south), (east, north) = pixel(low).T, (pixel(high) + 1).T
        return np.flatnonzero(total[east, north] - total[west, north] - total[east, south] + total[west, south])


@dataclass(frozen=True)
class CellsIn:
    """The cells of a surface, whole ones, then cut ones, that lie in an area."""

    inside: BoolArray  # wholly
    touched: BoolArray  # wholly or in part
    pieces: list[FloatArray]  # polygons (x, y), the parts of cells that are not wholly inside


def cells_in(surface: Surface, area: PreparedArea) -> CellsIn:
    """The parts of a surface's cells in an area."""
    lon, lat = surface.lonlat()
    inside = area.contains(wrapped(lon), lat)
    sizes = np.array([len(cell) for cell in surface.cut], dtype=int)
    first = len(surface.whole)
    groups = [(np.arange(first), surface.whole, False)]
    for size in np.unique(sizes):
        some = np.flatnonzero(sizes == size)
        groups.append((first + some, np.array([surface.cut[k] for k in some]), True))
    wholly, touched = np.zeros(first + sizes.size, dtype=bool), np.zeros(first + sizes.size, dtype=bool)
    pieces: list[FloatArray] = []
    for number, cells, torn in groups:
        if len(cells):
            wholly[number], owner, found = _in_cells(surface, area, cells, inside, torn=torn)
            touched[number[owner]] = True
            pieces += found
    return CellsIn(wholly, wholly | touched, pieces)


@GEOS_ARITHMETIC
def _in_cells(
    surface: Surface, area: PreparedArea, cells: IntArray, inside: BoolArray, *, torn: bool
) -> tuple[BoolArray, IntArray, list[FloatArray]]:
    """Flags of cells (m, n), with n corners, inside the area, and of the others numbers and pieces of their parts."""
    lon, lat = surface.lonlat()
    xy = np.column_stack([surface.x, surface.y])
    lons, lats = lon[cells.T], lat[cells.T]
    lons = wrapped(lons[0]) + (np.mod(lons - lons[0] + 180.0, 360.0) - 180.0)
    near = area.may_border(lons, lats)
    near = near[np.abs(lats[:, near]).max(axis=0) <= area.end]
    corners = np.stack([lons[:, near].T, lats[:, near].T], axis=-1)
    shapes = shapely.polygons(corners)
    met = np.unique(area.edges.query(shapes, predicate="intersects")[0])
    shapes, corners, border = shapes[met], corners[met], near[met]
    on_border = np.zeros(len(cells), dtype=bool)
    on_border[border] = True
    cell, tile = area.tiles.query(shapes, predicate="intersects")
    valid = shapely.make_valid(shapes) if torn else shapes
    parts, owner = shapely.get_parts(_parts_of(area.tiles.geometries[tile], valid[cell]), return_index=True)
    parts, owner = shapely.get_parts(parts, return_index=True)[0], cell[owner]
    keep = shapely.area(parts) > 0
    rings, owner = shapely.get_exterior_ring(parts[keep]), owner[keep]
    points, ring = shapely.get_coordinates(rings, return_index=True)
    x, y = np.full(points.T.shape, np.nan) if torn else surface.domain(wrapped(points[:, 0]), points[:, 1])
    image = np.column_stack([x, y])
    starts = np.searchsorted(ring, np.arange(owner.size))
    places, polygons = (np.split(values, starts)[1:] for values in (points, image))
    for number in np.unique(ring[np.isnan(image[:, 0])]):
        # A point on a seam has two images; the linear map of the cell's corners chooses the right one.
        k = owner[number]
        offsets, there = corners[k] - corners[k][0], places[number] - corners[k][0]
        sides = np.hstack([offsets, np.ones((len(offsets), 1))])
        matrix = np.linalg.lstsq(sides, xy[cells[border[k]]], rcond=None)[0]
        polygons[number] = np.asarray(np.hstack([there, np.ones((len(there), 1))]) @ matrix)
    return inside[cells.T].all(axis=0) & ~on_border, border[owner], polygons


def _parts_of(tiles: NDArray[np.object_], cells: NDArray[np.object_]) -> NDArray[np.object_]:
    """Intersections of tiles with cells, for cells along meridians and parallels in a fifth of the time."""
    bounds = shapely.bounds(cells).reshape(-1, 4)
    if not np.allclose(shapely.area(shapely.box(*bounds.T)), shapely.area(cells), rtol=_STRAIGHT, atol=0.0):
        return np.asarray(shapely.intersection(cells, tiles))
    found = np.empty(len(cells), dtype=object)
    found[:] = [clipped(tile, *box) for tile, box in zip(tiles, bounds.tolist(), strict=True)]
    return found


def clipped(polygons: shapely.Geometry, *box: float) -> shapely.Geometry:
    """Polygons within west, south, east, north, by GEOS's fast way, or by the general one where that fails."""
    try:
        return shapely.clip_by_rect(polygons, *box)
    except shapely.errors.GEOSException:
        return shapely.intersection(polygons, shapely.box(*box))


# ---- land ----------------------------------------------------------------------------------------

_FINEST = "10m"
_POLAR = 86.0  # degrees of latitude beyond which there is no coast
# Degrees: sizes of regions beyond which coasts are coarse, below which they are fine, and up to which they may be.
_WORLD, _SMALL, _LARGEST_FINE = 100.0, 3.0, 30.0
# The name of polygons, functions for them and for the lines around them, and the latitude beyond which there are none.
_AREAS = {"coast": ("land", land, coastlines, _POLAR), "shores": ("lakes", lakes, shores, 90.0)}


def coast_resolution(surface: Surface) -> str:
    """Resolution of coasts for a picture: finer for smaller regions; for a country that of its own polygons."""
    region = surface.domain.region
    size = max(ground_size(region.bounds))
    if size > _WORLD:
        return "110m"
    usual = "10m" if size < _SMALL else "50m"
    own = region.resolution if isinstance(region, Polygons) else ""
    # Fine coasts of a continent take a second and cannot be seen.
    return usual if own == "" or (own == "10m" and size > _LARGEST_FINE) else own


def _polygons(kind: str, surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """Triangles of vertices, (m, 3), and polygons of (x, y) along the border that are what a border encloses."""
    resolution = _available(kind, resolution)
    if _is_wide(surface) and resolution != _FINEST:
        area = _whole_area(kind, resolution)
    else:
        # All land at the finest resolution takes seconds to prepare, and half a second at others.
        bounds, (name, _, _, end) = surface.domain.box.bounds, _AREAS[kind]
        border = segments_of(_within(kind, bounds, resolution, np.inf))
        area = PreparedArea.of(polygons_within(name, _window(bounds), resolution), border, end)
    found = cells_in(surface, area)
    return surface.covering(found.inside), found.pieces


land_polygons, lake_polygons = functools.partial(_polygons, "coast"), functools.partial(_polygons, "shores")
"""The land and the lakes of a surface at a resolution: triangles of vertices, and polygons (x, y) along the shore."""


def land_rings(surface: Surface, resolution: str, size: float) -> list[FloatArray] | None:
    """Rings (x, y) around the land of a surface and around its holes; None if the map may be torn there."""
    # `size` is the width or height of the map in metres. This usually takes a quarter of the time of `land_polygons`.
    rows, columns = surface.shape
    # A turned map is singular at a point, which a ring may surround.
    turned = surface.frame.axes is not None
    if turned or len(surface.whole) != (rows - 1) * (columns if _is_wide(surface) else columns - 1):
        return None
    bounds = _window(surface.domain.box.bounds, -_INSET)
    if _is_wide(surface) and resolution != _FINEST:
        found = clipped(land(resolution), *bounds)
    else:
        found = polygons_within("land", bounds, resolution)
    rings = shapely.segmentize(shapely.get_rings(shapely.get_parts(found)), max(ground_size(bounds)) / _ALONG)
    images = project_lines(surface.domain, [shapely.get_coordinates(ring) for ring in rings], size)
    are_whole = len(images) == len(rings) and all((image[0] == image[-1]).all() for image in images)
    return images if are_whole else None


def _is_wide(surface: Surface) -> bool:
    """True for a surface all around the globe."""
    return longitude_width(surface.domain.box.bounds) == 360.0


@functools.cache
def _whole_area(kind: str, resolution: str) -> PreparedArea:
    """All land or all lakes, bordered by shores but not by the cuts of the data."""
    _, polygons, lines, end = _AREAS[kind]
    return PreparedArea.of(polygons(resolution), segments_of(lines(resolution)), end)


def segments_of(lines: Sequence[FloatArray]) -> FloatArray:
    """The segments of lines, (n, 2, 2)."""
    return np.concatenate([np.empty((0, 2, 2)), *(np.stack([line[:-1], line[1:]], axis=1) for line in lines)])


_MARGIN = 0.02  # of the region's width and height: lines run on past its edge, and projecting them finds their ends
_ALONG = 60.0  # steps along the size of a part of the world
_INSET = 1e-9  # keeps points on the edge inside despite rounding


def _window(bounds: Bounds, margin: float = _MARGIN) -> Bounds:
    """Bounds with a margin, a share of their size."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    beside, above = margin * width, margin * (north - south)
    return west - beside, south - above, west + width + beside, north + above


def _within(kind: str, bounds: Bounds, resolution: str, step: float | None = None) -> list[FloatArray]:
    """Lines of (lon, lat) within bounds and a little beyond, with steps of at most `step` degrees."""
    # By default a step is a sixtieth of the size of the part of the world, at most a degree.
    lines = _all_lines(kind, _available(kind, resolution))
    step = min(1.0, max(ground_size(bounds)) / _ALONG) if step is None else step
    west, south, east, north = _window(bounds)
    if longitude_width(bounds) == 360.0:
        west, east, turns = -1000.0, 1000.0, np.zeros(1)  # all lines, also beyond 180 degrees
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


coast, lake_shores, country_borders = (functools.partial(_within, kind) for kind in ("coast", "shores", "borders"))
"""Coastlines, shores of lakes and land borders of countries within bounds, at a resolution."""


def _available(kind: str, resolution: str) -> str:
    """The resolution at which a kind is available: lakes have no finer one than 1 : 50 million."""
    return "50m" if kind == "shores" and resolution == _FINEST else resolution


@functools.cache
def _all_lines(kind: str, resolution: str) -> NDArray[np.object_]:
    """All lines of a kind, "coast", "shores" or "borders"."""
    if kind == "borders":
        return np.array([shapely.linestrings(line) for _, line in borders(resolution)])
    return np.array([shapely.linestrings(line) for line in _AREAS[kind][2](resolution)])
