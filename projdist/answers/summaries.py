"""Summaries: a map over a region, and several beside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.answers.published_indices import Index, IndexSummary, get_indices
from projdist.answers.published_indices import indices as published_indices
from projdist.field import DEFAULT_TOLERANCE, Extreme, Field, named_measures, sample
from projdist.matrices import Measure, Modes, listed_measures
from projdist.numerics import median, p95
from projdist.projections import Projection, ProjectionError, ProjectionLike, listed_projections
from projdist.regions import Box, Place, PointSet, RegionLike, region_for, share_in
from projdist.support import Answer, check_bool, plain, shown, tell

STATISTICS = ("mean", "rms", "median", "p95", "max", "min")
"""Of a measure over a region."""
SORTS = (
    "given",
    "name",
    "coverage",
    "evaluations",
    "error_estimate",
    "airy_kavrayskiy",
    "airy_kavrayskiy_scaled",
    "airy_kavrayskiy_affine",
)
"""What a comparison may be sorted by, besides its indices and measures."""
_FINEST_INDICES = 1e-6  # of the means of published indices
_MOSTLY = 0.5  # of a region


@dataclass(frozen=True, kw_only=True)
class MeasureSummary:
    """A measure over a region: its mean, RMS, median, 95th percentile, and its extremes (infinite: unbounded).

    The errors are estimates: by how much the figure may be wrong; NaN for what is infinite.
    """

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
    max_error: float
    min_error: float

    def to_dict(self) -> dict[str, Any]:
        """The statistics by name; what is not finite is None."""
        statistics = {name: plain(value) for name, value in (self._statistics() | self._errors()).items()}
        places = {name: [plain(value) for value in getattr(self, name)] for name in ("max_at", "min_at")}
        return statistics | places

    def _statistics(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in STATISTICS}

    def _errors(self) -> dict[str, float]:
        return {f"{name}_error": getattr(self, f"{name}_error") for name in ("mean", "rms", "max", "min")}

    def _row(self) -> dict[str, float]:
        places = ("max_lon", "max_lat", "min_lon", "min_lat")
        return self._statistics() | self._errors() | dict(zip(places, (*self.max_at, *self.min_at), strict=True))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Summary(Answer):
    """A projection over a region.

    `airy_kavrayskiy` is the RMS Fisher distortion, sqrt(mean of ln^2 a + ln^2 b) by true area;
    `..._scaled` after the best uniform scale, `..._affine` after the best linear map.
    `error_estimate` bounds the error of all three. `limit` is "" when the tolerance was met. `mdt`
    is that linear map's inverse T, shape (2, 2), the mean distorting transformation; `mirrored` the
    share of what is covered that the map turns over. `modes` are the principal components of the distortion about the
    MDT, if they were asked for.
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
    indices: IndexSummary | None = None
    modes: Modes | None = None

    def _line(self) -> str:
        return (
            f"{self.projection.name} over {self.region.name}: AK {self.airy_kavrayskiy:.4g} ± {self.error_estimate:.1g}"
        )

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is not finite is None."""
        figures = {name: plain(value) for name, value in self._figures().items()}
        measures = {name: summary.to_dict() for name, summary in self.measures.items()}
        indices = {"indices": self.indices.to_dict()["indices"]} if self.indices else {}
        return figures | measures | indices | ({"modes": self.modes.to_dict()["modes"]} if self.modes else {})

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
        measures = {f"{name}_{key}": value for name, row in statistics for key, value in row.items()}
        return self._figures() | measures | (self.indices.columns() if self.indices else {}) | self._mode_columns()

    def _mode_columns(self) -> dict[str, Any]:
        """mode_1, mode_1_share, mode_1_rms, mode_2, ..., the greatest first."""
        if self.modes is None:
            return {}
        columns: dict[str, Any] = {}
        for number, mode in enumerate(self.modes.to_dict()["modes"], start=1):
            columns |= {f"mode_{number}": mode["words"]}
            columns |= {f"mode_{number}_{name}": mode[name] for name in ("share", "rms")}
        return columns

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


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison(Answer):
    """Summaries of several projections over one region, best first, and the failures.

    The region is one for all, whatever ellipsoid each projection is measured on, and of the body that
    all are of: docs/conventions.md tells on which figure its area is. A frame has the results only.
    """

    region: Place
    results: tuple[Summary, ...]
    failures: tuple[Failure, ...]
    published: tuple[Index, ...] = ()

    def _line(self) -> str:
        best = repr(self.results[0]) if self.results else "nothing that could be measured"
        return f"{len(self.results)} maps over {self.region.name}, best {best}"

    def to_dict(self) -> dict[str, Any]:
        """`{"region": {"name", "area_km2"}, "results": [...], "failures": [...]}`; the area is that on its body.

        Of points there is also their number, `points`.
        """
        over = {index.name: index.published_over for index in self.published if index.published_over}
        points = {"points": int(self.region.lon.size)} if isinstance(self.region, PointSet) else {}
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2} | points,
            "results": [result.to_dict() for result in self.results],
            "failures": [failure.to_dict() for failure in self.failures],
            **({"published_over": over} if self.published else {}),
        }

    def rows(self) -> list[dict[str, Any]]:
        """The results as flat rows, as in a frame; what is not finite is None."""
        return [{name: plain(value) for name, value in row.items()} for row in self._table()]

    def _table(self) -> list[dict[str, Any]]:
        return [result._row() for result in self.results]


def summarize(
    projection: ProjectionLike,
    region: RegionLike | None = None,
    *,
    measures: Iterable[str | Measure] = (),
    indices: str | Iterable[str] = (),
    modes: bool = False,
    tolerance: float = DEFAULT_TOLERANCE,
) -> Summary:
    """The Airy-Kavrayskiy errors of a projection over a region, and statistics of measures.

    A notice tells where less than half of the region lies in the area of use of a CRS.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes: a name, a PROJ string, the code of a CRS, WKT, a file, a
        function.
    region : RegionLike, optional
        Anything that `get_region` takes: text, bounds (W, S, E, N) in degrees, a geometry, a region. Without one it is
        the area of use of a CRS, and the globe for other projections.
    measures : iterable of str or Measure, or one of them
        What statistics are taken of. They are named by the text they were asked for.
    indices : str or iterable of str
        Published indices, as `projdist.indices` has them. They take samples of their own.
    modes : bool, default False
        Whether to find the principal components of the distortion.
    tolerance : float, default 1e-8
        To which the Airy-Kavrayskiy errors are resolved, where the projection's own rounding and the largest number of
        evaluations allow. Measures are resolved as by `sample`, indices to max(tolerance, 1e-6).

    Returns
    -------
    Summary
        The three errors, their `error_estimate`, the mean distorting transformation `mdt` (2, 2), and a
        `MeasureSummary` for each of `measures`. `limit` tells why the tolerance was not met.

    Raises
    ------
    ProjectionError
        For what is no projection, and where no point of the region can be projected.
    ValueError
        For an unknown region, measure or index, `modes` neither True nor False, and a tolerance that is not positive.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the errors without the half
      under the root, and the mean distorting transformation.
    - Fletcher, Lu, Pizer & Joshi 2004, IEEE Transactions on Medical Imaging 23: the modes.

    Examples
    --------
    Of the plate carree the error is sqrt(2 - 2 ln 2 + ln^2 2 - pi^2 / 12).

    >>> round(summarize("plate-carree").airy_kavrayskiy, 8)
    0.52124046

    Mollweide's map is wrong in angles alone, as much in shear as in the shape of what stands upright:

    >>> summarize("mollweide", modes=True).modes
    Modes(51 % shear; 49 % shape)
    """
    found = summary_of(projection, region, measures=measures, indices=indices, modes=modes, tolerance=tolerance)
    _tell_of_elsewhere(found.projection, found.region)
    return found


def _tell_of_elsewhere(projection: Projection, region: Place) -> None:
    """Tell where less than half of a region lies in the area of use of a CRS."""
    if projection.area_of_use is None:
        return
    area = Box(*projection.area_of_use)
    share = share_in(area, region)
    if share < _MOSTLY:
        part = f"{100.0 * share:.2g} %" if share else "nothing"
        tell(
            f"{projection.label} is for {area.name}, where {part} of {shown(region.name)} lies: its figures are mostly "
            "of places outside its area of use."
        )


def summary_of(
    projection: ProjectionLike,
    region: RegionLike | None,
    *,
    measures: Iterable[str | Measure] = (),
    indices: str | Iterable[str] = (),
    modes: bool = False,
    tolerance: float = DEFAULT_TOLERANCE,
) -> Summary:
    """The summary of `summarize`, without a word on areas of use."""
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    place = region_for(region, [projection])
    published, with_modes = get_indices(indices), check_bool("modes", modes)
    field = sample(projection, place, measures=measures, tolerance=tolerance)
    found = field.airy_kavrayskiy
    extremes = field.extremes(field.measures.values())
    return Summary(
        projection=projection,
        given=given or projection.label,
        region=place,
        coverage=field.coverage,
        airy_kavrayskiy=found.raw,
        airy_kavrayskiy_scaled=found.scaled,
        airy_kavrayskiy_affine=found.affine,
        error_estimate=found.error,
        evaluations=field.evaluations,
        limit=field.limit or ("rounding" if found.error > tolerance else ""),
        mdt=found.mdt,
        mirrored=field.mirrored,
        measures={
            name: _summarize_measure(field, name, *pair) for name, pair in zip(field.measures, extremes, strict=True)
        },
        indices=_published(projection, place, published, tolerance),
        modes=field.modes if with_modes else None,
    )


def _published(projection: Projection, region: Place, chosen: list[Index], tolerance: float) -> IndexSummary | None:
    """The published indices that are asked for, which take samples of their own."""
    if not chosen:
        return None
    names = [index.name for index in chosen]
    return published_indices(projection, region, names, tolerance=max(tolerance, _FINEST_INDICES))


def _summarize_measure(field: Field, name: str, bottom: Extreme, top: Extreme) -> MeasureSummary:
    average, root = field.mean(name), field.rms(name)
    many, weights = field.many(name)
    return MeasureSummary(
        mean=average.value,
        rms=root.value,
        median=median(many, weights),
        p95=p95(many, weights),
        max=top.value,
        max_at=(top.lon, top.lat),
        max_error=top.error,
        min=bottom.value,
        min_at=(bottom.lon, bottom.lat),
        min_error=bottom.error,
        mean_error=average.error,
        rms_error=root.error,
    )


def compare(
    projections: ProjectionLike | Iterable[ProjectionLike],
    region: RegionLike | None = None,
    *,
    measures: Iterable[str | Measure] = (),
    indices: str | Iterable[str] = (),
    modes: bool = False,
    sort: str = "airy_kavrayskiy",
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[int, int], object] | None = None,
) -> Comparison:
    """Summaries of several projections over one region, best first.

    A projection that fails is among the `failures`, beside the others' results. A notice tells of each CRS in whose
    area of use less than half of the region lies.

    Parameters
    ----------
    projections : ProjectionLike or iterable of ProjectionLike
        Whatever `summarize` takes, one or several.
    region : RegionLike, optional
        Whatever `get_region` takes; it is the same for all. Without one it is the area of use, if all are CRSs and have
        the same, and else the globe.
    measures : iterable of str or Measure, or one of them
        What statistics are taken of.
    indices : str or iterable of str
        Published indices, one or several, as `projdist.indices` has them.
    modes : bool, default False
        Whether to find the principal components of the distortions.
    sort : str, default "airy_kavrayskiy"
        What the results ascend in; what is undefined comes last. "given" leaves them in order; else it is one of
        `SORTS`, one of `indices`, or one of `measures`, alone (its mean) or with a statistic, as "omega.max".
    tolerance : float, default 1e-8
        To which the Airy-Kavrayskiy errors are resolved, as by `summarize`.
    progress : callable, optional
        Called with how many maps are done, and of how many.

    Returns
    -------
    Comparison
        The `results`, a `Summary` each, in the order that was asked for, and the `failures`.

    Raises
    ------
    ValueError
        For an unknown region, measure, index or order, and a tolerance that is not positive.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    As a = b = k, where the plate carree has a = k and b = 1, Mercator's map has sqrt(2) times its error.

    >>> found = compare(["mercator", "plate-carree"])
    >>> [(one.given, round(one.airy_kavrayskiy, 6)) for one in found.results]
    [('plate-carree', 0.52124), ('mercator', 0.737145)]
    """
    chosen, published = listed_measures(measures), get_indices(indices)
    check_bool("modes", modes)
    names = [index.name for index in published]
    column = sort_column(sort, named_measures(chosen), names)  # an error here is not one of the projections
    maps: list[tuple[str, Projection]] = []
    results: list[Summary] = []
    failures: list[Failure] = []
    for one in listed_projections(projections):
        try:
            projection = Projection.from_user_input(one)
        except ProjectionError as error:
            failures.append(Failure(one if isinstance(one, str) else getattr(one, "name", str(one)), str(error)))
            continue
        maps.append((one if isinstance(one, str) else projection.label, projection))
    place = region_for(region, [projection for _, projection in maps])
    for number, (given, projection) in enumerate(maps, start=1):
        try:
            found = summarize(projection, place, measures=chosen, indices=names, modes=modes, tolerance=tolerance)
            results.append(replace(found, given=given))
        except ProjectionError as error:
            failures.append(Failure(given, str(error)))
        if progress is not None:
            progress(number, len(maps))
    if column != "given":
        results.sort(key=lambda summary: sort_order(summary._row()[column]))
    return Comparison(region=place, results=tuple(results), failures=tuple(failures), published=tuple(published))


def sort_column(key: str, measures: Iterable[str], indices: Iterable[str]) -> str:
    """The column of a row that a sort key is of; raises ValueError."""
    if key in SORTS or key in indices:
        return key
    columns = {measure: f"{measure}_mean" for measure in measures}
    columns |= {f"{measure}.{name}": f"{measure}_{name}" for measure in columns for name in STATISTICS}
    if key not in columns:
        raise ValueError(
            f"Invalid sort key '{key}'. It must be {', '.join(SORTS)}, one of the indices asked for, or one of the "
            f"measures asked for, alone or with .{', .'.join(STATISTICS)}."
        )
    return columns[key]


def sort_order(value: Any) -> tuple[bool, Any]:
    """What is undefined or infinite goes last."""
    known = isinstance(value, str) or bool(np.isfinite(value))
    return not known, value if known else 0.0
