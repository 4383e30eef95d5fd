"""Base class of answers, with conversions to a dictionary, JSON, a pandas DataFrame, a line and an HTML table."""

from __future__ import annotations

import html
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

_MOST_ROWS, _LONGEST = 30, 40  # rows of a table, characters of a cell
_BAR = "background: linear-gradient(90deg, #c2d8ec {share:.0f}%, transparent {share:.0f}%)"


def html_table(table: Mapping[str, Any] | Sequence[Mapping[str, Any]], caption: str) -> str:
    """HTML table of columns by name or of rows, cut after 30 rows.

    Columns of several non-negative numbers get a bar in each cell, proportional to the number.
    """
    columns = _columns(table)
    count = max((len(values) for values in columns.values()), default=0)
    bars = {name: _bars(values) for name, values in columns.items()}
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    body = "".join(
        f"<tr>{''.join(_cell(values[row], bars[name][row]) for name, values in columns.items())}</tr>"
        for row in range(min(count, _MOST_ROWS))
    )
    rest = f"<p>and {count - _MOST_ROWS} more rows</p>" if count > _MOST_ROWS else ""
    return f"<table><caption>{html.escape(caption)}</caption><tr>{head}</tr>{body}</table>{rest}"


def _columns(table: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    if isinstance(table, Mapping):
        return {name: list(np.ravel(values)) for name, values in table.items()}
    names = dict.fromkeys(name for row in table for name in row)
    return {name: [row.get(name) for row in table] for name in names}


def _bars(values: list[Any]) -> list[float | None]:
    """Percentages of the largest value; None without a bar."""
    numbers = [value for value in values if _is_figure(value)]
    largest = max(numbers, default=0.0)
    if len(numbers) < 2 or not largest > 0.0 or min(numbers) < 0.0:
        return [None] * len(values)
    return [100.0 * float(value / largest) if _is_figure(value) else None for value in values]


def _is_figure(value: Any) -> bool:
    return isinstance(value, float | np.floating) and bool(np.isfinite(value))


def _cell(value: Any, share: float | None) -> str:
    style = "" if share is None else f' style="{_BAR.format(share=share)}"'
    return f"<td{style}>{_shown(value)}</td>"


def _shown(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    text = str(value)
    if len(text) <= _LONGEST:
        return html.escape(text)
    return f'<span title="{html.escape(text)}">{html.escape(text[:_LONGEST])}…</span>'


# ---- the base class ------------------------------------------------------------------------------


def plain(value: Any) -> Any:
    """JSON-safe value; NaN and infinity become None."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if not isinstance(value, float) or np.isfinite(value) else None


class Answer(ABC):
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
        """The answer in a few words and numbers."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The answer with the keys of the command line's JSON; NaN and infinity are None."""

    @abstractmethod
    def _table(self) -> Any:
        """Columns by name, or a list of rows, with unrounded numbers."""

    def to_json(self, *, indent: int | None = None) -> str:
        """`to_dict` as JSON with numbers in full precision; NaN and infinity are null."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)

    def plain_rows(self) -> list[dict[str, Any]]:
        """The rows of `to_frame` for JSON; NaN and infinity are None."""
        table = self._table()
        if isinstance(table, dict):
            table = [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
        return [{name: plain(value) for name, value in row.items()} for row in table]

    def to_frame(self) -> pd.DataFrame:
        """A pandas DataFrame with a row per point or projection, NaN if undefined; raises ImportError without pandas.

        A statistic of a measure is a column, as `omega_mean` or `omega_max_lon`.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError("Invalid call of to_frame. It needs pandas: pip install 'projdist[gis]'.") from error
        return pd.DataFrame(self._table())
