"""Upper bounds of smooth functions on cells and intervals, from quadratics through a few values each.

A quadratic is fitted to 5 x 5 values, or to 5 on an interval. Its maximum, and three times what the values differ from
it at most, bound the function: the third order, which is what is left, falls eightfold when a cell is halved.
"""

from __future__ import annotations

import numpy as np

from projdist._typing import BoolArray, FloatArray

OFFSETS = np.linspace(-1.0, 1.0, 5)  # of the values, in halves of a cell's width
_MARGIN = 3.0  # times the largest residual: enough for the tip of a cone, too

_T1, _T2 = (t.ravel() for t in np.meshgrid(OFFSETS, OFFSETS, indexing="ij"))


def _terms(t1: FloatArray, t2: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(t1), t1, t2, t1 * t1, t1 * t2, t2 * t2], axis=-1)


_DESIGN = _terms(_T1, _T2)
_FIT = np.linalg.pinv(_DESIGN)
_LINE_DESIGN = np.stack([np.ones(5), OFFSETS, OFFSETS**2], axis=-1)
_LINE_FIT = np.linalg.pinv(_LINE_DESIGN)


def bounds_on_cells(values: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Upper bounds (n,) from values (n, 5, 5), the offsets (n, 2) of the quadratics' maxima, and what may be flat.

    That is (n, 2), whether the function may be stationary in a cell along each of its two axes.
    """
    flat, spoilt = _mended(values.reshape(len(values), -1))
    c = flat @ _FIT.T
    rest = np.abs(flat - c @ _DESIGN.T).max(axis=1)
    t = _candidates(c)
    heights = (_terms(t[..., 0], t[..., 1]) * c[:, None]).sum(axis=-1)
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    most = 2.0 * np.abs(c[:, 3::2]) + np.abs(c[:, 4:5]) + 4.0 * rest[:, None]
    return upper, np.take_along_axis(t, best[..., None], axis=1)[:, 0], np.abs(c[:, 1:3]) <= most


def bounds_on_lines(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same on intervals from values (n, 5): upper bounds and offsets, each (n,)."""
    flat, spoilt = _mended(values)
    c = flat @ _LINE_FIT.T
    rest = np.abs(flat - c @ _LINE_DESIGN.T).max(axis=1)
    t = np.stack([_turn(c[:, 1], c[:, 2]), np.full(len(c), -1.0), np.ones(len(c))], axis=1)
    heights = c[:, :1] + c[:, 1:2] * t + c[:, 2:] * t * t
    best = heights.argmax(axis=1)[:, None]
    upper = np.take_along_axis(heights, best, axis=1)[:, 0] + _MARGIN * rest + spoilt
    return upper, np.take_along_axis(t, best, axis=1)[:, 0]


def _mended(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values with the least finite one for those that are not, and what to add to a bound then: their spread."""
    finite = np.isfinite(values)
    low = np.where(finite, values, np.inf).min(axis=1, keepdims=True)
    low = np.where(np.isfinite(low), low, -(np.finfo(float).max ** 0.5))
    mended = np.where(finite, values, low)
    return mended, np.where(finite.all(axis=1), 0.0, np.ptp(mended, axis=1))


def _turn(slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Where slope t + bend t^2 turns, within [-1, 1]."""
    return np.clip(np.divide(-slope, 2.0 * bend, out=np.zeros_like(slope), where=bend != 0.0), -1.0, 1.0)


def _candidates(c: FloatArray) -> FloatArray:
    """Where in its square a quadratic may be largest (n, 9, 2): inside, on the sides, in the corners."""
    points = np.empty((len(c), 9, 2))
    det = 4.0 * c[:, 3] * c[:, 5] - c[:, 4] ** 2
    safe = np.where(det != 0.0, det, 1.0)
    points[:, 0, 0] = (c[:, 4] * c[:, 2] - 2.0 * c[:, 5] * c[:, 1]) / safe
    points[:, 0, 1] = (c[:, 4] * c[:, 1] - 2.0 * c[:, 3] * c[:, 2]) / safe
    points[:, 0] = np.clip(points[:, 0], -1.0, 1.0)
    for k, side in enumerate((-1.0, 1.0)):
        points[:, 1 + k, 0], points[:, 1 + k, 1] = side, _turn(c[:, 2] + side * c[:, 4], c[:, 5])
        points[:, 3 + k, 0], points[:, 3 + k, 1] = _turn(c[:, 1] + side * c[:, 4], c[:, 3]), side
    points[:, 5:] = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
    return points
