"""Search of projected CRSs and named maps by words of their names, other names, areas of use, methods, and codes."""

from __future__ import annotations

import functools
import re
import sqlite3
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import pyproj.list

from projdist.projections.catalogue import ID_TITLES, NAMES, NOT_IN_METRES, NOT_MAPS, TITLES, database
from projdist.projections.database import check_authorities, year_of
from projdist.projections.errors import ProjectionError
from projdist.support import (
    Answer,
    check_text,
    check_whole_number,
    close_words,
    did_you_mean,
    listed,
    listed_values,
    shown,
)

_AUTHORITIES = ("", "EPSG", "ESRI", "IGNF")  # order of equally good hits; "" is for bare names
_MODERN = 1984  # year of the first satellite datum still in use
_BEGINNING = 3  # letters that suffice to find a word
# Score of a word of the query, by where it is found.
_IN_NAME, _BEGINS, _ELSEWHERE, _BEGINS_ELSEWHERE = 6, 4, 2, 1
_NO_NEWS = "zone"  # people say utm 33 for UTM zone 33
_VARIANT = re.compile(r"\((?:z?E[-,]z?N|z?N[-,]z?E)\)$")  # of EPSG's names, by their axes or a zone in the easting
_WORD = re.compile(r"[^\W\d_]+|\d+(?:\.\d+)?")

_QUERY = """
SELECT p.auth_name, CAST(p.code AS TEXT), p.name, p.deprecated, e.name, e.description,
       m.name, e.west_lon, e.south_lat, e.east_lon, e.north_lat,
       COALESCE(d.publication_date, (SELECT MIN(f.publication_date) FROM geodetic_datum_ensemble_member n
           JOIN geodetic_datum f ON f.auth_name = n.member_auth_name AND f.code = n.member_code
           WHERE n.ensemble_auth_name = d.auth_name AND n.ensemble_code = d.code)),
       (SELECT group_concat(a.alt_name, ' | ') FROM alias_name a
        WHERE a.table_name = 'projected_crs' AND a.auth_name = p.auth_name AND a.code = p.code)
FROM projected_crs p
LEFT JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
LEFT JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
LEFT JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
LEFT JOIN conversion_method m ON m.auth_name = c.method_auth_name AND m.code = c.method_code
LEFT JOIN usage u ON u.object_table_name = 'projected_crs' AND u.object_auth_name = p.auth_name
    AND u.object_code = p.code
LEFT JOIN extent e ON e.auth_name = u.extent_auth_name AND e.code = u.extent_code
GROUP BY p.auth_name, p.code
"""
_OTHER_KINDS = "SELECT auth_name || ':' || code, name, type FROM crs_view WHERE type != 'projected'"


@dataclass(frozen=True, kw_only=True)
class CrsHit:
    """A projected CRS or named map found by a search: its name and area of use.

    `code` is AUTHORITY:CODE or the name, as any command takes it. `area_of_use` is west, south, east, north in degrees,
    None where none is stated.
    """

    code: str
    name: str
    area_name: str = ""
    area_of_use: tuple[float, float, float, float] | None = None
    deprecated: bool = False


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CrsSearch(Answer):
    """Result of a search: the best `results` first, their number in `total`, and `advice` if there is none."""

    text: str
    total: int
    results: tuple[CrsHit, ...]
    advice: str = ""

    def _line(self) -> str:
        return f"{len(self.results)} of {self.total} for '{shown(self.text)}'" + (
            f", first {self.results[0].code}" if self.results else ""
        )

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
    punctuation do not count, and digits are words of their own: utm33n is utm 33 n.

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
        The `results`, a `CrsHit` each, and how many there are in `total`; where there is none, `advice` tells what may
        have been meant.

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
    most = check_whole_number("limit", limit)
    words = _WORD.findall(_folded(check_text("search", text)))
    if not words:
        raise ValueError(f"Invalid search '{shown(text)}'. It must have a word or a number.")
    entries, given = _entries(), listed_values(authorities)
    wanted = check_authorities(given, sorted({one.authority for one in entries} - {""})) if given else ()
    among = [one for one in entries if not wanted or one.authority in wanted]
    match = re.fullmatch(r"\s*(?:([A-Za-z][A-Za-z_0-9]*)\s*[:\s]\s*)?(\w+)\s*", text)  # as EPSG:3035 or 3035
    code = ((match[1] or "").upper(), match[2].upper()) if match else ("", "")
    ranked = sorted(
        (rank, k)
        for k, one in enumerate(among)
        if (rank := _rank(one, words, code)) is not None and (deprecated or not one.deprecated or one.has_code(code))
    )
    hits = tuple(among[k].hit for _, k in ranked[:most])
    advice = "" if ranked else _advice(text, words, among, deprecated)
    return CrsSearch(text=text, total=len(ranked), results=hits, advice=advice)


