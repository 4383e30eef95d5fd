"""Wrong points of old maps: they are named and left out, and right ones seldom."""

import math

import numpy as np
import pytest
from gis_files import some_slow
from old_map_points import ROUNDING, grid, sheets, smooth
from refusals import refuses
from scipy import stats
from tables import each

from projdist.applications.oldmaps import ControlPoints, fits, old_map


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [("affine", 12), ("affine", 40), ("affine", 120), ("cone", 120)])
def test_false_alarms(kind, count):
    """Of sets with normal errors and no wrong point 5 % at most have a point named; 3 standard deviations more pass."""
    sets = 400
    named = sum(bool(fits.wrong_points(points).any()) for points in sheets(kind, count, 100.0, range(sets)))
    assert named <= sets * fits.FALSE_ALARM + 3.0 * math.sqrt(sets * fits.FALSE_ALARM * (1.0 - fits.FALSE_ALARM))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["affine", "waves", "conformal", "cone"])
@pytest.mark.parametrize("count", [8, 40, 300])
def test_no_alarm_without_errors(kind, count):
    """Whatever a spline lacks at the rim of a smooth map is no error of a point; rounding is none, either."""
    for points in sheets(kind, count, 0.0, range(75 if count < 300 else 10)):
        assert not fits.wrong_points(points).any()


@pytest.mark.slow
@pytest.mark.parametrize("kind", some_slow(["affine", "waves", "cone"], {"affine", "cone"}))
@pytest.mark.parametrize("noise", some_slow([0.0, 100.0], {0.0}))
def test_wrong_points_are_named(kind, noise):
    """Three to ten of 100 points that are wrong by 40 errors or more are named, all; of the others few."""
    missed = others = 0
    for seed, points in enumerate(sheets(kind, 100, noise, range(20))):
        rng = np.random.default_rng(1000 + seed)
        wrong = rng.permutation(100) < rng.integers(3, 11)
        angle, size = rng.uniform(0.0, 2.0 * np.pi, 100), rng.uniform(4e3, 1e4, 100)
        away = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * (size * wrong)[:, None]
        named = fits.wrong_points(ControlPoints(points.old, points.new + away))
        missed, others = missed + int((wrong & ~named).sum()), others + int((named & ~wrong).sum())
    # Twenty sets with a chance of 5 % each have three such points or fewer in 98 of 100 cases.
    assert (missed, others <= (0 if noise == 0.0 else 3)) == (0, True)


@pytest.mark.slow
def test_neighbours_of_a_wrong_point():
    """Of points in pairs, 2 units apart, the one that is wrong is named, and not the one beside it."""
    for number, points in enumerate(sheets("waves", 40, 20.0, range(20))):
        rng = np.random.default_rng(number)
        old = np.concatenate([points.old, points.old + 2.0])
        new = smooth("waves", old) + rng.normal(0.0, 20.0, old.shape)
        new[number] += [-1500.0, 1500.0]
        named = fits.wrong_points(ControlPoints(old, new))
        assert (named[number], named[number + 40]) == (True, False)


