"""The order of maps, from figures and uses that are made up."""

import dataclasses

import pytest
from sample_candidates import NATIONAL as OWN
from tables import each

from projdist.decisions.candidate_crs import is_own, is_wide, named
from projdist.decisions.ranking import (
    CLOSE,
    WIDE_FACTOR,
    is_close,
    preferred,
    tiers,
    weight_of,
)
from projdist.projections.database import CrsRecord, crs_records, facts_of

OLD = dataclasses.replace(OWN, datum_since=1950, datum="Old")
OTHER = dataclasses.replace(OWN, national=False)


def test_weight():
    """A figure counts over the share that its area of use has of the region, and more for a map of the world."""
    assert weight_of(OWN, 0.99) == 1.0
    assert weight_of(dataclasses.replace(OWN, share=0.5), 0.99) == 2.0
    assert weight_of(dataclasses.replace(OTHER, wide=True), 0.99) == WIDE_FACTOR
    assert weight_of(dataclasses.replace(OTHER, wide=True, share=0.25), 0.99) == 4.0 * WIDE_FACTOR


def test_a_country_is_before_the_world():
    """Unless the map of the world is better by the factor."""
    world = dataclasses.replace(OTHER, wide=True)
    for better, first in ((0.99 * WIDE_FACTOR, False), (1.01 * WIDE_FACTOR, True)):
        assert (weight_of(world, 0.99) < better * weight_of(OWN, 0.99)) == first


def numbered(keys, close):
    """The tiers of maps with these keys, each map by its number."""
    maps = [dataclasses.replace(OWN, code=str(number), key=key) for number, key in enumerate(keys)]
    return [[int(one.code) for one in tier] for tier in tiers(maps, close)]


def test_tiers():
    """Each begins with its best, and ends where figures are farther from that than is close; figures do not chain."""
    figures = [1.0, 1.05, 1.09, 1.12, 1.2, 3.0]
    assert numbered([(value, 0.0) for value in reversed(figures)], 0.1) == [[5, 4, 3], [2, 1], [0]]
    assert numbered([(value, 0.0) for value in figures], 0.0) == [[0], [1], [2], [3], [4], [5]]
    assert tiers([], CLOSE) == []


def test_figures_that_vanish_are_told_apart_by_levels():
    """And are close to no figure, however small."""
    assert numbered([(0.0, 2.0), (1e-9, 1.0), (0.0, 1.0), (0.0, 1.05)], 0.1) == [[2, 3], [0], [1]]
    assert is_close((0.0, 1.05), (0.0, 1.0), 0.1)
    assert not is_close((1e-9, 1.0), (0.0, 1.0), 0.1)


@each(
    ("maps", "order"),
    [
        ([OTHER, OWN], [1, 0]),
        ([OLD, OWN], [1, 0]),
        ([dataclasses.replace(OLD, datum_since=None), OWN], [0, 1]),  # an unknown year is no reason
        ([dataclasses.replace(OLD, datum="New(1950)"), OWN], [0, 1]),  # another realisation of the same
        ([dataclasses.replace(OWN, special=True), OLD], [1, 0]),
        ([OTHER, OTHER], [0, 1]),
    ],
)
def test_preferred(maps, order):
    """National maps first, for general use, on the datum in force; else the smaller figure, which the first has."""
    first, second = (dataclasses.replace(one, key=(key, 0.0)) for one, key in zip(maps, (1.0, 1.05), strict=True))
    assert preferred([first, second]) == [(first, second)[number] for number in order]


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


@each(
    ("code", "home", "own"),
    [
        ("EPSG:25832", "Germany", True),
        ("EPSG:32632", "Germany", False),
        ("EPSG:3035", "Germany", False),  # of 45 countries
        ("EPSG:31978", "Brazil", True),
        ("EPSG:21037", "Kenya", True),
        ("EPSG:27700", "United Kingdom", True),
        ("EPSG:27700", "Ireland", False),
        ("EPSG:3979", "Canada", True),  # as wide as a continent, and of Canada alone
        ("ESRI:102009", "Mexico", False),  # North America's
    ],
)
def test_own(code, home, own):
    """Systems of EPSG's registry that are a country's own, or one of a few countries'; a continent's are nobody's."""
    (record,) = (record for record in crs_records(["EPSG", "ESRI"]) if record.code == code)
    assert is_own(record, named(facts_of([code])[code].extents), home) == own


@each(
    ("key", "least", "expected"),
    [
        ((1099.0, 9.0), (1000.0, 1.0), True),
        ((1101.0, 0.0), (1000.0, 1.0), False),
        ((1.09e-3, 0.0), (1e-3, 0.0), True),
        ((1.11e-3, 0.0), (1e-3, 0.0), False),
        ((0.0, 1.09e-3), (0.0, 1e-3), True),
        ((0.0, 1.11e-3), (0.0, 1e-3), False),
        ((1e-9, 1e-3), (0.0, 1e-3), False),
    ],
)
def test_close_is_a_share_of_the_figure(key, least, expected):
    """Of the least one, whatever its size and unit; of the level where the figure vanishes."""
    assert is_close(key, least, 0.1) == expected
