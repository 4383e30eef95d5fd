"""What is searched for, what is known of it, and the Jacobian field as polynomials on pieces of a region."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.at_points import derivatives, jacobian
from projdist.field.cubature import Samples
from projdist.field.panels import sample_pieces, second_derivatives
from projdist.field.stencils import hessian
from projdist.matrices import Measure
from projdist.numerics import DIFFERENTIATE, LEGENDRE, NODES, ORDER, PLANE_WEIGHTS
from projdist.projections import Projection
from projdist.regions import Region


class Extreme(NamedTuple):
    """A largest or smallest value and its place; infinite where the measure grows without bound towards it.

    `error` is by how much the true extreme may lie beyond the value, rounding included; NaN for what is infinite.
    """

    value: float
    lon: float
    lat: float
    error: float = math.nan


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

    @property
    def limit(self) -> float:
        """What the value times the sign never exceeds, whatever the map."""
        low, high = self.measure.limits
        return high if self.largest else -low

    def of(self, field: FloatArray) -> FloatArray:
        """What shall be large, from J's entries and those of H where they are needed, on the last axis; or -inf."""
        J = field[..., :4].reshape(*field.shape[:-1], 2, 2)
        H = field[..., 4:].reshape(*field.shape[:-1], 2, 2, 2) if self.measure.needs_hessian else None
        return defined(self.sign * self.measure(J, H))

    def change(self, field: FloatArray, error: FloatArray) -> FloatArray:
        """By how much it may change as each entry of fields (n, k) does by its error; infinite where it gets lost."""
        k = field.shape[-1] if self.measure.needs_hessian else 4
        moved = np.where(np.eye(k, dtype=bool), error[..., None, :k], 0.0)
        moved = np.stack([field[..., None, :k] + moved, field[..., None, :k] - moved])
        with np.errstate(invalid="ignore", over="ignore"):
            changes = np.abs(self.of(moved) - self.of(field)[..., None]).max(axis=0)
        return np.where(np.isnan(changes), np.inf, changes).sum(axis=-1)


def defined(values: FloatArray) -> FloatArray:
    """Values with -inf where they are none."""
    return np.where(np.isfinite(values), values, -np.inf)


def measure_at(
    projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray, J: FloatArray | None = None
) -> FloatArray:
    """A measure at points in degrees, where J may be known; H is per radian of the semi-major axis."""
    J = jacobian(projection, lon, lat) if J is None else J
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat))


# ---- the Jacobian as polynomials -----------------------------------------------------------------


_SLOPE = 50.0  # of the first Legendre polynomial left out, at the ends: ORDER (ORDER + 1) / 2 = 55
_BENT = 1e3  # its second derivative there, over the width: what second derivatives lack
# Times the last coefficients: what is left out of smooth fields is less, and rounding, whose coefficients all are so
# large, adds up to that in a corner.
_LEFT_OUT = 4.0
_HALVES = 0.5 * NODES - 0.5, 0.5 * NODES + 0.5


