"""Search of PROJ's database for CRSs by words, and the CRS that a text names."""

from __future__ import annotations

import contextlib
import functools
import re
import sqlite3
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import pyproj.list

from projdist import earth, support
from projdist._typing import FloatArray, IntArray
from projdist.projections.catalogue import ID_TITLES, NAMES, NOT_IN_METRES, NOT_MAPS, TITLES, database_rows, folded
from projdist.projections.errors import AUTHORITIES, ProjectionError, check_authorities

# ---- CRSs of the registry ------------------------------------------------------------------------

# The registry's tables around a projected CRS p, and the year of its datum, of an ensemble that of the first member.
TABLES = """projected_crs p
LEFT JOIN geodetic_crs g ON g.auth_name = p.geodetic_crs_auth_name AND g.code = p.geodetic_crs_code
LEFT JOIN geodetic_datum d ON d.auth_name = g.datum_auth_name AND d.code = g.datum_code
LEFT JOIN conversion_table c ON c.auth_name = p.conversion_auth_name AND c.code = p.conversion_code
LEFT JOIN conversion_method m ON m.auth_name = c.method_auth_name AND m.code = c.method_code
LEFT JOIN usage u ON u.object_table_name = 'projected_crs' AND u.object_auth_name = p.auth_name
    AND u.object_code = p.code
LEFT JOIN scope s ON s.auth_name = u.scope_auth_name AND s.code = u.scope_code
LEFT JOIN extent e ON e.auth_name = u.extent_auth_name AND e.code = u.extent_code"""
DATE = """COALESCE(d.publication_date, (SELECT MIN(f.publication_date) FROM geodetic_datum_ensemble_member n
    JOIN geodetic_datum f ON f.auth_name = n.member_auth_name AND f.code = n.member_code
    WHERE n.ensemble_auth_name = d.auth_name AND n.ensemble_code = d.code))"""


VARIANT = re.compile(r"\((?:z?E[-,]z?N|z?N[-,]z?E)\)$")
"""The end of EPSG's names of CRSs that differ from others only by their axes, or by a zone number in the easting."""

_REALISATION = re.compile(r"\s*[(/\[]|\s+v\d")
"""The beginning of a realisation's name after that of its datum."""


def datum_root(datum: str) -> str:
    """The name of a datum without its realisation: NAD83 of NAD83(2011), RGF93 of RGF93 v2b."""
    return _REALISATION.split(datum, maxsplit=1)[0]


def _datum_of(name: str) -> str:
    """The root of the datum in the name of a CRS: ETRS89 of ETRS89/DREF91/2016 / UTM zone 32N."""
    return datum_root(name.partition(" / ")[0])


def year_of(date: str | None) -> int:
    """Year of a registry date (1995-03-07, once March 2011); 0 if there is none."""
    year = re.search(r"\d{4}", date or "")
    return int(year[0]) if year else 0


# ---- search by words --------------------------------------------------------------------------

_AUTHORITIES = ("", "EPSG", "ESRI", "IGNF")  # order of equally good hits; "" is for bare names
_MODERN = 1984  # year of the first satellite datum still in use
_BEGINNING = 3  # letters that suffice to find a word
# Score of a word of the query, by where it is found.
_IN_NAME, _BEGINS, _ELSEWHERE, _BEGINS_ELSEWHERE = 6, 4, 2, 1
_LAST = 4  # tier of hits by the beginning of a word in a list of countries or a method: left out if there are others
_IGNORED = "zone"  # people say utm 33 for UTM zone 33
_WORD = re.compile(r"[^\W\d_]+|\d+(?:\.\d+)?")
_YEAR = re.compile(r"\b(?:19|20)\d\d\b")
_OLD = re.compile(r"\b(?:old|former|obsolete|superseded|reconstruction)\b", re.IGNORECASE)
_WHOLE, _MINOR = 0.9, 0.1  # shares of a country's people
# Scopes of special users, and scopes that state nothing.
SPECIAL = re.compile(
    r"oil|gas |railway|highway|tunnel|project|military|navigation|user-defined|not known|no official", re.IGNORECASE
)
# Uses, the preferred first: maps of most scales, surveys, other maps; statistics and the like come after them.
_USES = [
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"topographic mapping(?! \((?:large|small|medium and small) scale)",
        r"survey|cadastr|large scale",
        r"mapping|presentation|management|GIS|legal",
    )
]
_SURVEYS = 1  # index of the last use that several countries agree on

