"""Flexion and skewness in closed form, against quadrature in thirty digits. Laws of both are in test_measures."""

import mpmath
import numpy as np
import pytest

from projdist.matrices.flexion import flexion, skewness

RNG = np.random.default_rng(5)
# In units of rounding the closed form is good to ten or so; both measures are of the order of H / J.
RELATIVE = 1e-14


def product(which, v, w):
    return v[0] * w[1] - v[1] * w[0] if which is flexion else v[0] * w[0] + v[1] * w[1]


def quadrature(which, b, H):
    """Mean over directions of |numerator| / |v|^2 for J = diag(1, b): Gauss's rule between the numerator's zeros."""

    def parts(angle):
        c, s = mpmath.cos(angle), mpmath.sin(angle)
        v = (c, b * s)
        w = [H[i, 0, 0] * c * c + 2 * H[i, 0, 1] * c * s + H[i, 1, 1] * s * s for i in (0, 1)]
        return product(which, v, w), v[0] ** 2 + v[1] ** 2

    coarse = np.linspace(0, np.pi, 2001)
    signs = np.array([mpmath.sign(parts(angle)[0]) for angle in coarse])
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    zeros = [mpmath.findroot(lambda x: parts(x)[0], (coarse[k], coarse[k + 1]), solver="anderson") for k in changes]
    # |v| has its dip, as wide as b, at the right angle.
    dip = [mpmath.pi / 2 + side * b * wide for side in (-1, 1) for wide in (0.1, 1, 10, 100, 1000)]
    edges = sorted([0, mpmath.pi, mpmath.pi / 2, *zeros, *(at for at in dip if 0 < at < mpmath.pi)])
    return mpmath.quad(lambda x: abs(parts(x)[0]) / parts(x)[1], edges) / mpmath.pi


@pytest.mark.slow
@pytest.mark.parametrize("which", [flexion, skewness])
@pytest.mark.parametrize("b", [1.0, 1 - 1e-15, 1 - 1e-9, 0.999, 0.95, 0.9, 0.5, 1e-2, 1e-4])
def test_against_quadrature(which, b):
    """Means over directions to rounding, from conformal maps to ellipses of 1 : 10,000."""
    H = RNG.normal(size=(2, 2, 2))
    H = H + np.swapaxes(H, -1, -2)
    with mpmath.workdps(30):
        truth = float(quadrature(which, mpmath.mpf(b), H))
    assert which(np.diag([1.0, b]), H) == pytest.approx(truth, rel=RELATIVE)


@pytest.mark.parametrize("which", [flexion, skewness])
def test_forms_with_double_and_triple_zeros(which):
    """w along one axis only: |v x w| or |v . w| is |cos^3| or cos^2 |sin|, whose means are 4/(3 pi) and 2/(3 pi)."""
    H = np.zeros((2, 2, 2))
    H[0, 0, 0] = 1.0  # w = (cos^2, 0), v = (cos, sin)
    truth = {flexion: 2 / (3 * np.pi), skewness: 4 / (3 * np.pi)}[which]
    assert which(np.eye(2), H) == pytest.approx(truth, rel=RELATIVE)


@pytest.mark.parametrize("which", [flexion, skewness])
def test_a_singular_matrix_has_none(which):
    """Where J has no inverse the mean has no meaning: it is NaN, and there is no warning."""
    H = np.ones((2, 2, 2))
    for J in (np.zeros((2, 2)), np.diag([1.0, 0.0]), np.full((2, 2), np.nan)):
        assert np.isnan(which(J, H))
