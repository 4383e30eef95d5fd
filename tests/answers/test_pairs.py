"""Points strewn over regions: where they lie, and that means over them are those by area."""

import numpy as np
import pytest
from pyproj import Geod
from tables import each

from projdist import SPHERE, WGS84, Ellipsoid, PointSet, get_region
from projdist.answers.distances import scatter_over

TRIANGLE = {"type": "Polygon", "coordinates": [[[-20, 10], [60, 20], [10, 75], [-20, 10]]]}
REGIONS = ["globe", "box:170,-60,-170,80", "cap:10,50,3000", "cap:0,-90,5000", TRIANGLE, "country:FJ"]
_SIGMAS = 4.0  # standard errors: one in 16,000 is further off


def draws(region, ellipsoid, count=400):
    """Thirty-two draws."""
    rng = np.random.default_rng(5)
    draw = scatter_over(get_region(region), ellipsoid)
    return [draw(count, rng) for _ in range(32)]


@each("region", REGIONS)
def test_points_are_in_their_region(region):
    """About as many as were asked for, all inside."""
    place = get_region(region)
    for points in draws(region, WGS84)[:4]:
        assert 0.8 * 400 <= points.lon.size <= 1.25 * 400
        # The rim of a cap, to rounding.
        assert np.mean(place.contains(points.lon, points.lat)) > 0.99


def area_mean(box, ellipsoid, function):
    """The mean of a function of the latitude over a box, by Gauss's rule in the latitude."""
    south, north = box
    x, w = np.polynomial.legendre.leggauss(60)
    lat = 0.5 * (south + north) + 0.5 * (north - south) * x
    meridian, vertical = ellipsoid.radii(lat)
    w = w * meridian * vertical * np.cos(np.radians(lat))
    return np.sum(w * function(lat)) / np.sum(w)


@each("region", ["globe", "box:170,-60,-170,80", "box:0,60,90,90"])
@each("ellipsoid", [SPHERE, WGS84])
def test_means_are_by_area(region, ellipsoid):
    """The mean of the latitude's square is that by true area, so finely that sphere and ellipsoid are told apart."""
    _, south, _, north = get_region(region).bounds
    truth = area_mean((south, north), ellipsoid, np.square)
    means = [np.sum(p.weight * p.lat**2) / p.weight.sum() for p in draws(region, ellipsoid)]
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    assert error < 1e-3 * truth
    assert abs(np.mean(means) - truth) < _SIGMAS * error


@pytest.mark.slow
def test_polygons_are_strewn_by_area():
    """The middle of a polygon, as Gauss's rule on triangles in longitude and latitude has it."""
    x, w = np.polynomial.legendre.leggauss(20)
    u, v = 0.5 * (1 + x[:, None]), 0.5 * (1 + x[None, :])
    corners = np.array(TRIANGLE["coordinates"][0][:3], dtype=float)
    lon, lat = (corners[0] + u[..., None] * (corners[1] - corners[0] + v[..., None] * (corners[2] - corners[1]))).T
    weight = (np.outer(w, w) * u).T * np.cos(np.radians(lat))
    truth = np.sum(weight * lon) / weight.sum(), np.sum(weight * lat) / weight.sum()
    found = np.array([(np.mean(p.lon), np.mean(p.lat)) for p in draws(TRIANGLE, SPHERE)])
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    assert (error < 0.1).all()
    assert (np.abs(found.mean(axis=0) - truth) < _SIGMAS * error).all()


def test_caps_are_strewn_by_area():
    """The mean of the cosine of the distance from the middle is that of a zone, its middle height."""
    region = get_region("cap:200,-70,6000", SPHERE)
    truth = 0.5 * (1 + np.cos(np.radians(region.angle)))
    sin, cos = np.sin(np.radians(region.lat)), np.cos(np.radians(region.lat))
    for points in draws(region, SPHERE)[:4]:
        lam, phi = np.radians(points.lon - region.lon), np.radians(points.lat)
        cosine = sin * np.sin(phi) + cos * np.cos(phi) * np.cos(lam)
        assert np.mean(cosine) == pytest.approx(truth, abs=2e-4)  # stratified: n^-1.5 of a third


def test_caps_of_a_flat_body_are_strewn_by_area():
    """On Saturn, where a cap's rim is no circle of its latitudes: the mean over places within the distance."""
    saturn = Ellipsoid(60268000.0, 0.09796)
    shares = (np.arange(150) + 0.5) / 150
    lon, lat = np.meshgrid(-25.0 + 50.0 * shares, -25.0 + 50.0 * shares)
    distance = Geod(a=saturn.a, f=saturn.f).inv(np.zeros(lon.shape), np.zeros(lon.shape), lon, lat)[2]
    meridian, vertical = saturn.radii(lat)
    weight = (distance <= 2e7) * meridian * vertical * np.cos(np.radians(lat))
    means = [np.sum(p.weight * p.lon**2) / p.weight.sum() for p in draws(get_region("cap:0,0,20000", saturn), saturn)]
    # A cell of the lattice is a sixtieth of the radius, and the rim's cells fall on either side by chance.
    assert np.mean(means) == pytest.approx(np.sum(weight * lon**2) / weight.sum(), rel=3e-3)


def test_sets_of_points_are_drawn_by_weight():
    """A point of three quarters of the weight is three quarters of the points."""
    points = PointSet(np.array([1.0, 2.0, 3.0]), np.zeros(3), np.array([1.0, 6.0, 1.0]))
    drawn = scatter_over(points, SPHERE)(800, np.random.default_rng(0))
    assert np.sum(drawn.lon == 2.0) == pytest.approx(600, abs=2)  # a stratum on either side is cut


def test_draws_are_better_than_chance():
    """The mean of a smooth function over 1024 points errs by less than a twentieth of what independent points do."""
    means = [np.mean(np.sin(np.radians(p.lat)) * np.cos(np.radians(p.lon)) ** 2) for p in draws("globe", SPHERE, 1024)]
    independent = np.sqrt((1 / 3) * (3 / 8) / 1024)
    assert np.std(means) < independent / 20
