"""The command `factors`."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from projdist.answers import factors
from projdist.cli.errors import refuse, refusing, tell_problems
from projdist.cli.factor_report import factors_report
from projdist.cli.formats import TABLE
from projdist.cli.options import (
    FileFormatOption,
    MeasuresOption,
    OverwriteOption,
    format_for,
    format_of,
    measure_names,
    output_option,
    printed_or_file,
)
from projdist.cli.output import present
from projdist.cli.points import read_points
from projdist.cli.tables import TABLE_SUFFIXES, is_table_file, measure_file, write_table
from projdist.projections import Projection


def factors_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    coordinates: Annotated[
        list[str] | None,
        typer.Argument(metavar="LON LAT...", help="Degrees; - reads lines of 'lon lat [text]' from stdin."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="FILE[#LAYER]",
            help="Points to add columns to: a table (.csv, .tsv, .txt) with lon and lat, or any that GDAL reads.",
        ),
    ] = None,
    measure: MeasuresOption = None,
    prefix: Annotated[str, typer.Option(metavar="TEXT", help="What the columns added to FILE begin with.")] = "",
    format: FileFormatOption = None,
    output: Annotated[
        str | None,
        output_option(
            "File to write instead of printing; with --at, and always for the last three, its suffix tells what "
            "it is: .csv, .parquet, .gpkg or .geojson."
        ),
    ] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Scales, angles and other measures of a projection at points."""
    path, names = printed_or_file(output, overwrite), measure_names(measure)
    # The points of a file have formats of their own.
    form = format_for(format, path, others=TABLE_SUFFIXES) if at is None else format_of(format or TABLE)
    if (coordinates is None) == (at is None):
        refuse("Invalid points. They must be LON LAT..., - for stdin, or --at FILE. See 'projdist factors --help'.")
    with refusing():
        measured = Projection.from_user_input(projection)
    if at is not None:
        measure_file(measured, projection, at, names, prefix, form, path, overwrite)
        return
    with refusing():
        points = read_points(coordinates or [], sys.stdin)
    found = factors(measured, points.lon, points.lat, measures=names)
    result = found.to_dict() | {"projection": projection}
    if any(points.text):
        for row, text in zip(result["results"], points.text, strict=True):
            row["text"] = text
    if path is not None and is_table_file(path):
        write_table(measured, result["results"], path, overwrite)
    else:
        present(factors_report(result, ["lon", "lat", *found.columns()]), form, path, overwrite)
    tell_problems(points.problems)
