"""The commands."""

from __future__ import annotations

import io
import sys
from typing import Annotated, Any

import typer

from projdist import __version__
from projdist.cli.check import check_command
from projdist.cli.clouds import clouds_command
from projdist.cli.correct import correct_command
from projdist.cli.errors import fail, refuse, report
from projdist.cli.formats import STATISTICS, render_comparison, render_factors
from projdist.cli.indices import IndicesOption, add_indices, chosen_indices
from projdist.cli.layers import LAYER_SUFFIXES, RASTER_SUFFIXES, check_layer_options, write_layer, write_raster
from projdist.cli.ldp import ldp_command
from projdist.cli.lists import list_command
from projdist.cli.mosaic import mosaic_command
from projdist.cli.oldmap import oldmap_command
from projdist.cli.optimize import optimize_command
from projdist.cli.options import (
    DpiOption,
    FormatOption,
    MeasuresOption,
    OutputOption,
    OverwriteOption,
    Projections,
    RegionOption,
    SizeOption,
    WeightOption,
    file_of_kind,
    format_of,
    levels_of,
    measure_names,
    number,
    printed_or_file,
    region_of,
    size_of,
    step_of,
)
from projdist.cli.output import drawing, emit
from projdist.cli.parser import Command, Commands
from projdist.cli.points import read_points
from projdist.cli.recommend import recommend_command
from projdist.cli.tables import is_table_file, measure_file, write_table
from projdist.projections import Projection, ProjectionError
from projdist.regions import GLOBE, Box, Place
from projdist.results import DEFAULT_TOLERANCE, compare, factors, summarize

