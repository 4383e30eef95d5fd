"""Which points of two images agree on a map, and the map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.applications.mosaics.bundle import Link, adjust, transfer_errors
from projdist.applications.mosaics.projective import LEAST, fit

__all__ = ["Pair", "estimate"]

_BATCH, _BATCHES = 100, 20  # of samples: with three in ten points right, one of 500 samples of four is
_SURE = 0.999  # probability of a sample without a wrong point
_ROUNDS = 20  # of refitting
_HOPELESS = 10.0  # tolerances, in the median after a linear fit: that is not one map, and takes long to refit
# More points agree by chance the more there are: of right pairs more than 8 + 0.3 n do (M. Brown & D. G. Lowe 2007,
# "Automatic panoramic image stitching using invariant features", section 3.2).
_CHANCE = (8.0, 0.3)
_VAGUE = 0.2  # deviation of a scale
_POINT = 1e-6  # spread of points that lie on a line to rounding
_LINE = "the points lie on a line"


class Pair(NamedTuple):
    """What two images have in common: the points that agree on the map S from i to j, or why there is no such map."""

    agree: BoolArray
    S: FloatArray | None
    reason: str


def estimate(xi: FloatArray, xj: FloatArray, model: str, tolerance: float) -> Pair:
    """The map that takes most points xi (n, 2) to xj and back within the tolerance, in coordinates of the order of 1.

    Where all agree at once that is all. Else maps through random samples of as few points as determine one are tried
    (RANSAC, Fischler & Bolles 1981; always the same samples), and the best is fitted to its points until these stay
    the same.
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
        if not agree.sum() > _CHANCE[0] + _CHANCE[1] * len(xi):
            return Pair(none, None, f"{agree.sum()} of {len(xi)} points agree, no more than by chance")
    if S is None or not _is_determined(S, xi[agree], xj[agree]):
        return Pair(none, None, _LINE)
    return Pair(agree, S, "")


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
    """The best of maps through random samples, by the number of points that agree, and which do."""
    rng, least = np.random.default_rng(0), LEAST[model]
    best, agreeing = None, np.zeros(len(xi), dtype=bool)
    for batch in range(1, _BATCHES + 1):
        chosen = np.argsort(rng.random((_BATCH, len(xi))), axis=1)[:, :least]
        maps = fit(xi[chosen], xj[chosen], model)
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
