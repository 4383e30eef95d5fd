"""Map projections as one frozen value type, from any input; the home of pyproj.

A PROJ string is run as the pipeline it is, a CRS as the operation from its own geodetic CRS.
Neither goes through the other's form, which would lose defaults (`+proj=wintri`), methods
(EPSG:3857) and ellipsoids.
"""

from __future__ import annotations

import difflib
import functools
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyproj
import pyproj.database
import pyproj.list
from numpy.typing import ArrayLike
from pyproj import CRS, Transformer

from projdist._typing import FloatArray
from projdist.catalogue import NAMES, NOT_MAPS, TEXTBOOK_PARAMETERS
from projdist.ellipsoid import MEAN_EARTH_RADIUS, SPHERE, Ellipsoid

__all__ = ["Projection", "ProjectionError", "projection_names"]

Function = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]

_ALLOWED = (
    "It must be a PROJ id or a name (see 'projdist list projections'), a PROJ string, an EPSG: or ESRI: code, "
    "WKT, PROJJSON, the path of a .prj or .wkt file, a pyproj CRS, or a function of (lon, lat)."
)


_FARTHEST = 1e10  # radii; the gnomonic map reaches as far. PROJ gives larger numbers beyond the reach of some maps


class ProjectionError(ValueError):
    """What was given is not a map projection that can be measured."""


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
        undefined = ~(np.abs(x) + np.abs(y) < _FARTHEST * self.ellipsoid.a)
        if undefined.any():
            x, y = np.where(undefined, np.nan, x), np.where(undefined, np.nan, y)
        return x, y

    @classmethod
    def from_user_input(cls, value: Any) -> Projection:
        """A projection from a name, PROJ string, CRS code, WKT, PROJJSON, file, pyproj CRS or function.

        A bare name is the textbook map on the sphere of the Earth's mean radius. Raises
        ProjectionError, in one line, for what is none of these or has no plane.
        """
        if isinstance(value, Projection):
            return value
        if isinstance(value, str):
            return _from_text(value.strip())
        if isinstance(value, os.PathLike):
            return _from_file(Path(value))
        if callable(value) and not isinstance(value, CRS):
            return cls.from_function(value)
        if isinstance(value, Mapping) and "proj" in value:
            return _from_proj_string(_proj_string_of(value))
        if isinstance(value, CRS) and re.search(r"(?:^|\s)\+?proj=", value.srs):
            return _from_proj_string(_with_ellipsoid(value))
        return _from_crs(value)

    @classmethod
    def from_function(
        cls, function: Callable[..., tuple[Any, Any]], *, name: str | None = None, ellipsoid: Ellipsoid = SPHERE
    ) -> Projection:
        """A projection from a function of arrays (lon, lat) in degrees that returns (x, y) in metres."""
        if not callable(function):
            raise ProjectionError(f"Invalid projection function '{function}'. It must be callable with (lon, lat).")
        label = str(name or getattr(function, "__name__", type(function).__name__))
        return cls(label, label, ellipsoid, cast(Function, function))


def projection_names() -> dict[str, str]:
    """Every bare name that `Projection.from_user_input` takes, and the PROJ string it stands for."""
    ids = (name for name in pyproj.list.get_proj_operations_map() if name not in NOT_MAPS)
    return {name: _textbook(name) for name in [*NAMES, *ids]}


# ---- text -----------------------------------------------------------------------------------


def _from_text(text: str) -> Projection:
    if text.lower().endswith((".prj", ".wkt", ".json")) and not re.search(r"[\[{]|proj=", text):
        return _from_file(Path(text))
    return _from_definition(text) or (_from_crs(text) if ":" in text else _from_name(text))


def _from_definition(text: str) -> Projection | None:
    """A projection from a PROJ string, WKT or PROJJSON; None if the text is none of these."""
    init = re.fullmatch(r"\+?init=(\w+:\w+)(?:\s+\+no_defs|\s+\+type=crs)*", text)
    if init:
        return _from_crs(init[1].upper())
    if text.startswith("{"):
        return _from_json(text)
    if re.match(r"\w+\s*[\[(]", text):
        return _from_crs(text)
    if re.search(r"(?:^|\s)\+?proj=", text):
        return _from_proj_string(" ".join(text.split()))
    return None


