"""Means of maps against closed forms, theorems, prototypes of other code, and the laws of a mean."""

import functools
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from tables import each

import projdist
from projdist import Projection, ProjectionError, mdt, mean_map, mean_plane_map, summarize
from projdist.designs import MeanMap
from projdist.designs.plane_maps import PlaneMean, Targets

R = 6371008.7714
SPHERE = f"+R={R}"
EQC = f"+proj=eqc +lat_ts=50.46 {SPHERE}"
POLE = f"+proj=stere +lat_0=90 {SPHERE}"
BOX = "box:-10,40,10,60"
EUROPE, UTM = f"+proj=laea +lat_0=52 +lon_0=10 {SPHERE}", f"+proj=tmerc +lon_0=9 +k_0=0.9996 {SPHERE}"
EUROPE_MAP = Projection.from_user_input(EUROPE)
TWO = ["robin", "moll"]
LON, LAT = np.array([-9.0, 3.0, 7.0, 0.0]), np.array([41.0, 45.0, 58.0, 50.0])

# Totals of the bound, the mean map and the average, and the scaled Airy-Kavrayskiy errors of the latter two, by a
# program of its own, at other nodes; half of the last digit.
PROTOTYPES = {
    ("aitoff", EQC): (0.235617, 0.240088, 0.301619, 0.35411, 0.36695),
    ("mercator", "mollweide"): (0.381201, 0.382028, 0.440810, 0.38476, 0.41562),
}
DIGIT, AK_DIGIT = 6e-7, 6e-6


@pytest.fixture(scope="module")
def winkel() -> MeanMap:
    """The mean of the two maps whose average is Winkel's."""
    return mean_map(["aitoff", EQC])


@pytest.mark.slow
@pytest.mark.parametrize("maps", PROTOTYPES)
def test_means_of_the_world(maps: tuple[str, str], winkel: MeanMap) -> None:
    """To the digits of the prototypes: nearer to both maps than their average, and less distorted."""
    found = winkel if maps == ("aitoff", EQC) else mean_map(maps)
    average = found.standing("average")
    assert (found.bound, found.total, average.total) == pytest.approx(PROTOTYPES[maps][:3], rel=0, abs=DIGIT)
    assert (found.airy_kavrayskiy, average.airy_kavrayskiy) == pytest.approx(PROTOTYPES[maps][3:], rel=0, abs=AK_DIGIT)


@pytest.mark.slow
def test_the_mean_of_aitoff_and_plate_carree(winkel: MeanMap) -> None:
    """It is symmetric, is pickled, ends with its box, goes on over the antimeridian, and is told in JSON."""
    # The average is Winkel's map as PROJ has it.
    lon, lat = np.array([-170.0, -60.0, 20.0, 100.0]), np.array([-80.0, -10.0, 45.0, 70.0])
    tripel = np.array(Projection.from_user_input(f"+proj=wintri +lat_1=50.46 {SPHERE}")(lon, lat))
    np.testing.assert_allclose(winkel.average(lon, lat), tripel, rtol=0, atol=1e-3)
    # As both maps are symmetric about the equator and the central meridian, so is it, to a tenth of a millimetre.
    lon, lat = np.array([30.0, 100.0, 179.0]), np.array([10.0, 50.0, 84.0])
    x, y = winkel.projection(lon, lat)
    for sx, sy in ((1, -1), (-1, 1), (-1, -1)):
        np.testing.assert_allclose(winkel.projection(sx * lon, sy * lat), (sx * x, sy * y), rtol=0, atol=1e-4)
    again = pickle.loads(pickle.dumps(winkel.projection))
    np.testing.assert_array_equal(again(LON, LAT), winkel.projection(LON, LAT))
    assert np.isnan(winkel.projection(0.0, 86.0)).all()
    np.testing.assert_allclose(winkel.projection(190.0, 40.0), winkel.projection(-170.0, 40.0), rtol=1e-12)
    series = winkel.to_dict()["chebyshev"]
    x = np.polynomial.chebyshev.chebval2d(20.0 / 180.0, 30.0 / 85.0, np.array(series["x"]))
    assert x == pytest.approx(float(winkel.projection(20.0, 30.0)[0]), rel=1e-12)
    assert winkel.crs is None


