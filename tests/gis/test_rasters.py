"""Rasters for GIS programs, and arrays of xarray, read back by rasterio and held against `factors`."""

import re
from pathlib import Path

import numpy as np
import pyproj
import pytest
from commands import HIDDEN
from gis_files import greenwich_degrees
from refusals import refuses
from tables import each, some

from projdist import Projection, ProjectionError, factors, gis, projection_names
from projdist.gis import rasters
from projdist.gis.rasters import on_plane, pixels
from projdist.projections import projected_crs_of, same_map

geopandas = pytest.importorskip("geopandas")
rasterio = pytest.importorskip("rasterio")
SAME = 1e-9
SLOW = pytest.mark.slow

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


def centres(image: rasterio.DatasetReader) -> tuple[np.ndarray, np.ndarray]:
    """x, y of the centres of all pixels."""
    rows, columns = np.mgrid[: image.height, : image.width]
    x, y = rasterio.transform.xy(image.transform, rows.ravel(), columns.ravel())
    return np.reshape(x, rows.shape), np.reshape(y, rows.shape)


@pytest.mark.slow
@pytest.mark.parametrize("projection", RASTERS)
def test_rasters_on_the_plane(projection: str, tmp_path: Path) -> None:
    """Every pixel has the measures of its centre, whose longitude and latitude pyproj finds; the CRS is the map's."""
    names = ["omega", "scale_error_ppm"]
    found = gis.raster(projection, names, **RASTERS[projection])
    map_ = Projection.from_user_input(projection)
    with rasterio.open(gis.save_raster(found, tmp_path / "x.tif")) as image:
        assert (image.descriptions, image.units) == (("omega", "scale_error_ppm"), ("deg", "ppm"))
        assert (np.isnan(image.nodata), image.dtypes) == (True, ("float64", "float64"))
        assert same_map(map_, image.crs.to_wkt()) is not None
        values, (x, y), crs = image.read(), centres(image), pyproj.CRS(image.crs.to_wkt())
    inside = np.isfinite(values[0])
    assert (found.note, inside.mean() > 0.4) == ("", True)
    x, y = x[inside], y[inside]
    truth = factors(map_, *greenwich_degrees(crs, x, y), measures=names)
    np.testing.assert_allclose(values[0][inside], truth.extra["omega"], rtol=SAME, atol=SAME)
    np.testing.assert_allclose(values[1][inside], truth.extra["scale_error_ppm"], rtol=SAME, atol=1e6 * SAME)
    to_map = pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    back = to_map.transform(*to_map.transform(x, y, direction="INVERSE"))
    np.testing.assert_allclose(back, [x, y], atol=1e-6 * map_.ellipsoid.a)


def test_places_outside_the_map() -> None:
    """There are none: of pixels that lie by the rim of Mollweide's ellipse those are on the map that are within it."""
    projection, R, side = Projection.from_user_input("mollweide"), 6371008.7714, 360_000.0
    turn = np.linspace(0.0, 2.0 * np.pi, 50)
    ellipse = np.sqrt(2.0) * R * np.stack([2.0 * np.cos(turn), np.sin(turn)])
    for share, on_map in ((0.9999, True), (1.0001, False), (1.02, False)):
        lon, lat = on_plane(projection, projected_crs_of(projection), side, *(share * ellipse))
        assert (np.isfinite([lon, lat]) == on_map).all()


@pytest.mark.slow
def test_pixels_outside_the_region_are_not_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cap on its azimuthal map is a disc of its radius; so in strips of seven rows, of which the last has three."""
    monkeypatch.setattr(rasters, "_AT_ONCE", 600)
    found = gis.raster("+proj=aeqd +lon_0=10 +lat_0=50 +R=6371008.7714", region="cap:10,50,500", size=80)
    distance = np.hypot(*found.pixels.centres(0, found.pixels.rows))
    assert (np.isfinite(found.values[0]) == (distance < 500e3)).all()
    assert found.pixels.width * 80 == pytest.approx(1e6, rel=1e-3)


@pytest.mark.parametrize("projection", LONLAT)
def test_rasters_on_longitude_and_latitude(projection: str, tmp_path: Path) -> None:
    """Pixels are even in the map's own longitudes and latitudes, across the antimeridian beyond 180 degrees."""
    path = gis.save_raster(gis.raster(projection, ["k", "h"], **LONLAT[projection]), tmp_path / "x.tif")
    with rasterio.open(path) as image:
        values, (x, y), crs = image.read(), centres(image), pyproj.CRS(image.crs.to_wkt())
        assert projection != "EPSG:3832" or tuple(image.bounds) == (170.0, -30.0, 190.0, 10.0)
    own = 6378137.0 if "pipeline" in projection else Projection.from_user_input(projection).ellipsoid.a
    assert (crs.is_geographic, crs.ellipsoid.semi_major_metre) == (True, pytest.approx(own))
    truth = factors(projection, *greenwich_degrees(crs, x, y))
    inside = np.isfinite(values[0])
    assert inside.mean() > 0.7
    np.testing.assert_allclose(values[:, inside], [truth.k[inside], truth.h[inside]], rtol=SAME)


