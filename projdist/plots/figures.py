"""Whole figures of one map or of several panels, and files of them."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap
from matplotlib.figure import Figure

from projdist._typing import FloatArray
from projdist.answers import LocalCorrections
from projdist.decisions import LDP
from projdist.matrices import get_measure
from projdist.plots.areas import check_context
from projdist.plots.basemap import airy_kavrayskiy_line, fit_titles, title_width
from projdist.plots.colours import colour_scale
from projdist.plots.differences import field_against, label_against, measure_against, values_against
from projdist.plots.ground import draw_ground_map, prepare_ground
from projdist.plots.local_fields import draw_local_field, prepare_local_field
from projdist.plots.pictures import AnyMeasure, Levels, draw_colourbar, draw_heatmap, draw_tissot
from projdist.plots.titles import title_of
from projdist.projections import Projection, ProjectionLike, listed_projections
from projdist.regions import GLOBE, Place, RegionLike, region_for, region_title
from projdist.support import check_instance, check_number, check_pair, check_path, quoted, replacing
from projdist.surfaces import Surface, fit, shown_part, surface_of, tissot_points

SUFFIXES = (".png", ".svg", ".pdf")
_UNDATED = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # the same picture is the same file
_SAVING = threading.Lock()

_GAP, _TITLE, _FOOT, _BAR = 0.15, 0.5, 0.3, 0.75  # inches
_BESIDE, _BELOW = 0.5, 0.16  # inches for the labels of a graticule
_COLUMNS = 5
_LEAST_TEXT = 0.7  # of the usual size: rather fewer columns than smaller titles


def tissot_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    airy_kavrayskiy: Sequence[float | None] | None = None,
    context: str = "full",
) -> Figure:
    """Tissot's indicatrices of one or more projections, all panels in one scale and with equal circles.

    `context` is what a picture of a region shows of the Earth, one of `CONTEXTS`.
    """
    check_context(context)
    maps = _maps(projections, region, titles, airy_kavrayskiy)
    radius, panels = fit([tissot_points(one.surface, step) for one in maps])
    figure, axes, room = _layout(maps, size, dpi, foot=_FOOT, one_scale=True)
    for ax, one, panel in zip(axes, maps, panels, strict=True):
        draw_tissot(ax, one.surface, panel, radius, one.title, one.airy_kavrayskiy, context)
    fit_titles(axes, room)
    text = f"Ellipses: circles on the ground with a radius of {_length(radius)}{_over(maps)}"
    figure.text(0.5, 0.08 / figure.get_figheight(), text, ha="center", va="bottom", fontsize=7.5, color="#555555")
    return figure


def heatmap_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    measure: AnyMeasure = "fisher",
    against: ProjectionLike | None = None,
    region: RegionLike | None = None,
    step: float | None = None,
    levels: Levels = None,
    cmap: str | Colormap | None = None,
    limits: tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    airy_kavrayskiy: Sequence[float | None] | None = None,
    context: str = "full",
) -> Figure:
    """A measure of one or more projections as heat maps, all panels with one colour bar.

    With `against`, another map, it is the measure less that of the other map at the same place, or, of scales, over it.
    `context` is what a picture of a region shows of the Earth, one of `CONTEXTS`.
    """
    check_context(context)
    chosen = get_measure(measure)
    other = None if against is None else Projection.from_user_input(against)
    maps = _maps(projections, region, titles, airy_kavrayskiy, other)
    values = [field_against(one.surface, chosen, other) for one in maps]
    scale = colour_scale(
        measure_against(chosen, other),
        [value[: one.surface.nodes] for value, one in zip(values, maps, strict=True)],
        [one.surface.weights for one in maps],
        levels=levels,
        cmap=cmap,
        limits=limits,
    )
    figure, axes, room = _layout(maps, size, dpi, foot=_BAR, one_scale=False)
    for ax, one, value in zip(axes, maps, values, strict=True):
        values_at = values_against(one.surface.domain.projection, chosen, other)
        draw_heatmap(ax, one.surface, value, scale, step, one.title, one.airy_kavrayskiy, context, values_at)
    fit_titles(axes, room)
    draw_colourbar(figure, scale, cax=_bar_axes(figure)).set_label(
        f"{label_against(scale, chosen, [one.surface.domain.projection.name for one in maps], other)}{_over(maps)}"
    )
    return figure


def local_figure(
    projection: ProjectionLike,
    radius_km: float,
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
) -> tuple[Figure, LocalCorrections]:
    """The local corrections of a projection over caps of `radius_km`, as `local_field` draws them; and their values."""
    maps = _maps([projection], region, None if title is None else [title], None)
    local = prepare_local_field(maps[0].surface, radius_km, step)
    figure, axes, room = _layout(maps, size, dpi, foot=_BAR, one_scale=False)
    draw_local_field(axes[0], local, title)
    fit_titles(axes, room)
    draw_colourbar(figure, local.scale, cax=_bar_axes(figure)).set_label(f"{local.scale.label}{_over(maps)}")
    return figure, local.corrections


def ldp_figure(
    found: LDP, *, size: tuple[float, float] | None = None, dpi: float = 150.0, title: str | None = None
) -> Figure:
    """The distortion of a low-distortion projection at the heights of the ground, as `ground_map` draws it."""
    prepared = prepare_ground(found)
    figure, axes, room = _layout(
        [_Map(prepared.surface, found.region, title, None)], size, dpi, foot=_BAR, one_scale=False
    )
    draw_ground_map(axes[0], prepared, title)
    fit_titles(axes, room)
    draw_colourbar(figure, prepared.scale, cax=_bar_axes(figure))
    return figure


def save(figure: Figure, path: str | os.PathLike[str], *, dpi: float | None = None, overwrite: bool = True) -> Path:
    """Write a figure as .png, .svg or .pdf; an existing file is replaced only when the new one is complete.

    Raises FileExistsError where there is one and it is not to be overwritten.
    """
    check_instance("figure", figure, Figure, "a Figure of matplotlib")
    path = check_path("picture file", path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"Invalid picture file '{path}'. Its suffix must be .png, .svg or .pdf.")
    dots = figure.dpi if dpi is None else check_dpi(dpi)
    # One thread at a time: the salt is a setting of all of matplotlib.
    with replacing(path, overwrite=overwrite) as new, _SAVING, rc_context({"svg.hashsalt": "projdist"}):
        figure.savefig(new, format=suffix[1:], dpi=dots, metadata=_UNDATED[suffix])
    return path


@dataclass(frozen=True)
class _Map:
    """What a panel shows, and what stands above it."""

    surface: Surface
    region: Place
    title: str | None
    airy_kavrayskiy: float | None

    @property
    def title_width(self) -> float:
        """In inches, at the usual size."""
        name = title_of(self.surface.domain.projection) if self.title is None else self.title
        return title_width(name, airy_kavrayskiy_line(self.airy_kavrayskiy))


def _maps(
    projections: ProjectionLike | Iterable[ProjectionLike],
    region: RegionLike | None,
    titles: Sequence[str | None] | None,
    airy_kavrayskiy: Sequence[float | None] | None,
    other: Projection | None = None,
) -> list[_Map]:
    """The maps of a figure, all of one region; a single projection need not be in a list."""
    listed = listed_projections(projections)
    if not listed:
        raise ValueError("Invalid list of projections '[]'. It must name at least one.")
    chosen = [Projection.from_user_input(one) for one in listed]
    place = region_for(region, chosen if other is None else [*chosen, other])
    above = zip(chosen, _each(titles, len(listed)), _each(airy_kavrayskiy, len(listed)), strict=True)
    shown = shown_part(place)
    return [_Map(surface_of(projection, shown), place, title, figure) for projection, title, figure in above]


def _over(maps: list[_Map]) -> str:
    """The region of all maps in words, where it is not the globe."""
    region = maps[0].region
    if region == GLOBE:
        return ""
    away = "" if maps[0].surface.domain.region == region else "; parts far away are not drawn"
    return f", over {region_title(region)}{away}"


def _each(values: Sequence[Any] | None, count: int) -> Sequence[Any]:
    if values is None:
        return [None] * count
    if not isinstance(values, list | tuple | np.ndarray) or len(values) != count:
        raise ValueError(f"Invalid titles or figures {quoted(values)}. There must be one for each of {count} maps.")
    return values


def check_size(size: Any) -> tuple[float, float] | None:
    """A width and a height in inches, or None for as much as is needed."""
    if size is None:
        return None
    pair = check_pair("size", size)
    if not (np.isfinite(pair).all() and min(pair) > 0):
        raise ValueError(f"Invalid size {quoted(size)}. It must be a width and a height in inches, both positive.")
    return pair


def check_dpi(dpi: Any) -> float:
    """Dots per inch."""
    number = check_number("dpi", dpi)
    if not 0.0 < number < np.inf:
        raise ValueError(f"Invalid dpi {quoted(dpi)}. It must be positive.")
    return number


def _length(metres: float) -> str:
    if metres < 1e3:
        return f"{metres:.3g} m"
    return f"{metres / 1e3:,.0f} km" if metres >= 1e5 else f"{metres / 1e3:.3g} km"


@dataclass(frozen=True)
class _Grid:
    """Panels in columns; `scale` is inches per unit of the maps' shapes, `rows` the heights of the rows in inches."""

    columns: int
    width: float
    height: float
    scale: float
    rows: FloatArray

    @property
    def pitch(self) -> float:
        """The width of a column in inches."""
        return (self.width - _GAP) / self.columns


