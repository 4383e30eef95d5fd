"""The two kinds of picture, drawn on given axes: Tissot's indicatrices, and heat maps of a measure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.tri import Triangulation

from projdist._typing import FloatArray
from projdist.measures import Measure, get_measure
from projdist.plots.basemap import draw_ground, draw_lines, draw_title, set_view, spread_degrees, triangulation
from projdist.plots.domain import Region, domain_of
from projdist.plots.fields import ColourScale, colour_scale, field, is_constant, level_labels
from projdist.plots.indicatrices import Indicatrices, ellipses, fit, indicatrices
from projdist.plots.labels import label_isolines
from projdist.plots.mesh import Mesh, build_mesh
from projdist.projections import Projection

ELLIPSE_FACE, ELLIPSE_EDGE = "#c2402899", "#7d2414"

AnyMeasure = str | Measure | Callable[[FloatArray], FloatArray]
Levels = int | Sequence[float] | None


def prepare(projection: Any, region: Region | None) -> Mesh:
    """The mesh of the drawn part of a projection; None is its area of use, or the globe."""
    return build_mesh(domain_of(Projection.from_user_input(projection), region))


# ---- Tissot's indicatrices ------------------------------------------------------------------


def tissot(
    ax: Axes,
    projection: Any,
    *,
    region: Region | None = None,
    step: float | None = None,
    radius: float | None = None,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
) -> float:
    """Draw Tissot's indicatrices on `ax`; returns the radius in metres of the circles that they are.

    The ellipses stand `step` degrees apart and are as large as they can be without overlap, unless
    `radius` states their size.
    """
    mesh = prepare(projection, region)
    fitted, (panel,) = fit([tissot_points(mesh, step)], radius)
    draw_tissot(ax, mesh, panel, fitted, title, airy_kavrayskiy)
    return fitted


def tissot_points(mesh: Mesh, step: float | None) -> Indicatrices:
    """The indicatrices of a mesh, by default about a dozen across."""
    if step is not None and not step > 0:
        raise ValueError(f"Invalid step '{step}'. It must be a positive number of degrees.")
    return indicatrices(mesh.domain, step or _usual_step(mesh), mesh.central_meridian)


def _usual_step(mesh: Mesh) -> float:
    """15 degrees for the globe; a ninth of smaller regions, less where these are narrow."""
    width, height = spread_degrees(mesh)
    wide, narrow = max(width, height), min(width, height)
    return 15.0 if wide > 150.0 else min(wide / 9.0, max(narrow / 2.0, wide / 40.0))


def draw_tissot(
    ax: Axes, mesh: Mesh, panel: Indicatrices, radius: float, title: str | None, airy_kavrayskiy: float | None
) -> None:
    """Draw prepared indicatrices of a radius in metres."""
    set_view(ax, mesh)
    draw_ground(ax, mesh)
    draw_lines(ax, mesh, None)
    ax.add_collection(
        PolyCollection(
            list(ellipses(panel, radius)),
            facecolors=ELLIPSE_FACE,
            edgecolors=ELLIPSE_EDGE,
            linewidths=0.6,
            zorder=2.0,
            label="indicatrices",
        ),
        autolim=False,
    )
    draw_title(ax, mesh.domain.projection.name if title is None else title, airy_kavrayskiy)


# ---- heat maps ------------------------------------------------------------------------------


def heatmap(
    ax: Axes,
    projection: Any,
    *,
    measure: AnyMeasure = "fisher",
    region: Region | None = None,
    step: float | None = None,
    levels: Levels = None,
    cmap: str | None = None,
    limits: tuple[float, float] | None = None,
    colourbar: bool = True,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
) -> ColourScale:
    """Draw a measure as a field of colours with isolines on `ax`; returns what the colours mean.

    `levels` are the isolines, or about how many; `limits` the ends of the colours; `step` the
    degrees between the lines of the graticule.
    """
    mesh = prepare(projection, region)
    chosen = get_measure(measure)
    values = field(mesh, chosen)
    scale = colour_scale(chosen, [values[: mesh.nodes]], [mesh.weights], levels=levels, cmap=cmap, limits=limits)
    draw_heatmap(ax, mesh, values, scale, step, title, airy_kavrayskiy)
    if colourbar:
        draw_colourbar(ax.get_figure(root=False), scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)
    return scale


def draw_heatmap(
    ax: Axes,
    mesh: Mesh,
    values: FloatArray,
    scale: ColourScale,
    step: float | None,
    title: str | None,
    airy_kavrayskiy: float | None,
) -> None:
    """Draw prepared values at the vertices of a mesh."""
    set_view(ax, mesh)
    mapped, used = triangulation(mesh)
    values = values[used]
    if scale.measure.name == "meridian_convergence":
        mapped, values = _without_turn(mapped, values)
    missing = ~np.isfinite(values)
    mapped.set_mask(missing[mapped.triangles].any(axis=1))
    present = values[~missing]
    values = np.where(missing, scale.limits[0], values)
    ax.tripcolor(
        mapped,
        values,
        shading="gouraud",
        norm=scale.norm,
        cmap=scale.cmap,
        rasterized=True,
        zorder=0.5,
    )
    draw_lines(ax, mesh, step, over_colours=True)
    inside = scale.levels[(scale.levels > present.min()) & (scale.levels < present.max())]
    if inside.size and not is_constant(scale.measure, *np.quantile(present, [0.01, 0.99])):
        lines = ax.tricontour(
            mapped, values, levels=inside, colors="#111111", linewidths=0.6, linestyles="solid", zorder=2.0
        )
        label_isolines(ax, lines, dict(zip(inside.tolist(), level_labels(inside), strict=True)), mesh.outline)
    draw_title(ax, mesh.domain.projection.name if title is None else title, airy_kavrayskiy)


def _without_turn(mapped: Triangulation, values: FloatArray) -> tuple[Triangulation, FloatArray]:
    """A field of angles with own vertices for the triangles where it goes from 180 to -180 degrees."""
    corners = values[mapped.triangles]
    turn = np.ptp(corners, axis=1) > 180.0
    torn = mapped.triangles[turn].ravel()
    first = np.repeat(corners[turn, 0], 3)
    unwrapped = first + np.mod(values[torn] - first + 180.0, 360.0) - 180.0
    triangles = mapped.triangles.copy()
    triangles[turn] = len(values) + np.arange(torn.size).reshape(-1, 3)
    x, y = np.concatenate([mapped.x, mapped.x[torn]]), np.concatenate([mapped.y, mapped.y[torn]])
    return Triangulation(x, y, triangles), np.concatenate([values, unwrapped])


def draw_colourbar(figure: Any, scale: ColourScale, **place: Any) -> Colorbar:
    """A horizontal colour bar with the levels as its ticks."""
    bar: Colorbar = figure.colorbar(
        ScalarMappable(scale.norm, scale.cmap), orientation="horizontal", extend=scale.extend, **place
    )
    ticks = _ticks(scale, bar.ax.get_window_extent().width / figure.dpi)
    bar.set_ticks(ticks, labels=level_labels(np.array(ticks)))
    bar.minorticks_off()
    bar.ax.tick_params(labelsize=8, length=3)
    bar.set_label(scale.label, fontsize=9)
    bar.outline.set_linewidth(0.5)
    return bar


def _ticks(scale: ColourScale, inches: float) -> list[float]:
    """As many of the levels as have room for their labels, and among them 0, or 1 for a ratio."""
    low, high = scale.limits
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    if not levels.size:
        return [low, high]
    widest = 0.08 * max(len(label) for label in level_labels(levels)) + 0.12
    every = int(np.ceil(levels.size / max(inches / widest, 1.0)))
    middle = int(np.argmin(np.abs(levels - (1.0 if scale.measure.kind == "ratio" else 0.0))))
    return [float(level) for level in levels[middle % every :: every]]
