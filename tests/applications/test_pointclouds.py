"""Registered clouds against the affine maps they were made with, and the laws of affine fits and of the MDT."""

import json
import math

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from projdist.applications.pointclouds import FRAMES, affine_fit, icp, register
from projdist.applications.pointclouds.false_alarms import log_false_alarms
from projdist.applications.pointclouds.groupwise import consensus

CASES = given(seed=st.integers(0, 2**32 - 1), n=st.sampled_from([2, 3, 5]))
EXACT = 1e-10  # rounding, with maps of condition 10 or so


def maps(rng, n, count):
    """Invertible matrices of positive determinant, and shifts."""
    return scipy.linalg.expm(0.6 / np.sqrt(n) * rng.normal(size=(count, n, n))), 10 * rng.normal(size=(count, n))


def moved(clouds, B, s):
    return np.einsum("nij,nmj->nmi", B, clouds) + s[:, None]


def made(rng, n, count=5, points=30, noise=0.0):
    """Clouds B_i (z + noise) + s_i, and B_i: a set of points mapped by known maps."""
    z = rng.normal(size=(points, n))
    B, s = maps(rng, n, count)
    return moved(z + noise * rng.normal(size=(count, points, n)), B, s), B


def dist_square(A):
    """Dist_F^2 by its definition."""
    return np.sum(np.log(np.linalg.svd(A, compute_uv=False)) ** 2, axis=-1)


def chained(clouds, shared):
    """Clouds in a row, of which neighbours alone share points."""
    count, points = clouds.shape[:2]
    at, width = np.arange(points), points // (count + 1)
    chain = clouds.copy()
    for i in range(count):
        chain[i, (at < i * width) | (at >= (i + 1) * width + shared)] = np.nan
    return chain


# ---- two clouds -----------------------------------------------------------------------------


@CASES
def test_a_map_is_found(seed, n):
    """Both fits find the map that made one set from the other, and correlations of 1."""
    rng = np.random.default_rng(seed)
    (y, z), B = made(rng, n, 2)
    truth = B[1] @ np.linalg.inv(B[0])
    for method in ("symmetric", "least_squares"):
        fit = affine_fit(y, z, method=method)
        np.testing.assert_allclose(fit.matrix, truth, atol=EXACT * np.linalg.cond(truth))
        np.testing.assert_allclose(y @ fit.matrix.T + fit.shift, z, atol=EXACT * np.abs(z).max())
        np.testing.assert_allclose(fit.correlations, 1.0, rtol=1e-12)


@CASES
def test_the_symmetric_fit_is_symmetric(seed, n):
    """Exchanged sets have the inverse map, and the covariance of the mapped points is that of the target."""
    rng = np.random.default_rng(seed)
    (y, z), _ = made(rng, n, 2, noise=0.3)
    there, back = affine_fit(y, z), affine_fit(z, y)
    np.testing.assert_allclose(there.matrix @ back.matrix, np.eye(n), atol=EXACT)
    np.testing.assert_allclose(np.cov(y @ there.matrix.T, rowvar=False), np.cov(z, rowvar=False), rtol=1e-8, atol=EXACT)


def test_one_dimension():
    """In one dimension it is the reduced major axis: the slope is the ratio of the standard deviations."""
    rng = np.random.default_rng(2)
    y = rng.normal(size=(50, 1))
    z = -3 * y + rng.normal(size=y.shape)
    assert affine_fit(y, z).matrix[0, 0] == pytest.approx(-z.std() / y.std(), rel=1e-12)
    r = np.corrcoef(y.ravel(), z.ravel())[0, 1]
    assert affine_fit(y, z, method="least_squares").matrix[0, 0] == pytest.approx(r * z.std() / y.std(), rel=1e-12)


