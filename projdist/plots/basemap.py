"""Base maps: sea, land and lakes, lines and their labels, titles, and the region as a clip path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.text import Text
from matplotlib.transforms import TransformedPath
from matplotlib.tri import Triangulation

from projdist._typing import FloatArray, IntArray
from projdist.earth import latitude_text, longitude_text
from projdist.plots.style import is_one_line, is_tight_of, look_of, scale_of, text_width, with_minus
from projdist.support import check_number, check_text
from projdist.surfaces import (
    Bounds,
    Surface,
    coast,
    coast_resolution,
    country_borders,
    graticule,
    graticule_steps,
    graticule_values,
    ground_size,
    lake_polygons,
    lake_shores,
    land_polygons,
    project_lines,
)

CONTEXTS = ("none", "coast", "borders", "full")
"""What a picture shows of the Earth: nothing; land and sea; also borders and lakes; also cities and a locator."""


def check_context(context: str) -> str:
    """Check that a context is one of `CONTEXTS`; raises ValueError."""
    if context not in CONTEXTS:
        raise ValueError(f"Invalid context {context!r}. It must be one of {', '.join(CONTEXTS)}.")
    return context


def shows_borders(surface: Surface, context: str) -> bool:
    """True if lakes and borders are drawn, as on maps of parts of the world."""
    return context in ("borders", "full") and surface.is_local


def triangulation(surface: Surface, triangles: IntArray) -> tuple[Triangulation, IntArray]:
    """Triangulation of a surface for matplotlib, and the vertices in use."""
    used = np.zeros(surface.x.size, dtype=bool)
    used[triangles] = True
    kept = np.flatnonzero(used)
    return Triangulation(surface.x[kept], surface.y[kept], (np.cumsum(used) - 1)[triangles]), kept


def draw_ground(ax: Axes, surface: Surface, context: str) -> None:
    """Draw sea and land as pale areas, paler outside of the region; other bodies are all land."""
    draw_surroundings(ax, surface, context)
    _draw_land(
        ax,
        surface,
        look_of(ax).colours.land,
        0.5,
        context,
        coast_resolution(surface),
        lakes=shows_borders(surface, context),
    )


def draw_surroundings(ax: Axes, surface: Surface, context: str) -> None:
    """Draw sea and land around a region."""
    if surface.ground is not None and context != "none":
        lakes, pale = shows_borders(surface, context), look_of(ax).colours.neighbours
        _draw_land(ax, surface.ground, pale, 0.2, context, coast_resolution(surface), lakes=lakes)


def draw_surface(ax: Axes, surface: Surface) -> None:
    """Draw a small map: sea, land and outline."""
    _draw_land(ax, surface, look_of(ax).colours.locator, 0.5, "coast", coast_resolution(surface))
    west, east, south, north = surface.view
    ax.set(xlim=(west, east), ylim=(south, north), aspect="equal")
    ax.set_axis_off()
    ax.add_collection(
        LineCollection(list(surface.outline), colors="#555555", linewidths=0.6, zorder=1.0), autolim=False
    )


def region_clip(ax: Axes, surface: Surface) -> TransformedPath | None:
    """Clip path of the region; None if its triangles are exactly the region."""
    if not surface.pieces:
        return None
    return TransformedPath(_closed(surface.pieces), ax.transData)


def _closed(pieces: Sequence[FloatArray]) -> Path:
    """Closed polygons of (x, y) as one path."""
    ends = np.cumsum([len(piece) for piece in pieces])
    points = np.concatenate(pieces)
    vertices = np.insert(points, ends, points[np.append(0, ends[:-1])], axis=0)
    ends += np.arange(len(ends))
    codes = np.full(len(vertices), Path.LINETO, dtype=Path.code_type)
    codes[ends] = Path.CLOSEPOLY
    codes[np.append(0, ends[:-1] + 1)] = Path.MOVETO
    return Path(vertices, codes)


def _draw_land(
    ax: Axes, surface: Surface, colour: str, zorder: float, context: str, resolution: str, *, lakes: bool = False
) -> None:
    clip = region_clip(ax, surface)
    has_land = not surface.domain.projection.is_of_another_body and context != "none"
    sea = look_of(ax).colours.sea
    _fill(ax, surface, surface.covering(), sea if has_land else colour, zorder, clip)
    if not has_land:
        return
    areas = [(land_polygons(surface, resolution), colour)]
    if lakes:
        areas.append((lake_polygons(surface, resolution), sea))
    for layer, ((cells, pieces), face) in enumerate(areas, 1):
        above = zorder + 0.1 * layer
        if len(cells):
            _fill(ax, surface, cells, face, above, clip)
        if pieces:
            # A thin edge of the same colour closes the joints between the pieces.
            drawn = PathPatch(_closed(pieces), color=face, linewidth=0.3, rasterized=True, zorder=above)
            ax.add_artist(drawn)
            if clip is not None:
                drawn.set_clip_path(clip)


def _fill(
    ax: Axes, surface: Surface, triangles: IntArray, colour: str, zorder: float, clip: TransformedPath | None
) -> None:
    mapped, kept = triangulation(surface, triangles)
    # Of matplotlib's ways to fill many triangles, this one leaves no hairlines between them.
    filled = ax.tripcolor(
        mapped,
        np.zeros(kept.size),
        shading="gouraud",
        cmap=ListedColormap([colour]),
        rasterized=True,
        zorder=zorder,
    )
    if clip is not None:
        filled.set_clip_path(clip)


# ---- graticules ----------------------------------------------------------------------------------


SIZE = 6.5  # points
_WIDTH, _HEIGHT = 0.62, 1.3  # of a letter and of a line, in the size
_AIR = 2.5  # points between a label and the frame
_BEYOND = 9.0  # points to the right of the frame, where a figure may end
_FLAT = 0.35  # of a line's direction towards an edge: one that runs along it is not labelled there

_EDGES = ("bottom", "left", "top", "right")
_PREFERRED = {True: ("bottom", "top", "left", "right"), False: ("left", "right", "bottom", "top")}


class GraticuleLine(NamedTuple):
    """A meridian or parallel of `value` degrees, and its projected lines (x, y)."""

    is_meridian: bool
    value: float
    pieces: Sequence[FloatArray]

    @property
    def text(self) -> str:
        """The label."""
        return (longitude_text if self.is_meridian else latitude_text)(self.value, minutes=True)


@dataclass(frozen=True)
class _Label:
    """A text centred at x, y in points from the frame's lower left, with half its width and height."""

    text: str
    edge: str
    x: float
    y: float
    half: tuple[float, float]

    def fits(self, width: float) -> bool:
        """True if the label stays left of the frame's right edge; one below the frame may exceed it slightly."""
        beyond = _BEYOND if self.edge == "bottom" else 0.0
        return self.x + self.half[0] < width + beyond

    def overlaps(self, other: _Label) -> bool:
        """True if two labels touch."""
        apart = abs(self.x - other.x), abs(self.y - other.y)
        return apart[0] < self.half[0] + other.half[0] and apart[1] < self.half[1] + other.half[1]


