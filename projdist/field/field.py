"""The Jacobian field of a map over a region, all figures that are made of it, and a check of declared properties."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist import matrices
from projdist._typing import FloatArray
from projdist.field import cubature
from projdist.field.cubature import AiryKavrayskiy, GeometricMedian, Samples, Spread
from projdist.field.extreme_bounds import Goal
from projdist.field.extremes import Extreme, find_extremes
from projdist.field.figures import AnyFigure, get_figure
from projdist.field.panel_mesh import Integrand
from projdist.matrices import Measure, Modes, get_measure
from projdist.numerics import Estimate, get_criterion, mean, median
from projdist.projections import DeclaredProperty, Projection, ProjectionLike, declared_property_of
from projdist.regions import Place, PointSet, RegionLike, region_for
from projdist.support import check_numbers, tell

# ---- declared properties -------------------------------------------------------------------------


_MOST = 60  # Jacobians, so that the check costs next to nothing
# PROJ's iterations and elliptic functions leave 1e-6; the wrong ellipsoid, or a series far from home, 1e-4 and more.
_EXACT = 1e-5


def check_declared_property(
    projection: Projection, J: FloatArray, weight: FloatArray | None = None, error: float = 0.0
) -> None:
    """Give a notice if most Jacobians (..., 2, 2) lack the property that the map's method is declared to keep.

    They may be wrong by `error`. Of Jacobians with weights (...) the heaviest count, because nodes crowd where a map is
    singular and PROJ's rounding is large.
    """
    declared = declared_property_of(projection)
    if declared is None:
        return
    J = J.reshape(-1, 2, 2)
    if weight is not None:
        J = J[np.argsort(-np.abs(weight), axis=None)[: max(_MOST, len(J) // 4)]]
    J = J[:: max(1, len(J) // _MOST)]
    J = J[np.isfinite(J).all(axis=(-1, -2))]
    if not len(J) or not (off := departure(declared, J)) > max(_EXACT, error):
        return
    if declared.keeps == "conformal":  # tan^2 of (90 degrees + omega) / 4 is the ratio of the scales
        size, text = np.degrees(2.0 * np.arcsin(np.tanh(off / 2.0))), "angles are off by {} degrees"
    else:
        size, text = 100.0 * np.expm1(off), "areas differ by {} %"
    digits = f"{size:.2g}" if size < 99.5 else f"{size:,.0f}"
    tell(
        f"{projection.label} is not {declared.keeps} here, as {declared.name} should be: {text.format(digits)}. "
        "It may be too far from where the map is meant for."
    )


def departure(declared: DeclaredProperty, J: FloatArray) -> float:
    """How far most Jacobians (n, 2, 2) are from a declared property, as a logarithm of scales."""
    if declared.keeps == "conformal":
        return float(np.median(matrices.log_anisotropy(J)))
    # Equal-area maps have one areal scale, which need not be 1: the range of half of the points.
    values = np.sort(matrices.log_areal_scale(J))  # `np.quantile` takes ten times as long for so few
    low, high = np.interp([0.25 * (values.size - 1), 0.75 * (values.size - 1)], np.arange(values.size), values)
    return float(high - low) if np.isfinite(values[-1]) else np.nan


# ---- the field of a map --------------------------------------------------------------------------


DEFAULT_TOLERANCE = 1e-8
_STEEPNESS = 2.0  # derivative of a measure by the logarithms of the scales, over itself: of second degree at most
_NOISE = 1e-7  # of logarithms of scales, as interpolation leaves them
# Of a square about r^-1.67, the strongest singularity that counts as convergent, the Gauss rule misses 16 %.
_MISSED = 0.16
_BOUNDED = 0.01  # error of an extreme over itself: noise alone, as beside the rim of Guyou's map, makes no infinity
_SLACK = 0.5  # of the tolerance that would be enough if the error were proportional to it

AnyMeasure = str | Measure | Callable[..., FloatArray]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Field:
    """The Jacobian of a map over a region, at n nodes with weights, and every figure that is made of it.

    A measure is given by its name, as a function of J (n, 2, 2), or by its values (n,) at the nodes. Figures are those
    of the whole region, not of the nodes: the weights, which may be negative along the edges of polygons, integrate a
    polynomial through the nodes.

    Attributes
    ----------
    projection, region
        The map and the place; None for a field of given Jacobians.
    measures : dict
        The measures whose means the nodes resolve, by the names that they were asked for.
    """

    projection: Projection | None
    region: Place | None
    measures: dict[str, Measure]
    _samples: Samples
    _coarser: Field | None = None  # of the same region; figures are as uncertain as they differ from its own

    def __repr__(self) -> str:
        """The map, the region and the number of nodes."""
        of = self.projection.name if self.projection else "Jacobians"
        over = f" over {self.region.name}" if self.region else ""
        return f"Field({of}{over}: {self.lon.size} nodes)"

    @property
    def lon(self) -> FloatArray:
        """Longitudes (n,) of the nodes in degrees."""
        return self._samples.lon.ravel()

    @property
    def lat(self) -> FloatArray:
        """Latitudes (n,) of the nodes in degrees."""
        return self._samples.lat.ravel()

    @property
    def jacobian(self) -> FloatArray:
        """Jacobians (n, 2, 2) at the nodes, metre per metre."""
        return self._samples.jacobian.reshape(-1, 2, 2)

    @property
    def hessian(self) -> FloatArray | None:
        """Second derivatives (n, 2, 2, 2) per radian of the semi-major axis, if a measure that needs them was named."""
        return None if self._samples.hessian is None else self._samples.hessian.reshape(-1, 2, 2, 2)

    @property
    def weight(self) -> FloatArray:
        """The nodes' weights (n,): true area in m^2, or the points' own."""
        return self._samples.weight.ravel()

    @property
    def coverage(self) -> float:
        """The share of the region that can be projected; the figures are for that share."""
        return self._samples.coverage

    @property
    def evaluations(self) -> int:
        """Number of points that were projected."""
        return self._samples.evaluations + (self._coarser.evaluations if self._coarser else 0)

    @property
    def limit(self) -> str:
        """What stopped the refinement: "" the tolerance, "rounding" the projection's own noise, or "budget"."""
        return self._samples.limit

    @property
    def mirrored(self) -> float:
        """The share of the covered area that the map shows mirrored."""
        return float(self.weight[matrices.orientation(self.jacobian) < 0].sum() / self.weight.sum())

    @property
    def error(self) -> float:
        """The largest error of the Airy-Kavrayskiy errors."""
        return self.airy_kavrayskiy.error

    @functools.cached_property
    def airy_kavrayskiy(self) -> AiryKavrayskiy:
        """The Airy-Kavrayskiy errors, raw, scaled and affine; the largest of their errors; and the MDT (2, 2)."""
        found = cubature.airy_kavrayskiy_of(self._samples)
        if self._coarser is None:
            return found
        cost = float(np.max(np.abs(np.subtract(found[:3], self._coarser.airy_kavrayskiy[:3]))))
        return found._replace(error=found.error + cost)

    @functools.cached_property
    def angles_and_areas(self) -> tuple[float, float]:
        """The two parts of the scaled Airy-Kavrayskiy error, due to angles and to areas; infinite if one diverges.

        They are the RMS of ln(a/b) and the standard deviation of ln(ab), both divided by sqrt(2).
        """
        angular = self.statistic("log_anisotropy", "rms").value / np.sqrt(2.0)
        areal = self.statistic("log_areal_scale", "std").value / np.sqrt(2.0)
        if np.isnan(areal):  # due to noise about a singular point; the rest of the whole is due to areas
            areal = np.sqrt(max(self.airy_kavrayskiy.scaled**2 - angular**2, 0.0))
        angular, areal = (float(value) if np.isfinite(value) else np.inf for value in (angular, areal))
        return angular, areal

    @functools.cached_property
    def modes(self) -> Modes:
        """The principal components of the distortion about the MDT, and their shares of its mean square.

        >>> sample("plate-carree").modes
        Modes(100 % horizontal)
        """
        T = self.airy_kavrayskiy.mdt  # raises where the map is singular everywhere
        defined = matrices.areal_scale(self.jacobian) > 0
        return matrices.field_modes(self.jacobian[defined], self.weight[defined], T)

    @functools.cached_property
    def geometric_median(self) -> GeometricMedian:
        """The linear map T (2, 2) with the least mean of Dist_F(T^-1 J), its error, and whether it is unique.

        >>> round(float(sample("plate-carree").geometric_median.T[0, 0]), 3)  # half of the globe has less: 2 / sqrt(3)
        1.155
        """
        noise = 0.0 if self._half_factors is None else _NOISE
        found = matrices.field_median(*self.dense_factors, noise)
        if self._half_factors is None:
            return GeometricMedian(found.T, 0.0, bool(found.unique))
        other = matrices.field_median(*self._half_factors, noise)
        return GeometricMedian(found.T, 0.5 * float(matrices.factor_distance(found.T, other.T)), True)

    def spread(self, T: ArrayLike = ((1.0, 0.0), (0.0, 1.0))) -> Spread:
        """The mean and the median Fisher distortion of T^-1 J by area, each with its error."""
        whole, half = (
            (matrices.fisher(np.asarray(np.linalg.solve(np.asarray(T, dtype=float), L), dtype=float)), weights)
            for L, weights in (self.dense_factors, self._half_factors or self.dense_factors)
        )
        return Spread(*(Estimate(figure(*whole), abs(figure(*whole) - figure(*half))) for figure in (mean, median)))

    @functools.cached_property
    def dense_factors(self) -> tuple[FloatArray, FloatArray]:
        """Factors L (m, 2, 2), lower triangular with L L^T = J J^T, at very many points, and their weights (m,)."""
        return cubature.dense_factors(self.region, self._samples)

    @functools.cached_property
    def _half_factors(self) -> tuple[FloatArray, FloatArray] | None:
        """`dense_factors` at half of the points, from which errors are estimated; None for points."""
        if self.region is None or self._samples.weight.shape[-1] == 1:
            return None
        return cubature.dense_factors(self.region, self._samples, thinned=True)

    @functools.cached_property
    def dense_jacobian(self) -> tuple[FloatArray, FloatArray]:
        """J (m, 2, 2) at very many points, interpolated entry by entry, and their weights (m,)."""
        entries = np.moveaxis(self._samples.jacobian, (-2, -1), (0, 1)).reshape(4, *self._samples.weight.shape)
        dense_entries, weights = cubature.quantile_samples(self.region, self._samples, entries)
        return dense_entries.T.reshape(-1, 2, 2), weights

    def values(self, measure: AnyMeasure) -> FloatArray:
        """The values (n,) of a measure at the nodes; raises ValueError."""
        return self._values(self._measure(measure)).ravel()

    def mean(self, measure: AnyMeasure | ArrayLike, *, slope: ArrayLike | None = None) -> Estimate:
        """The mean by true area; NaN if it diverges. Raises ValueError.

        `slope` (n,) is the derivative of the values by the logarithms of the scales, from which the error follows; by
        default it is twice the values.

        >>> sample("plate-carree", "globe").mean("s").value  # the mean of 1 / cos(lat) by area is pi / 2
        1.57079632...
        """
        known = None if slope is None else np.reshape(np.asarray(slope, dtype=float), self._samples.weight.shape)
        return self._with_coarser(*self._given(measure), lambda field, one, values: field._mean(one, values, known))

    def rms(self, measure: AnyMeasure | ArrayLike) -> Estimate:
        """The root mean square by true area; NaN if it diverges. Raises ValueError."""
        return self._with_coarser(*self._given(measure), lambda field, one, values: field._rms(one, values))

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

    def statistic(self, measure: AnyMeasure | ArrayLike, criterion: Any = "mean") -> Estimate:
        """A statistic of a measure: mean, rms, std, median, pNN, max or min, or a function.

        A function takes the values (m,) and weights (m,) of many points of the region. Raises ValueError.

        >>> round(sample("mercator", "box:-10,0,10,60").statistic("k", "max").value, 9)
        2.0
        """
        compute = get_criterion(criterion)
        if criterion == "mean":
            return self.mean(measure)
        if criterion == "rms":
            return self.rms(measure)
        one, values = self._given(measure)
        if criterion == "std":
            return self._with_coarser(one, values, lambda field, _, v: field._rms(None, v - field._mean(None, v).value))
        if criterion in ("max", "min") and one is not None:
            found = self.maximum(one) if criterion == "max" else self.minimum(one)
            return Estimate(found.value, found.error)
        whole, half = (compute(*self._many(values, thinned)) for thinned in (False, True))
        return Estimate(whole, abs(whole - half))

    def figure(self, figure: AnyFigure) -> Estimate:
        """A figure of `FIGURES` by its name, or your own, as `get_figure` takes it.

        Raises ValueError.

        >>> round(sample("plate-carree", "globe").figure("airy_kavrayskiy").value, 8)
        0.52124046
        """
        return next(iter(self.figures([figure]).values()))

    def figures(self, figures: Iterable[AnyFigure]) -> dict[str, Estimate]:
        """Several figures by their names; their maxima are searched together, which costs little more than one.

        Raises ValueError.

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
                found[one.name] = Estimate(largest[one.measure].value, largest[one.measure].error)
            elif one.is_airy_kavrayskiy:
                found[one.name] = Estimate(getattr(self.airy_kavrayskiy, one.version or "raw"), self.error)
            else:
                found[one.name] = self.statistic(one.measure, one.statistic)
        return found

    def many(self, measure: AnyMeasure | ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values (m,) and weights (m,), none of them negative, at very many points: for quantiles and shares."""
        return self._many(self._given(measure)[1])

    # ---- how they are computed --------------------------------------------------------------

    def _measure(self, given: Any) -> Measure:
        measure = self.measures.get(given) if isinstance(given, str) else None
        measure = measure or get_measure(given)
        if measure.needs_hessian and self._samples.hessian is None:
            raise ValueError(
                f"Invalid measure '{measure.name}' of this field. It needs second derivatives: sample them by its name."
            )
        return measure

    def _given(self, figure: Any) -> tuple[Measure | None, FloatArray]:
        """The measure, None for given values, and its values at the nodes in the samples' shape."""
        if isinstance(figure, str | Measure) or callable(figure):
            measure = self._measure(figure)
            return measure, self._values(measure)
        values = check_numbers("values", figure)
        if values.size != self._samples.weight.size:
            raise ValueError(
                f"Invalid values of shape {values.shape}. There must be one for each of {self.lon.size} nodes."
            )
        return None, values.reshape(self._samples.weight.shape)

    def _values(self, measure: Measure) -> FloatArray:
        return measure(self._samples.jacobian, self._samples.hessian)

    def _with_coarser(
        self,
        measure: Measure | None,
        values: FloatArray,
        figure: Callable[[Field, Measure | None, FloatArray], Estimate],
    ) -> Estimate:
        """A figure whose error includes its difference from the coarser field's."""
        found = figure(self, measure, values)
        if self._coarser is None or measure is None:
            return found
        other = figure(self._coarser, measure, self._coarser._values(measure))
        return found._replace(error=found.error + abs(found.value - other.value))

    def _extremes(self, wanted: Sequence[tuple[Measure, bool]]) -> list[Extreme]:
        """The extreme of each measure, the largest if True, from one search."""
        if not wanted:
            return []
        goals = [Goal(one, self._values(one), largest) for one, largest in wanted]
        found = find_extremes(self.projection, self._samples, goals)
        if self._coarser is not None and self.projection is None:
            # Coarser nodes lie about twice as far from the true extreme: the error is twice the difference.
            coarse = self._coarser._extremes(wanted)
            found = [
                one._replace(error=one.error + 2.0 * abs(one.value - other.value))
                for one, other in zip(found, coarse, strict=True)
            ]
        return [self._unbounded(goal, one) for goal, one in zip(goals, found, strict=True)]

    def _unbounded(self, goal: Goal, found: Extreme) -> Extreme:
        """An extreme, infinite where no search bounds it and the integral of its measure diverges to that side."""
        is_sure = goal.measure.bounded or found.error <= _BOUNDED * abs(found.value)
        if is_sure or not self._samples.diverges(goal.values):
            return found
        upward = np.nansum(self._samples.weight * goal.values) >= 0
        return found if goal.largest != upward else found._replace(value=goal.sign * np.inf, error=np.nan)

    def _mean(self, measure: Measure | None, values: FloatArray, slope: FloatArray | None = None) -> Estimate:
        singular = 0.0 if measure and measure.bounded else self._samples.singular_part(values)
        if singular == np.inf:
            return Estimate(np.nan, np.nan)
        slope = _STEEPNESS * np.abs(values) if slope is None else slope
        value, error = self._samples.mean(values, slope, most=_undefined(measure))
        return Estimate(value, error + _MISSED * singular)

    def _rms(self, measure: Measure | None, values: FloatArray) -> Estimate:
        if not (measure and measure.bounded) and self._samples.diverges(values**2):
            return Estimate(np.nan, np.nan)
        square = self._samples.mean(values**2, 2.0 * _STEEPNESS * values**2, most=_undefined(measure))
        return Estimate(*square).root()

    def _many(self, values: FloatArray, thinned: bool = False) -> tuple[FloatArray, FloatArray]:
        (many,), weights = cubature.quantile_samples(self.region, self._samples, values[None], thinned=thinned)
        return many, weights


