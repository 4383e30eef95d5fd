"""CRSs that draw the same map: findings in groups, and in which order to name them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist.decisions.recommendation.candidates import Finding
from projdist.projections import AUTHORITIES, CrsRecord

__all__ = ["PLAIN", "Usage", "by_usage", "datum_root", "grouped"]

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
