"""Known figures, maps that end, and what the cubature says of its accuracy."""

import math

import mpmath
import numpy as np
import pytest
from closed_errors import R
from cubature_cases import ASPECTS, TOLERANCES, summary_of, triple, truth_of
from tables import each

from projdist.answers.summaries import summarize
from projdist.earth.ellipsoid import WGS84
from projdist.field.sampling import field_resolving
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, get_region

# ---- known figures ----------------------------------------------------------------------------

L2 = math.log(2)

KNOWN = {  # (raw, scaled, affine) in closed form, None where none is known
    "plate-carree": (math.sqrt(2 - 2 * L2 + L2**2 - math.pi**2 / 12), None, 0.4213466110),
    "mercator": (0.7371453308, 0.5958740917, 0.5958740917),
    "lambert-cylindrical": (0.7371453308, 0.7371453308, 0.5958740917),
    "eckert-4": (0.50701912122, 0.50701912122, None),
    "laea-polar": (1.0, 1.0, 1.0),
    "laea-oblique": (1.0, 1.0, 1.0),
    "stere-polar": (2.0, math.sqrt(2), math.sqrt(2)),
}


@each("case_id", KNOWN)
def test_the_quadrature_of_these_tests(case_id):
    """The truths of this module agree with closed forms and with figures worked out elsewhere to ten digits."""
    for value, known in zip(truth_of(case_id), KNOWN[case_id], strict=True):
        assert known is None or value == pytest.approx(known, abs=1e-10)


def test_the_quadrature_against_mpmath():
    """Two of the truths again with 30 digits: the azimuthal equidistant globe, and the Lambert conformal box."""
    with mpmath.workdps(30):
        square = mpmath.quad(lambda c: mpmath.log(c / mpmath.sin(c)) ** 2 * mpmath.sin(c) / 2, [0, 1, 3, mpmath.pi])
        assert truth_of("aeqd-polar")[0] == pytest.approx(float(mpmath.sqrt(square)), abs=1e-12)

        def box(phi):
            e2 = mpmath.mpf(WGS84.f) * (2 - mpmath.mpf(WGS84.f))
            e = mpmath.sqrt(e2)

            def m(p):
                return mpmath.cos(p) / mpmath.sqrt(1 - e2 * mpmath.sin(p) ** 2)

            def t(p):
                es = e * mpmath.sin(p)
                return mpmath.tan(mpmath.pi / 4 - p / 2) / ((1 - es) / (1 + es)) ** (e / 2)

            one, two = mpmath.radians(33), mpmath.radians(45)
            n = mpmath.log(m(one) / m(two)) / mpmath.log(t(one) / t(two))
            k = m(one) * (t(phi) / t(one)) ** n / m(phi)
            weight = mpmath.cos(phi) / (1 - e2 * mpmath.sin(phi) ** 2) ** 2
            return 2 * mpmath.log(k) ** 2 * weight, weight

        limits = [mpmath.radians(25), mpmath.radians(50)]
        top, bottom = (mpmath.quad(lambda phi, i=i: box(phi)[i], limits) for i in (0, 1))
        assert truth_of("lcc-wgs84-box")[0] == pytest.approx(float(mpmath.sqrt(top / bottom)), abs=1e-13)


@each("name", ["plate-carree", "natural-earth", "winkel-tripel"])
def test_the_tolerance_is_honest(name):
    """The error is below a tenth of each tolerance, and a hundred times finer costs less than ten times as much."""
    errors, costs = [], []
    for tolerance in TOLERANCES:
        found = summary_of(name, tolerance)
        errors.append(max(abs(v - t) for v, t in zip(triple(found), truth_of(name), strict=True)))
        costs.append(found.evaluations)
    assert all(error < 0.1 * tolerance for error, tolerance in zip(errors, TOLERANCES, strict=True))
    for coarse, fine in ((0, 1), (1, 2)):
        assert costs[coarse] <= costs[fine] < 10 * costs[coarse]


# ---- maps that end ----------------------------------------------------------------------------


def logs_beyond(edge):
    """The means of ln u and ln^2 u over u from `edge` to 1."""
    ln = math.log(edge)
    return -1 - edge * ln / (1 - edge), 2 - edge * (ln * ln - 2 * ln) / (1 - edge)


# With u = cos c uniform over the hemisphere: ln a + ln b and ln^2 a + ln^2 b in units of ln u and ln^2 u.
ENDING = {"ortho": (1, 1, 1e-300), "gnom": (-3, 5, 4e-10 / math.pi)}


# The gnomonic map is cut where |x| + |y| is 1e10 radii: at u = 1e-10 times 4 / pi, the mean of |cos| + |sin|.
ENDING_ACCURACY = {"ortho": 1e-5, "gnom": 1e-3}


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("aspect", ["polar", "equatorial", "oblique"])
@pytest.mark.parametrize("name", ["ortho", "gnom"])
def test_maps_of_a_hemisphere(name, aspect, tolerance):
    """Orthographic and gnomonic maps of the globe have sqrt(2) and sqrt(10), and a coverage of one half."""
    lon, lat = ASPECTS[aspect]
    log_area, square, edge = ENDING[name]
    mean, mean_square = logs_beyond(edge)
    raw = math.sqrt(square * mean_square)
    assert raw == pytest.approx(math.sqrt({"ortho": 2, "gnom": 10}[name]), abs=1e-7)
    scaled = math.sqrt(square * mean_square - 0.5 * (log_area * mean) ** 2)
    found = summarize(f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}", tolerance=tolerance)
    # By symmetry the best linear map is a uniform scale.
    truth = (raw, scaled, scaled)
    np.testing.assert_allclose(triple(found), truth, rtol=0, atol=3 * found.error_estimate + 1e-9)
    np.testing.assert_allclose(triple(found), truth, rtol=0, atol=ENDING_ACCURACY[name])
    assert found.coverage == pytest.approx(0.5, abs=1e-7)


