"""The space of Jacobians: maps as points of the hyperbolic plane, with mean, median and geodesics.

Up to rotations a Jacobian is its size and its shape, J J^T / |det J|, and the shapes are the hyperbolic plane. In
Poincare's disc a shape lies at tanh(r / 2), r = ln(a / b), from the middle, which is sin(omega / 2), omega the maximum
angular deformation; at twice the angle that the direction of the largest scale has with the map's horizontal.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import patches
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from projdist import matrices, regions
from projdist._typing import AnyArray, FloatArray
from projdist.field import Field, sample
from projdist.plots import map_drawing, styled_figure
from projdist.plots.colours import ColourScale, level_labels
from projdist.plots.style import Look, look_for
from projdist.plots.styled_figure import StyledFigure, add_lines, set_view, style_of
from projdist.projections import ProjectionLike

_POINTS = 4000  # of equal area each
_RAYS = 60  # points to which geodesics are drawn
_MOST = 12  # maps
_ROOM = 1.06  # of the farthest point
_NEARLY_ALL = 0.999  # of the points are within the circle that is drawn
_WHOLE = 0.7  # a reach from which on the whole disc is drawn
_RINGS = (3, 5)  # at least and at most
_GLYPHS = 8
_LABELS = np.radians(202.5)  # half-way between two glyphs
_LEGEND, _WITH_LEGEND = 0.4, 2.7  # inches: of a legend below the panels, and of panels that have it in a corner


@dataclass(frozen=True)
class _Cloud:
    """Jacobians of a map as points of the disc, their areal scales, mean and median."""

    points: AnyArray
    sizes: FloatArray
    mean: complex
    median: complex


def disc_points(J: FloatArray) -> AnyArray:
    """Points of Poincare's disc, complex (...), of matrices (..., 2, 2); NaN for singular ones."""
    a, b, c, d = J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1]
    area = np.abs(a * d - b * c)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = 0.5 * (a * a + b * b - c * c - d * d) + 1j * (a * c + b * d)
        found = along / (area + 0.5 * (a * a + b * b + c * c + d * d))
    return np.where(area > 0, found, np.nan)


def space_figure(
    projections: ProjectionLike | Iterable[ProjectionLike],
    *,
    region: regions.RegionLike | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    titles: Sequence[str | None] | None = None,
    look: Look | str | None = None,
) -> Figure:
    """Jacobians of maps as points of the hyperbolic plane, with their mean (the MDT) and median.

    One panel per map: the centre of Poincare's disc has no angular distortion, a point's distance from it is
    sin(omega / 2), and its direction that of the ellipses at the rim. Colours are areal scales. Each point stands for
    the same area. Geodesics lead from the mean to some of the points.

    Parameters
    ----------
    projections : ProjectionLike or iterable of them
        One to 12 maps, all over one region.
    region : RegionLike, optional
        The default is that of `compare`.
    size, dpi : (float, float) and float, optional
        Width and height in inches, and dots per inch, 150 by default.
    titles : sequence of str or None, optional
        Names of the maps, None for their own.
    look : Look or str, optional
        The style, or the name of a theme.

    Returns
    -------
    Figure
        Of matplotlib; `save` writes it.

    Raises
    ------
    ProjectionError, ValueError
        For an invalid projection; for no maps or too many, and an unknown region.

    References
    ----------
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the space and the mean.

    Examples
    --------
    >>> figure = space_figure("robin", region="box:0,0,60,60")
    >>> sorted(line.get_label() for line in figure.axes[0].get_lines() if line.get_marker() != "None")
    ['mean (MDT)', 'median']
    """
    maps, place = styled_figure.maps_over(projections, region, most=_MOST)
    names = styled_figure.titles_for(titles, [styled_figure.title_of(one) for one in maps])
    look = look_for(look)
    names = [look.title] if look.title and len(maps) == 1 else names
    clouds = [_cloud(sample(one, place, tolerance=1e-6)) for one in maps]
    sizes = [cloud.sizes for cloud in clouds]
    scale = ColourScale.of(matrices.get_measure("areal_scale"), sizes, colours=look.colours)
    # The disc is drawn whole, or as much of it as holds nearly all points.
    far = np.concatenate([np.abs([*cloud.points, cloud.mean, cloud.median]) for cloud in clouds])
    reach = _ROOM * max(float(np.quantile(far, _NEARLY_ALL)), 1e-6)
    reach = 1.0 if reach > _WHOLE else reach
    with look.applied():
        words, shapes = [(name, "") for name in names], np.ones((len(maps), 2))
        options: dict[str, Any] = {"foot": styled_figure.BAR, "words": words, "look": look}
        figure, panes, room = styled_figure.arranged(shapes, size, dpi, **options)
        is_below = panes[0].get_window_extent().width / figure.dpi < _WITH_LEGEND * figure.style.scale
        if is_below:
            figure, panes, room = styled_figure.arranged(shapes, size, dpi, legend=_LEGEND, **options)
        for ax, cloud, name in zip(panes, clouds, names, strict=True):
            _draw(ax, cloud, scale, reach)
            styled_figure.draw_title(ax, name, "")
        _draw_legend(figure, panes, is_below=is_below)
        styled_figure.fit_titles(panes, room)
        if look.colourbar:
            label = f"{scale.label}{styled_figure.over(place)}"
            map_drawing.draw_colourbar(figure, scale, cax=styled_figure.bar_axes(figure), label=label)
    return figure