def label_graticule(ax: Axes, lines: Sequence[GraticuleLine]) -> None:
    """Label lines where they cross the frame, below or left of it, or else inside."""
    ax.apply_aspect()
    box = ax.get_window_extent()
    points, size = 72.0 / ax.figure.dpi, SIZE * scale_of(ax)
    width, height = box.width * points, box.height * points
    placed: list[_Label] = []
    for line in lines:
        pieces = [(ax.transData.transform(piece) - [box.x0, box.y0]) * points for piece in line.pieces]
        candidates = [
            _label(line.text, edge, place, size)
            for edge in _PREFERRED[line.is_meridian]
            for place in _crossings(pieces, edge, width, height)
        ]
        if not line.is_meridian and not candidates:
            candidates = _inside(line.text, pieces, width, height, size)
        clear = (
            label for label in candidates if label.fits(width) and not any(label.overlaps(other) for other in placed)
        )
        chosen = next(clear, None)
        if chosen is not None:
            placed.append(chosen)
    for label in placed:
        _draw_label(ax, label, width, height)


def _crossings(pieces: Sequence[FloatArray], edge: str, width: float, height: float) -> list[tuple[float, float]]:
    """Crossings of lines with an edge of the frame, except shallow ones."""
    across, level, end = {
        "bottom": (1, 0.0, width),
        "top": (1, height, width),
        "left": (0, 0.0, height),
        "right": (0, width, height),
    }[edge]
    found = []
    for piece in pieces:
        off = piece[:, across] - level
        for k in np.flatnonzero(np.diff(np.sign(off)) != 0):
            start, step = piece[k], piece[k + 1] - piece[k]
            along = float((start + step * (-off[k] / step[across]))[1 - across]) if step[across] else np.nan
            if 0.0 <= along <= end and abs(step[across]) > _FLAT * np.hypot(*step):
                found.append((along, level) if across else (level, along))
    return found


