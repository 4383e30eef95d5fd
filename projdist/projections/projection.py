"""The `Projection` type, the body that it maps, and the parsing of anything that names a map."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

import numpy as np
import pyproj.list
from pyproj import CRS, Proj
from pyproj.database import query_crs_info
from pyproj.enums import PJType

from projdist._typing import ArrayLike, FloatArray
from projdist.earth import SPHERE, Ellipsoid, wrapped
from projdist.projections import catalogue, crs_search, operations, proj_strings
from projdist.projections.closed_forms import ClosedForm, closed_form
from projdist.projections.crs import form_of, grid_mapping_in, parse_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.operations import CrsOperation, Function, Parts, Pipeline
from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import close_words, did_you_mean, listed, shown

# ---- names with parameters and a centre, as robinson+lon_0=150 -----------------------------------

_BEHIND = re.compile(r"\+\s*[A-Za-z]\w*\s*(?==|\+|@|$)|@")  # start of a parameter or point
_CHOICES = 3  # CRSs that a message lists if a text may mean several
_NAME = re.compile(r"[^\s:/+@=][^:+@=]*")  # codes and names of CRSs have other characters
_DEGREES = re.compile(r"lon_0=[+-]?\d+\.?\d*")
_HEMISPHERES = {"N": (1.0, "lat"), "S": (-1.0, "lat"), "E": (1.0, "lon"), "W": (-1.0, "lon")}
_POLE = "lat_0=90"  # of maps centred on a pole
_NEAR = 1e-3  # degrees from a centre, to find the direction of north
_ALMOST = 1e-3  # relative to that step: rounding is 1e-10, tilted meridians far more

WITH_LATITUDE = catalogue.KEYWORDS["with latitude"]
"""Operations with a lat_0 of their own that centres a point."""


@dataclass(frozen=True)
class NamedMap:
    """A name, the PROJ parameters added to it, as `lon_0=150`, and the latitude and longitude of its centre."""

    name: str
    parameters: tuple[str, ...] = ()
    centre: tuple[float, float] | None = None

    def __str__(self) -> str:
        """The name with its parameters and centre, as users write it."""
        point = "" if self.centre is None else "@" + ",".join(map(proj_strings.number_text, self.centre))
        return "".join([self.name, *(f"+{token}" for token in self.parameters), point])

    @property
    def stated(self) -> dict[str, str]:
        """Values of the parameters, as text."""
        return proj_strings.stated_in(self.parameters)

    def number(self, key: str) -> float:
        """Value of a parameter, 0 if it is missing."""
        return float(self.stated.get(key) or 0.0)

    @property
    def title(self) -> str:
        """Title for print, with the parameters and the centre."""
        title = catalogue.TITLES.get(self.name) or catalogue.operation_titles()[self.name]
        added = f" ({', '.join(self.parameters)})" if self.parameters else ""
        if self.centre is not None:
            return f"{title}, {_degrees(self.centre[0], 'NS')}, {_degrees(self.centre[1], 'EW')}{added}"
        if len(self.parameters) == 1 and _DEGREES.fullmatch(self.parameters[0]):
            return f"{title}, {_degrees(self.number('lon_0'), 'EW')}"
        return title + added

    @property
    def tokens(self) -> list[str]:
        """Tokens of its PROJ string, unchecked."""
        operation, fixed = operation_of(self.name)
        tokens = [f"proj={operation}", *(token for token in fixed if token.partition("=")[0] not in self.stated)]
        tokens += self.parameters
        if not proj_strings.ELLIPSOID_KEYS & self.stated.keys():
            figure = operations.operation_ellipsoid(operation, SPHERE)
            tokens += operations.ellipsoid_parameters(figure).replace("+", "").split()
        if self.centre is None:
            return tokens
        return turned_tokens([token for token in tokens if token != _POLE], *self.centre)


@dataclass(frozen=True)
class Turned:
    """A map of the sphere rotated so that a point is at its centre with north up; picklable."""

    function: Function
    lat: float
    lon: float

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        if self.lat == 0.0:
            return self.function(wrapped(lon - self.lon), lat)
        lam, phi, tilt = np.radians(lon - self.lon), np.radians(lat), np.radians(self.lat)
        ahead = np.cos(tilt) * np.cos(phi) * np.cos(lam) + np.sin(tilt) * np.sin(phi)
        right = np.cos(phi) * np.sin(lam)
        up = np.cos(tilt) * np.sin(phi) - np.sin(tilt) * np.cos(phi) * np.cos(lam)
        return self.function(np.degrees(np.arctan2(right, ahead)), np.degrees(np.arctan2(up, np.hypot(right, ahead))))


def _degrees(value: float, letters: str) -> str:
    return f"{abs(value):.6g}°" + (f" {letters[int(value < 0)]}" if value else "")


def named_map(text: str) -> NamedMap:
    """Name, parameters and centre of a text; if it has another form all of it is the name. Raises ProjectionError."""
    starts = [match.start() for match in _BEHIND.finditer(text)]
    if not starts or not _NAME.fullmatch(text[: starts[0]]):
        return NamedMap(text)
    pieces = [text[start:stop].strip() for start, stop in zip(starts, [*starts[1:], len(text)], strict=True)]
    points = [piece for piece in pieces if piece.startswith("@")]
    added = tuple(re.sub(r"\s*=\s*", "=", piece[1:].strip()) for piece in pieces if piece.startswith("+"))
    keys = [token.partition("=")[0] for token in added]
    twice = [key for key, count in Counter(keys).items() if count > 1] or points[1:]
    if twice:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It must have '{shown(twice[0])}' once.")
    stated = [key for key in keys if key in ("lat_0", "lon_0")]
    if points and stated:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Its centre is stated by '{shown(points[0])}': it must have no "
            f"{' and no '.join(stated)}."
        )
    return NamedMap(text[: starts[0]].strip(), added, _centre(points[0], text) if points else None)


def _centre(point: str, text: str) -> tuple[float, float]:
    """Latitude and longitude of `@45,-100`; with hemisphere letters their order is free."""
    complaint = f"Invalid point '{shown(point)}' in '{shown(text)}'."
    match = re.fullmatch(r"@\s*([+-]?[\d.]+)\s*°?\s*([NSEW]?)\s*[,\s]\s*([+-]?[\d.]+)\s*°?\s*([NSEW]?)", point, re.I)
    found: dict[str, float] = {}
    if match and bool(match[2]) == bool(match[4]):
        for axis, number, letter in (("lat", match[1], match[2].upper()), ("lon", match[3], match[4].upper())):
            sign, axis = _HEMISPHERES.get(letter, (1.0, axis))
            with contextlib.suppress(ValueError):
                found[axis] = sign * float(number)
    if len(found) < 2:
        raise ProjectionError(
            f"{complaint} It must be a latitude and a longitude in degrees, such as @45,-100 or @45N,100W."
        )
    lat, lon = found["lat"], found["lon"]
    if not (abs(lat) <= 90.0 and abs(lon) <= 360.0):
        swapped = f" Did you mean @{lon:g},{lat:g}?" if abs(lon) <= 90.0 < abs(lat) <= 360.0 else ""
        raise ProjectionError(f"{complaint} The latitude, which stands first, must be -90 to 90.{swapped}")
    return lat, float(wrapped(lon))


def turned_tokens(tokens: Sequence[str], lat: float, lon: float) -> list[str]:
    """Tokens of a PROJ string, operation first, after moving a point to the centre with north up."""
    operation, rest = tokens[0].removeprefix("proj="), list(tokens[1:])
    longitude = f"lon_0={proj_strings.number_text(lon)}"
    if operation in WITH_LATITUDE:
        return [f"proj={operation}", f"lat_0={proj_strings.number_text(lat)}", longitude, *rest]
    if lat == 0.0:
        return [f"proj={operation}", longitude, *rest]
    # The pole is on the rotated central meridian, as far from the rotated equator as the point is from the pole.
    pole = f"o_lat_p={proj_strings.number_text(90.0 - lat)}"
    return ["proj=ob_tran", f"o_proj={operation}", pole, "o_lon_p=0", longitude, *rest]


def projection_names() -> dict[str, str]:
    """Every bare name of a projection, and the PROJ string that it stands for.

    Returns
    -------
    dict of str to str
        The PROJ strings by name: an example where the projection has `needed_parameters`. The names of `WORLD_MAPS`,
        which PROJ has no string for, stand for themselves.

    Raises
    ------
    Nothing: there is no input.

    References
    ----------
    PROJ's documentation, Projections, https://proj.org/operations/projections/.

    Examples
    --------
    >>> projection_names()["robinson"]
    '+proj=robin +R=6371008.7714'
    """
    left_out = {*catalogue.NOT_MAPS, *catalogue.NOT_IN_METRES}
    ids = (name for name in pyproj.list.get_proj_operations_map() if name not in left_out)
    return {name: name if name in WORLD_MAPS else _textbook(name) for name in [*catalogue.NAMES, *WORLD_MAPS, *ids]}


def needed_parameters(name: str) -> list[str]:
    """PROJ parameters that a name requires; empty for most names."""
    return [*proj_strings.stated_in(catalogue.NEEDED_PARAMETERS.get(name, "").split())]


def parse_name(text: str) -> Parts:
    """The textbook map of a name, with parameters and centre, or the CRS of that name; raises ProjectionError."""
    words = named_map(text)
    name, complaint = known_name(words.name), f"Invalid projection '{shown(text)}'."
    if not name:
        if code := catalogue.code_of_number(text):
            return parse_crs(code)
        close = catalogue.close_codes(text) or catalogue.close_names(words.name)
        utm = re.fullmatch(r"utm[\s_-]*(?:zone[\s_-]*)?(0?[1-9]|[1-5]\d|60)[\s_-]*([ns]?)", text, re.IGNORECASE)
        if utm:
            return parse_crs(f"EPSG:32{7 if utm[2].lower() == 's' else 6}{int(utm[1]):02}")
        meant: list[crs_search.CrsHit] = []
        if words.name == text:  # without parameters, it may be the name of a CRS
            names, key = catalogue.crs_names(), catalogue.folded(text)
            if (not close or "/" in text) and key in names:
                return parse_crs(names[key][0])
            # Names of CRSs contain one of these, or are too short to tell from other words.
            if not close and ("/" in text or "_" in text):
                close = [names[name][1] for name in close_words(key, names)][: catalogue.MOST_HINTS]
            meant, is_one = crs_search.meanings(text)
            if is_one and not close:
                return parse_crs(meant[0].code)
        choices = [] if meant and not close else [ALLOWED]
        choices += [_list_of_meanings(text, meant)] if meant else []
        raise ProjectionError(f"{complaint} {did_you_mean(close)}{' '.join(choices)}")
    if name in catalogue.NOT_MAPS:
        raise ProjectionError(f"{complaint} PROJ's {catalogue.operation_titles()[name]} is not a map projection.")
    if name in catalogue.NOT_IN_METRES:
        raise ProjectionError(f"{complaint} PROJ's {name} gives {catalogue.NOT_IN_METRES[name]}, not metres.")
    words = replace(words, name=name)
    parts = _world_map(words) if name in WORLD_MAPS else proj_strings.parse_proj_string(_named_string(words, text))
    if words.centre is not None:
        origin = words.number("x_0"), words.number("y_0")
        if not has_centre(parts.function, *words.centre, origin):
            given = parts.definition if name in WORLD_MAPS else text
            raise ProjectionError(
                f"Invalid projection '{shown(given)}'. It has no centre for a point with north up there: move it by "
                "+lon_0=..., or write a PROJ string."
            )
    return parts._replace(name=words.title)


def _list_of_meanings(text: str, hits: Sequence[crs_search.CrsHit]) -> str:
    """The sentence that lists the CRSs that a text may mean."""
    most = _CHOICES if len(hits) > _CHOICES + 1 else len(hits)
    choices = [f"{hit.code} ({hit.name})" for hit in hits[:most]]
    more = [f"one of {len(hits) - most} more (see 'projdist find')"] if len(hits) > most else []
    return f"'{shown(text)}' may be {listed([*choices, *more], 'or')}."


def known_name(text: str) -> str:
    """The catalogue's spelling of a name or PROJ id; "" if unknown."""
    ids = pyproj.list.get_proj_operations_map()
    known = text if text in ids else catalogue.normalised(text)
    return known if known in catalogue.NAMES or known in ids or known in WORLD_MAPS else ""


