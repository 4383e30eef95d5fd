"""Measures as arrays of xarray, held against the GeoTIFF of the same, and against closed forms."""

from pathlib import Path

import numpy as np
import pyproj
import pytest
from gis_files import some_slow

from projdist import factors, gis

rasterio = pytest.importorskip("rasterio")
xarray = pytest.importorskip("xarray")

CASES = {
    "EPSG:3035": {"size": 40},
    "EPSG:2263": {"resolution": 20_000.0},  # feet
    "EPSG:5513": {"size": (20, 10)},  # south and west
    "EPSG:27572": {"size": 20, "grid": "lonlat"},  # Paris, grads
    "mollweide": {"region": "box:-180,0,20,90", "size": 30},
}


@pytest.mark.parametrize("projection", some_slow(CASES, set(CASES) - {"EPSG:27572"}))
def test_arrays_are_the_raster(projection: str, tmp_path: Path) -> None:
    """Values, coordinates of centres, CRS and transformation are those that rasterio reads of the GeoTIFF."""
    found = gis.measure_arrays(projection, ["omega", "scale_error_ppm"], **CASES[projection])
    path = gis.save_raster(
        gis.raster(projection, ["omega", "scale_error_ppm"], **CASES[projection]), tmp_path / "x.tif"
    )
    with rasterio.open(path) as image:
        rows, columns = np.mgrid[: image.height, : image.width]
        x, y = rasterio.transform.xy(image.transform, rows.ravel(), columns.ravel())
        np.testing.assert_array_equal(found.omega.values, image.read(1))
        np.testing.assert_array_equal(found.scale_error_ppm.values, image.read(2))
        np.testing.assert_allclose(found.x.values, np.reshape(x, rows.shape)[0], rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(found.y.values, np.reshape(y, rows.shape)[:, 0], rtol=1e-12, atol=1e-9)
        numbers = [float(text) for text in found.spatial_ref.attrs["GeoTransform"].split()]
        np.testing.assert_allclose(numbers, image.transform.to_gdal(), rtol=1e-15)
        crs = pyproj.CRS(image.crs.to_wkt())
    assert found.omega.dims == ("y", "x")
    assert (found.omega.attrs["units"], found.scale_error_ppm.attrs["units"]) == ("deg", "ppm")
    assert found.omega.attrs["grid_mapping"] == "spatial_ref"
    given = pyproj.CRS.from_wkt(found.spatial_ref.attrs["crs_wkt"])
    assert given.is_geographic == crs.is_geographic
    assert given.axis_info[0].unit_conversion_factor == pytest.approx(crs.axis_info[0].unit_conversion_factor)
    units = {"EPSG:2263": "0.304800609601219 metre", "EPSG:27572": "grad"}.get(projection, "metre")
    assert found.x.attrs["units"] == units


@pytest.mark.slow
def test_grid_mappings_are_those_of_cf() -> None:
    """As the conventions have them, appendix F: Lambert azimuthal equal-area; longitudes have degrees_east."""
    found = gis.measure_arrays("EPSG:3035", size=5)
    assert found.spatial_ref.attrs["grid_mapping_name"] == "lambert_azimuthal_equal_area"
    assert found.spatial_ref.attrs["false_easting"] == 4321000.0
    assert pyproj.CRS.from_cf(found.spatial_ref.attrs) == pyproj.CRS(3035)
    assert found.x.attrs == {"axis": "X", "standard_name": "projection_x_coordinate", "units": "metre"}
    degrees = gis.measure_arrays("EPSG:3035", size=5, grid="lonlat")
    assert degrees.spatial_ref.attrs["grid_mapping_name"] == "latitude_longitude"
    assert degrees.y.attrs == {"axis": "Y", "standard_name": "latitude", "units": "degrees_north"}


@pytest.mark.slow
def test_one_measure_and_notes() -> None:
    """A measure may stand alone; what has no CRS says why it lies on longitude and latitude."""
    found = gis.measure_arrays("+proj=pipeline +step +proj=moll", "s", size=20)
    assert list(found.data_vars) == ["s"]
    assert "has no CRS" in found.attrs["note"]
    assert "note" not in gis.measure_arrays("mollweide", "s", size=20).attrs


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


def test_other_points_are_refused() -> None:
    with pytest.raises(ValueError, match=r"two DataArrays of xarray\.$"):
        gis.factor_arrays("mercator", [10.0], [60.0])


def test_arrays_given_to_factors() -> None:
    """Along different dimensions they are no pairs, and the function for them is named; along one they are."""
    lon = xarray.DataArray([5.0, 10.0], dims="lon", coords={"lon": [5.0, 10.0]})
    lat = xarray.DataArray([0.0, 60.0], dims="lat", coords={"lat": [0.0, 60.0]})
    with pytest.raises(
        ValueError, match=r"^Invalid points\. Their dimensions are lon and lat; projdist\.gis\.factor_arrays"
    ):
        factors("mercator", lon, lat)
    points = xarray.DataArray([0.0, 60.0], dims="lon")
    np.testing.assert_allclose(factors("mercator", lon, points).k, [1.0, 2.0], rtol=1e-9)
    assert factors("mercator", lon, lat[1]).k.shape == (2,)
