"""CRSs as the CF conventions have them: maps of grid mappings without WKT are those of PROJ, or are refused by name."""

import json
import re
import types
import warnings

import numpy as np
import pytest
from projection_points import make, message
from pyproj import CRS, Transformer
from tables import each

from projdist import Notice
from projdist.projections.crs import crs_of_grid_mapping

SIZES = {"semi_major_axis": 6378137.0, "inverse_flattening": 298.257223563}
MARS = {"semi_major_axis": 3396190.0, "semi_minor_axis": 3376200.0, "inverse_flattening": 169.89}
WGS84 = {"horizontal_datum_name": "WGS 84"}  # which pyproj reads forty times as fast
CONE = {"grid_mapping_name": "lambert_conformal_conic", "longitude_of_central_meridian": -95.0, **WGS84}
CONE |= {"latitude_of_projection_origin": 40.0, "standard_parallel": 25.0}
CYLINDER = {"grid_mapping_name": "mercator", "longitude_of_projection_origin": 0.0, "standard_parallel": 30.0}
SATELLITE = {"grid_mapping_name": "geostationary", "longitude_of_projection_origin": 9.5, **WGS84}
SATELLITE |= {"perspective_point_height": 35785831.0}
OBLIQUE = {"grid_mapping_name": "oblique_mercator", "azimuth_of_central_line": 30.0, **WGS84}
OBLIQUE |= {"latitude_of_projection_origin": 46.0, "longitude_of_projection_origin": 7.0}
OBLIQUE |= {"scale_factor_at_projection_origin": 0.9996}
SAME = 1e-8  # metres: parameters are handed on as they are


def variable(attributes):
    """A variable as netCDF4 has them: its attributes are asked for by name."""
    return types.SimpleNamespace(ncattrs=attributes.keys, getncattr=attributes.get)


def data_array(attributes):
    return pytest.importorskip("xarray").DataArray(0, attrs=attributes)


def attributes_of(code):
    """What pyproj writes of a registered CRS, without the WKT that says all."""
    with warnings.catch_warnings(action="ignore"):
        found = CRS.from_epsg(code).to_cf()
    del found["crs_wkt"]
    return found


def coordinates(given, lon, lat):
    """Coordinates in the CRS of a grid mapping, of longitudes and latitudes of its own."""
    crs = crs_of_grid_mapping(given)
    return Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(lon, lat)


# Every projection of CF that registered CRSs have, in either hemisphere, with scales and with parallels.
@each("code", [32719, 27700, 2154, 3112, 3035, 3571, 5070, 3994, 3413, 3031, 5041, 6933, 2056])
def test_attributes_of_registered_crss(code):
    """They make the map that the registry has, in all of its area of use, without a word."""
    crs = CRS.from_epsg(code)
    west, south, east, north = crs.area_of_use.bounds
    lon = np.linspace(west, east if east > west else east + 360.0, 7)[1:-1]
    lon, lat = np.meshgrid(lon, np.linspace(south, north, 7)[1:-1])
    truth = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(lon, lat)
    np.testing.assert_allclose(coordinates(attributes_of(code), lon, lat), truth, rtol=0, atol=SAME)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [dict, variable, data_array, json.dumps])
def test_kinds_of_grid_mappings(kind):
    """A dictionary, variables of netCDF4 and xarray, and JSON; the WKT that they have, too, is taken first."""
    given, lon, lat = attributes_of(3035), np.array([4.9, 16.6]), np.array([52.4, 49.2])
    truth = Transformer.from_crs(4258, 3035, always_xy=True).transform(lon, lat)
    for one in (given, given | {"spatial_ref": CRS.from_epsg(3035).to_wkt(), "false_easting": 0.0}):
        np.testing.assert_allclose(make(kind(one))(lon, lat), truth, rtol=0, atol=SAME)


ORIGIN, SWEEP = "+lat_0=40 +lon_0=-95", "geos +h=35785831 +lon_0=9.5 +sweep"
MAPS = [
    # One parallel is both, and is not the latitude of the origin; a list has the second.
    *((CONE | {"standard_parallel": one}, f"lcc +lat_1=25 +lat_2=25 {ORIGIN}") for one in (25.0, [25.0])),
    (CONE | {"standard_parallel": np.array([25.0, 60.0])}, f"lcc +lat_1=25 +lat_2=60 {ORIGIN}"),
    # The sweep is stated, or the other axis, which is fixed: GOES has x, Meteosat y.
    *((SATELLITE | one, f"{SWEEP}=x") for one in ({"sweep_angle_axis": "x"}, {"fixed_angle_axis": "y"})),
    *((SATELLITE | one, f"{SWEEP}=y") for one in ({}, {"sweep_angle_axis": "y"}, {"fixed_angle_axis": "x"})),
    # The grid is turned by the azimuth of the line, as CF states no other angle.
    (OBLIQUE, "omerc +alpha=30 +gamma=30 +lat_0=46 +lonc=7 +k_0=0.9996"),
]


@each(("given", "string"), MAPS)
def test_attributes_make_the_map_of_a_string(given, string):
    lon, lat = [12.0, -20.0], [52.0, 10.0]
    truth = Transformer.from_pipeline(f"+proj={string} +ellps=WGS84").transform(lon, lat)
    np.testing.assert_allclose(coordinates(given, lon, lat), truth, rtol=0, atol=SAME)


