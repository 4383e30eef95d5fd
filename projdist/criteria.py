"""Criteria: functions that turn values and weights into one number.

`CRITERIA` lists them by name; `get_criterion` also takes pNN for a percentile, and any callable
of (values, weights). Values that are NaN do not count.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from projdist import hints
from projdist._typing import FloatArray

__all__ = ["CRITERIA", "get_criterion", "quantile"]

Criterion = Callable[[FloatArray, FloatArray], float]


def mean(values: FloatArray, weights: FloatArray) -> float:
    """Weighted arithmetic mean."""
    values, weights = _defined(values, weights)
    return float(np.sum(weights * values) / np.sum(weights)) if values.size else np.nan


def rms(values: FloatArray, weights: FloatArray) -> float:
    """Weighted root mean square."""
    return float(np.sqrt(mean(np.square(values), weights)))


def std(values: FloatArray, weights: FloatArray) -> float:
    """Weighted standard deviation."""
    return rms(np.asarray(values) - mean(values, weights), weights)


def median(values: FloatArray, weights: FloatArray) -> float:
    """Weighted median."""
    return quantile(values, weights, 0.5)


def p95(values: FloatArray, weights: FloatArray) -> float:
    """Weighted 95th percentile: 95 % of the area has less."""
    return quantile(values, weights, 0.95)


def maximum(values: FloatArray, weights: FloatArray) -> float:
    """Largest value of positive weight."""
    values, _ = _defined(values, weights)
    return float(values.max()) if values.size else np.nan


def minimum(values: FloatArray, weights: FloatArray) -> float:
    """Smallest value of positive weight."""
    values, _ = _defined(values, weights)
    return float(values.min()) if values.size else np.nan


def quantile(values: ArrayLike, weights: ArrayLike, share: float) -> float:
    """The value below which `share` of the weight lies, linear between the middles of the weights."""
    values, weights = _defined(values, weights)
    if not values.size:
        return np.nan
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order]) - 0.5 * weights[order]
    return float(np.interp(share * weights.sum(), cumulative, values[order]))


def _defined(values: ArrayLike, weights: ArrayLike) -> tuple[FloatArray, FloatArray]:
    values, weights = np.asarray(values, dtype=float).ravel(), np.asarray(weights, dtype=float).ravel()
    if values.shape != weights.shape:
        raise ValueError(f"Invalid weights of size {weights.size}. There must be one for each of {values.size} values.")
    count = np.isfinite(values) & (weights > 0)
    return values[count], weights[count]


CRITERIA: dict[str, Criterion] = {
    "mean": mean,
    "rms": rms,
    "std": std,
    "median": median,
    "p95": p95,
    "max": maximum,
    "min": minimum,
}


_ALLOWED = (
    f"It must be one of {', '.join(CRITERIA)}, pNN (see 'projdist list criteria'), or a function of values and weights."
)


def get_criterion(criterion: str | Criterion) -> Criterion:
    """The criterion of a name, of pNN, or the callable itself; raises ValueError with close matches."""
    if callable(criterion):
        return criterion
    if not isinstance(criterion, str):
        raise ValueError(f"Invalid criterion '{criterion}'. {_ALLOWED}")
    if criterion in CRITERIA:
        return CRITERIA[criterion]
    percentile = re.fullmatch(r"p(\d{1,2}(?:\.\d+)?)", criterion)
    if percentile:
        return functools.partial(quantile, share=float(percentile[1]) / 100.0)
    raise ValueError(f"Invalid criterion '{criterion}'. {hints.suggestion(criterion, CRITERIA)}{_ALLOWED}")
