"""The land as polygons on the map, each cell of the surface with the land in it; and the coast as lines."""

from __future__ import annotations

import functools

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import coastlines, land
from projdist.surfaces.domain import Bounds, longitude_width, normalised
from projdist.surfaces.surface import Surface

_TILE = 10.0  # degrees
_POLAR = 86.0  # beyond, cells are land or sea as a whole; no coast is there


def land_polygons(surface: Surface, resolution: str) -> tuple[IntArray, list[FloatArray]]:
    """The land of a surface: triangles of vertices, (m, 3), and polygons of (x, y) along the coast."""
    lon, lat = surface.lonlat()
    xy = np.column_stack([surface.x, surface.y])
    is_land = _on_land(normalised(lon), lat, resolution)
    sizes = sorted({len(cell) for cell in surface.cut})
    cut = [(np.array([cell for cell in surface.cut if len(cell) == size]), True) for size in sizes]
    triangles, polygons = [np.empty((0, 3), dtype=int)], []
    for cells, torn in [(surface.whole, False), *cut]:
        if len(cells):
            inland, coastal = _in_cells(surface, cells, lon, lat, xy, is_land, resolution, torn=torn)
            triangles += [inland[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)]
            polygons += coastal
    return np.concatenate(triangles), polygons


def _on_land(lon: FloatArray, lat: FloatArray, resolution: str) -> BoolArray:
    area = land(resolution)
    shapely.prepare(area)
    return np.asarray(shapely.contains_xy(area, lon, lat))


@functools.cache
def _coast_tree(resolution: str) -> shapely.STRtree:
    """All segments of the coast, also one turn farther east and west."""
    segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in coastlines(resolution)])
    turned = np.concatenate([segments + np.array([turn, 0.0]) for turn in (-360.0, 0.0, 360.0)])
    return shapely.STRtree(shapely.linestrings(turned[np.abs(turned[..., 0]).min(axis=1) < 200.0]))


@functools.cache
def _land_tree(resolution: str) -> shapely.STRtree:
    """The land in tiles, which makes intersections with small cells cheap; also beyond 180 degrees."""
    tiles = []
    for west in np.arange(-180.0, 180.0, _TILE):
        strip = shapely.clip_by_rect(land(resolution), west, -90.0, west + _TILE, 90.0)
        tiles += [
            shapely.clip_by_rect(strip, west, south, west + _TILE, south + _TILE)
            for south in np.arange(-90.0, 90.0, _TILE)
        ]
    kept = [tile for tile in tiles if not tile.is_empty]
    turned = [
        shapely.transform(tile, lambda xy, turn=turn: xy + np.array([turn, 0.0]))
        for turn in (-360.0, 360.0)
        for tile in kept
        if abs(tile.centroid.x + turn) < 200.0
    ]
    return shapely.STRtree(kept + turned)


def _in_cells(
    surface: Surface,
    cells: IntArray,
    lon: FloatArray,
    lat: FloatArray,
    xy: FloatArray,
    is_land: BoolArray,
    resolution: str,
    *,
    torn: bool,
) -> tuple[IntArray, list[FloatArray]]:
    """The land in cells of the same number of corners, (m, n): the cells that are all land, and pieces of others."""
    lons, lats = lon[cells], lat[cells]
    first = normalised(lons[:, :1])
    lons = first + (np.mod(lons - lons[:, :1] + 180.0, 360.0) - 180.0)
    corners = np.stack([lons, lats], axis=-1)
    shapes = shapely.polygons(corners)
    polar = np.abs(lats).max(axis=1) > _POLAR
    coastal = np.zeros(len(cells), dtype=bool)
    coastal[np.unique(_coast_tree(resolution).query(shapes, predicate="intersects")[0])] = True
    coastal &= ~polar
    whole = is_land[cells].all(axis=1) & ~coastal
    polygons = []
    index = np.flatnonzero(coastal)
    tree = _land_tree(resolution)
    cell, tile = tree.query(shapes[index], predicate="intersects")
    cell = index[cell]
    valid = shapely.make_valid(shapes) if torn else shapes
    pieces = shapely.intersection(valid[cell], tree.geometries[tile])
    parts, owner = shapely.get_parts(pieces, return_index=True)
    parts, owner = shapely.get_parts(parts, return_index=True)[0], cell[owner]
    keep = shapely.area(parts) > 0
    rings, owner = shapely.get_exterior_ring(parts[keep]), owner[keep]
    points, ring = shapely.get_coordinates(rings, return_index=True)
    if not torn:
        image = np.column_stack(surface.domain(normalised(points[:, 0]), points[:, 1]))
    for number, part in enumerate(np.split(np.arange(len(points)), np.flatnonzero(np.diff(ring)) + 1)):
        if not part.size:
            continue
        k = owner[number]
        if torn or not np.isfinite(image[part]).all():
            # On a seam a point has two images. The linear map of the cell's corners takes the right side.
            polygons.append(_linear_image(corners[k], xy[cells[k]], points[part]))
        else:
            polygons.append(image[part])
    return cells[whole], polygons


def _linear_image(corners: FloatArray, images: FloatArray, points: FloatArray) -> FloatArray:
    """Points mapped by the least-squares affine map from corners to their images."""
    ones = np.ones((len(corners), 1))
    matrix = np.linalg.lstsq(np.hstack([corners - corners[0], ones]), images, rcond=None)[0]
    return np.asarray(np.hstack([points - corners[0], np.ones((len(points), 1))]) @ matrix)


_MARGIN = (
    0.02  # of the region's width and height: lines run on past its edge, where the projecting of them finds their ends
)


def coast(bounds: Bounds, resolution: str, step: float) -> list[FloatArray]:
    """The coastlines within bounds and a little farther: lines of (lon, lat) with steps of at most `step` degrees."""
    west, south, _, north = bounds
    width = longitude_width(bounds)
    beside, above = _MARGIN * width, _MARGIN * (north - south)
    lines = _coast_lines(resolution)
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
