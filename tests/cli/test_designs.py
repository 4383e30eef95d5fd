"""The commands `design`, `mean-map` and `world-map`: formats, options, what they write, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from commands import refusal, run_json, run_ok, told as run
from matplotlib.image import imread
from pyproj import CRS, Transformer

from projdist import Projection, design, mean_map, summarize, world_map
from projdist.designs import Design

pytestmark = pytest.mark.slow

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
    shown = (
        "made to measure",
        "given",
        "EPSG:21781",
        "The image does not cover itself.",
        "limit",
        "Transformed there and back",
    )
    assert [words for words in shown if words not in out] == []


def test_formats_that_programs_read(made: Design) -> None:
    for form in ("proj", "wkt", "wkt-derived", "projjson"):
        out = run_ok("design", *SWISS, "--format", form)
        found = Projection.from_user_input(out.strip())(8.5, 47.5)
        np.testing.assert_allclose(found, made.projection(8.5, 47.5), rtol=0, atol=1e-8)


def test_a_file_is_a_projection(tmp_path: Path) -> None:
    """As any other: for the library, for pyproj, and for the other commands."""
    path = tmp_path / "map.wkt"
    code, out, _ = run("design", *SWISS, "-o", str(path))
    assert (code, out) == (0, f"Wrote: {path}\n")
    assert CRS.from_wkt(path.read_text()).is_projected
    rows = run_json("compare", path, "EPSG:2056", "-r", "country:CH")["results"]
    assert rows[0]["projection"] == str(path)
    assert rows[0]["airy_kavrayskiy"] == summarize(str(path), "country:CH").airy_kavrayskiy < rows[1]["airy_kavrayskiy"]


def test_the_best_existing_crs_is_the_usual_rival(tmp_path: Path) -> None:
    """That of `recommend`, for the kind of the map, also in a picture; the file is told."""
    words, path = ("design", "box:7.5,46.5,8.5,47.5", "--kind", "conformal", "--degree", "2"), tmp_path / "map.png"
    rivals = run_json(*words)["rivals"]
    assert (rivals[1]["kind"], rivals[1]["name"]) == ("best existing", "EPSG:2056")
    assert run_ok(*words, "-o", path, "--size", "6,3", "--dpi", "50").endswith(f"Wrote: {path}\n")
    assert path.read_bytes().startswith(b"\x89PNG")


# ---- mean maps -----------------------------------------------------------------------------------


BETWEEN = ["EPSG:3035", "EPSG:25832", "--region", "box:6,46,10,47.5", "--degree", "3"]


def test_json_of_a_mean() -> None:
    found = mean_map(["EPSG:3035", "EPSG:25832"], region="box:6,46,10,47.5", degree=3, weights=[1, 2])
    assert run_json("mean-map", *BETWEEN, "--weights", "1,2") == found.to_dict()


def test_table_of_a_mean(tmp_path: Path) -> None:
    """The bound, the mean, the average and the maps; which distance it is."""
    out = run_ok("mean-map", *BETWEEN, "--weights", "1,2", "--name", "Between two", "--details")
    shown = ("Between two over", "Weights 1, 2", "bound", "mean", "average", "EPSG:25832", "same point of the")
    assert [text for text in shown if text not in out] == []
    path, picture = tmp_path / "mean.wkt", tmp_path / "mean.png"
    code, _, err = run("mean-map", *BETWEEN, "-o", path, "--picture", picture, "--dpi", "40")
    assert code == 0, err
    assert CRS.from_wkt(path.read_text()).is_projected
    assert imread(picture).std() > 0.05
    for form in ("wkt-derived", "projjson"):
        assert CRS.from_user_input(run_ok("mean-map", *BETWEEN, "--format", form))
    assert run_ok("mean-map", *BETWEEN, "--format", "proj").startswith("+proj=pipeline")
    words = ["aitoff", "moll", "--degree", "3", "--format", "wkt"]
    assert "JSON has its coefficients" in refusal("mean-map", *words, code=1)


# ---- maps of the world ---------------------------------------------------------------------------


QUICK = ("--cells", "8", "--against", "robin")


def test_table_of_the_world() -> None:
    out = run_ok("world-map", *QUICK, "--cut", "-169", "--details")
    assert "\nWorld map, cut at -169 (510,065,622 km2)\nairy_kavrayskiy 0.327" in out
    assert [text for text in ("Symmetric about: both", "Robinson", "8 x 8") if text not in out] == []


def test_json_of_the_world(tmp_path: Path) -> None:
    found = world_map("continent:Africa", elsewhere=0.1, cells=8, against="robin").to_dict()
    assert run_json("world-map", "continent:Africa", *QUICK, "--elsewhere", "0.1") == found | {"pipeline": None}
    path = tmp_path / "towns.csv"
    path.write_text("lon,lat,people\n20,45,100\n21,46,300\n25,44,50\n")
    assert "(3 points)" in run_ok("world-map", f"points:{path}", "--weight", "people", *QUICK, "--details")


def test_files(tmp_path: Path) -> None:
    """Triangles that PROJ runs, and a picture; nothing is overwritten unasked."""
    triangles, picture = tmp_path / "world.json", tmp_path / "world.png"
    words = (*QUICK, "--tinshift", str(triangles), "-o", str(picture), "--dpi", "30")
    out = run_ok("world-map", *words)
    assert f"Wrote: {triangles}" in out
    assert np.isfinite(Transformer.from_pipeline(out.splitlines()[1]).transform(10.0, 50.0)).all()
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "It exists" in refusal("world-map", *words)
