"""Cells that cover polygons, with area and centroid of the polygons' part in each.

All cells of a generation are quartered at once. A cell keeps the edges inside it, and gates: the latitudes on its
eastern side at which the polygons begin and end. Area and centroid are integrals over the latitude, along the edges,
of primitives in the longitude (Green's theorem), and linear in the gates.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist import regions  # loads shapely when it is needed
from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.regions.region import SLIVER, Region, height_of, patch_chart, tightened

_ENOUGH = 0.6  # of the requested number of cells
_GENERATIONS = 20  # of halvings: more than the digits of a point allow
# Nodes along an edge, or a side of a cell, of at most 40 degrees, for areas to 4e-8.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_SHARES, _WEIGHTS = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS


class Cells(NamedTuple):
    """Rectangles (n, 4) of a chart, with centroids u, v and areas in m^2 of the region's parts in them."""

    patch: IntArray
    rectangle: FloatArray
    u: FloatArray
    v: FloatArray
    area: FloatArray

    def take(self, kept: BoolArray) -> Cells:
        """The cells that a mask keeps."""
        return Cells._make(values[kept] for values in self)

    def joined(self, other: Cells) -> Cells:
        """These cells and others."""
        return Cells(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


@functools.lru_cache(maxsize=16)  # consecutive searches use the same region
def cells_of(region: Region, ellipsoid: Ellipsoid, count: int) -> Cells:
    """About `count` cells that cover polygons, made by splitting the largest until there are enough."""
    parts = _panels(region)
    cells, parts = parts.measured(ellipsoid)
    done = cells.take(np.zeros(cells.area.size, dtype=bool))
    for _ in range(_GENERATIONS):
        if done.area.size + cells.area.size >= _ENOUGH * count:
            break
        large = cells.area > (done.area.sum() + cells.area.sum()) / count
        done = done.joined(cells.take(~large))
        cells, parts = parts.take(large).quarters().measured(ellipsoid)
    cells = done.joined(cells)
    for values in cells:
        values.flags.writeable = False
    return cells


class _Gates(NamedTuple):
    """Latitudes on the eastern sides of cells at which the polygons begin (change > 0) or end, going north."""

    cell: IntArray
    lat: FloatArray
    change: FloatArray

    @staticmethod
    def of(cell: IntArray, lat0: FloatArray, lat1: FloatArray) -> _Gates:
        """Gates of intervals between two latitudes each."""
        one = np.ones(cell.size)
        return _Gates(np.tile(cell, 2), np.concatenate([lat0, lat1]), np.concatenate([one, -one]))

    def joined(self, other: _Gates) -> _Gates:
        """These gates and others."""
        return _Gates(*(np.append(one, two) for one, two in zip(self, other, strict=True)))

    def merged(self) -> _Gates:
        """Gates with the changes at equal latitudes summed, without zeros."""
        order = np.lexsort((self.lat, self.cell))
        cell, lat, change = self.cell[order], self.lat[order], self.change[order]
        if not cell.size:
            return self
        first = np.flatnonzero(np.append(True, (cell[1:] != cell[:-1]) | (lat[1:] != lat[:-1])))
        total = np.add.reduceat(change, first)
        kept = first[total != 0.0]
        return _Gates(cell[kept], lat[kept], total[total != 0.0])


@dataclass(frozen=True)
class _Parts:
    """The polygons' parts in rectangles (n, 4) of patches: edges (m, 4), the cell of each, and gates."""

    patch: IntArray
    rectangle: FloatArray
    edges: FloatArray
    cell: IntArray
    gates: _Gates

    def take(self, kept: BoolArray) -> _Parts:
        """The cells that a mask keeps."""
        number = np.cumsum(kept) - 1
        within, beside = kept[self.cell], kept[self.gates.cell]
        gates = _Gates(number[self.gates.cell[beside]], self.gates.lat[beside], self.gates.change[beside])
        return _Parts(self.patch[kept], self.rectangle[kept], self.edges[within], number[self.cell[within]], gates)

    def quarters(self) -> _Parts:
        """Each cell in four, in the order south-west, south-east, north-west, north-east."""
        u0, u1, v0, v1 = self.rectangle.T
        u, v = 0.5 * (u0 + u1), 0.5 * (v0 + v1)
        parts = [(u0, u, v0, v), (u, u1, v0, v), (u0, u, v, v1), (u, u1, v, v1)]
        lat = _latitudes(self.patch, v)
        flipped = _latitudes(self.patch, v1) < lat  # north of 80 degrees v runs south
        edges, cell = _divided(self.edges, self.cell, 0, u)
        edges, cell = _divided(edges, cell, 1, lat)
        east = edges[:, 0] + edges[:, 2] >= 2.0 * u[cell]
        above = (edges[:, 1] + edges[:, 3] >= 2.0 * lat[cell]) != flipped[cell]
        quarter = 4 * cell + 2 * above
        gates = _halved(self.gates, lat, flipped)
        western = gates._replace(cell=4 * (gates.cell // 2) + 2 * (gates.cell % 2))
        runs = _Gates.of(quarter[east], edges[east, 1], edges[east, 3])
        gates = western._replace(cell=western.cell + 1).joined(western).joined(runs)
        inner = ~(east & (edges[:, 0] == u[cell]) & (edges[:, 2] == u[cell])) & (edges[:, 1] != edges[:, 3])
        return _Parts(
            np.repeat(self.patch, 4),
            np.stack([np.stack(part, axis=-1) for part in parts], axis=1).reshape(-1, 4),
            edges[inner],
            (quarter + east)[inner],
            gates.merged(),
        )

    def measured(self, ellipsoid: Ellipsoid) -> tuple[Cells, _Parts]:
        """The non-empty cells, tightened, and their parts."""
        n = len(self.patch)
        held = (np.bincount(self.cell, minlength=n) + np.bincount(self.gates.cell, minlength=n)) > 0
        parts = self.take(held)._tight()
        area, at_u, at_v = parts._moments(ellipsoid)
        u0, u1, v0, v1 = parts.rectangle.T
        south, north = (ellipsoid.area_below(_latitudes(parts.patch, v)) for v in (v0, v1))
        kept = area > SLIVER * np.radians(u1 - u0) * np.abs(north - south)
        parts, area = parts.take(kept), area[kept]
        u, v = u0[kept] + at_u[kept] / area, v0[kept] + at_v[kept] / area
        return Cells(parts.patch, parts.rectangle, u, v, area), parts

    def _tight(self) -> _Parts:
        """The parts in rectangles shrunk to the polygons, in latitude as by `tightened`."""
        n = len(self.patch)
        u0, u1, v0, v1 = self.rectangle.T.copy()
        edges, gates = self.edges, self.gates
        least, most = np.full(n, np.inf), np.full(n, -np.inf)
        np.minimum.at(least, self.cell, np.minimum(edges[:, 0], edges[:, 2]))
        np.maximum.at(most, self.cell, np.maximum(edges[:, 0], edges[:, 2]))
        gated = np.bincount(gates.cell, minlength=n) > 0
        u1[~gated] = most[~gated]
        western = _Gates.of(self.cell, edges[:, 1], edges[:, 3]).joined(gates).merged()
        bare = np.bincount(western.cell, minlength=n) == 0
        u0[bare] = least[bare]
        low, high = np.full(n, np.inf), np.full(n, -np.inf)
        for cell, lat in ((self.cell, edges[:, 1]), (self.cell, edges[:, 3]), (gates.cell, gates.lat)):
            np.minimum.at(low, cell, lat)
            np.maximum.at(high, cell, lat)
        low, high = np.sort([_heights(self.patch, low), _heights(self.patch, high)], axis=0)
        for i in np.flatnonzero((low > v0) | (high < v1)):
            v0[i], v1[i] = tightened(v0[i], v1[i], low[i], high[i])
        parts = _Parts(self.patch, np.stack([u0, u1, v0, v1], axis=-1), edges, self.cell, gates)
        return parts.take((u1 > u0) & (v1 > v0))

    def _moments(self, ellipsoid: Ellipsoid) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The integrals of 1, u - u0 and v - v0 over the area of each cell's part."""
        u0, u1, v0, _ = self.rectangle.T
        lon0, lat0, lon1, lat1 = self.edges.T
        u = lon0[:, None] + (lon1 - lon0)[:, None] * _SHARES - u0[self.cell, None]
        by_area, by_v = self._along(ellipsoid, self.cell, lat0, lat1, v0)
        moments = [np.sum(values, axis=1) for values in (u * by_area, 0.5 * u * u * by_area, u * by_v)]
        # Of gates: primitives at their ends, that of v - v0 counted from the end of the rectangle.
        cell, lat, change = self.gates
        width = (u1 - u0)[cell]
        below = -change * ellipsoid.area_below(lat) * np.radians(1.0)
        _, by_v = self._along(ellipsoid, cell, _latitudes(self.patch, v0)[cell], lat, v0)
        at_gates = [width * below, 0.5 * width * width * below, -change * width * by_v.sum(axis=1)]
        n = len(self.patch)
        area, at_u, at_v = (
            np.asarray(np.bincount(self.cell, one, n) + np.bincount(cell, two, n), dtype=float)
            for one, two in zip(moments, at_gates, strict=True)
        )
        return area, at_u, at_v

    def _along(
        self, ellipsoid: Ellipsoid, cell: IntArray, lat0: FloatArray, lat1: FloatArray, v0: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Area per degree of longitude times the weights at Gauss nodes between latitudes; the same times v - v0."""
        lat = lat0[:, None] + (lat1 - lat0)[:, None] * _SHARES
        meridian, vertical = ellipsoid.radii(lat)
        degree = np.radians(1.0)
        by_area = meridian * vertical * np.cos(degree * lat) * _WEIGHTS * (degree**2 * (lat1 - lat0))[:, None]
        return by_area, by_area * (_heights(self.patch[cell], lat) - v0[cell, None])


def _panels(region: Region) -> _Parts:
    """The parts of the region's panels."""
    patch, rectangle = region.panels()
    ends = np.sort([_latitudes(patch, rectangle[:, 2]), _latitudes(patch, rectangle[:, 3])], axis=0)
    whole = regions.polygons.Clip(region.edges, np.empty((0, 2)))
    sides = zip(rectangle.tolist(), *ends.tolist(), strict=True)
    found = [regions.polygons.clip(whole, u0, u1, south, north) for (u0, u1, _, _), south, north in sides]
    edges, gates = (np.concatenate([part[k] for part in found]) for k in (0, 1))
    cell, beside = (np.repeat(np.arange(len(patch)), [len(part[k]) for part in found]) for k in (0, 1))
    return _Parts(patch, rectangle, edges, cell, _Gates.of(beside, *gates.T).merged())


def _divided(edges: FloatArray, cell: IntArray, axis: int, at: FloatArray) -> tuple[FloatArray, IntArray]:
    """The edges, split where they cross their cell's longitude (axis 0) or latitude (1)."""
    line = at[cell]
    before, after = edges[:, axis] - line, edges[:, 2 + axis] - line
    crossing = np.flatnonzero(before * after < 0.0)
    crossed = edges[crossing]
    share = (before[crossing] / (before - after)[crossing])[:, None]
    middle = crossed[:, :2] + share * (crossed[:, 2:] - crossed[:, :2])
    middle[:, axis] = line[crossing]
    first = edges.copy()
    first[crossing, 2:] = middle
    return np.concatenate([first, np.hstack([middle, crossed[:, 2:]])]), np.append(cell, cell[crossing])


def _halved(gates: _Gates, lat: FloatArray, flipped: BoolArray) -> _Gates:
    """Gates of the halves of cells i, numbered 2 i and 2 i + 1 in the order of v."""
    middle, cell = lat[gates.cell], 2 * gates.cell
    low = gates._replace(cell=cell + flipped[gates.cell], lat=np.minimum(gates.lat, middle))
    high = gates._replace(cell=cell + ~flipped[gates.cell], lat=np.maximum(gates.lat, middle))
    return low.joined(high)


def _latitudes(patch: IntArray, v: FloatArray) -> FloatArray:
    """Latitudes at v in patches."""
    return np.asarray(patch_chart(patch, v, v).lat)


def _heights(patch: IntArray, lat: FloatArray) -> FloatArray:
    """v at latitudes (n, ...) in patches (n,)."""
    found = lat
    for number in np.unique(patch[patch != 0]):
        chosen = (patch == number).reshape(-1, *(1,) * (lat.ndim - 1))
        found = np.where(chosen, height_of(int(number), lat), found)
    return found
