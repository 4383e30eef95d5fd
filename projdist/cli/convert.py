"""The command `convert`."""

from __future__ import annotations

from projdist import gis
from projdist.cli import options as opt
from projdist.cli.errors import refuse, working
from projdist.cli.formats import drawing, tell_written
from projdist.cli.pictures import check_libraries, note

_RESAMPLINGS = ("nearest", "bilinear", "cubic", "average", "mode")
_SUFFIXES = (".gpkg", ".geojson", ".fgb", ".shp", ".parquet", ".tif", ".tiff")


def convert_command(
    data: str = opt.argument("DATA[#LAYER]", "Points, lines, polygons or pixels that GDAL reads."),
    to: str | None = opt.option("CRS", "A code, WKT, a PROJ string, or a .wkt file of 'projdist design'."),
    source: str | None = opt.option("CRS", "That of the data, where their file has lost it.", None, "--from"),
    densify: str | None = opt.option("KM", "Divide edges into pieces of at most so many kilometres."),
    resampling: str = opt.option(_RESAMPLINGS, "How pixels get their values.", "nearest"),
    resolution: str | None = opt.option("NUMBER", "The side of a pixel in the unit of the CRS."),
    output: str | None = opt.output("A new .gpkg, .geojson, .fgb, .shp, .parquet or .tif."),
    overwrite: opt.Overwrite = False,
) -> None:
    """Transform layers and rasters to another CRS, also one made by design, and back."""
    if to is None:
        refuse("Invalid option '--to'. It must name a CRS.")
    if output is None:
        refuse("Invalid option '--output'. It must name a file.")
    path = opt.file_of_kind(output, _SUFFIXES, overwrite)
    opt.choice("resampling", resampling, _RESAMPLINGS)
    piece = opt.number("distance", densify, 1e-6, 1e5, " of kilometres")
    side = opt.number("resolution", resolution, 1e-12, 1e12)
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
