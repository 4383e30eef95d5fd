"""The commands that draw maps, or write them as layers and rasters: `tissot` and `heatmap`."""

from __future__ import annotations

from typing import Annotated

import typer

from projdist import plots
from projdist.answers import summarize
from projdist.cli.errors import refuse, tell_problems
from projdist.cli.layers import LAYER_SUFFIXES, RASTER_SUFFIXES, check_layer_options, write_layer, write_raster
from projdist.cli.options import (
    DpiOption,
    OverwriteOption,
    Projections,
    RegionOption,
    SizeOption,
    dots_of,
    file_of_kind,
    levels_of,
    measure_names,
    region_given,
    size_of,
    step_of,
)
from projdist.cli.output import drawing, tell_written
from projdist.projections import Projection, ProjectionError
from projdist.regions import Place, region_for


def tissot_command(
    projections: Projections,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Picture: .png, .svg or .pdf; or layer of polygons: .gpkg, .geojson."
        ),
    ] = "tissot.png",
    region: RegionOption = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Draw Tissot's indicatrices."""
    path = file_of_kind(output, (*plots.SUFFIXES, *LAYER_SUFFIXES), overwrite)
    if path.suffix.lower() in LAYER_SUFFIXES:
        check_layer_options(path, {"--size": size, "--dpi": dpi})
        write_layer(projections, path, region=region_given(region), step=step_of(step), overwrite=overwrite)
        return
    dots, spacing = dots_of(dpi), step_of(step)
    inches = size_of(size, dots)
    maps, area, figures, problems = _maps(projections, region)
    with drawing(path):
        figure = plots.tissot_figure(maps, region=area, step=spacing, size=inches, dpi=dots, airy_kavrayskiy=figures)
        plots.save(figure, path, dpi=dots, overwrite=overwrite)
    tell_written(path)
    tell_problems(problems)


def heatmap_command(
    projections: Projections,
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure",
            "-m",
            help="See 'projdist list measures'; fisher if none. A raster may have several, with commas.",
        ),
    ] = None,
    output: Annotated[
        str,
        typer.Option("--output", "-o", metavar="FILE", help="Picture: .png, .svg or .pdf; or GeoTIFF: .tif."),
    ] = "heatmap.png",
    region: RegionOption = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between graticule lines.")] = None,
    levels: Annotated[str | None, typer.Option(help="Number of isolines, or values in any order, as 1,1.5,2.")] = None,
    cmap: Annotated[str | None, typer.Option(help="Name of a matplotlib colour map.")] = None,
    size: Annotated[
        str | None,
        typer.Option(help="Inches of a picture, as 10,6; pixels of a raster: of its longer side, or as 1000,500."),
    ] = None,
    dpi: DpiOption = None,
    resolution: Annotated[
        str | None, typer.Option(metavar="NUMBER", help="Side of a raster's pixels in the unit of its CRS.")
    ] = None,
    grid: Annotated[
        str, typer.Option(metavar="map|lonlat", help="CRS of a raster: the map's own, or longitude and latitude.")
    ] = "map",
    overwrite: OverwriteOption = False,
) -> None:
    """Draw a measure as a field of colour with isolines, or write measures as a GeoTIFF."""
    names = measure_names(measure or ["fisher"])
    path = file_of_kind(output, (*plots.SUFFIXES, *RASTER_SUFFIXES), overwrite)
    if path.suffix.lower() in RASTER_SUFFIXES:
        drawn = {"--step": step, "--levels": levels, "--cmap": cmap, "--dpi": dpi}
        check_layer_options(path, drawn)
        write_raster(
            projections,
            names,
            path,
            region=region_given(region),
            grid=grid,
            size=size,
            resolution=resolution,
            overwrite=overwrite,
        )
        return
    if resolution is not None or grid != "map":
        option = "--grid" if resolution is None else "--resolution"
        refuse(f"Invalid option '{option}' for '{path}'. It is for rasters, whose suffix is .tif.")
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A picture shows one; a .tif has room for several.")
    dots, spacing, isolines = dots_of(dpi), step_of(step), levels_of(levels)
    inches = size_of(size, dots)
    maps, area, figures, problems = _maps(projections, region)
    with drawing(path):
        figure = plots.heatmap_figure(
            maps,
            measure=names[0],
            region=area,
            step=spacing,
            levels=isolines,
            cmap=cmap,
            size=inches,
            dpi=dots,
            airy_kavrayskiy=figures,
        )
        plots.save(figure, path, dpi=dots, overwrite=overwrite)
    tell_written(path)
    tell_problems(problems)


def _maps(given: list[str], region: str | None) -> tuple[list[Projection], Place, list[float], list[str]]:
    """The projections that can be measured, what to draw, their Airy-Kavrayskiy figures over it, and the failures."""
    area = region_given(region)
    known: list[Projection] = []
    problems: list[str] = []
    for text in given:
        try:
            known.append(Projection.from_user_input(text))
        except ProjectionError as error:
            problems.append(str(error))
    place = region_for(area, known)
    maps: list[Projection] = []
    figures: list[float] = []
    for projection in known:
        try:
            # Titles show three decimals.
            figures.append(summarize(projection, place, tolerance=1e-5).airy_kavrayskiy)
            maps.append(projection)
        except ProjectionError as error:
            problems.append(str(error))
    if not maps:
        tell_problems(problems)
    return maps, place, figures, problems
