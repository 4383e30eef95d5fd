"""The largest value of a goal along the edges of polygons, on the polynomial pieces that the edges cross."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.extremes.goals import Goal
from projdist.field.extremes.polynomials import Polynomials
from projdist.field.extremes.quadratics import OFFSETS, bounds_on_lines
from projdist.numerics import DIFFERENTIATE, NODES
from projdist.regions import height_of, latitude_of

_LEVELS = 20
_MOST = 1024  # intervals at a level
_BATCH = 4000
_NEWTON = 6  # steps from the chart to a bent piece's square, which a rectangle needs none of
_BEYOND = 1e-9
_LAST_NODE = float(NODES[-1])


@dataclass(frozen=True)
class Border:
    """The intervals of edges within pieces: each of a piece, from one place in degrees to another."""

    piece: IntArray
    start: FloatArray  # (n, 2), lon and lat
    end: FloatArray

    @staticmethod
    def joined(parts: Sequence[Border]) -> Border:
        """Several as one."""
        nobody = Border(np.empty(0, dtype=int), np.empty((0, 2)), np.empty((0, 2)))
        everyone = [nobody, *parts]
        return Border(*(np.concatenate([getattr(one, field.name) for one in everyone]) for field in fields(Border)))

    def take(self, index: IntArray | BoolArray) -> Border:
        """Some of them."""
        return Border(self.piece[index], self.start[index], self.end[index])

    def halves(self) -> Border:
        """All of them, halved."""
        middle = 0.5 * (self.start + self.end)
        return Border(
            np.concatenate([self.piece, self.piece]),
            np.concatenate([self.start, middle]),
            np.concatenate([middle, self.end]),
        )

    def at(self, offset: FloatArray) -> FloatArray:
        """Places (n, q, 2) at offsets (n, q) or (q,) in [-1, 1]."""
        share = 0.5 * (1.0 + offset)[..., None]
        return self.start[:, None] * (1.0 - share) + self.end[:, None] * share


def climb(
    goal: Goal, pieces: Polynomials, border: Border, error: FloatArray, known: float, exact: float
) -> tuple[float, FloatArray]:
    """An upper bound along a border, and the largest value seen with its place: (value, lon, lat).

    `error` (n,) is that of the goal in each of all pieces.
    """
    best = np.array([-np.inf, np.nan, np.nan])
    bound = last = -np.inf
    for _ in range(_LEVELS):
        upper = np.empty(len(border.piece))
        for start in range(0, len(upper), _BATCH):
            part = border.take(np.arange(start, min(start + _BATCH, len(upper))))
            upper[start : start + _BATCH], best = _look(goal, pieces, part, best)
        reached = np.minimum(upper + error[border.piece], goal.limit)
        known = max(known, best[0] - float(error[border.piece].max(initial=0.0)))
        open_ = (reached > known + exact) & (upper > best[0] + exact)
        if open_.sum() > _MOST:
            open_[np.argsort(-np.where(open_, reached, -np.inf), kind="stable")[_MOST:]] = False
        bound = max(bound, float(reached[~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, best
        last = float(reached[open_].max())
        border = border.take(open_).halves()
    return max(bound, last), best


def _look(goal: Goal, pieces: Polynomials, border: Border, best: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Upper bounds on intervals, and the largest value seen, by now, with its place."""
    places = border.at(OFFSETS)
    values = _values(goal, pieces, border.piece, places)
    upper, t = bounds_on_lines(values)
    higher = border.at(t[:, None])
    places = np.concatenate([places, higher], axis=1)
    values = np.concatenate([values, _values(goal, pieces, border.piece, higher)], axis=1)
    row, column = np.unravel_index(int(values.argmax()), values.shape)
    if values[row, column] > best[0]:
        best = np.array([values[row, column], *places[row, column]])
    return np.where(np.isfinite(values).any(axis=1), upper, -np.inf), best


