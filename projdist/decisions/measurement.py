"""The nodes of a region at which CRSs are tried, and the measurement of CRSs in full."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.decisions.map_info import WeightedPoints
from projdist.earth import WGS84
from projdist.field import FIGURES, Field, Figure, cut_length, field_resolving, is_interrupted, jacobian, nodes_of
from projdist.matrices import Measure, areal_scale, get_measure
from projdist.numerics import mean
from projdist.projections import Projection, ProjectionError, load_crs
from projdist.regions import Region
from projdist.support import Estimate

Area = tuple[float, float, float, float]

_INNER = 150  # nodes: enough for a few per cent of an integral, at 0.3 ms a projection
_BORDER = 60  # nodes on edges
_LATTICE = 4000  # points: shares to a per cent
_POLAR = 85.0  # degrees of latitude; derivatives beyond cost fifty times as much
_ELSEWHERE = 0.9  # the polar caps are left out if at least this share of the region lies outside them


def probe_of(region: Region) -> WeightedPoints:
    """About two hundred nodes of a region; weights are areas that sum to 1, and 0 for nodes on its edges."""
    nodes = nodes_of(region, WGS84, _INNER, edges=True)
    inner, border = np.flatnonzero(nodes.weight > 0), np.flatnonzero(nodes.weight == 0)
    border = border[region.contains(nodes.lon[border], nodes.lat[border])]  # rounding may lay them outside
    chosen = np.concatenate([inner, border[:: max(1, border.size // _BORDER)]])
    near = chosen[np.abs(nodes.lat[chosen]) <= _POLAR]
    if nodes.weight[near].sum() < _ELSEWHERE:
        near = chosen
    return WeightedPoints(nodes.lon[near], nodes.lat[near], nodes.weight[near] / nodes.weight[near].sum())


@dataclass(frozen=True)
class Lattice(WeightedPoints):
    """Some thousand points of a region to find its share in areas of use; weights are areas that sum to 1."""

    region: Region
    meridians: tuple[FloatArray, IntArray]  # the distinct longitudes, and the index of each point's
    parallels: tuple[FloatArray, IntArray]  # the same for latitudes

    def near(self, areas: Sequence[Area]) -> BoolArray:
        """True for areas (west, south, east, north) that meet the region's bounds."""
        west, south, _, north, width = _columns(areas)
        low, bottom, high, top = self.region.bounds
        beside = ((low - west) % 360.0 <= width) | ((west - low) % 360.0 <= high - low)
        return np.asarray(beside & (south <= top) & (north >= bottom))

    def within(self, areas: Sequence[Area]) -> BoolArray:
        """True for points within areas, shape (areas, points); areas with west > east cross the antimeridian."""
        west, south, _, north, width = _columns(areas)
        chosen = self.near(areas)
        found = np.zeros((len(west), self.lon.size), dtype=bool)
        (lon, of_lon), (lat, of_lat) = self.meridians, self.parallels
        between = (lon - west[chosen, None]) % 360.0 <= width[chosen, None]
        beside = (lat >= south[chosen, None]) & (lat <= north[chosen, None])
        found[chosen] = between[:, of_lon] & beside[:, of_lat]
        return found


def lattice_of(region: Region) -> Lattice:
    """The lattice of a region."""
    nodes = nodes_of(region, WGS84, _LATTICE)
    meridians, parallels = (np.unique(values, return_inverse=True) for values in (nodes.lon, nodes.lat))
    return Lattice(nodes.lon, nodes.lat, nodes.weight, region, meridians, parallels)


def _columns(areas: Sequence[Area]) -> tuple[FloatArray, ...]:
    """West, south, east and north of areas, and their widths, 360 in place of 0."""
    west, south, east, north = np.array(areas, dtype=float).reshape(-1, 4).T
    width = (east - west) % 360.0
    return west, south, east, north, np.where(width == 0.0, 360.0, width)


# ---- in full -------------------------------------------------------------------------------------

INTERRUPTED = "It is cut within the region."
_RELATIVE = 1e-5  # of the Airy-Kavrayskiy errors
_RESOLVED = 0.01  # relative error above which the mean of a measure without a bound diverges
_EVALUATIONS = 200_000


