"""The commands `factors` (at points of the command line, standard input or a file) and `profile` (along a line)."""

from __future__ import annotations

import contextlib
import functools
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from projdist import answers, gis, plots, projections, support
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, tell_problems
from projdist.cli.report import CSV, DETAILS, TABLE, Column, Report, Table, drawing, present, tell_written
from projdist.cli.wording import distance_error, errors_text, fixed, label_of, place_text, shortened, spoken

_DECIMALS = {"x": 3, "y": 3, "omega": 6, "theta": 6, "convergence": 6}
_PROFILE_DECIMALS = _DECIMALS | {"azimuth": 4, "height": 3}
_MOST_DECIMALS = 8
_TRUE = 1e-9  # a scale error, or a convergence in degrees, that is only rounding
_SCALES = ("a", "b", "s", "omega")
_USUAL = ("x", "y", "h", "k", "convergence", "omega", "s", "a", "b", "theta", "fisher", "quality")  # after others
_SHOWN = 10  # points
_LONGEST = 80  # characters of a quotation in a message
_TABLE_SUFFIXES = (".parquet", ".gpkg", ".geojson")  # of binary and GIS files, which cannot be printed
_SUFFIXES = (".csv", *_TABLE_SUFFIXES)
_TEXTS = ", ".join(projections.TEXT_SUFFIXES)
_AT = f"Points to add columns to: a table ({_TEXTS}) with lon and lat, or any that GDAL reads."


