"""Points near CRSs, and coordinates compared."""

import numpy as np
import pytest

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS
from projdist.projections import Projection, ProjectionError

R = MEAN_EARTH_RADIUS
LON = np.array([-179.0, -71.3, 0.0, 4.9, 10.0, 133.7])
LAT = np.array([-33.9, 42.0, 0.0, 52.4, -89.0, 60.0])

# Points near the European and world CRSs of this module.
EUROPE = np.array([4.9, 9.0, 13.4, 16.6]), np.array([52.4, 48.0, 52.5, 49.2])


# The same arithmetic done in a different order: a nanometre or two of 1e7 m.
SAME = 1e-8


def mostly_slow(cases, every):
    """One case in so many, and the others for the slow leg."""
    slow = pytest.mark.slow
    rows = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*row, marks=[slow] if k % every else []) for k, row in enumerate(rows)]


def make(value):
    return Projection.from_user_input(value)


def assert_same(projection, truth, lon=LON, lat=LAT, atol=SAME):
    """The projections agree in metres, at points and in what they leave out."""
    np.testing.assert_allclose(projection(lon, lat), truth(lon, lat), rtol=0, atol=atol)


def mercator(lon, lat):
    """Snyder 1987, 7-1 and 7-2, on the sphere of the mean radius."""
    return R * np.radians(lon), R * np.log(np.tan(np.pi / 4 + np.radians(lat) / 2))


def refusal(function, *args, **words):
    """The one line of a ProjectionError."""
    with pytest.raises(ProjectionError, match=r"^Invalid [^\n]*$") as error:
        function(*args, **words)
    return str(error.value)


def message(value):
    return refusal(make, value)
