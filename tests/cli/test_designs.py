"""The commands `design`, `mean-map` and `world-map`: formats, options, what they write, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import refusal, run_json, run_ok
from commands import told as run
from matplotlib.image import imread
from pyproj import CRS, Transformer

from projdist import Projection, design, mean_map, summarize, world_map
from projdist.designs import Design

SWISS = ("country:CH", "--degree", "2", "--base", "EPSG:2056", "--against", "EPSG:21781")


@pytest.fixture(scope="module")
def made() -> Design:
    return design("country:CH", degree=2, base="EPSG:2056", against="EPSG:21781", name="Mine")


def test_json(made: Design, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the library answers; the figures, the map to compare with, the degrees, and what is to be known."""
    assert run_json("design", *SWISS, "--name", "Mine") == made.to_dict()
    monkeypatch.setattr("projdist.designs.design", lambda *_, **__: made)
    out = run_ok("design", *SWISS, "--details")
    assert "\nMine (41,324 km2)\nDegree 2 on +proj=somerc" in out
    shown = ("made to measure", "given", "EPSG:21781", "The image does not cover itself.", "limit", "There and back")
    assert [words for words in shown if words not in out] == []


@pytest.mark.slow
@pytest.mark.parametrize("form", ["proj", "wkt", "wkt-derived", "projjson"])
def test_formats_that_programs_read(form: str, made: Design) -> None:
    out = run_ok("design", *SWISS, "--format", form)
    x, y = Projection.from_user_input(out.strip())(8.5, 47.5)
    truth = made.projection(8.5, 47.5)
    assert (x, y) == (pytest.approx(truth[0], abs=1e-8), pytest.approx(truth[1], abs=1e-8))


def test_a_file_is_a_projection(tmp_path: Path) -> None:
    """As any other: for the library, for pyproj, and for the other commands."""
    path = tmp_path / "map.wkt"
    code, out, _ = run("design", *SWISS, "-o", str(path))
    assert (code, out) == (0, f"Wrote: {path}\n")
    assert CRS.from_wkt(path.read_text()).is_projected
    rows = run_json("compare", path, "EPSG:2056", "-r", "country:CH")["results"]
    assert rows[0]["projection"] == str(path)
    assert rows[0]["airy_kavrayskiy"] == summarize(str(path), "country:CH").airy_kavrayskiy < rows[1]["airy_kavrayskiy"]


@pytest.mark.slow
def test_picture(tmp_path: Path) -> None:
    """Beside the best existing map; the file is told."""
    path = tmp_path / "map.png"
    out = run_ok("design", *SWISS, "-o", str(path), "--size", "6,3", "--dpi", "50")
    assert out.endswith(f"Wrote: {path}\n")
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_best_existing_crs_is_the_usual_rival() -> None:
    """That of `recommend`, for the kind of the map."""
    out = run_ok("design", "box:7.5,46.5,8.5,47.5", "--kind", "conformal", "--degree", "2", "--format", "json")
    assert [(one["kind"], one["name"]) for one in json.loads(out)["rivals"]][1] == ("best existing", "EPSG:2056")


# ---- mean maps -----------------------------------------------------------------------------------


BETWEEN = ["EPSG:3035", "EPSG:25832", "--region", "box:6,46,10,47.5", "--degree", "3"]


def test_json_of_a_mean() -> None:
    out = run_ok("mean-map", *BETWEEN, "--weights", "1,2", "--format", "json")
    found = mean_map(["EPSG:3035", "EPSG:25832"], region="box:6,46,10,47.5", degree=3, weights=[1, 2])
    assert json.loads(out) == found.to_dict()


@pytest.mark.slow
def test_table_of_a_mean(tmp_path: Path) -> None:
    """The bound, the mean, the average and the maps; which distance it is."""
    out = run_ok("mean-map", *BETWEEN, "--weights", "1,2", "--name", "Between two", "--details")
    for words in ("Between two over", "Weights 1, 2", "bound", "mean", "average", "EPSG:25832", "same point of the"):
        assert words in out
    code, _, err = run(
        "mean-map", *BETWEEN, "-o", str(tmp_path / "mean.wkt"), "--picture", str(tmp_path / "mean.png"), "--dpi", "40"
    )
    assert code == 0, err
    assert CRS.from_wkt((tmp_path / "mean.wkt").read_text()).is_projected
    assert imread(tmp_path / "mean.png").std() > 0.05
    words = ["aitoff", "moll", "--degree", "3", "--format", "wkt"]
    assert "JSON has its coefficients" in refusal("mean-map", *words, code=1)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["proj", "wkt-derived", "projjson"])
def test_other_forms(form: str) -> None:
    out = run_ok("mean-map", *BETWEEN, "--format", form)
    assert out.startswith("+proj=pipeline") if form == "proj" else CRS.from_user_input(out)


# ---- maps of the world ---------------------------------------------------------------------------


QUICK = ("--cells", "8", "--against", "robin")


@pytest.mark.slow
def test_table_of_the_world() -> None:
    out = run_ok("world-map", *QUICK, "--cut", "-169", "--details")
    assert "\nWorld map, cut at -169 (510,065,622 km2)\nairy_kavrayskiy 0.327" in out
    for words in ("Symmetric about: both", "Robinson", "8 x 8"):
        assert words in out


def test_json_of_the_world(tmp_path: Path) -> None:
    out = run_ok("world-map", "continent:Africa", *QUICK, "--elsewhere", "0.1", "--format", "json")
    found = world_map("continent:Africa", elsewhere=0.1, cells=8, against="robin")
    assert json.loads(out) == found.to_dict() | {"pipeline": None}
    path = tmp_path / "towns.csv"
    path.write_text("lon,lat,people\n20,45,100\n21,46,300\n25,44,50\n")
    out = run_ok("world-map", f"points:{path}", "--weight", "people", *QUICK, "--details")
    assert "(3 points)" in out


@pytest.mark.slow
def test_files(tmp_path: Path) -> None:
    """Triangles that PROJ runs, and a picture; nothing is overwritten unasked."""
    triangles, picture = tmp_path / "world.json", tmp_path / "world.png"
    words = (*QUICK, "--tinshift", str(triangles), "-o", str(picture), "--dpi", "30")
    out = run_ok("world-map", *words)
    assert f"Wrote: {triangles}" in out
    pipeline = out.splitlines()[1]
    assert np.isfinite(Transformer.from_pipeline(pipeline).transform(10.0, 50.0)).all()
    assert picture.read_bytes().startswith(b"\x89PNG")
    code, _, err = run("world-map", *words)
    assert (code, "It exists" in err) == (2, True)
