"""What a user should know of an answer besides the answer, as a warning that the command line prints in one line."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Iterator
from contextvars import ContextVar

__all__ = ["Notice", "notices_kept", "tell"]

_KEPT: ContextVar[list[str] | None] = ContextVar("kept", default=None)


class Notice(UserWarning):
    """What projdist warns of: input that may not be what was meant, what was left out, what is close to wrong."""


def tell(text: str) -> None:
    """Warn with a Notice, at the line of the user's that called projdist."""
    kept = _KEPT.get()
    if kept is not None:
        kept.append(text)
        return
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "projdist":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, Notice, stacklevel=level)


@contextlib.contextmanager
def notices_kept() -> Iterator[list[str]]:
    """A list of the notices told within it, in this thread, in place of warnings."""
    told: list[str] = []
    token = _KEPT.set(told)
    try:
        yield told
    finally:
        _KEPT.reset(token)
