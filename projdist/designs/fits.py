"""Fits of the least-distorting map of a region by ascending degrees, of each kind of map, and poles around it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import shapely

from projdist import regions
from projdist._typing import BoolArray, ComplexArray, FloatArray, IntArray
from projdist.decisions import Objective
from projdist.designs.base_maps import MOST_POLES, BaseNodes, DesignObjective
from projdist.designs.newton import minimise_energy
from projdist.designs.plane_maps import ComplexPolynomial, ContinuedFraction, PlaneMap, PolynomialMap, Shears
from projdist.matrices import EXPONENT, Energy, principal_scales
from projdist.numerics import ComplexPolynomials, PlanePolynomials, fit_harmonic, least_range, least_squares

_ENOUGH = 1e-13  # relative size of the terms of exp(p) that are left out
_MOST = 36  # largest degree of the map, at which powers of 1e8 m do not overflow
_FITTED = range(8, 33, 4)  # degrees of a fit of exp(p) where its series converges too late
_CLOSE = 1e-9  # relative error of scales in such a fit


def conformal_map(nodes: BaseNodes, degree: int, norm: float, share: float) -> ComplexPolynomial:
    """The best conformal map whose ln k is a polynomial of a degree, by the norm of ln k: 2, more, or infinite."""
    # Raises ValueError for a degree that the nodes do not resolve, or with scales beside the region that overflow.
    weights = nodes.weights(share)
    counts = nodes.in_region if np.isinf(norm) else weights > 0.0
    u, v = nodes.plane
    z = u + 1j * v
    log_scale = 0.5 * np.log(np.linalg.det(nodes.J))
    fit = fit_harmonic(z[counts], log_scale[counts], weights[counts], degree, norm)
    slopes = _series(fit.powers)
    if np.abs(slopes[-1]) > _ENOUGH * np.abs(slopes).max():
        counts = weights > 0.0
        slopes = _fitted(fit.powers, z[counts], weights[counts])
    whole = np.concatenate([[0.0], slopes / np.arange(1, len(slopes) + 1)]) * nodes.size
    counting = np.flatnonzero(np.abs(whole) > _ENOUGH * np.abs(whole).max())
    return ComplexPolynomial(nodes.origin, nodes.size, whole[: counting[-1] + 1])


def _series(powers: Any) -> Any:
    """The Taylor series of exp(p), by n e_n = sum of k p_k e_(n-k)."""
    terms = np.zeros(_MOST, dtype=complex)
    terms[0] = np.exp(powers[0])
    for n in range(1, _MOST):
        k = np.arange(1, min(n + 1, len(powers)))
        terms[n] = np.sum(k * powers[k] * terms[n - k]) / n
    return terms


def _fitted(powers: Any, z: Any, weights: FloatArray) -> Any:
    """The polynomial nearest to exp(p) at points, of the lowest degree that is close enough, else the closest."""
    # Beside the region exp(p) may be so large that its series converges late. Raises ValueError if it overflows.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        wanted = np.exp(np.polynomial.polynomial.polyval(z, powers))
        root = np.sqrt(weights) / np.abs(wanted)
    if not (np.isfinite(wanted).all() and np.isfinite(root).all()):
        raise ValueError("Scales beside the region are beyond all numbers.")
    best, least = None, np.inf
    for degree in _FITTED:
        try:
            basis = ComplexPolynomials.over(z, weights, degree)
        except ValueError:
            break
        found = basis.powers(np.linalg.lstsq(basis.values * root[:, None], wanted * root, rcond=None)[0])
        off = float(np.abs(np.polynomial.polynomial.polyval(z, found) / wanted - 1.0).max())
        if off < least:
            best, least = found, off
        if off < _CLOSE:
            break
    if best is None:
        raise ValueError(f"{z.size} points do not tell the map.")
    return best


# ---- equal-area maps -----------------------------------------------------------------------------

_NEAR = 1e-8  # of |mu|^2: there atanh(t) / t is its series to rounding
_SQRT2 = float(np.sqrt(2.0))


def equal_area_map(nodes: BaseNodes, degree: int, share: float) -> Shears:
    """The best map by shears of a degree, with the surroundings' share of the energy."""
    weights = nodes.weights(share)
    counts = weights > 0.0
    u, v = (values[counts] for values in nodes.plane)
    columns = nodes.J[counts, 0] + 1j * nodes.J[counts, 1]
    root = np.sqrt(weights[counts])
    angles = np.pi * np.arange(degree + 2) / (degree + 2)
    free = _independent(degree)

    def coefficients(place: FloatArray) -> FloatArray:
        whole = np.zeros(free.shape)
        whole[free] = place
        return whole

    def terms(place: FloatArray) -> tuple[FloatArray, FloatArray]:
        rest, slopes = _sheared(u + 1j * v, columns, angles, coefficients(place), free)
        rest, slopes = rest * root, slopes * root[:, None]
        return np.append(rest.real, rest.imag), np.vstack([slopes.real, slopes.imag])

    with np.errstate(over="ignore", invalid="ignore"):  # in steps that go too far and are halved
        found = coefficients(least_squares(terms, np.zeros(int(free.sum()))))
    return Shears(nodes.origin, nodes.size, angles, np.hstack([np.zeros((angles.size, 1)), found]))


