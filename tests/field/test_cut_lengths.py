"""Cuts of maps: their length where it is known, and which maps are interrupted."""

import numpy as np
import pytest
from tables import each

from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS
from projdist.field.tears import cut_length, is_interrupted
from projdist.projections import Projection
from projdist.regions import GLOBE, get_region

HALF = np.pi * MEAN_EARTH_RADIUS / 1000.0  # a meridian from pole to pole


def length(projection, region):
    return cut_length(Projection.from_user_input(projection), get_region(region))


# Halves of meridians on the globe. Goode's map has, besides the antimeridian, one cut to the equator in the north and
# three in the south (Snyder 1987, page 250); for the ocean two and three; its halves and the lobes of
# interrupted Mollweide's begin at the equator without a gap, of which up to 9 degrees are not seen.
CUTS = [
    ("robin", 1.0, 1.0),
    ("EPSG:8857", 1.0, 1.0),
    ("+proj=moll +lon_0=71.3 +R=6371000", 1.0, 1.0),
    ("igh", 3.0, 2.8),
    ("imoll", 3.0, 2.7),
    ("+proj=ob_tran +o_proj=moll +o_lat_p=45 +o_lon_p=30 +R=6371000", 1.08, 1.0),
    ("+proj=tmerc +approx +R=6371000", 1.0, 1.0),
    ("+proj=laea +lat_0=50 +lon_0=10 +R=6371000", 0.0, 0.0),
]


@each(("projection", "most", "least"), CUTS)
def test_cuts_of_the_globe(projection, most, least):
    """One meridian for whole maps, in any aspect; azimuthal ones are torn in a point only."""
    assert least * HALF * (1 - 1e-4) <= length(projection, "globe") <= most * HALF * (1 + 1e-4)


def test_cuts_in_regions():
    """What is cut within a region, to a cell: a box across the antimeridian, a cap on it; none on a side."""
    degree = HALF / 180.0
    assert length("robin", "box:170,-20,-170,10") == pytest.approx(30 * degree, rel=1e-6)
    assert length("robin", "cap:180,30,1000") == pytest.approx(2000.0, rel=0.04)
    moon = length("+proj=robin +R=1737400", "box:170,-20,-170,10")
    assert moon == pytest.approx(30 * np.pi * 1737.4 / 180.0, rel=1e-6)
    assert length("robin", "box:170,-20,180,10") == 0.0
    assert length("robin", "box:-180,-20,-170,10") == 0.0
    assert length("EPSG:3460", "box:177,-20,-178,-15") == 0.0
    assert length("igh", "box:-50,40,-30,60") == pytest.approx(20 * degree, rel=1e-6)


def test_a_cut_and_a_half_is_more_than_one():
    """The antimeridian is cut by any map of the world; a meridian from the equator to the pole besides need not be."""

    def lobes(lon, lat):
        lon = np.mod(lon + 180.0, 360.0) - 180.0
        return 1e5 * (lon + np.where(lon > 17.3, np.maximum(lat, 0.0), 0.0)), 1e5 * lat

    projection = Projection.from_user_input(lobes)
    # At the equator the gap begins without a width.
    assert 1.4 * HALF < cut_length(projection, GLOBE) < 1.5 * HALF * (1 + 1e-4)
    assert is_interrupted(projection, GLOBE)


@pytest.mark.parametrize(
    ("projection", "region", "expected"),
    [
        ("robin", "globe", False),
        ("igh", "globe", True),
        pytest.param("igh", "land", True, marks=pytest.mark.slow),
        pytest.param("robin", "land", False, marks=pytest.mark.slow),
        ("igh", "box:0,40,10,50", False),
        ("robin", "box:177,-20,-178,-15", True),
        ("+proj=robin +lon_0=180 +R=6371000", "box:177,-20,-178,-15", False),
    ],
)
def test_interrupted(projection, region, expected):
    """A map of the world may be cut once; one of a region has no need to be."""
    assert is_interrupted(Projection.from_user_input(projection), get_region(region)) is expected
