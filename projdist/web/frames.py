"""Lines and areas of a map in grid steps: coasts, borders, graticule, outline, land and the region."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.lib.stride_tricks import sliding_window_view

from projdist import answers, earth, field, matrices, projections, surfaces
from projdist._typing import BoolArray, FloatArray, NDArray
from projdist.surfaces import Surface

_STEPS = 65535
_SEEN = 16.0  # steps: a quarter of a pixel in a picture of 1000
_MARK_CELLS = 2000.0  # across the region; details of marks that are finer than one are dropped
_MARK_STEPS = 60.0  # most cells between two points of a mark: longer steps are taken for cuts
_LINES, _POLYGON, _MULTI = (1, 2), 3, 4  # shapely's numbers of types, the last and higher ones of several parts
_FARTHER = 2**32  # steps, more than any coordinate
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


@earth.GEOS_ARITHMETIC
def mark_lines(surface: Surface, grid: Grid, marks: Mapping[str, Any]) -> tuple[PackedLines, list[list[Any]]]:
    """Outlines on the map of geometries in longitude and latitude, and their names with places in steps."""
    drawn, size, window = _drawn(surface, grid)
    spacing = max(surfaces.ground_size(drawn.domain.box.bounds)) / _MARK_CELLS
    names, lines = [], []
    for name, geometry in marks.items():
        geometry = shapely.segmentize(shapely.simplify(geometry, spacing), _MARK_STEPS * spacing)
        parts = [shapely.get_coordinates(part) for part in _outlines_of(geometry)]
        images = surfaces.project_lines(drawn.domain, parts, size)
        if images:
            longest = max(images, key=lambda line: shapely.length(shapely.linestrings(line)))
            middle = grid.steps(0.5 * (longest.min(axis=0) + longest.max(axis=0)))
            names.append([name, *middle.tolist()])
            lines += images
    return _packed(_simplified(lines, grid, window)), names


def _drawn(surface: Surface, grid: Grid) -> tuple[Surface, float, shapely.Polygon]:
    """The surface that is drawn, the larger side of the picture in metres, and the picture's box in steps."""
    west, east, south, north = surface.view
    window = shapely.box(*grid.exact(np.array([[west, south], [east, north]])).ravel())
    return surface.ground or surface, max(east - west, north - south), window


def _outlines_of(geometry: Any) -> Iterator[Any]:
    """The rings and lines of a geometry."""
    for part in np.atleast_1d(shapely.get_parts(geometry)):
        if shapely.get_type_id(part) >= _MULTI:
            yield from _outlines_of(part)
        elif shapely.get_type_id(part) == _POLYGON:
            yield from shapely.get_rings(part)
        elif shapely.get_type_id(part) in _LINES:
            yield part


@earth.GEOS_ARITHMETIC
def map_lines(surface: Surface, grid: Grid) -> dict[str, PackedLines]:
    """Lines and areas by name, as concatenated points and the number of points of each."""
    drawn, size, window = _drawn(surface, grid)
    bounds, ground = drawn.domain.box.bounds, surface.ground
    region = surface.domain.region.bounds if surface.is_local else bounds
    meridians = surfaces.graticule(bounds, *surfaces.graticule_steps(region))
    found = {
        "graticule": surfaces.project_lines(drawn.domain, meridians, size),
        "outline": [*drawn.outline],
        "border": [*surface.border],
    }
    areas: dict[str, list[FloatArray]] = {"region": [*surface.pieces], "land": []}
    if not surface.domain.projection.is_of_another_body:
        resolution = surfaces.coast_resolution(surface)
        found["coast"] = surfaces.project_lines(drawn.domain, surfaces.coast(bounds, resolution), size)
        if surface.is_local:
            borders = surfaces.country_borders(bounds, resolution)
            found["borders"] = surfaces.project_lines(drawn.domain, borders, size)
        if ground is not None:
            places = np.column_stack([ground.x, ground.y])
            areas["sea"] = [*places[ground.covering()]]  # up to the map's edge
            rings = surfaces.land_rings(ground, resolution, size)  # for even-odd filling
            if rings is None:  # many adjacent polygons
                triangles, pieces = surfaces.land_polygons(ground, resolution)
                rings = [*places[triangles], *pieces]
            areas["land"] = rings
    return {
        **{name: _packed(_simplified(lines, grid, window)) for name, lines in found.items()},
        **{name: _packed(_united(polygons, grid, window)) for name, polygons in areas.items()},
    }


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
    """Rings of edges, in whole steps, that belong to one polygon only: shared edges cancel."""
    # It takes a twentieth of the time of a union, with the same even-odd filling.
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


