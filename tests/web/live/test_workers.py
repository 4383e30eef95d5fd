"""Workers answer the newest request in turn, end what takes too long, and outlive their processes."""

import json
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from live_pages import Hearing, Traps, ended, is_running, listed, until, wanted, worker

from projdist.web.live.dispatcher import Request
from projdist.web.live.worker import MOST_OF_ALL, MOST_OF_PAGE, RequestQueue, TooManyRequests, Worker

_GROWTH = 16_000  # kB, of which what is allocated and freed again keeps some
pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="groups of processes of Unix")


@pytest.fixture
def told() -> Hearing:
    return Hearing()


@pytest.fixture(scope="module")
def shared() -> Iterator[Worker]:
    """A worker whose process several tests share."""
    with worker(Traps()) as found:
        yield found


TWICE = "The process that works on this ended twice. Try another map."


def occupy(found: Worker, page: str, told: Hearing) -> None:
    """Let a worker sleep, so that further requests wait."""
    found.ask(page, "map", wanted(0, "sleep:0.5"), told)
    assert until(lambda: found._running)


@pytest.mark.slow
def test_the_newest_of_each_map_is_answered(shared: Worker, told: Hearing) -> None:
    """Older ones that wait are dropped; each map keeps its turn, however often it is asked for."""
    occupy(shared, "page", told)
    for number in (2, 4, 6):
        shared.ask("page", "a", wanted(number), told)
        shared.ask("page", "b", wanted(number + 1), told)
    assert [told.next()["id"] for _ in range(3)] == [0, 6, 7]
    assert told.blocks.empty()


@pytest.mark.slow
def test_what_takes_too_long_is_stopped(told: Hearing) -> None:
    with worker(Traps(), limit=0.5) as found:
        assert "problem" not in told.ask(found, 1)
        first = found.pid
        assert told.ask(found, 2, "sleep:600")["problem"] == "This took more than 0.5 seconds and was stopped."
        assert not is_running(first)
        assert (told.ask(found, 3)["id"], found.pid != first) == (3, True)


@pytest.mark.slow
def test_what_nobody_foresaw_is_told(capsys: pytest.CaptureFixture[str], told: Hearing) -> None:
    """In one line on the page, with its trace once in the log, which is standard error's; the worker goes on."""
    with worker(Traps()) as found:
        problem = told.ask(found, 1, "fall")["problem"]
        assert "problem" not in told.ask(found, 2)
    assert problem.startswith("This failed, and should not have")
    assert "\n" not in problem
    error = capsys.readouterr().err
    assert error.count("Traceback (most recent call last)") == 1
    assert error.endswith("LookupError: nobody foresaw this\n\n")


@pytest.mark.slow
def test_a_request_whose_process_is_killed_is_answered(tmp_path: Path, told: Hearing) -> None:
    """By another process, once; the page notices a pause, and nothing of one that is killed while it waits."""
    with worker(Traps(folder=str(tmp_path))) as found:
        assert told.ask(found, 1, "killed-once")["texts"]
        assert told.ask(found, 2, "killed")["problem"] == TWICE
        assert "problem" not in told.ask(found, 3)
        os.kill(found.pid, signal.SIGKILL)
        assert "problem" not in told.ask(found, 4)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["drop", "close", "limit", "killed"])
def test_nothing_is_left_of_what_is_stopped(how: str, tmp_path: Path, told: Hearing) -> None:
    """Neither the process nor those that it forked, which hold its connection; of what is dropped nothing is told."""
    child = tmp_path / "child"
    with worker(Traps(folder=str(tmp_path)), limit=1.0 if how == "limit" else 600.0) as found:
        if how == "killed":
            assert told.ask(found, 1, "forks-and-dies")["problem"] == TWICE
            assert ended([int(child.read_text())])
            return
        found.ask("page", "a", wanted(1, "forks"), told)
        assert until(lambda: child.exists() and child.read_text(), 60.0)
        pids = [found.pid, int(child.read_text())]
        assert all(map(is_running, pids))
        if how != "limit":
            {"drop": lambda: found.drop("page", "a"), "close": found.close}[how]()
        assert ended(pids, 1.0 if how != "limit" else 6.0)
        assert how != "drop" or told.ask(found, 2)["id"] == 2


@pytest.mark.slow
@pytest.mark.parametrize("opened", ["robinson", "+proj=merc +nadgrids=x.gsb"])
def test_processes_have_proj_without_the_users_files(opened: str, tmp_path: Path, monkeypatch: Any) -> None:
    """Nor a network, unless he has named a file; the page's own process keeps what it has."""
    monkeypatch.setenv("PROJ_NETWORK", "ON")
    monkeypatch.setenv("PROJ_USER_WRITABLE_DIRECTORY", str(tmp_path))
    before, told = dict(os.environ), Hearing()
    with worker(Traps(frozenset({opened}))) as found:
        network, folder = json.loads(told.ask(found, 1, "proj")["problem"])
    assert (network, folder == str(tmp_path)) == ((False, False) if opened == "robinson" else (True, True))
    assert dict(os.environ) == before


@pytest.mark.slow
def test_pages_have_their_turns(shared: Worker, told: Hearing) -> None:
    """A page that asks for hundreds of maps is answered some, and told why no more; another one waits for two."""
    occupy(shared, "first", told)
    for number in range(1, 300):
        shared.ask("first", f"map{number}", wanted(number), told)
    shared.ask("second", "map", wanted(5000), told)
    heard = [told.next() for _ in range(301)]
    assert told.blocks.empty()
    problems = [one["problem"] for one in heard if "problem" in one]
    said = "This page has 48 others that wait, and may not have more: ask again when some are answered."
    assert problems == [f"Invalid request. {said}"] * (299 - MOST_OF_PAGE)
    assert [one["id"] for one in heard if "problem" not in one] == [0, 1, 5000, *range(2, MOST_OF_PAGE + 1)]