def _grid(
    shapes: FloatArray,
    columns: int,
    size: tuple[float, float] | None,
    foot: float,
    title_width: float,
    labels: tuple[float, float],
) -> _Grid:
    """The arrangement of maps of `shapes`, (n, 2), in a number of columns, as large as it can be."""
    count = len(shapes)
    beside, below = labels
    rows = np.array([shapes[k : k + columns, 1].max() for k in range(0, count, columns)])
    fixed = foot + rows.size * (_TITLE + _GAP + below)
    width = size[0] if size else (8.0 if count == 1 else 11.0)
    height = size[1] if size else (9.0 if count == 1 else 3.0 + 3.0 * rows.size)
    across = width - _GAP * (columns + 1) - beside * columns
    scale = min(across / (columns * shapes[:, 0].max()), (height - fixed) / rows.sum())
    if not size:
        pitch = max(shapes[:, 0].max() * scale + beside, min(title_width, (width - _GAP) / columns - _GAP)) + _GAP
        width = max(columns * pitch + _GAP, 4.5)
        height = fixed + scale * rows.sum()
    spare = (height - fixed - scale * rows.sum()) / rows.size
    return _Grid(columns, width, height, scale, scale * rows + spare + _TITLE + _GAP + below)


def _layout(
    maps: Sequence[_Map], size: tuple[float, float] | None, dpi: float, *, foot: float, one_scale: bool
) -> tuple[Figure, list[Axes], float]:
    """A figure with room at its foot, axes in the shape of each map, and the room for their titles in inches."""
    views = np.array([one.surface.view for one in maps])
    shapes = views[:, [1, 3]] - views[:, [0, 2]]
    if not one_scale:
        shapes = shapes / shapes.max(axis=1, keepdims=True)
    labels = (_BESIDE, _BELOW) if any(one.surface.is_local for one in maps) else (0.0, 0.0)
    widest = max(one.title_width for one in maps)
    return arranged(shapes, size, dpi, foot=foot, title_width=widest, labels=labels)


