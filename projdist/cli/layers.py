"""Files for GIS programs: rasters and layers of one map each."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from projdist import gis
from projdist.cli.errors import refuse, refusing
from projdist.cli.options import choice, number
from projdist.cli.output import drawing, tell_written
from projdist.cli.progress import working
from projdist.projections import Projection
from projdist.regions import Place

RASTER_SUFFIXES = (".tif", ".tiff")
LAYER_SUFFIXES = (".gpkg", ".geojson")

_MOST_PIXELS = 1e8  # along a side; how many there may be in all is for the raster to say


def check_layer_options(path: Path, drawn: Mapping[str, str | None]) -> None:
    """Refuse options that are for pictures."""
    for option, value in drawn.items():
        if value is not None:
            refuse(f"Invalid option '{option}' for '{path}'. It is for pictures.")


def check_libraries(path: Path) -> None:
    """Refuse a file that cannot be written because a library is missing."""
    with refusing():
        gis.check_libraries(path)


def write_raster(
    given: Sequence[str],
    measures: Sequence[str],
    path: Path,
    *,
    region: Place | None,
    grid: str,
    size: str | None,
    resolution: str | None,
    overwrite: bool,
) -> None:
    """Measures of a map as a GeoTIFF."""
    choice("grid", grid, list(gis.GRIDS))
    pixels = _pixels(size)
    side = None if resolution is None else number("resolution", resolution, 1e-12, 1e12)
    check_libraries(path)
    projection = _only_map(given, path)
    with drawing(path), working("Measuring"):
        found = gis.raster(projection, measures, region=region, grid=grid, size=pixels, resolution=side)
        gis.save_raster(found, path, overwrite=overwrite)
    note(found.note)
    tell_written(path)


def write_layer(given: Sequence[str], path: Path, *, region: Place | None, step: float | None, overwrite: bool) -> None:
    """The indicatrices of a map as polygons."""
    check_libraries(path)
    projection = _only_map(given, path)
    with drawing(path):
        found = gis.indicatrices(projection, region=region, step=step)
        gis.save_layer(found, path, overwrite=overwrite)
    if found.crs is None:
        note(f"{projection.name} has no CRS; that of the layer is undefined, and its coordinates are metres.")
    tell_written(path)


def note(text: str) -> None:
    """Say something on standard error that is no failure."""
    if text:
        sys.stderr.write(f"projdist: Note: {text}\n")


def _only_map(given: Sequence[str], path: Path) -> Projection:
    """The map of a file that has room for one."""
    if len(given) != 1:
        refuse(f"Invalid projections '{' '.join(given)}' for '{path}'. A {path.suffix} file has one map; name one.")
    with refusing():
        return Projection.from_user_input(given[0])


def _pixels(text: str | None) -> int | tuple[int, int] | None:
    """The pixels of a raster's longer side, or of its width and height."""
    if text is None:
        return None
    words = text.replace("x", ",").split(",")
    if len(words) > 2 or not all(word.strip().isdecimal() for word in words):
        refuse(f"Invalid size '{text}'. It must be pixels of the longer side, or WIDTH,HEIGHT, as 1000 or 1000,500.")
    counts = [int(number("size", word, 1, _MOST_PIXELS, " of pixels")) for word in words]
    return counts[0] if len(counts) == 1 else (counts[0], counts[1])
