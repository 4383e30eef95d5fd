"""Distributions of distortion as graphs, and the placing of their points' labels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from projdist._typing import FloatArray
from projdist.field import Field, sample
from projdist.matrices import Measure, get_measure
from projdist.numerics import quantiles
from projdist.plots.colours import colour_scale, level_labels
from projdist.plots.layouts import check_dpi, check_size
from projdist.plots.pictures import AnyMeasure
from projdist.plots.style import Look, StyledFigure, look_for, look_of, scale_for, scale_of, titles_for
from projdist.projections import Projection, ProjectionLike, listed_projections
from projdist.regions import GLOBE, RegionLike, region_for
from projdist.support import check_choice

_NEAR, _FAR, _TURNS = 7.0, 90.0, 24  # points from the point that is labelled, and directions tried
_TIED = 9.0  # points: labels farther away have a line to their point
_PAD = 1.5
_ASTRAY = 0.02  # of a label's area: as bad as hiding so much is a label that is nearer to another point

_Sides = tuple[float, float, float, float]  # left, bottom, right, top in pixels


def place_labels(
    ax: Axes, xy: FloatArray, texts: Sequence[str], *, size: float, colour: str, line: FloatArray
) -> list[Text]:
    """Label points (n, 2), those with most neighbours first, without covering points or a line (m, 2).

    The limits of the axes must stand.
    """
    figure = ax.figure
    dots = figure.dpi / 72.0
    places = ax.transData.transform(xy)
    frame = _sides(ax)
    half = 3.5 * dots
    taken = [(x - half, y - half, x + half, y + half) for x, y in places]
    taken += [(x - dots, y - dots, x + dots, y + dots) for x, y in _dotted(ax.transData.transform(line), 3.0 * dots)]
    crowd = [np.sum(np.exp(-np.hypot(*(places - place).T) / (30.0 * dots))) for place in places]
    written: list[Text] = []
    for k in np.argsort(crowd)[::-1]:
        label = ax.annotate(
            texts[k],
            xy[k],
            xytext=(0.0, 0.0),
            textcoords="offset points",
            fontsize=size,
            color=colour,
            ha="center",
            va="center",
            zorder=4.0,
            annotation_clip=False,
        )
        box = label.get_window_extent()
        offset = _free(places[k], np.array([box.width, box.height]), places, taken, frame, dots)
        label.set_position(tuple(offset / dots))
        centre = places[k] + offset
        taken.append(_box(centre, np.array([box.width, box.height]), _PAD * dots))
        if _gap(places[k], taken[-1]) > _TIED * dots:
            _tie(ax, places[k], taken[-1])
        written.append(label)
    return written


def _sides(ax: Axes) -> _Sides:
    left, bottom, right, top = ax.get_window_extent().extents
    return float(left), float(bottom), float(right), float(top)


def _dotted(line: FloatArray, step: float) -> FloatArray:
    """Equally spaced points along a line."""
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    at = np.arange(0.0, lengths[-1], step)
    return np.column_stack([np.interp(at, lengths, line[:, k]) for k in (0, 1)])


def _free(
    place: FloatArray,
    size: FloatArray,
    places: FloatArray,
    taken: Sequence[_Sides],
    frame: _Sides,
    dots: float,
) -> FloatArray:
    """Offset in pixels of the nearest place for a label that covers least.

    It must also be clearly nearer to its own point than to others.
    """
    best, least = np.zeros(2), np.inf
    for distance in np.arange(_NEAR, _FAR, 4.0):
        for angle in 2.0 * np.pi * np.arange(_TURNS) / _TURNS:
            way = np.array([np.cos(angle), np.sin(angle)])
            offset = way * distance * dots + 0.5 * size * np.clip(1.4 * way, -1.0, 1.0)
            box = _box(place + offset, size, _PAD * dots)
            hidden = sum(_overlap(box, other) for other in taken) + _outside(box, frame)
            if hidden < least:
                own = _gap(place, box) + 3.0 * dots
                nearer = sum(_gap(other, box) < own for other in places) - 1
                hidden += _ASTRAY * size[0] * size[1] * nearer
            if hidden < least:
                best, least = offset, hidden
            if hidden == 0.0:
                return offset
    return best


def _box(centre: FloatArray, size: FloatArray, pad: float) -> _Sides:
    half = 0.5 * size + pad
    return (
        float(centre[0] - half[0]),
        float(centre[1] - half[1]),
        float(centre[0] + half[0]),
        float(centre[1] + half[1]),
    )


def _overlap(one: _Sides, other: _Sides) -> float:
    """Overlapping area of two boxes."""
    width = min(one[2], other[2]) - max(one[0], other[0])
    height = min(one[3], other[3]) - max(one[1], other[1])
    return max(width, 0.0) * max(height, 0.0)


def _outside(box: _Sides, frame: _Sides) -> float:
    """Area of a box outside of the frame."""
    whole = (box[2] - box[0]) * (box[3] - box[1])
    return whole - _overlap(box, frame)


def _gap(place: FloatArray, box: _Sides) -> float:
    return float(np.hypot(*(place - _nearest(place, box))))


def _nearest(place: FloatArray, box: _Sides) -> FloatArray:
    """Point of a box nearest to a place."""
    return np.array([np.clip(place[0], box[0], box[2]), np.clip(place[1], box[1], box[3])])


def _tie(ax: Axes, place: FloatArray, box: _Sides) -> None:
    """Draw a thin line from a point to its label."""
    ends = ax.transData.inverted().transform([place, _nearest(place, box)])
    ax.plot(*ends.T, color="#9aa3ad", linewidth=0.6, zorder=2.5)


# ---- distributions -------------------------------------------------------------------------------


DISTRIBUTIONS = ("histogram", "cumulative", "pareto")

_SIZES = {"histogram": (7.5, 4.4), "cumulative": (7.5, 4.4), "pareto": (7.0, 6.4)}
_STYLES: tuple[Any, ...] = (
    "-",
    (0, (5, 2)),
    (0, (1.5, 1.5)),
    (0, (6, 2, 1.5, 2)),
    (0, (9, 2)),
    (0, (3, 1.5, 3, 4)),
    (0, (6, 2, 1.5, 2, 1.5, 2)),
    (0, (1.5, 4)),
)
_MOST = 24
_TAIL = 0.01  # of the area at an end may be off the axis, where values run off
_ROOM = 0.015  # of an axis, at its ends
_BINS = 60
_HEADING = 11.0  # points
_STEPS = 1500  # of a cumulative curve
_TOLERANCE = 1e-5  # pictures show no more
_LONGEST = 60
_SAME = 0.005  # of the largest error: less is neither seen nor sure
_LEAST = 0.35  # of the longer axis, that of areas or of angles


def distribution_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    kind: str = "histogram",
    *,
    measure: AnyMeasure = "fisher",
    region: RegionLike | None = None,
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
        The share of the area by values of the measure, in bins or up to a value; or, a point a map, the RMS of ln(ab)
        about its mean and that of ln(a/b), both over sqrt(2), so that a map's distance from the origin is its
        Airy-Kavrayskiy error after the best scale. Maps that no other betters in both are joined.
    measure : str, Measure or callable, default "fisher"
        Of the first two kinds.
    region : RegionLike, optional
        The default is that of `compare`.
    size : (float, float), optional
        Width and height in inches.
    dpi : float, default 150
        Dots per inch.
    titles : sequence of str or None, optional
        Names of the maps, None for their own.
    look : Look or str, optional
        How it looks, or the name of a theme; its title is a heading.

    Returns
    -------
    Figure
        Of matplotlib; `save` writes it.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For an unknown kind, measure or region, no maps, and more than have lines to be told apart.

    References
    ----------
    V. V. Kavrayskiy 1934: the square of the error is that of areas and that of angles, half of ln(ab)^2 + ln(a/b)^2.

    Examples
    --------
    >>> figure = distribution_figure(["robin", "moll"], "pareto", region="box:0,0,60,60")
    >>> sorted(text.get_text() for text in figure.axes[0].texts)[:2]
    ['Mollweide', 'Robinson']
    """
    check_choice("kind of distribution", kind, DISTRIBUTIONS)
    chosen = get_measure(measure)
    listed = listed_projections(projections)
    if not listed or (kind != "pareto" and len(listed) > _MOST):
        raise ValueError(f"Invalid list of {len(listed)} projections. It must name 1 to {_MOST}.")
    maps = [Projection.from_user_input(one) for one in listed]
    place = region_for(region, maps)
    names = titles_for(titles, [one.name for one in maps])
    measures: list[Any] = [] if kind == "pareto" else [chosen]
    fields = [sample(one, place, measures=measures, tolerance=_TOLERANCE) for one in maps]
    look, room = look_for(look), check_size(size)
    name = "" if place == GLOBE else place.name[:_LONGEST]
    with look.applied():
        figure = StyledFigure(
            look, scale_for(look, room), figsize=room or _SIZES[kind], dpi=check_dpi(dpi), layout="constrained"
        )
        ax = figure.add_subplot(facecolor="none" if look.transparent else look.colours.background)
        if look.title:
            figure.suptitle(look.title, fontsize=figure.scale * _HEADING, color=look.colours.text)
        if kind == "pareto":
            _draw_pareto(figure, ax, fields, names, f", over {name}" if name else "", is_free=size is None)
        else:
            _draw_distribution(ax, fields, names, chosen, kind, f" of {name}" if name else "")
    return figure


