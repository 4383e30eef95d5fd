"""The errors of extremes, against closed forms and brute force."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS
from projdist.field import extreme_bounds as bounds
from projdist.field import sample
from projdist.field.at_points import measure_at
from projdist.field.extreme_bounds import Polynomials
from projdist.matrices.measures import get_measure
from projdist.numerics.polynomials import NODES
from projdist.projections import Projection
from projdist.regions import Box, Cap, PointSet, get_region
from projdist.support import Notice

R = MEAN_EARTH_RADIUS
MEASURES = ["s", "h", "k", "a", "b", "omega", "theta", "fisher", "scale_error_ppm"]
KROVAK_BOX = (9.775005, 47.503207, 21.248525, 52.687228)


def value_at(projection, measure, lon, lat):
    """A measure by stencils at points, which know nothing of panels."""
    projection = Projection.from_user_input(projection)
    return measure_at(projection, get_measure(measure), np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))


@pytest.mark.slow
def test_a_side_against_a_ridge_inside():
    """Krovak's least area is on a box's side, where the cone that has the least scales all along leaves it."""
    _, south, east, north = KROVAK_BOX
    on_side = minimize_scalar(
        lambda lat: float(value_at("EPSG:5224", "s", east, lat)), bounds=(south, north), options={"xatol": 1e-9}
    )
    region = Box(*KROVAK_BOX)
    with pytest.warns(Notice, match=r"^EPSG:5224 is for .* 28 % of box"):
        alone, beside = (
            summarize("EPSG:5224", region, measures=names).measures["s"] for names in ("s", ["omega", "s", "k"])
        )
    for found in (alone, beside):
        assert found.min == pytest.approx(on_side.fun, abs=3e-11)  # the stencils' rounding, twice
        assert found.min_at == pytest.approx((east, on_side.x), abs=1e-3)
        assert 0.0 < found.min_error < 1e-9


@each(
    ("projection", "region", "measure", "statistic", "truth"),
    [
        ("mercator", "box:0,30,10,60", "k", "max", 2.0),
        ("mercator", "box:0,30,10,60", "k", "min", 1.0 / math.cos(math.radians(30.0))),
        (f"+proj=stere +lat_0=47 +lon_0=8 +R={R}", "country:CH", "s", "min", 1.0),
        (f"+proj=laea +lat_0=20 +lon_0=8 +R={R}", "cap:8,20,2000", "a", "max", 1.0 / math.cos(1e6 / R)),
        ("sinusoidal", "globe", "omega", "max", math.degrees(2.0 * math.atan(math.pi / 2.0))),
        (f"+proj=cea +R={R}", "box:-10,35,40,70", "areal_error_ppm", "max", 0.0),
        ("mercator", "box:-10,35,40,70", "omega", "max", 0.0),
    ],
)
def test_errors_against_closed_forms(projection, region, measure, statistic, truth):
    """The error of an extreme is honest, and small: 1e-8 of it, or of 1 where it vanishes."""
    found = summarize(projection, region, measures=[measure]).measures[measure]
    value, error = getattr(found, statistic), getattr(found, f"{statistic}_error")
    assert abs(value - truth) <= 3.0 * error
    assert error <= 1e-8 * max(1.0, truth) * {"omega": 100.0, "areal_error_ppm": 1e6}.get(measure, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "projection", ["plate-carree", "robinson", "winkel-tripel", "mollweide", "eckert-4", "equal-earth", "kavrayskiy-7"]
)
def test_errors_at_pole_lines(projection):
    """Towards a pole that is a line, or an end of Mollweide's, omega comes to 180 degrees: as its error says."""
    found = summarize(projection, measures=["omega"]).measures["omega"]
    assert 180.0 - found.max <= found.max_error


BONNE = "+proj=bonne +lat_1={} +R=6371008.7714"


POLAR = ["cap:0,90,289", "cap:0,90,400", "cap:0,90,1000", "box:-180,80,180,90"]
BONNES = [(60, POLAR[0]), (86.9998, POLAR[1]), (87, POLAR[3])]
OTHERS = [(lat_1, region) for lat_1 in (60, 86.9998, 87) for region in POLAR if (lat_1, region) not in BONNES]


@each(("lat_1", "region"), [*BONNES, *(pytest.param(*pair, marks=pytest.mark.slow) for pair in OTHERS)])
def test_limits_at_the_pole_of_bonnes_map(lat_1, region):
    """The shear lam (sin phi - cos phi / rho) is pi where the antimeridian meets the pole, a bound that is not reached.

    Where rho at the pole is 300 m, as for 87 degrees, scales grow as if without bound down to a thousandth of a degree.
    """
    field = sample(BONNE.format(lat_1), region, measures=["h", "a"])
    for measure, truth in (("h", math.sqrt(1.0 + math.pi**2)), ("a", 0.5 * (math.pi + math.sqrt(math.pi**2 + 4.0)))):
        found = field.maximum(measure)
        assert abs(found.value - truth) <= found.error + 1e-9
        assert found.error < 0.4
        assert found.lat > 89.999


