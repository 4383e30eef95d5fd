"""Spherical caps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import MEAN_EARTH_RADIUS, SMOOTH, WGS84, Breaks
from projdist.regions.region import ChartPoints, Unclipped, rectangles_of

_LONGEST = 90.0  # degrees of azimuth or distance in one panel


@dataclass(frozen=True)
class Cap(Unclipped):
    """The spherical cap within `radius_km` of a point.

    The angle is the radius over the Earth's mean radius, and latitude counts as spherical, so
    that a cap is the same set of longitudes and latitudes for every map that is measured on it.
    """

    lon: float
    lat: float
    radius_km: float

    def __post_init__(self) -> None:
        text = f"Invalid cap '{self.lon:g},{self.lat:g},{self.radius_km:g}'."
        if not (math.isfinite(self.lon) and -360 <= self.lon <= 360 and -90 <= self.lat <= 90):
            raise ValueError(
                f"{text} Its centre must be a longitude within -360 and 360, a latitude within -90 and 90."
            )
        if not 0 < self.radius_km <= math.pi * MEAN_EARTH_RADIUS / 1000:
            raise ValueError(f"{text} Its radius must be above 0 and at most 20015 km, half the Earth's circumference.")

    @property
    def angle(self) -> float:
        """Angular radius in degrees."""
        return min(180.0, math.degrees(self.radius_km * 1000.0 / MEAN_EARTH_RADIUS))

    @property
    def name(self) -> str:
        """`cap:LON,LAT,KM`."""
        return f"cap:{self.lon:.15g},{self.lat:.15g},{self.radius_km:.15g}"

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; all longitudes where the cap holds a pole."""
        south, north = self.lat - self.angle, self.lat + self.angle
        if south <= -90 or north >= 90:
            return self.lon - 180.0, max(-90.0, south), self.lon + 180.0, min(90.0, north)
        half = math.degrees(math.asin(math.sin(math.radians(self.angle)) / math.cos(math.radians(self.lat))))
        return self.lon - half, south, self.lon + half, north

    @property
    def area_km2(self) -> float:
        """Area on the WGS 84 ellipsoid."""
        nodes, weights = np.polynomial.legendre.leggauss(48)
        # Both factors are analytic in (azimuth, distance): 48 nodes are exact to rounding.
        u = 180.0 * (nodes[:, None] + 1.0)
        v = 0.5 * self.angle * (nodes[None, :] + 1.0)
        points = self.chart(np.zeros(1, dtype=int), *np.broadcast_arrays(u, v))
        meridian, vertical = WGS84.radii(points.lat)
        density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u) * meridian * vertical
        return float(weights @ density @ weights * 180.0 * 0.5 * self.angle / 1e6)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """Whether points in degrees are in the cap, its edge included."""
        phi, phi0 = np.radians(np.asarray(lat, dtype=float)), math.radians(self.lat)
        lam = np.radians(np.asarray(lon, dtype=float) - self.lon)
        haversine = np.sin((phi - phi0) / 2) ** 2 + math.cos(phi0) * np.cos(phi) * np.sin(lam / 2) ** 2
        return np.asarray(haversine <= math.sin(math.radians(self.angle) / 2) ** 2 * (1 + 1e-12))

    def panels(self, breaks: Breaks = SMOOTH) -> tuple[IntArray, FloatArray]:
        """One patch in azimuth and distance, in degrees; meridians and parallels cross it."""
        distances = np.linspace(0.0, self.angle, math.ceil(self.angle / _LONGEST) + 1)
        rectangles = rectangles_of(np.linspace(0.0, 360.0, 5), distances)
        return np.zeros(len(rectangles), dtype=int), rectangles

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """u is the azimuth from the centre, v the angular distance."""
        degree = math.pi / 180.0
        sin0, cos0 = math.sin(degree * self.lat), math.cos(degree * self.lat)
        sin_a, cos_a, sin_c, cos_c = np.sin(degree * u), np.cos(degree * u), np.sin(degree * v), np.cos(degree * v)
        # Unit vectors with the centre on the x-z plane: the point, its radial and its transverse velocity.
        x, y = cos_c * cos0 - sin_c * cos_a * sin0, sin_c * sin_a
        z = cos_c * sin0 + sin_c * cos_a * cos0
        radial = (-sin_c * cos0 - cos_c * cos_a * sin0, cos_c * sin_a, -sin_c * sin0 + cos_c * cos_a * cos0)
        across = (sin_c * sin_a * sin0, sin_c * cos_a, -sin_c * sin_a * cos0)
        rho = np.hypot(x, y)
        east = (-y / rho, x / rho)
        north = (-z * x / rho, -z * y / rho, rho)
        return ChartPoints(
            self.lon + np.degrees(np.arctan2(y, x)),
            np.degrees(np.arctan2(z, rho)),
            degree * (across[0] * east[0] + across[1] * east[1]),
            degree * (radial[0] * east[0] + radial[1] * east[1]),
            degree * (across[0] * north[0] + across[1] * north[1] + across[2] * north[2]),
            degree * (radial[0] * north[0] + radial[1] * north[1] + radial[2] * north[2]),
        )
