"""What is known in a search, a goal at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.field.extremes.goals import Goal

__all__ = ["NOBODY", "Chosen", "State"]


class State:
    """What is known in the search for one goal: what it reaches for certain, a bound, and the pieces in question."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.live = np.empty(0, dtype=int)  # pieces to be looked at
        self.good: list[Chosen] = []  # whose polynomials are good enough
        self.rough: list[Chosen] = []  # which have none that are
        self.known = -np.inf
        self.known_at: tuple[float, float] | None = None
        self.bound = -np.inf  # of all that was looked at and left
        self.exact = 0.0  # what is no more than rounding
        self.places: list[tuple[float, float]] = []  # where it may be largest

    def raise_bound(self, bounds: FloatArray) -> None:
        """What is left has so high bounds."""
        self.bound = max(self.bound, float(bounds.max(initial=-np.inf)))


class Chosen(NamedTuple):
    """Pieces, a goal's bounds there, and its errors."""

    piece: IntArray
    bound: FloatArray
    error: FloatArray

    @staticmethod
    def joined(parts: Sequence[Chosen]) -> Chosen:
        """All pieces of some."""
        return Chosen(*(np.concatenate(part) for part in zip(NOBODY, *parts, strict=True)))


NOBODY = Chosen(np.empty(0, dtype=int), np.empty(0), np.empty(0))
