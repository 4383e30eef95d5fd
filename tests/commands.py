"""Commands run in this process or one of their own, and what they print, read back."""

import csv
import functools
import html
import io
import json
import re
from collections.abc import Callable

import pytest
from typer.testing import CliRunner, Result

from projdist.cli.app import app
from projdist.cli.report import FORMATS as FORMATS

QUICK = ["--tolerance", "1e-3"]
HIDDEN = ["+proj=ortho +lat_0=90 +R=6371000", "--region", "box:0,-40,40,-10"]


class Terminal(io.StringIO):
    """What calls itself a terminal; it is as wide as COLUMNS says."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        """It is one."""
        return True


def run(*words: object, stdin: str | bytes = "") -> Result:
    result = CliRunner().invoke(app, [*map(str, words)], input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert "Traceback" not in result.output
    return result


def told(*words: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error."""
    result = run(*words)
    return result.exit_code, result.stdout, result.stderr


def run_ok(*words: object, stdin: str | bytes = "") -> str:
    result = run(*words, stdin=stdin)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def run_json(*words: object, stdin: str = "", code: int = 0) -> dict:
    result = run(*words, "--format", "json", stdin=stdin)
    assert (result.exit_code, result.stderr if code == 0 else "") == (code, ""), result.stderr
    return json.loads(result.stdout, parse_constant=lambda text: pytest.fail(f"{text} is not JSON"))


def refused(*words: object, stdin: str = "", code: int = 2) -> str:
    """The one line of an error, which ends with 2 or another code and prints nothing else."""
    result = run(*words, stdin=stdin)
    assert (result.exit_code, result.stdout) == (code, "")
    assert re.fullmatch(r"projdist: [^\n]+\n", result.stderr)
    return result.stderr


def refusal(*words: object, code: int = 2) -> str:
    """What is refused, and why, without the name of the program."""
    return refused(*words, code=code).removeprefix("projdist: ").rstrip("\n")


def command(name: str) -> tuple[Callable, ...]:
    """`told`, `run_ok`, `run_json` and `refusal` of a command with all its details."""
    return tuple(functools.partial(one, name, "--details") for one in (told, run_ok, run_json, refusal))


def parse_markdown(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    assert all(re.fullmatch("-{3}:?", cell) for cell in cells[1])
    assert len({len(row) for row in cells}) == 1
    return [dict(zip(cells[0], row, strict=True)) for row in cells[2:]]


def parse_html(text: str) -> list[dict[str, str]]:
    """The rows of the only table of a page."""
    rows = [re.findall(r"<(t[dh])\b[^>]*>(.*?)</\1>", row, re.DOTALL) for row in re.findall("(?s)<tr.*?</tr>", text)]
    head, *cells = [[html.unescape(re.sub("<[^>]*>", "", cell)) for _, cell in row] for row in rows]
    return [dict(zip(head, row, strict=True)) for row in cells]


def parse_csv(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))
