"""The order of maps, whose land a region is, what is made for it, zones, and what fifty mapping agencies use."""

import csv
import itertools
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS, Proj
from pyproj.database import query_crs_info
from refusals import refuses
from tables import each, some

from projdist import FIGURES, recommend
from projdist.decisions import candidate_crs, ranking
from projdist.decisions.candidate_crs import Candidate, is_own, is_wide, named, try_crs
from projdist.decisions.measurement import lattice_of, probe_of
from projdist.decisions.zones import _measured, _serves, _System, _systems
from projdist.projections import AUTHORITIES, CrsRecord, crs_records, datum_root, facts_of
from projdist.regions import get_region

# Figures are made up: of its country alone, on a new datum.
USED = {
    "code": "EPSG:1",
    "area_of_use": (-180.0, -90.0, 180.0, 90.0),
    "share": 1.0,
    "datum": "New",
    "datum_since": 2010,
}
OWN = Candidate(**USED, name="", method="", keeps=(), area_name="", trial=None, national=True)
OLD, OTHER = replace(OWN, datum_since=1950, datum="Old"), replace(OWN, national=False)
RECORDS = {record.code: record for record in crs_records(AUTHORITIES)}


def test_weight():
    """A figure counts over the share that its area of use has of the region, and more for a map of the world."""
    # A country's map is before that, unless that of the world is better by the factor.
    world, quarter = replace(OTHER, wide=True), replace(OTHER, wide=True, share=0.25)
    found = [ranking.weight_of(one, 0.99) for one in (OWN, replace(OWN, share=0.5), world, quarter)]
    assert found == [1.0, 2.0, ranking.WIDE_FACTOR, 4.0 * ranking.WIDE_FACTOR]
    assert 0.99 * ranking.WIDE_FACTOR * found[0] < found[2] < 1.01 * ranking.WIDE_FACTOR * found[0]


def numbered(keys, close):
    """The tiers of maps with these keys, each map by its number."""
    maps = [replace(OWN, code=str(number), key=key) for number, key in enumerate(keys)]
    return [[int(one.code) for one in tier] for tier in ranking.tiers(maps, close)]


def test_tiers():
    """Each begins with its best, and ends where figures are farther from that than is close; figures do not chain."""
    figures = [1.0, 1.05, 1.09, 1.12, 1.2, 3.0]
    assert numbered([(value, 0.0) for value in reversed(figures)], 0.1) == [[5, 4, 3], [2, 1], [0]]
    assert numbered([(value, 0.0) for value in figures], 0.0) == [[0], [1], [2], [3], [4], [5]]
    assert ranking.tiers([], ranking.CLOSE) == []
    # Figures that vanish are told apart by levels, and are close to no figure, however small.
    assert numbered([(0.0, 2.0), (1e-9, 1.0), (0.0, 1.0), (0.0, 1.05)], 0.1) == [[2, 3], [0], [1]]


@each(("maps", "order"), [
    ([OTHER, OWN], [1, 0]), ([OLD, OWN], [1, 0]),
    ([replace(OLD, datum_since=None), OWN], [0, 1]),  # an unknown year is no reason
    ([replace(OLD, datum="New(1950)"), OWN], [0, 1]),  # another realisation of the same
    ([replace(OWN, special=True), OLD], [1, 0]), ([OTHER, OTHER], [0, 1]),
])  # fmt: skip
def test_preferred(maps, order):
    """National maps first, for general use, on the datum in force; else the smaller figure, which the first has."""
    first, second = (replace(one, key=(key, 0.0)) for one, key in zip(maps, (1.0, 1.05), strict=True))
    assert ranking.preferred([first, second]) == [(first, second)[number] for number in order]


def test_wide():
    """The world is wide for a country, a continent for a part of it and not for itself; a zone of six degrees never."""
    areas = (-180, -90, 180, 90), (-30, 34, 50, 85), (6, 0, 12, 84), (170, -20, -170, -10), (-10, -20, 10, -10)
    world, europe, zone, fiji, greenwich = (CrsRecord("EPSG:1", "", "", area, "") for area in areas)
    assert world.extent_km2 == pytest.approx(510.06e6, rel=1e-4)
    wide = is_wide(world, 357e3), is_wide(europe, 357e3), is_wide(europe, 26e6), is_wide(zone, 10.0)
    assert wide == (True, True, False, False)
    assert fiji.extent_km2 == pytest.approx(greenwich.extent_km2)