def _undefined(measure: Measure | None) -> float:
    """The share of the area on which a measure may be undefined."""
    return cubature.UNDEFINED_AT_KINKS if measure and measure.needs_hessian else cubature.UNDEFINED


def named_measures(measures: Any) -> dict[str, Measure]:
    """Measures by the names that they were asked for; raises ValueError if two have the same."""
    chosen: dict[str, Measure] = {}
    for given in matrices.listed_measures(measures):
        measure = get_measure(given)
        name = given if isinstance(given, str) else measure.name
        if chosen.get(name, measure) != measure:
            raise ValueError(f"Invalid measures. Two are called '{name}'; each must have a name of its own.")
        chosen[name] = measure
    return chosen


def sample(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    *,
    measures: Iterable[AnyMeasure] = (),
    tolerance: float = DEFAULT_TOLERANCE,
) -> Field:
    """The Jacobian field of a projection over a region, sampled finely enough for its figures.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    region : RegionLike, optional
        Anything that `get_region` takes. Without one it is the area of use of a CRS, and the globe for other
        projections.
    measures : iterable of str, Measure or callable, or one of them
        Measures whose means m are resolved to max(tolerance, 1e-6) * max(1, abs(m)), those of second derivatives to
        1e-5. The field gives other measures, too; their errors tell how well they are resolved.
    tolerance : float, default 1e-8
        The error to which the Airy-Kavrayskiy errors are resolved, if the projection's rounding allows.

    Returns
    -------
    Field
        Its `mean`, `rms`, `statistic`, `maximum`, `minimum` and `figure` are those of the region, each with its error.

    Raises
    ------
    ValueError
        For an unknown region or measure, and a tolerance that is not positive.
    ProjectionError
        For what is no projection, and if no point of the region can be projected.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    On Mercator's map s is 1 / cos^2(lat). From the equator to 60 degrees its mean by area is ln(2 + sqrt(3)) / sin(60),
    and its maximum 4.

    >>> field = sample("mercator", "box:0,0,10,60", measures=["s"])
    >>> round(field.mean("s").value, 6), round(field.maximum("s").value, 6)
    (1.520692, 4.0)
    """
    projection = Projection.from_user_input(projection)
    place, chosen = region_for(region, [projection]), named_measures(measures)
    field = _resolved(projection, place, chosen, tolerance)
    if isinstance(place, PointSet) and place.coarse is not None:
        field = replace(field, _coarser=_resolved(projection, place.coarse, chosen, tolerance))
    return field