def _from_json(text: str) -> Projection:
    try:
        value = json.loads(text)
    except ValueError as error:
        raise ProjectionError(f"Invalid projection '{_shown(text)}'. It is no JSON: {error}. {_ALLOWED}") from error
    return _from_proj_string(_proj_string_of(value)) if "proj" in value else _from_crs(text)


def _from_file(path: Path) -> Projection:
    try:
        text = path.read_text(encoding="utf-8-sig").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise ProjectionError(f"Invalid projection file '{path}'. It cannot be read as text: {reason}.") from error
    if not text:
        raise ProjectionError(f"Invalid projection file '{path}'. It must hold WKT, PROJJSON or a PROJ string.")
    try:
        return _from_definition(text) or (_from_crs(text) if ":" in text else _from_name(text))
    except ProjectionError as error:
        raise ProjectionError(f"Invalid projection file '{path}'. {error}") from error


def _shown(text: str) -> str:
    """Text for a message: on one line, and not too long."""
    line = " ".join(text.split())
    return line if len(line) <= 80 else f"{line[:77]}..."


def _proj_string_of(parameters: Mapping[str, Any]) -> str:
    """The PROJ string of a dictionary of its parameters."""
    return " ".join(
        f"+{key}" if value in (None, True, "") else f"+{key}={value}"
        for key, value in parameters.items()
        if value is not False
    )


def _with_ellipsoid(crs: CRS) -> str:
    """The PROJ string that a CRS was made from, whose default ellipsoid is WGS 84 and not PROJ's GRS 80."""
    keys = {token.lstrip("+").partition("=")[0] for token in crs.srs.split()}
    if keys & _ELLIPSOID_KEYS or crs.ellipsoid is None:
        return str(crs.srs)
    return f"{crs.srs} +ellps=WGS84"


def _from_name(text: str) -> Projection:
    operations = pyproj.list.get_proj_operations_map()
    name = text if text in operations else re.sub(r"[\s_]+", "-", text.lower())
    if name not in NAMES and name not in operations:
        known = [*NAMES, *(key for key in operations if key not in NOT_MAPS)]
        close = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
        hint = f"Did you mean {' or '.join(close)}? " if close else ""
        raise ProjectionError(f"Invalid projection '{_shown(text)}'. {hint}{_ALLOWED}")
    if name in NOT_MAPS:
        raise ProjectionError(f"Invalid projection '{text}'. PROJ's {operations[name]} is not a map projection.")
    definition = _textbook(name)
    try:
        projection = _from_proj_string(definition)
        return replace(projection, name=name.replace("-", " ").title()) if name in NAMES else projection
    except ProjectionError as error:
        raise ProjectionError(
            f"Invalid projection '{text}'. It has no map without parameters, so give a PROJ string, such as "
            f"'+proj=lcc +lat_1=30 +lat_2=60' (PROJ says: {_proj_reason(error.__cause__ or error)})."
        ) from error


def _textbook(name: str) -> str:
    operation = NAMES.get(name) or TEXTBOOK_PARAMETERS.get(name, name)
    return f"+proj={operation} +R={MEAN_EARTH_RADIUS}"


def _proj_reason(error: BaseException) -> str:
    """The core of one of PROJ's nested messages."""
    text = " ".join(str(error).split())
    inner = re.search(r"\(Internal Proj Error: (.*)\)$", text)
    reason = inner[1] if inner else text
    reason = re.sub(r"^proj_create: ", "", reason)
    return re.sub(r"^Error \d+ \((.*?)\)(?:: (.*))?$", lambda match: match[2] or match[1], reason).rstrip(".")


# ---- PROJ strings ---------------------------------------------------------------------------

