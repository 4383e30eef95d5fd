"""The CRSs that are looked at for a region: by their areas of use, and by whose land it is."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.decisions.recommendation.candidates import Finding, Lattice, Rejected
from projdist.decisions.recommendation.preference import Standing, Usage, is_own, is_wide
from projdist.projections import UNKNOWN, CrsRecord, Facts, facts_of
from projdist.regions import Region, main_part
from projdist.support import close_words, did_you_mean

_MOST = 0.5  # of what is any country's: then the region is that country's
_BETWEEN = re.compile(r"[;:]|\. ")  # countries of a list
_AT_SEA = re.compile(r"^(?!.*onshore).*offshore", re.IGNORECASE)
USA = "United States of America"
_STATE = "Georgia"  # no area of use has both that country and the USA
# Names of areas that the outlines have with a country.
_PARTS = dict.fromkeys(("French Guiana", "Guadeloupe", "Martinique", "Mayotte", "Reunion"), "France")
_NOBODYS = "Antarctica"  # by the treaty of 1959: what is made for it is no country's own
_CONTINENT = re.compile(r"^(Africa|Asia|Europe|Oceania|(North|South) America) including ")  # and no country's own
_WORLD = "World"  # how names of areas of use begin that are nobody's own


def named(extents: Sequence[str], *, at_sea: bool = False) -> frozenset[str]:
    """The countries whose land areas of use name; of "USA - New Mexico" the first, of "China - Hong Kong" both.

    `extents` are names and descriptions as EPSG's registry writes them; none is named by those of the whole world or of
    a continent "including" a country. With `at_sea` also those whose waters alone they name.
    """
    if not extents or extents[0].startswith(_WORLD) or any(map(_CONTINENT.match, extents)):
        return frozenset()
    items = (item for text in extents for item in _BETWEEN.split(text) if at_sea or not is_at_sea(item))
    found = frozenset(name for item in items for name in _owners(item))
    return found - {_STATE} if USA in found else found


def is_at_sea(name: str) -> bool:
    """Whether what is so called, an area or a CRS, has no land: Louisiana Offshore."""
    return _AT_SEA.search(name) is not None


def _owners(item: str) -> frozenset[str]:
    """The countries of an item of a list: those before its first dash, and one that stands alone behind it."""
    first, _, rest = item.partition(" - ")
    second = rest.partition(" - ")[0].strip(" .")
    alone = _vocabulary()[1].get(second)
    return (_names_in(first) or _names_in(item)) | ({alone} if alone else frozenset())


def home_of(lon: FloatArray, lat: FloatArray, weight: FloatArray) -> str:
    """The country that has most of the points of a region that are in any, or none ("").

    Those whose boxes have most come first, until no other can have as much: of the world, few are decoded.
    """
    from projdist.earth import natural_earth  # shapely is slow to load

    east = np.mod(lon + 180.0, 360.0) - 180.0
    about = natural_earth.countries_about(east, lat)
    boxes = {name: about[key] for name, key in _keys().items() if key in about and name != _NOBODYS}
    reach = {name: float(weight @ box) for name, box in boxes.items()}
    shares: dict[str, float] = {}
    for name in sorted(reach, key=reach.__getitem__, reverse=True):
        if max(reach[name], *shares.values(), 0.0) <= _MOST * sum(shares.values()):
            return ""
        box = boxes[name]
        shares[name] = float(weight[box] @ outline_of(name).contains(lon[box], lat[box]))
    most = max(shares, key=shares.__getitem__, default="")
    return most if most and shares[most] > _MOST * sum(shares.values()) else ""


def outline_of(name: str) -> Region:
    """What the shipped outlines have of a country: coarse ones would give Singapore to Malaysia."""
    from projdist.earth import natural_earth  # as above
    from projdist.regions import Polygons

    geometry = natural_earth.country(_keys()[name])
    assert geometry is not None  # at 1 : 50 million all are there
    return Polygons(geometry, name)


def key_of(name: str) -> str:
    """What the outlines call a country that is `named`."""
    return _keys()[name]


@functools.cache
def _keys() -> dict[str, str]:
    """What the outlines call countries, by their names."""
    from projdist.earth import natural_earth  # as above

    return {row["name"]: row["iso_n3"] or row["name"] for row in natural_earth.country_keys()}


@functools.lru_cache(maxsize=4096)
def _names_in(text: str) -> frozenset[str]:
    """The countries that are named in a text."""
    names = _vocabulary()[1]
    return frozenset(names[word] for word in words_in(text))


def words_in(text: str) -> list[str]:
    """The names of countries and states in a text, as whole words; of "West Virginia" that and not Virginia."""
    return _vocabulary()[0].findall(text)


@functools.cache
def _vocabulary() -> tuple[re.Pattern[str], dict[str, str]]:
    """A pattern of all names, the longest first, and whose they are: New Mexico is the USA's."""
    from projdist.earth import natural_earth, state_keys  # as above

    names: dict[str, str] = {}
    for row in natural_earth.country_keys():
        for name in (row["name"], *row["other_names"].split("|")):
            if name:
                names.setdefault(name, row["name"])
    for row in state_keys():
        names.setdefault(row["name"], USA)
    names.update(_PARTS)
    longest = sorted(names, key=len, reverse=True)
    return re.compile(r"(?<!\w)(?:" + "|".join(map(re.escape, longest)) + r")(?!\w)"), names