def _world_map(words: NamedMap) -> Parts:
    """A map that PROJ lacks, centred on a meridian or point."""
    others = [token for token in words.parameters if not _DEGREES.fullmatch(token)]
    if others:
        raise ProjectionError(
            f"Invalid parameter '+{shown(others[0])}' of '{words.name}'. It must be lon_0 in degrees: PROJ has no such "
            "map."
        )
    lat, lon = words.centre or (0.0, words.number("lon_0"))
    function: Function = WORLD_MAPS[words.name]
    if words.parameters:
        words = replace(words, parameters=(f"lon_0={proj_strings.number_text(lon)}",))
    if words.parameters or words.centre is not None:
        function = Turned(function, lat, lon)
    return Parts(words.title, str(words), SPHERE, function)


def operation_of(name: str) -> tuple[str, list[str]]:
    """PROJ operation of a name, and the tokens of its fixed parameters."""
    operation, *own = (catalogue.NAMES.get(name) or catalogue.TEXTBOOK_PARAMETERS.get(name, name)).split()
    return operation, [token.lstrip("+") for token in own]


def _named_string(words: NamedMap, text: str) -> str:
    """The PROJ string of a named map; raises ProjectionError for parameters that are missing or do not fit."""
    complaint, name, stated = f"Invalid projection '{shown(text)}'.", words.name, words.stated
    needed = [key for key in needed_parameters(name) if key not in stated]
    if needed:
        sphere = "has no form on the sphere and " if "ellps" in needed else ""
        raise ProjectionError(
            f"{complaint} It {sphere}needs {listed(needed, 'and')}: give a PROJ string, such as '{_textbook(name)}', "
            f"or '{name}{catalogue.NEEDED_PARAMETERS[name].replace(' ', '')}'."
        )
    operation, fixed = operation_of(name)
    own = proj_strings.stated_in(fixed)
    clash = next((key for key in stated if key in own), None)
    if clash and name in catalogue.NAMES:
        raise ProjectionError(
            f"{complaint} A {name} map is {operation} with {listed(fixed, 'and')}: for others write "
            f"'{operation}+{clash}=...'."
        )
    if words.parameters or words.centre is not None:
        proj_strings.check_read(replace(words, centre=None).tokens, words.parameters, text)
    if words.centre is not None and _POLE in fixed and words.centre[0] != 90.0:
        lat, lon = words.centre
        raise ProjectionError(f"{complaint} Its centre is a pole: write '{operation}@{lat:g},{lon:g}'.")
    tokens = words.tokens
    turned = tokens[0] == "proj=ob_tran" and words.centre is not None
    if turned and not proj_strings.ellipsoid_of(tokens).is_sphere:
        raise ProjectionError(f"{complaint} Only maps of a sphere can be turned: it must have no ellipsoid.")
    return " ".join(f"+{token}" for token in tokens)