@each(("code", "home", "own"), [
    ("EPSG:25832", "Germany", True), ("EPSG:32632", "Germany", False),
    ("EPSG:3035", "Germany", False),  # of 45 countries
    ("EPSG:31978", "Brazil", True), ("EPSG:21037", "Kenya", True), ("EPSG:27700", "United Kingdom", True),
    ("EPSG:27700", "Ireland", False), ("EPSG:3979", "Canada", True),  # as wide as a continent, and of Canada alone
    ("ESRI:102009", "Mexico", False),  # North America's
])  # fmt: skip
def test_own(code, home, own):
    """Systems of EPSG's registry that are a country's own, or one of a few countries'; a continent's are nobody's."""
    assert is_own(RECORDS[code], named(facts_of([code])[code].extents), home) == own


@each(("key", "least", "expected"), [
    ((1099.0, 9.0), (1000.0, 1.0), True), ((1101.0, 0.0), (1000.0, 1.0), False), ((1.09e-3, 0.0), (1e-3, 0.0), True),
    ((1.11e-3, 0.0), (1e-3, 0.0), False), ((0.0, 1.09e-3), (0.0, 1e-3), True), ((0.0, 1.11e-3), (0.0, 1e-3), False),
    ((1e-9, 1e-3), (0.0, 1e-3), False), ((0.0, 1.05), (0.0, 1.0), True), ((1e-9, 1.0), (0.0, 1.0), False),
])  # fmt: skip
def test_close_is_a_share_of_the_figure(key, least, expected):
    """Of the least one, whatever its size and unit; of the level where the figure vanishes."""
    assert ranking.is_close(key, least, 0.1) == expected


def test_purposes():
    """Each purpose takes what keeps it; a compromise keeps nothing, and any takes all."""
    suits = ranking.suits
    for name in ranking.PURPOSES[1:-1]:
        assert (suits((name,), name), suits((), name), suits((name,), "compromise")) == (True, False, False)
    assert (suits((), "compromise"), suits((), "any")) == (True, True)
    refuses(r"^Invalid purpose 'conformel'. Did you mean conformal\? It must be any", ranking.get_purpose, "conformel")


def tried(codes, region, figure="airy_kavrayskiy", **usage):
    """Candidates as they are measured in a region, with what each is used for."""
    probe = probe_of(get_region(region))
    found = [try_crs(RECORDS[code], probe, FIGURES[figure]) for code in codes]
    assert all(isinstance(one, Candidate) for one in found)
    return [replace(one, **usage.get(one.code, {})) for one in found]


# Maps that people know by the first code, and CRSs that draw the same.
@pytest.mark.slow
@each(("region", "known", "others"), [
    ("box:5.9,47.3,15.0,55.1", "EPSG:25832",
     "EPSG:4647 EPSG:5652 EPSG:10288 EPSG:10289 EPSG:10732 EPSG:3044 EPSG:32632 EPSG:23032"),
    ("box:7.5,48,10.4,54", "EPSG:31467", "EPSG:5677 EPSG:5683 ESRI:103974"),
    ("box:6,45.9,10.4,47.8", "EPSG:2056", "EPSG:21780 EPSG:21781"), ("box:9.6,46.5,17.1,49", "EPSG:3416", "EPSG:31287"),
    ("box:-106.6,25.9,-93.6,36.4", "EPSG:3083", "EPSG:3085 EPSG:3665 EPSG:6579 EPSG:10481"),
    ("box:-5,42.5,8,51", "EPSG:2154", "EPSG:9793 EPSG:9794"), ("box:3.4,50.8,7.2,53.5", "EPSG:28992", "EPSG:28991"),
    ("box:12.1,48.6,18.8,51", "EPSG:5514", "EPSG:5513 EPSG:2065 EPSG:5221"),
    ("box:-72,-55,-66,-18", "EPSG:5361", "EPSG:9155 EPSG:20049 EPSG:31979 EPSG:32719 EPSG:24879"),
    ("box:11,55.4,24.1,69", "EPSG:3006", "EPSG:3045 EPSG:25833 EPSG:32633"),
    ("box:14.2,49.1,24.1,54.8", "EPSG:2180", "ESRI:102173 ESRI:102194"),
    ("box:113,-43,153,-10", "EPSG:3577", "EPSG:9473"),
    ("box:-6,36,0,43", "EPSG:25830", "EPSG:3042 EPSG:32630 EPSG:23030"),
    ("box:168,-47,174,-40", "EPSG:2134", "EPSG:32759 EPSG:27259"),
])  # fmt: skip
def test_the_known_name_comes_first(region, known, others):
    (group,) = ranking.grouped(tried([*others.split(), known], region))
    for holds in (True, False):
        used = [replace(one, holds=holds) for one in group]
        first, *_ = found = ranking.by_usage(used, RECORDS)
        assert (first.code, ranking.by_usage(used[::-1], RECORDS)) == (known, found)


