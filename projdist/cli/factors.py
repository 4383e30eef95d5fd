"""The command `factors`: at points of the command line, of standard input, and of people's files."""

from __future__ import annotations

import contextlib
import functools
import math
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from projdist import gis
from projdist.answers import factors
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing, tell_problems
from projdist.cli.formats import CSV, TABLE, drawing, present, tell_written
from projdist.cli.number_format import fixed, label_of
from projdist.cli.pictures import check_libraries
from projdist.cli.report import Column, Report, Table
from projdist.projections import (
    TEXT_SUFFIXES,
    Projection,
    check_degrees,
    check_new_names,
    coordinate_columns,
    read_point_table,
    tell_of_missing,
)
from projdist.support import (
    MISSING,
    cells_of,
    has_decimal_comma,
    is_number,
    is_stream,
    plain,
    separator_of,
    with_decimal_points,
)

_DECIMALS = {"x": 3, "y": 3, "omega": 6, "theta": 6, "convergence": 6}
_MOST_DECIMALS = 8


def factors_report(found: Mapping[str, Any], header: Sequence[str]) -> Report:
    """Factors at points; the header is for CSV without points."""
    rows = found["results"]
    names = [*rows[0]] if rows else []
    columns = [Column(name, show=functools.partial(_cell, name)) for name in names]
    keys = 2 if names[:2] == ["lon", "lat"] else 1
    return Report(
        title=_title(found["projection"], found["name"], found["definition"]) if rows else "No point could be read.",
        tables=[Table(rows, columns, keys=keys)] if rows else [],
        data=lambda: found,
        header=header,
    )


def _title(given: str, name: str, definition: str) -> str:
    """The projection as given, with its definition, which has the ellipsoid: `krovak (+proj=...)`."""
    label, meant = label_of(given, name), label_of(definition, name)
    return label if label == meant else f"{label} ({meant})"


