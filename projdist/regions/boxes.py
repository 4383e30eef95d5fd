"""Boxes between meridians and parallels; the globe is one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.ellipsoid import WGS84
from projdist.regions.patches import patch_chart, patch_panels
from projdist.regions.region import ChartPoints, Unclipped


@dataclass(frozen=True)
class Box(Unclipped):
    """The box between two meridians and two parallels; west > east crosses the antimeridian."""

    west: float
    south: float
    east: float
    north: float

    def __post_init__(self) -> None:
        values = (self.west, self.south, self.east, self.north)
        text = f"Invalid box '{','.join(f'{value:g}' for value in values)}'."
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"{text} West, south, east and north must be finite numbers of degrees.")
        if not -90 <= self.south < self.north <= 90:
            raise ValueError(f"{text} South must be below north, both within -90 and 90.")
        if not (-360 <= self.west <= 360 and -360 <= self.east <= 360):
            raise ValueError(f"{text} West and east must lie within -360 and 360.")
        west, _, east, _ = self.bounds
        if self.west == self.east or not 0 < east - west <= 360:
            raise ValueError(f"{text} It must be wider than 0 and at most 360 degrees.")

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
    def area_km2(self) -> float:
        """Area on the WGS 84 ellipsoid."""
        west, south, east, north = self.bounds
        below = WGS84.area_below([south, north])
        return float(math.radians(east - west) * (below[1] - below[0]) / 1e6)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """Whether points in degrees are in the box, its edge included."""
        west, south, east, north = self.bounds
        lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
        return np.asarray((np.mod(lon - west, 360.0) <= east - west) & (lat >= south) & (lat <= north))

    def panels(self) -> tuple[IntArray, FloatArray]:
        """The panels of `patch_panels`."""
        return patch_panels(self.bounds)

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The chart of `patch_chart`."""
        return patch_chart(patch, u, v)


GLOBE = Box(-180.0, -90.0, 180.0, 90.0)
