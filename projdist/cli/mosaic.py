"""The command `mosaic`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from projdist.cli.errors import fail, refuse
from projdist.cli.formats import Format, csv_text, json_text, markdown_text, table_text
from projdist.cli.options import FormatOption, OverwriteOption, choice, format_of, number, output_file
from projdist.cli.output import emit
from projdist.mosaics import FRAMES, MODELS, Mosaic, check_frame, mosaic, parse_sizes, read_correspondences
from projdist.rigid import ROTATIONS

_FIGURES = {
    "affine": "Dist_F of each image in the plane of one of them and in that of the MDT; below, the sum of squares.",
    "homography": "Dist_F of each image, RMS over it; below, the mean of squares. -: an image reaches infinity.",
}


def mosaic_command(
    correspondences: Annotated[
        str, typer.Option(metavar="FILE", help="Points in common: CSV with model,i,j,xi,yi,xj,yj in pixels.")
    ],
    sizes: Annotated[
        str | None,
        typer.Option(
            metavar="WxH,...",
            help="Pixels of the images, one for all or one each; else a comment line of FILE has them.",
        ),
    ] = None,
    model: Annotated[str, typer.Option(metavar="|".join(MODELS), help="The maps of the images.")] = "affine",
    frame: Annotated[
        str,
        typer.Option(metavar=f"{'|'.join(FRAMES)}|INDEX", help="The common frame: the MDT's, or an image's plane."),
    ] = "mdt",
    rotation: Annotated[
        str, typer.Option(metavar="|".join(ROTATIONS), help="How the MDT's frame is turned.")
    ] = "chordal",
    tolerance: Annotated[str, typer.Option(metavar="PIXELS", help="Points farther off are wrong.")] = "4",
    weights: Annotated[str | None, typer.Option(metavar="NUMBERS", help="Weights of the images, with commas.")] = None,
    format: FormatOption = "table",
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Report to write, JSON.")] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Bring overlapping images or map sheets into the common frame that distorts them least."""
    form = format_of(format)
    options: dict[str, Any] = {
        "model": choice("model", model, list(MODELS)),
        "rotation": choice("rotation", rotation, list(ROTATIONS)),
        "tolerance": number("tolerance", tolerance, 1e-3, 1e4, " of pixels"),
        "weights": None if weights is None else [number("weight", word, 0.0, 1e12) for word in weights.split(",")],
    }
    path = None if report is None else output_file(report, overwrite)
    try:
        points = read_correspondences(correspondences, model=model, sizes=None if sizes is None else parse_sizes(sizes))
        options["frame"] = check_frame(frame, len(points.sizes))
        if weights is not None and len(options["weights"]) != len(points.sizes):
            raise ValueError(f"Invalid weights '{weights}'. There must be {len(points.sizes)}, one an image.")
    except ValueError as error:
        refuse(str(error), error)
    try:
        found = mosaic(points, **options)
    except ValueError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    if path is not None:
        emit(json_text(found.to_dict()), path, overwrite)
    emit(_text(found, form), None)
    for note in found.notes:
        fail(note)


def _text(found: Mosaic, form: Format) -> str:
    result = found.to_dict()
    if form is Format.JSON:
        return json_text(result)
    rows = [
        {"image": image} | {frame: of_images and of_images[row] for frame, of_images in result["distortions"].items()}
        for row, image in enumerate(result["images"])
    ]
    if form is Format.CSV:
        return csv_text(rows, ["image"])
    columns = {"image": [*(row["image"] for row in rows), "all"]}
    for frame, figure in result["frames"].items():
        reference = result["references"].get(frame)
        title = frame if reference is None else f"{frame} ({reference})"
        columns[title] = [*(_figure(row[frame]) for row in rows), _figure(figure)]
    about = f"{_FIGURES[result['model']]}\n"
    if result["impossible"]:
        about += (
            f"The planes of {len(result['impossible'])} of {len(found.images)} images send others through infinity.\n"
        )
    canvas = result["canvas"]
    figures = (
        f"Frame {result['frame']}: {canvas['width']} x {canvas['height']} pixels; the points fit to "
        f"{result['rms_pixels']:.3g} pixels RMS; mean resultant length {result['resultant_length']:.4f}.\n"
    )
    if form is Format.MARKDOWN:
        return f"{markdown_text(columns)}\n{about}{figures}"
    return table_text(columns, f"{len(found.images)} images, {result['model']}") + about + figures


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
