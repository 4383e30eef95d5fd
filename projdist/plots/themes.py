"""The colours of pictures: one record of them for a light, a dark and a printed page."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.colors import Colormap, LinearSegmentedColormap

__all__ = ["THEMES", "Theme"]


@dataclass(frozen=True, kw_only=True)
class Theme:
    """The colours of a picture, as matplotlib takes them, and its colour maps.

    `ink` is for isolines, `halo` what parts lines and letters from colours beneath; `over_graticule` and `over_coast`
    are lines on a field of colours; `curves` are those of graphs. `rising` is a colour map that is light at its
    lower end, `falling` at its upper one, `diverging` in its middle.
    """

    background: str
    text: str
    quiet: str
    sea: str
    land: str
    neighbours: str
    locator: str
    coast: str
    graticule: str
    outline: str
    face: str
    edge: str
    ink: str
    halo: str
    over_graticule: str
    over_coast: str
    curves: tuple[str, ...]
    rising: str | Colormap
    falling: str | Colormap
    diverging: str | Colormap


# Okabe & Ito 2008, which the colour-blind tell apart; yellow is too pale for lines.
_OKABE_ITO = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#222222", "#8c564b")

# Perceptually ordered and safe for the colour-blind; light where the distortion is least.
_LIGHT = Theme(
    background="#ffffff",
    text="#111111",
    quiet="#555555",
    sea="#f1f5f9",
    land="#dedacf",
    neighbours="#ebe8e0",
    locator="#b9b4a6",
    coast="#77736a",
    graticule="#b4bec9",
    outline="#333333",
    face="#c2402899",
    edge="#7d2414",
    ink="#111111",
    halo="#ffffffb0",
    over_graticule="#00000040",
    over_coast="#222222",
    curves=_OKABE_ITO,
    rising="viridis_r",
    falling="viridis",
    diverging="RdBu_r",
)
_DARK = Theme(
    background="#14181d",
    text="#f0f2f4",
    quiet="#aab3bd",
    sea="#202934",
    land="#4a4f52",
    neighbours="#353b40",
    locator="#7b8287",
    coast="#9aa0a4",
    graticule="#465462",
    outline="#d5dae0",
    face="#ff8f6499",
    edge="#ffc2a8",
    ink="#111111",
    halo="#ffffffb0",
    over_graticule="#00000040",
    over_coast="#222222",
    curves=("#56b4e9", "#e69f00", "#2fbf97", "#e3a0c6", "#f0e442", "#ff7f45", "#f0f2f4", "#b98a80"),
    rising="viridis_r",
    falling="viridis",
    diverging="RdBu_r",
)
# One hue: greys that stay apart from black lines, and, as grey has no two ends, from light to dark for scales, too.
_GREYS = LinearSegmentedColormap.from_list("greys for print", ["#fafafa", "#6e6e6e"])
_PRINT = Theme(
    background="#ffffff",
    text="#000000",
    quiet="#333333",
    sea="#ffffff",
    land="#dddddd",
    neighbours="#eeeeee",
    locator="#aaaaaa",
    coast="#777777",
    graticule="#aaaaaa",
    outline="#000000",
    face="#00000030",
    edge="#000000",
    ink="#000000",
    halo="#ffffffd0",
    over_graticule="#00000050",
    over_coast="#333333",
    curves=("#000000", "#a8a8a8", "#666666"),
    rising=_GREYS,
    falling=_GREYS.reversed(),
    diverging=_GREYS,
)

THEMES = {"light": _LIGHT, "dark": _DARK, "print": _PRINT}
"""Themes by name."""
