"""Projections from every kind of input, against pyproj's own transformations and closed forms."""

import json
import math
import pickle
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyproj.list
import pytest
from pyproj import CRS, Geod, Transformer

from projdist.catalogue import NAMES, NEEDED_PARAMETERS, NOT_MAPS, WINKEL_PARALLEL
from projdist.ellipsoid import MEAN_EARTH_RADIUS, SPHERE, WGS84, Ellipsoid
from projdist.projections import Projection, ProjectionError, needed_parameters, projection_names
from projdist.worldmaps import WORLD_MAPS

R = MEAN_EARTH_RADIUS
LON = np.array([-179.0, -71.3, 0.0, 4.9, 10.0, 133.7])
LAT = np.array([-33.9, 42.0, 0.0, 52.4, -89.0, 60.0])
# Points near the European and world CRSs of this module.
EUROPE = np.array([4.9, 9.0, 13.4, 16.6]), np.array([52.4, 48.0, 52.5, 49.2])

# The same arithmetic done in a different order: a nanometre or two of 1e7 m.
SAME = 1e-8


def label(value):
    """A test id that is the same in every process: functions by name."""
    return getattr(value, "__name__", str(value))


def make(value):
    return Projection.from_user_input(value)


def assert_same(projection, truth, lon=LON, lat=LAT, atol=SAME):
    """The projections agree in metres, at points and in what they leave out."""
    np.testing.assert_allclose(projection(lon, lat), truth(lon, lat), rtol=0, atol=atol)


def mercator(lon, lat):
    """Snyder 1987, 7-1 and 7-2, on the sphere of the mean radius."""
    return R * np.radians(lon), R * np.log(np.tan(np.pi / 4 + np.radians(lat) / 2))


# ---- kinds of input -------------------------------------------------------------------------


def inputs():
    """One CRS, EPSG:3035, in every form that names it, and what it is compared with."""
    crs = CRS("EPSG:3035")
    return {
        "code": "EPSG:3035",
        "code in small letters": "epsg:3035",
        "code with spaces": "  EPSG:3035 ",
        "integer": 3035,
        "numpy integer": np.int64(3035),
        "authority pair": ("EPSG", 3035),
        "URN": "urn:ogc:def:crs:EPSG::3035",
        "old init": "+init=epsg:3035",
        "old init with flags": "init=epsg:3035 +no_defs +type=crs",
        "pyproj CRS": crs,
        "WKT2": crs.to_wkt("WKT2_2019"),
        "WKT2 of 2015": crs.to_wkt("WKT2_2015"),
        "WKT2 in lines": crs.to_wkt("WKT2_2019", pretty=True),
        "WKT1 GDAL": crs.to_wkt("WKT1_GDAL"),
        "WKT1 ESRI": crs.to_wkt("WKT1_ESRI"),
        "PROJJSON": crs.to_json(),
        "PROJJSON in lines": crs.to_json(pretty=True),
        "PROJJSON as a dict": crs.to_json_dict(),
        "PROJ string": "+proj=laea +lat_0=52 +lon_0=10 +x_0=4321000 +y_0=3210000 +ellps=GRS80 +units=m +no_defs",
        "PROJ string without plus": "proj=laea lat_0=52 lon_0=10 x_0=4321000 y_0=3210000 ellps=GRS80",
        "PROJ string in lines": "+proj=laea\n  +lat_0=52 +lon_0=10\n  +x_0=4321000 +y_0=3210000\n  +ellps=GRS80\n",
        "pipeline": "+proj=pipeline +step +proj=laea +lat_0=52 +lon_0=10 +x_0=4321000 +y_0=3210000 +ellps=GRS80",
        "pipeline from degrees, as projinfo prints it": (
            "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad "
            "+step +proj=laea +lat_0=52 +lon_0=10 +x_0=4321000 +y_0=3210000 +ellps=GRS80"
        ),
        "Projection": Projection.from_user_input("EPSG:3035"),
    }


@pytest.mark.parametrize("kind", inputs())
def test_every_kind_of_input_gives_the_same_map(kind):
    """A code, WKT, PROJJSON, PROJ string, CRS .. of EPSG:3035 are the map of pyproj's transformation from ETRS89."""
    projection = make(inputs()[kind])
    truth = Transformer.from_crs("EPSG:4258", "EPSG:3035", always_xy=True).transform
    assert_same(projection, truth)
    assert projection.ellipsoid.a == 6378137.0
    assert pytest.approx(1 / 298.257222101, rel=1e-11) == projection.ellipsoid.f
    assert projection.name
    assert projection.definition


@pytest.mark.parametrize("suffix", [".prj", ".wkt", ".json"])
@pytest.mark.parametrize("as_string", [False, True])
def test_files(tmp_path, suffix, as_string):
    """.prj, .wkt and .json files are read, from a path or its string, with a byte-order mark or without."""
    path = tmp_path / f"map{suffix}"
    crs = CRS("EPSG:3035")
    text = {".prj": crs.to_wkt("WKT1_ESRI"), ".wkt": crs.to_wkt(pretty=True), ".json": crs.to_json()}[suffix]
    for encoding in ("utf-8", "utf-8-sig"):
        path.write_text(text, encoding=encoding)
        assert_same(make(str(path) if as_string else path), make("EPSG:3035"))


def test_files_may_hold_proj_strings_and_codes(tmp_path):
    """A file may hold anything that is taken as text."""
    path = tmp_path / "map.prj"
    for text in ("EPSG:3035\n", "+proj=utm +zone=32 +ellps=WGS84\n", "robin"):
        path.write_text(text, encoding="utf-8")
        assert_same(make(path), make(text))


def test_a_projection_is_itself():
    """A Projection passes through."""
    projection = make("robin")
    assert make(projection) is projection


