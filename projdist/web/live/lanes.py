"""Processes that answer requests, so that a map that takes long, or never ends, keeps nobody waiting.

A lane is a process with a queue: one waiting request for each map of each page, the newest one. What takes too long is
ended with its process, and another one is started.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from projdist.web.live.inputs import Doors
from projdist.web.live.replies import failed, progressed
from projdist.web.live.requests import Request

__all__ = ["LIMITS", "Lane", "serve_requests"]

LIMITS = {"preview": 5.0, "picture": 60.0, "figures": 120.0, "long": 600.0}
"""Seconds after which a process is ended."""

_POLL, _WATCH = 0.2, 1.0  # seconds
_TRIES = 2  # a process may be killed from outside

Told = Callable[[bytes], None]


@dataclass(eq=False)
class _Task:
    """A request, who hears of it, and whether nobody waits for it any more."""

    request: Request
    told: Told
    dropped: threading.Event = field(default_factory=threading.Event)


class Lane:
    """A process that answers requests one after the other; the newest of each key."""

    def __init__(self, name: str, doors: Doors, limit: float | None = None) -> None:
        self._name, self._doors = name, doors
        self._limit = LIMITS[name] if limit is None else limit
        self._waiting: dict[Hashable, _Task] = {}
        self._running: tuple[Hashable, _Task] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._thread = threading.Thread(target=self._run, name=f"projdist {name}", daemon=True)
        self._thread.start()

    def ask(self, key: Hashable, request: Request, told: Told) -> None:
        """Answer a request in its turn, in place of one of the same key that still waits.

        `told` hears of it from another thread, of progress first.
        """
        with self._changed:
            self._waiting.pop(key, None)
            self._waiting[key] = _Task(request, told)
            self._changed.notify_all()

    def drop(self, key: Hashable) -> None:
        """Stop what is done for a key."""
        with self._changed:
            self._waiting.pop(key, None)
            if self._running is not None and self._running[0] == key:
                self._running[1].dropped.set()

    def drop_all(self, belongs: Callable[[Hashable], bool]) -> None:
        """Stop what is done for some keys."""
        with self._changed:
            keys = [*self._waiting, *([self._running[0]] if self._running else [])]
        for key in filter(belongs, keys):
            self.drop(key)

    def close(self) -> None:
        """End the process and the thread."""
        with self._changed:
            self._closed = True
            if self._running is not None:
                self._running[1].dropped.set()
            self._changed.notify_all()
        self._thread.join(timeout=5.0)
        self._end()

    @property
    def pid(self) -> int | None:
        """The number of the process, None where there is none yet."""
        return self._process.pid if self._process is not None else None

    def _run(self) -> None:
        self._start()
        while True:
            with self._changed:
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if self._closed:
                    return
                key = next(iter(self._waiting))
                self._running = key, self._waiting.pop(key)
            self._answer(self._running[1])
            with self._changed:
                self._running = None

    def _answer(self, task: _Task) -> None:
        """Have a task done, once more if its process dies."""
        for _ in range(_TRIES):
            reply = self._done(task)
            if reply is not None:
                if not task.dropped.is_set():
                    task.told(reply)
                return
        task.told(failed(task.request, "The process that works on this ended twice. Try another map or a larger area."))

    def _done(self, task: _Task) -> bytes | None:
        """The reply to a task, None where its process died."""
        connection, until = self._start(), time.monotonic() + self._limit
        try:
            connection.send(task.request)
            while True:
                if connection.poll(_POLL):
                    kind, *content = connection.recv()
                    if kind == "reply":
                        return bytes(content[0])
                    task.told(progressed(task.request, *content))
                elif task.dropped.is_set():
                    self._end()
                    return b""
                elif time.monotonic() > until:
                    self._end()
                    return failed(task.request, f"This took more than {self._limit:g} seconds and was stopped.")
        except (EOFError, OSError):
            self._end()
            return None

    def _start(self) -> Connection:
        """The connection to the process, which is started where there is none."""
        if self._process is not None and self._connection is not None and self._process.is_alive():
            return self._connection
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        # Not a daemon: it may have processes of its own.
        self._process = context.Process(
            target=serve_requests, args=(other, self._doors, os.getpid()), name=f"projdist {self._name}", daemon=False
        )
        self._process.start()
        other.close()
        return self._connection

    def _end(self) -> None:
        """End the process with all that it has started."""
        process, connection = self._process, self._connection
        self._process = self._connection = None
        if connection is not None:
            connection.close()
        if process is None:
            return
        if process.is_alive() and process.pid is not None:
            end_group(process.pid)
            process.kill()
        process.join(timeout=5.0)


def end_group(pid: int) -> None:
    """End a process and those that it has started, where it leads a group."""
    if hasattr(os, "killpg"):
        try:
            if os.getpgid(pid) == pid:
                os.killpg(pid, signal.SIGKILL)
        except ProcessLookupError:
            return


# ---- in the process -------------------------------------------------------------------------


def serve_requests(connection: Connection, doors: Doors, parent: int) -> None:
    """Answer requests until nobody asks any more."""
    _leave_with(parent)
    from projdist.web.live.desk import Desk  # slow to load, and of no use to the page's server

    desk = Desk(doors)
    while True:
        try:
            request = connection.recv()
        except EOFError:
            return
        reply = desk.answer(request, lambda done, of: connection.send(("progress", done, of)))
        connection.send(("reply", reply))


def _leave_with(parent: int) -> None:
    """Have a group of one's own, which Ctrl-C does not reach, and end with the parent, however that ends."""
    if not hasattr(os, "setpgid"):
        return
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch(*_: Any) -> None:
        if os.getppid() != parent:
            os.killpg(0, signal.SIGKILL)

    signal.signal(signal.SIGALRM, watch)
    signal.setitimer(signal.ITIMER_REAL, _WATCH, _WATCH)
