"""Isolines of what is left of an old map's distortion, in the plane of the truth."""

from __future__ import annotations

import numpy as np

from projdist._typing import AnyArray, FloatArray
from projdist.applications.oldmaps.field import LOCAL_MEASURES, OldMap

__all__ = ["isolines"]

_LEVELS = 12  # at most
_THIN = 1e-9  # of a value: what varies less has no lines


def isolines(found: OldMap, measure: str, *, by: str = "mdt") -> dict[float, FloatArray]:
    """Straight pieces (m, 2, 2) of isolines at round levels, from point to point in metres of the true plane.

    `measure`: of LOCAL_MEASURES, after the rectification `by`. Where the fit folds there are none.
    """
    places, triangles = _mesh(found)
    values = LOCAL_MEASURES[measure](found.corrected(found.local_jacobian(places), by))
    true = found.fit(places)
    triangles = triangles[np.isfinite(values[triangles]).all(axis=1)]
    levels = _levels(values[np.isfinite(values)])
    return {level: pieces for level in levels if len(pieces := _pieces(true, values, triangles, level))}


def _mesh(found: OldMap) -> tuple[FloatArray, AnyArray]:
    """Places (m, 2) on the old map that fill the hull, its rim with them, and triangles of them (k, 3)."""
    from scipy.spatial import ConvexHull, Delaunay  # slow to load, and few need it

    linear = found.rectifications["affine"].affine
    hull = ConvexHull(linear(found.fitted.old))
    corners = linear(found.fitted.old)[hull.vertices]
    step = float(np.sqrt(hull.volume / len(found.nodes)))
    rim = [
        start + (stop - start) * np.arange(count := int(np.ceil(np.hypot(*(stop - start)) / step)))[:, None] / count
        for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    inner = linear(found.nodes)
    inner = inner[(inner @ hull.equations[:, :2].T + hull.equations[:, 2] < -0.2 * step).all(axis=1)]
    places = np.concatenate([inner, *rim])
    return linear.inverse()(places), Delaunay(places - places.mean(axis=0)).simplices


def _levels(values: FloatArray) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten."""
    low, high = float(values.min()), float(values.max())
    if not high - low > _THIN * max(abs(low), abs(high)):
        return []
    least = (high - low) / _LEVELS
    power = 10.0 ** np.floor(np.log10(least))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))
    return [float(f"{k * step:.12g}") for k in range(int(np.floor(low / step)) + 1, int(np.ceil(high / step)))]


def _pieces(places: FloatArray, values: FloatArray, triangles: AnyArray, level: float) -> FloatArray:
    """Where a level crosses triangles: each in two of its sides, which neighbours cross at the same point."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=-1)
    above = values[sides] >= level
    crossed = above[..., 0] != above[..., 1]
    one, other = np.moveaxis(sides[crossed], -1, 0)
    share = (level - values[one]) / (values[other] - values[one])
    return np.asarray((places[one] + share[:, None] * (places[other] - places[one])).reshape(-1, 2, 2))
