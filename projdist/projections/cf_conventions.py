"""A CRS as the CF conventions have it."""

from __future__ import annotations

from typing import Any, NamedTuple

from pyproj import CRS


class CfAttributes(NamedTuple):
    """The attributes of a grid mapping, and of its coordinates x and y in the order of GIS programs."""

    mapping: dict[str, Any]
    x: dict[str, str]
    y: dict[str, str]


def cf_attributes(wkt: str) -> CfAttributes:
    """The attributes of a CRS: CF 1.11, section 5.6, with GDAL's `spatial_ref` beside."""
    crs = CRS.from_wkt(wkt)
    mapping = crs.to_cf() | {"spatial_ref": wkt}
    if crs.is_geographic:
        own = crs.axis_info[0].unit_name  # pyproj has degrees for grads, too
        x, y = (
            {"axis": axis, "standard_name": name, "units": unit if own == "degree" else own}
            for axis, name, unit in (("X", "longitude", "degrees_east"), ("Y", "latitude", "degrees_north"))
        )
    else:
        units = str(crs.cs_to_cf()[0]["units"])
        x, y = (
            {"axis": axis.upper(), "standard_name": f"projection_{axis}_coordinate", "units": units} for axis in "xy"
        )
    return CfAttributes(mapping, x, y)