# Maps that are in force on the datum of the first code, which replaced those of the others.
@each(("region", "known", "others"), [
    ("box:-72,-55,-66,-18", "EPSG:20049", "EPSG:5361 EPSG:9155 EPSG:31979 EPSG:32719 EPSG:24879"),
    ("box:113,-43,153,-10", "EPSG:9473", "EPSG:3577"), ("box:-24,63,-13,67", "EPSG:8088", "EPSG:3057 EPSG:5325"),
    ("box:6.6,36,12,47", "EPSG:7791", "EPSG:25832 EPSG:32632 EPSG:23032"),
    ("box:-5,42.5,8,51", "EPSG:2154", "EPSG:9793 EPSG:9794"),  # realisations of one datum
    ("box:11,55.4,24.1,69", "EPSG:3006", "EPSG:3045 EPSG:25833 EPSG:32633"),
])  # fmt: skip
def test_the_datum_in_force_comes_first(region, known, others):
    """Where the registry tells of what year datums are; realisations of one are as old as each other."""
    codes = [*others.split(), known]
    usage = {code: {"datum_since": one.since or None, "special": one.special} for code, one in facts_of(codes).items()}
    (group,) = ranking.grouped(tried(codes, region, **usage))
    assert ranking.by_usage(group, RECORDS)[0].code == known


def test_national_crss_and_those_for_the_whole_region_come_first():
    """Kenya's own UTM zone before that of the world, which is on a newer datum; the only one for the whole region."""
    kenyan = {"EPSG:32737": {"datum_since": 1984}, "EPSG:21037": {"national": True, "datum_since": 1960}}
    italian = {"EPSG:3003": {"holds": True}, "EPSG:3064": {}, "EPSG:25832": {}}
    for usage, region, first in (
        (kenyan, "box:36,-4,41,4", "EPSG:21037"),
        (italian, "box:6.1,40,11.9,50", "EPSG:3003"),
    ):
        found = ranking.by_usage(tried(usage, region, **usage), RECORDS)
        assert (found[0].code, len(found)) == (first, len(usage))


@each(("datum", "root"), [
    ("NAD83(2011)", "NAD83"), ("RGF93 v2b", "RGF93"), ("S-JTSK [JTSK03]", "S-JTSK"), ("ETRS89/DREF91/2016", "ETRS89"),
    ("CH1903+", "CH1903+"), ("SIRGAS-Chile 2021", "SIRGAS-Chile 2021"),
])  # fmt: skip
def test_realisations(datum, root):
    """What follows the name of a datum tells its realisations; a year in the name tells another datum."""
    assert datum_root(datum) == root


def test_figures_that_agree():
    """To one per cent of the least of a group; the next begins another."""
    near, far = 1.0 + 0.9 * ranking._CLOSE, 1.0 + 1.2 * ranking._CLOSE
    assert ranking._close([2.0, 1.0, near, 2.0 * near, far], float) == [[1.0, near], [far], [2.0, 2.0 * near]]


USA, SPAIN = "United States of America", "Spain"
CODES = ("EPSG:32632", "EPSG:32633")


