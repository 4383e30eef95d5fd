"""Spectral panels: a projection sampled at Gauss nodes, differentiated and integrated."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Self

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Discontinuities, Ellipsoid
from projdist.numerics import DIFFERENTIATE, LEGENDRE, NODES, ORDER
from projdist.projections import Projection
from projdist.regions import Clips, Region


class Rows:
    """Base of dataclasses whose fields are arrays with one first axis."""

    def take(self, index: IntArray | BoolArray) -> Self:
        """The rows of an index or a mask."""
        if index.dtype == bool and index.all():
            return self
        return type(self)(**{name: values[index] for name, values in vars(self).items()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Several tables, one below the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


# ---- seams along the sides of panels -------------------------------------------------------------

_DEEPEST = 8  # strips of strips, each a 38th as wide; the last is as wide as rounding
_INSET = 1e-9  # of half a panel: a seam on the side itself does no harm
LINES = [1, 4, 8]  # the nodes through which lines go from side to side
_LINES = NODES[LINES]
_SIDES = np.array([_INSET - 1.0, 1.0 - _INSET])
_STATIONS = np.concatenate([_SIDES, NODES])
_EXTRAPOLATE = np.polynomial.legendre.legvander(_SIDES, ORDER - 1) @ LEGENDRE
_STRIP = 1.0 + NODES[0]  # of half a panel: as far as the first node
_LEAST = 1e-3  # of the semi-major axis; smaller jumps do not matter in so narrow a strip
_EIGHTHS = np.arange(9.0)[:, None] / 8.0
_DIVISIONS, _MOST_OF_IT = 4, 0.1
_UNRESOLVED = 10.0  # times the last coefficients, as large as the rest of a series that falls slowly


def torn_sides(
    projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray, nodes: FloatArray, ends: FloatArray
) -> BoolArray:
    """True where a seam lies between the outermost nodes and a side: (n, 2, 2), by u and v, low and high."""
    # `nodes` (2, n, 2, p, 3) are x and y on three lines along u and three along v, `ends` (2, n, 2, 2, 3) those where
    # the lines meet the sides. A suspect step is divided until it turns out to be steep or torn.
    jump_x, jump_y = ends - _EXTRAPOLATE @ nodes
    jump = np.hypot(jump_x, jump_y)
    last = np.hypot(*np.abs(LEGENDRE[-2:] @ nodes).max(axis=-2))
    suspect = jump > np.maximum(_LEAST * projection.ellipsoid.a, _UNRESOLVED * last[..., None, :])
    if not suspect.any():
        return np.zeros(suspect.shape[:-1], dtype=bool)
    for axis in (0, 1):
        panel, side, line = np.nonzero(suspect[:, axis])
        if not panel.size:
            continue
        # From the last node to the side.
        last = np.where(side == 0, 0, NODES.size - 1)
        places = [
            (each[panel, axis, side, line], each[panel, axis, len(_SIDES) + last, line])
            for each in _lines(rectangles, _STATIONS)
        ]
        values = ends[:, panel, axis, side, line], nodes[:, panel, axis, last, line]
        left = _smallest_step(projection, region, patch[panel], np.array(places), np.stack(values, axis=1))
        suspect[panel, axis, side, line] = left > _MOST_OF_IT * jump[panel, axis, side, line]
    return np.asarray(suspect.any(axis=-1))


def without_seams(
    projection: Projection, region: Region, patch: IntArray, rectangles: FloatArray, torn: BoolArray
) -> tuple[IntArray, FloatArray, int]:
    """Panels (n, 4) with the strips along their `torn` sides cut off, in turn, and the evaluations that this took."""
    finished: list[tuple[IntArray, FloatArray]] = []
    evaluations = 0
    for turn in range(_DEEPEST):
        if turn:
            points = region.chart(patch[:, None, None, None], *_lines(rectangles, _STATIONS))
            xy = np.stack(projection(points.lon, points.lat))
            nodes, sides = xy[..., len(_SIDES) :, :], xy[..., : len(_SIDES), :]
            torn = torn_sides(projection, region, patch, rectangles, nodes, sides)
            evaluations += xy[0].size
        hit = torn.any(axis=(1, 2))
        finished.append((patch[~hit], rectangles[~hit]))
        patch, rectangles = patch[hit], rectangles[hit]
        if not len(patch):
            break
        index, rectangles = _divided(rectangles, torn[hit])
        patch = patch[index]
    else:
        finished.append((patch, rectangles))
    return np.concatenate([one for one, _ in finished]), np.concatenate([one for _, one in finished]), evaluations


def _lines(rectangles: FloatArray, stations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u and v (n, 2, k, 3) at stations (k,) in [-1, 1] on the three lines along u and the three along v."""
    along, across = np.broadcast_arrays(stations[:, None], _LINES)
    shares = np.stack([along, across]), np.stack([across, along])
    low, high = rectangles.T[0::2, :, None, None, None], rectangles.T[1::2, :, None, None, None]
    u, v = (0.5 * (low[k] + high[k]) + 0.5 * (high[k] - low[k]) * shares[k] for k in (0, 1))
    return u, v