# Each friendly name with its formula or its textbook parameters, written here anew: ratio of standard parallels,
# x at (90 E, 0) and y at the pole over R, or another PROJ id.
EQUATOR_AND_POLE = {
    # x(90 E, 0) / R and y(90 N) / R; cylindrical and pseudocylindrical maps
    "plate-carree": (math.pi / 2, math.pi / 2),
    "equirectangular": (math.pi / 2, math.pi / 2),
    "gall-isographic": (math.pi / 2 * math.sqrt(0.5), math.pi / 2),
    "miller": (math.pi / 2, 1.25 * math.log(math.tan(math.pi / 4 + 0.4 * math.pi / 2))),
    "gall": (math.pi / 2 * math.sqrt(0.5), 1 + math.sqrt(0.5)),
    "gall-stereographic": (math.pi / 2 * math.sqrt(0.5), 1 + math.sqrt(0.5)),
    "lambert-cylindrical": (math.pi / 2, 1.0),
    "cylindrical-equal-area": (math.pi / 2, 1.0),
    "behrmann": (math.pi / 2 * math.cos(math.radians(30)), 1 / math.cos(math.radians(30))),
    "hobo-dyer": (math.pi / 2 * math.cos(math.radians(37.5)), 1 / math.cos(math.radians(37.5))),
    "gall-peters": (math.pi / 2 * math.sqrt(0.5), math.sqrt(2)),
    "peters": (math.pi / 2 * math.sqrt(0.5), math.sqrt(2)),
    "balthasart": (math.pi / 2 * math.cos(math.radians(50)), 1 / math.cos(math.radians(50))),
    "mollweide": (math.sqrt(2), math.sqrt(2)),
    "sinusoidal": (math.pi / 2, math.pi / 2),
    "sanson-flamsteed": (math.pi / 2, math.pi / 2),
    "robinson": (0.8487 * math.pi / 2, 1.3523),
    "eckert-1": (2 * math.sqrt(2 / (3 * math.pi)) * math.pi / 2, 2 * math.sqrt(2 / (3 * math.pi)) * math.pi / 2),
    "eckert-2": (2 / math.sqrt(6 * math.pi) * math.pi / 2 * 2, math.sqrt(2 * math.pi / 3) * (2 - 1)),
    "eckert-3": (
        2 / math.sqrt(math.pi * (4 + math.pi)) * math.pi / 2 * 2,
        4 / math.sqrt(math.pi * (4 + math.pi)) * math.pi / 2,
    ),
    "eckert-4": (
        2 / math.sqrt(math.pi * (4 + math.pi)) * math.pi / 2 * 2,
        2 * math.sqrt(math.pi / (4 + math.pi)),
    ),
    "eckert-5": (math.pi / 2 * 2 / math.sqrt(2 + math.pi), math.pi / math.sqrt(2 + math.pi)),
    "eckert-6": (math.pi / 2 * 2 / math.sqrt(2 + math.pi), 2 * (math.pi / 2) / math.sqrt(2 + math.pi)),
    "kavrayskiy-7": (1.5 * math.pi / 2 / math.sqrt(3), math.pi / 2),
    "winkel-1": ((2 / math.pi + 1) / 2 * math.pi / 2, math.pi / 2),
    "winkel-tripel": ((2 / math.pi * math.pi / 2 + math.pi / 2) / 2, math.pi / 2),
    "winkel-3": ((2 / math.pi * math.pi / 2 + math.pi / 2) / 2, math.pi / 2),
    "aitoff": (math.pi / 2, math.pi / 2),
    "hammer": (2 * math.sqrt(2) * math.sin(math.pi / 4) / math.sqrt(1 + math.cos(math.pi / 4)), math.sqrt(2)),
    "craster-parabolic": (math.sqrt(3 / math.pi) * math.pi / 2, math.sqrt(3 * math.pi) * 0.5),
    "quartic-authalic": (math.pi / 2, math.sqrt(2)),
    "collignon": (math.pi / 2 * 2 / math.sqrt(math.pi), math.sqrt(math.pi)),
    "lambert-azimuthal": (math.sqrt(2), math.sqrt(2)),
    "lambert-azimuthal-equal-area": (math.sqrt(2), math.sqrt(2)),
    "azimuthal-equidistant": (math.pi / 2, math.pi / 2),
    "stereographic": (2.0, 2.0),
    "orthographic": (1.0, 1.0),
    "van-der-grinten": (math.pi / 2, math.pi),
    "lagrange": (2 * math.sin(math.pi / 4) / (1 + math.cos(math.pi / 4)), 2.0),
    "goode-homolosine": (math.pi / 2, math.sqrt(2) - 0.0528035274542),
    "interrupted-goode-homolosine": (math.pi / 2, math.sqrt(2) - 0.0528035274542),
}


@pytest.mark.parametrize("name", EQUATOR_AND_POLE)
def test_friendly_names_have_the_textbook_size(name):
    """x at 90 degrees east on the equator and y of the north pole are the textbook's, on the sphere of mean radius."""
    projection = make(name)
    assert projection.ellipsoid == SPHERE
    x, y = projection([90.0, 0.0], [0.0, 90.0])
    # PROJ's goode has Goode's shift to four decimals only (Snyder 1987, page 250: 0.0528), its igh to thirteen.
    rtol = 3e-6 if name == "goode-homolosine" else 1e-9
    np.testing.assert_allclose([x[0] / R, y[1] / R], EQUATOR_AND_POLE[name], rtol=rtol)


def test_there_are_many_friendly_names():
    """More than eighty maps have a name, and each can be projected, at least somewhere."""
    assert len(NAMES) >= 80
    lon, lat = np.meshgrid(np.linspace(-170, 170, 35), np.linspace(-85, 85, 35))
    for name in NAMES:
        projection = make(name)
        x, y = projection(lon, lat)
        assert np.isfinite(x).mean() > 0.2, name
        np.testing.assert_array_equal(np.isfinite(x), np.isfinite(y))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Winkel Tripel", "wintri"),
        ("winkel_tripel", "winkel-tripel"),
        ("MERCATOR", "merc"),
        ("Natural Earth 2", "natearth2"),
        ("polar-stereographic", f"+proj=stere +lat_0=90 +R={R}"),
        ("werner", f"+proj=bonne +lat_1=90 +R={R}"),
        ("winkel-2", f"+proj=wink2 +lat_1={math.degrees(math.acos(2 / math.pi))} +R={R}"),
        ("wink1", "winkel-1"),
        ("wink2", "winkel-2"),
    ],
)
def test_names_in_any_spelling(one, other):
    """Capitals, spaces and underscores do not matter, and PROJ's ids are the names of the same maps."""
    assert_same(make(one), make(other))


def test_bare_names_are_on_the_sphere_of_mean_radius():
    """A bare name is R = 6371008.7714 m; its definition says so and gives the same map back."""
    for name in ("moll", "mercator", "wintri"):
        projection = make(name)
        assert projection.ellipsoid == SPHERE
        assert "+R=6371008.7714" in projection.definition
        assert_same(make(projection.definition), projection)


def test_projection_names():
    """Every name that is listed is taken as itself, or refused for want of parameters; its string is a map."""
    names = projection_names()
    assert set(NAMES) <= set(names)
    assert not set(names) & NOT_MAPS
    assert set(names) == set(NAMES) | set(WORLD_MAPS) | (set(pyproj.list.get_proj_operations_map()) - NOT_MAPS)
    lon, lat = np.meshgrid(np.linspace(-175, 175, 36), np.linspace(-85, 85, 18))
    for name, definition in names.items():
        assert np.isfinite(make(definition)(lon, lat)).any(), name
        if not needed_parameters(name):
            assert make(name).definition == definition


def test_needed_parameters_are_those_that_proj_asks_for():
    """By trying: PROJ refuses the bare id on a sphere if and only if it is said to need something."""
    for name in set(projection_names()) - set(NAMES) - set(WORLD_MAPS):
        try:
            Transformer.from_pipeline(f"+proj={name} +R={R}")
        except pyproj.exceptions.ProjError:
            assert needed_parameters(name), name
        else:
            assert not needed_parameters(name), name
    assert set(NEEDED_PARAMETERS) <= set(projection_names()) - set(NAMES)


@pytest.mark.parametrize("name", NEEDED_PARAMETERS)
def test_each_needed_parameter_is_needed(name):
    """Without any one of them PROJ refuses the example, or it is another map; the message has them all, and it."""
    definition = projection_names()[name]
    lon, lat = np.meshgrid(np.linspace(-175, 175, 36), np.linspace(-85, 85, 18))
    x, _ = make(definition)(lon, lat)
    text = message(name)
    assert f"'{definition}'" in text
    for parameter in needed_parameters(name):
        assert re.search(rf"needs .*\b{parameter}\b.*: give a PROJ string", text)
        rest = " ".join(word for word in definition.split() if not word.startswith(f"+{parameter}="))
        if parameter == "ellps":
            rest += f" +R={R}"
        try:
            other, _ = make(rest)(lon, lat)
        except ProjectionError:
            continue
        assert not np.array_equal(other, x, equal_nan=True), parameter


