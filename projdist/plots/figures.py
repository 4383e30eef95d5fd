"""Whole figures of maps: Tissot's indicatrices, heat maps, modes, corrections; differences of two maps; saving."""

from __future__ import annotations

import functools
import io
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast, overload

import numpy as np
from matplotlib import colors, rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist import answers, decisions, earth, field, matrices, regions, support, surfaces
from projdist._typing import AnyPath, FloatArray
from projdist.plots import SUFFIXES, basemap, map_drawing, styled_figure
from projdist.plots.colours import ColourScale, Levels
from projdist.plots.style import Look, look_for
from projdist.projections import Projection, ProjectionLike


def field_against(surface: surfaces.Surface, measure: matrices.Measure, other: Projection | None) -> FloatArray:
    """Measure at the vertices of a surface, minus that of another map there, or for a ratio divided by it."""
    values = surfaces.field(surface, measure)
    if other is None:
        return values
    others = surfaces.field(replace(surface, domain=replace(surface.domain, projection=other)), measure)
    return _against(values, others, measure)


def _measured_against(
    projection: Projection, measure: matrices.Measure, other: Projection | None, lon: FloatArray, lat: FloatArray
) -> FloatArray:
    """The values of `field_against` at points."""
    values = field.measure_at(projection, measure, lon, lat)
    return values if other is None else _against(values, field.measure_at(other, measure, lon, lat), measure)


def _against(values: FloatArray, others: FloatArray, measure: matrices.Measure) -> FloatArray:
    """Difference of values, or for a ratio their quotient."""
    if measure.kind == "ratio":
        with np.errstate(divide="ignore", invalid="ignore"):
            found = values / others
        return np.where(np.isfinite(found), found, np.nan)
    found = values - others
    return earth.wrapped(found) if measure.name == "meridian_convergence" else found


# ---- figures -------------------------------------------------------------------------------------

_UNDATED = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # the same picture is the same file
_SAVING = threading.Lock()

_MODE = "Part of the Fisher distortion in the mode, with its sign"
_LEAST_SHARE, _TOLERANCE = 0.005, 1e-6
_BESIDE, _BELOW = 0.5, 0.16  # inches for the labels of a graticule


def figure(projections: ProjectionLike | Iterable[ProjectionLike], kind: str = "heatmap", **options: Any) -> Figure:
    """Figure of a kind, "heatmap" or "tissot", with the options of `heatmap_figure` or `tissot_figure`."""
    kinds: dict[str, Callable[..., Figure]] = {"heatmap": heatmap_figure, "tissot": tissot_figure}
    return kinds[support.check_choice("kind", kind, list(kinds))](projections, **options)


@overload
def tissot(projections: ProjectionLike | Iterable[ProjectionLike], ax: None = None, **options: Any) -> Figure: ...
@overload
def tissot(projections: ProjectionLike, ax: Axes, **options: Any) -> float: ...
def tissot(
    projections: ProjectionLike | Iterable[ProjectionLike], ax: Axes | None = None, **options: Any
) -> Figure | float:
    """Tissot's indicatrices: a `tissot_figure` with its options, or on axes of one's own, with the radius returned.

    On `ax` the options are `region`, `step`, `radius` in metres of the circles on the ground (by default as large as
    they can be without overlap), `exaggeration`, `title`, `airy_kavrayskiy` (written below it) and `context`.
    """
    if ax is None:
        return tissot_figure(projections, **options)
    return map_drawing.tissot(ax, cast(Any, projections), **options)


@overload
def heatmap(projections: ProjectionLike | Iterable[ProjectionLike], ax: None = None, **options: Any) -> Figure: ...
@overload
def heatmap(projections: ProjectionLike, ax: Axes, **options: Any) -> ColourScale: ...
def heatmap(
    projections: ProjectionLike | Iterable[ProjectionLike], ax: Axes | None = None, **options: Any
) -> Figure | ColourScale:
    """A measure as colours: a `heatmap_figure` with its options, or on axes of one's own, with the colours returned.

    On `ax` the options are `measure`, `region`, `step` in degrees of the graticule, `levels` of the isolines or about
    how many, `cmap`, `limits` of the colours, `colourbar`, `title`, `airy_kavrayskiy` and `context`.
    """
    if ax is None:
        return heatmap_figure(projections, **options)
    return map_drawing.heatmap(ax, cast(Any, projections), **options)


