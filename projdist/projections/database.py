"""Projected CRSs of PROJ's database: index, registry facts, CRSs that draw the same map, and search by words."""

from __future__ import annotations

import functools
import json
import math
import re
import sqlite3
import unicodedata
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import pyproj.list
from pyproj import CRS as CRS  # for other rooms
from pyproj.database import get_database_metadata, query_crs_info
from pyproj.enums import PJType

from projdist import earth, support
from projdist.projections import catalogue
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import GeographicAxes, Pipeline, ellipsoid_of_crs
from projdist.projections.projection import Projection

FALSE_ORIGINS = {8806, 8807, 8816, 8817, 8826, 8827}
"""EPSG's codes of false eastings and northings, which only translate a map."""

# Scopes of special users, and scopes that state nothing.
_SPECIAL = re.compile(r"oil|gas |railway|tunnel|military|navigation|user-defined|not known|no official", re.IGNORECASE)


@dataclass(frozen=True)
class Facts:
    """Registry facts of a projected CRS."""

    frame: str  # code of its geodetic CRS
    since: int  # year of its datum, of an ensemble that of the first member; 0 if unknown
    draws: Any  # method, prime meridian and parameters without the false origin
    extents: tuple[str, ...]  # names and descriptions of the areas of use
    special: bool  # no scope is for general use


UNKNOWN = Facts("", 0, None, (), True)

# The registry's tables around a projected CRS p, and the year of its datum, of an ensemble that of the first member.
_TABLES = """projected_crs p
LEFT JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
LEFT JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
LEFT JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
LEFT JOIN conversion_method m ON m.auth_name = c.method_auth_name AND m.code = c.method_code
LEFT JOIN usage u ON u.object_table_name = 'projected_crs' AND u.object_auth_name = p.auth_name
    AND u.object_code = p.code
LEFT JOIN scope s ON s.auth_name = u.scope_auth_name AND s.code = u.scope_code
LEFT JOIN extent e ON e.auth_name = u.extent_auth_name AND e.code = u.extent_code"""
_DATE = """COALESCE(d.publication_date, (SELECT MIN(f.publication_date) FROM geodetic_datum_ensemble_member n
    JOIN geodetic_datum f ON f.auth_name = n.member_auth_name AND f.code = n.member_code
    WHERE n.ensemble_auth_name = d.auth_name AND n.ensemble_code = d.code))"""
_COLUMNS = ", ".join(f"c.param{n}_code, c.param{n}_value, c.param{n}_uom_code" for n in range(1, 8))
_FACTS = f"""
SELECT p.auth_name || ':' || p.code, g.auth_name || ':' || g.code, {_DATE},
       s.scope, e.name, e.description, c.method_code, d.prime_meridian_code, {_COLUMNS}
FROM {_TABLES}
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
            since=year_of(date),
            draws=(method, meridian, frozenset(_drawing(parameters))) if method is not None else None,
            extents=tuple(text for row in rows for text in row[3:5] if text),
            special=all(row[2] is None or _SPECIAL.search(row[2]) is not None for row in rows),
        )
    return facts


def _drawing(columns: Sequence[Any]) -> list[tuple[int, float, int]]:
    """Codes, values and units' codes of the parameters in some columns, without those of the false origin."""
    parameters = zip(columns[::3], columns[1::3], columns[2::3], strict=True)
    return [(key, value, unit) for key, value, unit in parameters if key and key not in FALSE_ORIGINS]


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
        return math.radians((east - west) % 360.0 or 360.0) * height * (earth.MEAN_EARTH_RADIUS / 1000.0) ** 2


@dataclass(frozen=True)
class DatabaseCrs:
    """A CRS as a projection, with its datum; CRSs of one `conversion` draw the same map but for the false origin."""

    projection: Projection
    datum: str
    conversion: Conversion
    is_upright: bool


