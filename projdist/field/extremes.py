"""Largest and smallest values of measures over a region, their places, and by how much they may be exceeded."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field import extreme_bounds as bounds
from projdist.field.at_points import derivatives
from projdist.field.extreme_bounds import Goal, Polynomials
from projdist.field.panels import Pieces, Rows
from projdist.field.stencils import hessian
from projdist.numerics import ORDER
from projdist.projections import Projection
from projdist.regions import Region


class Extreme(NamedTuple):
    """A largest or smallest value and its place; infinite if the measure grows without bound towards the place."""

    value: float
    lon: float
    lat: float
    error: float = np.nan  # by how much the true extreme may lie beyond, with rounding; NaN if infinite


@dataclass(frozen=True)
class Chosen(Rows):
    """Pieces with a goal's bounds and errors there."""

    piece: IntArray
    bound: FloatArray
    error: FloatArray


_NONE = Chosen(np.empty(0, dtype=int), np.empty(0), np.empty(0))


class State:
    """The search for one goal: a value that it certainly reaches, a bound, and the pieces still to look at."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.live = np.empty(0, dtype=int)  # pieces to be looked at
        self.good, self.rough = [_NONE], [_NONE]  # pieces with and without polynomials that are good enough
        self.known = -np.inf
        self.known_at: tuple[float, float] | None = None
        self.bound = -np.inf  # of all pieces that were looked at and left
        self.exact = 0.0  # differences that are no more than rounding
        self.places: list[tuple[float, float]] = []  # where the goal may be largest

    def raise_bound(self, bounds: FloatArray | float) -> None:
        """Raise the bound by those of pieces that are left."""
        self.bound = max(self.bound, float(np.max(bounds, initial=-np.inf)))


# ---- values at places ----------------------------------------------------------------------------

_EXACT = 1e-10  # relative error of scales to which a search goes, above the rounding of derivatives
BENT = 1e-7  # of the second derivatives
_LEAST = 2e-12  # relative error of J that differences leave


def _measured(projection: Projection, states: Sequence[State], found: Sequence[Extreme]) -> list[Extreme]:
    """The largest value of each goal at its places, by derivatives there, with its error; else its best node."""
    places = [place for state in states for place in state.places]
    bent = any(state.goal.measure.needs_hessian for state in states)
    lon, lat = np.array(places).reshape(-1, 2).T
    fields, errors = fields_at(projection, lon, lat, bent)
    ends = np.cumsum([len(state.places) for state in states])
    parts = zip(np.split(fields, ends[:-1]), np.split(errors, ends[:-1]), strict=True)
    result = []
    for state, best, (own, own_errors) in zip(states, found, parts, strict=True):
        values, rounding = state.goal.of(own), 0.0
        if np.isfinite(values).any():
            changes = state.goal.change(own, own_errors)
            certain = np.where(np.isfinite(changes) & np.isfinite(values), values - np.nan_to_num(changes), -np.inf)
            top = int((certain if np.isfinite(certain).any() else values).argmax())
            best, rounding = Extreme(float(values[top]), *state.places[top]), float(changes[top])
        # If the map is singular at the place, polynomials beside it know more.
        singular = state.known_at in state.places and values[state.places.index(state.known_at)] == -np.inf
        if state.known_at is not None and singular and state.known > best.value:
            best, rounding = Extreme(state.known, *state.known_at), 0.0
        result.append(best._replace(error=max(state.bound - best.value, 0.0) + rounding))
    return result


def fields_at(projection: Projection, lon: FloatArray, lat: FloatArray, bent: bool) -> tuple[FloatArray, FloatArray]:
    """The entries of J (and of H if `bent`) at points, and their errors, both (n, k)."""
    lon, lat = np.asarray(lon), np.asarray(lat)
    found = derivatives(projection, lon, lat)
    field = found.jacobian.reshape(-1, 4)
    error = (_size(field) * np.maximum(found.error, _LEAST))[:, None] * np.ones(4)
    if bent:
        H = hessian(projection, lon, lat).reshape(-1, 8)
        field, lost = np.concatenate([field, H], axis=1), BENT * np.maximum(np.abs(H).max(axis=1), _size(field))
        error = np.concatenate([error, np.broadcast_to(lost[:, None], H.shape)], axis=1)
    return field, error


def _size(field: FloatArray) -> FloatArray:
    """The scale of J, from fields (..., k)."""
    return np.sqrt(0.5 * (field[..., :4] ** 2).sum(axis=-1))


# ---- measures without bound ----------------------------------------------------------------------

_BROAD = 3e-3  # of the largest panel's area
# Distances from the maximum, over that of the middle of the nearest broad panel. None is smaller: maps often are
# undefined in the last thousandths of a degree before a singular point, which then is not found itself.
_APPROACH = 10.0 ** -np.arange(0.5, 2.5, 0.5)
_NEARER = 10.0 ** -np.arange(1.5, 5.25, 0.25)  # on the way to a pole, where growth may come to an end
_BESIDE = 0.1  # degrees from a pole
_ALIKE = 1.5  # times the largest value on a panel's meridian there: larger values are of another kind
_SLOWING = 0.75  # a logarithm gains the same in every step, a square root half of the last, a smooth maximum a tenth
_GROWTH = 1e-3  # of the value, in a step
_FEWEST = 3  # steps where it is defined


def _unbounded(
    projection: Projection, pieces: Pieces, goals: Sequence[Goal], found: Sequence[Extreme]
) -> list[Extreme]:
    """The extremes found for goals, infinite where a goal grows without bound on the way to its place."""
    # The way leads from the middle of the nearest broad panel. A goal without bound grows by no less in every step, and
    # also beside a pole. Only signed measures, such as logarithms, may fall without bound.
    may_grow = [not goal.measure.bounded and (goal.largest or goal.measure.kind == "signed") for goal in goals]
    doubtful = [k for k, one in enumerate(found) if may_grow[k] and np.isfinite(one.value)]
    result = list(found)
    if not doubtful:
        return result
    areas = pieces.weight.sum(axis=(1, 2))
    middle = pieces.lon.shape[-1] // 2
    broad = (areas >= _BROAD * areas.max(), middle, middle)
    lon, lat = np.array([found[k][1:3] for k in doubtful]).T[:, :, None]
    east, north = (pieces.lon[broad] - lon + 180.0) % 360.0 - 180.0, pieces.lat[broad] - lat
    cosines = np.cos(np.radians(lat)) * np.cos(np.radians(lat + north))
    distance = np.sin(np.radians(north) / 2) ** 2 + cosines * np.sin(np.radians(east) / 2) ** 2
    nearest = np.argmin(distance, axis=1)[:, None]
    east, north = (np.take_along_axis(way, nearest, axis=1) for way in (east, north))
    bent = any(goals[k].measure.needs_hessian for k in doubtful)

    def values_at(chosen: IntArray, lons: FloatArray, lats: FloatArray) -> FloatArray:
        """The goals' values on the ways (m, n) of those chosen."""
        fields = fields_at(projection, lons.ravel(), lats.ravel(), bent)[0].reshape(*lons.shape, -1)
        return np.stack([goals[doubtful[k]].of(own) for k, own in zip(chosen, fields, strict=True)])

    values = values_at(np.arange(len(lon)), lon + _APPROACH * east, lat + _APPROACH * north)
    with np.errstate(invalid="ignore"):
        gains, defined_at = np.diff(values), np.isfinite(values)
        grows = np.all((gains > _GROWTH * np.abs(values[:, 1:])) | ~defined_at[:, 1:], axis=1)
        grows &= ((gains[:, 1:] > _SLOWING * gains[:, :-1]) | ~defined_at[:, 2:]).all(axis=1)
        grows &= defined_at[:, :_FEWEST].all(axis=1)
    polar = np.flatnonzero(grows & (90.0 - np.abs(lat[:, 0]) < _BESIDE))
    if polar.size:
        # On to the pole, on the panel's own meridian, away from a seam that ends there.
        lon, lat, east, north = (each[polar] for each in (lon, lat, east, north))
        pole = np.copysign(90.0, lat)
        lons, lats = np.broadcast_to(lon + east, (polar.size, _NEARER.size)), pole + _NEARER * (lat + north - pole)
        nearer = values_at(polar, lons, lats)
        reached, at_pole = (np.where(np.isfinite(some), some, -np.inf).max(axis=1) for some in (values[polar], nearer))
        grows[polar] = ~(_ends(nearer) & (reached < _ALIKE * at_pole))
    for k in np.array(doubtful)[grows]:
        result[k] = result[k]._replace(value=np.inf)
    return result


