"""The report of the command `factors`: what a projection does at points."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

from projdist.cli.cells import fixed, label_of
from projdist.cli.report import Column, Report, Table

_DECIMALS = {"x": 3, "y": 3, "omega": 6, "theta": 6, "convergence": 6}
_MOST_DECIMALS = 8


def factors_report(found: Mapping[str, Any], header: Sequence[str]) -> Report:
    """Factors at points; the header is for CSV without points."""
    rows = found["results"]
    columns = [Column(name, show=functools.partial(_cell, name)) for name in (rows[0] if rows else ())]
    keys = 2 if [column.key for column in columns[:2]] == ["lon", "lat"] else 1
    return Report(
        title=_title(found["projection"], found["name"], found["definition"]) if rows else "No point could be read.",
        tables=[Table(rows, columns, keys=keys)] if rows else [],
        data=lambda: found,
        header=header,
    )


def _title(given: str, name: str, definition: str) -> str:
    """A projection as it was given, with what that means, which names the figure of the Earth: `krovak (+proj=...)`."""
    label, meant = label_of(given, name), label_of(definition, name)
    return label if label == meant else f"{label} ({meant})"


def _cell(name: str, value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if name in ("lon", "lat"):
        return f"{value:.10g}"
    if abs(value) >= 1e6 and name not in ("x", "y"):
        return f"{value:.9g}"
    return fixed(value, _DECIMALS.get(name, _MOST_DECIMALS))