_SEARCHED = f"""
SELECT p.auth_name, CAST(p.code AS TEXT), p.name, p.deprecated, e.name, e.description,
       m.name, e.west_lon, e.south_lat, e.east_lon, e.north_lat, {DATE},
       (SELECT group_concat(a.alt_name, ' | ') FROM alias_name a
        WHERE a.table_name = 'projected_crs' AND a.auth_name = p.auth_name AND a.code = p.code),
       group_concat(s.scope, '|')
FROM {TABLES}
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

    _table = rows


def find_crs(
    text: str, *, authorities: Iterable[str] | str = (), deprecated: bool = False, limit: int = 10
) -> CrsSearch:
    """Projected CRSs and named maps by words of their names, areas of use and methods, or codes; the likeliest first.

    Every word must be found; a word of three letters or more may be the beginning of one. Capitals, accents and
    punctuation do not count, and digits are words of their own: utm33n is utm 33 n. A country or its people alone, as
    "switzerland" or "swiss", mean the CRSs of its areas of use, what its agency uses first.

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
    country = _countries().get(_phrase(words))
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
    years: tuple[int, int] = (_MODERN, _MODERN)  # of its datum and of the latest realisation of that; 0 if unknown
    area: str = ""
    others: str = ""
    scopes: str = ""

    @property
    def is_old(self) -> bool:
        """True if its datum is from before satellites, or its name calls it old."""
        return self.years[0] < _MODERN or _OLD.search(self.hit.name) is not None

    @property
    def is_variant(self) -> bool:
        """True if it differs from another CRS only by its axes or the zone in its easting."""
        return VARIANT.search(self.hit.name) is not None

    def has_code(self, code: tuple[str, str]) -> bool:
        """True if it is the CRS of an authority ("" for any) and a code."""
        return bool(self.authority) and self.number == code[1] and code[0] in ("", self.authority)


@functools.cache
def _entries() -> tuple[_Entry, ...]:
    """All entries, the maps with bare names first; reading takes 0.2 s."""
    try:
        rows = database_rows(_SEARCHED)
    except sqlite3.Error as error:
        raise ProjectionError(f"Invalid database of PROJ. It cannot be read: {error}.") from error
    left_out = {*NOT_MAPS, *NOT_IN_METRES, *ID_TITLES}
    titles = {text: key for key, text in pyproj.list.get_proj_operations_map().items() if key not in left_out}
    titles |= {title: name for name, title in reversed(TITLES.items())}  # the first name of a map
    ids = {name: operation.split()[0] for name, operation in NAMES.items()}
    found = [
        _Entry("", name, CrsHit(code=name, name=title), _folded(f"{name} {ids.get(name, '')} | {title}"))
        for title, name in titles.items()
    ]
    latest: dict[str, int] = {}  # year of a datum, whose realisations count as one
    for row in rows:
        latest[_datum_of(row[2])] = max(latest.get(_datum_of(row[2]), 0), year_of(row[-3]))
    for authority, number, name, deprecated, area, countries, method, *bounds, date, aliases, scopes in rows:
        known = None not in bounds and bounds[1] >= -90.0  # PROJ has -1000 for what is unknown
        code, use, old = f"{authority}:{number}", tuple(bounds) if known else None, bool(deprecated)
        hit = CrsHit(code=code, name=name, area_name=area or "", area_of_use=use, deprecated=old)
        others = _folded(f"{countries or ''} {method or ''}")
        names, years = _folded(f"{name} | {aliases or ''}"), (year_of(date), latest[_datum_of(name)])
        found.append(_Entry(authority, number, hit, names, years, _folded(area or ""), others, scopes or ""))
    return tuple(found)


