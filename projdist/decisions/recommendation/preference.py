"""How maps stand beside their figures: purposes, CRSs that draw the same map, and which of them to name first."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist.decisions.map_info import PROPERTIES
from projdist.decisions.recommendation.candidates import Finding
from projdist.projections import AUTHORITIES, CrsRecord
from projdist.support import close_words, did_you_mean, listed, quoted

PURPOSES = ("any", *PROPERTIES, "compromise")


def get_purpose(name: str) -> str:
    """The purpose of a name; raises ValueError with close matches."""
    if not isinstance(name, str) or name not in PURPOSES:
        words = close_words(name.lower().replace("_", "-"), PURPOSES) if isinstance(name, str) else []
        hint = did_you_mean(words)
        raise ValueError(f"Invalid purpose {quoted(name)}. {hint}It must be {listed(PURPOSES, 'or')}.")
    return name


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """Whether a map with these properties serves a purpose; a compromise is what keeps none."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)


# ---- same maps -----------------------------------------------------------------------------------


_VARIANT = re.compile(r"\((?:z?E[-,]z?N|z?N[-,]z?E)\)$")
"""What ends EPSG's names of CRSs that differ from others by their axes only, or by a zone number in the easting."""

_REALISATION = re.compile(r"\s*[(/\[]|\s+v\d")
"""Where the name of a datum ends and that of its realisation begins."""

_CLOSE = 0.01  # of the trials' figures: a sphere and an ellipsoid differ by half of that on a map of the world
_ALIKE = 1e-7  # of J: the same map by another method or with other parameters
_NEAR = 1e-4  # of the trials' figures: no more can differ in maps that are alike


Size = Callable[[Finding], float]


def _value(one: Finding) -> float:
    return one.value


def grouped(findings: list[Finding], size: Size = _value) -> list[list[Finding]]:
    """Findings grouped by what they draw, under whatever datum; `size` is the figure that must agree in a group.

    It must be more than rounding: figures that vanish agree with none.
    """
    by_conversion: dict[Any, list[Finding]] = {}
    for finding in findings:
        by_conversion.setdefault((finding.conversion, finding.keeps), []).append(finding)
    parts = [part for group in by_conversion.values() for part in _close(group, size)]
    return _merged(sorted(parts, key=lambda group: size(group[0])), size)


@dataclass(frozen=True)
class Usage:
    """For what a CRS is there: whether its area of use `holds` nearly all of the region, and is the country's own.

    `special` is one that is for nobody in general, `since` the year of its datum, 0 where that is not known.
    """

    holds: bool = False
    national: bool = False
    special: bool = False
    since: int = 0


PLAIN = Usage()


def by_usage(
    group: list[Finding], records: Mapping[str, CrsRecord], usages: Mapping[str, Usage] | None = None
) -> list[Finding]:
    """Findings of one map, the one first that a surveyor of the region's country would name.

    That is, one criterion after the other, a national one; one of those whose areas of use nearly hold the region;
    of a modern datum; for general use; of the latest datum, whose realisations count as one; of the first authority;
    with axes east and north; that is no variant by its name; whose datum is no realisation of another one's in the
    group; with positive coordinates; for the smallest area; of the lowest code.
    """
    known = usages or {}
    datums = {one.datum for one in group}
    since: dict[str, int] = {}
    for one in group:
        root = datum_root(one.datum)
        since[root] = max(since.get(root, 0), known.get(one.code, PLAIN).since)

    def rank(one: Finding) -> tuple[Any, ...]:
        record, usage = records[one.code], known.get(one.code, PLAIN)
        authority, _, code = one.code.partition(":")
        upright, positive = one.usual
        return (
            not usage.national,
            not usage.holds,
            not one.modern,
            usage.special,
            -since[datum_root(one.datum)],
            AUTHORITIES.index(authority),
            not upright,
            bool(_VARIANT.search(record.name)),
            any(_realises(one.datum, other) for other in datums),
            not positive,
            round(record.extent_km2),
            len(code),
            code,
        )

    return sorted(group, key=rank)


def datum_root(datum: str) -> str:
    """What realisations of a datum have in common by their names: NAD83 of NAD83(2011), RGF93 of RGF93 v2b."""
    return _REALISATION.split(datum, maxsplit=1)[0]


def _realises(datum: str, other: str) -> bool:
    """Whether a datum is a realisation of another by its name, as NAD83(2011) of NAD83 and not CH1903+ of CH1903."""
    return datum.startswith(other) and datum.removeprefix(other).lstrip().startswith(("(", "/"))


