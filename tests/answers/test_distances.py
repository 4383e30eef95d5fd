"""Finite distortion: closed forms, quadratures of their own, published figures, and honest errors."""

import json

import numpy as np
import pytest
import scipy.optimize
from pyproj import Geod
from refusals import refuses
from scipy import integrate
from tables import each

from projdist import DISTANCE_MEASURES, PointSet, Projection, distance_distortion, get_region, great_circle_bending
from projdist.answers import distances
from projdist.answers.distances import ScatteredPoints, best_scale_of_distances, scatter_over
from projdist.answers.published_tables import printed
from projdist.earth.ellipsoid import SPHERE, WGS84, Ellipsoid, chord_angle, unit_vectors
from projdist.projections import compose
from projdist.projections.coordinates import geodesic_direct, geodesic_inverse

_SIGMAS = 4.0  # standard errors: one in 16,000 is further off
_PRINTED = 5e-4  # half a unit of what is printed with three decimals
BOTH = distance_distortion, great_circle_bending
REGIONS_OF_MAPS = {"moll": "globe", "igh": "box:-100,-50,120,80", "robin": "country:CL"}


def test_the_best_scale_of_distances():
    """It makes the index of Peters least, as scipy finds; ratios as askew as these have their median elsewhere."""
    rng = np.random.default_rng(2)
    ratio, weight = np.exp(rng.exponential(1.5, 61 * 400)), rng.uniform(0.5, 1.5, 61 * 400)
    found = best_scale_of_distances(ratio, weight)
    taken, shares = np.log(ratio[::61]), weight[::61] / weight[::61].sum()

    def index(s):
        return shares @ np.abs(np.tanh(0.5 * (taken + s)))

    least = scipy.optimize.minimize_scalar(index, bounds=(-4.0, 4.0), method="bounded")
    # The slope jumps at each of four hundred ratios, which stand this far apart where the index is least.
    assert found == pytest.approx(least.x, abs=0.02)
    assert abs(found + np.median(taken)) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("row", printed("gott-mugnolo-colley"), ids=lambda row: row.projection)
def test_published_sigma(row):
    """The figures of the measure's authors, within their rounding and error bars, of 0.0005, and ours."""
    found = distance_distortion(row.definition)
    assert found.error < 1e-4
    assert abs(found.value - row.value) < _PRINTED + 5e-4 + _SIGMAS * found.error


@pytest.mark.slow
@each("x, y", [(1.0, 1.0), (1.3, 1.0), (5.0, 1.0), (0.5, 0.5), (2.0, 2.0)])
def test_a_stretch(x, y):
    """Directions of pairs in a disc are uniform: averages over them, of a stretch, by adaptive quadrature."""
    # A small neighbourhood of 10 east, 20 north, true to 1e-6.
    local = Projection.from_user_input("+proj=aeqd +lon_0=10 +lat_0=20 +R=6371008.7714")
    stretched = compose(local, np.diag([x, y]), "stretched")

    def mean(function):
        return integrate.quad(lambda t: function(np.hypot(x * np.cos(t), y * np.sin(t))), 0, np.pi / 2)[0] * 2 / np.pi

    average, peters = mean(np.log), mean(lambda r: abs(r - 1) / (r + 1))
    gott = np.sqrt(max(0.0, mean(lambda r: (np.log(r) - average) ** 2)))
    truths = {"gott": gott, "peters": peters, "canters": (1 + peters) / (1 - peters)}
    assert set(truths) == set(DISTANCE_MEASURES)
    for name, truth in truths.items():
        found = distance_distortion(stretched, "cap:10,20,20", measure=name)
        assert abs(found.value - truth) < _SIGMAS * found.error + 2e-6  # (20 km / R)^2 / 5


def test_sets_of_points_in_closed_form():
    """Three points on the equator of a plate carree: 20 degrees are 340 on the map across its cut, others are true."""
    points = PointSet(np.array([-170.0, 0.0, 170.0]), np.zeros(3), np.array([1.0, 2.0, 3.0]))
    found = distance_distortion("plate-carree", points)
    share = 3.0 / (1 * 2 + 2 * 3 + 1 * 3)
    assert found.value == pytest.approx(np.log(17.0) * np.sqrt(share * (1 - share)), rel=1e-12)
    assert (found.error, found.pairs, found.coverage) == (0.0, 6, 1.0)


