"""Projections from PROJ strings and pipelines, and checks of their parameters."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyproj.database
import pyproj.exceptions
import pyproj.list
from pyproj import Transformer

from projdist.earth import Ellipsoid
from projdist.projections import catalogue, operations
from projdist.projections.errors import ProjectionError, proj_reason
from projdist.projections.operations import Parts, Pipeline, transform
from projdist.support import close_words, did_you_mean, listed, shown, tell

ANGLES, NUMBERS, WHOLE_NUMBERS, FLAGS, TEXTS, ELLIPSOID_KEYS = (
    catalogue.KEYWORDS[kind] for kind in ("angle", "number", "whole number", "flag", "text", "ellipsoid")
)
KEYS = ANGLES | NUMBERS | WHOLE_NUMBERS | FLAGS | TEXTS
"""Parameters of maps, of any of the types that PROJ reads."""

# PROJ reads these for every map, whether the map uses them or not.
_READ_OF_ALL = {"lat_0": 0.0, "lon_0": 0.0, "x_0": 0.0, "y_0": 0.0, "k_0": 1.0, "k": 1.0}
_OTHERS = {"lat_0": "37.25", "lon_0": "11.75", "x_0": "12345", "y_0": "12345", "k_0": "1.625", "k": "1.625"}
# Constants of maps, which PROJ writes into their CRSs: no warning is needed for them.
_KROVAK = {"alpha": 30.28813975}
_CONSTANTS = {"krovak": _KROVAK, "mod_krovak": _KROVAK, "peirce_q": {"lat_0": 90.0}}
_CONSTANTS["nzmg"] = {"lat_0": -41.0, "lon_0": 173.0, "x_0": 2510000.0, "y_0": 6023150.0}
_SAME = 1e-6  # degrees: EPSG has Krovak's angle to 0.0001", and ESRI another last digit
# PROJ would apply these, which relate a datum to WGS 84 or concern heights: they are not part of the map.
_DATUM_SHIFT_KEYS = frozenset("towgs84 nadgrids geoidgrids vunits vto_meter geoid_crs type no_defs wktext".split())
_OF_STEPS = frozenset("proj step inv init omit_fwd omit_inv title".split())
_BESIDE = _OF_STEPS | _DATUM_SHIFT_KEYS | {"datum"}  # keys without influence on a map
_OF_ALL = frozenset("k lon_wrap t_0 x_0 y_0 z_0 h_0 R R_lat_a R_lat_g a b e es f rf".split())

_FIGURE = r"(?:\d+(?:_\d+)*(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER = re.compile(rf"[+-]?{_FIGURE}")
_ANGLE = re.compile(rf"[+-]?(?=[\d.])(?:{_FIGURE}[rR]|(?:{_FIGURE}[dD°])?(?:{_FIGURE}')?(?:{_FIGURE}\"?)?)[NSEWnsew]?")
_WHOLE = re.compile(r"[+-]?\d+")
_FLAG = re.compile(r"(?:[TtFf]\w*)?")


def check_values(tokens: Iterable[str], text: str) -> None:
    """Raise ProjectionError for values that do not have the type that PROJ reads."""
    kinds = (
        (ANGLES, _ANGLE, "an angle in degrees, such as 10.5, 10d30' or 10d30'15\"W, or in radians, such as 0.18r"),
        (NUMBERS, _NUMBER, "a finite number"),
        (WHOLE_NUMBERS, _WHOLE, "a whole number"),
        (FLAGS, _FLAG, "without a value, or be T or F"),
    )
    for token in tokens:
        key, _, value = token.partition("=")
        figures = (float(figure.replace("_", "")) for figure in re.findall(_FIGURE, value))
        for keys, form, kind in kinds:
            if key in keys and not (form.fullmatch(value) and all(map(math.isfinite, figures))):
                raise ProjectionError(f"Invalid parameter '+{shown(token)}' in '{shown(text)}'. It must be {kind}.")


def tell_of_idle(tokens: Sequence[str]) -> None:
    """Warn of parameters of a PROJ string or its steps that change nothing."""
    common, *steps = steps_of(tokens)
    if not steps:
        common, steps = [], [common]
    made = [(step, read) for step in steps if (read := _read([*step, *common]))]
    idle = [(token, made[0][0]) for token in common if made and all(_is_unread(token, read) for _, read in made)]
    for step, read in made:
        for token in step:
            key, _, value = token.partition("=")
            constant = _CONSTANTS.get(stated_in(step).get("proj", ""), {}).get(key, math.nan)
            if _NUMBER.fullmatch(value) and abs(float(value.replace("_", "")) - constant) < _SAME:
                continue
            if _is_unread(token, read) or _is_in_vain(token, [*step, *common]):
                idle.append((token, step))
    for token, step in idle:
        hint = did_you_mean(_meant(token, step))
        tell(f"PROJ makes no use of '+{shown(token)}' with {stated_in(step).get('proj', '')}. {hint}".rstrip())


def check_read(tokens: Sequence[str], added: Iterable[str], text: str) -> None:
    """Raise ProjectionError for added tokens that the map does not use; the message lists those that it does."""
    for token in added:
        if token.partition("=")[0] not in _OF_STEPS and _is_used(token, tokens):
            continue
        used = []
        for key in sorted((ANGLES | NUMBERS | WHOLE_NUMBERS) - _OF_ALL):
            meant = f"{key}={_OTHERS.get(key, '1')}"
            rest = (other for other in tokens if other is not token and other.partition("=")[0] != key)
            if _is_used(meant, [*rest, meant]):
                used.append(key)
        hint = did_you_mean(_meant(token, tokens))
        raise ProjectionError(
            f"Invalid parameter '+{shown(token)}' in '{shown(text)}'. {hint}What changes "
            f"{stated_in(tokens).get('proj', '')} is {listed([*used, 'x_0', 'y_0', 'R', 'ellps', 'units'], 'and')}."
        )


def _made(tokens: Iterable[str]) -> Transformer | None:
    """PROJ's forward operation of one step; None if PROJ refuses it."""
    words = " ".join(f"+{token}" for token in tokens if token not in ("inv", "proj=pipeline"))
    try:
        return Transformer.from_pipeline(words)
    except pyproj.exceptions.ProjError:
        return None


