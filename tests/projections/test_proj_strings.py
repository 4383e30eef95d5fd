"""PROJ strings: what is written is what is mapped, in any order, and a projection's definition gives it back."""

import math

import numpy as np
import pyproj.list
import pytest
from hypothesis import given
from hypothesis import strategies as st

from projdist import Projection, ProjectionError
from projdist.projections import with_parameters
from projdist.projections.catalogue import NOT_IN_METRES, NOT_MAPS

LON, LAT = np.meshgrid(np.linspace(-150.0, 170.0, 9), np.linspace(-70.0, 85.0, 7))
SAME = 1e-6  # metres: twelve digits of 1e7 m, lost twice

Parameters = dict[str, float]

CONICS = st.fixed_dictionaries(
    {
        "lat_1": st.floats(5.0, 35.0),
        "lat_2": st.floats(36.0, 80.0),
        "lat_0": st.floats(-60.0, 60.0),
        "lon_0": st.floats(-180.0, 180.0),
        "x_0": st.floats(-1e7, 1e7),
        "y_0": st.floats(-1e7, 1e7),
        "R": st.floats(1e6, 7e6),
    }
)


def rounded(parameters: Parameters) -> Parameters:
    """With nine decimals: numbers that a string without exponents holds."""
    return {key: round(value, 9) for key, value in parameters.items()}


def written(parameters: Parameters) -> list[str]:
    return [f"+{key}={value:.9f}" for key, value in parameters.items()]


def read(definition: str) -> Parameters:
    """The numbers of a PROJ string."""
    pairs = (token.lstrip("+").partition("=") for token in definition.split())
    return {key: float(value) for key, _, value in pairs if key not in ("proj", "type")}


def lambert(parameters: Parameters) -> tuple[np.ndarray, np.ndarray]:
    """The conformal conic on the sphere (Snyder 1987, equations 15-1 to 15-5)."""
    one, two, start = (math.radians(parameters[key]) for key in ("lat_1", "lat_2", "lat_0"))

    def tangent(lat: float | np.ndarray) -> float | np.ndarray:
        return np.tan(math.pi / 4 + lat / 2)

    n = math.log(math.cos(one) / math.cos(two)) / math.log(tangent(two) / tangent(one))
    factor = parameters["R"] * math.cos(one) * tangent(one) ** n / n
    rho, rho_0 = factor / tangent(np.radians(LAT)) ** n, factor / tangent(start) ** n
    theta = n * np.radians((LON - parameters["lon_0"] + 180.0) % 360.0 - 180.0)
    return parameters["x_0"] + rho * np.sin(theta), parameters["y_0"] + rho_0 - rho * np.cos(theta)


def clear_of_the_seam(parameters: Parameters) -> np.ndarray:
    return np.abs((LON - parameters["lon_0"]) % 360.0 - 180.0) > 1e-6


@given(CONICS.map(rounded), st.randoms(use_true_random=False))
def test_all_parameters_do_what_the_formula_says_in_any_order(parameters: Parameters, random) -> None:
    """Shuffled, they are the same map, that of the formula."""
    words = ["+proj=lcc", *written(parameters)]
    random.shuffle(words)
    found = Projection.from_user_input(" ".join(words))(LON, LAT)
    clear = clear_of_the_seam(parameters)
    for ours, truth in zip(found, lambert(parameters), strict=True):
        np.testing.assert_allclose(ours[clear], truth[clear], rtol=1e-12, atol=SAME)


@given(CONICS.map(rounded))
def test_definitions_give_the_projection_back(parameters: Parameters) -> None:
    """A definition holds all parameters as they were given, and reads as an equal projection."""
    projection = Projection.from_user_input(" ".join(["+proj=lcc", *written(parameters)]))
    assert read(projection.definition) == parameters
    again = Projection.from_user_input(projection.definition)
    assert again == projection
    np.testing.assert_array_equal(again(LON, LAT), projection(LON, LAT))


@given(CONICS.map(rounded), CONICS.map(rounded), st.sets(st.sampled_from(["lat_1", "lat_2", "lat_0", "lon_0", "x_0"])))
def test_changed_parameters_are_those_of_a_new_string(old: Parameters, new: Parameters, changed: set[str]) -> None:
    """Some parameters of a projection replaced give the projection whose string had them from the start."""
    changes = {key: new[key] for key in changed}
    projection = with_parameters(Projection.from_user_input(" ".join(["+proj=lcc", *written(old)])), changes)
    assert read(projection.definition) == pytest.approx(old | changes, rel=0.0, abs=1e-12)
    again = Projection.from_user_input(" ".join(["+proj=lcc", *written(old | changes)]))
    np.testing.assert_array_equal(projection(LON, LAT), again(LON, LAT))


USUAL = "+lat_1=30 +lat_2=50 +lat_0=10 +lon_0=5 +lon_1=10 +lon_2=30"
OTHERS = (
    *("", USUAL, "+lat_1=10 +lat_ts=30 +alpha=30 +lonc=5", "+h=35785831 +n=0.5 +m=1 +W=2 +q=1 +lsat=3 +path=5"),
    *("+o_proj=moll +o_lat_p=30", "+plat_0=10 +plon_0=5 +phdg_0=30 +path=5"),
    f"{USUAL} +lat_3=20 +lon_3=-20",
)


@pytest.mark.filterwarnings("ignore::projdist.Notice")  # of parameters that a map has no use for
def test_operations_alone_take_angles_to_a_plane() -> None:
    """So they need not be asked: of angles in degrees and in radians they make the same lengths, all that are
    taken."""
    taken = set()
    for name in pyproj.list.get_proj_operations_map():
        for parameters in OTHERS:
            try:
                function = Projection.from_user_input(f"+proj={name} {parameters}").function
            except ProjectionError:
                continue
            taken.add(name)
            in_degrees = np.array(function.transformer.transform(LON, LAT))
            in_radians = np.array(function.transformer.transform(np.radians(LON), np.radians(LAT), radians=True))
            np.testing.assert_allclose(in_degrees, in_radians, rtol=1e-9, atol=SAME)  # a turn to radians is rounded
    assert {*pyproj.list.get_proj_operations_map()} - taken == {*NOT_MAPS, *NOT_IN_METRES, "pipeline"}
