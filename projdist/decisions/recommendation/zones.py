"""Systems of zones, and what a country has of its own for a region."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import BoolArray
from projdist.decisions.recommendation.candidate_crs import HOLDS_NEARLY
from projdist.decisions.recommendation.candidates import (
    Area,
    Finding,
    Full,
    Lattice,
    Probe,
    Rejected,
    Trial,
    probe_of,
    settle,
    try_crs,
)
from projdist.decisions.recommendation.preference import datum_root, in_force, suits
from projdist.decisions.recommendation.shortlist import Contender, Contest
from projdist.field import FIGURES, Figure
from projdist.projections import CrsRecord, Facts
from projdist.regions import Box, Region
from projdist.support import plain, run_all

ENGINEERING_PPM = 100.0
"""What a conformal map may be off by that needs no zones: 1 : 10,000, as the State Plane zones of the USA were drawn
(J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5, 1.4)."""

_WHOLE = 0.95  # of the region: areas of use are rounded, and outlines have disputed land
_MOST = 80  # zones of a system: Russia has 29 of six degrees, and 55 of three
_SHOWN = 3  # systems
_SLIVER = 0.005  # of the region: less does not make a system another one
_CYLINDRICAL, _SCALE_FACTOR = (9807, 9808), 8805  # EPSG's codes of Transverse Mercator, north and south, and its scale
_PPM = FIGURES["max_scale_error_ppm"]
_LEVEL = 1e-4  # what the Airy-Kavrayskiy error of a zone is, about

# What differs in the names of zones of one system: numbers, also Roman, with what they are degrees or halves of.
_NUMBER = re.compile(r"\d+(?:[.'/-]\d+)*\s*[NSEW]?\b|\b[IVX]+\b|\d+")


@dataclass(frozen=True)
class Zone:
    """A CRS over the region's part in its area of use, which is `share` of the region.

    `value` is the figure of the criterion there, `max_scale_error_ppm` the largest |scale - 1|.
    """

    code: str
    name: str
    share: float
    value: float
    max_scale_error_ppm: float


@dataclass(frozen=True, kw_only=True)
class ZoneSystem:
    """Zones that cover the region together, from west to east; the figures are the worst of any zone in its part.

    `name` is that of the first and the last; `national` is whether they are the country's own.
    """

    name: str
    national: bool
    share: float
    value: float
    max_scale_error_ppm: float
    zones: tuple[Zone, ...]

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON."""
        return {
            "name": self.name,
            "national": self.national,
            "share_in_area_of_use": self.share,
            "value": plain(self.value),
            "max_scale_error_ppm": plain(self.max_scale_error_ppm),
            "zones": [
                {
                    "code": zone.code,
                    "name": zone.name,
                    "share_in_area_of_use": zone.share,
                    "value": plain(zone.value),
                    "max_scale_error_ppm": plain(zone.max_scale_error_ppm),
                }
                for zone in self.zones
            ],
        }


# ---- which systems there are ----------------------------------------------------------------


@dataclass(frozen=True)
class _System:
    """CRSs of one system, what the lattice has of each, and the year of their datum."""

    records: tuple[CrsRecord, ...]
    held: BoolArray
    since: int
    datum: str
    special: bool


def find_zones(
    region: Region,
    lattice: Lattice,
    records: Sequence[CrsRecord],
    facts: Mapping[str, Facts],
    ranking: Figure,
    above_ppm: float,
    executor: Executor | None,
    *,
    national: bool,
    modern: bool,
) -> tuple[ZoneSystem, ...]:
    """Systems of conformal zones among CRSs that cover a region, and whose largest scale errors are less than a figure.

    None that has a CRS for the whole region is one. Those of an older datum than others are left out, and those of one
    from before satellites unless there are no others, with `modern` even then; those for general use come first, of
    these those with the fewest zones.
    """
    systems = _systems(records, facts, lattice)
    trials = [
        Trial(record.code, record.name, _probe(lattice, held), _PPM)
        for system in systems
        for record, held in zip(system.records, system.held, strict=True)
        if held.any()
    ]
    found = dict(zip((trial.code for trial in trials), run_all(executor, try_crs, trials), strict=True))
    kept = _in_force([system for system in systems if _serves(system, found, above_ppm)], found, modern)
    made = (_measured(region, lattice, system, ranking, executor, national) for system in kept[:_SHOWN])
    return tuple(system for system in made if system is not None and system.max_scale_error_ppm < above_ppm)


