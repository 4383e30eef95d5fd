"""Exports of projections: PROJ pipelines, WKT2, Esri's WKT and derived CRSs."""

import functools
import itertools
import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer

from projdist._typing import ArrayLike, FloatArray
from projdist.earth import WGS84, Ellipsoid, wrapped
from projdist.projections import catalogue, operations, proj_strings
from projdist.projections.crs import read_crs
from projdist.projections.errors import ALLOWED, ProjectionError
from projdist.projections.operations import CrsOperation, GeographicAxes, Pipeline
from projdist.projections.projection import Projection
from projdist.support import did_you_mean, shown

_SAME = 1e-12  # of the semi-major axis: rounding of coordinates and of parameters
_SAME_MERIDIAN = 1e-13  # degrees, 0.01 micrometres
_SHARES = np.meshgrid((np.arange(18) + 0.5) / 18.0, (np.arange(17) + 0.5) / 17.0)
# Without any of these keys PROJ's operation is on GRS 80, but the CRS made of the string on WGS 84: 0.1 mm away.
_ELLIPSOIDS = frozenset("ellps datum a R init".split())
_BESIDE = frozenset("pipeline unitconvert axisswap longlat".split())  # steps around the one that projects
_REPLACED = frozenset("k k_0 lat_ts units to_meter".split())
_OPEN = "1"  # placeholder of a scale to be fitted
_WITH_K_0 = frozenset("merc tmerc etmerc stere sterea lcc somerc omerc krovak labrd gstmerc".split())


def pipeline_of(projection: Projection, matrix: FloatArray) -> str | None:
    """The PROJ pipeline from Greenwich degrees to `matrix` times the coordinates in metres; None for functions."""
    function, before, after, unit = projection.function, [], [], 1.0
    if isinstance(function, Pipeline):
        unit = function.to_metre
    elif isinstance(function, CrsOperation):
        unit = float(np.abs(function.axes).max())
        matrix = matrix @ (np.array(function.axes) / unit)
        greenwich, per_degree = function.angles.greenwich, function.angles.per_degree
        if greenwich:
            before.append(f"+proj=affine +xoff={-greenwich!r}")
        if per_degree != 1.0:
            before.append(f"+proj=affine +s11={per_degree!r} +s22={per_degree!r}")
    else:
        return None
    if unit != 1.0:
        after.append(f"+proj=unitconvert +xy_in={unit!r} +xy_out=m")
    head, *steps = re.split(r"\s+\+step\s+", function.definition)
    if "+proj=pipeline" not in head.split():
        head, steps = "+proj=pipeline", [head]
    coefficients = " ".join(f"+s{i + 1}{j + 1}={float(matrix[i, j])!r}" for i, j in itertools.product((0, 1), (0, 1)))
    return " +step ".join([head, *before, *steps, *after, f"+proj=affine {coefficients}"])


def wkt_of(projection: Projection, matrix: FloatArray, name: str) -> tuple[str | None, str | None]:
    """WKT2 of a derived projected CRS in metres east and north, and None; or None and the reason."""
    # It is derived by EPSG's affine parametric transformation (method 9624), and read back to compare it with the map.
    base = base_crs(projection)
    if base is None:
        return None, f"{projection.name} is not a CRS, but a function or a pipeline."
    wkt = base.to_wkt("WKT2_2019")
    if not wkt.startswith("PROJCRS["):
        return None, f"{projection.name} is a {base.type_name}, from which no CRS can be derived."
    points = tried(projection)
    truth = matrix @ np.array(projection(*points))
    u, v = (axis.unit_conversion_factor for axis in base.axis_info[:2])
    # PROJ transforms coordinates in the axis order and unit of the CRS. As the axes of polar maps do not tell their
    # order, all are tried, likely ones first.
    for sign_u, sign_v, swapped in itertools.product((1.0, -1.0), (1.0, -1.0), (False, True)):
        axes = np.diag([sign_u * u, sign_v * v])
        (a1, a2), (b1, b2) = (matrix @ (axes[::-1] if swapped else axes)).tolist()
        values = ",".join(
            f'PARAMETER["{key}",{value!r},{unit},ID["EPSG",{code}]]'
            for (key, unit, code), value in zip(_COEFFICIENTS, (0, a1, a2, 0, b1, b2), strict=True)
        )
        derived = _derived_wkt(name, wkt, f'"Linear correction",{_AFFINE},{values}')
        try:
            found = Projection.from_user_input(derived)(*points)
        except ProjectionError as error:
            return None, str(error)
        if agree(projection, np.array(found), truth):
            return CRS.from_wkt(derived).to_wkt("WKT2_2019", pretty=True), None
    return None, f"PROJ's CRS of {projection.name} is another map: it loses a default or a step."


