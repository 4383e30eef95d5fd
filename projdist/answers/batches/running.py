"""The tasks of a batch on an executor, and the file of JSON lines that keeps their results as they come."""

from __future__ import annotations

import contextlib
import json
import math
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from projdist.answers.batches.tasks import Done, Job, Task, failure, run_tasks
from projdist.support import Processes, answering, is_lost, is_stream, open_executor, places_in, quoted

_SYNC = 1.0  # seconds; at every line, of which a cluster sends hundreds a second, it would take most of the time
_MARK = b'{"projdist": '  # at the beginning of every such file


class PartialFile:
    """An open file: the results that it has, and a place for more."""

    def __init__(self, file: FileIO, done: dict[int, dict[str, Any]]) -> None:
        self._file, self.done = file, done
        self._synced = time.monotonic()

    def append(self, lines: Sequence[str]) -> None:
        """Write lines of results; once in a while have the disk keep them, too, in case the machine stops."""
        self._file.write("".join(f"{line}\n" for line in lines).encode("ascii"))
        if time.monotonic() - self._synced > _SYNC:
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()


@contextlib.contextmanager
def open_partial(path: str | os.PathLike[str], header: Mapping[str, Any]) -> Iterator[PartialFile]:
    """The file of a job, new or as it was left.

    Raises ValueError for a file of another job, for what is none, and where another process writes it; OSError.
    """
    path = Path(path)
    if is_stream(path):
        raise ValueError(f"Invalid partial file {quoted(str(path))}. It is a device or a pipe, which keeps nothing.")
    with open(path, "ab+", buffering=0) as file:
        _lock(file, path)
        file.seek(0)
        text = file.read()
        whole = text[: text.rfind(b"\n") + 1]
        if not whole and not _MARK.startswith(text[: len(_MARK)]):
            raise ValueError(f"Invalid partial file {quoted(str(path))}. It is none; take another name.")
        done = _results(whole, header, path)
        if len(whole) < len(text):
            file.truncate(len(whole))
        partial = PartialFile(file, done)
        if not whole:
            partial.append([json.dumps(header)])
        yield partial


def _results(text: bytes, header: Mapping[str, Any], path: Path) -> dict[int, dict[str, Any]]:
    """The results in whole lines by their tasks, less those that are to be tried again."""
    lines = text.splitlines()
    if not lines:
        return {}
    found = _parsed(lines[0], path, 1) if lines[0].startswith(_MARK) else {}
    if "digest" not in found:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. It is none; take another name.")
    if found["digest"] != header["digest"]:
        raise ValueError(
            f"Invalid partial file {quoted(str(path))}. It belongs to another job, {_difference(found, header)}. Take "
            "another name, or remove it."
        )
    results = [_parsed(line, path, number) for number, line in enumerate(lines[1:], start=2)]
    return {result["task"]: result for result in results if not result.get("again")}


def _parsed(line: bytes, path: Path, number: int) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError as error:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Its line {number} is damaged.") from error
    if not isinstance(found, dict) or (number > 1 and not isinstance(found.get("task"), int)):
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Its line {number} is no result.")
    return found


def _difference(found: Mapping[str, Any], header: Mapping[str, Any]) -> str:
    """What the jobs of two headers differ in."""
    words = {
        "projdist": "of another version of projdist",
        "PROJ": "with another version of PROJ",
        "function": "of another function",
        "options": "with other options",
    }
    return next((words[key] for key in words if found.get(key) != header[key]), "of other regions or maps")


def _lock(file: FileIO, path: Path) -> None:
    """Keep other processes from writing the file, where the system can."""
    try:
        import fcntl
    except ImportError:  # Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise ValueError(f"Invalid partial file {quoted(str(path))}. Another process is writing it.") from error


# ---- tasks on an executor ------------------------------------------------------------------------


_PAYS = 1.0  # seconds of a group of tasks, against the milliseconds that it takes to send one
_ASK = 2.0  # seconds
_LARGEST = 100  # tasks in a group
_LOSSES = 2  # of workers by a task, after which it is not tried again

