"""PROJ operations as functions of degrees, with their datums, grids and ellipsoids."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.errors import GridError, proj_reason
from projdist.support import tell

_AXES = [
    {"name": "Geodetic longitude", "abbreviation": "Lon", "direction": "east", "unit": "degree"},
    {"name": "Geodetic latitude", "abbreviation": "Lat", "direction": "north", "unit": "degree"},
]
_METHOD = re.compile(r'PROJCRS\[.*?\bMETHOD\["([^"]*)"', re.DOTALL)  # 100 times faster than by PROJ
_ROUNDED = 1e-9  # relative: digits of degrees that programs write
_IDENTITY = ("id", "ids", "$schema", "scope", "area", "bbox", "usages", "remarks")  # refer to the old axes


def geographic_base(crs: CRS) -> CRS | None:
    """A geographic CRS on a CRS's datum that `always_xy` turns into longitudes east, then geodetic latitudes."""
    # It is the geodetic CRS if that has such axes. Bodies of IAU_2015 have others (longitudes west, planetocentric
    # latitudes), which `always_xy` leaves as they are: PROJ converts between these and a new CRS of the same datum.
    geodetic = crs.geodetic_crs
    if geodetic is None or has_plain_axes(geodetic):
        return geodetic
    parts = {key: value for key, value in geodetic.to_json_dict().items() if key not in _IDENTITY}
    parts |= {
        "type": "GeographicCRS",
        "name": f"{geodetic.name}, longitudes east, geodetic latitudes",
        "coordinate_system": {"subtype": "ellipsoidal", "axis": _AXES},
    }
    return CRS.from_json_dict(parts)


def ellipsoid_of_crs(crs: CRS) -> Ellipsoid | None:
    """The ellipsoid of a CRS in metres; None where it states none."""
    if crs.ellipsoid is None:
        return None
    rf = crs.ellipsoid.inverse_flattening
    return Ellipsoid(crs.ellipsoid.semi_major_metre, 1.0 / rf if rf else 0.0)


def has_plain_axes(geodetic: CRS) -> bool:
    """True if `always_xy` turns the axes into longitudes east, then geodetic latitudes north."""
    directions = [axis.direction for axis in geodetic.axis_info[:2]]
    return geodetic.is_geographic and directions in (["north", "east"], ["east", "north"])


@dataclass(frozen=True)
class GeographicAxes:
    """How a CRS counts longitudes and latitudes: the default is in degrees from Greenwich."""

    greenwich: float = 0.0  # degrees from Greenwich, or the body's reference meridian, to the prime meridian
    per_degree: float = 1.0  # units per degree

    @classmethod
    def of(cls, geodetic: CRS) -> GeographicAxes:
        """The axes of a geodetic CRS."""
        meridian, axes = geodetic.prime_meridian, geodetic.axis_info
        factor = float(next((axis for axis in axes if axis.direction == "east"), axes[0]).unit_conversion_factor)
        greenwich = np.degrees(float(meridian.longitude) * float(meridian.unit_conversion_factor)) if meridian else 0.0
        in_degrees = math.isclose(factor, math.radians(1.0), rel_tol=_ROUNDED)
        return cls(float(greenwich), 1.0 if in_degrees else math.radians(1.0) / factor)

    def from_degrees(self, lon: Any, lat: Any) -> tuple[Any, Any]:
        """Coordinates of the CRS, longitude first, of Greenwich degrees."""
        if self.greenwich or self.per_degree != 1.0:
            lon, lat = (lon - self.greenwich) * self.per_degree, lat * self.per_degree
        return lon, lat

    def to_degrees(self, lon: Any, lat: Any) -> tuple[Any, Any]:
        """Greenwich degrees of coordinates of the CRS, longitude first."""
        return lon / self.per_degree + self.greenwich, lat / self.per_degree


# ---- operation ellipsoids ------------------------------------------------------------------------


# With e^2 to PROJ's digits.
_BESSEL = Ellipsoid(6377397.155, 1.0 - math.sqrt(1.0 - 0.006674372230614))
_INTERNATIONAL = Ellipsoid(6378388.0, 1.0 / 297.0)
_CLARKE_1866 = Ellipsoid(6378206.4, 1.0 - math.sqrt(1.0 - 0.00676866))
_CLARKE_SPHERE = Ellipsoid(6370997.0)  # same area as Clarke 1866

