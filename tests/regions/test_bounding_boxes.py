"""The narrowest box about boxes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tables import each

from projdist.regions import Box, bounding_box

INTERVALS = st.lists(
    st.tuples(st.floats(-180.0, 180.0), st.floats(0.01, 360.0) | st.floats(0.01, 40.0)), min_size=1, max_size=8
)
ROUNDING = 1e-9  # of a degree, of sums up to 720


@each(
    ("west", "east", "box"),
    [
        ([5.0, 8.0], [6.0, 15.0], (5.0, 15.0)),
        ([177.0, -180.0], [180.0, -178.0], (177.0, -178.0)),
        ([-180.0, 177.0], [-178.0, 180.0], (177.0, -178.0)),
        ([170.0, -10.0], [190.0, 0.0], (170.0, 0.0)),
        ([-180.0], [180.0], (-180.0, 180.0)),
        ([-170.0, -60.0, 60.0], [-50.0, 70.0, 175.0], (-170.0, 175.0)),
        ([10.0], [10.0], (9.995, 10.005)),
    ],
)
def test_known_boxes(west: list[float], east: list[float], box: tuple[float, float]) -> None:
    """The narrowest interval of longitudes, across the antimeridian or not; a point gets a hundredth of a degree."""
    south, north = np.full(len(west), -20.0), np.full(len(west), -15.0)
    assert bounding_box(west, south, east, north).bounds == pytest.approx(Box(box[0], -20.0, box[1], -15.0).bounds)


@given(INTERVALS)
def test_the_narrowest_of_all(intervals: list[tuple[float, float]]) -> None:
    """Against every box that begins where one of the boxes does; some of these lie within others, or go all round."""
    west, width = np.array(intervals).T
    box = bounding_box(west, np.full(west.shape, 10.0), west + width, np.full(west.shape, 20.0))
    reaches = [np.max((west - start) % 360.0 + width) for start in west]
    span = (box.east - box.west) % 360.0 or 360.0
    assert span == pytest.approx(min(360.0, *reaches, 360.0), abs=ROUNDING)
    assert (box.south, box.north) == (10.0, 20.0)


@given(INTERVALS)
def test_it_holds_all_boxes(intervals: list[tuple[float, float]]) -> None:
    """Each begins within it, and reaches no farther than it does."""
    west, width = np.array(intervals).T
    box = bounding_box(west, np.zeros(west.shape), west + width, np.ones(west.shape))
    span = (box.east - box.west) % 360.0 or 360.0
    begins = (west - box.west + ROUNDING) % 360.0 - ROUNDING
    assert np.all(begins + width <= span + 2.0 * ROUNDING) or span == 360.0