@each("projection", ["sinusoidal", "quartic-authalic", "foucaut", "collignon", BONNE.format(45)])
def test_equal_areas_to_the_poles(projection):
    """Nodes crowd at a pole, and what polynomials make of their rounding there is not taken for certain."""
    field = sample(projection, "box:0,60,40,90", measures=["a", "h", "s"], tolerance=1e-5)
    rounding = 1e-8  # of PROJ, beside a pole
    for found in field.extremes(["s"])[0]:
        assert abs(found.value - 1.0) <= found.error + rounding
        assert found.value == pytest.approx(1.0, abs=1e-6)


def test_the_shear_of_the_sinusoidal_map():
    """It is pi sin phi at most, so that h is the root of 1 + pi^2 at the poles."""
    found = sample("sinusoidal", "globe", measures=["a", "h", "s"], tolerance=1e-5).maximum("h")
    assert found.value == pytest.approx(math.sqrt(1.0 + math.pi**2), abs=1e-7)
    assert found.error < 1e-6


def islet(lon, lat, radius):
    """A polygon of eight corners about a place."""
    angles = np.linspace(0.0, 2.0 * math.pi, 9)
    return np.stack([lon + radius * np.cos(angles), lat + radius * np.sin(angles)], axis=-1).tolist()


def test_far_islets_among_noise():
    """Islets in a panel that is smooth but for rounding, beyond which scales grow, bound the largest by their own."""
    rings = [islet(-8, 40, 6), islet(6.4, -8, 0.04), islet(10.3, -8.6, 0.05), islet(10.3, -7.4, 0.03)]
    region = {"type": "MultiPolygon", "coordinates": [[ring] for ring in rings]}
    # Metres of 12 digits have 1.5e-5 m for their last, which is 1e-8 of a scale in the smallest panels.
    field = sample(f"+proj=tmerc +R={R} +x_0=1e11", region, measures=["a"])
    lon, lat = np.radians(np.concatenate(rings)).T
    truth = float((1.0 / np.sqrt(1.0 - (np.cos(lat) * np.sin(lon)) ** 2)).max())  # Snyder 1987, 8-4
    found = field.maximum("a")
    assert found.value == pytest.approx(truth, abs=3e-9)
    assert abs(found.value - truth) <= found.error < 1e-6


def test_what_is_unbounded_has_no_error():
    """An infinite extreme has no error, in JSON neither a value nor an error; the other end has both."""
    found = summarize("mercator", measures=["k"]).measures["k"]
    assert np.isnan(found.max_error)
    assert found.to_dict()["max"] is found.to_dict()["max_error"] is None
    assert found.min == pytest.approx(1.0, abs=3 * found.min_error + 1e-12)


def test_points_have_the_errors_of_derivatives():
    """Of a set of points the extremes are values at points: good to the rounding of derivatives."""
    points = PointSet(np.array([0.0, 10.0]), np.array([60.0, 30.0]), np.ones(2))
    found = summarize("mercator", points, measures=["k"]).measures["k"]
    assert found.max == pytest.approx(2.0, rel=1e-11)
    assert found.max_at == (0.0, 60.0)
    assert 0.0 < found.max_error < 1e-9


ANYWHERE = pytest.mark.filterwarnings("ignore:.*outside its area of use:projdist.support.Notice")

CRSS = [
    *("EPSG:5224", "EPSG:3035", "EPSG:32633", "EPSG:2154", "EPSG:3857", "EPSG:2056", "EPSG:3034", "ESRI:54030"),
    *("ESRI:54009", "winkel-tripel", "robinson", "eckert-4", "sinusoidal", "equal-earth", "hammer", "natural-earth"),
    "+proj=aea +lat_1=30 +lat_2=60 +lon_0=10 +ellps=GRS80",
    "+proj=omerc +lat_0=45 +lonc=15 +alpha=50 +ellps=GRS80",
    "+proj=aeqd +lat_0=40 +lon_0=10 +R=6371000",
    "+proj=poly +lon_0=10 +ellps=GRS80",
    "+proj=cass +lon_0=10 +ellps=GRS80",
]


def random_region(generator):
    kind = generator.integers(3)
    if kind == 0:
        west, south = generator.uniform(-10, 20), generator.uniform(33, 60)
        return Box(west, south, west + generator.uniform(0.5, 15), south + generator.uniform(0.5, 10))
    if kind == 1:
        return Cap(generator.uniform(-5, 25), generator.uniform(35, 60), generator.uniform(50, 1200))
    return get_region("country:" + str(generator.choice(["DE", "FR", "CH", "IT", "PL", "AT", "CZ", "NO", "HR"])))


