"""Figures of images: old maps on their scans, and mosaics in several frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib import patheffects, tri
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import ConvexHull

from projdist import support, surfaces
from projdist._typing import AnyArray, AnyPath, BoolArray, FloatArray
from projdist.applications import mosaics
from projdist.applications.oldmaps import LOCAL_MEASURES, OldMap, scan_extent
from projdist.plots import basemap, map_drawing, styled_figure
from projdist.plots.colours import ColourScale, level_labels, shown_levels
from projdist.plots.style import Look, look_for
from projdist.plots.styled_figure import (
    FigureStyle,
    StyledFigure,
    add_lines,
    add_polygons,
    scale_for,
    set_view,
    style_of,
)

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


def read_scan(path: AnyPath, found: OldMap) -> Scan:
    """Scan whose pixel coordinates the control points have; raises ValueError if it is none, or they lie outside."""
    path = support.check_path("image", path)
    text = f"Invalid image '{path}'."
    with mosaics.open_image(path, text) as image:
        width, height = image.size
        image.draft("RGB", (_LONGEST, _LONGEST))  # a JPEG is read at a part of its size
        mosaics.check_pixels(image)
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
_NARROWEST, _TEXT = 0.5, 3.6  # inches: of a map, and of a column, for the lines below the titles


@dataclass(frozen=True, kw_only=True)
class OldMapSheet:
    """Drawn part of an old map: mesh over the hull of its control points, true places, corrected Jacobians."""

    found: OldMap
    mesh: tri.Triangulation
    truth: FloatArray
    J: FloatArray
    hull: FloatArray
    view: tuple[float, float, float, float]  # left, right, bottom, top; of a mirrored map top < bottom
    scan: Scan | None

    @property
    def folded(self) -> BoolArray:
        """True where the fit folds."""
        return np.asarray(np.isnan(self.J[:, 0, 0]))


def old_map_figure(
    found: OldMap,
    *,
    draw: Sequence[str] = ("tissot", "heatmap", "rotation", "scale"),
    measure: str = "fisher",
    image: AnyPath | None = None,
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    look: Look | str | None = None,
) -> Figure:
    """An old map with one or several panels of `draw`: "tissot", "heatmap" (of "fisher" or "areal_scale"), "rotation",
    "scale" and "grid".

    `image` is the scan, in whose pixels the points are: their y downwards from its top, or, of points that are not
    mirrored, upwards from its bottom, or negative downwards. `look` is the style, or the name of a theme; its title is
    a heading. Raises ValueError.
    """
    support.check_instance("old map", found, OldMap, "an OldMap")
    draw = [support.check_text("panel", panel) for panel in support.listed_values(draw)]
    if not draw or any(panel not in OLD_MAP_PANELS for panel in draw):
        raise ValueError(f"Invalid panels '{', '.join(draw)}'. They must be of {', '.join(OLD_MAP_PANELS)}.")
    if support.check_text("measure", measure) not in OLD_MAP_MEASURES:
        raise ValueError(f"Invalid measure '{measure}' of an old map. It must be {' or '.join(OLD_MAP_MEASURES)}.")
    size, dpi = styled_figure.check_size(size), styled_figure.check_dpi(dpi)
    sheet = _sheet(found, None if image is None else read_scan(image, found))
    look = look_for(look)
    with look.applied():
        figure, panels = _layout(sheet, draw, size, dpi, look)
        for name, panel in zip(draw, panels, strict=True):
            if sheet.scan is not None:
                panel.ax.imshow(sheet.scan.pixels, extent=sheet.scan.extent, zorder=0.0)
            set_view(panel.ax, *sheet.view)
            OLD_MAP_PANELS[name](panel, measure)
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
        mesh=tri.Triangulation(*vertices.T),
        truth=found.fit(vertices),
        J=found.corrected(found.local_jacobian(vertices)),
        hull=np.vstack([corners, corners[:1]]),
        view=(left, right, bottom, top),
        scan=scan,
    )


def _inside(hull: ConvexHull, step: float, margin: float) -> FloatArray:
    """Points of a square grid within a hull, with a margin."""
    low, high = hull.min_bound, hull.max_bound
    counts = np.ceil((high - low) / step)
    axes = [start + step * (np.arange(count) + 0.5) for start, count in zip(low, counts, strict=True)]
    places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    beyond = places @ hull.equations[:, :2].T + hull.equations[:, 2]
    return np.asarray(places[(beyond < -margin).all(axis=1)])


# ---- panels ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _OldMapPanel:
    """Axes of a panel of an old map, and axes below for its colour bar."""

    ax: Axes
    bar: Axes
    sheet: OldMapSheet

    def show_ground(self) -> None:
        """Draw the hull, pale without a scan, and folds."""
        if self.sheet.scan is None:
            self.ax.fill(*self.sheet.hull.T, facecolor=style_of(self.ax).colours.sea, zorder=0.1)
        self.show_rim()

    def show_rim(self) -> None:
        """Draw the edge of the hull, and folds."""
        sheet, mesh = self.sheet, self.sheet.mesh
        self.ax.plot(*sheet.hull.T, color=style_of(self.ax).colours.outline, linewidth=0.8, zorder=3.0)
        folds = mesh.triangles[sheet.folded[mesh.triangles].any(axis=1)]
        if len(folds):
            places = np.stack([mesh.x, mesh.y], axis=-1)[folds]
            add_polygons(self.ax, places, color=_FOLD, linewidths=0.5, zorder=2.6, label="folds")

    def show_title(self, title: str, below: str) -> None:
        """Draw a title and a subtitle, which mentions folds."""
        styled_figure.draw_title(self.ax, title, below + ("; pink: the fit folds" if self.sheet.folded.any() else ""))

    def show_grid(self, *, strong: bool = False) -> float:
        """Draw lines of equal true x and y at a round distance; returns it in metres."""
        sheet, colours = self.sheet, style_of(self.ax).colours
        step = basemap.round_down(float(np.ptp(sheet.truth, axis=0).max()) / _LINES)
        colour = "#00000066" if sheet.scan is not None else f"{colours.text}66" if strong else colours.graticule
        for values in sheet.truth.T:
            levels = step * np.arange(np.ceil(values.min() / step), np.floor(values.max() / step) + 1.0)
            if levels.size:
                self.ax.tricontour(sheet.mesh, values, levels=levels, colors=colour, linewidths=0.5, zorder=1.0)
        return step

    def show_field(self, name: str, denominator: float | None = None) -> None:
        """Draw colours and isolines of a measure, and its colour bar; scales as 1 : N where `denominator` is known."""
        sheet, mesh = self.sheet, self.sheet.mesh
        values = LOCAL_MEASURES[name](sheet.J)
        present = values[~sheet.folded]
        scale = ColourScale.of(LOCAL_MEASURES[name], [present], colours=style_of(self.ax).colours)
        if denominator is not None:  # levels are round denominators
            low, high = (denominator / end for end in reversed(scale.limits))
            step = basemap.round_down(1.5 * (high - low) / _LINES)
            rounded = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
            scale = replace(scale, levels=denominator / rounded[::-1]) if rounded.size else scale
        if sheet.scan is not None:
            self._colour_scan(sheet.scan, values, scale)
        mesh = tri.Triangulation(mesh.x, mesh.y, mesh.triangles)
        mesh.set_mask(sheet.folded[mesh.triangles].any(axis=1))
        values = np.where(sheet.folded, scale.limits[0], values)
        if sheet.scan is None:
            basemap.draw_triangles(self.ax, mesh, values, norm=scale.norm, cmap=scale.colours, zorder=0.5)
        self.show_grid()
        levels = shown_levels(scale, present)
        if levels.size:
            texts = level_labels(levels) if denominator is None else [f"{denominator / one:,.0f}" for one in levels]
            rim = np.stack([sheet.hull[:-1], sheet.hull[1:]], axis=1)
            map_drawing.draw_isolines(self.ax, mesh, values, dict(zip(levels.tolist(), texts, strict=True)), rim)
        self.show_rim()
        style = style_of(self.bar)
        if not style.look.colourbar:
            return
        self.bar.set_axis_on()
        drawn = map_drawing.draw_colourbar(self.bar.figure, scale, cax=self.bar)
        if denominator is not None:
            ticks = [float(tick) for tick in drawn.get_ticks()]
            drawn.set_ticks(ticks, labels=[f"{denominator / one:,.0f}" for one in ticks])
            drawn.set_label("Scale 1 : N", fontsize=style.scale * 9)

    def _colour_scan(self, scan: Scan, values: FloatArray, scale: ColourScale) -> None:
        """Colour the paper of a scan: dark lines stay, blank paper has the colours of the bar."""
        left, right, bottom, top = self.sheet.view
        rows = max(round(_PIXELS * abs(top - bottom) / (right - left)), 1)
        x = left + (right - left) * (np.arange(_PIXELS) + 0.5) / _PIXELS
        y = top + (bottom - top) * (np.arange(rows) + 0.5) / rows
        places = np.stack([self.sheet.mesh.x, self.sheet.mesh.y], axis=-1)
        field = LinearNDInterpolator(places, values)(*np.meshgrid(x, y))
        known = np.isfinite(field)
        colours = scale.colours(scale.norm(np.where(known, field, scale.limits[0])))
        colours[..., :3] *= _DARKEST + (1.0 - _DARKEST) * scan.brightness(x, y)[..., None]
        colours[..., 3] = known
        self.ax.imshow(colours, extent=self.sheet.view, aspect="equal", zorder=0.5)


def _tissot(panel: _OldMapPanel, measure: str) -> None:
    """Draw ellipses, the images of equal circles on the ground."""
    panel.show_ground()
    panel.show_grid()
    hull = ConvexHull(panel.sheet.found.fitted.old)
    step = float(np.sqrt(hull.volume / _ELLIPSES))
    while len(xy := _inside(hull, step, 0.25 * step)) < _FEWEST:  # a hull may be narrower than the step
        step *= 0.8
    J = panel.sheet.found.local_jacobian(xy)
    known = ~np.isnan(J[:, 0, 0])
    shapes = surfaces.Ellipses(xy=xy[known], J=J[known])
    radius = float(f"{_FILL * surfaces.close_pairs(shapes)[2]:.2g}")
    colours = style_of(panel.ax).colours
    style = {"facecolors": colours.face, "edgecolors": colours.edge, "linewidths": 0.5}
    add_polygons(panel.ax, surfaces.ellipses(shapes, radius, 72), zorder=2.0, label="indicatrices", **style)
    panel.show_title("Tissot's indicatrices", f"Circles in truth with a radius of {_length(radius)}")


def _heatmap(panel: _OldMapPanel, measure: str) -> None:
    """Draw Fisher distortion or areal scale after the MDT."""
    panel.show_field(measure)
    if measure == "fisher":
        mean = panel.sheet.found.rectifications["mdt"].distortion
        panel.show_title("Fisher distortion", f"After the MDT, with a mean square of {round(mean, 12):.4g}")
    else:
        panel.show_title("Areal scale", "After the MDT, relative to the mean")


def _rotation(panel: _OldMapPanel, measure: str) -> None:
    """Draw isolines of rotation."""
    panel.show_field("rotation")
    turn = round(float(panel.sheet.found.rectifications["mdt"].parts.rotation), 2) + 0.0  # no -0.00
    panel.show_title("Rotation", f"Degrees clockwise from the mean, which is {turn:.2f}")


def _scale(panel: _OldMapPanel, measure: str) -> None:
    """Draw isolines of scale denominators, or without a known resolution of scale relative to the mean."""
    metres = float(panel.sheet.found.rectifications["mdt"].parts.scale)
    denominator = panel.sheet.found.denominator(metres)
    panel.show_field("scale", denominator)
    below = f"Relative to the mean, where a unit is {metres:.4g} m"
    if denominator is not None:
        below = f"The mean is 1 : {float(f'{denominator:.4g}'):,.10g}"
    panel.show_title("Scale", below)


def _grid(panel: _OldMapPanel, measure: str) -> None:
    """Draw the true grid, the control points, and their displacements from the MDT."""
    ax, found, style = panel.ax, panel.sheet.found, style_of(panel.ax)
    panel.show_ground()
    step = panel.show_grid(strong=True)
    meant = found.rectifications["mdt"].affine.inverse()(found.points.new)
    lines = np.stack([found.points.old, meant], axis=1)
    far = found.is_outlier
    point = _POINT if style.look.theme is None or panel.sheet.scan is not None else style.colours.text
    colours = np.where(far, _OUTLIER, point).tolist()
    add_lines(ax, lines, colors=colours, linewidths=0.6, zorder=2.0, label="displacements")
    size = float(np.clip(3e3 / len(far), 3.0, 16.0))
    for chosen, colour in ((~far, point), (far, _OUTLIER)):
        x, y = found.points.old[chosen].T
        ax.scatter(x, y, s=size, c=colour, linewidths=0, zorder=2.2)
    for name in found.outliers[:12]:
        number = found.points.names.index(name)
        goes_right = meant[number, 0] > found.points.old[number, 0]
        offset, side = ((-3, 3), "right") if goes_right else ((3, 3), "left")  # beside the line
        place: dict[str, Any] = {"xytext": offset, "textcoords": "offset points", "ha": side, "zorder": 2.5}
        halo = [patheffects.withStroke(linewidth=1.8, foreground=style.colours.halo)]
        words = style.letters(6.5) | {"color": _OUTLIER, "path_effects": halo}
        ax.annotate(name, found.points.old[number], **place, **words)
    below = "Lines lead to where the MDT has the points"
    if far.any():
        below += "; red: outliers" + ("" if found.is_fitted.all() else ", left out")
    panel.show_title(f"True grid, {_length(step)}", below)


OLD_MAP_PANELS: dict[str, Callable[[_OldMapPanel, str], None]] = {
    "tissot": _tissot,
    "heatmap": _heatmap,
    "rotation": _rotation,
    "scale": _scale,
    "grid": _grid,
}
_WITH_BAR = ("heatmap", "rotation", "scale")


def _length(metres: float) -> str:
    return f"{metres / 1e3:,.6g} km" if metres >= 1e3 else f"{metres:.6g} m"


def _layout(
    sheet: OldMapSheet, panels: Sequence[str], size: tuple[float, float] | None, dpi: float, look: Look
) -> tuple[Figure, list[_OldMapPanel]]:
    """Figure with axes for each panel, and axes below for its colour bar."""
    left, right, bottom, top = sheet.view
    shape, count = abs(top - bottom) / (right - left), len(panels)
    columns = 1 if count == 1 or (count == 2 and shape < 0.4) else 2
    in_rows = [panels[first : first + columns] for first in range(0, count, columns)]
    letters = scale_for(look, None if size is None else (size[0] / columns, size[1] / len(in_rows)))
    style = FigureStyle(look, letters, has_heading=True)
    title = letters * _TITLE if look.has_titles else _FOOT
    feet = [letters * _BAR if look.colourbar and set(row) & set(_WITH_BAR) else _FOOT for row in in_rows]
    fixed = sum(feet) + len(in_rows) * title
    usual = 7.0 if columns == 1 else 11.0, 9.0 if len(in_rows) == 1 else 12.0
    width, height = style.content(usual if size is None else size)
    w = min((width - _GAP) / columns - _GAP, (height - fixed) / len(in_rows) / shape)
    styled_figure.check_room(w > _NARROWEST, usual if size is None else size, f"{count} panels")
    if size is None:
        width, height = columns * max(w + _GAP, letters * _TEXT) + _GAP, len(in_rows) * w * shape + fixed
    spare = (height - fixed - len(in_rows) * w * shape) / len(in_rows)
    figure = StyledFigure(style, (width, height), dpi)
    length = min(max(0.8 * w, 0.6 * (width - _GAP) / columns), 5.0)
    placed, upper = [], height
    for row, foot in zip(in_rows, feet, strict=True):
        lower = upper - title - 0.5 * spare - w * shape
        for column in range(len(row)):
            middle = 0.5 * width + (column - 0.5 * (len(row) - 1)) * (width - _GAP) / columns
            ax = figure.panel(middle - 0.5 * w, lower, w, w * shape)
            bar = figure.panel(middle - 0.5 * length, lower - letters * 0.22, length, letters * 0.12)
            bar.set_axis_off()
            placed.append(_OldMapPanel(ax, bar, sheet))
        upper = lower - 0.5 * spare - foot
    return figure, placed


# ---- mosaics -------------------------------------------------------------------------------------

_MOSAIC_FOOT = 0.2  # inches
_MOSAIC_PIXELS = 8e5  # of a panel
_FLAT = (12.0, 1.0)  # the shape of an empty one
_FACE, _EDGE, _RIM = "#4a7ba630", "#1f3b57", "#c2402899"
_NUMBERS = 60  # images that have room for them
_FIGURES = {"affine": "Sum of Dist_F² = {:.4g}", "homography": "Mean of Dist_F² = {:.4g}"}
_TITLES = {"first": "First", "last": "Last", "central": "Central", "best": "Best image's plane", "mdt": "MDT"}


def mosaic_figure(
    found: mosaics.Mosaic,
    pictures: Sequence[mosaics.Picture] | None = None,
    *,
    frames: Sequence[str] = ("first", "last", "central", "best", "mdt"),
    size: tuple[float, float] | None = None,
    dpi: float = 150.0,
    look: Look | str | None = None,
) -> Figure:
    """A mosaic in several frames, each with its distortion, as large as possible.

    The images are drawn with their rims, or without `pictures` the rims alone. A frame in which an image reaches
    infinity has only a title. `look` is the style, or the name of a theme; its title is a heading. Raises ValueError,
    and ImportError for pictures without OpenCV.
    """
    support.check_instance("mosaic", found, mosaics.Mosaic, "a Mosaic")
    if not frames or any(name not in found.frames for name in frames):
        raise ValueError(f"Invalid frames '{', '.join(frames)}'. They must be of {', '.join(found.frames)}.")
    panels = [_rendered(found, name, pictures) for name in frames]
    sides = [_FLAT if panel is None else (panel[0].width, panel[0].height) for panel in panels]
    shapes = np.array(sides, dtype=float)
    words = [_words(found, name) for name in frames]
    look, shapes = look_for(look), shapes / shapes.max(axis=1, keepdims=True)
    if len(words) == 1 and look.title:
        words = [(look.title, words[0][1])]
    with look.applied():
        figure, axes, room = styled_figure.arranged(shapes, size, dpi, foot=_MOSAIC_FOOT, words=words, look=look)
        for ax, panel, (title, below) in zip(axes, panels, words, strict=True):
            ax.set_axis_off()
            if panel is not None:
                _draw_mosaic(ax, found, *panel)
            styled_figure.draw_title(ax, title, below)
        styled_figure.fit_titles(axes, room)
    return figure


def _rendered(
    found: mosaics.Mosaic, name: str, pictures: Sequence[mosaics.Picture] | None
) -> tuple[mosaics.Canvas, AnyArray | None] | None:
    """Canvas of a panel, and its pixels where there are pictures; None for an impossible frame."""
    frame = found.frames[name]
    if frame is None:
        return None
    there = replace(found, frame=frame, frame_name=name)
    if pictures is None:
        return there.canvas(most_pixels=_MOSAIC_PIXELS), None
    drawn = mosaics.render(there, pictures, most_pixels=_MOSAIC_PIXELS)
    assert isinstance(drawn.canvas, mosaics.Canvas), "what is drawn of a mosaic is in a plane"
    return drawn.canvas, drawn.pixels


def _draw_mosaic(ax: Axes, found: mosaics.Mosaic, canvas: mosaics.Canvas, pixels: AnyArray | None) -> None:
    rims = mosaics.places(canvas.matrices, mosaics.corners(found.registration.sizes))
    ax.set_xlim(0.0, canvas.width)
    ax.set_ylim(canvas.height, 0.0)
    if pixels is not None:
        ax.imshow(pixels, extent=(0.0, canvas.width, canvas.height, 0.0), aspect="auto", zorder=0.5)
        add_lines(ax, np.concatenate([rims, rims[:, :1]], axis=1), colors=_RIM, linewidths=0.5, zorder=1.0)
        return
    style = style_of(ax)
    edge = _EDGE if style.look.theme is None else style.colours.text
    add_polygons(ax, rims, facecolors=_FACE, edgecolors=edge, linewidths=0.6, zorder=1.0)
    if len(rims) <= _NUMBERS:
        for image, (x, y) in zip(found.images, rims.mean(axis=1), strict=True):
            ax.text(x, y, str(image), ha="center", va="center", fontsize=style.scale * 7, color=edge)


def _words(found: mosaics.Mosaic, name: str) -> tuple[str, str]:
    """Title (the frame and its image) and subtitle (its distortion)."""
    frame = found.frames[name]
    if frame is None:
        return _TITLES[name], "Impossible: the plane sends an image to infinity"
    title = _TITLES[name] if frame.reference is None else f"{_TITLES[name]} ({found.points.name(frame.reference)})"
    return title, _FIGURES[found.registration.model].format(frame.figure)
