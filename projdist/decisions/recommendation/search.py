"""What `recommend` answers: CRSs over a region with all their figures, best first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from typing import Any

from projdist.decisions.optimization import lower_bound_of
from projdist.decisions.recommendation.candidate_crs import HOLDS, Pool, of_datum
from projdist.decisions.recommendation.candidates import Distortion, Finding, Probe, Rejected, Trial, probe_of, try_crs
from projdist.decisions.recommendation.custom import Custom, Design, design, families_for
from projdist.decisions.recommendation.preference import CLOSE, by_usage, get_purpose, grouped, suits
from projdist.decisions.recommendation.shortlist import LEVEL, Contender, Contest, or_infinity
from projdist.decisions.recommendation.zones import ZoneSystem, official_of, remark_on_own, zones_of
from projdist.earth import WGS84
from projdist.field import AnyFigure, Figure, get_figure
from projdist.projections import AUTHORITIES, check_authorities, crs_records, reasons_against
from projdist.regions import PointSet, Region, RegionLike, get_region, main_part
from projdist.support import Answer, check_whole_number, is_picklable, listed, own_executor, plain, quoted, run_all


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A CRS over a region, with all CRSs that draw the same map under other datums.

    `value` is the figure of the criterion, `ranked` what the map counts by: the figure over the share, and for a `wide`
    map, one of the world or a continent, `standing.WIDE_FACTOR` times that. `share` is that of the region
    within the areas of use of all these CRSs, `keeps` what the map keeps true in the region, as measured. `national` is
    whether the country that the region is in has the map for its own; `datum_since` the year of the datum, None where
    the registry has none. `ratio_to_custom` and `difference_to_custom` are the figure over, and less, that of the best
    custom projection; None without one, the ratio also where that is no more than rounding. `over_limit` is the figure
    over `Recommendation.limit`, None without that.
    """

    code: str
    name: str
    method: str
    datum: str
    value: float
    ranked: float
    distortion: Distortion
    keeps: tuple[str, ...]
    share: float
    national: bool
    wide: bool
    datum_since: int | None
    area_of_use: tuple[float, float, float, float]
    area_name: str
    same: tuple[tuple[str, str], ...]
    ratio_to_custom: float | None = None
    difference_to_custom: float | None = None
    over_limit: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": plain(self.value),
            "ranked": plain(self.ranked),
            **{name: plain(value) for name, value in asdict(self.distortion).items()},
            "keeps": list(self.keeps),
            "share_in_area_of_use": self.share,
            "national": self.national,
            "wide": self.wide,
            "datum_since": self.datum_since,
            "area_of_use": {"bounds": list(self.area_of_use), "name": self.area_name},
            "same": [{"code": code, "name": name} for code, name in self.same],
            "ratio_to_custom": plain(self.ratio_to_custom),
            "difference_to_custom": plain(self.difference_to_custom),
            "over_limit": plain(self.over_limit),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": self.value,
            "ranked": self.ranked,
            **asdict(self.distortion),
            "keeps": " ".join(self.keeps),
            "share_in_area_of_use": self.share,
            "national": self.national,
            "wide": self.wide,
            "datum_since": self.datum_since,
            "area_of_use": self.area_name,
            "same": " ".join(code for code, _ in self.same),
            "ratio_to_custom": self.ratio_to_custom,
            "difference_to_custom": self.difference_to_custom,
            "over_limit": self.over_limit,
            "proj": "",
        }


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recommendation(Answer):
    """The best CRSs for a region, best first, and those that are none, with the reasons.

    `candidates` is the number of CRSs that were considered, `maps` that of different maps among them that serve the
    purpose. `custom` are the best custom projections of families, best first, where they were asked for, and
    `not_custom` the families that have none, with the reasons. `country` is whose land the region is, "" for none;
    `official` the best of its own CRSs for nine tenths of the region and more, for general use, on its datum in force;
    in a state of the USA or a part far away one that is made for that.
    `zones` are systems of conformal zones, where no single CRS serves for engineering; `notes` say what else there is
    to say, with figures. `limit` is, for the Airy-Kavrayskiy errors, about what the best of all maps of the region
    has, of all conformal or equal-area ones for these purposes; None where it is not known. A frame has the results and
    the custom ones.
    """

    region: Region
    purpose: str
    criterion: str
    area: str
    results: tuple[Candidate, ...]
    rejected: tuple[Rejected, ...]
    candidates: int
    maps: int
    custom: tuple[Custom, ...] = ()
    not_custom: tuple[Rejected, ...] = ()
    country: str = ""
    official: Candidate | None = None
    zones: tuple[ZoneSystem, ...] = ()
    notes: tuple[str, ...] = ()
    limit: float | None = None

    def _line(self) -> str:
        best = f"{self.results[0].code}, {self.results[0].name}" if self.results else "no CRS"
        return f"{best}, for {self.region.name}, of {self.candidates} CRSs"

    def to_dict(self) -> dict[str, Any]:
        """The question; lists of `"results"`, `"zones"`, `"custom"`, and what is not; and the `"official"` CRS."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "purpose": self.purpose,
            "criterion": self.criterion,
            "area": self.area,
            "country": self.country,
            "candidates": self.candidates,
            "maps": self.maps,
            "limit": self.limit,
            "results": [result.to_dict() for result in self.results],
            "official": None if self.official is None else self.official.to_dict(),
            "zones": [system.to_dict() for system in self.zones],
            "notes": list(self.notes),
            "custom": [custom.to_dict() for custom in self.custom],
            "not_custom": [{"family": one.name, "reason": one.reason} for one in self.not_custom],
            "rejected": [asdict(rejected) for rejected in self.rejected],
        }

    def rows(self) -> list[dict[str, Any]]:
        """The results as flat rows, names and numbers; then the custom projections, without a code, by PROJ string."""
        return self._table()

    def _table(self) -> list[dict[str, Any]]:
        return [result._row() for result in self.results] + [custom._row() for custom in self.custom]


# ---- search --------------------------------------------------------------------------------------


AREAS = ("preferred", "contains", "intersects")
"""How a CRS's area of use counts: the more of the region it holds the better, it must hold it, or it need not."""

