"""The command `factors`, and the points that it reads."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from commands import FORMATS, HIDDEN, parse_csv, parse_markdown, refused, run, run_json, run_ok
from tables import each

from projdist import Notice, factors
from projdist.cli.factors import read_points

FACTORS_KEYS = ["lon", "lat", "x", "y", "h", "k", "a", "b", "s", "omega", "theta", "convergence", "fisher", "quality"]


def test_factors_json() -> None:
    """These keys and no others, and the very numbers of `factors`."""
    found = run_json("factors", "winkel-tripel", "10", "20", "-150.5", "-60")
    assert list(found) == ["projection", "name", "definition", "results"]
    assert (found["projection"], found["name"]) == ("winkel-tripel", "Winkel Tripel")
    assert found["definition"].startswith("+proj=wintri +R=6371008.77")
    assert [list(row) for row in found["results"]] == [FACTORS_KEYS, FACTORS_KEYS]
    expected = factors("winkel-tripel", [10, -150.5], [20, -60])
    for name in FACTORS_KEYS:
        assert [row[name] for row in found["results"]] == getattr(expected, name).tolist()


@pytest.mark.parametrize(
    ("given", "title"),
    [
        ("krovak", "krovak (+proj=krovak +ellps=bessel)"),
        ("utm33", "utm33 (EPSG:32633)"),
        ("EPSG:5514", "EPSG:5514"),
        ("+proj=moll +R=1", "+proj=moll +R=1"),
    ],
)
def test_factors_name_what_they_measure(given: str, title: str, tmp_path: Path) -> None:
    """The figure of the Earth of a name, which it does not tell, stands in its definition; also of points in a file."""
    assert title in run_ok("factors", given, "15", "50", "--details").splitlines()
    (tmp_path / "p.csv").write_text("lon,lat\n15,50\n")
    words = ["factors", given, "--at", str(tmp_path / "p.csv")]
    assert title in run_ok(*words, "--details").splitlines()
    found = run_json(*words)
    assert found["projection"] == given
    assert title.rstrip(")").endswith(found["definition"])


def test_factors_json_has_null_where_undefined() -> None:
    """Beyond the horizon nothing is defined: null, with the quality that says so."""
    (row,) = run_json("factors", "+proj=ortho +lat_0=90 +R=6371000", "0", "-80")["results"]
    assert row["quality"] == "outside"
    assert {row[name] for name in FACTORS_KEYS if name not in ("lon", "lat", "quality")} == {None}


@each(
    "words",
    [
        ["robin", "-10", "-20"],
        ["robin", "-1e1", "-2e+1"],
        ["robin", "-10.", "-20.0"],
        ["-m", "h", "robin", "-10", "-20"],
        ["robin", "-10", "-m", "h", "-20"],
        ["robin", "--", "-10", "-20"],
        ["--", "robin", "-10", "-20"],
        ["robin", " -10", "-20 "],
        ["robin", "-10", "-.2e2"],
    ],
)
def test_factors_negative_numbers(words: list[str]) -> None:
    """Negative numbers are numbers, with or without `--`, wherever options stand."""
    words = ["-m", "ppm", "-f", "json", *words]
    (row,) = json.loads(run_ok("factors", *words))["results"]
    assert (row["lon"], row["lat"]) == (-10, -20)


def test_factors_measures() -> None:
    (row,) = run_json("factors", "robin", "10", "20", "-m", "flexion,skewness", "-m", "scale@45")["results"]
    assert list(row) == [*FACTORS_KEYS, "flexion", "skewness", "scale@45"]


def test_factors_csv_and_markdown() -> None:
    """A row a point: all digits in CSV, readable ones in Markdown; in tables `-` where undefined, no negative zero."""
    words = ["factors", "robin", "10", "20", "-30", "-40"]
    expected = run_json(*words)["results"]
    for row, wanted in zip(parse_csv(run_ok(*words, "-f", "csv")), expected, strict=True):
        assert list(row) == FACTORS_KEYS
        assert float(row["omega"]) == wanted["omega"]
    for row, wanted in zip(parse_markdown(run_ok(*words, "-f", "markdown")), expected, strict=True):
        assert float(row["h"]) == pytest.approx(wanted["h"], abs=1e-8)
    text = run_ok("factors", "EPSG:32632", "9", "0", "9", "45", "--details")
    assert "\nEPSG:32632\n" in text
    assert "0.99960000" in text
    assert "-0.000000" not in text
    (line,) = [line for line in run_ok("factors", HIDDEN[0], "0", "-80", "--details").splitlines() if "outside" in line]
    assert line.count(" - ") == 11


def test_factors_csv_without_points(tmp_path: Path) -> None:
    """The header is what it always is: of lines that cannot be read, and of tables without rows."""
    header = ",".join([*FACTORS_KEYS, "flexion"]) + "\n"
    words = ["factors", "robin", "-m", "flexion", "-f", "csv"]
    result = run(*words, "-", stdin="a b\nc d\n")
    assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (1, header, 2)
    (tmp_path / "p.csv").write_text("lon,lat\n")
    assert run_ok(*words, "--at", str(tmp_path / "p.csv")) == header
    assert run_ok(*words[:-2], "--at", str(tmp_path / "p.csv"), "-o", str(tmp_path / "o.csv"))
    assert (tmp_path / "o.csv").read_text() == header


def test_factors_looks_at_the_projection_first() -> None:
    """Before it waits for lines, and before it reads coordinates of which the first was taken for a projection."""
    for words in (["nosuch", "1", "2"], ["nosuch", "-"], ["5", "6"]):
        assert refused("factors", *words, code=1).startswith(f"projdist: Invalid projection '{words[0]}'. ")


LINES = """\ufeff# longitude latitude name
10 20 Ab c, d
-10,-20,Zürich|x
 -.5\t1e1