@pytest.mark.slow
def test_closed_pages_drop_their_requests_only(shared: Worker) -> None:
    told, gone = Hearing(), Hearing()
    shared.ask(1, "a", wanted(1, "sleep:0.3"), told)
    shared.ask(2, "a", wanted(2), gone)
    shared.ask(1, "b", wanted(3), told)
    shared.drop(2)
    assert [told.next()["id"], told.next()["id"]] == [1, 3]
    assert gone.blocks.empty()


def test_a_lane_without_requests_is_closed() -> None:
    before = threading.active_count()
    found = Worker("preview", Traps())
    found.close()
    found.close()
    assert found.pid is None
    assert threading.active_count() == before


@pytest.mark.slow
def test_memory_stays_as_it_is() -> None:
    """Over hundreds of previews and tens of pictures of maps that are dragged, after what is kept has filled."""
    told, random = Hearing(), np.random.default_rng(1)
    names = ["robinson", "mollweide", "winkel-tripel", "+proj=laea +R=6371000", "+proj=lcc +lat_1=30 +lat_2=60"]
    regions = ["globe", "country:DE", "box:170,-50,-170,-30", "cap:15,50,500"]

    def answer(kind: str, number: int, region: str) -> None:
        name = names[number % 5]
        centre = float(random.uniform(-180, 180)), float(random.uniform(-60, 60))
        found.ask("page", kind, Request(id=number, kind=kind, projection=name, region=region, centre=centre), told)
        assert told.next()["id"] == number

    with worker() as found:
        for kind, first, counts in (("preview", 0, (100, 200)), ("picture", 1, (15, 15))):
            sizes = []
            for count in counts:
                for number in range(count):
                    answer(kind, number, regions[first + number % (4 - first)])
                sizes.append(int(listed("-o", "rss=", "-p", str(found.pid))))
            assert sizes[1] - sizes[0] < _GROWTH


def filled(sizes: dict[str, int]) -> RequestQueue[tuple[str, int]]:
    """RequestQueue in which pages have so many tasks, of which each knows its page and its number."""
    turns: RequestQueue[tuple[str, int]] = RequestQueue(100)
    for page, count in sizes.items():
        for number in range(count):
            turns.put(page, number, (page, number))
    return turns


def served(turns: RequestQueue[tuple[str, int]]) -> list[tuple[str, int]]:
    return [turns.next() for _ in range(len(turns))]


def test_pages_are_served_in_turn() -> None:
    """Each in its own order; the newest takes the place of the first of its key, at any time, however full it is."""
    assert served(filled({"a": 3, "b": 1, "c": 2})) == [("a", 0), ("b", 0), ("c", 0), ("a", 1), ("c", 1), ("a", 2)]
    turns = filled({"a": MOST_OF_PAGE, "b": 1})
    turns.put("a", 0, ("a", -1))
    assert served(turns)[:3] == [("a", -1), ("b", 0), ("a", 1)]


@given(st.dictionaries(st.sampled_from("abcdefgh"), st.integers(1, MOST_OF_PAGE), min_size=2), st.data())
def test_nobody_waits_for_more_than_one_of_each(sizes: dict[str, int], data: st.DataObject) -> None:
    """Whenever a page comes, its first task is served after at most one of each of the others."""
    turns = filled(sizes)
    for _ in range(data.draw(st.integers(0, sum(sizes.values()) - 1))):
        turns.next()
    turns.put("new", 0, ("new", 0))
    before = [page for page, _ in served(turns)]
    before = before[: before.index("new")]
    assert len(before) == len(set(before)) <= len(sizes)


def test_there_are_so_many_places() -> None:
    """Of each page, and of all, but one for every page."""
    turns = filled({"a": MOST_OF_PAGE})
    with pytest.raises(TooManyRequests, match=f"^Invalid request. This page has {MOST_OF_PAGE} others that wait"):
        turns.put("a", "more", ("a", 99))
    turns.put("b", 0, ("b", 0))
    assert len(turns) == MOST_OF_PAGE + 1
    turns.next()
    turns.put("a", "more", ("a", 99))
    turns = filled(dict.fromkeys(map(str, range(MOST_OF_ALL // MOST_OF_PAGE)), MOST_OF_PAGE))
    turns.put("new", 0, ("new", 0))
    with pytest.raises(TooManyRequests, match="may not have more"):
        turns.put("new", 1, ("new", 1))
    assert len(turns) == MOST_OF_ALL + 1


def test_a_page_has_so_many_bytes() -> None:
    """Of files; a newer one of the same key takes the place of the older."""
    turns = filled({"a": 0})
    turns.put("a", "check", ("a", 0), 90)
    with pytest.raises(TooManyRequests, match="A file of this page waits already"):
        turns.put("a", "other", ("a", 1), 11)
    turns.put("a", "other", ("a", 2))
    turns.put("a", "check", ("a", 3), 100)
    turns.put("b", "check", ("b", 0), 100)
    assert served(turns) == [("a", 3), ("b", 0), ("a", 2)]


def test_what_is_dropped_waits_no_more() -> None:
    turns = filled({"a": 2, "b": 2, "c": 1})
    turns.drop("a", 0)
    for _ in range(2):
        turns.drop("c", 0)
        turns.drop("b")
    assert served(turns) == [("a", 1)]
    with pytest.raises(LookupError):
        turns.next()
