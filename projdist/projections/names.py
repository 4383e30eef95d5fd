"""Bare names of projections, and names with parameters, as `robinson+lon_0=150`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyproj.list

from projdist._typing import FloatArray
from projdist.earth import SPHERE, wrapped
from projdist.projections.catalogue import (
    NAMES,
    NEEDED_PARAMETERS,
    NOT_IN_METRES,
    NOT_MAPS,
    TEXTBOOK_PARAMETERS,
    TITLES,
    close_codes,
    close_crs_names,
    close_names,
    crs_code,
    normalised,
    operation_titles,
)
from projdist.projections.crs import parse_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.operations import Function, Parts, ellipsoid_parameters, operation_ellipsoid
from projdist.projections.proj_parameters import ELLIPSOID_KEYS, check_read, number_text
from projdist.projections.projstrings import ellipsoid_of, parse_proj_string
from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import did_you_mean, listed, shown

_BEHIND = re.compile(r"\+\s*[A-Za-z]\w*\s*(?==|\+|@|$)|@")  # start of a parameter or point
_NAME = re.compile(r"[^\s:/+@=][^:+@=]*")  # codes and names of CRSs have other characters
_HEMISPHERES = {"N": (1.0, "lat"), "S": (-1.0, "lat"), "E": (1.0, "lon"), "W": (-1.0, "lon")}
_POINT = "It must be a latitude and a longitude in degrees, as @45,-100 or @45N,100W."

# Operations with a lat_0 of their own that centres a point: azimuthal maps, transverse cylinders, regional maps, cones.
WITH_LATITUDE = frozenset(
    """aeqd airy gnom laea nsper tpers ortho stere sterea rouss cass tmerc etmerc gstmerc tcea somerc col_urban lcca
    leac aea eqdc euler lcc murd1 murd2 murd3 pconic tissot vitk1""".split()
)


@dataclass(frozen=True)
class Words:
    """A name, the PROJ parameters added to it, as `lon_0=150`, and the latitude and longitude of its centre."""

    name: str
    parameters: tuple[str, ...]
    centre: tuple[float, float] | None

    @property
    def keys(self) -> list[str]:
        """The names of the parameters."""
        return [token.partition("=")[0] for token in self.parameters]

    def number(self, key: str) -> float:
        """Value of a parameter, 0 if it is missing."""
        return next((float(token[len(key) + 1 :]) for token in self.parameters if token.startswith(f"{key}=")), 0.0)


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


def has_words(text: str) -> bool:
    """True if a text is a name followed by parameters or a point."""
    start = _BEHIND.search(text)
    return start is not None and _NAME.fullmatch(text[: start.start()]) is not None


def words_of(text: str) -> Words:
    """Name, parameters and centre of a text; raises ProjectionError."""
    starts = [match.start() for match in _BEHIND.finditer(text)]
    pieces = [text[start:stop].strip() for start, stop in zip(starts, [*starts[1:], len(text)], strict=True)]
    points = [piece for piece in pieces if piece.startswith("@")]
    added = tuple(re.sub(r"\s*=\s*", "=", piece[1:].strip()) for piece in pieces if piece.startswith("+"))
    found = Words(text[: starts[0]].strip() if starts else text, added, None)
    twice = [key for key, count in Counter(found.keys).items() if count > 1] or points[1:]
    if twice:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It must have '{shown(twice[0])}' once.")
    if not points:
        return found
    stated = [key for key in found.keys if key in ("lat_0", "lon_0")]
    if stated:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Its centre is stated by '{shown(points[0])}': it must have no "
            f"{' and no '.join(stated)}."
        )
    return Words(found.name, added, _centre(points[0], text))


def _centre(point: str, text: str) -> tuple[float, float]:
    """Latitude and longitude of `@45,-100`; in any order with letters of hemispheres."""
    complaint = f"Invalid point '{shown(point)}' in '{shown(text)}'."
    match = re.fullmatch(r"@\s*([+-]?[\d.]+)\s*°?\s*([NSEW]?)\s*[,\s]\s*([+-]?[\d.]+)\s*°?\s*([NSEW]?)", point, re.I)
    if not match or bool(match[2]) != bool(match[4]):
        raise ProjectionError(f"{complaint} {_POINT}")
    found: dict[str, float] = {}
    for axis, number, letter in (("lat", match[1], match[2].upper()), ("lon", match[3], match[4].upper())):
        sign, axis = _HEMISPHERES.get(letter, (1.0, axis))
        try:
            found[axis] = sign * float(number)
        except ValueError as error:
            raise ProjectionError(f"{complaint} {_POINT}") from error
    if len(found) < 2:
        raise ProjectionError(f"{complaint} {_POINT}")
    lat, lon = found["lat"], found["lon"]
    if not (abs(lat) <= 90.0 and abs(lon) <= 360.0):
        swapped = f" Did you mean @{lon:g},{lat:g}?" if abs(lon) <= 90.0 < abs(lat) <= 360.0 else ""
        raise ProjectionError(f"{complaint} The latitude, which stands first, must be -90 to 90.{swapped}")
    return lat, float(wrapped(lon))


def turned_tokens(tokens: Sequence[str], lat: float, lon: float) -> list[str]:
    """Tokens of a PROJ string, operation first, moved so that a point is at the centre with north up."""
    operation, rest = tokens[0].removeprefix("proj="), list(tokens[1:])
    longitude = f"lon_0={number_text(lon)}"
    if operation in WITH_LATITUDE:
        return [f"proj={operation}", f"lat_0={number_text(lat)}", longitude, *rest]
    if lat == 0.0:
        return [f"proj={operation}", longitude, *rest]
    # The pole is on the rotated central meridian, as far from the rotated equator as the point is from the pole.
    pole = f"o_lat_p={number_text(90.0 - lat)}"
    return ["proj=ob_tran", f"o_proj={operation}", pole, "o_lon_p=0", longitude, *rest]


# ---- names of maps -------------------------------------------------------------------------------


_NEAR = 1e-3  # degrees from a centre, to find the direction of north
_POLE = "lat_0=90"  # of maps centred on a pole
_ALMOST = 1e-3  # relative to that step: rounding is 1e-10, tilted meridians far more


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
    ids = (name for name in pyproj.list.get_proj_operations_map() if name not in {*NOT_MAPS, *NOT_IN_METRES})
    return {name: name if name in WORLD_MAPS else _textbook(name) for name in [*NAMES, *WORLD_MAPS, *ids]}


def needed_parameters(name: str) -> list[str]:
    """PROJ parameters that a name requires; empty for most names."""
    return [token.lstrip("+").partition("=")[0] for token in NEEDED_PARAMETERS.get(name, "").split()]


def parse_name(text: str) -> Parts:
    """The textbook map of a name in any spelling, with parameters and centre, or the CRS of that name.

    Raises ProjectionError.
    """
    if has_words(text):
        return _named(words_of(text), text)
    if not known_name(text):
        close = close_codes(text) or close_names(text)
        code = _utm_code(text) or ("" if close and "/" not in text else crs_code(text))
        if code:
            return parse_crs(code)
        # Names of CRSs contain one of these, or are too short to tell from other words.
        hint = did_you_mean(close or (close_crs_names(text) if "/" in text or "_" in text else []))
        raise ProjectionError(f"Invalid projection '{shown(text)}'. {hint}{ALLOWED}")
    return _named(Words(text, (), None), text)


def _named(words: Words, text: str) -> Parts:
    """The map of a name with parameters and centre; raises ProjectionError."""
    name = _known(words.name, text)
    if name in WORLD_MAPS:
        return _world_map(name, words)
    needed = [key for key in needed_parameters(name) if key not in words.keys]
    if needed:
        sphere = "has no form on the sphere and " if "ellps" in needed else ""
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. It {sphere}needs {listed(needed, 'and')}: give a PROJ string, such "
            f"as '{_textbook(name)}', or '{name}{NEEDED_PARAMETERS[name].replace(' ', '')}'."
        )
    parts = parse_proj_string(" ".join(f"+{token}" for token in _tokens(name, words, text)))
    if words.centre is not None:
        _check_centre(parts, words, text)
    return parts._replace(name=title_of(replace(words, name=name)))


def title_of(words: Words) -> str:
    """Title of a named map, with its parameters and centre."""
    return f"{TITLES.get(words.name) or operation_titles()[words.name]}{_aspect(words)}"


def known_name(text: str) -> str:
    """The catalogue's spelling of a name or PROJ id; "" if unknown."""
    operations = pyproj.list.get_proj_operations_map()
    known = text if text in operations else normalised(text)
    return known if known in NAMES or known in operations or known in WORLD_MAPS else ""