def tissot_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: regions.RegionLike | None = None,
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
    An `exaggeration` multiplies the logarithms of the principal scales; "auto" takes a factor that makes them visible.
    `axes` draws the principal directions. `context`, of `CONTEXTS`, is what a picture shows of the Earth.
    """
    support.check_choice("context", context, basemap.CONTEXTS)
    exaggeration = map_drawing.check_exaggeration(exaggeration)
    look = look_for(look)
    maps = _maps(projections, region, titles, airy_kavrayskiy, look)
    points = [surfaces.tissot_points(one.surface, step, grid) for one in maps]
    factor = surfaces.usual_exaggeration(points) if isinstance(exaggeration, str) else exaggeration
    radius, panels = surfaces.fit(points, exaggeration=factor, crowded=grid is not None)
    km = f"{radius / 1e3:,.0f}" if radius >= 1e5 else f"{radius / 1e3:.3g}"
    length = f"{radius:.3g} m" if radius < 1e3 else f"{km} km"
    times = "" if factor == 1.0 else f", distortion exaggerated {factor:g} times"

    def draw(ax: Axes, k: int) -> None:
        map_drawing.draw_tissot(ax, maps[k].surface, panels[k], radius, maps[k].words, context, axes=axes)

    foot = f"Ellipses: circles on the ground with a radius of {length}{times}{_over(maps)}"
    return _figure(maps, draw, size, dpi, look, foot)


def heatmap_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    measure: map_drawing.AnyMeasure = "fisher",
    against: ProjectionLike | None = None,
    region: regions.RegionLike | None = None,
    step: float | None = None,
    levels: Levels = None,
    cmap: str | colors.Colormap | None = None,
    limits: tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    airy_kavrayskiy: Sequence[float | None] | None = None,
    context: str = "full",
    look: Look | str | None = None,
) -> Figure:
    """A measure of one or more projections as heat maps, all panels with one colour bar.

    `against` is another map, whose measure at the same place is subtracted; scales are divided by it. `context` is what
    a picture of a region shows of the Earth, one of `CONTEXTS`.
    """
    support.check_choice("context", context, basemap.CONTEXTS)
    chosen = matrices.get_measure(measure)
    other = None if against is None else Projection.from_user_input(against)
    look = look_for(look)
    maps = _maps(projections, region, titles, airy_kavrayskiy, look, other)
    values = [field_against(one.surface, chosen, other) for one in maps]
    # The colours of a ratio are neutral at 1, those of a difference at 0.
    is_difference = other is not None and chosen.kind != "ratio"
    shown = replace(chosen, name=f"difference_of_{chosen.name}", kind="signed") if is_difference else chosen
    options = {"levels": levels, "cmap": cmap, "limits": limits, "colours": look.colours}
    scale = ColourScale.of_surfaces(shown, [one.surface for one in maps], values, **options)
    label = scale.label
    if other is not None:
        one = maps[0].surface.domain.projection.name if len(maps) == 1 else "each map"
        label = replace(scale, measure=chosen).label + f": {one} {'less' if is_difference else 'over'} {other.name}"

    def draw(ax: Axes, k: int) -> None:
        surface = maps[k].surface
        values_at = functools.partial(_measured_against, surface.domain.projection, chosen, other)
        map_drawing.draw_heatmap(ax, surface, values[k], scale, maps[k].words, context, values_at, step=step)

    return _figure(maps, draw, size, dpi, look, f"{label}{_over(maps)}", scale)


def modes_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: regions.RegionLike | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    context: str = "full",
    look: Look | str | None = None,
) -> Figure:
    """Modes of maps' distortions, a panel per mode with its signed part of the distortion.

    Positive values mean a larger area or a wider shape than after the best linear map, as the name of the mode
    says; the squares of all modes add to that of the Fisher distortion. Modes below half a per cent are left out.
    """
    support.check_choice("context", context, basemap.CONTEXTS)
    look = look_for(look)
    maps = _maps(projections, region, titles, None, look)
    panels: list[_Map] = []
    scores: list[matrices.Measure] = []
    for one in maps:
        found = field.sample(one.surface.domain.projection, one.region, tolerance=_TOLERANCE).modes
        shown = np.flatnonzero(found.shares >= _LEAST_SHARE)
        for k in shown if shown.size else [0]:
            below = f"{100.0 * found.shares[k]:.0f} % {found.words[k]}"
            panels.append(replace(one, below=below, place=""))
            in_mode = functools.partial(lambda found, k, J: found.scores(J)[..., k], found, int(k))
            scores.append(matrices.Measure(_MODE, in_mode, kind="signed"))
    values = [surfaces.field(one.surface, score) for one, score in zip(panels, scores, strict=True)]
    scale = ColourScale.of_surfaces(scores[0], [one.surface for one in panels], values, colours=look.colours)

    def draw(ax: Axes, k: int) -> None:
        surface = panels[k].surface
        values_at = functools.partial(field.measure_at, surface.domain.projection, scores[k])
        map_drawing.draw_heatmap(ax, surface, values[k], scale, panels[k].words, context, values_at)

    return _figure(panels, draw, size, dpi, look, f"{_MODE}{_over([replace(maps[0], place='')])}", scale)


def local_figure(
    projection: ProjectionLike,
    radius_km: float,
    *,
    region: regions.RegionLike | None = None,
    step: float | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
    look: Look | str | None = None,
) -> tuple[Figure, answers.LocalCorrections]:
    """The local corrections of a projection over caps of `radius_km`, as `local_field` draws them; and their values."""
    look = look_for(look)
    (one,) = _maps([projection], region, None if title is None else [title], None, look)
    local = map_drawing.LocalField.of(one.surface, radius_km, step)
    one = replace(one, below=local.below)
    label = f"{local.scale.label}{_over([one])}"
    figure = _figure([one], lambda ax, _: local.draw(ax, one.title), size, dpi, look, label, local.scale)
    return figure, local.corrections


def ldp_figure(
    found: decisions.LDP,
    *,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
    look: Look | str | None = None,
) -> Figure:
    """The distortion of a low-distortion projection at the heights of the ground, as `ground_map` draws it."""
    look = look_for(look)
    ground = map_drawing.GroundMap.of(found)
    one = _Map(ground.surface, found.region, look.title or title, None, ground.below())
    return _figure([one], lambda ax, _: ground.draw(ax, one.title), size, dpi, look, ground.scale.label, ground.scale)


def save(figure: Figure, path: AnyPath, *, dpi: float | None = None, overwrite: bool = True) -> Path:
    """Write a figure as .png, .svg or .pdf; an existing file is replaced when the new one is complete, or an error."""
    path = support.check_path("picture file", path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"Invalid picture file '{path}'. Its suffix must be .png, .svg or .pdf.")
    content = encoded(figure, suffix, dpi=dpi)  # matplotlib's PDFs cannot end on a disk that is full
    with support.replacing(path, overwrite=overwrite) as new:
        new.write_bytes(content)
    return path


def encoded(figure: Figure, suffix: str, *, dpi: float | None) -> bytes:
    """Bytes of a figure as .png, .svg or .pdf, by default with its own dpi; raises ValueError."""
    support.check_instance("figure", figure, Figure, "a Figure of matplotlib")
    support.check_choice("suffix", suffix, SUFFIXES)
    dots, content = figure.dpi if dpi is None else styled_figure.check_dpi(dpi), io.BytesIO()
    # Without a date, and one thread at a time, as the salt is global to matplotlib.
    with _SAVING, rc_context({"svg.hashsalt": "projdist"}):
        figure.savefig(content, format=suffix[1:], dpi=dots, metadata=_UNDATED[suffix])
    return content.getvalue()


@dataclass(frozen=True)
class _Map:
    """Surface, title and subtitle of a panel."""

    surface: surfaces.Surface
    region: regions.Place
    title: str | None
    airy_kavrayskiy: float | None
    below: str = ""
    place: str = ""

    @property
    def words(self) -> tuple[str, str]:
        """Title and subtitle."""
        name, below = map_drawing.words_of(self.surface.domain.projection, self.title, self.airy_kavrayskiy, self.below)
        return name, " · ".join(part for part in (self.place, below) if part)


def _maps(
    projections: ProjectionLike | Iterable[ProjectionLike],
    region: regions.RegionLike | None,
    titles: Sequence[str | None] | None,
    airy_kavrayskiy: Sequence[float | None] | None,
    look: Look,
    other: Projection | None = None,
) -> list[_Map]:
    """Panels of a figure, all of one region, for one projection or several."""
    chosen, place = styled_figure.maps_over(projections, region, [] if other is None else [other])
    count, shown = len(chosen), surfaces.shown_part(place)
    if look.title and count == 1:
        titles = [look.title]
    each = [styled_figure.one_each(given, count) for given in (titles, airy_kavrayskiy)]
    words = styled_figure.over(place, "") if count == 1 else ""  # of several maps it is at the foot, once for all
    return [
        _Map(surfaces.surface_of(projection, shown), place, title, figure, place=words)
        for projection, title, figure in zip(chosen, *each, strict=True)
    ]


def _over(maps: list[_Map]) -> str:
    """Suffix that names the region, unless it is the globe or already in the title of the only map."""
    region = maps[0].region
    if region == regions.GLOBE:
        return ""
    away = "" if maps[0].surface.domain.region == region else "; parts far away are not drawn"
    return away if maps[0].place else f"{styled_figure.over(region)}{away}"


def _figure(
    maps: Sequence[_Map],
    draw: Callable[[Axes, int], None],
    size: tuple[float, float] | None,
    dpi: float,
    look: Look,
    text: str,
    scale: ColourScale | None = None,
) -> styled_figure.StyledFigure:
    """Figure with a panel for each map, which `draw` fills."""
    # With a colour scale maps are as large as possible, and the text is the bar's label; else in one scale, and a foot.
    views = np.array([one.surface.view for one in maps])
    shapes = views[:, [1, 3]] - views[:, [0, 2]]
    if scale is not None:
        shapes = shapes / shapes.max(axis=1, keepdims=True)
    labels = (_BESIDE, _BELOW) if any(one.surface.is_local for one in maps) else (0.0, 0.0)
    words, foot = [one.words for one in maps], styled_figure.FOOT if scale is None else styled_figure.BAR
    with look.applied():
        figure, axes, room = styled_figure.arranged(shapes, size, dpi, foot=foot, words=words, labels=labels, look=look)
        for k, ax in enumerate(axes):
            draw(ax, k)
        styled_figure.fit_titles(axes, room)
        if scale is None:
            figure.foot(text)
        elif look.colourbar:
            map_drawing.draw_colourbar(figure, scale, cax=styled_figure.bar_axes(figure), label=text)
    return figure
