"""Weights of rasters and of columns, against sums made by hand."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from typer.testing import CliRunner

from projdist import PointSet, factors, gis, summarize
from projdist.cli.app import app
from projdist.gis import weights


def from_origin(west: float, north: float, width: float, height: float) -> rasterio.Affine:
    return rasterio.Affine(width, 0.0, west, 0.0, -height, north)


def write(path: Path, values: np.ndarray, transform: rasterio.Affine, crs: str = "EPSG:4326") -> Path:
    bands, rows, columns = values.shape
    options = {"driver": "GTiff", "width": columns, "height": rows, "count": bands, "dtype": "float64", "nodata": -1}
    with rasterio.open(path, "w", crs=crs, transform=transform, **options) as image:
        image.write(values)
    return path


@pytest.fixture
def world(tmp_path: Path) -> Path:
    """A world of 10-degree cells: band 1 holds random counts with holes, band 2 ones."""
    counts = np.random.default_rng(1).uniform(0, 100, (18, 36))
    counts[3, 5:9] = -1
    return write(tmp_path / "pop.tif", np.stack([counts, np.ones((18, 36))]), from_origin(-180, 90, 10, 10))


def test_means_are_sums_over_cells(world: Path) -> None:
    """The squared error is the mean of ln^2 a + ln^2 b at the cells' middles, weighted by their values."""
    found = summarize("robin", gis.weighted("box:-60,-20,60,60", world))
    with rasterio.open(world) as image:
        counts = image.read(1)
    lon, lat = np.meshgrid(np.arange(-175, 180, 10.0), np.arange(85, -90, -10.0))
    inside = (np.abs(lon) < 60) & (lat > -20) & (lat < 60) & (counts >= 0)
    fisher = factors("robin", lon[inside], lat[inside]).fisher
    truth = np.sqrt(np.average(fisher**2, weights=counts[inside]))
    assert found.airy_kavrayskiy == pytest.approx(truth, rel=1e-9)


def test_bands_and_the_antimeridian(world: Path) -> None:
    """A box across the antimeridian has the cells of both sides; the second band counts each once."""
    points = gis.weighted("box:160,-30,-150,10", world, band=2)
    assert sorted({float(np.mod(lon, 360)) for lon in points.lon}) == [165.0, 175.0, 185.0, 195.0, 205.0]
    assert points.weight.sum() == 5 * 4
    assert points.name == "box:160,-30,-150,10 weighted by pop.tif"


def test_projected_rasters(tmp_path: Path) -> None:
    """Cells of a projected raster lie at the longitudes and latitudes of their middles, a turned one's too."""
    turned = from_origin(4e6, 3e6, 1e5, 1e5) @ rasterio.Affine.rotation(10.0)
    path = write(tmp_path / "x.tif", np.ones((1, 4, 5)), turned, "EPSG:3035")
    points = gis.weighted("globe", path)
    x, y = turned @ (0.5, 0.5)
    found = factors("EPSG:3035", points.lon, points.lat)
    assert points.lon.size == 20
    assert np.hypot(found.x - x, found.y - y).min() < 1e-3


def test_large_rasters_are_added_up(world: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of cells keep the sum, whatever the size of the strips that are read."""
    whole = gis.weighted("globe", world)
    monkeypatch.setattr(weights, "_MOST", 100)
    for at_once in (1, 300, 10**6):
        monkeypatch.setattr(weights, "_AT_ONCE", at_once)
        blocks = gis.weighted("globe", world)
        assert blocks.lon.size <= 100
        assert blocks.weight.sum() == pytest.approx(whole.weight.sum(), rel=1e-14)
        np.testing.assert_allclose(
            [blocks.weight @ blocks.lat, blocks.weight @ blocks.lon],
            [whole.weight @ whole.lat, whole.weight @ whole.lon],
            atol=15.0 * whole.weight.sum(),  # within a block of 3 x 3 cells
        )


@pytest.mark.parametrize(
    ("region", "path", "band", "message"),
    [
        ("box:0,0,1,1", "pop.tif", 1, "No cell with a value has its middle in box:0,0,1,1"),
        ("globe", "pop.tif", 3, "It has 2 band"),
        ("globe", "none.tif", 1, "It cannot be read"),
    ],
)
def test_what_cannot_be(world: Path, region: str, path: str, band: int, message: str) -> None:
    """A wrong file, band or region is one line."""
    with pytest.raises(ValueError, match=message):
        gis.weighted(region, world.parent / path, band=band)


def test_negative_counts_are_refused(tmp_path: Path) -> None:
    """A weight is not negative."""
    path = write(tmp_path / "x.tif", np.full((1, 2, 2), -5.0), from_origin(0, 10, 5, 5))
    with pytest.raises(ValueError, match=r"weight -5; it must be finite and not negative"):
        gis.weighted("globe", path)


def test_on_the_command_line(world: Path, tmp_path: Path) -> None:
    """A raster, one of its bands, and a column of points weight the means; anything else is one line."""
    (tmp_path / "a.csv").write_text("lon,lat,people\n0,0,1\n0,60,3\n")
    points = f"points:{tmp_path / 'a.csv'}"

    def run(*words: str) -> tuple[int, str, str]:
        result = CliRunner().invoke(app, ["compare", "merc", *words, "--format", "csv"])
        return result.exit_code, result.stdout, result.stderr

    code, out, err = run("-r", "box:-60,-20,60,60", "--weight", f"{world}#2")
    assert (code, err) == (0, "")
    code, out, err = run("-r", points, "--weight", "people")
    assert (code, err) == (0, "")
    figure = float(out.splitlines()[1].split(",")[4])
    assert figure == pytest.approx(np.sqrt(0.75 * 2 * np.log(2.0) ** 2), rel=1e-9)  # k = 2 at 60 N, three of four times
    for words, text in (
        (["-r", points, "--weight", "cows"], "It has no column 'cows' for weights; it has lon, lat, people."),
        (["-r", "globe", "--weight", "people"], "It must be a raster, or, of points:PATH, the name of a column."),
        (["-r", "globe", "--weight", f"{world}#x"], "Invalid band 'x'"),
    ):
        code, out, err = run(*words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert text in err


def test_weighted_regions_are_sets_of_points(world: Path) -> None:
    """So they can be measured, drawn and combined as these are."""
    assert isinstance(gis.weighted("country:FR", world, band=2), PointSet)
