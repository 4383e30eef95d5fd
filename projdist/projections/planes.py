"""Projections as GIS programs have them: the CRS of a map's plane, of its longitudes and latitudes, and of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer

from projdist._typing import FloatArray
from projdist.ellipsoid import MEAN_EARTH_RADIUS, WGS84
from projdist.projections.crs import greenwich_offset, units_per_degree
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import base_crs, same_coordinates
from projdist.projections.operations import CrsOperation, transform
from projdist.projections.projection import Projection

_SAME_ELLIPSOID = 1e-6  # of its figures: GRS 80 and WGS 84 are one here, WGS 72 is another
_EARTHLY = 2e-3  # of the radius: spheres for the Earth have 6370 to 6378 km


@dataclass(frozen=True)
class Plane:
    """The plane of a map that is a CRS: coordinates u, v of that CRS, in the order in which GIS programs have them.

    `wkt` is the 2-D CRS in WKT2.
    """

    wkt: str
    operation: CrsOperation

    @property
    def to_metres(self) -> FloatArray:
        """The matrix (2, 2) from u, v to the metres east and north of the projection."""
        return np.array(self.operation.axes)

    @property
    def has_inverse(self) -> bool:
        """Whether PROJ has the inverse projection."""
        return bool(self.operation.transformer.has_inverse)

    def inverse(self, u: FloatArray, v: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude in Greenwich degrees; NaN where they do not come back to u, v within `tolerance`."""
        lon, lat = self.operation.inverse(u, v)
        back_u, back_v = self.operation.native(lon, lat)
        with np.errstate(invalid="ignore"):  # infinite where there is no inverse
            on_map = np.hypot(back_u - u, back_v - v) <= tolerance
        return np.where(on_map, lon, np.nan), np.where(on_map, lat, np.nan)


def plane_of(projection: Projection) -> Plane | None:
    """The CRS of a map's plane; None for functions and for maps whose CRS in PROJ is another map, as Winkel Tripel's.

    The CRS made for a PROJ string is compared with the map before it is taken for one.
    """
    crs = base_crs(projection)
    if crs is None:
        return None
    if isinstance(projection.function, CrsOperation):
        return Plane(crs.to_wkt(), projection.function)
    candidate = same_map(projection, crs.to_wkt())
    return Plane(crs.to_wkt(), candidate) if candidate else None


def same_map(projection: Projection, wkt: str) -> CrsOperation | None:
    """The operation of a projected CRS that is the same map as a projection, else None."""
    try:
        candidate = Projection.from_user_input(wkt)
    except ProjectionError:
        return None
    function = candidate.function
    return function if isinstance(function, CrsOperation) and same_coordinates(projection, candidate) else None


@dataclass(frozen=True)
class Graticule:
    """A geographic CRS for the longitudes and latitudes of a map: its WKT2, and what relates it to Greenwich degrees.

    `operation` is None where its coordinates are Greenwich degrees.
    """

    wkt: str
    operation: CrsOperation | None

    def coordinates(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the CRS, longitude first, of Greenwich degrees."""
        return (lon, lat) if self.operation is None else self.operation.geodetic(lon, lat)

    def degrees(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees of coordinates of the CRS, longitude first."""
        return (u, v) if self.operation is None else self.operation.degrees(u, v)


def graticule_of(projection: Projection) -> Graticule:
    """The geographic CRS of a map's longitudes and latitudes.

    A CRS has its own. The others state no datum: on WGS 84's ellipsoid and on spheres for the Earth
    they are taken for WGS 84's, on other ellipsoids for those of an unknown datum.
    """
    operation = projection.function
    if isinstance(operation, CrsOperation):
        geodetic = CRS.from_wkt(operation.crs).geodetic_crs
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


def geographic(projection: Projection, crs: Any, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitude and latitude in Greenwich degrees of points in a CRS, on the datum of the map; NaN where undefined.

    x, y are in the order of GIS programs. A map that states no datum (a name, a PROJ string, a
    function) takes the points' own longitudes and latitudes. Raises ProjectionError for a CRS
    that is none of the Earth's surface, or of another body.
    """
    source = CRS.from_user_input(crs)
    operation = projection.function
    target = CRS.from_wkt(operation.crs).geodetic_crs if isinstance(operation, CrsOperation) else source.geodetic_crs
    if target is None:
        raise ProjectionError(f"Invalid CRS '{source.name}' of points. It has no longitudes and latitudes.")
    try:
        lon, lat = transform(Transformer.from_crs(source, target, always_xy=True), x, y)
    except pyproj.exceptions.ProjError as error:
        raise ProjectionError(
            f"Invalid CRS '{source.name}' of points. PROJ has no way from it to {target.name}."
        ) from error
    per_degree = units_per_degree(target)
    lon, lat = lon / per_degree + greenwich_offset(target), lat / per_degree
    undefined = ~(np.isfinite(lon) & np.isfinite(lat))
    return np.where(undefined, np.nan, lon), np.where(undefined, np.nan, lat)
