"""The mean distorting transformation: its theorems, means that are known, pyRiemann."""

import mpmath
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from matrix_samples import (
    CASES,
    EXACT,
    around,
    cholesky_factor,
    cost,
    graded,
    karcher,
    random_matrices,
    random_orthogonal,
    transposed,
)
from tables import each

from projdist.matrices import frechet as means
from projdist.matrices.mean_transformation import mdt
from projdist.matrices.measures import get_measure
from projdist.matrices.spd import factor_distance

RNG = np.random.default_rng(1917)


def geometric_mean(P, Q):
    """The midpoint of two SPD matrices in the affine-invariant metric (Bhatia 2007, equation 6.11)."""
    root = scipy.linalg.sqrtm(P)
    inverse = np.linalg.inv(root)
    return root @ scipy.linalg.sqrtm(inverse @ Q @ inverse) @ root


# ---- the source paper's theorem 2 -------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 3, 4])
def test_it_is_the_cholesky_factor_of_the_frechet_mean(n):
    """T is the Cholesky factor of the Frechet mean of A_i A_i^T, here by gradient steps on scipy's eigenvalues."""
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 6, n, 0.5), rng.uniform(size=6)
    P = A @ transposed(A)
    M = np.average(P, axis=0, weights=w)

    def mapped(function, S):
        """M^1/2 f(M^-1/2 S M^-1/2) M^1/2."""
        values, V = scipy.linalg.eigh(S, M)
        return (M @ V * function(values)) @ (M @ V).T

    for _ in range(100):
        M = mapped(np.exp, np.average([mapped(np.log, p) for p in P], axis=0, weights=w))
    np.testing.assert_allclose(mdt(A, w).T, np.linalg.cholesky(M), rtol=1e-11, atol=1e-11)


@pytest.mark.slow
@CASES
def test_no_other_linear_map_is_better(seed, n):
    """The sum of Dist_F(T^-1 A_i)^2 grows in every direction of GL(n) but the rotations T exp(tX), X skew."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 8, n), rng.uniform(size=8)
    found = mdt(A, w)
    for size in (1e-4, 1e-2, 1.0):
        for X in size * rng.normal(size=(4, n, n)):
            # The Hessian is at least 1 on the symmetric part of X, of which the distance moves the double.
            least = np.sum((X + X.T) ** 2) / 4
            other = cost(found.T @ scipy.linalg.expm(X), A, w)
            assert other >= found.cost * (1 - 1e-13) + (0.99 * least if size < 0.1 else 0.0)
    turned = found.T @ scipy.linalg.expm(X - X.T)
    assert cost(turned, A, w) == pytest.approx(found.cost, rel=1e-11)


@pytest.mark.parametrize(("n", "seed"), [(2, 0), (2, 1), (2, 2), (3, 0), (3, 1)])
def test_optimality_against_a_general_minimiser(n, seed):
    """No linear map of any form, found by BFGS from several starts, has a lower cost; the best have the same T T^T."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 10, n, 0.6), rng.uniform(size=10)
    result = mdt(A, w)

    def objective(entries):
        T = entries.reshape(n, n)
        return cost(T, A, w) if abs(np.linalg.det(T)) > 1e-9 else 1e9

    starts = [np.eye(n), A[0], random_matrices(rng, 1, n)[0]]
    best = min(
        (scipy.optimize.minimize(objective, start.ravel(), method="BFGS", tol=1e-7) for start in starts),
        key=lambda found: found.fun,
    )
    assert result.cost <= best.fun + 1e-12
    # The cost is quadratic about the minimum: finite-difference gradients of 1e-8 leave 1e-6 in T.
    assert best.fun == pytest.approx(result.cost, rel=1e-9)
    found = best.x.reshape(n, n)
    np.testing.assert_allclose(found @ found.T, result.T @ result.T.T, rtol=1e-4, atol=1e-5)


