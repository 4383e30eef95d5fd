"""The workers that a command is told to use."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from concurrent.futures import Executor

import typer

from projdist.cli.errors import fail
from projdist.support import check_executor, open_executor


@contextlib.contextmanager
def executor_opened(text: str | None) -> Iterator[Executor | None]:
    """The executor of `--executor`, None without one; raises ImportError where it needs Dask."""
    if text is None:
        yield None
        return
    check_executor(text)
    with contextlib.ExitStack() as stack:
        try:
            workers = stack.enter_context(open_executor(text))
        except OSError as error:
            fail(f"Invalid executor '{text}'. Nothing answers there.")
            raise typer.Exit(1) from error
        yield workers