_ELLIPSOID_KEYS = frozenset("a b R f rf e es ellps datum R_A R_V R_a R_g R_h R_lat_a R_lat_g".split())
# These tell how a datum relates to WGS 84 or name a height: no part of the map, but PROJ would apply them.
_DATUM_SHIFT_KEYS = frozenset("towgs84 nadgrids geoidgrids vunits vto_meter geoid_crs type no_defs wktext".split())


@dataclass(frozen=True)
class _Pipeline:
    """A PROJ operation as a function of degrees; picklable, hashable and safe to share between threads."""

    pipeline: str
    to_metre: float

    @functools.cached_property
    def transformer(self) -> Transformer:
        return Transformer.from_pipeline(self.pipeline)

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y = _transform(self.transformer, lon, lat)
        if self.to_metre != 1.0:
            x, y = x * self.to_metre, y * self.to_metre
        return x, y


def _transform(
    transformer: Transformer, lon: FloatArray, lat: FloatArray, *, radians: bool = False
) -> tuple[FloatArray, FloatArray]:
    # inplace saves pyproj's copies; errcheck is off, so that one bad point (inf) does not lose the others.
    x = np.array(lon, dtype=float, order="C", ndmin=1)
    y = np.array(lat, dtype=float, order="C", ndmin=1)
    transformer.transform(x, y, inplace=True, radians=radians, errcheck=False)
    return x.reshape(lon.shape), y.reshape(lon.shape)


def _from_proj_string(text: str) -> Projection:
    tokens = [token.lstrip("+") for token in text.split()]
    keys = [token.partition("=")[0] for token in tokens]
    operations = [token.partition("=")[2] for token in tokens if token.startswith("proj=")]
    if operations[0] != "pipeline":
        operations = operations[:1]  # of several, PROJ runs the first
    inner = [token.partition("=")[2] for token in tokens if token.startswith("o_proj=")]
    if "xy_out" in keys and tokens[-1].partition("=")[2] in ("deg", "rad", "grad"):
        raise ProjectionError(f"Invalid projection '{text}'. Its output is an angle, not a plane in metres.")
    for operation in [*operations, *inner]:
        if operation in NOT_MAPS and operations[0] != "pipeline":
            raise ProjectionError(f"Invalid projection '{text}'. PROJ's {operation} is not a map projection.")
    try:
        if operations[0] != "pipeline":
            tokens = [token for token, key in zip(tokens, keys, strict=True) if key not in _DATUM_SHIFT_KEYS]
            tokens = [_ellipsoid_of_datum(token) if token.startswith("datum=") else token for token in tokens]
        pipeline = " ".join(f"+{token}" for token in tokens)
        function = _Pipeline(pipeline, _metres_per_unit(text, tokens))
        transformer = function.transformer
    except pyproj.exceptions.ProjError as error:
        close = difflib.get_close_matches(operations[-1], pyproj.list.get_proj_operations_map(), n=3)
        unknown = operations[-1] not in pyproj.list.get_proj_operations_map()
        hint = f" Did you mean {' or '.join(close)}?" if close and unknown else ""
        raise ProjectionError(f"Invalid PROJ string '{text}'. PROJ says: {_proj_reason(error)}.{hint}") from error
    _check_maps_degrees_to_plane(text, transformer)
    return Projection(_operation_name(operations, inner), text, _ellipsoid_of(tokens), function)


def _operation_name(operations: Iterable[str], rotated: Iterable[str]) -> str:
    """The name of the last map among the operations, or of what an ob_tran rotates."""
    known = pyproj.list.get_proj_operations_map()
    maps = [name for name in operations if name not in NOT_MAPS]
    if not maps:
        return "pipeline"
    inner = list(rotated)
    if maps[-1] == "ob_tran" and inner:
        return f"Oblique {known.get(inner[-1], inner[-1])}"
    return str(known.get(maps[-1], maps[-1]))


def _ellipsoid_of_datum(token: str) -> str:
    """The ellipsoid of a +datum: its shift to WGS 84 is no part of the map."""
    definition = Transformer.from_pipeline(f"+proj=cart +{token}").definition
    ellipsoid = re.search(r"ellps=\S+", definition)
    return ellipsoid[0] if ellipsoid else token


