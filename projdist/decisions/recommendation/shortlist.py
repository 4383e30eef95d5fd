"""The best of many maps by few measurements in full, so that the order is that of measuring all.

A trial tells each map's figure to a few per cent; only those that may be among the best by it are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist.decisions.recommendation.candidate_crs import Pool
from projdist.decisions.recommendation.candidates import Distortion, Finding, Full, Probe, Rejected, measure, settle
from projdist.decisions.recommendation.preference import Key, Standing, is_close, preferred, tiers
from projdist.field import FIGURES, Figure
from projdist.support import run_all

LEVEL = FIGURES["airy_kavrayskiy"]
"""The figure that decides where others vanish."""

# A trial's mean is good to a few per cent (6 on the globe, whose poles it leaves out), its maximum never too large.
_MEAN_MARGIN, _MAXIMUM_MARGIN = 0.7, 0.99
_SAFETY = 0.9  # of the least ratio of a full measurement to its trial so far
_WAVE = 16  # maps in one go: more than there are cores, fewer than there are maps

Hears = Callable[[int], None] | None


@dataclass(kw_only=True)
class Contender:
    """The CRSs of one map, the one to name first, and what is known of it."""

    members: list[Finding]
    standing: Standing
    weight: float  # what its figure counts
    level: float  # its Airy-Kavrayskiy error by its trial
    key: Key = (np.inf, np.inf)  # what it counts by its figure in full, then by its level
    result: tuple[float, Distortion] | None = None  # the figure in full, and all that is told of it

    @property
    def first(self) -> Finding:
        """The CRS to name first."""
        return self.members[0]

    @property
    def found(self) -> tuple[float, Distortion]:
        """The figure in full and all that is told of it, once measured."""
        assert self.result is not None
        return self.result

    @property
    def trial(self) -> tuple[float, float]:
        """What it counts by its trial: by the figure, then by its level."""
        return self.weight * or_infinity(self.first.value), self.weight * self.level


class Contest:
    """Maps of a pool for a figure, of which those within `close` of each other are as good.

    What cannot be measured in full is added to `rejected`.
    """

    def __init__(
        self,
        pool: Pool,
        probe: Probe,
        ranking: Figure,
        *,
        close: float,
        uninterrupted: bool,
        executor: Executor | None,
    ) -> None:
        self.pool, self.probe, self.ranking = pool, probe, ranking
        self.close, self.uninterrupted, self.executor = close, uninterrupted, executor
        self.rejected: list[Rejected] = []

    def best(self, maps: list[Contender], limit: int | None, hears: Hears) -> list[Contender]:
        """The best maps in order: figures in full until no other can be among them, then all that is told of them."""
        margins = [_MAXIMUM_MARGIN if self.ranking.is_maximum else _MEAN_MARGIN, _MEAN_MARGIN]
        wanted = len(maps) if limit is None else min(limit, len(maps))
        waiting = sorted(maps, key=lambda one: self.told(*one.trial))
        done: list[Contender] = []
        while waiting:
            least = self._least_of_last(done, wanted)
            chosen = [one for one in waiting if self._may_reach(least, one, margins)][: max(wanted - len(done), _WAVE)]
            if not chosen:
                break
            waiting = [one for one in waiting if one not in chosen]
            settled = self._settled(chosen)
            margins = [min(pair) for pair in zip(margins, self._margins(settled), strict=True)]
            done += settled
        best = [one for tier in self._tiers(done) for one in tier][:wanted]
        for one, result in zip(best, self._run(measure, best, hears), strict=True):
            one.result = result
        return best

    def winner(self, maps: list[Contender]) -> Contender | None:
        """The best of a few maps by its figure alone, measured in full."""
        least = min((one.trial for one in maps), default=(np.inf, np.inf))
        near = [one for one in maps if self._may_reach(least, one, (_MEAN_MARGIN, _MEAN_MARGIN))]
        best = min(self._settled(near), key=lambda one: one.key, default=None)
        if best is not None and best.result is None:
            (best.result,) = self._run(measure, [best])
        return best

    def figure_of(self, one: Contender) -> float | None:
        """The figure of a map in full, None where it cannot be measured."""
        (figure,) = self._run(settle, [one])
        return None if isinstance(figure, Rejected) else figure

    def told(self, figure: float, level: float) -> tuple[float, float]:
        """What maps are ordered by: figures that are no more than rounding are a tie, and the levels decide."""
        return self.ranking.without_rounding(figure), level

    def _tiers(self, done: list[Contender]) -> list[list[Contender]]:
        """Maps in groups that are close, each in the order of preference."""
        found = []
        for tier in tiers([one.key for one in done], self.close):
            members = [done[i] for i in tier]
            order = preferred([one.standing for one in members], [one.key for one in members])
            found.append([members[i] for i in order])
        return found

    def _least_of_last(self, done: list[Contender], wanted: int) -> Key:
        """The least key of the tier in which the last of those wanted is: what is close to it may come before."""
        count = 0
        for tier in self._tiers(done):
            count += len(tier)
            if count >= wanted:
                return min(one.key for one in tier)
        return np.inf, np.inf

    def _may_reach(self, least: Key, one: Contender, margins: Sequence[float]) -> bool:
        """Whether a map may come before the best of a tier, or close to it."""
        figure, level = (margin * value for margin, value in zip(margins, one.trial, strict=True))
        key = self.told(figure, level)
        return key <= least or is_close(key, least, self.close)

    def _settled(self, maps: list[Contender]) -> list[Contender]:
        """The maps that have a figure in full, with their keys; where that vanishes, with their levels in full."""
        settled = []
        for one, figure in zip(maps, self._run(settle, maps), strict=True):
            if isinstance(figure, Rejected):
                self.rejected.append(figure)
                continue
            one.key = self.told(one.weight * or_infinity(figure), one.trial[1])
            settled.append(one)
        tied = [one for one in settled if one.key[0] == 0.0]
        for one, level in zip(tied, self._run(settle, tied, ranking=LEVEL), strict=True):
            one.key = 0.0, one.weight * or_infinity(level)
        return settled

    def _margins(self, settled: list[Contender]) -> list[float]:
        """How far below their trials measurements may be, by those in full: of figures, and of levels."""
        pairs = [[(one.key[0], one.trial[0]) for one in settled if 0.0 < one.key[0] < np.inf]]
        pairs += [[(one.key[1], one.trial[1]) for one in settled if one.key[0] == 0.0 and one.key[1] < np.inf]]
        return [min((_SAFETY * full / trial for full, trial in kind if trial > 0.0), default=np.inf) for kind in pairs]

    def _run(
        self,
        function: Callable[[Full], Any],
        maps: list[Contender],
        hears: Hears = None,
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
        return run_all(self.executor, function, tasks, hears)


def or_infinity(value: float) -> float:
    """The value, or infinity for NaN."""
    return value if np.isfinite(value) else np.inf