def parameters_of(projection: Projection, matrix: FloatArray) -> str | None:
    """A PROJ string of `matrix` times the projection, by its own parameters such as lat_ts; None if impossible."""
    # The coordinates agree to 1e-12 of their size and the Earth's, on a grid over the area of use.
    tokens = _projecting_step(projection)
    if tokens is None or matrix[0, 1] or matrix[1, 0]:
        return None
    points = tried(projection)
    truth = matrix @ np.array(projection(*points))

    def coordinates(parameters: proj_strings.Stated) -> FloatArray:
        return np.array(Projection.from_user_input(proj_strings.string_of(parameters))(*points))

    for changed in _changed_parameters(tokens, float(matrix[0, 0]), float(matrix[1, 1])):
        try:
            if changed.get("k_0") == _OPEN:  # the scale whose coordinates fit the truth best (least squares)
                unscaled = coordinates(changed)
                origin = np.array([[float(changed.get(key) or 0.0)] for key in ("x_0", "y_0")])
                both = np.isfinite(unscaled + truth).all(axis=0)
                f, t = (values[:, both] - origin for values in (unscaled, truth))
                if not f.any():
                    continue
                changed["k_0"] = repr(float(np.sum(f * t) / np.sum(f * f)))
            if agree(projection, coordinates(changed), truth):
                return proj_strings.string_of(changed)
        except ProjectionError:
            continue
    return None


def tried(projection: Projection) -> tuple[FloatArray, FloatArray]:
    """Test points: a grid over the area of use or the globe."""
    west, south, east, north = projection.area_of_use or (-180.0, -90.0, 180.0, 90.0)
    width = east - west if east > west else east - west + 360.0
    return (west + width * _SHARES[0]).ravel(), (south + (north - south) * _SHARES[1]).ravel()


def same_coordinates(projection: Projection, other: Projection) -> bool:
    """True if two projections agree at all test points where both are defined."""
    points = tried(projection)
    return agree(projection, np.array(other(*points)), np.array(projection(*points)))


def agree(projection: Projection, found: FloatArray, truth: FloatArray) -> bool:
    """True if two sets of coordinates agree wherever both are finite."""
    both = np.isfinite(truth) & np.isfinite(found)
    size = float(np.abs(truth[both]).max(initial=0.0))
    return bool(both.any() and np.abs(found - truth)[both].max() <= _SAME * (projection.ellipsoid.a + size))


def base_crs(projection: Projection) -> CRS | None:
    """The projected CRS of a map, or the CRS that PROJ makes of its string, which may be another map; else None."""
    if isinstance(projection.function, CrsOperation):
        return CRS.from_wkt(projection.function.crs)
    if not isinstance(projection.function, Pipeline) or "+proj=pipeline" in projection.function.definition:
        return None
    text = projection.function.definition
    if "+proj=wintri" in text.split() and "+lat_1=" not in text:
        text += f" +lat_1={catalogue.WINKEL_PARALLEL}"  # the default, arccos(2 / pi), for which the CRS has 0
    if not _ELLIPSOIDS & proj_strings.stated_in(text.split()).keys():
        text += " +ellps=GRS80"
    try:
        return CRS.from_user_input(f"{text} +type=crs")
    except pyproj.exceptions.CRSError:
        return None


_METRE = 'LENGTHUNIT["metre",1]'
_ONE = 'SCALEUNIT["coefficient",1]'
# EPSG's affine parametric transformation: names, units and codes of its parameters.
_AFFINE = 'METHOD["Affine parametric transformation",ID["EPSG",9624]]'
_COEFFICIENTS = (
    *(("A0", _METRE, 8623), ("A1", _ONE, 8624), ("A2", _ONE, 8625)),
    *(("B0", _METRE, 8639), ("B1", _ONE, 8640), ("B2", _ONE, 8641)),
)


