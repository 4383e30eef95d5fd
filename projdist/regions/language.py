"""The small language that names regions, the same on the command line and in Python.

    globe, land, ocean              land@110m and ocean@110m in less detail
    box:W,S,E,N                     degrees; W > E crosses the antimeridian
    cap:LON,LAT,KM                  within a distance of a point
    country:NAME                    or its ISO 3166 code; country:CH@110m in less detail
    continent:NAME                  its countries
    crs:CODE                        the area of use of a CRS
    file:PATH, file:PATH#LAYER      polygons of a file, with edges straight in its coordinates
    geodesic:PATH, ...#LAYER        the same, with geodesics for edges
    points:PATH, points:PATH#LAYER  points of a file, with weights
    A & B, A - B, A + B             what is in both, in A and not in B, in either; & before - and +

Operators have blanks around them; brackets group; quotation marks protect a path that has either.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from projdist.hints import did_you_mean
from projdist.projections.geodesy import area_of_use
from projdist.regions.boxes import GLOBE, Box
from projdist.regions.caps import Cap
from projdist.regions.points import PointSet
from projdist.regions.region import Region

Place = Region | PointSet

FORMS = (
    "globe, land, ocean, box:W,S,E,N, cap:LON,LAT,KM, country:NAME, continent:NAME, crs:CODE, file:PATH, geodesic:PATH "
    "or points:PATH, or a combination of these by &, - and +"
)

_OPERATOR = re.compile(r"\s+([&+-])(?=\s|$)")


def get_region(region: str | Place | Mapping[str, Any]) -> Place:
    """The region of a text, such as `globe`, `box:W,S,E,N`, `country:CH`, `land - continent:Antarctica`.

    The language is that of `projdist.regions.language`. A region stands for itself, and GeoJSON (a
    dictionary, or anything with `__geo_interface__`, as shapely's geometries) for its polygons.
    Raises ValueError.
    """
    if isinstance(region, str):
        return _Parser(region).parse()
    shape = getattr(region, "__geo_interface__", region)
    if isinstance(shape, Mapping):
        from projdist.regions.files import polygons_from_geojson  # shapely is slow to load

        return polygons_from_geojson(dict(shape))
    return cast(Place, region)


def weighted_points(text: str, column: str) -> PointSet:
    """The region `points:PATH` with the weights of a column of the file; raises ValueError."""
    kind, _, argument = text.strip().partition(":")
    if kind.lower() != "points":
        raise ValueError(f"Invalid weight '{column}'. It must be a raster, or, of points:PATH, the name of a column.")
    from projdist.regions.files import points_from_file  # as above

    return points_from_file(*_path(text, argument.strip()), text.strip(), column)


class _Parser:
    """Recursive descent: a sum of products of atoms and brackets."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.given = text.strip()
        self.rest = self.given

    def parse(self) -> Place:
        found = self._sum()
        if self.rest:
            raise ValueError(f"Invalid region '{self.text}'. Its brackets must close what they open.")
        return found

    def _sum(self) -> Place:
        return self._chain("+-", self._product)

    def _product(self) -> Place:
        return self._chain("&", self._factor)

    def _chain(self, operators: str, part: Callable[[], Place]) -> Place:
        before = self.rest
        found = part()
        while (operator := _OPERATOR.match(self.rest)) and operator[1] in operators:
            self.rest = self.rest[operator.end() :].lstrip()
            other = part()
            from projdist.regions.combined import combine  # as above

            name = " ".join(before[: len(before) - len(self.rest)].split())
            found = combine(operator[1], found, other, name)
        return found

    def _factor(self) -> Place:
        if not self.rest.startswith("("):
            return self._atom()
        self.rest = self.rest[1:].lstrip()
        found = self._sum()
        self.rest = self.rest.lstrip()
        if not self.rest.startswith(")"):
            raise ValueError(f"Invalid region '{self.text}'. Its brackets must close what they open.")
        self.rest = self.rest[1:]
        return found

    def _atom(self) -> Place:
        end = _end_of_atom(self.rest)
        text, self.rest = self.rest[:end].strip(), self.rest[end:]
        if (not text and self.given) or re.match(r"[&+-]\s", text):
            raise ValueError(f"Invalid region '{self.text}'. There must be a region on each side of an operator.")
        return _region_of(text)


def _end_of_atom(text: str) -> int:
    """Where an operator or a bracket that the text did not open ends it."""
    depth, quoted = 0, False
    for place, character in enumerate(text):
        if character == '"':
            quoted = not quoted
        elif not quoted:
            if _OPERATOR.match(text, place):
                return place
            depth += {"(": 1, ")": -1}.get(character, 0)
            if depth < 0:
                return place
    return len(text)


def _region_of(text: str) -> Place:
    word, at, resolution = text.lower().partition("@")
    if word == "globe" and not at:
        return GLOBE
    if word in ("land", "ocean"):
        from projdist.regions import countries  # shapely is slow to load

        return {"land": countries.land, "ocean": countries.ocean}[word](_resolution(resolution, at))
    kind, _, argument = text.partition(":")
    if kind.lower() not in _KINDS:
        raise ValueError(f"Invalid region '{text}'. {_hint(text)}It must be {FORMS}.")
    return _KINDS[kind.lower()](text, argument.strip().strip('"'))


def _hint(text: str) -> str:
    if not text:
        return ""
    from projdist.regions.countries import close_regions  # as above

    close = close_regions(text.partition(":")[2] or text)
    return did_you_mean(close)


def _resolution(text: str, given: str) -> str:
    from projdist.geodata import RESOLUTIONS  # as above
    from projdist.regions.countries import DEFAULT_RESOLUTION

    if given and text not in RESOLUTIONS:
        raise ValueError(f"Invalid resolution '{text}'. It must be one of {', '.join(RESOLUTIONS)}.")
    return text or DEFAULT_RESOLUTION


def _numbers(text: str, argument: str, form: str, count: int) -> list[float]:
    try:
        values = [float(value) for value in argument.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise ValueError(f"Invalid region '{text}'. It must be {form}, {count} numbers.")
    return values


def _box(text: str, argument: str) -> Region:
    return Box(*_numbers(text, argument, "box:W,S,E,N", 4))


def _cap(text: str, argument: str) -> Region:
    return Cap(*_numbers(text, argument, "cap:LON,LAT,KM", 3))


def _country(text: str, argument: str) -> Region:
    from projdist.regions.countries import country  # as above

    name, at, resolution = argument.partition("@")
    return country(name.strip(), _resolution(resolution, at))


def _continent(text: str, argument: str) -> Region:
    from projdist.regions.countries import continent  # as above

    name, at, resolution = argument.partition("@")
    return continent(name.strip(), _resolution(resolution, at))


def _crs(text: str, argument: str) -> Region:
    return Box(*area_of_use(argument))


def _path(text: str, argument: str) -> tuple[Path, str]:
    """The path and the layer, "" for the first one; a path that exists may have a # itself."""
    if not argument:
        raise ValueError(f"Invalid region '{text}'. It must have the path of a file behind the colon.")
    path, mark, layer = argument.rpartition("#")
    return (Path(path), layer) if mark and not Path(argument).exists() else (Path(argument), "")


def _file(text: str, argument: str) -> Region:
    from projdist.regions.files import polygons_from_file  # as above

    return polygons_from_file(*_path(text, argument), text)


def _geodesic(text: str, argument: str) -> Region:
    from projdist.regions.files import polygons_from_file  # as above

    return polygons_from_file(*_path(text, argument), text, edges="geodesic")


def _points(text: str, argument: str) -> PointSet:
    from projdist.regions.files import points_from_file  # as above

    return points_from_file(*_path(text, argument), text)


_KINDS: dict[str, Callable[[str, str], Place]] = {
    "box": _box,
    "cap": _cap,
    "country": _country,
    "continent": _continent,
    "crs": _crs,
    "file": _file,
    "geodesic": _geodesic,
    "points": _points,
}
