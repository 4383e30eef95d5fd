"""What is a country's own where a region is a state of it or far from its main part; and on which datum."""

import dataclasses

import numpy as np
import pytest
from sample_candidates import NATIONAL

from projdist import recommend
from projdist.decisions.candidate_crs import CountryPart, part_of
from projdist.decisions.measurement import lattice_of
from projdist.decisions.ranking import in_force
from projdist.projections.database import CrsRecord
from projdist.regions import get_region

USA, SPAIN = "United States of America", "Spain"
CONUS = CrsRecord("A:1", "Conus", "", (-124.79, 24.41, -66.91, 49.38), "USA - CONUS - onshore")
OHIO = CrsRecord("A:2", "Ohio", "", (-84.81, 38.4, -80.51, 42.33), "USA - Ohio")


@pytest.mark.parametrize(
    ("home", "region", "state", "is_far"),
    [
        (USA, "state:OH", "Ohio", False),
        (USA, "box:-84.9,38.3,-80.4,42.4", "", False),  # a third of it is not Ohio
        (USA, "box:-84.5,39,-81,41.3", "Ohio", False),  # two thirds of Ohio
        (USA, "box:-83.5,39.5,-82.5,40.5", "", False),  # a tenth of it
        (USA, "state:AK", "Alaska", False),
        (USA, "state:HI", "Hawaii", True),
        (USA, "box:-161,18,-154,23", "", True),  # most of it is sea
        (USA, "country:US@main", "", False),
        pytest.param(USA, "country:US@all", "", False, marks=pytest.mark.slow),
        (SPAIN, "country:ES & box:-18.5,27,-13,30", "", True),
        (SPAIN, "country:ES & box:0,38,5,41", "", False),  # the Balearic Islands are near
        ("Germany", "country:DE", "", False),
    ],
)
def test_parts(home, region, state, is_far):
    """States by nine tenths of the region in half of a state; what is far by the main part of the outlines."""
    place = get_region(region)
    lattice = lattice_of(place)
    part = part_of(home, place, lattice)
    assert part.state == state
    assert (part.middle is not None) == (is_far and not state)


def test_what_is_made_for_a_state():
    """Ohio's, by the name of the area of use, and not what is for all of the country."""
    place = get_region("state:OH")
    lattice = lattice_of(place)
    part = part_of(USA, place, lattice)
    assert part.has(OHIO, ["United States (USA) - Ohio"])
    assert not part.has(CONUS, ["United States (USA) - CONUS - onshore"])
    assert not part.has(CONUS, [])


def test_what_is_made_for_a_far_part():
    """It has not the middle of the main part: Kansas."""
    place = get_region("box:-180,50,-129,72")
    lattice = lattice_of(place)
    part = part_of(USA, place, lattice)
    assert np.allclose(part.middle, (-95.85, 36.96), atol=0.01)
    assert not part.has(CONUS, ["USA"])
    alaska = dataclasses.replace(OHIO, area_of_use=(172.42, 51.3, -129.99, 71.4))
    assert part.has(alaska, ["USA - Alaska"])


@pytest.mark.parametrize(("name", "has"), [("USA - West Virginia - SPCS - N", False), ("USA - Virginia", True)])
def test_states_are_whole_words(name, has):
    """West Virginia's is not Virginia's."""
    assert CountryPart(state="Virginia").has(OHIO, [name]) == has


@pytest.mark.slow
def test_zones_of_a_state():
    """Ohio's North and South, and not all zones about it."""
    (system,) = recommend("state:OH", limit=1).zones
    assert [zone.name for zone in system.zones] == ["NAD83 / Ohio North", "NAD83 / Ohio South"]


OWN = dataclasses.replace(NATIONAL, datum_since=1870, datum="Old")
ZONE = dataclasses.replace(OWN, share=0.7, datum_since=1990, datum="New")


def test_the_datum_in_force_is_that_of_any_own_map():
    """Also of one for a part of the region; what is of no known year, as S-JTSK, may be in force."""
    assert in_force([OWN]) == [OWN]
    assert in_force([OWN, ZONE]) == [ZONE]
    unknown = dataclasses.replace(OWN, datum_since=None, datum="Unknown")
    assert in_force([unknown, ZONE]) == [unknown, ZONE]
    assert in_force([OWN, dataclasses.replace(ZONE, national=False)]) == [OWN]
    assert in_force([]) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("region", "code"),
    [
        ("country:ES@main", None),  # ETRS89 by royal decree 1071/2007, in zones; not Lambert's of 1870
        ("country:ES & box:-18.2,27.6,-13.4,29.3", "EPSG:4083"),  # REGCAN95 by the same decree, UTM zone 28N
        ("country:VE", None),  # SIRGAS-REGVEN since 1999, in zones
        ("state:OH", None),  # two zones
        ("state:LA", None),  # two zones, and a third for the waters
        ("state:CA", "EPSG:3310"),  # California Albers
        ("country:US & box:-161,18,-154,23", None),  # five zones in Hawaii
    ],
)
def test_official(region, code):
    """What decrees and agencies say."""
    official = recommend(region, limit=1).official
    if code is None:
        assert official is None
    else:  # on the datum in force: EPSG v12 has California's map on that of 2025, too
        assert code in {official.code, *(other for other, _ in official.same)}