def _read(tokens: Iterable[str]) -> set[str]:
    """The parameters of a step that PROJ has read."""
    made = _made(tokens)
    return set(made.definition.split()) if made else set()


def _is_unread(token: str, read: set[str]) -> bool:
    """True if PROJ did not read a parameter that concerns the map."""
    key, _, value = token.partition("=")
    return key not in _BESIDE and (token if value else key) not in read


def _is_used(token: str, step: Sequence[str]) -> bool:
    return not _is_unread(token, _read(step)) and not _is_in_vain(token, step)


def _is_in_vain(token: str, step: Sequence[str]) -> bool:
    """True if a parameter that PROJ reads for every map differs from its default, but changes nothing."""
    key, _, value = token.partition("=")
    if key not in _READ_OF_ALL or stated_in(step).get("proj") in catalogue.NOT_MAPS:
        return False
    if _NUMBER.fullmatch(value) and float(value.replace("_", "")) == _READ_OF_ALL[key]:
        return False
    rest = [other for other in step if other is not token]
    places = np.meshgrid(np.linspace(-170.0, 175.0, 24), np.linspace(-80.0, 85.0, 12))
    maps = map(_made, (step, rest, [*rest, f"{key}={_OTHERS[key]}"]))
    here, *others = (np.array(transform(made, *places)) if made else None for made in maps)
    if here is None:
        return False
    return all(there is not None and np.array_equal(here, there, equal_nan=True) for there in others)


def _meant(token: str, step: Sequence[str]) -> list[str]:
    """Parameters spelt like a token that PROJ reads for this map and that are not set yet."""
    key, equals, value = token.partition("=")
    rest = [other for other in step if other is not token]
    near = (name for name in close_words(key.lower(), sorted(KEYS)) if name not in stated_in(step))
    return [name for name in near if (meant := f"{name}{equals}{value}") in _read([*rest, meant])]


# ---- PROJ strings as dictionaries ----------------------------------------------------------------

Stated = Mapping[str, str]
"""The parameters of a PROJ string and their values, as texts; "" for flags."""


def stated_in(tokens: Iterable[str]) -> dict[str, str]:
    """Keys and values of tokens; the first value of a repeated key."""
    found: dict[str, str] = {}
    for token in tokens:
        key, _, value = token.lstrip("+").partition("=")
        found.setdefault(key, value)
    return found


def steps_of(tokens: Sequence[str]) -> list[list[str]]:
    """The tokens before the first step, then those of each step."""
    steps: list[list[str]] = [[]]
    for token in tokens:
        if token == "step":
            steps.append([])
        else:
            steps[-1].append(token)
    return steps


def tokens_of(stated: Stated) -> list[str]:
    """Parameters as tokens: `key=value`, or a flag."""
    return [f"{key}={value}" if value else key for key, value in stated.items()]


