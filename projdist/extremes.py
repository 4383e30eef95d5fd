"""Where in a region a measure is largest: searched from the best samples, not read off them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from projdist._typing import FloatArray
from projdist.cubature import Samples
from projdist.derivatives import jacobian
from projdist.hessians import hessian
from projdist.measures import Measure
from projdist.projections import Projection
from projdist.regions import Region

__all__ = ["Extreme", "find_maximum", "measure_at"]

_STARTS = 4
_ROUNDS = 20
_TRIAL, _FINALISTS = 5, 2  # after so many rounds only the best starts go on
_SHRINK = 0.45
_FINE = 1e-6  # of the area; smaller panels are there only beside singularities
_NOTHING = 1e-3  # what should be zero is rounding below that, in the unit of any measure
_UNBOUNDED = 1.5  # growth within tiny panels, or a hundredth of a panel; a smooth maximum gains 1e-4 there


class Extreme(NamedTuple):
    """A largest value and its place; infinite where the measure grows without bound towards it."""

    value: float
    lon: float
    lat: float


def measure_at(projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """A measure at points in degrees; second derivatives are taken per radian of the semi-major axis."""
    J = jacobian(projection, lon, lat)
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat) * projection.ellipsoid.a)


def find_maximum(
    projection: Projection, region: Region, samples: Samples, values: FloatArray, measure: Measure
) -> Extreme:
    """The largest value of a measure, from its `values` (n, p, p) at the samples.

    A grid of five by five points about each of the best samples is shrunk around its best point,
    within the region; its edge belongs to it.
    """
    filled = np.where(np.isfinite(values), values, -np.inf)
    peaks = filled.reshape(len(values), -1).max(axis=1)
    areas = samples.weight.sum(axis=(1, 2))
    coarse = areas > _FINE * areas.sum()
    order = np.argsort(-peaks)
    # From the best panels, and from the best that are not tiny: beside a singularity samples may mislead.
    starts = np.unique(np.concatenate([order[:_STARTS], order[coarse[order]][:_STARTS]]))
    node = filled.reshape(len(values), -1)[starts].argmax(axis=1)
    patch = samples.patch[starts]
    u, v = (grid[starts].reshape(len(starts), -1)[np.arange(len(starts)), node] for grid in (samples.u, samples.v))
    step_u, step_v = (np.ptp(grid[starts], axis=(1, 2)) / 4 for grid in (samples.u, samples.v))
    low_u, high_u, low_v, high_v = _limits(region, patch)
    if not np.isfinite(peaks).any():
        return Extreme(np.nan, np.nan, np.nan)
    best = np.full(len(starts), -np.inf)
    offsets = np.stack(np.meshgrid(np.arange(-2.0, 3.0), np.arange(-2.0, 3.0))).reshape(2, -1)
    early = best
    for turn in range(_ROUNDS):
        if turn == _TRIAL:  # the step is a hundredth of the panel
            early = best
        us = np.clip(u[:, None] + step_u[:, None] * offsets[0], low_u[:, None], high_u[:, None])
        vs = np.clip(v[:, None] + step_v[:, None] * offsets[1], low_v[:, None], high_v[:, None])
        points = region.chart(patch[:, None], us, vs)
        found = measure_at(projection, measure, points.lon, points.lat)
        found = np.where(np.isfinite(found), found, -np.inf)
        index = np.argmax(found, axis=1)
        top = np.take_along_axis(found, index[:, None], axis=1)[:, 0]
        better = top > best
        best = np.where(better, top, best)
        u = np.where(better, np.take_along_axis(us, index[:, None], axis=1)[:, 0], u)
        v = np.where(better, np.take_along_axis(vs, index[:, None], axis=1)[:, 0], v)
        step_u, step_v = _SHRINK * step_u, _SHRINK * step_v
        if turn == _TRIAL:
            keep = np.argsort(-best)[:_FINALISTS]
            u, v, patch, best, early, step_u, step_v, low_u, high_u, low_v, high_v = (
                array[keep] for array in (u, v, patch, best, early, step_u, step_v, low_u, high_u, low_v, high_v)
            )
    winner = int(np.argmax(best))
    if not np.isfinite(best[winner]):
        return Extreme(np.nan, np.nan, np.nan)
    place = region.chart(patch[winner], u[winner], v[winner])
    lon, lat = float((place.lon + 180.0) % 360.0 - 180.0), float(place.lat)
    ordinary = float(peaks[coarse].max(initial=0.0)) if coarse.any() else float(early[winner])
    grew = not measure.bounded and best[winner] > max(_UNBOUNDED * ordinary, _NOTHING)
    return Extreme(np.inf if grew else float(best[winner]), lon, lat)


def _limits(region: Region, patch: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The range of u and v of each patch."""
    number, rectangles = region.panels()
    ranges = {
        int(p): (
            rectangles[number == p, 0].min(),
            rectangles[number == p, 1].max(),
            rectangles[number == p, 2].min(),
            rectangles[number == p, 3].max(),
        )
        for p in np.unique(patch)
    }
    low_u, high_u, low_v, high_v = np.array([ranges[int(p)] for p in patch]).T
    return low_u, high_u, low_v, high_v
