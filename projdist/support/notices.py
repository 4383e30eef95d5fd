"""What a user should know of an answer besides the answer, as a warning that the command line prints in one line."""

from __future__ import annotations

import sys
import warnings

__all__ = ["Notice", "tell"]


class Notice(UserWarning):
    """What projdist warns of: input that may not be what was meant, what was left out, what is close to wrong."""


def tell(text: str) -> None:
    """Warn with a Notice, at the line of the user's that called projdist."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "projdist":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, Notice, stacklevel=level)
