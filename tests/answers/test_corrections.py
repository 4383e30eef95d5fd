"""Corrected maps: closed forms, published figures, theorems, and the forms in which they leave."""

import json
import math
import pickle

import numpy as np
import pytest
from gis_files import some_slow
from pyproj import CRS, Transformer
from refusals import refuses
from scipy.optimize import brentq
from tables import each

from projdist import SPHERE, PointSet, Projection, correct, jacobian, local_corrections, mdt, sample, summarize
from projdist.answers.corrections import CONSTRAINTS, _direction
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, destination
from projdist.matrices.spd import factor_distance
from projdist.projections import ProjectionError

ONE_SIDE = np.array([[0.0, 0.0], [1.0, 0.0]])
GERMANY = "box:5.9,47.3,15,55.1"
WORLD = ["plate-carree", "mercator", "mollweide", "equal-earth", "winkel-tripel", "robinson", "sinusoidal"]
_FIGURE = 5e-11  # half a unit of the figures' last digit
_EXACT = 1e-10  # the tolerance of the integrals


# Diagonals of inverse corrections, how near, and the errors that are left. x of the plate carree shrinks by 2/e;
# Mercator's map, as conformal ones do, gains by its scale alone; equal-area ones are stretched, and stay equal-area:
# these figures are from another program, in units of their last digit, Equal Earth's rounded away from determinant 1.
DIAGONALS = [
    ("plate-carree", (math.e / 2, 1.0), _EXACT, 0.4213466110), ("mercator", (math.e / 2,) * 2, _EXACT, 0.5958740917),
    ("mollweide", (1.10391198, 0.90586932), 5e-9, 0.5256351494), ("equal-earth", (1.0757583, 0.9295769), 1e-7, None),
]  # fmt: skip


@pytest.mark.slow
@each("name, T, digit, left", DIAGONALS)
def test_corrections_of_the_globe(name, T, digit, left):
    result = correct(name)
    np.testing.assert_allclose(np.linalg.inv(result.matrix), np.diag(T), rtol=0, atol=digit)
    assert left is None or result.airy_kavrayskiy_corrected == pytest.approx(left, abs=_FIGURE)
    assert digit == _EXACT or np.linalg.det(result.matrix) == pytest.approx(1.0, abs=_EXACT)


def test_corrections_that_are_parameters():
    """The equidistant cylindrical map with the parallel arccos(2/e), 42.6286 degrees, and Mercator's with k_0 = 2/e."""
    result, mercator = correct("plate-carree"), correct("mercator")
    name, radius, parallel = result.parameters.split()
    assert (name, radius) == ("+proj=eqc", "+R=6371008.7714")
    assert float(parallel.removeprefix("+lat_ts=")) == pytest.approx(math.degrees(math.acos(2 / math.e)), abs=1e-8)
    assert result.words == "scale 0.8577639, stretch 1.359141 along the vertical, no shear, no rotation"
    assert float(mercator.parameters.rpartition("+k_0=")[2]) == pytest.approx(2.0 / math.e, abs=_EXACT)
    assert np.isnan(mercator.parts.stretch_azimuth)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*WORLD, lambda lon, lat: (1e5 * lon, 2e5 * np.sin(np.radians(lat)) * 60)])
def test_a_corrected_map_needs_no_correction(name):
    """The MDT of a corrected map is the identity, and what was predicted is measured."""
    result = correct(name)
    np.testing.assert_allclose(summarize(result.corrected, tolerance=1e-10).mdt, np.eye(2), atol=_EXACT)
    assert result.airy_kavrayskiy_corrected == pytest.approx(result.airy_kavrayskiy_affine, abs=_EXACT)
    scaled = result.airy_kavrayskiy_scaled
    assert result.airy_kavrayskiy_affine - _EXACT <= scaled <= result.airy_kavrayskiy + _EXACT


def test_constraints():
    """A scale keeps angles, a stretch keeps areas; they part what the affine correction does."""
    found = {name: correct("robinson", constraint=name) for name in CONSTRAINTS}
    np.testing.assert_allclose(found["scale"].matrix @ found["stretch"].matrix, found["affine"].matrix, rtol=1e-13)
    assert found["scale"].matrix[0, 0] == found["scale"].matrix[1, 1]
    assert np.linalg.det(found["stretch"].matrix) == pytest.approx(1.0, rel=1e-14)
    assert found["scale"].airy_kavrayskiy_corrected == pytest.approx(found["scale"].airy_kavrayskiy_scaled, abs=_EXACT)
    gain = {name: result.airy_kavrayskiy**2 - result.airy_kavrayskiy_corrected**2 for name, result in found.items()}
    assert gain["scale"] + gain["stretch"] == pytest.approx(gain["affine"], abs=1e-9)


