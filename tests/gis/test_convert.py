"""Data brought into CRSs that were made to measure, and back, against the projection itself."""

import functools
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import shapely
from gis_files import from_origin, write_layer, write_raster
from refusals import refuses
from tables import each

from projdist import Notice, Projection, check, design, estimate_crs, factors, gis, read_heights
from projdist.projections import crs_of, same_map

geopandas = pytest.importorskip("geopandas")
rasterio = pytest.importorskip("rasterio")

LON, LAT = np.array([6.1, 7.44, 9.5, 8.2]), np.array([46.2, 46.95, 46.8, 47.6])
METRES, DEGREES = 1e-8, 1e-8
# Factors are good to 1e-11; WKT 1 keeps the pipeline to the letter.
SCALES = 1e-11
DRAWN = [".gpkg", ".fgb", ".shp", ".geojson"]  # formats that GDAL writes


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a map of Switzerland made to measure."""
    path = tmp_path_factory.mktemp("made") / "map.wkt"
    path.write_text(design("country:CH", degree=3, base="EPSG:3035", against=()).wkt)
    return path


@pytest.fixture
def points(tmp_path: Path) -> Path:
    """Some Swiss points in longitude and latitude."""
    return write_layer(tmp_path / "points.geojson", shapely.points(LON, LAT), name=["a", "b", "c", "d"])


def coordinates(path: Path) -> np.ndarray:
    """Those of a file, in the order of the names."""
    frame = geopandas.read_parquet(path) if path.suffix == ".parquet" else geopandas.read_file(path)
    return shapely.get_coordinates(frame.sort_values("name").geometry.array)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [*DRAWN, ".parquet"])
def test_points_there_and_back(suffix: str, made: Path, points: Path, tmp_path: Path) -> None:
    """They are where the projection has them, in files of all formats, and come back; WKT 1 has WKT 2 beside it."""
    new, back = tmp_path / f"new{suffix}", tmp_path / "back.gpkg"
    found = gis.convert(points, made, new)
    projection = Projection.from_user_input(str(made))
    assert coordinates(new) == pytest.approx(np.column_stack(projection(LON, LAT)), abs=METRES)
    assert found.path == new
    if suffix == ".parquet":
        assert (found.wkt, found.note) == (None, "")
    else:
        note = f"Other programs than projdist do not understand this CRS in 'new{suffix}'. It is in 'new.wkt'."
        assert (found.wkt, found.note) == (tmp_path / "new.wkt", note)
        assert same_map(projection, found.wkt.read_text()) is not None
        assert estimate_crs(geopandas.read_file(new)).is_projected  # though it is of GDAL's WKT 1
    gis.convert(new, "EPSG:4326", back)
    assert coordinates(back) == pytest.approx(np.column_stack([LON, LAT]), abs=DEGREES)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", DRAWN)
def test_files_in_it_are_data_like_others(suffix: str, made: Path, points: Path, tmp_path: Path) -> None:
    """As GDAL's WKT 1 of the CRS is read as it was: by factors and check."""
    new = gis.convert(points, made, tmp_path / f"new{suffix}").path
    frame = geopandas.read_file(new).sort_values("name")
    there = factors(str(made), LON, LAT).h
    for found in (factors(str(made), frame), factors(frame.crs, LON, LAT)):
        np.testing.assert_allclose(found.h, there, rtol=0, atol=SCALES)
    discs = write_layer(tmp_path / "discs.geojson", shapely.buffer(shapely.points(LON, LAT), 0.01))
    drawn = gis.convert(discs, made, tmp_path / f"drawn{suffix}").path
    by_wkt2 = geopandas.read_file(drawn).set_crs(crs_of(made.read_text()), allow_override=True)
    found, wanted = (check(data, purpose=None).overall.area_error for data in (gis.read_data(drawn), by_wkt2))
    assert found == pytest.approx(wanted, abs=SCALES)


