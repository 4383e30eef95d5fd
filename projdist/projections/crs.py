"""Projections from coordinate reference systems: each is the operation from its own geodetic CRS."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
import pyproj.database
import pyproj.exceptions
from pyproj import CRS

from projdist.earth import Ellipsoid
from projdist.projections.catalogue import close_codes, codes_elsewhere
from projdist.projections.conversion_methods import StatedParameter, known_method, reconciled
from projdist.projections.errors import ALLOWED, ProjectionError, proj_reason
from projdist.projections.operations import (
    CrsOperation,
    Parts,
    ellipsoid_of_crs,
    geographic_base,
    greenwich_offset,
    operation_ellipsoid,
    tell_of_ellipsoid,
    units_per_degree,
)
from projdist.projections.wkt import (
    WktNode,
    check_wkt,
    crs_of_grid_mapping,
    grid_mapping_in,
    is_wkt,
    parse_wkt,
    with_spaces,
    with_square_brackets,
    wkt_in,
)
from projdist.support import did_you_mean, listed, shown


def parse_crs(value: Any, *, registered: bool = True) -> Parts:
    """The projection of anything that pyproj accepts as a projected CRS; raises ProjectionError.

    Its definition is WKT, or, with `registered`, the code of a CRS that has one, which takes PROJ 0.1 s to find.
    """
    given = value if isinstance(value, str) else getattr(value, "name", None) or str(value)
    quoted = shown(given)
    try:
        stated = read_crs(value)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError, ValueError) as error:
        reason = f"PROJ says: {proj_reason(error)}." if _is_definition(value) else _unknown(given)
        raise ProjectionError(f"Invalid projection '{quoted}'. {reason}") from error
    crs = _projected_part(stated, quoted)
    geodetic = geographic_base(crs)
    stated_ellipsoid = ellipsoid_of_crs(crs)
    if geodetic is None or stated_ellipsoid is None:
        raise ProjectionError(f"Invalid projection '{quoted}'. The CRS states no ellipsoid.")
    function = CrsOperation(crs.to_wkt(), greenwich_offset(crs), units_per_degree(geodetic), _axes_to_metres(crs))
    try:
        if crs.type_name == "Projected CRS":  # a derived one has other axes in memory than in its WKT
            function.prepare(crs)
        _ = function.transformer
        _check_spread(function, crs, quoted)
    except pyproj.exceptions.ProjError as error:
        operation = crs.coordinate_operation
        reason = f"PROJ cannot compute {shown(stated.name)}: {proj_reason(error)}."
        if operation is not None and not known_method(operation.method_name):
            reason = f"PROJ does not know the method '{shown(operation.method_name)}' of {shown(stated.name)}."
        raise ProjectionError(f"Invalid projection '{quoted}'. {reason}") from error
    ellipsoid = _drawn(function, stated_ellipsoid)
    definition = (_code(stated, crs) if registered else "") or str(stated.to_wkt())
    return Parts(_name(stated, crs), definition, ellipsoid, function, bounds_of(stated) or bounds_of(crs))


def read_crs(value: Any) -> CRS:
    """The CRS of anything that pyproj accepts, with parameters of its WKT that PROJ alone would drop.

    Raises pyproj's CRSError, TypeError or ValueError, and ProjectionError for input that PROJ would misread.
    """
    mapping = grid_mapping_in(value)
    if mapping is not None:
        value = wkt_in(mapping) or crs_of_grid_mapping(mapping)
    text = value.srs if isinstance(value, CRS) else value
    if not _is_definition(text):
        return CRS.from_user_input(value)
    roots: list[WktNode] = []
    if isinstance(text, str) and is_wkt(text):
        roots = parse_wkt(text)
        check_wkt(roots, text)
        text = with_square_brackets(text)
        value = with_spaces(text)
    crs = CRS.from_user_input(value)
    parts = crs.to_json_dict()
    mended = _with_conversion(parts, _parameters_in(roots))
    if roots and value != text:
        mended = _with_registered_base(mended)
    return crs if mended is parts else CRS.from_json_dict(mended)


def _with_registered_base(crs: dict[str, Any]) -> dict[str, Any]:
    """PROJJSON of a projected CRS, its base replaced by the registered geographic CRS whose code it states.

    WKT 1 states no axes for the base; PROJ assumes longitude first, and on the way from a pipeline to another datum
    swaps them.
    """
    identity = crs.get("base_crs", {}).get("id")
    if identity is None:
        return crs
    base = CRS.from_authority(identity["authority"], identity["code"]).to_json_dict()
    return crs | {"base_crs": {key: value for key, value in base.items() if key != "$schema"}}


def _is_definition(value: Any) -> bool:
    """True for WKT and PROJJSON, False for codes and PROJ strings."""
    if isinstance(value, str):
        return is_wkt(value) or value.lstrip().startswith("{")
    return isinstance(value, Mapping) and "proj" not in value


def _with_conversion(crs: dict[str, Any], stated: Sequence[StatedParameter] | None) -> dict[str, Any]:
    """PROJJSON of a CRS, also bound or compound, with the stated parameters in its conversion."""
    if crs["type"] == "ProjectedCRS":
        return reconciled(crs, stated)
    if crs["type"] == "BoundCRS":
        inner = _with_conversion(crs["source_crs"], stated)
        return crs if inner is crs["source_crs"] else crs | {"source_crs": inner}
    if crs["type"] == "CompoundCRS":
        first, *others = crs["components"]
        inner = _with_conversion(first, stated)
        return crs if inner is first else crs | {"components": [inner, *others]}
    return crs


def _parameters_in(roots: Sequence[WktNode]) -> list[StatedParameter] | None:
    """The parameters in WKT 1, including those that PROJ drops; None for other WKT."""
    projected = next((node for root in roots if (node := root.find("PROJCS"))), None)
    if projected is None:
        return None
    parameters = (node for node in projected.nodes if node.keyword == "PARAMETER")
    return [StatedParameter(node.name, node.numbers[0]) for node in parameters if node.numbers]


def _code(stated: CRS, projected: CRS) -> str:
    """AUTHORITY:CODE of a registered CRS, else ""; no registered CRS has a PROJ string as its method."""
    operation = projected.coordinate_operation
    if operation is not None and operation.method_name.startswith("PROJ-based operation method"):
        return ""
    return ":".join(stated.to_authority(min_confidence=100) or ())


def bounds_of(crs: CRS) -> tuple[float, float, float, float] | None:
    """West, south, east, north of the area of use; None if it is missing or unknown (-1000 in PROJ)."""
    area = crs.area_of_use
    if area is None or not -90.0 <= area.south < area.north <= 90.0:
        return None
    if area.west == area.east or not -360.0 < area.east - area.west <= 360.0:
        return None
    return area.west, area.south, area.east, area.north


def _drawn(function: CrsOperation, stated: Ellipsoid) -> Ellipsoid:
    """The ellipsoid that PROJ uses for a CRS: the stated one, unless PROJ's operation has a fixed one."""
    for operation in re.findall(r"\bproj=(\w+)", function.transformer.definition):
        tell_of_ellipsoid(operation, stated)
        stated = operation_ellipsoid(operation, stated)
    return stated


