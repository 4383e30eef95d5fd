"""Whole figures of maps: Tissot's indicatrices, heat maps, modes, corrections; differences of two maps; saving."""

from __future__ import annotations

import functools
import io
import os
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure

from projdist._typing import FloatArray
from projdist.answers import LocalCorrections
from projdist.field import sample
from projdist.matrices import Measure, Modes, get_measure
from projdist.plots.basemap import airy_kavrayskiy_line, check_context, fit_titles
from projdist.plots.colours import ColourScale, colour_scale
from projdist.plots.ground_distortion import (
    below_ground_map,
    below_local_field,
    draw_ground_map,
    draw_local_field,
    prepare_ground,
    prepare_local_field,
)
from projdist.plots.layouts import BAR, FOOT, arranged, bar_axes, check_dpi
from projdist.plots.pictures import AnyMeasure, Levels, check_exaggeration, draw_colourbar, draw_heatmap, draw_tissot
from projdist.plots.style import Look, StyledFigure, look_for, title_of
from projdist.projections import Projection, ProjectionLike, listed_projections
from projdist.regions import GLOBE, Place, RegionLike, region_for, region_title
from projdist.support import check_choice, check_instance, check_path, check_text, quoted, replacing
from projdist.surfaces import (
    Surface,
    ValuesAt,
    field,
    fit,
    measured,
    shown_part,
    surface_of,
    tissot_points,
    usual_exaggeration,
)

if TYPE_CHECKING:
    from projdist.decisions import LDP


_TURN = 360.0
_DIRECTIONS = ("meridian_convergence",)  # which go round


def field_against(surface: Surface, measure: Measure, other: Projection | None) -> FloatArray:
    """Measure at the vertices of a surface, minus that of another map there, or for a ratio divided by it."""
    values = field(surface, measure)
    if other is None:
        return values
    others = field(replace(surface, domain=replace(surface.domain, projection=other)), measure)
    return _against(values, others, measure)


def values_against(projection: Projection, measure: Measure, other: Projection | None) -> ValuesAt:
    """The values of `field_against` as a function of longitudes and latitudes."""

    def values_at(lon: FloatArray, lat: FloatArray) -> FloatArray:
        values = measured(projection, measure, lon, lat)
        return values if other is None else _against(values, measured(other, measure, lon, lat), measure)

    return values_at


def _against(values: FloatArray, others: FloatArray, measure: Measure) -> FloatArray:
    """Difference of values, or for a ratio their quotient."""
    if measure.kind == "ratio":
        with np.errstate(divide="ignore", invalid="ignore"):
            found = values / others
        return np.where(np.isfinite(found), found, np.nan)
    found = values - others
    return np.mod(found + _TURN / 2, _TURN) - _TURN / 2 if measure.name in _DIRECTIONS else found


def measure_against(measure: Measure, other: Projection | None) -> Measure:
    """Measure of the colours: a ratio is neutral at 1, a difference at 0."""
    if other is None or measure.kind == "ratio":
        return measure
    return replace(measure, name=f"difference_of_{measure.name}", kind="signed")


def label_against(scale: ColourScale, measure: Measure, maps: Sequence[str], other: Projection | None) -> str:
    """Label of the colour bar: `Angular distortion omega (degrees): Robinson less Mollweide`."""
    if other is None:
        return scale.label
    label = replace(scale, measure=measure).label
    one = maps[0] if len(maps) == 1 else "each map"
    return f"{label}: {one} {'over' if measure.kind == 'ratio' else 'less'} {other.name}"


# ---- figures -------------------------------------------------------------------------------------


SUFFIXES = (".png", ".svg", ".pdf")
_UNDATED = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # the same picture is the same file
_SAVING = threading.Lock()

_MODE = "Part of the Fisher distortion in the mode, with its sign"
_LEAST_SHARE, _TOLERANCE = 0.005, 1e-6
_BESIDE, _BELOW = 0.5, 0.16  # inches for the labels of a graticule


