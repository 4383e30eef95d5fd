"""Base classes of results, whose fields state once what JSON, tables, DataFrames and notebooks show of them."""

from __future__ import annotations

import html
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from numbers import Number
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import pandas as pd

_MOST_ROWS, _LONGEST = 30, 40  # rows of a table, characters of a cell
_BAR = "background: linear-gradient(90deg, #c2d8ec {share:.0f}%, transparent {share:.0f}%)"


# ---- figures ------------------------------------------------------------------------------------


class Estimate(NamedTuple):
    """A figure and a bound of its error; an undefined figure or bound is NaN."""

    value: float
    error: float

    def root(self) -> Estimate:
        """The square root; slightly negative values count as 0."""
        if not math.isfinite(self.value):
            return Estimate(math.nan, math.nan)
        square = max(self.value, 0.0)
        root = math.sqrt(square)
        return Estimate(root, 0.0 if self.error <= 0 else self.error / (root + math.sqrt(square + self.error)))


# ---- the schema of a result ----------------------------------------------------------------------


class FieldSchema(NamedTuple):
    """The form of a result's field in JSON and tables, in the terms of `schema`."""

    key: str = ""
    of: str | Sequence[str] | Mapping[str, str] = ""
    spread: bool = False
    hidden: bool = False
    optional: bool = False
    column: bool = False


_PLAIN = FieldSchema()


def schema(key: str = "", **parts: Any) -> dict[str, FieldSchema]:
    """Metadata of a dataclass's field: `error: float = field(metadata=schema("error_estimate"))`."""
    # `key` is the field's key in JSON, by default its name. `of` is the attribute of the value that is shown, or
    # several, by their own keys if they differ: `of=("name", "area_km2")` or `of={"wkt": "wkt2"}`. Several make an
    # object in JSON, with `spread` keys beside the others. A `hidden` field is not shown, an `optional` one only if it
    # is not None. A `column` has a value for each point: the points are the rows of tables, and `"results"` in JSON.
    return {"schema": FieldSchema(key, **parts)}


HIDDEN, COLUMN = schema(hidden=True), schema(column=True)
"""Metadata of a field that neither JSON nor tables show, and of one with a value for each point."""


def values_of(record: Any, *, columns: bool = False) -> dict[str, Any]:
    """Values of a dataclass by JSON key, not converted: of its columns, or of all other fields."""
    found: dict[str, Any] = {}
    for one in fields(record):
        shown, value = one.metadata.get("schema", _PLAIN), getattr(record, one.name)
        if shown.hidden or shown.column != columns or (shown.optional and value is None):
            continue
        if shown.of and isinstance(shown.of, str):
            value = None if value is None else attrgetter(shown.of)(value)
        elif shown.of and (value is not None or shown.spread):
            paths = shown.of if isinstance(shown.of, Mapping) else dict(zip(shown.of, shown.of, strict=True))
            value = {key: None if value is None else attrgetter(path)(value) for key, path in paths.items()}
        if shown.spread:
            value = values_of(value) if is_dataclass(value) else value
            found |= value._asdict() if hasattr(value, "_asdict") else value
        else:
            found[shown.key or one.name] = value
    return found


def plain(value: Any) -> Any:
    """JSON-safe value; NaN and infinity become None, arrays and tuples lists, dataclasses and named tuples objects."""
    if type(value) is float:
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, Record):
        return value.to_dict()
    if hasattr(value, "tolist"):  # an array or a scalar of NumPy
        return plain(value.tolist())
    if is_dataclass(value):
        value = values_of(value)
    elif hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


class Record:
    """Base class of dataclasses with a form in JSON: results and their parts."""

    def to_dict(self) -> dict[str, Any]:
        """The values with the keys of the command line's JSON; NaN and infinity are None."""
        found = {key: plain(value) for key, value in values_of(self).items()}
        return found | {"results": self.plain_rows()} if values_of(self, columns=True) else found

    def plain_rows(self) -> list[dict[str, Any]]:
        """The rows of the table for JSON; NaN and infinity are None."""
        table = self._table()
        if not isinstance(table, dict):
            return [{name: plain(value) for name, value in row.items()} for row in table]
        return [dict(zip(table, row, strict=True)) for row in zip(*map(plain, table.values()), strict=True)]

    def _table(self) -> Any:
        """The table as columns by name or as a list of rows, with unrounded numbers."""
        return {name: values.ravel() for name, values in values_of(self, columns=True).items()} or [self._flat()]

    def _flat(self) -> dict[str, Any]:
        """One row of a table: the values that are texts or numbers, not converted."""
        return {key: value for key, value in values_of(self).items() if isinstance(value, str | Number)}


class Answer(Record, ABC):
    """Base class of results.

    Subclasses are `@dataclass(frozen=True, kw_only=True, eq=False, repr=False)`: compared by identity, as most hold
    arrays; compare their `to_dict()`. They print as one line, and as a table in notebooks.
    """

    def __repr__(self) -> str:
        """Class and answer in one line."""
        return f"{type(self).__name__}({self._line()})"

    def _repr_html_(self) -> str:
        """The table of `to_frame`, for notebooks."""
        return html_table(self._table(), repr(self))

    @abstractmethod
    def _line(self) -> str:
        """Summary of the answer in a few words and numbers."""

    def to_json(self, *, indent: int | None = None) -> str:
        """`to_dict` as JSON with numbers in full precision; NaN and infinity are null."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)

    def to_frame(self) -> pd.DataFrame:
        """A pandas DataFrame with a row per point or projection; raises ImportError without pandas."""
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError("Invalid call of to_frame. It needs pandas: pip install 'projdist[gis]'.") from error
        return pd.DataFrame(self._table())


# ---- in notebooks --------------------------------------------------------------------------------


def html_table(table: Mapping[str, Any] | Sequence[Mapping[str, Any]], caption: str) -> str:
    """HTML table of columns by name or of rows, cut after 30 rows; bars in columns of non-negative numbers."""
    if not isinstance(table, Mapping):
        names = dict.fromkeys(name for row in table for name in row)
        table = {name: [row.get(name) for row in table] for name in names}
    columns = {name: [one.tolist() if hasattr(one, "tolist") else one for one in table[name]] for name in table}
    count = max((len(values) for values in columns.values()), default=0)
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in zip(*map(_cells, columns.values()), strict=True))
    rest = f"<p>and {count - _MOST_ROWS} more rows</p>" if count > _MOST_ROWS else ""
    return f"<table><caption>{html.escape(caption)}</caption><tr>{head}</tr>{body}</table>{rest}"


def _cells(values: Sequence[Any]) -> list[str]:
    """HTML cells of a column, with bars if its numbers are non-negative."""
    numbers = [value for value in values if isinstance(value, float) and math.isfinite(value)]
    largest = max(numbers, default=0.0)
    bars = len(numbers) > 1 and largest > 0.0 and min(numbers) >= 0.0
    cells = []
    for value in values[:_MOST_ROWS]:
        share = bars and isinstance(value, float) and math.isfinite(value)
        style = f' style="{_BAR.format(share=100.0 * value / largest)}"' if share else ""
        text = "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
        shown = html.escape(text)
        if len(text) > _LONGEST:
            shown = f'<span title="{shown}">{html.escape(text[:_LONGEST])}…</span>'
        cells.append(f"<td{style}>{shown}</td>")
    return cells
