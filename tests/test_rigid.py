"""The rotation and the shift that follow the mean distorting transformation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from projdist.rigid import axes_shift, mean_rotation


def turns(degrees):
    """Rotations of the plane."""
    t = np.radians(degrees)
    return np.moveaxis(np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]), -1, 0)


@pytest.mark.parametrize("method", ["chordal", "log"])
def test_mean_angle(method):
    """Angles on both sides of 180 degrees have a mean between them."""
    found = mean_rotation(turns([170.0, -170.0, 175.0]), T=np.eye(2), method=method)
    angle = np.degrees(np.arctan2(found.q[1, 0], found.q[0, 0]))
    assert -angle % 360 == pytest.approx(178.3, abs=0.05)


def test_resultant_length():
    """Four orientations at right angles cancel out; equal ones do not."""
    none = mean_rotation(turns([0.0, 90.0, 180.0, 270.0]) @ np.diag([1.0, 1.0]), T=np.eye(2))
    assert none.mean_resultant_length == pytest.approx(0.0, abs=1e-12)
    assert none.note
    assert mean_rotation(turns([40.0, 40.0])).mean_resultant_length == pytest.approx(1.0, abs=1e-12)


def test_chordal_mean_in_space():
    """In space the chordal mean is scipy's mean of rotations (there by quaternions)."""
    rotations = Rotation.from_rotvec(np.random.default_rng(1).normal(scale=0.4, size=(20, 3)))
    found = mean_rotation(rotations.as_matrix(), T=np.eye(3))
    np.testing.assert_allclose(found.q.T, rotations.mean().as_matrix(), atol=1e-12)


def test_mixed_orientations():
    """Matrices of which some mirror have no mean orientation."""
    with pytest.raises(ValueError, match="Invalid orientation"):
        mean_rotation(np.array([np.eye(2), np.eye(2), np.diag([1.0, -1.0])]))


def test_shift():
    """The shift brings the least coordinates to zero."""
    np.testing.assert_array_equal(axes_shift([[1.0, 5.0], [3.0, -2.0]]), [-1.0, 2.0])