# ---- frames --------------------------------------------------------------------------------------

_SAFETY = 2.0  # factor on errors, which are measured at three points of a cell
_FLOOR = 2e-7  # rounding error of float32
_TENTHS = 10.0  # errors are stored as tenths of their decimal exponent
_NONE = 255  # in place of an error, where there is no cell
_ROUNDING = 1 / 64  # share of the error to which fields are rounded
_LEAST = 1e-300  # smallest scale
_FLAT = 1e-3  # 1 - |q / p| below which a map has no figures

Arrays = dict[str, NDArray[Any]]
Frame = tuple[dict[str, Any], Arrays]  # header and arrays


def packed(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """A header and arrays as one block."""
    places, blocks, offset = {}, [], 0
    for name, values in arrays.items():
        block = np.ascontiguousarray(values).tobytes()
        places[name] = [values.dtype.name, offset, list(values.shape)]
        blocks.append(block + b"\0" * (-len(block) % 8))
        offset += len(blocks[-1])
    # ASCII: one byte per character; the arrays begin at a multiple of eight.
    text = json.dumps({**header, "arrays": places}).encode("ascii")
    text += b" " * (-(len(text) + 4) % 8)
    return np.uint32(len(text)).tobytes() + text + b"".join(blocks)


def frame_of(
    surface: Surface, title: str, *, height: float = 0.0, marks: Mapping[str, Any] | None = None
) -> tuple[dict[str, Any], Arrays, FloatArray]:
    """The header and the arrays of a surface's frame at a height in metres, and the Jacobians at its nodes."""
    # `marks` are geometries to draw, in longitude and latitude, by name.
    J = surfaces.jacobians(surface)
    whole = np.zeros(surface.shape, dtype=bool)  # the cells right of and above nodes that are not torn
    whole.ravel()[surface.whole[:, 0]] = True
    fields, mirrored = _fields(surface, J)
    cubic = _cubic(surface, whole, np.isfinite(J[: surface.nodes, 0, 0]))
    grid = Grid.of(surface)
    x, y = grid.steps(np.column_stack([surface.x, surface.y])).T
    error = _errors(surface, fields, whole, cubic, mirrored)
    cut_error = _cut_errors(surface, fields, mirrored, grid)
    header = {
        "title": title,
        "shape": list(surface.shape),
        "wraps": _wraps(surface),
        "axes": None if surface.frame.axes is None else surface.frame.axes.ravel().tolist(),
        "mirrored": mirrored,
        "view": list(surface.view),
        "grid": [grid.west, grid.south, grid.step],
        "regional": surface.ground is not None,
        "radius": surface.domain.radius,
    }
    arrays: Arrays = {
        "u": surface.u[: surface.shape[1]],
        "v": surface.v[: surface.nodes : surface.shape[1]],
        "x": x,
        "y": y,
        "imageU": surface.u[surface.nodes :].astype(np.float32),
        "imageV": surface.v[surface.nodes :].astype(np.float32),
        "whole": np.packbits(whole),
        "cubic": np.packbits(cubic),
        "error": error,
        "cut": np.concatenate([np.empty(0, dtype=int), *surface.cut]).astype(np.uint32),
        "cutError": cut_error,
        "cutSizes": np.array([len(polygon) for polygon in surface.cut], dtype=np.uint8),
    }
    lines = map_lines(surface, grid)
    if marks:
        lines["marks"], header["names"] = mark_lines(surface, grid, marks)
    for name, (points, sizes) in lines.items():
        arrays |= {name: points, f"{name}Sizes": sizes}
    if height:
        _, lat = surface.frame.geographic(surface.u, surface.v)
        lat = np.clip(np.nan_to_num(lat), -90.0, 90.0)
        on_ground = answers.elevation_factor(lat, height, surface.domain.projection.ellipsoid)
        fields[:, 0] += np.log(on_ground)
        J = J * on_ground[:, None, None]
    # Rounded to a small part of the errors: meaningless digits would double a page.
    steps = 2.0 ** np.floor(np.log2(_ROUNDING * _least_errors(surface, fields, error, cut_error)))[:, None]
    arrays["fields"] = np.asarray(steps * np.rint(fields / steps)).T.astype(np.float32)
    return header, arrays, J[: surface.nodes]


def _least_errors(
    surface: Surface, fields: FloatArray, error: NDArray[np.uint8], cut_error: NDArray[np.uint8]
) -> FloatArray:
    """Smallest error (n,) of the four numbers in the cells and triangles that use each vertex."""
    lesser = np.clip(np.nan_to_num(_lesser(fields), nan=1.0), _FLAT, 1.0)  # errors of ratios are over it
    cells = np.where(error == _NONE, 1.0, 10.0 ** (-error.astype(float) / _TENTHS))
    cells *= _corners(lesser[: surface.nodes].reshape(surface.shape)).min(axis=0)
    # A cubic uses the nodes of all surrounding cells, also left of and below a node.
    wide = np.pad(np.pad(cells, ((2, 1), (0, 0)), constant_values=1.0), ((0, 0), (2, 1)), mode="wrap")
    found = np.ones(len(fields))
    found[: surface.nodes] = sliding_window_view(wide, (4, 4)).min(axis=(2, 3)).ravel()
    triangles = _triangles(surface)
    beside_cuts = 10.0 ** (-cut_error.astype(float) / _TENTHS) * lesser[triangles].min(axis=1)
    np.minimum.at(found, triangles, beside_cuts[:, None])
    return found


def _wraps(surface: Surface) -> bool:
    """True if the grid's last column adjoins its first."""
    u = surface.u[: surface.shape[1]]
    return bool(abs(u[-1] + (u[1] - u[0]) - u[0] - 360.0) < 1e-6)


def _fields(surface: Surface, J: FloatArray) -> tuple[FloatArray, bool]:
    """The four numbers at each vertex, missing ones filled from neighbours, and whether the map is mirrored."""
    nodes = [surfaces.filled(J[: surface.nodes, i, j].reshape(surface.shape)).ravel() for i in (0, 1) for j in (0, 1)]
    near = np.stack(nodes, axis=-1).reshape(-1, 2, 2)[surface.source]
    J = np.where(np.isfinite(J), J, near)
    mirrored = bool(np.nansum(matrices.orientation(J[: surface.nodes]) * surface.weights) < 0.0)
    return four_numbers(J, mirrored), mirrored


def four_numbers(J: FloatArray, mirrored: bool) -> FloatArray:
    """The numbers (..., 4) of Jacobians that pages interpolate: ln |p|, arg p, and q / p as real and imaginary part."""
    # p and q are the conformal and the anticonformal part of a Jacobian, as complex numbers.
    turn = -1.0 if mirrored else 1.0
    xx, xy, yx, yy = turn * J[..., 0, 0], turn * J[..., 0, 1], J[..., 1, 0], J[..., 1, 1]
    p, q = 0.5 * (xx + yy + 1j * (yx - xy)), 0.5 * (xx - yy + 1j * (yx + xy))
    size = np.maximum(np.abs(p), _LEAST)
    with np.errstate(invalid="ignore"):  # vertices that are not drawn have no Jacobian
        ratio = q / np.where(np.abs(p) > 0.0, p, np.nan)
    return np.stack([np.log(size), np.angle(p), ratio.real, ratio.imag], axis=-1)


def _cubic(surface: Surface, whole: BoolArray, valid: BoolArray) -> BoolArray:
    """True for cells surrounded by whole cells whose nodes all have a Jacobian."""
    good = whole & _corners(valid.reshape(surface.shape)).all(axis=0)
    padded = np.pad(np.pad(good, ((1, 1), (0, 0))), ((0, 0), (1, 1)), mode="wrap" if _wraps(surface) else "constant")
    return np.asarray(sliding_window_view(padded, (3, 3)).all(axis=(2, 3)))


def _corners(values: Any) -> Any:
    """Values (rows, columns) at the four corners of the cells to the right of and above nodes."""
    right, above = np.roll(values, -1, axis=1), np.roll(values, -1, axis=0)
    return np.stack([values, right, np.roll(right, -1, axis=0), above])


# ---- errors of interpolation ----------------------------------------------------------------

_STEP = 3e-5  # radians, of the differences by which errors are found
_DOUBTFUL = 0.1  # share of such an error that may be in doubt
_TRIED = ((0.5, 0.5), (0.15, 0.8), (0.85, 0.2))  # places in a cell where errors are measured
_UNSEEN = 512.0  # square steps, twice the area of a triangle: a sixteenth of a pixel in a picture of 1000
_TRIED_BESIDE_CUTS = np.array([[1, 1, 1], [2.5, 0.25, 0.25], [0.25, 2.5, 0.25], [0.25, 0.25, 2.5]]) / 3.0


def _errors(surface: Surface, fields: FloatArray, whole: BoolArray, cubic: BoolArray, mirrored: bool) -> Any:
    """Errors of ln of scales and of ratios as bytes, -10 log10 of the error; 255 without a cell."""
    rows, columns = np.nonzero(whole)
    worst = np.zeros(rows.size)
    least = np.fmin.reduce(_corners(_lesser(fields[: surface.nodes]).reshape(surface.shape)), axis=0)[rows, columns]
    values = fields[: surface.nodes].astype(np.float32).astype(float)
    west, south = surface.u[: surface.shape[1]], surface.v[: surface.nodes : surface.shape[1]]
    widths, heights = np.append(west[1:], west[0] + 360.0) - west, np.diff(south)
    for across, up in _TRIED:
        u, v = west[columns] + across * widths[columns], south[rows] + up * heights[rows]
        found = interpolated(surface, values, rows, columns, u, v, cubic[rows, columns])
        worst = np.maximum(worst, _off(surface, u, v, found, least, mirrored))
    errors = np.full(surface.shape, _NONE, dtype=np.uint8)
    errors[rows, columns] = _as_bytes(worst)
    return errors


def _cut_errors(surface: Surface, fields: FloatArray, mirrored: bool, grid: Grid) -> Any:
    """Errors in the triangles of torn cells, as bytes like those of cells; error 1 for invisible triangles."""
    # These are slivers beside seams, which would take more time than all others.
    every = _triangles(surface)
    sides = np.diff(grid.exact(np.column_stack([surface.x, surface.y]))[every], axis=1)
    seen = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]) > _UNSEEN
    triangles, errors = every[seen], np.ones(len(every))
    least = np.fmin.reduce(_lesser(fields)[triangles], axis=1)
    worst = np.zeros(len(triangles))
    values = fields.astype(np.float32).astype(float)[triangles]
    values[..., 1] = _beside(values[..., 1], 2.0 * np.pi)
    us, vs = _beside(surface.u[triangles], 360.0), surface.v[triangles]
    for shares in _TRIED_BESIDE_CUTS:
        found = np.einsum("j,njk->nk", shares, values)
        worst = np.maximum(worst, _off(surface, us @ shares, vs @ shares, found, least, mirrored))
    errors[seen] = worst
    return _as_bytes(errors)