def _label(text: str, edge: str, place: tuple[float, float], size: float) -> _Label:
    half = 0.5 * len(text) * _WIDTH * size + _AIR, 0.5 * _HEIGHT * size
    x, y = place
    # Below and left, labels are outside of the frame; above and right, inside.
    if edge in ("left", "right"):
        x -= half[0]
    else:
        y -= _AIR + half[1]
    return _Label(text, edge, x, y, half)


def _inside(text: str, pieces: Sequence[FloatArray], width: float, height: float, size: float) -> list[_Label]:
    """Label at the lowest point of a line that crosses no edge of the frame."""
    xy = np.concatenate([np.empty((0, 2)), *pieces])
    xy = xy[((xy > 0.0) & (xy < [width, height])).all(axis=1)]
    if not len(xy):
        return []
    x, y = xy[np.argmin(xy[:, 1])]
    return [_Label(text, "inside", float(x), float(y), (0.5 * len(text) * _WIDTH * size, 0.5 * _HEIGHT * size))]


def _draw_label(ax: Axes, label: _Label, width: float, height: float) -> None:
    outside = label.edge in ("bottom", "left")
    colours = look_of(ax).colours
    text = ax.text(
        label.x / width,
        label.y / height,
        label.text,
        transform=ax.transAxes,
        ha="center",
        va="center",
        fontsize=SIZE * scale_of(ax),
        color=colours.text if outside else colours.quiet,
        zorder=4.0,
        label="graticule label",
    )
    if not outside:
        text.set_path_effects([withStroke(linewidth=1.5, foreground=f"{colours.background}b0")])


# ---- basemap -------------------------------------------------------------------------------------


_TITLE, _BELOW = 10.5, 8.0  # points
_PADS, _TIGHT_PADS = (6, 16), (4, 14)  # points between map and title, without a line between and with one
_BELOW_LABEL = "below the title"


def map_size(surface: Surface) -> float:
    """Larger of the map's width and height in metres."""
    west, east, south, north = surface.extent
    return max(east - west, north - south)


def set_view(ax: Axes, surface: Surface) -> None:
    """Set the view with equal scales in x and y; the frame is drawn if the map continues beyond it."""
    west, east, south, north = surface.view
    ax.set_xlim(west, east)
    ax.set_ylim(south, north)
    ax.set_aspect("equal")
    ax.set_axis_off()
    if surface.goes_on:
        frame = Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, fill=False, clip_on=False, label="frame")
        frame.set(edgecolor=look_of(ax).colours.outline, linewidth=0.8, zorder=5.0)
        ax.add_patch(frame)


def draw_lines(
    ax: Axes, surface: Surface, step: float | None, *, over_colours: bool = False, context: str = CONTEXTS[-1]
) -> None:
    """Draw graticule, coast, borders and outline; with a pale halo over a coloured field."""
    drawn = surface if surface.ground is None else surface.ground
    meridians_and_parallels = graticule_lines(surface, step)
    grid = [piece for line in meridians_and_parallels for piece in line.pieces]
    colours = look_of(ax).colours
    halo = [withStroke(linewidth=1.3, foreground="#ffffff99")] if over_colours else []
    shore = colours.over_coast if over_colours else colours.coast
    _draw(ax, grid, "graticule", colours.over_graticule if over_colours else colours.graticule, 0.4, 1.0)
    if context != "none" and not surface.domain.projection.is_of_another_body:
        lines = {"coastline": coast}
        if shows_borders(surface, context):
            lines |= {"lake shores": lake_shores, "borders": country_borders}
        for label, of in lines.items():
            _draw(ax, _earthly(surface, of), label, shore, 0.5, 1.2, halo)
    _draw(ax, _joined(drawn.outline), "outline", colours.outline, 0.8, 3.0).set_capstyle("round")
    if surface.border:
        _draw(ax, surface.border, "border", colours.over_coast if over_colours else colours.outline, 0.9, 1.3, halo)
    if surface.is_local:
        label_graticule(ax, meridians_and_parallels)


