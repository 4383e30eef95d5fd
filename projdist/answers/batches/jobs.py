"""A function of many regions, or of many maps over them."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from projdist import __version__
from projdist.answers.batches.running import open_partial, run_job
from projdist.answers.batches.tasks import Area, Job, Task, areas_of, map_text
from projdist.projections import Projection, ProjectionError, ProjectionLike, listed_projections
from projdist.regions import RegionLike, ground_of_maps
from projdist.support import Answer, check_executor, check_path, is_picklable, quoted


@dataclass(frozen=True, kw_only=True)
class BatchResult:
    """What a function answered for a region, or for a map over it.

    `answer` is what it returned as JSON has it, an answer's `to_dict()`; `rows` are those of an answer's frame.
    `notices` are what was told on the way.
    """

    region: str
    area_km2: float
    projection: str | None
    answer: Any
    rows: list[dict[str, Any]]
    notices: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """The region, the map where there is one, and the answer."""
        named = {"region": {"name": self.region, "area_km2": self.area_km2}}
        mapped = {} if self.projection is None else {"projection": self.projection}
        return {**named, **mapped, "answer": self.answer, "notices": list(self.notices)}


@dataclass(frozen=True)
class BatchFailure:
    """A region, or a map over it, that there is no answer for, and why.

    What was `lost` with the processes that worked on it is tried again when the job goes on.
    """

    region: str
    projection: str | None
    error: str
    lost: bool = False

    @property
    def line(self) -> str:
        """What failed, and why."""
        what = self.region if self.projection is None else f"{self.projection} over {self.region}"
        return f"{what}: {self.error}"

    def to_dict(self) -> dict[str, Any]:
        """`{"region", "error"}`, and `"projection"` where there is one."""
        mapped = {} if self.projection is None else {"projection": self.projection}
        return {"region": self.region, **mapped, "error": self.error}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Batch(Answer):
    """Answers for many regions, in their order, and failures. A frame has the rows of all, their region before them."""

    function: str
    results: tuple[BatchResult, ...]
    failures: tuple[BatchFailure, ...]

    def _line(self) -> str:
        return f"{self.function}, {len(self.results)} results, {len(self.failures)} failures"

    def to_dict(self) -> dict[str, Any]:
        """`{"function", "results": [...], "failures": [...]}`."""
        return {
            "function": self.function,
            "results": [result.to_dict() for result in self.results],
            "failures": [one.to_dict() for one in self.failures],
        }

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
    """A function of each of many regions, or of each of several maps over each of them.

    What fails is told among the `failures`, and the rest goes on; what is lost with a worker is done again, once.

    Parameters
    ----------
    function : callable
        `function(region, **options)`, or `function(projection, region, **options)` with projections, as
        `projdist.recommend` and `projdist.summarize`; one of a module where it runs in other processes. It answers with
        an answer of projdist's, or with what JSON can hold.
    regions : RegionLike, or a list of them
        `"countries"`, `"continents"`, `"states"`, a file or a frame, whose features are the regions, or whatever
        `get_region` takes but points.
    projections : ProjectionLike or iterable of ProjectionLike, optional
        Whatever `Projection.from_user_input` takes and has a text, which is what workers are sent: no function.
    options : mapping, optional
        Arguments by name: texts, numbers, and lists of them.
    executor : concurrent.futures.Executor or str, optional
        Where the work is done: `"processes:N"`, `"processes"` (one a core), `"dask://HOST:PORT"`, or any executor; else
        in this process. A script that asks for processes must guard itself by `if __name__ == "__main__"`.
    partial : path, optional
        A file of JSON lines that results are added to as they come. Where it is there, of the same job, only what is
        missing in it is done.
    progress : callable, optional
        Called with how many results there are, and of how many.

    Returns
    -------
    Batch
        The `results`, regions in their order and for each the maps in theirs, and the `failures`.

    Raises
    ------
    ValueError
        For what is no region, options that are no text or numbers, and a partial file of another job.
    ImportError, OSError
        Without Dask, and where nothing answers at its address, also later (ConnectionError); for a partial file that
        cannot be written.

    References
    ----------
    JSON Lines, https://jsonlines.org

    Examples
    --------
    Mercator's map over bands of ten degrees, each with the error of its own:

    >>> bands = ["box:0,0,10,10", "box:0,40,10,50"]
    >>> from projdist.answers import summarize
    >>> found = batch(summarize, bands, ["mercator"], options={"tolerance": 1e-6})
    >>> [round(one.answer["airy_kavrayskiy"], 3) for one in found.results]
    [0.01, 0.495]
    """
    job = _job(function, {} if options is None else options)
    tasks = _tasks(regions, projections)
    header = job.header(tasks, __version__)
    _check_executor(executor, job)
    path = None if partial is None else check_path("partial file", partial)
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
    return Batch(
        function=job.name,
        results=tuple(_result(task, results[task.number]) for task in tasks if "error" not in results[task.number]),
        failures=tuple(_failure(task, results[task.number]) for task in tasks if "error" in results[task.number]),
    )


def _job(function: Any, options: Any) -> Job:
    if not callable(function) or not hasattr(function, "__qualname__"):
        raise ValueError(f"Invalid function {quoted(function)} of a batch. It must be one of a module; see options.")
    if not isinstance(options, Mapping) or not all(isinstance(name, str) for name in options):
        raise ValueError(f"Invalid options {quoted(options)} of a batch. They must be arguments by name.")
    return Job(function, dict(options))


def _check_executor(executor: Any, job: Job) -> None:
    """Whether an executor is one, and can be sent the job."""
    if executor is None:
        return
    if isinstance(executor, str):
        check_executor(executor)
    elif not hasattr(executor, "submit"):
        raise ValueError(
            f"Invalid executor {quoted(executor)}. It must be processes:N, dask://HOST:PORT, or one of "
            "concurrent.futures."
        )
    if not is_picklable(job):
        raise ValueError(f"Invalid function {quoted(job.name)} of a batch. Other processes must be able to import it.")


def _tasks(regions: Any, projections: Any) -> list[Task]:
    """The tasks, those of a region one after the other, as they share what depends on it alone."""
    given = [None] if projections is None else listed_projections(projections)
    maps = [None if one is None else map_text(one) for one in given]
    figure = None if projections is None else _figure(given)
    pairs = ((area, one) for area in areas_of(regions) for one in maps)
    return [Task(number, area.name, area.text, one, figure) for number, (area, one) in enumerate(pairs)]


def _figure(given: Sequence[Any]) -> tuple[float, float]:
    """The ellipsoid on which the regions of all maps are measured; what is no map fails in its task."""
    maps: list[Projection] = []
    for one in given:
        with contextlib.suppress(ProjectionError):
            maps.append(Projection.from_user_input(one))
    ground = ground_of_maps(maps)
    return ground.a, ground.f


def _result(task: Task, found: Mapping[str, Any]) -> BatchResult:
    return BatchResult(
        region=task.name,
        area_km2=found["area_km2"],
        projection=task.projection,
        answer=found["answer"],
        rows=found["rows"],
        notices=tuple(found["notices"]),
    )


def _failure(task: Task, found: Mapping[str, Any]) -> BatchFailure:
    return BatchFailure(task.name, task.projection, found["error"], found.get("again", False))
