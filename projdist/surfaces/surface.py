"""The surface of a map: a grid of triangles that follows seams, turned to have a pole where the map is singular."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import GEOS_ARITHMETIC, wrapped
from projdist.field import Links, Map, drawn, evaluate, find_tears
from projdist.regions import GLOBE
from projdist.surfaces.domain import POLE, Domain, climb, ground_size, longitude_width, rough_scales


@dataclass(frozen=True)
class TurnedFrame:
    """A rotation of the grid."""

    axes: FloatArray | None = None  # (3, 3), the grid's axes in geographic coordinates as columns; None: not rotated

    def geographic(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude of grid coordinates, in degrees."""
        if self.axes is None:
            return u, v
        u, v = np.radians(u), np.radians(v)
        point = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1) @ self.axes.T
        x, y, z = np.moveaxis(point, -1, 0)
        return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y)))


_SINGULAR = 1e4  # of the median scale, 1e-3 degrees from the point, where one over the distance is 57,000


def frame_of(domain: Domain) -> TurnedFrame:
    """A frame with a pole at the map's singular point, unless that is a pole of the Earth."""
    if longitude_width(domain.box.bounds) < 180.0:
        return TurnedFrame()
    survey = domain.survey
    scale = np.where(domain.surveyed() & np.isfinite(survey.a), survey.a, np.nan)
    if not np.isfinite(scale).any():
        return TurnedFrame()
    usual = float(np.nanmedian(scale))
    best = int(np.nanargmax(scale))

    def largest_scale(lon: FloatArray, lat: FloatArray) -> FloatArray:
        return np.nan_to_num(rough_scales(domain.projection, lon, lat, *domain.projection(lon, lat))[0], nan=0.0)

    lon, lat, top = climb(largest_scale, float(survey.lon.flat[best]), float(survey.lat.flat[best]))
    if top < _SINGULAR * usual or abs(lat) > 89.5:
        return TurnedFrame()
    lon, lat = np.radians(lon), np.radians(lat)
    pole = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    return TurnedFrame(np.column_stack([np.cross(east, pole), east, pole]))


# ---- surface -------------------------------------------------------------------------------------

Extent = tuple[float, float, float, float]

_TURNED_POLE = 90.0 - 0.02  # beyond the error of the singular point's position, and still less than a pixel
_GLOBE_STEP = 0.6  # degrees
_REGION_NODES = 200  # across a smaller region
_LONGEST = 0.25  # of the map's size: a longer cell spans a seam that was missed
_HEMISPHERE = 180.0
_BLOCK = 8  # cells on a side
_INWARD = 0.01  # of the way from the image of a seam to its node: so far in, the side is certain
_OFFSET = 0.4937  # of a step: keeps nodes off the round longitudes and latitudes where seams are


