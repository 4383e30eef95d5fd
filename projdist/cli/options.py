"""The options that commands share, and their values; an invalid one ends the command with 2."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, overload

import typer

from projdist import gis
from projdist.cli.errors import cannot_write, fail, refuse, refusing
from projdist.cli.formats import FORMATS, HTML, TABLE
from projdist.matrices import get_measure
from projdist.projections import Projection, ProjectionError
from projdist.regions import Place, get_region, region_for, weighted_points
from projdist.support import is_stream, notices_kept, refuse_existing


def argument(metavar: str, help: str, default: Any = ...) -> Any:
    """An argument, required without a default."""
    return typer.Argument(default, metavar=metavar, help=help)


def option(value: str | Iterable[str], help: str, default: Any = None, *flags: str) -> Any:
    """An option with a value or one of several words, named as its parameter unless `flags` are given."""
    return typer.Option(default, *flags, metavar=value if isinstance(value, str) else "|".join(value), help=help)


def flag(name: str, help: str, default: bool = False) -> Any:
    """An option without a value."""
    return typer.Option(default, name, help=help)


def output(help: str, default: str | None = None, metavar: str = "FILE") -> Any:
    """The option `--output` of a command."""
    return typer.Option(default, "--output", "-o", metavar=metavar, help=help)


def file_format(forms: Iterable[str] = FORMATS, suffixes: str = ".json, .csv, .md, .html or .txt") -> Any:
    """The option `--format` of a command that prints, or writes a file whose suffix tells its format."""
    return option(forms, f"How to print, a table if not given; a file's suffix tells it: {suffixes}.", None, *_FORMAT)


def report_format(forms: Iterable[str] = FORMATS) -> Any:
    """The option `--format` of a command that prints, and whose file may be a page."""
    return option(forms, "How to print, a table if not given.", None, *_FORMAT)


_FORMAT = ("--format", "-f")
MEASURE, CRITERION = ("--measure", "-m"), ("--criterion", "-c")
"""The names of these options."""

Projections = Annotated[
    list[str],
    typer.Argument(
        metavar="PROJECTION...",
        help="Names, also with parameters (robinson+lon_0=150) or a latitude and longitude for their centre "
        "(mollweide@45,-100), PROJ strings, EPSG: or ESRI: codes, WKT, PROJJSON, .prj or .wkt files.",
    ),
]
OneProjection = Annotated[str, typer.Argument(metavar="PROJECTION", help="As for compare.")]
RegionArgument = Annotated[
    str, typer.Argument(metavar="REGION", help="As --region of compare: country:DE, box:W,S,E,N, ...")
]
Region = Annotated[
    str | None,
    typer.Option(
        "--region",
        "-r",
        metavar="REGION",
        help="globe, land, ocean, box:W,S,E,N (W > E crosses the antimeridian), cap:LON,LAT,KM (within a geodesic "
        "distance), country:NAME, continent:NAME, state:NAME (of the USA), crs:CODE (its area of use), "
        "file:PATH[#LAYER] (polygons), geodesic:PATH (with geodesics for edges), points:PATH (lon, lat, weight), and "
        "combinations by ' & ', ' - ', ' + ' and brackets; @main behind a region is its main part. Without one: the "
        "area of use of a CRS, if all maps have the same, else the globe.",
    ),
]
Weight = Annotated[
    str | None,
    typer.Option(
        "--weight",
        metavar="FILE|COLUMN",
        help="Weights in place of areas: a raster of counts, as pop.tif or pop.tif#2 (a band), or, of points:PATH, a "
        "column.",
    ),
]
Regions = Annotated[
    list[str] | None,
    typer.Option(
        metavar="countries|continents|states|FILE",
        help="Each of many regions: all countries, continents or states of the USA, the features of a file "
        "(PATH#LAYER), or any region; may be repeated.",
    ),
]
Executor = Annotated[
    str | None,
    typer.Option(
        metavar="processes:N|dask://HOST:PORT",
        help="What the work runs on: processes of this machine, or a Dask scheduler; if not given, a process a core.",
    ),
]
Partial = Annotated[
    str | None,
    typer.Option(
        metavar="FILE",
        help="With --regions: where results are kept as they come; the same command goes on from it. If not given, "
        "beside the output, until that is written.",
    ),
]
Format = Annotated[str, typer.Option(*_FORMAT, metavar="|".join(FORMATS), help="How to print.")]
Output = Annotated[
    str | None, typer.Option("--output", "-o", metavar="FILE", help="File to write instead of printing.")
]
Datum = Annotated[
    str | None, typer.Option(metavar="CRS", help="The geographic CRS to base it on, as EPSG:4258; else WGS 84.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the file if there is one.")]
Measures = Annotated[
    list[str] | None,
    typer.Option(
        *MEASURE,
        metavar="NAME",
        help="A measure (see 'projdist list measures'); may be repeated, or with commas.",
    ),
]
Size = Annotated[str | None, typer.Option(metavar="WIDTH,HEIGHT", help="Of the picture in inches, as 10,6.")]
Context = Annotated[
    str | None,
    typer.Option(
        metavar="none|coast|borders|full", help="What a picture of a region shows of the Earth; full if not given."
    ),
]
Dpi = Annotated[str | None, typer.Option(metavar="NUMBER", help="Dots per inch; 150 if not given.")]

_MOST_PIXELS = 4e8  # 1.6 GB of memory
_MOST_LEVELS = 100


def choice(thing: str, text: str, allowed: Iterable[str]) -> str:
    """The text, if it is allowed."""
    allowed = list(allowed)
    if text not in allowed:
        refuse(f"Invalid {thing} '{text}'. It must be {', '.join(allowed[:-1])} or {allowed[-1]}.")
    return text


def format_of(text: str, forms: Sequence[str] = FORMATS) -> str:
    """The name of a format, if it is allowed."""
    return choice("format", text, list(forms))


_TOLD_BY = {".json": "json", ".csv": "csv", ".md": "markdown", ".html": HTML, ".wkt": "wkt"}
PAGE_SUFFIX = ".html"
_OF_ANY = (".txt", ".log", "")


def format_for(text: str | None, path: Path | None, forms: Sequence[str] = FORMATS, others: Sequence[str] = ()) -> str:
    """Format given by `--format` or by the output's suffix; refuses contradictions.

    `others` are suffixes of files that are not text.
    """
    stated = None if text is None else format_of(text, forms)
    suffix = "" if path is None or is_stream(path) else path.suffix.lower()
    told = _TOLD_BY.get(suffix)
    if suffix not in (*_OF_ANY, *others) and told not in forms:
        allowed = [*(known for known, form in _TOLD_BY.items() if form in forms), *others, *filter(None, _OF_ANY)]
        refuse(f"Invalid output '{path}'. Its suffix must be {', '.join(allowed)}, or none.")
    if told is not None and stated not in (None, told):
        refuse(f"Invalid format '{stated}' for '{path}'. Its suffix tells the format, {told}.")
    return told or stated or TABLE


def form_and_page(
    text: str | None, output: str | None, overwrite: bool, forms: Sequence[str] = FORMATS
) -> tuple[str, Path | None]:
    """Format, and path of the page if the output is one, of a command with other outputs than text."""
    stated = None if text is None else format_of(text, forms)
    if not is_page(output):
        return stated or TABLE, None
    if stated not in (None, HTML):
        refuse(f"Invalid format '{stated}' for '{output}'. Its suffix tells the format, {HTML}.")
    return HTML, printed_or_file(output, overwrite)


def is_page(output: str | None) -> bool:
    """True if the suffix is of a page."""
    return output is not None and Path(output).suffix.lower() == PAGE_SUFFIX


def region_given(text: str | None, maps: Iterable[str] = (), weight: str | None = None) -> Place | None:
    """Region of `--region`, None for the default of the maps; with weights the default is the globe."""
    return None if text is None and weight is None else region_of("globe" if text is None else text, weight, maps)


def region_of(text: str, weight: str | None = None, maps: Iterable[str] = ()) -> Place:
    """Region of a text, possibly weighted; prints notes on repairs."""
    known = _known(maps)
    with refusing():
        region = (region_for(text, known) if known else get_region(text)) if weight is None else _weighted(text, weight)
    for note in region.notes:
        fail(note)
    return region


def _known(maps: Iterable[str]) -> list[Projection]:
    """Valid projections among the texts; notices are left to the measuring."""
    found = []
    with notices_kept():
        for text in maps:
            with contextlib.suppress(ProjectionError):
                found.append(Projection.from_user_input(text))
    return found


def _weighted(text: str, weight: str) -> Place:
    """A region with the weights of a raster or a column."""
    path, mark, band = weight.partition("#")
    if Path(path).suffix.lower() not in (".tif", ".tiff"):
        return weighted_points(text, weight)
    if mark and not band.isdecimal():
        raise ValueError(f"Invalid band '{band}' of '{path}'. It must be a number.")
    with refusing():
        return gis.weighted(text, path, band=int(band or 1))


def names_of(given: Iterable[str] | None) -> list[str]:
    """Names from repeated options, each possibly a comma-separated list."""
    return [name.strip() for text in given or [] for name in text.split(",")]


def measure_names(given: list[str] | None) -> list[str]:
    """Names of measures from repeated options or comma-separated lists."""
    names = names_of(given)
    with refusing():
        for name in names:
            get_measure(name)
    return names


def refuse_given(options: Mapping[str, object], reason: str, of: str = "") -> None:
    """Refuse the first given option, for a reason; `of` follows its name in the message."""
    for name, value in options.items():
        if value is not None:
            refuse(f"Invalid option '{name}'{of}. {reason}")


def refuse_regional_options(executor: str | None, partial: str | None) -> None:
    """Refuse `--executor` and `--partial` without `--regions`."""
    refuse_given({"--executor": executor, "--partial": partial}, "It needs --regions.")


def whole_number(name: str, text: str, low: float, high: float) -> int:
    """A whole number within limits."""
    value = number(name, text, low, high)
    if value != int(value):
        refuse(f"Invalid {name} '{text}'. It must be a whole number.")
    return int(value)


@overload
def number(name: str, text: str, low: float, high: float, unit: str = "") -> float: ...
@overload
def number(name: str, text: None, low: float, high: float, unit: str = "") -> None: ...
@overload
def number(name: str, text: str | None, low: float, high: float, unit: str = "") -> float | None: ...
def number(name: str, text: str | None, low: float, high: float, unit: str = "") -> float | None:
    """A number within limits, or None of None."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        refuse(f"Invalid {name} '{text}'. It must be a number{unit} within {low:g} and {high:g}.")
    return value


