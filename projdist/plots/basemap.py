"""What all pictures share: sea, land, graticule, coastline and the outline of the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.tri import Triangulation

from projdist._typing import FloatArray, IntArray
from projdist.plots.titles import with_minus
from projdist.support import check_number, check_text
from projdist.surfaces import Surface, coast, graticule, graticule_steps, ground_size, land_polygons, project_lines

SEA, LAND, COAST, GRATICULE, OUTLINE = "#f1f5f9", "#dedacf", "#77736a", "#b4bec9", "#333333"

_TITLE, _BELOW = 10.5, 8.0  # points
_BELOW_LABEL = "below the title"


def triangulation(surface: Surface) -> tuple[Triangulation, IntArray]:
    """The surface for matplotlib, and the vertices that it uses."""
    used = np.zeros(surface.x.size, dtype=bool)
    used[surface.triangles] = True
    kept = np.flatnonzero(used)
    return Triangulation(surface.x[kept], surface.y[kept], (np.cumsum(used) - 1)[surface.triangles]), kept


def map_size(surface: Surface) -> float:
    """The greater of width and height in metres."""
    west, east, south, north = surface.extent
    return max(east - west, north - south)


def coast_resolution(surface: Surface) -> str:
    """The finer coastline for parts of the world."""
    return "110m" if max(ground_size(surface.domain.region.bounds)) > 100.0 else "50m"


def set_view(ax: Axes, surface: Surface) -> None:
    """Limits a little wider than the map, one metre the same in x and y, and no frame."""
    west, east, south, north = surface.extent
    margin = 0.01 * map_size(surface)
    ax.set_xlim(west - margin, east + margin)
    ax.set_ylim(south - margin, north + margin)
    ax.set_aspect("equal")
    ax.set_axis_off()


def draw_ground(ax: Axes, surface: Surface) -> None:
    """Sea and land as pale areas; other bodies are all land."""
    mapped, kept = triangulation(surface)
    if surface.domain.projection.is_of_another_body:
        _fill(ax, mapped, LAND, 0.5)
        return
    _fill(ax, mapped, SEA, 0.5)
    cells, coastal = land_polygons(surface, coast_resolution(surface))
    renumbered = np.zeros(surface.x.size, dtype=int)
    renumbered[kept] = np.arange(kept.size)
    if len(cells):
        _fill(ax, Triangulation(mapped.x, mapped.y, renumbered[cells]), LAND, 0.6)
    # The hair of an edge in the same colour closes the joints between the pieces.
    ax.add_collection(
        PolyCollection(coastal, facecolors=LAND, edgecolors=LAND, linewidths=0.3, rasterized=True, zorder=0.6),
        autolim=False,
    )


def _fill(ax: Axes, mapped: Triangulation, colour: str, zorder: float) -> None:
    # Of matplotlib's ways to fill many triangles, this one leaves no hairlines between them.
    ax.tripcolor(
        mapped,
        np.zeros(mapped.x.size),
        shading="gouraud",
        cmap=ListedColormap([colour]),
        rasterized=True,
        zorder=zorder,
    )


def draw_lines(ax: Axes, surface: Surface, step: float | None, *, over_colours: bool = False) -> None:
    """Graticule, coastline and outline; with a pale halo where they lie over a coloured field."""
    size, bounds = map_size(surface), surface.domain.region.bounds
    grid = project_lines(surface.domain, graticule(bounds, *graticule_steps(bounds, step)), size)
    spacing = min(1.0, max(ground_size(bounds)) / 60.0)
    has_coast = not surface.domain.projection.is_of_another_body
    coastline = coast(bounds, coast_resolution(surface), spacing) if has_coast else []
    shore = project_lines(surface.domain, coastline, size)
    halo = [withStroke(linewidth=1.3, foreground="#ffffff99")] if over_colours else []
    ax.add_collection(
        LineCollection(
            grid, colors="#00000040" if over_colours else GRATICULE, linewidths=0.4, zorder=1.0, label="graticule"
        ),
        autolim=False,
    )
    ax.add_collection(
        LineCollection(
            shore,
            colors="#222222" if over_colours else COAST,
            linewidths=0.5,
            path_effects=halo,
            zorder=1.2,
            label="coastline",
        ),
        autolim=False,
    )
    ax.add_collection(
        LineCollection(
            _joined(surface.outline), colors=OUTLINE, linewidths=0.8, capstyle="round", zorder=3.0, label="outline"
        ),
        autolim=False,
    )


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
    ax.set_title(check_text("title", title), fontsize=_TITLE, pad=16 if below else 6, color="#111111")
    if below:
        ax.annotate(
            with_minus(below),
            (0.5, 1.0),
            xytext=(0, 4),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=_BELOW,
            color="#555555",
            label=_BELOW_LABEL,
        )


def title_width(title: str, below: str) -> float:
    """The width in inches of what `draw_title` writes."""
    return max(_width(text, size) for text, size in ((check_text("title", title), _TITLE), (below, _BELOW)))


def _width(text: str, points: float) -> float:
    return float(TextPath((0.0, 0.0), text, size=points).get_extents().width) / 72.0 if text.strip() else 0.0


def fit_titles(axes: Sequence[Axes], room: float) -> None:
    """Make titles, and the lines below them, as small as the widest of each needs in `room`, in inches."""
    titles = [ax.title for ax in axes]
    below = [text for ax in axes for text in ax.texts if text.get_label() == _BELOW_LABEL]
    # A line below a title is never the larger of the two.
    _shrink(below, min(_shrink(titles, _TITLE, room), _BELOW), room)


def _shrink(texts: Sequence[Text], points: float, room: float) -> float:
    """Give texts one size with which all fit, `points` at most; returns it."""
    widest = max((_width(text.get_text(), points) for text in texts), default=0.0)
    size = points * min(1.0, room / widest) if widest else points
    for text in texts:
        text.set_fontsize(size)
    return size
