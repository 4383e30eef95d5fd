"""Reports, the answers of commands, rendered as text for a terminal, JSON, CSV, Markdown or a page."""

from __future__ import annotations

import contextlib
import csv
import datetime
import errno
import io
import json
import math
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from projdist import __version__, projections, regions, support, web
from projdist.cli.errors import USUAL, cannot_write, folded, refuse, refusing, width_of, working
from projdist.cli.wording import certain, per_cent

TABLE, JSON, CSV, MARKDOWN, HTML = FORMATS = ("table", "json", "csv", "markdown", "html")
DETAILS = "details"
"""The format that `--details` selects; `--format` does not list it."""

Row = Any
"""A row of a table: a mapping, or an answer whose attributes are its values."""


def value_of(row: Row, key: str) -> Any:
    """The value of a row at a key, None where it has none."""
    return row.get(key) if isinstance(row, Mapping) else getattr(row, key, None)


@dataclass(frozen=True)
class Column:
    """A column of a table: the key of its values in the rows, and how they are shown.

    `show` formats a value, or a value and its error if `error` is the key of the error; `of` formats the whole row
    instead. Cells are left-aligned if `left`, or, if that is None, where values are words. `best` marks the smallest
    value with a star. A column with `only` is left out of tables in which it holds for none of the values.
    """

    key: str
    title: str = ""
    show: Callable[..., str] = str
    error: str = ""
    _: KW_ONLY
    of: Callable[[Row], str] | None = None
    left: bool | None = None
    best: bool = False
    only: Callable[[Any], bool] | None = None

    def cells(self, rows: Sequence[Row]) -> tuple[list[str], bool]:
        """The values as texts, a dash for undefined ones, and True if they are left-aligned and may be folded."""
        values, cells = [value_of(row, self.key) for row in rows], []
        for row, value in zip(rows, values, strict=True):
            if self.of is not None:
                cells.append(self.of(row))
            elif value is None or value != value:
                cells.append("-")
            else:
                cells.append(self.show(value, value_of(row, self.error)) if self.error else self.show(value))
        if self.best:
            least = min((value for value in values if value is not None), default=None) if len(rows) > 1 else None
            marks = ("*" if value is not None and value == least else " " for value in values)
            cells = [cell + mark for cell, mark in zip(cells, marks, strict=True)]
        if self.left is not None:
            return cells, self.left
        return cells, any(isinstance(value, str) and not support.is_number(value) for value in values)


SHARED = {
    column.key: column
    for column in (
        *(Column(key, left=True) for key in ("region", "map", "image", "name", "projection", "where")),
        Column("max_scale_error_ppm", "ppm max", certain, error="max_scale_error_ppm_error"),
        Column("mean_scale_error_ppm", "ppm mean", certain, error="mean_scale_error_ppm_error"),
        Column("over_limit", "over limit", "x {:.3g}".format),
        Column("keeps", show=lambda names: names or "-", left=True),
        Column("cut_km", "cuts km", "{:,.0f}".format, only=bool),
        Column("coverage", "covers", per_cent),
        Column("share_in_area_of_use", "in area", per_cent),
    )
}
"""The columns that several commands have, by their keys."""


Columns = list[Column | str]
"""Columns of a table; a key stands for the column of `SHARED`, or else for values shown as they are."""


@dataclass(frozen=True)
class Table:
    """Rows and the columns shown of them, the first `keys` of which identify a row.

    In a terminal with enough room, bars show the values of the key `bars`. Below an answer only the first `most` rows
    are shown, or all if None.
    """

    rows: Sequence[Row]
    given: InitVar[Iterable[Column | str]]
    title: str = ""
    keys: int = 1
    bars: str = ""
    most: int | None = 3
    columns: tuple[Column, ...] = field(init=False)

    def __post_init__(self, given: Iterable[Column | str]) -> None:
        columns = [SHARED.get(one, Column(one)) if isinstance(one, str) else one for one in given]
        kept = (
            one for one in columns if one.only is None or any(one.only(value_of(row, one.key)) for row in self.rows)
        )
        object.__setattr__(self, "columns", tuple(kept))


class Copy(NamedTuple):
    """A text to copy, such as a PROJ string; None with a reason if there is none."""

    text: str | None
    reason: str | None = None