@pytest.mark.slow
def test_coverage_of_a_box():
    """Of a box 60 degrees wide of which 15 lie beyond the horizon three quarters are covered."""
    # The horizon of the equatorial orthographic map about 0 is the meridian 90 E.
    found = summarize(f"+proj=ortho +R={R}", "box:45,-30,105,30", tolerance=1e-6)
    assert found.coverage == pytest.approx(0.75, abs=1e-8)


# ---- what is reported -------------------------------------------------------------------------


@each("region", ["globe", "box:-10,20,30,70", "cap:0,50,3000"])
def test_evaluations(region):
    """`evaluations` is the number of points that were projected."""
    points = []

    def plate_carree(lon, lat):
        points.append(lon.size)
        return R * np.radians(lon), R * np.radians(lat)

    samples = field_resolving(Projection.from_function(plate_carree), get_region(region), tolerance=1e-6)
    assert samples.evaluations == sum(points)


# A budget is not exceeded; where the projection's own rounding forbids the tolerance, the search ends long before it.
LIMITS = [
    ("mercator", {"tolerance": 1e-12, "max_evaluations": 8_000}, "budget", 6_000, 8_000),
    pytest.param("+proj=laea +R=6371000", {"tolerance": 1e-9}, "rounding", 0, 899_999, marks=pytest.mark.slow),
]


@each(("projection", "given", "limit", "least", "most"), LIMITS)
def test_limits(projection, given, limit, least, most):
    """A search that ends before its tolerance is met says why."""
    found = field_resolving(Projection.from_user_input(projection), GLOBE, **given)
    assert found.limit == limit
    assert least < found.evaluations <= most


@pytest.mark.slow
@pytest.mark.parametrize(
    "region", ["globe", "box:-10,20,30,70", "box:170,-20,-150,5", "cap:0,50,3000", "cap:30,-90,2000"]
)
@pytest.mark.parametrize("projection", ["mollweide", "EPSG:3395"])
def test_weights_are_areas(projection, region):
    """The weights sum up to the region's true area: on WGS 84 that of the region, on the sphere by its own formula."""
    projection = Projection.from_user_input(projection)
    region = get_region(region, projection.ellipsoid.ground)
    area = float(field_resolving(projection, region, tolerance=1e-4).weight.sum())
    if projection.ellipsoid.is_sphere:
        if isinstance(region, Box):
            west, south, east, north = np.radians(region.bounds)
            truth = R**2 * (east - west) * (math.sin(north) - math.sin(south))
        else:
            truth = 2 * math.pi * R**2 * (1 - math.cos(region.radius_km * 1000 / R))
    else:
        truth = region.area_km2 * 1e6
    # PROJ does not map the poles to Mercator's plane; a panel resolves its own area to 1e-9.
    assert area == pytest.approx(truth, rel=1e-9)


def test_samples_are_in_the_region():
    """The nodes lie in the region, and J is that of the map there."""
    cap_region = Cap(20, 60, 2000)
    samples = field_resolving(Projection.from_user_input("mercator"), cap_region, tolerance=1e-8)
    assert cap_region.contains(samples.lon, samples.lat).all()
    k = 1 / np.cos(np.radians(samples.lat))
    # Panels are refined until their integrals are good to 1e-8; the derivatives at single nodes are less so.
    np.testing.assert_allclose(samples.jacobian, k[..., None, None] * np.eye(2), atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1.0, 1_737_400.0])
def test_the_size_of_the_globe_does_not_matter(radius):
    """A torn map of the Moon, or of a globe of one metre, has the errors of the Earth's, for the same evaluations."""
    on_earth = summarize(f"+proj=igh +R={R}", tolerance=1e-3)
    found = summarize(f"+proj=igh +R={radius}", tolerance=1e-3)
    assert found.evaluations == on_earth.evaluations
    assert triple(found) == pytest.approx(triple(on_earth), rel=1e-10)


# ---- seams between the last nodes and a side --------------------------------------------------


@each("name", ["moll", "eqearth", "wintri"])
@each("meridian", [1e-5, 0.3, -1.5, 2.34, 179.9])
def test_seams_beside_the_first_panels(name: str, meridian: float) -> None:
    """The figure of the globe does not depend on the central meridian, wherever the seam then is."""
    truth = summarize(f"+proj={name} +R=6371008.7714")
    found = summarize(f"+proj={name} +R=6371008.7714 +lon_0={meridian}")
    error = abs(found.airy_kavrayskiy - truth.airy_kavrayskiy)
    assert error <= 3.0 * (found.error_estimate + truth.error_estimate)
    assert error < 2e-8


@pytest.mark.slow
@pytest.mark.parametrize("west", [178.5, 179.0, 179.7])
@pytest.mark.parametrize(("name", "good"), [("sinu", 1e-8), ("igh", 1e-6)])
def test_boxes_whose_edge_is_beside_a_seam(name: str, good: float, west: float) -> None:
    """A box across a seam has the mean of its parts."""
    whole = summarize(name, Box(west, -60.0, -60.0, 60.0))
    parts = [summarize(name, Box(west, -60.0, 180.0, 60.0)), summarize(name, Box(-180.0, -60.0, -60.0, 60.0))]
    areas = np.array([part.region.area_km2 for part in parts])
    square = np.sum(areas * [part.airy_kavrayskiy**2 for part in parts]) / areas.sum()
    assert whole.airy_kavrayskiy == pytest.approx(np.sqrt(square), abs=good)