def figure(projections: ProjectionLike | Iterable[ProjectionLike], kind: str = "heatmap", **options: Any) -> Figure:
    """Figure of a kind, "heatmap" or "tissot", with the options of `heatmap_figure` or `tissot_figure`."""
    kinds: dict[str, Callable[..., Figure]] = {"heatmap": heatmap_figure, "tissot": tissot_figure}
    return kinds[check_choice("kind", kind, list(kinds))](projections, **options)


def tissot_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    airy_kavrayskiy: Sequence[float | None] | None = None,
    grid: tuple[float, float] | None = None,
    exaggeration: float | str = 1.0,
    axes: bool = False,
    context: str = "full",
    look: Look | str | None = None,
) -> Figure:
    """Tissot's indicatrices of one or more projections, all panels in one scale and with equal circles.

    They are `step` degrees apart on the ground, or at the crossings of a `grid` of degrees of latitude and longitude.
    With an `exaggeration` the logarithms of the principal scales are so many times as large, and with "auto" as
    many as make them seen. `axes` draws the principal directions. `context` is what a picture of a region shows of the
    Earth, one of `CONTEXTS`.
    """
    check_context(context)
    exaggeration = check_exaggeration(exaggeration)
    look = look_for(look)
    maps = _maps(projections, region, titles, airy_kavrayskiy, look)
    points = [tissot_points(one.surface, step, grid) for one in maps]
    factor = usual_exaggeration(points) if isinstance(exaggeration, str) else exaggeration
    radius, panels = fit(points, exaggeration=factor, crowded=grid is not None)
    with look.applied():
        figure, panes, room = _layout(maps, size, dpi, foot=FOOT, one_scale=True, look=look)
        for ax, one, panel in zip(panes, maps, panels, strict=True):
            draw_tissot(ax, one.surface, panel, radius, *one.words, context, axes=axes)
        fit_titles(panes, room)
        times = "" if factor == 1.0 else f", distortion exaggerated {factor:g} times"
        figure.foot(f"Ellipses: circles on the ground with a radius of {_length(radius)}{times}{_over(maps)}")
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
    look: Look | str | None = None,
) -> Figure:
    """A measure of one or more projections as heat maps, all panels with one colour bar.

    With `against`, another map, it is the measure less that of the other map at the same place, or, of scales, over it.
    `context` is what a picture of a region shows of the Earth, one of `CONTEXTS`.
    """
    check_context(context)
    chosen = get_measure(measure)
    other = None if against is None else Projection.from_user_input(against)
    look = look_for(look)
    maps = _maps(projections, region, titles, airy_kavrayskiy, look, other)
    values = [field_against(one.surface, chosen, other) for one in maps]
    scale = colour_scale(
        measure_against(chosen, other),
        [value[: one.surface.nodes] for value, one in zip(values, maps, strict=True)],
        [one.surface.weights for one in maps],
        levels=levels,
        cmap=cmap,
        limits=limits,
        colours=look.colours,
    )
    with look.applied():
        figure, axes, room = _layout(maps, size, dpi, foot=BAR, one_scale=False, look=look)
        for ax, one, value in zip(axes, maps, values, strict=True):
            values_at = values_against(one.surface.domain.projection, chosen, other)
            draw_heatmap(ax, one.surface, value, scale, step, *one.words, context, values_at)
        fit_titles(axes, room)
        names = [one.surface.domain.projection.name for one in maps]
        _draw_bar(figure, scale, f"{label_against(scale, chosen, names, other)}{_over(maps)}")
    return figure