Progress = Callable[[int, int], None]

_HEAVY = 24  # trials that a custom projection takes as long as, at least


# ---- the question ---------------------------------------------------------------------------


def recommend(
    region: RegionLike,
    *,
    purpose: str = "any",
    criterion: AnyFigure = "airy_kavrayskiy",
    authorities: Sequence[str] = AUTHORITIES[:2],
    datum: str | None = None,
    area: str = "preferred",
    deprecated: bool = False,
    limit: int | None = 10,
    uninterrupted: bool = False,
    custom: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
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
        What to rank by: a name in `FIGURES`; or a function of Jacobians J (n, 2, 2) that gives values (n,) never below
        0, by whose mean over the area; or whatever else `get_figure` takes. What cannot be pickled, as a lambda, is
        measured in this process only.
    authorities : sequence of str
        Whose CRSs to look at, of EPSG, ESRI and IGNF; by default the first two.
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
        Whether to find the best custom projections, too, for the same purpose and by the same criterion.
    executor : concurrent.futures.Executor, optional
        What the work runs on; else on processes of its own where they can be forked.
    progress : callable, optional
        Hears of the steps done and of all, two integers.

    Returns
    -------
    Recommendation
        The best CRSs, best first, and with reasons those that are none.

    Raises
    ------
    ValueError
        For an unknown region, purpose, criterion, authority, datum or area, for a set of points, and a limit
        below 1.

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
    given = get_region(region, WGS84)
    if isinstance(given, PointSet):
        raise ValueError(f"Invalid region '{given.name}'. It must be an area: a box, a cap, a country, polygons.")
    place = main_part(given) if given.far else given
    ranking, purpose, area, limit = get_figure(criterion), get_purpose(purpose), _check_area(area), _check_limit(limit)
    records = crs_records(check_authorities(authorities), deprecated=deprecated)
    search = _Search(Pool(place, records, area), purpose, ranking, area, limit, progress)
    search.uninterrupted = uninterrupted
    if custom:
        search.families = families_for(place, purpose)
    if place is not given:
        search.notes.append(f"The answer is for the main part, {place.name}.")
    if executor is not None:
        return search.run(executor, datum)
    if not is_picklable(ranking):
        return search.run(None, datum)
    with own_executor(len(search.pool.records) + _HEAVY * len(search.families)) as own:
        return search.run(own, datum)


def _check_area(area: str) -> str:
    if not isinstance(area, str) or area not in AREAS:
        raise ValueError(f"Invalid area {quoted(area)}. It must be {listed(AREAS, 'or')}.")
    return area


def _check_limit(limit: int | None) -> int | None:
    if limit is not None and check_whole_number("limit", limit) < 1:
        raise ValueError(f"Invalid limit '{limit}'. It must be at least 1.")
    return limit


class _Search:
    """A search for the best: the candidates, their trials, the maps among them, the best of these in full."""

    def __init__(
        self,
        pool: Pool,
        purpose: str,
        ranking: Figure,
        area: str,
        limit: int | None,
        progress: Progress | None,
    ) -> None:
        self.pool, self.purpose, self.ranking, self.area, self.limit = pool, purpose, ranking, area, limit
        self.progress = progress
        self.probe: Probe = probe_of(pool.region)
        self.notes: list[str] = []
        self.rejected = list(pool.rejected)
        self.uninterrupted = False
        self.families: list[str] = []  # of custom projections
        self.least = lower_bound_of(ranking, pool.region, purpose)

    def run(self, executor: Executor | None, datum: str | None) -> Recommendation:
        """Try all, measure the best."""
        unfit = reasons_against(self.pool.records)
        self.rejected += [Rejected(code, self.pool.records[code].name, reason) for code, reason in unfit.items()]
        trials = [
            Trial(code, record.name, self.probe, self.ranking)
            for code, record in self.pool.records.items()
            if code not in unfit
        ]
        total = len(trials) + len(self.families) + (self.limit or len(trials))
        found = run_all(executor, try_crs, trials, self._report(0, total))
        findings = [one for one in found if isinstance(one, Finding)]
        self.rejected += [one for one in found if isinstance(one, Rejected)]
        if datum is not None:
            findings = of_datum(findings, datum)
        maps = [one for one in self._maps(findings) if suits(one.first.keeps, self.purpose)]
        custom, not_custom = self._custom(executor, self._report(len(trials), total))
        contest = self._contest(executor)
        best = contest.best(maps, self.limit, self._report(len(trials) + len(self.families), total))
        official, zones = official_of(maps, contest), zones_of(maps, contest, self.purpose)
        remark = "" if self.area == "intersects" else remark_on_own(maps, best, contest)
        if self.progress is not None:
            self.progress(total, total)
        return Recommendation(
            region=self.pool.region,
            purpose=self.purpose,
            criterion=self.ranking.name,
            area=self.area,
            results=tuple(self._candidate(one, custom) for one in best),
            rejected=(*self.rejected, *contest.rejected),
            candidates=len(self.pool.records),
            maps=len(maps),
            custom=custom,
            not_custom=not_custom,
            country=self.pool.home,
            official=None if official is None else self._candidate(official, custom),
            zones=zones,
            notes=(*self.notes, *([remark] if remark else [])),
            limit=self.least,
        )

    def _report(self, before: int, total: int) -> Callable[[int], None] | None:
        """A listener to the number of tasks done, when some were done before."""
        progress = self.progress
        return None if progress is None else lambda done: progress(min(before + done, total), total)

    def _contest(self, executor: Executor | None) -> Contest:
        """What measures maps in full: by figures alone where areas of use do not count."""
        return Contest(
            self.pool,
            self.probe,
            self.ranking,
            close=0.0 if self.area == "intersects" else CLOSE,
            uninterrupted=self.uninterrupted,
            executor=executor,
        )

    def _maps(self, findings: list[Finding]) -> list[Contender]:
        """The different maps among findings."""
        usages = {one.code: self.pool.usage(self.pool.records[one.code]) for one in findings}
        maps = []
        for group in grouped(findings, self._size):
            members = by_usage(group, self.pool.records, usages)
            standing = self.pool.standing(members, usages)
            weight = 1.0 if self.area == "intersects" else standing.weight(HOLDS)
            maps.append(Contender(members=members, standing=standing, weight=weight, level=self._level(members[0])))
        return maps

    def _level(self, one: Finding) -> float:
        """The Airy-Kavrayskiy error by the trial."""
        return or_infinity(LEVEL(one.jacobian, self.probe.weight))

    def _size(self, one: Finding) -> float:
        """The figure by the trial, or the level where that is no more than rounding."""
        return self.ranking.without_rounding(one.value) or self._level(one)

    def _custom(
        self, executor: Executor | None, progress: Callable[[int], None] | None
    ) -> tuple[tuple[Custom, ...], tuple[Rejected, ...]]:
        """The best member of each family, best first, and families without one."""
        tasks = [Design(name, self.pool.region, self.probe, self.ranking, self.purpose) for name in self.families]
        found = run_all(executor, design, tasks, progress)
        custom = [replace(one, over_limit=self._over_limit(one.value)) for one in found if isinstance(one, Custom)]
        custom.sort(
            key=lambda one: (self.ranking.without_rounding(or_infinity(one.value)), one.distortion.airy_kavrayskiy)
        )
        return tuple(custom), tuple(one for one in found if isinstance(one, Rejected))

    def _over_limit(self, value: float) -> float | None:
        """A figure over the least that there can be."""
        return None if self.least is None else value / self.least

    def _candidate(self, one: Contender, custom: tuple[Custom, ...]) -> Candidate:
        record = self.pool.records[one.first.code]
        value, distortion = one.found
        least = custom[0].value if custom else None
        return Candidate(
            code=record.code,
            name=record.name,
            method=one.first.conversion[0],
            datum=one.first.datum,
            value=value,
            ranked=one.weight * value,
            distortion=distortion,
            keeps=one.first.keeps,
            share=one.standing.share,
            national=one.standing.national,
            wide=one.standing.wide,
            datum_since=one.standing.since or None,
            area_of_use=record.area_of_use,
            area_name=record.area_name,
            same=tuple((other.code, self.pool.records[other.code].name) for other in one.members[1:]),
            ratio_to_custom=value / least if least is not None and least > self.ranking.rounding else None,
            difference_to_custom=value - least if least is not None else None,
            over_limit=self._over_limit(value),
        )
