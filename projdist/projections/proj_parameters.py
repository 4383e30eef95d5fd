"""The parameters of PROJ's operations: those of PROJ strings, and the numeric ones with their ranges."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyproj.exceptions
import pyproj.list
from pyproj import Transformer

from projdist.earth import data_rows
from projdist.projections.catalogue import NOT_MAPS
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import transform
from projdist.support import close_words, did_you_mean, listed, shown, tell

ANGLES = frozenset(
    """alpha asc_lon azi gamma inc_angle lat_0 lat_1 lat_2 lat_3 lat_b lat_ts lon_0 lon_1 lon_2 lon_3 lon_wrap lonc
    o_alpha o_lat_1 o_lat_2 o_lat_c o_lat_p o_lon_1 o_lon_2 o_lon_c o_lon_p phdg_0 plat_0 plon_0 rot theta
    tilt""".split()
)
NUMBERS = frozenset(
    """M R R_lat_a R_lat_g W a b e es f h h_0 k k_0 m n ps_rev q rf rot_xy s11 s12 s13 s21 s22 s23 s31 s32 s33 scrollx
    scrolly t_0 toff tscale x_0 xoff y_0 yoff z_0 zoff""".split()
)
WHOLE_NUMBERS = frozenset("aperture lsat north_square path resolution south_square zone".split())
ELLIPSOID_KEYS = frozenset("a b R f rf e es ellps datum R_A R_V R_a R_g R_h R_lat_a R_lat_g".split())
FLAGS = frozenset("approx exact geoc guam inv no_cut no_rot ns omit_fwd omit_inv over south".split())
TEXTS = frozenset("algo axis ellps mode no_off no_uoff o_proj orient pm shape sweep to_meter units".split())
"""Parameters of maps by the type that PROJ reads, from its source and the strings in its library."""

# PROJ reads these for every map, whether the map uses them or not.
_READ_OF_ALL = {"lat_0": 0.0, "lon_0": 0.0, "x_0": 0.0, "y_0": 0.0, "k_0": 1.0, "k": 1.0}
_OTHERS = {"lat_0": "37.25", "lon_0": "11.75", "x_0": "12345", "y_0": "12345", "k_0": "1.625", "k": "1.625"}
# Constants of maps, which PROJ writes into their CRSs: no warning is needed for them.
_CONSTANTS = {
    "krovak": {"alpha": 30.28813975},
    "mod_krovak": {"alpha": 30.28813975},
    "nzmg": {"lat_0": -41.0, "lon_0": 173.0, "x_0": 2510000.0, "y_0": 6023150.0},
    "peirce_q": {"lat_0": 90.0},
}
_SAME = 1e-6  # degrees: EPSG has Krovak's angle to 0.0001", and ESRI another last digit
# Keys that define a step and its direction, and keys without influence on a map.
_BESIDE = frozenset(
    """proj step inv omit_fwd omit_inv title init type no_defs wktext towgs84 nadgrids geoidgrids vunits vto_meter
    geoid_crs datum""".split()
)

_OF_STEPS = frozenset("proj step inv init omit_fwd omit_inv title".split())
_OF_FIGURES = frozenset("R R_lat_a R_lat_g a b e es f rf".split())
_OF_ALL = frozenset("k lon_wrap t_0 x_0 y_0 z_0 h_0".split()) | _OF_FIGURES

_FIGURE = r"(?:\d+(?:_\d+)*(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_NUMBER = re.compile(rf"[+-]?{_FIGURE}")
_ANGLE = re.compile(rf"[+-]?(?=[\d.])(?:{_FIGURE}[rR]|(?:{_FIGURE}[dD°])?(?:{_FIGURE}')?(?:{_FIGURE}\"?)?)[NSEWnsew]?")
_WHOLE = re.compile(r"[+-]?\d+")
_FLAG = re.compile(r"(?:[TtFf]\w*)?")


def check_values(tokens: Iterable[str], text: str) -> None:
    """Raise ProjectionError for values that do not have the type that PROJ reads."""
    kinds = (
        (ANGLES, _ANGLE, "an angle in degrees, as 10.5, 10d30' or 10d30'15\"W, or in radians, as 0.18r"),
        (NUMBERS, _NUMBER, "a finite number"),
        (WHOLE_NUMBERS, _WHOLE, "a whole number"),
        (FLAGS, _FLAG, "without a value, or be T or F"),
    )
    for token in tokens:
        key, _, value = token.partition("=")
        for keys, form, kind in kinds:
            if key in keys and not (form.fullmatch(value) and _is_finite(value)):
                raise ProjectionError(f"Invalid parameter '+{shown(token)}' in '{shown(text)}'. It must be {kind}.")


def _is_finite(value: str) -> bool:
    """True if no number in a value overflows."""
    return all(math.isfinite(float(figure.replace("_", ""))) for figure in re.findall(_FIGURE, value))


def tell_of_idle(tokens: Sequence[str]) -> None:
    """Warn of parameters of a PROJ string or its steps that change nothing."""
    common, *steps = _steps(tokens)
    if not steps:
        common, steps = [], [common]
    made = [(step, definition) for step in steps if (definition := _definition([*step, *common]))]
    for token in common:
        if made and all(_is_unread(token, read) for _, read in made):
            tell(_message(token, made[0][0]))
    for step, read in made:
        for token in step:
            if _is_constant(token, step):
                continue
            if _is_unread(token, read) or _is_in_vain(token, [*step, *common]):
                tell(_message(token, step))


def check_read(tokens: Sequence[str], added: Iterable[str], text: str) -> None:
    """Raise ProjectionError for added tokens that the map does not use."""
    for token in added:
        if token.partition("=")[0] in _OF_STEPS or _is_unread(token, _definition(tokens)) or _is_in_vain(token, tokens):
            others = [other for other in tokens if other is not token]
            hint = did_you_mean([meant.partition("=")[0] for meant in _meant(token, tokens)])
            raise ProjectionError(
                f"Invalid parameter '+{shown(token)}' in '{shown(text)}'. {hint}What changes {_operation(tokens)} is "
                f"{listed(_read_of(others), 'and')}."
            )


def _read_of(tokens: Sequence[str]) -> list[str]:
    """Names of the parameters that a map uses, with those of all maps."""
    found = []
    for key in sorted(ANGLES | NUMBERS | WHOLE_NUMBERS):
        meant = f"{key}={_OTHERS.get(key, '1')}"
        more = [*(token for token in tokens if token.partition("=")[0] != key), meant]
        if key not in _OF_ALL and not _is_unread(meant, _definition(more)) and not _is_in_vain(meant, more):
            found.append(key)
    return [*found, "x_0", "y_0", "R", "ellps", "units"]


def _steps(tokens: Sequence[str]) -> Iterator[list[str]]:
    """The tokens before the first step, then those of each step."""
    found: list[str] = []
    for token in tokens:
        if token == "step":
            yield found
            found = []
        else:
            found.append(token)
    yield found


def _made(tokens: Iterable[str]) -> Transformer | None:
    """PROJ's forward operation of one step; None if PROJ refuses it."""
    words = " ".join(f"+{token}" for token in tokens if token not in ("inv", "proj=pipeline"))
    try:
        return Transformer.from_pipeline(words)
    except pyproj.exceptions.ProjError:
        return None


