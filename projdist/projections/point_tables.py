"""Points in tables: the longitudes and latitudes of a DataFrame or GeoDataFrame, and columns added to it.

Nothing of pandas or geopandas is imported: what has their methods is a frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol, Self, TypeGuard, runtime_checkable

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.projections.planes import geographic
from projdist.projections.projection import Projection
from projdist.support import MISSING, tell

__all__ = [
    "MISSING",
    "Frame",
    "add_columns",
    "check_degrees",
    "check_new_names",
    "is_frame",
    "is_geographic",
    "places",
    "tell_of_missing",
]

_FARTHEST = 720.0  # degrees of longitude: twice round


@runtime_checkable
class Frame(Protocol):
    """What is asked of a pandas DataFrame."""

    @property
    def columns(self) -> Any:
        """The names of the columns."""

    def __getitem__(self, name: Any) -> Any:
        """A column."""

    def assign(self, **columns: Any) -> Self:
        """A copy with more columns."""


def is_frame(value: object) -> TypeGuard[Frame]:
    """Whether a value is a DataFrame or GeoDataFrame."""
    return isinstance(value, Frame)


def is_geographic(frame: Any) -> bool:
    """Whether a frame has geometries, as a GeoDataFrame has, and not columns of longitudes and latitudes."""
    return hasattr(frame, "to_crs") and hasattr(frame, "crs")


def places(projection: Projection, frame: Any) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n,) in degrees, on the datum of the map.

    Of a GeoDataFrame's points from whatever CRS they have, else of the columns `lon` and `lat` as
    they stand; NaN where they are missing, which is told. Raises ValueError in one line that names
    the row, counted from 1.
    """
    if not is_geographic(frame):
        return _columns(frame)
    geometry = frame.geometry
    missing = (geometry.isna() | geometry.is_empty).to_numpy()
    kinds = geometry.geom_type.to_numpy()
    _check_all(missing | (kinds == "Point"), lambda row: f"The geometry is a {kinds[row]}; it must be a point.")
    if frame.crs is None:
        raise ValueError("Invalid points. They have no CRS; they must state the one that they are in.")
    x, y, lon, lat = np.full((4, len(missing)), np.nan)
    x[~missing], y[~missing] = geometry[~missing].x, geometry[~missing].y
    missing = np.isnan(x + y)
    lon[~missing], lat[~missing] = geographic(projection, frame.crs, x[~missing], y[~missing])
    _check_all(missing | np.isfinite(lon), f"The point has no longitude and latitude in {frame.crs.name}.")
    tell_of_missing(lon, lat)
    return lon, lat


def _columns(frame: Any) -> tuple[FloatArray, FloatArray]:
    names = [str(name) for name in frame.columns]
    if names.count("lon") != 1 or names.count("lat") != 1:
        shown = ", ".join(names[:20]) or "none"
        raise ValueError(f"Invalid columns '{shown}' of points. One must be 'lon' and one 'lat', in degrees.")
    return check_degrees(frame["lon"], frame["lat"])


def check_degrees(lon: Iterable[Any], lat: Iterable[Any]) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes as numbers, NaN where they are missing, which is told.

    Raises ValueError for the first row that is no place, counted from 1.
    """
    degrees = {"lon": _numbers("lon", list(lon)), "lat": _numbers("lat", list(lat))}
    for name, limit in (("lon", _FARTHEST), ("lat", 90.0)):
        values = degrees[name]
        with np.errstate(invalid="ignore"):
            within = ~(np.abs(values) > limit)  # NaN is nowhere, and gets a row of NaN
        _check_all(
            within,
            lambda row, name=name, limit=limit, values=values: (
                f"Its {name} is '{values[row]:g}'; it must lie within {-limit:g} and {limit:g} degrees."
            ),
        )
    tell_of_missing(degrees["lon"], degrees["lat"])
    return degrees["lon"], degrees["lat"]


def tell_of_missing(lon: FloatArray, lat: FloatArray) -> None:
    """Tell how many points lack a coordinate, if any."""
    missing = int(np.isnan(lon + lat).sum())
    if missing:
        tell(f"{missing} of {len(lon)} points have no longitude or no latitude; they have no figures.")


def _numbers(name: str, values: list[Any]) -> FloatArray:
    numbers = np.empty(len(values))
    for row, value in enumerate(values):
        try:
            numbers[row] = np.nan if value is None or str(value).strip() in MISSING else float(value)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid point in row {row + 1}. Its {name} is '{str(value)[:40]}'; it must be a number of degrees."
            ) from error
    return numbers


def _check_all(good: BoolArray, reason: Any) -> None:
    """Raise ValueError for the first row that is not good; the reason is a text, or a function of the row."""
    bad = np.flatnonzero(~np.asarray(good, dtype=bool))
    if bad.size:
        text = reason(bad[0]) if callable(reason) else reason
        raise ValueError(f"Invalid point in row {bad[0] + 1}. {text}")


def check_new_names(names: Iterable[Any], new: Iterable[str]) -> None:
    """Refuse new columns whose names are there already, in capitals or not: GeoPackages tell no difference."""
    present = {str(name).lower() for name in names}
    taken = [name for name in new if name.lower() in present]
    if taken:
        raise ValueError(
            f"Invalid points. They have a column '{taken[0]}' already; rename it, or give the new ones a prefix."
        )


def add_columns(frame: Frame, columns: Mapping[str, AnyArray], prefix: str) -> Any:
    """A copy of a frame with more columns; raises ValueError where one is there already."""
    named = {prefix + name: values for name, values in columns.items()}
    check_new_names(frame.columns, named)
    return frame.assign(**named)
