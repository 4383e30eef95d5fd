"""The Airy-Kavrayskiy errors against closed forms, and what is told of them; what serves all maps of a region."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from closed_errors import ASPECTS, CASES, FLOORS, TOLERANCES, TORN, R, summary_of, triple, truth_of
from jacobians import recorded
from tables import each

from projdist import earth, field_of, hessian, jacobian
from projdist.answers.summaries import summarize
from projdist.earth import SPHERE
from projdist.field import panels, sample
from projdist.field.panels import Plan, plan_of
from projdist.field.sampling import DEFAULT_TOLERANCE, field_resolving
from projdist.matrices.measures import get_measure
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, PointSet, get_region
from projdist.regions.polygons import Polygons

SLOW = pytest.mark.slow
REGIONS = [GLOBE, Box(170.0, 20.0, -150.0, 88.0), Cap(10.0, 50.0, 3000.0), get_region("country:NO")]
CHARTED = [("+proj=wintri +R=6371000", "box:-60,-50,70,60"), ("+proj=merc +ellps=bessel", "cap:10,50,3000")]
CHARTED += [("+proj=stere +lat_0=90 +ellps=WGS84", "cap:5,70,900")]
ROUNDING = 1e-12  # of sums over 10^5 nodes, on either side


@pytest.mark.slow
@each(("case_id", "tolerance"), itertools.product(CASES, TOLERANCES))
def test_errors_and_their_estimates(case_id, tolerance):
    """The errors differ from the truth by three estimates at most, and these are the tolerance, or PROJ's floor."""
    found, truth, floor = summary_of(case_id, tolerance), truth_of(case_id), FLOORS.get(case_id, 0.0)
    np.testing.assert_allclose(triple(found), truth, rtol=0, atol=3 * found.error_estimate + ROUNDING)
    # The estimate of the affine error, which is not steered by, is twice the tolerance.
    assert found.error_estimate <= max(2 * tolerance, floor if found.limit == "rounding" else 0.0)
    assert found.limit in ("", "rounding")
    assert found.coverage == pytest.approx(1.0, abs=1e-9)
    if tolerance == DEFAULT_TOLERANCE:  # then smooth maps are right to 1e-8, interrupted and oblique ones to 1e-6
        atol = max(1e-6 if CASES[case_id] in TORN else 1e-8, floor)
        np.testing.assert_allclose(triple(found), truth, rtol=0, atol=atol)


@each("name", ["plate-carree", "aitoff", "winkel-tripel"])
def test_the_tolerance_is_honest(name):
    """The error is below a tenth of each tolerance, and a hundred times finer costs less than ten times as much."""
    found = [summary_of(name, tolerance) for tolerance in TOLERANCES]
    for one, tolerance in zip(found, TOLERANCES, strict=True):
        assert np.abs(np.subtract(triple(one), truth_of(name))).max() < 0.1 * tolerance
    for coarse, fine in itertools.pairwise(one.evaluations for one in found):
        assert coarse <= fine < 10 * coarse


# With u = cos c uniform over the hemisphere: ln a + ln b and ln^2 a + ln^2 b in units of ln u and ln^2 u, the least u,
# the error's square, its accuracy. The gnomonic map is cut where |x| + |y| is 1e10 radii: at u = 1e-10 times 4 / pi,
# the mean of |cos| + |sin|.
ENDING = {"ortho": (1, 1, 1e-300, 2, 1e-5), "gnom": (-3, 5, 4e-10 / math.pi, 10, 1e-3)}


