"""Systems of zones for a region, and the CRSs of its country."""

import functools
import operator
import re
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from projdist import regions
from projdist._typing import BoolArray, FloatArray
from projdist.decisions.candidate_crs import HOLDS_NEARLY, Candidate, try_crs
from projdist.decisions.map_info import WeightedPoints
from projdist.decisions.measurement import Area, FullMeasurement, Lattice, Rejected, evaluate, probe_of
from projdist.decisions.ranking import Shortlist, in_force, suits
from projdist.field import FIGURES, Figure
from projdist.projections import CrsRecord, Facts, datum_root
from projdist.support import Record, run_all, schema

ENGINEERING_PPM = 100.0
"""Largest scale error of a conformal map that needs no zones: 1 : 10,000, the limit of the State Plane zones of the USA
(J. E. Stem 1989, State Plane Coordinate System of 1983, NOAA Manual NOS NGS 5, 1.4)."""

_WHOLE = 0.95  # of the region: areas of use are rounded, and outlines have disputed land
_MOST = 80  # zones of a system: Russia has 29 of six degrees, and 55 of three
_SHOWN = 3  # systems
_ASIDE = 0.08  # of the region's width or height, from which on a zone does not lie in the middle
_SLIVER = 0.005  # of the region: systems that differ only by smaller zones are the same
_CYLINDRICAL, _SCALE_FACTOR = (9807, 9808), 8805  # EPSG's codes of Transverse Mercator, north and south, and its scale
_PPM = FIGURES["max_scale_error_ppm"]
_LEVEL = 1e-4  # the Airy-Kavrayskiy error of a zone, about

# Where names of zones of one system differ: in numbers, also Roman, with degrees and hemispheres; or in the direction.
_NUMBER = re.compile(r"\d+(?:[.'/-]\d+)*\s*[NSEW]?\b|\b[IVX]+\b|\d+")
_DIRECTION = re.compile(r"\b(?:North|South|East|West|Central)\b\s*")


@dataclass(frozen=True)
class Zone(Record):
    """A CRS over the part of the region in its area of use."""

    code: str
    name: str
    part: str  # where that lies in the region, as "northeast" or "middle"
    share: float = field(metadata=schema("share_in_area_of_use"))
    value: float  # of the criterion there
    max_scale_error_ppm: float  # the largest |scale - 1|


@dataclass(frozen=True, kw_only=True)
class ZoneSystem(Record):
    """Zones that together cover the region, from west to east; the figures are the worst of any zone."""

    name: str  # from the names of the first and the last zone
    national: bool  # True for a system of the region's country
    share: float = field(metadata=schema("share_in_area_of_use"))
    value: float
    max_scale_error_ppm: float
    zones: tuple[Zone, ...]


# ---- systems ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class _System:
    """CRSs of one system, the points of the lattice that each holds, and their datum with its year."""

    records: tuple[CrsRecord, ...]
    held: BoolArray
    since: int
    datum: str
    special: bool


def find_zones(
    shortlist: Shortlist, records: Sequence[CrsRecord], above_ppm: float, *, national: bool
) -> tuple[ZoneSystem, ...]:
    """Systems of conformal zones that cover the region with scale errors below `above_ppm`, in a state on average."""
    # Systems on an older datum than others are left out, and so are those on a datum from before satellites, unless
    # there are no others (in US states always). Those for general use come first, then those of the fewest zones.
    pool, executor = shortlist.pool, shortlist.executor
    lattice, in_state = pool.lattice, bool(pool.part.state)
    systems = _systems(records, pool.facts, lattice, pool.part.state)
    trials = {
        record.code: functools.partial(try_crs, record, _probe(lattice, held), _PPM)
        for system in systems
        for record, held in zip(system.records, system.held, strict=True)
        if held.any()
    }
    found = dict(zip(trials, run_all(executor, operator.call, list(trials.values())), strict=True))
    serving = [system for system in systems if _serves(system, found, above_ppm, lattice.weight if in_state else None)]
    kept = _in_force(serving, found, in_state)
    made = (_measured(lattice, system, shortlist.ranking, executor, national) for system in kept[:_SHOWN])
    return tuple(
        system for system in made if system is not None and (in_state or system.max_scale_error_ppm < above_ppm)
    )


def _systems(records: Sequence[CrsRecord], facts: Mapping[str, Facts], lattice: Lattice, state: str) -> list[_System]:
    """Systems that cover a region; of those that draw the same maps the one on the latest datum, with plain names."""
    families = [sorted(family, key=_number) for family in _families(records, facts, state)]
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


