"""CRSs of the same map: that they are found to be the same, and which of them is named first."""

from dataclasses import replace

from tables import each

from projdist import FIGURES
from projdist.decisions import ranking as preference
from projdist.decisions.candidate_crs import Candidate, try_crs
from projdist.decisions.measurement import probe_of
from projdist.decisions.ranking import by_usage, datum_root, grouped
from projdist.projections.database import AUTHORITIES, crs_records, facts_of
from projdist.regions import get_region

GERMANY, WEST = "box:5.9,47.3,15.0,55.1", "box:7.5,48,10.4,54"

# Maps that people know by the first code, and CRSs that draw the same.
KNOWN = [
    (GERMANY, "EPSG:25832", "EPSG:4647 EPSG:5652 EPSG:10288 EPSG:10289 EPSG:10732 EPSG:3044 EPSG:32632 EPSG:23032"),
    (WEST, "EPSG:31467", "EPSG:5677 EPSG:5683 ESRI:103974"),
    ("box:6,45.9,10.4,47.8", "EPSG:2056", "EPSG:21780 EPSG:21781"),
    ("box:9.6,46.5,17.1,49", "EPSG:3416", "EPSG:31287"),
    ("box:-106.6,25.9,-93.6,36.4", "EPSG:3083", "EPSG:3085 EPSG:3665 EPSG:6579 EPSG:10481"),
    ("box:-5,42.5,8,51", "EPSG:2154", "EPSG:9793 EPSG:9794"),
    ("box:3.4,50.8,7.2,53.5", "EPSG:28992", "EPSG:28991"),
    ("box:12.1,48.6,18.8,51", "EPSG:5514", "EPSG:5513 EPSG:2065 EPSG:5221"),
    ("box:-72,-55,-66,-18", "EPSG:5361", "EPSG:9155 EPSG:20049 EPSG:31979 EPSG:32719 EPSG:24879"),
    ("box:11,55.4,24.1,69", "EPSG:3006", "EPSG:3045 EPSG:25833 EPSG:32633"),
    ("box:14.2,49.1,24.1,54.8", "EPSG:2180", "ESRI:102173 ESRI:102194"),
    ("box:113,-43,153,-10", "EPSG:3577", "EPSG:9473"),
    ("box:-6,36,0,43", "EPSG:25830", "EPSG:3042 EPSG:32630 EPSG:23030"),
    ("box:168,-47,174,-40", "EPSG:2134", "EPSG:32759 EPSG:27259"),
]

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
    (group,) = grouped(tried(codes, region))
    for holds in (True, False):
        used = [replace(one, holds=holds) for one in group]
        assert by_usage(used, RECORDS)[0].code == known
        assert by_usage(used[::-1], RECORDS) == by_usage(used, RECORDS)


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
    (group,) = grouped(tried(codes, region, **usage))
    assert by_usage(group, RECORDS)[0].code == known


def test_a_national_crs_comes_before_others():
    """Kenya's own UTM zone before that of the world, which is on a newer datum."""
    usage = {"EPSG:21037": {"national": True, "datum_since": 1960}, "EPSG:32737": {"datum_since": 1984}}
    group = tried(["EPSG:32737", "EPSG:21037"], "box:36,-4,41,4", **usage)
    assert [one.code for one in by_usage(group, RECORDS)] == ["EPSG:21037", "EPSG:32737"]


@each(
    ("datum", "root"),
    [
        ("NAD83(2011)", "NAD83"),
        ("RGF93 v2b", "RGF93"),
        ("S-JTSK [JTSK03]", "S-JTSK"),
        ("ETRS89/DREF91/2016", "ETRS89"),
        ("CH1903+", "CH1903+"),
        ("SIRGAS-Chile 2021", "SIRGAS-Chile 2021"),
    ],
)
def test_realisations(datum, root):
    """What follows the name of a datum tells its realisations; a year in the name tells another datum."""
    assert datum_root(datum) == root


def test_the_area_of_use_comes_before_all():
    """Where only one CRS of a map is for the whole region, it is named."""
    codes = ["EPSG:3003", "EPSG:3064", "EPSG:25832"]
    group = tried(codes, "box:6.1,40,11.9,50", **{"EPSG:3003": {"holds": True}})
    assert by_usage(group, RECORDS)[0].code == "EPSG:3003"


def test_figures_that_agree():
    """To one per cent of the least of a group; the next begins another."""
    sizes = [
        2.0,
        1.0,
        1.0 + 0.9 * preference._CLOSE,
        2.0 * (1.0 + 0.9 * preference._CLOSE),
        1.0 + 1.2 * preference._CLOSE,
    ]
    found = preference._close(sizes, float)
    assert found == [
        [1.0, 1.0 + 0.9 * preference._CLOSE],
        [1.0 + 1.2 * preference._CLOSE],
        [2.0, 2.0 * (1.0 + 0.9 * preference._CLOSE)],
    ]
