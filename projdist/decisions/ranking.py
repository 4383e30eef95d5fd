"""Purposes of maps, which of several CRSs and maps comes first, and the shortlist that is measured in full."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from projdist.decisions.candidate_crs import LEVEL, Candidate, CandidatePool, Key, or_infinity
from projdist.decisions.map_info import PROPERTIES, WeightedPoints
from projdist.decisions.measurement import FullMeasurement, Rejected, evaluate, measure
from projdist.field import Figure
from projdist.projections import AUTHORITIES, VARIANT, CrsRecord, datum_root
from projdist.support import Registry, listed, run_all

PURPOSES = ("any", *PROPERTIES, "compromise")


def get_purpose(name: str) -> str:
    """The purpose of a name; raises ValueError with close matches."""
    purposes = {purpose: purpose for purpose in PURPOSES}
    return Registry("purpose", purposes, rule=f"It must be {listed(PURPOSES, 'or')}.").named(name)


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """True if a map with these properties serves the purpose; a compromise has none of them."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)


# ---- CRSs of the same map ------------------------------------------------------------------------

_CLOSE = 0.01  # of the trials' figures: a sphere and an ellipsoid differ by half of that on a map of the world
_ALIKE = 1e-7  # of J: the same map by another method or with other parameters
_NEAR = 1e-4  # of the trials' figures: alike maps differ by no more


Size = Callable[[Candidate], float]


def grouped(candidates: Sequence[Candidate], size: Size = lambda one: one.trial.value) -> list[list[Candidate]]:
    """Candidates grouped by the map that they draw, under any datum; `size` is the figure that agrees in a group."""
    # Figures that vanish are rounding, and do not agree.
    by_conversion: dict[Any, list[Candidate]] = {}
    for one in candidates:
        by_conversion.setdefault((one.trial.conversion, one.keeps), []).append(one)
    parts = [part for group in by_conversion.values() for part in _close(group, size)]
    return _merged(sorted(parts, key=lambda group: size(group[0])), size)


def by_usage(group: Sequence[Candidate], records: Mapping[str, CrsRecord]) -> list[Candidate]:
    """CRSs of one map in the order in which a surveyor of the region's country would name them."""
    datums = {one.datum for one in group}
    since: dict[str, int] = {}  # the year of a datum, whose realisations count as one
    for one in group:
        root = datum_root(one.datum)
        since[root] = max(since.get(root, 0), one.since)

    def rank(one: Candidate) -> tuple[Any, ...]:
        authority, _, code = one.code.partition(":")
        return (
            not one.national,
            not one.holds,
            not one.trial.modern,
            one.special,
            -since[datum_root(one.datum)],
            AUTHORITIES.index(authority),
            not one.trial.upright,
            bool(VARIANT.search(records[one.code].name)),
            any(_realises(one.datum, other) for other in datums),
            not one.trial.positive,
            round(records[one.code].extent_km2),
            len(code),
            code,
        )

    return sorted(group, key=rank)


def _realises(datum: str, other: str) -> bool:
    """True if a datum's name is that of a realisation of the other: NAD83(2011) of NAD83, but not CH1903+ of CH1903."""
    return datum.startswith(other) and datum.removeprefix(other).lstrip().startswith(("(", "/"))


def _close(group: list[Candidate], size: Size) -> list[list[Candidate]]:
    """Candidates of one conversion in groups of the same figure, on any ellipsoid."""
    return _runs(sorted(group, key=size), lambda one, first: size(one) <= (1.0 + _CLOSE) * size(first))


def _runs(ordered: Sequence[Candidate], is_close: Callable[[Candidate, Candidate], bool]) -> list[list[Candidate]]:
    """Sorted candidates in groups of those that are close to the first of the group."""
    runs: list[list[Candidate]] = []
    for one in ordered:
        if runs and is_close(one, runs[-1][0]):
            runs[-1].append(one)
        else:
            runs.append([one])
    return runs


def _merged(groups: list[list[Candidate]], size: Size) -> list[list[Candidate]]:
    """Groups, sorted by size, of which those with the same Jacobians are joined."""
    merged: list[list[Candidate]] = []
    for group in groups:
        one = group[0]
        for other in reversed(merged):
            if not size(other[0]) >= (1.0 - _NEAR) * size(one):
                merged.append(group)
                break
            if np.allclose(other[0].trial.jacobian, one.trial.jacobian, rtol=0.0, atol=_ALIKE, equal_nan=True):
                other += group
                break
        else:
            merged.append(group)
    return merged


