"""The Airy-Kavrayskiy errors against closed forms, over globe, boxes and caps."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cubature_cases import SMOOTH, TOLERANCES, TORN, summary_of, triple, truth_of
from tables import each

from projdist.answers.summaries import summarize
from projdist.field.sampling import DEFAULT_TOLERANCE, field_resolving
from projdist.field.stencils import hessian
from projdist.matrices.flexion import flexion
from projdist.matrices.measures import get_measure
from projdist.projections import Projection
from projdist.regions import GLOBE, PointSet, get_region

# ---- the errors and their estimates -----------------------------------------------------------

ROUNDING = 1e-12  # of sums over 10^5 nodes, on either side


def is_slow(case):
    """Whether a singular point or a seam off the panels' sides makes a case cost a good part of a second."""
    return case in TORN or case.id.endswith(("-equatorial", "-oblique")) or case.id == "stere-polar"


def cases_with_tolerances():
    """All cases at all tolerances."""
    params = []
    for case in SMOOTH + TORN:
        for tolerance in TOLERANCES:
            marks = [pytest.mark.slow] if is_slow(case) else []
            params.append(pytest.param(case, tolerance, id=f"{case.id}-{tolerance:g}", marks=marks))
    return params


@each(("case", "tolerance"), cases_with_tolerances())
def test_errors_are_within_their_estimate(case, tolerance):
    """The raw, scaled and affine errors differ from the truth by no more than three times the error estimate."""
    found = summary_of(case.id, tolerance)
    np.testing.assert_allclose(triple(found), truth_of(case.id), rtol=0, atol=3 * found.error_estimate + ROUNDING)


@each(("case", "tolerance"), cases_with_tolerances())
def test_estimates_meet_the_tolerance(case, tolerance):
    """The estimate is the tolerance at most, or PROJ's floor; twice for the affine error, which is not steered by."""
    found = summary_of(case.id, tolerance)
    assert found.error_estimate <= max(2 * tolerance, case.floor)
    assert found.limit in ("", "rounding")
    if found.limit == "":
        assert found.error_estimate <= 2 * tolerance
    assert found.coverage == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, id=case.id, marks=[pytest.mark.slow] if is_slow(case) else []) for case in SMOOTH + TORN],
)
def test_accuracy_by_default(case):
    """Without a tolerance smooth maps are right to 1e-8, interrupted and oblique ones to 1e-6 (PROJ's floors apart)."""
    atol = max(1e-8 if case in SMOOTH else 1e-6, case.floor)
    np.testing.assert_allclose(triple(summary_of(case.id, DEFAULT_TOLERANCE)), truth_of(case.id), rtol=0, atol=atol)


# ---- second derivatives -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("projection", "region"),
    [
        ("+proj=wintri +R=6371000", "box:-60,-50,70,60"),
        ("+proj=merc +ellps=bessel", "cap:10,50,3000"),
        ("+proj=stere +lat_0=90 +ellps=WGS84", "cap:5,70,900"),
    ],
)
def test_second_derivatives_at_the_nodes(projection, region):
    """H from the panels agrees with H from stencils along geodesics, in any chart and on ellipsoids."""
    projection = Projection.from_user_input(projection)
    found = field_resolving(projection, get_region(region), second_order=[flexion])
    truth = hessian(projection, found.lon, found.lat)
    # Stencils are good to 1e-8; panels are refined for the mean of the flexion to 1e-5, nodes at their ends less.
    np.testing.assert_allclose(found.hessian, truth, atol=2e-4)


def test_no_second_derivatives_are_kept_unless_asked_for():
    """They cost memory."""
    assert field_resolving(Projection.from_user_input("moll"), GLOBE, tolerance=1e-3).hessian is None


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
