"""Batches: a function of many regions, or of many maps over them, on any executor, with results kept in a file."""

from __future__ import annotations

import contextlib
import json
import math
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from projdist import __version__, support
from projdist.answers.batch_tasks import Area, Done, Job, Task, areas_of, failure, map_text, run_tasks
from projdist.projections import Projection, ProjectionError, ProjectionLike, listed_projections
from projdist.regions import RegionLike, ground_of_maps


@dataclass(frozen=True, kw_only=True)
class BatchResult(support.Record):
    """The answer of a function for a region, or for a map over it."""

    region: str = field(metadata=support.HIDDEN)
    area_km2: float = field(metadata=support.HIDDEN)
    projection: str | None = field(metadata=support.schema(optional=True))
    answer: Any  # as in JSON
    rows: list[dict[str, Any]] = field(metadata=support.HIDDEN)  # of the answer as a frame
    notices: tuple[str, ...]  # warnings

    def to_dict(self) -> dict[str, Any]:
        """`{"region": {"name", "area_km2"}, "projection", "answer", "notices"}`, the map if there is one."""
        return {"region": {"name": self.region, "area_km2": self.area_km2}} | super().to_dict()


@dataclass(frozen=True)
class BatchFailure(support.Record):
    """A region, or a map over it, without an answer, and the error; tried again later if `lost` with its process."""

    region: str
    projection: str | None = field(metadata=support.schema(optional=True))
    error: str
    lost: bool = field(default=False, metadata=support.HIDDEN)

    @property
    def line(self) -> str:
        """The region and the map, and the error."""
        what = self.region if self.projection is None else f"{self.projection} over {self.region}"
        return f"{what}: {self.error}"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Batch(support.Answer):
    """Answers for many regions, in their order, and failures; a frame has the rows of all, with the region first."""

    function: str
    results: tuple[BatchResult, ...]
    failures: tuple[BatchFailure, ...]

    def _line(self) -> str:
        return f"{self.function}, {len(self.results)} results, {len(self.failures)} failures"

    def _table(self) -> list[dict[str, Any]]:
        return [{"region": result.region, **row} for result in self.results for row in result.rows]