def _ends(values: FloatArray) -> BoolArray:
    """True if growth comes to an end: gains between values (n, m) fall twice in a row, and clearly."""
    with np.errstate(invalid="ignore"):
        gains = np.diff(values)
        less, slow = gains[:, 1:] < gains[:, :-1], gains[:, 1:] < _SLOWING**0.5 * gains[:, :-1]
        return np.asarray((less[:, :-1] & slow[:, 1:] & (gains[:, 2:] > 0.0)).any(axis=1))


# ---- search --------------------------------------------------------------------------------------

_NOISY = 1e-3  # errors of the scales
_SURE = 4.0  # times an estimated error: at a pole, where coefficients fall slowly, the error was twice that
_SMALL = 0.01  # errors of polynomials, over the gap between a bound and what is known
_NARROW = 1e-4  # of the region's width: nothing is certain in narrower pieces
_GOOD = 30.0  # times the error to which a search goes: better polynomials are not sampled again
_ROUNDS = 5  # of sampling again: then a piece is a thousandth of what it was
_BESIDE_A_POLE = 1e-8  # larger errors are due to a singular point, which smaller pieces leave outside the region
_STUCK = 0.5  # share of an error that a quarter keeps at a kink, a singular point or by rounding
_BEYOND = 0.25  # of the span of values at nodes: by how much values between nodes and at sides may exceed them
_MOST_ROUGH, _FEW = 512, 64  # pieces that are taken point by point
_SOME, _FEWER = [0, 3, 6, 9], [1, 8]  # of the nodes along either axis, if they are few or many
_TURNS, _SHRINK = 10, 0.4
_AROUND = np.stack(np.meshgrid(np.arange(-2.0, 3.0), np.arange(-2.0, 3.0)), axis=-1).reshape(-1, 2)
_MOST, _MOST_AT_BORDERS = 64, 128  # pieces of a goal that are sampled again at once
_ON_EDGES = 64  # points
_CANDIDATES = 3  # places of a goal to measure at


