"""Projections from coordinate reference systems: well-known text, attributes of the CF conventions, any CRS of PROJ."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, cast

import numpy as np
import pyproj.database
import pyproj.exceptions
from pyproj import CRS

from projdist.projections import catalogue, conversion_methods, operations
from projdist.projections.conversion_methods import StatedParameter
from projdist.projections.errors import ALLOWED, ProjectionError, proj_reason
from projdist.projections.operations import CrsOperation, Parts
from projdist.support import did_you_mean, listed, quoted, shown, tell

_TOKEN = re.compile(
    r"""\s*(?:(?P<text>"(?:[^"]|"")*")|(?P<open>[\[(])|(?P<close>[\])])|(?P<comma>,)|(?P<word>[^\s"\[\](),][^"\[\](),]*))"""
)
_VERTICAL = re.compile(r",\s*VERTCS\s*[\[(]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
# The count of numbers in a node.
_NUMBERS = {"SPHEROID": 2, "ELLIPSOID": 2, "BBOX": 4} | dict.fromkeys(
    ["PARAMETER", "PRIMEM", "PRIMEMERIDIAN", "UNIT", "ANGLEUNIT", "LENGTHUNIT", "SCALEUNIT"], 1
)
# WKT 1 writes spaces in names as underscores, also in a PROJ string, `PROJ-based operation method: +proj=pipeline ...`.
_PIPELINE = re.compile(r"PROJ-based[_ ]operation[_ ]method:[^\"]*")


@dataclass(frozen=True)
class WktNode:
    """A keyword in capitals with its contents: `values` (unquoted texts, words, numbers) and inner `nodes`."""

    keyword: str
    values: list[str] = field(default_factory=list)
    nodes: list[WktNode] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The first value, the name of most keywords."""
        return self.values[0] if self.values else ""

    @property
    def numbers(self) -> list[float]:
        """The numbers after the name."""
        return [float(value) for value in self.values[1:] if _NUMBER.fullmatch(value)]

    def walk(self) -> Iterator[WktNode]:
        """The node and all nodes below it, in order."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.nodes))


def form_of(value: Any) -> str:
    """The form of a text: "wkt" or "json" by its beginning, "proj" by its `proj=`, else ""; "json" for PROJJSON."""
    if not isinstance(value, str):
        return "json" if isinstance(value, Mapping) and "proj" not in value else ""
    if re.match(r"\s*\w+\s*[\[(]", value):
        return "wkt"
    if value.lstrip().startswith("{"):
        return "json"
    return "proj" if re.search(r"(?:^|\s)\+?proj=", value) else ""


def parse_wkt(text: str) -> list[WktNode]:
    """The tree of WKT, or two trees if Esri's VERTCS follows after a comma; raises ProjectionError."""
    complaint = f"Invalid projection '{shown(text)}'."
    roots: list[WktNode] = []
    waiting: list[WktNode] = []  # nodes whose brackets are open
    word, at = "", 0
    while match := _TOKEN.match(text, at):
        at = match.end()
        if match["open"]:
            node = WktNode(word.upper())
            (waiting[-1].nodes if waiting else roots).append(node)
            waiting.append(node)
        elif word and waiting:
            waiting[-1].values.append(word)
        word = (match["word"] or "").strip()
        if match["text"] and waiting:
            waiting[-1].values.append(match["text"][1:-1].replace('""', '"'))
        if match["close"]:
            waiting.pop()
            behind = "" if waiting else text[at:].strip()
            if behind and not (len(roots) == 1 and _VERTICAL.match(behind)):
                raise ProjectionError(
                    f"{complaint} WKT must end with its last bracket, and not with '{shown(behind)}'."
                )
    if waiting:
        mark = f", or a quotation mark before '{shown(text[at:])}'" if text[at:].strip() else ""
        raise ProjectionError(f"{complaint} The closing bracket of {waiting[-1].keyword} is missing{mark}.")
    return roots


def _check_wkt(roots: list[WktNode], text: str) -> None:
    """Raise ProjectionError for decimal commas, and for a flattening where its inverse belongs."""
    complaint = f"Invalid projection '{shown(text)}'."
    for node in (node for root in roots for node in root.walk()):
        this = f"{node.keyword} '{shown(node.name)}'"
        numbers = [value for value in node.values[0 if node.keyword == "BBOX" else 1 :] if _NUMBER.fullmatch(value)]
        if len(numbers) > _NUMBERS.get(node.keyword, len(numbers)):
            reason = f"{this} has a comma within a number, {','.join(numbers)}: write a point."
            raise ProjectionError(f"{complaint} {reason}")
        if node.keyword in ("SPHEROID", "ELLIPSOID") and len(numbers) > 1 and 0.0 < float(numbers[1]) < 1.0:
            raise ProjectionError(
                f"{complaint} {this} has an inverse flattening of {numbers[1]}, which is below 1: a flattening of "
                f"{numbers[1]} is written as {1.0 / float(numbers[1]):.9g}."
            )


def with_spaces(text: str) -> str:
    """The text with the spaces of PROJ pipelines restored from the underscores of WKT 1."""
    return _PIPELINE.sub(
        lambda match: re.sub(r"_(?=\+)", " ", match[0].replace("_operation_method:", " operation method:")), text
    )


# ---- CF conventions ------------------------------------------------------------------------------

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


def cf_attributes(wkt: str) -> tuple[dict[str, Any], ...]:
    """Attributes by CF 1.11, section 5.6, of a CRS, with GDAL's `spatial_ref`, and of its x and y in GIS order."""
    crs = CRS.from_wkt(wkt)
    mapping = crs.to_cf() | {"spatial_ref": wkt}
    if crs.is_geographic:
        own = crs.axis_info[0].unit_name  # pyproj writes degrees for grads
        names, units = ("longitude", "latitude"), ("degrees_east", "degrees_north") if own == "degree" else (own, own)
    else:
        names, units = ("projection_x_coordinate", "projection_y_coordinate"), (str(crs.cs_to_cf()[0]["units"]),) * 2
    coordinates = zip("XY", names, units, strict=True)
    return mapping, *({"axis": axis, "standard_name": name, "units": u} for axis, name, u in coordinates)


def grid_mapping_in(value: Any) -> dict[str, Any] | None:
    """Attributes of a grid mapping, from a dictionary or a variable of xarray, netCDF4 or h5netcdf; None for others."""
    attributes = getattr(value, "attrs", value)
    if hasattr(value, "ncattrs"):
        attributes = {name: value.getncattr(name) for name in value.ncattrs()}
    if not isinstance(attributes, Mapping) or not any(key in attributes for key in (_NAME, *_WKT)):
        return None
    return dict(attributes)


def crs_of_grid_mapping(mapping: Mapping[str, Any]) -> CRS:
    """The CRS of a grid mapping's attributes by CF 1.11, appendix F; raises ProjectionError."""
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
    title, method = str(mapping.get("projected_crs_name", name)), name
    if name == "lambert_conformal_conic" and "latitude_of_projection_origin" in stated:
        method = "Lambert Conic Conformal (2SP)"  # CF has no scale for the other one
    elif name == "geostationary":
        fixed = {"x": "y", "y": "x"}.get(str(stated.get("fixed_angle_axis")), "y")
        method = f"Geostationary Satellite (Sweep {str(stated.get('sweep_angle_axis', fixed)).upper()})"
    conversion = conversion_methods.conversion_of_names(method, _parameters(name, stated), title)
    parts = {"type": "ProjectedCRS", "name": title, "conversion": conversion, "coordinate_system": _METRE_AXES}
    geographic = {key: value for key, value in base.to_json_dict().items() if key != "$schema"}
    return CRS.from_json_dict(parts | {"base_crs": geographic})


def _checked(name: str, key: str, value: Any) -> Any:
    """An attribute, unpacked from a list of one; raises ProjectionError if it must be a number and is not."""
    values = np.ravel(value).tolist()
    if key in _SIZES or key == "longitude_of_prime_meridian" or conversion_methods.kind_of(key).kind:
        are_numbers = (isinstance(one, Real) and not isinstance(one, bool) and math.isfinite(one) for one in values)
        if not values or not all(are_numbers):
            raise ProjectionError(
                f"Invalid grid mapping '{shown(name)}'. Its {key} is {quoted(value)}; it must be a finite number."
            )
    return values[0] if len(values) == 1 else value


def _check_figure(name: str, crs: CRS, stated: Mapping[str, Any]) -> None:
    """Raise ProjectionError for sizes that PROJ ignores, and give a notice if WGS 84 is assumed."""
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
    is_named = figure.name != "WGS 84" or any("wgs84" in catalogue.folded(str(stated.get(key, ""))) for key in _NAMES)
    if not is_named and not any(key in stated for key in _SIZES):
        tell(f"The grid mapping '{shown(name)}' states no figure of the Earth: that of WGS 84 is taken.")


def _parameters(name: str, mapping: Mapping[str, Any]) -> list[StatedParameter]:
    """The numbers of a grid mapping by their names in WKT."""
    found = []
    for key, value in mapping.items():
        values = np.ravel(value).tolist() if key not in (*_GEODETIC, _NAME) else ()
        numbers = [float(item) for item in values if isinstance(item, Real)]
        if key == "standard_parallel" and name in ("lambert_conformal_conic", "albers_conical_equal_area"):
            both = numbers * 2 if len(numbers) == 1 else numbers
            found += [StatedParameter(f"standard_parallel_{k}", number) for k, number in enumerate(both, start=1)]
        elif numbers:
            found.append(StatedParameter(key, numbers[0]))
        if key == "azimuth_of_central_line" and numbers:  # CF has no separate angle for the grid
            found.append(StatedParameter("rectified_grid_angle", numbers[0]))
    return found


# ---- any CRS -------------------------------------------------------------------------------------


def parse_crs(value: Any) -> Parts:
    """The projection, by code or else WKT, of what pyproj accepts as a projected CRS; raises ProjectionError."""
    given = value if isinstance(value, str) else getattr(value, "name", None) or str(value)
    complaint = f"Invalid projection '{shown(given)}'."
    try:
        stated = read_crs(value)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError, ValueError) as error:
        reason = f"PROJ says: {proj_reason(error)}." if form_of(value) in ("wkt", "json") else _unknown(given)
        raise ProjectionError(f"{complaint} {reason}") from error
    crs = stated
    while crs.is_bound or crs.is_compound:
        crs = cast(CRS, crs.source_crs) if crs.is_bound else crs.sub_crs_list[0]
    if not (crs.is_projected or crs.type_name == "Derived Projected CRS"):
        drawn = " As longitudes and latitudes are drawn for x and y it is 'plate-carree'." if crs.is_geographic else ""
        raise ProjectionError(
            f"{complaint} It is a {crs.type_name} ({shown(crs.name)}), which has no map plane; it must be a projected "
            f"CRS.{drawn}"
        )
    if len(crs.axis_info) > 2:
        crs = crs.to_2d()
    base, ellipsoid = operations.geographic_base(crs), operations.ellipsoid_of_crs(crs)
    conversion = crs.coordinate_operation
    if base is None or ellipsoid is None:
        raise ProjectionError(f"{complaint} The CRS states no ellipsoid.")
    method = conversion.method_name if conversion else ""
    try:
        function = CrsOperation.of(crs, base)
        used = re.findall(r"\bproj=(\w+)", function.transformer.definition)
        if crs.type_name == "Derived Projected CRS":
            _check_spread(function, crs, method, complaint)
    except pyproj.exceptions.ProjError as error:
        raise not_computed(given, crs, error) from error
    for operation in operations.OWN_ELLIPSOIDS.intersection(used):
        ellipsoid = operations.operation_ellipsoid(operation, ellipsoid, warn=True)
    name = method if method and stated.name == "unknown" else stated.name
    definition = registered_code(stated) or stated.to_wkt()
    return Parts(str(name), str(definition), ellipsoid, function, bounds_of(stated) or bounds_of(crs))


