"""Pictures of a low-distortion projection: its distortion at the heights of the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from projdist._typing import FloatArray
from projdist.decisions import LDP, distortion_ppm
from projdist.matrices import Measure
from projdist.plots.areas import CONTEXTS, draw_ground
from projdist.plots.basemap import draw_lines, draw_title, set_view
from projdist.plots.colours import ColourScale, colour_scale
from projdist.plots.pictures import check_axes, draw_colourbar, draw_heatmap
from projdist.plots.titles import title_of
from projdist.support import check_instance
from projdist.surfaces import Surface, surface_of

# The surface's own values are given; none is asked for.
_DISTORTION = Measure("distortion_ppm", lambda J: np.full(J.shape[:-2], np.nan), unit="ppm", kind="signed")
_LARGEST, _SMALLEST = 60.0, 2.0  # points squared


@dataclass(frozen=True)
class GroundMap:
    """What is drawn: ppm at the vertices of a surface for a region of one height, else at the points of the design."""

    surface: Surface
    found: LDP
    is_level: bool
    ppm: FloatArray
    scale: ColourScale


def ground_map(ax: Axes, found: LDP, *, colourbar: bool = True, title: str | None = None) -> ColourScale:
    """Draw the distortion of a low-distortion projection in ppm on `ax`; returns what the colours mean.

    A region of one height is a field with isolines; points with heights are dots.
    """
    check_axes(ax)
    prepared = prepare_ground(found)
    draw_ground_map(ax, prepared, title)
    if colourbar:
        draw_colourbar(ax.figure, prepared.scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)
    return prepared.scale


def prepare_ground(found: LDP) -> GroundMap:
    """The surface and the colours of a picture."""
    check_instance("design", found, LDP, "an LDP, as ldp returns")
    surface = surface_of(found.projection, found.region)
    is_level = float(np.ptp(found.height)) == 0.0
    if not is_level:
        scale = colour_scale(_DISTORTION, [found.ppm], [found.weight])
        return GroundMap(surface, found, False, found.ppm, scale)
    lon, lat = surface.lonlat()
    ppm = distortion_ppm(found.projection, lon, lat, float(found.height[0]))
    scale = colour_scale(_DISTORTION, [ppm[: surface.nodes]], [surface.weights])
    return GroundMap(surface, found, True, ppm, scale)


def draw_ground_map(ax: Axes, prepared: GroundMap, title: str | None) -> None:
    """Draw a prepared picture."""
    surface, found, scale = prepared.surface, prepared.found, prepared.scale
    if prepared.is_level:
        draw_heatmap(ax, surface, prepared.ppm, scale, None, "", None)
        ground = f"at an ellipsoidal height of {found.height[0]:,.6g} m"
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
        ground = f"at {found.height.size:,} points from {found.height.min():,.0f} to {found.height.max():,.0f} m"
    share = found.statistics.within[found.target_ppm]
    below = f"{ground}; {100 * share:.4g} % within {found.target_ppm:g} ppm"
    draw_title(ax, title_of(found.projection) if title is None else title, below)
