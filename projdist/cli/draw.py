"""The commands that draw maps, or write them as layers and rasters: `tissot`, `heatmap` and `morph`."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Annotated, Any

import typer

from projdist import plots
from projdist.answers import compare
from projdist.cli.errors import progress_bar, refuse, refusing, tell_problems
from projdist.cli.formats import drawing, tell_written
from projdist.cli.options import (
    ContextOption,
    DpiOption,
    OverwriteOption,
    Projections,
    RegionOption,
    SizeOption,
    context_of,
    dots_of,
    file_of_kind,
    levels_of,
    measure_names,
    number,
    output_option,
    region_given,
    size_of,
    step_of,
    whole_number,
)
from projdist.cli.pictures import (
    FILMS,
    LAYER_SUFFIXES,
    RASTER_SUFFIXES,
    LookWords,
    PictureFile,
    check_layer_options,
    look_of_words,
    look_options,
    with_looks,
    write_layer,
    write_raster,
)
from projdist.projections import Projection

_TOLERANCE = 1e-5  # titles show three decimals


@with_looks
def tissot_command(
    projections: Projections,
    output: Annotated[
        str, output_option("Picture: .png, .svg or .pdf; or layer of polygons: .gpkg, .geojson.")
    ] = "tissot.png",
    region: RegionOption = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses.")] = None,
    grid: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="Ellipses at multiples of these degrees, not evenly."),
    ] = None,
    exaggerate: Annotated[
        str | None,
        typer.Option(metavar="NUMBER|auto", help="So many times the distortion that there is."),
    ] = None,
    axes: Annotated[bool, typer.Option("--axes", help="Principal directions as crosses.")] = False,
    context: ContextOption = None,
    size: SizeOption = None,
    dpi: DpiOption = None,
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Draw Tissot's indicatrices."""
    path = file_of_kind(output, (*plots.SUFFIXES, *LAYER_SUFFIXES), overwrite)
    if path.suffix.lower() in LAYER_SUFFIXES:
        crosses = "" if axes else None
        drawn = {"--grid": grid, "--exaggerate": exaggerate, "--axes": crosses, "--context": context}
        check_layer_options(path, drawn | {"--size": size, "--dpi": dpi} | look_options(look))
        write_layer(
            projections, path, region=region_given(region, projections), step=step_of(step), overwrite=overwrite
        )
        return
    shown = context_of(context)
    picture = PictureFile(output, size=size, dpi=dpi, step=step, overwrite=overwrite, look=look)
    options: dict[str, Any] = {"grid": _grid(grid, step), "axes": axes, "context": shown}
    if exaggerate is not None:
        options["exaggeration"] = "auto" if exaggerate == "auto" else number("exaggeration", exaggerate, 0.1, 1e6)
    _draw(plots.tissot_figure, projections, region, picture, **options)


def _grid(text: str | None, step: str | None) -> tuple[float, float] | None:
    """Degrees of latitude and of longitude between ellipses."""
    if text is None:
        return None
    if step is not None:
        refuse("Invalid option '--grid'. It cannot be used with --step.")
    words = text.split(",")
    if len(words) != 2:
        refuse(f"Invalid grid '{text}'. It must be degrees of latitude and of longitude, as 10,15.")
    lat, lon = (number("grid", word, 1e-4, 90.0, " of degrees") for word in words)
    return lat, lon


