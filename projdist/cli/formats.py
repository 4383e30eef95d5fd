"""A report in a format: a table for people, JSON, CSV, Markdown, a web page."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shlex
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import typer
from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from projdist.cli.errors import fail, folded, takes_escapes, width_of, working
from projdist.cli.report import Mapped, Report, Row, Table
from projdist.projections import Projection, crs_of, crs_wkt
from projdist.web import Cell, Maps, Page, PageTable, draw_maps, page_html

_BORDER = 3  # of a column, with its padding
_READABLE = 200  # columns: a pipe has room enough, and yet keeps the descriptions of lists readable
_NARROWEST = (24, 16, 8)  # characters; texts wider than that are folded where there is no room
_BAR = 12  # characters of the longest bar
_LONGEST_FIGURE = 24  # as 0.99941 .. 1.00026


class _Drawn(NamedTuple):
    """A column as text: whether it stands to the left, and its best cell is bold."""

    head: str
    cells: list[str]
    left: bool
    best: bool

    @property
    def folds(self) -> bool:
        """Whether it is of texts, which may be folded."""
        return self.left or max(map(cell_len, self.cells)) > _LONGEST_FIGURE

    def least(self, narrowest: int) -> int:
        """Characters that it needs, with its border and padding."""
        width = max(cell_len(self.head), *map(cell_len, self.cells))
        return _BORDER + (min(width, narrowest) if self.folds else width)


def table_text(table: Table, output: Path | None = None) -> str:
    """A table; columns that the terminal has no room for go to further tables, which repeat those that are keys.

    Figures are never cut off. What goes to a file or a pipe has all the room that it needs.
    """
    rows, keys, room = table.rows, table.keys, room_in(output)
    columns = [_Drawn(one.head, one.cells(rows), one.is_left(rows), one.best) for one in table.columns]
    styled = output is None and takes_escapes(sys.stdout)
    unicode = takes_blocks(output)
    narrowest = _narrowest(columns, keys, room)
    columns = _with_bars(table, columns, room, narrowest, unicode=unicode)
    stream = io.StringIO()
    for block in [columns] if room is None else _blocks(columns, keys, room, narrowest):
        drawn = RichTable(box=box.HEAVY_HEAD if unicode else box.ASCII)
        for column in block:
            drawn.add_column(
                column.head,
                justify="left" if column.left else "right",
                overflow="fold",
                no_wrap=not column.folds,
                min_width=column.least(narrowest) - _BORDER,
            )
        for row in zip(*(map(escape, column.cells) for column in block), strict=True):
            drawn.add_row(
                *(
                    f"[bold]{cell}[/bold]" if column.best and cell.endswith("*") else cell
                    for column, cell in zip(block, row, strict=True)
                )
            )
        needed = 1 + sum(column.least(narrowest) for column in block)
        Console(file=stream, force_terminal=styled, width=max(room or _READABLE, needed)).print(drawn)
    return "\n".join(line.rstrip() for line in stream.getvalue().split("\n"))


def _with_bars(table: Table, columns: list[_Drawn], room: int | None, narrowest: int, *, unicode: bool) -> list[_Drawn]:
    """The columns, and one of bars from 0 where a terminal has room beside them."""
    values = [row.get(table.bars) for row in table.rows]
    bars = _bars(values, unicode=unicode)
    if room is None or not bars:
        return columns
    drawn = _Drawn("", bars, True, False)
    needed = 1 + sum(column.least(narrowest) for column in (*columns, drawn))
    return [*columns, drawn] if needed <= room else columns


def _bars(values: Sequence[object], *, unicode: bool) -> list[str]:
    """Bars as long as numbers of 0 and more are large; none where fewer than two are, or any is less than 0."""
    numbers = [float(one) if isinstance(one, int | float) and math.isfinite(one) else None for one in values]
    known = [one for one in numbers if one is not None]
    if len(known) < 2 or min(known) < 0.0 or max(known) == 0.0:
        return []
    eighths = [None if one is None else round(8 * _BAR * one / max(known)) for one in numbers]
    if not unicode:
        return ["" if one is None else "#" * round(one / 8) for one in eighths]
    return ["" if one is None else "█" * (one // 8) + " ▏▎▍▌▋▊▉"[one % 8].strip() for one in eighths]


def notes_text(lines: Iterable[str], output: Path | None = None) -> str:
    """Lines of words, which a terminal has in lines that fit."""
    return "".join(f"{folded(line, room_in(output))}\n" for line in lines)


def room_in(output: Path | None) -> int | None:
    """Columns of the terminal that is printed to; None without one."""
    return None if output is not None else width_of(sys.stdout)


def takes_blocks(output: Path | None) -> bool:
    """Whether lines and blocks can be printed: a file has UTF-8."""
    return output is not None or (sys.stdout.encoding or "").lower().startswith("utf")


def _narrowest(columns: Sequence[_Drawn], keys: int, room: int | None) -> int:
    """How narrow texts may be: not more than lets each column stand beside the keys."""
    for narrowest in _NARROWEST:
        least = [column.least(narrowest) for column in columns]
        if room is None or 1 + sum(least[:keys]) + max(least[keys:], default=0) <= room:
            return narrowest
    return _NARROWEST[-1]


def _blocks(columns: Sequence[_Drawn], keys: int, room: int, narrowest: int) -> Iterator[list[_Drawn]]:
    """Columns in groups that fit into `room` characters; each group begins with the first `keys`."""
    first = list(columns[:keys])
    group = first
    for column in columns[keys:]:
        if 1 + sum(one.least(narrowest) for one in (*group, column)) > room and len(group) > keys:
            yield group
            group = first
        group = [*group, column]
    yield group


# ---- pages ---------------------------------------------------------------------------------------


_CODE = re.compile(r"\w+:\w+")
_FORMS = {
    "proj": "PROJ",
    "wkt": "WKT2",
    "wkt-derived": "WKT2 of a derived CRS",
    "projjson": "PROJJSON",
    "esri": "WKT of Esri",
}


def page_text(report: Report) -> str:
    """The page of a report."""
    return page_html(
        Page(
            title=report.title,
            lead=report.lead,
            tables=[_table(table) for table in report.tables],
            notes=report.notes,
            copies={name: text for name, text in _copies(report) if text},
            maps=_maps(report.maps) if report.maps else None,
        )
    )


def _maps(mapped: Mapped) -> Maps:
    with working("Drawing"):
        options = mapped._asdict()
        return draw_maps(options.pop("projections"), **options)


def _table(table: Table) -> PageTable:
    columns = [(column.head, column.is_left(table.rows)) for column in table.columns]
    texts = [column.cells(table.rows) for column in table.columns]
    rows = [
        [Cell(text[k], _figure(row, column.key)) for text, column in zip(texts, table.columns, strict=True)]
        for k, row in enumerate(table.rows)
    ]
    return PageTable(title=table.title, columns=columns, rows=rows)


def _figure(row: Row, key: str) -> float | None:
    """What a cell is sorted by: its value, if that is a finite number."""
    value: Any = row.get(key)
    try:
        figure = float(value)
    except (TypeError, ValueError):
        return None
    return figure if math.isfinite(figure) else None


def _copies(report: Report) -> Iterator[tuple[str, str | None]]:
    """The command, and the forms of the answer, or else those of the maps."""
    yield "Command", shlex.join(["projdist", *sys.argv[1:]])
    yield from ((_FORMS[form], copy.text) for form, copy in report.copies.items())
    if report.maps and not report.copies:
        for given, title in zip(report.maps.projections, report.maps.titles, strict=True):
            projection = Projection.from_user_input(given)
            if projection.definition.startswith("+"):
                yield f"PROJ: {title}", projection.definition
            yield f"WKT2: {title}", _wkt(projection)


def _wkt(projection: Projection) -> str | None:
    """WKT2, of a code that which its authority has; None where there is none."""
    if _CODE.fullmatch(projection.definition):
        return str(crs_of(projection.definition).to_wkt("WKT2_2019", pretty=True))
    return crs_wkt(projection, projection.name)[0]


# ---- formats -------------------------------------------------------------------------------------


TABLE, JSON, CSV, MARKDOWN, HTML = FORMATS = ("table", "json", "csv", "markdown", "html")


def render(report: Report, form: str, output: Path | None = None) -> str:
    """The text of a report, to print or for a file; where it has no such form the command ends with 1."""
    if form in report.copies:
        return _copied(report, form)
    return {TABLE: _shown, JSON: _as_json, CSV: _as_csv, MARKDOWN: _as_markdown, HTML: _as_page}[form](report, output)


def json_text(value: Any) -> str:
    """JSON, indented, with null for what is undefined."""
    # ASCII is valid JSON in whatever encoding the standard output has.
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def csv_text(rows: Sequence[Row], header: Sequence[str]) -> str:
    """Rows below the names of their columns; no rows below a header."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0] if rows else header), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def wrote(*paths: Path | None) -> str:
    """The lines that say which files a command has written; folders of files, too.

    They end a table, or are all that is printed; JSON, CSV, Markdown and pages, which go elsewhere, have none.
    """
    return "".join(f"Wrote: {path}\n" for path in paths if path)


