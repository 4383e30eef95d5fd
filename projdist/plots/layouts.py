"""Arrangement of panels in a figure: columns, titles, room for a colour bar, and font sizes."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.text import Text

from projdist import support
from projdist._typing import FloatArray
from projdist.plots.style import USUAL, FigureStyle, Look, StyledFigure, scale_for, style_of, text_width, with_minus

_TITLE_SIZE, _BELOW_SIZE = _SIZES = 10.5, 8.0  # points
_PADS, _TIGHT_PADS = (6, 16), (4, 14)  # points between map and title, without a line between and with one
_BELOW_LABEL = "below the title"


def draw_title(ax: Axes, title: str, below: str) -> None:
    """Draw a title and a subtitle."""
    style = style_of(ax)
    if not style.look.has_titles:
        return
    if below and style.is_one_line:
        title, below = f"{title} · {with_minus(below)}", ""
    pad = style.scale * (_TIGHT_PADS if style.is_tight else _PADS)[1 if below else 0]
    ax.set_title(support.check_text("title", title), pad=pad, y=1.0, **style.letters(_TITLE_SIZE))
    if below:
        offset, words = (0, style.scale * (3 if style.is_tight else 4)), style.letters(_BELOW_SIZE, quiet=True)
        place: dict[str, Any] = {"xycoords": "axes fraction", "xytext": offset, "textcoords": "offset points"}
        words |= {"ha": "center", "va": "bottom", "label": _BELOW_LABEL}
        ax.annotate(with_minus(below), (0.5, 1.0), **place, **words)


def fit_titles(axes: Sequence[Axes], room: float) -> None:
    """Shrink titles and subtitles until the widest of each fits `room` in inches."""
    scale = style_of(axes[0]).scale
    below = [text for ax in axes for text in ax.texts if text.get_label() == _BELOW_LABEL]
    # A subtitle is never larger than its title.
    size = _shrink([ax.title for ax in axes], scale * _TITLE_SIZE, room)
    _shrink(below, min(size, scale * _BELOW_SIZE), room)


def _shrink(texts: Sequence[Text], points: float, room: float) -> float:
    """Give texts the largest common size, at most `points`, with which all fit; returns it."""
    widest = max((text_width(text.get_text(), points) for text in texts), default=0.0) / 72.0
    size = points * min(1.0, room / widest) if widest else points
    for text in texts:
        text.set_fontsize(size)
    return size


# ---- panels --------------------------------------------------------------------------------------

FOOT, BAR = 0.3, 0.75  # inches below the maps, for a line of text, and for a colour bar
_GAP, _TITLE, _EMPTY = 0.15, 0.5, 0.06
_LEAST_TEXT = 0.7  # of the usual size: rather fewer columns than smaller titles
_WIDEST, _HIGHEST = 11.0, 9.0

# In a figure of a stated size margins are kept small.
_TIGHT_FOOT = {BAR: 0.57, FOOT: 0.22}
_TIGHT_GAP, _TIGHT_TITLE, _BELOW = 0.06, 0.24, 0.14


class _Grid:
    """Panels of widths and heights (n, 2) in a number of columns, as large as possible; lengths are in inches."""

    def __init__(
        self,
        shapes: FloatArray,
        size: tuple[float, float] | None,
        foot: float,
        labels: tuple[float, float],
        look: Look,
        columns: int,
        words: Sequence[tuple[str, str]],
        *,
        legend: float = 0.0,
        is_one_line: bool = False,
    ) -> None:
        count, is_tight = len(shapes), size is not None
        highest = np.array([shapes[k : k + columns, 1].max() for k in range(0, count, columns)])
        letters = scale_for(look, None if size is None else (size[0] / columns, size[1] / highest.size))
        widths = [text_width(text, points) for line in words for text, points in zip(line, _SIZES, strict=True)]
        self.title_width = letters * (max(widths) / 72.0) if look.has_titles else 0.0
        foot = foot if look.colourbar or foot != BAR else _EMPTY
        foot = _TIGHT_FOOT.get(foot, foot) if is_tight else foot
        above = _TIGHT_TITLE + (_BELOW if any(below for _, below in words) else 0.0) if is_tight else _TITLE
        self.gap = _TIGHT_GAP if is_tight else _GAP
        self.title = letters * above if look.has_titles else _EMPTY
        self.style = FigureStyle(look, letters, is_tight=is_tight, is_one_line=is_one_line, has_heading=count > 1)
        size = self.style.content(size) if size else None
        beside, below = letters * labels[0], letters * labels[1]
        fixed = letters * (foot + legend) + highest.size * (self.title + self.gap + below)
        width = size[0] if size else (8.0 if count == 1 else _WIDEST)
        height = size[1] if size else (_HIGHEST if count == 1 else 3.0 + 3.0 * highest.size)
        across = width - self.gap * (columns + 1) - beside * columns
        unit = min(across / (columns * shapes[:, 0].max()), (height - fixed) / highest.sum())
        if not size:
            widest = min(self.title_width, (width - self.gap) / columns - self.gap)
            width = max(columns * (max(shapes[:, 0].max() * unit + beside, widest) + self.gap) + self.gap, 4.5)
            height = fixed + unit * highest.sum()
        spare = (height - fixed - unit * highest.sum()) / highest.size
        self.columns, self.width, self.height, self.unit = columns, width, height, unit
        self.rows = unit * highest + spare + self.title + self.gap + below
        self.labels = beside, below  # room beside and below each panel

    @property
    def pitch(self) -> float:
        """Width of a column."""
        return (self.width - self.gap) / self.columns

    def place(self, index: int, count: int, shape: FloatArray) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of a panel in its cell of the grid."""
        (w, h), (beside, below) = shape * self.unit, self.labels
        row, column = divmod(index, self.columns)
        in_row = min(self.columns, count - row * self.columns)
        left = 0.5 * (self.width - in_row * self.pitch) + (column + 0.5) * self.pitch - 0.5 * (w - beside)
        top = self.height - self.rows[:row].sum()
        middle = top - 0.5 * (self.rows[row] + self.title - below)
        return left, middle - 0.5 * h, w, h


