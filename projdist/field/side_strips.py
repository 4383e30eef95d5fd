"""Strips along the sides of panels, where a seam may run between the last nodes and a side.

None of a panel's nodes would see it. The first panels of a region are as wide as half the globe, and their last nodes
are 2.3 degrees from their sides; a smaller panel comes of a larger one that has seen what is in it.
"""

from __future__ import annotations

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.numerics import LEGENDRE, NODES, ORDER
from projdist.projections import Projection
from projdist.regions import Region

__all__ = ["side_points", "torn_sides", "with_strips"]

_DEEPEST = 8  # strips of strips: each is a 38th as wide, the last one rounding
_INSET = 1e-9  # of half a panel: a seam on the side itself does no harm
_CHOSEN = [1, 4, 8]
_LINES = NODES[_CHOSEN]
_SIDES = np.array([_INSET - 1.0, 1.0 - _INSET])
_STATIONS = np.concatenate([_SIDES, NODES])
_EXTRAPOLATE = np.polynomial.legendre.legvander(_SIDES, ORDER - 1) @ LEGENDRE
_LAST = LEGENDRE[-2:]
_STRIP = 1.0 + NODES[0]  # of half a panel: as far as the first node
_LEAST = 1e-3  # of the semi-major axis; a smaller jump over so small a strip does not matter
_EIGHTHS = np.arange(9.0)[:, None] / 8.0
_DIVISIONS, _MOST_OF_IT = 4, 0.1
_UNRESOLVED = 10.0  # times the last coefficients; what is left out of series that fall slowly is as large


def side_points(region: Region, patch: IntArray, rectangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n, 2, 2, 3) of points just within the sides of panels, on lines through their nodes.

    For lines along u and along v, at the low and at the high side.
    """
    along_u = _places(rectangles, 0, _SIDES)
    along_v = _places(rectangles, 1, _SIDES)
    u, v = (np.stack(pair, axis=1) for pair in zip(along_u, along_v, strict=True))
    points = region.chart(patch[:, None, None, None], u, v)
    return np.asarray(points.lon), np.asarray(points.lat)


def torn_sides(
    projection: Projection,
    region: Region,
    patch: IntArray,
    rectangles: FloatArray,
    nodes: FloatArray,
    sides: FloatArray,
) -> BoolArray:
    """Whether the map is another at the sides of panels than its nodes tell: (n, 2, 2), by u and v, low and high.

    `nodes` (2, n, p, p) are x and y at the nodes, `sides` (2, n, 2, 2, 3) those at `side_points`.
    """
    lines = np.stack([nodes[..., _CHOSEN], nodes[..., _CHOSEN, :].swapaxes(-1, -2)], axis=2)
    return _torn(projection, region, patch, rectangles, sides, lines)


def with_strips(
    projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray, torn: BoolArray
) -> tuple[IntArray, FloatArray, int]:
    """Panels (n, 4) with the strips cut off in which there is a seam, and the evaluations that it took to know.

    `torn` is what `torn_sides` knows of them.
    """
    finished: list[tuple[IntArray, FloatArray]] = []
    evaluations = 0
    for turn in range(_DEEPEST):
        if turn:
            torn = _probed(projection, region, patch, rectangles)
            evaluations += 2 * len(patch) * len(_LINES) * len(_STATIONS)
        hit = torn.any(axis=(1, 2))
        finished.append((patch[~hit], rectangles[~hit]))
        patch, rectangles = patch[hit], rectangles[hit]
        if not len(patch):
            break
        index, rectangles = _divided(rectangles, torn[hit])
        patch = patch[index]
    else:
        finished.append((patch, rectangles))
    return np.concatenate([one for one, _ in finished]), np.concatenate([one for _, one in finished]), evaluations


def _probed(projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray) -> BoolArray:
    """`torn_sides` of panels of which nothing is known yet."""
    both = [_places(rectangles, axis, _STATIONS) for axis in (0, 1)]
    u, v = (np.stack(pair, axis=1) for pair in zip(*both, strict=True))
    points = region.chart(patch[:, None, None, None], u, v)
    f = np.stack(projection(points.lon, points.lat))
    return _torn(projection, region, patch, rectangles, f[..., : len(_SIDES), :], f[..., len(_SIDES) :, :])


def _torn(
    projection: Projection,
    region: Region,
    patch: IntArray,
    rectangles: FloatArray,
    sides: FloatArray,
    nodes: FloatArray,
) -> BoolArray:
    """Of x and y on lines along u and v, at the sides (2, n, 2, 2, k) and at the nodes (2, n, 2, p, k)."""
    jump_x, jump_y = sides - _EXTRAPOLATE @ nodes
    jump = np.hypot(jump_x, jump_y)
    last = np.hypot(*np.abs(_LAST @ nodes).max(axis=-2))
    a = projection.ellipsoid.a
    suspect = jump > np.maximum(_LEAST * a, _UNRESOLVED * last[..., None, :])
    if not suspect.any():
        return np.zeros(suspect.shape[:-1], dtype=bool)
    for axis in (0, 1):
        panel, side, line = np.nonzero(suspect[:, axis])
        if not panel.size:
            continue
        # From the last node to the side.
        u, v = _places(rectangles, axis, _STATIONS)
        last = np.where(side == 0, 0, NODES.size - 1)
        places = [(each[panel, side, line], each[panel, len(_SIDES) + last, line]) for each in (u, v)]
        values = sides[:, panel, axis, side, line], nodes[:, panel, axis, last, line]
        left = _left(projection, region, patch[panel], np.array(places), np.stack(values, axis=1))
        suspect[panel, axis, side, line] = left > _MOST_OF_IT * jump[panel, axis, side, line]
    return np.asarray(suspect.any(axis=-1))


def _places(rectangles: FloatArray, axis: int, stations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u and v (n, k, 3) at stations in [-1, 1] on lines through panels along u (0) or v (1)."""
    shares = (stations[:, None], _LINES) if axis == 0 else (_LINES, stations[:, None])
    u, v = np.broadcast_arrays(*(_at(rectangles[:, 2 * k : 2 * k + 2], shares[k]) for k in (0, 1)))
    return u, v


