"""The command `mean-map`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Annotated

import typer

from projdist import plots
from projdist.cli.cells import certain, size_text
from projdist.cli.errors import refuse, refusing
from projdist.cli.formats import JSON, TABLE
from projdist.cli.options import (
    DatumOption,
    DpiOption,
    OutputOption,
    OverwriteOption,
    Projections,
    RegionOption,
    SizeOption,
    file_format,
    format_for,
    printed_or_file,
    region_given,
)
from projdist.cli.output import present
from projdist.cli.pictures import LookWords, PictureFile, picture_of, with_looks
from projdist.cli.progress import progress_bar
from projdist.cli.report import Column, Copy, Report, Table
from projdist.designs import MeanMap, mean_map

_FORMS = (TABLE, JSON, "proj", "wkt", "wkt-derived", "projjson")


@with_looks
def mean_map_command(
    projections: Projections,
    region: RegionOption = None,
    weights: Annotated[
        str | None, typer.Option(metavar="NUMBERS", help="What each map counts, as 1,2; else all the same.")
    ] = None,
    degree: Annotated[
        str | None,
        typer.Option(metavar="NUMBER", help="Of the polynomials; 8 if not given, of maps of the world 9, at most 12."),
    ] = None,
    datum: DatumOption = None,
    name: Annotated[str | None, typer.Option(metavar="TEXT", help="Of the map.")] = None,
    format: Annotated[str | None, file_format(_FORMS, ".json, .wkt or .txt")] = None,
    output: OutputOption = None,
    picture: Annotated[
        str | None, typer.Option(metavar="FILE", help="The mean beside the average: .png, .svg or .pdf.")
    ] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Find the mean of several maps: the map that is nearest to all in distortion."""
    path = printed_or_file(output, overwrite)
    form = format_for(format, path, _FORMS)
    drawn = picture_of(picture, size=size, dpi=dpi, overwrite=overwrite, look=look)
    area = region_given(region, projections)
    if degree is not None and not degree.isdecimal():
        refuse(f"Invalid degree '{degree}'. It must be a whole number.")
    with refusing(), progress_bar("maps measured") as progress:
        found = mean_map(
            projections,
            weights=None if weights is None else _numbers(weights),
            region=area,
            degree=None if degree is None else int(degree),
            datum=datum,
            name=name,
            progress=progress,
        )
    if drawn is not None:
        _draw(found, drawn)
    present(_report(found, drawn), form, path, overwrite)


def _numbers(text: str) -> list[float]:
    try:
        return [float(value) for value in text.split(",")]
    except ValueError:
        refuse(f"Invalid weights '{text}'. They must be numbers with commas, as 1,2.")


def _draw(found: MeanMap, picture: PictureFile) -> None:
    """Heat maps of the mean and the average, on one scale."""
    picture.save(
        functools.partial(
            plots.heatmap_figure,
            [found.projection, found.average],
            region=found.region,
            titles=["Mean", "Average of coordinates"],
        )
    )


def _report(found: MeanMap, picture: PictureFile | None) -> Report:
    crs = found.crs
    missing = "A map of the world, or after a function, is no CRS; JSON has its coefficients."
    return Report(
        title=f"{found.projection.name} over {found.region.name} ({size_text(found.region)})",
        lead=[*_lead(found)],
        tables=[_standings(found)],
        notes=[*_notes(found)],
        data=found.to_dict,
        copies={
            "proj": Copy(crs.pipeline if crs else None, missing),
            "wkt": Copy(crs.wkt if crs else None, missing),
            "wkt-derived": Copy(crs.wkt_derived if crs else None, missing),
            "projjson": Copy(crs.projjson if crs else None, missing),
        },
        about=found.projection.name,
        written=[picture.path if picture else None],
    )


def _lead(found: MeanMap) -> Iterator[str]:
    """Degree and weights."""
    on = "in longitude and in latitude" if found.base is None else f"on {found.base.definition}"
    yield f"Degree {found.degree} {on}"
    if len(set(found.weights)) > 1:
        yield f"Weights {', '.join(f'{one:g}' for one in found.weights)}"


def _standings(found: MeanMap) -> Table:
    """The bound, the mean, the average and the given maps."""
    rows = [
        {
            "map": one.kind,
            "name": one.name,
            "total": one.total,
            "error": found.error,
            "airy_kavrayskiy": one.airy_kavrayskiy,
            "doubt": one.error,
        }
        for one in found.standings
    ]
    columns = [
        Column("map", left=True),
        Column("name", left=True),
        Column("total", "sum of squared distances", certain, error="error"),
        Column("airy_kavrayskiy", "airy_kavrayskiy_scaled", certain, error="doubt"),
    ]
    return Table(rows, columns)


def _notes(found: MeanMap) -> Iterator[str]:
    yield (
        "The distance of two maps is the Fisher distortion from the plane of the one to that of the other at the same "
        "point of the ground."
    )
    yield "The bound is that of the metrics' means at each point, which no map need have."
    yield from found.notes
    if found.crs is not None:
        yield "To take it elsewhere: --format wkt, wkt-derived, proj or projjson, or -o FILE.wkt."
