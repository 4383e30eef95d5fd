"""The rotation and the shift that follow the mean distorting transformation."""

import json

import numpy as np
import pytest
import scipy.linalg
from matrix_samples import CASES, MIRROR, rotation
from refusals import refuses
from scipy.spatial.transform import Rotation
from tables import each

from projdist.matrices.mean_transformation import mdt
from projdist.matrices.rotations import ROTATIONS, Affine, axes_shift, mean_rotation
from projdist.matrices.spd import lq


def turns(degrees):
    """Rotations of the plane."""
    return rotation(np.radians(degrees))


def angle(q):
    """Of a rotation of the plane, in degrees."""
    return np.degrees(np.arctan2(q[..., 1, 0], q[..., 0, 0]))


def random_orthogonal(rng, n, det):
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    Q[:, 0] *= det * np.sign(np.linalg.det(Q))
    return Q


def random_matrices(rng, n, count=8):
    """Matrices of positive determinant that turn little, so that no mean of theirs is in doubt."""
    return scipy.linalg.expm(0.4 / np.sqrt(n) * rng.normal(size=(count, n, n)))


def corrected(A, w=None, *, T=None, method="chordal"):
    """q T^-1 A_i."""
    return mean_rotation(A, w, T=T, method=method).q @ np.linalg.solve(mdt(A, w).T if T is None else T, A)


@each("method", ROTATIONS)
def test_mean_angle_and_reflection(method):
    """170, -170 and 175 degrees have the mean 178.3, not 58.3: no branch of the logarithm shows."""
    found = mean_rotation(turns([170.0, -170.0, 175.0]), T=np.eye(2), method=method)
    assert -angle(found.q) % 360 == pytest.approx({"log": 178 + 1 / 3, "chordal": 178.3}[method], abs=0.05)
    # Matrices that all mirror turn like those they are mirrored from, and it is said that they mirror.
    R = turns([20.0, 30.0, 70.0])
    plain, mirrored = (mean_rotation(A, T=np.eye(2), method=method) for A in (R, R @ MIRROR))
    assert (plain.reflection, mirrored.reflection) == (False, True)
    np.testing.assert_allclose(mirrored.q, plain.q, atol=1e-14)
    np.testing.assert_allclose(plain.q, turns([-40.0])[0], atol=0.02)


@pytest.mark.slow
@CASES
def test_it_is_a_rotation_that_leaves_no_mean_orientation(seed, n):
    """q is orthogonal of determinant 1, stands outside, and leaves each Dist_F as it is."""
    rng = np.random.default_rng(seed)
    A, w = random_matrices(rng, n), rng.uniform(size=8)
    found = mdt(A, w)
    for method in ROTATIONS:
        q = mean_rotation(A, w, method=method).q
        np.testing.assert_allclose(q @ q.T, np.eye(n), atol=1e-14)
        assert np.linalg.det(q) == pytest.approx(1.0, rel=1e-13)
        scales = np.linalg.svd(corrected(A, w, method=method), compute_uv=False)
        np.testing.assert_allclose(np.sum(np.log(scales) ** 2, axis=-1), found.distances, rtol=1e-9, atol=1e-12)
    # The polar factors of q T^-1 A_i have the chordal mean 1, the nearest rotation to their arithmetic mean.
    again = mean_rotation(corrected(A, w), w, T=np.eye(n))
    np.testing.assert_allclose(again.q, np.eye(n), atol=1e-13)
    polar = [scipy.linalg.polar(B)[0] for B in corrected(A, w)]
    mean = np.average(polar, axis=0, weights=w)
    np.testing.assert_allclose(mean, mean.T, atol=1e-13)
    assert again.mean_resultant_length == pytest.approx(np.trace(mean) / n, rel=1e-12)
    # It is exp of minus the mean of ln q_i, the LQ factors of T^-1 A_i, here by scipy's logm and expm.
    Q = lq(np.linalg.solve(mdt(A, w).T, A))[1]
    mean = np.average([scipy.linalg.logm(q).real for q in Q], axis=0, weights=w)
    np.testing.assert_allclose(mean_rotation(A, w, method="log").q, scipy.linalg.expm(-mean), atol=1e-11)


