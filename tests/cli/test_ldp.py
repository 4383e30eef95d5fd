"""The command `ldp`: formats, options, pictures, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import command, parse_csv
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text
from pyproj import CRS

from projdist import plots
from projdist.decisions import LDP, distortion_ppm, ldp
from projdist.decisions.ground import statistics_of
from projdist.decisions.low_distortion import goal_of
from projdist.plots.map_drawing import GroundMap

pytestmark = pytest.mark.slow

run, run_ok, run_json, refusal = command("ldp")

SEA = "box:-40,30,-39.5,30.4"  # no land takes no time
QUICK = ["--families", "tmerc"]


@pytest.fixture
def heights(tmp_path: Path) -> Path:
    lon, lat = (axis.ravel() for axis in np.meshgrid(np.linspace(-40, -39.5, 10), np.linspace(30, 30.4, 10)))
    table = np.column_stack([lon, lat, 300 + 400 * (lon + 40)])
    np.savetxt(tmp_path / "heights.csv", table, delimiter=",", header="lon,lat,h", comments="")
    return tmp_path / "heights.csv"


def test_small_places_have_an_area() -> None:
    """A thousandth of a degree at 50 north is 71.7 by 111.2 m, not "0 km2"."""
    out = run("box:-40,50,-39.999,50.001", "--height", "0", *QUICK)[1]
    assert "(0.00797 km2)" in out
    assert run_json(SEA, "--height", "250", *QUICK) == ldp(SEA, height=250.0, families=["tmerc"]).to_dict()


def test_table(heights: Path) -> None:
    """Parameters in degrees, minutes and seconds; statistics of all maps; that heights are ellipsoidal."""
    words = ["--against", "EPSG:32624", "--criterion", "rms_scale_error_ppm", *QUICK]
    out = run_ok(SEA, "--heights", heights, *words)
    shown = ("lon_0", "°", "tmerc", "EPSG:32624", "within 20", "ellipsoidal, not orthometric", "100 points", "PROJ:")
    assert [words for words in shown if words not in out] == []
    common = [SEA, "--heights", heights, *QUICK, "--round-axis", '30"', "--round-k", "1e-5", "--target-ppm", "5"]
    wkt = run(*common, "-f", "wkt", "--geodetic", "EPSG:6318", "--name", "My LDP")[1]
    assert CRS.from_wkt(wkt).name == "My LDP"
    assert len(parse_csv(run(*common, "-f", "csv")[1])) == 100


@pytest.mark.usefixtures("few_cells")
def test_pictures(tmp_path: Path, heights: Path) -> None:
    """A field of colour for level ground, dots for points."""
    path = tmp_path / "ppm.png"
    for ground in (["--height", "500"], ["--heights", heights]):
        out = run_ok(SEA, *ground, *QUICK, "-o", path, "--size", "4,4", "--dpi", "60", "--overwrite")
        assert out.endswith(f"Wrote: {path}\n")
        picture = imread(path)
        assert picture.shape[:2] == (240, 240)
        assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 50


@pytest.fixture(scope="module")
def level() -> LDP:
    """A map for level ground, with a coarse axis, so that it is quick."""
    return ldp(SEA, height=250.0, families=["tmerc"], round_axis=0.25, round_k=1e-5)


@pytest.fixture
def known(level: LDP, monkeypatch: pytest.MonkeyPatch) -> LDP:
    """The answer is there already: what it looks like takes no search."""
    monkeypatch.setattr("projdist.decisions.ldp", lambda *_, **__: level)
    return level


def test_forms_of_an_answer(known: LDP, monkeypatch: pytest.MonkeyPatch) -> None:
    """JSON, PROJ, two kinds of WKT, the points as CSV; a form that there is not ends with 1."""
    words = [SEA, "--height", "250"]
    assert run_json(*words) == known.to_dict()
    assert known.to_dict()["height"] == {"min": 250.0, "max": 250.0, "kind": "ellipsoidal"}
    assert run(*words, "-f", "proj")[1] == f"{known.proj}\n"
    assert CRS.from_wkt(run(*words, "-f", "wkt")[1]) == CRS.from_wkt(known.wkt)
    assert run(*words, "-f", "esri")[1].startswith("PROJCS[")
    rows = parse_csv(run(*words, "-f", "csv")[1])
    assert list(rows[0]) == ["lon", "lat", "height", "ppm"]
    assert [float(row["ppm"]) for row in rows] == known.ppm.tolist()
    monkeypatch.setattr("projdist.decisions.ldp", lambda *_, **__: replace(known, esri=None))
    assert refusal(*words, "-f", "esri", code=1).startswith("Invalid format 'esri' for ")


def test_level_ground_is_a_field(level: LDP) -> None:
    """Colours from 0 ppm to the largest distortion; the height is told."""
    axes = Figure().add_subplot()
    scale = plots.ground_map(axes, level, title="ground", colourbar=False)
    assert scale.label == "Distortion (ppm)"
    assert scale.limits[0] <= 0.0 < scale.limits[1]
    # The field is at more points than the nodes of the answer.
    assert scale.limits[1] == pytest.approx(max(abs(level.ppm.min()), level.ppm.max()), rel=0.1)
    assert axes.get_title() == "ground"
    words = " ".join(text.get_text() for text in axes.findobj(Text))
    assert "at an ellipsoidal height of 250 m" in words


def test_simpler_maps(level: LDP) -> None:
    """An oblique map that holds hardly more of the points is told of a simpler one; one that holds more is not."""
    ppm, weight = np.array([1.0, 3.0, 30.0, 40.0]), np.full(4, 0.25)
    mine = replace(level, ppm=ppm, weight=weight, statistics=statistics_of(ppm, weight, [20.0]))
    oblique = replace(mine, family="omerc", goal=goal_of("share", 20.0, 1e-6), others=(mine,))
    assert oblique.simpler is mine
    assert oblique.notes == (
        "A simpler map is nearly as good: tmerc has 50.0 % within 20 ppm, RMS 25.05 ppm; "
        "this has 50.0 % within 20 ppm, RMS 25.05 ppm.",
    )
    worse = replace(mine, ppm=2.0 * ppm)
    assert replace(oblique, goal=goal_of("rms_scale_error_ppm", 20.0, 1e-6), others=(worse,)).simpler is None
    near = replace(mine, ppm=1.04 * ppm)
    assert replace(oblique, goal=goal_of("max_scale_error_ppm", 20.0, 1e-6), others=(near,)).simpler is not None
    assert mine.simpler is None
    assert mine.notes == ()


@pytest.mark.usefixtures("few_cells")
def test_a_raster_of_heights_is_a_field(level: LDP) -> None:
    """Even points are no dots: values between them are those of the heights there; the target has thick lines."""
    west, south, east, north = level.region.bounds
    lon, lat = (a.ravel() for a in np.meshgrid(np.linspace(west, east, 20), np.linspace(south, north, 20)))
    height = 250.0 + 100.0 * (lon - west) / (east - west)
    ppm = distortion_ppm(level.projection, lon, lat, height)
    goal = replace(level.goal, target=5.0)
    statistics = replace(level.statistics, within={5.0: 0.5})
    even = {"lon": lon, "lat": lat, "height": height, "ppm": ppm, "weight": np.full(400, 1 / 400)}
    found = replace(level, **even, goal=goal, statistics=statistics)
    prepared = GroundMap.of(found)
    assert prepared.is_field
    places = prepared.surface.lonlat()
    heights = 250.0 + 100.0 * (places[0] - west) / (east - west)
    inside = np.flatnonzero(prepared.surface.weights > 0)
    truth = distortion_ppm(level.projection, *places, heights)
    np.testing.assert_allclose(prepared.ppm[inside], truth[inside], atol=1.0)  # 6 m beyond the outermost points
    axes = Figure().add_subplot()
    scale = plots.ground_map(axes, found, title="ground")
    assert scale.limits[0] < 0 < scale.limits[1]
    assert "(thick lines)" in " ".join(text.get_text() for text in axes.texts)


@pytest.mark.usefixtures("few_cells")
def test_uneven_points_are_dots(level: LDP) -> None:
    """Points along a road are no raster."""
    t = np.linspace(0.0, 1.0, 300) ** 3
    west, south, east, north = level.region.bounds
    lon, lat = west + t * (east - west), south + t * (north - south)
    road = {"lon": lon, "lat": lat, "height": 100.0 * t, "ppm": 10.0 * t, "weight": np.full(300, 1 / 300)}
    assert not GroundMap.of(replace(level, **road)).is_field
