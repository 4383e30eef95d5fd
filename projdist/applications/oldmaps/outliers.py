"""Control points that are wrong: farther from where the others have them than chance lets any be.

A spline is the estimate of a random field from points with errors (Wahba 1990), and what each point would be without it
has a variance by that model. Its residual over the standard deviation that the others leave, the externally
studentised one, has a square f of the distribution F(2, 2 m), which exceeds f with the chance (1 + f / m)^-m; with n
points the worst is wrong where that is below .05 / n. A wrong point alone always has the largest (Cauchy-Schwarz).

A map without errors is no such field: what is left of it are the spline's own shortcomings, most at the rim. A spline
of the next order has others. So the smaller residual of the two counts, against the larger of their deviations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.applications.oldmaps.fits import SplineModes, normalised
from projdist.applications.oldmaps.points import ControlPoints

__all__ = ["FALSE_ALARM", "wrong_points"]

FALSE_ALARM = 0.05  # the chance that any point of a set without wrong ones is named
_ORDERS = (2, 3)
_MOST = 4  # one point in so many may be wrong
_HIDDEN = 10  # one in so many is left out in search of others that they hide
_ROUNDING = 1e-9  # of the extent in truth


class _Residuals(NamedTuple):
    """Squares of lengths, their variances and degrees of freedom, of one spline."""

    square: FloatArray
    variance: FloatArray
    freedom: int


def wrong_points(points: ControlPoints) -> BoolArray:
    """Which points are wrong.

    The worst are left out one after the other, a tenth of the points beyond the last wrong one, so that none hides
    another. A quarter of those up to the last wrong one go, and the splines' smoothing is found anew without them, till
    no point is wrong; what then fits the others is taken back. Of fewer than eight points none is wrong.
    """
    kept = np.ones(len(points.old), dtype=bool)
    while len(found := _worst(points.chosen(kept))):
        kept[np.flatnonzero(kept)[found]] = False
    while not kept.all():
        fitting = _fitting(points, kept)
        if not fitting.any():
            break
        kept |= fitting
    return np.asarray(~kept)


def _plane(points: ControlPoints, kept: BoolArray) -> tuple[FloatArray, AnyArray, float]:
    """Places in units of those kept, the truth as complex numbers about its mean, and what of it is rounding."""
    chosen = points.chosen(kept)
    truth = points.new - chosen.new.mean(axis=0)
    return normalised(chosen)(points.old), truth @ [1.0, 1.0j], _ROUNDING * float(np.ptp(chosen.new))


def _worst(points: ControlPoints) -> list[int]:
    """A quarter of the points that are wrong, by splines through all."""
    count = len(points.old)
    u, z, rounding = _plane(points, np.ones(count, dtype=bool))
    splines = [SplineModes(u, order) for order in _ORDERS]
    if not _has_freedom(splines, count - 1):
        return []
    most = count // _MOST
    others = [_Others(spline, z, most) for spline in splines]
    out: list[int] = []
    wrong = 0
    while len(out) < min(most, wrong + max(count // _HIDDEN, 1)) and _has_freedom(splines, count - len(out) - 1):
        chance = _log_chance([one.residuals() for one in others], rounding)
        chance[out] = np.inf
        worst = int(np.argmin(chance))
        out.append(worst)
        if chance[worst] < np.log(FALSE_ALARM / (count - len(out) + 1)):
            wrong = len(out)
        for one in others:
            one.leave_out(worst)
    return out[: -(-wrong // _MOST)]


def _has_freedom(splines: list[SplineModes], count: int) -> bool:
    return all(count > spline.flat for spline in splines)


class _Others:
    """The spline of cross-validated smoothing through points, of which at most so many are left out one by one.

    Without the points D the matrix 1 - H becomes G - G_D (G_DD)^-1 G_D^T: a point is a step of its Cholesky
    factorisation, which takes the columns of D alone.
    """

    def __init__(self, spline: SplineModes, z: AnyArray, most: int) -> None:
        self._z, self._flat = z, spline.flat
        self._root = spline.root(spline.cross_validated(z))
        self._diagonal = (self._root**2).sum(axis=1)
        self._product = self._root @ (self._root.T @ z)
        self._out: list[int] = []
        self._columns, self._pivots = np.empty((len(z), most), order="F"), np.empty(most)

    def leave_out(self, point: int) -> None:
        """Fit the spline, with its smoothing, to the others."""
        known = len(self._out)
        columns, pivots = self._columns[:, :known], self._pivots[:known]
        column = self._root @ self._root[point] - columns @ (columns[point] / pivots)
        pivot = column[point]
        self._product -= column * (self._product[point] / pivot)
        self._diagonal -= column**2 / pivot
        self._columns[:, known], self._pivots[known] = column, pivot
        self._out.append(point)

    def residuals(self) -> _Residuals:
        """Of each point that is left from the spline through the others; 0 of those left out."""
        square, diagonal = np.abs(self._product) ** 2, self._diagonal.copy()
        square[self._out], diagonal[self._out] = 0.0, 1.0
        own = square / diagonal
        freedom = len(self._z) - len(self._out) - self._flat - 1
        kept = np.vdot(self._z, self._product) - np.vdot(self._z[self._out], self._product[self._out])
        rest = np.maximum(kept.real - own, 0.0)
        return _Residuals(own / diagonal, rest / freedom / diagonal, freedom)


def _fitting(points: ControlPoints, kept: BoolArray) -> BoolArray:
    """Which of the points that are not kept fit those that are."""
    u, z, rounding = _plane(points, kept)
    out, count = np.flatnonzero(~kept), int(kept.sum())
    residuals = []
    for order in _ORDERS:
        smoothing = SplineModes(u[kept], order).cross_validated(z[kept])
        spline = SplineModes(u, order)
        root = spline.root(smoothing)
        product = root @ (root.T @ z)
        # Block by block: the residuals of all these points from the spline through the others.
        covariance = np.linalg.inv(root[out] @ root[out].T)
        away = covariance @ product[out]
        rest = max(np.vdot(z, product).real - np.vdot(product[out], away).real, 0.0)
        freedom = count - spline.flat
        residuals.append(_Residuals(np.abs(away) ** 2, rest / freedom * covariance.diagonal(), freedom))
    fitting = np.zeros(len(kept), dtype=bool)
    fitting[out] = _log_chance(residuals, rounding) >= np.log(FALSE_ALARM / (count + 1))
    return fitting


def _log_chance(residuals: list[_Residuals], rounding: float) -> FloatArray:
    """The logarithm of the chance of residuals as long, by the spline that makes most of it."""
    square = np.min([one.square for one in residuals], axis=0)
    variance = np.maximum(np.max([one.variance for one in residuals], axis=0), rounding**2)
    freedom = min(one.freedom for one in residuals)
    return np.asarray(-freedom * np.log1p(square / variance / freedom))
