"""The questions people ask, and their answers: factors at points, and summaries over regions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import AnyArray, FloatArray
from projdist.answer import Answer, plain
from projdist.criteria import median, p95
from projdist.cubature import UNDEFINED, UNDEFINED_AT_KINKS, Samples, sample
from projdist.derivatives import Quality, derivatives
from projdist.extremes import Extreme, Goal, find_extremes, measure_at
from projdist.frames import Frame, add_columns, is_frame, places
from projdist.mdt import field_mdt
from projdist.measures import Measure, areal_scale, get_measure, log_scales, orientation
from projdist.projections import Projection, ProjectionError
from projdist.quantiles import dense
from projdist.regions import Place, PointSet, get_region

__all__ = ["Comparison", "Factors", "Failure", "MeasureSummary", "Summary", "compare", "factors", "summarize"]

DEFAULT_TOLERANCE = 1e-8
_STEEPNESS = 2.0  # a measure's change with the logarithms of the scales, over itself: of second degree at most
_SLACK = 0.5  # of the tolerance that would do where the error falls in proportion to it, which it may miss a little


# ---- at points ------------------------------------------------------------------------------

_FACTORS = ("h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher")


@dataclass(frozen=True)
class Factors(Answer):
    """Distortion at points: arrays of one shape, NaN where undefined.

    `quality` holds the labels of `Quality`; `error` is the estimated relative error of the
    Jacobian; `extra` the measures asked for beyond the standard ones, by their names.
    """

    projection: Projection
    lon: FloatArray
    lat: FloatArray
    x: FloatArray
    y: FloatArray
    h: FloatArray
    k: FloatArray
    a: FloatArray
    b: FloatArray
    s: FloatArray
    omega: FloatArray
    theta: FloatArray
    convergence: FloatArray
    fisher: FloatArray
    quality: np.typing.NDArray[np.str_]
    error: FloatArray
    jacobian: FloatArray
    extra: dict[str, FloatArray]

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "results": [{"lon", "lat", "x", ...}]}`, one result a point; NaN is None."""
        columns = self._table()
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        results = [dict(zip(columns, map(plain, row), strict=True)) for row in rows]
        return {"projection": self.projection.definition, "results": results}

    def _table(self) -> dict[str, AnyArray]:
        return {"lon": np.ravel(self.lon), "lat": np.ravel(self.lat)} | self.columns()

    def columns(self) -> dict[str, AnyArray]:
        """x, y, the measures and the quality by name, each of shape (n,): what is added to a frame of points."""
        columns = {name: getattr(self, name) for name in ("x", "y", *_FACTORS, "quality")}
        return {name: np.ravel(values) for name, values in (columns | self.extra).items()}


_AnyFrame = TypeVar("_AnyFrame", bound=Frame)


@overload
def factors(projection: Any, lon: ArrayLike, lat: ArrayLike, *, measures: Iterable[str | Measure] = ()) -> Factors: ...


@overload
def factors(
    projection: Any, lon: _AnyFrame, *, measures: Iterable[str | Measure] = (), prefix: str = ""
) -> _AnyFrame: ...


def factors(
    projection: Any, lon: Any, lat: Any = None, *, measures: Iterable[str | Measure] = (), prefix: str = ""
) -> Any:
    """Scales, angles and the other measures of a projection at points in degrees.

    `projection` is anything that `Projection.from_user_input` takes. In the place of `lon` and
    `lat` a pandas DataFrame with the columns `lon` and `lat`, or a GeoDataFrame of points in any
    CRS, gives one of the same kind with columns added, whose names begin with `prefix`. Raises
    ProjectionError, and ValueError for an unknown measure and for rows that are no points.

    >>> round(float(factors("mercator", 10, 60).k), 9)
    2.0
    """
    projection = Projection.from_user_input(projection)
    if is_frame(lon):
        if lat is not None:
            raise ValueError("Invalid latitudes beside a frame. It must be alone: it has its own.")
        found = factors(projection, *places(projection, lon), measures=measures)
        return add_columns(lon, found.columns(), prefix)
    if lat is None or prefix:
        raise ValueError("Invalid points. They must be longitudes and latitudes, or a frame alone.")
    return _factors(projection, lon, lat, measures)