@CASES
def test_figures(seed, n):
    """`distances` are fisher(T^-1 A_i)^2, `cost` is their mean, and Karcher's equation holds as the gradient says."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 15, n), rng.uniform(size=15)
    result = mdt(A, w)
    fisher = get_measure("fisher")(np.linalg.solve(result.T, A))
    np.testing.assert_allclose(result.distances, fisher**2, rtol=1e-8, atol=1e-10)
    # A quarter of the squared distance in SPD(n).
    np.testing.assert_allclose(result.distances, factor_distance(result.T, A) ** 2 / 4, rtol=1e-8, atol=1e-10)
    assert result.cost == pytest.approx(cost(result.T, A, w), rel=1e-9)
    np.testing.assert_allclose(karcher(result.T, A, w), 0.0, atol=1e-10)
    assert result.gradient_norm <= 4 * result.floor < 1e-9


# ---- invariances ------------------------------------------------------------------------------


@CASES
def test_invariances(seed, n):
    """The mean moves with the map, does not see the local frames, and inversion is an isometry."""
    rng = np.random.default_rng(seed)
    A, B = random_matrices(rng, 7, n), random_matrices(rng, 1, n, 0.5)[0]
    left, right = random_orthogonal(rng, 1, n)[0], random_orthogonal(rng, 7, n)
    first = mdt(A)
    np.testing.assert_array_equal(first.T, np.tril(first.T))
    assert (np.diag(first.T) > 0).all()
    # Turning or mirroring the local frame of each A_i changes nothing.
    assert factor_distance(first.T, mdt(A @ right).T) < 1e-11
    # mdt(B A) is the Cholesky factor of B T T^T B^T; B_i = A_i^-T have (T T^T)^-1; all at the same cost.
    inverse = np.linalg.inv(first.T).T
    for other, expected, error, of_cost in (
        (mdt(B @ A), B @ first.T, 1e-10, 1e-9),
        (mdt(left @ A), left @ first.T, 1e-11, 1e-10),
        (mdt(transposed(np.linalg.inv(A))), inverse, 1e-9, 1e-9),
    ):
        assert factor_distance(expected, other.T) < error
        assert other.cost == pytest.approx(first.cost, rel=of_cost)
    # Correcting twice is correcting once.
    np.testing.assert_allclose(mdt(np.linalg.solve(first.T, A)).T, np.eye(n), atol=1e-10)


@pytest.mark.slow
@CASES
def test_weights_are_repetitions(seed, n):
    """Whole weights count like repeated matrices, their scale does not matter, and a weight 0 removes a matrix."""
    rng = np.random.default_rng(seed)
    A = random_matrices(rng, 5, n)
    count = np.array([1, 3, 0, 2, 1])
    truth = mdt(np.repeat(A, count, axis=0))
    for weights in (count, 7.5 * count):
        result = mdt(A, weights)
        assert factor_distance(truth.T, result.T) < 1e-11
        assert result.cost == pytest.approx(truth.cost, rel=1e-10)
    np.testing.assert_array_equal(mdt(A, np.ones(5)).T, mdt(A).T)


@pytest.mark.parametrize("scale", [1e-150, 1e-6, 1.0, 6.4e6, 1e150])
def test_any_unit(scale):
    """Scaling the matrices scales T, whatever the size."""
    A = random_matrices(RNG, 6)
    np.testing.assert_allclose(mdt(scale * A).T, scale * mdt(A).T, rtol=1e-9)


@each("n", [2, 3])
@each("method", ["newton", "gradient", "mpm"])
def test_uniqueness(method, n):
    """Every start, tens of units of distance apart, leads to the same mean: the cost is convex along geodesics."""
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 8, n, 0.4)[None], np.full((1, 8), 0.125)
    truth = mdt(A[0]).T
    for start in random_matrices(rng, 6, n, 2.0):
        assert factor_distance(truth, means.METHODS[method](A, w, start[None]).T[0]) < (
            1e-4 if method == "mpm" else 1e-12
        )


def test_uniqueness_in_the_half_plane():
    """Newton's method in the plane, too, comes from everywhere to the same point."""
    rng = np.random.default_rng(2)
    A, w = random_matrices(rng, 8)[None], np.full((1, 8), 0.125)
    points, _ = means.plane_points(A)
    truth = mdt(A[0]).T
    for x, ln_y in rng.normal(scale=6.0, size=(20, 2)):
        found = means.newton_in_plane(points, w, np.array([[x], [np.exp(ln_y)]]))
        assert factor_distance(truth, found.T[0]) < 1e-12


# ---- means that are known ---------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 3])
def test_one_matrix_is_its_own_mean(n):
    """The MDT of one matrix A is the Cholesky factor of A A^T, at no cost."""
    for A in random_matrices(RNG, 10, n):
        result = mdt(A[None])
        np.testing.assert_allclose(result.T, cholesky_factor(A), rtol=1e-10, atol=1e-11)
        assert result.cost == pytest.approx(0.0, abs=1e-20)


@CASES
def test_commuting_and_two_matrices(seed, n):
    """Positive diagonals have the geometric mean of each entry; two matrices that of A_1 A_1^T and A_2 A_2^T."""
    rng = np.random.default_rng(seed)
    logs, w = rng.normal(size=(8, n)), rng.uniform(size=8)
    result = mdt(np.exp(logs)[:, None, :] * np.eye(n), w)
    mean = np.average(logs, axis=0, weights=w)
    np.testing.assert_allclose(result.T, np.diag(np.exp(mean)), rtol=1e-13, atol=1e-14)
    assert result.cost == pytest.approx(np.average(np.sum((logs - mean) ** 2, axis=1), weights=w), rel=1e-12)
    A = random_matrices(rng, 2, n, 0.5)
    T = mdt(A).T
    np.testing.assert_allclose(T @ T.T, geometric_mean(*A @ transposed(A)), rtol=1e-8, atol=1e-9)


