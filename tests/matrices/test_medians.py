"""The geometric median of matrices: medians that are known, its laws, pyRiemann."""

import numpy as np
import pytest
import scipy.linalg
from matrix_samples import CASES, fisher_squares, graded, random_matrices, random_orthogonal, transposed
from tables import each

from projdist.matrices.mean_transformation import mdt
from projdist.matrices.spd import factor_distance

SIZES = each("n", [1, 2, 3, 6])


def total(T, A, w=None):
    """The weighted mean of Dist_F, by the definition."""
    return float(np.average(np.sqrt(fisher_squares(T, A)), weights=w))


def direction(rng, n):
    """A symmetric matrix of norm 1."""
    S = rng.normal(size=(n, n))
    return (S + S.T) / np.linalg.norm(S + S.T)


def reached(G, V, rng):
    """Factors of the points that the geodesics of velocities V (N, n, n) reach from G G^T, with random rotations."""
    return G @ scipy.linalg.expm(0.5 * V) @ random_orthogonal(rng, len(V), len(G))


def median(A, w=None):
    return mdt(A, w, method="median")


@SIZES
@each("condition", [1.0, 100.0])
def test_on_a_geodesic_it_is_the_median_of_numbers(n, condition):
    """Of points at t on a geodesic it is the one at the weighted median of t, and that is said to be unique."""
    rng = np.random.default_rng(n)
    G, D = graded(n, condition), direction(rng, n)
    for t, w in (([-1.0, 0.2, 3.0], [1, 1, 1]), ([0.0, 0.5, 2.0, 9.0, 9.0], [1, 4, 1, 2, 3]), ([4.0, 1.0], [1, 2])):
        order = np.argsort(t)
        middle = order[np.searchsorted(np.cumsum(np.array(w)[order]), 0.5 * np.sum(w))]
        found = median(reached(G, np.multiply.outer(t, D), rng), w)
        assert factor_distance(G @ scipy.linalg.expm(0.5 * t[middle] * D), found.T) < 1e-13 * condition
        assert found.unique
        assert found.cost == pytest.approx(0.5 * np.average(np.abs(np.array(t) - t[middle]), weights=w), rel=1e-12)


@SIZES
def test_even_weights_on_a_geodesic(n):
    """A gap with half of the weight on either side is all median: its middle is given, and that it is one of many."""
    rng = np.random.default_rng(n)
    G, D = graded(n, 10.0), direction(rng, n)
    for t, w in (([0.0, 1.0], None), ([-3.0, 1.0, 2.0, 2.5], None), ([5.0, -1.0, 0.0], [0.5, 0.2, 0.3])):
        found = median(reached(G, np.multiply.outer(t, D), rng), w)
        order = np.argsort(t)
        cut = len(t) // 2 if w is None else 2
        gap = np.array(t)[order][cut - 1 : cut + 1]
        assert not found.unique
        assert factor_distance(G @ scipy.linalg.expm(0.5 * gap.mean() * D), found.T) < 1e-13
        for s in gap:
            other = G @ scipy.linalg.expm(0.5 * s * D)
            assert total(other, reached(G, np.multiply.outer(t, D), rng), w) == pytest.approx(found.cost, rel=1e-12)


@SIZES
def test_symmetric_sets_and_more_than_half_at_one_place(n):
    """Pairs of points, each as far from a point as its partner and opposite, have it for their median."""
    rng = np.random.default_rng(n)
    G, V = graded(n, 20.0), np.array([length * direction(rng, n) for length in (0.1, 1.0, 3.0, 0.5)])
    found = median(reached(G, np.concatenate([V, -V]), rng))
    assert n == 1 or (found.unique and factor_distance(G, found.T) < 1e-12)
    assert found.cost == pytest.approx(0.5 * np.mean(np.linalg.norm(V, axis=(1, 2))), rel=1e-12)
    # A matrix with more than half of the weight is the median, wherever the others are: the mean is nowhere near.
    A = reached(G, np.array([0.0 * np.eye(n)] * 6 + [20.0 * direction(rng, n) for _ in range(5)]), rng)
    assert factor_distance(G, median(A).T) < 1e-13
    assert median(A).unique
    assert factor_distance(G, mdt(A).T) > 1.0
    assert factor_distance(G, median(A[5:], [6, 1, 1, 1, 1, 1]).T) < 1e-13


def rays(angles, lengths):
    """Velocities in the hyperbolic plane of 2 x 2 matrices of determinant 1, at the identity."""
    p, q = np.cos(angles) * lengths, np.sin(angles) * lengths
    return np.stack([p, q, q, -p], axis=-1).reshape(-1, 2, 2) / np.sqrt(2.0)