def _factors(projection: Projection, lon: ArrayLike, lat: ArrayLike, measures: Iterable[str | Measure]) -> Factors:
    chosen = _named(measures)
    lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
    found = derivatives(projection, lon, lat)
    J = found.jacobian
    labels = np.array([quality.label for quality in Quality])
    return Factors(
        projection=projection,
        lon=lon,
        lat=lat,
        x=found.x,
        y=found.y,
        **{name: get_measure(name)(J) for name in _FACTORS},
        quality=labels[found.quality],
        error=found.error,
        jacobian=J,
        extra={name: measure_at(projection, measure, lon, lat, J) for name, measure in chosen.items()},
    )


# ---- over regions ---------------------------------------------------------------------------


@dataclass(frozen=True)
class MeasureSummary:
    """A measure over a region: its mean, RMS, median, 95th percentile, and its extremes (infinite: unbounded)."""

    mean: float
    rms: float
    median: float
    p95: float
    max: float
    max_at: tuple[float, float]
    min: float
    min_at: tuple[float, float]
    mean_error: float
    rms_error: float

    def to_dict(self) -> dict[str, Any]:
        """The statistics by name; what is not finite is None."""
        statistics = {name: plain(value) for name, value in self._statistics().items()}
        places = {name: [plain(value) for value in getattr(self, name)] for name in ("max_at", "min_at")}
        return statistics | places

    def _statistics(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in ("mean", "rms", "median", "p95", "max", "min")}

    def _row(self) -> dict[str, float]:
        places = ("max_lon", "max_lat", "min_lon", "min_lat")
        return self._statistics() | dict(zip(places, (*self.max_at, *self.min_at), strict=True))


@dataclass(frozen=True)
class Summary(Answer):
    """A projection over a region.

    `airy_kavrayskiy` is the RMS Fisher distortion, sqrt(mean of ln^2 a + ln^2 b) by true area;
    `..._scaled` after the best uniform scale, `..._affine` after the best linear map.
    `error_estimate` bounds the error of all three. `limit` is "" when the tolerance was met. `mdt`
    is that linear map's inverse T, shape (2, 2), the mean distorting transformation; `mirrored` the
    share of what is covered that the map turns over.
    """

    projection: Projection
    given: str
    region: Place
    coverage: float
    airy_kavrayskiy: float
    airy_kavrayskiy_scaled: float
    airy_kavrayskiy_affine: float
    error_estimate: float
    evaluations: int
    limit: str
    mdt: FloatArray = field(compare=False)
    mirrored: float
    measures: dict[str, MeasureSummary]

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is not finite is None."""
        figures = {name: plain(value) for name, value in self._figures().items()}
        return figures | {name: summary.to_dict() for name, summary in self.measures.items()}

    def _figures(self) -> dict[str, Any]:
        return {
            "projection": self.given,
            "name": self.projection.name,
            "definition": self.projection.definition,
            "coverage": self.coverage,
            "airy_kavrayskiy": self.airy_kavrayskiy,
            "airy_kavrayskiy_scaled": self.airy_kavrayskiy_scaled,
            "airy_kavrayskiy_affine": self.airy_kavrayskiy_affine,
            "error_estimate": self.error_estimate,
            "evaluations": self.evaluations,
        }

    def _row(self) -> dict[str, Any]:
        statistics = ((name, summary._row()) for name, summary in self.measures.items())
        return self._figures() | {f"{name}_{key}": value for name, row in statistics for key, value in row.items()}

    def _table(self) -> list[dict[str, Any]]:
        return [self._row()]


@dataclass(frozen=True)
class Failure:
    """A projection that could not be measured, and why."""

    given: str
    error: str

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "error"}`."""
        return {"projection": self.given, "error": self.error}


