"""Cells that the edge of what is shown crosses."""

import math

import numpy as np
import pytest

from projdist.web.live.previews import cut_cells


def disc(count: int) -> tuple[float, float]:
    """The area and the circumference of a disc of radius 1, on a grid of so many nodes across 3."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, count), np.linspace(-1.5, 1.5, count))
    level = np.hypot(x, y) - 1.0
    cells = np.ones((count - 1, count - 1), dtype=bool)
    found = cut_cells(level, cells)
    z = (x + 1j * y).ravel()
    near, far = found.ends.T
    assert (level.ravel()[near] <= 0.0).all()
    z = np.append(z, z[near] + found.share * (z[far] - z[near]))
    shown = level <= 0.0
    whole = (shown[:-1, :-1] & shown[1:, :-1] & shown[:-1, 1:] & shown[1:, 1:]).sum() * (3.0 / (count - 1)) ** 2
    parts = [z[polygons] for polygons in found.polygons]
    area = whole + sum(0.5 * (part.conj() * np.roll(part, -1, axis=1)).imag.sum() for part in parts)
    return area, np.abs(np.diff(z[count * count + found.sides], axis=1)).sum()


def test_a_disc_has_its_area_and_its_edge() -> None:
    """Polygons with the same sense of turning as cells; what they are off by falls as the square of the step."""
    off = np.array([[abs(area - math.pi), abs(edge - 2.0 * math.pi)] for area, edge in map(disc, (41, 161))])
    assert (off[1] < 1e-3).all()
    assert (off[1] < off[0] / 8.0).all()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_saddles_are_parted(sign: float) -> None:
    """Between two corners across that are shown there is a hexagon; where nothing is parted, there is nothing."""
    level = sign * np.array([[-1.0, 1.0], [1.0, -1.0]])
    found = cut_cells(level, np.ones((1, 1), dtype=bool))
    assert [polygon.shape for polygon in found.polygons] == [(1, 6)]
    assert found.share.tolist() == [0.5] * 4
    assert not cut_cells(np.full((3, 3), sign), np.ones((2, 2), dtype=bool)).polygons
