"""Land, lakes, countries, states of the USA, their borders, and cities, from the shipped data."""

import csv
import functools
import importlib.resources
import io
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray, IntArray, NDArray
from projdist.earth.ellipsoid import unit_vectors

_HALF_TURN, _TURN = 180.0, 360.0
_HALVINGS = 20  # of an interval, after which a curve that is not smooth is left as it is
# Of a curve's size: the largest distance from its chords, and the distance up to which no area is corrected.
_NEAR, _NOTHING = 1e-5, 1e-10
# GEOS divides by zero where edges touch, and handles that; NumPy would warn.
GEOS_ARITHMETIC = np.errstate(divide="ignore", invalid="ignore", over="ignore")


def unwrapped(ring: FloatArray) -> FloatArray:
    """The ring with continuous longitudes across the antimeridian: each edge goes the shorter way."""
    if (np.abs(np.diff(ring[:, 0])) < _HALF_TURN).all():
        return ring
    return np.column_stack([np.unwrap(ring[:, 0], period=_TURN), ring[:, 1]])


def beside(hole: FloatArray, shell: FloatArray) -> FloatArray:
    """A hole moved by full turns to the longitudes of its shell."""
    turns = np.ceil((shell[:, 0].min() - hole[:, 0].min()) / _TURN)
    return np.asarray(hole + np.array([_TURN * turns, 0.0]))


def closed_round_pole(ring: FloatArray) -> FloatArray:
    """A ring around a pole closed along that pole; other rings unchanged."""
    if not goes_round(ring):
        return ring
    turn = np.array([ring[-1, 0] - ring[0, 0], 0.0])
    pole = 90.0 if ring[:, 1].mean() > 0 else -90.0
    # Start at the vertex nearest to the pole, so that the path to the pole does not cross the ring.
    first = int(np.argmin(np.abs(pole - ring[:-1, 1])))
    ring = np.concatenate([ring[first:-1], ring[: first + 1] + turn])
    return np.concatenate([ring, [[ring[-1, 0], pole], [ring[0, 0], pole]]])


def goes_round(ring: FloatArray) -> bool:
    """True if a ring of unwrapped longitudes encloses a pole."""
    return bool(abs(ring[-1, 0] - ring[0, 0]) >= _HALF_TURN)


def cut_at_antimeridian(polygon: shapely.Geometry) -> Iterator[shapely.Polygon]:
    """The parts of a valid polygon of unwrapped longitudes, each moved to -180 .. 180."""
    west, _, east, _ = polygon.bounds
    for turn in range(int(np.floor((west + _HALF_TURN) / _TURN)), int(np.ceil((east + _HALF_TURN) / _TURN))):
        window = shapely.box(-180.0 + _TURN * turn, -90.0, 180.0 + _TURN * turn, 90.0)
        inside = polygon if window.covers(polygon) else shapely.intersection(polygon, window)
        # make_valid may return collections of polygons and lines: parts of parts.
        for part in shapely.get_parts(shapely.get_parts(inside)):
            if isinstance(part, shapely.Polygon) and part.area > 0:
                yield shapely.transform(part, lambda xy, shift=_TURN * turn: xy - [shift, 0.0]) if turn else part


@GEOS_ARITHMETIC
def merged(parts: Sequence[shapely.Geometry]) -> shapely.MultiPolygon:
    """Union of polygons as one valid multi-polygon."""
    union = shapely.union_all(list(parts))
    return shapely.MultiPolygon([part for part in shapely.get_parts(union) if isinstance(part, shapely.Polygon)])


def planar(rings: Sequence[FloatArray]) -> shapely.Polygon:
    """A shell and its holes as a polygon of unwrapped longitudes, possibly invalid."""
    # A ring that has no area if its edges go the shorter way is a band round the Earth, and stays as given.
    shell, *holes = rings
    ring = closed_round_pole(unwrapped(shell))
    if np.ptp(ring[:, 0]) == 0.0 or abs(signed_area(ring)) < 1e-12 * abs(signed_area(shell)):
        ring = shell
    return shapely.Polygon(ring, [beside(unwrapped(hole), ring) for hole in holes])


@GEOS_ARITHMETIC
def even_odd(rings: Sequence[FloatArray]) -> shapely.Geometry:
    """The points inside an odd number of rings, as polygons within -180 .. 180."""
    # A hole that leaves its shell then adds its outer part, as in GIS programs.
    parts = [merged(list(cut_at_antimeridian(shapely.make_valid(planar([ring]))))) for ring in rings]
    return functools.reduce(shapely.symmetric_difference, parts)


