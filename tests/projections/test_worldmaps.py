"""Maps that PROJ lacks, against compositions of PROJ's own, published figures and properties."""

import math
import pickle

import numpy as np
import pytest
from projection_points import make
from tables import each

from projdist import SPHERE, Box, distance_distortion, factors
from projdist.field import field_resolving
from projdist.matrices.measures import principal_scales
from projdist.projections.worldmaps import WORLD_MAPS, distance_around_edge

RNG = np.random.default_rng(4)
LON, LAT = RNG.uniform(-179, 179, 200), np.degrees(np.arcsin(RNG.uniform(-0.999, 0.999, 200)))
_METRE = 1e-6


@each("name", WORLD_MAPS)
def test_names_are_projections(name):
    """In any spelling, and as functions; the definition gives the map back; poles and all longitudes are on it."""
    projection = make(name)
    assert projection.ellipsoid == SPHERE
    assert projection == make(projection.definition) == make(name.replace("-", " ").upper())
    assert pickle.loads(pickle.dumps(projection)) == projection
    np.testing.assert_array_equal(projection(LON, LAT), make(WORLD_MAPS[name])(LON, LAT))
    np.testing.assert_allclose(projection(LON + 360.0, LAT), projection(LON, LAT), atol=_METRE)
    edge = np.linspace(-180.0, 180.0, 9), np.array([[-90.0], [0.0], [90.0]])
    assert np.isfinite(projection(*edge)).all()


@each("name", ["briesemeister", "double-sided-equal-area", "gott-elliptical", "gott-mugnolo-elliptical"])
def test_equal_area(name):
    found = factors(name, LON, LAT)
    good = found.quality == "ok"
    assert good.mean() > 0.9
    np.testing.assert_allclose(found.s[good], 1.0, rtol=1e-9)  # derivatives


def test_gott_elliptical_is_true_on_its_central_meridian():
    """No angle is deformed there and no length changed; the poles are the ends of the smaller axis."""
    found = factors("gott-elliptical", 0.0, np.linspace(-80, 80, 17))
    np.testing.assert_allclose([found.a, found.b], 1.0, rtol=1e-8)
    x, y = make("gott-elliptical")([180.0, 0.0], [0.0, 90.0])
    np.testing.assert_allclose([x[0], y[1]], [8 / np.pi * SPHERE.a, np.pi / 2 * SPHERE.a], rtol=1e-14)


def test_gott_elliptical_is_a_mollweide_map_of_proj():
    """Its two steps, by PROJ's Mollweide: the globe as a lune a quarter of the sphere wide, from pole to pole."""
    lam, phi = np.radians(LON) / 2, np.radians(LAT)
    height = np.degrees(np.arcsin(np.cos(phi) * np.sin(lam)))
    turn = np.degrees(np.arctan2(np.sin(phi), np.cos(phi) * np.cos(lam)))
    across, along = make("moll")(turn / 2, height)
    # An equal-area map of a quarter of the area, stretched: twice along the axis of the lune, and so on.
    truth = along * 8 / (np.pi * np.sqrt(2.0)), across * np.pi / np.sqrt(2.0)
    np.testing.assert_allclose(make("gott-elliptical")(LON, LAT), truth, atol=_METRE)


def test_briesemeister_is_an_oblique_hammer_map():
    """PROJ's, with axes brought from 2 : 1 to 7 : 4; true where Snyder & Voxland 1989 say, to a tenth of a degree."""
    hammer = f"+step +proj=ob_tran +o_proj=hammer +o_lat_p=45 +lon_0=10 +R={SPHERE.a}"
    pipeline = f"+proj=pipeline {hammer} +step +proj=affine +s11={math.sqrt(7 / 8)!r} +s22={math.sqrt(8 / 7)!r}"
    np.testing.assert_allclose(make("briesemeister")(LON, LAT), make(pipeline)(LON, LAT), atol=_METRE)
    for lat in (3.6, 86.4):
        assert factors("briesemeister", 10.0, lat).omega < 0.1
    assert factors("briesemeister", 10.0, 45.0).omega > 5.0