def _known(name: str, text: str) -> str:
    """The catalogue's spelling of a name or PROJ id; raises ProjectionError."""
    known = known_name(name)
    if not known:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. {did_you_mean(close_names(name))}{ALLOWED}")
    if known in NOT_MAPS:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. PROJ's {pyproj.list.get_proj_operations_map()[known]} is not a map "
            "projection."
        )
    if known in NOT_IN_METRES:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. PROJ's {known} gives {NOT_IN_METRES[known]}, not metres."
        )
    return known


def _world_map(name: str, words: Words) -> Parts:
    """A map that PROJ lacks, centred on a meridian or point."""
    others = [token for token in words.parameters if not re.fullmatch(r"lon_0=[+-]?\d+\.?\d*", token)]
    if others:
        raise ProjectionError(
            f"Invalid parameter '+{shown(others[0])}' of '{name}'. It must be lon_0 in degrees: PROJ has no such map."
        )
    lat, lon = words.centre or (0.0, words.number("lon_0"))
    if not words.parameters and words.centre is None:
        return Parts(TITLES[name], name, SPHERE, WORLD_MAPS[name])
    definition = f"{name}+lon_0={number_text(lon)}"
    if words.centre is not None:
        definition = f"{name}@{number_text(lat)},{number_text(lon)}"
    parts = Parts(f"{TITLES[name]}{_aspect(words)}", definition, SPHERE, Turned(WORLD_MAPS[name], lat, lon))
    if words.centre is not None:
        _check_centre(parts, words, definition)
    return parts