@pytest.mark.slow
def test_the_bound_in_closed_form() -> None:
    """Plate carree and the cylindrical equal-area map: half of the mean of ln^2 cos, and y' = sqrt(cos)."""
    found = mean_map([f"+proj=eqc {SPHERE}", f"+proj=cea {SPHERE}"], degree=7)
    t, w = leggauss(200)
    phi = np.radians(85.0 * t)
    half = 0.5 * float(np.sum(w * np.cos(phi) * np.log(np.cos(phi)) ** 2) / np.sum(w * np.cos(phi)))
    assert found.bound == pytest.approx(half, rel=1e-10)
    assert found.bound < found.total < found.bound * 1.0001
    t, w = leggauss(40)
    truth = R * np.radians(60.0) * 0.5 * float(np.sum(w * np.sqrt(np.cos(np.radians(30.0 + 30.0 * t)))))
    x, y = found.projection([0.0, 90.0], [60.0, 0.0])
    np.testing.assert_allclose([x[0], y[1]], 0.0, atol=1e-3)
    np.testing.assert_allclose([y[0], x[1]], [truth, R * np.pi / 2], rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("weights", "cone"), [(None, 0.5), ([2, 1], 1 / 3)])
def test_the_mean_of_a_cylinder_and_a_plane_is_a_cone(weights: list[float] | None, cone: float) -> None:
    """Conformal maps have a conformal mean, whose scale is the geometric mean of theirs: no gap."""
    # Mercator's map and the polar stereographic one have Lambert's cone between them, of the constant of the weights.
    found = mean_map(["mercator", POLE], region=BOX, weights=weights)
    assert found.total == pytest.approx(found.bound, rel=1e-9)
    assert summarize(found.projection, BOX, measures=["omega"]).measures["omega"].max < 1e-3
    mercator, stereographic = 1.0 / np.cos(np.radians(LAT)), 2.0 / (1.0 + np.sin(np.radians(LAT)))
    truth = np.sqrt(mercator ** (2.0 * (1.0 - cone)) * stereographic ** (2.0 * cone))
    s = projdist.factors(found.projection, LON, LAT).s
    np.testing.assert_allclose(np.sqrt(s), truth, rtol=1e-5)


@pytest.mark.slow
def test_two_maps_from_each_other() -> None:
    """The mean parts the distance d by their weights v and w: v w d^2 / (v + w) is left, and w d^2 at the first map."""
    # The map that is corrected is the nearest one, and areas are those of the ellipsoid where there is one.
    weights = np.array([1.0, 3.0])
    zone = UTM.replace(SPHERE, "+ellps=WGS84")
    found = mean_map([EUROPE, zone], weights=weights, region=BOX, degree=4)
    given = [one.total for one in found.standings if one.kind == "given"]
    np.testing.assert_allclose(given, weights.sum() / weights * found.bound, rtol=1e-9)
    assert "+proj=tmerc" in found.base.definition
    assert found.average.ellipsoid.is_close(projdist.WGS84)


@pytest.mark.slow
def test_the_mean_of_one_map() -> None:
    """Is the map, of copies, too, and has no total; that Robinson's is nearer to itself than its mean is, is said."""
    for maps in ([EUROPE], [EUROPE] * 3):
        found = mean_map(maps, region=BOX, degree=3)
        np.testing.assert_allclose(found.projection(LON, LAT), np.array(EUROPE_MAP(LON, LAT)), rtol=0, atol=1e-4)
        assert found.total < 1e-18
    # Robinson's table is no polynomial.
    found = mean_map(["robinson"], degree=3)
    assert found.standing("average").total < 1e-12 < found.total
    assert "polynomials of this degree do not come near" in found.notes[0]
    assert 1e-12 < found.error < 0.1 * found.total  # what other nodes change of the mean's, and not of the map's own


