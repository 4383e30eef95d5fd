"""Registered clouds against the affine maps they were made with, the laws of affine fits, and closest points."""

import json
import math

import numpy as np
import pytest
import scipy.linalg
from cloud_sets import EXACT, made, maps, moved
from matrix_samples import CASES, fisher_squares
from refusals import refuses
from scipy.spatial.transform import Rotation
from tables import each

from projdist.applications.pointclouds import FRAMES, affine_fit, correspondences, register
from projdist.applications.pointclouds.correspondences import log_false_alarms
from projdist.matrices.mean_transformation import mdt


def chained(clouds, shared):
    """Clouds in a row, of which neighbours alone share points."""
    count, points = clouds.shape[:2]
    at, width = np.arange(points), points // (count + 1)
    chain = clouds.copy()
    for i in range(count):
        chain[i, (at < i * width) | (at >= (i + 1) * width + shared)] = np.nan
    return chain


@CASES
def test_two_clouds(seed, n):
    """Both fits find the map that made one set from the other; with noise each does what its name says."""
    rng = np.random.default_rng(seed)
    (y, z), B = made(rng, n, 2)
    truth = B[1] @ np.linalg.inv(B[0])
    for method in ("symmetric", "least_squares"):
        fit = affine_fit(y, z, method=method)
        np.testing.assert_allclose(fit.matrix, truth, atol=EXACT * np.linalg.cond(truth))
        np.testing.assert_allclose(y @ fit.matrix.T + fit.shift, z, atol=EXACT * np.abs(z).max())
        np.testing.assert_allclose(fit.correlations, 1.0, rtol=1e-12)
    # Exchanged sets have the inverse map, and the covariance of the mapped points is that of the target.
    (y, z), _ = made(rng, n, 2, noise=0.3)
    there, back = affine_fit(y, z), affine_fit(z, y)
    np.testing.assert_allclose(there.matrix @ back.matrix, np.eye(n), atol=EXACT)
    np.testing.assert_allclose(np.cov(y @ there.matrix.T, rowvar=False), np.cov(z, rowvar=False), rtol=1e-8, atol=EXACT)
    # Least squares is numpy's, and shrinks volumes by the product of the correlations, there and back.
    there, back = (affine_fit(*pair, method="least_squares") for pair in ((y, z), (z, y)))
    solved = np.linalg.lstsq(np.c_[y, np.ones(len(y))], z, rcond=None)[0]
    np.testing.assert_allclose(np.vstack([there.matrix.T, there.shift]), solved, rtol=1e-8, atol=1e-8)
    determinant = np.linalg.det(there.matrix @ back.matrix)
    assert determinant == pytest.approx(np.prod(there.correlations) ** 2, rel=1e-8)
    assert determinant < 1


def test_one_dimension_and_far_from_the_origin():
    """In one dimension it is the reduced major axis: the slope is the ratio of the standard deviations."""
    rng = np.random.default_rng(2)
    y = rng.normal(size=(50, 1))
    z = -3 * y + rng.normal(size=y.shape)
    assert affine_fit(y, z).matrix[0, 0] == pytest.approx(-z.std() / y.std(), rel=1e-12)
    r = np.corrcoef(y.ravel(), z.ravel())[0, 1]
    assert affine_fit(y, z, method="least_squares").matrix[0, 0] == pytest.approx(r * z.std() / y.std(), rel=1e-12)
    # Clouds of ten metres at coordinates of 5e6, as of UTM, are neither flat nor lost.
    rng = np.random.default_rng(1)
    y = 10 * rng.normal(size=(40, 3)) + [5e5, 5e6, 300]
    B, s = np.eye(3) + 0.1 * rng.normal(size=(3, 3)), rng.normal(size=3)
    fit = affine_fit(y, y @ B.T + s)
    np.testing.assert_allclose(fit.matrix, B, atol=1e-8)
    np.testing.assert_allclose(y @ fit.matrix.T + fit.shift, y @ B.T + s, atol=1e-7)


@pytest.mark.slow
@CASES
def test_exact_recovery(seed, n):
    """Clouds made from one by affine maps meet in the frame, in any of the frames, at the cost the MDT says."""
    rng = np.random.default_rng(seed)
    clouds, B = made(rng, n)
    A = np.linalg.inv(B)
    for frame in (*FRAMES, 3):
        found = register(clouds, frame=frame)
        assert found.rms_total < EXACT * np.abs(clouds).max()
        relative = found.matrices @ B
        np.testing.assert_allclose(relative, np.broadcast_to(relative[0], A.shape), atol=EXACT)
    np.testing.assert_allclose(found.matrices[3], np.eye(n), atol=EXACT)
    np.testing.assert_allclose(found.aligned[0], clouds[3], atol=EXACT * np.abs(clouds).max())
    for k, total in enumerate(found.sums):
        assert total == pytest.approx(fisher_squares(A[k], A).sum(), rel=1e-8)
    mean = mdt(A)  # T stands on the left, T^-1 A_i
    np.testing.assert_allclose(register(clouds).distortions ** 2, mean.distances, rtol=1e-8)
    assert found.mdt_sum == pytest.approx(len(A) * mean.cost, rel=1e-8)


