"""What is said of clouds: shrinkage, mirror images, flat ones, those left out, and wrong arguments."""

import numpy as np
import pytest
from cloud_sets import EXACT, made, moved
from matrix_samples import rotation
from refusals import refuses
from tables import each

from projdist.applications.pointclouds import affine_fit, register
from projdist.applications.pointclouds.affine import consensus

KINDS = r"It must be one of rows, id, icp\.$"
PER_ROW = "There must be one for each row, or 2 arrays, one per cloud"


@pytest.mark.slow
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


@pytest.mark.slow
def test_notes():
    """A cloud whose thickness is noise, and one that is much flatter than the others, are named."""
    rng = np.random.default_rng(8)
    clouds, _ = made(rng, 3, noise=0.05)
    clouds[1] = rng.normal(size=(30, 3)) * 0.1 + clouds[1] @ np.diag([1, 1, 0])
    clouds[4] = clouds[4] @ np.diag([1, 1, 1e-5])
    warnings = register(clouds, names=list("abcde")).warnings
    assert "Nearly singular beside the others: e." in warnings
    assert next(text for text in warnings if text.startswith("Uncertain")).endswith(": b.")
    # Clouds that face all ways have no mean orientation, and that is said.
    z = np.random.default_rng(9).normal(size=(20, 2))
    (warning,) = register(z @ rotation(np.radians([0, 90, 180, 270]))).warnings
    assert warning.startswith("There is no meaningful mean orientation")


@pytest.mark.slow
def test_left_out():
    """Clouds with too few points, points in a plane, or none in common are named, and the others go on."""
    clouds, B = made(np.random.default_rng(10), 3, 6, 40)
    clouds[0, 3:] = np.nan
    clouds[2] = clouds[2] @ np.diag([1, 1, 0])
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
    told = r"^Invalid frame 'c'\. That cloud is left out: the 40 points"
    refuses(told, register, clouds, names=list("abcdef"), frame="c")
    apart = np.full((3, 20, 2), np.nan)
    apart[:2, :12] = made(np.random.default_rng(1), 2, 2, 12)[0]
    apart[2, 10:] = np.random.default_rng(2).normal(size=(10, 2))
    assert register(apart).left_out == (("2", "it shares with the others 2 points, and 3 are needed"),)
    # Where no two clouds share enough, each is named with its reason.
    two = [np.random.default_rng(1).normal(size=(5, 2)), [[0, 0], [1, 1]] + [[np.nan] * 2] * 3]
    refuses(r"^Invalid clouds\. Fewer than two share points enough; '1': it has 2 points, an", register, two)


def test_arguments_are_checked():
    """Each wrong argument is one line that says what is allowed."""
    a = np.random.default_rng(1).normal(size=(6, 2))
    for match, words in {
        r"^Invalid clouds\. There must be at least two; there is one\.$": {"clouds": [a]},
        r"^Invalid clouds\. There must be at least two; there are none\.$": {"clouds": []},
        r"^Invalid cloud '1' of shape \(6,\)\. It must be \(M, n\)": {"clouds": [a, a[:, 0]]},
        r"^Invalid cloud '1'\. It has 1 coordinates a point, '0' 2\.$": {"clouds": [a, a[:, :1]]},
        r"^Invalid cloud '1'\. It has 5 points, '0' 6; rows that correspond must be as many": {"clouds": [a, a[1:]]},
        r"^Invalid cloud '1'\. Point 2 must lie within 1e\+50\.$": {"clouds": [a, a + 1e60 * np.eye(6, 2, -1)]},
        r"^Invalid cloud '1'\. Point 1 must be finite, or all NaN\.$": {"clouds": [a, a * np.inf]},
        r"^Invalid method 'ols'\. It must be one of symmetric, least_squares\.$": {"method": "ols"},
        rf"^Invalid correspondence 'row'\. Did you mean rows\? {KINDS}": {"correspond": "row"},
        r"^Invalid frame 'z'\. It must be first, last, central, best, mdt or a cloud by its name": {"frame": "z"},
        r"^Invalid frame '2'\. ": {"frame": 2},
        r"^Invalid ids\. There must be a list of them for each cloud\.$": {"correspond": "id"},
        r"^Invalid ids of cloud '0'\. They are 1; its points are 6\.$": {"correspond": "id", "ids": ["a", "b"]},
        r"^Invalid cloud '0'\. It has two points with the id 'a'\.$": {"correspond": "id", "ids": ["aabcde"] * 2},
        r"^Invalid names\. There must be 2, one per cloud; there are 1\.$": {"names": ["a"]},
    }.items():
        refuses(match, register, **{"clouds": [a, a]} | words)
    refuses(r"^Invalid shapes \(6, 2\) and \(5, 2\) of points\. Both must be \(M, n\)\.$", affine_fit, a, a[1:])
    refuses(r"^Invalid points\. They must span 2 dimensions, and span 1\.$", affine_fit, a, a[:, :1] * [1, 2])
    refuses(r"^Invalid points\. They must be finite\.$", affine_fit, a, a * np.nan)
    one = "Invalid weights of cloud '0'"
    for match, weights in {
        rf"^{one}\. That of point 2 is -1; it must be finite and not negative\.$": [1, -1, 1, 1, 1, 1],
        rf"^{one}\. That of point 1 is nan; ": [np.nan, 1, 1, 1, 1, 1],
        rf"^{one}\. That of point 1 is inf; ": [np.inf, 1, 1, 1, 1, 1],
        rf"^{one}\. They must not all be 0\.$": np.zeros(6),
        r"^Invalid weights of cloud '1'\. They must not all be 0\.$": [np.ones(6), np.zeros(6)],
        rf"^{one}\. There must be 6, one per point; their shape is \(5,\)\.$": np.ones(5),
        rf"^{one}\. There must be 6, one per point; their shape is \(1,\)\.$": 3.0,
        rf"^{one}\. They must be numbers\.$": "abcdef",
        rf"^Invalid weights\. {PER_ROW}; there are 3 arrays\.$": np.ones((3, 6)),
    }.items():
        refuses(match, register, [a, a + 1.0], weights=weights)
    refuses(r"^Invalid weights\. They must not all be 0\.$", affine_fit, a, a, weights=np.zeros(6))


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
    named = sum(bool(register(noisy_clouds(rng, count, size, n, noise)).wrong) for _ in range(60))
    # The chance of more than 3 + 3 sqrt(2.85) of 60 at a rate of 5 % is 3 in 1000.
    assert named <= 8


