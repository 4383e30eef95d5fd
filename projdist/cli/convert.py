"""The command `convert`."""

from __future__ import annotations

from typing import Annotated

import typer

from projdist import gis
from projdist.cli.errors import refuse, working
from projdist.cli.formats import drawing, tell_written
from projdist.cli.options import OverwriteOption, choice, file_of_kind, number, output_option
from projdist.cli.pictures import check_libraries, note

_RESAMPLINGS = ("nearest", "bilinear", "cubic", "average", "mode")
_SUFFIXES = (".gpkg", ".geojson", ".fgb", ".shp", ".parquet", ".tif", ".tiff")


def convert_command(
    data: Annotated[
        str,
        typer.Argument(metavar="DATA[#LAYER]", help="Points, lines, polygons or pixels that GDAL reads."),
    ],
    to: Annotated[
        str | None, typer.Option(metavar="CRS", help="A code, WKT, a PROJ string, or a .wkt file of 'projdist design'.")
    ] = None,
    source: Annotated[
        str | None, typer.Option("--from", metavar="CRS", help="That of the data, where their file has lost it.")
    ] = None,
    densify: Annotated[
        str | None, typer.Option(metavar="KM", help="Divide edges into pieces of at most so many kilometres.")
    ] = None,
    resampling: Annotated[
        str, typer.Option(metavar="|".join(_RESAMPLINGS), help="How pixels get their values.")
    ] = "nearest",
    resolution: Annotated[
        str | None, typer.Option(metavar="NUMBER", help="The side of a pixel in the unit of the CRS.")
    ] = None,
    output: Annotated[str | None, output_option("A new .gpkg, .geojson, .fgb, .shp, .parquet or .tif.")] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Transform layers and rasters to another CRS, also one made by design, and back."""
    if to is None:
        refuse("Invalid option '--to'. It must name a CRS.")
    if output is None:
        refuse("Invalid option '--output'. It must name a file.")
    path = file_of_kind(output, _SUFFIXES, overwrite)
    choice("resampling", resampling, list(_RESAMPLINGS))
    piece = None if densify is None else number("distance", densify, 1e-6, 1e5, " of kilometres")
    side = None if resolution is None else number("resolution", resolution, 1e-12, 1e12)
    check_libraries(path)
    with drawing(path), working("Converting"):
        found = gis.convert(
            data,
            to,
            path,
            source=source,
            densify=piece,
            resampling=resampling,
            resolution=side,
            overwrite=overwrite,
        )
    note(found.note)
    tell_written(found.path, *([found.wkt] if found.wkt else []))
