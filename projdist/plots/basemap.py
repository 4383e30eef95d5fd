"""Base maps: sea, land and lakes, lines and their labels, and the region as a clip path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.transforms import TransformedPath
from matplotlib.tri import Triangulation

from projdist import surfaces
from projdist._typing import FloatArray, IntArray
from projdist.earth import latitude_text, longitude_text
from projdist.plots.style import add_lines, style_of
from projdist.surfaces import Surface

CONTEXTS = ("none", "coast", "borders", "full")
"""What a picture shows of the Earth: nothing; land and sea; also borders and lakes; also cities and a locator."""


def check_context(context: str) -> str:
    """Check that a context is one of `CONTEXTS`; raises ValueError."""
    if context not in CONTEXTS:
        raise ValueError(f"Invalid context {context!r}. It must be one of {', '.join(CONTEXTS)}.")
    return context


def draw_basemap(
    ax: Axes, surface: Surface, context: str = CONTEXTS[-1], step: float | None = None, *, over_colours: bool = False
) -> None:
    """Set the view and draw sea and land, paler outside of the region; graticule, coast, borders and outline.

    The region of a field of colours, `over_colours`, has no land; the lines have a pale halo there.
    """
    colours = style_of(ax).colours
    lakes = context in ("borders", "full") and surface.is_local  # and borders, as on maps of parts of the world
    _set_view(ax, surface)
    if surface.ground is not None and context != "none":
        _draw_land(ax, surface, surface.ground, colours.neighbours, 0.2, lakes=lakes)
    if not over_colours:
        _draw_land(ax, surface, surface, colours.land, 0.5, lakes=lakes, has_sea=context != "none")
    halo = [withStroke(linewidth=1.3, foreground="#ffffff99")] if over_colours else None
    shore = {"colors": colours.over_coast if over_colours else colours.coast, "linewidths": 0.5, "path_effects": halo}
    lines = graticule_lines(surface, step)
    add_lines(
        ax,
        [piece for line in lines for piece in line.pieces],
        colors=colours.over_graticule if over_colours else colours.graticule,
        linewidths=0.4,
        zorder=1.0,
        label="graticule",
    )
    if context != "none" and not surface.domain.projection.is_of_another_body:
        shores: dict[str, Callable[..., list[FloatArray]]] = {"coastline": surfaces.coast}
        if lakes:
            shores |= {"lake shores": surfaces.lake_shores, "borders": surfaces.country_borders}
        ground = (surface.ground or surface).domain
        for label, within in shores.items():
            found = within(ground.box.bounds, surfaces.coast_resolution(surface))
            add_lines(ax, surfaces.project_lines(ground, found, map_size(surface)), label=label, zorder=1.2, **shore)
    outline = _joined((surface.ground or surface).outline)
    rim = add_lines(ax, outline, colors=colours.outline, linewidths=0.8, zorder=3.0, label="outline")
    rim.set_capstyle("round")
    if surface.border:
        edge = colours.over_coast if over_colours else colours.outline
        add_lines(ax, surface.border, label="border", colors=edge, linewidths=0.9, zorder=1.3, path_effects=halo)
    if surface.is_local:
        label_graticule(ax, lines)


def draw_globe(ax: Axes, surface: Surface) -> None:
    """Draw a small map: sea, land and outline."""
    _draw_land(ax, surface, surface, style_of(ax).colours.locator, 0.5)
    west, east, south, north = surface.view
    ax.set(xlim=(west, east), ylim=(south, north), aspect="equal")
    ax.set_axis_off()
    add_lines(ax, surface.outline, colors="#555555", linewidths=0.6, zorder=1.0)


def map_size(surface: Surface) -> float:
    """Larger of the map's width and height in metres."""
    west, east, south, north = surface.extent
    return max(east - west, north - south)


def _set_view(ax: Axes, surface: Surface) -> None:
    """Set the view with equal scales in x and y; the frame is drawn if the map continues beyond it."""
    west, east, south, north = surface.view
    ax.set_xlim(west, east)
    ax.set_ylim(south, north)
    ax.set_aspect("equal")
    ax.set_axis_off()
    if surface.goes_on:
        frame = Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, fill=False, clip_on=False, label="frame")
        frame.set(edgecolor=style_of(ax).colours.outline, linewidth=0.8, zorder=5.0)
        ax.add_patch(frame)


def triangulation(surface: Surface, triangles: IntArray) -> tuple[Triangulation, IntArray]:
    """Triangulation of a surface for matplotlib, and the vertices in use."""
    used = np.zeros(surface.x.size, dtype=bool)
    used[triangles] = True
    kept = np.flatnonzero(used)
    return Triangulation(surface.x[kept], surface.y[kept], (np.cumsum(used) - 1)[triangles]), kept


def region_clip(ax: Axes, surface: Surface) -> TransformedPath | None:
    """Clip path of the region; None if its triangles are exactly the region."""
    if not surface.pieces:
        return None
    return TransformedPath(closed_path(surface.pieces), ax.transData)


