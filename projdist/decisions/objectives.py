"""What an optimisation makes small, with the best uniform scale in closed form.

An objective takes the principal scales a >= b at nodes and weights that sum to 1. `OBJECTIVES` lists them
by name. Multiplying a map by c multiplies a and b; the best c needs no search:

- Airy-Kavrayskiy, areas: exp(-mean ln(ab) / 2), because ln c adds to ln a and ln b (a plain mean).
- Airy: sum w (a + b) / sum w (a^2 + b^2), a linear least-squares problem.
- largest |scale - 1|: 2 / (max a + min b), the arithmetic middle, and so for areas; largest |ln scale|:
  1 / sqrt(max a min b), the geometric middle.
- mean |scale - 1|: a weighted quantile of 2 / (a + b), where one straight part of the sum meets the next; for areas
  of 1 / ab.
- angles do not know the scale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.field import FIGURES, Figure, check_figure

__all__ = ["OBJECTIVES", "Objective", "get_objective"]

Scales = Callable[[FloatArray, FloatArray, FloatArray], float]
Terms = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]
Extremes = Callable[[FloatArray, FloatArray, bool], FloatArray]


@dataclass(frozen=True)
class Objective:
    """How to make a figure small.

    `scale` (a, b, weights) is the best uniform scale; `terms` (a, b, weights, scale) what is made small: the root of
    the sum of their squares, without the root where the statistic is mean, or the largest. A maximum has `extremes`
    (a, b, free): what it is made of, smooth in a map's parameters, (groups, n), where the groups' maxima are added; of
    the map as it is, or with a `free` scale.
    """

    figure: Figure
    scale: Scales
    terms: Terms
    extremes: Extremes | None = None

    def __post_init__(self) -> None:
        if self.figure.is_maximum != (self.extremes is not None):
            raise ValueError(
                f"Invalid objective '{self.figure.name}'. It must have extremes where its statistic is max."
            )

    @property
    def exact(self) -> float:
        """What a map has at most that keeps angles, or areas, where the figure is of them only; else 0."""
        return self.figure.rounding if self.figure.is_partial else 0.0

    def value(self, terms: FloatArray) -> float:
        """The criterion from its terms."""
        if self.figure.is_maximum:
            return float(terms.max())
        square = float(np.sum(terms * terms))
        return square if self.figure.statistic == "mean" else square**0.5


def _one(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return 1.0


def _log_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return float(np.exp(-0.5 * np.sum(w * np.log(a * b)) / np.sum(w)))


def _airy_scale(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return float(np.sum(w * (a + b)) / np.sum(w * (a * a + b * b)))


def _arithmetic_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return float(2.0 / (a.max() + b.min()))


def _geometric_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return float(1.0 / np.sqrt(a.max() * b.min()))


def _areal_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    s = a * b
    return float(np.sqrt(2.0 / (s.max() + s.min())))


def _scale_quantile(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    # max(c a - 1, 1 - c b) falls with the slope -b up to c = 2 / (a + b), and rises with the slope a from there.
    return _turning_point(2.0 / (a + b), w * (a + b), float(np.sum(w * b)))


def _areal_quantile(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    s = a * b
    return float(np.sqrt(_turning_point(1.0 / s, w * s, 0.5 * float(np.sum(w * s)))))


def _turning_point(places: FloatArray, steps: FloatArray, until: float) -> float:
    """Where the steps, in the order of their places, add up to so much."""
    order = np.argsort(places)
    sums = np.cumsum(steps[order])
    return float(places[order[min(int(np.searchsorted(sums, until)), order.size - 1)]])


def _fisher_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    # ln^2 a + ln^2 b = (ln^2(ab) + ln^2(a/b)) / 2: smooth where a = b, which a and b alone are not.
    root = np.sqrt(0.5 * w)
    return np.concatenate([root * (np.log(a * b) + 2.0 * np.log(c)), root * np.log(a / b)])


def _kavrayskiy_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return _fisher_terms(a, b, w, c) / np.sqrt(2.0)


def _airy_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    root = np.sqrt(0.25 * w)
    return np.concatenate([root * (c * (a + b) - 2.0), root * c * (a - b)])


def _areal_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return np.sqrt(w) * (np.log(a * b) + 2.0 * np.log(c))


def _angular_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return np.sqrt(w) * _omega_terms(a, b, w, c)


def _fisher_terms_scaled(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return _fisher_terms(a, b, w, _log_middle(a, b, w))


def _omega_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return np.degrees(2.0 * np.arctan2(a - b, 2.0 * np.sqrt(a * b)))


def _areal_error_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return 1e6 * np.abs(c * c * a * b - 1.0)


def _mean_terms(errors: Terms) -> Terms:
    """Terms whose squares add up to the mean of errors that are none below 0."""
    return lambda a, b, w, c: np.sqrt(w * np.maximum(errors(a, b, w, c), 0.0))


def _scale_error_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return 1e6 * np.maximum(c * a - 1.0, 1.0 - c * b)


def _log_scale_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return np.maximum(np.log(c * a), -np.log(c * b))


def _scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    # With a free scale, of which either middle leaves a half of ln(max a / min b), or grows with it.
    return _log_scale_extremes(a, b, free) if free else 1e6 * np.concatenate([a - 1.0, 1.0 - b])[None]


def _log_scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    groups = np.stack([np.log(a), -np.log(b)])
    return groups if free else groups.reshape(1, -1)


def _areal_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    return _scale_extremes(a * b, a * b, free)


def _omega_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    return _omega_terms(a, b, a, 1.0)[None]


_SEARCHED: dict[str, tuple[Scales, Terms]] = {
    "airy_kavrayskiy": (_log_middle, _fisher_terms),
    "airy_kavrayskiy_scaled": (_log_middle, _fisher_terms_scaled),
    "kavrayskiy": (_log_middle, _kavrayskiy_terms),
    "airy": (_airy_scale, _airy_terms),
    "max_scale_error_ppm": (_arithmetic_middle, _scale_error_terms),
    "mean_scale_error_ppm": (_scale_quantile, _mean_terms(_scale_error_terms)),
    "max_log_scale": (_geometric_middle, _log_scale_terms),
    "angular_distortion": (_one, _angular_terms),
    "max_omega": (_one, _omega_terms),
    "mean_omega": (_one, _mean_terms(_omega_terms)),
    "log_areal_scale": (_log_middle, _areal_terms),
    "max_areal_error_ppm": (_areal_middle, _areal_error_terms),
    "mean_areal_error_ppm": (_areal_quantile, _mean_terms(_areal_error_terms)),
}
_EXTREMES: dict[str, Extremes] = {
    "max_scale_error_ppm": _scale_extremes,
    "max_log_scale": _log_scale_extremes,
    "max_omega": _omega_extremes,
    "max_areal_error_ppm": _areal_extremes,
}
OBJECTIVES = {
    name: Objective(FIGURES[name], scale, terms, _EXTREMES.get(name)) for name, (scale, terms) in _SEARCHED.items()
}


def get_objective(criterion: str | Objective) -> Objective:
    """The objective of a name: how to make a figure of a map over a region small, by the best scale, too.

    Parameters
    ----------
    criterion : str or Objective
        A name in `OBJECTIVES`; an objective stands for itself.

    Returns
    -------
    Objective
        Its functions take the principal scales a >= b (n,) and weights (n,) that sum to 1.

    Raises
    ------
    ValueError
        For an unknown name, with close matches.

    References
    ----------
    Of each figure in its `source`, such as Airy 1861, Philosophical Magazine 22:409.

    Examples
    --------
    Scales of 2.2 and 1.8 become 1.1 and 0.9, as far from 1 as each other:

    >>> import numpy as np
    >>> objective = get_objective("max_scale_error_ppm")
    >>> round(objective.scale(np.array([2.2]), np.array([1.8]), np.array([1.0])), 12)
    0.5
    """
    if isinstance(criterion, Objective):
        return criterion
    return OBJECTIVES[check_figure(criterion, OBJECTIVES)]
