"""Base maps: sea, land, lakes and labelled lines; of regions also cities, a scale bar and a locator globe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib import colors, patches, patheffects, transforms, tri
from matplotlib.axes import Axes
from matplotlib.path import Path

from projdist import earth, field, matrices, projections, regions, surfaces
from projdist._typing import FloatArray, IntArray
from projdist.plots.styled_figure import add_lines, set_view, style_of
from projdist.surfaces import Surface

CONTEXTS = ("none", "coast", "borders", "full")
"""What a picture shows of the Earth: nothing; land and sea; also borders and lakes; also cities and a locator."""


def draw_basemap(
    ax: Axes, surface: Surface, context: str = CONTEXTS[-1], step: float | None = None, *, over_colours: bool = False
) -> None:
    """Set the view and draw sea and land, paler outside of the region; graticule, coast, borders, outline, frame."""
    # The region of a field of colours, `over_colours`, has no land; the lines have a pale halo there.
    colours = style_of(ax).colours
    lakes = context in ("borders", "full") and surface.is_local  # and borders, as on maps of parts of the world
    set_view(ax, *surface.view)
    if surface.goes_on:
        frame = patches.Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, fill=False, clip_on=False)
        frame.set(edgecolor=colours.outline, linewidth=0.8, zorder=5.0, label="frame")
        ax.add_patch(frame)
    if surface.ground is not None and context != "none":
        _draw_land(ax, surface, surface.ground, colours.neighbours, 0.2, lakes=lakes)
    if not over_colours:
        _draw_land(ax, surface, surface, colours.land, 0.5, lakes=lakes, has_sea=context != "none")
    halo = [patheffects.withStroke(linewidth=1.3, foreground="#ffffff99")] if over_colours else None
    shore, grid, border = colours.coast, colours.graticule, colours.outline
    if over_colours:
        shore, grid, border = colours.over_coast, colours.over_graticule, colours.over_coast
    lines = graticule_lines(surface, step)
    pieces = [piece for line in lines for piece in line.pieces]
    add_lines(ax, pieces, colors=grid, linewidths=0.4, zorder=1.0, label="graticule")
    if context != "none" and not surface.domain.projection.is_of_another_body:
        shores: dict[str, Callable[..., list[FloatArray]]] = {"coastline": surfaces.coast}
        if lakes:
            shores |= {"lake shores": surfaces.lake_shores, "borders": surfaces.country_borders}
        ground = (surface.ground or surface).domain
        for label, within in shores.items():
            found = within(ground.box.bounds, surfaces.coast_resolution(surface))
            seen = surfaces.project_lines(ground, found, map_size(surface))
            add_lines(ax, seen, label=label, colors=shore, linewidths=0.5, path_effects=halo, zorder=1.2)
    outline = _joined((surface.ground or surface).outline)
    rim = add_lines(ax, outline, colors=colours.outline, linewidths=0.8, zorder=3.0, label="outline")
    rim.set_capstyle("round")
    if surface.border:
        add_lines(ax, surface.border, label="border", colors=border, linewidths=0.9, zorder=1.3, path_effects=halo)
    if surface.is_local:
        label_graticule(ax, lines)


def map_size(surface: Surface) -> float:
    """Larger of the map's width and height in metres."""
    west, east, south, north = surface.extent
    return max(east - west, north - south)


def triangulation(surface: Surface, triangles: IntArray) -> tuple[tri.Triangulation, IntArray]:
    """Triangulation of a surface for matplotlib, and the vertices in use."""
    used = np.zeros(surface.x.size, dtype=bool)
    used[triangles] = True
    kept = np.flatnonzero(used)
    return tri.Triangulation(surface.x[kept], surface.y[kept], (np.cumsum(used) - 1)[triangles]), kept


def region_clip(ax: Axes, surface: Surface) -> Any:
    """Clip path of the region: the axes if its triangles are exactly the region."""
    return transforms.TransformedPath(closed_path(surface.pieces), ax.transData) if surface.pieces else ax.patch


def closed_path(pieces: Sequence[FloatArray]) -> Path:
    """Closed polygons of (x, y) as one path."""
    return Path.make_compound_path(*(Path(np.vstack([piece, piece[:1]]), closed=True) for piece in pieces))


