"""Whose land a region is, and which areas of use are a country's own, by their names against the shipped outlines."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

import numpy as np

from projdist._typing import FloatArray
from projdist.regions import Region

__all__ = ["USA", "home_of", "is_at_sea", "key_of", "named", "outline_of", "words_in"]

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
