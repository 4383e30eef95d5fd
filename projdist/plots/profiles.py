"""Profiles along a line: stacked panels that share the distance axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from projdist._typing import FloatArray, IntArray
from projdist.answers import Profile
from projdist.matrices import MEASURES
from projdist.plots.colours import level_labels
from projdist.plots.layouts import check_dpi, check_size
from projdist.plots.style import Look, StyledFigure, Theme, look_for, look_of, scale_for, scale_of
from projdist.support import check_instance, check_text

_WIDTH, _PANEL, _GAP = 8.0, 1.45, 0.16  # inches
_LEFT, _RIGHT, _TOP, _FOOT = 0.95, 0.75, 0.62, 0.5
_LEGEND = 0.32  # above the panels where there is no title
_NEAR = 0.02  # of 1: scales as near to it have an axis of ppm, too
_LEAST = 1e-7  # of the values: differences below it are rounding
_MOST_VERTICES = 40
_PLAIN = -1  # the colour of letters


@dataclass(frozen=True)
class _Curve:
    values: FloatArray
    name: str
    series: int
    mean: float | None = None


@dataclass(frozen=True)
class _Panel:
    """Curves that share an axis; `is_scale` if 1 is the true value."""

    label: str
    curves: Sequence[_Curve]
    is_scale: bool = False


def profile_figure(
    found: Profile,
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
    size : (float, float), optional
        Width and height in inches.
    dpi : float, default 150
        Dots per inch.
    title : str, optional
        In place of the name of the map.
    look : Look or str, optional
        How it looks, or the name of a theme; a title there is in place of all others.

    Returns
    -------
    Figure
        Of matplotlib; `save` writes it.

    Raises
    ------
    ValueError
        For what is no profile, size, number of dots or title, and sizes without room.

    Examples
    --------
    >>> from projdist import plots, profile
    >>> figure = plots.profile_figure(profile("EPSG:32632", "9,50,12,50"))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['Scale along\\nthe line', 'ppm', 'Meridian\\nconvergence\\n(degrees)']
    """
    check_instance("profile", found, Profile, "a Profile of projdist")
    look = look_for(look)
    name = found.projection.name if title is None else check_text("title", title)
    name = name if look.title is None else look.title
    panels = [*_panels(found)]
    letters = scale_for(look, size if size is None else check_size(size))
    left, right, top, foot = (letters * inches for inches in (_LEFT, _RIGHT, _TOP if name else _LEGEND, _FOOT))
    fixed = top + foot + _GAP * (len(panels) - 1)
    width, height = check_size(size) or (_WIDTH, fixed + _PANEL * len(panels))
    each = (height - fixed) / len(panels)
    if each < 0.3 or width < left + right + 0.5:
        raise ValueError(f"Invalid size '{width:g},{height:g}'. It has no room for {len(panels)} panels.")
    with look.applied():
        figure = StyledFigure(look, letters, figsize=(width, height), dpi=check_dpi(dpi))
        return _drawn(figure, found, panels, name, (left, right, foot, each))


def _drawn(
    figure: StyledFigure, found: Profile, panels: list[_Panel], name: str, inches: tuple[float, float, float, float]
) -> Figure:
    """Draw the panels of a profile, with margins in inches."""
    left, right, foot, each = inches
    letters, colours = figure.scale, figure.look.colours
    width, height = figure.get_size_inches()
    factor, unit = (1.0, "km") if found.distance_km[-1] >= 2.0 else (1e3, "m")
    across = (left / width, (width - left - right) / width)
    for k, panel in enumerate(panels):
        bottom = foot + (len(panels) - 1 - k) * (each + _GAP)
        ax = figure.add_axes((across[0], bottom / height, across[1], each / height))
        _draw(ax, panel, factor * found.distance_km, factor * found.vertices, found.torn)
        ax.tick_params(labelbottom=k == len(panels) - 1)
    figure.axes[0].legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=2,
        frameon=False,
        fontsize=letters * 7.5,
        labelcolor=colours.text,
        borderaxespad=0.2,
    )
    size = letters * 10.5
    head = figure.text(
        across[0], 1.0 - letters * 0.12 / height, name, fontsize=size, color=colours.text, ha="left", va="top"
    )
    head.set_fontsize(size * min(1.0, across[1] * figure.bbox.width / max(head.get_window_extent().width, 1.0)))
    middle = across[0] + 0.5 * across[1]
    text = f"Distance along the line ({unit})"
    size, low = letters * 8.5, letters * 0.08 / height
    figure.text(middle, low, text, fontsize=size, color=colours.text, ha="center", va="bottom")
    return figure


