"""Systems of zones: the figures of their zones, each over its part of a region."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pyproj import Proj

from projdist import FIGURES
from projdist.decisions.candidate_crs import Candidate, CandidatePool, try_crs
from projdist.decisions.measurement import lattice_of, probe_of
from projdist.decisions.zones import _measured, _serves, _System, _systems
from projdist.projections.database import crs_records, facts_of
from projdist.regions import get_region

BOX = "box:8,50,14,51"


def measured(region, *codes):
    """Zones of UTM as a system over a region."""
    known = {record.code: record for record in crs_records(["EPSG"])}
    records, place = tuple(known[code] for code in codes), get_region(region)
    lattice = lattice_of(place)
    held = lattice.within([record.area_of_use for record in records])
    return _measured(place, lattice, _System(records, held, 0, "WGS 84", False), FIGURES["max_omega"], None, True)


def test_zones_over_their_parts():
    """Zones 32 and 33 have two thirds and one of the box, with the scales that PROJ has there."""
    found = measured(BOX, "EPSG:32632", "EPSG:32633")
    assert found.name == "WGS 84 / UTM zone 32N to UTM zone 33N"
    assert [zone.share for zone in found.zones] == pytest.approx([2 / 3, 1 / 3], rel=1e-6)
    for zone, west, east in zip(found.zones, (8, 12), (12, 14), strict=True):
        lon, lat = np.meshgrid(np.linspace(west, east, 81), [50.0, 50.5, 51.0])
        k = Proj(zone.code).get_factors(lon, lat).meridional_scale
        assert zone.max_scale_error_ppm == pytest.approx(1e6 * np.abs(k - 1.0).max(), abs=1e-3)
        assert zone.value == pytest.approx(0.0, abs=1e-5)  # conformal
    assert found.max_scale_error_ppm == max(zone.max_scale_error_ppm for zone in found.zones)
    assert found.value == max(zone.value for zone in found.zones)
    assert (found.share, found.national) == (pytest.approx(1.0), True)
    assert found.to_dict()["zones"][0]["share_in_area_of_use"] == found.zones[0].share


def test_zones_that_do_not_meet_the_region():
    """They are none of the system's, of which only so much is held."""
    found = measured(BOX, "EPSG:32631", "EPSG:32632")
    assert [zone.code for zone in found.zones] == ["EPSG:32632"]
    assert found.share == pytest.approx(2 / 3, abs=0.01)
    assert math.isfinite(found.value)


@pytest.mark.parametrize(("region", "count"), [("box:7,50,11,51", 0), (BOX, 1), ("box:8,50,20,51", 0)])
def test_what_is_a_system_of_zones(region, count):
    """Zones that hold a region together, where none of them holds it alone."""
    records = [record for record in crs_records(["EPSG"]) if record.code in ("EPSG:32632", "EPSG:32633")]
    found = _systems(records, facts_of([record.code for record in records]), lattice_of(get_region(region)))
    assert [[record.code for record in one.records] for one in found] == [["EPSG:32632", "EPSG:32633"]] * count


@pytest.mark.parametrize(
    ("codes", "above", "serves"),
    [
        (("EPSG:32632", "EPSG:32633"), 3000.0, True),
        (("EPSG:32632", "EPSG:32633"), 2000.0, False),  # zone 33 has 2690 ppm at 7 degrees from its meridian
        (("EPSG:32632", "EPSG:3035"), 1e5, False),  # equal-area
    ],
)
def test_zones_are_conformal_and_good_enough(codes, above, serves):
    """All of them, by their trials."""
    known = {record.code: record for record in crs_records(["EPSG"])}
    probe = probe_of(get_region("box:8,50,10,51"))
    found = {code: try_crs(known[code], probe, FIGURES["max_scale_error_ppm"]) for code in codes}
    assert all(isinstance(one, Candidate) for one in found.values())
    system = _System(tuple(known[code] for code in codes), np.ones((2, 1), dtype=bool), 0, "WGS 84", False)
    assert _serves(system, found, above) == serves


def test_areas_of_use_of_one_map_count_together():
    """Two halves hold a region that neither does; a twentieth is named for nothing."""
    known = {record.code: record for record in crs_records(["EPSG"])}
    parts = {"EPSG:25832": (8, 50, 10, 51), "EPSG:32632": (10, 50, 12, 51), "EPSG:23032": (11.8, 50, 12, 51)}
    records = [replace(known[code], area_of_use=part) for code, part in parts.items()]
    pool = CandidatePool(get_region("box:8,50,12,51"), records, "contains")
    assert set(pool.records) == {"EPSG:25832", "EPSG:32632"}
    assert [one.code for one in pool.rejected] == ["EPSG:23032"]
    assert CandidatePool(get_region("box:8,50,12,51"), records[:1], "contains").records == {}
