"""Weighted statistics of values."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence

import numpy as np

from projdist._typing import ArrayLike, FloatArray
from projdist.support import Registry

Criterion = Callable[[FloatArray, FloatArray], float]


def mean(values: FloatArray, weights: FloatArray) -> float:
    """Weighted arithmetic mean."""
    values, weights = _defined(values, weights, rule=True)
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
    """Weighted 95th percentile: the value is less on 95 % of the area."""
    return quantile(values, weights, 0.95)


def maximum(values: FloatArray, weights: FloatArray) -> float:
    """Largest value with a positive weight."""
    values, _ = _defined(values, weights)
    return float(values.max()) if values.size else np.nan


def minimum(values: FloatArray, weights: FloatArray) -> float:
    """Smallest value with a positive weight."""
    values, _ = _defined(values, weights)
    return float(values.min()) if values.size else np.nan


def quantile(values: ArrayLike, weights: ArrayLike, share: float) -> float:
    """The value below which `share` of the weight lies, linear between the middles of the weights."""
    return quantiles(values, weights, [share])[0]


def quantiles(values: ArrayLike, weights: ArrayLike, shares: Sequence[float]) -> list[float]:
    """Quantiles of several shares, sorting once."""
    values, weights = _defined(values, weights)
    if not values.size:
        return [np.nan] * len(shares)
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order]) - 0.5 * weights[order]
    return [float(np.interp(share * weights.sum(), cumulative, values[order])) for share in shares]


def _defined(values: ArrayLike, weights: ArrayLike, *, rule: bool = False) -> tuple[FloatArray, FloatArray]:
    """Finite values with their weights, negative only with `rule`, as over polygons; raises ValueError."""
    v, w = np.asarray(values, dtype=float).ravel(), np.asarray(weights, dtype=float).ravel()
    if v.shape != w.shape:
        raise ValueError(f"Invalid weights of size {w.size}. There must be one for each of {v.size} values.")
    count = np.isfinite(v) & np.isfinite(w) & (w != 0)
    v, w = v[count], w[count]
    if not rule and (w < 0).any():
        raise ValueError(
            f"Invalid weight '{w.min():.3g}'. It must not be negative, as those of samples over polygons are: "
            "they make means, and no quantiles, maxima or minima; Field.statistic and summarize find these."
        )
    return v, w


CRITERIA: Registry[Criterion] = Registry(
    "criterion",
    {"mean": mean, "rms": rms, "std": std, "median": median, "p95": p95, "max": maximum, "min": minimum},
    rule="It must be one of mean, rms, std, median, p95, max, min, pNN (see 'projdist list criteria'), or a "
    "function of values and weights.",
)


def get_criterion(criterion: str | Criterion) -> Criterion:
    """The criterion of a name: a function that turns values and weights into one number.

    Parameters
    ----------
    criterion : str or callable
        A name in `CRITERIA` (mean, rms, std, median, p95, max, min); pNN for a percentile, such as p99 or p99.9; or a
        function of values (n,) and weights (n,), which stands for itself.

    Returns
    -------
    callable
        A function of values and weights, array_like of one size, that gives a float. What is NaN does not count;
        nothing but NaN gives NaN. Weights may be negative for mean, rms and std only, the others raise ValueError.

    Raises
    ------
    ValueError
        For an unknown name, with close matches.

    References
    ----------
    Percentiles are linear between the middles of the weights: for equal ones definition 5 of Hyndman & Fan 1996, Sample
    Quantiles in Statistical Packages, The American Statistician 50:361.

    Examples
    --------
    >>> get_criterion("mean")([1.0, 2.0], [3.0, 1.0]), get_criterion("p50")([1.0, 2.0, 4.0, 8.0], [1.0] * 4)
    (1.25, 3.0)
    """
    if callable(criterion):
        return criterion
    percentile = re.fullmatch(r"p(\d{1,2}(?:\.\d+)?)", criterion) if isinstance(criterion, str) else None
    if percentile and criterion not in CRITERIA:
        return functools.partial(quantile, share=float(percentile[1]) / 100.0)
    return CRITERIA.named(criterion)
