"""`recommend --regions`: the best CRSs of each of many regions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from projdist.answers import Batch
from projdist.cli.batches import RegionalWork, notices_note, regions_given
from projdist.cli.cells import certain, per_cent
from projdist.cli.errors import refusing
from projdist.cli.report import Column, Report, Row, Table
from projdist.decisions import get_purpose, recommend
from projdist.field import get_figure
from projdist.projections import check_authorities


def recommend_regions(
    regions: Sequence[str],
    others: Mapping[str, object],
    options: Mapping[str, Any],
    work: RegionalWork,
) -> None:
    """Find the best CRSs for each region."""
    with refusing():
        get_purpose(options["purpose"])
        get_figure(options["criterion"])
        check_authorities(options["authorities"])
    areas = regions_given(regions, others)
    found = work.run(recommend, areas, None, options)
    best = [_best(one.region, one.area_km2, one.rows) for one in found.results if one.answer["results"]]
    unserved = [
        f"{one.region}: No CRS serves it with these options." for one in found.results if not one.answer["results"]
    ]
    work.leave(_report(found, best, options), found, best, {area.name: area for area in areas}, unserved)


def _best(region: str, area_km2: float, rows: Sequence[Row]) -> Row:
    return {"region": region, "area_km2": area_km2, **rows[0]}


def _report(found: Batch, best: Sequence[Row], options: Mapping[str, Any]) -> Report:
    criterion = options["criterion"]
    return Report(
        title=f"{len(best)} regions, {options['purpose']}, by {criterion}" if best else "No region is served.",
        tables=[Table(best, [*_columns(criterion)])] if best else [],
        notes=[
            "The best CRS of each region; JSON and CSV have the others, too.",
            "ppm: |scale - 1| in parts per million; omega: angular deformation in degrees; in area: the share of the "
            "region in the CRS's area of use.",
            *notices_note(found),
        ]
        if best
        else [],
        data=lambda: {
            "regions": [
                {**one.answer, "region": {"name": one.region, "area_km2": one.area_km2}, "notices": list(one.notices)}
                for one in found.results
            ],
            "failures": [one.to_dict() for one in found.failures],
        },
        rows=lambda: [_best(one.region, one.area_km2, [row]) for one in found.results for row in one.rows],
        header=["region"],
    )


def _columns(criterion: str) -> Iterator[Column]:
    yield Column("region", left=True)
    yield Column("code")
    yield Column("name")
    yield Column("value", criterion, certain, error=f"{criterion}_error")
    yield Column("max_scale_error_ppm", "ppm max", certain, error="max_scale_error_ppm_error")
    yield Column("max_omega", "omega max", certain, error="max_omega_error")
    yield Column("keeps", of=lambda row: row["keeps"] or "-", left=True)
    yield Column("coverage", "covers", per_cent)
    yield Column("share_in_area_of_use", "in area", per_cent)
