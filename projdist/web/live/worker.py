"""Worker processes that answer requests, taking turns among pages."""

import atexit
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
from typing import Any, Generic, TypeVar

from projdist import support
from projdist.web.live.dispatcher import LARGEST_FILE, Dispatcher, InputPolicy, Request, failed, reply
from projdist.web.live.handlers import Progress

MOST_OF_PAGE = 48
"""Largest number of waiting tasks of a page; six maps need at most twenty-four of one worker."""

MOST_OF_ALL = 480
"""Largest number of waiting tasks of all pages."""

_Waiting = TypeVar("_Waiting")


class TooManyRequests(ValueError):
    """The queue has no place for a task."""


@dataclass
class RequestQueue(Generic[_Waiting]):
    """Waiting tasks, served in turns among pages; `most_bytes` limits the size of a page's tasks."""

    most_bytes: int
    _lines: dict[Hashable, dict[Hashable, tuple[_Waiting, int]]] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of tasks."""
        return sum(map(len, self._lines.values()))

    def put(self, page: Hashable, key: Hashable, task: _Waiting, size: int = 0) -> None:
        """Queue a task, replacing one of the same key; raises TooManyRequests."""
        line = self._lines.get(page, {})
        others = [other for name, (_, other) in line.items() if name != key]
        if key not in line and line and (len(line) >= MOST_OF_PAGE or len(self) >= MOST_OF_ALL):
            raise TooManyRequests(
                f"Invalid request. This page has {len(line)} others that wait, and may not have more: ask again when "
                "some are answered."
            )
        if size and sum(others) + size > self.most_bytes:
            raise TooManyRequests("Invalid request. A file of this page waits already: ask again when it is answered.")
        self._lines.setdefault(page, line)[key] = task, size

    def next(self) -> _Waiting:
        """Remove and return the next task; raises LookupError if there is none."""
        page = next(iter(self._lines), None)
        if page is None:
            raise LookupError("Nothing waits.")
        line = self._lines.pop(page)
        task, _ = line.pop(next(iter(line)))
        if line:
            self._lines[page] = line  # behind the others
        return task

    def drop(self, page: Hashable, key: Hashable = None) -> None:
        """Remove the task of a key, if it is queued, or without a key all tasks of a page."""
        line = self._lines.get(page, {})
        line.pop(key, None)
        if key is None or not line:
            self._lines.pop(page, None)


# ---- workers ---------------------------------------------------------------------------------------

LIMITS = {"preview": 5.0, "picture": 60.0, "figures": 120.0, "long": 600.0}
"""Seconds after which a request is stopped."""

_POLL, _WATCH = 0.2, 1.0  # seconds
_STARTING = threading.Lock()
_TRIES = 2  # of a task whose process is killed from outside
_PATIENCE = 30.0  # seconds for a process to start, in addition to the limit
_FAILED = "This failed, and should not have: the terminal where the page was started says why."
_KILLED = "The process that works on this ended twice. Try another map."
_READY, _REPLY, _PROGRESS, _CRASH = "ready", "reply", "progress", "crash"  # kinds of a process's messages

OnReply = Callable[[bytes], None]


@dataclass(eq=False)
class _Task:
    """Queued request, its callback and a cancelled flag."""

    page: Hashable
    key: Hashable
    request: Request
    on_reply: OnReply
    dropped: threading.Event = field(default_factory=threading.Event)


class Worker:
    """A process that answers requests one by one; of waiting ones with the same key only the newest."""

    def __init__(self, name: str, policy: InputPolicy, limit: float | None = None) -> None:
        self._name, self._policy, self._variables = name, policy, policy.environment()
        self._limit = LIMITS[name] if limit is None else limit
        self._waiting: RequestQueue[_Task] = RequestQueue(LARGEST_FILE)
        self._running: _Task | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._process: tuple[BaseProcess, Connection] | None = None
        self._ready = False  # whether the process has started
        self._thread = threading.Thread(target=self._run, name=f"projdist {name}", daemon=True)
        self._thread.start()

    def ask(self, page: Hashable, key: Hashable, request: Request, on_reply: OnReply) -> None:
        """Queue a request of a page; it replaces a waiting one of the same key."""
        # `on_reply` is called from another thread with progress and the reply, or at once if the queue is full.
        try:
            with self._changed:
                self._waiting.put(page, key, _Task(page, key, request, on_reply), len(request.file))
                self._changed.notify_all()
        except TooManyRequests as error:
            on_reply(failed(request, str(error)))

    def drop(self, page: Hashable, key: Hashable = None) -> None:
        """Cancel the request of a key of a page, or without a key all of its requests."""
        with self._changed:
            self._waiting.drop(page, key)
            if self._running is not None and self._running.page == page and key in (None, self._running.key):
                self._running.dropped.set()

    def close(self) -> None:
        """End the process and the thread."""
        with self._changed:
            self._closed = True
            if self._running is not None:
                self._running.dropped.set()
            self._changed.notify_all()
        self._thread.join(timeout=5.0)
        if self._process is not None and self._process[0].is_alive():
            self._end()

    @property
    def pid(self) -> int | None:
        """Process id, None without a process."""
        return None if self._process is None else self._process[0].pid

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
        """Answer a task; retry once if the process is killed."""
        answer, tries = None, 0
        while answer is None and tries < _TRIES and not task.dropped.is_set():
            answer, tries = self._done(task), tries + 1
        if not task.dropped.is_set():
            task.on_reply(answer or failed(task.request, _KILLED))

    def _done(self, task: _Task) -> bytes | None:
        """Reply to a task, None if the process was killed or the task cancelled."""
        process, connection = self._start()
        until = time.monotonic() + self._limit + (0.0 if self._ready else _PATIENCE)
        try:
            connection.send(task.request)
            while True:
                if connection.poll(_POLL):
                    kind, *content = connection.recv()
                    if kind == _REPLY:
                        return bytes(content[0])
                    if kind == _CRASH:  # an unexpected exception, whose traceback goes to the terminal
                        self._end()
                        logging.getLogger(__name__).error(content[0])  # by default to standard error
                        return failed(task.request, _FAILED)
                    if kind == _READY:
                        self._ready, until = True, time.monotonic() + self._limit
                    elif not task.dropped.is_set():
                        task.on_reply(reply(task.request, {"progress": content}))
                elif not process.is_alive():  # its children may hold the connection open
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

    def _start(self) -> tuple[BaseProcess, Connection]:
        """The process and its connection, started if needed."""
        if self._process is not None and self._process[0].is_alive():
            return self._process
        if self._process is not None:  # it was killed while idle
            self._process[1].close()
        context = multiprocessing.get_context("spawn")
        connection, other = context.Pipe()
        # Not a daemon: daemons may not start processes.
        process = context.Process(
            target=serve_requests, args=(other, self._policy, os.getpid()), name=f"projdist {self._name}", daemon=False
        )
        with _environment(self._variables):
            process.start()
        other.close()
        self._process, self._ready = (process, connection), False
        return self._process

    def _end(self) -> None:
        """Kill the process and its descendants, which may have outlived it."""
        if self._process is None:
            return
        process, connection = self._process
        self._process = None
        if process.pid is not None and hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError):  # it has no group of its own yet, or no longer
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.join(timeout=5.0)
        connection.close()


@contextlib.contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for processes started meanwhile; multiprocessing has no other way."""
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


