"""Work on executors: order, progress, workers that are lost."""

import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from batch_functions import kill_itself
from dask_clusters import dask_cluster
from tables import each

from projdist.decisions.recommendation import recommend
from projdist.support.executors import Processes, check_executor, is_lost, open_executor, own_executor, run_all


def square(number):
    return number * number


def fragile(task):
    """The square of a number; the first to come ends its worker."""
    number, trap = task
    try:
        os.close(os.open(trap, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return number * number
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


@pytest.mark.parametrize("make", [lambda: None, lambda: ThreadPoolExecutor(2), lambda: ProcessPoolExecutor(2)])
def test_order_and_progress(make):
    """Results in the order of the tasks, whatever runs them, and progress that counts each once."""
    heard = []
    executor = make()
    assert run_all(executor, square, range(20), heard.append) == [n * n for n in range(20)]
    assert heard == list(range(1, 21))
    if executor is not None:
        executor.shutdown()


def test_a_lost_worker_loses_nothing(tmp_path):
    """A pool whose process is killed half-way is broken; what it had not done is done here."""
    with ProcessPoolExecutor(2) as pool:
        assert run_all(pool, fragile, [(n, str(tmp_path / "trap")) for n in range(30)]) == [n * n for n in range(30)]


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


@pytest.mark.parametrize("error", [CancelledError, BrokenExecutor])
@pytest.mark.parametrize("rounds", [1, 3])
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


@each("text", WRONG)
def test_wrong_addresses(text):
    """One line for what is no address."""
    with pytest.raises(ValueError, match=r"^Invalid executor '.*'. It must be dask://HOST:PORT"):
        check_executor(text)


def test_addresses_and_numbers_of_processes(monkeypatch):
    """As Dask takes them, also of IPv6; without a number as many as this process may use cores."""
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
            executor.submit(time.sleep, 60.0)
            executor.submit(time.sleep, 60.0)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - start < 30.0
    assert set(multiprocessing.active_children()) <= set(others)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_dask(tmp_path):
    """A cluster of two workers, of which one is killed half-way, recommends what this process does."""
    pytest.importorskip("distributed")
    killed = []
    region = "box:5.9,47.3,15.0,55.1"
    with dask_cluster(tmp_path) as (address, workers), open_executor(address) as executor:

        def kill(done, total):
            if done > 20 and not killed:
                workers[0].kill()
                killed.append(done)

        spread = recommend(region, authorities=["EPSG"], limit=5, executor=executor, progress=kill)
    assert killed
    assert spread.to_dict() == recommend(region, authorities=["EPSG"], limit=5).to_dict()


def test_a_cluster_is_asked_for_an_executor(monkeypatch):
    """At its address, with so many retries; the connection ends with the work. Without Dask a line says what to do."""
    asked = []

    class Client:
        def __init__(self, address, **options):
            asked.append((address, options))

        def __enter__(self):
            return self

        def __exit__(self, *_):
            asked.append("ended")

        def get_executor(self, **options):
            """As Dask has it."""
            asked.append(options)
            return "executor"

    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=Client))
    with open_executor("dask://localhost:8786") as executor:
        assert executor == "executor"
        assert asked[-1] == {"pure": False, "retries": 3}
    assert asked[0] == ("tcp://localhost:8786", {"timeout": "10s", "set_as_default": False})
    assert asked[-1] == "ended"
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"^Invalid executor 'dask://localhost:1'. It needs Dask: pip install"):
        open_executor("dask://localhost:1").__enter__()


@pytest.mark.slow
def test_processes_start_no_threads_beside_each_other():
    """NumPy's library is told so before it is loaded, unless the user has said how many threads there are to be."""
    usual = os.environ.get("OPENBLAS_NUM_THREADS", "1")
    with Processes(1) as pool:
        assert run_all(pool, os.getenv, ["OPENBLAS_NUM_THREADS"]) == [usual]
