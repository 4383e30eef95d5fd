"""Parts of published indices: functions of the principal scales, finite distances, and the length of a map's cuts."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from projdist import earth, matrices, numerics, projections, regions, support
from projdist._typing import BoolArray, FloatArray
from projdist.answers import distances
from projdist.field import FIGURES, Extreme, Field, Figure, evaluate, find_tears

T = TypeVar("T")
Scales = Callable[[FloatArray, FloatArray], FloatArray]
"""A function of the principal scales a >= b."""

_STEP = 1e-3  # of the logarithms of the scales, for slopes that enter errors only


@dataclass(frozen=True)
class ScaleField:
    """The principal scales of a field, with the means, extremes and shares that indices are made of."""

    projection: projections.Projection
    region: regions.Place
    jacobians: Field
    known: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def once(self, figure: Callable[[ScaleField, float], T], scale: float = 1.0) -> T:
        """A figure of the field at a scale, computed when first asked for."""
        if (figure, scale) not in self.known:
            self.known[figure, scale] = figure(self, scale)
        return self.known[figure, scale]

    @functools.cached_property
    def scales(self) -> tuple[FloatArray, FloatArray]:
        """The principal scales a and b (n,) at the nodes; NaN where the map is singular."""
        scales = matrices.principal_scales(self.jacobians.jacobian)
        scales[~(scales[..., 1] > 0)] = np.nan
        return scales[..., 0], scales[..., 1]

    def mean(self, term: Scales, scale: float = 1.0) -> support.Estimate:
        """The mean of a term by true area, of the map enlarged by a scale."""
        if not np.isfinite(scale):
            return support.Estimate(np.nan, np.nan)
        a, b = (scale * value for value in self.scales)
        up, down = 1.0 + _STEP, 1.0 - _STEP
        slope = np.abs(term(up * a, b) - term(down * a, b)) + np.abs(term(a, up * b) - term(a, down * b))
        return self.jacobians.mean(term(a, b), slope=slope / (2.0 * _STEP))

    def sum(self, term: Scales, scale: float) -> float:
        """The sum over the nodes that the mean is made of, without an error, for searches."""
        a, b = self.scales
        return float(np.nansum(self.jacobians.weight * term(scale * a, scale * b)))

    @functools.cached_property
    def largest(self) -> Extreme:
        """The largest scale in any direction; infinite where there is no bound."""
        return self.jacobians.maximum("tissot_semimajor")

    @functools.cached_property
    def smallest(self) -> Extreme:
        """The smallest scale in any direction."""
        return self.jacobians.minimum("tissot_semiminor")

    @functools.cached_property
    def dense(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The scales a, b and weights that sum to 1 at many points, for shares of the area."""
        # Not the scales are interpolated but the Jacobian, which is smooth where they cross.
        J, weights = self.jacobians.dense_jacobian
        a, b = matrices.principal_scales(J).T
        return a, b, weights / weights.sum()


Value = Callable[[ScaleField, float], support.Estimate]
"""An index of the map enlarged by a scale."""

# ---- functions of the scales ---------------------------------------------------------------------


@functools.cache
def term_of(figure: Figure) -> Scales:
    """The function of the scales whose mean, or root of the mean, is the figure."""

    def term(a: FloatArray, b: FloatArray) -> FloatArray:
        values = figure.measure(np.stack([a, b], axis=-1)[..., None] * np.eye(2))
        return values**2 if figure.statistic == "rms" else values

    return term


jordan_squared, omega = term_of(FIGURES["jordan"]), term_of(FIGURES["mean_omega"])