class Mapped(NamedTuple):
    """Projections that a page maps over a region, with their titles and the measure shown first.

    Scales are those on the ground at an ellipsoidal height in metres. `marks` are geometries in longitude and latitude,
    by their names.
    """

    projections: Sequence[projections.ProjectionLike]
    titles: Sequence[str]
    region: regions.RegionLike | None
    measure: str = "fisher"
    height: float = 0.0
    marks: Mapping[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class Report:
    """The answer of a command, which is rendered in any format.

    A report with an `answer`, sentences that a reader can act on, is printed briefly, unless to a file or with
    `--details`: the answer, the tables `brief` (by default the first of `tables`), a `legend` of their words, and the
    commands to go on with, `next`, each with what it is for.

    `heading` is the title of a page if it differs from `title`; `lead` are lines between the title and the tables,
    `sketch` those of an ASCII map below them, in plain text only. `data` makes the content of JSON, `rows` that of CSV
    (by default the rows of the first table); `header` names the columns of CSV without rows. `copies` are the formats
    that only this answer has, and `about` names it in messages about them. `written` are paths of files already
    written. A page shows `maps`, and has blanks `signed` to be filled in by hand.
    """

    answer: Sequence[str] = ()
    brief: Sequence[Table] | None = None
    legend: Sequence[str] = ()
    next: Mapping[str, str] = field(default_factory=dict)
    title: str = ""
    heading: str = ""
    lead: Sequence[str] = ()
    tables: Sequence[Table] = ()
    sketch: Sequence[str] = ()
    notes: Sequence[str] = ()
    data: Callable[[], Any]
    rows: Callable[[], Sequence[Row]] | None = None
    header: Sequence[str] = ()
    copies: Mapping[str, Copy] = field(default_factory=dict)
    about: str = ""
    written: Sequence[object] = ()
    maps: Mapped | None = None
    signed: Sequence[str] = ()


# ---- rendering -----------------------------------------------------------------------------------


def render(report: Report, form: str, output: Path | None = None) -> str:
    """Text of a report in a format; exits with 1 if the answer has no such form."""
    if form in report.copies:
        copy = report.copies[form]
        if copy.text is None:
            refuse(f"Invalid format '{form}' for {report.about}. {copy.reason}", code=1)
        return f"{copy.text}\n"
    if form == TABLE and report.answer and output is None:
        return _brief_text(report)
    if form in (TABLE, DETAILS):
        answer, lead = ([*part, ""] if part else [] for part in (report.answer, report.lead))
        text = notes_text([*answer, *filter(None, [report.title]), *lead], output)
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


def _brief_text(report: Report) -> str:
    """The answer, the first rows with as many columns as fit side by side, and what to do next."""
    tables = report.tables[:1] if report.brief is None else report.brief
    text = notes_text(report.answer) + "".join(table_text(table, brief=True) for table in tables if table.rows)
    text += notes_text([*report.legend, *(f"{words}: {command}" for command, words in report.next.items())])
    shown = max((len(one.rows[: one.most]) for one in tables), default=0)
    same = [one for one in report.tables if tables and one.rows is tables[0].rows]
    left = max((len(one.rows) for one in (same or report.tables)[:1]), default=0) - shown
    if report.tables or report.notes:
        more = f"{left} more row{'s' * (left > 1)}, all" if left > 0 else "All"
        text += notes_text([f"{more} columns and notes: --details"])
    return text + wrote(*report.written)


def json_text(value: object) -> str:
    """Indented JSON in ASCII, which any encoding of standard output has; undefined values must be None."""
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def wrote(*paths: object) -> str:
    """Lines `Wrote: PATH` for files and folders."""
    # They follow a table, or are all of the output; JSON, CSV, Markdown and pages have none.
    return "".join(f"Wrote: {path}\n" for path in paths if path)


# ---- tables and notes in a terminal --------------------------------------------------------------


_BORDER = 3  # characters of a column's border and padding
_READABLE = 200  # columns in a pipe; wider descriptions of lists would be hard to read
_NARROWEST = (24, 16, 8)  # characters to which wider texts are folded, tried in turn until there is room
_BAR = 12  # characters of the longest bar
_LONGEST_FIGURE = 24  # characters, enough for 0.99941 .. 1.00026


class _Drawn(NamedTuple):
    """A column as text: alignment, whether its best cell is bold, width, and whether its cells may fold."""

    head: str
    cells: list[str]
    left: bool
    best: bool
    width: int
    folds: bool

    def least(self, narrowest: int) -> int:
        """Fewest characters, with border and padding."""
        return _BORDER + (min(self.width, narrowest) if self.folds else self.width)


def table_text(table: Table, output: Path | None = None, *, brief: bool = False) -> str:
    """Text of a table; columns beyond the terminal's width go to further tables, which repeat the key columns."""
    # Figures are never cut off. In a file or a pipe the width is not limited. If `brief`, only the first rows and the
    # columns that fit side by side are shown.
    from rich import box
    from rich.cells import cell_len
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as RichTable

    keys, terminal, unicode = table.keys, width_of(sys.stdout) if output is None else None, takes_blocks(output)
    room = USUAL if brief and terminal is None else terminal
    rows = table.rows[: table.most] if brief else table.rows
    columns = []
    for one in table.columns:
        head, (texts, left) = one.title or one.key, one.cells(table.rows)
        texts = texts[: len(rows)]
        widest = max(map(cell_len, texts), default=0)
        folds = left or widest > _LONGEST_FIGURE
        columns.append(_Drawn(head, texts, left, one.best, max(cell_len(head), widest), folds))
    # Text columns are narrowed until every column fits beside the key columns.
    for narrowest in _NARROWEST:
        least = [column.least(narrowest) for column in columns]
        if room is None or 1 + sum(least[:keys]) + max(least[keys:], default=0) <= room:
            break
    bars = [] if terminal is None else _bars([value_of(row, table.bars) for row in rows], unicode=unicode)
    if bars and room is not None:
        column = _Drawn("", bars, True, False, max(map(len, bars)), True)
        if 1 + sum(least) + column.least(narrowest) <= room:
            columns.append(column)
    stream = io.StringIO()
    # https://no-color.org; rich would ignore the width of a dumb terminal.
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") in ("dumb", "unknown")
    styled = terminal is not None and not plain
    blocks = [columns] if room is None else [*_blocks(columns, keys, room, narrowest)]
    for block in blocks[:1] if brief else blocks:
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
    """Lines of text, wrapped to the terminal if there is one."""
    width = width_of(sys.stdout) if output is None else None
    return "".join(f"{folded(line, width)}\n" for line in lines)


def takes_blocks(output: Path | None) -> bool:
    """True if the output takes box and block characters; files are UTF-8."""
    return output is not None or (sys.stdout.encoding or "").lower().startswith("utf")


# ---- Markdown and pages --------------------------------------------------------------------------


def _as_markdown(report: Report) -> str:
    """The tables, then the answer, title, lead and notes as a list."""
    lines = [line for line in (*report.answer, report.title, *report.lead, *report.notes) if line]
    if not report.tables:
        return "".join(f"{line}\n" for line in lines)
    notes = "".join(f"- {_escaped(line)}\n" for line in lines)
    return "\n".join([*map(_markdown_table, report.tables), *([notes] if notes else [])])


def _markdown_table(table: Table) -> str:
    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(" ".join(_escaped(cell).split()) for cell in cells) + " |\n"

    title = f"{_escaped(table.title)}\n\n" if table.title else ""
    texts, left = zip(*(column.cells(table.rows) for column in table.columns), strict=True)
    rule = "| " + " | ".join("---" if one else "---:" for one in left) + " |\n"
    rows = zip(*texts, strict=True)
    return title + line(column.title or column.key for column in table.columns) + rule + "".join(map(line, rows))


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
    """HTML page; its maps are drawn here."""
    maps = None
    if report.maps:
        with working("Drawing"):
            options = report.maps._asdict()
            maps = web.draw_maps(options.pop("projections"), **options)
    made = f"Computed by projdist {__version__} with {projections.proj_version()} on {datetime.date.today():%d %B %Y}"
    return web.page_html(
        web.Page(
            title=report.heading or report.title,
            lead=[*report.answer, *report.lead],
            tables=[_page_table(table) for table in report.tables],
            notes=[
                *([report.title] if report.heading else []),
                *report.notes,
                f"{made}, from the derivatives of the maps over the region, by true area.",
                "The distortion at a place is sqrt(ln^2 a + ln^2 b), of the largest and the smallest scale there. "
                'Reference: D. Ozeri, "Riemannian Geometry Approach for Minimizing Distortion and its Applications".',
            ],
            copies={name: text for name, text in _copies(report) if text},
            maps=maps,
            signed=report.signed,
        )
    )


def _page_table(table: Table) -> web.PageTable:
    def figure(row: Row, key: str) -> float | None:
        """Sort key of a cell: its value if finite, else None."""
        try:
            number = float(value_of(row, key))
        except (TypeError, ValueError):
            return None
        return number if math.isfinite(number) else None

    texts, left = zip(*(column.cells(table.rows) for column in table.columns), strict=True)
    columns = [(column.title or column.key, one) for column, one in zip(table.columns, left, strict=True)]
    rows = [
        [web.Cell(text[k], figure(row, column.key)) for text, column in zip(texts, table.columns, strict=True)]
        for k, row in enumerate(table.rows)
    ]
    return web.PageTable(title=table.title, columns=columns, rows=rows)


def _copies(report: Report) -> Iterator[tuple[str, str | None]]:
    """Texts to copy by title: the command, and the forms of the answer or else of its maps."""
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


# ---- output --------------------------------------------------------------------------------------


def present(report: Report, form: str, output: Path | None = None, overwrite: bool = False) -> None:
    """Print a report, or write it to a file and say so."""
    emit(render(report, form, output), output, overwrite)


def emit(text: str, output: Path | None, overwrite: bool = False, *, told: bool = True) -> None:
    """Print text, or write it to a file and say so; failure ends the command."""
    try:
        with refusing():
            if output is None:
                sys.stdout.write(text)
                sys.stdout.flush()  # so that an error of writing is raised here, and not at exit
            else:
                with support.replacing(output, overwrite=overwrite) as new:  # never left half-written
                    new.write_bytes(text.encode(errors="backslashreplace"))
    except OSError as error:
        if output is None and error.errno == errno.EPIPE:
            raise  # typer knows how to end on a closed pipe
        cannot_write(output, error)
    if told and output is not None and not support.is_stream(output):
        tell_written(output)


def tell_written(*paths: object) -> None:
    """Say which files were written."""
    emit(wrote(*paths), None)


@contextlib.contextmanager
def drawing(output: Path) -> Iterator[None]:
    """Report an error in drawing or writing a file, and end the command."""
    try:
        with refusing():
            yield
    except MemoryError as error:
        refuse(f"Invalid picture '{output}'. It needs more memory than there is: take a larger step.", error)
    except OSError as error:
        cannot_write(output, error)