@SLOW
@each("tolerance", TOLERANCES)
@each("aspect", ASPECTS)
@each("name", ENDING)
def test_maps_of_a_hemisphere(name, aspect, tolerance):
    """Orthographic and gnomonic maps of the globe have sqrt(2) and sqrt(10), and a coverage of one half."""
    lon, lat = ASPECTS[aspect]
    log_area, square, edge, known, accuracy = ENDING[name]
    ln = math.log(edge)  # the means of ln u and ln^2 u over u from the edge to 1
    mean, mean_square = -1 - edge * ln / (1 - edge), 2 - edge * (ln * ln - 2 * ln) / (1 - edge)
    raw, scaled = (math.sqrt(square * mean_square - shift) for shift in (0.0, 0.5 * (log_area * mean) ** 2))
    assert raw == pytest.approx(math.sqrt(known), abs=1e-7)
    found = summarize(f"+proj={name} +lon_0={lon} +lat_0={lat} +R={R}", tolerance=tolerance)
    # By symmetry the best linear map is a uniform scale.
    off = np.abs(np.subtract(triple(found), (raw, scaled, scaled)))
    assert off.max() <= min(3 * found.error_estimate + 1e-9, accuracy)
    assert found.coverage == pytest.approx(0.5, abs=1e-7)
    if name == "ortho" and aspect == "equatorial":  # the horizon is the meridian 90 E: of 60 degrees 15 lie beyond it
        found = summarize(f"+proj=ortho +R={R}", "box:45,-30,105,30", tolerance=1e-6)
        assert found.coverage == pytest.approx(0.75, abs=1e-8)


@each("region", REGIONS[:3])
def test_evaluations(region):
    plate_carree, calls = recorded(lambda lon, lat: (R * np.radians(lon), R * np.radians(lat)))
    found = field_resolving(Projection.from_function(plate_carree), region, tolerance=1e-6)
    assert found.evaluations == sum(lon.size for lon, _ in calls)


# A budget is not exceeded; where the projection's own rounding forbids the tolerance, the search ends long before it.
LIMITS = [("mercator", {"tolerance": 1e-12, "max_evaluations": 8_000}, "budget", 6_000, 8_000)]
LIMITS += [pytest.param("+proj=laea +R=6371000", {"tolerance": 1e-9}, "rounding", 0, 899_999, marks=SLOW)]


@each(("projection", "given", "limit", "least", "most"), LIMITS)
def test_limits(projection, given, limit, least, most):
    found = field_resolving(Projection.from_user_input(projection), GLOBE, **given)
    assert found.limit == limit
    assert least < found.evaluations <= most


def test_rounding_is_told():
    """PROJ snaps Eckert's fourth map to its pole line, which keeps the error above the tolerance."""
    found = summarize("eckert-4")
    assert found.error_estimate > DEFAULT_TOLERANCE
    assert found.limit == "rounding"


@SLOW
@each("region", ["globe", "box:-10,20,30,70", "cap:0,50,3000", "box:170,-20,-150,5", "cap:30,-90,2000"])
@each("projection", ["mollweide", "EPSG:3395"])
def test_weights_are_areas(projection, region):
    """The weights sum up to the region's true area: on WGS 84 that of the region, on the sphere by its own formula."""
    projection = Projection.from_user_input(projection)
    region = get_region(region, projection.ellipsoid.ground)
    area = float(field_resolving(projection, region, tolerance=1e-4).weight.sum())
    if not projection.ellipsoid.is_sphere:
        truth = region.area_km2 * 1e6
    elif isinstance(region, Cap):
        truth = 2 * math.pi * R**2 * (1 - math.cos(region.radius_km * 1000 / R))
    else:
        west, south, east, north = np.radians(region.bounds)
        truth = R**2 * (east - west) * (math.sin(north) - math.sin(south))
    # PROJ does not map the poles to Mercator's plane; a panel resolves its own area to 1e-9.
    assert area == pytest.approx(truth, rel=1e-9)


@pytest.mark.slow
@each("name", ["moll", "eqearth", "wintri"])
def test_seams_beside_the_first_panels(name):
    """The figure of the globe does not depend on the central meridian."""
    truth, *others = (summarize(f"+proj={name} +R={R} +lon_0={lon}") for lon in (0, 1e-5, 0.3, -1.5, 2.34, 179.9))
    for found in others:
        told = 3.0 * (found.error_estimate + truth.error_estimate)
        assert abs(found.airy_kavrayskiy - truth.airy_kavrayskiy) <= min(told, 2e-8)


