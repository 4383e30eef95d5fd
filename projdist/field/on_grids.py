"""The Jacobian on a raster, at one evaluation of the projection a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.field.at_points import jacobian
from projdist.projections import Projection, ProjectionLike
from projdist.support import check_numbers

# Central weights over one to four neighbours on each side, for the first derivative times the spacing, and
# what they are more than those of sixth order.
_EIGHTH = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
_BEYOND_SIXTH = _EIGHTH - np.array([3 / 4, -3 / 20, 1 / 60, 0.0])
# The difference of the two orders falls as (spacing / distance of the singularity)^6, eighth order's own error
# as ^8: 1e-9 of the one is 1e-12 of the other.
_GRID_TARGET = 1e-9
_GRID_ROWS = 16  # at a time: their arrays stay in the cache


def jacobian_grid(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """The Jacobian on a raster, at one evaluation of the projection a point.

    The raster's own neighbours are the stencil. Where orders six and eight differ by more than 1e-9 of J (seams, kinks,
    poles, the raster's rim, coarse rasters) the points are done one by one as by `jacobian`.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon : array_like (m,)
        Longitudes of the columns in degrees, evenly spaced.
    lat : array_like (n,)
        Latitudes of the rows in degrees, evenly spaced.

    Returns
    -------
    ndarray (n, m, 2, 2)
        Metre per metre; NaN where there is none.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For uneven spacing, and arrays of another shape.

    References
    ----------
    B. Fornberg 1988, Generation of finite difference formulas on arbitrarily spaced grids, Mathematics of Computation
    51:699, table 1: the weights of the central differences.

    Examples
    --------
    On a sphere Mercator's scale is 1 / cos(lat).

    >>> import numpy as np
    >>> J = jacobian_grid("mercator", np.arange(0, 30), np.arange(40, 62))
    >>> J.shape, round(float(J[20, 15, 0, 0]), 9)
    ((22, 30, 2, 2), 2.0)
    """
    projection = Projection.from_user_input(projection)
    lon, lat = check_numbers("longitudes", lon), check_numbers("latitudes", lat)
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
    # Beside a kink the orders agree by accident at a point, and then not at the next: with its neighbours' gaps
    # an error is at most 28 times what the orders differ by, whatever kink of degree one or more there is.
    told = hard.copy()
    hard[1:] |= told[:-1]
    hard[:-1] |= told[1:]
    hard[:, 1:] |= told[:, :-1]
    hard[:, :-1] |= told[:, 1:]


def _combined(weights: FloatArray, steps: list[FloatArray]) -> FloatArray:
    total = weights[0] * steps[0]
    for weight, step in zip(weights[1:], steps[1:], strict=True):
        total += weight * step
    return total
