"""Weights from rasters, such as population, for figures weighted by people instead of by area."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from projdist import projections, support
from projdist._typing import AnyPath, BoolArray, FloatArray
from projdist.gis.layers import needed_for
from projdist.regions import PointSet, Region, RegionEdges, RegionLike, get_region

_MOST = 1_000_000  # cells that become points; more are added up in blocks
_AT_ONCE = 4_000_000  # cells read at a time: about seven arrays of 32 MB
_LOOK = 16  # cells on a side of a square that is tested as a whole
_BENT = 0.25  # of its size, by which such a square, if curved, may reach beyond the box of its corners


def weighted(region: RegionLike, path: AnyPath, *, band: int = 1) -> PointSet:
    """The cells of a raster whose middles are in a region, as points weighted by the cells' values.

    The values are counts, as of people, with the band's scale and offset applied; a cell without data has weight 0.
    If there are more than a million cells over the region, those in it are added up in square blocks, each a point at
    its centre of gravity; `coarse` has the points of blocks twice as wide, by which `summarize` estimates the error of
    this. Raises ValueError for an invalid file, band or value, and if no cell is left, ImportError without rasterio.
    """
    place = get_region(region)
    text = f"Invalid weights '{path}'."
    if isinstance(place, PointSet):
        raise ValueError(f"{text} A raster weighs the area of a region, and {place.name} has points.")
    with needed_for(f"weights '{path}'"):
        import rasterio
        from rasterio.errors import NotGeoreferencedWarning, RasterioError
    try:
        with warnings.catch_warnings(action="ignore", category=NotGeoreferencedWarning), rasterio.open(path) as image:
            if not 1 <= band <= image.count:
                raise ValueError(f"{text} It has {image.count} band(s), and no band {band}.")
            if image.crs is None:
                raise ValueError(f"{text} It states no CRS.")
            support.check_raster(image, [band], text)
            corners = image.transform @ (np.array([0, image.width] * 2), np.repeat([0, image.height], 2))
            bounds = [edge(side) for edge in (np.min, np.max) for side in corners]
            projections.tell_of_degrees(image.crs.to_wkt(), bounds, f"'{path}'", "raster")
            ellipsoid = projections.ground_of(image.crs.to_wkt())
            if ellipsoid is not None and ellipsoid.is_of_another_body:
                place = cast(Region, get_region(region, ellipsoid))
            fine, coarse = _Raster(image, band, text, place).points()
    except RasterioError as error:
        raise ValueError(f"{text} It cannot be read: {support.one_line(error)}.") from error
    name = f"{place.name} weighted by {Path(path).name}"
    on = getattr(place, "ellipsoid", None)
    sparser = None if coarse is None else PointSet(*coarse, name, ellipsoid=on)
    return PointSet(*fine, name, notes=place.notes, coarse=sparser, ellipsoid=on)


_Weighted = tuple[FloatArray, FloatArray, FloatArray]  # longitudes, latitudes and weights


class _Window(NamedTuple):
    """Columns and rows of a raster, the ends excluded."""

    left: int
    top: int
    right: int
    bottom: int


class _Raster:
    """A band of an open raster over a region; `text` is the beginning of error messages."""

    def __init__(self, image: Any, band: int, text: str, region: Region) -> None:
        self._image, self._band, self._text, self._region = image, band, text, region
        self._crs, self._border = image.crs.to_wkt(), RegionEdges(region)

    def points(self) -> tuple[_Weighted, _Weighted | None]:
        """The cells in the region, or blocks of them and those of blocks twice as wide; ValueError without any."""
        region, windows = self._region, list(self._windows())
        if not windows:
            west, south, east, north = self._extent
            raise ValueError(
                f"{self._text} It lies elsewhere than {region.name}: within longitudes {west:.6g} and {east:.6g}, "
                f"latitudes {south:.6g} and {north:.6g}."
            )
        cells = sum((window.right - window.left) * (window.bottom - window.top) for window in windows)
        side = max(1, math.ceil(math.sqrt(cells / _MOST)))
        sums = [self._sums(tile, side) for window in windows for tile in _split(window, side)]
        fine = self._placed([fine for fine, _ in sums], exact=side == 1)
        if not fine[2].size:
            raise ValueError(f"{self._text} No cell with a value has its middle in {region.name}.")
        return fine, self._placed([coarse for _, coarse in sums]) if side > 1 else None

    @functools.cached_property
    def _extent(self) -> tuple[float, float, float, float]:
        """West, south, east, north of a raster in longitude and latitude, with rows in either order."""
        left, bottom, right, top = self._image.bounds
        return min(left, right), min(bottom, top), max(left, right), max(bottom, top)

    def _windows(self) -> Iterator[_Window]:
        """The parts that the region may overlap: by its bounds for a raster in longitude and latitude, else all."""
        image, bounds = self._image, self._region.bounds
        if not image.crs.is_geographic or image.transform.b or image.transform.d:
            yield _Window(0, 0, image.width, image.height)
            return
        left, bottom, right, top = self._extent
        west, south, east, north = bounds[0], max(bounds[1], bottom), bounds[2], min(bounds[3], top)
        turns = [(max(west + turn, left), min(east + turn, right)) for turn in (-360.0, 0.0, 360.0)]
        overlaps = [(w, e) for w, e in turns if w < e and south < north]
        columns = [_whole(w, e, image.transform.c, image.transform.a, image.width) for w, e in overlaps]
        rows = _whole(south, north, image.transform.f, image.transform.e, image.height)
        for first, last in _merged(columns):
            yield _Window(first, rows[0], last, rows[1])

    def _lonlat(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes of places given in columns and rows."""
        return projections.unprojected(self._crs, *(self._image.transform @ (u, v)))

    def _sums(self, tile: _Window, side: int) -> tuple[FloatArray, FloatArray]:
        """Sums (3, n) of values, also times columns and times rows, over blocks with values, and over fours of them."""
        from rasterio.windows import Window

        window = Window(tile.left, tile.top, tile.right - tile.left, tile.bottom - tile.top)
        read = self._image.read(self._band, window=window, masked=True).astype(float)
        read = read * self._image.scales[self._band - 1] + self._image.offsets[self._band - 1]
        values = np.asarray(read.filled(0.0))
        values[np.isnan(values)] = 0.0
        values = np.where(self._inside(tile, values != 0.0), values, 0.0)
        wrong = ~(np.isfinite(values) & (values >= 0.0))
        if wrong.any():
            value = values[wrong][0]
            raise ValueError(f"{self._text} A cell has the weight {value:g}; it must be finite and not negative.")
        column = np.arange(tile.left, tile.right) + 0.5
        row = np.arange(tile.top, tile.bottom) + 0.5
        fine = np.stack([_added(part, side) for part in (values, values * column, values * row[:, None])])
        coarse = np.stack([_added(part, 2) for part in fine])
        return fine[:, fine[0] > 0.0], coarse[:, coarse[0] > 0.0]

    def _placed(self, sums: list[FloatArray], *, exact: bool = False) -> _Weighted:
        """Longitudes, latitudes and weights of blocks at their centres of gravity."""
        # With `exact` they are of cells, exactly at their middles, where maps may have kinks.
        weight, columns, rows = np.concatenate(sums, axis=1)
        u, v = columns / weight, rows / weight
        if exact:
            u, v = np.floor(u) + 0.5, np.floor(v) + 0.5
        return *self._lonlat(u, v), weight

    def _inside(self, tile: _Window, asked: BoolArray) -> BoolArray:
        """A mask of the cells of a tile with their middles in the region, valid only where `asked`."""
        # Squares of cells off the region's border are tested as a whole.
        columns = np.append(np.arange(tile.left, tile.right, _LOOK, dtype=float), tile.right)
        rows = np.append(np.arange(tile.top, tile.bottom, _LOOK, dtype=float), tile.bottom)
        corners = self._lonlat(*np.meshgrid(columns, rows))
        middles = self._lonlat(*np.meshgrid(*(0.5 * (places[1:] + places[:-1]) for places in (columns, rows))))
        crossed = self._border.crosses(_boxes(*corners)).reshape(middles[0].shape)

        def of_cells(squares: BoolArray) -> BoolArray:
            """The value of its square for each cell."""
            return squares.repeat(_LOOK, axis=0).repeat(_LOOK, axis=1)[: asked.shape[0], : asked.shape[1]]

        result = of_cells(self._contains(*middles))
        row, column = np.nonzero(asked & of_cells(crossed))
        u, v = tile.left + 0.5 + column.astype(float), tile.top + 0.5 + row.astype(float)
        result[row, column] = self._contains(*self._lonlat(u, v))
        return result

    def _contains(self, lon: FloatArray, lat: FloatArray) -> BoolArray:
        """True for places in the region; False for NaN."""
        known = np.isfinite(lon) & np.isfinite(lat)
        known[known] = self._region.contains(lon[known], lat[known])
        return known