@pytest.mark.slow
@each("count", [2, 3])
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
    mixed = [*ids[1:10], ids[0], *ids[10:]]
    found = register([first, second], correspond="id", ids=[ids, mixed], robust=True)
    assert {one.point for one in found.wrong} == set(ids[:10])
    refuses(r"^Invalid robust with the correspondence icp\.", register, [first, second], correspond="icp", robust=True)
    refuses(r"^Invalid robust '1'\. It must be True or False\.", register, [first, second], robust=1)


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
    one = affine_fit(clouds[0], clouds[1], weights=counts, method=method)
    other = affine_fit(*(np.repeat(cloud, counts, axis=0) for cloud in clouds[:2]), method=method)
    np.testing.assert_allclose(one.matrix, other.matrix, atol=EXACT)
    np.testing.assert_allclose(one.shift, other.shift, atol=EXACT * np.abs(clouds[0]).max())


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
    """With weights of their own each cloud lies by its weighted fit onto the weighted mean, missing points or not."""
    rng = np.random.default_rng(7)
    clouds, _ = made(rng, 3, 6, 60, noise=0.1)
    weights = rng.uniform(0.1, 2.0, size=clouds.shape[:2]) * (rng.uniform(size=clouds.shape[:2]) < 0.8)
    clouds[weights == 0] = np.nan
    group = consensus(clouds, weights)
    assert group.converged
    places = np.nan_to_num(moved(clouds, group.A, group.shift))
    mean = np.average(places, axis=0, weights=np.tile(weights[..., None], 3))
    pairs = zip(clouds, weights, strict=True)
    fits = [affine_fit(y[w > 0], mean[w > 0], weights=w[w > 0]).matrix for y, w in pairs]
    # The mean of noisy points is narrower than they are: all fits onto it shrink by one map.
    shrunk = np.array([fit @ np.linalg.inv(A) for fit, A in zip(fits, group.A, strict=True)])
    np.testing.assert_allclose(shrunk, np.broadcast_to(shrunk[0], shrunk.shape), atol=1e-9)


def test_weights_of_closest_points():
    """Where closest points are the partners, fits are those of rows; rows of weight 0 find none."""
    rng = np.random.default_rng(1)
    z = rng.uniform(-1.0, 1.0, size=(60, 2))
    # Uniform errors: none is farther than four medians, as which it would be no partner.
    off = z + 0.002 * rng.uniform(-1.0, 1.0, size=z.shape)
    first, second = z, off @ (np.eye(2) + 0.05 * rng.normal(size=(2, 2))).T
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
        pair = [z + sigma * rng.normal(size=z.shape) for _ in range(2)]
        named += bool(register(pair, weights=sigma[:, 0] ** -2).wrong)
    # The chance of more than 21 of 200 at a rate of 5 % is 2 in 1000.
    assert 1 <= named <= 21
    z = rng.normal(size=(20, 2))
    first, second = (z + sigma * rng.normal(size=z.shape) for _ in range(2))
    second[2] += 0.1  # of errors of .005; no more than others have
    robust = register([first, second], weights=sigma[:, 0] ** -2, robust=True)
    assert {one.point for one in robust.wrong} == {"3"}
    assert "3" not in {one.point for one in register([first, second]).wrong}
