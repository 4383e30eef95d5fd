"""CRSs of the same map: that they are found to be the same, and which of them is named first."""

import pytest

from projdist.candidates import Finding, Trial, try_crs
from projdist.probe import probe_of
from projdist.projections.database import AUTHORITIES, crs_records
from projdist.regions import get_region
from projdist.twins import by_usage, grouped

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


@pytest.mark.parametrize(("region", "known", "others"), KNOWN, ids=[known for _, known, _ in KNOWN])
def test_the_known_name_comes_first(region, known, others):
    """Whatever the order in which they are found."""
    codes = [*others.split(), known]
    probe = probe_of(get_region(region))
    found = [try_crs(Trial(code, RECORDS[code].name, probe, "airy_kavrayskiy")) for code in codes]
    assert all(isinstance(one, Finding) for one in found)
    (group,) = grouped(found)
    for holding in (set(codes), set()):
        assert by_usage(group, RECORDS, holding)[0].code == known
        assert by_usage(group[::-1], RECORDS, holding) == by_usage(group, RECORDS, holding)


def test_the_area_of_use_comes_before_all():
    """Where only one CRS of a map is for the whole region, it is named."""
    probe = probe_of(get_region("box:6.1,40,11.9,50"))
    group = [try_crs(Trial(code, "", probe, "airy_kavrayskiy")) for code in ("EPSG:3003", "EPSG:3064", "EPSG:25832")]
    assert by_usage(group, RECORDS, {"EPSG:3003"})[0].code == "EPSG:3003"
