"""Land, lakes, countries, states of the USA and the lines between them, from the data shipped with the package."""

from __future__ import annotations

import functools
import importlib.resources
import io
import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import BoolArray, FloatArray
from projdist.earth.places import data_rows

_HALF_TURN, _TURN = 180.0, 360.0
_HALVINGS = 20  # of an interval: a curve that is not smooth is left alone
# Shares of a curve's size: by how much its chords may leave it (their areas are corrected), and what need not be.
_NEAR, _NOTHING = 1e-5, 1e-10
# GEOS divides by nothing where edges touch, knows it, and numpy would tell.
GEOS_ARITHMETIC = np.errstate(divide="ignore", invalid="ignore", over="ignore")


def unwrapped(ring: FloatArray) -> FloatArray:
    """The same points with longitudes that run on across the antimeridian: each edge goes the shorter way."""
    if (np.abs(np.diff(ring[:, 0])) < _HALF_TURN).all():
        return ring
    return np.column_stack([np.unwrap(ring[:, 0], period=_TURN), ring[:, 1]])


def beside(hole: FloatArray, shell: FloatArray) -> FloatArray:
    """The hole, moved by whole turns to the longitudes of its shell."""
    turns = np.ceil((shell[:, 0].min() - hole[:, 0].min()) / _TURN)
    return np.asarray(hole + np.array([_TURN * turns, 0.0]))


def closed_round_pole(ring: FloatArray) -> FloatArray:
    """A ring that goes once round a pole, closed along that pole; other rings as they are."""
    if not goes_round(ring):
        return ring
    turn = np.array([ring[-1, 0] - ring[0, 0], 0.0])
    pole = 90.0 if ring[:, 1].mean() > 0 else -90.0
    # From the vertex that is nearest to the pole, so that the way there crosses nothing of the ring.
    first = int(np.argmin(np.abs(pole - ring[:-1, 1])))
    ring = np.concatenate([ring[first:-1], ring[: first + 1] + turn])
    return np.concatenate([ring, [[ring[-1, 0], pole], [ring[0, 0], pole]]])


def goes_round(ring: FloatArray) -> bool:
    """Whether a ring of unwrapped longitudes goes round a pole."""
    return bool(abs(ring[-1, 0] - ring[0, 0]) >= _HALF_TURN)


def cut_at_antimeridian(polygon: shapely.Geometry) -> Iterator[shapely.Polygon]:
    """The parts of a valid polygon of unwrapped longitudes, each moved to -180 .. 180."""
    west, _, east, _ = polygon.bounds
    for turn in range(int(np.floor((west + _HALF_TURN) / _TURN)), int(np.ceil((east + _HALF_TURN) / _TURN))):
        window = shapely.box(-180.0 + _TURN * turn, -90.0, 180.0 + _TURN * turn, 90.0)
        inside = polygon if window.covers(polygon) else shapely.intersection(polygon, window)
        # What was made valid may be polygons beside lines: parts of parts.
        for part in shapely.get_parts(shapely.get_parts(inside)):
            if isinstance(part, shapely.Polygon) and part.area > 0:
                yield shapely.transform(part, lambda xy, shift=_TURN * turn: xy - [shift, 0.0]) if turn else part


@GEOS_ARITHMETIC
def merged(parts: Sequence[shapely.Geometry]) -> shapely.MultiPolygon:
    """Polygons as one valid multi-polygon, in which what overlaps counts once."""
    union = shapely.union_all(list(parts))
    return shapely.MultiPolygon([part for part in shapely.get_parts(union) if isinstance(part, shapely.Polygon)])


def planar(rings: Sequence[FloatArray]) -> shapely.Polygon:
    """A shell and its holes as a polygon of unwrapped longitudes, perhaps not valid.

    A ring that is nothing but width when its edges go the shorter way is a band round the Earth, and taken as it is.
    """
    shell, *holes = rings
    ring = closed_round_pole(unwrapped(shell))
    if np.ptp(ring[:, 0]) == 0.0 or abs(signed_area(ring)) < 1e-12 * abs(signed_area(shell)):
        ring = shell
    return shapely.Polygon(ring, [beside(unwrapped(hole), ring) for hole in holes])


