"""Caps: all points within a geodesic distance of a centre."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, Discontinuities, Ellipsoid
from projdist.projections import geodesic_direct, geodesic_inverse
from projdist.regions.region import ChartPoints, Unclipped

_LONGEST = 90.0  # degrees of azimuth or distance in one panel
_FLATTEST = 0.2  # GeographicLib's series give distances to 5e-8 there, and to less on flatter figures
# Of the semi-major axis: a point this far outside is in the cap. On Earth it is 1.3 micrometres, 100 times the rounding
# and truncation of geodesics.
_ON_RIM = 2e-13
# Radians from the rim within which the geodesic distance decides: ten times the rounding at the antipode, and thirty
# times the error of the series of a rim with corners, as rims near the antipode have.
_NEAR_RIM, _NEAR_CORNERS = 1e-7, 1e-4
_NARROWEST = 1e-12  # degrees from the middle to a side, so that west and east, south and north are different numbers
_FLAT = 1e-8  # radii (6 cm) within which the surface is plane to 1e-10, and degrees lose digits
_DEGREES = (16, 32, 64, 128, 256, 512)  # of the rim's polynomial; the last for rims with corners
_RESOLVED = 1e-12  # degrees, 0.1 micrometres on Earth, ten times the rounding of geodesics
_MOST_STEPS = 100
_DEGREE = math.pi / 180.0


class _Rim(NamedTuple):
    """Distance to the rim of a cap in degrees: its maximum, and a Chebyshev series in the cosine of the azimuth."""

    largest: float
    series: FloatArray  # even: the rim is symmetric about the meridian
    margin: float  # radians of the rim, within which the series does not decide
    round_to: float  # degrees up to which the chart is circular


@dataclass(frozen=True)
class Cap(Unclipped):
    """The points within a geodesic distance `radius_km` of a centre, on an ellipsoid.

    Without an `ellipsoid` it is on that of the maps measured on it: another body's own, or for the Earth WGS 84, or the
    mean sphere if all maps are of spheres.
    """

    lon: float
    lat: float
    radius_km: float
    ellipsoid: Ellipsoid | None = None

    def __post_init__(self) -> None:
        text = f"Invalid cap '{self.lon:g},{self.lat:g},{self.radius_km:g}'."
        if not (math.isfinite(self.lon) and -360 <= self.lon <= 360 and -90 <= self.lat <= 90):
            raise ValueError(
                f"{text} Its centre must be a longitude within -360 and 360, a latitude within -90 and 90."
            )
        farthest = math.pi * self.figure.mean_radius / 1000.0
        if not 0 < self.radius_km <= farthest:
            of = "the body" if self.figure.is_of_another_body else "the Earth"
            raise ValueError(
                f"{text} Its radius must be above 0 and at most {farthest:.0f} km, half {of}'s circumference."
            )
        if self.figure.f > _FLATTEST:
            raise ValueError(f"{text} Its body must not be flatter than {_FLATTEST:g}, for distances to be right.")

    @property
    def angle(self) -> float:
        """Largest `reach` in degrees; on a sphere that in all directions."""
        return self._rim.largest

    def reach(self, azimuth: ArrayLike) -> FloatArray:
        """Degrees of arc from the centre to the rim by azimuth, with latitudes taken as those of a sphere."""
        return np.asarray(self.angle * self._share(np.asarray(azimuth, dtype=float))[0])

    @property
    def name(self) -> str:
        """`cap:LON,LAT,KM`."""
        return f"cap:{self.lon:.15g},{self.lat:.15g},{self.radius_km:.15g}"

    @functools.cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; all longitudes where the cap holds a pole."""
        holds_south, holds_north = (bool(self.contains(self.lon, pole)) for pole in (-90.0, 90.0))
        south = -90.0 if holds_south else max(-90.0, min(self._destination(180.0)[1], self.lat - _NARROWEST))
        north = 90.0 if holds_north else min(90.0, max(self._destination(0.0)[1], self.lat + _NARROWEST))
        if holds_south or holds_north:
            return self.lon - 180.0, south, self.lon + 180.0, north
        low, high = 0.0, 180.0
        while low < (middle := 0.5 * (low + high)) < high:  # at the easternmost point the geodesic heads east
            low, high = (middle, high) if self._destination(middle)[2] < 90.0 else (low, middle)
        half = max((self._destination(low)[0] - self.lon) % 360.0, _NARROWEST)
        return self.lon - half, south, self.lon + half, north

    def _destination(self, azimuth: float) -> tuple[float, float, float]:
        lon, lat, course = geodesic_direct(self.figure, self.lon, self.lat, azimuth, 1000.0 * self.radius_km)
        return float(lon), float(lat), float(course) % 360.0

    @functools.cached_property
    def area_km2(self) -> float:
        """Area on the ellipsoid."""
        if self.figure.is_sphere:
            return 4.0 * math.pi * (self.figure.a / 1000.0 * math.sin(0.5 * _DEGREE * self.angle)) ** 2
        x, weights = np.polynomial.legendre.leggauss(48)
        # The integrand is analytic in the distance and periodic in the azimuth: exact to rounding.
        count = 4 * max(_DEGREES[0], len(self._rim.series))
        azimuths, total = (np.arange(count) + 0.5) * 360.0 / count, 0.0
        for low, high in itertools.pairwise(self._distances()):
            u, v = np.meshgrid(azimuths, 0.5 * (low + high) + 0.5 * (high - low) * x, indexing="ij")
            points = self.chart(np.zeros(1, dtype=int), u, v)
            meridian, vertical = self.figure.radii(points.lat)
            density = np.abs(points.east_u * points.north_v - points.east_v * points.north_u) * meridian * vertical
            total += float((density @ weights).mean() * 360.0 * 0.5 * (high - low) / 1e6)
        return total

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """True for points in degrees in the cap, its edge included."""
        lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        phi, phi0 = _DEGREE * lat, _DEGREE * self.lat
        lam = _DEGREE * (lon - self.lon)
        haversine = np.sin((phi - phi0) / 2) ** 2 + math.cos(phi0) * np.cos(phi) * np.sin(lam / 2) ** 2
        if self.figure.is_sphere:
            return np.asarray(haversine <= math.sin(_DEGREE * self.angle / 2) ** 2 * (1 + 1e-12))
        north = math.cos(phi0) * np.sin(phi) - math.sin(phi0) * np.cos(phi) * np.cos(lam)
        azimuth = np.degrees(np.arctan2(np.cos(phi) * np.sin(lam), north))
        beyond = 2.0 * np.arcsin(np.sqrt(np.minimum(haversine, 1.0))) - _DEGREE * self.reach(azimuth)
        inside = np.asarray(beyond <= 0.0)
        near = np.abs(beyond) < self._rim.margin
        if near.any():
            start = np.full(int(near.sum()), self.lon), np.full(int(near.sum()), self.lat)
            length = geodesic_inverse(self.figure, *start, lon[near], lat[near])[0]
            inside[near] = length <= 1000.0 * self.radius_km + _ON_RIM * self.figure.a
        return inside

    def panels(self, discontinuities: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """One patch in azimuth and distance, in degrees."""
        sides = itertools.product(itertools.pairwise(np.linspace(0.0, 360.0, 5)), itertools.pairwise(self._distances()))
        rectangles = np.array([(*azimuths, *distances) for azimuths, distances in sides])
        return np.zeros(len(rectangles), dtype=int), rectangles

    def _distances(self) -> FloatArray:
        """Distances at which panels end."""
        round_to = self._rim.round_to
        ends = [round_to, self.angle] if round_to else [self.angle]
        return np.append(np.linspace(0.0, ends[0], math.ceil(ends[0] / _LONGEST) + 1), ends[1:])

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """Chart with the azimuth u from the centre and the distance v, as on a sphere with the same latitudes.

        v runs to `angle` in all directions: beyond `round_to` it is scaled to the `reach` in each direction.
        """
        share, slope = self._share(u)
        round_to, width = self._rim.round_to, self.angle - self._rim.round_to
        outer = (v - round_to) / width
        stretch, turn = (share * self.angle - round_to) / width, _DEGREE * self.angle * slope * outer
        distance = round_to + outer * (share * self.angle - round_to)
        if round_to:
            inside = v < round_to
            distance, stretch, turn = np.where(inside, v, distance), np.where(inside, 1.0, stretch), turn * ~inside
        points = _about(self.lon, self.lat, u, distance)
        return points._replace(
            east_u=points.east_u + turn * points.east_v,
            east_v=stretch * points.east_v,
            north_u=points.north_u + turn * points.north_v,
            north_v=stretch * points.north_v,
        )

    # ---- the rim ------------------------------------------------------------------------

    def _share(self, azimuth: FloatArray) -> tuple[FloatArray | float, FloatArray | float]:
        """Reach divided by its maximum, and its derivative by the azimuth in radians."""
        largest, series = self._rim[:2]
        if len(series) == 1:
            return 1.0, 0.0
        # Nodes of a lattice repeat azimuths, each of which is evaluated once, as a series may be long.
        angles, index = np.unique(_DEGREE * azimuth, return_inverse=True)
        cos = np.cos(angles)
        share = np.asarray(chebval(cos, series / largest), dtype=float)
        slope = np.asarray(-np.sin(angles) * chebval(cos, chebder(series / largest)))
        index = index.reshape(azimuth.shape)
        return np.asarray(share[index], dtype=float), np.asarray(slope[index], dtype=float)

    @functools.cached_property
    def _rim(self) -> _Rim:
        """The rim, by azimuth."""
        metres, figure = 1000.0 * self.radius_km, self.figure
        if figure.is_sphere:
            angle = min(180.0, math.degrees(metres / figure.a))
            return _Rim(angle, np.array([angle]), 0.0, 0.0)
        ends = (np.array([one]) for one in (self.lon, self.lat, self.lon + 180.0, -self.lat))
        if metres >= geodesic_inverse(figure, *ends)[0][0]:  # the antipode, the farthest point
            return _Rim(180.0, np.array([180.0]), _NEAR_RIM, 0.0)
        for degree in _DEGREES:
            angles = (np.arange(degree + 1) + 0.5) * math.pi / (degree + 1)
            waves = np.cos(np.arange(degree + 1)[:, None] * angles)
            series = waves @ reaches(figure, self.lon, self.lat, np.degrees(angles), metres) * 2.0 / (degree + 1)
            series[0] *= 0.5
            margin = _NEAR_RIM if np.abs(series[-degree // 4 :]).max() < _RESOLVED else _NEAR_CORNERS
            if margin == _NEAR_RIM:
                break
        known = np.flatnonzero(np.abs(series) > 0.1 * _RESOLVED * min(1.0, series[0]))
        series = series[: known[-1] + 1]
        around = chebval(np.cos(np.linspace(0.0, math.pi, 2 * _DEGREES[-1] + 1)), series)
        # Only the rim of the small complement varies, so that all beyond a ring twice as wide stays circular.
        round_to = max(0.0, 180.0 - 2.0 * (180.0 - float(around.min()))) if margin == _NEAR_CORNERS else 0.0
        return _Rim(min(180.0, float(around.max())), series, margin, round_to)


def reaches(ellipsoid: Ellipsoid, lon: ArrayLike, lat: ArrayLike, azimuth: ArrayLike, metres: float) -> FloatArray:
    """Degrees of arc of a geodesic distance from places by azimuth, with latitudes taken as those of a sphere."""
    # All arguments but `metres` are in degrees and broadcast. By Newton's method, safeguarded by bisection.
    lon, lat, azimuth = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (lon, lat, azimuth)))
    mean = math.degrees(metres / ellipsoid.mean_radius)
    if ellipsoid.is_sphere:
        return np.full(lon.shape, min(mean, 180.0))
    if metres < _FLAT * ellipsoid.a:
        meridian, vertical = ellipsoid.radii(lat)
        return np.degrees(metres / np.hypot(meridian * np.cos(_DEGREE * azimuth), vertical * np.sin(_DEGREE * azimuth)))
    low, high = np.zeros(lon.shape), np.full(lon.shape, 180.0)
    reach = np.full(lon.shape, min(mean, 90.0 + 0.5 * mean, 180.0))
    for _ in range(_MOST_STEPS):
        points = _about(lon, lat, azimuth, reach)
        length, _, course = geodesic_inverse(ellipsoid, lon, lat, points.lon, points.lat)
        low, high = np.where(length < metres, reach, low), np.where(length < metres, high, reach)
        meridian, vertical = ellipsoid.radii(points.lat)
        east, north = np.sin(_DEGREE * course), np.cos(_DEGREE * course)
        with np.errstate(divide="ignore", invalid="ignore"):
            better = reach + (metres - length) / (vertical * points.east_v * east + meridian * points.north_v * north)
        better = np.where((low < better) & (better < high), better, 0.5 * (low + high))
        moved, reach = np.abs(better - reach).max(initial=0.0), better
        if moved < _RESOLVED:
            break
    return reach


def _about(lon: ArrayLike, lat: ArrayLike, azimuth: FloatArray, distance: FloatArray) -> ChartPoints:
    """Points at azimuths and distances in degrees from others on a sphere, with their derivatives by these."""
    lat = np.asarray(lat, dtype=float)
    sin0, cos0 = np.sin(_DEGREE * lat), np.cos(_DEGREE * lat)
    sin_a, cos_a = np.sin(_DEGREE * azimuth), np.cos(_DEGREE * azimuth)
    sin_c, cos_c = np.sin(_DEGREE * distance), np.cos(_DEGREE * distance)
    # Unit vectors with the centre on the x-z plane: the point, its radial and its transverse velocity.
    x, y = cos_c * cos0 - sin_c * cos_a * sin0, sin_c * sin_a
    z = cos_c * sin0 + sin_c * cos_a * cos0
    radial = (-sin_c * cos0 - cos_c * cos_a * sin0, cos_c * sin_a, -sin_c * sin0 + cos_c * cos_a * cos0)
    across = (sin_c * sin_a * sin0, sin_c * cos_a, -sin_c * sin_a * cos0)
    rho = np.hypot(x, y)
    east = (-y / rho, x / rho)
    north = (-z * x / rho, -z * y / rho, rho)
    return ChartPoints(
        lon + np.degrees(np.arctan2(y, x)),
        np.degrees(np.arctan2(z, rho)),
        _DEGREE * (across[0] * east[0] + across[1] * east[1]),
        _DEGREE * (radial[0] * east[0] + radial[1] * east[1]),
        _DEGREE * (across[0] * north[0] + across[1] * north[1] + across[2] * north[2]),
        _DEGREE * (radial[0] * north[0] + radial[1] * north[1] + radial[2] * north[2]),
    )