def check_authorities(authorities: Iterable[str] | str, known: Sequence[str] = AUTHORITIES) -> tuple[str, ...]:
    """Names of authorities in capitals, each once; raises ValueError for unknown ones, and for none."""
    given = (support.check_text("authority", name) for name in support.listed_values(authorities))
    names = tuple(dict.fromkeys(name.strip().upper() for name in given))
    for name in names or ("",):
        if name not in known:
            hint = support.did_you_mean(support.close_words(name, known))
            raise ValueError(
                f"Invalid authority '{support.shown(name)}'. {hint}It must be {support.listed(known, 'or')}."
            )
    return names


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
    ellipsoid, geodetic = crs.ellipsoid, crs.geodetic_crs
    figure = (ellipsoid.semi_major_metre, ellipsoid.inverse_flattening) if ellipsoid else (0.0, 0.0)
    if reason := _reason_against(code, crs.name, *figure):
        raise ProjectionError(reason)
    upright = {axis.direction for axis in crs.axis_info} == {"east", "north"}
    operation = crs.coordinate_operation
    meridian = math.radians(GeographicAxes.of(geodetic).greenwich) if geodetic else 0.0
    values: list[tuple[str, float]] = []
    for parameter in operation.params if operation else ():
        if isinstance(parameter.value, float) and not parameter.name.startswith(_SHIFTS):
            value = parameter.value * parameter.unit_conversion_factor
            value += meridian if "ongitude" in parameter.name else 0.0
            values.append((parameter.name, round(value, _DIGITS)))
    conversion = operation.method_name if operation else crs.name, tuple(sorted(values))
    try:
        projection = (world_map and world_map.projection(crs)) or Projection.from_user_input(code)
    except pyproj.exceptions.ProjError:
        projection = Projection.from_user_input(code)  # whose words are clearer
    return DatabaseCrs(projection, geodetic.name if geodetic else "", conversion, upright)


class _WorldMap(NamedTuple):
    """A CRS that the database holds as a text with ESRI's names of WGS 84, here with PROJ's."""

    record: CrsRecord
    text: str

    def projection(self, crs: CRS) -> Projection | None:
        """That of the CRS of the text, without a search for it; raises pyproj's ProjError if PROJ cannot compute it."""
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
    """Why CRSs are not on an Earth ellipsoid, by code, worded as in `load_crs`; only those that the database tells."""
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

_FIGURE = 1e-8  # of the axes: GRS 80 and WGS 84 differ by 2e-11 of them
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


# ---- search by words --------------------------------------------------------------------------

_AUTHORITIES = ("", "EPSG", "ESRI", "IGNF")  # order of equally good hits; "" is for bare names
_MODERN = 1984  # year of the first satellite datum still in use
_BEGINNING = 3  # letters that suffice to find a word
# Score of a word of the query, by where it is found.
_IN_NAME, _BEGINS, _ELSEWHERE, _BEGINS_ELSEWHERE = 6, 4, 2, 1
_LAST = 4  # tier of hits by a word's beginning in a list of countries or a method, which others make needless
_NO_NEWS = "zone"  # people say utm 33 for UTM zone 33
_VARIANT = re.compile(r"\((?:z?E[-,]z?N|z?N[-,]z?E)\)$")  # of EPSG's names, by their axes or a zone in the easting
_WORD = re.compile(r"[^\W\d_]+|\d+(?:\.\d+)?")

_SEARCHED = f"""
SELECT p.auth_name, CAST(p.code AS TEXT), p.name, p.deprecated, e.name, e.description,
       m.name, e.west_lon, e.south_lat, e.east_lon, e.north_lat, {_DATE},
       (SELECT group_concat(a.alt_name, ' | ') FROM alias_name a
        WHERE a.table_name = 'projected_crs' AND a.auth_name = p.auth_name AND a.code = p.code)
FROM {_TABLES}
GROUP BY p.auth_name, p.code
"""
_OTHER_KINDS = "SELECT auth_name || ':' || code, name, type FROM crs_view WHERE type != 'projected'"


