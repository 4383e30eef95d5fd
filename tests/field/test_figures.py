"""The registry of figures: one definition behind measuring, ranking and optimising."""

import math

import numpy as np
import pytest
from tables import each

from projdist import FIGURES, Figure, field_of, get_figure, get_measure, sample

BELT = "box:-20,0,20,60"


@pytest.fixture(scope="module")
def field():
    """The plate carree's over a belt: a = k = 1 / cos(lat), b = h = 1."""
    measures = [figure.measure for figure in FIGURES.values()]
    return sample("plate-carree", BELT, measures=measures, tolerance=1e-9)


NODE, WEIGHT = np.polynomial.legendre.leggauss(200)  # a fine rule, over the belt's latitudes
COSINE = np.cos(math.radians(30) * (1.0 + NODE))


def by_area(function):
    """The mean over the belt of functions of 1 / cos(lat)."""
    return np.sum(WEIGHT * COSINE * function(1.0 / COSINE)) / np.sum(WEIGHT * COSINE)


def omega(k):
    return np.degrees(2.0 * np.arcsin((k - 1.0) / (k + 1.0)))


def logarithm_less_its_mean(k):
    return np.log(k) - by_area(np.log)


def over_directions(term):
    """The root of the mean over the belt and all directions of the square of a term of the scale."""
    angle = np.pi * (np.arange(400) + 0.5) / 400

    def mean(k):
        return np.mean(term(np.hypot(k[:, None] * np.cos(angle), np.sin(angle))) ** 2, axis=-1)

    return math.sqrt(by_area(mean))


TRUTHS = {
    "airy_kavrayskiy": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "airy_kavrayskiy_scaled": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2) - 0.5 * by_area(np.log) ** 2),
    "airy_kavrayskiy_affine": lambda: math.sqrt(by_area(lambda k: logarithm_less_its_mean(k) ** 2)),
    "kavrayskiy": lambda: math.sqrt(0.5 * by_area(lambda k: np.log(k) ** 2)),
    "airy": lambda: math.sqrt(0.5 * by_area(lambda k: (k - 1.0) ** 2)),
    "airy_balance": lambda: math.sqrt(by_area(lambda k: (k - 1.0) ** 2)),
    "jordan": lambda: over_directions(lambda scale: scale - 1.0),
    "jordan_kavrayskiy": lambda: over_directions(np.log),
    "klingatsch_angles": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "klingatsch_areas": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "canters_ab": lambda: by_area(lambda k: 0.5 * (k - 1.0)),
    "canters_ar": lambda: by_area(lambda k: k - 1.0),
    "isotropy": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "kunimune_shape": lambda: by_area(np.log),
    "rms_scale_error_ppm": lambda: 1e6 * math.sqrt(by_area(lambda k: (k - 1.0) ** 2)),
    "max_scale_error_ppm": lambda: 1e6,
    "mean_scale_error_ppm": lambda: 1e6 * by_area(lambda k: k - 1.0),
    "max_log_scale": lambda: math.log(2.0),
    "angular_distortion": lambda: math.sqrt(by_area(lambda k: omega(k) ** 2)),
    "max_omega": lambda: omega(2.0),
    "mean_omega": lambda: by_area(omega),
    "log_areal_scale": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "max_areal_error_ppm": lambda: 1e6,
    "mean_areal_error_ppm": lambda: 1e6 * by_area(lambda k: k - 1.0),
}


@each("name", FIGURES)
def test_closed_forms(field, name):
    """Each figure of the plate carree, all of whose matrices commute, is an integral over latitude."""
    found, truth = field.figure(name), TRUTHS[name]()
    # Means of measures with kinks are resolved to 1e-6 of themselves; the lattice of extremes is exact here.
    assert found.value == pytest.approx(truth, rel=1e-6)
    assert abs(found.value - truth) <= found.error + 1e-12 * truth


@each("name", FIGURES)
def test_at_nodes(name):
    """Of Jacobians with weights: here at the nodes of a fine rule, with the ends for largest values."""
    cosine = np.append(COSINE, [1.0, 0.5])
    J = np.zeros((cosine.size, 2, 2))
    J[:, 0, 0], J[:, 1, 1] = 1.0 / cosine, 1.0
    assert FIGURES[name](J, np.append(WEIGHT, [0.0, 0.0]) * cosine) == pytest.approx(TRUTHS[name](), rel=1e-9)


