"""Rasters, layers and tables for GIS programs, read back by rasterio and pyogrio and held against `factors`."""

import errno
import json
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path

import geopandas
import numpy as np
import pandas as pd
import pyogrio
import pyproj
import pytest
import rasterio
import shapely

from projdist import Projection, ProjectionError, factors, gis, projection_names
from projdist.gis.grids import pixels
from projdist.projections import plane_of, same_map

SAME = 1e-9
RASTERS = {
    "mollweide": {"region": "box:-180,0,20,90", "size": 60},
    "+proj=igh +ellps=WGS84": {"region": "box:-60,-20,60,20", "size": 80},
    "+proj=utm +zone=32 +ellps=intl +units=us-ft": {"region": "box:6,40,12,50", "size": 30},
    "EPSG:3857": {"size": 40},
    "EPSG:2263": {"resolution": 10_000.0},  # feet
    "EPSG:5513": {"size": (40, 20)},  # south and west
    "EPSG:2053": {"size": 30},  # west and south
    "EPSG:31467": {"size": 30},  # north before east
    "EPSG:3031": {"size": 40},  # polar
    "EPSG:27572": {"size": 30},  # Paris, grads
    "EPSG:3832": {"region": "box:170,-30,-170,10", "size": 30},  # across the antimeridian
    "IAU_2015:30120": {"size": 30},  # the Moon
}
LONLAT = {
    "+proj=pipeline +step +proj=moll": {"size": 60},
    "EPSG:3832": {"region": "box:170,-30,-170,10", "resolution": 1.0, "grid": "lonlat"},
    "EPSG:27572": {"size": 30, "grid": "lonlat"},
    "+proj=moll +R=1737400": {"size": 30, "grid": "lonlat"},
    "EPSG:3035": {"region": "cap:10,50,300", "size": 30, "grid": "lonlat"},
}


def some_slow(names: Iterable[str], slow: set[str]) -> list[object]:
    """Parameters, some of which only the slow tests take."""
    return [pytest.param(name, marks=pytest.mark.slow) if name in slow else name for name in names]


def centres(image: rasterio.DatasetReader) -> tuple[np.ndarray, np.ndarray]:
    """x, y of the centres of all pixels."""
    rows, columns = np.mgrid[: image.height, : image.width]
    x, y = rasterio.transform.xy(image.transform, rows.ravel(), columns.ravel())
    return np.reshape(x, rows.shape), np.reshape(y, rows.shape)


def greenwich_degrees(crs: pyproj.CRS, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Longitude and latitude from pyproj alone."""
    geodetic = crs.geodetic_crs
    lon, lat = pyproj.Transformer.from_crs(crs, geodetic, always_xy=True).transform(x, y)
    unit = np.degrees(geodetic.axis_info[0].unit_conversion_factor)
    meridian = geodetic.prime_meridian
    offset = np.degrees(meridian.longitude * meridian.unit_conversion_factor)
    return lon * unit + offset, lat * unit


@pytest.mark.parametrize("projection", some_slow(RASTERS, {"EPSG:3857", "EPSG:2053", "EPSG:31467", "IAU_2015:30120"}))
def test_rasters_on_the_plane(projection: str, tmp_path: Path) -> None:
    """Every pixel has the measures of its centre, whose longitude and latitude pyproj finds; the CRS is the map's."""
    names = ["omega", "scale_error_ppm"]
    found = gis.raster(projection, names, **RASTERS[projection])
    path = gis.save_raster(found, tmp_path / "x.tif")
    map_ = Projection.from_user_input(projection)
    with rasterio.open(path) as image:
        assert (image.descriptions, image.units) == (("omega", "scale_error_ppm"), ("deg", "ppm"))
        assert np.isnan(image.nodata)
        assert image.dtypes == ("float64", "float64")
        assert same_map(map_, image.crs.to_wkt()) is not None
        values, (x, y), crs = image.read(), centres(image), pyproj.CRS(image.crs.to_wkt())
    assert found.note == ""
    inside = np.isfinite(values[0])
    assert inside.mean() > 0.4
    lon, lat = greenwich_degrees(crs, x[inside], y[inside])
    truth = factors(map_, lon, lat, measures=names)
    for band, name in zip(values, names, strict=True):
        np.testing.assert_allclose(
            band[inside], truth.extra[name], rtol=SAME, atol=SAME * (1e6 if "ppm" in name else 1)
        )
    back = np.array(
        pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(
            *pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True).transform(x[inside], y[inside])
        )
    )
    np.testing.assert_allclose(back, [x[inside], y[inside]], atol=1e-6 * map_.ellipsoid.a)