app = typer.Typer(
    name="projdist",
    cls=Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        emit(f"projdist {__version__}\n", None)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Measure, compare and draw the distortion of any map projection."""
    if context.invoked_subcommand is None:
        sys.stderr.write(f"{context.get_help()}\n")
        raise typer.Exit(2)


@app.command("compare", cls=Command)
def compare_command(
    projections: Projections,
    region: RegionOption = "globe",
    weight: WeightOption = None,
    measure: MeasuresOption = None,
    indices: IndicesOption = None,
    sort: Annotated[
        str, typer.Option("--sort", help="given, name, an airy_kavrayskiy..., INDEX, or MEASURE or MEASURE.STATISTIC.")
    ] = "airy_kavrayskiy",
    tolerance: Annotated[
        str, typer.Option(metavar="NUMBER", help="Largest error of the Airy-Kavrayskiy figures.")
    ] = f"{DEFAULT_TOLERANCE:g}",
    format: FormatOption = "table",
    output: OutputOption = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Compare projections over a region: Airy-Kavrayskiy errors, statistics of measures, published indices."""
    path, form, names = printed_or_file(output, overwrite), format_of(format), measure_names(measure)
    published = chosen_indices(indices)
    column = _sort_column(sort, names, [index.name for index in published])
    # Rounding alone is of the order of 1e-15.
    largest = number("tolerance", tolerance, 1e-15, 1.0)
    area = region_of(region, weight)
    result = compare(projections, area, measures=names, tolerance=largest).to_dict()
    add_indices(result["results"], area, published, largest)
    result["results"] = _sorted(result["results"], column, projections)
    emit(render_comparison(result, names, published, sort, largest, form), path, overwrite)
    report([failure["error"] for failure in result["failures"]])


_SORTS = (
    "given",
    "name",
    "coverage",
    "evaluations",
    "error_estimate",
    "airy_kavrayskiy",
    "airy_kavrayskiy_scaled",
    "airy_kavrayskiy_affine",
)


def _sort_column(key: str, measures: list[str], indices: list[str]) -> tuple[str, str]:
    """The column of a sort key, and its statistic, "" for a column that has none."""
    if key in _SORTS:
        return key, ""
    if key in indices:
        return "indices", key
    if key in measures:
        return key, "mean"
    measure, _, statistic = key.rpartition(".")
    if measure not in measures or statistic not in STATISTICS:
        refuse(
            f"Invalid sort key '{key}'. It must be {', '.join(_SORTS)}, one of the indices asked for with --indices, "
            f"or one of the measures asked for with --measure, alone or with .{', .'.join(STATISTICS)}."
        )
    return measure, statistic


def _sorted(rows: list[dict[str, Any]], key: tuple[str, str], given: list[str]) -> list[dict[str, Any]]:
    """Rows in the order of a column; None goes last."""
    column, statistic = key

    def order(row: dict[str, Any]) -> tuple[bool, Any]:
        if column == "given":
            return False, given.index(row["projection"])
        value = row[column][statistic] if statistic else row[column]
        if column == "indices":
            value = value["value"]
        return value is None, value if value is not None else 0.0

    return sorted(rows, key=order)


@app.command("factors", cls=Command)
def factors_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    coordinates: Annotated[
        list[str] | None,
        typer.Argument(metavar="LON LAT...", help="Degrees; - reads lines of 'lon lat [text]' from stdin."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="FILE[#LAYER]", help="Points to add columns to: CSV with lon and lat, or any that GDAL reads."
        ),
    ] = None,
    measure: MeasuresOption = None,
    prefix: Annotated[str, typer.Option(metavar="TEXT", help="What the columns added to FILE begin with.")] = "",
    format: FormatOption = "table",
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="File to write instead of printing; with --at, and always for the last three, its suffix tells what "
            "it is: .csv, .parquet, .gpkg or .geojson.",
        ),
    ] = None,
    overwrite: OverwriteOption = False,
) -> None:
    """Scales, angles and other measures of a projection at points."""
    path, form, names = printed_or_file(output, overwrite), format_of(format), measure_names(measure)
    if (coordinates is None) == (at is None):
        refuse("Invalid points. They must be LON LAT..., - for stdin, or --at FILE. See 'projdist factors --help'.")
    try:
        measured = Projection.from_user_input(projection)
    except ProjectionError as error:
        fail(str(error))
        raise typer.Exit(1) from error
    if at is not None:
        measure_file(measured, projection, at, names, prefix, form, path, overwrite)
        return
    try:
        points = read_points(coordinates or [], sys.stdin)
    except ValueError as error:
        refuse(str(error), error)
    result = factors(measured, points.lon, points.lat, measures=names).to_dict()
    result["projection"] = projection
    if any(points.text):
        for row, text in zip(result["results"], points.text, strict=True):
            row["text"] = text
    if path is not None and is_table_file(path):
        write_table(measured, result["results"], path, overwrite)
    else:
        emit(render_factors(result, measured.name, form), path, overwrite)
    report(points.problems)


@app.command("tissot", cls=Command)
def tissot_command(
    projections: Projections,
    output: Annotated[
        str,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Picture: .png, .svg or .pdf; or layer of polygons: .gpkg, .geojson."
        ),
    ] = "tissot.png",
    region: RegionOption = "globe",
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = "150",
    overwrite: OverwriteOption = False,
) -> None:
    """Draw Tissot's indicatrices."""
    from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

    path = file_of_kind(output, (*plots.SUFFIXES, *LAYER_SUFFIXES), overwrite)
    if path.suffix.lower() in LAYER_SUFFIXES:
        check_layer_options(path, {"--size": size, "--dpi": dpi if dpi != "150" else None})
        write_layer(projections, path, region=region_of(region), step=step_of(step), overwrite=overwrite)
        return
    dots, spacing = number("dpi", dpi, 10, 1200), step_of(step)
    inches = size_of(size, dots)
    maps, area, figures, problems = _maps(projections, region)
    with drawing(path):
        figure = plots.tissot_figure(maps, region=area, step=spacing, size=inches, dpi=dots, airy_kavrayskiy=figures)
        plots.save(figure, path, dpi=dots, overwrite=overwrite)
    emit(f"{path}\n", None)
    report(problems)


