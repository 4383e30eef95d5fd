"""What is laid once for a region serves all maps of it."""

import numpy as np
import pytest

from projdist.answers.summaries import summarize
from projdist.earth import SMOOTH, SPHERE
from projdist.field import panels
from projdist.field.at_points import jacobian
from projdist.field.panels import Plan, plan_of
from projdist.field.sampling import field_resolving
from projdist.projections import Projection
from projdist.regions import GLOBE, Box, Cap, Polygons, get_region

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
        plan.first(SMOOTH._replace(parallels=(float(k),)))
        plan_of(Box(0.0, 0.0, 1.0 + k, 10.0), SPHERE)
    assert len(plan._first) <= panels._WAYS
    assert plan_of.cache_info().currsize <= panels._REGIONS


def test_layouts_cannot_be_changed():
    """They are those of other maps, too."""
    with pytest.raises(ValueError, match="read-only"):
        plan_of(GLOBE, SPHERE).first(SMOOTH).layout.lon[0] = 0.0
