"""Projections from PROJ strings and pipelines."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pyproj.database
import pyproj.exceptions
import pyproj.list
from pyproj import CRS, Transformer

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.catalogue import NOT_IN_METRES, NOT_MAPS, close_ids, operation_titles
from projdist.projections.errors import ProjectionError, proj_reason
from projdist.projections.operations import (
    Parts,
    Pipeline,
    ellipsoid_parameters,
    has_own_ellipsoid,
    operation_ellipsoid,
    tell_of_ellipsoid,
    tell_of_sphere,
    transform,
)
from projdist.projections.proj_parameters import ELLIPSOID_KEYS, check_values, tell_of_idle
from projdist.support import did_you_mean, shown

# These relate a datum to WGS 84 or concern heights: PROJ would apply them, but they are not part of the map.
_DATUM_SHIFT_KEYS = frozenset("towgs84 nadgrids geoidgrids vunits vto_meter geoid_crs type no_defs wktext".split())


def is_proj_string(text: str) -> bool:
    """True if a text has a `proj=` and is not WKT or PROJJSON."""
    return re.search(r"(?:^|\s)\+?proj=", text) is not None and not re.match(r"\s*(?:\w+\s*[\[(]|{)", text)


def proj_string_of_parameters(parameters: Mapping[str, Any]) -> str:
    """The PROJ string of a dictionary of parameters; raises ProjectionError without an operation."""
    if not isinstance(parameters["proj"], str) or not parameters["proj"]:
        raise ProjectionError(
            f"Invalid projection '{shown(str(dict(parameters)))}'. Its proj must be the name of an operation, as merc."
        )
    return " ".join(
        f"+{key}" if value in (None, True, "") else f"+{key}={value}"
        for key, value in parameters.items()
        if value is not False
    )


def proj_string_of_crs(crs: CRS) -> str:
    """The PROJ string that a CRS was made from, with WGS 84 as the default ellipsoid (PROJ's is GRS 80)."""
    keys = {token.lstrip("+").partition("=")[0] for token in crs.srs.split()}
    if keys & ELLIPSOID_KEYS or crs.ellipsoid is None:
        return str(crs.srs)
    return f"{crs.srs} +ellps=WGS84"


def parse_proj_string(text: str) -> Parts:
    """The projection of a PROJ string or pipeline on one line; raises ProjectionError."""
    tokens = [token.lstrip("+") for token in text.split()]
    check_values(tokens, text)
    keys = [token.partition("=")[0] for token in tokens]
    operations = [token.partition("=")[2] for token in tokens if token.startswith("proj=")]
    if operations[0] != "pipeline":
        operations = operations[:1]  # PROJ runs the first of several
    inner = [token.partition("=")[2] for token in tokens if token.startswith("o_proj=")]
    if "xy_out" in keys and tokens[-1].partition("=")[2] in ("deg", "rad", "grad"):
        raise ProjectionError(f"Invalid projection '{shown(text)}'. Its output is an angle, not a plane in metres.")
    for operation in [*operations, *inner]:
        if operation in NOT_MAPS and operations[0] != "pipeline":
            raise ProjectionError(f"Invalid projection '{shown(text)}'. PROJ's {operation} is not a map projection.")
    _check_metres(text, tokens, [*operations, *inner])
    operation = next((name for name in reversed(operations) if name not in NOT_MAPS), "")
    definition = text
    try:
        if operations[0] != "pipeline":
            tokens = [token for token, key in zip(tokens, keys, strict=True) if key not in _DATUM_SHIFT_KEYS]
            tokens = [_ellipsoid_of_datum(token) if token.startswith("datum=") else token for token in tokens]
            if has_own_ellipsoid(operation):
                tokens = _with_own_ellipsoid(operation, tokens)
                definition = " ".join(f"+{token}" for token in tokens)
        pipeline = " ".join(f"+{token}" for token in tokens)
        function = Pipeline(pipeline, _metres_per_unit(text, tokens))
        transformer = function.transformer
    except pyproj.exceptions.ProjError as error:
        known = pyproj.list.get_proj_operations_map()
        unknown = next((name for name in [*operations, *inner] if name not in known), "")
        hint = did_you_mean(close_ids(unknown))
        message = f"Invalid PROJ string '{shown(text)}'. PROJ says: {proj_reason(error)}. {hint}"
        raise ProjectionError(message.rstrip()) from error
    if operations[0] == "pipeline" or "inv" in keys:
        _check_maps_degrees_to_plane(text, transformer)
    elif "omit_fwd" in keys:
        raise _no_map(text)
    tell_of_idle(tokens)
    stated = ellipsoid_of(tokens)
    _tell_of_ellipsoid(operation, tokens, stated)
    tell_of_sphere(operation, stated)
    return Parts(operation_name(operations, inner), definition, operation_ellipsoid(operation, stated), function)


def _check_metres(text: str, tokens: list[str], operations: Iterable[str]) -> None:
    """Raise for operations whose output is not in metres, unless a later step converts it."""
    for operation in operations:
        if operation in NOT_IN_METRES and not any(token == "proj=affine" for token in tokens):
            raise ProjectionError(
                f"Invalid projection '{shown(text)}'. PROJ's {operation} gives {NOT_IN_METRES[operation]}, not metres."
            )


def _with_own_ellipsoid(operation: str, tokens: list[str]) -> list[str]:
    """Tokens with the operation's own ellipsoid in place of the stated one."""
    stated = ellipsoid_of(tokens)
    own = ellipsoid_parameters(operation_ellipsoid(operation, stated)).replace("+", "").split()
    if set(own) <= set(tokens):
        return tokens
    _tell_of_ellipsoid(operation, tokens, stated)
    return [*(token for token in tokens if token.partition("=")[0] not in ELLIPSOID_KEYS), *own]


def _tell_of_ellipsoid(operation: str, tokens: list[str], stated: Ellipsoid) -> None:
    """Warn if an explicitly stated ellipsoid is replaced by the operation's own."""
    if any(token.partition("=")[0] in ELLIPSOID_KEYS for token in tokens):
        tell_of_ellipsoid(operation, stated)


def operation_name(operations: Iterable[str], rotated: Iterable[str]) -> str:
    """Title of the last map among the operations, or of the map that ob_tran rotates."""
    known = operation_titles()
    maps = [name for name in operations if name not in NOT_MAPS]
    if not maps:
        return "pipeline"
    inner = list(rotated)
    if maps[-1] == "ob_tran" and inner:
        return f"Oblique {known.get(inner[-1], inner[-1])}"
    return str(known.get(maps[-1], maps[-1]))


def _ellipsoid_of_datum(token: str) -> str:
    """The ellipsoid of a +datum, without its transformation to WGS 84."""
    definition = Transformer.from_pipeline(f"+proj=cart +{token}").definition
    ellipsoid = re.search(r"ellps=\S+", definition)
    return ellipsoid[0] if ellipsoid else token


def ellipsoid_of(tokens: list[str]) -> Ellipsoid:
    """The ellipsoid of the first step that states one, as PROJ reads it; GRS 80 by default."""
    steps: list[list[str]] = [[]]
    for token in tokens:
        if token == "step":
            steps.append([])
        elif token.partition("=")[0] in ELLIPSOID_KEYS:
            steps[-1].append(f"+{token}")
    stated = next((step for step in steps if step), [])
    cart = Transformer.from_pipeline(" ".join(["+proj=cart", *stated]))
    a = float(cart.transform(0.0, 0.0, 0.0)[0])
    b = float(cart.transform(0.0, 90.0, 0.0)[2])
    if not 1e-3 <= a <= 1e12:
        raise ProjectionError(f"Invalid ellipsoid '{' '.join(stated)}'. Its size must be 1 mm to 1e12 m.")
    f = (a - b) / a
    return Ellipsoid(a, f if f > 1e-15 else 0.0)  # less is the rounding of a sphere


def _metres_per_unit(text: str, tokens: list[str]) -> float:
    """Metres per output unit, from the last step that states a unit, back to the projection."""
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
                    f"Invalid unit '+to_meter={step['to_meter']}' in '{shown(text)}'. It must be metres, as a number."
                ) from error
        if step.get("proj") not in NOT_MAPS:
            break
    return 1.0


