"""Geometries as chains of edges, and their lengths, areas and bearings on a map and on its ellipsoid."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from projdist._typing import AnyArray, BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid, planar, unwrapped
from projdist.projections import Projection

MISSING = "no geometry"
NOT_FINITE = "coordinates that are not numbers"
NO_DEGREES = "coordinates that are not longitudes and latitudes in degrees"
POINTS = "points only"
REPAIRED = "intersects itself: repaired"

_WIDE, _POLE = 180.0, 90.0  # degrees: wider edges go the shorter way, except along a pole
_TURN = 360.0
_FARTHEST, _OVER = 720.0, 1e-9  # degrees: longitudes twice round; latitudes that rounding puts beyond a pole
_POLYGONAL = (3, 6, 7)  # shapely's types: polygons, those of several parts, collections
_COMPOUND = 4  # the first of the types that have parts


@dataclass(frozen=True)
class Outlines:
    """The edges (m, 4) of features, each with the number of its chain (m,), a ring or a line."""

    edges: FloatArray
    chain: IntArray
    feature: IntArray  # (n,), the number of a chain's feature
    sign: FloatArray  # (n,), 1 for shells, -1 for holes, 0 for lines
    notes: AnyArray  # a text for each feature, mostly ""


def outlines(geometries: Iterable[Any], *, has_degrees: bool) -> Outlines:
    """The edges of geometries; polygons that intersect themselves are repaired first."""
    # With `has_degrees` edges wider than 180 degrees run the shorter way, and longitudes may be up to 720 degrees.
    shapes = np.array([*geometries, None], dtype=object)[:-1]
    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    xy, owner = shapely.get_coordinates(shapes, return_index=True)
    infinite = np.bincount(owner[~np.isfinite(xy).all(axis=1)], minlength=len(shapes)) > 0
    nowhere = np.zeros(len(shapes), dtype=bool)
    if has_degrees:
        with np.errstate(invalid="ignore"):
            in_degrees = (np.abs(xy[:, 0]) <= _FARTHEST) & (np.abs(xy[:, 1]) <= _POLE + _OVER)
        nowhere = ~infinite & (np.bincount(owner[~in_degrees], minlength=len(shapes)) > 0)
    shapes[missing | infinite | nowhere] = None
    if has_degrees:
        for index in np.unique(owner[np.abs(xy[:, 0]) > _TURN]):
            if shapes[index] is not None:  # PROJ has no longitudes beyond 573 degrees: begin within -180 and 180
                turns = [_TURN * np.round(shapely.get_coordinates(shapes[index])[0, 0] / _TURN), 0.0]
                shapes[index] = shapely.transform(shapes[index], lambda xy, turns=turns: xy - turns)
        for index in np.flatnonzero(_wide(shapes)):
            shapes[index] = shapely.GeometryCollection(_shorter_way(shapes[index]))
    invalid = np.isin(shapely.get_type_id(shapes), _POLYGONAL) & ~shapely.is_valid(shapes)
    shapes[invalid] = shapely.make_valid(shapes[invalid])
    chains, feature, sign = _chains(shapes)
    xy, owner = shapely.get_coordinates(chains, return_index=True)
    within = owner[1:] == owner[:-1]
    pointless = ~missing & (np.bincount(feature, minlength=len(shapes)) == 0)
    reasons = {MISSING: missing, NOT_FINITE: infinite, NO_DEGREES: nowhere, POINTS: pointless, REPAIRED: invalid}
    notes = np.select(list(reasons.values()), list(reasons), "").astype(object)  # the first reason that holds
    return Outlines(np.hstack([xy[:-1], xy[1:]])[within], owner[:-1][within], feature, sign, notes)


def _chains(shapes: AnyArray) -> tuple[AnyArray, IntArray, FloatArray]:
    """Rings and lines, with the number of the shape of each and its sign."""
    parts, owner = _simple(shapes)
    types = shapely.get_type_id(parts)
    rings, polygon = shapely.get_rings(parts[types == 3], return_index=True)
    shell = np.diff(polygon, prepend=-1) != 0
    lines = np.isin(types, (1, 2)) & (shapely.length(parts) > 0.0)  # others are points
    sign = np.concatenate([np.where(shell, 1.0, -1.0), np.zeros(int(lines.sum()))])
    return np.concatenate([rings, parts[lines]]), np.concatenate([owner[types == 3][polygon], owner[lines]]), sign


def _simple(shapes: AnyArray) -> tuple[AnyArray, IntArray]:
    """The simple parts of shapes, with the number of the shape of each."""
    parts, owner = shapely.get_parts(shapes, return_index=True)
    while (shapely.get_type_id(parts) >= _COMPOUND).any():
        parts, inner = shapely.get_parts(parts, return_index=True)
        owner = owner[inner]
    return parts, owner


# ---- longitudes ---------------------------------------------------------------------------


def _wide(shapes: AnyArray) -> BoolArray:
    """True for shapes in longitude and latitude with an edge wider than 180 degrees, which runs the shorter way."""
    chains, feature, _ = _chains(shapes)
    xy, owner = shapely.get_coordinates(chains, return_index=True)
    least = np.minimum(np.abs(xy[1:, 1]), np.abs(xy[:-1, 1]))
    wide = (owner[1:] == owner[:-1]) & (np.abs(np.diff(xy[:, 0])) > _WIDE) & (least < _POLE)
    return np.bincount(feature[owner[:-1][wide]], minlength=len(shapes)) > 0


def _shorter_way(shape: Any) -> list[Any]:
    """The polygons and lines in a shape, with longitudes that continue across the antimeridian."""
    found = []
    for part in _simple(np.array([shape]))[0]:
        if part.geom_type == "Polygon":
            found.append(planar([shapely.get_coordinates(ring) for ring in (part.exterior, *part.interiors)]))
        elif part.geom_type != "Point":
            line = unwrapped(shapely.get_coordinates(part))
            # A whole parallel from -180 to 180 would shrink to a point: it is taken as it is.
            found.append(shapely.LineString(line) if np.ptp(line, axis=0).any() else part)
    return found


# ---- edges ---------------------------------------------------------------------------------------

Place = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Longitude and latitude in degrees of coordinates; NaN where undefined."""

