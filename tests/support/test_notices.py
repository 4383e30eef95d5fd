"""Notices: at the line of whoever called projdist, and one line each on the command line."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tables import each

from projdist import Notice
from projdist.cli.errors import notices_said
from projdist.support.messages import listed, tell


def test_a_notice_names_the_line_of_the_caller() -> None:
    """Not a line within projdist, however deep."""
    with pytest.warns(Notice, match="a thing") as caught:
        tell("a thing")
    assert caught[0].filename == __file__


def test_the_command_line_says_each_notice_once(capsys: pytest.CaptureFixture[str]) -> None:
    with notices_said():
        tell("one")
        tell("one")
        tell("another")
    assert capsys.readouterr().err == "projdist: one\nprojdist: another\n"


def test_other_warnings_stay_errors_in_tests() -> None:
    with notices_said(), pytest.raises(RuntimeWarning):
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)


def output_of(*words: str, code: int = 0) -> str:
    """What a program of Python writes to standard error, and nothing else."""
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (code, "")
    return done.stderr


@pytest.mark.slow
@each(
    ("options", "words", "expected"),
    [([], [], "said"), ([], ["-o", "/dev/stderr"], "libtiffsaid"), (["-W", "default::UserWarning"], [], "libtiffsaid")],
)
def test_what_libraries_write_does_not_reach_a_user(options: list[str], words: list[str], expected: str) -> None:
    """Standard error is ours alone; who names it as a file, or wants warnings, has all of it."""
    code = "import os, sys, warnings, projdist.cli.app as app\napp.app = lambda: ({})\napp.main()"
    written = "os.write(2, b'libtiff'), sys.stderr.write('said')"
    assert output_of(*options, "-c", code.format(written), *words) == expected
    assert output_of("-c", code.format("warnings.warn('overflow', RuntimeWarning)")) == ""


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
    said = r"projdist: Invalid image '[^\n]*broken.tif'. It cannot be read: [^\n]+\n"
    assert re.fullmatch(said, output_of("-m", "projdist", *words, code=2))


def test_words_are_listed_as_people_do() -> None:
    said = [listed("abcd"[:count], "and") for count in (0, 1, 2, 4)]
    assert said == ["", "a", "a and b", "a, b, c and d"]
