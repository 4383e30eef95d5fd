"""What a region is to the cubature and the plots.

A region is the image of rectangles in the (u, v) plane under a smooth chart, less what a clip
leaves out; the cubature splits rectangles and never sees the shape. `chart` gives the points, and
the velocity with which they move on the unit sphere as u and v change, so that charts may be
singular in longitude (a cap about a pole) without harm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import SMOOTH, WGS84, Discontinuities, Ellipsoid
from projdist.numerics import PLANE_WEIGHTS


class ChartPoints(NamedTuple):
    """Points in degrees, and d(east, north) / d(u, v) on the unit sphere (radians per chart unit)."""

    lon: FloatArray
    lat: FloatArray
    east_u: FloatArray | float
    east_v: FloatArray | float
    north_u: FloatArray | float
    north_v: FloatArray | float


class Clips(NamedTuple):
    """What of some rectangles is in a region.

    `kept` (k,) are the numbers of those that hold any of it, their `rectangles` (k, 4) made as tight as is known, the
    weights `rule` (k, p, p) that integrate polynomials on [-1, 1]^2 over the part, and which of them are `whole`.
    """

    kept: IntArray
    rectangles: FloatArray
    rule: FloatArray
    whole: BoolArray

    def take(self, part: slice) -> Clips:
        """Some of them."""
        return Clips(self.kept[part], self.rectangles[part], self.rule[part], self.whole[part])


class Region(Protocol):
    """What the cubature and the plots ask of a region."""

    def __hash__(self) -> int:
        """What is found of a region is kept for it."""

    @property
    def name(self) -> str:
        """The region in the words of `get_region`."""

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east, north in degrees; west < east, and east may pass 180."""

    @property
    def area_km2(self) -> float:
        """Area on the `figure`."""

    @property
    def figure(self) -> Ellipsoid:
        """The ellipsoid on which the area is measured."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was repaired in the making of it, and `far`, each in one line."""

    @property
    def far(self) -> str:
        """What lies far from the main part, in a sentence; "" where nothing does, or that is surely meant."""

    @property
    def edges(self) -> FloatArray:
        """Edges lon0, lat0, lon1, lat1 in degrees, shape (m, 4), where the region ends within its rectangles."""

    def contains(self, lon: ArrayLike, lat: ArrayLike) -> BoolArray:
        """Whether points in degrees are in the region, its edge included."""

    def panels(self, breaks: Discontinuities = SMOOTH) -> tuple[IntArray, FloatArray]:
        """Patch numbers (n,) and rectangles (n, 4) of u0, u1, v0, v1 to start from; together they cover the region.

        Those in longitude and latitude end where a map is known to be torn or bent.
        """

    def chart(self, patch: IntArray, u: FloatArray, v: FloatArray) -> ChartPoints:
        """The points of the rectangles; `patch` broadcasts against u and v."""

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """The region's part of rectangles (n, 4); `within` are the clipped ones (n, 4) that they were split from."""

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """The weights (p, p) for a curved piece of a clipped rectangle, which `square` maps to [-1, 1]^2."""


Square = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A function of chart coordinates u, v, whose values are node coordinates r, s."""


class Unclipped:
    """A region that fills its rectangles."""

    @property
    def figure(self) -> Ellipsoid:
        """WGS 84."""
        return WGS84

    @property
    def notes(self) -> tuple[str, ...]:
        """There are none."""
        return ()

    @property
    def far(self) -> str:
        """Nothing is."""
        return ""

    @property
    def edges(self) -> FloatArray:
        """There are none."""
        return np.empty((0, 4))

    def clip(self, patch: IntArray, rectangles: FloatArray, within: FloatArray | None = None) -> Clips:
        """All of the rectangles."""
        n = len(rectangles)
        rule = np.broadcast_to(PLANE_WEIGHTS, (n, *PLANE_WEIGHTS.shape))
        return Clips(np.arange(n), rectangles, rule, np.ones(n, dtype=bool))

    def rule(self, patch: int, rectangle: FloatArray, square: Square) -> FloatArray:
        """Gauss weights."""
        return PLANE_WEIGHTS


def rectangles_of(us: FloatArray, vs: FloatArray) -> FloatArray:
    """All rectangles of a grid, shape (n, 4)."""
    u0, v0 = np.meshgrid(us[:-1], vs[:-1], indexing="ij")
    u1, v1 = np.meshgrid(us[1:], vs[1:], indexing="ij")
    return np.stack([u0, u1, v0, v1], axis=-1).reshape(-1, 4)
