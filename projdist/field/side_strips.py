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

__all__ = ["with_strips"]

_DEEPEST = 8  # strips of strips: each is a 38th as wide, the last one rounding
_INSET = 1e-9  # of half a panel: a seam on the side itself does no harm
_LINES = NODES[[1, 4, 8]]
_SIDES = np.array([_INSET - 1.0, 1.0 - _INSET])
_STATIONS = np.concatenate([_SIDES, NODES])
_EXTRAPOLATE = np.polynomial.legendre.legvander(_SIDES, ORDER - 1) @ LEGENDRE
_STRIP = 1.0 + NODES[0]  # of half a panel: as far as the first node
_LEAST = 1e-3  # of the semi-major axis; a smaller jump over so small a strip does not matter
_HALVINGS, _MOST_OF_IT = 12, 0.1
_UNRESOLVED = 10.0  # times the last coefficients; what is left out of series that fall slowly is as large


def with_strips(
    projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray
) -> tuple[IntArray, FloatArray, int]:
    """Panels (n, 4) with the strips cut off in which there is a seam, and the evaluations that it took to know."""
    finished: list[tuple[IntArray, FloatArray]] = []
    evaluations = 0
    for _ in range(_DEEPEST):
        torn = np.stack([_torn_sides(projection, region, patch, rectangles, axis) for axis in (0, 1)], axis=1)
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


def _torn_sides(
    projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray, axis: int
) -> BoolArray:
    """Whether the map is another at the low and at the high side, (n, 2), than its nodes along u (0) or v (1) tell."""
    shares = (_STATIONS[:, None], _LINES) if axis == 0 else (_LINES, _STATIONS[:, None])
    u, v = np.broadcast_arrays(*(_at(rectangles[:, 2 * k : 2 * k + 2], shares[k]) for k in (0, 1)))
    points = region.chart(patch[:, None, None], u, v)
    f = np.stack(projection(points.lon, points.lat)) / projection.ellipsoid.a
    sides, nodes = f[:, :, :2], f[:, :, 2:]
    jump = np.hypot(*(sides - _EXTRAPOLATE @ nodes))
    last = np.hypot(*np.abs((LEGENDRE @ nodes)[:, :, -2:]).max(axis=2))
    with np.errstate(invalid="ignore"):
        suspect = jump > np.maximum(_LEAST, _UNRESOLVED * last[:, None])
    if not suspect.any():
        return np.zeros((len(patch), 2), dtype=bool)
    panel, side, line = np.nonzero(suspect)
    first = np.where(side == 0, 2, len(_STATIONS) - 1)
    ends = np.array([[u[panel, k, line], v[panel, k, line]] for k in (side, first)])
    suspect[suspect] = _tears(projection, region, patch[panel], ends) > _MOST_OF_IT * jump[suspect]
    return np.asarray(suspect.any(axis=2))


def _tears(projection: Projection, region: Region, patch: IntArray, ends: FloatArray) -> FloatArray:
    """What is left, in semi-major axes, of the step from one end to another, (2, 2, n) u and v, in a tiny part of it.

    The part is found by halving: a kink or a steep place leaves next to nothing, a tear all of it.
    """

    def coordinates(place: FloatArray) -> FloatArray:
        points = region.chart(patch, *place)
        return np.stack(projection(points.lon, points.lat)) / projection.ellipsoid.a

    low, high = ends
    f_low, f_high = coordinates(low), coordinates(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        f = coordinates(middle)
        upper = np.hypot(*(f_high - f)) > np.hypot(*(f - f_low))
        low, f_low = np.where(upper, middle, low), np.where(upper, f, f_low)
        high, f_high = np.where(upper, high, middle), np.where(upper, f_high, f)
    return np.asarray(np.hypot(*(f_high - f_low)))


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
