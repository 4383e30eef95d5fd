"""Units, prime meridians and axes of CRSs, bound and derived ones, ellipsoids and datums."""

import math
import re

import numpy as np
import pytest
from projection_points import EUROPE, SAME, assert_same, make
from pyproj import CRS, Geod, Transformer
from tables import each

from projdist import Notice
from projdist.earth.ellipsoid import WGS84
from projdist.projections import ProjectionError

# ---- units, prime meridians, axes -------------------------------------------------------------

# NIST SP 811, appendix B: the foot is 0.3048 m, the US survey foot 1200/3937 m; Clarke's foot is EPSG's 9005.
UNITS = {
    "+units=ft": 0.3048,
    "+units=us-ft": 1200 / 3937,
    "+units=km": 1000.0,
    "+to_meter=0.3047972654": 0.3047972654,
    "+to_meter=1200/3937": 1200 / 3937,
    "+units=kmi": 1852.0,
}


@each("unit", UNITS)
def test_units_of_proj_strings(unit):
    """Whatever the unit of the string, coordinates are metres; false eastings too, which PROJ states in metres."""
    bare = "+proj=tmerc +lat_0=40 +lon_0=-74 +k=0.9999 +x_0=300000 +ellps=GRS80"
    assert_same(make(f"{bare} {unit}"), make(bare), np.array([-75.0, -74.0, -73.2]), np.array([40.0, 41.0, 39.0]))
    # PROJ itself is in the unit.
    raw = Transformer.from_pipeline(f"{bare} {unit}").transform(-74.0, 40.0)[0]
    assert raw * UNITS[unit] == pytest.approx(300000, rel=1e-12)


def test_units_win_over_to_meter():
    """PROJ reads +units before +to_meter, in whatever order they stand, and so does projdist, which tells of it."""
    for text in ("+proj=merc +units=us-ft +to_meter=1", "+proj=merc +to_meter=1 +units=us-ft"):
        with pytest.warns(Notice, match=r"PROJ makes no use of '\+to_meter=1' with merc\."):
            projection = make(text)
        assert_same(projection, make("+proj=merc"), *EUROPE)
    # The last unit conversion of a pipeline gives its unit.
    text = "+proj=pipeline +step +proj=merc +ellps=WGS84 +step +proj=unitconvert +xy_in=m +xy_out=us-ft"
    assert_same(make(text), make("+proj=merc +ellps=WGS84"), *EUROPE)


STRANGE = ['{"proj": true}', '{"proj": 5, "lon_0": 3}', '{"proj": []}', '{"a":' * 100_000, "PROJCS[" * 10_000]
STRANGE += ["a" * 300, f"+proj={'m' * 300}", f"EPSG:{'1' * 300}", f"{'a' * 300}.prj"]


@each("text", [*STRANGE, f"+proj=merc +q={'1' * 3000} +lat_ts=x"])
def test_strange_text_is_one_short_line(text):
    """However long or deep it is, and in whatever shape."""
    with pytest.raises(ProjectionError, match=r"^Invalid .*\.$") as error:
        make(text)
    assert len(str(error.value)) < 500


@each("code", [2263, 6421, 2225, 3361, 27700, 2157, 3167])
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


def test_prime_meridians():
    """They move a map; longitudes stay Greenwich's. Paris is at 2 deg 20' 14.025" (EPSG:8903), Rome 12 deg 27' 8.4"."""
    paris = 2 + 20 / 60 + 14.025 / 3600
    projection = make("+proj=merc +pm=paris +R=6371000")
    assert projection(paris, 10.0)[0] == pytest.approx(0.0, abs=1e-8)
    np.testing.assert_allclose(projection(paris + 1, 0.0), (6371000 * math.radians(1), 0.0), rtol=1e-12, atol=1e-8)
    # EPSG:27572's origin, 52 grads north on the meridian, is at x = 600 km, y = 2200 km (EPSG:18082).
    paris = 2.33722917  # EPSG:8903, 2.5969213 grads
    np.testing.assert_allclose(make("EPSG:27572")(paris, 46.8), (600000.0, 2200000.0), atol=1e-6)
    # Clarke 1880 (IGN) has the semi-minor axis 6356515.0 m.
    ellipsoid = make("EPSG:27572").ellipsoid
    assert (ellipsoid.a, ellipsoid.a * (1 - ellipsoid.f)) == pytest.approx((6378249.2, 6356515.0), abs=1e-6)
    assert make("EPSG:26591")(9 + 12 + 27 / 60 + 8.4 / 3600, 42.0)[0] == pytest.approx(1500000.0, abs=1e-6)