@each("condition", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12])
@each(("n", "count"), [(1, 40), (2, 40), (3, 40), (3, 300), (4, 300), (5, 40), (8, 40)])
def test_exact_means_of_any_scale(n, count, condition):
    """A mean G G^T whose rows differ by 1e12 in size (cond(A) 1e12, cond(A A^T) 1e24) is found to a distance of 1e-13.

    Such conditions come of units, and no rounding of A is amplified by them.
    """
    G = graded(n, condition)
    A, w, truth = around(G, count, 0.4)
    found = mdt(A, w)
    assert factor_distance(G, found.T) < 1e-13
    assert found.cost == pytest.approx(truth, rel=1e-12)


@each("condition", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12])
@each("n", [2, 3, 5])
def test_exact_means_in_any_position(n, condition):
    """For cond(A A^T) = 1e12, whatever the axes, T is within a distance of 1e-10 from the truth, which mpmath rounds.

    The rounding of A and T alone makes some eps times the condition of A, 1e6: no method from doubles has less.
    """
    mpmath.mp.dps = 40
    rng = np.random.default_rng(n)
    turn, back = random_orthogonal(rng, 2, n)
    G = mpmath.matrix(turn) * mpmath.diag(np.geomspace(1.0, condition**-0.5, n).tolist()) * mpmath.matrix(back)
    B, w, _ = around(np.eye(n), 12, 0.4)
    A = np.array([(G * mpmath.matrix(b)).tolist() for b in B], dtype=float)
    scales = mpmath.svd_r(G**-1 * mpmath.matrix(mdt(A, w).T), compute_uv=False)
    error = 2 * mpmath.sqrt(sum(mpmath.log(s) ** 2 for s in scales))
    rounding = 4e-15 * n  # of n singular values, each a sum of n products, in the order that a processor takes
    assert error < min(1e-10, rounding + 2e-16 * condition**0.5)


def test_far_apart_matrices():
    """Conditions of 1e6, as at the end of a pole line, are no obstacle: Karcher's equation holds."""
    rng = np.random.default_rng(5)
    A = random_orthogonal(rng, 40) @ (np.exp(rng.uniform(-7, 7, size=(40, 1, 2))) * random_orthogonal(rng, 40))
    np.testing.assert_allclose(karcher(mdt(A).T, A), 0.0, atol=1e-8)


@each("method", EXACT)
@each(("n", "spread"), [(2, 5.0), (3, 4.0), (6, 2.5)])
def test_no_spread_makes_it_diverge(n, spread, method):
    """Matrices of conditions to 1e8, for which the gradient method with step 1 diverges, have their mean found.

    The error is at most the gradient, as no Hessian is below 1, and the gradient at most four times its floor.
    """
    G = graded(n, 10.0)
    A, w, _ = around(G, 60, spread)
    assert np.linalg.cond(A).max() > 1e8
    found = mdt(A, w, method=method)
    assert factor_distance(G, found.T) < found.gradient_norm + found.floor < 5 * found.floor < 2e-8


def test_close_matrices():
    """Of matrices that differ by 1e-9 the mean is theirs, and the cost is their variance, not rounding."""
    for n in (2, 3):
        V = RNG.normal(size=(10, n, n))
        V = V + transposed(V)
        V -= V.mean(axis=0)
        result = mdt(np.eye(n) + 1e-9 * V)
        np.testing.assert_allclose(result.T, np.eye(n), atol=1e-15)
        assert result.cost == pytest.approx(1e-18 * np.mean(np.sum(V * V, axis=(1, 2))), rel=1e-5)


def test_identical_matrices():
    """Equal matrices, conformal ones too, are their own mean, without a warning."""
    for A in (np.eye(2), np.array([[2.0, 1.0], [0.0, 3.0]]), np.diag([1.0, -1.0]), 2 * np.eye(3)):
        result = mdt(np.broadcast_to(A, (50, *A.shape)))
        np.testing.assert_allclose(result.T, cholesky_factor(A), atol=1e-14)
        assert result.cost == pytest.approx(0.0, abs=1e-28)


# ---- another library --------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(np.ndarray, "mT"), reason="pyRiemann needs numpy 2")
@pytest.mark.parametrize("n", range(2, 9))
def test_agreement_with_pyriemann(n):
    """pyRiemann's mean_riemann is nearer than the gradient it stops at: 1e-8 by default, 1e-12 if asked."""
    mean_riemann = pytest.importorskip("pyriemann.geometry.mean").mean_riemann
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 30, n, 0.3), rng.uniform(size=30)
    for tolerance in (1e-8, 1e-12):
        theirs = mean_riemann(A @ transposed(A), tol=tolerance, sample_weight=w)
        assert factor_distance(np.linalg.cholesky(theirs), mdt(A, w).T) < tolerance
