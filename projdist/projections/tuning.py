"""Maps with other parameter values or another centre: for optimisers, sliders and dragging."""

import functools
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pyproj.exceptions

from projdist.earth import data_rows
from projdist.projections import catalogue, proj_strings, projection as names
from projdist.projections.crs import form_of
from projdist.projections.errors import ProjectionError, proj_reason
from projdist.projections.exports import parameters_of, same_coordinates
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.proj_strings import Stated, degrees_of, number_text, stated_in, string_of
from projdist.projections.projection import NamedMap, Projection, ProjectionLike, Turned, operation_of
from projdist.projections.worldmaps import WORLD_MAPS
from projdist.support import check_number, close_words, did_you_mean, listed, shown


def with_parameters(projection: Projection, parameters: Mapping[str, float]) -> Projection:
    """The projection of a one-step PROJ string with other numbers, the ellipsoid aside; raises ProjectionError."""
    # Only PROJ's own checks run, so that thousands can be made: each takes 0.05 ms, a tenth of parsing the string.
    function = projection.function
    if not isinstance(function, Pipeline) or "+proj=pipeline" in function.definition:
        raise ProjectionError(f"Invalid projection '{projection.label}'. It must be a PROJ string of one step.")
    definition = proj_strings.defined_by(projection.definition, parameters)
    return run_as(projection, definition, proj_strings.defined_by(function.definition, parameters))


def run_as(projection: Projection, definition: str, pipeline: str) -> Projection:
    """A projection with another PROJ string on the same ellipsoid; raises ProjectionError if PROJ refuses it."""
    assert isinstance(projection.function, Pipeline)
    changed = Pipeline(pipeline, projection.function.to_metre)
    try:
        _ = changed.transformer
    except pyproj.exceptions.ProjError as error:
        message = f"Invalid PROJ string '{changed.definition}'. PROJ says: {proj_reason(error)}."
        raise ProjectionError(message) from error
    return replace(projection, definition=definition, function=changed)


# ---- ranges of numeric parameters ----------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class ParameterRange:
    """A numeric parameter of a map: PROJ's key, its label, and the range in which PROJ has a map."""

    name: str
    label: str
    unit: str  # "°", "m" or ""
    low: float
    high: float
    step: float  # for a slider; 1 or more for integers
    value: float  # of the map; always within the range


def _ranges(operation: str, stated: Stated, *, sphere: bool) -> tuple[ParameterRange, ...]:
    """The numeric parameters of an operation, some of them stated."""
    # Rows of the table that differ in `form` are alternatives, such as k_0 and lat_ts: the stated ones count, else the
    # first. `where` limits a row to polar maps, maps of an ellipsoid, or maps with some other parameter. Ranges are
    # mirrored or extended to include the value.
    stated = {"k_0": stated["k"], **stated} if "k" in stated else stated  # PROJ's older word
    polar = abs(degrees_of(stated.get("lat_0", "0"))) == 90.0
    there = {"", *stated, *(["polar"] if polar else []), *([] if sphere else ["ellipsoid"])}
    rows = [row for row in data_rows("parameter_ranges.csv") if row["operation"] == operation and row["where"] in there]
    stated_forms = [row["form"] for row in rows if row["key"] in stated]
    form = max((row["form"] for row in rows if row["form"]), key=stated_forms.count, default="")  # ties: the first
    rows = [row for row in rows if row["form"] in ("", form)]
    found = []
    for row in rows:
        key, default = row["key"], row["default"]  # a number, or another parameter, whose value it then has
        low, high, step = (float(row[column]) for column in ("low", "high", "step"))
        number = default if re.match(r"[-\d]", default) else "0"
        value = degrees_of(stated.get(key, stated.get(default, number)))
        if value < 0.0 <= low and row["unit"] == "°" and -high <= value <= -low:
            low, high = -high, -low
        low, high, label, unit = min(low, value), max(high, value), row["label"], row["unit"]
        found.append(ParameterRange(name=key, label=label, unit=unit, low=low, high=high, step=step, value=value))
    return tuple(found)


def _longitude_key(parameters: Collection[ParameterRange]) -> str:
    """Key of the parameter that moves a map in longitude; "" if there is none."""
    keys = [parameter.name for parameter in parameters]
    return next((key for key in ("lonc", "lon_0") if key in keys), "")


# ---- sliders and dragging ------------------------------------------------------------------------

Centre = tuple[float, float]

