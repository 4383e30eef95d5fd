"""Rendering of reports, and writing to standard output and files."""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from projdist.cli.errors import cannot_write, refuse, refusing
from projdist.cli.report import Report, Row, Table
from projdist.support import is_stream, replacing

TABLE, JSON, CSV, MARKDOWN, HTML = FORMATS = ("table", "json", "csv", "markdown", "html")


def render(report: Report, form: str, output: Path | None = None) -> str:
    """Text of a report in a format; ends the command with 1 if the answer has no such form."""
    if form in report.copies:
        copy = report.copies[form]
        if copy.text is None:
            refuse(f"Invalid format '{form}' for {report.about}. {copy.reason}", code=1)
        return f"{copy.text}\n"
    if form == TABLE:
        return _shown(report, output)
    if form == JSON:
        return json_text(report.data())
    if form == CSV:
        rows = report.rows() if report.rows else report.tables[0].rows if report.tables else ()
        return csv_text(rows, report.header)
    if form == MARKDOWN:
        return _as_markdown(report)
    from projdist.cli.pages import page_text  # with maps it loads much

    return page_text(report)


def json_text(value: Any) -> str:
    """Indented JSON; undefined values must be None."""
    # ASCII is valid JSON in whatever encoding the standard output has.
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def csv_text(rows: Sequence[Row], header: Sequence[str]) -> str:
    """CSV of rows, or of the header alone without any."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0] if rows else header), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def wrote(*paths: Path | None) -> str:
    """Lines `Wrote: PATH` for files and folders.

    They follow a table, or are the whole output; JSON, CSV, Markdown and pages have none.
    """
    return "".join(f"Wrote: {path}\n" for path in paths if path)


def _shown(report: Report, output: Path | None) -> str:
    from projdist.cli.screen import notes_text, table_text  # loads rich

    head = [report.title] if report.title else []
    lead = [*report.lead, ""] if report.lead else []
    tables = "".join(
        notes_text([table.title] if table.title else [], output) + table_text(table, output) for table in report.tables
    )
    below = "".join(f"{line}\n" for line in report.sketch)
    notes = notes_text(report.notes, output)
    return notes_text([*head, *lead], output) + tables + below + notes + wrote(*report.written)


def _as_markdown(report: Report) -> str:
    """The tables, then title, lead and notes as a list."""
    lines = [line for line in (report.title, *report.lead, *report.notes) if line]
    if not report.tables:
        return "".join(f"{line}\n" for line in lines)
    blocks = [_markdown_table(table) for table in report.tables]
    notes = "".join(f"- {_escaped(line)}\n" for line in lines)
    return "\n".join([*blocks, *([notes] if notes else [])])


def _markdown_table(table: Table) -> str:
    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(" ".join(_escaped(cell).split()) for cell in cells) + " |\n"

    title = f"{_escaped(table.title)}\n\n" if table.title else ""
    rule = "| " + " | ".join("---" if column.is_left(table.rows) else "---:" for column in table.columns) + " |\n"
    rows = zip(*(column.cells(table.rows) for column in table.columns), strict=True)
    return title + line([column.head for column in table.columns]) + rule + "".join(map(line, rows))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("*", "\\*")


# ---- what a command leaves ------------------------------------------------------------------


def present(report: Report, form: str, output: Path | None = None, overwrite: bool = False) -> None:
    """Print a report, or write it to a file and say so."""
    emit(render(report, form, output), output, overwrite)


def emit(text: str, output: Path | None, overwrite: bool = False) -> None:
    """Print text, or write it to a file and say so; failure ends the command."""
    put(text, output, overwrite)
    if output is not None and not is_stream(output):
        tell_written(output)


def tell_written(*paths: Path) -> None:
    """Say which files were written."""
    put(wrote(*paths), None)


def put(text: str, output: Path | None, overwrite: bool = False) -> None:
    """Print text or write it to a file, silently; failure ends the command."""
    try:
        with refusing():
            write(text, output, overwrite)
    except OSError as error:
        if output is None and error.errno == errno.EPIPE:
            raise  # typer knows how to end on a closed pipe
        cannot_write(output, error)


def write(text: str, output: Path | None, overwrite: bool) -> None:
    """Print text, or write it to a file that is never left half-written; raises OSError."""
    if output is None:
        sys.stdout.write(text)
        sys.stdout.flush()  # so that what cannot be written is an error here, and not when the process ends
        return
    with replacing(output, overwrite=overwrite) as new:
        new.write_bytes(text.encode(errors="backslashreplace"))


@contextlib.contextmanager
def drawing(output: Path) -> Iterator[None]:
    """Report errors of drawing or writing a file, and end the command."""
    try:
        with refusing():
            yield
    except MemoryError as error:
        refuse(f"Invalid picture '{output}'. It needs more memory than there is: take a larger step.", error)
    except OSError as error:
        cannot_write(output, error)