def _check_maps_degrees_to_plane(text: str, transformer: Transformer) -> None:
    """Raise for pipelines whose input is not angles or whose output is.

    With `radians` pyproj scales angles only: the same points in degrees and radians give the same output if and only
    if the input is angular and the output is not. pyproj does not treat grads as angles, so pipelines that begin by
    converting grads are compared with unscaled input.
    """
    lon, lat = np.meshgrid(np.linspace(-170.0, 170.0, 18), np.linspace(-85.0, 85.0, 18))
    degrees = np.array(transform(transformer, lon, lat))
    radians = np.array(transform(transformer, np.radians(lon), np.radians(lat), radians=True))
    untagged = np.array(transform(transformer, lon, lat, radians=True)) if _takes_grads(text) else radians
    if not (_same(degrees, radians) or _same(degrees, untagged)):
        raise _no_map(text)


def _no_map(text: str) -> ProjectionError:
    return ProjectionError(
        f"Invalid projection '{shown(text)}'. It must take longitude and latitude and return a plane, as a map does."
    )


def _same(one: FloatArray, other: FloatArray) -> bool:
    both = np.isfinite(one) & np.isfinite(other)
    size = float(np.abs(one[both]).max(initial=0.0))
    return np.allclose(one[both], other[both], rtol=1e-6, atol=1e-6 * size)


def _takes_grads(text: str) -> bool:
    """True if the first step that is not affine converts grads."""
    steps = [step for step in re.split(r"\s\+step\s+", text)[1:] if "+proj=affine" not in step.split()]
    return bool(steps) and "+xy_in=grad" in steps[0].split()