def _systems(records: Sequence[CrsRecord], facts: Mapping[str, Facts], lattice: Lattice) -> list[_System]:
    """The systems that cover a region, each map once: of the latest datum and the plainest names that have it."""
    families = [sorted(family, key=_number) for family in _families(records, facts)]
    latest: dict[str, int] = {}
    for family in families:
        root = datum_root(_datum(family[0]))
        latest[root] = max(latest.get(root, 0), facts[family[0].code].since)

    def plainness(family: list[CrsRecord]) -> tuple[Any, ...]:
        first = family[0]
        datum = _datum(first)
        return -latest[datum_root(datum)], datum != datum_root(datum), "(" in first.name, _number(first)

    found: dict[Any, _System] = {}
    for family in sorted(families, key=plainness):
        held = lattice.within([record.area_of_use for record in family])
        shares = held @ lattice.weight
        if held.any(axis=0) @ lattice.weight >= _WHOLE > shares.max() and len(family) <= _MOST:
            drawn = frozenset(_drawn(facts[family[i].code]) for i in range(len(family)) if shares[i] > _SLIVER)
            datum = _datum(family[0])
            special = facts[family[0].code].special
            found.setdefault(drawn, _System(tuple(family), held, latest[datum_root(datum)], datum, special))
    return list(found.values())


def _families(records: Sequence[CrsRecord], facts: Mapping[str, Facts]) -> list[list[CrsRecord]]:
    """CRSs that differ in their names by numbers only, and those that do by words and are left alone by that.

    All of one have frame, method and prime meridian in common, and cylinders their scale factor, too.
    """
    by_name: dict[Any, list[CrsRecord]] = {}
    for record in records:
        if facts[record.code].draws is not None:
            key = _kind(record, facts[record.code]), _NUMBER.sub("", record.name).strip()
            by_name.setdefault(key, []).append(record)
    families = []
    by_kind: dict[Any, list[CrsRecord]] = {}
    for (kind, _), family in by_name.items():
        if len({facts[record.code].draws for record in family}) > 1:
            families.append(family)
        else:
            by_kind.setdefault(kind, []).append(_newest(family))
    return families + [_without_twins(family, facts) for family in by_kind.values() if len(family) > 1]


def _kind(record: CrsRecord, facts: Facts) -> Any:
    """What zones of one system have in common."""
    method, meridian, parameters = facts.draws
    scale = [value for code, value, _ in parameters if code == _SCALE_FACTOR and method in _CYLINDRICAL]
    return record.code.partition(":")[0], facts.frame, method, meridian, tuple(scale)


def _drawn(facts: Facts) -> Any:
    """What identifies a map whichever way its axes point: Transverse Mercator is also one with them to the south."""
    method, *rest = facts.draws
    return _CYLINDRICAL[0] if method in _CYLINDRICAL else method, *rest


def _without_twins(family: list[CrsRecord], facts: Mapping[str, Facts]) -> list[CrsRecord]:
    """One CRS of each map."""
    by_map: dict[Any, list[CrsRecord]] = {}
    for record in family:
        by_map.setdefault(facts[record.code].draws, []).append(record)
    return [_newest(twins) for twins in by_map.values()]


def _newest(family: list[CrsRecord]) -> CrsRecord:
    """The CRS of a map that came last into the registry: KGD2002 / West Belt 2010, not West Belt."""
    return max(family, key=_number)


