"""What a command answers, before it has a format: a title, tables, notes, texts to copy, and the data behind them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from projdist.support import is_number

if TYPE_CHECKING:  # these load numpy and pyproj, which help and the version do without
    from projdist.projections import ProjectionLike
    from projdist.regions import RegionLike

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Column:
    """A column of a table: the key of its values in the rows, by which it may be sorted, and how they are shown.

    `show` makes the text of a value, and of its error where there is the key of one; `of` that of a whole row. `left`
    puts it to the left, as words are; if None, what its values are tells. With `best` the least has a star.
    """

    key: str
    title: str = ""
    show: Callable[..., str] = str
    error: str = ""
    _: KW_ONLY
    unit: str = ""
    of: Callable[[Row], str] | None = None
    left: bool | None = None
    best: bool = False

    @property
    def head(self) -> str:
        """What stands above it, with the unit."""
        return f"{self.title or self.key} {self.unit}".rstrip()

    def values(self, rows: Sequence[Row]) -> list[Any]:
        """The values, as they were computed."""
        return [row.get(self.key) for row in rows]

    def cells(self, rows: Sequence[Row]) -> list[str]:
        """The values as texts; a dash for what is undefined."""
        cells = [self._shown(row) for row in rows]
        if not self.best:
            return cells
        values = self.values(rows)
        least = min((value for value in values if value is not None), default=None) if len(rows) > 1 else None
        return [
            f"{cell}{'*' if value is not None and value == least else ' '}"
            for cell, value in zip(cells, values, strict=True)
        ]

    def is_left(self, rows: Sequence[Row]) -> bool:
        """Whether its texts stand to the left, and may be folded."""
        if self.left is not None:
            return self.left
        return any(isinstance(value, str) and not is_number(value) for value in self.values(rows))

    def _shown(self, row: Row) -> str:
        if self.of is not None:
            return self.of(row)
        value = row.get(self.key)
        if value is None or value != value:
            return "-"
        return self.show(value, row.get(self.error)) if self.error else self.show(value)


@dataclass(frozen=True)
class Table:
    """Rows and the columns that are shown of them; the first `keys` columns tell what a row is of.

    In a terminal with room for it, bars show the values of the key `bars`.
    """

    rows: Sequence[Row]
    columns: Sequence[Column]
    title: str = ""
    keys: int = 1
    bars: str = ""


class Copy(NamedTuple):
    """A text to copy, as a PROJ string; None where there is none, for a reason."""

    text: str | None
    reason: str | None = None


class Mapped(NamedTuple):
    """Projections whose maps a page shows, by what they are called, over a region, and the measure shown first.

    Scales are those on the ground at an ellipsoidal height in metres. `marks` are geometries in longitude and latitude,
    by their names.
    """

    projections: Sequence[ProjectionLike]
    titles: Sequence[str]
    region: RegionLike | None
    measure: str = "fisher"
    height: float = 0.0
    marks: Mapping[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class Report:
    """An answer: one renderer gives it any format.

    `lead` are lines between the title and the tables, `sketch` those of a picture in characters below them, for plain
    text only. `data` gives what JSON has, `rows` what CSV has, if not the rows
    of the first table; `header` names its columns where there are none. `copies` are the forms of the answer that are
    formats of their own; `about` is what they are of. `written` are the files that the command has left. `maps` are
    what a page shows.
    """

    title: str = ""
    lead: Sequence[str] = ()
    tables: Sequence[Table] = ()
    sketch: Sequence[str] = ()
    notes: Sequence[str] = ()
    data: Callable[[], Any]
    rows: Callable[[], Sequence[Row]] | None = None
    header: Sequence[str] = ()
    copies: Mapping[str, Copy] = field(default_factory=dict)
    about: str = ""
    written: Sequence[Path | None] = ()
    maps: Mapped | None = None


def listing(rows: Sequence[Row]) -> Report:
    """A report of rows as they are."""
    columns = [Column(name) for name in rows[0]]
    return Report(tables=[Table(rows, columns)], data=lambda: rows)
