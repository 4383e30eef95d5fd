"""A projection followed by a linear map of the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import pipeline_of
from projdist.projections.operations import Function
from projdist.projections.projection import Projection


@dataclass(frozen=True)
class Composed:
    """x, y of a function times a 2 x 2 matrix, given as its rows."""

    function: Function
    matrix: tuple[tuple[float, float], tuple[float, float]]

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.function(lon, lat)
        (xx, xy), (yx, yy) = self.matrix
        with np.errstate(invalid="ignore"):  # infinite where the map is not defined
            return xx * x + xy * y, yx * x + yy * y


def compose(projection: Projection, matrix: ArrayLike, name: str) -> Projection:
    """The projection whose coordinates are `matrix` (2, 2) times those of another.

    Its definition is the PROJ pipeline, where there is one. Raises ProjectionError for a matrix
    that is not finite and invertible.
    """
    M = np.asarray(matrix, dtype=float)
    if M.shape != (2, 2) or not np.isfinite(M).all() or np.linalg.det(M) == 0.0:
        raise ProjectionError(f"Invalid matrix {M.tolist()} of a map. It must be 2 by 2, finite and invertible.")
    rows = (float(M[0, 0]), float(M[0, 1])), (float(M[1, 0]), float(M[1, 1]))
    definition = pipeline_of(projection, M) or f"{rows} x {projection.definition}"
    function = Composed(projection.function, rows)
    return Projection(name, definition, projection.ellipsoid, function, projection.area_of_use)
