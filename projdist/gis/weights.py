"""Weights from rasters: people, rather than square kilometres."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.gis.libraries import needed_for, one_line
from projdist.projections import unprojected
from projdist.regions import Place, PointSet, get_region

_MOST = 1_000_000  # cells that are points; more are added up in blocks
_AT_ONCE = 50_000_000  # cells in memory; 400 MB


def weighted(region: str | Place, path: str | os.PathLike[str], *, band: int = 1) -> PointSet:
    """The cells of a raster whose middles are in a region, as points with the cells' values for weights.

    The values are counts, as of people; a cell without data counts nothing. More than a million
    cells are added up in square blocks. Raises ValueError for a file, a band or values that are none,
    and where nothing is left, ImportError without rasterio.
    """
    place = get_region(region)
    name = f"{place.name} weighted by {Path(path).name}"
    text = f"Invalid weights '{path}'."
    with needed_for(f"weights '{path}'"):
        import rasterio
        import rasterio.errors
    try:
        with rasterio.open(path) as image:
            if not 1 <= band <= image.count:
                raise ValueError(f"{text} It has {image.count} band(s), and no band {band}.")
            if image.crs is None:
                raise ValueError(f"{text} It states no CRS.")
            parts = [_cells(image, band, window) for window in _windows(image, place.bounds)]
            crs = image.crs.to_wkt()
    except rasterio.errors.RasterioError as error:
        raise ValueError(f"{text} It cannot be read: {one_line(error)}.") from error
    x, y, weight = (np.concatenate(values) if values else np.empty(0) for values in zip(*parts, strict=True))
    counted = weight != 0
    lon, lat = unprojected(crs, x[counted], y[counted])
    weight = weight[counted]
    inside = np.isfinite(lon) & np.isfinite(lat)
    inside[inside] = place.contains(lon[inside], lat[inside])
    if not inside.any():
        raise ValueError(f"{text} No cell with a value has its middle in {place.name}.")
    return PointSet(lon[inside], lat[inside], weight[inside], name, notes=place.notes)


def _windows(image: Any, bounds: tuple[float, float, float, float]) -> Iterator[Any]:
    """The parts of a raster in which a region may lie: by its bounds in longitude and latitude, else all of it."""
    from rasterio.windows import Window

    if not image.crs.is_geographic or image.transform.b or image.transform.d:
        yield Window(0, 0, image.width, image.height)
        return
    west, south, east, north = bounds
    left, bottom, right, top = image.bounds
    for turn in (-360.0, 0.0, 360.0):
        w, e = max(west + turn, left), min(east + turn, right)
        s, n = max(south, bottom), min(north, top)
        if w < e and s < n:
            # In whole cells; rows may run from south to north.
            ends_x = sorted((at - image.transform.c) / image.transform.a for at in (w, e))
            ends_y = sorted((at - image.transform.f) / image.transform.e for at in (s, n))
            first, last = max(math.floor(ends_x[0]), 0), min(math.ceil(ends_x[1]), image.width)
            upper, lower = max(math.floor(ends_y[0]), 0), min(math.ceil(ends_y[1]), image.height)
            yield Window(first, upper, last - first, lower - upper)


def _cells(image: Any, band: int, window: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coordinates of the middles of cells, or of square blocks of them, and their values."""
    from rasterio.windows import Window

    side = max(1, math.ceil(math.sqrt(window.width * window.height / _MOST)))
    columns = np.arange(0, window.width, side)
    sums, rows = [], []
    for first in range(0, int(window.height), side * max(1, _AT_ONCE // int(window.width * side))):
        count = min(side * max(1, _AT_ONCE // int(window.width * side)), int(window.height) - first)
        part = Window(window.col_off, window.row_off + first, window.width, count)
        values = image.read(band, window=part, masked=True).astype(float).filled(0.0)
        values[np.isnan(values)] = 0.0
        starts = np.arange(0, count, side)
        sums.append(np.add.reduceat(np.add.reduceat(values, starts, axis=0), columns, axis=1))
        rows.append(first + starts)
    row = np.concatenate(rows)
    middle_x = window.col_off + 0.5 * (columns + np.minimum(columns + side, window.width))
    middle_y = window.row_off + 0.5 * (row + np.minimum(row + side, window.height))
    u, v = np.meshgrid(middle_x, middle_y)
    a, b, c, d, e, f = image.transform[:6]
    return (a * u + b * v + c).ravel(), (d * u + e * v + f).ravel(), np.concatenate(sums).ravel()
