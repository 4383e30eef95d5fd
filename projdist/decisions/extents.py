"""How far a region reaches: its middle, its radius and its long axis, and the CRS that is usual there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist.earth import WGS84, unit_vectors
from projdist.field import nodes_of
from projdist.regions import Place

__all__ = ["Extent", "extent_of", "usual_crs"]


@dataclass(frozen=True, kw_only=True)
class Extent:
    """How far a region reaches: its limits and its middle in degrees, and the azimuth of its long axis.

    `radius` is the greatest distance from the middle.
    """

    west: float
    south: float
    east: float
    north: float
    lon: float
    lat: float
    radius: float
    azimuth: float


def extent_of(region: Place) -> Extent:
    """The extent of a region."""
    nodes = nodes_of(region, WGS84, 400, edges=True)
    points = unit_vectors(nodes.lon, nodes.lat)
    middle = points @ nodes.weight
    west, south, east, north = region.bounds
    if np.linalg.norm(middle) < 1e-6:  # the globe has no middle
        return Extent(
            west=west, south=south, east=east, north=north, lon=0.5 * (west + east), lat=0.0, radius=180.0, azimuth=90.0
        )
    middle /= np.linalg.norm(middle)
    lon, lat = np.degrees(np.arctan2(middle[1], middle[0])), np.degrees(np.arcsin(np.clip(middle[2], -1.0, 1.0)))
    sin, cos = np.sin(np.radians(lon)), np.cos(np.radians(lon))
    east_part = points.T @ np.array([-sin, cos, 0.0])
    north_part = points.T @ np.cross(middle, np.array([-sin, cos, 0.0]))
    parts = np.stack([east_part, north_part])
    parts = parts - (parts @ nodes.weight)[:, None]
    axes = np.linalg.eigh((parts * nodes.weight) @ parts.T)[1]
    azimuth = float(np.mod(np.degrees(np.arctan2(axes[0, 1], axes[1, 1])) + 90.0, 180.0) - 90.0)
    radius = float(np.degrees(np.arccos(np.clip((middle @ points).min(), -1.0, 1.0))))
    # Next to a pole the middle has any longitude.
    lon = float(west + np.mod(lon - west, 360.0)) if abs(lat) < 89.9 else 0.5 * (west + east)
    return Extent(
        west=west, south=south, east=east, north=north, lon=lon, lat=float(lat), radius=radius, azimuth=azimuth
    )


def usual_crs(extent: Extent) -> tuple[str, str]:
    """The UTM zone of the region's middle, or the polar stereographic maps beyond 84 degrees."""
    if abs(extent.lat) > 84.0:
        return "UPS", "EPSG:32661" if extent.lat > 0 else "EPSG:32761"
    zone = int((extent.lon + 180.0) % 360.0 // 6.0) + 1
    hemisphere, letter = ("326", "N") if extent.lat >= 0 else ("327", "S")
    return f"UTM {zone}{letter}", f"EPSG:{hemisphere}{zone:02d}"
