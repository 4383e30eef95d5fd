"""The CRSs that are looked at for a region: those whose areas of use are the region's, and what is known of them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from projdist._typing import BoolArray
from projdist.decisions.recommendation.candidates import Finding, Rejected
from projdist.decisions.recommendation.country_parts import CountryPart, part_of
from projdist.decisions.recommendation.nations import home_of, is_at_sea, named
from projdist.decisions.recommendation.same_maps import Usage
from projdist.decisions.recommendation.standing import Standing, is_own, is_wide
from projdist.decisions.recommendation.trial_nodes import Lattice
from projdist.projections import UNKNOWN, CrsRecord, Facts, facts_of
from projdist.regions import Region
from projdist.support import close_words, did_you_mean

__all__ = ["HOLDS", "HOLDS_NEARLY", "Pool", "of_datum"]

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
