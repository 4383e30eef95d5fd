"""Arrangement of panels in a figure: columns, room for titles and a colour bar, and font sizes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist._typing import FloatArray
from projdist.plots.basemap import title_width
from projdist.plots.style import USUAL, Look, StyledFigure, scale_for
from projdist.support import check_number, check_pair, quoted

FOOT, BAR = 0.3, 0.75  # inches below the maps, for a line of text, and for a colour bar
_GAP, _TITLE, _EMPTY = 0.15, 0.5, 0.06
_HEADING = 0.36  # for a heading above several maps
_COLUMNS = 5
_LEAST_TEXT = 0.7  # of the usual size: rather fewer columns than smaller titles
_WIDEST, _HIGHEST = 11.0, 9.0

# In a figure of a stated size margins are kept small.
_TIGHT = {BAR: 0.57, FOOT: 0.22}
_TIGHT_GAP, _TIGHT_TITLE, _TIGHT_HEADING, _BELOW = 0.06, 0.24, 0.26, 0.14


@dataclass(frozen=True)
class _Room:
    """Margins in inches: between maps, above each, below all and above all."""

    gap: float
    title: float
    foot: float
    heading: float


@dataclass(frozen=True)
class _PanelGrid:
    """Panels in columns; `unit` is inches per unit of the maps' shapes, `rows` the heights of the rows in inches.

    `letters` is the size of letters relative to the usual one.
    """

    columns: int
    width: float
    height: float
    unit: float
    rows: FloatArray
    room: _Room
    letters: float
    is_one_line: bool

    @property
    def pitch(self) -> float:
        """Width of a column in inches."""
        return (self.width - self.room.gap) / self.columns


def _room(look: Look, letters: float, is_tight: bool, foot: float, count: int, has_below: bool) -> _Room:
    """Margins for a font size."""
    heading = 0.0 if not look.title or count == 1 else letters * (_TIGHT_HEADING if is_tight else _HEADING)
    bottom = foot if look.colourbar or foot != BAR else _EMPTY
    if not is_tight:
        title = letters * _TITLE if look.has_titles else _EMPTY
        return _Room(_GAP, title, letters * bottom, heading)
    title = letters * (_TIGHT_TITLE + (_BELOW if has_below else 0.0)) if look.has_titles else _EMPTY
    return _Room(_TIGHT_GAP, title, letters * _TIGHT.get(bottom, bottom), heading)


@dataclass(frozen=True, kw_only=True)
class _Wish:
    """Panels to arrange; `words` are the title and subtitle of each map."""

    shapes: FloatArray
    size: tuple[float, float] | None
    foot: float
    words: list[tuple[str, str]]
    labels: tuple[float, float]
    look: Look

    def title_width(self, letters: float) -> float:
        """Width in inches of the widest title."""
        if not self.look.has_titles:
            return 0.0
        return letters * max(title_width(*words) for words in self.words)


def _grid(wish: _Wish, columns: int) -> _PanelGrid:
    """Arrangement in a number of columns; in a figure of stated size, titles and subtitles share a line if they fit."""
    merged = [(" · ".join(filter(None, words)), "") for words in wish.words]
    if wish.size is not None and merged != wish.words:
        one_line = _grid_of(replace(wish, words=merged), columns, is_one_line=True)
        if _fits(one_line, replace(wish, words=merged)):
            return one_line
    return _grid_of(wish, columns, is_one_line=False)


def _fits(grid: _PanelGrid, wish: _Wish) -> bool:
    """True if the titles fit their columns."""
    return wish.title_width(grid.letters) <= grid.pitch - grid.room.gap


def _grid_of(wish: _Wish, columns: int, *, is_one_line: bool) -> _PanelGrid:
    """Largest arrangement in a number of columns."""
    shapes, size = wish.shapes, wish.size
    count = len(shapes)
    beside, below = wish.labels
    rows = np.array([shapes[k : k + columns, 1].max() for k in range(0, count, columns)])
    letters = scale_for(wish.look, None if size is None else (size[0] / columns, size[1] / rows.size))
    beside, below = letters * beside, letters * below
    room = _room(wish.look, letters, size is not None, wish.foot, count, any(words[1] for words in wish.words))
    fixed = room.foot + room.heading + rows.size * (room.title + room.gap + below)
    width = size[0] if size else (8.0 if count == 1 else _WIDEST)
    height = size[1] if size else (_HIGHEST if count == 1 else 3.0 + 3.0 * rows.size)
    across = width - room.gap * (columns + 1) - beside * columns
    unit = min(across / (columns * shapes[:, 0].max()), (height - fixed) / rows.sum())
    if not size:
        widest = min(wish.title_width(letters), (width - room.gap) / columns - room.gap)
        width = max(columns * (max(shapes[:, 0].max() * unit + beside, widest) + room.gap) + room.gap, 4.5)
        height = fixed + unit * rows.sum()
    spare = (height - fixed - unit * rows.sum()) / rows.size
    return _PanelGrid(
        columns, width, height, unit, unit * rows + spare + room.title + room.gap + below, room, letters, is_one_line
    )


def arranged(
    shapes: FloatArray,
    size: tuple[float, float] | None,
    dpi: float,
    *,
    foot: float,
    words: list[tuple[str, str]],
    labels: tuple[float, float] = (0.0, 0.0),
    look: Look = USUAL,
) -> tuple[StyledFigure, list[Axes], float]:
    """Figure with a foot, and axes of `shapes`, widths and heights (n, 2), as large as possible.

    Columns are as wide as titles, `words`, where the figure has room for it, with room for `labels` in inches to the
    left of and below the axes; last returned is the room for titles in inches.
    """
    size, dpi = check_size(size), check_dpi(dpi)
    count = len(shapes)
    wish = _Wish(shapes=shapes, size=size, foot=foot, words=words, labels=labels, look=look)
    # The fewest columns for each number of rows: four maps are two and two, not three and one.
    options = [
        _grid(wish, columns)
        for columns in range(1, min(count, _COLUMNS) + 1)
        if -(-count // -(-count // columns)) == columns
    ]
    readable = [
        option
        for option in options
        if option.unit > 0 and option.pitch - option.room.gap >= _LEAST_TEXT * wish.title_width(option.letters) - 1e-9
    ]
    # The largest maps, in a figure that is not much higher than wide.
    grid = max(readable or options, key=lambda option: option.unit * min(1.0, 1.1 * option.width / option.height))
    if not grid.unit > 0:
        width, height = size or (grid.width, grid.height)
        maps_text = "a map" if count == 1 else f"{count} maps"
        raise ValueError(f"Invalid size '{width:g},{height:g}'. It has no room for {maps_text}.")
    figure = StyledFigure(
        look,
        grid.letters,
        figsize=(grid.width, grid.height),
        dpi=dpi,
        is_tight=size is not None,
        is_one_line=grid.is_one_line,
    )
    if look.title and count > 1:
        figure.head(look.title)
    return figure, _axes(figure, grid, shapes, labels), grid.pitch - grid.room.gap - grid.letters * labels[0]


def _axes(figure: Figure, grid: _PanelGrid, shapes: FloatArray, labels: tuple[float, float]) -> list[Axes]:
    """Axes centred in the cells of the grid."""
    axes = []
    count = len(shapes)
    beside, below = grid.letters * labels[0], grid.letters * labels[1]
    for index, (w, h) in enumerate(shapes * grid.unit):
        row, column = divmod(index, grid.columns)
        in_row = min(grid.columns, count - row * grid.columns)
        left = 0.5 * (grid.width - in_row * grid.pitch) + (column + 0.5) * grid.pitch - 0.5 * (w - beside)
        top = grid.height - grid.room.heading - grid.rows[:row].sum()
        middle = top - 0.5 * (grid.rows[row] + grid.room.title - below)
        place = (left / grid.width, (middle - 0.5 * h) / grid.height, w / grid.width, h / grid.height)
        axes.append(figure.add_axes(place))
    return axes


def bar_axes(figure: StyledFigure) -> Axes:
    """Axes at the foot of a figure, for a colour bar."""
    width, height = figure.get_size_inches()
    length = min(0.7 * width, 6.0)
    bottom, thickness = (0.40, 0.10) if figure.is_tight else (0.48, 0.13)
    bottom, thickness = figure.scale * bottom, figure.scale * thickness
    return figure.add_axes((0.5 - 0.5 * length / width, bottom / height, length / width, thickness / height))


def check_size(size: Any) -> tuple[float, float] | None:
    """Check a size in inches; None stands for as much as needed."""
    if size is None:
        return None
    pair = check_pair("size", size)
    if not (np.isfinite(pair).all() and min(pair) > 0):
        raise ValueError(f"Invalid size {quoted(size)}. It must be a width and a height in inches, both positive.")
    return pair


def check_dpi(dpi: Any) -> float:
    """Dots per inch."""
    number = check_number("dpi", dpi)
    if not 0.0 < number < np.inf:
        raise ValueError(f"Invalid dpi {quoted(dpi)}. It must be positive.")
    return number