_ALWAYS = {"krovak": _BESSEL, "mod_krovak": _BESSEL, "nzmg": _INTERNATIONAL}
_OF_TWO = ("alsk", "gs50")  # one figure for spheres, another for ellipsoids
OWN_ELLIPSOIDS = frozenset([*_ALWAYS, *_OF_TWO, "gs48"])
"""Operations for which PROJ ignores the stated ellipsoid or its size."""
SPHERICAL = ("gs48", "lee_os", "mil_os")
"""Maps of a sphere. On ellipsoids PROJ uses conformal latitudes except for the centre: another conformal map."""

_PARAMETERS = {_BESSEL: "+ellps=bessel", _INTERNATIONAL: "+ellps=intl", _CLARKE_1866: "+ellps=clrk66"}
_SAME = 1e-6  # of size and flattening: interchangeable ellipsoids differ by less


def operation_ellipsoid(operation: str, stated: Ellipsoid, *, warn: bool = False) -> Ellipsoid:
    """The ellipsoid that PROJ uses for an operation if `stated` is asked for; `warn` gives a notice if they differ."""
    used = _ALWAYS.get(operation, stated)
    if operation in _OF_TWO:
        used = _CLARKE_SPHERE if stated.is_sphere else _CLARKE_1866
    elif operation == "gs48":  # of one size
        used = Ellipsoid(_CLARKE_SPHERE.a, stated.f)
    if warn and (abs(used.a / stated.a - 1.0) > _SAME or abs(used.f - stated.f) > _SAME):
        tell(f"PROJ draws {operation} on a figure of its own, {ellipsoid_parameters(used)}; it is measured on that.")
    return used


def ellipsoid_parameters(figure: Ellipsoid) -> str:
    """PROJ parameters of an ellipsoid."""
    if figure.is_sphere:
        return f"+R={figure.a:.12g}"
    return _PARAMETERS.get(figure, f"+a={figure.a:.12g} +rf={1.0 / figure.f:.12g}")


# PROJ's words for PROJ_ERR_OTHER_NETWORK_ERROR and PROJ_ERR_INVALID_OP_FILE_NOT_FOUND_OR_INVALID.
_UNREAD = re.compile(r"network error|file not found", re.IGNORECASE)
_ASKED = 300  # undefined points to ask PROJ about: 20 ms


def check_grids(transformer: Transformer, given: tuple[FloatArray, FloatArray], found: FloatArray) -> None:
    """Raise GridError if a point has no coordinates because PROJ could not read a grid."""
    # PROJ fetches a grid at the first point that needs it, and returns infinity if it cannot. Points may be undefined
    # for other reasons, so PROJ is asked for the reason at up to 300 of them, evenly spaced.
    lost = np.flatnonzero(np.isfinite(given[0]) & np.isfinite(given[1]) & ~np.isfinite(found))
    asked = lost[np.unique(np.linspace(0, lost.size - 1, min(lost.size, _ASKED)).astype(int))]
    for u, v in zip(*(values.ravel()[asked].tolist() for values in given), strict=True):
        try:
            transformer.transform(u, v, errcheck=True)
        except pyproj.exceptions.ProjError as error:
            if _UNREAD.search(str(error)):
                reason = proj_reason(error).removeprefix("transform error: ")
                raise GridError(
                    f"Invalid coordinates. PROJ cannot read a grid that they need: {reason}. Fetch it with 'projsync', "
                    "or set PROJ_NETWORK=OFF to do without."
                ) from error


# ---- operations ----------------------------------------------------------------------------------


Function = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