def printed_or_file(text: str | None, overwrite: bool) -> Path | None:
    """Path of the output, None for standard output."""
    return None if text is None else output_file(text, overwrite)


def output_file(text: str, overwrite: bool) -> Path:
    """Path of an output, checked before the work: a file in a directory, new unless `overwrite`."""
    if not text:
        refuse("Invalid output ''. It must be the name of a file.")
    path = Path(text)
    try:
        if text.endswith(("/", os.sep)) or path.is_dir():
            refuse(f"Invalid output '{text}'. It is a directory.")
        if not path.parent.is_dir():
            refuse(f"Invalid output '{text}'. There is no directory '{path.parent}'.")
        if not overwrite:
            refuse_existing(path)
    except FileExistsError as error:
        refuse(str(error), error)
    except OSError as error:
        cannot_write(path, error)
    return path


def file_of_kind(text: str, suffixes: tuple[str, ...], overwrite: bool, kind: str = "output") -> Path:
    """Path of an output whose suffix is one of `suffixes`, checked as by `output_file`."""
    if Path(text).suffix.lower() not in suffixes:
        allowed = " or ".join(filter(None, (", ".join(suffixes[:-1]), suffixes[-1])))
        refuse(f"Invalid {kind} '{text}'. Its suffix must be {allowed}.")
    return output_file(text, overwrite)


