"""Patches in longitude and latitude, with charts that suit the poles.

Patch 0 is in longitude and latitude. There is a patch of its own at each pole, where most maps
share a log^2 singularity: in the cube root of the distance to the pole it is smooth. Patch 1 is
north of 80 degrees, patch 2 south of -80.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.earth import SMOOTH, Breaks
from projdist.regions.region import ChartPoints

_POLAR = 80.0
# Latitudes where panels begin, and halves between, are 5-degree knots of Robinson's table.
_LATITUDES = (-60.0, -40.0, 0.0, 40.0, 60.0)
_COLATITUDES = (5.0,)
_WIDEST = 180.0  # degrees of longitude in one panel
_NARROW = 1e-9  # of a box: a break so near to its side is on it
_POLES = (0.0, 1.0, -1.0)  # by patch
_SMALL = 0.2  # of a panel's height

SLIVER = 1e-13
"""Of a panel; what is smaller is rounding."""


def patch_panels(
    bounds: tuple[float, float, float, float], breaks: Breaks = SMOOTH, widest: float = _WIDEST
) -> tuple[IntArray, FloatArray]:
    """Patch numbers (n,) and rectangles (n, 4) of u and v that make up a box, and end where a map is known to."""
    west, south, east, north = bounds
    low, high = max(south, -_POLAR), min(north, _POLAR)
    bands = []
    if low < high:
        bands.append((0, [low, *_between(low, high, (*_LATITUDES, *breaks.parallels)), high]))
    for patch, near, far in ((1, 90.0 - north, 90.0 - south), (2, 90.0 + south, 90.0 + north)):
        if near < 90.0 - _POLAR:
            far = min(far, 90.0 - _POLAR)
            known = tuple(90.0 - lat for lat in breaks.parallels) if patch == 1 else breaks.parallels
            distances = _between(near, far, (*_COLATITUDES, *known))
            bands.append((patch, np.cbrt([near, *distances, far]).tolist()))
    return _crossed(bands, (west, east), breaks, widest)


def plain_panels(
    bounds: tuple[float, float, float, float], breaks: Breaks, widest: float
) -> tuple[IntArray, FloatArray]:
    """The same in patch 0 alone, for maps that are smooth at the poles, or have too much rounding there."""
    west, south, east, north = bounds
    lats = [south, *_between(south, north, (0.0, *breaks.parallels)), north]
    return _crossed([(0, lats)], (west, east), breaks, widest)


def _crossed(
    bands: list[tuple[int, list[float]]], ends: tuple[float, float], breaks: Breaks, widest: float
) -> tuple[IntArray, FloatArray]:
    """The panels of bands of patches, between longitudes."""
    lons = [_meridians(*ends, meridians, widest) for meridians in (breaks.northern, breaks.southern)]
    numbers, rectangles = [], []
    for patch, edges in bands:
        for v0, v1 in itertools.pairwise(edges):
            southern = int(patch == 2 or (patch == 0 and v0 + v1 < 0.0))
            rectangles += [(u0, u1, v0, v1) for u0, u1 in itertools.pairwise(lons[southern])]
            numbers += [patch] * (len(lons[southern]) - 1)
    return np.array(numbers), np.array(rectangles)


def _between(low: float, high: float, values: tuple[float, ...]) -> list[float]:
    """Those of some values that lie well within an interval, in order."""
    margin = _NARROW * (high - low)
    return sorted({value for value in values if low + margin < value < high - margin})


def _meridians(west: float, east: float, breaks: tuple[float, ...], widest: float) -> list[float]:
    """Longitudes from west to east by way of breaks, none too far from the next."""
    turned = tuple(lon + turn for lon in breaks for turn in (-720.0, -360.0, 0.0, 360.0, 720.0))
    ends = [west, *_between(west, east, turned), east]
    found = [west]
    for a, b in itertools.pairwise(ends):
        found += np.linspace(a, b, math.ceil((b - a) / widest) + 1)[1:].tolist()
    return found


def patch_chart(patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
    """u is the longitude, v the latitude, or the cube root of the distance to the nearer pole."""
    degree = math.pi / 180.0
    if not np.any(patch):
        return ChartPoints(u, v, degree * np.cos(degree * v), 0.0, 0.0, degree)
    sign = np.array(_POLES)[patch]
    square, plain = v * v, sign == 0.0
    lat = np.where(plain, v, sign * (90.0 - square * v))
    north_v = np.where(plain, 1.0, -3.0 * sign * square)
    return ChartPoints(u, lat, degree * np.cos(degree * lat), 0.0, 0.0, degree * north_v)


def latitude_of(patch: int, v: FloatArray) -> FloatArray:
    """The latitude at v in one of the patches."""
    sign = _POLES[patch]
    return np.asarray(sign * (90.0 - np.asarray(v) ** 3) if sign else v)


def height_of(patch: int, lat: FloatArray) -> FloatArray:
    """v at a latitude in one of the patches."""
    sign = _POLES[patch]
    return np.cbrt(np.maximum(90.0 - sign * np.asarray(lat), 0.0)) if sign else np.asarray(lat)


def tightened(v0: float, v1: float, low: float, high: float) -> tuple[float, float]:
    """The interval v0, v1 halved as long as low to high is in one half; low to high itself where that is far less.

    Halves stay on the 5-degree knots of Robinson's table, where his map has kinks.
    """
    while v0 < (middle := 0.5 * (v0 + v1)) < v1:
        if high <= middle:
            v1 = middle
        elif low >= middle:
            v0 = middle
        else:
            return (low, high) if high - low < _SMALL * (v1 - v0) else (v0, v1)
    return low, high  # they are one latitude, or next to each other
