"""Pictures of a low-distortion projection: its distortion at the heights of the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from projdist._typing import FloatArray
from projdist.matrices import Measure
from projdist.plots.areas import CONTEXTS, draw_ground, region_clip, triangulation
from projdist.plots.basemap import draw_lines, draw_title, set_view
from projdist.plots.colours import ColourScale, colour_scale
from projdist.plots.pictures import check_axes, draw_colourbar, draw_heatmap
from projdist.plots.titles import title_of
from projdist.support import check_instance
from projdist.surfaces import Surface, surface_of

if TYPE_CHECKING:
    from projdist.decisions import LDP

# The surface's own values are given; none is asked for.
_DISTORTION = Measure("distortion_ppm", lambda J: np.full(J.shape[:-2], np.nan), unit="ppm", kind="signed")
_LARGEST, _SMALLEST = 60.0, 2.0  # points squared
_RASTER = 200  # points; of fewer each is shown
_EVEN = 1.8  # between the spacings of even points: cells of a raster are not square on the ground
_MOST_TRIANGULATED = 200_000
_TARGET = "#1a7f37"


@dataclass(frozen=True)
class GroundMap:
    """What is drawn: ppm at the vertices of a surface, a field, or at the points of a design where they are few."""

    surface: Surface
    found: LDP
    is_field: bool
    ppm: FloatArray
    scale: ColourScale

    @property
    def ground(self) -> str:
        """The heights in words."""
        height = self.found.height
        if np.ptp(height) == 0.0:
            return f"at an ellipsoidal height of {height[0]:,.6g} m"
        return f"at {height.size:,} points from {height.min():,.0f} to {height.max():,.0f} m"


def ground_map(ax: Axes, found: LDP, *, colourbar: bool = True, title: str | None = None) -> ColourScale:
    """Draw the distortion of a low-distortion projection in ppm on `ax`; returns what the colours mean.

    A region of one height, and heights that cover it as a raster does, are a field with isolines and the lines of the
    target; points with heights are dots.
    """
    check_axes(ax)
    prepared = prepare_ground(found)
    draw_ground_map(ax, prepared, title)
    if colourbar:
        draw_colourbar(ax.figure, prepared.scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)
    return prepared.scale


def prepare_ground(found: LDP) -> GroundMap:
    """The surface and the colours of a picture."""
    from projdist.decisions import LDP, distortion_ppm  # slow to load

    check_instance("design", found, LDP, "an LDP, as ldp returns")
    surface = surface_of(found.projection, found.region)
    heights = _heights(surface, found)
    if heights is None:
        scale = colour_scale(_DISTORTION, [found.ppm], [found.weight])
        return GroundMap(surface, found, False, found.ppm, scale)
    lon, lat = surface.lonlat()
    ppm = distortion_ppm(found.projection, lon, lat, heights)
    scale = colour_scale(_DISTORTION, [ppm[: surface.nodes]], [surface.weights])
    return GroundMap(surface, found, True, ppm, scale)


def _heights(surface: Surface, found: LDP) -> FloatArray | None:
    """Heights at the vertices of a surface; None where those of a design are too few or too uneven to be a field."""
    lon, lat = surface.lonlat()
    if np.ptp(found.height) == 0.0:
        return np.full(lon.size, found.height[0])
    if found.height.size < _RASTER:
        return None
    from scipy.interpolate import LinearNDInterpolator  # slow to load
    from scipy.spatial import cKDTree

    middle = float(np.mean(found.lat))
    across = np.cos(np.radians(middle))
    origin = found.lon[0]
    points = np.column_stack([_turned(found.lon - origin) * across, found.lat])
    tree = cKDTree(points)
    spacing = np.asarray(tree.query(points, 2)[0])[:, 1]
    if np.quantile(spacing, 0.9) > _EVEN * np.quantile(spacing, 0.1):
        return None
    nodes = np.column_stack([_turned(lon - origin) * across, lat])
    nearest = found.height[tree.query(nodes)[1]]
    if found.height.size > _MOST_TRIANGULATED:
        return nearest
    between = LinearNDInterpolator(points, found.height)(nodes)
    return np.where(np.isfinite(between), between, nearest)


def _turned(lon: FloatArray) -> FloatArray:
    """Differences of longitude, -180 to 180."""
    return np.mod(lon + 180.0, 360.0) - 180.0


def draw_ground_map(ax: Axes, prepared: GroundMap, title: str | None) -> None:
    """Draw a prepared picture."""
    surface, found, scale = prepared.surface, prepared.found, prepared.scale
    if prepared.is_field:
        draw_heatmap(ax, surface, prepared.ppm, scale, None, "", "")
        lines = _draw_target(ax, prepared)
    else:
        set_view(ax, surface)
        draw_ground(ax, surface, CONTEXTS[-1])
        draw_lines(ax, surface, None)
        x, y = found.projection(found.lon, found.lat)
        ax.scatter(
            x,
            y,
            c=scale.colours(scale.norm(prepared.ppm)),
            s=float(np.clip(2e4 / x.size, _SMALLEST, _LARGEST)),
            edgecolors="#00000055",
            linewidths=0.3,
            zorder=2.0,
            label="points",
        )
        lines = ""
    below = below_ground_map(prepared, lines)
    draw_title(ax, title_of(found.projection) if title is None else title, below)


def below_ground_map(prepared: GroundMap, lines: str = "") -> str:
    """The line below the title: at which heights, and how much is within the target."""
    target = prepared.found.target_ppm
    return f"{prepared.ground}; {100 * prepared.found.statistics.within[target]:.4g} % within {target:g} ppm{lines}"


def _draw_target(ax: Axes, prepared: GroundMap) -> str:
    """Draw the lines at which the target is missed; says so, if there are any."""
    mapped, used = triangulation(prepared.surface, prepared.surface.triangles)
    values, target = prepared.ppm[used], prepared.found.target_ppm
    levels = [level for level in (-target, target) if values.min() < level < values.max()]
    if not levels:
        return ""
    lines = ax.tricontour(mapped, values, levels=levels, colors=_TARGET, linewidths=1.6, linestyles="solid", zorder=2.1)
    clip = region_clip(ax, prepared.surface)
    if clip is not None:
        lines.set_clip_path(clip)
    return " (thick lines)"
