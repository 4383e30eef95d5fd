"""The land of the Earth, from the Natural Earth data that is shipped with the package.

The files are TopoJSON: polygons are chains of shared arcs, arcs are quantised differences. The
land is returned as plane polygons in longitude and latitude, cut at the antimeridian and
closed along the poles; the coastlines are free of these cuts.
"""

from __future__ import annotations

import functools
import importlib.resources
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely

from projdist._typing import FloatArray

__all__ = ["RESOLUTIONS", "coastlines", "land"]

RESOLUTIONS = ("110m", "50m")
"""Scales of the data, in millionths: 1 : 110 million for the world, 1 : 50 million for parts of it."""

_POLE_CAP = 89.99  # a ring north or south of this is an artefact of closing Antarctica, not a coast


@functools.cache
def land(resolution: str = "110m") -> shapely.MultiPolygon:
    """The land as polygons in degrees, longitudes -180 to 180."""
    topology = _topology(resolution)
    arcs = _arcs(topology)
    parts: list[shapely.Polygon] = []
    for rings in _polygons(topology):
        shell, *holes = (_unwrapped(_join(arcs, ring)) for ring in rings)
        holes = [_beside(hole, shell) for hole in holes if np.abs(hole[:, 1]).max() < _POLE_CAP]
        parts.extend(_cut_at_antimeridian(shapely.Polygon(_closed_round_pole(shell), holes)))
    # The data has polygons that share an edge at the antimeridian; together they are valid only when merged.
    return shapely.MultiPolygon(list(shapely.get_parts(shapely.union_all(parts))))


@functools.cache
def coastlines(resolution: str = "110m") -> tuple[FloatArray, ...]:
    """Coastlines as arrays of shape (n, 2) of longitudes and latitudes in degrees.

    Longitudes run on across the antimeridian, so that neighbouring points are close.
    """
    topology = _topology(resolution)
    arcs = _arcs(topology)
    used = sorted({_forward(index) for rings in _polygons(topology) for ring in rings for index in ring})
    return tuple(part for index in used for part in _without_cuts(arcs[index]))


def _topology(resolution: str) -> dict[str, Any]:
    if resolution not in RESOLUTIONS:
        raise ValueError(f"Invalid resolution '{resolution}'. It must be one of {', '.join(RESOLUTIONS)}.")
    file = importlib.resources.files("projdist") / "data" / f"land-{resolution}.json"
    topology: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return topology


def _arcs(topology: dict[str, Any]) -> list[FloatArray]:
    """The arcs in degrees; each is stored as integer differences from point to point."""
    scale = np.array(topology["transform"]["scale"])
    origin = np.array(topology["transform"]["translate"])
    return [np.cumsum(np.array(arc), axis=0) * scale + origin for arc in topology["arcs"]]


def _polygons(topology: dict[str, Any]) -> Iterator[list[list[int]]]:
    """The polygons of all geometries, each a list of rings, each a list of arc indices."""
    for geometry in topology["objects"]["land"]["geometries"]:
        yield from geometry["arcs"] if geometry["type"] == "MultiPolygon" else [geometry["arcs"]]


def _forward(index: int) -> int:
    """The arc of an index; a negative one, ~i, means arc i backwards."""
    return index if index >= 0 else ~index


def _join(arcs: list[FloatArray], ring: list[int]) -> FloatArray:
    parts = [arcs[index] if index >= 0 else arcs[~index][::-1] for index in ring]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def _unwrapped(points: FloatArray) -> FloatArray:
    """The same points with longitudes that run on across the antimeridian."""
    return np.column_stack([np.unwrap(points[:, 0], period=360.0), points[:, 1]])


def _beside(hole: FloatArray, shell: FloatArray) -> FloatArray:
    """The hole, moved by whole turns to the longitudes of its shell."""
    turns = np.ceil((shell[:, 0].min() - hole[:, 0].min()) / 360.0)
    return np.asarray(hole + np.array([360.0 * turns, 0.0]))


def _closed_round_pole(ring: FloatArray) -> FloatArray:
    """A ring that goes once round a pole, closed along that pole; other rings as they are."""
    turn = ring[-1, 0] - ring[0, 0]
    if abs(turn) < 180.0:
        return ring
    pole = 90.0 if ring[:, 1].mean() > 0 else -90.0
    return np.concatenate([ring, [[ring[-1, 0], pole], [ring[0, 0], pole]]])


def _cut_at_antimeridian(polygon: shapely.Polygon) -> Iterator[shapely.Polygon]:
    """The parts of a polygon of unwrapped longitudes, each moved to -180 .. 180."""
    valid = shapely.make_valid(polygon)
    west, _, east, _ = valid.bounds
    for turn in range(int(np.floor((west + 180.0) / 360.0)), int(np.ceil((east + 180.0) / 360.0))):
        window = shapely.box(-180.0 + 360.0 * turn, -90.0, 180.0 + 360.0 * turn, 90.0)
        for part in shapely.get_parts(shapely.intersection(valid, window)):
            if isinstance(part, shapely.Polygon) and part.area > 0:
                yield shapely.transform(part, lambda xy, shift=360.0 * turn: xy - [shift, 0.0])


def _without_cuts(arc: FloatArray) -> Iterator[FloatArray]:
    """The pieces of an arc that are coast: not along the antimeridian, and not round a pole."""
    line = _unwrapped(arc)
    on_cut = np.abs(np.abs(arc[:, 0]) - 180.0) < 1e-6
    artificial = (on_cut[1:] & on_cut[:-1]) | (np.abs(line[1:, 1]) > _POLE_CAP)
    for piece in np.split(np.arange(len(artificial)), np.flatnonzero(np.diff(artificial)) + 1):
        if piece.size and not artificial[piece[0]]:
            yield line[piece[0] : piece[-1] + 2]