def _folded(text: str) -> str:
    """Text in lower case, without accents."""
    if not text.isascii():
        text = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    return text.lower()


# ---- ranking --------------------------------------------------------------------------------


class _Country(NamedTuple):
    """A country: the phrases of all its names, and its ISO code of two letters, "" if it has none."""

    names: frozenset[str]
    iso: str

    def score(self, one: _Entry) -> int:
        """Score of an entry by where its area of use names the country; 0 if it does not, or is in another one."""
        head, *rest = map(_phrase_of, one.area.split(" - "))
        if self.names.isdisjoint([head, *rest[:1]]) and head in _countries():
            return 0
        for text, score in ((one.area, _IN_NAME), (one.others, _ELSEWHERE)):
            phrase = _phrase_of(text)
            if any(name in phrase for name in self.names):
                return score
        return 0

    def fit(self, one: _Entry, score: int) -> tuple[Any, ...]:
        """Sort key of an entry with a score: what the country's surveyors and mapmakers use comes first."""
        share, is_own = self._share(one), score == _IN_NAME
        general = [scope for scope in one.scopes.split("|") if scope and not SPECIAL.search(scope)]
        use = next((k for k, pattern in enumerate(_USES) if any(map(pattern.search, general))), len(_USES))
        return (
            one.hit.deprecated,
            0 if (general if is_own else use <= _SURVEYS) else 1 if is_own else 2,  # 1 for its special, 2 for wide ones
            share < _MINOR,
            one.is_old,
            use == len(_USES),  # statistics
            one.is_variant,
            -min(round(share, 1), _WHOLE),
            not (is_own and share >= _WHOLE),
            use,
            not is_own,
            -one.years[1],
            -round(share, 2),
        )

    def _share(self, one: _Entry) -> float:
        """Share of the people of its towns who live in the box of an area of use."""
        lon, lat, people = _towns(self.iso)
        if one.hit.area_of_use is None or not people.size:
            return 0.0
        west, south, east, north = one.hit.area_of_use
        inside = ((lon - west) % 360.0 <= (east - west) % 360.0) & (south <= lat) & (lat <= north)
        return float(people[inside].sum() / people.sum())


@functools.cache
def _towns(iso: str) -> tuple[FloatArray, FloatArray, IntArray]:
    """Longitudes, latitudes and people of the towns of a country."""
    cities = earth.cities()
    here = cities.country == iso
    return cities.lon[here], cities.lat[here], cities.population[here]


@functools.cache
def _countries() -> dict[str, _Country]:
    """Countries by all of their names and by their people's; names that a US state has, too, are left out."""
    found: dict[str, _Country] = {}
    for row in earth.data_rows("countries.csv"):
        names = frozenset(map(_phrase_of, filter(None, [row["name"], *row["other_names"].split("|")])))
        found |= dict.fromkeys(names, _Country(names, row["iso_a2"]))
    found |= {_phrase_of(row["demonym"]): found[_phrase_of(row["country"])] for row in earth.data_rows("demonyms.csv")}
    states = {_phrase_of(row["name"]) for row in earth.data_rows("states.csv")}
    return {name: country for name, country in found.items() if name not in states}


