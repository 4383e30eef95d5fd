"""Every CRS of the database is what its method promises, unmirrored and in metres; answers that are not say so."""

import dataclasses
import functools
import warnings

import numpy as np
import pyproj.list
import pytest
from pyproj import CRS, Transformer
from pyproj.database import query_crs_info
from tables import each, some

from projdist import factors, summarize
from projdist.earth import data_rows
from projdist.field import check_declared_property
from projdist.field.at_points import Quality, derivatives
from projdist.matrices.measures import log_anisotropy, log_areal_scale, orientation
from projdist.projections import Projection, ProjectionError, declared_property_of
from projdist.projections.catalogue import NEEDED_PARAMETERS, NOT_MAPS
from projdist.projections.operations import GeographicAxes
from projdist.support.messages import Notice

CHUNKS = 12
HOMES = {"nzmg": (172.0, -42.0)}  # of operations that are series
NATURES = data_rows("declared_properties.csv")
SWAPPED = [("+proj=lcc +lat_1=20 +lat_2=60", "angles are off"), ("+proj=cea +lat_ts=30", "areas differ by")]
FLAT = 0.3  # Halley's comet and Haumea; PROJ's series in the flattening are for planets (Saturn: 0.098)
EXACT = 1e-7  # of scales: a tenth of a part per million; the derivatives are good to 1e-10


@functools.cache
def codes():
    """All projected CRSs of PROJ's database, deprecated ones too: 10,202 in PROJ 9.5."""
    infos = query_crs_info(pj_types=["PROJECTED_CRS"], allow_deprecated=True)
    return sorted(f"{info.auth_name}:{info.code}" for info in infos)


def assert_sound(code):
    """A CRS is refused in one line, or is what its method promises, east to the right, and in metres."""
    try:
        projection = Projection.from_user_input(code)
    except ProjectionError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return "refused"
    # Nine points of the area of use, away from its edges, on no round longitudes.
    west, south, east, north = projection.area_of_use or (-170.0, -80.0, 170.0, 80.0)
    width, share = (east - west) % 360.0 or 360.0, np.array([0.13, 0.51, 0.87])
    lon, lat = (axis.ravel() for axis in np.meshgrid(west + width * share, south + (north - south) * share))
    found = derivatives(projection, lon, lat)
    J = found.jacobian[found.quality <= Quality.ONE_SIDED]
    assert len(J), f"{code} has no coordinates in its area of use"
    assert (orientation(J) > 0).all(), f"{code} is mirrored"
    nature = declared_property_of(projection)
    assert_in_metres(projection, code, lon, lat)
    if nature is None or projection.ellipsoid.f > FLAT:
        return ""
    departs = np.max(log_anisotropy(J)) if nature.keeps == "conformal" else np.ptp(log_areal_scale(J))
    assert departs <= EXACT, f"{code} is not {nature.keeps}, as {nature.name} is: {departs}"
    return nature.keeps


def assert_in_metres(projection, code, lon, lat):
    """Distances between coordinates are those of the CRS's own, in authority order, times its unit."""
    # Of the WKT: for a few codes PROJ's database has shifts of datum beside the conversion, for metres.
    crs = CRS.from_wkt(CRS.from_user_input(code).to_wkt())
    if projection.function.angles != GeographicAxes():
        return  # `test_projections` has these, against published origins
    geodetic = crs.geodetic_crs
    east, north = (axis.direction for axis in sorted(geodetic.axis_info[:2], key=lambda axis: axis.direction != "east"))
    if (east, north) != ("east", "north") or not geodetic.is_geographic:
        return  # `test_bodies` has these
    given = (lon, lat) if geodetic.axis_info[0].direction == "east" else (lat, lon)
    own = np.array(Transformer.from_crs(geodetic, crs).transform(*given)[:2])
    own *= np.array([[axis.unit_conversion_factor] for axis in crs.axis_info[:2]])
    x, y = projection(lon, lat)
    both = np.isfinite(own).all(axis=0) & np.isfinite(x)
    distances = [np.hypot(*(values - values[:, :1])) for values in (np.stack([x, y])[:, both], own[:, both])]
    np.testing.assert_allclose(distances[0], distances[1], rtol=1e-9, atol=1e-6, err_msg=code)


@pytest.mark.slow
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_the_database(chunk):
    """One CRS in eight is sound; PROJ cannot compute few (59 in PROJ 9.5), and nearly all have a known method."""
    kept = [assert_sound(code) for code in some(codes()[chunk::CHUNKS], 8)]
    assert kept.count("refused") <= 0.02 * len(kept)
    assert kept.count("conformal") > 0.7 * len(kept)
    assert kept.count("equal-area") > 0


def test_methods_that_promise_nothing_are_no_news():
    """Web Mercator, spherical methods on ellipsoids, pipelines and functions are not held to anything."""
    nothing = ["EPSG:3857", "ESRI:54009", "robin", "+proj=moll +ellps=WGS84", "EPSG:4087", lambda lon, lat: (lon, lat)]
    given = [*nothing, "ESRI:53009", "EPSG:32633", "moll"]
    *found, sphere, utm, moll = (declared_property_of(Projection.from_user_input(one)) for one in given)
    assert (found, sphere.keeps) == ([None] * 6, "equal-area")
    assert (utm, moll) == (("Transverse Mercator", "conformal"), ("moll", "equal-area"))


