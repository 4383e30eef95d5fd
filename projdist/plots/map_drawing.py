"""Drawing on given axes: indicatrices, heat maps, isolines, colour bars, local corrections and ground distortion."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib import colorbar, colors, contour, patheffects, tri
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable

from projdist import answers, decisions, earth, field, matrices, projections, regions, support, surfaces
from projdist._typing import FloatArray, IntArray
from projdist.plots import basemap, styled_figure
from projdist.plots.colours import ColourScale, Levels, level_labels, shown_levels
from projdist.plots.styled_figure import FigureStyle, StyledFigure, add_lines, add_polygons, style_of, text_width
from projdist.surfaces import Surface

_SIZE = 6.5  # points
_WIDTH = 0.65  # of a character, in its height
_SHORTEST = 4.0  # of the label's width; shorter isolines have none
_SHARES = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)


def label_isolines(ax: Axes, lines: contour.ContourSet, labels: Mapping[float, str], outline: FloatArray) -> None:
    """Label isolines clear of each other (matplotlib's are not) and of the outline, (n, 2, 2) segments in metres."""
    ax.apply_aspect()
    edge = ax.transData.transform(outline.reshape(-1, 2))
    size = _SIZE * style_of(ax).scale
    height = size / 72.0 * ax.figure.dpi
    places, reaches = np.empty((0, 2)), np.empty(0)
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        # Half the label's width, in any rotation, and a margin.
        reach = 0.5 * height * (_WIDTH * len(labels[level]) + 0.4)
        for piece in path.to_polygons(closed_only=False):
            points = ax.transData.transform(piece)
            along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
            for share in _SHARES if along[-1] >= 2.0 * _SHORTEST * reach else ():
                place = np.array([np.interp(share * along[-1], along, column) for column in points.T])
                clear = (np.hypot(*(places - place).T) > reaches + reach).all()
                if clear and (np.hypot(*(edge - place).T) > reach).all():
                    places, reaches = np.vstack([places, place]), np.append(reaches, reach)
                    break
    manual = ax.transData.inverted().transform(places).tolist()
    for text in ax.clabel(lines, fontsize=size, fmt=dict(labels), inline_spacing=2, manual=manual) if manual else ():
        text.set_path_effects([patheffects.withStroke(linewidth=1.5, foreground=style_of(ax).colours.halo)])


# ---- Tissot's indicatrices -----------------------------------------------------------------------

_VERTICES, _FEW_VERTICES, _MANY = 72, 24, 2000
_TICK, _AIR = 8.0, 0.6  # points, and of them between labels
_EDGE, _EDGE_SHARE = 0.6, 0.06  # points, and of the width of the ellipses

AnyMeasure = str | matrices.Measure | Callable[[FloatArray], FloatArray]


def words_of(
    projection: projections.Projection, title: str | None, airy_kavrayskiy: float | None = None, below: str = ""
) -> tuple[str, str]:
    """Title and subtitle of a map: its name by default, and its Airy-Kavrayskiy error if known."""
    if airy_kavrayskiy is not None and not below:
        below = f"Airy–Kavrayskiy {support.check_number('Airy-Kavrayskiy figure', airy_kavrayskiy):.4g}"
    return styled_figure.title_of(projection) if title is None else support.check_text("title", title), below


def check_exaggeration(factor: float | str) -> float | str:
    """Check an exaggeration: a factor, or "auto"; raises ValueError."""
    if factor == "auto":
        return factor
    if not 0.1 <= support.check_number("exaggeration", factor) <= 1e6:
        raise ValueError(f"Invalid exaggeration '{factor}'. It must be a factor of 0.1 to 1e6, or auto.")
    return factor


def tissot(
    ax: Axes,
    projection: projections.ProjectionLike,
    *,
    region: regions.RegionLike | None = None,
    step: float | None = None,
    radius: float | None = None,
    exaggeration: float | str = 1.0,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
    context: str = basemap.CONTEXTS[-1],
) -> float:
    """Draw indicatrices on `ax`, as by `plots.tissot`; returns the radius in metres of their circles on the ground."""
    support.check_instance("axes", ax, Axes, "Axes of matplotlib")
    exaggeration = check_exaggeration(exaggeration)
    surface = surfaces.surface_of(projection, region)
    words = words_of(surface.domain.projection, title, airy_kavrayskiy)
    points = [surfaces.tissot_points(surface, step)]
    factor = surfaces.usual_exaggeration(points) if isinstance(exaggeration, str) else exaggeration
    fitted, (panel,) = surfaces.fit(points, radius, factor)
    draw_tissot(ax, surface, panel, fitted, words, support.check_choice("context", context, basemap.CONTEXTS))
    return fitted


def draw_tissot(
    ax: Axes,
    surface: Surface,
    panel: surfaces.Indicatrices,
    radius: float,
    words: tuple[str, str],
    context: str,
    *,
    axes: bool = False,
) -> None:
    """Draw prepared indicatrices of a radius in metres, with the principal directions as crosses where wanted."""
    basemap.draw_basemap(ax, surface, context)
    draw_ellipses(ax, panel, radius)
    if axes:
        crosses = surfaces.principal_axes(panel, radius)
        edge = style_of(ax).colours.edge
        add_lines(ax, crosses, colors=edge, linewidths=0.5, zorder=2.1, label="principal directions")
    basemap.draw_places(ax, surface, context)
    styled_figure.draw_title(ax, *words)


def draw_ellipses(ax: Axes, panel: surfaces.Indicatrices, radius: float, matrix: FloatArray | None = None) -> None:
    """Draw ellipses only, in metres, or transformed by a matrix (2, 2)."""
    vertices = _FEW_VERTICES if panel.lon.size > _MANY else _VERTICES
    polygons = surfaces.ellipses(panel, radius, vertices) @ (np.eye(2) if matrix is None else matrix.T)
    width = _EDGE
    if len(polygons):
        points = ax.get_window_extent().width * 72.0 / ax.figure.dpi / np.ptp(ax.get_xlim())
        width = min(_EDGE, _EDGE_SHARE * points * float(np.median(np.ptp(polygons[..., 0], axis=1))))
    colours = {"facecolors": style_of(ax).colours.face, "edgecolors": style_of(ax).colours.edge}
    add_polygons(ax, polygons, **colours, linewidths=width, zorder=2.0, label="indicatrices")


# ---- heat maps ------------------------------------------------------------------------------


def heatmap(
    ax: Axes,
    projection: projections.ProjectionLike,
    *,
    measure: AnyMeasure = "fisher",
    region: regions.RegionLike | None = None,
    step: float | None = None,
    levels: Levels = None,
    cmap: str | colors.Colormap | None = None,
    limits: tuple[float, float] | None = None,
    colourbar: bool = True,
    title: str | None = None,
    airy_kavrayskiy: float | None = None,
    context: str = basemap.CONTEXTS[-1],
) -> ColourScale:
    """Draw a measure as colours with isolines on `ax`, as by `plots.heatmap`; returns the colour scale."""
    support.check_instance("axes", ax, Axes, "Axes of matplotlib")
    support.check_choice("context", context, basemap.CONTEXTS)
    surface = surfaces.surface_of(projection, region)
    words = words_of(surface.domain.projection, title, airy_kavrayskiy)
    values, scale, values_at = measured(surface, measure, levels=levels, cmap=cmap, limits=limits)
    draw_heatmap(ax, surface, values, scale, words, context, values_at, step=step)
    if colourbar:
        draw_bar_below(ax, scale)
    return scale


def measured(
    surface: Surface, measure: AnyMeasure, **options: Any
) -> tuple[FloatArray, ColourScale, surfaces.ValuesAt]:
    """A measure at the vertices of a surface, its colours, and the function of places that gives it."""
    chosen = matrices.get_measure(measure)
    values = surfaces.field(surface, chosen)
    values_at = functools.partial(field.measure_at, surface.domain.projection, chosen)
    return values, ColourScale.of_surfaces(chosen, [surface], [values], **options), values_at


def draw_heatmap(
    ax: Axes,
    surface: Surface,
    values: FloatArray,
    scale: ColourScale,
    words: tuple[str, str],
    context: str,
    values_at: surfaces.ValuesAt | None = None,
    *,
    step: float | None = None,
) -> None:
    """Draw prepared values at the vertices of a surface; isolines end where `values_at` jumps."""
    basemap.draw_basemap(ax, surface, context, step, over_colours=True)
    kept = basemap.main_cities(ax, surface) if context == "full" else None
    draw_field(ax, surface, values, scale, values_at, kept)
    basemap.draw_places(ax, surface, context)
    styled_figure.draw_title(ax, *words)


def draw_field(
    ax: Axes,
    surface: Surface,
    values: FloatArray,
    scale: ColourScale,
    values_at: surfaces.ValuesAt | None = None,
    kept: FloatArray | None = None,
) -> None:
    """Draw prepared values as colours and isolines only, whose labels keep clear of some points (n, 2)."""
    mapped, used = basemap.triangulation(surface, surface.triangles)
    whole, values = values, values[used]
    if scale.measure.name == "meridian_convergence":
        mapped, values = _without_turn(mapped, values)
    missing = ~np.isfinite(values)
    unknown = missing[mapped.triangles].any(axis=1)
    mapped.set_mask(unknown)
    levels = shown_levels(scale, values[~missing])
    values = np.where(missing, scale.limits[0], values)
    clip = basemap.region_clip(ax, surface)
    shades: dict[str, Any] = {"norm": scale.norm, "cmap": scale.colours, "zorder": 0.5, "clip_path": clip}
    basemap.draw_triangles(ax, mapped, values, **shades)
    if levels.size:
        traced = surfaces.crosses(values[mapped.triangles], levels) & ~unknown
        if values_at is not None:
            traced &= ~surfaces.jumping(surface, whole, levels, values_at)
        # Separate triangulations: matplotlib searches all triangles for each level.
        mapped = tri.Triangulation(mapped.x, mapped.y, mapped.triangles[traced])
        edges = (surface.ground or surface).outline
        if kept is not None:
            edges = np.concatenate([edges, np.repeat(kept[:, None], 2, axis=1)])
        draw_isolines(ax, mapped, values, dict(zip(levels.tolist(), level_labels(levels), strict=True)), edges, clip)


def draw_isolines(
    ax: Axes,
    mesh: tri.Triangulation,
    values: FloatArray,
    labels: Mapping[float, str],
    edges: FloatArray,
    clip: Any = None,
) -> None:
    """Draw isolines of values at the vertices of triangles, and their labels clear of edges, (n, 2, 2) segments."""
    style = {"colors": style_of(ax).colours.ink, "linewidths": 0.6, "linestyles": "solid", "zorder": 2.0}
    lines = ax.tricontour(mesh, values, levels=list(labels), **style)
    lines.set_clip_path(clip or ax.patch)
    label_isolines(ax, lines, labels, edges)


def _without_turn(mapped: tri.Triangulation, values: FloatArray) -> tuple[tri.Triangulation, FloatArray]:
    """Field of angles with separate vertices for triangles across the jump from 180 to -180 degrees."""
    corners = values[mapped.triangles]
    turn = np.ptp(corners, axis=1) > 180.0
    torn = mapped.triangles[turn].ravel()
    first = np.repeat(corners[turn, 0], 3)
    unwrapped = first + np.mod(values[torn] - first + 180.0, 360.0) - 180.0
    triangles = mapped.triangles.copy()
    triangles[turn] = len(values) + np.arange(torn.size).reshape(-1, 3)
    x, y = np.concatenate([mapped.x, mapped.x[torn]]), np.concatenate([mapped.y, mapped.y[torn]])
    return tri.Triangulation(x, y, triangles), np.concatenate([values, unwrapped])


def draw_bar_below(ax: Axes, scale: ColourScale) -> None:
    """Draw a colour bar below axes, which give way."""
    draw_colourbar(ax.figure, scale, ax=ax, fraction=0.05, pad=0.04, shrink=0.8, aspect=30)


def draw_colourbar(figure: Any, scale: ColourScale, *, label: str | None = None, **place: Any) -> colorbar.Colorbar:
    """Draw a horizontal colour bar with the levels as ticks; its label is by default the measure's name."""
    is_ours = isinstance(figure, StyledFigure)
    style = figure.style if is_ours else FigureStyle()
    letters, colours = style.scale, style.colours
    place |= {"orientation": "horizontal", "extend": scale.extend}
    bar: colorbar.Colorbar = figure.colorbar(ScalarMappable(scale.norm, scale.colours), **place)
    ticks = _ticks(scale, bar.ax.get_window_extent().width / figure.dpi * 72.0 / (letters * _TICK))
    bar.set_ticks(ticks, labels=level_labels(np.array(ticks)))
    bar.minorticks_off()
    pad, below = (2.0, 1.0) if style.is_tight else (3.5, 4.0)
    bar.ax.tick_params(labelsize=letters * _TICK, length=letters * 3.0, pad=letters * pad, colors=colours.text)
    bar.set_label(scale.label if label is None else label, labelpad=letters * below, **style.letters(9.0))
    bar.outline.set(linewidth=0.5, edgecolor=colours.outline if is_ours else "black")
    if is_ours:
        figure.fit(bar.ax.xaxis.label)
    return bar


def _ticks(scale: ColourScale, length: float) -> list[float]:
    """Levels whose labels fit on a bar, whose length is in units of the labels' size."""
    low, high = scale.limits
    levels = scale.levels[(scale.levels >= low) & (scale.levels <= high)]
    if not levels.size:
        return [low, high]
    places = length * np.asarray(scale.norm(levels), dtype=float)
    reach = 0.5 * np.array([text_width(label, 1.0) for label in level_labels(levels)])

    def are_clear(chosen: IntArray) -> bool:
        return bool((np.diff(places[chosen]) > reach[chosen][:-1] + reach[chosen][1:] + _AIR).all())

    # Even steps through the neutral value, or, if more fit, one after the other.
    middle = int(np.argmin(np.abs(levels - (1.0 if scale.measure.kind == "ratio" else 0.0))))
    steps = (np.arange(middle % every, levels.size, every) for every in range(1, levels.size + 1))
    even = next(chosen for chosen in steps if are_clear(chosen))
    each = [0]
    for index in range(1, levels.size):
        if places[index] - places[each[-1]] > reach[index] + reach[each[-1]] + _AIR:
            each.append(index)
    return [float(level) for level in levels[max(even, np.array(each), key=len)]]


# ---- ground distortion ---------------------------------------------------------------------------

# Values at the vertices are given, none are computed.
_DISTORTION = matrices.Measure("distortion_ppm", lambda J: np.full(J.shape[:-2], np.nan), unit="ppm", kind="signed")
_LARGEST, _SMALLEST = 60.0, 2.0  # points squared
_RASTER = 200  # points; of fewer each is shown
_EVEN = 1.8  # between the spacings of even points: cells of a raster are not square on the ground
_MOST_TRIANGULATED = 200_000
_LEVEL = 1e-6  # metres: less is rounding of one height above a geoid


@dataclass(frozen=True)
class GroundMap:
    """Distortion on the ground: ppm at the vertices of a surface, or at the points of a design if these are few."""

    surface: Surface
    found: decisions.LDP
    is_field: bool
    ppm: FloatArray
    scale: ColourScale

    @classmethod
    def of(cls, found: decisions.LDP) -> GroundMap:
        """The picture of a design."""
        support.check_instance("design", found, decisions.LDP, "an LDP, as ldp returns")
        surface = surfaces.surface_of(found.projection, found.region)
        heights = _heights(surface, found)
        if heights is None:
            return cls(surface, found, False, found.ppm, ColourScale.of(_DISTORTION, [found.ppm], [found.weight]))
        ppm = decisions.distortion_ppm(found.projection, *surface.lonlat(), heights)
        return cls(surface, found, True, ppm, ColourScale.of_surfaces(_DISTORTION, [surface], [ppm]))

    def below(self, lines: str = "") -> str:
        """Subtitle: the heights, and the share within the target."""
        unit, target = self.found.unit, self.found.target_ppm
        height = self.found.height / unit.metres
        if np.ptp(height) == 0.0:
            ground = f"at an ellipsoidal height of {height[0]:,.6g} {unit.name}"
        else:
            ground = f"at {height.size:,} points from {height.min():,.0f} to {height.max():,.0f} {unit.name}"
        return f"{ground}; {100 * self.found.statistics.within[target]:.4g} % within {target:g} ppm{lines}"

    def draw(self, ax: Axes, title: str | None) -> None:
        """Draw it on axes, a field with the isolines of the target."""
        found, surface, scale = self.found, self.surface, self.scale
        if not self.is_field:
            basemap.draw_basemap(ax, surface)
            x, y = found.projection(found.lon, found.lat)
            dots: dict[str, Any] = {"edgecolors": "#00000055", "linewidths": 0.3, "zorder": 2.0, "label": "points"}
            size = float(np.clip(2e4 / x.size, _SMALLEST, _LARGEST))
            ax.scatter(x, y, c=scale.colours(scale.norm(self.ppm)), s=size, **dots)
            styled_figure.draw_title(ax, *words_of(found.projection, title, below=self.below()))
            return
        mapped, used = basemap.triangulation(surface, surface.triangles)
        values, target = self.ppm[used], found.target_ppm
        levels = [level for level in (-target, target) if values.min() < level < values.max()]
        words = words_of(found.projection, title, below=self.below(" (thick lines)" if levels else ""))
        draw_heatmap(ax, surface, self.ppm, scale, words, basemap.CONTEXTS[-1])
        if levels:
            style = {"colors": "#1a7f37", "linewidths": 1.6, "linestyles": "solid", "zorder": 2.1}
            lines = ax.tricontour(mapped, values, levels=levels, **style)
            lines.set_clip_path(basemap.region_clip(ax, surface))


def ground_map(ax: Axes, found: decisions.LDP, *, colourbar: bool = True, title: str | None = None) -> ColourScale:
    """Draw the distortion of a low-distortion projection in ppm on `ax`; returns the colour scale.

    One height, and heights that cover the region, are a field with isolines and lines of the target; points are dots.
    """
    support.check_instance("axes", ax, Axes, "Axes of matplotlib")
    prepared = GroundMap.of(found)
    prepared.draw(ax, title)
    if colourbar:
        draw_bar_below(ax, prepared.scale)
    return prepared.scale


def _heights(surface: Surface, found: decisions.LDP) -> FloatArray | None:
    """Heights at the vertices of a surface; None if those of a design are too few or too uneven for a field."""
    lon, lat = surface.lonlat()
    if np.ptp(found.height) == 0.0:
        return np.full(lon.size, found.height[0])
    if found.height.size < _RASTER:
        return None
    from scipy.interpolate import LinearNDInterpolator  # slow to load
    from scipy.spatial import cKDTree

    origin, across = found.lon[0], np.cos(np.radians(np.mean(found.lat)))
    points = np.column_stack([earth.wrapped(found.lon - origin) * across, found.lat])
    tree = cKDTree(points)
    spacing = np.asarray(tree.query(points, 2)[0])[:, 1]
    above_geoid = found.height - (0.0 if found.geoid_height is None else found.geoid_height)
    if np.ptp(above_geoid) > _LEVEL and np.quantile(spacing, 0.9) > _EVEN * np.quantile(spacing, 0.1):
        return None
    nodes = np.column_stack([earth.wrapped(lon - origin) * across, lat])
    nearest = found.height[tree.query(nodes)[1]]
    if found.height.size > _MOST_TRIANGULATED:
        return nearest
    between = LinearNDInterpolator(points, found.height)(nodes)
    return np.where(np.isfinite(between), between, nearest)


# ---- local fields --------------------------------------------------------------------------------

_DISC_VERTICES = 36
_DENSER = 2 / 3  # than Tissot's indicatrices stand
_DISC, _LINE = 0.6, 1.0  # of the radius at which discs would be close
_USUAL = 0.9  # of the stretches have lines in proportion; what is stretched more has the longest line
_INK = "#222222"
_HALO = patheffects.withStroke(linewidth=2.2, foreground="#ffffffb0")
_FLAT = 1e-6  # of logarithms: what differs by less is the same, and where all stretches are less there are no lines
_SCALE = matrices.Measure("scale_of_the_local_correction", lambda M: np.sqrt(matrices.areal_scale(M)), kind="ratio")
_STRETCH = matrices.Measure("stretch_of_the_local_correction", lambda M: matrices.decompose(M).stretch, kind="ratio")


@dataclass(frozen=True, kw_only=True)
class LocalField:
    """Corrections at n places on a map, (n, 2) in metres, and the free radius around them."""

    surface: Surface
    corrections: answers.LocalCorrections
    xy: FloatArray
    discs: FloatArray
    radius: float
    scale: ColourScale

    @classmethod
    def of(cls, surface: Surface, radius_km: float, step: float | None) -> LocalField:
        """Corrections on an even grid of a map; raises ValueError if no cap is on the map."""
        points = surfaces.tissot_points(surface, _DENSER * surfaces.usual_step(surface) if step is None else step)
        points = surfaces.without_crowding(replace(points, J=np.broadcast_to(np.eye(2), points.J.shape)))
        found = answers.local_corrections(surface.domain.projection, points.lon, points.lat, radius_km)
        known = np.asarray(np.isfinite(found.matrix).all(axis=(1, 2)))
        if not known.any():
            raise ValueError(f"Invalid radius '{radius_km:g}'. No cap of this radius is at least half on the map.")
        points, found = points.take(known), found.take(known)
        radius = surfaces.even_radius([points])
        # An equal-area map has one scale everywhere: then the discs' colours are the stretches.
        shown = _SCALE if np.ptp(np.log(_SCALE(found.matrix))) > _FLAT else _STRETCH
        return cls(
            surface=surface,
            corrections=found,
            xy=points.xy,
            discs=surfaces.ellipses(points, _DISC * radius, _DISC_VERTICES),
            radius=radius,
            scale=ColourScale.of(shown, [shown(found.matrix)]),
        )

    @property
    def below(self) -> str:
        """Subtitle: the caps, and the meaning of the longest lines."""
        segments, longest, cut = self.segments()
        about = f"Caps of {self.corrections.radius_km:,.6g} km"
        return f"{about}; longest lines: stretch {longest:.4g}{' or more' if cut else ''}" if len(segments) else about

    def draw(self, ax: Axes, title: str | None) -> None:
        """Draw it on axes."""
        basemap.draw_basemap(ax, self.surface)
        colours = self.scale.colours(self.scale.norm(self.scale.measure(self.corrections.matrix)))
        edge = {"edgecolors": _INK, "linewidths": 0.4}
        add_polygons(ax, self.discs, facecolors=colours, zorder=2.0, label="scales", **edge)
        line = {"colors": _INK, "linewidths": 1.2, "path_effects": [_HALO]}
        add_lines(ax, self.segments()[0], zorder=2.2, label="stretches", **line)
        styled_figure.draw_title(ax, *words_of(self.surface.domain.projection, title, below=self.below))

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
    projection: projections.ProjectionLike,
    radius_km: float,
    *,
    region: regions.RegionLike | None = None,
    step: float | None = None,
    colourbar: bool = True,
    title: str | None = None,
) -> ColourScale:
    """Draw the local corrections over caps of `radius_km` on `ax`; returns the colour scale.

    They stand `step` degrees apart. A disc's colour is the correction's scale, or its stretch where all scales are the
    same; a line lies in the direction that is stretched most, its length the logarithm of the stretch.
    """
    support.check_instance("axes", ax, Axes, "Axes of matplotlib")
    field = LocalField.of(surfaces.surface_of(projection, region), radius_km, step)
    field.draw(ax, title)
    if colourbar:
        draw_bar_below(ax, field.scale)
    return field.scale
