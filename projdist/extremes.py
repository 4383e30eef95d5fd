"""Where in a region measures are largest and smallest: searched from the best samples, not read off them.

All searches of a projection go together, as a call for many points costs little more than one for few.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.cubature import Samples
from projdist.derivatives import jacobian
from projdist.hessians import hessian
from projdist.measures import Measure
from projdist.projections import Projection
from projdist.regions import Place, PointSet, Region
from projdist.regions.chains import divided
from projdist.spectral import NODES, ORDER

__all__ = ["Extreme", "Goal", "find_extremes", "measure_at"]

_STARTS = 4
_ROUNDS = 20
_TRIAL, _FINALISTS = 5, 2  # after so many rounds only the best starts go on
_SHRINK = 0.45
_OFFSETS = np.stack(np.meshgrid(np.arange(-2.0, 3.0), np.arange(-2.0, 3.0)), axis=-1).reshape(-1, 2)
_FINE = 1e-6  # of the area; smaller panels are there only beside singularities
_BROAD = 3e-3  # of the largest panel's area
# Ever nearer to the maximum, in shares of the way to the middle of the nearest broad panel. Not nearer than
# this: the last thousandths of a degree before a singular point often are not defined, so that it is not found itself.
_APPROACH = 10.0 ** -np.arange(0.5, 2.5, 0.5)
_SLOWING = 0.75  # a logarithm gains the same in every step, a square root half of the last, a smooth maximum a tenth
_GROWTH = 1e-3  # of the value, in a step


class Extreme(NamedTuple):
    """A largest or smallest value and its place; infinite where the measure grows without bound towards it."""

    value: float
    lon: float
    lat: float


@dataclass(frozen=True)
class Goal:
    """A measure, its `values` (n, p, p) at samples, and whether its largest or its smallest value is wanted."""

    measure: Measure
    values: FloatArray
    largest: bool = True

    @property
    def sign(self) -> float:
        """What makes the value wanted the largest."""
        return 1.0 if self.largest else -1.0

    @property
    def bounded(self) -> bool:
        """Whether there is a bound in any case: only a signed measure, as a logarithm, may fall without one."""
        return self.measure.bounded or not (self.largest or self.measure.kind == "signed")


def measure_at(
    projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray, J: FloatArray | None = None
) -> FloatArray:
    """A measure at points in degrees, where J may be known; H is per radian of the semi-major axis."""
    J = jacobian(projection, lon, lat) if J is None else J
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat) * projection.ellipsoid.a)


def find_extremes(projection: Projection, region: Place, samples: Samples, goals: Sequence[Goal]) -> list[Extreme]:
    """The value of each goal and its place; NaN where the measure is not defined anywhere."""
    inside = np.ones(samples.lon.shape, dtype=bool)
    if not isinstance(region, PointSet):
        clipped = samples.share < 1.0
        inside[clipped] = region.contains(samples.lon[clipped], samples.lat[clipped])
    values = [np.where(inside, _defined(goal.sign * goal.values), -np.inf) for goal in goals]
    found = [_best_node(samples, one) for one in values]
    if not isinstance(region, PointSet):
        search = _Search(projection, region, samples, goals)
        numbers = range(len(goals))
        # Where samples show that there is no bound, a search would only climb towards the singularity.
        found = search.unbounded(numbers, found)
        on = [number for number, one in enumerate(found) if one.value < np.inf]
        if on:
            best = search.climb(on, values)
            if len(region.edges):
                best = [max(pair, key=_value) for pair in zip(best, search.along_edges(on), strict=True)]
            for number, one in zip(on, best, strict=True):
                found[number] = one
        found = search.unbounded(numbers, found)
    return [_signed(goal, one) for goal, one in zip(goals, found, strict=True)]


def _defined(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, -np.inf)


def _best_node(samples: Samples, values: FloatArray) -> Extreme:
    top = int(np.argmax(values))
    return Extreme(float(values.flat[top]), float(samples.lon.flat[top]), float(samples.lat.flat[top]))


def _value(extreme: Extreme) -> float:
    return extreme.value


def _signed(goal: Goal, found: Extreme) -> Extreme:
    """The extreme of the measure itself, within half a turn of Greenwich."""
    if found.value == -np.inf:
        return Extreme(np.nan, np.nan, np.nan)
    return Extreme(goal.sign * found.value, float((found.lon + 180.0) % 360.0 - 180.0), found.lat)


_LONGEST = 1.0  # degrees of an edge between stations
_STATIONS = 4000  # at first; around those that let hope for more, all
_HOPEFUL, _BEST_EDGES = 300, 8  # at most
_FRACTIONS = np.linspace(-1.0, 1.0, 9)
_NARROWINGS = 14  # by a factor of four: to the rounding of a smooth maximum


@dataclass(frozen=True)
class _Search:
    """The search for the largest values of goals, which are those of the measures times the goals' signs."""

    projection: Projection
    region: Region
    samples: Samples
    goals: Sequence[Goal]

    # ---- values -----------------------------------------------------------------------------

    def _goal(self, number: int, lon: FloatArray, lat: FloatArray, J: FloatArray) -> FloatArray:
        """What a goal makes large, at points where J is known."""
        goal = self.goals[number]
        return goal.sign * measure_at(self.projection, goal.measure, lon, lat, J)

    def _own(self, owner: IntArray, lon: FloatArray, lat: FloatArray) -> FloatArray:
        """At each row of points (n, m) the value of the goal that owns the row, from J at every place once."""
        places, index = np.unique(lon + 1j * lat, return_inverse=True)
        J = jacobian(self.projection, places.real, places.imag)[index.reshape(lon.shape)]
        values = np.empty(lon.shape)
        for number in np.unique(owner):
            mine = owner == number
            values[mine] = self._goal(number, lon[mine], lat[mine], J[mine])
        return values

    def _each(self, numbers: Sequence[int], lon: FloatArray, lat: FloatArray) -> FloatArray:
        """The values of some goals at the same points, (k, ...); -inf where not defined."""
        J = jacobian(self.projection, lon, lat)
        return np.stack([_defined(self._goal(number, lon, lat, J)) for number in numbers])

    # ---- in the panels ----------------------------------------------------------------------

    def climb(self, numbers: Sequence[int], values: Sequence[FloatArray]) -> list[Extreme]:
        """The largest values of some goals: a grid of five by five points about each of their starts shrinks.

        It shrinks around its best point within the region. Starts are the best places of the best panels, by `values`
        carried on to the panels' sides.
        """
        starts = [self._starts(values[number]) for number in numbers]
        owner = np.repeat(numbers, [len(own) for own, _ in starts])
        panel, first = (np.concatenate(parts) for parts in zip(*starts, strict=True))
        groups = [np.flatnonzero(owner == number) for number in numbers]
        places = np.stack([_to_sides(self.samples.u[panel]), _to_sides(self.samples.v[panel])], axis=-1)
        place, step = places[np.arange(len(panel)), first], np.ptp(places, axis=1) / 4
        patch, best = self.samples.patch[panel], np.full(len(panel), -np.inf)
        low, high = _limits(self.region, patch)

        def tops() -> list[Extreme]:
            winners = [_foremost(best, group)[0] for group in groups]
            points = self.region.chart(patch[winners], *place[winners].T)
            return [Extreme(*map(float, one)) for one in zip(best[winners], points.lon, points.lat, strict=True)]

        on = np.arange(len(panel))
        for turn in range(_ROUNDS):
            if turn == _TRIAL:  # the step is a hundredth of the panel; what climbs to a singularity has shown it
                endless = [one.value == np.inf for one in self.unbounded(numbers, tops())]
                finalists = [_foremost(best, group) for group, ends in zip(groups, endless, strict=True) if not ends]
                on = np.concatenate([on[:0], *finalists])
            if not on.size:
                break
            around = np.clip(place[on, None] + step[on, None] * _OFFSETS, low[on, None], high[on, None])
            points = self.region.chart(patch[on, None], around[..., 0], around[..., 1])
            found = _defined(self._own(owner[on], points.lon, points.lat))
            if len(self.region.edges):
                found = np.where(self.region.contains(points.lon, points.lat), found, -np.inf)
            index = np.argmax(found, axis=1)
            reached = found[np.arange(on.size), index]
            better = reached > best[on]
            best[on[better]] = reached[better]
            place[on[better]] = around[better, index[better]]
            step = _SHRINK * step
        return tops()

    def _starts(self, values: FloatArray) -> tuple[IntArray, IntArray]:
        """The best panels, and the best of those that are not tiny: beside a singularity samples may mislead.

        With the number of the best place in each, of those that `_to_sides` gives.
        """
        estimates = _to_sides(values)
        areas = self.samples.weight.sum(axis=(1, 2))
        coarse = areas > _FINE * areas.sum()
        order = np.argsort(-estimates.max(axis=1))
        panels = np.unique(np.concatenate([order[:_STARTS], order[coarse[order]][:_STARTS]]))
        return panels, estimates[panels].argmax(axis=1)

    # ---- along edges ------------------------------------------------------------------------

    def along_edges(self, numbers: Sequence[int]) -> list[Extreme]:
        """The largest values of some goals: at so many vertices, at all beside which there may be more, along edges."""
        edges = self.region.edges
        pieces = np.ceil(np.abs(edges[:, 2:] - edges[:, :2]).max(axis=1) / _LONGEST).clip(1).astype(int)
        lon, lat = divided(edges, pieces)
        stride = math.ceil(lon.shape[1] / _STATIONS)
        chosen = np.arange(0, lon.shape[1], stride)
        rough = self._each(numbers, lon[0, chosen], lat[0, chosen])
        near = chosen[_hopeful(rough)][:, None] + np.arange(-stride, stride + 1)
        chosen = np.unique(np.clip(near, 0, lon.shape[1] - 1))
        ends = self._each(numbers, lon[:, chosen], lat[:, chosen]).max(axis=1)
        best = chosen[np.argsort(-ends)[:, :_BEST_EDGES]].ravel()
        owner = np.repeat(numbers, best.size // len(numbers))
        (lon0, lon1), (lat0, lat1) = lon[:, best, None], lat[:, best, None]
        middle, width = np.full((best.size, 1), 0.5), 0.5
        for _ in range(_NARROWINGS):
            share = np.clip(middle + width * _FRACTIONS, 0.0, 1.0)
            lons, lats = lon0 + (lon1 - lon0) * share, lat0 + (lat1 - lat0) * share
            values = _defined(self._own(owner, lons, lats))
            index = np.argmax(values, axis=1)[:, None]
            middle, width = np.take_along_axis(share, index, axis=1), 0.25 * width
        at = [np.take_along_axis(each, index, axis=1)[:, 0] for each in (values, lons, lats)]
        winners = [_foremost(at[0], np.flatnonzero(owner == number))[0] for number in numbers]
        return [Extreme(*map(float, one)) for one in zip(*(each[winners] for each in at), strict=True)]

    # ---- towards singular points ------------------------------------------------------------

    def unbounded(self, numbers: Sequence[int], found: Sequence[Extreme]) -> list[Extreme]:
        """Values found for some goals, infinite where a goal grows without bound on the way to its place.

        The way is that from the middle of the nearest panel that is broad; in every step it grows no less.
        """
        doubtful = [k for k, one in enumerate(found) if np.isfinite(one.value) and not self.goals[numbers[k]].bounded]
        result = list(found)
        if not doubtful:
            return result
        areas = self.samples.weight.sum(axis=(1, 2))
        middle = self.samples.lon.shape[-1] // 2
        broad = (areas >= _BROAD * areas.max(), middle, middle)
        lon, lat = np.array([found[k][1:] for k in doubtful]).T[:, :, None]
        east, north = (self.samples.lon[broad] - lon + 180.0) % 360.0 - 180.0, self.samples.lat[broad] - lat
        cosines = np.cos(np.radians(lat)) * np.cos(np.radians(lat + north))
        distance = np.sin(np.radians(north) / 2) ** 2 + cosines * np.sin(np.radians(east) / 2) ** 2
        nearest = np.argmin(distance, axis=1)[:, None]
        east, north = (np.take_along_axis(way, nearest, axis=1) for way in (east, north))
        values = self._own(np.array(numbers)[doubtful], lon + _APPROACH * east, lat + _APPROACH * north)
        gains = np.diff(values)
        grows = (gains > _GROWTH * np.abs(values[:, 1:])).all(axis=1)
        grows &= (gains[:, 1:] > _SLOWING * gains[:, :-1]).all(axis=1)
        for k in np.array(doubtful)[grows]:
            result[k] = result[k]._replace(value=np.inf)
        return result


def _carrying_on() -> FloatArray:
    """The matrix (p + 2, p) to values at -1, the nodes and 1, on parabolas through the three nodes nearest the ends.

    Unlike the polynomial through all nodes, they do not feel kinks and singular points on the panel's other side.
    """
    ends = np.polynomial.polynomial.polyvander(NODES[-3:], 2)
    end = np.zeros((1, ORDER))
    end[0, -3:] = np.linalg.solve(ends.T, np.ones(3))
    return np.concatenate([end[:, ::-1], np.eye(ORDER), end])


_CARRY_ON = _carrying_on()


def _to_sides(values: FloatArray) -> FloatArray:
    """Values at the nodes (n, p, p) of panels with estimates on their sides and at their corners: (n, (p + 2)^2).

    Those are -inf in panels where any value is not finite.
    """
    finite = np.isfinite(values).all(axis=(1, 2))
    result = np.full((len(values), ORDER + 2, ORDER + 2), -np.inf)
    result[:, 1:-1, 1:-1] = values
    result[finite] = _CARRY_ON @ values[finite] @ _CARRY_ON.T
    return result.reshape(len(values), -1)


def _hopeful(values: FloatArray) -> IntArray:
    """Stations from which the step to the next one, taken again, leads to the best value of a goal (k, n) or more."""
    steps = np.abs(np.diff(np.nan_to_num(values, neginf=0.0), axis=1))
    hopes = values + np.maximum(np.pad(steps, ((0, 0), (1, 0))), np.pad(steps, ((0, 0), (0, 1))))
    order = np.argsort(-hopes)[:, :_HOPEFUL]
    return np.unique(order[np.take_along_axis(hopes, order, axis=1) >= values.max(axis=1, keepdims=True)])


def _foremost(values: FloatArray, index: IntArray) -> IntArray:
    """Those of an index with the largest values, the best first."""
    return index[np.argsort(-values[index], kind="stable")[:_FINALISTS]]


def _limits(region: Region, patch: IntArray) -> tuple[FloatArray, FloatArray]:
    """The least and the largest (n, 2) of u and v in each patch."""
    number, rectangles = region.panels()
    low, high = rectangles[:, 0::2], rectangles[:, 1::2]
    own = [number == p for p in patch]
    return np.array([low[mine].min(axis=0) for mine in own]), np.array([high[mine].max(axis=0) for mine in own])
