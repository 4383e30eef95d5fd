"""The labels of meridians and parallels about the frame of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from projdist._typing import FloatArray
from projdist.earth import latitude_text, longitude_text
from projdist.plots.looks import look_of, scale_of

SIZE = 6.5  # points
_WIDTH, _HEIGHT = 0.62, 1.3  # of a letter and of a line, in the size
_AIR = 2.5  # points between a label and the frame
_BEYOND = 9.0  # points to the right of the frame, where a figure may end
_FLAT = 0.35  # of a line's direction towards an edge: one that runs along it is not labelled there

_EDGES = ("bottom", "left", "top", "right")
_PREFERRED = {True: ("bottom", "top", "left", "right"), False: ("left", "right", "bottom", "top")}


class GraticuleLine(NamedTuple):
    """A meridian or a parallel of `value` degrees, and its images as lines (x, y)."""

    is_meridian: bool
    value: float
    pieces: Sequence[FloatArray]

    @property
    def text(self) -> str:
        """The label."""
        return (longitude_text if self.is_meridian else latitude_text)(self.value, minutes=True)


@dataclass(frozen=True)
class _Label:
    """A text at x, y in points from the lower left of the frame, and half its width and height."""

    text: str
    edge: str
    x: float
    y: float
    half: tuple[float, float]

    def fits(self, width: float) -> bool:
        """Whether it does not reach to the right of a frame, or hardly so where it stands below it."""
        beyond = _BEYOND if self.edge == "bottom" else 0.0
        return self.x + self.half[0] < width + beyond

    def overlaps(self, other: _Label) -> bool:
        """Whether two labels would touch."""
        apart = abs(self.x - other.x), abs(self.y - other.y)
        return apart[0] < self.half[0] + other.half[0] and apart[1] < self.half[1] + other.half[1]


def label_graticule(ax: Axes, lines: Sequence[GraticuleLine]) -> None:
    """Label lines where they cross the frame: below and to the left of it, or else within it."""
    ax.apply_aspect()
    box = ax.get_window_extent()
    points, size = 72.0 / ax.figure.dpi, SIZE * scale_of(ax)
    width, height = box.width * points, box.height * points
    placed: list[_Label] = []
    for line in lines:
        pieces = [(ax.transData.transform(piece) - [box.x0, box.y0]) * points for piece in line.pieces]
        candidates = [
            _label(line.text, edge, place, size)
            for edge in _PREFERRED[line.is_meridian]
            for place in _crossings(pieces, edge, width, height)
        ]
        if not line.is_meridian and not candidates:
            candidates = _inside(line.text, pieces, width, height, size)
        clear = (
            label for label in candidates if label.fits(width) and not any(label.overlaps(other) for other in placed)
        )
        chosen = next(clear, None)
        if chosen is not None:
            placed.append(chosen)
    for label in placed:
        _draw(ax, label, width, height)


def _crossings(pieces: Sequence[FloatArray], edge: str, width: float, height: float) -> list[tuple[float, float]]:
    """Where lines in points cross an edge of the frame, not too much along it."""
    across, level, end = {
        "bottom": (1, 0.0, width),
        "top": (1, height, width),
        "left": (0, 0.0, height),
        "right": (0, width, height),
    }[edge]
    found = []
    for piece in pieces:
        off = piece[:, across] - level
        for k in np.flatnonzero(np.diff(np.sign(off)) != 0):
            start, step = piece[k], piece[k + 1] - piece[k]
            along = float((start + step * (-off[k] / step[across]))[1 - across]) if step[across] else np.nan
            if 0.0 <= along <= end and abs(step[across]) > _FLAT * np.hypot(*step):
                found.append((along, level) if across else (level, along))
    return found


def _label(text: str, edge: str, place: tuple[float, float], size: float) -> _Label:
    half = 0.5 * len(text) * _WIDTH * size + _AIR, 0.5 * _HEIGHT * size
    x, y = place
    # Below and to the left labels are outside of the frame; above and to the right within it.
    if edge in ("left", "right"):
        x -= half[0]
    else:
        y -= _AIR + half[1]
    return _Label(text, edge, x, y, half)


def _inside(text: str, pieces: Sequence[FloatArray], width: float, height: float, size: float) -> list[_Label]:
    """A label on the lowest point within the frame of a line that crosses no edge."""
    xy = np.concatenate([np.empty((0, 2)), *pieces])
    xy = xy[((xy > 0.0) & (xy < [width, height])).all(axis=1)]
    if not len(xy):
        return []
    x, y = xy[np.argmin(xy[:, 1])]
    return [_Label(text, "inside", float(x), float(y), (0.5 * len(text) * _WIDTH * size, 0.5 * _HEIGHT * size))]


def _draw(ax: Axes, label: _Label, width: float, height: float) -> None:
    outside = label.edge in ("bottom", "left")
    colours = look_of(ax).colours
    text = ax.text(
        label.x / width,
        label.y / height,
        label.text,
        transform=ax.transAxes,
        ha="center",
        va="center",
        fontsize=SIZE * scale_of(ax),
        color=colours.text if outside else colours.quiet,
        zorder=4.0,
        label="graticule label",
    )
    if not outside:
        text.set_path_effects([withStroke(linewidth=1.5, foreground=f"{colours.background}b0")])
