"""Fits of the least-distorting map of a region: conformal, equal-area and general maps, by ascending degrees."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray
from projdist.decisions import Objective
from projdist.designs.base_maps import BaseNodes, DesignObjective
from projdist.designs.newton import minimise_energy
from projdist.designs.plane_maps import ComplexPolynomial, PlaneMap, PolynomialMap, Shears
from projdist.matrices import EXPONENT, Energy, principal_scales
from projdist.numerics import ComplexPolynomials, PlanePolynomials, fit_harmonic, least_squares

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
    # Columns (n, 2) are those of the base's Jacobian, coefficients (k, degree) those of the shears' y, y^2, ...;
    # derivatives are by the p coefficients that are `free`.
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
_PAYS = 0.01  # least relative gain of a degree that counts


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