@dataclass(frozen=True)
class Comparison(Answer):
    """Summaries of several projections over one region, best first, and the failures.

    The region is one for all, whatever ellipsoid each projection is measured on: its name and its
    area are those on WGS 84, even where all of the maps are of a sphere, or of Mars. A frame has
    the results only.
    """

    region: Place
    results: tuple[Summary, ...]
    failures: tuple[Failure, ...]

    def to_dict(self) -> dict[str, Any]:
        """`{"region": {"name", "area_km2"}, "results": [...], "failures": [...]}`; the area is WGS 84's.

        Of points there is also their number, `points`.
        """
        points = {"points": int(self.region.lon.size)} if isinstance(self.region, PointSet) else {}
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2} | points,
            "results": [result.to_dict() for result in self.results],
            "failures": [failure.to_dict() for failure in self.failures],
        }

    def _table(self) -> list[dict[str, Any]]:
        return [result._row() for result in self.results]


def summarize(
    projection: Any,
    region: str | Place = "globe",
    *,
    measures: Iterable[str | Measure] = (),
    tolerance: float = DEFAULT_TOLERANCE,
) -> Summary:
    """The Airy-Kavrayskiy errors of a projection over a region, and statistics of measures.

    The errors are resolved to `tolerance` where the projection's own rounding and the largest
    number of evaluations allow; `error_estimate` and `limit` tell. Measures are named by the text
    they were asked for. Raises ProjectionError, and ValueError for an unknown region or measure.

    >>> round(summarize("plate-carree").airy_kavrayskiy, 8)
    0.52124046
    """
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    region = get_region(region)
    chosen = _named(measures)
    of_J = [measure for measure in chosen.values() if not measure.needs_hessian]
    integrands = [integrand for measure in of_J for integrand in (measure, _squared(measure))]
    # The squares of flexion and skewness diverge on most maps.
    of_H = [measure for measure in chosen.values() if measure.needs_hessian]
    samples = sample(projection, region, tolerance=tolerance, integrands=integrands, second_order=of_H)
    found = airy_kavrayskiy_of(samples)
    if found.error > tolerance and not samples.limit:
        # The affine error is no goal of the refinement, and seldom larger than the others.
        finer = _SLACK * tolerance * tolerance / found.error
        samples = sample(projection, region, tolerance=finer, integrands=integrands, second_order=of_H)
        found = airy_kavrayskiy_of(samples)
    return Summary(
        projection=projection,
        given=given or projection.label,
        region=region,
        coverage=samples.coverage,
        airy_kavrayskiy=found.raw,
        airy_kavrayskiy_scaled=found.scaled,
        airy_kavrayskiy_affine=found.affine,
        error_estimate=found.error,
        evaluations=samples.evaluations,
        limit=samples.limit or ("rounding" if found.error > tolerance else ""),
        mdt=found.mdt,
        mirrored=float(samples.weight[orientation(samples.jacobian) < 0].sum() / samples.weight.sum()),
        measures=_summarize_measures(projection, region, samples, chosen),
    )


def _named(measures: Iterable[Any]) -> dict[str, Measure]:
    """Measures by the text that they were asked for; raises ValueError where two have the same."""
    chosen: dict[str, Measure] = {}
    for given in measures:
        measure = get_measure(given)
        name = given if isinstance(given, str) else measure.name
        if chosen.get(name, measure) != measure:
            raise ValueError(f"Invalid measures. Two are called '{name}'; each must have a name of its own.")
        chosen[name] = measure
    return chosen


def _squared(measure: Measure) -> Any:
    return lambda J: measure(J) ** 2


class AiryKavrayskiy(NamedTuple):
    """The raw, scaled and affine errors, the largest of their estimated errors, and the MDT."""

    raw: float
    scaled: float
    affine: float
    error: float
    mdt: FloatArray


