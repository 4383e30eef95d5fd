"""Cuts of the globe from a point to its antipode, along which the world is unrolled.

The frame of a cut has the first point for its south pole, the last for its north pole; the cut is where the frame's
longitude has a certain value, which may change with the frame's latitude.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from projdist._typing import FloatArray
from projdist.support import check_degrees, check_number

__all__ = ["Cut", "CutLike", "Frame", "get_cut"]

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_HALF, _WHOLE = 180.0, 360.0
_APART = 1e-6  # degrees between points of a cut, at least

CutLike = float | Sequence[Sequence[float]]


@dataclass(frozen=True)
class Frame:
    """Longitudes and latitudes about other poles, by the formulas and the parameters of PROJ's ob_tran.

    The frame's north pole lies at the latitude `lat_p` on the meridian opposite to `lon_0`; `lon_p` is added to its
    longitudes.
    """

    lon_0: float
    lat_p: float
    lon_p: float

    def of(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes in the frame, degrees."""
        lam, phi, tilt = np.radians(lon - self.lon_0), np.radians(lat), np.radians(self.lat_p)
        ahead = np.cos(phi) * np.cos(lam)
        x = np.sin(tilt) * ahead + np.cos(tilt) * np.sin(phi)
        y, z = np.cos(phi) * np.sin(lam), np.sin(tilt) * np.sin(phi) - np.cos(tilt) * ahead
        return _turned(np.degrees(np.arctan2(y, x)) + self.lon_p), np.degrees(np.arctan2(z, np.hypot(x, y)))

    def back(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes of points in the frame."""
        lam, phi, tilt = np.radians(lon - self.lon_p), np.radians(lat), np.radians(self.lat_p)
        ahead = np.cos(phi) * np.cos(lam)
        x = np.sin(tilt) * ahead - np.cos(tilt) * np.sin(phi)
        y, z = np.cos(phi) * np.sin(lam), np.cos(tilt) * ahead + np.sin(tilt) * np.sin(phi)
        return _turned(np.degrees(np.arctan2(y, x)) + self.lon_0), np.degrees(np.arctan2(z, np.hypot(x, y)))

    @property
    def step(self) -> str:
        """PROJ's operation, radians to radians."""
        return (
            f"+proj=ob_tran +o_proj=longlat +o_lat_p={self.lat_p!r} +o_lon_p={self.lon_p!r} +lon_0={self.lon_0!r} +R=1"
        )


@dataclass(frozen=True)
class Cut:
    """Where the world is cut: in a frame, or the globe's own, through points (m, 2) whose latitudes ascend.

    Between its points it is a cubic spline of the latitude, along a meridian at either end.
    """

    name: str
    frame: Frame | None
    points: tuple[tuple[float, float], ...]

    @property
    def is_straight(self) -> bool:
        """Whether it is half of a great circle."""
        return len(self.points) == 1

    def at(self, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The cut's longitude in degrees, at latitudes of the frame, and how fast it grows with the latitude."""
        if self.is_straight:
            return np.full(np.shape(lat), self.points[0][0]), np.zeros(np.shape(lat))
        return np.asarray(self._curve(lat)), np.asarray(self._curve(lat, 1))

    @functools.cached_property
    def _curve(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline  # slow to load

        lon, lat = np.array(self.points).T
        return CubicSpline(np.r_[-90.0, lat, 90.0], np.r_[lon[0], lon, lon[-1]], bc_type="clamped")

    def unrolled(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes from the middle of the sheet, within -pi and pi, and latitudes of the frame, in radians."""
        if self.frame is not None:
            lon, lat = self.frame.of(lon, lat)
        return np.radians(_turned(lon - (self.at(lat)[0] - _HALF))), np.radians(lat)

    def rolled(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes in degrees of points of the sheet."""
        lat = np.degrees(v)
        lon = _turned(np.degrees(u) + self.at(lat)[0] - _HALF)
        return (lon, lat) if self.frame is None else self.frame.back(lon, lat)


def get_cut(given: CutLike) -> Cut:
    """The cut along a meridian, or from a point through others to the antipode of the first; raises ValueError."""
    if isinstance(given, Cut):
        return given
    if isinstance(given, str) or not isinstance(given, Iterable):
        lon = check_number("cut", given)
        if not abs(lon) <= _WHOLE:
            raise ValueError(f"Invalid cut '{given}'. Its longitude must be within -360 and 360.")
        return Cut(f"{lon:g}", None, ((lon, 0.0),))
    return _through(given)


def _through(given: Any) -> Cut:
    """A cut from the first of two or more points (lon, lat) to its antipode."""
    try:
        points = np.array(list(given), dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError("Invalid cut. Its points must be pairs of a longitude and a latitude.") from error
    if points.ndim != 2 or points.shape[0] < 2 or points.shape[1] != 2:
        raise ValueError("Invalid cut. It must be a longitude, or two or more points, each a longitude and a latitude.")
    lon, lat = check_degrees(points[:, 0], points[:, 1])
    if not (np.all(np.abs(lon) <= _WHOLE) and np.all(np.abs(lat) <= 90.0)):
        raise ValueError("Invalid cut. Latitudes must be within -90 and 90, longitudes within -360 and 360.")
    name = " ".join(f"{x:g},{y:g}" for x, y in points)
    frame = Frame(float(lon[0]), -float(lat[0]), 0.0)  # the antipode of the first point is its north pole
    own_lon, own_lat = frame.of(lon[1:], lat[1:])
    if not np.all(np.diff(np.r_[-90.0, own_lat, 90.0]) > _APART):
        raise ValueError(f"Invalid cut '{name}'. Each of its points must be farther from the first than those before.")
    frame = Frame(frame.lon_0, frame.lat_p, float(_HALF - own_lon[0]))
    own_lon = np.unwrap(np.r_[_HALF, _turned(own_lon[1:] + frame.lon_p)], period=_WHOLE)
    return Cut(name, frame, tuple(zip(own_lon.tolist(), own_lat.tolist(), strict=True)))


def _turned(lon: FloatArray) -> FloatArray:
    """Longitudes within -180 and 180, which stay as they are."""
    return np.where(np.abs(lon) <= _HALF, lon, np.mod(lon + _HALF, _WHOLE) - _HALF)