# ---- country parts -------------------------------------------------------------------------------


Bounds = tuple[float, float, float, float]

_IS_IN = 0.9  # of the region is in a state: outlines differ
_IS_MOST = 0.5  # of the state is the region: it is that state; of the country's points in the region: these are far


@dataclass(frozen=True, kw_only=True)
class CountryPart:
    """A part of a country by its `state`, or by the `middle` of the main part in degrees, which it is far from."""

    state: str = ""
    middle: tuple[float, float] | None = None

    def is_elsewhere(self, extents: Sequence[str]) -> bool:
        """Whether an area of use is that of other states."""
        return bool(self.state) and any(set(words_in(name)) & _states() - {self.state} for name in extents[:1])

    def has(self, record: CrsRecord, extents: Sequence[str]) -> bool:
        """Whether an area of use is this part's, not the country's: its name has the state's, or it has no middle."""
        if self.state:
            return any(self.state in words_in(name) for name in extents[:1])
        if self.middle is None:
            return True
        return not _is_within(record.area_of_use, *self.middle)


def part_of(home: str, region: Region, lon: FloatArray, lat: FloatArray, weight: FloatArray) -> CountryPart:
    """What part of its country, or of none (""), a region is, by points of it with weights whose sum is 1."""
    if not home:
        return CountryPart()
    state = _state(region.area_km2, lon, lat, weight) if home == USA else ""
    if state:
        return CountryPart(state=state)
    country = outline_of(home)
    main = main_part(country)
    if main is country or weight @ main.contains(lon, lat) >= _IS_MOST * (weight @ country.contains(lon, lat)):
        return CountryPart()
    west, south, east, north = main.bounds
    return CountryPart(middle=(0.5 * (west + east), 0.5 * (south + north)))


@functools.cache
def _states() -> frozenset[str]:
    from projdist.earth import state_keys  # shapely is slow to load

    return frozenset(row["name"] for row in state_keys())


def _state(area_km2: float, lon: FloatArray, lat: FloatArray, weight: FloatArray) -> str:
    """The state that a region of some area is, or ""."""
    from projdist.earth import state_keys, state_outline  # as above
    from projdist.regions import Polygons

    for row in state_keys():
        outline = state_outline(row["fips"])
        if weight @ _is_within(outline.bounds, lon, lat) < _IS_IN:
            continue
        state = Polygons(outline, row["name"])
        share = float(weight @ state.contains(lon, lat))
        if share >= _IS_IN and share * area_km2 >= _IS_MOST * state.area_km2:
            return row["name"]
    return ""


def _is_within(bounds: Bounds, lon: Any, lat: Any) -> Any:
    """Whether places lie within west, south, east, north in degrees."""
    west, south, east, north = bounds
    return ((lon - west) % 360.0 <= ((east - west) % 360.0 or 360.0)) & (lat >= south) & (lat <= north)


# ---- pool ----------------------------------------------------------------------------------------


HOLDS = 0.99
"""Of the region: areas of use are rounded, and so are boxes."""
HOLDS_NEARLY = 0.9
"""Of the region: outlines have disputed land, and islands beside those that an area of use was drawn about."""
_TOUCHES = 0.25  # of the region: a map for less was not made for it
_SOME = 0.1  # of the region: a CRS for less is not named for the map
# Outside of it there are at most 60 of the 135 million km2 of land that is some country's: the largest, of 17, has less
# than half of what is inside.
_NOBODYS_KM2 = 450e6


