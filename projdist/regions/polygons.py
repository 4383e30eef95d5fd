"""Polygons in longitude and latitude, as regions: clipped to rectangles, and integrated over by Green's theorem.

An edge is a straight line in longitude and latitude, as GeoJSON has it (RFC 7946, section 3.1.1). The polygons are not
triangulated: the panels are those of their bounding box, and where an edge crosses a panel, the weights of its nodes
integrate polynomials exactly over the polygon's part of it. The cost of an integral then depends on the smoothness of
the map, not on the number of vertices, and the weights serve all maps.

A chain is an array (m, 4) of edges lon0, lat0, lon1, lat1 in degrees, with the polygon on their left. Clipping moves
everything outside a rectangle onto its sides. The winding number about inner points stays, so that no intersection of
polygons and rectangles is ever computed, and degenerate ones do no harm. The integral of a polynomial over the polygon
becomes one along the chain, and is exact.
"""

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, WGS84, Discontinuities, Ellipsoid, wrapped
from projdist.numerics import LEGENDRE, NODES, ORDER, PLANE_WEIGHTS, WEIGHTS
from projdist.regions.region import SLIVER, Clips, Square, height_of, latitude_of, patch_chart, patch_panels, tightened

Side = Callable[[FloatArray], FloatArray]

_GAP = 1e-6  # degrees of longitude: narrower gaps are rounding
_CHORDS = 512.0  # for a curve across a panel, from which they are off by 5e-7 of its bend
_WHOLE = 1.0 - 1e-13  # of a side, up to rounding

# Gauss points along an edge. The integrand is a polynomial of degree 2 p - 1 on the square, for which p points are
# exact; on shorter edges (in halves of the square's side) fewer suffice for 1e-15.
_POINTS = ((0.004, 3), (0.06, 6), (np.inf, 2 * ORDER))
_AT_ONCE = 20_000  # edges: 40 MB
_gauss = functools.cache(np.polynomial.legendre.leggauss)


class Clip(NamedTuple):
    """The part of a chain in a rectangle of longitudes and latitudes."""

    edges: FloatArray  # (m, 4), those inside; none on the other sides, which contribute nothing to integrals
    gates: FloatArray  # (k, 2), intervals of latitude in which the polygon touches the eastern side


def clip(chain: Clip, west: float, east: float, south: float, north: float) -> Clip:
    """The part of a chain in a rectangle; the chain must hold all of the polygon that is in it."""
    edges, gates = chain
    low, high = np.minimum(edges[:, 1], edges[:, 3]), np.maximum(edges[:, 1], edges[:, 3])
    edges = edges[(high > south) & (low < north) & (np.maximum(edges[:, 0], edges[:, 2]) > west)]
    for axis, at in ((1, south), (1, north), (0, west), (0, east)):
        edges = _split(edges, axis, at)
    edges[:, 0::2] = np.clip(edges[:, 0::2], west, east)
    edges[:, 1::2] = np.clip(edges[:, 1::2], south, north)
    lon, lat = edges[:, 0::2], edges[:, 1::2]
    beside = (lon == west).all(axis=1) | (lat[:, 0] == lat[:, 1])
    eastern = (lon == east).all(axis=1)
    gates = np.concatenate([np.clip(gates, south, north), lat[eastern & ~beside]])
    return Clip(edges[~beside & ~eastern], _intervals(gates))


def _split(edges: FloatArray, axis: int, at: float) -> FloatArray:
    """The edges, split where they cross a longitude (axis 0) or latitude (1)."""
    before, after = edges[:, axis] - at, edges[:, 2 + axis] - at
    crossing = before * after < 0.0
    if not crossing.any():
        return edges.copy()
    crossed = edges[crossing]
    share = (before[crossing] / (before - after)[crossing])[:, None]
    middle = crossed[:, :2] + share * (crossed[:, 2:] - crossed[:, :2])
    middle[:, axis] = at
    return np.concatenate([edges[~crossing], np.hstack([crossed[:, :2], middle]), np.hstack([middle, crossed[:, 2:]])])


