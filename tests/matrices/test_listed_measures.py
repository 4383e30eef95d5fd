"""The registry of measures."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from measured_matrices import MATRICES, POINTWISE, SECOND_ORDER, jacobians, value
from refusals import refuses
from tables import each

from projdist.matrices.measures import ALIASES, MEASURES, Measure, get_measure, log_scales

RNG = np.random.default_rng(20240229)

SYMBOLS = {
    "h": "meridional_scale",
    "k": "parallel_scale",
    "s": "areal_scale",
    "a": "tissot_semimajor",
    "b": "tissot_semiminor",
    "omega": "angular_distortion",
    "theta": "meridian_parallel_angle",
    "convergence": "meridian_convergence",
    "ppm": "scale_error_ppm",
    "max_scale": "tissot_semimajor",
    "min_scale": "tissot_semiminor",
}


@each(("symbol", "name"), SYMBOLS.items())
def test_symbols_and_aliases(symbol, name):
    """The textbooks' symbols find the measures that pyproj's Factors names."""
    assert get_measure(symbol) is MEASURES[name]


def test_registry_is_consistent():
    """Names are their keys, aliases lead to names and hide none, kinds are known, and each has a description."""
    for name, measure in MEASURES.items():
        assert measure.name == name
        assert get_measure(name) is get_measure(measure) is measure
        assert measure.kind in ("ratio", "signed", "magnitude")
        assert measure.description.endswith((".", ")", "degrees"))
        assert len(measure.description) > 15
    assert set(ALIASES.values()) <= set(MEASURES)
    assert not set(ALIASES) & set(MEASURES)


@each("name", [name for name in POINTWISE if MEASURES[name].kind == "magnitude"])
def test_magnitudes_are_not_negative(name):
    """A measure of the kind "magnitude" is never below 0."""
    assert (value(name, MATRICES) >= 0).all()


@pytest.mark.parametrize("name", [name for name in POINTWISE if MEASURES[name].kind == "ratio"])
def test_ratios_scale_with_the_map(name):
    """A ratio of a doubled map is doubled, or fourfold for areas."""
    factor = 4.0 if name == "areal_scale" else 2.0
    np.testing.assert_allclose(value(name, 2.0 * MATRICES), factor * value(name, MATRICES), rtol=1e-14)


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


@each("text", TYPOS)
def test_unknown_measures_are_told_close_names(text):
    """What was nearly typed, begun, or written otherwise is suggested, and where the others are listed."""
    assert message(text) == f"Invalid measure '{text}'. Did you mean {TYPOS[text]}? {ALLOWED}"


@each("text", ["", "qqq", "hh", "nonsense", "mercator", "of"])
def test_nonsense_has_no_hint(text):
    """What is like no name has none suggested."""
    assert message(text) == f"Invalid measure '{text}'. {ALLOWED}"


@pytest.mark.parametrize("wrong", [5, None, ["h"]])
def test_what_is_no_measure_at_all_is_refused(wrong):
    """A number, None or a list is refused as a name would be, by ValueError."""
    assert message(wrong) == f"Invalid measure '{wrong}'. {ALLOWED}"


@each("name", ["fisher", "h", "k", "s", "a", "b", "omega"])
def test_the_measures_of_the_message_exist(name):
    """The measures that an error message names are measures."""
    assert get_measure(name).name in MEASURES


@pytest.mark.parametrize("text", ["", "north", "nan", "inf", "4 5"])
def test_azimuths_are_checked(text):
    """scale@ takes a finite number of degrees."""
    match = rf"^Invalid azimuth '{text}' in 'scale@{text}'\. It must be a number of degrees, as in scale@45\.$"
    refuses(match, get_measure, f"scale@{text}")


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_second_derivatives_are_asked_for(name):
    """Flexion and skewness without H are refused."""
    match = rf"^Invalid call of measure '{name}'\. It needs the second derivatives H as well\.$"
    refuses(match, get_measure(name), np.eye(2))


@given(J=jacobians())
def test_lists_are_taken_as_matrices(J):
    """A nested list is as good as an array."""
    assume(np.isfinite(J).all())
    assert value("fisher", J.tolist()) == value("fisher", J)


def test_log_scales():
    """ln^2 a + ln^2 b and ln(ab) of a diagonal matrix, NaN for a singular one."""
    square, area = log_scales(np.array([np.diag([2.0, 4.0]), np.diag([2.0, 0.0])]))
    assert square[0] == pytest.approx(5 * math.log(2) ** 2)
    assert area[0] == pytest.approx(3 * math.log(2))
    assert np.isnan([square[1], area[1]]).all()