def _smallest_step(
    projection: Projection, region: Region, patch: IntArray, ends: FloatArray, f: FloatArray
) -> FloatArray:
    """The largest steps (n,) of f in tiny parts of the ways between ends u, v (2, 2, n), where f has x, y (2, 2, n)."""
    # The way is divided into eight, and the part with the largest step again: at a kink or a steep place next to
    # nothing of the step is left, at a tear all of it.
    rows = np.arange(len(patch))
    for _ in range(_DIVISIONS):
        u, v = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * _EIGHTHS
        points = region.chart(patch, u[1:-1], v[1:-1])
        between = np.stack(projection(points.lon, points.lat))
        f = np.concatenate([f[:, :1], between, f[:, 1:]], axis=1)
        step = np.nan_to_num(np.hypot(*np.diff(f, axis=1)), nan=-1.0)
        most = step.argmax(axis=0)
        both = np.stack([most, most + 1])
        ends, f = np.stack([u, v])[:, both, rows], f[:, both, rows]
    return np.asarray(np.hypot(*(f[:, 1] - f[:, 0])))


def _divided(rectangles: FloatArray, torn: BoolArray) -> tuple[IntArray, FloatArray]:
    """The parts into which strips along torn sides (n, 2, 2) divide rectangles, and the index of each rectangle."""
    index, parts = [], []
    for k, (rectangle, sides) in enumerate(zip(rectangles, torn, strict=True)):
        edges = []
        for axis in (0, 1):
            low, high = rectangle[2 * axis : 2 * axis + 2]
            width = 0.5 * (high - low) * _STRIP
            inner = [at for at, cut in zip((low + width, high - width), sides[axis], strict=True) if cut]
            edges.append([low, *inner, high])
        for in_u, in_v in product(*map(pairwise, edges)):
            index.append(k)
            parts.append((*in_u, *in_v))
    return np.array(index, dtype=int), np.array(parts)


# ---- panels without a map ------------------------------------------------------------------------

Partials = tuple[FloatArray | float, FloatArray | float, FloatArray | float, FloatArray | float]
"""du/dr, du/ds, dv/dr and dv/ds, with r and s in [-1, 1] along the two node axes."""

_REGIONS = 16  # whose plans are kept
_MOST = 400  # panels of a plan: 6 to 8 kB each, and those of the first generation besides
_WAYS = 8  # first generations of a plan
_U, _V, _LON, _LAT, _DENSITY, _WEIGHT, _EAST_R, _NORTH_S, _EAST_S, _NORTH_R = range(10)
_SHARE, _AREA, _ALONG = 0, 1, slice(2, 4)


