"""The commands."""

from __future__ import annotations

import contextlib
import enum
import io
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from projdist.catalogue import NAMES
from projdist.cli.formats import STATISTICS, Format, render_comparison, render_factors, render_list, write
from projdist.cli.points import read_points
from projdist.criteria import CRITERIA
from projdist.measures import MEASURES, Measure, get_measure
from projdist.projections import Projection, ProjectionError, projection_names
from projdist.regions import GLOBE, Box, Region, get_region
from projdist.results import DEFAULT_TOLERANCE, compare, factors, summarize

# What typer raises for a wrong command line. It has its own click in some versions and imports it in others.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]


@contextlib.contextmanager
def _one_line(arguments: bool = True) -> Iterator[None]:
    """Say a usage error in one line, as every other error is said; without arguments it is the help."""
    try:
        yield
    except _UsageError as error:
        message = str(getattr(error, "message", error))
        if not arguments:
            sys.stderr.write(f"{message}\n")
            raise typer.Exit(2) from error
        context = getattr(error, "ctx", None)
        formatted = error.format_message() if hasattr(error, "format_message") else message
        path = context.command_path if context else "projdist"
        _refuse(f"{formatted.rstrip('.')}. See '{path} --help'.", error)


class _Commands(TyperGroup):
    """The commands, with usage errors of one line."""

    def make_context(self, info_name: str | None, args: list[str], *others: Any, **extra: Any) -> Any:
        """Parse the options before the command."""
        with _one_line(bool(args)):
            return super().make_context(info_name, args, *others, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Parse and run the command."""
        with _one_line():
            return super().invoke(ctx)


app = typer.Typer(
    name="projdist",
    cls=_Commands,
    help="Measure, compare and draw the distortion of any map projection.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

# A negative number is no option: what looks like one and is none reaches the command as an argument.
_NEGATIVE_NUMBERS = {"ignore_unknown_options": True}

Projections = Annotated[
    list[str],
    typer.Argument(
        metavar="PROJECTION...", help="Names, PROJ strings, EPSG: or ESRI: codes, WKT, PROJJSON, .prj or .wkt files."
    ),
]
RegionOption = Annotated[
    str, typer.Option("--region", "-r", help="globe, box:W,S,E,N (W > E crosses the antimeridian) or cap:LON,LAT,KM.")
]
FormatOption = Annotated[Format, typer.Option("--format", "-f", help="How to print.")]
OutputOption = Annotated[Path | None, typer.Option("--output", "-o", help="File to write instead of printing.")]
MeasuresOption = Annotated[
    list[str] | None,
    typer.Option("--measure", "-m", help="A measure (see 'projdist list measures'); may be repeated, or with commas."),
]


class Listing(enum.StrEnum):
    """What `projdist list` can list."""

    PROJECTIONS = "projections"
    MEASURES = "measures"
    CRITERIA = "criteria"


def _fail(message: str) -> None:
    sys.stderr.write(f"projdist: {' '.join(message.split())}\n")


def _refuse(message: str, error: Exception | None = None) -> NoReturn:
    _fail(message)
    raise typer.Exit(2) from error


def _region(text: str) -> Region:
    try:
        return get_region(text)
    except ValueError as error:
        _refuse(str(error), error)


def _measures(given: list[str] | None) -> list[str]:
    names = [name.strip() for text in given or [] for name in text.split(",")]
    try:
        for name in names:
            get_measure(name)
    except ValueError as error:
        _refuse(str(error), error)
    return names


def _number(name: str, text: str, low: float, high: float, unit: str = "") -> float:
    """The number of an option, within limits."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        _refuse(f"Invalid {name} '{text}'. It must be a number{unit} within {low:g} and {high:g}.")
    return value


def _no_options(values: list[str]) -> None:
    """Refuse what looks like an option but is none: such words arrive as arguments."""
    for value in values:
        if value.startswith("-") and len(value) > 1 and not value[1:2].isdigit() and value[1:2] != ".":
            _refuse(f"Invalid option '{value}'. See --help for those there are.")


def _check_output(output: Path | None) -> None:
    """Refuse before the work what could not be written after it."""
    if output is not None and output.is_dir():
        _refuse(f"Invalid output '{output}'. It is a directory.")
    if output is not None and not output.parent.is_dir():
        _refuse(f"Invalid output '{output}'. There is no directory '{output.parent}'.")


def _write(text: str, output: Path | None) -> None:
    try:
        write(text, output)
    except OSError as error:
        if output is None:
            raise  # a closed pipe, which typer knows how to end on
        _cannot_write(output, error)


def _cannot_write(output: Path, error: OSError) -> NoReturn:
    _refuse(f"Invalid output '{output}'. It cannot be written: {error.strerror or error}.", error)


def _report(problems: list[str]) -> None:
    """Say what failed beside the results, and end with 1 where anything did."""
    for problem in problems:
        _fail(problem)
    if problems:
        raise typer.Exit(1)


@app.command("compare", context_settings=_NEGATIVE_NUMBERS)
def compare_command(
    projections: Projections,
    region: RegionOption = "globe",
    measure: MeasuresOption = None,
    sort: Annotated[
        str, typer.Option("--sort", help="given, name, an airy_kavrayskiy..., or MEASURE or MEASURE.STATISTIC.")
    ] = "airy_kavrayskiy",
    tolerance: Annotated[
        str, typer.Option(metavar="NUMBER", help="Largest error of the Airy-Kavrayskiy figures.")
    ] = f"{DEFAULT_TOLERANCE:g}",
    format: FormatOption = Format.TABLE,
    output: OutputOption = None,
) -> None:
    """Compare projections over a region: Airy-Kavrayskiy errors, and statistics of measures."""
    _no_options(projections)
    _check_output(output)
    names = _measures(measure)
    column = _sort_column(sort, names)
    # Rounding alone is of the order of 1e-15.
    largest = _number("tolerance", tolerance, 1e-15, 1.0)
    result = compare(projections, _region(region), measures=names, tolerance=largest).to_dict()
    result["results"] = _sorted(result["results"], column, projections)
    _write(render_comparison(result, names, sort, largest, format), output)
    _report([failure["error"] for failure in result["failures"]])


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


def _sort_column(key: str, measures: list[str]) -> tuple[str, str]:
    """The column of a sort key, and its statistic, "" for a column that has none."""
    if key in _SORTS:
        return key, ""
    if key in measures:
        return key, "mean"
    measure, _, statistic = key.rpartition(".")
    if measure not in measures or statistic not in STATISTICS:
        _refuse(
            f"Invalid sort key '{key}'. It must be {', '.join(_SORTS)}, or one of the measures asked for with "
            f"--measure, alone or with .{', .'.join(STATISTICS)}."
        )
    return measure, statistic


def _sorted(rows: list[dict[str, Any]], key: tuple[str, str], given: list[str]) -> list[dict[str, Any]]:
    """Rows in the order of a column; None goes last."""
    column, statistic = key

    def order(row: dict[str, Any]) -> tuple[bool, Any]:
        if column == "given":
            return False, given.index(row["projection"])
        value = row[column][statistic] if statistic else row[column]
        return value is None, value if value is not None else 0.0

    return sorted(rows, key=order)


@app.command("factors", context_settings=_NEGATIVE_NUMBERS)
def factors_command(
    projection: Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")],
    coordinates: Annotated[
        list[str], typer.Argument(metavar="LON LAT...", help="Degrees; - reads lines of 'lon lat [text]' from stdin.")
    ],
    measure: MeasuresOption = None,
    format: FormatOption = Format.TABLE,
    output: OutputOption = None,
) -> None:
    """Scales, angles and other measures of a projection at points."""
    _no_options([projection, *coordinates])
    _check_output(output)
    names = _measures(measure)
    try:
        points = read_points(coordinates, sys.stdin)
    except ValueError as error:
        _refuse(str(error), error)
    try:
        measured = Projection.from_user_input(projection)
        result = factors(measured, points.lon, points.lat, measures=names).to_dict()
    except ProjectionError as error:
        _fail(str(error))
        raise typer.Exit(1) from error
    result["projection"] = projection
    if any(points.text):
        for row, text in zip(result["results"], points.text, strict=True):
            row["text"] = text
    _write(render_factors(result, measured.name, format), output)
    _report(points.problems)


SizeOption = Annotated[str | None, typer.Option(help="Width and height of the picture in inches, as 10,6.")]
DpiOption = Annotated[str, typer.Option(metavar="NUMBER", help="Dots per inch.")]


@app.command("tissot", context_settings=_NEGATIVE_NUMBERS)
def tissot_command(
    projections: Projections,
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture to write: .png, .svg or .pdf.")] = Path(
        "tissot.png"
    ),
    region: RegionOption = "globe",
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between the ellipses.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = "150",
) -> None:
    """Draw Tissot's indicatrices."""
    from projdist import plots  # matplotlib is slow to load, and --help must not wait for it

    dots, spacing = _number("dpi", dpi, 10, 1200), _step(step)
    inches = _size(size, dots)
    _check_picture(output, plots.SUFFIXES)
    maps, area, figures, problems = _maps(projections, region)
    with _drawing(output):
        figure = plots.tissot_figure(maps, region=area, step=spacing, size=inches, dpi=dots, airy_kavrayskiy=figures)
        plots.save(figure, output, dpi=dots)
    _report(problems)