@each("order", [2, 3])
def test_points_left_out_one_by_one(order):
    """Residuals and their variances are those of splines solved anew, as linear systems, without the points."""
    # The system is that of the kernel r^2 ln r, or -r^4 ln r, and polynomials (Wahba 1990, equation 2.4.23); a residual
    # from the fit to the others has the variance K(x, x) + smoothing - k^T M k by the same system (her section 1.5).
    rng = np.random.default_rng(4)
    u, z = rng.normal(size=(30, 2)), rng.normal(size=30) + 1j * rng.normal(size=30)
    spline = fits.SplineModes(u, order)
    smoothing = spline.cross_validated(z)
    others = fits._Others(spline, z, 4)
    x, y = u.T
    P = np.stack([x**i * y**j for i in range(order) for j in range(order - i)], axis=-1)
    square = ((u[:, None] - u) ** 2).sum(axis=-1)
    K = 0.5 * (-1.0) ** order * square ** (order - 1) * np.log(np.where(square > 0, square, 1.0))
    left = np.arange(30)
    for point in (7, 22, 0, 13):
        others.leave_out(point)
        left = left[left != point]
        found = others.residuals()
        for k in left[::9]:
            rest = left[left != k]
            corner = np.zeros((P.shape[1],) * 2)
            system = np.block([[K[np.ix_(rest, rest)] + smoothing * np.eye(len(rest)), P[rest]], [P[rest].T, corner]])
            reach = np.concatenate([K[k, rest], P[k]])
            fitted = np.linalg.solve(system, np.concatenate([z[rest], np.zeros(P.shape[1])]))
            spread = K[k, k] + smoothing - reach @ np.linalg.solve(system, reach)
            noise = np.vdot(z[rest], fitted[: len(rest)]).real / (len(rest) - P.shape[1])
            np.testing.assert_allclose(found.square[k], abs(z[k] - reach @ fitted) ** 2, rtol=ROUNDING)
            np.testing.assert_allclose(found.variance[k], noise * spread, rtol=ROUNDING)
        assert found.freedom == len(left) - 1 - P.shape[1]


@pytest.mark.slow
def test_the_fit_is_without_outliers():
    """The mean Dist_F^2 with wrong points is that of the other points; if they are kept it is many times as large."""
    (points,) = sheets("cone", 150, 30.0, range(1))
    wrong = np.isin(np.arange(150), [3, 50, 77, 120])
    moved = ControlPoints(points.old, points.new + np.where(wrong, 1.0, 0.0)[:, None] * [9e4, -6e4])
    clean, found, kept = old_map(points.chosen(~wrong)), old_map(moved), old_map(moved, outliers="keep")
    assert set(found.outliers) == set(kept.outliers) == {"4", "51", "78", "121"}
    assert found.rectifications["mdt"].distortion == clean.rectifications["mdt"].distortion
    assert kept.rectifications["mdt"].distortion > 5.0 * clean.rectifications["mdt"].distortion
    assert (found.fitted.names, len(kept.fitted.names)) == (clean.points.names, 150)
    rows = {row["id"]: row for row in found.to_dict()["points"]}
    assert [rows[name]["outlier"] for name in ("3", "4", "51")] == [False, True, True]
    assert rows["51"]["left_out"] == pytest.approx(math.hypot(9e4, 6e4), rel=0.01)
    refuses(r"Invalid outliers 'none'. It must be one of drop, keep", old_map, points, outliers="none")


def test_outliers():
    """The farthest is told first; rounding makes no outlier, and points that determine just the model tell of none."""
    (points,) = sheets("affine", 60, 5.0, range(1))
    new = points.new.copy()
    new[[17, 4]] += [[900.0, 0.0], [0.0, -600.0]]
    names = tuple(f"P{k}" for k in range(60))
    assert old_map(ControlPoints(points.old, new, names), model="affine").outliers == ("P17", "P4")
    points = ControlPoints(grid(4), grid(4) @ [[900.0, 100.0], [-30.0, 950.0]])
    assert old_map(points, model="affine").outliers == ()
    three = old_map(ControlPoints(points.old[[0, 1, 5]], points.new[[0, 1, 5]]), model="affine")
    assert three.outliers == ()
    assert three.to_dict()["residual_left_out"] is None


def test_the_chance_of_a_residual():
    """The square of a residual in the plane over its variance has the distribution F(2, 2 m)."""
    for freedom in (1, 7, 200):
        one = fits._Residuals(np.array([0.3, 5.0, 40.0]), np.ones(3), freedom)
        truth = stats.f.logsf(one.square, 2, 2 * freedom)
        np.testing.assert_allclose(fits._log_probability([one], 0.0), truth, rtol=1e-9)
