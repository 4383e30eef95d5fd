"""The command `tables`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from projdist.answers import TABLES, tables
from projdist.cli.errors import refuse
from projdist.cli.formats import Format, csv_text, json_text, markdown_text, notes_text, render_list, table_text
from projdist.cli.options import FileFormatOption, OutputOption, OverwriteOption, format_for, printed_or_file
from projdist.cli.output import emit


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
    form = Format(format_for(format, path))
    if name is None:
        rows = [{"name": table, "source": source} for table, source in TABLES.items()]
        emit(render_list(rows, form, path), path, overwrite)
        return
    try:
        found = tables(name).to_dict()
    except ValueError as error:
        refuse(str(error), error)
    emit(_rendered(found, form, path), path, overwrite)


def _rendered(found: dict[str, Any], form: Format, output: Path | None) -> str:
    rows = found["results"]
    if form is Format.JSON:
        return json_text(found)
    if form is Format.CSV:
        return csv_text(rows, [])
    columns = {"projection": [row["projection"] for row in rows]}
    if rows[0]["lat"] is not None:
        columns |= {key: [f"{row[key]:.9g}" for row in rows] for key in ("lon", "lat")}
    columns |= {
        "measure": [row["measure"] for row in rows],
        "published": [f"{row['published']:.{row['decimals']}f}" for row in rows],
        "ours": [_shown(row["value"], row) for row in rows],
        "error": [f"{row['error']:.0e}" for row in rows],
        "difference": [_shown(row["difference"], row, "+") for row in rows],
        "comes out": [_verdict(row) for row in rows],
    }
    explanations = {row["convention"]: row["explanation"] for row in rows if row["convention"]}
    if explanations:
        columns["otherwise"] = [_shown(row["value_by_convention"], row) for row in rows]
        columns["convention"] = [row["convention"] for row in rows]
    notes = [
        "Comes out: ours agrees to half a unit of the last digit printed.",
        *(f"{convention}: {text}" for convention, text in explanations.items()),
        *sorted({f"Source: {row['source']} ({row['status']})." for row in rows}),
    ]
    if form is Format.MARKDOWN:
        return markdown_text(columns) + "\n" + "\n".join(notes).replace("*", "\\*") + "\n"
    keys = list(columns).index("measure") + 1
    return table_text(columns, found["source"], keys, output) + notes_text(notes, output)


def _shown(value: float | None, row: dict[str, Any], sign: str = "") -> str:
    """A figure with two decimals more than were printed."""
    if value is None:
        return ""
    decimals = row["decimals"] + 2
    return f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"  # + 0.0: no "-0.0000"


def _verdict(row: dict[str, Any]) -> str:
    if row["reproduced"]:
        return "yes"
    return "otherwise" if row["explained"] else "no"