def _ellipsoid_of(tokens: list[str]) -> Ellipsoid:
    """The ellipsoid of the first step that states one, as PROJ itself reads it; PROJ's default is GRS 80."""
    steps: list[list[str]] = [[]]
    for token in tokens:
        if token == "step":
            steps.append([])
        elif token.partition("=")[0] in _ELLIPSOID_KEYS:
            steps[-1].append(f"+{token}")
    stated = next((step for step in steps if step), [])
    cart = Transformer.from_pipeline(" ".join(["+proj=cart", *stated]))
    a = float(cart.transform(0.0, 0.0, 0.0)[0])
    b = float(cart.transform(0.0, 90.0, 0.0)[2])
    if not 1e-3 <= a <= 1e12:
        raise ProjectionError(f"Invalid ellipsoid '{' '.join(stated)}'. Its size must be 1 mm to 1e12 m.")
    f = (a - b) / a
    return Ellipsoid(a, f if f > 1e-15 else 0.0)  # below that, rounding of a sphere


def _metres_per_unit(text: str, tokens: list[str]) -> float:
    """Metres per unit of the output: what the last step that states a unit says, back to the projection itself."""
    steps: list[dict[str, str]] = [{}]
    for token in tokens:
        key, _, value = token.partition("=")
        if key == "step":
            steps.append({})
        steps[-1].setdefault(key, value)
    for step in reversed(steps):
        name = step.get("units", step.get("xy_out"))
        if name is not None:
            units = pyproj.database.get_units_map(category="linear").values()
            return next((float(unit.conv_factor) for unit in units if unit.proj_short_name == name), 1.0)
        if "to_meter" in step:
            top, _, bottom = step["to_meter"].partition("/")
            try:
                return float(top) / float(bottom or 1.0)
            except (ValueError, ZeroDivisionError) as error:
                raise ProjectionError(
                    f"Invalid unit '+to_meter={step['to_meter']}' in '{text}'. It must be metres, as a number."
                ) from error
        if step.get("proj") not in NOT_MAPS:
            break
    return 1.0


def _check_maps_degrees_to_plane(text: str, transformer: Transformer) -> None:
    """Refuse pipelines that do not take angles, or that return angles.

    With `radians` on, pyproj scales angles only: the same points in degrees and in radians
    give the same output if and only if the input is angular and the output is not.
    """
    lon, lat = np.meshgrid(np.linspace(-170.0, 170.0, 18), np.linspace(-85.0, 85.0, 18))
    degrees = np.array(_transform(transformer, lon, lat))
    radians = np.array(_transform(transformer, np.radians(lon), np.radians(lat), radians=True))
    both = np.isfinite(degrees) & np.isfinite(radians)
    if not np.allclose(
        degrees[both], radians[both], rtol=1e-6, atol=1e-6 * float(np.abs(degrees[both]).max(initial=0))
    ):
        raise ProjectionError(
            f"Invalid projection '{text}'. It must take longitude and latitude and return a plane, as a map does."
        )


# ---- coordinate reference systems -----------------------------------------------------------


@dataclass(frozen=True)
class _CrsOperation:
    """The operation of a projected CRS from Greenwich degrees to metres east and north."""

    crs: str
    greenwich: float  # degrees from Greenwich to the CRS's prime meridian
    angle_unit: float  # CRS angle units per degree
    axes: tuple[tuple[float, float], tuple[float, float]]  # (east, north) in metres per unit of each CRS axis

    @functools.cached_property
    def transformer(self) -> Transformer:
        crs = CRS.from_wkt(self.crs)
        return Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self.greenwich or self.angle_unit != 1.0:
            lon, lat = (lon - self.greenwich) * self.angle_unit, lat * self.angle_unit
        u, v = _transform(self.transformer, lon, lat)
        if self.axes == ((1.0, 0.0), (0.0, 1.0)):
            return u, v
        (xu, xv), (yu, yv) = self.axes
        x, y = (xu * u if xv == 0.0 else xv * v), (yv * v if yu == 0.0 else yu * u)
        return x, y


