"""Rings of files, made into valid polygons."""

import numpy as np
import pytest

from projdist.earth import even_odd


def test_polygons_beside_lines_are_kept() -> None:
    """A ring that crosses itself and runs out and back along a line: two triangles of area 1."""
    ring = np.array([(0, 0), (2, 2), (2, 0), (3, 0), (2, 0), (0, 2), (0, 0)], dtype=float)
    assert even_odd([ring]).area == pytest.approx(2.0, rel=1e-12)