@pytest.mark.slow
@CASES
def test_gauge_order_and_frames(seed, n):
    """Each cloud in other affine coordinates has the map of before behind the map back: to 1e-10."""
    rng = np.random.default_rng(seed)
    clouds, _ = made(rng, n, noise=0.2)
    B, s = maps(rng, n, len(clouds))
    found, other = register(clouds, frame="first"), register(moved(clouds, B, s), frame="first")
    np.testing.assert_allclose(B[0] @ found.matrices, other.matrices @ B, rtol=0, atol=EXACT * np.abs(B).max())
    np.testing.assert_allclose(found.correlations, other.correlations, atol=EXACT)
    # In another order, turned and scaled together, clouds have the same sums, and turn and scale in their frame.
    order = rng.permutation(len(clouds))
    found, other = register(clouds), register(clouds[order])
    np.testing.assert_allclose(other.matrices, found.matrices[order], atol=EXACT)
    np.testing.assert_allclose(other.shifts, found.shifts[order], atol=EXACT * np.abs(clouds).max())
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    other = register(7 * clouds @ turn.T)
    np.testing.assert_allclose(other.matrices, turn @ found.matrices @ turn.T, atol=EXACT)
    np.testing.assert_allclose(other.sums, found.sums, rtol=EXACT)
    np.testing.assert_allclose(other.aligned, 7 * np.array(found.aligned) @ turn.T, atol=1e-9 * np.abs(clouds).max())
    references = {"first": 0, "last": 4, "central": 2, "best": int(np.argmin(found.sums))}
    expected = {name: (str(k), found.sums[k]) for name, k in references.items()}
    assert found.frames == expected | {"mdt": (None, found.mdt_sum)}
    # Of two clouds the fit is the symmetric fit of one onto the other.
    fit = affine_fit(clouds[1], clouds[0])
    np.testing.assert_allclose(register(clouds[:2], frame="first").matrices[1], fit.matrix, atol=EXACT)
    # In the frame of the MDT the clouds lie about where they lay, and turned on average as they were.
    np.testing.assert_allclose(np.mean(found.aligned, axis=(0, 1)), clouds.mean(axis=(0, 1)), atol=1e-9)
    mean = np.mean([scipy.linalg.polar(M)[0] for M in found.matrices], axis=0)
    np.testing.assert_allclose(mean, mean.T, atol=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3])
def test_chains(n):
    """Ten clouds in a row, each of which shares ten points with the next, are found exactly; noise settles, too."""
    rng = np.random.default_rng(n)
    clouds, B = made(rng, n, 10, 110)
    found = register(chained(clouds, 10), frame="first")
    np.testing.assert_allclose(found.matrices, B[0] @ np.linalg.inv(B), atol=1e-9)
    noisy, _ = made(rng, n, 10, 110, noise=0.05)
    assert register(chained(noisy, 10)).converged


@pytest.mark.slow
def test_points_of_one_cloud_and_ids():
    """Points that are in one cloud alone do not count, and are moved."""
    clouds, B = made(np.random.default_rng(3), 2, 3, 20)
    clouds[1:, :5] = np.nan
    found = register(clouds, frame="last")
    assert found.used.tolist() == [15, 15, 15]
    np.testing.assert_allclose(found.matrices[0], B[2] @ np.linalg.inv(B[0]), atol=EXACT)
    assert np.isfinite(found.aligned[0]).all()
    # Points with equal ids are the same, in whatever rows they stand.
    rng = np.random.default_rng(4)
    clouds, _ = made(rng, 3, 3, 12, noise=0.1)
    ids = [f"p{k}" for k in range(12)]
    orders = [rng.permutation(12)[:10] for _ in clouds]
    ordered = [cloud[order] for cloud, order in zip(clouds, orders, strict=True)]
    found = register(ordered, correspond="id", ids=[[ids[k] for k in order] for order in orders])
    gaps = np.full_like(clouds, np.nan)
    for gap, cloud, order in zip(gaps, clouds, orders, strict=True):
        gap[order] = cloud[order]
    np.testing.assert_allclose(found.matrices, register(gaps).matrices, atol=EXACT)


