"""Points of the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray

__all__ = ["destination"]


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
