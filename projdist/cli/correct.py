"""The command `correct`."""

from __future__ import annotations

import enum
import functools
from typing import Annotated

import typer

from projdist.answers import CONSTRAINTS, Correction, correct
from projdist.cli.errors import fail, refuse
from projdist.cli.formats import area_text, json_text, notes_text, rounded, table_text
from projdist.cli.options import DpiOption, OverwriteOption, SizeOption, choice, number, region_of
from projdist.cli.output import drawing, emit, wrote
from projdist.cli.pictures import PictureFile, picture_of
from projdist.projections import Projection, ProjectionError
from projdist.regions import Place


class _Form(enum.StrEnum):
    TABLE = "table"
    JSON = "json"
    PROJ = "proj"
    WKT = "wkt"


def correct_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    region: Annotated[
        str | None,
        typer.Option("--region", "-r", help="As for compare; without it the area of use of a CRS, else the globe."),
    ] = None,
    constraint: Annotated[
        str,
        typer.Option(metavar="|".join(CONSTRAINTS), help="Any linear map, one that keeps areas, or a scale alone."),
    ] = "affine",
    keep_north: Annotated[
        bool,
        typer.Option("--keep-north/--free", help="Keep the map's vertical, or turn it so that north is up on average."),
    ] = True,
    format: Annotated[str, typer.Option("--format", "-f", metavar="|".join(_Form), help="How to print.")] = "table",
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Picture of the map before and after: .png, .svg or .pdf."),
    ] = None,
    local: Annotated[
        str | None,
        typer.Option(metavar="KM", help="Draw, in its place, the corrections that caps of this radius would have."),
    ] = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses or caps.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Find the linear map that lessens a map's distortion most, and the corrected map."""
    form, area = _Form(choice("format", format, list(_Form))), None if region is None else region_of(region)
    choice("constraint", constraint, list(CONSTRAINTS))
    picture = picture_of(output, size=size, dpi=dpi, step=step, overwrite=overwrite)
    try:
        measured = Projection.from_user_input(projection)
        if local is not None:
            _check_local(form, picture, constraint, keep_north)
            _draw_local(measured, area, number("radius", local, 1e-3, 10_000.0, " of km"), picture, form)
            return
        result = correct(measured, area, constraint=constraint, keep_north=keep_north)
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    text = _text(result, projection, form)
    if picture is not None:
        _draw(result, picture)
        text += wrote(picture.path) if form is _Form.TABLE else ""
    emit(text, None)


def _draw(result: Correction, picture: PictureFile) -> None:
    """Tissot's indicatrices before and after."""
    from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

    picture.save(
        functools.partial(
            plots.tissot_figure,
            [result.projection, result.corrected],
            region=result.region,
            step=picture.step,
            airy_kavrayskiy=[result.airy_kavrayskiy, result.airy_kavrayskiy_corrected],
        )
    )


def _check_local(form: _Form, picture: PictureFile | None, constraint: str, keep_north: bool) -> None:
    if form in (_Form.PROJ, _Form.WKT):
        refuse(f"Invalid format '{form}' with --local. It must be table or json.")
    if picture is None and form is not _Form.JSON:
        refuse("Invalid option '--local'. It needs a picture to draw to, -o FILE, or --format json.")
    if constraint != "affine" or not keep_north:
        option = "--constraint" if constraint != "affine" else "--free"
        refuse(f"Invalid option '{option}' with --local. Local corrections are symmetric and have no constraint.")


def _draw_local(
    projection: Projection, region: Place | None, radius_km: float, picture: PictureFile | None, form: _Form
) -> None:
    """The field of local corrections, as a picture, as JSON, or both."""
    from projdist import plots  # as above

    if picture is None:
        field = plots.local_figure(projection, radius_km, region=region)[1]
    else:
        with drawing(picture.path):
            figure, field = plots.local_figure(
                projection, radius_km, region=region, step=picture.step, size=picture.size, dpi=picture.dots
            )
        picture.save(lambda **_: figure)
    emit(json_text(field.to_dict()) if picture is None or form is _Form.JSON else wrote(picture.path), None)


def _text(result: Correction, given: str, form: _Form) -> str:
    """A correction in a format; where it has no such form, the reason, and the end of the command."""
    if form is _Form.JSON:
        return json_text(result.to_dict() | {"projection": given})
    if form is _Form.TABLE:
        return _report(result)
    text, reason = {
        _Form.PROJ: (result.pipeline, "A function has no PROJ pipeline."),
        _Form.WKT: (result.wkt, result.wkt_reason),
    }[form]
    if text is None:
        fail(f"Invalid format '{form}' for {result.projection.name}. {reason}")
        raise typer.Exit(1)
    return f"{text}\n"


def _report(result: Correction) -> str:
    errors = {
        "as it is": result.airy_kavrayskiy,
        "after the best scale": result.airy_kavrayskiy_scaled,
        "after the best linear map (MDT)": result.airy_kavrayskiy_affine,
        f"corrected ({result.constraint}), measured again": result.airy_kavrayskiy_corrected,
    }
    error = result.error_estimate
    columns = {"map": list(errors), "Airy-Kavrayskiy": [rounded(value, error) for value in errors.values()]}
    title = f"{result.projection.name} over {result.region.name} ({area_text(result.region.area_km2)})"
    (xx, xy), (yx, yy) = result.matrix
    lines = [
        f"The error of these figures is about {error:.0e}.",
        f"x' = {xx:.9g} x {xy:+.9g} y" if xy else f"x' = {xx:.9g} x",
        f"y' = {yx:.9g} x {yy:+.9g} y" if yx else f"y' = {yy:.9g} y",
        f"That is {result.words}.",
        result.note,
        f"Covers {100 * result.coverage:.4g} % of the region." if result.coverage < 0.9999995 else "",
        "",
        f"By its own parameters: {result.parameters}" if result.parameters else "",
        f"PROJ: {result.pipeline}" if result.pipeline else "PROJ: none; a function has no pipeline.",
        "WKT2: see --format wkt" if result.wkt else f"WKT2: none; {result.wkt_reason}",
    ]
    shown = (line for index, line in enumerate(lines) if line or index == 6)
    return table_text(columns, title) + notes_text(shown)
