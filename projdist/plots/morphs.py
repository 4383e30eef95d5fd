"""Animations of one map that turns into another: points of both, cut wherever either map is cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib import colors, tri
from matplotlib.animation import FFMpegWriter
from PIL import Image

from projdist import earth, field, matrices, projections, regions, support, surfaces
from projdist._typing import AnyArray, AnyPath, BoolArray, FloatArray, IntArray
from projdist.plots import map_drawing, styled_figure
from projdist.plots.colours import ColourScale
from projdist.plots.style import Look, look_for
from projdist.plots.styled_figure import FigureStyle, StyledFigure, add_lines, scale_for
from projdist.projections import Projection

_POLE = 89.9  # degrees: nearer to a pole maps may be singular
_STRAIGHT = np.radians(2.0)  # a turn that is less is none
_SHRUNK = 0.02  # of the longest edge: shorter ones are of a line that becomes a pole
_CLOSED = 0.4  # of an edge: sides of a cut as near to each other as that
_SPANNING = 0.1  # of the width of a map
_COARSE = 40  # points a side
_ROUNDS = 3  # of filling what is undefined from its neighbours


@dataclass(frozen=True)
class Track:
    """Points (n, 2) in metres on both maps."""

    first: FloatArray
    second: FloatArray


@dataclass(frozen=True)
class Blend:
    """Vertices and triangles of both maps, Jacobians (n, 2, 2) there, and the lines that are drawn."""

    maps: tuple[Projection, Projection]
    region: regions.Place
    vertices: Track
    jacobians: tuple[FloatArray, FloatArray]
    weights: FloatArray
    triangles: IntArray
    edges: IntArray
    graticule: list[Track]
    coast: list[Track]
    turn: float  # radians by which the second map lies on the first as well as it can; it turns back on the way

    def at(self, share: float, track: Track) -> FloatArray:
        """Points (n, 2) at a fraction of the way."""
        way = (1.0 - share) * track.first + share * track.second @ _rotation(self.turn).T
        return way @ _rotation(-share * self.turn).T

    def values(self, share: float, measure: matrices.Measure) -> FloatArray:
        """Measure (n,) of the interpolated Jacobians."""
        first, second = self.jacobians
        return measure(_rotation(-share * self.turn) @ ((1.0 - share) * first + share * _rotation(self.turn) @ second))


def blend_of(first: Projection, second: Projection, region: regions.Place) -> Blend:
    """Blend of two maps; raises ValueError if they have nothing in common."""
    turn = _turn(first, second, region)
    cos, sin = np.cos(turn), np.sin(turn)

    def between(lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        # Uneven fractions, so that no cut of one map closes a cut of the other.
        (x, y), (p, q) = first(lon, lat), second(lon, lat)
        return 0.55 * x + 0.45 * (cos * p - sin * q), 0.55 * y + 0.45 * (sin * p + cos * q)

    both = Projection.from_function(between, name=f"{first.name} and {second.name}", ellipsoid=first.ellipsoid)
    surface = surfaces.surface_of(both, region)
    lon, lat = surface.lonlat_off_seams()
    vertices = Track(np.column_stack(first(lon, lat)), np.column_stack(second(lon, lat)))
    there = np.asarray(np.isfinite(np.hstack([vertices.first, vertices.second])).all(axis=1))
    triangles = surface.triangles[there[surface.triangles].all(axis=1)]
    triangles = triangles[~(_spans(vertices.first, triangles) | _spans(vertices.second, triangles))]
    used = np.zeros(there.size, dtype=bool)
    used[triangles] = True
    weights = np.zeros(there.size)
    weights[: surface.nodes] = surface.weights
    weights[~used | ~there] = 0.0
    bounds = region.bounds
    resolution = "110m" if max(surfaces.ground_size(bounds)) > 60.0 else "50m"
    shore = [] if first.is_of_another_body else surfaces.coast(bounds, resolution)
    grid = surfaces.graticule(bounds, *surfaces.graticule_steps(bounds))
    return Blend(
        maps=(first, second),
        region=region,
        vertices=vertices,
        jacobians=(_filled(first, lon, lat, triangles), _filled(second, lon, lat, triangles)),
        weights=weights,
        triangles=triangles,
        edges=surfaces.rim_edges(triangles),
        graticule=_tracks(surface, grid, first, second),
        coast=_tracks(surface, shore, first, second),
        turn=turn,
    )


def _rotation(angle: float) -> FloatArray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _turn(first: Projection, second: Projection, region: regions.Place) -> float:
    """The angle by which the second map lies best on the first (Procrustes)."""
    west, south, _, north = region.bounds
    u = west + (np.mod(region.bounds[2] - west - 1e-9, 360.0) + 1e-9) * (np.arange(_COARSE) + 0.5) / _COARSE
    v = np.linspace(south, north, _COARSE + 2)[1:-1]
    lon, lat = (one.ravel() for one in np.meshgrid(earth.wrapped(u), v))
    one, other = (np.column_stack(projection(lon, lat)) for projection in (first, second))
    kept = np.isfinite(one + other).all(axis=1) & region.contains(lon, lat)
    if not kept.any():
        return 0.0
    w = np.cos(np.radians(lat[kept]))
    one, other = (points[kept] - w @ points[kept] / w.sum() for points in (one, other))
    angle = float(np.arctan2(w @ (other[:, 0] * one[:, 1] - other[:, 1] * one[:, 0]), w @ (other * one).sum(axis=1)))
    return angle if abs(angle) > _STRAIGHT else 0.0


def _filled(projection: Projection, lon: FloatArray, lat: FloatArray, triangles: IntArray) -> FloatArray:
    """Jacobians at points; undefined ones, as at a pole, are means of their neighbours."""
    J = np.full((lon.size, 2, 2), np.nan)
    inner = np.isfinite(lon) & (np.abs(lat) < _POLE)
    J[inner] = field.jacobian(projection, lon[inner], lat[inner])
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    for _ in range(_ROUNDS):
        missing = ~np.isfinite(J).all(axis=(1, 2))
        useful = pairs[missing[pairs[:, 0]] & ~missing[pairs[:, 1]]]
        if not len(useful):
            break
        count = np.bincount(useful[:, 0], minlength=len(J))
        total = np.zeros_like(J)
        np.add.at(total, useful[:, 0], J[useful[:, 1]])
        J[count > 0] = total[count > 0] / count[count > 0][:, None, None]
    return J


def _spans(xy: FloatArray, triangles: IntArray) -> BoolArray:
    """True for triangles that span a map, left over where many cuts meet at a point."""
    corners = xy[triangles]
    longest = np.hypot(*(corners - corners[:, [1, 2, 0]]).reshape(-1, 2).T).reshape(-1, 3).max(axis=1)
    size = np.ptp(corners.reshape(-1, 2), axis=0).max() if len(corners) else 0.0
    return np.asarray((longest > _SPANNING * size) & (longest > 10.0 * np.median(longest)))


def open_edges(xy: FloatArray, edges: IntArray) -> IntArray:
    """Rim edges without those of closed cuts, which have another edge, sharing no end, beside their middle."""
    ends = xy[edges]
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    near = _CLOSED * float(np.median(lengths[lengths >= _SHRUNK * lengths.max()]))
    middles, tree = shapely.points(ends.mean(axis=1)), shapely.STRtree(shapely.linestrings(ends))
    edge, other = tree.query(middles, predicate="dwithin", distance=near)
    apart = (edges[edge][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2))
    closed = np.zeros(len(edges), dtype=bool)
    closed[edge[apart]] = True
    return edges[~closed]


def _tracks(
    surface: surfaces.Surface, lines: Sequence[FloatArray], first: Projection, second: Projection
) -> list[Track]:
    """Lines of (lon, lat) on both maps, split where either map is cut."""
    if not lines:
        return []
    domain = surface.domain
    line = np.repeat(np.arange(len(lines)), [len(points) for points in lines])
    points = surfaces.cut_at_tears(domain, field.evaluate(domain, *np.concatenate(lines).T), line)
    there = field.drawn(points)
    lon, lat = earth.wrapped(np.where(there, points[:, 0], 0.0)), np.where(there, points[:, 1], 0.0)
    one, other = (np.column_stack(projection(lon, lat)) for projection in (first, second))
    there &= np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    return [Track(one[run], other[run]) for run in surfaces.runs(there)]


# ---- morphs --------------------------------------------------------------------------------------

ANIMATION_SUFFIXES = (".gif", ".mp4")

_SIZE, _DPI = (7.0, 4.6), 100.0
_TOP, _FOOT, _SIDE = 0.42, 0.62, 0.1  # inches
_HOLD = 0.8  # seconds at either end
_COLOURS, _DARKER, _GREYS = 120, 40, 24  # of a GIF, which has room for 256
_MOST_FRAMES, _LONGEST = 500, 600.0
_DOT = "#b2402a"

Progress = Callable[[int, int], Any]


def morph(
    first: projections.ProjectionLike,
    second: projections.ProjectionLike,
    path: AnyPath,
    *,
    measure: map_drawing.AnyMeasure = "fisher",
    region: regions.RegionLike | None = None,
    frames: int = 24,
    seconds: float = 4.0,
    size: tuple[float, float] = _SIZE,
    dpi: float = _DPI,
    overwrite: bool = True,
    progress: Progress | None = None,
    look: Look | str | None = None,
) -> Path:
    """Write an animation of a map that turns into another and back, in the colours of a measure.

    A point moves straight from its place on the one map to that on the other, which is turned on the way so that they
    match best. So the Jacobian, of which the colours are, is (1 - t) J_1 + t J_2. It is cut where either map is.

    Parameters
    ----------
    first, second : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    path : str or path
        A .gif, or, where there is ffmpeg, an .mp4.
    measure : str, Measure or callable, default "fisher"
        One that needs no second derivatives.
    region : RegionLike, optional
        The default is that of `compare`.
    frames : int, default 24
        Pictures on the way; the way back has the same.
    seconds : float, default 4
        Duration of the way there and back, without the rests at both ends.
    size : (float, float), default (7, 4.6)
        Width and height in inches.
    dpi : float, default 100
        Dots per inch.
    overwrite : bool, default True
        Whether a file may be replaced.
    progress : callable, optional
        Called with how many frames are drawn, and of how many.
    look : Look or str, optional
        The style, or the name of a theme. Its title is a heading; with "" the maps have no names. Frames are opaque.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ProjectionError, ValueError
        For an invalid projection; an invalid measure, region, size, number or suffix; an .mp4 without ffmpeg.
    FileExistsError
        For an existing file that may not be replaced.

    References
    ----------
    M. Bostock 2011, d3-geo-projection, "Projection Transitions": points on straight ways between two maps.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> folder = Path(tempfile.mkdtemp())
    >>> path = morph("robin", "moll", folder / "a.gif", region="box:0,0,60,60", frames=3, size=(3, 3), dpi=40)
    >>> path.read_bytes()[:6]
    b'GIF89a'
    """
    path, chosen = support.check_path("animation", path), matrices.get_measure(measure)
    suffix = path.suffix.lower()
    if suffix not in ANIMATION_SUFFIXES:
        raise ValueError(f"Invalid animation '{path}'. Its suffix must be .gif or .mp4.")
    if suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise ValueError(f"Invalid animation '{path}'. An .mp4 needs ffmpeg, which is not found; a .gif needs nothing.")
    if chosen.needs_hessian:
        raise ValueError(f"Invalid measure '{chosen.name}' for an animation. It must need no second derivatives.")
    count = support.check_whole_number("number of frames", frames)
    if not 2 <= count <= _MOST_FRAMES:
        raise ValueError(f"Invalid number of frames '{frames}'. It must be 2 to {_MOST_FRAMES}.")
    length = support.check_number("number of seconds", seconds)
    if not 0.1 <= length <= _LONGEST:
        raise ValueError(f"Invalid number of seconds '{seconds}'. It must be 0.1 to {_LONGEST:g}.")
    room = styled_figure.check_size(size) or _SIZE
    styled_figure.check_room(room[0] >= 1.0 and room[1] >= 1.5, room, "an animation")
    maps = Projection.from_user_input(first), Projection.from_user_input(second)
    blend = blend_of(*maps, regions.region_for(region, list(maps)))
    with support.replacing(path, overwrite=overwrite) as new:
        look = replace(look_for(look), transparent=False)
        with look.applied():
            stage = _Stage(blend, chosen, room, styled_figure.check_dpi(dpi), look)
            if suffix == ".gif":
                _write_gif(new, stage.pictures(count, progress), _palette(stage.scale, look), length)
            else:
                _write_mp4(new, stage, count, length, progress)
    return path


def eased(count: int) -> FloatArray:
    """Fractions of the way from 0 to 1, slow at both ends."""
    return 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, count))


class _Stage:
    """Figure that shows a blend at any fraction of the way."""

    def __init__(
        self, blend: Blend, measure: matrices.Measure, size: tuple[float, float], dpi: float, look: Look
    ) -> None:
        self.blend, self.measure = blend, measure
        values = [blend.values(share, measure) for share in (0.0, 0.5, 1.0)]
        self.scale = ColourScale.of(measure, values, [blend.weights] * len(values), colours=look.colours)
        letters = scale_for(look, size)
        style = FigureStyle(look, letters, has_heading=True)
        width, height = style.content(size)
        self.figure = StyledFigure(style, (width, height), dpi)
        self.canvas: Any = self.figure.canvas
        top = letters * _TOP if look.has_titles else _SIDE
        foot = letters * _FOOT if look.colourbar else _SIDE
        across, up = width - 2.0 * _SIDE, height - top - foot
        self.ax = self.figure.panel(_SIDE, foot, across, up)
        self.ax.set_axis_off()
        self.shape = across / up
        colours = look.colours
        styles = ((colours.over_graticule, 0.4, 1.0), (colours.over_coast, 0.6, 1.2), (colours.outline, 0.8, 3.0))
        self.lines = [add_lines(self.ax, [], colors=one, linewidths=line, zorder=order) for one, line, order in styles]
        self.field: Any = None
        self.dot: Any = None
        if look.has_titles:
            self._draw_titles()
        if look.colourbar:
            bar = min(0.6 * width, 4.5)
            place = self.figure.panel(0.5 * (width - bar), letters * 0.42, bar, letters * 0.11)
            drawn_bar = map_drawing.draw_colourbar(self.figure, self.scale, cax=place)
            drawn_bar.set_label(f"{self.scale.label}{styled_figure.over(blend.region)}", fontsize=letters * 8)

    def _draw_titles(self) -> None:
        """Draw the names of both maps, and a dot that moves between them, in a strip with coordinates in inches."""
        figure, style = self.figure, self.figure.style
        width, height = figure.content
        strip = figure.panel(0.0, 0.0, width, height, zorder=5)
        strip.set_axis_off()
        strip.patch.set_alpha(0.0)
        strip.set(xlim=(0, width), ylim=(0, height))
        size, self.height = style.scale * 10.0, height - style.scale * 0.2
        ends = zip((0.15, width - 0.15), self.blend.maps, ("left", "right"), strict=True)
        look: dict[str, Any] = {"va": "center", "fontsize": size, "color": style.colours.text}
        names = [strip.text(x, self.height, one.name, ha=side, **look) for x, one, side in ends]
        wider = max(name.get_window_extent().width for name in names) / figure.dpi
        for name in names:
            name.set_fontsize(size * min(1.0, 0.4 * width / max(wider, 1e-3)))
        left, right = (name.get_window_extent().width / figure.dpi for name in names)
        self.way = 0.3 + left, width - 0.3 - right
        strip.plot(self.way, (self.height, self.height), color=style.colours.graticule, linewidth=1.0)
        (self.dot,) = strip.plot([], [], "o", color=_DOT, markersize=5.0)

    def draw(self, share: float) -> None:
        """Draw the blend at a fraction of the way."""
        blend, ax = self.blend, self.ax
        xy = blend.at(share, blend.vertices)
        values = blend.values(share, self.measure)
        used = np.zeros(len(xy), dtype=bool)
        used[blend.triangles] = True
        if self.field is not None:
            self.field.remove()
        x, y = np.where(used[:, None], xy, xy[used][0]).T
        mapped = tri.Triangulation(x, y, blend.triangles)
        missing = ~np.isfinite(values)
        mapped.set_mask(missing[blend.triangles].any(axis=1))
        shades: dict[str, Any] = {"norm": self.scale.norm, "cmap": self.scale.colours, "shading": "gouraud"}
        self.field = ax.tripcolor(mapped, np.where(missing, self.scale.limits[0], values), zorder=0.5, **shades)
        grid, shore, outline = self.lines
        grid.set_segments([blend.at(share, track) for track in blend.graticule])
        shore.set_segments([blend.at(share, track) for track in blend.coast])
        outline.set_segments(list(xy[open_edges(xy, blend.edges)]))
        # The whole map in the middle of the axes, with equal scales.
        low, high = xy[used].min(axis=0), xy[used].max(axis=0)
        middle, half = 0.5 * (low + high), 0.51 * (high - low)
        half_width = max(half[0], half[1] * self.shape)
        ax.set_xlim(middle[0] - half_width, middle[0] + half_width)
        ax.set_ylim(middle[1] - half_width / self.shape, middle[1] + half_width / self.shape)
        if self.dot is not None:
            self.dot.set_data([self.way[0] + share * (self.way[1] - self.way[0])], [self.height])

    def pictures(self, count: int, progress: Progress | None) -> Iterator[AnyArray]:
        """Frames (height, width, 3) of the way there."""
        for number, share in enumerate(eased(count), start=1):
            self.draw(float(share))
            self.canvas.draw()
            yield np.asarray(self.canvas.buffer_rgba())[..., :3].copy()
            if progress is not None:
                progress(number, count)


def _palette(scale: ColourScale, look: Look) -> Image.Image:
    """Palette: colours of the scale, also under lines, of background to text, and of the dot."""
    bright = scale.colours(np.linspace(0.0, 1.0, _COLOURS))[:, :3]
    dark = 0.75 * scale.colours(np.linspace(0.0, 1.0, _DARKER))[:, :3]
    ends = (colors.to_rgb(look.colours.background), colors.to_rgb(look.colours.text))
    grey = np.linspace(*ends, _GREYS)
    dot = np.array([colors.to_rgb(_DOT)])
    pixels = np.concatenate([bright, dark, grey, dot, 0.5 * dot + 0.5 * grey[:1]])
    image = Image.new("P", (1, 1))
    image.putpalette((255.0 * pixels).round().astype(np.uint8).ravel().tolist())
    return image


def _write_gif(path: Path, pictures: Iterator[AnyArray], palette: Image.Image, seconds: float) -> None:
    """Write an endless loop there and back, with rests; a common palette avoids flicker."""
    there = [Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE) for pixels in pictures]
    step = max(20.0, 1e3 * seconds / (2 * (len(there) - 1)))
    durations = [step] * (2 * len(there) - 2)
    durations[0] = durations[len(there) - 1] = 1e3 * _HOLD
    others: dict[str, Any] = {"append_images": [*there[1:], *there[-2:0:-1]], "duration": [*map(round, durations)]}
    there[0].save(path, format="GIF", save_all=True, loop=0, optimize=False, **others)


def _write_mp4(path: Path, stage: _Stage, count: int, seconds: float, progress: Progress | None) -> None:
    """Write the way there and back once, with rests."""
    rate = max(1, round(2 * (count - 1) / seconds))
    rest = max(1, round(_HOLD * rate))
    shares = eased(count)
    both = [*([0.0] * rest), *shares, *([1.0] * rest), *shares[-2::-1]]
    even = ["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]
    writer = FFMpegWriter(fps=rate, codec="h264", extra_args=even)
    with writer.saving(stage.figure, str(path), stage.figure.dpi):
        for number, share in enumerate(both, start=1):
            stage.draw(float(share))
            writer.grab_frame()
            if progress is not None:
                progress(number, len(both))
