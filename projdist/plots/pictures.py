"""Drawing on given axes: indicatrices, heat maps, isolines with labels, and colour bars."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap
from matplotlib.contour import ContourSet
from matplotlib.patheffects import withStroke
from matplotlib.tri import Triangulation

from projdist._typing import FloatArray, IntArray
from projdist.matrices import Measure, get_measure
from projdist.plots.basemap import (
    CONTEXTS,
    airy_kavrayskiy_line,
    check_context,
    draw_ground,
    draw_lines,
    draw_surroundings,
    draw_title,
    region_clip,
    set_view,
    triangulation,
)
from projdist.plots.colours import ColourScale, colour_scale, level_labels, shows_isolines
from projdist.plots.places import draw_places, main_cities, shows_places
from projdist.plots.style import USUAL, StyledFigure, look_of, scale_of, text_width, title_of
from projdist.projections import ProjectionLike
from projdist.regions import RegionLike
from projdist.support import check_instance, check_number
from projdist.surfaces import (
    Indicatrices,
    Surface,
    ValuesAt,
    crosses,
    ellipses,
    field,
    fit,
    jumping,
    measured,
    principal_axes,
    surface_of,
    tissot_points,
    usual_exaggeration,
)

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
    size = _SIZE * scale_of(ax)
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
        text.set_path_effects([withStroke(linewidth=1.5, foreground=look_of(ax).colours.halo)])


# ---- pictures ------------------------------------------------------------------------------------


_VERTICES, _FEW_VERTICES, _MANY = 72, 24, 2000
_TICK, _AIR = 8.0, 0.6  # points, and of them between labels
_AXIS = 0.5  # points
_LEAST_FACTOR, _LARGEST_FACTOR = 0.1, 1e6
_EDGE, _EDGE_SHARE = 0.6, 0.06  # points, and of the width of the ellipses

AnyMeasure = str | Measure | Callable[[FloatArray], FloatArray]
Levels = int | Sequence[float] | None


def check_axes(ax: Any) -> None:
    """Check that an object is matplotlib axes, before the work."""
    check_instance("axes", ax, Axes, "Axes of matplotlib")


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

    The ellipses stand `step` degrees apart and are as large as they can be without overlap, unless
    `radius` states their size. With an `exaggeration` the logarithms of the principal scales are so many times as
    large, or, with "auto", as many as make them seen; `context`, one of `CONTEXTS`, is what of the Earth is shown about
    a region.
    """
    check_axes(ax)
    exaggeration = check_exaggeration(exaggeration)
    surface = surface_of(projection, region)
    points = [tissot_points(surface, step)]
    factor = usual_exaggeration(points) if isinstance(exaggeration, str) else exaggeration
    fitted, (panel,) = fit(points, radius, factor)
    draw_tissot(ax, surface, panel, fitted, title, airy_kavrayskiy_line(airy_kavrayskiy), check_context(context))
    return fitted


def draw_tissot(
    ax: Axes,
    surface: Surface,
    panel: Indicatrices,
    radius: float,
    title: str | None,
    below: str,
    context: str = CONTEXTS[-1],
    *,
    axes: bool = False,
) -> None:
    """Draw prepared indicatrices of a radius in metres, with the principal directions as crosses where wanted."""
    set_view(ax, surface)
    draw_ground(ax, surface, context)
    draw_lines(ax, surface, None, context=context)
    draw_ellipses(ax, panel, radius)
    if axes:
        _draw_axes(ax, panel, radius)
    _draw_places(ax, surface, context)
    draw_title(ax, title_of(surface.domain.projection) if title is None else title, below)


def draw_ellipses(ax: Axes, panel: Indicatrices, radius: float, matrix: FloatArray | None = None) -> None:
    """Draw ellipses only, in metres, or transformed by a matrix (2, 2)."""
    polygons = ellipses(panel, radius, _FEW_VERTICES if panel.lon.size > _MANY else _VERTICES)
    if matrix is not None:
        polygons = polygons @ matrix.T
    ax.add_collection(
        PolyCollection(
            list(polygons),
            facecolors=look_of(ax).colours.face,
            edgecolors=look_of(ax).colours.edge,
            linewidths=_edge_width(ax, polygons),
            zorder=2.0,
            label="indicatrices",
        ),
        autolim=False,
    )


def _draw_axes(ax: Axes, panel: Indicatrices, radius: float) -> None:
    """Draw the principal directions as crosses."""
    edge = look_of(ax).colours.edge
    crosses = LineCollection(list(principal_axes(panel, radius)), colors=edge, linewidths=_AXIS, zorder=2.1)
    crosses.set_label("principal directions")
    ax.add_collection(crosses, autolim=False)


def _draw_places(ax: Axes, surface: Surface, context: str) -> None:
    if context == "full" and shows_places(surface):
        draw_places(ax, surface)


