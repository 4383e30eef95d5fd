"""Commands on a disk that is full: one line, and the old files as they were."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from commands import QUICK, run
from full_disks import room_for

from projdist.applications.mosaics.rendering import save_mosaic

geopandas = pytest.importorskip("geopandas")
rasterio = pytest.importorskip("rasterio")

SMALL = ["--dpi", "30", "--size", "3,3"]
ISLAND = ["-r", "box:0,50,9,56"]
# Everything that a command writes, by its suffix: GDAL, pyarrow, matplotlib, Pillow and Python have each their own way
# to fail, or none.
COMMANDS = {
    "compare": (["compare", "moll", *ISLAND, *QUICK], (".json", ".csv", ".md", ".html", ".txt")),
    "factors": (["factors", "moll", "--at", "DATA.csv"], (".csv", ".gpkg", ".geojson", ".parquet")),
    "tissot": (["tissot", "robin", *ISLAND], (".gpkg", ".geojson")),
    "picture": (["tissot", "robin", *ISLAND, *SMALL], (".png", ".svg", ".pdf")),
    "heatmap": (["heatmap", "EPSG:3857", *ISLAND, "--resolution", "20000"], (".tif",)),
    "morph": (["morph", "robin", "moll", *ISLAND, "--frames", "3", *SMALL], (".gif",)),
    "convert": (["convert", "DATA.gpkg", "--to", "EPSG:3857"], (".gpkg", ".geojson", ".fgb", ".shp", ".parquet")),
    "equal-earth": (["convert", "DATA.gpkg", "--to", "+proj=eqearth"], (".gpkg", ".geojson", ".fgb", ".shp")),
    "warp": (["convert", "DATA.tif", "--to", "EPSG:3857"], (".tif",)),
    "check": (["check", "DATA.gpkg", "--crs", "EPSG:3857"], (".gpkg", ".geojson", ".html")),
}
CASES = [name + suffix for name, (_, suffixes) in COMMANDS.items() for suffix in suffixes]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Boxes, points in a table, and pixels, each in a file."""
    folder, rng = tmp_path_factory.mktemp("data"), np.random.default_rng(3)
    lon, lat = rng.uniform(0, 9, 200), rng.uniform(50, 56, 200)
    names, shapes = [f"number {k}" for k in range(200)], shapely.box(lon, lat, lon + 0.1, lat + 0.1)
    geopandas.GeoDataFrame({"name": names}, geometry=shapes, crs="EPSG:4326").to_file(folder / "data.gpkg")
    rows = "".join(f"{x:.6f},{y:.6f}\n" for x, y in zip(lon, lat, strict=True))
    (folder / "data.csv").write_text(f"lon,lat\n{rows}")
    shape = {"width": 90, "height": 60, "count": 1, "dtype": "float64", "crs": "EPSG:4326"}
    transform = rasterio.Affine(0.1, 0, 0, 0, -0.1, 56)
    with rasterio.open(folder / "data.tif", "w", driver="GTiff", transform=transform, **shape) as file:
        file.write(rng.normal(size=(1, 60, 90)))
    return folder


def files_in(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize("case", CASES)
def test_full_disk(case: str, data: Path, tmp_path: Path) -> None:
    """Where half the file has room, or all but the last byte, the old files stay."""
    name, suffix = Path(case).stem, Path(case).suffix
    words = [word.replace("DATA", str(data / "data")) for word in COMMANDS[name][0]]
    path = tmp_path / f"out{suffix}"
    assert run(*words, "-o", str(path)).exit_code == 0
    size = path.stat().st_size
    for file in tmp_path.iterdir():
        file.write_bytes(b"old")
    before = files_in(tmp_path)
    # SQLite goes without its spatial index where that alone has no room, and is whole.
    for room in [size // 2] if suffix == ".gpkg" else [size // 2, size - 1]:
        with room_for(room):
            result = run(*words, "-o", str(path), "--overwrite")
        assert (result.exit_code, result.stdout) == (2, ""), room
        assert re.fullmatch(r"projdist: Invalid output '.*'\. It cannot be written: .+\.\n", result.stderr), room
        assert files_in(tmp_path) == before


@pytest.mark.parametrize("case", [".jpg 8", ".png 8", ".png 16", ".tif 8", ".tif 16"])
def test_mosaics(case: str, tmp_path: Path) -> None:
    """Pillow tells nothing of the end of a JPEG, and libtiff much that is not Python's."""
    suffix, bits = case.split()
    kind = np.dtype(f"uint{bits}")
    pytest.importorskip("cv2")
    pixels = np.random.default_rng(1).integers(0, np.iinfo(kind).max, (80, 90, 4), dtype=kind)
    drawn = SimpleNamespace(pixels=pixels, bands=pixels)
    path = save_mosaic(drawn, tmp_path / f"out{suffix}")
    size = path.stat().st_size
    path.write_bytes(b"old")
    for room in (size // 2, size - 1):
        with room_for(room), pytest.raises(OSError, match="File too large"):
            save_mosaic(drawn, path)
        assert files_in(tmp_path) == {path.name: b"old"}


def test_clouds(tmp_path: Path) -> None:
    """Old files of a folder stay, too."""
    points = np.random.default_rng(2).normal(size=(30, 3))
    names = [str(tmp_path / name) for name in ("a.xyz", "b.xyz")]
    for name, turn in zip(names, (0.0, 0.1), strict=True):
        np.savetxt(name, points + turn * points[:, [1, 0, 2]])
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.xyz").write_bytes(b"old")
    with room_for(100):
        result = run("clouds", *names, "-o", str(tmp_path / "out"), "--overwrite")
    told = f"projdist: Invalid output '{tmp_path / 'out'}'. It cannot be written: File too large.\n"
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", told)
    assert files_in(tmp_path / "out") == {"a.xyz": b"old"}
