"""Minima of functions of a few variables in a box, by descents from the best points of a lattice; linear programmes.

Nothing is random: the lattice is that of the generalised golden ratio, evenly spread in any number of dimensions.
"""

import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from projdist._typing import FloatArray, IntArray

Terms = Callable[[FloatArray], FloatArray]
_STARTS = 4
_APART = 0.15  # of the box: starts closer than this would descend to the same place
_STEP = 1e-5  # of the box, for central differences of terms that are good to 1e-12
_REACH, _MOST_STEPS = 0.1, 40  # of a descent: first step in widths of the box, and number of steps
_ROUNDING = 1e-9  # of a maximum
_ACTIVE = 200  # terms of a group in a linear programme: those that may be largest within the step
_MOST_ROUNDS, _GAINED = 1000, 1e-10  # of least squares: rounds, of which some valleys take hundreds; relative gain
_DAMPING = 1e-3  # at first, of least squares
_AT_EDGE = 1e-4  # of the box: descents stop short of the edge, which is tried separately


class BoxMinimum(NamedTuple):
    """A minimum in a box: place, value and number of evaluations."""

    place: FloatArray
    value: float
    evaluations: int


class _Counted:
    """A function on a box as one on the unit box, which counts its evaluations."""

    def __init__(self, function: Terms, low: FloatArray, high: FloatArray, worst: bool) -> None:
        self.function, self.low, self.width, self.worst = function, low, high - low, worst
        self.evaluations = 0

    def place(self, unit: FloatArray) -> FloatArray:
        return self.low + np.clip(unit, 0.0, 1.0) * self.width

    def terms(self, unit: FloatArray) -> FloatArray:
        self.evaluations += 1
        return self.function(self.place(unit))

    def value(self, unit: FloatArray) -> float:
        """Sum of the groups' largest terms, or sum of squares of all terms."""
        terms = self.terms(unit)
        return float(terms.max(axis=-1).sum()) if self.worst else float(np.sum(terms * terms))


def lattice(dimensions: int, count: int) -> FloatArray:
    """Points (count, dimensions) spread evenly in the unit box: multiples of powers of 1/g, g^(d+1) = g + 1."""
    # M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (dimensions + 1.0))
    steps = root ** -np.arange(1.0, dimensions + 1.0)
    return np.mod(0.5 + np.arange(count)[:, None] * steps, 1.0)


def minimise(
    function: Terms,
    low: FloatArray,
    high: FloatArray,
    *,
    worst: bool,
    count: int | None = None,
    start: FloatArray | None = None,
    rough: bool = False,
) -> BoxMinimum:
    """Minimum over the box of the sum of squares of a function's terms, or, with `worst`, of the largest term."""
    # With `worst` the terms have the shape (groups, n), and the sum of the groups' largest terms is minimised. `count`
    # points are tried before the descents, by default 24 in one dimension, 53 in two and 126 in four. With a `start`
    # the minimum is the local one found by a descent from there. A `rough` minimum is accurate to 1e-4 of the box.
    counted = _Counted(function, low, high, worst)
    dimensions = low.size
    if not dimensions:
        return BoxMinimum(low, counted.value(low), 1)
    if start is None:
        points = lattice(dimensions, count or int(12 * dimensions * (dimensions + 3) ** 0.5))
        values = np.array([counted.value(point) for point in points])
        begin = min((_descend(counted, one, _ROUGH) for one in _starts(points, values)), key=counted.value)
    else:
        begin = (start - low) / counted.width
    best = begin if rough else _descend(counted, begin, _FINE)
    return BoxMinimum(counted.place(best), counted.value(best), counted.evaluations)


def descend_lattice(value: Callable[[FloatArray], Any], start: FloatArray) -> tuple[FloatArray, Any]:
    """Integer place of a local minimum, found by steps to the best neighbour, and the value there, number or tuple."""
    place, known = start, functools.cache(lambda *place: value(np.array(place)))
    offsets = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=start.size)))
    for _ in range(_MOST_STEPS):
        best = min(place + offsets, key=lambda one: known(*one))
        if not known(*best) < known(*place):
            break
        place = best
    return place, known(*place)


