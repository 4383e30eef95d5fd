"""Units, prime meridians and axes of CRSs, bound and derived ones, ellipsoids and datums."""

import math
import re

import numpy as np
import pytest
from projection_points import EUROPE, SAME, assert_same, make, message
from pyproj import CRS, Geod, Transformer
from tables import each

from projdist import Notice
from projdist.earth.ellipsoid import WGS84

# NIST SP 811, appendix B: the foot is 0.3048 m, the US survey foot 1200/3937 m; Clarke's foot is EPSG's 9005.
UNITS = {"+units=ft": 0.3048, "+units=us-ft": 1200 / 3937, "+units=km": 1000.0, "+to_meter=0.3047972654": 0.3047972654}
UNITS |= {"+to_meter=1200/3937": 1200 / 3937, "+units=kmi": 1852.0}


@each(("unit", "metres"), UNITS.items())
def test_units_of_proj_strings(unit, metres):
    """Whatever the unit of the string, coordinates are metres; false eastings too, which PROJ states in metres."""
    bare = "+proj=tmerc +lat_0=40 +lon_0=-74 +k=0.9999 +x_0=300000 +ellps=GRS80"
    assert_same(make(f"{bare} {unit}"), make(bare), np.array([-75.0, -74.0, -73.2]), np.array([40.0, 41.0, 39.0]))
    # PROJ itself is in the unit.
    raw = Transformer.from_pipeline(f"{bare} {unit}").transform(-74.0, 40.0)[0]
    assert raw * metres == pytest.approx(300000, rel=1e-12)


def test_units_win_over_to_meter():
    """PROJ reads +units before +to_meter, in whatever order they stand, and so does projdist, which tells of it."""
    for text in ("+proj=merc +units=us-ft +to_meter=1", "+proj=merc +to_meter=1 +units=us-ft"):
        with pytest.warns(Notice, match=r"PROJ makes no use of '\+to_meter=1' with merc\."):
            projection = make(text)
        assert_same(projection, make("+proj=merc"), *EUROPE)


@each("code", [2263, 6421, 2225, 3361, 27700, 2157, 3167])
def test_units_of_crss(code):
    """The local scale of a CRS in feet, chains or metres is near 1 metre per metre, by pyproj's geodesics."""
    projection = make(code)
    w, s, e, n = projection.area_of_use
    lon, lat = (w + e) / 2, (s + n) / 2
    end = Geod(a=projection.ellipsoid.a, f=projection.ellipsoid.f).fwd(lon, lat, 30.0, 1000.0)
    # National grids are within 1000 ppm of true scale; a foot left over would be 0.3.
    assert math.dist(projection(lon, lat), projection(*end[:2])) == pytest.approx(1000.0, rel=2e-3)


PARIS, ROME = 2 + 20 / 60 + 14.025 / 3600, 9 + 12 + 27 / 60 + 8.4 / 3600  # EPSG:8903 and 8906
PLACES = [
    ("+proj=merc +pm=paris +R=6371000", PARIS, 10.0, 0.0, (1e6, 1.2e6)),
    ("+proj=merc +pm=paris +R=6371000", PARIS + 1, 0.0, 6371000 * math.radians(1), 0.0),
    # The origin, 52 grads north on the meridian, is at x = 600 km, y = 2200 km (EPSG:18082).
    ("EPSG:27572", 2.33722917, 46.8, 600000.0, 2200000.0),
    ("EPSG:26591", ROME, 42.0, 1500000.0, (4.6e6, 4.7e6)),
    # NZTM 2000 (LINZS25002): origin 0, 173 E; false easting 1600 km, northing 10 000 km.
    *(("EPSG:2193", 173.0, 0.0, 1600000.0, 10000000.0), ("EPSG:2193", 174.0, -41.0, (1.6e6, 1.7e6), (5.4e6, 5.5e6))),
    # Zone 2 of Gauss-Krueger: centre 6 E, false easting 2 500 km.
    *(("EPSG:31466", 6.0, 51.0, 2500000.0, (5.6e6, 5.7e6)), ("EPSG:31466", 7.0, 51.0, (2.5e6, 2.6e6), (5.6e6, 5.7e6))),
    # Krovak: the point 59 deg 45' 27" N, 42 deg 30' E of Ferro is the pole of the cone's axis (EPSG:9819).
    ("EPSG:5514", 14.4, 50.1, (-800e3, -700e3), (-1100e3, -1000e3)),
    # Axes along meridians: 90 E is right of either pole, that of UPS North at 2000 km, 2000 km.
    *(("EPSG:3031", 0.0, -90.0, 0.0, 0.0), ("EPSG:3031", 90.0, -75.0, (1e6, 2e6), 0.0)),
    ("EPSG:3031", 0.0, -75.0, 0.0, (1e6, 2e6)),
    *(("EPSG:32661", 0.0, 90.0, 2e6, 2e6), ("EPSG:32661", 90.0, 88.0, (2.2e6, 2.3e6), 2e6)),
]


