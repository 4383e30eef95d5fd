"""Does a published table come out: its figures beside ours, with what explains the differences."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from projdist.answers.point_factors import factors
from projdist.answers.published.others import figure_of_others, index_figures
from projdist.answers.published.rows import TABLES, Printed, conventions, printed
from projdist.matrices import get_measure
from projdist.numerics import Estimate
from projdist.regions import GLOBE
from projdist.support import Answer, check_choice, plain

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


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PublishedTable(Answer):
    """A table of the literature, a row a figure."""

    name: str
    source: str
    rows: tuple[PublishedRow, ...]

    def _line(self) -> str:
        return f"{self.name}: {len(self.rows)} rows"

    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is undefined is None."""
        return {"name": self.name, "source": self.source, "results": [row.to_dict() for row in self.rows]}

    def _table(self) -> list[dict[str, Any]]:
        return [row.columns() for row in self.rows]


def tables(name: str) -> PublishedTable:
    """A table of the literature, its figures computed anew.

    Parameters
    ----------
    name : str
        "goldberg-gott", "gott-goldberg-vanderbei", "gott-mugnolo-colley", "canters-decleir", "capek", "francula",
        "kunimune", "snyder" or "proj".

    Returns
    -------
    PublishedTable
        A `PublishedRow` for each figure that was printed: it, ours with its estimated error, and the figure by the
        convention that explains the difference, where there is one.

    Raises
    ------
    ValueError
        For another name, with close matches.

    References
    ----------
    Each table has its own, `source`; Kunimune's is Map-Projections, output/parameters.txt.

    Examples
    --------
    >>> [(round(row.printed.value, 3), round(row.value, 3)) for row in tables("kunimune").rows]
    [(0.259, 0.259), (0.364, 0.364), (0.614, 0.614)]
    """
    rows = printed(check_choice("table", name, TABLES))
    ours = dict(_at_points(rows)) | dict(_of_globe(rows))
    return PublishedTable(name=name, source=TABLES[name], rows=tuple(_row(row, ours[row]) for row in rows))


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
