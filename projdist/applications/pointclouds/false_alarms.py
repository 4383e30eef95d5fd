"""How certain it is that two clouds of points lie on one another: by how few that lie anyhow would lie so by chance.

The number of false alarms (Moisan & Stival 2004, A probabilistic criterion to detect rigid point matches between two
images and estimate the fundamental matrix, IJCV 57) looks at all precisions at once: a few points that fit exactly tell
as well as many that fit roughly. To count the points within one distance, or to take the median distance, tells less:
where half of the points are nearly exact, either has no place for the other half.
"""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray

__all__ = ["log_false_alarms"]

_EXACT = 1e-6  # of the spacing: what is nearer is no better proof
_SHARES = -700.0, 5.0  # logarithms of the volumes around points: what is less or more rounds to chances of 0 or 1


def log_false_alarms(distances: FloatArray, apart: float, n: int) -> float:
    """The logarithm of the number of false alarms of an affine map in n dimensions, the least of all precisions.

    `distances` (M,): of points from the nearest of a cloud that was mapped onto them; `apart`: their spacing. By chance
    the nearest is within r with the probability p = 1 - 2^(-(r / apart)^n), as among points spread evenly. That k of
    them are has (M - n - 1) C(M, k) p^(k - n - 1) false alarms: n + 1 may have made the map, so many k are tried.
    """
    near, least = np.sort(distances), n + 1
    k = np.arange(least + 1, len(near) + 1)
    if not k.size:
        return np.inf
    shares = np.exp(np.clip(n * np.log(np.maximum(near[least:] / apart, _EXACT)), *_SHARES))
    chance = -np.expm1(-np.log(2.0) * shares)
    factorials = np.concatenate([[0.0], np.cumsum(np.log(np.arange(1, len(near) + 1)))])
    choices = factorials[-1] - factorials[k] - factorials[len(near) - k]
    return float(np.log(len(k)) + np.min(choices + (k - least) * np.log(chance)))
