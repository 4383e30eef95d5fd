"""Values at very many points of a region, for medians, percentiles and shares of the area."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray
from projdist.field.cubature import Samples
from projdist.numerics import interpolate
from projdist.regions import Place

__all__ = ["dense"]

# Points for the quantiles, whose error falls as one over their number: all in all, and in one panel.
_DENSE, _DENSEST = 200_000, 20_000


def dense(
    region: Place | None, samples: Samples, values: FloatArray, *, thinned: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Values (m, n, p, p) interpolated within the panels, at the many points of a lattice, those in the region.

    Their shape is (m, k), that of the weights (k,). The lattice of the golden ratio has as many levels along either
    direction as it has points. `thinned` takes half of the points.
    """
    every = 2 if thinned else 1
    if region is None or samples.weight.shape[-1] == 1:
        return values.reshape(len(values), -1)[:, ::every], samples.weight.ravel()[::every]
    smooth = np.isfinite(values).all(axis=(0, 2, 3))
    m = int(np.clip(_DENSE / values.shape[1], 64, _DENSEST)) // every
    step = np.arange(m) + 0.5
    r, s = 2.0 * step / m - 1.0, 2.0 * np.mod(step * (np.sqrt(5.0) - 1.0) / 2.0, 1.0) - 1.0
    fine = np.stack([_within_reach(one[smooth], r, s).ravel() for one in values])
    weights = np.maximum(interpolate(samples.density[smooth], r, s), 0.0) * (4.0 / m)
    clipped = samples.share[smooth] < 1.0
    if clipped.any():
        lon, lat = (interpolate(place[smooth][clipped], r, s) for place in (samples.lon, samples.lat))
        inside = np.where(region.contains(lon, lat), weights[clipped], 0.0)
        # As much as the lattice has found stands for all of the panel's part, which is known.
        found, area = inside.sum(axis=1), samples.weight[smooth][clipped].sum(axis=(1, 2))
        weights[clipped] = inside * np.divide(area, found, out=np.zeros_like(found), where=found > 0)[:, None]
    rest = ~smooth
    return (
        np.concatenate([fine, values[:, rest].reshape(len(values), -1)], axis=1),
        np.concatenate([weights.ravel(), np.maximum(samples.weight[rest], 0.0).ravel()]),
    )


def _within_reach(values: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Interpolated values: a polynomial may overshoot beside a singularity, and stays within what was sampled."""
    low, high = values.min(axis=(1, 2)), values.max(axis=(1, 2))
    margin = 0.1 * (high - low)
    return np.clip(interpolate(values, r, s), (low - margin)[:, None], (high + margin)[:, None])
