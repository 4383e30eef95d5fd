"""The best parameters of a projection for a region.

The map is differentiated at fixed nodes of the region; a lattice over the free parameters, then descents
from its best points find the optimum, with the scale in closed form at every step (`objectives`). What is
reported is measured anew, by adaptive cubature.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.answer import Answer, plain
from projdist.ellipsoid import SPHERE, WGS84, Ellipsoid
from projdist.families import Extent, Family, ellipsoid_text, extent_of, get_family, sensible_families, usual_crs
from projdist.measures import principal_scales
from projdist.nodes import Nodes, nodes_of
from projdist.objectives import Objective, get_objective
from projdist.projections import (
    Projection,
    ProjectionError,
    compose,
    crs_wkt,
    defined_by,
    number_text,
    with_parameters,
    wkt_of,
)
from projdist.regions import Place, get_region
from projdist.results import Failure, summarize
from projdist.search import descend, descend_lattice, minimise

__all__ = ["Baseline", "Optimum", "Rounded", "best_member", "optimize"]

_COARSE, _FINE = 300, 2000  # nodes of the global search, and of the last descent
_LOST = {"": 10.0, "deg": 180.0, "ppm": 1e7}  # what a point that the map does not show counts for: distortion by e^10
_OFF_THE_MAP, _NOTHING = 1e9, -1e3  # the same for maxima, in any unit; and a term that is none
_ROUND_SCALE = 1e-6  # a part per million is what scale factors are stated to
_DECIMALS, _SCALE_DECIMALS = 7, 10  # of what is not rounded: a centimetre, and less than any criterion can tell
_ROUNDINGS = (0.01, 0.1, 0.5, 1.0, 5.0)  # degrees
_RELATIVE = 1e-5  # the cubature's tolerance, of the value found
_TOO_WIDE = 60.0  # degrees from the middle: nobody would take UTM
_POLE = ("o_lat_p", "o_lon_p", "lon_0")
_SCALE = "k_0"


@dataclass(frozen=True)
class Rounded:
    """The best parameters that are multiples of `step` degrees, and how much worse than the optimum they are."""

    step: float
    parameters: dict[str, float]
    value: float
    loss: float

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return {"step": self.step, "parameters": self.parameters, "value": self.value, "loss": self.loss}


@dataclass(frozen=True)
class Baseline:
    """What one would have taken without a search, and its value of the criterion."""

    name: str
    definition: str
    value: float

    def to_dict(self) -> dict[str, Any]:
        """The fields by name."""
        return {"name": self.name, "definition": self.definition, "value": self.value}


@dataclass(frozen=True)
class Optimum(Answer):
    """The best member of a family for a region.

    `parameters` are the free ones; `value` is the criterion, measured by adaptive cubature to
    `error_estimate`; `coverage` the share of the region that the map shows. `at_limit` names parameters
    that ended at a limit. `scale` is what the family's own map is multiplied with where it has no parameter
    for that. `roundings` tell how flat the optimum is, `baselines` what it is worth. `others` are the
    optima of the families that came second and worse, with `auto`. `wkt` is WKT2, or None with a reason.
    """

    family: str
    region: Place
    criterion: str
    unit: str
    parameters: dict[str, float]
    scale: float
    value: float
    error_estimate: float
    airy_kavrayskiy: float
    coverage: float
    projection: Projection
    wkt: str | None
    wkt_reason: str | None
    at_limit: tuple[str, ...]
    round_to: float | None
    roundings: tuple[Rounded, ...]
    baselines: tuple[Baseline, ...]
    others: tuple[Optimum, ...]
    failures: tuple[Failure, ...]
    evaluations: int

    @property
    def proj(self) -> str:
        """The PROJ string; a pipeline where the map is multiplied by a scale that the method does not know."""
        return self.projection.definition

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "family": self.family,
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "criterion": self.criterion,
            "unit": self.unit,
            "parameters": self.parameters,
            "scale": self.scale,
            "value": plain(self.value),
            "error_estimate": plain(self.error_estimate),
            "airy_kavrayskiy": plain(self.airy_kavrayskiy),
            "coverage": self.coverage,
            "proj": self.proj,
            "wkt": self.wkt,
            "wkt_reason": self.wkt_reason,
            "at_limit": list(self.at_limit),
            "round_to": self.round_to,
            "roundings": [rounded.to_dict() for rounded in self.roundings],
            "baselines": [baseline.to_dict() for baseline in self.baselines],
            "others": [{"family": o.family, "value": plain(o.value), "proj": o.proj} for o in self.others],
            "failures": [failure.to_dict() for failure in self.failures],
            "evaluations": self.evaluations,
        }

    def _table(self) -> list[dict[str, Any]]:
        """A row a family, the best first."""
        return [
            {"family": one.family, one.criterion: one.value, **one.parameters, "proj": one.proj}
            for one in (self, *self.others)
        ]


def optimize(
    family: str,
    region: str | Place = "globe",
    *,
    free: Sequence[str] | None = None,
    criterion: str | Objective = "airy_kavrayskiy",
    ellipsoid: str | Ellipsoid | None = None,
    round_to: float | None = None,
    against: Sequence[Any] = (),
) -> Optimum:
    """The parameters with which a family of projections distorts a region least.

    `family` is lcc, aea, eqdc, tmerc, omerc, laea, aeqd, stere, airy, merc, cea, eqc, wintri, `ob_tran:NAME` for any
    aspect of a map, `auto` for the best of those that suit the region, or a PROJ string with free parameters such as
    `+proj=lcc +lat_1={30..50} +lat_2={40..60} +ellps=GRS80`. `free` names the parameters to choose, `pole` for
    those of ob_tran, `k_0` for a uniform scale, whether the method has a parameter for it or not. `criterion` is a
    name in `OBJECTIVES`. `ellipsoid` is `sphere` or a name of PROJ's; by default WGS 84, and the sphere for maps that
    have formulas for that only. `round_to` rounds angles to multiples of so many degrees and k_0 to 1e-6: the best
    of the multiples near the optimum. `against` are projections to compare with, the last of the baselines.
    Raises ValueError, and ProjectionError where no member, or one of `against` does not, show the region.

    >>> round(optimize("eqc").parameters["lat_ts"], 3)
    42.629
    """
    area, objective = get_region(region), get_objective(criterion)
    if round_to is not None and not 1e-9 <= round_to <= 45.0:
        raise ValueError(f"Invalid rounding '{round_to}'. It must be a number of degrees within 1e-9 and 45.")
    extent, surface = extent_of(area), _ellipsoid_of(ellipsoid)
    own = tuple(_baseline(given, area, objective) for given in against)
    if family != "auto":
        found = _Search(get_family(family, extent), area, extent, objective, free, surface).optimum(round_to)
        return _with(found, baselines=found.baselines + own)
    if free is not None:
        raise ValueError("Invalid free parameters for family 'auto'. Each family has its own; name one.")
    found = _best_of(sensible_families(extent, surface), area, extent, objective, surface, round_to)
    return _with(found, baselines=found.baselines + own)


def _baseline(given: Any, region: Place, objective: Objective, name: str = "") -> Baseline:
    """A projection that must show the region, by the criterion."""
    projection = Projection.from_user_input(given)
    value, _, _, coverage = measured(projection, region, objective, 0.1)
    if coverage < _WHOLE:
        shown = f"It shows {100 * coverage:.3g} % of {region.name}."
        raise ProjectionError(f"Invalid projection '{projection.label}' to compare with. {shown}")
    return Baseline(name or projection.name, projection.definition, value)


def best_member(
    family: str, region: Place, objective: Objective, ellipsoid: Ellipsoid
) -> tuple[Projection, dict[str, float]]:
    """The best member of a family, and its free parameters; nothing more is measured. Raises ProjectionError."""
    extent = extent_of(region)
    search = _Search(get_family(family, extent), region, extent, objective, None, ellipsoid)
    best, _, fine, _ = search.searched()
    chosen, scale = search.written(best, fine)
    return search.member(chosen, scale), search.shown(chosen, scale)


def _best_of(
    names: Sequence[str],
    region: Place,
    extent: Extent,
    objective: Objective,
    ellipsoid: Ellipsoid | None,
    round_to: float | None,
) -> Optimum:
    found: list[Optimum] = []
    failures: list[Failure] = []
    for name in names:
        try:
            search = _Search(get_family(name, extent), region, extent, objective, None, ellipsoid)
            found.append(search.optimum(round_to))
        except ProjectionError as error:
            failures.append(Failure(name, str(error)))
    if not found:
        raise ProjectionError(f"Invalid region '{region.name}'. No family of projections shows it: {failures[0].error}")
    # A map that leaves out a part of the region is no better for it.
    best, *others = sorted(found, key=lambda one: (one.coverage < _WHOLE, one.value))
    return replace(best, others=tuple(others), failures=tuple(failures))


_WHOLE = 0.9999


def _ellipsoid_of(given: str | Ellipsoid | None) -> Ellipsoid | None:
    if given is None or isinstance(given, Ellipsoid):
        return given
    if given.lower() == "sphere":
        return SPHERE
    if given == "WGS84":
        return WGS84
    try:
        return Projection.from_user_input(f"+proj=merc +ellps={given}").ellipsoid
    except ProjectionError as error:
        raise ValueError(f"Invalid ellipsoid '{given}'. It must be sphere or one of PROJ's, as GRS80.") from error


class _Search:
    """The search in one family."""

    def __init__(
        self,
        family: Family,
        region: Place,
        extent: Extent,
        objective: Objective,
        free: Sequence[str] | None,
        ellipsoid: Ellipsoid | None,
    ) -> None:
        self.family, self.region, self.extent, self.objective = family, region, extent, objective
        self.lost = _LOST.get(objective.unit, 1e7) ** (0.5 if objective.statistic == "mean" else 1.0)
        names = _free_names(family, free)
        self.variables = tuple(name for name in names if name not in (_SCALE, family.scale))
        self.frees_scale = len(self.variables) < len(names)
        self.scale_limits = family.limits.get(family.scale, (0.0, np.inf))
        self.low, self.high = (np.array([family.limits[name][side] for name in self.variables]) for side in (0, 1))
        self.fixed = {name: round(value, _DECIMALS) for name, value in family.fixed.items() if name not in names}
        text = family.text
        if not family.states_ellipsoid:
            text += f" {ellipsoid_text(ellipsoid or (SPHERE if family.is_spherical else WGS84))}"
        elif ellipsoid is not None:
            raise ValueError("Invalid ellipsoid. The PROJ string states its own.")
        # Anywhere in the box but where two parallels are the same, or on either side of the equator.
        some = self.low + (self.high - self.low) * np.mod(0.3 + 0.37 * np.arange(self.low.size), 1.0)
        words = " ".join(f"+{key}={number_text(value)}" for key, value in self.parameters(self.named(some)).items())
        self.base = Projection.from_user_input(f"{text} {words}".strip())
        self.evaluations = 0

    # ---- one member of the family

    def parameters(self, values: Mapping[str, float]) -> dict[str, float]:
        """All parameters but the scale, in their usual range."""
        return self.family.normalised(self.fixed | dict(values))

    def scales(self, values: Mapping[str, float], nodes: Nodes) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """a, b and weights where the map is smooth, and the share of the region that it does not show."""
        try:
            J, shown = nodes.jacobian(with_parameters(self.base, self.parameters(values)))
        except ProjectionError:
            J, shown = np.full((nodes.lon.size, 2, 2), np.nan), np.zeros(nodes.lon.size, dtype=bool)
        a, b = np.moveaxis(principal_scales(J), -1, 0)
        smooth = np.isfinite(a) & (b > 0)
        w = np.where(smooth, nodes.weight, 0.0)
        if w.sum():
            w = w / w.sum()
        hidden = float(nodes.weight[~shown].sum())
        return np.where(smooth, a, np.nan), np.where(smooth, b, np.nan), w, hidden

    def best_scale(self, a: FloatArray, b: FloatArray, w: FloatArray) -> float:
        """The best scale within its limits: the criteria fall towards it from either side."""
        if not self.frees_scale:
            return 1.0
        smooth = np.isfinite(a)
        best = self.objective.scale(a[smooth], b[smooth], w[smooth])
        return float(np.clip(best, *self.scale_limits))

    def terms(self, values: Mapping[str, float], nodes: Nodes) -> FloatArray:
        """What the search makes small; of the same size for every member of the family."""
        a, b, w, hidden = self.scales(values, nodes)
        smooth = np.isfinite(a)
        if self.objective.is_maximum:
            return self.extremes(a, b) + _OFF_THE_MAP * hidden
        c = self.best_scale(a, b, w) if w.any() else 1.0
        a, b = np.where(smooth, a, 1.0 / c), np.where(smooth, b, 1.0 / c)
        return np.append(self.objective.terms(a, b, w, c), self.lost * np.sqrt(hidden))

    def extremes(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """What a maximum is made of, (groups, n); next to nothing where the map is torn."""
        assert self.objective.extremes is not None
        groups = self.objective.extremes(a, b, self.frees_scale and self.scale_limits == (0.0, np.inf))
        return np.where(np.isfinite(groups), groups, _NOTHING)

    def value(self, values: Mapping[str, float], nodes: Nodes) -> float:
        """The criterion at the nodes, with the best scale."""
        a, b, w, hidden = self.scales(values, nodes)
        smooth = np.isfinite(a)
        if not smooth.any() or (self.objective.is_maximum and hidden):
            return float("inf")
        a, b, w = a[smooth], b[smooth], w[smooth]
        terms = self.objective.terms(a, b, w, self.best_scale(a, b, w))
        return self.objective.value(np.append(terms, self.lost * np.sqrt(hidden)))

    def member(self, values: Mapping[str, float], scale: float) -> Projection:
        """The projection; scaled from without where the method has no parameter for it."""
        parameters = self.parameters(values)
        if self.family.scale and self.frees_scale:
            parameters[self.family.scale] = scale
        projection = with_parameters(self.base, parameters)
        if self.family.scale or scale == 1.0:
            return Projection.from_user_input(projection.definition)
        return compose(projection, scale * np.eye(2), f"{projection.name}, scaled")

    # ---- the search

    def searched(self) -> tuple[dict[str, float], float, Nodes, int]:
        """The free parameters of the best member, its value at nodes, these nodes, and the evaluations it took."""
        edges = self.objective.is_maximum
        coarse = nodes_of(self.region, self.base.ellipsoid, _COARSE, edges=edges)
        fine = nodes_of(self.region, self.base.ellipsoid, _FINE, edges=edges)

        def at(nodes: Nodes) -> Any:
            return lambda x: self.terms(self.named(x), nodes)

        first = minimise(at(coarse), self.low, self.high, worst=edges)
        last = descend(at(fine), first.place, self.low, self.high, worst=edges)
        best = self.named(last.place)
        if not self.scales(best, fine)[2].any():
            raise ProjectionError(
                f"Invalid family '{self.family.name}' for {self.region.name}. It shows no part of it."
            )
        return best, self.value(best, fine), fine, first.evaluations + last.evaluations

    def written(self, values: Mapping[str, float], nodes: Nodes) -> tuple[dict[str, float], float]:
        """Free parameters to the decimals that are stated, and the best scale then."""
        chosen = {name: round(values[name], _DECIMALS) for name in self.variables}
        a, b, w, _ = self.scales(chosen, nodes)
        return chosen, round(self.best_scale(a, b, w), _SCALE_DECIMALS)

    def shown(self, chosen: Mapping[str, float], scale: float) -> dict[str, float]:
        """The free parameters in their usual range, and the scale among them."""
        shown = {name: self.parameters(chosen)[name] for name in self.variables}
        return shown | ({self.family.scale or _SCALE: scale} if self.frees_scale else {})

    def optimum(self, round_to: float | None) -> Optimum:
        """The best member, and what is to be known of it."""
        best, least, fine, evaluations = self.searched()
        roundings = self.roundings(best, least, fine)
        rounded = best if round_to is None else self.rounded(best, round_to, least, fine).parameters
        chosen, scale = self.written(rounded, fine)
        if round_to is not None and self.frees_scale:
            scale = float(np.round(scale / _ROUND_SCALE) * _ROUND_SCALE)
        projection = self.member(chosen, scale)
        value, error, ak, coverage = measured(projection, self.region, self.objective, least)
        wkt, reason = self.wkt(projection, chosen, scale)
        return Optimum(
            self.family.name,
            self.region,
            self.objective.name,
            self.objective.unit,
            self.shown(chosen, scale),
            1.0 if self.family.scale else scale,
            value,
            error,
            ak,
            coverage,
            projection,
            wkt,
            reason,
            self.at_limit(best),
            round_to,
            roundings,
            self.baselines(),
            (),
            (),
            evaluations,
        )

    def named(self, place: FloatArray) -> dict[str, float]:
        """Values of the free parameters but the scale, by name."""
        return dict(zip(self.variables, map(float, place), strict=True))

    def at_limit(self, values: Mapping[str, float]) -> tuple[str, ...]:
        """Parameters at an end of their range that is no natural one."""
        limits = self.family.limits
        return tuple(
            name
            for name, value in values.items()
            if min(abs(value - limits[name][0]), abs(value - limits[name][1])) < 1e-6 and abs(value) not in (0.0, 90.0)
        )

    def rounded(self, best: Mapping[str, float], step: float, least: float, nodes: Nodes) -> Rounded:
        """The best of the multiples of a step about the optimum."""

        def value(place: FloatArray) -> float:
            return self.value(self.named(place * step), nodes)

        place, found = descend_lattice(value, np.round(np.array(list(best.values())) / step))
        usual = self.parameters(self.named(place * step))
        plain = {name: float(number_text(usual[name])) for name in self.variables}
        return Rounded(step, plain, found, found / least - 1.0 if least else 0.0)

    def roundings(self, best: Mapping[str, float], least: float, nodes: Nodes) -> tuple[Rounded, ...]:
        """What rounding costs, for the steps that are less than the parameters' range."""
        widest = float(np.max(self.high - self.low, initial=0.0))
        return tuple(self.rounded(best, step, least, nodes) for step in _ROUNDINGS if step < 0.5 * widest)

    def wkt(self, projection: Projection, values: Mapping[str, float], scale: float) -> tuple[str | None, str | None]:
        """WKT2 of the CRS, or None and the reason."""
        name = f"{projection.name} for {self.region.name}"
        if self.family.scale or scale == 1.0:
            return crs_wkt(projection, name)
        return wkt_of(with_parameters(self.base, self.parameters(values)), scale * np.eye(2), name)

    # ---- what to compare with

    def baselines(self) -> tuple[Baseline, ...]:
        """The rule of thumb of the family, and the UTM zone of the region's middle."""
        found = []
        if self.family.rule is not None:
            words = self.family.normalised(self.family.fixed | self.family.rule)
            words = {name: round(value, _DECIMALS) for name, value in words.items()}
            found.append((self.family.rule_name, defined_by(self.base.definition, words)))
        if self.extent.radius < _TOO_WIDE:
            found.append(usual_crs(self.extent))
        baselines = []
        for name, definition in found:
            with contextlib.suppress(ProjectionError):
                baselines.append(_baseline(definition, self.region, self.objective, name))
        return tuple(one for one in baselines if np.isfinite(one.value))


