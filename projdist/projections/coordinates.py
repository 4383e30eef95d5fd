"""Coordinates of a map's plane, of its graticule and of data; geodesics, geoid heights, datum transformations."""

import contextlib
import functools
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyproj.datadir
import pyproj.exceptions
from pyproj import CRS, Geod, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import AnyPath, ArrayLike, BoolArray, FloatArray
from projdist.earth import MEAN_EARTH_RADIUS, WGS84, Ellipsoid
from projdist.projections import catalogue, operations
from projdist.projections.crs import bounds_of, read_crs
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import base_crs, same_coordinates, unprojected
from projdist.projections.operations import CrsOperation, GeographicAxes
from projdist.projections.projection import Projection
from projdist.support import did_you_mean, listed, shown, tell

_SAME_ELLIPSOID = 1e-6  # relative: GRS 80 and WGS 84 are equal, WGS 72 is not
_BACK = 1e-6  # of the Earth's radius: inverses are accurate to centimetres or better
_INSIDE = 1e-3  # of that tolerance: 6 mm
_EARTHLY = 2e-3  # of the radius: spheres for the Earth have 6370 to 6378 km


@dataclass(frozen=True)
class ProjectedCrs:
    """The projected CRS of a map, 2-D in WKT2, with coordinates u, v in GIS order (x, y)."""

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
    """The projected CRS of a map; None for functions and for maps whose CRS in PROJ is another map (Winkel Tripel)."""
    crs, function = base_crs(projection), projection.function
    if crs is None:
        return None
    operation = function if isinstance(function, CrsOperation) else same_map(projection, crs.to_wkt())
    return ProjectedCrs(crs.to_wkt(), operation) if operation else None


def same_map(projection: Projection, wkt: str) -> CrsOperation | None:
    """The operation of a projected CRS if it is the same map as a projection, else None."""
    try:
        candidate = Projection.from_user_input(wkt)
    except ProjectionError:
        return None
    function = candidate.function
    return function if isinstance(function, CrsOperation) and same_coordinates(projection, candidate) else None


class Graticule(NamedTuple):
    """The geographic CRS of a map's longitudes and latitudes, in WKT2, and how it counts them."""

    wkt: str
    angles: GeographicAxes


def graticule_of(projection: Projection) -> Graticule:
    """The geographic CRS of a map's longitudes and latitudes: its own, or an assumed one if it states no datum."""
    # Assumed is WGS 84 on its ellipsoid and on Earth spheres, an unknown datum on other ellipsoids.
    operation = projection.function
    if isinstance(operation, CrsOperation):
        geodetic = operations.geographic_base(CRS.from_wkt(operation.crs))
        if geodetic is not None:
            return Graticule(geodetic.to_2d().to_wkt(), operation.angles)
    a, f = projection.ellipsoid.a, projection.ellipsoid.f
    if projection.ellipsoid.is_sphere:
        is_wgs84 = abs(a / MEAN_EARTH_RADIUS - 1.0) < _EARTHLY
    else:
        is_wgs84 = max(abs(a / WGS84.a - 1.0), abs(f / WGS84.f - 1.0)) < _SAME_ELLIPSOID
    own = "EPSG:4326" if is_wgs84 else f"+proj=longlat +a={a!r} +b={a * (1.0 - f)!r} +type=crs"
    return Graticule(CRS.from_user_input(own).to_wkt(), GeographicAxes())


