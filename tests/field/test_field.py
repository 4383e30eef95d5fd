"""The field of a map as one value, its figures, and fixed nodes of regions, against closed forms."""

import math

import numpy as np
import pytest
import shapely
from jacobians import matrices
from refusals import refuses
from scipy import integrate
from scipy.spatial.transform import Rotation
from tables import each

import projdist
from projdist import FIGURES, SPHERE, WGS84, Cap, field_of, get_figure, get_measure, get_region, jacobian, sample
from projdist.field.sampling import nodes_at, nodes_of

# A share q of the globe lies within asin(q) of the equator.
STATISTICS = [("mean", math.pi / 2), ("min", 1.0)]
STATISTICS += [(name, 1 / math.cos(math.asin(q))) for name, q in (("median", 0.5), ("p95", 0.95), ("p99.5", 0.995))]
PROJ_ENDS = 1e-10  # radians from the pole at infinity, where PROJ's conic ends
PARALLELS = [(5.0, 8.0), (15.0, 30.0), (10.0, 20.0), (25.0, 32.0), (30.0, 50.0), (35.0, 40.0)]
# Panels of a polygon's edge have just their part. In whole ones the lattice's sum of a smooth density is as far off as
# one in its number of points, a few thousand to a panel.
EXACT, OF_PANELS = 1e-12, 2e-4
AREAS = [("country:CH", EXACT), ("box:0,40,20,60", OF_PANELS)]
AREAS += [pytest.param("cap:10,80,2000", OF_PANELS, marks=pytest.mark.slow)]
REGIONS = ["globe", "box:-10,35,30,70", "box:170,-60,-170,-50", "box:0,80,90,90", "cap:10,50,3000", "cap:0,90,2000"]
MAPS = ["lcc +lat_1=30 +lat_2=60 +ellps=WGS84", "laea +lat_0=50 +lon_0=10 +ellps=WGS84", "wintri +lon_0=5 +R=6371000"]
# Quantiles come from a lattice of some 10,000 points; the errors given are of that order.
LATTICE = 2e-3


@pytest.fixture(scope="module")
def plate_carree():
    """Of the sphere: k = s = 1 / cos(lat), h = 1."""
    return sample("plate-carree", "globe", measures=["s"], tolerance=1e-9)


@each(("criterion", "truth"), STATISTICS)
def test_statistics_of_the_areal_scale(plate_carree, criterion, truth):
    """A share q of the globe lies within asin(q) of the equator."""
    found = plate_carree.statistic("s", criterion)
    assert abs(found.value - truth) <= found.error + 1e-12 < LATTICE * truth


def test_shares_of_the_globe(plate_carree):
    """By a criterion of one's own, areas are less than doubled within 60 degrees; by Jacobians, half is within 30."""
    assert math.isnan(plate_carree.rms("s").value)  # the mean of 1 / cos^2 diverges
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
def test_it_is_what_summarize_says():
    """One implementation: the same figures to the last digit."""
    given = {"region": "country:CH", "measures": ["omega"], "tolerance": 1e-3}
    field, summary = sample("winkel-tripel", **given), projdist.summarize("winkel-tripel", **given)
    omega, scaled, affine = summary.measures["omega"], summary.airy_kavrayskiy_scaled, summary.airy_kavrayskiy_affine
    assert field.airy_kavrayskiy[:4] == (summary.airy_kavrayskiy, scaled, affine, summary.error_estimate)
    assert field.error == summary.error_estimate
    for name in ("mean", "rms", "median", "p95", "max", "min"):
        assert field.statistic("omega", name).value == getattr(omega, name)
    assert field.statistic("omega", "max").error == omega.max_error


def test_a_slope_counts_for_the_error_only():
    """Of a noisy map: values that do not change with the scales are known better than those that do."""
    field = sample("ESRI:54029", "box:-5,-5,5,5", measures=["s"], tolerance=1e-3)
    values = field.values("s")
    steady, steep = (field.mean(values, slope=slope * values) for slope in (0.0, 2.0))
    assert steady.value == steep.value == field.mean("s").value
    assert steady.error < steep.error == field.mean("s").error


def test_given_jacobians_have_the_same_figures():
    """What is put in at the points of a set is what is measured there."""
    points = projdist.PointSet(np.array([10.0, 20.0, 30.0]), np.array([45.0, 60.0, 5.0]), np.array([1.0, 3.0, 2.0]))
    of_points = sample("robinson", points, measures=["omega"])
    J = jacobian("robinson", points.lon, points.lat)
    given = field_of(J, points.weight, lon=points.lon, lat=points.lat)
    assert given.airy_kavrayskiy[:3] == pytest.approx(of_points.airy_kavrayskiy[:3], rel=1e-12)
    np.testing.assert_allclose(given.airy_kavrayskiy.mdt, of_points.airy_kavrayskiy.mdt, rtol=1e-12)
    assert given.maximum("omega")[:3] == pytest.approx(of_points.maximum("omega")[:3])
    assert given.statistic("omega", "median").value == of_points.statistic("omega", "median").value