@each(("given", "lon", "lat", "x", "y"), PLACES)
def test_places_of_known_coordinates(given, lon, lat, x, y):
    """Prime meridians move a map; whatever axes a CRS has, and in whatever order, x goes east and y north."""
    for found, truth in zip(make(given)(lon, lat), (x, y), strict=True):
        if isinstance(truth, tuple):
            assert truth[0] < found < truth[1]
        else:
            assert found == pytest.approx(truth, rel=1e-12, abs=1e-8 if "merc" in given else 1e-6)


def orientation(projection, lon, lat):
    """The sign of the Jacobian, by a triangle of 0.01 degrees."""
    x, y = projection(lon + np.array([0.0, 0.01, 0.0]), lat + np.array([0.0, 0.0, 0.01]))
    return np.sign((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]))


@each("code", [2193, 31466, 2053, 5514, 5513, 2065, 3031, 32661, 5041, 32761, 5042, 3032, 3995, 27572, 2180, 3110])
def test_no_crs_is_mirrored(code):
    """Whatever the order and the directions of the axes, east is clockwise of north."""
    w, s, e, n = CRS.from_epsg(code).area_of_use.bounds
    assert orientation(make(code), (w + e) / 2 + 0.1, (s + n) / 2 + 0.1) == 1


def feet(lon, lat):
    """EPSG:2263, in US survey feet, by pyproj's transformation."""
    return np.array(Transformer.from_crs("EPSG:4269", "EPSG:2263", always_xy=True).transform(lon, lat)) * (1200 / 3937)


BOUND = CRS("+proj=utm +zone=32 +ellps=intl +towgs84=-87,-98,-121 +type=crs")
HIGH = CRS("EPSG:32632").to_3d()
POLAR = np.array([0.0, 90.0, -135.0, 33.0]), np.array([85.0, 88.0, 84.0, 90.0])
SAME_MAPS = [
    # South and west, from Ferro or from Greenwich.
    *((code, "EPSG:5514", *EUROPE) for code in ("EPSG:2065", "EPSG:5513")),
    ("EPSG:2053", "+proj=tmerc +lon_0=29 +ellps=WGS84", np.array([29.0, 30.0, 29.0]), np.array([-30.0, -30.0, -29.0])),
    # Northing first, or easting: of UPS North and South.
    *(("EPSG:32661", "EPSG:5041", *POLAR), ("EPSG:32761", "EPSG:5042", POLAR[0], -POLAR[1])),
    # Compound: RD New with a height is RD New. Bound: its shift to WGS 84 is no part of the map. 3-D: no height.
    *((text, "EPSG:28992", *EUROPE) for text in ("EPSG:7415", "EPSG:28992+5709", CRS("EPSG:7415").to_wkt("WKT1_ESRI"))),
    *((crs, "+proj=utm +zone=32 +ellps=intl", *EUROPE) for crs in (BOUND, BOUND.to_wkt())),
    *((crs, "EPSG:32632", *EUROPE) for crs in (HIGH, HIGH.to_wkt())),
    ("EPSG:2263", feet, np.array([-74.0, -73.5]), np.array([40.7, 41.0])),
    # The last unit conversion of a pipeline gives its unit.
    ("+proj=pipeline +step +proj=merc +step +proj=unitconvert +xy_in=m +xy_out=us-ft", "+proj=merc", *EUROPE),
]


