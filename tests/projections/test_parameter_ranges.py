"""The table of parameters against PROJ itself: its defaults, what it takes, what changes a map, and none is missing."""

import numpy as np
import pyproj.exceptions
import pyproj.list
import pytest
from projection_points import make, mostly_slow
from pyproj import Transformer
from tables import each

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS
from projdist.projections import ProjectionError, projection_names, tunable, tuned
from projdist.projections.catalogue import NEEDED_PARAMETERS, NOT_IN_METRES, NOT_MAPS
from projdist.projections.proj_strings import ANGLES, NUMBERS, WHOLE_NUMBERS

R = f"+R={MEAN_EARTH_RADIUS}"
OPERATIONS = sorted({*pyproj.list.get_proj_operations_map()} - NOT_MAPS - {*NOT_IN_METRES})
# Their numbers are constants of the map; a UTM zone is a transverse Mercator map with other ones.
WITHOUT = {"alsk", "bertin1953", "gs48", "gs50", "lee_os", "mil_os", "nzmg", "ups"}
FORMS = [
    *("merc+k_0=1", "cea+k_0=1", "stere+k_0=1", "stere+lat_0=90", "polar-stereographic", "ocea+alpha=30+lonc=10"),
    *(f"+proj=omerc +lat_0=20 +lat_1=10 +lon_1=0 +lat_2=50 +lon_2=40 {R}", f"+proj=omerc +lat_0=40 +gamma=30 {R}"),
    *(f"+proj=lcc +lat_1=40 {R}", "gstmerc+ellps=WGS84"),
    f"+proj=ob_tran +o_proj=hammer +o_lat_p=45 +o_lon_p=20 {R}",
    f"+proj=ob_tran +o_proj=omerc +lat_0=40 +alpha=30 +o_lat_p=50 +o_lon_p=20 {R}",
    f"+proj=ob_tran +o_proj=lsat +lsat=5 +path=177 +o_lat_p=50 +o_lon_p=20 {R}",
    f"+proj=ob_tran +o_proj=moll +o_alpha=20 +o_lon_c=20 +o_lat_c=30 {R}",
    f"+proj=ob_tran +o_proj=moll +o_lon_1=20 +o_lat_1=30 +o_lon_2=50 +o_lat_2=10 {R}",
]
MAPS = [*(f"{name}{NEEDED_PARAMETERS.get(name, '').replace(' ', '')}" for name in OPERATIONS), *FORMS]
# Where PROJ has no map in the middle of a range: cones that are cylinders, and methods that divide by the latitude.
HOLES = {("bonne", "lat_1"), ("ccon", "lat_1"), ("labrd", "lat_0"), ("lcca", "lat_0"), ("ob_tran", "o_lat_1")}
HOLES |= {("lcc", "lat_1"), ("omerc", "lat_1"), ("omerc", "lat_2")}
# Of an oblique line that is given otherwise than by its azimuth at lat_0, it does not reach all latitudes.
LIMITED = {("omerc", "lat_0")}
LON, LAT = (values.ravel() for values in np.meshgrid(np.linspace(-178.3, 176.9, 25), np.linspace(-88.1, 87.3, 17)))
SAME = 1e-9  # radii
FELT = 1e-6  # radii


def coordinates(projection) -> np.ndarray:
    """x and y in radii of the Earth."""
    return np.array(projection(LON, LAT)) / MEAN_EARTH_RADIUS


def is_shift(one, other) -> bool:
    """Whether two maps differ by a shift alone wherever both are; so do those that are nowhere both."""
    spread = [np.ptp(values[np.isfinite(values)]) if np.isfinite(values).any() else 0.0 for values in one - other]
    return max(spread) < FELT


def samples(parameter) -> list[float]:
    """Both ends of a range, its middle and values between."""
    values = parameter.low + np.array([0.0, 0.13, 0.3, 0.5, 0.77, 1.0]) * (parameter.high - parameter.low)
    if parameter.step >= 1.0 and parameter.unit != "m":
        values = parameter.step * np.round(values / parameter.step)
    return values.tolist()


def operation(text: str) -> str:
    return text.removeprefix("+proj=").partition(" ")[0].partition("+")[0]


@pytest.mark.slow
def test_what_has_no_parameters_is_known() -> None:
    """An operation that PROJ has and the table has not is one whose numbers are constants."""
    assert {name for name in OPERATIONS if not tunable(projection_names()[name]).parameters} == WITHOUT


@pytest.mark.slow
@each("text", MAPS)
def test_ranges_and_defaults(text) -> None:
    """PROJ has a map at the ends and in the middle, and each parameter changes it, not only its place in the plane.

    The value of each is the one that PROJ takes where none is stated; what was made of a value is its definition's map.
    """
    found, truth = tunable(text), coordinates(make(text))
    np.testing.assert_allclose(coordinates(make(found.definition)), truth, rtol=0, atol=SAME)
    for parameter in found.parameters:
        assert parameter.low <= parameter.value <= parameter.high
        same = coordinates(tuned(text, {parameter.name: parameter.value}))
        np.testing.assert_allclose(same, truth, rtol=0, atol=SAME)
        maps = []
        for value in samples(parameter):
            try:
                one = tuned(text, {parameter.name: value})
            except ProjectionError:
                assert (operation(text), parameter.name) in (HOLES if value == 0.0 else LIMITED)
                continue
            again = make(one.definition)
            assert (again.function, again.name, again.ellipsoid) == (one.function, one.name, one.ellipsoid)
            maps.append(coordinates(one))
        assert all(np.isfinite(map_).any() for map_ in maps)
        assert not all(is_shift(one, other) for one in maps for other in maps)


# Those of all maps, of the figure, of heights, of time and of other operations; and what makes other maps of one.
BESIDE = {"x_0", "y_0", "z_0", "k", "R", "R_lat_a", "R_lat_g", "a", "b", "e", "es", "f", "rf", "lon_wrap", "h_0", "t_0"}


@each("name", mostly_slow(OPERATIONS, 8))
def test_no_parameter_is_missing(name) -> None:
    """What PROJ reads of an operation, and what changes more than a map's place, is in the table."""
    rest = [f"+proj={name}", *NEEDED_PARAMETERS.get(name, "").split()]
    rest += [] if any("ellps" in token for token in rest) else [R]
    known = {parameter.name for text in MAPS if operation(text) == name for parameter in tunable(text).parameters}
    missing = []
    for key in sorted((ANGLES | NUMBERS | WHOLE_NUMBERS) - BESIDE - known):
        found = [transformer for value in (1, 2, 37) if (transformer := made(rest, key, value))]
        maps = [np.array(each.transform(LON, LAT, errcheck=False)) / MEAN_EARTH_RADIUS for each in found]
        maps = [np.where(np.isfinite(map_), map_, np.nan) for map_ in maps]
        if not all(is_shift(one, other) for one in maps for other in maps):
            missing.append(key)
    assert missing == (["zone"] if name == "utm" else [])


def made(rest, key, value) -> Transformer | None:
    """PROJ's operation, if it reads the parameter."""
    words = [*(word for word in rest if f"+{key}=" not in word), f"+{key}={value}"]
    try:
        found = Transformer.from_pipeline(" ".join(words))
    except pyproj.exceptions.ProjError:
        return None
    return found if f"{key}={value}" in found.definition.split() else None