@pytest.mark.parametrize(("projection", "reason"), [
    ("+proj=pipeline +step +proj=moll", "Mollweide has no CRS"),
    (lambda lon, lat: (1e5 * lon, 1e5 * lat), "<lambda> has no CRS"),
    ("airy", "Airy has no inverse in PROJ"),
    pytest.param("rouss", "PROJ's inverse of Roussilhe Stereographic leads to other points", marks=SLOW),
])  # fmt: skip
def test_maps_that_fall_back(projection: object, reason: str) -> None:
    """A map without a CRS or an inverse is laid on longitude and latitude, and the note says why."""
    found = gis.raster(projection, size=8)
    assert found.note == f"{reason}; the raster is in longitude and latitude."
    assert pyproj.CRS(found.wkt).to_epsg() == 4326
    assert found.pixels.transform == (45.0, 0.0, -180.0, 0.0, -45.0, 90.0)


@pytest.mark.slow
def test_a_crs_that_a_geotiff_has_no_room_for(tmp_path: Path) -> None:
    """It comes in the file beside, which obeys the same rules; where the GeoTIFF has room, an old one goes."""
    path = tmp_path / "x.tif"
    hatano, equal_earth = (gis.raster(name, region="box:0,0,40,40", size=8) for name in ("hatano", "equal-earth"))
    assert hatano.note == f"A GeoTIFF has no room for the CRS of {hatano.projection.name}; it is in the .aux.xml file."
    for found in (hatano, equal_earth):
        with rasterio.open(gis.save_raster(found, path)) as image:
            assert same_map(found.projection, image.crs.to_wkt()) is not None
        if found is hatano:
            path.unlink()
            with pytest.raises(FileExistsError, match=r"aux\.xml'. It exists"):
                gis.save_raster(hatano, path, overwrite=False)
    assert list(tmp_path.iterdir()) == [path]


def test_pixels() -> None:
    """Square ones along the longer side, columns and rows, or edges on the multiples of a resolution."""
    extent = (-10.0, 2.0, 30.0, 12.0)
    assert pixels(extent, 1, 4, None).transform == (10.0, 0.0, -10.0, 0.0, -10.0, 12.0)
    assert pixels(extent, 1, (8, 1), None).transform == (5.0, 0.0, -10.0, 0.0, -10.0, 12.0)
    found = pixels(extent, 1, None, 3.0)
    assert (found.left, found.top, found.columns, found.rows) == (-12.0, 12.0, 14, 4)
    assert (pixels((-180.0, -90.0, 180.0, 90.0), 1, None, 0.1).columns) == 3600


@each(("size", "resolution", "message"), [
    (0, None, "Invalid size '0'. It must be a positive number of pixels."),
    ((100_000, 100_000), None, "Invalid size '100000,100000'. It makes 1e+10 values; there must be 1 to 1e+08"),
    (None, -1.0, "Invalid resolution '-1.0'. It must be a positive number"),
    (3, 1.0, "Invalid size '3' with resolution '1'. It must be one of the two."),
    (None, 1e-3, "Invalid resolution '0.001'. It makes"),
])  # fmt: skip
def test_pixels_that_are_refused(size: int | tuple[int, int] | None, resolution: float | None, message: str) -> None:
    refuses(re.escape(message), pixels, (0.0, 0.0, 40.0, 40.0), 1, size, resolution)


@each(("projection", "options", "message"), [
    ("eqc", {"grid": "plane"}, "Invalid grid 'plane'. It must be map or lonlat."),
    ("eqc", {"measures": ["foo"]}, "Invalid measure 'foo'."),
    ("eqc", {"region": "box:1"}, "Invalid region 'box:1'."),
    (HIDDEN[0], {"region": HIDDEN[-1]}, "Invalid region for 'Orthographic'. No part of it can be projected."),
])  # fmt: skip
def test_rasters_that_are_refused(projection: str, options: dict, message: str) -> None:
    refuses(re.escape(message), gis.raster, projection, **{"region": "box:0,0,40,40"} | options)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*too far from where:projdist.support.messages.Notice")  # New Zealand's map