def string_of(stated: Stated) -> str:
    """The PROJ string of parameters."""
    return " ".join(f"+{token}" for token in tokens_of(stated))


def defined_by(text: str, parameters: Mapping[str, float]) -> str:
    """The PROJ string of one step with numeric parameters set to other values."""
    for key, value in parameters.items():
        token = f"+{key}={number_text(value)}"
        text, count = re.subn(rf"(?<!\S)\+?{re.escape(key)}=\S+", token, text, count=1)
        if not count:
            text = f"{text} {token}"
    return text


def number_text(value: float) -> str:
    """A number for a PROJ string: up to twelve decimals, without trailing zeros."""
    text = f"{value:.12f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def degrees_of(text: str) -> float:
    """Degrees of a PROJ value: a plain number, degrees with minutes and seconds, or radians."""
    sign = -1.0 if text.startswith("-") != text.upper().endswith(("S", "W")) else 1.0
    figures = text.strip("+-").rstrip("NSEWnsew").replace("_", "")
    if figures.endswith(("r", "R")):
        return sign * float(figures[:-1]) * 57.29577951308232
    total, unit, parts = 0.0, 0, re.findall(r"([^dD°'\"]+)([dD°'\"]?)", figures)
    for figure, mark in parts:
        unit = {"": unit, "'": 1, '"': 2}.get(mark, 0)  # without a mark, the unit after the last one
        total, unit = total + float(figure) / 60.0**unit, unit + 1
    if not parts or unit > 3:
        raise ValueError(f"Invalid angle '{text}'. It must be in degrees, minutes and seconds.")
    return sign * total


def prime_meridian(stated: Stated) -> float:
    """Prime meridian (+pm) of a map, in degrees from Greenwich."""
    meridian = stated.get("pm") or "0"
    return degrees_of(pyproj.list.get_prime_meridians_map().get(meridian, meridian))


# ---- projections of PROJ strings -----------------------------------------------------------------


def string_of_parameters(parameters: Mapping[str, Any]) -> str:
    """The PROJ string of a dictionary of parameters; raises ProjectionError without an operation."""
    if not isinstance(parameters["proj"], str) or not parameters["proj"]:
        raise ProjectionError(
            f"Invalid projection '{shown(str(dict(parameters)))}'. Its proj must be an operation's name, like merc."
        )
    return " ".join(
        f"+{key}" if value in (None, True, "") else f"+{key}={value}"
        for key, value in parameters.items()
        if value is not False
    )


def parse_proj_string(text: str) -> Parts:
    """The projection of a PROJ string or pipeline on one line; raises ProjectionError."""
    complaint = f"Invalid projection '{shown(text)}'."
    tokens = [token.lstrip("+") for token in text.split()]
    check_values(tokens, text)
    keys = [token.partition("=")[0] for token in tokens]
    ids = [token.partition("=")[2] for token in tokens if token.startswith("proj=")]
    is_pipeline = ids[0] == "pipeline"
    if not is_pipeline:
        ids = ids[:1]  # PROJ runs the first of several
    inner = [token.partition("=")[2] for token in tokens if token.startswith("o_proj=")]
    if "xy_out" in keys and tokens[-1].partition("=")[2] in ("deg", "rad", "grad"):
        raise ProjectionError(f"{complaint} Its output is an angle, not a plane in metres.")
    for operation in [*ids, *inner]:
        if operation in catalogue.NOT_MAPS and not is_pipeline:
            raise ProjectionError(f"{complaint} PROJ's {operation} is not a map projection.")
        if operation in catalogue.NOT_IN_METRES and "proj=affine" not in tokens:  # a step that may convert it
            raise ProjectionError(
                f"{complaint} PROJ's {operation} gives {catalogue.NOT_IN_METRES[operation]}, not metres."
            )
    operation = next((name for name in reversed(ids) if name not in catalogue.NOT_MAPS), "")
    definition = text
    try:
        if not is_pipeline:
            tokens = [token for token, key in zip(tokens, keys, strict=True) if key not in _DATUM_SHIFT_KEYS]
            for k, token in enumerate(tokens):
                if token.startswith("datum="):  # its ellipsoid, without its transformation to WGS 84
                    ellps = re.search(r"ellps=\S+", Transformer.from_pipeline(f"+proj=cart +{token}").definition)
                    tokens[k] = ellps[0] if ellps else token
            if operation in operations.OWN_ELLIPSOIDS:
                figure = _used_ellipsoid(operation, tokens)
                own = operations.ellipsoid_parameters(figure).replace("+", "").split()
                if not set(own) <= set(tokens):
                    tokens = [token for token in tokens if token.partition("=")[0] not in ELLIPSOID_KEYS] + own
                definition = " ".join(f"+{token}" for token in tokens)
        function = Pipeline(" ".join(f"+{token}" for token in tokens), _metres_per_unit(text, tokens))
        transformer = function.transformer
    except pyproj.exceptions.ProjError as error:
        known = pyproj.list.get_proj_operations_map()
        unknown = next((name for name in [*ids, *inner] if name not in known), "")
        reason = f"PROJ says: {proj_reason(error)}. {did_you_mean(catalogue.close_ids(unknown))}"
        raise ProjectionError(f"Invalid PROJ string '{shown(text)}'. {reason}".rstrip()) from error
    if not (_maps_degrees(text, transformer) if is_pipeline or "inv" in keys else "omit_fwd" not in keys):
        raise ProjectionError(f"{complaint} It must take longitude and latitude and return a plane, as a map does.")
    tell_of_idle(tokens)
    ellipsoid = _used_ellipsoid(operation, tokens)
    if operation in operations.SPHERICAL and not ellipsoid.is_sphere:
        tell(f"PROJ's {operation} is a map of the sphere; what it draws on an ellipsoid is another map.")
    return Parts(operation_name(ids, inner), definition, ellipsoid, function)