def log_area(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln(a b)."""
    return np.log(a * b)


def log_area_squared(a: FloatArray, b: FloatArray) -> FloatArray:
    """ln^2(a b)."""
    return np.log(a * b) ** 2


# ---- indices of means and extremes ---------------------------------------------------------------


def value_of(figure: Figure, factor: float = 1.0) -> Value:
    """A figure of a field, times a factor."""
    term = term_of(figure)

    def value(field: ScaleField, scale: float) -> support.Estimate:
        found = field.mean(term, scale)
        return support.Estimate(*(factor * part for part in (found.root() if figure.statistic == "rms" else found)))

    return value


def deviation_of_log_area(field: ScaleField, scale: float) -> support.Estimate:
    """The standard deviation of ln(ab), which does not depend on the scale."""
    level, level_error = field.mean(log_area)
    square, square_error = field.mean(log_area_squared)
    variance, error = square - level**2, square_error + 2.0 * abs(level) * level_error
    # For an equal-area map there is nothing but rounding; its squares do not cancel.
    if variance <= error:
        return support.Estimate(0.0, math.sqrt(max(variance, 0.0) + error))
    return support.Estimate(variance, error).root()


def second_order(measure: str) -> Value:
    """The mean of a measure of the second derivatives."""
    return lambda field, scale: field.jacobians.mean(measure, slope=np.abs(field.jacobians.values(measure)))


def largest_error(field: ScaleField, scale: float) -> support.Estimate:
    """The largest |ln scale| in any place and direction."""
    least = scale * field.smallest.value
    worst = max(math.log(scale * field.largest.value), -math.log(least) if least > 0 else math.inf)
    return _extreme(worst, field)


def scale_ratio(field: ScaleField, scale: float) -> support.Estimate:
    """The largest scale over the smallest."""
    ratio = field.largest.value / field.smallest.value if field.smallest.value > 0 else math.inf
    return _extreme(ratio, field, ratio)


def log_scale_ratio(field: ScaleField, scale: float) -> support.Estimate:
    """Logarithm of the largest scale over the smallest."""
    return _extreme(math.log(scale_ratio(field, scale).value), field)


def _extreme(value: float, field: ScaleField, factor: float = 1.0) -> support.Estimate:
    """A figure with a factor times the relative errors of the largest and the smallest scale; NaN if infinite."""
    relative = sum(one.error / one.value if one.value > 0 else math.nan for one in (field.largest, field.smallest))
    return support.Estimate(value, factor * relative if math.isfinite(value) else math.nan)


def _logs(values: FloatArray) -> FloatArray:
    """Logarithms, NaN unless positive: interpolated scales beside singular points may be 0."""
    return np.log(np.where(values > 0, values, np.nan))


_MOST_OMEGA, _MOST_RATIO = 40.0, 1.5
_KNOWN = 0.1  # relative error of the smallest areal scale, above which it is unknown
_THINNED = 2  # the error of a share is its difference from that of every second point


def share_above_smallest(field: ScaleField, scale: float) -> support.Estimate:
    """Percentage of the area with omega <= 40 degrees and s <= 1.5 times the least s."""
    a, b, weights = field.dense
    least = field.jacobians.minimum("areal_scale")
    # Where only rounding is left, as at an antipode, the smallest value of the points is taken.
    smallest = least.value if least.error <= _KNOWN * least.value else float(np.min(a * b))
    return _share((omega(a, b) <= _MOST_OMEGA) & (a * b <= _MOST_RATIO * smallest), weights)


def share_near_nominal(field: ScaleField, scale: float) -> support.Estimate:
    """Percentage of the area with omega <= 40 degrees and s within a factor of 1.5 of 1."""
    a, b, weights = field.dense
    good = (omega(a, b) <= _MOST_OMEGA) & (np.abs(_logs(scale**2 * a * b)) <= math.log(_MOST_RATIO))
    return _share(good, weights)


def _share(good: BoolArray, weights: FloatArray) -> support.Estimate:
    """The weight of some points in per cent; the error is the difference from that of every second point."""
    share = 100.0 * float(weights[good].sum())
    half = weights[::_THINNED]
    return support.Estimate(share, abs(share - 100.0 * float(half[good[::_THINNED]].sum() / half.sum())))


# ---- best scales ----------------------------------------------------------------------------

BEST_SCALES: dict[str, Callable[[ScaleField], float]] = {
    # sum (a + b) / sum (a^2 + b^2), a linear least-squares problem
    "airy": lambda field: field.mean(lambda a, b: a + b).value / field.mean(lambda a, b: a * a + b * b).value,
    # the same for areas: the square of the scale
    "areas": lambda field: math.sqrt(
        field.mean(lambda a, b: a * b).value / field.mean(lambda a, b: (a * b) ** 2).value
    ),
    # exp(-mean ln of the scale) over all places and directions, where ln((a + b) / 2) is the mean over directions
    "directions": lambda field: math.exp(-field.mean(lambda a, b: np.log(0.5 * (a + b))).value),
    # exp(-mean ln(ab) / 2), the geometric mean
    "logarithms": lambda field: math.exp(-0.5 * field.mean(log_area).value),
    # least index of Peters, and so least factor of Canters
    "distances": lambda field: math.exp(field.once(pairs)[2].value),
}
"""Functions for the best scale of a map, by the figure that it makes best."""


def best_for_jordan(field: ScaleField) -> float:
    """The mean of the scale over that of its square, both over all places and directions."""
    square = 0.5 * field.mean(lambda a, b: a * a + b * b).value
    return 0.5 * (square + 1.0 - field.mean(jordan_squared).value) / square


def best_for_largest(field: ScaleField) -> float:
    """1 / sqrt(max a min b), by the geometric mean."""
    middle = field.largest.value * field.smallest.value
    return 1.0 / math.sqrt(middle) if 0 < middle < math.inf else math.nan


def best_for_share(field: ScaleField) -> float:
    """The scale of the middle of the interval of ln s, 2 ln 1.5 wide, with most of the area of small omega."""
    a, b, weights = field.dense
    small = omega(a, b) <= _MOST_OMEGA
    if not small.any():
        return math.nan
    logarithm = _logs(a[small] * b[small])
    weights, logarithm = weights[small][np.isfinite(logarithm)], logarithm[np.isfinite(logarithm)]
    order = np.argsort(logarithm)
    logarithm, below = logarithm[order], np.concatenate([[0.0], np.cumsum(weights[order])])
    stop = np.searchsorted(logarithm, logarithm + 2.0 * math.log(_MOST_RATIO), side="right")
    start = int(np.argmax(below[stop] - below[:-1]))
    middle = 0.5 * float(logarithm[start] + logarithm[stop[start] - 1])
    return math.exp(-0.5 * middle)


_REACH = 3.0  # of ln scale to either side of the geometric mean


def searched(figure: Figure) -> Callable[[ScaleField], float]:
    """The scale that minimises the mean of a term, a convex function of the logarithm of the scale."""
    term = term_of(figure)

    def best(field: ScaleField) -> float:
        if not math.isfinite(field.mean(term).value):
            return math.nan
        middle = math.log(BEST_SCALES["logarithms"](field))
        ends = middle - _REACH, middle + _REACH
        return math.exp(numerics.least_between(lambda x: field.sum(term, math.exp(x)), *ends))

    return best


# ---- the length of the cuts ----------------------------------------------------------------------

_COLUMNS, _ROWS = 144, 72  # cells of 2.5 degrees
_POLE = (27.31, 63.17, 11.7)  # longitude, latitude and turn of the grid's pole: where no cut runs along its lines
_TEAR = 5e-6  # of the semi-major axis; PROJ's goode slips by 4e-6 along the parallels where its two maps meet
_FADING = 100.0  # times _TEAR; a cut narrower than this at its end may go on, as far as the cube root of _TEAR
_APART = 0.01  # radians; ends of cuts nearer to each other are one
_MOST = 4000  # cells in a generation; if the map's edge is not a curve, their number doubles without end
_SMALLEST = 1e-7  # radians; smaller cells are left out
_STRAIGHT = 1e-6  # radians, between a piece and the sum of its parts
_TOGETHER = 1e-6  # degrees, between the two sides of one tear
_WHOLE = 0.999  # of the globe


def boundary_cuts(field: ScaleField, scale: float) -> support.Estimate:
    """The length of the cuts over 4 pi; NaN unless the region is the globe and the map shows all of it."""
    if field.region != regions.GLOBE or field.jacobians.coverage < _WHOLE:
        return support.Estimate(math.nan, math.nan)
    length, error = cut_length(field.projection)
    return support.Estimate(length / (4.0 * math.pi), error / (4.0 * math.pi))


def cut_length(projection: projections.Projection) -> tuple[float, float]:
    """The length of a map's cuts on the unit sphere, and its estimated error."""
    cells = _CutCells(projection)
    parents = cells.first()
    total = error = 0.0
    while len(parents):
        if len(parents) > _MOST:
            return total, error + float(_size(parents).sum())
        chord = cells.chords(parents)
        u0, u1, v0, v1 = parents.T
        u, v = 0.5 * (u0 + u1), 0.5 * (v0 + v1)
        quarters = [(u0, u, v0, v), (u, u1, v0, v), (u0, u, v, v1), (u, u1, v, v1)]
        children = np.stack([np.stack(part, axis=-1) for part in quarters], axis=1).reshape(-1, 4)
        parts = cells.chords(children).reshape(-1, 4)
        # A curve differs from its chord four times as much as its halves from theirs.
        gap = parts.sum(axis=1) - chord
        settled = np.abs(gap) <= _STRAIGHT
        total += float(np.sum((parts.sum(axis=1) + gap / 3.0)[settled]))
        error += float(np.abs(gap[settled]).sum())
        small = _size(parents) < _SMALLEST
        error += _TEAR ** (1.0 / 3.0) * cells.fading(parents[small & ~settled])
        # All four parts are kept: a narrow cut may be missed in a large neighbour.
        parents = children.reshape(-1, 4, 4)[~settled & ~small].reshape(-1, 4)
    return total, error


def _size(cells: FloatArray) -> FloatArray:
    """The height of cells in radians."""
    return np.asarray(np.radians(cells[:, 3] - cells[:, 2]))


class _CutCells:
    """Cells in the longitude u and the latitude v of a turned grid."""

    def __init__(self, projection: projections.Projection) -> None:
        self.projection, self.radius = projection, projection.ellipsoid.a
        up, lon = earth.unit_vectors(*_POLE[:2]), math.radians(_POLE[0])
        east = np.array([-math.sin(lon), math.cos(lon), 0.0])
        self.axes = np.stack([east, np.cross(up, east), up])

    def directions(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Unit vectors (..., 3)."""
        return np.asarray(np.stack([*earth.unit_vectors(u + _POLE[2], v)], axis=-1) @ self.axes)

    def __call__(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y, z = np.moveaxis(self.directions(u, v), -1, 0)
        return self.projection(np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(z, np.hypot(x, y))))

    def first(self) -> FloatArray:
        """The cells of the grid (n, 4) that a cut enters or may enter."""
        u = np.linspace(-180.0, 180.0, _COLUMNS + 1)
        v = np.linspace(-90.0, 90.0, _ROWS + 1)
        points = evaluate(self, *np.meshgrid(u, v))
        torn = [
            self._torn(points[start], points[stop])[0]
            for start, stop in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:]))
        ]
        across, along = torn[0].reshape(_ROWS + 1, _COLUMNS), torn[1].reshape(_ROWS, _COLUMNS + 1)
        entered = np.pad(across[:-1] | across[1:] | along[:, :-1] | along[:, 1:], 1)
        entered[:, [0, -1]] = entered[:, [-2, 1]]
        # Neighbours, too, as a narrow cut may be missed in cells so large.
        entered = entered[:-2] | entered[1:-1] | entered[2:]
        row, column = np.nonzero(entered[:, :-2] | entered[:, 1:-1] | entered[:, 2:])
        return np.stack([u[column], u[column + 1], v[row], v[row + 1]], axis=-1)

    def fading(self, cells: FloatArray) -> int:
        """Number of places where cuts end narrow, among the tiny cells in which they end."""
        torn, _, _, width = self._sides(cells)
        narrow = np.where(torn, width, 0.0).max(axis=1, initial=0.0) < _FADING * _TEAR
        places = self.directions(cells[narrow, 0], cells[narrow, 2])
        return len(np.unique(np.round(places / _APART), axis=0))

    def _sides(self, cells: FloatArray) -> tuple[BoolArray, FloatArray, BoolArray, FloatArray]:
        """The answer of `_torn` for the four sides of cells."""
        u0, u1, v0, v1 = cells.T
        corners = evaluate(self, np.stack([u0, u1, u1, u0], axis=1), np.stack([v0, v0, v1, v1], axis=1))
        torn, places, once, width = self._torn(corners, np.roll(corners, -1, axis=1))
        return torn.reshape(-1, 4), places.reshape(-1, 4, 2), once.reshape(-1, 4), width.reshape(-1, 4)

    def _torn(self, start: FloatArray, stop: FloatArray) -> tuple[BoolArray, FloatArray, BoolArray, FloatArray]:
        """For each link: whether it is torn, where (n, 2), whether just once, and how wide, in semi-major axes."""
        start, stop = start.reshape(-1, 4), stop.reshape(-1, 4)
        torn, once = np.zeros((2, len(start)), dtype=bool)
        places, width = np.full((len(start), 2), np.nan), np.zeros(len(start))
        # Any tear makes fourth differences as large as itself: links with smaller ones have none.
        shares = np.array([0.25, 0.5, 0.75])
        between = start[:, None, :2] + shares[:, None] * (stop - start)[:, None, :2]
        inner = np.stack(self(between[..., 0], between[..., 1]), axis=-1)
        f = np.concatenate([start[:, None, 2:], inner, stop[:, None, 2:]], axis=1)
        fourth = np.abs(np.diff(f, n=4, axis=1)).max(axis=(1, 2))
        look = np.flatnonzero(~(fourth < _TEAR * self.radius))
        links = find_tears(self, start[look], stop[look], self.radius, smallest=_TEAR * self.radius)
        sides = links.start[:, :2], links.stop[:, :2]
        torn[look], places[look] = links.torn, 0.5 * (sides[0] + sides[1])
        once[look] = links.torn & (np.abs(sides[0] - sides[1]).max(axis=1) <= _TOGETHER)
        width[look] = np.hypot(*(links.stop - links.start)[:, 2:].T) / self.radius
        return torn, places, once, width

    def chords(self, cells: FloatArray) -> FloatArray:
        """Length of the piece of a cut in each cell; 0 without one, NaN if it is more than one piece."""
        torn, places, once, _ = self._sides(cells)
        count = torn.sum(axis=1)
        single = (count == 2) & (once.sum(axis=1) == 2)
        order = np.argsort(~torn[single], axis=1, kind="stable")[:, :2, None]
        ends = np.take_along_axis(places[single], order, axis=1)
        start, stop = np.moveaxis(self.directions(ends[..., 0], ends[..., 1]), 1, 0)
        length = np.where(count == 0, 0.0, np.nan)
        length[single] = 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(stop - start, axis=-1)))
        return length


# ---- finite distances ----------------------------------------------------------------------------


def pairs(field: ScaleField, scale: float) -> list[support.Estimate]:
    """Gott's and Peters' measures at a scale, and ln of the scale that minimises the latter, all of the same pairs."""

    def peters(ratio: FloatArray, weight: FloatArray) -> float:
        return distances.peters(scale * ratio, weight)

    measures = [distances.gott, peters, distances.best_scale_of_distances]
    found = distances.distance_distortions(field.projection, field.region, measures)
    return [support.Estimate(one.value, one.error) for one in found]


def finite_scale_factor(field: ScaleField, scale: float) -> support.Estimate:
    """Canters' mean finite scale factor (1 + D) / (1 - D), with D the index of Peters."""
    index, error = field.once(pairs, scale)[1]
    return support.Estimate((1.0 + index) / (1.0 - index), 2.0 * error / (1.0 - index) ** 2)


def bending(field: ScaleField, scale: float) -> support.Estimate:
    """Mean distance of great circles from straight lines."""
    found = distances.great_circle_bending(field.projection, field.region)
    return support.Estimate(found.value, found.error)
