"""What is known of maps: metadata, and the lines and poles at which they are torn, bent or simple."""

import math

import numpy as np
import pytest
from projection_points import R, make
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth import SMOOTH, data_rows
from projdist.projections import CrsAxis, Projection, Setting, discontinuities_of, metadata_of, native_pole_of
from projdist.regions import TurnedGlobe


def of(given):
    return metadata_of(make(given))


def test_a_crs() -> None:
    """EPSG:27572, whose angles are grads from Paris; EPSG:2036, in place of which EPSG names EPSG:2953."""
    found = of("EPSG:27572")
    assert (found.kind, found.code, found.prime_meridian) == ("projected CRS", "EPSG:27572", "Paris")
    assert (found.geographic_crs, found.method) == ("EPSG:4807 NTF (Paris)", "Lambert Conic Conformal (1SP)")
    origin, scale = "Latitude of natural origin", "Scale factor at natural origin"
    assert {Setting(origin, 52.0, "grad"), Setting(scale, 0.99987742, "")} <= set(found.parameters)
    assert found.axes == (CrsAxis("Easting", "east"), CrsAxis("Northing", "north"))
    found = of("EPSG:2036")
    assert (found.deprecated, found.replaced_by) == (True, ("EPSG:2953",))
    assert not of("EPSG:2953").deprecated


def test_kinds() -> None:
    """Of CRSs PROJ's types; of others what they are made of."""
    kinds = {"EPSG:7405": "compound CRS", "robinson": "PROJ string"}
    kinds |= dict.fromkeys(("gott-elliptical", "gott-elliptical+lon_0=10"), "map that PROJ lacks")
    kinds |= {"+proj=pipeline +step +proj=moll +step +proj=affine +s11=2": "PROJ pipeline"}
    kinds |= {(lambda lon, lat: (lon, lat)): "function of longitude and latitude"}
    assert {given: of(given).kind for given in kinds} == kinds


def test_a_proj_string() -> None:
    """Its parameters but for those of the figure and the unit; a flag has no value."""
    found = of("+proj=utm +zone=33 +south +units=us-ft +ellps=WGS84")
    assert found.parameters == (Setting("zone", "33", ""), Setting("south", None, ""))
    assert (found.unit, found.ellipsoid_name) == ("us-ft", "WGS 84")
    assert found.unit_metres == pytest.approx(1200 / 3937, rel=1e-14)
    assert of("robinson").unit == "metre"
    assert math.isnan(of(lambda lon, lat: (lon, lat)).unit_metres)


OPERATIONS = [row["name"] for row in data_rows("discontinuities.csv") if row["kind"] == "operation"]
_STEP = 0.01  # degrees


def roughness(projection, lon, lat, along):
    """The largest fourth differences of x and y, with points half a step beside the middle on either side."""
    offset = _STEP * (np.arange(8) - 3.5)
    lon, lat = np.broadcast_arrays(lon + offset * (along == "lon"), lat + offset * (along == "lat"))
    return np.abs(np.diff(np.stack(projection(lon, lat)), n=4, axis=-1)).max()


@each("name", OPERATIONS)
def test_maps_are_rough_there(name):
    """Across each break the differences of x and y are far larger than a tenth of a degree beside it."""
    projection = make(f"+proj={name} +R=6371008.7714")
    breaks = discontinuities_of(projection)
    for lat in breaks.parallels:
        beside = max(roughness(projection, 33.0, lat + away, "lat") for away in (-0.1, 0.1))
        assert roughness(projection, 33.0, lat, "lat") > 5.0 * beside
    for lats, lons in (((20.0, 65.0), breaks.northern), ((-20.0, -65.0), breaks.southern)):
        for lon in lons:
            at = max(roughness(projection, lon, lat, "lon") for lat in lats)
            beside = max(roughness(projection, lon + away, lat, "lon") for lat in lats for away in (-0.1, 0.1))
            assert at > 5.0 * beside or lon == -180.0


def known_and_bare(text):
    """A map, and the same as a function, of which nothing is known."""
    known = make(f"{text} +R={R}")
    return known, Projection.from_function(lambda lon, lat: known.function(lon, lat), ellipsoid=known.ellipsoid)


OBLIQUE = ["laea +lat_0=45 +lon_0=13", "ob_tran +o_proj=moll +o_lon_p=20 +o_lat_p=40", "tmerc"]


