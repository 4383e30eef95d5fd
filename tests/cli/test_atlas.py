"""The command `atlas`."""

import re

import pytest
from commands import parse_csv, parse_markdown, refused, run_json, run_ok

from projdist import atlas, atlas_names


def test_a_table() -> None:
    """The official CRS first, then the best of each purpose; what the words mean; and the versions."""
    text = run_ok("atlas", "NZ")
    lines = text.splitlines()
    assert lines[0].startswith("New Zealand (26")
    assert "│ official │ EPSG:2193" in lines[4]
    assert "New Zealand Transverse Mercator 2000" in text
    assert re.search(r"Measured with projdist \S+ and PROJ \S+", text)


def test_formats() -> None:
    entry = atlas("NZ")
    assert run_json("atlas", "new zealand") == entry.to_dict()
    rows = parse_csv(run_ok("atlas", "NZ", "-f", "csv"))
    assert [row["projection"] for row in rows] == [row["projection"] for row in entry.rows()]
    assert parse_markdown(run_ok("atlas", "NZ", "-f", "markdown"))[0]["map"] == "EPSG:2193"


@pytest.mark.slow
def test_all_places() -> None:
    """Without a place, a row each."""
    rows = parse_csv(run_ok("atlas", "-f", "csv"))
    assert len(rows) == len(atlas_names())
    (row,) = (row for row in rows if row["place"] == "New Zealand")
    assert (row["official"], row["kind"]) == ("EPSG:2193", "country")
    assert len(run_json("atlas")["entries"]) == len(rows)


USAGE = {
    "atlas Brazl": r"Invalid place 'Brazl'. Did you mean country:Brazil\?",
    "atlas box:1,2,3,4": r"It must be one of those that 'projdist atlas' \(atlas_names\) lists.",
    "atlas NZ -f xml": "Invalid format 'xml'",
    "atlas NZ AU": "AU",
}


@pytest.mark.parametrize("line", USAGE)
def test_wrong_words(line: str) -> None:
    assert re.search(USAGE[line], refused(*line.split()))
