"""Cutting panels along the seams and edges of a map.

A seam or an edge of the map that crosses a panel from side to side is found by bisection on each line of nodes. It is
a smooth curve, so that either side of it is a smooth patch: interrupted and limited maps converge like whole ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.panels import Partials, Pieces, lay, pieces_of
from projdist.numerics import DIFFERENTIATE, LEGENDRE, NODES, PLANE_WEIGHTS
from projdist.projections import Projection
from projdist.regions import Region

TEAR = 1e-4  # of the semi-major axis; smaller jumps are PROJ's own (eck4 snaps to its pole line by 2e-5)
_SLIVER = 1e-13  # of a slice: a smaller part of the region in it is rounding
_TRIAL, _REST = 7, 29  # halvings: a few distinguish steep places from tears, all locate a tear to 1e-11 of the panel
_STATIONS = np.concatenate([[-1.0], NODES, [1.0]])


def jumps(xy: FloatArray, smallest: float) -> BoolArray:
    """True for panels in which the speed of x, y (2, n, p, p) along either axis breaks out between two nodes."""
    # It does so if it is out of line with its neighbours by more than twice what they differ, or eight times at either
    # end. Smooth maps do that only where they are already resolved. `smallest` is the least jump that counts, in m.
    found = np.zeros(xy.shape[1], dtype=bool)
    gap = np.diff(NODES)
    for f in (xy, xy.swapaxes(-1, -2)):
        speeds = np.diff(f, axis=-1) / gap
        change = np.hypot(*np.diff(speeds, axis=-1))
        outbreak = np.hypot(*(speeds[..., 1:-1] - 0.5 * (speeds[..., :-2] + speeds[..., 2:])))
        around = np.hypot(*(speeds[..., 2:] - speeds[..., :-2]))
        inside = (outbreak > 2.0 * around) & (outbreak * gap[1:-1] > smallest)
        at_ends = (change[..., [0, -1]] > 8.0 * change[..., [1, -2]]) & (change[..., [0, -1]] * gap[0] > smallest)
        found |= inside.any(axis=(-1, -2)) | at_ends.any(axis=(-1, -2))
    return found


@dataclass
class Cuts:
    """Result of trying to cut n panels."""

    pieces: list[Pieces]  # in place of the panels of the mask `done`
    done: BoolArray
    # (n, 2), u and v at which to split panels: where the seam leaves one that could not be cut, beside or across the
    # seam of one that was; NaN for a direction in which a split would not help.
    split_at: FloatArray
    evaluations: int


def cut(
    projection: Projection,
    region: Region,
    panel: IntArray,
    patch: IntArray,
    rectangles: FloatArray,
    whole: BoolArray,
    *,
    curved: bool,
) -> Cuts:
    """Cut panels along the seam or the map's edge that crosses them; `whole` panels lie within the region."""
    n = len(rectangles)
    result = Cuts([], np.zeros(n, dtype=bool), np.full((n, 2), np.nan), 0)
    for along in (1, 0):
        todo = np.flatnonzero(~result.done)
        if not todo.size:
            return result
        lines = _Lines(projection, region, patch[todo], rectangles[todo], along, NODES)
        where, kind = lines.find_cuts(result, every=True)
        kind = np.where((kind == kind[:, :1]).all(axis=1), kind[:, 0], _NONE)
        for side, how in ((lines.low, _SEAM), (lines.low, _END), (lines.high, _SEAM), (lines.high, _START)):
            index = np.flatnonzero(kind == how)
            if index.size:
                own, grades = todo[index], _WHOLE if how == _SEAM else _GRADES
                some = lines.take(index), panel[own], whole[own], side[index], where[index]
                slices = _slices(*some, grades, curved=curved)
                result.pieces.extend(slices)
                result.evaluations += sum(piece.lon.size for piece in slices)
        cut_now = np.flatnonzero(kind != _NONE)
        result.done[todo[cut_now]] = True
        result.split_at[todo[cut_now], along] = lines.beside(where)[cut_now]
        result.split_at[todo[cut_now], 1 - along] = lines.middle_across[cut_now]
    todo = np.flatnonzero(~result.done)
    if todo.size:
        exits = [_exit(_Lines(projection, region, patch[todo], rectangles[todo], k, _SIDES), result) for k in (0, 1)]
        at = np.stack([exits[0][0], exits[1][0]], axis=-1)
        # Split in one direction only, at the more central of the two exits.
        at[np.arange(len(at)), np.argmin([exits[0][1], exits[1][1]], axis=0)] = np.nan
        result.split_at[todo] = at
    return result