def _draw_land(
    ax: Axes, whole: Surface, surface: Surface, colour: str, zorder: float, *, lakes: bool = False, has_sea: bool = True
) -> None:
    """Draw land and sea of a surface as pale areas, as fine as the whole picture needs; other bodies are all land."""
    clip = region_clip(ax, surface)
    has_sea = has_sea and not surface.domain.projection.is_of_another_body
    sea = style_of(ax).colours.sea

    def fill(triangles: IntArray, face: str, above: float) -> None:
        mapped, kept = triangulation(surface, triangles)
        # Of matplotlib's ways to fill many triangles, this one leaves no hairlines between them.
        shades: dict[str, Any] = {"cmap": colors.ListedColormap([face]), "zorder": above, "clip_path": clip}
        draw_triangles(ax, mapped, np.zeros(kept.size), **shades)

    fill(surface.covering(), sea if has_sea else colour, zorder)
    if not has_sea:
        return
    resolution = surfaces.coast_resolution(whole)
    areas = [(surfaces.land_polygons(surface, resolution), colour)]
    if lakes:
        areas.append((surfaces.lake_polygons(surface, resolution), sea))
    for layer, ((cells, pieces), face) in enumerate(areas, 1):
        above = zorder + 0.1 * layer
        if len(cells):
            fill(cells, face, above)
        if pieces:
            # A thin edge of the same colour closes the joints between the pieces.
            drawn = patches.PathPatch(closed_path(pieces), color=face, linewidth=0.3, rasterized=True, zorder=above)
            ax.add_artist(drawn)
            drawn.set_clip_path(clip)


def draw_triangles(ax: Axes, mesh: tri.Triangulation, values: FloatArray, **style: Any) -> None:
    """Draw values at the vertices of triangles as colours between them."""
    ax.tripcolor(mesh, values, shading="gouraud", rasterized=True, **style)


# ---- graticules ----------------------------------------------------------------------------------

_SIZE = 6.5  # points
_WIDTH, _HEIGHT = 0.62, 1.3  # of a letter and of a line, in the size
_AIR = 2.5  # points between a label and the frame
_BEYOND = 9.0  # points to the right of the frame, where a figure may end
_FLAT = 0.35  # of a line's direction towards an edge: one that runs along it is not labelled there
# By whether a line is a meridian.
_EDGES = {True: ("bottom", "top", "left", "right"), False: ("left", "right", "bottom", "top")}


class GraticuleLine(NamedTuple):
    """A meridian or parallel, its label, and its projected lines (x, y)."""

    is_meridian: bool
    text: str
    pieces: Sequence[FloatArray]


_Box = tuple[float, float, float, float]  # left, bottom, right and top of a text, in points from the lower left