@pytest.mark.slow
def test_a_map_and_its_similar_image() -> None:
    """Their mean is the map at the geometric mean of the scales, here 2, as the first is turned; a function will do."""

    def plane(projection: Callable, lon: np.ndarray = LON, lat: np.ndarray = LAT) -> np.ndarray:
        x, y = projection(lon, lat)
        return x + 1j * y

    def enlarged(lon: np.ndarray, lat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = 4.0 * np.exp(1j) * plane(EUROPE_MAP, lon, lat) + 1e6  # turned by a radian, and elsewhere
        return z.real, z.imag

    found = mean_map([EUROPE, enlarged], region=BOX, degree=3)
    np.testing.assert_allclose(np.diff(plane(found.projection)), 2.0 * np.diff(plane(EUROPE_MAP)), rtol=1e-9)
    # Of similar maps each distance is the root of 2 times the logarithm of the scale.
    assert (found.total, found.bound) == pytest.approx([2.0 * 2.0 * np.log(2.0) ** 2] * 2, rel=1e-9)


X, Y = np.random.default_rng(5).uniform(-1.0, 1.0, (2, 400))


def homography(H: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Jacobians (n, 2, 2) of a homography (3, 3) by the quotient rule."""
    u, v, w = np.einsum("ij,jn->in", H, np.stack([x, y, np.ones_like(x)]))
    rows = [[(H[i, j] * w - value * H[2, j]) / w**2 for j in (0, 1)] for i, value in enumerate((u, v))]
    return np.moveaxis(np.array(rows), -1, 0)


HOMOGRAPHIES = np.stack([
    homography(np.array([[1.1, 0.1, 0.0], [-0.1, 0.9, 0.2], [0.1, 0.05, 1.0]]), X, Y),
    homography(np.array([[0.8, 0.0, 0.1], [0.2, 1.2, 0.0], [-0.1, 0.1, 1.0]]), X, Y),
])  # fmt: skip


@functools.cache
def mean_of_homographies(degree: int) -> PlaneMean:
    return mean_plane_map(X, Y, HOMOGRAPHIES, degree=degree)


def test_linear_maps_have_the_mdt_for_mean() -> None:
    """T of `mdt` of the transposed matrices, up to a turn: J^T J is T T^T, and the gap is none."""
    A = np.eye(2) + 0.3 * np.random.default_rng(2).uniform(-1, 1, (4, 2, 2))
    found = mean_plane_map(X, Y, np.repeat(A[:, None], X.size, axis=1), weights=[1, 2, 3, 4], degree=3)
    best = mdt(np.swapaxes(A, 1, 2), [1, 2, 3, 4])
    J = found.jacobian(X, Y)
    np.testing.assert_allclose(np.swapaxes(J, 1, 2) @ J, np.broadcast_to(best.T @ best.T.T, J.shape), atol=1e-9)
    assert (found.total, found.bound) == pytest.approx([10.0 * best.cost] * 2, rel=1e-12)


def test_planes_of_the_domain_and_of_the_maps() -> None:
    """Each f_i after one linear map has f after it for a mean: nothing of the domain matters but what points count."""
    one = mean_of_homographies(4)
    A = np.array([[2.0, 0.7], [-0.3, 0.5]])
    x, y = A @ np.stack([X, Y])
    other = mean_plane_map(x, y, HOMOGRAPHIES @ np.linalg.inv(A), degree=4)
    assert other.total == pytest.approx(one.total, rel=1e-10)
    np.testing.assert_allclose(other(x, y), one(X, Y), atol=1e-7)
    # A similarity after all maps is one after their mean; any other linear map is not, as distances are measured.
    S = 3.0 * np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    other = mean_plane_map(X, Y, S @ HOMOGRAPHIES, degree=4)
    assert other.total == pytest.approx(one.total, rel=1e-10)
    np.testing.assert_allclose(other(X, Y), S @ np.array(one(X, Y)), atol=1e-7)
    sheared = mean_plane_map(X, Y, np.array([[1.0, 0.5], [0.0, 1.0]]) @ HOMOGRAPHIES, degree=4)
    assert abs(sheared.total / one.total - 1.0) > 1e-3


def test_nothing_near_is_nearer() -> None:
    """The total rises from the mean with any change of its coefficients, and falls with the degree to the bound."""
    totals, best = [mean_of_homographies(degree).total for degree in (1, 2, 4, 6)], mean_of_homographies(4)
    assert sorted(totals, reverse=True) == totals
    assert totals[-1] > best.bound
    targets = Targets(HOMOGRAPHIES, np.ones(2), np.full(X.size, 1.0 / X.size))
    assert targets.total(best.jacobian(X, Y)) == pytest.approx(best.total, rel=1e-12)
    rng = np.random.default_rng(4)
    graded = np.add.outer(np.arange(5), np.arange(5)) <= 4
    for _ in range(8):
        change = 1e-4 * rng.normal(size=(2, 5, 5)) * graded
        other = replace(best.plane_map, coefficients=best.coefficients + change)
        assert targets.total(other.at(X, Y)[2]) > best.total


def test_the_variance_inequality() -> None:
    """What a map's total has more than the bound is its squared distance from the mean metric at least."""
    # So it is wherever curvature is not positive (K.-T. Sturm 2003, Contemporary Mathematics 338, proposition 4.4). Two
    # maps and their mean are on one geodesic, where both are the same but for the rounding of sums of 400 numbers.
    J, w, counts = HOMOGRAPHIES, np.full(X.size, 1.0 / X.size), np.array([2.0, 1.0])
    targets = Targets(J, counts, w)
    middle = targets.mean_metric()
    from_middle = Targets(middle[None], np.array([counts.sum()]), w)
    bound = targets.total(middle)
    for other in (*J, mean_plane_map(X, Y, J, weights=counts, degree=3).jacobian(X, Y)):
        assert targets.total(other) - bound >= (1.0 - 1e-13) * from_middle.total(other)


@each(("call", "error", "words"), [
    (lambda: mean_map([]), ValueError, "one map or more"),
    (lambda: mean_map(TWO, weights=[1]), ValueError, "as many as maps"),
    (lambda: mean_map(TWO, weights=[1, -1]), ValueError, "finite and positive"),
    (lambda: mean_map(TWO, region="globe"), ValueError, "must be a box within 86 degrees"),
    (lambda: mean_map(TWO, region="box:-180,-60,180,89"), ValueError, "must be a box within 86 degrees"),
    (lambda: mean_map(TWO, degree=13), ValueError, "at most 12"),
    (lambda: mean_map(TWO, region=BOX, degree=21), ValueError, "from 1 to 20"),
    (lambda: mean_map(TWO, degree=2, datum="EPSG:4258"), ValueError, "for maps of regions"),
    (lambda: mean_map([EUROPE], region=BOX, degree=2, datum="EPSG:4258"), ValueError, "with the base's ellipsoid"),
    (lambda: mean_plane_map(X, Y[1:], np.ones((1, 400, 2, 2))), ValueError, "They must be"),
    (lambda: mean_plane_map(X, Y, np.tile(np.diag([1, -1]), (1, 400, 1, 1))), ValueError, "determinants positive"),
    (lambda: mean_plane_map(X[:3], Y[:3], np.tile(np.eye(2), (1, 3, 1, 1)), degree=4), ValueError, "do not tell"),
    (lambda: mean_map(["robin", f"+proj=robin +lon_0=10 {SPHERE}"]), ProjectionError, "is cut within"),
    (lambda: mean_map(["robin", f"+proj=ortho {SPHERE}"]), ProjectionError, "does not show"),
    (lambda: mean_map(["robin", "+proj=robin +R=1737400"]), ProjectionError, "must be of one body"),
    (lambda: mean_map(["robin", "+proj=robin +R=1"]), ProjectionError, "another size"),
])  # fmt: skip
def test_what_is_refused(call, error: type[ValueError], words: str) -> None:
    """In one line, with what is allowed: cut maps, too, those that do not show the region, and of other bodies."""
    with pytest.raises(error, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)
