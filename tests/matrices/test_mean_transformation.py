"""The mean distorting transformation: its theorems, means that are known, pyRiemann."""

import json
import tracemalloc

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
from refusals import refuses
from tables import each

from projdist.matrices import frechet as means
from projdist.matrices.mean_transformation import mdt
from projdist.matrices.measures import get_measure, principal_scales
from projdist.matrices.spd import factor_distance, lq

RNG = np.random.default_rng(1917)


def geometric_mean(P, Q):
    """The midpoint of two SPD matrices in the affine-invariant metric (Bhatia 2007, equation 6.11)."""
    root = scipy.linalg.sqrtm(P)
    inverse = np.linalg.inv(root)
    return root @ scipy.linalg.sqrtm(inverse @ Q @ inverse) @ root


@each("n", [2, 3, 4])
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


@each(("n", "seed"), [(2, 0), (2, 1), (2, 2), (3, 0), (3, 1)])
def test_optimality_against_a_general_minimiser(n, seed):
    """No linear map of any form, found by BFGS from several starts, has a lower cost; the best have the same T T^T."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 10, n, 0.6), rng.uniform(size=10)
    result = mdt(A, w)

    def objective(entries):
        T = entries.reshape(n, n)
        return cost(T, A, w) if abs(np.linalg.det(T)) > 1e-9 else 1e9

    starts = [np.eye(n), A[0], random_matrices(rng, 1, n)[0]]
    searches = [scipy.optimize.minimize(objective, start.ravel(), method="BFGS", tol=1e-7) for start in starts]
    best = min(searches, key=lambda search: search.fun)
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


@each("scale", [1e-150, 1e-6, 1.0, 6.4e6, 1e150])
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
    truth, error = mdt(A[0]).T, 1e-4 if method == "mpm" else 1e-12
    for start in random_matrices(rng, 6, n, 2.0):
        assert factor_distance(truth, means.METHODS[method](A, w, start[None]).T[0]) < error


def test_uniqueness_in_the_half_plane():
    """Newton's method in the plane, too, comes from everywhere to the same point."""
    rng = np.random.default_rng(2)
    A, w = random_matrices(rng, 8)[None], np.full((1, 8), 0.125)
    points, _ = means.plane_points(A)
    truth = mdt(A[0]).T
    for x, ln_y in rng.normal(scale=6.0, size=(20, 2)):
        found = means.newton_in_plane(points, w, np.array([[x], [np.exp(ln_y)]]))
        assert factor_distance(truth, found.T[0]) < 1e-12


def test_equal_matrices():
    """The MDT of one matrix A, or of equal ones, is the Cholesky factor of A A^T, at no cost and without a warning."""
    for n in (1, 2, 3):
        for A in random_matrices(RNG, 10, n):
            result = mdt(A[None])
            np.testing.assert_allclose(result.T, cholesky_factor(A), rtol=1e-10, atol=1e-11)
            assert result.cost == pytest.approx(0.0, abs=1e-20)
    for A in (np.eye(2), np.array([[2.0, 1.0], [0.0, 3.0]]), np.diag([1.0, -1.0]), 2 * np.eye(3)):
        result = mdt(np.broadcast_to(A, (50, *A.shape)))
        np.testing.assert_allclose(result.T, cholesky_factor(A), atol=1e-14)
        assert result.cost == pytest.approx(0.0, abs=1e-28)


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
    """A mean G G^T whose rows differ by 1e12 in size (cond(A) 1e12, cond(A A^T) 1e24) is found to 1e-13."""
    # Such conditions come of units, and no rounding of A is amplified by them.
    G = graded(n, condition)
    A, w, truth = around(G, count, 0.4)
    found = mdt(A, w)
    assert factor_distance(G, found.T) < 1e-13
    assert found.cost == pytest.approx(truth, rel=1e-12)


@each("condition", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12])
@each("n", [2, 3, 5])
def test_exact_means_in_any_position(n, condition):
    """For cond(A A^T) = 1e12, whatever the axes, T is within 1e-10 of the truth, which mpmath rounds."""
    # The rounding of A and T alone makes some eps times the condition of A, 1e6: no method from doubles has less.
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