def not_computed(given: str, crs: CRS, error: Exception) -> ProjectionError:
    """The error for a given CRS for which PROJ makes no operation."""
    method = crs.coordinate_operation.method_name if crs.coordinate_operation else ""
    reason = f"PROJ cannot compute {shown(crs.name)}: {proj_reason(error)}."
    if method and not conversion_methods.methods_named(method):
        reason = f"PROJ does not know the method '{shown(method)}' of {shown(crs.name)}."
    return ProjectionError(f"Invalid projection '{shown(given)}'. {reason}")


def read_crs(value: Any) -> CRS:
    """The CRS of anything that pyproj accepts, with the parameters of its WKT that PROJ alone would drop."""
    # Raises pyproj's CRSError, TypeError or ValueError, and ProjectionError for input that PROJ would misread.
    if not isinstance(value, str) and (mapping := grid_mapping_in(value)) is not None:
        value = next((str(mapping[key]) for key in _WKT if mapping.get(key)), "") or crs_of_grid_mapping(mapping)
    text = value.srs if isinstance(value, CRS) else value
    form = form_of(text)
    if form not in ("wkt", "json"):
        code = catalogue.code_of_number(value) if isinstance(value, str) and ":" not in value else ""
        return CRS.from_user_input(code or value)
    stated, restored = None, False
    if form == "wkt":
        roots = parse_wkt(text)
        _check_wkt(roots, text)
        # PROJ does not take the round brackets that the standard allows.
        text = re.sub(r'"[^"]*"|[()]', lambda match: {"(": "[", ")": "]"}.get(match[0], match[0]), text)
        value = with_spaces(text)
        restored = value != text
        # PROJ drops parameters of WKT 1 that it does not know.
        projected = next((node for root in roots for node in root.walk() if node.keyword == "PROJCS"), None)
        if projected is not None:
            parameters = (node for node in projected.nodes if node.keyword == "PARAMETER" and node.numbers)
            stated = [StatedParameter(node.name, node.numbers[0]) for node in parameters]
    crs = CRS.from_user_input(value)
    parts = crs.to_json_dict()
    mended = _with_conversion(parts, stated)
    if restored and (identity := mended.get("base_crs", {}).get("id")) is not None:
        # WKT 1 states no axes for the base; PROJ assumes longitude first, and swaps them behind a pipeline.
        base = CRS.from_authority(identity["authority"], identity["code"]).to_json_dict()
        mended = mended | {"base_crs": {key: part for key, part in base.items() if key != "$schema"}}
    return crs if mended is parts else CRS.from_json_dict(mended)