@pytest.mark.slow
def test_a_derived_crs(points: Path, tmp_path: Path) -> None:
    """The other form of WKT, which names the base, of which WKT 1 has nothing."""
    found = design("country:CH", degree=2, base="EPSG:3035", against=())
    gis.convert(points, found.crs.wkt_derived, tmp_path / "new.gpkg")
    assert coordinates(tmp_path / "new.gpkg") == pytest.approx(np.column_stack(found.projection(LON, LAT)), abs=METRES)


@pytest.mark.slow
def test_lines_are_divided_only_if_asked(made: Path, tmp_path: Path) -> None:
    """Vertices stay what they are; with a distance there are more, on the same line, none farther apart."""
    new = tmp_path / "new.gpkg"
    path = write_layer(tmp_path / "line.gpkg", [shapely.LineString([[6.0, 46.0], [10.0, 47.0]])], name=["a"])
    gis.convert(path, made, new)
    assert len(coordinates(new)) == 2
    gis.convert(path, made, new, densify=10.0)
    dense = coordinates(new)
    assert 30 < len(dense) < 60
    assert np.hypot(*np.diff(dense, axis=0).T).max() < 10_000.0
    share = np.linspace(0.0, 1.0, len(dense))
    expected = Projection.from_user_input(str(made))(6.0 + 4.0 * share, 46.0 + share)
    assert dense == pytest.approx(np.column_stack(expected), abs=1e-6)  # segments of a length, not shares, of the line


def test_distances_that_are_none(points: Path, tmp_path: Path) -> None:
    """Nor are millimetres of a degree's side, which are refused before they fill the memory."""
    new = tmp_path / "new.gpkg"
    for densify in (0.0, -1.0):
        refuses("It must be above 0, in kilometres", gis.convert, points, "EPSG:3035", new, densify=densify)
    path = write_layer(tmp_path / "box.gpkg", [shapely.box(0, 40, 1, 41)])
    said = r"^Invalid distance '1e-06'\. It makes 4\.44e\+08 pieces; at most 1e\+07 are"
    refuses(said, gis.convert, path, "EPSG:3035", new, densify=1e-6)


def test_registered_crss_need_nothing_beside(points: Path, tmp_path: Path) -> None:
    """LV95 of Bern's old observatory is 2600000, 1200000, to the metres of the datum shift."""
    found = gis.convert(points, "EPSG:2056", tmp_path / "new.shp")
    assert (found.wkt, found.note) == (None, "")
    assert not list(tmp_path.glob("*.wkt"))
    assert coordinates(found.path)[1] == pytest.approx([2600100.0, 1199880.0], abs=150.0)


@pytest.mark.slow
def test_what_lies_outside_is_left_out(tmp_path: Path) -> None:
    """A point behind the horizon has no geometry, and is told; where there is no other the CRS is refused."""
    path = write_layer(tmp_path / "points.gpkg", shapely.points([0.0, 170.0], 0.0), name=["a", "b"])
    text = "+proj=ortho +lat_0=0 +lon_0=0 +ellps=WGS84 +type=crs"
    for new in (tmp_path / "new.gpkg", tmp_path / "new.fgb"):
        with pytest.warns(UserWarning, match=r"^1 feature\(s\) cannot be drawn .* geometry: 2\.$"):
            gis.convert(path, text, new)
        assert geopandas.read_file(new).geometry.isna().tolist() == [False, True]
    far = text.replace("lon_0=0", "lon_0=85") + " +lat_ts=0"
    told = r"^1 of 2 feature\(s\) of the data look like degrees, as that at 170, 0, but CH1903"
    with pytest.warns(Notice, match=told), pytest.raises(ValueError, match="PROJ has no way"):
        gis.convert(path, far, tmp_path / "new.gpkg", source="EPSG:2056")