@dataclass(frozen=True, kw_only=True)
class CrsHit:
    """A projected CRS or named map found by a search: its name and area of use."""

    code: str  # AUTHORITY:CODE or the name, as any command takes it
    name: str
    area_name: str = ""
    area_of_use: tuple[float, float, float, float] | None = None  # west, south, east, north in degrees
    deprecated: bool = False


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CrsSearch(support.Answer):
    """Result of a search: the best `results` first, their number in `total`, and `advice` if there is none."""

    text: str
    total: int
    results: tuple[CrsHit, ...]
    advice: str = ""

    def _line(self) -> str:
        first = f", first {self.results[0].code}" if self.results else ""
        return f"{len(self.results)} of {self.total} for '{support.shown(self.text)}'{first}"

    def rows(self) -> list[dict[str, Any]]:
        """One flat row per result."""
        ends = ("west", "south", "east", "north")
        rows = (asdict(hit) | dict(zip(ends, hit.area_of_use or (None,) * 4, strict=True)) for hit in self.results)
        return [{key: value for key, value in row.items() if key != "area_of_use"} for row in rows]

    def _table(self) -> list[dict[str, Any]]:
        return self.rows()


def find_crs(
    text: str, *, authorities: Iterable[str] | str = (), deprecated: bool = False, limit: int = 10
) -> CrsSearch:
    """Projected CRSs and named maps by words of their names, areas of use and methods, or codes; the likeliest first.

    Every word must be found; a word of three letters or more may be the beginning of one. Capitals, accents and
    punctuation do not count, and digits are words of their own: utm33n is utm 33 n. A country or its people alone, as
    "switzerland" or "swiss", mean the CRSs of its areas of use, those for it alone first.

    Parameters
    ----------
    text : str
        The words, in any order, as "utm 33", "lambert 93", "new zealand transverse", "3035" or "EPSG:3035".
    authorities : iterable of str, or one of them, optional
        Only of these, as EPSG, ESRI, IGNF or IAU_2015.
    deprecated : bool, default False
        Deprecated ones, too. One whose code was given is found in any case.
    limit : int, default 10
        Largest number of results.

    Returns
    -------
    CrsSearch
        The `results`, a `CrsHit` each, their number in `total`, and if it is 0 `advice` on what may have been meant.

    Raises
    ------
    ValueError
        For a text without a word or a number, an unknown authority, and a limit that is no whole number.

    References
    ----------
    EPSG Geodetic Parameter Dataset, https://epsg.org, and the other registries in PROJ's database.

    Examples
    --------
    >>> [hit.code for hit in find_crs("lambert 93", limit=3).results]
    ['EPSG:2154', 'EPSG:9793', 'EPSG:9794']
    """
    most = support.check_whole_number("limit", limit)
    words = _WORD.findall(_folded(support.check_text("search", text)))
    if not words:
        raise ValueError(f"Invalid search '{support.shown(text)}'. It must have a word or a number.")
    entries, given = _entries(), support.listed_values(authorities)
    wanted = check_authorities(given, sorted({one.authority for one in entries} - {""})) if given else ()
    among = [one for one in entries if not wanted or one.authority in wanted]
    match = re.fullmatch(r"\s*(?:([A-Za-z][A-Za-z_0-9]*)\s*[:\s]\s*)?(\w+)\s*", text)  # as EPSG:3035 or 3035
    code = ((match[1] or "").upper(), match[2].upper()) if match else ("", "")
    country = _countries().get(_phrase(words), frozenset())
    able = ((k, one) for k, one in enumerate(among) if deprecated or not one.hit.deprecated or one.has_code(code))
    ranked = sorted((rank, k) for k, one in able if (rank := _rank(one, words, code, country)) is not None)
    ranked = [one for one in ranked if one[0][0] < _LAST] or ranked
    hits = tuple(among[k].hit for _, k in ranked[:most])
    advice = "" if ranked else _advice(text, words, among, deprecated)
    return CrsSearch(text=text, total=len(ranked), results=hits, advice=advice)


# ---- entries --------------------------------------------------------------------------------


