"""What is being done, and how much of it is done: on the standard error, where that is a terminal."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping

_MOMENT = 2.0  # seconds: what is done by then needs no bar


@contextlib.contextmanager
def progress_bar(things: str, *, after: float = _MOMENT) -> Iterator[Callable[[int, int], None] | None]:
    """A listener (done, total) that moves a bar from so many seconds on; None where the standard error is no terminal.

    `things` are what is counted. The bar leaves nothing.
    """
    if not sys.stderr.isatty():
        yield None
        return
    # Here, and not above: in a pipe rich is loaded only where there is a table.
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn

    columns: list[ProgressColumn] = [MofNCompleteColumn(), TextColumn(things), BarColumn(), TimeRemainingColumn()]
    # Drawn when there is news, without a thread that would draw it: processes with threads are not forked.
    progress = Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False)
    task, start = progress.add_task("", total=None), time.monotonic()

    def move(done: int, total: int) -> None:
        progress.update(task, completed=done, total=total)
        if time.monotonic() - start >= after:
            progress.start()  # with the first news: wrong words are refused before
            progress.refresh()

    try:
        yield move
    finally:
        if progress.live.is_started:
            progress.stop()


@contextlib.contextmanager
def words_told(words: Mapping[str, str]) -> Iterator[Callable[[str], None]]:
    """A listener to the keys of words for what is being done, where the standard error is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status("") as status:
        yield lambda word: status.update(words[word])


@contextlib.contextmanager
def working(words: str) -> Iterator[None]:
    """Words for what takes longer than a moment and cannot be counted, where the standard error is a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    status = Console(stderr=True).status(words)
    timer = threading.Timer(_MOMENT, status.start)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        status.stop()
