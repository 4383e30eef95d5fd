"""Finite distortion of a map over a region: its answers, and the draws of pairs of points that it is a mean over.

All means are by true area over pairs of points that are independent of each other. Two sets of points are
strewn (`scatter`), and a quarter of one is paired with a quarter of the other, each with each; that sixteen
times. The spread of the sixteen makes the error, a standard error, so that it is honest for maps with
cuts and with poles at infinity, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.answers.pairs import Points, scatter_over
from projdist.projections import Projection, ProjectionLike
from projdist.regions import Place, RegionLike, region_for
from projdist.support import Answer, check_number, check_whole_number, plain

__all__ = ["DEFAULT_TOLERANCE", "FiniteDistortion", "Found", "Question", "groups"]

DEFAULT_TOLERANCE = 5e-3  # of the value, for polygons; on whole globes the first sets give 1e-4 of a distance measure
_DRAWS = 16  # the error itself is good to a fifth
_GROUPS = 4  # for as many pairs, twice the points: up to half the error, and matrices that fit a processor's cache


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FiniteDistortion(Answer):
    """A measure of finite distortion: its value, its standard error, and what it was taken over.

    `pairs` of points were measured. `coverage` is the share of the region's area that is on the map,
    of `great_circle_bending` that of geodesics; pairs beyond do not count. What is undefined is NaN.
    """

    projection: Projection
    given: str
    region: Place
    measure: str
    value: float
    error: float
    pairs: int
    coverage: float

    def _line(self) -> str:
        return f"{self.projection.name} over {self.region.name}: {self.measure} {self.value:.4g} ± {self.error:.1g}"

    def to_dict(self) -> dict[str, Any]:
        """The fields by name; what is undefined is None."""
        return self._row() | {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "value": plain(self.value),
            "error": plain(self.error),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "projection": self.given,
            "name": self.projection.name,
            "definition": self.projection.definition,
            "region": self.region.name,
            "measure": self.measure,
            "value": self.value,
            "error": self.error,
            "pairs": self.pairs,
            "coverage": self.coverage,
        }

    def _table(self) -> list[dict[str, Any]]:
        return [self._row()]


class Found(NamedTuple):
    """Figures (m,) of one draw, the number of its pairs, and the share of what was drawn that is on the map."""

    values: FloatArray
    pairs: int
    coverage: float


def groups(one: Points, other: Points, rng: np.random.Generator | None) -> Iterator[tuple[IntArray, IntArray]]:
    """The numbers of the points that are paired each with each: every fourth of one set, every fourth of the other.

    Which fourths are paired is random: points come in the order of places, and all pairs of places must be as
    likely. Without a generator all points are paired.
    """
    count, turn = (1, 0) if rng is None else (_GROUPS, int(rng.integers(_GROUPS)))
    for group in range(count):
        yield np.arange(group, one.lon.size, count), np.arange((group + turn) % count, other.lon.size, count)


@dataclass(frozen=True)
class Question:
    """A map and a region, as they were given and as they are."""

    projection: Projection
    given: str
    region: Place

    @staticmethod
    def of(projection: ProjectionLike, region: RegionLike | None) -> Question:
        """Raises ProjectionError, and ValueError for an unknown region."""
        given = projection if isinstance(projection, str) else None
        projection = Projection.from_user_input(projection)
        return Question(projection, given or projection.label, region_for(region, [projection]))

    def answers(self, measures: Sequence[str], found: Found, errors: FloatArray) -> list[FiniteDistortion]:
        """The answers to it."""
        return [
            FiniteDistortion(
                projection=self.projection,
                given=self.given,
                region=self.region,
                measure=measure,
                value=value,
                error=error,
                pairs=found.pairs,
                coverage=found.coverage,
            )
            for measure, value, error in zip(measures, found.values.tolist(), errors.tolist(), strict=True)
        ]

    def estimates(
        self,
        measures: Sequence[str],
        figures: Callable[[Points, Points, np.random.Generator], Found],
        sizes: tuple[int, ...],
        tolerance: float,
        seed: int,
    ) -> list[FiniteDistortion]:
        """The means of figures of two sets of points over draws, and their standard errors."""
        if not check_number("tolerance", tolerance) > 0.0:
            raise ValueError(f"Invalid tolerance '{tolerance:g}'. It must be positive.")
        rng = np.random.default_rng(check_whole_number("seed", seed))
        scatter = scatter_over(self.region, self.projection.ellipsoid)
        for size in sizes:
            found = [figures(scatter.draw(size, rng), scatter.draw(size, rng), rng) for _ in range(_DRAWS)]
            values, pairs, coverages = (np.array(column) for column in zip(*found, strict=True))
            means, errors = values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(_DRAWS)
            if not errors[0] > tolerance * abs(means[0]):
                break
        return self.answers(measures, Found(means, int(pairs.sum()), float(coverages.mean())), errors)
