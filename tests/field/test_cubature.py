"""The Airy-Kavrayskiy errors against closed forms, over globe, boxes and caps; what serves all maps of a region."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cubature_cases import SMOOTH, TOLERANCES, TORN, summary_of, triple, truth_of
from tables import each

from projdist import earth
from projdist.answers.summaries import summarize
from projdist.earth import SPHERE
from projdist.field import panels
from projdist.field.at_points import jacobian
from projdist.field.panels import Plan, plan_of
from projdist.field.sampling import DEFAULT_TOLERANCE, field_resolving
from projdist.field.stencils import hessian
from projdist.matrices.flexion import flexion
from projdist.matrices.measures import get_measure
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, PointSet, get_region
from projdist.regions.polygons import Polygons

# ---- the errors and their estimates -----------------------------------------------------------

ROUNDING = 1e-12  # of sums over 10^5 nodes, on either side


def marks(case):
    """Slow where a singular point or a seam off the panels' sides makes a case cost a good part of a second."""
    is_slow = case in TORN or case.id.endswith(("-equatorial", "-oblique")) or case.id == "stere-polar"
    return [pytest.mark.slow] if is_slow else []


CASES = [pytest.param(case, tolerance, marks=marks(case)) for case in SMOOTH + TORN for tolerance in TOLERANCES]


@each(("case", "tolerance"), CASES)
def test_errors_and_their_estimates(case, tolerance):
    """The errors differ from the truth by three estimates at most, and these are the tolerance, or PROJ's floor.

    The estimate of the affine error, which is not steered by, is twice the tolerance.
    """
    found = summary_of(case.id, tolerance)
    np.testing.assert_allclose(triple(found), truth_of(case.id), rtol=0, atol=3 * found.error_estimate + ROUNDING)
    assert found.error_estimate <= max(2 * tolerance, case.floor)
    assert found.limit in ("", "rounding")
    if found.limit == "":
        assert found.error_estimate <= 2 * tolerance
    assert found.coverage == pytest.approx(1.0, abs=1e-9)


@each("case", [pytest.param(case, marks=marks(case)) for case in SMOOTH + TORN])
def test_accuracy_by_default(case):
    """Without a tolerance smooth maps are right to 1e-8, interrupted and oblique ones to 1e-6 (PROJ's floors apart)."""
    atol = max(1e-8 if case in SMOOTH else 1e-6, case.floor)
    np.testing.assert_allclose(triple(summary_of(case.id, DEFAULT_TOLERANCE)), truth_of(case.id), rtol=0, atol=atol)


# ---- second derivatives -----------------------------------------------------------------------


CHARTED = [("+proj=wintri +R=6371000", "box:-60,-50,70,60"), ("+proj=merc +ellps=bessel", "cap:10,50,3000")]


@each(("projection", "region"), [*CHARTED, ("+proj=stere +lat_0=90 +ellps=WGS84", "cap:5,70,900")])
def test_second_derivatives_at_the_nodes(projection, region):
    """H from the panels, if asked for, is that of stencils along geodesics, in any chart and on ellipsoids."""
    projection = Projection.from_user_input(projection)
    assert field_resolving(projection, get_region(region), tolerance=1e-3).hessian is None  # it costs memory
    found = field_resolving(projection, get_region(region), second_order=[flexion])
    truth = hessian(projection, found.lon, found.lat)
    # Stencils are good to 1e-8; panels are refined for the mean of the flexion to 1e-5, nodes at their ends less.
    np.testing.assert_allclose(found.hessian, truth, atol=2e-4)


def test_second_derivatives_at_points():
    """Over points with weights the mean flexion of Mercator's map is that of 2 / pi tan(lat)."""
    points = PointSet(np.array([10.0, 20.0]), np.array([45.0, 60.0]), np.array([1.0, 3.0]))
    found = summarize("mercator", points, measures=["flexion"]).measures["flexion"].mean
    assert found == pytest.approx(2 / math.pi * (1 + 3 * math.sqrt(3)) / 4, abs=1e-7)


def test_what_is_not_known_counts_in_the_error():
    """A constant over panels of which a part is not known, or undefined, is off by that part at most; more is NaN."""
    found = field_resolving(Projection.from_user_input("mercator"), get_region("box:0,0,40,40"), tolerance=1e-3)
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


@pytest.mark.parametrize("region", ["country:PL", "country:UA", "country:CL@main"])
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


# ---- what is laid once for a region ------------------------------------------------------------


REGIONS = {
    "globe": GLOBE,
    "box": Box(170.0, 20.0, -150.0, 88.0),
    "cap": Cap(10.0, 50.0, 3000.0),
    "country": get_region("country:NO"),
}
of_regions = pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)


@pytest.fixture
def charted(monkeypatch):
    """How many points charts were asked for."""
    counts = []
    for kind in (Box, Cap, Polygons):

        def chart(self, patch, u, v, usual=kind.__dict__["chart"]):
            counts.append(np.size(u))
            return usual.__get__(self)(patch, u, v)  # a static method or not

        monkeypatch.setattr(kind, "chart", chart)
    return counts


@of_regions
def test_the_second_map_of_a_region_lays_nothing(region, charted):
    """The same map again asks for no chart, nor does another that needs no finer panels."""
    plan_of.cache_clear()
    first = summarize("moll", region, tolerance=1e-4)
    assert sum(charted) > 0
    charted.clear()
    again = summarize("moll", region, tolerance=1e-4)
    other = summarize("sinu", region, tolerance=1e-2)
    assert charted == []
    assert again.airy_kavrayskiy == first.airy_kavrayskiy
    assert other.airy_kavrayskiy != first.airy_kavrayskiy


@of_regions
def test_a_plan_changes_no_figure(region, monkeypatch):
    """With a new plan each time the samples are the same to the last bit."""
    chosen = [Projection.from_user_input(name) for name in ("robin", "mercator", "bonne +lat_1=40")]
    kept = [field_resolving(projection, region, tolerance=1e-6) for projection in chosen]
    monkeypatch.setattr(panels, "plan_of", Plan)
    for projection, one in zip(chosen, kept, strict=True):
        alone = field_resolving(projection, region, tolerance=1e-6)
        np.testing.assert_array_equal(one.jacobian, alone.jacobian)
        np.testing.assert_array_equal(one.weight, alone.weight)
        assert one.evaluations == alone.evaluations


def test_equal_regions_have_one_plan():
    """A region that equals one measured before, as a worker has it, is cut along the edge of a map as that is."""
    first, second = (Polygons(get_region("country:AQ").geometry, "Antarctica") for _ in range(2))
    one, other = (field_resolving(Projection.from_user_input("EPSG:8858"), region) for region in (first, second))
    assert first is not second
    np.testing.assert_array_equal(one.jacobian, other.jacobian)


@of_regions
def test_jacobians_of_layouts(region):
    """J from a layout's nodes and sides agrees with stencils about the nodes, which know of no layout."""
    projection = Projection.from_user_input("wintri")
    found = field_resolving(projection, region, tolerance=1e-9)
    inside = (np.abs(found.lat) < 85.0) & (np.abs((found.lon + 180.0) % 360.0 - 180.0) < 179.0)
    truth = jacobian(projection, found.lon[inside], found.lat[inside])
    np.testing.assert_allclose(found.jacobian[inside], truth, atol=2e-6)


@pytest.mark.slow
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


def test_layouts_cannot_be_changed():
    """They are those of other maps, too."""
    with pytest.raises(ValueError, match="read-only"):
        plan_of(GLOBE, SPHERE).first(earth.SMOOTH).layout.lon[0] = 0.0