def _meet(one: _Box, other: _Box) -> bool:
    """True if two boxes have a part in common."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _label_box(text: str, edge: str, place: Sequence[float], size: float) -> _Box:
    """Box of a label at a place on an edge of the frame, outside of it below and left; or on a place "inside"."""
    x, y = place
    width, height = 0.5 * len(text) * _WIDTH * size, 0.5 * _HEIGHT * size
    if edge != "inside":
        width += _AIR
        x, y = (x - width, y) if edge in ("left", "right") else (x, y - (_AIR + height))
    return x - width, y - height, x + width, y + height


def label_graticule(ax: Axes, lines: Sequence[GraticuleLine]) -> None:
    """Label lines where they cross the frame, below or left of it, or else parallels inside at their lowest point."""
    ax.apply_aspect()
    frame, points, style = ax.get_window_extent(), 72.0 / ax.figure.dpi, style_of(ax)
    width, height = frame.width * points, frame.height * points
    size, colours = _SIZE * style.scale, style.colours
    placed: list[_Box] = []
    for line in lines:
        pieces = [(ax.transData.transform(piece) - frame.p0) * points for piece in line.pieces]
        edges = _EDGES[line.is_meridian]
        candidates = [(edge, place) for edge in edges for place in crossings(pieces, edge, width, height)]
        if not line.is_meridian and not candidates:
            xy = np.concatenate([np.empty((0, 2)), *pieces])
            xy = xy[((xy > 0.0) & (xy < [width, height])).all(axis=1)]
            candidates = [("inside", xy[np.argmin(xy[:, 1])].tolist())] if len(xy) else []
        for edge, place in candidates:
            box = _label_box(line.text, edge, place, size)
            right = width + (_BEYOND if edge == "bottom" else 0.0)
            if box[2] >= right or any(_meet(box, other) for other in placed):
                continue
            placed.append(box)
            outside, x, y = edge in ("bottom", "left"), 0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])
            middle: dict[str, Any] = {"transform": ax.transAxes, "ha": "center", "va": "center", "zorder": 4.0}
            middle |= style.letters(_SIZE, quiet=not outside)
            text = ax.text(x / width, y / height, line.text, label="graticule label", **middle)
            if not outside:
                text.set_path_effects([patheffects.withStroke(linewidth=1.5, foreground=f"{colours.background}b0")])
            break


def crossings(pieces: Sequence[FloatArray], edge: str, width: float, height: float) -> list[tuple[float, float]]:
    """Crossings of lines with an edge of the frame, except shallow ones."""
    across, end = (1, width) if edge in ("bottom", "top") else (0, height)
    level = {"bottom": 0.0, "top": height, "left": 0.0, "right": width}[edge]
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
    labels = [(True, earth.longitude_text(value, minutes=True)) for value in meridians]
    labels += [(False, earth.latitude_text(value, minutes=True)) for value in parallels]
    return [
        GraticuleLine(is_meridian, text, surfaces.project_lines(domain, [line], size))
        for (is_meridian, text), line in zip(labels, surfaces.graticule(bounds, *steps), strict=True)
    ]


def _joined(segments: FloatArray) -> list[FloatArray]:
    """Segments (m, 2, 2) joined to lines: drawn one by one, they leave dots at the joints."""
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(segments))))
    return [shapely.get_coordinates(line) for line in lines]


# ---- places --------------------------------------------------------------------------------------

_TEXT = 6.5  # points
_LETTER, _LINE = 0.6, 1.25  # of a letter and a line, in the size

_NEARLY_ONE = 0.03
_SAMPLE = 200  # nodes at which scales are looked at
_BAR = 0.22  # of a picture's width, at most

_PLACED_AT_ONCE = 8.0  # degrees: a smaller region has a globe that tells where it is
_LEAST_FOR_LOCATOR = 170.0  # points; in a smaller picture it would be in the way
_LOCATOR = 0.17  # of the smaller side

_CITIES_PER_INCH = 1.1  # of the sum of a picture's sides
_ABOUT = [(0.0, 0.0), *((0.1 * east, 0.1 * north) for east in (-1, 1) for north in (-1, 1))]  # coarse coasts miss some
_ITS_OWN = 0.05  # of the region's towns, at least, are in each of its countries
_MAIN = 3  # cities that labels of isolines give way to
_ALONG = 8  # points along a name
_APART = 0.12  # of the smaller side: cities are no closer


@dataclass
class _Texts:
    """Boxes in points that are occupied, the size of the frame, and the relative font size."""

    ax: Axes
    width: float
    height: float
    boxes: list[_Box]
    letters: float

    @classmethod
    def of(cls, ax: Axes) -> _Texts:
        """The frame of axes, in which the boxes of existing labels are occupied."""
        ax.apply_aspect()
        frame, points = ax.get_window_extent(), 72.0 / ax.figure.dpi
        extents = [text.get_window_extent().get_points() for text in ax.texts if text.get_text()]
        boxes = [tuple(((extent - frame.p0) * points).ravel().tolist()) for extent in extents]
        return cls(ax, frame.width * points, frame.height * points, boxes, style_of(ax).scale)

    @property
    def size(self) -> float:
        """Font size in points."""
        return self.letters * _TEXT

    def take(self, x: float, y: float, width: float, height: float) -> bool:
        """Occupy a box with its lower left corner at x, y, if it is free and within the frame."""
        is_free = self.is_free(x, y, width, height)
        if is_free:
            self.boxes.append((x, y, x + width, y + height))
        return is_free

    def is_free(self, x: float, y: float, width: float, height: float) -> bool:
        """True if a box is free and within the frame."""
        box = x, y, x + width, y + height
        is_within = x >= 2.0 and y >= 2.0 and box[2] <= self.width - 2.0 and box[3] <= self.height - 2.0
        return is_within and not any(_meet(box, other) for other in self.boxes)

    def write(self, text: str, x: float, y: float, ha: str, label: str) -> None:
        """Write a text with a halo."""
        style = style_of(self.ax)
        halo = [patheffects.withStroke(linewidth=1.6, foreground=f"{style.colours.background}d0")]
        place: dict[str, Any] = {"transform": self.ax.transAxes, "ha": ha, "va": "center", "zorder": 6.0}
        words = style.letters(_TEXT) | {"path_effects": halo, "label": label}
        self.ax.text(x / self.width, y / self.height, text, **place, **words)


def _has_places(surface: Surface) -> bool:
    """True for pictures of parts of the Earth."""
    return surface.is_local and not surface.domain.projection.is_of_another_body


def draw_places(ax: Axes, surface: Surface, context: str) -> None:
    """Draw a locator globe of a small region, a scale bar if the scale is nearly one, and cities."""
    if context != "full" or not _has_places(surface):
        return
    texts = _Texts.of(ax)
    is_small = max(surfaces.ground_size(surface.domain.region.bounds)) < _PLACED_AT_ONCE
    if is_small and min(texts.width, texts.height) > _LEAST_FOR_LOCATOR:
        _draw_locator(ax, surface, texts)
    if _is_true_to_scale(surface):
        _draw_scale_bar(ax, surface, texts)
    _draw_cities(ax, surface, texts)


def _corners(surface: Surface, width: float, height: float) -> dict[tuple[float, float], float]:
    """Lower left corners of boxes in the corners of the frame, and how much of them the region covers, least first."""
    # All are fractions of the frame, or of its area.
    west, east, south, north = surface.view
    corner, size = np.array([west, south]), np.array([east - west, north - south])
    if surface.pieces:
        parts = np.array([shapely.Polygon((piece - corner) / size) for piece in surface.pieces])
    else:
        parts = shapely.polygons((np.column_stack([surface.x, surface.y])[surface.triangles] - corner) / size)
    parts = parts[shapely.is_valid(parts)]
    places = [(0.0, 0.0), (1.0 - width, 0.0), (0.0, 1.0 - height), (1.0 - width, 1.0 - height)]
    boxes = [shapely.box(x, y, x + width, y + height) for x, y in places]
    covered = [float(shapely.area(shapely.intersection(parts, box)).sum()) for box in boxes]
    return {places[k]: covered[k] for k in np.argsort(covered, kind="stable")}


def _draw_locator(ax: Axes, surface: Surface, texts: _Texts) -> None:
    side = _LOCATOR * min(texts.width, texts.height)
    air = 0.25 * side
    shares = (side + air) / texts.width, (side + air) / texts.height
    for (x, y), covered in _corners(surface, *shares).items():
        if not covered and texts.take(x * texts.width + 0.5 * air, y * texts.height + 0.5 * air, side, side):
            break
    else:
        return
    left, bottom, right, top = texts.boxes[-1]
    place = left / texts.width, bottom / texts.height, (right - left) / texts.width, (top - bottom) / texts.height
    globe = ax.inset_axes(place, zorder=6.0)
    west, south, east, north = surface.domain.region.bounds
    lon, lat = float(earth.wrapped(np.array(0.5 * (west + east)))), 0.5 * (south + north)
    centre = f"+lon_0={lon:.6f} +lat_0={0.8 * lat:.6f}"
    tilted = projections.Projection.from_user_input(f"+proj=ortho {centre} +R=6371008.7714")
    seen = surfaces.surface_of(tilted, regions.GLOBE, 4.0)
    _draw_land(globe, seen, seen, style_of(globe).colours.locator, 0.5)
    set_view(globe, *seen.view)
    add_lines(globe, seen.outline, colors="#555555", linewidths=0.6, zorder=1.0)
    spot = [float(one) for one in tilted(lon, lat)]
    globe.plot(*spot, "o", color="#d7301f", markersize=4.0, markeredgecolor="white", markeredgewidth=0.8)
    globe.set_label("locator")


# ---- a scale bar ----------------------------------------------------------------------------


def _is_true_to_scale(surface: Surface) -> bool:
    """True if nearly all scales in the region are nearly one."""
    nodes = np.flatnonzero(surface.weights > 0)
    nodes = nodes[:: max(nodes.size // _SAMPLE, 1)]
    lon, lat = surface.lonlat()
    J = field.jacobian(surface.domain.projection, earth.wrapped(lon[nodes]), lat[nodes])
    scales = matrices.principal_scales(J)
    off = np.abs(scales[np.isfinite(scales).all(axis=1)] - 1.0)
    return bool(off.size and np.quantile(off, 0.95) < _NEARLY_ONE)


def round_down(length: float) -> float:
    """Largest of 1, 2, 5 times a power of ten that does not exceed a length."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(m for m in (1.0, 2.0, 5.0) if m * power <= length * (1 + 1e-9)))