def _edge_width(ax: Axes, polygons: FloatArray) -> float:
    """Line width in points of the ellipses' edges, smaller for small ellipses."""
    if not len(polygons):
        return _EDGE
    points = ax.get_window_extent().width * 72.0 / ax.figure.dpi / np.ptp(ax.get_xlim())
    return min(_EDGE, _EDGE_SHARE * points * float(np.median(np.ptp(polygons[..., 0], axis=1))))


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

    `levels` are the isolines in any order, or about how many; `limits` the ends of the colours;
    `step` the degrees between the lines of the graticule; `context`, one of `CONTEXTS`, what of the Earth is shown
    around a region. Raises ValueError for invalid options.
    """
    check_axes(ax)
    chosen = get_measure(measure)
    surface = surface_of(projection, region)
    values = field(surface, chosen)
    scale = colour_scale(chosen, [values[: surface.nodes]], [surface.weights], levels=levels, cmap=cmap, limits=limits)
    values_at = functools.partial(measured, surface.domain.projection, chosen)
    below = airy_kavrayskiy_line(airy_kavrayskiy)
    draw_heatmap(ax, surface, values, scale, step, title, below, check_context(context), values_at)
    if colourbar:
        draw_colourbar(ax.figure, scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)
    return scale


def draw_heatmap(
    ax: Axes,
    surface: Surface,
    values: FloatArray,
    scale: ColourScale,
    step: float | None,
    title: str | None,
    below: str,
    context: str = CONTEXTS[-1],
    values_at: ValuesAt | None = None,
) -> None:
    """Draw prepared values at the vertices of a surface; isolines end where `values_at` jumps."""
    set_view(ax, surface)
    draw_surroundings(ax, surface, context)
    draw_lines(ax, surface, step, over_colours=True, context=context)
    kept = main_cities(ax, surface) if context == "full" else None
    draw_field(ax, surface, values, scale, values_at, kept)
    _draw_places(ax, surface, context)
    draw_title(ax, title_of(surface.domain.projection) if title is None else title, below)


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
    present = values[~missing]
    values = np.where(missing, scale.limits[0], values)
    clip = region_clip(ax, surface)
    colours = ax.tripcolor(
        mapped,
        values,
        shading="gouraud",
        norm=scale.norm,
        cmap=scale.colours,
        rasterized=True,
        zorder=0.5,
    )
    if clip is not None:
        colours.set_clip_path(clip)
    inside = scale.levels[(scale.levels > present.min()) & (scale.levels < present.max())]
    if inside.size and shows_isolines(scale, present):
        traced = crosses(values[mapped.triangles], inside) & ~unknown
        if values_at is not None:
            traced &= ~jumping(surface, whole, inside, values_at)
        lines = ax.tricontour(
            # Separate triangulations: matplotlib searches all triangles for each level.
            Triangulation(mapped.x, mapped.y, mapped.triangles[traced]),
            values,
            levels=inside,
            colors=look_of(ax).colours.ink,
            linewidths=0.6,
            linestyles="solid",
            zorder=2.0,
        )
        if clip is not None:
            lines.set_clip_path(clip)
        labels = dict(zip(inside.tolist(), level_labels(inside), strict=True))
        edges = (surface.ground or surface).outline
        if kept is not None:
            edges = np.concatenate([edges, np.repeat(kept[:, None], 2, axis=1)])
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


def draw_colourbar(figure: Any, scale: ColourScale, *, label: str | None = None, **place: Any) -> Colorbar:
    """Draw a horizontal colour bar with the levels as ticks; its label is by default the measure's name."""
    looked = isinstance(figure, StyledFigure)
    letters, is_tight = (figure.scale, figure.is_tight) if looked else (1.0, False)
    colours = figure.look.colours if looked else USUAL.colours
    bar: Colorbar = figure.colorbar(
        ScalarMappable(scale.norm, scale.colours), orientation="horizontal", extend=scale.extend, **place
    )
    ticks = _ticks(scale, bar.ax.get_window_extent().width / figure.dpi * 72.0 / (letters * _TICK))
    bar.set_ticks(ticks, labels=level_labels(np.array(ticks)))
    bar.minorticks_off()
    bar.ax.tick_params(
        labelsize=letters * _TICK,
        length=letters * 3.0,
        pad=letters * (2.0 if is_tight else 3.5),
        color=colours.text,
        labelcolor=colours.text,
    )
    bar.set_label(
        scale.label if label is None else label,
        fontsize=letters * 9.0,
        labelpad=letters * (1.0 if is_tight else 4.0),
        color=colours.text,
    )
    if looked:
        figure.fit(bar.ax.xaxis.label)
    bar.outline.set(linewidth=0.5, edgecolor=colours.outline if looked else "black")
    return bar


def _ticks(scale: ColourScale, length: float) -> list[float]:
    """Levels whose labels fit on a bar, whose length is in units of the labels' size."""
    low, high = scale.limits
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    if not levels.size:
        return [low, high]
    places = length * np.asarray(scale.norm(levels), dtype=float)
    reach = 0.5 * np.array([text_width(label, 1.0) for label in level_labels(levels)])
    # Even steps through the neutral value, or, if more fit, one after the other.
    middle = int(np.argmin(np.abs(levels - (1.0 if scale.measure.kind == "ratio" else 0.0))))
    steps = (np.arange(middle % every, levels.size, every) for every in range(1, levels.size + 1))
    even = next(chosen for chosen in steps if _are_clear(places[chosen], reach[chosen]))
    chosen = max(even, _one_after_the_other(places, reach), key=len)
    return [float(level) for level in levels[chosen]]


def _are_clear(places: FloatArray, reach: FloatArray) -> bool:
    return bool((np.diff(places) > reach[:-1] + reach[1:] + _AIR).all())


def _one_after_the_other(places: FloatArray, reach: FloatArray) -> IntArray:
    """Indices of labels, each the next that is clear of the previous one."""
    chosen = [0]
    for index in range(1, len(places)):
        if places[index] - places[chosen[-1]] > reach[index] + reach[chosen[-1]] + _AIR:
            chosen.append(index)
    return np.array(chosen)