class _Entry(NamedTuple):
    """A CRS or named map and its searchable words: names, area of use, and `others` (method, countries of the area)."""

    authority: str
    number: str
    hit: CrsHit
    names: str
    since: int = _MODERN
    area: str = ""
    others: str = ""

    def has_code(self, code: tuple[str, str]) -> bool:
        """True if it is the CRS of an authority ("" for any) and a code."""
        return bool(self.authority) and self.number == code[1] and code[0] in ("", self.authority)


@functools.cache
def _entries() -> tuple[_Entry, ...]:
    """All entries, the maps with bare names first; reading takes 0.2 s."""
    try:
        rows = catalogue.database_rows(_SEARCHED)
    except sqlite3.Error as error:
        raise ProjectionError(f"Invalid database of PROJ. It cannot be read: {error}.") from error
    left_out = {*catalogue.NOT_MAPS, *catalogue.NOT_IN_METRES, *catalogue.ID_TITLES}
    titles = {text: key for key, text in pyproj.list.get_proj_operations_map().items() if key not in left_out}
    titles |= {title: name for name, title in reversed(catalogue.TITLES.items())}  # the first name of a map
    ids = {name: operation.split()[0] for name, operation in catalogue.NAMES.items()}
    found = [
        _Entry("", name, CrsHit(code=name, name=title), _folded(f"{name} {ids.get(name, '')} | {title}"))
        for title, name in titles.items()
    ]
    for authority, number, name, deprecated, area, countries, method, *bounds, date, aliases in rows:
        known = None not in bounds and bounds[1] >= -90.0  # PROJ has -1000 for what is unknown
        code, use, old = f"{authority}:{number}", tuple(bounds) if known else None, bool(deprecated)
        hit = CrsHit(code=code, name=name, area_name=area or "", area_of_use=use, deprecated=old)
        others = _folded(f"{countries or ''} {method or ''}")
        names = _folded(f"{name} | {aliases or ''}")
        found.append(_Entry(authority, number, hit, names, year_of(date), _folded(area or ""), others))
    return tuple(found)


def _folded(text: str) -> str:
    """Text in lower case, without accents."""
    if not text.isascii():
        text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return text.lower()


# ---- ranking --------------------------------------------------------------------------------


@functools.cache
def _countries() -> dict[str, frozenset[str]]:
    """All names of a country, by each of them and by that of its people; not by those that a state has, too."""
    found: dict[str, frozenset[str]] = {}
    for row in earth.data_rows("countries.csv"):
        names = frozenset(map(_phrase_of, filter(None, [row["name"], *row["other_names"].split("|")])))
        found |= dict.fromkeys(names, names)
    found |= {_phrase_of(row["demonym"]): found[_phrase_of(row["country"])] for row in earth.data_rows("demonyms.csv")}
    states = {_phrase_of(row["name"]) for row in earth.data_rows("states.csv")}
    return {name: names for name, names in found.items() if name not in states}


def _score_in_country(one: _Entry, names: frozenset[str]) -> int:
    """Score of an entry by where its area of use has a country; 0 if it has none of it, or is within another one."""
    head = _phrase_of(one.area.split(" - ")[0])
    if head not in names and head in _countries():
        return 0
    for text, score in ((one.area, _IN_NAME), (one.others, _ELSEWHERE)):
        phrase = _phrase_of(text)
        if any(name in phrase for name in names):
            return score
    return 0