def step_of(text: str | None) -> float | None:
    """Spacing of ellipses or lines in degrees."""
    return number("step", text, 1e-5, 90, " of degrees")


def dots_of(text: str | None) -> float:
    """Dots per inch."""
    return 150.0 if text is None else number("dpi", text, 10, 1200)


def size_of(text: str | None, dpi: float) -> tuple[float, float] | None:
    """Width and height in inches, None by default."""
    if text is None:
        return None
    width, comma, height = text.replace("x", ",").partition(",")
    if not comma or "," in height:
        refuse(f"Invalid size '{text}'. It must be WIDTH,HEIGHT in inches, as 10,6.")
    size = number("width", width, 0.5, 200, " of inches"), number("height", height, 0.5, 200, " of inches")
    if size[0] * size[1] * dpi**2 > _MOST_PIXELS:
        refuse(f"Invalid size '{text}' at {dpi:g} dots per inch. It must have at most {_MOST_PIXELS:.0e} pixels.")
    return size


def context_of(text: str | None) -> str:
    """Context of a picture of a region, the last of `CONTEXTS` by default."""
    from projdist import plots  # loads matplotlib

    return plots.CONTEXTS[-1] if text is None else choice("context", text, list(plots.CONTEXTS))


def levels_of(text: str | None) -> int | list[float] | None:
    """Number of isolines, or their values."""
    if text is None:
        return None
    try:
        values = [float(value) for value in text.split(",")]
    except ValueError:
        values = []
    whole = text.lstrip("+-").isdecimal()
    if whole and 1 <= values[0] <= _MOST_LEVELS:
        return int(values[0])
    if whole or not values or len(values) > _MOST_LEVELS or not all(map(math.isfinite, values)):
        refuse(f"Invalid levels '{text}'. It must be a number of them, 1 to {_MOST_LEVELS}, or values as 1,1.5,2.")
    return values
