"""Newton's method with the exact Hessian, for maps that are linear in their coefficients and for maps of elements."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.matrices import Energy, Expansion

_STEPS = 60
_DONE = 1e-12  # relative gain of the last step: convergence is quadratic, so that the next gain is rounding
_NOTHING = 1e-28  # energy of the rounding of Jacobians
_FREE = 1e-10  # of the largest curvature: turns and shifts have less
_HALVINGS = 40
_SUFFICIENT = 1e-4  # of what the slope promises (Armijo)


class EnergyMinimum(NamedTuple):
    """The place of a minimum, coefficients (2, m) or unknowns (m,), the mean energy, and the number of Newton steps."""

    place: FloatArray
    energy: float
    steps: int


def minimise_energy(energy: Energy, gradients: FloatArray, weights: FloatArray, start: FloatArray) -> EnergyMinimum:
    """The coefficients C (2, m) that minimise the mean energy of J = C g, with g (n, m, 2) at the points."""
    # Far from the minimum, negative curvatures are left out of the Hessian.
    w = weights / weights.sum()

    def jacobians(C: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("rk,nkb->nrb", C, gradients, optimize=True))

    def mean(C: FloatArray) -> float:
        return float(np.sum(w * energy.value(jacobians(C))))

    C, value = start, mean(start)
    for step in range(_STEPS):
        expansion = energy.expansion(jacobians(C))
        slope = np.einsum("n,nrb,nkb->rk", w, expansion.gradient, gradients, optimize=True).ravel()
        bends, axes = _curvatures(expansion, gradients, w)
        steep = bends > _FREE * bends[-1]
        along = axes[:, steep]
        change = (-along @ ((along.T @ slope) / bends[steep])).reshape(C.shape)
        gain = -float(np.sum(slope.reshape(C.shape) * change))
        reached = _line_search(mean, C, value, change, gain)
        if reached is None:
            return EnergyMinimum(C, value, step)
        C, value = reached
        if gain <= max(_DONE * value, _NOTHING):
            return EnergyMinimum(C, value, step + 1)
    return EnergyMinimum(C, value, _STEPS)


def _line_search(
    mean: Callable[[FloatArray], float], place: FloatArray, value: float, change: FloatArray, gain: float
) -> tuple[FloatArray, float] | None:
    """The place after a step, halved until the mean falls enough, and its mean; None if only rounding is left."""
    share = 1.0
    for _ in range(_HALVINGS):
        trial = place + share * change
        found = mean(trial)
        if found <= value - _SUFFICIENT * share * gain:
            return trial, found
        share *= 0.5
    return None


def _curvatures(found: Expansion, gradients: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (2 m,) and eigenvectors of the Hessian, without negative curvatures if it is not positive."""

    def hessian(curvatures: FloatArray) -> FloatArray:
        """The part of the Hessian due to curvatures (n, 4) of at least 0."""
        point, which = np.nonzero(curvatures)
        root = np.sqrt(curvatures[point, which] * w[point])
        scaled = found.directions[point, which] * root[:, None, None]
        features = np.matmul(scaled, np.swapaxes(gradients, 1, 2)[point]).reshape(len(point), 2 * gradients.shape[1])
        return np.asarray(features.T @ features)

    above = hessian(np.maximum(found.curvatures, 0.0))
    bends, axes = np.linalg.eigh(above - hessian(np.maximum(-found.curvatures, 0.0)))
    return (bends, axes) if bends[0] >= -_FREE * bends[-1] else np.linalg.eigh(above)


# ---- maps of elements ----------------------------------------------------------------------------

_ELEMENT_STEPS = 200
_ELEMENTS_DONE = 1e-13  # relative gain of the last step
_RIDGE = 1e-12  # added to the diagonal of a Hessian that may be singular without its negative curvatures