def _panels(found: Profile) -> list[_Panel]:
    scale = _Curve(found.scale, "scale", 0, found.mean_scale)
    if found.combined_factor is None:
        panels = [_Panel("Scale along\nthe line", [scale], is_scale=True)]
    else:
        combined = _Curve(found.combined_factor, "combined factor", 1, found.mean_combined_factor)
        panels = [_Panel("Scale along\nthe line", [scale, combined], is_scale=True)]
        if found.height is not None and np.ptp(found.height) > 0.0:
            panels.append(_Panel("Height\n(m)", [_Curve(found.height, "height", _PLAIN)]))
    return panels + [_measured(name, values) for name, values in found.measures.items()]


def _measured(name: str, values: FloatArray) -> _Panel:
    """Panel of a measure, with its symbol and unit."""
    measure = next((one for one in MEASURES.values() if name in (one.name, one.symbol)), None)
    label = (name if measure is None else measure.name).replace("_", " ").removesuffix(" ppm").replace(" ", "\n", 1)
    unit = {"deg": "degrees"}.get(measure.unit, measure.unit) if measure else ""
    is_scale = name.startswith("scale@") or (measure is not None and measure.kind == "ratio")
    text = f"{label[:1].upper()}{label[1:]}" + (f"\n({unit})" if unit else "")
    return _Panel(text, [_Curve(values, name, 0)], is_scale=is_scale)


def _draw(ax: Axes, panel: _Panel, distance: FloatArray, vertices: FloatArray, torn: IntArray) -> None:
    """Draw the curves of a panel, their means dashed, and lines at the vertices."""
    ax.set_xlim(distance[0], distance[-1])
    colours = look_of(ax).colours
    for curve in panel.curves:
        mean = curve.mean if curve.mean is not None and np.isfinite(curve.mean) else None
        name = curve.name if mean is None else f"{curve.name}, mean {mean:.7g}"
        values = np.insert(curve.values, torn, np.nan)
        ax.plot(
            np.insert(distance, torn, distance[torn]),
            values,
            color=_colour(colours, curve),
            linewidth=1.4,
            zorder=3.0,
            label=name,
        )
        if mean is not None:
            ax.axhline(mean, color=_colour(colours, curve), linewidth=0.8, linestyle=(0, (4, 3)), zorder=2.0)
    low, high = _limits(panel)
    ax.set_ylim(low, high)
    _label(ax, MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    if panel.is_scale and low < 1.0 < high:
        ax.axhline(1.0, color=colours.quiet, linewidth=0.9, zorder=1.5)
    if panel.is_scale and max(abs(low - 1.0), abs(high - 1.0)) < _NEAR:
        _add_ppm(ax, low, high)
    if 2 < len(vertices) <= _MOST_VERTICES:
        ends = ax.get_xaxis_transform()
        ax.vlines(vertices[1:-1], 0.0, 1.0, transform=ends, color=colours.graticule, linewidth=0.7, zorder=1.0)
    ax.set_ylabel(panel.label, fontsize=scale_of(ax) * 8.0, color=colours.text)
    ax.grid(color=colours.graticule, alpha=0.4, linewidth=0.6)
    ax.set_axisbelow(True)
    _dress(ax)


def _add_ppm(ax: Axes, low: float, high: float) -> None:
    """Add an axis in parts per million off 1, at the right."""
    other = ax.twinx()
    ends = 1e6 * (low - 1.0), 1e6 * (high - 1.0)
    other.set_ylim(*ends)
    _label(other, MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(*ends))
    other.set_ylabel("ppm", fontsize=scale_of(ax) * 8.0, color=look_of(ax).colours.quiet)
    _dress(other)


def _label(ax: Axes, given: Sequence[float]) -> None:
    """Set ticks within the limits, with as many decimals as distinguish them."""
    ticks = np.asarray(given)
    low, high = ax.get_ylim()
    kept = ticks[(ticks >= low) & (ticks <= high)]
    texts = level_labels(kept)
    decimals = max((len(text.partition(".")[2]) for text in texts), default=0)
    ax.set_yticks(
        kept, texts if any("e" in text for text in texts) else [f"{tick + 0.0:,.{decimals}f}" for tick in kept]
    )


def _colour(colours: Theme, curve: _Curve) -> str:
    return colours.text if curve.series == _PLAIN else colours.curves[curve.series]


def _dress(ax: Axes) -> None:
    colours = look_of(ax).colours
    ax.set_facecolor("none" if look_of(ax).transparent else colours.background)
    ax.tick_params(labelsize=scale_of(ax) * 7.5, colors=colours.text, length=3, width=0.7)
    for side in ax.spines.values():
        side.set_color(colours.graticule)
        side.set_linewidth(0.7)


def _limits(panel: _Panel) -> tuple[float, float]:
    """Limits with a margin, wide enough to hide rounding."""
    drawn = np.concatenate([np.append(curve.values, curve.mean or np.nan) for curve in panel.curves])
    drawn = drawn[np.isfinite(drawn)]
    if not drawn.size:
        return 0.0, 1.0
    low, high = float(drawn.min()), float(drawn.max())
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = max(1.1 * half, _LEAST * max(abs(middle), 1.0))
    return middle - half, middle + half