def test_an_ellipsoid_is_asked_for_where_there_is_no_spherical_form():
    """etmerc, ups and utm have a map on an ellipsoid only, and say so."""
    for name in ("etmerc", "ups", "utm"):
        assert "It has no form on the sphere and needs" in message(name)
        assert "+ellps=WGS84'" in message(name)
    assert needed_parameters("utm") == ["zone", "ellps"]


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
    for value in [*given, f"+proj=wintri +lat_1=50.4597762521898 +R={R}"]:
        np.testing.assert_allclose(make(value)(80.0, 35.0), (R * x, R * y), rtol=1e-13)


@pytest.mark.parametrize("value", [{"proj": "wintri", "R": R}, f'{{"proj": "wintri", "R": {R}}}'])
def test_a_dict_of_proj_parameters_keeps_the_defaults(value):
    """PROJ parameters as a dict, which pyproj takes as well, are the PROJ string that they spell."""
    assert_same(make(value), make("wintri"))


# ---- functions ------------------------------------------------------------------------------


def test_functions():
    """A function of degrees is a projection under its own name, on the sphere unless told otherwise."""
    projection = make(mercator)
    assert (projection.name, projection.definition, projection.ellipsoid) == ("mercator", "mercator", SPHERE)
    np.testing.assert_allclose(projection(LON, LAT), make("mercator")(LON, LAT), rtol=1e-14, atol=SAME)
    named = Projection.from_function(mercator, name="mine", ellipsoid=WGS84)
    assert (named.name, named.ellipsoid) == ("mine", WGS84)
    assert make(lambda lon, lat: (lon, lat)).name == "<lambda>"


def test_objects_with_call():
    """An object that can be called is a function."""

    class Map:
        def __call__(self, lon, lat):
            return lon, 2 * lat

    assert make(Map()).name == "Map"
    np.testing.assert_array_equal(make(Map())([1, 2], 3), ([1, 2], [6, 6]))


def test_functions_get_arrays_of_one_shape():
    """A function is called once, with float arrays that are already broadcast."""
    calls = []

    def record(lon, lat):
        calls.append((lon, lat))
        return lon, lat

    make(record)([[1], [2]], [3, 4, 5])
    assert len(calls) == 1
    assert [(value.shape, value.dtype) for value in calls[0]] == [((2, 3), np.dtype(float))] * 2


def test_values_that_are_not_finite_become_nan():
    """inf in one coordinate is NaN in both, also from a function."""
    x, y = make(lambda lon, lat: (np.where(lon > 0, np.inf, lon), lat))([-1, 1], [2, 2])
    np.testing.assert_array_equal(x, [-1, np.nan])
    np.testing.assert_array_equal(y, [2, np.nan])


WRONG_FUNCTIONS = {
    "one value": lambda lon, lat: lon,
    "a tuple of one": lambda lon, lat: (lon,),
    "three values": lambda lon, lat: (lon, lat, lat),
    "another shape": lambda lon, lat: (lon[:1], lat),
    "scalars": lambda lon, lat: (0.0, 0.0),
    "nothing": lambda lon, lat: None,
}


@pytest.mark.parametrize("kind", WRONG_FUNCTIONS)
def test_what_functions_return_is_checked(kind):
    """A function that does not return x and y of the shape of its arguments is refused by name."""
    projection = Projection.from_function(WRONG_FUNCTIONS[kind], name="mine")
    with pytest.raises(ProjectionError, match=r"^Invalid projection function 'mine'\. It must return x and y") as error:
        projection([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])
    assert "\n" not in str(error.value)


def test_from_function_takes_functions():
    """What cannot be called is refused."""
    with pytest.raises(
        ProjectionError, match=r"^Invalid projection function '7'\. It must be callable with \(lon, lat"
    ):
        Projection.from_function(7)


# ---- values ---------------------------------------------------------------------------------

SOME = ["moll", "+proj=utm +zone=33 +ellps=intl +units=us-ft", "EPSG:3035", "EPSG:27572", "EPSG:2065", mercator]


@pytest.mark.parametrize("value", SOME, ids=label)
def test_pickling(value):
    """A projection survives pickling, before and after its first use, and is then equal and the same map."""
    projection = make(value)
    for _ in range(2):
        copy = pickle.loads(pickle.dumps(projection))
        assert copy == projection
        assert hash(copy) == hash(projection)
        assert_same(copy, projection, *EUROPE, atol=0)


@pytest.mark.parametrize("value", SOME, ids=label)
def test_equality_and_hashing(value):
    """Two projections of one definition are equal and one key of a dict; of another definition they are not."""
    projection = make(value)
    assert projection == make(value)
    assert len({projection, make(value)}) == 1
    assert projection != make("+proj=robin +lon_0=7")
    projection(0.0, 50.0)  # the cached transformer is no part of the value
    assert projection == make(value)


def test_a_projection_is_frozen():
    """A projection cannot be changed in place."""
    with pytest.raises(AttributeError, match="cannot assign to field 'name'"):
        make("moll").name = "other"


@pytest.mark.parametrize("value", SOME[:-1])
def test_threads(value):
    """One projection shared by eight threads gives what it gives serially."""
    projection = make(value)
    rng = np.random.default_rng(8)
    parts = [(rng.uniform(0, 20, 2000), rng.uniform(40, 60, 2000)) for _ in range(64)]
    with ThreadPoolExecutor(8) as pool:
        threaded = list(pool.map(lambda part: projection(*part), parts))
    for part, result in zip(parts, threaded, strict=True):
        np.testing.assert_array_equal(result, projection(*part))


@pytest.mark.parametrize("value", ["moll", "EPSG:3035", "EPSG:27572", mercator], ids=label)
def test_shapes(value):
    """Any shapes of lon and lat broadcast, scalars and empty arrays too; the arguments are not written to."""
    projection = make(value)
    lon, lat = np.array([[1.0, 2.0, 3.0]]), np.array([[46.0], [47.0]])
    kept = lon.copy(), lat.copy()
    x, y = projection(lon, lat)
    assert x.shape == y.shape == (2, 3)
    np.testing.assert_array_equal(lon, kept[0])
    np.testing.assert_array_equal(lat, kept[1])
    for i, j in np.ndindex(2, 3):
        one = projection(lon[0, j], lat[i, 0])
        assert np.shape(one[0]) == ()
        np.testing.assert_allclose(one, (x[i, j], y[i, j]), rtol=1e-15)
    assert projection(np.zeros((0, 3)), 1.0)[0].shape == (0, 3)
    with pytest.raises(ValueError, match="shape mismatch"):
        projection([1.0, 2.0], [1.0, 2.0, 3.0])


def test_arrays_in_any_layout():
    """Transposed, strided, integer and read-only arrays are as good as others."""
    projection = make("EPSG:3035")
    lon, lat = np.meshgrid(np.arange(0, 20, 2), np.arange(40, 60, 3))
    truth = projection(lon.astype(float), lat.astype(float))
    np.testing.assert_array_equal(projection(lon, lat), truth)
    np.testing.assert_array_equal(projection(np.asfortranarray(lon), lat), truth)
    np.testing.assert_array_equal(projection(lon.T, lat.T), np.swapaxes(truth, 1, 2))
    np.testing.assert_array_equal(projection(lon[::2, ::-1], lat[::2, ::-1]), np.array(truth)[:, ::2, ::-1])
    fixed = lon.astype(float)
    fixed.flags.writeable = False
    np.testing.assert_array_equal(projection(fixed, lat), truth)


