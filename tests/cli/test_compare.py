"""The command `compare`: what is printed and written, what it says of projections that fail, and `--indices`."""

import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
from commands import FORMATS, HIDDEN, QUICK, Terminal, parse_csv, parse_markdown, refused, run_json, run_ok, told
from tables import each

from projdist import compare, factors, summarize
from projdist.answers.published_indices import indices
from projdist.cli.compare import comparison_report
from projdist.cli.factors import factors_report
from projdist.cli.report import render
from projdist.cli.wording import rounded

_AK = ["airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine"]
COMPARE_KEYS = ["projection", "name", "definition", "coverage", *_AK, "error_estimate", "evaluations"]
MEASURE_KEYS = ["mean", "rms", "median", "p95", "max", "min", "max_at", "min_at"]
MEASURE_ERRORS = {"mean_error", "rms_error", "max_error", "min_error"}
HERE = ["-r", "box:0,0,9,9", *QUICK]
WKT = pyproj.CRS("EPSG:32632").to_wkt(pretty=True)


def test_compare_json_keys() -> None:
    """The keys of the issue, in its order; more may stand after them."""
    found = run_json("compare", "moll", "nosuch", "-m", "omega", "--region", "box:0,0,40,40", *QUICK, code=1)
    assert list(found) == ["region", "results", "failures"]
    assert list(found["region"]) == ["name", "area_km2"]
    assert list(found["results"][0]) == [*COMPARE_KEYS, "omega"]
    assert set(found["results"][0]["omega"]) == {*MEASURE_KEYS, *MEASURE_ERRORS}
    assert list(found["failures"][0]) == ["projection", "error"]
    assert found["failures"][0]["projection"] == "nosuch"
    found = run_json("compare", "moll", "--region", "box:-90,0,0,90", *QUICK)["region"]
    assert found == {"name": "box:-90,0,0,90", "area_km2": pytest.approx(510065621.724 / 8, abs=1e-3)}


@pytest.mark.slow
def test_compare_json_is_what_python_says() -> None:
    """Full precision: the JSON has the very numbers of `summarize`."""
    words = ["compare", "winkel-tripel", "-m", "h", *QUICK]
    found = run_json(*words)["results"][0]
    assert found == summarize("winkel-tripel", measures=["h"], tolerance=1e-3).to_dict()
    lon, lat = found["h"]["max_at"]
    assert (abs(lon) <= 180, abs(lat) <= 90) == (True, True)
    (row,) = parse_csv(run_ok(*words, "-f", "csv"))
    assert float(row["airy_kavrayskiy"]) == found["airy_kavrayskiy"]
    assert [float(row[f"h_{name}"]) for name in ("rms", "max_lon", "max_lat")] == [found["h"]["rms"], lon, lat]
    found = run_json("compare", "merc", "-m", "s", *QUICK)["results"][0]["s"]
    assert (found["max"], found["mean"], math.isfinite(found["median"])) == (None, None, True)


@each("region", ["globe", "GLOBE", "box:-10,-20,30,40.5", "box:170,-20,-170,20", "cap:-10,-50,1e3"])
@each("option", ["--region", "-r"])
def test_compare_regions(region: str, option: str) -> None:
    """Negative numbers in regions need no `--`."""
    found = run_json("compare", option, region, "moll", "--tolerance", "1e-2")["region"]["name"]
    assert found == region.lower().replace("1e3", "1000")


def test_compare_measures_repeat_or_have_commas() -> None:
    """`-m a,b -m c` has all; a looser tolerance costs fewer evaluations."""
    found = run_json("compare", "moll", "-m", "omega, h", "--measure", "scale@45", *HERE)["results"][0]
    assert {"omega", "h", "scale@45"} < set(found)
    tight = run_json("compare", "moll", "--tolerance", "1e-7")["results"][0]
    loose = run_json("compare", "moll", "--tolerance", "1e-2")["results"][0]
    assert loose["evaluations"] < tight["evaluations"]
    assert loose["error_estimate"] < 1e-2
    assert tight["error_estimate"] < 1e-7


