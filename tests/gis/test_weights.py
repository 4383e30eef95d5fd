"""Weights of rasters and of columns, against sums made by hand."""

import functools
import math
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from commands import command
from gis_files import from_origin, write_raster
from refusals import refuses
from tables import each

from projdist import PointSet, factors, get_region, gis, summarize
from projdist.earth.ellipsoid import MEAN_EARTH_RADIUS as R
from projdist.gis import weights
from projdist.regions import Box, combine

rasterio = pytest.importorskip("rasterio")
write = functools.partial(write_raster, nodata=-1.0)


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


@each("kind", ["complex64", "complex128", "complex_int16"])
def test_complex_numbers(kind: str, tmp_path: Path) -> None:
    """A band of them is refused, whose imaginary part would be lost."""
    values = np.full((2, 18, 36), 3 + 4j, dtype="complex64" if kind == "complex_int16" else kind)
    path = write_raster(tmp_path / "complex.tif", values, from_origin(-180, 90, 10, 10), dtype=kind)
    said = r"^Invalid weights '.*'\. Band 2 has complex numbers; they must be real\.$"
    refuses(said, gis.weighted, "globe", path, band=2)


def test_bands_and_the_antimeridian(world: Path) -> None:
    """A box across the antimeridian has the cells of both sides; the second band counts each once."""
    points = gis.weighted("box:160,-30,-150,10", world, band=2)
    assert isinstance(points, PointSet)  # which can be measured, drawn and combined
    assert sorted({float(np.mod(lon, 360)) for lon in points.lon}) == [165.0, 175.0, 185.0, 195.0, 205.0]
    assert points.weight.sum() == 5 * 4
    assert points.name == "box:160,-30,-150,10 weighted by pop.tif"


def test_projected_rasters(tmp_path: Path) -> None:
    """Cells of a projected raster lie at the longitudes and latitudes of their middles, a turned one's too."""
    turned = from_origin(4e6, 3e6, 1e5, 1e5) @ rasterio.Affine.rotation(10.0)
    path = write(tmp_path / "x.tif", np.ones((1, 4, 5)), turned, "EPSG:3035")
    points = gis.weighted("globe", path)
    found = factors("EPSG:3035", points.lon, points.lat)
    x, y = turned @ (0.5, 0.5)
    assert (points.lon.size, np.hypot(found.x - x, found.y - y).min() < 1e-3) == (20, True)


@pytest.mark.slow
@each(("most", "side"), [(100, 3), (30, 5)])
@each("at_once", [1, 300, 10**6])
def test_large_rasters_are_added_up(world, monkeypatch, most, side, at_once) -> None:
    """Blocks of cells keep the sum and the centre, whatever the size of what is read, the narrower last ones, too."""
    whole = gis.weighted("globe", world)
    with monkeypatch.context() as patch:
        patch.setattr(weights, "_MOST", most)
        patch.setattr(weights, "_AT_ONCE", at_once)
        blocks = gis.weighted("globe", world)
    assert blocks.lon.size == math.ceil(36 / side) * math.ceil(18 / side)
    assert blocks.weight.sum() == pytest.approx(whole.weight.sum(), rel=1e-14)
    ours, truth = ([one.weight @ one.lat, one.weight @ one.lon] for one in (blocks, whole))
    np.testing.assert_allclose(ours, truth, atol=1e-10 * whole.weight.sum())


BOX, CAP = "box:-31.3,-17.2,44.9,61.7", "cap:170,55,2500"
TRIANGLE = shapely.Polygon([(-60.0, -30.0), (75.0, -10.0), (10.0, 70.0)])


def is_in(name: object, lon: np.ndarray, lat: np.ndarray) -> np.ndarray:
    """Whether places are in one of the three regions, each by a formula of its own."""
    if name == BOX:
        return (lon > -31.3) & (lon < 44.9) & (lat > -17.2) & (lat < 61.7)
    if name == CAP:
        middle = np.full(np.shape(lon), 170.0), np.full(np.shape(lon), 55.0)
        return np.asarray(pyproj.Geod(ellps="WGS84").inv(*middle, lon, lat)[2]) < 2500e3
    return shapely.contains_xy(TRIANGLE, lon, lat)


def fine_world(path: Path, rows: int) -> tuple[Path, np.ndarray, np.ndarray, np.ndarray]:
    """A raster whose cells hold their share of a density that is known in closed form, and the middles of its cells."""
    lon, lat = np.meshgrid(*((np.arange(n) + 0.5) * 180.0 / rows for n in (2 * rows, rows)))
    lon, lat = lon - 180.0, 90.0 - lat
    half = math.radians(90.0 / rows)
    # The integral of 1 + sin(3 lon) over the cell's surface on the unit sphere.
    along = 2 * half + 2 / 3 * np.sin(3 * np.radians(lon)) * math.sin(3 * half)
    values = along * 2 * np.cos(np.radians(lat)) * math.sin(half)
    return write(path, values[None], from_origin(-180, 90, 180 / rows, 180 / rows)), lon, lat, values


