"""The command `correct`: formats, pictures, words, and what is refused."""

import json

import numpy as np
import pytest
from commands import command
from matplotlib.image import imread
from pyproj import CRS, Transformer
from tables import each

from projdist import correct

run, run_ok, run_json, refusal = command("correct")

KEYS = {
    *("matrix", "airy_kavrayskiy", "airy_kavrayskiy_scaled", "airy_kavrayskiy_affine", "airy_kavrayskiy_corrected"),
    *("pipeline", "wkt", "wkt_reason", "scale", "stretch", "stretch_azimuth"),
}
EUROPE = ["--region", "box:-10,35,40,70"]
SEA = ["--region", "box:-40,30,-30,40"]  # no land takes no time


def test_json():
    """All figures at full precision, under the keys that programs rely on."""
    data = run_json("moll")
    assert data.keys() >= KEYS
    assert data["projection"] == "moll"
    assert data == correct("moll").to_dict()
    out = run_ok("plate-carree")
    shown = [
        *("0.521240", "0.421347", "corrected (affine), measured again", "x' = 0.735758882 x"),
        *("stretch 1.359141 along the vertical", "PROJ: +proj=pipeline", "WKT2: see --format wkt"),
        "By its own parameters: +proj=eqc +R=6371008.7714 +lat_ts=42.6286",
    ]
    assert [text for text in shown if text not in out] == []


@pytest.mark.slow
def test_median():
    """The mean distortion and what half of the area is below, for the map as it is, after the MDT, and corrected."""
    out = run_ok("robinson", "--criterion", "median")
    shown = ("half the area below", "corrected (median), measured again", "0.1652", "0.2473")
    assert [text for text in (*shown, "best scale") if text not in out] == ["best scale"]
    found = correct("robinson", criterion="median").to_dict() | {"projection": "robinson"}
    assert run_json("robinson", "--criterion", "median") == found


def test_proj_and_wkt():
    truth = correct("moll").corrected(10.0, 50.0)
    out = run_ok("moll", "--format", "proj")
    np.testing.assert_allclose(Transformer.from_pipeline(out.strip()).transform(10.0, 50.0), truth, atol=2e-9)
    assert CRS.from_wkt(run_ok("moll", "--format", "wkt")).name == "Mollweide, corrected"
    message = "Invalid format 'wkt' for Mollweide. Mollweide is not a CRS, but a function or a pipeline."
    assert refusal("+proj=pipeline +step +proj=moll +R=1", "--format", "wkt", code=1) == message


@pytest.mark.slow
@each("words", ["--constraint stretch", "--constraint scale", "--free", "--keep-north"])
def test_options(words: str) -> None:
    M = np.array(run_json("laea", *EUROPE, *words.split())["matrix"])
    assert words != "--constraint stretch" or np.linalg.det(M) == pytest.approx(1.0, rel=1e-12)
    assert (M[0, 1] == 0.0) == (words != "--free")


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_pictures(tmp_path):
    """Before and after, or the field of local corrections, as a picture; JSON has it without one, too."""
    path = tmp_path / "x.png"
    for words in ([], ["--local", "300", "--overwrite"]):
        out = run_ok("moll", *SEA, "-o", path, *words, "--size", "5,4", "--dpi", "50")
        assert out.endswith(f"Wrote: {path}\n")
        assert imread(path).shape[:2] == (200, 250)
    words = ["moll", *SEA, "--local", "300"]
    data = json.loads(run(*words, "--step", "5", "--format", "json", "-o", tmp_path / "x.svg", "--title", "Mine")[1])
    assert "Mine" in (tmp_path / "x.svg").read_text(encoding="utf-8")
    assert data["radius_km"] == 300.0
    assert data["results"][0].keys() == {"lon", "lat", "matrix", "scale", "stretch", "stretch_azimuth", "error"}
    data = run_json(*words)
    assert (data["name"], len(data["results"]) > 10) == ("Mollweide", True)


def test_what_a_picture_shows(tmp_path, monkeypatch):
    """Indicatrices before and after, of the same region, with both figures."""
    drawn = []
    monkeypatch.setattr("projdist.plots.tissot_figure", lambda maps, **options: drawn.append((maps, options)))
    monkeypatch.setattr(
        "projdist.cli.options.PictureFile.save", lambda _, draw, *shown, **options: draw(*shown, **options)
    )
    path = tmp_path / "x.png"
    code, out, err = run("mollweide", *SEA, "-o", str(path))
    assert (code, err, out.endswith(f"Wrote: {path}\n")) == (0, "", True)
    ((maps, options),) = drawn
    found = correct("mollweide", "box:-40,30,-30,40")
    lon, lat = np.array([-38.0, -32.0]), np.array([31.0, 39.0])
    np.testing.assert_allclose(np.array(maps[1](lon, lat)), found.matrix @ np.array(maps[0](lon, lat)), rtol=1e-12)
    assert options["airy_kavrayskiy"] == pytest.approx([found.airy_kavrayskiy, found.airy_kavrayskiy_corrected])
    assert options["region"].bounds == (-40.0, 30.0, -30.0, 40.0)
