"""What all pictures share: their frame, graticule, coasts and borders, and their titles."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Rectangle
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.text import Text

from projdist._typing import FloatArray
from projdist.plots.areas import CONTEXTS, shows_borders
from projdist.plots.graticules import GraticuleLine, label_graticule
from projdist.plots.looks import is_one_line, is_tight_of, look_of, scale_of, text_width
from projdist.plots.titles import with_minus
from projdist.support import check_number, check_text
from projdist.surfaces import (
    Bounds,
    Surface,
    coast,
    coast_resolution,
    country_borders,
    graticule,
    graticule_steps,
    graticule_values,
    ground_size,
    lake_shores,
    project_lines,
)

_TITLE, _BELOW = 10.5, 8.0  # points
_PADS, _TIGHT_PADS = (6, 16), (4, 14)  # points between map and title, without a line between and with one
_BELOW_LABEL = "below the title"


def map_size(surface: Surface) -> float:
    """The greater of width and height in metres."""
    west, east, south, north = surface.extent
    return max(east - west, north - south)


def set_view(ax: Axes, surface: Surface) -> None:
    """The frame of the picture, one metre the same in x and y; its line is drawn where the map goes on beyond."""
    west, east, south, north = surface.view
    ax.set_xlim(west, east)
    ax.set_ylim(south, north)
    ax.set_aspect("equal")
    ax.set_axis_off()
    if surface.goes_on:
        frame = Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, fill=False, clip_on=False, label="frame")
        frame.set(edgecolor=look_of(ax).colours.outline, linewidth=0.8, zorder=5.0)
        ax.add_patch(frame)


def draw_lines(
    ax: Axes, surface: Surface, step: float | None, *, over_colours: bool = False, context: str = CONTEXTS[-1]
) -> None:
    """Graticule, coast, borders and outline; with a pale halo where they lie over a coloured field."""
    drawn = surface if surface.ground is None else surface.ground
    meridians_and_parallels = graticule_lines(surface, step)
    grid = [piece for line in meridians_and_parallels for piece in line.pieces]
    colours = look_of(ax).colours
    halo = [withStroke(linewidth=1.3, foreground="#ffffff99")] if over_colours else []
    shore = colours.over_coast if over_colours else colours.coast
    _draw(ax, grid, "graticule", colours.over_graticule if over_colours else colours.graticule, 0.4, 1.0)
    if context != "none" and not surface.domain.projection.is_of_another_body:
        lines = {"coastline": coast}
        if shows_borders(surface, context):
            lines |= {"lake shores": lake_shores, "borders": country_borders}
        for label, of in lines.items():
            _draw(ax, _earthly(surface, of), label, shore, 0.5, 1.2, halo)
    _draw(ax, _joined(drawn.outline), "outline", colours.outline, 0.8, 3.0).set_capstyle("round")
    if surface.border:
        _draw(ax, surface.border, "border", colours.over_coast if over_colours else colours.outline, 0.9, 1.3, halo)
    if surface.is_local:
        label_graticule(ax, meridians_and_parallels)


def graticule_lines(surface: Surface, step: float | None) -> list[GraticuleLine]:
    """The meridians and parallels of a picture."""
    drawn = surface if surface.ground is None else surface.ground
    bounds = drawn.domain.box.bounds
    steps = graticule_steps(surface.domain.region.bounds if surface.is_local else bounds, step)
    meridians, parallels = graticule_values(bounds, *steps)
    lines = graticule(bounds, *steps)
    values = [*((True, value) for value in meridians), *((False, value) for value in parallels)]
    size = map_size(surface)
    return [
        GraticuleLine(is_meridian, value, project_lines(drawn.domain, [line], size))
        for (is_meridian, value), line in zip(values, lines, strict=True)
    ]


def _earthly(surface: Surface, lines: Callable[[Bounds, str, float], list[FloatArray]]) -> list[FloatArray]:
    """The images of coasts, shores or borders."""
    drawn = surface if surface.ground is None else surface.ground
    bounds = drawn.domain.box.bounds
    spacing = min(1.0, max(ground_size(bounds)) / 60.0)
    return project_lines(drawn.domain, lines(bounds, coast_resolution(surface), spacing), map_size(surface))


def _draw(
    ax: Axes,
    lines: Sequence[FloatArray],
    label: str,
    colour: str,
    width: float,
    zorder: float,
    halo: Sequence[AbstractPathEffect] = (),
) -> LineCollection:
    drawn = LineCollection(
        lines, colors=colour, linewidths=width, zorder=zorder, label=label, path_effects=list(halo) or None
    )
    ax.add_collection(drawn, autolim=False)
    return drawn


def _joined(segments: FloatArray) -> list[FloatArray]:
    """Segments (m, 2, 2) as lines: drawn one by one, they would leave dots where they meet."""
    if not len(segments):
        return []
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(segments))))
    return [shapely.get_coordinates(line) for line in lines]


def airy_kavrayskiy_line(figure: float | None) -> str:
    """An Airy-Kavrayskiy figure as a line below a title; nothing where it is not known."""
    return "" if figure is None else f"Airy–Kavrayskiy {check_number('Airy-Kavrayskiy figure', figure):.4g}"


def draw_title(ax: Axes, title: str, below: str) -> None:
    """The name of the map, and a line below it."""
    look, scale, is_tight = look_of(ax), scale_of(ax), is_tight_of(ax)
    if not look.has_titles:
        return
    if below and is_one_line(ax):
        title, below = f"{title} · {with_minus(below)}", ""
    pad = (_TIGHT_PADS if is_tight else _PADS)[bool(below)]
    ax.set_title(check_text("title", title), fontsize=scale * _TITLE, pad=scale * pad, y=1.0, color=look.colours.text)
    if below:
        ax.annotate(
            with_minus(below),
            (0.5, 1.0),
            xytext=(0, scale * (3 if is_tight else 4)),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=scale * _BELOW,
            color=look.colours.quiet,
            label=_BELOW_LABEL,
        )


def title_width(title: str, below: str) -> float:
    """The width in inches of what `draw_title` writes."""
    return max(text_width(text, size) for text, size in ((check_text("title", title), _TITLE), (below, _BELOW))) / 72.0


def fit_titles(axes: Sequence[Axes], room: float) -> None:
    """Make titles, and the lines below them, as small as the widest of each needs in `room`, in inches."""
    scale = scale_of(axes[0])
    titles = [ax.title for ax in axes]
    below = [text for ax in axes for text in ax.texts if text.get_label() == _BELOW_LABEL]
    # A line below a title is never the larger of the two.
    _shrink(below, min(_shrink(titles, scale * _TITLE, room), scale * _BELOW), room)


def _shrink(texts: Sequence[Text], points: float, room: float) -> float:
    """Give texts one size with which all fit, `points` at most; returns it."""
    widest = max((text_width(text.get_text(), points) for text in texts), default=0.0) / 72.0
    size = points * min(1.0, room / widest) if widest else points
    for text in texts:
        text.set_fontsize(size)
    return size
