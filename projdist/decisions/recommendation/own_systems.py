"""What a country has of its own for a region: its official CRS, its systems of zones, and how it compares."""

from __future__ import annotations

import numpy as np

from projdist.decisions.recommendation.candidates import Finding
from projdist.decisions.recommendation.contest import Contender, Contest
from projdist.decisions.recommendation.pool import HOLDS_NEARLY
from projdist.decisions.recommendation.purposes import suits
from projdist.decisions.recommendation.standing import in_force
from projdist.decisions.recommendation.zones import ENGINEERING_PPM, ZoneSystem, find_zones
from projdist.field import FIGURES
from projdist.projections import CrsRecord

__all__ = ["official_of", "remark_on_own", "zones_of"]

_UTM = "WGS 84 / UTM zone "
_SCALE = FIGURES["max_scale_error_ppm"]


def official_of(maps: list[Contender], contest: Contest) -> Contender | None:
    """The best of the country's own maps for nearly all of the region, for general use, on the datum in force."""
    current = [maps[i] for i in in_force([one.standing for one in maps])]
    whole = [one for one in current if one.standing.share >= HOLDS_NEARLY]
    return contest.winner([one for one in whole if any(map(contest.pool.is_for_part, _records(one, contest)))])


def _records(one: Contender, contest: Contest) -> list[CrsRecord]:
    return [contest.pool.records[member.code] for member in one.members]


def remark_on_own(maps: list[Contender], best: list[Contender], contest: Contest) -> str:
    """What the country's own system has against the first, "" where that is the country's own."""
    own = [one for one in maps if one.standing.national]
    if not own or not best or best[0].standing.national:
        return ""
    one = next((one for one in best if one.standing.national), min(own, key=lambda one: contest.told(*one.trial)))
    figure = contest.figure_of(one)
    if figure is None:
        return ""
    first, name = best[0], contest.ranking.name
    counts = f"{one.first.code}, the best of those of {contest.pool.home}, counts {one.weight * figure:.5g} by {name}"
    return f"{counts}, {first.first.code} {first.weight * first.found[0]:.5g}."


def zones_of(maps: list[Contender], contest: Contest, purpose: str) -> tuple[ZoneSystem, ...]:
    """Systems of zones, the country's own or else UTM's, where no conformal map serves for engineering.

    Those of a state or a part far away come before those of all of the country; no state works on a datum from before
    satellites.
    """
    pool = contest.pool
    conformal = [one.first for one in maps if "conformal" in one.first.keeps and not one.standing.wide]
    least = min(
        (_scale_error(one, contest) for one in conformal),
        default=np.inf if suits(("conformal",), purpose) else 0.0,
    )
    if least <= ENGINEERING_PPM:
        return ()
    known = [record for record in pool.meeting if record.code in pool.facts]
    own = [record for record in known if pool.is_national(record) and not pool.is_elsewhere(record)]
    frames = {pool.facts[record.code].frame for record in own}
    same = [record for record in known if pool.facts[record.code].frame in frames]  # outlines are not all undisputed
    utm = [record for record in known if record.name.startswith(_UTM)]
    for_part = [record for record in own if pool.is_for_part(record)]
    for records in (*([for_part] if len(for_part) < len(own) else []), own, same, utm):
        found = find_zones(
            pool.region,
            pool.lattice,
            records,
            pool.facts,
            contest.ranking,
            least,
            contest.executor,
            national=records is not utm,
            modern=bool(pool.part.state),
        )
        if found:
            return found
    return ()


def _scale_error(one: Finding, contest: Contest) -> float:
    """The largest scale error in ppm by the trial."""
    return _SCALE(one.jacobian, contest.probe.weight)
