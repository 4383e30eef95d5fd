"""Files for GIS programs, `convert`, and the rule that no file is overwritten unless asked."""

import os
import sys
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from commands import parse_csv, refusal as refused, run_json, run_ok, told as run
from refusals import says, wrong_words
from tables import each

import projdist
from projdist import factors, gis
from projdist.cli import data

geopandas = pytest.importorskip("geopandas")
pd = pytest.importorskip("pandas")
rasterio = pytest.importorskip("rasterio")

BOX = ["-r", "box:0,20,40,60"]
POINTS = 'id,lon,lat,note\n007,7.44,46.95,\n8,9.53,46.85,"a, b"\n'


@pytest.fixture
def points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file p.csv in the current folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.csv").write_text(POINTS)
    return tmp_path


@pytest.mark.slow
@each(("options", "shape"), [
    ("--size 40", (40, 40)), ("--size 40x30", (30, 40)), ("--resolution 2 --grid lonlat", (20, 20)),
    ("--resolution 100000", None),
])  # fmt: skip
def test_heatmap_as_a_raster(options: str, shape: tuple[int, int] | None, tmp_path: Path) -> None:
    """One band a measure, in their order, of the pixels asked for; the path is printed."""
    path, words = tmp_path / "x.tif", ["heatmap", "eqc", *BOX, "-m", "omega,s", "-m", "h", *options.split()]
    assert run_ok(*words, "-o", path, "--overwrite") == f"Wrote: {path}\n"
    with rasterio.open(path) as image:
        assert image.descriptions == ("omega", "s", "h")
        assert image.crs.is_geographic == ("lonlat" in options)
        assert (image.res, image.bounds.left % 1e5) == ((1e5, 1e5), 0) if shape is None else image.shape == shape
    assert list(tmp_path.iterdir()) == [path]


PIPELINE = "+proj=pipeline +step +proj=moll"


def test_a_raster_that_falls_back(tmp_path: Path) -> None:
    """The file is written, and a line on standard error says in which CRS."""
    path = tmp_path / "x.tif"
    note = "projdist: Note: Mollweide has no CRS; the raster is in longitude and latitude.\n"
    assert run("heatmap", PIPELINE, *BOX, "--size", "9", "-o", path) == (0, f"Wrote: {path}\n", note)
    with rasterio.open(path) as image:
        assert image.descriptions == ("fisher",)


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
def test_tissot_as_a_layer(tmp_path: Path) -> None:
    """The indicatrices of the step asked for; a map without a CRS has a note."""
    path = tmp_path / "x.gpkg"
    words = [*BOX, "--step", "10", "-o", path]
    assert run_ok("tissot", "EPSG:3035", *words) == f"Wrote: {path}\n"
    assert geopandas.read_file(path).crs.to_epsg() == 3035
    code, out, err = run("tissot", PIPELINE, *words, "--overwrite")
    assert (code, out) == (0, f"Wrote: {path}\n")
    assert err.startswith("projdist: Note: Mollweide has no CRS; that of the layer is undefined")


@pytest.mark.slow
@each(("words", "code", "message"), wrong_words("_gis"))
def test_wrong_words(words: str, code: int, message: str, points: Path) -> None:
    files = {
        "bad.csv": "lon,lat\n1,2\n3,99\n",
        "n.csv": "length,lat\n1,2\n",
        "short.csv": "lon,lat,name\n1,2\n",
        "commas.csv": "lon,lat\n1,5,2,5\n",
        "ragged.csv": "lon,lat\n1,2,3\n",
        "taken.csv": "lon,lat,K\n1,2,3\n",
        "empty.csv": "",
    }
    for name, text in files.items():
        (points / name).write_text(text)
    assert says(message, refused(*words.split(), code=code))
    assert {path.name for path in points.iterdir()} == {"p.csv", *files}


