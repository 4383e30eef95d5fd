"""The command `design`: formats, options, what it writes, and what is refused."""

import json
from pathlib import Path

import pytest
from pyproj import CRS
from tables import each
from typer.testing import CliRunner

from projdist import Projection, design, summarize
from projdist.cli.app import app
from projdist.designs import Design

SWISS = ("country:CH", "--degree", "2", "--base", "EPSG:2056", "--against", "EPSG:21781")


def run(*words: str) -> tuple[int, str, str]:
    """Exit code, standard output and standard error."""
    result = CliRunner().invoke(app, ["design", *words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def test_json() -> None:
    """What the library answers."""
    code, out, err = run(*SWISS, "--format", "json")
    assert (code, err) == (0, "")
    assert json.loads(out) == design("country:CH", degree=2, base="EPSG:2056", against="EPSG:21781").to_dict()


def test_table() -> None:
    """The figures, the map to compare with, the degrees, and what is to be known."""
    code, out, err = run(*SWISS, "--name", "Mine")
    assert (code, err) == (0, "")
    assert out.startswith("Mine (41,324 km2)\nDegree 2 on +proj=somerc")
    for words in (
        "made to measure",
        "given",
        "EPSG:21781",
        "The image does not cover itself.",
        "limit",
        "There and back",
    ):
        assert words in out


@pytest.fixture(scope="module")
def made() -> Design:
    return design("country:CH", degree=2, base="EPSG:2056", against=())


@pytest.mark.slow
@pytest.mark.parametrize("form", ["proj", "wkt", "wkt-derived", "projjson"])
def test_formats_that_programs_read(form: str, made: Design) -> None:
    """They are the same map."""
    code, out, _ = run(
        "country:CH", "--degree", "2", "--base", "EPSG:2056", "--against", "EPSG:21781", "--format", form
    )
    assert code == 0
    x, y = Projection.from_user_input(out.strip())(8.5, 47.5)
    truth = made.projection(8.5, 47.5)
    assert (x, y) == (pytest.approx(truth[0], abs=1e-8), pytest.approx(truth[1], abs=1e-8))


def test_a_file_is_a_projection(tmp_path: Path) -> None:
    """As any other: for the library, for pyproj, and for the other commands."""
    path = tmp_path / "map.wkt"
    code, out, _ = run(*SWISS, "-o", str(path))
    assert (code, out) == (0, f"Wrote: {path}\n")
    assert CRS.from_wkt(path.read_text()).is_projected
    compared = CliRunner().invoke(app, ["compare", str(path), "EPSG:2056", "-r", "country:CH", "--format", "json"])
    rows = json.loads(compared.stdout)["results"]
    assert rows[0]["projection"] == str(path)
    assert rows[0]["airy_kavrayskiy"] == summarize(str(path), "country:CH").airy_kavrayskiy < rows[1]["airy_kavrayskiy"]


@pytest.mark.slow
def test_picture(tmp_path: Path) -> None:
    """Beside the best existing map; the file is told."""
    path = tmp_path / "map.png"
    code, out, _ = run(*SWISS, "--picture", str(path), "--size", "6,3", "--dpi", "50")
    assert code == 0
    assert out.endswith(f"Wrote: {path}\n")
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_best_existing_crs_is_the_usual_rival() -> None:
    """That of `recommend`, for the kind of the map."""
    code, out, _ = run("box:7.5,46.5,8.5,47.5", "--kind", "conformal", "--degree", "2", "--format", "json")
    assert code == 0
    assert [(one["kind"], one["name"]) for one in json.loads(out)["rivals"]][1] == ("best existing", "EPSG:2056")


@each(
    ("words", "message"),
    [
        (("--kind", "nice"), "Invalid kind 'nice'. It must be one of any, conformal, equal-area."),
        (("--degree", "many"), "Invalid degree 'many'. It must be auto, or a whole number."),
        (("--degree", "0"), "Invalid degree '0'. It must be auto, or a whole number from 1 to 20."),
        (("--balance", "x"), "Invalid balance 'x'. It must be a number."),
        (("--background", "2"), "Invalid background '2.0'. It must be a number from 0 to 0.5."),
        (("--north", "7"), "Invalid north '7'. It must be LON,LAT in degrees."),
        (("--symmetric", "up"), "Invalid symmetry 'up'. It must be none, meridian, equator or both."),
        (("--base", "EPSG:3857", "--kind", "equal-area"), "It must be equal-area at scale 1."),
        (("--datum", "WGS 85"), "Invalid geographic CRS 'WGS 85'."),
        (("-o", "map.png"), "Its suffix must be"),
        (("--size", "3,4"), "Invalid option '--size'. It needs a picture to draw to"),
    ],
)
def test_what_is_refused(words: tuple[str, ...], message: str) -> None:
    """In one line, with an exit code that is not 0."""
    code, out, err = run("country:CH", "--against", "EPSG:2056", *words)
    assert code in (1, 2)
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    assert message in err


def test_the_world_is_refused() -> None:
    """It must be cut, which is another task."""
    code, _, err = run("globe")
    assert code == 2
    assert "It reaches 180 degrees from its middle" in err
