"""The protocol of regions, as the cubature and the plots use it.

A region is the image of rectangles in the (u, v) plane under a smooth chart, clipped to a part; the cubature splits
rectangles and does not know the shape. `chart` returns points and their derivatives on the unit sphere, so that
longitudes may be singular (a cap about a pole) without harm.
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
    """A region's parts in some rectangles.

    `kept` (k,) are the indices of rectangles with a part, `rectangles` (k, 4) tightened, `rule` (k, p, p) the weights
    that integrate polynomials on [-1, 1]^2 over the part, and `whole` a mask of rectangles entirely inside.
    """

    kept: IntArray
    rectangles: FloatArray
    rule: FloatArray
    whole: BoolArray

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
    """A region that fills its rectangles."""

    @property
    def figure(self) -> Ellipsoid:
        """WGS 84."""
        return WGS84

    @property
    def notes(self) -> tuple[str, ...]:
        """No notes."""
        return ()

    @property
    def far(self) -> str:
        """No distant parts."""
        return ""

    @property
    def edges(self) -> FloatArray:
        """No edges."""
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
    """Rectangles (n, 4) of a grid."""
    u0, v0 = np.meshgrid(us[:-1], vs[:-1], indexing="ij")
    u1, v1 = np.meshgrid(us[1:], vs[1:], indexing="ij")
    return np.stack([u0, u1, v0, v1], axis=-1).reshape(-1, 4)