@pytest.mark.slow
def test_pixels_outside_the_map_are_not_a_number() -> None:
    """Mollweide's ellipse, exactly: PROJ's inverse answers outside, too, but not with the same point."""
    found = gis.raster("mollweide", size=51)
    x, y = found.pixels.centres(0, found.pixels.rows)
    R = 6371008.7714
    ellipse = (x / (2 * np.sqrt(2) * R)) ** 2 + (y / (np.sqrt(2) * R)) ** 2
    assert (np.isfinite(found.values[0]) == (ellipse < 1)).all()


def test_pixels_outside_the_region_are_not_a_number() -> None:
    """A cap on its azimuthal map is a disc of its radius."""
    found = gis.raster("+proj=aeqd +lon_0=10 +lat_0=50 +R=6371008.7714", region="cap:10,50,500", size=80)
    x, y = found.pixels.centres(0, found.pixels.rows)
    assert (np.isfinite(found.values[0]) == (np.hypot(x, y) < 500e3)).all()
    assert found.pixels.width * 80 == pytest.approx(1e6, rel=1e-3)


@pytest.mark.parametrize("projection", LONLAT)
def test_rasters_on_longitude_and_latitude(projection: str, tmp_path: Path) -> None:
    """Pixels are even in the map's own longitudes and latitudes, across the antimeridian beyond 180 degrees."""
    path = gis.save_raster(gis.raster(projection, ["k", "h"], **LONLAT[projection]), tmp_path / "x.tif")
    with rasterio.open(path) as image:
        values, (x, y), crs = image.read(), centres(image), pyproj.CRS(image.crs.to_wkt())
        bounds = image.bounds
    assert crs.is_geographic
    assert crs.ellipsoid.semi_major_metre == pytest.approx(
        6378137.0
        if projection == "+proj=pipeline +step +proj=moll"
        else Projection.from_user_input(projection).ellipsoid.a
    )
    unit, meridian = np.degrees(crs.axis_info[0].unit_conversion_factor), crs.prime_meridian
    lon = x * unit + np.degrees(meridian.longitude * meridian.unit_conversion_factor)
    truth = factors(projection, lon, y * unit)
    inside = np.isfinite(values[0])
    assert inside.mean() > 0.7
    np.testing.assert_allclose(values[0][inside], truth.k[inside], rtol=SAME)
    np.testing.assert_allclose(values[1][inside], truth.h[inside], rtol=SAME)
    if projection == "EPSG:3832":
        assert tuple(bounds) == (170.0, -30.0, 190.0, 10.0)


@pytest.mark.parametrize(
    ("projection", "note"),
    [
        ("+proj=pipeline +step +proj=moll", "Mollweide has no CRS; the raster is in longitude and latitude."),
        (lambda lon, lat: (1e5 * lon, 1e5 * lat), "<lambda> has no CRS; the raster is in longitude and latitude."),
        ("airy", "Airy has no inverse in PROJ; the raster is in longitude and latitude."),
        pytest.param(
            "krovak",
            "PROJ's inverse of Krovak leads to other points; the raster is in longitude and latitude.",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_maps_that_fall_back(projection: object, note: str) -> None:
    """A map without a CRS or an inverse is laid on longitude and latitude, and the note says why."""
    found = gis.raster(projection, size=8)
    assert found.note == note
    assert pyproj.CRS(found.wkt).to_epsg() == 4326
    assert found.pixels.transform == (45.0, 0.0, -180.0, 0.0, -45.0, 90.0)


def test_a_crs_that_a_geotiff_has_no_room_for(tmp_path: Path) -> None:
    """It comes in the file beside, which obeys the same rules; where the GeoTIFF has room, an old one goes."""
    path, beside = tmp_path / "x.tif", tmp_path / "x.tif.aux.xml"
    hatano = gis.raster("hatano", region="box:0,0,40,40", size=8)
    assert hatano.note == f"A GeoTIFF has no room for the CRS of {hatano.projection.name}; it is in the .aux.xml file."
    gis.save_raster(hatano, path)
    with rasterio.open(path) as image:
        assert same_map(hatano.projection, image.crs.to_wkt()) is not None
    path.unlink()
    with pytest.raises(FileExistsError, match=r"aux\.xml'. It exists"):
        gis.save_raster(hatano, path, overwrite=False)
    equal_earth = gis.raster("equal-earth", region="box:0,0,40,40", size=8)
    gis.save_raster(equal_earth, path)
    assert list(tmp_path.iterdir()) == [path]
    assert not beside.exists()
    with rasterio.open(path) as image:
        assert same_map(equal_earth.projection, image.crs.to_wkt()) is not None


def test_pixels() -> None:
    """Square ones along the longer side, columns and rows, or edges on the multiples of a resolution."""
    extent = (-10.0, 2.0, 30.0, 12.0)
    assert pixels(extent, 1, 4, None).transform == (10.0, 0.0, -10.0, 0.0, -10.0, 12.0)
    assert pixels(extent, 1, (8, 1), None).transform == (5.0, 0.0, -10.0, 0.0, -10.0, 12.0)
    found = pixels(extent, 1, None, 3.0)
    assert (found.left, found.top, found.columns, found.rows) == (-12.0, 12.0, 14, 4)
    assert (pixels((-180.0, -90.0, 180.0, 90.0), 1, None, 0.1).columns) == 3600


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0}, "Invalid size '0'. It must be a positive number of pixels."),
        ({"size": (100_000, 100_000)}, "Invalid size '100000,100000'. It makes 1e+10 values; there must be 1 to 1e+08"),
        ({"resolution": -1.0}, "Invalid resolution '-1.0'. It must be a positive number"),
        ({"resolution": 1.0, "size": 3}, "Invalid size '3' with resolution '1'. It must be one of the two."),
        ({"resolution": 1e-3}, "Invalid resolution '0.001'. It makes"),
        ({"grid": "plane"}, "Invalid grid 'plane'. It must be map or lonlat."),
        ({"measures": ["foo"]}, "Invalid measure 'foo'."),
        ({"region": "box:1"}, "Invalid region 'box:1'."),
    ],
)
def test_rasters_that_are_refused(options: dict[str, object], message: str) -> None:
    """One line each."""
    with pytest.raises(ValueError, match=re.escape(message)):
        gis.raster("eqc", **{"region": "box:0,0,40,40"} | options)


