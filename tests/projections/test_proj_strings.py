"""PROJ strings: what is written is what is mapped, what is no number is refused, what changes nothing is told of."""

import collections
import contextlib
import functools
import itertools
import math
import re
import warnings
from pathlib import Path

import numpy as np
import pyproj.list
import pytest
from hypothesis import given, strategies as st
from projection_points import make, message
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError
from tables import each

from projdist import Notice, ProjectionError
from projdist.projections import projection_names, with_parameters
from projdist.projections.catalogue import NEEDED_PARAMETERS, NOT_IN_METRES, NOT_MAPS
from projdist.projections.proj_strings import ANGLES, FLAGS, NUMBERS, WHOLE_NUMBERS, degrees_of

LON, LAT = np.meshgrid(np.linspace(-150.0, 170.0, 9), np.linspace(-70.0, 85.0, 7))
SAME = 1e-6  # metres: twelve digits of 1e7 m, lost twice

Parameters = dict[str, float]

LIMITS = {"lat_1": (5.0, 35.0), "lat_2": (36.0, 80.0), "lat_0": (-60.0, 60.0), "lon_0": (-180.0, 180.0)}
LIMITS |= {"x_0": (-1e7, 1e7), "y_0": (-1e7, 1e7), "R": (1e6, 7e6)}
NINE = functools.partial(round, ndigits=9)  # decimals, which a string without exponents holds
CONICS = st.fixed_dictionaries({name: st.floats(*limits).map(NINE) for name, limits in LIMITS.items()})


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


@pytest.mark.slow
@given(CONICS, st.randoms(use_true_random=False))
def test_all_parameters_do_what_the_formula_says_in_any_order(parameters: Parameters, random) -> None:
    """The map is that of the formula; its definition has all parameters as given, and reads as an equal projection."""
    words = ["+proj=lcc", *written(parameters)]
    random.shuffle(words)
    projection = make(" ".join(words))
    found, again = projection(LON, LAT), make(projection.definition)
    clear = np.abs((LON - parameters["lon_0"]) % 360.0 - 180.0) > 1e-6  # of the seam
    for ours, truth in zip(found, lambert(parameters), strict=True):
        np.testing.assert_allclose(ours[clear], truth[clear], rtol=1e-12, atol=SAME)
    assert (read(projection.definition), again) == (parameters, projection)
    np.testing.assert_array_equal(again(LON, LAT), found)


@pytest.mark.slow
@given(CONICS, CONICS, st.sets(st.sampled_from(["lat_1", "lat_2", "lat_0", "lon_0", "x_0"])))
def test_changed_parameters_are_those_of_a_new_string(old: Parameters, new: Parameters, changed: set[str]) -> None:
    """Some parameters of a projection replaced give the projection whose string had them from the start."""
    changes = {key: new[key] for key in changed}
    projection = with_parameters(make(" ".join(["+proj=lcc", *written(old)])), changes)
    assert read(projection.definition) == pytest.approx(old | changes, rel=0.0, abs=1e-12)
    again = make(" ".join(["+proj=lcc", *written(old | changes)]))
    np.testing.assert_array_equal(projection(LON, LAT), again(LON, LAT))


USUAL = "+lat_1=30 +lat_2=50 +lat_0=10 +lon_0=5 +lon_1=10 +lon_2=30"
OTHERS = (
    *("", USUAL, "+lat_1=10 +lat_ts=30 +alpha=30 +lonc=5", "+h=35785831 +n=0.5 +m=1 +W=2 +q=1 +lsat=3 +path=5"),
    *("+o_proj=moll +o_lat_p=30", "+plat_0=10 +plon_0=5 +phdg_0=30 +path=5"),
    f"{USUAL} +lat_3=20 +lon_3=-20",
)


@pytest.mark.filterwarnings("ignore::projdist.Notice")  # of parameters that a map has no use for
@each("most", [1, pytest.param(len(OTHERS), marks=pytest.mark.slow)])
def test_operations_alone_take_angles_to_a_plane(most) -> None:
    """So they need not be asked: of angles in degrees and in radians all that are taken make the same lengths."""
    taken = collections.Counter()
    for name, parameters in itertools.product(pyproj.list.get_proj_operations_map(), OTHERS):
        if taken[name] == most:
            continue
        try:
            function = make(f"+proj={name} {parameters}").function
        except ProjectionError:
            continue
        taken[name] += 1
        in_degrees = np.array(function.transformer.transform(LON, LAT))
        in_radians = np.array(function.transformer.transform(np.radians(LON), np.radians(LAT), radians=True))
        np.testing.assert_allclose(in_degrees, in_radians, rtol=1e-9, atol=SAME)  # a turn to radians is rounded
    assert {*pyproj.list.get_proj_operations_map()} - {*+taken} == {*NOT_MAPS, *NOT_IN_METRES, "pipeline"}


