"""How a measure is distributed over the ground, and how maps trade areas for angles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from projdist._typing import FloatArray
from projdist.field import Field, sample
from projdist.matrices import Measure, get_measure
from projdist.numerics import quantiles
from projdist.plots.colours import colour_scale, level_labels
from projdist.plots.label_places import place_labels
from projdist.plots.layouts import check_dpi, check_size
from projdist.plots.looks import Look, LookedFigure, look_for, look_of, scale_for, scale_of
from projdist.plots.pictures import AnyMeasure
from projdist.plots.titles import titles_for
from projdist.projections import Projection, ProjectionLike, listed_projections
from projdist.regions import GLOBE, RegionLike, region_for
from projdist.support import check_choice

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
        figure = LookedFigure(
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


# ---- shares of the ground -------------------------------------------------------------------


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
    """Values in ascending order, and weights that sum to 1."""
    there = np.isfinite(values) & (weights > 0.0)
    values, weights = values[there], weights[there]
    if not values.size:
        raise ValueError("Invalid measure. It has no value in the region.")
    order = np.argsort(values)
    return values[order], weights[order] / weights.sum()


def _range(measure: Measure, many: list[tuple[FloatArray, FloatArray]]) -> tuple[float, float]:
    """The limits of the axis: what nearly all values of all maps have, as colours have it."""
    scale = colour_scale(measure, [values for values, _ in many], [weights for _, weights in many])
    low, high = scale.limits
    ends = [quantiles(values, weights, [_TAIL, 1.0 - _TAIL]) for values, weights in many]
    low, high = min(low, *(one for one, _ in ends)), max(high, *(one for _, one in ends))
    return low, high


def _with_room(low: float, high: float, logarithmic: bool) -> tuple[float, float]:
    """A little more at the ends, so that what stands there is seen."""
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
    """The points (n, 2) that none is below in both, from the left; what differs by `same` is the same."""
    found: list[int] = []
    for k in np.lexsort((points[:, 1], points[:, 0])):
        if not found or points[k, 1] < points[found[-1], 1] - same:
            found.append(int(k))
    return found