@dataclass(frozen=True, kw_only=True)
class Surface:
    """Triangles over the drawn part of a map; of a region with surroundings (`regional`) they reach over its border."""

    domain: Domain
    frame: TurnedFrame
    shape: tuple[int, int]
    u: FloatArray  # of the vertices: the first `nodes` are grid nodes, the others images of seams
    v: FloatArray
    x: FloatArray
    y: FloatArray
    source: IntArray  # the node on whose side of the seam each vertex lies
    weights: FloatArray  # shares of the nodes, the mean of those by area on the ground and on the map
    extent: Extent  # smallest and largest x, then y
    view: Extent  # likewise, of the picture
    whole: IntArray  # (m, 4), corners of untorn cells
    cut: tuple[IntArray, ...]  # vertices of the polygons of torn cells
    triangles: IntArray
    outline: FloatArray
    central_meridian: float | None
    pieces: tuple[FloatArray, ...] = ()  # polygons (x, y) that make up a region with surroundings, of one orientation
    border: tuple[FloatArray, ...] = ()  # its border as lines
    ground: Surface | None = None  # the surface that fills the rest of the picture

    @property
    def goes_on(self) -> bool:
        """True if the map continues beyond its picture."""
        if self.ground is None:
            return False
        (west, east, south, north), (left, right, low, top) = self.view, self.ground.extent
        return west > left or east < right or south > low or north < top

    @property
    def is_local(self) -> bool:
        """True if the picture shows a region with its surroundings, and less than a hemisphere."""
        return self.ground is not None and max(ground_size(self.ground.domain.box.bounds)) < _HEMISPHERE

    @property
    def nodes(self) -> int:
        """The number of grid nodes."""
        return self.shape[0] * self.shape[1]

    def lonlat(self) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes of the vertices; longitudes may exceed 180."""
        return self.frame.geographic(self.u, self.v)

    def lonlat_off_seams(self, chosen: IntArray | slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes of the chosen vertices; images of seams are moved a little to their own side."""
        du, dv = self.u[self.source] - self.u, self.v[self.source] - self.v
        u, v = self.u + _INWARD * (np.mod(du + 180.0, 360.0) - 180.0), self.v + _INWARD * dv
        lon, lat = self.frame.geographic(u[chosen], v[chosen])
        return wrapped(lon), lat

    def covering(self, chosen: BoolArray | None = None) -> IntArray:
        """About a quarter as many triangles that cover the chosen cells, or all, for filling with one colour."""
        # Blocks of whole cells become fans about their middles, except where a fan would fold.
        whole, cut = (self.whole, self.cut) if chosen is None else self.cells(chosen)
        blocks = np.array(self.shape) // _BLOCK
        row, column = np.divmod(whole[:, 0], self.shape[1])
        block = row // _BLOCK * blocks[1] + column // _BLOCK
        block[(row >= blocks[0] * _BLOCK) | (column >= blocks[1] * _BLOCK)] = blocks.prod()
        filled = np.bincount(block, minlength=blocks.prod() + 1) == _BLOCK**2
        filled[-1] = False
        # The corners around each block and its middle; where all turns are of one sign, the fan does not fold.
        numbers, side, zeros = np.flatnonzero(filled), np.arange(_BLOCK), np.zeros(_BLOCK, dtype=int)
        up = np.concatenate([zeros, side, zeros + _BLOCK, _BLOCK - side])
        along = np.concatenate([side, zeros + _BLOCK, _BLOCK - side, zeros])
        row, column = (_BLOCK * index for index in np.divmod(numbers, blocks[1]))
        ring = (row[:, None] + up) * self.shape[1] + (column[:, None] + along) % self.shape[1]
        middle = (row + _BLOCK // 2) * self.shape[1] + column + _BLOCK // 2
        x, y = self.x[ring] - self.x[middle, None], self.y[ring] - self.y[middle, None]
        turns = np.sign(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1))
        even = np.abs(turns.sum(axis=1)) == np.abs(turns).sum(axis=1)
        fans = np.stack([np.broadcast_to(middle[:, None], ring.shape), ring, np.roll(ring, -1, axis=1)], axis=-1)
        filled[numbers[~even]] = False
        return np.concatenate([fans[even].reshape(-1, 3), triangles_of(whole[~filled[block]], cut)])

    def cells(self, chosen: BoolArray) -> tuple[IntArray, list[IntArray]]:
        """The chosen whole cells and the chosen cut cells; `chosen` has flags of the former, then of the latter."""
        return self.whole[chosen[: len(self.whole)]], [self.cut[k] for k in np.flatnonzero(chosen[len(self.whole) :])]


def triangles_of(whole: IntArray, cut: Sequence[IntArray]) -> IntArray:
    """Triangles of cells with four corners and of convex polygons, (m, 3) vertex indices."""
    fans = [np.column_stack([np.full(len(p) - 2, p[0]), p[1:-1], p[2:]]) for p in cut if len(p) > 2]
    return np.concatenate([whole[:, [0, 1, 2]], whole[:, [0, 2, 3]], *fans])