def test_a_region_outside_the_map() -> None:
    """Nothing to lay pixels on."""
    with pytest.raises(ValueError, match=r"Invalid region for 'Orthographic'\. No part of it can be projected\."):
        gis.raster("+proj=ortho +lat_0=90 +R=6371000", region="box:0,-40,40,-10")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in projection_names() if "-" not in name])
def test_every_name_as_a_raster_and_a_layer(name: str, tmp_path: Path) -> None:
    """What PROJ has a CRS for comes back from GeoTIFF, GeoPackage and GeoJSON as the same map."""
    try:
        projection = Projection.from_user_input(name)
    except ProjectionError:
        pytest.skip("needs parameters")
    found = gis.raster(projection, size=24)
    with rasterio.open(gis.save_raster(found, tmp_path / "x.tif")) as image:
        assert np.isfinite(image.read()).any()
        on_plane = not pyproj.CRS(image.crs.to_wkt()).is_geographic
        assert on_plane == ("longitude and latitude" not in found.note)
        if on_plane:
            assert same_map(projection, image.crs.to_wkt()) is not None
    layer = gis.indicatrices(projection, step=30)
    for suffix in gis.LAYER_SUFFIXES:
        read = geopandas.read_file(gis.save_layer(layer, tmp_path / f"e{suffix}"))
        if layer.crs is not None:
            assert same_map(projection, read.crs.to_wkt()) is not None


# ---- indicatrices ---------------------------------------------------------------------------

LAYERS = {
    "mollweide": {"region": "box:-180,0,20,90"},
    "EPSG:2263": {"step": 0.5},
    "EPSG:5513": {"step": 1},
    "ESRI:54009": {"region": "cap:0,40,3000"},
    "equal-earth": {"region": "box:0,0,60,60", "step": 15},  # of which WKT 1 knows nothing
    "EPSG:3832": {"region": "box:170,-30,-170,10", "step": 10},
}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
@pytest.mark.parametrize("projection", some_slow(LAYERS, {"ESRI:54009", "EPSG:5513"}))
def test_indicatrices(projection: str, suffix: str, tmp_path: Path) -> None:
    """Ellipses in the map's CRS and its unit, about the points, of the area and the axes that `factors` says."""
    path = gis.save_layer(gis.indicatrices(projection, **LAYERS[projection]), tmp_path / f"e{suffix}")
    read = geopandas.read_file(path)
    map_ = Projection.from_user_input(projection)
    assert pyogrio.list_layers(path)[0, 0] == "e"
    assert same_map(map_, read.crs.to_wkt()) is not None
    names = ["lon", "lat", "x", "y", "a", "b", "h", "k", "s", "omega", "azimuth", "radius"]
    assert list(read.columns) == [*names, "geometry"]
    truth = factors(map_, read.lon, read.lat)
    for name in names[2:10]:
        np.testing.assert_allclose(read[name], getattr(truth, name), rtol=1e-12, atol=1e-6)
    unit = read.crs.axis_info[0].unit_conversion_factor
    # A polygon of 72 vertices in an ellipse has 36 sin(5 degrees) / pi of its area.
    area = 36 * np.sin(np.radians(5)) * read.s * read.radius**2 / unit**2
    np.testing.assert_allclose(read.geometry.area, area, rtol=1e-9)
    # The centre, by pyproj; the antimeridian is of no concern to it.
    u, v = read.geometry.centroid.x, read.geometry.centroid.y
    lon, lat = greenwich_degrees(pyproj.CRS(read.crs.to_wkt()), u.to_numpy(), v.to_numpy())
    np.testing.assert_allclose(np.mod(lon - read.lon + 180, 360), 180, atol=1e-7)
    np.testing.assert_allclose(lat, read.lat, atol=1e-7)


