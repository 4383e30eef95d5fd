"""Land, lakes, countries and the lines between them, from the Natural Earth data that is shipped with the package.

Areas are plane polygons in longitude and latitude, cut at the antimeridian and closed along the
poles; coastlines and borders are free of these cuts.
"""

from __future__ import annotations

import csv
import functools
import importlib.resources
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from projdist._typing import BoolArray, FloatArray
from projdist.earth.rings import GEOS_ARITHMETIC, cut_at_antimeridian, merged, unwrapped
from projdist.earth.topojson import POLE_CAP, Geometry, Topology, arcs_used, as_stored, decoded, topology

__all__ = [
    "RESOLUTIONS",
    "Border",
    "borders",
    "coastlines",
    "countries_about",
    "country",
    "country_keys",
    "lakes",
    "lakes_within",
    "land",
    "land_within",
    "near",
    "shores",
]

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


class Border(NamedTuple):
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
    file = importlib.resources.files("projdist") / "data" / "countries.csv"
    return tuple(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


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
def borders(resolution: str = "50m") -> tuple[Border, ...]:
    """Land borders: the arcs that two countries share; those that only one uses are coast.

    Longitudes run on across the antimeridian, as those of `coastlines`.
    """
    objects, arcs = _topology("countries", resolution)
    users: dict[int, set[str]] = {}
    for geometry in objects["countries"]:
        for index in arcs_used(geometry):
            users.setdefault(index, set()).add(_key(geometry))
    return tuple(
        Border(frozenset(keys), part)
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