@dataclass(frozen=True)
class Layout:
    """The nodes of panels, or of smooth pieces of them, on an ellipsoid, without a map.

    `grids` (k, n, p, p) are the chart coordinates u, v, longitudes and latitudes in degrees, m^2 in the unit square of
    the nodes, m^2 by node, and d(east, north) / d(r, s) in metres, of which the mixed ones are left out where they
    vanish. `numbers` (n, 4) are each piece's share in the region, its area in m^2 and the mean metres along r and s.
    """

    patch: IntArray
    grids: FloatArray
    numbers: FloatArray

    u = property(lambda self: self.grids[_U])
    v = property(lambda self: self.grids[_V])
    lon = property(lambda self: self.grids[_LON])
    lat = property(lambda self: self.grids[_LAT])
    density = property(lambda self: self.grids[_DENSITY])
    weight = property(lambda self: self.grids[_WEIGHT])
    share = property(lambda self: self.numbers[:, _SHARE])
    area = property(lambda self: self.numbers[:, _AREA])
    metres = property(lambda self: self.numbers[:, _ALONG])

    @property
    def sides(self) -> FloatArray:
        """d(east, north) / d(r, s) in metres (n, p, p, 2, 2)."""
        sides = np.zeros((*self.lon.shape, 2, 2))
        sides[..., 0, 0], sides[..., 1, 1] = self.grids[_EAST_R], self.grids[_NORTH_S]
        if len(self.grids) > _EAST_S:
            sides[..., 0, 1], sides[..., 1, 0] = self.grids[_EAST_S], self.grids[_NORTH_R]
        return sides

    def jacobian(self, f_r: FloatArray, f_s: FloatArray) -> FloatArray:
        """J (n, p, p, 2, 2) from the derivatives (2, n, p, p) of x and y along r and s."""
        east_r, north_s = self.grids[_EAST_R], self.grids[_NORTH_S]
        J = np.empty((*self.lon.shape, 2, 2))
        by_east, by_north = J[..., 0], J[..., 1]
        if len(self.grids) == _EAST_S:
            for i in (0, 1):
                np.divide(f_r[i], east_r, out=by_east[..., i])
                np.divide(f_s[i], north_s, out=by_north[..., i])
            return J
        east_s, north_r = self.grids[_EAST_S], self.grids[_NORTH_R]
        det = east_r * north_s - east_s * north_r
        for i in (0, 1):
            by_east[..., i] = (f_r[i] * north_s - f_s[i] * north_r) / det
            by_north[..., i] = (f_s[i] * east_r - f_r[i] * east_s) / det
        return J


def lay(
    region: Region,
    ellipsoid: Ellipsoid,
    patch: IntArray,
    u: FloatArray,
    v: FloatArray,
    partials: Partials,
    rule: FloatArray,
    whole: BoolArray,
) -> Layout:
    """The layout of pieces with u, v and weights `rule` at nodes (n, p, p); `whole` pieces have Gauss's rule."""
    points = region.chart(patch[:, None, None], u, v)
    meridian, vertical = ellipsoid.radii(points.lat)
    u_r, u_s, v_r, v_s = partials
    mixed = (points.east_v, points.north_u, u_s, v_r)
    straight = not any(isinstance(value, np.ndarray) or value for value in mixed)
    grids = np.empty((_EAST_S if straight else _NORTH_R + 1, *u.shape))
    grids[_U], grids[_V], grids[_LON], grids[_LAT] = u, v, points.lon, points.lat
    grids[_EAST_R] = (points.east_u * u_r + points.east_v * v_r) * vertical
    grids[_NORTH_S] = (points.north_u * u_s + points.north_v * v_s) * meridian
    det = grids[_EAST_R] * grids[_NORTH_S]
    square_r, square_s = grids[_EAST_R] ** 2, grids[_NORTH_S] ** 2
    if not straight:
        grids[_EAST_S] = (points.east_u * u_s + points.east_v * v_s) * vertical
        grids[_NORTH_R] = (points.north_u * u_r + points.north_v * v_r) * meridian
        det -= grids[_EAST_S] * grids[_NORTH_R]
        square_r += grids[_NORTH_R] ** 2
        square_s += grids[_EAST_S] ** 2
    np.abs(det, out=grids[_DENSITY])
    np.multiply(grids[_DENSITY], rule, out=grids[_WEIGHT])
    numbers = np.empty((len(u), 4))
    numbers[:, _SHARE] = np.where(whole, 1.0, 0.25 * rule.sum(axis=(1, 2)))
    numbers[:, _AREA] = grids[_WEIGHT].sum(axis=(1, 2))
    for column, square in zip((2, 3), (square_r, square_s), strict=True):
        numbers[:, column] = np.sqrt(square).mean(axis=(1, 2))
    grids.flags.writeable = numbers.flags.writeable = False  # a plan keeps them
    return Layout(patch, grids, numbers)


