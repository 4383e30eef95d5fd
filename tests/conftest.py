"""What all tests share."""

import functools
import os
from collections.abc import Iterator

import pytest
import typer.main
import typer.testing
from hypothesis import settings

# Tests run in as many processes as there are cores: BLAS's threads would only wait for each other. Before numpy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples every time, and no deadline: a busy machine is no failure.
settings.register_profile("projdist", derandomize=True, deadline=None, max_examples=25)
settings.load_profile("projdist")


@pytest.fixture(scope="session", autouse=True)
def command_line_made_once() -> Iterator[None]:
    """Typer makes the command line of its functions in 40 ms: once for all tests that run it, not in each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.testing, "_get_command", functools.cache(typer.main.get_command), raising=False)
        yield