def _draw_scale_bar(ax: Axes, surface: Surface, texts: _Texts) -> None:
    west, east, *_ = surface.view
    metres = round_down(_BAR * (east - west))
    bar = metres / (east - west) * texts.width
    text = f"{metres / 1000.0:g} km" if metres >= 1000.0 else f"{metres:g} m"
    letters = texts.letters
    width, height = max(bar, len(text) * _LETTER * texts.size) + 12.0, 10.0 + letters * 12.0
    for x, y in _corners(surface, width / texts.width, height / texts.height):
        if texts.take(x * (texts.width - 8.0) + 4.0, y * (texts.height - 8.0) + 4.0, width, height):
            break
    else:
        return
    left, bottom, right, _ = texts.boxes[-1]
    start, stop = 0.5 * (left + right - bar), 0.5 * (left + right + bar)
    colours = style_of(ax).colours
    edge: dict[str, Any] = {"edgecolor": colours.text, "linewidth": 0.6, "zorder": 6.0, "transform": ax.transAxes}
    for k, face in enumerate((colours.text, colours.background)):
        corner = (start + 0.5 * k * bar) / texts.width, (bottom + 4.0) / texts.height
        half = patches.Rectangle(corner, 0.5 * bar / texts.width, 3.0 / texts.height, facecolor=face, **edge)
        half.set_path_effects([patheffects.withStroke(linewidth=2.0, foreground=f"{colours.background}d0")])
        ax.add_patch(half)
    texts.write(text, 0.5 * (start + stop), bottom + 7.0 + letters * 6.5, "center", "scale bar")


