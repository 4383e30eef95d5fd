"""The land and the countries of the Earth, from the Natural Earth data that is shipped with the package.

The files are TopoJSON: polygons are chains of shared arcs, arcs are quantised differences. They
are returned as plane polygons in longitude and latitude, cut at the antimeridian and closed
along the poles; the coastlines are free of these cuts.
"""

from __future__ import annotations

import csv
import functools
import importlib.resources
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray
from projdist.earth.rings import beside, closed_round_pole, cut_at_antimeridian, merged, unwrapped

__all__ = ["RESOLUTIONS", "coastlines", "country", "country_keys", "land", "near"]

RESOLUTIONS = ("110m", "50m")
"""Scales of the data, in millionths: 1 : 110 million for the world, 1 : 50 million for parts of it."""

_POLE_CAP = 89.99  # a ring north or south of this is an artefact of closing Antarctica, not a coast


@functools.cache
def land(resolution: str = "110m") -> shapely.MultiPolygon:
    """The land as polygons in degrees, longitudes -180 to 180."""
    topology = _topology("land", resolution)
    (geometry,) = topology["objects"]["land"]["geometries"]
    return _decoded(geometry, _arcs(topology))


@functools.cache
def country_keys() -> tuple[dict[str, str], ...]:
    """The rows of countries.csv: `name`, `iso_a2`, `iso_a3`, `iso_n3`, `continent`, `other_names` with | between."""
    file = importlib.resources.files("projdist") / "data" / "countries.csv"
    return tuple(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


@functools.cache
def country(key: str, resolution: str = "50m") -> shapely.MultiPolygon | None:
    """The polygons of a numeric ISO code, or of a name where there is none; None for those too small for the data."""
    topology, arcs = _countries(resolution)
    geometries = topology["objects"]["countries"]["geometries"]
    chosen = [one for one in geometries if key == one.get("id", one["properties"]["name"])]
    return merged([_decoded(one, arcs) for one in chosen]) if chosen else None


def near(outline: shapely.MultiPolygon, lon: FloatArray, lat: FloatArray, degrees: float) -> BoolArray:
    """Whether points in degrees, longitudes -180 to 180, are in an outline or within some degrees of it."""
    return np.asarray(shapely.dwithin(outline, shapely.points(lon, lat), degrees), dtype=bool)


@functools.cache
def _countries(resolution: str) -> tuple[dict[str, Any], list[FloatArray]]:
    topology = _topology("countries", resolution)
    return topology, _arcs(topology)


@functools.cache
def coastlines(resolution: str = "110m") -> tuple[FloatArray, ...]:
    """Coastlines as arrays of shape (n, 2) of longitudes and latitudes in degrees.

    Longitudes run on across the antimeridian, so that neighbouring points are close.
    """
    topology = _topology("land", resolution)
    arcs = _arcs(topology)
    (geometry,) = topology["objects"]["land"]["geometries"]
    used = sorted({_forward(index) for rings in _polygons(geometry) for ring in rings for index in ring})
    return tuple(part for index in used for part in _without_cuts(arcs[index]))


def _topology(what: str, resolution: str) -> dict[str, Any]:
    if resolution not in RESOLUTIONS:
        raise ValueError(f"Invalid resolution '{resolution}'. It must be one of {', '.join(RESOLUTIONS)}.")
    file = importlib.resources.files("projdist") / "data" / f"{what}-{resolution}.json"
    topology: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return topology


def _arcs(topology: dict[str, Any]) -> list[FloatArray]:
    """The arcs in degrees; each is stored as integer differences from point to point."""
    scale = np.array(topology["transform"]["scale"])
    origin = np.array(topology["transform"]["translate"])
    return [np.cumsum(np.array(arc), axis=0) * scale + origin for arc in topology["arcs"]]


def _polygons(geometry: dict[str, Any]) -> list[list[list[int]]]:
    """The polygons of a geometry, each a list of rings, each a list of arc indices."""
    return geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]


def _decoded(geometry: dict[str, Any], arcs: list[FloatArray]) -> shapely.MultiPolygon:
    parts: list[shapely.Polygon] = []
    for rings in _polygons(geometry):
        points = [unwrapped(_join(arcs, ring)) for ring in rings]
        # A ring round a pole as narrow as that may stand before Antarctica's coast as if it were the shell.
        shell, *holes = (ring for ring in points if np.abs(ring[:, 1]).min() < _POLE_CAP)
        parts.extend(
            cut_at_antimeridian(
                shapely.make_valid(shapely.Polygon(closed_round_pole(shell), [beside(hole, shell) for hole in holes]))
            )
        )
    # The data has polygons that share an edge at the antimeridian; together they are valid only when merged.
    return merged(parts)


def _forward(index: int) -> int:
    """The arc of an index; a negative one, ~i, means arc i backwards."""
    return index if index >= 0 else ~index


def _join(arcs: list[FloatArray], ring: list[int]) -> FloatArray:
    parts = [arcs[index] if index >= 0 else arcs[~index][::-1] for index in ring]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def _without_cuts(arc: FloatArray) -> Iterator[FloatArray]:
    """The pieces of an arc that are coast: not along the antimeridian, and not round a pole."""
    line = unwrapped(arc)
    on_cut = np.abs(np.abs(arc[:, 0]) - 180.0) < 1e-6
    artificial = (on_cut[1:] & on_cut[:-1]) | (np.abs(line[1:, 1]) > _POLE_CAP)
    for piece in np.split(np.arange(len(artificial)), np.flatnonzero(np.diff(artificial)) + 1):
        if piece.size and not artificial[piece[0]]:
            yield line[piece[0] : piece[-1] + 2]
