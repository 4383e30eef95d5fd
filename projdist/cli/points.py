"""Points from the command line and from standard input."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple


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
    """Points of LON LAT words, or, where the only word is `-`, of the lines.

    A line that cannot be read is a problem, not an error: the others go on. Raises ValueError for
    words that are no points, and where there are no points at all.
    """
    points = Points()
    words = [word.strip() for word in words]
    if words == ["-"]:
        for number, line in enumerate(lines, start=1):
            _read_line(points, number, line.lstrip("\ufeff").strip())
        if not points.lon and not points.problems:
            raise ValueError("Invalid standard input. It must have lines of 'lon lat [text]'; there were none.")
        return points
    if len(words) % 2:
        raise ValueError(f"Invalid coordinates '{' '.join(words)}'. They must be pairs of LON LAT, or - for stdin.")
    for lon, lat in zip(words[::2], words[1::2], strict=True):
        points.add(_point(lon, lat))
    return points


def _read_line(points: Points, number: int, line: str) -> None:
    if not line or line.startswith("#"):
        return
    words = re.split(r"\s*,\s*|\s+", line, maxsplit=2)
    try:
        if len(words) < 2:
            raise ValueError(f"Invalid point '{_quoted(line)}'. It must be 'lon lat [text]'.")
        points.add(_point(words[0], words[1]), words[2] if len(words) > 2 else "")
    except ValueError as error:
        points.problems.append(f"line {number}: {error}")


def _point(lon: str, lat: str) -> _Point:
    try:
        point = _Point(float(lon), float(lat))
    except ValueError as error:
        text = _quoted(f"{lon} {lat}")
        raise ValueError(f"Invalid point '{text}'. Longitude and latitude must be numbers of degrees.") from error
    if not math.isfinite(point.lon) or abs(point.lon) > 720:
        raise ValueError(f"Invalid longitude '{lon}'. It must be a number of degrees within -720 and 720.")
    if not abs(point.lat) <= 90:
        raise ValueError(f"Invalid latitude '{lat}'. It must lie within -90 and 90 degrees.")
    return point


def _quoted(text: str) -> str:
    """Text for a message, not too long."""
    return text if len(text) <= 80 else f"{text[:77]}..."
