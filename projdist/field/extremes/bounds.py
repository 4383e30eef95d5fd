"""The largest value of a goal on polynomial pieces and along the edges of polygons."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.extremes.goals import Goal, Polynomials
from projdist.numerics import DIFFERENTIATE, NODES
from projdist.regions import height_of, latitude_of

OFFSETS = np.linspace(-1.0, 1.0, 5)  # of the values, in halves of a cell's width
_MARGIN = 3.0  # times the largest residual: enough for the tip of a cone, too

_T1, _T2 = (t.ravel() for t in np.meshgrid(OFFSETS, OFFSETS, indexing="ij"))


def _terms(t1: FloatArray, t2: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(t1), t1, t2, t1 * t1, t1 * t2, t2 * t2], axis=-1)


_DESIGN = _terms(_T1, _T2)
_FIT = np.linalg.pinv(_DESIGN)
_LINE_DESIGN = np.stack([np.ones(5), OFFSETS, OFFSETS**2], axis=-1)
_LINE_FIT = np.linalg.pinv(_LINE_DESIGN)


def bounds_on_cells(values: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Upper bounds (n,) from values (n, 5, 5), the offsets (n, 2) of the quadratics' maxima, and what may be flat.

    That is (n, 2), whether the function may be stationary in a cell along each of its two axes.
    """
    flat, spoilt = _mended(values.reshape(len(values), -1))
    c = flat @ _FIT.T
    rest = np.abs(flat - c @ _DESIGN.T).max(axis=1)
    t = _candidates(c)
    heights = (_terms(t[..., 0], t[..., 1]) * c[:, None]).sum(axis=-1)
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    most = 2.0 * np.abs(c[:, 3::2]) + np.abs(c[:, 4:5]) + 4.0 * rest[:, None]
    return upper, np.take_along_axis(t, best[..., None], axis=1)[:, 0], np.abs(c[:, 1:3]) <= most