def nearer_than(q, middle):
    """The share of the sphere whose ln(1 / cos lat) differs by less than q from `middle`; sin(lat) is even by area."""
    low, high = max(middle - q, 0.0), middle + q
    return math.sqrt(1.0 - math.exp(-2.0 * high)) - math.sqrt(1.0 - math.exp(-2.0 * low))


@pytest.mark.slow
@each("name, T, times", [("plate-carree", (2 / 3**0.5, 1.0), 1.0), ("mercator", (2 / 3**0.5, 2 / 3**0.5), 2**0.5)])
def test_median_of_cylindrical_maps(name, T, times):
    """Half of the globe lies within 30 degrees of the equator: there is the median scale, and half has what follows."""
    found = correct(name, criterion="median")
    assert np.abs(np.linalg.inv(found.matrix) - np.diag(T)).max() < found.matrix_error < 1e-4
    middles = {"spread": 0.0, "spread_affine": math.log(math.e / 2), "spread_corrected": math.log(2 / math.sqrt(3))}
    for spread, middle in middles.items():
        truth = times * brentq(lambda q, middle=middle: nearer_than(q, middle) - 0.5, 1e-3, 1.0)
        value, error = getattr(found, spread).median
        assert abs(value - truth) < max(2.0 * error, 1e-4)
    # The mean of ln(1 / cos lat) is 1 - ln 2.
    assert found.spread.mean.value == pytest.approx(times * (1 - math.log(2)), abs=1e-5)
    assert found.spread_corrected.mean.value < found.spread_affine.mean.value
    assert found.airy_kavrayskiy_affine < found.airy_kavrayskiy_corrected  # the squares pay for that
    assert found.to_dict()["fisher_median_corrected"] == found.spread_corrected.median.value
    if name == "plate-carree":  # words have no more digits than the median is good for
        assert found.words.startswith("scale 0.93059, stretch 1.1547")


@pytest.mark.parametrize("region", some_slow(["points", "country:DE"], {"country:DE"}))
def test_no_other_matrix_has_a_lower_mean(region):
    """Small changes of the median raise the mean distortion; conformal and equal-area maps stay what they are."""
    if region == "points":
        rng = np.random.default_rng(7)
        region = PointSet(rng.uniform(-20, 30, 50), rng.uniform(30, 70, 50), rng.uniform(1, 2, 50))
    for name, changes in (("lcc+lat_1=30+lat_2=60", [np.eye(2)]), ("sinusoidal", [np.diag([1.0, -1.0]), ONE_SIDE])):
        found = correct(name, region, criterion="median")
        T = np.linalg.inv(found.matrix)
        field = sample(name, region)
        least = field.spread(T).mean.value
        for V in changes:
            for t in (-1e-2, 1e-2):
                assert field.spread((np.eye(2) + t * V) @ T).mean.value > least
        if name == "sinusoidal":
            assert np.linalg.det(found.matrix) == pytest.approx(1.0, abs=1e-6)
        else:
            np.testing.assert_allclose(found.matrix, np.eye(2) * found.parts.scale, atol=1e-6)


def test_a_median_that_is_not_unique():
    """Of two places of one weight on a conformal map every scale between theirs is a median: the middle, and a word."""
    two = PointSet(np.zeros(2), np.array([0.0, 60.0]), np.ones(2))
    found = correct("mercator", two, criterion="median")
    assert "other medians" in found.note
    np.testing.assert_allclose(found.matrix, np.eye(2) / math.sqrt(2.0), atol=1e-9)


def test_north():
    """With north kept the vertical stays vertical; free, the mean orientation is north, by the mean of unit vectors."""
    kept = correct("laea", GERMANY)
    assert kept.matrix[0, 1] == 0.0
    assert kept.parts.rotation == 0.0
    free, kept = (correct("+proj=stere +R=6371008.7714", GERMANY, keep_north=north) for north in (False, True))

    def sine(
        J,
    ):  # a conformal map's polar factor is the turn of north; the mean of its sine vanishes with the mean turn
        return J[..., 0, 1] / np.hypot(J[..., 0, 1], J[..., 1, 1])

    assert summarize(free.corrected, GERMANY, measures=[sine]).measures["sine"].mean == pytest.approx(0.0, abs=1e-9)
    assert free.airy_kavrayskiy_corrected == pytest.approx(kept.airy_kavrayskiy_corrected, abs=_EXACT)