@dataclass(frozen=True)
class Rejected:
    """A CRS that is no candidate, with the reason."""

    code: str
    name: str
    reason: str


@dataclass(frozen=True)
class FullMeasurement:
    """A CRS to measure in full, by its code or a PROJ string; `level` is roughly its Airy-Kavrayskiy error."""

    code: str
    name: str
    region: Region
    probe: WeightedPoints
    keeps: tuple[str, ...]
    level: float
    ranking: Figure
    uninterrupted: bool = False


@dataclass(frozen=True, kw_only=True)
class Distortion:
    """The figures of a projection over a region, with their errors, and the length of the cuts within it in km.

    Maxima without a bound are infinite, means that diverge NaN; so are the errors of both.
    """

    coverage: float
    airy_kavrayskiy: float
    airy_kavrayskiy_scaled: float
    airy_kavrayskiy_affine: float
    error_estimate: float
    max_scale_error_ppm: float
    mean_scale_error_ppm: float
    max_omega: float
    mean_omega: float
    max_areal_error_ppm: float
    mean_areal_error_ppm: float
    min_areal_scale: float
    max_areal_scale: float
    max_scale_error_ppm_error: float
    mean_scale_error_ppm_error: float
    max_omega_error: float
    mean_omega_error: float
    max_areal_error_ppm_error: float
    mean_areal_error_ppm_error: float
    min_areal_scale_error: float
    max_areal_scale_error: float
    cut_km: float


def evaluate(task: FullMeasurement) -> float | Rejected:
    """The ranking's figure of a CRS over a region, the same as by `measure`."""
    try:
        projection = _projection(task)
        if task.uninterrupted and is_interrupted(projection, task.region):
            return Rejected(task.code, task.name, INTERRUPTED)
        return _ranked(task, _resolving(task, projection))
    except ProjectionError as error:
        return Rejected(task.code, task.name, str(error))


def measure(task: FullMeasurement) -> tuple[float, Distortion] | Rejected:
    """The ranking's figure of a CRS, and all its figures to 1e-5 of its Airy-Kavrayskiy errors and of its means."""
    try:
        projection = _projection(task)
        field = _resolving(task, projection)
        found = _figures(task, field, _MEASURED)
        cut_km = cut_length(projection, task.region)
        name = _NAMES.get(task.ranking.essence)
        value = np.nan if name else _ranked(task, field)
    except ProjectionError as error:
        return Rejected(task.code, task.name, str(error))
    distortion = Distortion(
        coverage=field.coverage,
        error_estimate=found["airy_kavrayskiy"].error,
        cut_km=cut_km,
        **{figure: found[figure].value for figure in _NAMES.values() if figure in found},
        **{f"{figure}_error": found[figure].error for figure in _WITH_ERRORS if figure in found},
        **_areal_scales(found, rounding="equal-area" in task.keeps),
    )
    return (getattr(distortion, name) if name else value), distortion


def _areal_scales(found: dict[str, Estimate], *, rounding: bool) -> dict[str, float]:
    """The figures of the smallest and the largest areal scale; with `rounding`, for maps that keep areas."""
    inverse, most = found["max_inverse_areal_scale"], found["max_areal_scale"]
    value = 1.0 / inverse.value
    least = Estimate(value, value**2 * inverse.error)
    if rounding:
        least, most = (one._replace(error=most.value - least.value) for one in (least, most))
    return {
        "max_areal_error_ppm": 1e6 * max(abs(least.value - 1.0), abs(most.value - 1.0)),
        "max_areal_error_ppm_error": 1e6 * max(least.error, most.error),
        "min_areal_scale": least.value,
        "max_areal_scale": most.value,
        "min_areal_scale_error": least.error,
        "max_areal_scale_error": most.error,
    }


def _inverse_area(J: FloatArray) -> FloatArray:
    """1 / s, NaN where the map is singular."""
    s = areal_scale(J)
    return 1.0 / np.where(s > 0, s, np.nan)


