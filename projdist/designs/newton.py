"""Newton's method with the exact Hessian, for maps that are linear in what is sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import Energy, Expansion

_STEPS = 60
_DONE = 1e-12  # of the energy: what a step would gain; after that step it is rounding, as Newton squares
_NOTHING = 1e-28  # energy of the rounding of Jacobians
_FREE = 1e-10  # of the largest curvature: turns and shifts cost nothing
_HALVINGS = 40
_SUFFICIENT = 1e-4  # of what the slope promises (Armijo)


@dataclass(frozen=True)
class Minimum:
    """Coefficients (2, m), the mean energy, and the Newton steps that led there."""

    coefficients: FloatArray
    energy: float
    steps: int


def minimise_energy(energy: Energy, gradients: FloatArray, weights: FloatArray, start: FloatArray) -> Minimum:
    """The coefficients C (2, m) for which the mean energy of J = C g, g (n, m, 2) at each point, is least.

    Far from the minimum directions of negative curvature are left out of the Hessian, near it nothing is.
    """
    w = weights / weights.sum()
    C, value = start, _mean(energy, start, gradients, w)
    for step in range(_STEPS):
        expansion = energy.expansion(_jacobians(C, gradients))
        slope = np.einsum("n,nrb,nkb->rk", w, expansion.gradient, gradients, optimize=True).ravel()
        change = _newton_step(slope, *_bends(expansion, gradients, w)).reshape(C.shape)
        gain = -float(np.sum(slope.reshape(C.shape) * change))
        share = 1.0
        for _ in range(_HALVINGS):
            trial = C + share * change
            found = _mean(energy, trial, gradients, w)
            if found <= value - _SUFFICIENT * share * gain:
                break
            share *= 0.5
        else:  # rounding is all that is left
            return Minimum(C, value, step)
        C, value = trial, found
        if gain <= max(_DONE * value, _NOTHING):
            return Minimum(C, value, step + 1)
    return Minimum(C, value, _STEPS)


def _jacobians(C: FloatArray, gradients: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("rk,nkb->nrb", C, gradients, optimize=True))


def _mean(energy: Energy, C: FloatArray, gradients: FloatArray, w: FloatArray) -> float:
    return float(np.sum(w * energy.value(_jacobians(C, gradients))))


def _bends(found: Expansion, gradients: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (2 m,) and eigenvectors of the Hessian, without negative curvatures where it has negative values."""
    above = _hessian(found, np.maximum(found.curvatures, 0.0), gradients, w)
    bends, axes = np.linalg.eigh(above - _hessian(found, np.maximum(-found.curvatures, 0.0), gradients, w))
    if bends[0] < -_FREE * bends[-1]:
        bends, axes = np.linalg.eigh(above)
    return bends, axes


def _hessian(found: Expansion, curvatures: FloatArray, gradients: FloatArray, w: FloatArray) -> FloatArray:
    """The Hessian (2 m, 2 m) by the coefficients, of curvatures (n, 4) that are not negative."""
    point, which = np.nonzero(curvatures)
    root = np.sqrt(curvatures[point, which] * w[point])
    scaled = found.directions[point, which] * root[:, None, None]
    features = np.matmul(scaled, np.swapaxes(gradients, 1, 2)[point]).reshape(len(point), 2 * gradients.shape[1])
    return np.asarray(features.T @ features)


def _newton_step(slope: FloatArray, bends: FloatArray, axes: FloatArray) -> FloatArray:
    """The step to the minimum of the quadratic, none along directions without curvature."""
    steep = bends > _FREE * bends[-1]
    along = axes[:, steep]
    return -along @ ((along.T @ slope) / bends[steep])