def arranged(
    shapes: FloatArray,
    size: tuple[float, float] | None,
    dpi: float,
    *,
    foot: float,
    words: list[tuple[str, str]],
    labels: tuple[float, float] = (0.0, 0.0),
    legend: float = 0.0,
    look: Look = USUAL,
) -> tuple[StyledFigure, list[Axes], float]:
    """Figure with a foot, axes of `shapes`, widths and heights (n, 2), as large as possible, and room for titles."""
    # Columns are as wide as titles and subtitles, `words`, if possible; `labels` is room left of and below the axes,
    # `legend` below all of them, in inches.
    size, dpi, count = check_size(size), check_dpi(dpi), len(shapes)
    make = functools.partial(_Grid, shapes, size, foot, labels, look, legend=legend)
    # In a figure of a stated size titles and subtitles share a line if they fit.
    merged = [(" · ".join(filter(None, line)), "") for line in words]
    options: list[_Grid] = []
    for columns in range(1, min(count, 5) + 1):
        if -(-count // -(-count // columns)) == columns:  # the fewest for the rows: four maps are two and two
            options.append(make(columns, words))
            if size is not None and merged != words:
                one_line = make(columns, merged, is_one_line=True)
                if one_line.title_width <= one_line.pitch - one_line.gap:
                    options[-1] = one_line
    readable = [one for one in options if one.unit > 0 and one.pitch - one.gap >= _LEAST_TEXT * one.title_width - 1e-9]
    # The largest maps, in a figure that is not much higher than wide.
    grid = max(readable or options, key=lambda option: option.unit * min(1.0, 1.1 * option.width / option.height))
    check_room(grid.unit > 0, size or (grid.width, grid.height), "a map" if count == 1 else f"{count} maps")
    figure = StyledFigure(grid.style, (grid.width, grid.height), dpi)
    axes = [figure.panel(*grid.place(k, count, shape)) for k, shape in enumerate(shapes)]
    return figure, axes, grid.pitch - grid.gap - grid.labels[0]


def bar_axes(figure: StyledFigure) -> Axes:
    """Axes at the foot of a figure, for a colour bar."""
    width = figure.content[0]
    length = min(0.7 * width, 6.0)
    sizes = (0.40, 0.10) if figure.style.is_tight else (0.48, 0.13)
    bottom, thickness = (figure.style.scale * inches for inches in sizes)
    return figure.panel(0.5 * (width - length), bottom, length, thickness)


def check_size(size: Any) -> tuple[float, float] | None:
    """Check a size in inches; None stands for as much as needed."""
    if size is None:
        return None
    pair = support.check_pair("size", size)
    if not (np.isfinite(pair).all() and min(pair) > 0):
        must = "It must be a width and a height in inches, both positive."
        raise ValueError(f"Invalid size {support.quoted(size)}. {must}")
    return pair


def check_room(has_room: bool, size: tuple[float, float], content: str) -> None:
    """Raise ValueError unless a figure of a size in inches has room for its content."""
    if not has_room:
        raise ValueError(f"Invalid size '{size[0]:g},{size[1]:g}'. It has no room for {content}.")


def check_dpi(dpi: Any) -> float:
    """Dots per inch."""
    number = support.check_number("dpi", dpi)
    if not 0.0 < number < np.inf:
        raise ValueError(f"Invalid dpi {support.quoted(dpi)}. It must be positive.")
    return number
