"""The length of the cuts of maps, B of Goldberg & Gott, against the geometry of their lobes."""

import math

import numpy as np
import pytest

from projdist.answers.index_terms import cut_length
from projdist.answers.published_indices import indices
from projdist.projections import Projection

# Where a cut fades out (as cos(lat) - 1 does at the equator), a jump of 5e-6 ends it: 3e-3 to 0.02 radians early.
FADES = 2e-3
EXACT = 1e-6
R = 6378137.0

# A cut from pole to pole is 1/4, from the equator to a pole 1/8.
CUTS = {
    "+proj=merc +R=1": (0.25, EXACT),
    "+proj=eqc +R=1": (0.25, EXACT),
    "+proj=robin +R=1": (0.25, EXACT),
    "+proj=wintri +R=1": (0.25, EXACT),
    "+proj=hammer +R=1": (0.25, FADES),
    "+proj=sinu +R=1": (0.25, FADES),
    "+proj=aeqd +R=1": (0.0, 0.0),
    "+proj=laea +lat_0=40 +R=1": (0.0, 0.0),
    "+proj=stere +lat_0=90 +R=1": (0.0, 0.0),
    # The equator beyond 90 degrees from the central meridian.
    "+proj=cass +R=1": (0.25, EXACT),
    # Besides the antimeridian one cut to the north pole, three to the south pole.
    "+proj=igh +R=1": (0.25 + 4 / 8, FADES),
    "+proj=imoll +R=1": (0.25 + 4 / 8, FADES),
    # Four meridians from the equator to the south pole.
    "+proj=peirce_q +shape=square +R=1": (4 / 8, 1e-4),
    # Besides the antimeridian three meridians at either pole down to sin(lat) = 2/3.
    "+proj=healpix +R=1": (0.25 + 6 * (math.pi / 2 - math.asin(2 / 3)) / (4 * math.pi), FADES),
    # Turned, a map keeps its cuts: a great semicircle that runs along no meridian.
    "+proj=ob_tran +o_proj=eqc +o_lat_p=40 +o_lon_p=20 +lon_0=10 +R=1": (0.25, EXACT),
    "+proj=merc +lon_0=73.2 +R=1": (0.25, EXACT),
}


@pytest.mark.slow
@pytest.mark.parametrize("definition", CUTS)
def test_cuts(definition):
    """B is that of the cuts' geometry, as well as they can be seen, and the estimate says how well."""
    length, error = cut_length(Projection.from_user_input(definition))
    truth, tolerance = CUTS[definition]
    assert length / (4 * math.pi) == pytest.approx(truth, abs=tolerance)
    # Beside the estimate what cells of 1e-7 radians leave out.
    assert abs(length / (4 * math.pi) - truth) <= error / (4 * math.pi) + EXACT


def hemispheres(latitude):
    """Two azimuthal maps side by side, cut along a parallel."""

    def function(lon, lat):
        north = lat >= latitude
        c = np.radians(np.where(north, 90 - lat, 90 + lat))
        turn = np.radians(np.where(north, lon, -lon))
        return R * (c * np.sin(turn) + np.where(north, 0.0, 10.0)), -R * c * np.cos(turn)

    return function


@pytest.mark.parametrize("latitude", [pytest.param(0.0, marks=pytest.mark.slow), 23.456])
def test_two_disks(latitude):
    """Disks cut along a parallel: its length 2 pi cos(latitude), a curve that is no great circle."""
    length, error = cut_length(Projection.from_user_input(hemispheres(latitude)))
    truth = 2 * math.pi * math.cos(math.radians(latitude))
    # Chords and their halves, extrapolated.
    assert length == pytest.approx(truth, abs=3e-6)
    assert abs(length - truth) <= error <= 1e-4


def test_no_cut():
    """An azimuthal map is torn in one point only."""
    assert cut_length(Projection.from_user_input("aeqd")) == (0.0, 0.0)


@pytest.mark.slow
def test_the_index_is_of_the_globe():
    """B is length over 4 pi; over a box, and on a map of a part of the globe, there is none."""
    assert indices("mercator", names="B")["B"].value == pytest.approx(0.25, abs=EXACT)
    assert math.isnan(indices("mercator", "box:0,0,10,10", "B")["B"].value)
    assert math.isnan(indices("gnomonic", names="B", tolerance=1e-2)["B"].value)
