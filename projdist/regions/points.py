"""Sets of weighted points, as regions: their integrals are sums."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray
from projdist.earth import WGS84, Ellipsoid
from projdist.projections import PointTable, read_point_table
from projdist.support import MISSING, comma_hint, number_of

_WEIGHTS = ("weight", "weights", "w")
HEIGHTS = ("height", "h", "elevation", "ele")
"""Names of height columns, likeliest first; the last is GPX's."""


@dataclass(frozen=True, eq=False)
class PointSet:
    """Points in degrees with weights of any sum, and optional heights in metres; all of shape (n,).

    `name` is the region as text for `get_region`. A set has no area; its `ellipsoid` is that of its body, None for any.
    If the points sample something larger, `coarse` is a sparser sample of it: the difference of means between the two
    bounds the error of sampling.
    """

    lon: FloatArray
    lat: FloatArray
    weight: FloatArray
    name: str = "points"
    height: FloatArray | None = None
    notes: tuple[str, ...] = ()
    coarse: PointSet | None = None
    ellipsoid: Ellipsoid | None = None

    def __post_init__(self) -> None:
        lon, lat, weight = (np.asarray(values, dtype=float) for values in (self.lon, self.lat, self.weight))
        text = f"Invalid points '{self.name}'."
        if lon.ndim != 1 or not lon.shape == lat.shape == weight.shape or not lon.size:
            raise ValueError(f"{text} There must be one or more, each with a longitude, a latitude and a weight.")
        wrong = ~(np.isfinite(lon) & (np.abs(lon) <= 360.0) & (np.abs(lat) <= 90.0))
        if wrong.any():
            k = int(np.argmax(wrong))
            raise ValueError(
                f"{text} Point {k + 1} is at {lon[k]:g}, {lat[k]:g}; it must have a longitude within -360 and 360, a "
                "latitude within -90 and 90."
            )
        wrong = ~(np.isfinite(weight) & (weight >= 0.0))
        if wrong.any():
            k = int(np.argmax(wrong))
            raise ValueError(f"{text} Point {k + 1} has the weight {weight[k]:g}; it must be finite and not negative.")
        if not weight.any():
            raise ValueError(f"{text} Their weights must not all be zero.")
        for name, values in (("lon", lon), ("lat", lat), ("weight", weight)):
            object.__setattr__(self, name, values)

    @property
    def far(self) -> str:
        """Points have no parts."""
        return ""

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid of the body."""
        return self.ellipsoid or WGS84

    @property
    def area_km2(self) -> float:
        """Points have no area."""
        return 0.0

    @property
    def edges(self) -> FloatArray:
        """Points have no edges."""
        return np.empty((0, 4))

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees with a margin; west < east, and east may exceed 180."""
        lon = np.sort(np.mod(self.lon + 180.0, 360.0) - 180.0)
        gaps = np.append(lon[1:], lon[0] + 360.0) - lon
        widest = int(np.argmax(gaps))
        west = float(lon[(widest + 1) % lon.size])
        width = 360.0 - float(gaps[widest])
        margin = max(0.05 * max(width, float(np.ptp(self.lat))), 0.01)
        if width + 2.0 * margin >= 360.0:
            west, width = -180.0 + margin, 360.0 - 2.0 * margin
        south, north = float(self.lat.min()) - margin, float(self.lat.max()) + margin
        return west - margin, max(south, -90.0), west + width + margin, min(north, 90.0)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """True for places in degrees within the bounds of the points, where a map of them is drawn."""
        west, south, east, north = self.bounds
        lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
        return np.asarray((np.mod(lon - west, 360.0) <= east - west) & (lat >= south) & (lat <= north))

    def chosen(self, where: Callable[[FloatArray, FloatArray], BoolArray], name: str) -> PointSet:
        """The points where a function of longitudes and latitudes is True; raises ValueError if there are none.

        If no point of `coarse` is left, the heaviest point stands for it.
        """
        keep = where(self.lon, self.lat)
        if not keep.any():
            raise ValueError(f"Invalid region '{name}'. Nothing is left of it.")
        height = None if self.height is None else self.height[keep]
        kept = self.lon[keep], self.lat[keep], self.weight[keep]
        found = PointSet(*kept, name, height, self.notes, ellipsoid=self.ellipsoid)
        if self.coarse is None:
            return found
        rest = where(self.coarse.lon, self.coarse.lat) & (self.coarse.weight > 0.0)
        fewer, rest = (self.coarse, rest) if rest.any() else (found, found.weight == found.weight.max())
        return replace(found, coarse=PointSet(fewer.lon[rest], fewer.lat[rest], fewer.weight[rest], name))


def read_csv(path: Path, name: str, column: str = "weight") -> PointSet:
    """The points of a table with columns lon, lat, and optionally weight (or `column`) and height; raises ValueError.

    Points without a coordinate are left out, with a note.
    """
    text = f"Invalid points file '{path}'."
    read = read_point_table(path, text, ragged=True)
    places = _places(read, column)
    if column != "weight" and "weight" not in places:
        raise ValueError(f"{text} It has no column '{column}' for weights; it has {', '.join(read.header)}.")
    table = np.array(list(_numbers(read.rows, places, text))).reshape(-1, len(places))
    if not len(table):
        raise ValueError(f"{text} It has no points.")
    columns = dict(zip(places, table.T, strict=True))
    weight = columns.get("weight", np.ones(len(table)))
    return placed(columns["lon"], columns["lat"], weight, name, columns.get("height"), text)


def placed(
    lon: FloatArray, lat: FloatArray, weight: FloatArray, name: str, height: FloatArray | None, text: str
) -> PointSet:
    """The points with both coordinates, with a note on the others; raises ValueError if none has."""
    known = ~np.isnan(lon + lat)
    if known.all():
        return PointSet(lon, lat, weight, name, height)
    if not known.any():
        raise ValueError(f"{text} It has no points with a longitude and a latitude.")
    note = f"{name}: {np.sum(~known)} of {len(known)} points have no longitude or no latitude, and are left out."
    return PointSet(lon[known], lat[known], weight[known], name, None if height is None else height[known], (note,))


def _places(table: PointTable, weight: str) -> dict[str, int]:
    """Indices of the known columns; `weight` names that of weights, "weight" stands for its usual names."""
    words = [word.lower() for word in table.header]
    found = {"lon": table.lon, "lat": table.lat}
    known = {"weight": _WEIGHTS if weight == "weight" else (weight.lower(),), "height": HEIGHTS}
    for column, names in known.items():
        place = next((words.index(name) for name in names if name in words), None)
        if place is not None:
            found[column] = place
    return found


def _numbers(rows: list[tuple[int, list[str]]], places: dict[str, int], text: str) -> Iterator[list[float]]:
    for number, row in rows:
        try:
            yield [
                np.nan if column in ("lon", "lat") and row[place].strip() in MISSING else number_of(row[place])
                for column, place in places.items()
            ]
        except (ValueError, IndexError) as error:
            hint = comma_hint(row)
            raise ValueError(f"{text} Line {number} must have numbers for {', '.join(places)}.{hint}") from error
