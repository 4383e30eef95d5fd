"""Land, ocean, countries, continents: Natural Earth at 1 : 50 million; at 1 : 110 or 1 : 10 million on request."""

from __future__ import annotations

import difflib
import functools
import unicodedata

import shapely

from projdist.earth import merged, natural_earth
from projdist.regions.parts import told_apart
from projdist.regions.polygons import Polygons
from projdist.support import NEAR, did_you_mean

DEFAULT_RESOLUTION = "50m"
_MOST = 3  # names in a hint


@functools.cache
def land(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The land, Antarctica with its ice shelves included."""
    return Polygons(natural_earth.land(resolution), _named("land", resolution), resolution=resolution)


@functools.cache
def ocean(resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """All that is not land, the Caspian Sea included."""
    globe = shapely.box(-180.0, -90.0, 180.0, 90.0)
    water = merged([shapely.difference(globe, natural_earth.land(resolution))])
    return Polygons(water, _named("ocean", resolution), resolution=resolution)


def country(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """A country by its name or ISO 3166 code, with all its parts in Natural Earth; raises ValueError."""
    row = _countries().get(_folded(text))
    if row is None:
        near = _close(text, _names())
        raise ValueError(f"Invalid country '{text}'. {near}It must be a name in English or an ISO 3166 code.")
    return _country(row["iso_n3"] or row["name"], row["iso_a2"] or row["name"], resolution)


@functools.cache
def _country(key: str, shown: str, resolution: str) -> Polygons:
    geometry = natural_earth.country(key, resolution)
    if geometry is None:
        raise ValueError(f"Invalid country '{shown}' at {resolution}. It is too small for this data: ask for 50m.")
    return told_apart(Polygons(geometry, _named(f"country:{shown}", resolution), resolution=resolution))


def continent(text: str, resolution: str = DEFAULT_RESOLUTION) -> Polygons:
    """The countries of a continent, each as a whole: Russia is in Europe, French Guiana with France; ValueError."""
    names = {_folded(row["continent"]): row["continent"] for row in natural_earth.country_keys()}
    name = names.get(_folded(text))
    if name is None:
        near = _close(text, names)
        allowed = ", ".join(sorted(names.values()))
        raise ValueError(f"Invalid continent '{text}'. {near}It must be one of {allowed}.")
    return _continent(name, resolution)


@functools.cache
def _continent(name: str, resolution: str) -> Polygons:
    keys = [row["iso_n3"] or row["name"] for row in natural_earth.country_keys() if row["continent"] == name]
    parts = [natural_earth.country(key, resolution) for key in keys]
    whole = merged([part for part in parts if part is not None])
    return Polygons(whole, _named(f"continent:{name}", resolution), resolution=resolution)


def region_names() -> list[str]:
    """The regions that have names, as `get_region` takes them: countries, then continents, after the largest."""
    rows = natural_earth.country_keys()
    countries = sorted(row["name"] for row in rows)
    continents = sorted({row["continent"] for row in rows})
    return [
        *("globe", "land", "ocean"),
        *(f"country:{name}" for name in countries),
        *(f"continent:{name}" for name in continents),
    ]


def close_regions(text: str) -> list[str]:
    """The regions of this module that a text may have been meant for."""
    folded = _folded(text)
    continents = {_folded(row["continent"]): f"continent:{row['continent']}" for row in natural_earth.country_keys()}
    known = {name: name for name in ("globe", "land", "ocean")} | continents
    known |= {key: f"country:{row['name']}" for key, row in _countries().items()}
    found = [known[folded]] if folded in known else []
    names = [key for key in known if len(key) > _CODE]
    return list(dict.fromkeys(found + [known[key] for key in difflib.get_close_matches(folded, names, 1, NEAR)]))


_CODE = 3  # letters or digits in an ISO code


@functools.cache
def _countries() -> dict[str, dict[str, str]]:
    """Rows by their names and codes, folded."""
    found: dict[str, dict[str, str]] = {}
    for column in ("name", "iso_a2", "iso_a3", "iso_n3", "other_names"):
        for row in natural_earth.country_keys():
            for name in row[column].split("|"):
                if name:
                    found.setdefault(_folded(name), row)
    return found


def _names() -> dict[str, str]:
    """Names, less the codes, by their folded forms."""
    return {key: row["name"] for key, row in _countries().items() if len(key) > _CODE}


def _close(text: str, names: dict[str, str]) -> str:
    """A question for names that begin with a text or are spelt nearly so."""
    folded = _folded(text)
    begun = [key for key in names if folded and (key.startswith(folded) or f" {folded}" in f" {key}")]
    near = begun or difflib.get_close_matches(folded, names, 1, NEAR)
    close = list(dict.fromkeys(names[key] for key in near))[:_MOST]
    return did_you_mean(close)


def _folded(text: str) -> str:
    """Small letters and digits without accents; all else is a blank."""
    plain = unicodedata.normalize("NFKD", text.casefold().replace("&", "and"))
    kept = "".join(c if c.isalnum() else " " for c in plain if not unicodedata.combining(c))
    return " ".join(kept.split())


def _named(text: str, resolution: str) -> str:
    return text if resolution == DEFAULT_RESOLUTION else f"{text}@{resolution}"
