"""The command `morph`."""

from __future__ import annotations

import functools
from typing import Annotated

import typer

from projdist import plots
from projdist.cli.errors import refuse, refusing
from projdist.cli.options import (
    OverwriteOption,
    RegionOption,
    dots_of,
    file_of_kind,
    measure_names,
    number,
    output_option,
    region_given,
    size_of,
    whole_number,
)
from projdist.cli.output import drawing, tell_written
from projdist.cli.pictures import FILMS, LookWords, look_of_words, with_looks
from projdist.cli.progress import progress_bar
from projdist.projections import Projection


@functools.partial(with_looks, less=FILMS)
def morph_command(
    first: Annotated[str, typer.Argument(metavar="PROJECTION", help="Where the film begins, as for compare.")],
    second: Annotated[str, typer.Argument(metavar="PROJECTION", help="What it flows into, and back from.")],
    output: Annotated[str, output_option("Film: .gif, or .mp4 (with ffmpeg).")] = "morph.gif",
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure", "-m", metavar="NAME", help="Its colours; fisher if none (see 'projdist list measures')."
        ),
    ] = None,
    region: RegionOption = None,
    frames: Annotated[str, typer.Option(metavar="NUMBER", help="Pictures on the way there.")] = "24",
    seconds: Annotated[str, typer.Option(metavar="NUMBER", help="There and back, without the rests.")] = "4",
    size: Annotated[str, typer.Option(metavar="WIDTH,HEIGHT", help="In inches.")] = "7,4.6",
    dpi: Annotated[str, typer.Option(metavar="NUMBER", help="Dots per inch.")] = "100",
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Make a film of one map that flows into another, in the colours of a measure."""
    path = file_of_kind(output, plots.FILM_SUFFIXES, overwrite, "film")
    names = measure_names(measure or ["fisher"])
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A film shows one.")
    count, length = whole_number("frames", frames, 2, 500), number("seconds", seconds, 0.1, 600)
    dots = dots_of(dpi)
    room, area = size_of(size, dots), region_given(region, [first, second])
    shown = look_of_words(look or {})
    with refusing():
        maps = Projection.from_user_input(first), Projection.from_user_input(second)
    with drawing(path), progress_bar("frames") as progress:
        plots.morph(
            *maps,
            path,
            measure=names[0],
            region=area,
            frames=count,
            seconds=length,
            size=room or (7.0, 4.6),
            dpi=dots,
            overwrite=overwrite,
            progress=progress,
            look=shown,
        )
    tell_written(path)
