"""What the registry of PROJ's database says of projected CRSs: who uses them for what, and on how old a datum.

It is read from the file, as pyproj tells neither scopes nor dates; where it cannot be read nothing is known.
"""

from __future__ import annotations

import contextlib
import re
import sqlite3
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pyproj import proj_version_str
from pyproj.database import get_database_metadata
from pyproj.datadir import get_data_dir

__all__ = ["FALSE_ORIGINS", "UNKNOWN", "Facts", "database", "facts_of", "proj_version", "year_of"]

_AT_ONCE = 500  # codes in a query: SQLite takes 999 values
FALSE_ORIGINS = {8806, 8807, 8816, 8817, 8826, 8827}
"""EPSG's codes of false eastings and northings, which move a map and do not change it."""

# Scopes of those who ask for a map for their own use, and of those that nobody states.
_SPECIAL = re.compile(r"oil|gas |railway|tunnel|military|navigation|user-defined|not known|no official", re.IGNORECASE)


_YEAR = re.compile(r"\d{4}")


@dataclass(frozen=True)
class Facts:
    """A projected CRS: `frame` is the code of its geodetic CRS, `since` the year of its datum, 0 where none is told.

    An ensemble of datums is as old as its first. `draws` identifies method, prime meridian and parameters but for the
    false origin; `extents` are the names and descriptions of the areas of use. `special` is whether no scope is one for
    everybody.
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


@contextlib.contextmanager
def database() -> Iterator[sqlite3.Connection]:
    """PROJ's database, to be read; raises sqlite3.Error where there is no such file."""
    path = Path(get_data_dir(), "proj.db").resolve().as_uri()
    with contextlib.closing(sqlite3.connect(f"{path}?mode=ro", uri=True)) as connection:
        yield connection


def proj_version() -> str:
    """PROJ and the registry in its database, as `PROJ 9.5.1, EPSG v11.022`."""
    return f"PROJ {proj_version_str}, EPSG {get_database_metadata('EPSG.VERSION')}"


def facts_of(codes: Collection[str]) -> dict[str, Facts]:
    """The facts of projected CRSs by their codes, as far as the database can be read."""
    found: dict[str, list[Any]] = {}
    wanted = list(codes)
    try:
        with database() as db:
            for start in range(0, len(wanted), _AT_ONCE):
                some = wanted[start : start + _AT_ONCE]
                for code, *row in db.execute(_QUERY % ", ".join("?" * len(some)), some):
                    found.setdefault(code, []).append(row)
    except sqlite3.Error:
        return {}
    return {code: _facts(rows) for code, rows in found.items()}


def year_of(date: str | None) -> int:
    """The year of a date of the registry, mostly as 1995-03-07, but once March 2011; 0 where there is none."""
    year = _YEAR.search(date or "")
    return int(year[0]) if year else 0


def _facts(rows: list[Any]) -> Facts:
    """The facts of one CRS, from a row for each of its usages."""
    frame, date, _, _, _, method, meridian, *parameters = rows[0]
    values = zip(parameters[::3], parameters[1::3], parameters[2::3], strict=True)
    kept = frozenset(value for value in values if value[0] and value[0] not in FALSE_ORIGINS)
    return Facts(
        frame or "",
        year_of(date),
        (method, meridian, kept) if method is not None else None,
        tuple(text for row in rows for text in row[3:5] if text),
        all(row[2] is None or _SPECIAL.search(row[2]) is not None for row in rows),
    )
