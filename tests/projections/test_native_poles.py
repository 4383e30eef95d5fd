"""The poles about which maps are simple, against the maps themselves."""

import numpy as np
import pytest
from tables import each

from projdist.answers.summaries import summarize
from projdist.projections import Projection, native_pole_of
from projdist.regions import GLOBE, TurnedGlobe

R = 6371008.7714
# Not at Robinson's five degrees, where PROJ's table steps by two metres.
U, V = np.array([-170.0, -100.0, -20.0, 35.0, 140.0]), np.array([77.0, 51.0, 21.0, 1.0])
ROUNDING = 1e-12  # of coordinates


def in_its_chart(text):
    """x and y (5, 4) at longitudes U and latitudes V about the map's own pole."""
    projection = Projection.from_user_input(f"{text} +R={R}")
    u, v = np.meshgrid(U, V, indexing="ij")
    points = TurnedGlobe(*native_pole_of(projection)).chart(np.zeros(u.shape, dtype=int), u, v)
    return projection(points.lon, points.lat)


@each("name", ["laea", "aeqd", "stere", "ortho", "gnom", "airy", "nsper +h=1e7"])
def test_circles_about_the_centre_of_azimuthal_maps(name):
    """What is as far from the centre on the Earth is as far on the map."""
    x, y = in_its_chart(f"+proj={name} +lon_0=40 +lat_0=-35")
    distance = np.hypot(x, y)
    spread = np.ptp(distance, axis=0) / distance[0]
    assert (spread[np.isfinite(spread)] < ROUNDING).all()
    assert np.isfinite(spread).sum() >= 2


@pytest.mark.parametrize(("name", "base"), [("tmerc", "merc"), ("cass", "eqc"), ("tcea", "cea")])
def test_transverse_cylinders(name, base):
    """Their x is the normal map's y, and their y goes round the pole from a quarter turn off its meridian."""
    x, y = in_its_chart(f"+proj={name} +lon_0=25")
    u, v = np.meshgrid(U, V, indexing="ij")
    np.testing.assert_allclose(x, Projection.from_user_input(f"+proj={base} +R={R}")(u, v)[1], rtol=1e-10)
    np.testing.assert_allclose(np.exp(1j * y / R), np.exp(-1j * np.radians(u + 90.0)), atol=1e-12)


@pytest.mark.parametrize("base", ["moll", "robin", "igh"])
def test_oblique_maps(base):
    """ob_tran is its base at the chart's longitudes, turned by a half turn and o_lon_p."""
    x, y = in_its_chart(f"+proj=ob_tran +o_proj={base} +o_lat_p=40 +o_lon_p=25 +lon_0=10")
    u, v = np.meshgrid((U - 180.0 + 25.0 + 180.0) % 360.0 - 180.0, V, indexing="ij")
    bx, by = Projection.from_user_input(f"+proj={base} +R={R}")(u, v)
    np.testing.assert_allclose(x, bx, atol=1e-5)
    np.testing.assert_allclose(y, by, atol=1e-5)


@pytest.mark.parametrize(
    "text", ["+proj=laea +lat_0=45 +lon_0=13", "+proj=ob_tran +o_proj=moll +o_lon_p=20 +o_lat_p=40", "+proj=tmerc"]
)
def test_figures_over_the_globe_are_the_same_without(text):
    """As a function, whose pole is not known, the map has the same errors, and takes more evaluations."""
    known = Projection.from_user_input(f"{text} +R={R}")
    bare = Projection.from_function(lambda lon, lat: known.function(lon, lat), ellipsoid=known.ellipsoid)
    found, truth = (summarize(one, GLOBE, tolerance=1e-4) for one in (known, bare))
    estimate = found.error_estimate + truth.error_estimate
    for name in ("airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), abs=estimate)
    assert found.evaluations < truth.evaluations


@each(
    "text",
    [
        *("moll", "EPSG:3035", "+proj=laea +lat_0=90", "+proj=laea +R=1 +pm=paris"),
        "+proj=stere +lat_0=30 +ellps=WGS84",
        "+proj=ob_tran +o_proj=moll +o_alpha=30 +o_lon_c=5 +o_lat_c=3 +R=1",
    ],
)
def test_maps_without_a_pole_of_their_own(text):
    """The Earth's pole serves normal and polar maps; most ellipsoids, CRSs and other words are left alone."""
    assert native_pole_of(Projection.from_user_input(text)) is None
    assert native_pole_of(Projection.from_function(lambda lon, lat: (lon, lat))) is None
