"""The command `profile`."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from projdist import plots
from projdist.answers import Profile, profile
from projdist.cli import options as opt
from projdist.cli.errors import refusing
from projdist.cli.formats import present
from projdist.cli.number_format import fixed, label_of
from projdist.cli.pictures import GraphOptions, PictureFile, picture_of
from projdist.cli.report import Column, Report, Table
from projdist.support import is_stream

_DECIMALS = {"x": 3, "y": 3, "azimuth": 4, "height": 3, "omega": 6, "theta": 6, "convergence": 6}
_MOST_DECIMALS = 8


def profile_command(
    projection: opt.OneProjection,
    line: str = opt.option(
        "FILE|LON,LAT,...",
        "A line: a file, as road.geojson or roads.gpkg#LAYER, or LON,LAT of two points or more.",
        ...,
    ),
    measure: opt.Measures = None,
    spacing: str | None = opt.option("KM", "Between the points; a round number if none."),
    height: str | None = opt.option("METRES", "Ellipsoidal height of the line, in place of its own."),
    format: str | None = opt.file_format(),
    output: str | None = opt.output("Picture: .png, .svg or .pdf; or table: .csv, .json, .md or .txt."),
    *,
    pictured: GraphOptions,
) -> None:
    """Scale, convergence and other measures along a line, and the combined factor at heights."""
    drawn = output is not None and Path(output).suffix.lower() in plots.SUFFIXES
    picture = picture_of(output if drawn else None, pictured)
    path = None if drawn else opt.printed_or_file(output, pictured.overwrite)
    form = opt.format_for(format, path, others=plots.SUFFIXES)
    names = opt.measure_names(measure) or ["convergence"]
    step = opt.number("spacing", spacing, 1e-6, 1e6, " of km")
    above = opt.number("height", height, -12_000.0, 9_000.0, " of metres")
    with refusing():
        found = profile(projection, line, measures=names, spacing_km=step, height=above)
    if picture is not None:
        picture.save(plots.profile_figure, found)
    present(_report(found, projection, line, picture), form, path, pictured.overwrite)


def _report(found: Profile, given: str, line: str, picture: PictureFile | None) -> Report:
    result = found.to_dict() | {"projection": given}
    rows = result["results"]
    columns: list[Column | str] = [Column(name, show=functools.partial(_cell, name)) for name in rows[0]]
    kilometres = f"{found.length_m / 1e3:,.6g} km"
    return Report(
        title=f"{label_of(given, found.projection.name)} along {label_of(line, 'a line')} ({kilometres})",
        tables=[Table(rows, columns)],
        notes=[*_notes(found)],
        data=lambda: result,
        written=[picture.path if picture and not is_stream(picture.path) else None],
    )


def _notes(found: Profile) -> Iterator[str]:
    yield "Scale: in the direction of the line, whose edges are geodesics; at a vertex that of the edge which follows."
    yield (
        f"On the ellipsoid {_metres(found.length_m)}, on the map {_metres(found.map_length_m)}: mean scale "
        + _factor(found.mean_scale)
    )
    yield f"Grid distance, straight from vertex to vertex: {_metres(found.grid_distance_m)}"
    for k in found.torn:
        between = f"{found.distance_km[k - 1]:,.6g} and {found.distance_km[k]:,.6g} km"
        yield f"The map is cut between {between}: the grid distance goes across."
    if found.ground_length_m is not None and found.mean_combined_factor is not None:
        yield f"On the ground {_metres(found.ground_length_m)}: mean combined factor " + _factor(
            found.mean_combined_factor
        )


def _metres(length: float) -> str:
    return f"{fixed(length, 3, ',')} m" if length == length else "undefined"


def _factor(value: float) -> str:
    return f"{fixed(value, 9)} ({fixed(1e6 * (value - 1.0), 2, '+')} ppm)" if value == value else "undefined"


def _cell(name: str, value: Any) -> str:
    if name in ("lon", "lat"):
        return f"{value:.9g}"
    if name == "distance_km":
        return f"{value:.7g}"
    return fixed(value, _DECIMALS.get(name, _MOST_DECIMALS))
