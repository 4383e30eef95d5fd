"""The equal-area map of a region that distorts it least: shears in many directions after an equal-area base.

A shear x + f(y) keeps areas exactly, and its inverse is x - f(y). Polynomial shears of a degree in two more directions
than that have all area-preserving maps of the degree between them, to first order.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.designs.plane_maps import Shears
from projdist.designs.sites import Site
from projdist.numerics import least_squares

__all__ = ["equal_area_map"]

_NEAR = 1e-8  # of |mu|^2: there atanh(t) / t is its series to rounding
_SQRT2 = float(np.sqrt(2.0))


def equal_area_map(site: Site, degree: int, share: float) -> Shears:
    """The best map by shears of a degree; the surroundings have a share."""
    weights = site.weights(share)
    counts = weights > 0.0
    u, v = (values[counts] for values in site.plane)
    columns = site.J[counts, 0] + 1j * site.J[counts, 1]
    root = np.sqrt(weights[counts])
    angles = np.pi * np.arange(degree + 2) / (degree + 2)
    free = _independent(degree)

    def coefficients(place: FloatArray) -> FloatArray:
        whole = np.zeros(free.shape)
        whole[free] = place
        return whole

    def terms(place: FloatArray) -> tuple[FloatArray, FloatArray]:
        rest, slopes = _sheared(u + 1j * v, columns, angles, coefficients(place))
        rest, slopes = rest * root, slopes[:, free.ravel()] * root[:, None]
        return np.append(rest.real, rest.imag), np.vstack([slopes.real, slopes.imag])

    found = coefficients(least_squares(terms, np.zeros(int(free.sum()))))
    return Shears(site.origin, site.size, angles, np.hstack([np.zeros((angles.size, 1)), found]))


def _independent(degree: int) -> BoolArray:
    """Which coefficients (degree + 2, degree) are needed: of y^k in k + 2 directions, spread over all of them."""
    free = np.zeros((degree + 2, degree), dtype=bool)
    for k in range(1, degree + 1):
        free[np.round(np.arange(k + 2) * (degree + 2) / (k + 2)).astype(int), k - 1] = True
    return free


def _sheared(z: Any, columns: Any, angles: FloatArray, coefficients: FloatArray) -> tuple[Any, Any]:
    """ln(a/b) / sqrt(2) as complex numbers (n,) whose angle is twice that of the larger scale, and their slopes (n, p).

    Columns (n, 2) are those of the base's Jacobian, coefficients (k, degree) those of the shears' y, y^2, ...
    """
    degree = coefficients.shape[1]
    dz = np.zeros((z.size, coefficients.size), dtype=complex)
    dc = np.zeros((2, z.size, coefficients.size), dtype=complex)
    c = columns.T
    powers = np.arange(1, degree + 1)
    for k, (angle, own) in enumerate(zip(angles, coefficients, strict=True)):
        turn = np.exp(-1j * angle)
        z, dz, c, dc = z * turn, dz * turn, c * turn, dc * turn
        y = z.imag
        monomials = y[:, None] ** np.arange(degree + 1)
        by_y = powers * monomials[:, :-1]
        slope = by_y @ own
        bend = (powers[1:] * powers[:-1] * monomials[:, :-2]) @ own[1:] if degree > 1 else np.zeros_like(y)
        mine = slice(k * degree, (k + 1) * degree)
        along = c.imag
        dc = dc + slope[:, None] * dc.imag + (bend * along)[..., None] * dz.imag
        dc[..., mine] += along[..., None] * by_y
        dz = dz + slope[:, None] * dz.imag
        dz[:, mine] += monomials[:, 1:]
        c, z = c + slope * along, z + monomials[:, 1:] @ own
        z, dz, c, dc = z / turn, dz / turn, c / turn, dc / turn
    return _anisotropy(c, dc)


def _anisotropy(c: Any, dc: Any) -> tuple[Any, Any]:
    """sqrt(2) atanh |mu| mu / |mu| and its slopes, mu the Beltrami coefficient of columns c (2, n)."""
    p, q = 0.5 * (c[0] - 1j * c[1]), 0.5 * (c[0] + 1j * c[1])
    dp, dq = 0.5 * (dc[0] - 1j * dc[1]), 0.5 * (dc[0] + 1j * dc[1])
    mu = q / p
    dmu = (dq - mu[:, None] * dp) / p[:, None]
    square = np.minimum(np.abs(mu) ** 2, 1.0 - 1e-12)
    safe = np.where(square > _NEAR, square, 1.0)
    ratio = np.where(
        square > _NEAR, np.arctanh(np.sqrt(np.minimum(safe, 1.0 - 1e-12))) / np.sqrt(safe), 1.0 + square / 3.0
    )
    change = np.where(square > _NEAR, (1.0 / (1.0 - square) - ratio) / safe, 2.0 / 3.0)  # 2 d ratio / d square
    slopes = ratio[:, None] * dmu + (change * mu)[:, None] * (mu.conj()[:, None] * dmu).real
    return _SQRT2 * ratio * mu, _SQRT2 * slopes
