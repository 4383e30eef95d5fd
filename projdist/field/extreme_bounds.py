"""Upper bounds of a measure where the Jacobian is a polynomial: on pieces of a region, and along edges of polygons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.panels import Pieces, Rows, lay, pieces_of, second_derivatives
from projdist.matrices import Measure
from projdist.numerics import DIFFERENTIATE, LEGENDRE, NODES, ORDER, PLANE_WEIGHTS
from projdist.projections import Projection
from projdist.regions import Region, height_of, latitude_of


@dataclass(frozen=True)
class Goal:
    """A measure, its `values` (n, p, p) at the nodes, and whether its largest or its smallest value is wanted."""

    measure: Measure
    values: FloatArray
    largest: bool = True

    @property
    def sign(self) -> float:
        """1 or -1: the measure times this is maximised."""
        return 1.0 if self.largest else -1.0

    @property
    def limit(self) -> float:
        """Largest value that the measure times the sign has on any map."""
        low, high = self.measure.limits
        return high if self.largest else -low

    def of(self, field: FloatArray) -> FloatArray:
        """The measure times the sign, -inf where undefined, from entries of J, and of H if needed, on the last axis."""
        J = field[..., :4].reshape(*field.shape[:-1], 2, 2)
        H = field[..., 4:].reshape(*field.shape[:-1], 2, 2, 2) if self.measure.needs_hessian else None
        return defined(self.sign * self.measure(J, H))

    def change(self, field: FloatArray, error: FloatArray) -> FloatArray:
        """Error of the measure for fields (n, k) and errors of their entries; infinite where it becomes undefined."""
        k = field.shape[-1] if self.measure.needs_hessian else 4
        moved = np.where(np.eye(k, dtype=bool), error[..., None, :k], 0.0)
        moved = np.stack([field[..., None, :k] + moved, field[..., None, :k] - moved])
        with np.errstate(invalid="ignore", over="ignore"):
            changes = np.abs(self.of(moved) - self.of(field)[..., None]).max(axis=0)
        return np.where(np.isnan(changes), np.inf, changes).sum(axis=-1)


def defined(values: FloatArray) -> FloatArray:
    """Values, with -inf where they are not finite."""
    return np.where(np.isfinite(values), values, -np.inf)


# ---- the Jacobian as polynomials -----------------------------------------------------------------

_SLOPE = 50.0  # of the first Legendre polynomial left out, at the ends: ORDER (ORDER + 1) / 2 = 55
_BENT = 1e3  # the second derivative there
# Times the last coefficients: smooth fields leave out less; rounding in all coefficients adds up to that in a corner.
_LEFT_OUT = 4.0
_HALVES = 0.5 * NODES - 0.5, 0.5 * NODES + 0.5


@dataclass(frozen=True, kw_only=True)
class Polynomials(Rows):
    """Polynomials through the nodes of n pieces: chart coordinates, and the k entries of J, or of J and H."""

    patch: IntArray
    u: FloatArray  # (n, p, p)
    v: FloatArray
    field: FloatArray  # (n, k, p, p)
    error: FloatArray  # (n, k), of each entry anywhere in the piece
    clipped: BoolArray  # whether the region ends within the piece
    size: FloatArray  # half of its width in m, about

    def on_grids(self, piece: IntArray, r: FloatArray, s: FloatArray) -> FloatArray:
        """The fields at grids r (m, q) by s (m, q) of pieces (m,), entries last: (m, q, q, k)."""
        values = basis(r)[:, None] @ self.field[piece] @ basis(s)[:, None].swapaxes(-1, -2)
        return np.moveaxis(values, 1, -1)

    def at(self, piece: IntArray, r: FloatArray, s: FloatArray) -> FloatArray:
        """The fields at points r, s (m, q) of pieces (m,), entries last: (m, q, k)."""
        at_r, at_s = basis(r)[:, None], basis(s)[:, None]
        return np.moveaxis(((at_r @ self.field[piece]) * at_s).sum(axis=-1), 1, -1)

    def places(self, piece: IntArray, r: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The chart coordinates u and v at grids r (m, q) by s (m, q), each (m, q, q)."""
        at_r, at_s = basis(r), basis(s).swapaxes(-1, -2)
        return at_r @ self.u[piece] @ at_s, at_r @ self.v[piece] @ at_s

    def quarters(self, projection: Projection, region: Region, piece: IntArray) -> Polynomials:
        """The four quarters of some pieces, sampled again: those of the first piece, those of the second, ..."""
        where = [(r, s) for r in _HALVES for s in _HALVES]
        u, v = (
            np.stack([basis(r) @ values[piece] @ basis(s).T for r, s in where], axis=1).reshape(-1, ORDER, ORDER)
            for values in (self.u, self.v)
        )
        patch, n = np.repeat(self.patch[piece], 4), 4 * len(piece)
        partials = (DIFFERENTIATE @ u, u @ DIFFERENTIATE.T, DIFFERENTIATE @ v, v @ DIFFERENTIATE.T)
        rule, whole, curved = np.broadcast_to(PLANE_WEIGHTS, u.shape), np.ones(n, dtype=bool), self.field.shape[1] > 4
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            layout = lay(region, projection.ellipsoid, patch, u, v, partials, rule, whole)
            new = pieces_of(projection, np.arange(n), layout, curved=curved)
            H = second_derivatives(new, projection.ellipsoid) * projection.ellipsoid.a if curved else new.hessian
        return polynomials_of(new, H, np.repeat(self.clipped[piece], 4))


