"""What a command answers, before it has a format: a title, tables with the digits that they show, notes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from projdist.regions import Place, PointSet
from projdist.support import is_number

if TYPE_CHECKING:
    from projdist.projections import ProjectionLike
    from projdist.regions import RegionLike


_DIGITS = 5
_MOST_DECIMALS = 10  # a tenth of a millimetre in 1000 km
_LONGEST_LABEL = 60
_LARGE = 1e6  # from where on a number has an exponent
_ROUNDING = 1e-5  # an error up to which what is no more is nothing, in the unit of any figure
WHOLE = 0.9999995
"""A share that is shown as 100 %."""


def rounded(value: float | None, error: float | None) -> str:
    """At most six decimals or four significant digits, and none that the error makes doubtful.

    Of a figure that is no more than its error both are shown; one that is nothing but rounding has zeros.
    """
    if value is None:
        return "-"
    if error and _is_swallowed(value, error):
        return with_error(value, error)
    wanted = max(6, 3 - math.floor(math.log10(abs(value)))) if value else 6
    good = math.floor(-math.log10(error)) if error else wanted
    decimals = max(0, min(wanted, good, _MOST_DECIMALS))
    if error and abs(value) > error and round(value, decimals) == 0.0:
        decimals += 1  # its first digit is doubtful, and says more than a zero
    return f"{value:.{decimals}f}"


def certain(value: float | None, error: float | None = None) -> str:
    """Five significant digits at most, and none that the error makes doubtful.

    Of a figure that is no more than its error both are shown; one that is nothing but rounding is 0.
    """
    if value is None:
        return "-"
    if error and _is_swallowed(value, error):
        return with_error(value, error)
    if not error or not value or math.isinf(value):
        return f"{value:.{_DIGITS}g}"
    if abs(value) <= error:
        return "0"
    before = math.floor(math.log10(abs(value))) + 1
    good = before + math.floor(-math.log10(error))
    return f"{value:.{max(1, min(_DIGITS, good))}g}"


def with_error(value: float, error: float) -> str:
    """A figure and its error: `0.12346 +- 3e-09`, or of what is no more than that `327 +- 27,000`."""
    if _is_swallowed(value, error):
        return f"{_plain(value, 3)} +- {_plain(error, 2)}"
    return f"{rounded(value, error)} +- {first_digit(error)}"


def _is_swallowed(value: float, error: float) -> bool:
    """Whether a figure is no more than its error, and that is more than rounding."""
    return error > _ROUNDING and abs(value) <= error


def _plain(value: float, digits: int) -> str:
    """A number to so many digits, with commas, and without an exponent below a million."""
    few = float(f"{value:.{digits}g}")
    return f"{few:,.0f}" if 10.0 ** (digits - 1) <= abs(few) < _LARGE else f"{few:.{digits}g}"


def fixed(value: float, decimals: int, sign: str = "") -> str:
    """So many decimals, and no "-0.00"."""
    return f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"


def first_digit(error: float) -> str:
    """The size of an error."""
    return f"{error:.0e}"


def per_cent(share: float, digits: int = 4) -> str:
    """A share."""
    return f"{100.0 * share:.{digits}g} %"


def change(ratio: float) -> str:
    """By how much something is more than something else, of which it is a ratio."""
    return f"{100.0 * (ratio - 1.0):+.2f} %" if abs(ratio) < math.inf else "-"


def area_text(km2: float) -> str:
    """An area in words, small ones with their digits."""
    return f"{km2:,.0f} km2" if km2 >= 100 else f"{km2:.3g} km2"


def size_text(region: Place) -> str:
    """How large a region is, in words: its area, or how many points it has."""
    return f"{region.lon.size:,} points" if isinstance(region, PointSet) else area_text(region.area_km2)


def covers(coverage: float) -> list[str]:
    """A line on what share of a region a map covers, if it is not all."""
    return [f"Covers {per_cent(coverage)} of the region."] if coverage < WHOLE else []


def label_of(given: str, name: str) -> str:
    """A projection as it was given, or, as WKT may be long, by its name."""
    return given if len(given) <= _LONGEST_LABEL and "\n" not in given else name


# ---- report --------------------------------------------------------------------------------------


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
