"""Parallel work on any executor of `concurrent.futures`, a pool of processes, or a Dask cluster."""

import contextlib
import multiprocessing
import os
import pickle
import re
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, as_completed
from contextvars import ContextVar
from multiprocessing.connection import wait
from typing import Any, ParamSpec, TypeVar, cast

from projdist.support.checks import quoted
from projdist.support.signals import default_signals

Task = TypeVar("Task")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

_FEW = 24  # so many tasks take less time than starting processes
_RETRIES = 3
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")  # of the libraries that NumPy uses
_ADDRESS = re.compile(r"dask://([^/\s:]+|\[[^\]\s]+\]):(\d{1,5})/?")
_NUMBER = re.compile(r"processes(?::([1-9]\d{0,3}))?")

_NO_PROCESSES: ContextVar[bool] = ContextVar("no_processes", default=False)


# ---- by name --------------------------------------------------------------------------------


def check_executor(given: Any) -> str | int | None:
    """Address of `dask://HOST:PORT`, or number of `processes:N`; None for an executor itself; raises ValueError."""
    if hasattr(given, "submit"):
        return None
    text = given.strip() if isinstance(given, str) else ""
    address, number = _ADDRESS.fullmatch(text), _NUMBER.fullmatch(text)
    if address:
        return f"tcp://{address[1]}:{address[2]}"
    if not number:
        raise ValueError(
            f"Invalid executor {quoted(given)}. It must be dask://HOST:PORT, the address of a Dask scheduler, "
            "processes:N, or an executor of concurrent.futures."
        )
    return int(number[1] or _cores())


@contextlib.contextmanager
def open_executor(given: Executor | str) -> Iterator[Executor]:
    """The executor, also by name; raises ValueError, ImportError without Dask, OSError if no cluster answers."""
    address = check_executor(given)
    if address is None:
        yield cast(Executor, given)
        return
    if isinstance(address, int):
        with Processes(address) as processes:
            yield processes
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError(f"Invalid executor '{given}'. It needs Dask: pip install 'projdist[dask]'.") from error
    with Client(address, timeout="10s", set_as_default=False) as client:
        yield client.get_executor(pure=False, retries=_RETRIES)


@contextlib.contextmanager
def own_executor(tasks: int) -> Iterator[Executor | None]:
    """A pool with one process per core; None where a pool would be slower or unsafe."""
    # Processes are forked: spawned ones would run the caller's script again unless it is guarded. Threads do not help,
    # since PROJ's database is read under Python's lock.
    cores = _cores()
    forks = "fork" in multiprocessing.get_all_start_methods() and threading.active_count() == 1
    if tasks <= _FEW or cores == 1 or not forks or _NO_PROCESSES.get():
        yield None
        return
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(cores, multiprocessing.get_context("fork"), initializer=default_signals) as pool:
        try:
            # No Python thread runs. Threads of libraries, of which Python 3.12 warns, are safe to fork: OpenBLAS stops
            # its own before, and jemalloc, which comes with pyarrow, handles its locks.
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", r".*is multi-threaded, use of fork", DeprecationWarning)
                pool.submit(os.getpid)  # starts the processes
            yield pool
        except BaseException:  # also Ctrl-C: terminate workers without waiting
            _end_all_but(others)
            raise


@contextlib.contextmanager
def without_processes() -> Iterator[None]:
    """Context in which `own_executor` returns None, for workers that each have one core."""
    token = _NO_PROCESSES.set(True)
    try:
        yield
    finally:
        _NO_PROCESSES.reset(token)


