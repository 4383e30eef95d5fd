"""CRSs of the database that draw the same map: of one method, its parameters and one figure of the Earth."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from typing import Any

from projdist.projections.registry import FALSE_ORIGINS, database

__all__ = ["codes_of_same_map"]

_FIGURE = 1e-8  # of the axes: GRS 80 and WGS 84 differ by 2e-11 of them
_DIGITS = 11  # of parameters in SI units: the rounding of degrees to radians
_SEXAGESIMAL = 9110  # EPSG's code for degrees, minutes and seconds as DDD.MMSSsss
_DEGREE = 9102

_COLUMNS = ", ".join(f"c.param{n}_code, c.param{n}_value, c.param{n}_uom_code" for n in range(1, 8))
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
    """The names of other CRSs by their codes, none deprecated, which draw the map of a code.

    They differ in their datum, the false origin, the axes or the unit only. Nothing where the database has no
    parameters of the CRS in its columns, as of some of ESRI's, or cannot be read.
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
    """What makes a map but for its place in the plane: prime meridian, and parameters in SI units."""
    values = zip(row[7::3], row[8::3], row[9::3], strict=True)
    return row[2], frozenset(
        (key, _value(value, unit, factors)) for key, value, unit in values if key and key not in FALSE_ORIGINS
    )


def _value(value: float, unit: int, factors: Mapping[int, float | None]) -> float:
    """A value in SI units; as it is where the unit is none of EPSG's."""
    if unit == _SEXAGESIMAL:
        value, unit = _degrees(value), _DEGREE
    return round(value * (factors.get(unit) or 1.0), _DIGITS)


def _degrees(value: float) -> float:
    """Degrees of DDD.MMSSsss, read from its digits."""
    whole, _, digits = f"{abs(value):.11f}".partition(".")
    size = int(whole) + int(digits[:2]) / 60.0 + float(f"{digits[2:4]}.{digits[4:]}") / 3600.0
    return size if value >= 0.0 else -size
