"""The commands that draw maps, or write them as layers and rasters: `tissot`, `heatmap` and `morph`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from projdist import plots
from projdist.answers import compare
from projdist.cli import options as opt
from projdist.cli.errors import progress_bar, refuse, refusing, tell_problems
from projdist.cli.formats import drawing, tell_written
from projdist.cli.pictures import (
    LAYER_SUFFIXES,
    RASTER_SUFFIXES,
    FilmOptions,
    PictureFile,
    PictureOptions,
    check_layer_options,
    write_layer,
    write_raster,
)
from projdist.projections import Projection

_TOLERANCE = 1e-5  # titles show three decimals


def tissot_command(
    projections: opt.Projections,
    output: str = opt.output("Picture: .png, .svg or .pdf; or layer of polygons: .gpkg, .geojson.", "tissot.png"),
    region: opt.Region = None,
    step: str | None = opt.option("NUMBER", "Degrees between the ellipses."),
    grid: str | None = opt.option("LAT,LON", "Ellipses at multiples of these degrees, not evenly."),
    exaggerate: str | None = opt.option("NUMBER|auto", "So many times the distortion that there is."),
    axes: bool = opt.flag("--axes", "Principal directions as crosses."),
    context: opt.Context = None,
    *,
    pictured: PictureOptions,
) -> None:
    """Draw Tissot's indicatrices."""
    path = opt.file_of_kind(output, (*plots.SUFFIXES, *LAYER_SUFFIXES), pictured.overwrite)
    if path.suffix.lower() in LAYER_SUFFIXES:
        crosses = "" if axes else None
        drawn = {"--grid": grid, "--exaggerate": exaggerate, "--axes": crosses, "--context": context}
        check_layer_options(path, drawn | pictured.given())
        write_layer(
            projections,
            path,
            region=opt.region_given(region, projections),
            step=opt.step_of(step),
            overwrite=pictured.overwrite,
        )
        return
    shown = opt.context_of(context)
    picture = PictureFile(output, pictured, step=step)
    options: dict[str, Any] = {"grid": _grid(grid, step), "axes": axes, "context": shown}
    if exaggerate is not None:
        options["exaggeration"] = "auto" if exaggerate == "auto" else opt.number("exaggeration", exaggerate, 0.1, 1e6)
    _draw(plots.tissot_figure, projections, region, picture, **options)


def _grid(text: str | None, step: str | None) -> tuple[float, float] | None:
    """Spacing of the ellipses in degrees of latitude and longitude."""
    if text is None:
        return None
    if step is not None:
        refuse("Invalid option '--grid'. It cannot be used with --step.")
    words = text.split(",")
    if len(words) != 2:
        refuse(f"Invalid grid '{text}'. It must be degrees of latitude and of longitude, as 10,15.")
    lat, lon = (opt.number("grid", word, 1e-4, 90.0, " of degrees") for word in words)
    return lat, lon