def test_three_points():
    """The Fermat point sees them at 120 degrees; seen at more, the third is the median itself."""
    rng = np.random.default_rng(5)
    G = graded(2, 7.0)
    for lengths in ([1.0, 1.0, 1.0], [0.01, 2.0, 5.0], [3.0, 0.5, 1.0]):
        found = median(reached(G, rays(np.radians([20.0, 140.0, 260.0]), np.array(lengths)), rng))
        assert factor_distance(G, found.T) < 1e-12
        assert found.unique
    for angle, is_vertex in ((125.0, True), (119.0, False)):
        found = median(reached(G, rays(np.radians([0.0, angle, 0.0]), np.array([1.0, 2.0, 0.0])), rng))
        assert (factor_distance(G, found.T) < 1e-14) == (found.distances.min() < 1e-28) == is_vertex
        assert found.gradient_norm <= found.floor


def test_sets():
    """Of one matrix it is that matrix; what has no weight does not count, and has its distance."""
    A = random_matrices(np.random.default_rng(1), 4, 3)
    alone = median(A[:1])
    np.testing.assert_allclose(alone.T @ alone.T.T, A[0] @ A[0].T, rtol=1e-13, atol=1e-13)
    assert alone.unique
    found = median(A, [1, 1, 1, 0])
    np.testing.assert_allclose(found.T, median(A[:3]).T, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.distances, fisher_squares(found.T, A), rtol=1e-11)
    # Sets on leading axes have each its own median and numbers.
    pytest.importorskip("pandas")
    rng = np.random.default_rng(4)
    A, w = random_matrices(rng, 72, 2, 0.5).reshape(2, 3, 12, 2, 2), rng.uniform(size=(2, 3, 12))
    A[0, 1] = [[2.0, 0.0], [0.0, 1.0]] * np.exp(np.arange(12.0))[:, None, None]
    w[0, 1] = 1.0
    found = median(A, w)
    assert found.unique.tolist() == [[True, False, True], [True, True, True]]
    assert mdt(A, w).unique.all()
    for k in np.ndindex(2, 3):
        np.testing.assert_allclose(found.T[k], median(A[k], w[k]).T, rtol=1e-13)
    assert len(found.to_frame()) == 6


@CASES
def test_no_other_matrix_is_better(seed, n):
    """The sum of distances grows in every direction, and the numbers told are those of the definition."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, 7, n), rng.uniform(size=7)
    found = median(A, w)
    assert found.cost == pytest.approx(total(found.T, A, w), rel=1e-12)
    for size in (1e-3, 0.1, 1.0):
        for X in size * rng.normal(size=(4, n, n)):
            assert total(found.T @ scipy.linalg.expm(X), A, w) >= found.cost * (1.0 - 1e-13)


@each("n", [2, 3, 5])
def test_isometries(n):
    """Of G A_i it is G times that of A_i, of the transposed inverses that of the median; rotations do not matter."""
    rng = np.random.default_rng(n)
    A, w, G = random_matrices(rng, 9, n, 0.5), rng.uniform(size=9), graded(n, 30.0)
    found = median(A, w)
    assert factor_distance(G @ found.T, median(G @ A, w).T) < 1e-12
    assert factor_distance(found.T, median(A @ random_orthogonal(rng, 9, n), w).T) < 1e-12
    assert factor_distance(np.linalg.inv(found.T).T, median(transposed(np.linalg.inv(A)), w).T) < 1e-11


def test_far_apart_near_and_many():
    """Spreads of 1e-6 and conditions of 1e8 have medians to rounding, too; a hundred thousand matrices take no care."""
    rng = np.random.default_rng(9)
    for spread, G in ((1e-6, graded(3, 3.0)), (4.0, graded(3, 1e8))):
        found = median(G @ random_matrices(rng, 12, 3, spread))
        assert found.gradient_norm <= found.floor
    # Diagonals that are symmetric about 2 and 3 have these for their median.
    V = np.random.default_rng(3).normal(size=(50_000, 2))
    logs = np.log([2.0, 3.0]) + np.concatenate([V, -V])
    found = median(np.exp(logs)[:, None, :] * np.eye(2))
    np.testing.assert_allclose(found.T, np.diag([2.0, 3.0]), rtol=1e-10, atol=1e-10)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(np.ndarray, "mT"), reason="pyRiemann needs numpy 2")
@each("n", [2, 3, 5, 8])
def test_agreement_with_pyriemann(n):
    """Weiszfeld's algorithm as pyRiemann has it, run to its own rounding, ends within 1e-11."""
    median_riemann = pytest.importorskip("pyriemann.geometry.median").median_riemann
    rng = np.random.default_rng(n)
    A, w = random_matrices(rng, 30, n, 0.3), rng.uniform(size=30)
    theirs = median_riemann(A @ transposed(A), tol=1e-13, maxiter=1000, weights=w)
    assert factor_distance(np.linalg.cholesky(theirs), median(A, w).T) < 1e-11
