"""Coordinates of other CRSs: of a map's plane, of its graticule, of data; geodesics and datum transformations."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Geod, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import BoolArray, FloatArray
from projdist.earth import MEAN_EARTH_RADIUS, WGS84, Ellipsoid
from projdist.projections import operations
from projdist.projections.catalogue import close_codes
from projdist.projections.crs import bounds_of, parse_crs, read_crs
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import base_crs, same_coordinates, unprojected
from projdist.projections.operations import CrsOperation
from projdist.projections.projection import Projection
from projdist.support import did_you_mean, shown

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
        candidate = Projection(*parse_crs(wkt))
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
        geodetic = operations.geographic_base(CRS.from_wkt(operation.crs))
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
        lon, lat = operations.transform(self.transformer, u, v)
        operations.check_grids(self.transformer, (u, v), lon)
        return self._degrees(lon, lat)

    def degrees_on_map(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `degrees`, and NaN outside the data's own map, where PROJ may still return something.

        Points that rounding puts beyond the edge of the map or across a seam are replaced by points 6 mm inside.
        """
        if self.tolerance == np.inf:
            return self.degrees(u, v)
        lon, lat, off_map = self._there_and_back(u, v, 0.0, 0.0)
        operations.check_grids(self.transformer, (u, v), lon)
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
        lon, lat = operations.transform(self.transformer, u + east * self.tolerance, v + north * self.tolerance)
        back_u, back_v = operations.transform(self.transformer, lon, lat, direction=TransformDirection.INVERSE)
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
    target = operations.geographic_base(CRS.from_wkt(operation.crs) if isinstance(operation, CrsOperation) else source)
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
        has_degrees=operations.has_plain_axes(source) and operations.units_per_degree(source) == 1.0,
        transformer=transformer,
        greenwich=operations.greenwich_offset(target),
        per_degree=operations.units_per_degree(target),
        tolerance=np.inf if of_angles else _BACK * projection.ellipsoid.a / unit,
    )


