"""What is no command line is refused in one line; the documentation has commands and options that there are."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import refusal, refused, run, run_ok
from refusals import says, wrong_words
from tables import each
from typer.main import get_command

from projdist import __version__
from projdist.cli.app import COMMANDS, app

OVER_POINTS = [
    *("optimize eqc {} --free lat_ts", "correct robin -r {}"),
    *("design {} --degree 1 --base EPSG:32631", "mean-map robin -r {} --degree 1"),
]


def test_repairs_are_said(tmp_path: Path) -> None:
    """A repaired region is measured and the repair told."""
    path = tmp_path / "bow.geojson"
    path.write_text('{"type": "Polygon", "coordinates": [[[0, 0], [10, 10], [10, 0], [0, 10], [0, 0]]]}')
    result = run("compare", "robin", "--region", f"file:{path}")
    assert (result.exit_code, "AK" in result.stdout) == (0, True)
    assert re.fullmatch(r"projdist: file:.*: 1 self-intersecting polygon\(s\) repaired; [^\n]*\n", result.stderr)


@pytest.mark.slow
def test_points_have_no_area(tmp_path: Path) -> None:
    """A title tells how many there are, and no area; a table tells of weights."""
    path = tmp_path / "a.csv"
    path.write_text("lon,lat,weight\n1,2,1\n3,4,5\n8,1,2\n2,9,1\n")
    shown = run_ok("compare", "robin", "--region", f"points:{path}", "--details")
    assert "(4 points)" in shown
    assert "by the points' weights" in shown
    for words in OVER_POINTS:
        answer = run(*words.format(f"points:{path}").split(), "--details").stdout
        assert "the 4 points of a.csv" in answer
        assert any(line.endswith("(4 points)") for line in answer.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize("command", ["tissot", "heatmap"])
def test_pictures_of_countries(tmp_path: Path, command: str) -> None:
    """Pictures show a country, also one across the antimeridian, and the surroundings of points."""
    (tmp_path / "a.csv").write_text("lon,lat\n1,2\n30,40\n")
    for region in ("country:FJ", "country:CH", f"points:{tmp_path / 'a.csv'}"):
        picture, name = tmp_path / "a.png", "robin+lon_0=178" if region == "country:FJ" else "robin"
        run_ok(command, name, "--region", region, "-o", picture, "--dpi", "40", "--overwrite")
        assert picture.stat().st_size > 2000


@pytest.mark.slow
@each(("words", "code", "message"), wrong_words())
def test_wrong_words(words: str, code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, 2 for wrong words and 1 for what fails with right ones, and no file."""
    monkeypatch.chdir(tmp_path)
    assert says(message, refusal(*shlex.split(words), code=code))
    assert [*tmp_path.iterdir()] == []


UNKNOWN = ["--formt", "--region-x", "-x", "--", "---", "-q5", "--formt=json"]


@each("command", COMMANDS)
@each("option", UNKNOWN)
def test_unknown_options(command: str, option: str) -> None:
    """An option that there is not is refused in every command, wherever it stands."""
    if command not in ("compare", "factors") and option != "--formt":
        return  # read by the same parser
    arguments = {"factors": ["robin", "1", "2"], "list": ["measures"]}.get(command, ["robin"])
    if option == "--":
        arguments, option = ["--", *arguments], "--formt"
    for words in ([option, *arguments], [*arguments, option]):
        assert option.split("=")[0][:2] in refused(command, *words)


def test_no_arguments_is_help() -> None:
    """Alone, the command says what it can do, which is no success; asked for its version, it says that and no more."""
    assert run_ok("--version") == run_ok("--version", "compare", "robin") == f"projdist {__version__}\n"
    result = run()
    assert (result.exit_code, result.stdout) == (2, "")
    assert all(command in result.stderr for command in COMMANDS)
    help = run_ok("--help").partition("Look:\n")[2]
    assert re.findall(r"\n(\w.*):\n", help) == ["Choose", "Make", "Beyond maps"]
    lines = re.findall(r"  .*", help)
    assert {line.split()[0] for line in lines} >= set(COMMANDS)
    assert [line for line in lines if not re.fullmatch(r"  \S+ +[A-Z].*[^.]\.", line)] == []


@each("command", [[], *([command] for command in COMMANDS)])
@each("option", ["--help", "-h"])
def test_help(command: list[str], option: str) -> None:
    """Every command has help with its usage, and tells what to write, not Python's types."""
    text = run_ok(*command, option)
    assert text.startswith("Usage: projdist ")
    assert not re.search(r"<\w|list\[|\[\[", text)
    assert "{" not in text.splitlines()[0]


# ---- commands in the documentation ---------------------------------------------------------------


ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
_BLOCK = re.compile(r"^```(?:sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_LINE = re.compile(r"^(?:\$ )?projdist (?:\\\n|.)*", re.MULTILINE)
_INLINE = re.compile(r"`(projdist [^`\n]+)`")


def commands(text: str) -> Iterator[list[str]]:
    """The words of each command, without comments and what it is piped to."""
    for found in [*_LINE.findall("\n".join(_BLOCK.findall(text))), *_INLINE.findall(text)]:
        line = found.removeprefix("$ ").replace("\\\n", " ").split(" | ")[0].split(" > ")[0]
        yield shlex.split(line, comments=True)[1:]


@pytest.mark.slow
@each("page", PAGES)
def test_commands_are_those_that_there_are(page: Path) -> None:
    """Those in blocks and in lines of text, both of which the patterns find."""
    text = "```sh\nprojdist compare a b \\\n  -r globe  # it's\n```\nor `projdist list figures`, `projdist ldp REGION`."
    assert [*commands(text)] == [["compare", "a", "b", "-r", "globe"], ["list", "figures"], ["ldp", "REGION"]]
    group = get_command(app)
    for words in commands(page.read_text(encoding="utf-8")):
        name = words[0].rstrip(",")
        if name.isupper() or name.startswith("-"):
            continue
        command = group.commands[name]
        options = {"--help", "-h", *(option for one in command.params for option in [*one.opts, *one.secondary_opts])}
        used = {word.partition("=")[0] for word in words if re.fullmatch(r"--?[a-z][\w-]*(=.*)?", word)}
        assert used <= options, (name, used - options)
