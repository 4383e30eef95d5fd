"""Pictures, rasters and layers that commands write, and their options."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from projdist import gis, plots
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, working
from projdist.cli.formats import drawing, tell_written
from projdist.projections import Projection
from projdist.regions import Place

RASTER_SUFFIXES = (".tif", ".tiff")
LAYER_SUFFIXES = (".gpkg", ".geojson")

_MOST_PIXELS = 1e8  # along a side; how many there may be in all is for the raster to say


def check_layer_options(path: Path, drawn: Mapping[str, str | None]) -> None:
    """Refuse options of pictures for other files."""
    opt.refuse_given(drawn, "It is for pictures.", f" for '{path}'")


def check_libraries(path: Path) -> None:
    """Refuse a file if the library that writes it is missing."""
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
    """Write measures of a map as a GeoTIFF."""
    opt.choice("grid", grid, gis.GRIDS)
    pixels = _pixels(size)
    side = opt.number("resolution", resolution, 1e-12, 1e12)
    check_libraries(path)
    projection = _only_map(given, path)
    with drawing(path), working("Measuring"):
        found = gis.raster(projection, measures, region=region, grid=grid, size=pixels, resolution=side)
        gis.save_raster(found, path, overwrite=overwrite)
    note(found.note)
    tell_written(path)


def write_layer(given: Sequence[str], path: Path, *, region: Place | None, step: float | None, overwrite: bool) -> None:
    """Write the indicatrices of a map as polygons."""
    check_libraries(path)
    projection = _only_map(given, path)
    with drawing(path):
        found = gis.indicatrices(projection, region=region, step=step)
        gis.save_layer(found, path, overwrite=overwrite)
    if found.crs is None:
        note(f"{projection.name} has no CRS; that of the layer is undefined, and its coordinates are metres.")
    tell_written(path)


def note(text: str) -> None:
    """Print a note on standard error."""
    if text:
        sys.stderr.write(f"projdist: Note: {text}\n")


def _only_map(given: Sequence[str], path: Path) -> Projection:
    """The projection of a file that holds one map."""
    if len(given) != 1:
        refuse(f"Invalid projections '{' '.join(given)}' for '{path}'. A {path.suffix} file has one map; name one.")
    with refusing():
        return Projection.from_user_input(given[0])


def _pixels(text: str | None) -> int | tuple[int, int] | None:
    """Pixels of a raster's longer side, or its width and height."""
    if text is None:
        return None
    words = text.replace("x", ",").split(",")
    if len(words) > 2 or not all(word.strip().isdecimal() for word in words):
        refuse(f"Invalid size '{text}'. It must be pixels of the longer side, or WIDTH,HEIGHT, as 1000 or 1000,500.")
    counts = [int(opt.number("size", word, 1, _MOST_PIXELS, " of pixels")) for word in words]
    return counts[0] if len(counts) == 1 else (counts[0], counts[1])


# ---- pictures ------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class SizeOptions:
    """The size and resolution of a picture, and whether it may replace a file."""

    size: opt.Size = None
    dpi: opt.Dpi = None
    overwrite: opt.Overwrite = False


@dataclass(frozen=True, kw_only=True)
class StyleOptions:
    """The style of a picture."""

    title: str | None = opt.option("TEXT", "The title of the map, or a heading above several.")
    no_title: bool = opt.flag("--no-title", "Nothing above the maps.")
    font_size: str | None = opt.option("POINTS", "Of the colour bar's label; others in proportion.")
    style: str | None = opt.option("FILE", "A style of matplotlib, by file or name: its fonts.")
    theme: str | None = opt.option("light|dark|print", "Colours of the picture; print is grey.")

    def given(self, but: str = "") -> dict[str, Any]:
        """Given options by name; without `--overwrite`, which is for other files, too."""
        words = ((one.name, getattr(self, one.name)) for one in fields(self) if one.name != "overwrite")
        options = {f"--{name.replace('_', '-')}": word for name, word in words}
        return {name: word for name, word in options.items() if word not in (None, False) and name != but}

    def look(self) -> plots.Look:
        """Style of the options; invalid ones end the command with 2."""
        if self.title is not None and self.no_title:
            refuse("Invalid option '--no-title'. It cannot be used with --title.")
        with refusing():
            return plots.Look(
                theme=self.theme,
                font_size=opt.number("font size", self.font_size, 1, 72, " of points"),
                style=self.style,
                transparent=getattr(self, "transparent", False),
                title="" if self.no_title else self.title,
                colourbar=not getattr(self, "no_colourbar", False),
            )


@dataclass(frozen=True, kw_only=True)
class FilmOptions(StyleOptions, SizeOptions):
    """The options of films, which are opaque."""

    no_colourbar: bool = opt.flag("--no-colourbar", "No colour bar.")


@dataclass(frozen=True, kw_only=True)
class GraphOptions(StyleOptions, SizeOptions):
    """The options of graphs, which have no colour bar."""

    transparent: bool = opt.flag("--transparent", "No background.")


@dataclass(frozen=True, kw_only=True)
class PictureOptions(FilmOptions, GraphOptions):
    """The options of pictures of maps."""


class PictureFile:
    """Path and drawing options of a picture; invalid ones end the command with 2."""

    def __init__(
        self, output: str, drawn: GraphOptions, *, step: str | None = None, beside: tuple[str, ...] = ()
    ) -> None:
        kind = "output" if beside else "picture file"
        self.path: Path = opt.file_of_kind(output, (*plots.SUFFIXES, *beside), drawn.overwrite, kind)
        self.dots, self.step = opt.dots_of(drawn.dpi), opt.step_of(step)
        self.size, self.overwrite = opt.size_of(drawn.size, self.dots), drawn.overwrite
        self.look = drawn.look()

    def save(self, draw: Callable[..., Any], /, *shown: Any, **options: Any) -> None:
        """Write the figure that `draw` makes of `shown` in the given size and style; failure ends the command."""
        with drawing(self.path), working("Drawing"):
            figure = draw(*shown, **options, size=self.size, dpi=self.dots, look=self.look)
            plots.save(figure, self.path, dpi=self.dots, overwrite=self.overwrite)


def picture_of(
    output: str | None,
    drawn: GraphOptions,
    *,
    step: str | None = None,
    beside: tuple[str, ...] = (),
    **others: Any,
) -> PictureFile | None:
    """Picture requested by `output`; without one, options of pictures are refused.

    `others` are such options that the command has beside these, None where they are not given; `beside` are suffixes
    of what else it writes, which is not asked for here.
    """
    page = opt.PAGE_SUFFIX in beside and opt.is_page(output)
    if output is not None and not page:
        return PictureFile(output, drawn, step=step, beside=beside)
    reason = f"It is for pictures, and '{output}' is a page." if page else "It needs a picture to draw to: -o FILE."
    opt.refuse_given({f"--{name}": value for name, value in others.items()} | {"--step": step} | drawn.given(), reason)
    return None
