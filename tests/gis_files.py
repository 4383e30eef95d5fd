"""What the tests of files for GIS programs share."""

from collections.abc import Iterable

import numpy as np
import pyproj
import pytest


def some_slow(names: Iterable[str], slow: set[str]) -> list[object]:
    """Parameters, some of which only the slow tests take."""
    return [pytest.param(name, marks=pytest.mark.slow) if name in slow else name for name in names]


def greenwich_degrees(crs: pyproj.CRS, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Longitude and latitude from pyproj alone."""
    geodetic = crs.geodetic_crs
    lon, lat = pyproj.Transformer.from_crs(crs, geodetic, always_xy=True).transform(x, y)
    unit = np.degrees(geodetic.axis_info[0].unit_conversion_factor)
    meridian = geodetic.prime_meridian
    offset = np.degrees(meridian.longitude * meridian.unit_conversion_factor)
    return lon * unit + offset, lat * unit
