"""How long a map's cuts are within a region: every map of the world has some, interrupted ones have more."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray
from projdist.field.tears import drawn, evaluate, find_tears
from projdist.projections import Projection
from projdist.regions import GLOBE, Place, Region

__all__ = ["cut_length", "is_interrupted"]

_CELLS = 60  # along the longer side of a region: 3 or 6 degrees on the globe
_BLOCK = 4  # cells in a row, within which a cut is a straight line
_OFFSET = 0.4937  # of a cell: keeps links off the round longitudes and latitudes where cuts are
_INSET = 1e-6  # of a cell: a cut on the region's side is none
_ONE_CUT = 1.25 * np.pi  # radii: half of the next longer one, a meridian, and another to the equator


def is_interrupted(projection: Projection, region: Region) -> bool:
    """Whether a map is cut within a region where it need not be.

    A region that goes round the globe may be cut by a map whose cuts of the globe are no longer than a meridian from
    pole to pole.
    """
    if cut_length(projection, region) == 0.0:
        return False
    west, _, east, _ = region.bounds
    return east - west < 360.0 or cut_length(projection, GLOBE) > _ONE_CUT * _radius_km(projection)


def cut_length(projection: Projection, region: Place) -> float:
    """Kilometres of cuts within a region, to a cell of some sixty along it; none between points.

    Links of a grid that are torn are counted, each for the width of its row or column. Gaps of less than a tenth of a
    cell do not count, and where the map ends is no cut.
    """
    if not region.area_km2:
        return 0.0
    west, south, east, north = region.bounds
    step = max(east - west, north - south) / _CELLS
    columns, rows = (max(_BLOCK, int(np.ceil(span / step))) for span in (east - west, north - south))
    wide, high = (east - west) / columns, (north - south) / rows
    lon, lat = west + wide * (np.arange(columns) + _OFFSET), south + high * (np.arange(rows) + _OFFSET)
    round_the_earth = east - west >= 360.0
    all_lon = (
        np.append(lon, lon[0] + 360.0) if round_the_earth else np.r_[west + _INSET * wide, lon, east - _INSET * wide]
    )
    all_lat = np.r_[south + _INSET * high, lat, north - _INSET * high]
    nodes = evaluate(projection, *(axis.ravel() for axis in np.meshgrid(all_lon, all_lat)))
    nodes = nodes.reshape(all_lat.size, all_lon.size, 4)
    inner = nodes[:, :-1] if round_the_earth else nodes[:, 1:-1]
    across = np.isfinite(_tears(projection, region, nodes[1:-1, :-1], nodes[1:-1, 1:]))
    along = np.nan_to_num(np.cos(np.radians(_tears(projection, region, inner[:-1], inner[1:]))))
    lengths = [_blocks(one, rows + 1, columns + 1) for one in (high * across, wide * along)]
    return float(np.radians(np.hypot(*lengths).sum()) * _radius_km(projection))


def _radius_km(projection: Projection) -> float:
    """The mean radius of the body."""
    return projection.ellipsoid.ground.mean_radius / 1000.0


def _tears(projection: Projection, region: Place, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Latitudes at which links between evaluated points (m, n, 4) are torn within the region; NaN if not."""
    links = find_tears(projection, start.reshape(-1, 4), stop.reshape(-1, 4), projection.ellipsoid.a)
    torn = np.flatnonzero(links.torn & drawn(links.start) & drawn(links.stop))
    lon, lat = links.start[torn, :2].T
    latitudes = np.full(len(links.torn), np.nan)
    latitudes[torn] = np.where(region.contains(lon, lat), lat, np.nan)
    return latitudes.reshape(start.shape[:2])


def _blocks(lengths: FloatArray, rows: int, columns: int) -> FloatArray:
    """Sums over square blocks of an array that has at most so many rows and columns."""
    padded = np.zeros([_BLOCK * -(-size // _BLOCK) for size in (rows, columns)])
    padded[: lengths.shape[0], : lengths.shape[1]] = lengths
    return padded.reshape(padded.shape[0] // _BLOCK, _BLOCK, -1, _BLOCK).sum(axis=(1, 3))
