"""A check of every answer: a map whose method is known to be conformal or equal-area measures so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import log_anisotropy, log_areal_scale
from projdist.projections import Nature, Projection, nature_of
from projdist.support import tell

__all__ = ["departure", "tell_of_contradiction"]

_MOST = 60  # matrices, so that it costs nothing
# PROJ's iterations and elliptic functions leave 1e-6; the wrong ellipsoid, or a series far from home, 1e-4 and more.
_EXACT = 1e-5


def tell_of_contradiction(
    projection: Projection, J: FloatArray, weight: FloatArray | None = None, error: float = 0.0
) -> None:
    """Tell where most of some Jacobians (..., 2, 2) of an error are not what the method of a map promises.

    Of those with weights (...) the heaviest count: nodes crowd where a map is singular, and PROJ's rounding is large.
    """
    nature = nature_of(projection)
    if nature is None:
        return
    J = J.reshape(-1, 2, 2)
    if weight is not None:
        J = J[np.argsort(-np.abs(weight), axis=None)[: max(_MOST, len(J) // 4)]]
    J = J[:: max(1, len(J) // _MOST)]
    J = J[np.isfinite(J).all(axis=(-1, -2))]
    if not len(J):
        return
    off = departure(nature, J)
    if off > max(_EXACT, error):
        tell(
            f"{projection.label} is not {nature.keeps} here, as {nature.name} should be: {_told(nature, off)}. "
            "It may be too far from where the map is meant for."
        )


def _told(nature: Nature, off: float) -> str:
    if nature.keeps == "conformal":  # tan^2 of (90 degrees + omega) / 4 is the ratio of the scales
        return f"angles are off by {_figure(np.degrees(2.0 * np.arcsin(np.tanh(off / 2.0))))} degrees"
    return f"areas differ by {_figure(100.0 * np.expm1(off))} %"


def _figure(value: float) -> str:
    """Two digits, or all of those before the point."""
    return f"{value:.2g}" if value < 99.5 else f"{value:,.0f}"


def departure(nature: Nature, J: FloatArray) -> float:
    """How far most Jacobians (n, 2, 2) are from what a method keeps, as a logarithm of scales."""
    return _DEPARTURES[nature.keeps](J)


def _of_angles(J: FloatArray) -> float:
    return float(np.median(log_anisotropy(J)))


def _of_areas(J: FloatArray) -> float:
    """Half the points are within this of one another: equal-area maps have one areal scale, which need not be 1."""
    values = np.sort(log_areal_scale(J))  # `np.quantile` takes ten times as long for so few
    low, high = np.interp([0.25 * (values.size - 1), 0.75 * (values.size - 1)], np.arange(values.size), values)
    return float(high - low) if np.isfinite(values[-1]) else np.nan


_DEPARTURES: dict[str, Callable[[FloatArray], float]] = {"conformal": _of_angles, "equal-area": _of_areas}
