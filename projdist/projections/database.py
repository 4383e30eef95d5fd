"""Projected CRSs of PROJ's database: index, registry facts, and CRSs that draw the same map."""

import functools
import json
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import pyproj.exceptions
from pyproj import CRS as CRS  # for other rooms
from pyproj.database import get_database_metadata, query_crs_info
from pyproj.enums import PJType

from projdist import earth, support
from projdist.projections import catalogue, crs_search
from projdist.projections.crs import not_computed
from projdist.projections.errors import ProjectionError, check_authorities
from projdist.projections.operations import Pipeline, ellipsoid_of_crs
from projdist.projections.projection import Projection

FALSE_ORIGINS = {8806, 8807, 8816, 8817, 8826, 8827}
"""EPSG's codes of false eastings and northings, which only translate a map."""


@dataclass(frozen=True)
class Facts:
    """Registry facts of a projected CRS."""

    frame: str  # code of its geodetic CRS
    since: int  # year of its datum, of an ensemble that of the first member; 0 if unknown
    draws: Any  # method, prime meridian and parameters without the false origin
    extents: tuple[str, ...]  # names and descriptions of the areas of use
    special: bool  # no scope is for general use


UNKNOWN = Facts("", 0, None, (), True)

_COLUMNS = ", ".join(f"c.param{n}_code, c.param{n}_value, c.param{n}_uom_code" for n in range(1, 8))
_FACTS = f"""
SELECT p.auth_name || ':' || p.code, g.auth_name || ':' || g.code, {crs_search.DATE},
       s.scope, e.name, e.description, c.method_code, d.prime_meridian_code, {_COLUMNS}
FROM {crs_search.TABLES}
WHERE p.auth_name || ':' || p.code IN (SELECT value FROM json_each(?))
"""


def proj_version() -> str:
    """PROJ and the registry in its database, as `PROJ 9.5.1, EPSG v11.022`."""
    return f"PROJ {pyproj.proj_version_str}, EPSG {get_database_metadata('EPSG.VERSION')}"


def facts_of(codes: Collection[str]) -> dict[str, Facts]:
    """Facts of projected CRSs by code; empty if the database cannot be read."""
    found: dict[str, list[Any]] = {}  # a row for each usage
    for code, *row in catalogue.readable_rows(_FACTS, [json.dumps([*codes])]):
        found.setdefault(code, []).append(row)
    facts = {}
    for code, rows in found.items():
        frame, date, _, _, _, method, meridian, *parameters = rows[0]
        facts[code] = Facts(
            frame=frame or "",
            since=crs_search.year_of(date),
            draws=(method, meridian, frozenset(_drawing(parameters))) if method is not None else None,
            extents=tuple(text for row in rows for text in row[3:5] if text),
            special=all(row[2] is None or crs_search.SPECIAL.search(row[2]) is not None for row in rows),
        )
    return facts


def _drawing(columns: Sequence[Any]) -> list[tuple[int, float, int]]:
    """Codes, values and unit codes of the parameters in some columns, without the false origin."""
    parameters = zip(columns[::3], columns[1::3], columns[2::3], strict=True)
    return [(key, value, unit) for key, value, unit in parameters if key and key not in FALSE_ORIGINS]


# ---- the index of CRSs ---------------------------------------------------------------------------

OF_A_SPHERE = "It uses a sphere"
_SPHEROID = re.compile(r'SPHEROID\["[^"]*",([^,\]]+),([^,\]]+)')
_STANDS_FOR_AN_ELLIPSOID = 6.375e6  # metres: PROJ may take a sphere with the radius of the equator for an ellipsoid
_KEPT = 512  # CRSs of 35 kB each
_DIGITS = 11  # of parameters in SI units: 0.1 mm on the ground, and beyond the rounding of degrees to radians
_SHIFTS = ("False easting", "False northing", "Easting at", "Northing at")

Conversion = tuple[str, tuple[tuple[str, float], ...]]
"""The name of a method, and its parameters by name in SI units, longitudes from Greenwich, without false origins."""


@dataclass(frozen=True)
class CrsRecord:
    """Index entry: code, name, method, area of use (west, south, east, north in degrees) and its name."""

    code: str
    name: str
    method: str
    area_of_use: tuple[float, float, float, float]
    area_name: str

    @property
    def extent_km2(self) -> float:
        """Area of the box of the area of use, on a sphere."""
        west, south, east, north = self.area_of_use
        height = math.sin(math.radians(north)) - math.sin(math.radians(south))
        return math.radians((east - west) % 360.0 or 360.0) * height * (earth.MEAN_EARTH_RADIUS / 1000.0) ** 2


