"""A measure, or the Jacobian, as a field over the drawn surface."""

from __future__ import annotations

import numpy as np

from projdist._typing import FloatArray, IntArray
from projdist.field import hessian, jacobian
from projdist.matrices import Measure
from projdist.projections import Projection
from projdist.surfaces.domain import POLE, normalised
from projdist.surfaces.surface import Surface

_INWARD = 0.01  # of the way from the image of a seam to its node
_MOST_STEPS = 1.5  # an image is less than a step from its node, and the field may bend


def field(surface: Surface, measure: Measure) -> FloatArray:
    """Values of a measure at the vertices of a surface, those at a seam's images on their own side of it."""
    inner, lon, lat = _measurable(surface)
    values = np.full(surface.x.size, np.nan)
    values[inner] = measured(surface.domain.projection, measure, lon, lat)
    values[~np.isfinite(values)] = np.nan
    nodes = filled(values[: surface.nodes].reshape(surface.shape))
    # Next to a seam and beyond a limb derivatives may fail. An image that differs from its node by more than the
    # neighbours do takes the value of the node.
    near, step = nodes.ravel()[surface.source], _steps(nodes).ravel()[surface.source]
    return np.where(np.abs(values - near) <= _MOST_STEPS * step, values, near)


def jacobians(surface: Surface) -> FloatArray:
    """Jacobians (n, 2, 2) at the vertices of a surface, those at a seam's images on their own side of it.

    NaN at the grid's poles, where a map may be singular, and where there is no derivative.
    """
    inner, lon, lat = _measurable(surface)
    found = np.full((surface.x.size, 2, 2), np.nan)
    found[inner] = jacobian(surface.domain.projection, lon, lat)
    return found


def _measurable(surface: Surface) -> tuple[IntArray, FloatArray, FloatArray]:
    """The vertices that are drawn and not at the grid's poles, with longitudes and latitudes to measure them at."""
    # An image is on the seam itself: a little way towards its node the side is certain.
    du, dv = surface.u[surface.source] - surface.u, surface.v[surface.source] - surface.v
    u, v = surface.u + _INWARD * (np.mod(du + 180.0, 360.0) - 180.0), surface.v + _INWARD * dv
    # At the grid's poles, where the map is singular, the next row stands in.
    inner = np.flatnonzero(np.isfinite(surface.x) & (np.abs(surface.v) < POLE))
    lon, lat = surface.frame.geographic(u[inner], v[inner])
    return inner, normalised(lon), lat


def measured(projection: Projection, measure: Measure, lon: FloatArray, lat: FloatArray) -> FloatArray:
    """Values of a measure at points."""
    J = jacobian(projection, lon, lat)
    if not measure.needs_hessian:
        return measure(J)
    return measure(J, hessian(projection, lon, lat))


def _steps(values: FloatArray) -> FloatArray:
    """The greatest difference to a neighbour in the grid, 0 where there is none."""
    across, along = np.abs(np.diff(values, axis=1)), np.abs(np.diff(values, axis=0))
    steps = np.zeros(values.shape)
    for part, difference in (
        (steps[:, 1:], across),
        (steps[:, :-1], across),
        (steps[1:], along),
        (steps[:-1], along),
    ):
        np.fmax(part, difference, out=part)
    return steps


def filled(values: FloatArray) -> FloatArray:
    """Missing values from their neighbours, up to three cells away."""
    for _ in range(3):
        missing = np.isnan(values)
        if not missing.any():
            break
        padded = np.pad(values, 1, constant_values=np.nan)
        near = np.stack([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        count = np.isfinite(near).sum(axis=0)
        mean = np.nansum(near, axis=0) / np.maximum(count, 1)
        values = np.where(missing & (count > 0), mean, values)
    return values
