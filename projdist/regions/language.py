"""The small language that names regions on the command line and in Python."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np

from projdist import earth, regions  # both load shapely when it is needed
from projdist._typing import FloatArray
from projdist.earth import WGS84, Ellipsoid, latitude_text, longitude_text
from projdist.projections import Body, Projection, ProjectionError, area_of_use, ground_of, is_same_body
from projdist.regions.caps import Cap
from projdist.regions.region import GLOBE, Box, PointSet, Region, likelier
from projdist.support import did_you_mean, quoted, shown, tell

Place = Region | PointSet


class HasGeometry(Protocol):
    """An object with a GeoJSON interface, as shapely geometries, GeoSeries and GeoDataFrames."""

    @property
    def __geo_interface__(self) -> Mapping[str, Any]:
        """GeoJSON."""


RegionLike = str | Region | PointSet | Sequence[float] | FloatArray | HasGeometry | Mapping[str, Any]
"""Accepted forms of a region.

A text in this language, a region, bounds W, S, E, N in degrees; or polygons: a geometry of shapely or GeoJSON in
longitude and latitude, or a GeoSeries or GeoDataFrame in its CRS, with edges straight in that CRS.
"""

# Kinds that name a place, whose distant parts may not be meant; those of all land always are.
_COMPACT = {"box", "cap", "polygon", "country", "state", "file", "geodesic"}

FORMS = (
    "globe, land, ocean, box:W,S,E,N, cap:LON,LAT,KM, country:NAME, continent:NAME, area:NAME, state:NAME (or the "
    "NAME alone), polygon:LON,LAT,..., crs:CODE, file:PATH, geodesic:PATH or points:PATH, or a "
    "combination of these by &, - and +"
)

_LONGEST = 20_000  # characters: twenty times a list of all countries, and fast to parse in any form
_LONGEST_NAME = 300
# The longest paths of any system; the text of a CRS may be longer.
_LONGEST_BY_KIND = {"file": 4500, "geodesic": 4500, "points": 4500, "crs": _LONGEST, "polygon": _LONGEST}
_DEEPEST = 50  # nested brackets

_METHODS = ("panels", "chart", "clip", "bounds")  # of a region, perhaps of another package

_WORDS = ("globe", "land", "ocean")

_SUFFIX = re.compile(r"@(all|main)(?::([^@&()\s]*))?(?=[@&)\s]|$)", re.IGNORECASE)
# No names: texts with signs of a path, numbers (codes stand behind their kind) or only signs, halves of a combination.
_NO_NAME = re.compile(r"[:/\\]|^[\d\W]*$|^\s*[&+-]|[&+-]\s*$")
_PLACE = re.compile(r"(globe|land|ocean)$|(country|continent|area|state):[^&+-]+$", re.IGNORECASE)  # by name
_OPERATOR = re.compile(r"\s+([&+-])(?=\s|$)")


def get_region(region: RegionLike, ellipsoid: Ellipsoid | None = None) -> Place:
    """The region of a text, such as `globe`, `box:W,S,E,N`, `Switzerland`, `country:CH`, `land - continent:Antarctica`.

    A name alone stands for the country, continent or state of that name if there is just one; a code alone for a
    country before a state.

    Parameters
    ----------
    region : RegionLike
        A text in the language of `projdist.regions.language`. A region stands for itself, four numbers W, S, E, N in
        degrees for a box, GeoJSON (a dictionary, or anything with `__geo_interface__`, as shapely's geometries) for its
        polygons in longitude and latitude, a GeoSeries or GeoDataFrame for those that it has in its CRS.
    ellipsoid : Ellipsoid, optional
        That of the body it is on, on which distances and areas are measured; by default WGS 84's for the Earth. The
        functions that take maps and regions ask for that of the maps.

    Returns
    -------
    Region or PointSet
        With its name, bounds and area.

    Raises
    ------
    ValueError
        For an unknown place, with close matches, numbers out of their range, files that cannot be read, brackets
        and operators that do not fit, and places of the Earth on another body.

    References
    ----------
    Land and countries: Natural Earth, https://www.naturalearthdata.com
    States: US Census Bureau, Cartographic Boundary Files, 2017, https://www.census.gov/geographies/mapping-files.html
    Edges of polygons: RFC 7946, The GeoJSON Format, section 3.1.1.

    Examples
    --------
    An eighth of the ellipsoid WGS 84, which has 510,065,622 km2:

    >>> octant = get_region((0, 0, 90, 90))
    >>> octant.name, round(8 * octant.area_km2)
    ('box:0,0,90,90', 510065622)
    """
    body = None if ellipsoid is None else Body(ellipsoid)
    return placed(_region_of_any(region, body), body)


def placed(region: Place, body: Body | None) -> Place:
    """A region put on a body if one is given; raises ValueError if it is on another."""
    if body is None or not hasattr(region, "ellipsoid"):  # a region type of another package
        return region
    known = region.ellipsoid
    if known is not None and not is_same_body(Body(known), body):
        raise ValueError(f"Invalid region '{shown(region.name)}'. It is on {Body(known)}, not on {body}.")
    # Caps of the Earth depend on the ellipsoid; the area of other regions of the Earth is always on WGS 84.
    if known is not None or not (isinstance(region, Cap) or body.ellipsoid.is_of_another_body):
        return region
    found = cast(Place, dataclasses.replace(cast(Any, region), ellipsoid=body.ellipsoid))
    return _told_apart(dataclasses.replace(cast(Any, found), far="")) if region.far else found


def _region_of_any(region: RegionLike, body: Body | None) -> Place:
    if isinstance(region, str):
        return _Parser(region, body).parse()
    if isinstance(region, PointSet) or (not isinstance(region, type) and all(hasattr(region, one) for one in _METHODS)):
        return cast(Place, region)
    shape = getattr(region, "__geo_interface__", region)
    if isinstance(shape, Mapping):
        crs = getattr(region, "crs", None)
        found = regions.polygons_from_geojson(dict(shape), crs=crs)
        regions.tell_of_geojson_in_degrees(shape, crs, "Invalid region.")
        return found
    bounds = np.empty(0)
    if isinstance(region, list | tuple | np.ndarray):
        with contextlib.suppress(TypeError, ValueError):
            bounds = np.asarray(region, dtype=float)
    if bounds.shape != (4,):
        raise ValueError(f"Invalid region {quoted(region)}. It must be {FORMS}; or W,S,E,N, a geometry or a region.")
    return _likely_box(*bounds.tolist())


def region_of_text(text: str, check: Callable[[str, str], None], ellipsoid: Ellipsoid | None = None) -> Place:
    """The region of a text, as by `get_region`; `check` is called before with the kind and argument of each atom."""
    body = None if ellipsoid is None else Body(ellipsoid)
    return placed(_Parser(text, body, check).parse(), body)


def is_region_text(text: str) -> bool:
    """True if a text begins like a region rather than a path."""
    text = _with_blanks(text.strip())
    first = _with_kind(text[: _end_of_atom(text)])
    word = re.split("[:@ ]", first.lower(), maxsplit=1)[0]
    return text.startswith("(") or word in _WORDS or (word in _KINDS and ":" in first)


def weighted_points(text: str, column: str) -> PointSet:
    """The region `points:PATH` with the weights of a column of the file; raises ValueError."""
    kind, _, argument = text.strip().partition(":")
    if kind.lower() != "points":
        raise ValueError(f"Invalid weight '{column}'. It must be a raster, or, of points:PATH, the name of a column.")
    return regions.shapes.points_from_file(*_path(text, argument.strip()), text.strip(), column)


@dataclasses.dataclass
class _Parser:
    """Parser, by recursive descent, of sums of products of atoms and brackets."""

    text: str
    body: Body | None
    check: Callable[[str, str], None] | None = None
    rest: str = ""
    kinds: set[str] = dataclasses.field(default_factory=set)  # of atoms, and of suffixes
    combined: bool = False
    depth: int = 0

    def parse(self) -> Place:
        if len(self.text) > _LONGEST:
            raise ValueError(f"Invalid region '{shown(self.text)}'. It must have at most {_LONGEST} characters.")
        self.rest = _with_blanks(self.text.strip())
        found = self._combination()
        if self.rest:
            raise ValueError(f"Invalid region '{shown(self.text)}'. Its brackets must close what they open.")
        return _told_apart(found) if self.combined and self.kinds <= _COMPACT else found

    def _combination(self, operators: str = "+-") -> Place:
        """A sum of products of factors, or, for `&`, a product."""
        part = self._factor if operators == "&" else lambda: self._combination("&")
        before, name = self.rest, ""
        found = [part()]  # not yet added up, as a sum of many countries is fast in pairs
        while (operator := _OPERATOR.match(self.rest)) and operator[1] in operators:
            self.rest = self.rest[operator.end() :].lstrip()
            left, other = name, part()
            name = " ".join(before[: len(before) - len(self.rest)].split())
            if operator[1] == "+":
                found.append(other)
            else:
                found = [regions.combine(operator[1], _added(found, left), other, name)]
            self.combined = True
        return _added(found, name)

    def _factor(self) -> Place:
        if not self.rest.startswith("("):
            return self._atom()
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ValueError(f"Invalid region '{shown(self.text)}'. Its brackets must not lie {_DEEPEST} deep.")
        self.rest = self.rest[1:].lstrip()
        found = self._combination()
        self.depth -= 1
        self.rest = self.rest.lstrip()
        if not self.rest.startswith(")"):
            raise ValueError(f"Invalid region '{shown(self.text)}'. Its brackets must close what they open.")
        self.rest = self.rest[1:]
        after = self.rest.lstrip()
        suffix = _SUFFIX.match(after)
        if suffix is None:
            return found
        self.rest = after[suffix.end() :]
        return self._parts_of(found, suffix)

    def _atom(self) -> Place:
        end = _end_of_atom(self.rest)
        text, self.rest = self.rest[:end].strip(), self.rest[end:]
        if (not text and self.text.strip()) or re.match(r"[&+-]\s", text):
            raise ValueError(
                f"Invalid region '{shown(self.text)}'. There must be a region on each side of an operator."
            )
        suffix = _SUFFIX.search(text)
        plain = text if suffix is None else text[: suffix.start()].rstrip() + text[suffix.end() :]
        plain = _with_kind(plain)
        self.kinds.add(re.split("[:@]", plain.lower(), maxsplit=1)[0])
        kind, _, argument = plain.partition(":")
        kind, argument = kind.lower(), argument.strip().strip('"')
        if self.check is not None:
            self.check(kind, argument)
        found = placed(_region_of(plain, kind, argument, self.body and self.body.ellipsoid), self.body)
        return found if suffix is None else self._parts_of(found, suffix)

    def _parts_of(self, region: Place, suffix: re.Match[str]) -> Place:
        """All parts of a region, or the main one, by its suffix."""
        parts = regions.combinations
        self.kinds.add("@")
        which, km = suffix[1].lower(), suffix[2]
        if which == "all" and km is None:
            return parts.all_parts(region)
        if which == "main" and not isinstance(region, PointSet):
            try:
                distance = parts.MAIN_KM if km is None else float(km)
            except ValueError as error:
                raise ValueError(
                    f"Invalid distance '{km}' of a main part. It must be a number of kilometres."
                ) from error
            return parts.main_part(region, distance)
        raise ValueError(f"Invalid region '{shown(self.text)}'. Polygons may be followed by @main, @main:KM or @all.")


def _added(parts: Sequence[Place], name: str) -> Place:
    """Union of regions: of pairs, of pairs of these, and so on."""
    while len(parts) > 1:
        pairs = itertools.zip_longest(parts[::2], parts[1::2])
        parts = [one if other is None else regions.combine("+", one, other, name) for one, other in pairs]
    return parts[0]


def _told_apart(region: Place) -> Place:
    """The region, with a note on distant parts if it has some."""
    return regions.combinations.told_apart(region) if isinstance(region, regions.Polygons) else region


def _end_of_atom(text: str) -> int:
    """Index of the operator or unmatched closing bracket that ends an atom."""
    depth, quoted = 0, False
    for place, character in enumerate(text):
        if character == '"':
            quoted = not quoted
        elif not quoted:
            # Only the first of several blanks is tried, which keeps the time linear.
            begins = character.isspace() and not text[place - 1 : place].isspace()
            if begins and _OPERATOR.match(text, place):
                return place
            depth += {"(": 1, ")": -1}.get(character, 0)
            if depth < 0:
                return place
    return len(text)


def _with_blanks(text: str) -> str:
    """`DE + FR` for `DE+FR`; other texts, as of paths and of names with a hyphen, are unchanged."""
    pieces, name = re.split("([&+-])", text), text.partition(":")[2] or text
    places = [one for one in pieces[::2] if _PLACE.match(_with_kind(one))]
    return " ".join(pieces) if 2 * len(places) == len(pieces) + 1 > 2 and _with_kind(name) == name else text


def _unknown_in(text: str) -> str:
    """`XX` of `DE+XX`, the first part that is no place; the text itself if all or none are, or for a path."""
    pieces = [piece.strip() for piece in re.split("[&+-]", text)]
    unknown = [piece for piece in pieces if not _PLACE.match(_with_kind(piece))]
    is_path = not all(pieces) or any(re.search(r"[./\\]", piece) for piece in unknown)
    return unknown[0] if 0 < len(unknown) < len(pieces) and not is_path else text


def _with_kind(text: str) -> str:
    """`country:Germany` for `Germany`, if only one place has the name; other texts, as of paths, are unchanged."""
    name, at, resolution = text.partition("@")
    if _NO_NAME.search(name) or name.lower() in _WORDS or len(name) > _LONGEST_NAME:
        return text
    meant = regions.countries.meant_by(name.strip().strip('"'))
    return f"{meant}{at}{resolution}" if meant else text


def _region_of(text: str, kind: str, argument: str, ellipsoid: Ellipsoid | None) -> Place:
    longest = _LONGEST_BY_KIND.get(kind, _LONGEST_NAME)
    if len(text) > longest:
        raise ValueError(f"Invalid region '{shown(text)}'. A region of this kind has at most {longest} characters.")
    word, at, resolution = text.lower().partition("@")
    if word == "globe" and not at:
        return GLOBE
    if word in ("land", "ocean"):
        return _named(text, f"@{resolution}" if at else "", ellipsoid)
    if kind not in _KINDS:
        unknown = _unknown_in(text)
        hint = did_you_mean(regions.countries.close_regions(unknown.partition(":")[2] or unknown)) if text else ""
        place = f" in '{text}'" if unknown != text else ""
        raise ValueError(f"Invalid region '{unknown}'{place}. {hint}It must be {FORMS}.")
    return _KINDS[kind](text, argument, ellipsoid)


def _numbers(text: str, argument: str, form: str, count: int) -> list[float]:
    try:
        values = [float(value) for value in argument.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise ValueError(f"Invalid region '{text}'. It must be {form}, {count} numbers.")
    return values


def _likely_box(west: float, south: float, east: float, north: float) -> Box:
    """A box; warns if another order of its numbers is likelier."""
    box = Box(west, south, east, north)
    meant = likelier((west, south, east, north))
    if meant != (west, south, east, north):
        tell(
            f"Region '{box.name}' crosses the antimeridian and is {box.bounds[2] - west:g} degrees wide; did you mean "
            f"{Box(*meant).name}?"
        )
    return box


def _cap(text: str, argument: str, ellipsoid: Ellipsoid | None) -> Region:
    lon, lat, km = _numbers(text, argument, "cap:LON,LAT,KM", 3)
    return Cap(lon, lat, km, ellipsoid)


def _named(text: str, argument: str, ellipsoid: Ellipsoid | None) -> Region:
    """Land, ocean, a country, continent or state, with a resolution behind an @."""
    countries, kind = regions.countries, re.split("[:@]", text.lower(), maxsplit=1)[0]
    name, at, resolution = argument.partition("@")
    if kind == "state":
        return countries.state(name.strip(), resolution if at else countries.RESOLUTION)
    if at and resolution not in earth.RESOLUTIONS:
        allowed = ", @".join(earth.RESOLUTIONS)
        raise ValueError(f"Invalid suffix '@{resolution}'. It must be one of @{allowed}, @main and @all, once each.")
    resolution = resolution or countries.DEFAULT_RESOLUTION
    if kind in ("land", "ocean"):
        return countries.land(resolution) if kind == "land" else countries.ocean(resolution)
    if kind == "country":
        return countries.country(name.strip(), resolution)
    return countries.area(name.strip(), kind, resolution)


def _polygon(text: str, argument: str, _: Ellipsoid | None) -> Region:
    """A polygon by its vertices; edges are straight in longitude and latitude."""
    count = max(6, argument.count(",") + 1)
    numbers = _numbers(text, argument, "polygon:LON,LAT,LON,LAT,LON,LAT or more", count + count % 2)
    ring = list(zip(numbers[::2], numbers[1::2], strict=True))
    found = regions.polygons_from_geojson({"type": "Polygon", "coordinates": [[*ring, ring[0]]]}, shown(text))
    return dataclasses.replace(found, name=text)


def layer_path(text: str) -> tuple[Path, str]:
    """Path and layer ("" for the first) of PATH#LAYER; an existing path may contain a #."""
    path, mark, layer = text.rpartition("#")
    return (Path(path), layer) if mark and not os.path.exists(text) else (Path(text), "")


def _path(text: str, argument: str) -> tuple[Path, str]:
    """Path and layer of a region; raises ValueError without a path."""
    if not argument:
        raise ValueError(f"Invalid region '{text}'. It must have the path of a file after the colon.")
    return layer_path(argument)


# The regions of each kind, by their text, their argument, which is behind the colon, and the ellipsoid of the maps.
_KINDS: dict[str, Callable[[str, str, Ellipsoid | None], Place]] = {
    "box": lambda text, argument, _: _likely_box(*_numbers(text, argument, "box:W,S,E,N", 4)),
    "cap": _cap,
    "polygon": _polygon,
    "country": _named,
    "continent": _named,
    "area": _named,
    "state": _named,
    "crs": lambda text, argument, _: Box(*area_of_use(argument), ground_of(argument)),
    "file": lambda text, argument, _: regions.shapes.polygons_from_file(*_path(text, argument), text),
    "geodesic": lambda text, argument, figure: regions.shapes.polygons_from_file(
        *_path(text, argument), text, edges="geodesic", ellipsoid=figure
    ),
    "points": lambda text, argument, _: regions.shapes.points_from_file(*_path(text, argument), text),
}


# ---- regions that were not named -----------------------------------------------------------------


def region_for(region: RegionLike | None, projections: Iterable[Projection]) -> Place:
    """A region (None: the common area of use, else the globe) on the body of maps; ValueError if bodies differ."""
    maps = list(projections)
    body = Body(ground_of_maps(maps), next((one.body.name for one in maps if one.body.name), ""))
    if region is not None:
        return placed(_region_of_any(region, body), body)
    areas = {projection.area_of_use for projection in maps}
    area = areas.pop() if len(areas) == 1 else None
    return placed(GLOBE if area is None else Box(*area), body)


def check_on_body(projections: Iterable[Projection], body: Body) -> None:
    """Raise ProjectionError for maps of another body."""
    for projection in projections:
        if not is_same_body(projection.body, body):
            raise ProjectionError(
                f"Invalid map '{projection.label}'. It is of {projection.body}, and must be of {body}."
            )


def ground_of_maps(projections: Iterable[Projection]) -> Ellipsoid:
    """The ellipsoid for regions of maps; raises ProjectionError for maps of different bodies."""
    # For the Earth it is the mean sphere if all maps are of spheres, else WGS 84; for another body it is the ellipsoid
    # of the first map that is not of a sphere.
    maps = list(projections)
    for other in maps[1:]:
        if not is_same_body(maps[0].body, other.body):
            raise ProjectionError(
                f"Invalid maps '{maps[0].label}' and '{other.label}'. They are of {maps[0].body} and of {other.body}; "
                "maps that are compared must be of one body."
            )
    figures = [projection.ellipsoid.ground for projection in maps]
    return next((figure for figure in figures if not figure.is_sphere), figures[0] if figures else WGS84)


def share_in(box: Box, region: Region | PointSet) -> float:
    """Share of a region that lies in a box; for region types of other packages that of its bounds."""
    if isinstance(region, PointSet):
        return float(region.weight[box.contains(region.lon, region.lat)].sum() / region.weight.sum())
    if not isinstance(region, Box | Cap | regions.Polygons):
        region = Box.between(region.bounds, getattr(region, "ellipsoid", None))
    (west, south, east, north), (left, low, right, high) = region.bounds, box.bounds
    if low <= south and north <= high and min((west - left) % 360.0 + east - west, 360.0) <= right - left:
        return 1.0
    try:
        return regions.combine("&", region, box, region.name).area_km2 / region.area_km2
    except ValueError:  # nothing is left
        return 0.0


# ---- regions as titles ---------------------------------------------------------------------------

_LONGEST_TITLE = 70  # letters


_TITLES = (
    (
        re.compile(r"(country|state):([A-Z]{2})(@\d+m)?(?![\w])"),
        lambda match: f"{regions.countries.rows_of(match[1])[match[2].lower()]['name']} ({match[2]})",
    ),
    (re.compile(r"(?:country|continent|area|state):([\w .'-]+?)(@\d+m)?(?=$|[)@]| [&+-] )"), lambda match: match[1]),
    (re.compile(r"(?:file|geodesic|points):(?:[^\s&()]*[/\\])?([^\s/\\&()]+)"), lambda match: match[1]),
    (re.compile(r"@main(:[\d.]+)?"), lambda match: ", main part"),
    (re.compile(r"@all"), lambda match: ""),
)


def region_title(region: Place) -> str:
    """Title of a region: Germany (DE); 6°E to 12°E, 47°N to 55°N; 50 km around 48.85°N, 2.35°E."""
    if isinstance(region, Box) and not region.is_globe:
        west, south, east, north = region.bounds
        lon, lat = (longitude_text(west), longitude_text(east)), (latitude_text(south), latitude_text(north))
        across = f"{lon[0]} to {lon[1]}, " if east - west < 360.0 else ""
        return f"{across}{lat[0]} to {lat[1]}"
    if isinstance(region, Cap):
        return f"{region.radius_km:.6g} km around {latitude_text(region.lat)}, {longitude_text(region.lon)}"
    text = region.name
    for pattern, word in _TITLES:
        text = pattern.sub(word, text)
    return text if len(text) <= _LONGEST_TITLE else f"{text[: _LONGEST_TITLE - 1]}…"
