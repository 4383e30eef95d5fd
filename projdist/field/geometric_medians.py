"""The geometric median of a map's Jacobians, and how the distortion that is left lies over the region."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.field.cubature import Samples
from projdist.field.dense_samples import dense
from projdist.matrices import factor_distance, field_median, fisher, log_areal_scale
from projdist.numerics import Estimate, mean, median
from projdist.projections import ProjectionError
from projdist.regions import Place

__all__ = ["DenseJacobians", "GeometricMedian", "Spread"]

_NOISE = 1e-7  # of logarithms of scales, as interpolation leaves them


class GeometricMedian(NamedTuple):
    """The linear map T (2, 2) of the least mean Fisher distortion of T^-1 J, by how much it may be wrong (as Fisher
    distortion), and whether it is the only one.
    """

    T: FloatArray
    error: float
    unique: bool


class Spread(NamedTuple):
    """The mean Fisher distortion by area, and what half of the area is below."""

    mean: Estimate
    median: Estimate


class DenseJacobians:
    """Jacobians at very many points of a region, as triangular factors, and at half as many to tell errors."""

    def __init__(self, region: Place | None, samples: Samples) -> None:
        self.whole = _factors(region, samples, thinned=False)
        are_points = region is None or samples.weight.shape[-1] == 1
        self._half = None if are_points else _factors(region, samples, thinned=True)

    def median(self) -> GeometricMedian:
        """The geometric median."""
        noise = 0.0 if self._half is None else _NOISE
        found = field_median(*self.whole, noise)
        if self._half is None:
            return GeometricMedian(found.T, 0.0, bool(found.unique))
        other = field_median(*self._half, noise)
        return GeometricMedian(found.T, 0.5 * float(factor_distance(found.T, other.T)), True)

    def spread(self, T: FloatArray) -> Spread:
        """The mean and the median of Dist_F(T^-1 J)."""
        whole, half = (
            (fisher(np.asarray(np.linalg.solve(T, factors), dtype=float)), weights)
            for factors, weights in (self.whole, self._half or self.whole)
        )
        return Spread(*(Estimate(figure(*whole), abs(figure(*whole) - figure(*half))) for figure in (mean, median)))


def _factors(region: Place | None, samples: Samples, *, thinned: bool) -> tuple[FloatArray, FloatArray]:
    """Triangular factors (m, 2, 2) of J, and weights (m,) above 0; raises ProjectionError where all are singular.

    What is interpolated are ln |det J| and the point in the hyperbolic plane, which are smooth where J is, whichever
    way it is turned.
    """
    J = samples.jacobian
    row = J[..., 0, 0] ** 2 + J[..., 0, 1] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        v = log_areal_scale(J)
        x = (J[..., 0, 0] * J[..., 1, 0] + J[..., 0, 1] * J[..., 1, 1]) / row
        values = np.stack([v, x, v - np.log(row)])
    (v, x, log_y), weights = dense(region, samples, values, thinned=thinned)
    counts = np.isfinite(v) & np.isfinite(x) & np.isfinite(log_y) & (weights > 0)
    if not counts.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    v, x, log_y = v[counts], x[counts], log_y[counts]
    factors = np.zeros((v.size, 2, 2))
    factors[:, 0, 0] = np.exp(0.5 * (v - log_y))
    factors[:, 1, 0] = x * factors[:, 0, 0]
    factors[:, 1, 1] = np.exp(0.5 * (v + log_y))
    return factors, weights[counts]