def least_between(function: Callable[[float], float], low: float, high: float) -> float:
    """Minimum of a unimodal function of one variable, to 1e-8 (Brent's method)."""
    from scipy.optimize import minimize_scalar  # imported here: scipy is slow to load, and few need it

    return float(minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": 1e-8}).x)


def _starts(points: FloatArray, values: FloatArray) -> list[FloatArray]:
    """The best of the points that lie apart from each other."""
    chosen: list[FloatArray] = []
    for index in np.argsort(values):
        if all(np.abs(points[index] - other).max() > _APART for other in chosen):
            chosen.append(points[index])
    return chosen[:_STARTS]


class _Effort(NamedTuple):
    """Tolerances of a descent: last step in widths of the box, last relative gain, and kind of differences."""

    step: float
    gain: float
    differences: Literal["2-point", "3-point"]


_ROUGH, _FINE = _Effort(1e-4, 1e-5, "2-point"), _Effort(1e-10, 1e-14, "3-point")


def _descend(counted: _Counted, start: FloatArray, effort: _Effort) -> FloatArray:
    """The place where a descent ends, moved to the edges near it if it is better there."""
    found = _minimax(counted, start, effort) if counted.worst else _least_squares(counted, start, effort)
    edges = np.where(found < _AT_EDGE, 0.0, np.where(found > 1.0 - _AT_EDGE, 1.0, found))
    return min((found, edges), key=counted.value)


def _least_squares(counted: _Counted, start: FloatArray, effort: _Effort) -> FloatArray:
    from scipy.optimize import least_squares  # scipy is slow to load, and few need it

    start = np.clip(start, _AT_EDGE, 1.0 - _AT_EDGE)
    slopes: dict[str, Any] = {"jac": effort.differences, "diff_step": _STEP / start}
    ends: dict[str, Any] = {"xtol": effort.step, "ftol": effort.gain, "gtol": 1e-14, "max_nfev": 40}
    return np.asarray(least_squares(counted.terms, start, bounds=(0.0, 1.0), **slopes, **ends).x)


def _minimax(counted: _Counted, start: FloatArray, effort: _Effort) -> FloatArray:
    """Sequential linear programming: each step minimises the largest linearised term in a trust region."""
    # If as many terms are equal at the minimum as there are variables, the convergence is quadratic (Madsen 1975,
    # "An algorithm for minimax solution of overdetermined systems of non-linear equations").
    found, radius = np.clip(start, 0.0, 1.0), _REACH
    terms = counted.terms(found)
    for _ in range(_MOST_STEPS):
        slopes = _slopes(counted, found)
        value = float(terms.max(axis=-1).sum())
        while radius > effort.step:
            step, promised = _linear_step(terms, slopes, found, radius)
            if value - promised <= max(effort.gain, _ROUNDING) * abs(value):
                return found
            tried = np.clip(found + step, 0.0, 1.0)
            there = counted.terms(tried)
            gain = (value - float(there.max(axis=-1).sum())) / (value - promised)
            radius *= 2.0 if gain > 0.75 else 0.35 if gain < 0.25 else 1.0
            if gain > 0.05:
                found, terms = tried, there
                break
        else:
            return found
    return found


def _slopes(counted: _Counted, place: FloatArray) -> FloatArray:
    """Central differences of the terms, (groups, n, dimensions); one-sided at the edge of the box."""
    columns = []
    for axis in np.eye(place.size):
        ahead, behind = np.clip(place + _STEP * axis, 0.0, 1.0), np.clip(place - _STEP * axis, 0.0, 1.0)
        columns.append((counted.terms(ahead) - counted.terms(behind)) / float((ahead - behind) @ axis))
    return np.stack(columns, axis=-1)


def _linear_step(terms: FloatArray, slopes: FloatArray, place: FloatArray, radius: float) -> tuple[FloatArray, float]:
    """The step within `radius` and the box that minimises the sum of the groups' largest linearised terms."""
    from scipy.optimize import linprog  # as above

    groups, dimensions = terms.shape[0], place.size
    rows, sides = [], []
    for group in range(groups):
        reach = terms[group] + radius * np.abs(slopes[group]).sum(axis=-1)
        highest = np.argsort(reach)[-_ACTIVE:]
        bound = np.zeros((highest.size, groups))
        bound[:, group] = -1.0
        rows.append(np.hstack([slopes[group, highest], bound]))
        sides.append(-terms[group, highest])
    limits = [(max(-radius, -x), min(radius, 1.0 - x)) for x in place] + [(None, None)] * groups
    cost = np.concatenate([np.zeros(dimensions), np.ones(groups)])
    found: Any = linprog(cost, A_ub=np.vstack(rows), b_ub=np.concatenate(sides), bounds=limits, method="highs")
    if found.status != 0:
        return np.zeros(dimensions), np.inf
    return np.asarray(found.x[:dimensions]), float(found.fun)


def least_largest(columns: FloatArray, values: FloatArray) -> FloatArray:
    """The x (m,) that minimises max |values + columns x|, columns (n, m), by linear programming."""
    # The programme starts with some rows and adds those above its optimum (E. Remez 1934). Raises ValueError.
    from scipy.optimize import linprog  # as above

    count, size = columns.shape[1], np.abs(values).max()
    if size == 0.0:
        return np.zeros(count)
    values = values / size  # the solver's tolerances are 1e-7
    seen = np.unique(np.linspace(0, len(values) - 1, 8 * count).astype(int))
    while True:
        some, up = columns[seen], np.ones((seen.size, 1))
        left, right = np.block([[some, -up], [-some, -up]]), np.concatenate([-values[seen], values[seen]])
        cost, limits = np.eye(1, count + 1, count)[0], [(None, None)] * count + [(0.0, None)]
        found: Any = linprog(cost, A_ub=left, b_ub=right, bounds=limits, method="highs")
        if found.status != 0:
            raise ValueError(f"{len(values)} points do not tell {count} terms apart.")
        rest = np.abs(values + columns @ found.x[:count])
        above = np.flatnonzero(rest > found.x[count] * (1.0 + _ROUNDING))
        new = np.setdiff1d(above[np.argsort(-rest[above])[: 4 * count]], seen)
        if not new.size:
            return np.asarray(size * found.x[:count])
        seen = np.append(seen, new)


_ENOUGH_ROWS, _OVER = 2000, 1e-3  # rows to start with; share of the range by which others may lie outside it
_CLOSE, _MOST_INTERIOR = 3e-4, 40  # duality gap as a share of the range, and number of steps, at which to stop
_SLIGHT = 1e-12  # of the largest weight: smaller weights do not matter
_NOTHING = 1e-6  # of the first range: smaller ranges count as this
_Steps = tuple[FloatArray, FloatArray, FloatArray]


def least_range(
    values: FloatArray, columns: FloatArray, likely: Sequence[int] | IntArray = ()
) -> tuple[FloatArray, FloatArray]:
    """The x (m,) that gives values + columns x (n, m) about the least range, and the weights (n,) that prove it."""
    # The positive weights sum to 1, the negative ones to -1, and all are about orthogonal to the columns: times values
    # they give the range. A column that is not orthogonal to them would reduce it. `likely`: rows that may get weights.
    some = np.linspace(0, len(values) - 1, _ENOUGH_ROWS + 8 * columns.shape[1]).astype(int)
    seen = np.union1d(some, np.asarray(likely, dtype=int))
    while True:
        x, found = _central_path(values[seen], columns[seen])
        rest = values + columns @ x
        low, high = rest[seen].min(), rest[seen].max()
        outside = np.maximum(rest - high, low - rest)
        new = np.argsort(-outside)[: 4 * columns.shape[1]]
        new = new[outside[new] > _OVER * (high - low)]
        if not new.size:
            weights = np.zeros(len(values))
            weights[seen] = found
            return x, weights
        seen = np.union1d(seen, new)


def _central_path(values: FloatArray, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`least_range` of all rows, by an interior-point method (S. Mehrotra 1992, SIAM J. Optimization 2:575)."""
    count, unit, sign = columns.shape[1], float(np.ptp(values)) or 1.0, np.array([[1.0], [-1.0]])
    values, x = values / unit, np.zeros(count)
    top = np.array([values.max(), -values.min()]) + 0.1  # above the values and above minus the values
    weights = np.full((2, len(values)), 1.0 / len(values))

    def longest(at: FloatArray, step: FloatArray) -> float:
        return 1.0 / max(1.0, float((-step / at).max()))

    def direction(product: FloatArray, slack: FloatArray, weights: FloatArray, inverse: FloatArray) -> _Steps:
        """Steps of x and the tops, of the slack and of the weights that change slack times weights by a product."""
        q = product / slack
        right = [-columns.T @ (sign * (weights + q)).sum(axis=0), (weights + q).sum(axis=1) - 1.0]
        step = inverse @ np.concatenate(right)
        opened = step[count:, None] - sign * (columns @ step[:count])
        return step, opened, q - weights / slack * opened

    for _ in range(_MOST_INTERIOR):
        slack = top[:, None] - sign * (values + columns @ x)
        mean = float((slack * weights).mean())
        if mean * slack.size < _CLOSE * max(float(top.sum()), _NOTHING):
            break
        D = weights / slack
        kept = D.sum(axis=0) > _SLIGHT * D.sum(axis=0).max()
        some = columns[kept]
        cross = some.T @ (sign * D[:, kept]).T
        K = np.block([[some.T @ (some * D[:, kept].sum(axis=0)[:, None]), -cross], [-cross.T, np.diag(D.sum(axis=1))]])
        K.ravel()[:: len(K) + 1] *= 1.0 + 1e-12
        inverse = np.linalg.inv(K)
        _, opened, change = direction(-slack * weights, slack, weights, inverse)
        after = (slack + longest(slack, opened) * opened) * (weights + longest(weights, change) * change)
        centre = mean * (float(after.mean()) / mean) ** 3
        step, opened, change = direction(centre - slack * weights - opened * change, slack, weights, inverse)
        part = 0.99 * longest(slack, opened)
        x, top = x + part * step[:count], top + part * step[count:]
        weights = weights + 0.99 * longest(weights, change) * change
    return unit * x, weights[0] - weights[1]


def least_squares(terms: Callable[[FloatArray], tuple[FloatArray, FloatArray]], start: FloatArray) -> FloatArray:
    """Variables that minimise the sum of squares of `terms`, which returns values (n,) and slopes (n, m)."""
    # Levenberg-Marquardt: a step that does not reduce the sum, or overflows, is tried again with more damping.
    place, damping = start, _DAMPING
    value, slopes = terms(place)
    square = float(value @ value)
    for _ in range(_MOST_ROUNDS):
        normal, downhill = slopes.T @ slopes, -slopes.T @ value
        size = np.diag(np.diag(normal) + 1e-12 * np.trace(normal))
        while True:
            step = np.linalg.solve(normal + damping * size, downhill)
            tried, there = terms(place + step)
            found = float(tried @ tried)
            if found < square or damping > 1e12:
                break
            damping *= 5.0
        if not found < square:
            break
        promised = float(step @ (downhill + damping * size @ step))
        gained, place, value, slopes = square - found, place + step, tried, there
        square = found
        damping *= 0.1 if gained > 0.75 * promised else 1.0 if gained > 0.25 * promised else 3.0
        if gained < _GAINED * square:
            break
    return place