def test_a_function_that_gives_the_jacobian():
    """That of the plate carree by its closed form over a box, with an error that says how good the nodes are."""

    def closed_form(lon, lat):
        return matrices(1.0 / np.cos(np.radians(lat)), 0.0, 0.0, 1.0)

    field = field_of(closed_form, region="box:-20,0,20,60")
    truth = math.radians(60) / math.sin(math.radians(60))
    # The nodes' weights are areas on WGS 84: a mean differs by its flattening, 1/298, times a number below one.
    assert field.mean("s").value == pytest.approx(truth, rel=1 / 298)
    assert field.mean("s").error < 1e-9
    largest = field.maximum("s")  # on the northern side, where no node is
    assert 0.0 < 2.0 - largest.value < largest.error < 0.01


ONE = [np.eye(2)]


def own_figure(statistic, version=""):
    return projdist.Figure(name="mine", measure="omega", statistic=statistic, **{"version": version} if version else {})


REFUSED = [
    (field_of, (np.eye(2),), r"^Invalid shape \(2, 2\) of Jacobians"),
    (field_of, (ONE, [1, 2]), r"^Invalid shape \(2,\) of weight"),
    (field_of, (ONE, [-1]), r"^Invalid weights\. They must be finite and not negative"),
    (field_of, ([np.full((2, 2), np.nan)],), r"^Invalid Jacobians\. None of those with a weight is finite"),
    (field_of, (lambda lon, lat: None,), r"^Invalid field\. A function of longitude and latitude goes with"),
    (field_of(ONE).mean, ([1.0, 2.0],), r"^Invalid values of shape \(2,\)\. There must be one for each"),
    (field_of(ONE).statistic, ("s", "middle"), r"^Invalid criterion 'middle'"),
    (field_of(ONE).maximum, ("size",), r"^Invalid measure 'size'"),
    (field_of(ONE).mean, ("flexion",), r"^Invalid measure 'flexion' of this field\. It needs second derivatives"),
    (get_figure, (get_measure("flexion"),), r"^Invalid figure 'flexion'\. Its measure must be one of J, not of second"),
    (get_figure, ("max_omga",), r"^Invalid criterion 'max_omga'\. Did you mean max_omega.* It must be one of "),
    (own_figure, ("median",), r"^Invalid statistic 'median'\. .*It must be one of rms, mean, max\.$"),
    (own_figure, ("rms", "scaled"), r"^Invalid figure 'mine'\. It must be the RMS of fisher"),
    (get_figure, (5,), r"^Invalid criterion '5'\. It must be one of airy_kavrayskiy, .*, or a function"),
]


@each(("function", "given", "message"), REFUSED)
def test_refused(function, given, message):
    refuses(message, function, *given)


def test_its_line():
    """A field prints as one line; fields are compared by identity."""
    field = sample("robinson", "box:0,0,10,10", tolerance=1e-3)
    assert repr(field) == f"Field({field.projection.name} over box:0,0,10,10: {field.lon.size} nodes)"
    assert repr(field_of(ONE)) == "Field(Jacobians: 1 nodes)"
    assert field == field
    assert (field.coverage, field.limit) == (1.0, "")


def test_a_shape_is_a_region():
    """Of 1 / cos(lat) over a triangle the mean by area is its width over that of sin."""
    found = sample("plate-carree", shapely.Polygon([(0, 10), (20, 10), (20, 40)]), measures=["s"])
    lon = np.radians(np.linspace(0, 20, 200_001))
    top = np.radians(10) + 1.5 * lon
    area = integrate.trapezoid(np.sin(top) - np.sin(np.radians(10)), lon)
    truth = integrate.trapezoid(top - np.radians(10), lon) / area
    assert found.mean("s").value == pytest.approx(truth, rel=1e-8)