def _independent(degree: int) -> BoolArray:
    """Mask (degree + 2, degree) of independent coefficients: y^k has k + 2 of them, in directions spread over all."""
    free = np.zeros((degree + 2, degree), dtype=bool)
    for k in range(1, degree + 1):
        free[np.round(np.arange(k + 2) * (degree + 2) / (k + 2)).astype(int), k - 1] = True
    return free


def _sheared(z: Any, columns: Any, angles: FloatArray, coefficients: FloatArray, free: BoolArray) -> tuple[Any, Any]:
    """ln(a/b) / sqrt(2) as complex numbers (n,), with twice the larger scale's angle, and derivatives (n, p)."""
    # `columns` (n, 2) are the base Jacobian's, `coefficients` (k, degree) the shears' of y, y^2, ...; p are `free`.
    powers = np.arange(1, coefficients.shape[1] + 1)
    c, steps = columns.T, []
    for angle, own in zip(angles, coefficients, strict=True):
        turn = np.exp(-1j * angle)
        y = (z * turn).imag
        monomials = np.vander(y, powers.size + 1, increasing=True).T
        by_y = powers[:, None] * monomials[:-1]
        bend = own[1:] @ (powers[1:, None] * by_y[:-1]) if own.size > 1 else np.zeros_like(y)
        step = _Step(turn.conjugate(), monomials, by_y, own @ monomials[1:], own @ by_y, bend, (c * turn).imag)
        z, c = z + step.shift * step.back, c + step.slope * step.along * step.back
        steps.append((step, c))
    rest, sloped = _anisotropy(c)
    none = np.zeros(z.size, dtype=complex)
    later, slopes = _FollowingSteps(none + 1.0, none, none, none, none), []  # nothing follows the last
    for (step, moved), chosen in zip(reversed(steps), free[::-1], strict=True):
        by_y, by_slope = sloped(later.second(step.back, moved)), sloped(step.along * later.first(step.back))
        slopes.append(by_y * step.monomials[1:][chosen] + by_slope * step.by_y[chosen])
        later = later.after(step)
    return rest, np.vstack(slopes[::-1]).T


class _Step(NamedTuple):
    """A shear x + f(y) of a turned plane at points: powers of y with their derivatives, and f, f', f''."""

    back: complex  # turns the plane back
    monomials: FloatArray
    by_y: Any
    shift: FloatArray
    slope: FloatArray
    bend: FloatArray
    along: FloatArray  # (2, n), the y of the Jacobian's columns


