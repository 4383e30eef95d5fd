"""Values of measures at the vertices of a surface, and the triangles across which they jump, where isolines end."""

from collections.abc import Callable

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.earth import wrapped
from projdist.field import jacobian, measure_at
from projdist.matrices import Measure
from projdist.surfaces.domain import POLE
from projdist.surfaces.surface import Surface

_HALVINGS = 6
_LEFT = 0.5  # of an edge's difference, if left on a 64th of it, is a jump: continuous fields leave some hundredths
_STEEP = 2.0  # of the usual difference along an edge: on less steep edges a jump is smaller than the field's slope

ValuesAt = Callable[[FloatArray, FloatArray], FloatArray]
"""A field's values at longitudes and latitudes."""


def jumping(surface: Surface, values: FloatArray, levels: FloatArray, values_at: ValuesAt) -> BoolArray:
    """True for triangles of a surface with an edge on which the field jumps across a level."""
    corners = values[surface.triangles]
    known = (surface.triangles < surface.nodes).all(axis=1) & np.isfinite(corners).all(axis=1)
    inner = corners[known]
    steepest = _STEEP * float(np.median(np.abs(inner - np.roll(inner, 1, axis=1)))) if len(inner) else np.nan
    # Only the few triangles that a level crosses can have such an edge.
    crossed = np.flatnonzero(crosses(corners, levels))
    sides = np.sort(surface.triangles[crossed][:, [[0, 1], [1, 2], [2, 0]]], axis=-1)
    count = surface.x.size
    keys, which = np.unique((sides[..., 0] * count + sides[..., 1]).ravel(), return_inverse=True)
    edges = np.column_stack([keys // count, keys % count])
    low, high = np.sort(values[edges], axis=1).T
    first = np.searchsorted(levels, low, side="right")
    passed = np.searchsorted(levels, high) > first
    inside = (edges < surface.nodes).all(axis=1) & np.isfinite(low + high)  # not along a seam
    found = np.zeros(len(edges), dtype=bool)
    tried = np.flatnonzero(passed & inside & (high - low > steepest))
    if tried.size:
        found[tried] = _jumps(surface, edges[tried], levels[first[tried]], values_at)
    jumps = np.zeros(len(corners), dtype=bool)
    jumps[crossed] = found[which.reshape(-1, 3)].any(axis=1)
    return jumps


def crosses(corners: FloatArray, levels: FloatArray) -> BoolArray:
    """True for triangles, values (n, 3) at their corners, that any of the ascending levels crosses or touches."""
    least, most = corners.min(axis=1), corners.max(axis=1)
    return np.asarray(np.searchsorted(levels, most, side="right") > np.searchsorted(levels, least))


def _jumps(surface: Surface, edges: IntArray, level: FloatArray, values_at: ValuesAt) -> BoolArray:
    """True for edges (n, 2) on which the crossing of a level is a jump, by repeated halving of the edge."""
    start, stop = edges.T
    u, v = surface.u[start], surface.v[start]
    du, dv = np.mod(surface.u[stop] - u + 180.0, 360.0) - 180.0, surface.v[stop] - v

    def along(share: FloatArray | float) -> FloatArray:
        """Values at a share of the way along the edges."""
        lon, lat = surface.frame.geographic(u + share * du, v + share * dv)
        return values_at(wrapped(lon), lat)

    here, there = along(0.0), along(1.0)
    passed = (here - level) * (there - level) < 0.0  # false where a pole's vertex took its neighbours' value
    least, most = np.minimum(here, there), np.maximum(here, there)
    low = np.zeros(len(edges))
    for halving in range(1, _HALVINGS + 1):
        middle = low + 0.5**halving
        between = along(middle)
        ahead = (between - level) * (here - level) > 0.0
        low = np.where(ahead, middle, low)
        here, there = np.where(ahead, between, here), np.where(ahead, there, between)
        least, most = np.fmin(least, between), np.fmax(most, between)
    return np.asarray(passed & (np.abs(there - here) > _LEFT * (most - least)))


_MOST_STEPS = 1.5  # between an image and its node, which are less than a step apart; the field may be curved


def field(surface: Surface, measure: Measure) -> FloatArray:
    """Values of a measure at the vertices of a surface; at images of a seam those on their own side of it."""
    inner = _off_poles(surface)
    values = np.full(surface.x.size, np.nan)
    values[inner] = measure_at(surface.domain.projection, measure, *surface.lonlat_off_seams(inner))
    values[~np.isfinite(values)] = np.nan
    nodes = filled(values[: surface.nodes].reshape(surface.shape))
    # The largest difference of a node to a neighbour, 0 without neighbours.
    across, along, steps = np.abs(np.diff(nodes, axis=1)), np.abs(np.diff(nodes, axis=0)), np.zeros(nodes.shape)
    for part, difference in ((steps[:, 1:], across), (steps[:, :-1], across), (steps[1:], along), (steps[:-1], along)):
        np.fmax(part, difference, out=part)
    # Next to a seam derivatives may fail: a value farther from its node's than those of the node's neighbours are is
    # replaced by the node's.
    near, step = nodes.ravel()[surface.source], steps.ravel()[surface.source]
    return np.where(np.abs(values - near) <= _MOST_STEPS * step, values, near)


def jacobians(surface: Surface) -> FloatArray:
    """Jacobians (n, 2, 2) at a surface's vertices, on their own side of a seam; NaN at poles and where undefined."""
    inner = _off_poles(surface)
    found = np.full((surface.x.size, 2, 2), np.nan)
    found[inner] = jacobian(surface.domain.projection, *surface.lonlat_off_seams(inner))
    return found


def _off_poles(surface: Surface) -> IntArray:
    """Numbers of the drawn vertices off the grid's poles, where maps may be singular."""
    return np.flatnonzero(np.isfinite(surface.x) & (np.abs(surface.v) < POLE))


def filled(values: FloatArray) -> FloatArray:
    """The values with gaps filled by means of neighbours, as far as three cells into a gap."""
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
