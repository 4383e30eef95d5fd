"""The share of a region that lies in a box, against counts of points, closed forms and combinations."""

import numpy as np
import pytest
from tables import each

from projdist.regions import GLOBE, Box, Cap, PointSet, get_region, share_in

EUROPE = Box(-35.58, 24.6, 44.83, 84.73)
PACIFIC = Box(150, -60, -120, 10)


@each(
    ("box", "region", "share"),
    [
        (Box(0, 0, 90, 90), GLOBE, 1 / 8),
        (Box(-180, -90, 0, 90), GLOBE, 1 / 2),
        (Box(170, 0, -170, 90), Box(0, -90, 180, 90), 10 / 360),
        (Box(170, 0, 190, 90), Box(-190, 0, -175, 90), 1.0),
        (Box(-180, 0, 180, 90), PACIFIC, None),
        (Box(0, -10, 20, 10), Box(170, -10, 10, 10), 10 / 200),  # which is 170 to 370
        (GLOBE, Cap(10, 50, 300), 1.0),
        (Box(10, -90, 100, 90), Cap(10, 50, 300), 1 / 2),  # on either side of its meridian
        (Box(-170, 0, 170, 90), Cap(180, 0, 300), 0.0),
        (Box(0, 60, 90, 90), Cap(30, 90, 2000), 1 / 4),
        (Box(0, 0, 90, 50), Cap(30, 80, 1000), 0.0),
        (EUROPE, get_region("country:DE"), 1.0),
        (EUROPE, get_region("country:FJ"), 0.0),
        (Box(6.0, 40.0, 12.0, 60.0), get_region("country:DE"), None),
        (PACIFIC, get_region("country:FJ"), 1.0),
    ],
)
def test_share(box, region, share):
    """By symmetry, or else of points that are spread evenly over the sphere."""
    found = share_in(box, region)
    if share is None:
        k = np.arange(400_000) + 0.5  # a golden spiral
        lon = np.mod(360.0 * k / ((1 + 5**0.5) / 2), 360.0) - 180.0
        lat = np.degrees(np.arcsin(1 - 2 * k / k.size))
        here = region.contains(lon, lat)
        share = np.mean(box.contains(lon[here], lat[here]))
        assert found == pytest.approx(share, abs=0.02)
    else:
        assert found == pytest.approx(share, abs=1e-5)  # caps are round on the sphere, polygons to 0.1 m


def test_share_of_points_is_that_of_their_weights():
    """Whatever their number."""
    points = PointSet(np.array([0.0, 10.0, 20.0]), np.array([50.0, 50.0, 50.0]), np.array([1.0, 2.0, 5.0]))
    assert share_in(Box(5, 40, 30, 60), points) == 7 / 8


def test_share_of_another_kind_of_region_is_that_of_its_bounds():
    """As of a region that someone has made."""

    class Other:
        bounds = (0.0, -10.0, 20.0, 10.0)

    assert share_in(Box(10, 0, 90, 90), Other()) == pytest.approx(1 / 4)
