"""A check of every answer: a map whose method is known to be conformal or equal-area measures so."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.field.cubature import (
    MAX_EVALUATIONS,
    UNDEFINED,
    UNDEFINED_AT_KINKS,
    AiryKavrayskiy,
    DenseJacobians,
    GeometricMedian,
    Samples,
    Spread,
    airy_kavrayskiy_of,
    dense,
    sample_panels,
)
from projdist.field.extremes import Extreme, Goal, find_extremes
from projdist.field.figures import AnyFigure, Figure, get_figure
from projdist.field.panel_mesh import Integrand
from projdist.matrices import (
    Measure,
    Modes,
    areal_scale,
    field_modes,
    get_measure,
    listed_measures,
    log_anisotropy,
    log_areal_scale,
    orientation,
)
from projdist.numerics import Estimate, get_criterion
from projdist.projections import DeclaredProperty, Projection, ProjectionLike, declared_property_of
from projdist.regions import Place, PointSet, RegionLike, region_for
from projdist.support import check_numbers, tell

_MOST = 60  # matrices, so that it costs nothing
# PROJ's iterations and elliptic functions leave 1e-6; the wrong ellipsoid, or a series far from home, 1e-4 and more.
_EXACT = 1e-5


def tell_of_contradiction(
    projection: Projection, J: FloatArray, weight: FloatArray | None = None, error: float = 0.0
) -> None:
    """Tell where most of some Jacobians (..., 2, 2) of an error are not what the method of a map promises.

    Of those with weights (...) the heaviest count: nodes crowd where a map is singular, and PROJ's rounding is large.
    """
    nature = declared_property_of(projection)
    if nature is None:
        return
    J = J.reshape(-1, 2, 2)
    if weight is not None:
        J = J[np.argsort(-np.abs(weight), axis=None)[: max(_MOST, len(J) // 4)]]
    J = J[:: max(1, len(J) // _MOST)]
    J = J[np.isfinite(J).all(axis=(-1, -2))]
    if not len(J):
        return
    off = departure(nature, J)
    if off > max(_EXACT, error):
        tell(
            f"{projection.label} is not {nature.keeps} here, as {nature.name} should be: {_told(nature, off)}. "
            "It may be too far from where the map is meant for."
        )


def _told(nature: DeclaredProperty, off: float) -> str:
    if nature.keeps == "conformal":  # tan^2 of (90 degrees + omega) / 4 is the ratio of the scales
        return f"angles are off by {_figure(np.degrees(2.0 * np.arcsin(np.tanh(off / 2.0))))} degrees"
    return f"areas differ by {_figure(100.0 * np.expm1(off))} %"


def _figure(value: float) -> str:
    """Two digits, or all of those before the point."""
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"


def departure(nature: DeclaredProperty, J: FloatArray) -> float:
    """How far most Jacobians (n, 2, 2) are from what a method keeps, as a logarithm of scales."""
    return _DEPARTURES[nature.keeps](J)


def _of_angles(J: FloatArray) -> float:
    return float(np.median(log_anisotropy(J)))


def _of_areas(J: FloatArray) -> float:
    """Half the points are within this of one another: equal-area maps have one areal scale, which need not be 1."""
    values = np.sort(log_areal_scale(J))  # `np.quantile` takes ten times as long for so few
    low, high = np.interp([0.25 * (values.size - 1), 0.75 * (values.size - 1)], np.arange(values.size), values)
    return float(high - low) if np.isfinite(values[-1]) else np.nan


_DEPARTURES: dict[str, Callable[[FloatArray], float]] = {"conformal": _of_angles, "equal-area": _of_areas}


# ---- the field of a map --------------------------------------------------------------------------


DEFAULT_TOLERANCE = 1e-8
_STEEPNESS = 2.0  # a measure's change with the logarithms of the scales, over itself: of second degree at most
_SLACK = 0.5  # of the tolerance that would do where the error falls in proportion to it, which it may miss a little

AnyMeasure = str | Measure | Callable[..., FloatArray]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Field:
    """The Jacobian of a map over a region, at n nodes with weights, and every figure that is made of it.

    Measures are named as everywhere, or functions of J (n, 2, 2), or given by their values (n,) at the nodes. Figures
    are those of the whole region, not of the nodes: the nodes' weights, which along the edges of polygons may be
    negative, integrate a polynomial through them.

    Attributes
    ----------
    projection, region
        What was sampled; None for a field of given Jacobians.
    measures : dict
        The measures that the samples resolve, by the names that they were asked for.
    """

    projection: Projection | None
    region: Place | None
    measures: dict[str, Measure]
    _samples: Samples
    _coarser: Field | None = None  # of the same region, by whose figures ours may be wrong

    def __repr__(self) -> str:
        """One line."""
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
        """How many points were projected."""
        return self._samples.evaluations + (self._coarser.evaluations if self._coarser else 0)

    @property
    def limit(self) -> str:
        """Why the refinement stopped: "" at the tolerance, "rounding" at the projection's own noise, or "budget"."""
        return self._samples.limit

    @property
    def mirrored(self) -> float:
        """The share of what is covered that the map turns over."""
        return float(self.weight[orientation(self.jacobian) < 0].sum() / self.weight.sum())

    @property
    def error(self) -> float:
        """By how much the Airy-Kavrayskiy errors may be wrong."""
        return self.airy_kavrayskiy.error

    @functools.cached_property
    def airy_kavrayskiy(self) -> AiryKavrayskiy:
        """The Airy-Kavrayskiy errors, raw, scaled and affine; the largest of their errors; and the MDT (2, 2)."""
        found = airy_kavrayskiy_of(self._samples)
        if self._coarser is None:
            return found
        cost = float(np.max(np.abs(np.subtract(found[:3], self._coarser.airy_kavrayskiy[:3]))))
        return found._replace(error=found.error + cost)

    @functools.cached_property
    def angles_and_areas(self) -> tuple[float, float]:
        """The two parts of the Airy-Kavrayskiy error after the best scale; infinite where one diverges.

        They are the RMS of ln(a/b) and the standard deviation of ln(ab), both over the root of two.
        """
        angular = self.statistic("log_anisotropy", "rms").value / np.sqrt(2.0)
        areal = self.statistic("log_areal_scale", "std").value / np.sqrt(2.0)
        if np.isnan(areal):  # of noise about a singular point: what angles leave of the whole is known
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
        defined = areal_scale(self.jacobian) > 0
        return field_modes(self.jacobian[defined], self.weight[defined], T)

    @functools.cached_property
    def geometric_median(self) -> GeometricMedian:
        """The linear map T (2, 2) of the least mean of Dist_F(T^-1 J), its error, and whether it is the only one.

        >>> round(float(sample("plate-carree").geometric_median.T[0, 0]), 3)  # half of the globe has less: 2 / sqrt(3)
        1.155
        """
        return self._dense_jacobians.median()

    def spread(self, T: ArrayLike = ((1.0, 0.0), (0.0, 1.0))) -> Spread:
        """The mean Fisher distortion of T^-1 J by area, and what half of the area is below; each with its error."""
        return self._dense_jacobians.spread(np.asarray(T, dtype=float))

    @property
    def dense_factors(self) -> tuple[FloatArray, FloatArray]:
        """Factors L (m, 2, 2), lower triangular with L L^T = J J^T, at very many points, and their weights (m,)."""
        return self._dense_jacobians.whole

    @functools.cached_property
    def dense_jacobian(self) -> tuple[FloatArray, FloatArray]:
        """J (m, 2, 2) at very many points, interpolated entry by entry, and their weights (m,)."""
        entries = np.moveaxis(self._samples.jacobian, (-2, -1), (0, 1)).reshape(4, *self._samples.weight.shape)
        dense_entries, weights = dense(self.region, self._samples, entries)
        return dense_entries.T.reshape(-1, 2, 2), weights

    @functools.cached_property
    def _dense_jacobians(self) -> DenseJacobians:
        return DenseJacobians(self.region, self._samples)

    def values(self, measure: AnyMeasure) -> FloatArray:
        """The values (n,) of a measure at the nodes; raises ValueError."""
        return self._values(self._measure(measure)).ravel()

    def mean(self, measure: AnyMeasure | ArrayLike, *, slope: ArrayLike | None = None) -> Estimate:
        """The mean by true area; NaN where it diverges. Raises ValueError.

        `slope` (n,) is the change of the values with the logarithms of the scales, for the error; without it, twice the
        values.

        >>> sample("plate-carree", "globe").mean("s").value  # the mean of 1 / cos(lat) by area is pi / 2
        1.57079632...
        """
        known = None if slope is None else np.reshape(np.asarray(slope, dtype=float), self._samples.weight.shape)
        return self._with_coarser(*self._given(measure), lambda field, one, values: field._mean(one, values, known))

    def rms(self, measure: AnyMeasure | ArrayLike) -> Estimate:
        """The root mean square by true area; NaN where it diverges. Raises ValueError."""
        return self._with_coarser(*self._given(measure), lambda field, one, values: field._rms(one, values))

    def maximum(self, measure: AnyMeasure) -> Extreme:
        """The largest value over the region, its place, and by how much it may be missed. Raises ValueError."""
        return self._extremes([(self._measure(measure), True)])[0]

    def minimum(self, measure: AnyMeasure) -> Extreme:
        """The smallest value over the region, its place, and by how much it may be missed. Raises ValueError."""
        return self._extremes([(self._measure(measure), False)])[0]

    def extremes(self, measures: Iterable[AnyMeasure]) -> list[tuple[Extreme, Extreme]]:
        """The smallest and the largest value of each measure; several together cost little more than one."""
        found = self._extremes([(self._measure(one), largest) for one in measures for largest in (False, True)])
        return list(zip(found[0::2], found[1::2], strict=True))

    def statistic(self, measure: AnyMeasure | ArrayLike, criterion: Any = "mean") -> Estimate:
        """A figure by the name of its criterion (mean, rms, std, median, pNN, max, min), or a function.

        A function takes values (m,) and weights (m,) of many points of the region. Raises ValueError.

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
            return self._with_coarser(one, values, lambda field, _, v: field._std(v))
        if criterion in ("max", "min") and one is not None:
            found = self.maximum(one) if criterion == "max" else self.minimum(one)
            return Estimate(found.value, found.error)
        whole, half = (compute(*self._many(values, thinned)) for thinned in (False, True))
        return Estimate(whole, abs(whole - half))

    def figure(self, figure: AnyFigure) -> Estimate:
        """A figure of `FIGURES` by its name, or one of your own: a function of J, as `get_figure` takes them.

        Raises ValueError.

        >>> round(sample("plate-carree", "globe").figure("airy_kavrayskiy").value, 8)
        0.52124046
        """
        return next(iter(self.figures([figure]).values()))

    def figures(self, figures: Iterable[AnyFigure]) -> dict[str, Estimate]:
        """Several figures by their names; largest values are searched for together, which costs little more than one.

        Raises ValueError.

        >>> found = sample("mercator", "box:-10,0,10,60").figures(["max_omega", "max_areal_error_ppm"])
        >>> round(found["max_areal_error_ppm"].value)
        3000000
        """
        chosen = [get_figure(one) for one in figures]
        searched = list(dict.fromkeys(one.measure for one in chosen if one.is_maximum))
        largest = dict(zip(searched, self._extremes([(one, True) for one in searched]), strict=True))
        return {
            one.name: Estimate(largest[one.measure].value, largest[one.measure].error)
            if one.is_maximum
            else self._mean_figure(one)
            for one in chosen
        }

    def _mean_figure(self, figure: Figure) -> Estimate:
        """A figure that is a mean or a root mean square."""
        if figure.is_airy_kavrayskiy:
            return Estimate(getattr(self.airy_kavrayskiy, figure.version or "raw"), self.error)
        return self.statistic(figure.measure, figure.statistic)

    def many(self, measure: AnyMeasure | ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values (m,) and weights (m,) at very many points, none of them negative: for quantiles and shares."""
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
        """The measure, if it is one, and its values at the nodes in the samples' own shape."""
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
        """A figure whose error counts what it would be of the coarser field."""
        found = figure(self, measure, values)
        if self._coarser is None or measure is None:
            return found
        other = figure(self._coarser, measure, self._coarser._values(measure))
        return found._replace(error=found.error + abs(found.value - other.value))

    def _extremes(self, wanted: Sequence[tuple[Measure, bool]]) -> list[Extreme]:
        """The extreme of each measure, the largest or the smallest as is wanted, from one search."""
        goals = [Goal(one, self._values(one), largest) for one, largest in wanted]
        found = find_extremes(self.projection, self._samples, goals)
        if self._coarser is not None and self.projection is None:
            found = [_missed(*both) for both in zip(found, self._coarser._extremes(wanted), strict=True)]
        return [self._unbounded(goal, one) for goal, one in zip(goals, found, strict=True)]

    def _unbounded(self, goal: Goal, found: Extreme) -> Extreme:
        """An extreme, infinite where the integral of its measure diverges to that side."""
        if goal.measure.bounded or not self._samples.diverges(goal.values):
            return found
        upward = np.nansum(self._samples.weight * goal.values) >= 0
        return found if goal.largest != upward else found._replace(value=goal.sign * np.inf, error=np.nan)

    def _mean(self, measure: Measure | None, values: FloatArray, slope: FloatArray | None = None) -> Estimate:
        if not (measure and measure.bounded) and self._samples.diverges(values):
            return Estimate(np.nan, np.nan)
        slope = _STEEPNESS * np.abs(values) if slope is None else slope
        return Estimate(*self._samples.mean(values, slope, most=_undefined(measure)))

    def _rms(self, measure: Measure | None, values: FloatArray) -> Estimate:
        if not (measure and measure.bounded) and self._samples.diverges(values**2):
            return Estimate(np.nan, np.nan)
        square = self._samples.mean(values**2, 2.0 * _STEEPNESS * values**2, most=_undefined(measure))
        return Estimate(*square).root()

    def _std(self, values: FloatArray) -> Estimate:
        return self._rms(None, values - self._mean(None, values).value)

    def _many(self, values: FloatArray, thinned: bool = False) -> tuple[FloatArray, FloatArray]:
        (many,), weights = dense(self.region, self._samples, values[None], thinned=thinned)
        return many, weights


