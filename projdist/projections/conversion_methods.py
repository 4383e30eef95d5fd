"""The parameters that a CRS states for its method, as PROJ needs them: other programs' names, the missing, the unused.

PROJ knows a parameter by EPSG's code or name, and in WKT 1 by the name that GDAL or Esri has for the method. It drops
others in silence and takes defaults. `data/methods.csv` lists what each method takes.
"""

from __future__ import annotations

import difflib
import functools
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from projdist.earth import data_rows
from projdist.projections.catalogue import folded
from projdist.projections.errors import ProjectionError
from projdist.support import NEAR, did_you_mean, listed, shown, tell


class Stated(NamedTuple):
    """A parameter as it is written in a definition; the value is in the unit that it has there."""

    name: str
    value: float


@dataclass(frozen=True)
class _Kind:
    """A kind of parameters: the quantity, and the names that programs have for it, the first of which WKT 1 has."""

    quantity: str  # angle, length, scale, or option for what chooses between methods
    names: tuple[str, ...]


# EPSG's names, GDAL's and GeoTools' of WKT 1, Esri's, and those of the CF conventions; case and spaces do not count.
_KINDS = {
    "latitude": _Kind(
        "angle",
        (
            *("latitude_of_origin", "Latitude of natural origin", "Latitude of false origin", "latitude_of_center"),
            *("latitude_of_centre", "Latitude of projection centre", "latitude_of_projection_center"),
            *("latitude_of_projection_origin", "Latitude of topocentric origin", "Spherical latitude of origin"),
            "Central_Parallel",
        ),
    ),
    "longitude": _Kind(
        "angle",
        (
            *("central_meridian", "Longitude of natural origin", "Longitude of false origin", "Longitude of origin"),
            *("longitude_of_center", "longitude_of_centre", "Longitude of projection centre"),
            *("longitude_of_projection_center", "longitude_of_projection_origin", "longitude_of_central_meridian"),
            *("straight_vertical_longitude_from_pole", "Longitude of topocentric origin"),
            "Spherical longitude of origin",
        ),
    ),
    "parallel_1": _Kind(
        "angle",
        (
            *("standard_parallel_1", "standard_parallel", "Latitude of 1st standard parallel"),
            *("Latitude of standard parallel", "Latitude of true scale", "Latitude of first standard parallel"),
        ),
    ),
    "parallel_2": _Kind(
        "angle",
        ("standard_parallel_2", "Latitude of 2nd standard parallel", "Latitude of second standard parallel"),
    ),
    "scale": _Kind(
        "scale",
        (
            *("scale_factor", "Scale factor at natural origin", "Scale factor on initial line"),
            *("Scale factor at projection centre", "Scale factor at projection center"),
            *("scale_factor_at_central_meridian", "scale_factor_at_projection_origin", "Ellipsoid scaling factor"),
            "Scale factor on pseudo standard parallel",
        ),
    ),
    "easting": _Kind("length", ("false_easting", "Easting at false origin", "Easting at projection centre")),
    "northing": _Kind("length", ("false_northing", "Northing at false origin", "Northing at projection centre")),
    "azimuth": _Kind(
        "angle",
        (
            *("azimuth", "Azimuth of initial line", "Azimuth at projection centre", "Azimuth at projection center"),
            *("azimuth_of_central_line", "Co-latitude of cone axis"),
        ),
    ),
    "skew": _Kind("angle", ("rectified_grid_angle", "Angle from Rectified to Skew Grid")),
    "pseudo_parallel": _Kind("angle", ("pseudo_standard_parallel_1", "Latitude of pseudo standard parallel")),
    "lat_1st": _Kind("angle", ("latitude_of_1st_point", "latitude_of_point_1")),
    "lon_1st": _Kind("angle", ("longitude_of_1st_point", "longitude_of_point_1")),
    "lat_2nd": _Kind("angle", ("latitude_of_2nd_point", "latitude_of_point_2")),
    "lon_2nd": _Kind("angle", ("longitude_of_2nd_point", "longitude_of_point_2")),
    "height": _Kind("length", ("satellite_height", "height", "perspective_point_height", "Viewpoint height")),
    "origin_height": _Kind("length", ("Ellipsoidal height of topocentric origin", "Projection plane origin height")),
    "peg_latitude": _Kind("angle", ("peg_point_latitude",)),
    "peg_longitude": _Kind("angle", ("peg_point_longitude",)),
    "peg_heading": _Kind("angle", ("peg_point_heading",)),
    "peg_height": _Kind("length", ("peg_point_height",)),
    "option": _Kind("option", ("option", "auxiliary_sphere_type", "x_scale", "y_scale", "xy_plane_rotation")),
}
_KIND_OF = {folded(name): key for key, kind in _KINDS.items() for name in kind.names}

