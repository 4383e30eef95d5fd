"""Work spread over processes: any executor of `concurrent.futures`, a pool of our own, or a Dask cluster."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, as_completed
from typing import TypeVar

from projdist.support.signals import default_signals

__all__ = ["check_executor", "is_picklable", "open_executor", "own_executor", "run_all"]

Task = TypeVar("Task")
Result = TypeVar("Result")

_FEW = 24  # tasks that are done before another process has started
_RETRIES = 3


def check_executor(text: str) -> str:
    """`dask://HOST:PORT` as the address that Dask takes; raises ValueError."""
    match = re.fullmatch(r"dask://([^/\s:]+|\[[^\]\s]+\]):(\d{1,5})/?", text.strip())
    if not match:
        raise ValueError(f"Invalid executor '{text}'. It must be dask://HOST:PORT, the address of a Dask scheduler.")
    return f"tcp://{match[1]}:{match[2]}"


@contextlib.contextmanager
def open_executor(text: str) -> Iterator[Executor]:
    """The executor of `dask://HOST:PORT`; raises ValueError, ImportError without Dask, OSError without an answer."""
    address = check_executor(text)
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError(f"Invalid executor '{text}'. It needs Dask: pip install 'projdist[dask]'.") from error
    with Client(address, timeout="10s", set_as_default=False) as client:
        yield client.get_executor(pure=False, retries=_RETRIES)


@contextlib.contextmanager
def own_executor(tasks: int) -> Iterator[Executor | None]:
    """A pool with a process a core, or None where it would not pay or not be safe.

    Processes are forked: others would run the caller's script again, unless it guards itself
    against that. Threads would not help, since PROJ's database is read under Python's lock.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    forks = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    if tasks <= _FEW or cores == 1 or not forks:
        yield None
        return
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(cores, multiprocessing.get_context("fork"), initializer=default_signals) as pool:
        try:
            yield pool
        except BaseException:  # also Ctrl-C: nobody waits for what they do
            for process in multiprocessing.active_children():
                if process not in others:
                    process.terminate()
            raise


def is_picklable(value: object) -> bool:
    """Whether a value can be sent to another process."""
    try:
        pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        return False
    return True


def run_all(
    executor: Executor | None,
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    progress: Callable[[int], None] | None = None,
) -> list[Result]:
    """The results of a function of each task, in their order.

    What is lost with a worker is done again by another, and by this process where the executor
    itself is broken. `progress` hears of the number of tasks that are done.
    """
    results: dict[int, Result] = {}

    def keep(index: int, result: Result) -> None:
        results[index] = result
        if progress is not None:
            progress(len(results))

    if executor is not None:
        _run_on(executor, function, tasks, keep)
    for index, task in enumerate(tasks):
        if index not in results:
            keep(index, function(task))
    return [results[index] for index in range(len(tasks))]


def _run_on(
    executor: Executor,
    function: Callable[[Task], Result],
    tasks: Sequence[Task],
    keep: Callable[[int, Result], None],
) -> None:
    """Run tasks on an executor, those lost with a worker once more, until it takes no more."""
    waiting = list(range(len(tasks)))
    for _ in range(1 + _RETRIES):
        futures: dict[Future[Result], int] = {}
        with contextlib.suppress(BrokenExecutor):
            for index in waiting:
                futures[executor.submit(function, tasks[index])] = index
        for future in _finished(futures):
            with contextlib.suppress(BrokenExecutor, CancelledError):
                keep(futures[future], future.result())
                waiting.remove(futures[future])
        if not waiting or not futures:
            return


def _finished(futures: dict[Future[Result], int]) -> Iterator[Future[Result]]:
    """Futures as they are done."""
    yield from as_completed(futures)