def test_ferro_meridian_and_southing():
    """EPSG:2065 (south, west, from Ferro) is EPSG:5514 (east, north, from Greenwich): one map on one ellipsoid."""
    assert_same(make("EPSG:2065"), make("EPSG:5514"), *EUROPE, atol=1e-6)
    assert_same(make("EPSG:5513"), make("EPSG:5514"), *EUROPE, atol=1e-6)
    # Krovak: the point 59 deg 45' 27" N, 42 deg 30' E of Ferro is the pole of the cone's axis (EPSG:9819).
    x, y = make("EPSG:5514")(14.4, 50.1)
    assert -800e3 < x < -700e3
    assert -1100e3 < y < -1000e3


def test_northing_first_westing_and_southing():
    """EPSG:2193 and 31466 state the northing first, 2053 (Lo29) counts west and south; x is east and y north still."""
    projection = make("EPSG:2193")
    # NZTM 2000 (LINZS25002): origin 0, 173 E; false easting 1600 km, northing 10 000 km, k = 0.9996.
    np.testing.assert_allclose(projection(173.0, 0.0), (1600000.0, 10000000.0), atol=1e-6)
    assert projection(174.0, -41.0)[0] > 1600000
    # Zone 2 of Gauss-Krueger: centre 6 E, false easting 2 500 km.
    x, y = make("EPSG:31466")([6.0, 7.0], 51.0)
    assert x[0] == pytest.approx(2500000.0, abs=1e-6)
    assert 2.5e6 < x[1] < 2.6e6
    assert (y > 5.6e6).all()
    x, y = make("EPSG:2053")([29.0, 30.0, 29.0], [-30.0, -30.0, -29.0])
    truth = make("+proj=tmerc +lon_0=29 +ellps=WGS84")
    np.testing.assert_allclose((x, y), truth([29.0, 30.0, 29.0], [-30.0, -30.0, -29.0]), atol=SAME)
    assert x[1] > x[0]
    assert y[2] > y[0]


def test_polar_axes():
    """They point along meridians, in either order: x goes right and y up, and 90 E is right of the south pole."""
    x, y = make("EPSG:3031")([0.0, 90.0, 0.0], [-90.0, -75.0, -75.0])
    np.testing.assert_allclose([x[0], y[0], y[1], x[2]], 0.0, atol=1e-6)
    assert min(x[1], y[2]) > 1e6
    # EPSG:32661 (N, E) and EPSG:5041 (E, N) are the same map: UPS North, the pole at 2000 km, 2000 km.
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


@each("code", [2193, 31466, 2053, 5514, 5513, 2065, 3031, 32661, 5041, 32761, 5042, 3032, 3995, 27572, 2180, 3110])
def test_no_crs_is_mirrored(code):
    """Whatever the order and the directions of the axes, east is clockwise of north."""
    crs = CRS.from_epsg(code)
    w, s, e, n = crs.area_of_use.bounds
    assert orientation(make(code), (w + e) / 2 + 0.1, (s + n) / 2 + 0.1) == 1


# ---- wrapped CRSs -----------------------------------------------------------------------------


def test_crss_within_others():
    """Compound: RD New with a height is RD New. Bound: its shift to WGS 84 is no part of the map. 3-D: no height."""
    bound = CRS("+proj=utm +zone=32 +ellps=intl +towgs84=-87,-98,-121 +type=crs")
    high = CRS("EPSG:32632").to_3d()
    assert bound.is_bound
    assert len(high.axis_info) == 3
    assert make("EPSG:7415").definition == "EPSG:7415"
    inner = {"EPSG:7415": "EPSG:28992", "EPSG:28992+5709": "EPSG:28992"}
    inner |= dict.fromkeys((bound, bound.to_wkt()), "+proj=utm +zone=32 +ellps=intl")
    for outer, same in (inner | {high: "EPSG:32632", high.to_wkt(): "EPSG:32632"}).items():
        assert_same(make(outer), make(same), *EUROPE)


