"""The geometry of SPD(n) against its theorems, generalised eigenvalues and high precision."""

import mpmath
import numpy as np
import pytest
import scipy.linalg
from matrix_samples import cases, random_matrices, transposed
from refusals import refuses
from tables import each

from projdist import spd
from projdist.matrices.measures import get_measure

CASES = cases([1, 2, 3, 5])


def random_spd(rng, count, n, spread=0.5):
    A = random_matrices(rng, count, n, spread)
    return A @ transposed(A)


def random_symmetric(rng, count, n):
    V = rng.normal(size=(count, n, n))
    return V + transposed(V)


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
    np.testing.assert_allclose(Q @ transposed(Q), np.broadcast_to(np.eye(n), Q.shape), atol=1e-14)
    np.testing.assert_allclose(L, np.linalg.cholesky(A @ transposed(A)), rtol=1e-9, atol=1e-11)
    # `to_lower` and `from_lower` undo each other, both ways.
    P = random_spd(rng, 4, n)
    np.testing.assert_allclose(spd.from_lower(spd.to_lower(P)), P, rtol=1e-13, atol=1e-13)
    L = np.tril(rng.normal(size=(4, n, n)), -1) + np.exp(rng.normal(size=(4, n, 1))) * np.eye(n)
    np.testing.assert_allclose(spd.to_lower(spd.from_lower(L)), L, rtol=1e-11, atol=1e-11)


@CASES
def test_distance(seed, n):
    """d_F(P, Q)^2 is the sum of ln^2 of the eigenvalues of P^-1 Q; twice the Fisher distortion on all of GL(n)."""
    A, B = random_matrices(np.random.default_rng(seed), 2, n)
    P, Q = A @ A.T, B @ B.T
    found = spd.distance(P, Q)
    assert found == pytest.approx(distance(P, Q), rel=1e-9, abs=1e-12)
    fisher = get_measure("fisher")(np.linalg.solve(A, B))
    assert found == pytest.approx(2 * fisher, rel=1e-9)
    assert spd.factor_distance(A, B) == pytest.approx(2 * fisher, rel=1e-13)
    assert spd.distance(P, P) == pytest.approx(0.0, abs=1e-12)


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
    length, t = distance(P, Q), np.array([0.0, 0.3, 0.5, 1.0, 1.7])
    points = spd.geodesic(P, Q, t)
    np.testing.assert_allclose(points[[0, 3]], [P, Q], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose([distance(P, point) for point in points], t * length, rtol=1e-7, atol=1e-7)
    root = scipy.linalg.sqrtm(P)
    inverse = np.linalg.inv(root)
    middle = root @ scipy.linalg.sqrtm(inverse @ Q @ inverse) @ root
    np.testing.assert_allclose(points[2], middle, rtol=1e-8, atol=1e-8)
    # exp_P(log_P(Q)) = Q, the other way round too, and the logarithm is as long as the way.
    V, W = spd.log(P, Q), 0.3 * random_symmetric(rng, 1, n)[0]
    np.testing.assert_allclose(spd.exp(P, V), Q, rtol=1e-9, atol=1e-9)
    assert np.sqrt(spd.metric(P, V, V)) == pytest.approx(length, rel=1e-7, abs=1e-10)
    np.testing.assert_allclose(spd.log(P, spd.exp(P, W)), W, rtol=1e-7, atol=1e-8)


@CASES
def test_metric(seed, n):
    """tr(P^-1 V P^-1 W), of any symmetric V and W; pulled back, of the tangents X L^T + L X^T at L L^T."""
    rng = np.random.default_rng(seed)
    P, (V, W) = random_spd(rng, 1, n)[0], random_symmetric(rng, 2, n)
    L, inverse = np.linalg.cholesky(P), np.linalg.inv(P)
    assert spd.metric(P, V, W) == pytest.approx(np.trace(inverse @ V @ inverse @ W), rel=1e-8, abs=1e-8)
    X, Y = np.tril(rng.normal(size=(2, n, n)))
    V, W = X @ L.T + L @ X.T, Y @ L.T + L @ Y.T
    assert spd.lower_metric(L, X, Y) == pytest.approx(np.trace(inverse @ V @ inverse @ W), rel=1e-8, abs=1e-8)


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
        must = r"It must be symmetric and positive definite\.$"
        refuses(rf"^Invalid matrix at index 1\. {must}", spd.distance, np.eye(2), stack)
        refuses(rf"^Invalid matrix\. {must}", spd.to_lower, wrong)
    for diagonal in ([1.0, 0.0], [1.0, np.inf]):
        stack = np.broadcast_to(np.eye(2), (2, 3, 2, 2)).copy()
        stack[1, 2] = np.diag(diagonal)
        refuses(r"^Invalid matrix at index \(1, 2\)\. It must be finite and invertible\.$", spd.lq, stack)


@CASES
def test_mean(seed, n):
    """Of two matrices it is P sqrt(P^-1 Q), and a third of the way with weights of 2 and 1."""
    P, Q = pair = random_spd(np.random.default_rng(seed), 2, n)
    middle = P @ scipy.linalg.sqrtm(np.linalg.solve(P, Q)).real
    np.testing.assert_allclose(spd.mean(pair), middle, rtol=1e-8, atol=1e-8 * np.abs(middle).max())
    third = P @ scipy.linalg.fractional_matrix_power(np.linalg.solve(P, Q), 1.0 / 3.0).real
    np.testing.assert_allclose(spd.mean(pair, [2.0, 1.0]), third, rtol=1e-8, atol=1e-8 * np.abs(third).max())
    refuses("It must be symmetric", spd.mean, [np.eye(n + 1), np.tri(n + 1)])
