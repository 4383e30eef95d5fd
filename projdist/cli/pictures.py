"""A picture that a command draws, from the words of its options."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from projdist import plots
from projdist.cli.errors import refuse
from projdist.cli.options import dots_of, file_of_kind, size_of, step_of
from projdist.cli.output import drawing
from projdist.cli.progress import working


class PictureFile:
    """Where a picture goes, and how it is drawn; a wrong word ends the command with 2."""

    def __init__(
        self, output: str, *, size: str | None, dpi: str | None, step: str | None = None, overwrite: bool
    ) -> None:
        self.path: Path = file_of_kind(output, plots.SUFFIXES, overwrite, "picture file")
        self.dots, self.step = dots_of(dpi), step_of(step)
        self.size, self.overwrite = size_of(size, self.dots), overwrite

    def save(self, draw: Callable[..., Any]) -> None:
        """Write the figure that `draw` makes with `size` and `dpi`; what cannot be drawn ends the command."""
        with drawing(self.path), working("Drawing"):
            figure = draw(size=self.size, dpi=self.dots)
            plots.save(figure, self.path, dpi=self.dots, overwrite=self.overwrite)


def picture_of(
    output: str | None, *, size: str | None, dpi: str | None, step: str | None = None, overwrite: bool, **others: Any
) -> PictureFile | None:
    """The picture of a command that draws one only where it is asked to; else options of pictures are refused.

    `others` are such options that the command has beside these, None where they are not given.
    """
    if output is not None:
        return PictureFile(output, size=size, dpi=dpi, step=step, overwrite=overwrite)
    for name, value in (others | {"step": step, "size": size, "dpi": dpi}).items():
        if value is not None:
            refuse(f"Invalid option '--{name}'. It needs a picture to draw to: -o FILE.")
    return None
