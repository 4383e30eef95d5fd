"""Projections from every kind of input, against pyproj's own transformations and closed forms."""

import math
import re

import numpy as np
import pyproj.list
import pytest
from projection_points import LAT, LON, SAME, R, assert_same, make, mercator, message, refusal
from pyproj import CRS, Transformer
from tables import each

from projdist.earth.ellipsoid import SPHERE, WGS84
from projdist.projections import Projection, ProjectionError, crs_wkt, projection_names, unprojected, with_parameters
from projdist.projections.catalogue import NAMES, NEEDED_PARAMETERS, NOT_IN_METRES, NOT_MAPS, WINKEL_PARALLEL
from projdist.projections.projection import needed_parameters
from projdist.projections.worldmaps import WORLD_MAPS

LAEA = "+proj=laea +lat_0=52 +lon_0=10 +x_0=4321000 +y_0=3210000 +ellps=GRS80"
EUROPE = CRS("EPSG:3035")
# One CRS in every form that names it; of pipelines one from degrees, as projinfo prints it.
SAME_MAP = [
    *("EPSG:3035", "epsg:3035", "  EPSG:3035 ", 3035, np.int64(3035), ("EPSG", 3035), "urn:ogc:def:crs:EPSG::3035"),
    *("3035", "epsg 3035", "+init=epsg:3035", "init=epsg:3035 +no_defs +type=crs", EUROPE, make("EPSG:3035")),
    *(EUROPE.to_wkt(version) for version in ("WKT2_2019", "WKT2_2015", "WKT1_GDAL", "WKT1_ESRI")),
    *(EUROPE.to_wkt(pretty=True), EUROPE.to_json(), EUROPE.to_json(pretty=True), EUROPE.to_json_dict()),
    *(pyproj.Proj("EPSG:3035"), pyproj.Proj(LAEA), f"{LAEA} +units=m +no_defs"),
    *(LAEA.replace("+", ""), LAEA.replace(" +", "\n  +") + "\n"),
    *(f"+proj=pipeline {step}+step {LAEA}" for step in ("", "+step +proj=unitconvert +xy_in=deg +xy_out=rad ")),
]


@each("text, code", [
    ("lambert 93", "EPSG:2154"), ("British national grid", "EPSG:27700"), ("lv95", "EPSG:2056"),
    ("RD new", "EPSG:28992"), ("etrs89 utm 32n", "EPSG:25832"), ("utm 37s", "EPSG:32737"),
    ("texas central", "EPSG:32139"),
])  # fmt: skip
def test_words_of_one_crs_name_it(text, code):
    """Realisations of a datum are one, and so are orders of axes; datums in force come before older ones."""
    assert Projection.from_user_input(text).definition == code


def test_words_of_several_crss_are_told_with_them():
    said = message("RD")
    assert "'RD' may be EPSG:28992 (Amersfoort / RD New), EPSG:28991 (Amersfoort / RD Old), " in said
    said = r"Did you mean lambert-cylindrical, .*\? It must be .* 'lambert' may be EPSG:.* or one of \d+ more"
    assert re.search(said, message("lambert"))
    assert "Did you mean mercator? It must be a PROJ id" in message("mercater")
    said = "'osgb' may be EPSG:27700 (OSGB36 / British National Grid)."  # one word is not enough
    assert said in message("osgb")
    assert "'texas albers' may be EPSG:3083 (" in message("texas albers")
    assert "It must be a PROJ id" in message("germany")  # a region


@each("given", SAME_MAP)
def test_every_kind_of_input_gives_the_same_map(given):
    """A code, WKT, PROJJSON, PROJ string, CRS .. of EPSG:3035 are the map of pyproj's transformation from ETRS89."""
    projection = make(given)
    truth = Transformer.from_crs("EPSG:4258", "EPSG:3035", always_xy=True).transform
    assert_same(projection, truth)
    assert projection.ellipsoid.a == 6378137.0
    assert pytest.approx(1 / 298.257222101, rel=1e-11) == projection.ellipsoid.f
    assert all((projection.name, projection.definition, make(projection) is projection))


@pytest.mark.slow
@each("suffix", [".prj", ".wkt", ".json"])
def test_files(tmp_path, suffix):
    """Files are read, from a path or its string, with a byte-order mark or without, of anything that text may be."""
    path = tmp_path / f"map{suffix}"
    text = {".prj": EUROPE.to_wkt("WKT1_ESRI"), ".wkt": EUROPE.to_wkt(pretty=True), ".json": EUROPE.to_json()}[suffix]
    for encoding in ("utf-8", "utf-8-sig"):
        path.write_text(text, encoding=encoding)
        assert_same(make(path), make("EPSG:3035"))
        assert make(str(path)) == make(path)
    for text in ("EPSG:3035\n", "+proj=utm +zone=32 +ellps=WGS84\n", "robin"):
        path.write_text(text, encoding="utf-8")
        assert_same(make(path), make(text))