def test_names_stand_once_a_kind():
    assert len({(row["kind"], row["name"]) for row in NATURES}) == len(NATURES)
    assert {row["keeps"] for row in NATURES} == {"conformal", "equal-area"}
    assert min(len(row["source"]) for row in NATURES) > 10


@each("row", [row for row in NATURES if row["kind"] == "operation"])
def test_operations_of_the_list(row):
    """Each operation of the list is one of PROJ's, and what the list says, on a sphere or on ellipsoids, too."""
    name = row["name"]
    assert name in pyproj.list.get_proj_operations_map().keys() - NOT_MAPS
    assert row["figure"] in ("any", "sphere")
    needed = " ".join(token for token in NEEDED_PARAMETERS.get(name, "").split() if "ellps" not in token)
    lon, lat = HOMES.get(name, (10.0, 20.0))
    figures = ["+R=6371000"] if row["figure"] == "sphere" else ["+R=6371000", "+ellps=WGS84"]
    if name in ("etmerc", "ups", "utm"):
        figures = figures[1:]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)  # of figures of their own
        for figure in figures:
            projection = Projection.from_user_input(f"+proj={name} {needed} {figure}")
            assert declared_property_of(projection) == (name, row["keeps"])
            found = derivatives(projection, lon + np.array([0.3, 1.1, 2.7, 3.3]), lat + np.array([0.2, -1.9, 2.3, 4.1]))
            kept = log_anisotropy if row["keeps"] == "conformal" else lambda J: np.ptp(log_areal_scale(J))
            assert np.max(kept(found.jacobian)) < 3e-6  # hatano's iteration and guyou's integrals leave 1e-6


@each(("given", "message"), SWAPPED)
def test_notice_of_swapped_coordinates(given, message):
    """Jacobians of swapped coordinates contradict the method, conformal or equal-area; the right ones do not."""
    right = Projection.from_user_input(given)
    lon, lat = np.array([10.0, 20.0, 33.0, 40.0]), np.array([12.0, 30.0, 41.0, 55.0])
    check_declared_property(right, derivatives(right, lon, lat).jacobian)
    swapped = dataclasses.replace(right, function=lambda lon, lat: right.function(lat, lon))
    J = derivatives(swapped, lon, lat).jacobian
    with pytest.warns(Notice, match=rf"is not (conformal|equal-area) here, as .* should be: {message}"):
        check_declared_property(right, J)


def test_notice_far_from_home():
    """Beyond its reach a series is no conformal map, at points and over regions; over New Zealand NZMG is."""
    with pytest.warns(Notice, match=r"nzmg .* is not conformal here, as nzmg should be: angles are off by \d"):
        factors("nzmg", 160.0, -10.0)
    with pytest.warns(Notice, match=r"angles are off by 1\d\d degrees\."):  # in plain digits
        factors("nzmg", 15.0, 50.0)
    with pytest.warns(Notice, match="is not conformal here"):
        summarize("nzmg", "box:140,-20,150,-10", tolerance=1e-3)
    assert summarize("nzmg", "box:170,-45,174,-40", tolerance=1e-6).airy_kavrayskiy < 1e-3


def test_points_without_jacobians_are_no_contradiction():
    """NaN alone says nothing, nor a single point of an equal-area map, nor PROJ's -1000 for bounds of old CRSs."""
    assert Projection.from_user_input("EPSG:29119").area_of_use is None
    check_declared_property(Projection.from_user_input("merc"), np.full((3, 2, 2), np.nan))
    factors("EPSG:3035", 10.0, 52.0)
    assert np.isnan(factors("merc", 0.0, 90.0).k)


@each("count", [1, 2, 3, 4, 101])
def test_departure_of_areas_is_a_range_of_quartiles(count):
    """Half of the logarithms of areal scales lie within it, as NumPy has quantiles; a singular point leaves none."""
    J = np.tile(np.eye(2), (count, 1, 1))
    J[:, 0, 0] = np.exp(np.random.default_rng(count).normal(size=count))
    upper, lower = np.quantile(np.log(J[:, 0, 0]), [0.75, 0.25])
    projection, size = Projection.from_user_input("moll"), upper - lower
    check_declared_property(projection, J, error=size + 1e-14)
    if size:
        with pytest.warns(Notice, match="areas differ"):
            check_declared_property(projection, J, error=size - 1e-14)
    J[0] = 0.0
    check_declared_property(projection, J)


@each("code", ["IAU_2015:200043361", "IAU_2015:200043321"])
def test_notice_of_bodies_that_are_too_flat_for_proj(code):
    """Haumea (f = 0.68) has a transverse Mercator map that is not conformal, a sinusoidal one not equal-area."""
    with pytest.warns(Notice, match=r"is not (conformal|equal-area) here, as"):
        factors(code, [10.0, 20.0, 30.0, 40.0], [15.0, 33.0, 47.0, 68.0])


@each("name", ["august", "guyou", "tobmerc"])
def test_a_rough_answer_contradicts_nothing(name):
    """What is asked for to a thousandth only is not called wrong by a hundredth of that (warnings are errors here)."""
    assert summarize(name, tolerance=1e-3).error_estimate < 0.01


@pytest.mark.slow
def test_an_answer_is_as_rough_as_its_error():
    """Guyou's map is singular at four points, where rounding keeps the error above what is asked for."""
    assert summarize("guyou", tolerance=1e-5).error_estimate > 1e-5