@pytest.mark.slow
def test_large_sets_of_points_are_drawn():
    """Many points of the globe by their areas give the globe's figure."""
    rng = np.random.default_rng(2)
    lat = np.degrees(np.arcsin(rng.uniform(-1, 1, 20000)))
    points = PointSet(rng.uniform(-180, 180, 20000), lat, np.ones(20000))
    # The points are a sample themselves: of 20,000, to half a per cent.
    assert distance_distortion("moll", points).value == pytest.approx(0.38993, rel=0.01)


PACIFIC = "+proj=robin +lon_0=180 +R=1"
RECTANGLE = {"type": "Polygon", "coordinates": [[[170, -30], [200, -30], [200, 30], [170, 30], [170, -30]]]}
SAME = [
    (["+proj=aeqd +lat_0=90 +R=1"], ["+proj=aeqd +lat_0=35 +lon_0=60 +R=1"]),
    (["+proj=laea +lat_0=90 +R=1"], ["+proj=laea +lat_0=35 +lon_0=60 +R=1"]),
    ([PACIFIC, "cap:10,50,3000"], [PACIFIC, "cap:10,50,3000 & box:-180,-90,180,90"]),
    ([PACIFIC, "box:170,-30,-160,30"], [PACIFIC, RECTANGLE]),
]


@pytest.mark.slow
@pytest.mark.parametrize(("one", "other"), SAME)
@pytest.mark.parametrize("figure", BOTH)
def test_aspects_of_maps_and_forms_of_regions(figure, one, other):
    """Neither matters: the aspect of an azimuthal map on the globe, and whether a cap or box is a polygon."""
    a, b = figure(*one), figure(*other)
    assert abs(a.value - b.value) < _SIGMAS * np.hypot(a.error, b.error)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "region"), REGIONS_OF_MAPS.items())
def test_errors_are_honest(name, region):
    """The spread of twenty seeds is what the errors claim: a spread of twenty values is good to a sixth."""
    for figure in BOTH:
        found = [figure(name, region, seed=seed, tolerance=1.0) for seed in range(20)]
        spread = np.std([answer.value for answer in found], ddof=1)
        claimed = np.sqrt(np.mean([answer.error**2 for answer in found]))
        assert 0.6 < spread / claimed < 1.5


@pytest.mark.slow
def test_what_is_not_on_the_map_does_not_count():
    """An orthographic globe is its hemisphere; half of the area is on the map, and a quarter of the pairs."""
    for figure, coverage in zip(BOTH, (0.5, 0.25), strict=True):
        found, half = figure("+proj=ortho +R=1"), figure("+proj=ortho +R=6371008.7714", "cap:0,0,10007")
        assert found.coverage == pytest.approx(coverage, abs=5e-3)
        assert abs(found.value - half.value) < _SIGMAS * np.hypot(found.error, half.error) + 2e-5  # the rim
    nowhere = distance_distortion("+proj=ortho +R=1", "cap:180,0,1000")
    assert (nowhere.pairs, nowhere.coverage, nowhere.to_dict()["value"]) == (0, 0.0, None)
    assert np.isnan(nowhere.value)


@pytest.mark.slow
@each("distance", [30.0, 90.0])
def test_bending_of_short_arcs(distance):
    """In a small disc a stereographic map has the flexion tan(c / 2) times the sine of the angle to the radius."""
    radius = 0.01
    found = great_circle_bending("+proj=stere +lat_0=0 +lon_0=0 +R=1", f"cap:{distance},0,{radius * SPHERE.a / 1000}")
    # The mean of L / 12 times that: the mean distance in a disc is 128 / (45 pi) of its radius.
    truth = 2 / np.pi * np.tan(np.radians(distance / 2)) * 128 * radius / (45 * np.pi) / 12
    assert abs(found.value - truth) < _SIGMAS * found.error + 1e-3 * truth


def test_straight_and_torn_great_circles():
    """From 170 to 190 east on the equator a great circle runs beside the straight line of 340 degrees, not along it."""
    # The gnomonic map bends none of them, on any aspect.
    assert great_circle_bending("+proj=gnom +lat_0=40 +lon_0=20 +R=1", "cap:25,45,5000", tolerance=1.0).value < 1e-14
    points = PointSet(np.array([170.0, -170.0]), np.zeros(2), np.ones(2))
    # Up to 10 degrees of longitude away from its ends, 5 in the mean, of 340.
    assert great_circle_bending("plate-carree", points).value == pytest.approx(5.0 / 340.0, rel=1e-3)