# What happens along a line: no single cut; the map ends; the map starts; the map is torn.
_NONE, _END, _START, _SEAM = range(4)
_SIDES = np.array([-1.0, 1.0]) * (1.0 - 1e-9)  # the sides of a panel, as seen from within


@dataclass
class _Lines:
    """Lines through panels along u (0) or v (1), at `shares` in [-1, 1] of the other direction."""

    projection: Projection
    region: Region
    patch: IntArray
    rectangles: FloatArray
    along: int
    shares: FloatArray

    def __post_init__(self) -> None:
        self.low, self.high = self.rectangles.T[2 * self.along : 2 * self.along + 2]
        first, last = self.rectangles.T[2 - 2 * self.along : 4 - 2 * self.along]
        self.middle_across, self.half_across = 0.5 * (first + last), 0.5 * (last - first)
        self.across = self.middle_across[:, None] + self.half_across[:, None] * self.shares

    def take(self, index: IntArray) -> _Lines:
        """The lines of some of the panels."""
        return replace(self, patch=self.patch[index], rectangles=self.rectangles[index])

    def __call__(self, along: FloatArray) -> FloatArray:
        """f at positions (n, k) or (n, k, m) on the lines; shape (2, ...)."""
        across = self.across if along.ndim == 2 else self.across[..., None]
        across, along = np.broadcast_arrays(across, along)
        u, v = (across, along) if self.along == 1 else (along, across)
        points = self.region.chart(self.patch.reshape(-1, *[1] * (u.ndim - 1)), u, v)
        return np.stack(self.projection(points.lon, points.lat))

    def find_cuts(self, count: Cuts, *, every: bool) -> tuple[FloatArray, IntArray]:
        """Where each line (n, k) is cut, and how; `every` looks only at panels whose lines may all be cut."""
        half = 0.5 * (self.high - self.low)
        stations = (0.5 * (self.low + self.high)[:, None] + half[:, None] * _STATIONS)[:, None]
        stations = np.broadcast_to(stations, (*self.across.shape, _STATIONS.size))
        f = self(stations)
        valid = np.isfinite(f[0])
        changes = valid[..., 1:] != valid[..., :-1]
        edge = changes.sum(axis=-1) == 1
        step = np.nan_to_num(np.hypot(*np.diff(f, axis=-1)))
        interval = np.where(edge, np.argmax(changes, axis=-1), np.argmax(step, axis=-1))[..., None]

        def at(values: FloatArray, offset: int) -> FloatArray:
            return np.asarray(np.take_along_axis(values, interval + offset, axis=-1)[..., 0])

        a, b = at(stations, 0), at(stations, 1)
        fa, fb = (np.stack([at(f[0], k), at(f[1], k)]) for k in (0, 1))
        first = np.hypot(*(fb - fa))
        hopeful = edge | (valid.all(axis=-1) & (first > TEAR * self.projection.ellipsoid.a))
        count.evaluations += f[0].size
        for halvings in (_TRIAL, _REST):
            chosen = np.flatnonzero(hopeful.all(axis=1) if every else hopeful.any(axis=1))
            if not chosen.size:
                break
            bracket = a[chosen], b[chosen], fa[:, chosen], fb[:, chosen]
            bracket = self.take(chosen).halved(*bracket, edge[chosen], halvings)
            a[chosen], b[chosen], fa[:, chosen], fb[:, chosen] = bracket
            count.evaluations += halvings * a[chosen].size
            # A steep place shrinks with the interval, a tear does not.
            hopeful &= edge | (np.hypot(*(fb - fa)) > 0.1 * first)
        kind = np.where(hopeful, np.where(edge, np.where(valid[..., 0], _END, _START), _SEAM), _NONE)
        return 0.5 * (a + b), kind

    def halved(
        self, a: FloatArray, b: FloatArray, fa: FloatArray, fb: FloatArray, edge: BoolArray, halvings: int
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Brackets a, b (n, k) of the cuts, with f at their ends, made smaller."""
        for _ in range(halvings):
            middle = 0.5 * (a + b)
            fm = self(middle)
            nearer = np.hypot(*(fm - fa)) < np.hypot(*(fb - fm))
            beyond = np.where(edge, np.isfinite(fm[0]) == np.isfinite(fa[0]), nearer)
            a, b = np.where(beyond, middle, a), np.where(beyond, b, middle)
            fa, fb = np.where(beyond, fm, fa), np.where(beyond, fb, fm)
        return a, b, fa, fb

    def beside(self, where: FloatArray) -> FloatArray:
        """Where to split along the lines beside the cut: in the wider of the two gaps; NaN if neither is wide."""
        low, high = where.min(axis=1), where.max(axis=1)
        # The curve goes on beyond the outermost nodes.
        margin = 0.1 * (high - low) + 0.01 * (self.high - self.low)
        below, above = low - margin - self.low, self.high - high - margin
        at = np.where(below >= above, low - margin, high + margin)
        return np.where(np.maximum(below, above) > 0.2 * (self.high - self.low), at, np.nan)


def _exit(lines: _Lines, count: Cuts) -> tuple[FloatArray, FloatArray]:
    """Where a seam or edge leaves panels on either of two opposite sides (NaN if on neither), and how centrally."""
    where, kind = lines.find_cuts(count, every=False)
    share = (where - lines.low[:, None]) / (lines.high - lines.low)[:, None]
    # None so near to a corner that the split would be no gain.
    centrality = np.where(kind != _NONE, np.minimum(share, 1.0 - share), 0.0)
    best = np.argmax(centrality, axis=1)[:, None]
    exit_at, centrality = (np.take_along_axis(values, best, axis=1)[:, 0] for values in (where, centrality))
    return np.where(centrality > 1e-3, exit_at, np.nan), centrality


_WHOLE = np.array([0.0, 1.0])
# An edge often is a singular line of ln^2 b: slices of the piece, each a third as thick as the last, to 2e-7.
_GRADES = np.concatenate([1.0 - 3.0 ** -np.arange(15.0), [1.0]])


def _slices(
    lines: _Lines,
    panel: IntArray,
    whole: BoolArray,
    side: FloatArray,
    where: FloatArray,
    grades: FloatArray,
    *,
    curved: bool,
) -> list[Pieces]:
    """The pieces between a side of the panels, at `side` (n,) along the lines, and a cut at `where` (n, p) on them."""
    # The node axes are r in [-1, 1] across the lines, and s in [-1, 1] along them. In each slice t goes from one of the
    # grades to the next, 0 being the side and 1 the cut: along = side + t reach(r).
    reach = (where - side[:, None])[..., None]
    reach_r = (where @ DIFFERENTIATE.T)[..., None]
    across_r = lines.half_across[:, None, None]
    pieces = []
    for start, stop in pairwise(grades):
        t_s = 0.5 * (stop - start)
        t = start + t_s * (1.0 + NODES)
        along = side[:, None, None] + t * reach
        across = np.broadcast_to(lines.across[..., None], along.shape)
        along_r, along_s = t * reach_r, t_s * reach
        u, v = across, along
        partials: Partials = (across_r, 0.0, along_r, along_s)
        if lines.along == 0:  # the first node axis is that of u, as in whole panels: here that of s
            u, v = along.swapaxes(1, 2), across.swapaxes(1, 2)
            partials = (along_s.swapaxes(1, 2), along_r.swapaxes(1, 2), 0.0, across_r)
        rule, held = np.broadcast_to(PLANE_WEIGHTS, u.shape).copy(), whole.copy()
        for k in np.flatnonzero(~whole):
            square = _square(lines, int(k), float(side[k]), where[k], start, stop)
            rule[k] = lines.region.rule(int(lines.patch[k]), lines.rectangles[k], square)
            held[k] = rule[k].sum() > 4.0 * _SLIVER
        if not held.any():
            continue
        u_r, u_s, v_r, v_s = (p[held] if isinstance(p, np.ndarray) else p for p in partials)
        chart = lines.patch[held], u[held], v[held], (u_r, u_s, v_r, v_s)
        layout = lay(lines.region, lines.projection.ellipsoid, *chart, rule[held], whole[held])
        piece = pieces_of(lines.projection, panel[held], layout, curved=curved)
        piece.doubt[:] = 0.0  # its cause would be the tear, which is the cut
        pieces.append(piece)
    return pieces


def _square(
    lines: _Lines, k: int, side: float, where: FloatArray, start: float, stop: float
) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """The function from chart coordinates u, v to the node coordinates r, s in a slice of one panel."""
    middle, half, curve = float(lines.middle_across[k]), float(lines.half_across[k]), LEGENDRE @ where

    def to_square(u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        across, along = (u, v) if lines.along == 1 else (v, u)
        first = (across - middle) / half
        share = (along - side) / (np.polynomial.legendre.legval(first, curve) - side)
        second = 2.0 * (share - start) / (stop - start) - 1.0
        return (first, second) if lines.along == 1 else (second, first)

    return to_square