class _FollowingSteps(NamedTuple):
    """First and second derivatives at points of all steps that follow one, on complex numbers and their conjugates.

    The first is P a + Q a*, the second, along a and b, A a b + B (a b* + a* b) + C a* b*, for all coefficients at once.
    """

    P: Any
    Q: Any
    A: Any
    B: Any
    C: Any

    def first(self, a: Any) -> Any:
        """The change of the result by a change a."""
        return self.P * a + self.Q * np.conj(a)

    def second(self, a: Any, b: Any) -> Any:
        """The change of the first derivative along b by a change a."""
        star_a, star_b = np.conj(a), np.conj(b)
        return self.A * a * b + self.B * (a * star_b + star_a * b) + self.C * star_a * star_b

    def after(self, step: _Step) -> _FollowingSteps:
        """The derivatives of this step and all that follow it."""
        half = 0.5j * step.slope
        own, star = 1.0 - half, half * step.back**2  # the step's P and Q
        own_c, star_c = own.conj(), star.conj()
        bent = 0.25 * step.bend * self.first(step.back)
        return _FollowingSteps(
            self.P * own + self.Q * star_c,
            self.P * star + self.Q * own_c,
            self.A * own**2 + 2.0 * self.B * own * star_c + self.C * star_c**2 - bent * step.back.conjugate() ** 2,
            self.A * own * star + self.B * (abs(own) ** 2 + abs(star) ** 2) + self.C * own_c * star_c + bent,
            self.A * star**2 + 2.0 * self.B * own_c * star + self.C * own_c**2 - bent * step.back**2,
        )


def _anisotropy(c: Any) -> tuple[Any, Callable[[Any], Any]]:
    """sqrt(2) atanh |mu| mu / |mu| for the Beltrami coefficient mu of columns c (2, n), and its derivative."""
    p, q = _beltrami_parts(c)
    mu = q / p
    square = np.minimum(np.abs(mu) ** 2, 1.0 - 1e-12)
    far = square > _NEAR
    safe = np.where(far, square, 1.0 - 1e-12)
    ratio = np.where(far, np.arctanh(np.sqrt(safe)) / np.sqrt(safe), 1.0 + square / 3.0)
    change = np.where(far, (1.0 / (1.0 - square) - ratio) / safe, 2.0 / 3.0)  # twice d ratio / d square

    def sloped(dc: Any) -> Any:
        dp, dq = _beltrami_parts(dc)
        dmu = (dq - mu * dp) / p
        return _SQRT2 * (ratio * dmu + change * mu * (mu.conj() * dmu).real)

    return _SQRT2 * ratio * mu, sloped


def _beltrami_parts(c: Any) -> tuple[Any, Any]:
    """The derivatives by z and by its conjugate of a map with columns c (2, n)."""
    return 0.5 * (c[0] - 1j * c[1]), 0.5 * (c[0] + 1j * c[1])


def general_map(nodes: BaseNodes, energy: Energy, degree: int, share: float) -> PolynomialMap:
    """The best polynomial map of a degree, with the surroundings' share of the energy; ValueError for too few nodes."""
    weights = nodes.weights(share)
    counts = weights > 0.0
    u, v = (values[counts] for values in nodes.plane)
    basis = PlanePolynomials.over(u, v, weights[counts], degree)
    gradients = basis.gradients[:, 1:] @ nodes.J[counts] / nodes.size
    # The base itself.
    plain = np.stack([u, v]) * weights[counts] @ basis.values[:, 1:]
    best = minimise_energy(energy, gradients, weights[counts], nodes.size * plain)
    return PolynomialMap(nodes.origin, nodes.size, basis.powers(np.hstack([np.zeros((2, 1)), best.place])))


# ---- degree by degree ----------------------------------------------------------------------------

