"""Answers of commands before they have a format: title, tables, notes, texts to copy, and the data behind them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, InitVar, dataclass, field
from typing import Any, NamedTuple

from projdist import projections, regions
from projdist.cli.number_format import certain, per_cent
from projdist.support import is_number

Row = Any
"""A row of a table: a mapping, or an answer whose attributes are its values."""


def value_of(row: Row, key: str) -> Any:
    """The value of a row; None where it has none."""
    return row.get(key) if isinstance(row, Mapping) else getattr(row, key, None)


@dataclass(frozen=True)
class Column:
    """A column of a table: the key of its values in the rows, by which it may be sorted, and how they are shown.

    `show` makes the text of a value, or of a value and its error where `error` is the key of that; `of` makes it of the
    whole row. The text stands left if `left`, or if None, where values are words. With `best` the least has a star.
    The column is left out of a table in which `only` holds for none of its values.
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
    only: Callable[[Any], bool] | None = None

    @property
    def head(self) -> str:
        """The title with the unit."""
        return f"{self.title or self.key} {self.unit}".rstrip()

    def values(self, rows: Sequence[Row]) -> list[Any]:
        """The values as computed."""
        return [value_of(row, self.key) for row in rows]

    def cells(self, rows: Sequence[Row]) -> list[str]:
        """The values as texts; a dash for an undefined one."""
        values = self.values(rows)
        cells = []
        for row, value in zip(rows, values, strict=True):
            if self.of is not None:
                cells.append(self.of(row))
            elif value is None or value != value:
                cells.append("-")
            else:
                cells.append(self.show(value, value_of(row, self.error)) if self.error else self.show(value))
        if not self.best:
            return cells
        least = min((value for value in values if value is not None), default=None) if len(rows) > 1 else None
        return [
            f"{cell}{'*' if value is not None and value == least else ' '}"
            for cell, value in zip(cells, values, strict=True)
        ]

    def is_left(self, rows: Sequence[Row]) -> bool:
        """True if the texts stand left, and may be folded."""
        if self.left is not None:
            return self.left
        return any(isinstance(value, str) and not is_number(value) for value in self.values(rows))


SHARED = {
    column.key: column
    for column in (
        *(Column(key, left=True) for key in ("region", "map", "image", "name", "projection", "where")),
        Column("max_scale_error_ppm", "ppm max", certain, error="max_scale_error_ppm_error"),
        Column("mean_scale_error_ppm", "ppm mean", certain, error="mean_scale_error_ppm_error"),
        Column("over_limit", "over limit", "x {:.3g}".format),
        Column("keeps", show=lambda names: names or "-", left=True),
        Column("cut_km", "cuts", "{:,.0f}".format, unit="km", only=bool),
        Column("coverage", "covers", per_cent),
        Column("share_in_area_of_use", "in area", per_cent),
    )
}
"""The columns that several commands have, by their keys."""


Columns = list[Column | str]
"""Columns of a table, some given as keys: those of `SHARED`, or else of values shown as they are."""


@dataclass(frozen=True)
class Table:
    """Rows and the columns that are shown of them; the first `keys` columns tell what a row is of.

    In a terminal with room for it, bars show the values of the key `bars`.
    """

    rows: Sequence[Row]
    given: InitVar[Iterable[Column | str]]
    title: str = ""
    keys: int = 1
    bars: str = ""
    columns: tuple[Column, ...] = field(init=False)

    def __post_init__(self, given: Iterable[Column | str]) -> None:
        columns = [SHARED.get(one, Column(one)) if isinstance(one, str) else one for one in given]
        kept = (one for one in columns if one.only is None or any(map(one.only, one.values(self.rows))))
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

    `lead` are lines between the title and the tables, `sketch` those of an ASCII map below them, for plain text only.
    `data` gives what JSON has, `rows` what CSV has, if not the rows of the first table; `header` names its columns
    where there are none. `copies` are the forms of the answer that are formats of their own; `about` is what they are
    of. `written` are the files that the command has left, by their paths. `maps` are what a page shows.
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
    written: Sequence[object] = ()
    maps: Mapped | None = None


def listing(rows: Sequence[Row]) -> Report:
    """Report that is one table of rows."""
    return Report(tables=[Table(rows, rows[0])], data=lambda: rows)
