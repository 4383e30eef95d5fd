"""Graphs of distortion: histograms, cumulative curves, areas against angles, and profiles along a line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from matplotlib import patches, ticker
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist import answers, matrices, numerics, regions, support
from projdist._typing import FloatArray, IntArray
from projdist.field import Field, sample
from projdist.plots import map_drawing, styled_figure
from projdist.plots.colours import ColourScale, level_labels, round_values, unit_label
from projdist.plots.style import Look, look_for
from projdist.plots.styled_figure import FigureStyle, StyledFigure, scale_for, style_of, wrapped
from projdist.projections import ProjectionLike


def _dress(ax: Axes, points: float, *, grid: bool = True) -> None:
    """Give axes the colours of the style, and numbers of a size in points."""
    style, colours = style_of(ax), style_of(ax).colours
    ax.set_facecolor("none" if style.look.transparent else colours.background)
    ax.tick_params(labelsize=style.scale * points, colors=colours.text, length=3, width=0.7)
    ax.spines[:].set(color=colours.graticule, linewidth=0.7)
    if grid:
        ax.grid(color=colours.graticule, alpha=0.4, linewidth=0.6)
        ax.set_axisbelow(True)


# ---- distributions -------------------------------------------------------------------------------

DISTRIBUTIONS = ("histogram", "cumulative", "pareto")

_SIZES = {"histogram": (7.5, 4.4), "cumulative": (7.5, 4.4), "pareto": (7.0, 6.4)}
_DASHES = ((5, 2), (1.5, 1.5), (6, 2, 1.5, 2), (9, 2), (3, 1.5, 3, 4), (6, 2, 1.5, 2, 1.5, 2), (1.5, 4))
_STYLES: tuple[Any, ...] = ("-", *((0, dashes) for dashes in _DASHES))
_MOST = 24
_TAIL = 0.01  # of the area at an end may be off the axis, where values run off
_ROOM = 0.015  # of an axis, at its ends
_AROUND = (0.6, 0.7)  # inches: of labels beside and below axes with letters of the usual size
_NARROWEST = (2.4, 1.1)  # inches: of a graph with letters of the usual size
_BINS = 60
_STEPS = 1500  # of a cumulative curve
_TOLERANCE = 1e-5  # pictures show no more
_SAME = 0.005  # of the largest error: less is neither seen nor sure
_LEAST = 0.35  # of the longer axis, that of areas or of angles


def distribution_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    kind: str = "histogram",
    *,
    measure: map_drawing.AnyMeasure = "fisher",
    region: regions.RegionLike | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    look: Look | str | None = None,
) -> Figure:
    """How much of the ground has how much distortion, or how maps trade areas for angles.

    Parameters
    ----------
    projections : ProjectionLike or iterable of them
        Maps, all over one region.
    kind : {"histogram", "cumulative", "pareto"}
        The first two show the share of the area by values of the measure, in bins or up to a value. The third has a
        point for each map: the RMS of ln(a/b), and that of ln(ab) about its mean, both over sqrt(2), so that a map's
        distance from the origin is its Airy-Kavrayskiy error after the best scale. The Pareto front is joined.
    measure : str, Measure or callable, default "fisher"
        What the first two kinds show.
    region : RegionLike, optional
        The default is that of `compare`.
    size, dpi : (float, float) and float, optional
        Width and height in inches, and dots per inch, 150 by default.
    titles : sequence of str or None, optional
        Names of the maps, None for their own.
    look : Look or str, optional
        The style, or the name of a theme; its title is a heading.

    Returns
    -------
    Figure
        Of matplotlib; `save` writes it.

    Raises
    ------
    ProjectionError, ValueError
        For an invalid projection; for an unknown kind, measure or region, for no maps and for more than 24 curves.

    References
    ----------
    V. V. Kavrayskiy 1934: the square of the error is that of areas and that of angles, half of ln(ab)^2 + ln(a/b)^2.

    Examples
    --------
    >>> figure = distribution_figure(["robin", "moll"], "pareto", region="box:0,0,60,60")
    >>> sorted(text.get_text() for text in figure.axes[0].texts)[:2]
    ['Mollweide', 'Robinson']
    """
    support.check_choice("kind of distribution", kind, DISTRIBUTIONS)
    chosen = matrices.get_measure(measure)
    maps, place = styled_figure.maps_over(projections, region, most=None if kind == "pareto" else _MOST)
    names = styled_figure.titles_for(titles, [one.name for one in maps])
    measures: list[Any] = [] if kind == "pareto" else [chosen]
    fields = [sample(one, place, measures=measures, tolerance=_TOLERANCE) for one in maps]
    look, room = look_for(look), styled_figure.check_size(size)
    with look.applied():
        style = FigureStyle(look, scale_for(look, room), has_heading=True)
        content = style.content(room or _SIZES[kind])
        has_room = min(np.divide(content, _NARROWEST)) >= style.scale
        styled_figure.check_room(has_room, room or _SIZES[kind], "a graph")
        figure = StyledFigure(style, content, styled_figure.check_dpi(dpi), layout="constrained")
        ax = figure.add_subplot()
        if kind == "pareto":
            _draw_pareto(figure, ax, fields, names, styled_figure.over(place), is_free=size is None)
        else:
            _draw_distribution(ax, fields, names, chosen, kind, styled_figure.over(place, " of "))
    return figure


def _draw_distribution(
    ax: Axes, fields: list[Field], names: list[str], measure: matrices.Measure, kind: str, over: str
) -> None:
    colours = style_of(ax).colours
    many = [_sorted(*field.many(measure)) for field in fields]
    low, high = _range(measure, many)
    logarithmic = measure.kind == "ratio" and high > 1.6 * low
    edges = (np.geomspace if logarithmic else np.linspace)(low, high, _BINS + 1)
    room = (high / low) ** _ROOM if logarithmic else _ROOM * (high - low)
    ax.set_xlim((low / room, high * room) if logarithmic else (low - room, high + room))
    for k, (name, (values, weights)) in enumerate(zip(names, many, strict=True)):
        beyond = float(weights[(values < edges[0]) | (values > edges[-1])].sum())
        label = name if beyond < 5e-4 else f"{name} ({100.0 * beyond:.2g} % beyond)"
        colour, style = colours.curves[k % len(colours.curves)], _STYLES[k // len(colours.curves)]
        if kind == "histogram":
            shares = 100.0 * np.histogram(values, edges, weights=weights)[0]
            ax.stairs(shares, edges, color=colour, linewidth=1.3, linestyle=style, label=label, zorder=3.0)
            ax.stairs(shares, edges, color=colour, alpha=0.12, fill=True, zorder=2.0)
        else:
            at = np.linspace(0, len(values) - 1, min(_STEPS, len(values))).astype(int)
            up_to = 100.0 * np.cumsum(weights)[at]
            x, y = np.append(values[at], max(high, values[-1])), np.append(up_to, 100.0)
            ax.plot(np.append(x[0], x), np.append(0.0, y), color=colour, linewidth=1.5, linestyle=style, label=label)
    ax.set_xscale("log" if logarithmic else "linear")
    scale = ColourScale.of(measure, [np.array([low, high])], limits=(low, high))
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    ax.set_xticks(levels, level_labels(levels))
    ax.xaxis.set_minor_locator(ticker.NullLocator())
    ax.yaxis.set_major_locator(ticker.MaxNLocator(6))
    _dress(ax, 8)
    ax.set_ylim(0.0, 103.0 if kind == "cumulative" else None)
    share = "Share of the area" if kind == "histogram" else "Share of the area with no more"
    _label_axes(ax, scale.label, f"{share}{over} (%)")
    ground: dict[str, Any] = {"facecolor": colours.background, "edgecolor": colours.background, "framealpha": 0.9}
    ax.legend(fontsize=style_of(ax).scale * 8, labelcolor=colours.text, **ground)


def _label_axes(ax: Axes, below: str, beside: str) -> None:
    """Label axes that fill a figure, in several lines where one has no room."""
    figure, style = cast(StyledFigure, ax.figure), style_of(ax)
    width, height = np.array(figure.content) - style.scale * np.array(_AROUND)
    ax.set_xlabel(wrapped(below, style.scale * 9, width), **style.letters(9))
    ax.set_ylabel(wrapped(beside, style.scale * 9, height), **style.letters(9))


def _sorted(values: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Finite values in ascending order, and weights that sum to 1."""
    there = np.isfinite(values) & (weights > 0.0)
    values, weights = values[there], weights[there]
    if not values.size:
        raise ValueError("Invalid measure. It has no value in the region.")
    order = np.argsort(values)
    return values[order], weights[order] / weights.sum()