def closed_path(pieces: Sequence[FloatArray]) -> Path:
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
    ax: Axes,
    pictured: Surface,
    surface: Surface,
    colour: str,
    zorder: float,
    *,
    lakes: bool = False,
    has_sea: bool = True,
) -> None:
    """Draw land and sea of a surface as pale areas, as fine as what is pictured needs; other bodies are all land."""
    clip = region_clip(ax, surface)
    has_sea = has_sea and not surface.domain.projection.is_of_another_body
    sea = style_of(ax).colours.sea

    def fill(triangles: IntArray, face: str, above: float) -> None:
        mapped, kept = triangulation(surface, triangles)
        # Of matplotlib's ways to fill many triangles, this one leaves no hairlines between them.
        draw_triangles(ax, mapped, np.zeros(kept.size), clip, cmap=ListedColormap([face]), zorder=above)

    fill(surface.covering(), sea if has_sea else colour, zorder)
    if not has_sea:
        return
    resolution = surfaces.coast_resolution(pictured)
    areas = [(surfaces.land_polygons(surface, resolution), colour)]
    if lakes:
        areas.append((surfaces.lake_polygons(surface, resolution), sea))
    for layer, ((cells, pieces), face) in enumerate(areas, 1):
        above = zorder + 0.1 * layer
        if len(cells):
            fill(cells, face, above)
        if pieces:
            # A thin edge of the same colour closes the joints between the pieces.
            drawn = PathPatch(closed_path(pieces), color=face, linewidth=0.3, rasterized=True, zorder=above)
            ax.add_artist(drawn)
            if clip is not None:
                drawn.set_clip_path(clip)


def draw_triangles(
    ax: Axes, mesh: Triangulation, values: FloatArray, clip: TransformedPath | None = None, **style: Any
) -> None:
    """Draw values at the vertices of triangles as colours between them."""
    filled = ax.tripcolor(mesh, values, shading="gouraud", rasterized=True, **style)
    if clip is not None:
        filled.set_clip_path(clip)


# ---- graticules ----------------------------------------------------------------------------------

_SIZE = 6.5  # points
_WIDTH, _HEIGHT = 0.62, 1.3  # of a letter and of a line, in the size
_AIR = 2.5  # points between a label and the frame
_BEYOND = 9.0  # points to the right of the frame, where a figure may end
_FLAT = 0.35  # of a line's direction towards an edge: one that runs along it is not labelled there
# By whether a line is a meridian.
_EDGES = {
    True: ("bottom", "top", "left", "right"),
    False: ("left", "right", "bottom", "top"),
}


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
    """A text at an edge of the frame or "inside", centred at x, y in points from the frame's lower left.

    `half` is half its width and height.
    """

    text: str
    edge: str
    x: float
    y: float
    half: tuple[float, float]

    @classmethod
    def at(cls, text: str, edge: str, place: Sequence[float], size: float) -> _Label:
        """The label of a place on an edge: below and left of the frame outside, above and right inside."""
        x, y = place
        width, height = 0.5 * len(text) * _WIDTH * size, 0.5 * _HEIGHT * size
        if edge == "inside":
            return cls(text, edge, x, y, (width, height))
        width += _AIR
        if edge in ("left", "right"):
            return cls(text, edge, x - width, y, (width, height))
        return cls(text, edge, x, y - (_AIR + height), (width, height))

    def overlaps(self, other: _Label) -> bool:
        """True if two labels touch."""
        apart = abs(self.x - other.x), abs(self.y - other.y)
        return apart[0] < self.half[0] + other.half[0] and apart[1] < self.half[1] + other.half[1]


def label_graticule(ax: Axes, lines: Sequence[GraticuleLine]) -> None:
    """Label lines where they cross the frame, below or left of it, or else parallels inside at their lowest point."""
    ax.apply_aspect()
    box = ax.get_window_extent()
    points, style = 72.0 / ax.figure.dpi, style_of(ax)
    size, colours = _SIZE * style.scale, style.colours
    width, height = box.width * points, box.height * points
    placed: list[_Label] = []
    for line in lines:
        pieces = [(ax.transData.transform(piece) - [box.x0, box.y0]) * points for piece in line.pieces]
        candidates = [
            _Label.at(line.text, edge, place, size)
            for edge in _EDGES[line.is_meridian]
            for place in crossings(pieces, edge, width, height)
        ]
        if not line.is_meridian and not candidates:
            xy = np.concatenate([np.empty((0, 2)), *pieces])
            xy = xy[((xy > 0.0) & (xy < [width, height])).all(axis=1)]
            candidates = [_Label.at(line.text, "inside", xy[np.argmin(xy[:, 1])].tolist(), size)] if len(xy) else []
        for label in candidates:
            right = width + (_BEYOND if label.edge == "bottom" else 0.0)
            if label.x + label.half[0] < right and not any(label.overlaps(other) for other in placed):
                placed.append(label)
                break
    for label in placed:
        outside = label.edge in ("bottom", "left")
        text = ax.text(
            label.x / width,
            label.y / height,
            label.text,
            transform=ax.transAxes,
            ha="center",
            va="center",
            fontsize=size,
            color=colours.text if outside else colours.quiet,
            zorder=4.0,
            label="graticule label",
        )
        if not outside:
            text.set_path_effects([withStroke(linewidth=1.5, foreground=f"{colours.background}b0")])


def crossings(pieces: Sequence[FloatArray], edge: str, width: float, height: float) -> list[tuple[float, float]]:
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


def graticule_lines(surface: Surface, step: float | None) -> list[GraticuleLine]:
    """Meridians and parallels of a picture."""
    domain = (surface.ground or surface).domain
    bounds, size = domain.box.bounds, map_size(surface)
    steps = surfaces.graticule_steps(surface.domain.region.bounds if surface.is_local else bounds, step)
    meridians, parallels = surfaces.graticule_values(bounds, *steps)
    values = [*((True, value) for value in meridians), *((False, value) for value in parallels)]
    return [
        GraticuleLine(is_meridian, value, surfaces.project_lines(domain, [line], size))
        for (is_meridian, value), line in zip(values, surfaces.graticule(bounds, *steps), strict=True)
    ]


def _joined(segments: FloatArray) -> list[FloatArray]:
    """Segments (m, 2, 2) joined to lines: drawn one by one, they leave dots at the joints."""
    if not len(segments):
        return []
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(segments))))
    return [shapely.get_coordinates(line) for line in lines]
