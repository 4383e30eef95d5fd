"""Lengths, areas and bearings of edges on a map and on its ellipsoid.

An edge is straight in the coordinates in which it is given, and a curve elsewhere. Map and ground are
measured along the same curve: five Lobatto nodes on each edge, derivatives of the quartics through
them. Edges that quartics do not follow are halved. On the ground the curve is one in space, so that
neither the antimeridian nor a pole is special; areas are those of the polar equal-area map.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.projections import Projection

__all__ = ["Measured", "measure_chains"]

Place = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Longitude and latitude in degrees of coordinates; NaN where there is none."""

_X = np.array([-1.0, -np.sqrt(3.0 / 7.0), 0.0, np.sqrt(3.0 / 7.0), 1.0])
_SHARE = 0.5 * (1.0 + _X)  # of the way along an edge
_WEIGHTS = np.array([9.0, 49.0, 64.0, 49.0, 9.0]) / 180.0
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_X, 4))
# Derivatives by the share of the way, (5, 5).
_RATES = 2.0 * np.polynomial.legendre.legval(_X, np.polynomial.legendre.legder(np.eye(5))).T @ _TO_LEGENDRE

_TAIL = 1e-6  # of an edge's length: its last Legendre coefficient. Bearings are then good to 1e-5 degrees
_ROUNDING = 1e-9  # of the Earth's radius, 6 mm: what inverses of PROJ leave of doubt, on map and ground alike
_SHORTEST = 1e-5  # of the radius, 64 m: no shorter edge is halved
_HALVINGS = 24
_TEAR = 1e3  # an edge that is not smooth, and longer than that on the map than on the ground, is torn
_AT_A_POLE = 1e-9  # degrees; there is no north
_AT_ONCE = 50_000  # edges; 100 MB
_SUMS = ("map_length", "length", "map_area", "area", "bearing_square")


@dataclass(frozen=True, kw_only=True)
class Measured:
    """Figures of chains of edges on the map and on the ground, each of shape (n,), in metres and m^2.

    Areas are signed, and of chains that close. `bearing_square` is the integral along the ground of the
    square of the grid bearing less the true one, `bearing_most` its largest absolute value, in degrees.
    A chain that is `outside` has a point that is not on the map; a `torn` one crosses a cut of it.
    """

    outside: BoolArray
    torn: BoolArray
    map_length: FloatArray
    length: FloatArray
    map_area: FloatArray
    area: FloatArray
    bearing_square: FloatArray
    bearing_most: FloatArray


def measure_chains(projection: Projection, place: Place, edges: FloatArray, chain: IntArray) -> Measured:
    """The figures of chains 0, 1, ... of edges (m, 4), u, v of begin and end; `chain` (m,) ascends."""
    count = int(chain[-1]) + 1 if len(chain) else 0
    never = np.zeros(count, dtype=bool)
    figures: dict[str, FloatArray] = {name: np.zeros(count) for name in (*_SUMS, "bearing_most")}
    result = Measured(outside=never, torn=never.copy(), **figures)
    if not count:
        return result
    lon, lat = place(edges[:, 0], edges[:, 1])
    frame = _Frame(projection, place, lon, lat, chain)
    for first in range(0, len(edges), _AT_ONCE):
        block = slice(first, first + _AT_ONCE)
        _measure_block(result, frame, edges[block], chain[block])
    return result


def _measure_block(result: Measured, frame: _Frame, edges: FloatArray, chain: IntArray) -> None:
    """Add the figures of some edges, halving those that are not smooth."""
    for left in reversed(range(_HALVINGS)):
        curves = frame.curves(edges, chain)
        result.outside[chain[curves.outside]] = True
        halved = ~curves.smooth & ~curves.outside & (curves.size > frame.shortest) & bool(left)
        result.torn[chain[curves.torn & ~halved]] = True
        _add(result, curves, chain, ~halved & ~curves.outside)
        halved &= ~result.outside[chain]
        if not halved.any():
            return
        ends = edges[halved]
        middle = 0.5 * (ends[:, :2] + ends[:, 2:])
        edges = np.concatenate([np.hstack([ends[:, :2], middle]), np.hstack([middle, ends[:, 2:]])])
        chain = np.tile(chain[halved], 2)


def _add(result: Measured, curves: _Curves, chain: IntArray, chosen: BoolArray) -> None:
    owner = chain[chosen]
    for name in _SUMS:
        values = getattr(curves, name)[chosen]
        getattr(result, name)[:] += np.bincount(owner, weights=values, minlength=len(result.length))
    np.maximum.at(result.bearing_most, owner, curves.bearing_most[chosen])


# ---- curves ---------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class _Curves:
    """Figures of edges, each of shape (n,), as those of `Measured`, and how well they are known."""

    map_length: FloatArray
    length: FloatArray
    map_area: FloatArray
    area: FloatArray
    bearing_square: FloatArray
    bearing_most: FloatArray
    outside: BoolArray
    smooth: BoolArray
    torn: BoolArray
    size: FloatArray  # metres that it is long on the ground, or in the polar map