def _cell(name: str, value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if name in ("lon", "lat"):
        return f"{value:.10g}"
    if abs(value) >= 1e6 and name not in ("x", "y"):
        return f"{value:.9g}"
    return fixed(value, _DECIMALS.get(name, _MOST_DECIMALS))


# ---- points --------------------------------------------------------------------------------------


class _Point(NamedTuple):
    lon: float
    lat: float


@dataclass
class GivenPoints:
    """Longitudes and latitudes in degrees, their labels, and messages for unreadable lines."""

    lon: list[float] = field(default_factory=list)
    lat: list[float] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def add(self, point: _Point, text: str = "") -> None:
        """Append a point."""
        self.lon.append(point.lon)
        self.lat.append(point.lat)
        self.text.append(text)


def read_points(words: Sequence[str], lines: Iterable[str]) -> GivenPoints:
    """Points of words LON LAT or LON,LAT, or, if the only word is `-`, of the lines.

    Degrees may have minutes and seconds, and the letters N, S, E, W, which tell what is a latitude. A line
    that cannot be read is a problem, not an error: the others go on. Raises ValueError for words that are no
    points, and where there are no points at all.
    """
    points = GivenPoints()
    words = [word.strip() for word in words]
    if words == ["-"]:
        _read_lines(points, lines)
        tell_of_missing(np.array(points.lon), np.array(points.lat))
        if not points.lon and not points.problems:
            raise ValueError("Invalid standard input. It must have lines of 'lon lat [text]'; there were none.")
        return points
    parts = [part for word in words for part in _pair(word) or [word] if part]
    if len(parts) % 2:
        raise ValueError(
            f"Invalid coordinates '{_quoted(' '.join(words))}'. They must be pairs of LON LAT, or - for stdin."
        )
    for one, other in zip(parts[::2], parts[1::2], strict=True):
        point = _point(one, other)
        if math.isnan(point.lon) or math.isnan(point.lat):
            name, word = ("longitude", one) if math.isnan(point.lon) else ("latitude", other)
            raise ValueError(f"Invalid {name} '{word}'. It must be a number of degrees.")
        points.add(point)
    return points


def _pair(word: str) -> list[str]:
    """Parts of a word that is a pair, as `10,50` or `"50N 10E"`; empty otherwise."""
    parts = re.split(r"\s*,\s*|\s+", word)
    return parts if len(parts) == 2 else []


def _read_lines(points: GivenPoints, lines: Iterable[str]) -> None:
    """Read points from lines, the first of which may be a header."""
    header: _Header | None = None
    first = True
    for number, line in enumerate(lines, start=1):
        text = line.lstrip("\ufeff").strip()
        if not text or text.startswith("#"):
            continue
        try:
            if first:
                first, header = False, _header(text)
                if header is not None:
                    continue
            _read_line(points, text, header)
        except ValueError as error:
            points.problems.append(f"line {number}: {error}")


class _Header(NamedTuple):
    """Column numbers of longitude and latitude, and the separator; None for blanks."""

    columns: tuple[int, int]
    separator: str | None


def _header(text: str) -> _Header | None:
    """Header of a first line that names columns, else None."""
    separator = separator_of(text)
    columns = coordinate_columns(_cells(text, separator))
    return None if columns is None else _Header(columns, separator)


def _cells(text: str, separator: str | None) -> list[str]:
    """Cells of a line, with decimal commas replaced by points."""
    try:
        row = cells_of(text, separator)
    except ValueError as error:
        raise ValueError(f"Invalid point '{_quoted(text)}'. It has {error}.") from error
    return [cell.strip() for cell in with_decimal_points([(1, row)])[0][1]]


def _is_blank_separated(line: str, header: _Header) -> bool:
    """True if the coordinate columns hold numbers when the line is split at blanks."""
    words = line.split()
    return len(words) > max(header.columns) and all(
        is_number(words[place]) or has_decimal_comma(words[place]) for place in header.columns
    )


def _read_line(points: GivenPoints, line: str, header: _Header | None) -> None:
    """Add the point of a line; raises ValueError."""
    if header is not None:
        cells = _cells(line, header.separator or (None if _is_blank_separated(line, header) else separator_of(line)))
        if len(cells) <= max(header.columns):
            raise ValueError(f"Invalid point '{_quoted(line)}'. It has no cell for each of lon and lat.")
        label = " ".join(cell for place, cell in enumerate(cells) if place not in header.columns)
        points.add(_point(*("nan" if cells[place] in MISSING else cells[place] for place in header.columns)), label)
        return
    separator = separator_of(line)
    if separator in (";", "\t"):
        cells = _cells(line, separator)
        if len(cells) > 1 and (is_number(cells[1]) or not has_decimal_comma(line.partition(separator)[0])):
            line = " ; ".join(cells)
    elif separator is None and all(map(has_decimal_comma, line.split())):
        raise ValueError(
            f"Invalid point '{_quoted(line)}'. A semicolon must stand between numbers with decimal commas."
        )
    words = re.split(r"\s*[,;]\s*|\s+", line, maxsplit=2)
    if len(words) < 2:
        raise ValueError(f"Invalid point '{_quoted(line)}'. It must be 'lon lat [text]'.")
    rest = re.split(r"\s*[,;]\s*|\s+", words[2]) if len(words) > 2 else []
    if len(rest) == 1 and _angle(words[0]) is None and None not in (_angle(words[1]), _angle(rest[0])):
        points.add(_point(words[1], rest[0]), words[0])  # its name comes first
    else:
        points.add(_point(words[0], words[1]), words[2] if len(words) > 2 else "")


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


def _point(one: str, other: str) -> _Point:
    """Point of a longitude and a latitude, in either order if letters tell; NaN for missing ones."""
    east, north = _angle(one), _angle(other)
    text = _quoted(f"{one} {other}")
    if east is None or north is None:
        raise ValueError(f"Invalid point '{text}'. Longitude and latitude must be numbers of degrees.")
    if east[1] in ("N", "S") or north[1] in ("E", "W"):
        east, north, one, other = north, east, other, one
    if east[1] in ("N", "S") or north[1] in ("E", "W"):
        raise ValueError(f"Invalid point '{text}'. One must be a longitude and one a latitude.")
    point = _Point(east[0], north[0])
    if math.isinf(point.lon) or abs(point.lon) > 720:
        raise ValueError(f"Invalid longitude '{one}'. It must be a number of degrees within -720 and 720.")
    if abs(point.lat) > 90:
        raise ValueError(f"Invalid latitude '{other}'. It must lie within -90 and 90 degrees.")
    return point


def _quoted(text: str) -> str:
    """Text shortened for a message."""
    return text if len(text) <= 80 else f"{text[:77]}..."


# ---- tables --------------------------------------------------------------------------------------


TABLE_SUFFIXES = (".parquet", ".gpkg", ".geojson")
_SUFFIXES = (".csv", *TABLE_SUFFIXES)


def is_table_file(path: Path) -> bool:
    """True if the suffix is of a binary or GIS file, which cannot be printed."""
    return path.suffix.lower() in TABLE_SUFFIXES and not is_stream(path)


def measure_file(
    projection: Projection,
    given: str,
    at: str,
    measures: Sequence[str],
    prefix: str,
    form: str,
    path: Path | None,
    overwrite: bool,
) -> None:
    """Add columns of measures to the points of a file, and print or write them."""
    if path is not None and not is_stream(path):
        if path.suffix.lower() not in _SUFFIXES:
            refuse(f"Invalid output '{path}'. Its suffix must be {', '.join(_SUFFIXES[:-1])} or {_SUFFIXES[-1]}.")
        if form != TABLE:
            refuse(f"Invalid format '{form}' for '{path}'. Its suffix tells the format.")
        form = CSV
    with refusing():
        if at.lower().endswith(TEXT_SUFFIXES) and (path is None or not is_table_file(path)):
            header, rows = _measured_text(projection, at, measures, prefix, form)
        else:
            frame = _measured_frame(projection, at, measures, prefix, path)
            if path is not None and is_table_file(path):
                _write_frame(projection, frame, path, overwrite)
                return
            header, rows = _rows(projection, frame)
    named = {"projection": given, "name": projection.name, "definition": projection.definition}
    present(factors_report(named | {"results": rows}, header), form, path, overwrite)


def _measured_text(
    projection: Projection, at: str, measures: Sequence[str], prefix: str, form: str
) -> tuple[list[str], list[dict[str, Any]]]:
    """Header and rows of a text table with measures added; its own cells stay text, with decimal points."""
    read = read_point_table(Path(at), f"Invalid points file '{at}'.")
    header, rows = read.header, [row for _, row in read.rows]
    lon, lat = check_degrees(*([row[column] for row in rows] for column in (read.lon, read.lat)))
    columns = {
        prefix + name: values for name, values in factors(projection, lon, lat, measures=measures).columns().items()
    }
    check_new_names(header, columns)
    added = zip(*(values.tolist() for values in columns.values()), strict=True)
    table = [
        dict(zip([*header, *columns], [*row, *map(plain, values)], strict=True))
        for row, values in zip(rows, added, strict=True)
    ]
    if form != CSV:
        for row, east, north in zip(table, lon.tolist(), lat.tolist(), strict=True):
            row.update({header[read.lon]: east, header[read.lat]: north})
    return [*header, *columns], table


def _measured_frame(projection: Projection, at: str, measures: Sequence[str], prefix: str, path: Path | None) -> Any:
    """GeoDataFrame of a file's points with measures added."""
    if path is not None and is_table_file(path):
        check_libraries(path)
    return factors(projection, gis.read_points(at), measures=measures, prefix=prefix)


def _rows(projection: Projection, frame: Any) -> tuple[list[str], list[dict[str, Any]]]:
    """Columns and rows of a frame without geometries."""
    table = gis.plain_table(projection, frame)
    rows = [{name: _table_cell(value) for name, value in row.items()} for row in table.to_dict("records")]
    return [str(name) for name in table.columns], rows


def _table_cell(value: Any) -> Any:
    """Cell as a number, text or None."""
    if isinstance(value, str | int | float | np.generic | None):
        return plain(value)
    return str(value)


def write_table(projection: Projection, rows: Sequence[Mapping[str, Any]], path: Path, overwrite: bool) -> None:
    """Write rows with `lon` and `lat` to a file for GIS programs."""
    check_libraries(path)
    _write_frame(projection, gis.frame_of(rows), path, overwrite)


def _write_frame(projection: Projection, frame: Any, path: Path, overwrite: bool) -> None:
    with drawing(path):
        gis.save_points(projection, frame, path, overwrite=overwrite)
    tell_written(path)


# ---- factors -------------------------------------------------------------------------------------


def factors_command(
    projection: opt.OneProjection,
    coordinates: list[str] | None = opt.argument(
        "LON LAT...", "Degrees; - reads lines of 'lon lat [text]' from stdin.", None
    ),
    at: str | None = opt.option(
        "FILE[#LAYER]",
        "Points to add columns to: a table (.csv, .tsv, .txt) with lon and lat, or any that GDAL reads.",
    ),
    measure: opt.Measures = None,
    prefix: str = opt.option("TEXT", "What the columns added to FILE begin with.", ""),
    format: str | None = opt.file_format(),
    output: str | None = opt.output(
        "File to write instead of printing; with --at, and always for the last three, its suffix tells what "
        "it is: .csv, .parquet, .gpkg or .geojson."
    ),
    overwrite: opt.Overwrite = False,
) -> None:
    """Scales, angles and other measures of a projection at points."""
    path, names = opt.printed_or_file(output, overwrite), opt.measure_names(measure)
    # The points of a file have formats of their own.
    form = opt.format_for(format, path, others=TABLE_SUFFIXES) if at is None else opt.format_of(format or TABLE)
    if (coordinates is None) == (at is None):
        refuse("Invalid points. They must be LON LAT..., - for stdin, or --at FILE. See 'projdist factors --help'.")
    with refusing():
        measured = Projection.from_user_input(projection)
    if at is not None:
        measure_file(measured, projection, at, names, prefix, form, path, overwrite)
        return
    with refusing():
        points = read_points(coordinates or [], sys.stdin)
    found = factors(measured, points.lon, points.lat, measures=names)
    result = found.to_dict() | {"projection": projection}
    if any(points.text):
        for row, text in zip(result["results"], points.text, strict=True):
            row["text"] = text
    if path is not None and is_table_file(path):
        write_table(measured, result["results"], path, overwrite)
    else:
        present(factors_report(result, ["lon", "lat", *found.columns()]), form, path, overwrite)
    tell_problems(points.problems)
