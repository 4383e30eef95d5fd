"""The geometry of SPD(n) against its theorems, generalised eigenvalues and high precision."""

import mpmath
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from matrix_samples import SEEDS
from refusals import refuses
from tables import each

from projdist import spd
from projdist.matrices.measures import get_measure

CASES = given(seed=SEEDS, n=st.sampled_from([1, 2, 3, 5]))


def random_matrices(rng, count, n, spread=0.5):
    """Invertible matrices of both orientations."""
    A = scipy.linalg.expm(spread * rng.normal(size=(count, n, n)))
    A[::2, :, 0] *= -1
    return A


def random_spd(rng, count, n, spread=0.5):
    A = random_matrices(rng, count, n, spread)
    return A @ np.swapaxes(A, 1, 2)


def random_symmetric(rng, count, n):
    V = rng.normal(size=(count, n, n))
    return V + np.swapaxes(V, 1, 2)


def distance(P, Q):
    """The definition: generalised eigenvalues of one pair, by scipy."""
    return np.sqrt(np.sum(np.log(scipy.linalg.eigvalsh(Q, P)) ** 2))


@CASES
def test_lq_and_the_cholesky_map(seed, n):
    """A = L Q, L lower triangular with a positive diagonal, Q orthogonal; L is the Cholesky factor of A A^T."""
    rng = np.random.default_rng(seed)
    A = random_matrices(rng, 6, n)
    L, Q = spd.lq(A)
    np.testing.assert_allclose(L @ Q, A, rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(L, np.tril(L))
    assert (np.einsum("ikk->ik", L) > 0).all()
    np.testing.assert_allclose(Q @ np.swapaxes(Q, 1, 2), np.broadcast_to(np.eye(n), Q.shape), atol=1e-14)
    np.testing.assert_allclose(L, np.linalg.cholesky(A @ np.swapaxes(A, 1, 2)), rtol=1e-9, atol=1e-11)
    # `to_lower` and `from_lower` undo each other, both ways.
    P = random_spd(rng, 4, n)
    np.testing.assert_allclose(spd.from_lower(spd.to_lower(P)), P, rtol=1e-13, atol=1e-13)
    L = np.tril(rng.normal(size=(4, n, n)), -1) + np.exp(rng.normal(size=(4, n, 1))) * np.eye(n)
    np.testing.assert_allclose(spd.to_lower(spd.from_lower(L)), L, rtol=1e-11, atol=1e-11)


@CASES
def test_distance(seed, n):
    """d_F(P, Q)^2 is the sum of ln^2 of the eigenvalues of P^-1 Q, a metric, which isometries keep."""
    rng = np.random.default_rng(seed)
    A, B, C, G = random_matrices(rng, 4, n)
    P, Q, R = A @ A.T, B @ B.T, C @ C.T
    found = spd.distance(P, Q)
    assert found == pytest.approx(distance(P, Q), rel=1e-9, abs=1e-12)
    # Twice the Fisher distortion of factors, on all of GL(n).
    fisher = get_measure("fisher")(np.linalg.solve(A, B))
    assert found == pytest.approx(2 * fisher, rel=1e-9)
    assert spd.factor_distance(A, B) == pytest.approx(2 * fisher, rel=1e-13)
    # 0 to itself, symmetric, and no detour is shorter.
    assert spd.distance(P, P) == pytest.approx(0.0, abs=1e-12)
    assert found == pytest.approx(spd.distance(Q, P), rel=1e-10)
    assert spd.distance(P, R) <= found + spd.distance(Q, R) + 1e-12
    # Congruences P -> G P G^T and the inversion keep it.
    assert spd.distance(G @ P @ G.T, G @ Q @ G.T) == pytest.approx(found, rel=1e-8)
    assert spd.distance(np.linalg.inv(P), np.linalg.inv(Q)) == pytest.approx(found, rel=1e-8)


@each("n", [2, 3])
def test_factors_keep_what_products_lose(n):
    """Between factors of condition 1e6 (products 1e12) the distance is right to 1e-9, as mpmath has it."""
    rng = np.random.default_rng(7)
    turn, back = np.linalg.qr(rng.normal(size=(2, n, n)))[0]
    A = turn @ np.diag(np.geomspace(1e3, 1e-3, n)) @ back
    B = A @ (np.eye(n) + 0.3 * rng.normal(size=(n, n)))
    with mpmath.workdps(40):
        scales = mpmath.svd_r(mpmath.matrix(A) ** -1 * mpmath.matrix(B), compute_uv=False)
        truth = float(2 * mpmath.sqrt(sum(mpmath.log(s) ** 2 for s in scales)))
    assert spd.factor_distance(A, B) == pytest.approx(truth, rel=1e-9)


@CASES
def test_geodesic(seed, n):
    """It joins its ends at constant speed; at a half it is the geometric mean (Bhatia 2007, equation 6.11)."""
    rng = np.random.default_rng(seed)
    P, Q = random_spd(rng, 2, n, 0.3)
    G, length = random_matrices(rng, 1, n)[0], distance(P, Q)
    t = np.array([0.0, 0.3, 0.5, 1.0, 1.7])
    points = spd.geodesic(P, Q, t)
    np.testing.assert_allclose(points[[0, 3]], [P, Q], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose([distance(P, point) for point in points], t * length, rtol=1e-7, atol=1e-7)
    root, middle = scipy.linalg.sqrtm(P), points[2]
    inverse = np.linalg.inv(root)
    np.testing.assert_allclose(middle, root @ scipy.linalg.sqrtm(inverse @ Q @ inverse) @ root, rtol=1e-8, atol=1e-8)
    # The middle is half the distance from either, whichever end comes first; an isometry takes middles to middles.
    assert distance(P, middle) == pytest.approx(distance(middle, Q), rel=1e-8)
    assert distance(P, middle) + distance(middle, Q) == pytest.approx(length, rel=1e-8)
    np.testing.assert_allclose(spd.geodesic(Q, P, 0.5), middle, rtol=1e-9, atol=1e-9)
    moved = spd.geodesic(G @ P @ G.T, G @ Q @ G.T, 0.5)
    np.testing.assert_allclose(moved, G @ middle @ G.T, rtol=1e-7, atol=1e-7)
    # exp_P(log_P(Q)) = Q, the other way round too, and the logarithm is as long as the way.
    V, W = spd.log(P, Q), 0.3 * random_symmetric(rng, 1, n)[0]
    np.testing.assert_allclose(spd.exp(P, V), Q, rtol=1e-9, atol=1e-9)
    assert np.sqrt(spd.metric(P, V, V)) == pytest.approx(length, rel=1e-7, abs=1e-10)
    np.testing.assert_allclose(spd.log(P, spd.exp(P, W)), W, rtol=1e-7, atol=1e-8)


@CASES
def test_metric(seed, n):
    """tr(P^-1 V P^-1 W), a congruence invariant; pulled back, that of the tangents X L^T + L X^T at L L^T."""
    rng = np.random.default_rng(seed)
    P, (V, W), G = random_spd(rng, 1, n)[0], random_symmetric(rng, 2, n), random_matrices(rng, 1, n)[0]
    inverse = np.linalg.inv(P)
    expected = np.trace(inverse @ V @ inverse @ W)
    assert spd.metric(P, V, W) == pytest.approx(expected, rel=1e-8, abs=1e-8)
    assert spd.metric(G @ P @ G.T, G @ V @ G.T, G @ W @ G.T) == pytest.approx(expected, rel=1e-6, abs=1e-6)
    L = np.linalg.cholesky(P)
    X, Y = np.tril(rng.normal(size=(2, n, n)))
    V, W = X @ L.T + L @ X.T, Y @ L.T + L @ Y.T
    assert spd.lower_metric(L, X, Y) == pytest.approx(np.trace(inverse @ V @ inverse @ W), rel=1e-8, abs=1e-8)


def test_the_pulled_back_metric_is_that_of_short_distances():
    """The distance from L to L + t X is t times the length of X, to an error that falls with t^2."""
    rng = np.random.default_rng(4)
    L = np.linalg.cholesky(random_spd(rng, 1, 3)[0])
    X = np.tril(rng.normal(size=(3, 3)))
    length = np.sqrt(spd.lower_metric(L, X, X))
    # The middle of the step makes the difference central.
    errors = [abs(spd.factor_distance(L - t / 2 * X, L + t / 2 * X) / t - length) for t in (1e-2, 5e-3)]
    assert errors[1] < 1e-3 * length
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_leading_axes():
    """All functions take stacks, which broadcast."""
    rng = np.random.default_rng(5)
    P, Q = random_spd(rng, 6, 3).reshape(2, 3, 3, 3), random_spd(rng, 3, 3)
    V = random_symmetric(rng, 3, 3)
    single = [[spd.distance(P[i, j], Q[j]) for j in range(3)] for i in range(2)]
    np.testing.assert_allclose(spd.distance(P, Q), single, rtol=1e-13)
    for function, other in ((spd.log, Q), (spd.exp, V)):
        stack = function(P, other)
        assert stack.shape == (2, 3, 3, 3)
        np.testing.assert_allclose(stack[1, 2], function(P[1, 2], other[2]), rtol=1e-12, atol=1e-12)
    # Diagonal matrices are flat: the distance is the Euclidean one of the logarithms.
    flat = spd.distance(np.diag([1.0, 2.0, 5.0]), np.diag([3.0, 0.5, 5.0]))
    assert flat == pytest.approx(np.sqrt(np.log(3) ** 2 + np.log(4) ** 2), rel=1e-14)
    # At the identity exp is the matrix exponential.
    np.testing.assert_allclose(spd.exp(np.eye(3), V[0]), scipy.linalg.expm(V[0]), rtol=1e-12)
    assert spd.geodesic(P, Q, 0.5).shape == (2, 3, 3, 3)
    assert spd.metric(P, V, V).shape == spd.lower_metric(P, V, V).shape == (2, 3)
    assert spd.lq(P)[1].shape == spd.to_lower(P).shape == spd.from_lower(P).shape == (2, 3, 3, 3)


@each("count", [1, 2, 3])
def test_a_stack_and_a_single_matrix(count):
    """A stack of as many matrices as these have rows, or of one, is still a stack, on either side."""
    rng = np.random.default_rng(11)
    stack, single, V = random_spd(rng, count, 3), random_spd(rng, 1, 3)[0], random_symmetric(rng, 1, 3)[0]
    lengths = [distance(P, single) for P in stack]
    np.testing.assert_allclose(spd.distance(stack, single), lengths, rtol=1e-9)
    np.testing.assert_allclose(spd.distance(single, stack), lengths, rtol=1e-9)
    np.testing.assert_allclose(spd.geodesic(stack, single, 1.0), [single] * count, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(spd.exp(stack, spd.log(stack, single)), [single] * count, rtol=1e-9, atol=1e-9)
    expected = [np.trace(np.linalg.inv(P) @ V @ np.linalg.inv(P) @ V) for P in stack]
    np.testing.assert_allclose(spd.metric(stack, V, V), expected, rtol=1e-8)


def test_matrices_are_checked():
    """They are square, and symmetric and positive definite or have LQ factors; what is not is named by its index."""
    for shape in [(2,), (2, 3), (0, 0), (4, 2, 1)]:
        refuses(r"^Invalid shape \(.*\) of a matrix\. It must be \(\.\.\., n, n\)\.$", spd.lq, np.ones(shape))
    for wrong in ([[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]], [[np.nan, 0], [0, 1]], np.zeros((2, 2))):
        stack = np.stack([np.eye(2), np.array(wrong)])
        match = r"^Invalid matrix at index 1\. It must be symmetric and positive definite\.$"
        refuses(match, spd.distance, np.eye(2), stack)
        refuses(r"^Invalid matrix\. It must be symmetric and positive definite\.$", spd.to_lower, wrong)
    for diagonal in ([1.0, 0.0], [1.0, np.inf]):
        stack = np.broadcast_to(np.eye(2), (2, 3, 2, 2)).copy()
        stack[1, 2] = np.diag(diagonal)
        refuses(r"^Invalid matrix at index \(1, 2\)\. It must be finite and invertible\.$", spd.lq, stack)