_X = np.array([-1.0, -np.sqrt(3.0 / 7.0), 0.0, np.sqrt(3.0 / 7.0), 1.0])
_SHARE = 0.5 * (1.0 + _X)  # of the way along an edge
_WEIGHTS = np.array([9.0, 49.0, 64.0, 49.0, 9.0]) / 180.0
_TO_LEGENDRE = np.linalg.inv(np.polynomial.legendre.legvander(_X, 4))
# Derivatives by the share of the way, (5, 5).
_RATES = 2.0 * np.polynomial.legendre.legval(_X, np.polynomial.legendre.legder(np.eye(5))).T @ _TO_LEGENDRE

_TAIL = 1e-6  # largest last Legendre coefficient, relative to an edge's length: bearings are then good to 1e-5 degrees
_ROUNDING = 1e-9  # of the Earth's radius, 6 mm: the uncertainty of PROJ's inverses, on map and ground alike
_SHORTEST = 1e-5  # of the radius, 64 m: shorter edges are not halved
_HALVINGS = 24
_TEAR = 1e3  # ratio of map to ground length above which an edge that is not smooth is torn
_AT_A_POLE = 1e-9  # degrees from a pole, where there is no north
_AT_ONCE = 50_000  # edges; 100 MB
_SUMS = ("map_length", "length", "map_area", "area", "bearing_square")


@dataclass(frozen=True, kw_only=True)
class ChainFigures:
    """Figures of chains of edges on the map and on the ground, each of shape (n,), in metres and m^2."""

    outside: BoolArray  # a point is not on the map
    torn: BoolArray  # the chain crosses a cut of the map
    map_length: FloatArray
    length: FloatArray
    map_area: FloatArray
    area: FloatArray  # signed, like that on the map, and defined for closed chains
    bearing_square: FloatArray  # integral along the ground of the squared difference of grid and true bearing
    bearing_most: FloatArray  # largest absolute value of that difference, in degrees


def measure_chains(projection: Projection, place: Place, edges: FloatArray, chain: IntArray) -> ChainFigures:
    """Figures of chains 0, 1, ... with edges (m, 4), u, v of begin and end; their chains (m,) ascend."""
    count = int(chain[-1]) + 1 if len(chain) else 0
    never = np.zeros(count, dtype=bool)
    figures: dict[str, FloatArray] = {name: np.zeros(count) for name in (*_SUMS, "bearing_most")}
    result = ChainFigures(outside=never, torn=never.copy(), **figures)
    if not count:
        return result
    lon, lat = place(edges[:, 0], edges[:, 1])
    frame = _Frame(projection, place, lon, lat, chain)
    for first in range(0, len(edges), _AT_ONCE):
        block = slice(first, first + _AT_ONCE)
        _add_figures(result, frame, edges[block], chain[block])
    return result