def _definition(tokens: Iterable[str]) -> set[str]:
    """Parameters that PROJ read of a step."""
    made = _made(tokens)
    return set(made.definition.split()) if made else set()


def _is_unread(token: str, read: set[str]) -> bool:
    key, _, value = token.partition("=")
    return key not in _BESIDE and (token if value else key) not in read


def _is_constant(token: str, step: Sequence[str]) -> bool:
    """True if a parameter has the map's constant value."""
    key, _, value = token.partition("=")
    constant = _CONSTANTS.get(_operation(step), {}).get(key, math.nan)
    return bool(_NUMBER.fullmatch(value)) and abs(float(value.replace("_", "")) - constant) < _SAME


def _is_in_vain(token: str, step: Sequence[str]) -> bool:
    """True if a parameter that PROJ reads of every map has another value than its default and changes nothing."""
    key, _, value = token.partition("=")
    if key not in _READ_OF_ALL or _operation(step) in NOT_MAPS:
        return False
    if _NUMBER.fullmatch(value) and float(value.replace("_", "")) == _READ_OF_ALL[key]:
        return False
    rest = [other for other in step if other is not token]
    return _same_map(step, rest) and _same_map(step, [*rest, f"{key}={_OTHERS[key]}"])


def _same_map(one: Sequence[str], other: Sequence[str]) -> bool:
    lon, lat = (values.ravel() for values in np.meshgrid(np.linspace(-170.0, 175.0, 24), np.linspace(-80.0, 85.0, 12)))
    maps = [made for made in map(_made, (one, other)) if made]
    if len(maps) < 2:
        return False
    here, there = (np.array(transform(made, lon, lat)) for made in maps)
    return bool(np.array_equal(here, there, equal_nan=True))


