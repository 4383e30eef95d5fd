"""CRSs for GIS programs: that of a map's plane, of its longitudes and latitudes, and of data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import BoolArray, FloatArray
from projdist.earth import MEAN_EARTH_RADIUS, WGS84
from projdist.projections.crs import parse_crs, read_crs
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import base_crs, same_coordinates
from projdist.projections.operations import (
    CrsOperation,
    check_grids,
    geographic_base,
    greenwich_offset,
    has_plain_axes,
    transform,
    units_per_degree,
)
from projdist.projections.projection import Projection

_SAME_ELLIPSOID = 1e-6  # relative: GRS 80 and WGS 84 are equal, WGS 72 is not
_BACK = 1e-6  # of the Earth's radius: inverses are accurate to centimetres or better
_INSIDE = 1e-3  # of that, 6 mm
_EARTHLY = 2e-3  # of the radius: spheres for the Earth have 6370 to 6378 km


@dataclass(frozen=True)
class ProjectedCrs:
    """The projected CRS of a map, with coordinates u, v in GIS order (x, y).

    `wkt` is the 2-D CRS in WKT2.
    """

    wkt: str
    operation: CrsOperation

    @property
    def to_metres(self) -> FloatArray:
        """Matrix (2, 2) from u, v to the projection's metres east and north."""
        return np.array(self.operation.axes)

    @property
    def has_inverse(self) -> bool:
        """True if PROJ has the inverse projection."""
        return bool(self.operation.transformer.has_inverse)

    def inverse(self, u: FloatArray, v: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude in Greenwich degrees; NaN if they do not map back to u, v within `tolerance`."""
        lon, lat = self.operation.inverse(u, v)
        back_u, back_v = self.operation.native(lon, lat)
        with np.errstate(invalid="ignore"):  # infinite where there is no inverse
            on_map = np.hypot(back_u - u, back_v - v) <= tolerance
        return np.where(on_map, lon, np.nan), np.where(on_map, lat, np.nan)


def projected_crs_of(projection: Projection) -> ProjectedCrs | None:
    """The projected CRS of a map; None for functions and for maps whose CRS in PROJ is another map, as Winkel Tripel's.

    A CRS made of a PROJ string is compared with the map first.
    """
    crs = base_crs(projection)
    if crs is None:
        return None
    if isinstance(projection.function, CrsOperation):
        return ProjectedCrs(crs.to_wkt(), projection.function)
    candidate = same_map(projection, crs.to_wkt())
    return ProjectedCrs(crs.to_wkt(), candidate) if candidate else None


def same_map(projection: Projection, wkt: str) -> CrsOperation | None:
    """The operation of a projected CRS if it is the same map as a projection, else None."""
    try:
        candidate = Projection(*parse_crs(wkt, registered=False))
    except ProjectionError:
        return None
    function = candidate.function
    return function if isinstance(function, CrsOperation) and same_coordinates(projection, candidate) else None


@dataclass(frozen=True)
class Graticule:
    """The geographic CRS of a map's longitudes and latitudes, in WKT2.

    `operation` converts to and from Greenwich degrees; None if the coordinates are Greenwich degrees.
    """

    wkt: str
    operation: CrsOperation | None

    def coordinates(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees to coordinates of the CRS, longitude first."""
        return (lon, lat) if self.operation is None else self.operation.geodetic(lon, lat)

    def degrees(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the CRS, longitude first, to Greenwich degrees."""
        return (u, v) if self.operation is None else self.operation.degrees(u, v)


def graticule_of(projection: Projection) -> Graticule:
    """The geographic CRS of a map's longitudes and latitudes.

    A CRS has its own. Other maps state no datum: WGS 84 is assumed on its ellipsoid and on Earth spheres, an unknown
    datum on other ellipsoids.
    """
    operation = projection.function
    if isinstance(operation, CrsOperation):
        geodetic = geographic_base(CRS.from_wkt(operation.crs))
        if geodetic is not None:
            return Graticule(geodetic.to_2d().to_wkt(), operation)
    ellipsoid = projection.ellipsoid
    if ellipsoid.is_sphere:
        wgs84 = abs(ellipsoid.a / MEAN_EARTH_RADIUS - 1.0) < _EARTHLY
    else:
        figures = np.array([ellipsoid.a / WGS84.a, ellipsoid.f / WGS84.f])
        wgs84 = bool((np.abs(figures - 1.0) < _SAME_ELLIPSOID).all())
    if wgs84:
        return Graticule(CRS.from_epsg(4326).to_wkt(), None)
    b = ellipsoid.a * (1.0 - ellipsoid.f)
    return Graticule(CRS.from_user_input(f"+proj=longlat +a={ellipsoid.a!r} +b={b!r} +type=crs").to_wkt(), None)


@dataclass(frozen=True, kw_only=True)
class DataCrs:
    """The CRS of data, with coordinates u, v in GIS order, and the transformation to the datum of a map.

    `has_degrees` is True if u, v are longitudes and latitudes in degrees.
    """

    name: str
    has_degrees: bool
    transformer: Transformer
    greenwich: float
    per_degree: float
    tolerance: float  # in the unit of u, v; infinite for longitudes and latitudes, which are not mapped back

    def degrees(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude in Greenwich degrees on the datum of the map; NaN where undefined."""
        lon, lat = transform(self.transformer, u, v)
        check_grids(self.transformer, (u, v), lon)
        return self._degrees(lon, lat)

    def degrees_on_map(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `degrees`, and NaN outside the data's own map, where PROJ may still return something.

        Points that rounding puts beyond the edge of the map or across a seam are replaced by points 6 mm inside.
        """
        if self.tolerance == np.inf:
            return self.degrees(u, v)
        lon, lat, off_map = self._there_and_back(u, v, 0.0, 0.0)
        check_grids(self.transformer, (u, v), lon)
        for east, north in ((-_INSIDE, 0.0), (_INSIDE, 0.0), (0.0, -_INSIDE), (0.0, _INSIDE)):
            if not off_map.any():
                break
            lon[off_map], lat[off_map], still = self._there_and_back(u[off_map], v[off_map], east, north)
            off_map[off_map] = still
        lon[off_map] = np.nan
        return self._degrees(lon, lat)

    def _there_and_back(
        self, u: FloatArray, v: FloatArray, east: float, north: float
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Datum coordinates of points offset by parts of the tolerance, and a mask of those that do not map back."""
        lon, lat = transform(self.transformer, u + east * self.tolerance, v + north * self.tolerance)
        back_u, back_v = transform(self.transformer, lon, lat, direction=TransformDirection.INVERSE)
        with np.errstate(invalid="ignore"):
            return lon, lat, np.asarray(~(np.hypot(back_u - u, back_v - v) <= self.tolerance))

    def _degrees(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        lon, lat = lon / self.per_degree + self.greenwich, lat / self.per_degree
        undefined = ~(np.isfinite(lon) & np.isfinite(lat))
        return np.where(undefined, np.nan, lon), np.where(undefined, np.nan, lat)


def data_crs_of(projection: Projection, crs: Any, thing: str = "points") -> DataCrs:
    """The CRS of data with its transformation to the datum of a map.

    For a map without a datum (a name, a PROJ string, a function) the data keep their own longitudes and latitudes.
    Raises ProjectionError for a CRS without longitudes and latitudes or of another body; `thing` names the data in
    the message.
    """
    source = read_crs(crs)
    operation = projection.function
    target = geographic_base(CRS.from_wkt(operation.crs) if isinstance(operation, CrsOperation) else source)
    if target is None:
        raise ProjectionError(f"Invalid CRS '{source.name}' of {thing}. It has no longitudes and latitudes.")
    try:
        transformer = Transformer.from_crs(source, target, always_xy=True)
    except pyproj.exceptions.ProjError as error:
        raise ProjectionError(
            f"Invalid CRS '{source.name}' of {thing}. PROJ has no way from it to {target.name}."
        ) from error
    unit = source.axis_info[0].unit_conversion_factor if source.axis_info else 1.0
    of_angles = source.is_geographic or source.type_name == "Geodetic CRS"
    return DataCrs(
        name=source.name,
        has_degrees=has_plain_axes(source) and units_per_degree(source) == 1.0,
        transformer=transformer,
        greenwich=greenwich_offset(target),
        per_degree=units_per_degree(target),
        tolerance=np.inf if of_angles else _BACK * projection.ellipsoid.a / unit,
    )


def geographic(projection: Projection, crs: Any, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitude and latitude in Greenwich degrees of points in a CRS, on the datum of the map; NaN where undefined.

    x, y are in GIS order. Raises ProjectionError as `data_crs_of` does.
    """
    return data_crs_of(projection, crs).degrees(x, y)
