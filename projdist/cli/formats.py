"""Rendering of reports as text that fits the terminal, JSON, CSV, Markdown or a page, and writing them."""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import json
import math
import re
import shlex
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from projdist import projections, web
from projdist.cli.errors import cannot_write, folded, refuse, refusing, takes_escapes, width_of, working
from projdist.cli.report import Report, Row, Table, value_of
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
        lead = [*report.lead, ""] if report.lead else []
        text = notes_text([*filter(None, [report.title]), *lead], output)
        for table in report.tables:
            text += notes_text(filter(None, [table.title]), output) + table_text(table, output)
        below = "".join(f"{line}\n" for line in report.sketch)
        return text + below + notes_text(report.notes, output) + wrote(*report.written)
    if form == JSON:
        return json_text(report.data())
    if form == CSV:
        rows = report.rows() if report.rows else report.tables[0].rows if report.tables else ()
        stream = io.StringIO()
        writer = csv.DictWriter(stream, fieldnames=list(rows[0] if rows else report.header), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return stream.getvalue()
    return _as_markdown(report) if form == MARKDOWN else _as_page(report)


def json_text(value: object) -> str:
    """Indented JSON, in ASCII for whatever encoding the standard output has; undefined values must be None."""
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def wrote(*paths: object) -> str:
    """Lines `Wrote: PATH` for files and folders.

    They follow a table, or are the whole output; JSON, CSV, Markdown and pages have none.
    """
    return "".join(f"Wrote: {path}\n" for path in paths if path)


# ---- tables and notes in a terminal --------------------------------------------------------------


_BORDER = 3  # of a column, with its padding
_READABLE = 200  # columns: a pipe has room enough, and yet keeps the descriptions of lists readable
_NARROWEST = (24, 16, 8)  # characters; texts wider than that are folded where there is no room
_BAR = 12  # characters of the longest bar
_LONGEST_FIGURE = 24  # as 0.99941 .. 1.00026


class _Drawn(NamedTuple):
    """A column as text, its alignment, if its best cell is bold, the width of its widest text, and if texts fold."""

    head: str
    cells: list[str]
    left: bool
    best: bool
    width: int
    folds: bool

    def least(self, narrowest: int) -> int:
        """Characters needed, with border and padding."""
        return _BORDER + (min(self.width, narrowest) if self.folds else self.width)


def table_text(table: Table, output: Path | None = None) -> str:
    """Text of a table; columns beyond the terminal's width go to further tables, which repeat the key columns.

    Figures are never cut off. In a file or a pipe the width is not limited.
    """
    from rich import box
    from rich.cells import cell_len
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as RichTable

    def drawn(head: str, cells: list[str], left: bool, best: bool) -> _Drawn:
        longest = max(map(cell_len, cells), default=0)
        return _Drawn(head, cells, left, best, max(cell_len(head), longest), left or longest > _LONGEST_FIGURE)

    keys, room, unicode = table.keys, room_in(output), takes_blocks(output)
    columns = [drawn(one.head, one.cells(table.rows), one.is_left(table.rows), one.best) for one in table.columns]
    # Text columns are as wide as lets each fit beside the key columns.
    for narrowest in _NARROWEST:
        least = [column.least(narrowest) for column in columns]
        if room is None or 1 + sum(least[:keys]) + max(least[keys:], default=0) <= room:
            break
    if room is not None and (bars := _bars([value_of(row, table.bars) for row in table.rows], unicode=unicode)):
        column = drawn("", bars, True, False)
        if 1 + sum(least) + column.least(narrowest) <= room:
            columns.append(column)
    stream = io.StringIO()
    styled = output is None and takes_escapes(sys.stdout)
    for block in [columns] if room is None else _blocks(columns, keys, room, narrowest):
        shown = RichTable(box=box.HEAVY_HEAD if unicode else box.ASCII)
        for column in block:
            shown.add_column(
                column.head,
                justify="left" if column.left else "right",
                overflow="fold",
                no_wrap=not column.folds,
                min_width=column.least(narrowest) - _BORDER,
            )
        for row in zip(*(map(escape, column.cells) for column in block), strict=True):
            cells = zip(block, row, strict=True)
            shown.add_row(*(f"[bold]{cell}[/bold]" if one.best and cell.endswith("*") else cell for one, cell in cells))
        needed = 1 + sum(column.least(narrowest) for column in block)
        Console(file=stream, force_terminal=styled, width=max(room or _READABLE, needed)).print(shown)
    return "\n".join(line.rstrip() for line in stream.getvalue().split("\n"))


def _bars(values: Sequence[object], *, unicode: bool) -> list[str]:
    """Bars proportional to the values; none for fewer than two values, or with negative ones."""
    numbers = [float(one) if isinstance(one, int | float) and math.isfinite(one) else None for one in values]
    known = [one for one in numbers if one is not None]
    if len(known) < 2 or min(known) < 0.0 or max(known) == 0.0:
        return []
    eighths = [None if one is None else round(8 * _BAR * one / max(known)) for one in numbers]
    if not unicode:
        return ["" if one is None else "#" * round(one / 8) for one in eighths]
    return ["" if one is None else "█" * (one // 8) + " ▏▎▍▌▋▊▉"[one % 8].strip() for one in eighths]


def _blocks(columns: Sequence[_Drawn], keys: int, room: int, narrowest: int) -> Iterator[list[_Drawn]]:
    """Groups of columns that fit into `room` characters, each beginning with the key columns."""
    first = list(columns[:keys])
    group = first
    for column in columns[keys:]:
        if 1 + sum(one.least(narrowest) for one in (*group, column)) > room and len(group) > keys:
            yield group
            group = first
        group = [*group, column]
    yield group


def notes_text(lines: Iterable[str], output: Path | None = None) -> str:
    """Lines of text, wrapped to the terminal."""
    return "".join(f"{folded(line, room_in(output))}\n" for line in lines)


def room_in(output: Path | None) -> int | None:
    """Width of the terminal that is printed to; None without one."""
    return None if output is not None else width_of(sys.stdout)


def takes_blocks(output: Path | None) -> bool:
    """True if the output takes box and block characters; files are UTF-8."""
    return output is not None or (sys.stdout.encoding or "").lower().startswith("utf")


# ---- Markdown and pages --------------------------------------------------------------------------


def _as_markdown(report: Report) -> str:
    """The tables, then title, lead and notes as a list."""
    lines = [line for line in (report.title, *report.lead, *report.notes) if line]
    if not report.tables:
        return "".join(f"{line}\n" for line in lines)
    notes = "".join(f"- {_escaped(line)}\n" for line in lines)
    return "\n".join([*map(_markdown_table, report.tables), *([notes] if notes else [])])


def _markdown_table(table: Table) -> str:
    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(" ".join(_escaped(cell).split()) for cell in cells) + " |\n"

    title = f"{_escaped(table.title)}\n\n" if table.title else ""
    rule = "| " + " | ".join("---" if column.is_left(table.rows) else "---:" for column in table.columns) + " |\n"
    rows = zip(*(column.cells(table.rows) for column in table.columns), strict=True)
    return title + line(column.head for column in table.columns) + rule + "".join(map(line, rows))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("*", "\\*")


_CODE = re.compile(r"\w+:\w+")
_TITLES_OF_FORMS = {
    "proj": "PROJ",
    "wkt": "WKT2",
    "wkt-derived": "WKT2 of a derived CRS",
    "projjson": "PROJJSON",
    "esri": "WKT of Esri",
}


def _as_page(report: Report) -> str:
    """HTML page, whose maps are drawn now."""
    maps = None
    if report.maps:
        with working("Drawing"):
            options = report.maps._asdict()
            maps = web.draw_maps(options.pop("projections"), **options)
    return web.page_html(
        web.Page(
            title=report.title,
            lead=report.lead,
            tables=[_page_table(table) for table in report.tables],
            notes=report.notes,
            copies={name: text for name, text in _copies(report) if text},
            maps=maps,
        )
    )


def _page_table(table: Table) -> web.PageTable:
    columns = [(column.head, column.is_left(table.rows)) for column in table.columns]
    texts = [column.cells(table.rows) for column in table.columns]
    rows = [
        [web.Cell(text[k], _figure(row, column.key)) for text, column in zip(texts, table.columns, strict=True)]
        for k, row in enumerate(table.rows)
    ]
    return web.PageTable(title=table.title, columns=columns, rows=rows)


def _figure(row: Row, key: str) -> float | None:
    """Sort key of a cell: its value if finite, else None."""
    try:
        figure = float(value_of(row, key))
    except (TypeError, ValueError):
        return None
    return figure if math.isfinite(figure) else None


def _copies(report: Report) -> Iterator[tuple[str, str | None]]:
    """Texts to copy: the command, and the forms of the answer or else of its maps."""
    yield "Command", shlex.join(["projdist", *sys.argv[1:]])
    yield from ((_TITLES_OF_FORMS[form], copy.text) for form, copy in report.copies.items())
    if report.maps and not report.copies:
        for given, title in zip(report.maps.projections, report.maps.titles, strict=True):
            projection = projections.Projection.from_user_input(given)
            definition = projection.definition
            if definition.startswith("+"):
                yield f"PROJ: {title}", definition
            if _CODE.fullmatch(definition):  # its authority's own WKT
                yield f"WKT2: {title}", str(projections.crs_of(definition).to_wkt("WKT2_2019", pretty=True))
            else:
                yield f"WKT2: {title}", projections.crs_wkt(projection, projection.name)[0]


# ---- what a command leaves ------------------------------------------------------------------


def present(report: Report, form: str, output: Path | None = None, overwrite: bool = False) -> None:
    """Print a report, or write it to a file and say so."""
    emit(render(report, form, output), output, overwrite)


def emit(text: str, output: Path | None, overwrite: bool = False, *, told: bool = True) -> None:
    """Print text, or write it to a file and say so; failure ends the command."""
    try:
        with refusing():
            write(text, output, overwrite)
    except OSError as error:
        if output is None and error.errno == errno.EPIPE:
            raise  # typer knows how to end on a closed pipe
        cannot_write(output, error)
    if told and output is not None and not is_stream(output):
        tell_written(output)


def write(text: str, output: Path | None, overwrite: bool) -> None:
    """Print text, or write it to a file that is never left half-written; raises OSError."""
    if output is None:
        sys.stdout.write(text)
        sys.stdout.flush()  # so that what cannot be written is an error here, and not when the process ends
        return
    with replacing(output, overwrite=overwrite) as new:
        new.write_bytes(text.encode(errors="backslashreplace"))


def tell_written(*paths: object) -> None:
    """Say which files were written."""
    emit(wrote(*paths), None)


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