@each(("extents", "countries"), [
    (["Kenya - onshore"], {"Kenya"}), (["USA - New Mexico - SPCS - E"], {USA}), ([], set()),
    (["World - N hemisphere - 36°E to 42°E - by country", "Between 36°E and 42°E. Kenya. Somalia."], set()),
    (["Europe - Czechoslovakia", "Czechia; Slovakia."], {"Czechia", "Slovakia"}),
    (["Africa - Kenya and Tanzania - south of equator and east of 36°E"], {"Kenya", "Tanzania"}),
    (["Europe between 6°E and 12°E: Austria; Denmark - onshore and offshore; Spain - offshore."],
     {"Austria", "Denmark"}),
    (["Papua New Guinea - west of 144°E"], {"Papua New Guinea"}), (["Mexico - New Mexico border"], {"Mexico"}),
    (["Korea, Republic of (South Korea)"], {"South Korea"}),
    (["USA - CONUS", "United States (USA) - CONUS - Alabama; Delaware; Georgia; New Jersey; New Mexico; Ohio."], {USA}),
    (["China - Hong Kong - onshore and offshore."], {"China", "Hong Kong"}),
    (["Reunion - onshore and offshore - west of 54°E."], {"France"}),
    (["Georgia - onshore and offshore."], {"Georgia"}),
    (["North America - Equi7", "North America including Greenland, the Caribbean and Central America."], set()),
    (["Norway including Svalbard - onshore and offshore."], {"Norway"}),
    (["Nigeria - offshore deep water - west of 6°E"], set()),
])  # fmt: skip
def test_named(extents, countries):
    """Countries by whole words, on land, the first of a name that goes on; nobody by what is for the world."""
    assert named(extents) == countries


@pytest.mark.slow
@each(("region", "home"), [
    ("country:KE", "Kenya"), ("box:5.9,47.3,15.0,55.1", "Germany"), ("box:177,-20,-178,-15", "Fiji"),  # mostly sea
    ("country:AQ", ""),  # by treaty
    ("country:SG", "Singapore"),  # which a coarse outline of Malaysia covers
    ("country:LI", "Liechtenstein"), ("country:AF", "Afghanistan"),  # for which alone no CRS is made
    ("state:OH", USA), ("box:2,54,4,56", ""), ("box:-180,-90,180,90", ""),  # the North Sea, and the world
])  # fmt: skip
def test_home(region, home):
    """The country that has most of a region's land; none at sea, and none that has half of the world."""
    assert candidate_crs.home_of(lattice_of(get_region(region))) == home


def test_the_world_is_nobodys():
    """A region above 450 million km2 is not looked into: no country has half of what it must hold."""
    names = ("globe", "land@110m", "country:RU@110m", "country:AQ@110m")  # areas to a per cent
    globe, all_land, russia, antarctica = (get_region(name).area_km2 for name in names)
    land = all_land - antarctica - (globe - candidate_crs._NOBODYS_KM2)
    assert russia < 0.5 * land


CONUS = CrsRecord("A:1", "Conus", "", (-124.79, 24.41, -66.91, 49.38), "USA - CONUS - onshore")
OHIO = CrsRecord("A:2", "Ohio", "", (-84.81, 38.4, -80.51, 42.33), "USA - Ohio")


def part_of(home, region):
    place = get_region(region)
    return candidate_crs.part_of(home, place, lattice_of(place))


@pytest.mark.slow
@each(("home", "region", "state", "is_far"), [
    (USA, "state:OH", "Ohio", False), (USA, "box:-84.9,38.3,-80.4,42.4", "", False),  # a third of it is not Ohio
    (USA, "box:-84.5,39,-81,41.3", "Ohio", False),  # two thirds of Ohio
    (USA, "box:-83.5,39.5,-82.5,40.5", "", False),  # a tenth of it
    (USA, "state:AK", "Alaska", False), (USA, "state:HI", "Hawaii", True),
    (USA, "box:-161,18,-154,23", "", True),  # most of it is sea
    *((USA, f"country:US@{part}", "", False) for part in ("main", "all")),
    (SPAIN, "country:ES & box:-18.5,27,-13,30", "", True),
    (SPAIN, "country:ES & box:0,38,5,41", "", False),  # the Balearic Islands are near
    ("Germany", "country:DE", "", False),
])  # fmt: skip
def test_parts(home, region, state, is_far):
    """States by nine tenths of the region in half of a state; what is far by the main part of the outlines."""
    part = part_of(home, region)
    assert (part.state, part.middle is not None) == (state, is_far and not state)


