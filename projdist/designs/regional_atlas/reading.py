"""The atlas as it is shipped: `projdist/data/atlas.jsonl.gz`, which `tools/measure_atlas.py` makes."""

from __future__ import annotations

import functools
import gzip
import importlib.resources
import json
import re
from typing import Any

from projdist.designs.regional_atlas.entries import AtlasEntry, AtlasMap, AtlasPurpose, AtlasZones
from projdist.regions import folded, full_name
from projdist.support import close_words, did_you_mean, shown

__all__ = ["atlas", "atlas_names"]

_ZONE = re.compile(r"(utm )?(zone )?\d{1,2} ?[ns]")
_CRITERIA = {"least scale error": "max_scale_error_ppm"}  # the others are by the Airy-Kavrayskiy error
_MOST = 3  # names in a hint


def atlas(place: str) -> AtlasEntry:
    """The best maps of a country, a state of the USA, a continent, an ocean or a UTM zone, measured beforehand.

    For each of four purposes and for the least scale error: the best existing CRS, the best custom projection, the best
    map made to measure, and the limit of all maps; and the country's own CRS, with what each of them would save.

    Parameters
    ----------
    place : str
        A name of `atlas_names`, or a name or code of a country or state: "NZ", "New Zealand", "state:CA". Countries
        come first where both have a code: "CA" is Canada. Of a country with parts far away the entry is for the main
        part; they have entries of their own, by their largest towns: "France, Cayenne".

    Returns
    -------
    AtlasEntry
        The maps with their errors, which are rounded to six digits.

    Raises
    ------
    ValueError
        For a place that the atlas has not.

    References
    ----------
    `recommend`, `optimize` and `design`, which have found the maps; the atlas in the documentation.

    Examples
    --------
    >>> entry = atlas("NZ")
    >>> entry.official.projection, entry.official.name
    ('EPSG:2193', 'NZGD2000 / New Zealand Transverse Mercator 2000')
    >>> round(entry.purposes["any"].made.airy_kavrayskiy / entry.official.airy_kavrayskiy, 2)
    0.04
    """
    if not isinstance(place, str):
        raise TypeError(f"Invalid place of type '{type(place).__name__}'. It must be text, as NZ or state:CA.")
    known = _index()
    key = folded(full_name(place) or place)
    if key not in known:
        raise ValueError(f"Invalid place '{shown(place)}'. {_advice(key)}")
    return _entries()[known[key]]


def atlas_names() -> list[str]:
    """The places of the atlas: continents, oceans, zones, countries and their parts far away, states of the USA.

    Returns
    -------
    list of str
        The names, as `atlas` takes them: "country:New Zealand", "state:Texas", "North Atlantic", "France, Cayenne".

    Raises
    ------
    Nothing: there is no input.

    References
    ----------
    Natural Earth and the US Census Bureau, whose outlines the places have.

    Examples
    --------
    >>> len(atlas_names()), atlas_names()[0]
    (345, 'continent:Africa')
    """
    return [_name(entry) for entry in _entries()]


@functools.cache
def _entries() -> tuple[AtlasEntry, ...]:
    file = importlib.resources.files("projdist") / "data" / "atlas.jsonl.gz"
    versions, *entries = map(json.loads, gzip.decompress(file.read_bytes()).splitlines())
    return tuple(_entry(entry, versions) for entry in entries)


@functools.cache
def _index() -> dict[str, int]:
    """The places of entries by their folded names; titles, too, where they are not those of others."""
    names = {folded(_name(entry)): n for n, entry in enumerate(_entries())}
    titles = {folded(entry.title): n for n, entry in enumerate(_entries())}
    return titles | names


def _name(entry: AtlasEntry) -> str:
    """What an entry is asked for by: `country:New Zealand`, or its title."""
    return full_name(entry.region.removesuffix("@main")) or entry.title


def _advice(key: str) -> str:
    """What may have been meant, and what is allowed."""
    if _ZONE.fullmatch(key):
        return "All UTM zones are as UTM zone 33N and UTM zone 33S, turned about the Earth's axis: ask for these."
    close = [atlas_names()[_index()[one]] for one in close_words(key, _index())[:_MOST]]
    return (
        f"{did_you_mean(list(dict.fromkeys(close)))}It must be one of those that 'projdist atlas' (atlas_names) lists."
    )


def _entry(read: dict[str, Any], versions: dict[str, str]) -> AtlasEntry:
    official = read["official"]
    return AtlasEntry(
        **{name: read[name] for name in ("title", "kind", "region", "area_km2", "country")},
        official=None if official is None else _existing(official),
        purposes={name: _purpose(name, one) for name, one in read["purposes"].items()},
        zones=tuple(AtlasZones(**system) for system in read["zones"]),
        versions=versions,
    )


def _purpose(name: str, read: dict[str, Any]) -> AtlasPurpose:
    existing, custom, made = (read[what] for what in ("existing", "custom", "made"))
    reason = made.get("error", "") if made else ""
    return AtlasPurpose(
        name=name,
        criterion=_CRITERIA.get(name, "airy_kavrayskiy"),
        existing=None if existing is None else _existing(existing),
        custom=None if custom is None else _custom(custom),
        made=None if reason or made is None else _made(made),
        limit=read["limit"],
        reason=reason,
    )


def _existing(read: dict[str, Any]) -> AtlasMap:
    code, keeps = read.pop("code"), tuple(read.pop("keeps"))
    return AtlasMap(projection=code, keeps=keeps, **read)


def _custom(read: dict[str, Any]) -> AtlasMap:
    family, keeps = read.pop("family"), tuple(read.pop("keeps"))
    return AtlasMap(projection=read.pop("proj"), name=f"custom {family}", method=family, keeps=keeps, **read)


def _made(read: dict[str, Any]) -> AtlasMap:
    return AtlasMap(projection=read.pop("proj"), name=f"made to measure, degree {read.pop('degree')}", **read)