def test_the_azimuth_of_the_major_axis() -> None:
    """Plate carree stretches along the parallels; conformal maps have none; the radius may be given."""
    layer = gis.indicatrices("eqc", region="box:0,20,40,60", step=10, radius=1e5)
    assert np.abs(layer.azimuth - 90).max() < 1e-6
    assert (layer.radius == 1e5).all()
    assert gis.indicatrices("merc", region="box:0,20,40,60", step=10).azimuth.isna().all()


@pytest.mark.parametrize("suffix", [".gpkg", ".geojson"])
def test_indicatrices_of_a_map_without_a_crs(suffix: str, tmp_path: Path) -> None:
    """Metres, and a CRS that is undefined (GeoPackage) or of no place on the Earth (GeoJSON)."""
    layer = gis.indicatrices("+proj=pipeline +step +proj=moll", region="box:0,0,40,40", step=10)
    assert layer.crs is None
    read = geopandas.read_file(gis.save_layer(layer, tmp_path / f"e{suffix}"))
    assert read.crs is None or read.crs.type_name == "Engineering CRS"
    np.testing.assert_allclose(shapely.get_coordinates(read.geometry), shapely.get_coordinates(layer.geometry))


# ---- tables ---------------------------------------------------------------------------------

PLACES = pd.DataFrame({"name": ["Bern", "Chur"], "height": [540, 593], "lon": [7.44, 9.53], "lat": [46.95, 46.85]})
LIKE = geopandas.points_from_xy(PLACES.lon, PLACES.lat)


@pytest.mark.parametrize("suffix", [".gpkg", ".geojson", ".parquet", ".fgb", ".shp"])
def test_points_are_read_from(suffix: str, tmp_path: Path) -> None:
    """Whatever GDAL or pyarrow reads; other columns and the CRS are kept."""
    path = tmp_path / f"p{suffix}"
    frame = geopandas.GeoDataFrame(PLACES[["name", "height"]], geometry=LIKE, crs=4326)
    frame.to_parquet(path) if suffix == ".parquet" else frame.to_file(path)
    read = gis.read_points(path).sort_values("name", ignore_index=True)  # FlatGeobuf has an order of its own
    assert read.crs == frame.crs
    pd.testing.assert_frame_equal(pd.DataFrame(read[["name", "height"]]), PLACES[["name", "height"]], check_dtype=False)


def test_points_are_read_from_tables(tmp_path: Path) -> None:
    """CSV and Parquet without geometries; what begins with a zero stays text."""
    PLACES.to_parquet(tmp_path / "p.parquet")
    pd.testing.assert_frame_equal(gis.read_points(tmp_path / "p.parquet"), PLACES)
    (tmp_path / "p.csv").write_text("code,n,lon,lat,note\n007,1,0.1,2,\n8,,3,4,\n", encoding="utf-8-sig")
    read = gis.read_points(tmp_path / "p.csv")
    assert read.code.tolist() == ["007", "8"]
    assert read.lon.tolist() == [0.1, 3.0]
    assert read.n[0] == 1
    assert np.isnan(read.n[1])


def test_layers_of_points(tmp_path: Path) -> None:
    """One of several must be named, behind a #."""
    path = tmp_path / "p.gpkg"
    for layer in ("one", "two"):
        geopandas.GeoDataFrame({"layer": [layer]}, geometry=LIKE[:1], crs=4326).to_file(path, layer=layer)
    assert gis.read_points(f"{path}#two").layer.tolist() == ["two"]
    for wrong in (f"{path}", f"{path}#three"):
        with pytest.raises(ValueError, match=r"Invalid points file '.*'. It must name a layer, .* it has one, two."):
            gis.read_points(wrong)


