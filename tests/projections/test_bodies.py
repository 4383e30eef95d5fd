"""CRSs of other bodies, with longitudes positive west or planetocentric latitudes, against closed forms."""

import json
import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from projection_points import make
from pyproj import CRS, Geod, Transformer
from pyproj.database import query_crs_info
from refusals import refuses
from tables import each, some

from projdist.answers.points_and_lines import factors
from projdist.answers.summaries import compare
from projdist.earth import Ellipsoid
from projdist.plots import heatmap
from projdist.projections.coordinates import data_crs_of, graticule_of, projected_crs_of
from projdist.projections.exports import compose, crs_wkt, parameters_of, pipeline_of, unprojected, wkt_of
from projdist.projections.operations import has_plain_axes
from projdist.projections.projection import Body, body_in, is_same_body
from projdist.regions import get_region

# Mars (2015) of the IAU's Working Group on Cartographic Coordinates: semi-axes of 3396.19 and 3376.20 km.
A, B = 3396190.0, 3376200.0
MARS = Geod(a=A, b=B)
E = math.sqrt(1.0 - (B / A) ** 2)
OGRAPHIC, OCENTRIC = 0, 1  # of a map's code: longitudes positive west, and planetocentric latitudes
MAPS = {"lcc": 49976, "north": 49931, "south": 49936, "tmerc": 49961, "aea": 49981}
ROUNDING = 1e-10  # of scales: the derivatives' own accuracy is 1e-11


def codes(name):
    """The ellipsoidal CRSs of a map of Mars: planetographic, with longitudes west, and planetocentric."""
    return [f"IAU_2015:{MAPS[name] + kind}" for kind in (OGRAPHIC, OCENTRIC)]


def m_of(phi):
    """Snyder 1987, 14-15: the radius of a parallel over a."""
    return math.cos(phi) / math.sqrt(1.0 - E**2 * math.sin(phi) ** 2)


def t_of(phi):
    """Snyder 1987, 15-9."""
    e_sin = E * math.sin(phi)
    return math.tan(math.pi / 4 - phi / 2) / ((1.0 - e_sin) / (1.0 + e_sin)) ** (E / 2)


def conic_scale(lat, one=20.0, two=60.0):
    """k of Lambert's conformal cone (Snyder 1987, 15-4, with 15-7, 15-8 and 15-10)."""
    phi, one, two = (math.radians(angle) for angle in (lat, one, two))
    n = math.log(m_of(one) / m_of(two)) / math.log(t_of(one) / t_of(two))
    return m_of(one) * (t_of(phi) / t_of(one)) ** n / m_of(phi)


def polar_scale(lat):
    """k of the polar stereographic map that is true at its pole (Snyder 1987, 21-32 and 21-33)."""
    phi = math.radians(abs(lat))
    return 2.0 * t_of(phi) / (math.sqrt((1 + E) ** (1 + E) * (1 - E) ** (1 - E)) * m_of(phi))


@each(("name", "lon", "lat"), [
    ("lcc", [30.0, -75.0, 0.0, 120.0], [10.0, 10.0, 40.0, -20.0]),
    ("north", [10.0, -130.0] * 2, [70.0, 70.0, 33.0, 33.0]),
    ("south", [10.0, -130.0] * 2, [-70.0, -70.0, -88.0, -88.0]),
])  # fmt: skip
def test_the_conformal_maps_of_mars(name, lon, lat):
    """Both have the closed form's k at geodetic latitudes, no angular deformation, and east to the right."""
    scale = [(conic_scale if name == "lcc" else polar_scale)(one) for one in lat]
    for code in codes(name):
        found = factors(code, lon, lat)
        np.testing.assert_allclose((found.h, found.k), [scale, scale], rtol=ROUNDING)
        assert (found.omega < 1e-8).all()
        assert (np.linalg.det(found.jacobian) > 0).all()
        assert name != "lcc" or (np.sign(np.round(found.x)) == np.sign(lon)).all()


