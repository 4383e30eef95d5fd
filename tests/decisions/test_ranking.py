"""Purposes, the order of maps, and CRSs of the same map, of which one is named first."""

from dataclasses import replace

import pytest
from sample_candidates import NATIONAL as OWN
from tables import each

from projdist import FIGURES
from projdist.decisions import ranking
from projdist.decisions.candidate_crs import Candidate, is_own, is_wide, named, try_crs
from projdist.decisions.measurement import probe_of
from projdist.projections.database import AUTHORITIES, CrsRecord, crs_records, facts_of
from projdist.regions import get_region

OLD = replace(OWN, datum_since=1950, datum="Old")
OTHER = replace(OWN, national=False)


def test_weight():
    """A figure counts over the share that its area of use has of the region, and more for a map of the world."""
    # A country's map is before that, unless that of the world is better by the factor.
    assert ranking.weight_of(OWN, 0.99) == 1.0
    assert ranking.weight_of(replace(OWN, share=0.5), 0.99) == 2.0
    assert ranking.weight_of(replace(OTHER, wide=True), 0.99) == ranking.WIDE_FACTOR
    assert ranking.weight_of(replace(OTHER, wide=True, share=0.25), 0.99) == 4.0 * ranking.WIDE_FACTOR
    world = replace(OTHER, wide=True)
    for better, first in ((0.99 * ranking.WIDE_FACTOR, False), (1.01 * ranking.WIDE_FACTOR, True)):
        assert (ranking.weight_of(world, 0.99) < better * ranking.weight_of(OWN, 0.99)) == first


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


def test_figures_that_vanish_are_told_apart_by_levels():
    """And are close to no figure, however small."""
    assert numbered([(0.0, 2.0), (1e-9, 1.0), (0.0, 1.0), (0.0, 1.05)], 0.1) == [[2, 3], [0], [1]]
    assert ranking.is_close((0.0, 1.05), (0.0, 1.0), 0.1)
    assert not ranking.is_close((1e-9, 1.0), (0.0, 1.0), 0.1)


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

    def record(*area):
        return CrsRecord("EPSG:1", "", "", area, "")

    world, europe, zone = record(-180, -90, 180, 90), record(-30, 34, 50, 85), record(6, 0, 12, 84)
    assert world.extent_km2 == pytest.approx(510.06e6, rel=1e-4)
    assert is_wide(world, 357e3)
    assert is_wide(europe, 357e3)
    assert not is_wide(europe, 26e6)
    assert not is_wide(zone, 10.0)
    assert record(170, -20, -170, -10).extent_km2 == pytest.approx(record(-10, -20, 10, -10).extent_km2)


@each(("code", "home", "own"), [
    ("EPSG:25832", "Germany", True), ("EPSG:32632", "Germany", False),
    ("EPSG:3035", "Germany", False),  # of 45 countries
    ("EPSG:31978", "Brazil", True), ("EPSG:21037", "Kenya", True), ("EPSG:27700", "United Kingdom", True),
    ("EPSG:27700", "Ireland", False), ("EPSG:3979", "Canada", True),  # as wide as a continent, and of Canada alone
    ("ESRI:102009", "Mexico", False),  # North America's
])  # fmt: skip
def test_own(code, home, own):
    """Systems of EPSG's registry that are a country's own, or one of a few countries'; a continent's are nobody's."""
    (record,) = (record for record in crs_records(["EPSG", "ESRI"]) if record.code == code)
    assert is_own(record, named(facts_of([code])[code].extents), home) == own


@each(("key", "least", "expected"), [
    ((1099.0, 9.0), (1000.0, 1.0), True), ((1101.0, 0.0), (1000.0, 1.0), False), ((1.09e-3, 0.0), (1e-3, 0.0), True),
    ((1.11e-3, 0.0), (1e-3, 0.0), False), ((0.0, 1.09e-3), (0.0, 1e-3), True), ((0.0, 1.11e-3), (0.0, 1e-3), False),
    ((1e-9, 1e-3), (0.0, 1e-3), False),
])  # fmt: skip
def test_close_is_a_share_of_the_figure(key, least, expected):
    """Of the least one, whatever its size and unit; of the level where the figure vanishes."""
    assert ranking.is_close(key, least, 0.1) == expected


def test_purposes():
    """Each purpose takes what keeps it; a compromise keeps nothing, and any takes all."""
    for name in ranking.PURPOSES[1:-1]:
        assert ranking.suits((name,), name)
        assert not ranking.suits((), name)
        assert not ranking.suits((name,), "compromise")
    assert ranking.suits((), "compromise")
    assert ranking.suits((), "any")
    with pytest.raises(ValueError, match=r"^Invalid purpose 'conformel'. Did you mean conformal\? It must be any"):
        ranking.get_purpose("conformel")


