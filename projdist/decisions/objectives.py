"""Objectives of optimisation, with the best uniform scale in closed form where there is one.

An objective takes Jacobians at nodes and weights that sum to 1. Multiplying a map by c multiplies the principal
scales a >= b. The best c is:

- Airy-Kavrayskiy, areas: exp(-mean ln(ab) / 2), because ln c adds to ln a and ln b (a plain mean).
- Airy: sum w (a + b) / sum w (a^2 + b^2), a linear least-squares problem.
- largest |scale - 1|: 2 / (max a + min b), the arithmetic middle, and so for areas; largest |ln scale|:
  1 / sqrt(max a min b), the geometric middle.
- mean |scale - 1|: a weighted quantile of 2 / (a + b), where one straight part of the sum meets the next; for areas
  of 1 / ab. Its RMS: the minimum of a parabola, or where one parabola meets the next.
- angles: any, as they do not depend on the scale.

For other figures, also those of users, ln c is found by a search.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.field import FIGURES, Figure
from projdist.matrices import MEASURES, Measure, mdt, principal_scales
from projdist.numerics import least_between

Scales = Callable[[FloatArray, FloatArray, FloatArray], float]
Terms = Callable[[FloatArray, FloatArray], FloatArray]
Extremes = Callable[[FloatArray, FloatArray, bool], FloatArray]

_REACH = 3.0  # of ln c to either side of the geometric mean


@dataclass(frozen=True)
class Objective:
    """A figure to minimise."""

    figure: Figure

    @property
    def exact(self) -> float:
        """Largest value that rounding leaves on a map without this distortion; 0 if no family is without it."""
        return self.figure.rounding if self.figure.may_vanish else 0.0

    def scale(self, J: FloatArray, w: FloatArray) -> float:
        """The best uniform scale of Jacobians (n, 2, 2) with weights (n,) that sum to 1."""
        a, b = _scales(J)
        closed = _BEST_SCALES.get(self.figure.essence)
        if closed is not None:
            return closed(a, b, w)
        middle = np.log(_log_middle(a, b, w))
        best = least_between(lambda x: self.figure(np.exp(x) * J, w), middle - _REACH, middle + _REACH)
        return float(np.exp(best))

    def terms(self, J: FloatArray, w: FloatArray, c: float) -> FloatArray:
        """Terms of a map times c; the criterion is their root sum of squares, sum of squares (mean), or maximum."""
        if self.figure.version == "affine":
            J, c = np.linalg.inv(mdt(J[w > 0], w[w > 0]).T) @ J, 1.0
        if self.figure.version == "scaled" and w.any():
            c = _log_middle(*_scales(J), w)
        if (smooth := _SMOOTH.get(self.figure.measure)) and self.figure.statistic == "rms":
            terms = smooth(*_scales(c * J))
            return (np.sqrt(w) * terms).ravel()
        values = self.figure.measure(c * J)
        if self.figure.is_maximum:
            return values
        return np.sqrt(w) * (np.sqrt(np.maximum(values, 0.0)) if self.figure.statistic == "mean" else values)

    def extremes(self, J: FloatArray, w: FloatArray, free: bool) -> FloatArray:
        """Terms (groups, n), smooth in a map's parameters, of which the sum of the groups' maxima makes a maximum.

        With `free` the scale is the best one.
        """
        closed = _EXTREMES.get(self.figure.essence)
        if closed is not None:
            return closed(*_scales(J), free)
        defined = np.isfinite(J).all(axis=(1, 2))
        c = self.scale(J[defined], w[defined]) if free and defined.any() else 1.0
        return self.figure.measure(c * J)[None]

    def value(self, terms: FloatArray) -> float:
        """Value of the criterion by its terms."""
        if self.figure.is_maximum:
            return float(terms.max())
        square = float(np.sum(terms * terms))
        return square if self.figure.statistic == "mean" else square**0.5


def _scales(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b = np.moveaxis(principal_scales(J), -1, 0)
    return a, b


# ---- best scales ----------------------------------------------------------------------------


def _one(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return 1.0


def _log_middle(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    return float(np.exp(-0.5 * np.sum(w * np.log(a * b)) / np.sum(w)))


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
    """The place at which the steps, in order of their places, add up to a value."""
    order = np.argsort(places)
    sums = np.cumsum(steps[order])
    return float(places[order[min(int(np.searchsorted(sums, until)), order.size - 1)]])


def _scale_parabola(a: FloatArray, b: FloatArray, w: FloatArray) -> float:
    # The sum of max(c a - 1, 1 - c b)^2 is a parabola between two of the places 2 / (a + b), and convex: its lowest
    # point is that of the first parabola that has it before its end, or the kink before that.
    places = 2.0 / (a + b)
    order = np.argsort(places)
    a, b, w = a[order], b[order], w[order]
    first, second = (np.sum(w * b**n) + np.append(0.0, np.cumsum(w * (a**n - b**n))) for n in (1, 2))
    lowest, ends = first / second, np.append(places[order], np.inf)
    k = int(np.argmax(lowest <= ends))
    return float(lowest[k] if k == 0 else max(lowest[k], ends[k - 1]))


_BY_NAME: dict[str, Scales] = {
    "airy_kavrayskiy": _log_middle,
    "airy_kavrayskiy_scaled": _log_middle,
    "airy_kavrayskiy_affine": _log_middle,
    "kavrayskiy": _log_middle,
    "airy": lambda a, b, w: float(np.sum(w * (a + b)) / np.sum(w * (a * a + b * b))),
    "klingatsch_angles": _log_middle,
    "klingatsch_areas": _log_middle,
    "max_scale_error_ppm": lambda a, b, w: float(2.0 / (a.max() + b.min())),
    "mean_scale_error_ppm": _scale_quantile,
    "rms_scale_error_ppm": _scale_parabola,
    "max_log_scale": lambda a, b, w: float(1.0 / np.sqrt(a.max() * b.min())),
    "angular_distortion": _one,
    "max_omega": _one,
    "mean_omega": _one,
    "isotropy": _one,
    "kunimune_shape": _one,
    "log_areal_scale": _log_middle,
    "max_areal_error_ppm": _areal_middle,
    "mean_areal_error_ppm": _areal_quantile,
}
_BEST_SCALES = {FIGURES[name].essence: scale for name, scale in _BY_NAME.items()}


# ---- smooth terms of measures that are not smooth themselves ---------------------------------


def _fisher_terms(a: FloatArray, b: FloatArray) -> FloatArray:
    # ln^2 a + ln^2 b = (ln^2(ab) + ln^2(a/b)) / 2: smooth where a = b, which a and b alone are not.
    return np.sqrt(0.5) * np.stack([np.log(a * b), np.log(a / b)])


def _kavrayskiy_terms(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.sqrt(0.5) * _fisher_terms(a, b)


def _airy_terms(a: FloatArray, b: FloatArray) -> FloatArray:
    return 0.5 * np.stack([a + b - 2.0, a - b])


def _scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    # With a free scale half of ln(max a / min b) is left, or what grows with it.
    return _log_scale_extremes(a, b, free) if free else 1e6 * np.concatenate([a - 1.0, 1.0 - b])[None]


def _log_scale_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    groups = np.stack([np.log(a), -np.log(b)])
    return groups if free else groups.reshape(1, -1)


def _areal_extremes(a: FloatArray, b: FloatArray, free: bool) -> FloatArray:
    return _scale_extremes(a * b, a * b, free)


_SMOOTH: dict[Measure, Terms] = {
    MEASURES["fisher"]: _fisher_terms,
    MEASURES["kavrayskiy"]: _kavrayskiy_terms,
    MEASURES["airy"]: _airy_terms,
}
_EXTREMES: dict[object, Extremes] = {
    FIGURES["max_scale_error_ppm"].essence: _scale_extremes,
    FIGURES["max_log_scale"].essence: _log_scale_extremes,
    FIGURES["max_areal_error_ppm"].essence: _areal_extremes,
}