_KEPT = 1024  # plans, each of a few kB
_TRIED = ((-50.0, 35.0), (123.0, 68.0))  # longitudes and latitudes to test whether a map can be centred
_WITH_LATITUDE = names.WITH_LATITUDE | {"omerc", "labrd"}
_LONGITUDES = ("lon_0", "lonc", "asc_lon", "path")  # ignored by PROJ in rotated maps
_STRINGS = ("ob_tran", "utm")  # names that stand for PROJ strings
_POLES = ("o_lat_p", "o_lon_p", "o_alpha", "o_lon_c", "o_lat_c", "o_lon_1", "o_lat_1", "o_lon_2", "o_lat_2")


@dataclass(frozen=True, kw_only=True)
class Tunable:
    """The adjustable properties of a map: its numeric `parameters`, and how it can be dragged."""

    definition: str  # a text of the same map whose parameters can be set
    parameters: tuple[ParameterRange, ...] = ()
    # "both" if any point can be moved to the map's origin: maps of the sphere are rotated, with north up; cones and
    # transverse cylinders move along their central meridian. Ellipsoids cannot be rotated.
    drags: Literal["both", "longitude", "none"] = "none"
    centre: Centre | None = None  # longitude and latitude now at the origin, latitude 0 for "longitude"


def tunable(projection: ProjectionLike) -> Tunable:
    """The adjustable properties of any map; none for functions, and pipelines and CRSs without a PROJ string."""
    return _plan(projection).tunable


def tuned(projection: ProjectionLike, values: Mapping[str, float], centre: Centre | None = None) -> Projection:
    """The map with other parameter values, and a longitude and latitude at its centre."""
    # A centre overrides lon_0 and lat_0. The definition of the result is a text, of a named map a name. Raises
    # ProjectionError for parameters and values that `tunable` does not allow or that PROJ refuses together.
    plan = _plan(projection)
    if not values and centre is None:
        return plan.projection
    texts = {key: _value_text(plan.tunable, key, value) for key, value in values.items()}
    if centre is None:
        return plan.made(texts, None)
    found, (lon, lat) = plan.tunable, (check_number("centre", value) for value in centre)
    if found.drags == "none":
        raise ProjectionError(f"Invalid centre of '{shown(found.definition)}'. This map has none that can be moved.")
    complaint = f"Invalid centre '{lon:g}, {lat:g}' of '{shown(found.definition)}'."
    low, high = next(((each.low, each.high) for each in found.parameters if each.name == "lat_0"), (-90.0, 90.0))
    if not (low <= lat <= high and np.isfinite(lon)):
        raise ProjectionError(f"{complaint} It must be a longitude, and a latitude of {low:g} to {high:g}.")
    lon = _wrapped(lon)
    made = plan.made(texts, (lon, lat))
    if found.drags == "both" and not np.isfinite(made(lon, lat)).all():
        raise ProjectionError(f"{complaint} It must be where the map is defined.")
    return made


@dataclass(frozen=True)
class _Plan:
    """A map, its adjustable properties, its stated PROJ parameters, and for a named map its `words`."""

    projection: Projection
    tunable: Tunable
    stated: Stated
    words: NamedMap | None = None

    def made(self, values: Stated, centre: Centre | None) -> Projection:
        """The map with other values and another centre."""
        if centre is not None and self.tunable.drags == "longitude":
            lon = _wrapped(centre[0] - proj_strings.prime_meridian(self.stated))
            values = {**values, _longitude_key(self.tunable.parameters): number_text(lon)}
            centre = None
        function = self.projection.function
        if self.words is None:
            assert isinstance(function, Pipeline)
            definition, pipeline = (
                string_of(_moved(_with(stated_in(text.split()), values), centre))
                for text in (self.projection.definition, function.definition)
            )
            made = run_as(self.projection, definition, pipeline)
            if centre is None:
                return made
            stated = stated_in(definition.split())
            inner = [stated["o_proj"]] if "o_proj" in stated else []
            return replace(made, name=proj_strings.operation_name([stated["proj"]], inner))
        words = _with_values(self.words, values)
        words = words if centre is None else _centred(words, centre)
        if words.name in WORLD_MAPS:
            return Projection.from_user_input(str(words))
        return replace(run_as(self.projection, str(words), string_of(stated_in(words.tokens))), name=words.title)


