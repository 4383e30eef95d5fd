"""The Jacobian field of a map over a region, and all figures computed from it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist import matrices, regions, support
from projdist._typing import ArrayLike, FloatArray
from projdist.field.extreme_bounds import Goal
from projdist.field.extremes import Extreme, find_extremes
from projdist.field.figures import AiryKavrayskiy, AnyFigure, GeometricMedian, Spread, get_figure
from projdist.field.panels import Pieces, tails
from projdist.matrices import Measure, Modes, get_measure
from projdist.numerics import get_criterion, interpolate, mean, median
from projdist.projections import Projection, ProjectionError

_STEEPNESS = 2.0  # derivative of a measure by the logarithms of the scales, over itself: of second degree at most
_NOISE = 1e-7  # of logarithms of scales, as interpolation leaves them
# Of a square about r^-1.67, the strongest singularity that counts as convergent, the Gauss rule misses 16 %.
_MISSED = 0.16
_BOUNDED = 0.01  # error of an extreme over itself, up to which it is finite: noise can look like a singularity
_ROUNDING = 1e-12  # of J, from the differentiation of x and y
# Smaller panels hold 1e-4 of the integral of a ln^2 singularity at a pole, 1e-3 of that of k, and at most 7e-3 of that
# of a measure with a mean (a of laea); of one that diverges half, the same in each decade of area from 1 to 1e-12.
_TINY = 1e-6  # of the area
_GOOD_PART, _LARGE_PART = 0.02, 0.1  # of the integral, held by tiny panels
_RESOLVED = 0.01  # relative error of a mean that converges; one that diverges is wrong by more
_NOTHING = 1e-6  # a mean that is only rounding, in the unit of any measure
# Shares of the area on which a measure may be undefined: at singular points, and at kinks, of second derivatives.
_UNDEFINED, _UNDEFINED_AT_KINKS = 1e-6, 1e-3
# Points for quantiles, whose error falls as one over their number: of all panels, and of one.
_DENSE, _DENSEST = 200_000, 20_000
_SINGULAR = "Invalid projection. It is singular everywhere: its image is a line or a point."

AnyMeasure = str | Measure | Callable[..., FloatArray]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Field:
    """The Jacobian of a map over a region at n nodes with weights, and every figure computed from it.

    A measure is given by its name, as a function of J (n, 2, 2), or as its values (n,) at the nodes. Figures are those
    of the whole region: the weights, some negative along edges, integrate the polynomial through the nodes.
    """

    projection: Projection | None  # None for a field of given Jacobians
    region: regions.Place | None  # likewise
    measures: dict[str, Measure]  # whose means the nodes resolve, by the names that they were asked for
    coverage: float  # share of the region that can be projected; the figures are for that share
    evaluations: int  # points that were projected
    limit: str  # what stopped the refinement: "" the tolerance, "rounding" the projection's own noise, or "budget"
    _pieces: Pieces
    _charted: regions.Region | None = None  # the region whose chart the pieces use; None for points
    _undecided: float = 0.0  # share of the area left out because it is not known how much of it the map shows
    _coarser: Field | None = None  # of the same region; its differences are the errors of figures

    def __repr__(self) -> str:
        """The map, the region and the number of nodes."""
        of = self.projection.name if self.projection else "Jacobians"
        over = f" over {self.region.name}" if self.region else ""
        return f"Field({of}{over}: {self.lon.size} nodes)"

    @property
    def lon(self) -> FloatArray:
        """Longitudes (n,) of the nodes in degrees."""
        return self._pieces.lon.ravel()

    @property
    def lat(self) -> FloatArray:
        """Latitudes (n,) of the nodes in degrees."""
        return self._pieces.lat.ravel()

    @property
    def jacobian(self) -> FloatArray:
        """Jacobians (n, 2, 2) at the nodes, metre per metre."""
        return self._pieces.jacobian.reshape(-1, 2, 2)

    @property
    def hessian(self) -> FloatArray | None:
        """Second derivatives (n, 2, 2, 2) per radian of the semi-major axis, if a measure that needs them was named."""
        return self._pieces.hessian.reshape(-1, 2, 2, 2) if self._pieces.hessian.size else None

    @property
    def weight(self) -> FloatArray:
        """The nodes' weights (n,): true area in m^2, or the points' own."""
        return self._pieces.weight.ravel()

    @property
    def mirrored(self) -> float:
        """The share of the covered area that the map shows mirrored."""
        weight = self._pieces.weight
        return float(weight[matrices.orientation(self._pieces.jacobian) < 0].sum() / weight.sum())

    @property
    def error(self) -> float:
        """The largest error of the Airy-Kavrayskiy errors."""
        return self.airy_kavrayskiy.error

    @functools.cached_property
    def airy_kavrayskiy(self) -> AiryKavrayskiy:
        """The Airy-Kavrayskiy errors and the MDT; raises ProjectionError where the map is singular everywhere."""
        J, weight = self._pieces.jacobian, self._pieces.weight
        square, log_area = matrices.log_scales(J)
        defined = np.isfinite(square) & (matrices.areal_scale(J) > 0)
        if not defined.any():
            raise ProjectionError(_SINGULAR)
        best = matrices.field_mdt(J[defined], weight[defined] / weight[defined].sum())
        distances = np.full(square.shape, np.nan)
        distances[defined] = best.distances
        slopes = 2.0 * np.sqrt(square), 1.0, 2.0 * np.sqrt(distances)
        mean_square, shift, affine_mean = self._means((square, log_area, distances), slopes)
        # The best scale c minimises the mean of (ln a + c)^2 + (ln b + c)^2: c = -mean ln(ab) / 2.
        rest = mean_square.value - 0.5 * shift.value**2, mean_square.error + abs(shift.value) * shift.error
        raw, scaled, affine = mean_square.root(), support.Estimate(*rest).root(), affine_mean.root()
        error = max(raw.error, scaled.error, affine.error)
        found = AiryKavrayskiy(raw.value, scaled.value, affine.value, error, best.T)
        if self._coarser is None:
            return found
        cost = float(np.max(np.abs(np.subtract(found[:3], self._coarser.airy_kavrayskiy[:3]))))
        return found._replace(error=found.error + cost)

    @functools.cached_property
    def angles_and_areas(self) -> tuple[float, float]:
        """RMS of ln(a/b) and standard deviation of ln(ab) over sqrt(2), the parts of the scaled error; or infinite."""
        angular = self.statistic("log_anisotropy", "rms").value / np.sqrt(2.0)
        areal = self.statistic("log_areal_scale", "std").value / np.sqrt(2.0)
        if np.isnan(areal):  # due to noise about a singular point; the rest of the whole is due to areas
            areal = np.sqrt(max(self.airy_kavrayskiy.scaled**2 - angular**2, 0.0))
        angular, areal = (float(value) if np.isfinite(value) else np.inf for value in (angular, areal))
        return angular, areal

    @functools.cached_property
    def modes(self) -> Modes:
        """The principal components of the distortion about the MDT, and their shares of its mean square.

        >>> from projdist import sample
        >>> sample("plate-carree").modes
        Modes(100 % horizontal)
        """
        T = self.airy_kavrayskiy.mdt  # raises where the map is singular everywhere
        defined = matrices.areal_scale(self.jacobian) > 0
        return matrices.field_modes(self.jacobian[defined], self.weight[defined], T)

    @functools.cached_property
    def geometric_median(self) -> GeometricMedian:
        """The linear map T (2, 2) with the least mean of Dist_F(T^-1 J), its error, and whether it is unique.

        >>> from projdist import sample
        >>> round(float(sample("plate-carree").geometric_median.T[0, 0]), 3)  # half of the globe has less: 2 / sqrt(3)
        1.155
        """
        (L, w), half = self.dense_factors, self._half_factors
        found = matrices.field_mdt(L, w / w.sum(), "median", 0.0 if half is None else _NOISE)
        if half is None:
            return GeometricMedian(found.T, 0.0, bool(found.unique))
        L, w = half
        other = matrices.field_mdt(L, w / w.sum(), "median", _NOISE)
        return GeometricMedian(found.T, 0.5 * float(matrices.factor_distance(found.T, other.T)), True)

    def spread(self, T: ArrayLike = ((1.0, 0.0), (0.0, 1.0))) -> Spread:
        """The mean and the median Fisher distortion of T^-1 J by area, each with its error."""
        whole, half = (
            (matrices.fisher(np.asarray(np.linalg.solve(np.asarray(T, dtype=float), L), dtype=float)), weights)
            for L, weights in (self.dense_factors, self._half_factors or self.dense_factors)
        )
        return Spread(
            *(support.Estimate(figure(*whole), abs(figure(*whole) - figure(*half))) for figure in (mean, median))
        )

    @functools.cached_property
    def dense_factors(self) -> tuple[FloatArray, FloatArray]:
        """Lower triangular L (m, 2, 2) with L L^T = J J^T at very many points, and weights (m,); ProjectionError."""
        return self._factors()

    @functools.cached_property
    def _half_factors(self) -> tuple[FloatArray, FloatArray] | None:
        """`dense_factors` at half of the points, from which errors are estimated; None for points."""
        return None if self._charted is None else self._factors(thinned=True)

    @functools.cached_property
    def dense_jacobian(self) -> tuple[FloatArray, FloatArray]:
        """J (m, 2, 2) at very many points, interpolated entry by entry, and their weights (m,)."""
        J = self._pieces.jacobian
        entries, weights = self._dense(np.moveaxis(J, (-2, -1), (0, 1)).reshape(4, *J.shape[:-2]))
        return entries.T.reshape(-1, 2, 2), weights

    def values(self, measure: AnyMeasure) -> FloatArray:
        """The values (n,) of a measure at the nodes; raises ValueError."""
        return self._values(self._measure(measure)).ravel()

    def mean(self, measure: AnyMeasure | ArrayLike, *, slope: ArrayLike | None = None) -> support.Estimate:
        """The mean by true area; NaN if it diverges. Raises ValueError.

        `slope` (n,), the derivative by the logarithms of the scales, gives the error; by default twice the values.

        >>> from projdist import sample
        >>> sample("plate-carree", "globe").mean("s").value  # the mean of 1 / cos(lat) by area is pi / 2
        1.57079632...
        """
        known = None if slope is None else np.reshape(np.asarray(slope, dtype=float), self._pieces.weight.shape)
        return self._estimated(measure, lambda field, one, values: field._mean(one, values, known))

    def rms(self, measure: AnyMeasure | ArrayLike) -> support.Estimate:
        """The root mean square by true area; NaN if it diverges. Raises ValueError."""
        return self._estimated(measure, lambda field, one, values: field._rms(one, values))

    def maximum(self, measure: AnyMeasure) -> Extreme:
        """The largest value over the region, its place, and its error. Raises ValueError."""
        return self._extremes([(self._measure(measure), True)])[0]

    def minimum(self, measure: AnyMeasure) -> Extreme:
        """The smallest value over the region, its place, and its error. Raises ValueError."""
        return self._extremes([(self._measure(measure), False)])[0]

    def extremes(self, measures: Iterable[AnyMeasure]) -> list[tuple[Extreme, Extreme]]:
        """The smallest and the largest value of each measure; several together cost little more than one."""
        found = self._extremes([(self._measure(one), largest) for one in measures for largest in (False, True)])
        return list(zip(found[0::2], found[1::2], strict=True))

    def statistic(self, measure: AnyMeasure | ArrayLike, criterion: Any = "mean") -> support.Estimate:
        """A statistic of a measure: mean, rms, std, median, pNN, max or min, or a function.

        A function takes the values (m,) and weights (m,) of many points of the region. Raises ValueError.

        >>> from projdist import sample
        >>> round(sample("mercator", "box:-10,0,10,60").statistic("k", "max").value, 9)
        2.0
        """
        compute = get_criterion(criterion)
        if criterion == "mean":
            return self.mean(measure)
        if criterion == "rms":
            return self.rms(measure)
        if criterion == "std":
            return self._estimated(measure, lambda field, _, v: field._rms(None, v - field._mean(None, v).value))
        one, values = self._given(measure)
        if criterion in ("max", "min") and one is not None:
            extreme = self.maximum(one) if criterion == "max" else self.minimum(one)
            return support.Estimate(extreme.value, extreme.error)
        (whole,), weights = self._dense(values[None])
        (half,), half_weights = self._dense(values[None], thinned=True)
        found = compute(whole, weights)
        return support.Estimate(found, abs(found - compute(half, half_weights)))

    def figure(self, figure: AnyFigure) -> support.Estimate:
        """A figure of `FIGURES` by its name, or your own, as `get_figure` takes it; raises ValueError.

        >>> from projdist import sample
        >>> round(sample("plate-carree", "globe").figure("airy_kavrayskiy").value, 8)
        0.52124046
        """
        return next(iter(self.figures([figure]).values()))

    def figures(self, figures: Iterable[AnyFigure]) -> dict[str, support.Estimate]:
        """Several figures by name; maxima, searched together, cost little more than one. Raises ValueError.

        >>> from projdist import sample
        >>> found = sample("mercator", "box:-10,0,10,60").figures(["max_omega", "max_areal_error_ppm"])
        >>> round(found["max_areal_error_ppm"].value)
        3000000
        """
        chosen = [get_figure(one) for one in figures]
        searched = list(dict.fromkeys(one.measure for one in chosen if one.is_maximum))
        largest = dict(zip(searched, self._extremes([(one, True) for one in searched]), strict=True))
        found = {}
        for one in chosen:
            if one.is_maximum:
                found[one.name] = support.Estimate(largest[one.measure].value, largest[one.measure].error)
            elif one.is_airy_kavrayskiy:
                found[one.name] = support.Estimate(getattr(self.airy_kavrayskiy, one.version or "raw"), self.error)
            else:
                found[one.name] = self.statistic(one.measure, one.statistic)
        return found

    def many(self, measure: AnyMeasure | ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values (m,) and weights (m,), none of them negative, at very many points: for quantiles and shares."""
        (many,), weights = self._dense(self._given(measure)[1][None])
        return many, weights

    # ---- how they are computed --------------------------------------------------------------

    def _measure(self, given: Any) -> Measure:
        measure = self.measures.get(given) if isinstance(given, str) else None
        measure = measure or get_measure(given)
        if measure.needs_hessian and not self._pieces.hessian.size:
            raise ValueError(
                f"Invalid measure '{measure.name}' of this field. It needs second derivatives: sample them by its name."
            )
        return measure

    def _given(self, figure: Any) -> tuple[Measure | None, FloatArray]:
        """The measure (None for given values) and its values at the nodes, in the shape of the pieces."""
        if isinstance(figure, str | Measure) or callable(figure):
            measure = self._measure(figure)
            return measure, self._values(measure)
        values = support.check_numbers("values", figure)
        if values.size != self._pieces.weight.size:
            raise ValueError(
                f"Invalid values of shape {values.shape}. There must be one for each of {self.lon.size} nodes."
            )
        return None, values.reshape(self._pieces.weight.shape)

    def _values(self, measure: Measure) -> FloatArray:
        return measure(self._pieces.jacobian, self._pieces.hessian if measure.needs_hessian else None)

    def _estimated(
        self, given: Any, figure: Callable[[Field, Measure | None, FloatArray], support.Estimate]
    ) -> support.Estimate:
        """A figure of a measure or of values; its error includes its difference from the coarser field's."""
        measure, values = self._given(given)
        found = figure(self, measure, values)
        if self._coarser is None or measure is None:
            return found
        other = figure(self._coarser, measure, self._coarser._values(measure))
        return found._replace(error=found.error + abs(found.value - other.value))

    def _extremes(self, wanted: Sequence[tuple[Measure, bool]]) -> list[Extreme]:
        """The extremes of measures, the largest where True, from one search."""
        goals = [Goal(one, self._values(one), largest) for one, largest in wanted]
        found = find_extremes(self.projection, self._charted, self._pieces, goals) if goals else []
        if self._coarser is not None and self.projection is None:
            # Coarser nodes lie about twice as far from the true extreme: the error is twice the difference.
            coarse = self._coarser._extremes(wanted)
            found = [
                one._replace(error=one.error + 2.0 * abs(one.value - other.value))
                for one, other in zip(found, coarse, strict=True)
            ]
        for k, (goal, one) in enumerate(zip(goals, found, strict=True)):
            # Infinite where no search bounds it and the integral of the measure diverges to that side.
            is_sure = goal.measure.bounded or one.error <= _BOUNDED * abs(one.value)
            if not is_sure and self._singular_part(goal.values) == np.inf:
                upward = np.nansum(self._pieces.weight * goal.values) >= 0
                found[k] = one._replace(value=goal.sign * np.inf, error=np.nan) if goal.largest == upward else one
        return found

    def _mean(self, measure: Measure | None, values: FloatArray, slope: FloatArray | None = None) -> support.Estimate:
        singular = 0.0 if measure and measure.bounded else self._singular_part(values)
        if singular == np.inf:
            return support.Estimate(np.nan, np.nan)
        slope = _STEEPNESS * np.abs(values) if slope is None else slope
        value, error = self._means([values], [slope], measure)[0]
        return support.Estimate(value, error + _MISSED * singular)

    def _rms(self, measure: Measure | None, values: FloatArray) -> support.Estimate:
        if not (measure and measure.bounded) and self._singular_part(values**2) == np.inf:
            return support.Estimate(np.nan, np.nan)
        return self._means([values**2], [2.0 * _STEEPNESS * values**2], measure)[0].root()

    def _means(
        self, values: Sequence[FloatArray], slopes: Sequence[FloatArray | float], measure: Measure | None = None
    ) -> list[support.Estimate]:
        """Means over the covered area of values (n, p, p) at the nodes, which together cost little more than one."""
        # `slopes` (n, p, p) are the derivatives of the values by the logarithms of the scales. A mean is NaN if values
        # are undefined on more of the area than singular points have, or kinks if the measure is of second order.
        pieces, doubt = self._pieces, self._pieces.doubt.sum(axis=-1)
        fields, total = np.array(values), float(pieces.weight.sum())
        missing = np.zeros(len(fields))
        undefined = ~np.isfinite(fields)
        if undefined.any():
            missing = np.abs(pieces.weight * undefined).sum(axis=(1, 2, 3)) / total
            fields[undefined] = 0.0
            slopes = [np.where(gap, 0.0, slope) for gap, slope in zip(undefined, slopes, strict=True)]
        parts = fields * pieces.weight
        sums = parts.sum(axis=(1, 2, 3))
        errors = _ROUNDING * np.abs(parts).sum(axis=(1, 2, 3))
        if fields.shape[-1] > 1:
            errors += tails(fields, pieces.density, pieces.share)[1].sum(axis=(1, 2))
        if doubt.any():
            doubtful = doubt[:, None, None] * pieces.weight
            errors += [float(np.sum(doubtful * slope)) for slope in slopes]
        means, errors = sums / total, errors / total
        most = _UNDEFINED_AT_KINKS if measure and measure.needs_hessian else _UNDEFINED
        means[missing > most] = errors[missing > most] = np.nan
        for k, share in enumerate((missing + self._undecided / self.coverage).tolist()):
            if share > 0.0:
                # The missing part may hold as much as the largest mean of |value| over a piece that is no smaller.
                areas = np.abs(pieces.weight).sum(axis=(1, 2))
                broad = areas >= min(share * total, areas.max())
                held = np.abs(pieces.weight * fields[k]).sum(axis=(1, 2))
                errors[k] += share * float((held[broad] / areas[broad]).max())
        return [support.Estimate(*pair) for pair in zip(means.tolist(), errors.tolist(), strict=True)]

    def _singular_part(self, values: FloatArray) -> float:
        """Part of a mean that tiny panels hold: infinite if the mean diverges, 0 if the part is small or for points."""
        # A smaller part that is resolved does not diverge: at corners of Adams' square, with s as r^-1.5, it is 2.5 %.
        if self._charted is None:
            return 0.0
        area = self._pieces.weight.sum(axis=(1, 2))
        parts = np.abs(np.nansum(self._pieces.weight * values, axis=(1, 2))) / area.sum()
        in_tiny = parts[area / area.sum() < _TINY].sum()
        if in_tiny <= max(_GOOD_PART * parts.sum(), _NOTHING):
            return 0.0
        value, error = self._means([values], [0.0])[0]
        converges = in_tiny <= _LARGE_PART * parts.sum() and error <= _RESOLVED * abs(value)
        return float(in_tiny) if converges else np.inf

    def _dense(self, values: FloatArray, *, thinned: bool = False) -> tuple[FloatArray, FloatArray]:
        """Values (m, k) and weights (k,) at many points, `thinned` to half, from values (m, n, p, p) at the nodes."""
        pieces, every = self._pieces, 2 if thinned else 1
        if self._charted is None:
            return values.reshape(len(values), -1)[:, ::every], pieces.weight.ravel()[::every]
        smooth = np.isfinite(values).all(axis=(0, 2, 3))
        m = int(np.clip(_DENSE / values.shape[1], 64, _DENSEST)) // every
        # In each panel a golden-ratio lattice, which has as many different r and s as points.
        step = np.arange(m) + 0.5
        r, s = 2.0 * step / m - 1.0, 2.0 * np.mod(step * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
        fine = []
        for one in values[:, smooth]:
            # A polynomial may overshoot beside a singularity: it stays within what was sampled.
            low, high = one.min(axis=(1, 2)), one.max(axis=(1, 2))
            margin = 0.1 * (high - low)
            fine.append(np.clip(interpolate(one, r, s), (low - margin)[:, None], (high + margin)[:, None]).ravel())
        weights = np.maximum(interpolate(pieces.density[smooth], r, s), 0.0) * (4.0 / m)
        clipped = pieces.share[smooth] < 1.0
        if clipped.any():
            lon, lat = (interpolate(place[smooth][clipped], r, s) for place in (pieces.lon, pieces.lat))
            inside = np.where(self._charted.contains(lon, lat), weights[clipped], 0.0)
            # The points found inside stand for all of the panel's part, whose area is known.
            found, area = inside.sum(axis=1), pieces.weight[smooth][clipped].sum(axis=(1, 2))
            weights[clipped] = inside * np.divide(area, found, out=np.zeros_like(found), where=found > 0)[:, None]
        rest = ~smooth
        return (
            np.concatenate([np.stack(fine), values[:, rest].reshape(len(values), -1)], axis=1),
            np.concatenate([weights.ravel(), np.maximum(pieces.weight[rest], 0.0).ravel()]),
        )

    def _factors(self, *, thinned: bool = False) -> tuple[FloatArray, FloatArray]:
        """Triangular factors (m, 2, 2) of J, and weights (m,) above 0."""
        # Interpolated are ln |det J| and the point in the hyperbolic plane: smooth where J is, however it turns.
        J = self._pieces.jacobian
        row = J[..., 0, 0] ** 2 + J[..., 0, 1] ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            v = matrices.log_areal_scale(J)
            x = (J[..., 0, 0] * J[..., 1, 0] + J[..., 0, 1] * J[..., 1, 1]) / row
            values, weights = self._dense(np.stack([v, x, v - np.log(row)]), thinned=thinned)
        counts = np.isfinite(values).all(axis=0) & (weights > 0)
        if not counts.any():
            raise ProjectionError(_SINGULAR)
        v, x, log_y = values[:, counts]
        factors = np.zeros((v.size, 2, 2))
        factors[:, 0, 0] = np.exp(0.5 * (v - log_y))
        factors[:, 1, 0] = x * factors[:, 0, 0]
        factors[:, 1, 1] = np.exp(0.5 * (v + log_y))
        return factors, weights[counts]