# Friendly names with their formula or textbook parameters, written here anew: x(90 E, 0) / R and y(90 N) / R.
QUARTER, ROOT = math.pi / 2, math.sqrt(0.5)
COSINES = {degrees: math.cos(math.radians(degrees)) for degrees in (30.0, 37.5, 50.0)}
THIRD, FIFTH = math.sqrt(math.pi * (4 + math.pi)), math.sqrt(2 + math.pi)  # of Eckert's maps
EQUATOR_AND_POLE = {
    "plate-carree equirectangular sinusoidal sanson-flamsteed aitoff azimuthal-equidistant": (QUARTER, QUARTER),
    "gall-isographic": (QUARTER * ROOT, QUARTER),
    "miller": (QUARTER, 1.25 * math.log(math.tan(math.pi / 4 + 0.4 * QUARTER))),
    "gall gall-stereographic": (QUARTER * ROOT, 1 + ROOT),
    "lambert-cylindrical cylindrical-equal-area": (QUARTER, 1.0),
    "behrmann": (QUARTER * COSINES[30.0], 1 / COSINES[30.0]),
    "hobo-dyer": (QUARTER * COSINES[37.5], 1 / COSINES[37.5]),
    "gall-peters peters": (QUARTER * ROOT, math.sqrt(2)),
    "balthasart": (QUARTER * COSINES[50.0], 1 / COSINES[50.0]),
    "mollweide lambert-azimuthal lambert-azimuthal-equal-area": (math.sqrt(2), math.sqrt(2)),
    "robinson": (0.8487 * QUARTER, 1.3523),
    "eckert-1": (2 * math.sqrt(2 / (3 * math.pi)) * QUARTER, 2 * math.sqrt(2 / (3 * math.pi)) * QUARTER),
    "eckert-2": (2 / math.sqrt(6 * math.pi) * math.pi, math.sqrt(2 * math.pi / 3)),
    "eckert-3": (2 / THIRD * math.pi, 4 / THIRD * QUARTER),
    "eckert-4": (2 / THIRD * math.pi, 2 * math.sqrt(math.pi / (4 + math.pi))),
    "eckert-5": (math.pi / FIFTH, math.pi / FIFTH),
    "eckert-6": (math.pi / FIFTH, 2 * QUARTER / FIFTH),
    "kavrayskiy-7": (1.5 * QUARTER / math.sqrt(3), QUARTER),
    "winkel-1 winkel-tripel winkel-3": ((1 + QUARTER) / 2, QUARTER),
    "hammer": (2 * math.sqrt(2) * ROOT / math.sqrt(1 + ROOT), math.sqrt(2)),
    "craster-parabolic": (math.sqrt(3 / math.pi) * QUARTER, math.sqrt(3 * math.pi) * 0.5),
    "quartic-authalic": (QUARTER, math.sqrt(2)),
    "collignon": (QUARTER * 2 / math.sqrt(math.pi), math.sqrt(math.pi)),
    "stereographic": (2.0, 2.0),
    "orthographic": (1.0, 1.0),
    "van-der-grinten": (QUARTER, math.pi),
    "lagrange": (2 * ROOT / (1 + ROOT), 2.0),
    "goode-homolosine interrupted-goode-homolosine": (QUARTER, math.sqrt(2) - 0.0528035274542),
}


@each(("name", "size"), [(name, size) for names, size in EQUATOR_AND_POLE.items() for name in names.split()])
def test_friendly_names_have_the_textbook_size(name, size):
    """x at 90 degrees east on the equator and y of the north pole are the textbook's, on the sphere of mean radius."""
    projection = make(name)
    assert projection.ellipsoid == SPHERE
    assert "+R=6371008.7714" in projection.definition
    assert make(projection.definition).function == projection.function
    x, y = projection([90.0, 0.0], [0.0, 90.0])
    # PROJ's goode has Goode's shift to four decimals only (Snyder 1987, page 250: 0.0528), its igh to thirteen.
    rtol = 3e-6 if name == "goode-homolosine" else 1e-9
    np.testing.assert_allclose([x[0] / R, y[1] / R], size, rtol=rtol)


OPERATIONS = set(pyproj.list.get_proj_operations_map()) - NOT_MAPS - set(NOT_IN_METRES)
SLOW, STRINGS = pytest.mark.slow, projection_names().items()
WORLD = np.meshgrid(np.linspace(-175, 175, 36), np.linspace(-85, 85, 35))


