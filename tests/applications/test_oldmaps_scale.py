"""The scale and the turn of old maps, and their standard errors."""

import numpy as np
import pytest
from old_map_points import grid, scattered, sheets
from refusals import refuses

from projdist.applications.oldmaps import ControlPoints, fit, old_map


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
    refuses(r"Invalid dots per inch '0'. They must be positive", old_map, found.points, dots_per_inch=0.0)


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
