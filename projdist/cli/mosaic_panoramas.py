"""The command `mosaic` for a camera that only turns: panoramas on maps of the sphere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from projdist.applications.mosaics import Correspondences, MappedPanorama, Panorama, panorama, panoramas_of_groups
from projdist.cli.errors import fail
from projdist.cli.formats import json_text
from projdist.cli.mosaic_pictures import MosaicFile, picture_notes
from projdist.cli.output import present, put
from projdist.cli.progress import working
from projdist.cli.report import Column, Report, Table
from projdist.projections import ProjectionLike

# What panoramas are usually drawn in, beside the best; the first is called spherical elsewhere.
_USUAL = {
    "eqc": "plate carrée",
    "merc": "Mercator",
    "cc": "cylindrical",
    "stere": "stereographic",
    "gnom": "plane (gnomonic)",
}
_TOLERANCE = 1e-4  # of figures of three digits


def present_panoramas(
    points: Correspondences,
    *,
    projection: str | None,
    focal: str,
    tolerance: float,
    most_pixels: float,
    all_groups: bool,
    target: MosaicFile | None,
    report: Path | None,
    overwrite: bool,
    form: str,
) -> None:
    """Find the cameras, choose the projection, draw and print; what cannot be ends the command with 1."""
    options: dict[str, Any] = {"focal": focal, "tolerance": tolerance}
    try:
        with working("Adjusting"):
            groups = panoramas_of_groups(points, **options) if all_groups else [panorama(points, **options)]
        with working("Finding the projection"):
            mapped = [_mapped(found, projection, most_pixels) for found in groups]
            results = [_result(found) for found in mapped]
    except ValueError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    targets = [] if target is None else [target.of_group(number) for number in range(len(groups))]
    for found, result, picture in zip(mapped, results, targets, strict=False):
        result["picture"] = picture.save_panorama(found)
    data = {"mosaics": results} if all_groups else results[0]
    if report is not None:
        put(json_text(data), report, overwrite)
    present(_report(results, data, [*(one.path for one in targets), report]), form)
    for note in dict.fromkeys(note for found in groups for note in found.told(others=not all_groups)):
        fail(note)
    for one in mapped:
        if note := one.canvas().note:
            fail(note)
    if groups[0].alone if all_groups else groups[0].left_out:
        raise typer.Exit(1)


def _mapped(found: Panorama, projection: str | None, most_pixels: float) -> MappedPanorama:
    """The panorama on the map that was asked for, or on the one that distorts the part of the sphere seen least."""
    if projection is not None:
        return found.mapped(projection, most_pixels=most_pixels)
    from projdist.decisions import optimize  # slow to load

    best = optimize("auto", found, criterion="airy_kavrayskiy_scaled", ellipsoid="sphere")
    return found.mapped(best.projection, most_pixels=most_pixels)


def _result(found: MappedPanorama) -> dict[str, Any]:
    """The report: the cameras, the projection, and what others would distort."""
    from projdist.answers import compare  # slow to load

    radius = found.projection.ellipsoid.a
    usual = {f"+proj={name} +R={radius}": words for name, words in _USUAL.items()}
    names = usual | {found.projection.definition: "this one"}
    maps: list[ProjectionLike] = [found.projection, *(usual.keys() - {found.projection.definition})]
    others = compare(maps, found.panorama, tolerance=_TOLERANCE)
    rows = [
        {
            "projection": names.get(one.projection.definition, one.projection.name),
            "definition": one.projection.definition,
            "airy_kavrayskiy_scaled": one.airy_kavrayskiy_scaled,
            "coverage": one.coverage,
        }
        for one in others.results
    ]
    canvas = found.canvas()
    return found.panorama.to_dict() | {
        "projection": found.projection.definition,
        "projections": rows,
        "canvas": {"width": canvas.width, "height": canvas.height, "scale": canvas.scale},
    }


def _report(results: list[dict[str, Any]], data: dict[str, Any], written: Sequence[Path | None]) -> Report:
    tables = [table for result in results for table in (_cameras(result), _projections(result))]
    counts = " and ".join(str(len(one["images"]) - len(one["left_out"])) for one in results)
    rows = [row for result in results for row in _cameras(result).rows]
    return Report(
        title=f"{counts} images, rotation",
        tables=tables,
        notes=[note for result in results for note in _notes(result)],
        data=lambda: data,
        rows=lambda: rows,
        header=["image"],
        written=written,
    )


def _cameras(result: dict[str, Any]) -> Table:
    """A row an image: where it looks."""
    keys = {"longitude": "longitudes", "latitude": "latitudes", "roll": "rolls", "focal": "focals"}
    rows = [
        {"image": image} | {key: result[column][row] for key, column in keys.items()}
        for row, image in enumerate(result["images"])
        if result["focals"][row] is not None
    ]
    angles = [Column(key, show="{:.2f}".format, unit="(°)") for key in ("longitude", "latitude", "roll")]
    return Table(rows, [Column("image", left=True), *angles, Column("focal", show="{:.1f}".format, unit="(pixels)")])


def _projections(result: dict[str, Any]) -> Table:
    """A row a projection: what it distorts of the part of the sphere that was seen."""
    columns = [
        Column("projection", left=True),
        Column("airy_kavrayskiy_scaled", "Airy-Kavrayskiy error", "{:.3g}".format, best=True),
        Column("coverage", "shown", "{:.0%}".format),
    ]
    return Table(result["projections"], columns)


def _notes(result: dict[str, Any]) -> list[str]:
    canvas = result["canvas"]
    focals = [value for value in result["focals"] if value is not None]
    errors = [value for value in result["focal_errors"] if value is not None]
    one = max(focals) - min(focals) < 1e-9 * max(focals)
    focal = f"Focal length {focals[0]:.1f} ± {errors[0]:.1g} pixels" if one else "Focal lengths as they are above"
    rms = f"the points fit to {result['rms_pixels']:.3g} pixels RMS"
    notes = [f"{focal}; {rms} ({result['rms_pixels_of_homographies']:.3g} with a homography a pair)."]
    notes.append(f"Projection: {result['projection']}.")
    if "picture" in result:
        return notes + picture_notes(result["picture"])
    return [*notes, f"The panorama has {canvas['width']} x {canvas['height']} pixels."]