def _left(
    projection: Projection, region: Region, patch: IntArray, places: FloatArray, values: FloatArray
) -> FloatArray:
    """What is left of the steps between places u, v (2, 2, n), with x, y (2, 2, n) there, in a tiny part of them.

    It is the part with the largest step of eight, again and again: a kink or a steep place leaves next to nothing, a
    tear all of it.
    """
    ends, f = places, values
    rows = np.arange(len(patch))
    for _ in range(_DIVISIONS):
        u, v = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * _EIGHTHS
        points = region.chart(patch, u[1:-1], v[1:-1])
        between = np.stack(projection(points.lon, points.lat))
        f = np.concatenate([f[:, :1], between, f[:, 1:]], axis=1)
        step = np.nan_to_num(np.hypot(*np.diff(f, axis=1)), nan=-1.0)
        most = step.argmax(axis=0)
        both = np.stack([most, most + 1])
        ends, f = np.stack([u, v])[:, both, rows], f[:, both, rows]
    return np.asarray(np.hypot(*(f[:, 1] - f[:, 0])))


def _at(ends: FloatArray, share: FloatArray) -> FloatArray:
    """Coordinates at shares in [-1, 1] of intervals (n, 2), the intervals on the first of three axes."""
    low, high = (ends[:, k].reshape(-1, 1, 1) for k in (0, 1))
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * share)


def _divided(rectangles: FloatArray, torn: BoolArray) -> tuple[IntArray, FloatArray]:
    """Each rectangle's number, and the parts into which the strips along its torn sides, (n, 2, 2), divide it."""
    index, parts = [], []
    for k, (rectangle, sides) in enumerate(zip(rectangles, torn, strict=True)):
        edges = []
        for axis in (0, 1):
            low, high = rectangle[2 * axis : 2 * axis + 2]
            width = 0.5 * (high - low) * _STRIP
            inner = [at for at, cut in zip((low + width, high - width), sides[axis], strict=True) if cut]
            edges.append([low, *inner, high])
        for u0, u1 in zip(edges[0][:-1], edges[0][1:], strict=True):
            for v0, v1 in zip(edges[1][:-1], edges[1][1:], strict=True):
                index.append(k)
                parts.append((u0, u1, v0, v1))
    return np.array(index, dtype=int), np.array(parts)