def arranged(
    shapes: FloatArray,
    size: tuple[float, float] | None,
    dpi: float,
    *,
    foot: float,
    title_width: float,
    labels: tuple[float, float] = (0.0, 0.0),
) -> tuple[Figure, list[Axes], float]:
    """A figure with room at its foot, and axes of `shapes`, widths and heights (n, 2), as large as they can be.

    Columns are as wide as `title_width` where the figure has room for it, with room for `labels` in inches to the left
    of and below the axes; last returned is the room for titles in inches.
    """
    size, dpi = check_size(size), check_dpi(dpi)
    count = len(shapes)
    # The fewest columns for each number of rows: four maps are two and two, not three and one.
    options = [
        _grid(shapes, columns, size, foot, title_width, labels)
        for columns in range(1, min(count, _COLUMNS) + 1)
        if -(-count // -(-count // columns)) == columns
    ]
    readable = [
        option for option in options if option.scale > 0 and option.pitch - _GAP >= _LEAST_TEXT * title_width - 1e-9
    ]
    # The largest maps, in a figure that is not much higher than wide.
    grid = max(readable or options, key=lambda option: option.scale * min(1.0, 1.1 * option.width / option.height))
    if not grid.scale > 0:
        width, height = size or (grid.width, grid.height)
        maps_text = "a map" if count == 1 else f"{count} maps"
        raise ValueError(f"Invalid size '{width:g},{height:g}'. It has no room for {maps_text}.")
    figure = Figure(figsize=(grid.width, grid.height), dpi=dpi)
    FigureCanvasAgg(figure)
    axes = []
    for index, (w, h) in enumerate(shapes * grid.scale):
        row, column = divmod(index, grid.columns)
        in_row = min(grid.columns, count - row * grid.columns)
        left = 0.5 * (grid.width - in_row * grid.pitch) + (column + 0.5) * grid.pitch - 0.5 * (w - labels[0])
        middle = grid.height - grid.rows[:row].sum() - 0.5 * (grid.rows[row] + _TITLE - labels[1])
        axes.append(
            figure.add_axes((left / grid.width, (middle - 0.5 * h) / grid.height, w / grid.width, h / grid.height))
        )
    return figure, axes, grid.pitch - _GAP - labels[0]


def _bar_axes(figure: Figure) -> Axes:
    """Axes at the foot of a figure, for a colour bar."""
    width, height = figure.get_size_inches()
    length = min(0.7 * width, 6.0)
    return figure.add_axes((0.5 - 0.5 * length / width, 0.48 / height, length / width, 0.13 / height))