def _rank(one: _Entry, words: Sequence[str], code: tuple[str, str], country: _Country | None) -> tuple[Any, ...] | None:
    """Sort key of an entry; None if it lacks a word and is not of the country that the words name."""
    hit, text = one.hit, f"{one.names} {one.area} {one.others}"
    is_code, national = one.has_code(code), country.score(one) if country and one.area else 0
    if not is_code and not national and not all(word in text for word in words):  # ten times faster than what follows
        return None
    authority = _AUTHORITIES.index(one.authority) if one.authority in _AUTHORITIES else len(_AUTHORITIES)
    west, south, east, north = hit.area_of_use or (0.0, 0.0, 0.0, 0.0)
    size = -round(((east - west) % 360.0 or 360.0) * (north - south)) if hit.area_of_use else 0
    number = len(one.number), one.number  # the lower is the older one
    if is_code:
        return (0, authority, size, *number)
    names, area, others = (_WORD.findall(words) for words in (one.names, one.area, one.others))
    worth = [_worth(word, (*names, *area), others) for word in words]
    if not all(worth) and not national:
        return None
    spelt = _WORD.findall(_folded(hit.name))
    named, itself = (_phrase(words) in _phrase(known) for known in (names, spelt))  # perhaps by an alias only
    fit: tuple[Any, ...] = (-sum(worth), hit.deprecated, one.is_old)
    if country and national:
        tier, fit = 2, country.fit(one, national)
    elif list(words) in [spelt, area if one.authority else _WORD.findall(_folded(one.number))]:
        tier = 1
    elif named and not country:
        tier = 2
    else:
        tier = _LAST if _BEGINS_ELSEWHERE in worth else 3
    at_sea = "offshore" in area and "onshore" not in area
    # The latest year in the name of a map (2008 of Belgian Lambert 2008), 0 without one, -1 for what is called old.
    edition = -1 if _OLD.search(hit.name) else max(map(int, _YEAR.findall(hit.name.rpartition(" / ")[2])), default=0)
    behind = (not named, authority, one.is_variant, not itself, at_sea)
    return (tier, *fit, *behind, size, -edition, len(spelt), *number)


def _phrase(words: Iterable[str]) -> str:
    """Words joined in order, with a space around each."""
    return f" {' '.join(word for word in words if word != _IGNORED)} "


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


_LONGEST_NAME = 100  # letters
_IN_BRACKETS = re.compile(r"\([^)]*\)")


def meanings(text: str) -> tuple[list[CrsHit], bool]:
    """CRSs in force whose names have all words of a text, likeliest first, and whether the text names a single one."""
    words = _WORD.findall(_folded(text))
    if not words or len(text) > _LONGEST_NAME or _phrase(words) in _countries():
        return [], False
    having: dict[str, _Entry] = {}
    with contextlib.suppress(ProjectionError):  # of a database that cannot be read
        able = (one for one in _entries() if one.authority in AUTHORITIES and all(word in one.names for word in words))
        having = {one.hit.code: one for one in able if set(words) <= {*_WORD.findall(one.names)}}
    # Words side by side mean these; then come datums in force, and EPSG's before copies.
    named = {code: one for code, one in having.items() if _phrase(words) in _phrase_of(one.names)}
    having = named or having
    having = {code: one for code, one in having.items() if not one.is_old} or having
    having = {code: one for code, one in having.items() if one.authority == AUTHORITIES[0]} or having
    found: dict[str, CrsHit] = {}
    for hit in find_crs(text, limit=len(_entries())).results if having else ():
        if hit.code in having:
            datum, slash, name = hit.name.rpartition(" / ")
            key = folded(datum_root(datum) + slash + _IN_BRACKETS.sub("", name))  # the same for all realisations
            found.setdefault(key, hit)
    return list(found.values()), bool(named) and len(found) == 1 < len(words)


# ---- advice ---------------------------------------------------------------------------------


def _advice(text: str, words: Sequence[str], among: Sequence[_Entry], deprecated: bool) -> str:
    """Advice if nothing is found: another kind of CRS, close spellings, or fewer words."""
    wanted = _folded(" ".join(text.split()))
    for code, name, kind in database_rows(_OTHER_KINDS):
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
    if any(_rank(one, words, ("", ""), None) is not None for one in old):
        return "Deprecated ones have these words: ask for them, too."
    return "No one has all of these words: take fewer of them."


def _nearest(word: str, known: set[str]) -> str:
    """The word itself if it matches anything, else a close spelling, else ""."""
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
