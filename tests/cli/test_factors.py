"""The command `factors`, and the points that it reads."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from commands import FORMATS, HIDDEN, parse_csv, parse_markdown, refused, run, run_json, run_ok
from refusals import refuses
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


TITLES = {"krovak": "krovak (+proj=krovak +ellps=bessel)", "utm33": "utm33 (EPSG:32633)", "EPSG:5514": "EPSG:5514"}


@each(("given", "title"), [*TITLES.items(), ("+proj=moll +R=1", "+proj=moll +R=1")])
def test_factors_name_what_they_measure(given: str, title: str, tmp_path: Path) -> None:
    """The figure of the Earth of a name, which it does not tell, stands in its definition; also of points in a file."""
    assert title in run_ok("factors", given, "15", "50", "--details").splitlines()
    (tmp_path / "p.csv").write_text("lon,lat\n15,50\n")
    words = ["factors", given, "--at", tmp_path / "p.csv"]
    assert title in run_ok(*words, "--details").splitlines()
    found = run_json(*words)
    assert (found["projection"], title.rstrip(")").endswith(found["definition"])) == (given, True)


def test_factors_measures() -> None:
    """They stand behind the others; beyond the horizon nothing is defined: null, with the quality that says so."""
    (row,) = run_json("factors", HIDDEN[0], "0", "-80", "-m", "flexion,skewness", "-m", "scale@45")["results"]
    assert list(row) == [*FACTORS_KEYS, "flexion", "skewness", "scale@45"]
    assert row.pop("quality") == "outside"
    assert {name for name, value in row.items() if value is not None} == {"lon", "lat"}


NEGATIVE = [
    *("robin|-10|-20", "robin|-1e1|-2e+1", "robin|-10.|-20.0", "-m|h|robin|-10|-20", "robin|-10|-m|h|-20"),
    *("robin|--|-10|-20", "--|robin|-10|-20", "robin| -10|-20 ", "robin|-10|-.2e2"),
]


@each("words", NEGATIVE)
def test_factors_negative_numbers(words: str) -> None:
    """Negative numbers are numbers, with or without `--`, wherever options stand."""
    (row,) = json.loads(run_ok("factors", "-m", "ppm", "-f", "json", *words.split("|")))["results"]
    assert (row["lon"], row["lat"]) == (-10, -20)


def test_factors_csv_and_markdown() -> None:
    """A row a point: all digits in CSV, readable ones in Markdown; in tables `-` where undefined, no negative zero."""
    words = ["factors", "robin", "10", "20", "-30", "-40"]
    expected = run_json(*words)["results"]
    for row, wanted in zip(parse_csv(run_ok(*words, "-f", "csv")), expected, strict=True):
        assert (list(row), float(row["omega"])) == (FACTORS_KEYS, wanted["omega"])
    for row, wanted in zip(parse_markdown(run_ok(*words, "-f", "markdown")), expected, strict=True):
        assert float(row["h"]) == pytest.approx(wanted["h"], abs=1e-8)
    text = run_ok("factors", "EPSG:32632", "9", "0", "9", "45", "--details")
    assert ("\nEPSG:32632\n" in text, "0.99960000" in text, "-0.000000" in text) == (True, True, False)
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


def told(form: str, lines: str | bytes) -> tuple[int, str, str]:
    """Exit code, output and errors of points on the standard input."""
    result = run("factors", "robin", "-", "-f", form, stdin=lines)
    return result.exit_code, result.stdout, result.stderr


LINES = """\ufeff# longitude latitude name
10 20 Ab c, d
-10,-20,Zürich|x
 -.5\t1e1
3
foo bar