@SLOW
@pytest.mark.parametrize("west", [178.5, 179.0, 179.7])
@pytest.mark.parametrize(("name", "good"), [("sinu", 1e-8), ("igh", 1e-6)])
def test_boxes_whose_edge_is_beside_a_seam(name, good, west):
    """A box across a seam has the mean of its parts."""
    sides = ((west, -60.0), (west, 180.0), (-180.0, -60.0))
    whole, *parts = (summarize(name, Box(left, -60.0, right, 60.0)) for left, right in sides)
    areas = np.array([part.region.area_km2 for part in parts])
    square = np.sum(areas * [part.airy_kavrayskiy**2 for part in parts]) / areas.sum()
    assert whole.airy_kavrayskiy == pytest.approx(np.sqrt(square), abs=good)


@each(("projection", "region"), CHARTED)
def test_second_derivatives_at_the_nodes(projection, region):
    """H from the panels, if asked for, is that of stencils along geodesics, in any chart and on ellipsoids."""
    assert sample(projection, region, tolerance=1e-3).hessian is None  # it costs memory
    found = sample(projection, region, measures=["flexion"])
    # Stencils are good to 1e-8; panels are refined for the mean of the flexion to 1e-5, nodes at their ends less.
    np.testing.assert_allclose(found.hessian, hessian(projection, found.lon, found.lat), atol=2e-4)


def test_second_derivatives_at_points():
    """Over points with weights the mean flexion of Mercator's map is that of 2 / pi tan(lat)."""
    points = PointSet(np.array([10.0, 20.0]), np.array([45.0, 60.0]), np.array([1.0, 3.0]))
    J, H = (function("mercator", points.lon, points.lat) for function in (jacobian, hessian))
    for field in (sample("mercator", points, measures=["flexion"]), field_of(J, points.weight, hessian=H)):
        assert field.mean("flexion").value == pytest.approx(2 / math.pi * (1 + 3 * math.sqrt(3)) / 4, abs=1e-7)


def test_what_is_not_known_counts_in_the_error():
    """A constant over panels of which a part is not known, or undefined, is off by that part at most; more is NaN."""
    found = sample("mercator", "box:0,0,40,40", tolerance=1e-3)
    ones, flat = np.ones(found.weight.size), np.zeros(found.weight.size)
    assert found.mean(ones, slope=flat).error < 1e-11
    value, error = replace(found, _undecided=0.01, coverage=0.5).mean(ones, slope=flat)
    assert (value, error) == (pytest.approx(1.0), pytest.approx(0.02, rel=1e-6))
    least = found.weight.argmin()
    ones[least] = np.nan
    assert np.isnan(found.mean(ones, slope=flat)).all()
    share = float(found.weight[least] / found.weight.sum())
    [(value, error)] = found._means([ones.reshape(-1, 10, 10)], [0.0], get_measure("flexion"))
    assert value == pytest.approx(1.0 - share)
    assert error >= share


@pytest.mark.slow
@each("region", ["country:PL", "country:UA", "country:CL@main"])
def test_a_map_that_ends_beside_the_region(region):
    """Within a degree of it, as made maps do, whose polynomials run away: all of the region is covered nevertheless."""
    west, south, east, north = get_region(region).bounds
    lon0, lat0 = 0.5 * (west + east), 0.5 * (south + north)
    whole = Projection.from_user_input(f"+proj=laea +R=6371008.7714 +lat_0={lat0} +lon_0={lon0}")

    def ending(lon, lat):
        inside = (abs(lon - lon0) < 0.5 * (east - west) + 1.0) & (abs(lat - lat0) < 0.5 * (north - south) + 1.0)
        return tuple(np.where(inside, values, np.nan) for values in whole(lon, lat))

    found = summarize(ending, region, tolerance=1e-7)
    assert found.coverage == pytest.approx(1.0, abs=1e-9)
    assert found.airy_kavrayskiy == pytest.approx(summarize(whole, region, tolerance=1e-8).airy_kavrayskiy, abs=2e-7)


