"""What is being done, and how much of it is done: on the standard error, where that is a terminal."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn

_MOMENT = 2.0  # seconds: what is done by then needs no bar


@contextlib.contextmanager
def progress_bar(things: str, *, after: float = _MOMENT) -> Iterator[Callable[[int, int], None] | None]:
    """A listener (done, total) that moves a bar from so many seconds on; None where the standard error is no terminal.

    `things` are what is counted. The bar leaves nothing.
    """
    if not sys.stderr.isatty():
        yield None
        return
    columns: list[ProgressColumn] = [MofNCompleteColumn(), TextColumn(things), BarColumn(), TimeRemainingColumn()]
    # Drawn when there is news, without a thread that would draw it: processes with threads are not forked.
    progress = Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False)
    task, start = progress.add_task("", total=None), time.monotonic()

    def move(done: int, total: int) -> None:
        if time.monotonic() - start >= after:
            progress.start()  # with the first news: wrong words are refused before
        progress.update(task, completed=done, total=total, refresh=progress.live.is_started)

    try:
        yield move
    finally:
        if progress.live.is_started:
            progress.stop()