WAYS = [(None, "EPSG:3857"), (shapely.Polygon(), "+proj=eqearth")]
SLOW_WAYS = [pytest.param(WAYS[k][0], WAYS[1 - k][1], marks=pytest.mark.slow) for k in (0, 1)]


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "to"), [*WAYS, *SLOW_WAYS])
@each("suffix", [*DRAWN, ".parquet"])
def test_features_without_a_geometry(shape: Any, to: str, suffix: str, tmp_path: Path) -> None:
    """A layer that has nothing else keeps them, as GDAL and GEOS read it."""
    path, new = write_layer(tmp_path / "data.gpkg", [shape], name=["a"]), tmp_path / f"new{suffix}"
    gis.convert(path, to, new)
    found = geopandas.read_parquet(new) if suffix == ".parquet" else geopandas.read_file(new)
    assert found.name.tolist() == ["a"]
    assert (found.geometry.isna() | found.geometry.is_empty).all()


@pytest.mark.slow
def test_no_file_is_lost(made: Path, points: Path, tmp_path: Path) -> None:
    """Neither the data, nor a file with another CRS beside it, nor a part of a shapefile."""
    new, kept = tmp_path / "new.gpkg", tmp_path / "other.dbf"
    new.with_suffix(".wkt").write_text(crs_of("EPSG:2056").to_wkt())
    with pytest.raises(FileExistsError, match=r"new\.wkt"):
        gis.convert(points, made, new, overwrite=False)
    assert not new.exists()
    new.with_suffix(".wkt").unlink()
    gis.convert(points, made, new, overwrite=False)
    kept.write_text("mine")
    for crs, path, name in ((made, new, r"new\.gpkg"), ("EPSG:2056", kept.with_suffix(".shp"), r"other\.dbf")):
        with pytest.raises(FileExistsError, match=name):
            gis.convert(points, crs, path, overwrite=False)
    assert kept.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.gpkg", "new.wkt", "other.dbf", "points.geojson"]


WEST, NORTH, STEP = 5.8, 48.0, 0.02
# GDAL's warp has its transformation to an eighth of a pixel of what it reads: 0.02 degrees of the meridian, then
# 1000 m, which are 0.0133 degrees of the parallel of 47.6.
METRES_OF_PIXELS = 0.125 * 2230.0
DEGREES_OF_PIXELS = 0.125 * (0.02 + 0.0133)


@pytest.fixture
def degrees(tmp_path: Path) -> Path:
    """A raster whose two bands are the longitude and the latitude of its pixels' centres."""
    lon, lat = np.meshgrid(WEST + STEP * (np.arange(250) + 0.5), NORTH - STEP * (np.arange(120) + 0.5))
    path = write_raster(tmp_path / "degrees.tif", np.stack([lon, lat]), from_origin(WEST, NORTH, STEP, STEP))
    with rasterio.open(path, "r+") as image:
        image.descriptions = ("lon", "lat")
    return path


def inner_pixels(image: Any, width: float, height: float) -> list[np.ndarray]:
    """Longitude and latitude of pixels near the middle of Switzerland, and x and y of their centres."""
    lon, lat = image.read()
    rows, columns = np.nonzero((np.abs(lon - 8.3) < width) & (np.abs(lat - 46.8) < height))
    return [lon[rows, columns], lat[rows, columns], *(image.transform @ (columns + 0.5, rows + 0.5))]