def test_there_are_many_names():
    """More than eighty are friendly ones; the others are PROJ's, and those of maps that it lacks."""
    assert len(NAMES) >= 80
    assert set(projection_names()) == set(NAMES) | set(WORLD_MAPS) | OPERATIONS


@each(("name", "definition"), [pytest.param(*one, marks=[] if one[0] in NAMES else SLOW) for one in STRINGS])
def test_every_name_is_a_map(name, definition):
    """It is taken as itself, or refused for want of parameters; its string is a map, at least somewhere."""
    x, y = make(definition)(*WORLD)
    assert np.isfinite(x).mean() > (0.2 if name in NAMES else 0.0)
    np.testing.assert_array_equal(np.isfinite(x), np.isfinite(y))
    assert needed_parameters(name) or make(name).definition == definition


@each(("one", "other"), [
    *(("Winkel Tripel", "wintri"), ("winkel_tripel", "winkel-tripel"), ("MERCATOR", "merc")),
    *(("Natural Earth 2", "natearth2"), ("wink1", "winkel-1"), ("wink2", "winkel-2")),
    ("polar-stereographic", f"+proj=stere +lat_0=90 +R={R}"),
    ("werner", f"+proj=bonne +lat_1=90 +R={R}"),
    ("winkel-2", f"+proj=wink2 +lat_1={math.degrees(math.acos(2 / math.pi))} +R={R}"),
    *(({"proj": "wintri", "R": R}, "wintri"), (f'{{"proj": "wintri", "R": {R}}}', "wintri")),
])  # fmt: skip
def test_names_in_any_spelling(one, other):
    """Capitals, spaces and underscores do not matter; PROJ's ids are names of the same maps, as are its parameters."""
    assert_same(make(one), make(other))


def test_needed_parameters_are_those_that_proj_asks_for():
    """By trying: PROJ refuses the bare id on a sphere if and only if it is said to need something."""
    for name in OPERATIONS - set(NAMES) - set(WORLD_MAPS):
        try:
            Transformer.from_pipeline(f"+proj={name} +R={R}")
        except pyproj.exceptions.ProjError:
            assert needed_parameters(name), name
        else:
            assert not needed_parameters(name), name
    assert set(NEEDED_PARAMETERS) <= set(projection_names()) - set(NAMES)
    assert [needed_parameters(name)[-1] for name in ("etmerc", "ups", "utm")] == ["ellps"] * 3  # no form on the sphere
    assert needed_parameters("utm") == ["zone", "ellps"]


@each("name", NEEDED_PARAMETERS)
def test_each_needed_parameter_is_needed(name):
    """Without any one of them PROJ refuses the example, or it is another map; the message has them all, and it."""
    definition, text = projection_names()[name], message(name)
    assert f"'{definition}'" in text
    x, _ = make(definition)(*WORLD)
    for parameter in needed_parameters(name):
        assert re.search(rf"needs .*\b{parameter}\b.*: give a PROJ string", text)
        rest = " ".join(word for word in definition.split() if not word.startswith(f"+{parameter}="))
        if parameter == "ellps":
            assert "It has no form on the sphere and needs" in text
            assert "+ellps=WGS84'" in text
            rest += f" +R={R}"
        try:
            other, _ = make(rest)(*WORLD)
        except ProjectionError:
            continue
        assert not np.array_equal(other, x, equal_nan=True), parameter


def test_winkel_tripel_keeps_the_default_parallel():
    """+proj=wintri has PROJ's own lat_1, arccos(2 / pi) = 50.4597762521898 degrees, not the 0 of a rewritten string."""
    assert pytest.approx(math.degrees(math.acos(2 / math.pi)), abs=1e-12) == WINKEL_PARALLEL
    lam, phi = np.radians(80.0), np.radians(35.0)
    alpha = np.arccos(np.cos(phi) * np.cos(lam / 2))
    sinc = np.sin(alpha) / alpha
    # Snyder 1993, page 232: the mean of the Aitoff and of the equirectangular projection.
    x = 0.5 * (lam * 2 / np.pi + 2 * np.cos(phi) * np.sin(lam / 2) / sinc)
    y = 0.5 * (phi + np.sin(phi) / sinc)
    given = ["wintri", "winkel-tripel", f"+proj=wintri +R={R}", f"proj=wintri R={R} type=crs no_defs"]
    for value in [*given, pyproj.Proj(given[2]), f"+proj=wintri +lat_1=50.4597762521898 +R={R}"]:
        np.testing.assert_allclose(make(value)(80.0, 35.0), (R * x, R * y), rtol=1e-13)


