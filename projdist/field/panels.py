"""Spectral panels: a projection sampled at Gauss nodes, differentiated and integrated.

A panel is a rectangle in a region's chart, sampled at 10 x 10 Gauss nodes. The differentiation
matrix of the nodes turns one evaluation of the projection a node into its Jacobian; the tail of
the integrand's Legendre coefficients tells how well the panel resolves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import Ellipsoid
from projdist.numerics import DIFFERENTIATE, LEGENDRE, ORDER
from projdist.projections import Projection
from projdist.regions import Region

_FALLING = 0.5  # pairs of coefficients that fall at least so fast go on falling; those of kinks and rounding do not
_ROUNDING = 1e-12  # of x and y; PROJ's own arithmetic included
_BLURRED, _HARMLESS = 0.05, 0.01  # of J's largest coefficient but the constant; per radian
_SLOPE = 1.0  # their slopes reach 45 at the ends, but most of it integrates to nothing


@dataclass(kw_only=True)
class Pieces:
    """Smooth pieces of panels: the whole of a panel, or what lies on one side of a cut.

    All arrays have the pieces on the first axis, and the nodes, where there are any, on the next two.
    """

    panel: IntArray
    patch: IntArray
    u: FloatArray
    v: FloatArray
    lon: FloatArray
    lat: FloatArray
    jacobian: FloatArray
    sides: FloatArray  # (n, p, p, 2, 2), m, d(east, north) / d(r, s) of the node coordinates r, s in [-1, 1]
    density: FloatArray  # m^2 in the unit square of the nodes
    weight: FloatArray  # m^2; of either sign in panels that the region's edge crosses
    share: FloatArray  # (n,), of the piece that is in the region; 1 for the whole of it
    unresolved: FloatArray  # last Legendre coefficients of x and y, in semi-major axes: rounding, or a seam
    doubt: FloatArray  # (n, 2): by how much, along u and v, they may have changed the logarithms of the scales

    def take(self, keep: BoolArray) -> Pieces:
        """The pieces of a mask."""
        return Pieces(**{field.name: getattr(self, field.name)[keep] for field in fields(self)})

    @staticmethod
    def joined(parts: Sequence[Pieces]) -> Pieces:
        """Several batches as one."""
        names = [field.name for field in fields(Pieces)]
        return Pieces(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


Partial = FloatArray | float


def sample_pieces(
    projection: Projection,
    region: Region,
    panel: IntArray,
    patch: IntArray,
    u: FloatArray,
    v: FloatArray,
    partials: tuple[Partial, Partial, Partial, Partial],
    rule: FloatArray,
    whole: BoolArray,
) -> tuple[Pieces, FloatArray, FloatArray]:
    """The pieces with chart coordinates u, v at their nodes (n, p, p), and x, y there.

    `partials` are du/dr, du/ds, dv/dr, dv/ds, with r and s in [-1, 1] along the two node axes; `rule` holds the
    nodes' weights on that square, which are Gauss's where a piece is `whole`.
    """
    points = region.chart(patch[:, None, None], u, v)
    x, y = projection(points.lon, points.lat)
    meridian, vertical = projection.ellipsoid.radii(points.lat)
    u_r, u_s, v_r, v_s = partials
    east_r = (points.east_u * u_r + points.east_v * v_r) * vertical
    east_s = (points.east_u * u_s + points.east_v * v_s) * vertical
    north_r = (points.north_u * u_r + points.north_v * v_r) * meridian
    north_s = (points.north_u * u_s + points.north_v * v_s) * meridian
    det = east_r * north_s - east_s * north_r
    # Less a constant, there is less to round, and nothing where PROJ snaps to a pole line.
    moved = np.stack([x, y])
    moved -= moved[..., :1, :1].copy()
    J = np.empty((*u.shape, 2, 2))
    for i, f in enumerate(moved):
        f_r, f_s = DIFFERENTIATE @ f, f @ DIFFERENTIATE.T
        J[..., i, 0] = (f_r * north_s - f_s * north_r) / det
        J[..., i, 1] = (f_s * east_r - f_r * east_s) / det
    density = np.abs(det)
    share = np.where(whole, 1.0, 0.25 * rule.sum(axis=(1, 2)))
    left, decay = _left_out(moved)
    metres = np.stack(
        [np.hypot(east_r, north_r).mean(axis=(1, 2)), np.hypot(east_s, north_s).mean(axis=(1, 2))], axis=-1
    )
    # Rounding of x and y is white, and the integrand's own coefficients see it.
    size = np.maximum(np.abs(x).max(axis=(1, 2)), np.abs(y).max(axis=(1, 2)))
    scale = np.sqrt(np.abs(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]).mean(axis=(1, 2)))[:, None]
    seen = (left > _ROUNDING * size[:, None]) & (scale > 0)
    doubt = np.log1p(np.divide(_SLOPE * decay**0.75 * left, metres * scale, out=np.zeros_like(left), where=seen))
    sides = np.empty((*u.shape, 2, 2))
    sides[..., 0, 0], sides[..., 0, 1], sides[..., 1, 0], sides[..., 1, 1] = east_r, east_s, north_r, north_s
    pieces = Pieces(
        panel=panel,
        patch=patch,
        u=u,
        v=v,
        lon=points.lon,
        lat=points.lat,
        jacobian=J,
        sides=sides,
        density=density,
        weight=density * rule,
        share=share,
        unresolved=left.max(axis=-1) / projection.ellipsoid.a,
        doubt=doubt,
    )
    return pieces, x, y


def second_derivatives(pieces: Pieces, ellipsoid: Ellipsoid) -> FloatArray:
    """H (n, p, p, 2, 2, 2) along geodesics at the nodes, in 1/m.

    In the node coordinates, in which the map and the sides are as smooth as they can be, it is the second derivatives
    less the Jacobian of how the coordinate lines bend; the frame of east and north turns by sin(lat) per longitude.
    """
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
    """Whether J, in the pieces of an index, varies so little smoothly that its derivatives are none.

    They count where they would make a difference to flexion and skewness.
    """
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


def _left_out(f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Size (n, 2) of the last Legendre coefficients of f (2, n, p, p) along the two node axes, and their decay."""
    along = np.stack([np.abs(LEGENDRE @ f).max(axis=(0, 3)), np.abs(f @ LEGENDRE.T).max(axis=(0, 2))], axis=1)
    pairs = np.maximum(along[..., ORDER - 6 :: 2], along[..., ORDER - 5 :: 2])
    return pairs[..., -1], _decay(pairs)


