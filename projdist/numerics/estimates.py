"""Figures with their errors."""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["Estimate"]


class Estimate(NamedTuple):
    """A figure and by how much it may be wrong; NaN where it is not defined, or has no bound."""

    value: float
    error: float

    def root(self) -> Estimate:
        """The square root; rounding may have left a square of nothing below 0."""
        if not math.isfinite(self.value):
            return Estimate(math.nan, math.nan)
        square = max(self.value, 0.0)
        root = math.sqrt(square)
        return Estimate(root, 0.0 if self.error <= 0 else self.error / (root + math.sqrt(square + self.error)))
