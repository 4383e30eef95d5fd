"""The style of pictures: colours, fonts and titles."""

from __future__ import annotations

import functools
import os
import re
import textwrap
from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, cast

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib import collections, colors, rc_context, transforms
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.textpath import TextPath

from projdist import projections, support
from projdist._typing import FloatArray

# Okabe & Ito 2008, which the colour-blind tell apart; yellow is too pale for lines.
_OKABE_ITO = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#222222", "#8c564b")
_BRIGHT = ("#56b4e9", "#e69f00", "#2fbf97", "#e3a0c6", "#f0e442", "#ff7f45", "#f0f2f4", "#b98a80")

# One hue: greys that stay apart from black lines, and, as grey has no two ends, from light to dark for scales, too.
_GREYS = colors.LinearSegmentedColormap.from_list("greys for print", ["#fafafa", "#6e6e6e"])


def _in_themes(light: Any, dark: Any, print_: Any) -> dict[str, Any]:
    """A colour in each of the themes."""
    return {"light": light, "dark": dark, "print": print_}


@dataclass(frozen=True, kw_only=True)
class Theme:
    """Colours and colour maps of a picture, as matplotlib takes them."""

    background: str = field(metadata=_in_themes("#ffffff", "#14181d", "#ffffff"))
    text: str = field(metadata=_in_themes("#111111", "#f0f2f4", "#000000"))
    quiet: str = field(metadata=_in_themes("#555555", "#aab3bd", "#333333"))
    sea: str = field(metadata=_in_themes("#f1f5f9", "#202934", "#ffffff"))
    land: str = field(metadata=_in_themes("#dedacf", "#4a4f52", "#dddddd"))
    neighbours: str = field(metadata=_in_themes("#ebe8e0", "#353b40", "#eeeeee"))
    locator: str = field(metadata=_in_themes("#b9b4a6", "#7b8287", "#aaaaaa"))
    coast: str = field(metadata=_in_themes("#77736a", "#9aa0a4", "#777777"))
    graticule: str = field(metadata=_in_themes("#b4bec9", "#465462", "#aaaaaa"))
    outline: str = field(metadata=_in_themes("#333333", "#d5dae0", "#000000"))
    face: str = field(metadata=_in_themes("#c2402899", "#ff8f6499", "#00000030"))
    edge: str = field(metadata=_in_themes("#7d2414", "#ffc2a8", "#000000"))
    ink: str = field(metadata=_in_themes("#111111", "#111111", "#000000"))  # of isolines
    halo: str = field(metadata=_in_themes("#ffffffb0", "#ffffffb0", "#ffffffd0"))  # of lines and letters on colours
    over_graticule: str = field(metadata=_in_themes("#00000040", "#00000040", "#00000050"))
    over_coast: str = field(metadata=_in_themes("#222222", "#222222", "#333333"))
    curves: tuple[str, ...] = field(metadata=_in_themes(_OKABE_ITO, _BRIGHT, ("#000000", "#a8a8a8", "#666666")))
    # Perceptually ordered, safe for the colour-blind, and light where distortion is least: at either end, or amid.
    rising: str | colors.Colormap = field(metadata=_in_themes("viridis_r", "viridis_r", _GREYS))
    falling: str | colors.Colormap = field(metadata=_in_themes("viridis", "viridis", _GREYS.reversed()))
    diverging: str | colors.Colormap = field(metadata=_in_themes("RdBu_r", "RdBu_r", _GREYS))


THEMES = {name: Theme(**{one.name: one.metadata[name] for one in fields(Theme)}) for name in ("light", "dark", "print")}
"""Themes by name."""


# ---- titles --------------------------------------------------------------------------------------

_CODE = re.compile(r"\w+:[\w.]+")


def title_of(projection: projections.Projection) -> str:
    """Title of a map: its name, shortened, after the code of a CRS."""
    code = projection.definition if _CODE.fullmatch(projection.definition) else ""
    return shortened(f"{code} · {projection.name}" if code else projection.name)


def titles_for(given: Any, own: list[str]) -> list[str]:
    """Titles of maps, None standing for a map's own; raises ValueError unless there is one for each."""
    if given is None:
        return own
    if not isinstance(given, list | tuple) or len(given) != len(own):
        raise ValueError(f"Invalid titles. There must be one for each of {len(own)} maps.")
    return [name if title is None else str(title) for name, title in zip(own, given, strict=True)]


def shortened(text: str, longest: int = 64) -> str:
    """Text shortened at a word, with an ellipsis."""
    if len(text) <= longest:
        return text
    cut = text[: longest - 1]
    return f"{cut.rpartition(' ')[0] or cut}".rstrip(" /,(·-") + "…"


def with_minus(text: str) -> str:
    """Text with the minus sign U+2212 in numbers."""
    return re.sub(r"(?<![\w.)\]])-(?=\.?\d)|(?<=\de)-(?=\d)", "\N{MINUS SIGN}", text)


