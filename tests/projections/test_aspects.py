"""Names with parameters and with a point at the centre: closed forms, laws of turned maps, and what is refused."""

import pickle

import numpy as np
import pytest
from projection_points import LAT, LON, R, assert_same, make, mercator
from scipy.spatial.transform import Rotation
from tables import each

from projdist.answers import summarize
from projdist.field import jacobian
from projdist.projections.catalogue import NAMES
from projdist.projections.worldmaps import WORLD_MAPS

# Maps whose centre is where no meridian goes straight on, or that have none.
WITHOUT_CENTRE = {
    *("werner", "bertin", "icosahedral-snyder", "peirce-quincuncial", "polar-stereographic", "interrupted-mollweide"),
    *("briesemeister", "double-sided-equal-area", "double-sided-equidistant"),
}
# PROJ has a formula of its own for the equator and what is next to it: as a neighbour's, its Jacobian is rounding.
UNSMOOTH = {"van-der-grinten", "van-der-grinten-4"}
CENTRED = sorted({*NAMES, *WORLD_MAPS} - WITHOUT_CENTRE)
SLOW = pytest.mark.slow
ROUNDING = 1e-8  # of the Earth's radius, at a centre


def turned(lon, lat, centre_lat, centre_lon):
    """Longitude and latitude about a centre, by turns of vectors."""
    phi, lam = np.radians(lat), np.radians(lon)
    points = np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=-1)
    x, y, z = Rotation.from_euler("zy", [-centre_lon, centre_lat], degrees=True).apply(points).T
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))


def test_parameters_are_those_of_proj() -> None:
    """A name with parameters is the PROJ string that it abbreviates, on the sphere if no figure is stated."""
    for text in ("robinson+lon_0=150", "Robinson +lon_0 = 150"):
        assert_same(make(text), make(f"+proj=robin +lon_0=150 +R={R}"))
    assert_same(make("lambert-azimuthal+lat_0=52+lon_0=10"), make(f"+proj=laea +lat_0=52 +lon_0=10 +R={R}"))
    assert "N60" in make("EPSG:2393+5717").name  # a compound CRS of a code is what it was
    assert_same(make("laea+lat_0=52+ellps=GRS80"), make("+proj=laea +lat_0=52 +ellps=GRS80"))
    assert_same(make("utm+zone=33+ellps=WGS84"), make("EPSG:32633"), np.array([13.0, 16.0]), np.array([50.0, 1.0]))
    truth = make(f"+proj=aea +lat_1=29.5 +lat_2=45.5 +lat_0=39 +lon_0=-96 +R={R}")
    assert_same(make("aea+lat_1=29.5+lat_2=45.5@39,-96"), truth)


@each("centre", [(45.0, -100.0), (-33.0, 151.0), (90.0, 20.0), (-90.0, -70.0), (0.0, 150.0)])
def test_turned_mercator(centre) -> None:
    """The oblique Mercator map is Mercator's formula in longitudes and latitudes about the point."""
    lat, lon = centre
    # Near the frame's poles the map runs off.
    frame = turned(LON, LAT, lat, lon)
    far = np.abs(frame[1]) < 80.0
    assert_same(make(f"mercator@{lat},{lon}"), lambda *_: mercator(*(v[far] for v in frame)), LON[far], LAT[far], 1e-6)


@pytest.mark.slow
@each("name", CENTRED)
@each("centre", [(45.0, -100.0), (-33.0, 151.0), (0.0, 150.0)])
def test_the_point_is_at_the_centre(name, centre) -> None:
    """It has the coordinates 0, 0, north is up, and the map distorts there as the normal one at its own centre."""
    lat, lon = centre
    map_ = make(f"{name}@{lat},{lon}")
    assert np.abs(map_(lon, lat)).max() < ROUNDING * R
    if name in UNSMOOTH:
        return
    here, normal = jacobian(map_, [lon], [lat])[0], jacobian(make(name), [0.0], [0.0])[0]
    if not np.isfinite(normal).all():  # the map is singular at its centre
        return
    assert abs(here[0, 1]) < 1e-8
    assert here[1, 1] > 0
    np.testing.assert_allclose(here, normal, atol=2e-9)


@each("pole", [90, -90])
@each("name", ["mollweide", "lambert-azimuthal", "gott-elliptical", "winkel-tripel", "mercator"])
def test_a_pole_at_the_centre(name, pole) -> None:
    """The meridian of its longitude goes straight down from the north pole, and straight up from the south pole."""
    map_ = make(f"{name}@{pole},20")
    assert np.abs(map_(20.0, pole)).max() < ROUNDING * R
    x, y = map_(20.0, 0.99 * pole)
    assert (abs(x) < ROUNDING * R, np.sign(y)) == (True, -np.sign(pole))


@each("name", ["mollweide", *(pytest.param(one, marks=SLOW) for one in ("winkel-tripel", "robinson", "wagner-9"))])
def test_the_globe_is_turned_without_loss(name) -> None:
    """Over the sphere the Airy-Kavrayskiy figure is the same in every aspect, as far as each says that it is known."""
    normal = summarize(name, tolerance=1e-5)
    aspect = summarize(f"{name}@45,-100", tolerance=1e-5)
    slack = normal.error_estimate + aspect.error_estimate
    assert abs(normal.airy_kavrayskiy - aspect.airy_kavrayskiy) <= slack < 1e-4


@each("text", ["mollweide@45N,100W", "mollweide@100w,45n", "mollweide @ 45 -100", "Mollweide@45,260"])
def test_ways_to_write_a_point(text) -> None:
    """Latitude and longitude, or the letters of hemispheres in any order."""
    found = make(text)
    assert_same(found, make("moll@45,-100"))
    assert found.name == "Mollweide, 45° N, 100° W"


@each("text", ["gott-elliptical@45,-100", "gott-elliptical+lon_0=20", "robinson+lon_0=150", "moll@-5,7"])
def test_definitions_are_read_back(text) -> None:
    """The definition of what was made makes it again; so does a pickle."""
    made = make(text)
    assert_same(make(made.definition), made)
    assert_same(pickle.loads(pickle.dumps(made)), made)