@pytest.mark.slow
@each("parallels", PARALLELS)
def test_errors_of_means_beside_a_pole_at_infinity(parallels):
    """The scale of Lambert's conic grows as r^-1.1 to r^-1.65 at the other pole; its mean is known by quadrature."""
    one, two = np.radians(90.0 - np.array(parallels))  # polar distances
    n = np.log(np.sin(one) / np.sin(two)) / np.log(np.tan(one / 2.0) / np.tan(two / 2.0))

    def scale_by_area(log_u):
        """Of the distance u from the pole at infinity, and by its logarithm."""
        u = np.exp(log_u)
        return float(0.5 * u * np.sin(one) * (np.tan(one / 2.0) * np.tan(u / 2.0)) ** -n)

    whole = integrate.quad(scale_by_area, np.log(PROJ_ENDS), np.log(np.pi), epsabs=1e-13, epsrel=1e-12, limit=200)[0]
    lat_1, lat_2 = parallels
    found = sample(f"+proj=lcc +lat_1={lat_1} +lat_2={lat_2} +R=6371007", "globe").mean("k")
    assert found.value == pytest.approx(whole, abs=found.error)
    assert found.error < 0.02 * found.value


@each(("region", "error"), AREAS)
def test_weights_are_the_area(region, error):
    """The points stand for the whole region, and for nothing beside it."""
    field = sample("plate-carree", region, tolerance=1e-4)
    values, weights = field.many(field.lat)
    assert (weights >= 0).all()
    assert weights.sum() == pytest.approx(field.weight.sum(), rel=error)
    south, north = field.region.bounds[1::2]
    assert ((values >= south - 1e-9) & (values <= north + 1e-9))[weights > 0].all()


@pytest.fixture(scope="module")
def belt():
    """The plate carree's over a belt: a = k = 1 / cos(lat), b = h = 1."""
    return sample(
        "plate-carree", "box:-20,0,20,60", measures=[figure.measure for figure in FIGURES.values()], tolerance=1e-9
    )


NODE, WEIGHT = np.polynomial.legendre.leggauss(200)  # a fine rule, over the belt's latitudes
COSINE = np.cos(math.radians(30) * (1.0 + NODE))


def by_area(function):
    """The mean over the belt of functions of 1 / cos(lat)."""
    return np.sum(WEIGHT * COSINE * function(1.0 / COSINE)) / np.sum(WEIGHT * COSINE)


def omega(k):
    return np.degrees(2.0 * np.arcsin((k - 1.0) / (k + 1.0)))


def over_directions(term):
    """The root of the mean over the belt and all directions of the square of a term of the scale."""
    angle = np.pi * (np.arange(400) + 0.5) / 400

    def mean(k):
        return np.mean(term(np.hypot(k[:, None] * np.cos(angle), np.sin(angle))) ** 2, axis=-1)

    return math.sqrt(by_area(mean))


SQUARE_LOG, SQUARE = by_area(lambda k: np.log(k) ** 2), by_area(lambda k: (k - 1.0) ** 2)
LOG, LINEAR = by_area(np.log), by_area(lambda k: k - 1.0)
TRUTHS = {
    **dict.fromkeys(("airy_kavrayskiy", "klingatsch_angles", "klingatsch_areas"), math.sqrt(SQUARE_LOG)),
    **dict.fromkeys(("isotropy", "log_areal_scale"), math.sqrt(SQUARE_LOG)),
    "airy_kavrayskiy_scaled": math.sqrt(SQUARE_LOG - 0.5 * LOG**2),
    "airy_kavrayskiy_affine": math.sqrt(by_area(lambda k: (np.log(k) - LOG) ** 2)),
    "kavrayskiy": math.sqrt(0.5 * SQUARE_LOG),
    "airy": math.sqrt(0.5 * SQUARE),
    "airy_balance": math.sqrt(SQUARE),
    "jordan": over_directions(lambda scale: scale - 1.0),
    "jordan_kavrayskiy": over_directions(np.log),
    "canters_ab": 0.5 * LINEAR,
    "canters_ar": LINEAR,
    "kunimune_shape": LOG,
    "rms_scale_error_ppm": 1e6 * math.sqrt(SQUARE),
    **dict.fromkeys(("mean_scale_error_ppm", "mean_areal_error_ppm"), 1e6 * LINEAR),
    **dict.fromkeys(("max_scale_error_ppm", "max_areal_error_ppm"), 1e6),
    "max_log_scale": math.log(2.0),
    "angular_distortion": math.sqrt(by_area(lambda k: omega(k) ** 2)),
    "max_omega": omega(2.0),
    "mean_omega": by_area(omega),
}


