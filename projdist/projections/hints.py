"""What text that names no projection may have been meant for."""

from __future__ import annotations

import difflib
import functools
import re

import pyproj.database
import pyproj.list

from projdist.catalogue import NAMES, NOT_MAPS
from projdist.hints import NEAR, close_words
from projdist.worldmaps import WORLD_MAPS

_MOST = 6  # as many as Eckert and Wagner made maps


def normalised(text: str) -> str:
    """A name in the catalogue's spelling: small letters and hyphens."""
    return re.sub(r"[\s_]+", "-", text.lower())


def close_names(text: str) -> list[str]:
    """Names that begin with the text, or are spelt nearly so, or that it begins with; none for nonsense."""
    known, wanted = _spellings(), normalised(text)
    found = close_words(wanted, known) or [key for key in known if wanted.startswith(f"{key}-")]
    return list(dict.fromkeys(known[key] for key in found))[:_MOST]


def close_ids(text: str) -> list[str]:
    """PROJ ids of the maps of `close_names`."""
    return list(dict.fromkeys(NAMES.get(name, name).split()[0] for name in close_names(text) if name not in WORLD_MAPS))


def close_codes(text: str) -> list[str]:
    """The CRS code that is meant by `ESPG:3035`, `epsg3035` or `3035`; none if there is no such code."""
    match = re.fullmatch(r"(?:([A-Za-z]+)[\s:_-]*)?(\d+)", text)
    if not match:
        return []
    authorities = pyproj.database.get_authorities()
    close = difflib.get_close_matches((match[1] or "EPSG").upper(), authorities, n=1, cutoff=NEAR)
    return [f"{name}:{match[2]}" for name in close if match[2] in pyproj.database.get_codes(name, "PROJECTED_CRS")]


@functools.cache
def _spellings() -> dict[str, str]:
    """Names by what they may be called: by themselves, and by PROJ's descriptions of its ids."""
    operations = {key: text for key, text in pyproj.list.get_proj_operations_map().items() if key not in NOT_MAPS}
    spellings = {normalised(name): name for name in [*NAMES, *WORLD_MAPS, *operations]}
    friendly = {operation: name for name, operation in NAMES.items()}
    for key, text in operations.items():
        spellings.setdefault(re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-"), friendly.get(key, key))
    return spellings
