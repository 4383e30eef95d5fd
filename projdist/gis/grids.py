"""Pixels on a map's own plane, or on longitude and latitude, and the places of their centres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from projdist._typing import FloatArray
from projdist.projections import Graticule, Plane, Projection, graticule_of
from projdist.regions import Place
from projdist.surfaces import normalised, surface_of

GRIDS = ("map", "lonlat")
"""The map's own CRS, or longitude and latitude."""

DEFAULT_SIZE = 1000  # pixels of the longer side

_MOST_VALUES = 1e8  # of all bands; 800 MB
_WHOLE = 1e-9  # of a pixel: an extent that ends so near to a pixel's edge ends there
# A pixel's centre is on the map if it comes back to within these: of a pixel, and of the Earth's radius at least (6 mm,
# more than what inverses lose) and at most (6 m), of which the second is for pixels of a few km and more.
_BACK, _BACK_LEAST, _BACK_MOST = 1e-3, 1e-9, 1e-6

Extent = tuple[float, float, float, float]
"""The smallest and largest coordinates along x and y: x0, y0, x1, y1."""


class Coordinates(Protocol):
    """A CRS that pixels are laid on."""

    @property
    def wkt(self) -> str:
        """The CRS in WKT2."""

    def places(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees of coordinates; NaN where the map is not."""


@dataclass(frozen=True, kw_only=True)
class Pixels:
    """Rows from north to south of pixels `width` by `height` units from the corner at `left`, `top`."""

    left: float
    top: float
    width: float
    height: float
    rows: int
    columns: int

    @property
    def transform(self) -> tuple[float, float, float, float, float, float]:
        """The affine transformation from (column, row) to x, y, as the package affine has it: a, b, c, d, e, f."""
        return self.width, 0.0, self.left, 0.0, -self.height, self.top

    def centres(self, first: int, last: int) -> tuple[FloatArray, FloatArray]:
        """x, y of the centres of the pixels in some rows, shape (last - first, columns)."""
        x = self.left + (np.arange(self.columns) + 0.5) * self.width
        y = self.top - (np.arange(first, last) + 0.5) * self.height
        u, v = np.meshgrid(x, y)
        return u, v


def pixels(extent: Extent, bands: int, size: int | tuple[int, int] | None, resolution: float | None) -> Pixels:
    """The pixels of an extent.

    `size` is the number of pixels along the longer side, which are square then, or columns and
    rows; `resolution` the side of a pixel in the CRS's unit, on whose multiples the edges lie.
    """
    x0, y0, x1, y1 = extent
    width, height = x1 - x0, y1 - y0
    if resolution is not None:
        if size is not None:
            raise ValueError(f"Invalid size '{size}' with resolution '{resolution:g}'. It must be one of the two.")
        if not 0.0 < resolution < np.inf:
            raise ValueError(f"Invalid resolution '{resolution}'. It must be a positive number of the CRS's units.")
        west, east = _outward(x0, x1, resolution)
        south, north = _outward(y0, y1, resolution)
        _check_number((east - west) * (north - south) * bands, f"resolution '{resolution:g}'")
        return Pixels(
            left=west * resolution,
            top=north * resolution,
            width=resolution,
            height=resolution,
            rows=int(north - south),
            columns=int(east - west),
        )
    if isinstance(size, tuple):
        columns, rows = size
        _check_number(columns * rows * bands, f"size '{columns},{rows}'")
        return Pixels(left=x0, top=y1, width=width / columns, height=height / rows, rows=rows, columns=columns)
    longer = DEFAULT_SIZE if size is None else size
    if longer < 1:
        raise ValueError(f"Invalid size '{longer}'. It must be a positive number of pixels.")
    side = max(width, height) / longer
    columns, rows = (max(1, int(np.ceil(length / side - _WHOLE))) for length in (width, height))
    _check_number(columns * rows * bands, f"size '{longer}'")
    left, top = 0.5 * (x0 + x1 - columns * side), 0.5 * (y0 + y1 + rows * side)
    return Pixels(left=left, top=top, width=side, height=side, rows=rows, columns=columns)


def _outward(low: float, high: float, step: float) -> tuple[float, float]:
    """The multiples of a step, as whole numbers, between which an extent lies."""
    return float(np.floor(low / step + _WHOLE)), float(np.ceil(high / step - _WHOLE))


def _check_number(values: float, what: str) -> None:
    if not 1 <= values <= _MOST_VALUES:
        raise ValueError(f"Invalid {what}. It makes {values:.3g} values; there must be 1 to {_MOST_VALUES:.0e}.")


# ---- on a map's plane -----------------------------------------------------------------------


def plane_extent(projection: Projection, plane: Plane, region: Place) -> Extent:
    """The extent of a region on a map's plane; maps without end end where their pictures do."""
    x0, x1, y0, y1 = surface_of(projection, region).extent
    corners = np.array([[x0, x0, x1, x1], [y0, y1, y0, y1]])
    u, v = np.linalg.solve(plane.to_metres, corners)
    return float(u.min()), float(v.min()), float(u.max()), float(v.max())


@dataclass(frozen=True)
class OnPlane:
    """Coordinates of the map's own CRS; `side` is a pixel's in its unit."""

    projection: Projection
    plane: Plane
    side: float

    @property
    def wkt(self) -> str:
        """The CRS in WKT2."""
        return self.plane.wkt

    def places(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees; NaN where the map is not."""
        unit = float(np.abs(self.plane.to_metres).max())
        radius = self.projection.ellipsoid.a / unit
        tolerance = float(np.clip(_BACK * self.side, _BACK_LEAST * radius, _BACK_MOST * radius))
        return self.plane.inverse(u, v, tolerance)


# ---- on longitude and latitude --------------------------------------------------------------


def lonlat_extent(graticule: Graticule, region: Place) -> Extent:
    """The bounds of a region in a geographic CRS."""
    west, south, east, north = region.bounds
    u, v = graticule.coordinates(np.array([west, east]), np.array([south, north]))
    return float(u[0]), float(v[0]), float(u[1]), float(v[1])


@dataclass(frozen=True)
class OnGraticule:
    """Longitudes and latitudes of a geographic CRS."""

    graticule: Graticule

    @property
    def wkt(self) -> str:
        """The CRS in WKT2."""
        return self.graticule.wkt

    def places(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees; NaN beyond the poles, where edges on multiples of a resolution may lie."""
        lon, lat = self.graticule.degrees(u, v)
        outside = np.abs(lat) > 90.0
        return np.where(outside, np.nan, normalised(lon)), np.where(outside, np.nan, lat)


def graticule_grid(projection: Projection, region: Place) -> tuple[OnGraticule, Extent]:
    """The longitudes and latitudes of a map, and the extent of a region in them."""
    graticule = graticule_of(projection)
    return OnGraticule(graticule), lonlat_extent(graticule, region)
