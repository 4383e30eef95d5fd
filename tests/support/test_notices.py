"""Notices: at the line of whoever called projdist, and one line each on the command line."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from projdist import Notice
from projdist.cli.errors import notices_said
from projdist.support.messages import listed, tell


def test_a_notice_names_the_line_of_the_caller() -> None:
    """Not a line within projdist, however deep."""
    with pytest.warns(Notice, match="a thing") as caught:
        tell("a thing")
    assert caught[0].filename == __file__


def test_the_command_line_says_each_notice_once(capsys: pytest.CaptureFixture[str]) -> None:
    """In one line, without file and line number."""
    with notices_said():
        tell("one")
        tell("one")
        tell("another")
    assert capsys.readouterr().err == "projdist: one\nprojdist: another\n"


def test_other_warnings_stay_errors_in_tests() -> None:
    """What numpy warns of in a command is seen by the tests."""
    with notices_said(), pytest.raises(RuntimeWarning):
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)


@pytest.mark.slow
def test_other_warnings_do_not_reach_a_user() -> None:
    """A command that makes numpy warn says nothing of it."""
    code = "import warnings, projdist.cli.app as app\napp.app = lambda: warnings.warn('overflow', RuntimeWarning)\n"
    code += "app.main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""


WRITES = (
    "import os, sys, projdist.cli.app as app\napp.app = lambda: (os.write(2, b'libtiff'), sys.stderr.write('said'))\n"
)


@pytest.mark.parametrize(
    ("options", "words", "expected"),
    [
        ([], [], "said"),
        pytest.param([], ["-o", "/dev/stderr"], "libtiffsaid", marks=pytest.mark.slow),
        pytest.param(["-W", "default::UserWarning"], [], "libtiffsaid", marks=pytest.mark.slow),
    ],
)
def test_what_c_libraries_write_does_not_reach_a_user(options: list[str], words: list[str], expected: str) -> None:
    """Standard error is ours alone; who names it as a file, or wants warnings, has all of it."""
    command = [sys.executable, *options, "-c", WRITES + "app.main()", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == expected


@pytest.mark.slow
def test_a_broken_picture_has_one_line(tmp_path: Path) -> None:
    """libtiff tells what is wrong with a strip in lines of its own."""
    rng = np.random.default_rng(1)
    path, points = tmp_path / "broken.tif", tmp_path / "points.csv"
    Image.fromarray(rng.integers(0, 255, (60, 80), np.uint8)).save(path, compression="tiff_lzw")
    content = bytearray(path.read_bytes())
    content[1000:1040] = rng.integers(0, 255, 40, np.uint8).tobytes()
    path.write_bytes(content)
    points.write_text("0,0,0,0\n0,9,0,90\n9,0,90,0\n9,9,90,90\n", encoding="utf-8")
    words = ["oldmap", str(points), "--model", "affine", "--image", str(path), "-o", str(tmp_path / "x.png")]
    done = subprocess.run([sys.executable, "-m", "projdist", *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(r"projdist: Invalid image '[^\n]*broken.tif'. It cannot be read: [^\n]+\n", done.stderr)


def test_words_are_listed_as_people_do() -> None:
    """Commas between all but the last two."""
    said = [listed(words, "and") for words in ([], ["a"], ["a", "b"], ["a", "b", "c", "d"])]
    assert said == ["", "a", "a and b", "a, b, c and d"]