# ---- maps that are close -------------------------------------------------------------------------

CLOSE = 0.1
"""Relative difference of figures of maps that are as good as each other.

Official systems and what they replaced, or the zone beside, differ by a few per cent; a tenth of a few hundred ppm is
what the ground's height does to distances within 200 m.
"""

WIDE_FACTOR = 2.0
"""The factor by which a map of the world or a continent must be better than a national one, or a zone."""


def weight_of(one: Candidate, least_share: float) -> float:
    """The factor of a map's figures; `least_share` of the region counts as all of it."""
    return (1.0 if one.share >= least_share else 1.0 / one.share) * (WIDE_FACTOR if one.wide else 1.0)


def is_close(key: Key, least: Key, close: float) -> bool:
    """True if a key is within `close` of the least one; levels count only if both figures vanish."""
    if least[0] > 0.0:
        return key[0] <= (1.0 + close) * least[0]
    return key[0] == 0.0 and key[1] <= (1.0 + close) * least[1]


def tiers(maps: Sequence[Candidate], close: float) -> list[list[Candidate]]:
    """Groups of maps whose keys are close to the best of the group: best group first, each in order of preference."""
    ordered = sorted(maps, key=lambda one: one.key)
    return [preferred(tier) for tier in _runs(ordered, lambda one, first: is_close(one.key, first.key, close))]


def in_force(maps: Sequence[Candidate]) -> list[Candidate]:
    """National maps for general use, on the latest of their datums, or on one whose year is unknown."""
    latest = _latest(maps)
    return [one for one in maps if latest is not None and _is_general(one) and not _is_outdated(one, latest)]


def preferred(maps: Sequence[Candidate]) -> list[Candidate]:
    """Close maps in order of preference: national, for general use, on the datum in force, with the least key."""
    latest = _latest(maps)

    def rank(one: Candidate) -> tuple[Any, ...]:
        outdated = latest is not None and _is_outdated(one, latest)
        figure = float(f"{one.key[0] or one.key[1]:.9g}")  # maps of the world that are turned differ by rounding
        return not one.national, one.special, outdated, figure, one.code

    return sorted(maps, key=rank)


def _latest(maps: Sequence[Candidate]) -> Candidate | None:
    """The national map for general use on the latest datum."""
    return max(filter(_is_general, maps), key=lambda one: one.since, default=None)


def _is_general(one: Candidate) -> bool:
    return one.national and not one.special


def _is_outdated(one: Candidate, latest: Candidate) -> bool:
    """True if the datum is known to be older, and is not another realisation of the latest."""
    return 0 < one.since < latest.since and datum_root(one.datum) != datum_root(latest.datum)


# ---- shortlist -----------------------------------------------------------------------------------

# The mean of a trial is good to a few per cent (6 on the globe, without the poles), its maximum is never too large.
_MEAN_MARGIN, _MAXIMUM_MARGIN = 0.7, 0.99
_SAFETY = 0.9  # of the least ratio of a full measurement to its trial so far
_WAVE = 16  # maps measured at a time: more than there are cores, fewer than there are maps

OnProgress = Callable[[int], None] | None
"""Called with the number of tasks done."""


