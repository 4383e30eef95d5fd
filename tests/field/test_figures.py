"""The registry of figures: one definition behind measuring, ranking and optimising."""

import math

import numpy as np
import pytest

from projdist import FIGURES, OBJECTIVES, get_figure, get_measure, sample
from projdist.decisions.recommendation.rankings import RANKINGS

BELT = "box:-20,0,20,60"


@pytest.fixture(scope="module")
def field():
    """The plate carree's over a belt: a = k = 1 / cos(lat), b = h = 1."""
    measures = [figure.measure for figure in FIGURES.values()]
    return sample("plate-carree", BELT, measures=measures, tolerance=1e-9)


def by_area(function):
    """The mean over the belt by a fine rule of Gauss, of functions of 1 / cos(lat)."""
    node, weight = np.polynomial.legendre.leggauss(200)
    lat = math.radians(30) * (1.0 + node)
    return np.sum(weight * np.cos(lat) * function(1.0 / np.cos(lat))) / np.sum(weight * np.cos(lat))


def omega(k):
    return np.degrees(2.0 * np.arcsin((k - 1.0) / (k + 1.0)))


def logarithm_less_its_mean(k):
    return np.log(k) - by_area(np.log)


TRUTHS = {
    "airy_kavrayskiy": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2)),
    "airy_kavrayskiy_scaled": lambda: math.sqrt(by_area(lambda k: np.log(k) ** 2) - 0.5 * by_area(np.log) ** 2),
    "airy_kavrayskiy_affine": lambda: math.sqrt(by_area(lambda k: logarithm_less_its_mean(k) ** 2)),
    "kavrayskiy": lambda: math.sqrt(0.5 * by_area(lambda k: np.log(k) ** 2)),
    "airy": lambda: math.sqrt(0.5 * by_area(lambda k: (k - 1.0) ** 2)),
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


@pytest.mark.parametrize("name", FIGURES)
def test_closed_forms(field, name):
    """Each figure of the plate carree, all of whose matrices commute, is an integral over latitude."""
    found, truth = field.figure(name), TRUTHS[name]()
    # Means of measures with kinks are resolved to 1e-6 of themselves; the lattice of extremes is exact here.
    assert found.value == pytest.approx(truth, rel=1e-6)
    assert abs(found.value - truth) <= found.error + 1e-12 * truth


def test_rankings_and_objectives_are_views():
    """They take their names, units and words from the registry."""
    assert set(RANKINGS) <= set(FIGURES)
    assert set(OBJECTIVES) <= set(FIGURES)
    assert all(one.of is FIGURES[name] for name, one in RANKINGS.items())
    assert all(one.figure is FIGURES[name] for name, one in OBJECTIVES.items())


@pytest.mark.parametrize("name", FIGURES)
def test_each_is_defined(name):
    """With a description, a source, a measure, and that measure's unit."""
    figure = FIGURES[name]
    assert figure.description.endswith(".")
    assert figure.source
    assert get_measure(figure.measure).unit == figure.unit
    assert get_figure(figure) is get_figure(name) is figure


def test_unknown_figures():
    """One line with what was meant, and what there is."""
    with pytest.raises(
        ValueError, match=r"^Invalid criterion 'max_omga'\. Did you mean max_omega.* It must be one of "
    ):
        get_figure("max_omga")
    with pytest.raises(ValueError, match=r"^Invalid criterion '5'\. It must be one of airy_kavrayskiy, "):
        get_figure(5)
