"""Processes that answer requests, so that a map that takes long, or never ends, keeps nobody waiting.

A lane is a process with a queue, in which pages have their turns: one waiting request for each map of each page, the
newest one. What takes too long is ended with its process, and another one is started.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Any

from projdist.web.live.inputs import Doors
from projdist.web.live.replies import failed, progressed
from projdist.web.live.requests import LARGEST_FILE, Request
from projdist.web.live.turns import Full, Turns

__all__ = ["LIMITS", "Lane", "serve_requests"]

LIMITS = {"preview": 5.0, "picture": 60.0, "figures": 120.0, "long": 600.0}
"""Seconds after which a process is ended."""

_POLL, _WATCH = 0.2, 1.0  # seconds
_STARTING = threading.Lock()
_TRIES = 2  # a process may be killed from outside
_PATIENCE = 30.0  # seconds for a process to start, which are not counted
_READY, _REPLY, _PROGRESS, _CRASH = "ready", "reply", "progress", "crash"  # what comes from it

Told = Callable[[bytes], None]


@dataclass(eq=False)
class _Task:
    """A request of a page, who hears of it, and whether nobody waits for it any more."""

    page: Hashable
    key: Hashable
    request: Request
    told: Told
    dropped: threading.Event = field(default_factory=threading.Event)


class Lane:
    """A process that answers requests one after the other; the newest of each key."""

    def __init__(self, name: str, doors: Doors, limit: float | None = None) -> None:
        self._name, self._doors, self._variables = name, doors, doors.environment()
        self._limit = LIMITS[name] if limit is None else limit
        self._waiting: Turns[_Task] = Turns(LARGEST_FILE)
        self._running: _Task | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._worker: tuple[BaseProcess, Connection] | None = None
        self._ready = False  # whether the process has started
        self._thread = threading.Thread(target=self._run, name=f"projdist {name}", daemon=True)
        self._thread.start()

    def ask(self, page: Hashable, key: Hashable, request: Request, told: Told) -> None:
        """Answer a request of a page in its turn, or in that of one of the same key that still waits.

        `told` hears of it from another thread, of progress first; at once where there is no place for it.
        """
        try:
            with self._changed:
                self._waiting.put(page, key, _Task(page, key, request, told), len(request.file))
                self._changed.notify_all()
        except Full as error:
            told(failed(request, str(error)))

    def drop(self, page: Hashable, key: Hashable) -> None:
        """Stop what is done for a key of a page."""
        with self._changed:
            self._waiting.drop(page, key)
            if self._running is not None and (self._running.page, self._running.key) == (page, key):
                self._running.dropped.set()

    def leave(self, page: Hashable) -> None:
        """Stop all that is done for a page."""
        with self._changed:
            self._waiting.leave(page)
            if self._running is not None and self._running.page == page:
                self._running.dropped.set()

    def close(self) -> None:
        """End the process and the thread."""
        with self._changed:
            self._closed = True
            if self._running is not None:
                self._running.dropped.set()
            self._changed.notify_all()
        self._thread.join(timeout=5.0)
        if self._worker is not None and self._worker[0].is_alive():
            self._end()

    @property
    def pid(self) -> int | None:
        """The number of the process, None where there is none."""
        return None if self._worker is None else self._worker[0].pid

    def _run(self) -> None:
        self._start()
        while True:
            with self._changed:
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if self._closed:
                    return
                self._running = self._waiting.next()
            self._answer(self._running)
            with self._changed:
                self._running = None

    def _answer(self, task: _Task) -> None:
        """Have a task done, once more if its process is killed."""
        reply, tries = None, 0
        while reply is None and tries < _TRIES and not task.dropped.is_set():
            reply, tries = self._done(task), tries + 1
        if not task.dropped.is_set():
            task.told(reply or failed(task.request, "The process that works on this ended twice. Try another map."))

    def _done(self, task: _Task) -> bytes | None:
        """The reply to a task, None where its process was killed, or nobody waits for it."""
        process, connection = self._start()
        until = time.monotonic() + self._limit + (0.0 if self._ready else _PATIENCE)
        try:
            connection.send(task.request)
            while True:
                if connection.poll(_POLL):
                    kind, *content = connection.recv()
                    if kind == _REPLY:
                        return bytes(content[0])
                    if kind == _CRASH:
                        return self._crashed(task.request, content[0])
                    if kind == _READY:
                        self._ready, until = True, time.monotonic() + self._limit
                    elif not task.dropped.is_set():
                        task.told(progressed(task.request, *content))
                elif not process.is_alive():  # those it has started may hold its end of the connection
                    break
                if task.dropped.is_set():
                    break
                if time.monotonic() > until:
                    self._end()
                    return failed(task.request, f"This took more than {self._limit:g} seconds and was stopped.")
        except (EOFError, OSError):
            pass  # it was killed
        self._end()
        return None

    def _crashed(self, request: Request, trace: str) -> bytes:
        """What the page hears of an exception that nobody foresaw, whose trace is for the terminal."""
        self._end()
        logging.getLogger(__name__).error(trace)  # to standard error, if nobody says otherwise
        return failed(request, "This failed, and should not have: the terminal where the page was started says why.")

    def _start(self) -> tuple[BaseProcess, Connection]:
        """The process and the connection to it, which are made where there are none."""
        if self._worker is not None and self._worker[0].is_alive():
            return self._worker
        if self._worker is not None:  # it was killed while it had nothing to do
            self._worker[1].close()
        context = multiprocessing.get_context("spawn")
        connection, other = context.Pipe()
        # Not a daemon: it may have processes of its own.
        process = context.Process(
            target=serve_requests, args=(other, self._doors, os.getpid()), name=f"projdist {self._name}", daemon=False
        )
        with _environment(self._variables):
            process.start()
        other.close()
        self._worker, self._ready = (process, connection), False
        return self._worker

    def _end(self) -> None:
        """End the process, if there is one, with all that it has started, which may have outlived it."""
        if self._worker is None:
            return
        process, connection = self._worker
        self._worker = None
        if process.pid is not None and hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError):  # it has no group of its own yet, or none any more
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.join(timeout=5.0)
        connection.close()


@contextlib.contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Have variables for processes that are started meanwhile; there is no other way to give them some."""
    with _STARTING:
        kept = {name: os.environ.get(name) for name in variables}
        os.environ.update(variables)
        try:
            yield
        finally:
            for name, value in kept.items():
                os.environ.pop(name)
                os.environ.update({} if value is None else {name: value})


# ---- in the process -------------------------------------------------------------------------


def serve_requests(connection: Connection, doors: Doors, parent: int) -> None:
    """Answer requests until nobody asks any more."""
    _leave_with(parent)
    from projdist.web.live.desk import Desk  # slow to load, and of no use to the page's server

    desk = Desk(doors)

    def report(_: type[BaseException] | None, error: BaseException | None, __: TracebackType | None) -> bool:
        if isinstance(error, Exception):
            connection.send((_CRASH, "".join(traceback.format_exception(error))))
        return isinstance(error, Exception)

    with contextlib.suppress(EOFError, OSError):  # nobody asks, or listens, any more
        connection.send((_READY,))
        while True:
            request, reply = connection.recv(), None
            with contextlib.ExitStack() as stack:  # what nobody foresaw is told, and ends the process
                stack.push(report)
                reply = desk.answer(request, lambda done, of: connection.send((_PROGRESS, done, of)))
            if reply is None:
                return
            connection.send((_REPLY, reply))


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
