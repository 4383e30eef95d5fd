"""The `Projection` type, the inputs that it is made from, and the body that it maps."""

from __future__ import annotations

import functools
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike
from pyproj import CRS, Proj
from pyproj.database import query_crs_info
from pyproj.enums import PJType

from projdist._typing import FloatArray
from projdist.earth import SPHERE, Ellipsoid
from projdist.projections.crs import parse_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.names import parse_name
from projdist.projections.operations import CrsOperation, Function, Parts, Pipeline
from projdist.projections.projstrings import (
    is_proj_string,
    parse_proj_string,
    proj_string_of_crs,
    proj_string_of_parameters,
)
from projdist.projections.wkt import grid_mapping_in, is_wkt
from projdist.support import shown

_NAMED = re.compile(r'(?:ELLIPSOID|SPHEROID|DATUM|BASEGEOGCRS|BASEGEODCRS|GEOGCRS|GEODCRS|GEOGCS)\["([^"]*)"')
# Ellipsoids used for one body differ by up to 3.4 % (Saturn: equatorial and mean radius); the Moon and Io by 4.8 %.
# Bodies of more similar size are distinguished by name, if they have one.
_SAME_SIZE = 0.04
_WITH_ARTICLE = ("Moon", "Sun")


class Body(NamedTuple):
    """A celestial body: an ellipsoid of it, and its name ("" if unknown)."""

    ellipsoid: Ellipsoid
    name: str = ""

    def __str__(self) -> str:
        """In words: the Earth, Mars, a body of radius 1737.4 km."""
        if not self.ellipsoid.is_of_another_body:
            return "the Earth"
        article = "the " if self.name in _WITH_ARTICLE else ""
        return f"{article}{self.name}" if self.name else f"a body of radius {self.ellipsoid.a / 1000.0:.7g} km"


@functools.cache
def _names() -> tuple[str, ...]:
    """Names of the bodies of the International Astronomical Union's CRSs in PROJ's database, longest first."""
    found = query_crs_info(auth_name="IAU_2015", pj_types=[PJType.GEOGRAPHIC_2D_CRS, PJType.GEODETIC_CRS])
    names = {info.name.partition(" (")[0] for info in found} - {"Earth"}
    return tuple(sorted(names, key=lambda name: (-len(name), name)))


@functools.cache
def body_in(wkt: str) -> str:
    """Body named by the datum, ellipsoid or base of a CRS, as in "Mars_2000_IAU_IAG"; "" if none is."""
    words = " ".join(_NAMED.findall(wkt)).replace("_", " ")
    return next((name for name in _names() if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", words, re.IGNORECASE)), "")


def is_same_body(one: Body, other: Body) -> bool:
    """True if two bodies are the same, by name, or by size if a name is unknown."""
    foreign = [body.ellipsoid.is_of_another_body for body in (one, other)]
    if not all(foreign):
        return not any(foreign)
    if one.name and other.name:
        return one.name == other.name
    return abs(one.ellipsoid.a - other.ellipsoid.a) < _SAME_SIZE * max(one.ellipsoid.a, other.ellipsoid.a)


# ---- what names a map ----------------------------------------------------------------------------


_LONGEST_PATH = 300  # characters


def parse(value: Any) -> Parts:
    """The projection of a name, PROJ string, CRS code, WKT, PROJJSON, file or pyproj CRS; raises ProjectionError."""
    if isinstance(value, str):
        return _parse_text(value.strip())
    if isinstance(value, os.PathLike):
        return _parse_file(Path(value))
    if isinstance(value, Mapping) and "proj" in value:
        return parse_proj_string(proj_string_of_parameters(value))
    if isinstance(value, Proj):
        value = value.crs
    if isinstance(value, CRS) and is_proj_string(value.srs):
        return parse_proj_string(proj_string_of_crs(value))
    return parse_crs(value)


def listed_projections(value: Any) -> list[Any]:
    """The unparsed projections of an iterable; a single one, also ("EPSG", 3035), as a list of one."""
    pair = isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], int)
    one = isinstance(value, str | bytes | os.PathLike | Mapping | CRS | Proj) or callable(value) or pair
    return [value] if one or not isinstance(value, Iterable) else list(value)


def _parse_text(text: str) -> Parts:
    if text.lower().endswith((".prj", ".wkt", ".json")) and not re.search(r"[\[{]|proj=", text):
        return _parse_file(Path(text))
    return _parse_contents(text)


