"""Projections as values and facts: equal, hashed, pickled, in threads; what they tell of themselves."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from projection_points import EUROPE, assert_same, make, mercator
from pyproj import CRS
from tables import each

SOME = ["moll", "+proj=utm +zone=33 +ellps=intl +units=us-ft", "EPSG:3035", "EPSG:27572", "EPSG:2065", mercator]


@each("value", SOME)
def test_projections_are_values(value):
    """Frozen; equal to another of one definition, and one key of a dict; pickled before and after its first use."""
    projection = make(value)
    with pytest.raises(AttributeError, match="cannot assign to field 'name'"):
        projection.name = "other"
    assert projection != make("+proj=robin +lon_0=7")
    for _ in range(2):  # the cached transformer is no part of the value
        assert projection == make(value)
        assert len({projection, make(value)}) == 1
        copy = pickle.loads(pickle.dumps(projection))
        assert (copy, hash(copy)) == (projection, hash(projection))
        assert_same(copy, projection, *EUROPE, atol=0)


@pytest.mark.slow
@each("value", SOME[:-1])
def test_threads(value):
    """One projection shared by eight threads gives what it gives serially."""
    projection = make(value)
    parts = np.random.default_rng(8).uniform((0.0, 40.0), (20.0, 60.0), (64, 500, 2))
    with ThreadPoolExecutor(8) as pool:
        threaded = list(pool.map(lambda part: projection(*part.T), parts))
    np.testing.assert_array_equal(threaded, [projection(*part.T) for part in parts])


@each("value", ["moll", "EPSG:3035", "EPSG:27572", mercator])
def test_shapes(value):
    """Any shapes of lon and lat broadcast, scalars and empty arrays too; the arguments are not written to."""
    projection = make(value)
    lon, lat = np.array([[1.0, 2.0, 3.0]]), np.array([[46.0], [47.0]])
    x, y = projection(lon, lat)
    assert x.shape == y.shape == (2, 3)
    assert (lon.tolist(), lat.tolist()) == ([[1.0, 2.0, 3.0]], [[46.0], [47.0]])
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
    fixed = lon.astype(float)
    truth = np.array(projection(fixed, lat.astype(float)))
    fixed.flags.writeable = False
    for one in (lon, fixed, np.asfortranarray(lon)):
        np.testing.assert_array_equal(projection(one, lat), truth)
    np.testing.assert_array_equal(projection(lon.T, lat.T), np.swapaxes(truth, 1, 2))
    np.testing.assert_array_equal(projection(lon[::2, ::-1], lat[::2, ::-1]), truth[:, ::2, ::-1])


WORLD = ["moll", "robin", "eqc", "sinu", "laea", "+proj=utm +zone=32", "ESRI:54009", "EPSG:3857", "EPSG:27572"]


@each("value", WORLD)
def test_longitudes_beyond_180(value):
    projection = make(value)
    lon, lat = np.array([-170.0, -75.0, -0.5, 3.0, 10.0]), np.array([-20.0, 42.0, 47.0, 46.0, 45.0])
    x, y = projection(lon, lat)
    # Rounding of a longitude of 360 is 4e-14 degrees, 4 nm; far from a transverse meridian it is stretched.
    for turn in (360, -360):
        np.testing.assert_allclose(projection(lon + turn, lat), (x, y), rtol=1e-13, atol=1e-6)


@each("value", [*WORLD, "merc", "stere", "gnom", "ortho", "igh", "EPSG:2065", "EPSG:7415"])
def test_undefined_points_are_nan(value):
    """NaN and infinite coordinates and latitudes beyond the poles are NaN, and spoil no other point."""
    projection = make(value)
    lon = np.array([5.0, np.nan, 5.0, np.nan, np.inf, 5.0, 5.0, 5.0, 5.0, 6.0])
    lat = np.array([52.0, 52.0, np.nan, np.nan, 52.0, np.inf, 90.001, -95.0, 180.0, 53.0])
    x, y = projection(lon, lat)
    np.testing.assert_array_equal(np.isnan(x), [False, *[True] * 8, False])
    np.testing.assert_array_equal(np.isnan(y), np.isnan(x))
    np.testing.assert_array_equal([x[[0, -1]], y[[0, -1]]], projection(lon[[0, -1]], lat[[0, -1]]))
    if value in ("gnom", "ortho"):  # which end at the horizon
        x, _ = projection([0.0, 80.0, 100.0, 180.0], 0.0)
        np.testing.assert_array_equal(np.isnan(x), [False, False, True, True])


def test_names_definitions_and_areas():
    """A projection tells its name, a definition that gives it back, and its area of use where there is one."""
    utm = make("EPSG:32632")
    assert (utm.name, utm.definition) == ("WGS 84 / UTM zone 32N", "EPSG:32632")
    assert utm.area_of_use == (6.0, 0.0, 12.0, 84.0)
    assert make(32632).definition == make(CRS(32632)).definition == "EPSG:32632"
    assert make("robin").name == make("+proj=robin").name == "Robinson"
    assert make("+proj=moll +proj=merc").name == "Mollweide"  # PROJ runs the first
    assert (make("+proj=robin").definition, make("robin").area_of_use) == ("+proj=robin", None)
    custom = make(CRS("+proj=laea +lat_0=12 +ellps=intl +type=crs"))
    assert_same(make(custom.definition), custom, *EUROPE)


def test_labels():
    """The definition where it is short enough for a table, the name where it is WKT."""
    for value in ("EPSG:3035", "robin", "+proj=utm +zone=33 +ellps=intl", mercator):
        assert make(value).label == make(value).definition
    wkt = CRS("EPSG:32632").to_wkt().replace("WGS 84 / UTM zone 32N", "my grid")
    custom = make(wkt.replace(',ID["EPSG",32632]', ""))
    assert (custom.definition[:8], custom.label, custom.name) == ("PROJCRS[", "my grid", "my grid")
    unnamed = make(CRS("+proj=laea +lat_0=52 +towgs84=1,2,3 +type=crs").to_wkt())
    assert (unnamed.label, unnamed.name) == ("Lambert Azimuthal Equal Area",) * 2


@each(("text", "code"), [
    *((text, "EPSG:32633") for text in ("WGS 84 / UTM zone 33N", "wgs84 / utm zone 33n", "utm33")),
    *(("CH1903+ / LV95", "EPSG:2056"), ("CH1903 / LV03", "EPSG:21781"), ("World_Robinson", "ESRI:54030")),
    *(("2056", "EPSG:2056"), ("EPSG3857", "EPSG:3857"), ("102003", "ESRI:102003"), ("esri54009", "ESRI:54009")),
    *(("UTM 33S", "EPSG:32733"), ("utm-zone-1n", "EPSG:32601"), ("utm_60", "EPSG:32660")),
])  # fmt: skip
def test_names_of_crss(text, code):
    """As in PROJ's database, or a zone of UTM on WGS 84; a number is EPSG's, or Esri's if EPSG has none of it."""
    assert make(text).definition == code