def proj_tokens(name: str, words: Words) -> list[str]:
    """Tokens of the PROJ string of a name with parameters and centre, unchecked."""
    operation, fixed = operation_of(name)
    tokens = [f"proj={operation}", *(token for token in fixed if token.partition("=")[0] not in words.keys)]
    tokens += words.parameters
    if not ELLIPSOID_KEYS & set(words.keys):
        tokens += ellipsoid_parameters(operation_ellipsoid(operation, SPHERE)).replace("+", "").split()
    if words.centre is None:
        return tokens
    return turned_tokens([token for token in tokens if token != _POLE], *words.centre)


def operation_of(name: str) -> tuple[str, list[str]]:
    """PROJ operation of a name, and the tokens of its fixed parameters."""
    operation, *own = (NAMES.get(name) or TEXTBOOK_PARAMETERS.get(name, name)).split()
    return operation, [token.lstrip("+") for token in own]


def _tokens(name: str, words: Words, text: str) -> list[str]:
    """Tokens of the PROJ string of a name; raises ProjectionError for parameters that do not fit."""
    operation, fixed = operation_of(name)
    keys = [token.partition("=")[0] for token in fixed]
    clash = next((key for key in words.keys if key in keys), None)
    if clash and name in NAMES:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. A {name} map is {operation} with {listed(fixed, 'and')}: "
            f"for others write '{operation}+{clash}=...'."
        )
    if words.parameters or words.centre is not None:
        check_read(proj_tokens(name, replace(words, centre=None)), words.parameters, text)
    if words.centre is not None and _POLE in fixed and words.centre[0] != 90.0:
        lat, lon = words.centre
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Its centre is a pole: write '{operation}@{lat:g},{lon:g}'."
        )
    tokens = proj_tokens(name, words)
    if tokens[0] == "proj=ob_tran" and words.centre is not None and not ellipsoid_of(tokens).is_sphere:
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Only maps of a sphere can be turned: it must have no ellipsoid."
        )
    return tokens


def _check_centre(parts: Parts, words: Words, text: str) -> None:
    """Raise for maps whose centre is not at the origin with north up, such as icosahedra and Werner's."""
    assert words.centre is not None
    if not has_centre(parts.function, *words.centre, origin=(words.number("x_0"), words.number("y_0"))):
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. It has no centre for a point with north up there: move it by "
            "+lon_0=..., or write a PROJ string."
        )


def has_centre(function: Function, lat: float, lon: float, origin: tuple[float, float]) -> bool:
    """True if a map has a point at `origin` (metres) with north up."""
    step = _NEAR if lat < 89.0 else -_NEAR
    x, y = function(np.array([lon, lon]), np.array([lat, lat + step]))
    x, y = x - origin[0], y - origin[1]
    slack = _ALMOST * abs(float(y[1]))
    return bool(max(abs(x[0]), abs(x[1]), abs(y[0])) <= slack < np.inf and np.sign(y[1]) == np.sign(step))


def _aspect(words: Words) -> str:
    """Part of a title for parameters and centre."""
    if words.centre is not None:
        lat, lon = words.centre
        return f", {_degrees(lat, 'NS')}, {_degrees(lon, 'EW')}{_in_brackets(words.parameters)}"
    if words.keys == ["lon_0"] and re.fullmatch(r"lon_0=[+-]?\d+\.?\d*", words.parameters[0]):
        return f", {_degrees(words.number('lon_0'), 'EW')}"
    return _in_brackets(words.parameters)


def _degrees(value: float, letters: str) -> str:
    return f"{abs(value):.6g}°" + (f" {letters[int(value < 0)]}" if value else "")


def _in_brackets(parameters: Sequence[str]) -> str:
    return f" ({', '.join(parameters)})" if parameters else ""


def _utm_code(text: str) -> str:
    """Code of the WGS 84 UTM zone of `utm33`, `UTM 33N`, `utm-33s`; north by default."""
    zone = re.fullmatch(r"utm[\s_-]*(?:zone[\s_-]*)?(0?[1-9]|[1-5]\d|60)[\s_-]*([ns]?)", text, re.IGNORECASE)
    return f"EPSG:32{7 if zone[2].lower() == 's' else 6}{int(zone[1]):02}" if zone else ""


def _textbook(name: str) -> str:
    operation = NAMES.get(name) or TEXTBOOK_PARAMETERS.get(name, name)
    parameters = [f"+proj={operation}", *NEEDED_PARAMETERS.get(name, "").split()]
    if "ellps" not in needed_parameters(name):
        parameters.append(ellipsoid_parameters(operation_ellipsoid(operation, SPHERE)))
    return " ".join(parameters)
