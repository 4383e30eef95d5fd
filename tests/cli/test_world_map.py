"""The command `world-map`: what it prints and writes, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer
from tables import each
from typer.testing import CliRunner

from projdist import world_map
from projdist.cli.app import app

QUICK = ("--cells", "8", "--against", "robin")


def run(*words: str) -> tuple[int, str, str]:
    """Exit code, standard output and standard error."""
    result = CliRunner().invoke(app, ["world-map", *words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.slow
def test_table() -> None:
    code, out, err = run(*QUICK, "--cut", "-169")
    assert (code, err) == (0, "")
    assert out.startswith("World map, cut at -169 (510,065,622 km2)\nairy_kavrayskiy 0.327")
    for words in ("Symmetric about: both", "Robinson", "8 x 8"):
        assert words in out


def test_json() -> None:
    """What the library answers."""
    code, out, _ = run("continent:Africa", *QUICK, "--elsewhere", "0.1", "--format", "json")
    assert code == 0
    found = world_map("continent:Africa", elsewhere=0.1, cells=8, against="robin")
    assert json.loads(out) == found.to_dict() | {"pipeline": None}


def test_points(tmp_path: Path) -> None:
    """Weighted points are a region."""
    path = tmp_path / "towns.csv"
    path.write_text("lon,lat,people\n20,45,100\n21,46,300\n25,44,50\n")
    code, out, _ = run(f"points:{path}", "--weight", "people", *QUICK)
    assert code == 0
    assert "(3 points)" in out


@pytest.mark.slow
def test_files(tmp_path: Path) -> None:
    """Triangles that PROJ runs, and a picture; nothing is overwritten unasked."""
    triangles, picture = tmp_path / "world.json", tmp_path / "world.png"
    words = (*QUICK, "--tinshift", str(triangles), "--picture", str(picture), "--dpi", "30")
    code, out, err = run(*words)
    assert (code, err) == (0, "")
    assert f"Wrote: {triangles}" in out
    pipeline = out.split("PROJ: ")[1].split("\n")[0]
    assert np.isfinite(Transformer.from_pipeline(pipeline).transform(10.0, 50.0)).all()
    assert picture.read_bytes().startswith(b"\x89PNG")
    code, _, err = run(*words)
    assert (code, "It exists" in err) == (2, True)


@each(
    ("words", "message"),
    [
        (("--cut", "1,2"), "Invalid cut '1,2'. It must be a longitude, or two or more points as '-170,40 -70,-62'."),
        (("--cut", "x"), "Invalid cut 'x'."),
        (("--cells", "7"), "Invalid number of cells '7'."),
        (("--cells", "x"), "Invalid number of cells 'x'."),
        (("--elsewhere", "0"), "Invalid weight elsewhere '0'. It must be a number within 0.0001 and 1."),
        (("--until", "95"), "Invalid end '95'."),
        (("--symmetric", "x"), "Invalid symmetry 'x'."),
        (("--weight", "pop.tif"), "Invalid weight 'pop.tif' without a region."),
        (("--tinshift", "x.txt"), "Invalid file of triangles 'x.txt'. Its suffix must be .json"),
        (("nowhere",), "Invalid region 'nowhere'"),
    ],
)
def test_what_is_refused(words: tuple[str, ...], message: str) -> None:
    """In one line, with exit code 2."""
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert err.startswith(f"projdist: {message}")
    assert err.count("\n") == 1