def _parse_contents(text: str) -> Parts:
    """The projection of text that is not a path."""
    if "\0" in text:  # where PROJ would stop reading
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It has a null character.")
    init = re.fullmatch(r"\+?init=(\w+:\w+)(?:\s+\+no_defs|\s+\+type=crs)*", text)
    if init:
        return parse_crs(init[1].upper())
    if text.startswith("{"):
        return _parse_json(text)
    if is_wkt(text):
        return parse_crs(text)
    if is_proj_string(text):
        return parse_proj_string(" ".join(text.split()))
    if ":" not in text:
        return parse_name(text)
    if re.fullmatch(r"\w+:\w+\s*(?:\+\s*[A-Za-z]\w*\s*(?:[=+@].*)?|@.*,.*)", text):
        raise ProjectionError(
            f"Invalid projection '{shown(text)}'. Parameters and centres are for names, as robinson+lon_0=150 and "
            "mollweide@45,-100; a CRS has its own."
        )
    return parse_crs(text)


def _parse_json(text: str) -> Parts:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ProjectionError(f"Invalid projection '{shown(text)}'. It is no JSON: {error}. {ALLOWED}") from error
    return parse(value) if "proj" in value or grid_mapping_in(value) else parse_crs(text)


def _shown_path(path: Path) -> str:
    """A path for a message, shortened to the file name if it is long."""
    text = " ".join(str(path).split())
    return text if len(text) <= _LONGEST_PATH else f".../{shown(path.name)}"


def _parse_file(path: Path) -> Parts:
    complaint = f"Invalid projection file '{_shown_path(path)}'."
    try:
        text = path.read_text(encoding="utf-8-sig").strip()
    except (OSError, ValueError) as error:  # a ValueError for what is not UTF-8, and for a null character in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise ProjectionError(f"{complaint} It cannot be read as text: {reason}.") from error
    if not text:
        raise ProjectionError(f"{complaint} It must hold WKT, PROJJSON or a PROJ string.")
    try:
        return _parse_contents(text)
    except ProjectionError as error:
        raise ProjectionError(f"{complaint} {error}") from error


# ---- the type ------------------------------------------------------------------------------------


_FARTHEST = 1e10  # radii, the reach of the gnomonic map; PROJ returns larger numbers outside of some maps
_LONGEST_LABEL = 60  # characters


@dataclass(frozen=True)
class Projection:
    """A map from longitude and latitude to the plane, and the ellipsoid that it maps.

    Call it with degrees: `x, y = projection(lon, lat)`, in metres, NaN where the map is not
    defined. Make one with `Projection.from_user_input`, which takes anything that names a
    projection, or `Projection.from_function`.
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
        """True if the ellipsoid has the size of another body, as a planet or moon."""
        return self.ellipsoid.is_of_another_body

    @property
    def body(self) -> Body:
        """The mapped body, named as in the CRS."""
        operation = self.function
        is_named = self.is_of_another_body and isinstance(operation, CrsOperation)
        return Body(self.ellipsoid, body_in(cast(CrsOperation, operation).crs) if is_named else "")

    @property
    def answers_everywhere(self) -> bool:
        """True if any place can be evaluated without an error; functions and pipelines with grids may fail."""
        operation = self.function
        return isinstance(operation, CrsOperation) or (isinstance(operation, Pipeline) and not operation.reads_grids)

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
        if _reach(x) + _reach(y) < farthest:  # and none is NaN
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


def _reach(values: FloatArray) -> float:
    """Largest absolute value, without a temporary array; NaN if any value is."""
    return max(float(values.max()), -float(values.min())) if values.size else 0.0


class HasWkt(Protocol):
    """An object with WKT, as rasterio's CRS."""

    def to_wkt(self) -> str:
        """Well-known text."""


ProjectionLike = (
    str
    | Projection
    | os.PathLike[str]
    | CRS
    | Proj
    | HasWkt
    | Callable[..., tuple[Any, Any]]
    | Mapping[str, Any]
    | tuple[str, int | str]
    | int
)
"""Accepted forms of a projection.

Text (a name, a PROJ string or pipeline, a code such as EPSG:3035, the name of a CRS, WKT, PROJJSON, a path), the path
of a .prj or .wkt file, pyproj's CRS or Proj or an object with WKT, a function of (lon, lat) in degrees, a dictionary
of PROJ parameters or PROJJSON, an authority and a code, an EPSG number, or a `Projection`.
"""
