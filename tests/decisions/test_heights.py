"""Heights from tables and rasters."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tables import each

from projdist import read_heights

POINTS = np.array([[10.0, 50.0, 100.5], [11.0, 51.0, -3.0]])


@pytest.mark.parametrize("text", [
    "lon,lat,h\n10,50,100.5\n11,51,-3\n", "10,50,100.5\n11,51,-3\n", "10 50 100.5\n\n# a remark\n11 51 -3\n",
    "name;latitude;longitude;height\na;50;10;100.5\nb;51;11;-3\n", "\ufeffx\ty\tz\n10\t50\t100.5\n11\t51\t-3\n",
], ids=["header", "bare", "blanks", "semicolons", "tabs"])  # fmt: skip
def test_tables(tmp_path: Path, text: str) -> None:
    """Columns by any usual name, or in the usual order."""
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    assert_allclose(read_heights(path), POINTS)


@each(("text", "message"), [
    ("", "It is empty"), ("lon,lat,name\n1,2,a\n", "Its header must name columns lon, lat and h"),
    ("lon,lat,h\n1,2,a\n", "Line 2 must have a longitude, a latitude and a height"),
    ("lon,lat,h\n1,2\n", "Line 2 must have"), ("lon,lat,h\n", "There must be points"),
    ("lon,lat,h\n1,95,3\n", "There must be points, with longitudes and latitudes in degrees"),
])  # fmt: skip
def test_refused_tables(tmp_path: Path, text: str, message: str) -> None:
    """One line says what is wrong, and where."""
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_heights(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    """A file that is not there, or is no text, and a raster that is none, in one line."""
    pytest.importorskip("rasterio")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "bad.tif").write_text("no raster")
    messages = {"none.csv": "It cannot be read as text: No such file", "binary.csv": "cannot be read as text"}
    for name, message in (messages | {"bad.tif": "The raster cannot be read"}).items():
        with pytest.raises(ValueError, match=message):
            read_heights(tmp_path / name)


@each("crs", ["EPSG:4326", "EPSG:32632"])
def test_rasters(tmp_path: Path, crs: str) -> None:
    """Cells that have heights, at their centres, in degrees whatever the raster's CRS."""
    rasterio = pytest.importorskip("rasterio")
    size = 0.1 if crs == "EPSG:4326" else 1000.0
    corner = (9.0, 50.0) if crs == "EPSG:4326" else (500_000.0, 5_540_000.0)
    heights = np.array([[1.0, 2.0, 3.0], [4.0, -9999.0, 6.0]])
    transform = rasterio.Affine(size, 0.0, corner[0], 0.0, -size, corner[1])
    path = tmp_path / "dem.tif"
    options = {"driver": "GTiff", "width": 3, "height": 2, "count": 1, "dtype": "float64", "nodata": -9999.0}
    with rasterio.open(path, "w", crs=crs, transform=transform, **options) as raster:
        raster.write(heights, 1)
    found = read_heights(path)
    assert found[:, 2].tolist() == [1.0, 2.0, 3.0, 4.0, 6.0]
    if crs == "EPSG:4326":
        assert_allclose(found[0, :2], [9.05, 49.95], atol=1e-9)
    else:
        assert_allclose(found[0, :2], [9.007, 50.0], atol=0.02)


@each("axis", ["east", "north"])
def test_large_rasters_are_thinned(tmp_path: Path, axis: str) -> None:
    """Two hundred cells a side are taken, evenly up to the last ones, each with the height of its own place."""
    # On a slope a height is a place: that of the middle of a cell within half a step.
    rasterio = pytest.importorskip("rasterio")
    rows, columns, cell = 430, 1000, 0.001
    x, y = cell * (np.arange(columns) + 0.5), cell * (np.arange(rows) + 0.5)
    slope = np.broadcast_to(9.0 + x if axis == "east" else 50.0 - y[:, None], (rows, columns))
    path = tmp_path / "dem.tif"
    options = {"driver": "GTiff", "width": columns, "height": rows, "count": 1, "dtype": "float64", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", transform=rasterio.Affine(cell, 0.0, 9.0, 0.0, -cell, 50.0), **options) as raster:
        raster.write(slope, 1)
    lon, lat, heights = read_heights(path).T
    across, down = cell * columns / 200, cell * rows / 200
    assert heights.size == 200 * 200
    assert_allclose(heights, lon if axis == "east" else lat, rtol=0, atol=0.51 * (across if axis == "east" else down))
    assert_allclose([lon.min(), lon.max()], [9.0 + 0.5 * across, 9.0 + cell * columns - 0.5 * across])
    assert_allclose([lat.min(), lat.max()], [50.0 - cell * rows + 0.5 * down, 50.0 - 0.5 * down])


@each("kind", ["complex64", "complex_int16", "float32"])
def test_rasters_of_no_heights(tmp_path: Path, kind: str) -> None:
    """Complex numbers are no heights, and pixels without a transform have no place, whatever GDAL takes for it."""
    rasterio = pytest.importorskip("rasterio")
    path = tmp_path / "dem.tif"
    options = {"driver": "GTiff", "width": 3, "height": 2, "count": 1, "dtype": kind, "crs": "EPSG:4326"}
    is_complex = kind.startswith("complex")
    if is_complex:
        options["transform"] = rasterio.Affine(0.1, 0.0, 9.0, 0.0, -0.1, 50.0)
    with warnings.catch_warnings(action="ignore"), rasterio.open(path, "w", **options) as raster:
        raster.write(np.ones((1, 2, 3), dtype="complex64" if is_complex else kind))
    told = "Band 1 has complex numbers; they must be real." if is_complex else "It does not state where its pixels lie"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match=rf"^Invalid heights '.*'\. {told}"):
            read_heights(path)


def test_rasters_cut_short(tmp_path: Path) -> None:
    """One line says so, with GDAL's reason; rasterio's own says "Read failed. See previous exception for details."."""
    rasterio = pytest.importorskip("rasterio")
    gis = pytest.importorskip("projdist.gis")
    whole, cut = tmp_path / "whole.tif", tmp_path / "cut.tif"
    options = {"driver": "GTiff", "count": 1, "dtype": "float32", "crs": "EPSG:4326", "compress": "deflate"}
    grid = rasterio.Affine(0.1, 0.0, 0.0, 0.0, -0.1, 40.0)
    with rasterio.open(whole, "w", width=400, height=400, transform=grid, **options) as file:
        file.write(np.random.default_rng(1).random((1, 400, 400)).astype("float32"))
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    reason = r"cannot be read: it is damaged or cut short \(TIFF[^\n]* got \d+ bytes, expected \d+\)\.$"
    with pytest.raises(ValueError, match=reason):
        read_heights(cut)
    with pytest.raises(ValueError, match=reason):
        gis.weighted("box:0,0,40,40", cut)
