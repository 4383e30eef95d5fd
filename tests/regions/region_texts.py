"""What texts of regions stand for, what is said of those that stand for none, rectangles, and areas of geodesics."""

import numpy as np
import pyproj
import pytest

from projdist.regions import get_region

GEOD = pyproj.Geod(ellps="WGS84")


def refused(text):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 the texts are compared
        get_region(text)
    return str(caught.value)


def area(text):
    return get_region(text).area_km2


def square(west, south, east, north):
    """The corners of a rectangle in degrees, the first one twice."""
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def geodesic_area(*rings):
    """GeographicLib's area in km2 of a shell less its holes."""
    shell, *holes = (abs(GEOD.polygon_area_perimeter(*np.transpose(ring).astype(float))[0]) / 1e6 for ring in rings)
    return shell - sum(holes)
