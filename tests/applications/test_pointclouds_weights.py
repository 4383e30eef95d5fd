"""Weights of points: as counts, of one cloud, as inverse variances, and wrong ones."""

import numpy as np
import pytest
from cloud_sets import EXACT, made, moved
from refusals import refuses

from projdist.applications.pointclouds import affine_fit, register
from projdist.applications.pointclouds.affine import consensus


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("method", ["symmetric", "least_squares"])
def test_weights_are_counts(n, method):
    """Rows of whole weights are as so many rows, rows of weight 0 as missing, and only ratios count."""
    rng = np.random.default_rng(n)
    clouds, _ = made(rng, n, noise=0.2)
    clouds[2, 4:9] = np.nan
    counts = rng.integers(0, 4, size=30)
    repeated = register([np.repeat(cloud, counts, axis=0) for cloud in clouds], method=method)
    for weights in (counts, 1e-3 * counts, np.tile(1e9 * counts, (5, 1)), [list(counts)] * 5):
        found = register(clouds, weights=weights, method=method)
        np.testing.assert_allclose(found.matrices, repeated.matrices, atol=EXACT)
        np.testing.assert_allclose(found.shifts, repeated.shifts, atol=EXACT * np.abs(np.nan_to_num(clouds)).max())
        np.testing.assert_allclose(found.correlations, repeated.correlations, atol=EXACT)
        np.testing.assert_allclose(found.rms, repeated.rms, rtol=1e-9)
        assert found.rms_total == pytest.approx(repeated.rms_total, rel=1e-9)
    assert found.used.tolist() == [int(np.sum(counts[~np.isnan(cloud[:, 0])] > 0)) for cloud in clouds]
    fits = [affine_fit(clouds[0], clouds[1], weights=counts, method=method)]
    fits.append(affine_fit(*(np.repeat(cloud, counts, axis=0) for cloud in clouds[:2]), method=method))
    np.testing.assert_allclose(fits[0].matrix, fits[1].matrix, atol=EXACT)
    np.testing.assert_allclose(fits[0].shift, fits[1].shift, atol=EXACT * np.abs(clouds[0]).max())


@pytest.mark.slow
def test_a_weight_of_one_cloud():
    """A point of weight 0 in one cloud is missing there alone; equal weights are none."""
    rng = np.random.default_rng(6)
    clouds, _ = made(rng, 2, noise=0.2)
    plain = register(clouds)
    equal = register(clouds, weights=np.full((5, 30), 7.0))
    np.testing.assert_allclose(equal.matrices, plain.matrices, atol=EXACT)
    np.testing.assert_allclose(equal.left_out_distances, plain.left_out_distances, rtol=1e-9)
    weights = np.ones((5, 30))
    weights[1, :6] = 0.0
    found = register(clouds, weights=weights)
    assert np.isfinite(found.aligned[1]).all()
    clouds[1, :6] = np.nan
    np.testing.assert_allclose(found.matrices, register(clouds).matrices, atol=EXACT)


def test_weighted_means_are_self_consistent():
    """With weights of their own each cloud lies by its weighted fit onto the weighted mean of all."""
    rng = np.random.default_rng(7)
    clouds, _ = made(rng, 3, 6, 60, noise=0.1)
    weights = rng.uniform(0.1, 2.0, size=clouds.shape[:2]) * (rng.uniform(size=clouds.shape[:2]) < 0.8)
    group = consensus(clouds, weights)
    assert group.converged
    mean = np.average(moved(clouds, group.A, group.shift), axis=0, weights=np.tile(weights[..., None], 3))
    fits = [affine_fit(y, mean, weights=w).matrix for y, w in zip(clouds, weights, strict=True)]
    shrunk = np.array([fit @ np.linalg.inv(A) for fit, A in zip(fits, group.A, strict=True)])
    np.testing.assert_allclose(shrunk, np.broadcast_to(shrunk[0], shrunk.shape), atol=1e-9)


def test_weights_of_closest_points():
    """Where closest points are the partners, fits are those of rows; rows of weight 0 find none."""
    rng = np.random.default_rng(1)
    z = rng.uniform(-1.0, 1.0, size=(60, 2))
    # Uniform errors: none is farther than four medians, as which it would be no partner.
    first, second = (
        z,
        (z + 0.002 * rng.uniform(-1.0, 1.0, size=z.shape)) @ (np.eye(2) + 0.05 * rng.normal(size=(2, 2))).T,
    )
    weights = rng.uniform(0.01, 1.0, size=60)
    weights[:20] = 0.0
    given = register([first, second], weights=weights)
    found = register([first, second], correspond="icp", weights=[7.0 * weights, 7.0 * weights])
    np.testing.assert_allclose(found.matrices, given.matrices, atol=EXACT)
    assert (found.used.tolist(), found.warnings) == ([40, 40], [])
    assert np.abs(register([first[20:], second[20:]]).matrices - given.matrices).max() > 1e-5


@pytest.mark.slow
def test_weights_are_inverse_variances():
    """Points of unequal errors whose weights tell of them: 5 % of sets have any named, and what is wrong is found."""
    rng = np.random.default_rng(9)
    named = 0
    sigma = np.geomspace(0.003, 0.3, 20)[:, None]
    for _ in range(200):
        z = rng.normal(size=(20, 2))
        named += bool(
            register([z + sigma * rng.normal(size=z.shape) for _ in range(2)], weights=sigma[:, 0] ** -2).wrong
        )
    # The chance of more than 21 of 200 at a rate of 5 % is 2 in 1000.
    assert 1 <= named <= 21
    z = rng.normal(size=(20, 2))
    first, second = (z + sigma * rng.normal(size=z.shape) for _ in range(2))
    second[2] += 0.1  # of errors of .005; no more than others have
    robust = register([first, second], weights=sigma[:, 0] ** -2, robust=True)
    assert {one.point for one in robust.wrong} == {"3"}
    assert "3" not in {one.point for one in register([first, second]).wrong}


def test_weights_are_checked():
    """Weights that are none are one line."""
    a = np.random.default_rng(1).normal(size=(6, 2))
    one = "Invalid weights of cloud '0'"
    for match, weights in {
        rf"^{one}\. That of point 2 is -1; it must be finite and not negative\.$": [1, -1, 1, 1, 1, 1],
        rf"^{one}\. That of point 1 is nan; ": [np.nan, 1, 1, 1, 1, 1],
        rf"^{one}\. That of point 1 is inf; ": [np.inf, 1, 1, 1, 1, 1],
        rf"^{one}\. They must not all be 0\.$": np.zeros(6),
        r"^Invalid weights of cloud '1'\. They must not all be 0\.$": [np.ones(6), np.zeros(6)],
        rf"^{one}\. There must be one a point, 6; their shape is \(5,\)\.$": np.ones(5),
        rf"^{one}\. There must be one a point, 6; their shape is \(1,\)\.$": 3.0,
        rf"^{one}\. They must be numbers\.$": "abcdef",
        r"^Invalid weights\. There must be one for each row, or 2 arrays, one a cloud; there are 3 arrays\.$": np.ones(
            (3, 6)
        ),
    }.items():
        refuses(match, register, [a, a + 1.0], weights=weights)
    refuses(r"^Invalid weights\. They must not all be 0\.$", affine_fit, a, a, weights=np.zeros(6))