@dataclass(frozen=True)
class First:
    """The first panels of a region, and the points to evaluate: their nodes, then (n, 2, 2, 3) on their sides."""

    clips: Clips
    layout: Layout
    lon: FloatArray
    lat: FloatArray


@dataclass(eq=False)
class Plan:
    """The layouts of a region's panels on an ellipsoid, which are kept once they are made."""

    region: Region
    ellipsoid: Ellipsoid
    _kept: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    _first: dict[Discontinuities, First] = field(default_factory=dict)

    def first(self, breaks: Discontinuities) -> First:
        """The region's first panels, for maps with some discontinuities."""
        if breaks not in self._first:
            if len(self._first) == _WAYS:
                self._first.pop(next(iter(self._first)))
            patch, rectangles = self.region.panels(breaks)
            clips = self.region.clip(patch, rectangles)
            layout = self._layout_of(patch[clips.kept], clips)
            sides = self.region.chart(layout.patch[:, None, None, None], *_lines(clips.rectangles, _SIDES))
            lon = np.concatenate([layout.lon.ravel(), np.ravel(sides.lon)])
            lat = np.concatenate([layout.lat.ravel(), np.ravel(sides.lat)])
            self._first[breaks] = First(clips, layout, lon, lat)
        return self._first[breaks]

    def layout(self, patch: IntArray, clips: Clips) -> Layout:
        """The layout of clipped panels of patches (n,)."""
        keys = [(number, *sides) for number, sides in zip(patch.tolist(), clips.rectangles.tolist(), strict=True)]
        kept = self._kept
        new = [i for i, key in enumerate(keys) if key not in kept]
        if new:
            index = np.array(new)
            layout = self._layout_of(patch[index], Clips(*(values[index] for values in clips)))
            if len(new) == len(keys) and len(kept) + len(new) > _MOST:
                return layout
            found = {keys[i]: (layout.grids[:, k].copy(), layout.numbers[k]) for k, i in enumerate(new)}
            if len(kept) + len(new) <= _MOST:
                kept.update(found)
            else:
                kept = kept | found
        blocks = [kept[key] for key in keys]
        return Layout(patch, np.stack([grid for grid, _ in blocks], axis=1), np.array([one for _, one in blocks]))

    def _layout_of(self, patch: IntArray, clips: Clips) -> Layout:
        u0, u1, v0, v1 = clips.rectangles.T[..., None, None]
        half_u, half_v = 0.5 * (u1 - u0), 0.5 * (v1 - v0)
        shape = (len(patch), NODES.size, NODES.size)
        u = np.broadcast_to(u0 + half_u * (1.0 + NODES[:, None]), shape)
        v = np.broadcast_to(v0 + half_v * (1.0 + NODES), shape)
        partials = (half_u, 0.0, 0.0, half_v)
        return lay(self.region, self.ellipsoid, patch, u, v, partials, clips.rule, clips.whole)


# Maps that are compared or optimised have their region in common.
plan_of = functools.lru_cache(maxsize=_REGIONS)(Plan)


# ---- panels with a map ---------------------------------------------------------------------------

