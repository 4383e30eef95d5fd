"""Polygons in longitude and latitude, as regions.

An edge is a straight line in longitude and latitude, as GeoJSON has it (RFC 7946, section 3.1.1).
The polygons are not triangulated: the panels are those of their bounding box, and where an edge
crosses a panel, the weights of its nodes integrate polynomials exactly over the polygon's part of
it. The cost of an integral then depends on the smoothness of the map, not on the number of
vertices, and the weights serve all maps.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, WGS84, Discontinuities, Ellipsoid, wrapped
from projdist.numerics import ORDER, PLANE_WEIGHTS
from projdist.regions import chains
from projdist.regions.boxes import SLIVER, height_of, latitude_of, patch_chart, patch_panels, tightened
from projdist.regions.region import ChartPoints, Clips, Square

_GAP = 1e-6  # degrees of longitude
_CHORDS = 512.0  # for a curve across a panel: they are off by 5e-7 of its bend


class _Part(NamedTuple):
    """The polygons' part of a rectangle: chain, tight rectangle, weights of the nodes, True if it is all."""

    chain: chains.Clip
    rectangle: tuple[float, float, float, float]
    rule: FloatArray
    whole: bool


@dataclass(frozen=True)
class Polygons:
    """Polygons within longitudes -180 to 180, valid and disjoint, with their holes.

    `name` is the region as text for `get_region`; `repairs` are notes on repairs, `far` is a note on distant parts that
    may not be meant; `resolution` is that of the shipped outlines, "" for others. `ellipsoid` is that of the body; None
    fits any body, and the area is then on WGS 84.
    """

    geometry: shapely.MultiPolygon
    name: str
    repairs: tuple[str, ...] = ()
    far: str = ""
    resolution: str = ""
    ellipsoid: Ellipsoid | None = field(default=None, compare=False)

    def __reduce__(self) -> tuple[Any, ...]:
        return Polygons, (self.geometry, self.name, self.repairs, self.far, self.resolution, self.ellipsoid)

    def __hash__(self) -> int:
        return self._hash

    @functools.cached_property
    def _hash(self) -> int:
        """The dataclass hash, cached as that of a geometry is slow."""
        return hash((self.geometry, self.name, self.repairs, self.far, self.resolution))

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on repairs and distant parts."""
        return (*self.repairs, self.far) if self.far else self.repairs

    @functools.cached_property
    def _west(self) -> float:
        """Western end of longitudes: -180, or the eastern end of the widest gap if that is elsewhere."""
        extents = shapely.bounds(shapely.get_parts(self.geometry))
        order = np.argsort(extents[:, 0])
        reach = np.maximum.accumulate(extents[order, 2])
        starts = np.append(extents[order, 0][1:], extents[order[0], 0] + 360.0)
        gaps = starts - reach
        widest = int(np.argmax(gaps))
        return float(starts[widest]) if gaps[widest] > _GAP and widest < len(gaps) - 1 else -180.0

    @functools.cached_property
    def edges(self) -> FloatArray:
        """The edges lon0, lat0, lon1, lat1 in degrees, shape (m, 4), with the polygons on their left.

        Longitudes exceed 180 if that keeps the polygons together; there are also edges along the poles and along the
        antimeridian where it cuts polygons.
        """
        parts = shapely.get_parts(self.geometry)
        rings, polygon = shapely.get_rings(parts, return_index=True)
        points, ring = shapely.get_coordinates(rings, return_index=True)
        same = ring[1:] == ring[:-1]
        edges = np.hstack([points[:-1], points[1:]])[same]
        ring = ring[:-1][same]
        turned = np.zeros(len(rings))
        np.add.at(turned, ring, edges[:, 0] * edges[:, 3] - edges[:, 2] * edges[:, 1])
        shell = np.append(True, polygon[1:] != polygon[:-1])
        backwards = ((turned > 0) != shell)[ring]
        edges[backwards] = edges[backwards][:, [2, 3, 0, 1]]
        beyond = shapely.bounds(parts)[:, 0] < self._west
        edges[beyond[polygon[ring]], 0::2] += 360.0
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
        return chains.area_km2(self.edges, self.figure)

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

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The chart of `patch_chart`."""
        return patch_chart(patch, u, v)

    # ---- clipping -----------------------------------------------------------------------

    @functools.cached_property
    def _parts(self) -> dict[tuple[float, ...], _Part | None]:
        """Cache of parts by patch and (requested or tight) rectangle; None for empty ones."""
        return {}

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """The polygons' parts of rectangles, tightened, with the weights of their nodes."""
        parts = []
        for i, (number, rectangle) in enumerate(zip(patch.tolist(), rectangles.tolist(), strict=True)):
            key = (number, *rectangle)
            if key not in self._parts:
                parent = None if within is None else self._parts.get((number, *within[i].tolist()))
                part = self._clipped(number, rectangle, parent.chain if parent else self._all)
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

    @property
    def _all(self) -> chains.Clip:
        return chains.Clip(self.edges, np.empty((0, 2)))

    def _clipped(self, patch: int, rectangle: list[float], chain: chains.Clip) -> _Part | None:
        u0, u1, v0, v1 = rectangle
        south, north = sorted(float(lat) for lat in latitude_of(patch, np.array([v0, v1])))
        part = chains.clip(chain, u0, u1, south, north)
        if part.empty:
            return None
        if chains.is_whole(part, south, north):
            return _Part(part, (u0, u1, v0, v1), PLANE_WEIGHTS, True)
        west, east, low, high = chains.extent(part, u0, u1, south, north)
        if low > south or high < north:
            v0, v1 = tightened(v0, v1, *sorted(float(v) for v in height_of(patch, np.array([low, high]))))
        if not (east > west and v1 > v0):
            return None
        if east < u1:
            # The eastern side has moved: edges on it are now gates.
            part = chains.clip(part, west, east, low, high)
        rule = self._rule(part, patch, (west, east, v0, v1))
        return _Part(part, (west, east, v0, v1), rule, False) if rule.sum() > 4.0 * SLIVER else None

    @staticmethod
    def _rule(part: chains.Clip, patch: int, rectangle: tuple[float, float, float, float]) -> FloatArray:
        u0, u1, v0, v1 = rectangle

        def to_r(lon: FloatArray) -> FloatArray:
            return np.clip((2.0 * lon - u0 - u1) / (u1 - u0), -1.0, 1.0)

        def to_s(lat: FloatArray) -> FloatArray:
            return np.clip((2.0 * height_of(patch, lat) - v0 - v1) / (v1 - v0), -1.0, 1.0)

        def to_lat(s: FloatArray) -> FloatArray:
            return latitude_of(patch, 0.5 * (v0 + v1) + 0.5 * (v1 - v0) * s)

        return chains.weights(part, to_r, to_s, to_lat)

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """The weights (p, p) for a curved piece of a clipped rectangle, which `square` maps to [-1, 1]^2.

        Edges are curves there, approximated by chords.
        """
        part = self._parts[(patch, *rectangle.tolist())]
        assert part is not None  # kept by `clip`
        edges = chains.closed(part.chain, *rectangle[:2])
        size = np.array([rectangle[1] - rectangle[0], np.ptp(latitude_of(patch, rectangle[2:]))])
        longest = (np.abs(edges[:, 2:] - edges[:, :2]) / size).max(axis=1, initial=0.0)
        lon, lat = chains.divided(edges, np.ceil(_CHORDS * longest).clip(1).astype(int))
        (r0, r1), (s0, s1) = square(lon, height_of(patch, lat))
        curved = chains.clip(chains.Clip(np.stack([r0, s0, r1, s1], axis=-1), np.empty((0, 2))), -1.0, 1.0, -1.0, 1.0)
        rule = chains.weights(curved, _same, _same, _same)
        # The slices south of a cut and those north of it have opposite orientations.
        return rule if rule.sum() >= 0.0 else -rule


def _same(values: FloatArray) -> FloatArray:
    return values