@with_looks
def heatmap_command(
    projections: Projections,
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure",
            "-m",
            metavar="NAME",
            help="See 'projdist list measures'; fisher if none. A raster may have several, with commas.",
        ),
    ] = None,
    output: Annotated[str, output_option("Picture: .png, .svg or .pdf; or GeoTIFF: .tif.")] = "heatmap.png",
    against: Annotated[
        str | None,
        typer.Option(
            metavar="PROJECTION", help="Draw by how much the measure is more than on this map; scales over its."
        ),
    ] = None,
    region: RegionOption = None,
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between graticule lines.")] = None,
    levels: Annotated[
        str | None, typer.Option(metavar="NUMBERS", help="Number of isolines, or values in any order, as 1,1.5,2.")
    ] = None,
    cmap: Annotated[str | None, typer.Option(metavar="NAME", help="A colour map of matplotlib.")] = None,
    context: ContextOption = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="WIDTH,HEIGHT",
            help="Inches of a picture, as 10,6; pixels of a raster: of its longer side, or as 1000,500.",
        ),
    ] = None,
    dpi: DpiOption = None,
    resolution: Annotated[
        str | None, typer.Option(metavar="NUMBER", help="Side of a raster's pixels in the unit of its CRS.")
    ] = None,
    grid: Annotated[
        str, typer.Option(metavar="map|lonlat", help="CRS of a raster: the map's own, or longitude and latitude.")
    ] = "map",
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Draw a measure as a field of colour with isolines, or write measures as a GeoTIFF."""
    names = measure_names(measure or ["fisher"])
    path = file_of_kind(output, (*plots.SUFFIXES, *RASTER_SUFFIXES), overwrite)
    if path.suffix.lower() in RASTER_SUFFIXES:
        drawn = {"--step": step, "--levels": levels, "--cmap": cmap, "--context": context, "--dpi": dpi}
        check_layer_options(path, drawn | {"--against": against} | look_options(look))
        write_raster(
            projections,
            names,
            path,
            region=region_given(region, projections),
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
    picture = PictureFile(output, size=size, dpi=dpi, step=step, overwrite=overwrite, look=look)
    shown = context_of(context)
    options: dict[str, Any] = {"measure": names[0], "levels": levels_of(levels), "cmap": cmap, "context": shown}
    if against is not None:
        with refusing():
            options["against"] = Projection.from_user_input(against)
    _draw(plots.heatmap_figure, projections, region, picture, **options)


def _draw(
    figure: Callable[..., Any], given: list[str], region: str | None, picture: PictureFile, **options: Any
) -> None:
    """Draw the projections that can be measured, with their Airy-Kavrayskiy figures, and say why others cannot."""
    other = options.get("against")
    listed = given if other is None else [*given, other]  # for a region that all have
    area = region_given(region, [*given, *([] if other is None else [other.definition])])
    with refusing(), progress_bar("maps measured") as progress:
        found = compare(listed, area, sort="given", tolerance=_TOLERANCE, progress=progress)
    drawn = [one for one in found.results if one.projection is not other]
    if drawn and len(found.results) - len(drawn) == (other is not None):
        maps = [one.projection for one in drawn]
        figures = [one.airy_kavrayskiy for one in drawn]
        options |= {"region": found.region, "step": picture.step, "airy_kavrayskiy": figures}
        picture.save(functools.partial(figure, maps, **options))
        tell_written(picture.path)
    tell_problems([failure.error for failure in found.failures])


# ---- morph ---------------------------------------------------------------------------------------


@functools.partial(with_looks, less=FILMS)
def morph_command(
    first: Annotated[str, typer.Argument(metavar="PROJECTION", help="Where the film begins, as for compare.")],
    second: Annotated[str, typer.Argument(metavar="PROJECTION", help="What it flows into, and back from.")],
    output: Annotated[str, output_option("Film: .gif, or .mp4 (with ffmpeg).")] = "morph.gif",
    measure: Annotated[
        list[str] | None,
        typer.Option(
            "--measure", "-m", metavar="NAME", help="Its colours; fisher if none (see 'projdist list measures')."
        ),
    ] = None,
    region: RegionOption = None,
    frames: Annotated[str, typer.Option(metavar="NUMBER", help="Pictures on the way there.")] = "24",
    seconds: Annotated[str, typer.Option(metavar="NUMBER", help="There and back, without the rests.")] = "4",
    size: Annotated[str, typer.Option(metavar="WIDTH,HEIGHT", help="In inches.")] = "7,4.6",
    dpi: Annotated[str, typer.Option(metavar="NUMBER", help="Dots per inch.")] = "100",
    overwrite: OverwriteOption = False,
    look: LookWords | None = None,
) -> None:
    """Make a film of one map that flows into another, in the colours of a measure."""
    path = file_of_kind(output, plots.FILM_SUFFIXES, overwrite, "film")
    names = measure_names(measure or ["fisher"])
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A film shows one.")
    count, length = whole_number("frames", frames, 2, 500), number("seconds", seconds, 0.1, 600)
    dots = dots_of(dpi)
    room, area = size_of(size, dots), region_given(region, [first, second])
    shown = look_of_words(look or {})
    with refusing():
        maps = Projection.from_user_input(first), Projection.from_user_input(second)
    with drawing(path), progress_bar("frames") as progress:
        plots.morph(
            *maps,
            path,
            measure=names[0],
            region=area,
            frames=count,
            seconds=length,
            size=room or (7.0, 4.6),
            dpi=dots,
            overwrite=overwrite,
            progress=progress,
            look=shown,
        )
    tell_written(path)