@each("name", FIGURES)
def test_closed_forms(belt, name):
    """Each figure of the plate carree, all of whose matrices commute, is an integral over latitude."""
    # Of Jacobians with weights: here at the nodes of a fine rule, with the ends for largest values.
    cosine, weights = np.append(COSINE, [1.0, 0.5]), np.append(WEIGHT * COSINE, [0.0, 0.0])
    assert FIGURES[name](matrices(1.0 / cosine, 0.0, 0.0, 1.0), weights) == pytest.approx(TRUTHS[name], rel=1e-9)
    found, truth = belt.figure(name), TRUTHS[name]
    # Means of measures with kinks are resolved to 1e-6 of themselves; the lattice of extremes is exact here.
    assert found.value == pytest.approx(truth, rel=1e-9 if name.startswith("max_") else 1e-6)
    assert abs(found.value - truth) <= found.error + 1e-12 * truth


@pytest.mark.slow
def test_several_figures_at_once(belt):
    names = ["max_areal_error_ppm", "mean_areal_error_ppm", "max_scale_error_ppm", "max_log_scale", "airy_kavrayskiy"]
    found = belt.figures(names)
    assert list(found) == names
    assert {name: belt.figure(name) for name in names} == found


def test_functions_are_figures(belt):
    """The mean of a function of J, or what a figure of your own says; equal to the one with a name."""
    assert belt.figure(np.linalg.det).value == pytest.approx(by_area(lambda k: k), rel=1e-6)
    assert belt.figure(get_measure("s")).value == pytest.approx(by_area(lambda k: k), rel=1e-6)
    for statistic, truth in (("max", 2.0), ("rms", math.sqrt(by_area(lambda k: k**2)))):
        own = projdist.Figure(name="anamorphosis", measure=np.linalg.det, statistic=statistic)
        assert belt.figure(own).value == pytest.approx(truth, rel=1e-6)
    found = field_of([np.diag([2.0, 3.0]), np.diag([1.0, 1.0])], weight=[1, 4]).figure(np.linalg.det)
    assert found.value == pytest.approx(2.0, rel=1e-12)


@each("name", FIGURES)
def test_each_is_defined(name):
    figure = FIGURES[name]
    assert figure.description.endswith(".")
    assert figure.source
    assert get_measure(figure.measure).unit == figure.unit
    assert get_figure(figure) is get_figure(name) is figure


def test_of_matrices():
    """Figures, rewritten for diagonal matrices; rotations change none."""
    rng = np.random.default_rng(5)
    a, b, weights = rng.uniform(1.0, 1.1, 40), rng.uniform(0.9, 1.0, 40), rng.dirichlet(np.ones(40))
    square, log_s = np.log(a) ** 2 + np.log(b) ** 2, np.log(a * b)
    omega = np.degrees(2 * np.arcsin((a - b) / (a + b)))
    ppm, areal = 1e6 * np.maximum(a - 1, 1 - b), 1e6 * np.abs(a * b - 1)
    expected = {"airy_kavrayskiy": np.sqrt(weights @ square)}
    expected["airy_kavrayskiy_scaled"] = np.sqrt(weights @ square - (weights @ log_s) ** 2 / 2)
    for name, values in (("scale_error_ppm", ppm), ("omega", omega), ("areal_error_ppm", areal)):
        expected |= {f"max_{name}": values.max(), f"mean_{name}": weights @ values}
    J = Rotation.from_rotvec(np.outer(rng.uniform(0, 7, 40), [0, 0, 1])).as_matrix()[:, :2, :2] @ matrices(
        a, 0.0, 0.0, b
    )
    for name, value in expected.items():
        np.testing.assert_allclose(FIGURES[name](J, weights), value, rtol=1e-9, err_msg=name)


@each("name", REGIONS)
@each("count", [40, 300, 3000])
def test_nodes_are_in_their_region(name, count):
    """As many as asked for, by a factor of three, with weights that sum to 1, also with edges; means are spectral."""
    region = get_region(name)
    nodes = nodes_of(region, WGS84, count, edges=True)
    inside = nodes.weight > 0
    assert count / 3 < inside.sum() < 3 * count
    assert region.contains(nodes.lon[inside], nodes.lat[inside]).all()
    assert nodes.weight.sum() == pytest.approx(1.0)
    assert (~inside).sum() > 8
    if name == "globe" and count == 3000:  # the mean of sin^2 of the latitude is 1/3 on the sphere, to rounding
        nodes = nodes_of(region, SPHERE, count)
        assert np.sum(nodes.weight * np.sin(np.radians(nodes.lat)) ** 2) == pytest.approx(1 / 3, abs=1e-9)


