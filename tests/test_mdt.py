"""The mean distorting transformation against its theorems and a general minimiser."""

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from hypothesis import given
from hypothesis import strategies as st

from projdist.mdt import mdt
from projdist.measures import get_measure

RNG = np.random.default_rng(1917)
SEEDS = st.integers(0, 2**32 - 1)


def random_matrices(rng, count, spread=1.0):
    """Invertible matrices, exp of a normal one, of both orientations."""
    A = np.array([scipy.linalg.expm(spread * M) for M in rng.normal(size=(count, 2, 2))])
    A[::3] = A[::3] @ np.diag([1.0, -1.0])
    return A


def random_orthogonal(rng, count):
    return np.linalg.qr(rng.normal(size=(count, 2, 2)))[0]


def cost(T, A, weights=None):
    """The definition: the weighted mean of Dist_F(T^-1 A_i)^2, by numpy's SVD."""
    scales = np.linalg.svd(np.linalg.solve(T, A), compute_uv=False)
    return float(np.average(np.sum(np.log(scales) ** 2, axis=-1), weights=weights))


def geometric_mean(P, Q):
    """The midpoint of two SPD matrices in the affine-invariant metric (Bhatia 2007, equation 6.11)."""
    root = scipy.linalg.sqrtm(P)
    inverse = np.linalg.inv(root)
    return root @ scipy.linalg.sqrtm(inverse @ Q @ inverse) @ root


def test_one_matrix_is_its_own_mean():
    """The MDT of one matrix A is the Cholesky factor of A A^T, at no cost."""
    for A in random_matrices(RNG, 20):
        result = mdt(A[None])
        np.testing.assert_allclose(result.T, np.linalg.cholesky(A @ A.T), rtol=1e-11, atol=1e-12)
        assert result.cost == pytest.approx(0.0, abs=1e-20)


@given(seed=SEEDS)
def test_diagonal_matrices_have_the_geometric_mean(seed):
    """Positive diagonal matrices commute: their mean is the weighted geometric mean of each entry."""
    rng = np.random.default_rng(seed)
    logs, w = rng.normal(size=(8, 2)), rng.uniform(size=8)
    result = mdt(np.exp(logs)[:, None, :] * np.eye(2), w)
    mean = np.average(logs, axis=0, weights=w)
    np.testing.assert_allclose(result.T, np.diag(np.exp(mean)), rtol=1e-13, atol=1e-14)
    assert result.cost == pytest.approx(np.average(np.sum((logs - mean) ** 2, axis=1), weights=w), rel=1e-12)


@given(seed=SEEDS)
def test_two_matrices_have_the_midpoint(seed):
    """T T^T of two matrices is the geometric mean of A_1 A_1^T and A_2 A_2^T."""
    A = random_matrices(np.random.default_rng(seed), 2, 0.5)
    P = A @ np.swapaxes(A, 1, 2)
    T = mdt(A).T
    np.testing.assert_allclose(T @ T.T, geometric_mean(*P), rtol=1e-9, atol=1e-10)


