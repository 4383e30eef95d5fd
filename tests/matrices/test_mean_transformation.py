"""The mean distorting transformation: its theorems, means that are known, pyRiemann."""

import json
import tracemalloc

import mpmath
import numpy as np
import pytest
import scipy.linalg
from matrix_samples import CASES, around, cholesky_factor, cost, graded, karcher, random_matrices, random_orthogonal
from refusals import refuses
from tables import each

from projdist.matrices import frechet as means
from projdist.matrices.mean_transformation import mdt
from projdist.matrices.measures import get_measure
from projdist.matrices.spd import factor_distance, geodesic, lq

RNG = np.random.default_rng(1917)
EXACT = ["newton", "gradient"]


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


@CASES
def test_figures(seed, n):
    """`distances` are fisher(T^-1 A_i)^2, `cost` is their mean, and Karcher's equation holds as the gradient says."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 15, n), np.append(rng.uniform(size=14), 0.0)
    result = mdt(A, w)
    fisher = get_measure("fisher")(np.linalg.solve(result.T, A))
    np.testing.assert_allclose(result.distances, fisher**2, rtol=1e-8, atol=1e-10)
    # A quarter of the squared distance in SPD(n).
    np.testing.assert_allclose(result.distances, factor_distance(result.T, A) ** 2 / 4, rtol=1e-8, atol=1e-10)
    assert result.cost == pytest.approx(cost(result.T, A, w), rel=1e-9)
    np.testing.assert_allclose(karcher(result.T, A, w), 0.0, atol=1e-10)
    assert result.gradient_norm <= 4 * result.floor < 1e-9
    np.testing.assert_array_equal(result.T, np.tril(result.T))
    assert (np.diag(result.T) > 0).all()


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
    for start in random_matrices(rng, 3, n, 2.0):
        assert factor_distance(truth, means.METHODS[method](A, w, start[None]).T[0]) < error


def test_uniqueness_in_the_half_plane():
    """Newton's method in the plane, too, comes from everywhere to the same point."""
    rng = np.random.default_rng(2)
    A, w = random_matrices(rng, 8)[None], np.full((1, 8), 0.125)
    for x, ln_y in rng.normal(scale=6.0, size=(20, 2)):
        found = means.newton_in_plane(means.plane_points(A)[0], w, np.array([[x], [np.exp(ln_y)]]))
        assert factor_distance(mdt(A[0]).T, found.T[0]) < 1e-12


def test_equal_matrices():
    """The MDT of one matrix A, or of equal ones, is the Cholesky factor of A A^T, at no cost and without a warning."""
    plain = [np.eye(2), np.array([[2.0, 1.0], [0.0, 3.0]]), np.diag([1.0, -1.0]), 2 * np.eye(3)]
    for A in [*plain, *(A for n in (1, 2, 3) for A in random_matrices(RNG, 10, n))]:
        for count in (1, 50):
            result = mdt(np.broadcast_to(A, (count, *A.shape)))
            np.testing.assert_allclose(result.T, cholesky_factor(A), rtol=1e-13, atol=1e-13)
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
    np.testing.assert_allclose(T @ T.T, geodesic(*A @ np.swapaxes(A, 1, 2), 0.5), rtol=1e-8, atol=1e-9)


@pytest.mark.slow
@each("condition", [1e2, 1e4, 1e6, 1e8, 1e10, 1e12])
@each(("n", "count"), [(1, 40), (2, 40), (3, 40), (3, 300), (4, 300), (5, 40), (8, 40)])
def test_exact_means_of_any_scale(n, count, condition):
    """A mean G G^T whose rows differ by 1e12 in size (cond(A) 1e12, cond(A A^T) 1e24) is found to 1e-13."""
    # Such conditions come of units, and no rounding of A is amplified by them.
    G = graded(n, condition)
    A, w, truth = around(G, count, 0.4)
    for method in ("auto", *(EXACT if condition == 1e2 and count == 40 else [])):
        found = mdt(A, w, method=method)
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
        V -= V.mean(axis=0)
        V += np.swapaxes(V, 1, 2)
        result = mdt(np.eye(n) + 1e-9 * V)
        np.testing.assert_allclose(result.T, np.eye(n), atol=1e-15)
        assert result.cost == pytest.approx(1e-18 * np.mean(np.sum(V * V, axis=(1, 2))), rel=1e-5, abs=0)
    # A hundred thousand matrices, as the samples of a globe, take no special care.
    logs = np.random.default_rng(3).normal(size=(100_000, 2))
    np.testing.assert_allclose(mdt(np.exp(logs)[:, None] * np.eye(2)).T, np.diag(np.exp(logs.mean(axis=0))), rtol=1e-12)


@pytest.mark.slow
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
        theirs = mean_riemann(A @ np.swapaxes(A, 1, 2), tol=tolerance, sample_weight=w)
        assert factor_distance(np.linalg.cholesky(theirs), mdt(A, w).T) < tolerance


@CASES
def test_what_shrinks(seed, n):
    """Matrices of determinant 1, shrunk by c_i, cost n times the variance of ln c_i more: no T takes that out."""
    # A fit that shrinks some images, as linear least squares on a fixed reference does, stays visible.
    rng = np.random.default_rng(seed)
    A, ln_c = random_matrices(rng, 6, n), rng.normal(size=6)
    A /= np.abs(np.linalg.det(A))[:, None, None] ** (1 / n)
    first, second = mdt(A), mdt(np.exp(ln_c)[:, None, None] * A)
    assert second.cost == pytest.approx(first.cost + n * np.var(ln_c), rel=1e-10)
    np.testing.assert_allclose(second.T, np.exp(ln_c.mean()) * first.T, rtol=1e-9, atol=1e-10)
    # With Cholesky's T the LQ factors Q_i of T^-1 A_i are those of A_i.
    np.testing.assert_allclose(lq(np.linalg.solve(first.T, A))[1], lq(A)[1], atol=1e-10)


def arithmetic(A, w):
    """The mean of A_i A_i^T."""
    return np.average(A @ np.swapaxes(A, 1, 2), axis=0, weights=w)


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
        refuses(r"^Invalid weight .* at index 1\. It must be finite and not negative\.$", mdt, A, [1.0, wrong, 1.0])
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
