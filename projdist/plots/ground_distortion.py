"""Pictures of a low-distortion projection on its ground, and of local corrections."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from projdist import surfaces
from projdist._typing import FloatArray
from projdist.answers import LocalCorrections, local_corrections
from projdist.matrices import Measure, areal_scale, decompose
from projdist.plots.basemap import CONTEXTS, draw_basemap, region_clip, triangulation
from projdist.plots.colours import ColourScale
from projdist.plots.layouts import draw_title
from projdist.plots.map_drawing import check_axes, draw_bar_below, draw_heatmap, words_of
from projdist.plots.style import add_lines, add_polygons
from projdist.projections import ProjectionLike
from projdist.regions import RegionLike
from projdist.support import check_instance
from projdist.surfaces import Surface

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
    """Distortion on the ground: ppm at the vertices of a surface, or at the points of a design if these are few."""

    surface: Surface
    found: LDP
    is_field: bool
    ppm: FloatArray
    scale: ColourScale

    @classmethod
    def of(cls, found: LDP) -> GroundMap:
        """The picture of a design."""
        from projdist.decisions import LDP, distortion_ppm  # slow to load

        check_instance("design", found, LDP, "an LDP, as ldp returns")
        surface = surfaces.surface_of(found.projection, found.region)
        heights = _heights(surface, found)
        if heights is None:
            return cls(surface, found, False, found.ppm, ColourScale.of(_DISTORTION, [found.ppm], [found.weight]))
        ppm = distortion_ppm(found.projection, *surface.lonlat(), heights)
        return cls(surface, found, True, ppm, ColourScale.of_surfaces(_DISTORTION, [surface], [ppm]))

    def below(self, lines: str = "") -> str:
        """Subtitle: the heights, and the share within the target."""
        height, target = self.found.height, self.found.target_ppm
        if np.ptp(height) == 0.0:
            ground = f"at an ellipsoidal height of {height[0]:,.6g} m"
        else:
            ground = f"at {height.size:,} points from {height.min():,.0f} to {height.max():,.0f} m"
        return f"{ground}; {100 * self.found.statistics.within[target]:.4g} % within {target:g} ppm{lines}"

    def draw(self, ax: Axes, title: str | None) -> None:
        """Draw it on axes, a field with the isolines of the target."""
        found, surface, scale = self.found, self.surface, self.scale
        if not self.is_field:
            draw_basemap(ax, surface)
            x, y = found.projection(found.lon, found.lat)
            size = float(np.clip(2e4 / x.size, _SMALLEST, _LARGEST))
            colours = scale.colours(scale.norm(self.ppm))
            edge: dict[str, Any] = {"edgecolors": "#00000055", "linewidths": 0.3}
            ax.scatter(x, y, c=colours, s=size, zorder=2.0, label="points", **edge)
            draw_title(ax, *words_of(found.projection, title, below=self.below()))
            return
        mapped, used = triangulation(surface, surface.triangles)
        values, target = self.ppm[used], found.target_ppm
        levels = [level for level in (-target, target) if values.min() < level < values.max()]
        words = words_of(found.projection, title, below=self.below(" (thick lines)" if levels else ""))
        draw_heatmap(ax, surface, self.ppm, scale, words, CONTEXTS[-1])
        if levels:
            style = {"colors": _TARGET, "linewidths": 1.6, "linestyles": "solid", "zorder": 2.1}
            lines = ax.tricontour(mapped, values, levels=levels, **style)
            clip = region_clip(ax, surface)
            if clip is not None:
                lines.set_clip_path(clip)


def ground_map(ax: Axes, found: LDP, *, colourbar: bool = True, title: str | None = None) -> ColourScale:
    """Draw the distortion of a low-distortion projection in ppm on `ax`; returns the colour scale.

    A region of one height, and heights that cover it as a raster does, are a field with isolines and the lines of the
    target; points with heights are dots.
    """
    check_axes(ax)
    prepared = GroundMap.of(found)
    prepared.draw(ax, title)
    if colourbar:
        draw_bar_below(ax, prepared.scale)
    return prepared.scale


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


# ---- local fields --------------------------------------------------------------------------------

_VERTICES = 36
_DENSER = 2 / 3  # than Tissot's indicatrices stand
_DISC, _LINE = 0.6, 1.0  # of the radius at which discs would be close
_USUAL = 0.9  # of the stretches have lines in proportion; what is stretched more has the longest line
_INK = "#222222"
_HALO = withStroke(linewidth=2.2, foreground="#ffffffb0")
_FLAT = 1e-6  # of logarithms: what differs by less is the same, and where all stretches are less there are no lines


_SCALE = Measure("scale_of_the_local_correction", lambda M: np.sqrt(areal_scale(M)), kind="ratio")
_STRETCH = Measure("stretch_of_the_local_correction", lambda M: decompose(M).stretch, kind="ratio")


@dataclass(frozen=True, kw_only=True)
class LocalField:
    """Corrections at n places on a map, (n, 2) in metres, and the free radius around them."""

    surface: Surface
    corrections: LocalCorrections
    xy: FloatArray
    discs: FloatArray
    radius: float
    scale: ColourScale

    @classmethod
    def of(cls, surface: Surface, radius_km: float, step: float | None) -> LocalField:
        """Corrections on an even grid of a map; raises ValueError if no cap is on the map."""
        points = surfaces.tissot_points(surface, _DENSER * surfaces.usual_step(surface) if step is None else step)
        points = surfaces.without_crowding(replace(points, J=np.broadcast_to(np.eye(2), points.J.shape)))
        found = local_corrections(surface.domain.projection, points.lon, points.lat, radius_km)
        known = np.asarray(np.isfinite(found.matrix).all(axis=(1, 2)))
        if not known.any():
            raise ValueError(f"Invalid radius '{radius_km:g}'. No cap of so many km is, by half, on the map.")
        points, found = points.take(known), found.take(known)
        radius = surfaces.even_radius([points])
        # An equal-area map has one scale everywhere: then the discs' colours are the stretches.
        shown = _SCALE if np.ptp(np.log(_SCALE(found.matrix))) > _FLAT else _STRETCH
        values = shown(found.matrix)
        return cls(
            surface=surface,
            corrections=found,
            xy=points.xy,
            discs=surfaces.ellipses(points, _DISC * radius, _VERTICES),
            radius=radius,
            scale=ColourScale.of(shown, [values], [np.full(values.size, 1.0 / values.size)]),
        )

    @property
    def below(self) -> str:
        """Subtitle: the caps, and the meaning of the longest lines."""
        segments, longest, cut = self.segments()
        about = f"Caps of {self.corrections.radius_km:,.6g} km"
        return f"{about}; longest lines: stretch {longest:.4g}{' or more' if cut else ''}" if len(segments) else about

    def draw(self, ax: Axes, title: str | None) -> None:
        """Draw it on axes."""
        draw_basemap(ax, self.surface)
        colours = self.scale.colours(self.scale.norm(self.scale.measure(self.corrections.matrix)))
        edge = {"edgecolors": _INK, "linewidths": 0.4}
        add_polygons(ax, self.discs, facecolors=colours, zorder=2.0, label="scales", **edge)
        line = {"colors": _INK, "linewidths": 1.2, "path_effects": [_HALO]}
        add_lines(ax, self.segments()[0], zorder=2.2, label="stretches", **line)
        draw_title(ax, *words_of(self.surface.domain.projection, title, below=self.below))

    def segments(self) -> tuple[FloatArray, float, bool]:
        """Lines (m, 2, 2) along the stretches, the stretch of the longest, and whether some exceed it."""
        parts = self.corrections.parts
        length = np.where(np.isfinite(parts.stretch_azimuth), np.log(parts.stretch), 0.0)
        longest = float(np.quantile(length, _USUAL))
        if not longest > _FLAT:
            return np.empty((0, 2, 2)), 1.0, False
        azimuth = np.radians(np.nan_to_num(parts.stretch_azimuth))
        size = _LINE * self.radius * np.minimum(length / longest, 1.0)
        half = size[:, None] * np.stack([np.sin(azimuth), np.cos(azimuth)], axis=-1)
        return np.stack([self.xy - half, self.xy + half], axis=1), float(np.exp(longest)), bool(length.max() > longest)


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
    field = LocalField.of(surfaces.surface_of(projection, region), radius_km, step)
    field.draw(ax, title)
    if colourbar:
        draw_bar_below(ax, field.scale)
    return field.scale