@dataclass(frozen=True)
class DatabaseCrs:
    """A CRS as a projection, with its datum; CRSs of one `conversion` draw the same map but for the false origin."""

    projection: Projection
    datum: str
    conversion: Conversion
    is_upright: bool


def crs_records(authorities: Sequence[str], *, deprecated: bool = False) -> list[CrsRecord]:
    """The projected CRSs of some authorities, in their order."""
    return [record for name in check_authorities(authorities) for record in _records_of(name, deprecated)]


@functools.cache
def _records_of(authority: str, deprecated: bool) -> tuple[CrsRecord, ...]:
    """Projected CRSs of an authority, each with its first area of use; only deprecated ones have several."""
    first: dict[str, CrsRecord] = {}
    for info in query_crs_info(authority, PJType.PROJECTED_CRS, allow_deprecated=deprecated):
        area, code = info.area_of_use, f"{info.auth_name}:{info.code}"
        if area is not None and area.south >= -90.0:  # PROJ has -1000 for what is unknown
            bounds = area.west, area.south, area.east, area.north
            method = info.projection_method_name or ""
            first.setdefault(code, CrsRecord(code, info.name, method, bounds, area.name or ""))
    return tuple(first.values())


@functools.lru_cache(maxsize=_KEPT)
def load_crs(code: str) -> DatabaseCrs:
    """The CRS of a code; raises ProjectionError if PROJ cannot compute it or it is not on an Earth ellipsoid."""
    world_map = _world_maps().get(code)
    crs = CRS.from_user_input(world_map.text if world_map else code)
    ellipsoid = crs.ellipsoid
    figure = (ellipsoid.semi_major_metre, ellipsoid.inverse_flattening) if ellipsoid else (0.0, 0.0)
    if reason := _reason_against(code, crs.name, *figure):
        raise ProjectionError(reason)
    upright = {axis.direction for axis in crs.axis_info} == {"east", "north"}
    operation = crs.coordinate_operation
    datum = crs.to_json_dict()["base_crs"]["name"]  # as `geodetic_crs`, for which PROJ may search its database
    prime = crs.prime_meridian
    meridian = float(prime.longitude) * float(prime.unit_conversion_factor) if prime else 0.0
    values: list[tuple[str, float]] = []
    for parameter in operation.params if operation else ():
        if isinstance(parameter.value, float) and not parameter.name.startswith(_SHIFTS):
            value = parameter.value * parameter.unit_conversion_factor
            value += meridian if "ongitude" in parameter.name else 0.0
            values.append((parameter.name, round(value, _DIGITS)))
    conversion = operation.method_name if operation else crs.name, tuple(sorted(values))
    try:
        projection = (world_map and world_map.projection(crs)) or Projection.from_user_input(code)
    except pyproj.exceptions.ProjError as error:
        raise not_computed(code, crs, error) from error
    return DatabaseCrs(projection, datum, conversion, upright)


class _WorldMap(NamedTuple):
    """A CRS that the database defines by a text, in which PROJ's names of WGS 84 replace ESRI's."""

    record: CrsRecord
    text: str

    def projection(self, crs: CRS) -> Projection | None:
        """The projection of the text's CRS, without a search of the database; raises pyproj's ProjError."""
        ellipsoid, operation = ellipsoid_of_crs(crs), crs.coordinate_operation
        function = Pipeline((operation and operation.to_proj4()) or "", 1.0)
        if ellipsoid is None or not function.transformer:
            return None
        return Projection(crs.name, self.record.code, ellipsoid, function, self.record.area_of_use)


# PROJ searches its tables for ESRI's names, 25 ms for each text.
_ESRIS = 'GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",'
_PROJS = 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",'


@functools.cache
def _world_maps() -> dict[str, _WorldMap]:
    records = {record.code: record for record in _records_of("ESRI", False)}
    query = "SELECT auth_name || ':' || code, text_definition FROM projected_crs WHERE text_definition LIKE ?"
    rows = catalogue.readable_rows(query, [f"%{_ESRIS}%"])
    return {code: _WorldMap(records[code], text.replace(_ESRIS, _PROJS)) for code, text in rows if code in records}


def reasons_against(codes: Iterable[str]) -> dict[str, str]:
    """Why CRSs are not on an Earth ellipsoid, by code, in the words of `load_crs`; only if the database tells."""
    # PROJ's database holds ESRI's world maps, half of them on spheres, as texts that PROJ takes 10 ms each to read.
    stated = _spheroids()
    found = {code: _reason_against(code, *stated[code]) for code in codes if code in stated}
    return {code: reason for code, reason in found.items() if reason}


