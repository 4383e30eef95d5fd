"""What a map is good for, judged from its Jacobians over a region: what it keeps true, and figures to rank it by.

`RANKINGS` lists those of `FIGURES` that a few nodes have, `PURPOSES` what a map may be asked to keep. Both take
Jacobians J (n, 2, 2) and weights (n,); a node of weight 0 counts for largest values only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from projdist._typing import FloatArray
from projdist.field import FIGURES, Figure, check_figure
from projdist.matrices import (
    angular_distortion,
    areal_error_ppm,
    fisher,
    log_anisotropy,
    log_areal_scale,
    mdt,
    principal_scales,
    scale_error_ppm,
)
from projdist.numerics import maximum, mean, rms
from projdist.support import hints, quoted

__all__ = ["PROPERTIES", "PURPOSES", "RANKINGS", "Ranking", "get_purpose", "get_ranking", "properties", "suits"]

Compute = Callable[[FloatArray, FloatArray], float]

_EXACT = 1e-7  # of a scale: 0.1 ppm. Derivatives are good to 1e-10 and better, true differences begin at 1e-6


# ---- figures --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ranking:
    """How to have a figure to rank maps by from nodes; a maximum only grows as nodes are added."""

    of: Figure
    compute: Compute

    def told(self, value: float) -> float:
        """A value to order maps by: 0 for all that are no more than rounding, which would order them."""
        return value if value > self.of.rounding else 0.0

    def __call__(self, J: FloatArray, weights: FloatArray) -> float:
        """The figure of Jacobians (n, 2, 2) with weights (n,)."""
        return self.compute(J, weights)


def _mean_of(measure: Callable[[FloatArray], FloatArray]) -> Compute:
    return lambda J, weights: mean(measure(J), weights)


def _largest(measure: Callable[[FloatArray], FloatArray]) -> Compute:
    return lambda J, weights: maximum(measure(J), np.ones(len(J)))


def _rms_fisher(J: FloatArray, weights: FloatArray) -> float:
    return rms(fisher(J), weights)


def _rms_fisher_scaled(J: FloatArray, weights: FloatArray) -> float:
    square = mean(fisher(J) ** 2, weights) - 0.5 * mean(log_areal_scale(J), weights) ** 2
    return float(np.sqrt(max(square, 0.0)))


def _rms_fisher_affine(J: FloatArray, weights: FloatArray) -> float:
    counts = np.isfinite(fisher(J)) & (weights > 0)
    return rms(np.sqrt(mdt(J[counts], weights[counts]).distances), weights[counts])


_COMPUTED: dict[str, Compute] = {
    "airy_kavrayskiy": _rms_fisher,
    "airy_kavrayskiy_scaled": _rms_fisher_scaled,
    "airy_kavrayskiy_affine": _rms_fisher_affine,
    "max_scale_error_ppm": _largest(scale_error_ppm),
    "mean_scale_error_ppm": _mean_of(scale_error_ppm),
    "max_omega": _largest(angular_distortion),
    "mean_omega": _mean_of(angular_distortion),
    "max_areal_error_ppm": _largest(areal_error_ppm),
    "mean_areal_error_ppm": _mean_of(areal_error_ppm),
}
RANKINGS = {name: Ranking(FIGURES[name], compute) for name, compute in _COMPUTED.items()}


def get_ranking(criterion: Any) -> Ranking:
    """The figure of a name; raises ValueError with close matches."""
    return RANKINGS[check_figure(criterion, RANKINGS)]


# ---- purposes -------------------------------------------------------------------------------


def _keeps_areas(J: FloatArray) -> bool:
    return bool(np.ptp(log_areal_scale(J)) <= _EXACT)


def _keeps_angles(J: FloatArray) -> bool:
    return bool(np.max(log_anisotropy(J)) <= _EXACT)


def _keeps_distances(J: FloatArray) -> bool:
    """One of the principal scales is 1 everywhere: along meridians, from a point, or from a line."""
    return bool(np.max(np.min(np.abs(np.log(principal_scales(J))), axis=-1)) <= _EXACT)


PROPERTIES: dict[str, Callable[[FloatArray], bool]] = {
    "equal-area": _keeps_areas,
    "conformal": _keeps_angles,
    "equidistant": _keeps_distances,
}

PURPOSES = ("any", *PROPERTIES, "compromise")


def get_purpose(name: str) -> str:
    """The purpose of a name; raises ValueError with close matches."""
    if not isinstance(name, str) or name not in PURPOSES:
        words = hints.close_words(name.lower().replace("_", "-"), PURPOSES) if isinstance(name, str) else []
        hint = hints.did_you_mean(words)
        raise ValueError(f"Invalid purpose {quoted(name)}. {hint}It must be {hints.listed(PURPOSES, 'or')}.")
    return name


def properties(J: FloatArray, weights: FloatArray) -> tuple[str, ...]:
    """What a map keeps to 0.1 ppm at all nodes that count: areas up to a constant, angles, distances along lines."""
    counts = (weights > 0) & np.isfinite(fisher(J))
    return tuple(name for name, keeps in PROPERTIES.items() if keeps(J[counts]))


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """Whether a map with these properties serves a purpose; a compromise is what keeps none."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)