_NAMES = {FIGURES[one.name].essence: one.name for one in fields(Distortion) if one.name in FIGURES}
_WITH_ERRORS = [name for name in _NAMES.values() if not FIGURES[name].is_airy_kavrayskiy]
_INVERSE = Measure("inverse_areal_scale", _inverse_area, kind="ratio")
_AREAL_SCALES = (
    Figure(name="max_inverse_areal_scale", measure=_INVERSE, statistic="max", aspect="areas"),
    Figure(name="max_areal_scale", measure=get_measure("areal_scale"), statistic="max", aspect="areas"),
)
_MEASURED = (*(FIGURES[name] for name in _NAMES.values() if name != "max_areal_error_ppm"), *_AREAL_SCALES)
_VANISHES = {"angles": "conformal", "areas": "equal-area"}  # aspect of a figure: property of the maps that have none


def _projection(task: FullMeasurement) -> Projection:
    return Projection.from_user_input(task.code) if task.code.startswith("+") else load_crs(task.code).projection


def _ranked(task: FullMeasurement, field: Field) -> float:
    """The ranking's figure; if it is one of `Distortion`, it is that of `measure` to all digits."""
    name = _NAMES.get(task.ranking.essence, "")
    if name == "max_areal_error_ppm":
        return _areal_scales(_figures(task, field, _AREAL_SCALES), rounding="equal-area" in task.keeps)[name]
    if name.startswith("mean"):  # means are resolved together
        return _figures(task, field, [one for one in _MEASURED if one.statistic == "mean"])[name].value
    return _figures(task, field, [task.ranking])[task.ranking.name].value


def _resolving(task: FullMeasurement, projection: Projection, terms: Sequence[Measure] = ()) -> Field:
    """The field of a map that resolves the Airy-Kavrayskiy errors and the means of some terms."""
    tolerance = _RELATIVE * max(task.level, 1e-6)
    return field_resolving(projection, task.region, terms, tolerance=tolerance, max_evaluations=_EVALUATIONS)


def _figures(task: FullMeasurement, field: Field, figures: Sequence[Figure]) -> dict[str, Estimate]:
    """Figures by name; means are taken from a finer field."""
    # A figure that vanishes because of the map's property is taken at the probe: a search would only find noise.
    assert field.projection is not None  # it is no field of given Jacobians
    vanishing = [one for one in figures if _VANISHES.get(one.aspect) in task.keeps]
    means = [one for one in figures if not (one in vanishing or one.is_maximum or one.is_airy_kavrayskiy)]
    found = field.figures([one for one in figures if one not in vanishing and one not in means])
    if vanishing:
        inner = task.probe.weight > 0
        weight = task.probe.weight[inner]
        J = jacobian(field.projection, task.probe.lon[inner], task.probe.lat[inner])
        values = {one.name: one(J, weight) for one in vanishing}
        found |= {name: Estimate(value, value) for name, value in values.items()}
    if means:
        terms = [_squared(one.measure) if one.statistic == "rms" else one.measure for one in means]
        levels = [mean(field.values(term), field.weight) for term in terms]
        # Integrands of the size of 1, whose kinks the mesh knows from rounding.
        scaled = [_scaled(term, 1.0 / level) for term, level in zip(terms, levels, strict=True) if level > 0]
        fine = _resolving(task, field.projection, scaled)
        for one, term in zip(means, terms, strict=True):
            of = _mean(term, fine, field)
            found[one.name] = of.root() if one.statistic == "rms" else of
    return found


def _mean(term: Measure, fine: Field, coarse: Field) -> Estimate:
    """The mean over the area; NaN where it diverges."""
    # A bounded measure has a mean. If it is not resolved it is only rounding, of which larger panels have less.
    found, first = (each.mean(term, slope=np.zeros_like(each.weight)) for each in (fine, coarse))
    if found.error <= _RESOLVED * found.value:
        return found
    if term.bounded or np.isfinite(coarse.maximum(term).value):
        return min(found, first, key=lambda each: np.nan_to_num(each.error, nan=np.inf))
    return Estimate(np.nan, np.nan)


def _squared(one: Measure) -> Measure:
    return Measure(f"{one.name}^2", lambda J: one(J) ** 2)


def _scaled(one: Measure, factor: float) -> Measure:
    return Measure(one.name, lambda J: factor * one(J))
