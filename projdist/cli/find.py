"""The command `find`."""

from __future__ import annotations

from typing import Annotated

import typer

from projdist.cli.errors import fail, refusing
from projdist.cli.options import FormatOption, format_of, whole_number
from projdist.cli.output import present
from projdist.cli.report import Column, Report, Row, Table
from projdist.projections import CrsSearch, find_crs
from projdist.support import shown

_LONGEST = 48  # characters of the name of an area
_MOST = 100_000


def find_command(
    words: Annotated[
        list[str],
        typer.Argument(metavar="WORDS...", help="In any order, of names, areas of use, methods; or a code."),
    ],
    authority: Annotated[
        str, typer.Option(metavar="NAMES", help="Only of EPSG, ESRI, IGNF or IAU_2015, with commas.")
    ] = "",
    deprecated: Annotated[bool, typer.Option("--deprecated", help="Deprecated ones, too.")] = False,
    limit: Annotated[str, typer.Option(metavar="NUMBER", help="How many to print.")] = "10",
    format: FormatOption = "table",
) -> None:
    """Find projected CRSs and named maps by words, the likeliest first."""
    form, most = format_of(format), whole_number("limit", limit, 1, _MOST)
    chosen = [name for name in authority.split(",") if name.strip()]
    with refusing():
        found = find_crs(" ".join(words), authorities=chosen, deprecated=deprecated, limit=most)
    if not found.results:
        fail(f"Nothing is found for '{shown(found.text)}'. {found.advice}")
        raise typer.Exit(1)
    present(_report(found), form)


def _report(found: CrsSearch) -> Report:
    rows = found.rows()
    more = found.total - len(rows)
    return Report(
        tables=[
            Table(
                rows,
                [
                    Column("code", left=True),
                    Column("name", of=_name, left=True),
                    Column("area_name", "area of use", of=_area, left=True),
                ],
            )
        ],
        notes=[f"{more:,} more: --limit {found.total} shows all."] if more else [],
        data=found.to_dict,
        rows=lambda: rows,
    )


def _name(row: Row) -> str:
    return f"{row['name']} (deprecated)" if row["deprecated"] else str(row["name"])


def _area(row: Row) -> str:
    text = str(row["area_name"]).rstrip(".") or "-"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3].rstrip()}..."