def has_centre(function: Function, lat: float, lon: float, origin: tuple[float, float]) -> bool:
    """True if a map has a point at `origin` (metres) with north up there, as icosahedra and Werner's map have not."""
    step = _NEAR if lat < 89.0 else -_NEAR
    x, y = function(np.array([lon, lon]), np.array([lat, lat + step]))
    x, y = x - origin[0], y - origin[1]
    slack = _ALMOST * abs(float(y[1]))
    return bool(max(abs(x[0]), abs(x[1]), abs(y[0])) <= slack < np.inf and np.sign(y[1]) == np.sign(step))


def _textbook(name: str) -> str:
    """The PROJ string of a bare name, with example parameters where it needs some."""
    needed = tuple(token.lstrip("+") for token in catalogue.NEEDED_PARAMETERS.get(name, "").split())
    return " ".join(f"+{token}" for token in NamedMap(name, needed).tokens)


# ---- bodies --------------------------------------------------------------------------------------

_NAMED = re.compile(r'(?:ELLIPSOID|SPHEROID|DATUM|BASEGEOGCRS|BASEGEODCRS|GEOGCRS|GEODCRS|GEOGCS)\["([^"]*)"')
# Ellipsoids used for one body differ by up to 3.4 % (Saturn: equatorial and mean radius); the Moon and Io by 4.8 %.
# Bodies of more similar size are distinguished by name, if they have one.
_SAME_SIZE = 0.04


