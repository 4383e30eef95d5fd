"""PROJ's operations as functions of degrees, with their datums, grids and figures of the Earth."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyproj.exceptions
from pyproj import CRS, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.errors import GridError, proj_reason
from projdist.support import tell

_GIVES_LONGITUDE_FIRST = (["north", "east"], ["east", "north"])
_AXES = [
    {"name": "Geodetic longitude", "abbreviation": "Lon", "direction": "east", "unit": "degree"},
    {"name": "Geodetic latitude", "abbreviation": "Lat", "direction": "north", "unit": "degree"},
]
_ROUNDED = 1e-9  # relative: degrees to the digits that programs write
_IDENTITY = ("id", "ids", "$schema", "scope", "area", "bbox", "usages", "remarks")  # are of the axes as they were


def geographic_base(crs: CRS) -> CRS | None:
    """The geographic CRS of a CRS's datum, which with `always_xy` has longitudes east first, then geodetic latitudes.

    That is its geodetic CRS where it has such axes. The bodies of IAU_2015 have others: `always_xy` leaves longitudes
    that are positive west, and planetocentric latitudes, where and as they are. Then it is one of the same datum in
    degrees, between which and the CRS PROJ converts.
    """
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
    """Whether `always_xy` makes of a geodetic CRS's axes longitudes east, then geodetic latitudes north."""
    return geodetic.is_geographic and [axis.direction for axis in geodetic.axis_info[:2]] in _GIVES_LONGITUDE_FIRST


def greenwich_offset(crs: CRS) -> float:
    """Degrees from Greenwich, or the prime meridian of another body, to the CRS's own."""
    meridian = crs.prime_meridian
    return float(np.degrees(float(meridian.longitude) * float(meridian.unit_conversion_factor))) if meridian else 0.0


def units_per_degree(geodetic: CRS) -> float:
    """Units of the CRS's longitudes in a degree."""
    east = next((axis for axis in geodetic.axis_info if axis.direction == "east"), geodetic.axis_info[0])
    factor = float(east.unit_conversion_factor)
    return 1.0 if math.isclose(factor, math.radians(1.0), rel_tol=_ROUNDED) else math.radians(1.0) / factor


# ---- figures -------------------------------------------------------------------------------------


# Each with the digits of e^2 that PROJ has.
_BESSEL = Ellipsoid(6377397.155, 1.0 - math.sqrt(1.0 - 0.006674372230614))
_INTERNATIONAL = Ellipsoid(6378388.0, 1.0 / 297.0)
_CLARKE_1866 = Ellipsoid(6378206.4, 1.0 - math.sqrt(1.0 - 0.00676866))
_CLARKE_SPHERE = Ellipsoid(6370997.0)  # of the area of Clarke 1866

_ALWAYS = {"krovak": _BESSEL, "mod_krovak": _BESSEL, "nzmg": _INTERNATIONAL}
_OF_TWO = ("alsk", "gs50")  # one for a sphere, and one for an ellipsoid
_OF_ONE_SIZE = "gs48"
# Maps of a sphere. PROJ puts conformal latitudes for theirs, but leaves the centre's: another map, conformal, too.
_SPHERICAL = ("gs48", "lee_os", "mil_os")

_PARAMETERS = {_BESSEL: "+ellps=bessel", _INTERNATIONAL: "+ellps=intl", _CLARKE_1866: "+ellps=clrk66"}
_SAME = 1e-6  # of size and flattening: ellipsoids that people take for one another differ by less


def operation_ellipsoid(operation: str, stated: Ellipsoid) -> Ellipsoid:
    """The figure on which PROJ has an operation where a figure is stated."""
    if operation in _OF_TWO:
        return _CLARKE_SPHERE if stated.is_sphere else _CLARKE_1866
    if operation == _OF_ONE_SIZE:
        return Ellipsoid(_CLARKE_SPHERE.a, stated.f)
    return _ALWAYS.get(operation, stated)


def has_own_ellipsoid(operation: str) -> bool:
    """Whether PROJ passes over the figure that is stated, or its size."""
    return operation in (*_ALWAYS, *_OF_TWO, _OF_ONE_SIZE)


def ellipsoid_parameters(figure: Ellipsoid) -> str:
    """PROJ's parameters of a figure."""
    if figure.is_sphere:
        return f"+R={figure.a:.12g}"
    return _PARAMETERS.get(figure, f"+a={figure.a:.12g} +rf={1.0 / figure.f:.12g}")


def tell_of_ellipsoid(operation: str, stated: Ellipsoid) -> None:
    """Tell that a map is measured on a figure of its own, where that is not the stated one."""
    figure = operation_ellipsoid(operation, stated)
    if abs(figure.a / stated.a - 1.0) > _SAME or abs(figure.f - stated.f) > _SAME:
        tell(f"PROJ draws {operation} on a figure of its own, {ellipsoid_parameters(figure)}; it is measured on that.")


