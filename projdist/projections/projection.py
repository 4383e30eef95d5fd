"""The value type of a map projection."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike
from pyproj import CRS, Proj

from projdist._typing import FloatArray
from projdist.earth import SPHERE, Ellipsoid
from projdist.projections.bodies import Body, body_in
from projdist.projections.errors import ProjectionError
from projdist.projections.inputs import parse
from projdist.projections.operations import CrsOperation, Function, Pipeline

_FARTHEST = 1e10  # radii; the gnomonic map reaches as far. PROJ gives larger numbers beyond the reach of some maps
_LONGEST_LABEL = 60  # characters


@dataclass(frozen=True)
class Projection:
    """A map from longitude and latitude to the plane, and the ellipsoid that it maps.

    Call it with degrees: `x, y = projection(lon, lat)`, in metres, NaN where the map is not
    defined. Make one with `Projection.from_user_input`, which takes anything that names a
    projection, or `Projection.from_function`.
    """

    name: str
    definition: str
    ellipsoid: Ellipsoid
    function: Function = field(repr=False)
    area_of_use: tuple[float, float, float, float] | None = None

    @property
    def label(self) -> str:
        """The definition, or, where that is long as WKT is, the name."""
        return self.definition if len(self.definition) <= _LONGEST_LABEL else self.name

    @property
    def is_of_another_body(self) -> bool:
        """Whether its figure is that of a planet, a moon or the like, by its size."""
        return self.ellipsoid.is_of_another_body

    @property
    def body(self) -> Body:
        """The body that it is a map of, by the name that its CRS has for it."""
        operation = self.function
        is_named = self.is_of_another_body and isinstance(operation, CrsOperation)
        return Body(self.ellipsoid, body_in(cast(CrsOperation, operation).crs) if is_named else "")

    @property
    def answers_everywhere(self) -> bool:
        """Whether any place may be asked for: PROJ tells where it has none; functions, and grids to read, may fail."""
        operation = self.function
        return isinstance(operation, CrsOperation) or (isinstance(operation, Pipeline) and not operation.reads_grids)

    def __call__(self, lon: ArrayLike, lat: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Coordinates x, y in metres of points in degrees; the shape is that of lon and lat broadcast."""
        lon, lat = np.broadcast_arrays(np.asarray(lon, dtype=float), np.asarray(lat, dtype=float))
        returned = self.function(lon, lat)
        try:
            x, y = (np.asarray(value, dtype=float) for value in returned)
        except (TypeError, ValueError) as error:
            raise ProjectionError(
                f"Invalid projection function '{self.name}'. It must return x and y, two arrays."
            ) from error
        if x.shape != lon.shape or y.shape != lon.shape:
            raise ProjectionError(
                f"Invalid projection function '{self.name}'. It must return x and y of the shape {lon.shape} of its "
                f"arguments, not {x.shape} and {y.shape}."
            )
        farthest = _FARTHEST * self.ellipsoid.a
        if _reach(x) + _reach(y) < farthest:  # and none is NaN
            return x, y
        undefined = ~(np.abs(x) + np.abs(y) < farthest)
        return np.where(undefined, np.nan, x), np.where(undefined, np.nan, y)

    @classmethod
    def from_user_input(cls, value: ProjectionLike) -> Projection:
        """A projection from a name, PROJ string, CRS code, WKT, PROJJSON, file, pyproj CRS or function.

        A bare name is the textbook map on the sphere of the Earth's mean radius. Raises
        ProjectionError, in one line, for what is none of these or has no plane.
        """
        if isinstance(value, Projection):
            return value
        if callable(value) and not isinstance(value, Proj):  # pyproj's own can be called, too
            return cls.from_function(value)
        return cls(*parse(value))

    @classmethod
    def from_function(
        cls, function: Callable[..., tuple[Any, Any]], *, name: str | None = None, ellipsoid: Ellipsoid = SPHERE
    ) -> Projection:
        """A projection from a function of arrays (lon, lat) in degrees that returns (x, y) in metres."""
        if not callable(function):
            raise ProjectionError(f"Invalid projection function '{function}'. It must be callable with (lon, lat).")
        label = str(name or getattr(function, "__name__", type(function).__name__))
        return cls(label, label, ellipsoid, cast(Function, function))


def _reach(values: FloatArray) -> float:
    """The largest of the values, either way, without arrays that are only for this; NaN if any is."""
    return max(float(values.max()), -float(values.min())) if values.size else 0.0


class HasWkt(Protocol):
    """What has well-known text, as CRSs of rasterio have."""

    def to_wkt(self) -> str:
        """The text."""


ProjectionLike = (
    str
    | Projection
    | os.PathLike[str]
    | CRS
    | Proj
    | HasWkt
    | Callable[..., tuple[Any, Any]]
    | Mapping[str, Any]
    | tuple[str, int | str]
    | int
)
"""What a projection may be given as.

A text (a name, a PROJ string or pipeline, a code such as EPSG:3035, the name of a CRS, WKT, PROJJSON, a path), the
path of a .prj or .wkt file, pyproj's CRS or Proj or what has WKT, a function of (lon, lat) in degrees, a dictionary of
PROJ's parameters or of PROJJSON, an authority and a code, EPSG's number; or a `Projection`.
"""
