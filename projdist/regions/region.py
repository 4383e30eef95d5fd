"""Regions as cubature and plots use them, and the simplest: boxes, the rotated globe, and sets of points.

A region is the image of rectangles in the (u, v) plane under a smooth chart, clipped to a part; the cubature splits
rectangles and does not know the shape. `chart` returns points and their derivatives on the unit sphere, so that
longitudes may be singular (a cap about a pole) without harm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np

from projdist._typing import ArrayLike, BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, WGS84, Discontinuities, Ellipsoid, unit_vectors
from projdist.numerics import PLANE_WEIGHTS

_POLAR = 80.0  # latitude at which polar patches begin
# Edges of panels, and the halves between them, are 5-degree knots of Robinson's table.
_LATITUDES = (-60.0, -40.0, 0.0, 40.0, 60.0)
_COLATITUDES = (5.0,)
_NARROW = 1e-9  # of a box: a discontinuity this near to a side is on it
_POLES = (0.0, 1.0, -1.0)  # sign of the pole's latitude by patch, 0 without a pole
_SMALL = 0.2  # of an interval: a part that is shorter gets its own ends
_SMALLEST = 0.01  # degrees: the box of a single point is a kilometre wide
# Degrees: in a wider box across the antimeridian west and east are probably swapped. The Pacific from Sumatra to Chile
# is 198 wide, and most boxes with swapped sides are much wider.
_WIDEST_ACROSS = 210.0

SLIVER = 1e-13
"""Fraction of a panel below which a part of it is rounding."""


class ChartPoints(NamedTuple):
    """Points in degrees, and d(east, north) / d(u, v) on the unit sphere (radians per chart unit)."""

    lon: FloatArray
    lat: FloatArray
    east_u: FloatArray | float
    east_v: FloatArray | float
    north_u: FloatArray | float
    north_v: FloatArray | float


class Clips(NamedTuple):
    """A region's parts in some rectangles."""

    kept: IntArray  # (k,), indices of rectangles with a part
    rectangles: FloatArray  # (k, 4), tightened
    rule: FloatArray  # (k, p, p), weights that integrate polynomials on [-1, 1]^2 over the part
    whole: BoolArray  # rectangles that are entirely inside

    def take(self, part: slice) -> Clips:
        """A slice of the parts."""
        return Clips(self.kept[part], self.rectangles[part], self.rule[part], self.whole[part])


