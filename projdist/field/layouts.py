"""What of panels does not depend on the map: their nodes, how far apart these are in metres, areas and weights.

A plan keeps it for a region on an ellipsoid, so that the second map of a region pays for its evaluations only.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Breaks, Ellipsoid
from projdist.field.side_strips import side_points
from projdist.numerics import NODES
from projdist.regions import Clips, Region

__all__ = ["First", "Layout", "Partial", "Plan", "lay", "plan_of"]

Partial = FloatArray | float

_REGIONS = 16  # whose plans are kept
_MOST = 400  # panels of a plan: 6 to 8 kB each, and those of the first generation besides
_WAYS = 8  # first generations of a plan
_U, _V, _LON, _LAT, _DENSITY, _WEIGHT, _EAST_R, _NORTH_S, _EAST_S, _NORTH_R = range(10)
_SHARE, _AREA, _ALONG = 0, 1, slice(2, 4)


@dataclass(frozen=True)
class Layout:
    """Panels, or smooth pieces of them, as an ellipsoid has them.

    `grids` (k, n, p, p) are the chart coordinates u, v, longitudes and latitudes in degrees, m^2 in the unit square of
    the nodes, m^2 by node, and d(east, north) / d(r, s) in metres, of which the mixed ones are left out where they
    vanish. `numbers` (n, 4) are each piece's share in the region, its area in m^2 and the mean metres along r and s.
    """

    patch: IntArray
    grids: FloatArray
    numbers: FloatArray

    def __len__(self) -> int:
        return len(self.patch)

    u = property(lambda self: self.grids[_U])
    v = property(lambda self: self.grids[_V])
    lon = property(lambda self: self.grids[_LON])
    lat = property(lambda self: self.grids[_LAT])
    density = property(lambda self: self.grids[_DENSITY])
    weight = property(lambda self: self.grids[_WEIGHT])
    share = property(lambda self: self.numbers[:, _SHARE])
    area = property(lambda self: self.numbers[:, _AREA])
    metres = property(lambda self: self.numbers[:, _ALONG])

    @property
    def sides(self) -> FloatArray:
        """d(east, north) / d(r, s) in metres (n, p, p, 2, 2)."""
        sides = np.zeros((*self.lon.shape, 2, 2))
        sides[..., 0, 0], sides[..., 1, 1] = self.grids[_EAST_R], self.grids[_NORTH_S]
        if len(self.grids) > _EAST_S:
            sides[..., 0, 1], sides[..., 1, 0] = self.grids[_EAST_S], self.grids[_NORTH_R]
        return sides

    def jacobian(self, f_r: FloatArray, f_s: FloatArray) -> FloatArray:
        """J (n, p, p, 2, 2) of derivatives (2, n, p, p) of x and y along the node axes."""
        east_r, north_s = self.grids[_EAST_R], self.grids[_NORTH_S]
        J = np.empty((*self.lon.shape, 2, 2))
        by_east, by_north = J[..., 0], J[..., 1]
        if len(self.grids) == _EAST_S:
            for i in (0, 1):
                np.divide(f_r[i], east_r, out=by_east[..., i])
                np.divide(f_s[i], north_s, out=by_north[..., i])
            return J
        east_s, north_r = self.grids[_EAST_S], self.grids[_NORTH_R]
        det = east_r * north_s - east_s * north_r
        for i in (0, 1):
            by_east[..., i] = (f_r[i] * north_s - f_s[i] * north_r) / det
            by_north[..., i] = (f_s[i] * east_r - f_r[i] * east_s) / det
        return J


def lay(
    region: Region,
    ellipsoid: Ellipsoid,
    patch: IntArray,
    u: FloatArray,
    v: FloatArray,
    partials: tuple[Partial, Partial, Partial, Partial],
    rule: FloatArray,
    whole: BoolArray,
) -> Layout:
    """The layout of pieces with chart coordinates u, v at their nodes (n, p, p).

    `partials` are du/dr, du/ds, dv/dr, dv/ds, with r and s in [-1, 1] along the two node axes; `rule` holds the
    nodes' weights on that square, which are Gauss's where a piece is `whole`.
    """
    points = region.chart(patch[:, None, None], u, v)
    meridian, vertical = ellipsoid.radii(points.lat)
    u_r, u_s, v_r, v_s = partials
    mixed = (points.east_v, points.north_u, u_s, v_r)
    straight = not any(isinstance(value, np.ndarray) or value for value in mixed)
    grids = np.empty((_EAST_S if straight else _NORTH_R + 1, *u.shape))
    grids[_U], grids[_V], grids[_LON], grids[_LAT] = u, v, points.lon, points.lat
    grids[_EAST_R] = (points.east_u * u_r + points.east_v * v_r) * vertical
    grids[_NORTH_S] = (points.north_u * u_s + points.north_v * v_s) * meridian
    det = grids[_EAST_R] * grids[_NORTH_S]
    square_r, square_s = grids[_EAST_R] ** 2, grids[_NORTH_S] ** 2
    if not straight:
        grids[_EAST_S] = (points.east_u * u_s + points.east_v * v_s) * vertical
        grids[_NORTH_R] = (points.north_u * u_r + points.north_v * v_r) * meridian
        det -= grids[_EAST_S] * grids[_NORTH_R]
        square_r += grids[_NORTH_R] ** 2
        square_s += grids[_EAST_S] ** 2
    np.abs(det, out=grids[_DENSITY])
    np.multiply(grids[_DENSITY], rule, out=grids[_WEIGHT])
    numbers = np.empty((len(u), 4))
    numbers[:, _SHARE] = np.where(whole, 1.0, 0.25 * rule.sum(axis=(1, 2)))
    numbers[:, _AREA] = grids[_WEIGHT].sum(axis=(1, 2))
    for column, square in zip((2, 3), (square_r, square_s), strict=True):
        numbers[:, column] = np.sqrt(square).mean(axis=(1, 2))
    grids.flags.writeable = numbers.flags.writeable = False  # a plan keeps them
    return Layout(patch, grids, numbers)


@dataclass(frozen=True)
class First:
    """The first panels of a region, and all points at which a map of them is evaluated: nodes, then side points."""

    clips: Clips
    layout: Layout
    lon: FloatArray
    lat: FloatArray

    def parts(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of x and y (2, m) those at the nodes (2, n, p, p), and those at `side_points` (2, n, 2, 2, k)."""
        shape, count = self.layout.lon.shape, self.layout.lon.size
        return xy[:, :count].reshape(2, *shape), xy[:, count:].reshape(2, shape[0], 2, 2, -1)