class Body(NamedTuple):
    """A celestial body: its ellipsoid, and its name ("" if unknown)."""

    ellipsoid: Ellipsoid
    name: str = ""

    def __str__(self) -> str:
        """The body in words: the Earth, Mars, a body of radius 1737.4 km."""
        if not self.ellipsoid.is_of_another_body:
            return "the Earth"
        article = "the " if self.name in ("Moon", "Sun") else ""
        return f"{article}{self.name}" if self.name else f"a body of radius {self.ellipsoid.a / 1000.0:.7g} km"


@functools.cache
def _body_names() -> tuple[str, ...]:
    """Names of the bodies of the International Astronomical Union's CRSs in PROJ's database, longest first."""
    found = query_crs_info(auth_name="IAU_2015", pj_types=[PJType.GEOGRAPHIC_2D_CRS, PJType.GEODETIC_CRS])
    names = {info.name.partition(" (")[0] for info in found} - {"Earth"}
    return tuple(sorted(names, key=lambda name: (-len(name), name)))


@functools.cache
def body_in(wkt: str) -> str:
    """The body in the name of a CRS's datum, ellipsoid or base, such as "Mars_2000_IAU_IAG"; "" if there is none."""
    words = " ".join(_NAMED.findall(wkt)).replace("_", " ")
    whole = (name for name in _body_names() if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", words, re.IGNORECASE))
    return next(whole, "")


def is_same_body(one: Body, other: Body) -> bool:
    """True if two bodies are the same, by name, or by size if a name is unknown."""
    foreign = [body.ellipsoid.is_of_another_body for body in (one, other)]
    if not all(foreign):
        return not any(foreign)
    if one.name and other.name:
        return one.name == other.name
    return abs(one.ellipsoid.a - other.ellipsoid.a) < _SAME_SIZE * max(one.ellipsoid.a, other.ellipsoid.a)


# ---- anything that names a map -------------------------------------------------------------------


def parse(value: Any) -> Parts:
    """The projection of a name, PROJ string, CRS code, WKT, PROJJSON, file or pyproj CRS; raises ProjectionError."""
    if isinstance(value, str):
        text = value.strip()
        is_path = text.lower().endswith((".prj", ".wkt", ".json")) and not re.search(r"[\[{]|proj=", text)
        return _parse_file(Path(text)) if is_path else _parse_text(text)
    if isinstance(value, os.PathLike):
        return _parse_file(Path(value))
    if isinstance(value, Mapping) and "proj" in value:
        return proj_strings.parse_proj_string(proj_strings.string_of_parameters(value))
    if isinstance(value, Proj):
        value = value.crs
    if isinstance(value, CRS) and form_of(value.srs) == "proj":
        stated = proj_strings.stated_in(value.srs.split()).keys() & proj_strings.ELLIPSOID_KEYS
        # The default ellipsoid of a CRS is that of WGS 84, and of a string GRS 80.
        default = "" if stated or value.ellipsoid is None else " +ellps=WGS84"
        return proj_strings.parse_proj_string(value.srs + default)
    return parse_crs(value)


def listed_projections(value: Any) -> list[Any]:
    """The unparsed projections of an iterable; a single one, also ("EPSG", 3035), as a list of one."""
    pair = isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], int)
    one = isinstance(value, str | bytes | os.PathLike | Mapping | CRS | Proj) or callable(value) or pair
    return [value] if one or not isinstance(value, Iterable) else list(value)


