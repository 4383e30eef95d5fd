"""The field of a map as one value: its figures against closed forms, over polygons too, and fields that are given."""

import math

import numpy as np
import pytest
import shapely
from scipy import integrate
from tables import each

import projdist
from projdist import GLOBE, PointSet, Projection, field_of, sample, summarize
from projdist.field import field_resolving
from projdist.regions import get_region

# Quantiles come from a lattice of some 10,000 points; the errors given are of that order.
LATTICE = 2e-3


@pytest.fixture(scope="module")
def plate_carree():
    """Of the sphere: k = s = 1 / cos(lat), h = 1."""
    return sample("plate-carree", GLOBE, measures=["s"], tolerance=1e-9)


@each(
    ("criterion", "truth"),
    [
        ("mean", math.pi / 2),
        ("median", 1 / math.cos(math.asin(0.5))),  # half of the globe is within 30 degrees of the equator
        ("p95", 1 / math.cos(math.asin(0.95))),
        ("p99.5", 1 / math.cos(math.asin(0.995))),
        ("min", 1.0),
    ],
)
def test_statistics_of_the_areal_scale(plate_carree, criterion, truth):
    """A share q of the globe lies within asin(q) of the equator."""
    found = plate_carree.statistic("s", criterion)
    assert abs(found.value - truth) <= found.error + 1e-12
    assert found.error < LATTICE * truth


def test_what_has_no_bound(plate_carree):
    """1 / cos(lat) grows without bound towards the poles, and the mean of its square by area diverges."""
    assert plate_carree.maximum("s").value == math.inf
    assert math.isnan(plate_carree.rms("s").value)
    assert abs(plate_carree.maximum("s").lat) > 89


def test_shares_of_the_globe(plate_carree):
    """By a criterion of one's own, areas are less than doubled within 60 degrees; by Jacobians, half is within 30."""
    found = plate_carree.statistic("s", lambda values, weights: weights[values < 2.0].sum() / weights.sum())
    assert found.value == pytest.approx(math.sqrt(0.75), abs=max(found.error, LATTICE))
    J, weights = plate_carree.dense_jacobian
    within = projdist.MEASURES["areal_scale"](J) < 1 / math.cos(math.radians(30))
    assert weights[within].sum() / weights.sum() == pytest.approx(0.5, abs=LATTICE)


def test_deviation():
    """Of 1 / cos(lat) over a belt, by the closed forms of its moments."""
    field = sample("plate-carree", "box:-180,0,180,60", measures=["s"], tolerance=1e-10)
    top = math.radians(60)
    mean = top / math.sin(top)
    square = math.log((1 + math.sin(top)) / math.cos(top)) / math.sin(top)
    for given in ("s", field.values("s")):
        found = field.statistic(given, "std")
        assert found.value == pytest.approx(math.sqrt(square - mean**2), abs=1e-9)
        assert found.error < 1e-6


@pytest.mark.slow
def test_countries_of_the_north_under_mercator():
    """The figures of Norway and Canada that sums over nodes get wrong, where weights are negative.

    The scale is sec^2(lat), on the sphere that `mercator` has: the truth comes from the outlines.
    """
    field = sample("mercator", "country:NO", measures=["s"], tolerance=1e-7)
    assert (field.weight < 0).any()
    assert field.mean("s").value == pytest.approx(_mean_of_secant_squared("country:NO"), rel=1e-4)
    assert field.mean("s").value == pytest.approx(8.966, abs=2e-3)
    canada = sample("mercator", "country:CA", measures=["s"], tolerance=1e-6).maximum("s")
    north = projdist.get_region("country:CA").bounds[3]
    assert canada.value == pytest.approx(1 / math.cos(math.radians(north)) ** 2, rel=1e-6)
    assert canada.value == pytest.approx(69.6, abs=0.05)


def _mean_of_secant_squared(name):
    """By Green's theorem along straight edges: area is the integral of cos, that of sec^2 by area is ln(sec + tan)."""
    lon0, lat0, lon1, lat1 = np.radians(projdist.get_region(name).edges).T[..., None]
    node, weight = np.polynomial.legendre.leggauss(4)
    lat = lat0 + (lat1 - lat0) * (0.5 + 0.5 * node)
    width = 0.5 * weight * (lon1 - lon0)
    return np.sum(width * np.arctanh(np.sin(lat))) / np.sum(width * np.sin(lat))


def test_flexion_from_public_functions_alone():
    """On the equator Mercator's flexion is 0, at latitude 45 it is 2 / pi: Goldberg and Gott's unit (2007, sec. 3)."""
    J, H = projdist.jacobian("mercator", 0.0, 45.0), projdist.hessian("mercator", 0.0, 45.0)
    assert projdist.get_measure("flexion")(J, H) == pytest.approx(2 / math.pi, abs=1e-8)
    assert field_of(J[None], hessian=H[None]).mean("flexion").value == pytest.approx(2 / math.pi, abs=1e-8)


