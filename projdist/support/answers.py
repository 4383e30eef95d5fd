"""What every answer can be turned into: a dictionary, JSON, a pandas DataFrame, a line, a table of a notebook."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from projdist.support.html_tables import html_table

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Answer", "plain"]


def plain(value: Any) -> Any:
    """A number for JSON: what is not finite is None."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if not isinstance(value, float) or np.isfinite(value) else None


class Answer(ABC):
    """An answer to a question about projections.

    Subclasses are `@dataclass(frozen=True, kw_only=True, eq=False, repr=False)`: equal to themselves only, as most hold
    arrays; compare their `to_dict()`. They print as one line, and as a table in notebooks.
    """

    def __repr__(self) -> str:
        """The class and the answer in a line."""
        return f"{type(self).__name__}({self._line()})"

    def _repr_html_(self) -> str:
        """The table of `to_frame`, for notebooks."""
        return html_table(self._table(), repr(self))

    @abstractmethod
    def _line(self) -> str:
        """The answer in a few words and figures."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The keys of the command line's JSON; what is not finite is None."""

    @abstractmethod
    def _table(self) -> Any:
        """Columns by name, or a list of rows; numbers as they are."""

    def to_json(self, *, indent: int | None = None) -> str:
        """`to_dict` as JSON: numbers in full precision, null for what is not finite."""
        return json.dumps(self.to_dict(), indent=indent, allow_nan=False)

    def plain_rows(self) -> list[dict[str, Any]]:
        """The rows of `to_frame` for JSON: names and numbers; what is not finite is None."""
        table = self._table()
        if isinstance(table, dict):
            table = [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
        return [{name: plain(value) for name, value in row.items()} for row in table]

    def to_frame(self) -> pd.DataFrame:
        """A pandas DataFrame: a row a point or a projection, NaN where undefined; raises ImportError without pandas.

        A statistic of a measure is a column, as `omega_mean` or `omega_max_lon`.
        """
        try:
            import pandas as pd
        except ImportError as error:
            raise ImportError("Invalid call of to_frame. It needs pandas: pip install 'projdist[gis]'.") from error
        return pd.DataFrame(self._table())
