"""Reports and how they are shown, files that are written, lists, and the command as a process."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer
from commands import FORMATS, QUICK, parse_csv, parse_html, parse_markdown, refusal, run, run_ok
from tables import each

from projdist import CRITERIA, MEASURES, projection_names
from projdist.answers.published_indices import INDICES
from projdist.cli.report import Column, Copy, Report, Table, _bars, render
from projdist.cli.wording import certain, change, fixed, label_of, per_cent, rounded


def process(*words: str, **options: object) -> subprocess.CompletedProcess:
    settings = {"capture_output": True, "timeout": 60, **options}
    return subprocess.run([sys.executable, "-m", "projdist", *words], check=False, **settings)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["HOME", "MPLCONFIGDIR", "XDG_CONFIG_HOME"])
def test_a_home_that_cannot_be_written(name: str, tmp_path: Path) -> None:
    """Matplotlib takes another folder for its settings and fonts, and what it says of that stays with it."""
    (tmp_path / "file").write_text("")
    kept = {key: value for key, value in os.environ.items() if key not in ("MPLCONFIGDIR", "XDG_CONFIG_HOME")}
    words = ["tissot", "robin", "-r", "box:0,0,9,9", "--size", "2,2", "--quiet", "-o", str(tmp_path / "x.png")]
    result = process(*words, env=kept | {name: str(tmp_path / "file")})
    assert (result.returncode, result.stderr) == (0, b"")
    assert (tmp_path / "x.png").exists()


def test_output_file_with_a_failure(tmp_path: Path) -> None:
    """The results are written, the failure is told, the exit code is 1."""
    path = tmp_path / "out.json"
    result = run("compare", "moll", "nosuch", *QUICK, "-f", "json", "--output", str(path))
    assert (result.exit_code, result.stdout) == (1, f"Wrote: {path}\n")
    assert len(json.loads(path.read_text())["results"]) == 1


PLACES = {
    "x.txt": ["compare", "moll", "-r", "box:0,0,9,9", *QUICK],
    "x.csv": ["factors", "moll", "-10", "20"],
    "x.png": ["tissot", "eqc", "-r", "box:0,0,40,30", "--dpi", "20"],
    "X.PNG": ["heatmap", "eqc", "-r", "box:0,0,40,30", "--dpi", "20"],
}


@each("name", PLACES)
def test_output_that_cannot_be_written(name: str, tmp_path: Path) -> None:
    """A directory that is not there, and a directory in the place of the file: one line, and nothing left behind."""
    (tmp_path / "dir.png").mkdir(exist_ok=True)
    for path in (tmp_path / "no" / name, tmp_path / "dir.png"):
        assert refusal(*PLACES[name], "-o", path).startswith(f"Invalid output '{path}'. ")
    assert [path.name for path in tmp_path.rglob("*")] == ["dir.png"]


@each("name", PLACES)
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_output_to_a_directory_without_permission(name: str, tmp_path: Path) -> None:
    """The same where the directory may not be written to."""
    tmp_path.chmod(0o500)
    assert "Permission denied" in refusal(*PLACES[name], "-o", tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@each(("what", "names"), [
    ("projections", [*projection_names()]),
    ("measures", [*MEASURES, "scale@AZIMUTH"]),
    ("criteria", [*CRITERIA, "pNN", *INDICES]),
    ("indices", [*INDICES]),
])  # fmt: skip
@each("form", FORMATS)
def test_list(what: str, names: list[str], form: str) -> None:
    """All that there is, in every format, each with something said of it."""
    text = run_ok("list", what, "--format", form, "--details")
    if form == "table":
        assert all(f" {name} " in text for name in names)
        return
    rows = {"json": json.loads, "csv": parse_csv, "markdown": parse_markdown, "html": parse_html}[form](text)
    assert [row["name"] for row in rows] == names
    assert all(row.get("description") or row.get("definition") for row in rows)


@pytest.mark.slow
def test_list_says_what_names_need() -> None:
    """Parameters that a name needs stand beside it, with an example that is taken; most need none."""
    rows = {row["name"]: row for row in json.loads(run_ok("list", "projections", "-f", "json"))}
    needs = {name: row["needs"] for name, row in rows.items() if row["needs"]}
    assert (needs["aea"], needs["utm"], "robinson" in needs) == ("lat_1, lat_2", "zone, ellps", False)
    assert 20 < len(needs) < 50
    assert sum(row["kind"] == "name" for row in rows.values()) >= 40
    for name in needs:
        assert run("factors", name, "1", "2").exit_code == 1
        run_ok("factors", rows[name]["definition"], "1", "2")


@pytest.mark.slow
def test_module_is_the_command() -> None:
    """`python -m projdist` compares, and returns the exit code; so does the installed script."""
    done = process("compare", "moll", "nosuch", *QUICK, "-f", "json", text=True)
    assert (done.returncode, len(json.loads(done.stdout)["results"]), done.stderr.count("\n")) == (1, 1, 1)
    script = Path(sys.executable).with_name("projdist")
    done = subprocess.run([script, "factors", "merc", "-10", "-60", "-f", "csv"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert float(parse_csv(done.stdout)[0]["k"]) == pytest.approx(2, rel=1e-11)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="pipes of Unix")
def test_broken_pipe() -> None:
    """`projdist list projections | head -1` says nothing on stderr."""
    command = f"{sys.executable} -m projdist list projections | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert (done.stderr, len(done.stdout.splitlines())) == ("", 1)
    reader, writer = os.pipe()
    os.close(reader)
    words = [sys.executable, "-m", "projdist", "list", "projections", "-f", "json"]
    with os.fdopen(writer, "wb") as closed:
        done = subprocess.run(words, stdout=closed, stderr=subprocess.PIPE, text=True)
    assert (done.stderr, done.returncode == 0) == ("", False)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="devices and descriptors of Unix")
@pytest.mark.parametrize("redirection", [">/dev/full", ">&-", "<&-", "2>&-"])
@pytest.mark.parametrize("words", ["list projections", "factors robin -", "compare nosuch"])
def test_streams_that_are_closed_or_full(redirection: str, words: str) -> None:
    """A standard stream that cannot be used is no traceback; what cannot be written is said."""
    command = f"echo 1 2 | {sys.executable} -m projdist {words} {redirection}"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    if "full" in redirection:
        assert done.returncode == 2
        assert "It cannot be written: No space left on device." in done.stderr.splitlines()[0]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="arguments of Unix are bytes")
def test_other_encodings() -> None:
    """Where the locale has ASCII only, tables are drawn with it; broken UTF-8 stops nothing and the JSON is valid."""
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = process("factors", "robin", "-", input="1 2 Zürich\n".encode(), env=environment)
    assert (done.returncode, done.stderr, b"+--" in done.stdout) == (0, b"", True)
    done = process("factors", "robin", "-", "-f", "json", input=b"1 2 Z\xfcrich\n", env=environment)
    assert (done.returncode, "rich" in json.loads(done.stdout)["results"][0]["text"]) == (0, True)
    done = process("compare", b"\xff", "-f", "json")
    assert (done.returncode, len(done.stderr.splitlines()), len(json.loads(done.stdout)["failures"])) == (1, 1, 1)
    done = process("factors", "robin", "-", "-f", "csv", input=b"1 2 \xff\n3 4 ok\n")
    assert (done.returncode, done.stderr, len(done.stdout.splitlines())) == (0, b"", 3)


SUFFIXES = {".json": "json", ".csv": "csv", ".md": "markdown", ".html": "html", ".txt": "table", ".LOG": "table"}


@each("words", [pytest.param("compare eqc -r globe", marks=pytest.mark.slow), "factors eqc -10 20", "tables"])
def test_the_suffix_of_a_file_tells_its_format(tmp_path: Path, words: str) -> None:
    """What is written is what --format prints; a suffix that contradicts it is refused, and .txt holds any."""
    for suffix, form in {**SUFFIXES, "": "table"}.items():
        path, given = tmp_path / f"x{suffix}", ["-f", form] if suffix == ".txt" else []
        path.write_text("old\n" * 1000)
        assert run_ok(*words.split(), *given, "-o", path, "--overwrite") == f"Wrote: {path}\n"
        assert path.read_text(encoding="utf-8") == run_ok(*words.split(), "-f", form, "--details")
    run_ok(*words.split(), "-o", tmp_path / "any.txt", "-f", "json", "--overwrite")
    assert (tmp_path / "any.txt").read_bytes() == (tmp_path / "x.json").read_bytes()
    other = tmp_path / "other.json"
    message = refusal(*words.split(), "-o", other, "-f", "csv")
    assert message == f"Invalid format 'csv' for '{other}'. Its suffix tells the format, json."
    assert {path.name for path in tmp_path.iterdir()} == {"any.txt", "x", *(f"x{suffix}" for suffix in SUFFIXES)}


TEXT_SUFFIXES = {
    "compare eqc -o": ".json, .csv, .md, .html, .png, .svg, .pdf, .txt, .log",
    "factors eqc 10 50 -o": ".json, .csv, .md, .html, .parquet, .gpkg, .geojson, .txt, .log",
    "tables -o": ".json, .csv, .md, .html, .txt, .log",
    "optimize eqc cap:10,50,100 -o": ".json, .html, .wkt, .txt, .log",
    "mosaic --correspondences nosuch.csv --report": ".json, .txt, .log",
}


@each("words", TEXT_SUFFIXES)
@each("form", [[], ["-f", "json"]])
@each("name", ["x.xlsx", "x.json.gz", "x.htm"])
def test_other_suffixes_are_refused(words: str, form: list[str], name: str) -> None:
    """Before any work, in one line that says what is allowed; optimize has no CSV."""
    for given in [name, "x.csv"] if ".csv" not in TEXT_SUFFIXES[words] else [name]:
        expected = f"Invalid output '{given}'. Its suffix must be {TEXT_SUFFIXES[words]}, or none."
        assert refusal(*words.split(), given, *form) == expected


@each(("value", "error", "text"), [
    *((None, None, "-"), (1155.31234, None, "1155.3"), (1155.31234, 0.2, "1155"), (3e-9, 1e-8, "0")),
    *((0.9997881485, 3e-10, "0.99979"), (179.955, 0.045, "180"), (0.012345, 2e-4, "0.012")),
    *((327.175, 27011.4, "327 +- 27,000"), (-0.0123, 0.0456, "-0.0123 +- 0.046"), (0.0, 0.5, "0 +- 0.5")),
    *((3.2e6, 8.7e6, "3.2e+06 +- 8.7e+06"), (327.175, np.inf, "327 +- inf"), (-0.53333333, 1e-3, "-0.533")),
])  # fmt: skip
def test_only_certain_digits(value: float | None, error: float | None, text: str) -> None:
    """A figure is printed with five digits, or as many as its error leaves certain; with the error if that has none."""
    assert certain(value, error) == text


@pytest.mark.parametrize("show", [certain, rounded])
def test_no_figure_is_swallowed_in_silence(show: Callable[[float, float], str]) -> None:
    """What is printed is as far from the figure as its error at most, half of its last digit aside, or names the error.

    Over errors from rounding to a million times the figure.
    """
    for value in (1.2345, -0.98765, 327.175, 0.00061, 4.2e5):
        for share in 10.0 ** np.arange(-9.0, 6.5, 0.5):
            error = abs(value) * share
            text = show(value, error)
            if error < abs(value):
                assert "+-" not in text
                assert abs(float(text) - value) <= max(10.0 * error, 1e-4 * abs(value), 1e-6)
                assert float(text) != 0.0
            else:
                printed, told = (float(part.replace(",", "")) for part in text.split(" +- "))
                assert printed == pytest.approx(value, rel=6e-3)
                assert told == pytest.approx(error, rel=6e-2)


ROWS = [{"name": "a|b*", "figure": 0.25, "error": 1e-3}, {"name": "c", "figure": None, "error": None}]
COLUMNS = [Column("name"), Column("figure", "fig m", rounded, error="error", best=True)]


def report(**more) -> Report:
    table = Table(ROWS, COLUMNS, "The table")
    return Report(title="All", tables=[table], notes=["x * y", ""], data=lambda: {"rows": ROWS}, **more)


def test_every_format_has_the_answer() -> None:
    """Cells as texts with the digits that are certain, JSON and CSV in full."""
    text = render(report(written=[Path("x.png"), None]), "table")
    assert text.startswith("All\nThe table\n")
    assert text.endswith("x * y\n\nWrote: x.png\n")
    assert "│ a|b* │ 0.250* │" in text
    assert "│ c    │      - │" in text
    markdown = render(report(), "markdown")
    assert parse_markdown(markdown)[0] == {"name": "a\\|b\\*", "fig m": "0.250\\*"}
    assert markdown.startswith("The table\n\n| name | fig m |\n| --- | ---: |\n")
    assert markdown.endswith("|\n\n- All\n- x \\* y\n")
    assert json.loads(render(report(), "json")) == {"rows": ROWS}
    first, _ = parse_csv(render(report(), "csv"))
    assert first == {key: str(value) for key, value in ROWS[0].items()}
    assert render(report(rows=list, header=["a", "b"]), "csv") == "a,b\n"
    nothing = Report(title="Nothing.", data=dict, header=["name"])
    *texts, page = (render(nothing, form) for form in FORMATS)
    assert texts == ["Nothing.\n", "{}\n", "name\n", "Nothing.\n"]
    assert "<h1>Nothing.</h1>" in page


def test_texts_to_copy(capsys: pytest.CaptureFixture[str]) -> None:
    """They are formats of their own; one that there is not ends the command with 1, and the reason."""
    copies = report(copies={"proj": Copy("+proj=eqc"), "wkt": Copy(None, "It has none.")}, about="X")
    assert render(copies, "proj") == "+proj=eqc\n"
    with pytest.raises(typer.Exit) as ended:
        render(copies, "wkt")
    assert (ended.value.exit_code, capsys.readouterr().err[10:]) == (1, "Invalid format 'wkt' for X. It has none.\n")


def test_words_stand_to_the_left() -> None:
    """Texts that are no numbers, unless it is said; undefined is a dash, and none is the best; one row has no best."""
    rows = [{"id": "12", "name": "x", "figure": 1.0, "none": None}]
    left = {name: Column(name).cells(rows)[1] for name in rows[0]}
    assert left == {"id": False, "name": True, "figure": False, "none": False}
    assert Column("id", left=True).cells(rows)[1]
    assert [column.title or column.key for column in Table(rows, rows[0]).columns] == list(rows[0])
    rows = [{"x": value} for value in (None, float("nan"), 2.0, 1.0)]
    assert Column("x", show=certain).cells(rows)[0] == ["-", "-", "2", "1"]
    assert Column("x", show=certain, best=True).cells([rows[0], *rows[2:]])[0] == ["- ", "2 ", "1*"]
    assert Column("x", show=certain, best=True).cells(rows[3:])[0] == ["1 "]
    assert Column("x", of=lambda row: f"<{row['x']}>").cells(rows[2:])[0] == ["<2.0>", "<1.0>"]


def test_numbers_as_texts() -> None:
    """Shares, changes, sizes of errors, fixed decimals without a negative zero, names of a bearable length."""
    assert [per_cent(0.98765), per_cent(1.0)] == ["98.77 %", "100 %"]
    assert [change(1.0125), change(0.5), change(float("inf"))] == ["+1.25 %", "-50.00 %", "-"]
    assert [fixed(-1e-9, 4), fixed(0.5, 2, "+")] == ["0.0000", "+0.50"]
    assert certain(float("inf"), 1e-3) == "inf"
    assert [label_of("moll", "X"), label_of("a\nb", "X"), label_of("a" * 61, "X")] == ["moll", "X", "X"]
    assert _bars([1.0, 0.5, 0.0, None], unicode=True) == ["█" * 12, "█" * 6, "", ""]
    assert _bars([96, 1], unicode=True) == ["█" * 12, "▏"]
    assert _bars([2.0, 1.0], unicode=False) == ["#" * 12, "#" * 6]
    assert _bars([1.0], unicode=True) == _bars([1.0, -1.0], unicode=True) == _bars(["a", "b"], unicode=True) == []
