"""What `recommend` answers: CRSs over a region with all their figures, best first."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from projdist.decisions.recommendation.candidates import Distortion, Rejected
from projdist.decisions.recommendation.custom import Custom
from projdist.decisions.recommendation.zones import ZoneSystem
from projdist.regions import Region
from projdist.support import Answer, plain

__all__ = ["Candidate", "Recommendation"]


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A CRS over a region, with all CRSs that draw the same map under other datums.

    `value` is the figure of the criterion, `ranked` what the map counts by: the figure over the share, and for a `wide`
    map, one of the world or a continent, `standing.WIDE_FACTOR` times that. `share` is that of the region
    within the areas of use of all these CRSs, `keeps` what the map keeps true in the region, as measured. `national` is
    whether the country that the region is in has the map for its own; `datum_since` the year of the datum, None where
    the registry has none. `ratio_to_custom` and `difference_to_custom` are the figure over, and less, that of the best
    custom projection; None without one, the ratio also where that is no more than rounding. `over_limit` is the figure
    over `Recommendation.limit`, None without that.
    """

    code: str
    name: str
    method: str
    datum: str
    value: float
    ranked: float
    distortion: Distortion
    keeps: tuple[str, ...]
    share: float
    national: bool
    wide: bool
    datum_since: int | None
    area_of_use: tuple[float, float, float, float]
    area_name: str
    same: tuple[tuple[str, str], ...]
    ratio_to_custom: float | None = None
    difference_to_custom: float | None = None
    over_limit: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": plain(self.value),
            "ranked": plain(self.ranked),
            **{name: plain(value) for name, value in asdict(self.distortion).items()},
            "keeps": list(self.keeps),
            "share_in_area_of_use": self.share,
            "national": self.national,
            "wide": self.wide,
            "datum_since": self.datum_since,
            "area_of_use": {"bounds": list(self.area_of_use), "name": self.area_name},
            "same": [{"code": code, "name": name} for code, name in self.same],
            "ratio_to_custom": plain(self.ratio_to_custom),
            "difference_to_custom": plain(self.difference_to_custom),
            "over_limit": plain(self.over_limit),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "name": self.name,
            "method": self.method,
            "datum": self.datum,
            "value": self.value,
            "ranked": self.ranked,
            **asdict(self.distortion),
            "keeps": " ".join(self.keeps),
            "share_in_area_of_use": self.share,
            "national": self.national,
            "wide": self.wide,
            "datum_since": self.datum_since,
            "area_of_use": self.area_name,
            "same": " ".join(code for code, _ in self.same),
            "ratio_to_custom": self.ratio_to_custom,
            "difference_to_custom": self.difference_to_custom,
            "over_limit": self.over_limit,
            "proj": "",
        }


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recommendation(Answer):
    """The best CRSs for a region, best first, and those that are none, with the reasons.

    `candidates` is the number of CRSs that were considered, `maps` that of different maps among them that serve the
    purpose. `custom` are the best custom projections of families, best first, where they were asked for, and
    `not_custom` the families that have none, with the reasons. `country` is whose land the region is, "" for none;
    `official` the best of its own CRSs for nine tenths of the region and more, for general use, on its datum in force;
    in a state of the USA or a part far away one that is made for that.
    `zones` are systems of conformal zones, where no single CRS serves for engineering; `notes` say what else there is
    to say, with figures. `limit` is, for the Airy-Kavrayskiy errors, about what the best of all maps of the region
    has, of all conformal or equal-area ones for these purposes; None where it is not known. A frame has the results and
    the custom ones.
    """

    region: Region
    purpose: str
    criterion: str
    area: str
    results: tuple[Candidate, ...]
    rejected: tuple[Rejected, ...]
    candidates: int
    maps: int
    custom: tuple[Custom, ...] = ()
    not_custom: tuple[Rejected, ...] = ()
    country: str = ""
    official: Candidate | None = None
    zones: tuple[ZoneSystem, ...] = ()
    notes: tuple[str, ...] = ()
    limit: float | None = None

    def _line(self) -> str:
        best = f"{self.results[0].code}, {self.results[0].name}" if self.results else "no CRS"
        return f"{best}, for {self.region.name}, of {self.candidates} CRSs"

    def to_dict(self) -> dict[str, Any]:
        """The question; lists of `"results"`, `"zones"`, `"custom"`, and what is not; and the `"official"` CRS."""
        return {
            "region": {"name": self.region.name, "area_km2": self.region.area_km2},
            "purpose": self.purpose,
            "criterion": self.criterion,
            "area": self.area,
            "country": self.country,
            "candidates": self.candidates,
            "maps": self.maps,
            "limit": self.limit,
            "results": [result.to_dict() for result in self.results],
            "official": None if self.official is None else self.official.to_dict(),
            "zones": [system.to_dict() for system in self.zones],
            "notes": list(self.notes),
            "custom": [custom.to_dict() for custom in self.custom],
            "not_custom": [{"family": one.name, "reason": one.reason} for one in self.not_custom],
            "rejected": [asdict(rejected) for rejected in self.rejected],
        }

    def rows(self) -> list[dict[str, Any]]:
        """The results as flat rows, names and numbers; then the custom projections, without a code, by PROJ string."""
        return self._table()

    def _table(self) -> list[dict[str, Any]]:
        return [result._row() for result in self.results] + [custom._row() for custom in self.custom]
