"""Fits of old maps: exact recovery, derivatives, points left out, cross-validation, and wrong points."""

import math

import numpy as np
import pytest
from gis_files import some_slow
from old_map_points import ROUNDING, grid, scattered, sheets, smooth
from refusals import refuses
from scipy import stats
from scipy.interpolate import RBFInterpolator
from tables import each

from projdist.applications.oldmaps import MODELS, ControlPoints, affine_fit, fit, fits, helmert_fit, old_map
from projdist.field.at_points import jacobian
from projdist.projections import Projection


@each("flip", [1.0, -1.0])
def test_similarity_is_recovered(flip):
    """Every model but one finds a similarity exactly, mirrored or not; so do both linear fits."""
    old = grid(4) * [300.0, 200.0]
    matrix = 5.0 * np.array([[0.8, -0.6], [0.6, 0.8]]) @ np.diag([1.0, flip])
    points = ControlPoints(old, old @ matrix.T + [6e5, 2e5])
    for linear in (affine_fit(points), helmert_fit(points)):
        np.testing.assert_allclose(linear.matrix, matrix, atol=5 * ROUNDING)
        np.testing.assert_allclose(linear.inverse()(linear(old)), old, atol=1e-6)
    for model in MODELS:
        found = fit(points, model)
        np.testing.assert_allclose(found(old), points.new, rtol=ROUNDING)
        np.testing.assert_allclose(found.jacobian(old), np.broadcast_to(matrix, (16, 2, 2)), atol=1e-8)


def normalised(points: ControlPoints, places: np.ndarray) -> np.ndarray:
    """Places in the coordinates of the affine fit, by the middle and the deviation of the points."""
    registered = affine_fit(points)(points.old)
    middle = registered.mean(axis=0)
    return (affine_fit(points)(places) - middle) / np.sqrt(((registered - middle) ** 2).mean())


@each("smoothing", [0.0, 0.02, 0.05, 10.0])
def test_spline_is_scipys(smoothing):
    """In the coordinates of the affine fit the spline is SciPy's, inside and outside, also without a point."""
    points = ControlPoints(*scattered(15))
    u, found = normalised(points, points.old), fit(points, "tps", smoothing)
    other = RBFInterpolator(u, points.new, kernel="thin_plate_spline", smoothing=smoothing)
    places = np.random.default_rng(5).uniform([-300.0, -200.0], [1200.0, 800.0], (40, 2))
    np.testing.assert_allclose(found(places), other(normalised(points, places)), rtol=1e-9)
    np.testing.assert_allclose(found.residuals, points.new - found(points.old), atol=1e-6)
    for k in (0, 14):
        rest = np.arange(15) != k
        other = RBFInterpolator(u[rest], points.new[rest], kernel="thin_plate_spline", smoothing=smoothing)
        np.testing.assert_allclose(found.left_out[k], points.new[k] - other(u[k : k + 1])[0], rtol=1e-6, atol=1e-5)


@each("model", MODELS)
def test_analytic_jacobian_is_the_engines(model):
    """The derivatives agree with differences of the map, as of any projection: J of the composition is J_fit J_map."""
    found = fit(ControlPoints(*scattered(25)), model)
    base = Projection.from_user_input("+proj=eqc +R=6371000")

    def composed(lon, lat):
        places = np.stack([np.ravel(part) for part in base(lon, lat)], axis=-1) / 1000.0
        return found(places).T.reshape(2, *np.shape(lon))

    lon, lat = np.random.default_rng(6).uniform(1.0, 5.0, (2, 20))
    places = np.stack(base(lon, lat), axis=-1) / 1000.0
    expected = found.jacobian(places) @ jacobian(base, lon, lat) / 1000.0
    # Differences know nothing of the logarithm at the knots; away from them they are good to 1e-7.
    measured = jacobian(Projection.from_function(composed, ellipsoid=base.ellipsoid), lon, lat)
    np.testing.assert_allclose(measured, expected, atol=1e-7 * np.abs(expected).max())


def least_squares(model: str, points: ControlPoints, places: np.ndarray) -> np.ndarray:
    """What a model with these points says of places, in plain coordinates; a similarity by complex numbers."""

    def basis(p):
        x, y = ((p - 300.0) / 300.0).T
        if model == "helmert":
            return np.stack([np.ones(len(p)), x + 1j * y], axis=-1)
        degree = {"affine": 1, "polynomial2": 2, "polynomial3": 3}[model]
        return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=-1)

    found = basis(places) @ np.linalg.lstsq(basis(points.old), points.new @ [1, 1j], rcond=None)[0]
    return np.stack([found.real, found.imag], axis=-1)