def test_parts_of_an_equidistant_map():
    """PROJ's equatorial equidistant map of renumbered places, wider; Wagner's axes have their true lengths."""
    x, y = make("aeqd")(LON / np.sqrt(12), LAT * 2 / 3)
    np.testing.assert_allclose(make("gott-wagner")(LON, LAT), (2 * x, y), atol=_METRE)
    x, y = make("aeqd")(LON * 5 / 18, LAT * 7 / 9)
    np.testing.assert_allclose(make("wagner-9")(LON, LAT), (18 / 5 * x, 9 / 7 * y), atol=_METRE)
    x, y = make("wagner-9")([180.0, 0.0], [0.0, 90.0])
    np.testing.assert_allclose((x[0], 2 * y[1]), np.pi * SPHERE.a, rtol=1e-14)


@each(("name", "side"), [("double-sided-equidistant", "aeqd"), ("double-sided-equal-area", "laea")])
def test_sides_are_polar_maps(name, side):
    """Each hemisphere is PROJ's polar map, set beside the other, and not mirrored."""
    x, y = make(name)(LON, LAT)
    for lat_0, hemisphere, sign in ((90, LAT > 0, -1), (-90, LAT < 0, 1)):
        polar = make(f"+proj={side} +lat_0={lat_0} +lon_0={0 if lat_0 > 0 else 180} +R={SPHERE.a}")
        edge = abs(polar(90.0, 0.0)[0])
        px, py = polar(LON[hemisphere], LAT[hemisphere])
        np.testing.assert_allclose([x[hemisphere], y[hemisphere]], [px + sign * edge, py], atol=_METRE)
    assert (factors(name, [10.0, 10.0], [50.0, -50.0], measures=["orientation"]).extra["orientation"] == 1).all()


@each(("name", "published"), [("francula-1", 0.3087), ("francula-2", 0.3115)])
def test_francula(name, published):
    """The Airy error within 85 degrees after the best scale, which computes 0.0005 lower than Francula 1971 prints."""
    samples = field_resolving(make(name), Box(-180, -85, 180, 85), tolerance=1e-6)
    a, b = np.moveaxis(principal_scales(samples.jacobian), -1, 0)
    first, second = np.average([a + b, a**2 + b**2], axis=1, weights=samples.weight)
    assert np.sqrt(1 - first**2 / (2 * second)) == pytest.approx(published, abs=6e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "published"), [("gott-elliptical", 0.365), ("gott-mugnolo-elliptical", 0.348)])
def test_gott(name, published):
    """Gott, Mugnolo & Colley 2007, abstract: rounded, and good to 0.0005."""
    found = distance_distortion(name)
    assert abs(found.value - published) < 1e-3 + 4 * found.error


@pytest.mark.slow
def test_ways_over_the_edge():
    """They are the shortest of all ways over twenty thousand points of the edge; on one side they are straight."""
    radius, angle = np.sqrt(RNG.uniform(0, 1, (2, 300))), RNG.uniform(0, 2 * np.pi, (2, 300))
    radius[:, :20], angle[1, :20] = 1 - 1e-6, angle[0, :20] + 1e-6  # next to each other on either side of the edge
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    found = distance_around_edge(x[0] - 1, y[0], 1 - x[1], y[1], edge=1.0)
    along = np.linspace(0, 2 * np.pi, 20000)[:, None]
    truth = sum(np.hypot(np.cos(along) - x[k], np.sin(along) - y[k]) for k in (0, 1)).min(axis=0)
    assert (found <= truth + 1e-7).all()
    np.testing.assert_allclose(found, truth, atol=2 * np.pi / 20000)
    same = distance_around_edge(x[0] - 1, y[0], x[1] - 1, y[1], edge=1.0)
    np.testing.assert_allclose(same, np.hypot(x[0] - x[1], y[0] - y[1]), atol=1e-15)


def test_ways_over_the_edge_in_closed_form():
    """From pole to pole two radii; from a point to the one behind it, over the nearest place of the edge."""
    assert distance_around_edge(-5.0, 0.0, 5.0, 0.0, edge=5.0) == pytest.approx(10.0)
    assert distance_around_edge(-9.0, 0.0, 9.0, 0.0, edge=5.0) == pytest.approx(2.0)
