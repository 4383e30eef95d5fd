"""What indices are made of: functions of the principal scales a >= b, what becomes of their means, and best scales."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.answers.published_indices.index import ScaledField, Scales
from projdist.matrices import angular_distortion, jordan
from projdist.numerics import Estimate

Value = Callable[[ScaledField, float], Estimate]

# ---- functions of the scales ----------------------------------------------------------------


def airy(a: FloatArray, b: FloatArray) -> FloatArray:
    """((a - 1)^2 + (b - 1)^2) / 2."""
    return 0.5 * ((a - 1.0) ** 2 + (b - 1.0) ** 2)


def balance(a: FloatArray, b: FloatArray) -> FloatArray:
    """((a / b - 1)^2 + (a b - 1)^2) / 2."""
    return 0.5 * ((a / b - 1.0) ** 2 + (a * b - 1.0) ** 2)


def kavrayskiy(a: FloatArray, b: FloatArray) -> FloatArray:
    """(ln^2 a + ln^2 b) / 2."""
    return 0.5 * (np.log(a) ** 2 + np.log(b) ** 2)


def weighted(angles: float, areas: float) -> Scales:
    """(p ln^2(a/b) + q ln^2(ab)) / (p + q)."""

    def term(a: FloatArray, b: FloatArray) -> FloatArray:
        return (angles * np.log(a / b) ** 2 + areas * np.log(a * b) ** 2) / (angles + areas)

    return term


def jordan_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    """The mean over all directions of (scale - 1)^2."""
    J = np.zeros((*a.shape, 2, 2))
    J[..., 0, 0], J[..., 1, 1] = a, b
    return jordan(J) ** 2


def jordan_kavrayskiy(a: FloatArray, b: FloatArray) -> FloatArray:
    """The mean over all directions of ln^2 of the scale.

    In the direction z the scale is (a + b) / 2 times |1 + n exp(2 i z)|, n = (a - b) / (a + b), whose logarithm has the
    Fourier coefficients n^k / k: the mean of its square is half a dilogarithm.
    """
    from scipy.special import spence  # imported here: scipy is slow to load, and few need it

    n = (a - b) / (a + b)
    return np.asarray(np.log(0.5 * (a + b)) ** 2 + 0.5 * spence(1.0 - n * n))


def log_mean_scale(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln((a + b) / 2), the mean over all directions of ln of the scale."""
    return np.log(0.5 * (a + b))


def log_area(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln(a b)."""
    return np.log(a * b)


def log_area_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln^2(a b)."""
    return np.log(a * b) ** 2


def log_shape(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln(a / b)."""
    return np.log(a / b)


def log_shape_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln^2(a / b)."""
    return np.log(a / b) ** 2


def omega(a: FloatArray, b: FloatArray) -> FloatArray:
    """The maximum angular deformation in degrees."""
    J = np.zeros((*a.shape, 2, 2))
    J[..., 0, 0], J[..., 1, 1] = a, b
    return angular_distortion(J)


def relative_area(a: FloatArray, b: FloatArray) -> FloatArray:
    """By how much areas are too large or too small, max(s, 1/s) - 1."""
    return np.maximum(a * b, 1.0 / (a * b)) - 1.0


def relative_scales(a: FloatArray, b: FloatArray) -> FloatArray:
    """The same of both principal scales, their mean."""
    return 0.5 * (np.maximum(a, 1.0 / a) + np.maximum(b, 1.0 / b)) - 1.0


def _total(a: FloatArray, b: FloatArray) -> FloatArray:
    return a + b


def _squares(a: FloatArray, b: FloatArray) -> FloatArray:
    return a * a + b * b


def _area(a: FloatArray, b: FloatArray) -> FloatArray:
    return a * b


def _area_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    return (a * b) ** 2


# ---- what becomes of them -------------------------------------------------------------------


def mean_of(term: Scales, unit: float = 1.0) -> Value:
    """The mean of a term, in units of its own."""
    return lambda field, scale: Estimate(*(unit * part for part in field.mean(term, scale)))


def rms_of(term: Scales, factor: float = 1.0) -> Value:
    """The root of the mean of a term times a factor."""
    return lambda field, scale: Estimate(*(factor * part for part in field.mean(term, scale))).root()


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
_THINNED = 2


def share_above_smallest(field: ScaledField, scale: float) -> Estimate:
    """Percentage of the area with omega <= 40 degrees and s <= 1.5 times the least s."""
    a, b, weights = field.dense
    good = (omega(a, b) <= _MOST_OMEGA) & (a * b <= _MOST_RATIO * field.smallest_area.value)
    return _share(good, weights)


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


_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_REACH, _STEPS = 3.0, 36  # of ln scale to either side of the geometric mean; to 2e-7, the value to its square


def searched(term: Scales) -> Callable[[ScaledField], float]:
    """The scale that makes the mean of a term least, which is a convex function of its logarithm: golden section."""

    def best(field: ScaledField) -> float:
        def mean(x: float) -> float:
            return field.sum(term, math.exp(x))

        middle = math.log(best_for_logarithms(field))
        if not math.isfinite(field.mean(term).value):
            return math.nan
        low, high = middle - _REACH, middle + _REACH
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        at_left, at_right = mean(left), mean(right)
        for _ in range(_STEPS):
            if at_left <= at_right:
                high, right, at_right = right, left, at_left
                left = high - _GOLDEN * (high - low)
                at_left = mean(left)
            else:
                low, left, at_left = left, right, at_right
                right = low + _GOLDEN * (high - low)
                at_right = mean(right)
        return math.exp(0.5 * (low + high))

    return best