class Plan:
    """The layouts of a region's panels on an ellipsoid: laid when they are asked for, and kept."""

    def __init__(self, region: Region, ellipsoid: Ellipsoid) -> None:
        self.region, self.ellipsoid = region, ellipsoid
        self._kept: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = {}
        self._first: dict[Breaks, First] = {}

    def first(self, breaks: Breaks) -> First:
        """The region's own panels for maps with such breaks."""
        if breaks not in self._first:
            if len(self._first) == _WAYS:
                self._first.pop(next(iter(self._first)))
            self._first[breaks] = self._started(breaks)
        return self._first[breaks]

    def _started(self, breaks: Breaks) -> First:
        patch, rectangles = self.region.panels(breaks)
        clips = self.region.clip(patch, rectangles)
        layout = self._laid(patch[clips.kept], clips)
        beside = side_points(self.region, layout.patch, clips.rectangles)
        lon, lat = (
            np.concatenate([at_nodes.ravel(), at_sides.ravel()])
            for at_nodes, at_sides in zip((layout.lon, layout.lat), beside, strict=True)
        )
        return First(clips, layout, lon, lat)

    def layout(self, patch: IntArray, clips: Clips) -> Layout:
        """The layout of clipped panels of patches (n,)."""
        keys = [(number, *sides) for number, sides in zip(patch.tolist(), clips.rectangles.tolist(), strict=True)]
        kept = self._kept
        new = [i for i, key in enumerate(keys) if key not in kept]
        if new:
            index = np.array(new)
            layout = self._laid(patch[index], Clips(*(values[index] for values in clips)))
            if len(new) == len(keys) and len(kept) + len(new) > _MOST:
                return layout
            found = {keys[i]: (layout.grids[:, k].copy(), layout.numbers[k]) for k, i in enumerate(new)}
            if len(kept) + len(new) <= _MOST:
                kept.update(found)
            else:
                kept = kept | found
        blocks = [kept[key] for key in keys]
        return Layout(patch, np.stack([grid for grid, _ in blocks], axis=1), np.array([one for _, one in blocks]))

    def _laid(self, patch: IntArray, clips: Clips) -> Layout:
        u0, u1, v0, v1 = clips.rectangles.T[..., None, None]
        half_u, half_v = 0.5 * (u1 - u0), 0.5 * (v1 - v0)
        shape = (len(patch), NODES.size, NODES.size)
        u = np.broadcast_to(u0 + half_u * (1.0 + NODES[:, None]), shape)
        v = np.broadcast_to(v0 + half_v * (1.0 + NODES), shape)
        partials = (half_u, 0.0, 0.0, half_v)
        return lay(self.region, self.ellipsoid, patch, u, v, partials, clips.rule, clips.whole)


@functools.lru_cache(maxsize=_REGIONS)  # compared maps, and those of an optimisation, have a region in common
def plan_of(region: Region, ellipsoid: Ellipsoid) -> Plan:
    """The plan of a region."""
    return Plan(region, ellipsoid)
