"""One-line errors with exit codes, progress, and the width of terminals."""

import contextlib
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NoReturn, TextIO

import typer

from projdist import projections, support

USUAL = 80
"""Columns of a terminal that does not state its width."""


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal behind a stream; None for a file or a pipe."""
    if not stream.isatty():
        return None
    wanted = os.environ.get("COLUMNS", "")
    if wanted.isdecimal() and int(wanted) > 0:
        return int(wanted)
    try:
        return os.get_terminal_size(stream.fileno()).columns or USUAL
    except OSError:
        return USUAL


def folded(text: str, width: int | None) -> str:
    """Text wrapped at blanks; words longer than a line, such as paths, stay whole so that they can be copied."""
    if width is None:
        return text
    from rich.cells import cell_len  # needed in terminals only

    lines: list[str] = []
    for line in text.split("\n"):
        if cell_len(line) <= width:
            lines.append(line)
            continue
        lines.append("")
        for word in line.split():
            if lines[-1] and cell_len(lines[-1]) + 1 + cell_len(word) > width:
                lines.append(word)
            else:
                lines[-1] += f" {word}" if lines[-1] else word
    return "\n".join(lines)


# ---- progress ------------------------------------------------------------------------------------


_MOMENT = 2.0  # seconds; shorter work shows nothing
_MOMENT_IN_A_PIPE, _LINES_APART = 2.0, 10.0
_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)


@contextlib.contextmanager
def without_progress(quiet: bool) -> Iterator[None]:
    """Context without progress if `quiet`."""
    token = _QUIET.set(quiet)
    try:
        yield
    finally:
        _QUIET.reset(token)


@contextlib.contextmanager
def progress_bar(things: str, *, after: float = _MOMENT) -> Iterator[Callable[[int, int], None] | None]:
    """Callback (done, total) that shows a bar after `after` seconds, or some lines in a pipe; None if not wanted."""
    # `things` names what is counted. The bar is erased at the end.
    if _QUIET.get():
        yield None
        return
    if not sys.stderr.isatty():
        yield _lines_of(things)
        return
    # In a pipe rich is loaded for tables only.
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn

    columns: list[ProgressColumn] = [MofNCompleteColumn(), TextColumn(things), BarColumn(), TimeRemainingColumn()]
    # Refreshed on updates, not by a thread: processes with threads are not forked.
    progress = Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False)
    task, start = progress.add_task("", total=None), time.monotonic()

    def move(done: int, total: int) -> None:
        progress.update(task, completed=done, total=total)
        if time.monotonic() - start >= after:
            progress.start()  # not before the first update: invalid input is refused earlier
            progress.refresh()

    try:
        yield move
    finally:
        if progress.live.is_started:
            progress.stop()


def _lines_of(things: str) -> Callable[[int, int], None]:
    """Callback (done, total) that writes one line after a moment, and further ones at intervals."""
    due = time.monotonic() + _MOMENT_IN_A_PIPE

    def move(done: int, total: int) -> None:
        nonlocal due
        if (now := time.monotonic()) >= due:
            due = now + _LINES_APART
            sys.stderr.write(f"projdist: {done} of {total} {things} ...\n")

    return move


@contextlib.contextmanager
def working(words: str) -> Iterator[Callable[[str], None]]:
    """Show `words`, or the latest given to the callback, while work takes longer than a moment; in a pipe one line."""
    if _QUIET.get():
        yield lambda _: None
        return
    with contextlib.ExitStack() as stack:
        update: Callable[[str], None]
        if sys.stderr.isatty():
            from rich.console import Console

            status = Console(stderr=True).status(words)
            stack.callback(status.stop)
            timer, update = threading.Timer(_MOMENT, status.start), status.update
        else:
            latest = [words]
            timer = threading.Timer(_MOMENT_IN_A_PIPE, lambda: sys.stderr.write(f"projdist: {latest[-1]} ...\n"))
            update = latest.append
        timer.start()
        stack.callback(timer.join)
        stack.callback(timer.cancel)
        yield update


# ---- errors --------------------------------------------------------------------------------------


_SURROGATES = 0xDC00  # start of the surrogates that stand for undecodable bytes of file names (PEP 383)


def fail(message: str) -> None:
    """Print an error in one line, wrapped in a narrow terminal; unprintable characters become escapes."""
    # After a signal to end nothing is printed: the error is then a consequence of the signal.
    support.end_if_told()
    shown = ""
    for letter in " ".join(message.split()):
        byte = ord(letter) - _SURROGATES
        escape = f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else letter.encode("unicode_escape").decode()
        shown += letter if letter.isprintable() else escape
    sys.stderr.write(f"{folded(f'projdist: {shown}', width_of(sys.stderr))}\n")


def note(text: str) -> None:
    """Print a note on standard error."""
    if text:
        sys.stderr.write(f"projdist: Note: {text}\n")


def refuse(message: str, error: Exception | None = None, *, code: int = 2) -> NoReturn:
    """Report an error, and exit with `code`, or with 1 for an unavailable grid."""
    fail(f"Invalid file. {support.one_line(error)}." if isinstance(error, UnicodeEncodeError) else message)
    raise typer.Exit(1 if isinstance(error, projections.GridError) else code) from error


def cannot_write(output: Path | None, error: OSError) -> NoReturn:
    """Report that a file or standard output cannot be written, and exit with 2."""
    refuse(f"Invalid output '{output or 'standard output'}'. It cannot be written: {error.strerror or error}.", error)


def tell_problems(problems: list[str]) -> None:
    """Report partial failures, and exit with 1 if there are any."""
    for problem in problems:
        fail(problem)
    if problems:
        raise typer.Exit(1)


@contextlib.contextmanager
def refusing(*, code: int = 2) -> Iterator[None]:
    """Turn exceptions into one-line errors: exit 1 for a projection, `code` for other invalid values, 2 for files."""
    try:
        yield
    except ValueError as error:
        refuse(str(error), error, code=1 if isinstance(error, projections.ProjectionError) else code)
    except (ImportError, FileExistsError) as error:
        refuse(str(error), error)


@contextlib.contextmanager
def notices_said() -> Iterator[None]:
    """Print each notice of the library once, in one line; other warnings are dropped."""
    said: set[str] = set()

    def say(message: Warning | str, *_: Any, **__: Any) -> None:
        if str(message) not in said:
            said.add(str(message))
            fail(str(message))

    with warnings.catch_warnings():
        warnings.simplefilter("always", category=support.Notice)
        warnings.showwarning = say
        yield