# ---- entries --------------------------------------------------------------------------------


class _Entry(NamedTuple):
    """A CRS and its searchable words: names, area of use, and `others` (method and countries of the area)."""

    authority: str
    code: str
    name: str
    names: str
    since: int = _MODERN
    deprecated: bool = False
    area_name: str = ""
    bounds: tuple[float, float, float, float] | None = None
    area: str = ""
    others: str = ""

    @property
    def hit(self) -> CrsHit:
        """The entry as a result."""
        return CrsHit(
            code=f"{self.authority}:{self.code}" if self.authority else self.code,
            name=self.name,
            area_name=self.area_name,
            area_of_use=self.bounds,
            deprecated=self.deprecated,
        )

    @property
    def words(self) -> list[str]:
        """All its words and numbers."""
        return _WORD.findall(f"{self.names} {self.area} {self.others}")

    def has_code(self, code: tuple[str, str]) -> bool:
        """True if it is the CRS of an authority ("" for any) and a code."""
        return bool(self.authority) and self.code == code[1] and code[0] in ("", self.authority)


@functools.cache
def _entries() -> tuple[_Entry, ...]:
    """All entries, the maps with bare names first; reading takes 0.2 s."""
    try:
        with database() as db:
            rows = db.execute(_QUERY).fetchall()
    except sqlite3.Error as error:
        raise ProjectionError(f"Invalid database of PROJ. It cannot be read: {error}.") from error
    left_out = {*NOT_MAPS, *NOT_IN_METRES, *ID_TITLES}
    titles = {text: key for key, text in pyproj.list.get_proj_operations_map().items() if key not in left_out}
    titles |= {title: name for name, title in reversed(TITLES.items())}  # the first name of a map
    ids = {name: operation.split()[0] for name, operation in NAMES.items()}
    named = (
        _Entry("", name, title, _folded(f"{name} {ids.get(name, '')} | {title}")) for title, name in titles.items()
    )
    return (*named, *(_entry(*row) for row in rows))


def _entry(authority: str, code: str, name: str, deprecated: int, area: str | None, *rest: Any) -> _Entry:
    """Entry of a row of the database."""
    countries, method, *bounds, date, aliases = rest
    known = None not in bounds and bounds[1] >= -90.0  # PROJ has -1000 for what is unknown
    return _Entry(
        authority=authority,
        code=code,
        name=name,
        names=_folded(f"{name} | {aliases or ''}"),
        since=year_of(date),
        deprecated=bool(deprecated),
        area_name=area or "",
        bounds=tuple(bounds) if known else None,
        area=_folded(area or ""),
        others=_folded(f"{countries or ''} {method or ''}"),
    )


def _folded(text: str) -> str:
    """Text in lower case, without accents."""
    if not text.isascii():
        text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return text.lower()


# ---- ranking --------------------------------------------------------------------------------

Rank = tuple[Any, ...]


