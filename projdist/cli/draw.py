"""The commands that draw maps (`tissot`, `heatmap`, `morph`) or show them live (`explore`)."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from projdist import answers, earth, gis, matrices, plots, projections, regions, support, surfaces, web
from projdist._typing import BoolArray, FloatArray
from projdist.cli import compare, options as opt
from projdist.cli.errors import note, progress_bar, refuse, refusing, tell_problems, width_of, working
from projdist.cli.report import drawing, emit, notes_text, takes_blocks, tell_written, wrote
from projdist.cli.wording import certain

_TOLERANCE = 1e-5  # titles show three decimals
_MOST_PIXELS = 1e8  # along a side; `gis.raster` limits the number of all
_MOST_LEVELS = 100
_FULL = "full"  # the context if none is given


def tissot_command(
    given: opt.Projections,
    output: str = opt.output("A picture: .png, .svg or .pdf; or a layer of polygons: .gpkg or .geojson.", "tissot.png"),
    region: opt.Region = None,
    step: str | None = opt.option("NUMBER", "Degrees between the ellipses."),
    grid: str | None = opt.option("LAT,LON", "Put ellipses at multiples of these degrees, instead of evenly."),
    exaggerate: str | None = opt.option("NUMBER|auto", "Multiply the distortion by this number."),
    axes: bool = opt.flag("--axes", "Draw the principal directions as crosses."),
    context: opt.Context = None,
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Draw Tissot's indicatrices."""
    path = opt.file_of_kind(output, (*plots.SUFFIXES, *opt.LAYER_SUFFIXES), pictured.overwrite)
    if path.suffix.lower() in opt.LAYER_SUFFIXES:
        crosses = "" if axes else None
        drawn = {"--grid": grid, "--exaggerate": exaggerate, "--axes": crosses, "--context": context}
        opt.refuse_given(drawn | pictured.given(), "It is for pictures.", f" for '{path}'")
        area, spacing = opt.region_of(region, given), opt.number("step", step, 1e-5, 90, " of degrees")
        projection = _only_map(given, path)
        with drawing(path):
            found = gis.indicatrices(projection, region=area, step=spacing)
            gis.save_layer(found, path, overwrite=pictured.overwrite)
        if found.crs is None:
            note(f"{projection.name} has no CRS; that of the layer is undefined, and its coordinates are metres.")
        tell_written(path)
        return
    picture = opt.PictureFile(output, pictured, step=step)
    options: dict[str, Any] = {"axes": axes}
    if grid is not None:
        if step is not None:
            refuse("Invalid option '--grid'. It cannot be used with --step.")
        words = grid.split(",")
        if len(words) != 2:
            refuse(f"Invalid grid '{grid}'. It must be degrees of latitude and of longitude, such as 10,15.")
        options["grid"] = tuple(opt.number("grid", word, 1e-4, 90.0, " of degrees") for word in words)
    if exaggerate is not None:
        options["exaggeration"] = "auto" if exaggerate == "auto" else opt.number("exaggeration", exaggerate, 0.1, 1e6)
    options["context"] = opt.choice("context", _FULL if context is None else context, plots.CONTEXTS)
    _draw(plots.tissot_figure, given, region, picture, **options)