def polynomials_of(nodes: Pieces, H: FloatArray, clipped: BoolArray) -> Polynomials:
    """The polynomials through J, and H if it is known, at the nodes of pieces, with their errors."""
    shape, doubt = nodes.u.shape, nodes.doubt.sum(axis=-1)
    entries = [values.reshape(*shape, -1) for values in (nodes.jacobian, H) if values.size]
    field = np.ascontiguousarray(np.moveaxis(np.concatenate(entries, axis=-1), -1, 1))
    with np.errstate(invalid="ignore", over="ignore"):
        along = np.stack([np.abs(LEGENDRE @ field).max(axis=3), np.abs(field @ LEGENDRE.T).max(axis=2)], axis=-2)
        error = _LEFT_OUT * along[..., ORDER - 2 :].max(axis=-1).sum(axis=-1)
        scale = np.sqrt(0.5 * (field[:, :4] ** 2).sum(axis=1).mean(axis=(1, 2)))
        error[:, :4] += (_SLOPE * doubt * scale)[:, None]
        if field.shape[1] > 4:
            error[:, 4:] += (_BENT * doubt * np.abs(field[:, 4:]).max(axis=(1, 2, 3)))[:, None]
    error, size = np.nan_to_num(error, nan=np.inf), np.sqrt(nodes.density.max(axis=(1, 2)))
    return Polynomials(patch=nodes.patch, u=nodes.u, v=nodes.v, field=field, error=error, clipped=clipped, size=size)


def basis(t: FloatArray) -> FloatArray:
    """The matrix (..., p) from values at the nodes to the polynomial's values at t (...)."""
    return np.polynomial.legendre.legvander(t, ORDER - 1) @ LEGENDRE


# ---- quadratics ----------------------------------------------------------------------------------

OFFSETS = np.linspace(-1.0, 1.0, 5)  # of the values, in halves of a cell's width
_MARGIN = 3.0  # times the largest residual: enough for the tip of a cone, too

_T1, _T2 = (t.ravel() for t in np.meshgrid(OFFSETS, OFFSETS, indexing="ij"))
_DESIGN = np.stack([np.ones_like(_T1), _T1, _T2, _T1 * _T1, _T1 * _T2, _T2 * _T2], axis=-1)
_FIT = np.linalg.pinv(_DESIGN)
_LINE_DESIGN = np.stack([np.ones(5), OFFSETS, OFFSETS**2], axis=-1)
_LINE_FIT = np.linalg.pinv(_LINE_DESIGN)