def _rank(one: _Entry, words: Sequence[str], code: tuple[str, str], country: frozenset[str]) -> tuple[Any, ...] | None:
    """Sort key of an entry; None if it lacks a word and does not lie in the country that the words name."""
    is_code, text = one.has_code(code), f"{one.names} {one.area} {one.others}"
    national = _score_in_country(one, country) if country and one.area else 0
    if not is_code and not national and not all(word in text for word in words):  # ten times faster than what follows
        return None
    # By authority, then by larger area, then by lower (older) code.
    authority = _AUTHORITIES.index(one.authority) if one.authority in _AUTHORITIES else len(_AUTHORITIES)
    west, south, east, north = one.hit.area_of_use or (0.0, 0.0, 0.0, 0.0)
    size = -round(((east - west) % 360.0 or 360.0) * (north - south)) if one.hit.area_of_use else 0
    number = len(one.number), one.number
    if is_code:
        return (0, authority, size, *number)
    names, area, others = (_WORD.findall(words) for words in (one.names, one.area, one.others))
    worth = [_worth(word, (*names, *area), others) for word in words]
    if not all(worth) and not national:
        return None
    spelt = _WORD.findall(_folded(one.hit.name))
    whole = [spelt, area if one.authority else _WORD.findall(_folded(one.number))]
    named = _phrase(words) in _phrase(names)
    if list(words) in whole:
        tier = 1
    elif national or (named and not country):
        tier = 2
    else:
        tier = _LAST if _BEGINS_ELSEWHERE in worth else 3
    score = national + _IN_NAME * (_phrase(words) in _phrase(spelt)) if national else sum(worth)
    at_sea = "offshore" in area and "onshore" not in area
    variant = _VARIANT.search(one.hit.name) is not None
    old = one.since < _MODERN
    return (tier, -score, one.hit.deprecated, old, not named, authority, variant, at_sea, size, len(spelt), *number)


def _phrase(words: Iterable[str]) -> str:
    """Words joined in order, with a space around each."""
    return f" {' '.join(word for word in words if word != _NO_NEWS)} "


def _phrase_of(text: str) -> str:
    """The phrase of a text's words."""
    return _phrase(_WORD.findall(_folded(text)))


def _worth(word: str, names: Sequence[str], others: Sequence[str]) -> int:
    """Score of a word in an entry; 0 if it is not found."""
    begins = len(word) >= _BEGINNING and not word[0].isdigit()
    for known, whole, beginning in ((names, _IN_NAME, _BEGINS), (others, _ELSEWHERE, _BEGINS_ELSEWHERE)):
        if word in known:
            return whole
        if begins and any(one.startswith(word) for one in known):
            return beginning
    return 0


# ---- advice ---------------------------------------------------------------------------------


def _advice(text: str, words: Sequence[str], among: Sequence[_Entry], deprecated: bool) -> str:
    """Advice if nothing is found: another kind of CRS, close spellings, or fewer words."""
    wanted = _folded(" ".join(text.split()))
    for code, name, kind in catalogue.database_rows(_OTHER_KINDS):
        if wanted in (code.lower(), code.lower().partition(":")[2], _folded(name)):
            return f"{code} is {_A[kind]} ({name}), and no map."
    known = {word for one in among for word in _WORD.findall(f"{one.names} {one.area} {one.others}")}
    spelt = [_nearest(word, known) for word in words]
    if list(words) != spelt and all(spelt):
        return support.did_you_mean([f"'{' '.join(spelt)}'"]).strip()
    missing = [f"'{support.shown(word)}'" for word, near in zip(words, spelt, strict=True) if not near]
    if missing:
        return f"No name and no area of use has {support.listed(missing, 'or')}."
    old = (one for one in among if one.hit.deprecated and not deprecated)
    if any(_rank(one, words, ("", ""), frozenset()) is not None for one in old):
        return "Deprecated ones have these words: ask for them, too."
    return "No one has all of these words: take fewer of them."


def _nearest(word: str, known: set[str]) -> str:
    """The word itself if it finds anything, else a close spelling, else ""."""
    if word in known or word[0].isdigit():
        return word if word in known else ""
    if len(word) >= _BEGINNING and any(one.startswith(word) for one in known):
        return word
    letters = sorted(one for one in known if not one[0].isdigit() and len(one) >= _BEGINNING)
    return next(iter(support.close_words(word, letters)), "")


_A = {
    "geographic 2D": "a geographic CRS",
    "geographic 3D": "a geographic CRS with heights",
    "geocentric": "a geocentric CRS",
    "vertical": "a vertical CRS",
    "compound": "a compound CRS",
    "other": "a CRS of longitudes and latitudes",
}
