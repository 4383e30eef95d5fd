"""Regions that lie elsewhere than a CRS is meant for: told once a map, and only there."""

import pytest

from projdist import Notice, compare, correct, summarize

LAMBERT_93 = "EPSG:2154 is for box:-9.86,41.15,10.38,51.56, where"
# 0.35 %: half the difference of the sines of the authalic latitudes, of 20.24 degrees of 360.
ELSEWHERE = [
    (
        "EPSG:2154",
        "globe",
        rf"^{LAMBERT_93} 0\.35 % of globe lies: its figures are mostly of places outside its area of use",
    ),
    ("EPSG:2154", "country:DE", rf"^{LAMBERT_93} 32 % of country:DE lies: "),
    ("EPSG:2154", "country:FJ", rf"^{LAMBERT_93} nothing of country:FJ lies: "),
    ("EPSG:32760", "box:-180,-20,-170,-10", r"^EPSG:32760 is for box:174,-80,180,0, where nothing of box:"),
]


@pytest.mark.parametrize(("projection", "region", "text"), ELSEWHERE)
def test_areas_of_use_elsewhere_are_told(projection, region, text):
    """Where less than half of the region lies in the area of use: once a map, and compare tells as summarize does."""
    for found in (summarize, lambda one, *rest, **options: compare(["robin", one, "moll"], *rest, **options)):
        with pytest.warns(Notice, match=text) as notices:
            found(projection, region, tolerance=1e-2)
        assert len([one for one in notices if "area of use" in str(one.message)]) == 1


@pytest.mark.parametrize(
    ("projection", "region"),
    [
        ("EPSG:2154", "country:FR@main"),
        ("EPSG:25832", "country:DE"),
        ("EPSG:3857", "globe"),
        ("EPSG:3460", "country:FJ"),  # on both sides of the antimeridian
        ("+proj=utm +zone=33", "country:DE"),  # has no area of use
        ("robin", "globe"),
    ],
)
def test_regions_mostly_in_an_area_of_use_are_not(projection, region):
    """Nor are maps without one; notices are errors in these tests."""
    summarize(projection, region, tolerance=1e-2)


def test_corrections_are_silent_about_areas_of_use():
    """It is one map, of which the region was chosen."""
    correct("EPSG:2154", "box:6,47,15,55", tolerance=1e-2)