WORLD = ["moll", "robin", "eqc", "sinu", "laea", "+proj=utm +zone=32", "ESRI:54009", "EPSG:3857", "EPSG:27572"]


@pytest.mark.parametrize("value", WORLD)
def test_longitudes_beyond_180(value):
    """0..360 and -180..180 are the same longitudes."""
    projection = make(value)
    lon, lat = np.array([-170.0, -75.0, -0.5, 3.0, 10.0]), np.array([-20.0, 42.0, 47.0, 46.0, 45.0])
    x, y = projection(lon, lat)
    # Rounding of a longitude of 360 is 4e-14 degrees, 4 nm; far from a transverse meridian it is stretched.
    np.testing.assert_allclose(projection(lon + 360, lat), (x, y), rtol=1e-13, atol=1e-6)
    np.testing.assert_allclose(projection(lon - 360, lat), (x, y), rtol=1e-13, atol=1e-6)


@pytest.mark.parametrize("value", [*WORLD, "merc", "stere", "gnom", "igh", "EPSG:2065", "EPSG:7415"])
def test_undefined_points_are_nan(value):
    """NaN and infinite coordinates and latitudes beyond the poles are NaN, and spoil no other point."""
    projection = make(value)
    lon = np.array([5.0, np.nan, 5.0, np.nan, np.inf, 5.0, 5.0, 5.0, 5.0, 6.0])
    lat = np.array([52.0, 52.0, np.nan, np.nan, 52.0, np.inf, 90.001, -95.0, 180.0, 53.0])
    x, y = projection(lon, lat)
    np.testing.assert_array_equal(np.isnan(x), [False, *[True] * 8, False])
    np.testing.assert_array_equal(np.isnan(y), np.isnan(x))
    np.testing.assert_array_equal([x[[0, -1]], y[[0, -1]]], projection(lon[[0, -1]], lat[[0, -1]]))


def test_the_far_side_is_nan():
    """The gnomonic and orthographic maps end at the horizon."""
    for name in ("gnom", "ortho"):
        x, _ = make(name)([0.0, 80.0, 100.0, 180.0], 0.0)
        np.testing.assert_array_equal(np.isnan(x), [False, False, True, True])


# ---- units, prime meridians, axes -----------------------------------------------------------

# NIST SP 811, appendix B: the foot is 0.3048 m, the US survey foot 1200/3937 m; Clarke's foot is EPSG's 9005.
UNITS = {
    "+units=ft": 0.3048,
    "+units=us-ft": 1200 / 3937,
    "+units=km": 1000.0,
    "+to_meter=0.3047972654": 0.3047972654,
    "+to_meter=1200/3937": 1200 / 3937,
    "+units=kmi": 1852.0,
}


@pytest.mark.parametrize("unit", UNITS)
def test_units_of_proj_strings(unit):
    """Whatever the unit of the string, coordinates are metres; false eastings too, which PROJ states in metres."""
    bare = "+proj=tmerc +lat_0=40 +lon_0=-74 +k=0.9999 +x_0=300000 +ellps=GRS80"
    assert_same(make(f"{bare} {unit}"), make(bare), np.array([-75.0, -74.0, -73.2]), np.array([40.0, 41.0, 39.0]))
    # PROJ itself is in the unit.
    raw = Transformer.from_pipeline(f"{bare} {unit}").transform(-74.0, 40.0)[0]
    assert raw * UNITS[unit] == pytest.approx(300000, rel=1e-12)


def test_units_win_over_to_meter():
    """PROJ reads +units before +to_meter, in whatever order they stand, and so does projdist."""
    for text in ("+proj=merc +units=us-ft +to_meter=1", "+proj=merc +to_meter=1 +units=us-ft"):
        assert_same(make(text), make("+proj=merc"), *EUROPE)


def test_units_of_pipelines():
    """The last unit conversion of a pipeline gives its unit."""
    text = "+proj=pipeline +step +proj=merc +ellps=WGS84 +step +proj=unitconvert +xy_in=m +xy_out=us-ft"
    assert_same(make(text), make("+proj=merc +ellps=WGS84"), *EUROPE)


@pytest.mark.parametrize("code", [2263, 6421, 2225, 3361, 27700, 2157, 3167])
def test_units_of_crss(code):
    """The local scale of a CRS in feet, chains or metres is near 1 metre per metre, by pyproj's geodesics."""
    crs = CRS.from_epsg(code)
    projection = make(code)
    w, s, e, n = crs.area_of_use.bounds
    lon, lat = (w + e) / 2, (s + n) / 2
    geod = Geod(a=projection.ellipsoid.a, f=projection.ellipsoid.f)
    end = geod.fwd(lon, lat, 30.0, 1000.0)
    (x0, y0), (x1, y1) = projection(lon, lat), projection(end[0], end[1])
    # National grids are within 1000 ppm of true scale; a foot left over would be 0.3.
    assert np.hypot(x1 - x0, y1 - y0) == pytest.approx(1000.0, rel=2e-3)


def test_feet_of_a_state_plane():
    """EPSG:2263, in US survey feet, is pyproj's transformation times 1200/3937."""
    lon, lat = np.array([-74.0, -73.5]), np.array([40.7, 41.0])
    x, y = Transformer.from_crs("EPSG:4269", "EPSG:2263", always_xy=True).transform(lon, lat)
    np.testing.assert_allclose(make("EPSG:2263")(lon, lat), np.array([x, y]) * (1200 / 3937), rtol=1e-14)


def test_prime_meridian_of_proj_strings():
    """+pm moves the central meridian: longitudes stay Greenwich's. Paris is at 2 deg 20' 14.025" (EPSG:8903)."""
    paris = 2 + 20 / 60 + 14.025 / 3600
    projection = make("+proj=merc +pm=paris +R=6371000")
    assert projection(paris, 10.0)[0] == pytest.approx(0.0, abs=1e-8)
    np.testing.assert_allclose(projection(paris + 1, 0.0), (6371000 * math.radians(1), 0.0), rtol=1e-12, atol=1e-8)


def test_paris_meridian_and_grads():
    """EPSG:27572: its origin, 52 grads north on the meridian of Paris, is at x = 600 km, y = 2200 km (EPSG:18082)."""
    paris = 2.33722917  # EPSG:8903, 2.5969213 grads
    np.testing.assert_allclose(make("EPSG:27572")(paris, 46.8), (600000.0, 2200000.0), atol=1e-6)
    assert make("EPSG:27572").ellipsoid == Ellipsoid(6378249.2, make("EPSG:27572").ellipsoid.f)
    # Clarke 1880 (IGN) has the semi-minor axis 6356515.0 m.
    ellipsoid = make("EPSG:27572").ellipsoid
    assert ellipsoid.a * (1 - ellipsoid.f) == pytest.approx(6356515.0, abs=1e-6)


