"""The projected CRSs of PROJ's database: their index, and each as a projection with what identifies it."""

from __future__ import annotations

import functools
import math
import re
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pyproj import CRS
from pyproj.database import query_crs_info
from pyproj.enums import PJType

from projdist.earth import MEAN_EARTH_RADIUS, Ellipsoid
from projdist.projections.datums import greenwich_offset
from projdist.projections.errors import ProjectionError
from projdist.projections.projection import Projection
from projdist.projections.registry import database
from projdist.support import check_text, close_words, did_you_mean, listed, listed_values, shown

__all__ = [
    "AUTHORITIES",
    "CRS",
    "Conversion",
    "CrsRecord",
    "DatabaseCrs",
    "check_authorities",
    "crs_records",
    "load_crs",
    "reasons_against",
    "to_pyproj",
]

AUTHORITIES = ("EPSG", "ESRI", "IGNF")
"""Those with projected CRSs of the Earth; IAU_2015's are of other planets."""

OF_A_SPHERE = "It uses a sphere"
_SPHEROID = re.compile(r'SPHEROID\["[^"]*",([^,\]]+),([^,\]]+)')
_STANDS_FOR_AN_ELLIPSOID = 6.375e6  # metres; spheres of larger radius, that of an equator, PROJ may take for one
_KEPT = 512  # CRSs of 35 kB each
_DIGITS = 11  # of parameters in SI units: 0.1 mm on the ground, and beyond the rounding of degrees to radians
_SHIFTS = ("False easting", "False northing", "Easting at", "Northing at")

Conversion = tuple[str, tuple[tuple[str, float], ...]]
"""The name of a method, and its parameters by name in SI units."""


@dataclass(frozen=True)
class CrsRecord:
    """A line of the index: code, name, method, the area of use (west, south, east, north in degrees) and its name."""

    code: str
    name: str
    method: str
    area_of_use: tuple[float, float, float, float]
    area_name: str

    @property
    def extent_km2(self) -> float:
        """The area between the meridians and parallels of the area of use, on a sphere."""
        west, south, east, north = self.area_of_use
        height = math.sin(math.radians(north)) - math.sin(math.radians(south))
        return math.radians((east - west) % 360.0 or 360.0) * height * (MEAN_EARTH_RADIUS / 1000.0) ** 2


@dataclass(frozen=True)
class DatabaseCrs:
    """A CRS as a projection, its datum by the name of the geodetic CRS, and the identity of its conversion.

    Two CRSs of one `conversion` draw the same map, but for the figure of their ellipsoids and the
    place of the false origin. `is_upright` is whether the axes point east and north.
    """

    projection: Projection
    datum: str
    conversion: Conversion
    is_upright: bool


def check_authorities(authorities: Sequence[str]) -> tuple[str, ...]:
    """Names of authorities in capitals, each once; raises ValueError for one without maps of the Earth."""
    given = (check_text("authority", name) for name in listed_values(authorities))
    names = tuple(dict.fromkeys(name.strip().upper() for name in given))
    for name in names:
        if name not in AUTHORITIES:
            hint = did_you_mean(close_words(name, AUTHORITIES))
            raise ValueError(f"Invalid authority '{name}'. {hint}It must be {listed(AUTHORITIES, 'or')}.")
    if not names:
        raise ValueError(f"Invalid authority ''. It must be {listed(AUTHORITIES, 'or')}.")
    return names


def crs_records(authorities: Sequence[str], *, deprecated: bool = False) -> list[CrsRecord]:
    """The projected CRSs of some authorities, in their order."""
    return [record for name in check_authorities(authorities) for record in _records_of(name, deprecated)]


@functools.cache
def _records_of(authority: str, deprecated: bool) -> tuple[CrsRecord, ...]:
    """The projected CRSs of an authority, each with its first area of use, as all but deprecated ones have one."""
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
    """The CRS of a code; raises ProjectionError where PROJ cannot compute it or it is not of the Earth's ellipsoid."""
    crs = CRS.from_user_input(code)
    ellipsoid, geodetic = crs.ellipsoid, crs.geodetic_crs
    figure = (ellipsoid.semi_major_metre, ellipsoid.inverse_flattening) if ellipsoid else (0.0, 0.0)
    if reason := _reason_against(code, crs.name, *figure):
        raise ProjectionError(reason)
    upright = {axis.direction for axis in crs.axis_info} == {"east", "north"}
    return DatabaseCrs(Projection.from_user_input(crs), geodetic.name if geodetic else "", _conversion(crs), upright)


def reasons_against(codes: Iterable[str]) -> dict[str, str]:
    """Why CRSs are not of the Earth's ellipsoid, as `load_crs` says, by code, for those whose text tells it at once.

    PROJ's database has the maps of the whole world of ESRI, half of them of spheres, as texts that
    take PROJ ten milliseconds each to read.
    """
    stated = _spheroids()
    found = {code: _reason_against(code, *stated[code]) for code in codes if code in stated}
    return {code: reason for code, reason in found.items() if reason}


def _reason_against(code: str, name: str, a: float, rf: float) -> str:
    """Why a CRS is not of the Earth's ellipsoid, or nothing."""
    if not (a > 0.0 and Ellipsoid(a).is_earthly):
        return f"Invalid CRS '{code}'. It is not of the Earth: {shown(name)}."
    return "" if rf else f"{OF_A_SPHERE}, from which the Earth departs by 20 km."


@functools.cache
def _spheroids() -> dict[str, tuple[str, float, float]]:
    """Name, semi-major axis and inverse flattening of CRSs by code, as far as the database's texts are clear."""
    query = "SELECT auth_name || ':' || code, name, text_definition FROM projected_crs WHERE text_definition NOT NULL"
    try:
        with database() as db:
            rows = db.execute(query).fetchall()
    except sqlite3.Error:  # no such file, or other tables: PROJ will read them
        return {}
    found = {}
    for code, name, text in rows:
        if spheroid := _SPHEROID.search(text):
            a, rf = float(spheroid[1]), float(spheroid[2])
            if rf or a < _STANDS_FOR_AN_ELLIPSOID:
                found[code] = (name, a, rf)
    return found


def to_pyproj(code: str) -> CRS:
    """The CRS of a code as pyproj's."""
    return CRS.from_user_input(code)


def _conversion(crs: CRS) -> Conversion:
    """Method, and parameters in SI units, longitudes from Greenwich; no false origins."""
    operation = crs.coordinate_operation
    if operation is None:
        return crs.name, ()
    meridian = math.radians(greenwich_offset(crs))
    values: list[tuple[str, float]] = []
    for parameter in operation.params:
        if isinstance(parameter.value, float) and not parameter.name.startswith(_SHIFTS):
            value = parameter.value * parameter.unit_conversion_factor
            value += meridian if "ongitude" in parameter.name else 0.0
            values.append((parameter.name, round(value, _DIGITS)))
    return operation.method_name, tuple(sorted(values))
