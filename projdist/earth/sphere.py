"""Points of the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray

__all__ = ["chord_angle", "destination", "unit_vectors"]


def destination(
    lon: ArrayLike, lat: ArrayLike, azimuth: ArrayLike, distance: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Longitude and latitude of the points at a distance along great circles; all in degrees, broadcast together.

    The azimuth is clockwise from north. Exact at the poles, too, where north is along the meridian `lon`.
    """
    turn, arc, lat = (np.radians(value) for value in (azimuth, distance, lat))
    east, north, up = np.sin(arc) * np.sin(turn), np.sin(arc) * np.cos(turn), np.cos(arc)
    axial, meridional = up * np.sin(lat) + north * np.cos(lat), up * np.cos(lat) - north * np.sin(lat)
    return (
        np.asarray(lon + np.degrees(np.arctan2(east, meridional))),
        np.degrees(np.arctan2(axial, np.hypot(meridional, east))),
    )


def unit_vectors(lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Points in degrees as vectors from the centre, shape (3, ...)."""
    lon, lat = np.broadcast_arrays(np.radians(lon), np.radians(lat))
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])


def chord_angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """The angles in radians between unit vectors (3, ...), which broadcast; from the chord between their ends.

    To rounding where they are near each other, and to 1e-8 where they are opposite.
    """
    square = np.square(one[0] - other[0])
    square += np.square(one[1] - other[1])
    square += np.square(one[2] - other[2])
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(square), 1.0)))