def geographic(projection: Projection, crs: Any, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitude and latitude in Greenwich degrees of points in a CRS, on the datum of the map; NaN where undefined.

    x, y are in GIS order. Raises ProjectionError as `data_crs_of` does.
    """
    return data_crs_of(projection, crs).degrees(x, y)


# ---- geodesy -------------------------------------------------------------------------------------


def crs_of(value: Any) -> CRS:
    """The CRS of anything that pyproj accepts; raises ValueError."""
    try:
        return read_crs(value)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError) as error:
        hint = did_you_mean(close_codes(value)) if isinstance(value, str) else ""
        raise ValueError(f"Invalid CRS '{shown(str(value))}'. {hint}It must be a CRS that PROJ knows.") from error


def area_of_use(value: Any) -> tuple[float, float, float, float]:
    """West, south, east, north in degrees of a CRS's area of use; raises ValueError if it states none."""
    crs = crs_of(value)
    bounds = bounds_of(crs)
    if bounds is None:
        raise ValueError(f"Invalid CRS '{shown(crs.name)}'. It must state an area of use.")
    return bounds


def ground_of(value: Any) -> Ellipsoid | None:
    """The ellipsoid on which regions in a CRS are measured; None if it states none; raises ValueError."""
    ellipsoid = operations.ellipsoid_of_crs(crs_of(value))
    return ellipsoid.ground if ellipsoid else None


def to_lonlat(value: Any) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]] | None:
    """Function from coordinates of a CRS to longitude and latitude; None if they are the same.

    The result is on WGS 84; on another body on the CRS's own datum, longitudes east, latitudes geodetic.
    """
    crs = crs_of(value)
    ground = ground_of(crs)
    if ground is not None and ground.is_of_another_body:
        return None if operations.has_plain_axes(crs) else functools.partial(unprojected, crs.to_wkt())
    if crs.equals(CRS("OGC:CRS84")) or crs.equals(CRS("EPSG:4326"), ignore_axis_order=True):
        return None
    try:
        transformer = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    except pyproj.exceptions.ProjError as error:
        raise ValueError(f"Invalid CRS '{shown(crs.name)}'. PROJ has no way from it to WGS 84.") from error

    def transform(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        lon, lat = (np.asarray(values) for values in transformer.transform(x, y))
        operations.check_grids(transformer, (x, y), lon)
        return lon, lat

    return transform


def geodesics(ring: FloatArray, ellipsoid: Ellipsoid) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
    """Curve along geodesics through vertices (m, 2) of a ring; vertex k is at parameter k."""
    geod = _geod(ellipsoid)
    lon, lat = ring.T
    azimuth, _, length = (np.asarray(values) for values in geod.inv(lon[:-1], lat[:-1], lon[1:], lat[1:]))

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.minimum(t.astype(int), len(azimuth) - 1)
        to_lon, to_lat, _ = geod.fwd(lon[k], lat[k], azimuth[k], length[k] * (t - k))
        # Vertices are returned exactly as given, so that a ring stays closed.
        vertex = t == np.floor(t)
        number = t.astype(int)
        return np.where(vertex, lon[number], to_lon), np.where(vertex, lat[number], to_lat)

    return curve


def geodesic_lengths(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, to_lon: FloatArray, to_lat: FloatArray
) -> FloatArray:
    """Lengths in metres of the geodesics between points in degrees, all of one shape."""
    return np.asarray(_geod(ellipsoid).inv(lon, lat, to_lon, to_lat)[2])


def geodesic_arrivals(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, to_lon: FloatArray, to_lat: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lengths in metres of the geodesics between points in degrees, and their azimuths at the end."""
    _, back, length = (np.asarray(values) for values in _geod(ellipsoid).inv(lon, lat, to_lon, to_lat))
    return length, back + 180.0


def geodesic_destination(
    ellipsoid: Ellipsoid, lon: float, lat: float, azimuth: float, length: float
) -> tuple[float, float, float]:
    """Longitude and latitude at the end of a geodesic of `length` metres, and its azimuth there, 0 to 360."""
    to_lon, to_lat, back = _geod(ellipsoid).fwd(lon, lat, azimuth, length)
    return float(to_lon), float(to_lat), float(back + 180.0) % 360.0


def geodesic_points(
    ellipsoid: Ellipsoid, ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray], shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n, k) at fractions (n, k) of geodesics.

    `ends` are longitudes and latitudes (n,) of the starts, then of the ends.
    """
    geod = _geod(ellipsoid)
    azimuth, _, length = geod.inv(*ends)
    lon, lat, azimuth, way = np.broadcast_arrays(
        ends[0][:, None], ends[1][:, None], azimuth[:, None], length[:, None] * shares
    )
    to_lon, to_lat, _ = geod.fwd(lon, lat, azimuth, way)
    return np.asarray(to_lon), np.asarray(to_lat)


def geodesic_courses(
    ellipsoid: Ellipsoid, ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray], way: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Longitudes, latitudes and azimuths (n,) at distances `way` (n,) in metres from the starts of n geodesics.

    `ends` are as for `geodesic_points`; azimuths are in degrees clockwise from north, within -180 and 180.
    """
    geod = _geod(ellipsoid)
    azimuth, _, _ = geod.inv(*ends)
    lon, lat, back = (np.asarray(values) for values in geod.fwd(ends[0], ends[1], azimuth, way))
    return lon, lat, np.where(back > 0.0, back - 180.0, back + 180.0)


def _geod(ellipsoid: Ellipsoid) -> Geod:
    return Geod(a=ellipsoid.a, f=ellipsoid.f)


# ---- datum transformations -----------------------------------------------------------------------


@dataclass(frozen=True)
class DatumTransformation:
    """A datum transformation at a place: the difference of coordinates and PROJ's accuracy, both in metres.

    Both are NaN if unknown, for example because a grid is not installed.
    """

    source: str
    target: str
    metres: float
    accuracy: float

    def __str__(self) -> str:
        """One sentence."""
        change = f"The datum changes from {self.source} to {self.target}"
        if not np.isfinite(self.metres):
            return f"{change}; by how much is not known to PROJ here."
        sure = f", to {self.accuracy:g} m" if np.isfinite(self.accuracy) else ""
        return f"{change}: coordinates of the same place differ by {self.metres:.3g} m{sure}."


def datum_transformation(source: Any, target: Any, lon: float, lat: float) -> DatumTransformation | None:
    """The datum transformation between two CRSs at a place in Greenwich degrees; None if the datum is the same."""
    one, other = (CRS.from_user_input(crs).geodetic_crs for crs in (source, target))
    if one is None or other is None or _datum_name(one) == _datum_name(other):
        return None
    one, other = one.to_2d(), other.to_2d()
    try:
        # Ballpark transformations ignore the change of datum: their difference of 0 would be wrong.
        transformer = Transformer.from_crs(one, other, always_xy=True, allow_ballpark=False)
        u = (lon - operations.greenwich_offset(one)) * operations.units_per_degree(one)
        x, y = transformer.transform(u, lat * operations.units_per_degree(one), errcheck=True)
    except pyproj.exceptions.ProjError:
        return DatumTransformation(one.name, other.name, np.nan, np.nan)
    east, north = (
        x / operations.units_per_degree(other) + operations.greenwich_offset(other),
        y / operations.units_per_degree(other),
    )
    geod = other.get_geod()
    assert geod is not None  # of a geodetic CRS
    metres = geod.inv(lon, lat, east, north)[2]
    accuracy = transformer.accuracy
    if accuracy < 0.0:  # several operations: that of the one last used
        with contextlib.suppress(pyproj.exceptions.ProjError):
            accuracy = transformer.get_last_used_operation().accuracy
    return DatumTransformation(one.name, other.name, float(metres), accuracy if accuracy >= 0.0 else np.nan)


def kept_datum(crs: Any) -> str:
    """Name of the geodetic CRS whose datum the data in a CRS should keep.

    "" for longitudes and latitudes of WGS 84, in which data of any datum are exchanged.
    """
    given = CRS.from_user_input(crs)
    geodetic = given.geodetic_crs
    if geodetic is None or (given.is_geographic and _datum_name(geodetic) == _datum_name(CRS.from_epsg(4326))):
        return ""
    return geodetic.name


def keeps_datum(source: Any, target: Any) -> bool:
    """True if two CRSs have the same datum."""
    one, other = (CRS.from_user_input(crs).geodetic_crs for crs in (source, target))
    return one is not None and other is not None and _datum_name(one) == _datum_name(other)


def _datum_name(crs: CRS) -> str:
    """Name of a datum or datum ensemble, without the suffix that only databases add."""
    name = crs.datum.name if crs.datum is not None else crs.name
    return name.removesuffix(" ensemble")