@pytest.mark.slow
def test_rasters_there_and_back(made: Path, degrees: Path, tmp_path: Path) -> None:
    """Values of longitude and latitude are those of the projection's inverse, as good as GDAL's warp is."""
    new = tmp_path / "new.tif"
    found = gis.convert(degrees, made, new, resampling="bilinear", resolution=1000.0)
    assert found.note.startswith("'new.tif' keeps this CRS in 'new.tif.aux.xml' only. It is in 'new.wkt'")
    projection = Projection.from_user_input(str(made))
    with rasterio.Env(OSR_WKT_FORMAT="WKT2_2019"), rasterio.open(new) as image:
        assert image.descriptions == ("lon", "lat")
        assert same_map(projection, image.crs.to_wkt(version="WKT2_2019")) is not None  # by the file beside
        # A pixel or more within: at the edges there are no neighbours to interpolate.
        lon, lat, x, y = inner_pixels(image, 2.4, 1.1)
    assert len(lon) > 10_000
    assert np.stack(projection(lon, lat)) == pytest.approx(np.stack([x, y]), abs=METRES_OF_PIXELS)
    assert (tmp_path / "new.tif.aux.xml").exists()
    back = tmp_path / "back.tif"
    assert gis.convert(new, "EPSG:4326", back, resampling="bilinear", resolution=0.01).note == ""
    with rasterio.open(back) as image:
        assert image.crs == "EPSG:4326"
        lon, lat, x, y = inner_pixels(image, 2.3, 1.0)
    assert np.stack([lon, lat]) == pytest.approx(np.stack([x, y]), abs=DEGREES_OF_PIXELS)


