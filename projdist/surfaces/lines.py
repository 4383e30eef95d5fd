"""Lines of longitude and latitude on a map, split where it is torn and drawn up to the seam."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.field import drawn, evaluate, find_tears
from projdist.surfaces.domain import POLE, Bounds, Domain, check_step, ground_size, longitude_width

_SMOOTH = 5e-4  # of the map's size; a chord that is farther off its arc is halved
_ROUNDS = 8
_LONGEST = 0.1  # of the map's size: next to a point where many seams meet, some may go unseen


def project_lines(domain: Domain, lines: Sequence[FloatArray], size: float) -> list[FloatArray]:
    """The images of lines of (lon, lat), as pieces of (x, y) of which none crosses a seam.

    `size` is the width or height of the map in metres; curves are smooth to a small part of it.
    """
    if not lines:
        return []
    line = np.repeat(np.arange(len(lines)), [len(points) for points in lines])
    points = evaluate(domain, *np.concatenate(lines).T)
    joined = np.flatnonzero(line[1:] == line[:-1])
    for _ in range(_ROUNDS):
        joined = joined[drawn(points[joined + 1]) | drawn(points[joined])]
        middle = evaluate(domain, *(0.5 * (points[joined, :2] + points[joined + 1, :2])).T)
        offset = middle[:, 2:] - 0.5 * (points[joined, 2:] + points[joined + 1, 2:])
        coarse = ~(np.hypot(*offset.T) <= _SMOOTH * size)
        if not coarse.any():
            break
        where = joined[coarse] + 1
        points = np.insert(points, where, middle[coarse], axis=0)
        line = np.insert(line, where, line[where], axis=0)
        added = where + np.arange(where.size)
        joined = np.column_stack([added - 1, added]).ravel()  # the halves: the others are smooth
    return _pieces(cut_at_tears(domain, points, line)[:, 2:], _LONGEST * size)


def cut_at_tears(domain: Domain, points: FloatArray, line: IntArray) -> FloatArray:
    """Points (n, 4) of numbered lines with NaN between the lines, and between the ends on both sides of each tear."""
    joined = np.flatnonzero(line[1:] == line[:-1])
    links = find_tears(domain, points[joined], points[joined + 1], domain.radius)
    torn = joined[links.torn]
    gap = np.full((torn.size, 1, 4), np.nan)
    ends = np.concatenate([links.start[links.torn][:, None], gap, links.stop[links.torn][:, None]], axis=1)
    last = np.flatnonzero(line[1:] != line[:-1]) + 1
    where = np.concatenate([np.repeat(torn + 1, 3), last])
    filling = np.concatenate([ends.reshape(-1, 4), np.full((last.size, 4), np.nan)])
    return np.insert(points, where, filling, axis=0)


def _pieces(xy: FloatArray, longest: float) -> list[FloatArray]:
    """The runs of two or more finite points, with no step that is longer than `longest`."""
    jumps = np.flatnonzero(np.hypot(*np.diff(xy, axis=0).T) > longest)
    xy = np.insert(xy, jumps + 1, np.nan, axis=0)
    finite = np.isfinite(xy[:, 0])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]]).astype(np.int8)))
    return [xy[start:stop] for start, stop in edges.reshape(-1, 2) if stop - start > 1]


_ROUND_STEPS = (
    *(m * 10.0**k / 3600.0 for k in range(-2, 1) for m in (1, 2, 5)),
    *(seconds / 3600.0 for seconds in (10, 20, 30)),
    *(minutes / 60.0 for minutes in (1, 2, 5, 10, 20, 30)),
    *(1.0, 2.0, 5.0, 10.0, 15.0, 30.0),
)
_ACROSS = 6
_MOST_LINES = 2000  # more cannot be told apart


def graticule_steps(bounds: Bounds, step: float | None = None) -> tuple[float, float]:
    """Degrees between meridians and between parallels: both as given, or round numbers for about six lines across.

    Raises ValueError where so many lines cannot be told apart.
    """
    if step is not None:
        check_step(step)
        count = (longitude_width(bounds) + bounds[3] - bounds[1]) / step
        if count > _MOST_LINES:
            raise ValueError(
                f"Invalid step '{step}'. It makes {count:,.0f} lines, and at most {_MOST_LINES:,} are drawn."
            )
        return step, step
    parallels = _round_step(max(ground_size(bounds)) / _ACROSS)
    return _round_step(parallels / np.cos(np.radians(0.5 * (bounds[1] + bounds[3])))), parallels


def _round_step(step: float) -> float:
    return min(_ROUND_STEPS, key=lambda candidate: abs(np.log(candidate / step)))


def graticule(bounds: Bounds, meridian_step: float, parallel_step: float) -> list[FloatArray]:
    """Meridians, then parallels at multiples of the steps in degrees, as lines of (lon, lat)."""
    west, south, _, north = bounds
    along = np.linspace(max(south, -POLE), min(north, POLE), 181)
    across = np.linspace(west, west + longitude_width(bounds), 361)
    meridians, parallels = graticule_values(bounds, meridian_step, parallel_step)
    return [
        *(np.column_stack([np.full(along.size, value), along]) for value in meridians),
        *(np.column_stack([across, np.full(across.size, value)]) for value in parallels),
    ]


def graticule_values(bounds: Bounds, meridian_step: float, parallel_step: float) -> tuple[list[float], list[float]]:
    """The longitudes of meridians and the latitudes of parallels at multiples of the steps, all in degrees."""
    west, south, _, north = bounds
    east = west + longitude_width(bounds)
    # A pole is no parallel, and on a whole globe the last meridian is the first.
    meridians = _multiples(west, east - (1e-6 if east - west == 360.0 else 0.0), meridian_step)
    parallels = _multiples(max(south, -POLE), min(north, POLE), parallel_step)
    return meridians, [value for value in parallels if abs(value) < POLE]


def _multiples(low: float, high: float, step: float) -> list[float]:
    first, last = int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9))
    return [step * index for index in range(first, last + 1)]
