"""Maps by themselves and in regions: what they keep, their figures, and nodes of regions, against closed forms."""

import math

import numpy as np
import pytest
from jacobians import m_of, q_of
from samples import turned
from tables import each

from projdist import FIGURES, SPHERE, WGS84, Box, Cap, info, sample, summarize
from projdist.decisions.map_info import PROPERTIES, WeightedPoints, _square_across, properties_of
from projdist.decisions.measurement import FullMeasurement, lattice_of, measure, probe_of
from projdist.field import jacobian
from projdist.projections import Projection
from projdist.regions import GLOBE, get_region

# Snyder & Voxland 1989, An Album of Map Projections, says of each what it keeps; of the CRSs, EPSG's Guidance Note 7-2.
CASSINI = "+proj=cass +lat_0=47 +lon_0=8.5 +R=6371000"
KNOWN = {
    "mercator": "conformal", "stere": "conformal", "lagrange": "conformal", "mollweide": "equal-area",
    "hatano": "equal-area", "sinu": "equal-area", "goode": "equal-area", "gott-elliptical": "equal-area",
    "plate-carree": "equidistant", "aeqd": "equidistant", "robinson": "", "winkel-tripel": "",
    "EPSG:32633": "conformal", "EPSG:5514": "conformal", "EPSG:6933": "equal-area",
    "EPSG:2326": "conformal",  # a square of 50 km, in which every map is nearly everything
    "EPSG:3857": "", "ESRI:54009": "",  # formulas of the sphere on an ellipsoid
    "EPSG:32632": "conformal", "EPSG:2056": "conformal", "EPSG:3035": "equal-area", "EPSG:9191": "equal-area",
    CASSINI: "equidistant",
}  # fmt: skip


def kept(names: str) -> tuple[str, ...]:
    return tuple(names.split())


@pytest.mark.slow
@pytest.mark.parametrize("given", KNOWN)
def test_what_is_kept(given: str) -> None:
    """As measured it is what the literature says, also where PROJ's own iterations leave 1e-6."""
    found = info(given, "cap:10,50,100")
    assert found.keeps == kept(KNOWN[given])
    assert not found.promises or found.promises in found.keeps


def test_departures_are_by_closed_forms() -> None:
    """Pseudo-Mercator stretches meridians by nu / rho less than parallels; plate carree has s = 1 / cos(latitude)."""
    found = info("EPSG:3857", Box(0, 0, 1, 1))
    at_equator = -np.log(1.0 - WGS84.eccentricity_squared)
    assert 0.98 * at_equator < found.departures["conformal"] <= at_equator
    plain = info(lambda lon, lat: (SPHERE.a * np.radians(lon), SPHERE.a * np.radians(lat)), "box:0,0,1,1")
    # The median of ln(sec) by area is at the parallel of 30 degrees; 99 % of the globe lie below asin(0.99).
    below = np.log(1.0 / np.cos(np.arcsin(0.99))) - np.log(1.0 / np.cos(np.radians(30.0)))
    assert plain.departures["equal-area"] == pytest.approx(below, rel=0.1)


@pytest.mark.slow
def test_errors_by_closed_forms() -> None:
    """Of Mercator's map between the equator and 60 degrees: k = sec, whose mean by area is the gd's integral."""
    found = info("mercator", "box:0,0,30,60")
    mean = found.measures["h"].mean
    assert mean.value == pytest.approx(np.radians(60.0) / np.sin(np.radians(60.0)), abs=max(mean.error, 1e-12))
    for name, value, error in (("h", 2, 1e-9), ("s", 4, 1e-8), ("scale_error_ppm", 1e6, 1e-2), ("omega", 0, 1e-6)):
        assert found.measures[name].maximum.value == pytest.approx(value, abs=error)
    assert found.coverage == 1.0
    assert found.airy_kavrayskiy.raw > found.airy_kavrayskiy.scaled > 0.0