def test_far_apart_close_and_many():
    """Conditions of 1e6, as at the end of a pole line, are no obstacle: Karcher's equation holds."""
    rng = np.random.default_rng(5)
    A = random_orthogonal(rng, 40) @ (np.exp(rng.uniform(-7, 7, size=(40, 1, 2))) * random_orthogonal(rng, 40))
    np.testing.assert_allclose(karcher(mdt(A).T, A), 0.0, atol=1e-8)
    # Of matrices that differ by 1e-9 the mean is theirs, and the cost is their variance, not rounding.
    for n in (2, 3):
        V = RNG.normal(size=(10, n, n))
        V = V + transposed(V)
        V -= V.mean(axis=0)
        result = mdt(np.eye(n) + 1e-9 * V)
        np.testing.assert_allclose(result.T, np.eye(n), atol=1e-15)
        assert result.cost == pytest.approx(1e-18 * np.mean(np.sum(V * V, axis=(1, 2))), rel=1e-5)
    # A hundred thousand matrices, as the samples of a globe, take no special care.
    rng = np.random.default_rng(3)
    A = np.exp(rng.normal(size=(100_000, 1, 2))) * np.eye(2)
    np.testing.assert_allclose(mdt(A).T, np.diag(np.exp(np.log(np.einsum("nii->ni", A)).mean(axis=0))), rtol=1e-12)


@each("method", EXACT)
@each(("n", "spread"), [(2, 5.0), (3, 4.0), (6, 2.5)])
def test_no_spread_makes_it_diverge(n, spread, method):
    """Matrices of conditions to 1e8, for which the gradient method with step 1 diverges, have their mean found."""
    # The error is at most the gradient, as no Hessian is below 1, and the gradient at most four times its floor.
    G = graded(n, 10.0)
    A, w, _ = around(G, 60, spread)
    assert np.linalg.cond(A).max() > 1e8
    found = mdt(A, w, method=method)
    assert factor_distance(G, found.T) < found.gradient_norm + found.floor < 5 * found.floor < 2e-8


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


@CASES
def test_traps(seed, n):
    """T acts on the left, rotations stay outside, orientations do not count, and no T repairs scales."""
    rng = np.random.default_rng(seed)
    # In the plane ln^2(a/b) + ln^2(ab) = 2 (ln^2 a + ln^2 b): the source paper's equation (1) lacks the 2.
    a, b = principal_scales(random_matrices(rng, 1)[0])
    fisher = get_measure("fisher")(np.diag([a, b]))
    assert np.log(a / b) ** 2 + np.log(a * b) ** 2 == pytest.approx(2 * fisher**2, rel=1e-12)
    assert mdt(np.stack([np.eye(2), np.diag([a, b])])).cost == pytest.approx(fisher**2 / 4, rel=1e-12)
    A, q = random_matrices(rng, 6, n), random_orthogonal(rng, 1, n)[0]
    found, wrong = mdt(A), mdt(transposed(A))
    # T is T^-1 A_i's, from A_i A_i^T: those of A_i^T A_i and of A_i T^-1 are other matrices and cost more.
    assert factor_distance(found.T, wrong.T) > 1e-3
    assert cost(wrong.T, A) > found.cost + 1e-6
    outside = np.mean(np.sum(np.log(principal_scales(A @ np.linalg.inv(found.T))) ** 2, axis=-1))
    assert outside != pytest.approx(found.cost, rel=1e-6)
    similar = rng.uniform(0.5, 2.0, size=(6, 1, 1)) * random_orthogonal(rng, 6, n)
    np.testing.assert_allclose(mdt(transposed(similar)).T, mdt(similar).T, atol=1e-13)
    # A rotation of the corrected plane, q T^-1 A_i, costs nothing; one inside, T^-1 q A_i, does.
    assert cost(np.eye(n), q @ np.linalg.solve(found.T, A)) == pytest.approx(found.cost, rel=1e-11)
    assert cost(found.T, q @ A) > found.cost + 1e-8
    # With Cholesky's T the LQ factors Q_i of T^-1 A_i are those of A_i.
    np.testing.assert_allclose(lq(np.linalg.solve(found.T, A))[1], lq(A)[1], atol=1e-10)
    mirrored = A.copy()
    mirrored[::2, :, -1] *= -1
    np.testing.assert_allclose(mdt(mirrored).T, found.T, rtol=1e-10, atol=1e-11)
    # Matrices of determinant 1, shrunk by c_i, cost n times the variance of ln c_i more: no T takes that out. A fit
    # that shrinks some images, as linear least squares on a fixed reference does, stays visible.
    A /= np.abs(np.linalg.det(A))[:, None, None] ** (1 / n)
    ln_c = rng.normal(size=6)
    first, second = mdt(A), mdt(np.exp(ln_c)[:, None, None] * A)
    assert second.cost == pytest.approx(first.cost + n * np.var(ln_c), rel=1e-10)
    np.testing.assert_allclose(second.T, np.exp(ln_c.mean()) * first.T, rtol=1e-9, atol=1e-10)