def modes_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: RegionLike | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    context: str = "full",
    look: Look | str | None = None,
) -> Figure:
    """Modes of maps' distortions, a panel per mode with its signed part of the distortion.

    Positive values mean a larger area or a wider shape than after the best linear map, as the name of the mode
    says; the squares of all modes add to that of the Fisher distortion. Modes of less than half a per cent are left
    out. `titles` are for the maps.
    """
    check_context(context)
    look = look_for(look)
    maps = _maps(projections, region, titles, None, look)
    panels: list[_Map] = []
    scores: list[Measure] = []
    for one in maps:
        found = sample(one.surface.domain.projection, one.region, tolerance=_TOLERANCE).modes
        told = np.flatnonzero(found.shares >= _LEAST_SHARE)
        for k in told if told.size else [0]:
            below = f"{100.0 * found.shares[k]:.0f} % {found.words[k]}"
            panels.append(replace(one, below=below, place=""))
            scores.append(Measure(_MODE, functools.partial(_score, found, int(k)), kind="signed"))
    values = [field(one.surface, score) for one, score in zip(panels, scores, strict=True)]
    scale = colour_scale(
        scores[0],
        [value[: one.surface.nodes] for value, one in zip(values, panels, strict=True)],
        [one.surface.weights for one in panels],
        colours=look.colours,
    )
    with look.applied():
        figure, axes, room = _layout(panels, size, dpi, foot=BAR, one_scale=False, look=look)
        for ax, one, value, score in zip(axes, panels, values, scores, strict=True):
            values_at = functools.partial(measured, one.surface.domain.projection, score)
            draw_heatmap(ax, one.surface, value, scale, None, *one.words, context, values_at)
        fit_titles(axes, room)
        _draw_bar(figure, scale, f"{_MODE}{_over([replace(maps[0], place='')])}")
    return figure


def _score(found: Modes, k: int, J: FloatArray) -> FloatArray:
    """Scores of Jacobians in one mode."""
    return found.scores(J)[..., k]


def local_figure(
    projection: ProjectionLike,
    radius_km: float,
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
    look: Look | str | None = None,
) -> tuple[Figure, LocalCorrections]:
    """The local corrections of a projection over caps of `radius_km`, as `local_field` draws them; and their values."""
    look = look_for(look)
    maps = _maps([projection], region, None if title is None else [title], None, look)
    local = prepare_local_field(maps[0].surface, radius_km, step)
    maps = [replace(maps[0], below=below_local_field(local))]
    with look.applied():
        figure, axes, room = _layout(maps, size, dpi, foot=BAR, one_scale=False, look=look)
        draw_local_field(axes[0], local, maps[0].title)
        fit_titles(axes, room)
        _draw_bar(figure, local.scale, f"{local.scale.label}{_over(maps)}")
    return figure, local.corrections


def ldp_figure(
    found: LDP,
    *,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
    look: Look | str | None = None,
) -> Figure:
    """The distortion of a low-distortion projection at the heights of the ground, as `ground_map` draws it."""
    look = look_for(look)
    prepared = prepare_ground(found)
    title = look.title or title
    with look.applied():
        drawn = _Map(prepared.surface, found.region, title, None, below_ground_map(prepared))
        figure, axes, room = _layout([drawn], size, dpi, foot=BAR, one_scale=False, look=look)
        draw_ground_map(axes[0], prepared, title)
        fit_titles(axes, room)
        _draw_bar(figure, prepared.scale, prepared.scale.label)
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
    content = encoded(figure, suffix, dpi=dots)  # matplotlib's PDFs cannot end on a disk that is full
    with replacing(path, overwrite=overwrite) as new:
        new.write_bytes(content)
    return path


def encoded(figure: Figure, suffix: str, *, dpi: float) -> bytes:
    """Bytes of a figure as .png, .svg or .pdf; raises ValueError."""
    check_instance("figure", figure, Figure, "a Figure of matplotlib")
    check_choice("suffix", suffix, SUFFIXES)
    content = io.BytesIO()
    _write(figure, content, suffix, check_dpi(dpi))
    return content.getvalue()


