"""CRSs that are a projection followed by operations of PROJ, in the forms that PROJ and GDAL run."""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import pyproj.exceptions
from pyproj import CRS

from projdist._typing import FloatArray
from projdist.projections.definitions import crs_wkt
from projdist.projections.errors import ProjectionError
from projdist.projections.operations import CrsOperation
from projdist.projections.projection import Projection

__all__ = ["AreaOfUse", "DerivedCrs", "derived_crs"]

_METHOD = "PROJ-based operation method: {}"
_SCOPE = "Maps of the area with little distortion."
_DECIMALS = 6  # of degrees: a tenth of a metre


class AreaOfUse(NamedTuple):
    """The area that a CRS is for: its name, and west, south, east, north in degrees."""

    name: str
    bounds: tuple[float, float, float, float]

    def stated_in(self, crs: CRS) -> CRS:
        """The CRS with this area of use."""
        west, south, east, north = self.bounds
        if east - west >= 360.0:
            west, east = -180.0, 180.0
        sides = {
            "south_latitude": south,
            "west_longitude": _usual(west),
            "north_latitude": north,
            "east_longitude": _usual(east),
        }
        parts = crs.to_json_dict() | {"scope": _SCOPE, "area": self.name}
        return CRS.from_json_dict(parts | {"bbox": {name: round(side, _DECIMALS) for name, side in sides.items()}})


def _usual(longitude: float) -> float:
    """A longitude within half a turn of Greenwich."""
    return longitude if abs(longitude) <= 180.0 else (longitude + 180.0) % 360.0 - 180.0


@dataclass(frozen=True)
class DerivedCrs:
    """A CRS as text: a PROJ pipeline from degrees, and WKT2.

    `wkt` is a projected CRS whose conversion is the pipeline, which programs take for what it is; `wkt_derived` one
    that is derived from the CRS of the base, which it names.
    """

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
        """Longitudes and latitudes in degrees of coordinates; infinite where there are none."""
        operation = self.projection.function
        assert isinstance(operation, CrsOperation)  # as that of any CRS
        return operation.inverse(x, y)


def derived_crs(
    base: Projection, steps: Sequence[str], name: str, area: AreaOfUse, *, geodetic: str | None = None
) -> DerivedCrs:
    """The CRS of a PROJ string followed by operations on its metres east and north, for an area.

    It is based on the geographic CRS `geodetic`, as by `crs_wkt`. Raises ProjectionError for a base that is no CRS.
    """
    text, reason = crs_wkt(base, f"{name}, base", geodetic=geodetic)
    if text is None:
        raise ProjectionError(f"Invalid base '{base.label}'. {reason}")
    plain = CRS.from_wkt(text)
    words = [
        f"+{word.lstrip('+')}" for word in base.definition.split() if word.lstrip("+") not in ("type=crs", "no_defs")
    ]
    operations = " +step ".join([" ".join(words), *steps])
    degrees = "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad"
    return DerivedCrs(
        pipeline=f"{degrees} +step {operations}",
        wkt=_wkt(area.stated_in(_projected(plain, f"+proj=pipeline +step {operations}", name))),
        wkt_derived=_wkt(area.stated_in(_derived(plain, steps, name))),
    )


def _projected(base: CRS, pipeline: str, name: str) -> CRS:
    """A projected CRS whose conversion is a pipeline."""
    parts: dict[str, Any] = base.to_json_dict()
    parts["name"] = name
    parts["conversion"] = {"name": name, "method": {"name": _METHOD.format(pipeline)}, "parameters": []}
    return CRS.from_json_dict(parts)


def _derived(base: CRS, steps: Sequence[str], name: str) -> CRS:
    """A CRS derived from the base's."""
    method = steps[0] if len(steps) == 1 else f"+proj=pipeline {' '.join(f'+step {step}' for step in steps)}"
    quoted, metre = name.replace('"', '""'), 'LENGTHUNIT["metre",1]'
    text = (
        f'DERIVEDPROJCRS["{quoted}",BASE{base.to_wkt("WKT2_2019")},'
        f'DERIVINGCONVERSION["correction",METHOD["{_METHOD.format(method)}"]],'
        f'CS[Cartesian,2],AXIS["easting (E)",east,ORDER[1]],AXIS["northing (N)",north,ORDER[2]],{metre}]'
    )
    try:
        return CRS.from_wkt(text)
    except pyproj.exceptions.CRSError as error:
        raise ProjectionError(f"Invalid correction of '{name}'. PROJ cannot derive it from its base.") from error


def _wkt(crs: CRS) -> str:
    return str(crs.to_wkt("WKT2_2019", pretty=True))