def brute_force(projection, region, measure, sign):
    """The largest value times a sign: of a fine grid and of points along edges, bettered by a simplex search."""
    west, south, east, north = region.bounds
    is_cap = isinstance(region, Cap)
    low, high = np.array([(0.0, 0.0), (360.0, region.angle)] if is_cap else [(west, south), (east, north)])
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 121).T), axis=-1).reshape(-1, 2)

    def degrees(p):
        if not is_cap:
            return p[..., 0], p[..., 1]
        points = region.chart(np.zeros(p.shape[:-1], dtype=int), p[..., 0], p[..., 1])
        return np.asarray(points.lon), np.asarray(points.lat)

    if len(region.edges):
        grid = grid[region.contains(*degrees(grid))]
    values = sign * value_at(projection, measure, *degrees(grid))
    best = [float(values.max())]

    def lack(p):
        lon, lat = degrees(np.clip(p, low, high))
        outside = len(region.edges) and not region.contains(lon, lat)
        return 1e30 if outside else -sign * float(value_at(projection, measure, lon, lat))

    for start in grid[np.argsort(-values)[:2]]:
        simplex = start + (high - low) / 150 * np.array([(0, 0), (1, 0), (0, 1)])
        options = {"xatol": 1e-9, "fatol": 1e-15, "maxiter": 250, "initial_simplex": simplex}
        best.append(-minimize(lack, start, method="Nelder-Mead", options=options).fun)
    if len(region.edges):
        share = np.linspace(0.0, 1.0, 5)
        start, way = region.edges[:, None, :2], (region.edges[:, 2:] - region.edges[:, :2])[:, None]
        best.append(float((sign * value_at(projection, measure, *degrees(start + way * share[:, None]))).max()))
    return max(best)


@pytest.mark.slow
@ANYWHERE
@pytest.mark.parametrize("seed", range(80))
def test_errors_of_random_regions(seed):
    """Brute force finds nothing beyond three times the error, or beyond the rounding of its own stencils."""
    generator = np.random.default_rng(seed)
    region, projection = random_region(generator), str(generator.choice(CRSS))
    measure = str(generator.choice(MEASURES))
    region = get_region(region, Projection.from_user_input(projection).ellipsoid.ground)  # a sphere has other caps
    found = summarize(projection, region, measures=[measure]).measures[measure]
    # The stencils are good to 1e-11 of the scales, on PROJ's iterative maps to 1e-9; in degrees or ppm that is more.
    rounding = 1e-9 * {"omega": 60.0, "theta": 60.0, "scale_error_ppm": 1e6}.get(measure, max(1.0, found.max))
    for sign, value, error in ((1.0, found.max, found.max_error), (-1.0, found.min, found.min_error)):
        assert brute_force(projection, region, measure, sign) <= sign * value + 3.0 * error + rounding


@pytest.mark.slow
@ANYWHERE
@pytest.mark.parametrize("seed", range(10))
def test_the_answer_does_not_depend_on_what_else_is_asked(seed):
    """Every measure alone has the extremes that it has beside all others, to the errors of both."""
    generator = np.random.default_rng(1000 + seed)
    region, projection = random_region(generator), str(generator.choice(CRSS))
    together = summarize(projection, region, measures=MEASURES).measures
    for measure in MEASURES:
        alone = summarize(projection, region, measures=[measure]).measures[measure]
        for end in ("max", "min"):
            both = alone, together[measure]
            allowed = sum(getattr(one, f"{end}_error") for one in both)
            assert abs(getattr(both[0], end) - getattr(both[1], end)) <= allowed


def test_places_in_bent_pieces():
    """In pieces whose sides are curves places are found as by the formula; what lies beyond them stays beyond."""
    r, s = np.broadcast_arrays(NODES[:, None], NODES)
    u, v = r + 0.2 * r * s, s + 0.1 * r**2
    rest = {"field": np.zeros((1, 4, *u.shape)), "error": np.zeros((1, 4)), "clipped": np.ones(1, bool)}
    piece = Polynomials(patch=np.zeros(1, int), u=u[None], v=v[None], size=np.ones(1), **rest)
    r, s = np.array([[-0.9, 0.0, 0.3, 1.0, 1.2]]), np.array([[0.7, 0.0, -1.0, 1.0, 0.1]])
    found = bounds._square(piece, np.zeros(1, int), r + 0.2 * r * s, s + 0.1 * r**2)
    np.testing.assert_allclose(found, (r, s), atol=1e-12)
    # Rectangles are the same in closed form.
    r, s = np.broadcast_arrays(NODES[:, None], NODES)
    piece = replace(piece, u=(5.0 + 2.0 * r)[None], v=(1.0 - 3.0 * s)[None])
    found = bounds._square(piece, np.zeros(1, int), np.array([[7.0, 4.0]]), np.array([[-2.0, 1.0]]))
    np.testing.assert_allclose(found, ([[1.0, -0.5]], [[1.0, 0.0]]), atol=1e-12)
