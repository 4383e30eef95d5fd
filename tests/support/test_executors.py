"""Work on executors: order, progress, workers that are lost."""

import os
import signal
import subprocess
import sys
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from pathlib import Path
from types import SimpleNamespace

import pytest

from projdist.decisions.recommendation.search import recommend
from projdist.support.executors import check_executor, open_executor, run_all


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
    """After the first try and three more this process does the work."""
    executor = Lossy(100)
    assert run_all(executor, square, range(5)) == [0, 1, 4, 9, 16]
    assert (executor.given, executor.ran) == (20, [])


def test_errors_of_tasks_are_raised():
    """Only what is lost is done again; an error is one."""
    with ThreadPoolExecutor(2) as pool, pytest.raises(TypeError):
        run_all(pool, square, ["x"])


@pytest.mark.parametrize("text", ["dask", "dask://", "dask://host", "tcp://host:8786", "dask://host:port", "4"])
def test_wrong_addresses(text):
    """One line for what is no address."""
    with pytest.raises(ValueError, match=r"^Invalid executor '.*'. It must be dask://HOST:PORT"):
        check_executor(text)


def test_addresses():
    """As Dask takes them, also of IPv6."""
    assert check_executor("dask://localhost:8786") == "tcp://localhost:8786"
    assert check_executor("dask://[::1]:8786/") == "tcp://[::1]:8786"


@pytest.fixture
def cluster(tmp_path):
    """A Dask scheduler and two workers in processes of their own: the address, and the workers."""
    pytest.importorskip("distributed")
    address_file = tmp_path / "scheduler.json"
    environment = os.environ | {"DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    common = ["--no-dashboard", "--scheduler-file", str(address_file)]

    def start(*words):
        command = [sys.executable, "-m", "distributed.cli." + words[0], *words[1:], *common]
        return subprocess.Popen(
            command, env=environment, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    processes = [start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")]
    worker = ("dask_worker", "--no-nanny", "--nthreads", "1", "--host", "127.0.0.1")
    processes += [start(*worker) for _ in range(2)]
    yield address_file, processes[1:]
    for process in processes:
        process.kill()  # a worker that is asked to end waits for its scheduler
        process.wait()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_dask(cluster):
    """A cluster of two workers, of which one is killed half-way, recommends what this process does."""
    import json
    import time

    address_file, workers = cluster
    for _ in range(300):
        if address_file.exists():
            break
        time.sleep(0.1)
    address = json.loads(Path(address_file).read_text())["address"].replace("tcp://", "dask://")
    killed = []

    def kill(done, total):
        if done > 20 and not killed:
            workers[0].kill()
            killed.append(done)

    region = "box:5.9,47.3,15.0,55.1"
    with open_executor(address) as executor:
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
