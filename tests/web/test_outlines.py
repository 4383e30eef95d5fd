"""Lines and areas of frames."""

import functools

import numpy as np
import shapely

from projdist.web.frames import Grid, _rings_around, _simplified


def test_rings_are_around_what_polygons_cover() -> None:
    """Squares of a chessboard with holes, that touch at edges and corners and turn either way: GEOS's union of them."""
    rng = np.random.default_rng(3)
    corners = np.argwhere(rng.random((30, 30)) < 0.6).astype(float)
    squares = [corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[:: rng.choice([-1, 1])] for corner in corners]
    rings = list(_rings_around(squares, Grid(0.0, 0.0, 1.0)))
    assert all((ring[0] == ring[-1]).all() for ring in rings)
    steps = sum(len(ring) - 1 for ring in rings)
    union = shapely.union_all([shapely.polygons(square) for square in squares])
    assert steps == shapely.length(union)
    # By even and odd, as a page fills it; a ring that touches itself is made valid so.
    by_parity = functools.reduce(shapely.symmetric_difference, [shapely.make_valid(shapely.polygons(r)) for r in rings])
    assert shapely.area(shapely.symmetric_difference(by_parity, union)) == 0.0


def test_what_lies_upon_each_other_has_closed_rings() -> None:
    """A square that is there twice beside one that is not: an edge between them is left, and two about the former."""
    squares = [np.array([[x, 0], [x + 1, 0], [x + 1, 1], [x, 1]], dtype=float) for x in (0.0, 0.0, 1.0)]
    rings = list(_rings_around(squares, Grid(0.0, 0.0, 1.0)))
    assert all((ring[0] == ring[-1]).all() for ring in rings)
    assert sum(len(ring) - 1 for ring in rings) == 2 * 3 + 1 + 3


def test_the_smallest_islands_are_dots() -> None:
    """A line of no length is not drawn: what is smaller than a quarter of a pixel keeps some."""
    ring = 500.0 + np.array([[0, 0], [5, 0], [5, 5], [0, 0]])
    (line,) = _simplified([ring], Grid(0.0, 0.0, 1.0), shapely.box(0, 0, 1000, 1000))
    assert 0.0 < np.ptp(line, axis=0).max() <= 5.0