def _from_crs(value: Any) -> Projection:
    given = value if isinstance(value, str) else getattr(value, "name", None) or str(value)
    shown = _shown(given)
    try:
        stated = CRS.from_user_input(value)
    except (pyproj.exceptions.CRSError, TypeError) as error:
        raise ProjectionError(f"Invalid projection '{shown}'. {_crs_hint(given)}{_ALLOWED}") from error
    crs = _projected_part(stated, shown)
    geodetic = crs.geodetic_crs
    if geodetic is None or crs.ellipsoid is None:
        raise ProjectionError(f"Invalid projection '{shown}'. The CRS states no ellipsoid.")
    meridian = crs.prime_meridian
    greenwich = np.degrees(float(meridian.longitude) * float(meridian.unit_conversion_factor)) if meridian else 0.0
    east = next((axis for axis in geodetic.axis_info if axis.direction == "east"), geodetic.axis_info[0])
    function = _CrsOperation(
        crs.to_wkt(),
        float(greenwich),
        1.0 if east.unit_name.lower() == "degree" else float(np.radians(1.0) / east.unit_conversion_factor),
        _axes_to_metres(crs),
    )
    try:
        _ = function.transformer
    except pyproj.exceptions.ProjError as error:
        raise ProjectionError(
            f"Invalid projection '{shown}'. PROJ cannot compute {stated.name}: {_proj_reason(error)}."
        ) from error
    rf = crs.ellipsoid.inverse_flattening
    ellipsoid = Ellipsoid(crs.ellipsoid.semi_major_metre, 1.0 / rf if rf else 0.0)
    area = stated.area_of_use or crs.area_of_use
    authority = stated.to_authority(min_confidence=100)
    definition = ":".join(authority) if authority else str(stated.to_wkt())
    bounds = (area.west, area.south, area.east, area.north) if area else None
    return Projection(str(stated.name), definition, ellipsoid, function, bounds)


def _crs_hint(given: str) -> str:
    authority, colon, _ = given.partition(":")
    known = [*pyproj.database.get_authorities(), "urn"]
    if not colon or not re.fullmatch(r"\w+", authority):
        return ""
    if authority.upper() in known:
        return f"{authority.upper()} has no such CRS in PROJ's database. "
    close = difflib.get_close_matches(authority.upper(), known, n=1, cutoff=0.4)
    return f"Did you mean {close[0]}:{given.partition(':')[2]}? " if close else ""


def _projected_part(crs: CRS, shown: str) -> CRS:
    """The 2-D projected CRS within bound, compound and 3-D ones; raises ProjectionError where there is none."""
    while crs.is_bound or crs.is_compound:
        crs = cast(CRS, crs.source_crs) if crs.is_bound else crs.sub_crs_list[0]
    if not (crs.is_projected or crs.type_name == "Derived Projected CRS"):
        raise ProjectionError(
            f"Invalid projection '{shown}'. It is a {crs.type_name} ({_shown(crs.name)}), which has no map plane; "
            "it must be a projected CRS."
        )
    return crs.to_2d() if len(crs.axis_info) > 2 else crs


def _axes_to_metres(crs: CRS) -> tuple[tuple[float, float], tuple[float, float]]:
    """The matrix from the axes that `always_xy` gives to metres east and north."""
    axes = [(axis.direction, axis.unit_conversion_factor) for axis in crs.axis_info[:2]]
    if [direction for direction, _ in axes] == ["north", "east"]:
        axes.reverse()  # as always_xy does
    (first, u), (second, v) = axes
    sign = {"east": 1.0, "north": 1.0, "west": -1.0, "south": -1.0}
    if first in ("north", "south") and second in ("east", "west"):
        return ((0.0, sign[second] * v), (sign[first] * u, 0.0))
    if first in ("east", "west") and second in ("north", "south"):
        return ((sign[first] * u, 0.0), (0.0, sign[second] * v))
    return ((u, 0.0), (0.0, v))  # polar maps: both axes point along meridians