# From one side along a node axis: the derivative, and the last Legendre coefficients.
_FROM_LEFT = np.concatenate([DIFFERENTIATE, LEGENDRE[ORDER - 6 :]])
_FROM_RIGHT = np.ascontiguousarray(_FROM_LEFT.T)
_FALLING = 0.5  # pairs of coefficients that fall at least so fast go on falling; those of kinks and rounding do not
_ROUNDING = 1e-12  # of x and y; PROJ's own arithmetic included
_BLURRED, _HARMLESS = 0.05, 0.01  # of J's largest coefficient except the constant; per radian
_SLOPE = 1.0  # of the last polynomials: it reaches 45 at the ends, but most of that integrates to nothing


@dataclass(kw_only=True)
class Pieces(Rows):
    """Smooth pieces of panels: whole panels, or parts on one side of a cut; or points, with one node each.

    The first axis of each array is that of the pieces; those with values at nodes have two more, of the nodes. Where an
    edge of polygons crosses a panel, some nodes lie outside, and weights have either sign: they integrate the
    polynomial through the nodes over the part inside.
    """

    panel: IntArray
    patch: IntArray
    u: FloatArray
    v: FloatArray
    lon: FloatArray
    lat: FloatArray
    jacobian: FloatArray
    hessian: FloatArray  # (n, p, p, 2, 2, 2), per radian of the semi-major axis, NaN at kinks; (n, 0) if not needed
    sides: FloatArray  # (n, p, p, 2, 2), m, d(east, north) / d(r, s) of the node coordinates in [-1, 1]; (n, 0) if none
    density: FloatArray  # m^2 in the unit square of the nodes
    weight: FloatArray  # m^2, or a point's own; of either sign in panels that the region's edge crosses
    share: FloatArray  # (n,), of the piece that is in the region; 1 for the whole of it
    unresolved: FloatArray  # last Legendre coefficients of x and y, in semi-major axes: rounding, or a seam
    doubt: FloatArray  # (n, 2), changes of the logarithms of the scales that `unresolved` may cause, along u and v


def pieces_of(
    projection: Projection, panel: IntArray, layout: Layout, xy: FloatArray | None = None, *, curved: bool
) -> Pieces:
    """The pieces of a layout under a projection, whose xy (2, n, p, p) may be given; `curved` pieces have `sides`."""
    ellipsoid = projection.ellipsoid
    xy = np.stack(projection(layout.lon, layout.lat)) if xy is None else xy
    # Less a constant, there is less to round, and nothing where PROJ snaps to a pole line.
    moved = xy - xy[..., :1, :1]
    shape = moved.shape
    along_s = (moved.reshape(-1, ORDER) @ _FROM_RIGHT).reshape(*shape[:-1], -1)
    along_r = _FROM_LEFT @ moved
    J = layout.jacobian(along_r[..., :ORDER, :], along_s[..., :ORDER])
    ends = np.abs(along_r[..., ORDER:, :]).max(axis=(0, 3)), np.abs(along_s[..., ORDER:]).max(axis=(0, 2))
    last = np.stack(ends, axis=1)
    pairs = np.maximum(last[..., ::2], last[..., 1::2])
    left, decay = pairs[..., -1], _decay(pairs)
    # Rounding of x and y is white, and the integrand's own coefficients see it.
    size = np.abs(xy).reshape(2, shape[1], -1).max(axis=(0, 2))
    det = J[..., 0, 0] * J[..., 1, 1]
    det -= J[..., 0, 1] * J[..., 1, 0]
    scale = np.sqrt(np.abs(det).mean(axis=(1, 2)))[:, None]
    seen = (left > _ROUNDING * size[:, None]) & (scale > 0)
    doubt = np.zeros_like(left)
    if seen.any():
        np.divide(_SLOPE * decay**0.75 * left, layout.metres * scale, out=doubt, where=seen)
        np.log1p(doubt, out=doubt)
    return Pieces(
        panel=panel,
        patch=layout.patch,
        u=layout.u,
        v=layout.v,
        lon=layout.lon,
        lat=layout.lat,
        jacobian=J,
        hessian=np.empty((len(J), 0)),
        sides=layout.sides if curved else np.empty((len(layout.patch), 0)),
        density=layout.density,
        weight=layout.weight,
        share=layout.share,
        unresolved=left.max(axis=-1) / ellipsoid.a,
        doubt=doubt,
    )