@each(("model", "freedom"), [("helmert", 2), ("affine", 3), ("polynomial2", 6), ("polynomial3", 10)])
def test_least_squares(model, freedom):
    """Places anywhere, and where a point would be without it, are what least squares say."""
    points = ControlPoints(*scattered(20))
    found, places = fit(points, model), scattered(20, seed=2)[0]
    np.testing.assert_allclose(found(places), least_squares(model, points, places), atol=1e-6)
    for k in (0, 7, 19):
        without = least_squares(model, points.chosen(np.arange(20) != k), points.old[[k]])
        np.testing.assert_allclose(found.left_out[[k]], points.new[k] - without, rtol=1e-8, atol=1e-6)
    assert found.freedom == freedom


def test_cross_validation():
    """The smoothing has the least n RSS / tr(1 - H)^2, H by SciPy's splines through unit vectors."""
    points = ControlPoints(*scattered(30))
    u, found = normalised(points, points.old), fit(points)

    def score(smoothing):
        H = RBFInterpolator(u, np.eye(30), kernel="thin_plate_spline", smoothing=smoothing)(u)
        return 30.0 * ((points.new - H @ points.new) ** 2).sum() / np.trace(np.eye(30) - H) ** 2, np.trace(H)

    assert found.smoothing is not None
    best, freedom = score(found.smoothing)
    assert freedom == pytest.approx(found.freedom, rel=1e-8)
    # Two refinements of 121 steps leave about a percent of the smoothing; the score is flat there.
    assert best <= min(score(found.smoothing * 10.0**k)[0] for k in (-3, -2, -1, -0.3, -0.1, 0.1, 0.3, 1, 2, 3))


def test_wrong_fits():
    """Models, smoothings and points that make no fit are refused."""
    old, new = scattered(5)
    points, three = ControlPoints(old, new), ControlPoints(old[:3], new[:3])
    refuses(r"Invalid model 'spline'. It must be one of helmert, affine, polynomial2", fit, points, "spline")
    refuses(r"Invalid smoothing '1' of model 'affine'. It is for tps", fit, points, "affine", 1.0)
    refuses("Invalid smoothing '-1' of model 'tps'", fit, points, "tps", -1.0)
    refuses(r"Invalid control points for model 'polynomial2'. At least 6 that determine it", fit, points, "polynomial2")
    refuses(r"Invalid control points for model 'tps'. There must be 4 or more", fit, three, "tps")
    old[4] = old[1]
    refuses("Points '2' and '5' are too close on the old map to", fit, ControlPoints(old, new), "tps", 0.0)


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
    others = fits._ReducedSpline(spline, z, 4)
    x, y = u.T
    P = np.stack([x**i * y**j for i in range(order) for j in range(order - i)], axis=-1)
    square = ((u[:, None] - u) ** 2).sum(axis=-1)
    K = 0.5 * (-1.0) ** order * square ** (order - 1) * np.log(np.where(square > 0, square, 1.0))
    left = np.arange(30)
    for point in (7, 22, 0, 13):
        others.leave_out(point)
        left, found = left[left != point], others.residuals()
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


@pytest.mark.slow
def test_outliers():
    """The farthest is told first; rounding makes no outlier, and points that determine just the model tell of none."""
    (points,) = sheets("affine", 60, 5.0, range(1))
    new = points.new.copy()
    new[[17, 4]] += [[900.0, 0.0], [0.0, -600.0]]
    names = tuple(f"P{k}" for k in range(60))
    assert old_map(ControlPoints(points.old, new, names), model="affine").outliers == ("P17", "P4")
    points = ControlPoints(grid(4), grid(4) @ [[900.0, 100.0], [-30.0, 950.0]])
    three = old_map(ControlPoints(points.old[[0, 1, 5]], points.new[[0, 1, 5]]), model="affine")
    assert old_map(points, model="affine").outliers == three.outliers == ()
    assert three.to_dict()["residual_left_out"] is None


def test_the_chance_of_a_residual():
    """The square of a residual in the plane over its variance has the distribution F(2, 2 m)."""
    for freedom in (1, 7, 200):
        one = fits._Residuals(np.array([0.3, 5.0, 40.0]), np.ones(3), freedom)
        truth = stats.f.logsf(one.square, 2, 2 * freedom)
        np.testing.assert_allclose(fits._log_probability([one], 0.0), truth, rtol=1e-9)