@each(("given", "same", "lon", "lat"), SAME_MAPS)
def test_crss_that_are_one_map(given, same, lon, lat):
    loose = same == "EPSG:5514" or ",VERTCS[" in str(given)  # another cone, and the digits of WKT 1
    assert_same(make(given), make(same), lon, lat, atol=1e-6 if loose else SAME)


def test_crss_within_others_stay_what_they_are():
    assert (BOUND.is_bound, len(HIGH.axis_info), make("EPSG:7415").definition) == (True, 3, "EPSG:7415")
    assert ",VERTCS[" in CRS("EPSG:7415").to_wkt("WKT1_ESRI")  # as Esri writes compound CRSs


BASE = CRS("EPSG:32632").to_wkt().split(",CS[")[0].replace("PROJCRS[", "BASEPROJCRS[", 1)
DERIVED = f"""DERIVEDPROJCRS["site grid", {BASE}],
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
    assert re.search("lays all of it on one point, 0, 0: .* 'Similarity transformation'", message(similarity))
    flat = message(re.sub(r'("[AB][12]"),-?0\.\d', r"\1,0", DERIVED))
    assert re.search(r"lays all of it on one point, 100, 200: .*, or its parameters are 0\.$", flat)


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
    "EPSG:27572": (6378249.2, 6378249.2 / (6378249.2 - 6356515.0)),  # Clarke 1880 (IGN)
    "+datum=potsdam": (6377397.155, 299.1528128),
    "+datum=NAD27": (6378206.4, 6378206.4 / (6378206.4 - 6356583.8)),
}


@each(("text", "size"), ELLIPSOIDS.items())
def test_ellipsoids(text, size):
    """The ellipsoid is what the string states, in any of PROJ's ways to state one, alone and in a pipeline."""
    strings = f"+proj=merc {text}", f"+proj=pipeline +step +proj=merc {text} +step +proj=noop"
    for definition in (text,) if text.startswith("EPSG") else strings:
        ellipsoid = make(definition).ellipsoid
        assert ellipsoid.a == pytest.approx(size[0], rel=1e-15)
        assert pytest.approx(1 / size[1], rel=1e-11) == ellipsoid.f


@each(("text", "radius"), [
    *(("+R=1", 1.0), ("+R=6371000", 6371e3), ("+ellps=sphere", 6370997.0), ("+a=6378137 +b=6378137", 6378137.0)),
    ("+ellps=WGS84 +R_A", math.sqrt(WGS84.area / (4 * math.pi))),
    ("+ellps=WGS84 +R_a", WGS84.a * (1 - WGS84.f / 2)),
    ("+ellps=WGS84 +R_V", WGS84.a * (1 - WGS84.f) ** (1 / 3)),
    ("+ellps=WGS84 +R_lat_g=45", math.sqrt(math.prod(map(float, WGS84.radii(45.0))))),
])  # fmt: skip
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


@each(("text", "bare"), SHIFTS.items())
def test_datum_shifts_are_no_part_of_the_map(text, bare):
    """+datum, +towgs84 and grids move nothing: the map is that of the bare ellipsoid."""
    for projection in ("+proj=tmerc +lon_0=9", "+proj=robin"):
        found, truth = make(f"{projection} {text}"), make(f"{projection} {bare}")
        assert_same(found, truth, *EUROPE)
        assert found.ellipsoid.a == truth.ellipsoid.a
