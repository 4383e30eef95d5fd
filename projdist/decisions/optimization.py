"""The parameters of a family that distort a region least, and the least error of any map of the region.

To first order in the curvature, the best conformal and the best equal-area map of a small region both have sqrt(2)
times the Airy-Kavrayskiy error of the best map of all, whose square is the squared curvature times the mean deflection
of a clamped plate of the region's shape. The best conformal map is a linear problem, which gives the least error of all
kinds of maps; for large ragged regions it is a prediction to some per cent, and no bound.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist import answers, numerics, projections, regions, support
from projdist.decisions import families
from projdist.decisions.family_search import DECIMALS, Flat, Members, Objective, Rounded
from projdist.earth import SPHERE, WGS84, Ellipsoid
from projdist.field import FIGURES, AnyFigure, Field, Figure, Nodes, get_figure, nodes_of, sample

_NODES = 2000
_WIDEST = 100.0  # degrees from the middle: beyond, the polynomials of the stereographic plane do not reach


@functools.lru_cache(maxsize=32)
def least_error(
    region: regions.Place, purpose: str = "any", ellipsoid: Ellipsoid = WGS84, degree: int = 8
) -> float | None:
    """Airy-Kavrayskiy error of the best map of a region for a purpose; None for regions that are too wide."""
    # That of the best conformal map (ln k is a polynomial of the degree); over sqrt(2) if no property is to be kept.
    extent = families.extent_of(region)
    if extent.radius > _WIDEST:
        return None
    text = f"+proj=stere +lat_0={extent.lat!r} +lon_0={extent.lon!r} {families.ellipsoid_text(ellipsoid)}"
    base, nodes = projections.Projection.from_user_input(text), nodes_of(region, ellipsoid, _NODES)
    x, y = base(nodes.lon, nodes.lat)
    log_scale, z = np.log(np.hypot(*nodes.jacobian(base)[0][:, :, 1].T)), x + 1j * y
    known = np.isfinite(log_scale) & (nodes.weight > 0.0)
    try:
        fit = numerics.fit_harmonic(z[known] / np.abs(z[known]).max(), log_scale[known], nodes.weight[known], degree)
    except ValueError:  # of a few points
        return None
    mean = float(np.sum(nodes.weight[known] * fit.rest**2) / np.sum(nodes.weight[known]))
    return float(np.sqrt(mean * (2.0 if purpose in ("conformal", "equal-area") else 1.0)))


def lower_bound_of(
    figure: Figure, region: regions.Place, purpose: str = "any", ellipsoid: Ellipsoid = WGS84
) -> float | None:
    """Least value of a figure over a region; None if it is unknown, or no more than rounding."""
    if not figure.is_airy_kavrayskiy:
        return None
    found = least_error(region, purpose, ellipsoid)
    return found if found is not None and found > figure.rounding else None


# ---- optimization --------------------------------------------------------------------------------

_ROUND_SCALE = 1e-6  # a part per million is what scale factors are stated to
_RELATIVE = 1e-5  # the cubature's tolerance, of the value found
_TOO_WIDE = 60.0  # degrees from the middle: nobody would take UTM
_EXCHANGES, _EXCEEDS = 6, 1e-5  # most exchanges of nodes, and the relative excess of the maximum that asks for one
_DECIDES = Objective(FIGURES["airy_kavrayskiy"])
_NOTE = "{} vanishes for all of {}: the least Airy-Kavrayskiy error has decided."
_USUAL = 2.0  # scales from its inverse to it cannot hide a distortion without bound
_WHOLE = 0.9999  # coverage of a map that shows the region whole


@dataclass(frozen=True)
class Baseline(support.Record):
    """A projection to compare with: its value of the criterion, with an error estimate, and Airy-Kavrayskiy error."""

    name: str
    definition: str
    value: float
    airy_kavrayskiy: float
    error_estimate: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Optimum(support.Answer):
    """The best member of a family for a region."""

    family: str
    region: regions.Place = field(metadata=support.schema(of=("name", "area_km2")))
    criterion: str
    unit: str
    parameters: dict[str, float]  #: the free ones
    scale: float  #: multiplies the map if its method has no parameter for that
    value: float  #: the criterion, measured by adaptive cubature to `error_estimate`
    error_estimate: float
    airy_kavrayskiy: float
    coverage: float  #: share of the region that the map shows
    #: About the least Airy-Kavrayskiy error of any map of the region; None if unknown or for other criteria
    limit: float | None = None
    projection: projections.Projection = field(metadata=support.schema("proj", of="definition"))
    wkt: str | None  #: WKT2, or None with a reason
    wkt_reason: str | None
    at_limit: tuple[str, ...]  #: parameters at an end of their range
    round_to: float | None
    roundings: tuple[Rounded, ...]  #: the best rounded parameters
    baselines: tuple[Baseline, ...]  #: the usual projections
    others: tuple[Optimum, ...] = ()  #: the optima of the other families with `auto`, best first
    failures: tuple[answers.Failure, ...] = ()
    evaluations: int
    #: A remark if the Airy-Kavrayskiy error has decided because the criterion vanishes for the whole family
    note: str | None = None
    #: Parameters that hardly matter, with ranges in which the criterion is at most 1 % larger
    flats: tuple[Flat, ...] = field(default=(), metadata=support.schema("flat"))

    @property
    def cylinder(self) -> str:
        """A sentence for a conic map that is nearly a cylindrical one; else ""."""
        return families.cylinder_of(self.family, self.parameters)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks, a sentence each."""
        return tuple(filter(None, (self.note, self.cylinder, *map(str, self.flats))))

    @property
    def proj(self) -> str:
        """The PROJ string; a pipeline if the method has no parameter for the scale."""
        return self.projection.definition

    def _line(self) -> str:
        return f"{self.proj} over {self.region.name}: {self.criterion} {self.value:.4g} ± {self.error_estimate:.1g}"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        others = [{"family": one.family, "value": support.plain(one.value), "proj": one.proj} for one in self.others]
        return super().to_dict() | {"others": others, "remarks": list(self.remarks)}

    def _table(self) -> list[dict[str, Any]]:
        """A row a family, the best first."""
        every = (self, *self.others)
        return [{"family": one.family, one.criterion: one.value, **one.parameters, "proj": one.proj} for one in every]