def _triangles(surface: Surface) -> NDArray[Any]:
    """The corners (n, 3) of the triangles of torn cells, as a page makes them."""
    corners = [polygon[[0, k, k + 1]] for polygon in surface.cut for k in range(1, len(polygon) - 1)]
    return np.array(corners, dtype=int).reshape(-1, 3)


def _beside(values: FloatArray, turn: float) -> FloatArray:
    """Angles (n, 3) shifted by whole turns to lie nearest to the first."""
    return values - turn * np.round((values - values[:, :1]) / turn)


def _lesser(fields: FloatArray) -> FloatArray:
    """1 - |q / p|, by which errors of ratios are divided: the smaller scale is proportional to it."""
    return 1.0 - np.hypot(*fields[:, 2:].T)


def _off(
    surface: Surface, u: FloatArray, v: FloatArray, found: FloatArray, least: FloatArray, mirrored: bool
) -> FloatArray:
    """Errors of the four numbers (n, 4) at grid coordinates; 1 where undefined."""
    projection, (lon, lat) = surface.domain.projection, surface.frame.geographic(u, v)
    lon = earth.wrapped(lon)
    J, doubt = _near_jacobians(projection, lon, lat)
    off = _apart(found, four_numbers(J, mirrored), least)
    unsure = ~(doubt <= _DOUBTFUL * np.clip(least, _FLAT, 1.0) * (off + _FLOOR))
    J = field.jacobian(projection, lon[unsure], lat[unsure])
    off[unsure] = _apart(found[unsure], four_numbers(J, mirrored), least[unsure])
    return np.where(np.isfinite(off), off, 1.0)


