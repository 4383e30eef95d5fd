"""The command `find`."""

import re

import pytest
from commands import parse_csv, parse_markdown, refused, run, run_json, run_ok


def test_a_table() -> None:
    """The likeliest first, and how many more there are."""
    text = run_ok("find", "lambert", "93", "--limit", "2")
    assert "│ EPSG:2154 │ RGF93 v1 / Lambert-93 │ France      │" in text
    assert re.search(r"\n\d+ more: --limit \d+ shows all\.\n$", text)
    assert "(deprecated)" in run_ok("find", "2036")
    assert "more" not in run_ok("find", "EPSG:3035")


def test_formats() -> None:
    found = run_json("find", "utm 33", "--authority", "EPSG", "--limit", "1")
    assert [hit["code"] for hit in found["results"]] == ["EPSG:32633"]
    (row,) = parse_csv(run_ok("find", "EPSG:3035", "-f", "csv"))
    assert (row["code"], row["west"], row["deprecated"]) == ("EPSG:3035", "-35.58", "False")
    assert parse_markdown(run_ok("find", "EPSG:3035", "-f", "markdown"))[0]["code"] == "EPSG:3035"


@pytest.mark.slow
@pytest.mark.parametrize("form", ["table", "json", "csv"])
def test_nothing(form: str) -> None:
    """One line, and 1."""
    result = run("find", "amersfort", "-f", form)
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == "projdist: Nothing is found for 'amersfort'. Did you mean 'amersfoort'?\n"


USAGE = {
    "find": "Missing argument 'WORDS...'",
    "find utm --limit 0": "Invalid limit '0'",
    "find utm --authority EPGS": r"Invalid authority 'EPGS'. Did you mean EPSG\?",
    "find !!": "Invalid search '!!'. It must have a word or a number.",
    "find utm -f xml": "Invalid format 'xml'",
}


@pytest.mark.parametrize("line", USAGE)
def test_wrong_words(line: str) -> None:
    assert re.search(USAGE[line], refused(*line.split()))
