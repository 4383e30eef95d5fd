"""The command `oldmap`: formats, pictures, and what is refused."""

import shlex

import numpy as np
import pytest
from commands import command, parse_csv
from matplotlib.image import imread
from PIL import Image
from refusals import says, wrong_words
from tables import each

from projdist import old_map, plots, read_control_points
from projdist.cli import oldmap

pytestmark = pytest.mark.slow

run, run_ok, run_json, refusal = command("oldmap")

QUICK = ["--model", "polynomial2"]


@pytest.fixture
def points(tmp_path):
    """A file of 25 control points, of which a known quadratic map leads to the truth."""
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 400.0, 5)] * 2), axis=-1).reshape(-1, 2).T
    path = tmp_path / "points.csv"
    table = np.stack([x, y, 6e5 + 50.0 * x + 0.02 * x * x, 2e5 - 52.0 * y + 0.01 * x * y], axis=-1)
    np.savetxt(path, table, delimiter=",", header="x_old,y_old,x_new,y_new", comments="")
    return path


def test_json(points):
    """All figures at full precision, as the library has them; a smoothing that is given is used."""
    found = run_json(points, "--smoothing", "0.5")
    assert found == old_map(read_control_points(points), smoothing=0.5).to_dict()
    assert (found["model"], found["smoothing"]) == ("tps", 0.5)
    rows = parse_csv(run_ok(points, *QUICK, "--format", "csv"))
    expected = old_map(read_control_points(points), model="polynomial2").to_dict()["points"]
    assert (len(rows), float(rows[7]["fisher"]), rows[7]["id"]) == (25, expected[7]["fisher"], "8")


def test_table(points):
    """The three rectifications, the fit, folds, outliers and what is to be noted."""
    out = run_ok(points, *QUICK, "--scan-dpi", "300")
    shown = [
        *("25 control points, polynomial2", "mean Dist_F^2", "MDT", "affine, least squares", "Helmert, least squares"),
        *("scale 1 :", "The fit has 6 parameters per coordinate; the points are ", "The fit has no folds."),
        *(
            "After the MDT, on nine tenths of the area: fisher ",
            "The old map is mirrored as a whole: its y axis points",
        ),
    ]
    assert [text for text in shown if text not in out] == []
    out = run_ok(points, *QUICK, "--format", "markdown")
    assert out.startswith("| map | mean Dist_F^2 | RMS at points, m | m per unit | ± | stretch |")
    assert out.count("\n| ") == 4


def test_folds_and_outliers_are_named(tmp_path):
    """Folds are told with their area, and what lies near; so are outliers."""
    rng = np.random.default_rng(3)
    old = rng.uniform(0.0, 100.0, (40, 2))
    new = 30.0 * old + rng.normal(0.0, 2.0, (40, 2))
    new[5] += [0.0, 900.0]
    path = tmp_path / "p.txt"
    np.savetxt(path, np.hstack([np.arange(40)[:, None], old, new]), fmt="%.9g")
    for words, shown in (
        (["--outliers", "keep"], ("The fit folds on ", "square units), near ", "Outliers, the farthest first: 5.\n")),
        ([], ("The fit has no folds.", "Outliers, left out of the fit, the farthest first: 5.\n")),
    ):
        out = run(path, "--smoothing", "0", *words)[1]
        assert [text for text in shown if text not in out] == []


def test_longitudes_and_latitudes(tmp_path):
    """With a CRS the truth may be in degrees."""
    path = tmp_path / "p.csv"
    path.write_text("x_old,y_old,lon,lat\n0,0,7,47\n100,0,8,47\n0,100,7,48\n100,100,8,48\n", encoding="utf-8")
    data = run_json(path, *QUICK[:1], "affine", "--crs", "EPSG:32632")
    # A degree of latitude is 111.2 km long at 47.5 degrees, one of longitude 75.3 km.
    assert data["rectifications"]["affine"]["scale"] == pytest.approx(np.sqrt(1112.0 * 753.0), rel=2e-3)
    code, _, err = run(path, "--crs", "nosuch")
    assert (code, "Invalid projection 'nosuch'" in err) == (1, True)


def test_picture(points, tmp_path):
    """The panels that are asked for, in the size that is asked for; the table says where."""
    path = tmp_path / "x.png"
    words = ["-o", path, "--size", "8,4", "--dpi", "50", "--draw", "grid,heatmap", "-m", "areal_scale"]
    assert f"Wrote: {path}" in run_ok(points, *QUICK, *words)
    assert imread(path).shape[:2] == (200, 400)
    assert [run(points, *QUICK, *words, *more)[0] for more in ([], ["--overwrite"])] == [2, 0]


def test_sheet(points, tmp_path):
    """The scan as a GeoTIFF in the CRS; without one that is told."""
    rasterio = pytest.importorskip("rasterio")
    Image.fromarray(np.full((400, 400), 99, np.uint8)).save(tmp_path / "scan.png")
    scan, path = ["--image", tmp_path / "scan.png"], tmp_path / "x.tif"
    words = [points, *QUICK, *scan, "-o", path]
    assert run_ok(*words, "--crs", "EPSG:21781", "--resolution", "100").endswith(f"Wrote: {path}\n")
    with rasterio.open(path) as sheet:
        assert (sheet.crs.to_epsg(), sheet.count, sheet.res) == (21781, 2, (100.0, 100.0))
        # The control point 200, 200 is in the middle.
        east, north = 6e5 + 50.0 * 200 + 0.02 * 200**2, 2e5 - 52.0 * 200 + 0.01 * 200**2
        assert [tuple(value) for value in sheet.sample([(east, north), (east, 3e5)])] == [(99, 255), (0, 0)]
    assert run(*words, "--crs", "EPSG:21781")[0] == 2
    code, _, err = run(*words, "--by", "affine", "--overwrite")
    assert (code, "has no CRS" in err) == (0, True)
    wrong = refusal(points, *QUICK, *scan, "-o", tmp_path / "y.tif", "--crs", "apian")
    assert "A GeoTIFF has no room for it." in wrong
    assert refusal(points, "--image", path, "-o", path, "--overwrite").endswith("the scan.")