@app.command("heatmap", context_settings=_NEGATIVE_NUMBERS)
def heatmap_command(
    projections: Projections,
    measure: Annotated[str, typer.Option("--measure", "-m", help="See 'projdist list measures'.")] = "fisher",
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture to write: .png, .svg or .pdf.")] = Path(
        "heatmap.png"
    ),
    region: RegionOption = "globe",
    step: Annotated[str | None, typer.Option(metavar="NUMBER", help="Degrees between graticule lines.")] = None,
    levels: Annotated[str | None, typer.Option(help="Number of isolines, or their values as 1,1.5,2.")] = None,
    cmap: Annotated[str | None, typer.Option(help="Name of a matplotlib colour map.")] = None,
    size: SizeOption = None,
    dpi: DpiOption = "150",
) -> None:
    """Draw a measure as a field of colour with isolines."""
    from projdist import plots  # as above

    _measures([measure])
    dots, spacing, isolines = _number("dpi", dpi, 10, 1200), _step(step), _levels(levels)
    inches = _size(size, dots)
    _check_picture(output, plots.SUFFIXES)
    maps, area, figures, problems = _maps(projections, region)
    with _drawing(output):
        figure = plots.heatmap_figure(
            maps,
            measure=measure,
            region=area,
            step=spacing,
            levels=isolines,
            cmap=cmap,
            size=inches,
            dpi=dots,
            airy_kavrayskiy=figures,
        )
        plots.save(figure, output, dpi=dots)
    _report(problems)