def graticule_lines(surface: Surface, step: float | None) -> list[GraticuleLine]:
    """Meridians and parallels of a picture."""
    drawn = surface if surface.ground is None else surface.ground
    bounds = drawn.domain.box.bounds
    steps = graticule_steps(surface.domain.region.bounds if surface.is_local else bounds, step)
    meridians, parallels = graticule_values(bounds, *steps)
    lines = graticule(bounds, *steps)
    values = [*((True, value) for value in meridians), *((False, value) for value in parallels)]
    size = map_size(surface)
    return [
        GraticuleLine(is_meridian, value, project_lines(drawn.domain, [line], size))
        for (is_meridian, value), line in zip(values, lines, strict=True)
    ]


def _earthly(surface: Surface, lines: Callable[[Bounds, str, float], list[FloatArray]]) -> list[FloatArray]:
    """Projected coasts, shores or borders."""
    drawn = surface if surface.ground is None else surface.ground
    bounds = drawn.domain.box.bounds
    spacing = min(1.0, max(ground_size(bounds)) / 60.0)
    return project_lines(drawn.domain, lines(bounds, coast_resolution(surface), spacing), map_size(surface))


def _draw(
    ax: Axes,
    lines: Sequence[FloatArray],
    label: str,
    colour: str,
    width: float,
    zorder: float,
    halo: Sequence[AbstractPathEffect] = (),
) -> LineCollection:
    drawn = LineCollection(
        lines, colors=colour, linewidths=width, zorder=zorder, label=label, path_effects=list(halo) or None
    )
    ax.add_collection(drawn, autolim=False)
    return drawn


def _joined(segments: FloatArray) -> list[FloatArray]:
    """Segments (m, 2, 2) joined to lines: drawn one by one, they leave dots at the joints."""
    if not len(segments):
        return []
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(segments))))
    return [shapely.get_coordinates(line) for line in lines]


def airy_kavrayskiy_line(figure: float | None) -> str:
    """Subtitle of an Airy-Kavrayskiy error, empty if unknown."""
    return "" if figure is None else f"Airy–Kavrayskiy {check_number('Airy-Kavrayskiy figure', figure):.4g}"


def draw_title(ax: Axes, title: str, below: str) -> None:
    """Draw a title and a subtitle."""
    look, scale, is_tight = look_of(ax), scale_of(ax), is_tight_of(ax)
    if not look.has_titles:
        return
    if below and is_one_line(ax):
        title, below = f"{title} · {with_minus(below)}", ""
    pad = (_TIGHT_PADS if is_tight else _PADS)[bool(below)]
    ax.set_title(check_text("title", title), fontsize=scale * _TITLE, pad=scale * pad, y=1.0, color=look.colours.text)
    if below:
        ax.annotate(
            with_minus(below),
            (0.5, 1.0),
            xytext=(0, scale * (3 if is_tight else 4)),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=scale * _BELOW,
            color=look.colours.quiet,
            label=_BELOW_LABEL,
        )


def title_width(title: str, below: str) -> float:
    """Width in inches of what `draw_title` writes."""
    return max(text_width(text, size) for text, size in ((check_text("title", title), _TITLE), (below, _BELOW))) / 72.0


def fit_titles(axes: Sequence[Axes], room: float) -> None:
    """Shrink titles and subtitles until the widest of each fits `room` in inches."""
    scale = scale_of(axes[0])
    titles = [ax.title for ax in axes]
    below = [text for ax in axes for text in ax.texts if text.get_label() == _BELOW_LABEL]
    # A subtitle is never larger than its title.
    _shrink(below, min(_shrink(titles, scale * _TITLE, room), scale * _BELOW), room)


def _shrink(texts: Sequence[Text], points: float, room: float) -> float:
    """Give texts the largest common size, at most `points`, with which all fit; returns it."""
    widest = max((text_width(text.get_text(), points) for text in texts), default=0.0) / 72.0
    size = points * min(1.0, room / widest) if widest else points
    for text in texts:
        text.set_fontsize(size)
    return size
