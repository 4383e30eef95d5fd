"""Clouds whose partners are not known, registered by closest points."""

import math

import numpy as np
import pytest
import scipy.linalg
from cloud_sets import EXACT, moved
from refusals import refuses
from scipy.spatial.transform import Rotation
from tables import each

from projdist.applications.pointclouds import correspondences, register
from projdist.applications.pointclouds.correspondences import log_false_alarms


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
    hits = 0
    for _ in range(pairs):
        z = rng.uniform(-1.0, 1.0, size=(100, n)) * np.linspace(1.0, 0.7, n)
        A = any_rotation(rng, n) @ (np.eye(n) + 0.1 * rng.normal(size=(n, n)))
        first, second = (
            np.concatenate([(z + sigma * rng.normal(size=z.shape))[rows], rng.uniform(-1.2, 1.2, size=(missing, n))])
            for rows in (rng.permutation(100)[missing:] for _ in range(2))
        )
        found = register([first, second @ A.T], correspond="icp", frame="first")
        # What is nearly exact has the say, as the others are no partners: beyond four median distances.
        hits += np.abs(found.matrices[1] @ A - np.eye(n)).max() < 0.1
    assert hits == pairs


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
        turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
        turn[0] *= np.linalg.det(turn)
        A = turn @ (np.eye(n) + 0.15 * rng.normal(size=(n, n)))
        if np.linalg.det(A) < 0:
            continue  # mirror images are not looked for
        rows = [rng.permutation(80)[missing:] for _ in range(2)]
        first, second = (base[k] + 0.005 * rng.normal(size=(len(k), n)) for k in rows)
        found = register([first, second @ A.T], correspond="icp", frame="first")
        both = np.intersect1d(*rows)
        k, m = (np.array([int(np.flatnonzero(one == point)[0]) for point in both]) for one in rows)
        assert np.sqrt(np.mean((found.aligned[1][m] - first[k]) ** 2)) < 0.02
