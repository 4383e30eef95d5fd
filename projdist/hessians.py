"""Second derivatives of projections at points, along geodesics."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.projections import Projection
from projdist.stencils import DIAGONAL, EAST, NORTH, drop

__all__ = ["hessian"]

# At the first step rounding, eps / step^2 = 2e-12, and truncation, step^6, balance; near singularities smaller ones do.
_STEPS = tuple(1e-2 / 4**k for k in range(6))
_SECOND = np.array([3 / 2, -3 / 20, 1 / 90])  # weights of f(+j h) + f(-j h) - 2 f(0), times h^2
_SECOND_LOW = np.array([4 / 3, -1 / 12, 0.0])


def hessian(projection: Any, lon: ArrayLike, lat: ArrayLike) -> FloatArray:
    """Second derivatives H[..., i, j, k] along geodesics in 1/m; NaN where the map is not smooth.

    Times the radius they have the per-radian unit of Goldberg and Gott.
    """
    projection = Projection.from_user_input(projection)
    lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
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
    return H.reshape(*shape, 2, 2, 2)
