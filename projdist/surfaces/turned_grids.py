"""The turn of the globe in which a map's singular point is a pole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.surfaces.domain import POLE, Domain, longitude_width, normalised, rough_scales


@dataclass(frozen=True)
class Frame:
    """A turn of the globe: columns are the grid's axes in geographic coordinates; None is no turn."""

    axes: FloatArray | None = None

    def geographic(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude of grid coordinates, in degrees."""
        if self.axes is None:
            return u, v
        u, v = np.radians(u), np.radians(v)
        point = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1) @ self.axes.T
        return (
            np.degrees(np.arctan2(point[..., 1], point[..., 0])),
            np.degrees(np.arctan2(point[..., 2], np.hypot(point[..., 0], point[..., 1]))),
        )


_SINGULAR = 1e4  # of the median scale, 1e-3 degrees from the point; one over the distance is 57 000


def frame_of(domain: Domain) -> Frame:
    """A frame with a pole at the singular point of the map, if that is not a pole of the Earth."""
    if longitude_width(domain.box.bounds) < 180.0:
        return Frame()
    survey = domain.survey
    scale = np.where(domain.surveyed() & np.isfinite(survey.a), survey.a, np.nan)
    if not np.isfinite(scale).any():
        return Frame()
    usual = float(np.nanmedian(scale))
    best = int(np.nanargmax(scale))
    lon, lat, span = float(survey.lon.flat[best]), float(survey.lat.flat[best]), 2.0
    offsets = np.linspace(-1.0, 1.0, 9)
    while span > 1e-4:
        lons = lon + span * offsets[:, None] / max(np.cos(np.radians(lat)), 1e-3)
        lats = np.clip(lat + span * offsets[None, :], -POLE, POLE)
        lons, lats = np.broadcast_arrays(lons, lats)
        images = domain.projection(normalised(lons), lats)
        scale = np.nan_to_num(rough_scales(domain.projection, normalised(lons), lats, *images)[0], nan=0.0)
        best = int(np.argmax(scale))
        lon, lat, span = float(lons.flat[best]), float(lats.flat[best]), span / 3.0
    if scale.flat[best] < _SINGULAR * usual or abs(lat) > 89.5:
        return Frame()
    lon, lat = np.radians(lon), np.radians(lat)
    pole = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    return Frame(np.column_stack([np.cross(east, pole), east, pole]))