def find_extremes(
    projection: Projection | None, charted: Region | None, nodes: Pieces, goals: Sequence[Goal]
) -> list[Extreme]:
    """The extreme of each goal; of points (`charted` None) the best one; NaN if the measure is defined nowhere."""
    if projection is None or charted is None:
        found = [_best_point(nodes, goal) for goal in goals]
    else:
        found = _Search(projection, charted, nodes, goals).run()
    for k, (goal, one) in enumerate(zip(goals, found, strict=True)):
        if one.value == -np.inf:
            found[k] = Extreme(np.nan, np.nan, np.nan)
        else:
            lon, error = float((one.lon + 180.0) % 360.0 - 180.0), one.error if np.isfinite(one.value) else np.nan
            found[k] = Extreme(goal.sign * one.value, lon, one.lat, error)
    return found


def _best_point(points: Pieces, goal: Goal) -> Extreme:
    """The best of a set of points; its error is that of the derivatives there."""
    values = bounds.defined(goal.sign * goal.values)
    top = int(np.argmax(values))
    J = points.jacobian.reshape(-1, 4)[top]
    H = points.hessian.reshape(-1, 8)[top] if points.hessian.size else []
    field = np.concatenate([J, H])
    error = np.full(field.shape, np.max(np.abs(J))) * points.doubt[top]
    error[4:] = BENT * np.max(np.abs(field[4:]), initial=0.0)
    value, lon, lat = (float(each.flat[top]) for each in (values, points.lon, points.lat))
    return Extreme(value, lon, lat, float(goal.change(field, error)) if np.isfinite(value) else np.nan)


