"""The forms in which a projection times a matrix can leave: PROJ pipeline, WKT2, the projection's own parameters."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator

import numpy as np
import pyproj.exceptions
from pyproj import CRS

from projdist._typing import FloatArray
from projdist.projections.catalogue import WINKEL_PARALLEL
from projdist.projections.errors import ProjectionError
from projdist.projections.knobs import prime_meridian
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection

_SAME = 1e-12  # of the semi-major axis: rounding of coordinates and of parameters
_SAME_MERIDIAN = 1e-13  # degrees, 0.01 micrometres
_SHARES = np.meshgrid((np.arange(18) + 0.5) / 18.0, (np.arange(17) + 0.5) / 17.0)
# Defaults of PROJ's own that a CRS made of its string takes for others: arccos(2 / pi), for which PROJ has 0 there.
_LOST = {"wintri": ("lat_1", str(WINKEL_PARALLEL))}
# Of a string that states none of these PROJ's operation is on GRS 80, and the CRS made of it on WGS 84: 0.1 mm away.
_ELLIPSOIDS, _DEFAULT_ELLIPSOID = frozenset("ellps datum a R init".split()), "GRS80"
_BESIDE = frozenset("unitconvert axisswap longlat".split())  # steps that only dress up a projection
_REPLACED = frozenset("k k_0 lat_ts units to_meter".split())
_WITH_K_0 = frozenset("merc tmerc etmerc stere sterea lcc somerc omerc krovak labrd gstmerc".split())


def pipeline_of(projection: Projection, matrix: FloatArray) -> str | None:
    """The PROJ pipeline from Greenwich degrees to `matrix` times the coordinates in metres; None for functions."""
    function, before, after, unit = projection.function, [], [], 1.0
    if isinstance(function, Pipeline):
        text, unit = function.pipeline, function.to_metre
    elif isinstance(function, CrsOperation):
        text = " ".join(f"+{token}" for token in function.transformer.definition.split())
        unit = float(np.abs(function.axes).max())
        matrix = matrix @ (np.array(function.axes) / unit)
        if function.greenwich:
            before.append(f"+proj=affine +xoff={-function.greenwich!r}")
        if function.angle_unit != 1.0:
            before.append(f"+proj=affine +s11={function.angle_unit!r} +s22={function.angle_unit!r}")
    else:
        return None
    if unit != 1.0:
        after.append(f"+proj=unitconvert +xy_in={unit!r} +xy_out=m")
    head, *steps = re.split(r"\s+\+step\s+", text)
    if "+proj=pipeline" not in head.split():
        head, steps = "+proj=pipeline", [head]
    coefficients = " ".join(f"+s{i + 1}{j + 1}={float(matrix[i, j])!r}" for i, j in itertools.product((0, 1), (0, 1)))
    return " +step ".join([head, *before, *steps, *after, f"+proj=affine {coefficients}"])


def wkt_of(projection: Projection, matrix: FloatArray, name: str) -> tuple[str | None, str | None]:
    """WKT2 of a derived projected CRS in metres east and north; or None, and the reason why there is none.

    Its deriving conversion is EPSG's affine parametric transformation (method 9624). It is read
    back and compared with the map, so that what a CRS cannot hold is not passed over.
    """
    base = base_crs(projection)
    if base is None:
        return None, f"{projection.name} is no CRS, but a function or a pipeline."
    wkt = base.to_wkt("WKT2_2019")
    if not wkt.startswith("PROJCRS["):
        return None, f"{projection.name} is a {base.type_name}, from which no CRS can be derived."
    points = tried(projection)
    truth = matrix @ np.array(projection(*points))
    for axes in _native_axes(base):
        derived = _derived_wkt(wkt, matrix @ axes, name)
        try:
            found = Projection.from_user_input(derived)(*points)
        except ProjectionError as error:
            return None, str(error)
        if agree(projection, np.array(found), truth):
            return CRS.from_wkt(derived).to_wkt("WKT2_2019", pretty=True), None
    return None, f"PROJ's CRS of {projection.name} is another map: it loses a default or a step."


def parameters_of(projection: Projection, matrix: FloatArray) -> str | None:
    """The same map by the projection's own parameters, as k_0 or lat_ts, as a PROJ string; None where it has none.

    The coordinates agree to 1e-12 of their size and the Earth's, on a grid over the area of use.
    """
    tokens = _projecting_step(projection)
    if tokens is None or matrix[0, 1] or matrix[1, 0]:
        return None
    points = tried(projection)
    truth = matrix @ np.array(projection(*points))
    for changed in _changed_parameters(tokens, float(matrix[0, 0]), float(matrix[1, 1])):
        found = _scaled(changed, points, truth) if changed.get("k_0") == _OPEN else changed
        if found is None:
            continue
        coordinates = _coordinates(found, points)
        if coordinates is not None and agree(projection, coordinates, truth):
            return _text(found)
    return None


Parameters = dict[str, str | None]
_OPEN = "1"  # a scale that is still to be found


def _text(parameters: Parameters) -> str:
    return " ".join(f"+{key}" if value is None else f"+{key}={value}" for key, value in parameters.items())


def _coordinates(parameters: Parameters, points: tuple[FloatArray, FloatArray]) -> FloatArray | None:
    try:
        return np.array(Projection.from_user_input(_text(parameters))(*points))
    except ProjectionError:
        return None


def _scaled(parameters: Parameters, points: tuple[FloatArray, FloatArray], truth: FloatArray) -> Parameters | None:
    """The parameters with the k_0 for which the coordinates come nearest to the truth."""
    unscaled = _coordinates(parameters, points)
    if unscaled is None:
        return None
    origin = np.array([[float(parameters.get(key) or 0.0)] for key in ("x_0", "y_0")])
    both = np.isfinite(unscaled + truth).all(axis=0)
    f, t = (values[:, both] - origin for values in (unscaled, truth))
    return parameters | {"k_0": repr(float(np.sum(f * t) / np.sum(f * f)))} if f.any() else None


def tried(projection: Projection) -> tuple[FloatArray, FloatArray]:
    """Points of a grid over the area of use, or the globe."""
    west, south, east, north = projection.area_of_use or (-180.0, -90.0, 180.0, 90.0)
    width = east - west if east > west else east - west + 360.0
    return (west + width * _SHARES[0]).ravel(), (south + (north - south) * _SHARES[1]).ravel()


def same_coordinates(projection: Projection, other: Projection) -> bool:
    """Whether two projections have the same coordinates wherever both have any, on a grid of points."""
    points = tried(projection)
    return agree(projection, np.array(other(*points)), np.array(projection(*points)))


def agree(projection: Projection, found: FloatArray, truth: FloatArray) -> bool:
    """Whether two maps have the same coordinates wherever they have any, on a grid of points."""
    both = np.isfinite(truth) & np.isfinite(found)
    size = float(np.abs(truth[both]).max(initial=0.0))
    return bool(both.any() and np.abs(found - truth)[both].max() <= _SAME * (projection.ellipsoid.a + size))


def base_crs(projection: Projection) -> CRS | None:
    """The projected CRS, made anew for a PROJ string; that one may be another map."""
    if isinstance(projection.function, CrsOperation):
        return CRS.from_wkt(projection.function.crs)
    if not isinstance(projection.function, Pipeline) or "+proj=pipeline" in projection.function.pipeline:
        return None
    text = projection.function.pipeline
    for name, (key, value) in _LOST.items():
        if f"+proj={name}" in text.split() and f"+{key}=" not in text:
            text += f" +{key}={value}"
    if not _ELLIPSOIDS & {token.lstrip("+").partition("=")[0] for token in text.split()}:
        text += f" +ellps={_DEFAULT_ELLIPSOID}"
    try:
        return CRS.from_user_input(f"{text} +type=crs")
    except pyproj.exceptions.CRSError:
        return None


def _native_axes(crs: CRS) -> Iterator[FloatArray]:
    """Matrices from the CRS's own coordinates to metres, the likely ones first.

    PROJ applies the affine transformation to them in the order and the unit of the CRS; their
    directions alone do not tell which is which on polar maps.
    """
    u, v = (axis.unit_conversion_factor for axis in crs.axis_info[:2])
    for sign_u, sign_v in itertools.product((1.0, -1.0), repeat=2):
        yield np.array([[sign_u * u, 0.0], [0.0, sign_v * v]])
        yield np.array([[0.0, sign_v * v], [sign_u * u, 0.0]])


def _derived_wkt(base: str, coefficients: FloatArray, name: str) -> str:
    (a1, a2), (b1, b2) = coefficients.tolist()
    metre, one = 'LENGTHUNIT["metre",1]', 'SCALEUNIT["coefficient",1]'
    parameters = [
        f'PARAMETER["A0",0,{metre},ID["EPSG",8623]]',
        f'PARAMETER["A1",{a1!r},{one},ID["EPSG",8624]]',
        f'PARAMETER["A2",{a2!r},{one},ID["EPSG",8625]]',
        f'PARAMETER["B0",0,{metre},ID["EPSG",8639]]',
        f'PARAMETER["B1",{b1!r},{one},ID["EPSG",8640]]',
        f'PARAMETER["B2",{b2!r},{one},ID["EPSG",8641]]',
    ]
    method = 'METHOD["Affine parametric transformation",ID["EPSG",9624]]'
    quoted = name.replace('"', '""')
    return (
        f'DERIVEDPROJCRS["{quoted}",BASE{base},DERIVINGCONVERSION["Linear correction",{method},{",".join(parameters)}],'
        f'CS[Cartesian,2],AXIS["easting (E)",east,ORDER[1]],AXIS["northing (N)",north,ORDER[2]],{metre}]'
    )


def _projecting_step(projection: Projection) -> Parameters | None:
    """Parameters of the only step of a PROJ operation that is a map, or None."""
    function = projection.function
    if isinstance(function, Pipeline):
        text = function.pipeline
    elif isinstance(function, CrsOperation):
        text = function.transformer.definition
    else:
        return None
    found: list[Parameters] = []
    for step in re.split(r"(?:^|\s)\+?step\s", text):
        parameters: Parameters = {}
        for token in step.split():
            key, equals, value = token.lstrip("+").partition("=")
            parameters.setdefault(key, value if equals else None)
        if parameters.get("proj") not in _BESIDE | {"pipeline"}:
            found.append(parameters)
    if isinstance(function, CrsOperation) and function.greenwich:
        for parameters in found:
            # PROJ's paris is 0.2 mm from EPSG's, in grads; its rome, in seconds, is EPSG's but for the last bit.
            if abs(prime_meridian(parameters) - function.greenwich) > _SAME_MERIDIAN:
                parameters["pm"] = repr(function.greenwich)
    return found[0] if len(found) == 1 and "inv" not in found[0] else None


def _changed_parameters(tokens: Parameters, x: float, y: float) -> Iterator[Parameters]:
    """Parameters that may stretch the map by x and y along its axes."""
    if x == y == 1.0:
        yield dict(tokens)
    try:
        shifts: Parameters = {
            key: f"{float(tokens[key] or 0) * by!r}" for key, by in (("x_0", x), ("y_0", y)) if key in tokens
        }
        if x == y:
            tokens = _as_tmerc(tokens, x) if tokens["proj"] == "utm" else tokens | shifts
            if tokens["proj"] in _WITH_K_0:
                yield {key: value for key, value in tokens.items() if key not in _REPLACED} | {"k_0": _OPEN}
        elif tokens["proj"] in ("eqc", "cea"):
            parallel = math.cos(math.radians(float(tokens.get("lat_ts") or 0.0))) * x
            if parallel <= 1.0:
                yield tokens | shifts | {"lat_ts": repr(math.degrees(math.acos(parallel)))}
        elif tokens["proj"] == "hammer":
            yield tokens | shifts | {"M": repr(x * float(tokens.get("M") or 1.0))}
    except ValueError:
        return  # numbers in PROJ's other ways, as 30d


def _as_tmerc(tokens: Parameters, scale: float) -> Parameters:
    """The transverse Mercator map of a zone of UTM, its false origin scaled."""
    rest = {key: value for key, value in tokens.items() if key not in ("proj", "zone", "south")}
    north = 1e7 if "south" in tokens else 0.0
    meridian = 6 * int(tokens["zone"] or 0) - 183
    named = {"proj": "tmerc", "lon_0": f"{meridian}", "x_0": repr(5e5 * scale), "y_0": repr(north * scale)}
    return named | rest