@pytest.mark.slow
def test_modes():
    """Clouds that differ by their height alone have that for their only mode, whatever the frame."""
    points = np.random.default_rng(5).normal(size=(30, 3))
    clouds = [points * [1.0, 1.0, height] for height in (1.0, 1.5, 3.0, 0.4)]
    for frame in ("mdt", 0):
        found = register(clouds, frame=frame)
        assert found.modes.shares[0] == pytest.approx(1.0, abs=1e-12)
        assert found.modes.rms[0] == pytest.approx(np.std(np.log([1.0, 1.5, 3.0, 0.4])), rel=1e-10)
    assert register(clouds).modes.words[0] == "z +1.0"
    assert len(found.to_dict()["modes"]) == 6


def test_forms():
    """A registration can be had as JSON and as a frame, a row a cloud."""
    pytest.importorskip("pandas")
    clouds, _ = made(np.random.default_rng(11), 3, noise=0.1)
    found = register(clouds, frame="best")
    data = json.loads(found.to_json())
    assert data["frames"].keys() == set(FRAMES)
    assert data["reference"] == data["frames"]["best"]["cloud"]
    assert np.array(data["clouds"][2]["matrix"]).tolist() == found.matrices[2].tolist()
    frame = found.to_frame()
    np.testing.assert_array_equal(frame[["t_0", "t_1", "t_2"]], found.shifts)
    np.testing.assert_array_equal(frame["M_12"], found.matrices[:, 1, 2])


@each("n", [2, 3, 5])
def test_icp(n):
    """Clouds in no order, misplaced by a tenth of their size, come to the maps that made them, in any order."""
    rng = np.random.default_rng(n)
    z = rng.normal(size=(60, n)) * np.linspace(1, 2, n)
    B = scipy.linalg.expm(0.06 * rng.normal(size=(4, n, n)))
    clouds = moved(np.broadcast_to(z, (4, 60, n)), B, 0.06 * rng.normal(size=(4, n)))
    clouds = [rng.permutation(cloud) for cloud in clouds]
    found = register(clouds, correspond="icp", frame="first")
    np.testing.assert_allclose(found.matrices, B[0] @ np.linalg.inv(B), atol=EXACT)
    assert found.warnings == []
    other = register(clouds[::-1], correspond="icp", frame="last")
    np.testing.assert_allclose(other.matrices[::-1], found.matrices, atol=EXACT)


def test_icp_with_parts_and_noise():
    """Points that others do not have, and noise, leave it near the truth, and shrink nothing."""
    rng = np.random.default_rng(1)
    z = rng.uniform(-1, 1, size=(200, 3))
    B = scipy.linalg.expm(0.05 * rng.normal(size=(3, 3, 3)))
    clouds = moved(z + 0.005 * rng.normal(size=(3, 200, 3)), B, 0.05 * rng.normal(size=(3, 3)))
    clouds = [rng.permutation(cloud)[: 160 + 20 * k] for k, cloud in enumerate(clouds)]
    found = register(clouds, correspond="icp", frame="first")
    np.testing.assert_allclose(found.matrices, B[0] @ np.linalg.inv(B), atol=0.01)
    assert abs(np.linalg.slogdet(found.matrices @ B)[1] - np.linalg.slogdet(B[0])[1]).max() < 0.01


