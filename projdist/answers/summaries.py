"""The figures of a map over a region, and of several maps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist import answers, matrices, numerics, regions
from projdist._typing import FloatArray
from projdist.field import DEFAULT_TOLERANCE, Extreme, Field, named_measures, sample
from projdist.projections import Projection, ProjectionError, ProjectionLike, listed_projections
from projdist.support import HIDDEN, Answer, Record, check_bool, listed_values, schema, shown, tell

STATISTICS = ("mean", "rms", "median", "p95", "max", "min")
"""The statistics of a measure over a region."""
GROUPS = (
    *("airy", "jordan", "kavrayskiy", "klingatsch", "chebyshev", "canters", "capek", "francula", "kunimune"),
    *("goldberg-gott", "finite"),
)
"""The groups of published indices."""
SORTS = (
    *("given", "name", "coverage", "evaluations", "error_estimate"),
    *("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"),
)
"""Orders of a comparison, besides its indices and measures."""
_FINEST_INDICES = 1e-6  # smallest tolerance of the means of published indices
_MOSTLY = 0.5  # share of a region that is most of it


@dataclass(frozen=True, kw_only=True)
class MeasureSummary(Record):
    """Mean, RMS, median, 95th percentile and extremes of a measure over a region, infinite if unbounded."""

    mean: float
    rms: float
    median: float
    p95: float
    max: float
    min: float
    mean_error: float  # an estimate, as the others; NaN for infinite figures
    rms_error: float
    max_error: float
    min_error: float
    max_at: tuple[float, float]  # longitude and latitude
    min_at: tuple[float, float]  # likewise

    def _flat(self) -> dict[str, Any]:
        places = ("max_lon", "max_lat", "min_lon", "min_lat")
        return super()._flat() | dict(zip(places, (*self.max_at, *self.min_at), strict=True))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Summary(Answer):
    """A projection over a region."""

    given: str = field(metadata=schema("projection"))
    projection: Projection = field(metadata=schema(of=("name", "definition"), spread=True))
    region: regions.Place = field(metadata=HIDDEN)
    coverage: float
    airy_kavrayskiy: float  # RMS Fisher distortion, sqrt(mean of ln^2 a + ln^2 b) by true area
    airy_kavrayskiy_scaled: float  # after the best uniform scale
    airy_kavrayskiy_affine: float  # after the best linear map
    error_estimate: float  # bound of the error of all three
    evaluations: int
    limit: str = field(metadata=HIDDEN)  # why the tolerance was not met, "" if it was
    mdt: FloatArray = field(metadata=HIDDEN)  # (2, 2), mean distorting transformation, the inverse of that linear map
    measures: dict[str, MeasureSummary] = field(metadata=schema(spread=True))
    indices: answers.IndexSummary | None = field(default=None, metadata=schema(of="values", optional=True))
    modes: matrices.Modes | None = field(default=None, metadata=schema(of="rows", optional=True))

    def _line(self) -> str:
        figures = f"AK {self.airy_kavrayskiy:.4g} ± {self.error_estimate:.1g}"
        return f"{self.projection.name} over {self.region.name}: {figures}"

    def _flat(self) -> dict[str, Any]:
        row = super()._flat()
        for name, summary in self.measures.items():
            row |= {f"{name}_{key}": value for key, value in summary._flat().items()}
        row |= self.indices.columns() if self.indices else {}
        for number, mode in enumerate(self.modes.rows if self.modes else (), start=1):
            row |= {f"mode_{number}": mode["words"]}
            row |= {f"mode_{number}_{key}": mode[key] for key in ("share", "rms")}
        return row


@dataclass(frozen=True)
class Failure(Record):
    """A projection that could not be measured, and why."""

    given: str = field(metadata=schema("projection"))
    error: str


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison(Answer):
    """Summaries of several projections over one region, best first, and the failures.

    All have the same region, whatever ellipsoid each projection is measured on; docs/conventions.md says on which
    ellipsoid its area is. A frame has the results only.
    """

    region: regions.Place = field(metadata=schema(of=("name", "area_km2")))
    results: tuple[Summary, ...]
    failures: tuple[Failure, ...]
    published: tuple[answers.Index, ...] = field(default=(), metadata=HIDDEN)

    def _line(self) -> str:
        best = repr(self.results[0]) if self.results else "none could be measured"
        return f"{len(self.results)} maps over {self.region.name}, best {best}"

    def to_dict(self) -> dict[str, Any]:
        """`{"region": {"name", "area_km2"}, "results": [...], "failures": [...]}`; of points also their number."""
        found = super().to_dict()
        if isinstance(self.region, regions.PointSet):
            found["region"]["points"] = int(self.region.lon.size)
        if self.published:
            found["published_over"] = {one.name: one.published_over for one in self.published if one.published_over}
        return found

    def _table(self) -> list[dict[str, Any]]:
        return [result._flat() for result in self.results]


def summarize(
    projection: ProjectionLike,
    region: regions.RegionLike | None = None,
    *,
    measures: Iterable[str | matrices.Measure] = (),
    indices: str | Iterable[str] = (),
    modes: bool = False,
    tolerance: float = DEFAULT_TOLERANCE,
) -> Summary:
    """The Airy-Kavrayskiy errors of a projection over a region, and statistics of measures.

    A notice is given if less than half of the region lies in the area of use of a CRS.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes: a name, PROJ string, code of a CRS, WKT, file or function.
    region : RegionLike, optional
        Anything that `get_region` takes; by default the area of use of a CRS, or the globe for other projections.
    measures : iterable of str or Measure, or one of them
        Measures for statistics, which are named by the given text.
    indices : str or iterable of str
        Published indices, as by `projdist.indices`. They take samples of their own.
    modes : bool, default False
        Whether to find the principal components of the distortion.
    tolerance : float, default 1e-8
        Largest error of the Airy-Kavrayskiy errors, as far as the map's own rounding and the work allowed permit.
        Measures are resolved as by `sample`, indices to max(tolerance, 1e-6).

    Returns
    -------
    Summary
        The three errors, their `error_estimate`, the mean distorting transformation `mdt` (2, 2), and a
        `MeasureSummary` for each of `measures`. `limit` says why the tolerance was not met.

    Raises
    ------
    ProjectionError, ValueError
        For an unknown projection, or if no point of the region can be projected; for an unknown region, measure or
        index, `modes` neither True nor False, or a tolerance that is not positive.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: no 1/2 under the root, MDT.
    - Fletcher, Lu, Pizer & Joshi 2004, IEEE Transactions on Medical Imaging 23: the modes.

    Examples
    --------
    The error of the plate carree is sqrt(2 - 2 ln 2 + ln^2 2 - pi^2 / 12).

    >>> round(summarize("plate-carree").airy_kavrayskiy, 8)
    0.52124046

    Mollweide's map distorts only angles, half of it by shear and half by the shape of upright things:

    >>> summarize("mollweide", modes=True).modes
    Modes(51 % shear; 49 % shape)
    """
    given = projection if isinstance(projection, str) else None
    projection = Projection.from_user_input(projection)
    place = regions.region_for(region, [projection])
    names, with_modes = listed_values(indices), check_bool("modes", modes)
    names = [index.name for index in answers.get_indices(names)] if names else []
    field = sample(projection, place, measures=measures, tolerance=tolerance)
    found = field.airy_kavrayskiy
    extremes = field.extremes(field.measures.values()) if field.measures else ()
    summary = Summary(
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
        measures={name: _statistics(field, name, *pair) for name, pair in zip(field.measures, extremes, strict=True)},
        indices=answers.indices(projection, place, names, tolerance=max(tolerance, _FINEST_INDICES)) if names else None,
        modes=field.modes if with_modes else None,
    )
    if note := note_on_area_of_use(projection, place):
        tell(note)
    return summary


def note_on_area_of_use(projection: Projection, place: regions.Place) -> str:
    """Note for a region that lies mostly outside a map's area of use; "" for others."""
    use = projection.area_of_use
    if use is None or (share := regions.share_in(regions.Box(*use), place)) >= _MOSTLY:
        return ""
    part = f"{100.0 * share:.2g} %" if share else "nothing"
    return (
        f"{projection.label} is for {regions.Box(*use).name}, where {part} of {shown(place.name)} "
        "lies: its figures are mostly of places outside its area of use."
    )