ROUNDING = 1e-14  # the same arithmetic in another order, of a map of the unit sphere
WRONG = "lat_ts=abc;k_0=nan;x_0=inf;lon_0=1e400;lon_0=10,5;lon_0=;lon_0 10;lon_0=10d30'X;lon_0=30'10d;R=abc;x_0=10km"


@each("text", [
    *(f"+proj=merc +{wrong}" for wrong in WRONG.split(";")),
    *("+proj=lcc +lat_1=30+lat_2=60", "+proj=utm +zone=33N", "+proj=utm +zone=32.5", "+proj=utm +zone=33 +south=5"),
    *("+proj=ob_tran +o_proj=moll +o_lat_p=none", "+proj=pipeline +step +proj=merc +step +proj=affine +s11=two"),
    *({"proj": "merc", "lon_0": float("nan")}, {"proj": "merc", "lon_0": [10]}),
])  # fmt: skip
def test_values_that_are_no_numbers_are_refused(text: object) -> None:
    """PROJ would take them for 0, or for the number that they begin with."""
    assert re.match(r"Invalid parameter '\+\w+.*' in '.*'\. It must be .*\.$", message(text))


DEGREES = {"10": 10.0, "-10.": -10.0, "+.5": 0.5, "1.25e1": 12.5, "10d30'": 10.5, "10D30": 10.5, "10°30'": 10.5}
DEGREES |= {"10d30'36\"W": -10.51, "10.5W": -10.5, "10e": 10.0, "0.25r": math.degrees(0.25), "30'": 0.5, "30S": -30.0}


@each(("written", "degrees"), DEGREES.items())
def test_angles_may_be_written_as_proj_reads_them(written: str, degrees: float) -> None:
    """Mercator's x on the unit sphere is the longitude from lon_0, in radians; `degrees_of` reads them, too."""
    assert degrees_of(written) == pytest.approx(degrees, rel=1e-15)
    x, _ = make(f"+proj=merc +R=1 +lon_0={written}")(60.0, 0.0)
    np.testing.assert_allclose(x, math.radians(60.0 - degrees), rtol=0, atol=ROUNDING)


@each(("text", "said"), [
    ("+proj=merc +R=1 +lon0=10", r"^PROJ makes no use of '\+lon0=10' with merc\. Did you mean lon_0\?$"),
    ("+proj=lcc +lat1=30 +lat_1=35 +lat_2=60", r"'\+lat1=30' with lcc\.$"),
    ("+proj=lcc +lat_1=35 +lat2=60", r"'\+lat2=60' with lcc\. Did you mean lat_2\?$"),
    ("+proj=merc +Lat_ts=10", r"'\+Lat_ts=10' with merc\. Did you mean lat_ts\?$"),
    ("+proj=utm +zone=33 +soth", r"'\+soth' with utm\. Did you mean south\?$"),
    ("+proj=moll +lat_ts=40", r"'\+lat_ts=40' with moll\.$"),
    ("+proj=merc +lon_0=10 +lon_0=20", r"'\+lon_0=20' with merc\.$"),
    ("+proj=ob_tran +o_proj=moll +o_lat_p=45 +lon_1=4", r"'\+lon_1=4' with ob_tran\.$"),
    ("+proj=pipeline +step +proj=merc +lon0=1 +step +proj=affine +s11=2", r"'\+lon0=1' with merc\."),
    ("+proj=pipeline +step +proj=merc +step +proj=affine +s_11=2", r"'\+s_11=2' with affine\. Did you mean s11\?$"),
    ("+proj=pipeline +lon0=1 +step +proj=merc +step +proj=affine +s11=2", r"'\+lon0=1' with merc\."),
    # PROJ reads these of every map.
    ("+proj=merc +lat_0=40", r"'\+lat_0=40' with merc\.$"),
    ("+proj=robin +k_0=0.9", r"'\+k_0=0\.9' with robin\.$"),
    ("+proj=utm +zone=33 +lon_0=10", r"'\+lon_0=10' with utm\.$"),
    ("+proj=merc +lat_ts=30 +k=0.9", r"'\+k=0\.9' with merc\.$"),
    # Constants of these maps, with another value.
    ("+proj=krovak +alpha=30.3", r"'\+alpha=30\.3' with krovak\.$"),
    ("+proj=nzmg +lat_0=-40", r"'\+lat_0=-40' with nzmg\.$"),
])  # fmt: skip
def test_parameters_that_change_nothing_are_told_of(text: str, said: str) -> None:
    """With the name that was meant, where this map has one that is spelt nearly so."""
    with pytest.warns(Notice, match=said) as told:
        make(text)
    assert len(told) == 1