class Pool:
    """The records of maps whose areas of use are those of a region; those that touch it are rejected.

    `meeting` are all that meet the region, be it on the bounds only; `home` is the country whose land it is.
    """

    def __init__(self, region: Region, records: Sequence[CrsRecord], area: str) -> None:
        self.region, self.lattice = region, Lattice(region)
        self.records: dict[str, CrsRecord] = {}
        self.held: dict[str, BoolArray] = {}  # what a CRS has of the lattice
        self.united: dict[str, BoolArray] = {}  # what all CRSs of its map have
        self.rejected: list[Rejected] = []
        least = HOLDS if area == "contains" else _TOUCHES
        near = self.lattice.near([record.area_of_use for record in records])
        self.meeting = [record for record, is_near in zip(records, near, strict=True) if is_near]
        bounds = list(dict.fromkeys(record.area_of_use for record in self.meeting))
        held = dict(zip(bounds, self.lattice.within(bounds), strict=True))
        self.facts = facts_of([record.code for record in self.meeting])
        self.home = self._home()
        touching = [record for record in self.meeting if held[record.area_of_use].any()]
        united: dict[Any, BoolArray] = {}
        for record in touching:
            drawn = self._draws(record)
            united[drawn] = united.get(drawn, False) | held[record.area_of_use]
        for record in touching:
            own, together = held[record.area_of_use], united[self._draws(record)]
            if self.share(together) >= least and self.share(own) >= min(least, _SOME):
                self.records[record.code], self.held[record.code], self.united[record.code] = record, own, together
            else:
                text = f"Its area of use holds {100 * self.share(own):.2g} % of the region."
                self.rejected.append(Rejected(record.code, record.name, text))

    def _draws(self, record: CrsRecord) -> Any:
        """What CRSs of one map have in common, as far as the registry tells."""
        return self._facts(record.code).draws or record.code

    def _facts(self, code: str) -> Facts:
        return self.facts.get(code, UNKNOWN)

    def share(self, held: BoolArray) -> float:
        """The part of the region that is held."""
        return float(held @ self.lattice.weight)

    def _home(self) -> str:
        """The country whose land the region is, or none ("")."""
        if self.region.area_km2 > _NOBODYS_KM2:
            return ""
        return home_of(self.lattice.lon, self.lattice.lat, self.lattice.weight)

    def is_national(self, record: CrsRecord) -> bool:
        """Whether a CRS is of the country that the region is in, by the names of its area of use."""
        return self.home != "" and is_own(record, named(self._facts(record.code).extents), self.home)

    @functools.cached_property
    def part(self) -> CountryPart:
        """What part of its country the region is."""
        return part_of(self.home, self.region, self.lattice.lon, self.lattice.lat, self.lattice.weight)

    def is_for_part(self, record: CrsRecord) -> bool:
        """Whether a CRS of the country's own was made for the part that the region is, or that is no such part."""
        return self.part.has(record, self._facts(record.code).extents)

    def is_elsewhere(self, record: CrsRecord) -> bool:
        """Whether a CRS is for other states than the one that the region is."""
        return self.part.is_elsewhere(self._facts(record.code).extents)

    def usage(self, record: CrsRecord) -> Usage:
        """What a CRS is used for."""
        facts = self._facts(record.code)
        holds = self.share(self.held[record.code]) >= HOLDS_NEARLY
        return Usage(holds, self.is_national(record), facts.special or is_at_sea(record.name), facts.since)

    def standing(self, members: list[Finding], usages: dict[str, Usage]) -> Standing:
        """How the map of some CRSs stands: their areas of use count as one."""
        held = np.any([self.united[one.code] for one in members], axis=0)
        first, national = members[0], any(usages[one.code].national for one in members)
        return Standing(
            share=self.share(held),
            national=national,
            wide=not national and all(is_wide(self.records[one.code], self.region.area_km2) for one in members),
            special=usages[first.code].special,
            since=usages[first.code].since,
            datum=first.datum,
        )


def of_datum(findings: list[Finding], datum: str) -> list[Finding]:
    """Findings whose datum's name has the text in it; raises ValueError, with names that are there, for none."""
    wanted = _plain_name(datum)
    known = {_plain_name(finding.datum): finding.datum for finding in findings}
    if not wanted or not any(wanted in name for name in known):
        close = [known[name] for name in close_words(wanted, known)] if wanted else []
        raise ValueError(
            f"Invalid datum '{datum}'. {did_you_mean(close)}It must be a part of the name of a geodetic CRS "
            "with candidates for the region, as WGS 84 or ETRS89."
        )
    return [finding for finding in findings if wanted in _plain_name(finding.datum)]


def _plain_name(text: str) -> str:
    """A name in small letters and digits only."""
    return "".join(c for c in text.lower() if c.isalnum())