@pytest.mark.slow
def test_what_is_made_for_a_part():
    """Ohio's, by the name of the area of use, and not what is for all of the country; Alaska's is not Kansas's."""
    part = part_of(USA, "state:OH")
    assert part.has(OHIO, ["United States (USA) - Ohio"])
    assert not part.has(CONUS, ["United States (USA) - CONUS - onshore"])
    assert not part.has(CONUS, [])
    far = part_of(USA, "box:-180,50,-129,72")  # what has the middle of the main part, Kansas, is not made for it
    assert np.allclose(far.middle, (-95.85, 36.96), atol=0.01)
    assert not far.has(CONUS, ["USA"])
    assert far.has(replace(OHIO, area_of_use=(172.42, 51.3, -129.99, 71.4)), ["USA - Alaska"])
    virginia = candidate_crs.CountryPart(state="Virginia")  # names of states are whole words
    assert not virginia.has(OHIO, ["USA - West Virginia - SPCS - N"])
    assert virginia.has(OHIO, ["USA - Virginia"])


def test_the_datum_in_force_is_that_of_any_own_map():
    """Also of one for a part of the region; what is of no known year, as S-JTSK, may be in force."""
    old, zone = replace(OWN, datum_since=1870, datum="Old"), replace(OWN, share=0.7, datum_since=1990)
    assert ranking.in_force([old]) == ranking.in_force([old, replace(zone, national=False)]) == [old]
    assert ranking.in_force([old, zone]) == [zone]
    unknown = replace(OWN, datum_since=None, datum="Unknown")
    assert ranking.in_force([unknown, zone]) == [unknown, zone]
    assert ranking.in_force([]) == []


@pytest.mark.slow
@pytest.mark.parametrize(("region", "code"), [
    ("country:ES@main", None),  # ETRS89 by royal decree 1071/2007, in zones; not Lambert's of 1870
    ("country:ES & box:-18.2,27.6,-13.4,29.3", "EPSG:4083"),  # REGCAN95 by the same decree, UTM zone 28N
    ("country:VE", None),  # SIRGAS-REGVEN since 1999, in zones
    ("state:OH", None),  # two zones
    ("state:LA", None),  # two zones, and a third for the waters
    ("state:CA", "EPSG:3310"),  # California Albers
    ("country:US & box:-161,18,-154,23", None),  # five zones in Hawaii
])  # fmt: skip
def test_official(region, code):
    """What decrees and agencies say; on the datum in force, as EPSG v12 has California's map on that of 2025, too."""
    found = recommend(region, limit=1)
    assert found.official is None if code is None else code in found.official.codes
    if region == "state:OH":  # its own, and not all zones about it
        (system,) = found.zones
        assert [zone.name for zone in system.zones] == ["NAD83 / Ohio North", "NAD83 / Ohio South"]


BOX = "box:8,50,14,51"


def measured(region, *codes):
    """Zones of UTM as a system over a region."""
    records, place = tuple(RECORDS[code] for code in codes), get_region(region)
    lattice = lattice_of(place)
    held = lattice.within([record.area_of_use for record in records])
    return _measured(lattice, _System(records, held, 0, "WGS 84", False), FIGURES["max_omega"], None, True)


def test_zones_over_their_parts():
    """Zones 32 and 33 have two thirds and one of the box, with the scales that PROJ has there."""
    found = measured(BOX, *CODES)
    assert (found.name, found.national) == ("WGS 84 / UTM zone 32N to UTM zone 33N", True)
    assert [zone.share for zone in found.zones] == pytest.approx([2 / 3, 1 / 3], rel=1e-6)
    for zone, west, east in zip(found.zones, (8, 12), (12, 14), strict=True):
        k = Proj(zone.code).get_factors(*np.meshgrid(np.linspace(west, east, 81), [50.0, 50.5, 51.0])).meridional_scale
        assert zone.max_scale_error_ppm == pytest.approx(1e6 * np.abs(k - 1.0).max(), abs=1e-3)
        assert zone.value == pytest.approx(0.0, abs=1e-5)  # conformal
    assert found.max_scale_error_ppm == max(zone.max_scale_error_ppm for zone in found.zones)
    assert found.value == max(zone.value for zone in found.zones)
    assert found.share == pytest.approx(1.0)
    assert found.to_dict()["zones"][0]["share_in_area_of_use"] == found.zones[0].share
    # A zone that does not meet the region is none of the system's, of which only so much is held.
    part = measured(BOX, "EPSG:32631", "EPSG:32632")
    assert ([zone.code for zone in part.zones], part.share) == (["EPSG:32632"], pytest.approx(2 / 3, abs=0.01))
    assert math.isfinite(part.value)