class Parts(NamedTuple):
    """The fields of `Projection`, in their order."""

    name: str
    definition: str
    ellipsoid: Ellipsoid
    function: Function
    area_of_use: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Pipeline:
    """The operation of a PROJ string from Greenwich degrees to metres."""

    definition: str
    to_metre: float

    @functools.cached_property
    def transformer(self) -> Transformer:
        """PROJ's operation; raises pyproj's ProjError."""
        return Transformer.from_pipeline(self.definition)

    @property
    def reads_grids(self) -> bool:
        """True if a step needs a grid, which may be missing."""
        return "grids=" in self.definition

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres, inf where undefined."""
        x, y = transform(self.transformer, lon, lat)
        if self.reads_grids:
            check_grids(self.transformer, (lon, lat), x)
        if self.to_metre != 1.0:
            x, y = x * self.to_metre, y * self.to_metre
        return x, y


@dataclass(frozen=True)
class CrsOperation:
    """The operation of a projected CRS from Greenwich degrees to metres east and north."""

    crs: str
    angles: GeographicAxes  # of its `geographic_base`
    axes: tuple[tuple[float, float], tuple[float, float]]  # (east, north) in metres per unit of each CRS axis
    method: str  # the name of the method of its conversion, "" for derived CRSs

    @functools.cached_property
    def transformer(self) -> Transformer:
        """PROJ's operation; raises pyproj's ProjError."""
        crs = CRS.from_wkt(self.crs)
        return Transformer.from_crs(geographic_base(crs), crs, always_xy=True)

    @property
    def definition(self) -> str:
        """The PROJ string from coordinates of the geographic base to those of the CRS."""
        return " ".join(f"+{token}" for token in self.transformer.definition.split())

    @classmethod
    def of(cls, crs: CRS, base: CRS) -> CrsOperation:
        """The operation of a projected CRS from its `geographic_base`; raises pyproj's ProjError."""
        axes = [(axis.direction, axis.unit_conversion_factor) for axis in crs.axis_info[:2]]
        if [direction for direction, _ in axes] == ["north", "east"]:
            axes.reverse()  # as always_xy does
        (first, u), (second, v) = axes
        matrix = ((u, 0.0), (0.0, v))  # also of polar maps, whose axes both point along meridians
        sign = {"east": 1.0, "north": 1.0, "west": -1.0, "south": -1.0}
        if first in ("north", "south") and second in ("east", "west"):
            matrix = ((0.0, sign[second] * v), (sign[first] * u, 0.0))
        elif first in ("east", "west") and second in ("north", "south"):
            matrix = ((sign[first] * u, 0.0), (0.0, sign[second] * v))
        wkt = crs.to_wkt()
        method = _METHOD.match(wkt)
        made = cls(wkt, GeographicAxes.of(base), matrix, method[1] if method else "")
        if crs.type_name == "Projected CRS":  # a derived one has other axes in memory than in its WKT
            # Twice as fast as from WKT. For a few CRSs PROJ's database has several operations, some with datum
            # transformations, and picks one at the first point; these keep the WKT, which has the conversion only.
            transformer = Transformer.from_crs(base, crs, always_xy=True)
            if transformer.definition.startswith("proj="):
                made.__dict__["transformer"] = transformer
        return made

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres; inf where undefined."""
        u, v = self.native(lon, lat)
        if self.axes == ((1.0, 0.0), (0.0, 1.0)):
            return u, v
        (xu, xv), (yu, yv) = self.axes
        return (xu * u if xv == 0.0 else xv * v), (yv * v if yu == 0.0 else yu * u)

    def native(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The CRS's own coordinates in its own unit, in GIS order (x, y); inf where undefined."""
        return transform(self.transformer, *self.angles.from_degrees(lon, lat))

    def inverse(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees of the CRS's own coordinates in the order of `native`; inf where undefined."""
        # PROJ also answers for some points outside the map: only those that `native` takes back to u, v are on it.
        return self.angles.to_degrees(*transform(self.transformer, u, v, direction=TransformDirection.INVERSE))


def transform(
    transformer: Transformer,
    lon: FloatArray,
    lat: FloatArray,
    *,
    radians: bool = False,
    direction: TransformDirection = TransformDirection.FORWARD,
) -> tuple[FloatArray, FloatArray]:
    """The transformer's output at points of any one shape; inf where undefined."""
    # inplace saves pyproj's copies; errcheck is off, so that one bad point (inf) does not lose the others.
    x = np.array(lon, dtype=float, order="C", ndmin=1)
    y = np.array(lat, dtype=float, order="C", ndmin=1)
    transformer.transform(x, y, inplace=True, radians=radians, errcheck=False, direction=direction)
    return x.reshape(lon.shape), y.reshape(lon.shape)