@pytest.mark.slow
def test_what_is_stated() -> None:
    """The region is the area of use; the dictionary and the frame have what the registry has."""
    found, bounds = info("EPSG:3035"), [-35.58, 24.6, 44.83, 84.73]
    stated = found.to_dict()
    assert (found.region, stated["area_of_use"]["bounds"]) == (Box(*bounds), bounds)
    assert [axis["direction"] for axis in stated["axes"]] == ["north", "east"]
    assert (stated["unit"], stated["deprecated"]) == ({"name": "metre", "metres": 1.0}, False)
    assert stated["ellipsoid"] == {"name": "GRS 1980", "a": 6378137.0, "inverse_flattening": 298.257222101}
    origin = {"Latitude of natural origin": 52.0, "Longitude of natural origin": 10.0}
    origin |= {"False easting": 4321000.0, "False northing": 3210000.0}
    assert {one["name"]: one["value"] for one in stated["parameters"]} == origin
    assert repr(found).startswith("MapInfo(ETRS89-extended / LAEA Europe, equal-area; AK 0.0323")
    pytest.importorskip("pandas")
    frame = found.to_frame()
    assert (len(frame), frame.keeps[0], frame["axes"][0]) == (1, "equal-area", "north;east")


@pytest.mark.slow
def test_what_diverges() -> None:
    """Scales without bound are null, and nothing of JSON is infinite."""
    found = info("mercator")
    assert found.to_dict()["errors"]["s"]["max"] is None
    assert found.to_json()


def points(width: float = 360.0, n: int = 400) -> WeightedPoints:
    """With even weights all over the globe, or in a square of some degrees."""
    lon, height = width * RNG.uniform(-0.5, 0.5, n), np.sin(np.radians(min(0.5 * width, 90.0)))
    return WeightedPoints(lon, np.degrees(np.arcsin(height * RNG.uniform(-1.0, 1.0, n))), np.full(n, 1.0 / n))


RNG = np.random.default_rng(5)
EVERYWHERE = points()
K, ONE = RNG.uniform(0.99, 1.02, 400), np.ones(400)
FIELDS = {
    "conformal": (K, K), "equal-area": (K, 0.819 / K), "equidistant": (ONE, K), " ".join(PROPERTIES): (ONE, ONE),
    "": (K, RNG.uniform(0.98, 0.985, 400)),
}  # fmt: skip


@each("keeps", FIELDS)
def test_properties(keeps: str) -> None:
    """Equal-area is a constant areal scale, whatever it is; conformal a = b; equidistant a or b = 1 everywhere."""
    assert properties_of(turned(RNG, *FIELDS[keeps]), EVERYWHERE).keeps == kept(keeps)


@each(("width", "error", "is_kept"), [(360, 4e-6, True), (360, 1e-4, False), (0.1, 4e-6, False)])
def test_limits(width: float, error: float, is_kept: bool) -> None:
    """What PROJ's iterations leave is rounding in maps of the world; the same is much in a town."""
    found = properties_of(turned(RNG, K * (1.0 + error), K), points(width))
    assert found.departures["conformal"] == pytest.approx(np.log1p(error), rel=1e-6)
    assert ("conformal" in found.keeps) == is_kept


def test_poles_do_not_count() -> None:
    """Half a per cent of the area may be anything, and what is undefined or on the edges has no part."""
    # Where no matrix is defined nothing is kept, and nobody knows how far off it is.
    J = turned(RNG, K, K)
    J[:2, 0, 0] *= 2.0
    assert properties_of(J, EVERYWHERE).keeps == ("conformal",)
    J[2:300] = np.nan
    assert properties_of(J, EVERYWHERE).keeps == ()
    edges = WeightedPoints(EVERYWHERE.lon, EVERYWHERE.lat, np.where(np.arange(400) < 2, 0.0, EVERYWHERE.weight))
    assert properties_of(J, edges).keeps == ("conformal",)
    none = properties_of(np.full((400, 2, 2), np.nan), EVERYWHERE)
    assert (none.keeps, np.isnan([*none.departures.values()]).all()) == ((), True)