# ---- style ---------------------------------------------------------------------------------------

_FONT = 9.0  # points: the usual size of a colour bar's label, to which all others are in proportion
_HEADING, _FOOT, _CREDITS = 12.0, 7.5, 6.5
_HEAD_ROOM, _TIGHT_HEAD_ROOM, _CREDITS_ROOM = 0.36, 0.26, 0.16  # inches
_LINE = 0.12  # inches, of each line of credits after the first
_MARGINS = 8.0  # points, of a line across a figure
_LEAST, _FEWEST = 0.75, 12  # of its size, and letters
_FITS = 1.0 + 1e-6  # of the room, which rounding may exceed
_NOT_OF_PICTURES = frozenset(
    "backend backend_fallback interactive toolbar timezone savefig.directory webagg.port".split()
)


@dataclass(frozen=True, kw_only=True)
class Look:
    """The style of a picture.

    Parameters
    ----------
    theme : str or Theme, optional
        "light", "dark" or "print" (black and greys), or colours of one's own; light if not given.
    font_size : float, optional
        Points of a colour bar's label, to which all letters are in proportion; by default 9, or less in small figures.
    style : str or path, optional
        A name or file of matplotlib's styles: fonts, and, without a theme, its background, text colour and font size.
    transparent : bool
        Whether the picture has no background.
    title : str, optional
        The title of a map alone, or a heading above several; "" for no titles at all. If not given, maps have names.
    colourbar : bool
        Whether there is one.
    credits : str, optional
        A line at the foot of the picture, such as its sources and author.

    Raises
    ------
    ValueError
        For a theme, size or style that there is not.

    References
    ----------
    Matplotlib, Customizing Matplotlib with style sheets, https://matplotlib.org/stable/users/explain/customizing.html.

    Examples
    --------
    >>> Look(theme="print", font_size=8).colours.background
    '#ffffff'
    """

    theme: str | Theme | None = None
    font_size: float | None = None
    style: str | os.PathLike[str] | None = None
    transparent: bool = False
    title: str | None = None
    colourbar: bool = True
    credits: str | None = None

    def __post_init__(self) -> None:
        if self.theme is not None and not isinstance(self.theme, Theme) and self.theme not in THEMES:
            known = support.listed(list(THEMES), "or")
            raise ValueError(f"Invalid theme {support.quoted(self.theme)}. It must be {known}.")
        if self.font_size is not None:
            points = support.check_number("font size", self.font_size)
            if not 1.0 <= points <= 72.0:
                raise ValueError(f"Invalid font size {support.quoted(self.font_size)}. It must be 1 to 72 points.")
        for name in ("title", "credits"):
            if getattr(self, name) is not None:
                support.check_text(name, getattr(self, name))
        _ = self.rc

    @functools.cached_property
    def rc(self) -> dict[str, Any]:
        """Settings of the style, given by name or file."""
        if self.style is None:
            return {}
        known = matplotlib.style.library
        if isinstance(self.style, str) and self.style in known:
            stated = known[self.style]
        else:
            text = f"Invalid style {support.quoted(self.style)}."
            if not isinstance(self.style, str | os.PathLike) or not Path(self.style).is_file():
                names = ", ".join(sorted(known))
                raise ValueError(f"{text} It must be a file of a matplotlib style, or one of {names}.")
            try:
                stated = matplotlib.rc_params_from_file(self.style, use_default_template=False)
            except (OSError, ValueError) as error:
                raise ValueError(f"{text} Matplotlib cannot read it: {' '.join(str(error).split())}.") from error
            if not stated:
                must = "it must have lines such as 'font.size: 9'"
                raise ValueError(f"{text} It states nothing that matplotlib knows: {must}.")
        return {key: value for key, value in stated.items() if key not in _NOT_OF_PICTURES}

    @functools.cached_property
    def colours(self) -> Theme:
        """Colours of the theme or style."""
        if isinstance(self.theme, Theme):
            return self.theme
        if self.theme is not None:
            return THEMES[self.theme]
        stated = {"background": self.rc.get("figure.facecolor"), "text": self.rc.get("text.color")}
        stated["quiet"] = stated["outline"] = stated["text"]
        return replace(THEMES["light"], **{name: colour for name, colour in stated.items() if colour is not None})

    @property
    def points(self) -> float | None:
        """Stated font size, None by default."""
        size = self.rc.get("font.size") if self.font_size is None else self.font_size
        return None if size is None else float(size)

    @property
    def has_titles(self) -> bool:
        """True if maps have titles."""
        return self.title != ""

    def applied(self) -> AbstractContextManager[None]:
        """Context in which matplotlib draws in the style."""
        return rc_context(cast(Any, self.rc))


USUAL = Look()


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


def look_for(look: Look | str | None) -> Look:
    """Look given as itself or as the name of a theme."""
    if look is None or isinstance(look, str):
        return USUAL if look is None else Look(theme=look)
    support.check_instance("look", look, Look, "a Look or the name of a theme")
    return look


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
