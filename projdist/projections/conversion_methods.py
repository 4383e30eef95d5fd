"""Parameters of a CRS's method translated for PROJ: names of other programs, missing and unused parameters.

PROJ knows a parameter by EPSG's code or name, and in WKT 1 by the name that GDAL or Esri has for the method. It drops
others silently and uses defaults. `data/methods.csv` lists what each method takes.
"""

import difflib
import functools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from projdist.earth import data_rows
from projdist.projections.catalogue import folded
from projdist.projections.errors import ProjectionError
from projdist.support import NEAR, did_you_mean, listed, shown, tell


class StatedParameter(NamedTuple):
    """A parameter as written in a definition, with its value in the definition's unit."""

    name: str
    value: float

    @property
    def kind(self) -> str:
        """The kind, by the name that any program uses; "" if none does."""
        return kind_of(self.name).kind


class ParameterKind(NamedTuple):
    """A kind of parameter: what it measures, and its names in all programs."""

    kind: str = ""
    quantity: str = ""  # angle, length, scale, or option, a choice between methods
    names: tuple[str, ...] = ()  # WKT 1's, EPSG's, GDAL's and GeoTools', Esri's, and those of the CF conventions


_LATITUDES = {"latitude", "parallel_1", "parallel_2"}
_ROTATIONS = {"option", "skew"}  # Esri's XY_Plane_Rotation is one
_UNITS = {"angle": "degree", "length": "metre", "scale": "unity"}
_SAME = 1e-9  # relative: a value that programs write with other digits
_SAME_VALUE = 1e-6  # degrees: EPSG has Krovak's angle to 0.0001", and Esri another last digit


@functools.cache
def _kinds() -> dict[str, ParameterKind]:
    """Kinds by their folded names."""
    rows = data_rows("parameter_names.csv")
    kinds = [ParameterKind(row["kind"], row["quantity"], tuple(row["names"].split(";"))) for row in rows]
    return {folded(name): kind for kind in kinds for name in kind.names}


def kind_of(name: str) -> ParameterKind:
    """The kind of a parameter by its name in any program; an empty kind if no program has it."""
    return _kinds().get(folded(name), ParameterKind())


@dataclass(frozen=True)
class _Parameter:
    """A parameter that a method takes."""

    name: str  # in WKT 2
    code: str  # EPSG's, "" if it has none
    optional: bool
    values: tuple[float, ...]  # the only ones that PROJ supports, empty if it takes any
    instead: str  # a kind that files may state in its place

    @functools.cached_property
    def kind(self) -> ParameterKind:
        return kind_of(self.name)

    def has(self, value: float) -> bool:
        """True if PROJ supports the value."""
        return not self.values or any(abs(value - known) < _SAME_VALUE for known in self.values)

    def written(self, value: float, unit: Any) -> dict[str, Any]:
        """PROJJSON of the parameter."""
        item = {"name": self.name, "value": value, "unit": unit}
        return item | ({"id": {"authority": "EPSG", "code": int(self.code)}} if self.code else {})


@dataclass(frozen=True)
class _Method:
    """A method of PROJ: name in WKT 2, EPSG code, other names, parameters, and Esri's options."""

    name: str
    code: str
    other_names: frozenset[str]
    parameters: tuple[_Parameter, ...]
    options: dict[str, float]


@functools.cache
def _methods() -> tuple[_Method, ...]:
    """The methods and their parameters: `8801`, optional `8801?`, of fixed values `8801=90,-90`, or `8832|latitude`."""
    # A parameter without EPSG's code has a word of ours in its place.
    names = {row["code"]: row["name"] for row in data_rows("method_parameters.csv")}
    methods = []
    for row in data_rows("methods.csv"):
        parameters = []
        for text in row["parameters"].split():
            entry, _, instead = text.partition("|")
            entry, _, values = entry.partition("=")
            key, known = entry.removesuffix("?"), tuple(map(float, filter(None, values.split(","))))
            code = key if key.isdigit() else ""
            parameters.append(_Parameter(names[key], code, entry.endswith("?"), known, instead))
        others = frozenset(folded(name) for name in row["other_names"].split(";") if name)
        options = {folded(key): float(value) for key, value in (text.split("=") for text in row["options"].split())}
        methods.append(_Method(row["method"], row["code"], others, tuple(parameters), options))
    return tuple(methods)