@pytest.mark.parametrize("kind", [OGRAPHIC, OCENTRIC])
def test_other_maps_of_mars(kind):
    """Transverse Mercator's middle meridian is as long as its arc, k grows by x^2 / (2 M N); aea's areal scale is 1."""
    code = codes("tmerc")[kind]
    found = factors(code, 0.0, [25.0, -60.0])
    arcs = MARS.inv([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [25.0, -60.0])[2]
    np.testing.assert_allclose(found.y, np.array(arcs) * [1.0, -1.0], rtol=1e-12)
    np.testing.assert_allclose((found.h, found.k), 1.0, rtol=ROUNDING)
    beside = factors(code, 2.0, 25.0)
    M, N = beside.projection.ellipsoid.radii(25.0)
    assert beside.x > 0
    assert beside.k == pytest.approx(1.0 + beside.x**2 / (2 * M * N), abs=1e-7)  # x^4 / (24 R^4) is 5e-8
    assert beside.omega < 1e-8
    np.testing.assert_allclose(factors(codes("aea")[kind], [-100.0, 20.0], [60.0, -10.0]).s, 1.0, rtol=1e-8)


def assert_authority(code):
    """A CRS's own coordinates are those of PROJ in authority order, of its own kinds of longitude and latitude."""
    crs = CRS.from_user_input(code)
    projection = make(code)
    # No multiples of 5: there Robinson's map jumps by 4e-8 of a, and a last digit decides.
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.arange(-170.0, 171, 34), np.arange(-78.0, 79, 19.5)))
    geodetic = crs.geodetic_crs
    if geodetic.is_geographic:
        latitude = lat
    else:  # planetocentric: tan of it is (b / a)^2 tan of the geodetic one
        latitude = np.degrees(np.arctan((1 - projection.ellipsoid.f) ** 2 * np.tan(np.radians(lat))))
    (first, second) = (axis.direction for axis in geodetic.axis_info)
    assert first == "north"
    longitude = {"west": -lon, "east": lon}[second]
    u, v = Transformer.from_crs(geodetic, crs).transform(latitude, longitude)
    # PROJ 9.8 has other directions of the axes on polar maps, as of one that runs north along 90 degrees east.
    sign = {"WN": -1.0, "EN": 1.0, "XY": 1.0}["".join(axis.abbrev for axis in crs.axis_info)]
    truth = np.where(np.isfinite(u), (sign * np.asarray(u), v), np.nan)
    np.testing.assert_allclose(projection(lon, lat), truth, rtol=0, atol=1e-12 * projection.ellipsoid.a)


@each("code", ["IAU_2015:49911", "IAU_2015:49976", "IAU_2015:49937", "IAU_2015:19912", "IAU_2015:59966"])
def test_authority_order(code):
    """A few of the 340 CRSs whose axes `always_xy` does not know agree with PROJ in authority order."""
    assert not has_plain_axes(CRS.from_user_input(code).geodetic_crs)
    assert_authority(code)


@pytest.mark.slow
def test_authority_order_of_all():
    """So do all, one in 24 here: 221 with longitudes positive west, 119 with planetocentric latitudes (in PROJ 9.5)."""
    infos = query_crs_info(auth_name="IAU_2015", pj_types=["PROJECTED_CRS"], allow_deprecated=True)
    every = [f"IAU_2015:{number}" for number in sorted(int(info.code) for info in infos)]
    odd = [code for code in every if not has_plain_axes(CRS(code).geodetic_crs)]
    assert len(odd) >= 340
    for code in some(odd, 24):
        assert_authority(code)


POINTS = np.array([30.0, -20.0, 3.0]), np.array([10.0, 50.0, 47.0])


