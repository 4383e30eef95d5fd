"""Pointwise measures against numpy's SVD, quadrature, closed forms and theorems."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st
from matrix_samples import MATRICES, MIRROR, POINTWISE, SECOND_ORDER, jacobians, rotation, value
from refusals import refuses
from tables import each

from projdist.matrices.measures import (
    ALIASES,
    MEASURES,
    Measure,
    decompose,
    factors_of,
    get_measure,
    log_scales,
    principal_scales,
)

EPS = np.finfo(float).eps
RNG = np.random.default_rng(20240229)

# Functions of the singular values alone: they do not see rotations or mirrors of the map or of the Earth.
OF_SCALES = (
    "fisher areal_scale tissot_semimajor tissot_semiminor angular_distortion log_anisotropy log_areal_scale airy "
    "kavrayskiy jordan jordan_kavrayskiy scale_error_ppm areal_error_ppm"
).split()
# These are about the graticule: a rotation or mirror of the map, but not of the Earth, leaves them.
OF_GRATICULE = ["meridional_scale", "parallel_scale", "meridian_parallel_angle"]
# Undefined where the map is singular: they hold the logarithm of the lesser scale, which is 0.
LOGARITHMIC = ["fisher", "log_anisotropy", "log_areal_scale", "kavrayskiy"]


@each("n", [1, 2, 3, 5])
def test_principal_scales_are_singular_values(n):
    """They are numpy's, and their logarithms' length is `fisher`, for any dimension and batch; only NaN gives NaN."""
    J = RNG.normal(size=(7, 11, n, n))
    truth = np.linalg.svd(J, compute_uv=False)
    # Rounding is relative to the largest scale.
    np.testing.assert_allclose(principal_scales(J) / truth[..., :1], truth / truth[..., :1], atol=20 * EPS)
    np.testing.assert_allclose(value("fisher", J), np.linalg.norm(np.log(truth), axis=-1), rtol=1e-11)
    J = np.stack([np.eye(n), np.full((n, n), np.nan), 2 * np.eye(n)])
    np.testing.assert_array_equal(principal_scales(J), [[1.0] * n, [np.nan] * n, [2.0] * n])


@pytest.mark.parametrize("size", [1e-6, 1e-10, 1e-13, 1e-15])
def test_exact_near_conformality(size):
    """a, b and omega of a similarity times 1 +- 1e-13 keep all their digits, where a determinant would lose half."""
    with mpmath.workdps(50):
        for angle, perturbation in zip(RNG.uniform(0, 2 * np.pi, 20), RNG.normal(size=(20, 2, 2)), strict=True):
            J = 1.7 * rotation(angle) @ (np.eye(2) + size * perturbation)
            b, a = sorted(mpmath.svd_r(mpmath.matrix(J.tolist()), compute_uv=False))
            omega = 2 * mpmath.asin((a - b) / (a + b))
            # Two additions and a hypotenuse of numbers near 1: 4 roundings, in radians.
            assert abs(math.radians(value("omega", J)) - omega) <= 4 * EPS
            assert max(abs(value("a", J) / a - 1), abs(value("b", J) / b - 1)) <= 4 * EPS


def test_similarities_and_isometries():
    """omega of an exact similarity, mirrored or not, and ln(a/b) are 0; of a rotation every distortion is."""
    for c, s in RNG.normal(size=(50, 2)):
        for J in ([[c, -s], [s, c]], [[c, s], [s, -c]]):
            assert value("omega", J) == value("log_anisotropy", J) == 0.0
    for name in ["airy", "jordan", "scale_error_ppm", "areal_error_ppm", *LOGARITHMIC]:
        result = value(name, rotation(np.linspace(0, 6, 50)))
        # Only rounding of the rotation itself is left.
        np.testing.assert_allclose(result, 0.0, atol=1e-15 * (1e6 if "ppm" in name else 1.0), err_msg=name)


def test_factors_of_similarities():
    """In any direction; numpy's arc tangent says which. Beside other matrices they have the same."""
    angles = RNG.uniform(-np.pi, np.pi, 50)
    J = 1.3 * rotation(angles)
    alone, beside = factors_of(J), factors_of(np.concatenate([J, MATRICES]))
    np.testing.assert_allclose(alone["convergence"], np.degrees(angles), rtol=1e-14)
    for name, truth in {"h": 1.3, "k": 1.3, "a": 1.3, "b": 1.3, "s": 1.69, "omega": 0.0, "theta": 90.0}.items():
        np.testing.assert_allclose(alone[name], truth, rtol=4 * EPS)
    for name, values in beside.items():
        np.testing.assert_allclose(values[:50], alone[name], rtol=4 * EPS, atol=1e-14)
        np.testing.assert_allclose(values, value(name, np.concatenate([J, MATRICES])), rtol=4 * EPS, atol=1e-14)


