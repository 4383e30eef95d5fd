"""The nodes of a region at which CRSs are tried, and their measurement in full."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.decisions.map_info import WeightedPoints
from projdist.earth import WGS84
from projdist.field import (
    FIGURES,
    Extreme,
    Figure,
    Goal,
    Integrand,
    Samples,
    airy_kavrayskiy_of,
    cut_length,
    find_extremes,
    is_interrupted,
    jacobian,
    nodes_of,
    sample_panels,
)
from projdist.matrices import Measure, areal_scale, get_measure
from projdist.numerics import Estimate, mean
from projdist.projections import Projection, ProjectionError, load_crs
from projdist.regions import Region

Area = tuple[float, float, float, float]

_INNER = 150  # nodes: enough for a few per cent of an integral, at 0.3 ms a projection
_BORDER = 60  # nodes on edges
_LATTICE = 4000  # points: shares to a per cent
_POLAR = 85.0  # degrees of latitude; derivatives beyond cost fifty times as much
_ELSEWHERE = 0.9  # share of a region outside the polar caps from which these are left out


def probe_of(region: Region) -> WeightedPoints:
    """About two hundred nodes of a region, with weights by area whose sum is 1; nodes on its edges have weight 0."""
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
    """Some thousand points of a region with weights by area whose sum is 1, to find its share in areas of use.

    `meridians` and `parallels` are their different longitudes and latitudes, a few dozen in a box, and the number of
    each point's.
    """

    bounds: Area
    meridians: tuple[FloatArray, IntArray]
    parallels: tuple[FloatArray, IntArray]

    def near(self, areas: Sequence[Area]) -> BoolArray:
        """True for areas of west, south, east, north that meet the region's bounds."""
        west, south, _, north, width = _columns(areas)
        low, bottom, high, top = self.bounds
        beside = ((low - west) % 360.0 <= width) | ((west - low) % 360.0 <= high - low)
        return np.asarray(beside & (south <= top) & (north >= bottom))

    def within(self, areas: Sequence[Area]) -> BoolArray:
        """True for points within areas, shape (areas, points); west > east crosses the antimeridian."""
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
    return Lattice(nodes.lon, nodes.lat, nodes.weight, region.bounds, meridians, parallels)


def _columns(areas: Sequence[Area]) -> tuple[FloatArray, ...]:
    """West, south, east, north, and the width, 360 for one of 0."""
    west, south, east, north = np.array(areas, dtype=float).reshape(-1, 4).T
    width = (east - west) % 360.0
    return west, south, east, north, np.where(width == 0.0, 360.0, width)


# ---- candidates ----------------------------------------------------------------------------------


INTERRUPTED = "It is cut within the region."
_RELATIVE = 1e-5  # of the Airy-Kavrayskiy errors
_RESOLVED = 0.01  # of a mean; worse, it diverges, if its measure has no bound
_EVALUATIONS = 200_000


@dataclass(frozen=True)
class Rejected:
    """A CRS that is no candidate, with the reason."""

    code: str
    name: str
    reason: str


