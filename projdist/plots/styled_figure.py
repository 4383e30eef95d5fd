"""The figure that every picture is, `StyledFigure`: its margins, its letters, and the arrangement of its panels."""

from __future__ import annotations

import functools
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib import collections, transforms
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.textpath import TextPath

from projdist import regions, support
from projdist._typing import FloatArray
from projdist.plots.style import USUAL, Look, Theme
from projdist.projections import Projection, ProjectionLike, listed_projections

_FONT = 9.0  # points: the usual size of a colour bar's label, to which all others are in proportion
_HEADING, _FOOT, _CREDITS = 12.0, 7.5, 6.5
_HEAD_ROOM, _TIGHT_HEAD_ROOM, _CREDITS_ROOM = 0.36, 0.26, 0.16  # inches
_LINE = 0.12  # inches, of each line of credits after the first
_MARGINS = 8.0  # points, of a line across a figure
_LEAST, _FEWEST = 0.75, 12  # of its size, and letters
_FITS = 1.0 + 1e-6  # of the room, which rounding may exceed


@dataclass(frozen=True)
class FigureStyle:
    """Style of one figure: its look, and the size of letters and margins."""

    look: Look = USUAL
    scale: float = 1.0  # of letters, relative to the usual one
    is_tight: bool = False  # the figure's size was stated, so that all margins are small
    is_one_line: bool = False  # subtitles stand beside titles
    has_heading: bool = False  # the look's title is a heading above all

    def margins(self, width: float) -> tuple[float, float]:
        """Inches above and below the content of a figure of a width, for a heading and for credits."""
        heading = _TIGHT_HEAD_ROOM if self.is_tight else _HEAD_ROOM
        return (
            self.scale * heading if self.has_heading and self.look.title else 0.0,
            self.scale * (_CREDITS_ROOM + self.credits(width).count("\n") * _LINE) if self.look.credits else 0.0,
        )

    def credits(self, width: float) -> str:
        """The credits in lines for a figure of a width in inches."""
        return wrapped(" ".join((self.look.credits or "").split()), self.scale * _CREDITS, width - _MARGINS / 72.0)

    def content(self, size: tuple[float, float]) -> tuple[float, float]:
        """Width and height in inches between the margins of a figure of a size."""
        return size[0], size[1] - sum(self.margins(size[0]))

    @property
    def colours(self) -> Theme:
        """Colours of the look."""
        return self.look.colours

    def letters(self, points: float, *, quiet: bool = False) -> dict[str, Any]:
        """Size and colour of a text that usually has so many points."""
        return {"fontsize": self.scale * points, "color": self.colours.quiet if quiet else self.colours.text}


class StyledFigure(Figure):
    """A figure in a style: content of a size in inches, between the margins that hold its heading and credits."""

    def __init__(
        self, style: FigureStyle, content: tuple[float, float], dpi: float, layout: Literal["constrained"] | None = None
    ) -> None:
        background = "none" if style.look.transparent else style.colours.background
        super().__init__(dpi=dpi, facecolor=background, layout=layout)
        self.style = style
        FigureCanvasAgg(self)
        self.margins = above, below = style.margins(content[0])
        self.resize(content)
        if above:
            self._write(str(style.look.title), -0.1, style.letters(_HEADING))
        if below:
            self._write(style.credits(content[0]), 0.05, style.letters(_CREDITS, quiet=True))

    def resize(self, content: tuple[float, float]) -> None:
        """Give the content another size in inches, its width the same."""
        above, below = self.margins
        self.content = content
        width, height = content[0], content[1] + above + below
        self.set_size_inches(width, height)
        if self.get_layout_engine() is not None:
            self.set_layout_engine("constrained", rect=(0.0, below / height, 1.0, content[1] / height))

    def panel(self, left: float, bottom: float, width: float, height: float, **options: Any) -> Axes:
        """Axes at a place in the content, in inches from its lower left corner."""
        whole = self.get_size_inches()
        place = np.array([left, bottom + self.margins[1], width, height]) / [*whole, *whole]
        return self.add_axes(tuple(place.tolist()), **options)

    def draw(self, renderer: Any) -> None:
        """Draw in the style."""
        with self.style.look.applied():
            super().draw(renderer)

    def foot(self, text: str) -> None:
        """Write a line at the foot of the content."""
        above = self.margins[1] / self.style.scale
        self._write(text, above + (0.05 if self.style.is_tight else 0.08), self.style.letters(_FOOT, quiet=True))

    def _write(self, text: str, inches: float, letters: dict[str, Any]) -> None:
        """Write centred lines so far above the figure's lower edge, or below its upper edge if negative."""
        offset = transforms.ScaledTranslation(0.0, self.style.scale * inches, self.dpi_scale_trans)
        edge, anchor = (1.0, "top") if inches < 0.0 else (0.0, "bottom")
        place: dict[str, Any] = {"ha": "center", "va": anchor, "transform": self.transFigure + offset}
        self.fit(self.text(0.5, edge, text, **place, **letters))

    def fit(self, text: Text) -> None:
        """Shrink centred lines to fit the figure's width, then shorten them."""
        room = 72.0 * self.get_figwidth() - _MARGINS
        words, size = text.get_text(), float(text.get_fontsize())
        least = _LEAST * size
        while (excess := self._width(text) / room) > _FITS and size > least:
            size = max(size / excess, least)
            text.set_fontsize(size)
        longest = len(words)
        while self._width(text) > _FITS * room and longest > _FEWEST:
            longest -= 1
            text.set_text(shortened(words, longest))

    def _width(self, text: Text) -> float:
        """Width of a text in points: in pixels, to which letters are rounded, or without, whichever is more."""
        widths = [text_width(line, float(text.get_fontsize())) for line in text.get_text().split("\n")]
        return max(*widths, text.get_window_extent().width * 72.0 / self.dpi)


