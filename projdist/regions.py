"""Regions of the Earth to integrate over: the globe, boxes in longitude and latitude, caps.

A region yields patches. It is the image of rectangles in the (u, v) plane under a smooth
chart; the cubature splits rectangles and never sees the shape. `chart` gives the points, and
the velocity with which they move on the unit sphere as u and v change, so that charts may be
singular in longitude (a cap about a pole) without harm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.ellipsoid import MEAN_EARTH_RADIUS, WGS84

__all__ = ["GLOBE", "Box", "Cap", "Region", "get_region"]


class ChartPoints(NamedTuple):
    """Points in degrees, and d(east, north) / d(u, v) on the unit sphere (radians per chart unit)."""

    lon: FloatArray
    lat: FloatArray
    east_u: FloatArray | float
    east_v: FloatArray | float
    north_u: FloatArray | float
    north_v: FloatArray | float


class Region(Protocol):
    """What the cubature and the plots ask of a region."""

    @property
    def name(self) -> str:
        """The region in the words of `get_region`."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; west < east, and east may pass 180."""

    @property
    def area_km2(self) -> float:
        """Area on the WGS 84 ellipsoid."""

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """Whether points in degrees are in the region, its edge included."""

    def panels(self) -> tuple[IntArray, FloatArray]:
        """Patch numbers (n,) and rectangles (n, 4) of u0, u1, v0, v1 to start from; together they cover the region."""

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The points of the rectangles; `patch` broadcasts against u and v."""


# A box has a patch of its own at each pole, where most maps share a log^2 singularity: in the cube root of the distance
# to the pole it is smooth. Latitudes where panels begin, and halves between, are 5-degree knots of Robinson's table.
_POLAR = 80.0
_LATITUDES = (-40.0, 0.0, 40.0)
_COLATITUDES = (5.0,)
_WIDEST = 180.0  # degrees of longitude in one panel
_LONGEST = 90.0  # degrees of azimuth or distance in one panel


@dataclass(frozen=True)
class Box:
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
        """Patch 0 in longitude and latitude; 1 and 2, beyond `_POLAR` north and south, in longitude and the cube
        root of the degrees to the pole."""
        west, south, east, north = self.bounds
        lons = np.linspace(west, east, math.ceil((east - west) / _WIDEST) + 1)
        low, high = max(south, -_POLAR), min(north, _POLAR)
        patches = []
        if low < high:
            patches.append((0, np.array([low, *(lat for lat in _LATITUDES if low < lat < high), high])))
        for patch, near, far in ((1, 90.0 - north, 90.0 - south), (2, 90.0 + south, 90.0 + north)):
            if near < 90.0 - _POLAR:
                far = min(far, 90.0 - _POLAR)
                patches.append((patch, np.cbrt([near, *(c for c in _COLATITUDES if near < c < far), far])))
        rectangles = [_rectangles(lons, edges) for _, edges in patches]
        numbers = np.repeat([patch for patch, _ in patches], [len(part) for part in rectangles])
        return numbers, np.concatenate(rectangles)

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """u is the longitude, v the latitude, or the cube root of the distance to the nearer pole."""
        degree = math.pi / 180.0
        sign = np.array([0.0, 1.0, -1.0])[patch]
        lat = np.where(sign == 0.0, v, sign * (90.0 - v**3))
        north_v = np.where(sign == 0.0, 1.0, -3.0 * sign * v**2)
        return ChartPoints(u, lat, degree * np.cos(degree * lat), 0.0, 0.0, degree * north_v)


GLOBE = Box(-180.0, -90.0, 180.0, 90.0)


@dataclass(frozen=True)
class Cap:
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

    def panels(self) -> tuple[IntArray, FloatArray]:
        """One patch in azimuth and distance, in degrees."""
        distances = np.linspace(0.0, self.angle, math.ceil(self.angle / _LONGEST) + 1)
        rectangles = _rectangles(np.linspace(0.0, 360.0, 5), distances)
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


def _rectangles(us: FloatArray, vs: FloatArray) -> FloatArray:
    """All rectangles of a grid, shape (n, 4)."""
    u0, v0 = np.meshgrid(us[:-1], vs[:-1], indexing="ij")
    u1, v1 = np.meshgrid(us[1:], vs[1:], indexing="ij")
    return np.stack([u0, u1, v0, v1], axis=-1).reshape(-1, 4)


_FORMS: dict[str, tuple[int, str, Callable[..., Region]]] = {
    "box": (4, "W,S,E,N", Box),
    "cap": (3, "LON,LAT,KM", Cap),
}


def get_region(region: str | Region) -> Region:
    """The region of a text: `globe`, `box:W,S,E,N` or `cap:LON,LAT,KM`; raises ValueError."""
    if not isinstance(region, str):
        return region
    text = region.strip()
    if text.lower() == "globe":
        return GLOBE
    kind, _, arguments = text.partition(":")
    if kind.lower() not in _FORMS:
        raise ValueError(f"Invalid region '{region}'. It must be globe, box:W,S,E,N or cap:LON,LAT,KM.")
    count, form, make = _FORMS[kind.lower()]
    try:
        values = [float(value) for value in arguments.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise ValueError(f"Invalid region '{region}'. It must be {kind.lower()}:{form}, {count} numbers.")
    return make(*values)
