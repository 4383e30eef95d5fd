"""The geometry of symmetric positive definite matrices: closed forms and isometries."""

import numpy as np
import pytest
import scipy.linalg

from projdist import spd


def some(n, count, seed=1):
    """Symmetric positive definite matrices."""
    A = np.random.default_rng(seed).normal(size=(count, n, n)) + 2 * np.eye(n)
    return A @ A.swapaxes(-1, -2)


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_distance(n):
    """d(P, Q)^2 is the sum of ln^2 of the eigenvalues of P^-1 Q, by scipy; congruence keeps it."""
    P, Q = some(n, 5), some(n, 5, seed=2)
    truth = [
        np.sqrt(np.sum(np.log(scipy.linalg.eigh(q, p, eigvals_only=True)) ** 2)) for p, q in zip(P, Q, strict=True)
    ]
    np.testing.assert_allclose(spd.distance(P, Q), truth, rtol=1e-10)
    M = np.random.default_rng(3).normal(size=(n, n)) + 2 * np.eye(n)
    np.testing.assert_allclose(spd.distance(M @ P @ M.T, M @ Q @ M.T), truth, rtol=1e-8)


@pytest.mark.parametrize("n", [2, 4])
def test_geodesics(n):
    """A geodesic has constant speed, and exp takes back what log gives."""
    P, Q = some(n, 4), some(n, 4, seed=2)
    whole = spd.distance(P, Q)
    np.testing.assert_allclose(spd.distance(P, spd.geodesic(P, Q, 0.3)), 0.3 * whole, rtol=1e-9)
    np.testing.assert_allclose(spd.exp(P, spd.log(P, Q)), Q, rtol=1e-9, atol=1e-9)
    V = spd.log(P, Q)
    np.testing.assert_allclose(spd.metric(P, V, V), whole**2, rtol=1e-9)


@pytest.mark.parametrize("n", [2, 3])
def test_lq(n):
    """A = L Q with L lower triangular of positive diagonal, Q orthogonal."""
    A = np.random.default_rng(4).normal(size=(6, n, n))
    L, Q = spd.lq(A)
    np.testing.assert_allclose(L @ Q, A, atol=1e-13)
    np.testing.assert_allclose(Q @ Q.swapaxes(-1, -2), np.broadcast_to(np.eye(n), Q.shape), atol=1e-13)
    assert (np.diagonal(L, axis1=-2, axis2=-1) > 0).all()
    np.testing.assert_array_equal(L, np.tril(L))
    np.testing.assert_allclose(spd.from_lower(spd.to_lower(A @ A.swapaxes(-1, -2))), A @ A.swapaxes(-1, -2), atol=1e-12)


def test_indefinite():
    """What is not positive definite is refused."""
    with pytest.raises(ValueError, match="Invalid matrix"):
        spd.distance(np.diag([1.0, -1.0]), np.eye(2))
