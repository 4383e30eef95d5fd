"""What goes wrong, each in one line on standard error, with the exit code that it has."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import typer

from projdist.cli.terminal import folded, width_of
from projdist.projections import GridError, ProjectionError
from projdist.support import Notice, end_if_told, one_line

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
