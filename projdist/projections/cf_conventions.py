"""CRSs as the CF conventions have them: the attributes of a grid mapping."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import pyproj.exceptions
from pyproj import CRS

from projdist.projections.conversion_methods import Stated, conversion_of_names, is_parameter
from projdist.projections.errors import ProjectionError
from projdist.projections.hints import folded
from projdist.support import quoted, shown, tell

_WKT = ("crs_wkt", "spatial_ref")  # CF's, and GDAL's
_NAME = "grid_mapping_name"
_SIZES = ("semi_major_axis", "semi_minor_axis", "inverse_flattening", "earth_radius")
_NAMES = ("reference_ellipsoid_name", "horizontal_datum_name", "geographic_crs_name")
_GEODETIC = (*_SIZES, *_NAMES, "longitude_of_prime_meridian", "prime_meridian_name", "towgs84")
_SAME_SIZE = 1e-6  # relative: files round axes to single precision, 0.5 m
_SAME_FLATTENING = 1e-4  # relative: files have 298.25 for 298.257223563
_DEGREES = ("latitude_longitude", "rotated_latitude_longitude")
_METRE_AXES = {
    "subtype": "Cartesian",
    "axis": [
        {"name": "Easting", "abbreviation": "E", "direction": "east", "unit": "metre"},
        {"name": "Northing", "abbreviation": "N", "direction": "north", "unit": "metre"},
    ],
}


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


def grid_mapping_in(value: Any) -> dict[str, Any] | None:
    """The attributes of a grid mapping, of a dictionary of them or a variable of xarray, netCDF4 or h5netcdf."""
    attributes = getattr(value, "attrs", value)
    if hasattr(value, "ncattrs"):
        attributes = {name: value.getncattr(name) for name in value.ncattrs()}
    if not isinstance(attributes, Mapping) or not any(key in attributes for key in (_NAME, *_WKT)):
        return None
    return dict(attributes)


def wkt_in(mapping: Mapping[str, Any]) -> str:
    """The WKT in a grid mapping, which says all, where there is one."""
    return next((str(mapping[key]) for key in _WKT if mapping.get(key)), "")


def crs_of_grid_mapping(mapping: Mapping[str, Any]) -> CRS:
    """The CRS of the attributes of a grid mapping: CF 1.11, appendix F; raises ProjectionError."""
    name = str(mapping[_NAME])
    stated = {key: _checked(name, key, value) for key, value in mapping.items()}
    geodetic = {key: value for key, value in stated.items() if key in _GEODETIC}
    try:
        base = CRS.from_cf(stated if name in _DEGREES else {_NAME: "latitude_longitude", **geodetic})
    except (pyproj.exceptions.CRSError, KeyError, TypeError, ValueError) as error:
        raise ProjectionError(f"Invalid grid mapping '{shown(name)}'. PROJ cannot read its attributes.") from error
    _check_figure(name, base, geodetic)
    if name in _DEGREES:
        return base
    title = str(mapping.get("projected_crs_name", name))
    conversion = conversion_of_names(_method(name, stated), _parameters(name, stated), title)
    return CRS.from_json_dict(
        {
            "type": "ProjectedCRS",
            "name": title,
            "base_crs": {key: value for key, value in base.to_json_dict().items() if key != "$schema"},
            "conversion": conversion,
            "coordinate_system": _METRE_AXES,
        }
    )


def _checked(name: str, key: str, value: Any) -> Any:
    """An attribute, a list of one number being the number; raises ProjectionError for what must be numbers."""
    values = np.ravel(value).tolist()
    if key in _SIZES or key == "longitude_of_prime_meridian" or is_parameter(key):
        are_numbers = (isinstance(one, Real) and not isinstance(one, bool) and math.isfinite(one) for one in values)
        if not values or not all(are_numbers):
            raise ProjectionError(
                f"Invalid grid mapping '{shown(name)}'. Its {key} is {quoted(value)}; it must be a finite number."
            )
    return values[0] if len(values) == 1 else value


def _check_figure(name: str, crs: CRS, stated: Mapping[str, Any]) -> None:
    """Refuse sizes that PROJ passes over, and tell of a figure that is not stated; raises ProjectionError."""
    figure = crs.ellipsoid
    assert figure is not None  # of a geodetic CRS
    a, b, rf = figure.semi_major_metre, figure.semi_minor_metre, figure.inverse_flattening
    for key, made in zip(_SIZES, (a, b, rf, a), strict=True):
        near = _SAME_FLATTENING if key == "inverse_flattening" else _SAME_SIZE
        if key in stated and not math.isclose(stated[key], made, rel_tol=near):
            raise ProjectionError(
                f"Invalid grid mapping '{shown(name)}'. Its {key} is {stated[key]:.12g}, of which PROJ makes "
                f"{made:.12g}: it must have a semi_major_axis with a semi_minor_axis or an inverse_flattening that go "
                "together and with its datum, or an earth_radius."
            )
    is_named = figure.name != "WGS 84" or any("wgs84" in folded(str(stated.get(key, ""))) for key in _NAMES)
    if not is_named and not any(key in stated for key in _SIZES):
        tell(f"The grid mapping '{shown(name)}' states no figure of the Earth: that of WGS 84 is taken.")


def _method(name: str, mapping: Mapping[str, Any]) -> str:
    """What a grid mapping's projection is called in the table of methods."""
    if name == "lambert_conformal_conic" and "latitude_of_projection_origin" in mapping:
        return "Lambert Conic Conformal (2SP)"  # CF has no scale for the other one
    if name != "geostationary":
        return name
    sweep = mapping.get("sweep_angle_axis", {"x": "y", "y": "x"}.get(str(mapping.get("fixed_angle_axis")), "y"))
    return f"Geostationary Satellite (Sweep {str(sweep).upper()})"


def _parameters(name: str, mapping: Mapping[str, Any]) -> list[Stated]:
    """The numbers of a grid mapping by the names that they have in WKT."""
    found = []
    for key, value in mapping.items():
        values = np.ravel(value).tolist() if key not in (*_GEODETIC, _NAME) else ()
        numbers = [float(item) for item in values if isinstance(item, Real)]
        if key == "standard_parallel" and name in ("lambert_conformal_conic", "albers_conical_equal_area"):
            both = numbers * 2 if len(numbers) == 1 else numbers
            found += [Stated(f"standard_parallel_{index}", number) for index, number in enumerate(both, start=1)]
        elif numbers:
            found.append(Stated(key, numbers[0]))
        if key == "azimuth_of_central_line" and numbers:  # CF has no other angle for the grid
            found.append(Stated("rectified_grid_angle", numbers[0]))
    return found