DERIVED = """DERIVEDPROJCRS["site grid", BASEPROJCRS["UTM 32N",
    BASEGEOGCRS["WGS 84", DATUM["World Geodetic System 1984",
      ELLIPSOID["WGS 84",6378137,298.257223563]], PRIMEM["Greenwich",0,ANGLEUNIT["degree",0.0174532925199433]]],
    CONVERSION["UTM zone 32N", METHOD["Transverse Mercator",ID["EPSG",9807]],
      PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],
      PARAMETER["Longitude of natural origin",9,ANGLEUNIT["degree",0.0174532925199433]],
      PARAMETER["Scale factor at natural origin",0.9996,SCALEUNIT["unity",1]],
      PARAMETER["False easting",500000,LENGTHUNIT["metre",1]], PARAMETER["False northing",0,LENGTHUNIT["metre",1]]]],
  DERIVINGCONVERSION["turned", METHOD["Affine parametric transformation",ID["EPSG",9624]],
    PARAMETER["A0",100,LENGTHUNIT["metre",1],ID["EPSG",8623]], PARAMETER["A1",0.6,SCALEUNIT["unity",1],ID["EPSG",8624]],
    PARAMETER["A2",0.8,SCALEUNIT["unity",1],ID["EPSG",8625]], PARAMETER["B0",200,LENGTHUNIT["metre",1],ID["EPSG",8639]],
    PARAMETER["B1",-0.8,SCALEUNIT["unity",1],ID["EPSG",8640]],
    PARAMETER["B2",0.6,SCALEUNIT["unity",1],ID["EPSG",8641]]],
  CS[Cartesian,2], AXIS["site east",east], AXIS["site north",north], LENGTHUNIT["metre",1]]"""


def test_derived_projected_crss():
    """A grid derived from UTM by an affine map (EPSG:9624) is that of UTM; one laid on one point is refused by name."""
    x, y = make("EPSG:32632")(*EUROPE)
    site = make(DERIVED)(*EUROPE)
    np.testing.assert_allclose(site, (100 + 0.6 * x + 0.8 * y, 200 - 0.8 * x + 0.6 * y), rtol=1e-13)
    # PROJ knows no parameters of the conversion, or they are 0: it gave NaN without a reason.
    similarity = DERIVED.replace("Affine parametric", "Similarity").replace("9624", "9621")
    with pytest.raises(ProjectionError, match=r"lays all of it on one point, 0, 0: .* 'Similarity transformation'"):
        make(similarity)
    flat = re.sub(r'("[AB][12]"),-?0\.\d', r"\1,0", DERIVED)
    with pytest.raises(ProjectionError, match=r"lays all of it on one point, 100, 200: .*, or its parameters are 0\.$"):
        make(flat)


# ---- ellipsoids and datums --------------------------------------------------------------------

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


@each("text", ELLIPSOIDS)
def test_ellipsoids_of_proj_strings(text):
    """The ellipsoid is what the string states, in any of PROJ's ways to state one, alone and in a pipeline."""
    a, rf = ELLIPSOIDS[text]
    for definition in (f"+proj=merc {text}", f"+proj=pipeline +step +proj=merc {text} +step +proj=noop"):
        ellipsoid = make(definition).ellipsoid
        assert ellipsoid.a == pytest.approx(a, rel=1e-15)
        assert pytest.approx(1 / rf, rel=1e-11) == ellipsoid.f


@each(
    ("text", "radius"),
    [
        *(("+R=1", 1.0), ("+R=6371000", 6371e3), ("+ellps=sphere", 6370997.0), ("+a=6378137 +b=6378137", 6378137.0)),
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


@each("text", SHIFTS)
def test_datum_shifts_are_no_part_of_the_map(text):
    """+datum, +towgs84 and grids move nothing: the map is that of the bare ellipsoid."""
    for projection in ("+proj=tmerc +lon_0=9", "+proj=robin"):
        assert_same(make(f"{projection} {text}"), make(f"{projection} {SHIFTS[text]}"), *EUROPE)
        assert make(f"{projection} {text}").ellipsoid.a == make(f"{projection} {SHIFTS[text]}").ellipsoid.a
