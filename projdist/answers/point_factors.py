"""The distortion of a map at points."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from projdist import regions, support
from projdist._typing import AnyArray, FloatArray
from projdist.field import Quality, check_declared_property, derivatives, measure_at, named_measures
from projdist.matrices import Measure, factors_of
from projdist.projections import FrameLike, Projection, ProjectionLike, add_columns, is_frame, places


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Factors(support.Answer):
    """Distortion at points: arrays of one shape, NaN where undefined.

    `quality` holds the labels of `Quality`; `error` is the estimated relative error of the Jacobian; `extra` are the
    further measures by name.
    """

    projection: Projection = field(
        metadata=support.schema(
            of={"projection": "definition", "name": "name", "definition": "definition"}, spread=True
        )
    )
    lon: FloatArray = field(metadata=support.COLUMN)
    lat: FloatArray = field(metadata=support.COLUMN)
    x: FloatArray = field(metadata=support.COLUMN)
    y: FloatArray = field(metadata=support.COLUMN)
    h: FloatArray = field(metadata=support.COLUMN)
    k: FloatArray = field(metadata=support.COLUMN)
    a: FloatArray = field(metadata=support.COLUMN)
    b: FloatArray = field(metadata=support.COLUMN)
    s: FloatArray = field(metadata=support.COLUMN)
    omega: FloatArray = field(metadata=support.COLUMN)
    theta: FloatArray = field(metadata=support.COLUMN)
    convergence: FloatArray = field(metadata=support.COLUMN)
    fisher: FloatArray = field(metadata=support.COLUMN)
    quality: np.typing.NDArray[np.str_] = field(metadata=support.COLUMN)
    extra: dict[str, FloatArray] = field(metadata=support.schema(column=True, spread=True))
    error: FloatArray = field(metadata=support.HIDDEN)
    jacobian: FloatArray = field(metadata=support.HIDDEN)

    def _line(self) -> str:
        return f"{self.projection.name} at {self.lon.size} points"

    def columns(self) -> dict[str, AnyArray]:
        """x, y, the measures and the quality by name, each of shape (n,), as they are added to a frame of points."""
        return {name: values for name, values in self._table().items() if name not in ("lon", "lat")}


_AnyFrame = TypeVar("_AnyFrame", bound=FrameLike)


@overload
def factors(
    projection: ProjectionLike, lon: ArrayLike, lat: ArrayLike, *, measures: Iterable[str | Measure] = ()
) -> Factors: ...


@overload
def factors(
    projection: ProjectionLike, lon: _AnyFrame, *, measures: Iterable[str | Measure] = (), prefix: str = ""
) -> _AnyFrame: ...


def factors(
    projection: ProjectionLike, lon: Any, lat: Any = None, *, measures: Iterable[str | Measure] = (), prefix: str = ""
) -> Any:
    """Scales, angles and the other measures of a projection at points in degrees.

    Parameters
    ----------
    projection : ProjectionLike
        Anything that `Projection.from_user_input` takes.
    lon : array_like, DataFrame or GeoDataFrame
        Longitudes in degrees, of any shape; or a pandas DataFrame with the columns `lon` and `lat`, or a GeoDataFrame
        of points in any CRS.
    lat : array_like, optional
        Latitudes in degrees, which broadcast with `lon`. Not with a frame.
    measures : iterable of str or Measure, or one of them
        Further measures beside the standard ones.
    prefix : str, optional
        Beginning of the names of the added columns, only for a frame.

    Returns
    -------
    Factors, DataFrame or GeoDataFrame
        Arrays of the shape of the points, NaN where undefined. For a frame, one of the same kind with more columns:
        `x`, `y`, `h`, `k`, `a`, `b`, `s`, `omega`, `theta`, `convergence`, `fisher`, `quality`, and the `measures`.

    Raises
    ------
    ProjectionError
        For an unknown projection.
    ValueError
        For an unknown measure, shapes that do not broadcast, arrays of xarray along different dimensions (for
        `projdist.gis.factor_arrays`), rows of a frame that are no points, latitudes beside a frame, a prefix without a
        frame, or columns that the frame has already.

    References
    ----------
    - J. P. Snyder 1987, Map Projections: A Working Manual, USGS Professional Paper 1395, chapter 4; equations 4-9
      (omega) and 4-14 (theta).
    - D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications: the Fisher distortion.

    Examples
    --------
    On a sphere the scale of Mercator's map is 1 / cos(lat).

    >>> round(float(factors("mercator", 10, 60).k), 9)
    2.0
    """
    projection = Projection.from_user_input(projection)
    if is_frame(lon):
        if lat is not None:
            raise ValueError("Invalid latitudes beside a frame. It must be alone: it has its own.")
        at_rows = factors(projection, *places(projection, lon), measures=measures)
        return add_columns(lon, at_rows.columns(), prefix)
    if lat is None or lon is None or not isinstance(prefix, str) or prefix:
        raise ValueError("Invalid points. They must be longitudes and latitudes, or a frame alone.")
    dims = getattr(lon, "dims", ()), getattr(lat, "dims", ())
    if dims[0] and dims[1] and dims[0] != dims[1]:  # as plain arrays they would be taken pair by pair
        raise ValueError(
            f"Invalid points. Their dimensions are {', '.join(map(str, dims[0]))} and {', '.join(map(str, dims[1]))}; "
            "projdist.gis.factor_arrays takes arrays of xarray with their dimensions."
        )
    chosen = named_measures(measures)
    lon, lat = support.check_degrees(lon, lat)
    found = derivatives(projection, lon, lat)
    J = found.jacobian
    _warn_of_points_outside(projection, lon, lat)
    check_declared_property(projection, J)
    worst = found.quality.max(initial=0)
    labels = np.array([quality.label for quality in Quality if quality <= worst])
    return Factors(
        projection=projection,
        lon=lon,
        lat=lat,
        x=found.x,
        y=found.y,
        **factors_of(J),
        quality=labels[found.quality],
        error=found.error,
        jacobian=J,
        extra={name: measure_at(projection, measure, lon, lat, J) for name, measure in chosen.items()},
    )


def _warn_of_points_outside(projection: Projection, lon: FloatArray, lat: FloatArray) -> None:
    """Warn of points outside the area of use of a CRS, and say if swapped coordinates would lie inside."""
    if projection.area_of_use is None:
        return
    area = regions.Box(*projection.area_of_use)
    there = np.isfinite(lon) & np.isfinite(lat)
    outside = there & ~area.contains(lon, lat)
    if not outside.any():
        return
    points = "the point lies" if lon.size == 1 else f"{outside.sum()} of {there.sum()} points lie"
    swapped = int(area.contains(lat[outside], lon[outside]).sum())
    inside = "it lies" if lon.size == 1 else f"{swapped} of them lie"
    hint = f" With longitude and latitude swapped {inside} inside: longitudes come first." if swapped else ""
    support.tell(f"{projection.label} is for {area.name}: {points} outside its area of use.{hint}")