@CASES
def test_least_squares_is_least_squares(seed, n):
    """It is numpy's solution, and shrinks volumes by the product of the correlations, there and back."""
    rng = np.random.default_rng(seed)
    (y, z), _ = made(rng, n, 2, noise=0.3)
    there, back = (affine_fit(*pair, method="least_squares") for pair in ((y, z), (z, y)))
    solved = np.linalg.lstsq(np.c_[y, np.ones(len(y))], z, rcond=None)[0]
    np.testing.assert_allclose(np.vstack([there.matrix.T, there.shift]), solved, rtol=1e-8, atol=1e-8)
    determinant = np.linalg.det(there.matrix @ back.matrix)
    assert determinant == pytest.approx(np.prod(there.correlations) ** 2, rel=1e-8)
    assert determinant < 1


def test_noise_shrinks_least_squares_only():
    """Of two noisy pictures of the same points, least squares shrinks by 1 / (1 + sigma^2) an axis, symmetric by none.

    The factor is the attenuation of errors in variables (Fuller 1987, Measurement Error Models, section 1.1).
    """
    rng, sigma, n = np.random.default_rng(5), 0.4, 3
    found = {}
    for method in ("symmetric", "least_squares"):
        logs = []
        for _ in range(100):
            z = rng.normal(size=(200, n))
            y, x = z + sigma * rng.normal(size=(2, *z.shape))
            logs.append(np.linalg.slogdet(affine_fit(y, x, method=method).matrix)[1] / n)
        found[method] = np.mean(logs), np.std(logs) / 10
    for method, truth in {"symmetric": 0.0, "least_squares": -np.log(1 + sigma**2)}.items():
        mean, error = found[method]
        assert abs(mean - truth) < 4 * error + 0.002, method  # 0.002: the bias of two hundred points


def test_far_from_the_origin():
    """Clouds of ten metres at coordinates of 5e6, as of UTM, are neither flat nor lost."""
    rng = np.random.default_rng(1)
    y = 10 * rng.normal(size=(40, 3)) + [5e5, 5e6, 300]
    B, s = np.eye(3) + 0.1 * rng.normal(size=(3, 3)), rng.normal(size=3)
    fit = affine_fit(y, y @ B.T + s)
    np.testing.assert_allclose(fit.matrix, B, atol=1e-8)
    np.testing.assert_allclose(y @ fit.matrix.T + fit.shift, y @ B.T + s, atol=1e-7)


# ---- several clouds -------------------------------------------------------------------------


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
        assert total == pytest.approx(dist_square(np.linalg.solve(A[k], A)).sum(), rel=1e-8)
    assert register(clouds).distortions @ register(clouds).distortions == pytest.approx(found.mdt_sum, rel=1e-8)


@pytest.mark.slow
@CASES
def test_the_gauge_does_not_count(seed, n):
    """Each cloud in other affine coordinates has the map of before behind the map back: to 1e-10."""
    rng = np.random.default_rng(seed)
    clouds, _ = made(rng, n, noise=0.2)
    B, s = maps(rng, n, len(clouds))
    found, other = register(clouds, frame="first"), register(moved(clouds, B, s), frame="first")
    np.testing.assert_allclose(B[0] @ found.matrices, other.matrices @ B, rtol=0, atol=EXACT * np.abs(B).max())
    np.testing.assert_allclose(found.correlations, other.correlations, atol=EXACT)


@pytest.mark.slow
@CASES
def test_the_order_does_not_count(seed, n):
    """In another order, turned and scaled together, clouds have the same sums, and turn and scale in their frame."""
    rng = np.random.default_rng(seed)
    clouds, _ = made(rng, n, noise=0.2)
    order = rng.permutation(len(clouds))
    found, other = register(clouds), register(clouds[order])
    np.testing.assert_allclose(other.matrices, found.matrices[order], atol=EXACT)
    np.testing.assert_allclose(other.shifts, found.shifts[order], atol=EXACT * np.abs(clouds).max())
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    other = register(7 * clouds @ turn.T)
    np.testing.assert_allclose(other.matrices, turn @ found.matrices @ turn.T, atol=EXACT)
    np.testing.assert_allclose(other.sums, found.sums, rtol=EXACT)
    np.testing.assert_allclose(other.aligned, 7 * np.array(found.aligned) @ turn.T, atol=1e-9 * np.abs(clouds).max())