@pytest.mark.slow
@CASES
def test_the_chordal_mean_is_gauge_invariant(seed, n):
    """q T^-1 A_i is the same, to 5e-15, for every T Q in place of T, and in whatever axes the A_i are written."""
    rng = np.random.default_rng(seed)
    A, T = random_matrices(rng, n), np.tril(0.3 * rng.normal(size=(n, n)), -1) + np.eye(n)
    Q, axes = random_orthogonal(rng, n, 1), random_orthogonal(rng, n, 1)
    expected = corrected(A, T=T)
    np.testing.assert_allclose(corrected(A, T=T @ Q), expected, atol=5e-15 * np.linalg.cond(T))
    np.testing.assert_allclose(corrected(axes @ A, T=axes @ T), expected, atol=5e-15 * np.linalg.cond(T))
    np.testing.assert_allclose(corrected(axes @ A), corrected(A), atol=1e-12)


def test_the_logarithmic_mean_of_angles():
    """The source paper's correction, by the LQ factors, changes with the axes."""
    rng = np.random.default_rng(4)
    A, axes = random_matrices(rng, 2), turns([60.0])[0]
    assert np.abs(corrected(axes @ A, method="log") - corrected(A, method="log")).max() > 1e-3
    # Once 90 degrees and twice none: the logarithms' mean is 30, that of the matrices atan(1 / 2).
    for method, mean in (("log", 30.0), ("chordal", np.degrees(np.arctan(0.5)))):
        q = mean_rotation(turns([0.0, 90.0]), [2.0, 1.0], T=np.eye(2), method=method).q
        assert angle(q) == pytest.approx(-mean, abs=1e-11)  # the correction turns back


def test_means_in_space():
    """The chordal mean is scipy's mean of rotations; exp of the mean logarithm is degrees off: why it is no default."""
    rng = np.random.default_rng(1)
    rotations, w = Rotation.from_rotvec(rng.normal(size=(20, 3))), rng.uniform(size=20)
    off = {}
    for method in ROTATIONS:
        q = mean_rotation(rotations.as_matrix(), w, T=np.eye(3), method=method).q
        off[method] = np.degrees((Rotation.from_matrix(q) * rotations.mean(w)).magnitude())
    assert off["chordal"] < 1e-10
    assert off["log"] > 1.0


def test_resultant_length():
    """Four orientations at right angles cancel out, and that is said; equal ones do not."""
    none = mean_rotation(turns([0.0, 90.0, 180.0, 270.0]), T=np.eye(2))
    assert none.mean_resultant_length == pytest.approx(0.0, abs=1e-12)
    assert none.note.startswith("There is no meaningful mean orientation: the mean resultant length is ")
    equal = mean_rotation(turns([40.0, 40.0]))
    np.testing.assert_allclose(json.loads(equal.to_json())["q"], turns([-40.0])[0], atol=1e-12)
    assert equal.mean_resultant_length == pytest.approx(1.0, abs=1e-12)
    assert equal.note == ""
    # Directional statistics (Mardia & Jupp 2000, equation 2.2.8): |sum of e^it| / N.
    degrees = np.array([10.0, 50.0, 170.0])
    found = mean_rotation(turns(degrees), T=np.eye(2)).mean_resultant_length
    assert found == pytest.approx(abs(np.mean(np.exp(1j * np.radians(degrees)))), rel=1e-12)
    # Their mean is -1/3 of the identity, which mirrors: no rotation has more in common with them than 1/9.
    matrices = np.array([np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0]), np.diag([-1.0, -1.0, 1.0])])
    found = mean_rotation(matrices)
    assert found.mean_resultant_length == pytest.approx(1.0 / 9.0, abs=1e-12)
    assert np.linalg.det(found.q) == pytest.approx(1.0)
    assert np.mean([np.trace(found.q @ turn) / 3.0 for turn in matrices]) == pytest.approx(1.0 / 9.0, abs=1e-12)
    pytest.importorskip("pandas")
    assert equal.to_frame()["mean_resultant_length"][0] == pytest.approx(1.0)


