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
from projdist.field.layouts import Layout, Partial, lay
from projdist.numerics import DIFFERENTIATE, LEGENDRE, ORDER
from projdist.projections import Projection
from projdist.regions import Region

# From one side along a node axis: the derivative, and the last Legendre coefficients.
_FROM_LEFT = np.concatenate([DIFFERENTIATE, LEGENDRE[ORDER - 6 :]])
_FROM_RIGHT = np.ascontiguousarray(_FROM_LEFT.T)
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
    sides: FloatArray  # (n, p, p, 2, 2), m, d(east, north) / d(r, s) of the node coordinates in [-1, 1]; (n, 0) if none
    density: FloatArray  # m^2 in the unit square of the nodes
    weight: FloatArray  # m^2; of either sign in panels that the region's edge crosses
    share: FloatArray  # (n,), of the piece that is in the region; 1 for the whole of it
    unresolved: FloatArray  # last Legendre coefficients of x and y, in semi-major axes: rounding, or a seam
    doubt: FloatArray  # (n, 2): by how much, along u and v, they may have changed the logarithms of the scales

    def take(self, keep: BoolArray) -> Pieces:
        """The pieces of a mask."""
        if keep.all():
            return self
        return Pieces(**{field.name: getattr(self, field.name)[keep] for field in fields(self)})

    @staticmethod
    def joined(parts: Sequence[Pieces]) -> Pieces:
        """Several batches as one."""
        if len(parts) == 1:
            return parts[0]
        names = [field.name for field in fields(Pieces)]
        return Pieces(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


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
    *,
    curved: bool,
) -> Pieces:
    """The pieces that `lay` lays; those that are `curved` have sides, for second derivatives."""
    layout = lay(region, projection.ellipsoid, patch, u, v, partials, rule, whole)
    return pieces_of(panel, layout, np.stack(projection(layout.lon, layout.lat)), projection.ellipsoid, curved=curved)


def pieces_of(panel: IntArray, layout: Layout, xy: FloatArray, ellipsoid: Ellipsoid, *, curved: bool) -> Pieces:
    """Pieces of a layout, with x and y (2, n, p, p) there; those that are `curved` have sides."""
    # Less a constant, there is less to round, and nothing where PROJ snaps to a pole line.
    moved = xy - xy[..., :1, :1]
    shape = moved.shape
    along_s = (moved.reshape(-1, ORDER) @ _FROM_RIGHT).reshape(*shape[:-1], -1)
    along_r = _FROM_LEFT @ moved
    J = layout.jacobian(along_r[..., :ORDER, :], along_s[..., :ORDER])
    pairs = _pairs(np.abs(along_r[..., ORDER:, :]).max(axis=(0, 3)), np.abs(along_s[..., ORDER:]).max(axis=(0, 2)))
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
        sides=layout.sides if curved else np.empty((len(layout), 0)),
        density=layout.density,
        weight=layout.weight,
        share=layout.share,
        unresolved=left.max(axis=-1) / ellipsoid.a,
        doubt=doubt,
    )


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


def _pairs(along_r: FloatArray, along_s: FloatArray) -> FloatArray:
    """The larger of each two of the last six coefficients along either axis, (n, 6) each: (n, 2, 3)."""
    pairs = np.empty((len(along_r), 2, 3))
    np.maximum(along_r[:, ::2], along_r[:, 1::2], out=pairs[:, 0])
    np.maximum(along_s[:, ::2], along_s[:, 1::2], out=pairs[:, 1])
    return pairs


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
