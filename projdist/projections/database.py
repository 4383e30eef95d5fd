"""Projected CRSs of PROJ's database: index, registry facts, and CRSs that draw the same map."""

from __future__ import annotations

import functools
import math
import re
import sqlite3
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pyproj import CRS as CRS  # for other rooms
from pyproj import proj_version_str
from pyproj.database import get_database_metadata, query_crs_info
from pyproj.enums import PJType

from projdist.earth import MEAN_EARTH_RADIUS, Ellipsoid
from projdist.projections.catalogue import database
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import greenwich_offset
from projdist.projections.projection import Projection
from projdist.support import check_text, close_words, did_you_mean, listed, listed_values, shown

_AT_ONCE = 500  # codes in a query: SQLite takes 999 values
FALSE_ORIGINS = {8806, 8807, 8816, 8817, 8826, 8827}
"""EPSG's codes of false eastings and northings, which only translate a map."""

# Scopes of special users, and scopes that state nothing.
_SPECIAL = re.compile(r"oil|gas |railway|tunnel|military|navigation|user-defined|not known|no official", re.IGNORECASE)


@dataclass(frozen=True)
class Facts:
    """Registry facts of a projected CRS: `frame` is the code of its geodetic CRS, `since` the year of its datum or 0.

    The year of a datum ensemble is that of its first member. `draws` identifies method, prime meridian and parameters
    without the false origin; `extents` are the names and descriptions of the areas of use. `special` is True if no
    scope is for general use.
    """

    frame: str
    since: int
    draws: Any
    extents: tuple[str, ...]
    special: bool


UNKNOWN = Facts("", 0, None, (), True)

_COLUMNS = ", ".join(f"c.param{n}_code, c.param{n}_value, c.param{n}_uom_code" for n in range(1, 8))
_QUERY = f"""
SELECT p.auth_name || ':' || p.code, g.auth_name || ':' || g.code,
       COALESCE(d.publication_date, (SELECT MIN(f.publication_date) FROM geodetic_datum_ensemble_member m
           JOIN geodetic_datum f ON f.auth_name = m.member_auth_name AND f.code = m.member_code
           WHERE m.ensemble_auth_name = d.auth_name AND m.ensemble_code = d.code)),
       s.scope, e.name, e.description, c.method_code, d.prime_meridian_code, {_COLUMNS}
FROM projected_crs p
LEFT JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
LEFT JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
LEFT JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
LEFT JOIN usage u ON u.object_table_name = 'projected_crs'
    AND u.object_auth_name = p.auth_name AND u.object_code = p.code
LEFT JOIN scope s ON s.auth_name = u.scope_auth_name AND s.code = u.scope_code
LEFT JOIN extent e ON e.auth_name = u.extent_auth_name AND e.code = u.extent_code
WHERE p.auth_name || ':' || p.code IN (%s)
"""


def proj_version() -> str:
    """PROJ and the registry in its database, as `PROJ 9.5.1, EPSG v11.022`."""
    return f"PROJ {proj_version_str}, EPSG {get_database_metadata('EPSG.VERSION')}"


def facts_of(codes: Collection[str]) -> dict[str, Facts]:
    """Facts of projected CRSs by code; empty if the database cannot be read."""
    found: dict[str, list[Any]] = {}  # a row for each usage
    wanted = list(codes)
    try:
        with database() as db:
            for start in range(0, len(wanted), _AT_ONCE):
                some = wanted[start : start + _AT_ONCE]
                for code, *row in db.execute(_QUERY % ", ".join("?" * len(some)), some):
                    found.setdefault(code, []).append(row)
    except sqlite3.Error:
        return {}
    facts = {}
    for code, rows in found.items():
        frame, date, _, _, _, method, meridian, *parameters = rows[0]
        values = zip(parameters[::3], parameters[1::3], parameters[2::3], strict=True)
        kept = frozenset(value for value in values if value[0] and value[0] not in FALSE_ORIGINS)
        facts[code] = Facts(
            frame=frame or "",
            since=year_of(date),
            draws=(method, meridian, kept) if method is not None else None,
            extents=tuple(text for row in rows for text in row[3:5] if text),
            special=all(row[2] is None or _SPECIAL.search(row[2]) is not None for row in rows),
        )
    return facts


def year_of(date: str | None) -> int:
    """Year of a registry date (1995-03-07, once March 2011); 0 if there is none."""
    year = re.search(r"\d{4}", date or "")
    return int(year[0]) if year else 0


