"""What a linear map of the plane does: scale, stretch and its direction, shear, rotation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.matrices.distortions import areal_scale, meridian_convergence, principal_scales

__all__ = ["Decomposition", "decompose"]

_ROUND = 1e-9  # of a stretch: below it a circle has no longer axis


class Decomposition(NamedTuple):
    """The parts of linear maps, each of shape (...).

    `scale`: sqrt |det M|. `stretch`: the greatest scale over the smallest, 1 for a similarity.
    `stretch_azimuth`: the direction that is stretched most, degrees clockwise from the y axis, within
    [0, 180); NaN where none is. `shear`: by how many degrees less than 90 the axes' images stand
    apart. `rotation`: degrees by which the y axis turns clockwise.
    """

    scale: FloatArray
    stretch: FloatArray
    stretch_azimuth: FloatArray
    shear: FloatArray
    rotation: FloatArray


def decompose(M: ArrayLike) -> Decomposition:
    """The parts of matrices of shape (..., 2, 2).

    >>> decompose([[3.0, 0.0], [0.0, 1.5]]).stretch_azimuth
    array(90.)
    """
    M = np.asarray(M, dtype=float)
    a, b = np.moveaxis(principal_scales(M), -1, 0)
    xx, xy, yx, yy = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    dot = xx * xy + yx * yy
    # The major axis of M^T M, from the x axis counter-clockwise.
    major = 0.5 * np.arctan2(2.0 * dot, xx**2 + yx**2 - xy**2 - yy**2)
    area = areal_scale(M)
    return Decomposition(
        np.sqrt(area),
        a / b,
        np.where(a - b > _ROUND * a, np.mod(90.0 - np.degrees(major), 180.0), np.nan),
        np.degrees(np.arctan2(dot, area)),
        -meridian_convergence(M),
    )
