"""What needs pyproj besides maps: coordinates of other CRSs, geodesics, and areas of use."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Geod, Transformer

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.crs import bounds_of, read_crs
from projdist.projections.datums import has_plain_axes
from projdist.projections.definitions import unprojected
from projdist.projections.errors import ProjectionError
from projdist.projections.grids import check_grids
from projdist.projections.hints import close_codes
from projdist.support import did_you_mean, shown


def crs_of(value: Any) -> CRS:
    """The CRS of whatever pyproj takes; raises ValueError."""
    try:
        return read_crs(value)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError) as error:
        hint = did_you_mean(close_codes(value)) if isinstance(value, str) else ""
        raise ValueError(f"Invalid CRS '{shown(str(value))}'. {hint}It must be a CRS that PROJ knows.") from error


def area_of_use(value: Any) -> tuple[float, float, float, float]:
    """West, south, east, north of the area that a CRS is for, in degrees; raises ValueError where it states none."""
    crs = crs_of(value)
    bounds = bounds_of(crs)
    if bounds is None:
        raise ValueError(f"Invalid CRS '{shown(crs.name)}'. It must state an area of use.")
    return bounds


def ground_of(value: Any) -> Ellipsoid | None:
    """The figure on which regions in a CRS are measured, None where it states none; raises ValueError."""
    figure = crs_of(value).ellipsoid
    if figure is None:
        return None
    rf = figure.inverse_flattening
    return Ellipsoid(figure.semi_major_metre, 1.0 / rf if rf else 0.0).ground


def to_lonlat(value: Any) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]] | None:
    """The function from coordinates of a CRS to longitude and latitude; None for a CRS that has these.

    They are WGS 84's, and on another body those of its own datum, longitudes east and latitudes geodetic.
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
    """The geodesics of an ellipsoid from vertex to vertex (m, 2), as a curve: vertex k is at the parameter k."""
    geod = _geod(ellipsoid)
    lon, lat = ring.T
    azimuth, _, length = (np.asarray(values) for values in geod.inv(lon[:-1], lat[:-1], lon[1:], lat[1:]))

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        k = np.minimum(t.astype(int), len(azimuth) - 1)
        to_lon, to_lat, _ = geod.fwd(lon[k], lat[k], azimuth[k], length[k] * (t - k))
        # A vertex is what was given, to the last bit: a ring ends where it begins.
        vertex = t == np.floor(t)
        number = t.astype(int)
        return np.where(vertex, lon[number], to_lon), np.where(vertex, lat[number], to_lat)

    return curve


def geodesic_lengths(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, to_lon: FloatArray, to_lat: FloatArray
) -> FloatArray:
    """The lengths in metres of the geodesics between points in degrees, all of one shape."""
    return np.asarray(_geod(ellipsoid).inv(lon, lat, to_lon, to_lat)[2])


def geodesic_arrivals(
    ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray, to_lon: FloatArray, to_lat: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The lengths in metres of the geodesics between points in degrees, and their azimuths where they end."""
    _, back, length = (np.asarray(values) for values in _geod(ellipsoid).inv(lon, lat, to_lon, to_lat))
    return length, back + 180.0


def geodesic_destination(
    ellipsoid: Ellipsoid, lon: float, lat: float, azimuth: float, length: float
) -> tuple[float, float, float]:
    """Longitude and latitude at the end of a geodesic of so many metres, and its azimuth there within 0 and 360."""
    to_lon, to_lat, back = _geod(ellipsoid).fwd(lon, lat, azimuth, length)
    return float(to_lon), float(to_lat), float(back + 180.0) % 360.0


def geodesic_points(
    ellipsoid: Ellipsoid, ends: tuple[FloatArray, FloatArray, FloatArray, FloatArray], shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n, k) at shares (n, k) of the way along geodesics.

    `ends` are the longitudes and latitudes (n,) where they begin, and those where they end.
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
    """Longitudes, latitudes and azimuths (n,) at so many metres (n,) from where each of n geodesics begins.

    `ends` are as for `geodesic_points`; azimuths are in degrees clockwise from north, within -180 and 180.
    """
    geod = _geod(ellipsoid)
    azimuth, _, _ = geod.inv(*ends)
    lon, lat, back = (np.asarray(values) for values in geod.fwd(ends[0], ends[1], azimuth, way))
    return lon, lat, np.where(back > 0.0, back - 180.0, back + 180.0)


def _geod(ellipsoid: Ellipsoid) -> Geod:
    return Geod(a=ellipsoid.a, f=ellipsoid.f)
