"""Random matrices for means and their cost by the definition, and matrices to be measured."""

import math

import numpy as np
import scipy.linalg
import scipy.optimize
from hypothesis import given, settings, strategies as st

from projdist.matrices.measures import MEASURES, get_measure

SEEDS = st.integers(0, 2**32 - 1)


def cases(sizes):
    """A decorator of tests of random matrices of these sizes n, by a seed: twelve examples."""
    return lambda test: settings(max_examples=12)(given(seed=SEEDS, n=st.sampled_from(sizes))(test))


CASES = cases([2, 3, 5])


def random_matrices(rng, count, n=2, spread=1.0):
    """Invertible matrices, exp of a normal one, of both orientations."""
    A = scipy.linalg.expm(spread * np.sqrt(2 / n) * rng.normal(size=(count, n, n)))
    A[::3, :, 0] *= -1
    return A


def random_orthogonal(rng, count, n=2):
    return np.linalg.qr(rng.normal(size=(count, n, n)))[0]


def transposed(A):
    return np.swapaxes(A, -1, -2)


def cholesky_factor(G):
    """The lower triangular L with a positive diagonal and L L^T = G G^T."""
    return np.linalg.cholesky(G @ transposed(G))


def fisher_squares(T, A):
    """The definition: Dist_F(T^-1 A_i)^2, by numpy's SVD."""
    return np.sum(np.log(np.linalg.svd(np.linalg.solve(T, A), compute_uv=False)) ** 2, axis=-1)


def cost(T, A, weights=None):
    """The weighted mean of the definition."""
    return float(np.average(fisher_squares(T, A), weights=weights))


def karcher(T, A, weights=None):
    """The weighted mean of ln(T^-1 A_i A_i^T T^-T), which vanishes at the Frechet mean (Karcher's equation)."""
    U, scales, _ = np.linalg.svd(np.linalg.solve(T, A))
    return np.average(U @ (2 * np.log(scales)[..., None] * transposed(U)), axis=0, weights=weights)


def around(G, count, spread, *, seed=1):
    """A, weights, and the cost of their mean G G^T: A_i = G exp(S_i / 2) Q_i, symmetric S_i of weighted mean 0.

    Karcher's equation of P_i = A_i A_i^T at G G^T is sum w_i S_i = 0, and Dist_F(exp(S / 2)) is half the norm of S.
    """
    rng, n = np.random.default_rng(seed), len(G)
    S = rng.normal(size=(count, n, n)) * spread
    S = S + transposed(S)
    w = rng.uniform(0.5, 2.0, count)
    S -= np.average(S, axis=0, weights=w)
    values, U = np.linalg.eigh(S)
    root = (U * np.exp(0.5 * values[:, None])) @ transposed(U)
    squares = np.sum(S * S, axis=(1, 2)) / 4
    return G @ root @ random_orthogonal(rng, count, n), w, float(np.average(squares, weights=w))


def graded(n, condition, seed=1):
    """A lower triangular matrix whose rows grow to this condition."""
    rng = np.random.default_rng(seed)
    return np.tril(rng.normal(size=(n, n)), -1) * 0.3 + np.diag(np.geomspace(1.0, condition, n))


MATRICES = np.random.default_rng(20240229).normal(size=(500, 2, 2))
MATRICES = MATRICES[np.linalg.cond(MATRICES) < 100]
POINTWISE = [name for name, measure in MEASURES.items() if not measure.needs_hessian]
SECOND_ORDER = [name for name, measure in MEASURES.items() if measure.needs_hessian]
MIRROR = np.diag([1.0, -1.0])


def value(name, J, H=None):
    return get_measure(name)(J, H)


def rotation(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.moveaxis(np.array([[c, -s], [s, c]]), (0, 1), (-2, -1))


@st.composite
def jacobians(draw):
    """Invertible matrices of condition up to 1e4, mirrored ones too."""
    log_a, log_ratio = draw(st.floats(-5, 5)), draw(st.floats(0, 9))
    left, right = draw(st.floats(0, 2 * math.pi)), draw(st.floats(0, 2 * math.pi))
    sign = draw(st.sampled_from([1.0, -1.0]))
    scales = np.diag([math.exp(log_a), sign * math.exp(log_a - log_ratio)])
    return rotation(left) @ scales @ rotation(right)
