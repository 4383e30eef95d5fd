"""Geometries of vector data as chains of edges, and what is to be said of those that have none."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from projdist._typing import AnyArray, BoolArray, FloatArray, IntArray
from projdist.earth import planar, unwrapped

__all__ = ["MISSING", "NOT_FINITE", "NO_DEGREES", "POINTS", "REPAIRED", "Outlines", "outlines"]

MISSING = "no geometry"
NOT_FINITE = "coordinates that are no numbers"
NO_DEGREES = "coordinates that are no longitudes and latitudes in degrees"
POINTS = "points only"
REPAIRED = "intersects itself: repaired"

_WIDE, _POLE = 180.0, 90.0  # degrees: a wider edge goes the shorter way, but for one along a pole
_TURN = 360.0
_FARTHEST, _OVER = 720.0, 1e-9  # degrees: twice round; beyond a pole by rounding
_POLYGONAL = (3, 6, 7)  # shapely's types: polygons, those of several parts, collections
_COMPOUND = 4  # and those that follow


@dataclass(frozen=True)
class Outlines:
    """The edges (m, 4) of features, each in a chain (m,): a ring, or a line.

    `feature` (n,) is the number of a chain's feature; `sign` (n,) is 1 for shells, -1 for holes, 0 for
    lines; `notes` has a text for each feature, mostly an empty one.
    """

    edges: FloatArray
    chain: IntArray
    feature: IntArray
    sign: FloatArray
    notes: list[str]


def outlines(geometries: Iterable[Any], *, has_degrees: bool) -> Outlines:
    """The edges of geometries, of which polygons that intersect themselves are repaired first.

    `has_degrees` tells whether the coordinates are longitudes and latitudes: edges wider than 180 degrees
    then run the shorter way, across the antimeridian, and longitudes count from wherever they like, up to twice round.
    """
    shapes = np.array([*geometries, None], dtype=object)[:-1]
    notes = [""] * len(shapes)
    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    xy, owner = shapely.get_coordinates(shapes, return_index=True)
    infinite = np.bincount(owner[~np.isfinite(xy).all(axis=1)], minlength=len(shapes)) > 0
    nowhere = np.zeros(len(shapes), dtype=bool)
    if has_degrees:
        nowhere = ~infinite & (np.bincount(owner[~_are_degrees(xy)], minlength=len(shapes)) > 0)
    shapes[missing | infinite | nowhere] = None
    if has_degrees:
        for index in np.unique(owner[np.abs(xy[:, 0]) > _TURN]):
            shapes[index] = _turned_back(shapes[index])
        for index in np.flatnonzero(_wide(shapes)):
            shapes[index] = shapely.GeometryCollection(_shorter_way(shapes[index]))
    invalid = np.isin(shapely.get_type_id(shapes), _POLYGONAL) & ~shapely.is_valid(shapes)
    shapes[invalid] = shapely.make_valid(shapes[invalid])
    chains, feature, sign = _chains(shapes)
    xy, owner = shapely.get_coordinates(chains, return_index=True)
    within = owner[1:] == owner[:-1]
    pointless = ~missing & (np.bincount(feature, minlength=len(shapes)) == 0)
    texts = {REPAIRED: invalid, POINTS: pointless, NO_DEGREES: nowhere, NOT_FINITE: infinite, MISSING: missing}
    for text, chosen in texts.items():
        for index in np.flatnonzero(chosen):
            notes[index] = text
    return Outlines(np.hstack([xy[:-1], xy[1:]])[within], owner[:-1][within], feature, sign, notes)


def _chains(shapes: AnyArray) -> tuple[AnyArray, IntArray, FloatArray]:
    """Rings and lines, the number of the shape of each, and its sign."""
    parts, owner = _simple(shapes)
    types = shapely.get_type_id(parts)
    rings, polygon = shapely.get_rings(parts[types == 3], return_index=True)
    shell = np.diff(polygon, prepend=-1) != 0
    lines = np.isin(types, (1, 2)) & (shapely.length(parts) > 0.0)  # others are points
    sign = np.concatenate([np.where(shell, 1.0, -1.0), np.zeros(int(lines.sum()))])
    return np.concatenate([rings, parts[lines]]), np.concatenate([owner[types == 3][polygon], owner[lines]]), sign


def _simple(shapes: AnyArray) -> tuple[AnyArray, IntArray]:
    """The parts of shapes that have no parts, and the number of the shape of each."""
    parts, owner = shapely.get_parts(shapes, return_index=True)
    while (shapely.get_type_id(parts) >= _COMPOUND).any():
        parts, inner = shapely.get_parts(parts, return_index=True)
        owner = owner[inner]
    return parts, owner


# ---- longitudes ---------------------------------------------------------------------------


def _are_degrees(xy: FloatArray) -> BoolArray:
    """Whether coordinates (n, 2) may be longitudes and latitudes."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(xy[:, 0]) <= _FARTHEST) & (np.abs(xy[:, 1]) <= _POLE + _OVER))


def _turned_back(shape: Any) -> Any:
    """A shape moved by whole turns so that it begins within -180 and 180: PROJ has no longitudes beyond 573 degrees."""
    if shape is None:
        return None
    turns = _TURN * np.round(shapely.get_coordinates(shape)[0, 0] / _TURN)
    return shapely.transform(shape, lambda xy: xy - [turns, 0.0])


def _wide(shapes: AnyArray) -> BoolArray:
    """Whether shapes in longitude and latitude have an edge that is meant to go the shorter way."""
    chains, feature, _ = _chains(shapes)
    xy, owner = shapely.get_coordinates(chains, return_index=True)
    least = np.minimum(np.abs(xy[1:, 1]), np.abs(xy[:-1, 1]))
    wide = (owner[1:] == owner[:-1]) & (np.abs(np.diff(xy[:, 0])) > _WIDE) & (least < _POLE)
    return np.bincount(feature[owner[:-1][wide]], minlength=len(shapes)) > 0


def _shorter_way(shape: Any) -> list[Any]:
    """The polygons and lines in a shape, with longitudes that run on across the antimeridian."""
    found = []
    for part in _simple(np.array([shape]))[0]:
        if part.geom_type == "Polygon":
            found.append(planar([shapely.get_coordinates(ring) for ring in (part.exterior, *part.interiors)]))
        elif part.geom_type != "Point":
            line = unwrapped(shapely.get_coordinates(part))
            # Nothing is left of a whole parallel from -180 to 180: it is taken as it is.
            found.append(shapely.LineString(line) if np.ptp(line, axis=0).any() else part)
    return found