# ---- in full --------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Full:
    """A CRS to measure in full, by its code or a PROJ string; `level` is its Airy-Kavrayskiy error, about."""

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
    """What a projection does over a region; largest values are infinite where there is no bound, diverging means NaN.

    The errors are those of the figures of these names, NaN where they are infinite or diverge. `cut_km` is the length
    of the cuts within the region.
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


def settle(task: Full) -> float | Rejected:
    """The figure of the ranking of a CRS over a region, as good as `measure` has it."""
    try:
        if task.uninterrupted and is_interrupted(_projection(task), task.region):
            return Rejected(task.code, task.name, INTERRUPTED)
        name = _NAMES.get(task.ranking.essence)
        if name is None:
            return _begun(task).figure(task.ranking)
        return _begun(task, FIGURES[name].aspect).named_figure(name)
    except ProjectionError as error:
        return Rejected(task.code, task.name, str(error))


def measure(task: Full) -> tuple[float, Distortion] | Rejected:
    """The figure of the ranking, and a CRS measured, to 1e-5 of its Airy-Kavrayskiy errors and of its means."""
    try:
        found = _begun(task, *_SEARCHED)
        figures = found.figures()
        name = _NAMES.get(task.ranking.essence)
        value = found.figure(task.ranking) if name is None else figures[name]
        cut_km = cut_length(found.projection, task.region)
        return value, Distortion(coverage=found.first.coverage, cut_km=cut_km, **figures)
    except ProjectionError as error:
        return Rejected(task.code, task.name, str(error))


def _projection(task: Full) -> Projection:
    return Projection.from_user_input(task.code) if task.code.startswith("+") else load_crs(task.code).projection


_NAMES = {FIGURES[one.name].essence: one.name for one in fields(Distortion) if one.name in FIGURES}


def _begun(task: Full, *parts: str) -> _Measurement:
    projection = _projection(task)
    tolerance = _RELATIVE * max(task.level, 1e-6)
    first = sample_panels(projection, task.region, tolerance=tolerance, max_evaluations=_EVALUATIONS)
    return _Measurement(task, projection, tolerance, first, parts)


_SCALE, _OMEGA, _AREA, _AREA_ERROR = (
    get_measure(name) for name in ("scale_error_ppm", "omega", "areal_scale", "areal_error_ppm")
)


def _inverse_area(J: FloatArray) -> FloatArray:
    """1 / s, NaN where the map is singular."""
    s = areal_scale(J)
    return 1.0 / np.where(s > 0, s, np.nan)


_INVERSE = Measure("inverse_areal_scale", _inverse_area, kind="ratio")
_VANISHES = {"angles": "conformal", "areas": "equal-area"}  # what figures of an aspect are of, and maps that have none

# What has a mean to be resolved, and the property of maps for which it vanishes.
_MEASURES = {_SCALE: "", _OMEGA: "conformal", _AREA_ERROR: "equal-area"}

# The parts of a measurement, with what is searched for its largest values, and the property for which it does not vary.
_SEARCHED: dict[str, dict[Measure, str]] = {
    "distortion": {},
    "scales": {_SCALE: ""},
    "angles": {_OMEGA: "conformal"},
    "areas": {_INVERSE: "equal-area", _AREA: "equal-area"},
}


@dataclass(frozen=True)
class _Measurement:
    """A projection under measurement. What it keeps true is read off the probe: searches would find noise."""

    task: Full
    projection: Projection
    tolerance: float
    first: Samples
    parts: tuple[str, ...]

    def figure(self, figure: Figure) -> float:
        """A figure that is no field of `Distortion`."""
        if _VANISHES.get(figure.aspect) in self.task.keeps:
            return figure(self._probed(), self.task.probe.weight)
        if figure.is_maximum:
            return self._most(figure.measure).value
        squares = figure.statistic == "rms"
        term = _squared(figure.measure) if squares else figure.measure
        value = self._mean_over(self._resolving([term]), term).value
        return value**0.5 if squares else value

    def named_figure(self, name: str) -> float:
        """One field of `Distortion`; the largest scale error without the mean, which costs most."""
        return self._largest[_SCALE].value if name == "max_scale_error_ppm" else self.figures()[name]

    def figures(self) -> dict[str, float]:
        """The fields of `Distortion` of the parts."""
        methods = {"distortion": self._errors, "scales": self._scales, "angles": self._angles, "areas": self._areas}
        return {name: value for part in self.parts for name, value in methods[part]().items()}

    def _errors(self) -> dict[str, float]:
        errors = airy_kavrayskiy_of(self.first)
        return {
            "airy_kavrayskiy": errors.raw,
            "airy_kavrayskiy_scaled": errors.scaled,
            "airy_kavrayskiy_affine": errors.affine,
            "error_estimate": errors.error,
        }

    def _scales(self) -> dict[str, float]:
        most, mean_of = self._largest[_SCALE], self._mean(_SCALE)
        return {
            "max_scale_error_ppm": most.value,
            "max_scale_error_ppm_error": most.error,
            "mean_scale_error_ppm": mean_of.value,
            "mean_scale_error_ppm_error": mean_of.error,
        }

    def _angles(self) -> dict[str, float]:
        if "conformal" in self.task.keeps:
            found = dict(zip(("max_omega", "mean_omega"), self._on_probe(_OMEGA), strict=True))
            return found | {f"{name}_error": value for name, value in found.items()}  # rounding
        most, mean_of = self._largest[_OMEGA], self._mean(_OMEGA)
        return {
            "max_omega": most.value,
            "max_omega_error": most.error,
            "mean_omega": mean_of.value,
            "mean_omega_error": mean_of.error,
        }

    def _areas(self) -> dict[str, float]:
        if "equal-area" in self.task.keeps:
            least, most = 1.0 / self._on_probe(_INVERSE)[0], self._on_probe(_AREA)[0]
            least_error = most_error = most - least  # rounding
            on_probe = self._on_probe(_AREA_ERROR)[1]
            mean_of = Estimate(on_probe, on_probe)
        else:
            least, most = 1.0 / self._largest[_INVERSE].value, self._largest[_AREA].value
            least_error, most_error = least**2 * self._largest[_INVERSE].error, self._largest[_AREA].error
            mean_of = self._mean(_AREA_ERROR)
        return {
            "max_areal_error_ppm": 1e6 * max(abs(least - 1.0), abs(most - 1.0)),
            "max_areal_error_ppm_error": 1e6 * max(least_error, most_error),
            "mean_areal_error_ppm": mean_of.value,
            "mean_areal_error_ppm_error": mean_of.error,
            "min_areal_scale": least,
            "max_areal_scale": most,
            "min_areal_scale_error": least_error,
            "max_areal_scale_error": most_error,
        }

    def _on_probe(self, one: Measure) -> tuple[float, float]:
        """The largest value and the mean at the probe's nodes."""
        inner = self.task.probe.weight > 0
        values = one(self._probed()[inner])
        return float(np.nanmax(values)), mean(values, self.task.probe.weight[inner])

    def _probed(self) -> FloatArray:
        return jacobian(self.projection, self.task.probe.lon, self.task.probe.lat)

    @functools.cached_property
    def _largest(self) -> dict[Measure, Extreme]:
        """The largest values of what is searched."""
        measures = [one for part in self.parts for one, kept in _SEARCHED[part].items() if kept not in self.task.keeps]
        goals = [Goal(one, one(self.first.jacobian)) for one in measures]
        found = find_extremes(self.projection, self.first, goals)
        return {goal.measure: extreme for goal, extreme in zip(goals, found, strict=True)}

    def _mean(self, one: Measure) -> Estimate:
        return self._mean_over(self._fine, one)

    def _mean_over(self, samples: Samples, one: Measure) -> Estimate:
        """The mean over the area; NaN where it diverges: what has a bound has a mean.

        Where that is not resolved, it is but rounding, which larger panels have less of.
        """
        found, first = (Estimate(*each.mean(one(each.jacobian), 0.0)) for each in (samples, self.first))
        if found.error <= _RESOLVED * found.value:
            return found
        if one.bounded or np.isfinite(self._most(one).value):
            return min(found, first, key=lambda each: each.error)
        return Estimate(np.nan, np.nan)

    def _most(self, one: Measure) -> Extreme:
        """The largest value of a measure that may not be among those that are searched."""
        if one in self._largest:
            return self._largest[one]
        return find_extremes(self.projection, self.first, [Goal(one, one(self.first.jacobian))])[0]

    @functools.cached_property
    def _fine(self) -> Samples:
        return self._resolving([one for one, kept in _MEASURES.items() if kept not in self.task.keeps])

    def _resolving(self, terms: Sequence[Integrand]) -> Samples:
        """Samples that resolve means: of integrands of the size of 1, whose kinks the mesh knows from rounding."""
        levels = [self.first.mean(one(self.first.jacobian), 0.0)[0] for one in terms]
        integrands = [_scaled(one, 1.0 / level) for one, level in zip(terms, levels, strict=True) if level > 0]
        return sample_panels(
            self.projection,
            self.task.region,
            tolerance=self.tolerance,
            integrands=integrands,
            max_evaluations=_EVALUATIONS,
        )


def _squared(one: Measure) -> Measure:
    return Measure(f"{one.name}^2", lambda J: one(J) ** 2)


def _scaled(one: Integrand, factor: float) -> Integrand:
    return lambda J: factor * one(J)
