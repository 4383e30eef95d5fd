"""The style of pictures: themes of colours, and `Look`, the options that all pictures have."""

from __future__ import annotations

import functools
import os
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, cast

import matplotlib
import matplotlib.style
from matplotlib import colors, rc_context

from projdist import support

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


# ---- looks ---------------------------------------------------------------------------------------

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


def look_for(look: Look | str | None) -> Look:
    """Look given as itself or as the name of a theme."""
    given = Look(theme=look) if look is None or isinstance(look, str) else look
    return support.check_instance("look", given, Look, "a Look or the name of a theme")