@pytest.mark.slow
@CASES
def test_frames(seed, n):
    """The MDT beats every cloud: references cost twice as much on average at least, the best its distance more."""
    clouds, _ = made(np.random.default_rng(seed), n, noise=0.2)
    found = register(clouds)
    assert found.sums.mean() >= 2 * found.mdt_sum * (1 - EXACT)
    best = int(np.argmin(found.sums))
    assert found.sums[best] >= found.mdt_sum + len(clouds) * found.distortions[best] ** 2 - EXACT
    assert found.frames["best"] == (str(best), found.sums[best])
    assert found.frames["central"] == ("2", found.sums[2])
    assert (found.frames["first"][0], found.frames["last"][0], found.frames["mdt"][0]) == ("0", "4", None)
    pair = register(clouds[:2])
    assert pair.sums.mean() == pytest.approx(2 * pair.mdt_sum, rel=EXACT)


@pytest.mark.slow
@settings(max_examples=25)
@CASES
def test_known_means(seed, n):
    """Clouds made by (G exp(S_i / 2) Q_i)^-1, S_i of sum 0, have the MDT G: T stands on the left, T^-1 A_i.

    Karcher's equation at G G^T is sum S_i = 0, and Dist_F(exp(S / 2)) is half the norm of S. Diagonal maps
    have the geometric mean.
    """
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(20, n))
    S = 0.2 * rng.normal(size=(6, n, n))
    S += np.swapaxes(S, 1, 2)
    S -= S.mean(axis=0)
    Q = np.array([scipy.linalg.polar(one)[0] for one in maps(rng, n, 6)[0]])
    A = maps(rng, n, 1)[0] @ scipy.linalg.expm(S / 2) @ Q
    found = register((np.linalg.inv(A) @ z.T).swapaxes(1, 2))
    np.testing.assert_allclose(found.distortions, np.linalg.norm(S, axis=(1, 2)) / 2, rtol=1e-8)
    assert found.mdt_sum == pytest.approx(np.sum(S * S) / 4, rel=1e-8)
    d = np.exp(0.5 * rng.normal(size=(6, n)))
    found = register(z / d[:, None])
    expected = (d / np.exp(np.log(d).mean(axis=0)))[:, None] * np.eye(n)
    np.testing.assert_allclose(found.matrices, expected, atol=EXACT)


@pytest.mark.slow
@CASES
def test_two_clouds_are_a_pair(seed, n):
    """Of two clouds the fit is the symmetric fit of one onto the other."""
    clouds, _ = made(np.random.default_rng(seed), n, 2, noise=0.3)
    np.testing.assert_allclose(
        register(clouds, frame="first").matrices[1], affine_fit(*clouds[::-1]).matrix, atol=EXACT
    )


@pytest.mark.slow
@CASES
def test_self_consistent(seed, n):
    """Each cloud lies by its symmetric fit onto the mean of all, also where points are missing."""
    rng = np.random.default_rng(seed)
    clouds, _ = made(rng, n, 6, 60, noise=0.1)
    clouds[rng.uniform(size=clouds.shape[:2]) < 0.3] = np.nan
    seen = ~np.isnan(clouds[..., 0])
    group = consensus(clouds, 1.0 * seen)
    assert group.settled
    places = moved(clouds, group.A, group.shift)
    shared = seen.sum(axis=0) > 1
    mean = np.nanmean(places[:, shared], axis=0)
    fits = [affine_fit(y[shared][t[shared]], mean[t[shared]]).matrix for y, t in zip(clouds, seen, strict=True)]
    # The mean of noisy points is narrower than they are: all fits onto it shrink by one map.
    shrunk = np.array([fit @ np.linalg.inv(A) for fit, A in zip(fits, group.A, strict=True)])
    np.testing.assert_allclose(shrunk, np.broadcast_to(shrunk[0], shrunk.shape), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3])
def test_chains(n):
    """Ten clouds in a row, each of which shares ten points with the next, are found exactly; noise settles, too."""
    rng = np.random.default_rng(n)
    clouds, B = made(rng, n, 10, 110)
    found = register(chained(clouds, 10), frame="first")
    np.testing.assert_allclose(found.matrices, B[0] @ np.linalg.inv(B), atol=1e-9)
    noisy, _ = made(rng, n, 10, 110, noise=0.05)
    assert register(chained(noisy, 10)).settled


