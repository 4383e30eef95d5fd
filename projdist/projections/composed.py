"""A projection followed by a linear map of the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import pipeline_of
from projdist.projections.projection import Projection


@dataclass(frozen=True)
class Composed:
    """x, y of a projection times a 2 x 2 matrix, given as its rows; defined where the projection is."""

    base: Projection
    matrix: tuple[tuple[float, float], tuple[float, float]]

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.base(lon, lat)
        (xx, xy), (yx, yy) = self.matrix
        return xx * x + xy * y, yx * x + yy * y


def compose(projection: Projection, matrix: ArrayLike, name: str) -> Projection:
    """The projection whose coordinates are `matrix` (2, 2) times those of another.

    Its definition is the PROJ pipeline, where there is one. Raises ProjectionError for a matrix
    that is not finite and invertible.
    """
    M = np.asarray(matrix, dtype=float)
    if M.shape != (2, 2) or not np.isfinite(M).all() or np.linalg.det(M) == 0.0:
        raise ProjectionError(f"Invalid matrix {M.tolist()} of a map. It must be 2 by 2, finite and invertible.")
    base, total = uncomposed(projection, M)
    rows = (float(total[0, 0]), float(total[0, 1])), (float(total[1, 0]), float(total[1, 1]))
    definition = pipeline_of(base, total) or f"{rows} x {base.definition}"
    return Projection(name, definition, base.ellipsoid, Composed(base, rows), base.area_of_use)


def uncomposed(projection: Projection, matrix: FloatArray) -> tuple[Projection, FloatArray]:
    """The base of a projection times a matrix, which may be a composition itself, and the whole matrix."""
    if isinstance(projection.function, Composed):
        return projection.function.base, matrix @ np.array(projection.function.matrix)
    return projection, matrix
