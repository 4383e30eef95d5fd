"""Previews of maps while they are dragged: a sketch of the region, and coarse frames cut at the edge of the map."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from projdist import earth, matrices, projections, regions, surfaces
from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.web import frames

_COLUMNS, _ROWS = 145, 73
_EDGE = 1e-5  # degrees between a cut or a pole and the nodes beside it
_WORLD, _SMALL = 100.0, 3.0  # degrees, above and below which a region has coarse and fine lines
_SEEN = 1e-3  # finest detail of lines, as a share of a region's size
_ALONG = 60.0  # steps of lines along a region's size
_BESIDE = 0.3  # margin around a region, as a share of its size


@dataclass(frozen=True)
class Lines:
    """Concatenated points of lines, the line of each, and the slice of each name."""

    lon: FloatArray
    lat: FloatArray
    line: IntArray
    where: Mapping[str, slice]


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """A grid of longitudes `u` and latitudes `v`, the area weights of its nodes, and lines."""

    regional: bool  # surroundings are drawn, too
    whole: bool  # the grid is global
    partial: bool  # far parts of the region are missing
    u: FloatArray
    v: FloatArray
    weights: FloatArray
    lines: Lines


@functools.lru_cache(maxsize=32)
@earth.GEOS_ARITHMETIC
def sketch_of(region: str | regions.Place) -> Sketch:
    """The sketch of a region or its text; raises ValueError."""
    region = regions.get_region(region)
    place = surfaces.shown_part(region)
    whole = not place.area_km2 or (place.bounds == regions.GLOBE.bounds and not surfaces.is_part(place))
    if whole:
        u, v = np.linspace(_EDGE - 180.0, 180.0 - _EDGE, _COLUMNS), np.linspace(_EDGE - 90.0, 90.0 - _EDGE, _ROWS)
    else:
        u, v = _grid(place.bounds)
    lon, lat = np.meshgrid(u, v)
    weights = np.cos(np.radians(lat))
    if not whole:
        inside = place.contains(earth.wrapped(lon), lat)
        weights = np.where(inside, weights, 0.0) if inside.any() else weights  # it may be smaller than a cell
    regional = not whole and surfaces.is_part(place)
    if regional:
        lines = _lines_about(place)
    else:
        world = regions.GLOBE.bounds
        lines = {"graticule": surfaces.graticule(world, 30.0, 30.0), "coast": surfaces.coast(world, "110m", 2.0)}
    partial = not whole and place is not region
    return Sketch(regional=regional, whole=whole, partial=partial, u=u, v=v, weights=weights, lines=_packed(lines))


def _grid(bounds: surfaces.Bounds) -> tuple[FloatArray, FloatArray]:
    """Grid with as many nodes as that of the globe, its cells nearly square where the region is widest."""
    west, south, _, north = bounds
    width = surfaces.longitude_width(bounds)
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    columns = int(np.clip(np.sqrt(_COLUMNS * _ROWS * width * longest / (north - south)), 24, 400))
    lat = np.linspace(south, north, _COLUMNS * _ROWS // columns)
    return west + np.linspace(0.0, width, columns), np.clip(lat, _EDGE - 90.0, 90.0 - _EDGE)


def _lines_about(region: regions.Place) -> dict[str, list[FloatArray]]:
    """Lines of a region and its surroundings."""
    bounds = _wider(region.bounds)
    size = max(surfaces.ground_size(region.bounds))
    detail = "110m" if size > _WORLD else "10m" if size < _SMALL else "50m"
    seen = _SEEN * size

    def in_steps(lines: Any) -> list[FloatArray]:
        return [shapely.get_coordinates(line) for line in shapely.segmentize(lines, size / _ALONG)]

    def simplified(lines: Sequence[FloatArray]) -> list[FloatArray]:
        return in_steps(shapely.simplify([shapely.linestrings(line) for line in lines if len(line) > 1], seen))

    def rings_of(geometry: shapely.Geometry) -> list[FloatArray]:
        return in_steps(shapely.get_rings(shapely.get_parts(shapely.simplify(geometry, seen))))

    border = rings_of(regions.polygons_of(region))
    return {
        "graticule": surfaces.graticule(bounds, *surfaces.graticule_steps(region.bounds)),
        "coast": simplified(surfaces.coast(bounds, detail, np.inf)),
        "borders": simplified(surfaces.country_borders(bounds, detail, np.inf)),
        "border": border,
        "region": border,
        "land": rings_of(earth.polygons_within("land", bounds, detail)),
    }


def _wider(bounds: surfaces.Bounds) -> surfaces.Bounds:
    """Bounds with a margin."""
    west, south, _, north = bounds
    width = surfaces.longitude_width(bounds)
    reach = _BESIDE * max(surfaces.ground_size(bounds))
    south, north = max(south - reach, -90.0), min(north + reach, 90.0)
    beside = reach / max(np.cos(np.radians(max(-south, north))), 0.05)
    if width + 2.0 * beside >= 360.0:
        return -180.0, south, 180.0, north
    return west - beside, south, west + width + beside, north


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


# ---- cells at the map's edge ---------------------------------------------------------------------


@dataclass(frozen=True)
class CutCells:
    """Cells cut at the map's edge, as polygons (n, k) of vertices: grid nodes, then points on edges."""

    ends: IntArray  # (m, 2), the nodes of each such edge, the visible one first
    share: FloatArray  # (m,), of the way to the other, at which the point lies
    polygons: Sequence[IntArray]
    sides: IntArray  # (l, 2), polygon sides along the map's edge, as indices of points