@dataclass(frozen=True, eq=False)
class Elements:
    """e elements of q nodes, where a map has the Jacobians J_rb = sum over a of c_ra g_ab with unknowns c_ra."""

    numbers: IntArray  # (2, e, a), of the unknowns, close ones for close elements; negative where c_ra is 0
    signs: FloatArray  # (2, e, a), by which unknowns are multiplied
    gradients: FloatArray  # (e, q, a, 2), of the basis functions by metres east and north
    weights: FloatArray  # (e, q), of sum 1
    count: int  # of unknowns

    def jacobians(self, unknowns: FloatArray) -> FloatArray:
        """Jacobians (e q, 2, 2) of the map."""
        local = self.signs * np.append(unknowns, 0.0)[self.numbers]
        e, q, _, _ = self.gradients.shape
        return np.asarray(np.matmul(np.moveaxis(local, 0, 1)[:, None], self.gradients).reshape(e * q, 2, 2))

    def mean(self, energy: Energy, unknowns: FloatArray) -> float:
        """The mean energy; infinite if the map folds at a node."""
        return float(np.sum(self.weights.ravel() * energy.value(self.jacobians(unknowns))))

    def slope(self, found: Expansion) -> FloatArray:
        """The derivatives (m,) of the mean energy."""
        e, q, _, _ = self.gradients.shape
        weighted = (self.weights.ravel()[:, None, None] * found.gradient).reshape(e, q, 2, 2)
        local = np.einsum("eqrb,eqab->rea", weighted, self.gradients, optimize=True) * self.signs
        kept = self.numbers >= 0
        return np.asarray(np.bincount(self.numbers[kept], local[kept], self.count), dtype=float)

    def hessian(self, found: Expansion, *, projected: bool) -> FloatArray:
        """The second derivatives in LAPACK's upper band (width + 1, m); `projected` leaves out negative curvatures."""
        e, q, a, _ = self.gradients.shape
        curvatures = np.maximum(found.curvatures, 0.0) if projected else found.curvatures
        bends = (self.weights.ravel()[:, None] * curvatures).reshape(e, 4 * q, 1)
        directions = found.directions.reshape(e, q, 8, 2)
        features = np.matmul(directions, np.swapaxes(self.gradients, 2, 3)).reshape(e, 4 * q, 2 * a)
        features = features * np.moveaxis(self.signs, 0, 1).reshape(e, 1, 2 * a)
        local = np.matmul(np.swapaxes(features, 1, 2), bends * features)
        width, kept, places = self._band
        band = np.bincount(places, local.ravel()[kept], (width + 1) * self.count)
        return np.asarray(band, dtype=float).reshape(width + 1, self.count)

    @functools.cached_property
    def _band(self) -> tuple[int, IntArray, IntArray]:
        """The band's width, the entries of the elements' Hessians that are kept, and their places in the band."""
        e, a = self.numbers.shape[1:]
        numbers = np.moveaxis(self.numbers, 0, 1).reshape(e, 2 * a)
        row, column = (part.ravel() for part in np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :]))
        kept = np.flatnonzero((row >= 0) & (row <= column))
        row, column = row[kept], column[kept]
        width = int((column - row).max())
        return width, kept, (width + row - column) * self.count + column


def minimise_elements(energy: Energy, elements: Elements, start: FloatArray) -> EnergyMinimum:
    """The unknowns that minimise the mean energy; raises ValueError for a start that folds."""
    # If the Hessian is not positive definite, negative curvatures are left out, node by node.
    from scipy.linalg import solveh_banded  # scipy is slow to load, and few need it

    unknowns, value = start, elements.mean(energy, start)
    if not np.isfinite(value):
        raise ValueError("Invalid start of a map. It folds.")
    for step in range(_ELEMENT_STEPS):
        found = energy.expansion(elements.jacobians(unknowns))
        slope = elements.slope(found)
        try:
            change = -np.asarray(solveh_banded(elements.hessian(found, projected=False), slope, check_finite=False))
        except np.linalg.LinAlgError:  # it is not positive definite
            band = elements.hessian(found, projected=True)
            band[-1] *= 1.0 + _RIDGE
            change = -np.asarray(solveh_banded(band, slope, check_finite=False))
        gain = -float(slope @ change)
        if gain <= _ELEMENTS_DONE * value:
            return EnergyMinimum(unknowns, value, step)
        reached = _line_search(lambda trial: elements.mean(energy, trial), unknowns, value, change, gain)
        if reached is None:
            return EnergyMinimum(unknowns, value, step)
        unknowns, value = reached
    return EnergyMinimum(unknowns, value, _ELEMENT_STEPS)
