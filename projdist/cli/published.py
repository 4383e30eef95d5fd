"""The command `tables`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer

from projdist.answers import TABLES, tables
from projdist.cli.cells import first_digit, fixed
from projdist.cli.errors import refusing
from projdist.cli.options import FileFormatOption, OutputOption, OverwriteOption, format_for, printed_or_file
from projdist.cli.output import present
from projdist.cli.progress import working
from projdist.cli.report import Column, Mapped, Report, Row, Table, listing


def tables_command(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help=f"{', '.join(TABLES)}; without it, the list of them.")
    ] = None,
    format: FileFormatOption = None,
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Print a table of the literature beside the same figures computed anew, and what explains the differences."""
    path = printed_or_file(output, overwrite)
    form = format_for(format, path)
    with refusing(), working("Computing"):
        report = listing(_names()) if name is None else _report(tables(name).to_dict())
    present(report, form, path, overwrite)


def _names() -> list[Row]:
    return [{"name": table, "source": source} for table, source in TABLES.items()]


def _report(found: dict[str, Any]) -> Report:
    rows = found["results"]
    explanations = {row["convention"]: row["explanation"] for row in rows if row["convention"]}
    places = [] if rows[0]["lat"] is None else [Column(key, show="{:.9g}".format) for key in ("lon", "lat")]
    others = [
        Column("value_by_convention", "otherwise", of=lambda row: _shown("value_by_convention", row)),
        Column("convention"),
    ]
    columns = [
        Column("projection"),
        *places,
        Column("measure"),
        Column("published", of=lambda row: f"{row['published']:.{row['decimals']}f}"),
        Column("value", "ours", of=lambda row: _shown("value", row)),
        Column("error", show=first_digit),
        Column("difference", of=lambda row: _shown("difference", row, "+")),
        Column("reproduced", "comes out", of=_verdict, left=True),
        *(others if explanations else []),
    ]
    notes = [
        "Comes out: ours agrees to half a unit of the last digit printed.",
        *(f"{convention}: {text}" for convention, text in explanations.items()),
        *sorted({f"Source: {row['source']} ({row['status']})." for row in rows}),
    ]
    return Report(
        title=found["source"],
        tables=[Table(rows, columns, keys=2 + len(places))],
        notes=notes,
        data=lambda: found,
        maps=_maps(rows),
    )


def _maps(rows: Sequence[Row]) -> Mapped | None:
    """The maps of which figures of the whole are printed."""
    maps = {row["definition"]: row["projection"] for row in rows if row["lat"] is None}
    return Mapped([*maps], [*maps.values()], "globe") if maps else None


def _shown(key: str, row: Row, sign: str = "") -> str:
    """A figure with two decimals more than were printed."""
    return "" if row[key] is None else fixed(row[key], row["decimals"] + 2, sign)


def _verdict(row: Row) -> str:
    if row["reproduced"]:
        return "yes"
    return "otherwise" if row["explained"] else "no"