def test_rome_meridian():
    """EPSG:4806's meridian is 12 deg 27' 8.4" east of Greenwich: EPSG:26591's centre, 9 degrees of Rome, is that on."""
    assert make("EPSG:26591")(9 + 12 + 27 / 60 + 8.4 / 3600, 42.0)[0] == pytest.approx(1500000.0, abs=1e-6)


def test_ferro_meridian_and_southing():
    """EPSG:2065 (south, west, from Ferro) is EPSG:5514 (east, north, from Greenwich): one map on one ellipsoid."""
    assert_same(make("EPSG:2065"), make("EPSG:5514"), *EUROPE, atol=1e-6)
    assert_same(make("EPSG:5513"), make("EPSG:5514"), *EUROPE, atol=1e-6)
    # Krovak: the point 59 deg 45' 27" N, 42 deg 30' E of Ferro is the pole of the cone's axis (EPSG:9819).
    x, y = make("EPSG:5514")(14.4, 50.1)
    assert -800e3 < x < -700e3
    assert -1100e3 < y < -1000e3


def test_northing_first():
    """EPSG:2193 and 31466 state the northing first; x is the easting for all that."""
    projection = make("EPSG:2193")
    # NZTM 2000 (LINZS25002): origin 0, 173 E; false easting 1600 km, northing 10 000 km, k = 0.9996.
    np.testing.assert_allclose(projection(173.0, 0.0), (1600000.0, 10000000.0), atol=1e-6)
    assert projection(174.0, -41.0)[0] > 1600000
    # Zone 2 of Gauss-Krueger: centre 6 E, false easting 2 500 km.
    x, y = make("EPSG:31466")([6.0, 7.0], 51.0)
    assert x[0] == pytest.approx(2500000.0, abs=1e-6)
    assert 2.5e6 < x[1] < 2.6e6
    assert (y > 5.6e6).all()


def test_westing_and_southing():
    """EPSG:2053 counts west and south (Lo29); x grows to the east and y to the north, unmirrored, for all that."""
    x, y = make("EPSG:2053")([29.0, 30.0, 29.0], [-30.0, -30.0, -29.0])
    truth = make("+proj=tmerc +lon_0=29 +ellps=WGS84")
    np.testing.assert_allclose((x, y), truth([29.0, 30.0, 29.0], [-30.0, -30.0, -29.0]), atol=SAME)
    assert x[1] > x[0]
    assert y[2] > y[0]


def test_polar_axes():
    """Polar CRSs, whose axes point along meridians, keep x to the right and y up: 90 E is right of the south pole."""
    south = make("EPSG:3031")
    np.testing.assert_allclose(south(0.0, -90.0), (0.0, 0.0), atol=1e-6)
    x, y = south([90.0, 0.0], -75.0)
    assert x[0] > 1e6
    assert y[0] == pytest.approx(0.0, abs=1e-6)
    assert x[1] == pytest.approx(0.0, abs=1e-6)
    assert y[1] > 1e6


def test_polar_axes_in_either_order():
    """EPSG:32661 (N, E) and EPSG:5041 (E, N) are the same map: UPS North, the pole at 2000 km, 2000 km."""
    one, other = make("EPSG:32661"), make("EPSG:5041")
    lon, lat = np.array([0.0, 90.0, -135.0, 33.0]), np.array([85.0, 88.0, 84.0, 90.0])
    assert_same(one, other, lon, lat)
    np.testing.assert_allclose(one(0.0, 90.0), (2e6, 2e6), atol=1e-6)
    x, y = one(90.0, 88.0)  # right of the pole
    assert x > 2.2e6
    assert y == pytest.approx(2e6, abs=1e-6)
    # The same the other way round for the south: EPSG:32761 and EPSG:5042.
    assert_same(make("EPSG:32761"), make("EPSG:5042"), lon, -lat)


def orientation(projection, lon, lat):
    """The sign of the Jacobian, by a triangle of 0.01 degrees."""
    x, y = projection(lon + np.array([0.0, 0.01, 0.0]), lat + np.array([0.0, 0.0, 0.01]))
    return np.sign((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]))


@pytest.mark.parametrize(
    "code", [2193, 31466, 2053, 5514, 5513, 2065, 3031, 32661, 5041, 32761, 5042, 3032, 3995, 27572, 2180, 3110]
)
def test_no_crs_is_mirrored(code):
    """Whatever the order and the directions of the axes, east is clockwise of north."""
    crs = CRS.from_epsg(code)
    w, s, e, n = crs.area_of_use.bounds
    assert orientation(make(code), (w + e) / 2 + 0.1, (s + n) / 2 + 0.1) == 1


@pytest.mark.slow
@pytest.mark.parametrize("authority", ["EPSG", "ESRI", "IGNF"])
def test_no_crs_of_the_database_fails_or_is_mirrored(authority):
    """Each projected CRS of PROJ's database is refused in one line, or maps its area unmirrored."""
    infos = pyproj.database.query_crs_info(auth_name=authority, pj_types=["PROJECTED_CRS"], allow_deprecated=True)
    refused = 0
    for info in infos:
        try:
            projection = make(f"{authority}:{info.code}")
        except ProjectionError as error:
            assert "\n" not in str(error)  # noqa: PT017
            refused += 1
            continue
        if info.area_of_use is not None:
            w, s, e, n = info.area_of_use.bounds
            lon, lat = (w + (e if e >= w else e + 360)) / 2 + 0.1, (s + n) / 2 + 0.1
            assert orientation(projection, lon, lat) == 1, info
    assert refused <= 0.02 * len(infos)


# ---- wrapped CRSs ---------------------------------------------------------------------------


def test_compound_crs():
    """EPSG:7415, RD New with a height, is RD New."""
    assert_same(make("EPSG:7415"), make("EPSG:28992"), *EUROPE)
    assert_same(make("EPSG:28992+5709"), make("EPSG:28992"), *EUROPE)
    assert make("EPSG:7415").definition == "EPSG:7415"


def test_bound_crs():
    """A bound CRS (with +towgs84) is the CRS within: its shift to WGS 84 is no part of the map."""
    bound = CRS("+proj=utm +zone=32 +ellps=intl +towgs84=-87,-98,-121 +type=crs")
    assert bound.is_bound
    assert_same(make(bound), make("+proj=utm +zone=32 +ellps=intl"), *EUROPE)
    assert_same(make(bound.to_wkt()), make("+proj=utm +zone=32 +ellps=intl"), *EUROPE)


def test_three_dimensional_crs():
    """A projected CRS with an ellipsoidal height is the map without it."""
    crs = CRS("EPSG:32632").to_3d()
    assert len(crs.axis_info) == 3
    assert_same(make(crs), make("EPSG:32632"), *EUROPE)
    assert_same(make(crs.to_wkt()), make("EPSG:32632"), *EUROPE)


