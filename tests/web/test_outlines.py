"""Lines and areas of frames."""

import functools

import numpy as np
import shapely

from projdist.web.outlines import Grid, _rings_around


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
