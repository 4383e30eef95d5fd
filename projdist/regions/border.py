"""Where the border of a region runs: which boxes it crosses, so that others need one look only."""

from __future__ import annotations

import numpy as np
import shapely

from projdist._typing import BoolArray, FloatArray
from projdist.regions.combined import polygons_of
from projdist.regions.region import Region


class Border:
    """The edges of a region within longitudes -180 to 180, also those along the antimeridian where it is cut."""

    def __init__(self, region: Region) -> None:
        rings = shapely.get_rings(shapely.get_parts(polygons_of(region)))
        points, ring = shapely.get_coordinates(rings, return_index=True)
        edges = np.stack([points[:-1], points[1:]], axis=1)[ring[1:] == ring[:-1]]
        self._tree = shapely.STRtree(shapely.linestrings(edges))

    def crosses(self, boxes: FloatArray) -> BoolArray:
        """Whether edges may cross boxes (n, 4) of west, south, east, north; where in doubt they do.

        Boxes have any longitudes; one that leaves -180 to 180 is in doubt.
        """
        west, south, east, north = boxes.T
        turns = 360.0 * np.floor((west + 180.0) / 360.0)
        doubt = ~np.isfinite(boxes).all(axis=1) | (east - turns > 180.0)
        result = doubt.copy()
        known = np.flatnonzero(~doubt)
        found = shapely.box((west - turns)[known], south[known], (east - turns)[known], north[known])
        result[known[np.unique(self._tree.query(found, predicate="intersects")[0])]] = True
        return result
