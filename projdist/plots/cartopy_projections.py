"""A projection as a CRS of cartopy's."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import shapely

from projdist._typing import FloatArray
from projdist.projections import Projection

_THRESHOLD = 5e-4  # of a map's shorter side, as cartopy has it for Robinson's map


def cartopy_projection(source: Projection, wkt: str, to_metres: FloatArray, polygon: shapely.Polygon) -> Any:
    """The CRS of a map whose edge, in metres, is that of a polygon, with coordinates in the CRS's own unit."""
    return _class()(source, wkt, to_metres, polygon)


@functools.cache
def _class() -> Any:
    """The class of such CRSs."""
    import cartopy.crs  # an extra

    class MeasuredProjection(cartopy.crs.Projection):  # type: ignore[misc]  # cartopy has no types
        """A projection of projdist as cartopy has them: `source` is the projection, `to_metres` a matrix (2, 2)."""

        def __init__(self, source: Projection, wkt: str, to_metres: FloatArray, polygon: shapely.Polygon) -> None:
            super().__init__(wkt)
            self.source, self.to_metres = source, to_metres
            self._given = source, wkt, to_metres, polygon
            metres = shapely.get_coordinates(polygon.exterior)
            self._edge = shapely.LinearRing(np.linalg.solve(to_metres, metres.T).T)
            west, south, east, north = self._edge.bounds
            self.bounds = west, east, south, north
            self.threshold = _THRESHOLD * min(east - west, north - south)

        @property
        def boundary(self) -> shapely.LinearRing:
            """The edge of the map."""
            return self._edge

        def __repr__(self) -> str:
            return f"<cartopy CRS of {self.source.name}>"

        def __reduce__(self) -> tuple[Any, ...]:
            return cartopy_projection, self._given

    return MeasuredProjection
