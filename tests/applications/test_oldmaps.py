"""Old maps: fits with exact derivatives, the field of distortion, folds and outliers."""

import math

import numpy as np
import pytest
from gis_files import some_slow
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.interpolate import RBFInterpolator

from projdist.applications.oldmaps import (
    LOCAL_MEASURES,
    MODELS,
    ControlPoints,
    affine_fit,
    fit,
    helmert_fit,
    old_map,
)
from projdist.applications.oldmaps.field import hull_nodes
from projdist.applications.oldmaps.fits import SplineModes
from projdist.applications.oldmaps.outliers import FALSE_ALARM, _log_chance, _Others, _Residuals, wrong_points
from projdist.field.at_points import jacobian
from projdist.matrices.distortions import fisher
from projdist.matrices.mean_transformation import mdt
from projdist.projections import Projection

ROUNDING = 1e-9  # relative; the fits solve well-conditioned systems of at most a hundred unknowns
RULE = 2e-5  # of means by 100 rows of midpoints: the error is 1e-4 / 24 of a second derivative

LOST = (
    1e-4 / 12.0
)  # of the mean square of a slope, which the variance within the cells, 0.01 wide, takes from the whole


def grid(count: int = 7) -> np.ndarray:
    """Points of the unit square, its corners among them."""
    return np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, count)] * 2), axis=-1).reshape(-1, 2)