def test_second_derivatives_are_sampled_by_name():
    """A field without them says how to have them."""
    with pytest.raises(ValueError, match=r"^Invalid measure 'flexion' of this field\. It needs second derivatives"):
        sample("mercator", "box:0,0,10,10", tolerance=1e-3).mean("flexion")
    field = sample("mercator", "box:0,0,10,10", measures=["flexion"], tolerance=1e-3)
    assert field.hessian.shape == (field.lon.size, 2, 2, 2)


def test_it_is_what_summarize_says():
    """One implementation: the same figures to the last digit."""
    given = {"region": "continent:Africa@110m", "measures": ["omega"], "tolerance": 1e-3}
    field, summary = sample("winkel-tripel", **given), summarize("winkel-tripel", **given)
    omega, scaled, affine = summary.measures["omega"], summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine
    assert field.airy_kavrayskiy[:4] == (summary.airy_kavrayskiy, scaled, affine, summary.error_estimate)
    assert (field.mean("omega").value, field.rms("omega").value) == (omega.mean, omega.rms)
    assert field.statistic("omega", "max") == (omega.max, omega.max_error)
    assert field.statistic("omega", "median").value == omega.median
    assert field.error == summary.error_estimate


@pytest.fixture(scope="module")
def mercator():
    """Of the sphere, to 60 degrees: scales are 1 / cos(lat), in all directions alike."""
    return sample("mercator", "box:-10,0,10,60", measures=["areal_error_ppm"], tolerance=1e-9)


def test_several_figures_at_once(mercator):
    """Their closed forms; each is what it is alone."""
    names = ["max_areal_error_ppm", "mean_areal_error_ppm", "max_scale_error_ppm", "max_log_scale", "airy_kavrayskiy"]
    found = mercator.figures(names)
    assert list(found) == names
    assert found["max_areal_error_ppm"].value == pytest.approx(3e6, rel=1e-9)
    assert found["max_scale_error_ppm"].value == pytest.approx(1e6, rel=1e-9)
    assert found["max_log_scale"].value == pytest.approx(math.log(2), rel=1e-9)
    mean = math.log(2 + math.sqrt(3)) / math.sin(math.radians(60))
    assert found["mean_areal_error_ppm"].value == pytest.approx(1e6 * (mean - 1), rel=1e-6)
    assert {name: mercator.figure(name) for name in names} == found


def test_a_slope_counts_for_the_error_only():
    """Of a noisy map: values that do not change with the scales are known better than those that do."""
    field = sample("ESRI:54029", "box:-5,-5,5,5", measures=["s"], tolerance=1e-3)
    values = field.values("s")
    steady, steep = (field.mean(values, slope=slope * values) for slope in (0.0, 2.0))
    assert steady.value == steep.value == field.mean("s").value
    assert steady.error < steep.error == field.mean("s").error


def test_given_jacobians_have_the_same_figures():
    """What is put in at the points of a set is what is measured there."""
    points = PointSet(np.array([10.0, 20.0, 30.0]), np.array([45.0, 60.0, 5.0]), np.array([1.0, 3.0, 2.0]))
    of_points = sample("robinson", points, measures=["omega"])
    J = projdist.jacobian("robinson", points.lon, points.lat)
    given = field_of(J, points.weight, lon=points.lon, lat=points.lat)
    assert given.airy_kavrayskiy[:3] == pytest.approx(of_points.airy_kavrayskiy[:3], rel=1e-12)
    np.testing.assert_allclose(given.airy_kavrayskiy.mdt, of_points.airy_kavrayskiy.mdt, rtol=1e-12)
    assert given.maximum("omega")[:3] == pytest.approx(of_points.maximum("omega")[:3])
    assert given.statistic("omega", "median").value == of_points.statistic("omega", "median").value


def test_a_function_that_gives_the_jacobian():
    """That of the plate carree by its closed form over a box, with an error that says how good the nodes are."""

    def closed_form(lon, lat):
        J = np.zeros((lon.size, 2, 2))
        J[:, 0, 0], J[:, 1, 1] = 1.0 / np.cos(np.radians(lat)), 1.0
        return J

    field = field_of(closed_form, region="box:-20,0,20,60")
    truth = math.radians(60) / math.sin(math.radians(60))
    # The nodes' weights are areas on WGS 84: a mean differs by its flattening, 1/298, times a number below one.
    assert field.mean("s").value == pytest.approx(truth, rel=1 / 298)
    assert field.mean("s").error < 1e-9
    largest = field.maximum("s")  # on the northern side, where no node is
    assert 0.0 < 2.0 - largest.value < largest.error < 0.01