def cut_cells(level: FloatArray, cells: BoolArray) -> CutCells:
    """The part of `cells` (n - 1, m - 1), all crossed by level 0, where a level, linear between nodes, is at most 0."""
    flat, nodes = level.ravel(), level.size
    row, column = np.nonzero(cells)
    low = row * level.shape[1] + column
    corners = np.column_stack([low, low + 1, low + level.shape[1] + 1, low + level.shape[1]])
    kind = (flat[corners] <= 0.0) @ (1 << np.arange(4))
    mixed = (kind > 0) & (kind < 15)
    corners, kind = corners[mixed], kind[mixed]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1), axis=-1)
    found, number = np.unique(edges[..., 0] * nodes + edges[..., 1], return_inverse=True)
    ends = np.column_stack(np.divmod(found, nodes))
    crossed = (flat[ends] <= 0.0).sum(axis=1) == 1
    points = nodes + np.cumsum(crossed)[number.reshape(edges.shape[:2])] - 1
    vertices = np.concatenate([corners, points], axis=1)
    around = {one: _around(one) for one in np.unique(kind).tolist()}
    polygons = [vertices[kind == one][:, path] for one, path in around.items()]
    along = [
        vertices[kind == one][:, [path[k - 1], path[k]]] - nodes
        for one, path in around.items()
        for k in range(len(path))
        if min(path[k - 1], path[k]) >= 4
    ]
    ends = np.take_along_axis(ends[crossed], np.argsort(flat[ends[crossed]], axis=1), axis=1)
    first, second = flat[ends].T
    return CutCells(ends, first / (first - second), polygons, np.concatenate([np.empty((0, 2), int), *along]))


def _around(kind: int) -> list[int]:
    """Path around the visible part of a cell, through corners 0 to 3 and points on the edges after them, 4 to 7."""
    path = []
    for corner in range(4):
        here, after = kind >> corner & 1, kind >> (corner + 1) % 4 & 1
        path += [corner] * here + [corner + 4] * (here != after)
    return path


# ---- previews ------------------------------------------------------------------------------------

_DIGITS = re.compile(r"[-+]?\d[\d.eE+-]*")
_MARGIN = 0.01  # of a map's larger side
_ERROR = 15  # in tenths of a decimal exponent: three per cent
_AREAS = frozenset({"region", "land"})
_EARTHLY = frozenset({"coast", "borders", "land"})
_JUMP, _PEAK = 6.0, 2.0  # times as long as a neighbour, or as both, an edge of a cell is torn
_LONGEST = 0.08  # of a map's size: longer steps of lines are torn
_NEAR = 1e-2  # of that: sides of a cut as near as this are one line
_LARGE, _CORE, _FAR = 12.0, 0.9, 1.35  # the same as in surfaces, for maps that run off to infinity
_DIRECTIONS = 72
_HALVINGS = 6
_LOWEST = -50.0  # of a level, in place of the logarithm of 0
_MOST_HIDDEN = 0.1  # share of a region off the map or near infinity, above which figures are left out
_KINDS = 500  # kinds of maps whose rotations are kept