def _rank(one: _Entry, words: Sequence[str], code: tuple[str, str]) -> Rank | None:
    """Sort key of an entry; None if it lacks a word."""
    is_code, text = one.has_code(code), f"{one.names} {one.area} {one.others}"
    if not is_code and not all(word in text for word in words):  # ten times faster than what follows
        return None
    # By authority, then by larger area, then by lower (older) code.
    authority = _AUTHORITIES.index(one.authority) if one.authority in _AUTHORITIES else len(_AUTHORITIES)
    west, south, east, north = one.bounds or (0.0, 0.0, 0.0, 0.0)
    size = -round(((east - west) % 360.0 or 360.0) * (north - south)) if one.bounds else 0
    number = len(one.code), one.code
    if is_code:
        return (0, authority, size, *number)
    names, area, others = (_WORD.findall(words) for words in (one.names, one.area, one.others))
    worth = [_worth(word, (*names, *area), others) for word in words]
    if not all(worth):
        return None
    spelt = _WORD.findall(_folded(one.name))
    whole = [spelt, area if one.authority else _WORD.findall(_folded(one.code))]
    tier = 1 if list(words) in whole else 2 if _phrase(words) in _phrase(names) else 3
    variant = _VARIANT.search(one.name) is not None
    old = one.since < _MODERN
    return (tier, -sum(worth), one.deprecated, old, authority, variant, size, len(spelt), *number)


def _phrase(words: Iterable[str]) -> str:
    """Words joined in order, with a space around each."""
    return f" {' '.join(word for word in words if word != _NO_NEWS)} "


def _worth(word: str, names: Sequence[str], others: Sequence[str]) -> int:
    """Score of a word in an entry; 0 if it is not found."""
    if word in names:
        return _IN_NAME
    begins = len(word) >= _BEGINNING and not word[0].isdigit()
    if begins and any(known.startswith(word) for known in names):
        return _BEGINS
    if word in others:
        return _ELSEWHERE
    return _BEGINS_ELSEWHERE if begins and any(known.startswith(word) for known in others) else 0


# ---- advice ---------------------------------------------------------------------------------


def _advice(text: str, words: Sequence[str], among: Sequence[_Entry], deprecated: bool) -> str:
    """Advice if nothing is found: another kind of CRS, close spellings, or fewer words."""
    wanted = _folded(" ".join(text.split()))
    with database() as db:
        for code, name, kind in db.execute(_OTHER_KINDS):
            if wanted in (code.lower(), code.lower().partition(":")[2], _folded(name)):
                return f"{code} is {_A[kind]} ({name}), and no map."
    known = {word for one in among for word in one.words}
    spelt = [_nearest(word, known) for word in words]
    if list(words) != spelt and all(spelt):
        return did_you_mean([f"'{' '.join(spelt)}'"]).strip()
    missing = [f"'{shown(word)}'" for word, near in zip(words, spelt, strict=True) if not near]
    if missing:
        return f"No name and no area of use has {listed(missing, 'or')}."
    if not deprecated and any(one.deprecated and _rank(one, words, ("", "")) is not None for one in among):
        return "Deprecated ones have these words: ask for them, too."
    return "No one has all of these words: take fewer of them."


def _nearest(word: str, known: set[str]) -> str:
    """The word itself if it finds anything, else a close spelling, else ""."""
    if word in known or word[0].isdigit():
        return word if word in known else ""
    if len(word) >= _BEGINNING and any(one.startswith(word) for one in known):
        return word
    letters = sorted(one for one in known if not one[0].isdigit() and len(one) >= _BEGINNING)
    return next(iter(close_words(word, letters)), "")


_A = {
    "geographic 2D": "a geographic CRS",
    "geographic 3D": "a geographic CRS with heights",
    "geocentric": "a geocentric CRS",
    "vertical": "a vertical CRS",
    "compound": "a compound CRS",
    "other": "a CRS of longitudes and latitudes",
}