@each("sort", [*_AK, "coverage", "evaluations", "error_estimate", "name", "s.mean", "s.p95"])
def test_compare_sort(sort: str) -> None:
    """Rows ascend in the column of the key, and `given` keeps the order."""
    name, _, statistic = sort.partition(".")
    words = ["winkel-tripel", "moll", "robin", "moll"]
    found = run_json("compare", *words, "--sort", sort, *(["-m", "s"] if statistic else []), *HERE)["results"]
    values = [row[name][statistic] if statistic else row[name] for row in found]
    assert (len(values), values) == (4, sorted(values))
    found = run_json("compare", *words[:3], "--sort", "given", *HERE)["results"]
    assert [row["projection"] for row in found] == words[:3]


def test_compare_table_marks_the_best() -> None:
    """A star behind the least of each column, on one row, and a note that says what the star is."""
    text = run_ok("compare", "robin", "moll", *QUICK, "--details").partition("globe (")[2]
    stars = [line.count("*") for line in text.splitlines() if "│ robin" in line or "│ moll" in line]
    assert stars == [3, 0]
    assert "* is the best" in text
    assert "1/sqrt(2)" in text
    assert text.startswith("510,065,622 km2), by airy_kavrayskiy\n")
    (alone,) = [line for line in run_ok("compare", "robin", *QUICK).splitlines() if "│ robin" in line]
    assert "*" not in alone


def test_compare_table_has_no_digits_that_the_error_makes_doubtful() -> None:
    """A figure good to 1e-8 has six decimals, one good to 1e-4 at most four."""
    assert re.search(r"│ moll .* 0\.545459 ", run_ok("compare", "moll"))
    words = ["compare", "moll", "--tolerance", "1e-2"]
    found = run_json(*words)["results"][0]
    decimals = len(re.search(r"│ moll .*? 0\.(\d+) ", run_ok(*words))[1])
    assert 10.0**-decimals > 0.5 * found["error_estimate"]
    text = run_ok("compare", "+proj=ortho +lat_0=90 +R=6371000", "moll", "--tolerance", "1e-2", "--details")
    assert "covers" in text
    assert "the share of the region that can be projected" in text


def test_doubtful_figures_are_no_zeros() -> None:
    """What is above its error has its first digit, else the error is shown; six to ten decimals, or four digits."""
    assert [rounded(0.031, 0.016), rounded(0.0049, 0.0012), rounded(0.31, 0.16)] == ["0.03", "0.005", "0.3"]
    assert [rounded(1e-12, 1e-9), rounded(0.01, 0.016)] == ["0.000000000", "0.01 +- 0.016"]
    figures = [(0.123456789, 1e-12), (0.00123456789, 1e-12), (1.23456789e-6, 1e-15), (1.23456789e-9, 0.0)]
    assert [rounded(*one) for one in figures] == ["0.123457", "0.001235", "0.000001235", "0.0000000012"]
    assert [rounded(123.456, 0.0), rounded(0.0, 1e-12), rounded(0.0, 0.0)] == ["123.456000", "0.000000", "0.000000"]
    assert [rounded(0.123456789, error) for error in (1e-4, 3e-5, 0.9)] == ["0.1235", "0.1235", "0.123 +- 0.9"]
    assert rounded(None, 0.1) == rounded(None, None) == "-"


@pytest.mark.slow
def test_compare_tables_are_never_cut_off() -> None:
    """However many columns: each number of the Markdown stands whole in the table."""
    words = ["compare", "robin", "moll", "-m", "omega,h,s", *HERE]
    table = run_ok(*words, "--details")
    for row in parse_markdown(run_ok(*words, "-f", "markdown")):
        assert [cell for cell in row.values() if f" {cell.replace(chr(92), '')} " not in table] == []


