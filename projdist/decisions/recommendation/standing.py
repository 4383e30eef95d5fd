"""How maps stand beside their figures: for whom they were made, on how old a datum; and the order that follows.

The order is that of figures, each times a weight, and where these are close that of use: a country's own systems
first, and those of the datum that is in force.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from projdist.decisions.recommendation.same_maps import datum_root
from projdist.projections import CrsRecord

__all__ = ["CLOSE", "WIDE_FACTOR", "Key", "Standing", "in_force", "is_close", "is_own", "is_wide", "preferred", "tiers"]

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