@each("name", POINTWISE)
def test_batches_and_kinds(name):
    """Matrices (..., 2, 2) give values (...), NaN for NaN, and no singular one infinity; kinds are what they say."""
    for shape in [(), (4,), (2, 0), (2, 3, 4)]:
        assert np.shape(value(name, np.broadcast_to([[1.1, 0.2], [0.3, 0.9]], (*shape, 2, 2)))) == shape
    J = np.stack([MATRICES[0], np.full((2, 2), np.nan), MATRICES[1]])
    result = value(name, J)
    assert np.isnan(result[1])
    np.testing.assert_array_equal(result[[0, 2]], value(name, J[[0, 2]]))
    J = np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 1.0], [0.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]], np.zeros((2, 2))])
    assert not np.isinf(value(name, J)).any()
    kind, values = MEASURES[name].kind, value(name, MATRICES)
    assert kind != "magnitude" or (values >= 0).all()
    assert name != "meridian_parallel_angle" or (values <= 90).all()
    if kind == "ratio":  # doubled with the map, or fourfold for areas
        factor = 4.0 if name == "areal_scale" else 2.0
        np.testing.assert_allclose(value(name, 2.0 * MATRICES), factor * values, rtol=1e-14)


@each("name", [*OF_SCALES, *OF_GRATICULE])
def test_measures_ignore_rotations_and_mirrors(name):
    """Of the map on the sheet; those of the Earth, too, if they are measures of the principal scales."""
    map_by, earth_by = rotation(RNG.uniform(0, 2 * np.pi, (2, len(MATRICES))))
    turned = map_by @ MATRICES
    others = [turned @ earth_by, turned @ MIRROR, np.swapaxes(turned, -1, -2)] if name in OF_SCALES else []
    # Condition below 100: rounding of the lesser scale is 1e2 eps; in ppm, 1e6 times that.
    for J in (turned, MIRROR @ turned, *others):
        np.testing.assert_allclose(value(name, J), value(name, MATRICES), rtol=1e-12, atol=1e-8 * ("ppm" in name))


def test_singular_matrices():
    """Where a direction is flattened, or all are, measures are what is defined, or NaN without a warning."""
    J, zero = np.array([[2.0, 0.0], [0.0, 0.0]]), np.zeros((2, 2))
    expected = {"s": 0.0, "b": 0.0, "a": 2.0, "omega": 180.0, "orientation": 0.0, "h": 0.0, "k": 2.0, "ppm": 1e6}
    assert {name: value(name, J) for name in expected} == pytest.approx(expected, rel=1e-15)
    # |scale - 1| along the azimuth t is |2 |sin t| - 1|, whose mean square is 3 - 8 / pi.
    assert value("jordan", J) == pytest.approx(math.sqrt(3 - 8 / math.pi), rel=1e-14)
    # ln(2 |sin t|) has the Fourier coefficients 1 / k: the mean of its square is pi^2 / 12.
    assert value("jordan_kavrayskiy", J) == pytest.approx(math.pi / math.sqrt(12), rel=1e-14)
    # Where every scale is 0, the errors of scale are 1; where a direction has no image its angle is NaN, not 0.
    assert (value("airy", zero), value("jordan", zero)) == pytest.approx((1.0, 1.0))
    for name in ["angular_distortion", "meridian_parallel_angle", "meridian_convergence"]:
        assert np.isnan(value(name, zero)), name
    for name in LOGARITHMIC:
        assert np.isnan(value(name, np.stack([J / 2, [[0.0, 2.0], [0.0, 0.0]], zero]))).all(), name


