"""The field of distortion of old maps: its means, folds, statistics, nodes and modes."""

import numpy as np
import pytest
from gis_files import some_slow
from matrix_samples import rotation
from old_map_points import grid, scattered
from refusals import refuses
from tables import each

from projdist.applications.oldmaps import LOCAL_MEASURES, ControlPoints, fit, old_map
from projdist.applications.oldmaps.field import hull_nodes
from projdist.matrices.mean_transformation import mdt
from projdist.matrices.measures import fisher

RULE = 2e-5  # of means by 100 rows of midpoints: the error is 1e-4 / 24 of a second derivative

LOST = 1e-4 / 12.0  # of the mean square of a slope, which the variance within cells, 0.01 wide, takes from the whole


@each("flip", [1.0, -1.0])
def test_known_field(flip):
    """Of f = (x + a x^2 / 2, y) the MDT is the geometric mean, and its cost the variance of ln(1 + a x)."""
    a = 0.8
    x, y = grid().T
    points = ControlPoints(np.stack([x, flip * y], axis=-1), 1000.0 * np.stack([x + 0.5 * a * x * x, y], axis=-1))
    found = old_map(points, model="polynomial2")
    scales = np.stack(np.broadcast_arrays(1e-3 / (1.0 + a * found.nodes[:, 0]), 1e-3 * flip), axis=-1)
    np.testing.assert_allclose(found.jacobian, scales[..., None] * np.eye(2), atol=1e-12)
    log = np.log1p(a)
    mean = ((1.0 + a) * log - a) / a
    square = ((1.0 + a) * (log * log - 2.0 * log + 2.0) - 2.0) / a
    correction = found.rectifications["mdt"]
    np.testing.assert_allclose(correction.affine.matrix, 1000.0 * np.diag([np.exp(mean), flip]), rtol=RULE, atol=1e-6)
    slope = a / (1.0 + a) * a  # the mean square of a / (1 + a x)
    assert correction.distortion == pytest.approx(square - mean * mean - LOST * slope, rel=RULE)
    assert (found.is_mirrored, found.fold_share, found.folds_near) == (flip < 0, 0.0, ())
    assert found.area == pytest.approx(1.0, rel=1e-12)


@pytest.mark.slow
@each("flip", [1.0, -1.0])
def test_distortion_of_rectifications(flip):
    """The means are those of Dist_F^2 of M J by the measure, the MDT's is that of `mdt`; residuals are the RMS."""
    old, new = scattered(12)
    found = old_map(ControlPoints(old * [1.0, flip], new))
    mean, best, _ = rectifications = [*found.rectifications.values()]
    assert mean.distortion == pytest.approx(mdt(found.jacobian, found.weights).cost, rel=1e-12)
    for one in rectifications:
        square = found.weights @ fisher(one.affine.matrix @ found.jacobian) ** 2
        assert mean.distortion <= one.distortion == pytest.approx(square, rel=1e-12)
        gaps = one.affine(found.fitted.old) - found.fitted.new
        assert best.residual <= one.residual == pytest.approx(np.sqrt((gaps**2).sum(axis=1).mean()), rel=1e-9)
    pytest.importorskip("pandas")
    frame = found.to_frame()
    assert list(frame.columns) == list(found.to_dict()["points"][0])
    np.testing.assert_allclose(np.hypot(*found.residuals_left_out.T), frame["left_out"])


@each("model", some_slow(["affine", "polynomial2", "tps"], {"polynomial2", "tps"}))
def test_units_and_axes_of_the_old_map(model):
    """Affine changes of the old plane, mirrored ones too, change no figure but the Helmert fit's and the area."""
    old, new = scattered(20)
    first = old_map(ControlPoints(old, new), model=model)
    for change in (np.array([[0.1, 0.0], [0.0, 0.3]]), np.array([[0.5, 2.0], [1.0, -0.4]])):
        other = old_map(ControlPoints(old @ change.T + [50.0, -70.0], new), model=model)
        assert other.is_mirrored == (np.linalg.det(change) < 0)
        for name in ("mdt", "affine"):
            one, two = (found.rectifications[name] for found in (first, other))
            expected = pytest.approx((one.distortion, one.residual), rel=1e-8, abs=1e-20)
            assert (two.distortion, two.residual) == expected
        np.testing.assert_allclose(other.fit.left_out, first.fit.left_out, rtol=1e-6, atol=1e-4)
        assert other.area == pytest.approx(first.area * abs(np.linalg.det(change)), rel=1e-9)
        for name, values in first.statistics().items():
            assert other.statistics()[name] == pytest.approx(values, rel=1e-6, abs=1e-6)