@pytest.mark.slow
@each("code", [codes("lcc")[0], *codes("south")])
def test_inverses_and_exports_agree(code):
    """Inverse, graticule, pipeline, WKT and composition are those of the map with longitudes east."""
    projection = make(code)
    x, y = projection(*POINTS)
    plane = projected_crs_of(projection)
    u, v = plane.operation.native(*POINTS)
    np.testing.assert_allclose(plane.to_metres @ (u, v), (x, y), rtol=1e-14)
    for there in (plane.inverse(u, v, 1e-3), unprojected(code, u, v), data_crs_of(projection, code).degrees(u, v)):
        np.testing.assert_allclose(there, POINTS, atol=1e-11)
    graticule = graticule_of(projection)
    np.testing.assert_array_equal(graticule.angles.from_degrees(*POINTS), POINTS)
    to_map = Transformer.from_crs(CRS.from_wkt(graticule.wkt), code, always_xy=True)
    np.testing.assert_allclose(to_map.transform(*POINTS), (u, v), rtol=1e-14)
    matrix = np.array([[1.1, 0.1], [0.0, 0.9]])
    np.testing.assert_allclose(compose(projection, matrix, "stretched")(*POINTS), matrix @ (x, y), rtol=1e-14)
    found = Transformer.from_pipeline(pipeline_of(projection, matrix)).transform(*POINTS)
    np.testing.assert_allclose(found, matrix @ (x, y), rtol=1e-14)
    wkt, _ = wkt_of(projection, matrix, "stretched")
    np.testing.assert_allclose(make(wkt)(*POINTS), matrix @ (x, y), rtol=1e-12)
    scaled = make(parameters_of(projection, np.eye(2) * 1.1))
    np.testing.assert_allclose(scaled(*POINTS), (1.1 * x, 1.1 * y), rtol=1e-12, atol=1e-5)


@pytest.mark.slow
def test_a_crs_made_on_west_longitudes_is_the_map():
    """WKT on Mars's own geographic CRS is read back as the same map, mirrored nowhere."""
    projection = make(f"+proj=lcc +lat_1=10 +lat_2=20 +lon_0=15 +a={A} +b={B}")
    wkt, _ = crs_wkt(projection, "mine", geodetic="IAU_2015:49901")
    np.testing.assert_allclose(make(wkt)(*POINTS), projection(*POINTS), rtol=1e-12)


def test_data_of_other_longitudes():
    """Points in longitudes positive west lie where they are on another CRS of the body; Paris's grads are degrees."""
    lon, lat = unprojected("EPSG:27572", *make("EPSG:27572")([5.0], [45.0]))
    np.testing.assert_allclose((lon[0], lat[0]), (5.0, 45.0), atol=1e-11)
    source = data_crs_of(make("IAU_2015:49977"), "IAU_2015:49901")
    assert not source.has_degrees
    np.testing.assert_allclose(source.degrees(POINTS[1], -POINTS[0]), POINTS, atol=1e-12)


@each("code", ["IAU_2015:49901", "IAU_2015:49902"])
def test_data_as_geopandas_has_them(code):
    geopandas = pytest.importorskip("geopandas")
    # The sphere of 49900 and the ellipsoid have their latitudes in common, as PROJ has it.
    moved = geopandas.GeoSeries(geopandas.points_from_xy(*POINTS), crs="IAU_2015:49900").to_crs(code)
    found = data_crs_of(make("IAU_2015:49976"), moved.crs).degrees(moved.x.to_numpy(), moved.y.to_numpy())
    np.testing.assert_allclose(found, POINTS, atol=1e-11)


def square_file(path, crs, places):
    """A file of a polygon with corners at coordinates of a CRS."""
    stated = {"type": "name", "properties": {"name": crs}}
    path.write_text(json.dumps({"type": "Polygon", "crs": stated, "coordinates": [[*places, places[0]]]}))
    return f"file:{path}"