DERIVED = """DERIVEDPROJCRS["site grid",
  BASEPROJCRS["UTM 32N", BASEGEOGCRS["WGS 84", DATUM["World Geodetic System 1984",
      ELLIPSOID["WGS 84",6378137,298.257223563,LENGTHUNIT["metre",1]]],
      PRIMEM["Greenwich",0,ANGLEUNIT["degree",0.0174532925199433]]],
    CONVERSION["UTM zone 32N", METHOD["Transverse Mercator",ID["EPSG",9807]],
      PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],
      PARAMETER["Longitude of natural origin",9,ANGLEUNIT["degree",0.0174532925199433]],
      PARAMETER["Scale factor at natural origin",0.9996,SCALEUNIT["unity",1]],
      PARAMETER["False easting",500000,LENGTHUNIT["metre",1]],
      PARAMETER["False northing",0,LENGTHUNIT["metre",1]]]],
  DERIVINGCONVERSION["turned", METHOD["Affine parametric transformation",ID["EPSG",9624]],
    PARAMETER["A0",100,LENGTHUNIT["metre",1],ID["EPSG",8623]],
    PARAMETER["A1",0.6,SCALEUNIT["coefficient",1],ID["EPSG",8624]],
    PARAMETER["A2",0.8,SCALEUNIT["coefficient",1],ID["EPSG",8625]],
    PARAMETER["B0",200,LENGTHUNIT["metre",1],ID["EPSG",8639]],
    PARAMETER["B1",-0.8,SCALEUNIT["coefficient",1],ID["EPSG",8640]],
    PARAMETER["B2",0.6,SCALEUNIT["coefficient",1],ID["EPSG",8641]]],
  CS[Cartesian,2],
    AXIS["site east",east,ORDER[1],LENGTHUNIT["metre",1]],
    AXIS["site north",north,ORDER[2],LENGTHUNIT["metre",1]]]"""


def test_derived_projected_crs():
    """A site grid derived from UTM by an affine map (EPSG:9624) is that affine map of UTM."""
    x, y = make("EPSG:32632")(*EUROPE)
    site = make(DERIVED)(*EUROPE)
    np.testing.assert_allclose(site, (100 + 0.6 * x + 0.8 * y, 200 - 0.8 * x + 0.6 * y), rtol=1e-13)


# ---- ellipsoids and datums ------------------------------------------------------------------

# Semi-major axis and inverse flattening: PROJ's own tables quote DMA TR 8350.2, appendix A, for these.
ELLIPSOIDS = {
    "": (6378137.0, 298.257222101),  # PROJ's default is GRS 80
    "+ellps=WGS84": (6378137.0, 298.257223563),
    "+ellps=intl": (6378388.0, 297.0),
    "+ellps=bessel": (6377397.155, 299.1528128),
    "+ellps=clrk66": (6378206.4, 6378206.4 / (6378206.4 - 6356583.8)),
    "+ellps=krass": (6378245.0, 298.3),
    "+a=6378000 +rf=298": (6378000.0, 298.0),
    "+a=6378000 +b=6356000": (6378000.0, 6378000 / 22000),
    "+a=6378000 +es=0.006": (6378000.0, 1 / (1 - math.sqrt(1 - 0.006))),
    "+a=6378000 +f=0.003": (6378000.0, 1 / 0.003),
    "+datum=WGS84": (6378137.0, 298.257223563),
    "+datum=potsdam": (6377397.155, 299.1528128),
    "+datum=NAD27": (6378206.4, 6378206.4 / (6378206.4 - 6356583.8)),
}


@pytest.mark.parametrize("text", ELLIPSOIDS)
def test_ellipsoids_of_proj_strings(text):
    """The ellipsoid is what the string states, in any of PROJ's ways to state one, alone and in a pipeline."""
    a, rf = ELLIPSOIDS[text]
    for definition in (f"+proj=merc {text}", f"+proj=pipeline +step +proj=merc {text} +step +proj=noop"):
        ellipsoid = make(definition).ellipsoid
        assert ellipsoid.a == pytest.approx(a, rel=1e-15)
        assert pytest.approx(1 / rf, rel=1e-11) == ellipsoid.f


@pytest.mark.parametrize(
    ("text", "radius"),
    [
        ("+R=1", 1.0),
        ("+R=6371000", 6371000.0),
        ("+ellps=sphere", 6370997.0),
        ("+a=6378137 +b=6378137", 6378137.0),
        ("+ellps=WGS84 +R_A", math.sqrt(WGS84.area / (4 * math.pi))),
        ("+ellps=WGS84 +R_a", WGS84.a * (1 - WGS84.f / 2)),
        ("+ellps=WGS84 +R_V", WGS84.a * (1 - WGS84.f) ** (1 / 3)),
        ("+ellps=WGS84 +R_lat_g=45", math.sqrt(math.prod(map(float, WGS84.radii(45.0))))),
    ],
)
def test_spheres_of_proj_strings(text, radius):
    """A sphere is recognised as one, of the radius of equal area, mean radius and so on that the string asks for."""
    ellipsoid = make(f"+proj=merc {text}").ellipsoid
    assert ellipsoid.is_sphere
    # PROJ's R_A is a series in e^2, to 1e-11.
    assert ellipsoid.a == pytest.approx(radius, rel=1e-9)


SHIFTS = {
    "+datum=potsdam": "+ellps=bessel",
    "+datum=OSGB36": "+ellps=airy",
    "+datum=hermannskogel": "+ellps=bessel",
    "+datum=NAD27": "+ellps=clrk66",
    "+datum=ire65": "+ellps=mod_airy",
    "+ellps=intl +towgs84=-87,-98,-121": "+ellps=intl",
    "+ellps=bessel +towgs84=598.1,73.7,418.2,0.202,0.045,-2.455,6.7": "+ellps=bessel",
    "+a=6378137 +b=6378137 +nadgrids=@null": "+R=6378137",
    "+ellps=clrk66 +nadgrids=@conus,@alaska": "+ellps=clrk66",
    "+ellps=GRS80 +geoidgrids=@nosuch.gtx +vunits=ft": "+ellps=GRS80",
}


@pytest.mark.parametrize("text", SHIFTS)
def test_datum_shifts_are_no_part_of_the_map(text):
    """+datum, +towgs84 and grids move nothing: the map is that of the bare ellipsoid."""
    for projection in ("+proj=tmerc +lon_0=9", "+proj=robin"):
        assert_same(make(f"{projection} {text}"), make(f"{projection} {SHIFTS[text]}"), *EUROPE)
        assert make(f"{projection} {text}").ellipsoid.a == make(f"{projection} {SHIFTS[text]}").ellipsoid.a


def test_other_planets():
    """A Martian CRS is measured on Mars (IAU 2015: 3396190 m), a sphere of a metre on that sphere."""
    mars = make("IAU_2015:49910")
    assert mars.ellipsoid == Ellipsoid(3396190.0, 0.0)
    assert mars(90.0, 0.0)[0] == pytest.approx(3396190 * math.pi / 2)
    assert make("+proj=eqc +R=1")(90.0, 0.0)[0] == pytest.approx(math.pi / 2)


# ---- facts of a projection ------------------------------------------------------------------


def test_names_definitions_and_areas():
    """A projection tells its name, a definition that gives it back, and its area of use where there is one."""
    utm = make("EPSG:32632")
    assert (utm.name, utm.definition) == ("WGS 84 / UTM zone 32N", "EPSG:32632")
    assert utm.area_of_use == (6.0, 0.0, 12.0, 84.0)
    assert make(32632).definition == make(CRS(32632)).definition == "EPSG:32632"
    assert make("robin").name == "Robinson"
    assert make("+proj=robin").name == "Robinson"
    assert make("+proj=robin").definition == "+proj=robin"
    assert make("robin").area_of_use is None
    custom = make(CRS("+proj=laea +lat_0=12 +ellps=intl +type=crs"))
    assert_same(make(custom.definition), custom, *EUROPE)


