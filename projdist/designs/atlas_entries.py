"""The atlas: the best maps of regions for each purpose, from its shipped file."""

from __future__ import annotations

import functools
import gzip
import importlib.resources
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from projdist import regions, support

_BEST = ("existing", "custom", "made")


@dataclass(frozen=True, kw_only=True)
class AtlasMap(support.Record):
    """A map of a region; figures that were not measured are None."""

    projection: str  # code or PROJ string
    name: str
    method: str = ""
    datum: str = ""  # only of CRSs
    keeps: tuple[str, ...] | None = None  # properties that the map keeps in the region, as measured
    national: bool | None = None  # a CRS of the region's country
    share: float | None = None  # of the region within the area of use of a CRS
    airy_kavrayskiy: float | None = None
    max_scale_error_ppm: float | None = None
    mean_scale_error_ppm: float | None = None
    max_omega: float | None = None
    mean_omega: float | None = None
    max_areal_error_ppm: float | None = None
    mean_areal_error_ppm: float | None = None
    cut_km: float | None = None  # of cuts within the region


@dataclass(frozen=True, kw_only=True)
class AtlasPurpose(support.Record):
    """The best maps for a purpose by a figure, the `criterion`."""

    name: str = field(metadata=support.HIDDEN)
    criterion: str  # the figure
    existing: AtlasMap | None  # the best CRS of the registries, None without one
    custom: AtlasMap | None  # the best member of PROJ's families
    made: AtlasMap | None  # the best map made to measure
    limit: float | None  # about the error of the best of all maps of the purpose; None if unknown
    reason: str = ""  # why no map was made

    @property
    def maps(self) -> dict[str, AtlasMap]:
        """The maps that the entry has, by "existing", "custom" and "made"."""
        return {what: one for what in _BEST if (one := getattr(self, what)) is not None}


@dataclass(frozen=True, kw_only=True)
class AtlasZones:
    """A system of zones for a region that no single CRS serves: their number, and the largest scale error in any."""

    name: str
    zones: int
    national: bool
    max_scale_error_ppm: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class AtlasEntry(support.Answer):
    """The best maps of a region, by purpose.

    A frame has a row for each map of each purpose; `saves` is the share of the error that a map saves against the
    official CRS, or else the best existing one of any purpose.
    """

    title: str
    kind: str  #: country, part, state, continent, area, ocean or zone
    region: str  #: its text for `get_region`
    area_km2: float
    country: str
    official: AtlasMap | None  #: as that of `recommend`; None if there is none, as in countries with zones only
    purposes: Mapping[str, AtlasPurpose]
    zones: tuple[AtlasZones, ...]
    versions: Mapping[str, str]  #: those with which the entry was measured

    @property
    def reference(self) -> AtlasMap | None:
        """The map that others are compared with: the official CRS, else the best existing one."""
        return self.official or self.purposes["any"].existing

    def saves(self, one: AtlasMap, criterion: str = "airy_kavrayskiy") -> float | None:
        """The share of the reference's error that a map saves; None if the figure of either is missing."""
        mine, its = (getattr(known, criterion, None) for known in (one, self.reference))
        return None if mine is None or not its else 1.0 - mine / its

    def summary(self) -> dict[str, Any]:
        """A flat row of the region: the official CRS and the best maps of any purpose, with their savings."""
        best = self.purposes["any"]
        row = {"place": self.title, "kind": self.kind, "region": self.region, "area_km2": self.area_km2}
        row["limit"] = best.limit
        maps = best.maps | {"official": self.official}
        for what in ("official", *_BEST):
            one, keys = maps.get(what), ("", "_error", "_over_limit", "_saves")
            figures = one and (one.projection, one.airy_kavrayskiy, _over(one, best.limit), self.saves(one))
            row |= {what + key: value for key, value in zip(keys, figures or (None,) * 4, strict=True)}
        return row

    def _line(self) -> str:
        best = self.purposes["any"].existing
        official, best_name = ("none" if one is None else one.projection for one in (self.official, best))
        return f"{self.title}: official {official}, best {best_name}"

    def rows(self) -> list[dict[str, Any]]:
        """A flat row for each map of each purpose, after the official CRS, which has no purpose."""
        limit = self.purposes["any"].limit
        rows = [] if self.official is None else [self._row("", "official", self.official, "airy_kavrayskiy", limit)]
        for purpose in self.purposes.values():
            maps = purpose.maps.items()
            rows += [self._row(purpose.name, what, one, purpose.criterion, purpose.limit) for what, one in maps]
        return rows

    _table = rows

    def _row(self, purpose: str, what: str, one: AtlasMap, criterion: str, limit: float | None) -> dict[str, Any]:
        figures = asdict(one) | {"keeps": None if one.keeps is None else " ".join(one.keeps)}
        compared = {"over_limit": _over(one, limit), "saves": self.saves(one, criterion)}
        known = {"region": self.title, "kind": self.kind, "area_km2": self.area_km2}
        return known | {"purpose": purpose, "what": what} | figures | compared