def test_points_of_one_cloud_move_along():
    """Points that are in one cloud alone do not count, and are moved."""
    rng = np.random.default_rng(3)
    clouds, B = made(rng, 2, 3, 20)
    clouds[1:, :5] = np.nan
    found = register(clouds, frame="last")
    assert found.used.tolist() == [15, 15, 15]
    np.testing.assert_allclose(found.matrices[0], B[2] @ np.linalg.inv(B[0]), atol=EXACT)
    assert np.isfinite(found.aligned[0]).all()


def test_ids():
    """Points with equal ids are the same, in whatever rows they stand."""
    rng = np.random.default_rng(4)
    clouds, _ = made(rng, 3, 3, 12, noise=0.1)
    ids = [f"p{k}" for k in range(12)]
    orders = [rng.permutation(12)[:10] for _ in clouds]
    found = register(
        [cloud[order] for cloud, order in zip(clouds, orders, strict=True)],
        correspond="id",
        ids=[[ids[k] for k in order] for order in orders],
    )
    gaps = np.full_like(clouds, np.nan)
    for gap, cloud, order in zip(gaps, clouds, orders, strict=True):
        gap[order] = cloud[order]
    np.testing.assert_allclose(found.matrices, register(gaps).matrices, atol=EXACT)


@pytest.mark.slow
@CASES
def test_mean_orientation_and_place(seed, n):
    """In the frame of the MDT the clouds lie about where they lay, and turned on average as they were."""
    clouds, _ = made(np.random.default_rng(seed), n, noise=0.1)
    found = register(clouds)
    np.testing.assert_allclose(np.mean(found.aligned, axis=(0, 1)), clouds.mean(axis=(0, 1)), atol=1e-9)
    mean = np.mean([scipy.linalg.polar(M)[0] for M in found.matrices], axis=0)
    np.testing.assert_allclose(mean, mean.T, atol=EXACT)


# ---- what goes wrong ------------------------------------------------------------------------


def test_shrinkage_is_said():
    """Least squares onto the first cloud shrinks the others, by their correlations, and that is said."""
    clouds, _ = made(np.random.default_rng(6), 3, 6, 40, noise=0.4)
    found = register(clouds, method="least_squares", frame="first")
    volumes = [np.linalg.slogdet(np.cov(cloud, rowvar=False))[1] / 2 for cloud in found.aligned]
    np.testing.assert_allclose(found.shrinkage, np.array(volumes) - volumes[0], atol=EXACT)
    assert found.shrinkage[1:].max() < -0.1
    assert any(text.startswith("Least squares shrinks the clouds, on average to ") for text in found.warnings)
    symmetric = register(clouds)
    np.testing.assert_array_equal(symmetric.shrinkage, 0.0)
    volumes = [np.linalg.slogdet(np.cov(cloud, rowvar=False))[1] / 2 for cloud in symmetric.aligned]
    np.testing.assert_allclose(volumes, volumes[0], atol=EXACT)
    assert symmetric.warnings == []


@pytest.mark.slow
def test_mirror_images():
    """A cloud that is a mirror image of most is named, and registered; all mirrored together are not."""
    clouds, _ = made(np.random.default_rng(7), 3)
    clouds[3, :, 0] *= -1
    found = register(clouds, names=list("abcde"))
    assert found.warnings == ["Mirror images of the others: d."]
    assert found.mirrored.tolist() == [False, False, False, True, False]
    assert np.sign(np.linalg.det(found.matrices)).tolist() == [1, 1, 1, -1, 1]
    assert found.rms_total < 1e-9
    clouds[[0, 1, 2, 4], :, 0] *= -1
    assert register(clouds).warnings == []