def _used_ellipsoid(operation: str, tokens: list[str]) -> Ellipsoid:
    """The ellipsoid that PROJ uses, with a warning if another one is stated."""
    is_stated = any(token.partition("=")[0] in ELLIPSOID_KEYS for token in tokens)
    return operations.operation_ellipsoid(operation, ellipsoid_of(tokens), warn=is_stated)


def operation_name(ids: Iterable[str], rotated: Iterable[str]) -> str:
    """Title of the last map among the operations, or of the map that ob_tran rotates."""
    known = catalogue.operation_titles()
    maps = [name for name in ids if name not in catalogue.NOT_MAPS]
    if not maps:
        return "pipeline"
    inner = list(rotated) if maps[-1] == "ob_tran" else []
    drawn = (inner or maps)[-1]
    return ("Oblique " if inner else "") + known.get(drawn, drawn)


def ellipsoid_of(tokens: list[str]) -> Ellipsoid:
    """The ellipsoid of the first step that states one, as PROJ reads it; GRS 80 by default."""
    keys = ([f"+{token}" for token in step if token.partition("=")[0] in ELLIPSOID_KEYS] for step in steps_of(tokens))
    stated = next(filter(None, keys), [])
    cart = Transformer.from_pipeline(" ".join(["+proj=cart", *stated]))
    a = float(cart.transform(0.0, 0.0, 0.0)[0])
    b = float(cart.transform(0.0, 90.0, 0.0)[2])
    if not 1e-3 <= a <= 1e12:
        raise ProjectionError(f"Invalid ellipsoid '{' '.join(stated)}'. Its size must be 1 mm to 1e12 m.")
    f = (a - b) / a
    return Ellipsoid(a, f if f > 1e-15 else 0.0)  # less is the rounding of a sphere


def _metres_per_unit(text: str, tokens: list[str]) -> float:
    """Metres per output unit, from the last step that states a unit, back to the projection."""
    for step in map(stated_in, reversed(steps_of(tokens))):
        if (name := step.get("units", step.get("xy_out"))) is not None:
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
        if step.get("proj") not in catalogue.NOT_MAPS:
            break
    return 1.0


def _maps_degrees(text: str, transformer: Transformer) -> bool:
    """True for pipelines whose input is angles and whose output is not."""
    # With `radians` pyproj scales angles only: points in degrees and the same in radians give the same output if the
    # input is angular and the output is not. Grads are no angles to pyproj, so that they are also tried unscaled.
    lon, lat = np.meshgrid(np.linspace(-170.0, 170.0, 18), np.linspace(-85.0, 85.0, 18))
    degrees = np.array(transform(transformer, lon, lat))
    tried = [np.array(transform(transformer, np.radians(lon), np.radians(lat), radians=True))]
    steps = [step.split() for step in re.split(r"\s\+step\s+", text)[1:] if "+proj=affine" not in step.split()]
    if steps and "+xy_in=grad" in steps[0]:
        tried.append(np.array(transform(transformer, lon, lat, radians=True)))
    for other in tried:
        both = np.isfinite(degrees) & np.isfinite(other)
        size = float(np.abs(degrees[both]).max(initial=0.0))
        if np.allclose(degrees[both], other[both], rtol=1e-6, atol=1e-6 * size):
            return True
    return False