def test_a_raster_in_a_registered_crs(degrees: Path, tmp_path: Path) -> None:
    """There is one file, and pixels of the size asked for."""
    found = gis.convert(degrees, "EPSG:2056", tmp_path / "new.tif", resolution=5000.0)
    with rasterio.open(found.path) as image:
        crs, sides = image.crs.to_epsg(), image.res
    assert (found.wkt, found.note, crs, sides) == (None, "", 2056, (5000.0, 5000.0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["degrees.tif", "new.tif"]


@pytest.mark.slow
def test_data_outside_an_area_of_use_are_told(degrees: Path, tmp_path: Path) -> None:
    """Features and rasters of which more than half lies there, whatever their CRS; a corner that stands out is none."""
    zone = gis.convert(degrees, "EPSG:32632", tmp_path / "zone.tif").path
    told = r"^NZGD2000 / .* is for box:166\.3\d,-47\.\d+,178\.\d+,-34\.1: {} lie mostly outside its area of use\.$"
    with pytest.warns(Notice, match=told.format(r"1 of 1 raster\(s\)")):
        gis.convert(zone, "EPSG:2193", tmp_path / "new.tif")
    boxes = [shapely.box(5, 46, 9, 47.5), shapely.box(4, 46, 10, 47.5), shapely.box(-10, 50, -9, 51), None]
    frame = geopandas.GeoDataFrame(geometry=boxes, crs="EPSG:4326").to_crs("EPSG:3035")
    frame.to_file(tmp_path / "boxes.gpkg")
    told = r"^CH1903\+ / LV95 is for box:.*: 1 of 3 feature\(s\) of the data lie mostly outside its area of use\.$"
    with pytest.warns(Notice, match=told):
        gis.convert(tmp_path / "boxes.gpkg", "EPSG:2056", tmp_path / "new.gpkg")
    gis.convert(tmp_path / "boxes.gpkg", "EPSG:4258", tmp_path / "degrees.gpkg")


@each("kind", ["complex64", "complex128", "complex_int16"])
def test_rasters_of_complex_numbers(kind: str, tmp_path: Path) -> None:
    """The nearest pixel is taken with both its parts."""
    numbers, new = np.arange(1, 13) - 1j * np.arange(1, 13), tmp_path / "new.tif"
    values = numbers.reshape(1, 3, 4).astype("complex64" if kind == "complex_int16" else kind)
    place = from_origin(WEST, NORTH, STEP, STEP)
    gis.convert(write_raster(tmp_path / "complex.tif", values, place, dtype=kind), "EPSG:3035", new)
    with rasterio.open(new) as image:
        assert image.dtypes == (kind,)
        found = image.read(1).ravel()
    assert set(found[found != 0]) <= set(numbers)
    assert np.unique(found).size > 6


def test_rasters_that_are_refused(made: Path, degrees: Path, tmp_path: Path) -> None:
    """GDAL would take rows and columns for degrees, a GeoTIFF has one type; too many pixels, and edges of them."""
    new, nowhere = tmp_path / "new.tif", tmp_path / "nowhere.tif"
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning):
        write_raster(nowhere, np.ones((1, 2, 2)), rasterio.Affine.identity())
    with warnings.catch_warnings(action="error"):
        refuses(r"^Invalid data '.*'\. It does not state where its pixels lie", gis.convert, nowhere, "EPSG:2056", new)
    bands = "".join(f'<VRTRasterBand dataType="{kind}" band="{k}"/>' for k, kind in ((1, "Byte"), (2, "Float32")))
    place = "<SRS>EPSG:4326</SRS><GeoTransform>6,.1,0,47,0,-.1</GeoTransform>"
    (tmp_path / "two.vrt").write_text(f'<VRTDataset rasterXSize="4" rasterYSize="3">{place}{bands}</VRTDataset>')
    said = r"Their bands must be of one type, not of float32 and uint8\.$"
    refuses(said, gis.convert, tmp_path / "two.vrt", "EPSG:2056", new)
    # Millimetres would take days and the whole disk.
    said = r"^Invalid resolution '0\.001'\. It makes \d\.\d+e\+\d\d pixels of 250 x 120; at most 1e\+09, or 100"
    refuses(said, gis.convert, degrees, "EPSG:2056", new, resolution=1e-3)
    refuses("Pixels have no edges", gis.convert, degrees, made, new, densify=1.0)
    assert not new.exists()


def test_what_is_refused(made: Path, points: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.gpkg"
    for words, complaint in (
        ((points, "EPSG:1", new), "Invalid CRS 'EPSG:1'"),
        ((points, tmp_path / "none.wkt", new), "It cannot be read as text"),
        ((points, made, tmp_path / "new.xyz"), "Its suffix must be one of"),
        ((tmp_path / "none.gpkg", made, new), "There is no file"),
        ((tmp_path / "none.tif", made, tmp_path / "new.tif"), "They cannot be read"),
    ):
        refuses(rf"^[^\n]*{complaint}[^\n]*$", gis.convert, *words)
    with pytest.warns(UserWarning, match="was not provided"):
        lost = write_layer(tmp_path / "lost.gpkg", [shapely.Point(1.0, 2.0)], None)
    refuses("They have no CRS", gis.convert, lost, made, new)


def test_tracks_keep_their_heights(tmp_path: Path) -> None:
    """Of GPX, where GDAL has them in another layer; x and y are pyproj's."""
    points = [(11.0, 47.0, 1000.0), (11.01, 47.01, 1100.0)]
    words = "".join(f'<trkpt lat="{lat}" lon="{lon}"><ele>{height}</ele></trkpt>' for lon, lat, height in points)
    text = f'<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>{words}</trkseg></trk></gpx>'
    (tmp_path / "track.gpx").write_text(text)
    gis.convert(f"{tmp_path / 'track.gpx'}#tracks", "EPSG:25832", tmp_path / "new.gpkg")
    (line,) = geopandas.read_file(tmp_path / "new.gpkg").geometry
    truth = pyproj.Transformer.from_crs(4326, 25832, always_xy=True).transform(*np.transpose(points))
    np.testing.assert_allclose(shapely.get_coordinates(line, include_z=True), np.transpose(truth), atol=1e-6)


def test_rasters_in_degrees_that_state_metres(tmp_path: Path) -> None:
    values, place = np.ones((1, 10, 20), dtype="uint8"), from_origin(10.0, 48.0, 0.1, 0.1)
    path = write_raster(tmp_path / "a.tif", values, place, "EPSG:25832")
    told = r"^1 of 1 raster\(s\) of '.*a\.tif' look like degrees, as that at 10, 47, but ETRS89"
    with (
        pytest.warns(Notice, match=told),
        pytest.warns(Notice, match=r"^ETRS89.*: 1 of 1 raster\(s\) lie mostly outside its area of use\.$"),
    ):
        gis.convert(path, "EPSG:3035", tmp_path / "b.tif")
    for read in (functools.partial(gis.weighted, "globe"), read_heights):
        with pytest.warns(Notice, match=told):
            read(path)
