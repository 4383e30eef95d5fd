"""Names of regions: how they are compared, those that there are, and what a misspelt one may have been meant for."""

from __future__ import annotations

import difflib
import functools
import unicodedata
from collections.abc import Mapping, Sequence

from projdist.earth import natural_earth, state_keys
from projdist.support import NEAR, did_you_mean

_MOST = 3  # names in a hint
_CODE = 3  # letters or digits in a code

Row = dict[str, str]


def region_names() -> list[str]:
    """The regions with names, as `get_region` takes them: countries, continents and states, after the largest."""
    countries = sorted(row["name"] for row in natural_earth.country_keys())
    return [
        *("globe", "land", "ocean"),
        *(f"country:{name}" for name in countries),
        *(f"continent:{name}" for name in sorted(continents().values())),
        *(f"state:{row['name']}" for row in state_keys()),
    ]


@functools.cache
def countries() -> dict[str, Row]:
    """Rows of countries by their names and codes, folded."""
    return _by_name(natural_earth.country_keys(), ("name", "iso_a2", "iso_a3", "iso_n3", "other_names"))


@functools.cache
def continents() -> dict[str, str]:
    """Names of continents by their folded forms."""
    return {folded(row["continent"]): row["continent"] for row in natural_earth.country_keys()}


@functools.cache
def states() -> dict[str, Row]:
    """Rows of the states of the USA by their names and codes, folded."""
    return _by_name(state_keys(), ("name", "postal", "fips", "other_names"))


def _by_name(rows: Sequence[Row], columns: Sequence[str]) -> dict[str, Row]:
    found: dict[str, Row] = {}
    for column in columns:
        for row in rows:
            for name in row[column].split("|"):
                if name:
                    found.setdefault(folded(name), row)
    return found


def names_of(rows: Mapping[str, Row]) -> dict[str, str]:
    """Names, less the codes, by their folded forms."""
    return {key: row["name"] for key, row in rows.items() if len(key) > _CODE}


def question(text: str, names: Mapping[str, str]) -> str:
    """A question for the region of another kind that has a name, or names that begin so or are spelt nearly so."""
    other = full_name(text)
    if other is not None:
        return did_you_mean([other])
    given = folded(text)
    begun = [key for key in names if given and (key.startswith(given) or f" {given}" in f" {key}")]
    near = begun or difflib.get_close_matches(given, names, 1, NEAR)
    close = list(dict.fromkeys(names[key] for key in near))[:_MOST]
    return did_you_mean(close)


def full_name(text: str) -> str | None:
    """The name in `region_names` of a country, continent or state: of its name or code, as NZ; None for all else.

    Countries come first where a code or a name is also a state's; `state:CA` tells them apart.
    """
    kind, colon, name = text.rpartition(":")
    for one, names in _names_by_kind().items():
        if not colon or kind.strip().casefold() == one:
            found = names.get(folded(name))
            if found is not None:
                return f"{one}:{found}"
    return None


@functools.cache
def _names_by_kind() -> dict[str, dict[str, str]]:
    """Names by their folded forms and codes."""
    return {
        "country": {key: row["name"] for key, row in countries().items()},
        "state": {key: row["name"] for key, row in states().items()},
        "continent": continents(),
    }


def close_regions(text: str) -> list[str]:
    """The regions with names that a text may have been meant for."""
    known: dict[str, list[str]] = {name: [name] for name in ("globe", "land", "ocean")}
    for key, row in countries().items():
        known.setdefault(key, []).append(f"country:{row['name']}")
    for key, name in continents().items():
        known.setdefault(key, []).append(f"continent:{name}")
    for key, row in states().items():
        known.setdefault(key, []).append(f"state:{row['name']}")
    given = folded(text)
    near = difflib.get_close_matches(given, [key for key in known if len(key) > _CODE], 1, NEAR)
    return list(dict.fromkeys(name for key in (given, *near) for name in known.get(key, [])))


def folded(text: str) -> str:
    """Small letters and digits without accents; all else is a blank."""
    plain = unicodedata.normalize("NFKD", text.casefold().replace("&", "and"))
    kept = "".join(c if c.isalnum() else " " for c in plain if not unicodedata.combining(c))
    return " ".join(kept.split())
