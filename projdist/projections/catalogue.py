"""Friendly names of textbook map projections, and suggestions for misspelt ones."""

import contextlib
import difflib
import functools
import re
import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyproj.database
import pyproj.list
from pyproj.datadir import get_data_dir
from pyproj.enums import PJType

from projdist import earth, support
from projdist.projections.errors import AUTHORITIES
from projdist.projections.worldmaps import WORLD_MAPS

WINKEL_PARALLEL = 50.4597762521898
"""arccos(2 / pi) in degrees, the standard parallel of Winkel's maps (Snyder, "Flattening the Earth", 1993)."""

_ROWS = earth.data_rows("projection_names.csv")
NAMES: dict[str, str] = {row["name"]: row["operation"] for row in _ROWS if row["operation"]}
"""PROJ's operation, with the parameters that make it that map, by name."""

TITLES: dict[str, str] = {row["name"]: row["title"] for row in _ROWS}
"""Names as the literature prints them: Snyder & Voxland, "An album of map projections", 1989, and the maps' authors."""

ID_TITLES = {row["operation"]: row["title"] for row in _ROWS if row["titles_operation"]}
"""Titles of PROJ's ids, which PROJ itself describes in several styles; of an id with several names the general one."""

TEXTBOOK_PARAMETERS: dict[str, str] = {"wink1": NAMES["winkel-1"], "wink2": NAMES["winkel-2"]}
"""Textbook parameters of PROJ ids whose defaults in PROJ give another map."""

NEEDED_PARAMETERS: dict[str, str] = {
    row["operation"]: row["example"] for row in earth.data_rows("needed_parameters.csv")
}
"""Example parameters of PROJ ids that PROJ refuses without them, at least on a sphere."""

KEYWORDS = {row["kind"]: frozenset(row["words"].split()) for row in earth.data_rows("keywords.csv")}
"""Keywords of PROJ, WKT and PROJJSON by what they are, from PROJ's source and the strings in its library."""

NOT_MAPS = KEYWORDS["no map"]
"""PROJ operations that are not map projections."""

NOT_IN_METRES = {
    "calcofi": "lines and stations of a survey off California",
    "s2": "places on the face of a cube, from 0 to 1",
}
"""PROJ operations whose output is not in metres, and what it is."""


# ---- hints ---------------------------------------------------------------------------------------

MOST_HINTS = 6  # Eckert and Wagner each made that many maps


def normalised(text: str) -> str:
    """A name in the catalogue's spelling: lower case with hyphens."""
    return re.sub(r"[\s_]+", "-", text.lower())


@functools.cache
def operation_titles() -> dict[str, str]:
    """Titles of PROJ's operations by id."""
    return pyproj.list.get_proj_operations_map() | ID_TITLES


def close_names(text: str) -> list[str]:
    """Names that begin with the text or are spelt like it, else those that the text begins with."""
    known, wanted = _spellings(), normalised(text)
    found = support.close_words(wanted, known) or [key for key in known if wanted.startswith(f"{key}-")]
    return list(dict.fromkeys(known[key] for key in found))[:MOST_HINTS]


def close_ids(text: str) -> list[str]:
    """PROJ ids of the maps of `close_names`."""
    return list(dict.fromkeys(NAMES.get(name, name).split()[0] for name in close_names(text) if name not in WORLD_MAPS))


def close_codes(text: str) -> list[str]:
    """The CRS code meant by `ESPG:3035`, `epsg3035`, `3035` or `102003`, as a list; empty if there is no such code."""
    match = re.fullmatch(r"(?:([A-Za-z]+)[\s:_-]*)?(\d+)", text)
    if not match:
        return []
    authorities = ["EPSG", "ESRI"]
    if match[1]:
        authorities = difflib.get_close_matches(
            match[1].upper(), pyproj.database.get_authorities(), n=1, cutoff=support.NEAR
        )
    known = (f"{name}:{match[2]}" for name in authorities if match[2] in pyproj.database.get_codes(name, PJType.CRS))
    return list(known)[:1]


def code_of_number(text: str) -> str:
    """The CRS code meant by `3035`, `epsg3035` or `102003`: a number is EPSG's, else Esri's; "" for other texts."""
    is_number = re.fullmatch(r"((epsg|esri)[\s_-]*)?\d+", text.strip(), re.IGNORECASE)
    return next(iter(close_codes(text.strip())), "") if is_number else ""


def codes_elsewhere(authority: str, number: str) -> list[str]:
    """CRSs of the Earth that have the same number with other authorities, as AUTHORITY:CODE."""
    others = (name for name in AUTHORITIES if name != authority)
    kinds = (PJType.PROJECTED_CRS, PJType.GEOGRAPHIC_2D_CRS, PJType.COMPOUND_CRS)
    return [
        f"{name}:{number}"
        for name in others
        if any(number in pyproj.database.get_codes(name, kind, allow_deprecated=True) for kind in kinds)
    ]


def folded(text: str) -> str:
    """A name without what programs write differently: capitals, spaces, underscores, brackets."""
    return re.sub(r"[^a-z0-9+]+", "", text.lower())


@functools.cache
def crs_names() -> dict[str, tuple[str, str]]:
    """Codes and names of the Earth's projected CRSs by folded name; the first authority's if several have the name."""
    found: dict[str, tuple[str, str]] = {}
    for authority in AUTHORITIES:
        for info in pyproj.database.query_crs_info(authority, PJType.PROJECTED_CRS):
            found.setdefault(folded(info.name), (f"{authority}:{info.code}", info.name))
    return found


def database_rows(query: str, values: Sequence[str] = ()) -> list[tuple[Any, ...]]:
    """The rows of a query of PROJ's database; raises sqlite3.Error if the file is missing or has other tables."""
    path = Path(get_data_dir(), "proj.db").resolve().as_uri()
    with contextlib.closing(sqlite3.connect(f"{path}?mode=ro", uri=True)) as connection:
        return connection.execute(query, values).fetchall()


def readable_rows(query: str, values: Sequence[str] = ()) -> list[tuple[Any, ...]]:
    """The rows of `database_rows`; none if the database cannot be read."""
    with contextlib.suppress(sqlite3.Error):
        return database_rows(query, values)
    return []


@functools.cache
def registered_names() -> frozenset[str]:
    """Names of all CRSs in PROJ's database, 1 MB; empty if it cannot be read."""
    return frozenset(name for (name,) in readable_rows("SELECT name FROM crs_view"))


@functools.cache
def _spellings() -> dict[str, str]:
    """Names by what users may call them: the names themselves, and PROJ's descriptions of its ids."""
    operations = {key: text for key, text in pyproj.list.get_proj_operations_map().items() if key not in NOT_MAPS}
    spellings = {normalised(name): name for name in [*NAMES, *WORLD_MAPS, *operations]}
    friendly = {operation: name for name, operation in NAMES.items()}
    for key, text in operations.items():
        spellings.setdefault(re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-"), friendly.get(key, key))
    return spellings