def serve_requests(connection: Connection, policy: InputPolicy, parent: int) -> None:
    """Answer requests until the connection is closed; an unexpected exception ends the process."""
    _leave_with(parent)
    dispatcher = Dispatcher(policy)
    with contextlib.suppress(EOFError, OSError):  # the other end is closed
        connection.send((_READY,))
        while True:
            request = connection.recv()
            try:
                answer = dispatcher.answer(request, lambda done, of: connection.send((_PROGRESS, done, of)))
            except Exception as error:  # noqa: BLE001 whatever it is, the parent reports it
                connection.send((_CRASH, "".join(traceback.format_exception(error))))
                return
            connection.send((_REPLY, answer))


def _leave_with(parent: int) -> None:
    """Start a process group, which Ctrl-C does not reach, and end it with the parent."""
    if not hasattr(os, "setpgid"):
        return
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch(*_: Any) -> None:
        if os.getppid() != parent:
            os.killpg(0, signal.SIGKILL)

    signal.signal(signal.SIGALRM, watch)
    signal.setitimer(signal.ITIMER_REAL, _WATCH, _WATCH)


# ---- in a notebook's kernel ----------------------------------------------------------------------

# Warning filters are global to the process: one answer at a time.
_ANSWERING = threading.Lock()


def answered(dispatcher: Dispatcher, request: Request, progress: Progress = lambda done, of: None) -> bytes:
    """Reply of a dispatcher in the kernel; exceptions of the user's functions become failures."""
    with _ANSWERING:
        try:
            return dispatcher.answer(request, progress)
        except Exception as error:  # noqa: BLE001 a user's function may raise anything
            return failed(request, support.one_line(f"{type(error).__name__}: {error}"))


class Stopped(ValueError):
    """The request was cancelled."""


class Thread(Worker):
    """A worker without a process, for objects of the kernel that have no text."""

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher
        super().__init__("kernel", dispatcher.policy, float("inf"))

    def _start(self) -> Any:
        """No process is started."""

    def _done(self, task: Any) -> bytes:
        def progress(done: int, of: int) -> None:
            if task.dropped.is_set():
                raise Stopped("Stopped.")

        return answered(self._dispatcher, task.request, progress)


class Workers:
    """Workers shared by a kernel's widgets, started on demand and ended with the last widget."""

    def __init__(self) -> None:
        self._workers: dict[str, Worker] = {}
        self._users: set[Hashable] = set()

    def ask(self, user: Hashable, worker: str, key: Hashable, request: Request, on_reply: OnReply) -> None:
        """Queue a request of a widget."""
        self._users.add(user)
        if worker not in self._workers:
            self._workers[worker] = Worker(worker, InputPolicy(is_open=True))
        self._workers[worker].ask(user, key, request, on_reply)

    def drop(self, user: Hashable, worker: str, key: Hashable) -> None:
        """Cancel a request of a widget."""
        if worker in self._workers:
            self._workers[worker].drop(user, key)

    def leave(self, user: Hashable) -> None:
        """Cancel all requests of a widget."""
        self._users.discard(user)
        if not self._users:
            self.close()
        for worker in self._workers.values():
            worker.drop(user)

    def close(self) -> None:
        """End all processes."""
        workers, self._workers = self._workers, {}
        for worker in workers.values():
            worker.close()

    @property
    def pids(self) -> list[int]:
        """Ids of the processes."""
        return [worker.pid for worker in self._workers.values() if worker.pid is not None]


WORKERS = Workers()
atexit.register(WORKERS.close)