@pytest.mark.slow
@each("name", [*OPERATIONS, "moll +lon_0=77", *OBLIQUE])
def test_figures_are_the_same_without(name):
    """As a function, whose breaks and pole are not known, the map has the same errors, and takes more evaluations."""
    found, truth = (summarize(one, "globe", tolerance=1e-4) for one in known_and_bare(f"+proj={name}"))
    estimate = found.error_estimate + truth.error_estimate
    for figure in ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"):
        assert getattr(found, figure) == pytest.approx(getattr(truth, figure), abs=estimate)
    assert found.error_estimate <= 1e-4
    assert found.evaluations < truth.evaluations or name == "robin"  # which at 1e-4 is as good as smooth


def test_breaks_turn_with_the_central_meridian():
    """Interruptions move with lon_0, and there is the meridian opposite; of a CRS likewise."""
    turned = discontinuities_of(make("+proj=igh +lon_0=30 +R=1"))
    assert turned.southern == pytest.approx((-150.0, -70.0, 10.0, 110.0))
    assert turned.northern == pytest.approx((-150.0, -10.0))
    assert discontinuities_of(make("+proj=merc +lon_0=-100 +R=1")).northern == (80.0,)
    assert len(discontinuities_of(make("ESRI:54030")).parallels) == 34


@each(
    "text", ["+proj=ob_tran +o_proj=moll +o_lat_p=45 +R=1", "+proj=robin +pm=paris", "+proj=robin +over", "EPSG:3035"]
)
def test_nothing_is_known_of_others(text):
    """Oblique maps have no break along meridians; shifted ones and most CRSs are left alone."""
    assert discontinuities_of(make(text)) == SMOOTH
    assert discontinuities_of(Projection.from_function(lambda lon, lat: (lon, lat))) == SMOOTH


# Not at Robinson's five degrees, where PROJ's table steps by two metres.
U, V = np.array([-170.0, -100.0, -20.0, 35.0, 140.0]), np.array([77.0, 51.0, 21.0, 1.0])
ROUNDING = 1e-12  # of coordinates


def in_its_chart(text):
    """x and y (5, 4) at longitudes U and latitudes V about the map's own pole."""
    projection = make(f"{text} +R={R}")
    u, v = np.meshgrid(U, V, indexing="ij")
    points = TurnedGlobe(*native_pole_of(projection)).chart(np.zeros(u.shape, dtype=int), u, v)
    return projection(points.lon, points.lat)


@each("name", ["laea", "aeqd", "stere", "ortho", "gnom", "airy", "nsper +h=1e7"])
def test_circles_about_the_centre_of_azimuthal_maps(name):
    """What is as far from the centre on the Earth is as far on the map."""
    x, y = in_its_chart(f"+proj={name} +lon_0=40 +lat_0=-35")
    spread = np.ptp(np.hypot(x, y), axis=0) / np.hypot(x, y)[0]
    assert (spread[np.isfinite(spread)] < ROUNDING).all()
    assert np.isfinite(spread).sum() >= 2


@each(("name", "base"), [("tmerc", "merc"), ("cass", "eqc"), ("tcea", "cea")])
def test_transverse_cylinders(name, base):
    """Their x is the normal map's y, and their y goes round the pole from a quarter turn off its meridian."""
    x, y = in_its_chart(f"+proj={name} +lon_0=25")
    u, v = np.meshgrid(U, V, indexing="ij")
    np.testing.assert_allclose(x, make(f"+proj={base} +R={R}")(u, v)[1], rtol=1e-10)
    np.testing.assert_allclose(np.exp(1j * y / R), np.exp(-1j * np.radians(u + 90.0)), atol=1e-12)


@each("base", ["moll", "robin", "igh"])
def test_oblique_maps(base):
    """ob_tran is its base at the chart's longitudes, turned by a half turn and o_lon_p."""
    x, y = in_its_chart(f"+proj=ob_tran +o_proj={base} +o_lat_p=40 +o_lon_p=25 +lon_0=10")
    u, v = np.meshgrid((U - 180.0 + 25.0 + 180.0) % 360.0 - 180.0, V, indexing="ij")
    np.testing.assert_allclose((x, y), make(f"+proj={base} +R={R}")(u, v), atol=1e-5)


@each("text", [
    *("moll", "EPSG:3035", "+proj=laea +lat_0=90", "+proj=laea +R=1 +pm=paris"),
    "+proj=stere +lat_0=30 +ellps=WGS84",
    "+proj=ob_tran +o_proj=moll +o_alpha=30 +o_lon_c=5 +o_lat_c=3 +R=1",
])  # fmt: skip
def test_maps_without_a_pole_of_their_own(text):
    """The Earth's pole serves normal and polar maps; most ellipsoids, CRSs and other words are left alone."""
    assert native_pole_of(make(text)) is None
    assert native_pole_of(Projection.from_function(lambda lon, lat: (lon, lat))) is None
