"""Means of difficult matrices, of named methods and of sets of sets; what is refused."""

import json
import tracemalloc

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

# ---- traps ------------------------------------------------------------------------------------


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
    """Measured from any of the matrices, A_r^-1 A_i, the cost is the same; as references they are worse than T.

    The mean over references of the cost is at least twice the MDT's, for two matrices exactly; and the best
    reference is worse by at least its squared distance from the mean (SPD(n) has no positive curvature).
    """
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


# ---- named methods ----------------------------------------------------------------------------


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


@each("method", EXACT)
@each("n", [1, 2, 3, 6])
def test_exact_methods(method, n):
    """Newton's method and the gradient find the same mean, to rounding."""
    G = graded(n, 50.0)
    A, w, truth = around(G, 30, 0.3)
    found = mdt(A, w, method=method)
    assert factor_distance(G, found.T) < 1e-13
    assert found.cost == pytest.approx(truth, rel=1e-12)


def test_power_means_of_diagonal_matrices():
    """mpm is the midpoint of the power means of orders 0.01 and -0.01, which numbers have in closed form."""
    rng = np.random.default_rng(8)
    d, w = np.exp(rng.normal(size=(9, 3))), rng.uniform(size=9)
    above, below = (np.average(d ** (2 * p), axis=0, weights=w) ** (1 / p) for p in (0.01, -0.01))
    found = mdt(d[:, None, :] * np.eye(3), w, method="mpm").T
    np.testing.assert_allclose(found, np.diag((above * below) ** 0.25), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 6])
def test_power_means_come_near(n):
    """mpm is within 1e-4 of the mean of matrices of moderate spread, and costs next to nothing more."""
    G = graded(n, 3.0)
    A, w, truth = around(G, 30, 0.3)
    found = mdt(A, w, method="mpm")
    assert 1e-12 < factor_distance(G, found.T) < 1e-4
    assert 0 < found.cost - truth < 1e-8


# ---- sets of sets, and large ones -------------------------------------------------------------


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


def test_many_matrices():
    """A hundred thousand matrices, as the samples of a globe, take no special care."""
    rng = np.random.default_rng(3)
    A = np.exp(rng.normal(size=(100_000, 1, 2))) * np.eye(2)
    np.testing.assert_allclose(mdt(A).T, np.diag(np.exp(np.log(np.einsum("nii->ni", A)).mean(axis=0))), rtol=1e-12)


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


# ---- errors -----------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(2, 2), (3, 2, 3), (0, 2, 2), (3, 0, 0), (4,)])
def test_shapes_are_checked(shape):
    """Matrices that are not (..., N, n, n) are refused with their shape."""
    refuses(r"^Invalid shape \(.*\) of matrices\. It must be \(\.\.\., N, n, n\) with N and n", mdt, np.ones(shape))


@each("n", [2, 3])
@each("wrong", ["dependent", "zero", "nan", "infinite"])
def test_matrices_are_checked(wrong, n):
    """The first singular or undefined matrix is named by its index, in a set and in a set of sets."""
    bad = {
        "dependent": np.outer(np.arange(1.0, n + 1), np.arange(1.0, n + 1)),
        "zero": np.zeros((n, n)),
        "nan": np.where(np.eye(n) == 1, np.nan, 0.0),
        "infinite": np.full((n, n), np.inf),
    }[wrong]
    A = np.stack([np.eye(n), np.eye(n), bad, np.zeros((n, n))])
    refuses(r"^Invalid matrix at index 2\. It must be finite and invertible\.$", mdt, A)
    sets = np.broadcast_to(np.eye(n), (2, 3, 4, n, n)).copy()
    sets[1, 0] = A
    refuses(r"^Invalid matrix at index \(1, 0, 2\)\. It must be finite and invertible\.$", mdt, sets)


def test_the_range_of_doubles():
    """Matrices farther apart than doubles reach have no mean that could be told."""
    with pytest.raises(ValueError, match=r"^Invalid matrices\. They lie so far apart that their squares leave"):
        mdt([np.diag([1e-80, 1e80]), np.diag([1e80, 1e-80])])


def test_methods_are_checked():
    """An unknown method is refused with the names of the known ones."""
    match = (
        r"^Invalid method 'karcher'\. It must be one of auto, newton, gradient, mpm, log_euclidean, log_cholesky, arith"
    )
    refuses(match, mdt, [np.eye(2)], method="karcher")


@pytest.mark.parametrize("weights", [[1.0], [1.0, 1.0, 1.0, 1.0], [[1.0, 1.0, 1.0]], 1.0])
def test_weights_have_the_shape_of_the_matrices(weights):
    """Weights are one a matrix."""
    with pytest.raises(ValueError, match=r"^Invalid shape \(.*\) of weights\. It must be \(3,\), as many as matrices"):
        mdt(np.stack([np.eye(2)] * 3), weights)


@pytest.mark.parametrize("weights", [[1.0, -1.0, 1.0], [1.0, np.nan, 1.0], [1.0, np.inf, 1.0]])
def test_weights_are_checked(weights):
    """Negative and undefined weights are refused with their index."""
    match = r"^Invalid weight .* at index 1\. It must be finite and not negative\.$"
    refuses(match, mdt, np.stack([np.eye(2)] * 3), weights)


def test_weights_that_are_all_zero():
    """There is no mean of nothing."""
    refuses(r"^Invalid weights.*\. They must not all be zero\.$", mdt, np.stack([np.eye(2)] * 3), np.zeros(3))
    with pytest.raises(ValueError, match=r"^Invalid weights at index 1\. They must not all be zero\.$"):
        mdt(np.broadcast_to(np.eye(2), (2, 3, 2, 2)), [[1, 1, 1], [0, 0, 0]])


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
