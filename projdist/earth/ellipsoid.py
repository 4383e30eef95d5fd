"""The ellipsoid, points on the sphere, discontinuities of maps, longitudes and latitudes as text, shipped tables."""

from __future__ import annotations

import csv
import functools
import importlib.resources
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import ArrayLike, FloatArray

_EARTHLY = 6.35e6, 6.45e6  # metres
_LARGEST_GLOBE = 100.0  # metres; the smallest body that PROJ knows, Itokawa, has 173


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid of revolution: semi-major axis `a` in metres, flattening `f`.

    Formulas: Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, pages 16-25.
    """

    a: float
    f: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.a) and self.a > 0):
            raise ValueError(f"Invalid semi-major axis '{self.a}'. It must be positive, in metres.")
        if not 0 <= self.f < 1:
            raise ValueError(f"Invalid flattening '{self.f}'. It must be at least 0 and below 1.")

    @property
    def eccentricity_squared(self) -> float:
        """e^2 = f (2 - f)."""
        return self.f * (2.0 - self.f)

    @property
    def is_sphere(self) -> bool:
        """True if the flattening is zero."""
        return self.f == 0.0

    @property
    def is_earthly(self) -> bool:
        """True if it has the size of the Earth."""
        return _EARTHLY[0] < self.a < _EARTHLY[1]

    @property
    def is_of_another_body(self) -> bool:
        """True if it has the size of another planet or moon, not of a globe, and not of the Earth in kilometres."""
        return self.a > _LARGEST_GLOBE and not any(_EARTHLY[0] < a < _EARTHLY[1] for a in (self.a, 1000.0 * self.a))

    @property
    def ground(self) -> Ellipsoid:
        """The ellipsoid on which regions and distances for maps of this one are measured, whatever its scale."""
        # For another body it is the ellipsoid itself, for the Earth the mean sphere if this is a sphere, else WGS 84.
        if self.is_of_another_body:
            return self
        return SPHERE if self.is_sphere else WGS84

    @property
    def mean_radius(self) -> float:
        """(2 a + b) / 3 in metres."""
        return self.a * (1.0 - self.f / 3.0)

    def is_close(self, other: Ellipsoid) -> bool:
        """True if another is equal up to rounding; GRS 80 and WGS 84 are not: their f differ by 1.6e-11, 0.1 mm."""
        return abs(self.a - other.a) < 1e-9 * self.a and abs(self.f - other.f) < 1e-13

    def radii(self, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Radii of curvature (M, N) in metres, meridian and prime vertical, at latitudes (Snyder 1987, 4-18, 4-20)."""
        if self.is_sphere:
            radius = np.full(np.shape(lat), self.a)
            return radius, radius.copy()
        sin = np.sin(np.radians(lat))
        w2 = 1.0 - self.eccentricity_squared * sin * sin
        prime_vertical = self.a / np.sqrt(w2)
        return prime_vertical * ((1.0 - self.eccentricity_squared) / w2), prime_vertical

    def area_below(self, lat: ArrayLike) -> FloatArray:
        """Area in m^2 per radian of longitude between the equator and latitudes (Snyder 1987, 3-12 times a^2 / 2)."""
        sin = np.sin(np.radians(lat))
        e2 = self.eccentricity_squared
        if e2 == 0.0:
            return np.asarray(self.a**2 * sin)
        e = math.sqrt(e2)
        q = (1.0 - e2) * (sin / (1.0 - e2 * sin * sin) + np.arctanh(e * sin) / e)
        return np.asarray(0.5 * self.a**2 * q)

    @property
    def area(self) -> float:
        """Area of the whole surface in m^2."""
        return float(4.0 * math.pi * self.area_below(90.0))


MEAN_EARTH_RADIUS = 6371008.7714
"""Mean radius (2a + b) / 3 of GRS 80 and WGS 84 in metres (Moritz 1980, "Geodetic Reference System 1980")."""

SPHERE = Ellipsoid(MEAN_EARTH_RADIUS)
WGS84 = Ellipsoid(6378137.0, 1 / 298.257223563)


# ---- points on the sphere ------------------------------------------------------------------------


def destination(
    lon: ArrayLike, lat: ArrayLike, azimuth: ArrayLike, distance: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Longitude and latitude at a distance along great circles, by azimuth from north; all in degrees, broadcast."""
    # Exact also at the poles, where north is along the meridian `lon`.
    turn, arc, lat = (np.radians(value) for value in (azimuth, distance, lat))
    east, north, up = np.sin(arc) * np.sin(turn), np.sin(arc) * np.cos(turn), np.cos(arc)
    axial, meridional = up * np.sin(lat) + north * np.cos(lat), up * np.cos(lat) - north * np.sin(lat)
    return (
        np.asarray(lon + np.degrees(np.arctan2(east, meridional))),
        np.degrees(np.arctan2(axial, np.hypot(meridional, east))),
    )


def unit_vectors(lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Points in degrees as unit vectors, shape (3, ...)."""
    lon, lat = np.broadcast_arrays(np.radians(lon), np.radians(lat))
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def wrapped(lon: ArrayLike) -> FloatArray:
    """Longitudes moved by whole turns into -180 to 180 degrees; those already there keep every digit."""
    lon = np.array(lon, dtype=float)
    outside = np.abs(lon) > 180.0
    lon[outside] = np.mod(lon[outside] + 180.0, 360.0) - 180.0
    return lon


def chord_angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """Angles in radians between unit vectors (3, ...), exact to rounding if small and to 1e-8 near half a turn."""
    square = sum(np.square(a - b) for a, b in zip(one, other, strict=True))
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(square), 1.0)))


class Discontinuities(NamedTuple):
    """Lines along which a map is torn or bent: parallels, and meridians by hemisphere, in degrees."""

    parallels: tuple[float, ...]
    northern: tuple[float, ...]
    southern: tuple[float, ...]


SMOOTH = Discontinuities((), (), ())
"""No known discontinuities."""


# ---- degrees as text -----------------------------------------------------------------------------


def longitude_text(lon: float, *, minutes: bool = False) -> str:
    """A longitude in degrees as 10.5°E, or in degrees, minutes and seconds as 10°30′E."""
    turned = (lon + 180.0) % 360.0 - 180.0
    return _text(180.0 if turned == -180.0 else turned, "EW", 180.0, minutes)


def latitude_text(lat: float, *, minutes: bool = False) -> str:
    """A latitude in degrees as 10.5°S, or in degrees, minutes and seconds as 10°30′S."""
    return _text(lat, "NS", 90.0, minutes)


def _text(value: float, letters: str, end: float, minutes: bool) -> str:
    if minutes:  # and seconds to hundredths, without trailing zeros
        degrees, rest = divmod(int(np.rint(abs(value) * 360_000.0)), 360_000)
        minute, hundredths = divmod(rest, 6_000)
        second = f"{hundredths / 100.0:05.2f}".rstrip("0").rstrip(".") + "″" if hundredths else ""
        text = f"{degrees}°" + (f"{minute:02d}′" if rest else "") + second
    else:
        text = f"{abs(value):.7g}°"
    # The equator, the prime meridian and its antimeridian get no letter.
    return text + ("" if value == 0.0 or (end == 180.0 and value == end) else letters[int(value < 0)])


@functools.cache
def data_rows(name: str) -> tuple[dict[str, str], ...]:
    """The rows of a CSV file shipped in projdist/data, by column; they are cached, so do not change them."""
    file = importlib.resources.files("projdist") / "data" / name
    return tuple(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))
