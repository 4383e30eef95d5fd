"""Several old maps together: their fields over common ground, and the mean map of known ones."""

import numpy as np
import pytest

from projdist import Projection, mean_plane_map
from projdist.applications.oldmaps import ControlPoints, common_ground, old_map
from projdist.applications.oldmaps.rectifying import old_places

SPLINE = 5e-3  # of Jacobians, by interpolation between 17 x 17 points; 1e-3 in the middle, most at the rim

SLOPES = (0.4, 0.3j, -0.1 + 0.3j)


def conformal(slope, ground=(0.0, 1.0), change=((1.0, 0.0), (0.0, 1.0)), side=17):
    """A sheet of which exp(slope w) is the scale and turn at w = x + i y in truth; then a change of its plane."""
    x, y = np.stack(np.meshgrid(np.linspace(*ground, side), np.linspace(0.0, 1.0, side)), axis=-1).reshape(-1, 2).T
    z = (np.exp(slope * (x + 1j * y)) - 1.0) / slope
    old = np.stack([z.real, z.imag], axis=-1) @ np.array(change).T
    return old_map(ControlPoints(old, 1000.0 * np.stack([x, y], axis=-1)), smoothing=0.0)


@pytest.mark.slow
def test_the_way_back():
    """What the fit brings to a place is where that is on the old map; beyond folds there is nothing."""
    found = conformal(0.4)
    old = np.random.default_rng(1).uniform(0.1, 0.9, (50, 2))
    np.testing.assert_allclose(old_places(found, found.fit(old)), old, atol=1e-8)
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 11)] * 2), axis=-1).reshape(-1, 2).T
    folded = old_map(ControlPoints(np.stack([x, y], -1), np.stack([x, y - 0.625 * y * y], -1)), model="polynomial2")
    assert np.isnan(old_places(folded, np.array([[0.5, 0.5]]))).all()


@pytest.mark.slow
def test_the_mean_of_conformal_maps():
    """It has the geometric mean of their scales, and the mean of their turns: exp of the mean slope."""
    ground = common_ground([conformal(slope) for slope in SLOPES])
    mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=5)
    J = mean.jacobian(ground.x, ground.y)
    w = (ground.x + 1j * ground.y) / 1000.0
    slopes = 0.5 * (J[:, 0, 0] + J[:, 1, 1] + 1j * (J[:, 1, 0] - J[:, 0, 1]))
    ratio = slopes / np.exp(np.mean(SLOPES) * w)
    inside = (np.abs(w.real - 0.5) < 0.4) & (np.abs(w.imag - 0.5) < 0.4)
    np.testing.assert_allclose(ratio[inside] / ratio[inside].mean(), 1.0, atol=SPLINE)
    np.testing.assert_allclose(J[inside], np.conj(J[inside, ::-1, ::-1]) * [[1, -1], [-1, 1]], atol=2.0 * SPLINE)


@pytest.mark.slow
def test_units_and_axes_do_not_count():
    """A mirrored, stretched and turned copy of a sheet has the same field: the mean is the sheet's own."""
    plain, other = conformal(0.4), conformal(0.4, change=((30.0, -80.0), (-50.0, -20.0)))
    ground = common_ground([plain, other])
    distortion = np.linalg.svd(ground.jacobians, compute_uv=False)
    np.testing.assert_allclose(distortion[0], distortion[1], rtol=1e-6)
    mean = mean_plane_map(ground.x, ground.y, ground.jacobians, area=ground.area, degree=5)
    assert mean.total < 1e-4


@pytest.mark.slow
def test_common_ground():
    """It is where the hulls overlap, in truth."""
    ground = common_ground([conformal(0.4), conformal(0.3j, ground=(0.6, 1.8))])
    assert (ground.x.min() > 600.0, ground.x.max() < 1000.0) == (True, True)
    assert ground.jacobians.shape == (2, ground.x.size, 2, 2)
    assert ground.area.sum() == pytest.approx(1.0)
    with pytest.raises(ValueError, match=r"There is no ground that all of them show"):
        common_ground([conformal(0.4), conformal(0.4, ground=(2.0, 3.0))])
    with pytest.raises(ValueError, match=r"There must be two or more, not 1"):
        common_ground([conformal(0.4)])
    with pytest.raises(ValueError, match=r"Invalid rectification 'fit'"):
        common_ground([conformal(0.4)] * 2, by="fit")


def test_planes_that_are_not_the_same():
    """Sheets whose control points state different planes have no ground to compare on; other units do not matter."""
    sheet = conformal(0.4, side=5)

    def stating(crs):
        moved = ControlPoints(
            sheet.points.old, sheet.points.new + np.array([2e6, 6e5]), crs=Projection.from_user_input(crs)
        )
        return old_map(moved, smoothing=0.0)

    with pytest.raises(
        ValueError, match=r"^Invalid old maps\. Their truth is in EPSG:2230 and EPSG:32611; it must be in"
    ):
        common_ground([stating("EPSG:2230"), stating("EPSG:32611")])
    both = common_ground([stating("EPSG:2230"), stating("EPSG:26946")])
    np.testing.assert_array_equal(both.jacobians[0], both.jacobians[1])
