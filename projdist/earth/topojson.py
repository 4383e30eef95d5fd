"""TopoJSON files of the package's data: polygons are chains of shared arcs, arcs are quantised differences."""

from __future__ import annotations

import functools
import importlib.resources
import io
import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.earth.rings import GEOS_ARITHMETIC, beside, closed_round_pole, cut_at_antimeridian, merged, unwrapped

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