def _derived_wkt(name: str, base: str, conversion: str) -> str:
    """WKT2 of a CRS in metres east and north, derived from a base by a conversion."""
    quoted = name.replace('"', '""')
    return (
        f'DERIVEDPROJCRS["{quoted}",BASE{base},DERIVINGCONVERSION[{conversion}],'
        f'CS[Cartesian,2],AXIS["easting (E)",east,ORDER[1]],AXIS["northing (N)",north,ORDER[2]],{_METRE}]'
    )


def _projecting_step(projection: Projection) -> dict[str, str] | None:
    """Parameters of the one step of a PROJ operation that projects; None if there is not exactly one."""
    function = projection.function
    if not isinstance(function, Pipeline | CrsOperation):
        return None
    tokens = [token.lstrip("+") for token in function.definition.split()]
    steps = map(proj_strings.stated_in, proj_strings.steps_of(tokens))
    found = [step for step in steps if step and step.get("proj") not in _BESIDE]
    if isinstance(function, CrsOperation) and (greenwich := function.angles.greenwich):
        for parameters in found:
            # PROJ's paris is 0.2 mm from EPSG's, in grads; its rome, in seconds, is EPSG's but for the last bit.
            if abs(proj_strings.prime_meridian(parameters) - greenwich) > _SAME_MERIDIAN:
                parameters["pm"] = repr(greenwich)
    return found[0] if len(found) == 1 and "inv" not in found[0] else None


def _changed_parameters(tokens: dict[str, str], x: float, y: float) -> Iterator[dict[str, str]]:
    """Candidate parameters of the map stretched by x and y along its axes."""
    if x == y == 1.0:
        yield dict(tokens)
    try:
        factors = {"x_0": x, "y_0": y}
        shifts = {key: f"{float(tokens[key] or 0) * by!r}" for key, by in factors.items() if key in tokens}
        if x == y:
            if tokens["proj"] == "utm":  # the transverse Mercator map of a zone
                rest = {key: value for key, value in tokens.items() if key not in ("proj", "zone", "south")}
                north, meridian = 1e7 if "south" in tokens else 0.0, 6 * int(tokens["zone"] or 0) - 183
                named = {"proj": "tmerc", "lon_0": f"{meridian}", "x_0": repr(5e5 * x), "y_0": repr(north * x)}
                tokens = named | rest
            else:
                tokens = tokens | shifts
            if tokens["proj"] in _WITH_K_0:
                yield {key: value for key, value in tokens.items() if key not in _REPLACED} | {"k_0": _OPEN}
        elif tokens["proj"] in ("eqc", "cea"):
            parallel = math.cos(math.radians(float(tokens.get("lat_ts") or 0.0))) * x
            if parallel <= 1.0:
                yield tokens | shifts | {"lat_ts": repr(math.degrees(math.acos(parallel)))}
        elif tokens["proj"] == "hammer":
            yield tokens | shifts | {"M": repr(x * float(tokens.get("M") or 1.0))}
    except ValueError:
        return  # numbers in PROJ's other notations, as 30d


# ---- PROJ strings as CRSs ------------------------------------------------------------------------


class LinearUnit(NamedTuple):
    """A unit of lengths: PROJ's name, EPSG's name and code, the plural, and how many metres it has."""

    name: str
    title: str
    code: int
    plural: str
    metres: float


LINEAR_UNITS = {
    one.name: one
    for one in (
        LinearUnit("m", "metre", 9001, "metres", 1.0),
        LinearUnit("us-ft", "US survey foot", 9003, "US survey feet", 1200.0 / 3937.0),
        LinearUnit("ft", "foot", 9002, "international feet", 0.3048),
    )
}
"""The units of surveyors' CRSs, by PROJ's names."""


def geodetic_ellipsoid(geodetic: str) -> Ellipsoid:
    """The ellipsoid of a geographic CRS, as EPSG:6318; raises ProjectionError."""
    ellipsoid = operations.ellipsoid_of_crs(_geodetic(geodetic))
    assert ellipsoid is not None  # `_geodetic` makes sure
    return ellipsoid


