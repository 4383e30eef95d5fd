"""A disk without room, as far as a process can pretend: files that may not grow beyond a size."""

import contextlib
import signal
from collections.abc import Iterator

import pytest

resource = pytest.importorskip("resource", reason="limits of Unix")


@contextlib.contextmanager
def room_for(size: int) -> Iterator[None]:
    """Within it no file grows beyond a size: writing more is an OSError, which Python and C have to look at."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