def bounds_on_lines(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same on intervals from values (n, 5): upper bounds and offsets, each (n,)."""
    flat, spoilt = _mended(values)
    c = flat @ _LINE_FIT.T
    rest = np.abs(flat - c @ _LINE_DESIGN.T).max(axis=1)
    t = np.stack([_turn(c[:, 1], c[:, 2]), np.full(len(c), -1.0), np.ones(len(c))], axis=1)
    heights = c[:, :1] + c[:, 1:2] * t + c[:, 2:] * t * t
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    return upper, np.take_along_axis(t, best, axis=1)[:, 0]


def _mended(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values with the least finite one for those that are not, and what to add to a bound then: their spread."""
    finite = np.isfinite(values)
    low = np.where(finite, values, np.inf).min(axis=1, keepdims=True)
    low = np.where(np.isfinite(low), low, -(np.finfo(float).max ** 0.5))
    mended = np.where(finite, values, low)
    return mended, np.where(finite.all(axis=1), 0.0, np.ptp(mended, axis=1))


def _turn(slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Where slope t + bend t^2 turns, within [-1, 1]."""
    return np.clip(np.divide(-slope, 2.0 * bend, out=np.zeros_like(slope), where=bend != 0.0), -1.0, 1.0)


def _candidates(c: FloatArray) -> FloatArray:
    """Where in its square a quadratic may be largest (n, 9, 2): inside, on the sides, in the corners."""
    points = np.empty((len(c), 9, 2))
    det = 4.0 * c[:, 3] * c[:, 5] - c[:, 4] ** 2
    safe = np.where(det != 0.0, det, 1.0)
    points[:, 0, 0] = (c[:, 4] * c[:, 2] - 2.0 * c[:, 5] * c[:, 1]) / safe
    points[:, 0, 1] = (c[:, 4] * c[:, 1] - 2.0 * c[:, 3] * c[:, 2]) / safe
    points[:, 0] = np.clip(points[:, 0], -1.0, 1.0)
    for k, side in enumerate((-1.0, 1.0)):
        points[:, 1 + k, 0], points[:, 1 + k, 1] = side, _turn(c[:, 2] + side * c[:, 4], c[:, 5])
        points[:, 3 + k, 0], points[:, 3 + k, 1] = _turn(c[:, 1] + side * c[:, 4], c[:, 3]), side
    points[:, 5:] = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
    return points


# ---- on cells ------------------------------------------------------------------------------------


Inside = Callable[[IntArray, FloatArray, FloatArray], BoolArray]
"""Whether points at grids r by s of pieces are in the region."""

_CELL_LEVELS = 14
_MOST_CELLS = 256  # cells at a level
_ROUNDING = 1e-9


class Top(NamedTuple):
    """Largest values seen in some pieces, and their places in the pieces' squares."""

    value: FloatArray
    r: FloatArray
    s: FloatArray


@dataclass(frozen=True)
class _Cells:
    """Squares about r, s in pieces' squares, all of the same size."""

    piece: IntArray  # among the pieces that are searched
    r: FloatArray
    s: FloatArray
    half: float

    @staticmethod
    def of(count: int) -> _Cells:
        """The quarters of whole pieces."""
        return _Cells(np.arange(count), np.zeros(count), np.zeros(count), 1.0).quarters(np.ones(count, dtype=bool))

    def quarters(self, some: BoolArray) -> _Cells:
        half = 0.5 * self.half
        where = np.array([(i, j) for i in (-half, half) for j in (-half, half)])
        return _Cells(
            np.repeat(self.piece[some], 4),
            (self.r[some, None] + where[:, 0]).ravel(),
            (self.s[some, None] + where[:, 1]).ravel(),
            half,
        )


class _Seen(NamedTuple):
    """What is known of cells: bounds, largest values within the region and their places."""

    upper: FloatArray
    counts: BoolArray  # whether the goal may be largest in it, and not where the region ends
    top: Top


def reach(goal: Goal, pieces: Polynomials, chosen: IntArray, inside: Inside) -> tuple[FloatArray, Top]:
    """Upper bounds over whole pieces, whatever the region leaves of them, and what was seen in it."""
    cells = _Cells.of(len(chosen))
    seen = _look_at_cells(goal, pieces, chosen, cells, inside)
    best = seen.top.value.reshape(-1, 4).argmax(axis=1) + 4 * np.arange(len(chosen))
    return seen.upper.reshape(-1, 4).max(axis=1), Top(*(part[best] for part in seen.top))


def climb_cells(
    goal: Goal, pieces: Polynomials, chosen: IntArray, error: FloatArray, inside: Inside, known: float, exact: float
) -> tuple[float, Top]:
    """An upper bound over the pieces, and the largest values seen in each; to `exact` if the work is not too much.

    Of pieces that the region's edge crosses only peaks within the region count, and peaks on the pieces' own sides,
    where the map may be torn: what is largest elsewhere is so on the region's edge. `error` (n,) is that of the goal
    in each piece, `known` what it certainly reaches.
    """
    cells = _Cells.of(len(chosen))
    top = Top(np.full(len(chosen), -np.inf), np.zeros(len(chosen)), np.zeros(len(chosen)))
    bound = -np.inf
    for _ in range(_CELL_LEVELS):
        seen = _look_at_cells(goal, pieces, chosen, cells, inside)
        _raise(top, cells.piece, seen.top)
        known = max(known, float((top.value - error).max()))
        reached = np.minimum(seen.upper + error[cells.piece], goal.limit)
        counts = seen.counts & np.isfinite(seen.top.value)
        open_ = counts & (reached > known + exact) & (seen.upper > top.value[cells.piece] + exact)
        if open_.sum() > _MOST_CELLS:
            open_[np.argsort(-np.where(open_, reached, -np.inf), kind="stable")[_MOST_CELLS:]] = False
        bound = max(bound, float(reached[counts & ~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, top
        last = float(reached[open_].max())
        cells = cells.quarters(open_)
    return max(bound, last), top


def _look_at_cells(goal: Goal, pieces: Polynomials, chosen: IntArray, cells: _Cells, inside: Inside) -> _Seen:
    piece = chosen[cells.piece]
    r, s = (middle[:, None] + cells.half * OFFSETS for middle in (cells.r, cells.s))
    values = goal.of(pieces.on_grids(piece, r, s))
    upper, t, level = bounds_on_cells(values)
    clipped = pieces.clipped[piece]
    if clipped.any():
        values[clipped] = np.where(inside(piece[clipped], r[clipped], s[clipped]), values[clipped], -np.inf)
    flat = values.reshape(len(values), -1)
    index = flat.argmax(axis=1)
    rows = np.arange(len(flat))
    best = Top(flat[rows, index], r[rows, index // len(OFFSETS)], s[rows, index % len(OFFSETS)])
    at = cells.r + cells.half * t[:, 0], cells.s + cells.half * t[:, 1]
    higher = goal.of(pieces.at(piece, *(place[:, None] for place in at)))[:, 0]
    if clipped.any():
        within = inside(piece[clipped], *(place[clipped, None] for place in at))[:, 0, 0]
        higher[clipped] = np.where(within, higher[clipped], -np.inf)
    better = higher > best.value
    top = Top(*(np.where(better, new, old) for new, old in zip((higher, *at), best, strict=True)))
    sides = np.abs(np.stack([cells.r, cells.s], axis=-1)) + cells.half >= 1.0 - _ROUNDING
    return _Seen(upper, (level | sides).all(axis=1) | ~clipped, top)


def _raise(top: Top, piece: IntArray, new: Top) -> None:
    """Take over the largest values of pieces that are larger than those known."""
    order = np.argsort(new.value, kind="stable")  # the last one written is the largest
    order = order[new.value[order] > top.value[piece[order]]]
    for old, part in zip(top, new, strict=True):
        old[piece[order]] = part[order]


# ---- along edges of polygons ---------------------------------------------------------------------


_INTERVAL_LEVELS = 20
_MOST_INTERVALS = 1024  # intervals at a level
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


def climb_borders(
    goal: Goal, pieces: Polynomials, border: Border, error: FloatArray, known: float, exact: float
) -> tuple[float, FloatArray]:
    """An upper bound along a border, and the largest value seen with its place: (value, lon, lat).

    `error` (n,) is that of the goal in each of all pieces.
    """
    best = np.array([-np.inf, np.nan, np.nan])
    bound = last = -np.inf
    for _ in range(_INTERVAL_LEVELS):
        upper = np.empty(len(border.piece))
        for start in range(0, len(upper), _BATCH):
            part = border.take(np.arange(start, min(start + _BATCH, len(upper))))
            upper[start : start + _BATCH], best = _look_at_intervals(goal, pieces, part, best)
        reached = np.minimum(upper + error[border.piece], goal.limit)
        known = max(known, best[0] - float(error[border.piece].max(initial=0.0)))
        open_ = (reached > known + exact) & (upper > best[0] + exact)
        if open_.sum() > _MOST_INTERVALS:
            open_[np.argsort(-np.where(open_, reached, -np.inf), kind="stable")[_MOST_INTERVALS:]] = False
        bound = max(bound, float(reached[~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, best
        last = float(reached[open_].max())
        border = border.take(open_).halves()
    return max(bound, last), best


def _look_at_intervals(
    goal: Goal, pieces: Polynomials, border: Border, best: FloatArray
) -> tuple[FloatArray, FloatArray]:
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