def _add_figures(result: ChainFigures, frame: _Frame, edges: FloatArray, chain: IntArray) -> None:
    """Add the figures of some edges, halving those that are not smooth."""
    for left in reversed(range(_HALVINGS)):
        curves = frame.curves(edges, chain)
        result.outside[chain[curves.outside]] = True
        halved = ~curves.smooth & ~curves.outside & (curves.size > frame.shortest) & bool(left)
        result.torn[chain[curves.torn & ~halved]] = True
        chosen = ~halved & ~curves.outside
        for name in _SUMS:
            values = getattr(curves, name)[chosen]
            getattr(result, name)[:] += np.bincount(chain[chosen], weights=values, minlength=len(result.length))
        np.maximum.at(result.bearing_most, chain[chosen], curves.bearing_most[chosen])
        halved &= ~result.outside[chain]
        if not halved.any():
            return
        ends = edges[halved]
        middle = 0.5 * (ends[:, :2] + ends[:, 2:])
        edges = np.concatenate([np.hstack([ends[:, :2], middle]), np.hstack([middle, ends[:, 2:]])])
        chain = np.tile(chain[halved], 2)


# ---- curves ---------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class _EdgeFigures(ChainFigures):
    """Figures of edges, each (n,), with their smoothness and size."""

    smooth: BoolArray
    size: FloatArray  # metres on the ground, or on the polar map if that is more


class _Frame:
    """A map and the ellipsoid, with an origin for the areas of each chain."""

    def __init__(self, projection: Projection, place: Place, lon: FloatArray, lat: FloatArray, chain: IntArray) -> None:
        """Set the origins from the longitudes and latitudes at which edges begin."""
        self.projection, self.place, self.ellipsoid = projection, place, projection.ellipsoid
        self.shortest = _SHORTEST * self.ellipsoid.a
        first = np.flatnonzero(np.diff(chain, prepend=-1))
        # The map for areas is centred on the pole that is nearer on average.
        self.pole = np.where(np.bincount(chain, weights=np.nan_to_num(lat)) < 0.0, -1.0, 1.0)
        self.origin = np.nan_to_num(np.stack(projection(lon[first], lat[first]), axis=-1))
        self.polar_origin = np.nan_to_num(self._polar(lon[first], lat[first], self.pole))

    def curves(self, edges: FloatArray, chain: IntArray) -> _EdgeFigures:
        """The figures of edges (n, 4) of chains."""
        u, v = (edges[:, k, None] + (edges[:, k + 2] - edges[:, k])[:, None] * _SHARE for k in range(2))
        lon, lat = self.place(u, v)
        xy = np.stack(self.projection(lon, lat), axis=-1)
        outside = np.any(~np.isfinite(xy), axis=(1, 2))
        ground = _in_space(self.ellipsoid, lon, lat)
        polar = self._polar(lon, lat, self.pole[chain, None])
        # Relative to the beginning, so that differences keep all digits.
        xy_rate, ground_rate, polar_rate = (_RATES @ (curve - curve[:, :1]) for curve in (xy, ground, polar))
        speed = np.linalg.norm(ground_rate, axis=-1)
        map_length, length, polar_length = (
            np.linalg.norm(rate, axis=-1) @ _WEIGHTS for rate in (xy_rate, ground_rate, polar_rate)
        )
        floor = _ROUNDING * self.ellipsoid.a
        with np.errstate(invalid="ignore"):
            smooth = np.ones(len(edges), dtype=bool)
            for curve, size in ((xy, map_length), (ground, length), (polar, polar_length)):
                last = np.linalg.norm(np.einsum("j,njd->nd", _TO_LEGENDRE[4], curve - curve[:, :1]), axis=-1)
                smooth &= last <= _TAIL * size + floor
            torn = ~smooth & (map_length > _TEAR * np.maximum(length, floor))
        bearing = np.where(np.abs(lat) < 90.0 - _AT_A_POLE, _bearing_error(xy_rate, ground_rate, lon, lat), 0.0)
        return _EdgeFigures(
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
    """Points on the ellipsoid in metres from its centre, (..., 3)."""
    _, normal = ellipsoid.radii(lat)
    turn, up = np.radians(lon), np.radians(lat)
    out = normal * np.cos(up)
    return np.stack(
        [out * np.cos(turn), out * np.sin(turn), normal * (1.0 - ellipsoid.eccentricity_squared) * np.sin(up)], axis=-1
    )


def _area(xy: FloatArray, rate: FloatArray) -> FloatArray:
    """Area that curves (n, 5, 2) sweep about the origin, exact for quartics."""
    return 0.5 * (xy[..., 0] * rate[..., 1] - xy[..., 1] * rate[..., 0]) @ _WEIGHTS


def _bearing_error(xy_rate: FloatArray, rate: FloatArray, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Grid bearing less true bearing, degrees within -180 and 180."""
    turn, up = np.radians(lon), np.radians(lat)
    along = rate[..., 0] * np.cos(turn) + rate[..., 1] * np.sin(turn)
    east = rate[..., 1] * np.cos(turn) - rate[..., 0] * np.sin(turn)
    north = rate[..., 2] * np.cos(up) - along * np.sin(up)
    x, y = xy_rate[..., 0], xy_rate[..., 1]
    return np.degrees(np.arctan2(x * north - y * east, x * east + y * north))
