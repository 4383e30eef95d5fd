"""Ellipsoidal heights at points, from a table or a raster; the home of rasterio."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np

from projdist._typing import FloatArray
from projdist.projections import tell_of_degrees, unprojected
from projdist.support import check_path, check_raster, comma_hint, is_number, number_of, numbered_rows, one_line

__all__ = ["read_heights"]

_NAMES = (
    ("lon", "longitude", "long", "lng", "x"),
    ("lat", "latitude", "y"),
    ("h", "height", "ellipsoidal_height", "hae", "z", "elevation"),
)
_RASTER = (".tif", ".tiff")
_MOST_CELLS = 200  # along a side of a raster: forty thousand points


def read_heights(path: str | os.PathLike[str]) -> FloatArray:
    """Longitudes, latitudes and ellipsoidal heights of points, from a table or a raster.

    Parameters
    ----------
    path : str or path
        A .csv or .txt file that has them in columns of any usual name, or, without a header, in that order; or a .tif,
        a raster of heights, read with rasterio (the extra `gis`) at 200 by 200 cells at most.

    Returns
    -------
    ndarray (n, 3)
        Degrees, degrees and metres, as `ldp` takes them.

    Raises
    ------
    ValueError
        For files that cannot be read, have no such columns or no points, with the number of the first line that is no
        point, and for a raster without rasterio.

    References
    ----------
    Of the rasters: OGC GeoTIFF Standard 1.1, OGC 19-008r4.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "heights.csv")
    ...     _ = path.write_text("lat;lon;name;height" + chr(10) + "50;10;a;100.5")
    ...     read_heights(path)
    array([[ 10. ,  50. , 100.5]])
    """
    path = check_path("heights", path)
    points = _read_raster(path) if path.suffix.lower() in _RASTER else _read_table(path)
    if not (len(points) and (np.abs(points[:, 1]) <= 90).all() and (np.abs(points[:, 0]) <= 720).all()):
        raise ValueError(f"Invalid heights '{path}'. There must be points, with longitudes and latitudes in degrees.")
    return points


def _read_table(path: Path) -> FloatArray:
    rows = numbered_rows(path, f"Invalid heights '{path}'.")
    columns = _columns(path, rows[0][1])
    if not is_number(rows[0][1][columns[0]]):
        rows = rows[1:]
    points = []
    for number, row in rows:
        try:
            point = [number_of(row[column]) for column in columns]
        except (ValueError, IndexError):
            point = [np.nan]
        if not np.isfinite(point).all():
            hint = comma_hint(row)
            raise ValueError(
                f"Invalid heights '{path}'. Line {number} must have a longitude, a latitude and a height.{hint}"
            )
        points.append(point)
    return np.array(points).reshape(-1, 3)


def _columns(path: Path, header: list[str]) -> list[int]:
    """Where longitude, latitude and height stand."""
    names = [name.strip().lower() for name in header]
    if len(header) >= 3 and all(map(is_number, header[:3])):
        return [0, 1, 2]
    found = [next((names.index(name) for name in allowed if name in names), None) for allowed in _NAMES]
    columns = [column for column in found if column is not None]
    if len(columns) < 3:
        raise ValueError(f"Invalid heights '{path}'. Its header must name columns lon, lat and h.")
    return columns


def _read_raster(path: Path) -> FloatArray:
    try:
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    except ImportError as error:
        raise ValueError(f"Invalid heights '{path}'. Rasters need rasterio: pip install 'projdist[gis]'.") from error
    try:
        with warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning), rasterio.open(path) as raster:
            check_raster(raster, [1], f"Invalid heights '{path}'.")
            shape = min(raster.height, _MOST_CELLS), min(raster.width, _MOST_CELLS)
            heights = raster.read(1, out_shape=shape, masked=True).astype(float).filled(np.nan)
            row, column = np.meshgrid(*((np.arange(n) + 0.5) / n for n in shape), indexing="ij")
            x, y = raster.transform @ (column.ravel() * raster.width, row.ravel() * raster.height)
            crs = raster.crs.to_wkt() if raster.crs else "EPSG:4326"
            bounds = raster.bounds
    except RasterioError as error:
        raise ValueError(f"Invalid heights '{path}'. The raster cannot be read: {one_line(error)}.") from error
    tell_of_degrees(crs, bounds, f"'{path}'", "raster")
    lon, lat = unprojected(crs, np.asarray(x), np.asarray(y))
    points = np.stack([lon, lat, heights.ravel()], axis=-1)
    return points[np.isfinite(points).all(axis=1)]