@given(J=jacobians(), left=st.floats(-7, 7), right=st.floats(-7, 7))
def test_fisher(J, left, right):
    """fisher(R J Q) = fisher(J) = fisher(J^-1) for rotations R and Q (Ozeri: Dist_F sees singular values only)."""
    fisher = float(value("fisher", J))
    # b is known to eps a: up to 1e4 eps relative.
    assert value("fisher", rotation(left) @ J @ rotation(right)) == pytest.approx(fisher, abs=1e-10)
    assert value("fisher", np.linalg.inv(J)) == pytest.approx(fisher, abs=1e-10)
    # ln^2(a/b) + ln^2(ab) = 2 (ln^2 a + ln^2 b), and kavrayskiy is fisher / sqrt(2).
    parts = value("log_anisotropy", J) ** 2 + value("log_areal_scale", J) ** 2
    assert parts == pytest.approx(2 * fisher**2, rel=1e-9, abs=1e-12)
    assert value("kavrayskiy", J) * math.sqrt(2) == pytest.approx(fisher, rel=1e-14)
    assert value("fisher", J.tolist()) == fisher  # lists are taken as matrices


@given(J=jacobians(), azimuth=st.floats(-720, 720))
def test_scales_and_angles(J, azimuth):
    """a and b are the singular values, also of ill-conditioned and mirroring matrices, and the others follow."""
    truth = np.linalg.svd(J, compute_uv=False)
    h, k, a, b, s = (float(value(name, J)) for name in ("h", "k", "a", "b", "s"))
    assert max(abs(a - truth[0]), abs(b - truth[1])) <= 20 * EPS * truth[0]
    # h^2 + k^2 = a^2 + b^2 and h k sin(theta') = a b (Snyder 1987, 4-10 and 4-11).
    assert h * h + k * k == pytest.approx(a * a + b * b, rel=1e-13)
    assert h * k * math.sin(math.radians(value("theta", J))) == pytest.approx(s, rel=1e-12)
    # a b is known to eps a^2, for b is known to eps a.
    assert s == pytest.approx(a * b, abs=20 * EPS * a * a)
    # sin(omega / 2) = (a - b) / (a + b) (Snyder 1987, 4-9).
    sine = (truth[0] - truth[1]) / truth.sum()
    assert math.sin(math.radians(value("omega", J)) / 2) == pytest.approx(sine, abs=1e-14)
    # scale@azimuth is |J t| for t that many degrees clockwise from north.
    t = np.array([math.sin(math.radians(azimuth)), math.cos(math.radians(azimuth))])
    scale = float(value(f"scale@{azimuth}", J))
    assert scale == pytest.approx(float(np.linalg.norm(J @ t)), rel=1e-10)
    assert b * (1 - 1e-10) - 1e-12 <= scale <= a * (1 + 1e-12)
    # scale_error_ppm is the largest |scale - 1| over the azimuths, in millionths.
    # Every half degree: between, the scale differs from its extremes by (0.25 deg)^2 / 2 = 1e-5 of a^2 / b.
    azimuths = np.arange(0, 180, 0.5)
    scales = np.array([value(f"scale@{azimuth}", J) for azimuth in azimuths[::8]])
    ppm = float(value("ppm", J))
    assert ppm >= 1e6 * np.abs(scales - 1).max() * (1 - 1e-12) - 1e-6
    a, b = truth
    assert ppm == pytest.approx(1e6 * max(abs(a - 1), abs(b - 1)), rel=1e-9, abs=1e-6)
    assert value("areal_error_ppm", J) == pytest.approx(1e6 * abs(a * b - 1), rel=1e-9, abs=1e-5)
    # Jordan's term, a mean over the azimuths, is at most the largest |scale - 1|.
    assert value("jordan", J) <= 1e-6 * ppm * (1 + 1e-12) + 1e-14


def test_closed_forms():
    """The convergence of turned maps, the orientation of a rotation and a mirror, Airy's term, and scales."""
    for angle in [-170.0, -90.0, -20.0, 0.0, 1.6786477, 45.0, 179.0]:
        # True north points up and to the left on the sheet, so grid north (up) is to its right: clockwise.
        assert value("convergence", 1.3 * rotation(math.radians(angle))) == pytest.approx(angle, abs=1e-13)
    assert (value("orientation", rotation(2.0)), value("orientation", MIRROR @ rotation(2.0))) == (1.0, -1.0)
    # Of scales 2 and 1/2 it is sqrt((1 + 1/4) / 2).
    assert value("airy", np.diag([0.5, -2.0])) == pytest.approx(math.sqrt(0.625), rel=1e-15)
    # scale@0 is h and scale@90 is k; scale@45 of a shear is that of the north-east.
    np.testing.assert_allclose(value("scale@0", MATRICES), value("h", MATRICES), rtol=1e-14)
    np.testing.assert_allclose(value("scale@-90", MATRICES), value("k", MATRICES), rtol=1e-13)
    scales = [value(name, [[1.0, 1.0], [0.0, 1.0]]) for name in ("scale@45", "scale@-45")]
    np.testing.assert_allclose(scales, np.sqrt([2.5, 0.5]), rtol=1e-14)