@dataclass
class _Reading:
    """Stated parameters matched to a method: PROJJSON of those taken, and their values by folded stated name."""

    method: _Method
    taken: dict[_Parameter, dict[str, Any]] = field(default_factory=dict)
    names: dict[str, float] = field(default_factory=dict)
    unused: list[StatedParameter] = field(default_factory=list)

    @property
    def missing(self) -> list[_Parameter]:
        """The required parameters that nothing states; false origins default to 0."""
        needed = (wanted for wanted in self.method.parameters if wanted not in self.taken and not wanted.optional)
        return [wanted for wanted in needed if wanted.kind.kind not in ("easting", "northing")]

    @property
    def parallel(self) -> float:
        """Standard parallel of a polar map; 0 for other maps."""
        return next((float(item["value"]) for wanted, item in self.taken.items() if wanted.code == "8832"), 0.0)

    def take(self, wanted: _Parameter, item: dict[str, Any], name: str) -> None:
        """Accept a stated parameter as one of the method's, if PROJ supports its value."""
        if wanted.optional or wanted.has(item["value"]):
            self.taken[wanted] = item
            self.names[folded(name)] = item["value"]

    def uses(self, item: StatedParameter) -> bool:
        """True if a stated parameter is among those taken, by name, or by value and kind."""
        name, kind = folded(item.name), item.kind
        if kind == "option" and self.method.options.get(name) == item.value:
            return True
        alike = [self.names[name]] if name in self.names else []
        for wanted, value in self.taken.items():
            both = {kind, wanted.kind.kind}
            if (kind and kind in (wanted.kind.kind, wanted.instead)) or both <= _LATITUDES or both == _ROTATIONS:
                alike.append(value["value"])
        return any(math.isclose(item.value, value, rel_tol=_SAME) for value in alike)

    def is_idle(self, item: StatedParameter) -> bool:
        """True if a parameter unknown to the method changes nothing: 0, a scale of 1, the pole of a polar map."""
        if item.kind == "latitude" and abs(item.value) == 90.0:
            return self.parallel * item.value > 0.0
        neutral = 1.0 if item.kind == "scale" or folded(item.name) in ("xscale", "yscale") else 0.0
        return item.kind != "" and item.value == neutral


def methods_named(name: str, code: str = "") -> list[_Method]:
    """Methods with the EPSG code or else the name, then those with the name as an alias."""
    wanted = folded(name)
    own = [method for method in _methods() if code and method.code == code]
    own = own or [method for method in _methods() if folded(method.name) == wanted]
    return own + [method for method in _methods() if method not in own and wanted in method.other_names]


def reconciled(crs: dict[str, Any], stated: Sequence[StatedParameter] | None) -> dict[str, Any]:
    """PROJJSON of a projected CRS with all stated parameters, those that PROJ did not understand included."""
    # `stated` are the parameters of the original text, some of which PROJ may have dropped; None for those of the CRS
    # itself. The same object if nothing changes; a warning of unused ones, ProjectionError without a required one.
    conversion = crs["conversion"]
    read = conversion.get("parameters", [])
    if stated is None:
        numbers = (item for item in read if isinstance(item["value"], int | float))
        stated = [StatedParameter(item["name"], item["value"]) for item in numbers]
    method = conversion["method"]
    identity = method.get("id", {})
    code = str(identity["code"]) if identity.get("authority") == "EPSG" else ""  # PROJ has ids of its own, too
    reading = _best_reading(methods_named(method["name"], code), read, stated, code)
    if reading is None:  # not in the table: left to PROJ
        return crs
    _complete(reading, str(crs["name"]))
    if all(
        any(item is known for known in read) and ("id" in item or folded(item["name"]) == folded(wanted.name))
        for wanted, item in reading.taken.items()
    ):
        return crs  # PROJ itself has read all
    mended = _conversion(reading, conversion["name"])
    return {key: value for key, value in crs.items() if key not in ("id", "ids")} | {"conversion": mended}


def conversion_of_names(method: str, stated: Sequence[StatedParameter], name: str) -> dict[str, Any]:
    """PROJJSON of a conversion by a method's name, parameters in degrees and metres, checked as by `reconciled`."""
    reading = _best_reading(methods_named(method), [], stated)
    if reading is None:
        raise ProjectionError(f"Invalid CRS '{shown(name)}'. PROJ does not know the method '{shown(method)}'.")
    _complete(reading, name)
    return _conversion(reading, name)


def _conversion(reading: _Reading, name: str) -> dict[str, Any]:
    """PROJJSON of a conversion by a method of the table."""
    method: dict[str, Any] = {"name": reading.method.name}
    if reading.method.code:
        method["id"] = {"authority": "EPSG", "code": int(reading.method.code)}
    return {"name": name, "method": method, "parameters": list(reading.taken.values())}


