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
        rest, slopes = _sheared(u + 1j * v, columns, angles, coefficients(place), free)
        rest, slopes = rest * root, slopes * root[:, None]
        return np.append(rest.real, rest.imag), np.vstack([slopes.real, slopes.imag])

    with np.errstate(over="ignore", invalid="ignore"):  # of steps that go too far, and are taken back
        found = coefficients(least_squares(terms, np.zeros(int(free.sum()))))
    return Shears(site.origin, site.size, angles, np.hstack([np.zeros((angles.size, 1)), found]))


def _independent(degree: int) -> BoolArray:
    """Which coefficients (degree + 2, degree) are needed: of y^k in k + 2 directions, spread over all of them."""
    free = np.zeros((degree + 2, degree), dtype=bool)
    for k in range(1, degree + 1):
        free[np.round(np.arange(k + 2) * (degree + 2) / (k + 2)).astype(int), k - 1] = True
    return free


def _sheared(z: Any, columns: Any, angles: FloatArray, coefficients: FloatArray, free: BoolArray) -> tuple[Any, Any]:
    """ln(a/b) / sqrt(2) as complex numbers (n,) whose angle is twice that of the larger scale, and their slopes (n, p).

    Columns (n, 2) are those of the base's Jacobian, coefficients (k, degree) those of the shears' y, y^2, ..., slopes
    those by the p coefficients that are `free`.
    """
    degree, count = coefficients.shape[1], int(free.sum())
    dz = np.zeros((count, z.size), dtype=complex)
    dc = np.zeros((2, count, z.size), dtype=complex)
    c, powers, first = columns.T, np.arange(1, degree + 1), 0
    for angle, own, chosen in zip(angles, coefficients, free, strict=True):
        turn, known = np.exp(-1j * angle), slice(0, first)  # later ones have changed nothing yet
        z, c = z * turn, c * turn
        dz[known] *= turn
        dc[:, known] *= turn
        y, along = z.imag, c.imag
        monomials = y ** np.arange(degree + 1)[:, None]
        by_y = powers[:, None] * monomials[:-1]
        slope = own @ by_y
        bend = own[1:] @ (powers[1:, None] * by_y[:-1]) if degree > 1 else np.zeros_like(y)
        dc[:, known] += slope * dc[:, known].imag + (bend * along)[:, None] * dz[known].imag
        dz[known] += slope * dz[known].imag
        mine = slice(first, first + int(chosen.sum()))
        dc[:, mine] += along[:, None] * by_y[chosen]
        dz[mine] += monomials[1:][chosen]
        c, z = c + slope * along, z + own @ monomials[1:]
        first = mine.stop
        known = slice(0, first)
        z, c = z / turn, c / turn
        dz[known] /= turn
        dc[:, known] /= turn
    return _anisotropy(c, dc)


def _anisotropy(c: Any, dc: Any) -> tuple[Any, Any]:
    """sqrt(2) atanh |mu| mu / |mu| and its slopes, mu the Beltrami coefficient of columns c (2, n)."""
    p, q = 0.5 * (c[0] - 1j * c[1]), 0.5 * (c[0] + 1j * c[1])
    dp, dq = 0.5 * (dc[0] - 1j * dc[1]), 0.5 * (dc[0] + 1j * dc[1])
    mu = q / p
    dmu = (dq - mu * dp) / p
    square = np.minimum(np.abs(mu) ** 2, 1.0 - 1e-12)
    far = square > _NEAR
    safe = np.where(far, square, 1.0 - 1e-12)
    ratio = np.where(far, np.arctanh(np.sqrt(safe)) / np.sqrt(safe), 1.0 + square / 3.0)
    change = np.where(far, (1.0 / (1.0 - square) - ratio) / safe, 2.0 / 3.0)  # twice d ratio / d square
    slopes = ratio * dmu + change * mu * (mu.conj() * dmu).real
    return _SQRT2 * ratio * mu, _SQRT2 * slopes.T
