"""A projection of a PROJ string as a named CRS: WKT2 and Esri's WKT."""

from __future__ import annotations

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer

from projdist._typing import FloatArray
from projdist.earth import WGS84, Ellipsoid
from projdist.projections.crs import parse_crs, read_crs
from projdist.projections.datums import geographic_base, greenwich_offset, has_plain_axes, units_per_degree
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.exports import agree, base_crs, tried
from projdist.projections.grids import check_grids
from projdist.projections.hints import close_codes
from projdist.projections.operations import CrsOperation, transform
from projdist.projections.projection import Projection
from projdist.support import did_you_mean, shown

_VERSIONS = ("WKT2_2019", "WKT1_ESRI")


def geodetic_ellipsoid(geodetic: str) -> Ellipsoid:
    """The ellipsoid of a geographic CRS, as EPSG:6318; raises ProjectionError."""
    crs = _geodetic(geodetic)
    assert crs.ellipsoid is not None
    rf = crs.ellipsoid.inverse_flattening
    return Ellipsoid(crs.ellipsoid.semi_major_metre, 1.0 / rf if rf else 0.0)


def geodetic_of(projection: Projection) -> str | None:
    """WKT of the geographic CRS that a CRS is based on, None for what is no CRS, or counts otherwise than in degrees
    east of Greenwich."""
    if not isinstance(projection.function, CrsOperation):
        return None
    geodetic = CRS.from_wkt(projection.function.crs).geodetic_crs
    if geodetic is None or not has_plain_axes(geodetic):
        return None
    if greenwich_offset(geodetic) or units_per_degree(geodetic) != 1.0:
        return None
    return str(geodetic.to_wkt())


def crs_wkt(
    projection: Projection, name: str, *, geodetic: str | None = None, version: str = "WKT2_2019"
) -> tuple[str | None, str | None]:
    """WKT of a CRS that is the projection; or None, and the reason why there is none.

    It is based on the geographic CRS `geodetic`; by default on WGS 84 where the ellipsoid is that of WGS 84, else on
    an unnamed datum. `version` is WKT2_2019 or WKT1_ESRI. The WKT is read back and compared with the map.
    """
    if version not in _VERSIONS:
        raise ValueError(f"Invalid version '{version}'. It must be {' or '.join(_VERSIONS)}.")
    base = base_crs(projection)
    if base is None or not base.is_projected:
        return None, f"{projection.name} is no CRS, but a function or a pipeline."
    parts = base.to_json_dict()
    parts["name"] = name
    parts["conversion"]["name"] = name
    geodetic = geodetic or ("EPSG:4326" if projection.ellipsoid.is_close(WGS84) else None)
    if geodetic:
        parts["base_crs"] = {
            key: value for key, value in _geodetic(geodetic).to_json_dict().items() if key != "$schema"
        }
    try:
        text = str(CRS.from_json_dict(parts).to_wkt(version, pretty=True))
        found = Projection(*parse_crs(text, registered=False))
    except (pyproj.exceptions.CRSError, ProjectionError):
        return None, f"{version} has no such map."
    points = tried(projection)
    if not agree(projection, np.array(found(*points)), np.array(projection(*points))):
        return None, f"{version} of {projection.name} is another map: it loses a default or a step."
    return text, None


def _geodetic(text: str) -> CRS:
    try:
        crs = read_crs(text)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError, ValueError) as error:
        hint = did_you_mean(close_codes(str(text)))
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. {hint}{ALLOWED}") from error
    if not crs.is_geographic or crs.ellipsoid is None:
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. It must have longitudes and latitudes.")
    if greenwich_offset(crs):
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. Its longitudes must be from Greenwich.")
    return crs.to_2d() if len(crs.axis_info) > 2 else crs


def unprojected(crs: str, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Greenwich degrees, on its own datum, of coordinates in a CRS: longitudes, latitudes; raises ProjectionError."""
    try:
        stated = read_crs(crs)
        base = geographic_base(stated)
        if base is None:
            raise ProjectionError(f"Invalid CRS '{shown(crs)}'. It has no longitudes and latitudes.")
        transformer = Transformer.from_crs(stated, base, always_xy=True)
    except (pyproj.exceptions.CRSError, pyproj.exceptions.ProjError) as error:
        raise ProjectionError(f"Invalid CRS '{shown(crs)}'. {ALLOWED}") from error
    given = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    lon, lat = transform(transformer, *given)
    check_grids(transformer, given, lon)
    per_degree = units_per_degree(base)
    return lon / per_degree + greenwich_offset(base), lat / per_degree
