"""Orientation on pictures of regions: cities, a scale bar, and a locator globe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke

from projdist._typing import FloatArray, IntArray
from projdist.earth import cities
from projdist.field import jacobian
from projdist.matrices import principal_scales
from projdist.plots.basemap import draw_globe
from projdist.plots.style import style_of
from projdist.projections import Projection
from projdist.regions import GLOBE
from projdist.surfaces import Surface, ground_size, normalised, surface_of

_TEXT = 6.5  # points
_LETTER, _LINE = 0.6, 1.25  # of a letter and a line, in the size

_NEARLY_ONE = 0.03
_SAMPLE = 200  # nodes at which scales are looked at
_BAR = 0.22  # of a picture's width, at most
_ROUND = tuple(m * 10.0**k for k in range(0, 7) for m in (1, 2, 5))

_PLACED_AT_ONCE = 8.0  # degrees: a smaller region has a globe that tells where it is
_LEAST_FOR_LOCATOR = 170.0  # points; in a smaller picture it would be in the way
_LOCATOR = 0.17  # of the smaller side
_LOCATOR_STEP = 4.0  # degrees
_MARK = "#d7301f"

_CITIES_PER_INCH = 1.1  # of the sum of a picture's sides
_ABOUT = [(0.0, 0.0), *((0.1 * east, 0.1 * north) for east in (-1, 1) for north in (-1, 1))]  # coarse coasts miss some
_MAIN = 3  # cities that labels of isolines give way to
_ALONG = 8  # points along a name
_APART = 0.12  # of the smaller side: cities are no closer


@dataclass
class _Texts:
    """Boxes in points that are occupied, the size of the frame, and the relative font size."""

    ax: Axes
    width: float
    height: float
    boxes: list[tuple[float, float, float, float]]
    letters: float

    @classmethod
    def of(cls, ax: Axes) -> _Texts:
        """The frame of axes, in which the boxes of existing labels are occupied."""
        ax.apply_aspect()
        box, points = ax.get_window_extent(), 72.0 / ax.figure.dpi
        found = cls(ax, box.width * points, box.height * points, [], style_of(ax).scale)
        for text in ax.texts:
            if text.get_text():
                extent = text.get_window_extent()
                x, y = (extent.x0 - box.x0) * points, (extent.y0 - box.y0) * points
                found.boxes.append((x, y, x + extent.width * points, y + extent.height * points))
        return found

    @property
    def size(self) -> float:
        """Font size in points."""
        return self.letters * _TEXT

    def take(self, x: float, y: float, width: float, height: float) -> bool:
        """Occupy a box with its lower left corner at x, y, if it is free and within the frame."""
        if self.is_free(x, y, width, height):
            self.boxes.append((x, y, x + width, y + height))
            return True
        return False

    def is_free(self, x: float, y: float, width: float, height: float) -> bool:
        """True if a box is free and within the frame."""
        right, top = x + width, y + height
        if x < 2.0 or y < 2.0 or right > self.width - 2.0 or top > self.height - 2.0:
            return False
        return not any(x < b[2] and b[0] < right and y < b[3] and b[1] < top for b in self.boxes)

    def write(self, text: str, x: float, y: float, ha: str, label: str) -> None:
        """Write a text with a halo."""
        colours = style_of(self.ax).colours
        self.ax.text(
            x / self.width,
            y / self.height,
            text,
            transform=self.ax.transAxes,
            ha=ha,
            va="center",
            fontsize=self.size,
            color=colours.text,
            zorder=6.0,
            label=label,
            path_effects=[withStroke(linewidth=1.6, foreground=f"{colours.background}d0")],
        )


def _has_places(surface: Surface) -> bool:
    """True for pictures of parts of the Earth."""
    return surface.is_local and not surface.domain.projection.is_of_another_body


def draw_places(ax: Axes, surface: Surface, context: str) -> None:
    """Draw a locator globe of a small region, a scale bar if the scale is nearly one, and cities."""
    if context != "full" or not _has_places(surface):
        return
    texts = _Texts.of(ax)
    is_small = max(ground_size(surface.domain.region.bounds)) < _PLACED_AT_ONCE
    if is_small and min(texts.width, texts.height) > _LEAST_FOR_LOCATOR:
        _draw_locator(ax, surface, texts)
    if _is_true_to_scale(surface):
        _draw_scale_bar(ax, surface, texts)
    _draw_cities(ax, surface, texts)


def _corners(surface: Surface, width: float, height: float) -> list[tuple[float, float]]:
    """Lower left corners, as fractions of the frame, of boxes in its four corners, least of the region first."""
    west, east, south, north = surface.view
    nodes = np.flatnonzero(surface.weights > 0)
    share = (np.column_stack([surface.x[nodes], surface.y[nodes]]) - [west, south]) / [east - west, north - south]

    def covered(corner: tuple[float, float]) -> float:
        inside = ((share >= corner) & (share <= np.add(corner, [width, height]))).all(axis=1)
        return float(surface.weights[nodes[inside]].sum())

    return sorted([(0.0, 0.0), (1.0 - width, 0.0), (0.0, 1.0 - height), (1.0 - width, 1.0 - height)], key=covered)


# ---- a globe --------------------------------------------------------------------------------


def _draw_locator(ax: Axes, surface: Surface, texts: _Texts) -> None:
    side = _LOCATOR * min(texts.width, texts.height)
    air = 0.25 * side
    shares = (side + air) / texts.width, (side + air) / texts.height
    for x, y in _corners(surface, *shares):
        if texts.take(x * texts.width + 0.5 * air, y * texts.height + 0.5 * air, side, side):
            break
    else:
        return
    left, bottom, right, top = texts.boxes[-1]
    place = left / texts.width, bottom / texts.height, (right - left) / texts.width, (top - bottom) / texts.height
    globe = ax.inset_axes(place, zorder=6.0)
    west, south, east, north = surface.domain.region.bounds
    lon, lat = float(normalised(np.array(0.5 * (west + east)))), 0.5 * (south + north)
    tilted = Projection.from_user_input(f"+proj=ortho +lon_0={lon:.6f} +lat_0={0.8 * lat:.6f} +R=6371008.7714")
    draw_globe(globe, surface_of(tilted, GLOBE, _LOCATOR_STEP))
    spot = [float(one) for one in tilted(lon, lat)]
    globe.plot(*spot, "o", color=_MARK, markersize=4.0, markeredgecolor="white", markeredgewidth=0.8)
    globe.set_label("locator")


# ---- a scale bar ----------------------------------------------------------------------------


def _is_true_to_scale(surface: Surface) -> bool:
    """True if nearly all scales in the region are nearly one."""
    nodes = np.flatnonzero(surface.weights > 0)
    nodes = nodes[:: max(nodes.size // _SAMPLE, 1)]
    lon, lat = surface.lonlat()
    scales = principal_scales(jacobian(surface.domain.projection, normalised(lon[nodes]), lat[nodes]))
    off = np.abs(scales[np.isfinite(scales).all(axis=1)] - 1.0)
    return bool(off.size and np.quantile(off, 0.95) < _NEARLY_ONE)


def _draw_scale_bar(ax: Axes, surface: Surface, texts: _Texts) -> None:
    west, east, *_ = surface.view
    metres = max(length for length in _ROUND if length <= _BAR * (east - west))
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
    for k, face in enumerate((colours.text, colours.background)):
        half = Rectangle(
            ((start + 0.5 * k * bar) / texts.width, (bottom + 4.0) / texts.height),
            0.5 * bar / texts.width,
            3.0 / texts.height,
            transform=ax.transAxes,
            facecolor=face,
            edgecolor=colours.text,
            linewidth=0.6,
            zorder=6.0,
        )
        half.set_path_effects([withStroke(linewidth=2.0, foreground=f"{colours.background}d0")])
        ax.add_patch(half)
    texts.write(text, 0.5 * (start + stop), bottom + 7.0 + letters * 6.5, "center", "scale bar")


# ---- cities ---------------------------------------------------------------------------------


def _draw_cities(ax: Axes, surface: Surface, texts: _Texts) -> None:
    """Draw dots and names of the main cities in the frame, those of the region first."""
    known = cities()
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
    ends = [[letter * len(cities().name[k]), 0.0] for k in order[:_MAIN]]
    places = np.concatenate(
        [xy[k] + np.linspace(0.0, 1.0, _ALONG)[:, None] * end for k, end in zip(order[:_MAIN], ends, strict=True)]
    )
    return np.asarray([west, south] + places * [east - west, north - south])


def _in_order(surface: Surface) -> tuple[FloatArray, IntArray]:
    """Places (n, 2) of all cities as fractions of the frame, and the indices of visible ones, the region's first."""
    known, (west, east, south, north) = cities(), surface.view
    x, y = (surface.ground or surface).domain(known.lon, known.lat)
    share = np.column_stack([(x - west) / (east - west), (y - south) / (north - south)])
    with np.errstate(invalid="ignore"):
        seen = np.asarray((share > 0.01) & (share < 0.99)).all(axis=1)
    near = [surface.domain.region.contains(known.lon + east, known.lat + north) for east, north in _ABOUT]
    inside = np.logical_or.reduce(near)
    return share, np.concatenate([np.flatnonzero(seen & inside), np.flatnonzero(seen & ~inside)])


def _name(texts: _Texts, name: str, place: FloatArray) -> bool:
    """Write a city's name beside its dot: right if there is room, else left, above or below."""
    width, height = len(name) * _LETTER * texts.size, _LINE * texts.size
    x, y = place
    if not texts.is_free(x - 1.5, y - 1.5, 3.0, 3.0):
        return False
    for left, bottom in (
        (x + 3.0, y - 0.5 * height),
        (x - 3.0 - width, y - 0.5 * height),
        (x - 0.5 * width, y + 2.5),
        (x - 0.5 * width, y - 2.5 - height),
    ):
        if texts.take(left, bottom, width, height):
            texts.write(name, left, bottom + 0.5 * height, "left", "city")
            return True
    return False
