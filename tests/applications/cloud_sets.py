"""Clouds of points made by known affine maps; for the tests of registered clouds."""

import numpy as np
import scipy.linalg

EXACT = 1e-10  # rounding, with maps of condition 10 or so


def maps(rng, n, count):
    """Invertible matrices of positive determinant, and shifts."""
    return scipy.linalg.expm(0.6 / np.sqrt(n) * rng.normal(size=(count, n, n))), 10 * rng.normal(size=(count, n))


def moved(clouds, B, s):
    return np.einsum("nij,nmj->nmi", B, clouds) + s[:, None]


def made(rng, n, count=5, points=30, noise=0.0):
    """Clouds B_i (z + noise) + s_i, and B_i: a set of points mapped by known maps."""
    z = rng.normal(size=(points, n))
    B, s = maps(rng, n, count)
    return moved(z + noise * rng.normal(size=(count, points, n)), B, s), B