GERMANY, WEST = "box:5.9,47.3,15.0,55.1", "box:7.5,48,10.4,54"

# Maps that people know by the first code, and CRSs that draw the same.
KNOWN = [
    (GERMANY, "EPSG:25832", "EPSG:4647 EPSG:5652 EPSG:10288 EPSG:10289 EPSG:10732 EPSG:3044 EPSG:32632 EPSG:23032"),
    (WEST, "EPSG:31467", "EPSG:5677 EPSG:5683 ESRI:103974"),
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
]  # fmt: skip

RECORDS = {record.code: record for record in crs_records(AUTHORITIES)}


def tried(codes, region, **usage):
    """Candidates as they are measured in a region, with what each is used for."""
    probe = probe_of(get_region(region))
    found = [try_crs(RECORDS[code], probe, FIGURES["airy_kavrayskiy"]) for code in codes]
    assert all(isinstance(one, Candidate) for one in found)
    return [replace(one, **usage.get(one.code, {})) for one in found]


@each(("region", "known", "others"), KNOWN)
def test_the_known_name_comes_first(region, known, others):
    """Whatever the order in which they are found."""
    codes = [*others.split(), known]
    (group,) = ranking.grouped(tried(codes, region))
    for holds in (True, False):
        used = [replace(one, holds=holds) for one in group]
        assert ranking.by_usage(used, RECORDS)[0].code == known
        assert ranking.by_usage(used[::-1], RECORDS) == ranking.by_usage(used, RECORDS)


# Maps that are in force on the datum of the first code, which replaced those of the others.
IN_FORCE = [
    ("box:-72,-55,-66,-18", "EPSG:20049", "EPSG:5361 EPSG:9155 EPSG:31979 EPSG:32719 EPSG:24879"),
    ("box:113,-43,153,-10", "EPSG:9473", "EPSG:3577"),
    ("box:-24,63,-13,67", "EPSG:8088", "EPSG:3057 EPSG:5325"),
    ("box:6.6,36,12,47", "EPSG:7791", "EPSG:25832 EPSG:32632 EPSG:23032"),
    ("box:-5,42.5,8,51", "EPSG:2154", "EPSG:9793 EPSG:9794"),  # realisations of one datum
    ("box:11,55.4,24.1,69", "EPSG:3006", "EPSG:3045 EPSG:25833 EPSG:32633"),
]


@each(("region", "known", "others"), IN_FORCE)
def test_the_datum_in_force_comes_first(region, known, others):
    """Where the registry tells of what year datums are; realisations of one are as old as each other."""
    codes = [*others.split(), known]
    usage = {
        code: {"datum_since": facts.since or None, "special": facts.special} for code, facts in facts_of(codes).items()
    }
    (group,) = ranking.grouped(tried(codes, region, **usage))
    assert ranking.by_usage(group, RECORDS)[0].code == known


def test_national_crss_and_those_for_the_whole_region_come_first():
    """Kenya's own UTM zone before that of the world, which is on a newer datum; the only one for the whole region."""
    usage = {"EPSG:21037": {"national": True, "datum_since": 1960}, "EPSG:32737": {"datum_since": 1984}}
    group = tried(["EPSG:32737", "EPSG:21037"], "box:36,-4,41,4", **usage)
    assert [one.code for one in ranking.by_usage(group, RECORDS)] == ["EPSG:21037", "EPSG:32737"]
    codes = ["EPSG:3003", "EPSG:3064", "EPSG:25832"]
    group = tried(codes, "box:6.1,40,11.9,50", **{"EPSG:3003": {"holds": True}})
    assert ranking.by_usage(group, RECORDS)[0].code == "EPSG:3003"


@each(("datum", "root"), [
    ("NAD83(2011)", "NAD83"), ("RGF93 v2b", "RGF93"), ("S-JTSK [JTSK03]", "S-JTSK"), ("ETRS89/DREF91/2016", "ETRS89"),
    ("CH1903+", "CH1903+"), ("SIRGAS-Chile 2021", "SIRGAS-Chile 2021"),
])  # fmt: skip
def test_realisations(datum, root):
    """What follows the name of a datum tells its realisations; a year in the name tells another datum."""
    assert ranking.datum_root(datum) == root


def test_figures_that_agree():
    """To one per cent of the least of a group; the next begins another."""
    near, far = 1.0 + 0.9 * ranking._CLOSE, 1.0 + 1.2 * ranking._CLOSE
    assert ranking._close([2.0, 1.0, near, 2.0 * near, far], float) == [[1.0, near], [far], [2.0, 2.0 * near]]
