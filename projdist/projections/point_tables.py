"""Points in tables: longitudes and latitudes of text files and DataFrames, and new columns for them.

pandas and geopandas are not imported: anything with their methods is a frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.projections.coordinates import crs_of, geographic
from projdist.projections.projection import Projection
from projdist.support import MISSING, has_decimal_comma, number_of, numbered_rows, tell

TEXT_SUFFIXES = (".csv", ".tsv", ".txt")
"""Suffixes of tables of points in text files."""

_NAMES = {"lon": ("lon", "longitude", "long", "lng"), "lat": ("lat", "latitude")}

_FARTHEST = 720.0  # degrees of longitude: two turns
_TURN, _POLE = 360.0, 90.0  # degrees: bounds of longitudes and latitudes in data
_LARGEST_UNIT = 10.0  # metres: in a projected CRS in kilometres a whole country may have numbers as small as degrees
_SMALLEST_BODY = 1e3  # metres


@runtime_checkable
class FrameLike(Protocol):
    """The part of a pandas DataFrame that is used."""

    @property
    def columns(self) -> Any:
        """The names of the columns."""

    def __getitem__(self, name: Any) -> Any:
        """A column."""

    def assign(self, **columns: Any) -> Self:
        """A copy with more columns."""


def is_frame(value: object) -> TypeGuard[FrameLike]:
    """True for a DataFrame or GeoDataFrame."""
    return isinstance(value, FrameLike)


def is_geographic(frame: Any) -> bool:
    """True if a frame has geometries, as a GeoDataFrame."""
    return hasattr(frame, "to_crs") and hasattr(frame, "crs")


def places(projection: Projection, frame: Any) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n,) in degrees of a frame's points, on the datum of the map.

    Points of a GeoDataFrame are transformed from their CRS; otherwise the columns `lon` and `lat` are taken as they
    are. Missing points are NaN, with a warning. Raises ValueError that names the row, counted from 1.
    """
    if not is_geographic(frame):
        names = list(frame.columns)
        found = coordinate_columns(names)
        if found is None or any(names.count(names[column]) > 1 for column in found):
            shown = ", ".join(map(str, names[:20])) or "none"
            raise ValueError(f"Invalid columns '{shown}' of points. One must be 'lon' and one 'lat', in degrees.")
        return check_degrees(*(frame[names[column]] for column in found))
    tell_of_frame_in_degrees(frame, "the points")
    geometry = frame.geometry
    missing = (geometry.isna() | geometry.is_empty).to_numpy()
    kinds = geometry.geom_type.to_numpy()
    _check_all(
        missing | (kinds == "Point"),
        lambda row: f"The geometry is a {kinds[row]}; it must be a point. 'check' measures lines and polygons.",
    )
    if frame.crs is None:
        raise ValueError("Invalid points. They have no CRS; they must state the one that they are in.")
    x, y, lon, lat = np.full((4, len(missing)), np.nan)
    x[~missing], y[~missing] = geometry[~missing].x, geometry[~missing].y
    missing = np.isnan(x + y)
    lon[~missing], lat[~missing] = geographic(projection, frame.crs, x[~missing], y[~missing])
    _check_all(missing | np.isfinite(lon), f"The point has no longitude and latitude in {frame.crs.name}.")
    tell_of_missing(lon, lat)
    return lon, lat


def coordinate_columns(header: Sequence[Any]) -> tuple[int, int] | None:
    """Indices of the longitude and latitude columns, by their usual names in any case; None if one is missing."""
    words = [str(word).strip().lower() for word in header]
    found = [next((words.index(name) for name in names if name in words), None) for names in _NAMES.values()]
    return None if found[0] is None or found[1] is None else (found[0], found[1])


@dataclass(frozen=True)
class PointTable:
    """A table of points: header, rows with line numbers, and indices of the coordinate columns."""

    header: list[str]
    rows: list[tuple[int, list[str]]]
    lon: int
    lat: int


def read_point_table(path: Path, complaint: str, *, ragged: bool = False) -> PointTable:
    """The table of a text file with a header and any separator; raises ValueError that begins with `complaint`.

    Rows must be as long as the header, unless they may be `ragged`.
    """
    (_, header), *rows = numbered_rows(path, complaint, comments=False)
    header = [word.strip() for word in header]
    twice = next((word for word in header if header.count(word) > 1), None)
    if twice is not None:
        raise ValueError(f"{complaint} It has two columns '{twice}'.")
    found = coordinate_columns(header)
    if found is None:
        raise ValueError(f"{complaint} Its header must have lon and lat; it has {', '.join(header)}.")
    for number, row in [] if ragged else rows:
        if len(row) < len(header):
            raise ValueError(f"{complaint} Line {number} has {len(row)} cells; it must have {len(header)}.")
    return PointTable(header, rows, *found)