@pytest.mark.parametrize("name", ["x.gpkg", "x.parquet", "x.csv", "x.txt"])
def test_points_that_cannot_be_read(name: str, tmp_path: Path) -> None:
    """No file, and a file of something else: one line."""
    path = tmp_path / name
    with pytest.raises(ValueError, match="There is no file"):
        gis.read_points(path)
    path.write_bytes(b"\xff\xfe\0nothing" * 10)
    with pytest.raises(ValueError, match="It cannot be read") as refused:
        gis.read_points(path)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", gis.TABLE_SUFFIXES)
@pytest.mark.parametrize("crs", [None, "EPSG:4326", "EPSG:2056"])
def test_points_are_written(crs: str | None, suffix: str, tmp_path: Path) -> None:
    """The numbers come back to the last digit; points stay where they are, in their CRS or, for GeoJSON, in WGS 84."""
    map_ = Projection.from_user_input("EPSG:2056")
    frame = PLACES
    if crs:
        frame = geopandas.GeoDataFrame(PLACES[["name", "height"]], geometry=LIKE, crs=4326).to_crs(crs)
    found = factors(map_, frame)
    path = gis.save_points(map_, found, tmp_path / f"o{suffix}")
    read = gis.read_points(path)
    numbers = ["height", "x", "y", "h", "k", "omega", "convergence"]
    np.testing.assert_allclose(read[numbers], found[numbers], rtol=1e-15)
    assert read.name.tolist() == PLACES.name.tolist()
    again = factors(map_, read[[name for name in ("lon", "lat", "geometry") if name in read]])
    np.testing.assert_allclose(again[["x", "y"]], found[["x", "y"]], atol=2e-3)
    if suffix == ".gpkg":
        assert read.crs.to_epsg() == (pyproj.CRS(crs).to_epsg() if crs else 4150)
    if suffix == ".geojson":
        assert read.crs.to_epsg() == 4326
        assert json.loads(path.read_text())["features"][0]["geometry"]["coordinates"][0] == pytest.approx(
            7.44, abs=1e-2
        )


# ---- files ----------------------------------------------------------------------------------


def write(path: Path) -> None:
    """A file of each kind, by its suffix."""
    if path.suffix == ".tif":
        gis.save_raster(gis.raster("eqc", region="box:0,0,9,9", size=8), path)
    elif path.suffix == ".parquet":
        gis.save_points(Projection.from_user_input("eqc"), PLACES, path)
    else:
        gis.save_layer(gis.indicatrices("eqc", region="box:0,0,9,9", step=3), path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x.tif", "x.gpkg", "x.geojson", "x.parquet"])
def test_a_failure_leaves_nothing_half_written(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is full in the middle: the old file as it was, and no other."""
    path = tmp_path / name
    path.write_text("old")

    def full(*arguments: object, **options: object) -> None:
        for target in arguments:
            if isinstance(target, Path):
                target.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for target in ("rasterio.open", "pyogrio.write_dataframe", "pandas.DataFrame.to_parquet"):
        monkeypatch.setattr(target, full)
    with pytest.raises(OSError, match="No space left"):
        write(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "library"),
    [("x.tif", "rasterio"), ("x.gpkg", "geopandas"), ("x.gpkg", "pyogrio"), ("x.parquet", "pyarrow")],
)
def test_a_missing_library(name: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line that says what to install."""
    monkeypatch.setitem(sys.modules, library, None)
    path = tmp_path / name
    message = re.escape(f"Invalid output '{path}'. It needs {library}: pip install 'projdist[gis]'.")
    with pytest.raises(ImportError, match=f"^{message}$"):
        gis.check_libraries(path)


@pytest.mark.parametrize(
    "save", [gis.save_raster, gis.save_layer, lambda frame, path: gis.save_points(None, frame, path)]
)
def test_unknown_suffixes(save: object) -> None:
    """Refused by name."""
    with pytest.raises(ValueError, match=r"Invalid .* 'x.foo'. Its suffix must be \."):
        save(None, "x.foo")


def test_planes_of_crss() -> None:
    """A CRS is its own plane, whatever its unit and axes; the matrix leads to metres east and north."""
    np.testing.assert_allclose(plane_of(Projection.from_user_input("EPSG:5513")).to_metres, [[0, -1], [-1, 0]])
    feet = plane_of(Projection.from_user_input("EPSG:2263")).to_metres
    np.testing.assert_allclose(feet, np.eye(2) * 1200 / 3937, rtol=1e-15)
