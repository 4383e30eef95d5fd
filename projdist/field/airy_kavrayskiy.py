"""The Airy-Kavrayskiy errors of a map, raw, scaled and after the best linear map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.field.cubature import Samples
from projdist.matrices import areal_scale, field_mdt, log_scales
from projdist.numerics import Estimate
from projdist.projections import ProjectionError

__all__ = ["AiryKavrayskiy", "airy_kavrayskiy_of"]


class AiryKavrayskiy(NamedTuple):
    """The raw, scaled and affine errors, the largest of their estimated errors, and the MDT (2, 2)."""

    raw: float
    scaled: float
    affine: float
    error: float
    mdt: FloatArray


def airy_kavrayskiy_of(samples: Samples) -> AiryKavrayskiy:
    """The Airy-Kavrayskiy errors of samples; raises ProjectionError where the map is singular everywhere."""
    square, log_area = log_scales(samples.jacobian)
    defined = np.isfinite(square) & (areal_scale(samples.jacobian) > 0)
    if not defined.any():
        raise ProjectionError("Invalid projection. It is singular everywhere: its image is a line or a point.")
    if defined.all():
        result = field_mdt(samples.jacobian.reshape(-1, 2, 2), samples.weight.ravel())
        distances = result.distances.reshape(square.shape)
    else:
        result = field_mdt(samples.jacobian[defined], samples.weight[defined])
        distances = np.full(square.shape, np.nan)
        distances[defined] = result.distances
    slopes = 2.0 * np.sqrt(square), 1.0, 2.0 * np.sqrt(distances)
    (mean_square, square_error), (shift, shift_error), affine_mean = samples.means(
        (square, log_area, distances), slopes
    )
    raw = Estimate(mean_square, square_error).root()
    # The best scale c minimises the mean of (ln a + c)^2 + (ln b + c)^2: c = -mean ln(ab) / 2.
    scaled = Estimate(mean_square - 0.5 * shift**2, square_error + abs(shift) * shift_error).root()
    affine = Estimate(*affine_mean).root()
    error = max(raw.error, scaled.error, affine.error)
    return AiryKavrayskiy(raw.value, scaled.value, affine.value, error, result.T)