# The names of parameters in WKT 2 by EPSG's code, or by a word of ours where there is none.
_NAMES = {
    "8801": "Latitude of natural origin",
    "8802": "Longitude of natural origin",
    "8805": "Scale factor at natural origin",
    "8806": "False easting",
    "8807": "False northing",
    "8811": "Latitude of projection centre",
    "8812": "Longitude of projection centre",
    "8813": "Azimuth at projection centre",
    "8814": "Angle from Rectified to Skew Grid",
    "8815": "Scale factor at projection centre",
    "8816": "Easting at projection centre",
    "8817": "Northing at projection centre",
    "8818": "Latitude of pseudo standard parallel",
    "8819": "Scale factor on pseudo standard parallel",
    "8821": "Latitude of false origin",
    "8822": "Longitude of false origin",
    "8823": "Latitude of 1st standard parallel",
    "8824": "Latitude of 2nd standard parallel",
    "8826": "Easting at false origin",
    "8827": "Northing at false origin",
    "8832": "Latitude of standard parallel",
    "8833": "Longitude of origin",
    "8834": "Latitude of topocentric origin",
    "8835": "Longitude of topocentric origin",
    "8836": "Ellipsoidal height of topocentric origin",
    "8840": "Viewpoint height",
    "1036": "Co-latitude of cone axis",
    "1038": "Ellipsoid scaling factor",
    "1039": "Projection plane origin height",
    "lat_1st": "Latitude of 1st point",
    "lon_1st": "Longitude of 1st point",
    "lat_2nd": "Latitude of 2nd point",
    "lon_2nd": "Longitude of 2nd point",
    "satellite_height": "Satellite Height",
    "true_scale": "Latitude of true scale",
    "peg_latitude": "Peg point latitude",
    "peg_longitude": "Peg point longitude",
    "peg_heading": "Peg point heading",
    "peg_height": "Peg point height",
}
_LATITUDES = {"latitude", "parallel_1", "parallel_2"}
_ROTATIONS = {"option", "skew"}  # Esri's XY_Plane_Rotation is one
_UNITS = {"angle": "degree", "length": "metre", "scale": "unity"}
_SAME = 1e-9  # relative: a value that programs write with other digits
_SAME_VALUE = 1e-6  # degrees: EPSG has Krovak's angle to 0.0001", and Esri another last digit


@dataclass(frozen=True)
class _Parameter:
    """A parameter that a method takes.

    `values` are the only ones that PROJ has for it, one or two; none where it takes any. `instead` is a kind that
    files have in its place.
    """

    name: str
    code: str
    kind: str
    optional: bool
    values: tuple[float, ...]
    instead: str

    @property
    def quantity(self) -> str:
        return _KINDS[self.kind].quantity

    @property
    def spoken(self) -> str:
        """Its name for a message, with that of WKT 1."""
        return f"{self.name} ({_KINDS[self.kind].names[0]})"

    def takes(self, kind: str) -> bool:
        """Whether a stated parameter of the kind is this one."""
        return kind != "" and kind in (self.kind, self.instead)

    def has(self, value: float) -> bool:
        """Whether PROJ has the value for it."""
        return not self.values or any(abs(value - known) < _SAME_VALUE for known in self.values)


@dataclass(frozen=True)
class _Method:
    """A method of PROJ's: its name in WKT 2, EPSG's code, other names, what it takes, and Esri's options for it."""

    name: str
    code: str
    other_names: tuple[str, ...]
    parameters: tuple[_Parameter, ...]
    options: dict[str, float]


@dataclass
class _Reading:
    """How the stated parameters serve a method: PROJJSON of those taken, and their values by folded names there."""

    method: _Method
    taken: dict[_Parameter, dict[str, Any]] = field(default_factory=dict)
    names: dict[str, float] = field(default_factory=dict)
    unused: list[Stated] = field(default_factory=list)

    @property
    def missing(self) -> list[_Parameter]:
        return [
            wanted
            for wanted in self.method.parameters
            if wanted not in self.taken and not wanted.optional and wanted.kind not in ("easting", "northing")
        ]

    def take(self, wanted: _Parameter, item: dict[str, Any], name: str) -> None:
        """Let what is stated by a name serve as a parameter, if PROJ has its value for that."""
        if wanted.optional or wanted.has(item["value"]):
            self.taken[wanted] = item
            self.names[folded(name)] = item["value"]

    def uses(self, item: Stated) -> bool:
        """Whether a stated parameter is one of those taken: by its name, or by its value and what it is."""
        name, kind = folded(item.name), _kind_of(item)
        if kind == "option" and self.method.options.get(name) == item.value:
            return True
        if name in self.names and _is_same(item.value, self.names[name]):
            return True
        return any(
            _is_same(item.value, value["value"])
            for wanted, value in self.taken.items()
            if wanted.takes(kind) or {kind, wanted.kind} <= _LATITUDES or {kind, wanted.kind} == _ROTATIONS
        )

    def is_idle(self, item: Stated) -> bool:
        """Whether a parameter that the method has not got changes nothing: 0, a scale of 1, the pole of a polar map."""
        kind = _kind_of(item)
        if kind == "latitude" and abs(item.value) == 90.0:
            return any(
                wanted.code == "8832" and value["value"] * item.value > 0 for wanted, value in self.taken.items()
            )
        neutral = 1.0 if kind == "scale" or folded(item.name) in ("xscale", "yscale") else 0.0
        return kind != "" and item.value == neutral

    def contradicts(self, item: Stated) -> bool:
        """Whether a stated latitude is the pole that the standard parallel of a polar map does not lie about."""
        parallel = next((value["value"] for wanted, value in self.taken.items() if wanted.code == "8832"), 0.0)
        return _kind_of(item) == "latitude" and abs(item.value) == 90.0 and parallel * item.value < 0.0


