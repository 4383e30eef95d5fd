"""Turns: what waits for a process, from many pages, so that none of them keeps the others waiting.

Each page has its own line, and is served once before any is served again. In a line there is one task for each key, the
newest, at the place of the first; what a page may have there is limited, and so is what all have.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

__all__ = ["MOST_OF_ALL", "MOST_OF_PAGE", "Full", "Turns"]

MOST_OF_PAGE = 48
"""Tasks of a page that may wait; six maps and all that is asked of them at once have twenty-four in one process."""

MOST_OF_ALL = 480
"""Tasks of all pages."""

_Task = TypeVar("_Task")


class Full(ValueError):
    """There is no place for a task."""


@dataclass
class Turns(Generic[_Task]):
    """Tasks that wait; `most_bytes` is the size of all of a page together."""

    most_bytes: int
    _lines: dict[Hashable, dict[Hashable, tuple[_Task, int]]] = field(default_factory=dict)

    def __len__(self) -> int:
        """The number of tasks."""
        return sum(map(len, self._lines.values()))

    def put(self, page: Hashable, key: Hashable, task: _Task, size: int = 0) -> None:
        """Let a task wait, in the place of one of the same key; raises Full."""
        line = self._lines.get(page, {})
        others = [other for name, (_, other) in line.items() if name != key]
        if key not in line and line and (len(line) >= MOST_OF_PAGE or len(self) >= MOST_OF_ALL):
            raise Full(
                f"Invalid request. This page has {len(line)} others that wait, and may not have more: ask again when "
                "some are answered."
            )
        if size and sum(others) + size > self.most_bytes:
            raise Full("Invalid request. A file of this page waits already: ask again when that is answered.")
        self._lines.setdefault(page, line)[key] = task, size

    def next(self) -> _Task:
        """The task whose turn it is, which waits no more; raises LookupError where none does."""
        page = next(iter(self._lines), None)
        if page is None:
            raise LookupError("Nothing waits.")
        line = self._lines.pop(page)
        task, _ = line.pop(next(iter(line)))
        if line:
            self._lines[page] = line  # behind the others
        return task

    def drop(self, page: Hashable, key: Hashable) -> None:
        """Let a task wait no more, if it does."""
        line = self._lines.get(page, {})
        line.pop(key, None)
        if not line:
            self._lines.pop(page, None)

    def leave(self, page: Hashable) -> None:
        """Let no task of a page wait."""
        self._lines.pop(page, None)