@pytest.mark.slow
@pytest.mark.parametrize("kind", [OGRAPHIC, OCENTRIC])
def test_files_are_of_their_body(tmp_path, kind):
    """A file in a CRS of Mars is a region of Mars, at geodetic latitudes: of the area of GeographicLib's polygon."""
    code = codes("lcc")[kind]
    ring = [30.0, 30.5, 30.5, 30.0], [40.0, 40.0, 40.4, 40.4]
    # The axes of the planetographic CRS point west.
    corners = np.transpose(make(code)(*ring)) * [-1.0 if kind == OGRAPHIC else 1.0, 1.0]
    name = square_file(tmp_path / "r.geojson", code, corners.tolist())
    found = get_region(name)
    assert found.bounds == pytest.approx((30.0, 40.0, 30.5, 40.4), abs=2e-3)
    area, _ = MARS.polygon_area_perimeter(*ring)
    assert found.area_km2 == pytest.approx(area / 1e6, rel=1e-4)  # straight on the cone, or on the ground
    assert compare([code], name, tolerance=1e-3).region.area_km2 == found.area_km2
    for other, body in (("EPSG:3857", "the Earth"), ("IAU_2015:30110", "the Moon")):
        refuses(rf"^Invalid region 'file:.*'. It is on .* 3396.19 km, not on {body}.$", compare, [other], name)


def test_degrees_of_a_body(tmp_path):
    """A file in longitudes east and latitudes north of Mars needs no conversion, and is of Mars."""
    name = square_file(tmp_path / "r.geojson", "IAU_2015:49900", [(10, 0), (20, 0), (20, 30), (10, 30)])
    found = get_region(name)
    assert found.bounds == (10.0, 0.0, 20.0, 30.0)
    assert found.area_km2 == pytest.approx(math.radians(10.0) * 0.5 * (A / 1000.0) ** 2, rel=1e-12)  # of a sphere


@pytest.mark.slow
def test_pictures_are_not_mirrored():
    """East is right on a picture of a CRS with longitudes positive west, and Mars has no coasts of the Earth."""
    axes = Figure().add_subplot()
    heatmap("IAU_2015:49976", axes, region="box:20,0,60,40")
    lines = {collection.get_label(): collection.get_paths() for collection in axes.collections}
    assert "coastline" not in lines
    assert len(lines["graticule"]) > 10
    west, east = axes.get_xlim()
    assert -east < west < make("IAU_2015:49976")(40.0, 20.0)[0] < east


def test_strings_with_the_figure_of_a_body_are_of_it() -> None:
    """All spheres of the IAU's bodies but the Earth; a string's may be the Earth's in kilometres, or a globe's."""
    infos = query_crs_info(auth_name="IAU_2015", pj_types=["GEOGRAPHIC_2D_CRS"])
    others = (CRS.from_authority("IAU_2015", info.code) for info in infos if not info.name.startswith("Earth"))
    radii = {crs.ellipsoid.semi_major_metre for crs in others}
    assert len(radii) > 50
    for radius in radii:
        assert make(f"+proj=moll +R={radius}").is_of_another_body
    for radius in (1.0, 12.7, 6371.0, 6378.137, 6370997.0, 6371000.0, 6400000.0):
        assert not make(f"+proj=moll +R={radius}").is_of_another_body


@each(("code", "name"), [(50200, "Europa"), (200005200, "52 Europa"), (30100, "Moon")])
def test_names_of_bodies(code, name) -> None:
    """The moon of Jupiter is not the asteroid whose name has its own in it."""
    assert body_in(CRS.from_authority("IAU_2015", code).to_wkt()) == name


@each(("one", "other", "same"), [
    *((60268.0, 58232.0, True), (6378.137, 6371.0, True)),  # equator and mean radius of Saturn and the Earth
    *((1737.4, 1829.4, False), (1737.4, 1821.49, False), (6378.137, 6051.8, False)),  # Moon and Io; Earth and Venus
])  # fmt: skip
def test_bodies_without_names_are_told_apart_by_size(one, other, same) -> None:
    """Whichever comes first; names, where both are known, say more."""
    first, second = (Ellipsoid(1000.0 * radius, 0.0) for radius in (one, other))
    assert is_same_body(Body(first), Body(second)) is same
    assert is_same_body(Body(second), Body(first, "Luna")) is same
    if first.is_of_another_body and second.is_of_another_body:
        assert not is_same_body(Body(first, "a"), Body(second, "b"))
        assert is_same_body(Body(first, "a"), Body(second, "a"))
