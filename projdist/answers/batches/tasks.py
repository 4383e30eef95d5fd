"""Tasks of a batch, made of text, and what a worker does with them."""

from __future__ import annotations

import functools
import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from projdist.answers.batches.areas import Area
from projdist.earth import Ellipsoid
from projdist.projections import proj_version
from projdist.regions import Place
from projdist.support import Answer, notices_kept, without_processes

_SLICE = 1.5  # seconds, after which a worker answers with what it has done
_KEPT = 4  # regions that a worker remembers, as those of many maps come one after the other


class Task(NamedTuple):
    """A region, by its name and in words of `get_region` or as GeoJSON, perhaps a map of it, and the task's number.

    The `figure`, a semi-major axis and a flattening, is the ellipsoid on which the regions of all maps are measured.
    """

    number: int
    name: str
    region: str
    projection: str | None = None
    figure: tuple[float, float] | None = None


class Done(NamedTuple):
    """The lines of tasks that are done, of as many as there was time for, and the seconds that they took."""

    lines: list[str]
    seconds: float


@dataclass(frozen=True)
class Job:
    """A function of regions, or of maps and regions, and its options."""

    function: Callable[..., Any]
    options: Mapping[str, Any]

    @property
    def name(self) -> str:
        """The function, by its module."""
        return f"{self.function.__module__}.{self.function.__qualname__}"

    def header(self, tasks: Sequence[Task], version: str) -> dict[str, Any]:
        """What tells it from other jobs; raises ValueError for options that are no text or numbers."""
        try:
            options = json.loads(json.dumps(self.options, sort_keys=True, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid options of a batch. They must be text, numbers, and lists of them: {error}."
            ) from error
        header = {
            "projdist": version,
            "PROJ": proj_version(),
            "function": self.name,
            "options": options,
            "tasks": len(tasks),
        }
        text = json.dumps([header, tasks], sort_keys=True)
        return {**header, "digest": hashlib.sha256(text.encode()).hexdigest()}


def run_tasks(job: Job, tasks: Sequence[Task]) -> Done:
    """What a worker does: tasks one after the other, and not for long."""
    start = time.monotonic()
    lines: list[str] = []
    with without_processes():
        for task in tasks:
            lines.append(_line(job, task))
            if time.monotonic() - start > _SLICE:
                break
    return Done(lines, time.monotonic() - start)


def failure(task: Task, reason: str, *, again: bool = False) -> str:
    """The line of a task that failed; whether it is to be tried again when the job goes on."""
    return json.dumps({"task": task.number, "error": reason} | ({"again": True} if again else {}))


def _line(job: Job, task: Task) -> str:
    """A result as a line of JSON; what is wrong with the task is one, too."""
    try:
        region, notices = _region(task.name, task.region, task.figure)
        words = (region,) if task.projection is None else (task.projection, region)
        with notices_kept() as told:
            found = job.function(*words, **job.options)
        result = {"task": task.number, "area_km2": region.area_km2, "notices": [*notices, *told]}
        return json.dumps(result | _told(found), allow_nan=False)
    except ValueError as error:
        return failure(task, str(error))


@functools.lru_cache(_KEPT)
def _region(name: str, text: str, figure: tuple[float, float] | None) -> tuple[Place, tuple[str, ...]]:
    """The region of a task, and what is to be said of it."""
    with notices_kept() as told:
        region = Area(name, text).place(None if figure is None else Ellipsoid(*figure))
    return region, (*told, *region.notes)


def _told(found: Any) -> dict[str, Any]:
    """An answer and its rows, for JSON."""
    if not isinstance(found, Answer):
        return {"answer": found, "rows": [found] if isinstance(found, dict) else []}
    return {"answer": found.to_dict(), "rows": found.plain_rows()}
