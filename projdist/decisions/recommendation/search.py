"""The best existing CRS for a region: every candidate of PROJ's database, measured and ranked.

A cheap trial at two hundred nodes gives each candidate's figure to a few per cent; only those that
may be among the best by it are measured in full, so that the order is that of measuring all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from projdist.decisions.limits import limit_of
from projdist.decisions.recommendation.advice import Candidate, Recommendation
from projdist.decisions.recommendation.candidates import (
    Distortion,
    Finding,
    Full,
    Rejected,
    Trial,
    measure,
    settle,
    try_crs,
)
from projdist.decisions.recommendation.custom import Custom, Design, design, families_for
from projdist.decisions.recommendation.pool import HOLDS, HOLDS_NEARLY, Pool, of_datum
from projdist.decisions.recommendation.purposes import get_purpose, suits
from projdist.decisions.recommendation.same_maps import by_usage, grouped
from projdist.decisions.recommendation.standing import CLOSE, Key, Standing, in_force, is_close, preferred, tiers
from projdist.decisions.recommendation.trial_nodes import Probe, probe_of
from projdist.decisions.recommendation.zones import ENGINEERING_PPM, ZoneSystem, find_zones
from projdist.field import FIGURES, AnyFigure, Figure, get_figure
from projdist.projections import (
    AUTHORITIES,
    check_authorities,
    crs_records,
    reasons_against,
)
from projdist.regions import PointSet, RegionLike, get_region, main_part
from projdist.support import check_whole_number, hints, is_picklable, own_executor, quoted, run_all

__all__ = ["AREAS", "Candidate", "Recommendation", "recommend"]

AREAS = ("preferred", "contains", "intersects")
"""How a CRS's area of use counts: the more of the region it holds the better, it must hold it, or it need not."""

Progress = Callable[[int, int], None]

# A trial's mean is good to a few per cent (6 on the globe, whose poles it leaves out), its maximum never too large.
_MEAN_MARGIN, _MAXIMUM_MARGIN = 0.7, 0.99
_SAFETY = 0.9  # of the least ratio of a full measurement to its trial so far
_WAVE = 16  # maps in one go: more than there are cores, fewer than there are maps
_HEAVY = 24  # trials that a custom projection takes as long as, at least

_UTM = "WGS 84 / UTM zone "

_LEVEL, _SCALE = FIGURES["airy_kavrayskiy"], FIGURES["max_scale_error_ppm"]


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
    given = get_region(region)
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
        raise ValueError(f"Invalid area {quoted(area)}. It must be {hints.listed(AREAS, 'or')}.")
    return area


def _check_limit(limit: int | None) -> int | None:
    if limit is not None and check_whole_number("limit", limit) < 1:
        raise ValueError(f"Invalid limit '{limit}'. It must be at least 1.")
    return limit