def _plan(projection: ProjectionLike) -> _Plan:
    if isinstance(projection, str) and not projection.strip().lower().endswith((".prj", ".wkt", ".json")):
        return _plan_of_text(projection.strip())
    made = Projection.from_user_input(projection)
    if isinstance(made.function, Pipeline | Turned) or made.function in WORLD_MAPS.values():
        return _plan_of_text(made.definition)
    if isinstance(made.function, CrsOperation):
        return _plan_of_operation(made)
    return _Plan(made, Tunable(definition=made.definition), {})


@functools.lru_cache(maxsize=_KEPT)
def _plan_of_text(text: str) -> _Plan:
    """Plan of a name, PROJ string, code or WKT."""
    projection = Projection.from_user_input(text)
    if form_of(text) != "proj" and ":" not in text:
        words = names.named_map(text)
        words = replace(words, name=names.known_name(words.name))
        if words.name in _STRINGS:
            return _plan_of_text(projection.definition)
        if words.name:  # and not of a CRS
            of_robinson = ["proj=robin", *words.parameters]  # which has lon_0 only, as world maps have
            stated = stated_in(of_robinson if words.name in WORLD_MAPS else replace(words, centre=None).tokens)
            latitude = _latitude(stated, sphere=projection.ellipsoid.is_sphere)
            if words.centre is not None:
                latitude = words.centre[0]
                stated |= {"lat_0": number_text(latitude), "lon_0": number_text(words.centre[1])}
            return _with_drags(_Plan(projection, Tunable(definition=str(words)), stated, words), latitude)
    if isinstance(projection.function, CrsOperation):
        return _plan_of_operation(projection)
    stated = stated_in(projection.definition.split())
    if stated["proj"] == "pipeline":
        return _plan_of_operation(projection)
    if stated["proj"] == "utm":  # the transverse Mercator map of a zone
        rest = {key: value for key, value in stated.items() if key not in ("proj", "zone", "south")}
        meridian = f"{6 * int(stated['zone']) - 183}" if "zone" in stated else stated.get("lon_0", "0")
        own = {"lon_0": meridian, "k_0": "0.9996", "x_0": "500000", "y_0": "10000000" if "south" in stated else "0"}
        return _plan_of_text(string_of({"proj": "tmerc", **rest, **own}))
    plan = _Plan(projection, Tunable(definition=projection.definition), stated)
    return _with_drags(plan, _latitude(stated, sphere=projection.ellipsoid.is_sphere))


@functools.lru_cache(maxsize=_KEPT)
def _plan_of_operation(projection: Projection) -> _Plan:
    """Plan of a CRS or pipeline, by the PROJ string of its only map."""
    text = parameters_of(projection, np.eye(2))
    return _Plan(projection, Tunable(definition=projection.definition), {}) if text is None else _plan_of_text(text)


def _with_drags(plan: _Plan, latitude: float | None) -> _Plan:
    """A plan completed with parameters and drags; `latitude` is that of the map's origin, None if it cannot move."""
    # The parameters of an oblique map are also those of its inner map.
    stated, sphere = plan.stated, plan.projection.ellipsoid.is_sphere
    parameters = _ranges(stated["proj"], stated, sphere=sphere)
    if stated["proj"] == "ob_tran":
        inner = _ranges(stated["o_proj"], stated, sphere=sphere)
        parameters = (*parameters, *(each for each in inner if each.name not in _LONGITUDES))
    found = replace(plan.tunable, parameters=parameters)
    key = _longitude_key(parameters)
    if not key:
        return replace(plan, tunable=found)
    lon = next(parameter.value for parameter in parameters if parameter.name == key)
    lon = _wrapped(lon + proj_strings.prime_meridian(stated))
    both = replace(plan, tunable=replace(found, drags="both", centre=(lon, latitude or 0.0)))
    if latitude is not None and _is_centred(both):
        return both
    return replace(plan, tunable=replace(found, drags="longitude", centre=(lon, 0.0)))


def _is_centred(plan: _Plan) -> bool:
    """True if other centres come to the origin with north up, and the current one changes nothing."""
    origin = degrees_of(plan.stated.get("x_0", "0")), degrees_of(plan.stated.get("y_0", "0"))
    try:
        moved = [(plan.made({}, (lon, lat)).function, lat, lon) for lon, lat in _TRIED]
        here = plan.made({}, plan.tunable.centre)
    except ProjectionError:
        return False
    return all(names.has_centre(*each, origin) for each in moved) and same_coordinates(plan.projection, here)


