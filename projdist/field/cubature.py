"""Adaptive spectral cubature of the Jacobian over a region, and what is made of its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.field.at_points import derivatives
from projdist.field.panel_mesh import STENCIL, Integrand, Mesh, SecondOrder
from projdist.field.panels import tails
from projdist.field.stencils import hessian
from projdist.matrices import areal_scale, factor_distance, field_mdt, field_median, fisher, log_areal_scale, log_scales
from projdist.numerics import Estimate, interpolate, mean, median
from projdist.projections import Projection, ProjectionError, native_pole_of
from projdist.regions import Box, Place, PointSet, Region, TurnedGlobe
from projdist.support import check_number

MAX_EVALUATIONS = 1_500_000
_MEAN_TOLERANCE = 1e-6  # measures have kinks, which cost more
# Of second derivatives, which grow as panels shrink where J has a jump, so that splitting gains nothing.
_SECOND_TOLERANCE, _STUCK_AT_KINKS = 1e-5, 0.8
_ROUNDING = 1e-12  # of J, as the differentiation of x and y leaves it
# Panels as small as that hold 1e-4 of the integral of a ln^2 singularity at a pole, 1e-3 of that of k, at most 7e-3
# of what was seen to have a mean (a of laea). What diverges has as much in every decade of area, here 1 to 1e-12: half.
_TINY = 1e-6  # of the area
_GOOD_PART = 0.02  # of the integral
_NOTHING = 1e-6  # of a mean, in the unit of any measure: omega of conformal maps is not more
# Shares of the area on which a measure may be undefined, at singular points, and still have a mean; one of second
# derivatives, along kinks, too.
UNDEFINED, UNDEFINED_AT_KINKS = 1e-6, 1e-3


@dataclass(frozen=True, kw_only=True)
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
    projection's own arithmetic, "budget" at the largest number of evaluations. `hessian` (n, 10, 10, 2, 2, 2), per
    radian of the semi-major axis, is there if integrands of second order were asked for, and NaN at kinks.
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
    hessian: FloatArray | None
    charted: Region | None = None  # the region whose chart u, v and patch are of; None for points

    @classmethod
    def of_points(
        cls,
        lon: FloatArray,
        lat: FloatArray,
        weight: FloatArray,
        jacobian: FloatArray,
        hessian: FloatArray | None,
        *,
        doubt: FloatArray,
        evaluations: int,
    ) -> Samples | None:
        """Those of n points that have a weight and a Jacobian, as pieces with one node each; None where none has."""
        defined = np.isfinite(jacobian).all(axis=(1, 2)) & (weight > 0.0)
        if not defined.any():
            return None
        u, v, own = (values[defined, None, None] for values in (lon, lat, weight))
        return cls(
            lon=u,
            lat=v,
            u=u,
            v=v,
            patch=np.zeros(len(own), dtype=int),
            jacobian=jacobian[defined, None, None],
            density=own,
            weight=own,
            share=np.ones(len(own)),
            doubt=doubt[defined],
            coverage=float(own.sum() / weight.sum()),
            undecided=0.0,
            evaluations=evaluations,
            limit="",
            hessian=None if hessian is None else hessian[defined, None, None],
        )

    def mean(self, values: FloatArray, slope: FloatArray | float, *, most: float = UNDEFINED) -> tuple[float, float]:
        """Mean over the covered area of values (n, 10, 10) at the nodes, and its estimated error.

        `slope` (n, 10, 10) is how much the values change with the logarithms of the scales.
        NaN where the values are undefined on more than a share `most` of the area.
        """
        return self.means([values], [slope], most=most)[0]

    def means(
        self, values: Sequence[FloatArray], slopes: Sequence[FloatArray | float], *, most: float = UNDEFINED
    ) -> list[tuple[float, float]]:
        """The `mean` of each of several fields of values, which together cost little more than one."""
        fields, total = np.array(values), float(self.weight.sum())
        missing = np.zeros(len(fields))
        undefined = ~np.isfinite(fields)
        if undefined.any():
            missing = np.abs(self.weight * undefined).sum(axis=(1, 2, 3)) / total
            fields[undefined] = 0.0
            slopes = [np.where(gap, 0.0, slope) for gap, slope in zip(undefined, slopes, strict=True)]
        parts = fields * self.weight
        sums = parts.sum(axis=(1, 2, 3))
        errors = _ROUNDING * np.abs(parts).sum(axis=(1, 2, 3))
        if fields.shape[-1] > 1:
            errors += tails(fields, self.density, self.share)[1].sum(axis=(1, 2))
        if self.doubt.any():
            doubtful = self.doubt[:, None, None] * self.weight
            errors += [float(np.sum(doubtful * slope)) for slope in slopes]
        means, errors = sums / total, errors / total
        means[missing > most] = errors[missing > most] = np.nan
        for k, share in enumerate((missing + self.undecided / self.coverage).tolist()):
            if share > 0.0:
                errors[k] += share * self._largest(fields[k], share * total)
        return list(zip(means.tolist(), errors.tolist(), strict=True))

    def diverges(self, values: FloatArray) -> bool:
        """Whether an integral lies, in good part, in panels too small to hold a part of it; of points, never."""
        if self.weight.shape[-1] == 1:
            return False
        area = self.weight.sum(axis=(1, 2))
        parts = np.abs(np.nansum(self.weight * values, axis=(1, 2))) / area.sum()
        in_tiny = parts[area / area.sum() < _TINY].sum()
        return bool(in_tiny > max(_GOOD_PART * parts.sum(), _NOTHING))

    def _largest(self, values: FloatArray, area: float) -> float:
        """The largest mean of |value| over a piece that is no smaller than an area: what that area may hold."""
        areas = np.abs(self.weight).sum(axis=(1, 2))
        broad = areas >= min(area, areas.max())
        return float((np.abs(self.weight * values).sum(axis=(1, 2))[broad] / areas[broad]).max())


def sample_panels(
    projection: Projection,
    region: Place,
    *,
    tolerance: float = 1e-8,
    integrands: Sequence[Integrand] = (),
    second_order: Sequence[SecondOrder] = (),
    max_evaluations: int = MAX_EVALUATIONS,
) -> Samples:
    """Samples that resolve the Airy-Kavrayskiy errors to `tolerance`, and the mean of each integrand.

    An integrand's mean m is resolved to max(tolerance, 1e-6) * max(1, |m|), and to 1e-5 where it is one of
    `second_order`, functions of J and H. Raises ValueError for a tolerance that is not positive, ProjectionError where
    no point of the region can be projected.
    """
    if not check_number("tolerance", tolerance) > 0:
        raise ValueError(f"Invalid tolerance '{tolerance}'. It must be above 0.")
    if isinstance(region, PointSet):
        return _at_points(projection, region, bool(second_order))
    if not second_order:
        region = charted_for(projection, region)
    mesh = Mesh(projection, region, integrands, second_order)
    limit = mesh.refine(_AiryKavrayskiyGoal(tolerance), max_evaluations)
    for column in range(2, len(mesh.peaks)):
        goal = _MeanGoal(column, max(tolerance, _MEAN_TOLERANCE))
        if column >= 2 + len(integrands):
            goal = _MeanGoal(column, max(tolerance, _SECOND_TOLERANCE), _STUCK_AT_KINKS, gives_up=True)
        mesh.refine(goal, mesh.evaluations + max_evaluations // 4)
    pieces, H = mesh.leaves()
    if not len(pieces.panel):
        raise _nothing(projection, region)
    return Samples(
        lon=pieces.lon,
        lat=pieces.lat,
        u=pieces.u,
        v=pieces.v,
        patch=pieces.patch,
        jacobian=pieces.jacobian,
        density=pieces.density,
        weight=pieces.weight,
        share=pieces.share,
        doubt=pieces.doubt.sum(axis=-1),
        coverage=min(1.0, float(pieces.weight.sum()) / mesh.region_area),
        undecided=mesh.undecided_area / mesh.region_area,
        evaluations=mesh.evaluations,
        limit=limit,
        hessian=H,
        charted=region,
    )


def charted_for(projection: Projection, region: Region) -> Region:
    """The region in the chart that suits a map: the globe about the map's own pole, as far as that is known.

    Not for second derivatives, as east and north turn without bound about the Earth's poles, which its panels hold.
    """
    pole = native_pole_of(projection) if isinstance(region, Box) and region.is_globe else None
    return TurnedGlobe(*pole) if pole else region


def _nothing(projection: Projection, region: Region | PointSet) -> ProjectionError:
    return ProjectionError(f"Invalid region '{region.name}' for {projection.name}. No point of it can be projected.")


def _at_points(projection: Projection, points: PointSet, curved: bool) -> Samples:
    """The derivatives at points; where there are none, the points are not covered."""
    lon, lat = points.lon, points.lat
    found = derivatives(projection, lon, lat)
    H = hessian(projection, lon, lat) if curved else None
    samples = Samples.of_points(
        lon, lat, points.weight, found.jacobian, H, doubt=found.error, evaluations=STENCIL * lon.size
    )
    if samples is None:
        raise _nothing(projection, points)
    return samples


@dataclass(frozen=True)
class _AiryKavrayskiyGoal:
    """Resolve the raw and the scaled error."""

    tolerance: float
    column: int = 0
    stuck: float = 0.8  # singular points and lines halve their errors, cuts and resolved parts do far better
    gives_up: bool = False

    def sensitivity(self, means: FloatArray) -> FloatArray:
        square, log_area = float(means[0]), float(means[1])
        # d sqrt(q) = dq / (2 sqrt q). Where the scaled error nearly vanishes its relative accuracy is enough.
        scaled = np.sqrt(max(square - 0.5 * log_area**2, 0.0))
        # Over polygons weights may be negative, and so may the mean of a square that is next to nothing.
        root = max(scaled, 0.01 * np.sqrt(max(square, 0.0)), self.tolerance)
        result = np.zeros(len(means))
        result[:2] = 0.5 / root, 0.5 * abs(log_area) / root
        return result / self.tolerance


@dataclass(frozen=True)
class _MeanGoal:
    """Resolve the mean of one integrand, relative to itself where it is above 1."""

    column: int
    tolerance: float
    stuck: float = 1.5  # kinks may keep nearly all of their errors, rounding doubles
    gives_up: bool = False

    def sensitivity(self, means: FloatArray) -> FloatArray:
        result = np.zeros(len(means))
        result[self.column] = 1.0 / (self.tolerance * max(1.0, abs(float(means[self.column]))))
        return result


# ---- samples for quantiles -----------------------------------------------------------------------


# Points for the quantiles, whose error falls as one over their number: all in all, and in one panel.
_DENSE, _DENSEST = 200_000, 20_000


def dense(
    region: Place | None, samples: Samples, values: FloatArray, *, thinned: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Values (m, n, p, p) interpolated within the panels, at the many points of a lattice, those in the region.

    Their shape is (m, k), that of the weights (k,). The lattice of the golden ratio has as many levels along either
    direction as it has points. `thinned` takes half of the points.
    """
    every = 2 if thinned else 1
    if region is None or samples.weight.shape[-1] == 1:
        return values.reshape(len(values), -1)[:, ::every], samples.weight.ravel()[::every]
    smooth = np.isfinite(values).all(axis=(0, 2, 3))
    m = int(np.clip(_DENSE / values.shape[1], 64, _DENSEST)) // every
    step = np.arange(m) + 0.5
    r, s = 2.0 * step / m - 1.0, 2.0 * np.mod(step * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
    fine = np.stack([_within_reach(one[smooth], r, s).ravel() for one in values])
    weights = np.maximum(interpolate(samples.density[smooth], r, s), 0.0) * (4.0 / m)
    clipped = samples.share[smooth] < 1.0
    if clipped.any():
        lon, lat = (interpolate(place[smooth][clipped], r, s) for place in (samples.lon, samples.lat))
        inside = np.where(region.contains(lon, lat), weights[clipped], 0.0)
        # As much as the lattice has found stands for all of the panel's part, which is known.
        found, area = inside.sum(axis=1), samples.weight[smooth][clipped].sum(axis=(1, 2))
        weights[clipped] = inside * np.divide(area, found, out=np.zeros_like(found), where=found > 0)[:, None]
    rest = ~smooth
    return (
        np.concatenate([fine, values[:, rest].reshape(len(values), -1)], axis=1),
        np.concatenate([weights.ravel(), np.maximum(samples.weight[rest], 0.0).ravel()]),
    )


def _within_reach(values: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Interpolated values: a polynomial may overshoot beside a singularity, and stays within what was sampled."""
    low, high = values.min(axis=(1, 2)), values.max(axis=(1, 2))
    margin = 0.1 * (high - low)
    return np.clip(interpolate(values, r, s), (low - margin)[:, None], (high + margin)[:, None])


# ---- Airy-Kavrayskiy errors ----------------------------------------------------------------------


class AiryKavrayskiy(NamedTuple):
    """The raw, scaled and affine errors, the largest of their estimated errors, and the MDT (2, 2)."""

    raw: float
    scaled: float
    affine: float
    error: float
    mdt: FloatArray


def airy_kavrayskiy_of(samples: Samples) -> AiryKavrayskiy:
    """The Airy-Kavrayskiy errors of samples; raises ProjectionError where the map is singular everywhere."""
    square, log_area = log_scales(samples.jacobian)
    defined = np.isfinite(square) & (areal_scale(samples.jacobian) > 0)
    if not defined.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    if defined.all():
        result = field_mdt(samples.jacobian.reshape(-1, 2, 2), samples.weight.ravel())
        distances = result.distances.reshape(square.shape)
    else:
        result = field_mdt(samples.jacobian[defined], samples.weight[defined])
        distances = np.full(square.shape, np.nan)
        distances[defined] = result.distances
    slopes = 2.0 * np.sqrt(square), 1.0, 2.0 * np.sqrt(distances)
    (mean_square, square_error), (shift, shift_error), affine_mean = samples.means(
        (square, log_area, distances), slopes
    )
    raw = Estimate(mean_square, square_error).root()
    # The best scale c minimises the mean of (ln a + c)^2 + (ln b + c)^2: c = -mean ln(ab) / 2.
    scaled = Estimate(mean_square - 0.5 * shift**2, square_error + abs(shift) * shift_error).root()
    affine = Estimate(*affine_mean).root()
    error = max(raw.error, scaled.error, affine.error)
    return AiryKavrayskiy(raw.value, scaled.value, affine.value, error, result.T)


# ---- geometric medians ---------------------------------------------------------------------------


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
