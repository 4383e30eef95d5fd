"""The questions people ask, and their answers: factors at points, and summaries over regions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.criteria import median, p95
from projdist.cubature import Samples, sample
from projdist.derivatives import Quality, derivatives
from projdist.extremes import find_maximum, measure_at
from projdist.mdt import mdt
from projdist.measures import Measure, areal_scale, get_measure, log_scales
from projdist.panels import interpolate
from projdist.projections import Projection, ProjectionError
from projdist.regions import Region, get_region

__all__ = ["Comparison", "Factors", "Failure", "MeasureSummary", "Summary", "compare", "factors", "summarize"]

DEFAULT_TOLERANCE = 1e-8
_STEEPNESS = 2.0  # measures are of first or second degree in the scales
_SLACK = 0.5


def _plain(value: Any) -> Any:
    """A number for JSON: what is not finite is None."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if not isinstance(value, float) or np.isfinite(value) else None


# ---- at points ------------------------------------------------------------------------------

_FACTORS = ("h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher")


@dataclass(frozen=True)
class Factors:
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
        names = ("lon", "lat", "x", "y", *_FACTORS, "quality")
        columns = {name: np.ravel(getattr(self, name)) for name in names}
        columns |= {name: np.ravel(values) for name, values in self.extra.items()}
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        results = [dict(zip(columns, map(_plain, row), strict=True)) for row in rows]
        return {"projection": self.projection.definition, "results": results}


def factors(projection: Any, lon: ArrayLike, lat: ArrayLike, *, measures: Iterable[str | Measure] = ()) -> Factors:
    """Scales, angles and the other measures of a projection at points in degrees.

    `projection` is anything that `Projection.from_user_input` takes. Raises ProjectionError, and
    ValueError for an unknown measure.

    >>> round(float(factors("mercator", 10, 60).k), 9)
    2.0
    """
    projection = Projection.from_user_input(projection)
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
    """A measure over a region: its mean, RMS, median, 95th percentile and maximum (infinite: unbounded)."""

    mean: float
    rms: float
    median: float
    p95: float
    max: float
    max_at: tuple[float, float]
    mean_error: float
    rms_error: float

    def to_dict(self) -> dict[str, Any]:
        """The statistics by name; what is not finite is None."""
        names = ("mean", "rms", "median", "p95", "max")
        return {name: _plain(getattr(self, name)) for name in names} | {"max_at": [_plain(v) for v in self.max_at]}


@dataclass(frozen=True)
class Summary:
    """A projection over a region.

    `airy_kavrayskiy` is the RMS Fisher distortion, sqrt(mean of ln^2 a + ln^2 b) by true area;
    `..._scaled` after the best uniform scale, `..._affine` after the best linear map.
    `error_estimate` bounds the error of all three. `limit` is "" when the tolerance was met.
    """

    projection: Projection
    given: str
    region: Region
    coverage: float
    airy_kavrayskiy: float
    airy_kavrayskiy_scaled: float
    airy_kavrayskiy_affine: float
    error_estimate: float
    evaluations: int
    limit: str
    measures: dict[str, MeasureSummary]

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "projection": self.given,
            "name": self.projection.name,
            "definition": self.projection.definition,
            "coverage": self.coverage,
            "airy_kavrayskiy": _plain(self.airy_kavrayskiy),
            "airy_kavrayskiy_scaled": _plain(self.airy_kavrayskiy_scaled),
            "airy_kavrayskiy_affine": _plain(self.airy_kavrayskiy_affine),
            "error_estimate": _plain(self.error_estimate),
            "evaluations": self.evaluations,
        } | {name: summary.to_dict() for name, summary in self.measures.items()}


@dataclass(frozen=True)
class Failure:
    """A projection that could not be measured, and why."""

    given: str
    error: str

    def to_dict(self) -> dict[str, Any]:
        """`{"projection", "error"}`."""
        return {"projection": self.given, "error": self.error}


