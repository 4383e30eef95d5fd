"""Every command in a terminal: what people see is whole, fits, and is what a pipe would get."""

import os
import re
import shutil
import struct
from pathlib import Path

import pytest
from command_lines import FAROES, LINES, write_files
from commands import told
from rich.cells import cell_len
from tables import some

from projdist.cli.app import COMMANDS

pytest.importorskip("termios", reason="pseudo-terminals of Unix")
import fcntl
import termios

from terminals import Screen, in_terminal

from projdist.cli.errors import folded, width_of

FIGURE = re.compile(r"[-+]?\d[\d.,:e+-]*\d|\d")
# Every command once, and a quarter of the other lines.
FIRSTS = {words[0]: name for name, words in reversed(LINES.items()) if words}
SOME = [name for name in LINES if name in FIRSTS.values() or name in some(LINES, 4)]
TERMINALS = {60: {}, 80: {"NO_COLOR": "1"}, 120: {"TERM": "dumb"}}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the command lines read."""
    folder = tmp_path_factory.mktemp("files")
    write_files(folder)
    return folder


def check_screen(screen: Screen, columns: int) -> None:
    """No traceback, and no line wider than the terminal."""
    assert "Traceback" not in screen.text
    assert [line for line in screen.lines if cell_len(line) > columns] == []
    assert screen.widest <= columns


NO_DETAILS = ("tissot", "heatmap", "morph", "convert")


def figures(text: str) -> set[str]:
    """All figures; where those of a table are repeated or in another order, they are the same."""
    return set(FIGURE.findall(text))


@pytest.mark.slow
def test_recommend_in_a_terminal() -> None:
    """Its progress bar counts, and is gone when the answer comes."""
    screen = in_terminal("recommend", FAROES, "--authority", "EPSG", "--datum", "FD54", NO_COLOR="1")
    assert (screen.code, screen.colours, screen.lines[0][:4]) == (0, [], "Use "), screen.text
    assert "maps" in screen.sent.partition("FD54")[0]
    check_screen(screen, 80)


@pytest.mark.slow
def test_escape_codes_are_for_terminals_only(tmp_path: Path) -> None:
    """Bold figures on the screen; none in a file, though a terminal says what is wrong, in lines that fit."""
    words = ["compare", "robin", "moll", "EPSG:4326", "-r", "box:0,40,10,50", "--tolerance", "1e-2"]
    shown = in_terminal(*words, columns=60)
    assert (shown.code, "\x1b[1m" in shown.colours) == (1, True)
    check_screen(shown, 60)
    filed = in_terminal(*words, columns=60, stdout=tmp_path / "out")
    text = (tmp_path / "out").read_text()
    assert (filed.code, "\x1b" in text, "\x1b" in filed.sent) == (1, False, False)
    assert filed.text.startswith("projdist: Invalid projection 'EPSG:4326'. ")
    check_screen(filed, 60)
    assert figures(shown.text) == figures(text + filed.text)


@pytest.mark.parametrize(
    ("columns", "stated", "expected"), [(97, "", 97), (97, "50", 50), (97, "x", 97), (97, "0", 97), (0, "", 80)]
)
def test_width_of_a_terminal(columns: int, stated: str, expected: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What COLUMNS says, else the terminal; 80 where it does not tell."""
    monkeypatch.setenv("COLUMNS", stated)
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 25, columns, 0, 0))
    with os.fdopen(ours, "rb"), os.fdopen(theirs, "w") as stream:
        assert width_of(stream) == expected


def test_what_is_no_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file has no width; what calls itself a terminal and is none has 80 columns."""
    monkeypatch.delenv("COLUMNS", raising=False)
    with open(tmp_path / "x", "w") as stream:
        assert width_of(stream) is None
        feigned = type("Feigned", (), {"isatty": lambda _: True, "fileno": lambda _: stream.fileno()})()
        assert width_of(feigned) == 80


def test_folded_lines() -> None:
    """Lines are broken at blanks before they are too wide, wide letters are two columns, long words stay whole."""
    assert folded("one two three four", 8) == "one two\nthree\nfour"
    assert folded("one two", 7) == "one two"
    assert folded("a/very/long/path to it", 6) == "a/very/long/path\nto it"
    assert folded("日本 日本", 8) == "日本\n日本"
    assert folded("x\n\none two", 3) == "x\n\none\ntwo"
    assert folded("one two three four", None) == "one two three four"


def test_there_is_a_line_of_every_command() -> None:
    """But for one that does not end by itself, and one that prints a script: they have their own tests."""
    assert {words[0] for words in LINES.values() if words} >= set(COMMANDS) - {"explore", "completion"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_every_command_in_a_terminal(name: str, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code and figures are those of a pipe; lines fit; no codes in a file, nor where they are not wanted.

    The kinds of terminals take turns, and with them a file, of which a terminal only shows the messages.
    """
    folders = iter(shutil.copytree(files, tmp_path / str(number)) for number in range(10))
    # Narrow terminals have fewer columns under an answer, and all of them in its details.
    words = LINES[name]
    if words and words[0] not in NO_DETAILS and not words[0].startswith("-"):
        words = (words[0], "--details", *words[1:])
    if words and words[0] in COMMANDS:
        words = (words[0], "--quiet", *words[1:])
    folder = next(folders)
    monkeypatch.chdir(folder)
    code, out, err = told(*words)  # a pipe is no terminal, and needs no process of its own
    written = {path.name: path.read_bytes() for path in folder.glob("*.txt")}
    turn = SOME.index(name) % (len(TERMINALS) + 1)
    for columns, environment in [*TERMINALS.items()][turn : turn + 1]:
        folder = next(folders)
        screen = in_terminal(*words, columns=columns, folder=folder, **environment)
        assert screen.code == code, (columns, screen.text)
        check_screen(screen, columns)
        assert figures(screen.text) == figures(out + err)
        assert screen.colours == [] or not environment
        assert {path.name: path.read_bytes() for path in folder.glob("*.txt")} == written
    if turn < len(TERMINALS):
        return
    folder = next(folders)
    screen = in_terminal(*words, folder=folder, stdout=folder / "stdout")
    assert (folder / "stdout").read_text() == out
    assert screen.code == code
    assert " ".join(screen.text.split()) == " ".join(err.split())
    check_screen(screen, 80)