def check_cells(region: object, path: Path, lon: np.ndarray, lat: np.ndarray, values: np.ndarray) -> PointSet:
    """The sum is that of the cells in the region to the last digits, and means within the errors that are printed."""
    points = gis.weighted(get_region(region), path)
    inside = is_in(region, lon, lat)
    assert points.weight.sum() == pytest.approx(values[inside].sum(), rel=1e-12)
    found = summarize(f"+proj=eqc +R={R}", points, measures=["k"])
    # Plate carree: h = 1 and k = 1 / cos(latitude).
    k = 1 / np.cos(np.radians(lat[inside]))
    level = math.sqrt(np.average(np.log(k) ** 2, weights=values[inside]))
    assert abs(found.airy_kavrayskiy - level) <= found.error_estimate
    assert abs(found.measures["k"].mean - np.average(k, weights=values[inside])) <= found.measures["k"].mean_error
    assert found.error_estimate < (1e-8 if points.coarse is None else 2e-2)
    return points


@pytest.mark.parametrize("region", [BOX, pytest.param(CAP, marks=pytest.mark.slow), TRIANGLE])
@pytest.mark.parametrize("most", [10**6, 1000, 300])
def test_cells_of_a_region_in_blocks(tmp_path, monkeypatch, region, most) -> None:
    """Cells outside the region never count, whether cells are added up or not, and whatever is read in one go."""
    path, lon, lat, values = fine_world(tmp_path / "x.tif", 90)
    monkeypatch.setattr(weights, "_MOST", most)
    for at_once in (4_000_000, 3000):
        monkeypatch.setattr(weights, "_AT_ONCE", at_once)
        points = check_cells(region, path, lon, lat, values)
        assert points.coarse is None or most < 10**6
        assert points.lon.size <= 1.1 * most


def test_whole_cells_against_the_integral(tmp_path: Path) -> None:
    """Over a box of whole cells the sum is the integral of the density, in closed form."""
    path, *_ = fine_world(tmp_path / "x.tif", 180)
    found = gis.weighted("box:-30,-20,60,50", path).weight.sum()
    west, south, east, north = np.radians([-30, -20, 60, 50])
    along = east - west - (math.cos(3 * east) - math.cos(3 * west)) / 3
    assert found == pytest.approx(along * (math.sin(north) - math.sin(south)), rel=1e-12)


@pytest.mark.parametrize(("operator", "left"), [("&", [True, True, False, False]), ("-", [False, False, True, True])])
def test_combinations_keep_what_points_stand_for(operator: str, left: list[bool]) -> None:
    """The fewer points are chosen as the many are, and the error still has what it costs to add up."""
    lon, lat = np.array([5.0, 15.0, 25.0, 35.0]), np.array([50.0, 10.0, 20.0, 60.0])
    coarse = PointSet(np.array([10.0, 30.0]), np.array([30.0, 40.0]), np.array([3.0, 7.0]))
    points = PointSet(lon, lat, np.array([1.0, 2.0, 3.0, 4.0]), coarse=coarse)
    found = combine(operator, points, Box(0, 0, 20, 70), "some")
    assert found.lon.tolist() == lon[left].tolist()
    kept = ([10.0], [3.0]) if left[0] else ([30.0], [7.0])
    assert (found.coarse.lon.tolist(), found.coarse.weight.tolist()) == kept
    few, many = (summarize("merc", one) for one in (found.coarse, PointSet(found.lon, found.lat, found.weight)))
    cost = summarize("merc", found).error_estimate
    assert cost >= abs(many.airy_kavrayskiy - few.airy_kavrayskiy) > 1e-3
    alone = combine("&", points, Box(0, 40, 8, 70), "one").coarse  # where the fewer have none
    assert (alone.lon.tolist(), alone.weight.tolist()) == ([5.0], [1.0])


@pytest.mark.slow
@pytest.mark.parametrize("region", [BOX, TRIANGLE])
def test_more_than_a_million_cells(tmp_path: Path, region: object) -> None:
    """So it is for a raster that is too large for points, as it comes."""
    path, lon, lat, values = fine_world(tmp_path / "x.tif", 4000)
    points = check_cells(region, path, lon, lat, values)
    assert points.coarse is not None
    assert points.lon.size < 1_000_000


