"""Names with parameters, as `robinson+lon_0=150`, and with a point brought to the centre, as `mollweide@45,-100`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from projdist._typing import FloatArray
from projdist.projections.arguments import number_text
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import Function
from projdist.support import shown

__all__ = ["WITH_LATITUDE", "Turned", "Words", "has_words", "turned_tokens", "words_of"]

_BEHIND = re.compile(r"\+\s*[A-Za-z]\w*\s*(?==|\+|@|$)|@")  # where a parameter or a point begins
_NAME = re.compile(r"[^\s:/+@=][^:+@=]*")  # a code or a CRS's name has another character, but for +
_HEMISPHERES = {"N": (1.0, "lat"), "S": (-1.0, "lat"), "E": (1.0, "lon"), "W": (-1.0, "lon")}
_POINT = "It must be a latitude and a longitude in degrees, as @45,-100 or @45N,100W."

# Their own parameters bring a point to the centre: azimuthal maps, transverse cylinders, which lie along a meridian,
# maps of regions, and cones, which keep their parallels.
WITH_LATITUDE = frozenset(
    """aeqd airy gnom laea nsper tpers ortho stere sterea rouss cass tmerc etmerc gstmerc tcea somerc col_urban lcca
    leac aea eqdc euler lcc murd1 murd2 murd3 pconic tissot vitk1""".split()
)


@dataclass(frozen=True)
class Words:
    """A name, the PROJ parameters added to it, as `lon_0=150`, and latitude and longitude of its centre."""

    name: str
    parameters: tuple[str, ...]
    centre: tuple[float, float] | None

    @property
    def keys(self) -> list[str]:
        """The names of the parameters."""
        return [token.partition("=")[0] for token in self.parameters]

    def number(self, key: str) -> float:
        """The value of a parameter, 0 where it is not there."""
        return next((float(token[len(key) + 1 :]) for token in self.parameters if token.startswith(f"{key}=")), 0.0)


@dataclass(frozen=True)
class Turned:
    """A map of the sphere that has a point at its centre, with north up there; picklable."""

    function: Function
    lat: float
    lon: float

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        if self.lat == 0.0:
            return self.function(_around(lon - self.lon), lat)
        lam, phi, tilt = np.radians(lon - self.lon), np.radians(lat), np.radians(self.lat)
        ahead = np.cos(tilt) * np.cos(phi) * np.cos(lam) + np.sin(tilt) * np.sin(phi)
        right = np.cos(phi) * np.sin(lam)
        up = np.cos(tilt) * np.sin(phi) - np.sin(tilt) * np.cos(phi) * np.cos(lam)
        return self.function(np.degrees(np.arctan2(right, ahead)), np.degrees(np.arctan2(up, np.hypot(right, ahead))))


def _around(degrees: FloatArray) -> FloatArray:
    """Longitudes from -180 to 180, which are left as they are."""
    return np.where(np.abs(degrees) <= 180.0, degrees, np.mod(degrees + 180.0, 360.0) - 180.0)


def has_words(text: str) -> bool:
    """Whether a text is a name with parameters or a point behind it."""
    start = _BEHIND.search(text)
    return start is not None and _NAME.fullmatch(text[: start.start()]) is not None


def words_of(text: str) -> Words:
    """The name, its parameters and its centre; raises ProjectionError."""
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
    """Latitude and longitude of `@45,-100`; with the letters of hemispheres in any order."""
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
    return lat, float(np.mod(lon + 180.0, 360.0) - 180.0) if abs(lon) > 180.0 else lon


def turned_tokens(tokens: Sequence[str], lat: float, lon: float) -> list[str]:
    """The tokens of a PROJ string, its operation first, with a point brought to the centre, and north up there."""
    operation, rest = tokens[0].removeprefix("proj="), list(tokens[1:])
    longitude = f"lon_0={number_text(lon)}"
    if operation in WITH_LATITUDE:
        return [f"proj={operation}", f"lat_0={number_text(lat)}", longitude, *rest]
    if lat == 0.0:
        return [f"proj={operation}", longitude, *rest]
    # The pole lies on the frame's central meridian, as far from the frame's equator as the point is from the pole.
    pole = f"o_lat_p={number_text(90.0 - lat)}"
    return ["proj=ob_tran", f"o_proj={operation}", pole, "o_lon_p=0", longitude, *rest]