@each("flip", [1.0, -1.0])
def test_folds(flip):
    """f = (x, y - 0.625 y^2) folds where y > 0.8, on a fifth of the square; the figures are of the rest."""
    x, y = grid(11).T
    points = ControlPoints(np.stack([x, flip * y], axis=-1), 1000.0 * np.stack([x, y - 0.625 * y * y], axis=-1))
    found = old_map(points, model="polynomial2")
    assert found.fold_share == pytest.approx(0.2, abs=1e-12)
    np.testing.assert_array_equal(np.isnan(found.jacobian[:, 0, 0]), flip * found.nodes[:, 1] > 0.8)
    assert y[[points.names.index(name) for name in found.folds_near]].min() >= 0.8 - 1e-9
    square = np.nanmean(fisher(found.corrected(found.jacobian)) ** 2)
    assert found.rectifications["mdt"].distortion == pytest.approx(square, rel=1e-12)
    folds = found.to_dict()["folds"]
    assert (folds["share"], folds["area"]) == (found.fold_share, found.fold_share * found.area)


def test_local_measures():
    """Percentiles are of shares of the area; rotation counts clockwise, and scale is the root of the areal scale."""
    old = np.random.default_rng(8).uniform(0.0, 100.0, (30, 2))
    found = old_map(ControlPoints(old, 50.0 * old + 0.05 * old**2), model="polynomial2")
    for name, shares in found.statistics().items():
        values = LOCAL_MEASURES[name](found.corrected(found.jacobian))
        for key, share in (("p05", 0.05), ("median", 0.5), ("p95", 0.95)):
            assert found.weights[values <= shares[key]].sum() == pytest.approx(share, abs=0.01)
    J = rotation(np.radians(-5.0)) @ np.diag([2.0, 0.5])
    assert LOCAL_MEASURES["rotation"](J) == pytest.approx(5.0)
    assert LOCAL_MEASURES["scale"](3.0 * J) == pytest.approx(3.0)


@each(("corners", "moment"), [([[0, 0], [2, 0], [0, 1]], 2 / 3), ([[0, 0], [1, 0], [1, 1], [0, 1]], 1 / 3)])
def test_nodes(corners, moment):
    """Over a triangle and a square the rule has the area, and the mean of x^2 with an error of second order."""
    errors = []
    for rows in (20, 40):
        nodes, weights, area = hull_nodes(np.array(corners, dtype=float), rows)
        assert (area, weights.sum()) == pytest.approx((1.0, 1.0), rel=1e-12)
        errors.append(abs(float(weights @ nodes[:, 0] ** 2) - moment))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] < 1e-3


def test_modes():
    """A sheet that shrank unevenly in one direction alone has that for its only mode, to the fit's own error."""
    old = 10.0 * grid(9)
    found = old_map(ControlPoints(old, 1000.0 * (old + [0.02, 0.0] * old**2)), model="polynomial2")
    assert (found.modes.words[0], found.modes.shares[0]) == ("horizontal", pytest.approx(1.0, abs=1e-9))
    # ln(1 + .04 x) about its mean, x even from 0 to 10.
    logs = np.log1p(0.04 * (np.arange(100_000) + 0.5) / 10_000)
    assert found.modes.rms[0] == pytest.approx(logs.std(), rel=1e-4)
    assert found.to_dict()["modes"][0]["words"] == "horizontal"


def test_scale_and_turn_of_a_scan():
    """A map 1 : 50,000, scanned with 300 dots per inch and turned clockwise by 10 degrees, is told so."""
    truth = grid(5) * [9000.0, 6000.0]
    angle, dots = np.radians(10.0), 300.0 / 0.0254 / 50_000.0
    east, north = truth.T
    right, up = np.cos(angle) * east + np.sin(angle) * north, -np.sin(angle) * east + np.cos(angle) * north
    points = ControlPoints(dots * np.stack([right, -up], -1) + 500.0, truth)
    found = old_map(points, model="affine", dots_per_inch=300.0)
    assert (found.is_mirrored, "y axis points down" in found.notes[0]) == (True, True)
    for one in found.to_dict()["rectifications"].values():
        told = [one[name] for name in ("denominator", "rotation", "stretch")]
        np.testing.assert_allclose(told, [50_000.0, 10.0, 1.0], rtol=1e-9)
    refuses(r"Invalid dots per inch '0'. They must be positive", old_map, found.points, dots_per_inch=0.0)


@each("flip", [1.0, -1.0])
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
        told = found.rectifications[name].scale_error, found.rectifications[name].rotation_error
        assert told == pytest.approx((error, np.degrees(error / abs(a))), rel=1e-9)
    exact = old_map(ControlPoints(old[[0, 1, 2]], new[[0, 1, 2]]), model="affine")
    assert exact.to_dict()["rectifications"]["affine"]["scale_error"] is None
    # Without the scan's resolution there is no denominator.
    assert exact.denominator(2.0) is None
    assert exact.to_dict()["rectifications"]["mdt"]["denominator"] is None


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