@dataclass(frozen=True, kw_only=True)
class DataCrs:
    """The CRS of data u, v in GIS order, perhaps degrees, and the transformation to the datum of a map."""

    name: str
    has_degrees: bool
    transformer: Transformer
    angles: GeographicAxes
    tolerance: float  # in the unit of u, v; infinite for longitudes and latitudes, which are not mapped back

    def degrees(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitude and latitude in Greenwich degrees on the datum of the map; NaN where undefined."""
        lon, lat = operations.transform(self.transformer, u, v)
        operations.check_grids(self.transformer, (u, v), lon)
        return self._degrees(lon, lat)

    def degrees_on_map(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `degrees`, and NaN outside of the data's own map, where PROJ may still return something."""
        # Points that rounding puts beyond the edge of the map or across a seam are replaced by points 6 mm inside.
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
        """Datum coordinates of points offset by shares of the tolerance, and a mask of those that do not map back."""
        lon, lat = operations.transform(self.transformer, u + east * self.tolerance, v + north * self.tolerance)
        back_u, back_v = operations.transform(self.transformer, lon, lat, direction=TransformDirection.INVERSE)
        with np.errstate(invalid="ignore"):
            return lon, lat, np.asarray(~(np.hypot(back_u - u, back_v - v) <= self.tolerance))

    def _degrees(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        lon, lat = self.angles.to_degrees(lon, lat)
        undefined = ~(np.isfinite(lon) & np.isfinite(lat))
        return np.where(undefined, np.nan, lon), np.where(undefined, np.nan, lat)


def data_crs_of(projection: Projection, crs: Any, thing: str = "points") -> DataCrs:
    """The CRS of data (`thing` in messages), with its transformation to the datum of a map; raises ProjectionError."""
    # For a map without a datum (a name, a PROJ string, a function) the data keep their own longitudes and latitudes.
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
        has_degrees=operations.has_plain_axes(source) and GeographicAxes.of(source).per_degree == 1.0,
        transformer=transformer,
        angles=GeographicAxes.of(target),
        tolerance=np.inf if of_angles else _BACK * projection.ellipsoid.a / unit,
    )


# ---- geodesy -------------------------------------------------------------------------------------


def crs_of(value: Any) -> CRS:
    """The CRS of anything that pyproj accepts; raises ValueError."""
    try:
        return read_crs(value)
    except (pyproj.exceptions.CRSError, TypeError) as error:
        hint = did_you_mean(catalogue.close_codes(value)) if isinstance(value, str) else ""
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
    """Function from coordinates of a CRS to longitude and latitude; None if they are the same."""
    # The result is on WGS 84; on another body on the CRS's own datum, longitudes east, latitudes geodetic.
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
    lon, lat = ring.T
    length, azimuth, _ = geodesic_inverse(ellipsoid, lon[:-1], lat[:-1], lon[1:], lat[1:])

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        number = t.astype(int)
        k = np.minimum(number, len(azimuth) - 1)
        to_lon, to_lat, _ = geodesic_direct(ellipsoid, lon[k], lat[k], azimuth[k], length[k] * (t - k))
        vertex = t == np.floor(t)  # returned exactly as given, so that a ring stays closed
        return np.where(vertex, lon[number], to_lon), np.where(vertex, lat[number], to_lat)

    return curve


def geodesic_inverse(
    ellipsoid: Ellipsoid, lon: ArrayLike, lat: ArrayLike, to_lon: ArrayLike, to_lat: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lengths in metres of the geodesics between points in degrees, and their azimuths at start and end."""
    lon, lat, to_lon, to_lat = np.broadcast_arrays(lon, lat, to_lon, to_lat)
    azimuth, back, length = Geod(a=ellipsoid.a, f=ellipsoid.f).inv(lon, lat, to_lon, to_lat)
    return np.asarray(length), np.asarray(azimuth), np.asarray(back) + 180.0


def geodesic_direct(
    ellipsoid: Ellipsoid, lon: ArrayLike, lat: ArrayLike, azimuth: ArrayLike, length: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Longitudes and latitudes at the ends of geodesics of `length` metres, and their azimuths there, -180 to 180."""
    lon, lat, azimuth, length = np.broadcast_arrays(lon, lat, azimuth, length)
    ends = Geod(a=ellipsoid.a, f=ellipsoid.f).fwd(lon, lat, azimuth, length)
    to_lon, to_lat, back = (np.asarray(values) for values in ends)
    return to_lon, to_lat, np.where(back > 0.0, back - 180.0, back + 180.0)


# ---- geoid heights -------------------------------------------------------------------------------

_GRID = re.compile(r"[\w.-]+\.\w+")  # a name in PROJ's folders: none of its marks for lists and optional grids


def geoid_heights(grid: AnyPath, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Geoid heights N in metres at points in degrees, so that h = H + N; of a file, or of a grid in PROJ's folders."""
    given, is_file = str(grid), os.path.isfile(grid)
    text = str(Path(grid).resolve()) if is_file else given
    complaint = f"Invalid geoid '{shown(given)}'."
    if is_file and set(text) & set(',"'):
        raise ValueError(f"{complaint} PROJ takes no path with a comma or a quotation mark.")
    if not is_file and not _GRID.fullmatch(given):
        raise ValueError(f"{complaint} There is no such file; it must be a grid, or the name of one of PROJ's.")
    try:
        transformer = Transformer.from_pipeline(f'+proj=vgridshift +grids="{text}" +multiplier=1')
    except pyproj.exceptions.ProjError as error:
        if is_file:
            raise ValueError(f"{complaint} PROJ reads no geoid heights in it; it must be a .gtx or .tif.") from error
        folders = listed([pyproj.datadir.get_user_data_dir(), pyproj.datadir.get_data_dir()], "and")  # type: ignore[attr-defined]
        help = f"Fetch it with 'projsync --file {given}', or give the path of a file."
        raise ValueError(f"{complaint} PROJ finds no such grid in {folders}. {help}") from error
    found = np.asarray(transformer.transform(lon, lat, np.zeros(lon.size))[2])
    outside = np.flatnonzero(~np.isfinite(found))
    if outside.size:
        place = f"{lon[outside[0]]:.4f},{lat[outside[0]]:.4f}"
        raise ValueError(f"{complaint} It has no height at {place}, one of {outside.size:,} such points.")
    return found


# ---- datum transformations -----------------------------------------------------------------------


@dataclass(frozen=True)
class DatumTransformation:
    """A datum transformation at a place: difference of coordinates and PROJ's accuracy in metres, NaN if unknown."""

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
    if one is None or other is None or keeps_datum(one, other):
        return None
    one, other = one.to_2d(), other.to_2d()
    try:
        # Ballpark transformations ignore the change of datum: their difference of 0 would be wrong.
        transformer = Transformer.from_crs(one, other, always_xy=True, allow_ballpark=False)
        x, y = transformer.transform(*GeographicAxes.of(one).from_degrees(lon, lat), errcheck=True)
    except pyproj.exceptions.ProjError:
        return DatumTransformation(one.name, other.name, np.nan, np.nan)
    east, north = GeographicAxes.of(other).to_degrees(x, y)
    geod = other.get_geod()
    assert geod is not None  # of a geodetic CRS
    metres = geod.inv(lon, lat, east, north)[2]
    accuracy = transformer.accuracy
    if accuracy < 0.0:  # several operations: that of the one last used
        with contextlib.suppress(pyproj.exceptions.ProjError):
            accuracy = transformer.get_last_used_operation().accuracy
    return DatumTransformation(one.name, other.name, float(metres), accuracy if accuracy >= 0.0 else np.nan)


def kept_datum(crs: Any) -> str:
    """Name of the geodetic CRS whose datum data should keep; "" for WGS 84's degrees, in which any are exchanged."""
    given = CRS.from_user_input(crs)
    exchanged = given.is_geographic and keeps_datum(given, "EPSG:4326")
    return "" if given.geodetic_crs is None or exchanged else given.geodetic_crs.name


def keeps_datum(source: Any, target: Any) -> bool:
    """True if two CRSs have the same datum, by name, without the suffix of ensembles that only databases add."""
    one, other = (CRS.from_user_input(crs).geodetic_crs for crs in (source, target))
    if one is None or other is None:
        return False
    names = [(crs.datum.name if crs.datum is not None else crs.name) for crs in (one, other)]
    return names[0].removesuffix(" ensemble") == names[1].removesuffix(" ensemble")


# ---- data that look like degrees ------------------------------------------------------------------

_TURN, _POLE = 360.0, 90.0  # degrees: bounds of longitudes and latitudes in data
_LARGEST_UNIT = 10.0  # metres: in a projected CRS in kilometres a whole country may have numbers as small as degrees
_SMALLEST_BODY = 1e3  # metres


def tell_of_degrees(crs: Any, bounds: ArrayLike, thing: str, one: str = "feature") -> None:
    """Warn if features of data in a projected CRS, with `bounds` (n, 4) of x, y (NaN if empty), look like degrees."""
    # Units above 10 m, bodies as small as a unit sphere and points at 0, 0 are exempt: their numbers are small anyway.
    stated = crs_of(crs)
    unit = stated.axis_info[0] if stated.axis_info else None
    small = stated.ellipsoid is None or stated.ellipsoid.semi_major_metre < _SMALLEST_BODY
    if not stated.is_projected or unit is None or unit.unit_conversion_factor > _LARGEST_UNIT or small:
        return
    x0, y0, x1, y1 = np.asarray(bounds, dtype=float).reshape(-1, 4).T
    east, north = np.maximum(np.abs(x0), np.abs(x1)), np.maximum(np.abs(y0), np.abs(y1))
    found = (np.maximum(east, north) <= _TURN) & (np.minimum(east, north) <= _POLE) & (np.maximum(east, north) > 0.0)
    if found.any():
        k = int(np.argmax(found))
        tell(
            f"{int(found.sum())} of {len(found)} {one}(s) of {thing} look like degrees, as that at {x0[k]:.6g}, "
            f"{y0[k]:.6g}, but {stated.name} is in units of {unit.unit_name}: is that their CRS?"
        )


def tell_of_frame_in_degrees(frame: Any, thing: str) -> None:
    """`tell_of_degrees` for a GeoDataFrame or GeoSeries with a CRS."""
    if frame.crs is not None and frame.crs.is_projected:
        tell_of_degrees(frame.crs, frame.geometry.bounds.to_numpy(), thing)