def geodetic_of(projection: Projection) -> str | None:
    """WKT of the geographic CRS under a CRS; None without one, or if it is not in degrees east of Greenwich."""
    if not isinstance(projection.function, CrsOperation):
        return None
    geodetic = CRS.from_wkt(projection.function.crs).geodetic_crs
    if geodetic is None or not operations.has_plain_axes(geodetic) or GeographicAxes.of(geodetic) != GeographicAxes():
        return None
    return str(geodetic.to_wkt())


def crs_wkt(
    projection: Projection, name: str, *, geodetic: str | None = None, version: str = "WKT2_2019"
) -> tuple[str | None, str | None]:
    """WKT, WKT2_2019 or WKT1_ESRI, of a CRS that is the projection, and None; or None and the reason."""
    # Its base is `geodetic`, by default WGS 84 on its ellipsoid, else an unnamed datum. It is compared with the map.
    base = base_crs(projection)
    if base is None or not base.is_projected:
        return None, f"{projection.name} is not a CRS, but a function or a pipeline."
    parts = base.to_json_dict()
    parts["name"] = name
    parts["conversion"]["name"] = name
    for axis in parts["coordinate_system"]["axis"]:
        if isinstance(axis["unit"], dict):  # feet: PROJ writes their code in `id`, and reads it here
            axis["unit"] |= axis["unit"].get("id", {})
    geodetic = geodetic or ("EPSG:4326" if projection.ellipsoid.is_close(WGS84) else None)
    if geodetic:
        stated = _geodetic(geodetic).to_json_dict()
        parts["base_crs"] = {key: value for key, value in stated.items() if key != "$schema"}
    try:
        text = str(CRS.from_json_dict(parts).to_wkt(version, pretty=True))
        if version == "WKT1_ESRI":
            text = text.replace('UNIT["US survey foot",', 'UNIT["Foot_US",').replace('UNIT["foot",', 'UNIT["Foot",')
        found = Projection.from_user_input(text)
    except (pyproj.exceptions.CRSError, ProjectionError):
        return None, f"{version} has no such map."
    if not same_coordinates(projection, found):
        return None, f"{version} of {projection.name} is another map: it loses a default or a step."
    return text, None


def _geodetic(text: str) -> CRS:
    try:
        crs = read_crs(text)
    except ProjectionError:
        raise
    except (pyproj.exceptions.CRSError, TypeError, ValueError) as error:
        hint = did_you_mean(catalogue.close_codes(str(text)))
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. {hint}{ALLOWED}") from error
    if not crs.is_geographic or crs.ellipsoid is None:
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. It must have longitudes and latitudes.")
    if GeographicAxes.of(crs).greenwich:
        raise ProjectionError(f"Invalid geographic CRS '{shown(str(text))}'. Its longitudes must be from Greenwich.")
    return crs.to_2d() if len(crs.axis_info) > 2 else crs