def scattered(count: int = 40, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points of an old map and their true places, with a smooth distortion and noise."""
    rng = np.random.default_rng(seed)
    old = rng.uniform([0.0, 0.0], [900.0, 600.0], (count, 2))
    x, y = old.T / 600.0
    new = np.stack([40.0 * x + 3.0 * y + 2.0 * np.sin(2 * x), 41.0 * y - 2.0 * x + 1.5 * x * y], axis=-1)
    return old, 1000.0 * new + rng.normal(0.0, 100.0, new.shape)


# ---- fits -------------------------------------------------------------------------------------


@pytest.mark.parametrize("flip", [1.0, -1.0])
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


@pytest.mark.parametrize("smoothing", [0.0, 0.01, None, 10.0])
def test_spline_reproduces_affine_maps(smoothing):
    """Whatever its smoothing, a thin-plate spline of affine data is the affine map, inside and outside."""
    old = np.random.default_rng(2).uniform(0.0, 500.0, (30, 2))
    matrix, shift = np.array([[2.0, 0.7], [-0.4, 1.5]]), np.array([6e5, 2e5])
    found = fit(ControlPoints(old, old @ matrix.T + shift), "tps", smoothing)
    places = np.random.default_rng(3).uniform(-200.0, 700.0, (50, 2))
    np.testing.assert_allclose(found(places), places @ matrix.T + shift, rtol=ROUNDING)
    np.testing.assert_allclose(found.jacobian(places), np.broadcast_to(matrix, (50, 2, 2)), rtol=1e-7)


@pytest.mark.parametrize("degree", [2, 3])
def test_polynomials_are_recovered(degree):
    """A polynomial of the degree is found with its derivatives; one of a higher degree is not."""
    rng = np.random.default_rng(degree)
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    C = rng.normal(size=(len(powers), 2))
    old, places = rng.uniform(-1.0, 1.0, (30, 2)), rng.uniform(-1.0, 1.0, (20, 2))

    def value(p):
        return np.stack([p[:, 0] ** i * p[:, 1] ** j for i, j in powers], axis=-1) @ C

    def derivative(p):
        x, y = p.T
        dx = np.stack([i * x ** max(i - 1, 0) * y**j for i, j in powers], axis=-1) @ C
        dy = np.stack([j * x**i * y ** max(j - 1, 0) for i, j in powers], axis=-1) @ C
        return np.stack([dx, dy], axis=-1)

    found = fit(ControlPoints(old, value(old)), f"polynomial{degree}")
    np.testing.assert_allclose(found(places), value(places), atol=1e-10)
    np.testing.assert_allclose(found.jacobian(places), derivative(places), atol=1e-10)
    assert found.freedom == len(powers)


@pytest.mark.parametrize("smoothing", [0.0, 0.02])
def test_spline_is_scipys(smoothing):
    """In the coordinates of the affine fit the spline is SciPy's, with the same smoothing."""
    old, new = scattered()
    points = ControlPoints(old, new)
    registered = affine_fit(points)(old)
    unit = np.sqrt(registered.var(axis=0).mean())
    u = (registered - registered.mean(axis=0)) / unit
    other = RBFInterpolator(u, new, kernel="thin_plate_spline", smoothing=smoothing)
    places = np.random.default_rng(5).uniform([0.0, 0.0], [900.0, 600.0], (40, 2))
    v = (affine_fit(points)(places) - registered.mean(axis=0)) / unit
    np.testing.assert_allclose(fit(points, "tps", smoothing)(places), other(v), rtol=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_analytic_jacobian_is_the_engines(model):
    """The derivatives agree with differences of the map, as of any projection: J of the composition is J_fit J_map."""
    old, new = scattered(25)
    found = fit(ControlPoints(old, new), model)
    base = Projection.from_user_input("+proj=eqc +R=6371000")

    def composed(lon, lat):
        x, y = base(lon, lat)
        places = found(np.stack([np.ravel(x), np.ravel(y)], axis=-1) / 1000.0)
        return places[:, 0].reshape(np.shape(lon)), places[:, 1].reshape(np.shape(lon))

    lon, lat = np.random.default_rng(6).uniform(1.0, 5.0, (2, 20))
    places = np.stack(base(lon, lat), axis=-1) / 1000.0
    expected = found.jacobian(places) @ jacobian(base, lon, lat) / 1000.0
    scale = np.abs(expected).max()
    # Differences know nothing of the logarithm at the knots; away from them they are good to 1e-7.
    measured = jacobian(Projection.from_function(composed, ellipsoid=base.ellipsoid), lon, lat)
    np.testing.assert_allclose(measured, expected, atol=1e-7 * scale)


def refitted(points: ControlPoints, model: str, k: int) -> np.ndarray:
    """The residual of point k from least squares with the others, in plain coordinates."""
    rest = np.arange(len(points.old)) != k
    degree = {"affine": 1, "polynomial2": 2, "polynomial3": 3}[model]

    def basis(p):
        x, y = ((p - 300.0) / 300.0).T
        return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=-1)

    C = np.linalg.lstsq(basis(points.old[rest]), points.new[rest], rcond=None)[0]
    return points.new[k] - (basis(points.old[k : k + 1]) @ C)[0]


@pytest.mark.parametrize("model", ["affine", "polynomial2", "polynomial3"])
def test_left_out(model):
    """What a point would be without it is what a fit without it says."""
    points = ControlPoints(*scattered(20))
    found = fit(points, model)
    for k in (0, 7, 19):
        np.testing.assert_allclose(found.left_out[k], refitted(points, model, k), rtol=1e-8, atol=1e-6)


def test_left_out_of_helmert():
    """The same of a similarity, by complex least squares."""
    points = ControlPoints(*scattered(12))
    found = fit(points, "helmert")
    z, w = points.old @ [1, 1j], points.new @ [1, 1j]
    for k in (0, 11):
        rest = np.arange(12) != k
        slope, shift = np.linalg.lstsq(np.stack([z[rest], np.ones(11)], axis=-1), w[rest], rcond=None)[0]
        off = w[k] - slope * z[k] - shift
        np.testing.assert_allclose(found.left_out[k], [off.real, off.imag], rtol=1e-8, atol=1e-6)


def normalised(points: ControlPoints) -> np.ndarray:
    registered = affine_fit(points)(points.old)
    middle = registered.mean(axis=0)
    return (registered - middle) / np.sqrt(((registered - middle) ** 2).mean())


@pytest.mark.parametrize("smoothing", [0.0, 0.05])
def test_left_out_of_spline(smoothing):
    """The same of a spline of given smoothing, by SciPy."""
    points = ControlPoints(*scattered(15))
    u, found = normalised(points), fit(points, "tps", smoothing)
    for k in (0, 14):
        rest = np.arange(15) != k
        other = RBFInterpolator(u[rest], points.new[rest], kernel="thin_plate_spline", smoothing=smoothing)
        np.testing.assert_allclose(found.left_out[k], points.new[k] - other(u[k : k + 1])[0], rtol=1e-6, atol=1e-5)


def test_cross_validation():
    """The smoothing has the least n RSS / tr(1 - H)^2, H by SciPy's splines through unit vectors."""
    points = ControlPoints(*scattered(30))
    u, found = normalised(points), fit(points)

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
    points = ControlPoints(*scattered(5))
    with pytest.raises(ValueError, match=r"Invalid model 'spline'. It must be one of helmert, affine, polynomial2"):
        fit(points, "spline")
    with pytest.raises(ValueError, match=r"Invalid smoothing '1' of model 'affine'. It is for tps"):
        fit(points, "affine", 1.0)
    with pytest.raises(ValueError, match="Invalid smoothing '-1' of model 'tps'"):
        fit(points, "tps", -1.0)
    with pytest.raises(ValueError, match=r"Invalid control points for model 'polynomial2'. There must be 6 or more"):
        fit(points, "polynomial2")
    with pytest.raises(ValueError, match=r"Invalid control points for model 'tps'. There must be 4 or more"):
        fit(ControlPoints(points.old[:3], points.new[:3]), "tps")
    old, new = scattered(6)
    old[4] = old[1]
    with pytest.raises(ValueError, match="Points '2' and '5' are too close on the old map to be interpolated"):
        fit(ControlPoints(old, new), "tps", 0.0)


# ---- the field --------------------------------------------------------------------------------


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_known_field(flip):
    """Of f = (x + a x^2 / 2, y) the MDT is the geometric mean, and its cost the variance of ln(1 + a x)."""
    a = 0.8
    x, y = grid().T
    points = ControlPoints(np.stack([x, flip * y], axis=-1), 1000.0 * np.stack([x + 0.5 * a * x * x, y], axis=-1))
    found = old_map(points, model="polynomial2")
    expected = np.zeros((len(found.nodes), 2, 2))
    expected[:, 0, 0], expected[:, 1, 1] = 1e-3 / (1.0 + a * found.nodes[:, 0]), 1e-3 * flip
    np.testing.assert_allclose(found.jacobian, expected, atol=1e-12)
    log = np.log1p(a)
    mean = ((1.0 + a) * log - a) / a
    square = ((1.0 + a) * (log * log - 2.0 * log + 2.0) - 2.0) / a
    correction = found.rectifications["mdt"]
    np.testing.assert_allclose(correction.affine.matrix, 1000.0 * np.diag([np.exp(mean), flip]), rtol=RULE, atol=1e-6)
    slope = a / (1.0 + a) * a  # the mean square of a / (1 + a x)
    assert correction.distortion == pytest.approx(square - mean * mean - LOST * slope, rel=RULE)
    assert (found.is_mirrored, found.fold_share, found.folds_near) == (flip < 0, 0.0, ())
    assert found.area == pytest.approx(1.0, rel=1e-12)


def test_distortion_of_rectifications():
    """The means are those of Dist_F^2 of M J by the measure, the MDT's is that of `mdt`."""
    found = old_map(ControlPoints(*scattered()))
    assert found.rectifications["mdt"].distortion == pytest.approx(mdt(found.jacobian, found.weights).cost, rel=1e-12)
    for one in found.rectifications.values():
        mean = found.weights @ fisher(one.affine.matrix @ found.jacobian) ** 2
        assert one.distortion == pytest.approx(mean, rel=1e-12)
        assert one.distortion >= found.rectifications["mdt"].distortion


@pytest.mark.slow
@given(st.lists(st.floats(-0.3, 0.3), min_size=12, max_size=12), st.booleans(), st.sampled_from(["polynomial2", "tps"]))
def test_no_affine_map_is_better(numbers, is_mirrored, model):
    """The MDT's mean Dist_F^2 is never above the affine's, which may be a similarity, at the same nodes (theorem)."""
    x, y = grid(5).T
    basis = np.stack([x * x, x * y, y * y, x**3, np.sin(5 * x), np.cos(4 * y)], axis=-1)
    new = 1000.0 * (grid(5) + 0.5 * basis @ np.reshape(numbers, (6, 2)))
    old = grid(5) * [1.0, -1.0 if is_mirrored else 1.0]
    found = old_map(ControlPoints(old, new), model=model).rectifications
    for other in ("affine", "helmert"):
        assert found["mdt"].distortion <= found[other].distortion + 1e-14
    assert found["affine"].residual <= found["helmert"].residual + 1e-9
    assert found["affine"].residual <= found["mdt"].residual + 1e-9


@pytest.mark.parametrize(
    "model", ["affine", *(pytest.param(model, marks=pytest.mark.slow) for model in ("polynomial2", "tps"))]
)
def test_units_and_axes_of_the_old_map(model):
    """Affine changes of the old plane, mirrored ones too, change no figure but the Helmert fit's and the area."""
    old, new = scattered()
    first = old_map(ControlPoints(old, new), model=model)
    for change in (np.array([[0.1, 0.0], [0.0, 0.3]]), np.array([[0.5, 2.0], [1.0, -0.4]])):
        other = old_map(ControlPoints(old @ change.T + [50.0, -70.0], new), model=model)
        assert other.is_mirrored == (np.linalg.det(change) < 0)
        for name in ("mdt", "affine"):
            one, two = (found.rectifications[name] for found in (first, other))
            assert two.distortion == pytest.approx(one.distortion, rel=1e-8, abs=1e-20)
            assert two.residual == pytest.approx(one.residual, rel=1e-8)
        np.testing.assert_allclose(other.fit.left_out, first.fit.left_out, rtol=1e-6, atol=1e-4)
        assert other.area == pytest.approx(first.area * abs(np.linalg.det(change)), rel=1e-9)
        for name, values in first.statistics().items():
            assert other.statistics()[name] == pytest.approx(values, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_folds(flip):
    """f = (x, y - 0.625 y^2) folds where y > 0.8, on a fifth of the square; the figures are of the rest."""
    x, y = grid(11).T
    points = ControlPoints(np.stack([x, flip * y], axis=-1), 1000.0 * np.stack([x, y - 0.625 * y * y], axis=-1))
    found = old_map(points, model="polynomial2")
    assert found.fold_share == pytest.approx(0.2, abs=1e-12)
    np.testing.assert_array_equal(np.isnan(found.jacobian[:, 0, 0]), flip * found.nodes[:, 1] > 0.8)
    near = [points.names.index(name) for name in found.folds_near]
    assert near
    assert (y[near] >= 0.8 - 1e-9).all()
    assert np.isfinite(found.rectifications["mdt"].distortion)
    folds = found.to_dict()["folds"]
    assert (folds["share"], folds["area"]) == (found.fold_share, found.fold_share * found.area)


def smooth(kind: str, old: np.ndarray) -> np.ndarray:
    """True places, some 40 km large, of places on a sheet of 900 by 600."""
    x, y = old.T / 600.0
    both = {
        "affine": (40 * x + 3 * y, 41 * y - 2 * x),
        "waves": (40 * x + np.sin(6 * y), 40 * y + np.cos(5 * x + y)),
        "conformal": (40 * x + 3 * np.exp(x) * np.cos(y), 40 * y + 3 * np.exp(x) * np.sin(y)),
        "cone": ((3 - y) * np.sin(0.5 * x) * 25, -(3 - y) * np.cos(0.5 * x) * 25),
    }[kind]
    return 1000.0 * np.stack(both, axis=-1)


def sheets(kind: str, count: int, noise: float, sets: range):
    """Sets of scattered points of a smooth map, with normal errors in metres."""
    for seed in sets:
        rng = np.random.default_rng(seed)
        old = rng.uniform([0.0, 0.0], [900.0, 600.0], (count, 2))
        yield ControlPoints(old, smooth(kind, old) + noise * rng.normal(size=(count, 2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count"),
    [
        ("affine", 12),
        ("affine", 40),
        ("affine", 120),
        ("cone", 120),
    ],
)
def test_false_alarms(kind, count):
    """Of sets with normal errors and no wrong point 5 % at most have a point named; 3 standard deviations more pass."""
    sets = 400
    named = sum(bool(wrong_points(points).any()) for points in sheets(kind, count, 100.0, range(sets)))
    assert named <= sets * FALSE_ALARM + 3.0 * math.sqrt(sets * FALSE_ALARM * (1.0 - FALSE_ALARM))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["affine", "waves", "conformal", "cone"])
@pytest.mark.parametrize("count", [8, 40, 300])
def test_no_alarm_without_errors(kind, count):
    """Whatever a spline lacks at the rim of a smooth map is no error of a point; rounding is none, either."""
    for points in sheets(kind, count, 0.0, range(75 if count < 300 else 10)):
        assert not wrong_points(points).any()


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
        named = wrong_points(ControlPoints(points.old, points.new + away))
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
        named = wrong_points(ControlPoints(old, new))
        assert (named[number], named[number + 40]) == (True, False)


@pytest.mark.parametrize("order", [2, 3])
def test_points_left_out_one_by_one(order):
    """Residuals and their variances are those of splines solved anew, as linear systems, without the points.

    The system is that of the kernel r^2 ln r, or -r^4 ln r, and polynomials (Wahba 1990, equation 2.4.23); a residual
    from the fit to the others has the variance K(x, x) + smoothing - k^T M k by the same system (her section 1.5).
    """
    rng = np.random.default_rng(4)
    u, z = rng.normal(size=(30, 2)), rng.normal(size=30) + 1j * rng.normal(size=30)
    spline = SplineModes(u, order)
    smoothing = spline.cross_validated(z)
    others = _Others(spline, z, 4)
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
    with pytest.raises(ValueError, match=r"Invalid outliers 'none'. It must be one of drop, keep"):
        old_map(points, outliers="none")


def test_outliers_are_told_in_order():
    """The farthest comes first."""
    (points,) = sheets("affine", 60, 5.0, range(1))
    new = points.new.copy()
    new[17] += [900.0, 0.0]
    new[4] += [0.0, -600.0]
    names = tuple(f"P{k}" for k in range(60))
    assert old_map(ControlPoints(points.old, new, names), model="affine").outliers == ("P17", "P4")


def test_the_chance_of_a_residual():
    """The square of a residual in the plane over its variance has the distribution F(2, 2 m)."""
    for freedom in (1, 7, 200):
        one = _Residuals(np.array([0.3, 5.0, 40.0]), np.ones(3), freedom)
        np.testing.assert_allclose(_log_chance([one], 0.0), stats.f.logsf(one.square, 2, 2 * freedom), rtol=1e-9)


def test_percentiles_of_measures():
    """A twentieth of the area has less than the first, a half less than the second, nineteen twentieths the third."""
    rng = np.random.default_rng(8)
    old = rng.uniform(0.0, 100.0, (30, 2))
    found = old_map(ControlPoints(old, 50.0 * old + 0.05 * old**2), model="polynomial2")
    for name, shares in found.statistics().items():
        values = LOCAL_MEASURES[name](found.corrected(found.jacobian))
        for key, share in (("p05", 0.05), ("median", 0.5), ("p95", 0.95)):
            assert found.weights[values <= shares[key]].sum() == pytest.approx(share, abs=0.01)


def test_exact_points_have_no_outliers():
    """Rounding makes no outlier; and points that determine just the model tell of none."""
    points = ControlPoints(grid(4), grid(4) @ [[900.0, 100.0], [-30.0, 950.0]])
    assert old_map(points, model="affine").outliers == ()
    three = old_map(ControlPoints(points.old[[0, 1, 5]], points.new[[0, 1, 5]]), model="affine")
    assert three.outliers == ()
    assert three.to_dict()["residual_left_out"] is None


def test_scale_and_turn_of_a_scan():
    """A map 1 : 50,000, scanned with 300 dots per inch and turned clockwise by 10 degrees, is told so."""
    truth = grid(5) * [9000.0, 6000.0]
    angle, dots = np.radians(10.0), 300.0 / 0.0254 / 50_000.0
    east, north = truth.T
    right, up = np.cos(angle) * east + np.sin(angle) * north, -np.sin(angle) * east + np.cos(angle) * north
    found = old_map(
        ControlPoints(dots * np.stack([right, -up], -1) + 500.0, truth), model="affine", dots_per_inch=300.0
    )
    assert found.is_mirrored
    assert "y axis points down" in found.notes[0]
    for name, one in found.to_dict()["rectifications"].items():
        assert one["denominator"] == pytest.approx(50_000.0, rel=1e-9), name
        assert one["rotation"] == pytest.approx(10.0, abs=1e-7), name
        assert one["stretch"] == pytest.approx(1.0, abs=1e-9), name
    with pytest.raises(ValueError, match=r"Invalid dots per inch '0'. They must be positive"):
        old_map(found.points, dots_per_inch=0.0)


@pytest.mark.parametrize("flip", [1.0, -1.0])
def test_rotations_have_one_sign(flip):
    """Of f = a z + b z^2 / 2 the sheet is turned clockwise by arg(a + b z): the mean, and what more a place has."""
    a, b = 40.0 * np.exp(0.2j), 6.0 - 9.0j
    z = grid(9) @ [1.0, 1.0j]
    f = a * z + 0.5 * b * z * z
    points = ControlPoints(grid(9) * [1.0, flip], np.stack([f.real, f.imag], axis=-1))
    found = old_map(points, model="polynomial2")
    more = np.array([row["rotation"] for row in found.to_dict()["points"]])
    turned = np.degrees(np.angle(a + b * z))
    assert np.ptp(turned) > 15.0
    np.testing.assert_allclose(found.rectifications["mdt"].parts.rotation + more, turned, atol=1e-6)


def test_standard_errors_of_helmert():
    """Of w = a z + b that of a is sigma over the root of the sum of squares of z, along a and across it."""
    old, new = scattered(20)
    found = old_map(ControlPoints(old, new), model="helmert", outliers="keep")
    z, w = ((places - places.mean(axis=0)) @ [1.0, 1.0j] for places in (old, new))
    square = np.sum(np.abs(z) ** 2)
    a = np.vdot(z, w) / square
    error = np.sqrt(np.sum(np.abs(w - a * z) ** 2) / (2 * 20 - 4) / square)
    for name in ("mdt", "helmert"):
        assert found.rectifications[name].scale_error == pytest.approx(error, rel=1e-9)
        assert found.rectifications[name].rotation_error == pytest.approx(np.degrees(error / abs(a)), rel=1e-9)
    exact = old_map(ControlPoints(old[[0, 1, 2]], new[[0, 1, 2]]), model="affine")
    assert exact.to_dict()["rectifications"]["affine"]["scale_error"] is None


@pytest.mark.slow
@pytest.mark.parametrize("flip", [1.0, -1.0])
@pytest.mark.parametrize(("model", "smoothing"), [("polynomial2", None), ("tps", 0.02)])
def test_standard_errors_go_through_the_mean(model, smoothing, flip):
    """They are the noise times the root of the squares of what each coordinate moves the scale and the turn by."""
    old, new = scattered(12)
    options = {"model": model, "smoothing": smoothing, "outliers": "keep"}

    def mean(new):
        found = old_map(ControlPoints(old * [1.0, flip], new), **options)
        parts = {name: one.parts for name, one in found.rectifications.items()}
        return found, np.array([[float(parts[name].scale), float(parts[name].rotation)] for name in ("mdt", "affine")])

    found, start = mean(new)
    moves = []
    for k in range(24):
        moved = new.copy()
        moved.flat[k] += 1.0
        moves.append(mean(moved)[1] - start)
    lengths = np.sqrt((np.array(moves) ** 2).sum(axis=0))
    fits = {"mdt": found.fit, "affine": fit(found.points, "affine")}
    for row, (name, one) in zip(lengths, fits.items(), strict=True):
        told = found.rectifications[name]
        # The turn of the MDT is the mean turn to first order in the distortion.
        np.testing.assert_allclose([told.scale_error, told.rotation_error], one.noise * row, rtol=0.02)


@pytest.mark.slow
def test_standard_errors_are_the_spread():
    """Over 100 sets of errors scale and turn of the MDT spread as is told, to the 7 % that such a spread is known."""
    (points,) = sheets("conformal", 40, 0.0, range(1))
    found = []
    for seed in range(100):
        noise = np.random.default_rng(seed).normal(0.0, 100.0, (40, 2))
        one = old_map(ControlPoints(points.old, points.new + noise), model="polynomial3", outliers="keep")
        mean = one.rectifications["mdt"]
        found.append([float(mean.parts.scale), float(mean.parts.rotation), mean.scale_error, mean.rotation_error])
    spread, told = np.std(found, axis=0, ddof=1)[:2], np.sqrt(np.mean(np.square(found), axis=0))[2:]
    np.testing.assert_allclose(told, spread, rtol=0.2)


def test_no_denominator():
    """Without the scan's resolution there is none."""
    found = old_map(ControlPoints(*scattered()), model="affine")
    assert found.denominator(2.0) is None
    assert found.to_dict()["rectifications"]["mdt"]["denominator"] is None


def test_local_measures():
    """Rotation counts clockwise, and scale is the root of the areal scale, whatever the stretch."""
    angle = np.radians(5.0)
    clockwise = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    J = clockwise @ np.diag([2.0, 0.5])
    assert LOCAL_MEASURES["rotation"](J) == pytest.approx(5.0)
    assert LOCAL_MEASURES["scale"](3.0 * J) == pytest.approx(3.0)


@pytest.mark.slow
def test_answer():
    """A row a control point, with the names of the JSON; a frame has them as columns."""
    pytest.importorskip("pandas")
    found = old_map(ControlPoints(*scattered(12)))
    data, frame = found.to_dict(), found.to_frame()
    assert list(frame.columns) == list(data["points"][0])
    assert len(frame) == len(data["points"]) == 12
    np.testing.assert_allclose(np.hypot(*found.residuals_left_out.T), frame["left_out"])
    assert found.to_json()


@pytest.mark.parametrize(
    ("corners", "area", "moment"),
    [([[0, 0], [2, 0], [0, 1]], 1.0, 2 / 3), ([[0, 0], [1, 0], [1, 1], [0, 1]], 1.0, 1 / 3)],
)
def test_nodes(corners, area, moment):
    """Over a triangle and a square the rule has the area, and the mean of x^2 with an error of second order."""
    errors = []
    for rows in (20, 40):
        nodes, weights, found = hull_nodes(np.array(corners, dtype=float), rows)
        assert found == pytest.approx(area, rel=1e-12)
        assert weights.sum() == pytest.approx(1.0, rel=1e-12)
        errors.append(abs(float(weights @ nodes[:, 0] ** 2) - moment))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] < 1e-3


def test_modes():
    """A sheet that shrank unevenly in one direction alone has that for its only mode, to the fit's own error."""
    side = np.linspace(0.0, 10.0, 9)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    true = np.stack([1000.0 * (x + 0.02 * x**2), 1000.0 * y], axis=-1)
    found = old_map(ControlPoints(np.stack([x, y], axis=-1), true), model="polynomial2")
    assert found.modes.words[0] == "horizontal"
    assert found.modes.shares[0] == pytest.approx(1.0, abs=1e-9)
    # ln(1 + .04 x) about its mean, x even from 0 to 10.
    logs = np.log1p(0.04 * (np.arange(100_000) + 0.5) / 10_000)
    assert found.modes.rms[0] == pytest.approx(logs.std(), rel=1e-4)
    assert found.to_dict()["modes"][0]["words"] == "horizontal"
