"""What goes wrong, each in one line on standard error, with the exit code that it has."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NoReturn

import typer


def fail(message: str) -> None:
    """Say what went wrong, in one line; what cannot be printed is an escape."""
    line = " ".join(message.split())
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    sys.stderr.write(f"projdist: {shown}\n")


def refuse(message: str, error: Exception | None = None) -> NoReturn:
    """Say what was wrong in the usage, and end with 2."""
    fail(message)
    raise typer.Exit(2) from error


def cannot_write(output: Path | None, error: OSError) -> NoReturn:
    """Say which file cannot be written, or that the standard output cannot, and end with 2."""
    refuse(f"Invalid output '{output or 'standard output'}'. It cannot be written: {error.strerror or error}.", error)


def report(problems: list[str]) -> None:
    """Say what failed beside the results, and end with 1 where anything did."""
    for problem in problems:
        fail(problem)
    if problems:
        raise typer.Exit(1)