3
foo bar

8 95 beyond
720 -90  *last*
"""


def test_factors_stdin_json() -> None:
    """Points in their order with the text that came with them; bad lines by their number, and exit code 1."""
    result = run("factors", "robin", "-", "-f", "json", stdin=LINES)
    assert result.exit_code == 1
    rows = json.loads(result.stdout)["results"]
    assert [(row["lon"], row["lat"], row["text"]) for row in rows] == [
        (10, 20, "Ab c, d"),
        (-10, -20, "Zürich|x"),
        (-0.5, 10, ""),
        (720, -90, "*last*"),
    ]
    assert result.stderr.splitlines() == [
        "projdist: line 5: Invalid point '3'. It must be 'lon lat [text]'.",
        "projdist: line 6: Invalid point 'foo bar'. Longitude and latitude must be numbers of degrees.",
        "projdist: line 8: Invalid latitude '95'. It must lie within -90 and 90 degrees.",
    ]
    rows = parse_csv(run_ok("factors", "robin", "-", "-f", "csv", stdin="1 2\n3,4\n"))
    assert [list(row) for row in rows] == [FACTORS_KEYS, FACTORS_KEYS]


@pytest.mark.parametrize("form", ["csv", "markdown", "table"])
def test_factors_stdin_text(form: str) -> None:
    """The text is kept in every format, and escaped where the format asks for it."""
    result = run("factors", "robin", "-", "-f", form, stdin=LINES)
    assert result.exit_code == 1
    if form == "csv":
        assert [row["text"] for row in parse_csv(result.stdout)] == ["Ab c, d", "Zürich|x", "", "*last*"]
    elif form == "markdown":
        rows = parse_markdown(result.stdout)
        assert [row["text"] for row in rows] == ["Ab c, d", "Zürich\\|x", "", "\\*last\\*"]
    else:
        assert all(text in result.stdout for text in ("Ab c, d", "Zürich|x", "*last*"))


@pytest.mark.parametrize("text", ["", "\n\n", "# only a remark\n"])
def test_factors_stdin_empty(text: str) -> None:
    assert "It must have lines of 'lon lat [text]'; there were none." in refused("factors", "robin", "-", stdin=text)


@pytest.mark.parametrize("form", FORMATS)
def test_factors_stdin_of_bad_lines_only(form: str) -> None:
    """What there is of results, which is none, still parses."""
    result = run("factors", "robin", "-", "-f", form, stdin="a\nb c\n")
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    if form == "json":
        assert json.loads(result.stdout)["results"] == []
    if form == "csv":
        assert parse_csv(result.stdout) == []


def test_factors_stdin_of_bytes() -> None:
    """Lines of any bytes are told without sending these to the terminal, and each in a line of its own length."""
    result = run("factors", "robin", "-", stdin=b"\x1b[31mred\n1 2\n\0 \x07" + b"x" * 1000)
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    assert all(line.isprintable() and len(line) < 200 for line in result.stderr.splitlines())


# ---- points as people write them -----------------------------------------------------------------


@each(
    ("words", "points"),
    [
        ("10 50", [(10, 50)]),
        ("10,50 -20.5,-30", [(10, 50), (-20.5, -30)]),
        ("10, 50", [(10, 50)]),
        ("50N 10E", [(10, 50)]),
        ("10W 50s", [(-10, -50)]),
        ("50N,10W", [(-10, 50)]),
        ("10d30' 50°30'", [(10.5, 50.5)]),
        ("50°30'36\"N 10°15'W", [(-10.25, 50.51)]),
        ("-10d30 0", [(-10.5, 0)]),
        ("1e1 5e1", [(10, 50)]),
    ],
)
def test_points_in_words(words: str, points: list[tuple[float, float]]) -> None:
    """Longitude first, but where letters say otherwise; minutes are sixtieths."""
    found = read_points(words.split(), [])
    assert found.lon == pytest.approx([lon for lon, _ in points], abs=1e-12)
    assert found.lat == pytest.approx([lat for _, lat in points], abs=1e-12)


@pytest.mark.parametrize("word", ["50N 10E", "50N, 10E", "10 50", "10 , 50", "50°0'N 10°0'E"])
def test_a_pair_may_be_one_word(word: str) -> None:
    """As it comes from a shell where it is quoted."""
    found = read_points([word], [])
    assert (found.lon, found.lat) == ([10], [50])


@each(
    ("words", "message"),
    [
        ("10N 50N", r"^Invalid point '10N 50N'\. One must be a longitude and one a latitude\.$"),
        ("10 50 20", r"^Invalid coordinates '10 50 20'\. They must be pairs"),
        ("10d60' 50", r"^Invalid point '10d60' 50'\. Longitude and latitude must be numbers"),
        ("10 90.5N", r"^Invalid latitude '90\.5N'\. It must lie within -90 and 90"),
        ("1,2,3 4", r"^Invalid point '1,2,3 4'\."),
        ("inf 5", r"^Invalid longitude 'inf'\."),
    ],
)
def test_words_that_are_no_points(words: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_points(words.split(), [])


@each(
    ("lines", "texts"),
    [
        (["lon lat name", "10 50 A", "20 60 B"], ["A", "B"]),
        (["# sites", "Name;Latitude;Longitude", "A;50;10", "B;60;20"], ["A", "B"]),
        (["name,lon,lat,town", "A,10,50,Ulm", "B,20,60,Bern"], ["A Ulm", "B Bern"]),
        (["A 10 50", "B, 20, 60"], ["A", "B"]),
        (["10 50 at the gate", "20E 60N"], ["at the gate", ""]),
        (["10,0;50,0;A", "20;60,0;B"], ["A", "B"]),
        (["Latitude;Longitude;Name", "50,0;10,0;A", "60,0;20;B"], ["A", "B"]),
        (["lat lng name", "50,0 1,0e1 A", "60,0 20 B"], ["A", "B"]),
        (["10,50 A", "20,60\tB"], ["A", "B"]),
    ],
)
def test_lines_may_have_a_header_and_names(lines: list[str], texts: list[str]) -> None:
    """In whatever order the header has them; without one a name may stand before or behind."""
    found = read_points(["-"], lines)
    assert (found.lon, found.lat, found.text, found.problems) == ([10, 20], [50, 60], texts, [])


def test_a_missing_coordinate_keeps_its_row() -> None:
    """It is nowhere, which is told, and the others go on."""
    with pytest.warns(Notice, match=r"^1 of 3 points have no longitude or no latitude; they have no figures\.$"):
        found = read_points(["-"], ["10 50", "nan 5", "x 7", "20 60"])
    assert math.isnan(found.lon[1])
    assert found.lat == [50, 5, 60]
    assert found.problems == ["line 3: Invalid point 'x 7'. Longitude and latitude must be numbers of degrees."]
    with pytest.warns(Notice, match=r"^2 of 3 points have no"):
        found = read_points(["-"], ["name,lon,lat", "A,10,50", "B,,51", "C,12,NA"])
    assert np.array_equal(found.lon, [10, np.nan, 12], equal_nan=True)
    assert np.array_equal(found.lat, [50, 51, np.nan], equal_nan=True)
    assert (found.text, found.problems) == (["A", "B", "C"], [])
    found = read_points(["-"], ["48,25 11,5", "10,50 7"])
    assert (found.lon, found.lat, found.text) == ([10], [50], ["7"])
    assert found.problems == [
        "line 1: Invalid point '48,25 11,5'. A semicolon must stand between numbers with decimal commas."
    ]
