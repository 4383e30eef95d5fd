"""Newton's method with the exact Hessian, for maps that are linear in what is sought."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import Energy, Expansion

_STEPS = 60
_DONE = 1e-12  # of the energy: what a step would gain; after that step it is rounding, as Newton squares
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

    Directions of negative curvature are left out of the Hessian, which changes nothing near the minimum.
    """
    w = weights / weights.sum()
    C, value = start, _mean(energy, start, gradients, w)
    for step in range(_STEPS):
        slope, hessian = _assembled(energy.expansion(_jacobians(C, gradients)), gradients, w)
        change = _newton_step(slope, hessian).reshape(C.shape)
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
        if gain <= _DONE * value:
            break
    return Minimum(C, value, _STEPS)


def _jacobians(C: FloatArray, gradients: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("rk,nkb->nrb", C, gradients, optimize=True))


def _mean(energy: Energy, C: FloatArray, gradients: FloatArray, w: FloatArray) -> float:
    return float(np.sum(w * energy.value(_jacobians(C, gradients))))


def _assembled(found: Expansion, gradients: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The gradient (2 m,) and the Hessian (2 m, 2 m) by the coefficients, negative curvatures left out."""
    n, m, _ = gradients.shape
    slope = np.einsum("n,nrb,nkb->rk", w, found.gradient, gradients, optimize=True).ravel()
    root = np.sqrt(np.maximum(found.curvatures, 0.0) * w[:, None])
    scaled = found.directions * root[:, :, None, None]
    features = np.matmul(scaled.reshape(n, 8, 2), np.swapaxes(gradients, 1, 2)).reshape(4 * n, 2 * m)
    return slope, features.T @ features


def _newton_step(slope: FloatArray, hessian: FloatArray) -> FloatArray:
    """The step to the minimum of the quadratic, none along directions without curvature."""
    bends, axes = np.linalg.eigh(hessian)
    steep = bends > _FREE * bends[-1]
    along = axes[:, steep]
    return -along @ ((along.T @ slope) / bends[steep])
