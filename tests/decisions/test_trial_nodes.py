"""The nodes at which candidates are tried."""

import numpy as np
import pytest

from projdist.decisions.measurement import lattice_of, probe_of
from projdist.regions import GLOBE, Box, Cap

REGIONS = [GLOBE, Box(5.9, 47.3, 15.0, 55.1), Box(177, -20, -178, -15), Cap(10, 50, 20), Cap(0, -90, 2000)]


@pytest.mark.parametrize("region", REGIONS, ids=lambda region: region.name)
def test_weights(region):
    """Weights add up to 1, stand for area, and all nodes lie in the region."""
    probe = probe_of(region)
    assert probe.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert region.contains(probe.lon, probe.lat).all()
    assert 60 <= len(probe.lon) <= 400


def test_mean_latitude():
    """The mean of sin(latitude) over a band is the mean of its ends, by Archimedes, but for the flattening."""
    probe = probe_of(Box(0, 20, 40, 60))
    mean = probe.weight @ np.sin(np.radians(probe.lat))
    assert mean == pytest.approx(0.5 * (np.sin(np.radians(20)) + np.sin(np.radians(60))), abs=2e-3)


@pytest.mark.parametrize(
    ("area", "share"),
    [
        ((177, -20, -178, -15), 1.0),
        ((177, -20, 180, -15), 0.6),
        ((-180, -20, -178, -15), 0.4),
        ((-180, -90, 180, 90), 1.0),
        ((0, -20, 10, -15), 0.0),
    ],
)
def test_share_across_the_antimeridian(area, share):
    """Shares of a box that crosses the antimeridian, within areas that do and do not; to half a row of its lattice."""
    lattice = lattice_of(Box(177, -20, -178, -15))
    assert lattice.within([area])[0] @ lattice.weight == pytest.approx(share, abs=0.02)