def optimize(
    family: str,
    region: regions.RegionLike = "globe",
    *,
    free: Sequence[str] | None = None,
    criterion: AnyFigure = "airy_kavrayskiy",
    ellipsoid: str | Ellipsoid | None = None,
    round_to: float | None = None,
    against: projections.ProjectionLike | Iterable[projections.ProjectionLike] = (),
    progress: Callable[[int, int], object] | None = None,
) -> Optimum:
    """The parameters with which a family of projections distorts a region least.

    Parameters
    ----------
    family : str
        lcc, aea, eqdc, tmerc, omerc, laea, aeqd, stere, airy, merc, cea, eqc, wintri, `ob_tran:NAME` for any aspect of
        a map, `auto` for the best of those that suit the region, or a PROJ string with free parameters such as
        `+proj=lcc +lat_1={30..50} +lat_2={40..60} +ellps=GRS80`.
    region : RegionLike
        Whatever `get_region` takes.
    free : sequence of str, optional
        The parameters to choose, `pole` for those of ob_tran, `k_0` for a uniform scale, whether the method has a
        parameter for it or not; by default the family's own. Not with `auto`.
    criterion : str, Figure, Measure or callable
        What to minimise: a name in `FIGURES`; a function of Jacobians J (n, 2, 2) with values (n,) never below 0, of
        which the mean by true area counts; or whatever else `get_figure` takes.
    ellipsoid : str or Ellipsoid, optional
        `sphere` or a name of PROJ's; by default WGS 84, and the sphere for maps that have formulas for that only.
    round_to : float, optional
        Step in degrees to whose multiples angles are rounded, within 1e-9 and 45; k_0 is then rounded to 1e-6. The best
        multiples near the optimum are taken, and of angles that are not free the nearest.
    against : ProjectionLike, or iterable of them
        Projections to compare with, added to the baselines.
    progress : callable, optional
        Called with the numbers of families done and of all.

    Returns
    -------
    Optimum
        Its figures are measured anew by adaptive cubature, each with its error.

    Raises
    ------
    ValueError
        For an unknown family, region, parameter, criterion or ellipsoid, a rounding out of its range, and free
        parameters with `auto`.
    ProjectionError
        Where no member shows the region, or one of `against` does not.

    References
    ----------
    S. Baselga 2018, Computers & Geosciences 117, whose parallels for Europe and for Spain it finds.
    The families and their parameters: https://proj.org/en/stable/operations/projections/

    Examples
    --------
    The mean of ln cos(lat) by the sphere's area is ln 2 - 1, so that the best parallel has the cosine 2 / e:

    >>> round(optimize("eqc").parameters["lat_ts"], 3)
    42.629
    """
    surface = _ellipsoid_of(ellipsoid)
    area, objective = regions.get_region(region, (surface or WGS84).ground), Objective(get_figure(criterion))
    support.check_text("family", family)
    free = None if free is None else [support.check_text("free parameter", one) for one in support.listed_values(free)]
    if round_to is not None and not 1e-9 <= support.check_number("rounding", round_to) <= 45.0:
        raise ValueError(f"Invalid rounding '{round_to}'. It must be a number of degrees within 1e-9 and 45.")
    if family == "auto" and free is not None:
        raise ValueError("Invalid free parameters for family 'auto'. Each family has its own; name one.")
    extent = families.extent_of(area)
    rivals = [projections.Projection.from_user_input(given) for given in projections.listed_projections(against)]
    regions.check_on_body(rivals, projections.Body(surface or WGS84))
    if surface is None and family != "auto" and families.get_family(family, extent).is_spherical:
        area = regions.get_region(region, WGS84 if any(not rival.ellipsoid.is_sphere for rival in rivals) else SPHERE)
    own = tuple(_baseline(rival, area, objective) for rival in rivals)
    names = families.sensible_families(extent, surface) if family == "auto" else [family]
    found: list[Optimum] = []
    failures: list[answers.Failure] = []
    for number, name in enumerate(names):
        if progress is not None:
            progress(number, len(names))
        try:
            members = Members(families.get_family(name, extent), area, objective, free, surface, round_to)
            found.append(_optimum(_decided(members), objective, extent, round_to))
        except projections.ProjectionError as error:
            if family != "auto":
                raise
            failures.append(answers.Failure(name, str(error)))
    if not found:
        raise projections.ProjectionError(
            f"Invalid region '{area.name}'. No family of projections serves it: {failures[0].error}"
        )
    # A map that leaves out a part of the region is no better for it.
    best, *others = sorted(
        found, key=lambda one: (one.coverage < _WHOLE, 0.0 if one.note else one.value, one.airy_kavrayskiy)
    )
    return replace(best, baselines=best.baselines + own, others=tuple(others), failures=tuple(failures))


