"""The map nearest to several: the least sum of squared Fisher distances between Jacobians at the same points.

The Jacobians J_f of the map and J_i of one of several are taken at one point of the ground, and compared plane to
plane: Dist_F(J_f J_i^-1). Half of what parts the metrics G = J^T J in the geometry of positive definite matrices is
that distance, so that the Frechet mean of the G_i at each point is the best that a map could have there. It is the
metric of a map only where it is flat; what a map has more than it is due to its curvature.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.designs.newton import Minimum, minimise_energy
from projdist.matrices import Energy, mdt

__all__ = ["Targets", "common_turn"]

_ENERGY = Energy()


@dataclass(frozen=True, eq=False)
class Targets:
    """Jacobians J (k, n, 2, 2) of maps at points, what each map counts (k,), and what each point (n,), of sum 1."""

    J: FloatArray
    counts: FloatArray
    weight: FloatArray

    @functools.cached_property
    def inverses(self) -> FloatArray:
        """J^-1 (k, n, 2, 2)."""
        return np.asarray(np.linalg.inv(self.J), dtype=float)

    def total(self, J: FloatArray) -> float:
        """The sum over the maps of their count times the mean of Dist_F(J J_i^-1)^2, of Jacobians (n, 2, 2)."""
        squares = _ENERGY.value((J @ self.inverses).reshape(-1, 2, 2)).reshape(self.J.shape[:2])
        return float(self.counts @ squares @ self.weight)

    def mean_metric(self) -> FloatArray:
        """Upper triangular J (n, 2, 2) whose J^T J are the Frechet means of the maps' at each point."""
        transposed = np.swapaxes(self.J, 2, 3)
        return np.swapaxes(mdt(np.swapaxes(transposed, 0, 1), self.counts).T, 1, 2)

    def best_linear(self) -> FloatArray:
        """The upper triangular J (2, 2) of the least total, one for all points."""
        every = np.swapaxes(self.J, 2, 3).reshape(-1, 2, 2)
        return np.asarray(mdt(every, np.outer(self.counts, self.weight).ravel()).T.T)

    def nearest(self, gradients: FloatArray, start: FloatArray) -> Minimum:
        """The coefficients C (2, m) of the least total of J = C g, g (n, m, 2), from a start without folds."""
        stacked = np.concatenate([gradients @ inverse for inverse in self.inverses])
        return minimise_energy(_ENERGY, stacked, np.outer(self.counts, self.weight).ravel(), start)

    def not_elliptic(self, J: FloatArray) -> BoolArray:
        """The points (n,) at which the energy is not elliptic for one of the maps."""
        energies = _ENERGY.expansion((J @ self.inverses).reshape(-1, 2, 2))
        return np.asarray(~energies.is_elliptic().reshape(self.J.shape[:2]).all(axis=0))


def common_turn(J: FloatArray, weight: FloatArray) -> complex:
    """The turn that Jacobians (n, 2, 2) have in common, by the mean of their polar factors; 1 if there is none."""
    z = (J[:, 0, 0] + J[:, 1, 1]) + 1j * (J[:, 1, 0] - J[:, 0, 1])
    mean = complex(np.sum(weight * z / np.abs(z)))
    return mean / abs(mean) if abs(mean) > 0.0 else 1.0 + 0.0j