@pytest.mark.parametrize("most", [10**6, 500])
def test_projected_rasters_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    """A polar raster with the pole in it, over a box and a polar cap: the cells by PROJ's own inverse."""
    monkeypatch.setattr(weights, "_MOST", most)
    values = np.random.default_rng(4).uniform(0, 9, (1, 160, 160))
    path = write(tmp_path / "x.tif", values, from_origin(-4e6, 4e6, 5e4, 5e4), "EPSG:3995")
    x, y = np.meshgrid(-4e6 + 5e4 * (np.arange(160) + 0.5), 4e6 - 5e4 * (np.arange(160) + 0.5))
    lon, lat = pyproj.Transformer.from_crs("EPSG:3995", "EPSG:4326", always_xy=True).transform(x, y)
    *_, distance = pyproj.Geod(ellps="WGS84").inv(0.0 * lon, 0.0 * lon + 90.0, lon, lat)
    for text, inside in (
        ("box:100,62.5,-150,88.2", (np.mod(lon, 360) > 100) & (np.mod(lon, 360) < 210) & (lat > 62.5) & (lat < 88.2)),
        ("cap:0,90,1500", distance < 1.5e6),
    ):
        assert gis.weighted(text, path).weight.sum() == pytest.approx(values[0][inside].sum(), rel=1e-12)


@pytest.mark.slow
def test_rows_from_south_to_north(world: Path, tmp_path: Path) -> None:
    with rasterio.open(world) as image:
        path = write(tmp_path / "up.tif", image.read()[:, ::-1], rasterio.Affine(10, 0, -180, 0, 10, -90))
    for region in ("box:-60,-20,60,60", "box:160,-30,-150,10", "cap:20,50,3000"):
        up, down = gis.weighted(region, path), gis.weighted(region, world)
        order, other = np.lexsort((up.lon, up.lat)), np.lexsort((down.lon, down.lat))
        for name in ("lon", "lat", "weight"):
            np.testing.assert_array_equal(getattr(up, name)[order], getattr(down, name)[other])


def test_small_rasters(tmp_path: Path) -> None:
    """Scale and offset apply, and what has no value has none still; a cell across the antimeridian counts once."""
    path = write(tmp_path / "x.tif", np.array([[[1.0, 2.0], [-1.0, 4.0]]]), from_origin(0, 20, 10, 10))
    with rasterio.open(path, "r+") as image:
        image.scales, image.offsets = (0.5,), (3.0,)
    assert sorted(gis.weighted("globe", path).weight.tolist()) == [3.5, 4.0, 5.0]
    # A raster that begins a little west of -180, as the well-known ones do.
    path = write(tmp_path / "x.tif", np.ones((1, 18, 36)), from_origin(-180.01, 90.01, 10, 10))
    assert gis.weighted("globe", path).weight.sum() == 18 * 36
    assert gis.weighted("box:170,-90,-170,90", path).weight.sum() == 18 * 2


def test_what_cannot_be(world: Path) -> None:
    """A wrong file, band, region or weight is one line; so are points, which have weights of their own."""
    write(world.with_name("negative.tif"), np.full((1, 2, 2), -5.0), from_origin(0, 20, 10, 10))
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning):
        write(world.with_name("nowhere.tif"), np.ones((1, 18, 36)), rasterio.Affine.identity())
    points = PointSet(np.zeros(1), np.zeros(1), np.ones(1))
    elsewhere = r"It lies elsewhere than box:30,35,50,70: within longitudes 0 and 20, latitudes 0 and 20\.$"
    for region, path, band, message in (
        ("box:0,0,1,1", "pop.tif", 1, "No cell with a value has its middle in box:0,0,1,1"),
        ("box:30,35,50,70", "negative.tif", 1, elsewhere),
        ("globe", "pop.tif", 3, "It has 2 band"),
        ("globe", "none.tif", 1, "It cannot be read"),
        ("globe", "negative.tif", 1, "weight -5; it must be finite and not negative"),
        # rasterio's own warning is not passed on.
        ("globe", "nowhere.tif", 1, r"^Invalid weights '.*'\. It does not state where its pixels lie: it has no"),
        (points, "pop.tif", 1, r"A raster weighs the area of a region, and points has points\.$"),
    ):
        refuses(message, gis.weighted, region, world.with_name(path), band=band)


def test_on_the_command_line(world: Path, tmp_path: Path) -> None:
    """A raster, one of its bands, and a column of points weight the means; anything else is one line."""
    (tmp_path / "a.csv").write_text("lon,lat,people\n0,0,1\n0,60,3\n")
    points = f"points:{tmp_path / 'a.csv'}"
    _, run_ok, _, refusal = command("compare")
    run_ok("merc", "-r", "box:-60,-20,60,60", "--weight", f"{world}#2", "--format", "csv")
    out = run_ok("merc", "-r", points, "--weight", "people", "--format", "csv")
    figure = float(out.splitlines()[1].split(",")[4])
    assert figure == pytest.approx(np.sqrt(0.75 * 2 * np.log(2.0) ** 2), rel=1e-9)  # k = 2 at 60 N, three of four times
    for words, text in (
        (["-r", points, "--weight", "cows"], "It has no column 'cows' for weights; it has lon, lat, people."),
        (["-r", "globe", "--weight", "people"], "It must be a raster, or, of points:PATH, the name of a column."),
        (["-r", "globe", "--weight", f"{world}#x"], "Invalid band 'x'"),
    ):
        assert text in refusal("merc", *words, "--format", "csv")