def best_member(
    family: str, region: regions.Place, figure: Figure, ellipsoid: Ellipsoid, most: float = np.inf
) -> tuple[projections.Projection, dict[str, float]]:
    """The best member of a family and its free parameters, without measuring it."""
    # Raises ProjectionError if the family shows no part of the region, or has about no value below `most`.
    chosen_family = families.get_family(family, families.extent_of(region))
    members = _decided(Members(chosen_family, region, Objective(figure), ellipsoid=ellipsoid))
    best, _, fine, _ = _search_with_exchange(members, most)
    chosen, scale = members.written(best, fine)
    return members.member(chosen, scale), members.shown(chosen, scale)


def _decided(members: Members) -> Members:
    """The members by the Airy-Kavrayskiy error if their objective vanishes for all of them, else as they are."""
    return replace(members, objective=_DECIDES) if members.vanishes() else members


def _search_with_exchange(members: Members, most: float = np.inf) -> tuple[dict[str, float], float, Nodes, int]:
    """`Members.search`; for maxima, nodes are added where the best map exceeds its maximum at the nodes."""
    # The place of the true maximum becomes a node, and the search goes on (E. Remez, 1934): few corners matter.
    best, least, fine, evaluations = members.search(most)
    for _ in range(_EXCHANGES if members.objective.figure.is_maximum else 0):
        chosen, scale = members.written(best, fine)
        field = _field(members.member(chosen, scale), members.region, members.objective, 1e-6)
        worst = field.maximum(members.objective.figure.measure)
        if not least * (1.0 + _EXCEEDS) < worst.value < np.inf:
            break
        fine = fine.joined(worst.lon, worst.lat)
        before = least
        best, least, more = members.refine(best, fine)
        evaluations += more
        if least <= before:  # the map is torn there
            break
    return best, least, fine, evaluations


def _ellipsoid_of(given: str | Ellipsoid | None) -> Ellipsoid | None:
    if given is None or isinstance(given, Ellipsoid):
        return given
    if support.check_text("ellipsoid", given).lower() == "sphere":
        return SPHERE
    if given == "WGS84":
        return WGS84
    try:
        return projections.Projection.from_user_input(f"+proj=merc +ellps={given}").ellipsoid
    except projections.ProjectionError as error:
        raise ValueError(f"Invalid ellipsoid '{given}'. It must be sphere or one of PROJ's, such as GRS80.") from error


