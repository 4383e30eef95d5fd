"""The best of many maps by few measurements in full, in the order that measuring all would give.

A trial gives each map's figure to a few per cent; only maps that may be among the best by it are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np

from projdist.decisions.map_info import WeightedPoints
from projdist.decisions.recommendation.candidate_crs import LEVEL, Candidate, CandidatePool, Key, or_infinity
from projdist.decisions.recommendation.candidates import FullMeasurement, Rejected, measure, settle
from projdist.decisions.recommendation.preference import is_close, tiers
from projdist.field import Figure
from projdist.support import run_all

# A trial's mean is good to a few per cent (6 on the globe, whose poles it leaves out), its maximum never too large.
_MEAN_MARGIN, _MAXIMUM_MARGIN = 0.7, 0.99
_SAFETY = 0.9  # of the least ratio of a full measurement to its trial so far
_WAVE = 16  # maps measured at a time: more than there are cores, fewer than there are maps

OnProgress = Callable[[int], None] | None
"""Called with the number of tasks done."""


class Shortlist:
    """The search for the best maps of a pool by a figure; those within `close` of each other are as good.

    Maps that cannot be measured in full are added to `rejected`.
    """

    def __init__(
        self,
        pool: CandidatePool,
        probe: WeightedPoints,
        ranking: Figure,
        *,
        close: float,
        uninterrupted: bool,
        executor: Executor | None,
    ) -> None:
        self.pool, self.probe, self.ranking = pool, probe, ranking
        self.close, self.uninterrupted, self.executor = close, uninterrupted, executor
        self.rejected: list[Rejected] = []

    def best(self, maps: Sequence[Candidate], limit: int | None, on_progress: OnProgress) -> list[Candidate]:
        """The best maps in order: evaluated until no other can be among them, then measured."""
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
        return self._measured([one for tier in tiers(done, self.close) for one in tier][:wanted], on_progress)

    def winner(self, maps: Sequence[Candidate], measured: Sequence[Candidate]) -> Candidate | None:
        """The best of a few maps by its figure alone, measured in full unless it is among those that are."""
        least = min((one.trial_key for one in maps), default=(np.inf, np.inf))
        near = [one for one in maps if self._may_reach(least, one, (_MEAN_MARGIN, _MEAN_MARGIN))]
        best = min(self._evaluated(near), key=lambda one: one.key, default=None)
        if best is None:
            return None
        return next((one for one in measured if one.code == best.code), None) or self._measured([best])[0]

    def figure_of(self, one: Candidate) -> float | None:
        """The figure of a map in full, None where it cannot be measured."""
        (figure,) = self._run(settle, [one])
        return None if isinstance(figure, Rejected) else figure

    def trial_key(self, one: Candidate) -> Key:
        """The order of a map by its trial."""
        return self._key(*one.trial_key)

    def _key(self, figure: float, level: float) -> Key:
        """A key by a figure, of which rounding counts as 0, and a level."""
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
        """Maps with keys by their figures in full; where the figure vanishes, by the level in full."""
        found = []
        for one, figure in zip(maps, self._run(settle, maps), strict=True):
            if isinstance(figure, Rejected):
                self.rejected.append(figure)
            else:
                found.append(replace(one, key=self._key(one.weight * or_infinity(figure), one.trial_key[1])))
        tied = [n for n, one in enumerate(found) if one.key[0] == 0.0]
        levels = self._run(settle, [found[n] for n in tied], ranking=LEVEL)
        for n, level in zip(tied, levels, strict=True):
            found[n] = replace(found[n], key=(0.0, found[n].weight * or_infinity(level)))
        return found

    def _measured(self, maps: Sequence[Candidate], on_progress: OnProgress = None) -> list[Candidate]:
        """Maps with all their figures."""
        found = self._run(measure, maps, on_progress)
        return [replace(one, value=v, distortion=d) for one, (v, d) in zip(maps, found, strict=True)]

    def _run(
        self,
        function: Callable[[FullMeasurement], Any],
        maps: Sequence[Candidate],
        on_progress: OnProgress = None,
        ranking: Figure | None = None,
    ) -> list[Any]:
        """A measurement of each map, by the figure of the search or another."""
        tasks = [
            FullMeasurement(
                code=one.code,
                name=one.name,
                region=self.pool.region,
                probe=self.probe,
                keeps=one.keeps,
                level=one.trial.level,
                ranking=ranking or self.ranking,
                uninterrupted=self.uninterrupted,
            )
            for one in maps
        ]
        return run_all(self.executor, function, tasks, on_progress)


def _margins(evaluated: Sequence[Candidate]) -> list[float]:
    """Factors by which figures, and levels, in full may be below those of trials, from the maps evaluated."""
    pairs = [[(one.key[0], one.trial_key[0]) for one in evaluated if 0.0 < one.key[0] < np.inf]]
    pairs += [[(one.key[1], one.trial_key[1]) for one in evaluated if one.key[0] == 0.0 and one.key[1] < np.inf]]
    return [min((_SAFETY * full / trial for full, trial in kind if trial > 0.0), default=np.inf) for kind in pairs]