@dataclass(kw_only=True)
class Shortlist:
    """The search for the best maps of a pool by a figure; those within `close` of each other are as good."""

    pool: CandidatePool
    probe: WeightedPoints
    ranking: Figure
    close: float
    uninterrupted: bool
    executor: Executor | None = None
    rejected: list[Rejected] = field(default_factory=list)  # maps that cannot be measured in full

    def best(self, maps: Sequence[Candidate], limit: int | None, on_progress: OnProgress) -> list[Candidate]:
        """The best maps in order, with all their figures."""
        return self._measured(self.ordered(maps, limit), on_progress)

    def ordered(self, maps: Sequence[Candidate], limit: int | None) -> list[Candidate]:
        """The best maps in order by their keys: evaluated until no other can be among them."""
        margins = [_MAXIMUM_MARGIN if self.ranking.is_maximum else _MEAN_MARGIN, _MEAN_MARGIN]
        wanted = len(maps) if limit is None else min(limit, len(maps))
        waiting = sorted(maps, key=self.trial_key)
        done: list[Candidate] = []
        while waiting:
            least = self._least_of_last(done, wanted)
            chosen = [one for one in waiting if self._may_reach(least, one, margins)][: max(wanted - len(done), _WAVE)]
            if not chosen:
                break
            codes = {one.code for one in chosen}
            waiting = [one for one in waiting if one.code not in codes]
            evaluated = self._evaluated(chosen)
            margins = [min(pair) for pair in zip(margins, _margins(evaluated), strict=True)]
            done += evaluated
        return [one for tier in tiers(done, self.close) for one in tier][:wanted]

    def winner(self, maps: Sequence[Candidate], measured: Sequence[Candidate]) -> Candidate | None:
        """The best of a few maps by the figure alone, measured in full; it may be among those measured before."""
        least = min((one.trial_key for one in maps), default=(np.inf, np.inf))
        near = [one for one in maps if self._may_reach(least, one, (_MEAN_MARGIN, _MEAN_MARGIN))]
        best = min(self._evaluated(near), key=lambda one: one.key, default=None)
        if best is None:
            return None
        return next((one for one in measured if one.code == best.code), None) or self._measured([best])[0]

    def figure_of(self, one: Candidate) -> float | None:
        """The fully measured figure of a map, None where it cannot be measured."""
        (figure,) = self._run(evaluate, [one])
        return None if isinstance(figure, Rejected) else figure

    def trial_key(self, one: Candidate) -> Key:
        """The key of a map by its trial."""
        return self._key(*one.trial_key)

    def _key(self, figure: float, level: float) -> Key:
        """The key of a figure, 0 if it is only rounding, and a level."""
        return self.ranking.without_rounding(figure), level

    def _least_of_last(self, done: Sequence[Candidate], wanted: int) -> Key:
        """Lowest key of the tier that holds the last wanted map: maps close to it may still come before."""
        count = 0
        for tier in tiers(done, self.close):
            count += len(tier)
            if count >= wanted:
                return min(one.key for one in tier)
        return np.inf, np.inf

    def _may_reach(self, least: Key, one: Candidate, margins: Sequence[float]) -> bool:
        """True if a map may come before the best of a tier, or close to it."""
        key = self._key(*(margin * value for margin, value in zip(margins, one.trial_key, strict=True)))
        return key <= least or is_close(key, least, self.close)

    def _evaluated(self, maps: Sequence[Candidate]) -> list[Candidate]:
        """Maps with keys by their figures measured in full, or by their levels where the figures vanish."""
        found = []
        for one, figure in zip(maps, self._run(evaluate, maps), strict=True):
            if isinstance(figure, Rejected):
                self.rejected.append(figure)
            else:
                found.append(replace(one, key=self._key(one.weight * or_infinity(figure), one.trial_key[1])))
        tied = [n for n, one in enumerate(found) if one.key[0] == 0.0]
        levels = self._run(evaluate, [found[n] for n in tied], ranking=LEVEL)
        for n, level in zip(tied, levels, strict=True):
            found[n] = replace(found[n], key=(0.0, found[n].weight * or_infinity(level)))
        return found

    def _measured(self, maps: Sequence[Candidate], on_progress: OnProgress = None) -> list[Candidate]:
        """Maps with all their figures."""
        found = self._run(measure, maps, on_progress)
        return [
            replace(one, value=v, ranked=one.weight * v, distortion=d) for one, (v, d) in zip(maps, found, strict=True)
        ]

    def _run(
        self,
        function: Callable[[FullMeasurement], Any],
        maps: Sequence[Candidate],
        on_progress: OnProgress = None,
        ranking: Figure | None = None,
    ) -> list[Any]:
        """A measurement of each map, by the figure of the search or another."""
        region, figure, whole = self.pool.region, ranking or self.ranking, self.uninterrupted
        tasks = [
            FullMeasurement(one.code, one.name, region, self.probe, one.keeps, one.trial.level, figure, whole)
            for one in maps
        ]
        return run_all(self.executor, function, tasks, on_progress)


def _margins(evaluated: Sequence[Candidate]) -> list[float]:
    """Bounds for the ratios of full figures, and of levels, to those of trials, from the maps evaluated so far."""
    pairs = [[(one.key[0], one.trial_key[0]) for one in evaluated if 0.0 < one.key[0] < np.inf]]
    pairs += [[(one.key[1], one.trial_key[1]) for one in evaluated if one.key[0] == 0.0 and one.key[1] < np.inf]]
    return [min((_SAFETY * full / trial for full, trial in kind if trial > 0.0), default=np.inf) for kind in pairs]