def signed_area(ring: FloatArray) -> float:
    """Area of a closed ring in the plane, positive if anticlockwise."""
    x, y = (ring - ring[0]).T
    return float(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""A function from parameters t to longitudes and latitudes in degrees; closed curves end at their start."""


def chords(curve: Curve, t: FloatArray, tolerance: float) -> FloatArray:
    """Points (m, 2) of a polygon within `tolerance` degrees of a curve that has its area to fourth order."""
    # `t` are the first parameters. Intervals are halved until their middles are no farther from their chords than the
    # tolerance and 1e-5 of the curve's size. Then each middle is moved to 4/3 of its distance from the chord, so that
    # the triangle has the area under the curve by Simpson's rule.
    lon, lat = curve(t)
    size = float(np.degrees(np.ptp(unit_vectors(lon, lat), axis=1).max()))  # degrees of arc
    nearest = min(tolerance, _NEAR * size)
    middles = np.full((t.size - 1, 2), np.nan)
    new = np.arange(t.size - 1)
    for _ in range(_HALVINGS):
        if not new.size:
            break
        middle = 0.5 * (t[new] + t[new + 1])
        lon_m, lat_m = curve(middle)
        # Distance of the curve's middle from the chord's, modulo turns of longitude. Where the curve is undefined, as
        # between defined places of a CRS, the chord stays.
        lon_m, lat_m = (np.where(np.isfinite(values), values, np.nan) for values in (lon_m, lat_m))
        east = 0.5 * (np.mod(2.0 * lon_m - lon[new] - lon[new + 1] + 180.0, 360.0) - 180.0)
        north = lat_m - 0.5 * (lat[new] + lat[new + 1])
        off = np.hypot(east * np.cos(np.radians(lat_m)), north)
        middles[new] = np.column_stack([lon_m + east / 3.0, lat_m + north / 3.0])
        middles[new[off <= _NOTHING * size]] = np.nan
        split = off > nearest
        at = new[split] + 1
        middles[at - 1] = np.nan
        t = np.insert(t, at, middle[split])
        lon, lat = np.insert(lon, at, lon_m[split]), np.insert(lat, at, lat_m[split])
        middles = np.insert(middles, at, np.nan, axis=0)
        halves = at + np.arange(at.size)
        new = np.sort(np.concatenate([halves - 1, halves]))
    moved = np.flatnonzero(np.isfinite(middles[:, 0]))
    return np.insert(np.column_stack([lon, lat]), moved + 1, middles[moved], axis=0)


# ---- TopoJSON ------------------------------------------------------------------------------------

POLE_CAP = 89.99  # degrees: a ring beyond is no coast, but closes Antarctica


class Outline(NamedTuple):
    """Polygons of a country or state, or of all land or lakes, as lists of rings of arcs; ~i is arc i backwards."""

    key: str
    polygons: list[list[list[int]]]

    @property
    def arcs(self) -> set[int]:
        """Indices of its arcs, without direction."""
        return {max(index, ~index) for rings in self.polygons for ring in rings for index in ring}


Topology = tuple[list[Outline], list[FloatArray]]
"""Outlines, and their shared arcs in degrees."""


@functools.cache
def _file(name: str) -> tuple[dict[str, list[Outline]], list[FloatArray]]:
    """Outlines by object, and arcs, of a shipped file: TopoJSON, packed by tools/make_outlines.py."""
    file = importlib.resources.files("projdist") / "data" / f"{name}.npz"
    with np.load(io.BytesIO(file.read_bytes())) as packed:  # steps with the sign in the lowest bit, as planes of bytes
        unsigned = np.ascontiguousarray(packed["steps"].transpose(2, 1, 0)).view("<u4")[..., 0].astype(np.int64)
        ends, scale, origin = np.cumsum(packed["sizes"]), packed["scale"], packed["origin"]
        objects = json.loads(packed["objects"].tobytes())
    steps = np.split(np.where(unsigned % 2, -(unsigned + 1) // 2, unsigned // 2), ends[:-1])
    outlines = {}
    for name, shapes in objects.items():
        keys = [str(one.get("id") or one.get("properties", {}).get("name")) for one in shapes]
        polygons = (one["arcs"] if one["type"] == "MultiPolygon" else [one["arcs"]] for one in shapes)
        outlines[name] = [*map(Outline, keys, polygons)]
    return outlines, [np.cumsum(arc, axis=0) * scale + origin for arc in steps]


def topology(what: str, resolution: str) -> Topology:
    """The outlines of "land", "lakes", "countries" or, at 10m, "states"; raises ValueError."""
    allowed = RESOLUTIONS[:2] if what == "lakes" else RESOLUTIONS
    if resolution not in allowed:
        raise ValueError(f"Invalid resolution '{resolution}'. It must be one of {', '.join(allowed)}.")
    file = "countries" if (what, resolution) == ("land", "10m") else what
    outlines, arcs = _file(f"{file}-{resolution}")
    return outlines[what], arcs


@GEOS_ARITHMETIC
def decoded(outlines: Iterable[Outline], arcs: Sequence[FloatArray]) -> shapely.MultiPolygon:
    """Outlines as plane polygons, cut at the antimeridian and closed along the poles."""
    valid = (one if one.is_valid else shapely.make_valid(one) for one in as_stored(outlines, arcs))
    # Polygons that share an edge at the antimeridian are valid only when merged.
    return merged([part for one in valid for part in cut_at_antimeridian(one)])


def as_stored(outlines: Iterable[Outline], arcs: Sequence[FloatArray]) -> Iterator[shapely.Polygon]:
    """The polygons of outlines, closed along the poles, with unwrapped longitudes; some cross themselves."""
    for rings in (rings for one in outlines for rings in one.polygons):
        lines = ([arcs[index] if index >= 0 else arcs[~index][::-1] for index in ring] for ring in rings)
        points = [unwrapped(np.concatenate([first, *(line[1:] for line in rest)])) for first, *rest in lines]
        # A tiny ring round the pole may precede Antarctica's coast as if it were the shell.
        shell, *holes = (ring for ring in points if np.abs(ring[:, 1]).min() < POLE_CAP)
        yield shapely.Polygon(closed_round_pole(shell), [beside(hole, shell) for hole in holes])


# ---- Natural Earth -------------------------------------------------------------------------------

RESOLUTIONS = ("110m", "50m", "10m")
"""Scales of the data as millionths: for the world, for parts of it, and for small countries."""

Bounds = tuple[float, float, float, float]

_MARGIN = 0.5  # degrees: the gap between arcs and the antimeridian is smaller


@functools.cache
def land(resolution: str = "110m") -> shapely.MultiPolygon:
    """The land as polygons in degrees, longitudes -180 to 180; 10m takes some seconds."""
    return decoded(*topology("land", resolution))


@GEOS_ARITHMETIC
def polygons_within(what: str, bounds: Bounds, resolution: str) -> shapely.MultiPolygon:
    """The "land" or "lakes" within W, S, E, N in degrees, E perhaps above 180; 10m takes 0.2 s, later some ms."""
    polygons = _stored(what, resolution)
    west, south, east, north = bounds
    parts: list[shapely.Polygon] = []
    w, s, e, n = shapely.bounds(polygons).T
    for turn in (-360.0, 0.0, 360.0):
        window = west + turn, south, east + turn, north
        touching = (w < window[2]) & (e > window[0]) & (s < north) & (n > south)
        # Self-crossing rings take seconds to repair as a whole; few cross inside a small window.
        clipped = shapely.make_valid(shapely.clip_by_rect(polygons[touching], *window))
        parts.extend(part for one in clipped if not one.is_empty for part in cut_at_antimeridian(one))
    return merged(parts)


@functools.cache
def _stored(what: str, resolution: str) -> NDArray[np.object_]:
    return np.array(list(as_stored(*topology(what, resolution))))


@functools.cache
def lakes(resolution: str = "50m") -> shapely.MultiPolygon:
    """Lakes, but not the Caspian Sea, without islands, as polygons in degrees, longitudes -180 to 180; 110m or 50m."""
    # At 50m vertices are accurate to 2 km for 253 lakes and to 4 km for 22; Tanganyika and Balkhash are those of 110m.
    return decoded(*topology("lakes", resolution))


@functools.cache
def country(key: str, resolution: str = "50m") -> shapely.MultiPolygon | None:
    """The polygons of a country by numeric ISO code, or name if it has none; None if it is too small for the data."""
    outlines, arcs = topology("countries", resolution)
    found = [decoded([one], arcs) for one in outlines if one.key == key]
    return merged(found) if len(found) > 1 else next(iter(found), None)


def near(outline: shapely.MultiPolygon, lon: FloatArray, lat: FloatArray, degrees: float) -> BoolArray:
    """True for points in degrees, longitudes -180 to 180, that lie within `degrees` of an outline."""
    return np.asarray(shapely.dwithin(outline, shapely.points(lon, lat), degrees), dtype=bool)


def countries_about(lon: FloatArray, lat: FloatArray) -> dict[str, BoolArray]:
    """Masks of the points in the box of each country that has any, by key, the smallest box first."""
    within = ((key, (lon >= w) & (lon <= e) & (lat >= s) & (lat <= n)) for key, (w, s, e, n) in _boxes().items())
    return {key: points for key, points in within if points.any()}


@functools.cache
def _boxes() -> dict[str, FloatArray]:
    """West, south, east, north of countries with a margin; of one cut by the antimeridian all longitudes."""
    outlines, arcs = topology("countries", "50m")
    starts = np.cumsum([0, *map(len, arcs[:-1])])
    low, high = (end.reduceat(np.concatenate(arcs), starts) for end in (np.minimum, np.maximum))
    used: dict[str, list[int]] = {}
    for one in outlines:
        used.setdefault(one.key, []).extend(one.arcs)
    boxes = {key: np.append(low[n].min(axis=0) - _MARGIN, high[n].max(axis=0) + _MARGIN) for key, n in used.items()}
    return dict(sorted(boxes.items(), key=lambda item: float(np.prod(item[1][2:] - item[1][:2]))))


@functools.cache
def coastlines(resolution: str = "110m") -> tuple[FloatArray, ...]:
    """Coastlines (n, 2) of longitudes, continuous across the antimeridian, and latitudes in degrees."""
    return tuple(part for arc in _arcs("land", resolution) for part in _without_cuts(arc))


@functools.cache
def shores(resolution: str = "50m") -> tuple[FloatArray, ...]:
    """Shores of lakes and of their islands, in the form of `coastlines`."""
    lines = _arcs("lakes", resolution)
    places = [line[:, 0] + 1j * line[:, 1] for line in lines]
    edges = np.concatenate([np.sort(np.column_stack([line[:-1], line[1:]]), axis=1) for line in places])
    # An edge in two rings separates two parts of one lake.
    _, which, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    inner = np.split(count[which.ravel()] > 1, np.cumsum([len(line) - 1 for line in lines])[:-1])
    return tuple(part for line, left_out in zip(lines, inner, strict=True) for part in _kept(line, left_out))


def _arcs(what: str, resolution: str) -> list[FloatArray]:
    """Arcs of land or lakes."""
    (outline,), arcs = topology(what, resolution)
    return [arcs[index] for index in sorted(outline.arcs)]


@functools.cache
def borders(resolution: str = "50m") -> tuple[tuple[frozenset[str], FloatArray], ...]:
    """The keys of two countries, as for `country`, and an arc that they share, in the form of `coastlines`."""
    outlines, arcs = topology("countries", resolution)
    users: dict[int, set[str]] = {}
    for one in outlines:
        for index in one.arcs:
            users.setdefault(index, set()).add(one.key)
    shared = ((frozenset(keys), arcs[index]) for index, keys in sorted(users.items()) if len(keys) > 1)
    return tuple((keys, part) for keys, arc in shared for part in _without_cuts(arc))


_ON_CUT = 1e-6  # degrees from the antimeridian


def _without_cuts(arc: FloatArray) -> Iterator[FloatArray]:
    """Pieces of an arc without edges along the antimeridian and round a pole."""
    if np.abs(arc[:, 0]).max() < 180.0 - _ON_CUT and np.abs(arc[:, 1]).max() < POLE_CAP:
        yield arc
        return
    line = unwrapped(arc)
    on_cut = np.abs(np.abs(arc[:, 0]) - 180.0) < _ON_CUT
    artificial = (on_cut[1:] & on_cut[:-1]) | (np.abs(line[1:, 1]) > POLE_CAP)
    yield from _kept(line, artificial)


def _kept(line: FloatArray, left_out: BoolArray) -> Iterator[FloatArray]:
    """The pieces of a line that are left without the edges in a mask."""
    for piece in np.split(np.arange(len(left_out)), np.flatnonzero(np.diff(left_out)) + 1):
        if piece.size and not left_out[piece[0]]:
            yield line[piece[0] : piece[-1] + 2]


def state_outline(fips: str) -> shapely.MultiPolygon:
    """The polygons of a state, the District of Columbia or a territory by its FIPS code, at 1 : 10 million."""
    outlines, arcs = topology("states", "10m")
    return decoded((one for one in outlines if one.key == fips), arcs)


@dataclass(frozen=True, kw_only=True, eq=False)
class Cities:
    """Cities as columns, ordered by population times the number of names in other languages."""

    name: NDArray[np.str_]  # English if there is an English name, else local with accents
    lon: FloatArray  # degrees, to 0.001, -180 to 180
    lat: FloatArray
    population: IntArray
    country: NDArray[np.str_]  # ISO 3166 codes of two letters, also of territories (GF for French Guiana)
    is_capital: BoolArray  # of the country or territory


@functools.cache
def cities() -> Cities:
    """Capitals, and towns apart from better-known ones; from GeoNames (https://www.geonames.org), CC BY 4.0."""
    # The distance is 12 km for 100,000 people or more, 25 for 15,000, 80 for fewer: no suburbs, but remote villages.
    file = importlib.resources.files("projdist") / "data" / "cities.csv"
    _, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    name, lon, lat, population, country, capital = map(np.array, zip(*rows, strict=True))
    lon, lat, population = lon.astype(float), lat.astype(float), population.astype(int)
    return Cities(name=name, lon=lon, lat=lat, population=population, country=country, is_capital=capital == "1")
