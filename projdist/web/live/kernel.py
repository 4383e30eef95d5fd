"""Who works for the widgets of a notebook's kernel: processes that they share, and threads for what is Python's own."""

from __future__ import annotations

import atexit
import contextlib
import math
import multiprocessing.util  # noqa: F401  (first: at the end it waits for processes that are ended here)
import threading
from collections.abc import Hashable
from types import TracebackType
from typing import Any

from projdist.support import one_line
from projdist.web.live.desk import Desk, Progress
from projdist.web.live.inputs import OpenDoors
from projdist.web.live.lanes import Lane, Told
from projdist.web.live.replies import failed
from projdist.web.live.requests import Request

# How warnings are treated is a matter of the process, not of a thread: one answer is made after the other.
_DESKS = threading.Lock()


def answered(desk: Desk, request: Request, progress: Progress = lambda done, of: None) -> bytes:
    """The reply of a desk in the kernel; whatever a function of the user's raises is told in it."""
    replies: list[bytes] = []

    def report(_: type[BaseException] | None, error: BaseException | None, __: TracebackType | None) -> bool:
        if isinstance(error, Exception):
            replies.append(failed(request, one_line(f"{type(error).__name__}: {error}")))
        return isinstance(error, Exception)

    with _DESKS, contextlib.ExitStack() as stack:
        stack.push(report)
        replies.append(desk.answer(request, progress))
    return replies[0]


class Stopped(ValueError):
    """Nobody waits for the answer any more."""


class Thread(Lane):
    """A lane without a process, for maps and regions that are objects of the kernel and have no text."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        super().__init__("kernel", desk.doors, math.inf)

    def _start(self) -> Any:
        """Nothing is started."""

    def _done(self, task: Any) -> bytes:
        def progress(done: int, of: int) -> None:
            if task.dropped.is_set():
                raise Stopped("Stopped.")

        return answered(self._desk, task.request, progress)


class Workers:
    """Processes for the widgets of a kernel: each is started when it is needed, and ended with the last widget."""

    def __init__(self) -> None:
        self._lanes: dict[str, Lane] = {}
        self._users: set[Hashable] = set()

    def ask(self, user: Hashable, lane: str, key: Hashable, request: Request, told: Told) -> None:
        """Have a request answered for a widget."""
        self._users.add(user)
        if lane not in self._lanes:
            self._lanes[lane] = Lane(lane, OpenDoors())
        self._lanes[lane].ask(user, key, request, told)

    def drop(self, user: Hashable, lane: str, key: Hashable) -> None:
        """Stop what is done for a widget."""
        if lane in self._lanes:
            self._lanes[lane].drop(user, key)

    def leave(self, user: Hashable) -> None:
        """Do nothing more for a widget."""
        self._users.discard(user)
        if not self._users:
            self.close()
        for lane in self._lanes.values():
            lane.leave(user)

    def close(self) -> None:
        """End all processes."""
        lanes, self._lanes = self._lanes, {}
        for lane in lanes.values():
            lane.close()

    @property
    def pids(self) -> list[int]:
        """The numbers of the processes."""
        return [lane.pid for lane in self._lanes.values() if lane.pid is not None]


WORKERS = Workers()
atexit.register(WORKERS.close)