class Region(Protocol):
    """The interface of a region."""

    def __hash__(self) -> int:
        """Hash by which results for the region are cached."""

    @property
    def name(self) -> str:
        """The region as text for `get_region`."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; west < east, and east may exceed 180."""

    @property
    def area_km2(self) -> float:
        """Area on the `figure`."""

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid on which the area is measured."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on repairs, and `far`, each in one line."""

    @property
    def far(self) -> str:
        """Note on parts far from the main part; "" without any, or if they are meant."""

    @property
    def edges(self) -> FloatArray:
        """Edges lon0, lat0, lon1, lat1 in degrees, shape (m, 4), of the region inside its rectangles."""

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """True for points in degrees in the region, edge included."""

    def panels(self, discontinuities: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """Patch numbers (n,) and rectangles (n, 4) of u0, u1, v0, v1 that cover the region.

        Panels in longitude and latitude end at the known discontinuities of a map.
        """

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The points of the rectangles; `patch` broadcasts against u and v."""

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """The region's part of rectangles (n, 4); `within` are the clipped ones (n, 4) that they were split from."""

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """The weights (p, p) for a curved piece of a clipped rectangle, which `square` maps to [-1, 1]^2."""


Square = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A function from chart coordinates u, v to node coordinates r, s."""


class Unclipped:
    """A region that fills its rectangles, without notes and edges; on WGS 84 unless it has an `ellipsoid`."""

    notes: tuple[str, ...] = ()
    far = ""
    edges: FloatArray = np.empty((0, 4))

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid on which distances and areas are measured."""
        return getattr(self, "ellipsoid", None) or WGS84

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """All of the rectangles."""
        n = len(rectangles)
        rule = np.broadcast_to(PLANE_WEIGHTS, (n, *PLANE_WEIGHTS.shape))
        return Clips(np.arange(n), rectangles, rule, np.ones(n, dtype=bool))

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """Gauss weights."""
        return PLANE_WEIGHTS


# ---- panels --------------------------------------------------------------------------------------


def patch_panels(
    bounds: tuple[float, float, float, float],
    discontinuities: Discontinuities = SMOOTH,
    widest: float = 180.0,
    *,
    graded: bool = True,
) -> tuple[IntArray, FloatArray]:
    """Patch numbers (n,) and rectangles (n, 4) in u, v that cover a box, with edges at known discontinuities."""
    # Panels are at most `widest` degrees wide. Without `graded` all are in patch 0, for maps that are smooth at the
    # poles or have much rounding there.
    west, south, east, north = bounds
    parallels = discontinuities.parallels
    low, high = (max(south, -_POLAR), min(north, _POLAR)) if graded else (south, north)
    bands = []
    if low < high:
        known = (*_LATITUDES, *parallels) if graded else (0.0, *parallels)
        bands.append((0, [low, *_between(low, high, known), high]))
    for patch, near, far in ((1, 90.0 - north, 90.0 - south), (2, 90.0 + south, 90.0 + north)) if graded else ():
        if near < 90.0 - _POLAR:
            far = min(far, 90.0 - _POLAR)
            known = tuple(90.0 - lat for lat in parallels) if patch == 1 else parallels
            bands.append((patch, np.cbrt([near, *_between(near, far, (*_COLATITUDES, *known)), far]).tolist()))
    lons = []
    for meridians in (discontinuities.northern, discontinuities.southern):
        turned = tuple(lon + turn for lon in meridians for turn in (-720.0, -360.0, 0.0, 360.0, 720.0))
        lons.append([west])
        for a, b in itertools.pairwise([west, *_between(west, east, turned), east]):
            lons[-1] += np.linspace(a, b, math.ceil((b - a) / widest) + 1)[1:].tolist()
    numbers, rectangles = [], []
    for patch, edges in bands:
        for v0, v1 in itertools.pairwise(edges):
            southern = int(patch == 2 or (patch == 0 and v0 + v1 < 0.0))
            rectangles += [(u0, u1, v0, v1) for u0, u1 in itertools.pairwise(lons[southern])]
            numbers += [patch] * (len(lons[southern]) - 1)
    return np.array(numbers), np.array(rectangles)


def _between(low: float, high: float, values: tuple[float, ...]) -> list[float]:
    """Sorted values strictly inside an interval."""
    margin = _NARROW * (high - low)
    return sorted({value for value in values if low + margin < value < high - margin})


def patch_chart(patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
    """Chart with the longitude u and the latitude v; in polar patches v is the cube root of the polar distance."""
    degree = math.pi / 180.0
    if not np.any(patch):
        return ChartPoints(u, v, degree * np.cos(degree * v), 0.0, 0.0, degree)
    sign = np.array(_POLES)[patch]
    square, plain = v * v, sign == 0.0
    lat = np.where(plain, v, sign * (90.0 - square * v))
    north_v = np.where(plain, 1.0, -3.0 * sign * square)
    return ChartPoints(u, lat, degree * np.cos(degree * lat), 0.0, 0.0, degree * north_v)


def latitude_of(patch: int, v: FloatArray) -> FloatArray:
    """Latitude at v in a patch."""
    sign = _POLES[patch]
    return np.asarray(sign * (90.0 - np.asarray(v) ** 3) if sign else v)


def height_of(patch: int, lat: FloatArray) -> FloatArray:
    """v at a latitude in a patch."""
    sign = _POLES[patch]
    return np.cbrt(np.maximum(90.0 - sign * np.asarray(lat), 0.0)) if sign else np.asarray(lat)


def tightened(v0: float, v1: float, low: float, high: float) -> tuple[float, float]:
    """The interval v0, v1, halved as long as one half holds low to high; low to high itself if that is far shorter."""
    # Halves end on the 5-degree knots of Robinson's table, where his map has kinks.
    while v0 < (middle := 0.5 * (v0 + v1)) < v1:
        if high <= middle:
            v1 = middle
        elif low >= middle:
            v0 = middle
        else:
            return (low, high) if high - low < _SMALL * (v1 - v0) else (v0, v1)
    return low, high  # equal or adjacent numbers


# ---- boxes ---------------------------------------------------------------------------------------

Sides = tuple[float, float, float, float]


def likelier(sides: Sides) -> Sides:
    """The sides that were probably meant: those given, or these with swapped values put right."""
    west, south, east, north = sides
    if max(abs(south), abs(north)) > 90 >= max(abs(west), abs(east)):
        west, south, east, north = south, west, north, east
    if south > north:
        south, north = north, south
    if west > east and east + 360.0 - west > _WIDEST_ACROSS:
        west, east = east, west
    return west, south, east, north


def _between_sides(sides: Sides, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
    west, south, east, north = sides
    lon, lat = np.asarray(lon, dtype=float), np.asarray(lat, dtype=float)
    return np.asarray((np.mod(lon - west, 360.0) <= east - west) & (lat >= south) & (lat <= north))


@dataclass(frozen=True)
class Box(Unclipped):
    """The box between two meridians and two parallels; west > east crosses the antimeridian."""

    west: float
    south: float
    east: float
    north: float
    ellipsoid: Ellipsoid | None = field(default=None, compare=False)  # of its body; None: any, the area is on WGS 84

    @classmethod
    def between(cls, bounds: Sides, ellipsoid: Ellipsoid | None = None) -> Box:
        """The box of region bounds with west < east: 170 to 370 becomes 170 to 10."""
        west, south, east, north = bounds
        if east - west >= 360.0:
            return cls(-180.0, south, 180.0, north, ellipsoid)
        return cls(west, south, east if east <= 360.0 else east - 360.0, north, ellipsoid)

    def __post_init__(self) -> None:
        values = (self.west, self.south, self.east, self.north)
        text = f"Invalid box '{','.join(f'{value:g}' for value in values)}'."
        if not all(math.isfinite(value) for value in values):
            raise ValueError(f"{text} West, south, east and north must be finite numbers of degrees.")
        if not -90 <= self.south < self.north <= 90:
            west, south, east, north = likelier(values)
            possible = -90 <= south < north <= 90 and -360 <= west < east <= 360
            hint = f"Did you mean {west:g},{south:g},{east:g},{north:g}? " if possible else ""
            raise ValueError(f"{text} {hint}South must be below north, both within -90 and 90.")
        if not (-360 <= self.west <= 360 and -360 <= self.east <= 360):
            raise ValueError(f"{text} West and east must lie within -360 and 360.")
        west, _, east, _ = self.bounds
        if self.west == self.east or not 0 < east - west <= 360:
            raise ValueError(f"{text} It must be wider than 0 and at most 360 degrees.")

    @property
    def is_globe(self) -> bool:
        """True for the whole sphere."""
        west, south, east, north = self.bounds
        return east - west == 360 and south == -90 and north == 90

    @property
    def name(self) -> str:
        """`globe`, or `box:W,S,E,N`."""
        if self.is_globe:
            return "globe"
        return "box:" + ",".join(f"{value:.15g}" for value in (self.west, self.south, self.east, self.north))

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees, with west < east."""
        east = self.east if self.east > self.west else self.east + 360.0
        return self.west, self.south, east, self.north

    @property
    def area_km2(self) -> float:
        """Area on the ellipsoid."""
        west, south, east, north = self.bounds
        below = self.figure.area_below([south, north])
        return float(math.radians(east - west) * (below[1] - below[0]) / 1e6)

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """True for points in degrees in the box, its edge included."""
        return _between_sides(self.bounds, lon, lat)

    def panels(self, discontinuities: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """The panels of `patch_panels`."""
        return patch_panels(self.bounds, discontinuities)

    chart = staticmethod(patch_chart)


GLOBE = Box(-180.0, -90.0, 180.0, 90.0)


def bounding_box(west: ArrayLike, south: ArrayLike, east: ArrayLike, north: ArrayLike) -> Box:
    """The narrowest box around boxes in degrees with west <= east; it may cross the antimeridian."""
    start = np.mod(np.asarray(west, dtype=float), 360.0)
    order = np.argsort(start)
    end = np.maximum.accumulate((start + np.subtract(east, west))[order])
    end = np.maximum(end, end[-1] - 360.0)
    # The box is the complement of the widest gap between boxes.
    following = np.append(start[order][1:], start[order][0] + 360.0)
    widest = int(np.argmax(following - end))
    width = min(360.0 - float(following[widest] - end[widest]), 360.0)
    low, high = float(np.min(np.asarray(south))), float(np.max(np.asarray(north)))
    if width < _SMALLEST:
        following[widest] -= 0.5 * (_SMALLEST - width)
        width = _SMALLEST
    if high - low < _SMALLEST:
        low = min(max(0.5 * (low + high - _SMALLEST), -90.0), 90.0 - _SMALLEST)
        high = low + _SMALLEST
    first = (float(following[widest]) + 180.0) % 360.0 - 180.0
    last = (first + width + 180.0) % 360.0 - 180.0
    return Box(-180.0, low, 180.0, high) if width == 360.0 else Box(first, low, last, high)


@dataclass(frozen=True)
class TurnedGlobe(Unclipped):
    """The globe, in a chart whose north pole is at `lon`, `lat`, and whose meridian 0 runs south from there.

    Panels end at `discontinuities`, in the chart's own longitudes and latitudes, and are at most `widest` degrees
    wide. At the poles they are `graded` (`patch_panels`), or in plain longitude and latitude.
    """

    lon: float
    lat: float
    discontinuities: Discontinuities = SMOOTH
    widest: float = 180.0
    graded: bool = True

    name, bounds, area_km2, contains = "globe", GLOBE.bounds, GLOBE.area_km2, GLOBE.contains

    def panels(self, discontinuities: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """The panels of `patch_panels` about the chart's poles; the Earth's meridians and parallels cross them."""
        return patch_panels(GLOBE.bounds, self.discontinuities, self.widest, graded=self.graded)

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The chart of `patch_chart`, rotated."""
        own = patch_chart(patch, u, v)
        lam, phi = np.radians(own.lon), np.radians(own.lat)
        cos_lam, sin_lam, cos_phi, sin_phi = np.cos(lam), np.sin(lam), np.cos(phi), np.sin(phi)
        lon, lat = math.radians(self.lon), math.radians(self.lat)
        pole = unit_vectors(self.lon, self.lat)
        south = np.array([math.sin(lat) * math.cos(lon), math.sin(lat) * math.sin(lon), -math.cos(lat)])
        east = np.array([-math.sin(lon), math.cos(lon), 0.0])

        def turned(x: FloatArray, y: FloatArray, z: FloatArray | float) -> list[FloatArray]:
            return [x * south[k] + y * east[k] + z * pole[k] for k in range(3)]

        x, y, z = turned(cos_phi * cos_lam, cos_phi * sin_lam, sin_phi)
        eastward = turned(-sin_lam, cos_lam, 0.0)
        rho = np.hypot(x, y)
        # Components of the chart's east along the Earth's east and north; its north is 90 degrees to the left.
        to_east = (x * eastward[1] - y * eastward[0]) / rho
        to_north = (rho * eastward[2]) - z * (x * eastward[0] + y * eastward[1]) / rho
        return ChartPoints(
            np.degrees(np.arctan2(y, x)),
            np.degrees(np.arctan2(z, rho)),
            own.east_u * to_east,
            -own.north_v * to_north,
            own.east_u * to_north,
            own.north_v * to_east,
        )


@dataclass(frozen=True, eq=False)
class PointSet:
    """Points with weights; a set of them has no area.

    If the points sample something larger, `coarse` is a sparser sample of it: the difference of means between the two
    bounds the error of sampling.
    """

    lon: FloatArray  # (n,), degrees
    lat: FloatArray
    weight: FloatArray  # (n,), of any sum
    name: str = "points"  # the region as text for `get_region`
    height: FloatArray | None = None  # (n,), metres
    notes: tuple[str, ...] = ()
    coarse: PointSet | None = None
    ellipsoid: Ellipsoid | None = None  # of the body; None: any

    far, area_km2, edges = "", 0.0, np.empty((0, 4))  # points have no parts, area or edges

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
    def figure(self) -> Ellipsoid:
        """The ellipsoid of the body."""
        return self.ellipsoid or WGS84

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
        return _between_sides(self.bounds, lon, lat)

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