def _range(measure: matrices.Measure, many: list[tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """Limits of the axis: the range of nearly all values of all maps, as for colours."""
    low, high = ColourScale.of(measure, [values for values, _ in many], [weights for _, weights in many]).limits
    ends = [numerics.quantiles(values, weights, [_TAIL, 1.0 - _TAIL]) for values, weights in many]
    return min(low, *(one for one, _ in ends)), max(high, *(one for _, one in ends))


def _draw_pareto(
    figure: StyledFigure, ax: Axes, fields: list[Field], names: list[str], over: str, *, is_free: bool
) -> None:
    points = np.array([field.angles_and_areas for field in fields])
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise ValueError("Invalid maps. None has finite errors of areas and angles there.")
    shown, labels = points[finite], [name for name, known in zip(names, finite, strict=True) if known]
    style, colours = style_of(ax), style_of(ax).colours
    reach = float(shown.max())
    first = pareto_front(shown, _SAME * reach)
    right, top = (max(float(one), _LEAST * reach) for one in shown.max(axis=0))
    ax.set_xlim(-0.06 * reach, right + 0.16 * reach)
    ax.set_ylim(-0.14 * reach, top + 0.1 * reach)
    ax.set_aspect("equal")
    if is_free:
        shape = np.ptp(ax.get_ylim()) / np.ptp(ax.get_xlim())
        figure.resize((7.0, float(np.clip(0.8 + 6.2 * shape, 3.0, 8.0))))
    ticks = np.asarray(ticker.MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(0.0, 1.2 * reach))
    for axis, most in ((ax.xaxis, ax.get_xlim()[1]), (ax.yaxis, ax.get_ylim()[1])):
        axis.set_major_locator(ticker.FixedLocator(ticks[(ticks >= 0) & (ticks <= most)].tolist()))
    arc: dict[str, Any] = {"fill": False, "edgecolor": colours.graticule, "linewidth": 0.6, "zorder": 1.0}
    for radius in ticks[ticks > 0]:
        ax.add_patch(patches.Circle((0.0, 0.0), radius, **arc))
    ax.plot(*shown[first].T, color=colours.curves[1], linewidth=1.0, zorder=2.0)
    ax.scatter(shown[:, 0], shown[:, 1], s=20, color=colours.curves[0], zorder=3.0)
    ax.scatter(shown[first, 0], shown[first, 1], s=26, color=colours.curves[1], zorder=3.1)
    _label_axes(ax, "Angular error, RMS of ln(a/b) / √2", "Areal error, RMS of ln(ab) / √2 at the best scale")
    lost = [name for name, known in zip(names, finite, strict=True) if not known]
    said = f"Arcs: equal Airy–Kavrayskiy error{over}. Joined: no other map has less of both."
    if lost:
        said += f"\nOne error is infinite, and not shown, of {', '.join(lost)}."
    ax.set_title(said, wrap=True, **style.letters(8, quiet=True))
    _dress(ax, 8, grid=False)
    ax.set_axisbelow(True)
    figure.draw_without_rendering()  # so that the layout stands before the labels are placed
    _place_labels(ax, shown, labels, shown[first], style.letters(7.5))


def pareto_front(points: FloatArray, same: float) -> list[int]:
    """Indices of the Pareto front of points (n, 2), from the left; differences below `same` do not count."""
    found: list[int] = []
    for k in np.lexsort((points[:, 1], points[:, 0])):
        if not found or points[k, 1] < points[found[-1], 1] - same:
            found.append(int(k))
    return found


# ---- labels of points -----------------------------------------------------------------------

_NEAR, _FAR, _TURNS = 7.0, 90.0, 24  # points from the point that is labelled, and directions tried
_TIED = 9.0  # points: labels farther away have a line to their point
_ASTRAY = 0.02  # of a label's area: as bad as hiding so much is a label that is nearer to another point


def _place_labels(ax: Axes, xy: FloatArray, texts: Sequence[str], line: FloatArray, style: dict[str, Any]) -> None:
    """Label points (n, 2), those with most neighbours first, without covering points or a line (m, 2)."""
    # The limits of the axes must stand. A label stands where it covers least, and clearly nearest to its own point.
    dots = ax.figure.dpi / 72.0
    places, line = ax.transData.transform(xy), ax.transData.transform(line)
    frame = np.array([ax.get_window_extent().extents])
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    along = np.arange(0.0, lengths[-1], 3.0 * dots)
    dotted = np.column_stack([np.interp(along, lengths, line[:, k]) for k in (0, 1)])
    taken = np.concatenate([_boxes(places, np.zeros(2), 3.5 * dots), _boxes(dotted, np.zeros(2), dots)])
    angles = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    distances = np.arange(_NEAR, _FAR, 4.0)[:, None, None]
    crowd = [np.sum(np.exp(-np.hypot(*(places - place).T) / (30.0 * dots))) for place in places]
    for k in np.argsort(crowd)[::-1]:
        place: dict[str, Any] = {"xytext": (0.0, 0.0), "textcoords": "offset points", "ha": "center", "va": "center"}
        label = ax.annotate(texts[k], xy[k], zorder=4.0, annotation_clip=False, **place, **style)
        box = np.array(label.get_window_extent().size)
        offsets = (ways * distances * dots + 0.5 * box * np.clip(1.4 * ways, -1.0, 1.0)).reshape(-1, 2)
        boxes = _boxes(places[k] + offsets, box, 1.5 * dots)
        hidden = overlaps(boxes, taken).sum(axis=1) + areas(boxes) - overlaps(boxes, frame)[:, 0]
        own = _gaps(places[k][None], boxes) + 3.0 * dots
        nearer = (_gaps(places, boxes) < own).sum(axis=1) - 1
        best = int(np.argmin(hidden + _ASTRAY * box.prod() * nearer))
        label.set_position(tuple(offsets[best] / dots))
        taken = np.concatenate([taken, boxes[best : best + 1]])
        if _gaps(places[k][None], boxes[best : best + 1])[0, 0] > _TIED * dots:
            near = np.clip(places[k], boxes[best, :2], boxes[best, 2:])
            ax.plot(*ax.transData.inverted().transform([places[k], near]).T, color="#9aa3ad", linewidth=0.6, zorder=2.5)


def _boxes(centres: FloatArray, size: FloatArray, pad: float) -> FloatArray:
    """Left, bottom, right and top, (n, 4), of boxes of a size about centres (n, 2)."""
    half = 0.5 * size + pad
    return np.concatenate([centres - half, centres + half], axis=1)


def areas(boxes: FloatArray) -> FloatArray:
    """Areas (n,) of boxes (n, 4)."""
    return (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])


def overlaps(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """Areas (n, m) that boxes (n, 4) and others (m, 4) have in common."""
    low, high = np.maximum(boxes[:, None, :2], others[:, :2]), np.minimum(boxes[:, None, 2:], others[:, 2:])
    return np.asarray(np.maximum(high - low, 0.0).prod(axis=-1))


def _gaps(places: FloatArray, boxes: FloatArray) -> FloatArray:
    """Distances (n, m) of boxes (n, 4) from places (m, 2)."""
    nearest = np.clip(places, boxes[:, None, :2], boxes[:, None, 2:])
    return np.asarray(np.hypot(*np.moveaxis(places - nearest, -1, 0)))


# ---- profiles ------------------------------------------------------------------------------------

_WIDTH, _PANEL, _GAP = 8.0, 1.45, 0.16  # inches
_LEFT, _RIGHT, _TOP, _FOOT = 0.95, 0.75, 0.62, 0.5
_EDGE = 0.03  # between labels and the figure's edge
_LEGEND = 0.32  # above the panels where there is no title
_NEARLY_ONE = 0.02  # of 1: scales as near to it have an axis of ppm, too
_ROUNDING = 1e-7  # of the values: differences below it are rounding


@dataclass(frozen=True)
class _Curve:
    """Values along a line, their mean, and the number of their colour, None for that of letters."""

    values: FloatArray
    name: str
    series: int | None = 0
    mean: float | None = None


@dataclass(frozen=True)
class _Panel:
    """Curves that share an axis; `is_scale` if 1 is the true value."""

    label: str
    curves: Sequence[_Curve]
    is_scale: bool = False

    def limits(self) -> tuple[float, float]:
        """Limits with a margin, wide enough to hide rounding."""
        drawn = np.concatenate([np.append(curve.values, curve.mean or np.nan) for curve in self.curves])
        drawn = drawn[np.isfinite(drawn)]
        if not drawn.size:
            return 0.0, 1.0
        low, high = float(drawn.min()), float(drawn.max())
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        half = max(1.1 * half, _ROUNDING * max(abs(middle), 1.0))
        return middle - half, middle + half


def profile_figure(
    found: answers.Profile,
    *,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    title: str | None = None,
    look: Look | str | None = None,
) -> Figure:
    """Figure of a profile: scale along the line with its mean, heights, and other measures, a panel each.

    Parameters
    ----------
    found : Profile
        What `profile` gave.
    size, dpi : (float, float) and float, optional
        Width and height in inches, and dots per inch, 150 by default.
    title : str, optional
        In place of the name of the map.
    look : Look or str, optional
        The style, or the name of a theme; its title replaces all others.

    Returns
    -------
    Figure
        Of matplotlib; `save` writes it.

    Raises
    ------
    ValueError
        For an invalid profile, size, number of dots or title, and for a size without room.

    Examples
    --------
    >>> from projdist import plots, profile
    >>> figure = plots.profile_figure(profile("EPSG:32632", "9,50,12,50"))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['Scale along\\nthe line', 'ppm', 'Meridian\\nconvergence\\n(degrees)']
    """
    support.check_instance("profile", found, answers.Profile, "a Profile of projdist")
    look, size, dpi = look_for(look), styled_figure.check_size(size), styled_figure.check_dpi(dpi)
    name = found.projection.name if title is None else support.check_text("title", title)
    name = name if look.title is None else look.title
    panels = _panels(found)
    letters = scale_for(look, size)
    left, right, top, foot = (letters * inches for inches in (_LEFT, _RIGHT, _TOP if name else _LEGEND, _FOOT))
    fixed, style = top + foot + _GAP * (len(panels) - 1), FigureStyle(look, letters)
    width, height = style.content(size) if size else (_WIDTH, fixed + _PANEL * len(panels))
    each = (height - fixed) / len(panels)
    has_room = each >= 0.3 and width >= left + right + 0.5
    styled_figure.check_room(has_room, size or (width, height), f"{len(panels)} panels")
    factor, unit = (1.0, "km") if found.distance_km[-1] >= 2.0 else (1e3, "m")
    across = width - left - right
    with look.applied():
        figure = StyledFigure(style, (width, height), dpi)
        for k, panel in enumerate(panels):
            ax = figure.panel(left, foot + (len(panels) - 1 - k) * (each + _GAP), across, each)
            _draw_curves(ax, panel, factor * found.distance_km, factor * found.vertices, found.torn)
            ax.tick_params(labelbottom=k == len(panels) - 1)
        ax.set_xlabel(f"Distance along the line ({unit})", **style.letters(8.5))
        legend: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2, "ncols": 2}
        figure.axes[0].legend(frameon=False, fontsize=letters * 7.5, labelcolor=look.colours.text, **legend)
        words, high = style.letters(10.5), 1.0 - letters * 0.12 / figure.get_figheight()
        _widen_margins(figure)
        head = figure.text(figure.axes[0].get_position().x0, high, name, ha="left", va="top", **words)
        share = across * figure.dpi / max(head.get_window_extent().width, 1.0)
        head.set_fontsize(words["fontsize"] * min(1.0, share))
    return figure


def _widen_margins(figure: StyledFigure) -> None:
    """Narrow all axes by what their labels reach beyond the figure, or nearly so."""
    figure.draw_without_rendering()
    box, width = figure.get_tightbbox(), figure.get_figwidth()
    left, right = max(_EDGE - box.x0, 0.0) / width, max(box.x1 + _EDGE - width, 0.0) / width
    for ax in figure.axes:
        place = ax.get_position()
        ax.set_position((place.x0 + left, place.y0, max(place.width - left - right, 0.1), place.height))


def _panels(found: answers.Profile) -> list[_Panel]:
    scales = [_Curve(found.scale, "scale", 0, found.mean_scale)]
    panels = [_Panel("Scale along\nthe line", scales, is_scale=True)]
    if found.combined_factor is not None:
        scales.append(_Curve(found.combined_factor, "combined factor", 1, found.mean_combined_factor))
        if found.height is not None and np.ptp(found.height) > 0.0:
            panels.append(_Panel("Height\n(m)", [_Curve(found.height, "height", None)]))
    known = {name: one for one in matrices.MEASURES.values() for name in (one.name, one.symbol)}
    for name, values in found.measures.items():
        kind: Any = "ratio" if name.startswith("scale@") else "magnitude"
        measure = known.get(name, matrices.Measure(name, np.asarray, kind=kind))
        text = "\n".join(filter(None, (measure.title.replace(" ", "\n", 1), unit_label(measure))))
        panels.append(_Panel(text, [_Curve(values, name)], is_scale=measure.kind == "ratio"))
    return panels


def _draw_curves(ax: Axes, panel: _Panel, distance: FloatArray, vertices: FloatArray, torn: IntArray) -> None:
    """Draw the curves of a panel, their means dashed, and lines at the vertices; scales near 1 also in ppm."""
    ax.set_xlim(distance[0], distance[-1])
    style, colours = style_of(ax), style_of(ax).colours
    for curve in panel.curves:
        colour = colours.text if curve.series is None else colours.curves[curve.series]
        mean = curve.mean if curve.mean is not None and np.isfinite(curve.mean) else None
        name = curve.name if mean is None else f"{curve.name}, mean {mean:.7g}"
        x, y = np.insert(distance, torn, distance[torn]), np.insert(curve.values, torn, np.nan)
        ax.plot(x, y, color=colour, linewidth=1.4, zorder=3.0, label=name)
        if mean is not None:
            ax.axhline(mean, color=colour, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2.0)
    low, high = panel.limits()
    _set_ticks(ax, low, high)
    if panel.is_scale and low < 1.0 < high:
        ax.axhline(1.0, color=colours.quiet, linewidth=0.9, zorder=1.5)
    if panel.is_scale and max(abs(low - 1.0), abs(high - 1.0)) < _NEARLY_ONE:
        other = ax.twinx()
        _set_ticks(other, 1e6 * (low - 1.0), 1e6 * (high - 1.0))
        other.set_ylabel("ppm", **style.letters(8.0, quiet=True))
        _dress(other, 7.5, grid=False)
    if 2 < len(vertices) <= 40:
        ends = ax.get_xaxis_transform()
        ax.vlines(vertices[1:-1], 0.0, 1.0, transform=ends, color=colours.graticule, linewidth=0.7, zorder=1.0)
    ax.set_ylabel(panel.label, **style.letters(8.0))
    _dress(ax, 7.5)


def _set_ticks(ax: Axes, low: float, high: float) -> None:
    """Set limits, and ticks with as many decimals as distinguish them."""
    ax.set_ylim(low, high)
    ticks = round_values(low, high, 5)
    texts = level_labels(ticks)
    if not any("e" in text for text in texts):
        decimals = max((len(text.partition(".")[2]) for text in texts), default=0)
        texts = [f"{tick + 0.0:,.{decimals}f}" for tick in ticks]
    ax.set_yticks(ticks, texts)
