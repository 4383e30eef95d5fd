"""Published indices on the command line: `compare --indices`, in every format, and what it refuses."""

import csv
import io
import json
import re

import pytest
from typer.testing import CliRunner

from projdist.answers.published_indices import indices
from projdist.cli.app import app

COARSE = ("--tolerance", "1e-4")


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, result.stdout, result.stderr


def compare(*arguments: str) -> str:
    code, out, err = run("compare", "eqc", "moll", "--indices", "I,canters", *COARSE, *arguments)
    assert (code, err) == (0, "")
    return out


@pytest.mark.slow
def test_json_has_each_index_by_name() -> None:
    """The figures are those of the library, in full."""
    rows = {row["projection"]: row["indices"] for row in json.loads(compare("-f", "json"))["results"]}
    assert rows["eqc"] == indices("eqc", names=["I", "canters"], tolerance=1e-4).to_dict()["indices"]
    assert list(rows["moll"]) == ["isotropy", "canters_ab", "canters_ar", "canters_an"]


def test_csv_has_a_column_a_figure() -> None:
    """The value has the name of the index, the others follow it."""
    (first, _) = csv.DictReader(io.StringIO(compare("-f", "csv")))
    assert float(first["isotropy"]) == pytest.approx(0.5212, abs=1e-4)
    assert float(first["canters_ar_best_scale"]) < 1.0


@pytest.mark.parametrize("form", ["table", "markdown"])
def test_tables_have_symbols(form: str) -> None:
    """Columns are headed by symbols; one at the best scale only where that matters."""
    text = compare("-f", form)
    assert all(head in text for head in (" I ", " Dab ", " Dab best ", " Dan "))
    assert " I best " not in text
    assert "Best: an index at the scale that makes it best." in text


@pytest.mark.slow
def test_a_row_of_goldberg_and_gott() -> None:
    """Six figures and their score; errors above the last digit stand in brackets."""
    code, out, _ = run("compare", "eqc", "--indices", "goldberg-gott", *COARSE, "-f", "markdown")
    assert code == 0
    head, _, row = (line.strip("| ").split(" | ") for line in out.splitlines()[:3])
    assert head[-7:] == [*"IAFSDB", "score"]
    # D of the plate carree, .449 in the literature, with a standard error of 5e-5.
    assert re.fullmatch(r"0\.44[89]\d{2}\(\d\)", row[-3])
    assert "In brackets: the error" in out


def test_sorted_by_an_index() -> None:
    """--sort takes the name of an index asked for."""
    results = json.loads(compare("-f", "json", "--sort", "canters_ar"))["results"]
    assert [row["projection"] for row in results] == ["moll", "eqc"]
    code, _, err = run("compare", "eqc", "--sort", "isotropy")
    assert code == 2
    assert "one of the indices asked for" in err


def test_an_unknown_index_is_one_line() -> None:
    """It says what is allowed, and what is near."""
    code, out, err = run("compare", "eqc", "--indices", "cantres")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "Invalid index 'cantres'. Did you mean canters" in err


def test_what_published_figures_are_of() -> None:
    """Under the table, and in JSON by a key, stands of what part of the globe the published figures are."""
    note = "I, A: most published figures come out over |lat| <= 88 only, and these here are for the whole region."
    arguments = ("compare", "plate-carree", "--tolerance", "1e-4", "--indices", "I,A,airy_kavrayskiy")
    assert note in run(*arguments)[1]
    found = json.loads(run(*arguments, "--format", "json")[1])
    assert found["published_over"] == {"isotropy": "|lat| <= 88", "area": "|lat| <= 88"}