def _over(one: AtlasMap, limit: float | None) -> float | None:
    """The Airy-Kavrayskiy error divided by the limit."""
    return None if one.airy_kavrayskiy is None or not limit else one.airy_kavrayskiy / limit


# ---- the shipped file ----------------------------------------------------------------------------

_ZONE = re.compile(r"(utm )?(zone )?\d{1,2} ?[ns]")
_CRITERIA = {"least scale error": "max_scale_error_ppm"}  # for other purposes the Airy-Kavrayskiy error
_MOST = 3  # names in a hint


def atlas(place: str) -> AtlasEntry:
    """The best maps of a country, state of the USA, continent, other area, ocean or UTM zone, measured beforehand.

    For each of four purposes and for the least scale error these are the best existing CRS, the best custom projection
    and the best map made to measure, with the limit of all maps; beside them stands the country's official CRS.

    Parameters
    ----------
    place : str
        A name of `atlas_names`, or another name or a code: "NZ", "New Zealand", "state:CA", "EU". Countries come first
        where several have a code: "CA" is Canada. Of a country with parts far away the entry is for the main part; they
        have entries of their own, by their largest towns: "France, Cayenne".

    Returns
    -------
    AtlasEntry
        The maps with their errors to six digits.

    Raises
    ------
    ValueError
        For a place that is not in the atlas.

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
        raise TypeError(f"Invalid place of type '{type(place).__name__}'. It must be text, such as NZ or state:CA.")
    known = _index()
    key = regions.folded(regions.full_name(place) or place)
    if key not in known:
        close = dict.fromkeys(atlas_names()[known[one]] for one in support.close_words(key, known)[:_MOST])
        hint = support.did_you_mean(list(close))
        advice = f"{hint}It must be one of those that 'projdist atlas' (atlas_names) lists."
        if _ZONE.fullmatch(key):
            advice = "All UTM zones are as UTM zone 33N and UTM zone 33S, turned about the Earth's axis: ask for these."
        raise ValueError(f"Invalid place '{support.shown(place)}'. {advice}")
    return _entries()[known[key]]


def atlas_names() -> list[str]:
    """The places of the atlas: continents and other areas, oceans, zones, countries and their far parts, US states.

    Returns
    -------
    list of str
        The names, as `atlas` takes them: "country:New Zealand", "state:Texas", "North Atlantic", "France, Cayenne".

    Raises
    ------
    Nothing: there is no input.

    References
    ----------
    Natural Earth and the US Census Bureau, whose outlines the places have; `projdist list regions` has areas' limits.

    Examples
    --------
    >>> len(atlas_names()), atlas_names()[0]
    (400, 'continent:Africa')
    """
    return [_name(entry) for entry in _entries()]


@functools.cache
def _entries() -> tuple[AtlasEntry, ...]:
    file = importlib.resources.files("projdist") / "data" / "atlas.jsonl.gz"
    versions, *entries = map(json.loads, gzip.decompress(file.read_bytes()).splitlines())
    return tuple(
        AtlasEntry(
            **{name: read[name] for name in ("title", "kind", "region", "area_km2", "country")},
            official=None if read["official"] is None else _existing(read["official"]),
            purposes={name: _purpose(name, one) for name, one in read["purposes"].items()},
            zones=tuple(AtlasZones(**system) for system in read["zones"]),
            versions=versions,
        )
        for read in entries
    )


@functools.cache
def _index() -> dict[str, int]:
    """The numbers of entries by folded name, and by title unless it is another's name."""
    names = {regions.folded(_name(entry)): n for n, entry in enumerate(_entries())}
    titles = {regions.folded(entry.title): n for n, entry in enumerate(_entries())}
    return titles | names


def _name(entry: AtlasEntry) -> str:
    """The name of an entry: `country:New Zealand`, or its title."""
    return regions.full_name(entry.region.removesuffix("@main")) or entry.title


def _purpose(name: str, read: dict[str, Any]) -> AtlasPurpose:
    existing, custom, made = (read[what] for what in _BEST)
    if custom is not None:
        family, keeps = custom.pop("family"), tuple(custom.pop("keeps"))
        custom = AtlasMap(projection=custom.pop("proj"), name=f"custom {family}", method=family, keeps=keeps, **custom)
    reason = made.get("error", "") if made else ""
    if made is not None and not reason:
        name_of_made = f"made to measure, degree {made.pop('degree')}"
        made = AtlasMap(projection=made.pop("proj"), name=name_of_made, **made)
    return AtlasPurpose(
        name=name,
        criterion=_CRITERIA.get(name, "airy_kavrayskiy"),
        existing=None if existing is None else _existing(existing),
        custom=custom,
        made=None if reason else made,
        limit=read["limit"],
        reason=reason,
    )


def _existing(read: dict[str, Any]) -> AtlasMap:
    return AtlasMap(projection=read.pop("code"), keeps=tuple(read.pop("keeps")), **read)