def _boxes(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Boxes (n, 4) that contain the squares of a lattice of corners (rows, columns), even if curved."""
    corners = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]]
    first = lon[corners[0]]
    lons = np.stack([first + np.mod(lon[corner] - first + 180.0, 360.0) - 180.0 for corner in corners])
    lats = np.stack([lat[corner] for corner in corners])
    # Its height in degrees of longitude counts, too: far from the equator a rotated square may look narrow.
    shrunk = np.abs(np.cos(np.radians(lats))).min(axis=0)
    east = _BENT * np.maximum(np.ptp(lons, axis=0), np.ptp(lats, axis=0) / shrunk)
    north = _BENT * np.maximum(np.ptp(lats, axis=0), np.ptp(lons, axis=0))
    sides = lons.min(axis=0) - east, lats.min(axis=0) - north, lons.max(axis=0) + east, lats.max(axis=0) + north
    return np.stack([side.ravel() for side in sides], axis=-1)


def _split(window: _Window, side: int) -> Iterator[_Window]:
    """A window split into tiles of about `_AT_ONCE` cells at most, each of whole pairs of blocks."""
    pair = 2 * side
    width = min(window.right - window.left, pair * max(1, _AT_ONCE // pair**2))
    width = math.ceil(width / pair) * pair
    height = pair * max(1, _AT_ONCE // (width * pair))
    for top in range(window.top, window.bottom, height):
        for left in range(window.left, window.right, width):
            yield _Window(left, top, min(left + width, window.right), min(top + height, window.bottom))


def _added(values: FloatArray, side: int) -> FloatArray:
    """Sums over square blocks of `side` by `side` cells."""
    if side == 1:
        return values
    rows, columns = (np.arange(0, count, side) for count in values.shape)
    return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)


def _whole(low: float, high: float, origin: float, step: float, count: int) -> tuple[int, int]:
    """First and last (excluded) of the cells that contain an interval of coordinates, numbered in either direction."""
    ends = sorted((at - origin) / step for at in (low, high))
    return max(math.floor(ends[0]), 0), min(math.ceil(ends[1]), count)


def _merged(intervals: list[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Intervals of columns without overlaps, so that a cell across the antimeridian counts once."""
    done = 0
    for first, last in sorted(intervals):
        if last > max(first, done):
            yield max(first, done), last
        done = max(done, last)
