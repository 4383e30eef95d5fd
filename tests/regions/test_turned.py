"""The globe in a chart about another pole."""

import math

import numpy as np
import pytest

from projdist.earth import WGS84, unit_vectors
from projdist.field.panels import Plan
from projdist.regions import GLOBE, TurnedGlobe

CHARTS = [
    TurnedGlobe(13.0, 45.0),
    TurnedGlobe(-170.0, -20.0, graded=False, widest=90.0),
    TurnedGlobe(90.0, 0.0, widest=90.0),
]


def chart_points(region, n=300):
    """Random chart coordinates of the panels: patch, u, v."""
    rng = np.random.default_rng(4)
    number, rectangles = region.panels()
    index = rng.integers(len(number), size=n)
    u0, u1, v0, v1 = rectangles[index].T
    return number[index], u0 + (u1 - u0) * rng.uniform(0.01, 0.99, n), v0 + (v1 - v0) * rng.uniform(0.01, 0.99, n)


@pytest.mark.parametrize("region", CHARTS, ids=str)
def test_places_of_the_chart(region):
    """Points at a distance from the pole lie on that circle, those of its meridian 0 towards the south."""
    v = np.array([80.0, 45.0, -30.0])
    points = region.chart(np.zeros(3, dtype=int), np.array([12.0, 100.0, -150.0]), v)
    pole = unit_vectors(region.lon, region.lat)
    cosine = np.tensordot(pole, unit_vectors(points.lon, points.lat), 1)
    np.testing.assert_allclose(cosine, np.sin(np.radians(v)), atol=1e-14)
    south = region.chart(np.zeros(1, dtype=int), np.zeros(1), np.array([89.0]))
    assert south.lat[0] == pytest.approx(region.lat - 1.0, abs=1e-9)
    assert math.cos(math.radians(south.lon[0] - region.lon)) == pytest.approx(1.0)


@pytest.mark.parametrize("region", CHARTS, ids=str)
def test_frame_of_the_chart(region):
    """The velocities are those of the points on the sphere, by central differences."""
    patch, u, v = chart_points(region)
    points = region.chart(patch, u, v)
    lam, phi = np.radians(points.lon), np.radians(points.lat)
    east = np.stack([-np.sin(lam), np.cos(lam), np.zeros_like(lam)])
    north = np.stack([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
    step = 1e-4
    for du, dv, to_east, to_north in ((1, 0, points.east_u, points.north_u), (0, 1, points.east_v, points.north_v)):
        after, before = (region.chart(patch, u + way * du * step, v + way * dv * step) for way in (1.0, -1.0))
        moved = (unit_vectors(after.lon, after.lat) - unit_vectors(before.lon, before.lat)) / (2.0 * step)
        np.testing.assert_allclose((moved * east).sum(axis=0), to_east, atol=1e-9)
        np.testing.assert_allclose((moved * north).sum(axis=0), to_north, atol=1e-9)


@pytest.mark.parametrize("region", CHARTS, ids=str)
def test_it_is_the_globe(region):
    """Its panels have the area of the ellipsoid, and it is called the same."""
    layout = Plan(region, WGS84).first(GLOBE.panels.__defaults__[0]).layout
    assert layout.area.sum() == pytest.approx(WGS84.area, rel=1e-9)
    assert (region.name, region.bounds, region.area_km2) == (GLOBE.name, GLOBE.bounds, GLOBE.area_km2)
    assert region.contains([0.0, 170.0], [90.0, -3.0]).all()
