"""What commands answer before it has a format, and the rules by which its cells are shown."""

import csv
import io
import json
from pathlib import Path

import pytest
import typer
from commands import parse_markdown

from projdist.cli.number_format import certain, change, first_digit, fixed, label_of, per_cent, rounded
from projdist.cli.report import FORMATS, Column, Copy, Report, Table, _bars, listing, render

ROWS = [{"name": "a|b*", "figure": 0.25, "error": 1e-3}, {"name": "c", "figure": None, "error": None}]
COLUMNS = [Column("name"), Column("figure", "fig", rounded, error="error", unit="m", best=True)]


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
    first, _ = csv.DictReader(io.StringIO(render(report(), "csv")))
    assert first == {key: str(value) for key, value in ROWS[0].items()}
    assert render(report(rows=list, header=["a", "b"]), "csv") == "a,b\n"


def test_an_answer_without_tables() -> None:
    """Its title is all there is to read; CSV has the names of the columns."""
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
    assert (ended.value.exit_code, capsys.readouterr().err) == (
        1,
        "projdist: Invalid format 'wkt' for X. It has none.\n",
    )


def test_words_stand_to_the_left() -> None:
    """Texts that are no numbers, unless it is said of the column."""
    rows = [{"id": "12", "name": "x", "figure": 1.0, "none": None}]
    left = {name: Column(name).is_left(rows) for name in rows[0]}
    assert left == {"id": False, "name": True, "figure": False, "none": False}
    assert Column("id", left=True).is_left(rows)
    assert [column.head for column in listing(rows).tables[0].columns] == list(rows[0])


def test_what_is_undefined_is_a_dash() -> None:
    """None and NaN are, and no column has them for its best; one row alone has no best."""
    rows = [{"x": value} for value in (None, float("nan"), 2.0, 1.0)]
    assert Column("x", show=certain).cells(rows) == ["-", "-", "2", "1"]
    assert Column("x", show=certain, best=True).cells([rows[0], *rows[2:]]) == ["- ", "2 ", "1*"]
    assert Column("x", show=certain, best=True).cells(rows[3:]) == ["1 "]
    assert Column("x", of=lambda row: f"<{row['x']}>").cells(rows[2:]) == ["<2.0>", "<1.0>"]


def test_numbers_as_texts() -> None:
    """Shares, changes, sizes of errors, fixed decimals without a negative zero, names of a bearable length."""
    assert [per_cent(0.98765), per_cent(1.0)] == ["98.77 %", "100 %"]
    assert [change(1.0125), change(0.5), change(float("inf"))] == ["+1.25 %", "-50.00 %", "-"]
    assert [first_digit(2.4e-9), fixed(-1e-9, 4), fixed(0.5, 2, "+"), certain(float("inf"), 1e-3)] == [
        *("2e-09", "0.0000", "+0.50", "inf")
    ]
    assert [label_of("moll", "X"), label_of("a\nb", "X"), label_of("a" * 61, "X")] == ["moll", "X", "X"]


def test_bars_are_as_long_as_values() -> None:
    """In eighths of a character; none for fewer than two values or where one is negative."""
    assert _bars([1.0, 0.5, 0.0, None], unicode=True) == ["█" * 12, "█" * 6, "", ""]
    assert _bars([96, 1], unicode=True) == ["█" * 12, "▏"]
    assert _bars([2.0, 1.0], unicode=False) == ["#" * 12, "#" * 6]
    assert _bars([1.0], unicode=True) == _bars([1.0, -1.0], unicode=True) == _bars(["a", "b"], unicode=True) == []
