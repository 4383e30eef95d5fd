"""CRSs that draw the same map: findings in groups."""

from __future__ import annotations

from typing import Any

import numpy as np

from projdist.candidates import Finding

__all__ = ["grouped"]

_CLOSE = 0.01  # of the trials' figures: a sphere and an ellipsoid differ by half of that on a map of the world
_ALIKE = 1e-7  # of J: the same map by another method or with other parameters
_NEAR = 1e-4  # of the trials' figures: no more can differ in maps that are alike


def grouped(findings: list[Finding]) -> list[list[Finding]]:
    """Findings grouped by what they draw, under whatever datum."""
    by_conversion: dict[Any, list[Finding]] = {}
    for finding in findings:
        by_conversion.setdefault((finding.conversion, finding.keeps), []).append(finding)
    parts = [part for group in by_conversion.values() for part in _close(group)]
    return _merged(sorted(parts, key=lambda group: group[0].value))


def _close(group: list[Finding]) -> list[list[Finding]]:
    """Findings of one conversion in groups whose figures agree, whatever the ellipsoid."""
    parts: list[list[Finding]] = []
    for finding in sorted(group, key=lambda one: one.value):
        if parts and finding.value <= (1.0 + _CLOSE) * parts[-1][0].value:
            parts[-1].append(finding)
        else:
            parts.append([finding])
    return parts


def _merged(groups: list[list[Finding]]) -> list[list[Finding]]:
    """Groups, sorted by value, with those joined whose maps are alike at every node."""
    merged: list[list[Finding]] = []
    for group in groups:
        one = group[0]
        for other in reversed(merged):
            if not other[0].value >= (1.0 - _NEAR) * one.value:
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
