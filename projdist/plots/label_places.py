"""Labels of points, placed so that they hide neither each other nor a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text

from projdist._typing import FloatArray

_NEAR, _FAR, _TURNS = 7.0, 90.0, 24  # points from the point that is labelled, and directions tried
_TIED = 9.0  # points: labels farther away have a line to their point
_PAD = 1.5
_ASTRAY = 0.02  # of a label's area: as bad as hiding so much is a label that is nearer to another point

_Sides = tuple[float, float, float, float]  # left, bottom, right, top in pixels


def place_labels(
    ax: Axes, xy: FloatArray, texts: Sequence[str], *, size: float, colour: str, line: FloatArray
) -> list[Text]:
    """Write the texts of points (n, 2) beside them and beside a line (m, 2), those with most neighbours first.

    The limits of the axes must stand.
    """
    figure = ax.figure
    dots = figure.dpi / 72.0
    places = ax.transData.transform(xy)
    frame = _sides(ax)
    half = 3.5 * dots
    taken = [(x - half, y - half, x + half, y + half) for x, y in places]
    taken += [(x - dots, y - dots, x + dots, y + dots) for x, y in _dotted(ax.transData.transform(line), 3.0 * dots)]
    crowd = [np.sum(np.exp(-np.hypot(*(places - place).T) / (30.0 * dots))) for place in places]
    written: list[Text] = []
    for k in np.argsort(crowd)[::-1]:
        label = ax.annotate(
            texts[k],
            xy[k],
            xytext=(0.0, 0.0),
            textcoords="offset points",
            fontsize=size,
            color=colour,
            ha="center",
            va="center",
            zorder=4.0,
            annotation_clip=False,
        )
        box = label.get_window_extent()
        offset = _free(places[k], np.array([box.width, box.height]), places, taken, frame, dots)
        label.set_position(tuple(offset / dots))
        centre = places[k] + offset
        taken.append(_box(centre, np.array([box.width, box.height]), _PAD * dots))
        if _gap(places[k], taken[-1]) > _TIED * dots:
            _tie(ax, places[k], taken[-1])
        written.append(label)
    return written


def _sides(ax: Axes) -> _Sides:
    left, bottom, right, top = ax.get_window_extent().extents
    return float(left), float(bottom), float(right), float(top)


def _dotted(line: FloatArray, step: float) -> FloatArray:
    """Points along a line."""
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    at = np.arange(0.0, lengths[-1], step)
    return np.column_stack([np.interp(at, lengths, line[:, k]) for k in (0, 1)])


def _free(
    place: FloatArray,
    size: FloatArray,
    places: FloatArray,
    taken: Sequence[_Sides],
    frame: _Sides,
    dots: float,
) -> FloatArray:
    """Where the middle of a label has least in its way, the nearest first; an offset in pixels.

    It should also be clearly nearer to its own point than to any other.
    """
    best, least = np.zeros(2), np.inf
    for distance in np.arange(_NEAR, _FAR, 4.0):
        for angle in 2.0 * np.pi * np.arange(_TURNS) / _TURNS:
            way = np.array([np.cos(angle), np.sin(angle)])
            offset = way * distance * dots + 0.5 * size * np.clip(1.4 * way, -1.0, 1.0)
            box = _box(place + offset, size, _PAD * dots)
            hidden = sum(_overlap(box, other) for other in taken) + _outside(box, frame)
            if hidden < least:
                own = _gap(place, box) + 3.0 * dots
                nearer = sum(_gap(other, box) < own for other in places) - 1
                hidden += _ASTRAY * size[0] * size[1] * nearer
            if hidden < least:
                best, least = offset, hidden
            if hidden == 0.0:
                return offset
    return best


def _box(centre: FloatArray, size: FloatArray, pad: float) -> _Sides:
    half = 0.5 * size + pad
    return (
        float(centre[0] - half[0]),
        float(centre[1] - half[1]),
        float(centre[0] + half[0]),
        float(centre[1] + half[1]),
    )


def _overlap(one: _Sides, other: _Sides) -> float:
    """The area that two boxes have in common."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return max(width, 0.0) * max(height, 0.0)


def _outside(box: _Sides, frame: _Sides) -> float:
    """By how much a box leaves the frame, as an area."""
    whole = (box[2] - box[0]) * (box[3] - box[1])
    return whole - _overlap(box, frame)


def _gap(place: FloatArray, box: _Sides) -> float:
    return float(np.hypot(*(place - _nearest(place, box))))


def _nearest(place: FloatArray, box: _Sides) -> FloatArray:
    """The point of a box that is nearest to a place."""
    return np.array([np.clip(place[0], box[0], box[2]), np.clip(place[1], box[1], box[3])])


def _tie(ax: Axes, place: FloatArray, box: _Sides) -> None:
    """A thin line from a point to its label."""
    ends = ax.transData.inverted().transform([place, _nearest(place, box)])
    ax.plot(*ends.T, color="#9aa3ad", linewidth=0.6, zorder=2.5)
