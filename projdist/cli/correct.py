"""The command `correct`."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Annotated, Any

import typer

from projdist.cli.errors import fail, refuse
from projdist.cli.formats import json_text, rounded, table_text
from projdist.cli.options import (
    DpiOption,
    RegionOption,
    SizeOption,
    choice,
    number,
    picture_file,
    region_of,
    size_of,
    step_of,
)
from projdist.cli.output import drawing, emit
from projdist.correction import CONSTRAINTS, Correction, correct
from projdist.projections import Projection, ProjectionError
from projdist.regions import GLOBE, Region


class _Form(enum.StrEnum):
    TABLE = "table"
    JSON = "json"
    PROJ = "proj"
    WKT = "wkt"


def correct_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    region: RegionOption = "globe",
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
    dpi: DpiOption = "150",
) -> None:
    """Find the linear map that lessens a map's distortion most, and the corrected map."""
    form, area = _Form(choice("format", format, list(_Form))), region_of(region)
    choice("constraint", constraint, list(CONSTRAINTS))
    if output is None and local is not None:
        refuse("Invalid option '--local'. It needs a picture to draw to: -o FILE.")
    if local is not None and form in (_Form.PROJ, _Form.WKT):
        refuse(f"Invalid format '{form}' with --local. It must be table or json.")
    try:
        measured = Projection.from_user_input(projection)
        if output is not None:
            picture = _Picture(output, step, size, dpi, area)
        if output is not None and local is not None:
            radius = number("radius", local, 1e-3, 10_000.0, " of km")
            found = picture.draw_local(measured, radius)
            emit(json_text(found) if form is _Form.JSON else f"{picture.path}\n", None)
            return
        result = correct(measured, area, constraint=constraint, keep_north=keep_north)
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    text = _text(result, projection, form)
    if output is not None:
        picture.draw(result)
        text += f"Picture: {picture.path}\n" if form is _Form.TABLE else ""
    emit(text, None)


class _Picture:
    """A picture to draw, from the words of its options."""

    def __init__(self, output: str, step: str | None, size: str | None, dpi: str, region: Region) -> None:
        from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

        self.plots = plots
        self.path: Path = picture_file(output, plots.SUFFIXES)
        self.dots, self.step = number("dpi", dpi, 10, 1200), step_of(step)
        self.size = size_of(size, self.dots)
        self.region = None if region == GLOBE else region

    def draw(self, result: Correction) -> None:
        """Tissot's indicatrices before and after."""
        maps = [result.projection, result.corrected]
        figures = [result.airy_kavrayskiy, result.airy_kavrayskiy_corrected]
        with drawing(self.path):
            figure = self.plots.tissot_figure(
                maps, region=self.region, step=self.step, size=self.size, dpi=self.dots, airy_kavrayskiy=figures
            )
            self.plots.save(figure, self.path, dpi=self.dots)

    def draw_local(self, projection: Projection, radius_km: float) -> dict[str, Any]:
        """The field of local corrections; returns it as a dictionary."""
        with drawing(self.path):
            figure, field = self.plots.local_figure(
                projection, radius_km, region=self.region, step=self.step, size=self.size, dpi=self.dots
            )
            self.plots.save(figure, self.path, dpi=self.dots)
        return field.to_dict()


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
    columns = {"map": list(errors), "Airy-Kavrayskiy": [rounded(e, result.error_estimate) for e in errors.values()]}
    title = f"{result.projection.name} over {result.region.name} ({result.region.area_km2:,.0f} km2)\n"
    (xx, xy), (yx, yy) = result.matrix
    lines = [
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
    body = "\n".join(line for index, line in enumerate(lines) if line or index == 5)
    return title + table_text(columns, "") + body + "\n"