def _check_spread(function: CrsOperation, crs: CRS, quoted: str) -> None:
    """Raise for a derived CRS that PROJ maps to a single point, as it does with an unknown conversion."""
    conversion = crs.coordinate_operation
    if crs.type_name != "Derived Projected CRS" or conversion is None:
        return
    west, south, east, north = bounds_of(crs) or (-170.0, -80.0, 170.0, 80.0)
    x, y = function(np.linspace(west, east, 9), np.linspace(south, north, 9))
    here = np.isfinite(x)
    if here.sum() > 1 and np.ptp(x[here]) == 0.0 and np.ptp(y[here]) == 0.0:
        raise ProjectionError(
            f"Invalid projection '{quoted}'. PROJ lays all of it on one point, {x[here][0]:g}, {y[here][0]:g}: it does "
            f"not know the conversion '{shown(conversion.method_name)}', or its parameters are 0."
        )


def _unknown(given: str) -> str:
    """Reason for a text that names no CRS, with what is allowed or may have been meant."""
    authority, colon, code = given.partition(":")
    if not colon or authority.upper() not in (*pyproj.database.get_authorities(), "URN"):
        return f"{did_you_mean(close_codes(given))}{ALLOWED}"
    missing = f"{authority.upper()} has no such CRS in PROJ's database"
    others = [f"{other} ({CRS.from_user_input(other).name})" for other in codes_elsewhere(authority.upper(), code)]
    return f"{missing}: it is {listed(others, 'or')}." if others else f"{missing}. {ALLOWED}"


def _name(stated: CRS, projected: CRS) -> str:
    """Name of the CRS, or of its method if it is unnamed."""
    operation = projected.coordinate_operation
    return str(operation.method_name if operation and stated.name == "unknown" else stated.name)


def _projected_part(crs: CRS, quoted: str) -> CRS:
    """The 2-D projected CRS inside bound, compound and 3-D CRSs; raises ProjectionError if there is none."""
    while crs.is_bound or crs.is_compound:
        crs = cast(CRS, crs.source_crs) if crs.is_bound else crs.sub_crs_list[0]
    if not (crs.is_projected or crs.type_name == "Derived Projected CRS"):
        drawn = " As longitudes and latitudes are drawn for x and y it is 'plate-carree'." if crs.is_geographic else ""
        raise ProjectionError(
            f"Invalid projection '{quoted}'. It is a {crs.type_name} ({shown(crs.name)}), which has no map plane; "
            f"it must be a projected CRS.{drawn}"
        )
    return crs.to_2d() if len(crs.axis_info) > 2 else crs


def _axes_to_metres(crs: CRS) -> tuple[tuple[float, float], tuple[float, float]]:
    """Matrix from coordinates in `always_xy` order to metres east and north."""
    axes = [(axis.direction, axis.unit_conversion_factor) for axis in crs.axis_info[:2]]
    if [direction for direction, _ in axes] == ["north", "east"]:
        axes.reverse()  # as always_xy does
    (first, u), (second, v) = axes
    sign = {"east": 1.0, "north": 1.0, "west": -1.0, "south": -1.0}
    if first in ("north", "south") and second in ("east", "west"):
        return ((0.0, sign[second] * v), (sign[first] * u, 0.0))
    if first in ("east", "west") and second in ("north", "south"):
        return ((sign[first] * u, 0.0), (0.0, sign[second] * v))
    return ((u, 0.0), (0.0, v))  # polar maps: both axes point along meridians
