"""The longitudes and latitudes that a CRS is based on: their order, direction, kind, unit and prime meridian."""

from __future__ import annotations

import math

import numpy as np
from pyproj import CRS

_GIVES_LONGITUDE_FIRST = (["north", "east"], ["east", "north"])
_AXES = [
    {"name": "Geodetic longitude", "abbreviation": "Lon", "direction": "east", "unit": "degree"},
    {"name": "Geodetic latitude", "abbreviation": "Lat", "direction": "north", "unit": "degree"},
]
_ROUNDED = 1e-9  # relative: degrees to the digits that programs write
_IDENTITY = ("id", "ids", "$schema", "scope", "area", "bbox", "usages", "remarks")  # are of the axes as they were


def geographic_base(crs: CRS) -> CRS | None:
    """The geographic CRS of a CRS's datum, which with `always_xy` has longitudes east first, then geodetic latitudes.

    That is its geodetic CRS where it has such axes. The bodies of IAU_2015 have others: `always_xy` leaves longitudes
    that are positive west, and planetocentric latitudes, where and as they are. Then it is one of the same datum in
    degrees, between which and the CRS PROJ converts.
    """
    geodetic = crs.geodetic_crs
    if geodetic is None or has_plain_axes(geodetic):
        return geodetic
    parts = {key: value for key, value in geodetic.to_json_dict().items() if key not in _IDENTITY}
    parts |= {
        "type": "GeographicCRS",
        "name": f"{geodetic.name}, longitudes east, geodetic latitudes",
        "coordinate_system": {"subtype": "ellipsoidal", "axis": _AXES},
    }
    return CRS.from_json_dict(parts)


def has_plain_axes(geodetic: CRS) -> bool:
    """Whether `always_xy` makes of a geodetic CRS's axes longitudes east, then geodetic latitudes north."""
    return geodetic.is_geographic and [axis.direction for axis in geodetic.axis_info[:2]] in _GIVES_LONGITUDE_FIRST


def greenwich_offset(crs: CRS) -> float:
    """Degrees from Greenwich, or the prime meridian of another body, to the CRS's own."""
    meridian = crs.prime_meridian
    return float(np.degrees(float(meridian.longitude) * float(meridian.unit_conversion_factor))) if meridian else 0.0


def units_per_degree(geodetic: CRS) -> float:
    """Units of the CRS's longitudes in a degree."""
    east = next((axis for axis in geodetic.axis_info if axis.direction == "east"), geodetic.axis_info[0])
    factor = float(east.unit_conversion_factor)
    return 1.0 if math.isclose(factor, math.radians(1.0), rel_tol=_ROUNDED) else math.radians(1.0) / factor