@dataclass
class Previewer:
    """Makes previews; keeps sketches, and the rotation of the grid that suits each kind of map."""

    turns: dict[str, str] = field(default_factory=dict)

    def frame(
        self, projection: projections.Projection, region: str | regions.Place, centre: tuple[float, float] | None
    ) -> frames.Frame:
        """Header and arrays of a preview; raises ValueError if no part of the region is on the map."""
        sketch = sketch_of(region)
        lon, lat = centre or (0.0, 0.0)
        if not sketch.whole:
            return _Picture(projection, sketch, None, 0.0).frame()
        kind = _DIGITS.sub("", projection.definition)
        turns = [self.turns[kind]] if kind in self.turns else _TURNS
        pictures = {turn: _Picture(projection, sketch, _axes(turn, lon, lat), lon) for turn in turns}
        if len(self.turns) == _KINDS:
            self.turns.clear()
        self.turns[kind] = min(pictures, key=lambda turn: pictures[turn].badness)
        return pictures[self.turns[kind]].frame()


_TURNS = ("north", "centre", "pole")  # in order of preference


def _axes(turn: str, lon: float, lat: float) -> FloatArray | None:
    """Rotation of the grid: none, centre at longitude and latitude 0, or centre as pole."""
    if turn == "north":
        return None
    ahead = earth.unit_vectors(lon, lat)
    east = np.array([-np.sin(np.radians(lon)), np.cos(np.radians(lon)), 0.0])
    north = np.cross(ahead, east)
    return np.column_stack([ahead, east, north] if turn == "centre" else [-north, east, ahead])