def _statistics(field: Field, name: str, bottom: Extreme, top: Extreme) -> MeasureSummary:
    average, root, (many, weights) = field.mean(name), field.rms(name), field.many(name)
    return MeasureSummary(
        mean=average.value,
        rms=root.value,
        median=numerics.median(many, weights),
        p95=numerics.p95(many, weights),
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
    region: regions.RegionLike | None = None,
    *,
    measures: Iterable[str | matrices.Measure] = (),
    indices: str | Iterable[str] = (),
    modes: bool = False,
    sort: str = "airy_kavrayskiy",
    tolerance: float = DEFAULT_TOLERANCE,
    progress: Callable[[int, int], object] | None = None,
) -> Comparison:
    """Summaries of several projections over one region, best first.

    Projections that cannot be measured are among the `failures`. A notice names each CRS whose area of use has less
    than half of the region.

    Parameters
    ----------
    projections : ProjectionLike or iterable of ProjectionLike
        Anything that `summarize` takes, one or several.
    region : RegionLike, optional
        Anything that `get_region` takes; by default the area of use that all maps have in common, else the globe.
    measures : iterable of str or Measure, or one of them
        Measures for statistics.
    indices : str or iterable of str
        Published indices, one or several, as by `projdist.indices`.
    modes : bool, default False
        Whether to find the principal components of the distortions.
    sort : str, default "airy_kavrayskiy"
        Figure by which the results ascend, undefined ones last: one of `SORTS` ("given" keeps their order), one of
        `indices`, or one of `measures`, alone (its mean) or with a statistic, as "omega.max".
    tolerance : float, default 1e-8
        Largest error of the Airy-Kavrayskiy errors, as in `summarize`.
    progress : callable, optional
        Called with the number of finished maps and the number of all.

    Returns
    -------
    Comparison
        The `results`, a `Summary` each, in the requested order, and the `failures`.

    Raises
    ------
    ValueError
        For an unknown region, measure, index or order, or a tolerance that is not positive.

    References
    ----------
    - V. V. Kavrayskiy 1934, Matematicheskaya kartografiya.
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    Mercator's map has a = b = k and the plate carree a = k, b = 1, so that its error is sqrt(2) times that.

    >>> found = compare(["mercator", "plate-carree"])
    >>> [(one.given, round(one.airy_kavrayskiy, 6)) for one in found.results]
    [('plate-carree', 0.52124), ('mercator', 0.737145)]
    """
    chosen, names = named_measures(measures), listed_values(indices)
    published = answers.get_indices(names) if names else []  # loading them takes time
    check_bool("modes", modes)
    names = [index.name for index in published]
    column = sort_column(sort, chosen, names)  # an error here is not one of the projections
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
    place = regions.region_for(region, [projection for _, projection in maps])
    for number, (given, projection) in enumerate(maps, start=1):
        try:
            found = summarize(projection, place, measures=chosen, indices=names, modes=modes, tolerance=tolerance)
            results.append(replace(found, given=given))
        except ProjectionError as error:
            failures.append(Failure(given, str(error)))
        if progress is not None:
            progress(number, len(maps))
    if column != "given":
        results.sort(key=lambda summary: sort_order(summary._flat()[column]))
    return Comparison(region=place, results=tuple(results), failures=tuple(failures), published=tuple(published))


def sort_column(key: str, measures: Iterable[str], indices: Iterable[str]) -> str:
    """The column of a flat row by which a sort key sorts; raises ValueError."""
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
    """Sort key of a value: undefined and infinite ones are last."""
    known = isinstance(value, str) or bool(np.isfinite(value))
    return not known, value if known else 0.0