def test_mirrored_maps():
    """Free, north is up on a mirrored map, too, whichever axis mirrors; and it is said that it mirrors."""
    for axis, vertical in (("wnu", 1.0), ("esu", -1.0)):
        result = correct(f"+proj=merc +R=6371000 +axis={axis}", "box:0,0,20,20", keep_north=False)
        assert np.sign(result.matrix[1, 1]) == vertical
        assert result.note == "The map mirrors 100 % of the region; no distortion sees that."


def test_no_mean_orientation():
    """About a pole of a polar map the norths cancel out, and that is said; a map that mirrors in part has none."""
    polar = correct("+proj=stere +lat_0=90 +R=6371008.7714", "cap:0,90,1000", keep_north=False)
    assert polar.note.startswith("There is no meaningful mean orientation")
    twice = correct(lambda lon, lat: (1e5 * np.abs(lon), 1e5 * lat), "box:-30,-20,30,20")
    assert twice.note == "The map mirrors 50 % of the region; no distortion sees that."
    with pytest.raises(ProjectionError, match=r"mirrors a part of the region.*keep north"):
        correct(lambda lon, lat: (1e5 * np.abs(lon), 1e5 * lat), "box:-30,-20,40,20", keep_north=False)


@each("base", ["mollweide", "EPSG:3035", "EPSG:2264", "EPSG:27561"])
def test_exports(base):
    """pyproj runs the pipeline with the map's own coordinates to 1e-9 m, back too, and the WKT2 to its 15 digits."""
    region = {"EPSG:2264": "box:-84,34,-76,36", "EPSG:27561": "box:0,48,6,51"}.get(base, GERMANY)
    result = correct(base, region)
    lon, lat = np.linspace(6.0, 14.0, 5) - (90.0 if base == "EPSG:2264" else 4.0), np.linspace(35.0, 36.0, 5) + 13.0
    truth = np.array(result.corrected(lon, lat))
    transformer = Transformer.from_pipeline(result.pipeline)
    found = transformer.transform(lon, lat)
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-9)
    np.testing.assert_allclose(transformer.transform(*found, direction="INVERSE"), [lon, lat], rtol=0, atol=1e-7)
    assert CRS.from_wkt(result.wkt).type_name == "Derived Projected CRS"
    np.testing.assert_allclose(Projection.from_user_input(result.wkt)(lon, lat), truth, rtol=0, atol=5e-8)


def test_results_are_values():
    """A correction can be pickled and written; its numbers are those of its matrix; what has no CRS says why."""
    # Its region is the area of use of a CRS, the globe of other maps.
    assert correct("EPSG:2056").region.bounds == pytest.approx(CRS("EPSG:2056").area_of_use.bounds)
    assert correct("moll").region.name == "globe"
    function = correct(lambda lon, lat: (1e5 * lon, 1e5 * lat), GERMANY)
    assert (function.wkt, function.pipeline, function.parameters) == (None, None, None)
    assert "function" in function.wkt_reason
    result = correct("winkel-tripel", GERMANY)
    assert pickle.loads(pickle.dumps(result)).to_dict() == result.to_dict()
    data = json.loads(result.to_json())
    assert data == result.to_dict()
    M, azimuth = np.array(data["matrix"]), math.radians(data["stretch_azimuth"])
    a, b = np.linalg.svd(M, compute_uv=False)
    assert (data["scale"], data["stretch"]) == pytest.approx((math.sqrt(a * b), a / b), rel=1e-12)
    assert np.linalg.norm(M @ [math.sin(azimuth), math.cos(azimuth)]) == pytest.approx(a, rel=1e-12)
    # In words an axis has two azimuths, 180 degrees apart.
    words = {0.0: "the vertical", 180.0 - 1e-12: "the vertical", 90.0: "the horizontal", 90.0 - 1e-12: "the horizontal"}
    words |= {azimuth: f"azimuth {azimuth:g} of the map" for azimuth in (45.0, 135.5)}
    assert {azimuth: _direction(azimuth) for azimuth in words} == {key: f"along {text}" for key, text in words.items()}


@each("call, words, message", [
    (correct, {"constraint": "x"}, r"^Invalid constraint 'x'\. It must be one of affine, stretch, scale\.$"),
    (correct, {"region": "nowhere"}, "Invalid region"), (correct, {"criterion": "mode"}, "criterion of a correction"),
    (correct, {"criterion": "median", "constraint": "scale"}, "^Invalid constraint 'scale' with the median"),
    *((local_corrections, {"radius_km": km}, r"^Invalid radius '.*'\. It must be above 0 and at most 10,000 km\.$")
      for km in (0.0, -1.0, 10_001.0, np.nan)),  # not of half the globe
    *((call, {"projection": "nosuch"}, "^Invalid projection 'nosuch'") for call in (correct, local_corrections)),
])  # fmt: skip
def test_refused(call, words, message):
    place = {"lon": 0.0, "lat": 0.0, "radius_km": 10.0} if call is local_corrections else {}
    refuses(message, call, **{"projection": "robin", **place} | words)


