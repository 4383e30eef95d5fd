"""Work on executors: order, progress, workers that are lost."""

import contextlib
import functools
import multiprocessing
import os
import sys
import threading
import time
import warnings
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from unittest.mock import MagicMock

import pytest
from batch_functions import kill_itself, name_of, once_killed
from refusals import refuses
from tables import each

from projdist import Box
from projdist.support.executors import Processes, check_executor, is_lost, open_executor, own_executor, run_all


def square(number):
    return number * number


@each("make", [lambda: None, lambda: ThreadPoolExecutor(2), lambda: ProcessPoolExecutor(2)])
def test_order_and_progress(make):
    """Results in the order of the tasks, whatever runs them, and progress that counts each once."""
    heard, executor = [], make()
    with executor or contextlib.nullcontext():
        assert run_all(executor, square, range(20), heard.append) == [n * n for n in range(20)]
    assert heard == list(range(1, 21))


def test_a_lost_worker_loses_nothing(tmp_path):
    """A pool whose process is killed half-way is broken; what it had not done is done here."""
    boxes = [Box(0, 0, east, 1) for east in range(1, 31)]
    fragile = functools.partial(once_killed, trap=str(tmp_path / "trap"), at=boxes[0].name)
    with ProcessPoolExecutor(2) as pool:
        assert run_all(pool, fragile, boxes) == [*map(name_of, boxes)]


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="needs processes that are forked")
def test_threads_of_libraries_are_no_matter(monkeypatch):
    """As jemalloc's, which pandas starts: from Python 3.12 on a fork beside a thread brings a warning."""
    monkeypatch.setattr("projdist.support.executors._cores", lambda: 2)
    monkeypatch.setattr("projdist.support.executors.threading.active_count", lambda: 1)
    held = threading.Lock()
    with held:
        thread = threading.Thread(target=held.acquire, daemon=True)
        thread.start()
        with warnings.catch_warnings(record=True) as told, own_executor(100) as pool:
            warnings.simplefilter("always")
            assert run_all(pool, square, range(20)) == [n * n for n in range(20)]
    thread.join()
    assert told == []


class Lossy(Executor):
    """An executor that loses each of its first tasks with a worker, and counts what it runs and what it is given."""

    def __init__(self, losses, error=CancelledError):
        self.losses, self.error, self.given, self.ran = losses, error, 0, []

    def submit(self, function, *arguments):
        """Lose the task, or do it at once."""
        future = Future()
        self.given += 1
        if self.given <= self.losses:
            future.set_exception(self.error())
        else:
            self.ran += arguments
            future.set_result(function(*arguments))
        return future


@each("error", [CancelledError, BrokenExecutor])
@each("rounds", [1, 3])
def test_lost_tasks_are_done_again_by_the_executor(rounds, error):
    """Three times what is lost goes to other workers, and only that: here nothing has to be done."""
    executor, here = Lossy(5 * rounds - 2, error), []

    def noted(number):
        here.append(number)
        return square(number)

    assert run_all(executor, noted, range(5)) == [0, 1, 4, 9, 16]
    assert sorted(executor.ran) == sorted(here) == list(range(5))
    assert executor.given == 5 * rounds + 3


def test_what_is_always_lost_is_done_here():
    """After the first try and three more this process does the work; an error of a task is no loss, and raised."""
    executor = Lossy(100)
    assert run_all(executor, square, range(5)) == [0, 1, 4, 9, 16]
    assert (executor.given, executor.ran) == (20, [])
    with ThreadPoolExecutor(2) as pool, pytest.raises(TypeError):
        run_all(pool, square, ["x"])


WRONG = "dask dask:// dask://host tcp://host:8786 dask://host:port 4 processes:0 processes:x processes:99999".split()


def test_addresses_and_numbers_of_processes(monkeypatch):
    """As Dask takes them, also of IPv6; without a number as many as this process may use cores."""
    for text in WRONG:
        refuses(r"^Invalid executor '.*'. It must be dask://HOST:PORT", check_executor, text)
    assert check_executor("dask://localhost:8786") == "tcp://localhost:8786"
    assert check_executor("dask://[::1]:8786/") == "tcp://[::1]:8786"
    assert check_executor("processes:12") == 12
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 2, 3}, raising=False)
    assert check_executor("processes") == 3


@pytest.mark.slow
def test_processes_that_are_lost_take_nothing_else_along():
    """The task of one that is killed is lost, that of the other is not, and the next finds another process."""
    with open_executor("processes:2") as executor:
        other, killed = executor.submit(time.sleep, 1.0), executor.submit(kill_itself)
        assert is_lost(killed.exception())
        assert not other.done()
        assert other.result() is None
        assert [executor.submit(pow, n, 2).result() for n in range(4)] == [0, 1, 4, 9]


@pytest.mark.slow
def test_processes_end_with_an_error():
    """Nobody waits for what they were doing."""
    others, start = multiprocessing.active_children(), time.monotonic()

    def interrupted():
        with open_executor("processes:2") as executor:
            executor.submit(os.getpid).result()
            for _ in range(2):
                executor.submit(time.sleep, 60.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - start < 30.0
    assert set(multiprocessing.active_children()) <= set(others)


def test_a_cluster_is_asked_for_an_executor(monkeypatch):
    """At its address, with so many retries; the connection ends with the work. Without Dask a line says what to do."""
    dask = MagicMock()
    client = dask.Client.return_value.__enter__.return_value
    monkeypatch.setitem(sys.modules, "distributed", dask)
    with open_executor("dask://localhost:8786") as executor:
        assert executor is client.get_executor.return_value
        assert not dask.Client.return_value.__exit__.called
    dask.Client.assert_called_once_with("tcp://localhost:8786", timeout="10s", set_as_default=False)
    client.get_executor.assert_called_once_with(pure=False, retries=3)
    assert dask.Client.return_value.__exit__.called
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"^Invalid executor 'dask://localhost:1'. It needs Dask: pip install"):
        open_executor("dask://localhost:1").__enter__()


@pytest.mark.slow
def test_processes_start_no_threads_beside_each_other():
    """NumPy's library is told so before it is loaded, unless the user has said how many threads there are to be."""
    usual = os.environ.get("OPENBLAS_NUM_THREADS", "1")
    with Processes(1) as pool:
        assert run_all(pool, os.getenv, ["OPENBLAS_NUM_THREADS"]) == [usual]