SHARES = (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
"""The surroundings' shares of the energy, tried until one keeps the surroundings whole."""

_LEAST, _LARGEST = 0.5, 2.0  # scales of surroundings that are whole
_PAYS = 0.01  # least relative gain of a degree, or of poles, that counts


@dataclass(frozen=True)
class Stage:
    """A map of a degree: its figure at the nodes, the surroundings' share of the energy, and its objective."""

    degree: int
    value: float
    share: float
    objective: DesignObjective
    plane_map: PlaneMap
    around: tuple[float, float, float]  # smallest and largest scale of the surroundings, and the share that folds

    @property
    def is_whole_around(self) -> bool:
        """True if the surroundings do not fold and scales there are near 1."""
        least, largest, folded = self.around
        return folded == 0.0 and least >= _LEAST and largest <= _LARGEST


def stages(nodes: BaseNodes, objective: DesignObjective, share: float | None) -> Iterator[Stage]:
    """Maps of ascending degrees until some in a row gain too little, or the nodes do not resolve more."""
    kind, idle, least = objective.kind, 0, np.inf
    shares: tuple[float, ...] = SHARES if share is None else (share,)
    for degree in kind.degrees:
        try:
            stage = stage_of(nodes, objective, degree, shares)
        except ValueError:
            if degree == kind.degrees[0]:
                raise
            return
        yield stage
        idle = idle + 1 if stage.value > (1.0 - _PAYS) * least else 0
        if idle == kind.idle:
            return
        least, objective = min(least, stage.value), stage.objective
        shares = tuple(one for one in shares if one >= stage.share)  # finer maps need no smaller share


def best_of(found: Sequence[Stage]) -> Stage:
    """The stage after which finer ones gain less than 1 % a degree."""
    return min(found, key=lambda one: one.value * (1.0 + _PAYS) ** one.degree)


def stage_of(nodes: BaseNodes, objective: DesignObjective, degree: int, shares: Sequence[float] = SHARES) -> Stage:
    """The map of one degree at its best scale, with the first share that keeps the surroundings whole."""
    inside = nodes.in_region
    weight = nodes.weight[inside]
    for share in shares:
        plane_map, objective = _best_map(nodes, objective, degree, share)
        J = plane_map.at(nodes.x, nodes.y)[2] @ nodes.J
        if objective.kind.free_scale:
            factor = Objective(objective.figure).scale(J[inside], weight)
            plane_map, J = plane_map.moved(complex(factor), 0j), factor * J
        stage = Stage(degree, np.nan, share, objective, plane_map, _scales_around(nodes, J))
        if stage.is_whole_around or not nodes.around.any():
            break
    return replace(stage, value=objective.figure(J[inside], weight))


def _best_map(
    nodes: BaseNodes, objective: DesignObjective, degree: int, share: float
) -> tuple[PlaneMap, DesignObjective]:
    """The best map, for general maps by the exponentiated energy if the plain one is not elliptic at a node."""
    if objective.kind.name == "conformal":
        return conformal_map(nodes, degree, objective.norm, share), objective
    if objective.kind.name == "equal-area":
        return equal_area_map(nodes, degree, share), objective
    plane_map = general_map(nodes, objective.energy, degree, share)
    if needs_exponent(plane_map.at(nodes.x, nodes.y)[2] @ nodes.J, nodes.weight, objective):
        objective = replace(objective, exponent=EXPONENT)
        plane_map = general_map(nodes, objective.energy, degree, share)
    return plane_map, objective


def needs_exponent(J: FloatArray, weight: FloatArray, objective: DesignObjective) -> bool:
    """True if the energy is not elliptic at a node with weight, so that a finer map could tear there."""
    return objective.exponent == 0.0 and not objective.energy.expansion(J[weight > 0.0]).is_elliptic().all()


def _scales_around(nodes: BaseNodes, J: FloatArray) -> tuple[float, float, float]:
    """Smallest and largest scale of the surroundings, and the share of them that folds."""
    beside = nodes.around > 0.0
    if not beside.any():
        return np.nan, np.nan, np.nan
    with np.errstate(over="ignore", invalid="ignore"):  # scales of high degrees overflow far outside
        folds = np.linalg.det(J[beside]) <= 0.0
    a, b = np.moveaxis(principal_scales(J[beside]), -1, 0)
    return float(b.min()), float(a.max()), float(nodes.around[beside][folds].sum())


# ---- poles around a region, for conformal maps that polynomials do not come near -----------------

# ln k of a conformal base map may be changed by the real part of any analytic function: a polynomial, and multiples of
# (d / (z - p))^n, n > 1, with poles p at a distance d from the region. The linear programme that finds the least range
# of ln k has weights along the border; the poles least orthogonal to them, which lower the range, are added in turn.

_DISTANCES = 0.04 * 2.0 ** np.arange(4)  # of poles from the region, over its size
_APART, _SIMPLER = 0.7, 0.2  # over that distance: between places along a line; simplification of the outline
_ORDERS = (2, 3)
_AT_ONCE = 8  # poles
_NEXT, _AGAIN = 1.0, 0.3  # over the larger distance: between poles added together, and between all
_DIFFERENT = 1e-4  # of the largest singular value; functions that differ less have large factors
_FOR_FRAME = 4000  # nodes
_TINY = 1e-4  # of the largest weight
_TIGHT = "+range=1e8 +inv_tolerance=1e-11"  # in a plane in which the region has the size 1
_EDGE = 500  # edges are divided to lengths of the region's size over this


@dataclass(frozen=True)
class Poles:
    """Poles (k,), their distances from the region, and factors (k, n) of (d / (z - p))^2, ... in the slope of a map."""

    places: ComplexArray
    distances: FloatArray
    factors: Any = None

    def some(self, chosen: IntArray) -> Poles:
        """The poles of an index, without factors."""
        return Poles(self.places[chosen], self.distances[chosen])

    def functions(self, z: ComplexArray) -> list[Any]:
        """The functions of each order, (n, k), at z (n,)."""
        ratio = self.distances / (z[:, None] - self.places)
        return [ratio**order for order in _ORDERS]


def with_poles(
    nodes: BaseNodes, region: regions.Place, count: int | None, degree: int
) -> tuple[BaseNodes, ContinuedFraction] | None:
    """A conformal map of the base's plane with poles outside of a region, and nodes in its plane; None without poles.

    ln k has the least range of all with as many poles and a polynomial of a degree, which is to follow. Without a count
    some are added while that pays.
    """
    u, v = nodes.plane
    inside, counts = nodes.in_region, nodes.weight > 0.0
    z, log_k = u + 1j * v, 0.5 * np.log(np.linalg.det(nodes.J[inside]))
    powers = ComplexPolynomials.over(z[counts], nodes.weight[counts], degree).at(z[inside])[:, 1:]
    chosen = _chosen(z[inside], log_k, powers, _places(nodes, region), count)
    if not chosen.places.size:
        return None
    found = _composed(nodes, chosen)
    x, y, J = found.at(nodes.x, nodes.y)
    return replace(nodes, x=x, y=y, J=J @ nodes.J), found


def _places(nodes: BaseNodes, region: regions.Place) -> Poles:
    """Places for poles around the region and in its holes."""
    step = float(np.degrees(nodes.size / nodes.base.ellipsoid.a)) / _EDGE
    polygons = shapely.segmentize(regions.polygons_of(region), step)

    def on_plane(points: FloatArray) -> FloatArray:
        z = (np.array(nodes.base(*points.T)).T - (nodes.origin.real, nodes.origin.imag)) / nodes.size
        return np.asarray(z, dtype=float)

    area = shapely.make_valid(shapely.transform(polygons, on_plane))
    found, far = [], []
    for distance in _DISTANCES.tolist():
        around = area.simplify(_SIMPLER * distance).buffer(distance)
        for ring in shapely.get_rings(shapely.get_parts(around)):
            steps = np.arange(0.0, ring.length, _APART * distance)
            found.append(shapely.get_coordinates(shapely.line_interpolate_point(ring, steps)))
            far.append(np.full(steps.size, distance))
    x, y = np.concatenate(found).T
    return Poles(x + 1j * y, np.concatenate(far))


def _chosen(z: ComplexArray, log_k: FloatArray, powers: ComplexArray, places: Poles, count: int | None) -> Poles:
    """The poles that lower the range of ln k most, with their factors in the slope of the map."""
    taken, likely, best, least = np.zeros(0, dtype=int), np.zeros(0, dtype=int), places, np.inf
    while True:
        poles = places.some(taken)
        functions = np.hstack([powers, *poles.functions(z)])
        columns = np.hstack([functions.real, functions.imag])
        middle = columns.mean(axis=0)
        _, values, axes = np.linalg.svd((columns - middle)[:: max(1, z.size // _FOR_FRAME)], full_matrices=False)
        kept = values > _DIFFERENT * values[0]
        frame = axes[kept].T / values[kept]
        x, weights = least_range(log_k, columns @ frame - middle @ frame, likely)
        now = float(weights @ log_k)
        if count is None and now > (1.0 - _PAYS) * least:
            return best
        real, imag = (frame @ x).reshape(2, -1)[:, powers.shape[1] :]
        best, least = replace(poles, factors=(real - 1j * imag).reshape(len(_ORDERS), taken.size).T), now
        likely = np.flatnonzero(np.abs(weights) > _TINY * np.abs(weights).max())
        gains = np.abs([weights[likely] @ one for one in places.functions(z[likely])])
        wanted = min(_AT_ONCE, (MOST_POLES if count is None else count) - taken.size)
        more = _best(np.linalg.norm(gains, axis=0), places, taken, wanted)
        if not more:
            return best
        taken = np.append(taken, more)


def _best(gain: FloatArray, places: Poles, taken: IntArray, count: int) -> list[int]:
    """The numbers of the poles with the largest gains that are far enough from each other and those taken."""
    free, new = gain.copy(), list[int]()
    for _ in range(count):
        for others, apart in ((taken, _AGAIN), (new, _NEXT)):
            for other in others:
                reach = apart * np.maximum(places.distances, places.distances[other])
                free[np.abs(places.places - places.places[other]) <= reach] = -1.0
        best = int(free.argmax())
        if free[best] <= 0.0:
            break
        new.append(best)
    return new


def _composed(nodes: BaseNodes, poles: Poles) -> ContinuedFraction:
    """The map z + the integrals of the poles' functions, to first order, one pole after the other."""
    # Of w = 1 / (z - p) the map z + a w + b w^2 is a polynomial: w - a w^3 - b w^4. From one pole to the next
    # 1 / (1 / w + s) = (1 - 1 / (1 + s w)) / s: if s is not small no digits are lost.
    order = _far_apart(poles.places)
    places, distances, factors = poles.places[order].copy(), poles.distances[order], poles.factors[order]
    orders = np.array(_ORDERS)
    terms = [ComplexPolynomial(nodes.origin + nodes.size * places[0], nodes.size, np.array([0.0, 1.0 + 0.0j]))]
    origin, unit = 0.0 + 0.0j, 1.0 + 0.0j  # of the plane before a term: w = (plane - origin) / unit
    for k in range(places.size):
        own = np.zeros(orders[-1] + 2, dtype=complex)
        own[1] = 1.0
        own[orders + 1] = factors[k] * distances[k] ** orders / (orders - 1)
        later = 1.0 / (places[k + 1 :] - places[k])
        places[k + 1 :] = places[k] + 1.0 / np.polynomial.polynomial.polyval(later, own)
        last = k + 1 == places.size
        shift = 1.0 if last else places[k] - places[k + 1]
        given = own * shift / unit ** np.arange(own.size)
        if not last:
            given[0] += 1.0
        terms.append(ComplexPolynomial(origin, 1.0, given, limits=_TIGHT))
        origin, unit = 1.0 + 0.0j, -shift
    end = nodes.origin + nodes.size * places[-1]
    return ContinuedFraction((*terms, ComplexPolynomial(0.0, 1.0 / nodes.size, np.array([end, 1.0]), limits=_TIGHT)))


def _far_apart(places: ComplexArray) -> list[int]:
    """An order in which each place is far from the one before."""
    order, left = [0], set(range(1, places.size))
    while left:
        order.append(max(left, key=lambda k: abs(places[k] - places[order[-1]])))
        left.discard(order[-1])
    return order
