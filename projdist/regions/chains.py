"""Polygons as chains of edges: clipped to rectangles, and integrated over by Green's theorem.

A chain is an array (m, 4) of edges lon0, lat0, lon1, lat1 in degrees, straight in longitude and
latitude, with the polygon on their left. Clipping moves everything outside a rectangle onto its
sides. The winding number about inner points stays, so that no intersection of polygons and
rectangles is ever computed, and degenerate ones do no harm. The integral of a polynomial over the
polygon becomes one along the chain, and is exact.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.numerics import LEGENDRE, NODES, ORDER, WEIGHTS

Side = Callable[[FloatArray], FloatArray]

# Gauss points along an edge. The integrand is a polynomial of degree 2 p - 1 on the square, for which p points are
# exact; on shorter edges (in halves of the square's side) fewer suffice for 1e-15.
_POINTS = ((0.004, 3), (0.06, 6), (np.inf, 2 * ORDER))
_AT_ONCE = 20_000  # edges: 40 MB
_gauss = functools.cache(np.polynomial.legendre.leggauss)


class Clip(NamedTuple):
    """The part of a chain in a rectangle of longitudes and latitudes.

    `edges` (m, 4) are those inside, `gates` (k, 2) the intervals of latitude in which the polygon
    touches the eastern side. Edges on the other sides contribute nothing to an integral over latitude.
    """

    edges: FloatArray
    gates: FloatArray

    @property
    def empty(self) -> bool:
        """True if the polygon has no part in the rectangle."""
        return not len(self.edges) and not len(self.gates)


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


def extent(part: Clip, west: float, east: float, south: float, north: float) -> tuple[float, float, float, float]:
    """West, east, south, north of a part of a rectangle."""
    edges, gates = part
    lats = np.concatenate([edges[:, 1::2], gates])
    if not len(gates):
        east = float(edges[:, 0::2].max())
    # On the western side the polygon lies where the edges east of it do not cancel.
    if not len(_intervals(lats)):
        west = float(edges[:, 0::2].min())
    return west, east, float(lats.min()), float(lats.max())


def closed(part: Clip, west: float, east: float) -> FloatArray:
    """All edges of a part, including those on the sides of its rectangle but not along parallels."""
    edges, gates = part
    western = _intervals(np.concatenate([edges[:, 1::2], gates]))[:, ::-1]
    sides = [
        np.column_stack([np.full(len(lats), lon), lats[:, 0], np.full(len(lats), lon), lats[:, 1]])
        for lon, lats in ((east, gates), (west, western))
    ]
    return np.concatenate([edges, *sides])


def divided(edges: FloatArray, pieces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Ends of equal pieces of edges, `pieces` of each: longitudes (2, k) and latitudes (2, k)."""
    index = np.repeat(np.arange(len(pieces)), pieces)
    number = np.arange(len(index)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = np.stack([number, number + 1]) / pieces[index]
    lon0, lat0, lon1, lat1 = edges[index].T
    return lon0 * (1.0 - share) + lon1 * share, lat0 * (1.0 - share) + lat1 * share


def is_whole(part: Clip, south: float, north: float) -> bool:
    """True if the rectangle lies in the polygon."""
    edges, gates = part
    return not len(edges) and float(np.sum(gates[:, 1] - gates[:, 0])) >= (north - south) * (1.0 - 1e-13)


def area_km2(edges: FloatArray, ellipsoid: Ellipsoid) -> float:
    """Area on an ellipsoid on the left of a closed chain, by Green's theorem."""
    # In pieces of 10 degrees, for which the nodes are exact to rounding.
    pieces = np.ceil(np.abs(edges[:, 3] - edges[:, 1]) / 10.0).clip(1).astype(int)
    (lon0, lon1), (lat0, lat1) = divided(edges, pieces)
    total = 0.0
    for part in _some(len(lat0)):
        below = ellipsoid.area_below(lat0[part, None] + (lat1 - lat0)[part, None] * 0.5 * (1.0 + NODES))
        total += float(np.sum(np.radians(lon0 - lon1)[part] * (below @ WEIGHTS) * 0.5))
    return total / 1e6


def _some(count: int) -> Iterator[slice]:
    """Slices of edges that bound the memory."""
    return (slice(first, first + _AT_ONCE) for first in range(0, count, _AT_ONCE))


def weights(part: Clip, to_r: Side, to_s: Side, to_lat: Side) -> FloatArray:
    """Weights (p, p) of the Gauss nodes of a square, with which polynomials integrate exactly over the polygon.

    `to_r` maps longitudes to [-1, 1], linearly; `to_s` latitudes to [-1, 1], and `to_lat` back. The
    weights may be negative: the integral is that of the polynomial through the nodes.
    """
    edges, gates = part
    moments = np.zeros((ORDER, ORDER))
    # On the eastern side the integrals of all Legendre polynomials but the first vanish.
    moments[0] = 2.0 * np.sum(_primitives(to_s(gates[:, 1])) - _primitives(to_s(gates[:, 0])), axis=0)
    s0, s1 = to_s(edges[:, 1]), to_s(edges[:, 3])
    width = np.maximum(np.abs(to_r(edges[:, 2]) - to_r(edges[:, 0])), np.abs(s1 - s0))
    shortest = 0.0
    for longest, points in _POINTS:
        chosen = np.flatnonzero((shortest <= width) & (width < longest))
        for few in _some(len(chosen)):
            some = chosen[few]
            moments += _along(edges[some], s0[some], s1[some], to_r, to_lat, points)
        shortest = longest
    sign = 1.0 if to_lat(np.array(1.0)) > to_lat(np.array(-1.0)) else -1.0
    return sign * LEGENDRE.T @ moments @ LEGENDRE


def _along(edges: FloatArray, s0: FloatArray, s1: FloatArray, to_r: Side, to_lat: Side, points: int) -> FloatArray:
    """Integrals (p, p) over s of the primitives in r of products of Legendre polynomials."""
    nodes, gauss = _gauss(points)
    share = 0.5 * (1.0 + nodes)
    s = s0[:, None] + (s1 - s0)[:, None] * share
    lon0, lat0, lon1, lat1 = (edges[:, k, None] for k in range(4))
    along = np.clip((to_lat(s) - lat0) / (lat1 - lat0), 0.0, 1.0)
    r = to_r(lon0 + (lon1 - lon0) * along)
    ds = 0.5 * (s1 - s0)[:, None] * gauss
    in_s = np.polynomial.legendre.legvander(s.ravel(), ORDER - 1)
    return (_primitives(r.ravel()) * ds.ravel()[:, None]).T @ in_s


def _primitives(t: FloatArray) -> FloatArray:
    """Integrals from -1 to t of the Legendre polynomials, shape (n, p): (P_k+1 - P_k-1) / (2 k + 1)."""
    P = np.polynomial.legendre.legvander(t, ORDER)
    result = np.empty((*t.shape, ORDER))
    result[..., 0] = t + 1.0
    result[..., 1:] = (P[..., 2:] - P[..., :-2]) / (2.0 * np.arange(1, ORDER) + 1.0)
    return result