def unprojected(crs: str, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes in Greenwich degrees, on the CRS's own datum, of coordinates; raises ProjectionError."""
    try:
        stated = read_crs(crs)
        base = operations.geographic_base(stated)
        if base is None:
            raise ProjectionError(f"Invalid CRS '{shown(crs)}'. It has no longitudes and latitudes.")
        transformer = Transformer.from_crs(stated, base, always_xy=True)
    except (pyproj.exceptions.CRSError, pyproj.exceptions.ProjError) as error:
        raise ProjectionError(f"Invalid CRS '{shown(crs)}'. {ALLOWED}") from error
    given = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    lon, lat = operations.transform(transformer, *given)
    operations.check_grids(transformer, given, lon)
    return GeographicAxes.of(base).to_degrees(lon, lat)


# ---- followed by a linear map --------------------------------------------------------------------


@dataclass(frozen=True)
class Composed:
    """A projection followed by a 2 x 2 matrix, given by rows."""

    base: Projection
    matrix: tuple[tuple[float, float], tuple[float, float]]

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres."""
        x, y = self.base(lon, lat)
        (xx, xy), (yx, yy) = self.matrix
        return xx * x + xy * y, yx * x + yy * y


def compose(projection: Projection, matrix: ArrayLike, name: str) -> Projection:
    """A projection followed by `matrix` (2, 2), as a PROJ pipeline if there is one; raises ProjectionError."""
    M = np.asarray(matrix, dtype=float)
    if M.shape != (2, 2) or not np.isfinite(M).all() or np.linalg.det(M) == 0.0:
        raise ProjectionError(f"Invalid matrix {M.tolist()} of a map. It must be 2 by 2, finite and invertible.")
    base, total = uncomposed(projection, M)
    rows = (float(total[0, 0]), float(total[0, 1])), (float(total[1, 0]), float(total[1, 1]))
    definition = pipeline_of(base, total) or f"{rows} x {base.definition}"
    return Projection(name, definition, base.ellipsoid, Composed(base, rows), base.area_of_use)


def uncomposed(projection: Projection, matrix: FloatArray) -> tuple[Projection, FloatArray]:
    """Base projection and total matrix of a projection, perhaps `Composed` itself, times a matrix."""
    if isinstance(projection.function, Composed):
        return projection.function.base, matrix @ np.array(projection.function.matrix)
    return projection, matrix


# ---- followed by operations of PROJ --------------------------------------------------------------

_METHOD = "PROJ-based operation method"
_SCOPE = "Maps of the area with little distortion."
_DECIMALS = 6  # of degrees: a tenth of a metre


class AreaOfUse(NamedTuple):
    """Area of use of a CRS: its name, and west, south, east, north in degrees."""

    name: str
    bounds: tuple[float, float, float, float]


@dataclass(frozen=True)
class DerivedCrs:
    """A CRS as a PROJ pipeline from degrees, as WKT2 with that conversion, and as WKT2 derived from its base."""

    pipeline: str
    wkt: str
    wkt_derived: str

    @property
    def projjson(self) -> str:
        """PROJJSON of `wkt`."""
        return json.dumps(CRS.from_wkt(self.wkt).to_json_dict(), indent=2)

    @functools.cached_property
    def projection(self) -> Projection:
        """The map of `wkt`."""
        return Projection.from_user_input(self.wkt)

    def inverse(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Longitudes and latitudes in degrees of coordinates; infinite where undefined."""
        operation = self.projection.function
        assert isinstance(operation, CrsOperation)  # true of every CRS
        return operation.inverse(x, y)


def derived_crs(
    base: Projection, steps: Sequence[str], name: str, area: AreaOfUse, *, geodetic: str | None = None
) -> DerivedCrs:
    """The CRS, for an area, of a PROJ string followed by operations on its metres east and north; ProjectionError."""
    # It is based on the geographic CRS `geodetic`, as by `crs_wkt`.
    text, reason = crs_wkt(base, f"{name}, base", geodetic=geodetic)
    if text is None:
        raise ProjectionError(f"Invalid base '{base.label}'. {reason}")
    plain = CRS.from_wkt(text)
    words = (word.lstrip("+") for word in base.definition.split())
    own = " ".join(f"+{word}" for word in words if word not in ("type=crs", "no_defs"))
    chain = " +step ".join([own, *steps])
    parts: dict[str, Any] = plain.to_json_dict()
    method = {"name": f"{_METHOD}: +proj=pipeline +step {chain}"}
    parts |= {"name": name, "conversion": {"name": name, "method": method, "parameters": []}}
    correction = steps[0] if len(steps) == 1 else f"+proj=pipeline {' '.join(f'+step {step}' for step in steps)}"
    conversion = f'"correction",METHOD["{_METHOD}: {correction}"]'
    try:
        derived = CRS.from_wkt(_derived_wkt(name, plain.to_wkt("WKT2_2019"), conversion))
    except pyproj.exceptions.CRSError as error:
        raise ProjectionError(f"Invalid correction of '{name}'. PROJ cannot derive it from its base.") from error
    west, south, east, north = area.bounds
    west, east = (-180.0, 180.0) if east - west >= 360.0 else map(float, wrapped([west, east]))
    sides = south, west, north, east
    keys = ("south_latitude", "west_longitude", "north_latitude", "east_longitude")
    bounds = {key: round(side, _DECIMALS) for key, side in zip(keys, sides, strict=True)}
    usage = {"scope": _SCOPE, "area": area.name, "bbox": bounds}
    both = (CRS.from_json_dict(one | usage).to_wkt("WKT2_2019", pretty=True) for one in (parts, derived.to_json_dict()))
    degrees = "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad"
    return DerivedCrs(f"{degrees} +step {chain}", *map(str, both))
