"""What a command leaves: text on the standard output or in a file, and pictures."""

from __future__ import annotations

import contextlib
import errno
import sys
from collections.abc import Iterator
from pathlib import Path

from projdist.cli.errors import cannot_write, refuse, refusing
from projdist.cli.formats import render, wrote
from projdist.cli.report import Report
from projdist.support import is_stream, replacing


def present(report: Report, form: str, output: Path | None = None, overwrite: bool = False) -> None:
    """Print a report in a format, or write it to a file and say so."""
    emit(render(report, form, output), output, overwrite)


def emit(text: str, output: Path | None, overwrite: bool = False) -> None:
    """Print text, or write it to a file and say so; what cannot be written ends the command."""
    put(text, output, overwrite)
    if output is not None and not is_stream(output):
        tell_written(output)


def tell_written(*paths: Path) -> None:
    """Say which files were written."""
    put(wrote(*paths), None)


def put(text: str, output: Path | None, overwrite: bool = False) -> None:
    """The same without a word."""
    try:
        with refusing():
            write(text, output, overwrite)
    except OSError as error:
        if output is None and error.errno == errno.EPIPE:
            raise  # typer knows how to end on a closed pipe
        cannot_write(output, error)


def write(text: str, output: Path | None, overwrite: bool) -> None:
    """Print text, or write it to a file that is never left half-written; raises OSError."""
    if output is None:
        sys.stdout.write(text)
        sys.stdout.flush()  # so that what cannot be written is an error here, and not when the process ends
        return
    with replacing(output, overwrite=overwrite) as new:
        new.write_bytes(text.encode(errors="backslashreplace"))


@contextlib.contextmanager
def drawing(output: Path) -> Iterator[None]:
    """Say what of a picture cannot be drawn or written."""
    try:
        with refusing():
            yield
    except MemoryError as error:
        refuse(f"Invalid picture '{output}'. It needs more memory than there is: take a larger step.", error)
    except OSError as error:
        cannot_write(output, error)
