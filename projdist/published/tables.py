"""Does a published table come out: its figures beside ours, with what explains the differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from projdist.answer import Answer, plain
from projdist.indices.index import Estimate
from projdist.measures import get_measure
from projdist.published.others import figure_of_others, index_figures
from projdist.published.rows import TABLES, Printed, conventions, printed
from projdist.regions import GLOBE
from projdist.results import factors

__all__ = ["PublishedRow", "PublishedTable", "tables"]

_ROUNDING = 1e-9  # of half a unit of the last decimal


@dataclass(frozen=True)
class PublishedRow:
    """A printed figure, ours with its estimated error, and the figure by the convention that explains the difference.

    `reproduced` is whether the two agree to half a unit of the last decimal printed; `explained` whether the figure by
    the other convention does, which is NaN where there is none, to that and what the convention is said to be off by.
    """

    printed: Printed
    value: float
    error: float
    value_by_convention: float
    explained: bool

    @property
    def difference(self) -> float:
        """Ours less the printed figure."""
        return self.value - self.printed.value

    @property
    def reproduced(self) -> bool:
        """Whether the printed figure comes out."""
        return _agrees(self.printed, self.value)

    @property
    def explanation(self) -> str:
        """By which convention or sampling the printed figure comes out where it does not come out by ours."""
        return conventions()[self.printed.convention][1] if self.printed.convention else ""

    def to_dict(self) -> dict[str, Any]:
        """The figures by name; what is undefined is None."""
        return {name: plain(value) for name, value in self.columns().items()}

    def columns(self) -> dict[str, Any]:
        """The figures by name; what is undefined is NaN."""
        row = self.printed
        return {
            "source": row.source,
            "projection": row.projection,
            "definition": row.definition,
            "lon": row.lon,
            "lat": row.lat,
            "measure": row.measure,
            "published": row.value,
            "decimals": row.decimals,
            "status": row.status,
            "value": self.value,
            "error": self.error,
            "difference": self.difference,
            "reproduced": self.reproduced,
            "convention": row.convention,
            "value_by_convention": self.value_by_convention,
            "explained": self.explained,
            "explanation": self.explanation,
        }


@dataclass(frozen=True)
class PublishedTable(Answer):
    """A table of the literature, a row a figure."""

    name: str
    source: str
    rows: tuple[PublishedRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is undefined is None."""
        return {"name": self.name, "source": self.source, "results": [row.to_dict() for row in self.rows]}

    def _table(self) -> list[dict[str, Any]]:
        return [row.columns() for row in self.rows]


def tables(name: str) -> PublishedTable:
    """A table of the literature (`TABLES`), its figures computed anew; raises ValueError with close matches.

    >>> [round(row.value, 3) for row in tables("kunimune").rows]
    [0.259, 0.364, 0.614]
    """
    rows = printed(name)
    ours = dict(_at_points(rows)) | dict(_of_globe(rows))
    return PublishedTable(name, TABLES[name], tuple(_row(row, ours[row]) for row in rows))


def _row(row: Printed, ours: Estimate) -> PublishedRow:
    other = figure_of_others(row, ours.value)
    slack = conventions()[row.convention][0] if row.convention else 0.0
    return PublishedRow(row, *ours, other, _agrees(row, other, slack))


def _agrees(row: Printed, value: float, slack: float = 0.0) -> bool:
    half = 0.5 * 10.0**-row.decimals * (1.0 + _ROUNDING)
    return abs(value - row.value) <= half + slack


def _grouped(rows: Iterable[Printed], key: Callable[[Printed], str]) -> dict[str, list[Printed]]:
    groups: dict[str, list[Printed]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def _of_globe(rows: Iterable[Printed]) -> Iterator[tuple[Printed, Estimate]]:
    for definition, group in _grouped((row for row in rows if not row.at_point), lambda row: row.definition).items():
        found = index_figures(definition, GLOBE, list(dict.fromkeys(row.measure for row in group)))
        yield from ((row, found[row.measure]) for row in group)


def _at_points(rows: Iterable[Printed]) -> Iterator[tuple[Printed, Estimate]]:
    for definition, group in _grouped((row for row in rows if row.at_point), lambda row: row.definition).items():
        found = factors(definition, [row.lon for row in group], [row.lat for row in group])
        for i, row in enumerate(group):
            measure = get_measure(row.measure)
            value, error = float(measure(found.jacobian[i])), float(found.error[i])
            # A relative error of J, which scales have as it is, and angles as twice so many radians.
            yield row, Estimate(value, math.degrees(2.0 * error) if measure.unit == "deg" else error * abs(value))