# ---- cities ---------------------------------------------------------------------------------


def _draw_cities(ax: Axes, surface: Surface, texts: _Texts) -> None:
    """Draw dots and names of the main cities in the frame, those of the region first."""
    known = earth.cities()
    xy, order = _in_order(surface)
    most = int(_CITIES_PER_INCH * (texts.width + texts.height) / 72.0 / texts.letters)
    apart = _APART * min(texts.width, texts.height)
    drawn: list[FloatArray] = []
    for k in order:
        if len(drawn) == most:
            break
        place = xy[k] * [texts.width, texts.height]
        if any(np.hypot(*(place - other)) < apart for other in drawn):
            continue
        if _name(texts, known.name[k], place):
            drawn.append(place)
    if drawn:
        x, y = (np.array(drawn) / [texts.width, texts.height]).T
        colour = style_of(ax).colours.text
        ax.plot(x, y, "o", transform=ax.transAxes, color=colour, markersize=2.2, zorder=6.0, label="cities")


def main_cities(ax: Axes, surface: Surface) -> FloatArray:
    """Points (n, 2) along the main cities of a region and their names, which labels must not cover."""
    xy, order = _in_order(surface) if _has_places(surface) else (np.empty((0, 2)), np.empty(0, dtype=int))
    if not order.size:
        return np.empty((0, 2))
    west, east, south, north = surface.view
    ax.apply_aspect()
    letter = _LETTER * _TEXT * style_of(ax).scale * ax.figure.dpi / 72.0 / ax.get_window_extent().width
    ends = [[letter * len(earth.cities().name[k]), 0.0] for k in order[:_MAIN]]
    along = np.linspace(0.0, 1.0, _ALONG)[:, None]
    places = np.concatenate([xy[k] + along * end for k, end in zip(order[:_MAIN], ends, strict=True)])
    return np.asarray([west, south] + places * [east - west, north - south])


def _in_order(surface: Surface) -> tuple[FloatArray, IntArray]:
    """Places (n, 2) of all cities as fractions of the frame, and the indices of visible ones, the region's first."""
    known, (west, east, south, north) = earth.cities(), surface.view
    x, y = (surface.ground or surface).domain(known.lon, known.lat)
    share = np.column_stack([(x - west) / (east - west), (y - south) / (north - south)])
    with np.errstate(invalid="ignore"):
        seen = np.asarray((share > 0.01) & (share < 0.99)).all(axis=1)
    within, *about = (surface.domain.region.contains(known.lon + east, known.lat + north) for east, north in _ABOUT)
    # Towns a little outside of coarse coasts are the region's, those beyond a border are not.
    countries, towns = np.unique(known.country[within], return_counts=True)
    inside = within | (np.any(about, axis=0) & np.isin(known.country, countries[towns >= _ITS_OWN * within.sum()]))
    return share, np.concatenate([np.flatnonzero(seen & inside), np.flatnonzero(seen & ~inside)])


def _name(texts: _Texts, name: str, place: FloatArray) -> bool:
    """Write a city's name beside its dot: right if there is room, else left, above or below."""
    width, height = len(name) * _LETTER * texts.size, _LINE * texts.size
    x, y = place
    if not texts.is_free(x - 1.5, y - 1.5, 3.0, 3.0):
        return False
    beside = (x + 3.0, y - 0.5 * height), (x - 3.0 - width, y - 0.5 * height)
    for left, bottom in (*beside, (x - 0.5 * width, y + 2.5), (x - 0.5 * width, y - 2.5 - height)):
        if texts.take(left, bottom, width, height):
            texts.write(name, left, bottom + 0.5 * height, "left", "city")
            return True
    return False
