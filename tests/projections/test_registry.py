"""What the registry says of CRSs, against its own documents."""

import pytest
from tables import each

from projdist.projections import catalogue
from projdist.projections.database import facts_of, year_of


@pytest.mark.parametrize(
    ("code", "since"),
    [
        ("EPSG:7855", {2017}),  # GDA2020
        ("EPSG:2056", {1995}),  # CH1903+
        ("EPSG:25832", {1989, 1990}),  # ETRS89, an ensemble: ETRF89, of 1990 in EPSG v11.022, of 1989 in v12.029
        ("EPSG:32632", {1984}),  # WGS 84, an ensemble: Transit
        ("EPSG:28992", {0}),  # Amersfoort: EPSG tells no date
    ],
)
def test_years_of_datums(code, since):
    """The year of publication, of an ensemble that of its first member."""
    assert facts_of([code])[code].since in since


@each(
    ("date", "year"), [("1995-03-07", 1995), ("2011", 2011), ("March 2011", 2011), ("unknown", 0), ("", 0), (None, 0)]
)
def test_years_of_dates(date, year):
    """As EPSG writes them; v12 has Uganda's datum of March 2011."""
    assert year_of(date) == year


def test_maps_but_for_false_origins():
    """Hemispheres of a zone are one map, and so are zone numbers in eastings; other meridians or scales are not."""
    codes = [
        "EPSG:32637",
        "EPSG:32737",
        "EPSG:21037",
        "EPSG:4491",
        "EPSG:4502",
        "EPSG:32636",
        "EPSG:27572",
        "EPSG:2154",
    ]
    drawn = {code: facts.draws for code, facts in facts_of(codes).items()}
    assert drawn["EPSG:32637"] == drawn["EPSG:32737"] == drawn["EPSG:21037"]
    assert drawn["EPSG:4491"] == drawn["EPSG:4502"]
    assert len({drawn[code] for code in codes}) == 5


@pytest.mark.parametrize(
    ("code", "special"),
    [("EPSG:25832", False), ("EPSG:32632", True), ("EPSG:2056", False), ("ESRI:102173", True), ("EPSG:5682", True)],
)
def test_scopes(code, special):
    """Surveys and maps are for all; navigation, railways and what nobody states are not."""
    assert facts_of([code])[code].special == special


def test_many_codes_and_none():
    """More codes than a query takes; codes that are none are left out."""
    codes = [f"EPSG:{code}" for code in range(31900, 33000)]
    found = facts_of(codes)
    assert {"EPSG:31978", "EPSG:32632", "EPSG:32760"} <= set(found)
    assert facts_of(["EPSG:1", "nothing"]) == {}


def test_no_database(monkeypatch, tmp_path):
    """Where PROJ's database is no file nothing is known."""
    monkeypatch.setattr(catalogue, "get_data_dir", lambda: str(tmp_path))
    assert facts_of(["EPSG:2056"]) == {}
