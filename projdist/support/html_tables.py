"""Tables in HTML, for notebooks: figures with small bars."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

__all__ = ["html_table"]

_MOST_ROWS, _LONGEST = 30, 40  # rows, and letters of a cell
_BAR = "background: linear-gradient(90deg, #c2d8ec {share:.0f}%, transparent {share:.0f}%)"


def html_table(table: Mapping[str, Any] | Sequence[Mapping[str, Any]], caption: str) -> str:
    """A table of columns by name, or of rows, with its caption; of many rows the first.

    A column of several numbers that are not negative has a bar in each cell, as long as the number is large.
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
    """Percentages of the largest; None for what has no bar."""
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