class _Search:
    """Search for the largest values of goals, which are measures times the goals' signs."""

    def __init__(self, projection: Projection, region: Region, nodes: Pieces, goals: Sequence[Goal]) -> None:
        self.projection, self.region, self.nodes = projection, region, nodes
        self.pieces = bounds.polynomials_of(nodes, nodes.hessian, nodes.share < 1.0)
        self.parent = np.full(len(nodes.patch), -1)
        self.first_quarter: dict[int, int] = {}  # of pieces that were sampled again
        self.edges: dict[int, FloatArray] = {}  # in the boxes about pieces
        self.inside = np.ones(nodes.lon.shape, dtype=bool)
        clipped = self.pieces.clipped
        self.inside[clipped] = region.contains(nodes.lon[clipped], nodes.lat[clipped])
        self.states = [State(goal) for goal in goals]

    def run(self) -> list[Extreme]:
        """The largest value of each goal."""
        found = [self._at_nodes(state) for state in self.states]
        # Where samples show that there is no bound, a search would only climb towards the singularity.
        found = _unbounded(self.projection, self.nodes, [state.goal for state in self.states], found)
        on = [number for number, one in enumerate(found) if np.isfinite(one.value)]
        searched = [self.states[number] for number in on]
        for turn in range(_ROUNDS + 1):
            for state in searched:
                self._sift(state, last=turn == _ROUNDS)
            self._sample_again(searched)
        for state in searched:
            self._climb(state)
        if not searched:
            return found
        best = _measured(self.projection, searched, [found[number] for number in on])
        for number, one in zip(on, best, strict=True):
            found[number] = one
        return _unbounded(self.projection, self.nodes, [state.goal for state in self.states], found)

    # ---- sifting the pieces -------------------------------------------------------------

    def _at_nodes(self, state: State) -> Extreme:
        """The best node; pieces that may exceed it stay live."""
        goal, pieces = state.goal, self.pieces
        n = len(pieces.patch)
        values = bounds.defined(goal.sign * goal.values)
        within = np.where(self.inside, values, -np.inf)
        top = int(within.argmax())
        best = Extreme(*(float(each.flat[top]) for each in (within, self.nodes.lon, self.nodes.lat)))
        if best.value == -np.inf:
            if (values == -np.inf).all():
                return best
            # Of an archipelago whose islands lie between the nodes, some points on the edges.
            edges = self.region.edges[:: max(1, len(self.region.edges) // _ON_EDGES)]
            at_edges = goal.of(fields_at(self.projection, edges[:, 0], edges[:, 1], goal.measure.needs_hessian)[0])
            on_edge = int(at_edges.argmax())
            best = Extreme(float(at_edges[on_edge]), float(edges[on_edge, 0]), float(edges[on_edge, 1]))
            state.known, state.known_at = best.value, (best.lon, best.lat)
        fields = np.moveaxis(pieces.field, 1, -1).reshape(n, -1, pieces.field.shape[1])
        rows = np.arange(n)
        error = goal.change(fields[rows, values.reshape(n, -1).argmax(axis=1)], pieces.error)
        trusted = self._trusted(rows)
        certain = np.where(trusted, within.max(axis=(1, 2)) - _SURE * error, -np.inf)
        if certain.max() > state.known:
            surest = int(certain.argmax())
            node = int(within[surest].argmax())
            state.known = float(certain[surest])
            state.known_at = (float(self.nodes.lon[surest].flat[node]), float(self.nodes.lat[surest].flat[node]))
            state.places = [state.known_at]
        best_piece = int(certain.argmax()) if trusted.any() else top // values[0].size
        field = fields[best_piece, within[best_piece].argmax()]
        error_resolved = np.full(field.shape, _EXACT * _size(field))
        error_resolved[4:] = BENT * np.abs(field[4:]).max(initial=0.0)
        resolved = float(goal.change(field, error_resolved))
        state.exact = resolved if np.isfinite(resolved) else 0.0
        high, low = values.max(axis=(1, 2)), np.where(values > -np.inf, values, np.inf).min(axis=(1, 2))
        error = np.where(high > -np.inf, error, 0.0)
        bound = high + _BEYOND * np.where(low <= high, high - low, 0.0) + error
        bound = np.minimum(bound, _within_steps(values))
        live = bound > state.known + state.exact
        state.raise_bound(bound[~live])
        state.live = np.flatnonzero(live)
        return best

    def _sift(self, state: State, *, last: bool) -> None:
        """Bound a goal on its live pieces: some are left, good and hopeless ones wait for `_climb`, others stay."""
        live = state.live = self._touched(state.live)
        if not live.size:
            return
        goal = state.goal
        bound, top = bounds.reach(goal, self.pieces, live, self._contains)
        error = goal.change(self.pieces.at(live, top.r[:, None], top.s[:, None])[:, 0], self.pieces.error[live])
        certain = np.where(self._trusted(live), top.value - _SURE * error, -np.inf)
        if certain.max() > state.known:
            state.known = float(certain.max())
            best = np.array([certain.argmax()])
            state.places = self._degrees(live[best], top.r[best], top.s[best])
            state.known_at = state.places[0]
        good = error <= _GOOD * state.exact
        bound = np.minimum(bound + error, goal.limit)
        bound[~good] = np.minimum(bound[~good], _within_steps(self._values(goal, live[~good])))
        kept = bound > state.known + state.exact
        state.raise_bound(bound[~kept])
        before = self._relative_errors(self.parent[live])
        with np.errstate(invalid="ignore"):
            now = self._relative_errors(live)
            stuck = (self.parent[live] >= 0) & ~(now < _STUCK * before)
        stuck &= ~(self.pieces.clipped[live] & (now > _BESIDE_A_POLE))
        rest = np.flatnonzero(kept & ~good & ~stuck & (not last))
        most = _MOST_AT_BORDERS if self.pieces.clipped[live].any() else _MOST
        rest = rest[np.argsort(-bound[rest], kind="stable")][:most]
        ends = kept.copy()
        ends[rest] = False
        # Errors much smaller than the gap between bound and known value do as well, as in pieces beyond the region.
        known = good | (self._trusted(live) & (error < _SMALL * (bound - state.known)))
        for pieces, chosen in ((state.good, ends & known), (state.rough, ends & ~known)):
            pieces.append(Chosen(live[chosen], bound[chosen], error[chosen]))
        state.live = live[rest]

    def _values(self, goal: Goal, piece: IntArray) -> FloatArray:
        """A goal at the nodes (n, p, p) of pieces."""
        return goal.of(np.moveaxis(self.pieces.field[piece], 1, -1))

    def _trusted(self, piece: IntArray) -> BoolArray:
        """True if the polynomials of pieces can be trusted, despite noise and PROJ's snapping to singular points."""
        large = self.pieces.size[piece] > _NARROW * np.sqrt(self.nodes.weight.sum())
        return np.asarray(large & (self._relative_errors(piece) < _NOISY))

    def _relative_errors(self, piece: IntArray) -> FloatArray:
        """The errors of J in pieces, over its size."""
        size = np.sqrt(0.5 * (self.pieces.field[piece, :4] ** 2).sum(axis=1).mean(axis=(1, 2)))
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            return np.asarray(self.pieces.error[piece, :4].max(axis=1) / size)

    def _sample_again(self, states: Sequence[State]) -> None:
        """Replace live pieces by their quarters."""
        wanted = np.unique(np.concatenate([_NONE.piece, *(state.live for state in states)]))
        new = np.array([piece for piece in wanted.tolist() if piece not in self.first_quarter], dtype=int)
        if new.size:
            first = len(self.parent)
            self.pieces = Polynomials.joined([self.pieces, self.pieces.quarters(self.projection, self.region, new)])
            self.parent = np.concatenate([self.parent, np.repeat(new, 4)])
            self.first_quarter |= dict(zip(new.tolist(), range(first, len(self.parent), 4), strict=True))
        for state in states:
            first_of = np.array([self.first_quarter[piece] for piece in state.live.tolist()], dtype=int)
            state.live = (first_of[:, None] + np.arange(4)).ravel()

    def _degrees(self, piece: IntArray, r: FloatArray, s: FloatArray) -> list[tuple[float, float]]:
        """Longitudes and latitudes of places r, s of pieces."""
        u, v = self.pieces.places(piece, r[:, None], s[:, None])
        points = self.region.chart(self.pieces.patch[piece], u[:, 0, 0], v[:, 0, 0])
        return list(zip(points.lon.tolist(), points.lat.tolist(), strict=True))

    # ---- the region ---------------------------------------------------------------------

    def _contains(self, piece: IntArray, r: FloatArray, s: FloatArray) -> BoolArray:
        """True for places at grids r by s of pieces that are in the region."""
        u, v = self.pieces.places(piece, r, s)
        points = self.region.chart(self.pieces.patch[piece][:, None, None], u, v)
        return self.region.contains(points.lon, points.lat)

    def _touched(self, piece: IntArray) -> IntArray:
        """The pieces that hold any of the region."""
        clipped = self.pieces.clipped[piece]
        if not clipped.any():
            return piece
        rim = np.broadcast_to(np.linspace(-1.0, 1.0, 3), (int(clipped.sum()), 3))
        held = np.ones(len(piece), dtype=bool)
        held[clipped] = self._contains(piece[clipped], rim, rim).any(axis=(1, 2))
        held |= np.array([bool(one) and len(self._edges(k)) > 0 for k, one in zip(piece, clipped & ~held, strict=True)])
        return piece[held]

    def _edges(self, piece: int) -> FloatArray:
        """The region's edges in the box about a piece."""
        if piece not in self.edges:
            parent = int(self.parent[piece])
            among = self.region.edges if parent < 0 else self._edges(parent)
            low, high = bounds.box_about(self.pieces, piece)
            start, end = among[:, :2], among[:, 2:]
            self.edges[piece] = among[((np.minimum(start, end) <= high) & (np.maximum(start, end) >= low)).all(axis=1)]
        return self.edges[piece]

    # ---- climbing -----------------------------------------------------------------------

    def _climb(self, state: State) -> None:
        """Find the places where a goal may be largest, and bound it."""
        goal = state.goal
        good = Chosen.joined(state.good)
        if good.piece.size:
            aims = self._contains, state.known, state.exact
            bound, top = bounds.climb_cells(goal, self.pieces, good.piece, good.error, *aims)
            state.raise_bound(bound)
            best = np.argsort(-top.value, kind="stable")[:_CANDIDATES]
            best = best[np.isfinite(top.value[best])]
            places = self._degrees(good.piece[best], top.r[best], top.s[best])
            state.places += places
            certain = np.where(self._trusted(good.piece[best]), top.value[best] - good.error[best], -np.inf)
            if certain.max(initial=-np.inf) > state.known:
                state.known, state.known_at = float(certain.max()), places[int(certain.argmax())]
        crossed = self.pieces.clipped[good.piece] & (good.bound > state.known + state.exact)
        parts = [bounds.crossing(self.pieces, int(k), self._edges(int(k))) for k in good.piece[crossed]]
        if any(part.piece.size for part in parts):
            error = np.zeros(len(self.parent))
            error[good.piece] = good.error
            border = bounds.Border.joined(parts)
            bound, seen = bounds.climb_borders(goal, self.pieces, border, error, state.known, state.exact)
            state.raise_bound(bound)
            if np.isfinite(seen[0]):
                state.places.append((float(seen[1]), float(seen[2])))
        self._climb_rough(state, Chosen.joined(state.rough))

    def _climb_rough(self, state: State, rough: Chosen) -> None:
        """Measure pieces without good polynomials point by point, and bound them by `_within_steps`."""
        order = np.argsort(-rough.bound, kind="stable")
        order = order[rough.bound[order] > state.known + state.exact]
        state.raise_bound(rough.bound[order[_MOST_ROUGH:]])
        first = order[:_MOST_ROUGH]
        piece, bound, error = rough.piece[first], rough.bound[first], rough.error[first]
        if not piece.size:
            return
        some = _SOME if len(piece) <= _FEW else _FEWER
        u, v = (each[piece][:, some][:, :, some] for each in (self.pieces.u, self.pieces.v))
        points = self.region.chart(self.pieces.patch[piece][:, None, None], u, v)
        lon, lat = np.asarray(points.lon), np.asarray(points.lat)
        fields, errors = fields_at(self.projection, lon.ravel(), lat.ravel(), state.goal.measure.needs_hessian)
        values = state.goal.of(fields).reshape(lon.shape)
        # Beside a singular point differences find no room, where polynomials may go on.
        goes_on = ~np.isfinite(values) & (error < _SMALL * (bound - state.known))[:, None, None]
        known = np.where(goes_on, self._values(state.goal, piece)[:, some][:, :, some], values)
        state.raise_bound(np.minimum(bound, _within_steps(known)))
        clipped = self.pieces.clipped[piece]
        values -= state.goal.change(fields, errors).reshape(lon.shape)  # where PROJ rounds nothing is certain
        values[np.isnan(values)] = -np.inf
        values[clipped] = np.where(self.region.contains(lon[clipped], lat[clipped]), values[clipped], -np.inf)
        top = int(values.argmax())
        if values.flat[top] > state.known:
            state.known, state.known_at = float(values.flat[top]), (float(lon.flat[top]), float(lat.flat[top]))
            best = self.pieces.take(piece[[top // values[0].size]])
            state.places += [state.known_at, self._polished(state.goal, best, (u.flat[top], v.flat[top]))]

    def _polished(self, goal: Goal, start: Polynomials, node: tuple[float, float]) -> tuple[float, float]:
        """The best place of grids of five by five points that shrink from a node to their best point."""
        place = np.array(node)
        step = np.array([np.ptp(start.u), np.ptp(start.v)]) / ORDER
        number, rectangles = self.region.panels()
        own = rectangles[number == start.patch[0]]
        low, high = own[:, 0::2].min(axis=0), own[:, 1::2].max(axis=0)
        best = -np.inf
        for _ in range(_TURNS):
            # Beyond a side of the region all points are those on it.
            around = np.array(list(dict.fromkeys(map(tuple, np.clip(place + step * _AROUND, low, high).tolist()))))
            points = self.region.chart(np.broadcast_to(start.patch, len(around)), *around.T)
            values = goal.of(fields_at(self.projection, points.lon, points.lat, goal.measure.needs_hessian)[0])
            if start.clipped[0]:
                values = np.where(self.region.contains(points.lon, points.lat), values, -np.inf)
            top = int(values.argmax())
            if values[top] > best:
                best, place, found = values[top], around[top], (float(points.lon[top]), float(points.lat[top]))
            step = _SHRINK * step
        return found


def _within_steps(values: FloatArray) -> FloatArray:
    """Bounds (n,) of functions by their values (n, p, p) at nodes."""
    # Between nodes a function rises above a peak by no more than the peak rises above the nodes beside it, along either
    # axis. Where the function is undefined beside a node, it ends there.
    bound = values.copy()
    for axis in (1, 2):
        with np.errstate(invalid="ignore"):
            step = np.moveaxis(np.diff(values, axis=axis), axis, 0)
        nothing = np.full((1, *step.shape[1:]), np.nan)
        # By how much a node is above the next one and the one before.
        drops = np.stack([np.append(-step, nothing, axis=0), np.append(nothing, step, axis=0)])
        known = np.isfinite(drops)
        peak = (~known | (drops >= 0.0)).all(axis=0)
        bound += np.moveaxis(np.where(peak, np.where(known, drops, 0.0).max(axis=0), 0.0), 0, axis)
    return np.asarray(bound.max(axis=(1, 2)))