def _missed(fine: Extreme, coarse: Extreme) -> Extreme:
    """An extreme of nodes, which lie half as far from the true one as coarser nodes: twice what these miss more."""
    return fine._replace(error=fine.error + 2.0 * abs(fine.value - coarse.value))


def _undefined(measure: Measure | None) -> float:
    return UNDEFINED_AT_KINKS if measure and measure.needs_hessian else UNDEFINED


def named_measures(measures: Any) -> dict[str, Measure]:
    """Measures by the text that they were asked for; raises ValueError where two have the same."""
    chosen: dict[str, Measure] = {}
    for given in listed_measures(measures):
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
        Whose means are resolved besides the Airy-Kavrayskiy errors: to max(tolerance, 1e-6) of themselves where they
        are above 1, those of second derivatives to 1e-5. Other measures may be asked of the field, too; their errors
        tell how well they are resolved.
    tolerance : float, default 1e-8
        To which the Airy-Kavrayskiy errors are resolved, where the projection's rounding allows.

    Returns
    -------
    Field
        Its `mean`, `rms`, `statistic`, `maximum`, `minimum` and `figure` are those of the region, each with its error.

    Raises
    ------
    ValueError
        For an unknown region or measure, and a tolerance that is not positive.
    ProjectionError
        For what is no projection, and where no point of the region can be projected.

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
    field = _field(projection, region, measures, tolerance)
    error = field.airy_kavrayskiy.error
    tell_of_contradiction(projection, field.jacobian, field.weight, max(tolerance, error))
    if error > tolerance and not field.limit:
        # The affine error is no goal of the refinement, and seldom larger than the others.
        field = _field(projection, region, measures, _SLACK * tolerance * tolerance / error)
    return field


