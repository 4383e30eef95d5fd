"""Places of nodes on a base."""

import numpy as np

from projdist.designs.base_maps import base_nodes_of
from projdist.earth import WGS84
from projdist.field import nodes_at
from projdist.projections import Projection

EASTWARD = "+proj=omerc +ellps=WGS84 +lonc=-77.8001878 +lat_0=40.9786859 +alpha=-88.7040587 +k_0=0.9998767783"
STRIP = -79.77593281  # degrees east: of the metre that PROJ throws 20,000 km away
METRE = 1.0 / 82481.0  # degrees of longitude at the latitude 42.265


def test_strip_of_an_oblique_mercator_is_where_its_neighbours_are() -> None:
    """A corner of Pennsylvania lies on it; a place a hundred metres east is a hundred metres away."""
    base = Projection.from_user_input(EASTWARD)
    lon, lat = np.array([STRIP, STRIP + 100.0 * METRE, -77.0]), np.array([42.265, 42.265, 41.0])
    assert np.ptp(base(lon, lat)[0]) > 1e7  # mended in PROJ, this test may go, and what it tests
    base_nodes = base_nodes_of(base, nodes_at(lon, lat, np.array([0.0, 0.5, 0.5]), WGS84), None)
    np.testing.assert_allclose(np.hypot(np.diff(base_nodes.x), np.diff(base_nodes.y))[0], 100.0, rtol=1e-3)