def heatmap_command(
    given: opt.Projections,
    measure: list[str] | None = opt.option(
        "NAME",
        "See 'projdist list measures'; fisher if not given. A raster may have several, with commas.",
        None,
        *opt.MEASURE,
    ),
    output: str = opt.output("A picture: .png, .svg or .pdf; or a GeoTIFF: .tif.", "heatmap.png"),
    against: str | None = opt.option(
        "PROJECTION", "Draw the measure minus that on this map; scales divided by its scales."
    ),
    region: opt.Region = None,
    step: str | None = opt.option("NUMBER", "Degrees between graticule lines."),
    levels: str | None = opt.option("NUMBERS", "Number of isolines, or their values in any order, such as 1,1.5,2."),
    cmap: str | None = opt.option("NAME", "A matplotlib colour map."),
    context: opt.Context = None,
    size: str | None = opt.option(
        "WIDTH,HEIGHT", "In inches for a picture (10,6), in pixels for a raster: its longer side, or both (1000,500)."
    ),
    resolution: str | None = opt.option("NUMBER", "Size of a raster's pixels in the unit of its CRS."),
    grid: str = opt.option("map|lonlat", "CRS of a raster: the map's own, or longitude and latitude.", "map"),
    *,
    pictured: opt.PictureOptions,
) -> None:
    """Draw a measure as a field of colour with isolines, or write measures as a GeoTIFF."""
    names = opt.measure_names(measure or ["fisher"])
    path = opt.file_of_kind(output, (*plots.SUFFIXES, *opt.RASTER_SUFFIXES), pictured.overwrite)
    if path.suffix.lower() in opt.RASTER_SUFFIXES:
        drawn = {"--step": step, "--levels": levels, "--cmap": cmap, "--context": context, "--against": against}
        opt.refuse_given(drawn | pictured.given(but="--size"), "It is for pictures.", f" for '{path}'")
        area = opt.region_of(region, given)
        opt.choice("grid", grid, gis.GRIDS)
        pixels, side = _pixels(size), opt.number("resolution", resolution, 1e-12, 1e12)
        projection = _only_map(given, path)
        with drawing(path), working("Measuring"):
            found = gis.raster(projection, names, region=area, grid=grid, size=pixels, resolution=side)
            gis.save_raster(found, path, overwrite=pictured.overwrite)
        note(found.note)
        tell_written(path)
        return
    of_rasters = {"--resolution": resolution, "--grid": None if grid == "map" else grid}
    opt.refuse_given(of_rasters, "It is for rasters, whose suffix is .tif.", f" for '{path}'")
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. A picture shows one; a .tif has room for several.")
    picture = opt.PictureFile(output, pictured, step=step)
    options: dict[str, Any] = {"measure": names[0], "levels": _levels(levels), "cmap": cmap}
    if against is not None:
        with refusing():
            options["against"] = projections.Projection.from_user_input(against)
    options["context"] = opt.choice("context", _FULL if context is None else context, plots.CONTEXTS)
    _draw(plots.heatmap_figure, given, region, picture, **options)


def _only_map(given: list[str], path: Path) -> projections.Projection:
    """The projection of a layer or raster, which holds one map, after a check of the libraries that write it."""
    opt.check_libraries(path)
    if len(given) != 1:
        refuse(f"Invalid projections '{' '.join(given)}' for '{path}'. A {path.suffix} file has one map; name one.")
    with refusing():
        return projections.Projection.from_user_input(given[0])


def _pixels(text: str | None) -> int | tuple[int, int] | None:
    """Pixels of a raster's longer side, or its width and height."""
    if text is None:
        return None
    words = text.replace("x", ",").split(",")
    if len(words) > 2 or not all(word.strip().isdecimal() for word in words):
        refuse(f"Invalid size '{text}'. It must be in pixels: the longer side (1000) or WIDTH,HEIGHT (1000,500).")
    counts = [int(opt.number("size", word, 1, _MOST_PIXELS, " of pixels")) for word in words]
    return counts[0] if len(counts) == 1 else (counts[0], counts[1])


def _levels(text: str | None) -> int | list[float] | None:
    """Number of isolines, or their values."""
    if text is None:
        return None
    values, whole = opt.numbers(text), text.lstrip("+-").isdecimal()
    if whole and 1 <= values[0] <= _MOST_LEVELS:
        return int(values[0])
    if whole or not values or len(values) > _MOST_LEVELS or not np.isfinite(values).all():
        refuse(f"Invalid levels '{text}'. It must be their number, 1 to {_MOST_LEVELS}, or values such as 1,1.5,2.")
    return values


def _draw(
    figure: Callable[..., Any], given: list[str], region: str | None, picture: opt.PictureFile, **options: Any
) -> None:
    """Draw the measurable projections with their Airy-Kavrayskiy errors; report the others' failures."""
    other = options.get("against")
    others = [] if other is None else [other]
    area = opt.region_of(region, [*given, *(one.definition for one in others)])  # one for all maps
    with refusing(), progress_bar("maps measured") as progress:
        found = answers.compare([*given, *others], area, sort="given", tolerance=_TOLERANCE, progress=progress)
    drawn = [one for one in found.results if one.projection is not other]
    if drawn and len(found.results) - len(drawn) == (other is not None):
        maps, figures = [one.projection for one in drawn], [one.airy_kavrayskiy for one in drawn]
        options |= {"region": found.region, "step": picture.step, "airy_kavrayskiy": figures}
        picture.save(figure, maps, **options)
        emit(notes_text(compare.least_distorting(found)) + wrote(picture.path), None)
    tell_problems([failure.error for failure in found.failures])


