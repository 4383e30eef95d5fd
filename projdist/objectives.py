"""What an optimisation makes small, with the best uniform scale in closed form.

An objective takes the principal scales a >= b at nodes and weights that sum to 1. `OBJECTIVES` lists them
by name. Multiplying a map by c multiplies a and b; the best c needs no search:

- Airy-Kavrayskiy, areas: exp(-mean ln(ab) / 2), because ln c adds to ln a and ln b (a plain mean).
- Airy: sum w (a + b) / sum w (a^2 + b^2), a linear least-squares problem.
- largest |scale - 1|: 2 / (max a + min b), the arithmetic middle; largest |ln scale|: 1 / sqrt(max a min b), the
  geometric middle.
- angles do not know the scale.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.measures import Measure, principal_scales

__all__ = ["OBJECTIVES", "Objective", "get_objective"]

Scales = Callable[[FloatArray, FloatArray, FloatArray], float]
Terms = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]


@dataclass(frozen=True)
class Objective:
    """A criterion to optimise.

    `scale` (a, b, weights) is the best uniform scale; `terms` (a, b, weights, scale) what is made small: the root of
    the sum of their squares, or, where `is_maximum`, the largest. `statistic` of `measure` is the same figure by
    adaptive cubature. `unit` is "" for logarithms and ratios.
    """

    name: str
    description: str
    scale: Scales
    terms: Terms
    measure: str | Measure
    statistic: str = "rms"
    unit: str = ""

    @property
    def is_maximum(self) -> bool:
        """Whether it is the largest of its terms, and no mean."""
        return self.statistic == "max"

    def value(self, terms: FloatArray) -> float:
        """The criterion from its terms."""
        return float(terms.max()) if self.is_maximum else float(np.sqrt(np.sum(terms * terms)))


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
    return np.sqrt(w) * np.degrees(2.0 * np.arctan2(a - b, 2.0 * np.sqrt(a * b)))


def _scale_error_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return 1e6 * np.maximum(c * a - 1.0, 1.0 - c * b)


def _log_scale_terms(a: FloatArray, b: FloatArray, w: FloatArray, c: float) -> FloatArray:
    return np.maximum(np.log(c * a), -np.log(c * b))


def _log_scale(J: FloatArray) -> FloatArray:
    """Largest |ln scale| over all directions."""
    a, b = np.moveaxis(principal_scales(J), -1, 0)
    return np.maximum(np.abs(np.log(a)), np.abs(np.log(np.where(b > 0, b, np.nan))))


OBJECTIVES: dict[str, Objective] = {
    objective.name: objective
    for objective in (
        Objective(
            "airy_kavrayskiy", "RMS of sqrt(ln^2 a + ln^2 b) by true area.", _log_middle, _fisher_terms, "fisher"
        ),
        Objective(
            "kavrayskiy",
            "The same with the half under the root that much of the literature has.",
            _log_middle,
            _kavrayskiy_terms,
            "kavrayskiy",
        ),
        Objective("airy", "RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2).", _airy_scale, _airy_terms, "airy"),
        Objective(
            "max_scale_error_ppm",
            "Largest |scale - 1| in any direction.",
            _arithmetic_middle,
            _scale_error_terms,
            "scale_error_ppm",
            "max",
            "ppm",
        ),
        Objective(
            "max_log_scale",
            "Largest |ln scale| in any direction (Chebyshev's criterion).",
            _geometric_middle,
            _log_scale_terms,
            Measure("max_log_scale", _log_scale),
            "max",
        ),
        Objective(
            "angular_distortion",
            "RMS of the maximum angular deformation.",
            _one,
            _angular_terms,
            "angular_distortion",
            "rms",
            "deg",
        ),
        Objective("log_areal_scale", "RMS of ln(ab).", _log_middle, _areal_terms, "log_areal_scale"),
    )
}


def get_objective(criterion: str | Objective) -> Objective:
    """The objective of a name; raises ValueError with close matches."""
    if isinstance(criterion, Objective):
        return criterion
    if criterion in OBJECTIVES:
        return OBJECTIVES[criterion]
    close = difflib.get_close_matches(criterion, OBJECTIVES, n=2)
    hint = f" Did you mean {' or '.join(close)}?" if close else ""
    raise ValueError(f"Invalid criterion '{criterion}'.{hint} It must be one of {', '.join(OBJECTIVES)}.")