8 95 beyond
720 -90  *last*
"""


TEXTS = ["Ab c, d", "Zürich|x", "", "*last*"]


def test_factors_stdin() -> None:
    """Points in their order with the text that came with them; bad lines by their number, and exit code 1."""
    code, out, err = told("json", LINES)
    assert [[row["lon"], row["lat"]] for row in json.loads(out)["results"]] == [
        [10, 20],
        [-10, -20],
        [-0.5, 10],
        [720, -90],
    ]
    assert [row["text"] for row in json.loads(out)["results"]] == TEXTS
    assert (code, err.splitlines()) == (
        1,
        [
            "projdist: line 5: Invalid point '3'. It must be 'lon lat [text]'.",
            "projdist: line 6: Invalid point 'foo bar'. Longitude and latitude must be numbers of degrees.",
            "projdist: line 8: Invalid latitude '95'. It must lie within -90 and 90 degrees.",
        ],
    )
    assert [list(row) for row in parse_csv(told("csv", "1 2\n3,4\n")[1])] == [FACTORS_KEYS, FACTORS_KEYS]
    assert [row["text"] for row in parse_csv(told("csv", LINES)[1])] == TEXTS
    escaped = ["Ab c, d", "Zürich\\|x", "", "\\*last\\*"]
    assert [row["text"] for row in parse_markdown(told("markdown", LINES)[1])] == escaped
    out = told("table", LINES)[1]
    assert [text for text in TEXTS if text not in out] == []


def test_factors_stdin_of_no_points() -> None:
    """What there is of results, which is none, still parses; bytes and long lines do not reach the terminal."""
    code, _, err = told("table", b"\x1b[31mred\n1 2\n\0 \x07" + b"x" * 1000)
    assert (code, err.count("\n")) == (1, 2)
    assert all(line.isprintable() and len(line) < 200 for line in err.splitlines())
    for text in ("", "\n\n", "# only a remark\n"):
        message = "It must have lines of 'lon lat [text]'; there were none."
        assert message in refused("factors", "robin", "-", stdin=text)
    for form in FORMATS:
        code, out, err = told(form, "a\nb c\n")
        assert (code, err.count("\n")) == (1, 2)
        if form in ("json", "csv"):
            assert (json.loads(out)["results"] if form == "json" else parse_csv(out)) == []


# ---- points as people write them -----------------------------------------------------------------


@each(("words", "points"), [
    *(("10 50", [(10, 50)]), ("10,50 -20.5,-30", [(10, 50), (-20.5, -30)]), ("10, 50", [(10, 50)])),
    *(("50N 10E", [(10, 50)]), ("10W 50s", [(-10, -50)]), ("50N,10W", [(-10, 50)])),
    *(("10d30' 50°30'", [(10.5, 50.5)]), ("50°30'36\"N 10°15'W", [(-10.25, 50.51)])),
    *(("-10d30 0", [(-10.5, 0)]), ("1e1 5e1", [(10, 50)])),
])  # fmt: skip
def test_points_in_words(words: str, points: list[tuple[float, float]]) -> None:
    """Longitude first, but where letters say otherwise; minutes are sixtieths."""
    found = read_points(words.split(), [])
    np.testing.assert_allclose(np.column_stack([found.lon, found.lat]), points, rtol=0, atol=1e-12)


@each("word", ["50N 10E", "50N, 10E", "10 50", "10 , 50", "50°0'N 10°0'E"])
def test_a_pair_may_be_one_word(word: str) -> None:
    """As it comes from a shell where it is quoted."""
    found = read_points([word], [])
    assert (found.lon, found.lat) == ([10], [50])


@each(("words", "message"), [
    ("10N 50N", r"^Invalid point '10N 50N'\. One must be a longitude and one a latitude\.$"),
    ("10 50 20", r"^Invalid coordinates '10 50 20'\. They must be pairs"),
    ("10d60' 50", r"^Invalid point '10d60' 50'\. Longitude and latitude must be numbers"),
    ("10 90.5N", r"^Invalid latitude '90\.5N'\. It must lie within -90 and 90"),
    ("1,2,3 4", r"^Invalid point '1,2,3 4'\."),
    ("inf 5", r"^Invalid longitude 'inf'\."),
])  # fmt: skip
def test_words_that_are_no_points(words: str, message: str) -> None:
    refuses(message, read_points, words.split(), [])


@each(("lines", "texts"), [
    (["lon lat name", "10 50 A", "20 60 B"], ["A", "B"]),
    (["# sites", "Name;Latitude;Longitude", "A;50;10", "B;60;20"], ["A", "B"]),
    (["name,lon,lat,town", "A,10,50,Ulm", "B,20,60,Bern"], ["A Ulm", "B Bern"]),
    (["A 10 50", "B, 20, 60"], ["A", "B"]),
    (["10 50 at the gate", "20E 60N"], ["at the gate", ""]),
    (["10,0;50,0;A", "20;60,0;B"], ["A", "B"]),
    (["Latitude;Longitude;Name", "50,0;10,0;A", "60,0;20;B"], ["A", "B"]),
    (["lat lng name", "50,0 1,0e1 A", "60,0 20 B"], ["A", "B"]),
    (["10,50 A", "20,60\tB"], ["A", "B"]),
])  # fmt: skip
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
        "line 1: Invalid point '48,25 11,5'. Semicolons must separate numbers with decimal commas."
    ]
