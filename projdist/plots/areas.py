"""Areas of colour on a map: sea, land and lakes, and the region as a path that clips what is drawn of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.transforms import TransformedPath
from matplotlib.tri import Triangulation

from projdist._typing import FloatArray, IntArray
from projdist.plots.looks import look_of
from projdist.surfaces import Surface, coast_resolution, lake_polygons, land_polygons

CONTEXTS = ("none", "coast", "borders", "full")
"""What a picture shows of the Earth: nothing; land and sea; also borders and lakes; also cities and a locator."""


def check_context(context: str) -> str:
    """One of `CONTEXTS`, or ValueError."""
    if context not in CONTEXTS:
        raise ValueError(f"Invalid context {context!r}. It must be one of {', '.join(CONTEXTS)}.")
    return context


def shows_borders(surface: Surface, context: str) -> bool:
    """Whether lakes and borders of countries are drawn: on maps of parts of the world."""
    return context in ("borders", "full") and surface.is_local


def triangulation(surface: Surface, triangles: IntArray) -> tuple[Triangulation, IntArray]:
    """Triangles of a surface for matplotlib, and the vertices that they use."""
    used = np.zeros(surface.x.size, dtype=bool)
    used[triangles] = True
    kept = np.flatnonzero(used)
    return Triangulation(surface.x[kept], surface.y[kept], (np.cumsum(used) - 1)[triangles]), kept


def draw_ground(ax: Axes, surface: Surface, context: str) -> None:
    """Sea and land as pale areas, what is beside a region paler; other bodies are all land."""
    draw_surroundings(ax, surface, context)
    _draw_land(
        ax,
        surface,
        look_of(ax).colours.land,
        0.5,
        context,
        coast_resolution(surface),
        lakes=shows_borders(surface, context),
    )


def draw_surroundings(ax: Axes, surface: Surface, context: str) -> None:
    """Sea and land about a region."""
    if surface.ground is not None and context != "none":
        lakes, pale = shows_borders(surface, context), look_of(ax).colours.neighbours
        _draw_land(ax, surface.ground, pale, 0.2, context, coast_resolution(surface), lakes=lakes)


def draw_surface(ax: Axes, surface: Surface) -> None:
    """A small map of its own: sea, land and outline."""
    _draw_land(ax, surface, look_of(ax).colours.locator, 0.5, "coast", coast_resolution(surface))
    west, east, south, north = surface.view
    ax.set(xlim=(west, east), ylim=(south, north), aspect="equal")
    ax.set_axis_off()
    ax.add_collection(
        LineCollection(list(surface.outline), colors="#555555", linewidths=0.6, zorder=1.0), autolim=False
    )


def region_clip(ax: Axes, surface: Surface) -> TransformedPath | None:
    """The region as a path that clips what is drawn of it; None where its triangles are the region."""
    if not surface.pieces:
        return None
    return TransformedPath(_closed(surface.pieces), ax.transData)


def _closed(pieces: Sequence[FloatArray]) -> Path:
    """Polygons of (x, y) as one path."""
    ends = np.cumsum([len(piece) for piece in pieces])
    points = np.concatenate(pieces)
    vertices = np.insert(points, ends, points[np.append(0, ends[:-1])], axis=0)
    ends += np.arange(len(ends))
    codes = np.full(len(vertices), Path.LINETO, dtype=Path.code_type)
    codes[ends] = Path.CLOSEPOLY
    codes[np.append(0, ends[:-1] + 1)] = Path.MOVETO
    return Path(vertices, codes)


def _draw_land(
    ax: Axes, surface: Surface, colour: str, zorder: float, context: str, resolution: str, *, lakes: bool = False
) -> None:
    clip = region_clip(ax, surface)
    has_land = not surface.domain.projection.is_of_another_body and context != "none"
    sea = look_of(ax).colours.sea
    _fill(ax, surface, surface.covering(), sea if has_land else colour, zorder, clip)
    if not has_land:
        return
    areas = [(land_polygons(surface, resolution), colour)]
    if lakes:
        areas.append((lake_polygons(surface, resolution), sea))
    for layer, ((cells, pieces), face) in enumerate(areas, 1):
        above = zorder + 0.1 * layer
        if len(cells):
            _fill(ax, surface, cells, face, above, clip)
        if pieces:
            # The hair of an edge in the same colour closes the joints between the pieces.
            drawn = PathPatch(_closed(pieces), color=face, linewidth=0.3, rasterized=True, zorder=above)
            ax.add_artist(drawn)
            if clip is not None:
                drawn.set_clip_path(clip)


def _fill(
    ax: Axes, surface: Surface, triangles: IntArray, colour: str, zorder: float, clip: TransformedPath | None
) -> None:
    mapped, kept = triangulation(surface, triangles)
    # Of matplotlib's ways to fill many triangles, this one leaves no hairlines between them.
    filled = ax.tripcolor(
        mapped,
        np.zeros(kept.size),
        shading="gouraud",
        cmap=ListedColormap([colour]),
        rasterized=True,
        zorder=zorder,
    )
    if clip is not None:
        filled.set_clip_path(clip)
