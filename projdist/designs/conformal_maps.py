"""The conformal map of a region that distorts it least: with a conformal base of scale k0, ln k = ln k0 + Re p(z).

For a polynomial p that is a linear problem: of least squares, of p-norms by weights, of the largest value by a linear
programme (P. Chebyshev 1856). The map is the integral of exp(p), whose derivative vanishes nowhere, so that it cannot
fold. The early ones: Laborde 1928, Reilly 1973 (Survey Review 22:108, the New Zealand Map Grid), Snyder 1984 (Alaska).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.designs.plane_maps import ComplexPolynomial
from projdist.designs.sites import Site
from projdist.numerics import ComplexPolynomials, fit_harmonic

__all__ = ["conformal_map"]

_ENOUGH = 1e-13  # of the map's size: what is left of exp(p) at the farthest node
_MOST = 36  # degree of the map: powers of 1e8 m are numbers yet
_FITTED = range(8, 33, 4)  # degrees of exp(p) where its series does not end in time
_CLOSE = 1e-9  # of scales


def conformal_map(site: Site, degree: int, norm: float, share: float) -> ComplexPolynomial:
    """The best conformal map whose ln k is a polynomial of a degree, by a norm of ln k: 2, more, or infinite.

    Raises ValueError for a degree that the nodes do not resolve, or beside which scales are no numbers.
    """
    weights = site.weights(share)
    counts = site.in_region if np.isinf(norm) else weights > 0.0
    u, v = site.plane
    z = u + 1j * v
    log_scale = 0.5 * np.log(np.linalg.det(site.J))
    fit = fit_harmonic(z[counts], log_scale[counts], weights[counts], degree, norm)
    slopes = _series(fit.powers)
    if np.abs(slopes[-1]) > _ENOUGH * np.abs(slopes).max():
        counts = weights > 0.0
        slopes = _fitted(fit.powers, z[counts], weights[counts])
    whole = np.concatenate([[0.0], slopes / np.arange(1, len(slopes) + 1)]) * site.size
    counting = np.flatnonzero(np.abs(whole) > _ENOUGH * np.abs(whole).max())
    return ComplexPolynomial(site.origin, site.size, whole[: counting[-1] + 1])


def _series(powers: Any) -> Any:
    """The Taylor series of exp(p), by n e_n = sum of k p_k e_(n-k)."""
    terms = np.zeros(_MOST, dtype=complex)
    terms[0] = np.exp(powers[0])
    for n in range(1, _MOST):
        k = np.arange(1, min(n + 1, len(powers)))
        terms[n] = np.sum(k * powers[k] * terms[n - k]) / n
    return terms


def _fitted(powers: Any, z: Any, weights: FloatArray) -> Any:
    """The polynomial nearest to exp(p) at points, of the lowest degree that comes near enough, or the nearest one.

    Between the region and the disc about it exp(p) may be so large that its series converges late. Raises ValueError
    where it is no number.
    """
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        wanted = np.exp(np.polynomial.polynomial.polyval(z, powers))
        root = np.sqrt(weights) / np.abs(wanted)
    if not (np.isfinite(wanted).all() and np.isfinite(root).all()):
        raise ValueError("Scales beside the region are beyond all numbers.")
    best, least = None, np.inf
    for degree in _FITTED:
        try:
            basis = ComplexPolynomials.over(z, weights, degree)
        except ValueError:
            break
        found = basis.powers(np.linalg.lstsq(basis.values * root[:, None], wanted * root, rcond=None)[0])
        off = float(np.abs(np.polynomial.polynomial.polyval(z, found) / wanted - 1.0).max())
        if off < least:
            best, least = found, off
        if off < _CLOSE:
            break
    if best is None:
        raise ValueError(f"{z.size} points do not tell the map.")
    return best
