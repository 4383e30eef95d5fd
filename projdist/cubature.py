"""Adaptive spectral cubature: a projection and a region in, samples of the Jacobian out.

Panels are split, in the direction that needs it, until the sum of their errors meets the
tolerance. Each generation of panels is one call of the projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.derivatives import derivatives
from projdist.mesh import STENCIL, Integrand, Mesh
from projdist.panels import tails
from projdist.projections import Projection, ProjectionError
from projdist.regions import PointSet, Region

__all__ = ["Integrand", "Samples", "sample"]

MAX_EVALUATIONS = 1_500_000
_MEAN_TOLERANCE = 1e-6  # measures have kinks, which cost more
_ROUNDING = 1e-12  # of J, as the differentiation of x and y leaves it
_UNDEFINED = 1e-6  # share of the area on which a measure may be undefined, at singular points, and still have a mean


@dataclass(frozen=True)
class Samples:
    """The Jacobian field of a projection over a region, at n x 10 x 10 nodes.

    `weight` is true area in m^2; `u`, `v` and `patch` place the nodes in the region's chart. Where the edge of
    polygons crosses a panel, there are nodes outside, and weights of either sign: they integrate the polynomial
    through the nodes over the part inside, a `share` (n,) of the panel. `density` is m^2 in the unit square of nodes.
    `doubt` (n,) is by how much the differentiation may have changed the logarithms of the scales.
    `coverage` is the share of the region's area that the samples stand for, `undecided` that of
    panels whose part within the map is not known and which are left out. Over a set of points there is one node a
    point, n x 1 x 1, with the point's own weight. `limit` tells why
    the refinement stopped: "" when the tolerance was met, "rounding" at the noise of the
    projection's own arithmetic, "budget" at the largest number of evaluations.
    """

    lon: FloatArray
    lat: FloatArray
    u: FloatArray
    v: FloatArray
    patch: IntArray
    jacobian: FloatArray
    density: FloatArray
    weight: FloatArray
    share: FloatArray
    doubt: FloatArray
    coverage: float
    undecided: float
    evaluations: int
    limit: str

    def mean(self, values: FloatArray, slope: FloatArray | float) -> tuple[float, float]:
        """Mean over the covered area of values (n, 10, 10) at the nodes, and its estimated error.

        `slope` (n, 10, 10) is how much the values change with the logarithms of the scales.
        NaN where the values are undefined on more than a millionth of the area.
        """
        total = float(self.weight.sum())
        undefined = ~np.isfinite(values)
        missing = float(np.abs(self.weight[undefined]).sum()) / total
        if missing > _UNDEFINED:
            return np.nan, np.nan
        missing += self.undecided / self.coverage
        values, slope = np.where(undefined, 0.0, values), np.where(undefined, 0.0, slope)
        error = missing * float(np.abs(values).max())
        if values.shape[-1] > 1:
            error += float(tails(values, self.density, self.share)[1].sum()) / total
        error += float(np.sum(self.doubt[:, None, None] * slope * self.weight)) / total
        error += _ROUNDING * float(np.sum(np.abs(self.weight * values))) / total
        return float(np.sum(self.weight * values)) / total, error


def sample(
    projection: Projection,
    region: Region | PointSet,
    *,
    tolerance: float = 1e-8,
    integrands: Sequence[Integrand] = (),
    max_evaluations: int = MAX_EVALUATIONS,
) -> Samples:
    """Samples that resolve the Airy-Kavrayskiy errors to `tolerance`, and the mean of each integrand.

    An integrand's mean m is resolved to max(tolerance, 1e-6) * max(1, |m|). Raises ValueError for
    a tolerance that is not positive, ProjectionError where no point of the region can be projected.
    """
    if not tolerance > 0:
        raise ValueError(f"Invalid tolerance '{tolerance}'. It must be above 0.")
    if isinstance(region, PointSet):
        return _at_points(projection, region)
    mesh = Mesh(projection, region, integrands)
    limit = mesh.refine(_AiryKavrayskiyGoal(tolerance), max_evaluations)
    for column in range(2, 2 + len(integrands)):
        mesh.refine(_MeanGoal(column, max(tolerance, _MEAN_TOLERANCE)), mesh.evaluations + max_evaluations // 4)
    pieces = mesh.leaves()
    if not len(pieces.panel):
        raise _nothing(projection, region)
    return Samples(
        pieces.lon,
        pieces.lat,
        pieces.u,
        pieces.v,
        pieces.patch,
        pieces.jacobian,
        pieces.density,
        pieces.weight,
        pieces.share,
        pieces.doubt.sum(axis=-1),
        min(1.0, float(pieces.weight.sum()) / mesh.region_area),
        mesh.undecided_area / mesh.region_area,
        mesh.evaluations,
        limit,
    )


def _nothing(projection: Projection, region: Region | PointSet) -> ProjectionError:
    return ProjectionError(f"Invalid region '{region.name}' for {projection.name}. No point of it can be projected.")


def _at_points(projection: Projection, points: PointSet) -> Samples:
    """The derivatives at points, as pieces with one node each; where there are none, the points are not covered."""
    found = derivatives(projection, points.lon, points.lat)
    defined = np.isfinite(found.jacobian).all(axis=(1, 2)) & (points.weight > 0.0)
    if not defined.any():
        raise _nothing(projection, points)
    lon, lat, weight = (values[defined, None, None] for values in (points.lon, points.lat, points.weight))
    return Samples(
        lon,
        lat,
        lon,
        lat,
        np.zeros(len(lon), dtype=int),
        found.jacobian[defined, None, None],
        weight,
        weight,
        np.ones(len(lon)),
        found.error[defined],
        float(weight.sum() / points.weight.sum()),
        0.0,
        STENCIL * points.lon.size,
        "",
    )


@dataclass(frozen=True)
class _AiryKavrayskiyGoal:
    """Resolve the raw and the scaled error."""

    tolerance: float
    column: int = 0
    stuck: float = 0.8  # singular points and lines halve their errors, cuts and resolved parts do far better

    def sensitivity(self, means: FloatArray) -> FloatArray:
        square, log_area = float(means[0]), float(means[1])
        # d sqrt(q) = dq / (2 sqrt q). Where the scaled error nearly vanishes its relative accuracy is enough.
        scaled = np.sqrt(max(square - 0.5 * log_area**2, 0.0))
        root = max(scaled, 0.01 * np.sqrt(square), self.tolerance)
        result = np.zeros(len(means))
        result[:2] = 0.5 / root, 0.5 * abs(log_area) / root
        return result / self.tolerance


@dataclass(frozen=True)
class _MeanGoal:
    """Resolve the mean of one integrand, relative to itself where it is above 1."""

    column: int
    tolerance: float
    stuck: float = 1.5  # kinks may keep nearly all of their errors, rounding doubles

    def sensitivity(self, means: FloatArray) -> FloatArray:
        result = np.zeros(len(means))
        result[self.column] = 1.0 / (self.tolerance * max(1.0, abs(float(means[self.column]))))
        return result
