"""Drawing on given axes: indicatrices, heat maps, isolines with labels, and colour bars."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap
from matplotlib.contour import ContourSet
from matplotlib.patheffects import withStroke
from matplotlib.transforms import TransformedPath
from matplotlib.tri import Triangulation

from projdist import surfaces
from projdist._typing import FloatArray, IntArray
from projdist.matrices import Measure, get_measure
from projdist.plots.basemap import CONTEXTS, check_context, draw_basemap, draw_triangles, region_clip, triangulation
from projdist.plots.colours import ColourScale, Levels, level_labels, shown_levels
from projdist.plots.layouts import draw_title
from projdist.plots.places import draw_places, main_cities
from projdist.plots.style import FigureStyle, StyledFigure, add_lines, add_polygons, style_of, text_width, title_of
from projdist.projections import Projection, ProjectionLike
from projdist.regions import RegionLike
from projdist.support import check_instance, check_number, check_text
from projdist.surfaces import Indicatrices, Surface, ValuesAt

_SIZE = 6.5  # points
_WIDTH = 0.65  # of a character, in its height
_SHORTEST = 4.0  # of the label's width; shorter isolines have none
_SHARES = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)


def label_isolines(ax: Axes, lines: ContourSet, labels: Mapping[float, str], outline: FloatArray) -> None:
    """Label isolines clear of each other and of the outline, (n, 2, 2) short segments in metres.

    matplotlib's own labels cover each other on lobes and at limbs.
    """
    ax.apply_aspect()
    edge = ax.transData.transform(outline.reshape(-1, 2))
    size = _SIZE * style_of(ax).scale
    height = size / 72.0 * ax.figure.dpi
    places = np.empty((0, 2))
    reaches = np.empty(0)
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        # Half the label's width, in any rotation, and a margin.
        reach = 0.5 * height * (_WIDTH * len(labels[level]) + 0.4)
        for piece in path.to_polygons(closed_only=False):
            points = ax.transData.transform(piece)
            along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
            if along[-1] < 2.0 * _SHORTEST * reach:
                continue
            for share in _SHARES:
                place = np.array([np.interp(share * along[-1], along, column) for column in points.T])
                clear = (np.hypot(*(places - place).T) > reaches + reach).all()
                if clear and (np.hypot(*(edge - place).T) > reach).all():
                    places, reaches = np.vstack([places, place]), np.append(reaches, reach)
                    break
    if not reaches.size:
        return
    manual = ax.transData.inverted().transform(places).tolist()
    for text in ax.clabel(lines, fontsize=size, fmt=dict(labels), inline_spacing=2, manual=manual):
        text.set_path_effects([withStroke(linewidth=1.5, foreground=style_of(ax).colours.halo)])


# ---- pictures ------------------------------------------------------------------------------------

_VERTICES, _FEW_VERTICES, _MANY = 72, 24, 2000
_TICK, _AIR = 8.0, 0.6  # points, and of them between labels
_AXIS = 0.5  # points
_LEAST_FACTOR, _LARGEST_FACTOR = 0.1, 1e6
_EDGE, _EDGE_SHARE = 0.6, 0.06  # points, and of the width of the ellipses

AnyMeasure = str | Measure | Callable[[FloatArray], FloatArray]


def check_axes(ax: Any) -> None:
    """Check that an object is matplotlib axes, before the work."""
    check_instance("axes", ax, Axes, "Axes of matplotlib")


def words_of(
    projection: Projection, title: str | None, airy_kavrayskiy: float | None = None, below: str = ""
) -> tuple[str, str]:
    """Title and subtitle of a map: its name by default, and its Airy-Kavrayskiy error if known."""
    if airy_kavrayskiy is not None and not below:
        below = f"Airy–Kavrayskiy {check_number('Airy-Kavrayskiy figure', airy_kavrayskiy):.4g}"
    return title_of(projection) if title is None else check_text("title", title), below


# ---- Tissot's indicatrices ------------------------------------------------------------------


def check_exaggeration(factor: float | str) -> float | str:
    """Check an exaggeration: a factor, or "auto"; raises ValueError."""
    if factor == "auto":
        return factor
    if not _LEAST_FACTOR <= check_number("exaggeration", factor) <= _LARGEST_FACTOR:
        raise ValueError(f"Invalid exaggeration '{factor}'. It must be a factor of 0.1 to 1e6, or auto.")
    return factor


def tissot(
    ax: Axes,
    projection: ProjectionLike,
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    radius: float | None = None,
    exaggeration: float | str = 1.0,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
    context: str = CONTEXTS[-1],
) -> float:
    """Draw Tissot's indicatrices on `ax`; returns the radius in metres of their circles on the ground.

    The ellipses stand `step` degrees apart and are as large as they can be without overlap, unless `radius` states
    their size. An `exaggeration` multiplies the logarithms of the principal scales; "auto" takes a factor that makes
    them visible. `context`, one of `CONTEXTS`, is what a picture of a region shows of the Earth.
    """
    check_axes(ax)
    exaggeration = check_exaggeration(exaggeration)
    surface = surfaces.surface_of(projection, region)
    words = words_of(surface.domain.projection, title, airy_kavrayskiy)
    points = [surfaces.tissot_points(surface, step)]
    factor = surfaces.usual_exaggeration(points) if isinstance(exaggeration, str) else exaggeration
    fitted, (panel,) = surfaces.fit(points, radius, factor)
    draw_tissot(ax, surface, panel, fitted, words, check_context(context))
    return fitted


def draw_tissot(
    ax: Axes,
    surface: Surface,
    panel: Indicatrices,
    radius: float,
    words: tuple[str, str],
    context: str,
    *,
    axes: bool = False,
) -> None:
    """Draw prepared indicatrices of a radius in metres, with the principal directions as crosses where wanted."""
    draw_basemap(ax, surface, context)
    draw_ellipses(ax, panel, radius)
    if axes:
        crosses = surfaces.principal_axes(panel, radius)
        edge = style_of(ax).colours.edge
        add_lines(ax, crosses, colors=edge, linewidths=_AXIS, zorder=2.1, label="principal directions")
    draw_places(ax, surface, context)
    draw_title(ax, *words)


def draw_ellipses(ax: Axes, panel: Indicatrices, radius: float, matrix: FloatArray | None = None) -> None:
    """Draw ellipses only, in metres, or transformed by a matrix (2, 2)."""
    vertices = _FEW_VERTICES if panel.lon.size > _MANY else _VERTICES
    polygons = surfaces.ellipses(panel, radius, vertices)
    if matrix is not None:
        polygons = polygons @ matrix.T
    width = _EDGE
    if len(polygons):
        points = ax.get_window_extent().width * 72.0 / ax.figure.dpi / np.ptp(ax.get_xlim())
        width = min(_EDGE, _EDGE_SHARE * points * float(np.median(np.ptp(polygons[..., 0], axis=1))))
    colours = {"facecolors": style_of(ax).colours.face, "edgecolors": style_of(ax).colours.edge}
    add_polygons(ax, polygons, **colours, linewidths=width, zorder=2.0, label="indicatrices")


# ---- heat maps ------------------------------------------------------------------------------


def heatmap(
    ax: Axes,
    projection: ProjectionLike,
    *,
    measure: AnyMeasure = "fisher",
    region: RegionLike | None = None,
    step: float | None = None,
    levels: Levels = None,
    cmap: str | Colormap | None = None,
    limits: tuple[float, float] | None = None,
    colourbar: bool = True,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
    context: str = CONTEXTS[-1],
) -> ColourScale:
    """Draw a measure as a field of colours with isolines on `ax`; returns the colour scale.

    `levels` are the isolines in any order, or about how many; `limits` the ends of the colours; `step` the degrees
    between the lines of the graticule; `context`, one of `CONTEXTS`, what a picture of a region shows of the Earth.
    Raises ValueError for invalid options.
    """
    check_axes(ax)
    chosen = get_measure(measure)
    surface = surfaces.surface_of(projection, region)
    words = words_of(surface.domain.projection, title, airy_kavrayskiy)
    values = surfaces.field(surface, chosen)
    scale = ColourScale.of_surfaces(chosen, [surface], [values], levels=levels, cmap=cmap, limits=limits)
    values_at = functools.partial(surfaces.measured, surface.domain.projection, chosen)
    draw_heatmap(ax, surface, values, scale, words, check_context(context), values_at, step=step)
    if colourbar:
        draw_bar_below(ax, scale)
    return scale


def draw_heatmap(
    ax: Axes,
    surface: Surface,
    values: FloatArray,
    scale: ColourScale,
    words: tuple[str, str],
    context: str,
    values_at: ValuesAt | None = None,
    *,
    step: float | None = None,
) -> None:
    """Draw prepared values at the vertices of a surface; isolines end where `values_at` jumps."""
    draw_basemap(ax, surface, context, step, over_colours=True)
    kept = main_cities(ax, surface) if context == "full" else None
    draw_field(ax, surface, values, scale, values_at, kept)
    draw_places(ax, surface, context)
    draw_title(ax, *words)


def draw_field(
    ax: Axes,
    surface: Surface,
    values: FloatArray,
    scale: ColourScale,
    values_at: ValuesAt | None = None,
    kept: FloatArray | None = None,
) -> None:
    """Draw prepared values as colours and isolines only, whose labels keep clear of some points (n, 2)."""
    mapped, used = triangulation(surface, surface.triangles)
    whole, values = values, values[used]
    if scale.measure.name == "meridian_convergence":
        mapped, values = _without_turn(mapped, values)
    missing = ~np.isfinite(values)
    unknown = missing[mapped.triangles].any(axis=1)
    mapped.set_mask(unknown)
    levels = shown_levels(scale, values[~missing])
    values = np.where(missing, scale.limits[0], values)
    clip = region_clip(ax, surface)
    draw_triangles(ax, mapped, values, clip, norm=scale.norm, cmap=scale.colours, zorder=0.5)
    if levels.size:
        traced = surfaces.crosses(values[mapped.triangles], levels) & ~unknown
        if values_at is not None:
            traced &= ~surfaces.jumping(surface, whole, levels, values_at)
        # Separate triangulations: matplotlib searches all triangles for each level.
        mapped = Triangulation(mapped.x, mapped.y, mapped.triangles[traced])
        edges = (surface.ground or surface).outline
        if kept is not None:
            edges = np.concatenate([edges, np.repeat(kept[:, None], 2, axis=1)])
        draw_isolines(ax, mapped, values, dict(zip(levels.tolist(), level_labels(levels), strict=True)), edges, clip)


def draw_isolines(
    ax: Axes,
    mesh: Triangulation,
    values: FloatArray,
    labels: Mapping[float, str],
    edges: FloatArray,
    clip: TransformedPath | None = None,
) -> None:
    """Draw isolines of values at the vertices of triangles, and their labels clear of edges, (n, 2, 2) segments."""
    style = {"colors": style_of(ax).colours.ink, "linewidths": 0.6, "linestyles": "solid", "zorder": 2.0}
    lines = ax.tricontour(mesh, values, levels=list(labels), **style)
    if clip is not None:
        lines.set_clip_path(clip)
    label_isolines(ax, lines, labels, edges)


def _without_turn(mapped: Triangulation, values: FloatArray) -> tuple[Triangulation, FloatArray]:
    """Field of angles with separate vertices for triangles across the jump from 180 to -180 degrees."""
    corners = values[mapped.triangles]
    turn = np.ptp(corners, axis=1) > 180.0
    torn = mapped.triangles[turn].ravel()
    first = np.repeat(corners[turn, 0], 3)
    unwrapped = first + np.mod(values[torn] - first + 180.0, 360.0) - 180.0
    triangles = mapped.triangles.copy()
    triangles[turn] = len(values) + np.arange(torn.size).reshape(-1, 3)
    x, y = np.concatenate([mapped.x, mapped.x[torn]]), np.concatenate([mapped.y, mapped.y[torn]])
    return Triangulation(x, y, triangles), np.concatenate([values, unwrapped])


def draw_bar_below(ax: Axes, scale: ColourScale) -> None:
    """Draw a colour bar below axes, which give way."""
    draw_colourbar(ax.figure, scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)


def draw_colourbar(figure: Any, scale: ColourScale, *, label: str | None = None, **place: Any) -> Colorbar:
    """Draw a horizontal colour bar with the levels as ticks; its label is by default the measure's name."""
    style = figure.style if isinstance(figure, StyledFigure) else FigureStyle()
    letters, colours = style.scale, style.colours
    bar: Colorbar = figure.colorbar(
        ScalarMappable(scale.norm, scale.colours), orientation="horizontal", extend=scale.extend, **place
    )
    ticks = _ticks(scale, bar.ax.get_window_extent().width / figure.dpi * 72.0 / (letters * _TICK))
    bar.set_ticks(ticks, labels=level_labels(np.array(ticks)))
    bar.minorticks_off()
    bar.ax.tick_params(
        labelsize=letters * _TICK,
        length=letters * 3.0,
        pad=letters * (2.0 if style.is_tight else 3.5),
        color=colours.text,
        labelcolor=colours.text,
    )
    bar.set_label(
        scale.label if label is None else label,
        fontsize=letters * 9.0,
        labelpad=letters * (1.0 if style.is_tight else 4.0),
        color=colours.text,
    )
    bar.outline.set(linewidth=0.5, edgecolor="black")
    if isinstance(figure, StyledFigure):
        figure.fit(bar.ax.xaxis.label)
        bar.outline.set_edgecolor(colours.outline)
    return bar


def _ticks(scale: ColourScale, length: float) -> list[float]:
    """Levels whose labels fit on a bar, whose length is in units of the labels' size."""
    low, high = scale.limits
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    if not levels.size:
        return [low, high]
    places = length * np.asarray(scale.norm(levels), dtype=float)
    reach = 0.5 * np.array([text_width(label, 1.0) for label in level_labels(levels)])

    def are_clear(chosen: IntArray) -> bool:
        return bool((np.diff(places[chosen]) > reach[chosen][:-1] + reach[chosen][1:] + _AIR).all())

    # Even steps through the neutral value, or, if more fit, one after the other.
    middle = int(np.argmin(np.abs(levels - (1.0 if scale.measure.kind == "ratio" else 0.0))))
    steps = (np.arange(middle % every, levels.size, every) for every in range(1, levels.size + 1))
    even = next(chosen for chosen in steps if are_clear(chosen))
    each = [0]
    for index in range(1, levels.size):
        if places[index] - places[each[-1]] > reach[index] + reach[each[-1]] + _AIR:
            each.append(index)
    return [float(level) for level in levels[max(even, np.array(each), key=len)]]
