"""What a low-distortion projection shall be good at, and the scale on its axis that is best for it, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray

__all__ = ["LDP_CRITERIA", "Factors", "Goal", "Order", "rms_scale"]

Factors = FloatArray  # combined factors with k_0 = 1
Best = Callable[[Factors, FloatArray, float, float], float]
Order = tuple[float, float]
Ordering = Callable[[FloatArray, FloatArray, float], Order]


def rms_scale(q: Factors, w: FloatArray) -> float:
    """The k_0 of least RMS distortion."""
    return float(np.sum(w * q) / np.sum(w * q * q))


def _least_square(q: Factors, w: FloatArray, target: float, unit: float) -> float:
    return rms_scale(q, w) / unit


def _middle(q: Factors, w: FloatArray, target: float, unit: float) -> float:
    return float(2.0 / (q.max() + q.min())) / unit


def _crowded(q: Factors, w: FloatArray, target: float, unit: float) -> float:
    """The multiple with the most weight of points within the target; of all that have as much that of least RMS.

    A point is within it for k_0 from (1 - t) / q to (1 + t) / q: where most of these ranges of whole multiples overlap
    is found in one walk along their ends.
    """
    usual = rms_scale(q, w) / unit
    first, beyond = np.ceil((1.0 - 1e-6 * target) / q / unit), np.floor((1.0 + 1e-6 * target) / q / unit) + 1.0
    held = first < beyond
    if not held.any():
        return usual
    ends, place = np.unique(np.concatenate([first[held], beyond[held]]), return_inverse=True)
    inside = np.cumsum(np.bincount(place, np.concatenate([w[held], -w[held]])))
    # Rounding of the sums makes shares that are the same differ by 1e-13.
    most = np.flatnonzero(inside[:-1] > inside[:-1].max() - 1e-12)
    nearest = np.clip(np.round(usual), ends[most], ends[most + 1] - 1.0)
    return float(nearest[np.argmin(np.abs(nearest - usual))])


def _rms(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(np.sum(w * ppm * ppm)))


def _share_order(ppm: FloatArray, w: FloatArray, target: float) -> Order:
    # Shares that differ by rounding only are the same.
    return -round(float(np.sum(w[np.abs(ppm) <= target])), 9), _rms(ppm, w)


def _minimax_order(ppm: FloatArray, w: FloatArray, target: float) -> Order:
    return float(np.abs(ppm).max()), _rms(ppm, w)


def _rms_order(ppm: FloatArray, w: FloatArray, target: float) -> Order:
    return _rms(ppm, w), 0.0


LDP_CRITERIA: dict[str, tuple[Best, Ordering]] = {
    "share": (_crowded, _share_order),
    "minimax": (_middle, _minimax_order),
    "rms": (_least_square, _rms_order),
}


class Goal(NamedTuple):
    """A criterion, the target in ppm that some have, and what k_0 is a multiple of."""

    criterion: str
    target: float
    round_k: float

    def order(self, ppm: FloatArray, weight: FloatArray) -> Order:
        """How good distortions are; less is better."""
        return LDP_CRITERIA[self.criterion][1](ppm, weight, self.target)

    def rounded_scale(self, q: Factors, weight: FloatArray) -> tuple[float, Order]:
        """The best multiple of `round_k`, and how good it is."""
        multiple = LDP_CRITERIA[self.criterion][0](q, weight, self.target, self.round_k)
        # The largest and the mean of squares are convex in k_0: the best multiple is next to the best of all.
        options = np.unique([np.floor(multiple), np.ceil(multiple)]) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = min(range(len(orders)), key=lambda index: orders[index])
        return float(options[best]), orders[best]
