"""The best existing CRS for a region: every candidate of PROJ's database, measured and ranked.

A cheap trial at two hundred nodes gives each candidate's figure to a few per cent; only those that
may be among the best by it are measured in full, so that the order is that of measuring all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from projdist import hints
from projdist.answer import Answer, plain
from projdist.candidates import Distortion, Finding, Full, Rejected, Trial, measure, settle, try_crs
from projdist.custom import Custom, Design, check_customizable, design, families_for
from projdist.executors import own_executor, run_all
from projdist.probe import Probe, probe_of, shares_within
from projdist.projections.database import AUTHORITIES, CrsRecord, check_authorities, crs_records, reasons_against
from projdist.regions import Place, PointSet, Region, get_region
from projdist.suitability import RANKINGS, Ranking, get_purpose, get_ranking, suits
from projdist.twins import by_usage, grouped

__all__ = ["AREAS", "Candidate", "Recommendation", "recommend"]

AREAS = ("preferred", "contains", "intersects")
"""How a CRS's area of use counts: the more of the region it holds the better, it must hold it, or it need not."""

Progress = Callable[[int, int], None]

_HOLDS = 0.99  # of the region: areas of use are rounded, and so are boxes
_TOUCHES = 0.25  # of the region: a CRS for less was not made for it
# A trial's mean is good to a few per cent (6 on the globe, whose poles it leaves out), its maximum never too large.
_MEAN_MARGIN, _MAXIMUM_MARGIN = 0.7, 0.99
_SAFETY = 0.9  # of the least ratio of a full measurement to its trial so far
_WAVE = 16  # maps in one go: more than there are cores, fewer than there are maps
_HEAVY = 24  # trials that a custom projection takes as long as, at least

_LEVEL = RANKINGS["airy_kavrayskiy"]


# ---- answers --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Candidate:
    """A CRS over a region, with all CRSs that draw the same map under other datums.

    `value` is the figure of the criterion, `share` the share of the region within the area of use,
    `keeps` what the map keeps true to 0.1 ppm. `ratio_to_custom` and `difference_to_custom` are the figure over, and
    less, that of the best custom projection; None without one, the ratio also where that is no more than rounding.
    """

    code: str
    name: str
    method: str
    datum: str
    value: float
    distortion: Distortion
    keeps: tuple[str, ...]
    share: float
    area_of_use: tuple[float, float, float, float]
    area_name: str
    same: tuple[tuple[str, str], ...]
    ratio_to_custom: float | None = None
    difference_to_custom: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": plain(self.value),
            **{name: plain(value) for name, value in asdict(self.distortion).items()},
            "keeps": list(self.keeps),
            "share_in_area_of_use": self.share,
            "area_of_use": {"bounds": list(self.area_of_use), "name": self.area_name},
            "same": [{"code": code, "name": name} for code, name in self.same],
            "ratio_to_custom": plain(self.ratio_to_custom),
            "difference_to_custom": plain(self.difference_to_custom),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": self.value,
            **asdict(self.distortion),
            "keeps": " ".join(self.keeps),
            "share_in_area_of_use": self.share,
            "area_of_use": self.area_name,
            "same": " ".join(code for code, _ in self.same),
            "ratio_to_custom": self.ratio_to_custom,
            "difference_to_custom": self.difference_to_custom,
            "proj": "",
        }


@dataclass(frozen=True)
class Recommendation(Answer):
    """The best CRSs for a region, best first, and those that are none, with the reasons.

    `candidates` is the number of CRSs that were considered, `maps` that of different maps among them
    that serve the purpose. `custom` are the best custom projections of families, best first, where they were asked for,
    and `not_custom` the families that have none, with the reasons. A frame has the results and the custom ones.
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

    def to_dict(self) -> dict[str, Any]:
        """The question; `"results"`, `"custom"`, `"not_custom"` and `"rejected"` are lists."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "purpose": self.purpose,
            "criterion": self.criterion,
            "area": self.area,
            "candidates": self.candidates,
            "maps": self.maps,
            "results": [result.to_dict() for result in self.results],
            "custom": [custom.to_dict() for custom in self.custom],
            "not_custom": [{"family": one.name, "reason": one.reason} for one in self.not_custom],
            "rejected": [asdict(rejected) for rejected in self.rejected],
        }

    def rows(self) -> list[dict[str, Any]]:
        """The results as flat rows, names and numbers; then the custom projections, without a code, by PROJ string."""
        return self._table()

    def _table(self) -> list[dict[str, Any]]:
        return [result._row() for result in self.results] + [custom._row() for custom in self.custom]


# ---- the question ---------------------------------------------------------------------------