def test_layers(points, tmp_path):
    """Displacements and isolines as layers of a GeoPackage in the CRS."""
    pyogrio = pytest.importorskip("pyogrio")
    path = tmp_path / "x.gpkg"
    assert run_ok(points, *QUICK, "-o", path, "--crs", "EPSG:21781").endswith(f"Wrote: {path}\n")
    layers = dict(pyogrio.list_layers(path))
    assert layers == dict.fromkeys(["displacements", "fisher", "areal_scale", "scale", "rotation"], "LineString")
    assert pyogrio.read_info(path, layer="scale")["crs"] == "EPSG:21781"
    assert pyogrio.read_info(path, layer="displacements")["features"] == 25


def test_words_are_those_of_the_pictures():
    """The command line names the panels and measures that can be drawn."""
    assert set(oldmap.PANELS) == set(plots.OLD_MAP_PANELS)
    assert oldmap.DRAWN_MEASURES == plots.OLD_MAP_MEASURES


@each(("words", "code", "message"), wrong_words("_oldmap"))
def test_wrong_words(words, code, message, points, tmp_path, monkeypatch):
    pytest.importorskip("geopandas")
    pytest.importorskip("rasterio")
    monkeypatch.chdir(tmp_path)
    quick = [] if "--model" in words or "--smoothing" in words else QUICK
    assert says(message, refusal(points.name, *shlex.split(words), *quick, code=code))
    assert [path.name for path in tmp_path.iterdir()] == [points.name]


# ---- several maps ---------------------------------------------------------------------------

GROWTH = 0.4  # of one sheet to the east, of the other to the north, as an exponent over its side


@pytest.fixture
def sheets(tmp_path):
    """Two files of a unit square: one grows to the east; the other to the north, in another unit, mirrored."""
    x, y = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 2), axis=-1).reshape(-1, 2).T
    truth = 1e5 * np.stack([x, y], axis=-1)
    east = np.stack([np.exp(GROWTH * x) / GROWTH, y], axis=-1)
    north = 300.0 * np.stack([x, -np.exp(GROWTH * y) / GROWTH], axis=-1)
    paths = [tmp_path / "east.csv", tmp_path / "north.csv"]
    for path, old in zip(paths, (east, north), strict=True):
        np.savetxt(path, np.hstack([old, truth]), delimiter=",", header="x_old,y_old,x_new,y_new", comments="")
    return paths


def test_several(sheets):
    """ln of the scale is even in [-g / 2, g / 2]: mean square g^2 / 12; half of it is common, as scales' logs add."""
    found = run_json(*sheets, "--model", "polynomial3")
    square = GROWTH**2 / 12.0
    cubic = 0.02  # a cubic's derivative is the exponential's to 1 % there
    for row in found["maps"]:
        assert [row["distortion"], row["from_mean"]] == pytest.approx([square, square / 2.0], rel=cubic)
        assert (row["points"], row["left_out"]) == (81, 0)
    assert found["mean"]["distortion"] == pytest.approx(square / 2.0, rel=cubic)
    assert found["mean"]["total"] == pytest.approx(sum(row["from_mean"] for row in found["maps"]), rel=1e-9)
    table = run(*sheets, "--model", "polynomial3", "--by", "affine")[1]
    shown = ("2 old maps, each after its affine", "their mean", "They share 50")
    assert [text for text in shown if text not in table] == []
    rows = parse_csv(run(*sheets, "--format", "csv")[1])
    assert [row["map"] for row in rows] == [*map(str, sheets), "their mean"]


def test_what_is_of_one_map(sheets):
    """A map is given once, too: with itself it would have everything in common."""
    for words, message in {
        ("-o", "a.png"): "Invalid option '--output' for several maps. It is for one.",
        ("--draw", "grid"): "Invalid option '--draw' for several maps.",
        ("--by", "fit"): "Invalid rectification 'fit'. It must be one of mdt, affine, helmert.",
        ("--measure", "areal_scale"): "Invalid option '--measure' for several maps.",
        (str(sheets[1]),): f"Invalid points file '{sheets[1]}'. It must be given once.",
    }.items():
        assert message in refusal(*sheets, *words)


def test_maps_without_distortion(sheets, tmp_path):
    """Of two affine maps rounding is no share of anything; maps of two places have no common ground."""
    table = np.loadtxt(sheets[0], delimiter=",", skiprows=1)
    far, *paths = tmp_path / "far.csv", tmp_path / "one.csv", tmp_path / "two.csv"
    np.savetxt(far, table + np.array([0.0, 0.0, 5e5, 5e5]), delimiter=",")
    assert "Invalid old maps. There is no ground that all of them show." in refusal(sheets[0], far)
    for path, stretch in zip(paths, (1.0, 1.1), strict=True):
        np.savetxt(path, np.hstack([table[:, 2:] * [stretch, 1.0] / 100.0, table[:, 2:]]), delimiter=",")
    out = run_ok(*paths)
    assert "The maps have no distortion beyond rounding." in out
    assert "e-" not in out
