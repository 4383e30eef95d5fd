"""The Jacobian field as polynomials on pieces of a region, with errors; pieces can be sampled anew in quarters."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.field.cubature import Samples
from projdist.field.panels import sample_pieces, second_derivatives
from projdist.numerics import DIFFERENTIATE, LEGENDRE, NODES, ORDER, PLANE_WEIGHTS
from projdist.projections import Projection
from projdist.regions import Region

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
