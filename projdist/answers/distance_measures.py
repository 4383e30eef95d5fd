"""What the distances of pairs of points on a map and on the globe make of one number."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from projdist._typing import FloatArray

__all__ = ["DISTANCE_MEASURES", "DistanceMeasure", "best_scale_of_distances", "gott", "peters", "weighted_sum"]

DistanceMeasure = Callable[[FloatArray, FloatArray], float]


def gott(ratio: FloatArray, weight: FloatArray) -> float:
    """Standard deviation of ln(d_map / d_globe): the sigma, or D, of Gott, Mugnolo & Colley 2007.

    "Map projections minimizing distance errors", Cartographica 42 (arXiv astro-ph/0608500). It does
    not change with the map's scale.
    """
    logarithm = np.log(ratio)
    logarithm -= weighted_sum(logarithm, weight)
    return float(np.sqrt(weighted_sum(np.square(logarithm), weight)))


def peters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean of |d_map - d_globe| / (d_map + d_globe), the distance index of Peters 1984, from 0 to 1.

    It is of the map as it stands, and changes with its scale.
    """
    return weighted_sum(np.abs(ratio - 1.0) / (ratio + 1.0), weight)


def canters(ratio: FloatArray, weight: FloatArray) -> float:
    """Mean finite scale factor K1 = (1 + D) / (1 - D) of Canters 2002, with D the index of Peters.

    A map whose distances are all K times the true ones, or all 1 / K times, has K. Canters' own figures are
    of distances that he chose otherwise: on land but for Antarctica his pseudocylindrical map with six
    coefficients has 1.143, and over all pairs of points there 1.18.
    """
    index = peters(ratio, weight)
    return (1.0 + index) / (1.0 - index) if index < 1.0 else np.inf


_THINNED = 61  # of the pairs, for a search; a prime, as pairs come in rows
_REACH, _HALVINGS = 4.0, 32  # of ln scale to either side of the geometric mean


def best_scale_of_distances(ratio: FloatArray, weight: FloatArray) -> float:
    """The logarithm of the scale that makes the indices of Peters and of Canters least.

    Of every 61st pair: where the indices are least, what is lost by that is of second order.
    """
    logarithm, weight = np.log(ratio[::_THINNED]), weight[::_THINNED]
    # The index is the mean of |tanh(ln(r) / 2)|; its slope is negative below the best scale, and positive above it.
    middle = -weighted_sum(logarithm, weight) / float(weight.sum())
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_HALVINGS):
        scale = 0.5 * (low + high)
        half = 0.5 * (logarithm + scale)
        rises = weighted_sum(np.sign(half) / np.cosh(half) ** 2, weight) > 0.0
        low, high = (low, scale) if rises else (scale, high)
    return 0.5 * (low + high)


def weighted_sum(values: FloatArray, weight: FloatArray) -> float:
    """The sum of values (n,) times weights (n,)."""
    # Not a product of vectors, for which BLAS wakes threads that a quarter of a million numbers do not pay for.
    return float(np.sum(weight * values))


DISTANCE_MEASURES: dict[str, DistanceMeasure] = {"gott": gott, "peters": peters, "canters": canters}