@each(
    ("call", "message"),
    [
        (lambda: field_of(np.eye(2)), r"^Invalid shape \(2, 2\) of Jacobians"),
        (lambda: field_of([np.eye(2)], weight=[1, 2]), r"^Invalid shape \(2,\) of weight"),
        (lambda: field_of([np.eye(2)], weight=[-1]), r"^Invalid weights\. They must be finite and not negative"),
        (lambda: field_of([np.full((2, 2), np.nan)]), r"^Invalid Jacobians\. None of those with a weight is finite"),
        (lambda: field_of(lambda lon, lat: None), r"^Invalid field\. A function of longitude and latitude goes with"),
        (
            lambda: field_of([np.eye(2)]).mean([1.0, 2.0]),
            r"^Invalid values of shape \(2,\)\. There must be one for each",
        ),
        (lambda: field_of([np.eye(2)]).statistic("s", "middle"), r"^Invalid criterion 'middle'"),
        (lambda: field_of([np.eye(2)]).maximum("size"), r"^Invalid measure 'size'"),
    ],
)
def test_refused(call, message):
    """In one line, with what is allowed."""
    with pytest.raises(ValueError, match=message):
        call()


def test_its_line():
    """A field prints as one line; fields are compared by identity."""
    field = sample(Projection.from_user_input("robinson"), "box:0,0,10,10", tolerance=1e-3)
    assert repr(field) == f"Field({field.projection.name} over box:0,0,10,10: {field.lon.size} nodes)"
    assert repr(field_of([np.eye(2)])) == "Field(Jacobians: 1 nodes)"
    assert field == field
    assert field.coverage == 1.0
    assert field.limit == ""


def test_a_shape_is_a_region():
    """Of 1 / cos(lat) over a triangle the mean by area is its width over that of sin."""
    found = sample("plate-carree", shapely.Polygon([(0, 10), (20, 10), (20, 40)]), measures=["s"])
    lon = np.radians(np.linspace(0, 20, 200_001))
    top = np.radians(10) + 1.5 * lon
    area = integrate.trapezoid(np.sin(top) - np.sin(np.radians(10)), lon)
    truth = integrate.trapezoid(top - np.radians(10), lon) / area
    assert found.mean("s").value == pytest.approx(truth, rel=1e-8)


# ---- means beside singular points ------------------------------------------------------------

PROJ_ENDS = 1e-10  # radians from the pole at infinity, where PROJ's conic ends


PARALLELS = [(5.0, 8.0), (15.0, 30.0), (35.0, 40.0)]
BETWEEN = [pytest.param(pair, marks=pytest.mark.slow) for pair in ((10.0, 20.0), (25.0, 32.0), (30.0, 50.0))]


@each("parallels", [*PARALLELS, *BETWEEN])
def test_errors_of_means_beside_a_pole_at_infinity(parallels: tuple[float, float]) -> None:
    """The scale of Lambert's conic grows as r^-1.1 to r^-1.65 at the other pole; its mean is known by quadrature."""
    one, two = np.radians(90.0 - np.array(parallels))  # polar distances
    n = np.log(np.sin(one) / np.sin(two)) / np.log(np.tan(one / 2.0) / np.tan(two / 2.0))

    def scale_by_area(log_u: float) -> float:
        """Of the distance u from the pole at infinity, and by its logarithm."""
        u = np.exp(log_u)
        return float(0.5 * u * np.sin(one) * (np.tan(one / 2.0) * np.tan(u / 2.0)) ** -n)

    whole = integrate.quad(scale_by_area, np.log(PROJ_ENDS), np.log(np.pi), epsabs=1e-13, epsrel=1e-12, limit=200)[0]
    lat_1, lat_2 = parallels
    found = sample(f"+proj=lcc +lat_1={lat_1} +lat_2={lat_2} +R=6371007", "globe").mean("k")
    assert found.value == pytest.approx(whole, abs=found.error)
    assert found.error < 0.02 * found.value


# ---- values at many points ---------------------------------------------------------------------


# Panels of a polygon's edge have just their part. In whole ones the lattice's sum of a smooth density is as far off as
# one in its number of points, a few thousand to a panel.
EXACT, OF_PANELS = 1e-12, 2e-4


@each(
    ("region", "error"),
    [
        ("country:CH", EXACT),
        ("box:0,40,20,60", OF_PANELS),
        pytest.param("cap:10,80,2000", OF_PANELS, marks=pytest.mark.slow),
    ],
)
def test_weights_are_the_area(region, error):
    """The points stand for the whole region, and for nothing beside it."""
    place = get_region(region)
    field = field_resolving(Projection.from_user_input("plate-carree"), place, tolerance=1e-4)
    values, weights = field.many(field.lat)
    assert (weights >= 0).all()
    assert weights.sum() == pytest.approx(field.weight.sum(), rel=error)
    south, north = place.bounds[1::2]
    assert ((values >= south - 1e-9) & (values <= north + 1e-9))[weights > 0].all()