def _copied(report: Report, form: str) -> str:
    copy = report.copies[form]
    if copy.text is None:
        fail(f"Invalid format '{form}' for {report.about}. {copy.reason}")
        raise typer.Exit(1)
    return f"{copy.text}\n"


def _shown(report: Report, output: Path | None) -> str:

    head = [report.title] if report.title else []
    lead = [*report.lead, ""] if report.lead else []
    tables = "".join(
        notes_text([table.title] if table.title else [], output) + table_text(table, output) for table in report.tables
    )
    below = "".join(f"{line}\n" for line in report.sketch)
    notes = notes_text(report.notes, output)
    return notes_text([*head, *lead], output) + tables + below + notes + wrote(*report.written)


def _as_json(report: Report, _: Path | None) -> str:
    return json_text(report.data())


def _as_csv(report: Report, _: Path | None) -> str:
    rows = report.rows() if report.rows else report.tables[0].rows if report.tables else ()
    return csv_text(rows, report.header)


def _as_markdown(report: Report, _: Path | None) -> str:
    """The tables, and below them a list of what is to be said, the title first."""
    lines = [line for line in (report.title, *report.lead, *report.notes) if line]
    if not report.tables:
        return "".join(f"{line}\n" for line in lines)
    blocks = [_markdown_table(table) for table in report.tables]
    notes = "".join(f"- {_escaped(line)}\n" for line in lines)
    return "\n".join([*blocks, *([notes] if notes else [])])


def _as_page(report: Report, _: Path | None) -> str:

    return page_text(report)


def _markdown_table(table: Table) -> str:
    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(" ".join(_escaped(cell).split()) for cell in cells) + " |\n"

    title = f"{_escaped(table.title)}\n\n" if table.title else ""
    rule = "| " + " | ".join("---" if column.is_left(table.rows) else "---:" for column in table.columns) + " |\n"
    rows = zip(*(column.cells(table.rows) for column in table.columns), strict=True)
    return title + line([column.head for column in table.columns]) + rule + "".join(map(line, rows))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("*", "\\*")