def tell_of_sphere(operation: str, stated: Ellipsoid) -> None:
    """Tell that a map of the sphere was asked for on an ellipsoid, where PROJ has another map."""
    if operation in _SPHERICAL and not stated.is_sphere:
        tell(f"PROJ's {operation} is a map of the sphere; what it draws on an ellipsoid is another map.")


# ---- grids ---------------------------------------------------------------------------------------


# PROJ's words for PROJ_ERR_OTHER_NETWORK_ERROR and PROJ_ERR_INVALID_OP_FILE_NOT_FOUND_OR_INVALID.
_UNREAD = re.compile(r"network error|file not found", re.IGNORECASE)
_ASKED = 300  # of the points that are lost: 20 ms


def check_grids(
    transformer: Transformer,
    given: tuple[FloatArray, FloatArray],
    found: FloatArray,
    direction: TransformDirection = TransformDirection.FORWARD,
) -> None:
    """Raise GridError where a point has no coordinates, and PROJ says that it could not read a grid for it.

    PROJ fetches grids at the first point that needs them, and gives infinity where it cannot. Others may be lost for
    other reasons: up to 300 of them, one as far from the next as from the one before, are asked for theirs.
    """
    lost = np.flatnonzero(np.isfinite(given[0]) & np.isfinite(given[1]) & ~np.isfinite(found))
    asked = lost[np.unique(np.linspace(0, lost.size - 1, min(lost.size, _ASKED)).astype(int))]
    for u, v in zip(*(values.ravel()[asked].tolist() for values in given), strict=True):
        try:
            transformer.transform(u, v, errcheck=True, direction=direction)
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
    """What a projection consists of, in the order of the fields of `Projection`."""

    name: str
    definition: str
    ellipsoid: Ellipsoid
    function: Function
    area_of_use: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Pipeline:
    """The operation of a PROJ string from Greenwich degrees to metres."""

    pipeline: str
    to_metre: float

    @functools.cached_property
    def transformer(self) -> Transformer:
        """PROJ's operation; raises pyproj's ProjError."""
        return Transformer.from_pipeline(self.pipeline)

    @property
    def reads_grids(self) -> bool:
        """Whether steps of it need a grid, which may be missing."""
        return "grids=" in self.pipeline

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
    greenwich: float  # degrees from Greenwich to the CRS's prime meridian
    angle_unit: float  # CRS angle units per degree
    axes: tuple[tuple[float, float], tuple[float, float]]  # (east, north) in metres per unit of each CRS axis

    @functools.cached_property
    def transformer(self) -> Transformer:
        """PROJ's operation; raises pyproj's ProjError."""
        return _forward(CRS.from_wkt(self.crs))

    def prepare(self, crs: CRS) -> None:
        """Make the transformer from the CRS itself, at half the cost of its WKT; raises pyproj's ProjError.

        For a few CRSs PROJ's database has several operations, with shifts of datum among them, of
        which it takes one at the first point. The WKT knows the conversion only.
        """
        transformer = _forward(crs)
        if transformer.definition.startswith("proj="):
            self.__dict__["transformer"] = transformer

    def __call__(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x, y in metres, inf where undefined."""
        u, v = self.native(lon, lat)
        if self.axes == ((1.0, 0.0), (0.0, 1.0)):
            return u, v
        (xu, xv), (yu, yv) = self.axes
        x, y = (xu * u if xv == 0.0 else xv * v), (yv * v if yu == 0.0 else yu * u)
        return x, y

    def native(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The CRS's own coordinates in its own unit, in the order that GIS programs have them; inf where undefined."""
        return transform(self.transformer, *self.geodetic(lon, lat))

    def geodetic(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the CRS's `geographic_base`, longitude first, of Greenwich degrees."""
        if self.greenwich or self.angle_unit != 1.0:
            lon, lat = (lon - self.greenwich) * self.angle_unit, lat * self.angle_unit
        return lon, lat

    def degrees(self, lon: FloatArray, lat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees of coordinates of the CRS's `geographic_base`, longitude first."""
        return lon / self.angle_unit + self.greenwich, lat / self.angle_unit

    def inverse(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Greenwich degrees of the CRS's own coordinates, as `native` has them; inf where undefined.

        PROJ answers for some points outside the map, too: only what `native` takes back to u, v is on it.
        """
        return self.degrees(*transform(self.transformer, u, v, direction=TransformDirection.INVERSE))


def _forward(crs: CRS) -> Transformer:
    return Transformer.from_crs(geographic_base(crs), crs, always_xy=True)


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