@dataclass(frozen=True, kw_only=True)
class Polynomials:
    """Polynomials through the nodes of n pieces: chart coordinates, and the k entries of J, or of J and H."""

    patch: IntArray
    u: FloatArray  # (n, p, p)
    v: FloatArray
    field: FloatArray  # (n, k, p, p)
    error: FloatArray  # (n, k), of each entry anywhere in the piece
    clipped: BoolArray  # whether the region ends within the piece
    size: FloatArray  # half of its width in m, about

    def __len__(self) -> int:
        return len(self.patch)

    def take(self, index: IntArray) -> Polynomials:
        """Some of them."""
        return Polynomials(**{field.name: getattr(self, field.name)[index] for field in fields(self)})

    def joined(self, other: Polynomials) -> Polynomials:
        """These, then others."""
        names = [field.name for field in fields(self)]
        return Polynomials(**{name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in names})

    @property
    def straight(self) -> BoolArray:
        """Which pieces are rectangles in the chart, whose sides are those of the nodes."""
        bent = np.ptp(self.u, axis=2).max(axis=1) + np.ptp(self.v, axis=1).max(axis=1)
        return np.asarray(bent <= 1e-12 * (np.ptp(self.u, axis=(1, 2)) + np.ptp(self.v, axis=(1, 2))))

    @property
    def rectangle(self) -> FloatArray:
        """Least and largest u and v (n, 4), of pieces that are rectangles."""
        sides = [self.u[:, 0, 0], self.u[:, -1, -1], self.v[:, 0, 0], self.v[:, -1, -1]]
        middle = [0.5 * (low + high) for low, high in (sides[:2], sides[2:])]
        half = [0.5 * (high - low) / NODES[-1] for low, high in (sides[:2], sides[2:])]
        return np.stack([part for c, h in zip(middle, half, strict=True) for part in (c - h, c + h)], axis=-1)

    def on_grids(self, piece: IntArray, r: FloatArray, s: FloatArray) -> FloatArray:
        """The fields at grids r (m, q) by s (m, q) of pieces (m,), entries last: (m, q, q, k)."""
        values = basis(r)[:, None] @ self.field[piece] @ basis(s)[:, None].swapaxes(-1, -2)
        return np.moveaxis(values, 1, -1)

    def at(self, piece: IntArray, r: FloatArray, s: FloatArray) -> FloatArray:
        """The fields at points r, s (m, q) of pieces (m,), entries last: (m, q, k)."""
        at_r, at_s = basis(r)[:, None], basis(s)[:, None]
        return np.moveaxis(((at_r @ self.field[piece]) * at_s).sum(axis=-1), 1, -1)

    def places(self, piece: IntArray, r: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The chart coordinates at grids r (m, q) by s (m, q): both (m, q, q)."""
        at_r, at_s = basis(r), basis(s).swapaxes(-1, -2)
        return at_r @ self.u[piece] @ at_s, at_r @ self.v[piece] @ at_s

    def quarters(self, projection: Projection, region: Region, piece: IntArray) -> Polynomials:
        """The four quarters of some pieces, sampled anew: those of the first piece, those of the second, ..."""
        where = [(r, s) for r in _HALVES for s in _HALVES]
        u, v = (
            np.stack([basis(r) @ values[piece] @ basis(s).T for r, s in where], axis=1).reshape(-1, ORDER, ORDER)
            for values in (self.u, self.v)
        )
        patch, n = np.repeat(self.patch[piece], 4), 4 * len(piece)
        partials = (DIFFERENTIATE @ u, u @ DIFFERENTIATE.T, DIFFERENTIATE @ v, v @ DIFFERENTIATE.T)
        rule = np.broadcast_to(PLANE_WEIGHTS, u.shape)
        whole, curved = np.ones(n, dtype=bool), self.field.shape[1] > 4
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            new = sample_pieces(projection, region, np.arange(n), patch, u, v, partials, rule, whole, curved=curved)
            entries = [new.jacobian.reshape(n, ORDER, ORDER, 4)]
            if curved:
                H = second_derivatives(new, projection.ellipsoid) * projection.ellipsoid.a
                entries.append(H.reshape(n, ORDER, ORDER, 8))
        clipped = np.repeat(self.clipped[piece], 4)
        return _polynomials(patch, u, v, np.concatenate(entries, axis=-1), new.doubt.sum(axis=-1), clipped, new.density)


def polynomials_of(samples: Samples) -> Polynomials:
    """The pieces of samples."""
    shape = samples.lon.shape
    entries = [samples.jacobian.reshape(*shape, 4)]
    if samples.hessian is not None:
        entries.append(samples.hessian.reshape(*shape, 8))
    field = np.concatenate(entries, axis=-1)
    return _polynomials(samples.patch, samples.u, samples.v, field, samples.doubt, samples.share < 1.0, samples.density)


def _polynomials(
    patch: IntArray,
    u: FloatArray,
    v: FloatArray,
    entries: FloatArray,
    doubt: FloatArray,
    clipped: BoolArray,
    density: FloatArray,
) -> Polynomials:
    field = np.ascontiguousarray(np.moveaxis(entries, -1, 1))
    with np.errstate(invalid="ignore", over="ignore"):
        along = np.stack([np.abs(LEGENDRE @ field).max(axis=3), np.abs(field @ LEGENDRE.T).max(axis=2)], axis=-2)
        last = along[..., ORDER - 2 :].max(axis=-1)
        error = _LEFT_OUT * last.sum(axis=-1)
        scale = np.sqrt(0.5 * (field[:, :4] ** 2).sum(axis=1).mean(axis=(1, 2)))
        error[:, :4] += (_SLOPE * doubt * scale)[:, None]
        if field.shape[1] > 4:
            error[:, 4:] += (_BENT * doubt * np.abs(field[:, 4:]).max(axis=(1, 2, 3)))[:, None]
    return Polynomials(
        patch=patch,
        u=u,
        v=v,
        field=field,
        error=np.nan_to_num(error, nan=np.inf),
        clipped=clipped,
        size=np.sqrt(density.max(axis=(1, 2))),
    )


def basis(t: FloatArray) -> FloatArray:
    """Values at the nodes to values of the polynomials through them at t: (..., p)."""
    return np.polynomial.legendre.legvander(t, ORDER - 1) @ LEGENDRE


# ---- the state of a search -----------------------------------------------------------------------


class State:
    """What is known in the search for one goal: what it reaches for certain, a bound, and the pieces in question."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.live = np.empty(0, dtype=int)  # pieces to be looked at
        self.good: list[Chosen] = []  # whose polynomials are good enough
        self.rough: list[Chosen] = []  # which have none that are
        self.known = -np.inf
        self.known_at: tuple[float, float] | None = None
        self.bound = -np.inf  # of all that was looked at and left
        self.exact = 0.0  # what is no more than rounding
        self.places: list[tuple[float, float]] = []  # where it may be largest

    def raise_bound(self, bounds: FloatArray) -> None:
        """What is left has so high bounds."""
        self.bound = max(self.bound, float(bounds.max(initial=-np.inf)))


class Chosen(NamedTuple):
    """Pieces, a goal's bounds there, and its errors."""

    piece: IntArray
    bound: FloatArray
    error: FloatArray

    @staticmethod
    def joined(parts: Sequence[Chosen]) -> Chosen:
        """All pieces of some."""
        return Chosen(*(np.concatenate(part) for part in zip(NOBODY, *parts, strict=True)))


NOBODY = Chosen(np.empty(0, dtype=int), np.empty(0), np.empty(0))


# ---- values at places ----------------------------------------------------------------------------


_EXACT = 1e-10  # of the scales: what a search resolves, above the rounding of derivatives
BENT = 1e-7  # of the second derivatives
_LEAST = 2e-12  # of J, as the differences leave it


def measured(projection: Projection, states: Sequence[State], found: Sequence[Extreme]) -> list[Extreme]:
    """The best of the places of each goal, measured there, or else the best node; with its error."""
    if not states:
        return []
    places = [place for state in states for place in state.places]
    bent = any(state.goal.measure.needs_hessian for state in states)
    lon, lat = np.array(places).reshape(-1, 2).T
    fields, errors = fields_at(projection, lon, lat, bent)
    ends = np.cumsum([len(state.places) for state in states])
    parts = zip(np.split(fields, ends[:-1]), np.split(errors, ends[:-1]), strict=True)
    return [_measured_at(state, node, *part) for state, node, part in zip(states, found, parts, strict=True)]


def fields_at(projection: Projection, lon: FloatArray, lat: FloatArray, bent: bool) -> tuple[FloatArray, FloatArray]:
    """The entries of J, and if `bent` of H, at points, and their errors: both (n, k)."""
    lon, lat = np.asarray(lon), np.asarray(lat)
    found = derivatives(projection, lon, lat)
    field = found.jacobian.reshape(-1, 4)
    error = (_size(field) * np.maximum(found.error, _LEAST))[:, None] * np.ones(4)
    if bent:
        H = hessian(projection, lon, lat).reshape(-1, 8)
        field, lost = np.concatenate([field, H], axis=1), BENT * np.maximum(np.abs(H).max(axis=1), _size(field))
        error = np.concatenate([error, np.broadcast_to(lost[:, None], H.shape)], axis=1)
    return field, error


def _measured_at(state: State, node: Extreme, fields: FloatArray, errors: FloatArray) -> Extreme:
    """The largest value at a goal's places, with its error; without one, what is known of polynomials or a node."""
    values = state.goal.of(fields)
    best, rounding = node, 0.0
    if np.isfinite(values).any():
        changes = state.goal.change(fields, errors)
        certain = np.where(np.isfinite(changes) & np.isfinite(values), values - np.nan_to_num(changes), -np.inf)
        top = int((certain if np.isfinite(certain).any() else values).argmax())
        best, rounding = Extreme(float(values[top]), *state.places[top]), float(changes[top])
    singular = state.known_at in state.places and values[state.places.index(state.known_at)] == -np.inf
    if state.known_at is not None and singular and state.known > best.value:
        best, rounding = Extreme(state.known, *state.known_at), 0.0
    return best._replace(error=max(state.bound - best.value, 0.0) + rounding)


def _size(field: FloatArray) -> FloatArray:
    """The scale of J, from fields (..., k)."""
    return np.sqrt(0.5 * (field[..., :4] ** 2).sum(axis=-1))


def exact(field: FloatArray) -> FloatArray:
    """What a search resolves of each entry of a field (k,)."""
    error = np.full(field.shape, _EXACT * _size(field))
    error[4:] = BENT * np.abs(field[4:]).max(initial=0.0)
    return error
