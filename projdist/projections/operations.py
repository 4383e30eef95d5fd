"""PROJ's operations as functions of degrees; picklable, hashable and safe to share between threads."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pyproj import CRS, Transformer
from pyproj.enums import TransformDirection

from projdist._typing import FloatArray
from projdist.earth import Ellipsoid
from projdist.projections.datums import geographic_base
from projdist.projections.grids import check_grids

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