@dataclass(frozen=True)
class Comparison:
    """Summaries of several projections over one region, best first, and the failures."""

    region: Region
    results: tuple[Summary, ...]
    failures: tuple[Failure, ...]

    def to_dict(self) -> dict[str, Any]:
        """`{"region": {"name", "area_km2"}, "results": [...], "failures": [...]}`."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "results": [result.to_dict() for result in self.results],
            "failures": [failure.to_dict() for failure in self.failures],
        }


def summarize(
    projection: Any,
    region: str | Region = "globe",
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
    plain = [measure for measure in chosen.values() if not measure.needs_hessian]
    integrands = [integrand for measure in plain for integrand in (measure, _squared(measure))]
    samples = sample(projection, region, tolerance=tolerance, integrands=integrands)
    raw, scaled, affine, error = _airy_kavrayskiy(samples)
    if error > tolerance and not samples.limit:
        # The affine error is no goal of the refinement, and seldom larger than the others.
        samples = sample(projection, region, tolerance=_SLACK * tolerance * tolerance / error, integrands=integrands)
        raw, scaled, affine, error = _airy_kavrayskiy(samples)
    return Summary(
        projection,
        given or projection.label,
        region,
        samples.coverage,
        raw,
        scaled,
        affine,
        error,
        samples.evaluations,
        samples.limit or ("rounding" if error > tolerance else ""),
        {name: _summarize_measure(projection, region, samples, measure) for name, measure in chosen.items()},
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


def _airy_kavrayskiy(samples: Samples) -> tuple[float, float, float, float]:
    """The raw, scaled and affine errors, and the largest of their estimated errors."""
    square, log_area = log_scales(samples.jacobian)
    raw, raw_error = samples.mean(square, 2.0 * np.sqrt(square))
    shift, shift_error = samples.mean(log_area, 1.0)
    # The best scale c minimises the mean of (ln a + c)^2 + (ln b + c)^2: c = -mean ln(ab) / 2.
    scaled, scaled_error = raw - 0.5 * shift**2, raw_error + abs(shift) * shift_error
    defined = np.isfinite(square) & (areal_scale(samples.jacobian) > 0)
    if not defined.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    result = mdt(samples.jacobian[defined], samples.weight[defined])
    distances = np.full(square.shape, np.nan)
    distances[defined] = result.distances
    affine, affine_error = samples.mean(distances, 2.0 * np.sqrt(distances))
    roots, errors = zip(
        *(_root(*pair) for pair in ((raw, raw_error), (scaled, scaled_error), (affine, affine_error))), strict=True
    )
    return (*roots, max(errors))


def _root(square: float, error: float) -> tuple[float, float]:
    """The square root of a mean square, and its error."""
    if not np.isfinite(square):
        return np.nan, np.nan
    root = float(np.sqrt(max(square, 0.0)))
    return root, float(error / (root + np.sqrt(max(square, 0.0) + error))) if error > 0 else 0.0


def _summarize_measure(projection: Projection, region: Region, samples: Samples, measure: Measure) -> MeasureSummary:
    values = measure_at(projection, measure, samples.lon, samples.lat, samples.jacobian)
    average, average_error = samples.mean(values, _STEEPNESS * np.abs(values))
    square, square_error = samples.mean(values**2, 2.0 * _STEEPNESS * values**2)
    root, root_error = _root(square, square_error)
    peak = find_maximum(projection, region, samples, values, measure)
    if not measure.bounded and _diverges(samples, values):
        average, average_error = np.nan, np.nan
        peak = peak._replace(value=np.inf)
    if not measure.bounded and _diverges(samples, values**2):
        root, root_error = np.nan, np.nan
    dense, weights = _dense(samples, values)
    return MeasureSummary(
        average,
        root,
        median(dense, weights),
        p95(dense, weights),
        peak.value,
        (peak.lon, peak.lat),
        average_error,
        root_error,
    )


def _diverges(samples: Samples, values: FloatArray) -> bool:
    """Whether the integral of values lies, in good part, in panels too small to hold a part of it.

    An integrable singularity as of ln^2 has 1e-4 of its integral in a millionth of the area; one
    that diverges has as much in every decade of area.
    """
    share = samples.weight.sum(axis=(1, 2)) / samples.weight.sum()
    parts = np.abs(np.nansum(samples.weight * values, axis=(1, 2))) / samples.weight.sum()
    return bool(parts[share < 1e-6].sum() > max(0.02 * parts.sum(), _NOTHING))


_NOTHING = 1e-6  # a mean that small is rounding, in the unit of any measure
# Points for the quantiles, whose error falls as one over their number: all in all, and in one panel.
_DENSE, _DENSEST = 200_000, 20_000


def _dense(samples: Samples, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and weights interpolated within the panels, at the many points of a lattice.

    The lattice of the golden ratio has as many levels along either direction as it has points.
    """
    smooth = np.isfinite(values).all(axis=(1, 2))
    m = int(np.clip(_DENSE / len(values), 64, _DENSEST))
    step = np.arange(m) + 0.5
    r, s = 2.0 * step / m - 1.0, 2.0 * np.mod(step * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
    gauss = np.polynomial.legendre.leggauss(values.shape[-1])[1]
    density = samples.weight / (gauss[:, None] * gauss)
    # A polynomial may overshoot beside a singularity: stay within what was sampled.
    low, high = values[smooth].min(axis=(1, 2)), values[smooth].max(axis=(1, 2))
    margin = 0.1 * (high - low)
    fine = np.clip(interpolate(values[smooth], r, s), (low - margin)[:, None], (high + margin)[:, None])
    weights = np.maximum(interpolate(density[smooth], r, s), 0.0) * (4.0 / m)
    rest = ~smooth
    return (
        np.concatenate([fine.ravel(), values[rest].ravel()]),
        np.concatenate([weights.ravel(), samples.weight[rest].ravel()]),
    )


def compare(
    projections: Sequence[Any],
    region: str | Region = "globe",
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
