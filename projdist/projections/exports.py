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
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import CrsOperation, Pipeline
from projdist.projections.projection import Projection

_SAME = 1e-12  # of the semi-major axis: rounding of coordinates and of parameters
_TRIED = tuple(axis.ravel() for axis in np.meshgrid(np.arange(-170.0, 180.0, 20.0), np.arange(-80.0, 85.0, 10.0)))
_WITH_K_0 = frozenset("merc tmerc etmerc stere sterea lcc somerc omerc krovak labrd gstmerc".split())


def pipeline_of(projection: Projection, matrix: FloatArray) -> str | None:
    """The PROJ pipeline from Greenwich degrees to `matrix` times the coordinates in metres; None for functions."""
    function, before = projection.function, []
    if isinstance(function, Pipeline):
        text, matrix = function.pipeline, matrix * function.to_metre
    elif isinstance(function, CrsOperation):
        text = " ".join(f"+{token}" for token in function.transformer.definition.split())
        matrix = matrix @ np.array(function.axes)
        if function.greenwich:
            before.append(f"+proj=affine +xoff={-function.greenwich!r}")
        if function.angle_unit != 1.0:
            before.append(f"+proj=affine +s11={function.angle_unit!r} +s22={function.angle_unit!r}")
    else:
        return None
    head, *steps = re.split(r"\s+\+step\s+", text)
    if "+proj=pipeline" not in head.split():
        head, steps = "+proj=pipeline", [head]
    coefficients = " ".join(f"+s{i + 1}{j + 1}={float(matrix[i, j])!r}" for i, j in itertools.product((0, 1), (0, 1)))
    return " +step ".join([head, *before, *steps, f"+proj=affine {coefficients}"])


def wkt_of(projection: Projection, matrix: FloatArray, name: str) -> tuple[str | None, str | None]:
    """WKT2 of a derived projected CRS in metres east and north; or None, and the reason why there is none.

    Its deriving conversion is EPSG's affine parametric transformation (method 9624). It is read
    back and compared with the map, so that what a CRS cannot hold is not passed over.
    """
    base = _base_crs(projection)
    if base is None:
        return None, f"{projection.name} is no CRS, but a function or a pipeline."
    wkt = base.to_wkt("WKT2_2019")
    if not wkt.startswith("PROJCRS["):
        return None, f"{projection.name} is a {base.type_name}, from which no CRS can be derived."
    truth = matrix @ np.array(projection(*_TRIED))
    for axes in _native_axes(base):
        derived = _derived_wkt(wkt, matrix @ axes, name)
        try:
            found = Projection.from_user_input(derived)(*_TRIED)
        except ProjectionError as error:
            return None, str(error)
        if _agree(projection, np.array(found), truth):
            return CRS.from_wkt(derived).to_wkt("WKT2_2019", pretty=True), None
    return None, f"PROJ's CRS of {projection.name} is another map: it loses a default or a step."


def parameters_of(projection: Projection, matrix: FloatArray) -> str | None:
    """The same map by the projection's own parameters, k_0 or lat_ts, as a PROJ string; None where it has none."""
    tokens = _single_step(projection)
    if tokens is None or matrix[0, 1] or matrix[1, 0]:
        return None
    truth = matrix @ np.array(projection(*_TRIED))
    for changed in _changed_parameters(tokens, float(matrix[0, 0]), float(matrix[1, 1])):
        text = " ".join(f"+{key}" if value is None else f"+{key}={value}" for key, value in changed.items())
        try:
            found = Projection.from_user_input(text)(*_TRIED)
        except ProjectionError:
            continue
        if _agree(projection, np.array(found), truth):
            return text
    return None


def _agree(projection: Projection, found: FloatArray, truth: FloatArray) -> bool:
    """Whether two maps have the same coordinates wherever they have any, on a grid of points."""
    both = np.isfinite(truth) & np.isfinite(found)
    size = float(np.abs(truth[both]).max(initial=0.0))
    return bool(both.any() and np.abs(found - truth)[both].max() <= _SAME * (projection.ellipsoid.a + size))


def _base_crs(projection: Projection) -> CRS | None:
    """The projected CRS, made anew for a PROJ string."""
    if isinstance(projection.function, CrsOperation):
        return CRS.from_wkt(projection.function.crs)
    if not isinstance(projection.function, Pipeline) or "+proj=pipeline" in projection.function.pipeline:
        return None
    try:
        return CRS.from_user_input(f"{projection.function.pipeline} +type=crs")
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


def _single_step(projection: Projection) -> dict[str, str | None] | None:
    """Parameters of a PROJ operation that is all of the projection, or None."""
    function = projection.function
    if isinstance(function, Pipeline) and function.to_metre == 1.0:
        text = function.pipeline
    elif isinstance(function, CrsOperation):
        text = re.sub(
            r"^proj=pipeline step proj=unitconvert xy_in=deg xy_out=rad step ", "", function.transformer.definition
        )
    else:
        return None
    parameters: dict[str, str | None] = {}
    for token in text.split():
        key, equals, value = token.lstrip("+").partition("=")
        parameters.setdefault(key, value if equals else None)
    return None if "step" in parameters or parameters.get("proj") == "pipeline" else parameters


def _changed_parameters(tokens: dict[str, str | None], x: float, y: float) -> Iterator[dict[str, str | None]]:
    """Parameters that may stretch the map by x and y along its axes."""
    name = tokens["proj"]
    shifts = {key: f"{float(tokens[key] or 0) * by!r}" for key, by in (("x_0", x), ("y_0", y)) if key in tokens}
    if name in _WITH_K_0 and x == y:
        k = float(tokens.get("k_0") or tokens.get("k") or 1.0)
        yield {key: value for key, value in tokens.items() if key != "k"} | shifts | {"k_0": repr(k * x)}
    if name in ("eqc", "cea"):
        parallel = math.cos(math.radians(float(tokens.get("lat_ts") or 0.0))) * x
        if parallel <= 1.0:
            yield tokens | shifts | {"lat_ts": repr(math.degrees(math.acos(parallel)))}
