"""Lengths of the cuts of maps, and B of Goldberg & Gott, where they are known."""

import math

import numpy as np
import pytest
from tables import each

from projdist.answers import index_terms
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS, WGS84
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
    degree, moon = HALF / 180.0, np.pi * 1737.4 / 180.0
    assert length("robin", "box:170,-20,-170,10") == pytest.approx(30 * degree, rel=1e-6)
    assert length("robin", "cap:180,30,1000") == pytest.approx(2000.0, rel=0.04)
    assert length("+proj=robin +R=1737400", "box:170,-20,-170,10") == pytest.approx(30 * moon, rel=1e-6)
    assert index_terms.cut_length(Projection.from_user_input("aeqd")) == (0.0, 0.0)
    assert length("robin", "box:170,-20,180,10") == length("robin", "box:-180,-20,-170,10") == 0.0
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


INTERRUPTED = [
    ("robin", "globe", False),
    ("igh", "globe", True),
    pytest.param("igh", "land", True, marks=pytest.mark.slow),
    pytest.param("robin", "land", False, marks=pytest.mark.slow),
    ("igh", "box:0,40,10,50", False),
    ("robin", "box:177,-20,-178,-15", True),
    ("+proj=robin +lon_0=180 +R=6371000", "box:177,-20,-178,-15", False),
]


@each(("projection", "region", "expected"), INTERRUPTED)
def test_interrupted(projection, region, expected):
    """A map of the world may be cut once; one of a region has no need to be."""
    assert is_interrupted(Projection.from_user_input(projection), get_region(region)) is expected


# Where a cut fades out (as cos(lat) - 1 does at the equator), a jump of 5e-6 ends it: 3e-3 to 0.02 radians early.
FADES = 2e-3
EXACT = 1e-6

# A cut from pole to pole is 1/4, from the equator to a pole 1/8.
PARTS = {
    **{f"+proj={name} +R=1": (0.25, EXACT) for name in ("merc", "eqc", "robin", "wintri", "merc +lon_0=73.2")},
    **{f"+proj={name} +R=1": (0.25, FADES) for name in ("hammer", "sinu")},
    **{f"+proj={name} +R=1": (0.0, 0.0) for name in ("laea +lat_0=40", "stere +lat_0=90")},
    # The equator beyond 90 degrees from the central meridian.
    "+proj=cass +R=1": (0.25, EXACT),
    # Besides the antimeridian one cut to the north pole, three to the south pole.
    **{f"+proj={name} +R=1": (0.25 + 4 / 8, FADES) for name in ("igh", "imoll")},
    # Four meridians from the equator to the south pole.
    "+proj=peirce_q +shape=square +R=1": (4 / 8, 1e-4),
    # Besides the antimeridian three meridians at either pole down to sin(lat) = 2/3.
    "+proj=healpix +R=1": (0.25 + 6 * (math.pi / 2 - math.asin(2 / 3)) / (4 * math.pi), FADES),
    # Turned, a map keeps its cuts: a great semicircle that runs along no meridian.
    "+proj=ob_tran +o_proj=eqc +o_lat_p=40 +o_lon_p=20 +lon_0=10 +R=1": (0.25, EXACT),
}


@pytest.mark.slow
@pytest.mark.parametrize("definition", PARTS)
def test_cuts(definition):
    """B is that of the cuts' geometry, as well as they can be seen, and the estimate says how well."""
    found, error = np.array(index_terms.cut_length(Projection.from_user_input(definition))) / (4 * math.pi)
    truth, tolerance = PARTS[definition]
    assert found == pytest.approx(truth, abs=tolerance)
    assert abs(found - truth) <= error + EXACT  # what cells of 1e-7 radians leave out


@each("latitude", [pytest.param(0.0, marks=pytest.mark.slow), 23.456])
def test_two_disks(latitude):
    """Azimuthal maps side by side, cut along a parallel: its length 2 pi cos(latitude), of no great circle."""

    def hemispheres(lon, lat):
        north = lat >= latitude
        c = np.radians(np.where(north, 90 - lat, 90 + lat))
        turn = np.radians(np.where(north, lon, -lon))
        return WGS84.a * (c * np.sin(turn) + np.where(north, 0.0, 10.0)), -WGS84.a * c * np.cos(turn)

    length, error = index_terms.cut_length(Projection.from_user_input(hemispheres))
    truth = 2 * math.pi * math.cos(math.radians(latitude))
    assert length == pytest.approx(truth, abs=3e-6)  # chords and their halves, extrapolated
    assert abs(length - truth) <= error <= 1e-4
