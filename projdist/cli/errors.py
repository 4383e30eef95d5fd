"""Errors of one line with their exit codes, progress, and what a terminal has room for."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn, TextIO

import typer

from projdist.projections import GridError, ProjectionError
from projdist.support import Notice, end_if_told, one_line

_USUAL = 80  # columns of a terminal that does not tell


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal behind a stream; None where it is a file or a pipe, which has all the room one needs."""
    if not stream.isatty():
        return None
    wanted = os.environ.get("COLUMNS", "")
    if wanted.isdecimal() and int(wanted) > 0:
        return int(wanted)
    try:
        return os.get_terminal_size(stream.fileno()).columns or _USUAL
    except OSError:
        return _USUAL


def takes_escapes(stream: TextIO) -> bool:
    """Whether a stream is a terminal that knows escape codes, whose user does not object (https://no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") not in ("dumb", "unknown")


def folded(text: str, width: int | None) -> str:
    """Text with its wider lines broken at blanks; a longer word, as a path, stays whole: it may be copied."""
    if width is None:
        return text
    return "\n".join(part for line in text.split("\n") for part in _parts(line, width))


def _parts(line: str, width: int) -> list[str]:
    from rich.cells import cell_len  # only what goes to a terminal needs it

    if cell_len(line) <= width:
        return [line]
    parts = [""]
    for word in line.split():
        if parts[-1] and cell_len(parts[-1]) + 1 + cell_len(word) > width:
            parts.append(word)
        else:
            parts[-1] += f" {word}" if parts[-1] else word
    return parts


# ---- progress ------------------------------------------------------------------------------------


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


# ---- errors --------------------------------------------------------------------------------------


_SURROGATES = 0xDC00  # what Python has for bytes of names that are no text: PEP 383


def fail(message: str) -> None:
    """Say what went wrong, in one line, or more in a narrow terminal; what cannot be printed is an escape.

    Where a signal told the command to end, no word: what went wrong is then what a library made of that.
    """
    end_if_told()
    line = " ".join(message.split())
    shown = "".join(c if c.isprintable() else _escaped(c) for c in line)
    sys.stderr.write(f"{folded(f'projdist: {shown}', width_of(sys.stderr))}\n")


def _escaped(letter: str) -> str:
    """What is not printed, as Python writes it; a byte of a file's name that is no text as that byte."""
    byte = ord(letter) - _SURROGATES
    return f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else letter.encode("unicode_escape").decode()


def refuse(message: str, error: Exception | None = None) -> NoReturn:
    """Say what was wrong in the usage, and end with 2; with 1 where it was a grid that cannot be had."""
    fail(f"Invalid file. {one_line(error)}." if isinstance(error, UnicodeEncodeError) else message)
    raise typer.Exit(1 if isinstance(error, GridError) else 2) from error


def cannot_write(output: Path | None, error: OSError) -> NoReturn:
    """Say which file cannot be written, or that the standard output cannot, and end with 2."""
    refuse(f"Invalid output '{output or 'standard output'}'. It cannot be written: {error.strerror or error}.", error)


def tell_problems(problems: list[str]) -> None:
    """Say what failed beside the results, and end with 1 where anything did."""
    for problem in problems:
        fail(problem)
    if problems:
        raise typer.Exit(1)


@contextlib.contextmanager
def refusing() -> Iterator[None]:
    """Say in one line what was wrong, and end: with 1 for projections; with 2 for other words, libraries, old files."""
    try:
        yield
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    except (ValueError, ImportError, FileExistsError) as error:
        refuse(str(error), error)


@contextlib.contextmanager
def notices_said() -> Iterator[None]:
    """Say each of the library's notices once, in one line; other warnings are not for people who run a command."""
    said: set[str] = set()

    def say(message: Warning | str, *_: Any, **__: Any) -> None:
        if str(message) not in said:
            said.add(str(message))
            fail(str(message))

    with warnings.catch_warnings():
        warnings.simplefilter("always", category=Notice)
        warnings.showwarning = say
        yield
