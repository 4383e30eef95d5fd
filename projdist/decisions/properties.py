"""What a map keeps true, measured by its Jacobians over a region: angles, areas up to a constant, lengths along lines.

A map keeps a property where 99 % of the region is off from it by less than a limit; the rest is where maps are singular
(poles). The limit is 1e-5: iterations of PROJ leave 2e-6, formulas of a sphere on an ellipsoid 1e-3.
A small region lets every map look true: what a map does not keep, it is off by about the mean square of the distances
across the region, in units of the Earth's radius, and by a twentieth of that at least. There the limit is a thousandth
of that square, and never less than 1e-9, to which derivatives are certain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from projdist._typing import FloatArray
from projdist.earth import unit_vectors
from projdist.matrices import fisher, log_anisotropy, log_areal_scale, principal_scales
from projdist.numerics import quantile

__all__ = ["PROPERTIES", "Properties", "properties_of"]

_SHARE = 0.99  # of the region
_LARGEST, _LEAST = 1e-5, 1e-9  # limits, as scales less 1
_CURVED = 1e-3  # of the mean square across a region


class WeightedPoints(Protocol):
    """Points in degrees and their weights, all of shape (n,); those of weight 0 do not count."""

    @property
    def lon(self) -> FloatArray:
        """Longitudes."""

    @property
    def lat(self) -> FloatArray:
        """Latitudes."""

    @property
    def weight(self) -> FloatArray:
        """Shares of the area."""


@dataclass(frozen=True, kw_only=True)
class Properties:
    """What is kept, and by how much a map is off from each of `PROPERTIES`, as the logarithm of a scale."""

    keeps: tuple[str, ...]
    departures: dict[str, float]


def properties_of(J: FloatArray, points: WeightedPoints) -> Properties:
    """What a map with Jacobians (n, 2, 2) at points keeps; nothing, off by NaN, where none of them is defined."""
    counts = (points.weight > 0.0) & np.isfinite(fisher(J))
    if not counts.any():
        return Properties(keeps=(), departures=dict.fromkeys(PROPERTIES, float("nan")))
    J, weight = J[counts], points.weight[counts]
    departures = {name: quantile(off(J, weight), weight, _SHARE) for name, off in PROPERTIES.items()}
    limit = np.clip(_CURVED * _square_across(points.lon[counts], points.lat[counts], weight), _LEAST, _LARGEST)
    return Properties(keeps=tuple(name for name, off in departures.items() if off <= limit), departures=departures)


def _square_across(lon: FloatArray, lat: FloatArray, weight: FloatArray) -> float:
    """The mean square of the distances of points from the great circle nearest to them, on a sphere of radius 1."""
    vectors = unit_vectors(lon, lat)
    return float(np.linalg.eigvalsh(weight * vectors @ vectors.T)[0] / weight.sum())


def _off_areas(J: FloatArray, weight: FloatArray) -> FloatArray:
    """Equal-area maps have one areal scale, which need not be 1."""
    scale = log_areal_scale(J)
    return np.abs(scale - quantile(scale, weight, 0.5))


def _off_angles(J: FloatArray, _: FloatArray) -> FloatArray:
    return log_anisotropy(J)


def _off_distances(J: FloatArray, _: FloatArray) -> FloatArray:
    """One of the principal scales is 1 everywhere: along meridians, from a point, or from a line."""
    return np.min(np.abs(np.log(principal_scales(J))), axis=-1)


PROPERTIES: dict[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "equal-area": _off_areas,
    "conformal": _off_angles,
    "equidistant": _off_distances,
}
