"""Factors that others have published, and every projection of PROJ."""

import math
import re

import numpy as np
import pyproj.list
import pytest
from jacobians import ACCURACY, UNDEFINED, R, make, value
from pyproj import CRS, Proj
from tables import each

from projdist.earth.ellipsoid import WGS84
from projdist.field.at_points import Quality, derivatives, jacobian
from projdist.matrices.measures import MEASURES
from projdist.projections import ProjectionError
from projdist.projections.catalogue import NOT_IN_METRES, NOT_MAPS

# ---- figures of other authorities, and what pyproj's get_factors gets wrong -------------------


@each(
    ("code", "lon", "lat", "measure", "truth", "digits"),
    [
        # UTM 10N: k = 1.00054660, convergence 1 deg 40' 43.13" (NGS Coordinate Conversion Tool).
        *((code, -120.0, 34.0, "k", 1.00054660, 0.5e-8) for code in ("EPSG:32610", "EPSG:3717")),
        *(
            (code, -120.0, 34.0, "convergence", 1 + 40 / 60 + 43.13 / 3600, 0.005 / 3600)
            for code in ("EPSG:32610", "EPSG:3717")
        ),
        # PROJ's documentation of proj -S.
        ("EPSG:6421", -120.0, 35.8, "k", 1.00004382, 0.5e-8),
        ("EPSG:6421", -120.0, 35.8, "h", 1.00004382, 0.5e-8),
        ("EPSG:6421", -120.0, 35.8, "convergence", -0.59658715, 0.5e-8),
    ],
)
def test_published_figures(code, lon, lat, measure, truth, digits):
    """Of UTM and of a state plane, to the digits in print."""
    assert value(measure, jacobian(make(code), lon, lat)) == pytest.approx(truth, abs=digits)


@each("text", ["wintri", f"+proj=wintri +R={R}", "winkel-tripel"])
def test_defect_1_lost_defaults(text):
    """Winkel Tripel at the centre has k = (1 + 2 / pi) / 2 = 0.8183; with get_factors' lost lat_1 it is 1."""
    J = jacobian(make(text), 0.0, 0.0)
    assert value("k", J) == pytest.approx((1 + 2 / math.pi) / 2, rel=1e-11)
    assert value("h", J) == pytest.approx(1.0, rel=1e-11)
    # The defect is still there in pyproj, so that the detour is still needed.
    assert Proj(f"+proj=wintri +R={R}").get_factors(0.0, 0.0).parallel_scale == pytest.approx(1.0, abs=1e-6)


WEB_MERCATOR = {0: (1.006739, 1.000000, 0.3848), 45: (1.416602, 1.411845, 0.1927), 60: (1.998334, 1.994973, 0.0965)}


@each("lat", WEB_MERCATOR)
def test_defect_2_web_mercator_is_not_conformal(lat):
    """EPSG:3857 is the sphere's Mercator of geodetic latitudes: h = a / (M cos), k = a / (N cos), and omega not 0."""
    J = jacobian(make("EPSG:3857"), 12.0, float(lat))
    for name, truth, digits in zip(("h", "k", "omega"), WEB_MERCATOR[lat], (0.5e-6, 0.5e-6, 0.5e-4), strict=True):
        assert value(name, J) == pytest.approx(truth, abs=digits)
    M, N = WGS84.radii(lat)
    cos = math.cos(math.radians(lat))
    assert value("h", J) == pytest.approx(WGS84.a / (M * cos), rel=ACCURACY)
    assert value("k", J) == pytest.approx(WGS84.a / (N * cos), rel=ACCURACY)


@each("definition", ["ESRI:54009", "+proj=moll +ellps=WGS84"])
def test_defect_3_spherical_formulas_on_an_ellipsoid(definition):
    """Mollweide on WGS 84 has s = a^2 / (M N): 1.0067 at the equator, 0.9988 at 50 N, 0.9933 at the pole."""
    lat = np.array([0.0, 50.0, 89.9])
    s = value("s", jacobian(make(definition), 3.0, lat))
    np.testing.assert_allclose(s, [1.0067, 0.9988, 0.9933], atol=0.5e-4)
    M, N = WGS84.radii(lat)
    # Beyond 89 degrees the iteration for Mollweide's theta stops at 1e-7 or so.
    assert (np.abs(s / (WGS84.a**2 / (M * N)) - 1) <= [1e-8, 1e-8, 1e-5]).all()