# a, b: near 1, around the change of method at ((a - b) / (a + b))^2 = 0.05 (a / b = 1.576), and far.
JORDAN = [(1 + 1e-9, 1 - 2e-9), (1 + 1e-5, 1.0), (1.1, 0.95), (1.575, 1.0), (1.577, 1.0), (3.0, 0.2), (50.0, 1e-3)]


@each(("a", "b"), JORDAN)
def test_jordan_against_quadrature(a, b):
    """Jordan's term is sqrt(mean over azimuths of (scale - 1)^2), by mpmath's quadrature, also for scales near 1."""
    with mpmath.workdps(25):
        A, B = mpmath.mpf(a), mpmath.mpf(b)

        def square(t):
            return (mpmath.hypot(A * mpmath.cos(t), B * mpmath.sin(t)) - 1) ** 2

        breaks = [0, mpmath.pi / 4, mpmath.pi / 2 - mpmath.mpf(B) / A, mpmath.pi / 2]
        truth = float(mpmath.sqrt(2 / mpmath.pi * mpmath.quad(square, sorted(breaks))))
    # The scales themselves are rounded to eps, which is eps / truth of a term as small as truth.
    result = value("jordan", rotation(0.3) @ np.diag([a, b]) @ rotation(1.1))
    assert result == pytest.approx(truth, rel=1e-13 + 8 * EPS / truth)


@each("a", [637.1556165, 322.91080479, 121.62964773, 1.0])
@each("b", [9.23705556e-14, 5.68434189e-14, 2.84217094e-14, 0.0])
def test_jordan_of_nearly_singular_maps(a, b):
    """The mean of (a |cos z| - 1)^2 is a^2 / 2 - 4 a / pi + 1; rounding makes no ellipse flatter than a line."""
    expected = math.sqrt(a * a / 2 - 4 * a / math.pi + 1)
    for scale in (1.0, 1.001, 0.999):
        assert value("jordan", np.diag([a, scale * b])) == pytest.approx(expected, rel=1e-9)


# The textbooks' symbols, and what pyproj's Factors names the measures.
SYMBOLS = (
    "h meridional_scale, k parallel_scale, s areal_scale, a tissot_semimajor, b tissot_semiminor, "
    "omega angular_distortion, theta meridian_parallel_angle, convergence meridian_convergence, ppm scale_error_ppm, "
    "max_scale tissot_semimajor, min_scale tissot_semiminor"
).split(", ")


def test_registry_is_consistent():
    """The lists of this module hold every measure, so that a new one is tested."""
    others = {"meridian_convergence", "orientation"}
    assert set(OF_SCALES) | set(OF_GRATICULE) | others == set(POINTWISE)
    assert set(SECOND_ORDER) == {"flexion", "skewness"}
    # Names are their keys, aliases lead to names and hide none, kinds are known, and each has a description.
    for symbol, name in map(str.split, SYMBOLS):
        assert get_measure(symbol) is MEASURES[name]
    for name, measure in MEASURES.items():
        assert measure.name == name
        assert get_measure(name) is get_measure(measure) is measure
        assert measure.kind in ("ratio", "signed", "magnitude")
        assert measure.description.endswith((".", ")", "degrees"))
        assert len(measure.description) > 15
    listed = ALLOWED.split("one of ")[1].split(", ...")[0].split(", ")
    assert {get_measure(name).name for name in listed} <= set(MEASURES)
    assert set(ALIASES.values()) <= set(MEASURES)
    assert not set(ALIASES) & set(MEASURES)