def _close(group: list[Finding], size: Size) -> list[list[Finding]]:
    """Findings of one conversion in groups whose figures agree, whatever the ellipsoid."""
    parts: list[list[Finding]] = []
    for finding in sorted(group, key=size):
        if parts and size(finding) <= (1.0 + _CLOSE) * size(parts[-1][0]):
            parts[-1].append(finding)
        else:
            parts.append([finding])
    return parts


def _merged(groups: list[list[Finding]], size: Size) -> list[list[Finding]]:
    """Groups, sorted by size, with those joined whose maps are alike at every node."""
    merged: list[list[Finding]] = []
    for group in groups:
        one = group[0]
        for other in reversed(merged):
            if not size(other[0]) >= (1.0 - _NEAR) * size(one):
                merged.append(group)
                break
            if _alike(other[0], one):
                other += group
                break
        else:
            merged.append(group)
    return merged


def _alike(one: Finding, other: Finding) -> bool:
    """Whether two maps have the same Jacobians."""
    return bool(np.allclose(one.jacobian, other.jacobian, rtol=0.0, atol=_ALIKE, equal_nan=True))


# ---- standing ------------------------------------------------------------------------------------


CLOSE = 0.1
"""Of a figure: what maps differ by that are as good as each other.

Official systems and what they replaced, or the zone beside, differ by a few per cent; a tenth of a few hundred ppm is
what the ground's height does to distances within 200 m.
"""

WIDE_FACTOR = 2.0
"""How many times better a map of the world or a continent must be than a country's own, or a zone's."""

# More than a zone of six degrees from the equator to 84 N has, 4.2 million, and than the region has by far.
_WIDE_KM2, _WIDE_TIMES = 5e6, 3.0

Key = tuple[float, float]
"""What maps are ordered by: a figure, 0 for one that is no more than rounding, and the level that decides then."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A map by its CRSs: the `share` of the region in their areas of use, together; whether one is the country's own.

    `wide` is a map of the world or a continent, `special` one for nobody in general, `since` the year of its `datum`,
    0 where that is not known.
    """

    share: float
    national: bool
    wide: bool
    special: bool
    since: int
    datum: str

    def weight(self, least_share: float) -> float:
        """What its figure is multiplied by, when a share of the region counts as all of it."""
        return (1.0 if self.share >= least_share else 1.0 / self.share) * (WIDE_FACTOR if self.wide else 1.0)


def is_wide(record: CrsRecord, area_km2: float) -> bool:
    """Whether a CRS was made for the world or a continent, of which a region of some area is a small part."""
    return record.extent_km2 > max(_WIDE_KM2, _WIDE_TIMES * area_km2)


def is_own(record: CrsRecord, countries: Collection[str], home: str) -> bool:
    """Whether a CRS that is for some countries is one's own: of none but that, or no continent's."""
    return home in countries and (len(countries) == 1 or not is_wide(record, 0.0))


def is_close(key: Key, least: Key, close: float) -> bool:
    """Whether a map is as good as another that is no worse: by its level only where both figures vanish."""
    if least[0] > 0.0:
        return key[0] <= (1.0 + close) * least[0]
    return key[0] == 0.0 and key[1] <= (1.0 + close) * least[1]


def tiers(keys: Sequence[Key], close: float) -> list[list[int]]:
    """The numbers of maps in groups that are close to the best of the group, the best group first."""
    found: list[list[int]] = []
    for i in sorted(range(len(keys)), key=keys.__getitem__):
        if found and is_close(keys[i], keys[found[-1][0]], close):
            found[-1].append(i)
        else:
            found.append([i])
    return found


def in_force(standings: Sequence[Standing]) -> list[int]:
    """The numbers of a country's own maps for general use, on the latest datum that these have or of no known year."""
    latest = _latest(standings)
    if latest is None:
        return []
    return [i for i, one in enumerate(standings) if _is_own(one) and not _is_outdated(one, latest)]


def preferred(standings: Sequence[Standing], keys: Sequence[Key]) -> list[int]:
    """The numbers of maps that are close: national ones, for general use, not outdated, by their figures."""
    latest = _latest(standings)

    def rank(i: int) -> tuple[bool, bool, bool, Key]:
        one = standings[i]
        return not one.national, one.special, latest is not None and _is_outdated(one, latest), keys[i]

    return sorted(range(len(standings)), key=rank)


def _latest(standings: Sequence[Standing]) -> Standing | None:
    return max(filter(_is_own, standings), key=lambda one: one.since, default=None)


def _is_own(one: Standing) -> bool:
    return one.national and not one.special


def _is_outdated(one: Standing, latest: Standing) -> bool:
    """Whether the datum is known to be older, and is no other realisation of the same."""
    return 0 < one.since < latest.since and datum_root(one.datum) != datum_root(latest.datum)
