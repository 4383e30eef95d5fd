"""Purposes of maps, CRSs that draw the same map, and which of them, and of maps that are close, comes first."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from projdist.decisions.map_info import PROPERTIES
from projdist.decisions.recommendation.candidate_crs import Candidate, Key
from projdist.projections import AUTHORITIES, CrsRecord
from projdist.support import Registry, listed

PURPOSES = ("any", *PROPERTIES, "compromise")


def get_purpose(name: str) -> str:
    """The purpose of a name; raises ValueError with close matches."""
    purposes = {purpose: purpose for purpose in PURPOSES}
    return Registry("purpose", purposes, rule=f"It must be {listed(PURPOSES, 'or')}.").named(name)


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """True if a map with these properties serves the purpose; a compromise has none of them."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)


# ---- CRSs of the same map ------------------------------------------------------------------------


_VARIANT = re.compile(r"\((?:z?E[-,]z?N|z?N[-,]z?E)\)$")
"""The end of EPSG's names of CRSs that differ from others only by their axes, or by a zone number in the easting."""

_REALISATION = re.compile(r"\s*[(/\[]|\s+v\d")
"""The beginning of a realisation's name after that of its datum."""

_CLOSE = 0.01  # of the trials' figures: a sphere and an ellipsoid differ by half of that on a map of the world
_ALIKE = 1e-7  # of J: the same map by another method or with other parameters
_NEAR = 1e-4  # of the trials' figures: alike maps differ by no more


Size = Callable[[Candidate], float]


def _trial_value(one: Candidate) -> float:
    return one.trial.value


def grouped(candidates: Sequence[Candidate], size: Size = _trial_value) -> list[list[Candidate]]:
    """Candidates grouped by the map that they draw, under any datum; `size` is the figure that agrees in a group.

    It must be more than rounding: figures that vanish do not agree.
    """
    by_conversion: dict[Any, list[Candidate]] = {}
    for one in candidates:
        by_conversion.setdefault((one.trial.conversion, one.keeps), []).append(one)
    parts = [part for group in by_conversion.values() for part in _close(group, size)]
    return _merged(sorted(parts, key=lambda group: size(group[0])), size)


def by_usage(group: Sequence[Candidate], records: Mapping[str, CrsRecord]) -> list[Candidate]:
    """CRSs of one map in the order in which a surveyor of the region's country would name them.

    The criteria, one after the other: national; an area of use that holds nearly all of the region; a modern datum;
    general use; the latest datum, whose realisations count as one; the first authority; axes east and north; no variant
    by its name; no realisation of another datum in the group; positive coordinates; the smallest area; the lowest code.
    """
    datums = {one.datum for one in group}
    since: dict[str, int] = {}
    for one in group:
        root = datum_root(one.datum)
        since[root] = max(since.get(root, 0), one.since)

    def rank(one: Candidate) -> tuple[Any, ...]:
        authority, _, code = one.code.partition(":")
        return (
            not one.national,
            not one.holds,
            not one.trial.modern,
            one.special,
            -since[datum_root(one.datum)],
            AUTHORITIES.index(authority),
            not one.trial.upright,
            bool(_VARIANT.search(records[one.code].name)),
            any(_realises(one.datum, other) for other in datums),
            not one.trial.positive,
            round(records[one.code].extent_km2),
            len(code),
            code,
        )

    return sorted(group, key=rank)


def datum_root(datum: str) -> str:
    """The name of a datum without its realisation: NAD83 of NAD83(2011), RGF93 of RGF93 v2b."""
    return _REALISATION.split(datum, maxsplit=1)[0]


def _realises(datum: str, other: str) -> bool:
    """True if a datum is by its name a realisation of the other, as NAD83(2011) of NAD83; CH1903+ is none of CH1903."""
    return datum.startswith(other) and datum.removeprefix(other).lstrip().startswith(("(", "/"))


def _close(group: list[Candidate], size: Size) -> list[list[Candidate]]:
    """Candidates of one conversion in groups of the same figure, on any ellipsoid."""
    parts: list[list[Candidate]] = []
    for one in sorted(group, key=size):
        if parts and size(one) <= (1.0 + _CLOSE) * size(parts[-1][0]):
            parts[-1].append(one)
        else:
            parts.append([one])
    return parts


def _merged(groups: list[list[Candidate]], size: Size) -> list[list[Candidate]]:
    """Groups, sorted by size, of which those with the same Jacobians are joined."""
    merged: list[list[Candidate]] = []
    for group in groups:
        one = group[0]
        for other in reversed(merged):
            if not size(other[0]) >= (1.0 - _NEAR) * size(one):
                merged.append(group)
                break
            if np.allclose(other[0].trial.jacobian, one.trial.jacobian, rtol=0.0, atol=_ALIKE, equal_nan=True):
                other += group
                break
        else:
            merged.append(group)
    return merged


# ---- maps that are close -------------------------------------------------------------------------


CLOSE = 0.1
"""Relative difference of figures of maps that are as good as each other.

Official systems and what they replaced, or the zone beside, differ by a few per cent; a tenth of a few hundred ppm is
what the ground's height does to distances within 200 m.
"""

WIDE_FACTOR = 2.0
"""The factor by which a map of the world or a continent must be better than a national one, or a zone."""


def weight_of(one: Candidate, least_share: float) -> float:
    """The factor of a map's figures, if `least_share` of the region counts as all of it."""
    return (1.0 if one.share >= least_share else 1.0 / one.share) * (WIDE_FACTOR if one.wide else 1.0)


def is_close(key: Key, least: Key, close: float) -> bool:
    """True if a map is as good as one that is no worse: by its level only where both figures vanish."""
    if least[0] > 0.0:
        return key[0] <= (1.0 + close) * least[0]
    return key[0] == 0.0 and key[1] <= (1.0 + close) * least[1]


def tiers(maps: Sequence[Candidate], close: float) -> list[list[Candidate]]:
    """Maps in groups that are close by their keys to the best of the group, best group first, each by preference."""
    found: list[list[Candidate]] = []
    for one in sorted(maps, key=lambda each: each.key):
        if found and is_close(one.key, found[-1][0].key, close):
            found[-1].append(one)
        else:
            found.append([one])
    return [preferred(tier) for tier in found]


def in_force(maps: Sequence[Candidate]) -> list[Candidate]:
    """National maps for general use, on the latest datum of any of them, or one of unknown year."""
    latest = _latest(maps)
    return [one for one in maps if latest is not None and _is_general(one) and not _is_outdated(one, latest)]


def preferred(maps: Sequence[Candidate]) -> list[Candidate]:
    """Maps that are close in order of preference: national, for general use, on the datum in force, by their keys."""
    latest = _latest(maps)

    def rank(one: Candidate) -> tuple[bool, bool, bool, Key]:
        return not one.national, one.special, latest is not None and _is_outdated(one, latest), one.key

    return sorted(maps, key=rank)


def _latest(maps: Sequence[Candidate]) -> Candidate | None:
    """The national map for general use on the latest datum."""
    return max(filter(_is_general, maps), key=lambda one: one.since, default=None)


def _is_general(one: Candidate) -> bool:
    return one.national and not one.special


def _is_outdated(one: Candidate, latest: Candidate) -> bool:
    """True if the datum is known to be older, and is no other realisation of the same."""
    return 0 < one.since < latest.since and datum_root(one.datum) != datum_root(latest.datum)