def test_uncertain_and_nearly_singular():
    """A cloud whose thickness is noise, and one that is much flatter than the others, are named."""
    rng = np.random.default_rng(8)
    clouds, _ = made(rng, 3, noise=0.05)
    clouds[1] = rng.normal(size=(30, 3)) * 0.1 + clouds[1] @ np.diag([1, 1, 0])
    clouds[4] = clouds[4] @ np.diag([1, 1, 1e-5])
    warnings = register(clouds, names=list("abcde")).warnings
    assert "Nearly singular beside the others: e." in warnings
    assert next(text for text in warnings if text.startswith("Uncertain")).endswith(": b.")


def test_no_mean_orientation():
    """Clouds that face all ways have no mean orientation, and that is said."""
    z = np.random.default_rng(9).normal(size=(20, 2))
    t = np.radians([0, 90, 180, 270])
    turns = np.moveaxis(np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]), -1, 0)
    (warning,) = register(z @ turns).warnings
    assert warning.startswith("There is no meaningful mean orientation")


def test_left_out():
    """Clouds with too few points, points in a plane, or none in common are named, and the others go on."""
    clouds, B = made(np.random.default_rng(10), 3, 6, 40)
    clouds[0, 3:] = np.nan
    clouds[2] = np.where(np.isnan(clouds[2]), np.nan, clouds[2] @ np.diag([1, 1, 0]))
    clouds[4, :38] = np.nan
    clouds[5, ::2] = np.nan
    found = register(clouds, names=list("abcdef"), frame="f")
    assert found.names == ("b", "d", "f")
    assert [tuple(one) for one in found.left_out] == [
        ("a", "it has 3 points, and 4 are needed"),
        ("c", "the 40 points that it has span 2 of 3 dimensions"),
        ("e", "it has 2 points, and 4 are needed"),
    ]
    np.testing.assert_allclose(found.matrices[0], B[5] @ np.linalg.inv(B[1]), atol=EXACT)
    with pytest.raises(ValueError, match=r"^Invalid frame 'c'\. That cloud is left out: the 40 points"):
        register(clouds, names=list("abcdef"), frame="c")
    apart = np.full((3, 20, 2), np.nan)
    apart[:2, :12], apart[2, 10:] = (
        made(np.random.default_rng(1), 2, 2, 12)[0],
        np.random.default_rng(2).normal(size=(10, 2)),
    )
    assert register(apart).left_out == (("2", "it shares with the others 2 points, and 3 are needed"),)


def test_too_little():
    """Where no two clouds share enough, each is named with its reason."""
    with pytest.raises(
        ValueError, match=r"^Invalid clouds\. Fewer than two share points enough; '1': it has 2 points, an"
    ):
        register([np.random.default_rng(1).normal(size=(5, 2)), [[0, 0], [1, 1]] + [[np.nan] * 2] * 3])


def test_arguments_are_checked():
    """Each wrong argument is one line that says what is allowed."""
    a = np.random.default_rng(1).normal(size=(6, 2))
    for match, words in {
        r"^Invalid clouds\. There must be at least two; there is one\.$": {"clouds": [a]},
        r"^Invalid clouds\. There must be at least two; there are none\.$": {"clouds": []},
        r"^Invalid cloud '1' of shape \(6,\)\. It must be \(M, n\)": {"clouds": [a, a[:, 0]]},
        r"^Invalid cloud '1'\. It has 1 coordinates a point, '0' 2\.$": {"clouds": [a, a[:, :1]]},
        r"^Invalid cloud '1'\. It has 5 points, '0' 6; rows that correspond must be as many": {"clouds": [a, a[1:]]},
        r"^Invalid cloud '1'\. Point 1 must be finite, or all NaN\.$": {"clouds": [a, a * np.inf]},
        r"^Invalid method 'ols'\. It must be symmetric or least_squares\.$": {"method": "ols"},
        r"^Invalid correspondence 'row'\. It must be rows, id or icp\.$": {"correspond": "row"},
        r"^Invalid frame 'z'\. It must be first, last, central, best, mdt or a cloud by its name": {"frame": "z"},
        r"^Invalid frame '2'\. ": {"frame": 2},
        r"^Invalid ids\. There must be a list of them for each cloud\.$": {"correspond": "id"},
        r"^Invalid ids of cloud '0'\. They are 1; its points are 6\.$": {"correspond": "id", "ids": ["a", "b"]},
        r"^Invalid cloud '0'\. It has two points with the id 'a'\.$": {"correspond": "id", "ids": ["aabcde"] * 2},
        r"^Invalid names\. There must be 2, one a cloud; there are 1\.$": {"names": ["a"]},
    }.items():
        with pytest.raises(ValueError, match=match):
            register(**({"clouds": [a, a]} | words))
    with pytest.raises(ValueError, match=r"^Invalid shapes \(6, 2\) and \(5, 2\) of points\. Both must be \(M, n\)\.$"):
        affine_fit(a, a[1:])
    with pytest.raises(ValueError, match=r"^Invalid points\. They must span 2 dimensions, and span 1\.$"):
        affine_fit(a, a[:, :1] * [1, 2])
    with pytest.raises(ValueError, match=r"^Invalid points\. They must be finite\.$"):
        affine_fit(a, a * np.nan)


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


