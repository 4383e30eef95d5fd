"""Options that commands share, alone and in groups, and their values; an invalid one ends the command with 2."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple, overload

import typer

from projdist import gis, matrices, plots, projections, regions, support
from projdist.cli.errors import cannot_write, fail, refuse, refusing, working
from projdist.cli.report import DETAILS, FORMATS, HTML, TABLE, drawing


def argument(metavar: str, help: str, default: Any = ...) -> Any:
    """An argument, required without a default."""
    return typer.Argument(default, metavar=metavar, help=help)


def option(value: str | Iterable[str], help: str, default: Any = None, *flags: str) -> Any:
    """An option with a value or one of several words, named as its parameter unless `flags` are given."""
    return typer.Option(default, *flags, metavar=value if isinstance(value, str) else "|".join(value), help=help)


def flag(name: str, help: str, default: bool = False) -> Any:
    """An option without a value."""
    return typer.Option(default, name, help=help)


def output(help: str, default: Any = None, metavar: str = "FILE") -> Any:
    """The option `--output` of a command."""
    return option(metavar, help, default, "--output", "-o")


def file_format(forms: Iterable[str] = FORMATS, suffixes: str = ".json, .csv, .md, .html or .txt") -> Any:
    """The option `--format` of a command that prints, or writes a file whose suffix tells its format."""
    return option(forms, f"How to print, a table if not given; a file's suffix tells it: {suffixes}.", None, *_FORMAT)


def report_format(forms: Iterable[str] = FORMATS) -> Any:
    """The option `--format` of a command that prints, and whose file may be a page."""
    return option(forms, "How to print, a table if not given.", None, *_FORMAT)


_FORMAT = ("--format", "-f")
MEASURE, CRITERION = ("--measure", "-m"), ("--criterion", "-c")
"""The names of these options."""

# The defaults of these are in the signatures of commands; `...` stands for none.
Projections = Annotated[
    list[str],
    argument(
        "PROJECTION...",
        "Names, alone or with parameters (robinson+lon_0=150) or a latitude and longitude for the centre "
        "(mollweide@45,-100), PROJ strings, EPSG: or ESRI: codes, WKT, PROJJSON, .prj or .wkt files.",
    ),
]
OneProjection = Annotated[str, argument("PROJECTION", "As in compare.")]
RegionArgument = Annotated[str, argument("REGION", "Like --region of compare: Germany, country:DE, box:W,S,E,N, ...")]
Region = Annotated[
    str | None,
    option(
        "REGION",
        "globe, land, ocean, box:W,S,E,N (W > E crosses the antimeridian), cap:LON,LAT,KM (within a geodesic "
        "distance), country:NAME, continent:NAME, area:NAME (see 'projdist list regions'), state:NAME (of the USA), or "
        "the name alone, polygon:LON,LAT,..., crs:CODE (its area of use), file:PATH[#LAYER] (polygons), geodesic:PATH "
        "(with geodesics for edges), points:PATH (lon, lat, weight), and combinations by ' & ', ' - ', ' + ' and "
        "brackets; @main after a region is its main part. Without one: "
        "the area of use of a CRS if all maps have the same, otherwise the globe.",
        ...,
        *("--region", "-r"),
    ),
]
_WEIGHTS = (
    "Weights in place of areas: a raster of counts, such as pop.tif or pop.tif#2 (a band), or a column of points:PATH."
)
Weight = Annotated[str | None, option("FILE|COLUMN", _WEIGHTS, ...)]
Regions = Annotated[
    list[str] | None,
    option(
        "countries|continents|areas|states|FILE",
        "Many regions, one by one: all countries, continents, areas or states of the USA, the features of a file "
        "(PATH#LAYER), or any region; may be repeated.",
        ...,
    ),
]
Executor = Annotated[
    str | None,
    option(
        "processes:N|dask://HOST:PORT",
        "What the work runs on: processes on this machine or a Dask scheduler; by default one process per core.",
        ...,
    ),
]
Partial = Annotated[
    str | None,
    option(
        "FILE",
        "With --regions: where results are kept as they come; the same command continues from there. If not given, "
        "beside the output, until that is written.",
        ...,
    ),
]
Format = Annotated[str, option(FORMATS, "How to print.", ..., *_FORMAT)]
Output = Annotated[str | None, output("File to write instead of printing.", ...)]
Datum = Annotated[str | None, option("CRS", "The geographic CRS to use, such as EPSG:4258; by default WGS 84.", ...)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the file if there is one.")]
_MEASURES = "A measure (see 'projdist list measures'), or several with commas; may be repeated."
Measures = Annotated[list[str] | None, option("NAME", _MEASURES, ..., *MEASURE)]
_CONTEXT = "What a picture of a region shows of the Earth; full if not given."
Context = Annotated[str | None, option("none|coast|borders|full", _CONTEXT, ...)]


# ---- values --------------------------------------------------------------------------------------


def choice(thing: str, text: str, allowed: Iterable[str]) -> str:
    """The text, if it is one of those allowed."""
    allowed = list(allowed)
    if text not in allowed:
        refuse(f"Invalid {thing} '{text}'. It must be {', '.join(allowed[:-1])} or {allowed[-1]}.")
    return text


def names_of(given: Iterable[str] | None) -> list[str]:
    """Names from repeated options, each possibly a comma-separated list."""
    return [name.strip() for text in given or [] for name in text.split(",")]


def measure_names(given: list[str] | None) -> list[str]:
    """Names of measures from repeated options or comma-separated lists."""
    names = names_of(given)
    with refusing():
        for name in names:
            matrices.get_measure(name)
    return names


def refuse_given(options: Mapping[str, object], reason: str, of: str = "") -> None:
    """Refuse the first option that is not None, for a reason; `of` follows its name in the message."""
    for name, value in options.items():
        if value is not None:
            refuse(f"Invalid option '{name}'{of}. {reason}")


def whole_number(name: str, text: str, low: float, high: float) -> int:
    """A whole number within limits."""
    value = number(name, text, low, high)
    if value != int(value):
        refuse(f"Invalid {name} '{text}'. It must be a whole number.")
    return int(value)


@overload
def number(name: str, text: str, low: float, high: float, unit: str = "") -> float: ...
@overload
def number(name: str, text: str | None, low: float, high: float, unit: str = "") -> float | None: ...
def number(name: str, text: str | None, low: float, high: float, unit: str = "") -> float | None:
    """A number within limits; None stays None."""
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        refuse(f"Invalid {name} '{text}'. It must be a number{unit} within {low:g} and {high:g}.")
    return value


def numbers(text: str) -> list[float]:
    """The comma-separated numbers of a text; an empty list if a word is not a number."""
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        return []


@overload
def region_of(text: str, maps: Iterable[str] = (), weight: str | None = None) -> regions.Place: ...
@overload
def region_of(text: str | None, maps: Iterable[str] = (), weight: str | None = None) -> regions.Place | None: ...
def region_of(text: str | None, maps: Iterable[str] = (), weight: str | None = None) -> regions.Place | None:
    """Region of a text; without a text the globe if there is a weight, else None. Prints notes on repairs."""
    if text is None and weight is None:
        return None
    text, known = "globe" if text is None else text, []
    with support.notices_kept():  # the measuring gives them
        for one in maps:
            with contextlib.suppress(projections.ProjectionError):
                known.append(projections.Projection.from_user_input(one))
    with refusing():
        if weight is not None:
            region = _weighted(text, weight)
        else:
            region = regions.region_for(text, known) if known else regions.get_region(text)
    for note in region.notes:
        fail(note)
    return region


def _weighted(text: str, weight: str) -> regions.Place:
    """A region with the weights of a raster or a column."""
    path, mark, band = weight.partition("#")
    if Path(path).suffix.lower() not in RASTER_SUFFIXES:
        return regions.weighted_points(text, weight)
    if mark and not band.isdecimal():
        raise ValueError(f"Invalid band '{band}' of '{path}'. It must be a number.")
    return gis.weighted(text, path, band=int(band or 1))


# ---- outputs -------------------------------------------------------------------------------------


PAGE_SUFFIX, RASTER_SUFFIXES, LAYER_SUFFIXES = ".html", (".tif", ".tiff"), (".gpkg", ".geojson")
_TOLD_BY = {".json": "json", ".csv": "csv", ".md": "markdown", PAGE_SUFFIX: HTML, ".wkt": "wkt"}
_OF_ANY = (".txt", ".log", "")


class Target(NamedTuple):
    """Format of an answer, path of its file (None: it is printed), and whether that may be replaced."""

    form: str
    path: Path | None
    overwrite: bool


def format_of(text: str, forms: Sequence[str] = FORMATS) -> str:
    """The name of a format, if it is allowed."""
    return text if text == DETAILS else choice("format", text, forms)


def target(
    text: str | None, output: str | None, overwrite: bool, forms: Sequence[str] = FORMATS, others: Sequence[str] = ()
) -> Target:
    """Output in the format given by `--format` or by its suffix; refuses contradictions."""
    # `others` are suffixes of files that are not text.
    path = None if output is None else output_file(output, overwrite)
    stated = None if text is None else format_of(text, forms)
    suffix = "" if path is None or support.is_stream(path) else path.suffix.lower()
    told = _TOLD_BY.get(suffix)
    if suffix not in (*_OF_ANY, *others) and told not in forms:
        allowed = [*(known for known, form in _TOLD_BY.items() if form in forms), *others, *filter(None, _OF_ANY)]
        refuse(f"Invalid output '{path}'. Its suffix must be {', '.join(allowed)}, or none.")
    if told is not None and stated not in (None, told, DETAILS):
        refuse(f"Invalid format '{stated}' for '{path}'. Its suffix tells the format, {told}.")
    return Target(told or stated or TABLE, path, overwrite)


def page_target(text: str | None, output: str | None, overwrite: bool, forms: Sequence[str] = FORMATS) -> Target:
    """Output of a command that prints its answer or writes it as a page; other suffixes are for pictures."""
    is_page = output is not None and Path(output).suffix.lower() == PAGE_SUFFIX
    return target(text, output if is_page else None, overwrite, forms)


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
            support.refuse_existing(path)
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


def check_libraries(path: Path) -> None:
    """Refuse a file for GIS programs if the library that writes it is missing."""
    with refusing():
        gis.check_libraries(path)


# ---- pictures ------------------------------------------------------------------------------------


_MOST_PIXELS = 4e8  # 1.6 GB of memory


@dataclass(frozen=True, kw_only=True)
class StyleOptions:
    """The size and the style of a picture, and whether it may replace a file."""

    size: str | None = option("WIDTH,HEIGHT", "Size of the picture in inches, such as 10,6.")
    dpi: str | None = option("NUMBER", "Dots per inch; 150 if not given.")
    overwrite: Overwrite = False
    title: str | None = option("TEXT", "The title of the map, or a heading above several.")
    no_title: bool = flag("--no-title", "Nothing above the maps.")
    font_size: str | None = option("POINTS", "For the colour bar's label; others in proportion.")
    style: str | None = option("FILE", "A matplotlib style, by file or name: its fonts.")
    theme: str | None = option("light|dark|print", "Colours of the picture; print is grey.")
    credits: str | None = option("TEXT", "A line at the foot, such as sources and the author.")

    def given(self, but: str = "") -> dict[str, Any]:
        """Given options by name, except `but` and `--overwrite`, which is for other files, too."""
        options = {f"--{name.replace('_', '-')}": word for name, word in vars(self).items()}
        given = {name: word for name, word in options.items() if word not in (None, False)}
        return {name: word for name, word in given.items() if name not in ("--overwrite", but)}

    def look(self) -> plots.Look:
        """Style of the options; invalid ones end the command with 2."""
        if self.title is not None and self.no_title:
            refuse("Invalid option '--no-title'. It cannot be used with --title.")
        with refusing():
            return plots.Look(
                theme=self.theme,
                font_size=number("font size", self.font_size, 1, 72, " of points"),
                style=self.style,
                transparent=getattr(self, "transparent", False),
                title="" if self.no_title else self.title,
                colourbar=not getattr(self, "no_colourbar", False),
                credits=self.credits,
            )


@dataclass(frozen=True, kw_only=True)
class AnimationOptions(StyleOptions):
    """The options of animations, which are opaque."""

    no_colourbar: bool = flag("--no-colourbar", "No colour bar.")


@dataclass(frozen=True, kw_only=True)
class GraphOptions(StyleOptions):
    """The options of graphs, which have no colour bar."""

    transparent: bool = flag("--transparent", "No background.")


@dataclass(frozen=True, kw_only=True)
class PictureOptions(AnimationOptions, GraphOptions):
    """The options of pictures of maps."""


STYLE = {one.name for one in fields(PictureOptions)} - {"size", "overwrite"}
"""Names of the options that change how a picture looks."""


class OutputFile:
    """The path of a file to write, and whether it may be replaced."""

    def __init__(self, path: Path, overwrite: bool) -> None:
        self.path, self.overwrite = path, overwrite

    def __str__(self) -> str:
        """The path, by which reports name the file."""
        return str(self.path)


class PictureFile(OutputFile):
    """Path and drawing options of a picture; invalid ones end the command with 2."""

    def __init__(
        self, output: str, drawn: GraphOptions, *, step: str | None = None, beside: tuple[str, ...] = ()
    ) -> None:
        kind = "output" if beside else "picture file"
        super().__init__(file_of_kind(output, (*plots.SUFFIXES, *beside), drawn.overwrite, kind), drawn.overwrite)
        self.dots = number("dpi", "150" if drawn.dpi is None else drawn.dpi, 10, 1200)
        self.step = number("step", step, 1e-5, 90, " of degrees")
        self.size, self.look = size_of(drawn.size, self.dots), drawn.look()

    def save(self, draw: Callable[..., Any], /, *shown: Any, **options: Any) -> None:
        """Write the figure that `draw` makes of `shown` in the given size and style; failure ends the command."""
        with drawing(self.path), working("Drawing"):
            figure = draw(*shown, **options, size=self.size, dpi=self.dots, look=self.look)
            plots.save(figure, self.path, dpi=self.dots, overwrite=self.overwrite)


def size_of(text: str | None, dpi: float) -> tuple[float, float] | None:
    """Width and height in inches, None by default."""
    if text is None:
        return None
    width, comma, height = text.replace("x", ",").partition(",")
    if not comma or "," in height:
        refuse(f"Invalid size '{text}'. It must be WIDTH,HEIGHT in inches, such as 10,6.")
    size = number("width", width, 0.5, 200, " of inches"), number("height", height, 0.5, 200, " of inches")
    if size[0] * size[1] * dpi**2 > _MOST_PIXELS:
        refuse(f"Invalid size '{text}' at {dpi:g} dots per inch. It must have at most {_MOST_PIXELS:.0e} pixels.")
    return size


def is_picture(output: str | None) -> bool:
    """True for the path of a picture."""
    return output is not None and Path(output).suffix.lower() in plots.SUFFIXES


def text_and_picture(
    format: str | None, output: str | None, picture: str | None, drawn: PictureOptions, forms: Sequence[str]
) -> tuple[Target, PictureFile | None]:
    """Outputs of a command with `--picture`; `--output` may name the picture, too."""
    if is_picture(output):
        if picture is not None:
            refuse(f"Invalid output '{output}'. There can be only one picture, which is '{picture}'.")
        output, picture = None, output
    return target(format, output, drawn.overwrite, forms, plots.SUFFIXES), picture_of(picture, drawn)


def picture_of(
    output: str | None, drawn: GraphOptions, *, step: str | None = None, beside: tuple[str, ...] = (), **others: Any
) -> PictureFile | None:
    """Picture requested by `output`; without one, options of pictures are refused."""
    # `others` are further options of pictures that the command has, None where they are not given; `beside` are
    # suffixes of the other files that it writes.
    page = PAGE_SUFFIX in beside and output is not None and Path(output).suffix.lower() == PAGE_SUFFIX
    if output is not None and not page:
        return PictureFile(output, drawn, step=step, beside=beside)
    reason = f"It is for pictures, and '{output}' is a page." if page else "It needs a picture to draw to: -o FILE."
    refuse_given({f"--{name}": value for name, value in others.items()} | {"--step": step} | drawn.given(), reason)
    return None