def wrapped(text: str, points: float, inches: float) -> str:
    """Text in lines about as long as there is room for."""
    share = 72.0 * inches / max(text_width(text, points), 1.0)
    return "\n".join(textwrap.wrap(text, max(int(share * len(text)), 1)))


def text_width(text: str, points: float) -> float:
    """Width of the visible part of a text, in points."""
    if not text.strip():
        return 0.0
    path = TextPath((0.0, 0.0), text, size=points)
    # Vertices reach the extremes of letters; exact extents of their curves take fifty times as long.
    return float(np.ptp(path.vertices[path.codes != TextPath.CLOSEPOLY, 0]))


def shortened(text: str, longest: int = 64) -> str:
    """Text shortened at a word, with an ellipsis."""
    if len(text) <= longest:
        return text
    cut = text[: longest - 1]
    return f"{cut.rpartition(' ')[0] or cut}".rstrip(" /,(·-") + "…"


def style_of(ax: Axes) -> FigureStyle:
    """Style of the figure of axes; the default in a figure of the caller's."""
    figure = getattr(ax.figure, "figure", ax.figure)
    return figure.style if isinstance(figure, StyledFigure) else FigureStyle()


def scale_for(look: Look, room: tuple[float, float] | None) -> float:
    """Relative font size: as stated, else smaller in a small panel; `room` is its size in inches."""
    if look.points is not None:
        return look.points / _FONT
    return 1.0 if room is None else float(np.clip(min(room[0] / 5.5, room[1] / 3.5), 0.72, 1.0))


def set_view(ax: Axes, west: float, east: float, south: float, north: float) -> None:
    """Set the limits of axes without a frame, with equal scales in x and y."""
    ax.set(xlim=(west, east), ylim=(south, north), aspect="equal")
    ax.set_axis_off()


def add_lines(ax: Axes, lines: Iterable[FloatArray], **style: Any) -> collections.LineCollection:
    """Draw lines (n, 2), without a change of the limits of the axes."""
    drawn = collections.LineCollection(list(lines), **style)
    ax.add_collection(drawn, autolim=False)
    return drawn


def add_polygons(ax: Axes, polygons: Iterable[FloatArray], **style: Any) -> None:
    """Draw polygons (n, 2), without a change of the limits of the axes."""
    ax.add_collection(collections.PolyCollection(list(polygons), **style), autolim=False)


# ---- titles --------------------------------------------------------------------------------------

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


# ---- maps, their region and their names ----------------------------------------------------------


def maps_over(
    given: ProjectionLike | Iterable[ProjectionLike],
    region: regions.RegionLike | None,
    others: Sequence[Projection] = (),
    most: int | None = None,
) -> tuple[list[Projection], regions.Place]:
    """The maps of a figure, and the region of these and others; raises ValueError for none and for more than `most`."""
    listed = listed_projections(given)
    if not listed or (most is not None and len(listed) > most):
        must = "at least one" if most is None else f"1 to {most}"
        raise ValueError(f"Invalid list of {len(listed)} projections. It must name {must}.")
    maps = [Projection.from_user_input(one) for one in listed]
    return maps, regions.region_for(region, [*maps, *others])


_CODE = re.compile(r"\w+:[\w.]+")


def title_of(projection: Projection) -> str:
    """Title of a map: its name, shortened, after the code of a CRS."""
    code = projection.definition if _CODE.fullmatch(projection.definition) else ""
    return shortened(f"{code} · {projection.name}" if code else projection.name)


def one_each(given: Any, count: int) -> Any:
    """Titles or figures of maps, by default None; raises ValueError unless there is one for each."""
    if given is None:
        return [None] * count
    if not isinstance(given, list | tuple | np.ndarray) or len(given) != count:
        must = f"There must be one for each of {count} maps."
        raise ValueError(f"Invalid titles or figures {support.quoted(given)}. {must}")
    return given


def titles_for(given: Any, own: list[str]) -> list[str]:
    """Titles of maps, None standing for a map's own; raises ValueError unless there is one for each."""
    return [name if title is None else str(title) for name, title in zip(own, one_each(given, len(own)), strict=True)]


def over(region: regions.Place, before: str = ", over ") -> str:
    """The words that name the region of a picture, nothing for the globe."""
    return "" if region == regions.GLOBE else f"{before}{regions.region_title(region)}"


def with_minus(text: str) -> str:
    """Text with the minus sign U+2212 in numbers."""
    return re.sub(r"(?<![\w.)\]])-(?=\.?\d)|(?<=\de)-(?=\d)", "\N{MINUS SIGN}", text)
