"""Adaptive spectral cubature of the Jacobian over a region; means, quantiles and best linear maps of its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.field.at_points import derivatives
from projdist.field.panel_mesh import STENCIL, Integrand, Mesh, MeshGoal, SecondOrder
from projdist.field.panels import tails
from projdist.field.stencils import hessian
from projdist.matrices import areal_scale, field_mdt, log_areal_scale, log_scales
from projdist.numerics import Estimate, interpolate
from projdist.projections import Projection, ProjectionError, native_pole_of
from projdist.regions import Box, Place, PointSet, Region, TurnedGlobe
from projdist.support import check_number

MAX_EVALUATIONS = 1_500_000
_MEAN_TOLERANCE = 1e-6  # measures have kinks, which cost more
# Of second derivatives, which grow as panels shrink where J has a jump, so that splitting gains nothing.
_SECOND_TOLERANCE = 1e-5
_STUCK = 1.5  # for means of integrands: kinks may keep nearly all of their errors, rounding doubles
_ROUNDING = 1e-12  # of J, from the differentiation of x and y
# Panels smaller than this hold 1e-4 of the integral of a ln^2 singularity at a pole, 1e-3 of that of k, and at most
# 7e-3 of any measure that has a mean (a of laea). A diverging one has as much in every decade of area from 1 to 1e-12,
# so half of it in them.
_TINY = 1e-6  # of the area
_GOOD_PART, _LARGE_PART = 0.02, 0.1  # of the integral
_RESOLVED = 0.01  # of a mean: what diverges is wrong by as much as its smallest panels hold, which is more
_NOTHING = 1e-6  # of a mean, in the unit of any measure: omega of conformal maps is not more
# Shares of the area on which a measure may be undefined and still have a mean: at singular points, and along kinks if
# it is of second derivatives.
UNDEFINED, UNDEFINED_AT_KINKS = 1e-6, 1e-3


@dataclass(frozen=True, kw_only=True)
class Samples:
    """The Jacobian field of a projection over a region, at n x 10 x 10 nodes; n x 1 x 1 for a set of points.

    `weight` is true area in m^2, or a point's own weight. `u`, `v` and `patch` place the nodes in the region's chart.
    Where an edge of polygons crosses a panel, some nodes lie outside, and weights have either sign: they integrate the
    polynomial through the nodes over the part inside, which is a `share` (n,) of the panel. `density` is m^2 in the
    unit square of nodes. `doubt` (n,) is by how much the differentiation may have changed the logarithms of the scales.
    `coverage` is the share of the region's area that the samples stand for; `undecided` that of panels left out because
    their part within the map is not known. The refinement stopped at the `limit`: "" if the tolerance was met,
    "rounding" at the noise of the projection's own arithmetic, "budget" at the largest number of evaluations.
    `hessian` (n, 10, 10, 2, 2, 2), per radian of the semi-major axis, is there for integrands of second order only,
    and NaN at kinks.
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
        """Samples at those of n points that have a weight and a Jacobian; None if none has."""
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

        `slope` (n, 10, 10) is the derivative of the values by the logarithms of the scales. The mean is NaN if the
        values are undefined on more than a share `most` of the area.
        """
        return self.means([values], [slope], most=most)[0]

    def means(
        self, values: Sequence[FloatArray], slopes: Sequence[FloatArray | float], *, most: float = UNDEFINED
    ) -> list[tuple[float, float]]:
        """The means of several fields of values, as `mean` gives them, which together cost little more than one."""
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
                # The missing part may hold as much as the largest mean of |value| over a piece that is no smaller.
                areas = np.abs(self.weight).sum(axis=(1, 2))
                broad = areas >= min(share * total, areas.max())
                held = np.abs(self.weight * fields[k]).sum(axis=(1, 2))
                errors[k] += share * float((held[broad] / areas[broad]).max())
        return list(zip(means.tolist(), errors.tolist(), strict=True))

    def diverges(self, values: FloatArray) -> bool:
        """True if a good part of an integral lies in panels too small for that; never for points."""
        return self.singular_part(values) == np.inf

    def singular_part(self, values: FloatArray) -> float:
        """The part of a mean that tiny panels hold, infinite if it diverges, 0 if it is no good part of it.

        A smaller part that is resolved does not diverge: at corners of Adams' square, with s as r^-1.5, it is 2.5 %.
        """
        if self.weight.shape[-1] == 1:
            return 0.0
        area = self.weight.sum(axis=(1, 2))
        parts = np.abs(np.nansum(self.weight * values, axis=(1, 2))) / area.sum()
        in_tiny = parts[area / area.sum() < _TINY].sum()
        if in_tiny <= max(_GOOD_PART * parts.sum(), _NOTHING):
            return 0.0
        value, error = self.mean(values, 0.0)
        converges = in_tiny <= _LARGE_PART * parts.sum() and error <= _RESOLVED * abs(value)
        return float(in_tiny) if converges else np.inf


_OF_PIECES = ("lon", "lat", "u", "v", "patch", "jacobian", "density", "weight", "share")


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
        lon, lat = region.lon, region.lat
        found = derivatives(projection, lon, lat)
        H = hessian(projection, lon, lat) if second_order else None
        samples = Samples.of_points(
            lon, lat, region.weight, found.jacobian, H, doubt=found.error, evaluations=STENCIL * lon.size
        )
        if samples is None:
            raise _nothing(projection, region)
        return samples
    # The globe gets a chart about the map's own pole, if that is known; not for second derivatives, as east and north
    # turn without bound about the Earth's poles, which its panels hold.
    is_globe = isinstance(region, Box) and region.is_globe
    pole = native_pole_of(projection) if is_globe and not second_order else None
    region = TurnedGlobe(*pole) if pole else region
    mesh = Mesh(projection, region, integrands, second_order)
    limit = mesh.refine(MeshGoal(0, tolerance), max_evaluations)
    for column in range(2, len(mesh.peaks)):
        goal = MeshGoal(column, max(tolerance, _MEAN_TOLERANCE), _STUCK)
        if column >= 2 + len(integrands):
            goal = MeshGoal(column, max(tolerance, _SECOND_TOLERANCE), gives_up=True)
        mesh.refine(goal, mesh.evaluations + max_evaluations // 4)
    pieces, H = mesh.leaves()
    if not len(pieces.panel):
        raise _nothing(projection, region)
    panels, area = mesh.panels, mesh.region_area
    return Samples(
        **{name: getattr(pieces, name) for name in _OF_PIECES},
        doubt=pieces.doubt.sum(axis=-1),
        coverage=min(1.0, float(pieces.weight.sum()) / area),
        undecided=float(panels.area[panels.alive & panels.undecided].sum()) / area,
        evaluations=mesh.evaluations,
        limit=limit,
        hessian=H,
        charted=region,
    )


def _nothing(projection: Projection, region: Place) -> ProjectionError:
    return ProjectionError(f"Invalid region '{region.name}' for {projection.name}. No point of it can be projected.")


# ---- samples for quantiles -----------------------------------------------------------------------


# Points for quantiles, whose error falls as one over their number: of all panels, and of one.
_DENSE, _DENSEST = 200_000, 20_000


def quantile_samples(
    region: Place | None, samples: Samples, values: FloatArray, *, thinned: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Values (m, k) and weights (k,) at many points of the region, from values (m, n, p, p) at the nodes of panels.

    The points of each panel are a lattice of the golden ratio, which has as many levels along either direction as it
    has points. `thinned` takes half of them.
    """
    every = 2 if thinned else 1
    if region is None or samples.weight.shape[-1] == 1:
        return values.reshape(len(values), -1)[:, ::every], samples.weight.ravel()[::every]
    smooth = np.isfinite(values).all(axis=(0, 2, 3))
    m = int(np.clip(_DENSE / values.shape[1], 64, _DENSEST)) // every
    step = np.arange(m) + 0.5
    r, s = 2.0 * step / m - 1.0, 2.0 * np.mod(step * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
    fine = []
    for one in values[:, smooth]:
        # A polynomial may overshoot beside a singularity: it stays within what was sampled.
        low, high = one.min(axis=(1, 2)), one.max(axis=(1, 2))
        margin = 0.1 * (high - low)
        fine.append(np.clip(interpolate(one, r, s), (low - margin)[:, None], (high + margin)[:, None]).ravel())
    weights = np.maximum(interpolate(samples.density[smooth], r, s), 0.0) * (4.0 / m)
    clipped = samples.share[smooth] < 1.0
    if clipped.any():
        lon, lat = (interpolate(place[smooth][clipped], r, s) for place in (samples.lon, samples.lat))
        inside = np.where(region.contains(lon, lat), weights[clipped], 0.0)
        # The points found inside stand for all of the panel's part, whose area is known.
        found, area = inside.sum(axis=1), samples.weight[smooth][clipped].sum(axis=(1, 2))
        weights[clipped] = inside * np.divide(area, found, out=np.zeros_like(found), where=found > 0)[:, None]
    rest = ~smooth
    return (
        np.concatenate([np.stack(fine), values[:, rest].reshape(len(values), -1)], axis=1),
        np.concatenate([weights.ravel(), np.maximum(samples.weight[rest], 0.0).ravel()]),
    )


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


class GeometricMedian(NamedTuple):
    """The linear map T (2, 2) with the least mean Fisher distortion of T^-1 J, its error and whether it is unique.

    The error is the Fisher distortion between T and the true one.
    """

    T: FloatArray
    error: float
    unique: bool


class Spread(NamedTuple):
    """The mean and the median Fisher distortion by area."""

    mean: Estimate
    median: Estimate


def dense_factors(region: Place | None, samples: Samples, *, thinned: bool = False) -> tuple[FloatArray, FloatArray]:
    """Triangular factors (m, 2, 2) of J, and weights (m,) above 0; raises ProjectionError where all are singular.

    Interpolated are ln |det J| and the point in the hyperbolic plane, which are smooth where J is, however it turns.
    """
    J = samples.jacobian
    row = J[..., 0, 0] ** 2 + J[..., 0, 1] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        v = log_areal_scale(J)
        x = (J[..., 0, 0] * J[..., 1, 0] + J[..., 0, 1] * J[..., 1, 1]) / row
        values = np.stack([v, x, v - np.log(row)])
    (v, x, log_y), weights = quantile_samples(region, samples, values, thinned=thinned)
    counts = np.isfinite(v) & np.isfinite(x) & np.isfinite(log_y) & (weights > 0)
    if not counts.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    v, x, log_y = v[counts], x[counts], log_y[counts]
    factors = np.zeros((v.size, 2, 2))
    factors[:, 0, 0] = np.exp(0.5 * (v - log_y))
    factors[:, 1, 0] = x * factors[:, 0, 0]
    factors[:, 1, 1] = np.exp(0.5 * (v + log_y))
    return factors, weights[counts]