def test_spheres_and_ellipsoids_measure_alike():
    """The closed form and geographiclib's geodesics agree on a sphere."""
    rng = np.random.default_rng(3)
    (lon, to_lon), (lat, to_lat) = rng.uniform(-180, 180, (2, 1000)), rng.uniform(-90, 90, (2, 1000))
    to_lon[0], to_lat[0] = lon[0] + 1e-9, lat[0]
    lengths, azimuth, _ = geodesic_inverse(SPHERE, lon, lat, to_lon, to_lat)
    angles = chord_angle(unit_vectors(lon, lat), unit_vectors(to_lon, to_lat))
    np.testing.assert_allclose(SPHERE.a * angles, lengths, rtol=1e-9, atol=1e-9)
    x, y, there = geodesic_direct(SPHERE, lon, lat, azimuth, 0.25 * lengths)
    onward = geodesic_inverse(SPHERE, x[1:], y[1:], to_lon[1:], to_lat[1:])[1]
    np.testing.assert_allclose(there[1:], onward, atol=1e-6)  # both within -180 and 180
    np.testing.assert_allclose(geodesic_inverse(SPHERE, lon, lat, x, y)[0], 0.25 * lengths, atol=1e-6)


@pytest.mark.slow
def test_answers_are_answers():
    pytest.importorskip("pandas")
    given = "cap:0,0,5000", get_region("cap:0,0,5000")
    found, again = (distance_distortion("moll", one, tolerance=1.0) for one in given)
    assert json.loads(found.to_json()) == again.to_dict()
    row = found.to_frame().iloc[0]
    assert (row["measure"], row["value"], row["region"]) == ("gott", found.value, "cap:0,0,5000")


@each("figure, words, message", [
    (distance_distortion, {"measure": "got"}, r"^Invalid measure 'got'\. Did you mean gott\? It must be one of "),
    (distance_distortion, {"map_distance": 3}, r"^Invalid map_distance '3'. It must be a function.$"),
    *((figure, {"tolerance": t}, f"^Invalid tolerance '{t}'. It must be ") for figure in BOTH for t in (0, np.nan)),
])  # fmt: skip
def test_refused(figure, words, message):
    refuses(message, figure, "moll", **words)


def test_the_error_is_the_standard_error_of_draws(monkeypatch):
    """Of sixteen draws: their standard deviation over the root of their number, about their mean."""
    # A measure of one's own: a function of ratios and weights, here the mean.
    found = distance_distortion("+proj=laea +R=1", "cap:0,0,500", measure=lambda ratio, weight: float(weight @ ratio))
    assert found.value == pytest.approx(1.0, abs=1e-3)
    assert found.measure == "<lambda>"
    monkeypatch.setattr(distances, "_SIZES", {True: (32,), False: (32,)})
    drawn = np.random.default_rng(4).uniform(1.0, 2.0, 16)
    left = iter(drawn.tolist())
    found = distance_distortion("+proj=laea +R=1", "cap:0,0,500", measure=lambda *_: next(left))
    assert found.value == pytest.approx(drawn.mean(), rel=1e-12)
    assert found.error == pytest.approx(np.sqrt(np.sum((drawn - drawn.mean()) ** 2) / 15 / 16), rel=1e-12)


def test_geodesics_count_by_the_weights_of_both_ends():
    """On plate carree the equator is straight; geodesics to points of no weight, far north, are not counted."""
    lon = np.linspace(-40.0, 40.0, 20)
    equator = ScatteredPoints(lon, np.zeros(20), np.ones(20))
    both = ScatteredPoints(np.append(lon, lon + 1.0), np.repeat([0.0, 60.0], 20), np.repeat([1.0, 0.0], 20))
    plate, rng = Projection.from_user_input("plate-carree"), np.random.default_rng(1)
    for ends in ((equator, both), (both, equator)):
        found = distances._over_geodesics(plate, *ends, rng)
        assert (found.values, found.coverage) == pytest.approx((0.0, 1.0), abs=1e-12)
    assert distances._over_geodesics(plate, equator, both._replace(weight=np.ones(40)), rng).values > 0.01