def batch(
    function: Callable[..., object],
    regions: RegionLike | Iterable[RegionLike | Area] = "countries",
    projections: ProjectionLike | Iterable[ProjectionLike] | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    executor: Executor | str | None = None,
    partial: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Batch:
    """Apply a function to each of many regions, or to each of several maps over each region.

    A task that fails is among the `failures`, and the others go on; tasks lost with a worker are repeated once.

    Parameters
    ----------
    function : callable
        `function(region, **options)`, or `function(projection, region, **options)` with projections, as
        `projdist.summarize`; for other processes one that can be imported. It returns an answer or a value for JSON.
    regions : RegionLike, or a list of them
        `"countries"`, `"continents"`, `"areas"`, `"states"`, a file or frame of them, or anything that `get_region`
        takes, except points.
    projections : ProjectionLike or iterable of ProjectionLike, optional
        Anything that `Projection.from_user_input` takes and that has a text, which is sent to workers: no function.
    options : mapping, optional
        Arguments by name: texts, numbers, and lists of them.
    executor : concurrent.futures.Executor or str, optional
        `"processes:N"`, `"processes"` (one per core), `"dask://HOST:PORT"`, or any executor; by default this process.
        A script that uses processes must guard itself by `if __name__ == "__main__"`.
    partial : path, optional
        JSON lines to which results are added as they come; if it exists, from the same job, the rest is computed.
    progress : callable, optional
        Called with the number of results and the number of tasks.

    Returns
    -------
    Batch
        The `results` in the order of the regions, and for each of the maps, and the `failures`.

    Raises
    ------
    ValueError
        For an unknown region, options that are no text or numbers, or a partial file of another job.
    ImportError, OSError
        Without Dask; if nothing answers, also later (ConnectionError); if the partial file cannot be written.

    References
    ----------
    JSON Lines, https://jsonlines.org

    Examples
    --------
    The error of Mercator's map over each of two bands of ten degrees:

    >>> bands = ["box:0,0,10,10", "box:0,40,10,50"]
    >>> from projdist.answers import summarize
    >>> found = batch(summarize, bands, ["mercator"], options={"tolerance": 1e-6})
    >>> [round(one.answer["airy_kavrayskiy"], 3) for one in found.results]
    [0.01, 0.495]
    """
    if not callable(function) or not hasattr(function, "__qualname__"):
        raise ValueError(
            f"Invalid function {support.quoted(function)} of a batch. It must be one of a module; see options."
        )
    given = {} if options is None else options
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise ValueError(f"Invalid options {support.quoted(given)} of a batch. They must be arguments by name.")
    job = Job(function, dict(given))
    tasks = _tasks(regions, projections)
    header = job.header(tasks, __version__)
    if executor is not None:
        support.check_executor(executor)
    if executor is not None and not support.is_picklable(job):
        raise ValueError(
            f"Invalid function {support.quoted(job.name)} of a batch. Other processes must be able to import it."
        )
    path = None if partial is None else support.check_path("partial file", partial)
    results: dict[int, dict[str, Any]] = {}
    with open_partial(path, header) if path is not None else contextlib.nullcontext() as file:
        if file is not None:
            results |= file.done

        def keep(lines: Sequence[str]) -> None:
            if file is not None:
                file.append(lines)
            found = map(json.loads, lines)
            results.update((one["task"], one) for one in found)
            if progress is not None:
                progress(len(results), len(tasks))

        if progress is not None and results:
            progress(len(results), len(tasks))
        run_job(job, [task for task in tasks if task.number not in results], executor, keep)
    done: list[BatchResult] = []
    failed: list[BatchFailure] = []
    for task in tasks:
        found = results[task.number]
        if "error" in found:
            failed.append(BatchFailure(task.name, task.projection, found["error"], found.get("again", False)))
        else:
            answer = {key: found[key] for key in ("area_km2", "answer", "rows")}
            notices = tuple(found["notices"])
            done.append(BatchResult(region=task.name, projection=task.projection, notices=notices, **answer))
    return Batch(function=job.name, results=tuple(done), failures=tuple(failed))


def _tasks(regions: Any, projections: Any) -> list[Task]:
    """The tasks, those of a region in succession, as they share computations; unknown maps fail in their tasks."""
    given: list[Any] = [None] if projections is None else [*listed_projections(projections)]
    texts = [None if one is None else map_text(one) for one in given]
    ellipsoid = None
    if projections is not None:  # all regions are on one ellipsoid
        maps: list[Projection] = []
        for one in given:
            with contextlib.suppress(ProjectionError):
                maps.append(Projection.from_user_input(one))
        ground = ground_of_maps(maps)
        ellipsoid = ground.a, ground.f
    pairs = ((area, text) for area in areas_of(regions) for text in texts)
    return [Task(number, area.name, area.text, text, ellipsoid) for number, (area, text) in enumerate(pairs)]


# ---- the file of results ---------------------------------------------------------------------------

_SYNC = 1.0  # seconds; a cluster sends hundreds of lines a second, and syncing each would take most of the time
_MARK = b'{"projdist": '  # beginning of every such file


@dataclass
class PartialFile:
    """An open file of results: those already in it, `done`, and the time when it was last `synced` with the disk."""

    file: FileIO
    done: dict[int, dict[str, Any]]
    synced: float = field(default_factory=time.monotonic)

    def append(self, lines: Sequence[str]) -> None:
        """Write lines of results; from time to time also to the disk, in case the machine stops."""
        self.file.write("".join(f"{line}\n" for line in lines).encode("ascii"))
        if time.monotonic() - self.synced > _SYNC:
            os.fsync(self.file.fileno())
            self.synced = time.monotonic()


@contextlib.contextmanager
def open_partial(path: str | os.PathLike[str], header: Mapping[str, Any]) -> Iterator[PartialFile]:
    """The file of a job, new or as it was left; raises ValueError for any other or one in use, and OSError."""
    path = Path(path)
    if support.is_stream(path):
        raise _refused(path, "It is a device or a pipe, which keeps nothing.")
    with open(path, "ab+", buffering=0) as file:
        with contextlib.suppress(ImportError):  # on Windows
            import fcntl

            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise _refused(path, "Another process is writing it.") from error
        file.seek(0)
        text = file.read()
        whole = text[: text.rfind(b"\n") + 1]
        if not whole and not _MARK.startswith(text[: len(_MARK)]):
            raise _refused(path, "It is none; take another name.")
        done = _results(whole, header, path)
        if len(whole) < len(text):
            file.truncate(len(whole))
        partial = PartialFile(file, done)
        if not whole:
            partial.append([json.dumps(header)])
        yield partial


def _refused(path: Path, text: str) -> ValueError:
    return ValueError(f"Invalid partial file {support.quoted(str(path))}. {text}")


def _results(text: bytes, header: Mapping[str, Any], path: Path) -> dict[int, dict[str, Any]]:
    """Results of complete lines by number of task, except those to be repeated."""
    lines = text.splitlines()
    if not lines:
        return {}
    found = _parsed(lines[0], path, 1) if lines[0].startswith(_MARK) else {}
    if "digest" not in found:
        raise _refused(path, "It is none; take another name.")
    if found["digest"] != header["digest"]:
        words = {"projdist": "of another version of projdist", "PROJ": "with another version of PROJ"}
        words |= {"function": "of another function", "options": "with other options"}
        how = next((words[key] for key in words if found.get(key) != header[key]), "of other regions or maps")
        raise _refused(path, f"It belongs to another job, {how}. Take another name, or remove it.")
    results = [_parsed(line, path, number) for number, line in enumerate(lines[1:], start=2)]
    return {result["task"]: result for result in results if not result.get("again")}


def _parsed(line: bytes, path: Path, number: int) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError as error:
        raise _refused(path, f"Its line {number} is damaged.") from error
    if not isinstance(found, dict) or (number > 1 and not isinstance(found.get("task"), int)):
        raise _refused(path, f"Its line {number} is not a result.")
    return found


# ---- tasks on an executor ------------------------------------------------------------------------

_PAYS = 1.0  # seconds of work in a group of tasks, beside the milliseconds for sending it
_ASK = 2.0  # seconds between looks at the number of workers
_LARGEST = 100  # tasks in a group
_LOSSES = 2  # workers lost with a task, after which it is not repeated

Keep = Callable[[Sequence[str]], None]


def run_job(job: Job, tasks: Sequence[Task], executor: Executor | str | None, keep: Keep) -> None:
    """Run tasks, and call `keep` with the lines of finished ones; in this process without an executor."""
    with contextlib.ExitStack() as stack:
        opened = ThreadPoolExecutor(1) if executor is None else support.open_executor(executor)
        _Run(job, tasks, stack.enter_context(opened), keep, stack).run()


class _Run:
    """The waiting and the running tasks of a job, and the time that a task takes."""

    def __init__(
        self, job: Job, tasks: Sequence[Task], executor: Executor, keep: Keep, stack: contextlib.ExitStack
    ) -> None:
        self._job, self._executor, self._keep, self._stack = job, executor, keep, stack
        self._waiting = deque(tasks)
        self._alone: deque[Task] = deque()  # of lost groups, each to be repeated in a group of its own
        self._losses: Counter[int] = Counter()
        self._under_way: dict[Future[Done], list[Task]] = {}
        self._ended: SimpleQueue[Future[Done]] = SimpleQueue()
        self._pace = math.inf  # seconds per task
        self._known_places, self._ask_again = 1, -math.inf

    def run(self) -> None:
        """Run all tasks; if that ends early, also by Ctrl-C, waiting ones do not begin."""
        try:
            while True:
                places = self._places()
                while len(self._under_way) < places and (group := self._next(places)):
                    self._submit(group)
                if not self._under_way:
                    return
                future = self._ended.get()
                self._finish(future, self._under_way.pop(future))
        finally:
            for future in self._under_way:
                future.cancel()

    def _places(self) -> int:
        """Number of groups to run at a time; the executor is asked again from time to time, as a cluster may grow."""
        if time.monotonic() >= self._ask_again:
            with support.answering():
                self._known_places = support.places_in(self._executor)
            self._ask_again = time.monotonic() + _ASK
        return self._known_places

    def _next(self, places: int) -> list[Task]:
        """The next group: large enough to pay, and small enough that all workers finish together."""
        if self._alone:
            return [self._alone.popleft()]
        share = math.ceil(len(self._waiting) / (2 * places))
        size = min(max(int(_PAYS / self._pace), 1), share, _LARGEST)
        return [self._waiting.popleft() for _ in range(size)]

    def _submit(self, group: list[Task]) -> None:
        try:
            with support.answering():
                future = self._executor.submit(run_tasks, self._job, group)
        except BrokenExecutor:  # for good: the caller's pool of processes
            number = max(support.places_in(self._executor) // 2, 1)
            self._executor = self._stack.enter_context(support.Processes(number))
            future = self._executor.submit(run_tasks, self._job, group)
        self._under_way[future] = group
        future.add_done_callback(self._ended.put)

    def _finish(self, future: Future[Done], group: list[Task]) -> None:
        """Keep the results of a group; repeat lost tasks alone, unless they were lost alone, too."""
        error = CancelledError() if future.cancelled() else future.exception()
        if error is None:
            lines, seconds = future.result()
            self._keep(lines)
            self._waiting.extendleft(reversed(group[len(lines) :]))
            pace = max(seconds / len(lines), 1e-6)
            self._pace = pace if self._pace == math.inf else 0.5 * (self._pace + pace)
        elif support.is_lost(error):
            for task in group:
                self._losses[task.number] += 1
                if self._losses[task.number] < _LOSSES:
                    self._alone.append(task)
                else:
                    self._keep([failure(task, "The process that worked on it was killed, twice.", again=True)])
        elif len(group) > 1:
            self._alone += group
        else:
            self._keep([failure(group[0], f"{type(error).__name__}: {error}")])