def _number(record: CrsRecord) -> tuple[int, str]:
    """The code without its authority, in the order of numbers."""
    code = record.code.partition(":")[2]
    return len(code), code


def _datum(record: CrsRecord) -> str:
    """The datum as the name of a CRS has it: ETRS89 of ETRS89 / UTM zone 32N."""
    return record.name.partition(" / ")[0]


def _probe(lattice: Lattice, held: BoolArray) -> Probe:
    """The points of a lattice that a zone holds."""
    weight = lattice.weight[held]
    return Probe(lattice.lon[held], lattice.lat[held], weight / weight.sum())


def _serves(system: _System, found: Mapping[str, Finding | Rejected], above_ppm: float) -> bool:
    """Whether all zones are conformal, and better than a figure by their trials."""
    trials = [found[record.code] for record in system.records if record.code in found]
    return all(isinstance(one, Finding) and "conformal" in one.keeps and one.value < above_ppm for one in trials)


def _in_force(systems: list[_System], found: Mapping[str, Finding | Rejected], only_modern: bool) -> list[_System]:
    """Systems on datums of today, if there are any, and of the latest of these; for general use, of few zones first."""

    def is_modern(system: _System) -> bool:
        return any(getattr(found.get(record.code), "modern", False) for record in system.records)

    modern = [system for system in systems if is_modern(system)]
    if not modern and not only_modern:
        modern = systems
    latest = max((system.since for system in modern), default=0)
    plain = {system.datum for system in modern}
    kept = [
        system
        for system in modern
        if system.since in (0, latest)
        and (datum_root(system.datum) == system.datum or datum_root(system.datum) not in plain)
    ]
    return sorted(kept, key=lambda system: (system.special, len(system.records)))


# ---- their figures --------------------------------------------------------------------------


def _measured(
    region: Region, lattice: Lattice, system: _System, ranking: Figure, executor: Executor | None, national: bool
) -> ZoneSystem | None:
    """A system with the figures of its zones that meet the region, each over the region's part in its area of use."""
    found = {record.code: _part(region, record.area_of_use) for record in system.records}
    parts = {code: part for code, part in found.items() if part is not None}
    meeting = [record for record in system.records if record.code in parts]
    probes = {
        record.code: _probe(lattice, held) if held.any() else probe_of(parts[record.code])
        for record, held in zip(system.records, system.held, strict=True)
        if record.code in parts
    }
    tasks = [
        Full(
            code=record.code,
            name=record.name,
            region=parts[record.code],
            probe=probes[record.code],
            keeps=("conformal",),
            level=_LEVEL,
            ranking=figure,
        )
        for figure in dict.fromkeys((ranking, _PPM))
        for record in meeting
    ]
    settled = run_all(executor, settle, tasks)
    figures = [one for one in settled if not isinstance(one, Rejected)]
    if len(figures) < len(tasks):
        return None
    values, worst = figures[: len(meeting)], figures[-len(meeting) :]
    zones = tuple(
        Zone(record.code, record.name, parts[record.code].area_km2 / region.area_km2, value, ppm)
        for record, value, ppm in zip(meeting, values, worst, strict=True)
    )
    return ZoneSystem(
        name=f"{zones[0].name} to {zones[-1].name.partition(' / ')[2] or zones[-1].name}",
        national=national,
        share=float(system.held.any(axis=0) @ lattice.weight),
        value=max(zone.value for zone in zones),
        max_scale_error_ppm=max(zone.max_scale_error_ppm for zone in zones),
        zones=zones,
    )


def _part(region: Region, area: Area) -> Region | None:
    """What a zone has of a region; None where that is nothing."""
    from projdist.regions import combine  # shapely is slow to load

    try:
        return combine("&", region, Box(*area), region.name)
    except ValueError:
        return None


# ---- own systems ---------------------------------------------------------------------------------


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
