"""The globe in longitudes and latitudes about a pole of its own, where a map has its centre and its singular points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, Breaks, unit_vectors
from projdist.regions.boxes import GLOBE
from projdist.regions.patches import patch_chart, patch_panels, plain_panels
from projdist.regions.region import ChartPoints, Unclipped

__all__ = ["TurnedGlobe"]


@dataclass(frozen=True)
class TurnedGlobe(Unclipped):
    """The globe, in a chart whose north pole is at `lon`, `lat`, and whose meridian 0 runs south from there.

    Its panels end at `breaks`, in the chart's own longitudes and latitudes, and are at most `widest` degrees wide. At
    the poles they are `graded` as others are (`patch_panels`), or in plain longitude and latitude.
    """

    lon: float
    lat: float
    breaks: Breaks = SMOOTH
    widest: float = 180.0
    graded: bool = True

    @property
    def name(self) -> str:
        """What it is of."""
        return GLOBE.name

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Those of the globe."""
        return GLOBE.bounds

    @property
    def area_km2(self) -> float:
        """Area on WGS 84."""
        return GLOBE.area_km2

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """All points are in it."""
        return GLOBE.contains(lon, lat)

    def panels(self, breaks: Breaks = SMOOTH) -> tuple[IntArray, FloatArray]:
        """The panels of `patch_panels` about the chart's poles; the Earth's meridians and parallels cross them."""
        if self.graded:
            return patch_panels(GLOBE.bounds, self.breaks, self.widest)
        return plain_panels(GLOBE.bounds, self.breaks, self.widest)

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The chart of `patch_chart`, turned."""
        own = patch_chart(patch, u, v)
        lam, phi = np.radians(own.lon), np.radians(own.lat)
        cos_lam, sin_lam, cos_phi, sin_phi = np.cos(lam), np.sin(lam), np.cos(phi), np.sin(phi)
        lon, lat = math.radians(self.lon), math.radians(self.lat)
        pole = unit_vectors(self.lon, self.lat)
        south = np.array([math.sin(lat) * math.cos(lon), math.sin(lat) * math.sin(lon), -math.cos(lat)])
        east = np.array([-math.sin(lon), math.cos(lon), 0.0])

        def turned(x: FloatArray, y: FloatArray, z: FloatArray | float) -> list[FloatArray]:
            return [x * south[k] + y * east[k] + z * pole[k] for k in range(3)]

        x, y, z = turned(cos_phi * cos_lam, cos_phi * sin_lam, sin_phi)
        eastward = turned(-sin_lam, cos_lam, 0.0)
        rho = np.hypot(x, y)
        # The chart's east in the Earth's east and north; its north is a right angle to the left of that.
        to_east = (x * eastward[1] - y * eastward[0]) / rho
        to_north = (rho * eastward[2]) - z * (x * eastward[0] + y * eastward[1]) / rho
        return ChartPoints(
            np.degrees(np.arctan2(y, x)),
            np.degrees(np.arctan2(z, rho)),
            own.east_u * to_east,
            -own.north_v * to_north,
            own.east_u * to_north,
            own.north_v * to_east,
        )