@pytest.mark.parametrize("name", some({text: name for name, text in projection_names().items()}.values(), 4))
def test_every_name_as_a_raster_and_a_layer(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What PROJ has a CRS for comes back from GeoTIFF, GeoPackage and GeoJSON as the same map, by one of its names."""
    monkeypatch.setattr("projdist.surfaces.surface._GLOBE_STEP", 2.0)  # a ninth of the cells
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


xarray = pytest.importorskip("xarray")

ARRAYS = {
    "EPSG:3035": {"size": 40},
    "EPSG:2263": {"resolution": 20_000.0},  # feet
    "EPSG:5513": {"size": (20, 10)},  # south and west
    "EPSG:27572": {"size": 20, "grid": "lonlat"},  # Paris, grads
    "mollweide": {"region": "box:-180,0,20,90", "size": 30},
}


@pytest.mark.slow
@pytest.mark.parametrize("projection", ARRAYS)
def test_arrays_are_the_raster(projection: str, tmp_path: Path) -> None:
    """Values, coordinates of centres, CRS and transformation are those that rasterio reads of the GeoTIFF."""
    names = ["omega", "scale_error_ppm"]
    found = gis.measure_arrays(projection, names, **ARRAYS[projection])
    path = gis.save_raster(gis.raster(projection, names, **ARRAYS[projection]), tmp_path / "x.tif")
    with rasterio.open(path) as image:
        x, y = centres(image)
        np.testing.assert_array_equal([found.omega.values, found.scale_error_ppm.values], image.read())
        for ours, truth in ((found.x, x[0]), (found.y, y[:, 0])):
            np.testing.assert_allclose(ours.values, truth, rtol=1e-12, atol=1e-9)
        numbers = [float(text) for text in found.spatial_ref.attrs["GeoTransform"].split()]
        np.testing.assert_allclose(numbers, image.transform.to_gdal(), rtol=1e-15)
        crs = pyproj.CRS(image.crs.to_wkt())
    assert (found.omega.dims, found.scale_error_ppm.attrs["units"]) == (("y", "x"), "ppm")
    assert (found.omega.attrs["units"], found.omega.attrs["grid_mapping"]) == ("deg", "spatial_ref")
    given = pyproj.CRS.from_wkt(found.spatial_ref.attrs["crs_wkt"])
    assert given.is_geographic == crs.is_geographic
    assert given.axis_info[0].unit_conversion_factor == pytest.approx(crs.axis_info[0].unit_conversion_factor)
    units = {"EPSG:2263": "0.304800609601219 metre", "EPSG:27572": "grad"}.get(projection, "metre")
    assert found.x.attrs["units"] == units


@pytest.mark.slow
def test_grid_mappings_are_those_of_cf() -> None:
    """As the conventions have them, appendix F: Lambert azimuthal equal-area; longitudes have degrees_east.

    A measure may stand alone; what has no CRS says why it lies on longitude and latitude.
    """
    found = gis.measure_arrays("EPSG:3035", "s", size=5)
    given = found.spatial_ref.attrs
    assert (given["grid_mapping_name"], given["false_easting"]) == ("lambert_azimuthal_equal_area", 4321000.0)
    assert pyproj.CRS.from_cf(given) == pyproj.CRS(3035)
    assert found.x.attrs == {"axis": "X", "standard_name": "projection_x_coordinate", "units": "metre"}
    degrees = gis.measure_arrays("EPSG:3035", size=5, grid="lonlat")
    assert degrees.spatial_ref.attrs["grid_mapping_name"] == "latitude_longitude"
    assert degrees.y.attrs == {"axis": "Y", "standard_name": "latitude", "units": "degrees_north"}
    bare = gis.measure_arrays("+proj=pipeline +step +proj=moll", "s", size=20)
    assert (list(bare.data_vars), "note" in found.attrs, "has no CRS" in bare.attrs["note"]) == (["s"], False, True)


@pytest.mark.slow
def test_factors_keep_dimensions_and_coordinates() -> None:
    """Mercator's scale is 1 / cos(lat), whichever dimensions and extra coordinates there are."""
    lat = xarray.DataArray([0.0, 30.0, 60.0], dims="lat", coords={"lat": [0.0, 30.0, 60.0]})
    lon = xarray.DataArray([[5.0, 10.0]], dims=("time", "lon"), coords={"lon": [5.0, 10.0], "time": [7]})
    found = gis.factor_arrays("mercator", lon, lat, measures=["flexion"])
    assert found.k.dims == ("lat", "time", "lon")
    np.testing.assert_allclose(found.k.sel(time=7, lon=10.0), 1.0 / np.cos(np.radians(lat)), rtol=1e-9)
    assert found.time.values.tolist() == [7]
    assert set(found.data_vars) >= {"x", "h", "omega", "quality", "flexion"}
    assert (found.omega.attrs["units"], found.x.attrs["units"], found.k.attrs["units"]) == ("deg", "metre", "1")
    point = gis.factor_arrays("mercator", xarray.DataArray(10.0), xarray.DataArray(60.0))
    assert float(point.k) == pytest.approx(float(factors("mercator", 10.0, 60.0).k), rel=1e-14)


def test_arrays_given_to_factors() -> None:
    """Along different dimensions they are no pairs, and the function for them is named; along one they are."""
    refuses(r"two DataArrays of xarray\.$", gis.factor_arrays, "mercator", [10.0], [60.0])
    lon = xarray.DataArray([5.0, 10.0], dims="lon", coords={"lon": [5.0, 10.0]})
    lat = xarray.DataArray([0.0, 60.0], dims="lat", coords={"lat": [0.0, 60.0]})
    said = r"^Invalid points\. Their dimensions are lon and lat; projdist\.gis\.factor_arrays"
    refuses(said, factors, "mercator", lon, lat)
    points = xarray.DataArray([0.0, 60.0], dims="lon")
    np.testing.assert_allclose(factors("mercator", lon, points).k, [1.0, 2.0], rtol=1e-9)
    assert factors("mercator", lon, lat[1]).k.shape == (2,)
