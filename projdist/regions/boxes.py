"""Boxes between meridians and parallels; the globe is one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, WGS84, Breaks, Ellipsoid
from projdist.regions.patches import patch_chart, patch_panels
from projdist.regions.region import ChartPoints, Unclipped

# Degrees: a box across the antimeridian that is wider is likelier to have west and east exchanged. The Pacific from
# Sumatra to Chile is 198 wide, and what is exchanged seldom 150.
_SMALLEST = 0.01  # degrees: the box of a single point is a kilometre wide


_WIDEST_ACROSS = 210.0

Sides = tuple[float, float, float, float]


def likelier(sides: Sides) -> Sides:
    """The west, south, east, north that someone may have meant who gave these; mostly the same."""
    west, south, east, north = sides
    if max(abs(south), abs(north)) > 90 >= max(abs(west), abs(east)):
        west, south, east, north = south, west, north, east
    if south > north:
        south, north = north, south
    if west > east and east + 360.0 - west > _WIDEST_ACROSS:
        west, east = east, west
    return west, south, east, north


@dataclass(frozen=True)
class Box(Unclipped):
    """The box between two meridians and two parallels; west > east crosses the antimeridian.

    The `ellipsoid` is that of the body it is on; without one it is on any, and its area is that on WGS 84.
    """

    west: float
    south: float
    east: float
    north: float
    ellipsoid: Ellipsoid | None = field(default=None, compare=False)

    @classmethod
    def between(cls, bounds: Sides, ellipsoid: Ellipsoid | None = None) -> Box:
        """The box of bounds west < east, as regions have them: from 170 to 370 is from 170 to 10."""
        west, south, east, north = bounds
        if east - west >= 360.0:
            return cls(-180.0, south, 180.0, north, ellipsoid)
        return cls(west, south, east if east <= 360.0 else east - 360.0, north, ellipsoid)

    def __post_init__(self) -> None:
        values = (self.west, self.south, self.east, self.north)
        text = f"Invalid box '{','.join(f'{value:g}' for value in values)}'."
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"{text} West, south, east and north must be finite numbers of degrees.")
        if not -90 <= self.south < self.north <= 90:
            raise ValueError(f"{text} {self._hint()}South must be below north, both within -90 and 90.")
        if not (-360 <= self.west <= 360 and -360 <= self.east <= 360):
            raise ValueError(f"{text} West and east must lie within -360 and 360.")
        west, _, east, _ = self.bounds
        if self.west == self.east or not 0 < east - west <= 360:
            raise ValueError(f"{text} It must be wider than 0 and at most 360 degrees.")

    def _hint(self) -> str:
        """A question for a box that is one with its numbers in another order."""
        west, south, east, north = likelier((self.west, self.south, self.east, self.north))
        possible = -90 <= south < north <= 90 and -360 <= west < east <= 360
        return f"Did you mean {west:g},{south:g},{east:g},{north:g}? " if possible else ""

    @property
    def is_globe(self) -> bool:
        """Whether the box is the whole sphere."""
        west, south, east, north = self.bounds
        return east - west == 360 and south == -90 and north == 90

    @property
    def name(self) -> str:
        """`globe`, or `box:W,S,E,N`."""
        if self.is_globe:
            return "globe"
        return "box:" + ",".join(f"{value:.15g}" for value in (self.west, self.south, self.east, self.north))

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees, with west < east."""
        east = self.east if self.east > self.west else self.east + 360.0
        return self.west, self.south, east, self.north

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid on which the area is measured."""
        return self.ellipsoid or WGS84

    @property
    def area_km2(self) -> float:
        """Area on the ellipsoid."""
        west, south, east, north = self.bounds
        below = self.figure.area_below([south, north])
        return float(math.radians(east - west) * (below[1] - below[0]) / 1e6)

    def shared_km2(self, other: Box) -> float:
        """Area on the ellipsoid that two boxes share."""
        (west, south, east, north), (left, low, right, high) = self.bounds, other.bounds
        turns = (-720.0, -360.0, 0.0, 360.0, 720.0)
        width = sum(max(0.0, min(east, right + turn) - max(west, left + turn)) for turn in turns)
        below = self.figure.area_below([max(south, low), min(north, high)])
        return float(math.radians(width) * max(0.0, below[1] - below[0]) / 1e6)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """Whether points in degrees are in the box, its edge included."""
        west, south, east, north = self.bounds
        lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
        return np.asarray((np.mod(lon - west, 360.0) <= east - west) & (lat >= south) & (lat <= north))

    def panels(self, breaks: Breaks = SMOOTH) -> tuple[IntArray, FloatArray]:
        """The panels of `patch_panels`."""
        return patch_panels(self.bounds, breaks)

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The chart of `patch_chart`."""
        return patch_chart(patch, u, v)


GLOBE = Box(-180.0, -90.0, 180.0, 90.0)


def bounding_box(west: ArrayLike, south: ArrayLike, east: ArrayLike, north: ArrayLike) -> Box:
    """The narrowest box about boxes in degrees, each west <= east; it may cross the antimeridian."""
    start = np.mod(np.asarray(west, dtype=float), 360.0)
    order = np.argsort(start)
    end = np.maximum.accumulate((start + np.subtract(east, west))[order])
    end = np.maximum(end, end[-1] - 360.0)
    # The box is what the widest gap between the end of some and the start of the next leaves.
    following = np.append(start[order][1:], start[order][0] + 360.0)
    widest = int(np.argmax(following - end))
    width = min(360.0 - float(following[widest] - end[widest]), 360.0)
    low, high = float(np.min(np.asarray(south))), float(np.max(np.asarray(north)))
    if width < _SMALLEST:
        following[widest] -= 0.5 * (_SMALLEST - width)
        width = _SMALLEST
    if high - low < _SMALLEST:
        low = min(max(0.5 * (low + high - _SMALLEST), -90.0), 90.0 - _SMALLEST)
        high = low + _SMALLEST
    first = (float(following[widest]) + 180.0) % 360.0 - 180.0
    last = (first + width + 180.0) % 360.0 - 180.0
    return Box(-180.0, low, 180.0, high) if width == 360.0 else Box(first, low, last, high)