@pytest.mark.parametrize("columns", [40, 80, 132])
def test_tables_fit_into_a_terminal(columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the terminal is narrow there are several tables; each repeats what its rows are of, none is cut off."""
    report = factors_report(factors("robin", [10, 20], [30, 40]).to_dict(), [])
    whole = parse_markdown(render(report, "markdown"))
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys, "stdout", Terminal())
    assert all(len(line) <= columns for line in render(report, "table").splitlines())
    text = re.sub(r"\x1b\[[0-9;]*m", "", render(report, "details"))
    assert all(len(line) <= columns for line in text.splitlines())
    assert text.count(" lon ") > 1
    for cell in {cell for row in whole for cell in row.values()}:
        assert f" {cell} " in text


@pytest.mark.slow
def test_compare_markdown() -> None:
    """A table that Markdown reads, with markup escaped; WKT and codes are shown by names, no figure as a dash."""
    rows = parse_markdown(run_ok("compare", "moll", "robin", "-f", "markdown", "-m", "scale@45", *HERE))
    assert {row["projection"] for row in rows} == {"robin", "moll"}
    assert rows[0]["AK"].endswith("\\*")
    assert "scale@45 mean" in rows[0]
    words = ["compare", WKT, "-r", "box:6,40,12,50", *QUICK]
    for form in ("table", "markdown"):
        text = run_ok(*words, "-f", form).partition("To see")[0]  # the next command has it whole
        assert "WGS 84 / UTM zone 32N" in text
        assert "PROJCRS" not in text
    assert run_json(*words)["results"][0]["projection"] == WKT
    assert "│ ETRS89 / UTM zone 32N │" in run_ok("compare", "25832", *words[2:])
    assert run_json("compare", "25832", *words[2:])["results"][0]["projection"] == "25832"
    found = compare(["moll", "robin"], (0, 0, 9, 9), sort="given")
    unknown = replace(found.results[0], **dict.fromkeys(COMPARE_KEYS[4:8], math.nan), coverage=0.5)
    found = replace(found, results=(unknown, found.results[1]))
    text = render(comparison_report(found, [], "given", 1e-8), "markdown")
    first, second = parse_markdown(text)
    assert first["AK"] == first["error"] == "-"
    assert second["AK"].endswith("\\*")
    assert np.isclose(float(second["covers"].removesuffix(" %")), 100)


@pytest.mark.slow
@each("form", FORMATS)
@pytest.mark.usefixtures("few_cells")
def test_compare_failures_stand_beside_results(form: str) -> None:
    """Good projections are measured, each bad one has its line, and the exit code is 1."""
    for names in (["nosuch", "moll", "EPSG:4326"], ["nosuch", "EPSG:4326"]):
        code, out, err = told("compare", *names, "-f", form, *HERE)
        assert (code, "moll" in out) == (1, "moll" in names)
        unknown, geographic = err.splitlines()
        assert unknown.startswith("projdist: Invalid projection 'nosuch'. It must be a PROJ id or a name")
        assert geographic.startswith("projdist: Invalid projection 'EPSG:4326'. It is a Geographic")
        if form == "json":
            assert len(json.loads(out)["results"]) == len(names) - 2
            assert [row["projection"] for row in json.loads(out)["failures"]] == ["nosuch", "EPSG:4326"]
        if form == "csv":
            assert len(parse_csv(out)) == len(names) - 2
    if form == "html":
        assert ("<h1>No projection could be measured.</h1>" in out, "<canvas" in out) == (True, False)
    if form in ("table", "markdown"):
        assert out == "No projection could be measured.\n"


@pytest.mark.slow
def test_compare_region_that_cannot_be_projected(tmp_path: Path) -> None:
    """A failure of the projection, not of the whole; a .prj and a .wkt file of one CRS give the same numbers."""
    found = run_json("compare", "moll", *HIDDEN, *QUICK, code=1)
    assert [row["projection"] for row in found["results"]] == ["moll"]
    assert re.search(r"No point of it can be projected", found["failures"][0]["error"])
    crs = pyproj.CRS("EPSG:3035")
    (tmp_path / "a.prj").write_text(crs.to_wkt("WKT1_ESRI"))
    (tmp_path / "b.wkt").write_text(crs.to_wkt(pretty=True))
    found = run_json("compare", str(tmp_path / "a.prj"), str(tmp_path / "b.wkt"), "-r", "box:0,40,20,60", *QUICK)
    first, second = (row["airy_kavrayskiy"] for row in found["results"])
    assert first == pytest.approx(second, rel=1e-9)


TEXTS = ["", "-10", "\N{SNOWMAN}", "\u202e", WKT[:200], "https://example.com", "/etc/passwd", "a" * 100_000, "a\nmoll"]


@each("text", TEXTS)
def test_compare_hostile_projections(text: str) -> None:
    """Each is refused in one line that names it, and says what is allowed."""
    code, out, err = told("compare", "--format", "json", "--", text)
    assert (code, len(err) < 1000) == (1, True)
    assert re.fullmatch(r"projdist: Invalid [^\n]+\n", err)
    assert json.loads(out)["failures"][0]["projection"] == text


@pytest.mark.parametrize("content", [None, b"", b"\xff\xfe\x00", b'GEOGCS["x"', b"hello", b"+proj=robin +R"])
def test_compare_bad_files(content: bytes | None, tmp_path: Path) -> None:
    """A directory, an empty, a binary and a broken file are refused by their name."""
    path = tmp_path / "some.prj"
    path.mkdir() if content is None else path.write_bytes(content)
    code, _, err = told("compare", path)
    assert code == 1
    assert re.fullmatch(r"projdist: Invalid [^\n]*some\.prj[^\n]*\n", err)


def test_modes() -> None:
    """The modes of each map with their shares, on request; in CSV all three in columns."""
    out = run_ok("compare", "robinson", "mercator", "--modes", "--details").partition("globe (")[2]
    for text in ("Modes, after the best linear map", "72.7 %", "shear", "100.0 %", "size"):
        assert text in out
    assert out.count("mercator") == 2  # what has no part is not told
    assert "Modes" not in run_ok("compare", "robinson", "--details")
    (row,) = parse_csv(run_ok("compare", "mercator", "--modes", "--format", "csv"))
    assert row["mode_1"] == "size"
    assert float(row["mode_1_share"]) == pytest.approx(1.0, abs=1e-9)
    found = run_json("compare", "mercator", "--modes")["results"][0]
    assert found == summarize("mercator", modes=True).to_dict() | {"projection": "mercator"}


# ---- published indices ---------------------------------------------------------------------------


COARSE = ("--tolerance", "1e-4")


def with_indices(*arguments: str) -> str:
    return run_ok("compare", "eqc", "moll", "--indices", "I,canters", *COARSE, *arguments)


@pytest.mark.slow
def test_json_has_each_index_by_name() -> None:
    """The figures are those of the library, in full."""
    rows = {row["projection"]: row["indices"] for row in json.loads(with_indices("-f", "json"))["results"]}
    assert rows["eqc"] == indices("eqc", names=["I", "canters"], tolerance=1e-4).to_dict()["indices"]
    assert list(rows["moll"]) == ["isotropy", "canters_ab", "canters_ar", "canters_an"]
    out = run_ok("compare", "eqc", "--indices", "goldberg-gott", *COARSE, "-f", "markdown")
    head, _, row = (line.strip("| ").split(" | ") for line in out.splitlines()[:3])
    assert head[-7:] == [*"IAFSDB", "score"]
    # D of the plate carree, .449 in the literature, with a standard error of 5e-5.
    assert re.fullmatch(r"0\.44[89]\d{2}\(\d\)", row[-3])
    assert "In brackets: the error" in out


@pytest.mark.slow
def test_csv_has_a_column_a_figure() -> None:
    """The value has the name of the index, the others follow it."""
    (first, _) = parse_csv(with_indices("-f", "csv"))
    assert float(first["isotropy"]) == pytest.approx(0.5212, abs=1e-4)
    assert float(first["canters_ar_best_scale"]) < 1.0
    results = json.loads(with_indices("-f", "json", "--sort", "canters_ar"))["results"]
    assert [row["projection"] for row in results] == ["moll", "eqc"]
    assert "one of the indices asked for" in refused("compare", "eqc", "--sort", "isotropy")
    assert "Invalid index 'cantres'. Did you mean canters" in refused("compare", "eqc", "--indices", "cantres")
    note = "I, A: most published figures come out over |lat| <= 88 only, and these here are for the whole region."
    arguments = ("compare", "plate-carree", "--tolerance", "1e-4", "--indices", "I,A,airy_kavrayskiy")
    assert note in run_ok(*arguments, "--details")
    assert run_json(*arguments)["published_over"] == {"isotropy": "|lat| <= 88", "area": "|lat| <= 88"}


@each("form", ["details", "markdown"])
def test_tables_have_symbols(form: str) -> None:
    """Columns are headed by symbols; one at the best scale only where that matters."""
    text = with_indices("-f", form)
    heads = (" I ", " Dab ", " Dab best ", " Dan ", " I best ")
    assert [head for head in heads if head not in text] == [" I best "]
    assert "Best: an index at the scale that makes it best." in text
