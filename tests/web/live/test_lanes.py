"""Workers answer the newest request, end what takes too long or is not wanted, and outlive their processes."""

import json
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from live_pages import Hearing, Traps, ended, is_running, wanted, worker

from projdist.web.live.dispatcher import Request
from projdist.web.live.worker import MOST_OF_PAGE, Worker

_GROWTH = 16_000  # kB, of which what is allocated and freed again keeps some

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="groups of processes of Unix")


def waited_for(path: Path) -> str:
    """The text of a file, once it is there."""
    deadline = time.monotonic() + 60.0
    while not (path.exists() and path.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return path.read_text()


def test_the_newest_of_each_map_is_answered() -> None:
    """Older ones that wait are dropped; each map keeps its turn, however often it is asked for."""
    told = Hearing()
    with worker(Traps()) as found:
        found.ask("page", "a", wanted(1, "sleep:0.5"), told)
        while found._running is None:
            time.sleep(0.01)
        for number in (2, 4, 6):
            found.ask("page", "a", wanted(number), told)
            found.ask("page", "b", wanted(number + 1), told)
        assert [told.next()["id"] for _ in range(3)] == [1, 6, 7]
        assert told.blocks.empty()


@pytest.mark.slow
def test_what_takes_too_long_is_stopped() -> None:
    """With its process; the next request has another one."""
    told = Hearing()
    with worker(Traps(), limit=0.5) as found:
        found.ask("page", "a", wanted(1), told)
        assert "problem" not in told.next()
        first = found.pid
        found.ask("page", "a", wanted(2, "sleep:600"), told)
        assert told.next()["problem"] == "This took more than 0.5 seconds and was stopped."
        assert not is_running(first)
        found.ask("page", "a", wanted(3), told)
        assert (told.next()["id"], found.pid != first) == (3, True)


@pytest.mark.slow
def test_what_nobody_foresaw_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """In one line on the page, with its trace once in the log, which is standard error's; the worker goes on."""
    told = Hearing()
    with worker(Traps()) as found:
        found.ask("page", "a", wanted(1, "fall"), told)
        problem = told.next()["problem"]
        found.ask("page", "a", wanted(2), told)
        assert "problem" not in told.next()
    assert problem.startswith("This failed, and should not have")
    assert "\n" not in problem
    error = capsys.readouterr().err
    assert error.count("Traceback (most recent call last)") == 1
    assert error.endswith("LookupError: nobody foresaw this\n\n")


@pytest.mark.slow
def test_a_request_whose_process_is_killed_is_answered(tmp_path: Path) -> None:
    """By another process, once; the page notices a pause."""
    told = Hearing()
    with worker(Traps(folder=str(tmp_path))) as found:
        found.ask("page", "a", wanted(1, "killed-once"), told)
        assert told.next()["texts"]
        found.ask("page", "a", wanted(2, "killed"), told)
        assert told.next()["problem"] == "The process that works on this ended twice. Try another map."
        found.ask("page", "a", wanted(3), told)
        assert "problem" not in told.next()


@pytest.mark.slow
def test_a_process_that_is_killed_while_it_waits_is_replaced() -> None:
    """Nobody notices."""
    told = Hearing()
    with worker() as found:
        found.ask("page", "a", wanted(1), told)
        told.next()
        os.kill(found.pid, signal.SIGKILL)
        found.ask("page", "a", wanted(2), told)
        assert "problem" not in told.next()


@pytest.mark.slow
@pytest.mark.parametrize("how", ["drop", "close", "limit"])
def test_nothing_is_left_of_what_is_stopped(how: str, tmp_path: Path) -> None:
    """Neither the process nor those that it has forked; of what is dropped nothing is told."""
    told = Hearing()
    with worker(Traps(folder=str(tmp_path)), limit=1.0 if how == "limit" else 600.0) as found:
        found.ask("page", "a", wanted(1, "forks"), told)
        child = int(waited_for(tmp_path / "child"))
        pids = [found.pid, child]
        assert all(map(is_running, pids))
        if how != "limit":
            {"drop": lambda: found.drop("page", "a"), "close": found.close}[how]()
        assert ended(pids, 1.0 if how != "limit" else 6.0)
        if how == "drop":
            found.ask("page", "b", wanted(2), told)
            assert told.next()["id"] == 2


@pytest.mark.slow
def test_nothing_is_left_of_what_was_killed(tmp_path: Path) -> None:
    """Processes that a killed one had forked hold its end of the connection open, and end, too."""
    told = Hearing()
    with worker(Traps(folder=str(tmp_path))) as found:
        found.ask("page", "a", wanted(1, "forks-and-dies"), told)
        assert "ended twice" in told.next()["problem"]
        assert ended([int((tmp_path / "child").read_text())])


@pytest.mark.slow
@pytest.mark.parametrize("opened", ["robinson", "+proj=merc +nadgrids=x.gsb"])
def test_processes_have_proj_without_the_users_files(
    opened: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor a network, unless he has named a file; the page's own process keeps what it has."""
    monkeypatch.setenv("PROJ_NETWORK", "ON")
    monkeypatch.setenv("PROJ_USER_WRITABLE_DIRECTORY", str(tmp_path))
    before, told = dict(os.environ), Hearing()
    with worker(Traps(frozenset({opened}))) as found:
        found.ask("page", "a", wanted(1, "proj"), told)
        network, folder = json.loads(told.next()["problem"])
    assert (network, folder == str(tmp_path)) == ((False, False) if opened == "robinson" else (True, True))
    assert dict(os.environ) == before


def test_pages_have_their_turns() -> None:
    """A page that asks for thousands of maps is answered some, and told why no more; another one waits for two."""
    told = Hearing()
    with worker(Traps()) as found:
        found.ask("first", "map", wanted(0, "sleep:0.5"), told)
        while found._running is None:
            time.sleep(0.01)
        for number in range(1, 3000):
            found.ask("first", f"map{number}", wanted(number), told)
        found.ask("second", "map", wanted(5000), told)
        heard = [told.next() for _ in range(3001)]
        assert told.blocks.empty()
    problems = [one["problem"] for one in heard if "problem" in one]
    assert len(problems) == 2999 - MOST_OF_PAGE
    assert set(problems) == {
        "Invalid request. This page has 48 others that wait, and may not have more: ask again when some are answered."
    }
    assert [one["id"] for one in heard if "problem" not in one] == [0, 1, 5000, *range(2, MOST_OF_PAGE + 1)]


@pytest.mark.slow
def test_closed_pages_drop_their_requests_only() -> None:
    """Others are answered."""
    told, gone = Hearing(), Hearing()
    with worker(Traps()) as found:
        found.ask(1, "a", wanted(1, "sleep:0.3"), told)
        found.ask(2, "a", wanted(2), gone)
        found.ask(1, "b", wanted(3), told)
        found.leave(2)
        assert [told.next()["id"], told.next()["id"]] == [1, 3]
        assert gone.blocks.empty()


def test_a_lane_without_requests_is_closed() -> None:
    """At any time, and twice."""
    before = threading.active_count()
    found = Worker("preview", Traps())
    found.close()
    found.close()
    assert found.pid is None
    assert threading.active_count() == before


def kilobytes(pid: int) -> int:
    """What a process has of the memory."""
    return int(subprocess.run(["ps", "-o", "rss=", "-p", str(pid)], capture_output=True, text=True, check=True).stdout)


@pytest.mark.slow
def test_memory_stays_as_it_is() -> None:
    """Over hundreds of previews and tens of pictures of maps that are dragged, after what is kept has filled."""
    told, random = Hearing(), np.random.default_rng(1)
    regions = ["globe", "country:DE", "box:170,-50,-170,-30", "cap:15,50,500"]

    def answer(kind: str, number: int, region: str) -> None:
        name = ["robinson", "mollweide", "winkel-tripel", "+proj=laea +R=6371000", "+proj=lcc +lat_1=30 +lat_2=60"][
            number % 5
        ]
        centre = float(random.uniform(-180, 180)), float(random.uniform(-60, 60))
        found.ask("page", kind, Request(id=number, kind=kind, projection=name, region=region, centre=centre), told)
        assert told.next()["id"] == number

    with worker() as found:
        sizes = []
        for count in (100, 600):
            for number in range(count):
                answer("preview", number, regions[number % 4])
            sizes.append(kilobytes(found.pid))
        assert sizes[1] - sizes[0] < _GROWTH
        for count in (30, 40):
            for number in range(count):
                answer("picture", number, regions[1 + number % 3])
            sizes.append(kilobytes(found.pid))
        assert sizes[3] - sizes[2] < _GROWTH
