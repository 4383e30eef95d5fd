"""The commands `mean-map` and `world-map`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from projdist import plots
from projdist.cli import options as opt
from projdist.cli.errors import cannot_write, progress_bar, refuse, refusing
from projdist.cli.formats import JSON, TABLE, present
from projdist.cli.number_format import certain, covers, per_cent, size_text
from projdist.cli.pictures import PictureFile, PictureOptions, picture_of
from projdist.cli.report import Column, Copy, Report, Table
from projdist.designs import AGAINST, WORLD_SYMMETRIES, MeanMap, WorldMap, mean_map, world_map

_MEAN_FORMS = (TABLE, JSON, "proj", "wkt", "wkt-derived", "projjson")


def mean_map_command(
    projections: opt.Projections,
    region: opt.Region = None,
    weights: str | None = opt.option("NUMBERS", "What each map counts, as 1,2; else all the same."),
    degree: str | None = opt.option(
        "NUMBER", "Of the polynomials; 8 if not given, of maps of the world 9, at most 12."
    ),
    datum: opt.Datum = None,
    name: str | None = opt.option("TEXT", "Of the map."),
    format: str | None = opt.file_format(_MEAN_FORMS, ".json, .wkt or .txt"),
    output: opt.Output = None,
    picture: str | None = opt.option("FILE", "The mean beside the average: .png, .svg or .pdf."),
    *,
    pictured: PictureOptions,
) -> None:
    """Find the mean of several maps: the map that is nearest to all in distortion."""
    path = opt.printed_or_file(output, pictured.overwrite)
    form = opt.format_for(format, path, _MEAN_FORMS)
    drawn = picture_of(picture, pictured)
    area = opt.region_given(region, projections)
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
        maps, titles = [found.projection, found.average], ["Mean", "Average of coordinates"]
        drawn.save(plots.heatmap_figure, maps, region=found.region, titles=titles)
    present(_mean_report(found, drawn), form, path, pictured.overwrite)


def _numbers(text: str) -> list[float]:
    try:
        return [float(value) for value in text.split(",")]
    except ValueError:
        refuse(f"Invalid weights '{text}'. They must be numbers with commas, as 1,2.")


def _mean_report(found: MeanMap, picture: PictureFile | None) -> Report:
    crs = found.crs
    missing = "A map of the world, or after a function, is no CRS; JSON has its coefficients."
    return Report(
        title=f"{found.projection.name} over {found.region.name} ({size_text(found.region)})",
        lead=[*_mean_lead(found)],
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


def _mean_lead(found: MeanMap) -> Iterator[str]:
    """Degree and weights of the mean."""
    on = "in longitude and in latitude" if found.base is None else f"on {found.base.definition}"
    yield f"Degree {found.degree} {on}"
    if len(set(found.weights)) > 1:
        yield f"Weights {', '.join(f'{one:g}' for one in found.weights)}"


def _standings(found: MeanMap) -> Table:
    """Table of the bound, the mean, the average and the given maps."""
    columns: list[Column | str] = [
        Column("kind", "map", left=True),
        Column("name", left=True),
        Column("total", "sum of squared distances", functools.partial(certain, error=found.error)),
        Column("airy_kavrayskiy", "airy_kavrayskiy_scaled", certain, error="error"),
    ]
    return Table(found.standings, columns)


def _notes(found: MeanMap) -> Iterator[str]:
    yield (
        "The distance of two maps is the Fisher distortion from the plane of the one to that of the other at the same "
        "point of the ground."
    )
    yield "The bound is that of the metrics' means at each point, which no map need have."
    yield from found.notes
    if found.crs is not None:
        yield "To take it elsewhere: --format wkt, wkt-derived, proj or projjson, or -o FILE.wkt."


# ---- world map -----------------------------------------------------------------------------------


_FORMS = (TABLE, JSON)
_GOOD = 1e-4  # to which the errors over the globe are measured


def world_map_command(
    region: str | None = opt.argument("[REGION]", "What to show well, as --region of compare; all if not given.", None),
    cut: str = opt.option(
        "LON|POINTS",
        "A meridian; or points as '-170,40 -70,-62', from the first through the others to its antipode.",
        "180",
    ),
    weight: opt.Weight = None,
    elsewhere: str = opt.option("NUMBER", "The weight of what is not in the region, 1e-4 to 1.", "0.02"),
    until: str = opt.option("LAT", "Where the map ends, north and south.", "90"),
    symmetric: str = opt.option(WORLD_SYMMETRIES, "About what.", "auto"),
    exponent: str | None = opt.option("NUMBER", "Of the energy, 0 to 1; 1/8 if not given, 0: Airy-Kavrayskiy."),
    cells: str | None = opt.option("NUMBER", "Of the mesh, either way, 8 to 128; 32 or, of a region, 64."),
    against: list[str] | None = opt.option("PROJECTION", "A map to compare with. May be repeated."),
    format: str | None = opt.file_format(_FORMS, ".json or .txt"),
    output: opt.Output = None,
    tinshift: str | None = opt.option("FILE", "Triangles for PROJ's tinshift, a .json to write."),
    step: str = opt.option("DEGREES", "Between the triangles' corners.", "2"),
    picture: str | None = opt.option("FILE", "A heat map of the Fisher distortion: .png, .svg or .pdf."),
    *,
    pictured: PictureOptions,
) -> None:
    """Make the map of the world that distorts a region least."""
    path = opt.printed_or_file(output, pictured.overwrite)
    form = opt.format_for(format, path, _FORMS)
    drawn = picture_of(picture, pictured)
    triangles = (
        None if tinshift is None else opt.file_of_kind(tinshift, (".json",), pictured.overwrite, "file of triangles")
    )
    corners = opt.number("step", step, 0.2, 30.0, " of degrees")
    if weight is not None and region is None:
        refuse(f"Invalid weight '{weight}' without a region. Name one, as globe.")
    options: dict[str, Any] = {
        "cut": _cut(cut),
        "elsewhere": opt.number("weight elsewhere", elsewhere, 1e-4, 1.0),
        "until": opt.number("end", until, 10.0, 90.0, " of degrees"),
        "symmetric": opt.choice("symmetry", symmetric, WORLD_SYMMETRIES),
        "against": against or AGAINST,
        "cells": None if cells is None else _whole(cells),
    }
    if exponent is not None:
        options["exponent"] = opt.number("exponent", exponent, 0.0, 1.0)
    area = None if region is None else opt.region_of(region, weight)
    with refusing(), progress_bar("cells") as progress:
        found = world_map(area, **options, progress=progress)
    pipeline = None if triangles is None else _written(found, triangles, corners, pictured.overwrite)
    if drawn is not None:
        titles, figures = ["Made to measure"], [found.airy_kavrayskiy]
        drawn.save(plots.heatmap_figure, found.projection, titles=titles, airy_kavrayskiy=figures)
    present(_report(found, pipeline, [triangles, drawn.path if drawn else None]), form, path, pictured.overwrite)


def _cut(text: str) -> float | list[list[float]]:
    """Cut of the map: a longitude, or a list of points."""
    try:
        values = [[float(value) for value in word.split(",")] for word in text.split()]
    except ValueError:
        values = []
    if len(values) == 1 and len(values[0]) == 1:
        return values[0][0]
    if len(values) < 2 or any(len(point) != 2 for point in values):
        refuse(f"Invalid cut '{text}'. It must be a longitude, or two or more points as '-170,40 -70,-62'.")
    return values


def _whole(text: str) -> int:
    if not text.isdecimal():
        refuse(f"Invalid number of cells '{text}'. It must be even, within 8 and 128.")
    return int(text)


def _written(found: WorldMap, path: Path, step: float, overwrite: bool) -> str:
    """Write the triangles; returns the PROJ operation that reads them."""
    try:
        return found.write_tinshift(path, step=step, overwrite=overwrite)
    except FileExistsError as error:
        refuse(str(error), error)
    except OSError as error:
        cannot_write(path, error)


def _report(found: WorldMap, pipeline: str | None, written: list[Path | None]) -> Report:
    return Report(
        title=f"{found.projection.name} ({size_text(found.region)})",
        lead=[*_lead(found)],
        tables=[_maps(found), _meshes(found)],
        notes=[
            "Airy-Kavrayskiy errors of other maps are at their best scales.",
            *([f"PROJ: {pipeline}"] * bool(pipeline)),
        ],
        data=lambda: found.to_dict() | {"pipeline": pipeline},
        about=found.projection.name,
        written=written,
    )


def _lead(found: WorldMap) -> Iterator[str]:
    yield f"airy_kavrayskiy {certain(found.airy_kavrayskiy, found.error_estimate)}"
    if found.symmetric != "none":
        yield f"Symmetric about: {found.symmetric}"
    yield from covers(found.coverage)
    if found.mirrored:
        yield f"It turns over {per_cent(found.mirrored)} of the region: take more cells."


def _maps(found: WorldMap) -> Table:
    """Table of the map and others."""
    columns: list[Column | str] = [
        Column("name", "map", left=True),
        Column("airy_kavrayskiy", "AK", certain, error="error_estimate"),
    ]
    if found.region.name != "globe" and found.until == 90.0:
        columns.append(Column("over_globe", "over the globe", functools.partial(certain, error=_GOOD)))
    return Table(found._table(), columns)


def _meshes(found: WorldMap) -> Table:
    """Table of the refinements of the mesh."""
    columns: list[Column | str] = [
        Column("cells", show="{0:d} x {0:d}".format),
        Column("unknowns", show="{:d}".format),
        Column("energy", show="{:.6f}".format),
        Column("airy_kavrayskiy", "AK at nodes", "{:.6f}".format),
        Column("steps", show="{:d}".format),
    ]
    return Table(found.refinements, columns)
