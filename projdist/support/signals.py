"""How the command ends when it is told to: by Ctrl-C, by the system, or as its terminal is closed.

Without a traceback, with 128 and the signal's number as exit code, as shells have it. Python loads the package before
it comes to the command line, which takes a second, so that this module, which is loaded first, sees for itself whether
that is done for the command. A program that imports projdist keeps its signals as they are.
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

_SOON = 0.1  # seconds, in which what runs where exceptions are ignored has ended
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@contextlib.contextmanager
def orderly_end() -> Iterator[None]:
    """Within it a signal raises SystemExit, so that what was begun is cleaned up; further signals do not disturb that.

    After it, all that is left to do is to end.
    """
    _handle(_stop)
    kept, sys.unraisablehook = sys.unraisablehook, _tell_again
    try:
        yield
    except Exception:
        end_if_told()
        raise
    finally:
        sys.unraisablehook = kept
        _handle(_leave)


def end_if_told() -> None:
    """Raise SystemExit again where a library in C++ made an error of its own of it."""
    for handler in map(signal.getsignal, _SIGNALS):
        if isinstance(handler, _Ending):
            raise SystemExit(handler.code) from None


def default_signals() -> None:
    """In a process of workers: what ends the command ends it, without a word."""
    for number in _SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def _is_command() -> bool:
    """Whether Python was started as `projdist` or as `python -m projdist`."""
    script, words = "".join(sys.argv[:1]), sys.orig_argv
    if script == "-m":  # it is, until the module is found
        return "-mprojdist" in words or ("-m", "projdist") in itertools.pairwise(words)
    return Path(script).stem == "projdist"


def _handle(handler: Callable[[int, FrameType | None], None]) -> None:
    """Take over signals; those that whoever started the process ignores stay ignored, as under nohup."""
    if threading.current_thread() is threading.main_thread():  # others may not
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
    """What is done with further signals: nothing."""

    code: int

    def __call__(self, *_: object) -> None:
        """Go on ending."""


def _tell_again(lost: sys.UnraisableHookArgs) -> None:
    """Send a signal again, soon, whose SystemExit came where Python ignores exceptions, as just after a fork."""
    if not isinstance(lost.exc_value, SystemExit):
        sys.__unraisablehook__(lost)
        return
    _handle(_stop)
    again = threading.Timer(_SOON, os.kill, (os.getpid(), int(str(lost.exc_value.code)) - 128))
    again.daemon = True
    again.start()


if _is_command():
    _handle(_leave)  # nothing has begun that would have to be cleaned up