# ---- histograms and cumulative curves -------------------------------------------------------


def _draw_distribution(ax: Axes, fields: list[Field], names: list[str], measure: Measure, kind: str, over: str) -> None:
    curves, letters = look_of(ax).colours.curves, scale_of(ax)
    many = [_sorted(*field.many(measure)) for field in fields]
    low, high = _range(measure, many)
    logarithmic = measure.kind == "ratio" and high > 1.6 * low
    edges = np.geomspace(low, high, _BINS + 1) if logarithmic else np.linspace(low, high, _BINS + 1)
    ax.set_xlim(*_with_room(low, high, logarithmic))
    for k, (name, (values, weights)) in enumerate(zip(names, many, strict=True)):
        beyond = float(weights[(values < edges[0]) | (values > edges[-1])].sum())
        label = name if beyond < 5e-4 else f"{name} ({100.0 * beyond:.2g} % beyond)"
        colour, style = curves[k % len(curves)], _STYLES[k // len(curves)]
        if kind == "histogram":
            shares = 100.0 * np.histogram(values, edges, weights=weights)[0]
            ax.stairs(shares, edges, color=colour, linewidth=1.3, linestyle=style, label=label, zorder=3.0)
            ax.stairs(shares, edges, color=colour, alpha=0.12, fill=True, zorder=2.0)
        else:
            at = np.linspace(0, len(values) - 1, min(_STEPS, len(values))).astype(int)
            up_to = 100.0 * np.cumsum(weights)[at]
            x, y = np.append(values[at], max(high, values[-1])), np.append(up_to, 100.0)
            ax.plot(np.append(x[0], x), np.append(0.0, y), color=colour, linewidth=1.5, linestyle=style, label=label)
    if logarithmic:
        ax.set_xscale("log")
    _dress(ax, measure, low, high)
    ax.set_ylim(0.0, 103.0 if kind == "cumulative" else None)
    share = "Share of the area" if kind == "histogram" else "Share of the area with no more"
    ax.set_ylabel(f"{share}{over} (%)", fontsize=letters * 9, color=look_of(ax).colours.text)
    ground = look_of(ax).colours.background
    ax.legend(
        fontsize=letters * 8,
        framealpha=0.9,
        facecolor=ground,
        edgecolor=ground,
        labelcolor=look_of(ax).colours.text,
    )


def _sorted(values: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Finite values in ascending order, and weights that sum to 1."""
    there = np.isfinite(values) & (weights > 0.0)
    values, weights = values[there], weights[there]
    if not values.size:
        raise ValueError("Invalid measure. It has no value in the region.")
    order = np.argsort(values)
    return values[order], weights[order] / weights.sum()


def _range(measure: Measure, many: list[tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """Limits of the axis: the range of nearly all values of all maps, as for colours."""
    scale = colour_scale(measure, [values for values, _ in many], [weights for _, weights in many])
    low, high = scale.limits
    ends = [quantiles(values, weights, [_TAIL, 1.0 - _TAIL]) for values, weights in many]
    low, high = min(low, *(one for one, _ in ends)), max(high, *(one for _, one in ends))
    return low, high


def _with_room(low: float, high: float, logarithmic: bool) -> tuple[float, float]:
    """Limits with a margin."""
    if logarithmic:
        room = (high / low) ** _ROOM
        return low / room, high * room
    return low - _ROOM * (high - low), high + _ROOM * (high - low)


def _dress(ax: Axes, measure: Measure, low: float, high: float) -> None:
    scale = colour_scale(measure, [np.array([low, high])], [np.ones(2)], limits=(low, high))
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    ax.xaxis.set_major_locator(FixedLocator(levels.tolist()))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xticks(levels, level_labels(levels))
    ax.yaxis.set_major_locator(MaxNLocator(6))
    ax.set_xlabel(scale.label, fontsize=scale_of(ax) * 9, color=look_of(ax).colours.text)
    _frame(ax)


def _frame(ax: Axes) -> None:
    colours = look_of(ax).colours
    ax.tick_params(labelsize=scale_of(ax) * 8, colors=colours.text, length=3, width=0.7)
    ax.grid(color=colours.graticule, alpha=0.4, linewidth=0.6)
    ax.set_axisbelow(True)
    for side in ax.spines.values():
        side.set_color(colours.graticule)
        side.set_linewidth(0.7)


# ---- areas against angles -------------------------------------------------------------------


def _draw_pareto(figure: Figure, ax: Axes, fields: list[Field], names: list[str], over: str, *, is_free: bool) -> None:
    points = np.array([field.angles_and_areas for field in fields])
    finite = np.isfinite(points).all(axis=1)
    if not finite.any():
        raise ValueError("Invalid maps. None has finite errors of areas and angles there.")
    shown, labels = points[finite], [name for name, known in zip(names, finite, strict=True) if known]
    colours, letters = look_of(ax).colours, scale_of(ax)
    reach = float(shown.max())
    first = _front(shown, _SAME * reach)
    right, top = (max(float(one), _LEAST * reach) for one in shown.max(axis=0))
    ax.set_xlim(-0.06 * reach, right + 0.16 * reach)
    ax.set_ylim(-0.14 * reach, top + 0.1 * reach)
    ax.set_aspect("equal")
    if is_free:
        shape = np.ptp(ax.get_ylim()) / np.ptp(ax.get_xlim())
        figure.set_size_inches(7.0, float(np.clip(0.8 + 6.2 * shape, 3.0, 8.0)))
    ticks = np.asarray(MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(0.0, 1.2 * reach))
    for axis, most in ((ax.xaxis, ax.get_xlim()[1]), (ax.yaxis, ax.get_ylim()[1])):
        axis.set_major_locator(FixedLocator(ticks[(ticks >= 0) & (ticks <= most)].tolist()))
    for radius in ticks[ticks > 0]:
        ax.add_patch(Circle((0.0, 0.0), radius, fill=False, edgecolor=colours.graticule, linewidth=0.6, zorder=1.0))
    ax.plot(*shown[first].T, color=colours.curves[1], linewidth=1.0, zorder=2.0)
    ax.scatter(shown[:, 0], shown[:, 1], s=20, color=colours.curves[0], zorder=3.0)
    ax.scatter(shown[first, 0], shown[first, 1], s=26, color=colours.curves[1], zorder=3.1)
    ax.set_xlabel("Angular error, RMS of ln(a/b) / √2", fontsize=letters * 9, color=colours.text)
    ax.set_ylabel("Areal error, RMS of ln(ab) / √2 at the best scale", fontsize=letters * 9, color=colours.text)
    lost = [name for name, known in zip(names, finite, strict=True) if not known]
    said = f"Arcs: equal Airy–Kavrayskiy error{over}. Joined: no other map has less of both."
    if lost:
        said += f"\nOne error is infinite, and not shown, of {', '.join(lost)}."
    ax.set_title(said, fontsize=letters * 8, color=colours.quiet, wrap=True)
    _frame(ax)
    ax.grid(False)
    figure.draw_without_rendering()  # so that the layout stands before the labels are placed
    place_labels(ax, shown, labels, size=letters * 7.5, colour=colours.text, line=shown[first])


def _front(points: FloatArray, same: float) -> list[int]:
    """Indices of the Pareto front of points (n, 2), from the left; differences below `same` do not count."""
    found: list[int] = []
    for k in np.lexsort((points[:, 1], points[:, 0])):
        if not found or points[k, 1] < points[found[-1], 1] - same:
            found.append(int(k))
    return found
