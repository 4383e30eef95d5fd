"""What a low-distortion projection shall be good at, and the scale on its axis that is best for it, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray

__all__ = ["LDP_CRITERIA", "Factors", "Goal", "Order", "rms_scale"]

Factors = FloatArray  # combined factors with k_0 = 1
Best = Callable[[Factors, FloatArray, float], float]
Order = tuple[float, float]
Ordering = Callable[[FloatArray, FloatArray, float], Order]


def rms_scale(q: Factors, w: FloatArray, target: float = 0.0) -> float:
    """The k_0 of least RMS distortion."""
    return float(np.sum(w * q) / np.sum(w * q * q))


def _middle_scale(q: Factors, w: FloatArray, target: float) -> float:
    return float(2.0 / (q.max() + q.min()))


def _crowded_scale(q: Factors, w: FloatArray, target: float) -> float:
    """The k_0 with the most weight of points within the target; of all that have as much the one of least RMS.

    A point is within it for k_0 from (1 - t) / q to (1 + t) / q: where most of these intervals overlap is found in one
    walk along their ends.
    """
    ends = np.concatenate([(1.0 - 1e-6 * target) / q, (1.0 + 1e-6 * target) / q])
    order = np.argsort(ends)
    inside = np.cumsum(np.concatenate([w, -w])[order])
    # Rounding of the sums makes shares that are the same differ by 1e-13.
    most = inside > inside.max() - 1e-12
    first = int(np.argmax(most))
    last = first + int(np.argmin(most[first:]))
    return float(np.clip(rms_scale(q, w), ends[order[first]], ends[order[last]]))


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
    "share": (_crowded_scale, _share_order),
    "minimax": (_middle_scale, _minimax_order),
    "rms": (rms_scale, _rms_order),
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
        """The multiple of `round_k` next to the best scale that is best itself, and how good it is."""
        scale = LDP_CRITERIA[self.criterion][0](q, weight, self.target)
        options = (np.floor(scale / self.round_k) + np.arange(2)) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = int(orders[1] < orders[0])
        return float(options[best]), orders[best]