def _operation(step: Iterable[str]) -> str:
    return next((token[5:] for token in step if token.startswith("proj=")), "")


def _message(token: str, step: Sequence[str]) -> str:
    hint = did_you_mean(list(_meant(token, step)))
    return f"PROJ makes no use of '+{shown(token)}' with {_operation(step)}. {hint}".rstrip()


def _meant(token: str, step: Sequence[str]) -> Iterator[str]:
    """Parameters spelt like a token that PROJ reads of this map and that are not set."""
    key, equals, value = token.partition("=")
    present = {other.partition("=")[0] for other in step}
    rest = [other for other in step if other is not token]
    for name in close_words(key.lower(), sorted(ANGLES | NUMBERS | WHOLE_NUMBERS | FLAGS | TEXTS)):
        meant = f"{name}{equals}{value}"
        if name not in present and meant in _definition([*rest, meant]):
            yield name


# ---- PROJ strings as dictionaries ----------------------------------------------------------------


Stated = Mapping[str, str]
"""The parameters of a PROJ string and their values, as texts; "" for flags."""


def stated_in(tokens: Iterable[str]) -> dict[str, str]:
    """Keys and values of tokens; of a repeated key the first value."""
    found: dict[str, str] = {}
    for token in tokens:
        key, _, value = token.lstrip("+").partition("=")
        found.setdefault(key, value)
    return found


def tokens_of(stated: Stated) -> list[str]:
    """The tokens of parameters, `key=value` or a flag."""
    return [f"{key}={value}" if value else key for key, value in stated.items()]


def string_of(stated: Stated) -> str:
    """The PROJ string of parameters."""
    return " ".join(f"+{token}" for token in tokens_of(stated))


def numbers_in(pipeline: str) -> dict[str, float | str]:
    """The parameters of a PROJ string, those that are numbers as numbers; of a repeated key the last value."""
    found: dict[str, float | str] = {}
    for token in pipeline.split():
        name, _, text = token.removeprefix("+").partition("=")
        try:
            found[name] = float(text)
        except ValueError:
            found[name] = text
    return found


def defined_by(text: str, parameters: Mapping[str, float]) -> str:
    """A PROJ string of one step with other values of numeric parameters."""
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