def test_ellipsoids_have_their_own_distances():
    """Of a map that keeps distances from a point on the ellipsoid, those from there are true; a sphere's are not."""
    place = PointSet(np.array([10.0, 10.0]), np.array([50.0, 80.0]), np.array([1.0, 1.0]))
    found = distance_distortion("+proj=aeqd +lon_0=10 +lat_0=50 +ellps=WGS84", place, measure="peters")
    assert found.value == pytest.approx(0.0, abs=1e-12)
    larger = compose(Projection.from_user_input("+proj=aeqd +lon_0=10 +lat_0=50 +ellps=WGS84"), 1.5 * np.eye(2), "x")
    assert distance_distortion(larger, place, measure="peters").value == pytest.approx(0.5 / 2.5)
    assert distance_distortion(larger, place, measure="canters").value == pytest.approx(1.5)
    assert np.isnan(distance_distortion("+proj=ortho +lat_0=-90 +R=1", place).value)


TRIANGLE = {"type": "Polygon", "coordinates": [[[-20, 10], [60, 20], [10, 75], [-20, 10]]]}
REGIONS = ["globe", "box:170,-60,-170,80", "cap:10,50,3000", "cap:0,-90,5000", TRIANGLE, "country:FJ"]


def draws(region, ellipsoid, count=400):
    """Thirty-two draws."""
    rng, draw = np.random.default_rng(5), scatter_over(get_region(region), ellipsoid)
    return [draw(count, rng) for _ in range(32)]


@each("region", REGIONS)
def test_points_are_in_their_region(region):
    place = get_region(region)
    for points in draws(region, WGS84)[:4]:
        assert 0.8 * 400 <= points.lon.size <= 1.25 * 400
        assert np.mean(place.contains(points.lon, points.lat)) > 0.99  # the rim of a cap, to rounding


@each("region", ["globe", "box:170,-60,-170,80", "box:0,60,90,90"])
@each("ellipsoid", [SPHERE, WGS84])
def test_means_are_by_area(region, ellipsoid):
    """The mean of the latitude's square is that by Gauss's rule, so finely that sphere and ellipsoid are told apart."""
    _, south, _, north = get_region(region).bounds
    x, w = np.polynomial.legendre.leggauss(60)
    lat = 0.5 * (south + north) + 0.5 * (north - south) * x
    truth = np.average(lat**2, weights=w * np.prod(ellipsoid.radii(lat), axis=0) * np.cos(np.radians(lat)))
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
    for points in draws(region, SPHERE)[:4]:
        cosine = unit_vectors(region.lon, region.lat) @ unit_vectors(points.lon, points.lat)
        assert np.mean(cosine) == pytest.approx(truth, abs=2e-4)  # stratified: n^-1.5 of a third


def test_caps_of_a_flat_body_are_strewn_by_area():
    """On Saturn, where a cap's rim is no circle of its latitudes: the mean over places within the distance."""
    saturn = Ellipsoid(60268000.0, 0.09796)
    shares = (np.arange(150) + 0.5) / 150
    lon, lat = np.meshgrid(-25.0 + 50.0 * shares, -25.0 + 50.0 * shares)
    distance = Geod(a=saturn.a, f=saturn.f).inv(np.zeros(lon.shape), np.zeros(lon.shape), lon, lat)[2]
    weight = (distance <= 2e7) * np.prod(saturn.radii(lat), axis=0) * np.cos(np.radians(lat))
    means = [np.sum(p.weight * p.lon**2) / p.weight.sum() for p in draws(get_region("cap:0,0,20000", saturn), saturn)]
    # A cell of the lattice is a sixtieth of the radius, and the rim's cells fall on either side by chance.
    assert np.mean(means) == pytest.approx(np.sum(weight * lon**2) / weight.sum(), rel=3e-3)


def test_sets_of_points_are_drawn_by_weight():
    points = PointSet(np.array([1.0, 2.0, 3.0]), np.zeros(3), np.array([1.0, 6.0, 1.0]))
    drawn = scatter_over(points, SPHERE)(800, np.random.default_rng(0))
    assert np.sum(drawn.lon == 2.0) == pytest.approx(600, abs=2)  # a stratum on either side is cut
    # The mean of a smooth function over 1024 points errs by less than a twentieth of what independent points do.
    means = [np.mean(np.sin(np.radians(p.lat)) * np.cos(np.radians(p.lon)) ** 2) for p in draws("globe", SPHERE, 1024)]
    assert np.std(means) < np.sqrt((1 / 3) * (3 / 8) / 1024) / 20
