"""Rings of longitudes and latitudes, as files have them, made into valid polygons of the plane.

Rings may cross the antimeridian, go round a pole, run in either direction, and have their
longitudes within -180 .. 180 or 0 .. 360. The polygons lie within -180 .. 180, cut at the
antimeridian and closed along the poles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely

from projdist._typing import FloatArray

_HALF_TURN, _TURN = 180.0, 360.0
_HALVINGS = 20  # of an interval: a curve that is not smooth is left alone


def unwrapped(ring: FloatArray) -> FloatArray:
    """The same points with longitudes that run on across the antimeridian: each edge goes the shorter way."""
    return np.column_stack([np.unwrap(ring[:, 0], period=_TURN), ring[:, 1]])


def beside(hole: FloatArray, shell: FloatArray) -> FloatArray:
    """The hole, moved by whole turns to the longitudes of its shell."""
    turns = np.ceil((shell[:, 0].min() - hole[:, 0].min()) / _TURN)
    return np.asarray(hole + np.array([_TURN * turns, 0.0]))


def closed_round_pole(ring: FloatArray) -> FloatArray:
    """A ring that goes once round a pole, closed along that pole; other rings as they are."""
    turn = ring[-1, 0] - ring[0, 0]
    if abs(turn) < _HALF_TURN:
        return ring
    pole = 90.0 if ring[:, 1].mean() > 0 else -90.0
    return np.concatenate([ring, [[ring[-1, 0], pole], [ring[0, 0], pole]]])


def cut_at_antimeridian(polygon: shapely.Geometry) -> Iterator[shapely.Polygon]:
    """The parts of a valid polygon of unwrapped longitudes, each moved to -180 .. 180."""
    west, _, east, _ = polygon.bounds
    for turn in range(int(np.floor((west + _HALF_TURN) / _TURN)), int(np.ceil((east + _HALF_TURN) / _TURN))):
        window = shapely.box(-180.0 + _TURN * turn, -90.0, 180.0 + _TURN * turn, 90.0)
        inside = polygon if window.covers(polygon) else shapely.intersection(polygon, window)
        for part in shapely.get_parts(inside):
            if isinstance(part, shapely.Polygon) and part.area > 0:
                yield shapely.transform(part, lambda xy, shift=_TURN * turn: xy - [shift, 0.0]) if turn else part


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


def signed_area(ring: FloatArray) -> float:
    """Area of a closed ring in the plane, positive where it runs anticlockwise."""
    x, y = (ring - ring[0]).T
    return float(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Longitudes and latitudes in degrees at parameters t; they begin and end together on closed curves."""


def chords(curve: Curve, t: FloatArray, tolerance: float) -> FloatArray:
    """Points (m, 2) on a curve whose chords in longitude and latitude leave it by no more than `tolerance` degrees.

    `t` are parameters to begin with; intervals are halved until their middles are near enough.
    """
    lon, lat = curve(t)
    open_ = np.ones(t.size - 1, dtype=bool)
    for _ in range(_HALVINGS):
        left = np.flatnonzero(open_)
        if not left.size:
            break
        middle = 0.5 * (t[left] + t[left + 1])
        lon_m, lat_m = curve(middle)
        # Twice how far the middle is from that of the chord, whatever turns the longitudes have.
        east = np.mod(2.0 * lon_m - lon[left] - lon[left + 1] + 180.0, 360.0) - 180.0
        off = np.hypot(0.5 * east * np.cos(np.radians(lat_m)), lat_m - 0.5 * (lat[left] + lat[left + 1]))
        new = left[off > tolerance]
        chosen = off > tolerance
        open_[left[~chosen]] = False
        t = np.insert(t, new + 1, middle[chosen])
        lon = np.insert(lon, new + 1, lon_m[chosen])
        lat = np.insert(lat, new + 1, lat_m[chosen])
        open_ = np.insert(open_, new + 1, True)
    return np.column_stack([lon, lat])