def _latitude(stated: Stated, *, sphere: bool) -> float | None:
    """Latitude at the origin of a map; None if it cannot be changed."""
    operation = stated["proj"]
    if operation in _WITH_LATITUDE:
        tangent = stated.get("lat_1", "0") if operation == "lcc" and "lat_2" not in stated else "0"
        return degrees_of(stated.get("lat_0", tangent))
    if not sphere:
        return None
    if operation != "ob_tran":
        return 0.0
    if "o_lat_p" not in stated or degrees_of(stated.get("o_lon_p", "0")):
        return None
    latitude = 90.0 - degrees_of(stated["o_lat_p"])
    return latitude if abs(latitude) <= 90.0 else None


def _moved(stated: Stated, centre: Centre | None) -> dict[str, str]:
    """Parameters of the map with a point at its origin."""
    if centre is None:
        return dict(stated)
    lon, lat = _wrapped(centre[0] - proj_strings.prime_meridian(stated)), centre[1]
    operation = stated["proj"]
    if operation in _WITH_LATITUDE:
        longitude = "lonc" if operation == "omerc" else "lon_0"
        return {**stated, "lat_0": number_text(lat), longitude: number_text(lon)}
    turned = stated.get("o_proj", operation)
    rest = {key: value for key, value in stated.items() if key not in ("proj", "o_proj", "lon_0", "lat_0", *_POLES)}
    return stated_in(names.turned_tokens([f"proj={turned}", *proj_strings.tokens_of(rest)], lat, lon))


def _with_values(words: NamedMap, values: Stated) -> NamedMap:
    """A named map with other values; a name whose fixed parameters change gives way to the general operation."""
    operation, fixed = operation_of(words.name)
    name, stated, own = words.name, words.stated, stated_in(fixed)
    if name in catalogue.NAMES and own.keys() & values.keys():
        name, stated = operation, own | stated
    if words.centre is None:
        return NamedMap(name, tuple(proj_strings.tokens_of(_with(stated, values))))
    lat, lon = (float(values.get(key, at)) for key, at in zip(("lat_0", "lon_0"), words.centre, strict=True))
    others = {key: value for key, value in values.items() if key not in ("lat_0", "lon_0")}
    return _centred(NamedMap(name, tuple(proj_strings.tokens_of(_with(stated, others)))), (lon, lat))


def _centred(words: NamedMap, centre: Centre) -> NamedMap:
    """A named map with a point at the origin."""
    lon, lat = centre
    operation, fixed = operation_of(words.name)
    stated = {key: value for key, value in words.stated.items() if key not in ("lat_0", "lon_0")}
    name = operation if "lat_0=90" in fixed and lat != 90.0 else words.name
    if "lat_0" in names.needed_parameters(name):
        stated = _moved({"proj": operation, **stated}, centre)
        del stated["proj"]
    elif operation in _WITH_LATITUDE or lat != 0.0:
        return NamedMap(name, tuple(proj_strings.tokens_of(stated)), (lat, lon))
    else:
        stated["lon_0"] = number_text(lon)
    return NamedMap(name, tuple(proj_strings.tokens_of(stated)))


def _with(stated: Stated, values: Stated) -> dict[str, str]:
    """Parameters with other values; k is a synonym of k_0."""
    return {key: value for key, value in stated.items() if key != "k" or "k_0" not in values} | dict(values)


def _value_text(found: Tunable, key: str, value: float) -> str:
    """An allowed parameter value as text; raises ProjectionError."""
    parameter = next((each for each in found.parameters if each.name == key), None)
    if parameter is None:
        names = [each.name for each in found.parameters]
        hint = did_you_mean(close_words(key, names))
        kind = f"{hint}It must be {listed(names, 'or')}" if names else "This map has none that can be set"
        raise ProjectionError(f"Invalid parameter '{shown(key)}' of '{shown(found.definition)}'. {kind}.")
    number, low, high = check_number(key, value), parameter.low, parameter.high
    stepped = parameter.step >= 1.0 and parameter.unit != "m"
    if not low <= number <= high or (stepped and number % parameter.step):
        unit = " m" if parameter.unit == "m" else parameter.unit
        steps = f" in steps of {parameter.step:g}" if stepped else ""
        raise ProjectionError(
            f"Invalid {key} '{number:.12g}' of '{shown(found.definition)}'. It must be {low:.12g} to "
            f"{high:.12g}{unit}{steps}."
        )
    return number_text(number)


def _wrapped(lon: float) -> float:
    """A longitude within -180 and 180 degrees; `wrapped` is for arrays, and ten times slower."""
    return lon if abs(lon) <= 180.0 else (lon + 180.0) % 360.0 - 180.0
