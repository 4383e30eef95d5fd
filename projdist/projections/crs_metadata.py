"""Facts about a map known without measuring: CRS metadata, declared properties, discontinuities, native poles."""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
from typing import NamedTuple

from pyproj import CRS

from projdist.earth import SMOOTH, SPHERE, WGS84, Discontinuities, data_rows
from projdist.projections.catalogue import operation_titles
from projdist.projections.names import Turned
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.proj_parameters import ELLIPSOID_KEYS, numbers_in
from projdist.projections.projection import Projection
from projdist.projections.worldmaps import WORLD_MAPS

_METRES = "metre"
# Tokens of a PROJ string that other fields show, or that have no meaning for the map.
_SAID = {"proj", "units", "to_meter", "type", "no_defs", "wktext", "datum", *ELLIPSOID_KEYS}


class CrsAxis(NamedTuple):
    """A coordinate axis: its name and direction."""

    name: str
    direction: str


class Setting(NamedTuple):
    """A parameter of a method; the value is a number, PROJ's text, or None for a flag, the unit "" for none."""

    name: str
    value: float | str | None
    unit: str


@dataclass(frozen=True, kw_only=True)
class CrsMetadata:
    """What the definition of a projection states; "" and, for `unit_metres`, NaN where it states nothing.

    `code` is AUTHORITY:CODE, `geographic_crs` the base of the CRS, `replaced_by` the codes of the successors of a
    deprecated CRS.
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
    axes: tuple[CrsAxis, ...] = ()
    method: str = ""
    parameters: tuple[Setting, ...] = ()


def metadata_of(projection: Projection) -> CrsMetadata:
    """The metadata of a projection of any kind."""
    function = projection.function
    if isinstance(function, CrsOperation):
        return _metadata_of_crs(projection, CRS.from_wkt(function.crs))
    if isinstance(function, Pipeline):
        return _of_string(projection, function)
    own = isinstance(function, Turned) or function in WORLD_MAPS.values()
    kind = "map that PROJ lacks" if own else "function of longitude and latitude"
    return CrsMetadata(kind=kind, ellipsoid_name=_ellipsoid_name(projection))


def _metadata_of_crs(projection: Projection, plane: CRS) -> CrsMetadata:
    """Metadata of a CRS whose projected part is `plane`."""
    stated = CRS.from_user_input(projection.definition)
    operation, geographic = plane.coordinate_operation, plane.geodetic_crs
    replaced = stated.get_non_deprecated() if stated.is_deprecated else []
    meridian = plane.prime_meridian
    axes = plane.axis_info
    return CrsMetadata(
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
        axes=tuple(CrsAxis(axis.name, axis.direction) for axis in axes),
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
    """Unit of a parameter, "" for ratios."""
    return "" if name in ("unity", "Unity", "unitless") else name


def _of_string(projection: Projection, function: Pipeline) -> CrsMetadata:
    """Metadata of a PROJ string; of a pipeline without parameters, which its definition shows step by step."""
    tokens = [token.lstrip("+").partition("=") for token in function.pipeline.split()]
    operations = [value for key, _, value in tokens if key == "proj"]
    alone = len(operations) == 1
    stated = {key: value for key, _, value in tokens}
    known = operation_titles()
    unit = stated.get("units", _METRES if function.to_metre == 1.0 else "")
    return CrsMetadata(
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
    """Name of a well-known ellipsoid, else "sphere" or ""."""
    if projection.ellipsoid.is_close(SPHERE):
        return "sphere of the Earth's mean radius"
    if projection.ellipsoid.is_close(WGS84):
        return "WGS 84"
    return "sphere" if projection.ellipsoid.is_sphere else ""


# ---- declared properties -------------------------------------------------------------------------


class DeclaredProperty(NamedTuple):
    """Name of a method or PROJ operation, and the property that it keeps: "conformal" or "equal-area"."""

    name: str
    keeps: str


def declared_property_of(projection: Projection) -> DeclaredProperty | None:
    """The property that a map's method declares on its ellipsoid; None for others, pipelines and functions."""
    function = projection.function
    if isinstance(function, CrsOperation):
        key = "method", _method_of(function.crs)
    elif isinstance(function, Pipeline):
        key = "operation", _operation_of(function.pipeline)
    else:
        return None
    keeps, figure = _promises().get(key, ("", ""))
    if not keeps or (figure == "sphere" and not projection.ellipsoid.is_sphere):
        return None
    return DeclaredProperty(key[1], keeps)


def _method_of(wkt: str) -> str:
    """Name of the method in the WKT2 of a projected CRS, 100 times faster than by PROJ; "" for derived CRSs."""
    method = re.search(r'METHOD\["([^"]*)"', wkt) if wkt.startswith("PROJCRS[") else None
    return method[1] if method else ""


def _operation_of(pipeline: str) -> str:
    """First operation of a PROJ string; `pipeline` if there are several."""
    return next((token[6:] for token in pipeline.split() if token.startswith("+proj=")), "")


@functools.cache
def _promises() -> dict[tuple[str, str], tuple[str, str]]:
    """Property and figure ("any" or "sphere") on which it holds, by kind and name."""
    rows = data_rows("declared_properties.csv")
    return {(row["kind"], row["name"]): (row["keeps"], row["figure"]) for row in rows}


# ---- discontinuities -----------------------------------------------------------------------------


_SHIFTED = ("+pm=", "+over", "+proj=pipeline", "+proj=ob_tran", "+axis=")


