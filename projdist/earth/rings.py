"""Rings of longitudes and latitudes, as files have them, made into valid polygons of the plane.

Rings may cross the antimeridian, go round a pole, run in either direction, and have their
longitudes within -180 .. 180 or 0 .. 360. The polygons lie within -180 .. 180, cut at the
antimeridian and closed along the poles.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import shapely

from projdist._typing import FloatArray

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