def test_defect_4_prime_meridian_of_paris():
    """EPSG:27572 has no convergence and k = 0.99987742 at its origin, the meridian of Paris at 52 grads north."""
    paris = CRS("EPSG:27572").prime_meridian.longitude * 0.9  # grads
    paris = paris if paris < 2.5 else CRS("EPSG:27572").prime_meridian.longitude
    J = jacobian(make("EPSG:27572"), 2.33722917, 46.8)
    assert 2.33 < paris < 2.34
    assert value("convergence", J) == pytest.approx(0.0, abs=1e-8)
    assert value("k", J) == pytest.approx(0.99987742, abs=1e-10)
    # A degree east it is sin(46.8 deg) of a degree: n of a cone tangent there is the sine of its latitude.
    east = jacobian(make("EPSG:27572"), 3.33722917, 46.8)
    assert value("convergence", east) == pytest.approx(math.sin(math.radians(46.8)), rel=1e-9)


def test_defect_4_prime_meridian_of_ferro():
    """EPSG:2065 (Krovak from Ferro) at Prague has the J of EPSG:5514 and scales within 150 ppm of 1, not 6,284 off."""
    one, other = (jacobian(make(code), 14.42, 50.09) for code in ("EPSG:2065", "EPSG:5514"))
    np.testing.assert_allclose(one, other, atol=1e-11)
    assert value("ppm", one) < 150
    assert value("orientation", one) == 1
    # Krovak's meridian of convergence 0 is 24 deg 50' E, 42 deg 30' of Ferro (EPSG:9819); Prague is west of it.
    centre = jacobian(make("EPSG:2065"), 24 + 50 / 60, 49.0)
    assert value("convergence", centre) == pytest.approx(0.0, abs=1e-7)
    assert value("omega", one) < 1e-6


def test_defect_5_seams():
    """k on the Goode seam at 40 W is 1 (sinusoidal) or Mollweide's, never 94,703."""
    J = jacobian(make("igh"), -40.0, np.array([10.0, 30.0, 60.0, 80.0]))
    k = value("k", J)
    np.testing.assert_allclose(k[:2], 1.0, rtol=1e-9)
    # Mollweide: k = 2 sqrt(2) / pi cos(theta) / cos(lat), 2 theta + sin(2 theta) = pi sin(lat).
    for lat, here in zip((60.0, 80.0), k[2:], strict=True):
        theta = math.radians(lat)
        for _ in range(100):
            step = 2 * theta + math.sin(2 * theta) - math.pi * math.sin(math.radians(lat))
            theta -= step / (2 + 2 * math.cos(2 * theta))
        truth = 2 * math.sqrt(2) / math.pi * math.cos(theta) / math.cos(math.radians(lat))
        assert here == pytest.approx(truth, rel=1e-7)
    assert (value("a", J) < 5).all()


def test_defect_6_poles():
    """At a regular pole the scales are numbers, at a pole line NaN; get_factors has errors or garbage."""
    assert value("k", jacobian(make("EPSG:3413"), 10.0, 90.0)) == pytest.approx(0.9698582, abs=1e-5)
    assert np.isnan(jacobian(make("EPSG:3857"), 10.0, 90.0)).all()
    assert np.isnan(jacobian(make("robin"), 10.0, 90.0)).all()


@each("code", ["EPSG:4978", "EPSG:4326", "EPSG:4979"])
def test_defect_7_types(code):
    """What is not a map is refused; get_factors gives numbers."""
    with pytest.raises(
        ProjectionError, match=rf"^Invalid projection '{code}'\. .*no map plane; it must be a projected"
    ):
        make(code)


# ---- every projection of PROJ -----------------------------------------------------------------


# Parameters of those that have no map without, or whose default is degenerate.
CONICS = ("aea", "eqdc", "lcc", "euler", "murd1", "murd2", "murd3", "pconic", "tissot", "vitk1")
PARAMETERS = dict.fromkeys(CONICS, "+lat_1=30 +lat_2=60") | dict(
    line.strip().split(" ", 1)
    for line in """alsk +ellps=clrk66; bonne +lat_1=45; ccon +lat_1=45; col_urban +h_0=2550; etmerc +ellps=WGS84;
    chamb +lat_1=10 +lon_1=-30 +lat_2=40 +lon_2=0 +lat_3=-20 +lon_3=30; fouc_s +n=0.5; gn_sinu +m=2 +n=3;
    geos +h=35785831 +ellps=WGS84; gs48 +R=6370997; gs50 +ellps=clrk66; gstmerc +lat_0=-21; imw_p +lat_1=20 +lat_2=30;
    krovak +ellps=bessel; labrd +lat_0=-18.9 +azi=18.9 +ellps=intl; lcca +lat_0=45; leac +lat_1=30; loxim +lat_1=40;
    lsat +lsat=5 +path=10 +ellps=WGS84; misrsom +path=10 +ellps=WGS84; mod_krovak +ellps=bessel; nsper +h=3000000;
    nzmg +ellps=intl; ob_tran +o_proj=moll +o_lat_p=45 +o_lon_p=20; ocea +lat_1=20 +lon_1=0 +lat_2=50 +lon_2=60;
    oea +n=2 +m=1; omerc +lat_0=30 +lonc=10 +alpha=30; peirce_q +shape=square; rouss +lat_0=50 +ellps=WGS84;
    rpoly +lat_ts=30; sch +plat_0=30 +plon_0=10 +phdg_0=20 +ellps=WGS84; som +ellps=bessel; wink1 +lat_ts=50;
    somerc +lat_0=46 +ellps=bessel; tpeqd +lat_1=30 +lon_1=-30 +lat_2=40 +lon_2=40; utm +zone=32 +ellps=WGS84;
    tpers +h=3000000 +tilt=20 +azi=30; ups +ellps=WGS84; urm5 +n=0.9 +alpha=30 +q=0.4; urmfps +n=0.9; wink2 +lat_1=50
    """.split(";")
)
# Their scales far from home are those of polynomials, or of series, beyond any use: large, but true of the function.
# Complex polynomials (Alaska, the United States, the Pacific, Europe and Africa, New Zealand), Krovak's cone and what
# is on top of it, series for Madagascar and about a centre, an oblique Mercator, a polyconic of a sheet.
LOCAL = {*"alsk gs48 gs50 lee_os mil_os nzmg krovak mod_krovak labrd rouss somerc imw_p".split()}