def _decay(pairs: FloatArray) -> FloatArray:
    """By how much less the next pair of coefficients will be, from the last three; 1 where they do not fall."""
    before, last = pairs[..., :-1], pairs[..., 1:]
    ratio = np.divide(last, before, out=np.zeros_like(last), where=before > 0).max(axis=-1)
    return np.where(ratio < _FALLING, ratio, 1.0)


def tails(values: FloatArray, density: FloatArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sizes (..., 2) of the integrands' last Legendre coefficients along the two node axes, and the integrals' errors.

    The rule is exact for twice as many coefficients as there are nodes, so that those seen are far larger than those
    that do the harm: where the last pairs fall, they count as much as the next but one would (Berntsen &
    Espelid 1991, ACM TOMS 17:233; there the next but three or more). In a piece of which only a share is in the
    region, the integral is that of the polynomial through the nodes, whose error is as large as the next pair.
    """
    c = LEGENDRE @ (values * density) @ LEGENDRE.T
    square = c * c
    along = np.stack([square.sum(axis=-1), square.sum(axis=-2)], axis=-2)[..., ORDER - 6 :]
    # The integral over [-1, 1]^2 of the constant term is 4 times it.
    pairs = 4.0 * share[:, None, None] * np.sqrt(along[..., ::2] + along[..., 1::2])
    return pairs[..., -1], pairs[..., -1] * _decay(pairs) ** np.where(share == 1.0, 2, 1)[:, None]
