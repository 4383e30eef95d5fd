"""Figures of old maps, on their scans."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.tri import Triangulation
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import ConvexHull

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.mosaics import check_pixels, open_image
from projdist.applications.oldmaps import LOCAL_MEASURES, OldMap, scan_extent
from projdist.plots.basemap import draw_title
from projdist.plots.colours import ColourScale, colour_scale, level_labels, shows_isolines
from projdist.plots.layouts import check_dpi, check_size
from projdist.plots.pictures import draw_colourbar, label_isolines
from projdist.plots.style import Look, StyledFigure, look_for, look_of, scale_for, scale_of
from projdist.support import check_instance, check_path, check_text, listed_values
from projdist.surfaces import close_pairs, ellipses

_LONGEST = 4000  # pixels of a side that are drawn
_PAPER = 0.7  # of the pixels are darker than blank paper


@dataclass(frozen=True, eq=False)
class Scan:
    """Pixels of a scan, and its extent (left, right, bottom, top) in the old map's coordinates."""

    pixels: AnyArray
    extent: tuple[float, float, float, float]

    def brightness(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Brightness (y, x) of the pixels, 1 for blank paper."""
        left, right, bottom, top = self.extent
        height, width = self.pixels.shape[:2]
        columns = np.clip(((x - left) / (right - left) * width).astype(int), 0, width - 1)
        rows = np.clip(((y - top) / (bottom - top) * height).astype(int), 0, height - 1)
        grey = self.pixels[rows[:, None], columns].mean(axis=-1)
        return np.minimum(grey / max(float(np.quantile(grey, _PAPER)), 1.0), 1.0)


def read_scan(path: str | os.PathLike[str], found: OldMap) -> Scan:
    """Scan whose pixel coordinates the control points have; raises ValueError if it is none, or they lie outside."""
    path = check_path("image", path)
    text = f"Invalid image '{path}'."
    with open_image(path, text) as image:
        width, height = image.size
        image.draft("RGB", (_LONGEST, _LONGEST))  # a JPEG is read at a part of its size
        check_pixels(image)
        image.thumbnail((_LONGEST, _LONGEST))
        pixels = np.asarray(image.convert("RGB"))
    return Scan(pixels, scan_extent(found, width, height, text))


# ---- oldmaps -------------------------------------------------------------------------------------


OLD_MAP_MEASURES = ("fisher", "areal_scale")  # of the heat map

_VERTICES = 9000  # of the mesh
_ELLIPSES, _FEWEST = 130, 20
_FILL = 0.6  # of the radius at which an ellipse and its closest neighbour usually touch
_MARGIN = 0.04  # of the larger side
_AROUND = 0.15  # of a scan, about the points, in the larger side
_LINES = 8  # of the true grid across
_PIXELS = 1200  # across, of colours on a scan
_DARKEST = 0.25  # of a colour's brightness, where the scan is black
_POINT, _OUTLIER, _FOLD = "#1f3b57", "#b3002d", "#d81b60"
_GAP, _TITLE, _FOOT, _BAR = 0.2, 0.55, 0.15, 0.75  # inches
_HEADING = 0.36  # inches above all
_NARROWEST, _TEXT = 0.5, 3.6  # inches: of a map, and of a column, for the lines below the titles
_MOST_NAMES = 12


@dataclass(frozen=True, kw_only=True)
class OldMapSheet:
    """Drawn part of an old map: mesh over the hull of its control points, true places, corrected Jacobians.

    `view` is left, right, bottom and top; of a mirrored old map the top is less than the bottom.
    """

    found: OldMap
    mesh: Triangulation
    truth: FloatArray
    J: FloatArray
    hull: FloatArray
    view: tuple[float, float, float, float]
    scan: Scan | None

    @property
    def folded(self) -> BoolArray:
        """True where the fit folds."""
        return np.asarray(np.isnan(self.J[:, 0, 0]))


@dataclass(frozen=True, eq=False)
class _Ellipses:
    xy: FloatArray
    J: FloatArray


def old_map_figure(
    found: OldMap,
    *,
    draw: Sequence[str] = ("tissot", "heatmap", "rotation", "scale"),
    measure: str = "fisher",
    image: str | os.PathLike[str] | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    look: Look | str | None = None,
) -> Figure:
    """An old map with one or several panels of `draw`: "tissot", "heatmap" (of "fisher" or "areal_scale"), "rotation",
    "scale" and "grid".

    `image` is the scan, in whose pixels the points are: their y downwards from its top, or, of points that are not
    mirrored, upwards from its bottom, or negative downwards. A `look`, or the name of a theme, says how it looks; its
    title is a heading. Raises ValueError.
    """
    check_instance("old map", found, OldMap, "an OldMap")
    draw = [check_text("panel", panel) for panel in listed_values(draw)]
    if not draw or any(panel not in OLD_MAP_PANELS for panel in draw):
        raise ValueError(f"Invalid panels '{', '.join(draw)}'. They must be of {', '.join(OLD_MAP_PANELS)}.")
    if check_text("measure", measure) not in OLD_MAP_MEASURES:
        raise ValueError(f"Invalid measure '{measure}' of an old map. It must be {' or '.join(OLD_MAP_MEASURES)}.")
    size, dpi = check_size(size), check_dpi(dpi)
    sheet = _sheet(found, None if image is None else read_scan(image, found))
    look = look_for(look)
    with look.applied():
        figure, places = _layout(sheet, draw, size, dpi, look)
        for panel, (ax, bar) in zip(draw, places, strict=True):
            _set_view(ax, sheet)
            OLD_MAP_PANELS[panel](ax, bar, sheet, measure)
    return figure


# ---- the sheet ------------------------------------------------------------------------------


def _sheet(found: OldMap, scan: Scan | None) -> OldMapSheet:
    """Drawn part of an old map, with a mesh of nearly equal triangles."""
    hull = ConvexHull(found.fitted.old)
    corners = found.fitted.old[hull.vertices]
    step = float(np.sqrt(hull.volume / _VERTICES))
    inner = _inside(hull, step, 0.4 * step)
    rim = []
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = int(np.ceil(np.hypot(*(stop - start)) / step))
        rim.append(start + (stop - start) * np.arange(count)[:, None] / count)
    vertices = np.concatenate([inner, *rim])
    low, high = corners.min(axis=0), corners.max(axis=0)
    side = float((high - low).max())
    margin = _MARGIN * side if scan is None else _AROUND * side
    left, right, bottom, top = low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin
    if scan is not None:
        (x0, x1), (y0, y1) = sorted(scan.extent[:2]), sorted(scan.extent[2:])
        left, right, bottom, top = max(left, x0), min(right, x1), max(bottom, y0), min(top, y1)
    if found.is_mirrored:
        bottom, top = top, bottom
    return OldMapSheet(
        found=found,
        mesh=Triangulation(*vertices.T),
        truth=found.fit(vertices),
        J=found.corrected(found.local_jacobian(vertices)),
        hull=np.vstack([corners, corners[:1]]),
        view=(left, right, bottom, top),
        scan=scan,
    )


def _inside(hull: ConvexHull, step: float, margin: float) -> FloatArray:
    """Points of a square grid within a hull, with a margin."""
    low, high = hull.min_bound, hull.max_bound
    axes = [
        start + step * (np.arange(np.ceil((stop - start) / step)) + 0.5) for start, stop in zip(low, high, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    beyond = places @ hull.equations[:, :2].T + hull.equations[:, 2]
    return np.asarray(places[(beyond < -margin).all(axis=1)])


# ---- panels ---------------------------------------------------------------------------------


def _tissot(ax: Axes, bar: Axes, sheet: OldMapSheet, measure: str) -> None:
    """Draw ellipses, the images of equal circles on the ground."""
    _draw_ground(ax, sheet)
    _draw_grid(ax, sheet)
    hull = ConvexHull(sheet.found.fitted.old)
    step = float(np.sqrt(hull.volume / _ELLIPSES))
    while len(xy := _inside(hull, step, 0.25 * step)) < _FEWEST:  # a hull may be narrower than the step
        step *= 0.8
    J = sheet.found.local_jacobian(xy)
    known = ~np.isnan(J[:, 0, 0])
    shapes = _Ellipses(xy[known], J[known])
    radius = float(f"{_FILL * close_pairs(shapes)[2]:.2g}")
    ax.add_collection(
        PolyCollection(
            list(ellipses(shapes, radius, 72)),
            facecolors=look_of(ax).colours.face,
            edgecolors=look_of(ax).colours.edge,
            linewidths=0.5,
            zorder=2.0,
            label="indicatrices",
        ),
        autolim=False,
    )
    _draw_title(ax, sheet, "Tissot's indicatrices", f"Circles in truth with a radius of {_length(radius)}")


def _heatmap(ax: Axes, bar: Axes, sheet: OldMapSheet, measure: str) -> None:
    """Draw Fisher distortion or areal scale after the MDT."""
    mean = sheet.found.rectifications["mdt"].distortion
    scale = _draw_field(ax, sheet, measure)
    _draw_colourbar(bar, scale, None)
    title, below = {
        "fisher": ("Fisher distortion", f"After the MDT, with a mean square of {round(mean, 12):.4g}"),
        "areal_scale": ("Areal scale", "After the MDT, relative to the mean"),
    }[measure]
    _draw_title(ax, sheet, title, below)


def _rotation(ax: Axes, bar: Axes, sheet: OldMapSheet, measure: str) -> None:
    """Draw isolines of rotation."""
    turn = round(float(sheet.found.rectifications["mdt"].parts.rotation), 2) + 0.0  # no -0.00
    scale = _draw_field(ax, sheet, "rotation")
    _draw_colourbar(bar, scale, None)
    _draw_title(ax, sheet, "Rotation", f"Degrees clockwise from the mean, which is {turn:.2f}")


def _scale(ax: Axes, bar: Axes, sheet: OldMapSheet, measure: str) -> None:
    """Draw isolines of scale denominators, or without a known resolution of scale relative to the mean."""
    metres = float(sheet.found.rectifications["mdt"].parts.scale)
    denominator = sheet.found.denominator(metres)
    scale = _draw_field(ax, sheet, "scale", denominator)
    _draw_colourbar(bar, scale, denominator)
    below = f"Relative to the mean, where a unit is {metres:.4g} m"
    if denominator is not None:
        below = f"The mean is 1 : {float(f'{denominator:.4g}'):,.10g}"
    _draw_title(ax, sheet, "Scale", below)


def _grid(ax: Axes, bar: Axes, sheet: OldMapSheet, measure: str) -> None:
    """Draw the true grid, the control points, and their displacements from the MDT."""
    found = sheet.found
    _draw_ground(ax, sheet)
    step = _draw_grid(ax, sheet, strong=True)
    meant = found.rectifications["mdt"].affine.inverse()(found.points.new)
    lines = np.stack([found.points.old, meant], axis=1)
    far = found.is_outlier
    colours = np.where(far, _OUTLIER, _point(ax, sheet)).tolist()
    ax.add_collection(
        LineCollection(list(lines), colors=colours, linewidths=0.6, zorder=2.0, label="displacements"), autolim=False
    )
    size = float(np.clip(3e3 / len(far), 3.0, 16.0))
    for chosen, colour in ((~far, _point(ax, sheet)), (far, _OUTLIER)):
        x, y = found.points.old[chosen].T
        ax.scatter(x, y, s=size, c=colour, linewidths=0, zorder=2.2)
    for name in found.outliers[:_MOST_NAMES]:
        number = found.points.names.index(name)
        goes_right = meant[number, 0] > found.points.old[number, 0]
        ax.annotate(
            name,
            found.points.old[number],
            xytext=(-3, 3) if goes_right else (3, 3),  # beside the line
            textcoords="offset points",
            horizontalalignment="right" if goes_right else "left",
            fontsize=scale_of(ax) * 6.5,
            color=_OUTLIER,
            path_effects=[withStroke(linewidth=1.8, foreground=look_of(ax).colours.halo)],
            zorder=2.5,
        )
    below = "Lines lead to where the MDT has the points" + _red(found)
    _draw_title(ax, sheet, f"True grid, {_length(step)}", below)


def _red(found: OldMap) -> str:
    """Colour of outliers."""
    if not found.is_outlier.any():
        return ""
    return "; red: outliers" + ("" if found.is_fitted.all() else ", left out")


def _point(ax: Axes, sheet: OldMapSheet) -> str:
    """Colour of control points: blue, or in a theme without a scan that of the text."""
    look = look_of(ax)
    return _POINT if look.theme is None or sheet.scan is not None else look.colours.text


OLD_MAP_PANELS: dict[str, Callable[[Axes, Axes, OldMapSheet, str], None]] = {
    "tissot": _tissot,
    "heatmap": _heatmap,
    "rotation": _rotation,
    "scale": _scale,
    "grid": _grid,
}


_WITH_BAR = ("heatmap", "rotation", "scale")


# ---- what panels share ----------------------------------------------------------------------


def _set_view(ax: Axes, sheet: OldMapSheet) -> None:
    left, right, bottom, top = sheet.view
    if sheet.scan is not None:
        ax.imshow(sheet.scan.pixels, extent=sheet.scan.extent, zorder=0.0)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _draw_ground(ax: Axes, sheet: OldMapSheet) -> None:
    """Draw the hull, pale without a scan, and folds."""
    if sheet.scan is None:
        ax.fill(*sheet.hull.T, facecolor=look_of(ax).colours.sea, zorder=0.1)
    _draw_rim(ax, sheet)


def _draw_rim(ax: Axes, sheet: OldMapSheet) -> None:
    ax.plot(*sheet.hull.T, color=look_of(ax).colours.outline, linewidth=0.8, zorder=3.0)
    folds = sheet.mesh.triangles[sheet.folded[sheet.mesh.triangles].any(axis=1)]
    if len(folds):
        places = np.stack([sheet.mesh.x, sheet.mesh.y], axis=-1)[folds]
        ax.add_collection(
            PolyCollection(list(places), facecolors=_FOLD, edgecolors=_FOLD, linewidths=0.5, zorder=2.6, label="folds"),
            autolim=False,
        )


def _draw_title(ax: Axes, sheet: OldMapSheet, title: str, below: str) -> None:
    draw_title(ax, title, below + ("; pink: the fit folds" if sheet.folded.any() else ""))


def _draw_grid(ax: Axes, sheet: OldMapSheet, strong: bool = False) -> float:
    """Draw lines of equal true x and y at a round distance; returns it in metres."""
    step = _round_down(float(np.ptp(sheet.truth, axis=0).max()) / _LINES)
    colours = look_of(ax).colours
    colour = "#00000066" if sheet.scan is not None else f"{colours.text}66" if strong else colours.graticule
    for values in sheet.truth.T:
        levels = step * np.arange(np.ceil(values.min() / step), np.floor(values.max() / step) + 1.0)
        if levels.size:
            ax.tricontour(sheet.mesh, values, levels=levels, colors=colour, linewidths=0.5, zorder=1.0)
    return step


def _draw_field(ax: Axes, sheet: OldMapSheet, name: str, denominator: float | None = None) -> ColourScale:
    """Draw colours and isolines of a measure."""
    folded = sheet.folded
    values = LOCAL_MEASURES[name](sheet.J)
    present = values[~folded]
    scale = colour_scale(
        LOCAL_MEASURES[name], [present], [np.full(present.size, 1.0 / present.size)], colours=look_of(ax).colours
    )
    if denominator is not None:
        scale = _with_round_denominators(scale, denominator)
    mesh = Triangulation(sheet.mesh.x, sheet.mesh.y, sheet.mesh.triangles)
    mesh.set_mask(folded[mesh.triangles].any(axis=1))
    filled = np.where(folded, scale.limits[0], values)
    if sheet.scan is None:
        ax.tripcolor(mesh, filled, shading="gouraud", norm=scale.norm, cmap=scale.colours, rasterized=True, zorder=0.5)
    else:
        _colour_scan(ax, sheet, sheet.scan, values, scale)
    _draw_grid(ax, sheet)
    inside = scale.levels[(scale.levels > present.min()) & (scale.levels < present.max())]
    if inside.size and shows_isolines(scale, present):
        lines = ax.tricontour(
            mesh, filled, levels=inside, colors=look_of(ax).colours.ink, linewidths=0.6, linestyles="solid", zorder=2.0
        )
        texts = level_labels(inside) if denominator is None else [f"{denominator / one:,.0f}" for one in inside]
        rim = np.stack([sheet.hull[:-1], sheet.hull[1:]], axis=1)
        label_isolines(ax, lines, dict(zip(inside.tolist(), texts, strict=True)), rim)
    _draw_rim(ax, sheet)
    return scale


def _colour_scan(ax: Axes, sheet: OldMapSheet, scan: Scan, values: FloatArray, scale: ColourScale) -> None:
    """Colour the paper of a scan: dark lines stay, blank paper has the colours of the bar."""
    left, right, bottom, top = sheet.view
    rows = max(round(_PIXELS * abs(top - bottom) / (right - left)), 1)
    x = left + (right - left) * (np.arange(_PIXELS) + 0.5) / _PIXELS
    y = top + (bottom - top) * (np.arange(rows) + 0.5) / rows
    field = LinearNDInterpolator(np.stack([sheet.mesh.x, sheet.mesh.y], axis=-1), values)(*np.meshgrid(x, y))
    known = np.isfinite(field)
    colours = scale.colours(scale.norm(np.where(known, field, scale.limits[0])))
    colours[..., :3] *= _DARKEST + (1.0 - _DARKEST) * scan.brightness(x, y)[..., None]
    colours[..., 3] = known
    ax.imshow(colours, extent=sheet.view, aspect="equal", zorder=0.5)


def _with_round_denominators(scale: ColourScale, denominator: float) -> ColourScale:
    """Colour scale whose levels are round denominators of scale."""
    low, high = (denominator / end for end in reversed(scale.limits))
    step = _round_down(1.5 * (high - low) / _LINES)
    rounded = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
    return replace(scale, levels=denominator / rounded[::-1]) if rounded.size else scale


def _draw_colourbar(bar: Axes, scale: ColourScale, denominator: float | None) -> None:
    if not look_of(bar).colourbar:
        return
    bar.set_axis_on()
    drawn = draw_colourbar(bar.figure, scale, cax=bar)
    if denominator is not None:
        ticks = [float(tick) for tick in drawn.get_ticks()]
        drawn.set_ticks(ticks, labels=[f"{denominator / one:,.0f}" for one in ticks])
        drawn.set_label("Scale 1 : N", fontsize=scale_of(bar) * 9)


def _round_down(length: float) -> float:
    """Largest of 1, 2, 5 times a power of ten that does not exceed a value."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(m for m in (1.0, 2.0, 5.0) if m * power <= length * (1 + 1e-9)))


def _length(metres: float) -> str:
    return f"{metres / 1e3:,.6g} km" if metres >= 1e3 else f"{metres:.6g} m"


def _layout(
    sheet: OldMapSheet, panels: Sequence[str], size: tuple[float, float] | None, dpi: float, look: Look
) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Figure with axes for each panel, and axes below for its colour bar."""
    left, right, bottom, top = sheet.view
    shape, count = abs(top - bottom) / (right - left), len(panels)
    columns = 1 if count == 1 or (count == 2 and shape < 0.4) else 2
    in_rows = [panels[first : first + columns] for first in range(0, count, columns)]
    letters = scale_for(look, None if size is None else (size[0] / columns, size[1] / len(in_rows)))
    title, heading = letters * _TITLE if look.has_titles else _FOOT, letters * _HEADING if look.title else 0.0
    feet = [letters * _BAR if look.colourbar and set(row) & set(_WITH_BAR) else _FOOT for row in in_rows]
    fixed = sum(feet) + len(in_rows) * title + heading
    width, height = size if size is not None else (7.0 if columns == 1 else 11.0, 9.0 if len(in_rows) == 1 else 12.0)
    w = min((width - _GAP) / columns - _GAP, (height - fixed) / len(in_rows) / shape)
    if not w > _NARROWEST:
        raise ValueError(f"Invalid size '{width:g},{height:g}'. It has no room for {count} panels.")
    if size is None:
        width, height = columns * max(w + _GAP, letters * _TEXT) + _GAP, len(in_rows) * w * shape + fixed
    spare = (height - fixed - len(in_rows) * w * shape) / len(in_rows)
    figure = StyledFigure(look, letters, figsize=(width, height), dpi=dpi)
    if look.title:
        figure.head(look.title)
    length = min(max(0.8 * w, 0.6 * (width - _GAP) / columns), 5.0)
    places, upper = [], height - heading
    for row, foot in zip(in_rows, feet, strict=True):
        lower = upper - title - 0.5 * spare - w * shape
        for column in range(len(row)):
            middle = 0.5 * width + (column - 0.5 * (len(row) - 1)) * (width - _GAP) / columns
            ax = figure.add_axes(((middle - 0.5 * w) / width, lower / height, w / width, w * shape / height))
            bar = figure.add_axes(
                (
                    (middle - 0.5 * length) / width,
                    (lower - letters * 0.22) / height,
                    length / width,
                    letters * 0.12 / height,
                )
            )
            bar.set_axis_off()
            places.append((ax, bar))
        upper = lower - 0.5 * spare - foot
    return figure, places
