"""The best existing CRSs for a region by measurement, and the best custom projections beside them."""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from projdist import earth, projections, regions, support
from projdist.decisions.candidate_crs import HOLDS, LEVEL, Candidate, CandidatePool, of_datum, or_infinity, try_crs
from projdist.decisions.families import extent_of, sensible_families
from projdist.decisions.map_info import WeightedPoints, properties_of
from projdist.decisions.measurement import Distortion, FullMeasurement, Rejected, measure, probe_of
from projdist.decisions.optimization import best_member, lower_bound_of
from projdist.decisions.ranking import CLOSE, OnProgress, Shortlist, by_usage, get_purpose, grouped, suits, weight_of
from projdist.decisions.zones import ZoneSystem, official_of, remark_on_own, zones_of
from projdist.field import AnyFigure, Figure, get_figure, jacobian

AREAS = ("preferred", "contains", "intersects")
"""How areas of use count: the more of the region the better; they must hold the region; or they are ignored."""

_HEAVY = 24  # trials that take as long as a custom projection, at least


@dataclass(frozen=True)
class Custom(support.Record):
    """The best member of a family for a region: its PROJ string, parameters, and the figures of a candidate."""

    family: str
    name: str
    proj: str
    parameters: dict[str, float]
    value: float
    distortion: Distortion = field(metadata=support.schema(spread=True))
    keeps: tuple[str, ...]
    over_limit: float | None = None

    def _row(self) -> dict[str, Any]:
        named = {"code": "", "name": self.name, "method": self.family, "datum": "WGS 84"}
        figures = {"value": self.value, "ranked": self.value, **asdict(self.distortion), "keeps": " ".join(self.keeps)}
        use = {"share_in_area_of_use": 1.0, "national": False, "wide": False}
        return named | figures | use | {"over_limit": self.over_limit, "proj": self.proj}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recommendation(support.Answer):
    """The best CRSs for a region, best first, and the rejected ones, with the reasons.

    A frame has a row for each result and each custom projection.
    """

    region: regions.Region = field(metadata=support.schema(of=("name", "area_km2")))
    purpose: str
    criterion: str
    area: str
    country: str = ""  #: whose land the region is, "" for none
    candidates: int  #: number of CRSs that were considered
    maps: int  #: number of different maps among them that serve the purpose
    limit: float | None = None  #: about the least Airy-Kavrayskiy error of any map for the purpose, or None
    results: tuple[Candidate, ...]
    #: The best of the country's CRSs for general use that hold nine tenths of the region, on its datum in force; in a
    #: state of the USA or a part far away only one that is made for that.
    official: Candidate | None = None
    zones: tuple[ZoneSystem, ...] = ()  #: systems of conformal zones, where no single CRS serves for engineering
    notes: tuple[str, ...] = ()  #: remarks with figures
    custom: tuple[Custom, ...] = ()  #: the best custom projections of families, best first, if asked for
    not_custom: tuple[Rejected, ...] = ()  #: the families that have none, with the reasons
    rejected: tuple[Rejected, ...]

    def _line(self) -> str:
        best = f"{self.results[0].code}, {self.results[0].name}" if self.results else "no CRS"
        return f"{best}, for {self.region.name}, of {self.candidates} CRSs"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON, as `"results"`, `"official"`, `"zones"`, `"custom"` and `"rejected"`."""
        not_custom = [{"family": one.name, "reason": one.reason} for one in self.not_custom]
        return super().to_dict() | {"not_custom": not_custom}

    def rows(self) -> list[dict[str, Any]]:
        """The results as flat rows, names and numbers; then the custom projections, without a code, by PROJ string."""
        found = [result._row() for result in self.results]
        blank = dict.fromkeys(found[0]) if found else {}
        return found + [blank | custom._row() for custom in self.custom]

    _table = rows


# ---- the search ----------------------------------------------------------------------------------


def recommend(
    region: regions.RegionLike,
    *,
    purpose: str = "any",
    criterion: AnyFigure = "airy_kavrayskiy",
    authorities: Sequence[str] = projections.AUTHORITIES[:2],
    codes: Sequence[str] = (),
    datum: str | None = None,
    area: str = "preferred",
    deprecated: bool = False,
    limit: int | None = 10,
    uninterrupted: bool = False,
    custom: bool = False,
    executor: Executor | str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Recommendation:
    """The best of the projected CRSs of PROJ's database for a region, by measurement.

    The order is that of `Candidate.ranked`, but among maps within a tenth of the best of them the national ones come
    first, then those of a datum that is in force; with `area="intersects"` it is that of the figures alone.

    Parameters
    ----------
    region : RegionLike
        Whatever `get_region` takes, but no set of points. Of a region with parts thousands of kilometres away the
        answer is for the main part.
    purpose : str
        What the map must keep, as its field shows it: any, equal-area, conformal, equidistant or compromise.
    criterion : str, Figure, Measure or callable
        What to rank by: a name in `FIGURES`; a function of Jacobians J (n, 2, 2) with values (n,) never below 0, of
        which the mean over the area counts; or whatever else `get_figure` takes. What cannot be pickled, such as a
        lambda, is measured in this process only.
    authorities : sequence of str
        Whose CRSs to look at, of EPSG, ESRI and IGNF; by default the first two.
    codes : sequence of str
        The only CRSs to look at, as EPSG:3857; all without any.
    datum : str, optional
        A part of the name of the geodetic CRS.
    area : str
        How areas of use count: preferred (the figure counts over the share of the region within the area of use),
        contains (they must hold the region) or intersects (they need not).
    deprecated : bool
        Whether deprecated CRSs count.
    limit : int or None
        How many to answer with; None measures all in full.
    uninterrupted : bool
        Whether to leave out maps that are cut within the region (around the Earth: by more than a meridian).
    custom : bool
        Whether to find also the best custom projections for the same purpose and by the same criterion.
    executor : concurrent.futures.Executor or str, optional
        What the work runs on, also by name (processes:4, dask://HOST:PORT); else on processes of its own where they
        can be forked.
    progress : callable, optional
        Called with the numbers of steps done and of all.

    Returns
    -------
    Recommendation
        The best CRSs, best first, and the rejected ones with the reasons.

    Raises
    ------
    ValueError
        For an unknown region, purpose, criterion, authority, datum or area, a set of points, and a limit below 1.

    References
    ----------
    PROJ, Resource files, proj.db: https://proj.org/en/stable/resource_files.html
    The data in it: EPSG Geodetic Parameter Dataset, https://epsg.org

    Examples
    --------
    The Swiss agency's own system, LV95:

    >>> recommend("box:7.5,46.5,8.5,47.5", authorities=["EPSG"], limit=1).results[0].code
    'EPSG:2056'
    """
    options = (area, deprecated, limit, uninterrupted, custom, progress)
    search = _search_for(region, purpose, criterion, authorities, codes, *options)
    with search.workers(executor) as workers:
        return search.run(workers, datum)


def ranked_crs(
    region: regions.RegionLike, *, datum: str | None = None, executor: Executor | str | None = None, **options: Any
) -> tuple[Candidate, ...]:
    """The results of `recommend`, in its order, with keys but without full figures, which take most of the time."""
    inspect.signature(recommend).bind(region, **options)  # raises TypeError for others
    search = _search_for(region, **options)
    with search.workers(executor) as workers:
        return search.ranked(workers, datum)


def _search_for(
    region: regions.RegionLike,
    purpose: str = "any",
    criterion: AnyFigure = "airy_kavrayskiy",
    authorities: Sequence[str] = projections.AUTHORITIES[:2],
    codes: Sequence[str] = (),
    area: str = "preferred",
    deprecated: bool = False,
    limit: int | None = 10,
    uninterrupted: bool = False,
    custom: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> _CrsSearch:
    """The search with the options of `recommend`, checked."""
    given = regions.get_region(region, earth.WGS84)
    if isinstance(given, regions.PointSet):
        raise ValueError(f"Invalid region '{given.name}'. It must be an area: a box, a cap, a country, polygons.")
    place = regions.main_part(given) if given.far else given
    ranking, purpose = get_figure(criterion), get_purpose(purpose)
    if not isinstance(area, str) or area not in AREAS:
        raise ValueError(f"Invalid area {support.quoted(area)}. It must be {support.listed(AREAS, 'or')}.")
    if limit is not None and support.check_whole_number("limit", limit) < 1:
        raise ValueError(f"Invalid limit '{limit}'. It must be at least 1.")
    records = projections.crs_records(projections.check_authorities(authorities), deprecated=deprecated)
    if wanted := support.listed_values(codes):
        records = [one for one in records if one.code in wanted]
    pool = CandidatePool(place, records, area)
    unfit = projections.reasons_against(pool.records)
    return _CrsSearch(
        pool=pool,
        fit=[record for code, record in pool.records.items() if code not in unfit],
        rejected=[*pool.rejected, *(Rejected(code, pool.records[code].name, unfit[code]) for code in unfit)],
        probe=probe_of(place),
        ranking=ranking,
        close=0.0 if area == "intersects" else CLOSE,  # there areas of use do not count
        uninterrupted=uninterrupted,
        purpose=purpose,
        area=area,
        limit=limit,
        families=families_for(place, purpose) if custom else (),
        progress=progress or (lambda done, total: None),
        notes=() if place is given else (f"The answer is for the main part, {place.name}.",),
    )


@dataclass(kw_only=True)
class _CrsSearch(Shortlist):
    """A search for the best CRSs: candidates are tried, grouped by map, and the best maps measured in full."""

    purpose: str
    area: str
    limit: int | None
    families: Sequence[str]  # of custom projections
    fit: Sequence[projections.CrsRecord]  # CRSs to try
    progress: Callable[[int, int], None]
    notes: tuple[str, ...]

    def workers(self, executor: Executor | str | None) -> AbstractContextManager[Executor | None]:
        """The executor for the work, as a context."""
        if executor is not None:
            return support.open_executor(executor)
        if not support.is_picklable(self.ranking):
            return nullcontext()
        return support.own_executor(len(self.pool.records) + _HEAVY * len(self.families))

    def ranked(self, executor: Executor | None, datum: str | None) -> tuple[Candidate, ...]:
        """Try all CRSs, and put the best in order."""
        self.executor = executor
        best = tuple(self.ordered(self._tried(datum), self.limit))
        self.progress(self._total, self._total)
        return best

    def _tried(self, datum: str | None) -> list[Candidate]:
        """The different maps for the purpose, on a datum if stated; what else was tried is rejected."""
        trials = [functools.partial(try_crs, record, self.probe, self.ranking) for record in self.fit]
        tried = support.run_all(self.executor, operator.call, trials, self._report(0))
        candidates = [one for one in tried if isinstance(one, Candidate)]
        self.rejected += [one for one in tried if isinstance(one, Rejected)]
        if datum is not None:
            candidates = of_datum(candidates, datum)
        return [one for one in self._maps(candidates) if suits(one.keeps, self.purpose)]

    def run(self, executor: Executor | None, datum: str | None) -> Recommendation:
        """Try all CRSs, and measure the best."""
        self.executor = executor
        maps = self._tried(datum)
        custom, not_custom = self._custom(self._report(len(self.fit)))
        best = self.best(maps, self.limit, self._report(len(self.fit) + len(self.families)))
        official, zones = official_of(maps, best, self), zones_of(maps, self, self.purpose)
        remark = "" if self.area == "intersects" else remark_on_own(maps, best, self)
        self.progress(self._total, self._total)
        least = custom[0].value if custom else None
        return Recommendation(
            region=self.pool.region,
            purpose=self.purpose,
            criterion=self.ranking.name,
            area=self.area,
            results=tuple(self._compared(one, least) for one in best),
            rejected=tuple(self.rejected),
            candidates=len(self.pool.records),
            maps=len(maps),
            custom=custom,
            not_custom=not_custom,
            country=self.pool.home,
            official=None if official is None else self._compared(official, least),
            zones=zones,
            notes=(*self.notes, *([remark] if remark else [])),
            limit=self._lower_bound,
        )

    @property
    def _total(self) -> int:
        """About the number of tasks."""
        return len(self.fit) + len(self.families) + (self.limit or len(self.fit))

    def _report(self, before: int) -> OnProgress:
        """A callback for the number of tasks done, after those done before."""
        return lambda done: self.progress(min(before + done, self._total), self._total)

    @functools.cached_property
    def _lower_bound(self) -> float | None:
        return lower_bound_of(self.ranking, self.pool.region, self.purpose)

    def _maps(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        """The different maps among candidates, each as one candidate."""
        maps = []
        used = [self.pool.with_usage(one) for one in candidates]
        # By the figure of the trial, or the level where that is no more than rounding.
        for group in grouped(used, lambda one: self.ranking.without_rounding(one.trial.value) or one.trial.level):
            one = self.pool.as_one_map(by_usage(group, self.pool.records))
            maps.append(one if self.area == "intersects" else replace(one, weight=weight_of(one, HOLDS)))
        return maps

    def _custom(self, on_progress: OnProgress) -> tuple[tuple[Custom, ...], tuple[Rejected, ...]]:
        """The best member of each family, best first, and families without one."""
        find = functools.partial(
            best_custom, region=self.pool.region, probe=self.probe, ranking=self.ranking, purpose=self.purpose
        )
        found = support.run_all(self.executor, find, self.families, on_progress)
        custom = [replace(one, over_limit=self._over_limit(one.value)) for one in found if isinstance(one, Custom)]
        figure = self.ranking.without_rounding
        custom.sort(key=lambda one: (figure(or_infinity(one.value)), one.distortion.airy_kavrayskiy))
        return tuple(custom), tuple(one for one in found if isinstance(one, Rejected))

    def _over_limit(self, value: float) -> float | None:
        """A figure divided by the lower bound."""
        return None if self._lower_bound is None else value / self._lower_bound

    def _compared(self, one: Candidate, least: float | None) -> Candidate:
        """A candidate beside the best custom projection and the lower bound."""
        return replace(
            one,
            ratio_to_custom=one.value / least if least is not None and least > self.ranking.rounding else None,
            difference_to_custom=one.value - least if least is not None else None,
            over_limit=self._over_limit(one.value),
        )


# ---- custom projections --------------------------------------------------------------------------

_FAMILIES = {
    "equal-area": ("laea", "aea", "cea"),
    "conformal": ("lcc", "tmerc", "omerc", "stere", "merc"),
    "equidistant": ("aeqd", "eqdc", "eqc"),
    "compromise": ("wintri", "airy"),
}


def families_for(region: regions.Region, purpose: str) -> list[str]:
    """Families that may serve the purpose: those that suit the region's size and place, else all."""
    names = sensible_families(extent_of(region), earth.WGS84)
    if purpose == "any":
        return names
    serving = _FAMILIES[purpose]
    return [name for name in names if name in serving] or list(serving)


def best_custom(
    family: str, region: regions.Region, probe: WeightedPoints, ranking: Figure, purpose: str
) -> Custom | Rejected:
    """The best member of a family, measured in full as existing CRSs are; rejected if it does not serve the purpose."""
    # It is on WGS 84, as existing CRSs are, even if its formulas are for a sphere.
    try:
        projection, parameters = best_member(family, region, ranking, earth.WGS84)
        J = jacobian(projection, probe.lon, probe.lat)
    except projections.ProjectionError as error:
        return Rejected("", family, str(error))
    keeps = properties_of(J, probe).keeps
    if not suits(keeps, purpose):
        return Rejected("", family, f"It is not {purpose} on the ellipsoid.")
    level = LEVEL(J, probe.weight)
    found = measure(FullMeasurement(projection.definition, family, region, probe, keeps, level, ranking))
    if isinstance(found, Rejected):
        return found
    value, distortion = found
    return Custom(family, projection.name, projection.definition, parameters, value, distortion, keeps)
