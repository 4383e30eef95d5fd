"""What texts of regions stand for, what is said of those that stand for none, and rings of rectangles."""

import pytest

from projdist.regions import get_region


def refused(text):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 the texts are compared
        get_region(text)
    return str(caught.value)


def area(text):
    return get_region(text).area_km2


def square(west, south, east, north):
    """The corners of a rectangle in degrees, the first one twice."""
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]
