"""Orderly end of the command on Ctrl-C, termination or a closed terminal.

There is no traceback, and the exit code is 128 plus the signal's number, as in shells. Loading the package takes a
second before the command line starts, so this module, loaded first, detects itself whether the process is the command.
Programs that import projdist keep their signal handlers.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import NoReturn

_SOON = 0.1  # seconds after which code that ignores exceptions has ended
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextlib.contextmanager
def orderly_end() -> Iterator[None]:
    """Context in which a signal raises SystemExit, so that cleanup runs undisturbed; after it a signal ends at once."""
    _handle(_stop)
    kept, sys.unraisablehook = sys.unraisablehook, _send_again
    try:
        yield
    except Exception:
        end_if_told()
        raise
    finally:
        sys.unraisablehook = kept
        _handle(_leave)


def end_if_told() -> None:
    """Raise SystemExit again if a C++ library turned it into an error of its own."""
    for handler in map(signal.getsignal, _SIGNALS):
        if isinstance(handler, _Ending):
            raise SystemExit(handler.code) from None


def default_signals() -> None:
    """Restore the default handlers in a worker, which signals then end silently."""
    for number in _SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def _is_command() -> bool:
    """True if Python was started as `projdist` or `python -m projdist`."""
    script, words = "".join(sys.argv[:1]), sys.orig_argv
    if script == "-m":  # as until the module is found
        return "-mprojdist" in words or ("-m", "projdist") in itertools.pairwise(words)
    return Path(script).stem == "projdist"


def _handle(handler: Callable[[int, FrameType | None], None]) -> None:
    """Set a handler for the signals; ignored ones stay ignored, as under nohup."""
    if threading.current_thread() is threading.main_thread():  # the only one that may
        for number in _SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, handler)


def _leave(number: int, _: FrameType | None) -> NoReturn:
    os._exit(128 + number)


def _stop(number: int, _: FrameType | None) -> NoReturn:
    ending = _Ending(128 + number)
    _handle(ending)
    raise SystemExit(ending.code)


@dataclass(frozen=True)
class _Ending:
    """Handler that ignores further signals."""

    code: int

    def __call__(self, *_: object) -> None:
        """Ignore the signal."""


def _send_again(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again shortly after its SystemExit was raised where Python ignores exceptions, as after a fork."""
    if not isinstance(lost.exc_value, SystemExit):
        # Errors while the process ends follow from its end.
        if not any(isinstance(signal.getsignal(number), _Ending) for number in _SIGNALS):
            sys.__unraisablehook__(lost)
        return
    _handle(_stop)
    again = threading.Timer(_SOON, os.kill, (os.getpid(), int(str(lost.exc_value.code)) - 128))
    again.daemon = True
    again.start()


if _is_command():
    _handle(_leave)  # nothing to clean up yet