@pytest.mark.slow
def test_polygons():
    """The middle of a triangle to 1e-4, and points all along its sides."""
    region = get_region(shapely.Polygon([(0.0, 0.0), (30.0, 0.0), (0.0, 30.0)]))
    nodes = nodes_of(region, SPHERE, 1000, edges=True)
    flat = nodes.weight / np.cos(np.radians(nodes.lat))
    np.testing.assert_allclose(np.array([nodes.lon, nodes.lat]) @ flat / flat.sum(), [10.0, 10.0], atol=1e-3)
    edge = nodes.weight == 0.0
    assert 0.6 * 1000 <= (~edge).sum() <= 4 * 1000
    distance = np.minimum(np.minimum(nodes.lon, nodes.lat), 30.0 - nodes.lon - nodes.lat)[edge]
    np.testing.assert_allclose(distance, 0.0, atol=1e-9)
    assert np.diff(np.sort(nodes.lon[edge & (nodes.lat == 0.0)])).max() < 0.5
    for count in (100, 1000):  # Easter Island is 2e-4 of Chile, however few the nodes are
        nodes = nodes_of(get_region("country:CL"), WGS84, count)
        assert 1e-4 < nodes.weight[nodes.lon < -100].sum() < 4e-4


def test_sets_of_points():
    """Points stay what they are, fewer of them where there are too many."""
    points = projdist.PointSet(np.arange(10.0), np.arange(10.0), np.arange(1.0, 11.0))
    np.testing.assert_allclose(nodes_of(points, WGS84, 10).weight, points.weight / 55.0)
    assert nodes_of(points, WGS84, 5).lon.size == 5


@each("definition", MAPS)
def test_jacobians_are_those_of_the_careful_differences(definition):
    """Fourth order with one step is as good as 1e-10 on smooth maps, and formulas to rounding."""
    projection = projdist.Projection.from_user_input(definition)
    nodes = nodes_of(Cap(10.0, 50.0, 2500.0), projection.ellipsoid, 100)
    J, shown = nodes.jacobian(projection)
    assert shown.all()
    np.testing.assert_allclose(J, jacobian(projection, nodes.lon, nodes.lat), atol=2e-10)


def noise(lon, lat):
    """A map that is torn everywhere."""
    return 1e7 * np.sin(1e7 * lon), 1e7 * np.cos(1e7 * lat)


# Next to the antimeridian the careful differences step in; beside pole lines, where the parallels of plate carree are
# stretched without end, steps are short; poles are ordinary points, as the stencil lies in the tangent plane. The far
# side of a map is not shown, and has no J; what is torn is shown.
HARD = [
    *(
        ("plate-carree", lon, lat, 1.0 / math.cos(math.radians(lat)), 1e-6)
        for lon, lat in ((179.999, 60), (-179.99, 80))
    ),
    *(("plate-carree", 10, lat, 1.0 / math.cos(math.radians(lat)), 1e-5) for lat in (89.0, 89.9, 89.99, -89.999)),
    *(("+proj=laea +lat_0=90 +R=6371000", lon, lat, 1.0, 1e-7) for lon, lat in ((0, 90), (30, 89.9999))),
    *(("+proj=ortho +R=6371000", 0, 0, 1.0, 1e-9), ("+proj=ortho +R=6371000", 170, 0, None, 0.0)),
    (noise, 5, 5, math.nan, 0.0),
]


@each(("definition", "lon", "lat", "a", "near"), HARD)
def test_jacobians_at_hard_nodes(definition, lon, lat, a, near):
    """The scales are a and 1."""
    projection = projdist.Projection.from_user_input(definition)
    nodes = nodes_at(np.array([lon, 10.0]), np.array([lat, 30.0]), np.ones(2), projection.ellipsoid)
    J, shown = nodes.jacobian(projection)
    assert shown.tolist() == [a is not None, True]
    if a is None or math.isnan(a):
        assert np.isnan(J[0]).all()
    else:
        np.testing.assert_allclose(np.linalg.svd(J[0], compute_uv=False), (a, 1.0), rtol=near)


def test_corners_and_vertices():
    """Edges hold a box's corners; with all ends every vertex is a node of no weight, else some."""
    nodes = nodes_of(projdist.Box(1.0, 2.0, 5.0, 9.0), WGS84, 100, edges=True)
    assert {(1, 2), (5, 2), (1, 9), (5, 9)} <= set(zip(nodes.lon.round(9), nodes.lat.round(9), strict=True))
    region = get_region("country:CA")
    ends = {tuple(end) for end in region.edges[:, :2].tolist()}
    for all_ends in (True, False):
        nodes = nodes_of(region, WGS84, 100, edges=True, all_ends=all_ends)
        beside = nodes.weight == 0.0
        found = set(zip(nodes.lon[beside].tolist(), nodes.lat[beside].tolist(), strict=True))
        assert (ends <= found) == all_ends
