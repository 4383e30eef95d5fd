"""The numeric parameters of PROJ's operations and their ranges; `data/parameters.csv` has them with their sources."""

from __future__ import annotations

import csv
import functools
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from importlib import resources

import pyproj.list

from projdist.projections.arguments import number_text
from projdist.projections.errors import ProjectionError
from projdist.support import shown

__all__ = ["Parameter", "Stated", "check_value", "degrees_of", "longitude_key", "parameters_in", "prime_meridian"]

Stated = Mapping[str, str]
"""The parameters of a PROJ string and their values, as texts."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number that a map can be changed by: PROJ's key and what it is, with the range in which PROJ has a map.

    `unit` is "°", "m" or "". `value` is the one that the map has now, always within the range, in which `step` is a
    good one for a slider. Whole numbers, and what has no values in between, have steps of 1 or more.
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
    """A row of the table: `form` names what excludes other forms, `where` the maps on which it does something.

    These are polar maps, maps of an ellipsoid, or those of which another parameter is stated.
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


def parameters_in(operation: str, stated: Stated, *, sphere: bool) -> tuple[Parameter, ...]:
    """What can be turned of an operation with the parameters that are stated of it.

    Where PROJ takes one of several sets of parameters, as k_0 or lat_ts, it is the stated one, else the first.
    """
    stated = {"k_0": stated["k"], **stated} if "k" in stated else stated  # PROJ's older word
    polar = abs(_value("lat_0", "0", stated)) == 90.0
    there = {"", *stated, *(["polar"] if polar else []), *([] if sphere else ["ellipsoid"])}
    rows = [row for row in _table().get(operation, ()) if row.where in there]
    forms = list(dict.fromkeys(row.form for row in rows if row.form))
    if forms:
        form = max(forms, key=lambda form: _count(rows, form, stated))  # the first of several
        rows = [row for row in rows if row.form in ("", form)]
    return tuple(_parameter(row, _value(row.key, row.default, stated)) for row in rows)


def longitude_key(parameters: Collection[Parameter]) -> str:
    """Which parameter moves a map around the globe; "" if none does."""
    keys = [parameter.name for parameter in parameters]
    return next((key for key in ("lonc", "lon_0") if key in keys), "")


def check_value(parameter: Parameter, value: float, label: str) -> str:
    """The value as PROJ's text; raises ProjectionError for one out of the range."""
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
    """The number of one of PROJ's texts: as it is, in degrees, minutes and seconds, or in radians."""
    sign = -1.0 if text.startswith("-") != text.upper().endswith(("S", "W")) else 1.0
    figures = text.strip("+-").rstrip("NSEWnsew").replace("_", "")
    if figures.endswith(("r", "R")):
        return sign * float(figures[:-1]) * 57.29577951308232
    parts = re.fullmatch(r"(?:([^dD°']+)[dD°]?)?(?:([^dD°'\"]+)')?(?:([^dD°'\"]+)\"?)?", figures)
    if parts is None:
        return sign * float(figures)
    return sign * sum(float(part or 0.0) / by for part, by in zip(parts.groups(), (1.0, 60.0, 3600.0), strict=True))


def prime_meridian(stated: Mapping[str, str | None]) -> float:
    """The meridian from which the longitudes of a map are counted, in degrees from Greenwich."""
    meridian = stated.get("pm") or "0"
    return degrees_of(pyproj.list.get_prime_meridians_map().get(meridian, meridian))


def _count(rows: Collection[_Row], form: str, stated: Stated) -> int:
    return sum(row.form == form and row.key in stated for row in rows)


def _value(key: str, default: str, stated: Stated) -> float:
    """What is stated, or the default, which may be another parameter's value."""
    if key in stated:
        return degrees_of(stated[key])
    if default in stated:
        return degrees_of(stated[default])
    return float(default) if re.match(r"[-\d]", default) else 0.0


def _parameter(row: _Row, value: float) -> Parameter:
    """The parameter; its range is mirrored, or reaches farther, if its value is beyond."""
    low, high = row.low, row.high
    if value < 0.0 <= low and row.unit == "°" and -high <= value <= -low:
        low, high = -high, -low
    low, high = min(low, value), max(high, value)
    return Parameter(name=row.key, label=row.label, unit=row.unit, low=low, high=high, step=row.step, value=value)


@functools.cache
def _table() -> dict[str, tuple[_Row, ...]]:
    """The rows of each operation, in their order."""
    text = resources.files("projdist").joinpath("data", "parameters.csv").read_text(encoding="utf-8")
    found: dict[str, tuple[_Row, ...]] = {}
    for row in csv.DictReader(text.splitlines()):
        low, high, step = (float(row[key]) for key in ("low", "high", "step"))
        made = _Row(row["key"], row["label"], row["unit"], low, high, step, row["default"], row["form"], row["where"])
        found[row["operation"]] = (*found.get(row["operation"], ()), made)
    return found
