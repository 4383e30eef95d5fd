"""The words of answers: bounds that hold however they are rounded, names of places, and zones by the compass."""

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest
from tables import each, some

from projdist.cli import recommend as recommending
from projdist.cli.wording import (
    angle_error,
    area_error,
    distance_error,
    errors_text,
    label_of,
    less_text,
    region_words,
    spoken,
)
from projdist.decisions import recommend
from projdist.regions import get_region

SYSTEMS = Path(__file__).parents[1] / "data" / "national_systems.csv"


ERRORS = [
    *((0.0, "true", "true"), (4e-4, "1 in 2,500", "0.04 %"), (1764.33e-6, "1 in 560", "0.18 %")),  # 1 in 566.8
    *((0.0196, "1 in 51", "2 %"), (0.0234, "2.4 %", "2.4 %"), (1.2, "a factor of 2.2", "a factor of 2.2")),
    (math.inf, "without bound", "without bound"),
]


@each(("error", "distances", "areas"), ERRORS)
def test_errors_in_words(error: float, distances: str, areas: str) -> None:
    assert (distance_error(error), area_error(error)) == (distances, areas)


def test_bounds_hold() -> None:
    """What is told is never less than the error, and at most a tenth more."""
    for error in 10.0 ** np.random.default_rng(1).uniform(-6.9, 2.0, 2000):
        told = distance_error(error)
        number = float(re.sub(r"1 in |a factor of |[ ,%]", "", told))
        bound = 1.0 / number if told.startswith("1 in") else number - 1.0 if "factor" in told else number / 100.0
        assert error * (1.0 - 1e-6) <= bound <= 1.101 * error + (0.1 * (1.0 + error) if "factor" in told else 0.0)
    assert [angle_error(one) for one in (1e-6, 0.0961, 179.9)] == ["true", "0.097°", "without bound"]


def test_sentences() -> None:
    """What is true, off and without bound stand apart."""
    told = "distances are off by at most 1 in 1,100 and angles by 0.097°; areas are true"
    assert errors_text(839e-6, 0.0, 0.0961) == told
    assert errors_text(0.0, 0.0, 0.0) == "distances, areas and angles are true"
    assert errors_text(math.inf, 0.0, 180.0) == "distances and angles are off without bound; areas are true"
    told = "on average distances are off by 34 %, areas by 17 % and angles by 24°"
    assert errors_text(0.34, 0.17, 24.0, mean=True) == told
    assert [less_text(ratio) for ratio in (1.25, 4.0, 1e6)] == ["20 % less", "75 % less", "99 % less"]


PLACES = {
    "country:KE": "Kenya",
    "country:PH": "the Philippines",
    "country:NL@main": "the main part of the Netherlands",
    "globe": "the globe",
    "box:-180,-85,180,85": "85°S to 85°N",
    "box:6,47,12,55": "6°E to 12°E, 47°N to 55°N",
}


@each("region", PLACES)
def test_places(region: str) -> None:
    assert region_words(get_region(region)) == PLACES[region]


@pytest.mark.slow
def test_zones_by_the_compass() -> None:
    """Kenya has the equator and the meridian of 36 degrees east across it, Chile that of 72 degrees west."""
    kenya, chile = (recommend(region, limit=1).zones[0].zones for region in ("country:KE", "country:CL@main"))
    corners = {
        "EPSG:21036": "southwest",
        "EPSG:21037": "southeast",
        "EPSG:21096": "northwest",
        "EPSG:21097": "northeast",
    }
    assert {zone.code: zone.part for zone in kenya} == corners
    assert {zone.code: zone.part for zone in chile} == {"EPSG:20048": "southwest", "EPSG:20049": "northeast"}


@pytest.mark.slow
def test_what_the_agencies_use_is_said() -> None:
    """The answer has a code of the agency's system, or its zones are within those named, in 49 of fifty countries."""
    said: dict[str, bool] = {}
    rows = [*csv.DictReader(SYSTEMS.read_text(encoding="utf-8").splitlines())]
    asked = some(sorted({row["iso"] for row in rows}), 4)
    for row in (row for row in rows if row["iso"] in asked):
        if said.get(row["iso"]):
            continue
        found = recommend(row["region"], purpose=row["purpose"], limit=3)
        text = " ".join(recommending._answer(found, recommending._Use()))
        told = set(re.findall(r"EPSG:\d+", text))
        first = {code for one in recommending._best(found)[:1] for code in one.codes if told & {one.code}}
        zones = recommending._own_zones(found)
        between = set() if zones is None else {one.code for one in zones.zones}
        said[row["iso"]] = bool((told | first | between) & set(row["codes"].split()))
    assert sum(said.values()) >= len(asked) - 1


@each(("given", "name", "label", "sentence"), [
    ("robin", "Robinson", "robin", "Robinson"),
    ("+proj=moll +R=6371008.7714", "Mollweide", "+proj=moll +R=6371008.7714", "Mollweide"),
    ("utm 31n", "WGS 84 / UTM zone 31N", "WGS 84 / UTM zone 31N", "WGS 84 / UTM zone 31N"),
    ("+proj=laea +lat_0=3", "Lambert azimuthal equal-area", "+proj=laea +lat_0=3", "+proj=laea +lat_0=3"),
    ("EPSG:3035", "ETRS89-extended / LAEA Europe", "EPSG:3035", "EPSG:3035"),
])  # fmt: skip
def test_maps_by_name(given: str, name: str, label: str, sentence: str) -> None:
    """Ids are names in sentences, and words by which a CRS was found are its name everywhere."""
    assert (label_of(given, name), spoken(given, name)) == (label, sentence)