def test_the_size_of_a_strip_is_its_width() -> None:
    """What maps are off by grows across it: a degree to either side of a meridian has a third of its square."""
    lat = np.degrees(np.arcsin(RNG.uniform(-0.7, 0.7, 4000)))
    lon = 30.0 + np.linspace(-1.0, 1.0, 4000) / np.cos(np.radians(lat))
    found = _square_across(lon, lat, np.full(4000, 1.0 / 4000.0))
    assert found == pytest.approx(np.radians(1.0) ** 2 / 3.0, rel=1e-2)


@each("km", [1.0, 10.0, 100.0, 500.0])
@each("given", ["EPSG:32632", "EPSG:2056", "EPSG:3035", "EPSG:9191", CASSINI, "EPSG:3857", "ESRI:54009"])
def test_regions_of_any_size(given: str, km: float) -> None:
    """A town's maps keep what they keep of a country, though all are nearly true in it."""
    probe = probe_of(Cap(8.2, 46.8, km))
    J = jacobian(Projection.from_user_input(given), probe.lon, probe.lat)
    assert properties_of(J, probe).keeps == kept(KNOWN[given])


def test_off_by_curvature() -> None:
    """Seen from far away a sphere has the areal scale cos(rho): even between 1 and that of the rim, by area."""
    n, rim = 2000, 100e3 / SPHERE.a
    share = (np.arange(n) + 0.5) / n
    rho, bearing = np.arccos(1.0 - share * (1.0 - np.cos(rim))), 2.4 * np.arange(n)
    lon = np.degrees(np.arctan2(np.sin(rho) * np.sin(bearing), np.cos(rho)))
    cap = WeightedPoints(lon, np.degrees(np.arcsin(np.sin(rho) * np.cos(bearing))), np.full(n, 1.0 / n))
    J = jacobian(Projection.from_user_input(f"+proj=ortho +R={SPHERE.a}"), cap.lon, cap.lat)
    # From the median, with half of the area on either side, 99 % are within 0.99 / 2 of it.
    assert properties_of(J, cap).departures["equal-area"] == pytest.approx(0.5 * rim**2 * 0.99 * 0.5, rel=2e-3)


def measured(code, region, keeps=()):
    """A candidate's figures over a region."""
    region = get_region(region)
    options = {"keeps": keeps, "level": 0.01, "ranking": FIGURES["airy_kavrayskiy"]}
    value, found = measure(FullMeasurement(code=code, name=code, region=region, probe=probe_of(region), **options))
    assert value == found.airy_kavrayskiy
    return found


@pytest.mark.slow
def test_no_noise_beside_the_centre():
    """An equal-area azimuthal map of Antarctica shears most at the northernmost vertex, not where J is noise."""
    phi = math.radians(-get_region("continent:Antarctica").edges[:, 1].max())
    # Snyder 1987, 21-32 and 24-23; h is 1 / k.
    k = math.sqrt(q_of(WGS84, math.pi / 2) - q_of(WGS84, phi)) / m_of(WGS84, phi)
    expected = math.degrees(2 * math.asin((k - 1 / k) / (k + 1 / k)))
    found = measured("EPSG:6932", "continent:Antarctica", ("equal-area",))
    assert found.max_omega == pytest.approx(expected, abs=1e-6)


def van_der_grinten(lam, phi):
    """x and y in radii north-east of the centre (Snyder 1987, 29-1 to 29-6)."""
    sine = 2 * phi / np.pi
    cosine = np.sqrt(1 - sine**2)
    A, G = 0.5 * (np.pi / lam - lam / np.pi), cosine / (sine + cosine - 1)
    P, Q = G * (2 / sine - 1), A**2 + G
    below = P**2 + A**2
    x = A * (G - P**2) + np.sqrt(A**2 * (G - P**2) ** 2 - below * (G**2 - P**2))
    y = P * Q - A * np.sqrt((A**2 + 1) * below - Q**2)
    return np.pi * x / below, np.pi * y / below