@dataclass(kw_only=True)
class _Map:
    """The CRSs of one map, the one to name first, and what is known of it."""

    members: list[Finding]
    standing: Standing
    weight: float  # what its figure counts
    level: float  # its Airy-Kavrayskiy error by its trial
    key: Key = (np.inf, np.inf)  # what it counts by its figure in full, then by its level
    result: tuple[float, Distortion] | None = None  # the figure in full, and all that is told of it

    @property
    def first(self) -> Finding:
        return self.members[0]

    @property
    def found(self) -> tuple[float, Distortion]:
        assert self.result is not None
        return self.result

    @property
    def trial(self) -> tuple[float, float]:
        """What it counts by its trial: by the figure, then by its level."""
        return self.weight * _number(self.first.value), self.weight * self.level


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
        self.close = 0.0 if area == "intersects" else CLOSE
        self.notes: list[str] = []
        self.rejected = list(pool.rejected)
        self.uninterrupted = False
        self.families: list[str] = []  # of custom projections
        self.least = limit_of(ranking, pool.region, purpose)

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
        best = self._best(maps, executor, len(trials) + len(self.families), total)
        zones = self._zones(maps, executor)
        official = self._official(maps, executor)
        self.notes += self._on_national(maps, best, executor)
        if self.progress is not None:
            self.progress(total, total)
        return Recommendation(
            region=self.pool.region,
            purpose=self.purpose,
            criterion=self.ranking.name,
            area=self.area,
            results=tuple(self._candidate(one, custom) for one in best),
            rejected=tuple(self.rejected),
            candidates=len(self.pool.records),
            maps=len(maps),
            custom=custom,
            not_custom=not_custom,
            country=self.pool.home,
            official=None if official is None else self._candidate(official, custom),
            zones=zones,
            notes=tuple(self.notes),
            limit=self.least,
        )

    def _report(self, before: int, total: int) -> Callable[[int], None] | None:
        """A listener to the number of tasks done, when some were done before."""
        progress = self.progress
        return None if progress is None else lambda done: progress(min(before + done, total), total)

    def _maps(self, findings: list[Finding]) -> list[_Map]:
        """The different maps among findings."""
        usages = {one.code: self.pool.usage(self.pool.records[one.code]) for one in findings}
        maps = []
        for group in grouped(findings, self._size):
            members = by_usage(group, self.pool.records, usages)
            standing = self.pool.standing(members, usages)
            weight = 1.0 if self.area == "intersects" else standing.weight(HOLDS)
            maps.append(_Map(members=members, standing=standing, weight=weight, level=self._level(members[0])))
        return maps

    def _level(self, one: Finding) -> float:
        """The Airy-Kavrayskiy error by the trial."""
        return _number(_LEVEL(one.jacobian, self.probe.weight))

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
        custom.sort(key=lambda one: (self.ranking.without_rounding(_number(one.value)), one.distortion.airy_kavrayskiy))
        return tuple(custom), tuple(one for one in found if isinstance(one, Rejected))

    def _best(self, maps: list[_Map], executor: Executor | None, before: int, total: int) -> list[_Map]:
        """The best maps in order: figures in full until no other can be among them, then all that is told of them."""
        margins = [_MAXIMUM_MARGIN if self.ranking.is_maximum else _MEAN_MARGIN, _MEAN_MARGIN]
        wanted = len(maps) if self.limit is None else min(self.limit, len(maps))
        waiting = sorted(maps, key=lambda one: self._told(*one.trial))
        done: list[_Map] = []
        while waiting:
            least = self._least_of_last(done, wanted)
            chosen = [one for one in waiting if self._may_reach(least, one, margins)][: max(wanted - len(done), _WAVE)]
            if not chosen:
                break
            waiting = [one for one in waiting if one not in chosen]
            settled = self._settled(chosen, executor)
            margins = [min(pair) for pair in zip(margins, self._margins(settled), strict=True)]
            done += settled
        best = [one for tier in self._tiers(done) for one in tier][:wanted]
        for one, result in zip(best, self._run(measure, best, executor, self._report(before, total)), strict=True):
            one.result = result
        return best

    def _tiers(self, done: list[_Map]) -> list[list[_Map]]:
        """Maps in groups that are close, each in the order of preference."""
        found = []
        for tier in tiers([one.key for one in done], self.close):
            members = [done[i] for i in tier]
            order = preferred([one.standing for one in members], [one.key for one in members])
            found.append([members[i] for i in order])
        return found

    def _least_of_last(self, done: list[_Map], wanted: int) -> Key:
        """The least key of the tier in which the last of those wanted is: what is close to it may come before."""
        count = 0
        for tier in self._tiers(done):
            count += len(tier)
            if count >= wanted:
                return min(one.key for one in tier)
        return np.inf, np.inf

    def _told(self, figure: float, level: float) -> tuple[float, float]:
        """What maps are ordered by: figures that are no more than rounding are a tie, and the levels decide."""
        return self.ranking.without_rounding(figure), level

    def _may_reach(self, least: Key, one: _Map, margins: Sequence[float]) -> bool:
        """Whether a map may come before the best of a tier, or close to it."""
        figure, level = (margin * value for margin, value in zip(margins, one.trial, strict=True))
        key = self._told(figure, level)
        return key <= least or is_close(key, least, self.close)

    def _settled(self, maps: list[_Map], executor: Executor | None) -> list[_Map]:
        """The maps that have a figure in full, with their keys; where that vanishes, with their levels in full."""
        settled = []
        for one, figure in zip(maps, self._run(settle, maps, executor), strict=True):
            if isinstance(figure, Rejected):
                self.rejected.append(figure)
                continue
            one.key = self._told(one.weight * _number(figure), one.trial[1])
            settled.append(one)
        tied = [one for one in settled if one.key[0] == 0.0]
        for one, level in zip(tied, self._run(settle, tied, executor, ranking=_LEVEL), strict=True):
            one.key = 0.0, one.weight * _number(level)
        return settled

    def _margins(self, settled: list[_Map]) -> list[float]:
        """How far below their trials measurements may be, by those in full: of figures, and of levels."""
        pairs = [[(one.key[0], one.trial[0]) for one in settled if 0.0 < one.key[0] < np.inf]]
        pairs += [[(one.key[1], one.trial[1]) for one in settled if one.key[0] == 0.0 and one.key[1] < np.inf]]
        return [min((_SAFETY * full / trial for full, trial in kind if trial > 0.0), default=np.inf) for kind in pairs]

    def _run(
        self,
        function: Callable[[Full], Any],
        maps: list[_Map],
        executor: Executor | None,
        progress: Callable[[int], None] | None = None,
        ranking: Figure | None = None,
    ) -> list[Any]:
        """A measurement of each map, for the figure of the search or another."""
        tasks = [
            Full(
                code=one.first.code,
                name=self.pool.records[one.first.code].name,
                region=self.pool.region,
                probe=self.probe,
                keeps=one.first.keeps,
                level=one.level,
                ranking=ranking or self.ranking,
                uninterrupted=self.uninterrupted,
            )
            for one in maps
        ]
        return run_all(executor, function, tasks, progress)

    def _zones(self, maps: list[_Map], executor: Executor | None) -> tuple[ZoneSystem, ...]:
        """Systems of zones, the country's own or else UTM's, where no conformal map serves for engineering."""
        errors = [
            self._scale_error(one.first) for one in maps if "conformal" in one.first.keeps and not one.standing.wide
        ]
        least = min(errors, default=np.inf if suits(("conformal",), self.purpose) else 0.0)
        if least <= ENGINEERING_PPM:
            return ()
        known = [record for record in self.pool.meeting if record.code in self.pool.facts]
        own = [record for record in known if self.pool.is_national(record)]
        frames = {self.pool.facts[record.code].frame for record in own}
        same = [
            record for record in known if self.pool.facts[record.code].frame in frames
        ]  # outlines are not all undisputed
        utm = [record for record in known if record.name.startswith(_UTM)]
        for records in (own, same, utm):
            found = find_zones(
                self.pool.region,
                self.pool.lattice,
                records,
                self.pool.facts,
                self.ranking,
                least,
                executor,
                national=records is not utm,
            )
            if found:
                return found
        return ()

    def _over_limit(self, value: float) -> float | None:
        """A figure over the least that there can be."""
        return None if self.least is None else value / self.least

    def _scale_error(self, one: Finding) -> float:
        """The largest scale error in ppm by the trial."""
        return _SCALE(one.jacobian, self.probe.weight)

    def _official(self, maps: list[_Map], executor: Executor | None) -> _Map | None:
        """The best of the country's own maps for nearly all of the region, for general use, on the datum in force."""
        current = [maps[i] for i in in_force([one.standing for one in maps])]
        own = [one for one in current if one.standing.share >= HOLDS_NEARLY and self.pool.is_for_part(one.members)]
        least = min((one.trial for one in own), default=(np.inf, np.inf))
        near = [one for one in own if self._may_reach(least, one, (_MEAN_MARGIN, _MEAN_MARGIN))]
        best = min(self._settled(near, executor), key=lambda one: one.key, default=None)
        if best is not None and best.result is None:
            (best.result,) = self._run(measure, [best], executor)
        return best

    def _on_national(self, maps: list[_Map], best: list[_Map], executor: Executor | None) -> list[str]:
        """What the country's own system has against the first, where that is not the country's own."""
        own = [one for one in maps if one.standing.national]
        if not own or not best or best[0].standing.national or self.area == "intersects":
            return []
        one = next((one for one in best if one.standing.national), min(own, key=lambda one: self._told(*one.trial)))
        (figure,) = self._run(settle, [one], executor)
        if isinstance(figure, Rejected):
            return []
        first, name = best[0], self.ranking.name
        counts = f"{one.first.code}, the best of those of {self.pool.home}, counts {one.weight * figure:.5g} by {name}"
        return [f"{counts}, {first.first.code} {first.weight * first.found[0]:.5g}."]

    def _candidate(self, one: _Map, custom: tuple[Custom, ...]) -> Candidate:
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


def _number(value: float) -> float:
    """The value, or infinity for NaN."""
    return value if np.isfinite(value) else np.inf