@each("region", REGIONS)
def test_the_second_map_of_a_region_lays_nothing(region, monkeypatch):
    """The same map again asks for no chart, nor does another that needs no finer panels."""
    monkeypatch.undo()  # what the region before has patched
    counts = []  # of points that charts were asked for
    for kind in (Box, Cap, Polygons):

        def chart(self, patch, u, v, usual=kind.__dict__["chart"]):
            counts.append(np.size(u))
            return usual.__get__(self)(patch, u, v)  # a static method or not

        monkeypatch.setattr(kind, "chart", chart)
    plan_of.cache_clear()
    first = summarize("moll", region, tolerance=1e-4)
    assert sum(counts) > 0
    counts.clear()
    again = summarize("moll", region, tolerance=1e-4)
    other = summarize("sinu", region, tolerance=1e-2)
    assert counts == []
    assert again.airy_kavrayskiy == first.airy_kavrayskiy != other.airy_kavrayskiy


@pytest.mark.slow
@each("region", REGIONS)
def test_a_plan_changes_no_figure(region, monkeypatch):
    """With a new plan each time the samples are the same to the last bit."""
    for name in ("robin", "mercator", "bonne +lat_1=40"):
        kept = field_resolving(Projection.from_user_input(name), region, tolerance=1e-6)
        with monkeypatch.context() as patch:
            patch.setattr(panels, "plan_of", Plan)
            alone = field_resolving(Projection.from_user_input(name), region, tolerance=1e-6)
        for what in ("jacobian", "weight", "evaluations"):
            np.testing.assert_array_equal(getattr(kept, what), getattr(alone, what))


def test_equal_regions_have_one_plan():
    """A region that equals one measured before, as a worker has it, is cut along the edge of a map as that is."""
    first, second = (Polygons(get_region("country:AQ").geometry, "Antarctica") for _ in range(2))
    one, other = (field_resolving(Projection.from_user_input("EPSG:8858"), region) for region in (first, second))
    np.testing.assert_array_equal(one.jacobian, other.jacobian)
    # Layouts are those of other maps, too, and cannot be changed.
    with pytest.raises(ValueError, match="read-only"):
        plan_of(GLOBE, SPHERE).first(earth.SMOOTH).layout.lon[0] = 0.0


@each("region", REGIONS)
def test_jacobians_of_layouts(region):
    """Nodes lie in their region, and J from a layout's nodes and sides is that of stencils, which know of no layout."""
    found = sample("wintri", region, tolerance=1e-9)
    assert isinstance(region, Polygons) or found.region.contains(found.lon, found.lat).all()
    inside = (np.abs(found.lat) < 85.0) & (np.abs((found.lon + 180.0) % 360.0 - 180.0) < 179.0)
    truth = jacobian("wintri", found.lon[inside], found.lat[inside])
    np.testing.assert_allclose(found.jacobian[inside], truth, atol=2e-6)


@SLOW
def test_a_plan_is_bounded(monkeypatch):
    """However many panels maps need, a plan keeps some, and regions of which there are too many are forgotten."""
    plan_of.cache_clear()
    monkeypatch.setattr(panels, "_MOST", 30)
    projection = Projection.from_user_input("+proj=stere +R=6371008.7714 +lat_0=20")
    region = Box(-180.0, -70.0, 180.0, 90.0)
    few = field_resolving(projection, region, tolerance=1e-4)
    plan = plan_of(region, projection.ellipsoid)
    assert len(few.lon) > 60
    assert 0 < len(plan._kept) <= 30
    monkeypatch.undo()
    plan_of.cache_clear()
    assert field_resolving(projection, region, tolerance=1e-4).evaluations == few.evaluations
    for k in range(30):
        plan.first(earth.SMOOTH._replace(parallels=(float(k),)))
        plan_of(Box(0.0, 0.0, 1.0 + k, 10.0), SPHERE)
    assert len(plan._first) <= panels._WAYS
    assert plan_of.cache_info().currsize <= panels._REGIONS