def _cores() -> int:
    """Number of cores available to this process; 1 if unknown."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1


def _end_all_but(others: Sequence[multiprocessing.process.BaseProcess]) -> None:
    """Terminate child processes other than `others`."""
    for process in multiprocessing.active_children():
        if process not in others:
            process.terminate()


# ---- processes that may be lost -------------------------------------------------------------


class Processes(Executor):
    """Worker processes; a lost one loses only its own tasks and is replaced.

    Each is a pool of one: in a larger pool of the standard library or of loky one lost process breaks all tasks.
    They are forked from a clean server process, not from this one, which has threads, so that scripts must be guarded
    by `if __name__ == "__main__"`. They end when this process ends, for whatever reason.
    """

    def __init__(self, number: int) -> None:
        methods = multiprocessing.get_all_start_methods()
        self._context: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        self._others = multiprocessing.active_children()
        self._lock = threading.Lock()
        self.number = number
        self._pools = [self._pool() for _ in range(number)]
        self._waiting = [0] * number

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> Future[Result]:
        """Submit a call to the process with the fewest tasks."""

        def count_down(_: object) -> None:
            with self._lock:
                self._waiting[place] -= 1

        with self._lock:
            place = min(range(len(self._pools)), key=self._waiting.__getitem__)
            try:
                future = self._pools[place].submit(fn, *args, **kwargs)
            except BrokenExecutor:
                self._pools[place].shutdown(wait=False)
                self._pools[place] = self._pool()
                future = self._pools[place].submit(fn, *args, **kwargs)
            self._waiting[place] += 1
        future.add_done_callback(count_down)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes once their tasks are done."""
        for pool in self._pools:
            pool.shutdown(wait=wait, cancel_futures=cancel_futures)

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        """On error or Ctrl-C, terminate workers without waiting."""
        if kind is not None:
            _end_all_but(self._others)
        self.shutdown(cancel_futures=kind is not None)

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, self._context, initializer=_begin)


def _begin() -> None:
    """Initialise a worker of `Processes`, which ends silently on signals and with its parent process."""
    default_signals()
    for name in _THREADS:  # NumPy, loaded later, must not start threads: each core has a process
        os.environ.setdefault(name, "1")
    parent = multiprocessing.parent_process()
    if parent is not None:
        sentinel = parent.sentinel

        def end_with_parent() -> None:
            wait([sentinel])
            os._exit(1)

        threading.Thread(target=end_with_parent, daemon=True).start()


def places_in(executor: Executor) -> int:
    """Number of tasks to submit at a time: one per process of `Processes`, two per worker of others."""
    if isinstance(executor, Processes):
        return executor.number
    client = getattr(executor, "_client", None)  # Dask's, whose number of workers changes
    if client is None:
        return 2 * getattr(executor, "_max_workers", _cores())
    if client.status not in ("running", "connecting"):
        raise ConnectionError("The connection to the scheduler is closed.")
    return 2 * max(sum(client.nthreads().values()), 1)


def is_lost(error: BaseException | None) -> bool:
    """True if an error means that a task was lost with its worker."""
    distributed = sys.modules.get("distributed")
    killed = () if distributed is None else (distributed.KilledWorker,)
    return isinstance(error, (BrokenExecutor, CancelledError, *killed))


@contextlib.contextmanager
def answering() -> Iterator[None]:
    """Context that raises ConnectionError if the executor was shut down or its cluster is gone."""
    client = getattr(sys.modules.get("distributed"), "client", None)
    closed = getattr(client, "ClosedClientError", OSError)  # missing in older versions of Dask
    try:
        yield
    except BrokenExecutor:
        raise
    except (OSError, RuntimeError, closed) as error:
        raise ConnectionError("The executor does not answer any more.") from error


# ---- results in order -----------------------------------------------------------------------


def is_picklable(value: object) -> bool:
    """True if a value can be sent to another process."""
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
    """Results of a function for each task, in order; `progress` is called with the number of finished tasks."""
    # Tasks lost with a worker are repeated by another worker, or by this process if the executor is broken.
    results: dict[int, Result] = {}

    def keep(index: int, result: Result) -> None:
        results[index] = result
        if progress is not None:
            progress(len(results))

    tries = 0
    while executor is not None and tries <= _RETRIES and len(results) < len(tasks):
        tries += 1
        futures: dict[Future[Result], int] = {}
        with contextlib.suppress(BrokenExecutor):
            for index, task in enumerate(tasks):
                if index not in results:
                    futures[executor.submit(function, task)] = index
        for future in as_completed(futures):
            with contextlib.suppress(BrokenExecutor, CancelledError):
                keep(futures[future], future.result())
        if not futures:  # the executor is broken
            break
    for index, task in enumerate(tasks):
        if index not in results:
            keep(index, function(task))
    return [results[index] for index in range(len(tasks))]
