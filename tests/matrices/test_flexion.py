"""Flexion and skewness against quadrature and closed forms."""

import math

import mpmath
import numpy as np
import pytest
from matrix_samples import MATRICES, MIRROR, SECOND_ORDER, rotation, value
from tables import each

from projdist.matrices.flexion import flexion, skewness

RNG = np.random.default_rng(20240229)


def mercator(lat):
    """J and H, per radian, of the Mercator projection along geodesics of the unit sphere."""
    tan, cos = math.tan(lat), math.cos(lat)
    # On a geodesic of azimuth z: lam' = sin z / cos, phi' = cos z, lam'' = 2 tan lam' phi', phi'' = -sin cos lam'^2;
    # with x = lam, y = the integral of dphi / cos.
    return np.eye(2) / cos, tan / cos * np.array([[[0.0, 1.0], [1.0, 0.0]], [[-1.0, 0.0], [0.0, 1.0]]])


def plate_carree(lat):
    """J and H, per radian, of x = lam, y = phi along geodesics of the unit sphere."""
    tan, cos = math.tan(lat), math.cos(lat)
    return np.diag([1 / cos, 1.0]), np.array([[[0.0, tan / cos], [tan / cos, 0.0]], [[-tan, 0.0], [0.0, 0.0]]])


def azimuthal(radius, first, second, c):
    """J and H of r(c), by r, r' and r'', at the distance c north of the centre, in axes east and north (outwards)."""
    # Along the radius the map's velocity is r'; a step across turns about the centre: at unit speed across,
    # the azimuth grows as 1 / sin c and the distance curves outwards by c'' = cot c.
    across, cot = radius / math.sin(c), 1.0 / math.tan(c)
    # x'' = 2 r' theta' c' + r theta'' with theta'' = -2 cot c theta' c'; y'' = r'' c'^2 + r' c'' - r theta'^2.
    mixed = (first - radius * cot) / math.sin(c)
    h_y = [[first * cot - across / math.sin(c), 0.0], [0.0, second]]
    return np.diag([across, first]), np.array([[[0.0, mixed], [mixed, 0.0]], h_y])


def stereographic(c):
    cos = math.cos(c / 2)
    return azimuthal(2 * math.tan(c / 2), 1 / cos**2, math.sin(c / 2) / cos**3, c)


def gnomonic(c):
    return azimuthal(math.tan(c), 1 / math.cos(c) ** 2, 2 * math.sin(c) / math.cos(c) ** 3, c)


@each("name", SECOND_ORDER)
def test_flexion_and_skewness_of_conformal_maps(name):
    """Both are (2 / pi) |grad ln k|: of Mercator's map |tan lat|, whose mean is Goldberg & Gott's 0.64."""
    for lat in [-1.4, -0.5, 1e-6, 0.3, 1.0, 1.5]:
        J, H = mercator(lat)
        # rel: 24 nodes are exact for |cos|; what is left is the arcs' ends.
        assert value(name, J, H) == pytest.approx(2 / math.pi * abs(math.tan(lat)), rel=1e-12)
    for c in [1e-3, 0.5, 1.0, 2.0, 3.0]:  # from the centre of the stereographic map, where ln k = -2 ln cos(c / 2)
        J, H = stereographic(c)
        assert value(name, J, H) == pytest.approx(2 / math.pi * math.tan(c / 2), rel=1e-9)


def test_gnomonic_has_no_flexion():
    """Great circles are straight on the gnomonic map: no flexion (Goldberg & Gott 2007, section 3)."""
    for c in (0.1, 0.7, 1.3):
        J, H = gnomonic(c)
        assert value("flexion", J, H) == pytest.approx(0.0, abs=1e-14)
        assert value("skewness", J, H) > 0.1 * c


def mean_over_directions(J, H, product):
    """Trapezoids on 2^18 directions; the kinks of the absolute value cost 1e-9 or so."""
    angle = np.linspace(0, np.pi, 2**18, endpoint=False)
    t = np.stack([np.cos(angle), np.sin(angle)])
    v = J @ t
    w = np.einsum("ijk,jd,kd->id", H, t, t)
    return np.mean(np.abs(product(v, w)) / np.sum(v * v, axis=0))


PRODUCTS = {"flexion": lambda v, w: v[0] * w[1] - v[1] * w[0], "skewness": lambda v, w: v[0] * w[0] + v[1] * w[1]}


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_second_order_measures_of_plate_carree(name):
    """On the plate carree they are the means over directions of the graticule's own geodesic equations."""
    for lat in (0.2, 0.9, 1.4):
        J, H = plate_carree(lat)
        assert value(name, J, H) == pytest.approx(mean_over_directions(J, H, PRODUCTS[name]), rel=1e-8)


@each("name", SECOND_ORDER)
def test_second_order_measures_are_invariant(name):
    """They do not change with the map's scale, a turn or mirror of the map, or a turn of the local frame."""
    J = MATRICES[:100]
    H = RNG.normal(size=(len(J), 2, 2, 2))
    H = H + np.swapaxes(H, -1, -2)
    R, Q = rotation(0.7) @ MIRROR, rotation(2.3)
    turned = np.einsum("ai,nijk,jb,kc->nabc", 3.0 * R, H, Q, Q)
    mild = np.linalg.cond(J) < 10
    np.testing.assert_allclose(value(name, 3.0 * R @ J @ Q, turned)[mild], value(name, J, H)[mild], rtol=1e-9)


@each("name", SECOND_ORDER)
def test_second_order_measures_of_batches_and_degenerate_input(name):
    """J and H (..., 2, 2, 2) give values (...); H = 0 gives 0; what is singular or undefined NaN, without a warning."""
    J, H = mercator(0.5)
    for shape in [(), (4,), (2, 3)]:
        result = value(name, np.broadcast_to(J, (*shape, 2, 2)), np.broadcast_to(H, (*shape, 2, 2, 2)))
        assert np.shape(result) == shape
        np.testing.assert_allclose(result, 2 / math.pi * math.tan(0.5), rtol=1e-12)
    eye, zero, H = np.eye(2), np.zeros((2, 2, 2)), RNG.normal(size=(2, 2, 2))
    assert value(name, eye, zero) == 0.0
    assert value(name, np.stack([eye, eye]), np.stack([zero, H])).shape == (2,)
    for J, second in ((np.full((2, 2), np.nan), H), (eye, zero * np.nan), (np.zeros((2, 2)), H)):
        assert np.isnan(value(name, J, second))
    assert np.isnan(value(name, np.diag([1.0, 0.0]), np.ones((2, 2, 2))))


# In units of rounding the closed form is good to ten or so; both measures are of the order of H / J.
RELATIVE = 1e-14


def quadrature(which, b, H):
    """Mean over directions of |numerator| / |v|^2 for J = diag(1, b): Gauss's rule between the numerator's zeros."""

    def parts(angle):
        c, s = mpmath.cos(angle), mpmath.sin(angle)
        v = (c, b * s)
        w = [H[i, 0, 0] * c * c + 2 * H[i, 0, 1] * c * s + H[i, 1, 1] * s * s for i in (0, 1)]
        return PRODUCTS[which.__name__](v, w), v[0] ** 2 + v[1] ** 2

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
