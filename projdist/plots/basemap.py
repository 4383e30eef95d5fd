"""What all pictures share: sea, land, graticule, coastline and the outline of the map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.patheffects import withStroke
from matplotlib.tri import Triangulation

from projdist._typing import IntArray
from projdist.plots.domain import longitude_width
from projdist.plots.land import land_polygons
from projdist.plots.lines import coast, graticule, project_lines
from projdist.plots.mesh import Mesh

SEA, LAND, COAST, GRATICULE, OUTLINE = "#f1f5f9", "#dedacf", "#77736a", "#b4bec9", "#333333"

_GRATICULE_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0)


def triangulation(mesh: Mesh) -> tuple[Triangulation, IntArray]:
    """The mesh for matplotlib, and the vertices that it uses."""
    used = np.zeros(mesh.x.size, dtype=bool)
    used[mesh.triangles] = True
    kept = np.flatnonzero(used)
    return Triangulation(mesh.x[kept], mesh.y[kept], (np.cumsum(used) - 1)[mesh.triangles]), kept


def map_size(mesh: Mesh) -> float:
    """The greater of width and height in metres."""
    west, east, south, north = mesh.extent
    return max(east - west, north - south)


def coast_resolution(mesh: Mesh) -> str:
    """The finer coastline for parts of the world."""
    return "110m" if max(spread_degrees(mesh)) > 100.0 else "50m"


def graticule_step(mesh: Mesh) -> float:
    """A round number of degrees that gives about six lines across."""
    return min(_GRATICULE_STEPS, key=lambda step: abs(np.log(step / (max(spread_degrees(mesh)) / 6.0))))


def spread_degrees(mesh: Mesh) -> tuple[float, float]:
    """Width and height of the region in degrees on the ground."""
    _, south, _, north = mesh.domain.region.bounds
    shrink = np.cos(np.radians(np.clip(0.5 * (south + north), -80.0, 80.0)))
    return float(longitude_width(mesh.domain.region.bounds) * shrink), north - south


def set_view(ax: Axes, mesh: Mesh) -> None:
    """Limits a little wider than the map, one metre the same in x and y, and no frame."""
    west, east, south, north = mesh.extent
    margin = 0.01 * map_size(mesh)
    ax.set_xlim(west - margin, east + margin)
    ax.set_ylim(south - margin, north + margin)
    ax.set_aspect("equal")
    ax.set_axis_off()


def draw_ground(ax: Axes, mesh: Mesh) -> None:
    """Sea and land as pale areas."""
    mapped, kept = triangulation(mesh)
    _fill(ax, mapped, SEA, 0.5)
    cells, coastal = land_polygons(mesh, coast_resolution(mesh))
    renumbered = np.zeros(mesh.x.size, dtype=int)
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


def draw_lines(ax: Axes, mesh: Mesh, step: float | None, *, over_colours: bool = False) -> None:
    """Graticule, coastline and outline; with a pale halo where they lie over a coloured field."""
    size = map_size(mesh)
    bounds = mesh.domain.region.bounds
    grid = project_lines(mesh.domain, graticule(bounds, step or graticule_step(mesh)), size)
    shore = project_lines(
        mesh.domain, coast(mesh.domain, coast_resolution(mesh), min(1.0, max(spread_degrees(mesh)) / 60.0)), size
    )
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
            list(mesh.outline), colors=OUTLINE, linewidths=0.8, capstyle="round", zorder=3.0, label="outline"
        ),
        autolim=False,
    )


def draw_title(ax: Axes, title: str, airy_kavrayskiy: float | None) -> None:
    """The name of the map, and its Airy-Kavrayskiy figure if it is known."""
    ax.set_title(title, fontsize=10.5, pad=16 if airy_kavrayskiy is not None else 6, color="#111111")
    if airy_kavrayskiy is not None:
        ax.annotate(
            f"Airy–Kavrayskiy {airy_kavrayskiy:.4g}",
            (0.5, 1.0),
            xytext=(0, 4),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=8,
            color="#555555",
        )