def _with_conversion(crs: dict[str, Any], stated: Sequence[StatedParameter] | None) -> dict[str, Any]:
    """PROJJSON of a CRS, also bound or compound, with the stated parameters in its conversion."""
    if crs["type"] == "ProjectedCRS":
        return conversion_methods.reconciled(crs, stated)
    if crs["type"] == "BoundCRS":
        inner = _with_conversion(crs["source_crs"], stated)
        return crs if inner is crs["source_crs"] else crs | {"source_crs": inner}
    if crs["type"] == "CompoundCRS":
        first, *others = crs["components"]
        inner = _with_conversion(first, stated)
        return crs if inner is first else crs | {"components": [inner, *others]}
    return crs


def registered_code(crs: CRS) -> str:
    """AUTHORITY:CODE of a registered CRS, else ""."""
    # Without a code PROJ is sure of registered names only; for others it would search its database for 0.1 s in vain.
    parts = (cast(CRS, crs.source_crs) if crs.is_bound else crs).to_json_dict()
    name, is_identified = parts["name"], "id" in parts or "ids" in parts
    if not is_identified and name not in (catalogue.registered_names() or [name]):
        return ""
    return ":".join(crs.to_authority(min_confidence=100) or ())


def bounds_of(crs: CRS) -> tuple[float, float, float, float] | None:
    """West, south, east, north of the area of use; None if it is missing or unknown (-1000 in PROJ)."""
    area = crs.area_of_use
    if area is None or not -90.0 <= area.south < area.north <= 90.0:
        return None
    if area.west == area.east or not -360.0 < area.east - area.west <= 360.0:
        return None
    return area.west, area.south, area.east, area.north


