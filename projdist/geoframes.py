"""Answers for geopandas; it is not imported, but asked through the frame that is given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist.projections.database import CRS, to_pyproj
from projdist.recommend import recommend
from projdist.regions import Box, Region

__all__ = ["bounding_box", "estimate_crs"]

_MOST = 50_000  # vertices: twice the time that a box takes; more do not tell more of which CRS is the best
_SMALLEST = 0.01  # degrees: the box of a single point is a kilometre wide


def estimate_crs(frame: Any, *, purpose: str = "any", **options: Any) -> CRS:
    """The best existing CRS for the data of a GeoDataFrame or GeoSeries, as pyproj's.

    The region is the polygons themselves; of points, lines, and polygons with more than 50,000 vertices it is the
    narrowest box in longitude and latitude about them, across the antimeridian where that is narrower. `purpose` and
    `options` are those of `recommend`. Raises ValueError.
    """
    if frame.crs is None:
        raise ValueError("Invalid data. It must have a CRS: set it with frame.set_crs(...).")
    region = _region_of(frame.geometry.to_crs("OGC:CRS84"))
    found = recommend(region, purpose=purpose, **(options | {"limit": 1})).results
    if not found:
        raise ValueError(f"Invalid purpose '{purpose}' for {region.name}. No CRS serves it there.")
    return to_pyproj(found[0].code)


def _region_of(shapes: Any) -> Region:
    """The region of a GeoSeries in longitude and latitude."""
    shapes = shapes[~(shapes.isna() | shapes.is_empty)]
    if not len(shapes):
        raise ValueError("Invalid data. It must have a geometry that is not empty.")
    polygons = shapes.geom_type.isin(("Polygon", "MultiPolygon")).all() and shapes.is_valid.all()
    if polygons and len(shapes.get_coordinates()) <= _MOST:
        from projdist.regions.files import polygons_from_geojson  # shapely is slow to load

        return polygons_from_geojson(shapes.__geo_interface__, "the polygons")
    parts = shapes.explode(index_parts=False).bounds
    return bounding_box(*(parts[name].to_numpy() for name in ("minx", "miny", "maxx", "maxy")))


def bounding_box(west: ArrayLike, south: ArrayLike, east: ArrayLike, north: ArrayLike) -> Box:
    """The narrowest box about boxes in degrees, each west <= east; it may cross the antimeridian."""
    start = np.mod(np.asarray(west, dtype=float), 360.0)
    order = np.argsort(start)
    end = np.maximum.accumulate((start + np.subtract(east, west))[order])
    end = np.maximum(end, end[-1] - 360.0)
    # The box is what the widest gap between the end of some and the start of the next leaves.
    following = np.append(start[order][1:], start[order][0] + 360.0)
    widest = int(np.argmax(following - end))
    width = min(360.0 - float(following[widest] - end[widest]), 360.0)
    low, high = float(np.min(south)), float(np.max(north))
    if width < _SMALLEST:
        following[widest] -= 0.5 * (_SMALLEST - width)
        width = _SMALLEST
    if high - low < _SMALLEST:
        low = min(max(0.5 * (low + high - _SMALLEST), -90.0), 90.0 - _SMALLEST)
        high = low + _SMALLEST
    first = (float(following[widest]) + 180.0) % 360.0 - 180.0
    last = (first + width + 180.0) % 360.0 - 180.0
    return Box(-180.0, low, 180.0, high) if width == 360.0 else Box(first, low, last, high)