def _cloud(field: Field) -> _Cloud:
    """Jacobians at places of equal area."""
    J, weights = field.dense_factors
    total = np.cumsum(weights)
    count = min(_POINTS, len(J))
    chosen = J if count == len(J) else J[np.searchsorted(total, (np.arange(count) + 0.5) / count * total[-1])]
    mean, median = disc_points(np.stack([field.airy_kavrayskiy.mdt, field.geometric_median.T])).tolist()
    return _Cloud(disc_points(chosen), matrices.areal_scale(chosen), mean, median)


# ---- drawing ----------------------------------------------------------------------------------


def _draw(ax: Axes, cloud: _Cloud, scale: ColourScale, reach: float) -> None:
    colours, letters = style_of(ax).colours, style_of(ax).scale
    margin = 1.2 * reach
    set_view(ax, -margin, margin, -margin, margin)
    rim = patches.Circle((0.0, 0.0), reach, facecolor="none", edgecolor=colours.outline, linewidth=0.8, zorder=1.0)
    ax.add_patch(rim)
    ax.plot([-reach, reach, np.nan, 0, 0], [0, 0, np.nan, -reach, reach], color=colours.quiet, linewidth=0.4, alpha=0.5)
    far = cloud.points[np.argsort(np.abs(cloud.points - cloud.mean))][:: max(len(cloud.points) // _RAYS, 1)]
    ray = {"colors": colours.quiet, "linewidths": 0.5, "alpha": 0.6, "zorder": 2.0}
    rays = add_lines(ax, [geodesic(cloud.mean, one) for one in far], label="geodesics from the mean", **ray)
    paler = np.argsort(np.abs(np.log(cloud.sizes)))
    x, y = cloud.points.real[paler], cloud.points.imag[paler]
    # Darker, larger points beneath, so that those of the background's colour show.
    under = ax.scatter(x, y, s=letters * 9.0, color=colours.quiet, linewidths=0.0, zorder=1.7, rasterized=True)
    field: dict[str, Any] = {"cmap": scale.colours, "vmin": 0.0, "vmax": 1.0, "linewidths": 0.0}
    shades = scale.norm(cloud.sizes[paler])
    places = ax.scatter(x, y, s=letters * 5.0, c=shades, zorder=1.8, rasterized=True, label="places", **field)
    for drawn in (rays, under, places):
        drawn.set_clip_path(rim)
    inks, mean = (colours.background, colours.text), (cloud.mean, "D", "mean (MDT)", 34.0, 4.0)
    for z, marker, label, area, order in (mean, (cloud.median, "s", "median", 30.0, 3.9)):
        face, edge = inks if marker == "D" else inks[::-1]
        dot: dict[str, Any] = {"markeredgecolor": edge, "markeredgewidth": 1.2, "markersize": letters * np.sqrt(area)}
        ax.plot([z.real], [z.imag], marker, color=face, label=label, linestyle="none", zorder=order, **dot)
    _draw_rings(ax, reach)
    draw_glyphs(ax, reach)


def geodesic(start: complex, end: complex) -> FloatArray:
    """Points (m, 2) of the geodesic between two points of the disc."""
    seen = (end - start) / (1.0 - np.conj(start) * end) * np.linspace(0.0, 1.0, 41)
    line = (start + seen) / (1.0 + np.conj(start) * seen)
    return np.stack([line.real, line.imag], axis=-1)


def _draw_rings(ax: Axes, reach: float) -> None:
    """Draw circles of equal angular deformation, labelled at the lower left, where most maps have no points."""
    style, colours = style_of(ax), style_of(ax).colours
    box = {"facecolor": colours.background, "edgecolor": "none", "alpha": 0.75, "pad": 0.8}
    degrees = _rings(reach)
    for omega, label in zip(degrees, level_labels(degrees), strict=True):
        radius = float(np.sin(np.radians(omega) / 2.0))
        line: dict[str, Any] = {"edgecolor": colours.quiet, "linewidth": 0.5, "linestyle": (0, (2, 2)), "zorder": 1.0}
        ax.add_patch(patches.Circle((0.0, 0.0), radius, facecolor="none", **line))
        x, y = radius * np.array([np.cos(_LABELS), np.sin(_LABELS)])
        ax.text(x, y, f"{label}°", ha="center", va="center", zorder=5.0, bbox=box, **style.letters(7.0))


def _rings(reach: float) -> FloatArray:
    """Round numbers of degrees within a radius."""
    most = np.degrees(2.0 * np.arcsin(min(reach, 1.0)))
    if reach >= 1.0:
        return np.array([20.0, 45.0, 90.0])
    power = 10.0 ** np.floor(np.log10(most))
    for step in (5.0, 2.0, 1.0, 0.5, 0.2, 0.1):
        levels = np.arange(1, 20) * step * power
        levels = levels[levels < 0.97 * most]
        if levels.size >= _RINGS[0]:
            return np.asarray(levels[: _RINGS[1]])
    return np.array([most / 2.0])


def draw_glyphs(ax: Axes, reach: float) -> None:
    """Draw ellipses around the rim: the shapes in each direction."""
    colours = style_of(ax).colours
    for k in range(_GLYPHS):
        angle = 360.0 * k / _GLYPHS
        x, y = 1.1 * reach * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        ellipse = patches.Ellipse((x, y), 0.13 * reach, 0.055 * reach, angle=angle / 2.0, zorder=3.0)
        ellipse.set(facecolor=colours.face, edgecolor=colours.edge, linewidth=0.6)
        ax.add_patch(ellipse)


def _draw_legend(figure: StyledFigure, panes: Sequence[Axes], *, is_below: bool) -> None:
    """Draw a legend in the lower corners of the first panel, or below all."""
    ax, style = panes[0], figure.style
    handles: list[Any] = [one for one in ax.get_lines() if one.get_label() in ("mean (MDT)", "median")]
    handles += [one for one in ax.collections if str(one.get_label()).startswith("geodesics")]
    shape: dict[str, Any] = {"frameon": False, "handlelength": 1.4, "borderaxespad": 0.0}
    shape |= {"fontsize": style.scale * 7.0, "labelcolor": style.colours.text}
    if is_below:
        dot: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": style.colours.quiet, "linestyle": "none"}
        handles += ax.plot([], [], "o", label="circles: angular deformation ω", **dot)
        place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, panes[-1].get_position().y0)}
        figure.legend(handles=handles, ncols=2, **place, **shape)
        return
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(-0.02, -0.02), **shape)
    text = "Circles: angular\ndeformation ω"
    ax.text(1.0, 0.0, text, transform=ax.transAxes, ha="right", va="bottom", **style.letters(7.0))
