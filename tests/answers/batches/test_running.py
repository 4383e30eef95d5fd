"""Tasks on executors: groups, losses, failures."""

import json
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor

import pytest
from batch_functions import name_of, wrong

from projdist.answers.batch_tasks import Job, Task
from projdist.answers.batches import run_job

TASKS = [Task(number, f"r{number}", f"box:{number},0,{number + 1},1") for number in range(60)]


def results(executor, tasks=TASKS, function=name_of):
    """The results by their tasks, each of which is told once."""
    lines = []
    run_job(Job(function, {}), tasks, executor, lines.extend)
    found = [json.loads(line) for line in lines]
    assert sorted(one["task"] for one in found) == [task.number for task in tasks]
    return {one["task"]: one for one in found}


def is_whole(found, but=()):
    """Whether every task has its own result."""
    return all(
        one["answer"]["name"] == f"box:{number},0,{number + 1},1" for number, one in found.items() if number not in but
    )


@pytest.mark.parametrize("make", [lambda: None, lambda: ThreadPoolExecutor(3)])
def test_every_task_is_done_once(make):
    """Whatever does it."""
    assert is_whole(results(make()))


class Lossy(Executor):
    """An executor that loses groups with their workers as it is told, and remembers what it was given."""

    def __init__(self, is_lost, error=CancelledError):
        self.is_lost, self.error, self.given = is_lost, error, []

    def submit(self, function, job, tasks):
        """Lose the group, or do it at once."""
        future = Future()
        numbers = [task.number for task in tasks]
        if self.is_lost(numbers, self.given):
            future.set_exception(self.error())
        else:
            future.set_result(function(job, tasks))
        self.given.append(numbers)
        return future


@pytest.mark.parametrize("error", [CancelledError, BrokenExecutor])
def test_what_is_lost_is_done_again_alone(error):
    """Each task of a lost group in a group of its own, and nothing else twice."""
    executor = Lossy(lambda numbers, given: 30 in numbers and not any(30 in one for one in given), error)
    assert is_whole(results(executor))
    (lost,) = (numbers for numbers in executor.given if 30 in numbers and numbers != [30])
    assert len(lost) > 1
    again = [numbers for numbers in executor.given if set(numbers) & set(lost)]
    assert again == [lost, *([number] for number in lost)]


def test_a_task_that_is_lost_twice_is_given_up():
    """It is told to have failed, to be tried again another time; what was lost with it is not."""
    found = results(Lossy(lambda numbers, _: 30 in numbers))
    assert found[30] == {"task": 30, "error": "The process that worked on it was killed, twice.", "again": True}
    assert is_whole(found, but=[30])


def test_groups():
    """At first one task, as nobody knows how long it takes; then more, and at the end few again."""
    executor = Lossy(lambda *_: False)
    results(executor)
    sizes = [len(numbers) for numbers in executor.given]
    assert sizes[0] == 1
    assert 1 < max(sizes) <= len(TASKS) / 4
    assert sizes[-1] == 1


@pytest.mark.parametrize("make", [lambda: None, lambda: ThreadPoolExecutor(2)])
def test_failures_are_told_in_their_place(make):
    """What is wrong with a task is one line; what nobody expected has its kind before it."""
    found = results(make(), TASKS[:8], wrong)
    assert {number: one["error"] for number, one in found.items() if "error" in one} == {
        0: "It is the first.",
        1: "KeyError: 'second'",
        2: found[2]["error"],
    }
    assert "not JSON compliant" in found[2]["error"]
    assert is_whole(found, but=[0, 1, 2])


class Gone(Executor):
    """A cluster whose connection is closed."""

    def __init__(self, error):
        self.error = error

    def submit(self, *_):
        """As Dask and pools have it."""
        raise self.error


@pytest.mark.parametrize("error", [OSError("Timed out trying to connect."), RuntimeError("ConnectionPool is closed")])
def test_a_cluster_that_is_gone(error):
    """Is no file that cannot be written."""
    with pytest.raises(ConnectionError, match=r"^The executor does not answer any more.$"):
        results(Gone(error))
