"""The command `correct`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Annotated

import typer

from projdist import plots
from projdist.answers import CONSTRAINTS, Correction, correct
from projdist.cli.cells import covers, first_digit, rounded, size_text
from projdist.cli.errors import refuse, refusing
from projdist.cli.formats import HTML, JSON, TABLE
from projdist.cli.options import (
    PAGE_SUFFIX,
    DpiOption,
    OverwriteOption,
    RegionOption,
    SizeOption,
    choice,
    form_and_page,
    number,
    region_given,
    report_format,
)
from projdist.cli.output import drawing, present
from projdist.cli.pictures import LookWords, PictureFile, picture_of, with_looks
from projdist.cli.report import Column, Copy, Mapped, Report, Table
from projdist.projections import Projection
from projdist.regions import Place

_FORMS = (TABLE, JSON, HTML, "proj", "wkt")


@with_looks
def correct_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    region: RegionOption = None,
    constraint: Annotated[
        str,
        typer.Option(metavar="|".join(CONSTRAINTS), help="Any linear map, one that keeps areas, or a scale alone."),
    ] = "affine",
    keep_north: Annotated[
        bool,
        typer.Option("--keep-north/--free", help="Keep the map's vertical, or turn it so that north is up on average."),
    ] = True,
    format: Annotated[str | None, report_format(_FORMS)] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Picture of the map before and after: .png, .svg or .pdf; or a page: .html.",
        ),
    ] = None,
    local: Annotated[
        str | None,
        typer.Option(metavar="KM", help="Draw, in its place, the corrections that caps of this radius would have."),
    ] = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses or caps.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Find the linear map that lessens a map's distortion most, and the corrected map."""
    form, page = form_and_page(format, output, overwrite, _FORMS)
    area = region_given(region)
    choice("constraint", constraint, list(CONSTRAINTS))
    picture = picture_of(
        output,
        size=size,
        dpi=dpi,
        step=step,
        overwrite=overwrite,
        look=look,
        beside=(PAGE_SUFFIX,),
    )
    with refusing():
        measured = Projection.from_user_input(projection)
        if local is not None:
            _check_local(form, picture, constraint, keep_north)
            _draw_local(measured, area, number("radius", local, 1e-3, 10_000.0, " of km"), picture, form)
            return
        result = correct(measured, area, constraint=constraint, keep_north=keep_north)
    if picture is not None:
        _draw(result, picture)
    present(_report(result, projection, picture), form, page, overwrite)


def _draw(result: Correction, picture: PictureFile) -> None:
    """Tissot's indicatrices before and after."""
    picture.save(
        functools.partial(
            plots.tissot_figure,
            [result.projection, result.corrected],
            region=result.region,
            step=picture.step,
            airy_kavrayskiy=[result.airy_kavrayskiy, result.airy_kavrayskiy_corrected],
        )
    )


def _check_local(form: str, picture: PictureFile | None, constraint: str, keep_north: bool) -> None:
    if form not in (TABLE, JSON):
        refuse(f"Invalid format '{form}' with --local. It must be table or json.")
    if picture is None and form != JSON:
        refuse("Invalid option '--local'. It needs a picture to draw to, -o FILE, or --format json.")
    if constraint != "affine" or not keep_north:
        option = "--constraint" if constraint != "affine" else "--free"
        refuse(f"Invalid option '{option}' with --local. Local corrections are symmetric and have no constraint.")


def _draw_local(
    projection: Projection, region: Place | None, radius_km: float, picture: PictureFile | None, form: str
) -> None:
    """The field of local corrections, as a picture, as JSON, or both."""
    if picture is None:
        field = plots.local_figure(projection, radius_km, region=region)[1]
    else:
        with drawing(picture.path):
            figure, field = plots.local_figure(
                projection, radius_km, region=region, step=picture.step, size=picture.size, dpi=picture.dots
            )
        picture.save(lambda **_: figure)
    present(Report(data=field.to_dict, written=[picture.path if picture else None]), form)


def _report(result: Correction, given: str, picture: PictureFile | None) -> Report:
    errors = {
        "as it is": result.airy_kavrayskiy,
        "after the best scale": result.airy_kavrayskiy_scaled,
        "after the best linear map (MDT)": result.airy_kavrayskiy_affine,
        f"corrected ({result.constraint}), measured again": result.airy_kavrayskiy_corrected,
    }
    rows = [{"map": name, "value": value, "error": result.error_estimate} for name, value in errors.items()]
    return Report(
        title=f"{result.projection.name} over {result.region.name} ({size_text(result.region)})",
        tables=[Table(rows, [Column("map"), Column("value", "Airy-Kavrayskiy", rounded, error="error")])],
        notes=[*_notes(result)],
        data=lambda: result.to_dict() | {"projection": given},
        copies={
            "proj": Copy(result.pipeline, "A function has no PROJ pipeline."),
            "wkt": Copy(result.wkt, result.wkt_reason),
        },
        about=result.projection.name,
        written=[picture.path if picture else None],
        maps=Mapped([result.projection, result.corrected], ["As it is", "Corrected"], result.region),
    )


def _notes(result: Correction) -> Iterator[str]:
    (xx, xy), (yx, yy) = result.matrix
    yield f"The error of these figures is about {first_digit(result.error_estimate)}."
    yield f"x' = {xx:.9g} x {xy:+.9g} y" if xy else f"x' = {xx:.9g} x"
    yield f"y' = {yx:.9g} x {yy:+.9g} y" if yx else f"y' = {yy:.9g} y"
    yield f"That is {result.words}."
    if result.note:
        yield result.note
    yield from covers(result.coverage)
    yield ""
    if result.parameters:
        yield f"By its own parameters: {result.parameters}"
    yield f"PROJ: {result.pipeline}" if result.pipeline else "PROJ: none; a function has no pipeline."
    yield "WKT2: see --format wkt" if result.wkt else f"WKT2: none; {result.wkt_reason}"
