"""Second derivatives of projections at points, along geodesics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.field.stencils import DIAGONAL, EAST, NORTH, drop
from projdist.projections import Projection, ProjectionLike
from projdist.support import check_degrees

__all__ = ["hessian"]

# At the first step rounding, eps / step^2 = 2e-12, and truncation, step^6, balance; near singularities smaller ones do.
_STEPS = tuple(1e-2 / 4**k for k in range(6))
_SECOND = np.array([3 / 2, -3 / 20, 1 / 90])  # weights of f(+j h) + f(-j h) - 2 f(0), times h^2
_SECOND_LOW = np.array([4 / 3, -1 / 12, 0.0])


def hessian(projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Second derivatives at points in degrees, along geodesics; NaN at kinks and seams.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon, lat : array_like (...)
        The points in degrees, of shapes that broadcast.

    Returns
    -------
    ndarray (..., 2, 2, 2)
        H[..., i, j, k], i of x and y, j and k of east and north, per radian of the semi-major axis. That is Goldberg
        and Gott's unit, in which flexion and skewness want them; over the axis in metres it is 1/m.

    Raises
    ------
    ProjectionError
        For what is no projection.
    ValueError
        For points that are no numbers, or of shapes that do not broadcast.

    References
    ----------
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297, section 3.

    Examples
    --------
    On a plate carree a great circle that starts to the east bends to the south by tan(lat), 1 at 45 degrees.

    >>> H = hessian("plate-carree", 0, 45)
    >>> round(float(H[1, 0, 0]), 6)
    -1.0
    """
    projection = Projection.from_user_input(projection)
    lon, lat = check_degrees(lon, lat)
    shape, lon, lat = lon.shape, lon.ravel(), lat.ravel()
    best = np.full((lon.size, 3, 2), np.nan)
    best_error = np.full(lon.size, np.inf)
    index = np.arange(lon.size)
    offsets = np.array([1.0, -1.0, 2.0, -2.0, 3.0, -3.0])
    for step in _STEPS:
        centre = np.stack(projection(lon[index], lat[index]))
        metres = step * projection.ellipsoid.a
        distance = step * offsets[:, None]
        high, low = [], []
        for along_east, along_north in (EAST, NORTH, DIAGONAL):
            f = np.stack(
                projection(
                    *drop(projection.ellipsoid, lon[index], lat[index], along_east * distance, along_north * distance)
                )
            )
            bends = np.stack([f[:, j] + f[:, j + 1] - 2.0 * centre for j in (0, 2, 4)])
            high.append(np.einsum("m,min->ni", _SECOND, bends) / metres**2)
            low.append(np.einsum("m,min->ni", _SECOND_LOW, bends) / metres**2)
        values = np.stack(high, axis=1)
        gap = np.max(np.abs(values - np.stack(low, axis=1)), axis=(1, 2)) * projection.ellipsoid.a
        error = np.where(np.isfinite(gap), gap, np.inf)
        better = error < best_error[index]
        best[index[better]], best_error[index[better]] = values[better], error[better]
        index = index[~(error <= 1e-7)]
        if not index.size:
            break
    best[~(best_error <= 1e-2)] = np.nan
    east, north, diagonal = best[:, 0], best[:, 1], best[:, 2]
    mixed = diagonal - 0.5 * (east + north)
    H = np.stack([np.stack([east, mixed], axis=-1), np.stack([mixed, north], axis=-1)], axis=-1)
    return np.asarray(H.reshape(*shape, 2, 2, 2) * projection.ellipsoid.a)