def _families(records: Sequence[CrsRecord], facts: Mapping[str, Facts], state: str) -> list[list[CrsRecord]]:
    """Groups of CRSs whose names differ by numbers (in a state by directions), and groups of the rest by method."""
    # CRSs of a group have frame, method and prime meridian in common, cylinders also their scale factor.
    by_name: dict[Any, list[CrsRecord]] = {}
    for record in records:
        if facts[record.code].draws is not None:
            system = _DIRECTION.sub("", record.name) if state else record.name
            kind = _kind(record, facts[record.code])
            # Zones of a state may have methods and scales of their own.
            is_of_state = bool(state) and (system != record.name or state in record.name)
            key = (kind[:2] if is_of_state else kind), _NUMBER.sub("", system).strip()
            by_name.setdefault(key, []).append(record)
    families = []
    by_kind: dict[Any, list[CrsRecord]] = {}
    for family in by_name.values():
        if len({facts[record.code].draws for record in family}) > 1:
            families.append(family)
        else:
            last = max(family, key=_number)
            by_kind.setdefault(_kind(last, facts[last.code]), []).append(last)
    # Of each map only the CRS with the highest code: KGD2002 / West Belt 2010, not West Belt.
    sets = [sorted(family, key=_number) for family in by_kind.values() if len(family) > 1]
    return families + [list({facts[record.code].draws: record for record in family}.values()) for family in sets]


def _kind(record: CrsRecord, facts: Facts) -> Any:
    """The key that zones of one system have in common."""
    method, meridian, parameters = facts.draws
    scale = [value for code, value, _ in parameters if code == _SCALE_FACTOR and method in _CYLINDRICAL]
    return record.code.partition(":")[0], facts.frame, method, meridian, tuple(scale)


def _drawn(facts: Facts) -> Any:
    """The identity of a map regardless of its axes, which may point south for Transverse Mercator."""
    method, *rest = facts.draws
    return _CYLINDRICAL[0] if method in _CYLINDRICAL else method, *rest


def _number(record: CrsRecord) -> tuple[int, str]:
    """Sort key of a code by its number, without the authority."""
    code = record.code.partition(":")[2]
    return len(code), code


def _datum(record: CrsRecord) -> str:
    """The datum in the name of a CRS: ETRS89 of ETRS89 / UTM zone 32N."""
    return record.name.partition(" / ")[0]


def _probe(lattice: Lattice, held: BoolArray) -> WeightedPoints:
    """The lattice's points in a zone."""
    weight = lattice.weight[held]
    return WeightedPoints(lattice.lon[held], lattice.lat[held], weight / weight.sum())


def _serves(
    system: _System, found: Mapping[str, Candidate | Rejected], above_ppm: float, weight: FloatArray | None = None
) -> bool:
    """True if by their trials all zones are conformal, with errors below `above_ppm`; with weights, on average."""
    # A state's zones are its law even where a far island, such as Isle Royale in Michigan, has larger errors.
    trials = [
        (found[record.code], held) for record, held in zip(system.records, system.held, strict=True) if held.any()
    ]
    if not all(isinstance(one, Candidate) and "conformal" in one.keeps for one, _ in trials):
        return False
    errors = np.array([one.trial.value for one, _ in trials if isinstance(one, Candidate)])
    if weight is None:
        return bool((errors < above_ppm).all())
    return bool(np.average(errors, weights=[weight[held].sum() for _, held in trials]) < above_ppm)