def _is_same(value: float, other: float) -> bool:
    return math.isclose(value, other, rel_tol=_SAME)


@functools.cache
def _methods() -> tuple[_Method, ...]:
    return tuple(
        _Method(
            row["method"],
            row["code"],
            tuple(filter(None, row["other_names"].split(";"))),
            tuple(map(_parameter, row["parameters"].split())),
            {folded(key): float(value) for key, _, value in (text.partition("=") for text in row["options"].split())},
        )
        for row in data_rows("methods.csv")
    )


def _parameter(entry: str) -> _Parameter:
    """A parameter of the table, as `8801`, `8801?` that may be missing, `8801=90,-90`, or `8832|latitude`."""
    entry, _, instead = entry.partition("|")
    entry, _, values = entry.partition("=")
    key = entry.removesuffix("?")
    name = _NAMES[key]
    return _Parameter(
        name=name,
        code=key if key.isdigit() else "",
        kind=_KIND_OF[folded(name)],
        optional=entry.endswith("?"),
        values=tuple(map(float, values.split(","))) if values else (),
        instead=instead,
    )


def is_parameter(name: str) -> bool:
    """Whether a program has the name for a parameter of a method."""
    return folded(name) in _KIND_OF


def known_method(name: str) -> bool:
    """Whether a method has a row in the table, by its name there or another one."""
    return bool(_candidates(name, ""))


def _candidates(name: str, code: str) -> list[_Method]:
    """The methods of a code or else of a name, and those that other programs call so."""
    wanted = folded(name)
    own = [method for method in _methods() if code and method.code == code] or [
        method for method in _methods() if folded(method.name) == wanted
    ]
    return own + [method for method in _methods() if method not in own and wanted in map(folded, method.other_names)]


def reconciled(crs: dict[str, Any], stated: Sequence[Stated] | None) -> dict[str, Any]:
    """PROJJSON of a projected CRS with the parameters that are stated, those included that PROJ did not understand.

    It is what was given where nothing is to be changed. `stated` are the parameters of a text that PROJ has not kept
    all of; None for those of the CRS itself. Tells of what has no use, and raises ProjectionError where a method lacks
    what it needs.
    """
    conversion = crs["conversion"]
    read = conversion.get("parameters", [])
    if stated is None:
        stated = [Stated(item["name"], item["value"]) for item in read if isinstance(item["value"], int | float)]
    method = conversion["method"]
    identity = method.get("id", {})
    code = str(identity["code"]) if identity.get("authority") == "EPSG" else ""  # PROJ has ids of its own, too
    reading = _best_reading(_candidates(method["name"], code), read, stated, code)
    if reading is None:  # PROJ knows it, or refuses it
        return crs
    _complete(reading, str(crs["name"]))
    if _is_as_read(reading, read):
        return crs
    mended = conversion_of(reading.method.name, reading.taken.values(), conversion["name"])
    return {key: value for key, value in crs.items() if key not in ("id", "ids")} | {"conversion": mended}


def conversion_of_names(method: str, stated: Sequence[Stated], name: str) -> dict[str, Any]:
    """PROJJSON of a conversion by a method's name, parameters in degrees and metres, checked as by `reconciled`."""
    reading = _best_reading(_candidates(method, ""), [], stated)
    if reading is None:
        raise ProjectionError(f"Invalid CRS '{shown(name)}'. PROJ does not know the method '{shown(method)}'.")
    _complete(reading, name)
    return conversion_of(reading.method.name, reading.taken.values(), name)


def conversion_of(method: str, parameters: Iterable[dict[str, Any]], name: str) -> dict[str, Any]:
    """PROJJSON of a conversion by a method of the table."""
    row = next(row for row in _methods() if row.name == method)
    identity: dict[str, Any] = {"name": row.name}
    if row.code:
        identity["id"] = {"authority": "EPSG", "code": int(row.code)}
    return {"name": name, "method": identity, "parameters": list(parameters)}


