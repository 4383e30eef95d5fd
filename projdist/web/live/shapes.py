"""Lines of longitude and latitude that a page draws over its maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.regions import Place, polygons_of, region_title
from projdist.web.frames import Arrays

_MOST = 4000  # points of a region
_MOST_OF_FEATURE = 500


def outline(region: Place) -> tuple[dict[str, Any], Arrays]:
    """The border of a region, to be moved over a map, with its title and its middle; raises ValueError."""
    if not region.area_km2 or region.bounds[2] - region.bounds[0] >= 360.0:
        raise ValueError("Only a region that is a part of the globe can be moved over a map.")
    rings = shapely.get_rings(shapely.get_parts(polygons_of(region)))
    lines = [shapely.get_coordinates(ring) for ring in rings]
    step = max(1, sum(map(len, lines)) // _MOST)
    west, south, east, north = region.bounds
    header = {"title": region_title(region), "middle": [0.5 * (west + east), 0.5 * (south + north)]}
    return header, packed_lines([line[::step] for line in lines if len(line) > 2 * step])


def feature_lines(geometries: Sequence[Any]) -> Arrays:
    """The longest line of each geometry, with no more points than are seen."""
    return packed_lines([_longest(geometry) for geometry in geometries])


def _longest(geometry: Any) -> FloatArray:
    rings = shapely.get_rings(shapely.get_parts(geometry))
    parts = rings if rings.size else shapely.get_parts(geometry)
    longest = max(map(shapely.get_coordinates, parts), key=len, default=np.empty((0, 2)))
    return longest[:: max(1, len(longest) // _MOST_OF_FEATURE)]


def packed_lines(lines: Sequence[FloatArray]) -> Arrays:
    """Lines as points one after the other, and how many each has."""
    return {
        "points": np.concatenate([np.empty((0, 2)), *lines]).astype(np.float32),
        "sizes": np.array([len(line) for line in lines], dtype=np.uint32),
    }
