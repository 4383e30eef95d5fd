"""The map of a region that distorts it least, of all polynomials of a degree after a base map."""

from __future__ import annotations

import numpy as np

from projdist.designs.newton import minimise_energy
from projdist.designs.plane_maps import Polynomials
from projdist.designs.sites import Site
from projdist.matrices import Energy
from projdist.numerics import PlanePolynomials

__all__ = ["general_map"]


def general_map(site: Site, energy: Energy, degree: int, share: float) -> Polynomials:
    """The best polynomial map of a degree, the surroundings having a share; raises ValueError where nodes are few."""
    weights = site.weights(share)
    counts = weights > 0.0
    u, v = (values[counts] for values in site.plane)
    basis = PlanePolynomials.over(u, v, weights[counts], degree)
    gradients = basis.gradients[:, 1:] @ site.J[counts] / site.size
    # The base itself, of which the size is the best one.
    plain = np.stack([u, v]) * weights[counts] @ basis.values[:, 1:]
    best = minimise_energy(energy, gradients, weights[counts], site.size * plain)
    coefficients = np.hstack([np.zeros((2, 1)), best.coefficients])
    return Polynomials(site.origin, site.size, basis.powers(coefficients))
