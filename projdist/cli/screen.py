"""Tables and notes that fit the width of the terminal."""

from __future__ import annotations

import io
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from projdist.cli.errors import folded, takes_escapes, width_of
from projdist.cli.report import Table, value_of

_BORDER = 3  # of a column, with its padding
_READABLE = 200  # columns: a pipe has room enough, and yet keeps the descriptions of lists readable
_NARROWEST = (24, 16, 8)  # characters; texts wider than that are folded where there is no room
_BAR = 12  # characters of the longest bar
_LONGEST_FIGURE = 24  # as 0.99941 .. 1.00026


class _Drawn(NamedTuple):
    """A column as text, its alignment, and whether its best cell is bold."""

    head: str
    cells: list[str]
    left: bool
    best: bool

    @property
    def folds(self) -> bool:
        """True for texts, which may be folded."""
        return self.left or max(map(cell_len, self.cells)) > _LONGEST_FIGURE

    def least(self, narrowest: int) -> int:
        """Characters needed, with border and padding."""
        width = max(cell_len(self.head), *map(cell_len, self.cells))
        return _BORDER + (min(width, narrowest) if self.folds else width)


def table_text(table: Table, output: Path | None = None) -> str:
    """Text of a table; columns beyond the terminal's width go to further tables, which repeat the key columns.

    Figures are never cut off. In a file or a pipe the width is not limited.
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
    """The columns, and one of bars if the terminal has room."""
    values = [value_of(row, table.bars) for row in table.rows]
    bars = _bars(values, unicode=unicode)
    if room is None or not bars:
        return columns
    drawn = _Drawn("", bars, True, False)
    needed = 1 + sum(column.least(narrowest) for column in (*columns, drawn))
    return [*columns, drawn] if needed <= room else columns


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


def notes_text(lines: Iterable[str], output: Path | None = None) -> str:
    """Lines of text, wrapped to the terminal."""
    return "".join(f"{folded(line, room_in(output))}\n" for line in lines)


def room_in(output: Path | None) -> int | None:
    """Width of the terminal that is printed to; None without one."""
    return None if output is not None else width_of(sys.stdout)


def takes_blocks(output: Path | None) -> bool:
    """True if the output takes box and block characters; files are UTF-8."""
    return output is not None or (sys.stdout.encoding or "").lower().startswith("utf")


def _narrowest(columns: Sequence[_Drawn], keys: int, room: int | None) -> int:
    """Minimum width of text columns at which each fits beside the key columns."""
    for narrowest in _NARROWEST:
        least = [column.least(narrowest) for column in columns]
        if room is None or 1 + sum(least[:keys]) + max(least[keys:], default=0) <= room:
            return narrowest
    return _NARROWEST[-1]


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
