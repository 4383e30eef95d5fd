"""What a map is good for, judged from its Jacobians over a region: what it keeps true, and figures to rank it by.

`RANKINGS` lists the figures by name, `PURPOSES` what a map may be asked to keep. Both take
Jacobians J (n, 2, 2) and weights (n,); a node of weight 0 counts for largest values only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from projdist import hints
from projdist._typing import FloatArray
from projdist.criteria import maximum, mean, rms
from projdist.mdt import mdt
from projdist.measures import (
    angular_distortion,
    areal_error_ppm,
    fisher,
    log_anisotropy,
    log_areal_scale,
    principal_scales,
    scale_error_ppm,
)

__all__ = ["PROPERTIES", "PURPOSES", "RANKINGS", "Ranking", "get_purpose", "get_ranking", "properties", "suits"]

Figure = Callable[[FloatArray, FloatArray], float]

_EXACT = 1e-7  # of a scale: 0.1 ppm. Derivatives are good to 1e-10 and better, true differences begin at 1e-6


# ---- figures --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ranking:
    """A figure to rank maps by, smaller is better; one that `is_maximum` only grows as nodes are added."""

    name: str
    figure: Figure
    description: str
    is_maximum: bool = False

    @property
    def exact(self) -> float:
        """What a map has at most that keeps true, to 0.1 ppm, what the figure is of."""
        return _EXACT * (1e6 if "ppm" in self.name else np.degrees(1.0) if "omega" in self.name else 1.0)

    def told(self, value: float) -> float:
        """A value to order maps by: 0 for all that are no more than `exact`, whose order would be that of rounding."""
        return value if value > self.exact else 0.0

    def __call__(self, J: FloatArray, weights: FloatArray) -> float:
        """The figure of Jacobians (n, 2, 2) with weights (n,)."""
        return self.figure(J, weights)


def _mean_of(measure: Callable[[FloatArray], FloatArray]) -> Figure:
    return lambda J, weights: mean(measure(J), weights)


def _largest(measure: Callable[[FloatArray], FloatArray]) -> Figure:
    return lambda J, weights: maximum(measure(J), np.ones(len(J)))


def _rms_fisher(J: FloatArray, weights: FloatArray) -> float:
    return rms(fisher(J), weights)


def _rms_fisher_scaled(J: FloatArray, weights: FloatArray) -> float:
    square = mean(fisher(J) ** 2, weights) - 0.5 * mean(log_areal_scale(J), weights) ** 2
    return float(np.sqrt(max(square, 0.0)))


def _rms_fisher_affine(J: FloatArray, weights: FloatArray) -> float:
    counts = np.isfinite(fisher(J)) & (weights > 0)
    return rms(np.sqrt(mdt(J[counts], weights[counts]).distances), weights[counts])


RANKINGS: dict[str, Ranking] = {
    ranking.name: ranking
    for ranking in (
        Ranking("airy_kavrayskiy", _rms_fisher, "RMS Fisher distortion."),
        Ranking("airy_kavrayskiy_scaled", _rms_fisher_scaled, "The same after the best uniform scale."),
        Ranking("airy_kavrayskiy_affine", _rms_fisher_affine, "The same after the best linear map (MDT)."),
        Ranking("max_scale_error_ppm", _largest(scale_error_ppm), "Largest |scale - 1| in ppm.", is_maximum=True),
        Ranking("mean_scale_error_ppm", _mean_of(scale_error_ppm), "Mean over the area of |scale - 1| in ppm."),
        Ranking("max_omega", _largest(angular_distortion), "Largest angular deformation in degrees.", is_maximum=True),
        Ranking("mean_omega", _mean_of(angular_distortion), "Mean angular deformation in degrees."),
        Ranking("max_areal_error_ppm", _largest(areal_error_ppm), "Largest |s - 1| in ppm.", is_maximum=True),
        Ranking("mean_areal_error_ppm", _mean_of(areal_error_ppm), "Mean over the area of |s - 1| in ppm."),
    )
}


def get_ranking(name: str) -> Ranking:
    """The figure of a name; raises ValueError with close matches."""
    if name not in RANKINGS:
        hint = hints.suggestion(name, RANKINGS)
        raise ValueError(f"Invalid criterion '{name}'. {hint}It must be {hints.listed(list(RANKINGS), 'or')}.")
    return RANKINGS[name]


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
    if name not in PURPOSES:
        hint = hints.did_you_mean(hints.close_words(name.lower().replace("_", "-"), PURPOSES))
        raise ValueError(f"Invalid purpose '{name}'. {hint}It must be {hints.listed(PURPOSES, 'or')}.")
    return name


def properties(J: FloatArray, weights: FloatArray) -> tuple[str, ...]:
    """What a map keeps to 0.1 ppm at all nodes that count: areas up to a constant, angles, distances along lines."""
    counts = (weights > 0) & np.isfinite(fisher(J))
    return tuple(name for name, keeps in PROPERTIES.items() if keeps(J[counts]))


def suits(kept: tuple[str, ...], purpose: str) -> bool:
    """Whether a map with these properties serves a purpose; a compromise is what keeps none."""
    return purpose == "any" or purpose in kept or (purpose == "compromise" and not kept)
