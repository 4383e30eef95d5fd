"""What a low-distortion projection shall be good at, and the scale on its axis that is best for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.decisions.objectives import Objective
from projdist.field import FIGURES, AnyFigure, Figure, get_figure

__all__ = ["SHARE", "Factors", "Goal", "Order", "goal_of", "rms_scale"]

Factors = FloatArray  # combined factors with k_0 = 1
Order = tuple[float, float]

SHARE = "share"
"""The criterion that is no figure of a map alone: the weight of the points within a target."""


def rms_scale(q: Factors, w: FloatArray) -> float:
    """The k_0 of least RMS distortion."""
    return float(np.sum(w * q) / np.sum(w * q * q))


def _middle(q: Factors, w: FloatArray) -> float:
    return float(2.0 / (q.max() + q.min()))


def _rms(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(np.sum(w * ppm * ppm)))


def _largest(ppm: FloatArray, w: FloatArray) -> float:
    return float(np.abs(ppm).max())


# Where a = b these are quicker than what is for all matrices: the best scale, and the figure of distortions.
_QUICK: dict[object, tuple[Callable[[Factors, FloatArray], float], Callable[[FloatArray, FloatArray], float]]] = {
    FIGURES["max_scale_error_ppm"].essence: (_middle, _largest),
    FIGURES["rms_scale_error_ppm"].essence: (rms_scale, _rms),
}


@dataclass(frozen=True)
class Goal:
    """A figure, or None for the share of the points within a target in ppm, and what k_0 is a multiple of."""

    figure: Figure | None
    target: float
    round_k: float

    @property
    def name(self) -> str:
        """The criterion's."""
        return self.figure.name if self.figure else SHARE

    def order(self, ppm: FloatArray, weight: FloatArray) -> Order:
        """How good distortions are, by the figure, then by RMS; less is better."""
        if self.figure is None:
            # Shares that differ by rounding only are the same.
            return -round(float(np.sum(weight[np.abs(ppm) <= self.target])), 9), _rms(ppm, weight)
        if quick := _QUICK.get(self.figure.essence):
            return quick[1](ppm, weight), _rms(ppm, weight)
        return self.figure(_similar(1.0 + 1e-6 * ppm), weight), _rms(ppm, weight)

    def rounded_scale(self, q: Factors, weight: FloatArray) -> tuple[float, Order]:
        """The best multiple of `round_k`, and how good it is."""
        multiple = self._multiple(q, weight)
        # Figures are convex in k_0: the best multiple is next to the best of all.
        options = np.unique([np.floor(multiple), np.ceil(multiple)]) * self.round_k
        orders = [self.order(1e6 * (k * q - 1.0), weight) for k in options]
        best = min(range(len(orders)), key=lambda index: orders[index])
        return float(options[best]), orders[best]

    def _multiple(self, q: Factors, weight: FloatArray) -> float:
        if self.figure is None:
            return _crowded(q, weight, self.target, self.round_k)
        if quick := _QUICK.get(self.figure.essence):
            return quick[0](q, weight) / self.round_k
        return Objective(self.figure).scale(_similar(q), weight) / self.round_k


def goal_of(criterion: AnyFigure, target: float, round_k: float) -> Goal:
    """The goal of a criterion; raises ValueError for one that tells conformal maps nothing."""
    if isinstance(criterion, str) and criterion == SHARE:
        return Goal(None, target, round_k)
    figure = get_figure(criterion)
    if figure.aspect == "angles" or figure.version:
        raise ValueError(
            f"Invalid criterion '{figure.name}'. It must be share, or a figure that conformal maps have at a scale, as "
            "max_scale_error_ppm or rms_scale_error_ppm."
        )
    return Goal(figure, target, round_k)


def _similar(factor: FloatArray) -> FloatArray:
    """Jacobians (n, 2, 2) of factors (n,) that are the same in all directions."""
    return factor[:, None, None] * np.eye(2)


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