class _Picture:
    """One preview: projected grid and lines, and the derivatives by differences."""

    def __init__(
        self, projection: projections.Projection, sketch: Sketch, axes: FloatArray | None, middle: float
    ) -> None:
        self.projection, self.sketch, self.axes = projection, sketch, axes
        self.u = sketch.u + middle if sketch.whole and axes is None else sketch.u
        self.shape = sketch.v.size, self.u.size
        u, v = np.meshgrid(self.u, sketch.v)
        lon, lat, self.turned = _geographic(axes, u, v)
        lines = sketch.lines
        lons, lats = np.concatenate([lon.ravel(), lines.lon]), np.concatenate([lat.ravel(), lines.lat])
        x, y = projection(earth.wrapped(lons), lats)
        nodes = lon.size
        self.x, self.y = x[:nodes].reshape(self.shape), y[:nodes].reshape(self.shape)
        self.line_x, self.line_y = x[nodes:], y[nodes:]
        self.v, self.lat = v, lat  # of the grid, and of the Earth
        self._differ()
        self.four, self.mirrored, self.level = self._fields()
        self.shown = self.level <= 0.0

    @property
    def badness(self) -> float:
        """Penalty of a rotation: the distortion, which seams through cells falsify, plus the share of torn cells."""
        return self._about()["airy_kavrayskiy"] + 1.0 - float(self.whole.mean())

    def _differ(self) -> None:
        """Compute derivatives along the grid's axes on the unit sphere, and the untorn cells."""
        z = self.x + 1j * self.y
        steps_u, steps_v = np.radians(np.diff(self.u)), np.radians(np.diff(self.sketch.v))
        across, up = np.diff(z, axis=1), np.diff(z, axis=0)
        whole_u, whole_v = _untorn(np.abs(across)), _untorn(np.abs(up).T).T
        self.along_u = _at_nodes(across / steps_u, whole_u) / np.cos(np.radians(self.v))
        self.along_v = _at_nodes((up / steps_v[:, None]).T, whole_v.T).T
        self.whole = whole_u[:-1] & whole_u[1:] & whole_v[:, :-1] & whole_v[:, 1:]
        # Cells across the map's end are not torn.
        whole_u, whole_v = whole_u | np.isnan(across), whole_v | np.isnan(up)
        self.joined = whole_u[:-1] & whole_u[1:] & whole_v[:, :-1] & whole_v[:, 1:]

    def frame(self) -> frames.Frame:
        """Header and arrays."""
        shown = self.shown
        edge = self._edge()
        view = self._view(edge)
        grid = frames.Grid.about(view)
        lines = self._lines(grid, view, edge)
        whole = np.zeros(self.shape, dtype=bool)
        whole[:-1, :-1] = self.whole & shown[:-1, :-1] & shown[1:, :-1] & shown[:-1, 1:] & shown[1:, 1:]
        weights = self.sketch.weights
        hidden = 1.0 - weights[shown].sum() / weights.sum()  # off the map, or near infinity
        header = {
            "title": self.projection.label,
            "shape": list(self.shape),
            "wraps": False,
            "axes": None if self.axes is None else self.axes.ravel().tolist(),
            "mirrored": self.mirrored,
            "view": view,
            "grid": [grid.west, grid.south, grid.step],
            "regional": self.sketch.regional,
            "radius": self.projection.ellipsoid.a,
            "preview": True,
            "about": None if self.sketch.partial or hidden > _MOST_HIDDEN else self._about(),
        }
        x, y = grid.steps(np.column_stack([np.append(self.x, edge.x), np.append(self.y, edge.y)])).T
        arrays: frames.Arrays = {
            "u": self.u,
            "v": self.sketch.v,
            "fields": np.concatenate([self.four, edge.four]).T.astype(np.float32),
            "x": x,
            "y": y,
            "imageU": edge.u.astype(np.float32),
            "imageV": edge.v.astype(np.float32),
            "whole": np.packbits(whole),
            "cubic": np.zeros((whole.size + 7) // 8, dtype=np.uint8),
            "error": np.full(self.shape, _ERROR, dtype=np.uint8),
            **_packed_polygons(edge.cells),
        }
        return header, arrays | lines

    def _edge(self) -> _Edge:
        """Cells cut at the map's edge; whole cells would leave a jagged edge."""
        cells = cut_cells(np.where(np.isnan(self.level), 1.0, self.level), self.joined)
        near, far = cells.ends.T
        u, v = self._between(near, far, self._reached(cells))
        x, y = self._projected(u, v)
        steps = np.where(np.isnan(self.level.ravel()[far])[:, None], 0.0, self.four[far] - self.four[near])
        steps[:, 1] -= 2.0 * np.pi * np.round(steps[:, 1] / (2.0 * np.pi))
        return _Edge(cells, u, v, x, y, self.four[near] + cells.share[:, None] * steps)

    def _reached(self, cells: CutCells) -> FloatArray:
        """Fraction of the way from visible nodes at which the edge lies, by bisection where the map ends."""
        near, far = cells.ends.T
        lost = np.isnan(self.x.ravel()[far])
        low, high = np.zeros(lost.sum()), np.ones(lost.sum())
        for _ in range(_HALVINGS if lost.any() else 0):
            middle = 0.5 * (low + high)
            u, v = self._between(near[lost], far[lost], middle)
            there = np.isfinite(self._projected(u, v)[0])
            low, high = np.where(there, middle, low), np.where(there, high, middle)
        share = cells.share.copy()
        share[lost] = low
        return share

    def _projected(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places on the map of grid coordinates."""
        lon, lat, _ = _geographic(self.axes, u, v)
        return self.projection(earth.wrapped(lon), lat)

    def _between(self, near: IntArray, far: IntArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Grid coordinates at fractions of the way between nodes."""
        u, v = np.broadcast_to(self.u, self.shape).ravel(), self.v.ravel()
        return u[near] + share * (u[far] - u[near]), v[near] + share * (v[far] - v[near])

    def _fields(self) -> tuple[FloatArray, bool, FloatArray]:
        """The four numbers at the nodes, whether the map is mirrored, and a level, positive where it is hidden."""
        lon_part, lat_part = self.along_u, self.along_v
        if self.turned is not None:
            east, north = self.turned
            lon_part, lat_part = lon_part * east - lat_part * north, lon_part * north + lat_part * east
        meridian, prime = self.projection.ellipsoid.radii(self.lat)
        east_part, north_part = lon_part / prime, lat_part / meridian
        # p and q are half the sum and half the difference of the images of east and north.
        rows = [np.stack([part(east_part), part(north_part)], -1) for part in (np.real, np.imag)]
        J = np.stack(rows, -2)
        J[0], J[-1] = np.where(np.isfinite(J[0]), J[1], np.nan), np.where(np.isfinite(J[-1]), J[-2], np.nan)
        valid = np.isfinite(J[..., 0, 0] + J[..., 1, 1])
        if not self.sketch.regional:
            valid &= self.sketch.weights > 0.0
        mirrored = bool(np.nansum(matrices.orientation(J) * self.sketch.weights) < 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            four = frames.four_numbers(J.reshape(-1, 2, 2), mirrored)
        return four, mirrored, self._near(four, valid)

    def _near(self, four: FloatArray, valid: BoolArray) -> FloatArray:
        """A level, positive where the map runs off to infinity, NaN off the map."""
        p, ratio = np.exp(four[:, 0]), np.hypot(four[:, 2], four[:, 3])
        a = np.where(valid, (p * (1.0 + ratio)).reshape(self.shape), np.nan)
        b = (p * np.abs(1.0 - ratio)).reshape(self.shape)
        wanted = valid & (self.sketch.weights > 0.0)
        if not wanted.any():
            raise self._shows_nothing()
        limit = _LARGE * float(np.partition(a[wanted], wanted.sum() // 20)[wanted.sum() // 20])
        small = wanted & (a <= limit)
        away = _away(self.x + 1j * self.y, small)
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = np.log(b / (2.0 * float(np.median(b[small]))))
            far = np.maximum(flat, np.log(away / _FAR))
            level = np.minimum(np.minimum(np.log(a / limit), np.log(away / _CORE)), far)
        return np.where(valid, np.maximum(level, _LOWEST), np.nan)

    def _view(self, edge: _Edge) -> list[float]:
        """View of the picture."""
        if self.sketch.regional:
            region = self.sketch.lines.where["region"]
            border = np.column_stack([self.line_x[region], self.line_y[region]])
            border = border[np.isfinite(border[:, 0])]
            if not len(border):
                raise self._shows_nothing()
            return list(surfaces.frame_of_part(surfaces.extent_of(border)))
        x, y = np.append(self.x[self.shown], edge.x), np.append(self.y[self.shown], edge.y)
        west, east, south, north = surfaces.extent_of(np.column_stack([x, y]))
        margin = _MARGIN * max(east - west, north - south)
        return [west - margin, east + margin, south - margin, north + margin]

    def _shows_nothing(self) -> ValueError:
        """Error for a region that the map does not show."""
        return ValueError(f"Invalid region for '{self.projection.name}'. No part of it can be projected.")

    def _lines(self, grid: frames.Grid, view: list[float], edge: _Edge) -> frames.Arrays:
        """All lines and areas in grid steps."""
        longest = _LONGEST * max(view[1] - view[0], view[3] - view[2])
        found: frames.Arrays = {}
        foreign = _EARTHLY if self.projection.is_of_another_body else frozenset()
        for name, part in self.sketch.lines.where.items():
            part = slice(0) if name in foreign else part
            x, y, line = self.line_x[part], self.line_y[part], self.sketch.lines.line[part]
            points, sizes = _pieces(grid, x, y, line, longest, closed=name in _AREAS)
            found |= {name: points, f"{name}Sizes": sizes}
        outline: list[Any] = []
        if not self.sketch.regional:  # the poles, the cut where its two sides lie apart, and the edge
            z = np.where(self.shown, self.x + 1j * self.y, np.nan)
            apart = np.abs(z[:, 0] - z[:, -1]) > _NEAR * longest
            cut = (np.where(apart, side, np.nan) for side in (z[:, 0], z[:, -1]))
            outline = [z[0], z[-1], *cut, *(edge.x + 1j * edge.y)[edge.cells.sides]]
        z = np.concatenate([np.empty(0, dtype=complex), *outline])
        line = np.repeat(np.arange(len(outline)), [part.size for part in outline])
        points, sizes = _pieces(grid, z.real, z.imag, line, longest, closed=False)
        return found | {"outline": points, "outlineSizes": sizes}

    def _about(self) -> dict[str, float]:
        """Approximate Airy-Kavrayskiy errors."""
        four, shown = self.four, self.shown
        ratio = np.minimum(np.hypot(four[:, 2], four[:, 3]), 1.0 - 1e-9)
        a, b = four[:, 0] + np.log1p(ratio), four[:, 0] + np.log1p(-ratio)
        weight = np.where(shown.ravel(), self.sketch.weights.ravel(), 0.0)
        weight = np.where(np.isfinite(a + b), weight, 0.0)
        square, area = np.nan_to_num(a * a + b * b), np.nan_to_num(a + b)
        total = weight.sum()
        raw, shift = float(square @ weight / total), float(area @ weight / total)
        return {"airy_kavrayskiy": raw**0.5, "airy_kavrayskiy_scaled": max(raw - 0.5 * shift**2, 0.0) ** 0.5}


def _away(z: Any, usual: BoolArray) -> FloatArray:
    """Distance from the centre of the usual places, relative to their reach in the same direction."""
    z = np.where(np.isfinite(z), z - z[usual].mean(), 0.0)
    turn, length = _DIRECTIONS * (np.angle(z) / (2.0 * np.pi) + 0.5), np.abs(z)
    reach = np.zeros(_DIRECTIONS)
    np.maximum.at(reach, turn[usual].astype(int) % _DIRECTIONS, length[usual])
    reach = np.maximum(reach, np.maximum(np.roll(reach, 1), np.roll(reach, -1)))
    seen = np.flatnonzero(reach)
    return np.asarray(length / np.interp(turn, seen + 0.5, reach[seen], period=_DIRECTIONS))


@dataclass(frozen=True)
class _Edge:
    """Cells at the edge of the map, with their points: grid and map coordinates, and the four numbers."""

    cells: CutCells
    u: FloatArray
    v: FloatArray
    x: FloatArray
    y: FloatArray
    four: FloatArray


def _packed_polygons(cells: CutCells) -> frames.Arrays:
    """Polygons and errors of their triangles, in the format of frames."""
    sizes = [len(polygon) for group in cells.polygons for polygon in group]
    vertices = np.concatenate([np.empty(0, dtype=int), *(group.ravel() for group in cells.polygons)])
    return {
        "cut": vertices.astype(np.uint32),
        "cutSizes": np.array(sizes, dtype=np.uint8),
        "cutError": np.full(sum(sizes) - 2 * len(sizes), _ERROR, dtype=np.uint8),
    }


def _geographic(
    axes: FloatArray | None, u: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray] | None]:
    """Longitude and latitude of grid coordinates, and cosine and sine of the angle of the grid's east there."""
    if axes is None:
        return u, v, None
    lam = np.radians(u)
    point = np.moveaxis(earth.unit_vectors(u, v), 0, -1) @ axes.T
    east = np.stack([-np.sin(lam), np.cos(lam), np.zeros(lam.shape)], axis=-1) @ axes.T
    level = np.maximum(np.hypot(point[..., 0], point[..., 1]), 1e-12)
    cos = (east[..., 1] * point[..., 0] - east[..., 0] * point[..., 1]) / level
    sin = east[..., 2] / level
    lon = np.degrees(np.arctan2(point[..., 1], point[..., 0]))
    lat = np.degrees(np.arctan2(point[..., 2], level))
    return lon, lat, (cos, sin)


def _untorn(length: FloatArray) -> BoolArray:
    """True for finite edges in rows (n, m), not many times as long as their neighbours."""
    # Towards infinity an edge is longer than one neighbour, across a gap longer than both.
    padded = np.pad(np.nan_to_num(length, nan=np.inf), ((0, 0), (1, 1)), constant_values=np.inf)
    before, after = padded[:, :-2], padded[:, 2:]
    longest = np.minimum(_JUMP * np.minimum(before, after), _PEAK * np.maximum(before, after))
    return np.asarray(np.isfinite(length) & ~(length > longest))


def _at_nodes(slopes: Any, whole: BoolArray) -> Any:
    """Slopes at nodes from those of whole edges in rows, extrapolated at ends."""
    rows, count = slopes.shape
    padded = np.full((rows, count + 4), np.nan, dtype=complex)
    padded[:, 2:-2] = np.where(whole, slopes, np.nan)
    left, right = padded[:, 1:-2], padded[:, 2:-1]
    more_left, more_right = padded[:, :-3], padded[:, 3:]
    one_right = np.where(np.isnan(more_right), right, 1.5 * right - 0.5 * more_right)
    one_left = np.where(np.isnan(more_left), left, 1.5 * left - 0.5 * more_left)
    both = 0.5 * (left + right)
    return np.where(np.isfinite(both), both, np.where(np.isnan(left), one_right, one_left))


def _pieces(
    grid: frames.Grid, x: FloatArray, y: FloatArray, line: Any, longest: float, closed: bool
) -> tuple[Any, Any]:
    """Lines as concatenated points and their numbers, split where torn."""
    good = np.isfinite(x)
    if not good.any():
        return np.empty((0, 2), dtype=np.uint16), np.empty(0, dtype=np.uint32)
    x, y, line = x[good], y[good], line[good]
    points = grid.steps(np.column_stack([x, y]))
    new = line[1:] != line[:-1]
    if not closed:
        new |= np.hypot(np.diff(x), np.diff(y)) > longest
    starts = np.flatnonzero(np.concatenate([[True], new]))
    return points, np.diff(np.append(starts, line.size)).astype(np.uint32)