def test_functions():
    """A function of degrees is a projection under its own name, on the sphere unless told otherwise."""
    projection = make(mercator)
    assert (projection.name, projection.definition, projection.ellipsoid) == ("mercator", "mercator", SPHERE)
    np.testing.assert_allclose(projection(LON, LAT), make("mercator")(LON, LAT), rtol=1e-14, atol=SAME)
    named = Projection.from_function(mercator, name="mine", ellipsoid=WGS84)
    assert (named.name, named.ellipsoid) == ("mine", WGS84)
    assert make(lambda lon, lat: (lon, lat)).name == "<lambda>"

    class Map:
        def __call__(self, lon, lat):
            return lon, 2 * lat

    assert make(Map()).name == "Map"  # an object that can be called
    np.testing.assert_array_equal(make(Map())([1, 2], 3), ([1, 2], [6, 6]))


def test_what_functions_get_and_what_becomes_nan():
    """A function is called once, with float arrays already broadcast; inf in one coordinate is NaN in both."""
    calls = []

    def record(lon, lat):
        calls.append((lon, lat))
        return lon, lat

    make(record)([[1], [2]], [3, 4, 5])
    assert len(calls) == 1
    assert [(value.shape, value.dtype) for value in calls[0]] == [((2, 3), np.dtype(float))] * 2
    x, y = make(lambda lon, lat: (np.where(lon > 0, np.inf, lon), lat))([-1, 1], [2, 2])
    np.testing.assert_array_equal((x, y), [[-1, np.nan], [2, np.nan]])


WRONG_FUNCTIONS = {
    "one value": lambda lon, lat: lon,
    "a tuple of one": lambda lon, lat: (lon,),
    "three values": lambda lon, lat: (lon, lat, lat),
    "another shape": lambda lon, lat: (lon[:1], lat),
    "scalars": lambda lon, lat: (0.0, 0.0),
    "nothing": lambda lon, lat: None,
}


@each("function", WRONG_FUNCTIONS.values())
def test_what_functions_return_is_checked(function):
    """A function that does not return x and y of the shape of its arguments is refused by name, and what is none."""
    projection = Projection.from_function(function, name="mine")
    said = "Invalid projection function 'mine'. It must return x and y"
    assert refusal(projection, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]).startswith(said)
    said = "Invalid projection function '7'. It must be callable with (lon, lat"
    assert refusal(Projection.from_function, 7).startswith(said)


def test_parameters_changed_in_place():
    """The map of the changed string, without reading it anew; what PROJ refuses is refused, pipelines too."""
    base = make("+proj=lcc +lat_1=30 +lat_2=60 +ellps=GRS80")
    changed = with_parameters(base, {"lat_2": 50.0, "lon_0": 10.0})
    whole = make("+proj=lcc +lat_1=30 +lat_2=50 +lon_0=10 +ellps=GRS80")
    np.testing.assert_allclose(changed(12.0, 40.0), whole(12.0, 40.0), rtol=1e-14)
    assert re.match(r"Invalid PROJ string '.*lat_1=91.*'. PROJ says: ", refusal(with_parameters, base, {"lat_1": 91.0}))
    for given in ("EPSG:3035", "+proj=pipeline +step +proj=moll", lambda lon, lat: (lon, lat)):
        assert refusal(with_parameters, make(given), {"lon_0": 1.0}).endswith("It must be a PROJ string of one step.")


@pytest.mark.slow
def test_wkt_of_maps():
    """Named, on the geographic CRS that is asked for, read back; what has none says why."""
    conic = make("+proj=lcc +lat_1=30 +lat_2=60 +ellps=GRS80")
    text, reason = crs_wkt(conic, "Mine", geodetic="EPSG:4258")
    assert (CRS.from_wkt(text).name, CRS.from_wkt(text).geodetic_crs.to_epsg(), reason) == ("Mine", 4258, None)
    esri, _ = crs_wkt(conic, "Mine", version="WKT1_ESRI")
    np.testing.assert_allclose(make(esri)(10.0, 45.0), conic(10.0, 45.0), atol=1e-6)
    function = make(lambda lon, lat: (lon, lat))
    assert crs_wkt(function, "x") == (None, f"{function.name} is not a CRS, but a function or a pipeline.")


@pytest.mark.slow
@each("crs", ["nonsense", "EPSG:99999", "EPSG:5703"])
def test_coordinates_in_no_crs(crs):
    """A line; heights alone have no longitudes."""
    assert refusal(unprojected, crs, np.zeros(1), np.zeros(1)).startswith(f"Invalid CRS '{crs}'")