def _optimum(members: Members, objective: Objective, extent: families.Extent, round_to: float | None) -> Optimum:
    """The best member with its figures; `objective` is the one asked for."""
    best, least, fine, evaluations = _search_with_exchange(members)
    roundings = members.roundings(best, least, fine)
    rounded = best if round_to is None else members.rounded(best, round_to, least, fine).parameters
    chosen, scale = members.written(rounded, fine)
    if round_to is not None and members.frees_scale:
        scale = float(np.round(scale / _ROUND_SCALE) * _ROUND_SCALE)
    projection = members.member(chosen, scale)
    value, error, ak, coverage = _measured(projection, members.region, objective, least)
    finite = value
    if np.isfinite(value) and objective.figure.is_maximum and not 1.0 / _USUAL <= scale <= _USUAL:
        finite = _measured(members.member(chosen, 1.0), members.region, objective, 1.0)[0]
    if not np.isfinite(finite):
        where = f"{members.family.name} over {members.region.name}"
        raise projections.ProjectionError(
            f"Invalid criterion '{objective.figure.name}' for {where}. It is not finite there."
        )
    name = f"{projection.name} for {members.region.name}"
    if members.family.scale or scale == 1.0:
        wkt, reason = projections.crs_wkt(projection, name)
    else:
        wkt, reason = projections.wkt_of(
            projections.with_parameters(members.base, members.parameters(chosen)), scale * np.eye(2), name
        )
    return Optimum(
        family=members.family.name,
        region=members.region,
        criterion=objective.figure.name,
        unit=objective.figure.unit,
        parameters=members.shown(chosen, scale),
        scale=1.0 if members.family.scale else scale,
        value=value,
        error_estimate=error,
        airy_kavrayskiy=ak,
        coverage=coverage,
        projection=projection,
        wkt=wkt,
        wkt_reason=reason,
        at_limit=_at_limit(members, best),
        round_to=round_to,
        roundings=roundings,
        baselines=_baselines(members, objective, extent),
        evaluations=evaluations,
        note=None if members.objective == objective else _NOTE.format(objective.figure.name, members.family.name),
        flats=members.flats(best, least, fine),
        limit=lower_bound_of(objective.figure, members.region, ellipsoid=projection.ellipsoid),
    )


def _at_limit(members: Members, values: Mapping[str, float]) -> tuple[str, ...]:
    """Parameters at an end of their range other than 0 and 90 degrees."""
    off = {name: min(abs(value - end) for end in members.family.limits[name]) for name, value in values.items()}
    return tuple(name for name, value in values.items() if off[name] < 1e-6 and abs(value) not in (0.0, 90.0))


def _baselines(members: Members, objective: Objective, extent: families.Extent) -> tuple[Baseline, ...]:
    """The rule of thumb of the family, and the UTM zone of the region's middle."""
    found = []
    if members.family.rule:
        fixed = members.family.normalised(members.family.fixed)
        words = {name: round(value, DECIMALS) for name, value in fixed.items()}
        found.append((members.family.rule, projections.defined_by(members.base.definition, words)))
    if extent.radius < _TOO_WIDE:
        found.append(families.usual_crs(extent))
    baselines = []
    for name, definition in found:
        with contextlib.suppress(projections.ProjectionError):
            baselines.append(_baseline(definition, members.region, objective, name))
    return tuple(one for one in baselines if np.isfinite(one.value))


def _baseline(given: Any, region: regions.Place, objective: Objective, name: str = "") -> Baseline:
    """The criterion of a projection; raises ProjectionError if it does not show the whole region."""
    projection = projections.Projection.from_user_input(given)
    value, error, ak, coverage = _measured(projection, region, objective, 0.1)
    if coverage < _WHOLE:
        shown = f"It shows {100 * coverage:.3g} % of {region.name}."
        raise projections.ProjectionError(f"Invalid projection '{projection.label}' to compare with. {shown}")
    return Baseline(name or projection.name, projection.definition, value, ak, error)


def _measured(
    projection: projections.Projection, region: regions.Place, objective: Objective, about: float
) -> tuple[float, float, float, float]:
    """The criterion by adaptive cubature, its error estimate, the Airy-Kavrayskiy error, and the coverage."""
    tolerance = float(np.clip(_RELATIVE * about, 1e-12, 1e-5))
    field = _field(projection, region, objective, tolerance)
    found = field.figure(objective.figure)
    return found.value, found.error, field.airy_kavrayskiy.raw, field.coverage


def _field(projection: projections.Projection, region: regions.Place, objective: Objective, tolerance: float) -> Field:
    """The field of a projection, resolved for the objective's figure."""
    if objective.figure.is_airy_kavrayskiy:
        return sample(projection, region, tolerance=tolerance)
    return sample(projection, region, measures=[objective.figure.measure], tolerance=1e-6)