# ---- the index of CRSs ---------------------------------------------------------------------------


AUTHORITIES = ("EPSG", "ESRI", "IGNF")
"""Authorities with projected CRSs of the Earth; IAU_2015's are of other planets."""

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
        return math.radians((east - west) % 360.0 or 360.0) * height * (MEAN_EARTH_RADIUS / 1000.0) ** 2


@dataclass(frozen=True)
class DatabaseCrs:
    """A CRS as a projection, with the name of its geodetic CRS as `datum` and its `conversion`.

    CRSs with the same `conversion` draw the same map up to the ellipsoid and the false origin. `is_upright` is True if
    the axes point east and north.
    """

    projection: Projection
    datum: str
    conversion: Conversion
    is_upright: bool


def check_authorities(authorities: Iterable[str] | str, known: Sequence[str] = AUTHORITIES) -> tuple[str, ...]:
    """Names of authorities in capitals, each once; raises ValueError for unknown ones, and for none."""
    given = (check_text("authority", name) for name in listed_values(authorities))
    names = tuple(dict.fromkeys(name.strip().upper() for name in given))
    for name in names:
        if name not in known:
            hint = did_you_mean(close_words(name, known))
            raise ValueError(f"Invalid authority '{shown(name)}'. {hint}It must be {listed(known, 'or')}.")
    if not names:
        raise ValueError(f"Invalid authority ''. It must be {listed(known, 'or')}.")
    return names


def crs_records(authorities: Sequence[str], *, deprecated: bool = False) -> list[CrsRecord]:
    """The projected CRSs of some authorities, in their order."""
    return [record for name in check_authorities(authorities) for record in _records_of(name, deprecated)]


@functools.cache
def _records_of(authority: str, deprecated: bool) -> tuple[CrsRecord, ...]:
    """Projected CRSs of an authority, each with its first area of use; only deprecated ones have several."""
    found = query_crs_info(auth_name=authority, pj_types=[PJType.PROJECTED_CRS], allow_deprecated=deprecated)
    records = (
        CrsRecord(
            f"{info.auth_name}:{info.code}",
            info.name,
            info.projection_method_name or "",
            (area.west, area.south, area.east, area.north),
            area.name or "",
        )
        for info in found
        if (area := info.area_of_use) is not None and area.south >= -90.0  # PROJ has -1000 for what is unknown
    )
    first: dict[str, CrsRecord] = {}
    for record in records:
        first.setdefault(record.code, record)
    return tuple(first.values())


@functools.lru_cache(maxsize=_KEPT)
def load_crs(code: str) -> DatabaseCrs:
    """The CRS of a code; raises ProjectionError if PROJ cannot compute it or it is not on an Earth ellipsoid."""
    crs = CRS.from_user_input(code)
    ellipsoid, geodetic = crs.ellipsoid, crs.geodetic_crs
    figure = (ellipsoid.semi_major_metre, ellipsoid.inverse_flattening) if ellipsoid else (0.0, 0.0)
    if reason := _reason_against(code, crs.name, *figure):
        raise ProjectionError(reason)
    upright = {axis.direction for axis in crs.axis_info} == {"east", "north"}
    operation, meridian = crs.coordinate_operation, math.radians(greenwich_offset(crs))
    values: list[tuple[str, float]] = []
    for parameter in operation.params if operation else ():
        if isinstance(parameter.value, float) and not parameter.name.startswith(_SHIFTS):
            value = parameter.value * parameter.unit_conversion_factor
            value += meridian if "ongitude" in parameter.name else 0.0
            values.append((parameter.name, round(value, _DIGITS)))
    conversion = operation.method_name if operation else crs.name, tuple(sorted(values))
    return DatabaseCrs(Projection.from_user_input(crs), geodetic.name if geodetic else "", conversion, upright)


def reasons_against(codes: Iterable[str]) -> dict[str, str]:
    """Why CRSs are not on an Earth ellipsoid, by code, worded as in `load_crs`; only those that the database tells.

    PROJ's database holds ESRI's world maps, half of them on spheres, as texts that PROJ takes 10 ms each to read.
    """
    stated = _spheroids()
    found = {code: _reason_against(code, *stated[code]) for code in codes if code in stated}
    return {code: reason for code, reason in found.items() if reason}


def _reason_against(code: str, name: str, a: float, rf: float) -> str:
    """Why a CRS is not on an Earth ellipsoid; "" if it is."""
    if not (a > 0.0 and Ellipsoid(a).is_earthly):
        return f"Invalid CRS '{code}'. It is not of the Earth: {shown(name)}."
    return "" if rf else f"{OF_A_SPHERE}, from which the Earth departs by 20 km."


