"""Patches in longitude and latitude, with charts that suit the poles.

Patch 0 is in longitude and latitude. There is a patch of its own at each pole, where most maps
share a log^2 singularity: in the cube root of the distance to the pole it is smooth. Patch 1 is
north of 80 degrees, patch 2 south of -80.
"""

from __future__ import annotations

import math

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.regions.region import ChartPoints, rectangles_of

_POLAR = 80.0
# Latitudes where panels begin, and halves between, are 5-degree knots of Robinson's table.
_LATITUDES = (-40.0, 0.0, 40.0)
_COLATITUDES = (5.0,)
_WIDEST = 180.0  # degrees of longitude in one panel
_POLES = (0.0, 1.0, -1.0)  # by patch
_SMALL = 0.2  # of a panel's height

SLIVER = 1e-13
"""Of a panel; what is smaller is rounding."""


def patch_panels(bounds: tuple[float, float, float, float]) -> tuple[IntArray, FloatArray]:
    """Patch numbers (n,) and rectangles (n, 4) of u and v that make up a box."""
    west, south, east, north = bounds
    lons = np.linspace(west, east, math.ceil((east - west) / _WIDEST) + 1)
    low, high = max(south, -_POLAR), min(north, _POLAR)
    patches = []
    if low < high:
        patches.append((0, np.array([low, *(lat for lat in _LATITUDES if low < lat < high), high])))
    for patch, near, far in ((1, 90.0 - north, 90.0 - south), (2, 90.0 + south, 90.0 + north)):
        if near < 90.0 - _POLAR:
            far = min(far, 90.0 - _POLAR)
            patches.append((patch, np.cbrt([near, *(c for c in _COLATITUDES if near < c < far), far])))
    rectangles = [rectangles_of(lons, edges) for _, edges in patches]
    numbers = np.repeat([patch for patch, _ in patches], [len(part) for part in rectangles])
    return numbers, np.concatenate(rectangles)


def patch_chart(patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
    """u is the longitude, v the latitude, or the cube root of the distance to the nearer pole."""
    degree = math.pi / 180.0
    sign = np.array(_POLES)[patch]
    lat = np.where(sign == 0.0, v, sign * (90.0 - v**3))
    north_v = np.where(sign == 0.0, 1.0, -3.0 * sign * v**2)
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
    while True:
        middle = 0.5 * (v0 + v1)
        if high <= middle:
            v1 = middle
        elif low >= middle:
            v0 = middle
        else:
            return (low, high) if high - low < _SMALL * (v1 - v0) else (v0, v1)