@pytest.mark.slow
@CASES
def test_references(seed, n):
    """Measured from any of the matrices, A_r^-1 A_i, the cost is the same; as references they are worse than T."""
    # The mean over references of the cost is at least twice the MDT's, for two matrices exactly; and the best
    # reference is worse by at least its squared distance from the mean (SPD(n) has no positive curvature).
    rng = np.random.default_rng(seed)
    A = random_matrices(rng, 6, n, 0.7)
    found = mdt(A)
    references = [cost(reference, A) for reference in A]
    for reference in A:
        assert mdt(np.linalg.solve(reference, A)).cost == pytest.approx(found.cost, rel=1e-11)
    assert np.mean(references) >= 2 * found.cost * (1 - 1e-12)
    best = int(np.argmin(references))
    assert references[best] >= found.cost + found.distances[best] - 1e-12
    pair = [cost(reference, A[:2]) for reference in A[:2]]
    assert np.mean(pair) == pytest.approx(2 * mdt(A[:2]).cost, rel=1e-10)


def arithmetic(A, w):
    """The mean of A_i A_i^T."""
    return np.average(A @ transposed(A), axis=0, weights=w)


def log_euclidean(A, w):
    """exp of the mean of ln(A_i A_i^T), by scipy."""
    return scipy.linalg.expm(np.average([scipy.linalg.logm(a @ a.T) for a in A], axis=0, weights=w))


def log_cholesky(A, w):
    """The mean of the Cholesky factors, the diagonals by their logarithms."""
    L = cholesky_factor(A)
    diagonal = np.exp(np.average(np.log(np.einsum("ikk->ik", L)), axis=0, weights=w))
    L = np.tril(np.average(L, axis=0, weights=w), -1) + np.diag(diagonal)
    return L @ L.T


@each("n", [2, 3, 6])
@each("definition", [arithmetic, log_euclidean, log_cholesky])
def test_other_means_are_what_they_say(definition, n):
    """Each named mean has the Cholesky factor of its definition, costs what that costs, and more than the MDT."""
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 12, n, 0.6), rng.uniform(size=12)
    found = mdt(A, w, method=definition.__name__)
    np.testing.assert_allclose(found.T, np.linalg.cholesky(definition(A, w)), rtol=1e-9, atol=1e-9)
    assert found.cost == pytest.approx(cost(found.T, A, w), rel=1e-10)
    assert found.gradient_norm == pytest.approx(np.linalg.norm(karcher(found.T, A, w)), rel=1e-8)
    assert found.cost > mdt(A, w).cost
    assert found.iterations == 0


def test_power_means():
    """mpm is the midpoint of the power means of orders 0.01 and -0.01, and comes within 1e-4 of the mean."""
    rng = np.random.default_rng(8)
    # Numbers have them in closed form.
    d, w = np.exp(rng.normal(size=(9, 3))), rng.uniform(size=9)
    above, below = (np.average(d ** (2 * p), axis=0, weights=w) ** (1 / p) for p in (0.01, -0.01))
    found = mdt(d[:, None, :] * np.eye(3), w, method="mpm").T
    np.testing.assert_allclose(found, np.diag((above * below) ** 0.25), rtol=1e-9, atol=1e-12)
    for n in (2, 3, 6):
        G = graded(n, 3.0)
        A, w, truth = around(G, 30, 0.3)
        found = mdt(A, w, method="mpm")
        assert 1e-12 < factor_distance(G, found.T) < 1e-4
        assert 0 < found.cost - truth < 1e-8