@functools.cache
def _spheroids() -> dict[str, tuple[str, float, float]]:
    """Name, semi-major axis and inverse flattening of CRSs by code, where the database's text is unambiguous."""
    query = "SELECT auth_name || ':' || code, name, text_definition FROM projected_crs WHERE text_definition NOT NULL"
    try:
        with database() as db:
            rows = db.execute(query).fetchall()
    except sqlite3.Error:  # no such file or other tables: left to PROJ
        return {}
    found = {}
    for code, name, text in rows:
        if spheroid := _SPHEROID.search(text):
            a, rf = float(spheroid[1]), float(spheroid[2])
            if rf or a < _STANDS_FOR_AN_ELLIPSOID:
                found[code] = (name, a, rf)
    return found


def to_pyproj(code: str) -> CRS:
    """The pyproj CRS of a code."""
    return CRS.from_user_input(code)


# ---- CRSs of one map -----------------------------------------------------------------------------


_FIGURE = 1e-8  # of the axes: GRS 80 and WGS 84 differ by 2e-11 of them
_SEXAGESIMAL = 9110  # EPSG's code for degrees, minutes and seconds as DDD.MMSSsss
_DEGREE = 9102

_FROM = f"""
SELECT p.auth_name || ':' || p.code, p.name, d.prime_meridian_auth_name || ':' || d.prime_meridian_code,
       e.semi_major_axis * u.conv_factor, e.inv_flattening, e.semi_minor_axis * u.conv_factor,
       c.method_auth_name || ':' || c.method_code, {_COLUMNS}
FROM projected_crs p
JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
JOIN ellipsoid e ON e.auth_name = d.ellipsoid_auth_name AND e.code = d.ellipsoid_code
JOIN unit_of_measure u ON u.auth_name = e.uom_auth_name AND u.code = e.uom_code
"""
_GIVEN = f"{_FROM} WHERE p.auth_name = ? AND CAST(p.code AS TEXT) = ?"
_OTHERS = f"""{_FROM} WHERE NOT p.deprecated AND c.method_auth_name || ':' || c.method_code = ?
ORDER BY p.auth_name, p.code"""


def codes_of_same_map(code: str) -> dict[str, str]:
    """Names by code of the other CRSs that draw the same map as a CRS, without deprecated ones.

    They differ in datum, false origin, axes or unit only. Empty if the database has no parameters of the CRS in its
    columns, as for some of ESRI's, or cannot be read.
    """
    try:
        with database() as db:
            given = db.execute(_GIVEN, code.split(":", 1)).fetchone()
            if given is None or given[6] is None:
                return {}
            factors = dict(db.execute("SELECT code, conv_factor FROM unit_of_measure WHERE auth_name = 'EPSG'"))
            rows = db.execute(_OTHERS, (given[6],)).fetchall()
    except sqlite3.Error:
        return {}
    drawn, (a, b) = _drawn(given, factors), _axes(given)
    return {
        row[0]: row[1]
        for row in rows
        if row[0] != code
        and max(abs(_axes(row)[0] - a), abs(_axes(row)[1] - b)) <= _FIGURE * a
        and _drawn(row, factors) == drawn
    }


def _axes(row: Any) -> tuple[float, float]:
    """The semi-axes in metres."""
    a, rf, b = row[3:6]
    return a, b if b is not None else a * (1.0 - 1.0 / rf) if rf else a


def _drawn(row: Any, factors: Mapping[int, float | None]) -> Any:
    """Prime meridian and parameters in SI units, which determine a map up to translation."""
    values = zip(row[7::3], row[8::3], row[9::3], strict=True)
    return row[2], frozenset(
        (key, _value(value, unit, factors)) for key, value, unit in values if key and key not in FALSE_ORIGINS
    )


def _value(value: float, unit: int, factors: Mapping[int, float | None]) -> float:
    """A value in SI units; unchanged if the unit is not one of EPSG's."""
    if unit == _SEXAGESIMAL:  # the digits of DDD.MMSSsss
        whole, _, digits = f"{abs(value):.11f}".partition(".")
        size = int(whole) + int(digits[:2]) / 60.0 + float(f"{digits[2:4]}.{digits[4:]}") / 3600.0
        value, unit = size if value >= 0.0 else -size, _DEGREE
    return round(value * (factors.get(unit) or 1.0), _DIGITS)