def test_mixed_orientations():
    """Where some mirror and others do not, the fewer are named, in sets of sets with all their indices."""
    for signs, said in (
        ([1, 1, -1, 1], "2: it mirrors"),
        ([-1, -1, 1, -1, 1], "2, 4: it does not mirror"),
        ([-1] * 11 + [1] * 15, r"0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 1 more: it mirrors"),
    ):
        A = np.stack([np.diag([1.0, sign]) for sign in signs])
        refuses(rf"^Invalid orientation at index {said}, the others differ\. All must agree\.$", mean_rotation, A)
    A = np.broadcast_to(np.eye(2), (2, 3, 2, 2)).copy()
    A[1] = MIRROR
    np.testing.assert_array_equal(mean_rotation(A).reflection, [False, True])  # sets may differ
    A[0, 2] = MIRROR
    refuses(r"^Invalid orientation at index \(0, 2\): it mirrors", mean_rotation, A)


def test_arguments_are_checked():
    """Unknown methods, a T of another shape, what is singular, and half turns in space, which have two logarithms."""
    A = np.stack([np.eye(2), np.eye(2)])
    refuses(r"^Invalid method 'mean'\. It must be one of chordal, log\.$", mean_rotation, A, method="mean")
    refuses(r"^Invalid shape \(3, 3\) of T\. It must be \(2, 2\)\.$", mean_rotation, A, T=np.eye(3))
    refuses(r"^Invalid T\. It must be finite and invertible\.$", mean_rotation, A, T=np.ones((2, 2)))
    for wrong in (0.0, np.nan):
        A = np.stack([np.eye(2), np.diag([1.0, wrong])])
        refuses(r"^Invalid matrix at index 1\. It must be finite and invertible\.$", mean_rotation, A, T=np.eye(2))
    A = np.stack([np.eye(3), np.diag([-1.0, -1.0, 1.0])])
    match = r"^Invalid rotation at index 1\. It must be less than 180 degrees for 'log'; try 'chordal'\.$"
    refuses(match, mean_rotation, A, T=np.eye(3), method="log")
    mean_rotation(A, [2, 1], T=np.eye(3))


@each("method", ROTATIONS)
@each("n", [2, 3])
def test_leading_axes(method, n):
    """Sets of matrices on leading axes have each its own rotation."""
    A = random_matrices(np.random.default_rng(n), n, 24).reshape(2, 3, 4, n, n)
    found = mean_rotation(A, method=method)
    assert found.q.shape == (2, 3, n, n)
    assert found.reflection.shape == found.mean_resultant_length.shape == (2, 3)
    np.testing.assert_allclose(found.q[1, 2], mean_rotation(A[1, 2], method=method).q, atol=1e-12)


def test_shifts():
    """The shift brings the least of each coordinate to zero, for each set of points."""
    points = np.array([[[1.0, 5.0], [3.0, -2.0]], [[0.0, 0.0], [-1.0, 7.0]]])
    np.testing.assert_array_equal(axes_shift(points[0]), [-1.0, 2.0])
    np.testing.assert_array_equal((points + axes_shift(points)[:, None]).min(axis=1), np.zeros((2, 2)))
    refuses(r"^Invalid shape \(0, 2\) of points\. It must be \(\.\.\., M, n\)", axes_shift, np.ones((0, 2)))
    refuses(r"^Invalid point at index 1\. It must be finite\.$", axes_shift, [[0.0, 0.0], [np.nan, 1.0]])
    # The map of p is matrix p + shift, by hand.
    there = Affine(np.array([[2.0, 1.0], [0.0, 4.0]]), np.array([1.0, -3.0]))
    np.testing.assert_array_equal(there(np.array([[3.0, 5.0], [0.0, 0.0]])), [[12.0, 17.0], [1.0, -3.0]])