@each("text", [
    "+proj=merc +lat_0=0 +lon_0=0 +k=1 +x_0=0 +y_0=0 +a=6378137 +b=6378137 +nadgrids=@null +wktext +no_defs",
    "+proj=wintri +lat_1=50.4597762521898",  # its own default
    "+proj=tmerc +lat_0=49 +lon_0=2d20'14.025\"E +k=0.9996 +x_0=4e5 +y_0=-1e5 +datum=OSGB36 +units=us-ft +type=crs",
    "+proj=omerc +lat_0=40 +lonc=10 +alpha=30 +gamma=10 +no_uoff +over +axis=neu +pm=paris",
    "+proj=utm +zone=33 +south +approx +towgs84=0,0,0 +ellps=intl",
    "+proj=pipeline +ellps=intl +step +proj=axisswap +order=1,2 +step +proj=lcc +lat_1=30 +lat_2=40 +k_0=.9",
    "+proj=pipeline +step +proj=merc +step +inv +proj=merc +lon_0=10 +step +proj=robin +title=x +omit_inv",
    # As PROJ writes them, of constants.
    "+proj=krovak +lat_0=49.5 +lon_0=24.8333333333333 +alpha=30.2881397527778 +k=0.9999 +ellps=bessel +units=m",
    "+proj=nzmg +lat_0=-41 +lon_0=173 +x_0=2510000 +y_0=6023150 +datum=nzgd49 +units=m +no_defs",
    *projection_names().values(),
])  # fmt: skip
def test_parameters_that_are_used_are_not_told_of(text: str) -> None:
    """Nor are defaults that are written out, and what is no part of a map."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(text)


_KINDS = {"r": ANGLES, "d": NUMBERS, "i": WHOLE_NUMBERS, "b": FLAGS}
# Of `q` and `m` PROJ asks first whether they are there, and then for the number.
_ASKED_FIRST = {("b", "q"), ("s", "m")}


def _questions() -> dict[str, set[str]]:
    """Parameters, and the kinds of value by which PROJ's library may ask for each: strings such as `rlat_0`."""
    folder = Path(pyproj.__file__).parent
    libraries = [*folder.parent.glob("pyproj.libs/libproj*"), *folder.rglob("libproj*")]
    if not libraries:
        pytest.skip("PROJ's library is not in the wheel")
    words = re.findall(rb"(?<=\0)[rdib][A-Za-z][A-Za-z0-9_]{0,12}(?=\0)", libraries[0].read_bytes())
    found = collections.defaultdict(set)
    for word in words:
        found[word[1:].decode()].add(word[:1].decode())
    return found


def _reads(base: str, name: str) -> bool:
    for value in ("=1", "", "=40"):
        try:
            definition = Transformer.from_pipeline(f"{base} +{name}{value}").definition
        except ProjError:
            continue
        return name in {token.partition("=")[0] for token in definition.split()}
    return False


@pytest.mark.slow
def test_the_kinds_of_parameters_are_those_of_proj() -> None:
    """What a map reads, and its library asks for by one kind of value only, is known by that kind."""
    wrong = []
    maps = [name for name in pyproj.list.get_proj_operations_map() if name not in NOT_MAPS]
    for name, kinds in _questions().items():
        known = {kind for kind, keys in _KINDS.items() if name in keys}
        if len(kinds) > 1 or known == kinds:
            continue
        for operation in maps:
            base = f"+proj={operation} {NEEDED_PARAMETERS.get(operation, '')}"
            if "ellps" not in base:
                base += " +R=6371000"
            if _reads(base, name) and (*kinds, name) not in _ASKED_FIRST:
                wrong.append((name, kinds))
                break
    # `a`, `b` and `f` of an ellipsoid, whose questions are shorter than what a library keeps apart, may seem angles.
    assert not [entry for entry in wrong if entry[0] not in ("a", "b", "f")]


@pytest.mark.slow
def test_strings_that_proj_makes_of_crss_say_nothing() -> None:
    """A thousand CRSs of EPSG, and those with constants: each parameter counts, or is a default or constant."""
    strings, codes = set(), [f"EPSG:{code}" for code in pyproj.database.get_codes("EPSG", "PROJECTED_CRS")[::5]]
    for code in [*codes, "EPSG:27200", "EPSG:5224", "ESRI:102065", "ESRI:54090"]:
        # Not every method has a PROJ string; pyproj warns of what such a string loses.
        with contextlib.suppress(CRSError), warnings.catch_warnings(action="ignore", category=UserWarning):
            strings.add(CRS(code).to_proj4())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for text in sorted(strings):
            with contextlib.suppress(ProjectionError):
                make(text)
    assert not [str(notice.message) for notice in told]