def _maps(given: list[str], region: str) -> tuple[list[Projection], Region | None, list[float], list[str]]:
    """The projections that can be measured, what to draw, their Airy-Kavrayskiy figures over it, and the failures.

    The region is None for the globe: a CRS then shows its area of use.
    """
    _no_options(given)
    area = _region(region)
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
        _report(problems)
    return maps, None if area == GLOBE else area, figures, problems


@contextlib.contextmanager
def _drawing(output: Path) -> Iterator[None]:
    """Say what cannot be drawn or written, or where the picture is."""
    try:
        yield
    except ValueError as error:
        _refuse(str(error), error)
    except MemoryError as error:
        _refuse(f"Invalid picture '{output}'. It needs more memory than there is: take a larger step.", error)
    except OSError as error:
        _cannot_write(output, error)
    _write(f"{output}\n", None)


def _check_picture(output: Path, allowed: tuple[str, ...]) -> None:
    if output.suffix.lower() not in allowed:
        _refuse(f"Invalid picture file '{output}'. Its suffix must be {', '.join(allowed[:-1])} or {allowed[-1]}.")
    _check_output(output)


def _step(text: str | None) -> float | None:
    return None if text is None else _number("step", text, 0.1, 90, " of degrees")


_MOST_PIXELS = 4e8  # 1.6 GB of memory


def _size(text: str | None, dpi: float) -> tuple[float, float] | None:
    if text is None:
        return None
    width, comma, height = text.replace("x", ",").partition(",")
    if not comma or "," in height:
        _refuse(f"Invalid size '{text}'. It must be WIDTH,HEIGHT in inches, as 10,6.")
    size = _number("width", width, 0.5, 200, " of inches"), _number("height", height, 0.5, 200, " of inches")
    if size[0] * size[1] * dpi**2 > _MOST_PIXELS:
        _refuse(f"Invalid size '{text}' at {dpi:g} dots per inch. It must have at most {_MOST_PIXELS:.0e} pixels.")
    return size


_MOST_LEVELS = 100


def _levels(text: str | None) -> int | list[float] | None:
    """A number of isolines, or their values."""
    if text is None:
        return None
    try:
        values = [float(value) for value in text.split(",")]
    except ValueError:
        values = []
    if text.isdecimal() and 1 <= values[0] <= _MOST_LEVELS:
        return int(values[0])
    if text.isdecimal() or not values or len(values) > _MOST_LEVELS or not all(map(math.isfinite, values)):
        _refuse(f"Invalid levels '{text}'. It must be a number of them, 1 to {_MOST_LEVELS}, or values as 1,1.5,2.")
    return values


@app.command("list")
def list_command(
    what: Annotated[Listing, typer.Argument(metavar="WHAT", help="What to list.")], format: FormatOption = Format.TABLE
) -> None:
    """List the projections, measures or criteria that there are."""
    if what is Listing.PROJECTIONS:
        rows = [
            {"name": name, "kind": "name" if name in NAMES else "PROJ id", "definition": definition}
            for name, definition in projection_names().items()
        ]
    elif what is Listing.MEASURES:
        rows = [_measure_row(measure) for measure in MEASURES.values()]
        rows.append({"name": "scale@AZIMUTH", "symbol": "", "unit": "", "description": "Scale in an azimuth, degrees."})
    else:
        rows = [
            {"name": name, "description": (criterion.__doc__ or "").partition("\n")[0]}
            for name, criterion in CRITERIA.items()
        ]
        rows.append({"name": "pNN", "description": "Weighted percentile."})
    _write(render_list(rows, format), None)


def _measure_row(measure: Measure) -> dict[str, str]:
    return {
        "name": measure.name,
        "symbol": measure.symbol,
        "unit": measure.unit,
        "description": measure.description,
    }


def main() -> None:
    """Run the command line."""
    # Bytes that are no text of the locale's encoding are shown as escapes, and stop nothing.
    for stream in (sys.stdin, sys.stdout):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    app()
