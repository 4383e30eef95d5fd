"""The command `mean-map`: formats, pictures, and what is refused."""

import json
from pathlib import Path

import pytest
from matplotlib.image import imread
from pyproj import CRS
from typer.testing import CliRunner

from projdist import mean_map
from projdist.cli.app import app

SWISS = ["EPSG:3035", "EPSG:25832", "--region", "box:6,46,10,47.5", "--degree", "3"]


def run(*words: str) -> tuple[int, str, str]:
    """Exit code, standard output and standard error."""
    result = CliRunner().invoke(app, ["mean-map", *words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def test_json() -> None:
    """What the library answers."""
    code, out, err = run(*SWISS, "--weights", "1,2", "--format", "json")
    assert (code, err) == (0, "")
    found = mean_map(["EPSG:3035", "EPSG:25832"], region="box:6,46,10,47.5", degree=3, weights=[1, 2])
    assert json.loads(out) == found.to_dict()


@pytest.mark.slow
def test_table() -> None:
    """The bound, the mean, the average and the maps; which distance it is."""
    code, out, err = run(*SWISS, "--weights", "1,2", "--name", "Between two")
    assert (code, err) == (0, "")
    for words in ("Between two over", "Weights 1, 2", "bound", "mean", "average", "EPSG:25832", "same point of the"):
        assert words in out


@pytest.mark.slow
def test_wkt_and_picture(tmp_path: Path) -> None:
    """A CRS in a file, and the mean beside the average."""
    code, _, err = run(*SWISS, "-o", str(tmp_path / "mean.wkt"), "--picture", str(tmp_path / "mean.png"), "--dpi", "40")
    assert code == 0, err
    assert CRS.from_wkt((tmp_path / "mean.wkt").read_text()).is_projected
    assert imread(tmp_path / "mean.png").std() > 0.05


@pytest.mark.slow
@pytest.mark.parametrize("form", ["proj", "wkt-derived", "projjson"])
def test_other_forms(form: str) -> None:
    """Each is read by PROJ."""
    code, out, err = run(*SWISS, "--format", form)
    assert (code, err) == (0, "")
    assert out.startswith("+proj=pipeline") if form == "proj" else CRS.from_user_input(out)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["robin", "moll", "--weights", "1,x"], "Invalid weights '1,x'. They must be numbers with commas"),
        (["robin", "moll", "--degree", "x"], "Invalid degree 'x'"),
        (["robin", "moll", "--region", "globe"], "Invalid region 'globe'"),
        (["robin", "igh"], "It is cut within"),
        pytest.param(
            ["aitoff", "moll", "--degree", "3", "--format", "wkt"], "JSON has its coefficients", marks=pytest.mark.slow
        ),
    ],
)
def test_what_is_refused(words: list[str], told: str) -> None:
    """In one line, with exit code 2 or 1."""
    code, out, err = run(*words)
    assert code in (1, 2)
    assert out == ""
    assert told in err
    assert err.count("\n") == 1
