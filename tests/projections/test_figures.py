"""PROJ's operations with a figure of the Earth of their own, or with a plane that is not in metres."""

import math
import re
import warnings

import numpy as np
import pyproj.list
import pytest
from projection_points import make
from pyproj import CRS, Geod, Transformer
from pyproj.exceptions import ProjError
from tables import each

from projdist.answers.points_and_lines import factors
from projdist.earth.ellipsoid import Ellipsoid
from projdist.projections import pipeline_of, projected_crs_of, projection_names
from projdist.projections.catalogue import NEEDED_PARAMETERS, NOT_IN_METRES, NOT_MAPS
from projdist.projections.operations import OWN_ELLIPSOIDS
from projdist.support.messages import Notice

LON, LAT = (axis.ravel() for axis in np.meshgrid(np.linspace(-171.0, 173.0, 18), np.linspace(-83.0, 82.0, 18)))


def grown(text, by):
    """A PROJ string with its lengths, which grow with the Earth, times a number."""
    return re.sub(r"\+(h|h_0)=(\S+)", lambda match: f"+{match[1]}={float(match[2]) * by}", text)


def shape(text):
    """Coordinates less those of their mean, so that false origins do not count; None where PROJ has no such map."""
    try:
        x, y = Transformer.from_pipeline(text).transform(LON, LAT, errcheck=False)
    except ProjError:
        return None
    found = np.where(np.isfinite(x) & np.isfinite(y), (x, y), np.nan)
    return found - np.nanmean(found, axis=1, keepdims=True)


def keeps_its_size(text):
    """Whether a map is as large on an Earth twice the size, be it a sphere or an ellipsoid."""
    sizes = []
    for one, other in (("+R=6371000", "+R=12742000"), ("+a=6378137 +rf=298", "+a=12756274 +rf=298")):
        small, large = shape(f"{text} {one}"), shape(f"{grown(text, 2.0)} {other}")
        if small is None:
            continue
        both = np.isfinite(small) & np.isfinite(large)
        if both.any():
            sizes.append(np.abs(large - 2.0 * small)[both].max() / np.abs(small[both]).max())
    return max(sizes) > 1e-6


def test_all_operations_that_pass_over_the_figure_are_known():
    """Of all PROJ's maps, those do not grow with the Earth that are written down, and no others."""
    maps = [name for name in pyproj.list.get_proj_operations_map() if name not in NOT_MAPS]
    needed = {name: re.sub(r"\+ellps=\S+", "", NEEDED_PARAMETERS.get(name, "")) for name in maps}
    found = {name for name in maps if keeps_its_size(f"+proj={name} {needed[name]}")}
    assert found == {name for name in maps if name in OWN_ELLIPSOIDS} | set(NOT_IN_METRES)


# Semi-axes of EPSG's 7004, 7022, 7008, and Snyder's sphere for the United States.
BESSEL, INTERNATIONAL = Geod(a=6377397.155, rf=299.1528128), Geod(a=6378388.0, rf=297.0)
CLARKE, SPHERE = Geod(a=6378206.4, b=6356583.8), Geod(a=6370997.0, b=6370997.0)
HOMES = {
    **{"krovak": (BESSEL, 15.0, 49.5), "mod_krovak": (BESSEL, 16.5, 49.9), "nzmg": (INTERNATIONAL, 171.0, -43.0)},
    **{"alsk": (CLARKE, -150.0, 62.0), "alsk +R=6370997": (SPHERE, -150.0, 62.0), "gs50": (CLARKE, -110.0, 45.0)},
    **{"gs50 +R=6370997": (SPHERE, -110.0, 45.0), "gs48 +R=6370997": (SPHERE, -90.0, 35.0)},
}


def ruler(text, geod, lon, lat, azimuth):
    """Metres on a map over metres on the ground, along 2 km of a geodesic with the point in its middle."""
    ends = [geod.fwd(lon, lat, azimuth + turn, 1000.0)[:2] for turn in (0.0, 180.0)]
    (x, y), (to_x, to_y) = (Transformer.from_pipeline(f"+proj={text}").transform(*end) for end in ends)
    return math.hypot(to_x - x, to_y - y) / 2000.0


@each("text", HOMES)
def test_scales_are_those_of_a_ruler(text):
    """A ruler along geodesics of the figure that PROJ uses finds the scales; 2 km are curved by 1e-8."""
    geod, lon, lat = HOMES[text]
    found = factors(f"+proj={text}", lon, lat)
    east, north = found.jacobian.T
    for azimuth in np.arange(0.0, 180.0, 30.0):
        along = math.sin(math.radians(azimuth)) * east + math.cos(math.radians(azimuth)) * north
        assert math.hypot(*along) == pytest.approx(ruler(text, geod, lon, lat, azimuth), rel=2e-8)
    # All of them are conformal; the polynomials of two are cut off where a millimetre is.
    assert found.omega < (3e-6 if text in ("mod_krovak", "nzmg") else 1e-8)