def recommend(
    region: str | Place,
    *,
    purpose: str = "any",
    criterion: str = "airy_kavrayskiy",
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

    `purpose` is any, equal-area, conformal, equidistant or compromise, as the map's field shows it;
    `criterion` one of `projdist.suitability.RANKINGS`; `datum` a part of the name of the geodetic
    CRS; `area` preferred (the figure counts over the share of the region within the area of use),
    contains or intersects. None for `limit` measures all in full. `uninterrupted` leaves out maps that are
    cut within the region (around the Earth: by more than a meridian). `custom` asks for the best custom
    projections, too, for the same purpose and by the same criterion. The work runs on `executor`, or on processes
    of its own where they can be forked; `progress` hears of the steps done and of all. Raises ValueError.
    """
    place = get_region(region)
    if isinstance(place, PointSet):
        raise ValueError(f"Invalid region '{place.name}'. It must be an area: a box, a cap, a country, polygons.")
    ranking = get_ranking(criterion)
    search = _Search(place, get_purpose(purpose), ranking, _check_area(area), _check_limit(limit), progress)
    records = crs_records(check_authorities(authorities), deprecated=deprecated)
    search.uninterrupted = uninterrupted
    if custom:
        check_customizable(ranking.name)
        search.families = families_for(place, search.purpose)
    search.choose(records)
    if executor is not None:
        return search.run(executor, datum)
    with own_executor(len(search.records) + _HEAVY * len(search.families)) as pool:
        return search.run(pool, datum)


def _check_area(area: str) -> str:
    if area not in AREAS:
        raise ValueError(f"Invalid area '{area}'. It must be {hints.listed(AREAS, 'or')}.")
    return area


def _check_limit(limit: int | None) -> int | None:
    if limit is not None and limit < 1:
        raise ValueError(f"Invalid limit '{limit}'. It must be at least 1.")
    return limit


@dataclass
class _Map:
    """The CRSs of one map, the one to name first, and what is known of it."""

    members: list[Finding]
    share: float
    weight: float  # what its figure counts
    level: float  # its Airy-Kavrayskiy error by its trial
    key: tuple[float, float] = (np.inf, np.inf)  # what it counts by its figure in full, then by its level
    result: Distortion | None = None

    @property
    def first(self) -> Finding:
        return self.members[0]

    @property
    def trial(self) -> tuple[float, float]:
        """What it counts by its trial: by the figure, then by its level."""
        return self.weight * _number(self.first.value), self.weight * self.level


class _Search:
    """A search for the best: the candidates, their trials, the maps among them, the best of these in full."""

    def __init__(
        self,
        region: Region,
        purpose: str,
        ranking: Ranking,
        area: str,
        limit: int | None,
        progress: Progress | None,
    ) -> None:
        self.region, self.purpose, self.ranking, self.area, self.limit = region, purpose, ranking, area, limit
        self.progress = progress
        self.probe: Probe = probe_of(region)
        self.records: dict[str, CrsRecord] = {}
        self.shares: dict[str, float] = {}
        self.rejected: list[Rejected] = []
        self.uninterrupted = False
        self.families: list[str] = []  # of custom projections

    def choose(self, records: Sequence[CrsRecord]) -> None:
        """Keep the records whose area of use is that of the region; reject those that touch it."""
        least = _HOLDS if self.area == "contains" else _TOUCHES
        bounds = list(dict.fromkeys(record.area_of_use for record in records))
        shares = dict(zip(bounds, shares_within(self.region, bounds).tolist(), strict=True))
        for record in records:
            share = shares[record.area_of_use]
            if share >= least:
                self.records[record.code], self.shares[record.code] = record, share
            elif share > 0:
                text = f"Its area of use holds {100 * share:.2g} % of the region."
                self.rejected.append(Rejected(record.code, record.name, text))

    def run(self, executor: Executor | None, datum: str | None) -> Recommendation:
        """Try all, measure the best."""
        unfit = reasons_against(self.records)
        self.rejected += [Rejected(code, self.records[code].name, reason) for code, reason in unfit.items()]
        trials = [
            Trial(code, record.name, self.probe, self.ranking.name)
            for code, record in self.records.items()
            if code not in unfit
        ]
        total = len(trials) + len(self.families) + (self.limit or len(trials))
        found = run_all(executor, try_crs, trials, self._report(0, total))
        findings = [one for one in found if isinstance(one, Finding)]
        self.rejected += [one for one in found if isinstance(one, Rejected)]
        if datum is not None:
            findings = _of_datum(findings, datum)
        maps = [one for one in self._maps(findings) if suits(one.first.keeps, self.purpose)]
        custom, not_custom = self._custom(executor, self._report(len(trials), total))
        best = self._best(maps, executor, len(trials) + len(self.families), total)
        if self.progress is not None:
            self.progress(total, total)
        return Recommendation(
            self.region,
            self.purpose,
            self.ranking.name,
            self.area,
            tuple(self._candidate(one, custom) for one in best),
            tuple(self.rejected),
            len(self.records),
            len(maps),
            custom,
            not_custom,
        )

    def _report(self, before: int, total: int) -> Callable[[int], None] | None:
        """A listener to the number of tasks done, when some were done before."""
        progress = self.progress
        return None if progress is None else lambda done: progress(min(before + done, total), total)

    def _maps(self, findings: list[Finding]) -> list[_Map]:
        """The different maps among findings."""
        maps = []
        holding = {code for code, share in self.shares.items() if share >= _HOLDS}
        for group in grouped(findings, self._size):
            members = by_usage(group, self.records, holding)
            share = self.shares[members[0].code]
            counts = self.area == "preferred" and share < _HOLDS
            maps.append(_Map(members, share, 1.0 / share if counts else 1.0, self._level(members[0])))
        return maps

    def _level(self, one: Finding) -> float:
        """The Airy-Kavrayskiy error by the trial."""
        return _number(_LEVEL(one.jacobian, self.probe.weight))

    def _size(self, one: Finding) -> float:
        """The figure by the trial, or the level where that is no more than rounding."""
        return self.ranking.told(one.value) or self._level(one)

    def _custom(
        self, executor: Executor | None, progress: Callable[[int], None] | None
    ) -> tuple[tuple[Custom, ...], tuple[Rejected, ...]]:
        """The best member of each family, best first, and families without one."""
        tasks = [Design(name, self.region, self.probe, self.ranking.name, self.purpose) for name in self.families]
        found = run_all(executor, design, tasks, progress)
        custom = [one for one in found if isinstance(one, Custom)]
        custom.sort(key=lambda one: (self.ranking.told(_number(one.value)), one.distortion.airy_kavrayskiy))
        return tuple(custom), tuple(one for one in found if isinstance(one, Rejected))

    def _best(self, maps: list[_Map], executor: Executor | None, before: int, total: int) -> list[_Map]:
        """The best maps in order: figures in full until no other can be among them, then all that is told of them."""
        margins = [_MAXIMUM_MARGIN if self.ranking.is_maximum else _MEAN_MARGIN, _MEAN_MARGIN]
        wanted = len(maps) if self.limit is None else min(self.limit, len(maps))
        waiting = sorted(maps, key=lambda one: self._told(*one.trial))
        done: list[_Map] = []
        while waiting:
            bar = done[wanted - 1].key if len(done) >= wanted else (np.inf, np.inf)
            chosen = [one for one in waiting if self._may_reach(bar, one, margins)][: max(wanted - len(done), _WAVE)]
            if not chosen:
                break
            waiting = [one for one in waiting if one not in chosen]
            settled = self._settled(chosen, executor)
            margins = [min(pair) for pair in zip(margins, self._margins(settled), strict=True)]
            done = sorted(done + settled, key=lambda one: one.key)
        best = done[:wanted]
        for one, result in zip(best, self._run(measure, best, executor, self._report(before, total)), strict=True):
            one.result = result
        return best

    def _told(self, figure: float, level: float) -> tuple[float, float]:
        """What maps are ordered by: figures that are no more than rounding are a tie, and the levels decide."""
        return self.ranking.told(figure), level

    def _may_reach(self, bar: tuple[float, float], one: _Map, margins: Sequence[float]) -> bool:
        """Whether a map may come before the bar, or to it; by its level only among figures that vanish."""
        figure, level = (margin * value for margin, value in zip(margins, one.trial, strict=True))
        told = self.ranking.told(figure)
        return told < bar[0] or (told == bar[0] and (told > 0.0 or level <= bar[1]))

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
        ranking: Ranking | None = None,
    ) -> list[Any]:
        """A measurement of each map, for the figure of the search or another."""
        tasks = [
            Full(
                one.first.code,
                self.records[one.first.code].name,
                self.region,
                self.probe,
                one.first.keeps,
                one.level,
                (ranking or self.ranking).name,
                self.uninterrupted,
            )
            for one in maps
        ]
        return run_all(executor, function, tasks, progress)

    def _candidate(self, one: _Map, custom: tuple[Custom, ...]) -> Candidate:
        record = self.records[one.first.code]
        assert one.result is not None
        value = getattr(one.result, self.ranking.name)
        least = custom[0].value if custom else None
        return Candidate(
            record.code,
            record.name,
            one.first.conversion[0],
            one.first.datum,
            value,
            one.result,
            one.first.keeps,
            one.share,
            record.area_of_use,
            record.area_name,
            tuple((other.code, self.records[other.code].name) for other in one.members[1:]),
            value / least if least is not None and least > self.ranking.exact else None,
            value - least if least is not None else None,
        )


def _number(value: float) -> float:
    """The value, or infinity for NaN."""
    return value if np.isfinite(value) else np.inf


def _of_datum(findings: list[Finding], datum: str) -> list[Finding]:
    """Findings whose datum's name has the text in it; raises ValueError, with names that are there, for none."""
    wanted = _plain_name(datum)
    known = {_plain_name(finding.datum): finding.datum for finding in findings}
    if not wanted or not any(wanted in name for name in known):
        close = [known[name] for name in hints.close_words(wanted, known)] if wanted else []
        raise ValueError(
            f"Invalid datum '{datum}'. {hints.did_you_mean(close)}It must be a part of the name of a geodetic CRS "
            "with candidates for the region, as WGS 84 or ETRS89."
        )
    return [finding for finding in findings if wanted in _plain_name(finding.datum)]


def _plain_name(text: str) -> str:
    """A name in small letters and digits only."""
    return "".join(c for c in text.lower() if c.isalnum())