def test_labels():
    """The definition where it is short enough for a table, the name where it is WKT."""
    for value in ("EPSG:3035", "robin", "+proj=utm +zone=33 +ellps=intl", mercator):
        assert make(value).label == make(value).definition
    custom = make(
        CRS("EPSG:32632").to_wkt().replace("WGS 84 / UTM zone 32N", "my grid").replace(',ID["EPSG",32632]', "")
    )
    assert custom.definition.startswith("PROJCRS[")
    assert (custom.label, custom.name) == ("my grid", "my grid")
    unnamed = make(CRS("+proj=laea +lat_0=52 +towgs84=1,2,3 +type=crs").to_wkt())
    assert (unnamed.label, unnamed.name) == ("Lambert Azimuthal Equal Area",) * 2


@pytest.mark.parametrize("value", ["EPSG:3857", "+proj=wintri +R=6371008.7714", "+proj=utm +zone=33 +ellps=intl"])
def test_pyproj_proj(value):
    """A pyproj.Proj, which can be called as a function, is the CRS or PROJ string that it was made from."""
    projection = make(pyproj.Proj(value))
    assert_same(projection, make(value))
    assert projection.ellipsoid == make(value).ellipsoid


def test_the_name_is_of_the_operation_that_runs():
    """PROJ runs the first of two +proj; so the name is the first's."""
    assert make("+proj=moll +proj=merc").name == "Mollweide"


# ---- errors ---------------------------------------------------------------------------------

EVERYTHING = (
    r"It must be a PROJ id or a name \(see 'projdist list projections'\), a PROJ string, an EPSG: or ESRI: code, "
    r"WKT, PROJJSON, the path of a \.prj or \.wkt file, a pyproj CRS, or a function of \(lon, lat\)\."
)
GEOGRAPHIC = CRS("EPSG:4326")

# Each input with what the message must say of it, besides the input itself.
ERRORS = {
    "": EVERYTHING,
    "   ": EVERYTHING,
    "robn": rf"Did you mean robin\? {EVERYTHING}",
    "complete nonsense": EVERYTHING,
    "EPSG:9999999": rf"EPSG has no such CRS in PROJ's database\. {EVERYTHING}",
    "ESPG:3035": rf"Did you mean EPSG:3035\? {EVERYTHING}",
    "EPSG:": EVERYTHING,
    "EPSG:abc": EVERYTHING,
    "EPSG:4326": r"It is a Geographic 2D CRS \(WGS 84\), which has no map plane; it must be a projected CRS",
    "EPSG:4979": r"It is a Geographic 3D CRS \(WGS 84\), which has no map plane; it must be a projected CRS",
    "EPSG:4978": r"It is a Geocentric CRS \(WGS 84\), which has no map plane; it must be a projected CRS",
    "EPSG:5773": r"It is a Vertical CRS \(EGM96 height\), which has no map plane; it must be a projected CRS",
    "EPSG:9518": r"Geographic 2D CRS \(WGS 84\), which has no map plane; it must be a projected CRS",
    "OGC:CRS84": r"It is a Geographic 2D CRS \(WGS 84 \(CRS84\)\), which has no map plane",
    "cart": r"PROJ's Geodetic/cartesian conversions is not a map projection\.",
    "helmert": r"is not a map projection\.",
    "lcc": r"It needs lat_1 and lat_2: give a PROJ string, such as '\+proj=lcc \+lat_1=30 \+lat_2=60 \+R=",
    "+proj=longlat +ellps=WGS84": r"PROJ's longlat is not a map projection\.",
    "+proj=geocent +ellps=WGS84": r"PROJ's geocent is not a map projection\.",
    "+proj=mercc": r"PROJ says: Unknown projection\. Did you mean merc",
    "+proj=robinson": r"PROJ says: Unknown projection\. Did you mean robin\?$",
    "+proj=nosuch": r"PROJ says: Unknown projection\.$",
    "+proj=pipeline +step +proj=mollwide +step +proj=noop": r"Did you mean moll\?$",
    "+proj=ob_tran +o_proj=mollwide +o_lat_p=45": r"Did you mean moll\?$",
    "+proj=": r"PROJ says: ",
    "+proj=lcc +ellps=GRS80": r"PROJ says: lcc: Invalid value for lat_1 and lat_2: \|lat_1 \+ lat_2\| should be > 0\.",
    "+proj=utm +zone=99": r"PROJ says: utm: Invalid value for zone\.",
    "+proj=merc +ellps=nosuch": r"PROJ says: ",
    "+proj=merc +datum=nosuch": r"PROJ says: Unknown value for datum\.",
    "+proj=merc +units=cubits": r"PROJ says: merc: Invalid value for units\.",
    "+proj=merc +to_meter=0": r"PROJ says: merc: Invalid value for to_meter\.",
    "+proj=merc +to_meter=x": r"It must be metres, as a number\.",
    "+proj=pipeline": r"PROJ says: ",
    "+proj=pipeline +step +proj=noop": r"It must take longitude and latitude and return a plane, as a map does\.",
    "+proj=pipeline +step +proj=longlat": r"It must take longitude and latitude and return a plane, as a map does\.",
    "+proj=pipeline +step +proj=merc +step +proj=unitconvert +xy_in=m +xy_out=deg": r"not a plane in metres\.",
    "+proj=ob_tran +o_proj=longlat +o_lat_p=30 +o_lon_p=0": r"(plane|is not a map)",
    "nosuch.prj": r"It cannot be read as text: .*No such file",
    "nul\0.prj": r"It cannot be read as text: embedded null",
    "EPSG:3035\0x": r"It has a null character\.$",
    'PROJCS["x"]': EVERYTHING,
    '{"a": 1}': EVERYTHING,
    "{": EVERYTHING,
}
OBJECTS = {"None": None, "a float": 1.5, "a list": [], "an object": object(), "bytes": b"robin", "a bool": True}


def message(value):
    with pytest.raises(ProjectionError, match=r"^Invalid ") as error:
        make(value)
    return str(error.value)


@pytest.mark.parametrize("value", ERRORS)
def test_errors_say_what_was_given_and_what_is_allowed(value):
    """Text that names no map is refused in one line with the text, the reason and what would do."""
    text = message(value)
    assert f"'{value.strip()}'" in text
    assert re.search(ERRORS[value], text), text
    assert "\n" not in text
    assert text.endswith((".", ")", "?")), text
    assert text.count("(") == text.count(")"), text


@pytest.mark.parametrize("kind", OBJECTS)
def test_objects_that_are_no_maps(kind):
    """None, numbers and other objects are refused in one line, with all that is allowed."""
    text = message(OBJECTS[kind])
    assert str(OBJECTS[kind]) in text
    assert re.search(EVERYTHING, text)
    assert "\n" not in text


# A mistyped name, and the suggestions: all of them, in their order.
TYPOS = {
    "robinsn": "robinson or robin",
    "Mollwide": "mollweide",
    "winkle-tripel": "winkel-tripel",
    "equalearth": "equal-earth or eqearth",
    "plate caree": "plate-carree",
    "mercador": "mercator",
    "gall_petres": "gall-peters",
    "eckert": "eckert-1, eckert-2, eckert-3, eckert-4, eckert-5 or eckert-6",
    "Albers": "aea",
    "lambert conformal conic": "lcc or lcca",
    "web mercator": "webmerc",
    "robinson projection": "robinson",
    "hammer-aitoff": "hammer",
    "utm33": "utm",
    "3035": "EPSG:3035",
    "epsg 3035": "EPSG:3035",
    "EPSG3035": "EPSG:3035",
    "ESPG:3035": "EPSG:3035",
    "esri54009": "ESRI:54009",
}


