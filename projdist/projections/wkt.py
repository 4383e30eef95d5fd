"""Well-known text as a tree, and CRSs in attributes of the CF conventions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import pyproj.exceptions
from pyproj import CRS

from projdist.projections.catalogue import folded
from projdist.projections.conversion_methods import StatedParameter, conversion_of_names, is_parameter
from projdist.projections.errors import ProjectionError
from projdist.support import quoted, shown, tell

_TOKEN = re.compile(
    r"""\s*(?:(?P<text>"(?:[^"]|"")*")|(?P<open>[\[(])|(?P<close>[\])])|(?P<comma>,)|(?P<word>[^\s"\[\](),][^"\[\](),]*))"""
)
_VERTICAL = re.compile(r",\s*VERTCS\s*[\[(]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
# How many numbers a node holds.
_NUMBERS = {
    "PARAMETER": 1,
    "PRIMEM": 1,
    "PRIMEMERIDIAN": 1,
    "SPHEROID": 2,
    "ELLIPSOID": 2,
    "UNIT": 1,
    "ANGLEUNIT": 1,
    "LENGTHUNIT": 1,
    "SCALEUNIT": 1,
    "BBOX": 4,
}
# WKT 1 writes spaces in names as underscores. `PROJ-based operation method: +proj=pipeline +step ...` is a PROJ string
# that needs its spaces back, before plus signs.
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

    def find(self, *keywords: str) -> WktNode | None:
        """The first node at or below it with one of the keywords."""
        return next((node for node in self.walk() if node.keyword in keywords), None)


def is_wkt(text: str) -> bool:
    """True if a text begins like WKT, with a word and a bracket."""
    return re.match(r"\s*\w+\s*[\[(]", text) is not None


def parse_wkt(text: str) -> list[WktNode]:
    """The tree of WKT, or two trees if Esri's VERTCS follows after a comma; raises ProjectionError."""
    roots: list[WktNode] = []
    waiting: list[WktNode] = []  # the nodes whose brackets are open
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
                raise _unreadable(text, f"WKT must end with its last bracket, and not with '{shown(behind)}'")
    if waiting:
        mark = f", or a quotation mark before '{shown(text[at:])}'" if text[at:].strip() else ""
        raise _unreadable(text, f"The closing bracket of {waiting[-1].keyword} is missing{mark}")
    return roots


def check_wkt(roots: list[WktNode], text: str) -> None:
    """Raise ProjectionError for decimal commas, and for flattenings in place of their inverses."""
    for node in (node for root in roots for node in root.walk()):
        numbers = node.values[1 if node.keyword != "BBOX" else 0 :]
        stray = [value for value in numbers if _NUMBER.fullmatch(value)]
        if len(stray) > _NUMBERS.get(node.keyword, len(stray)):
            raise _unreadable(
                text,
                f"{node.keyword} '{shown(node.name)}' has a comma within a number, {','.join(stray)}: write a point",
            )
        if node.keyword in ("SPHEROID", "ELLIPSOID") and len(stray) > 1 and 0.0 < float(stray[1]) < 1.0:
            raise _unreadable(
                text,
                f"{node.keyword} '{shown(node.name)}' has an inverse flattening of {stray[1]}, which is below 1: "
                f"a flattening of {stray[1]} is written as {1.0 / float(stray[1]):.9g}",
            )


def with_square_brackets(text: str) -> str:
    """The text with square brackets for round ones, which the standard allows and PROJ does not."""
    square = {"(": "[", ")": "]"}
    return re.sub(r'"[^"]*"|[()]', lambda match: square.get(match[0], match[0]), text)


def with_spaces(text: str) -> str:
    """The text with the spaces of PROJ pipelines restored from the underscores of WKT 1."""

    def mended(match: re.Match[str]) -> str:
        return re.sub(r"_(?=\+)", " ", match[0].replace("_operation_method:", " operation method:"))

    return _PIPELINE.sub(mended, text)


def _unreadable(text: str, reason: str) -> ProjectionError:
    return ProjectionError(f"Invalid projection '{shown(text)}'. {reason}.")


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


class CfAttributes(NamedTuple):
    """Attributes of a grid mapping and of its coordinates x and y, in GIS order."""

    mapping: dict[str, Any]
    x: dict[str, str]
    y: dict[str, str]


def cf_attributes(wkt: str) -> CfAttributes:
    """Attributes of a CRS after CF 1.11, section 5.6, with GDAL's `spatial_ref`."""
    crs = CRS.from_wkt(wkt)
    mapping = crs.to_cf() | {"spatial_ref": wkt}
    if crs.is_geographic:
        own = crs.axis_info[0].unit_name  # pyproj writes degrees for grads
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
    """Attributes of a grid mapping, from a dictionary or a variable of xarray, netCDF4 or h5netcdf; None for others."""
    attributes = getattr(value, "attrs", value)
    if hasattr(value, "ncattrs"):
        attributes = {name: value.getncattr(name) for name in value.ncattrs()}
    if not isinstance(attributes, Mapping) or not any(key in attributes for key in (_NAME, *_WKT)):
        return None
    return dict(attributes)


def wkt_in(mapping: Mapping[str, Any]) -> str:
    """The WKT in a grid mapping; "" if there is none."""
    return next((str(mapping[key]) for key in _WKT if mapping.get(key)), "")


def crs_of_grid_mapping(mapping: Mapping[str, Any]) -> CRS:
    """The CRS of a grid mapping's attributes after CF 1.11, appendix F; raises ProjectionError."""
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
    """An attribute, unpacked from a list of one; raises ProjectionError if it must be a number and is not."""
    values = np.ravel(value).tolist()
    if key in _SIZES or key == "longitude_of_prime_meridian" or is_parameter(key):
        are_numbers = (isinstance(one, Real) and not isinstance(one, bool) and math.isfinite(one) for one in values)
        if not values or not all(are_numbers):
            raise ProjectionError(
                f"Invalid grid mapping '{shown(name)}'. Its {key} is {quoted(value)}; it must be a finite number."
            )
    return values[0] if len(values) == 1 else value


def _check_figure(name: str, crs: CRS, stated: Mapping[str, Any]) -> None:
    """Raise ProjectionError for sizes that PROJ ignores, and warn if WGS 84 is assumed."""
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
    """Name of a grid mapping's projection in the table of methods."""
    if name == "lambert_conformal_conic" and "latitude_of_projection_origin" in mapping:
        return "Lambert Conic Conformal (2SP)"  # CF has no scale for the other one
    if name != "geostationary":
        return name
    sweep = mapping.get("sweep_angle_axis", {"x": "y", "y": "x"}.get(str(mapping.get("fixed_angle_axis")), "y"))
    return f"Geostationary Satellite (Sweep {str(sweep).upper()})"


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