def measured(
    projection: Projection, region: Place, objective: Objective, about: float
) -> tuple[float, float, float, float]:
    """The criterion by adaptive cubature, its estimated error, the Airy-Kavrayskiy error, and the coverage."""
    if objective.name.startswith("airy_kavrayskiy"):
        tolerance = float(np.clip(_RELATIVE * about, 1e-12, 1e-5))
        summary = summarize(projection, region, tolerance=tolerance)
        return getattr(summary, objective.name), summary.error_estimate, summary.airy_kavrayskiy, summary.coverage
    summary = summarize(projection, region, measures=[objective.measure], tolerance=1e-6)
    (statistics,) = summary.measures.values()
    value = getattr(statistics, objective.statistic)
    error = 0.0 if objective.is_maximum else getattr(statistics, f"{objective.statistic}_error")
    return value, error, summary.airy_kavrayskiy, summary.coverage


def _free_names(family: Family, free: Sequence[str] | None) -> tuple[str, ...]:
    """Names of free parameters, each once, in the family's order."""
    allowed = [*family.limits, *([] if {_SCALE, "k"} & set(family.limits) else [_SCALE])]
    if free is None:
        return family.free
    names: list[str] = []
    for name in free:
        names += _POLE if name == "pole" and set(_POLE) <= set(family.limits) else [name]
    for name in names:
        if name not in allowed:
            raise ValueError(
                f"Invalid free parameter '{name}' for {family.name}. It must be one of {', '.join(allowed)}; others do "
                "not change the distortion, or need a range: give a PROJ string with +name={LOW..HIGH}."
            )
    if not names:
        raise ValueError("Invalid free parameters ''. There must be at least one.")
    return tuple(name for name in allowed if name in names)
