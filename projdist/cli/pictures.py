"""Pictures, rasters and layers that a command writes, from the words of its options."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from projdist import gis, plots
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import drawing, tell_written
from projdist.cli.options import PAGE_SUFFIX, choice, dots_of, file_of_kind, is_page, number, size_of, step_of
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


# ---- pictures ------------------------------------------------------------------------------------


LookWords = Mapping[str, Any]
"""The words of the options of looks, by their names."""

# The commands that draw maps have these options, each in its own help.
_LOOKS: dict[str, tuple[Any, Any]] = {
    "title": (
        Annotated[str | None, typer.Option(metavar="TEXT", help="The title of the map, or a heading above several.")],
        None,
    ),
    "no_title": (Annotated[bool, typer.Option("--no-title", help="Nothing above the maps.")], False),
    "no_colourbar": (Annotated[bool, typer.Option("--no-colourbar", help="No colour bar.")], False),
    "font_size": (
        Annotated[str | None, typer.Option(metavar="POINTS", help="Of the colour bar's label; others in proportion.")],
        None,
    ),
    "style": (
        Annotated[str | None, typer.Option(metavar="FILE", help="A style of matplotlib, by file or name: its fonts.")],
        None,
    ),
    "theme": (
        Annotated[str | None, typer.Option(metavar="light|dark|print", help="Colours of the picture; print is grey.")],
        None,
    ),
    "transparent": (Annotated[bool, typer.Option("--transparent", help="No background.")], False),
}


GRAPHS, FILMS = ("no_colourbar",), ("transparent",)
"""The looks that graphs and films do not have."""


def with_looks(command: Callable[..., None], *, less: Sequence[str] = ()) -> Callable[..., None]:
    """A command with the options of looks, `less` some, whose words it takes as `look`."""
    signature = inspect.signature(command, eval_str=True)
    own = [parameter for name, parameter in signature.parameters.items() if name != "look"]
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    looks = [
        inspect.Parameter(name, kind, default=default, annotation=hint)
        for name, (hint, default) in _LOOKS.items()
        if name not in less
    ]

    @functools.wraps(command)
    def wrapped(**words: Any) -> None:
        look = {name: word for name in _LOOKS if (word := words.pop(name, None)) is not None and word is not False}
        command(**words, look=look)

    wrapped.__signature__ = signature.replace(parameters=[*own, *looks])  # type: ignore[attr-defined]
    wrapped.__annotations__ = {parameter.name: parameter.annotation for parameter in [*own, *looks]}
    return wrapped


def look_options(look: LookWords | None) -> dict[str, Any]:
    """The words by the names of their options."""
    return {f"--{name.replace('_', '-')}": word for name, word in (look or {}).items()}


class PictureFile:
    """Where a picture goes, and how it is drawn; a wrong word ends the command with 2."""

    def __init__(
        self,
        output: str,
        *,
        size: str | None,
        dpi: str | None,
        step: str | None = None,
        overwrite: bool,
        look: LookWords | None = None,
        beside: tuple[str, ...] = (),
    ) -> None:
        kind = "output" if beside else "picture file"
        self.path: Path = file_of_kind(output, (*plots.SUFFIXES, *beside), overwrite, kind)
        self.dots, self.step = dots_of(dpi), step_of(step)
        self.size, self.overwrite = size_of(size, self.dots), overwrite
        self.look = {} if look is None else {"look": look_of_words(look)}

    def save(self, draw: Callable[..., Any]) -> None:
        """Write the figure that `draw` makes with `size`, `dpi` and `look`; what cannot be drawn ends the command."""
        with drawing(self.path), working("Drawing"):
            figure = draw(size=self.size, dpi=self.dots, **self.look)
            plots.save(figure, self.path, dpi=self.dots, overwrite=self.overwrite)


def look_of_words(words: LookWords) -> plots.Look:
    """The look of words."""
    if "title" in words and "no_title" in words:
        refuse("Invalid option '--no-title'. It cannot be used with --title.")
    size = words.get("font_size")
    with refusing():
        return plots.Look(
            theme=words.get("theme"),
            font_size=None if size is None else number("font size", size, 1, 72, " of points"),
            style=words.get("style"),
            transparent="transparent" in words,
            title="" if "no_title" in words else words.get("title"),
            colourbar="no_colourbar" not in words,
        )


def picture_of(
    output: str | None,
    *,
    size: str | None,
    dpi: str | None,
    step: str | None = None,
    overwrite: bool,
    look: LookWords | None = None,
    beside: tuple[str, ...] = (),
    **others: Any,
) -> PictureFile | None:
    """The picture of a command that draws one only where it is asked to; else options of pictures are refused.

    `others` are such options that the command has beside these, None where they are not given; `beside` are suffixes
    of what else it writes, which is not asked for here.
    """
    page = PAGE_SUFFIX in beside and is_page(output)
    if output is not None and not page:
        return PictureFile(output, size=size, dpi=dpi, step=step, overwrite=overwrite, look=look, beside=beside)
    given = {f"--{name}": value for name, value in (others | {"step": step, "size": size, "dpi": dpi}).items()}
    for name, value in (given | look_options(look)).items():
        if value is not None:
            missing = (
                f"It is for pictures, and '{output}' is a page." if page else "It needs a picture to draw to: -o FILE."
            )
            refuse(f"Invalid option '{name}'. {missing}")
    return None