# ---- closest points -------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 3, 5])
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


@pytest.mark.parametrize("n", [1, 2, 3])
def test_false_alarms(n):
    """They are those of the definition, counted in whole numbers, and at random there are hardly any."""
    rng = np.random.default_rng(n)
    points = rng.uniform(size=(40, n))
    apart = icp._spacing(points)
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    assert apart == pytest.approx(np.median(np.sort(distances)[:, 1]), rel=1e-12)
    assert icp._spacing(np.repeat(points, 3, axis=0)) == pytest.approx(apart, rel=1e-12)
    near = np.sort(rng.uniform(size=40)) ** 2 * apart
    alarms = [
        (39 - n) * math.comb(40, k) * (1 - 2 ** -((near[k - 1] / apart) ** n)) ** (k - n - 1) for k in range(n + 2, 41)
    ]
    assert log_false_alarms(rng.permutation(near), apart, n) == pytest.approx(math.log(min(alarms)), rel=1e-12)
    assert log_false_alarms(near[: n + 1], apart, n) == math.inf
    # In many dimensions volumes are small and great beyond what a float holds.
    assert log_false_alarms(np.full(203, 1e-9), 1.0, 200) < -700.0
    assert log_false_alarms(np.full(203, 1e9), 1.0, 200) == pytest.approx(math.log(2), rel=1e-12)
    by_chance = []
    for _ in range(300):
        cloud, other = rng.uniform(size=(2, 40, n))
        by_chance.append(
            log_false_alarms(np.linalg.norm(cloud[:, None] - other, axis=2).min(axis=0), icp._spacing(other), n)
        )
    # Less than a false alarm in a hundred, on average, is to be met in about three of 300.
    assert np.sum(np.array(by_chance) < np.log(0.01)) <= 10


def test_icp_of_what_is_flat():
    """A flat cloud is left out with its reason; where all are flat there is nothing to register."""
    rng = np.random.default_rng(2)
    z = rng.normal(size=(30, 3))
    found = register([z, z[::-1], z * [1, 1, 0]], correspond="icp")
    assert [one.name for one in found.left_out] == ["2"]
    with pytest.raises(ValueError, match=r"^Invalid clouds\. Fewer than two share points enough; "):
        register([z * [1, 1, 0]] * 2, correspond="icp")


def test_partners_are_mutual_and_near():
    """Of two points that are near one of the other cloud the nearer has it, and what is far off has nobody."""
    cloud = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [500.0, 0.0]])
    template = np.array([[0.1, 0.0], [0.3, 0.0], [10.2, 0.0], [20.1, 0.0], [90.0, 0.0]])
    assert icp._partners(cloud, template).tolist() == [0, -1, 1, 2, -1]


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


def test_turns_in_space():
    """From any rotation the next is hardly farther than 1000 can let it be: 11.4 degrees on average.

    A ball of the angle a has (a - sin a) / pi of all rotations: 1 of 1000 for 15.3 degrees, of which the mean is 3/4.
    """
    turns = icp._turns(3)
    np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0, rtol=1e-12)
    any_turn = Rotation.random(2000, np.random.default_rng(1)).as_matrix()
    cosines = (np.einsum("aij,bij->ab", any_turn, turns).max(axis=1) - 1.0) / 2.0
    away = np.degrees(np.arccos(np.minimum(cosines, 1.0)))
    assert (away.mean() < 1.05 * 11.4, away.max() < 1.5 * 15.3) == (True, True)


