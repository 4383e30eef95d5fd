"""The conformal map of a region that distorts it least: with a conformal base of scale k0, ln k = ln k0 + Re p(z).

For a polynomial p that is a linear problem: of least squares, of p-norms by weights, of the largest value by a linear
programme (P. Chebyshev 1856). The map is the integral of exp(p), whose derivative vanishes nowhere, so that it cannot
fold. The early ones: Laborde 1928, Reilly 1973 (Survey Review 22:108, the New Zealand Map Grid), Snyder 1984 (Alaska).
"""

from __future__ import annotations

import numpy as np

from projdist.designs.plane_maps import ComplexPolynomial
from projdist.designs.sites import Site
from projdist.numerics import fit_harmonic

__all__ = ["conformal_map"]

_ENOUGH, _MOST = 1e-13, 48  # of the map's size: what is left of exp(p) at the farthest node; and its degree


def conformal_map(site: Site, degree: int, norm: float, share: float) -> ComplexPolynomial:
    """The best conformal map whose ln k is a polynomial of a degree, by a norm of ln k: 2, more, or infinite.

    Raises ValueError for a degree that the nodes do not resolve.
    """
    counts = site.in_region if np.isinf(norm) else site.weights(share) > 0.0
    u, v = site.plane
    log_scale = 0.5 * np.log(np.linalg.det(site.J))
    fit = fit_harmonic((u + 1j * v)[counts], log_scale[counts], site.weights(share)[counts], degree, norm)
    terms = np.zeros(_MOST, dtype=complex)
    terms[0] = np.exp(fit.powers[0])
    for n in range(1, _MOST):  # n e_n = sum of k p_k e_(n-k), of exp(p) = sum of e_n z^n
        k = np.arange(1, min(n, degree) + 1)
        terms[n] = np.sum(k * fit.powers[k] * terms[n - k]) / n
    whole = np.concatenate([[0.0], terms / np.arange(1, _MOST + 1)]) * site.size
    counting = np.flatnonzero(np.abs(whole) > _ENOUGH * np.abs(whole).max())
    return ComplexPolynomial(site.origin, site.size, whole[: counting[-1] + 1])