def test_functions_are_figures(field):
    """The mean of a function of J, or what a figure of your own says; equal to the one with a name."""

    def anamorphosis(J):
        return np.linalg.det(J)

    assert field.figure(anamorphosis).value == pytest.approx(by_area(lambda k: k), rel=1e-6)
    assert field.figure(get_measure("s")).value == pytest.approx(by_area(lambda k: k), rel=1e-6)
    for statistic, truth in (("max", 2.0), ("rms", math.sqrt(by_area(lambda k: k**2)))):
        own = Figure(name="anamorphosis", measure=anamorphosis, statistic=statistic)
        assert field.figure(own).value == pytest.approx(truth, rel=1e-6)
    found = field_of([np.diag([2.0, 3.0]), np.diag([1.0, 1.0])], weight=[1, 4]).figure(anamorphosis)
    assert found.value == pytest.approx(2.0, rel=1e-12)


def test_wrong_figures():
    """Second derivatives are for indices, other statistics for `Field.statistic`, versions for fisher's RMS."""
    with pytest.raises(ValueError, match=r"^Invalid figure 'flexion'\. Its measure must be one of J, not of second"):
        get_figure(get_measure("flexion"))
    with pytest.raises(ValueError, match=r"^Invalid statistic 'median'\. .*It must be one of rms, mean, max\.$"):
        Figure(name="mine", measure="omega", statistic="median")
    with pytest.raises(ValueError, match=r"^Invalid figure 'mine'\. It must be the RMS of fisher"):
        Figure(name="mine", measure="omega", statistic="rms", version="scaled")


@each("name", FIGURES)
def test_each_is_defined(name):
    """With a description, a source, a measure, and that measure's unit."""
    figure = FIGURES[name]
    assert figure.description.endswith(".")
    assert figure.source
    assert get_measure(figure.measure).unit == figure.unit
    assert get_figure(figure) is get_figure(name) is figure


def test_unknown_figures():
    """One line with what was meant, and what there is."""
    for name, message in (
        ("max_omga", "Did you mean max_omega.* It must be one of "),
        (5, "It must be one of airy_kavrayskiy, .*, or a function"),
    ):
        with pytest.raises(ValueError, match=rf"^Invalid criterion '{name}'\. {message}"):
            get_figure(name)


# ---- of matrices -----------------------------------------------------------------------------

RNG = np.random.default_rng(5)
WEIGHTS = np.full(40, 1 / 40)


def rotations():
    """Random ones, which change no figure."""
    angle = RNG.uniform(0, 2 * np.pi, 40)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)


def turned(a, b):
    """Matrices with principal scales a and b."""
    return rotations() @ (np.stack([a, b], axis=-1)[:, :, None] * np.eye(2))


def test_of_matrices():
    """Every figure, rewritten for diagonal matrices."""
    a, b = RNG.uniform(1.0, 1.1, 40), RNG.uniform(0.9, 1.0, 40)
    weights = RNG.uniform(0, 1, 40)
    weights /= weights.sum()
    square, log_s = np.log(a) ** 2 + np.log(b) ** 2, np.log(a * b)
    omega = np.degrees(2 * np.arcsin((a - b) / (a + b)))
    ppm = 1e6 * np.maximum(a - 1, 1 - b)
    areal = 1e6 * np.abs(a * b - 1)
    expected = {
        "airy_kavrayskiy": np.sqrt(weights @ square),
        "airy_kavrayskiy_scaled": np.sqrt(weights @ square - (weights @ log_s) ** 2 / 2),
        "max_scale_error_ppm": ppm.max(),
        "mean_scale_error_ppm": weights @ ppm,
        "max_omega": omega.max(),
        "mean_omega": weights @ omega,
        "max_areal_error_ppm": areal.max(),
        "mean_areal_error_ppm": weights @ areal,
    }
    J = turned(a, b)
    for name, value in expected.items():
        np.testing.assert_allclose(FIGURES[name](J, weights), value, rtol=1e-9, err_msg=name)


def test_affine_figure():
    """One linear map for all has no affine error, and the affine figure is never above the scaled one."""
    J = np.tile(np.array([[1.3, 0.2], [0.1, 0.8]]), (40, 1, 1)) @ rotations()
    assert FIGURES["airy_kavrayskiy_affine"](J, WEIGHTS) < 1e-7
    J = turned(RNG.uniform(1.0, 1.2, 40), RNG.uniform(0.9, 1.0, 40))
    assert FIGURES["airy_kavrayskiy_affine"](J, WEIGHTS) <= FIGURES["airy_kavrayskiy_scaled"](J, WEIGHTS) + 1e-12
