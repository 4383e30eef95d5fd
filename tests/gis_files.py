"""What the tests of files for GIS programs share."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest


def some_slow(names: Iterable[str], slow: set[str]) -> list[object]:
    """Parameters, some of which only the slow tests take."""
    return [pytest.param(name, marks=pytest.mark.slow) if name in slow else name for name in names]


def greenwich_degrees(crs: pyproj.CRS, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Longitude and latitude from pyproj alone."""
    geodetic = crs.geodetic_crs
    lon, lat = pyproj.Transformer.from_crs(crs, geodetic, always_xy=True).transform(x, y)
    unit = np.degrees(geodetic.axis_info[0].unit_conversion_factor)
    meridian = geodetic.prime_meridian
    offset = np.degrees(meridian.longitude * meridian.unit_conversion_factor)
    return lon * unit + offset, lat * unit


def from_origin(west: float, north: float, width: float, height: float) -> Any:
    """Where pixels lie; rasterio's own function warns of itself."""
    return pytest.importorskip("rasterio").Affine(width, 0.0, west, 0.0, -height, north)


def write_raster(path: Path, values: np.ndarray, transform: Any, crs: str = "EPSG:4326", **options: Any) -> Path:
    """A GeoTIFF of bands, rows and columns."""
    shape = dict(zip(("count", "height", "width"), values.shape, strict=True)) | {"dtype": values.dtype.name}
    given = {"driver": "GTiff", "crs": crs, "transform": transform, **shape, **options}
    with pytest.importorskip("rasterio").open(path, "w", **given) as image:
        image.write(values)
    return path


def write_layer(path: Path, shapes: Iterable[Any], crs: str | None = "EPSG:4326", **columns: list[Any]) -> Path:
    """A file of GDAL's of shapes, with columns."""
    pytest.importorskip("geopandas").GeoDataFrame(columns, geometry=list(shapes), crs=crs).to_file(path)
    return path