def test_a_callable_is_a_measure():
    """A function of J is a measure under its own name; a Measure stays itself."""

    def shear(J):
        return J[..., 0, 1]

    measure = get_measure(shear)
    assert (measure.name, measure.kind, measure.needs_hessian) == ("shear", "magnitude", False)
    np.testing.assert_array_equal(measure(MATRICES), MATRICES[:, 0, 1])
    np.testing.assert_array_equal(measure([[1, 5], [0, 1]]), 5.0)
    named = Measure("mine", shear, "m", kind="signed")
    assert get_measure(named) is named


# A mistyped name, and the suggestions: all of them, in their order.
TYPOS = {
    "fischer": "fisher",
    "omgea": "omega",
    "Omega": "omega",
    "areal": "areal_scale or areal_error_ppm",
    "tissot-semimajor": "tissot_semimajor",
    "angular distorsion": "angular_distortion",
    "scale": "scale_error_ppm or scale@AZIMUTH",
}
ALLOWED = (
    "It must be one of fisher, h, k, s, a, b, omega, ... (see 'projdist list measures', or projdist.MEASURES), "
    "scale@AZIMUTH, or a function of J."
)


def message(wrong):
    with pytest.raises(ValueError, match=r"^Invalid measure '") as error:
        get_measure(wrong)
    return str(error.value)


def test_unknown_measures_are_told_close_names():
    """What was nearly typed, begun or written otherwise is suggested; what is like no name, or is none, has no hint."""
    for text, near in TYPOS.items():
        assert message(text) == f"Invalid measure '{text}'. Did you mean {near}? {ALLOWED}"
    for wrong in ("", "qqq", "hh", "nonsense", "mercator", "of", 5, None, ["h"]):
        assert message(wrong) == f"Invalid measure '{wrong}'. {ALLOWED}"


def test_arguments_are_checked():
    """J is square, scale@ takes a finite number of degrees, and flexion and skewness take H."""
    for shape in [(2,), (2, 3), (4, 2, 1)]:
        refuses(r"^Invalid Jacobian shape \(.*\)\. The last two axes must be equal", principal_scales, np.ones(shape))
    for text in ["", "north", "nan", "inf", "4 5"]:
        match = rf"^Invalid azimuth '{text}' in 'scale@{text}'\. It must be a number of degrees, as in scale@45\.$"
        refuses(match, get_measure, f"scale@{text}")
    for name in SECOND_ORDER:
        match = rf"^Invalid call of measure '{name}'\. It needs the second derivatives H as well\.$"
        refuses(match, get_measure(name), np.eye(2))


def test_log_scales_shear_and_rotation():
    """ln^2 a + ln^2 b and ln(ab) of a diagonal matrix, NaN for a singular one."""
    square, area = log_scales(np.array([np.diag([2.0, 4.0]), np.diag([2.0, 0.0])]))
    np.testing.assert_allclose([square, area], [[5 * math.log(2) ** 2, np.nan], [3 * math.log(2), np.nan]], rtol=1e-6)
    # The shear is what the axes' images lack to a right angle, the rotation that of the vertical.
    x, y = rotation(math.radians(50.0)) @ [0.0, 1.0], rotation(-math.radians(20.0)) @ [0.0, 1.0]
    for mirror in (1.0, -1.0):
        parts = decompose(np.column_stack([-mirror * x, 2.0 * y]))
        assert (abs(parts.shear), parts.rotation) == pytest.approx((20.0, 20.0), abs=1e-12)
    # Of a turn and a scale no direction is stretched; what is undefined is NaN.
    parts = decompose(np.stack([2.0 * rotation(-math.radians(33.0)), np.full((2, 2), np.nan)]))
    np.testing.assert_allclose(parts.stretch, [1.0, np.nan], rtol=1e-15)
    assert np.isnan(parts.stretch_azimuth).all()


@each("azimuth", [0.0, 30.0, 90.0, 135.0, 179.0])
@each("turned", [0.0, 25.0, -160.0])
def test_stretch(azimuth, turned):
    """A stretch along an azimuth, a scale and a turn after it are told apart."""
    stretch = rotation(-math.radians(azimuth)) @ np.diag([1.0, 1.5]) @ rotation(-math.radians(azimuth)).T
    parts = decompose(0.3 * rotation(-math.radians(turned)) @ stretch)
    assert (parts.scale, parts.stretch) == pytest.approx((0.3 * np.sqrt(1.5), 1.5), rel=1e-14)
    assert parts.stretch_azimuth == pytest.approx(azimuth, abs=1e-12)
