"""The best custom projections for a region, a family at a time, measured as existing CRSs are.

They are on WGS 84, those with formulas for a sphere only, too: so has PROJ the existing CRSs of these methods.
The functions of this module run in other processes, too: what they take and give is small and picklable.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from projdist.decisions.families import extent_of, sensible_families
from projdist.decisions.map_info import properties_of
from projdist.decisions.optimization import best_member
from projdist.decisions.recommendation.candidates import Distortion, Full, Probe, Rejected, measure
from projdist.decisions.recommendation.preference import suits
from projdist.earth import WGS84
from projdist.field import FIGURES, Figure, jacobian
from projdist.projections import ProjectionError
from projdist.regions import Region
from projdist.support import plain

_FAMILIES = {
    "equal-area": ("laea", "aea", "cea"),
    "conformal": ("lcc", "tmerc", "omerc", "stere", "merc"),
    "equidistant": ("aeqd", "eqdc", "eqc"),
    "compromise": ("wintri", "airy"),
}
_LEVEL = FIGURES["airy_kavrayskiy"]


@dataclass(frozen=True, kw_only=True)
class Custom:
    """The best member of a family for a region: its PROJ string, parameters, and figures as a candidate has them."""

    family: str
    name: str
    proj: str
    parameters: dict[str, float]
    value: float
    distortion: Distortion
    keeps: tuple[str, ...]
    over_limit: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "family": self.family,
            "name": self.name,
            "proj": self.proj,
            "parameters": self.parameters,
            "value": plain(self.value),
            **{name: plain(value) for name, value in asdict(self.distortion).items()},
            "keeps": list(self.keeps),
            "over_limit": plain(self.over_limit),
        }

    def _row(self) -> dict[str, Any]:
        return {
            "code": "",
            "name": self.name,
            "method": self.family,
            "datum": "WGS 84",
            "value": self.value,
            "ranked": self.value,
            **asdict(self.distortion),
            "keeps": " ".join(self.keeps),
            "share_in_area_of_use": 1.0,
            "national": False,
            "wide": False,
            "datum_since": None,
            "area_of_use": "",
            "same": "",
            "ratio_to_custom": None,
            "difference_to_custom": None,
            "over_limit": self.over_limit,
            "proj": self.proj,
        }


@dataclass(frozen=True)
class Design:
    """A family to find the best member of, for a region and a figure; what does not serve the purpose is rejected."""

    family: str
    region: Region
    probe: Probe
    ranking: Figure
    purpose: str


def families_for(region: Region, purpose: str) -> list[str]:
    """Families that may serve the purpose: those that suit the region's size and place, if there are any."""
    names = sensible_families(extent_of(region), WGS84)
    if purpose == "any":
        return names
    serving = _FAMILIES[purpose]
    return [name for name in names if name in serving] or list(serving)


def design(task: Design) -> Custom | Rejected:
    """The best member of a family, measured in full."""
    try:
        projection, parameters = best_member(task.family, task.region, task.ranking, WGS84)
        proj = projection.definition
        J = jacobian(projection, task.probe.lon, task.probe.lat)
    except ProjectionError as error:
        return Rejected("", task.family, str(error))
    keeps = properties_of(J, task.probe).keeps
    if not suits(keeps, task.purpose):
        return Rejected("", task.family, f"It is not {task.purpose} on the ellipsoid.")
    level = _LEVEL(J, task.probe.weight)
    found = measure(
        Full(
            code=proj,
            name=task.family,
            region=task.region,
            probe=task.probe,
            keeps=keeps,
            level=level,
            ranking=task.ranking,
        )
    )
    if isinstance(found, Rejected):
        return found
    value, distortion = found
    return Custom(
        family=task.family,
        name=projection.name,
        proj=proj,
        parameters=parameters,
        value=value,
        distortion=distortion,
        keeps=keeps,
    )
