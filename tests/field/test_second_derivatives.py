"""Hessians against closed forms and limits."""

import math

import numpy as np
import pytest
from jacobians import R, arc_distance, make, random_points, value
from tables import each

from projdist.field.at_points import jacobian
from projdist.field.stencils import hessian


def test_hessian_of_the_plate_carree():
    """x'' = 2 tan(lat) / cos(lat) sin z cos z and y'' = -tan(lat) sin^2 z along great circles, over R."""
    lon, lat = random_points(500, limit=80.0)
    phi = np.radians(lat)
    truth = np.zeros((500, 2, 2, 2))
    truth[:, 0, 0, 1] = truth[:, 0, 1, 0] = np.tan(phi) / np.cos(phi)
    truth[:, 1, 0, 0] = -np.tan(phi)
    H = hessian(make("eqc"), lon, lat)
    # Step 1e-2: rounding eps / step^2 and the sixth-order term make 1e-9 of the growth with sec^3.
    assert (np.abs(H - truth) * np.cos(phi)[:, None, None, None] ** 3).max() <= 1e-8


@each("c", [-80.0, -30.0, 1.0, 20.0, 60.0, 90.0])
def test_hessian_of_the_stereographic(c):
    """At the distance c north of the centre, across and along the radius: r = 2 tan(c / 2) in polar coordinates."""
    lat, c = c, math.radians(c)
    r, first, second = 2 * math.tan(c / 2), 1 / math.cos(c / 2) ** 2, math.sin(c / 2) / math.cos(c / 2) ** 3
    truth = np.zeros((2, 2, 2))
    truth[0, 0, 1] = truth[0, 1, 0] = (first - r / math.tan(c)) / math.sin(c)
    truth[1, 0, 0] = first / math.tan(c) - r / math.sin(c) ** 2
    truth[1, 1, 1] = second
    np.testing.assert_allclose(hessian(make("stere"), 0.0, lat), truth, atol=1e-7)


@pytest.mark.parametrize("name", ["stere", "laea", "aeqd"])
def test_hessian_at_the_centre_vanishes(name):
    """At the centre of an azimuthal map, also at a pole, straight lines are straight: H = 0."""
    for lat_0 in (0.0, 40.0, 90.0, -90.0):
        H = hessian(make(f"+proj={name} +lat_0={lat_0} +lon_0=10 +R={R}"), 10.0, lat_0)
        np.testing.assert_allclose(H, 0.0, atol=1e-7)


@pytest.mark.parametrize("name", ["flexion", "skewness"])
def test_flexion_and_skewness_of_conformal_maps(name):
    """Both are (2 / pi) |grad ln k|: tan(c / 2) for the stereographic, |tan lat| for Mercator (times 2 / pi)."""
    lon, lat = random_points(400, limit=75.0)
    c = arc_distance(lon, lat, 0.0, 0.0)
    keep = c < math.radians(140)
    projection = make("stere")
    lon, lat, c = lon[keep], lat[keep], c[keep]
    result = value(name, jacobian(projection, lon, lat), hessian(projection, lon, lat))
    np.testing.assert_allclose(result, 2 / math.pi * np.tan(c / 2), atol=1e-6)
    projection = make("merc")
    result = value(name, jacobian(projection, lon, lat), hessian(projection, lon, lat))
    np.testing.assert_allclose(result, 2 / math.pi * np.abs(np.tan(np.radians(lat))), atol=1e-6)


def test_the_gnomonic_has_no_flexion():
    """Great circles are straight on the gnomonic map."""
    lon, lat = random_points(400, limit=80.0)
    keep = arc_distance(lon, lat, 0.0, 0.0) < math.radians(70)
    projection = make("gnom")
    flexion = value("flexion", jacobian(projection, lon[keep], lat[keep]), hessian(projection, lon[keep], lat[keep]))
    np.testing.assert_allclose(flexion, 0.0, atol=1e-5)


@pytest.mark.parametrize("shape", [(), (4,), (2, 3), (0,)])
def test_hessian_is_symmetric_and_has_the_shape_of_the_points(shape):
    """H[..., i, j, k] = H[..., i, k, j], for points of any shape."""
    rng = np.random.default_rng(4)
    H = hessian(make("wintri"), rng.uniform(-150, 150, shape), rng.uniform(-70, 70, shape))
    assert H.shape == (*shape, 2, 2, 2)
    np.testing.assert_array_equal(H, np.swapaxes(H, -1, -2))
    assert np.isfinite(H).all()


@pytest.mark.parametrize(
    ("name", "lon", "lat"), [("igh", -40.0, 30.0), ("eqc", 0.0, 90.0), ("gnom", 120.0, 0.0), ("moll", 180.0, 20.0)]
)
def test_hessian_is_nan_where_the_map_is_not_smooth(name, lon, lat):
    """On seams, pole lines and outside there is no second derivative: NaN."""
    assert np.isnan(hessian(make(name), lon, lat)).all()
