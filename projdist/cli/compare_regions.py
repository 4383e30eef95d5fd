"""`compare --regions`: maps over each of many regions."""

from __future__ import annotations

import functools
import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from projdist.answers import Batch, BatchFailure, Index, get_indices, sort_column, sort_order, summarize
from projdist.cli.batches import RegionalWork, by_region, notices_note, regions_given
from projdist.cli.cells import certain, label_of, per_cent, rounded
from projdist.cli.errors import refusing, tell_problems
from projdist.cli.report import Column, Report, Row, Table
from projdist.projections import Projection, ProjectionError

_LEVEL = "airy_kavrayskiy"
_NO_FIGURE = ("given", "name")  # orders that no map is the best by


def compare_regions(
    projections: Sequence[str],
    regions: Sequence[str],
    others: Mapping[str, object],
    options: Mapping[str, Any],
    sort: str,
    work: RegionalWork,
) -> None:
    """Compare maps over regions, and tell which is the best where."""
    with refusing():
        indices = get_indices(options["indices"])
        column = sort_column(sort, options["measures"], [index.name for index in indices])
    areas = regions_given(regions, others)
    maps, problems = _known(projections)
    if not maps:
        tell_problems(problems)
    found = work.run(summarize, areas, maps, options)
    report, best = _report(found, maps, column, indices)
    work.leave(report, found, best, {area.name: area for area in areas}, problems)


def _known(projections: Sequence[str]) -> tuple[list[str], list[str]]:
    """The maps that there are, and what is wrong with others, which need not be said of every region."""
    maps, problems = [], []
    for text in dict.fromkeys(projections):
        try:
            Projection.from_user_input(text)
        except ProjectionError as error:
            problems.append(str(error))
        else:
            maps.append(text)
    return maps, problems


def _report(found: Batch, maps: Sequence[str], column: str, indices: Sequence[Index]) -> tuple[Report, list[Row]]:
    """The report, and the best map of each region."""
    groups = {
        name: _sorted([_row(one.rows[0], name, one.area_km2) for one in group], column)
        for name, group in by_region(found).items()
    }
    figure = _LEVEL if column in _NO_FIGURE else column
    rows = [_of_region(name, group, figure) for name, group in groups.items()]
    best = [_sorted(group, figure)[0] for group in groups.values()]
    report = Report(
        title=f"{len(groups)} regions, {len(maps)} maps, {figure}" if groups else "No region could be measured.",
        tables=[Table(rows, [*_columns(groups, maps, figure)]), _totals(groups, maps, figure)] if rows else [],
        notes=[
            "* is the best of a region. JSON and CSV have all figures of every map over every region.",
            *notices_note(found),
        ]
        if rows
        else [],
        data=lambda: _data(found, groups, column, indices),
        rows=lambda: [row for group in groups.values() for row in group],
        header=["region"],
    )
    return report, best


def _row(row: Row, region: str, area_km2: float) -> Row:
    return {"region": region, "area_km2": area_km2, **row}


def _sorted(rows: Sequence[Row], column: str) -> list[Row]:
    """Rows of a region, the best first."""
    return list(rows) if column == "given" else sorted(rows, key=lambda row: _order(row[column]))


def _order(value: Any) -> tuple[bool, Any]:
    return sort_order(float("nan") if value is None else value)


def _of_region(name: str, group: Sequence[Row], figure: str) -> Row:
    """The figures of all maps over a region, by the maps."""
    best = _sorted(group, figure)[0]
    figures = {row["projection"]: row[figure] for row in group}
    errors = {f"{row['projection']} error": row.get(_error_of(figure)) for row in group}
    least = min(row["coverage"] for row in group)
    label = label_of(best["projection"], best["name"])
    return {"region": name, "best": label, "given": best["projection"], "coverage": least, **figures, **errors}


def _error_of(figure: str) -> str:
    return "error_estimate" if figure.startswith(_LEVEL) else f"{figure}_error"


def _columns(groups: Mapping[str, Sequence[Row]], maps: Sequence[str], figure: str) -> Iterator[Column]:
    names = {row["projection"]: row["name"] for group in groups.values() for row in group}
    show = rounded if figure.startswith(_LEVEL) else certain
    yield Column("region", left=True)
    yield Column("best", left=True)
    for one in maps:
        yield Column(one, label_of(one, names.get(one, one)), of=functools.partial(_cell, one, show))
    if any(row["coverage"] < 1.0 - 1e-6 for group in groups.values() for row in group):
        yield Column("coverage", "covers", per_cent)


def _cell(one: str, show: Any, row: Row) -> str:
    """The figure of a map, with a star where it is the best; a dash where there is none."""
    if row.get(one) is None:
        return "-"
    text: str = show(row[one], row.get(f"{one} error"))
    return f"{text}{'*' if row['given'] == one else ' '}"


def _totals(groups: Mapping[str, Sequence[Row]], maps: Sequence[str], figure: str) -> Table:
    """How each map does in all regions."""
    rows = []
    for one in maps:
        of_it = {name: row for name, group in groups.items() for row in group if row["projection"] == one}
        known = {name: row[figure] for name, row in of_it.items() if row[figure] is not None}
        best = sum(_sorted(group, figure)[0]["projection"] == one for group in groups.values())
        worst = max(known, key=known.__getitem__, default=None)
        rows.append(
            {
                "projection": one,
                "best": best,
                "median": statistics.median(known.values()) if known else None,
                "largest": None if worst is None else known[worst],
                "where": worst,
            }
        )
    columns = [
        Column("projection", left=True),
        Column("best", "best in"),
        Column("median", show=certain),
        Column("largest", show=certain),
        Column("where", left=True),
    ]
    return Table(rows, columns, f"{figure} over all regions")


def _data(found: Batch, groups: Mapping[str, Sequence[Row]], column: str, indices: Sequence[Index]) -> dict[str, Any]:
    """A comparison for each region, as of one region, and what was told."""
    answers = {(one.region, one.projection): one for one in found.results}
    failures: dict[str, list[BatchFailure]] = {}
    for failure in found.failures:
        failures.setdefault(failure.region, []).append(failure)
    over = {index.name: index.published_over for index in indices if index.published_over}
    return {
        "regions": [
            {
                "region": {"name": name, "area_km2": group[0]["area_km2"]},
                "results": [answers[name, row["projection"]].answer for row in group],
                "failures": [{"projection": one.projection, "error": one.error} for one in failures.get(name, [])],
                "notices": [*dict.fromkeys(word for row in group for word in answers[name, row["projection"]].notices)],
            }
            for name, group in groups.items()
        ],
        "failures": [one.to_dict() for one in found.failures],
        **({"published_over": over} if indices else {}),
    }