# ---- ranges of numeric parameters ----------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class ParameterRange:
    """A numeric parameter of a map: PROJ's key, its label, and the range in which PROJ has a map.

    `unit` is "°", "m" or "". `value` is the map's current one, always within the range; `step` suits a slider.
    Integer parameters have steps of 1 or more.
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    value: float


@dataclass(frozen=True)
class _Row:
    """A row of the table: rows of different `form` exclude each other; `where` limits a row to some maps.

    These are polar maps, maps of an ellipsoid, or maps with another parameter stated.
    """

    key: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    default: str
    form: str
    where: str


def parameters_in(operation: str, stated: Stated, *, sphere: bool) -> tuple[ParameterRange, ...]:
    """The numeric parameters of an operation with some parameters stated.

    Of alternatives, such as k_0 or lat_ts, those that are stated, else the first.
    """
    stated = {"k_0": stated["k"], **stated} if "k" in stated else stated  # PROJ's older word
    polar = abs(_value("lat_0", "0", stated)) == 90.0
    there = {"", *stated, *(["polar"] if polar else []), *([] if sphere else ["ellipsoid"])}
    rows = [row for row in _table().get(operation, ()) if row.where in there]
    forms = list(dict.fromkeys(row.form for row in rows if row.form))
    if forms:
        stated_forms = [row.form for row in rows if row.key in stated]
        form = max(forms, key=stated_forms.count)  # ties: the first
        rows = [row for row in rows if row.form in ("", form)]
    return tuple(_parameter(row, _value(row.key, row.default, stated)) for row in rows)


def longitude_key(parameters: Collection[ParameterRange]) -> str:
    """Key of the parameter that moves a map in longitude; "" if there is none."""
    keys = [parameter.name for parameter in parameters]
    return next((key for key in ("lonc", "lon_0") if key in keys), "")


def check_value(parameter: ParameterRange, value: float, label: str) -> str:
    """A value as text for PROJ; raises ProjectionError outside the range."""
    stepped = parameter.step >= 1.0 and parameter.unit != "m"
    if not parameter.low <= value <= parameter.high or (stepped and value % parameter.step):
        unit = " m" if parameter.unit == "m" else parameter.unit
        steps = f" in steps of {parameter.step:g}" if stepped else ""
        raise ProjectionError(
            f"Invalid {parameter.name} '{value:.12g}' of '{shown(label)}'. It must be {parameter.low:.12g} to "
            f"{parameter.high:.12g}{unit}{steps}."
        )
    return number_text(value)


def degrees_of(text: str) -> float:
    """Degrees of a PROJ value: a plain number, degrees with minutes and seconds, or radians."""
    sign = -1.0 if text.startswith("-") != text.upper().endswith(("S", "W")) else 1.0
    figures = text.strip("+-").rstrip("NSEWnsew").replace("_", "")
    if figures.endswith(("r", "R")):
        return sign * float(figures[:-1]) * 57.29577951308232
    parts = re.fullmatch(r"(?:([^dD°']+)[dD°]?)?(?:([^dD°'\"]+)')?(?:([^dD°'\"]+)\"?)?", figures)
    if parts is None:
        return sign * float(figures)
    return sign * sum(float(part or 0.0) / by for part, by in zip(parts.groups(), (1.0, 60.0, 3600.0), strict=True))


def prime_meridian(stated: Stated) -> float:
    """Prime meridian (+pm) of a map, in degrees from Greenwich."""
    meridian = stated.get("pm") or "0"
    return degrees_of(pyproj.list.get_prime_meridians_map().get(meridian, meridian))


def _value(key: str, default: str, stated: Stated) -> float:
    """Stated value, else the default, which may be another parameter's value."""
    if key in stated:
        return degrees_of(stated[key])
    if default in stated:
        return degrees_of(stated[default])
    return float(default) if re.match(r"[-\d]", default) else 0.0


def _parameter(row: _Row, value: float) -> ParameterRange:
    """The parameter of a row; its range is mirrored or extended to include the value."""
    low, high = row.low, row.high
    if value < 0.0 <= low and row.unit == "°" and -high <= value <= -low:
        low, high = -high, -low
    low, high = min(low, value), max(high, value)
    return ParameterRange(name=row.key, label=row.label, unit=row.unit, low=low, high=high, step=row.step, value=value)


@functools.cache
def _table() -> dict[str, tuple[_Row, ...]]:
    """Rows of the table by operation."""
    found: dict[str, tuple[_Row, ...]] = {}
    for row in data_rows("parameter_ranges.csv"):
        low, high, step = (float(row[key]) for key in ("low", "high", "step"))
        made = _Row(row["key"], row["label"], row["unit"], low, high, step, row["default"], row["form"], row["where"])
        found[row["operation"]] = (*found.get(row["operation"], ()), made)
    return found
