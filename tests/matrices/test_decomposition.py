"""The parts of a linear map of the plane, against maps made of known parts."""

import numpy as np
import pytest
from tables import each

from projdist.matrices.measures import decompose


def turn(clockwise):
    """The matrix that turns by degrees clockwise."""
    c, s = np.cos(np.radians(clockwise)), np.sin(np.radians(clockwise))
    return np.array([[c, s], [-s, c]])


@each("azimuth", [0.0, 30.0, 90.0, 135.0, 179.0])
@each("rotation", [0.0, 25.0, -160.0])
def test_stretch(azimuth, rotation):
    """A stretch along an azimuth, a scale and a turn after it are told apart."""
    stretch = turn(azimuth) @ np.diag([1.0, 1.5]) @ turn(azimuth).T
    parts = decompose(0.3 * turn(rotation) @ stretch)
    assert parts.scale == pytest.approx(0.3 * np.sqrt(1.5), rel=1e-14)
    assert parts.stretch == pytest.approx(1.5, rel=1e-14)
    assert parts.stretch_azimuth == pytest.approx(azimuth, abs=1e-12)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_shear_and_rotation(mirror):
    """The shear is what the axes' images lack to a right angle, the rotation that of the vertical."""
    x, y = turn(20.0 - 70.0) @ [0.0, 1.0], turn(20.0) @ [0.0, 1.0]
    parts = decompose(np.column_stack([-mirror * x, 2.0 * y]))
    assert abs(parts.shear) == pytest.approx(20.0, abs=1e-12)
    assert parts.rotation == pytest.approx(20.0, abs=1e-12)


def test_similarities_have_no_direction():
    """Of a turn and a scale no direction is stretched; what is undefined is NaN."""
    parts = decompose(np.stack([2.0 * turn(33.0), np.full((2, 2), np.nan)]))
    np.testing.assert_allclose(parts.stretch, [1.0, np.nan], rtol=1e-15)
    assert np.isnan(parts.stretch_azimuth).all()