WORLD = sorted(name for name in pyproj.list.get_proj_operations_map() if name not in NOT_MAPS | set(NOT_IN_METRES))
assert LOCAL | set(PARAMETERS) <= set(pyproj.list.get_proj_operations_map())
WORLD_LON, WORLD_LAT = np.meshgrid(np.arange(-180.0, 181, 15), np.arange(-90.0, 91, 15))

# One of each sort: cylinders, a cone, planes, lobes, a polyhedron, pole lines; the rest is slow.
ON_GRID = {"merc", "lcc", "ortho", "igh", "isea", "robin", "stere", "omerc", "airy", "wintri"}


def world_map(name):
    parameters = PARAMETERS.get(name, "")
    earth = "" if re.search(r"\+(ellps|R)=", parameters) else f" +R={R}"
    return make(f"+proj={name} {parameters}{earth}")


@each("name", [name if name in ON_GRID else pytest.param(name, marks=pytest.mark.slow) for name in WORLD])
def test_every_projection_of_proj_on_a_world_grid(name):
    """On a world grid with poles and antimeridian: no exception, no inf, NaN exactly where the quality says so."""
    result = derivatives(world_map(name), WORLD_LON, WORLD_LAT)
    undefined = np.isin(result.quality, UNDEFINED)
    missing = np.isnan(result.jacobian)
    for array in (missing.all(axis=(-1, -2)), missing.any(axis=(-1, -2)), np.isnan(result.error)):
        np.testing.assert_array_equal(array, undefined)
    np.testing.assert_array_equal(np.isnan(result.x), result.quality == Quality.OUTSIDE)
    for array in (result.x, result.y, result.jacobian, result.error):
        assert not np.isinf(array).any()
    assert (~undefined).mean() > 0.1
    if name not in LOCAL:
        # The largest true scale on this grid is 223, of the gnomonic map at 75 degrees from its centre.
        assert np.nanmax(value("a", result.jacobian)) < 1e3


CENTRES = {"gstmerc": (0, -21), "sch": (10, 30), "ups": (0, 85), "lcca": (0, 45), "omerc": (10, 30), "tpers": (0, 2)}


@each("name", sorted(set(WORLD) - LOCAL))
def test_every_projection_of_proj_at_its_centre(name):
    """Near its centre every map of the world is smooth, and has scales between a quarter and four."""
    lon, lat = CENTRES.get(name, (7, 12))
    result = derivatives(world_map(name), lon + np.array([0.3, 2.1]), lat + np.array([1.1, 3.7]))
    assert (result.quality <= Quality.ONE_SIDED).all(), result.quality
    assert (value("a", result.jacobian) < 4).all()
    assert (value("b", result.jacobian) > 0.25).all()


def test_the_hidden_side_of_a_satellite_view_is_outside_or_mirrored():
    """A geostationary satellite sees 81 degrees. On a sphere PROJ draws the far side too: mirrored, and it shows."""
    lon = [0.0, 75.0, 90.0, 180.0]
    on_ellipsoid = derivatives(make("+proj=geos +h=35785831 +ellps=WGS84"), lon, 0.0)
    assert list(on_ellipsoid.quality < Quality.SEAM) == [True, True, False, False]
    on_sphere = jacobian(make("+proj=geos +h=35785831 +R=6371000"), lon, 0.0)
    assert list(MEASURES["orientation"](on_sphere)) == [1.0, 1.0, -1.0, -1.0]
