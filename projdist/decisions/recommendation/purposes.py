"""What a map is good for, judged from its Jacobians over a region: what it keeps true, and what it is asked to keep."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import fisher, log_anisotropy, log_areal_scale, principal_scales
from projdist.support import hints, quoted

__all__ = ["PROPERTIES", "PURPOSES", "get_purpose", "properties", "suits"]

_EXACT = 1e-7  # of a scale: 0.1 ppm. Derivatives are good to 1e-10 and better, true differences begin at 1e-6


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