def bounds_on_cells(values: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Upper bounds (n,) on cells from values (n, 5, 5), their places, and axes (n, 2) that may have a turning point."""
    flat, spoilt = _mended(values.reshape(len(values), -1))
    c = flat @ _FIT.T
    rest = np.abs(flat - c @ _DESIGN.T).max(axis=1)
    t = _candidates(c)
    t1, t2 = t[..., 0], t[..., 1]
    heights = (np.stack([np.ones_like(t1), t1, t2, t1 * t1, t1 * t2, t2 * t2], axis=-1) * c[:, None]).sum(axis=-1)
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    most = 2.0 * np.abs(c[:, 3::2]) + np.abs(c[:, 4:5]) + 4.0 * rest[:, None]
    return upper, np.take_along_axis(t, best[..., None], axis=1)[:, 0], np.abs(c[:, 1:3]) <= most


def bounds_on_lines(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Upper bounds and offsets of the maxima on intervals, each (n,), from values (n, 5)."""
    flat, spoilt = _mended(values)
    c = flat @ _LINE_FIT.T
    rest = np.abs(flat - c @ _LINE_DESIGN.T).max(axis=1)
    t = np.stack([_turn(c[:, 1], c[:, 2]), np.full(len(c), -1.0), np.ones(len(c))], axis=1)
    heights = c[:, :1] + c[:, 1:2] * t + c[:, 2:] * t * t
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    return upper, np.take_along_axis(t, best, axis=1)[:, 0]


def _mended(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values with the least finite one in place of others, and their spread if there were others, to add to bounds."""
    finite = np.isfinite(values)
    low = np.where(finite, values, np.inf).min(axis=1, keepdims=True)
    low = np.where(np.isfinite(low), low, -(np.finfo(float).max ** 0.5))
    mended = np.where(finite, values, low)
    return mended, np.where(finite.all(axis=1), 0.0, np.ptp(mended, axis=1))


def _turn(slope: FloatArray, bend: FloatArray) -> FloatArray:
    """The t in [-1, 1] nearest to where slope t + bend t^2 turns."""
    return np.clip(np.divide(-slope, 2.0 * bend, out=np.zeros_like(slope), where=bend != 0.0), -1.0, 1.0)


def _candidates(c: FloatArray) -> FloatArray:
    """The points (n, 9, 2) of a square at which a quadratic may be largest: inside, on the sides, in the corners."""
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
"""True where points at grids r by s of pieces are in the region."""

_CELL_LEVELS = 14
_MOST_CELLS = 1024  # cells at a level
_ROUNDING = 1e-9


class Top(NamedTuple):
    """Largest values seen in some pieces, and their places in the pieces' squares."""

    value: FloatArray
    r: FloatArray
    s: FloatArray


class _Cells(NamedTuple):
    """Squares about r, s in the squares of pieces, all of the same size."""

    piece: IntArray  # among the pieces that are searched
    r: FloatArray
    s: FloatArray
    half: float

    @staticmethod
    def of(count: int) -> _Cells:
        return _Cells(np.arange(count), np.zeros(count), np.zeros(count), 1.0).quarters()

    def quarters(self) -> _Cells:
        half = 0.5 * self.half
        where = np.array([(i, j) for i in (-half, half) for j in (-half, half)])
        r, s = ((middle[:, None] + where[:, k]).ravel() for k, middle in enumerate((self.r, self.s)))
        return _Cells(np.repeat(self.piece, 4), r, s, half)


def reach(goal: Goal, pieces: Polynomials, chosen: IntArray, inside: Inside) -> tuple[FloatArray, Top]:
    """Upper bounds over whole pieces, even beyond the region, and the largest values seen within it."""
    upper, _, top = _look_at_cells(goal, pieces, chosen, _Cells.of(len(chosen)), inside)
    best = top.value.reshape(-1, 4).argmax(axis=1) + 4 * np.arange(len(chosen))
    return upper.reshape(-1, 4).max(axis=1), Top(*(part[best] for part in top))


def climb_cells(
    goal: Goal, pieces: Polynomials, chosen: IntArray, error: FloatArray, inside: Inside, known: float, exact: float
) -> tuple[float, Top]:
    """An upper bound over pieces, to `exact` if that is not too much work, and the largest value seen in each."""
    # In pieces that the region's edge crosses only peaks in the region count, and peaks on the pieces' sides, where the
    # map may be torn; `climb_borders` sees the edge. `error` (n,) is the goal's, `known` a value it surely reaches.
    cells = _Cells.of(len(chosen))
    top = Top(np.full(len(chosen), -np.inf), np.zeros(len(chosen)), np.zeros(len(chosen)))
    bound = -np.inf
    for _ in range(_CELL_LEVELS):
        upper, counts, seen = _look_at_cells(goal, pieces, chosen, cells, inside)
        order = np.argsort(seen.value, kind="stable")  # the last one written is the largest
        order = order[seen.value[order] > top.value[cells.piece[order]]]
        for old, new in zip(top, seen, strict=True):
            old[cells.piece[order]] = new[order]
        known = max(known, float((top.value - error).max()))
        reached = np.minimum(upper + error[cells.piece], goal.limit)
        counts &= np.isfinite(seen.value)
        open_ = counts & (reached > known + exact) & (upper > top.value[cells.piece] + exact)
        _close_but(_MOST_CELLS, open_, reached)
        bound = max(bound, float(reached[counts & ~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, top
        last = float(reached[open_].max())
        cells = _Cells(cells.piece[open_], cells.r[open_], cells.s[open_], cells.half).quarters()
    return max(bound, last), top


def _close_but(most: int, open_: BoolArray, reached: FloatArray) -> None:
    """Leave open only the parts with the highest bounds, no more than `most`."""
    if open_.sum() > most:
        open_[np.argsort(-np.where(open_, reached, -np.inf), kind="stable")[most:]] = False


def _look_at_cells(
    goal: Goal, pieces: Polynomials, chosen: IntArray, cells: _Cells, inside: Inside
) -> tuple[FloatArray, BoolArray, Top]:
    """Bounds of a goal on cells, a mask of cells with a peak or a side, and its largest values within the region."""
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
    return upper, (level | sides).all(axis=1) | ~clipped, top


# ---- along edges of polygons ---------------------------------------------------------------------

_INTERVAL_LEVELS = 20
_MOST_INTERVALS = 1024  # intervals at a level
_BATCH = 4000
_NEWTON = 6  # steps from the chart to a bent piece's square; rectangles need none
_BEYOND = 1e-9
_LAST_NODE = float(NODES[-1])


@dataclass(frozen=True)
class Border(Rows):
    """Intervals of edges, each within a piece, from one place in degrees to another."""

    piece: IntArray
    start: FloatArray  # (n, 2), lon and lat
    end: FloatArray

    def at(self, offset: FloatArray) -> FloatArray:
        """Places (n, q, 2) at offsets (n, q) or (q,) in [-1, 1]."""
        share = 0.5 * (1.0 + offset)[..., None]
        return self.start[:, None] * (1.0 - share) + self.end[:, None] * share


def climb_borders(
    goal: Goal, pieces: Polynomials, border: Border, error: FloatArray, known: float, exact: float
) -> tuple[float, FloatArray]:
    """An upper bound along a border, and the largest value seen with lon and lat; `error` (n,) is of all pieces."""
    best = np.array([-np.inf, np.nan, np.nan])
    bound = last = -np.inf
    for _ in range(_INTERVAL_LEVELS):
        upper = np.empty(len(border.piece))
        for start in range(0, len(upper), _BATCH):
            part = border.take(np.arange(start, min(start + _BATCH, len(upper))))
            places = part.at(OFFSETS)
            values = _values(goal, pieces, part.piece, places)
            most, t = bounds_on_lines(values)
            higher = part.at(t[:, None])
            places = np.concatenate([places, higher], axis=1)
            values = np.concatenate([values, _values(goal, pieces, part.piece, higher)], axis=1)
            row, column = np.unravel_index(int(values.argmax()), values.shape)
            if values[row, column] > best[0]:
                best = np.array([values[row, column], *places[row, column]])
            upper[start : start + _BATCH] = np.where(np.isfinite(values).any(axis=1), most, -np.inf)
        reached = np.minimum(upper + error[border.piece], goal.limit)
        known = max(known, best[0] - float(error[border.piece].max(initial=0.0)))
        open_ = (reached > known + exact) & (upper > best[0] + exact)
        _close_but(_MOST_INTERVALS, open_, reached)
        bound = max(bound, float(reached[~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, best
        last = float(reached[open_].max())
        border = border.take(open_)
        middle = 0.5 * (border.start + border.end)
        border = Border.joined([replace(border, end=middle), replace(border, start=middle)])
    return max(bound, last), best


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
    """Coordinates r, s in the pieces' squares of chart coordinates u, v (n, q)."""
    ends = []
    for own in (pieces.u, pieces.v):  # as if they were rectangles in the chart, with sides along its axes
        first, last = own[:, 0, 0], own[:, -1, -1]
        middle, half = 0.5 * (first + last), 0.5 * (last - first) / _LAST_NODE
        ends += [middle - half, middle + half]
    west, east, low, high = np.stack(ends)[:, piece, None]
    r, s = (2.0 * u - west - east) / (east - west), (2.0 * v - low - high) / (high - low)
    off = np.ptp(pieces.u, axis=2).max(axis=1) + np.ptp(pieces.v, axis=1).max(axis=1)
    straight = off <= 1e-12 * (np.ptp(pieces.u, axis=(1, 2)) + np.ptp(pieces.v, axis=(1, 2)))
    bent = np.flatnonzero(~straight[piece])
    if bent.size:
        r[bent], s[bent] = _by_newton(pieces.take(piece[bent]), u[bent], v[bent])
    return r, s


def _by_newton(pieces: Polynomials, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates r, s in pieces (n,) whose sides are curves; places outside stay outside."""
    chart = np.stack([pieces.u, pieces.v], axis=1)
    bent = replace(pieces, field=np.concatenate([chart, DIFFERENTIATE @ chart, chart @ DIFFERENTIATE.T], axis=1))
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


def box_about(pieces: Polynomials, number: int) -> tuple[FloatArray, FloatArray]:
    """The south-western and the north-eastern corner, in degrees, of a box that holds a piece."""
    (west, east), ends = (
        0.5 * (values.max() + values.min()) + 0.5 * np.ptp(values) / _LAST_NODE * np.array([-1.0, 1.0])
        for values in (pieces.u[number], pieces.v[number])
    )
    south, north = np.sort(latitude_of(int(pieces.patch[number]), ends))
    return np.array([west, south]), np.array([east, north])


def crossing(pieces: Polynomials, number: int, edges: FloatArray) -> Border:
    """The parts of edges (m, 4) in the box about a piece."""
    low, high = box_about(pieces, number)
    start, way = edges[:, :2], edges[:, 2:] - edges[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        gates = np.sort(np.stack([(low - start) / way, (high - start) / way]), axis=0)
    first = np.nan_to_num(gates[0], nan=-np.inf).max(axis=1).clip(0.0, 1.0)[:, None]
    last = np.nan_to_num(gates[1], nan=np.inf).min(axis=1).clip(0.0, 1.0)[:, None]
    crosses = (first <= last)[:, 0]
    first, last, start, way = first[crosses], last[crosses], start[crosses], way[crosses]
    return Border(np.full(len(start), number), start + first * way, start + last * way)