def test_names_are_on_their_own_figure():
    """Bare names say the figure that they are on; a CRS of the same operation is the same map."""
    names = projection_names()
    own = {"krovak": "+ellps=bessel", "nzmg": "+ellps=intl", "gs50": "+R=6370997"}
    assert {name: names[name] for name in own} == {name: f"+proj={name} {figure}" for name, figure in own.items()}
    assert not set(names) & set(NOT_IN_METRES)
    one, other = factors("krovak", 14.4, 50.1), factors("EPSG:5514", 14.4, 50.1)
    np.testing.assert_allclose(one.jacobian, other.jacobian, atol=1e-10)


@each(("given", "definition", "notice"), [
    ("+proj=krovak +ellps=GRS80", "+proj=krovak +ellps=bessel", "PROJ draws krovak on a figure of its own"),
    ("+proj=nzmg +R=6371000", "+proj=nzmg +ellps=intl", r"of its own, \+ellps=intl; it is measured on that"),
    ("+proj=alsk +datum=WGS84", "+proj=alsk +ellps=clrk66", r"of its own, \+ellps=clrk66"),
    ("+proj=gs50 +R=6.4e6", "+proj=gs50 +R=6370997", r"of its own, \+R=6370997"),
    ("+proj=lee_os", "+proj=lee_os", "lee_os is a map of the sphere; what it draws on an ellipsoid is another map"),
    ("+proj=gs48", "+proj=gs48 +a=6370997 +rf=298.257222101", "gs48 is a map of the sphere"),
])  # fmt: skip
def test_a_figure_that_is_passed_over_is_told(given, definition, notice):
    """Who states another figure is told of PROJ's own, which the definition has; the coordinates are the same."""
    with pytest.warns(Notice, match=notice):
        projection = make(given)
    assert projection.definition == definition
    place = (172.0, -41.0) if "nzmg" in given else (-150.0, 61.0)
    truth = Transformer.from_pipeline(given.replace("+datum=WGS84", "+ellps=WGS84")).transform(*place)
    np.testing.assert_allclose(projection(*place), truth, rtol=1e-13)


@each("given", [
    *("+proj=krovak", "+proj=krovak +ellps=bessel", "+proj=alsk", "+proj=alsk +ellps=clrk66", "+proj=nzmg"),
    *("+proj=gs50 +R=6371000", "+proj=lee_os +R=6371000", "krovak", "nzmg", "gs48", "EPSG:5514", "EPSG:27200"),
    "+proj=pipeline +step +proj=krovak",
])  # fmt: skip
def test_who_states_no_other_figure_is_told_nothing(given):
    """No notice where the figure is PROJ's default, the own one, or a sphere of nearly that size."""
    with warnings.catch_warnings(action="error"):
        projection = make(given)
    assert projection.ellipsoid not in (Ellipsoid(6378137.0, 1 / 298.257222101), Ellipsoid(6371008.7714))


def test_pipelines_and_crss_are_on_that_figure_too():
    """A pipeline's krovak, and a CRS's on GRS 80, are Bessel's; what is exported of it is the map, on its figure."""
    with pytest.warns(Notice, match="figure of its own"):
        pipeline = make("+proj=pipeline +step +proj=krovak +ellps=WGS84")
    wkt = CRS("EPSG:5514").to_wkt().replace("6377397.155,299.1528128", "6378137,298.257222101")
    with pytest.warns(Notice, match="figure of its own"):
        crs = make(wkt)
    for projection in (pipeline, crs):
        assert factors(projection, 15.0, 49.5).omega < 1e-8
    projection = make("krovak")
    found = Transformer.from_pipeline(pipeline_of(projection, np.eye(2))).transform(15.0, 49.5)
    np.testing.assert_allclose(found, projection(15.0, 49.5), rtol=1e-13)
    assert CRS.from_wkt(projected_crs_of(projection).wkt).ellipsoid.inverse_flattening == pytest.approx(299.1528128)


@each("text", ["+proj=gs48", "+proj=lee_os +ellps=WGS84", "+proj=mil_os +ellps=WGS84"])
def test_maps_of_the_sphere_are_conformal_on_the_ellipsoid_that_proj_has(text):
    """What PROJ draws of them on an ellipsoid is conformal on it."""
    with pytest.warns(Notice, match="is a map of the sphere"):
        projection = make(text)
    assert (factors(projection, [-100.0, -92.0], [40.0, 33.0]).omega < 1e-8).all()


def test_a_step_that_makes_metres_is_taken_at_its_word():
    cube = make("+proj=pipeline +step +proj=s2 +R=6371000 +step +proj=affine +s11=1e7 +s22=1e7")
    assert 0.5 < factors(cube, 10.0, 10.0).s < 3.0


@each("text", ["laea +lat_0=52", "lcc +lat_1=30 +lat_2=60", "utm +zone=32", "tmerc +units=us-ft"])
def test_strings_without_a_figure_have_a_crs(text):
    """PROJ's default is GRS 80, as its documentation has it ("Ellipsoids"); that of CRSs made of strings is WGS 84."""
    crs = CRS(projected_crs_of(make(f"+proj={text}")).wkt)
    assert crs.ellipsoid.name.startswith("GRS 1980")
    found = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(12.0, 55.0)
    truth = Transformer.from_pipeline(f"+proj={text} +ellps=GRS80").transform(12.0, 55.0)
    np.testing.assert_allclose(found, truth, rtol=1e-13)
