"""The command `correct`."""

from __future__ import annotations

from collections.abc import Iterator

from projdist import plots
from projdist.answers import CONSTRAINTS, CORRECTION_CRITERIA, Correction, correct
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing
from projdist.cli.formats import HTML, JSON, TABLE, drawing, present
from projdist.cli.number_format import covers, first_digit, rounded, size_text
from projdist.cli.pictures import PictureFile, PictureOptions, picture_of
from projdist.cli.report import Column, Copy, Mapped, Report, Table
from projdist.field import Spread
from projdist.projections import Projection
from projdist.regions import Place

_FORMS = (TABLE, JSON, HTML, "proj", "wkt")


def correct_command(
    projection: opt.OneProjection,
    region: opt.Region = None,
    criterion: str = opt.option(
        CORRECTION_CRITERIA,
        "Least mean square of the distortion, or its least mean, by the geometric median of the Jacobians.",
        "mean",
    ),
    constraint: str = opt.option(CONSTRAINTS, "Any linear map, one that keeps areas, or a scale alone.", "affine"),
    keep_north: bool = opt.flag(
        "--keep-north/--free", "Keep the map's vertical, or turn it so that north is up on average.", True
    ),
    format: str | None = opt.report_format(_FORMS),
    output: str | None = opt.output("Picture of the map before and after: .png, .svg or .pdf; or a page: .html."),
    local: str | None = opt.option("KM", "Draw, in its place, the corrections that caps of this radius would have."),
    step: str | None = opt.option("NUMBER", "Degrees between the ellipses or caps."),
    *,
    pictured: PictureOptions,
) -> None:
    """Find the linear map that reduces a map's distortion most, and the corrected map."""
    form, page = opt.form_and_page(format, output, pictured.overwrite, _FORMS)
    area = opt.region_given(region, [projection])
    opt.choice("criterion", criterion, CORRECTION_CRITERIA)
    opt.choice("constraint", constraint, CONSTRAINTS)
    picture = picture_of(
        output,
        pictured,
        step=step,
        beside=(opt.PAGE_SUFFIX,),
    )
    with refusing():
        measured = Projection.from_user_input(projection)
        if local is not None:
            _check_local(form, picture, criterion, constraint, keep_north)
            _draw_local(measured, area, opt.number("radius", local, 1e-3, 10_000.0, " of km"), picture, form)
            return
        result = correct(measured, area, criterion=criterion, constraint=constraint, keep_north=keep_north)
    if picture is not None:
        maps, figures = (
            [result.projection, result.corrected],
            [result.airy_kavrayskiy, result.airy_kavrayskiy_corrected],
        )
        picture.save(plots.tissot_figure, maps, region=result.region, step=picture.step, airy_kavrayskiy=figures)
    present(_report(result, projection, picture), form, page, pictured.overwrite)


def _check_local(form: str, picture: PictureFile | None, criterion: str, constraint: str, keep_north: bool) -> None:
    if form not in (TABLE, JSON):
        refuse(f"Invalid format '{form}' with --local. It must be table or json.")
    if picture is None and form != JSON:
        refuse("Invalid option '--local'. It needs a picture to draw to, -o FILE, or --format json.")
    if criterion != "mean":
        refuse("Invalid option '--criterion' with --local. Local corrections are by the mean.")
    if constraint != "affine" or not keep_north:
        option = "--constraint" if constraint != "affine" else "--free"
        refuse(f"Invalid option '{option}' with --local. Local corrections are symmetric and have no constraint.")


def _draw_local(
    projection: Projection, region: Place | None, radius_km: float, picture: PictureFile | None, form: str
) -> None:
    """Draw the field of local corrections, or print it as JSON."""
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
    by = result.constraint if result.criterion == "mean" else result.criterion
    figures = {
        "as it is": (result.airy_kavrayskiy, result.spread),
        "after the best scale": (result.airy_kavrayskiy_scaled, None),
        "after the best linear map (MDT)": (result.airy_kavrayskiy_affine, result.spread_affine),
        f"corrected ({by}), measured again": (result.airy_kavrayskiy_corrected, result.spread_corrected),
    }
    rows = [
        {"map": name, "value": value, "error": result.error_estimate} | _spread(spread)
        for name, (value, spread) in figures.items()
        if spread is not None or result.spread is None
    ]
    columns: list[Column | str] = ["map", Column("value", "Airy-Kavrayskiy", rounded, error="error")]
    if result.spread is not None:
        columns += [
            Column("mean", "mean distortion", rounded, error="mean_error"),
            Column("half", "half the area below", rounded, error="half_error"),
        ]
    return Report(
        title=f"{result.projection.name} over {result.region.name} ({size_text(result.region)})",
        tables=[Table(rows, columns)],
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


def _spread(spread: Spread | None) -> dict[str, float]:
    """Cells of the mean and the median distortion."""
    if spread is None:
        return {}
    (mean, mean_error), (half, half_error) = spread
    return {"mean": mean, "mean_error": mean_error, "half": half, "half_error": half_error}


def _notes(result: Correction) -> Iterator[str]:
    (xx, xy), (yx, yy) = result.matrix
    if result.spread is None:
        yield f"The error of these figures is about {first_digit(result.error_estimate)}."
    else:
        yield f"The error of the matrix is about {first_digit(result.matrix_error)}."
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