@pytest.mark.parametrize("text", TYPOS)
def test_typos_of_names_have_a_hint(text):
    """What was nearly typed, begun, or said in the words of PROJ's description is suggested, and nothing else."""
    assert f". Did you mean {TYPOS[text]}? It must be" in message(text)


NONSENSE = """nosuch bad foo bar foobar hello test nothing asdf qwerty xyz projection sphere globe world nonsense europe
    random computer anything x 42 99999 4326 EPSG:99999 ESPG:99999 nosuch:3035 dymaxion""".split()


@pytest.mark.parametrize("text", NONSENSE)
def test_nonsense_has_no_hint(text):
    """What is like no name has none suggested, and a code that does not exist no other code."""
    assert "Did you mean" not in message(text)


@pytest.mark.slow
def test_one_wrong_letter_is_no_obstacle():
    """A name with one letter missing, doubled or swapped with the next is suggested, nineteen times of twenty."""
    found = []
    for name in [*projection_names()][::8]:
        for k in range(len(name) - 1):
            typos = (
                name[:k] + name[k + 1 :],
                name[:k] + name[k] + name[k:],
                name[:k] + name[k + 1] + name[k] + name[k + 2 :],
            )
            found += [name in message(typo) for typo in typos if typo not in projection_names()]
    assert np.mean(found) > 0.95


WKT = CRS("EPSG:32632").to_wkt()
GARBAGE = ["garbage", "]", " x", "\n'", WKT, f",{WKT}", ",", ';PROJCS["x"]', ',VERTCS["x"] y']


@pytest.mark.parametrize("garbage", GARBAGE, ids=range(len(GARBAGE)))
@pytest.mark.parametrize("version", ["WKT1_GDAL", "WKT1_ESRI", "WKT2_2019"])
def test_text_behind_wkt(version, garbage, tmp_path):
    """What stands behind the last bracket, which PROJ would pass over, is refused, in a file too."""
    text = CRS("EPSG:32632").to_wkt(version) + garbage
    (tmp_path / "map.prj").write_text(text, encoding="utf-8")
    for value in (text, tmp_path / "map.prj"):
        assert "WKT must end with its last bracket, and not with '" in message(value)


@pytest.mark.parametrize("space", [" ", "\n", "\r\n\t"])
def test_white_space_around_wkt(space):
    """Spaces and line ends before and behind WKT are no part of it; nor are brackets within names."""
    named = CRS("EPSG:32632").to_wkt("WKT1_GDAL").replace("WGS 84 / UTM zone 32N", 'a ]] ""b"" ([')
    for text in (WKT, CRS("EPSG:32632").to_wkt(pretty=True), named):
        assert_same(make(f"{space}{text}{space}"), make("EPSG:32632"), *EUROPE)


def test_esri_wkt_of_compound_crss():
    """Esri writes a compound CRS as PROJCS[...],VERTCS[...]."""
    text = CRS("EPSG:7415").to_wkt("WKT1_ESRI")
    assert ",VERTCS[" in text
    assert_same(make(text), make("EPSG:28992"), *EUROPE, atol=1e-6)


# The UTM grid systems have no zone; the others a projection or a variant that PROJ does not have.
IMPOSSIBLE = ["EPSG:32600", "EPSG:32700", "EPSG:2218", "EPSG:2985", "EPSG:2963", "EPSG:3144", "ESRI:53025"]


@pytest.mark.parametrize("code", IMPOSSIBLE)
def test_crss_that_proj_cannot_compute(code):
    """A projected CRS for which PROJ has no operation is refused when it is made, in one line, not when it is used."""
    text = message(code)
    assert code in text
    assert "\n" not in text


@pytest.mark.parametrize(
    "value",
    [GEOGRAPHIC.to_wkt(pretty=True), GEOGRAPHIC.to_json(pretty=True), GEOGRAPHIC, GEOGRAPHIC.to_json_dict()],
    ids=["wkt", "json", "crs", "dict"],
)
def test_errors_of_long_definitions_are_one_short_line(value):
    """WKT and JSON of many lines are quoted by their beginning, in one line."""
    text = message(value)
    assert "Geographic 2D CRS (WGS 84), which has no map plane; it must be a projected CRS" in text
    assert "\n" not in text
    assert len(text) < 300


@pytest.mark.parametrize("value", ["+proj=nosuch\n+R=1", "+proj=longlat\n +R=1", "GEOGCS[\n'x']", "no\nname"])
def test_errors_of_text_in_lines_are_one_line(value):
    """Whatever is quoted, a message is one line."""
    assert "\n" not in message(value)


def test_errors_of_files(tmp_path):
    """Files that are missing, empty, binary, or hold no map are refused by their name."""
    empty, binary, geographic, nonsense = (tmp_path / f"{name}.prj" for name in ("empty", "binary", "geo", "nonsense"))
    empty.write_text(" \n", encoding="utf-8")
    binary.write_bytes(b"\xff\xfe\x00\x01")
    geographic.write_text(GEOGRAPHIC.to_wkt("WKT1_ESRI"), encoding="utf-8")
    nonsense.write_text("first line\nsecond line", encoding="utf-8")
    reasons = {
        empty: "It must hold WKT, PROJJSON or a PROJ string.",
        binary: "It cannot be read as text:",
        tmp_path: "It cannot be read as text:",
        tmp_path / "missing.prj": "No such file or directory",
        geographic: "no map plane",
        nonsense: "",
    }
    for path, reason in reasons.items():
        text = message(path)
        assert reason in text
        assert "\n" not in text
        assert str(path) in text


def test_errors_are_value_errors():
    """ProjectionError is a ValueError, and keeps PROJ's own error as its cause."""
    with pytest.raises(ValueError, match=r"^Invalid PROJ string") as error:
        make("+proj=utm +zone=99")
    assert isinstance(error.value, ProjectionError)
    assert isinstance(error.value.__cause__, pyproj.exceptions.ProjError)


def test_wkt_of_everything_is_json_too():
    """PROJJSON text and its dict name the same CRS."""
    text = CRS("EPSG:2056").to_json()
    assert make(text) == make(json.loads(text))


@pytest.mark.parametrize("code", ["ESRI:102060", "ESRI:102166", "EPSG:3035", "EPSG:32661", "EPSG:27572"])
def test_the_conversion_alone(code):
    """No shift of datum, though PROJ's database has some between a CRS and its own geodetic CRS (1 cm, 4 cm)."""
    crs = CRS(code)
    west, south, east, north = crs.area_of_use.bounds
    lon, lat = (west + east) / 2, (south + north) / 2
    alone = CRS.from_wkt(crs.to_wkt())
    truth = Transformer.from_crs(alone.geodetic_crs, alone, always_xy=True)
    u, v = truth.transform(*((lon - 2.33722916667) / 0.9, lat / 0.9) if code == "EPSG:27572" else (lon, lat))
    np.testing.assert_allclose(
        [float(value) for value in Projection.from_user_input(code)(lon, lat)], [u, v], atol=1e-3
    )