def factors_command(
    projection: opt.OneProjection,
    coordinates: list[str] | None = opt.argument(
        "LON LAT...", "Degrees; - reads lines of 'lon lat [text]' from stdin.", None
    ),
    at: str | None = opt.option("FILE[#LAYER]", _AT),
    measure: opt.Measures = None,
    prefix: str = opt.option("TEXT", "Prefix of the columns added to FILE.", ""),
    format: str | None = opt.file_format(),
    output: str | None = opt.output(
        "File to write instead of printing; with --at, and always for the last three, its suffix tells the "
        "format: .csv, .parquet, .gpkg or .geojson."
    ),
    overwrite: opt.Overwrite = False,
) -> None:
    """Print scales, angles and other measures of a projection at points."""
    names = opt.measure_names(measure)
    if at is None:
        form, path, _ = opt.target(format, output, overwrite, others=_TABLE_SUFFIXES)
    else:  # the points of a file have formats of their own
        path = None if output is None else opt.output_file(output, overwrite)
        form = opt.format_of(format or TABLE)
    if (coordinates is None) == (at is None):
        refuse("Invalid points. They must be LON LAT..., - for stdin, or --at FILE. See 'projdist factors --help'.")
    suffix = None if path is None or support.is_stream(path) else path.suffix.lower()
    table = path if suffix in _TABLE_SUFFIXES else None
    with refusing():
        measured = projections.Projection.from_user_input(projection)
    if at is not None and suffix is not None:
        if suffix not in _SUFFIXES:
            refuse(f"Invalid output '{path}'. Its suffix must be {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
        if form not in (TABLE, DETAILS):
            refuse(f"Invalid format '{form}' for '{path}'. Its suffix tells the format.")
        form = CSV
    if table is not None:
        opt.check_libraries(table)
    frame, found, problems = None, dict[str, Any](), list[str]()
    if at is not None:
        with refusing():
            if table is None and at.lower().endswith(projections.TEXT_SUFFIXES):
                header, rows = _measured_text(measured, at, names, prefix, form)
            else:
                frame = answers.factors(measured, gis.read_points(at), measures=names, prefix=prefix)
                header, rows = _frame_rows(measured, frame) if table is None else ([], [])
        found = {"projection": projection, "name": measured.name, "definition": measured.definition, "results": rows}
    else:
        with refusing():
            points = read_points(coordinates or [], sys.stdin)
        factors = answers.factors(measured, points.lon, points.lat, measures=names)
        header, problems = ["lon", "lat", *factors.columns()], points.problems
        found = factors.to_dict() | {"projection": projection}
        if any(points.text):
            for row, text in zip(found["results"], points.text, strict=True):
                row["text"] = text
        if table is not None:
            frame = factors.to_frame()
            frame = frame.assign(text=points.text) if any(points.text) else frame
    if table is None:
        present(factors_report(found, header), form, path, overwrite)
    else:
        with drawing(table):
            gis.save_points(measured, frame, table, overwrite=overwrite)
        tell_written(table)
    tell_problems(problems)


def factors_report(found: Mapping[str, Any], header: Sequence[str]) -> Report:
    """Factors at points; the header is for CSV without points."""
    rows = found["results"]
    if not rows:
        return Report(title="No point could be read.", data=lambda: found, header=header)
    names = [*rows[0]]
    label, meant = label_of(found["projection"], found["name"]), label_of(found["definition"], found["name"])
    columns: list[Column] = [Column(name, show=functools.partial(_cell, name)) for name in names]
    wanted_first = sorted(columns, key=lambda one: _USUAL.index(one.key) if one.key in _USUAL else -1)
    keys = 2 if names[:2] == ["lon", "lat"] else 1
    return Report(
        answer=[*_factors_answer(rows, spoken(found["projection"], found["name"]))],
        brief=[Table(rows, wanted_first, keys=keys, most=_SHOWN)],
        title=label if label == meant else f"{label} ({meant})",  # the definition has the ellipsoid
        tables=[Table(rows, columns, keys=keys)],
        data=lambda: found,
        header=header,
    )


def _factors_answer(rows: Sequence[Mapping[str, Any]], label: str) -> Iterator[str]:
    """Sentences: the largest errors at the points, points without scales, and grid north at a single point."""
    given, rows = len(rows), [row for row in rows if all(isinstance(row.get(key), float) for key in _SCALES)]

    def largest(error: Callable[[Mapping[str, Any]], float]) -> float:
        return max(map(error, rows))

    if rows:
        lon, lat = (rows[0].get(key) for key in ("lon", "lat"))
        where = f"At {len(rows):,} point{'s' * (len(rows) > 1)}"
        if given == 1 and isinstance(lon, float) and isinstance(lat, float):
            where = f"At {place_text(lon, lat)}"
        distances = largest(lambda row: max(row["a"] - 1.0, 1.0 - row["b"]))
        errors = errors_text(distances, largest(lambda row: abs(row["s"] - 1.0)), largest(lambda row: row["omega"]))
        yield f"{where} on {label}, {errors}."
    if len(rows) < given:
        yield f"The map has no scales at {given - len(rows):,} of {given:,} point{'s' * (given > 1)}."
    if given == len(rows) == 1 and isinstance(rows[0].get("convergence"), float):
        turned = rows[0]["convergence"]
        side = "east" if turned > 0.0 else "west"
        north = f"lies {abs(turned):.6g}° {side} of" if abs(turned) > _TRUE else "is"
        yield f"Grid north {north} true north."


def _cell(name: str, value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if name in ("lon", "lat"):
        return f"{value:.10g}"
    if abs(value) >= 1e6 and name not in ("x", "y"):
        return f"{value:.9g}"
    return fixed(value, _DECIMALS.get(name, _MOST_DECIMALS))


def _measured_text(
    projection: projections.Projection, at: str, measures: Sequence[str], prefix: str, form: str
) -> tuple[list[str], list[dict[str, Any]]]:
    """Header and rows of a text table with measures added; its own cells stay text, with decimal points."""
    read = projections.read_point_table(Path(at), f"Invalid points file '{at}'.")
    header, rows = read.header, [row for _, row in read.rows]
    lon, lat = projections.check_degrees(*([row[column] for row in rows] for column in (read.lon, read.lat)))
    measured = answers.factors(projection, lon, lat, measures=measures).columns()
    columns = {prefix + name: values.tolist() for name, values in measured.items()}
    projections.check_new_names(header, columns)
    names = [*header, *columns]
    table = [
        dict(zip(names, [*row, *map(support.plain, values)], strict=True))
        for row, *values in zip(rows, *columns.values(), strict=True)
    ]
    if form != CSV:
        for row, east, north in zip(table, lon.tolist(), lat.tolist(), strict=True):
            row.update({header[read.lon]: east, header[read.lat]: north})
    return names, table


def _frame_rows(projection: projections.Projection, frame: Any) -> tuple[list[str], list[dict[str, Any]]]:
    """Header and rows of a frame without geometries; cells are numbers, texts or None."""
    table, figures = gis.plain_table(projection, frame), (str, int, float, np.generic, type(None))
    rows = [
        {name: support.plain(value) if isinstance(value, figures) else str(value) for name, value in row.items()}
        for row in table.to_dict("records")
    ]
    return [str(name) for name in table.columns], rows


# ---- points --------------------------------------------------------------------------------------


@dataclass
class GivenPoints:
    """Longitudes and latitudes in degrees, their labels, and messages for unreadable lines."""

    lon: list[float] = field(default_factory=list)
    lat: list[float] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def add(self, point: tuple[float, float], text: str = "") -> None:
        """Append a point."""
        self.lon.append(point[0])
        self.lat.append(point[1])
        self.text.append(text)


def read_points(words: Sequence[str], lines: Iterable[str]) -> GivenPoints:
    """Points of words LON LAT or LON,LAT, or, if the only word is `-`, of the lines."""
    # Degrees may have minutes and seconds, and the letters N, S, E, W, which tell what is a latitude. A line that
    # cannot be read is a problem, not an error: the others go on. Raises ValueError for words that are no points, and
    # where there are no points at all.
    points = GivenPoints()
    words = [word.strip() for word in words]
    if words == ["-"]:
        _read_lines(points, lines)
        projections.tell_of_missing(np.array(points.lon), np.array(points.lat))
        if not points.lon and not points.problems:
            raise ValueError("Invalid standard input. It must have lines of 'lon lat [text]'; there were none.")
        return points
    parts: list[str] = []
    for word in words:
        pair = re.split(r"\s*,\s*|\s+", word)  # as `10,50` or `"50N 10E"`
        parts += filter(None, pair if len(pair) == 2 else [word])
    if len(parts) % 2:
        given = shortened(" ".join(words), _LONGEST)
        raise ValueError(f"Invalid coordinates '{given}'. They must be pairs of LON LAT, or - for stdin.")
    for one, other in zip(parts[::2], parts[1::2], strict=True):
        point = _point(one, other)
        for value, name, word in zip(point, ("longitude", "latitude"), (one, other), strict=True):
            if math.isnan(value):
                raise ValueError(f"Invalid {name} '{word}'. It must be a number of degrees.")
        points.add(point)
    return points


def _read_lines(points: GivenPoints, lines: Iterable[str]) -> None:
    """Read points from lines, the first of which may be a header."""
    first, columns, separator = True, None, None
    for number, line in enumerate(lines, start=1):
        text = line.lstrip("\ufeff").strip()
        if not text or text.startswith("#"):
            continue
        try:
            if first:
                first, separator = False, support.separator_of(text)
                columns = projections.coordinate_columns(_cells(text, separator))
                if columns is not None:
                    continue
            points.add(*(_read_line(text) if columns is None else _read_row(text, columns, separator)))
        except ValueError as error:
            points.problems.append(f"line {number}: {error}")


def _cells(text: str, separator: str | None) -> list[str]:
    """Cells of a line, with decimal commas replaced by points."""
    try:
        row = support.cells_of(text, separator)
    except ValueError as error:
        raise ValueError(f"Invalid point '{shortened(text, _LONGEST)}'. It has {error}.") from error
    return [cell.strip() for cell in support.with_decimal_points([(1, row)])[0][1]]


def _read_row(line: str, columns: tuple[int, int], separator: str | None) -> tuple[tuple[float, float], str]:
    """The point of a line below a header, the other cells for its label; raises ValueError."""
    if separator is None:
        words = line.split()
        coordinates = [words[place] for place in columns] if len(words) > max(columns) else [""]
        if not all(support.is_number(word) or support.has_decimal_comma(word) for word in coordinates):
            separator = support.separator_of(line)
    cells = _cells(line, separator)
    if len(cells) <= max(columns):
        raise ValueError(f"Invalid point '{shortened(line, _LONGEST)}'. It has no cell for each of lon and lat.")
    lon, lat = ("nan" if cells[place] in support.MISSING else cells[place] for place in columns)
    return _point(lon, lat), " ".join(cell for k, cell in enumerate(cells) if k not in columns)


def _read_line(line: str) -> tuple[tuple[float, float], str]:
    """The point of a line `lon lat [text]`, or with its name first; raises ValueError."""
    separator = support.separator_of(line)
    if separator in (";", "\t"):
        cells = _cells(line, separator)
        if len(cells) > 1 and (
            support.is_number(cells[1]) or not support.has_decimal_comma(line.partition(separator)[0])
        ):
            line = " ; ".join(cells)
    elif separator is None and all(map(support.has_decimal_comma, line.split())):
        raise ValueError(
            f"Invalid point '{shortened(line, _LONGEST)}'. Semicolons must separate numbers with decimal commas."
        )
    words = re.split(r"\s*[,;]\s*|\s+", line, maxsplit=2)
    if len(words) < 2:
        raise ValueError(f"Invalid point '{shortened(line, _LONGEST)}'. It must be 'lon lat [text]'.")
    rest = re.split(r"\s*[,;]\s*|\s+", words[2]) if len(words) > 2 else []
    if len(rest) == 1 and _angle(words[0]) is None and None not in (_angle(words[1]), _angle(rest[0])):
        return _point(words[1], rest[0]), words[0]  # its name comes first
    return _point(words[0], words[1]), words[2] if len(words) > 2 else ""


_FIGURE = r"(\d+(?:\.\d*)?|\.\d+)"
_ANGLE = re.compile(rf"([+-]?){_FIGURE}(?:[d°](?:{_FIGURE}['′]?)?(?:{_FIGURE}(?:\"|″|''))?)?([nsew]?)", re.IGNORECASE)


def _angle(word: str) -> tuple[float, str] | None:
    """Degrees and the hemisphere letter of an angle; None for another word."""
    with contextlib.suppress(ValueError):
        return float(word), ""
    match = _ANGLE.fullmatch(word)
    if match is None or any(float(part or 0) >= 60 for part in match.group(3, 4)):
        return None
    value = float(match[2]) + float(match[3] or 0) / 60 + float(match[4] or 0) / 3600
    letter = match[5].upper()
    turned = (match[1] == "-") != (letter in ("S", "W"))
    return (-value if turned else value), letter


def _point(one: str, other: str) -> tuple[float, float]:
    """Longitude and latitude of two words, in either order if letters tell; NaN for missing ones."""
    east, north = _angle(one), _angle(other)
    text = shortened(f"{one} {other}", _LONGEST)
    if east is None or north is None:
        raise ValueError(f"Invalid point '{text}'. Longitude and latitude must be numbers of degrees.")
    if east[1] in ("N", "S") or north[1] in ("E", "W"):
        east, north, one, other = north, east, other, one
    if east[1] in ("N", "S") or north[1] in ("E", "W"):
        raise ValueError(f"Invalid point '{text}'. One must be a longitude and one a latitude.")
    lon, lat = east[0], north[0]
    if math.isinf(lon) or abs(lon) > 720:
        raise ValueError(f"Invalid longitude '{one}'. It must be a number of degrees within -720 and 720.")
    if abs(lat) > 90:
        raise ValueError(f"Invalid latitude '{other}'. It must lie within -90 and 90 degrees.")
    return lon, lat


# ---- profile -------------------------------------------------------------------------------------


def profile_command(
    projection: opt.OneProjection,
    line: str = opt.option(
        "FILE|LON,LAT,...",
        "A line: a file, such as road.geojson or roads.gpkg#LAYER, or LON,LAT of two or more points.",
        ...,
    ),
    measure: opt.Measures = None,
    spacing: str | None = opt.option("KM", "Distance between the points; a round number if not given."),
    height: str | None = opt.option("METRES", "Ellipsoidal height of the line, in place of its own."),
    format: str | None = opt.file_format(),
    output: str | None = opt.output("A picture: .png, .svg or .pdf; or a table: .csv, .json, .md or .txt."),
    *,
    pictured: opt.GraphOptions,
) -> None:
    """Print scale, convergence and other measures along a line, and the combined factor at heights."""
    drawn = opt.is_picture(output)
    picture = opt.picture_of(output if drawn else None, pictured)
    target = opt.target(format, None if drawn else output, pictured.overwrite, others=plots.SUFFIXES)
    names = opt.measure_names(measure) or ["convergence"]
    step = opt.number("spacing", spacing, 1e-6, 1e6, " of km")
    above = opt.number("height", height, -12_000.0, 9_000.0, " of metres")
    with refusing():
        found = answers.profile(projection, line, measures=names, spacing_km=step, height=above)
    if picture is not None:
        picture.save(plots.profile_figure, found)
    result = found.to_dict() | {"projection": projection}
    rows = result["results"]
    label = label_of(projection, found.projection.name)
    report = Report(
        answer=[*_profile_answer(found, spoken(projection, found.projection.name))],
        next={} if picture else {"-o profile.png": "To draw it, the same command with"},
        title=f"{label} along {label_of(line, 'a line')} ({found.length_m / 1e3:,.6g} km)",
        tables=[Table(rows, [Column(name, show=functools.partial(_profile_cell, name)) for name in rows[0]])],
        notes=[*_notes(found)],
        data=lambda: result,
        written=[picture] if picture and not support.is_stream(picture.path) else [],
    )
    present(report, *target)


def _profile_answer(found: answers.Profile, label: str) -> Iterator[str]:
    """Sentences: how much too long or too short the line is on the map, and its length on the ground."""
    error = found.mean_scale - 1.0
    longer = f"{distance_error(abs(error))} too {'long' if error > 0.0 else 'short'} on average"
    if abs(error) <= _TRUE:
        longer = "true on average"
    elif error != error:
        longer = "undefined, as the map does not show all of it"
    lengths = f"{_metres(found.map_length_m)} for {_metres(found.length_m)} on the ellipsoid"
    yield f"Along {found.length_m / 1e3:,.6g} km on {label}, distances are {longer}: {lengths}."
    if found.ground_length_m is not None and found.mean_combined_factor is not None:
        combined = _factor(found.mean_combined_factor)
        yield f"On the ground it is {_metres(found.ground_length_m)} long: combined factor {combined}."


def _notes(found: answers.Profile) -> Iterator[str]:
    yield "Scale: in the direction of the line, whose edges are geodesics; at a vertex that of the edge which follows."
    lengths = f"On the ellipsoid {_metres(found.length_m)}, on the map {_metres(found.map_length_m)}"
    yield f"{lengths}: mean scale {_factor(found.mean_scale)}"
    yield f"Grid distance, straight from vertex to vertex: {_metres(found.grid_distance_m)}"
    for k in found.torn:
        between = f"{found.distance_km[k - 1]:,.6g} and {found.distance_km[k]:,.6g} km"
        yield f"The map is cut between {between}: the grid distance goes across."
    if found.ground_length_m is not None and found.mean_combined_factor is not None:
        combined = _factor(found.mean_combined_factor)
        yield f"On the ground {_metres(found.ground_length_m)}: mean combined factor {combined}"


def _metres(length: float) -> str:
    return f"{fixed(length, 3, ',')} m" if length == length else "undefined"


def _factor(value: float) -> str:
    return f"{fixed(value, 9)} ({fixed(1e6 * (value - 1.0), 2, '+')} ppm)" if value == value else "undefined"


def _profile_cell(name: str, value: Any) -> str:
    if name in ("lon", "lat"):
        return f"{value:.9g}"
    return f"{value:.7g}" if name == "distance_km" else fixed(value, _PROFILE_DECIMALS.get(name, _MOST_DECIMALS))
