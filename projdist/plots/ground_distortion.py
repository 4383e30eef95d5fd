"""Pictures of a low-distortion projection on its ground, and of local corrections."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patheffects import withStroke

from projdist._typing import FloatArray
from projdist.answers import LocalCorrections, local_corrections
from projdist.matrices import Measure, areal_scale, decompose
from projdist.plots.basemap import CONTEXTS, draw_ground, draw_lines, draw_title, region_clip, set_view, triangulation
from projdist.plots.colours import ColourScale, colour_scale
from projdist.plots.pictures import check_axes, draw_colourbar, draw_heatmap
from projdist.plots.style import title_of
from projdist.projections import ProjectionLike
from projdist.regions import RegionLike
from projdist.support import check_instance
from projdist.surfaces import Surface, ellipses, even_radius, surface_of, tissot_points, usual_step, without_crowding

if TYPE_CHECKING:
    from projdist.decisions import LDP


# Values at the vertices are given, none are computed.
_DISTORTION = Measure("distortion_ppm", lambda J: np.full(J.shape[:-2], np.nan), unit="ppm", kind="signed")
_LARGEST, _SMALLEST = 60.0, 2.0  # points squared
_RASTER = 200  # points; of fewer each is shown
_EVEN = 1.8  # between the spacings of even points: cells of a raster are not square on the ground
_MOST_TRIANGULATED = 200_000
_TARGET = "#1a7f37"


@dataclass(frozen=True)
class GroundMap:
    """Prepared picture: ppm at the vertices of a surface, or at the points of a design if these are few."""

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
    """Draw the distortion of a low-distortion projection in ppm on `ax`; returns the colour scale.

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
    """Prepared picture of a design: surface, values and colour scale."""
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
    """Heights at the vertices of a surface; None if those of a design are too few or too uneven for a field."""
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
    """Subtitle: the heights, and the share within the target."""
    target = prepared.found.target_ppm
    return f"{prepared.ground}; {100 * prepared.found.statistics.within[target]:.4g} % within {target:g} ppm{lines}"


def _draw_target(ax: Axes, prepared: GroundMap) -> str:
    """Draw the isolines of the target; returns a note on them, empty without any."""
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


# ---- local fields --------------------------------------------------------------------------------


_VERTICES = 36
_DENSER = 2 / 3  # than Tissot's indicatrices stand
_DISC, _LINE = 0.6, 1.0  # of the radius at which discs would be close
_USUAL = 0.9  # of the stretches have lines in proportion; what is stretched more has the longest line
_INK = "#222222"
_HALO = withStroke(linewidth=2.2, foreground="#ffffffb0")
_FLAT = 1e-6  # of logarithms: what differs by less is the same, and where all stretches are less there are no lines


@dataclass(frozen=True, kw_only=True)
class LocalField:
    """Corrections at n places on a map, (n, 2) in metres, and the free radius around them."""

    surface: Surface
    corrections: LocalCorrections
    xy: FloatArray
    discs: FloatArray
    radius: float
    scale: ColourScale


def scale_of_correction(M: FloatArray) -> FloatArray:
    """sqrt |det M|."""
    return np.sqrt(areal_scale(M))


def stretch_of_correction(M: FloatArray) -> FloatArray:
    """Largest scale over the smallest."""
    return decompose(M).stretch


_SCALE = Measure("scale_of_the_local_correction", scale_of_correction, kind="ratio")
_STRETCH = Measure("stretch_of_the_local_correction", stretch_of_correction, kind="ratio")


def local_field(
    ax: Axes,
    projection: ProjectionLike,
    radius_km: float,
    *,
    region: RegionLike | None = None,
    step: float | None = None,
    colourbar: bool = True,
    title: str | None = None,
) -> ColourScale:
    """Draw the local corrections over caps of `radius_km` on `ax`; returns the colour scale.

    They stand `step` degrees apart. A disc's colour is the correction's scale, or its stretch where all
    scales are the same; a line lies in the direction that is stretched most, its length the logarithm
    of the stretch.
    """
    check_axes(ax)
    field = prepare_local_field(surface_of(projection, region), radius_km, step)
    draw_local_field(ax, field, title)
    if colourbar:
        draw_colourbar(ax.figure, field.scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)
    return field.scale


def prepare_local_field(surface: Surface, radius_km: float, step: float | None) -> LocalField:
    """Corrections on an even grid of a map; raises ValueError if no cap is on the map."""
    points = tissot_points(surface, _DENSER * usual_step(surface) if step is None else step)
    points = without_crowding(replace(points, J=np.broadcast_to(np.eye(2), points.J.shape)))
    found = local_corrections(surface.domain.projection, points.lon, points.lat, radius_km)
    known = np.asarray(np.isfinite(found.matrix).all(axis=(1, 2)))
    if not known.any():
        raise ValueError(f"Invalid radius '{radius_km:g}'. No cap of so many km is, by half, on the map.")
    points, found = points.take(known), found.take(known)
    radius = even_radius([points])
    # An equal-area map has one scale everywhere: then the discs' colours are the stretches.
    shown = _SCALE if np.ptp(np.log(_SCALE(found.matrix))) > _FLAT else _STRETCH
    values = shown(found.matrix)
    scale = colour_scale(shown, [values], [np.full(values.size, 1.0 / values.size)])
    return LocalField(
        surface=surface,
        corrections=found,
        xy=points.xy,
        discs=ellipses(points, _DISC * radius, _VERTICES),
        radius=radius,
        scale=scale,
    )


def draw_local_field(ax: Axes, field: LocalField, title: str | None) -> None:
    """Draw prepared corrections."""
    set_view(ax, field.surface)
    draw_ground(ax, field.surface, CONTEXTS[-1])
    draw_lines(ax, field.surface, None)
    colours = field.scale.colours(field.scale.norm(field.scale.measure(field.corrections.matrix)))
    discs = PolyCollection(
        list(field.discs), facecolors=colours, edgecolors=_INK, linewidths=0.4, zorder=2.0, label="scales"
    )
    ax.add_collection(discs, autolim=False)
    segments, _, _ = _segments(field)
    lines = LineCollection(
        list(segments), colors=_INK, linewidths=1.2, zorder=2.2, label="stretches", path_effects=[_HALO]
    )
    ax.add_collection(lines, autolim=False)
    draw_title(ax, title_of(field.surface.domain.projection) if title is None else title, below_local_field(field))


def below_local_field(field: LocalField) -> str:
    """Subtitle: the caps, and the meaning of the longest lines."""
    segments, longest, cut = _segments(field)
    about = f"Caps of {field.corrections.radius_km:,.6g} km"
    return f"{about}; longest lines: stretch {longest:.4g}{' or more' if cut else ''}" if len(segments) else about


def _segments(field: LocalField) -> tuple[FloatArray, float, bool]:
    """Lines (m, 2, 2) along the stretches, the stretch of the longest, and whether some exceed it."""
    parts = field.corrections.parts
    length = np.where(np.isfinite(parts.stretch_azimuth), np.log(parts.stretch), 0.0)
    longest = float(np.quantile(length, _USUAL))
    if not longest > _FLAT:
        return np.empty((0, 2, 2)), 1.0, False
    azimuth = np.radians(np.nan_to_num(parts.stretch_azimuth))
    size = _LINE * field.radius * np.minimum(length / longest, 1.0)
    half = size[:, None] * np.stack([np.sin(azimuth), np.cos(azimuth)], axis=-1)
    return np.stack([field.xy - half, field.xy + half], axis=1), float(np.exp(longest)), bool(length.max() > longest)