def _field(projection: Projection, region: Place, measures: dict[str, Measure], tolerance: float) -> Field:
    of_J = [measure for measure in measures.values() if not measure.needs_hessian]
    integrands = [integrand for measure in of_J for integrand in (measure, _squared(measure))]
    # The squares of flexion and skewness diverge on most maps.
    of_H = [measure for measure in measures.values() if measure.needs_hessian]
    field = field_resolving(projection, region, integrands, of_H, tolerance=tolerance)
    return replace(field, measures=measures)


def _squared(measure: Measure) -> Integrand:
    return lambda J: measure(J) ** 2


def field_resolving(
    projection: Projection,
    region: Place,
    integrands: Sequence[Integrand] = (),
    second_order: Sequence[Measure] = (),
    *,
    tolerance: float,
    max_evaluations: int = MAX_EVALUATIONS,
) -> Field:
    """The field of a projection over a region, without the notice and the second pass that `sample` has.

    It resolves the raw and the scaled Airy-Kavrayskiy error to `tolerance`, the mean m of each integrand, a function of
    J (n, p, p, 2, 2), to max(tolerance, 1e-6) * max(1, |m|), and that of each measure of `second_order` to 1e-5. The
    means may take a quarter of `max_evaluations` each beyond these. Raises ValueError and ProjectionError as `sample`.
    """
    samples = sample_panels(
        projection,
        region,
        tolerance=tolerance,
        integrands=integrands,
        second_order=second_order,
        max_evaluations=max_evaluations,
    )
    return Field(projection=projection, region=region, measures={}, _samples=samples)