def rim_edges(triangles: IntArray) -> IntArray:
    """Edges (n, 2) of one triangle only, ascending: the map's edge, as triangles share vertices except across seams."""
    edges = np.sort(np.concatenate([triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    count = int(edges.max(initial=0)) + 1
    numbers, uses = np.unique(edges[:, 0] * count + edges[:, 1], return_counts=True)
    return np.column_stack(np.divmod(numbers[uses == 1], count))


_AROUND_MAP, _AROUND_PART = 0.01, 0.05  # of the larger side of a map
_NARROWEST = 0.5  # of the larger side of a picture


def frame_of_part(extent: Extent) -> Extent:
    """The extent of a picture of a part of a map, with some surroundings and not too narrow."""
    west, east, south, north = extent
    width, height = east - west, north - south
    longest = max(width, height)
    narrowest = _NARROWEST * (1.0 + 2.0 * _AROUND_PART) * longest
    x, y = (0.5 * max(side + 2.0 * _AROUND_PART * longest, narrowest) for side in (width, height))
    across, up = 0.5 * (west + east), 0.5 * (south + north)
    return across - x, across + x, up - y, up + y


def build_surface(domain: Domain, step: float | None = None) -> Surface:
    """The surface of a domain, with cells of `step` degrees (0.6 for the globe, 1/200 of smaller regions)."""
    frame = frame_of(domain)
    u, v, wraps = _grid(domain, frame, step)

    def function(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        return domain(*frame.geographic(u, v))

    uu, vv = np.meshgrid(u, v)
    points = evaluate(function, uu, vv)
    if not drawn(points).any():
        raise domain.shows_nothing()
    right = np.concatenate([points[:, 1:], points[:, :1] + [360.0, 0, 0, 0]], axis=1) if wraps else points[:, 1:]
    left = points if wraps else points[:, :-1]
    across = find_tears(function, left.reshape(-1, 4), right.reshape(-1, 4), domain.radius)
    along = find_tears(function, points[:-1].reshape(-1, 4), points[1:].reshape(-1, 4), domain.radius)
    return _Builder(domain, frame, function, points, across, along, wraps).surface()


def _grid(domain: Domain, frame: TurnedFrame, step: float | None) -> tuple[FloatArray, FloatArray, bool]:
    """Grid coordinates of columns and of rows in degrees, and whether the columns close around the globe."""
    bounds = GLOBE.bounds if frame.axes is not None else domain.box.bounds
    west, south, _, north = bounds
    width, height = longitude_width(bounds), north - south
    wraps = width == 360.0
    if step is None:
        step = min(_GLOBE_STEP, max(ground_size(bounds)) / _REGION_NODES)
    # A degree of longitude is longest next to the equator.
    longest = np.cos(np.radians(max(south, -north, 0.0)))
    columns = max(int(np.ceil(width * longest / step)), 8)
    rows = max(int(np.ceil(height / step)), 8)
    # The edges of a region are sampled from just inside, so that `contains` does not depend on rounding.
    inset = max(1e-9 * max(width, height), 1e-12)
    across = (np.arange(columns) + _OFFSET) * (width / columns)
    u = west + (across if wraps else np.concatenate([[inset], across, [width - inset]]))
    v = np.concatenate([[inset], (np.arange(rows) + _OFFSET) * (height / rows), [height - inset]]) + south
    pole = POLE if frame.axes is None else _TURNED_POLE
    return np.asarray(u), np.clip(v, -pole, pole), wraps


@dataclass
class _Builder:
    """Vertices, polygons and outline segments of a surface, collected while walking around the torn cells."""

    domain: Domain
    frame: TurnedFrame
    function: Map
    points: FloatArray
    across: Links  # of nodes along rows, `width` of them in a row
    along: Links  # along columns
    wraps: bool
    extra: list[FloatArray] = field(default_factory=list)
    source: list[int] = field(default_factory=list)
    images: dict[tuple[int, int, int], int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        rows, columns = self.rows, self.columns = self.points.shape[:2]
        width = self.width = columns if self.wraps else columns - 1
        self.node = np.arange(rows * columns).reshape(rows, columns)
        # Numbers of links.
        self.in_rows = np.arange(rows * width).reshape(rows, width)
        self.in_columns = np.arange((rows - 1) * columns).reshape(rows - 1, columns)

    def vertices(self) -> FloatArray:
        """Nodes and images of seams found so far, (n, 4)."""
        return np.concatenate([self.points.reshape(-1, 4), np.array(self.extra).reshape(-1, 4)])

    def surface(self) -> Surface:
        """The finished surface; raises ValueError if nothing is drawn."""
        width, nodes = self.width, self.node.size
        right = np.roll(self.node, -1, axis=1)[:, :width]
        node, across, along = self.node[:, :width], self.in_rows, self.in_columns
        corners = np.stack([node[:-1], right[:-1], right[1:], node[1:]], axis=-1)
        # The links of a cell, in the order of its corners: below, right, above, left.
        links = np.stack([across[:-1], np.roll(along, -1, axis=1)[:, :width], across[1:], along[:, :width]], axis=-1)
        tables = (self.across, self.along, self.across, self.along)
        torn = np.stack([table.torn[links[..., k]] for k, table in enumerate(tables)], axis=-1)
        whole = corners[~torn.any(axis=-1)]
        longest = _LONGEST * self._size
        whole = whole[_longest_sides(self.points.reshape(-1, 4)[whole.T, 2:]) < longest]
        cells = np.argwhere(torn.any(axis=-1) & drawn(self.points.reshape(-1, 4)[corners]).any(axis=-1))
        walked = [(p, (j, i)) for j, i in cells for p in self._walk(corners[j, i], links[j, i], torn[j, i])]
        xy = self.vertices()[:, 2:]
        short = [one for one in walked if _longest_sides(xy[one[0]]) < longest]
        polygons, places = [polygon for polygon, _ in short], [place for _, place in short]
        self._reach_out(polygons, places)
        cut = [np.array(polygon) for polygon in polygons]
        # The sides of polygons that lie along a seam.
        sides = [side for polygon in polygons for side in zip(polygon, [*polygon[1:], polygon[0]], strict=True)]
        segments = [(one, other) for one, other in sides if min(one, other) >= nodes]
        self._add_edges(segments)
        vertices = self.vertices()
        lines = vertices[:, 2:][np.array(segments, dtype=int).reshape(-1, 2)]
        triangles = triangles_of(whole, cut)
        if not len(triangles):
            raise self.domain.shows_nothing()
        u, v, x, y = vertices.T
        used = np.zeros(len(vertices), dtype=bool)
        used[triangles] = True
        west, east, south, north = extent = extent_of(vertices[used, 2:])
        margin = _AROUND_MAP * max(east - west, north - south)
        sources = np.concatenate([np.arange(nodes), np.array(self.source, dtype=int)])
        return Surface(
            domain=self.domain,
            frame=self.frame,
            shape=(self.rows, self.columns),
            u=u,
            v=v,
            x=x,
            y=y,
            source=sources,
            weights=node_weights(x, y, v, triangles, sources, nodes),
            extent=extent,
            view=(west - margin, east + margin, south - margin, north + margin),
            whole=whole,
            cut=tuple(cut),
            triangles=triangles,
            outline=lines[np.hypot(*(lines[:, 1] - lines[:, 0]).T) > 1e-6 * self._size],
            central_meridian=self._central_meridian(),
        )

    def _walk(self, corners: IntArray, links: IntArray, torn: BoolArray) -> list[list[int]]:
        """The polygons of a torn cell, each closed along the seam from its last vertex to its first."""
        # A polygon is a run of corners joined by untorn links, with the seam's images on the links before and after it.
        polygons = []
        for first in range(4):
            if not torn[first - 1] or not np.isfinite(self.points.reshape(-1, 4)[corners[first], 2]):
                continue
            polygon = [self._image(links, first - 1, corners[first], after=True), int(corners[first])]
            last = first
            while not torn[last % 4]:
                last += 1
                polygon.append(int(corners[last % 4]))
            polygon.append(self._image(links, last, corners[last % 4], after=False))
            polygons.append(polygon)
        return polygons

    def _image(self, links: IntArray, side: int, corner: int, *, after: bool) -> int:
        """The vertex of the seam's image on a side of a cell, next to the corner before or after it."""
        side %= 4
        # The sides above and left are walked against the direction of their links.
        stop = after == (side in (0, 1))
        group = 0 if side in (0, 2) else 1
        key = (group, int(links[side]), int(stop))
        if key not in self.images:
            table = self.along if group else self.across
            self.images[key] = self._add((table.stop if stop else table.start)[links[side]], int(corner))
        return self.images[key]

    def _add(self, point: FloatArray, source: int) -> int:
        """The number of a new vertex on the side of the node `source`."""
        self.extra.append(point)
        self.source.append(source)
        return self.node.size + len(self.source) - 1

    def _add_edges(self, segments: list[tuple[int, int]]) -> None:
        """Add to the outline the outer rows, and the outer columns of a grid that does not wrap, up to their tears."""
        node = self.node
        edges = []
        for j in (0, self.rows - 1):
            # A row may be a pole whose image is a point, or a point in each lobe.
            steps = np.hypot(*np.diff(self.points[j, :, 2:], axis=0).T)
            if not (np.isfinite(steps).any() and np.nanmedian(steps) < 1e-5 * self._size):
                edges.append((0, self.across, self.in_rows[j], node[j], np.roll(node[j], -1)))
        if not self.wraps:
            edges += [(1, self.along, self.in_columns[:, i], node[:-1, i], node[1:, i]) for i in (0, self.columns - 1)]
        for group, table, links, start, stop in edges:
            for link, one, other in zip(links.tolist(), start.tolist(), stop.tolist(), strict=False):
                if not table.torn[link]:
                    segments.append((one, other))
                    continue
                ends = ((one, (group, link, 0)), (other, (group, link, 1)))
                segments += [(corner, self.images[image]) for corner, image in ends if image in self.images]

    @functools.cached_property
    def _size(self) -> float:
        """The larger of the map's width and height."""
        xy = self.points[..., 2:].reshape(-1, 2)
        return float(np.max(np.nanmax(xy, axis=0) - np.nanmin(xy, axis=0)))

    def _reach_out(self, polygons: list[list[int]], cells: list[tuple[int, int]]) -> None:
        """Add to polygons a vertex on the seam, between its two crossings of the cell, to keep corners sharp."""
        if not polygons:
            return
        u, v = self.points[0, :, 0], self.points[:, 0, 1]
        u = np.append(u, u[:1] + 360.0) if self.wraps else u
        j, i = np.array(cells).T
        low, high = np.column_stack([u[i], v[j]]), np.column_stack([u[i + 1], v[j + 1]])
        vertices = self.vertices()
        local = [vertices[p, :2] for p in polygons]
        if self.wraps:
            # In the column where the grid closes, nodes are one turn away from their neighbours.
            for uv, middle in zip(local, 0.5 * (u[i] + u[i + 1]), strict=True):
                uv[:, 0] += 360.0 * np.round((middle - uv[:, 0]) / 360.0)
        centre = np.array([uv.mean(axis=0) for uv in local])
        direction = np.array([0.5 * (uv[0] + uv[-1]) for uv in local]) - centre
        with np.errstate(divide="ignore", invalid="ignore"):
            walls = np.where(direction > 0, (high - centre) / direction, (low - centre) / direction)
        reach = np.nan_to_num(np.fmin(walls[:, 0], walls[:, 1]), nan=0.0, posinf=0.0, neginf=0.0)
        centre = evaluate(self.function, *centre.T)
        corner = vertices[[p[1] for p in polygons]]
        corner[:, :2] = [uv[1] for uv in local]
        far = evaluate(self.function, *(centre[:, :2] + direction * reach[:, None]).T)
        joined = ~find_tears(self.function, corner, centre, self.domain.radius).torn
        seam = find_tears(self.function, centre, far, self.domain.radius)
        for k in np.flatnonzero(joined & seam.torn & drawn(seam.start)):
            polygons[k].append(self._add(seam.start[k], self.source[polygons[k][-1] - self.node.size]))

    def _central_meridian(self) -> float | None:
        """The meridian opposite the only tear of the equator; None where there is not exactly one."""
        if not self.wraps or self.frame.axes is not None:
            return None
        row = int(np.argmin(np.abs(self.points[:, 0, 1])))
        torn = np.flatnonzero(self.across.torn.reshape(self.rows, self.width)[row])
        if torn.size != 1:
            return None
        return float(wrapped(self.across.start[row * self.width + torn[0], 0] + 180.0))


def _longest_sides(xy: FloatArray) -> FloatArray:
    """Lengths of the longest sides of polygons with corners (n, ..., 2)."""
    sides = xy - np.roll(xy, 1, axis=0)
    return np.asarray(np.hypot(sides[..., 0], sides[..., 1]).max(axis=0))


def node_weights(
    x: FloatArray, y: FloatArray, v: FloatArray, triangles: IntArray, sources: IntArray, nodes: int
) -> FloatArray:
    """Shares of the nodes: the mean of their shares of area on the ground and on the map."""
    used = np.zeros(x.size, dtype=bool)
    used[triangles] = True
    # A step along a row is shorter towards the grid's poles.
    ground = np.where(used[:nodes], np.cos(np.radians(v[:nodes])), 0.0)
    (ax, bx, cx), (ay, by, cy) = x[triangles].T, y[triangles].T
    area = np.abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))
    drawn_area = np.bincount(sources[triangles].ravel(), np.repeat(area, 3), minlength=nodes)
    return np.asarray(0.5 * (ground / ground.sum() + drawn_area / drawn_area.sum()))


def extent_of(xy: FloatArray) -> Extent:
    """The smallest and largest x, then y of points (n, 2)."""
    (west, south), (east, north) = xy.min(axis=0), xy.max(axis=0)
    return float(west), float(east), float(south), float(north)


# Of the map's size. The surface has chords for arcs, which cut off 1e-6 to 1e-5 of it; a margin makes up for that.
_SIMPLE, _AROUND = 5e-6, 2.5e-5
_POINT = 1e-6  # of the map's area: smaller pieces are images of poles


@GEOS_ARITHMETIC
def boundary_polygon(surface: Surface) -> shapely.Polygon:
    """A polygon slightly larger than a map, without holes; ValueError for maps in several pieces."""
    segments = np.column_stack([surface.x, surface.y])[rim_edges(surface.triangles)]
    segments = segments[(segments[:, 0] != segments[:, 1]).any(axis=1)]
    faces = shapely.get_parts(shapely.polygonize(shapely.linestrings(segments)))
    if not len(faces):
        message = f"Invalid projection '{surface.domain.projection.name}'. Its map must have an edge that closes."
        raise ValueError(message)
    filled = shapely.polygons(shapely.get_exterior_ring(faces))
    largest = int(np.argmax(shapely.area(filled)))
    beside = ~shapely.covered_by(shapely.point_on_surface(filled), filled[largest])
    pieces = 1 + int(np.sum(beside & (shapely.area(filled) > _POINT * shapely.area(filled[largest]))))
    if pieces > 1:
        name = surface.domain.projection.name
        raise ValueError(f"Invalid projection '{name}'. It must be a map in one piece; this one has {pieces}.")
    west, east, south, north = surface.extent
    size = max(east - west, north - south)
    around = shapely.buffer(shapely.simplify(filled[largest], _SIMPLE * size), _AROUND * size, join_style="mitre")
    return shapely.Polygon(shapely.get_exterior_ring(around))
