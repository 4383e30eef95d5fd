"""World files and GeoTIFFs of map sheets, and where their mosaics lie."""

import numpy as np
import pytest
from mosaic_pictures import HEIGHT, WIDTH, maps, save
from mosaic_sets import common_points, moved
from refusals import refuses

from projdist.applications import mosaics
from projdist.gis import georeference_of, save_geotiff

rasterio = pytest.importorskip("rasterio")

SIZES = np.array([[float(WIDTH), float(HEIGHT)]] * 6)
# Five metres a pixel, north up, in Swiss coordinates.
PLANE = np.array([[5.0, 0.0, 600000.0], [0.0, -5.0, 200000.0], [0.0, 0.0, 1.0]])
MICROMETRE = 1e-6


@pytest.fixture(scope="module")
def H():
    return maps(np.random.default_rng(3))


@pytest.fixture(scope="module")
def found(H):
    return mosaics.mosaic(common_points(H, SIZES))


def test_the_mean_of_sheets(H, found):
    """Sheets with true georeferences give the mosaic the true one, whatever its frame."""
    canvas = found.canvas()
    place = mosaics.mean_georeference(canvas, SIZES, [mosaics.Georeference(PLANE @ one, "") for one in H])
    truth = PLANE @ H[0] @ np.linalg.inv(canvas.matrices[0])
    corners = np.array([[0.0, 0.0], [canvas.width, canvas.height]])
    assert np.abs(moved(place.matrix, corners) - moved(truth, corners)).max() < MICROMETRE
    assert (place.rms < MICROMETRE, place.sheets) == (True, 6)
    # The same sheet twice, once shifted by 10 m, meets itself in the middle: either is 5 m off.
    shift = np.array([[1.0, 0.0, 8.0], [0.0, 1.0, 6.0], [0.0, 0.0, 1.0]])
    twice = canvas._replace(matrices=canvas.matrices[[0, 0]])
    sheets = [mosaics.Georeference(PLANE @ H[0], ""), mosaics.Georeference(shift @ PLANE @ H[0], "")]
    place = mosaics.mean_georeference(twice, SIZES[:2], sheets)
    assert place.rms == pytest.approx(5.0, abs=MICROMETRE)
    apart = moved(place.matrix @ canvas.matrices[0], SIZES[:1]) - moved(PLANE @ H[0], SIZES[:1])
    assert apart == pytest.approx(np.array([[4.0, 3.0]]), abs=MICROMETRE)
    # Sheets without a georeference do not matter; without any there is none; two CRSs are refused.
    one = mosaics.mean_georeference(canvas, SIZES, [None, mosaics.Georeference(PLANE @ H[1], "X"), *[None] * 4])
    assert (one.sheets, one.crs) == (1, "X")
    assert one.rms < MICROMETRE
    assert mosaics.mean_georeference(canvas, SIZES, [None] * 6) is None
    two = [mosaics.Georeference(PLANE, "X"), mosaics.Georeference(PLANE, "Y"), *[None] * 4]
    told = r"^Invalid georeferences. The sheets are in different CRSs.$"
    refuses(told, mosaics.mean_georeference, canvas, SIZES, two)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".jpg"])
def test_world_files_are_gdals(tmp_path, suffix):
    """GDAL reads what is written, and what GDAL reads is read."""
    path = save(tmp_path, [np.zeros((9, 12, 3), np.uint8)], suffix)[0]
    matrix = np.array([[5.0, 0.3, 600000.0], [0.2, -5.0, 200000.0], [0.0, 0.0, 1.0]])
    assert mosaics.read_world_file(path) is georeference_of(path) is None
    mosaics.write_world_file(mosaics.world_file(path), matrix)
    with rasterio.open(path) as image:
        assert np.array(image.transform).reshape(3, 3) == pytest.approx(matrix, abs=MICROMETRE)
    for read in (mosaics.read_world_file, georeference_of):
        assert read(path).matrix == pytest.approx(matrix, abs=MICROMETRE)
    for text in ("5 0 0 -5 1", "5 0 0 -5 1 x", "0 0 0 0 1 1", "nan 0 0 1 1 1"):
        mosaics.world_file(path).write_text(text)
        refuses(rf"^Invalid world file '{mosaics.world_file(path)}'. It", mosaics.read_world_file, path)
    # The first and last letter of the suffix, and w.
    names = {".png": "a.pgw", ".jpg": "a.jgw", ".jpeg": "a.jgw", ".tif": "a.tfw", "": "a.wld"}
    assert {suffix: mosaics.world_file(f"a{suffix}").name for suffix in names} == names


@pytest.mark.parametrize("is_grey", [False, True])
def test_geotiff(tmp_path, H, found, is_grey):
    """A GeoTIFF has the pixels, the place and the CRS of its sheets."""
    crs = rasterio.CRS.from_epsg(2056).to_wkt()
    pixels = np.random.default_rng(1).integers(0, 255, (30, 40, 4), np.uint8)
    drawn = mosaics.Rendered(pixels, found.canvas(), is_grey)
    place = mosaics.mean_georeference(drawn.canvas, SIZES, [mosaics.Georeference(PLANE @ one, crs) for one in H])
    save_geotiff(drawn.bands, tmp_path / "m.tif", place)
    with rasterio.open(tmp_path / "m.tif") as image:
        assert (np.moveaxis(image.read(), 0, 2) == drawn.bands).all()
        assert image.crs.to_epsg() == 2056
        assert np.array(image.transform).reshape(3, 3) == pytest.approx(place.matrix, abs=MICROMETRE)
        assert image.colorinterp[-1] == rasterio.enums.ColorInterp.alpha
    assert georeference_of(tmp_path / "m.tif").matrix == pytest.approx(place.matrix, abs=MICROMETRE)
