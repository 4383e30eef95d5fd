"""What indices are made of: functions of the principal scales a >= b, what becomes of their means, and best scales."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.answers.published_indices.index import ScaledField, Scales
from projdist.field import FIGURES, Figure
from projdist.numerics import Estimate, least_between

Value = Callable[[ScaledField, float], Estimate]

# ---- functions of the scales ----------------------------------------------------------------


@functools.cache
def term_of(figure: Figure) -> Scales:
    """What a figure is the mean of, or the root of the mean of."""

    def term(a: FloatArray, b: FloatArray) -> FloatArray:
        values = figure.measure(np.stack([a, b], axis=-1)[..., None] * np.eye(2))
        return values**2 if figure.statistic == "rms" else values

    return term


jordan_squared, omega = term_of(FIGURES["jordan"]), term_of(FIGURES["mean_omega"])


def log_mean_scale(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln((a + b) / 2), the mean over all directions of ln of the scale."""
    return np.log(0.5 * (a + b))


def log_area(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln(a b)."""
    return np.log(a * b)


def log_area_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln^2(a b)."""
    return np.log(a * b) ** 2


def _total(a: FloatArray, b: FloatArray) -> FloatArray:
    return a + b


def _squares(a: FloatArray, b: FloatArray) -> FloatArray:
    return a * a + b * b


def _area(a: FloatArray, b: FloatArray) -> FloatArray:
    return a * b


def _area_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    return (a * b) ** 2


# ---- what becomes of them -------------------------------------------------------------------


def value_of(figure: Figure, factor: float = 1.0) -> Value:
    """A figure of a field, times a factor."""
    term = term_of(figure)

    def value(field: ScaledField, scale: float) -> Estimate:
        found = field.mean(term, scale)
        return Estimate(*(factor * part for part in (found.root() if figure.statistic == "rms" else found)))

    return value


def deviation_of_log_area(field: ScaledField, scale: float) -> Estimate:
    """The standard deviation of ln(ab), which does not depend on the scale."""
    level, level_error = field.mean(log_area)
    square, square_error = field.mean(log_area_squared)
    variance, error = square - level**2, square_error + 2.0 * abs(level) * level_error
    # Of an equal-area map there is nothing but rounding, whose square has no sign to cancel by.
    if variance <= error:
        return Estimate(0.0, math.sqrt(max(variance, 0.0) + error))
    return Estimate(variance, error).root()


def second_order(measure: str) -> Value:
    """The mean of a measure of the second derivatives."""
    return lambda field, scale: field.mean_of_second_order(measure)


def largest_error(field: ScaledField, scale: float) -> Estimate:
    """The largest |ln scale| in any place and direction."""
    worst = max(math.log(scale * field.largest.value), -_log(scale * field.smallest.value))
    return _found(worst, _relative_error(field))


def scale_ratio(field: ScaledField, scale: float) -> Estimate:
    """The largest scale over the smallest."""
    ratio = field.largest.value / field.smallest.value if field.smallest.value > 0 else math.inf
    return _found(ratio, _relative_error(field) * ratio)


def log_scale_ratio(field: ScaledField, scale: float) -> Estimate:
    """Its logarithm."""
    return _found(math.log(scale_ratio(field, scale).value), _relative_error(field))


def _relative_error(field: ScaledField) -> float:
    """The relative errors of the largest and the smallest scale, together."""
    return sum(one.error / one.value if one.value > 0 else math.nan for one in (field.largest, field.smallest))


def _found(value: float, error: float) -> Estimate:
    return Estimate(value, error if math.isfinite(value) else math.nan)


def _logs(values: FloatArray) -> FloatArray:
    """Logarithms, NaN for what is not above 0: interpolated scales beside singular points may be 0."""
    return np.log(np.where(values > 0, values, np.nan))


def _log(value: float) -> float:
    return math.log(value) if value > 0 else -math.inf


_MOST_OMEGA, _MOST_RATIO = 40.0, 1.5
_KNOWN = 0.1  # of the smallest areal scale: a larger error is no knowledge
_THINNED = 2


def share_above_smallest(field: ScaledField, scale: float) -> Estimate:
    """Percentage of the area with omega <= 40 degrees and s <= 1.5 times the least s."""
    a, b, weights = field.dense
    least = field.smallest_area
    # Where a map's rounding is all that is known of the place, as at an antipode, the points tell the least.
    smallest = least.value if least.error <= _KNOWN * least.value else float(np.min(a * b))
    return _share((omega(a, b) <= _MOST_OMEGA) & (a * b <= _MOST_RATIO * smallest), weights)


def share_near_nominal(field: ScaledField, scale: float) -> Estimate:
    """Percentage of the area with omega <= 40 degrees and s within a factor of 1.5 of 1."""
    a, b, weights = field.dense
    good = (omega(a, b) <= _MOST_OMEGA) & (np.abs(_logs(scale**2 * a * b)) <= math.log(_MOST_RATIO))
    return _share(good, weights)


def _share(good: BoolArray, weights: FloatArray) -> Estimate:
    """The weight of some points in per cent, and by how much it differs from that of half of them."""
    share = 100.0 * float(weights[good].sum())
    half = weights[::_THINNED]
    return Estimate(share, abs(share - 100.0 * float(half[good[::_THINNED]].sum() / half.sum())))


# ---- best scales ----------------------------------------------------------------------------


def best_for_airy(field: ScaledField) -> float:
    """sum (a + b) / sum (a^2 + b^2), a linear least-squares problem."""
    return field.mean(_total).value / field.mean(_squares).value


def best_for_balance(field: ScaledField) -> float:
    """The same for areas: the square of the scale."""
    return math.sqrt(field.mean(_area).value / field.mean(_area_squared).value)


def best_for_jordan(field: ScaledField) -> float:
    """The mean of the scale over that of its square, both over all places and directions."""
    square = 0.5 * field.mean(_squares).value
    return 0.5 * (square + 1.0 - field.mean(jordan_squared).value) / square


def best_for_jordan_kavrayskiy(field: ScaledField) -> float:
    """exp(-mean ln of the scale)."""
    return math.exp(-field.mean(log_mean_scale).value)


def best_for_logarithms(field: ScaledField) -> float:
    """exp(-mean ln(ab) / 2), the geometric mean."""
    return math.exp(-0.5 * field.mean(log_area).value)


def best_for_largest(field: ScaledField) -> float:
    """1 / sqrt(max a min b), the geometric middle."""
    middle = field.largest.value * field.smallest.value
    return 1.0 / math.sqrt(middle) if 0 < middle < math.inf else math.nan


def best_for_share(field: ScaledField) -> float:
    """The middle of the interval of ln s, 2 ln 1.5 wide, that holds most of the area where omega is small."""
    a, b, weights = field.dense
    small = omega(a, b) <= _MOST_OMEGA
    if not small.any():
        return math.nan
    logarithm = _logs(a[small] * b[small])
    weights, logarithm = weights[small][np.isfinite(logarithm)], logarithm[np.isfinite(logarithm)]
    order = np.argsort(logarithm)
    logarithm, below = logarithm[order], np.concatenate([[0.0], np.cumsum(weights[order])])
    stop = np.searchsorted(logarithm, logarithm + 2.0 * math.log(_MOST_RATIO), side="right")
    start = int(np.argmax(below[stop] - below[:-1]))
    middle = 0.5 * float(logarithm[start] + logarithm[stop[start] - 1])
    return math.exp(-0.5 * middle)


_REACH = 3.0  # of ln scale to either side of the geometric mean


def searched(figure: Figure) -> Callable[[ScaledField], float]:
    """The scale that makes the mean of a term least, which is a convex function of its logarithm."""
    term = term_of(figure)

    def best(field: ScaledField) -> float:
        if not math.isfinite(field.mean(term).value):
            return math.nan
        middle = math.log(best_for_logarithms(field))
        return math.exp(least_between(lambda x: field.sum(term, math.exp(x)), middle - _REACH, middle + _REACH))

    return best