def _reason_against(code: str, name: str, a: float, rf: float) -> str:
    """Why a CRS is not on an Earth ellipsoid; "" if it is."""
    if not (a > 0.0 and earth.Ellipsoid(a).is_earthly):
        return f"Invalid CRS '{code}'. It is not of the Earth: {support.shown(name)}."
    return "" if rf else f"{OF_A_SPHERE}, from which the Earth departs by 20 km."


@functools.cache
def _spheroids() -> dict[str, tuple[str, float, float]]:
    """Name, semi-major axis and inverse flattening of CRSs by code, where the database's text is unambiguous."""
    query = "SELECT auth_name || ':' || code, name, text_definition FROM projected_crs WHERE text_definition NOT NULL"
    found = {}
    for code, name, text in catalogue.readable_rows(query):  # what cannot be read is left to PROJ
        if spheroid := _SPHEROID.search(text):
            a, rf = float(spheroid[1]), float(spheroid[2])
            if rf or a < _STANDS_FOR_AN_ELLIPSOID:
                found[code] = (name, a, rf)
    return found


# ---- CRSs of one map -----------------------------------------------------------------------------

_FIGURE = 1e-8  # relative difference of axes: that of GRS 80 and WGS 84 is 2e-11
_SEXAGESIMAL = 9110  # EPSG's code for degrees, minutes and seconds as DDD.MMSSsss
_DEGREE = 9102

# Code, name, prime meridian, semi-axes in metres, method, parameters.
_MAPS = f"""
SELECT p.auth_name || ':' || p.code, p.name, d.prime_meridian_auth_name || ':' || d.prime_meridian_code,
       e.semi_major_axis * u.conv_factor,
       COALESCE(e.semi_minor_axis, e.semi_major_axis * (1.0 - COALESCE(1.0 / NULLIF(e.inv_flattening, 0), 0.0)))
           * u.conv_factor,
       c.method_auth_name || ':' || c.method_code, {_COLUMNS}
FROM projected_crs p
JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
JOIN ellipsoid e ON e.auth_name = d.ellipsoid_auth_name AND e.code = d.ellipsoid_code
JOIN unit_of_measure u ON u.auth_name = e.uom_auth_name AND u.code = e.uom_code
"""
_GIVEN = f"{_MAPS} WHERE p.auth_name = ? AND CAST(p.code AS TEXT) = ?"
_OTHERS = f"""{_MAPS} WHERE NOT p.deprecated AND c.method_auth_name || ':' || c.method_code = ?
ORDER BY p.auth_name, p.code"""


def codes_of_same_map(code: str) -> dict[str, str]:
    """Names by code of CRSs, not deprecated, that differ from one in datum, false origin, axes or unit only."""
    # Empty if the database has no parameters of the CRS in its columns, as for some of ESRI's, or cannot be read.
    given = next(iter(catalogue.readable_rows(_GIVEN, code.split(":", 1))), None)
    if given is None or given[5] is None:
        return {}
    units = "SELECT code, conv_factor FROM unit_of_measure WHERE auth_name = 'EPSG'"
    factors: dict[int, float | None] = dict(catalogue.readable_rows(units))
    drawn, a, b = _drawn(given, factors), given[3], given[4]
    return {
        row[0]: row[1]
        for row in catalogue.readable_rows(_OTHERS, [given[5]])
        if row[0] != code and max(abs(row[3] - a), abs(row[4] - b)) <= _FIGURE * a and _drawn(row, factors) == drawn
    }


def _drawn(row: Any, factors: Mapping[int, float | None]) -> Any:
    """Prime meridian and parameters in SI units, which determine a map up to translation."""
    return row[2], frozenset((key, _value(value, unit, factors)) for key, value, unit in _drawing(row[6:]))


def _value(value: float, unit: int, factors: Mapping[int, float | None]) -> float:
    """A value in SI units; unchanged if the unit is not one of EPSG's."""
    if unit == _SEXAGESIMAL:  # the digits of DDD.MMSSsss
        whole, _, digits = f"{abs(value):.11f}".partition(".")
        size = int(whole) + int(digits[:2]) / 60.0 + float(f"{digits[2:4]}.{digits[4:]}") / 3600.0
        value, unit = size if value >= 0.0 else -size, _DEGREE
    return round(value * (factors.get(unit) or 1.0), _DIGITS)
