"""The largest value of a goal on polynomial pieces: cells are halved until none can hold more than what was seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.extremes.goals import Goal
from projdist.field.extremes.polynomials import Polynomials
from projdist.field.extremes.quadratics import OFFSETS, bounds_on_cells

Inside = Callable[[IntArray, FloatArray, FloatArray], BoolArray]
"""Whether points at grids r by s of pieces are in the region."""

_LEVELS = 14
_MOST = 256  # cells at a level
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
    seen = _look(goal, pieces, chosen, cells, inside)
    best = seen.top.value.reshape(-1, 4).argmax(axis=1) + 4 * np.arange(len(chosen))
    return seen.upper.reshape(-1, 4).max(axis=1), Top(*(part[best] for part in seen.top))


def climb(
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
    for _ in range(_LEVELS):
        seen = _look(goal, pieces, chosen, cells, inside)
        _raise(top, cells.piece, seen.top)
        known = max(known, float((top.value - error).max()))
        reached = np.minimum(seen.upper + error[cells.piece], goal.limit)
        counts = seen.counts & np.isfinite(seen.top.value)
        open_ = counts & (reached > known + exact) & (seen.upper > top.value[cells.piece] + exact)
        if open_.sum() > _MOST:
            open_[np.argsort(-np.where(open_, reached, -np.inf), kind="stable")[_MOST:]] = False
        bound = max(bound, float(reached[counts & ~open_].max(initial=-np.inf)))
        if not open_.any():
            return bound, top
        last = float(reached[open_].max())
        cells = cells.quarters(open_)
    return max(bound, last), top


def _look(goal: Goal, pieces: Polynomials, chosen: IntArray, cells: _Cells, inside: Inside) -> _Seen:
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