@pytest.mark.parametrize(("words", "library", "thing"), [
    ("heatmap moll -o x.tif", "rasterio", "output 'x.tif'"),
    ("tissot moll -o x.gpkg", "geopandas", "output 'x.gpkg'"),
    ("factors moll --at p.csv -o x.parquet", "pyarrow", "output 'x.parquet'"),
    ("factors moll --at p.gpkg", "geopandas", "points file 'p.gpkg'"),
    ("factors moll 1 2 -o x.gpkg", "pyogrio", "output 'x.gpkg'"),
    *(("atlas Malta --export a.gpkg", library, "output 'a.gpkg'") for library in ("geopandas", "pyogrio")),
    ("atlas Malta --export a.parquet", "pyarrow", "output 'a.parquet'"),
])  # fmt: skip
def test_a_missing_library(words: str, library: str, thing: str, points: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    assert refused(*words.split()) == f"Invalid {thing}. It needs {library}: pip install 'projdist[gis]'."
    assert [path.name for path in points.iterdir()] == ["p.csv"]


def test_csv_needs_no_library(points: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Own cells come back as they were, the added ones are those of `factors` to the last digit."""
    for library in ("pandas", "geopandas", "pyogrio", "pyarrow"):
        monkeypatch.setitem(sys.modules, library, None)
    words = ["factors", "EPSG:2056", "--at", "p.csv", "-m", "airy"]
    assert run_ok(*words, "-o", "o.csv") == "Wrote: o.csv\n"
    rows = parse_csv((points / "o.csv").read_text())
    for row, before in zip(rows, parse_csv(POINTS), strict=True):
        assert {name: row[name] for name in before} == before
        truth = factors("EPSG:2056", float(row["lon"]), float(row["lat"]), measures=["airy"])
        assert (float(row["convergence"]), float(row["airy"])) == (truth.convergence, truth.extra["airy"])
        assert row["quality"] == "ok"
    assert run_ok(*words, "-f", "csv") == (points / "o.csv").read_text()


@pytest.mark.slow
def test_points_from_file_to_file(points: Path) -> None:
    """From CSV to a GeoPackage, to GeoJSON, to Parquet, to CSV: each has the columns of those before."""
    steps = [("p.csv", "a.gpkg"), ("a.gpkg", "b.geojson"), ("b.geojson", "c.parquet"), ("c.parquet", "d.csv")]
    for number, (source, target) in enumerate(steps):
        words = ["factors", "EPSG:2056", "--at", source, "-o", target, "--prefix", f"p{number}_"]
        assert run_ok(*words) == f"Wrote: {target}\n"
    read = pd.read_csv("d.csv", dtype={"id": str})
    assert read.id.tolist() == ["007", "8"]
    truth = factors("EPSG:2056", [7.44, 9.53], [46.95, 46.85])
    for number in range(len(steps)):
        np.testing.assert_allclose(read[f"p{number}_convergence"], truth.convergence, atol=1e-6)
        np.testing.assert_allclose(read[f"p{number}_x"], truth.x, atol=5e-2)
    assert run_ok("factors", "EPSG:2056", "7.44", "46.95", "-o", "x.gpkg") == "Wrote: x.gpkg\n"
    read = geopandas.read_file("x.gpkg")
    assert read.crs.to_epsg() == 4150
    assert read.h[0] == float(factors("EPSG:2056", 7.44, 46.95).h)


def test_points_of_a_layer_are_printed(points: Path) -> None:
    """With their own columns, and longitude and latitude in the place of the geometry."""
    own = {"name": ["Bern"], "day": [pd.Timestamp("2024-05-01")]}
    geopandas.GeoDataFrame(own, geometry=geopandas.points_from_xy([7.44], [46.95]), crs=4326).to_file("p.gpkg")
    for form in ("table", "json", "csv", "markdown"):
        out = run_ok("factors", "EPSG:32632", "--at", "p.gpkg", "-f", form)
        assert ("Bern" in out, "2024-05-01" in out) == (True, True)
    (row,) = run_json("factors", "EPSG:32632", "--at", "p.gpkg")["results"]
    assert (row["lon"], row["lat"]) == pytest.approx((7.44, 46.95), abs=1e-9)
    assert row["k"] == pytest.approx(float(factors("EPSG:32632", 7.44, 46.95).k), rel=1e-12)


WRITING = ["factors moll 1 2 -o x.csv", "factors moll --at p.csv -o x.csv", "factors moll --at p.csv -o x.geojson"]
SLOWLY = [
    *("compare moll -r box:0,0,9,9 --tolerance 1e-3 -o x.txt", "factors moll 1 2 -o x.gpkg"),
    *("factors moll --at p.csv -o x.parquet", "heatmap eqc -r box:0,0,40,30 --size 9 -o x.tif"),
    *("tissot eqc -r box:0,0,9,9 --dpi 20 -o x.png", "tissot eqc -r box:0,0,40,30 -o x.gpkg"),
    *("heatmap eqc -r box:0,0,40,30 --dpi 20 -o x.svg", "correct moll -r box:0,0,9,9 -o x.png --dpi 20"),
    "correct moll -r box:0,0,40,30 -o x.png --dpi 20 --local 900",
]


@each("words", [*WRITING, *(pytest.param(words, marks=pytest.mark.slow) for words in SLOWLY)])
def test_overwriting(words: str, points: Path) -> None:
    """An existing file is refused in one line and stays as it was; --overwrite replaces it."""
    path = points / words.split("-o ")[1].split()[0]
    path.write_text("old")
    assert refused(*words.split()) == f"Invalid output '{path.name}'. It exists; --overwrite replaces it."
    assert path.read_text() == "old"
    run_ok(*words.split(), "--overwrite")
    assert path.read_bytes() != b"old"
    assert {file.name for file in points.iterdir()} == {"p.csv", path.name}
    path.unlink()


@pytest.mark.skipif(os.name == "nt", reason="devices of Unix")
@pytest.mark.parametrize("words", ["factors moll 1 2", "factors moll --at p.csv"])
def test_devices_are_written_to(words: str, points: Path) -> None:
    """/dev/null is there, and holds nothing to lose."""
    assert run_ok(*words.split(), "-o", "/dev/null") == ""
    assert Path("/dev/null").is_char_device()


@each(("name", "text"), [
    ("a.csv", "longitude,latitude\n11.5,48.25\n"),
    ("b.csv", "lon;lat\n11.5;48.25\n"),
    ("c.csv", "Latitude;Longitude\n48,25;11,5\n"),
    ("a.tsv", "name\tLAT\tlng\nx\t48.25\t11.5\n"),
    ("a.txt", "long lat\n11,5 48,25\n"),
])  # fmt: skip
def test_tables_of_points(name: str, text: str, points: Path) -> None:
    """Names and delimiters are those of `points:`; h is UTM's on its ellipsoid, by PROJ."""
    Path(name).write_text(text)
    truth = pyproj.Proj("EPSG:25832").get_factors(11.5, 48.25).meridional_scale
    words = ["factors", "EPSG:25832", "--at", name]
    (printed,) = parse_csv(run_ok(*words, "-f", "csv"))
    run_ok(*words, "-o", "o.csv", "--overwrite")
    assert [float(printed["h"]), pd.read_csv("o.csv").h[0]] == pytest.approx([truth] * 2, rel=1e-9)
    if name == "c.csv":
        run_ok(*words, "-o", "o.gpkg")
        assert geopandas.read_file("o.gpkg").h[0] == pytest.approx(truth, rel=1e-9)
    region = projdist.get_region(f"points:{name}")
    assert (region.lon.tolist(), region.lat.tolist()) == ([11.5], [48.25])


@pytest.fixture
def folder(points: Path) -> Path:
    """The current folder, with a point."""
    frame = geopandas.GeoDataFrame({"name": ["a"]}, geometry=geopandas.points_from_xy([8.0], [47.0]), crs="EPSG:4326")
    frame.to_file("data.geojson")
    return points


@pytest.mark.slow
def test_there_and_back(folder: Path) -> None:
    """The CRS that other programs do not read is beside the file, which a line says; the data come back by either."""
    run_ok("design", "country:CH", "--degree", "2", "--base", "EPSG:3035", "--against", "EPSG:2056", "-o", "map.wkt")
    code, out, err = run("convert", "data.geojson", "--to", "map.wkt", "-o", "new.shp")
    assert (code, out, err.count("\n")) == (0, "Wrote: new.shp\nWrote: new.wkt\n", 1)
    told = "Other programs than projdist do not understand this CRS in 'new.shp'. It is in"
    assert err.startswith(f"projdist: Note: {told}")
    for k, source in enumerate((["--from", "new.wkt"], [])):
        name = f"{k}.gpkg"
        assert run_ok("convert", "new.shp", "EPSG:4326", *source, "-o", name) == f"Wrote: {name}\n"
        back = shapely.get_coordinates(geopandas.read_file(name).geometry.array)
        assert back.ravel() == pytest.approx([8.0, 47.0], abs=1e-8)


def test_refused_conversions(folder: Path) -> None:
    for words, code, message in wrong_words("_convert"):
        assert says(message, refused("convert", "data.geojson", *words.split(), code=code))
    assert not list(folder.glob("x.*"))


def test_words_of_conversions() -> None:
    """Those of the command, which loads nothing for its help, are the library's."""
    assert data._RESAMPLINGS == gis.RESAMPLINGS
    assert set(data._CONVERTED_SUFFIXES) == set(gis.CONVERTED_SUFFIXES)