def _apart(found: FloatArray, true: FloatArray, least: FloatArray) -> FloatArray:
    """Distance of four numbers (n, 4) from the true ones."""
    turn = np.abs(np.mod(found[:, 1] - true[:, 1] + np.pi, 2.0 * np.pi) - np.pi)
    ratio = np.hypot(*(found[:, 2:] - true[:, 2:]).T) / np.maximum(np.fmin(least, _lesser(true)), _FLAT)
    return np.asarray(np.abs(found[:, 0] - true[:, 0]) + ratio + turn)


def _near_jacobians(
    projection: projections.Projection, lon: FloatArray, lat: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Jacobians (n, 2, 2) by central differences, and their relative errors."""
    # If the second difference is k times the first, the third, which is the error, is about k^2 times it.
    cos, north, zero = np.cos(np.radians(lat)), np.degrees(_STEP), np.zeros(lat.shape)
    lons = earth.wrapped(lon + np.stack([zero, north / cos, -north / cos, zero, zero]))
    xy = np.stack(projection(lons, lat + np.stack([zero, zero, zero, zero + north, zero - north])))
    ahead, behind = xy[:, 1::2] - xy[:, :1], xy[:, :1] - xy[:, 2::2]  # (2, 2, n), of x and y to the east and the north
    meridian, vertical = projection.ellipsoid.radii(lat)
    J = np.moveaxis((ahead + behind) / (2.0 * _STEP * np.stack([vertical, meridian])), 2, 0)
    bend, size = (np.abs(change).sum(axis=(0, 1)) for change in (ahead - behind, ahead + behind))
    with np.errstate(invalid="ignore", divide="ignore"):  # a map may be constant, or not there
        return J, (2.0 * bend / size) ** 2


def _as_bytes(errors: FloatArray) -> NDArray[np.uint8]:
    exponents = np.floor(-_TENTHS * np.log10(_SAFETY * errors + _FLOOR))
    return np.clip(exponents, 0.0, _NONE - 1.0).astype(np.uint8)


def interpolated(
    surface: Surface, fields: FloatArray, rows: Any, columns: Any, u: FloatArray, v: FloatArray, cubic: BoolArray
) -> FloatArray:
    """The four numbers (n, 4) interpolated at grid coordinates, as in a page."""
    count, width = surface.shape
    table = fields.reshape(count, width, 4)
    across, up = surface.u[:width], surface.v[: surface.nodes : width]
    steps = np.arange(-1, 3)
    i, j = columns[:, None] + steps, np.clip(rows[:, None] + steps, 0, count - 1)
    weights_u = _weights(across[i % width] + 360.0 * (i // width), u, cubic)
    weights_v = _weights(up[j], v, cubic)
    values = table[j[:, :, None], (i % width)[:, None, :]]
    turns = values[..., 1] - values[:, 1:2, 1:2, 1]
    values[..., 1] -= 2.0 * np.pi * np.round(turns / (2.0 * np.pi))
    return np.asarray(np.einsum("nj,ni,njik->nk", weights_v, weights_u, values))


def _weights(nodes: FloatArray, place: FloatArray, cubic: BoolArray) -> FloatArray:
    """Lagrange weights (n, 4) of four nodes, or linear ones of the middle two."""
    weights = np.zeros(nodes.shape)
    share = (place - nodes[:, 1]) / (nodes[:, 2] - nodes[:, 1])
    weights[:, 1], weights[:, 2] = 1.0 - share, share
    for k in range(4):
        others = [other for other in range(4) if other != k]
        with np.errstate(divide="ignore", invalid="ignore"):  # beyond an edge there are no outer nodes
            factors = [(place - nodes[:, m]) / (nodes[:, k] - nodes[:, m]) for m in others]
        weights[:, k] = np.where(cubic, factors[0] * factors[1] * factors[2], weights[:, k])
    return weights