# ---- weights ----------------------------------------------------------------------------------


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
    assert group.settled
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
        with pytest.raises(ValueError, match=match):
            register([a, a + 1.0], weights=weights)
    with pytest.raises(ValueError, match=r"^Invalid weights\. They must not all be 0\.$"):
        affine_fit(a, a, weights=np.zeros(6))


# ---- wrong partners ---------------------------------------------------------------------------


def noisy_clouds(rng, count, size, n, noise):
    """Affine images of one cloud with normal errors of their own, and the matrices."""
    base = rng.normal(size=(size, n))
    A = np.eye(n) + 0.3 * rng.normal(size=(count, n, n))
    return [(base + noise * rng.normal(size=base.shape)) @ one.T for one in A]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "size", "n", "noise"), [(2, 15, 2, 0.02), (3, 20, 3, 0.1), (2, 12, 2, 1e-12), (2, 15, 2, 0.0)]
)
def test_right_partners_are_seldom_named(count, size, n, noise):
    """Of clouds without wrong partners 5 % have a point named, whatever the noise; where there is none, hardly any."""
    rng = np.random.default_rng(8)
    sets, named = 200, 0
    for _ in range(sets):
        named += bool(register(noisy_clouds(rng, count, size, n, noise)).wrong)
    # The chance of more than 10 + 3.5 sqrt(9.5) of 200 at a rate of 5 % is 2 in 1000.
    assert named <= 21


@pytest.mark.parametrize("count", [2, 4])
def test_wrong_partners_are_named_and_left_out(count):
    """Exchanged rows are named, and no others; the robust fit is that without them."""
    rng = np.random.default_rng(3)
    clouds = noisy_clouds(rng, count, 40, 2, 0.01)
    exchanged = [4, 11, 17, 30]
    wrong = [cloud.copy() for cloud in clouds]
    wrong[1][exchanged] = wrong[1][np.roll(exchanged, 1)]
    told, robust = register(wrong), register(wrong, robust=True)
    for found in (told, robust):
        assert sorted(int(one.point) for one in found.wrong) == [5, 12, 18, 31]
        assert count == 2 or {one.cloud for one in found.wrong} == {"1"}
    assert "Wrong partners, which a robust fit leaves out" in told.warnings[0]
    assert robust.warnings[0].startswith("Left out as wrong partners (with a chance of 5 %")
    # Distances are those by the fit without the point, which the wrong ones do not draw to themselves.
    assert min(one.distance for one in robust.wrong) > 0.3
    assert {one.point for one in robust.worst[1][:4]} == {"5", "12", "18", "31"}
    without = [cloud.copy() for cloud in wrong]
    for one in robust.wrong:
        without[int(one.cloud)][int(one.point) - 1] = np.nan
    np.testing.assert_allclose(robust.matrices, register(without).matrices, atol=1e-12)
    assert robust.rms_total < 0.02 < told.rms_total
    assert robust.to_dict()["robust"] is True


def test_wrong_ids():
    """Points are named by their ids; a third of wrong ones is still found."""
    rng = np.random.default_rng(4)
    first, second = noisy_clouds(rng, 2, 30, 2, 0.01)
    ids = [f"p{k}" for k in range(30)]
    mixed = list(ids)
    mixed[:10] = [*ids[1:10], ids[0]]
    found = register([first, second], correspond="id", ids=[ids, mixed], robust=True)
    assert {one.point for one in found.wrong} == set(ids[:10])
    with pytest.raises(ValueError, match=r"^Invalid robust with the correspondence icp\."):
        register([first, second], correspond="icp", robust=True)
    with pytest.raises(ValueError, match=r"^Invalid robust '1'\. It must be True or False\."):
        register([first, second], robust=1)


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