def _values(goal: Goal, pieces: Polynomials, piece: IntArray, places: FloatArray) -> FloatArray:
    """The goal at places (n, q, 2) of pieces (n,); -inf beyond them."""
    u, v = places[..., 0], np.empty(places.shape[:-1])
    for patch in np.unique(pieces.patch[piece]):
        mine = pieces.patch[piece] == patch
        v[mine] = height_of(int(patch), places[mine, :, 1])
    r, s = _square(pieces, piece, u, v)
    beyond = np.maximum(np.abs(r), np.abs(s)) > 1.0 + _BEYOND
    return np.where(beyond, -np.inf, goal.of(pieces.at(piece, np.clip(r, -1.0, 1.0), np.clip(s, -1.0, 1.0))))


def _square(pieces: Polynomials, piece: IntArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From chart coordinates (n, q) to those of the pieces' squares."""
    west, east, low, high = pieces.rectangle[piece].T[:, :, None]
    r, s = (2.0 * u - west - east) / (east - west), (2.0 * v - low - high) / (high - low)
    bent = np.flatnonzero(~pieces.straight[piece])
    if bent.size:
        r[bent], s[bent] = _by_newton(pieces.take(piece[bent]), u[bent], v[bent])
    return r, s


def _by_newton(pieces: Polynomials, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same on pieces (n,) whose sides are curves; places beyond them stay beyond."""
    chart = np.stack([pieces.u, pieces.v], axis=1)
    coordinates = np.concatenate([chart, DIFFERENTIATE @ chart, chart @ DIFFERENTIATE.T], axis=1)
    bent = replace(pieces, field=coordinates)
    r, s = np.zeros(u.shape), np.zeros(u.shape)
    everyone = np.arange(len(u))
    for _ in range(_NEWTON):
        there = bent.at(everyone, r, s)
        du, dv = u - there[..., 0], v - there[..., 1]
        u_r, v_r, u_s, v_s = np.moveaxis(there[..., 2:], -1, 0)
        det = u_r * v_s - u_s * v_r
        det = np.where(det != 0.0, det, 1.0)
        r = np.clip(r + (v_s * du - u_s * dv) / det, -1.5, 1.5)
        s = np.clip(s + (u_r * dv - v_r * du) / det, -1.5, 1.5)
    return r, s


def _box(pieces: Polynomials, number: int) -> tuple[FloatArray, FloatArray]:
    """The south-western and the north-eastern corner, in degrees, of what holds a piece."""
    u, v = pieces.u[number], pieces.v[number]
    sides = []
    for values in (u, v):
        half = 0.5 * np.ptp(values) / _LAST_NODE
        middle = 0.5 * (values.max() + values.min())
        sides.append((middle - half, middle + half))
    lats = np.sort(latitude_of(int(pieces.patch[number]), np.array(sides[1])))
    return np.array([sides[0][0], lats[0]]), np.array([sides[0][1], lats[1]])


def near(pieces: Polynomials, number: int, edges: FloatArray) -> BoolArray:
    """Which edges (m, 4) may cross the box about a piece."""
    low, high = _box(pieces, number)
    start, end = edges[:, :2], edges[:, 2:]
    return np.asarray(((np.minimum(start, end) <= high) & (np.maximum(start, end) >= low)).all(axis=1))


def crossing(pieces: Polynomials, number: int, edges: FloatArray) -> Border:
    """The parts of edges (m, 4) in the box about a piece."""
    low, high = _box(pieces, number)
    start, way = edges[:, :2], edges[:, 2:] - edges[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        gates = np.sort(np.stack([(low - start) / way, (high - start) / way]), axis=0)
    first = np.nan_to_num(gates[0], nan=-np.inf).max(axis=1).clip(0.0, 1.0)[:, None]
    last = np.nan_to_num(gates[1], nan=np.inf).min(axis=1).clip(0.0, 1.0)[:, None]
    crosses = (first <= last)[:, 0]
    first, last, start, way = first[crosses], last[crosses], start[crosses], way[crosses]
    return Border(np.full(len(start), number), start + first * way, start + last * way)