def _intervals(runs: FloatArray) -> FloatArray:
    """Sum of directed intervals (n, 2) on a line: those that remain, each repeated by its multiplicity."""
    places, index = np.unique(runs, return_inverse=True)
    if places.size < 2:
        return np.empty((0, 2))
    change = np.zeros(places.size, dtype=int)
    index = index.reshape(runs.shape)
    np.add.at(change, index[:, 0], 1)
    np.add.at(change, index[:, 1], -1)
    count = np.cumsum(change)[:-1]
    pairs = np.stack([places[:-1], places[1:]], axis=1)
    pairs[count < 0] = pairs[count < 0, ::-1]
    return np.repeat(pairs, np.abs(count), axis=0)


def _closed(part: Clip, west: float, east: float) -> FloatArray:
    """All edges of a part, including those on the sides of its rectangle but not along parallels."""
    edges, gates = part
    western = _intervals(np.concatenate([edges[:, 1::2], gates]))[:, ::-1]
    sides = [
        np.column_stack([np.full(len(lats), lon), lats[:, 0], np.full(len(lats), lon), lats[:, 1]])
        for lon, lats in ((east, gates), (west, western))
    ]
    return np.concatenate([edges, *sides])


def _divided(edges: FloatArray, pieces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Ends of equal pieces of edges, `pieces` of each: longitudes (2, k) and latitudes (2, k)."""
    index = np.repeat(np.arange(len(pieces)), pieces)
    number = np.arange(len(index)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = np.stack([number, number + 1]) / pieces[index]
    lon0, lat0, lon1, lat1 = edges[index].T
    return lon0 * (1.0 - share) + lon1 * share, lat0 * (1.0 - share) + lat1 * share


def area_km2(edges: FloatArray, ellipsoid: Ellipsoid) -> float:
    """Area on an ellipsoid on the left of a closed chain, by Green's theorem."""
    # Edges are divided into pieces of 10 degrees, for which the nodes are exact to rounding.
    pieces = np.ceil(np.abs(edges[:, 3] - edges[:, 1]) / 10.0).clip(1).astype(int)
    (lon0, lon1), (lat0, lat1) = _divided(edges, pieces)
    total = 0.0
    for first in range(0, len(lat0), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        below = ellipsoid.area_below(lat0[part, None] + (lat1 - lat0)[part, None] * 0.5 * (1.0 + NODES))
        total += float(np.sum(np.radians(lon0 - lon1)[part] * (below @ WEIGHTS) * 0.5))
    return total / 1e6


def _weights(part: Clip, to_r: Side, to_s: Side, to_lat: Side) -> FloatArray:
    """Weights (p, p) of a square's Gauss nodes that integrate the polynomial through them over the polygon."""
    # `to_r` maps longitudes to [-1, 1], linearly; `to_s` latitudes to [-1, 1], and `to_lat` back.
    edges, gates = part
    moments = np.zeros((ORDER, ORDER))
    # On the eastern side the integrals of all Legendre polynomials but the first vanish.
    moments[0] = 2.0 * np.sum(_primitives(to_s(gates[:, 1])) - _primitives(to_s(gates[:, 0])), axis=0)
    s0, s1 = to_s(edges[:, 1]), to_s(edges[:, 3])
    width = np.maximum(np.abs(to_r(edges[:, 2]) - to_r(edges[:, 0])), np.abs(s1 - s0))
    shortest = 0.0
    for longest, points in _POINTS:
        chosen = np.flatnonzero((shortest <= width) & (width < longest))
        nodes, gauss = _gauss(points)
        for first in range(0, len(chosen), _AT_ONCE):
            some = chosen[first : first + _AT_ONCE]
            length = (s1 - s0)[some, None]
            s = s0[some, None] + length * (0.5 * (1.0 + nodes))
            lon0, lat0, lon1, lat1 = (edges[some, k, None] for k in range(4))
            along = np.clip((to_lat(s) - lat0) / (lat1 - lat0), 0.0, 1.0)
            r, ds = to_r(lon0 + (lon1 - lon0) * along), 0.5 * length * gauss
            in_s = np.polynomial.legendre.legvander(s.ravel(), ORDER - 1)
            moments += (_primitives(r.ravel()) * ds.ravel()[:, None]).T @ in_s
        shortest = longest
    sign = 1.0 if to_lat(np.array(1.0)) > to_lat(np.array(-1.0)) else -1.0
    return sign * LEGENDRE.T @ moments @ LEGENDRE


def _primitives(t: FloatArray) -> FloatArray:
    """Integrals from -1 to t of the Legendre polynomials, shape (n, p): (P_k+1 - P_k-1) / (2 k + 1)."""
    P = np.polynomial.legendre.legvander(t, ORDER)
    result = np.empty((*t.shape, ORDER))
    result[..., 0] = t + 1.0
    result[..., 1:] = (P[..., 2:] - P[..., :-2]) / (2.0 * np.arange(1, ORDER) + 1.0)
    return result


# ---- the region ----------------------------------------------------------------------------------


class _Part(NamedTuple):
    """The polygons' part of a rectangle."""

    chain: Clip
    rectangle: tuple[float, float, float, float]  # tightened
    rule: FloatArray  # weights of the nodes
    whole: bool  # True if it is all of the rectangle


@dataclass(frozen=True)
class Polygons:
    """Polygons within longitudes -180 to 180, valid and disjoint, with their holes."""

    geometry: shapely.MultiPolygon = field(hash=False)  # whose hash is slow
    name: str  # the region as text for `get_region`
    repairs: tuple[str, ...] = ()  # notes on repairs
    far: str = ""  # note on distant parts that may not be meant
    resolution: str = ""  # of the shipped outlines, "" for others
    ellipsoid: Ellipsoid | None = field(default=None, compare=False)  # of the body; None: any, WGS 84
    # Parts by patch and (requested or tight) rectangle; None for empty ones.
    _parts: dict[tuple[float, ...], _Part | None] = field(default_factory=dict, init=False, compare=False, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return Polygons, (self.geometry, self.name, self.repairs, self.far, self.resolution, self.ellipsoid)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on repairs and distant parts."""
        return (*self.repairs, self.far) if self.far else self.repairs

    @functools.cached_property
    def edges(self) -> FloatArray:
        """The edges lon0, lat0, lon1, lat1 in degrees, shape (m, 4), with the polygons on their left."""
        # Longitudes exceed 180 if that keeps the polygons together. There are edges along the poles, too, and along the
        # antimeridian where it cuts polygons.
        parts = shapely.get_parts(self.geometry)
        rings, polygon = shapely.get_rings(parts, return_index=True)
        points, ring = shapely.get_coordinates(rings, return_index=True)
        same = ring[1:] == ring[:-1]
        edges = np.hstack([points[:-1], points[1:]])[same]
        ring = ring[:-1][same]
        shell = np.append(True, polygon[1:] != polygon[:-1])
        backwards = (shapely.is_ccw(rings) != shell)[ring]
        edges[backwards] = edges[backwards][:, [2, 3, 0, 1]]
        # Longitudes begin east of the widest gap if that does not end at the antimeridian.
        extents = shapely.bounds(parts)
        order = np.argsort(extents[:, 0])
        starts = np.append(extents[order, 0][1:], extents[order[0], 0] + 360.0)
        gaps = starts - np.maximum.accumulate(extents[order, 2])
        widest = int(np.argmax(gaps))
        if gaps[widest] > _GAP and widest < len(gaps) - 1:
            edges[(extents[:, 0] < starts[widest])[polygon[ring]], 0::2] += 360.0
        return edges

    @functools.cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; west < east, and east may exceed 180."""
        lon, lat = self.edges[:, 0::2], self.edges[:, 1::2]
        return float(lon.min()), float(lat.min()), float(lon.max()), float(lat.max())

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid on which the area is measured."""
        return self.ellipsoid or WGS84

    @functools.cached_property
    def area_km2(self) -> float:
        """Area on the ellipsoid."""
        return area_km2(self.edges, self.figure)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """True for points in degrees in the polygons, edges included."""
        lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        shapely.prepare(self.geometry)
        lon = wrapped(lon)
        inside = shapely.intersects_xy(self.geometry, lon, lat)
        seam = np.abs(lon) == 180.0
        if seam.any():
            inside = inside | (seam & shapely.intersects_xy(self.geometry, -lon, lat))
        return np.asarray(inside)

    def panels(self, discontinuities: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """Panels from pole to pole, also divided at the antimeridian, where most maps of the world end."""
        west, _, east, _ = self.bounds
        meridians = [west, *(lon for lon in (-180.0, 180.0) if west < lon < east), east]
        parts = [patch_panels((a, -90.0, b, 90.0), discontinuities) for a, b in itertools.pairwise(meridians)]
        return np.concatenate([patch for patch, _ in parts]), np.concatenate([rectangle for _, rectangle in parts])

    chart = staticmethod(patch_chart)

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """The polygons' parts of rectangles, tightened, with the weights of their nodes."""
        parts, everything = [], Clip(self.edges, np.empty((0, 2)))
        for i, (number, rectangle) in enumerate(zip(patch.tolist(), rectangles.tolist(), strict=True)):
            key = (number, *rectangle)
            if key not in self._parts:
                parent = None if within is None else self._parts.get((number, *within[i].tolist()))
                part = self._clipped(number, rectangle, parent.chain if parent else everything)
                self._parts[key] = part
                if part is not None:
                    self._parts[(number, *part.rectangle)] = part
            parts.append(self._parts[key])
        index = np.array([i for i, part in enumerate(parts) if part is not None], dtype=int)
        kept = [part for part in parts if part is not None]
        return Clips(
            index,
            np.array([part.rectangle for part in kept]).reshape(-1, 4),
            np.array([part.rule for part in kept]).reshape(-1, ORDER, ORDER),
            np.array([part.whole for part in kept], dtype=bool),
        )

    def _clipped(self, patch: int, rectangle: list[float], chain: Clip) -> _Part | None:
        """The polygons' part of one rectangle; None if it is empty."""
        u0, u1, v0, v1 = rectangle
        south, north = sorted(float(lat) for lat in latitude_of(patch, np.array([v0, v1])))
        part = clip(chain, u0, u1, south, north)
        edges, gates = part
        if not len(edges):
            if not len(gates):
                return None
            if float(np.sum(gates[:, 1] - gates[:, 0])) >= (north - south) * _WHOLE:
                return _Part(part, (u0, u1, v0, v1), PLANE_WEIGHTS, True)
        lats = np.concatenate([edges[:, 1::2], gates])
        low, high = float(lats.min()), float(lats.max())
        if not len(gates):
            u1 = float(edges[:, 0::2].max())
        # On the western side the polygon lies where the edges east of it do not cancel.
        if not len(_intervals(lats)):
            u0 = float(edges[:, 0::2].min())
        if low > south or high < north:
            ends = sorted(float(v) for v in height_of(patch, np.array([low, high])))
            v0, v1 = tightened(v0, v1, *ends)
        if not (u1 > u0 and v1 > v0):
            return None
        if u1 < rectangle[1]:
            # The eastern side has moved: edges on it are now gates.
            part = clip(part, u0, u1, low, high)
        rule = _weights(
            part,
            lambda lon: np.clip((2.0 * lon - u0 - u1) / (u1 - u0), -1.0, 1.0),
            lambda lat: np.clip((2.0 * height_of(patch, lat) - v0 - v1) / (v1 - v0), -1.0, 1.0),
            lambda s: latitude_of(patch, 0.5 * (v0 + v1) + 0.5 * (v1 - v0) * s),
        )
        return _Part(part, (u0, u1, v0, v1), rule, False) if rule.sum() > 4.0 * SLIVER else None

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """The weights for a curved piece, where edges are curves, approximated by chords."""
        part = self._parts[(patch, *rectangle.tolist())]
        assert part is not None  # kept by `clip`
        edges = _closed(part.chain, *rectangle[:2])
        size = np.array([rectangle[1] - rectangle[0], np.ptp(latitude_of(patch, rectangle[2:]))])
        longest = (np.abs(edges[:, 2:] - edges[:, :2]) / size).max(axis=1, initial=0.0)
        lon, lat = _divided(edges, np.ceil(_CHORDS * longest).clip(1).astype(int))
        (r0, r1), (s0, s1) = square(lon, height_of(patch, lat))
        curved = clip(Clip(np.stack([r0, s0, r1, s1], axis=-1), np.empty((0, 2))), -1.0, 1.0, -1.0, 1.0)
        rule = _weights(curved, np.asarray, np.asarray, np.asarray)
        # The slices south of a cut and those north of it have opposite orientations.
        return rule if rule.sum() >= 0.0 else -rule
