"""What a projection says of itself: a CRS what its authority states, a PROJ string its operation and parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from pyproj import CRS

from projdist.earth import SPHERE, WGS84
from projdist.projections.aspects import Turned
from projdist.projections.hints import operation_titles
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection
from projdist.projections.projstrings import ELLIPSOID_KEYS
from projdist.projections.worldmaps import WORLD_MAPS

__all__ = ["Axis", "Particulars", "Setting", "particulars_of"]

_METRES = "metre"
# Tokens of a PROJ string that are said elsewhere, or say nothing.
_SAID = {"proj", "units", "to_meter", "type", "no_defs", "wktext", "datum", *ELLIPSOID_KEYS}


class Axis(NamedTuple):
    """An axis of a map's coordinates, in their order, and where it points."""

    name: str
    direction: str


class Setting(NamedTuple):
    """A parameter of a method: a number, or PROJ's text, None of a flag; "" for no unit."""

    name: str
    value: float | str | None
    unit: str


@dataclass(frozen=True, kw_only=True)
class Particulars:
    """What is stated of a projection; texts are empty, and `unit_metres` is NaN, where nothing is.

    `code` is AUTHORITY:CODE, `geographic_crs` the CRS that a CRS is made from, `replaced_by` the codes of what shall be
    used in place of a deprecated one.
    """

    kind: str
    code: str = ""
    area_name: str = ""
    scope: str = ""
    remarks: str = ""
    deprecated: bool = False
    replaced_by: tuple[str, ...] = ()
    datum: str = ""
    geographic_crs: str = ""
    ellipsoid_name: str = ""
    prime_meridian: str = ""
    unit: str = ""
    unit_metres: float = math.nan
    axes: tuple[Axis, ...] = ()
    method: str = ""
    parameters: tuple[Setting, ...] = ()


def particulars_of(projection: Projection) -> Particulars:
    """The particulars of a projection of any kind."""
    function = projection.function
    if isinstance(function, CrsOperation):
        return _of_crs(projection, CRS.from_wkt(function.crs))
    if isinstance(function, Pipeline):
        return _of_string(projection, function)
    own = isinstance(function, Turned) or function in WORLD_MAPS.values()
    kind = "map that PROJ lacks" if own else "function of longitude and latitude"
    return Particulars(kind=kind, ellipsoid_name=_ellipsoid_name(projection))


def _of_crs(projection: Projection, plane: CRS) -> Particulars:
    """Of a CRS, whose projected part is `plane`."""
    stated = CRS.from_user_input(projection.definition)
    operation, geographic = plane.coordinate_operation, plane.geodetic_crs
    replaced = stated.get_non_deprecated() if stated.is_deprecated else []
    meridian = plane.prime_meridian
    axes = plane.axis_info
    return Particulars(
        kind=_kind(stated),
        code=_code(stated),
        area_name=(stated.area_of_use.name or "") if stated.area_of_use else "",
        scope=stated.scope or "",
        remarks=stated.remarks or "",
        deprecated=stated.is_deprecated,
        replaced_by=tuple(filter(None, map(_code, replaced))),
        datum=plane.datum.name if plane.datum else "",
        geographic_crs=" ".join(filter(None, (_code(geographic), geographic.name))) if geographic else "",
        ellipsoid_name=plane.ellipsoid.name if plane.ellipsoid else "",
        prime_meridian=meridian.name if meridian and meridian.longitude else "",
        unit=axes[0].unit_name,
        unit_metres=axes[0].unit_conversion_factor,
        axes=tuple(Axis(axis.name, axis.direction) for axis in axes),
        method=operation.method_name if operation else "",
        parameters=tuple(Setting(one.name, one.value, _unit(one.unit_name)) for one in operation.params)
        if operation
        else (),
    )


def _kind(crs: CRS) -> str:
    kind = str(crs.type_name)
    return kind[0].lower() + kind[1:]


def _code(crs: CRS) -> str:
    return ":".join(crs.to_authority(min_confidence=100) or ())


def _unit(name: str) -> str:
    """The unit of a parameter; that of ratios is none."""
    return "" if name in ("unity", "Unity", "unitless") else name


def _of_string(projection: Projection, function: Pipeline) -> Particulars:
    """Of a PROJ string; of a pipeline, which has parameters in each step, the steps are in its definition."""
    tokens = [token.lstrip("+").partition("=") for token in function.pipeline.split()]
    operations = [value for key, _, value in tokens if key == "proj"]
    alone = len(operations) == 1
    stated = {key: value for key, _, value in tokens}
    known = operation_titles()
    unit = stated.get("units", _METRES if function.to_metre == 1.0 else "")
    return Particulars(
        kind="PROJ string" if alone else "PROJ pipeline",
        ellipsoid_name=_ellipsoid_name(projection),
        unit=_METRES if unit == "m" else unit,
        unit_metres=function.to_metre,
        method=known.get(operations[0], operations[0]) if alone else "",
        parameters=tuple(
            Setting(key, value if equals else None, "") for key, equals, value in tokens if alone and key not in _SAID
        ),
    )


def _ellipsoid_name(projection: Projection) -> str:
    """The name of a figure that everybody knows."""
    if projection.ellipsoid.is_close(SPHERE):
        return "sphere of the Earth's mean radius"
    if projection.ellipsoid.is_close(WGS84):
        return "WGS 84"
    return "sphere" if projection.ellipsoid.is_sphere else ""