def second_derivatives(pieces: Pieces, ellipsoid: Ellipsoid) -> FloatArray:
    """H (n, p, p, 2, 2, 2) along geodesics at the nodes, in 1/m."""
    # In the node coordinates, in which the map and the sides are as smooth as they can be, it is the second derivatives
    # less the Jacobian of how the coordinate lines bend; the frame of east and north turns by sin(lat) per longitude.
    sides = pieces.sides
    tangents = np.moveaxis(pieces.jacobian @ sides, (-2, -1), (0, 1))  # df / d(r, s)
    east, north = np.moveaxis(sides, (-2, -1), (0, 1))
    turn = np.tan(np.radians(pieces.lat)) / ellipsoid.radii(pieces.lat)[1] * east
    H = np.empty((*pieces.jacobian.shape, 2))
    for j, k in ((0, 0), (0, 1), (1, 1)):
        to_east = _along(j, east[k]) - turn[j] * north[k]
        to_north = _along(j, north[k]) + turn[j] * east[k]
        for i in (0, 1):
            bent = pieces.jacobian[..., i, 0] * to_east + pieces.jacobian[..., i, 1] * to_north
            H[..., i, j, k] = H[..., i, k, j] = _along(j, tangents[i, k]) - bent
    back = np.linalg.inv(sides)[..., None, :, :]
    return np.asarray(back.swapaxes(-1, -2) @ H @ back)


def blurred(pieces: Pieces, index: IntArray, ellipsoid: Ellipsoid) -> BoolArray:
    """True for the pieces of an index in which J is too rough for flexion and skewness."""
    J = np.moveaxis(pieces.jacobian[index], (-2, -1), (1, 2))
    along = np.stack([np.abs(LEGENDRE @ J).max(axis=(1, 2, 4)), np.abs(J @ LEGENDRE.T).max(axis=(1, 2, 3))], axis=1)
    last = np.maximum(along[..., -1], along[..., -2])
    metres = np.hypot(pieces.sides[index][..., 0, :], pieces.sides[index][..., 1, :]).mean(axis=(1, 2))
    scale = np.sqrt(np.abs(J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]).mean(axis=(1, 2)))[:, None]
    harm = last * ellipsoid.a > _HARMLESS * scale * metres
    return np.asarray((harm & (last > _BLURRED * along[..., 1:].max(axis=-1))).any(axis=1))


def _along(axis: int, f: FloatArray) -> FloatArray:
    """Derivatives along one of the node axes of values at the nodes (..., p, p)."""
    return DIFFERENTIATE @ f if axis == 0 else f @ DIFFERENTIATE.T


def _decay(pairs: FloatArray) -> FloatArray:
    """Estimated ratio of the next pair of coefficients to the last, from the last three; 1 where they do not fall."""
    before, last = pairs[..., :-1], pairs[..., 1:]
    ratio = np.divide(last, before, out=np.zeros_like(last), where=before > 0).max(axis=-1)
    return np.where(ratio < _FALLING, ratio, 1.0)


def tails(values: FloatArray, density: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sizes (..., 2) of the integrands' last Legendre coefficients along the node axes, and the integrals' errors."""
    # Gauss's rule is exact for twice as many coefficients as there are nodes. So where the last pairs fall, the error
    # is taken to be as large as the next pair but one (Berntsen & Espelid 1991, ACM TOMS 17:233, take the next but
    # three or more). If only a share of a piece is in the region, the error is as large as the next pair.
    c = LEGENDRE @ (values * density) @ LEGENDRE.T
    square = c * c
    along = np.stack([square.sum(axis=-1), square.sum(axis=-2)], axis=-2)[..., ORDER - 6 :]
    # The integral over [-1, 1]^2 of the constant term is 4 times it.
    pairs = 4.0 * share[:, None, None] * np.sqrt(along[..., ::2] + along[..., 1::2])
    return pairs[..., -1], pairs[..., -1] * _decay(pairs) ** np.where(share == 1.0, 2, 1)[:, None]