@GEOS_ARITHMETIC
def even_odd(rings: Sequence[FloatArray]) -> shapely.Geometry:
    """What is within an odd number of rings, as polygons within -180 .. 180.

    So a hole that leaves its shell adds what is outside, as GIS programs have it.
    """
    parts = [merged(list(cut_at_antimeridian(shapely.make_valid(planar([ring]))))) for ring in rings]
    return functools.reduce(shapely.symmetric_difference, parts)


def signed_area(ring: FloatArray) -> float:
    """Area of a closed ring in the plane, positive where it runs anticlockwise."""
    x, y = (ring - ring[0]).T
    return float(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Longitudes and latitudes in degrees at parameters t; they begin and end together on closed curves."""


def chords(curve: Curve, t: FloatArray, tolerance: float) -> FloatArray:
    """Points (m, 2) whose polygon leaves a curve by no more than `tolerance` degrees, and has its area to fourth order.

    `t` are parameters to begin with; intervals are halved until their middles are as near to their chords, and within
    1e-5 of the curve's size. Then a middle is moved out from its chord by a third, so that the triangle there has the
    area under the curve, by Simpson's rule.
    """
    lon, lat = curve(t)
    size = _size(lon, lat)
    nearest = min(tolerance, _NEAR * size)
    middles = np.full((t.size - 1, 2), np.nan)
    new = np.arange(t.size - 1)
    for _ in range(_HALVINGS):
        if not new.size:
            break
        middle = 0.5 * (t[new] + t[new + 1])
        lon_m, lat_m = curve(middle)
        # How far the middle is from the chord's, whatever turns the longitudes have.
        # Where the curve is not defined, as between places of a CRS that are, it stays a chord.
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


def _size(lon: FloatArray, lat: FloatArray) -> float:
    """The extent of points in degrees, wherever on the sphere they are."""
    lam, phi = np.radians(lon), np.radians(lat)
    space = np.column_stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])
    return float(np.degrees(np.ptp(space, axis=0).max()))


# ---- topojson ------------------------------------------------------------------------------------


Geometry = dict[str, Any]
"""A geometry as the file has it, with indices of arcs in place of points."""

POLE_CAP = 89.99  # degrees; a ring north or south of this is an artefact of closing Antarctica, not a coast


class Topology(NamedTuple):
    """Geometries by the name of their object, and the arcs that they share, in degrees."""

    objects: dict[str, list[Geometry]]
    arcs: list[FloatArray]


@functools.cache
def topology(name: str) -> Topology:
    """The topology of a file of the package's data, by its name: TopoJSON, or packed by tools/make_outlines.py."""
    file = importlib.resources.files("projdist") / "data" / name
    if name.endswith(".npz"):
        return _unpacked(file.read_bytes())
    content = json.loads(file.read_text(encoding="utf-8"))
    scale, origin = np.array(content["transform"]["scale"]), np.array(content["transform"]["translate"])
    arcs = [np.cumsum(np.array(arc), axis=0) * scale + origin for arc in content["arcs"]]
    return Topology({key: one["geometries"] for key, one in content["objects"].items()}, arcs)


def _unpacked(content: bytes) -> Topology:
    """Steps with their signs in the lowest bits, and the bytes of all of them by rank."""
    with np.load(io.BytesIO(content)) as file:
        unsigned = np.ascontiguousarray(file["steps"].transpose(2, 1, 0)).view("<u4")[..., 0].astype(np.int64)
        ends, scale, origin = np.cumsum(file["sizes"]), file["scale"], file["origin"]
        objects = json.loads(file["objects"].tobytes())
    steps = np.where(unsigned % 2, -(unsigned + 1) // 2, unsigned // 2)
    return Topology(objects, [np.cumsum(arc, axis=0) * scale + origin for arc in np.split(steps, ends[:-1])])


def arcs_used(geometry: Geometry) -> set[int]:
    """The arcs of a geometry, whichever way it goes along them."""
    return {_forward(index) for rings in _polygons(geometry) for ring in rings for index in ring}


@GEOS_ARITHMETIC
def decoded(geometry: Geometry, arcs: Sequence[FloatArray]) -> shapely.MultiPolygon:
    """A geometry as plane polygons, cut at the antimeridian and closed along the poles."""
    parts: list[shapely.Polygon] = []
    for polygon in as_stored(geometry, arcs):
        parts.extend(cut_at_antimeridian(polygon if polygon.is_valid else shapely.make_valid(polygon)))
    # The data has polygons that share an edge at the antimeridian; together they are valid only when merged.
    return merged(parts)


def as_stored(geometry: Geometry, arcs: Sequence[FloatArray]) -> Iterator[shapely.Polygon]:
    """The polygons of a geometry, closed along the poles, of unwrapped longitudes, some of which cross themselves."""
    for rings in _polygons(geometry):
        points = [unwrapped(_join(arcs, ring)) for ring in rings]
        # A ring round a pole as narrow as that may stand before Antarctica's coast as if it were the shell.
        shell, *holes = (ring for ring in points if np.abs(ring[:, 1]).min() < POLE_CAP)
        yield shapely.Polygon(closed_round_pole(shell), [beside(hole, shell) for hole in holes])


def _polygons(geometry: Geometry) -> list[list[list[int]]]:
    """The polygons of a geometry, each a list of rings, each a list of arc indices."""
    return geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]


def _forward(index: int) -> int:
    """The arc of an index; a negative one, ~i, means arc i backwards."""
    return index if index >= 0 else ~index


def _join(arcs: Sequence[FloatArray], ring: list[int]) -> FloatArray:
    parts = [arcs[index] if index >= 0 else arcs[~index][::-1] for index in ring]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


# ---- natural earth -------------------------------------------------------------------------------


RESOLUTIONS = ("110m", "50m", "10m")
"""Scales of the data, in millionths: for the world, for parts of it, and for small countries."""

_FILES = {
    ("land", "110m"): "land-110m.json",
    ("land", "50m"): "land-50m.json",
    ("land", "10m"): "countries-10m.npz",
    ("countries", "110m"): "countries-110m.json",
    ("countries", "50m"): "countries-50m.json",
    ("countries", "10m"): "countries-10m.npz",
    ("lakes", "110m"): "lakes-110m.json",
    ("lakes", "50m"): "lakes-50m.json",
}


Bounds = tuple[float, float, float, float]

_MARGIN = 0.5  # degrees: arcs end short of the antimeridian by less


class CountryBorder(NamedTuple):
    """A piece of land border."""

    countries: frozenset[str]
    """Keys of the countries on either side, as `country` takes them."""
    line: FloatArray
    """Longitudes and latitudes in degrees, of shape (n, 2)."""


@functools.cache
def land(resolution: str = "110m") -> shapely.MultiPolygon:
    """The land as polygons in degrees, longitudes -180 to 180; at 10m it takes some seconds to make."""
    return _only("land", resolution)


def land_within(bounds: Bounds, resolution: str) -> shapely.MultiPolygon:
    """The part of `land` within bounds W, S, E, N in degrees, of which E may pass 180; at 10m 0.2 s, then some ms."""
    return _within("land", bounds, resolution)


def lakes_within(bounds: Bounds, resolution: str) -> shapely.MultiPolygon:
    """The part of `lakes` within bounds, as `land_within` has them."""
    return _within("lakes", bounds, resolution)


@GEOS_ARITHMETIC
def _within(what: str, bounds: Bounds, resolution: str) -> shapely.MultiPolygon:
    polygons = _stored(what, resolution)
    west, south, east, north = bounds
    parts: list[shapely.Polygon] = []
    for turn in _TURNS:
        window = west + turn, south, east + turn, north
        # Few of the rings that cross themselves, and which take seconds to mend, do so within a small window.
        clipped = shapely.make_valid(shapely.clip_by_rect(polygons[_touching(polygons, window)], *window))
        parts.extend(part for one in clipped if not one.is_empty for part in cut_at_antimeridian(one))
    return merged(parts)


_TURNS = (-360.0, 0.0, 360.0)


def _touching(polygons: NDArray[np.object_], window: tuple[float, float, float, float]) -> BoolArray:
    """Which polygons may have anything of a window."""
    west, south, east, north = shapely.bounds(polygons).T
    return np.asarray((west < window[2]) & (east > window[0]) & (south < window[3]) & (north > window[1]))


@functools.cache
def _stored(what: str, resolution: str) -> NDArray[np.object_]:
    objects, arcs = _topology(what, resolution)
    (geometry,) = objects[what]
    return np.array(list(as_stored(geometry, arcs)))


@functools.cache
def lakes(resolution: str = "50m") -> shapely.MultiPolygon:
    """The lakes as polygons in degrees, longitudes -180 to 180, less their islands, at 110m and 50m.

    The Caspian Sea is none, and not land.

    Of the lakes at 1 : 50 million 253 have their vertices to 2 km, 22 of Siberia, New Zealand and Australia to 4 km;
    Tanganyika and Balkhash are those at 1 : 110 million.
    """
    return _only("lakes", resolution)


@functools.cache
def country_keys() -> tuple[dict[str, str], ...]:
    """The rows of countries.csv: `name`, `iso_a2`, `iso_a3`, `iso_n3`, `continent`, `other_names` with | between."""
    return tuple(data_rows("countries.csv"))


@functools.cache
def country(key: str, resolution: str = "50m") -> shapely.MultiPolygon | None:
    """The polygons of a numeric ISO code, or of a name where there is none; None for those too small for the data."""
    objects, arcs = _topology("countries", resolution)
    found = [decoded(one, arcs) for one in objects["countries"] if key == _key(one)]
    if len(found) > 1:
        return merged(found)
    return found[0] if found else None


def near(outline: shapely.MultiPolygon, lon: FloatArray, lat: FloatArray, degrees: float) -> BoolArray:
    """Whether points in degrees, longitudes -180 to 180, are in an outline or within some degrees of it."""
    return np.asarray(shapely.dwithin(outline, shapely.points(lon, lat), degrees), dtype=bool)


def countries_about(lon: FloatArray, lat: FloatArray) -> dict[str, BoolArray]:
    """By their keys, the countries in whose box any of some points is, longitudes -180 to 180, and which of these are.

    Nothing is decoded for it.
    """
    boxes = _boxes().items()
    within = ((key, (lon >= w) & (lon <= e) & (lat >= s) & (lat <= n)) for key, (w, s, e, n) in boxes)
    return {key: points for key, points in within if points.any()}


@functools.cache
def _boxes() -> dict[str, FloatArray]:
    """West, south, east, north of countries with a margin; of those that the antimeridian cuts all longitudes."""
    objects, arcs = _topology("countries", "50m")
    low, high = (np.array([end(arc, axis=0) for arc in arcs]) for end in (np.min, np.max))
    used: dict[str, set[int]] = {}
    for one in objects["countries"]:
        used.setdefault(_key(one), set()).update(arcs_used(one))
    return {
        key: np.concatenate([low[list(some)].min(axis=0) - _MARGIN, high[list(some)].max(axis=0) + _MARGIN])
        for key, some in used.items()
    }


@functools.cache
def coastlines(resolution: str = "110m") -> tuple[FloatArray, ...]:
    """Coastlines as arrays of shape (n, 2) of longitudes and latitudes in degrees.

    Longitudes run on across the antimeridian, so that neighbouring points are close.
    """
    return tuple(part for arc in _arcs("land", resolution) for part in _without_cuts(arc))


@functools.cache
def shores(resolution: str = "50m") -> tuple[FloatArray, ...]:
    """The shores of lakes and of their islands, as `coastlines` has those of the sea."""
    lines = _arcs("lakes", resolution)
    places = [line[:, 0] + 1j * line[:, 1] for line in lines]
    edges = np.concatenate([np.sort(np.column_stack([line[:-1], line[1:]]), axis=1) for line in places])
    # An edge that two rings have lies between two parts of one lake.
    _, which, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    inner = np.split(count[which.ravel()] > 1, np.cumsum([len(line) - 1 for line in lines])[:-1])
    return tuple(part for line, left_out in zip(lines, inner, strict=True) for part in _less(line, left_out))


def _arcs(what: str, resolution: str) -> list[FloatArray]:
    """The arcs of the one geometry of a file."""
    objects, arcs = _topology(what, resolution)
    (geometry,) = objects[what]
    return [arcs[index] for index in sorted(arcs_used(geometry))]


@functools.cache
def borders(resolution: str = "50m") -> tuple[CountryBorder, ...]:
    """Land borders: the arcs that two countries share; those that only one uses are coast.

    Longitudes run on across the antimeridian, as those of `coastlines`.
    """
    objects, arcs = _topology("countries", resolution)
    users: dict[int, set[str]] = {}
    for geometry in objects["countries"]:
        for index in arcs_used(geometry):
            users.setdefault(index, set()).add(_key(geometry))
    return tuple(
        CountryBorder(frozenset(keys), part)
        for index, keys in sorted(users.items())
        if len(keys) > 1
        for part in _without_cuts(arcs[index])
    )


def _only(what: str, resolution: str) -> shapely.MultiPolygon:
    """The one geometry of a file."""
    objects, arcs = _topology(what, resolution)
    (geometry,) = objects[what]
    return decoded(geometry, arcs)


def _key(geometry: Geometry) -> str:
    return str(geometry.get("id", geometry["properties"]["name"]))


def _topology(what: str, resolution: str) -> Topology:
    allowed = [scale for name, scale in _FILES if name == what]
    if resolution not in allowed:
        raise ValueError(f"Invalid resolution '{resolution}'. It must be one of {', '.join(allowed)}.")
    return topology(_FILES[what, resolution])


_ON_CUT = 1e-6  # degrees


def _without_cuts(arc: FloatArray) -> Iterator[FloatArray]:
    """The pieces of an arc that are coast or border: not along the antimeridian, and not round a pole."""
    if np.abs(arc[:, 0]).max() < 180.0 - _ON_CUT and np.abs(arc[:, 1]).max() < POLE_CAP:
        yield arc
        return
    line = unwrapped(arc)
    on_cut = np.abs(np.abs(arc[:, 0]) - 180.0) < _ON_CUT
    artificial = (on_cut[1:] & on_cut[:-1]) | (np.abs(line[1:, 1]) > POLE_CAP)
    yield from _less(line, artificial)


def _less(line: FloatArray, left_out: BoolArray) -> Iterator[FloatArray]:
    """The pieces of a line without some of its edges."""
    for piece in np.split(np.arange(len(left_out)), np.flatnonzero(np.diff(left_out)) + 1):
        if piece.size and not left_out[piece[0]]:
            yield line[piece[0] : piece[-1] + 2]


# ---- states --------------------------------------------------------------------------------------


@functools.cache
def state_keys() -> tuple[dict[str, str], ...]:
    """The rows of states.csv: `name`, `postal`, `fips`, `other_names` with | between."""
    return tuple(data_rows("states.csv"))


def state_outline(fips: str) -> shapely.MultiPolygon:
    """The polygons of a state, the District of Columbia or a territory by its FIPS code, at 1 : 10 million."""
    objects, arcs = topology("states-10m.npz")
    (geometry,) = (one for one in objects["states"] if one["id"] == fips)
    return decoded(geometry, arcs)