def _write(figure: Figure, target: Path | BinaryIO, suffix: str, dpi: float) -> None:
    """Write a figure without a date, one thread at a time, as the salt is global to matplotlib."""
    with _SAVING, rc_context({"svg.hashsalt": "projdist"}):
        figure.savefig(target, format=suffix[1:], dpi=dpi, metadata=_UNDATED[suffix])


def _draw_bar(figure: StyledFigure, scale: ColourScale, label: str) -> None:
    """Draw a colour bar at the foot of a figure, unless its style has none."""
    if figure.look.colourbar:
        draw_colourbar(figure, scale, cax=bar_axes(figure), label=label)


@dataclass(frozen=True)
class _Map:
    """Surface, title and subtitle of a panel."""

    surface: Surface
    region: Place
    title: str | None
    airy_kavrayskiy: float | None
    below: str = ""
    place: str = ""

    @property
    def words(self) -> tuple[str, str]:
        """Title and subtitle."""
        name = title_of(self.surface.domain.projection) if self.title is None else check_text("title", self.title)
        below = self.below or airy_kavrayskiy_line(self.airy_kavrayskiy)
        return name, " · ".join(part for part in (self.place, below) if part)


def _maps(
    projections: ProjectionLike | Iterable[ProjectionLike],
    region: RegionLike | None,
    titles: Sequence[str | None] | None,
    airy_kavrayskiy: Sequence[float | None] | None,
    look: Look,
    other: Projection | None = None,
) -> list[_Map]:
    """Panels of a figure, all of one region, for one projection or several."""
    listed = listed_projections(projections)
    if not listed:
        raise ValueError("Invalid list of projections '[]'. It must name at least one.")
    chosen = [Projection.from_user_input(one) for one in listed]
    place = region_for(region, chosen if other is None else [*chosen, other])
    if look.title and len(listed) == 1:
        titles = [look.title]
    above = zip(chosen, _each(titles, len(listed)), _each(airy_kavrayskiy, len(listed)), strict=True)
    shown = shown_part(place)
    words = region_title(place) if len(listed) == 1 and place != GLOBE else ""  # else at the foot, once for all
    return [
        _Map(surface_of(projection, shown), place, title, figure, place=words) for projection, title, figure in above
    ]


def _over(maps: list[_Map]) -> str:
    """Suffix that names the region, unless it is the globe or already in the title of the only map."""
    region = maps[0].region
    if region == GLOBE:
        return ""
    away = "" if maps[0].surface.domain.region == region else "; parts far away are not drawn"
    return away if maps[0].place else f", over {region_title(region)}{away}"


def _each(values: Sequence[Any] | None, count: int) -> Sequence[Any]:
    if values is None:
        return [None] * count
    if not isinstance(values, list | tuple | np.ndarray) or len(values) != count:
        raise ValueError(f"Invalid titles or figures {quoted(values)}. There must be one for each of {count} maps.")
    return values


def _length(metres: float) -> str:
    if metres < 1e3:
        return f"{metres:.3g} m"
    return f"{metres / 1e3:,.0f} km" if metres >= 1e5 else f"{metres / 1e3:.3g} km"


def _layout(
    maps: Sequence[_Map],
    size: tuple[float, float] | None,
    dpi: float,
    *,
    foot: float,
    one_scale: bool,
    look: Look,
) -> tuple[StyledFigure, list[Axes], float]:
    """Figure with a foot, axes in the shape of each map, and the room for their titles in inches."""
    views = np.array([one.surface.view for one in maps])
    shapes = views[:, [1, 3]] - views[:, [0, 2]]
    if not one_scale:
        shapes = shapes / shapes.max(axis=1, keepdims=True)
    labels = (_BESIDE, _BELOW) if any(one.surface.is_local for one in maps) else (0.0, 0.0)
    return arranged(shapes, size, dpi, foot=foot, words=[one.words for one in maps], labels=labels, look=look)