def morph_command(
    first: str = opt.argument("PROJECTION", "Where the animation begins, as in compare."),
    second: str = opt.argument("PROJECTION", "The map it flows into, and back from."),
    output: str = opt.output("The animation: .gif, or .mp4 (with ffmpeg).", "morph.gif"),
    measure: list[str] | None = opt.option(
        "NAME", "The measure in colours; fisher if not given (see 'projdist list measures').", None, *opt.MEASURE
    ),
    region: opt.Region = None,
    frames: str = opt.option("NUMBER", "Frames on the way there.", "24"),
    seconds: str = opt.option("NUMBER", "Seconds there and back, without the pauses.", "4"),
    size: str = opt.option("WIDTH,HEIGHT", "Size in inches.", "7,4.6"),
    dpi: str = opt.option("NUMBER", "Dots per inch.", "100"),
    *,
    pictured: opt.AnimationOptions,
) -> None:
    """Make an animation of one map flowing into another, coloured by a measure."""
    path = opt.file_of_kind(output, plots.ANIMATION_SUFFIXES, pictured.overwrite, "animation")
    names = opt.measure_names(measure or ["fisher"])
    if len(names) > 1:
        refuse(f"Invalid measures '{','.join(names)}' for '{path}'. An animation shows one.")
    options: dict[str, Any] = {
        "measure": names[0],
        "frames": opt.whole_number("frames", frames, 2, 500),
        "seconds": opt.number("seconds", seconds, 0.1, 600),
        "dpi": (dots := opt.number("dpi", dpi, 10, 1200)),
        "size": opt.size_of(size, dots),
        "region": opt.region_of(region, [first, second]),
        "look": pictured.look(),
    }
    with refusing():
        maps = projections.Projection.from_user_input(first), projections.Projection.from_user_input(second)
    with drawing(path), progress_bar("frames") as progress:
        plots.morph(*maps, path, **options, overwrite=pictured.overwrite, progress=progress)
    tell_written(path)


_FIRST = "winkel-tripel"
_MOST_MAPS = 6
_LAST_PORT = 65535


def explore_command(
    given: list[str] | None = opt.argument("[PROJECTION...]", "As in compare; winkel-tripel if not given.", None),
    region: opt.Region = None,
    measure: str = opt.option(
        "NAME", "The measure shown first (see 'projdist list measures').", "fisher", *opt.MEASURE
    ),
    port: str | None = opt.option("NUMBER", "Port of the address; any free one if not given."),
    no_browser: bool = opt.flag("--no-browser", "Print the address only, and open no browser."),
) -> None:
    """See live maps in a browser: drag them, change their parameters, point at them, ask for better ones."""
    given = given or [_FIRST]
    if len(given) > _MOST_MAPS:
        refuse(f"Invalid projections. A page has at most {_MOST_MAPS}, and {len(given)} were given.")
    with refusing():
        maps = [projections.Projection.from_user_input(text) for text in given]
        chosen = matrices.get_measure(measure).name
        support.check_choice("measure", chosen, web.SHOWN_MEASURES)
        place = regions.region_for(opt.region_of(region, given), maps)
        web.check_server()
        wanted = 0 if port is None else opt.whole_number("port", port, 0, _LAST_PORT)
    try:
        listening = web.open_socket(wanted)
    except OSError as error:
        refuse(f"Invalid port '{port}'. It cannot be listened on: {os.strerror(error.errno or 0)}.", error)
    text = region or place.name
    start = web.Start(projections=tuple(given), region=text, measure=chosen)
    with contextlib.closing(web.LiveSite(start, web.InputPolicy(frozenset([*given, text])))) as site:
        address = site.url(listening.getsockname()[1])
        emit(f"{address}\n", None)
        if not no_browser:  # a browser in the terminal returns only when it is closed
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        web.serve(site, listening)


# ---- the ASCII map -------------------------------------------------------------------------------


_WIDEST, _HIGHEST = 64, 18  # characters
_NARROWEST = 16
_TALL = 2.0  # a character's height over its width
_TRIANGLES = 16_000  # of a map, about fifteen per character
_PPM_OF_A_PER_CENT = 1e4
_LAND = 0.02  # share of the characters from which on land and sea are distinguished


