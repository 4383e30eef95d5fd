"""Where a field jumps, as scales do on a map of two parts: isolines end there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from projdist._typing import BoolArray, FloatArray, IntArray
from projdist.surfaces.domain import normalised
from projdist.surfaces.surface import Surface

_HALVINGS = 6
_LEFT = 0.5  # of an edge's difference, on a 64th of it: a field without a jump has a few hundredths of it there

_STEEP = 2.0  # of the usual difference along an edge: along others a field that jumps does so by less than it rises

ValuesAt = Callable[[FloatArray, FloatArray], FloatArray]
"""A field's values at longitudes and latitudes."""


def jumping(surface: Surface, values: FloatArray, levels: FloatArray, values_at: ValuesAt) -> BoolArray:
    """Which triangles of a surface have an edge along which a field passes a level by a jump."""
    corners = values[surface.triangles]
    jumps = np.zeros(len(corners), dtype=bool)
    # An edge along which a level is passed is of triangles that the level crosses: of few.
    crossed = np.flatnonzero(crosses(corners, levels))
    steepest = _STEEP * _usual_difference(surface, corners)
    jumps[crossed] = _passed_by_jumps(surface, surface.triangles[crossed], values, levels, values_at, steepest)
    return jumps


def crosses(corners: FloatArray, levels: FloatArray) -> BoolArray:
    """Which triangles, of values (n, 3) at their corners, any of the levels, in order, crosses or touches."""
    least, most = corners.min(axis=1), corners.max(axis=1)
    return np.asarray(np.searchsorted(levels, most, side="right") > np.searchsorted(levels, least))


def _usual_difference(surface: Surface, corners: FloatArray) -> float:
    """The median over the edges between nodes; NaN where there are none."""
    known = (surface.triangles < surface.nodes).all(axis=1) & np.isfinite(corners).all(axis=1)
    inner = corners[known]
    return float(np.median(np.abs(inner - np.roll(inner, 1, axis=1)))) if len(inner) else np.nan


def _passed_by_jumps(
    surface: Surface,
    triangles: IntArray,
    values: FloatArray,
    levels: FloatArray,
    values_at: ValuesAt,
    least: float,
) -> BoolArray:
    """The same of some triangles, with the least difference along an edge at which a jump is sought."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=-1)
    count = surface.x.size
    keys, which = np.unique((sides[..., 0] * count + sides[..., 1]).ravel(), return_inverse=True)
    edges = np.column_stack([keys // count, keys % count])
    low, high = np.sort(values[edges], axis=1).T
    first = np.searchsorted(levels, low, side="right")
    passed = np.searchsorted(levels, high) > first
    inside = (edges < surface.nodes).all(axis=1) & np.isfinite(low + high)  # images of a seam are on sides of their own
    found = np.zeros(len(edges), dtype=bool)
    tried = np.flatnonzero(passed & inside & (high - low > least))
    if tried.size:
        found[tried] = _jumps(surface, edges[tried], levels[first[tried]], values_at)
    return np.asarray(found[which.reshape(-1, 3)].any(axis=1))


def _jumps(surface: Surface, edges: IntArray, level: FloatArray, values_at: ValuesAt) -> BoolArray:
    """Whether the halves in which a level is passed keep the differences that a field has along edges."""
    start, stop = edges.T
    u, v = surface.u[start], surface.v[start]
    du, dv = np.mod(surface.u[stop] - u + 180.0, 360.0) - 180.0, surface.v[stop] - v

    def along(share: FloatArray | float) -> FloatArray:
        lon, lat = surface.frame.geographic(u + share * du, v + share * dv)
        return values_at(normalised(lon), lat)

    here, there = along(0.0), along(1.0)
    passed = (here - level) * (there - level) < 0.0  # a vertex at a pole has its neighbours' value
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