def _best_reading(
    candidates: Sequence[_Method], read: Sequence[dict[str, Any]], stated: Sequence[Stated], code: str = ""
) -> _Reading | None:
    """How the stated parameters serve the method that lacks least and leaves least unused; None without a method.

    `code` is that of the method for which PROJ has read parameters.
    """
    readings = [_reading(method, read, stated, code) for method in candidates]
    return min(readings, key=lambda reading: (len(reading.missing), len(reading.unused)), default=None)


def _reading(method: _Method, read: Sequence[dict[str, Any]], stated: Sequence[Stated], code: str) -> _Reading:
    """Give each parameter of a method what PROJ has read of it, else what is stated by another name."""
    reading = _Reading(method)
    for wanted in method.parameters:
        for item in read if code in ("", method.code) else ():
            if _is_named(item, wanted):
                reading.take(wanted, item, item["name"])
    for kinds in ([wanted.kind for wanted in method.parameters], [wanted.instead for wanted in method.parameters]):
        for wanted, kind in zip(method.parameters, kinds, strict=True):
            unread = (item for item in stated if _kind_of(item) == kind and folded(item.name) not in reading.names)
            found = next(unread, None)
            if kind and found is not None and wanted not in reading.taken:
                reading.take(wanted, _item(wanted, found, read), found.name)
    reading.unused += [item for item in stated if not reading.uses(item) and not reading.is_idle(item)]
    reading.unused += [
        Stated(wanted.name, item["value"])
        for wanted, item in reading.taken.items()
        if item["value"] != 0.0 and not wanted.has(item["value"])  # PROJ writes 0 for what a string does not state
    ]
    return reading


def _is_named(item: dict[str, Any], wanted: _Parameter) -> bool:
    """Whether a parameter that PROJ has read has the code or the name of one of the method's."""
    code = str(item.get("id", {}).get("code", ""))
    return code == wanted.code if code and wanted.code else folded(item["name"]) == folded(wanted.name)


def _kind_of(item: Stated) -> str:
    return _KIND_OF.get(folded(item.name), "")


def _item(wanted: _Parameter, found: Stated, read: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """PROJJSON of a parameter, in the unit that PROJ has read for others of its quantity."""
    alike = (item for item in read if folded(item["name"]) == folded(found.name))
    others = (item for item in read if _quantity_of(item) == wanted.quantity)
    unit = next((item["unit"] for item in (*alike, *others) if "unit" in item), _UNITS[wanted.quantity])
    item: dict[str, Any] = {"name": wanted.name, "value": found.value, "unit": unit}
    if wanted.code:
        item["id"] = {"authority": "EPSG", "code": int(wanted.code)}
    return item


def _quantity_of(item: dict[str, Any]) -> str:
    kind = _KIND_OF.get(folded(item["name"]))
    return _KINDS[kind].quantity if kind else ""


def _is_as_read(reading: _Reading, read: Sequence[dict[str, Any]]) -> bool:
    """Whether PROJ has understood all that is taken."""
    return all(
        any(item is known for known in read) and _is_plain(wanted, item) for wanted, item in reading.taken.items()
    )


def _is_plain(wanted: _Parameter, item: dict[str, Any]) -> bool:
    return "id" in item or folded(item["name"]) == folded(wanted.name)


def _complete(reading: _Reading, name: str) -> None:
    """Tell of parameters without use, take scales that are missing for 1, and refuse a method that lacks others."""
    method = reading.method
    strange = [item for item in reading.unused if not _kind_of(item)]
    needed = [wanted for wanted in reading.missing if wanted.quantity != "scale"]
    if needed:
        hint = did_you_mean([meant for item in strange for meant in _close(item.name, needed)])
        unused = listed([f"'{shown(item.name)}'" for item in reading.unused], "and")
        lacking = listed([item.spoken for item in needed], "and the")
        raise ProjectionError(
            f"Invalid CRS '{shown(name)}'. {method.name} needs the {lacking}"
            + (f", and has no use for {unused}. {hint}".rstrip() if unused else ".")
        )
    for item in reading.unused:
        if reading.contradicts(item):
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
        tell(f"The CRS '{shown(name)}' states no {wanted.spoken} for {method.name}: it is taken for 1.")
        reading.taken[wanted] = _item(wanted, Stated(wanted.name, 1.0), [])


def _close(name: str, wanted: Sequence[_Parameter]) -> list[str]:
    """Names that a parameter may have been meant for, spelt as it is."""
    known = {folded(spelling): spelling for item in wanted for spelling in _KINDS[item.kind].names}
    found = difflib.get_close_matches(folded(name), known, n=1, cutoff=NEAR)
    capitals = re.search(r"_[A-Z]", name) is not None
    return [known[key].title() if capitals and "_" in known[key] else known[key] for key in found]
