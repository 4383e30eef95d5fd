"""What was measured before: the ratios of every table with the commit, and what is slower than it was."""

from __future__ import annotations

import csv
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

HISTORY = Path(__file__).with_name("history.csv")
SLOWER = 1.10  # of what it was
_USUAL = 1.4826  # times the median deviation is the standard deviation, where that is normal


@dataclass(frozen=True)
class Entry:
    """A row of a table at a commit: the median of several ratios, and how far they are apart, as a share of it."""

    commit: str
    date: str
    table: str
    row: str
    ratio: float
    spread: float

    @property
    def key(self) -> tuple[str, str]:
        """What it is of."""
        return self.table, self.row


def entry_of(commit: str, date: str, table: str, row: str, ratios: Sequence[float]) -> Entry:
    """The entry of paired runs: the median, and the standard error that their median deviation gives."""
    middle = statistics.median(ratios)
    deviation = _USUAL * statistics.median(abs(ratio - middle) for ratio in ratios)
    return Entry(commit, date, table, row, round(middle, 4), round(deviation / middle / len(ratios) ** 0.5, 4))


def read_history(path: Path = HISTORY) -> list[Entry]:
    """The entries, oldest first; none where there is no file."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [Entry(**row | {name: float(row[name]) for name in ("ratio", "spread")}) for row in csv.DictReader(file)]


def append_history(entries: Iterable[Entry], path: Path = HISTORY) -> None:
    """Append entries, below a header where there is no file."""
    is_new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Entry)], lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerows(asdict(entry) for entry in entries)


def newest(history: Iterable[Entry]) -> dict[tuple[str, str], Entry]:
    """The last entry of each row."""
    return {entry.key: entry for entry in history}


def slower(measured: Iterable[Entry], known: dict[tuple[str, str], Entry]) -> list[tuple[Entry, Entry]]:
    """Rows that take a tenth more than they did, and more than both spreads explain; each with what it was."""
    pairs = [(now, known[now.key]) for now in measured if now.key in known]
    return [(now, then) for now, then in pairs if now.ratio > SLOWER * then.ratio and _apart(now, then)]


def _apart(now: Entry, then: Entry) -> bool:
    return now.ratio * (1.0 - 2.0 * now.spread) > then.ratio * (1.0 + 2.0 * then.spread)
