"""Points in tables, of text files and of frames: columns of longitude and latitude, found, read and checked.

pandas and geopandas are not imported: anything with their methods is a frame.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from projdist._typing import AnyArray, BoolArray, FloatArray
from projdist.projections.coordinates import data_crs_of, tell_of_frame_in_degrees
from projdist.projections.projection import Projection
from projdist.support import MISSING, has_decimal_comma, number_of, numbered_rows, tell

TEXT_SUFFIXES = (".csv", ".tsv", ".txt")
"""Suffixes of tables of points in text files; help texts list them."""

_NAMES = {"lon": ("lon", "longitude", "long", "lng"), "lat": ("lat", "latitude")}
_FARTHEST = 720.0  # degrees of longitude: two turns


@runtime_checkable
class FrameLike(Protocol):
    """The part of a pandas DataFrame that is used; DataFrames and GeoDataFrames are instances."""

    @property
    def columns(self) -> Any:
        """The names of the columns."""

    def __getitem__(self, name: Any) -> Any:
        """A column."""

    def assign(self, **columns: Any) -> Self:
        """A copy with more columns."""


def is_geographic(frame: Any) -> bool:
    """True if a frame has geometries, as a GeoDataFrame."""
    return hasattr(frame, "to_crs") and hasattr(frame, "crs")


def places(projection: Projection, frame: Any) -> tuple[FloatArray, FloatArray]:
    """Longitudes and latitudes (n,) of a frame's points, on the datum of the map; ValueError names the row, from 1."""
    # GeoDataFrames are transformed from their CRS, columns `lon` and `lat` are not. Missing points become NaN.
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
    rule = "The geometry is a {}; it must be a point. 'check' measures lines and polygons."
    _check_all(missing | (kinds == "Point"), rule, kinds)
    if frame.crs is None:
        raise ValueError("Invalid points. They have no CRS; they must state the one that they are in.")
    x, y, lon, lat = np.full((4, len(missing)), np.nan)
    x[~missing], y[~missing] = geometry[~missing].x, geometry[~missing].y
    missing = np.isnan(x + y)
    lon[~missing], lat[~missing] = data_crs_of(projection, frame.crs).degrees(x[~missing], y[~missing])
    _check_all(missing | np.isfinite(lon), f"The point has no longitude and latitude in {frame.crs.name}.")
    tell_of_missing(lon, lat)
    return lon, lat


def coordinate_columns(header: Sequence[Any]) -> tuple[int, int] | None:
    """Indices of the longitude and latitude columns, by their usual names in any case; None if one is missing."""
    words = [str(word).strip().lower() for word in header]
    found = [next((words.index(name) for name in names if name in words), None) for names in _NAMES.values()]
    return None if found[0] is None or found[1] is None else (found[0], found[1])


class PointTable(NamedTuple):
    """A table of points: header, rows with line numbers, and indices of the coordinate columns."""

    header: list[str]
    rows: list[tuple[int, list[str]]]
    lon: int
    lat: int


def read_point_table(path: Path, complaint: str, *, ragged: bool = False) -> PointTable:
    """The table of a text file with a header and any separator; raises ValueError beginning with `complaint`."""
    # Rows must be as long as the header, unless they may be `ragged`.
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
    """Longitudes and latitudes as numbers, missing ones as NaN with a warning; raises ValueError for an invalid row."""
    longitudes, latitudes = _numbers("lon", list(lon)), _numbers("lat", list(lat))
    for name, limit, values in (("lon", _FARTHEST, longitudes), ("lat", 90.0, latitudes)):
        with np.errstate(invalid="ignore"):
            within = ~(np.abs(values) > limit)  # NaN stays NaN
        _check_all(within, f"Its {name} is '{{:g}}'; it must lie within {-limit:g} and {limit:g} degrees.", values)
    tell_of_missing(longitudes, latitudes)
    return longitudes, latitudes


def tell_of_missing(lon: FloatArray, lat: FloatArray) -> None:
    """Warn of points that lack a coordinate."""
    missing = int(np.isnan(lon + lat).sum())
    if missing:
        tell(f"{missing} of {len(lon)} points have no longitude or no latitude; they have no figures.")


def _numbers(name: str, values: list[Any]) -> FloatArray:
    numbers = np.full(len(values), np.nan)
    for row, value in enumerate(values):
        try:
            if value is not None and str(value).strip() not in MISSING:
                numbers[row] = number_of(value) if isinstance(value, str) else float(value)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"Invalid point in row {row + 1}. Its {name} is '{str(value)[:40]}'; it must be a number of degrees"
                + (", with a decimal point." if has_decimal_comma(str(value)) else ".")
            ) from error
    return numbers


def _check_all(good: BoolArray, reason: str, values: Any = None) -> None:
    """Raise ValueError for the first row that is not good; its value, if given, is filled into the reason."""
    bad = np.flatnonzero(~np.asarray(good, dtype=bool))
    if bad.size:
        text = reason if values is None else reason.format(values[bad[0]])
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