def _resolved(projection: Projection, region: Place, measures: dict[str, Measure], tolerance: float) -> Field:
    """The field with all three Airy-Kavrayskiy errors to a tolerance."""
    of_J = [measure for measure in measures.values() if not measure.needs_hessian]
    # The squares of flexion and skewness diverge on most maps.
    of_H = [measure for measure in measures.values() if measure.needs_hessian]
    integrands = [integrand for measure in of_J for integrand in (measure, _squared(measure))]
    first = field_resolving(projection, region, integrands, of_H, tolerance=tolerance)
    field = replace(first, measures=measures)
    error = field.airy_kavrayskiy.error
    check_declared_property(projection, field.jacobian, field.weight, max(tolerance, error))
    if error <= tolerance or field.limit:
        return field
    # The affine error is no goal of the refinement, and seldom larger than the others.
    finer = _SLACK * tolerance * tolerance / error
    return replace(field_resolving(projection, region, integrands, of_H, tolerance=finer), measures=measures)


def _squared(measure: Measure) -> Integrand:
    return lambda J: measure(J) ** 2


def field_resolving(
    projection: Projection,
    region: Place,
    integrands: Sequence[Integrand] = (),
    second_order: Sequence[Measure] = (),
    *,
    tolerance: float,
    max_evaluations: int = cubature.MAX_EVALUATIONS,
) -> Field:
    """The field of a projection over a region, without `sample`'s notice and second pass.

    The raw and the scaled Airy-Kavrayskiy error are resolved to `tolerance`, the mean m of each integrand, a function
    of J (n, p, p, 2, 2), to max(tolerance, 1e-6) * max(1, |m|), and that of each measure of `second_order` to 1e-5.
    Each mean may take another quarter of `max_evaluations`. Raises ValueError and ProjectionError as `sample`.
    """
    samples = cubature.sample_panels(
        projection,
        region,
        tolerance=tolerance,
        integrands=integrands,
        second_order=second_order,
        max_evaluations=max_evaluations,
    )
    return Field(projection=projection, region=region, measures={}, _samples=samples)