def airy_kavrayskiy_of(samples: Samples) -> AiryKavrayskiy:
    """The Airy-Kavrayskiy errors of samples; raises ProjectionError where the map is singular everywhere."""
    square, log_area = log_scales(samples.jacobian)
    mean_square, square_error = samples.mean(square, 2.0 * np.sqrt(square))
    shift, shift_error = samples.mean(log_area, 1.0)
    raw, raw_error = _root(mean_square, square_error)
    # The best scale c minimises the mean of (ln a + c)^2 + (ln b + c)^2: c = -mean ln(ab) / 2.
    scaled, scaled_error = _root(mean_square - 0.5 * shift**2, square_error + abs(shift) * shift_error)
    defined = np.isfinite(square) & (areal_scale(samples.jacobian) > 0)
    if not defined.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    result = field_mdt(samples.jacobian[defined], samples.weight[defined])
    distances = np.full(square.shape, np.nan)
    distances[defined] = result.distances
    affine, affine_error = _root(*samples.mean(distances, 2.0 * np.sqrt(distances)))
    return AiryKavrayskiy(raw, scaled, affine, max(raw_error, scaled_error, affine_error), result.T)


def _root(square: float, error: float) -> tuple[float, float]:
    """The square root of a mean square, and its error."""
    if not np.isfinite(square):
        return np.nan, np.nan
    root = float(np.sqrt(max(square, 0.0)))
    return root, float(error / (root + np.sqrt(max(square, 0.0) + error))) if error > 0 else 0.0


def _summarize_measures(
    projection: Projection, region: Place, samples: Samples, measures: dict[str, Measure]
) -> dict[str, MeasureSummary]:
    values = {name: one(samples.jacobian, samples.hessian) for name, one in measures.items()}
    goals = [Goal(one, values[name], largest) for name, one in measures.items() for largest in (True, False)]
    found = find_extremes(projection, region, samples, goals)
    return {
        name: _summarize_measure(region, samples, one, values[name], top, bottom)
        for (name, one), top, bottom in zip(measures.items(), found[0::2], found[1::2], strict=True)
    }


def _summarize_measure(
    region: Place, samples: Samples, measure: Measure, values: FloatArray, top: Extreme, bottom: Extreme
) -> MeasureSummary:
    most = UNDEFINED_AT_KINKS if measure.needs_hessian else UNDEFINED
    average, average_error = samples.mean(values, _STEEPNESS * np.abs(values), most=most)
    square, square_error = samples.mean(values**2, 2.0 * _STEEPNESS * values**2, most=most)
    root, root_error = _root(square, square_error)
    if not measure.bounded and samples.diverges(values):
        average, average_error = np.nan, np.nan
        top, bottom = _infinite(top, bottom, samples, values)
    if not measure.bounded and samples.diverges(values**2):
        root, root_error = np.nan, np.nan
    (many,), weights = dense(region, samples, values[None])
    return MeasureSummary(
        mean=average,
        rms=root,
        median=median(many, weights),
        p95=p95(many, weights),
        max=top.value,
        max_at=(top.lon, top.lat),
        min=bottom.value,
        min_at=(bottom.lon, bottom.lat),
        mean_error=average_error,
        rms_error=root_error,
    )


def _infinite(top: Extreme, bottom: Extreme, samples: Samples, values: FloatArray) -> tuple[Extreme, Extreme]:
    """The extremes of a measure whose integral diverges: the end at which it does is infinite."""
    if np.nansum(samples.weight * values) < 0:
        return top, bottom._replace(value=-np.inf)
    return top._replace(value=np.inf), bottom


def compare(
    projections: Sequence[Any],
    region: str | Place = "globe",
    *,
    measures: Iterable[str | Measure] = (),
    tolerance: float = DEFAULT_TOLERANCE,
) -> Comparison:
    """Summaries of several projections over one region, by ascending `airy_kavrayskiy`.

    A projection that fails is among the `failures`, beside the others' results. Raises ValueError
    for an unknown region or measure.
    """
    region = get_region(region)
    chosen = list(measures)
    _named(chosen)  # an error here is not one of the projections
    results: list[Summary] = []
    failures: list[Failure] = []
    for projection in projections:
        given = projection if isinstance(projection, str) else getattr(projection, "name", str(projection))
        try:
            results.append(summarize(projection, region, measures=chosen, tolerance=tolerance))
        except ProjectionError as error:
            failures.append(Failure(given, str(error)))
    results.sort(key=lambda summary: np.nan_to_num(summary.airy_kavrayskiy, nan=np.inf))
    return Comparison(region, tuple(results), tuple(failures))
