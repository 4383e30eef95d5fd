"""Points from the command line and from standard input."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from projdist.projections import MISSING, coordinate_columns, tell_of_missing
from projdist.support import cells_of, has_decimal_comma, is_number, separator_of, with_decimal_points


class _Point(NamedTuple):
    lon: float
    lat: float


@dataclass
class Points:
    """Longitudes and latitudes in degrees, the text that came with each, and what could not be read."""

    lon: list[float] = field(default_factory=list)
    lat: list[float] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def add(self, point: _Point, text: str = "") -> None:
        """Append a point."""
        self.lon.append(point.lon)
        self.lat.append(point.lat)
        self.text.append(text)


def read_points(words: Sequence[str], lines: Iterable[str]) -> Points:
    """Points of LON LAT or LON,LAT words, or, where the only word is `-`, of the lines.

    Degrees may have minutes and seconds, and the letters N, S, E, W, which tell what is a latitude. A line
    that cannot be read is a problem, not an error: the others go on. Raises ValueError for words that are no
    points, and where there are no points at all.
    """
    points = Points()
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
    """The two of a pair in one word, as `10,50` or `"50N 10E"`; none if it is not of two."""
    parts = re.split(r"\s*,\s*|\s+", word)
    return parts if len(parts) == 2 else []


def _read_lines(points: Points, lines: Iterable[str]) -> None:
    """The points of lines, the first of which may be a header."""
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
    """The numbers of the columns of longitudes and latitudes, and what stands between columns; None for blanks."""

    columns: tuple[int, int]
    separator: str | None


def _header(text: str) -> _Header | None:
    """What a first line names, if it names columns."""
    separator = separator_of(text)
    columns = coordinate_columns(_cells(text, separator))
    return None if columns is None else _Header(columns, separator)


def _cells(text: str, separator: str | None) -> list[str]:
    """The cells of a line, with decimal points in place of commas where these do not stand between them."""
    try:
        row = cells_of(text, separator)
    except ValueError as error:
        raise ValueError(f"Invalid point '{_quoted(text)}'. It has {error}.") from error
    return [cell.strip() for cell in with_decimal_points([(1, row)])[0][1]]


def _is_blank_separated(line: str, header: _Header) -> bool:
    """Whether numbers stand in the columns of coordinates if blanks part these."""
    words = line.split()
    return len(words) > max(header.columns) and all(
        is_number(words[place]) or has_decimal_comma(words[place]) for place in header.columns
    )


def _read_line(points: Points, line: str, header: _Header | None) -> None:
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
    """Degrees, and the letter behind them; None for a word that is no angle."""
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
    """A point of longitude and latitude, or the other way round where letters say so; NaN is nowhere."""
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
    """Text for a message, not too long."""
    return text if len(text) <= 80 else f"{text[:77]}..."
