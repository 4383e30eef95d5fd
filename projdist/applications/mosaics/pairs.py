"""Which points of two images agree on a map, and the map."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.applications.mosaics.bundle import Link, adjust, transfer_errors
from projdist.applications.mosaics.projective import LEAST, fit

__all__ = ["Pair", "estimate", "refined"]

_BATCH, _BATCHES = 100, 40  # of samples: with one in five points right, one of 600 samples of four is
_SURE = 0.999  # probability of a sample without a wrong point
_ROUNDS = 20  # of refitting
_HOPELESS = 10.0  # tolerances, in the median after a linear fit: that is not one map, and takes long to refit
# Expected number of maps between points at random, over all pairs that are asked, that as many points agree on as well
# (a contrario: L. Moisan & B. Stival 2004, "A probabilistic criterion to detect rigid point matches between two images
# and estimate the fundamental matrix", section 4; of homographies L. Moisan, P. Moulon & P. Monasse 2012, "Automatic
# homographic registration of a pair of images, with a contrario elimination of outliers").
_FALSE_ALARMS = 1e-3
_DISTINCT = 0.01  # of an image's side: points that are nearer to each other in both images count once
_VAGUE = 0.2  # deviation of a scale
_POINT = 1e-6  # spread of points that lie on a line to rounding
_LINE = "the points lie on a line"


class Pair(NamedTuple):
    """What two images have in common: the points that agree on the map S from i to j, or why there is no such map.

    `false_alarms`: decimal logarithm of how many maps chance would make as good, over all pairs; NaN where no map was
    found, or points are too few to tell.
    """

    agree: BoolArray
    S: FloatArray | None
    reason: str
    false_alarms: float = np.nan


def estimate(xi: FloatArray, xj: FloatArray, model: str, tolerance: float, *, area: float, tests: int) -> Pair:
    """The map that takes most points xi (n, 2) to xj and back within the tolerance, in coordinates of the order of 1.

    Where all agree at once that is all. Else maps through random samples of as few points as determine one are tried
    (RANSAC, Fischler & Bolles 1981; always the same samples), and the best is fitted to its points until these stay
    the same. What chance would do as well, in images of this area and so many pairs of them, is refused; one point
    more than determines a map is believed where all agree.
    """
    least = LEAST[model]
    none = np.zeros(len(xi), dtype=bool)
    if len(xi) < least:
        return Pair(none, None, f"{len(xi)} points; it takes {least}")
    if _spread(xi, xj) <= _POINT:
        return Pair(none, None, _LINE)
    linear = fit(xi, xj, model)
    hopeful = _is_map(linear) and np.median(transfer_errors(linear, xi, xj)) < _HOPELESS * tolerance
    S = _refined(linear, xi, xj, np.ones(len(xi), dtype=bool), model) if hopeful else None
    agree = none if S is None else transfer_errors(S, xi, xj) <= tolerance
    if not agree.all():
        S, agree = _sampled(xi, xj, model, tolerance)
        for _ in range(_ROUNDS):
            S = None if S is None or agree.sum() < least else _refined(S, xi, xj, agree, model)
            before, agree = agree, none if S is None else transfer_errors(S, xi, xj) <= tolerance
            if (agree == before).all():
                break
    alarms = np.nan if S is None else _false_alarms(S, xi, xj, tolerance, area, least) + math.log10(tests)
    few = len(xi) <= least + 1 and agree.all()
    if not few and not alarms < math.log10(_FALSE_ALARMS):
        return Pair(none, None, f"{agree.sum()} of {len(xi)} points agree, no more than by chance", alarms)
    if S is None or not _is_determined(S, xi[agree], xj[agree]):
        return Pair(none, None, _LINE, alarms)
    return Pair(agree, S, "", alarms)


def _false_alarms(S: FloatArray, xi: FloatArray, xj: FloatArray, tolerance: float, area: float, least: int) -> float:
    """The decimal logarithm of the number of false alarms of a map S, the least over the precisions up to a tolerance.

    With k of n points within e it is (n - p) C(n, k) C(k, p) (pi e^2 / area)^(k - p), p being those of a sample: a
    point at random is as near with the probability pi e^2 / area.
    """
    errors = _distinct(xi, xj, transfer_errors(S, xi, xj), _DISTINCT * math.sqrt(area))
    n, near = len(errors), np.sort(errors[errors <= tolerance])
    k = np.arange(least + 1, len(near) + 1)
    if not k.size:
        return math.inf
    # A point that fits to rounding is no proof without end.
    chance = np.minimum(np.pi * np.maximum(near[least:], _POINT) ** 2 / area, 1.0)
    logarithms = math.log(n - least) + _log_choices(n, k) + _log_choices(k, least) + (k - least) * np.log(chance)
    return float(logarithms.min()) / math.log(10.0)


def _log_choices(n: IntArray | int, k: IntArray | int) -> FloatArray:
    """The logarithms of the binomial coefficients."""
    n, k = np.broadcast_arrays(n, k)
    return np.array(
        [math.lgamma(a + 1) - math.lgamma(b + 1) - math.lgamma(a - b + 1) for a, b in zip(n, k, strict=True)]
    )


def _distinct(xi: FloatArray, xj: FloatArray, errors: FloatArray, apart: float) -> FloatArray:
    """The least error in each cell of pairs of places: features at one place are one witness."""
    cells = np.floor(np.hstack([xi, xj]) / apart)
    numbers = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1)
    least = np.full(numbers.max() + 1, np.inf)
    np.minimum.at(least, numbers, errors)
    return least


def refined(xi: FloatArray, xj: FloatArray, model: str) -> FloatArray | None:
    """The map with the least symmetric transfer error of all points; None where they do not determine one."""
    return _refined(fit(xi, xj, model), xi, xj, np.ones(len(xi), dtype=bool), model)


def _is_map(S: FloatArray) -> bool:
    return bool(np.isfinite(S).all() and np.linalg.det(S) != 0)


def _refined(S: FloatArray, xi: FloatArray, xj: FloatArray, agree: BoolArray, model: str) -> FloatArray | None:
    """The map with the least symmetric transfer error of some points; None where they do not determine it."""
    if not _is_map(S):
        return None
    try:
        # The plane is that of image j, the first.
        maps, _ = adjust(np.stack([np.eye(3), S]), [Link(0, 1, xj[agree], xi[agree])], model)
    except ValueError:
        return None
    return maps[1]


def _sampled(xi: FloatArray, xj: FloatArray, model: str, tolerance: float) -> tuple[FloatArray | None, BoolArray]:
    """The best of maps through random samples, by the number of points that agree, and which do.

    Every other batch is of affine maps: with one point in ten right, a sample of three is so ten times as often.
    """
    rng, least = np.random.default_rng(0), LEAST[model]
    best, agreeing = None, np.zeros(len(xi), dtype=bool)
    for batch in range(1, _BATCHES + 1):
        kind = model if batch % 2 else "affine"
        chosen = np.argsort(rng.random((_BATCH, len(xi))), axis=1)[:, : LEAST[kind]]
        maps = fit(xi[chosen], xj[chosen], kind)
        maps = maps[np.isfinite(maps).all(axis=(1, 2))]
        maps = maps[np.linalg.det(maps) != 0]
        agree = transfer_errors(maps, xi, xj) <= tolerance
        count = agree.sum(axis=1)
        if len(maps) and count.max() > agreeing.sum():
            best, agreeing = maps[count.argmax()], agree[count.argmax()]
        if (1.0 - agreeing.mean() ** least) ** (batch * _BATCH) < 1.0 - _SURE:
            break
    return best, agreeing


def _is_determined(S: FloatArray, xi: FloatArray, xj: FloatArray) -> bool:
    """Whether the scale across the line that fits the points best is known: its deviation is noise over spread."""
    noise = np.sqrt(np.mean(transfer_errors(S, xi, xj) ** 2))
    return bool(_spread(xi, xj) > max(noise / _VAGUE, _POINT))


def _spread(xi: FloatArray, xj: FloatArray) -> float:
    """Of the points about the line that fits them best, in the image where it is less."""
    return min(float(np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[-1]) for x in (xi, xj))
