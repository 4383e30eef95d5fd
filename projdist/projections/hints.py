"""What text that names no projection may have been meant for."""

from __future__ import annotations

import difflib
import functools
import re

import pyproj.database
import pyproj.list
from pyproj.enums import PJType

from projdist.projections.catalogue import ID_TITLES, NAMES, NOT_MAPS
from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import NEAR, close_words

_OF_THE_EARTH = ("EPSG", "ESRI", "IGNF")
_MOST = 6  # as many as Eckert and Wagner made maps


def normalised(text: str) -> str:
    """A name in the catalogue's spelling: small letters and hyphens."""
    return re.sub(r"[\s_]+", "-", text.lower())


@functools.cache
def operation_titles() -> dict[str, str]:
    """What PROJ's operations are called, by their ids."""
    return pyproj.list.get_proj_operations_map() | ID_TITLES


def close_names(text: str) -> list[str]:
    """Names that begin with the text, or are spelt nearly so, or that it begins with; none for nonsense."""
    known, wanted = _spellings(), normalised(text)
    found = close_words(wanted, known) or [key for key in known if wanted.startswith(f"{key}-")]
    return list(dict.fromkeys(known[key] for key in found))[:_MOST]


def close_ids(text: str) -> list[str]:
    """PROJ ids of the maps of `close_names`."""
    return list(dict.fromkeys(NAMES.get(name, name).split()[0] for name in close_names(text) if name not in WORLD_MAPS))


def close_codes(text: str) -> list[str]:
    """The CRS code that is meant by `ESPG:3035`, `epsg3035`, `3035` or `102003`; none if there is no such code."""
    match = re.fullmatch(r"(?:([A-Za-z]+)[\s:_-]*)?(\d+)", text)
    if not match:
        return []
    authorities = ["EPSG", "ESRI"]
    if match[1]:
        authorities = difflib.get_close_matches(match[1].upper(), pyproj.database.get_authorities(), n=1, cutoff=NEAR)
    known = (f"{name}:{match[2]}" for name in authorities if match[2] in pyproj.database.get_codes(name, PJType.CRS))
    return list(known)[:1]


def codes_elsewhere(authority: str, number: str) -> list[str]:
    """The codes of projected CRSs of the Earth that other authorities have with the number."""
    others = (name for name in _OF_THE_EARTH if name != authority)
    kinds = (PJType.PROJECTED_CRS, PJType.GEOGRAPHIC_2D_CRS, PJType.COMPOUND_CRS)
    return [
        f"{name}:{number}"
        for name in others
        if any(number in pyproj.database.get_codes(name, kind, allow_deprecated=True) for kind in kinds)
    ]


def crs_code(text: str) -> str:
    """The code of the projected CRS of a name, in capitals or not; nothing where there is none."""
    return _crs_names().get(folded(text), ("", ""))[0]


def close_crs_names(text: str) -> list[str]:
    """Names of projected CRSs that are spelt nearly so."""
    known = _crs_names()
    return [known[name][1] for name in close_words(folded(text), known)][:_MOST]


def folded(text: str) -> str:
    """A name without what programs spell in different ways: capitals, spaces, underscores, brackets."""
    return re.sub(r"[^a-z0-9+]+", "", text.lower())


@functools.cache
def _crs_names() -> dict[str, tuple[str, str]]:
    """Codes and names of the projected CRSs of the Earth by their folded names; of a name of several, EPSG's code."""
    found: dict[str, tuple[str, str]] = {}
    for authority in _OF_THE_EARTH:
        for info in pyproj.database.query_crs_info(authority, PJType.PROJECTED_CRS):
            found.setdefault(folded(info.name), (f"{authority}:{info.code}", info.name))
    return found


@functools.cache
def _spellings() -> dict[str, str]:
    """Names by what they may be called: by themselves, and by PROJ's descriptions of its ids."""
    operations = {key: text for key, text in pyproj.list.get_proj_operations_map().items() if key not in NOT_MAPS}
    spellings = {normalised(name): name for name in [*NAMES, *WORLD_MAPS, *operations]}
    friendly = {operation: name for name, operation in NAMES.items()}
    for key, text in operations.items():
        spellings.setdefault(re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-"), friendly.get(key, key))
    return spellings