def sketch_of(projection: projections.Projection, region: regions.Place, output: Path | None = None) -> list[str]:
    """Lines of an ASCII map of the region: scale errors in four shades, and a legend."""
    # Empty if the map cannot be drawn, as for a set of points, or in a narrow terminal.
    widest = min(_WIDEST, width_of(sys.stdout) or _WIDEST) if output is None else _WIDEST
    if not region.area_km2 or widest < _NARROWEST:
        return []
    place = surfaces.shown_part(region)
    try:
        surface = surfaces.surface_of(projection, place, web.cell_step(place.bounds, _TRIANGLES / 2))
    except ValueError:  # no part of it is on the map
        return []
    return _drawn(*_in_characters(surface, place, widest), unicode=takes_blocks(output))


def _in_characters(
    surface: surfaces.Surface, region: regions.Place, widest: int
) -> tuple[BoolArray, FloatArray, BoolArray]:
    """For each character (rows, columns): whether it is on the map, its mean scale error, whether it is mostly land."""
    lon, lat = (values[surface.source] for values in surface.lonlat())
    measured = surfaces.field(surface, matrices.get_measure("scale_error_ppm"))
    triangles = surface.triangles[np.isfinite(measured[surface.triangles]).all(axis=1)]
    triangles = triangles[np.asarray(region.contains(lon[triangles[:, 0]], lat[triangles[:, 0]]))]
    x, y = surface.x[triangles].mean(axis=1), surface.y[triangles].mean(axis=1)
    if not x.size:
        return (np.zeros((1, 1), dtype=bool), np.full((1, 1), np.nan), np.zeros((1, 1), dtype=bool))
    width, height = max(np.ptp(x), 1e-9), max(np.ptp(y), 1e-9)
    columns = int(np.clip(_HIGHEST * _TALL * width / height, 1, widest))
    rows = int(np.clip(round(columns * height / width / _TALL), 1, _HIGHEST))
    column = np.minimum((columns * (x - x.min()) / width).astype(int), columns - 1)
    row = np.minimum((rows * (y.max() - y) / height).astype(int), rows - 1)
    place = row * columns + column
    count = np.bincount(place, minlength=rows * columns)

    def mean(values: FloatArray) -> FloatArray:
        """Mean of the triangles' values in each character; NaN without any."""
        total = np.bincount(place, weights=values, minlength=count.size)
        return np.divide(total, count, out=np.full(count.size, np.nan), where=count > 0).reshape(rows, columns)

    land = np.ones(len(triangles))  # other bodies have no sea
    if not surface.domain.projection.is_of_another_body:
        resolution = surfaces.coast_resolution(surface)
        outline = earth.polygons_within("land", surface.domain.region.bounds, resolution)
        first = triangles[:, 0]
        land *= False if outline.is_empty else regions.get_region(outline).contains(lon[first], lat[first])
    return (count > 0).reshape(rows, columns), mean(measured[triangles].mean(axis=1)), mean(land) > 0.5


def _drawn(cells: BoolArray, values: FloatArray, land: BoolArray, *, unicode: bool) -> list[str]:
    """Lines of the map and its legend: four shades, each for a quarter of the shaded characters."""
    shades, sea = ("░▒▓█", "·") if unicode else ("-+x#", ".")
    apart = land.sum() >= _LAND * cells.sum() and not (land | ~cells).all()
    shaded = land if apart else cells
    drawn = shaded & np.isfinite(values)
    known = values[drawn]
    if not known.size:
        return []
    levels = np.quantile(known, [0.25, 0.5, 0.75])
    picture = np.where(cells & apart, sea, " ")
    picture[drawn] = np.array([*shades])[np.searchsorted(levels, known)]
    ends = [*levels, float(known.max())]
    unit, name = (_PPM_OF_A_PER_CENT, "%") if ends[-1] >= _PPM_OF_A_PER_CENT else (1.0, "ppm")
    texts = [f"{shade} to {certain(float(f'{end / unit:.2g}'))}" for shade, end in zip(shades, ends, strict=True)]
    legend = f"Scale error: {', '.join(texts)} {name}{f'; {sea} sea' if apart else ''}"
    return [*("".join(line).rstrip() for line in picture), legend]