def _check_spread(function: CrsOperation, crs: CRS, method: str, complaint: str) -> None:
    """Raise ProjectionError for a derived CRS that PROJ maps to a single point, because it knows no such conversion."""
    west, south, east, north = bounds_of(crs) or (-170.0, -80.0, 170.0, 80.0)
    x, y = function(np.linspace(west, east, 9), np.linspace(south, north, 9))
    here = np.isfinite(x)
    if method and here.sum() > 1 and np.ptp(x[here]) == 0.0 and np.ptp(y[here]) == 0.0:
        raise ProjectionError(
            f"{complaint} PROJ lays all of it on one point, {x[here][0]:g}, {y[here][0]:g}: it does not know the "
            f"conversion '{shown(method)}', or its parameters are 0."
        )


def _unknown(given: str) -> str:
    """Reason for a text that names no CRS, with what is allowed or may have been meant."""
    authority, colon, code = given.partition(":")
    authority = authority.upper()
    if not colon or authority not in (*pyproj.database.get_authorities(), "URN"):
        return f"{did_you_mean(catalogue.close_codes(given))}{ALLOWED}"
    missing = f"{authority} has no such CRS in PROJ's database"
    elsewhere = catalogue.codes_elsewhere(authority, code)
    others = [f"{other} ({CRS.from_user_input(other).name})" for other in elsewhere]
    return f"{missing}: it is {listed(others, 'or')}." if others else f"{missing}. {ALLOWED}"
