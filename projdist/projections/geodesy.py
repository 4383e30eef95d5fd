"""Coordinates of other CRSs, geodesics and datum transformations, by pyproj."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Geod, Transformer

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.catalogue import close_codes
from projdist.projections.crs import bounds_of, read_crs
from projdist.projections.errors import ProjectionError
from projdist.projections.exports import unprojected
from projdist.projections.operations import (
    check_grids,
    ellipsoid_of_crs,
    greenwich_offset,
    has_plain_axes,
    units_per_degree,
)
from projdist.support import did_you_mean, shown


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
    ellipsoid = ellipsoid_of_crs(crs_of(value))
    return ellipsoid.ground if ellipsoid else None


def to_lonlat(value: Any) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]] | None:
    """Function from coordinates of a CRS to longitude and latitude; None if they are the same.

    The result is on WGS 84; on another body on the CRS's own datum, longitudes east, latitudes geodetic.
    """
    crs = crs_of(value)
    ground = ground_of(crs)
    if ground is not None and ground.is_of_another_body:
        return None if has_plain_axes(crs) else functools.partial(unprojected, crs.to_wkt())
    if crs.equals(CRS("OGC:CRS84")) or crs.equals(CRS("EPSG:4326"), ignore_axis_order=True):
        return None
    try:
        transformer = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    except pyproj.exceptions.ProjError as error:
        raise ValueError(f"Invalid CRS '{shown(crs.name)}'. PROJ has no way from it to WGS 84.") from error

    def transform(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        lon, lat = (np.asarray(values) for values in transformer.transform(x, y))
        check_grids(transformer, (x, y), lon)
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
        u = (lon - greenwich_offset(one)) * units_per_degree(one)
        x, y = transformer.transform(u, lat * units_per_degree(one), errcheck=True)
    except pyproj.exceptions.ProjError:
        return DatumTransformation(one.name, other.name, np.nan, np.nan)
    east, north = x / units_per_degree(other) + greenwich_offset(other), y / units_per_degree(other)
    geod = other.get_geod()
    assert geod is not None  # of a geodetic CRS
    metres = geod.inv(lon, lat, east, north)[2]
    return DatumTransformation(one.name, other.name, float(metres), _accuracy(transformer))


def _accuracy(transformer: Transformer) -> float:
    """Accuracy in metres of a used transformer, from the registry; NaN if unknown."""
    accuracy = transformer.accuracy
    if accuracy < 0.0:  # several operations: that of the one last used
        with contextlib.suppress(pyproj.exceptions.ProjError):
            accuracy = transformer.get_last_used_operation().accuracy
    return accuracy if accuracy >= 0.0 else np.nan


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
