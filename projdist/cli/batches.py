"""Commands over many regions: executors, partial results and output."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any

from projdist import answers, gis, support
from projdist.cli import options as opt
from projdist.cli.errors import cannot_write, note, progress_bar, refuse, refusing, tell_problems
from projdist.cli.report import Report, Row, drawing, present, tell_written

SHOWN = 12  # regions below an answer, few enough for a screen
OWN: str | None = "processes"
"""The executor of a command without `--executor`."""


@contextlib.contextmanager
def executor_opened(text: str | None) -> Iterator[Executor | None]:
    """Open the executor that `--executor` names, or None; raises ImportError if Dask is missing."""
    if text is None:
        yield None
        return
    support.check_executor(text)
    with contextlib.ExitStack() as stack:
        try:
            workers = stack.enter_context(support.open_executor(text))
        except OSError as error:
            refuse(f"Invalid executor '{text}'. Nothing answers there.", error, code=1)
        yield workers


class RegionalWork:
    """Run of a command over many regions, which ends in a report or a layer of the regions."""

    def __init__(
        self, form: str | None, output: str | None, *, overwrite: bool, executor: str | None, partial: str | None
    ) -> None:
        self._executor = executor or OWN
        if executor is not None:
            with refusing():
                support.check_executor(executor)
        self.target = opt.target(form, output, overwrite, others=opt.LAYER_SUFFIXES)
        path = self.target.path
        self.layer = path if path is not None and path.suffix.lower() in opt.LAYER_SUFFIXES else None
        if self.layer is not None:
            if form is not None:
                refuse(f"Invalid format '{form}' for '{path}'. Its suffix tells the format.")
            opt.check_libraries(self.layer)
        self._kept = partial is not None  # even after success
        self.partial = None if path is None or support.is_stream(path) else path.with_name(f"{path.name}.partial")
        if partial is not None:
            self.partial = opt.output_file(partial, overwrite=True)

    def run(
        self,
        function: Callable[..., object],
        areas: Sequence[answers.Area],
        maps: Sequence[str] | None,
        options: Mapping[str, Any],
    ) -> answers.Batch:
        """Results of the batch, with a progress bar; invalid input ends the command."""
        self._areas = {area.name: area for area in areas}
        if self.partial is not None and self.partial.exists() and not support.is_stream(self.partial):
            note(f"Results that are in '{self.partial}' are taken from there.")
        try:
            with refusing(), executor_opened(self._executor) as workers, progress_bar("results") as progress:
                where: dict[str, Any] = {"executor": workers, "partial": self.partial, "progress": progress}
                return answers.batch(function, areas, maps, options=options, **where)
        except ConnectionError as error:
            kept = f" '{self.partial}' has what was done; the same command continues from it." if self.partial else ""
            refuse(f"{error}{kept}", error, code=1)
        except OSError as error:
            cannot_write(self.partial, error)

    def leave(self, report: Report, found: answers.Batch, best: Sequence[Row], problems: Sequence[str]) -> None:
        """Print or write the report, or the best map of each region as a layer; failures end the command with 1."""
        # `problems` are failures outside of the tasks.
        if self.layer is not None:
            with drawing(self.layer):
                frame = gis.frame_of_regions(best, [self._areas[row["region"]].place() for row in best])
                gis.save_layer(frame, self.layer, layer="regions", overwrite=self.target.overwrite)
            tell_written(self.layer)
        else:
            present(report, *self.target)
        if self.partial is not None and not self._kept:
            if any(one.lost for one in found.failures):
                note(f"'{self.partial}' has what was done; the same command retries what was lost.")
            else:
                self.partial.unlink(missing_ok=True)
        tell_problems([*problems, *(one.line for one in found.failures)])


def regions_given(regions: Sequence[str], others: Mapping[str, object]) -> list[answers.Area]:
    """Regions of `--regions`; refuses the options `others`, which cannot be used with it."""
    for name, value in others.items():
        if value is not None:
            refuse(f"Invalid option '--regions'. It cannot be used with {name}.")
    with refusing():
        return answers.areas_of(list(regions))


def notices_note(found: answers.Batch) -> list[str]:
    """Note that there are notices in the JSON, if there are any."""
    told = {one.region for one in found.results if one.notices}
    return [f"Notices on {len(told)} of the regions, for example on areas of use, are in the JSON."] if told else []