def _best_reading(
    candidates: Sequence[_Method], read: Sequence[dict[str, Any]], stated: Sequence[StatedParameter], code: str = ""
) -> _Reading | None:
    """The match with the fewest missing, then the fewest unused parameters; None without candidates."""
    # `code` is that of the method for which PROJ read the parameters.
    readings = [_reading(method, read, stated, code) for method in candidates]
    return min(readings, key=lambda reading: (len(reading.missing), len(reading.unused)), default=None)


def _reading(method: _Method, read: Sequence[dict[str, Any]], stated: Sequence[StatedParameter], code: str) -> _Reading:
    """Match each parameter of a method to what PROJ read, else to what is stated by another name."""
    reading = _Reading(method)
    for wanted in method.parameters:
        for item in read if code in ("", method.code) else ():
            own = str(item.get("id", {}).get("code", ""))
            if own == wanted.code if own and wanted.code else folded(item["name"]) == folded(wanted.name):
                reading.take(wanted, item, item["name"])
    for in_place in (False, True):
        for wanted in method.parameters:
            kind = wanted.instead if in_place else wanted.kind.kind
            unread = (item for item in stated if item.kind == kind and folded(item.name) not in reading.names)
            found = next(unread, None)
            if kind and found is not None and wanted not in reading.taken:
                reading.take(wanted, wanted.written(found.value, _unit(wanted, found.name, read)), found.name)
    reading.unused += [item for item in stated if not reading.uses(item) and not reading.is_idle(item)]
    reading.unused += [
        StatedParameter(wanted.name, item["value"])
        for wanted, item in reading.taken.items()
        if item["value"] != 0.0 and not wanted.has(item["value"])  # PROJ writes 0 for what a string does not state
    ]
    return reading


def _unit(wanted: _Parameter, name: str, read: Sequence[dict[str, Any]]) -> Any:
    """The unit that PROJ read for a parameter of a name, or for others of its quantity."""
    alike = (item for item in read if folded(item["name"]) == folded(name))
    quantity = wanted.kind.quantity
    others = (item for item in read if kind_of(item["name"]).quantity == quantity)
    return next((item["unit"] for item in (*alike, *others) if "unit" in item), _UNITS[quantity])


def _complete(reading: _Reading, name: str) -> None:
    """Warn of unused parameters, set missing scales to 1, and raise ProjectionError for other missing parameters."""
    method = reading.method
    strange = [item for item in reading.unused if not item.kind]
    needed = [wanted for wanted in reading.missing if wanted.kind.quantity != "scale"]
    if needed:
        hint = did_you_mean([meant for item in strange for meant in _close(item.name, needed)])
        unused = listed([f"'{shown(item.name)}'" for item in reading.unused], "and")
        lacking = listed([f"{item.name} ({item.kind.names[0]})" for item in needed], "and the")
        raise ProjectionError(
            f"Invalid CRS '{shown(name)}'. {method.name} needs the {lacking}"
            + (f", and has no use for {unused}. {hint}".rstrip() if unused else ".")
        )
    for item in reading.unused:
        if item.kind == "latitude" and abs(item.value) == 90.0 and reading.parallel * item.value < 0.0:
            raise ProjectionError(
                f"Invalid CRS '{shown(name)}'. Its '{shown(item.name)}' is {item.value:.12g}, and its standard "
                "parallel is on the other side of the equator: they must be on one."
            )
        hint = did_you_mean(_close(item.name, method.parameters)) if item in strange else ""
        tell(
            f"The CRS '{shown(name)}' states '{shown(item.name)}' ({item.value:.12g}), of which {method.name} makes no "
            f"use. {hint}".rstrip()
        )
    for wanted in reading.missing:  # only scales are left
        spoken = f"{wanted.name} ({wanted.kind.names[0]})"
        tell(f"The CRS '{shown(name)}' states no {spoken} for {method.name}: it is taken as 1.")
        reading.taken[wanted] = wanted.written(1.0, _UNITS["scale"])


def _close(name: str, wanted: Sequence[_Parameter]) -> list[str]:
    """The closest known name of a misspelt parameter, in its style of capitals."""
    known = {folded(spelling): spelling for item in wanted for spelling in item.kind.names}
    found = difflib.get_close_matches(folded(name), known, n=1, cutoff=NEAR)
    capitals = re.search(r"_[A-Z]", name) is not None
    return [known[key].title() if capitals and "_" in known[key] else known[key] for key in found]