def _in_force(systems: list[_System], found: Mapping[str, Candidate | Rejected], only_modern: bool) -> list[_System]:
    """Systems on the latest modern datum, else on the latest of all; for general use and of few zones first."""
    on_modern = {code for code, one in found.items() if isinstance(one, Candidate) and one.trial.modern}
    modern = [system for system in systems if any(record.code in on_modern for record in system.records)]
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
    lattice: Lattice, system: _System, ranking: Figure, executor: Executor | None, national: bool
) -> ZoneSystem | None:
    """A system with the figures of its zones that meet the region, each over its part of it."""
    region = lattice.region
    meeting = [
        (record, part, _where(lattice, held), _probe(lattice, held) if held.any() else probe_of(part))
        for record, held in zip(system.records, system.held, strict=True)
        if (part := _part(region, record.area_of_use)) is not None
    ]
    tasks = [
        FullMeasurement(record.code, record.name, part, probe, ("conformal",), _LEVEL, figure)
        for figure in dict.fromkeys((ranking, _PPM))
        for record, part, _, probe in meeting
    ]
    figures = [one for one in run_all(executor, evaluate, tasks) if not isinstance(one, Rejected)]
    if len(figures) < len(tasks):
        return None
    values, worst = figures[: len(meeting)], figures[-len(meeting) :]
    zones = tuple(
        Zone(record.code, record.name, where, part.area_km2 / region.area_km2, value, ppm)
        for (record, part, where, _), value, ppm in zip(meeting, values, worst, strict=True)
    )
    return ZoneSystem(
        name=f"{zones[0].name} to {zones[-1].name.partition(' / ')[2] or zones[-1].name}",
        national=national,
        share=float(system.held.any(axis=0) @ lattice.weight),
        value=max(zone.value for zone in zones),
        max_scale_error_ppm=max(zone.max_scale_error_ppm for zone in zones),
        zones=zones,
    )


def _where(lattice: Lattice, held: BoolArray) -> str:
    """The part of the region that a zone holds, as a compass says it, by the middle of its points."""
    if not held.any():
        return "margin"
    west, south, east, north = lattice.region.bounds
    weight = np.where(held, lattice.weight, 0.0) / lattice.weight[held].sum() - lattice.weight
    right, up = weight @ ((lattice.lon - west) % 360.0) / (east - west), weight @ lattice.lat / (north - south)
    vertical = "north" if up > _ASIDE else "south" if up < -_ASIDE else ""
    return vertical + ("east" if right > _ASIDE else "west" if right < -_ASIDE else "") or "middle"


def _part(region: regions.Region, area: Area) -> regions.Region | None:
    """The part of a region in a zone, None if empty."""
    try:
        return regions.combine("&", region, regions.Box(*area), region.name)
    except ValueError:
        return None


# ---- national systems ----------------------------------------------------------------------------


def official_of(maps: Sequence[Candidate], best: Sequence[Candidate], shortlist: Shortlist) -> Candidate | None:
    """The best national map for nearly all of the region, for general use, on the datum in force."""
    whole = [one for one in in_force(maps) if one.share >= HOLDS_NEARLY]
    pool = shortlist.pool
    for_part = [one for one in whole if any(pool.is_for_part(pool.records[code]) for code in one.codes)]
    return shortlist.winner(for_part, best)


def remark_on_own(maps: Sequence[Candidate], best: Sequence[Candidate], shortlist: Shortlist) -> str:
    """A sentence that compares the best national map with the first result, "" if that is national."""
    own = [one for one in maps if one.national]
    if not own or not best or best[0].national:
        return ""
    one = next((one for one in best if one.national), min(own, key=shortlist.trial_key))
    figure = shortlist.figure_of(one)
    if figure is None:
        return ""
    counts = f"{one.code}, the best of those of {shortlist.pool.home}, counts {one.weight * figure:.5g}"
    return f"{counts} by {shortlist.ranking.name}, {best[0].code} {best[0].ranked:.5g}."


def zones_of(maps: Sequence[Candidate], shortlist: Shortlist, purpose: str) -> tuple[ZoneSystem, ...]:
    """Systems of zones, national or else UTM's, where no conformal map serves for engineering."""
    # Those of a state or a part far away come before those of all of the country.
    conformal = (one for one in maps if "conformal" in one.keeps and not one.wide)
    none = np.inf if suits(("conformal",), purpose) else 0.0
    least = min((_PPM(one.trial.jacobian, shortlist.probe.weight) for one in conformal), default=none)
    if least <= ENGINEERING_PPM:
        return ()
    pool = shortlist.pool
    known = [record for record in pool.meeting if record.code in pool.facts]
    own = [record for record in known if pool.is_national(record)]
    own = [record for record in own if not pool.part.is_elsewhere(pool.facts[record.code].extents)]
    for_part = [record for record in own if pool.is_for_part(record)]
    frames = {pool.facts[record.code].frame for record in own}
    choices = [for_part] if len(for_part) < len(own) else []
    choices += [own, [record for record in known if pool.facts[record.code].frame in frames]]  # of disputed outlines
    for records in choices:
        if found := find_zones(shortlist, records, least, national=True):
            return found
    utm = [record for record in known if record.name.startswith("WGS 84 / UTM zone ")]
    return find_zones(shortlist, utm, least, national=False)