@given(seed=SEEDS)
def test_distances_are_fisher_distortions(seed):
    """`distances` are fisher(T^-1 A_i)^2, and `cost` is their weighted mean."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 9), rng.uniform(size=9)
    result = mdt(A, w)
    fisher = get_measure("fisher")(np.linalg.solve(result.T, A))
    np.testing.assert_allclose(result.distances, fisher**2, rtol=1e-8, atol=1e-10)
    assert result.cost == pytest.approx(cost(result.T, A, w), rel=1e-9)


@given(seed=SEEDS)
def test_form_of_the_result(seed):
    """T is lower triangular with a positive diagonal."""
    T = mdt(random_matrices(np.random.default_rng(seed), 5)).T
    assert T.shape == (2, 2)
    assert T[0, 1] == 0.0
    assert (np.diag(T) > 0).all()


@given(seed=SEEDS)
def test_congruence(seed):
    """The mean moves with the map: mdt(B A) is the Cholesky factor of B T T^T B^T, at the same cost."""
    rng = np.random.default_rng(seed)
    A, B = random_matrices(rng, 7), random_matrices(rng, 1, 0.5)[0]
    first, second = mdt(A), mdt(B @ A)
    M = B @ first.T
    np.testing.assert_allclose(second.T, np.linalg.cholesky(M @ M.T), rtol=1e-8, atol=1e-8 * np.abs(M).max())
    assert second.cost == pytest.approx(first.cost, rel=1e-9)


@given(seed=SEEDS)
def test_right_orthogonal_invariance(seed):
    """Turning or mirroring the local frame of each A_i changes nothing."""
    rng = np.random.default_rng(seed)
    A = random_matrices(rng, 7)
    first, second = mdt(A), mdt(A @ random_orthogonal(rng, 7))
    np.testing.assert_allclose(second.T, first.T, rtol=1e-9, atol=1e-9 * np.abs(first.T).max())


@given(seed=SEEDS)
def test_inverse_transposes(seed):
    """Inversion is an isometry: with B_i = A_i^-T, S S^T = (T T^T)^-1 and the cost is the same."""
    A = random_matrices(np.random.default_rng(seed), 6)
    first, second = mdt(A), mdt(np.swapaxes(np.linalg.inv(A), 1, 2))
    np.testing.assert_allclose(second.T @ second.T.T @ first.T @ first.T.T, np.eye(2), atol=1e-7)
    assert second.cost == pytest.approx(first.cost, rel=1e-9)


@given(seed=SEEDS)
def test_the_corrected_matrices_have_the_identity(seed):
    """The MDT of T^-1 A_i is the identity: correcting twice is correcting once."""
    A = random_matrices(np.random.default_rng(seed), 10)
    np.testing.assert_allclose(mdt(np.linalg.solve(mdt(A).T, A)).T, np.eye(2), atol=1e-10)


@given(seed=SEEDS)
def test_a_mean_that_is_known(seed):
    """For A_i = G exp(V_i / 2) Q_i with symmetric V_i of sum 0 the mean is G G^T, exactly."""
    rng = np.random.default_rng(seed)
    V = rng.normal(size=(9, 2, 2))
    V = V + np.swapaxes(V, 1, 2)
    V -= V.mean(axis=0)
    G = random_matrices(rng, 1, 0.5)[0]
    A = np.array([G @ scipy.linalg.expm(v / 2) for v in V]) @ random_orthogonal(rng, len(V))
    result = mdt(A)
    # V of norm up to 10 makes conditions of e^10: 1e4 eps and some.
    np.testing.assert_allclose(result.T, np.linalg.cholesky(G @ G.T), rtol=1e-8, atol=1e-9)
    # Dist_F(exp(V / 2)) is half of the norm of V.
    np.testing.assert_allclose(result.distances, np.sum(V * V, axis=(1, 2)) / 4, rtol=1e-7)


@given(seed=SEEDS)
def test_weights_are_repetitions(seed):
    """Whole weights count like repeated matrices, their scale does not matter, and a weight 0 removes a matrix."""
    rng = np.random.default_rng(seed)
    A = random_matrices(rng, 5)
    count = np.array([1, 3, 0, 2, 1])
    truth = mdt(np.repeat(A, count, axis=0))
    for weights in (count, 7.5 * count):
        result = mdt(A, weights)
        np.testing.assert_allclose(result.T, truth.T, rtol=1e-9, atol=1e-9 * np.abs(truth.T).max())
        assert result.cost == pytest.approx(truth.cost, rel=1e-10)
    np.testing.assert_array_equal(mdt(A, np.ones(5)).T, mdt(A).T)


@pytest.mark.parametrize("seed", range(6))
def test_optimality_against_a_general_minimiser(seed):
    """No linear map of any form, found by BFGS from several starts, has a lower cost; the best have the same T T^T."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 12, 0.7), rng.uniform(size=12)
    result = mdt(A, w)

    def objective(entries):
        T = entries.reshape(2, 2)
        return cost(T, A, w) if abs(np.linalg.det(T)) > 1e-9 else 1e9

    starts = [np.eye(2), A[0], np.average(A[1::3], axis=0), random_matrices(rng, 1)[0]]
    best = min(
        (scipy.optimize.minimize(objective, start.ravel(), method="BFGS", tol=1e-9) for start in starts),
        key=lambda found: found.fun,
    )
    assert result.cost <= best.fun + 1e-12
    # The cost is quadratic about the minimum: finite-difference gradients of 1e-8 leave 1e-6 in T.
    assert best.fun == pytest.approx(result.cost, rel=1e-9)
    found = best.x.reshape(2, 2)
    np.testing.assert_allclose(found @ found.T, result.T @ result.T.T, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("seed", range(4))
def test_the_gradient_vanishes(seed):
    """At the mean the logarithms of T^-1 A_i A_i^T T^-T have the weighted mean 0 (Karcher's equation)."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 20), rng.uniform(size=20)
    B = np.linalg.solve(mdt(A, w).T, A)
    U, scales, _ = np.linalg.svd(B)
    logs = U @ (2 * np.log(scales)[:, :, None] * np.swapaxes(U, 1, 2))
    np.testing.assert_allclose(np.average(logs, axis=0, weights=w), 0.0, atol=1e-10)


@pytest.mark.parametrize("scale", [1e-150, 1e-6, 1.0, 6.4e6, 1e150])
def test_any_unit(scale):
    """Scaling the matrices scales T, whatever the size."""
    A = random_matrices(RNG, 6)
    np.testing.assert_allclose(mdt(scale * A).T, scale * mdt(A).T, rtol=1e-9)


def test_far_apart_matrices():
    """Conditions of 1e6, as at the end of a pole line, are no obstacle: Karcher's equation holds."""
    rng = np.random.default_rng(5)
    A = random_orthogonal(rng, 40) @ (np.exp(rng.uniform(-7, 7, size=(40, 1, 2))) * random_orthogonal(rng, 40))
    B = np.linalg.solve(mdt(A).T, A)
    U, scales, _ = np.linalg.svd(B)
    logs = U @ (2 * np.log(scales)[:, :, None] * np.swapaxes(U, 1, 2))
    np.testing.assert_allclose(logs.mean(axis=0), 0.0, atol=1e-8)


def test_close_matrices():
    """Of matrices that differ by 1e-9 the mean is theirs, and the cost is their variance, not rounding."""
    V = RNG.normal(size=(10, 2, 2))
    V = V + np.swapaxes(V, 1, 2)
    V -= V.mean(axis=0)
    result = mdt(np.eye(2) + 1e-9 * V)
    np.testing.assert_allclose(result.T, np.eye(2), atol=1e-15)
    assert result.cost == pytest.approx(1e-18 * np.mean(np.sum(V * V, axis=(1, 2))), rel=1e-5)


def test_identical_matrices():
    """Equal matrices, conformal ones too, are their own mean, without a warning."""
    for A in (np.eye(2), np.array([[2.0, 1.0], [0.0, 3.0]]), np.diag([1.0, -1.0])):
        result = mdt(np.broadcast_to(A, (50, 2, 2)))
        np.testing.assert_allclose(result.T, np.linalg.cholesky(A @ A.T), atol=1e-14)
        assert result.cost == pytest.approx(0.0, abs=1e-28)


def test_many_matrices():
    """A hundred thousand matrices, as the samples of a globe, take no special care."""
    rng = np.random.default_rng(3)
    A = np.exp(rng.normal(size=(100_000, 1, 2))) * np.eye(2)
    np.testing.assert_allclose(mdt(A).T, np.diag(np.exp(np.log(np.einsum("nii->ni", A)).mean(axis=0))), rtol=1e-12)


# ---- errors ---------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(2, 2), (3, 2, 3), (0, 2, 2), (3, 0, 0), (4,)])
def test_shapes_are_checked(shape):
    """Matrices that are not (..., N, n, n) are refused with their shape."""
    with pytest.raises(
        ValueError, match=r"^Invalid shape \(.*\) of matrices\. It must be \(\.\.\., N, n, n\) with N and n"
    ):
        mdt(np.ones(shape))


@pytest.mark.parametrize(
    "wrong",
    [
        [[1.0, 2.0], [2.0, 4.0]],
        [[0.0, 0.0], [0.0, 0.0]],
        [[np.nan, 0.0], [0.0, 1.0]],
        [[np.inf, 0], [0, 1]],
        [[np.inf, np.inf], [np.inf, np.inf]],
    ],
)
def test_matrices_are_checked(wrong):
    """The first singular or undefined matrix is named by its index."""
    A = np.stack([np.eye(2), np.eye(2), np.array(wrong), np.zeros((2, 2))])
    with pytest.raises(ValueError, match=r"^Invalid matrix at index 2\. It must be finite and invertible\.$"):
        mdt(A)


@pytest.mark.parametrize("weights", [[1.0], [1.0, 1.0, 1.0, 1.0], [[1.0, 1.0, 1.0]], 1.0])
def test_weights_have_the_shape_of_the_matrices(weights):
    """Weights are one a matrix."""
    with pytest.raises(ValueError, match=r"^Invalid shape \(.*\) of weights\. It must be \(3,\), as many as matrices"):
        mdt(np.stack([np.eye(2)] * 3), weights)


@pytest.mark.parametrize("weights", [[1.0, -1.0, 1.0], [1.0, np.nan, 1.0], [1.0, np.inf, 1.0]])
def test_weights_are_checked(weights):
    """Negative and undefined weights are refused with their index."""
    match = r"^Invalid weight .* at index 1\. It must be finite and not negative\.$"
    with pytest.raises(ValueError, match=match):
        mdt(np.stack([np.eye(2)] * 3), weights)


def test_weights_that_are_all_zero():
    """There is no mean of nothing."""
    with pytest.raises(ValueError, match=r"^Invalid weights.*\. They must not all be zero\.$"):
        mdt(np.stack([np.eye(2)] * 3), np.zeros(3))


# ---- any dimension --------------------------------------------------------------------------


def around(n, count, spread, condition, *, seed=1):
    """Matrices whose mean is known: A_i = T exp(S_i / 2) Q_i, the S_i symmetric and of weighted mean zero.

    The Karcher equation of P_i = A_i A_i^T at T T^T is sum w_i S_i = 0.
    """
    rng = np.random.default_rng(seed)
    S = rng.normal(size=(count, n, n)) * spread
    S = S + S.swapaxes(-1, -2)
    w = rng.uniform(0.5, 2.0, count)
    S -= np.einsum("i,ijk->jk", w / w.sum(), S)
    eigenvalues, U = np.linalg.eigh(S)
    root = (U * np.exp(0.5 * eigenvalues[:, None])) @ U.swapaxes(-1, -2)
    T = np.tril(rng.normal(size=(n, n)), -1) * 0.3 + np.diag(np.geomspace(1.0, condition, n))
    Q = np.linalg.qr(rng.normal(size=(count, n, n)))[0]
    return T @ root @ Q, w, T, float(np.einsum("i,ijk,ijk->", w / w.sum(), S, S) / 4)


@pytest.mark.parametrize("condition", [1.0, 1e2, 1e6, 1e10])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_exact_means(n, condition):
    """Where the Karcher equation holds by construction T is found to 1e-10 of its rows, and the cost with it."""
    A, w, T, cost = around(n, 40, 0.4, condition)
    found = mdt(A, w)
    np.testing.assert_allclose(np.linalg.solve(T, found.T), np.eye(n), rtol=0, atol=1e-10)
    assert found.cost == pytest.approx(cost, rel=1e-9)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_orthogonal_invariance(n):
    """A rotation from the right changes nothing; one from the left rotates T T^T."""
    A, w, _, _ = around(n, 30, 0.3, 5.0)
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(n, n)))[0]
    found, right, left = mdt(A, w), mdt(A @ Q, w), mdt(Q @ A, w)
    np.testing.assert_allclose(right.T, found.T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(left.T @ left.T.T, Q @ found.T @ found.T.T @ Q.T, rtol=0, atol=1e-11)


@pytest.mark.parametrize("n", [2, 3])
def test_positive_diagonals(n):
    """The mean of positive diagonal matrices is their geometric mean."""
    d = np.random.default_rng(5).uniform(0.1, 10.0, (20, n))
    found = mdt(d[:, :, None] * np.eye(n))
    np.testing.assert_allclose(found.T, np.diag(np.exp(np.log(d).mean(axis=0))), rtol=0, atol=1e-12)


@pytest.mark.parametrize("n", [2, 3])
def test_leading_axes(n):
    """Sets of matrices on leading axes have each its own mean."""
    sets = [around(n, 12, 0.3, 4.0, seed=seed) for seed in range(6)]
    A, w = (np.stack([one[k] for one in sets]).reshape(2, 3, *sets[0][k].shape) for k in (0, 1))
    found = mdt(A, w)
    assert found.T.shape == (2, 3, n, n)
    for k, (_, _, T, cost) in enumerate(sets):
        np.testing.assert_allclose(found.T.reshape(6, n, n)[k], T, rtol=0, atol=1e-11)
        assert np.ravel(found.cost)[k] == pytest.approx(cost, rel=1e-10)


@pytest.mark.parametrize(("method", "tolerance"), [("gradient", 1e-10), ("mpm", 1e-5)])
def test_other_methods_find_the_same_mean(method, tolerance):
    """The gradient is exact; the power means tend to the mean, from powers that doubles can take."""
    A, w, T, _ = around(3, 30, 0.3, 3.0)
    np.testing.assert_allclose(mdt(A, w, method=method).T, T, rtol=0, atol=tolerance)