def _parse_text(text: str) -> Parts:
    """The projection of text that is not a path."""
    if "\0" in text:  # where PROJ would stop reading
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It has a null character.")
    init = re.fullmatch(r"\+?init=(\w+:\w+)(?:\s+\+no_defs|\s+\+type=crs)*", text)
    if init:
        return parse_crs(init[1].upper())
    form = form_of(text)
    if form == "json":
        try:
            value = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise ProjectionError(f"Invalid projection '{shown(text)}'. It is not JSON: {error}. {ALLOWED}") from error
        return parse(value) if "proj" in value or grid_mapping_in(value) else parse_crs(text)
    if form == "wkt":
        return parse_crs(text)
    if form == "proj":
        return proj_strings.parse_proj_string(" ".join(text.split()))
    if ":" not in text:
        return parse_name(text)
    if re.fullmatch(r"\w+:\w+\s*(?:\+\s*[A-Za-z]\w*\s*(?:[=+@].*)?|@.*,.*)", text):
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Parameters and centres are for names, as robinson+lon_0=150 and "
            "mollweide@45,-100; a CRS has its own."
        )
    return parse_crs(text)


def _parse_file(path: Path) -> Parts:
    name = " ".join(str(path).split())
    complaint = f"Invalid projection file '{name if len(name) <= _LONGEST_PATH else f'.../{shown(path.name)}'}'."
    try:
        text = path.read_text(encoding="utf-8-sig").strip()
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for a null character in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise ProjectionError(f"{complaint} It cannot be read as text: {reason}.") from error
    if not text:
        raise ProjectionError(f"{complaint} It must hold WKT, PROJJSON or a PROJ string.")
    try:
        return _parse_text(text)
    except ProjectionError as error:
        raise ProjectionError(f"{complaint} {error}") from error


# ---- the type ------------------------------------------------------------------------------------

_FARTHEST = 1e10  # radii, the reach of the gnomonic map; PROJ returns larger numbers outside of some maps
_LONGEST_LABEL, _LONGEST_PATH = 60, 300  # characters