@app.command("heatmap", cls=Command)
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
    region: RegionOption = "globe",
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between graticule lines.")] = None,
    levels: Annotated[str | None, typer.Option(help="Number of isolines, or values in any order, as 1,1.5,2.")] = None,
    cmap: Annotated[str | None, typer.Option(help="Name of a matplotlib colour map.")] = None,
    size: Annotated[
        str | None,
        typer.Option(help="Inches of a picture, as 10,6; pixels of a raster: of its longer side, or as 1000,500."),
    ] = None,
    dpi: DpiOption = "150",
    resolution: Annotated[
        str | None, typer.Option(metavar="NUMBER", help="Side of a raster's pixels in the unit of its CRS.")
    ] = None,
    grid: Annotated[
        str, typer.Option(metavar="map|lonlat", help="CRS of a raster: the map's own, or longitude and latitude.")
    ] = "map",
    overwrite: OverwriteOption = False,
) -> None:
    """Draw a measure as a field of colour with isolines, or write measures as a GeoTIFF."""
    from projdist import plots  # as above

    names = measure_names(measure or ["fisher"])
    path = file_of_kind(output, (*plots.SUFFIXES, *RASTER_SUFFIXES), overwrite)
    if path.suffix.lower() in RASTER_SUFFIXES:
        drawn = {"--step": step, "--levels": levels, "--cmap": cmap, "--dpi": dpi if dpi != "150" else None}
        check_layer_options(path, drawn)
        write_raster(
            projections,
            names,
            path,
            region=region_of(region),
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
    dots, spacing, isolines = number("dpi", dpi, 10, 1200), step_of(step), levels_of(levels)
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
    emit(f"{path}\n", None)
    report(problems)


def _maps(given: list[str], region: str) -> tuple[list[Projection], Place | None, list[float], list[str]]:
    """The projections that can be measured, what to draw, their Airy-Kavrayskiy figures over it, and the failures.

    The region is None for the globe: a CRS then shows its area of use.
    """
    area = region_of(region)
    maps: list[Projection] = []
    figures: list[float] = []
    problems: list[str] = []
    for text in given:
        try:
            projection = Projection.from_user_input(text)
            drawn = area
            if area == GLOBE and projection.area_of_use is not None:
                drawn = Box(*projection.area_of_use)
            # Titles show three decimals.
            figures.append(summarize(projection, drawn, tolerance=1e-5).airy_kavrayskiy)
            maps.append(projection)
        except ProjectionError as error:
            problems.append(str(error))
    if not maps:
        report(problems)
    return maps, None if area == GLOBE else area, figures, problems


app.command("correct", cls=Command, context_settings={"ignore_unknown_options": False})(correct_command)
app.command("optimize", cls=Command, context_settings={"ignore_unknown_options": False})(optimize_command)
app.command("ldp", cls=Command, context_settings={"ignore_unknown_options": False})(ldp_command)
app.command("mosaic", cls=Command, context_settings={"ignore_unknown_options": False})(mosaic_command)
app.command("recommend", cls=Command, context_settings={"ignore_unknown_options": False})(recommend_command)
app.command("oldmap", cls=Command, context_settings={"ignore_unknown_options": False})(oldmap_command)
app.command("clouds", cls=Command, context_settings={"ignore_unknown_options": False})(clouds_command)
app.command("check", cls=Command, context_settings={"ignore_unknown_options": False})(check_command)
app.command("list", cls=Command, context_settings={"ignore_unknown_options": False})(list_command)


def main() -> None:
    """Run the command line."""
    for name in ("stdin", "stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # it was closed: nothing to read, nobody to read it
            setattr(sys, name, io.StringIO())
        elif isinstance(stream, io.TextIOWrapper):
            # Bytes that are no text of the locale's encoding are shown as escapes, and stop nothing.
            stream.reconfigure(errors="backslashreplace")
    app()