def test_a_cone_without_a_latitude_has_lost_its_scale():
    """As pyproj writes cones of one parallel: the scale is told to be missing, and the map is as much too large."""
    crs = CRS.from_epsg(2062)
    values = {item.name: item.value for item in crs.coordinate_operation.params}
    with pytest.warns(Notice, match=r"states no Scale factor at natural origin \(scale_factor\)"):
        x, y = coordinates(attributes_of(2062), -1.3, 38.0)
    u, v = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(-1.3, 38.0)
    k, east, north = (values[name] for name in ("Scale factor at natural origin", "False easting", "False northing"))
    np.testing.assert_allclose([(x - east) * k, (y - north) * k], [u - east, v - north], rtol=0, atol=SAME)


@each(("given", "words"), [
    (CONE, "longitude_of_central_meridian: .* needs the Longitude of false origin .central_meridian.*$"),
    (CONE, "standard_parallel: .* needs the Latitude of 1st standard parallel .standard_parallel_1. and the"),
    (CYLINDER, "longitude_of_projection_origin: .* needs the Longitude of natural origin"),
    (SATELLITE, "perspective_point_height: .* needs the Satellite Height"),
    (OBLIQUE, "azimuth_of_central_line: .* needs the Azimuth"),
])  # fmt: skip
def test_missing_and_misspelt_attributes_are_named(given, words):
    """Without one the map is refused, and a letter too many is told with what was meant."""
    key, said = words.split(": ")
    rest = {name: value for name, value in (given | WGS84).items() if name != key}
    assert re.match(f"Invalid CRS '{given['grid_mapping_name']}'{said}", message(rest))
    assert f"no use for '{key}s'. Did you mean {key}" in message(rest | {f"{key}s": given[key]})
    conical = message(given | WGS84 | {"grid_mapping_name": "lambert_conical"})
    assert conical.endswith("know the method 'lambert_conical'.")


@each("value", ["25", "35 50", "x", [], np.nan, np.inf, True, None, [25.0, "60"]])
@each("key", ["standard_parallel", "false_easting", "semi_major_axis"])
def test_attributes_that_are_no_numbers_are_named(key, value):
    assert f"'lambert_conformal_conic'. Its {key} is " in message(CONE | {key: value})


@pytest.mark.slow
@each(("sizes", "key"), [
    *(({key: value}, key) for key, value in MARS.items()),
    (SIZES | {"semi_minor_axis": 6356256.9}, "inverse_flattening"),
    ({"earth_radius": 6371229.0, "horizontal_datum_name": "WGS 84"}, "earth_radius"),
])  # fmt: skip
def test_sizes_that_make_no_figure_are_refused(sizes, key):
    """PROJ would take WGS 84 in silence, or one of two that contradict each other."""
    assert f"Invalid grid mapping 'mercator'. Its {key} is " in message(CYLINDER | sizes)


@pytest.mark.slow
@each(("sizes", "a", "b"), [
    ({"earth_radius": np.array([3396190.0])}, 3396190.0, 3396190.0),
    ({"earth_radius": np.float32(6371229.0)}, 6371229.0, 6371229.0),
    ({"semi_major_axis": [6377397.155], "semi_minor_axis": np.float32(6356078.963)}, 6377397.155, 6356079.0),
    ({"semi_major_axis": 6400000, "inverse_flattening": 0}, 6.4e6, 6.4e6),
    ({"reference_ellipsoid_name": "Bessel 1841"}, 6377397.155, 6377397.155 * (1 - 1 / 299.1528128)),
    ({"horizontal_datum_name": "North American Datum 1927"}, 6378206.4, 6356583.8),
    ({"geographic_crs_name": "WGS 84"}, 6378137.0, 6378137.0 * (1 - 1 / 298.257223563)),
])  # fmt: skip
def test_figures(sizes, a, b):
    """Sizes as numbers or, as files have them, lists of one; and names, without a word."""
    figure = crs_of_grid_mapping(CYLINDER | sizes).ellipsoid
    assert (figure.semi_major_metre, figure.semi_minor_metre) == pytest.approx((a, b), rel=1e-9)


NOTHING = {}, {"prime_meridian_name": "Paris"}, {"horizontal_datum_name": "nonsense"}
UNSTATED = r"^The grid mapping 'mercator' states no figure of the Earth: that of WGS 84 is"


@each(("given", "said"), [
    *((CYLINDER | more, UNSTATED) for more in NOTHING),
    (CONE | {"standard_parallel": [35.0, 50.0, 60.0]}, r"states 'standard_parallel_3' \(60\), of which"),
])  # fmt: skip
def test_what_is_not_stated_or_of_no_use_is_told(given, said):
    with pytest.warns(Notice, match=said):
        assert crs_of_grid_mapping(given).ellipsoid.semi_major_metre == 6378137.0


@each("name", ["latitude_longitude", "rotated_latitude_longitude"])
def test_degrees_are_no_map(name):
    """Longitudes and latitudes, and those about another pole, are refused as other geographic CRSs are."""
    pole = {"grid_north_pole_latitude": 39.25, "grid_north_pole_longitude": [-162.0]}
    assert "has no map plane; it must be a projected CRS" in message({"grid_mapping_name": name, **pole, **WGS84})