class _Frame:
    """A map and its ground, with an origin for the areas of each chain."""

    def __init__(self, projection: Projection, place: Place, lon: FloatArray, lat: FloatArray, chain: IntArray) -> None:
        """`lon`, `lat` are the places where the edges begin."""
        self.projection, self.place, self.ellipsoid = projection, place, projection.ellipsoid
        self.shortest = _SHORTEST * self.ellipsoid.a
        first = np.flatnonzero(np.diff(chain, prepend=-1))
        # The pole that is nearer, on the whole, is in the middle of the map for areas.
        self.pole = np.where(np.bincount(chain, weights=np.nan_to_num(lat)) < 0.0, -1.0, 1.0)
        self.origin = np.nan_to_num(np.stack(projection(lon[first], lat[first]), axis=-1))
        self.polar_origin = np.nan_to_num(self._polar(lon[first], lat[first], self.pole))

    def curves(self, edges: FloatArray, chain: IntArray) -> _Curves:
        """The figures of edges (n, 4) of chains."""
        u, v = (edges[:, k, None] + (edges[:, k + 2] - edges[:, k])[:, None] * _SHARE for k in range(2))
        lon, lat = self.place(u, v)
        xy = np.stack(self.projection(lon, lat), axis=-1)
        outside = np.any(~np.isfinite(xy), axis=(1, 2))
        ground = _in_space(self.ellipsoid, lon, lat)
        polar = self._polar(lon, lat, self.pole[chain, None])
        # Away from where they begin, so that differences have all their digits.
        xy_rate, ground_rate, polar_rate = (_RATES @ (curve - curve[:, :1]) for curve in (xy, ground, polar))
        speed = np.linalg.norm(ground_rate, axis=-1)
        map_length, length, polar_length = (
            np.linalg.norm(rate, axis=-1) @ _WEIGHTS for rate in (xy_rate, ground_rate, polar_rate)
        )
        floor = _ROUNDING * self.ellipsoid.a
        with np.errstate(invalid="ignore"):
            smooth = np.ones(len(edges), dtype=bool)
            for curve, size in ((xy, map_length), (ground, length), (polar, polar_length)):
                smooth &= _tail(curve) <= _TAIL * size + floor
            torn = ~smooth & (map_length > _TEAR * np.maximum(length, floor))
        bearing = np.where(np.abs(lat) < 90.0 - _AT_A_POLE, _bearing_error(xy_rate, ground_rate, lon, lat), 0.0)
        return _Curves(
            map_length=map_length,
            length=length,
            map_area=_area(xy - self.origin[chain, None], xy_rate),
            area=_area(polar - self.polar_origin[chain, None], polar_rate),
            bearing_square=(speed * bearing**2) @ _WEIGHTS,
            bearing_most=np.max(np.abs(bearing), axis=-1, where=speed > 0.0, initial=0.0),
            outside=outside,
            smooth=smooth,
            torn=torn,
            size=np.maximum(length, polar_length),
        )

    def _polar(self, lon: FloatArray, lat: FloatArray, pole: FloatArray) -> FloatArray:
        """x, y in metres on the equal-area map about a pole (1 for the northern one), seen from above: (..., 2)."""
        outer = self.ellipsoid.area_below(90.0) - pole * self.ellipsoid.area_below(lat)
        radius, turn = np.sqrt(2.0 * np.maximum(outer, 0.0)), np.radians(lon)
        return np.stack([radius * np.cos(turn), pole * radius * np.sin(turn)], axis=-1)


def _in_space(ellipsoid: Ellipsoid, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Points of the ellipsoid in metres from its middle, (..., 3)."""
    _, normal = ellipsoid.radii(lat)
    turn, up = np.radians(lon), np.radians(lat)
    out = normal * np.cos(up)
    return np.stack(
        [out * np.cos(turn), out * np.sin(turn), normal * (1.0 - ellipsoid.eccentricity_squared) * np.sin(up)], axis=-1
    )


def _area(xy: FloatArray, rate: FloatArray) -> FloatArray:
    """Area that curves (n, 5, 2) sweep, seen from the origin; exact for the quartics."""
    return 0.5 * (xy[..., 0] * rate[..., 1] - xy[..., 1] * rate[..., 0]) @ _WEIGHTS


def _tail(curve: FloatArray) -> FloatArray:
    """The size of the last coefficient of curves (n, 5, d)."""
    return np.linalg.norm(np.einsum("j,njd->nd", _TO_LEGENDRE[4], curve - curve[:, :1]), axis=-1)


def _bearing_error(xy_rate: FloatArray, rate: FloatArray, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Degrees, within -180 and 180, by which bearings on the map, from its vertical, exceed the true ones."""
    turn, up = np.radians(lon), np.radians(lat)
    along = rate[..., 0] * np.cos(turn) + rate[..., 1] * np.sin(turn)
    east = rate[..., 1] * np.cos(turn) - rate[..., 0] * np.sin(turn)
    north = rate[..., 2] * np.cos(up) - along * np.sin(up)
    x, y = xy_rate[..., 0], xy_rate[..., 1]
    return np.degrees(np.arctan2(x * north - y * east, x * east + y * north))
