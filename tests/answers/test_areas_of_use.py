"""Regions and points that lie elsewhere than a CRS is meant for: told once a map, and only there."""

import numpy as np
import pytest
from tables import each

from projdist import Notice, compare, correct, factors, summarize

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


@each(
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


SWISS = r"^EPSG:2056 is for box:5\.9\d,45\.8\d,10\.\d+,47\.81: "  # to which PROJ 9.8 adds a hundredth of a degree
SWAPPED = r" With longitude and latitude swapped {} inside: longitudes come first\."


@pytest.mark.parametrize(
    ("lon", "lat", "text"),
    [
        (47, 8, "the point lies outside its area of use." + SWAPPED.format("it lies")),
        (2, 48, r"the point lies outside its area of use\."),
        ([8, 47, 2, np.nan], [47, 8, 48, 0], "2 of 3 points lie outside its area of use." + SWAPPED.format("1 of .*")),
        ([[47], [46]], [7, 8], "4 of 4 points lie outside its area of use." + SWAPPED.format("4 of them lie")),
        ([8, 5.9], [47, 47], r"1 of 2 points lie outside its area of use\."),
    ],
)
def test_points_elsewhere_are_told(lon, lat, text):
    """How many of those that are there, and how many of these lie inside as latitudes and longitudes."""
    with pytest.warns(Notice, match=f"{SWISS}{text}$") as notices:
        found = factors("EPSG:2056", lon, lat)
    assert len([one for one in notices if one.category is Notice]) == 1
    assert np.isfinite(found.k[np.isfinite(found.lon)]).all()


@pytest.mark.parametrize(
    ("projection", "lon", "lat"),
    [
        ("EPSG:2056", [5.96, 10.49, 365.96], [45.82, 47.81, 47]),  # the edge is inside, by any turn
        ("EPSG:2056", np.nan, 47),
        ("EPSG:3460", [179, -179], [-17, -17]),  # on both sides of the antimeridian
        ("+proj=utm +zone=33", 47, 8),  # has no area of use
    ],
)
def test_points_in_an_area_of_use_are_not(projection, lon, lat):
    """Nor are points that are nowhere; notices are errors in these tests."""
    factors(projection, lon, lat)