@each("method", EXACT)
@each("n", [1, 2, 3, 6])
def test_exact_methods(method, n):
    """Newton's method and the gradient find the same mean, to rounding."""
    G = graded(n, 50.0)
    A, w, truth = around(G, 30, 0.3)
    found = mdt(A, w, method=method)
    assert factor_distance(G, found.T) < 1e-13
    assert found.cost == pytest.approx(truth, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("method", ["auto", *means.METHODS])
def test_leading_axes(method, n):
    """Sets of matrices on leading axes have each its own mean and numbers."""
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 72, n, 0.5).reshape(2, 3, 12, n, n), rng.uniform(size=(2, 3, 12))
    found = mdt(A, w, method=method)
    assert found.T.shape == (2, 3, n, n)
    assert found.distances.shape == (2, 3, 12)
    assert found.cost.shape == found.gradient_norm.shape == found.iterations.shape == found.floor.shape == (2, 3)
    for k in np.ndindex(2, 3):
        alone = mdt(A[k], w[k], method=method)
        np.testing.assert_allclose(found.T[k], alone.T, rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(found.distances[k], alone.distances, rtol=1e-9, atol=1e-11)
        assert found.cost[k] == pytest.approx(alone.cost, rel=1e-12)


@pytest.mark.parametrize("n", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_many_sets(n):
    """Thousands of small sets, more than are worked on together, among them some far from round."""
    G = np.tril(RNG.normal(size=(1500, n, n)), -1) + np.exp(3 * RNG.normal(size=(1500, n, 1))) * np.eye(n)
    A, w, _ = around(np.eye(n), 12, 0.4)
    found = mdt(G[:, None] @ A, w)
    assert (factor_distance(G, found.T) < 1e-15 * (20 + np.linalg.cond(G))).all()


@pytest.mark.slow
@pytest.mark.parametrize(("n", "count", "times"), [(2, 200_000, 2.5), (3, 30_000, 2.5), (8, 4_000, 6.0)])
def test_memory(n, count, times):
    """The memory in use stays a small multiple of the input's."""
    A = around(np.eye(n), count, 0.3)[0]
    tracemalloc.start()
    mdt(A)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < times * A.nbytes


def test_arguments_are_checked():
    """Shapes, methods, the range of doubles, and weights: one a matrix, finite, not negative, and not all zero."""
    for shape in [(2, 2), (3, 2, 3), (0, 2, 2), (3, 0, 0), (4,)]:
        refuses(r"^Invalid shape \(.*\) of matrices\. It must be \(\.\.\., N, n, n\) with N and n", mdt, np.ones(shape))
    methods = "auto, newton, gradient, mpm, log_euclidean, log_cholesky, arith"
    refuses(rf"^Invalid method 'karcher'\. It must be one of {methods}", mdt, [np.eye(2)], method="karcher")
    apart = [np.diag([1e-80, 1e80]), np.diag([1e80, 1e-80])]
    refuses(r"^Invalid matrices\. They lie so far apart that their squares leave", mdt, apart)
    A = np.stack([np.eye(2)] * 3)
    for weights in ([1.0], [1.0, 1.0, 1.0, 1.0], [[1.0, 1.0, 1.0]], 1.0):
        refuses(r"^Invalid shape \(.*\) of weights\. It must be \(3,\), as many as matrices", mdt, A, weights)
    for wrong in (-1.0, np.nan, np.inf):
        match = r"^Invalid weight .* at index 1\. It must be finite and not negative\.$"
        refuses(match, mdt, A, [1.0, wrong, 1.0])
    refuses(r"^Invalid weights.*\. They must not all be zero\.$", mdt, A, np.zeros(3))
    sets = np.broadcast_to(np.eye(2), (2, 3, 2, 2))
    refuses(r"^Invalid weights at index 1\. They must not all be zero\.$", mdt, sets, [[1, 1, 1], [0, 0, 0]])


@each("n", [2, 3])
def test_matrices_are_checked(n):
    """The first singular or undefined matrix is named by its index, in a set and in a set of sets."""
    count = np.arange(1.0, n + 1)
    nan = np.where(np.eye(n) == 1, np.nan, 0.0)
    for bad in (np.outer(count, count), np.zeros((n, n)), nan, np.full((n, n), np.inf)):
        A = np.stack([np.eye(n), np.eye(n), bad, np.zeros((n, n))])
        refuses(r"^Invalid matrix at index 2\. It must be finite and invertible\.$", mdt, A)
        sets = np.broadcast_to(np.eye(n), (2, 3, 4, n, n)).copy()
        sets[1, 0] = A
        refuses(r"^Invalid matrix at index \(1, 0, 2\)\. It must be finite and invertible\.$", mdt, sets)


def test_forms():
    """A mean can be had as JSON and as a frame, of one set or of several."""
    pytest.importorskip("pandas")
    A = np.stack([np.diag([1.0, 2.0]), np.diag([4.0, 2.0])])
    found = json.loads(mdt(A).to_json())
    assert found["T"] == [[2.0, 0.0], [0.0, 2.0]]
    assert len(found["distances"]) == 2
    frame = mdt(np.stack([A, 3.0 * A])).to_frame()
    np.testing.assert_allclose(frame["T_00"], [2.0, 6.0], rtol=1e-14)
    assert set(frame.columns) >= {"cost", "gradient_norm", "iterations", "floor", "T_10", "T_11"}