def check_degrees(lon: Iterable[Any], lat: Iterable[Any]) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes as numbers; missing ones are NaN, with a warning.

    Raises ValueError for the first invalid row, counted from 1.
    """
    degrees = {"lon": _numbers("lon", list(lon)), "lat": _numbers("lat", list(lat))}
    for name, limit in (("lon", _FARTHEST), ("lat", 90.0)):
        values = degrees[name]
        with np.errstate(invalid="ignore"):
            within = ~(np.abs(values) > limit)  # NaN stays NaN
        _check_all(
            within,
            lambda row, name=name, limit=limit, values=values: (
                f"Its {name} is '{values[row]:g}'; it must lie within {-limit:g} and {limit:g} degrees."
            ),
        )
    tell_of_missing(degrees["lon"], degrees["lat"])
    return degrees["lon"], degrees["lat"]


def tell_of_degrees(crs: Any, bounds: ArrayLike, thing: str, one: str = "feature") -> None:
    """Warn if features of data in a projected CRS look like degrees.

    `bounds` (n, 4) are minimum x, y and maximum x, y of each feature, NaN if empty. Units above 10 m, bodies as small
    as a unit sphere and points at 0, 0 are exempt: their numbers are small anyway.
    """
    stated = crs_of(crs)
    unit = stated.axis_info[0] if stated.axis_info else None
    small = stated.ellipsoid is None or stated.ellipsoid.semi_major_metre < _SMALLEST_BODY
    if not stated.is_projected or unit is None or unit.unit_conversion_factor > _LARGEST_UNIT or small:
        return
    x0, y0, x1, y1 = np.asarray(bounds, dtype=float).reshape(-1, 4).T
    east, north = np.maximum(np.abs(x0), np.abs(x1)), np.maximum(np.abs(y0), np.abs(y1))
    found = (np.maximum(east, north) <= _TURN) & (np.minimum(east, north) <= _POLE) & (np.maximum(east, north) > 0.0)
    if found.any():
        k = int(np.argmax(found))
        tell(
            f"{int(found.sum())} of {len(found)} {one}(s) of {thing} look like degrees, as that at {x0[k]:.6g}, "
            f"{y0[k]:.6g}, but {stated.name} is in units of {unit.unit_name}: is that their CRS?"
        )


def tell_of_frame_in_degrees(frame: Any, thing: str) -> None:
    """`tell_of_degrees` for a GeoDataFrame or GeoSeries with a CRS."""
    if frame.crs is not None and frame.crs.is_projected:
        tell_of_degrees(frame.crs, frame.geometry.bounds.to_numpy(), thing)


def tell_of_missing(lon: FloatArray, lat: FloatArray) -> None:
    """Warn of points that lack a coordinate."""
    missing = int(np.isnan(lon + lat).sum())
    if missing:
        tell(f"{missing} of {len(lon)} points have no longitude or no latitude; they have no figures.")


def _numbers(name: str, values: list[Any]) -> FloatArray:
    numbers = np.empty(len(values))
    for row, value in enumerate(values):
        try:
            if value is None or str(value).strip() in MISSING:
                numbers[row] = np.nan
            else:
                numbers[row] = number_of(value) if isinstance(value, str) else float(value)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid point in row {row + 1}. Its {name} is '{str(value)[:40]}'; it must be a number of degrees"
                + (", with a decimal point." if has_decimal_comma(str(value)) else ".")
            ) from error
    return numbers


def _check_all(good: BoolArray, reason: Any) -> None:
    """Raise ValueError for the first row that is not good; `reason` is a text or a function of the row."""
    bad = np.flatnonzero(~np.asarray(good, dtype=bool))
    if bad.size:
        text = reason(bad[0]) if callable(reason) else reason
        raise ValueError(f"Invalid point in row {bad[0] + 1}. {text}")


def check_new_names(names: Iterable[Any], new: Iterable[str]) -> None:
    """Raise if a new column exists, ignoring case as GeoPackage does."""
    present = {str(name).lower() for name in names}
    taken = [name for name in new if name.lower() in present]
    if taken:
        raise ValueError(
            f"Invalid points. They have a column '{taken[0]}' already; rename it, or give the new ones a prefix."
        )


def add_columns(frame: FrameLike, columns: Mapping[str, AnyArray], prefix: str) -> Any:
    """A copy of a frame with more columns; raises ValueError if one exists."""
    named = {prefix + name: values for name, values in columns.items()}
    check_new_names(frame.columns, named)
    return frame.assign(**named)