def any_rotation(rng, n):
    """By Gram and Schmidt, the same whatever SciPy's version."""
    Q, R = np.linalg.qr(rng.normal(size=(n, n)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.where(np.arange(n) == 0, np.linalg.det(Q), 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("pairs", [2, 8])
@pytest.mark.parametrize("fine", [1e-9, 1e-3])
@pytest.mark.parametrize(("n", "missing"), [(2, 0), (3, 10)])
def test_icp_where_half_of_the_points_are_nearly_exact(n, missing, fine, pairs):
    """The other half is off by a tenth of the clouds' size; they are turned by any angle, and some points strange."""
    rng = np.random.default_rng(n)
    sigma = np.where(np.arange(100) < 50, fine, 0.1)[:, None]
    for _ in range(pairs):
        z = rng.uniform(-1.0, 1.0, size=(100, n)) * np.linspace(1.0, 0.7, n)
        A = any_rotation(rng, n) @ (np.eye(n) + 0.1 * rng.normal(size=(n, n)))
        first, second = (
            np.concatenate([(z + sigma * rng.normal(size=z.shape))[rows], rng.uniform(-1.2, 1.2, size=(missing, n))])
            for rows in (rng.permutation(100)[missing:] for _ in range(2))
        )
        found = register([first, second @ A.T], correspond="icp", frame="first")
        # What is nearly exact has the say, as the others are no partners: beyond four median distances.
        assert np.abs(found.matrices[1] @ A - np.eye(n)).max() < 0.1


@pytest.mark.slow
@each("n", [1, 2, 3])
def test_false_alarms(n):
    """They are those of the definition, counted in whole numbers, and at random there are hardly any."""
    rng = np.random.default_rng(n)
    points = rng.uniform(size=(40, n))
    apart = correspondences._spacing(points)
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    assert apart == pytest.approx(np.median(np.sort(distances)[:, 1]), rel=1e-12)
    assert correspondences._spacing(np.repeat(points, 3, axis=0)) == pytest.approx(apart, rel=1e-12)
    near = np.sort(rng.uniform(size=40)) ** 2 * apart
    chances = {k: 1 - 2 ** -((near[k - 1] / apart) ** n) for k in range(n + 2, 41)}
    alarms = [(39 - n) * math.comb(40, k) * chance ** (k - n - 1) for k, chance in chances.items()]
    assert log_false_alarms(rng.permutation(near), apart, n) == pytest.approx(math.log(min(alarms)), rel=1e-12)
    assert log_false_alarms(near[: n + 1], apart, n) == math.inf
    # In many dimensions volumes are small and great beyond what a float holds.
    assert log_false_alarms(np.full(203, 1e-9), 1.0, 200) < -700.0
    assert log_false_alarms(np.full(203, 1e9), 1.0, 200) == pytest.approx(math.log(2), rel=1e-12)
    by_chance = []
    for _ in range(300):
        cloud, other = rng.uniform(size=(2, 40, n))
        nearest = np.linalg.norm(cloud[:, None] - other, axis=2).min(axis=0)
        by_chance.append(log_false_alarms(nearest, correspondences._spacing(other), n))
    # Less than a false alarm in a hundred, on average, is to be met in about three of 300.
    assert np.sum(np.array(by_chance) < np.log(0.01)) <= 10


def test_what_has_no_partners():
    """A flat cloud is left out with its reason; where all are flat there is nothing to register."""
    rng = np.random.default_rng(2)
    z = rng.normal(size=(30, 3))
    found = register([z, z[::-1], z * [1, 1, 0]], correspond="icp")
    assert [one.name for one in found.left_out] == ["2"]
    refuses(r"^Invalid clouds\. Fewer than two share points enough; ", register, [z * [1, 1, 0]] * 2, correspond="icp")
    # Of two points that are near one of the other cloud the nearer has it, and what is far off has nobody.
    cloud = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [500.0, 0.0]])
    template = np.array([[0.1, 0.0], [0.3, 0.0], [10.2, 0.0], [20.1, 0.0], [90.0, 0.0]])
    assert correspondences._partners(cloud, template).tolist() == [0, -1, 1, 2, -1]


def test_turns_in_space():
    """From any rotation the next is hardly farther than 1000 can let it be: 11.4 degrees on average."""
    # A ball of the angle a has (a - sin a) / pi of all rotations: 1 of 1000 for 15.3 degrees, of which the mean is 3/4.
    turns = correspondences._turns(3)
    np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, rtol=1e-12)
    any_turn = Rotation.random(2000, np.random.default_rng(1)).as_matrix()
    cosines = (np.einsum("aij,bij->ab", any_turn, turns).max(axis=1) - 1.0) / 2.0
    away = np.degrees(np.arccos(np.minimum(cosines, 1.0)))
    assert (away.mean() < 1.05 * 11.4, away.max() < 1.5 * 15.3) == (True, True)


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("missing", [0, 8])
def test_closest_points_turned_all_around(n, missing):
    """Affine images of clouds in any order, turned by any angle, points missing on either side, find partners."""
    rng = np.random.default_rng(2 + missing)
    for _ in range(10):
        base = rng.uniform(-1.0, 1.0, size=(80, n)) * np.linspace(1.0, 0.7, n)
        A = any_rotation(rng, n) @ (np.eye(n) + 0.15 * rng.normal(size=(n, n)))
        if np.linalg.det(A) < 0:
            continue  # mirror images are not looked for
        rows = [rng.permutation(80)[missing:] for _ in range(2)]
        first, second = (base[k] + 0.005 * rng.normal(size=(len(k), n)) for k in rows)
        found = register([first, second @ A.T], correspond="icp", frame="first")
        both = np.intersect1d(*rows)
        k, m = (np.array([int(np.flatnonzero(one == point)[0]) for point in both]) for one in rows)
        assert np.sqrt(np.mean((found.aligned[1][m] - first[k]) ** 2)) < 0.02