@each(("region", "count"), [("box:7,50,11,51", 0), (BOX, 1), ("box:8,50,20,51", 0)])
def test_what_is_a_system_of_zones(region, count):
    """Zones that hold a region together, where none of them holds it alone."""
    found = _systems([RECORDS[code] for code in CODES], facts_of(CODES), lattice_of(get_region(region)), "")
    assert [tuple(record.code for record in one.records) for one in found] == [CODES] * count


# Zones of 1983 by state, of states with several: J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual
# NOS NGS 5, appendix A. Left out are offshore zones, New York's Long Island, and Massachusetts, whose mainland is one.
STATE_PLANE = """Michigan 3;Alabama 2;Alaska 10;Arizona 3;Arkansas 2;California 6;Colorado 3;Florida 3;Georgia 2;
Idaho 3;Illinois 2;Indiana 2;Iowa 2;Kansas 2;Kentucky 2;Louisiana 2;Maine 2;Minnesota 3;Hawaii 5;Mississippi 2;
Missouri 3;Nevada 3;New Mexico 3;New York 3;North Dakota 2;Ohio 2;Oklahoma 2;Oregon 2;Pennsylvania 2;
South Dakota 2;Texas 5;Utah 3;Virginia 2;Washington 2;West Virginia 2;Wisconsin 3;Wyoming 4"""


@pytest.mark.slow
@each("text", some(STATE_PLANE.replace("\n", "").split(";"), 18))
def test_state_plane_zones_are_named(text):
    """Also where zones have methods of their own (Alaska), or one far island more than one map of all (Michigan)."""
    state, _, count = text.rpartition(" ")
    zones = next(one for one in recommend(f"state:{state}", limit=1).zones if one.national).zones
    assert len(zones) == int(count)
    assert all(zone.name.startswith(f"NAD83 / {state}") for zone in zones)


@each(("codes", "above", "serves"), [
    (CODES, 3000.0, True), (CODES, 2000.0, False),  # zone 33 has 2690 ppm at 7 degrees from its meridian
    (("EPSG:32632", "EPSG:3035"), 1e5, False),  # equal-area
])  # fmt: skip
def test_zones_are_conformal_and_good_enough(codes, above, serves):
    found = dict(zip(codes, tried(codes, "box:8,50,10,51", "max_scale_error_ppm"), strict=True))
    system = _System(tuple(RECORDS[code] for code in codes), np.ones((2, 1), dtype=bool), 0, "WGS 84", False)
    assert _serves(system, found, above) == serves


def test_areas_of_use_of_one_map_count_together():
    """Two halves hold a region that neither does; a twentieth is named for nothing."""
    parts = {"EPSG:25832": (8, 50, 10, 51), "EPSG:32632": (10, 50, 12, 51), "EPSG:23032": (11.8, 50, 12, 51)}
    records = [replace(RECORDS[code], area_of_use=part) for code, part in parts.items()]
    place = get_region("box:8,50,12,51")
    pool = candidate_crs.CandidatePool(place, records, "contains")
    assert ([*pool.records], [one.code for one in pool.rejected]) == (["EPSG:25832", "EPSG:32632"], ["EPSG:23032"])
    assert candidate_crs.CandidatePool(place, records[:1], "contains").records == {}


SYSTEMS = list(
    csv.DictReader((Path(__file__).parents[1] / "data/national_systems.csv").read_text("utf-8").splitlines())
)
QUESTIONS = {(row["region"], row["purpose"]): [] for row in SYSTEMS}
for row in SYSTEMS:
    QUESTIONS[row["region"], row["purpose"]].append(row)


def title(row):
    return f"{row['iso']} {row['codes'].partition(' ')[0]}"


