"""What a command leaves: text on the standard output or in a file, and pictures."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path

from projdist.cli.errors import cannot_write, refuse
from projdist.cli.formats import write
from projdist.support import is_stream


def emit(text: str, output: Path | None, overwrite: bool = False) -> None:
    """Print text, or write it to a file and say so; what cannot be written ends the command."""
    put(text, output, overwrite)
    if output is not None and not is_stream(output):
        put(wrote(output), None)


def put(text: str, output: Path | None, overwrite: bool = False) -> None:
    """The same without a word."""
    try:
        write(text, output, overwrite)
    except FileExistsError as error:
        refuse(str(error), error)
    except OSError as error:
        if output is None and error.errno == errno.EPIPE:
            raise  # typer knows how to end on a closed pipe
        cannot_write(output, error)


def wrote(*paths: Path) -> str:
    """The lines that say which files a command has written; folders of files, too.

    They end a table, or are all that is printed; JSON, CSV and Markdown, which go elsewhere, have none.
    """
    return "".join(f"Wrote: {path}\n" for path in paths)


@contextlib.contextmanager
def drawing(output: Path) -> Iterator[None]:
    """Say what of a picture cannot be drawn or written."""
    try:
        yield
    except (ValueError, FileExistsError) as error:
        refuse(str(error), error)
    except MemoryError as error:
        refuse(f"Invalid picture '{output}'. It needs more memory than there is: take a larger step.", error)
    except OSError as error:
        cannot_write(output, error)