@pytest.mark.slow
def test_mean_beside_noise():
    """PROJ's Van der Grinten map rounds by kilometres beside its centre: its mean is found where cells are larger."""
    # The mean of max(|a - 1|, |b - 1|) of the formulas, on 100 by 100 cells, by differences.
    lam, phi = np.meshgrid(*[np.radians(0.2 * np.arange(100) + 0.1)] * 2)
    step, e2 = 1e-4, WGS84.f * (2 - WGS84.f)
    east = np.subtract(van_der_grinten(lam + step, phi), van_der_grinten(lam - step, phi)) / (2 * step)
    north = np.subtract(van_der_grinten(lam, phi + step), van_der_grinten(lam, phi - step)) / (2 * step)
    parallel = m_of(WGS84, phi)
    M = (1 - e2) * (parallel / np.cos(phi)) ** 3
    scales = np.linalg.svd(np.moveaxis(np.stack([east / parallel, north / M], axis=1), (0, 1), (-2, -1)))[1]
    scales *= math.sqrt(WGS84.area / (4 * math.pi)) / WGS84.a  # ESRI's CRS has the sphere of the same area (+R_A)
    ppm = 1e6 * np.average(np.abs(scales - 1).max(axis=-1), weights=M * parallel)
    found = measured("ESRI:54029", "box:-20,-20,20,20")
    summary = summarize("ESRI:54029", "box:-20,-20,20,20", measures=["scale_error_ppm"])
    means = found.mean_scale_error_ppm, summary.measures["scale_error_ppm"].mean
    assert means == pytest.approx((ppm, ppm), rel=1e-4)
    assert summary.airy_kavrayskiy == pytest.approx(found.airy_kavrayskiy, rel=1e-6)
    assert summary.error_estimate < 1e-5


@pytest.mark.slow
def test_areal_scale_has_a_mean_where_the_image_is_bounded():
    """Adams' map of the world is a square: the mean areal scale is its area by that of the sphere, though s grows."""
    # At its corners angles of 360 degrees become right ones, so that s grows as r^-1.5.
    projection = Projection.from_user_input("+proj=adams_ws2 +R=1")
    north = projection(0.0, 90.0)[1]
    assert sample(projection, "globe").mean("s").value == pytest.approx(2 * north**2 / (4 * math.pi), rel=1e-3)
    assert measured("+proj=adams_ws2 +R=6371007", "globe").mean_areal_error_ppm == pytest.approx(827860, rel=2e-3)
    # Beside the pole that a conic map has at infinity s grows as r^-3.3: its integral diverges.
    assert math.isnan(measured("+proj=lcc +lat_1=30 +lat_2=50", "globe", ("conformal",)).mean_areal_error_ppm)


@pytest.mark.slow
def test_noise_beside_a_rim_is_no_singular_point():
    """PROJ's map of Guyou snaps to the rim of a hemisphere; the least areal scale is that of the middle, about 1."""
    assert measured("+proj=guyou +R=6371007", "globe", ("conformal",)).min_areal_scale == pytest.approx(1.0, abs=0.02)


@each("region", [GLOBE, Box(5.9, 47.3, 15.0, 55.1), Box(177, -20, -178, -15), Cap(10, 50, 20), Cap(0, -90, 2000)])
def test_weights(region):
    probe = probe_of(region)
    assert probe.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert region.contains(probe.lon, probe.lat).all()
    assert 60 <= len(probe.lon) <= 400


def test_mean_latitude():
    """The mean of sin(latitude) over a band is the mean of its ends, by Archimedes, but for the flattening."""
    probe = probe_of(Box(0, 20, 40, 60))
    mean = probe.weight @ np.sin(np.radians(probe.lat))
    assert mean == pytest.approx(0.5 * (np.sin(np.radians(20)) + np.sin(np.radians(60))), abs=2e-3)


@each(("area", "share"), [
    ((177, -20, -178, -15), 1.0), ((177, -20, 180, -15), 0.6), ((-180, -20, -178, -15), 0.4),
    ((-180, -90, 180, 90), 1.0), ((0, -20, 10, -15), 0.0),
])  # fmt: skip
def test_share_across_the_antimeridian(area, share):
    """Shares of a box that crosses the antimeridian, within areas that do and do not; to half a row of its lattice."""
    lattice = lattice_of(Box(177, -20, -178, -15))
    assert lattice.within([area])[0] @ lattice.weight == pytest.approx(share, abs=0.02)