@dataclass(frozen=True)
class Projection:
    """A map from longitude and latitude to the plane, and the ellipsoid that it maps.

    Call it with degrees: `x, y = projection(lon, lat)`, in metres, NaN where the map is not defined. Make one with
    `Projection.from_user_input`, which takes anything that names a projection, or `Projection.from_function`.
    """

    name: str
    definition: str
    ellipsoid: Ellipsoid
    function: Function = field(repr=False)
    area_of_use: tuple[float, float, float, float] | None = None

    @property
    def label(self) -> str:
        """The definition, or the name if the definition is as long as WKT."""
        return self.definition if len(self.definition) <= _LONGEST_LABEL else self.name

    @property
    def is_of_another_body(self) -> bool:
        """True if the ellipsoid has the size of another planet or of a moon."""
        return self.ellipsoid.is_of_another_body

    @property
    def body(self) -> Body:
        """The mapped body, named as in the CRS."""
        is_named = self.ellipsoid.is_of_another_body and isinstance(self.function, CrsOperation)
        return Body(self.ellipsoid, body_in(cast(CrsOperation, self.function).crs) if is_named else "")

    @property
    def answers_everywhere(self) -> bool:
        """True if any place can be evaluated without an error; functions and pipelines with grids may fail."""
        operation = self.function
        return isinstance(operation, CrsOperation) or (isinstance(operation, Pipeline) and not operation.reads_grids)

    @property
    def closed_form(self) -> ClosedForm | None:
        """The formulas of its derivatives; None if there are none whose coordinates are the map's."""
        return closed_form(self.function, self.ellipsoid)

    def __call__(self, lon: ArrayLike, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Coordinates x, y in metres of points in degrees; the shape is that of lon and lat broadcast."""
        lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        returned = self.function(lon, lat)
        try:
            x, y = (np.asarray(value, dtype=float) for value in returned)
        except (TypeError, ValueError) as error:
            raise ProjectionError(
                f"Invalid projection function '{self.name}'. It must return x and y, two arrays."
            ) from error
        if x.shape != lon.shape or y.shape != lon.shape:
            raise ProjectionError(
                f"Invalid projection function '{self.name}'. It must return x and y of the shape {lon.shape} of its "
                f"arguments, not {x.shape} and {y.shape}."
            )
        farthest = _FARTHEST * self.ellipsoid.a
        # Without temporary arrays; NaN if any value is.
        if x.size and max(float(x.max()), -float(x.min())) + max(float(y.max()), -float(y.min())) < farthest:
            return x, y
        undefined = ~(np.abs(x) + np.abs(y) < farthest)
        return np.where(undefined, np.nan, x), np.where(undefined, np.nan, y)

    @classmethod
    def from_user_input(cls, value: ProjectionLike) -> Projection:
        """A projection from a name, PROJ string, CRS code, WKT, PROJJSON, file, pyproj CRS or function.

        A bare name is the textbook map on the sphere of the Earth's mean radius. Raises
        ProjectionError, in one line, for what is none of these or has no plane.
        """
        if isinstance(value, Projection):
            return value
        if callable(value) and not isinstance(value, Proj):  # pyproj's own can be called, too
            return cls.from_function(value)
        return cls(*parse(value))

    @classmethod
    def from_function(
        cls, function: Callable[..., tuple[Any, Any]], *, name: str | None = None, ellipsoid: Ellipsoid = SPHERE
    ) -> Projection:
        """A projection from a function of arrays (lon, lat) in degrees that returns (x, y) in metres."""
        if not callable(function):
            raise ProjectionError(f"Invalid projection function '{function}'. It must be callable with (lon, lat).")
        label = str(name or getattr(function, "__name__", type(function).__name__))
        return cls(label, label, ellipsoid, cast(Function, function))


class HasWkt(Protocol):
    """An object with WKT, as rasterio's CRS."""

    def to_wkt(self) -> str:
        """Well-known text."""


_MapObject = Projection | CRS | Proj | HasWkt | Callable[..., tuple[Any, Any]]
ProjectionLike = str | os.PathLike[str] | int | tuple[str, int | str] | Mapping[str, Any] | _MapObject
"""Accepted forms of a projection.

Text (a name, a PROJ string or pipeline, a code such as EPSG:3035, the name of a CRS, WKT, PROJJSON, a path), the path
of a .prj or .wkt file, pyproj's CRS or Proj or an object with WKT, a function of (lon, lat) in degrees, a dictionary
of PROJ parameters or PROJJSON, an authority and a code, an EPSG number, or a `Projection`.
"""