def test_fifty_countries_of_all_continents():
    """Each with the use of its system and a source, zones and single ones in number; for three another is advised.

    Every code is in the database, not deprecated, and on a datum that is named.
    """
    names = {f"EPSG:{info.code}" for info in query_crs_info("EPSG", "PROJECTED_CRS")}
    for row in SYSTEMS:
        codes = row["codes"].split()
        assert len(codes) > (row["kind"] == "zones"), row
        assert set(codes) <= names, row
        assert CRS(codes[0]).geodetic_crs.name.startswith(tuple(row["datum"].split("; "))), row
        assert row["use"], row
        assert row["source"], row
    kinds = Counter((row["kind"], row["purpose"]) for row in SYSTEMS)
    assert {*kinds} <= {*itertools.product(("zones", "single"), ("conformal", "equal-area"))}
    assert kinds["single", "conformal"] > 20 <= kinds["zones", "conformal"] + kinds["zones", "equal-area"]
    assert kinds["single", "equal-area"]
    assert len({row["iso"] for row in SYSTEMS}) == 50
    assert {*OTHERWISE, *OFFICIAL_OTHERWISE} <= {title(row) for row in SYSTEMS}
    assert len({name.partition(" ")[0] for name in OTHERWISE}) <= 3


# What the advice is not, with what it says in place of it.
OTHERWISE = {
    # South Korea's unified system has 0.00047, UTM zone 52 of the world 0.00040: 18 % less, and more than is close.
    "KR EPSG:5179": "third, its belts are named",
    # DKTM's three zones keep 65 ppm, those of Kp2000 113; the two of UTM, whose areas of use are Europe's, keep 400.
    "DK EPSG:25832": "zones of its own that distort less are named",
    # EPSG's registry has UTM on Minna for deep water only.
    "NG EPSG:26331": "the three belts are named",
}
# What is named as official where the agency has another system for the whole country.
OFFICIAL_OTHERWISE = {
    "DE EPSG:4839": "EPSG:25832",  # both are in use; UTM's has the smaller error
    "KR EPSG:5179": "EPSG:5183",  # the belts' areas of use hold the whole, and the east's draws it with less error
    "NO EPSG:25833": None,  # zone 33's area of use does not hold the west
}
# These are even first.
FIRST = {
    "country:CH": "EPSG:2056", "country:AT": "EPSG:3416", "country:GB": "EPSG:27700", "country:CZ": "EPSG:5514",
    "country:FR & box:-6,41,10,52": "EPSG:2154", "country:NO & box:4,57,32,72": "EPSG:25832",
}  # fmt: skip


def draws(codes):
    """The maps of some CRSs, whatever their datums."""
    return {facts.draws for facts in facts_of(codes).values()}


def names_the_zones(codes, found):
    """Whether one of the systems that are named has all zones with a hundredth of the region or more."""
    lattice = lattice_of(found.region)
    shares = lattice.within([CRS(code).area_of_use.bounds for code in codes]) @ lattice.weight
    wanted = draws(code for code, share in zip(codes, shares, strict=True) if share > 0.01)
    return any(wanted <= draws(zone.code for zone in system.zones) for system in found.zones)


@pytest.mark.slow
@pytest.mark.parametrize(("region", "purpose"), some(QUESTIONS, 4, 1))
def test_the_agencys_systems(region, purpose):
    """Each is first or second for its purpose among existing CRSs, or its zones are named; one for all is official."""
    found = recommend(region, purpose=purpose, limit=2)
    assert found.region.area_km2 > 1000
    assert found.results[0].code == FIRST.get(region, found.results[0].code)
    official = (None, ()) if found.official is None else (found.official.code, found.official.codes)
    for row in QUESTIONS[region, purpose]:
        codes, zones = row["codes"].split(), row["kind"] == "zones"
        # Under the name of any CRS of the same map.
        is_first = any(not set(codes).isdisjoint(one.codes) for one in found.results)
        assert ((zones and names_the_zones(codes, found)) or is_first) == (title(row) not in OTHERWISE)
        if not zones and purpose == "conformal" and set(codes).isdisjoint(official[1]):
            assert official[0] == OFFICIAL_OTHERWISE[title(row)]
        else:
            assert zones or title(row) not in OFFICIAL_OTHERWISE