def discontinuities_of(projection: Projection) -> Discontinuities:
    """Known discontinuities of a map; `SMOOTH` for functions, pipelines and oblique maps."""
    function = projection.function
    if isinstance(function, Pipeline):
        found = _discontinuities_of_text(function.pipeline)
    elif isinstance(function, CrsOperation) and function.angle_unit == 1.0:
        found = _discontinuities_of_crs(function.crs, function.greenwich)
    else:
        return SMOOTH
    return found


@functools.lru_cache(maxsize=256)
def _discontinuities_of_text(pipeline: str) -> Discontinuities:
    """Discontinuities of a PROJ string."""
    if any(part in pipeline for part in _SHIFTED):
        return SMOOTH
    values = numbers_in(pipeline)
    centre = values.get("lon_0", 0.0)
    return known_discontinuities(str(values.get("proj")), centre) if isinstance(centre, float) else SMOOTH


def known_discontinuities(operation: str, centre: float) -> Discontinuities:
    """Discontinuities of a PROJ operation about a central meridian, with the meridian opposite."""
    return _moved_to(_known().get(("operation", operation), SMOOTH), centre)


@functools.lru_cache(maxsize=256)
def _discontinuities_of_crs(wkt: str, greenwich: float) -> Discontinuities:
    """Discontinuities of a projected CRS; of some methods only, as others have more than one meridian."""
    method = re.search(r'METHOD\["([^"]*)"', wkt)
    known = _known().get(("method", method[1])) if method and wkt.startswith("PROJCRS[") else None
    centre = re.search(r'PARAMETER\["Longitude of natural origin",([-+.\deE]+),ANGLEUNIT\["Degree"', wkt, re.IGNORECASE)
    if known is None or centre is None:
        return SMOOTH
    return _moved_to(known, float(centre[1]) + greenwich)


def _moved_to(known: Discontinuities, centre: float) -> Discontinuities:
    """The same moved to a central meridian, with the meridian opposite."""
    opposite = (180.0,)
    northern, southern = (
        tuple(sorted((lon + centre + 180.0) % 360.0 - 180.0 for lon in (*lons, *opposite))) for lons in known[1:]
    )
    return Discontinuities(known.parallels, northern, southern)


@functools.cache
def _known() -> dict[tuple[str, str], Discontinuities]:
    """Discontinuities of methods with the central meridian 0, by kind and name."""
    found = {}
    for row in data_rows("discontinuities.csv"):
        parallels = _numbers(row["parallels"])
        both = tuple(sorted({*parallels, *(-lat for lat in parallels)}))
        found[row["kind"], row["name"]] = Discontinuities(both, _numbers(row["northern"]), _numbers(row["southern"]))
    return found


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(word) for word in text.split())


# ---- native poles --------------------------------------------------------------------------------


_AZIMUTHAL = frozenset("laea aeqd stere ortho gnom airy nsper".split())  # about lon_0, lat_0
_ENDLESS = frozenset("stere merc webmerc cc lcc".split())  # unbounded at a pole
_TRANSVERSE = frozenset("tmerc cass tcea".split())  # cylinders about the point 90 degrees east of lon_0
_ON_ELLIPSOIDS = frozenset(["laea", "ortho"])  # others show rounding at their poles that graded panels would resolve
_SHIFTING = frozenset(["pm", "over", "axis"])
_QUARTER = 90.0  # degrees of azimuth over which a panel resolves its sine and cosine


class NativePole(NamedTuple):
    """A pole in degrees, and the discontinuities in longitude and latitude about it, from its southern meridian on.

    `widest` is the width in degrees of the widest panel about the pole. Panels of maps that grow without bound towards
    the pole or its antipode are `graded` there; nodes so near would see in other maps how PROJ snaps to these points.
    """

    lon: float
    lat: float
    discontinuities: Discontinuities
    widest: float
    graded: bool


def native_pole_of(projection: Projection) -> NativePole | None:
    """The native pole of a map, from its PROJ string; None if it is the Earth's or unknown."""
    function = projection.function
    if not isinstance(function, Pipeline):
        return None
    return _native_pole_of_text(function.pipeline, projection.ellipsoid.is_sphere)


@functools.lru_cache(maxsize=256)
def _native_pole_of_text(pipeline: str, sphere: bool) -> NativePole | None:
    values = numbers_in(pipeline)
    if values.keys() & _SHIFTING or not (sphere or values.get("proj") in _ON_ELLIPSOIDS):
        return None
    name, lon, lat = values.get("proj"), values.get("lon_0", 0.0), values.get("lat_0", 0.0)
    if not isinstance(lon, float) or not isinstance(lat, float):
        return None
    if name in _AZIMUTHAL:
        return NativePole(lon, lat, SMOOTH, _QUARTER, name in _ENDLESS) if abs(lat) < 90.0 else None
    if name in _TRANSVERSE:
        return NativePole(lon + 90.0, 0.0, SMOOTH, _QUARTER, True)
    if name == "ob_tran":
        return _oblique(values, lon)
    return None


def _oblique(values: dict[str, float | str], lon: float) -> NativePole | None:
    """The native pole of ob_tran, whose own longitudes are half a turn less than those from the southern meridian."""
    base, lat, turn = values.get("o_proj"), values.get("o_lat_p"), values.get("o_lon_p", 0.0)
    plain = {"proj", "o_proj", "o_lat_p", "o_lon_p", "lon_0", "R", "a", "b", "ellps", "units", "x_0", "y_0", "no_defs"}
    if not values.keys() <= plain or not isinstance(lat, float) or not isinstance(turn, float) or abs(lat) >= 90.0:
        return None
    if not isinstance(base, str) or base in _AZIMUTHAL | _TRANSVERSE | _ENDLESS:
        return None
    return NativePole(lon + 180.0, lat, known_discontinuities(base, 180.0 - turn), 180.0, False)