Keep = Callable[[Sequence[str]], None]


def run_job(job: Job, tasks: Sequence[Task], executor: Executor | str | None, keep: Keep) -> None:
    """Do tasks, and have the line of each kept as it is done; in this process without an executor."""
    with contextlib.ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(ThreadPoolExecutor(1))
        elif isinstance(executor, str):
            executor = stack.enter_context(open_executor(executor))
        _Run(job, tasks, executor, keep, stack).run()


class _Run:
    """What waits, what is under way, and how long a task takes."""

    def __init__(
        self, job: Job, tasks: Sequence[Task], executor: Executor, keep: Keep, stack: contextlib.ExitStack
    ) -> None:
        self._job, self._executor, self._keep, self._stack = job, executor, keep, stack
        self._waiting = deque(tasks)
        self._alone: deque[Task] = deque()  # each in a group of its own, as its group was lost
        self._losses: Counter[int] = Counter()
        self._under_way: dict[Future[Done], list[Task]] = {}
        self._ended: SimpleQueue[Future[Done]] = SimpleQueue()
        self._pace = math.inf  # seconds a task
        self._known_places, self._ask_again = 1, -math.inf

    def run(self) -> None:
        """Until nothing is left."""
        with self._nothing_left_behind():
            while True:
                places = self._places()
                while len(self._under_way) < places and (group := self._next(places)):
                    self._submit(group)
                if not self._under_way:
                    return
                future = self._ended.get()
                self._hear(future, self._under_way.pop(future))

    def _places(self) -> int:
        """How much may be under way, which is asked of the executor now and then, as a cluster may grow."""
        if time.monotonic() >= self._ask_again:
            with answering():
                self._known_places = places_in(self._executor)
            self._ask_again = time.monotonic() + _ASK
        return self._known_places

    @contextlib.contextmanager
    def _nothing_left_behind(self) -> Iterator[None]:
        """When the work ends early, also by Ctrl-C, what waits on the executor does not begin."""
        try:
            yield
        finally:
            for future in self._under_way:
                future.cancel()

    def _next(self, places: int) -> list[Task]:
        """The next group: as many as pay, and few enough that at the end all workers are done together."""
        if self._alone:
            return [self._alone.popleft()]
        share = math.ceil(len(self._waiting) / (2 * places))
        size = min(max(int(_PAYS / self._pace), 1), share, _LARGEST)
        return [self._waiting.popleft() for _ in range(size)]

    def _submit(self, group: list[Task]) -> None:
        try:
            with answering():
                future = self._executor.submit(run_tasks, self._job, group)
        except BrokenExecutor:  # for good: a pool of processes that somebody else has opened
            self._executor = self._stack.enter_context(Processes(max(places_in(self._executor) // 2, 1)))
            future = self._executor.submit(run_tasks, self._job, group)
        self._under_way[future] = group
        future.add_done_callback(self._ended.put)

    def _hear(self, future: Future[Done], group: list[Task]) -> None:
        """Keep what a group has done, and see to what it has not."""
        error = CancelledError() if future.cancelled() else future.exception()
        if error is None:
            lines, seconds = future.result()
            self._keep(lines)
            self._waiting.extendleft(reversed(group[len(lines) :]))
            pace = max(seconds / len(lines), 1e-6)
            self._pace = pace if self._pace == math.inf else 0.5 * (self._pace + pace)
        elif is_lost(error):
            self._lose(group)
        elif len(group) > 1:
            self._alone += group
        else:
            self._keep([failure(group[0], f"{type(error).__name__}: {error}")])

    def _lose(self, group: list[Task]) -> None:
        """Try each of a lost group again, alone; but not what was lost alone, too."""
        for task in group:
            self._losses[task.number] += 1
            if self._losses[task.number] < _LOSSES:
                self._alone.append(task)
            else:
                self._keep([failure(task, "The process that worked on it was killed, twice.", again=True)])