def symmetric_inverse(A):
    """(A A^T)^-1/2."""
    U, scales, _ = np.linalg.svd(A)
    return (U / scales) @ U.T


LARGE = [(name, 2000.0, 1e-6) for name in ("mollweide", "winkel-tripel", "EPSG:3035")]
SMALL = [(name, 200.0, 1e-11) for name, *_ in LARGE]


@pytest.mark.slow
@each("name, radius, good", [*LARGE, *SMALL, ("IAU_2015:49976", 100.0, 1e-11)])
def test_caps(name, radius, good):
    """The correction about a point is that of the cap about it, by the adaptive cubature; on Mars of its geodesics."""
    found = local_corrections(name, 10.0, 50.0, radius).matrix
    truth = symmetric_inverse(np.linalg.inv(correct(name, f"cap:10,50,{radius}").matrix))
    np.testing.assert_allclose(found, truth, atol=good)


def test_conformal_maps_and_edges():
    """About the poles of two stereographic maps, and elsewhere at the limit, the correction is 1/k."""
    field = local_corrections("+proj=stere +lat_0=90 +R=6371008.7714", 0.0, [90.0, 50.0], 1.0)
    np.testing.assert_allclose(field.parts.scale, [1.0, 0.5 * (1.0 + np.sin(np.radians(50.0)))], rtol=1e-7)
    np.testing.assert_allclose(field.parts.stretch, 1.0, atol=1e-7)
    # Where less than half of a cap is on the map there is no correction; elsewhere the rest of it counts.
    field = local_corrections("ortho", [0.0, 80.0, 95.0], 0.0, 1500.0)
    assert np.isfinite(field.matrix).all(axis=(1, 2)).tolist() == [True, True, False]
    assert np.isnan(local_corrections("robin", 0.0, [91.0, -95.0], 100.0).matrix).all()  # beyond a pole
    row = json.loads(field.to_json())["results"][2]
    assert (row.pop("lon"), row.pop("lat"), set(row.values())) == (95.0, 0.0, {None})
    pytest.importorskip("pandas")
    assert field.to_frame()["scale"].isna().tolist() == [False, False, True]


# Caps with an antipode, a seam, an edge, a pole line, a pole of infinite scale, and a smooth one.
HARD = [("laea", 170, 0, 1000), ("igh", -40, 40, 300), ("ortho", 80, 0, 1500), ("robin", 0, 88, 500)]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lon", "lat", "radius"), [*HARD, ("merc", 0, 90, 500), ("moll", 10, 50, 2000)])
def test_error_estimates(name, lon, lat, radius):
    field = local_corrections(name, lon, lat, radius)
    truth = np.linalg.inv(correct(name, f"cap:{lon},{lat},{radius}").matrix)
    assert 0.5 * factor_distance(np.linalg.inv(field.matrix), truth) <= 2.0 * field.error


def test_the_error_is_the_largest_change_with_fewer_nodes():
    """Half of the azimuths, the other half, three of five rings: each makes a correction of its own."""
    found, radius = local_corrections("mollweide", 60.0, 40.0, 3000.0), 3000e3 / MEAN_EARTH_RADIUS
    t, gauss = np.polynomial.legendre.leggauss(5)
    rings = np.degrees(2.0 * np.arcsin(np.sqrt(0.5 * (1.0 + t)) * np.sin(0.5 * radius)))
    lon, lat = destination(60.0, 40.0, 30.0 * np.arange(12), rings[:, None])
    J, area = jacobian("mollweide", lon, lat), np.multiply.reduce(SPHERE.radii(lat))
    # The weights of t[0], 0 and t[4] = -t[0] that integrate 1 and t^2 from -1 to 1.
    outer = 1.0 / (3.0 * t[0] ** 2)
    fewer = np.zeros(5)
    fewer[[0, 2, 4]] = outer, 2.0 - 2.0 * outer, outer
    even = np.arange(12) % 2 == 0

    def corrected(along, around):
        weights = np.outer(along, around) * area
        return mdt(J[weights != 0], weights[weights != 0]).T

    whole = corrected(gauss, np.ones(12))
    np.testing.assert_allclose(found.matrix, symmetric_inverse(whole), rtol=1e-12)
    others = [corrected(gauss, even), corrected(gauss, ~even), corrected(fewer, np.ones(12))]
    changes = [0.5 * float(factor_distance(whole, other)) for other in others]
    assert max(changes) > 1.5 * min(changes)
    assert found.error == pytest.approx(max(changes), rel=1e-9)