def heatmap_command(
    projections: opt.Projections,
    measure: list[str] | None = opt.option(
        "NAME",
        "See 'projdist list measures'; fisher if none. A raster may have several, with commas.",
        None,
        *opt.MEASURE,
    ),
    output: str = opt.output("Picture: .png, .svg or .pdf; or GeoTIFF: .tif.", "heatmap.png"),
    against: str | None = opt.option(
        "PROJECTION", "Draw by how much the measure is more than on this map; scales over its."
    ),
    region: opt.Region = None,
    step: str | None = opt.option("NUMBER", "Degrees between graticule lines."),
    levels: str | None = opt.option("NUMBERS", "Number of isolines, or values in any order, as 1,1.5,2."),
    cmap: str | None = opt.option("NAME", "A colour map of matplotlib."),
    context: opt.Context = None,
    size: str | None = opt.option(
        "WIDTH,HEIGHT", "Inches of a picture, as 10,6; pixels of a raster: of its longer side, or as 1000,500."
    ),
    resolution: str | None = opt.option("NUMBER", "Side of a raster's pixels in the unit of its CRS."),
    grid: str = opt.option("map|lonlat", "CRS of a raster: the map's own, or longitude and latitude.", "map"),
    *,
    pictured: PictureOptions,
) -> None:
    """Draw a measure as a field of colour with isolines, or write measures as a GeoTIFF."""
    names = opt.measure_names(measure or ["fisher"])
    path = opt.file_of_kind(output, (*plots.SUFFIXES, *RASTER_SUFFIXES), pictured.overwrite)
    if path.suffix.lower() in RASTER_SUFFIXES:
        drawn = {"--step": step, "--levels": levels, "--cmap": cmap, "--context": context}
        drawn |= {"--against": against}
        check_layer_options(path, drawn | pictured.given(but="--size"))
        write_raster(
            projections,
            names,
            path,
            region=opt.region_given(region, projections),
            grid=grid,
            size=size,
            resolution=resolution,
            overwrite=pictured.overwrite,
        )
        return
    if resolution is not None or grid != "map":
        option = "--grid" if resolution is None else "--resolution"
        refuse(f"Invalid option '{option}' for '{path}'. It is for rasters, whose suffix is .tif.")
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A picture shows one; a .tif has room for several.")
    picture = PictureFile(output, pictured, step=step)
    shown = opt.context_of(context)
    options: dict[str, Any] = {"measure": names[0], "levels": opt.levels_of(levels), "cmap": cmap, "context": shown}
    if against is not None:
        with refusing():
            options["against"] = Projection.from_user_input(against)
    _draw(plots.heatmap_figure, projections, region, picture, **options)


def _draw(
    figure: Callable[..., Any], given: list[str], region: str | None, picture: PictureFile, **options: Any
) -> None:
    """Draw the measurable projections with their Airy-Kavrayskiy errors; report the others' failures."""
    other = options.get("against")
    listed = given if other is None else [*given, other]  # for a region that all have
    area = opt.region_given(region, [*given, *([] if other is None else [other.definition])])
    with refusing(), progress_bar("maps measured") as progress:
        found = compare(listed, area, sort="given", tolerance=_TOLERANCE, progress=progress)
    drawn = [one for one in found.results if one.projection is not other]
    if drawn and len(found.results) - len(drawn) == (other is not None):
        maps = [one.projection for one in drawn]
        figures = [one.airy_kavrayskiy for one in drawn]
        options |= {"region": found.region, "step": picture.step, "airy_kavrayskiy": figures}
        picture.save(figure, maps, **options)
        tell_written(picture.path)
    tell_problems([failure.error for failure in found.failures])


# ---- morph ---------------------------------------------------------------------------------------


def morph_command(
    first: str = opt.argument("PROJECTION", "Where the film begins, as for compare."),
    second: str = opt.argument("PROJECTION", "What it flows into, and back from."),
    output: str = opt.output("Film: .gif, or .mp4 (with ffmpeg).", "morph.gif"),
    measure: list[str] | None = opt.option(
        "NAME", "Its colours; fisher if none (see 'projdist list measures').", None, *opt.MEASURE
    ),
    region: opt.Region = None,
    frames: str = opt.option("NUMBER", "Pictures on the way there.", "24"),
    seconds: str = opt.option("NUMBER", "There and back, without the rests.", "4"),
    size: str = opt.option("WIDTH,HEIGHT", "In inches.", "7,4.6"),
    dpi: str = opt.option("NUMBER", "Dots per inch.", "100"),
    *,
    pictured: FilmOptions,
) -> None:
    """Make a film of one map that flows into another, in the colours of a measure."""
    path = opt.file_of_kind(output, plots.FILM_SUFFIXES, pictured.overwrite, "film")
    names = opt.measure_names(measure or ["fisher"])
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A film shows one.")
    count, length = opt.whole_number("frames", frames, 2, 500), opt.number("seconds", seconds, 0.1, 600)
    dots = opt.dots_of(dpi)
    room, area = opt.size_of(size, dots), opt.region_given(region, [first, second])
    shown = pictured.look()
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
            overwrite=pictured.overwrite,
            progress=progress,
            look=shown,
        )
    tell_written(path)
