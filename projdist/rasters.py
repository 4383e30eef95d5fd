"""The Jacobian on a raster, at one evaluation of the projection a point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.derivatives import jacobian
from projdist.projections import Projection

__all__ = ["jacobian_grid"]

# Central weights over one to four neighbours on each side, for the first derivative times the spacing, and
# what they are more than those of sixth order.
_EIGHTH = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_BEYOND_SIXTH = _EIGHTH - np.array([3 / 4, -3 / 20, 1 / 60, 0.0])
# The difference of the two orders falls as (spacing / distance of the singularity)^6, eighth order's own error
# as ^8: 1e-8 of the one is 2e-11 of the other.
_GRID_TARGET = 1e-8
_GRID_ROWS = 16  # at a time: their arrays stay in the cache


def jacobian_grid(projection: Any, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """The Jacobian on a raster of evenly spaced lon (m,) and lat (n,), shape (n, m, 2, 2).

    One evaluation of the projection a point: the raster's own neighbours are the stencil. Where
    orders six and eight differ by more than 1e-8 of J (seams, poles, the raster's rim, coarse
    rasters) the points are done one by one as by `jacobian`. Raises ValueError for uneven spacing.
    """
    projection = Projection.from_user_input(projection)
    lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
    for name, values in (("longitudes", lon), ("latitudes", lat)):
        if values.ndim != 1 or not np.allclose(np.diff(values), np.diff(values)[:1], rtol=1e-6, atol=0):
            raise ValueError(f"Invalid {name} of a raster. They must be evenly spaced along one axis.")
    J = np.full((lat.size, lon.size, 2, 2), np.nan)
    hard = np.ones((lat.size, lon.size), dtype=bool)
    if lon.size > 8 and lat.size > 8:
        _difference_grid(projection, lon, lat, J[4:-4, 4:-4], hard[4:-4, 4:-4])
    rows, columns = np.nonzero(hard)
    J[rows, columns] = jacobian(projection, lon[columns], lat[rows])
    return J


def _difference_grid(projection: Projection, lon: FloatArray, lat: FloatArray, J: FloatArray, hard: BoolArray) -> None:
    """Differences along the rows and columns of a raster, written into its inner part J; and which are not good."""
    meridian, vertical = projection.ellipsoid.radii(lat)
    per_east = 1.0 / (np.radians(lon[1] - lon[0]) * vertical * np.cos(np.radians(lat)))[:, None]
    per_north = 1.0 / (np.radians(lat[1] - lat[0]) * meridian)[:, None]
    xy = projection(lon[None, :], lat[:, None])
    m = lon.size - 4
    for first in range(4, lat.size - 4, _GRID_ROWS):
        last = min(first + _GRID_ROWS, lat.size - 4)
        size, gap = np.zeros((2, last - first, m - 4))
        for i, f in enumerate(xy):
            columns = f[first:last]
            east = [columns[:, 4 + k : m + k] - columns[:, 4 - k : m - k] for k in (1, 2, 3, 4)]
            rows = f[:, 4:m]
            north = [rows[first + k : last + k] - rows[first - k : last - k] for k in (1, 2, 3, 4)]
            for j, (steps, per_metre) in enumerate(((east, per_east), (north, per_north))):
                factor = per_metre[first:last]
                J[first - 4 : last - 4, :, i, j] = column = _combined(_EIGHTH, steps) * factor
                size += np.abs(column)
                gap += np.abs(_combined(_BEYOND_SIXTH, steps) * factor)
        hard[first - 4 : last - 4] = ~(gap <= _GRID_TARGET * size)


def _combined(weights: FloatArray, steps: list[FloatArray]) -> FloatArray:
    total = weights[0] * steps[0]
    for weight, step in zip(weights[1:], steps[1:], strict=True):
        total += weight * step
    return total
