"""Figures: numbers of a map over a region, by which maps are measured, ranked and made better; one registry of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import Measure, principal_scales
from projdist.support import hints, quoted

__all__ = ["FIGURES", "Figure", "check_figure", "get_figure"]

# 0.1 ppm, in each unit: derivatives are good to 1e-10 and better, true differences begin at 1e-6.
_ROUNDING = {"": 1e-7, "ppm": 0.1, "deg": float(np.degrees(1e-7))}


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A number of a map over a region, smaller is better.

    It is a `statistic` (rms, mean or max, by true area) of a `measure`, of the map as it is, or of its best `version`,
    "scaled" or "affine". `aspect` is what of the map it knows. `unit` is "" for logarithms and ratios.
    """

    name: str
    description: str
    measure: str | Measure
    statistic: Literal["rms", "mean", "max"]
    aspect: Literal["distortion", "scales", "angles", "areas"]
    version: Literal["", "scaled", "affine"] = ""
    unit: Literal["", "ppm", "deg"] = ""
    source: str = ""

    @property
    def is_maximum(self) -> bool:
        """Whether it is the largest value of its measure, and no mean."""
        return self.statistic == "max"

    @property
    def is_partial(self) -> bool:
        """Whether it knows a part of the distortion, which vanishes for whole families: that of angles, or of areas."""
        return self.aspect in ("angles", "areas")

    @property
    def rounding(self) -> float:
        """What a map has at most that keeps true, to 0.1 ppm, what the figure is of."""
        return _ROUNDING[self.unit]


def _log_scale(J: FloatArray) -> FloatArray:
    """Largest |ln scale| over all directions."""
    a, b = np.moveaxis(principal_scales(J), -1, 0)
    return np.maximum(np.abs(np.log(a)), np.abs(np.log(np.where(b > 0, b, np.nan))))


_KAVRAYSKIY = "Kavrayskiy 1934, Matematicheskaya kartografiya"
_AIRY = "Airy 1861, Philosophical Magazine 22:409"
_TISSOT = "Tissot 1881, Memoire sur la representation des surfaces"

FIGURES: dict[str, Figure] = {
    figure.name: figure
    for figure in (
        Figure(
            name="airy_kavrayskiy",
            description="RMS of sqrt(ln^2 a + ln^2 b) by true area.",
            measure="fisher",
            statistic="rms",
            aspect="distortion",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy_kavrayskiy_scaled",
            description="The same after the best uniform scale.",
            measure="fisher",
            statistic="rms",
            aspect="distortion",
            version="scaled",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy_kavrayskiy_affine",
            description="The same after the best linear map (MDT).",
            measure="fisher",
            statistic="rms",
            aspect="distortion",
            version="affine",
            source="Ozeri, Riemannian Geometry Approach for Minimizing Distortion",
        ),
        Figure(
            name="kavrayskiy",
            description="RMS of sqrt((ln^2 a + ln^2 b) / 2), as much of the literature has it.",
            measure="kavrayskiy",
            statistic="rms",
            aspect="distortion",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy",
            description="RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2).",
            measure="airy",
            statistic="rms",
            aspect="distortion",
            source=_AIRY,
        ),
        Figure(
            name="max_scale_error_ppm",
            description="Largest |scale - 1| in any direction.",
            measure="scale_error_ppm",
            statistic="max",
            aspect="scales",
            unit="ppm",
            source=_TISSOT,
        ),
        Figure(
            name="mean_scale_error_ppm",
            description="Mean over the area of the largest |scale - 1|.",
            measure="scale_error_ppm",
            statistic="mean",
            aspect="scales",
            unit="ppm",
            source=_TISSOT,
        ),
        Figure(
            name="max_log_scale",
            description="Largest |ln scale| in any direction (Chebyshev's criterion).",
            measure=Measure("max_log_scale", _log_scale),
            statistic="max",
            aspect="scales",
            source="Chebyshev 1856, Sur la construction des cartes geographiques",
        ),
        Figure(
            name="angular_distortion",
            description="RMS of the maximum angular deformation.",
            measure="angular_distortion",
            statistic="rms",
            aspect="angles",
            unit="deg",
            source=_TISSOT,
        ),
        Figure(
            name="max_omega",
            description="Largest angular deformation.",
            measure="angular_distortion",
            statistic="max",
            aspect="angles",
            unit="deg",
            source=_TISSOT,
        ),
        Figure(
            name="mean_omega",
            description="Mean over the area of the angular deformation.",
            measure="angular_distortion",
            statistic="mean",
            aspect="angles",
            unit="deg",
            source=_TISSOT,
        ),
        Figure(
            name="log_areal_scale",
            description="RMS of ln(ab).",
            measure="log_areal_scale",
            statistic="rms",
            aspect="areas",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="max_areal_error_ppm",
            description="Largest |ab - 1|.",
            measure="areal_error_ppm",
            statistic="max",
            aspect="areas",
            unit="ppm",
            source=_TISSOT,
        ),
        Figure(
            name="mean_areal_error_ppm",
            description="Mean over the area of |ab - 1|.",
            measure="areal_error_ppm",
            statistic="mean",
            aspect="areas",
            unit="ppm",
            source=_TISSOT,
        ),
    )
}


def get_figure(figure: str | Figure) -> Figure:
    """The figure of a name, or itself.

    Parameters
    ----------
    figure : str or Figure
        A name of `FIGURES`.

    Returns
    -------
    Figure
        With its measure, statistic, unit and `source`.

    Raises
    ------
    ValueError
        For an unknown name, with close matches.

    References
    ----------
    - Kavrayskiy 1934, Matematicheskaya kartografiya.
    - Airy 1861, Philosophical Magazine 22:409.
    - Tissot 1881, Memoire sur la representation des surfaces.
    - Chebyshev 1856, Sur la construction des cartes geographiques.
    - Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    >>> figure = get_figure("airy")
    >>> figure.description, figure.source
    ('RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2).', 'Airy 1861, Philosophical Magazine 22:409')
    """
    return figure if isinstance(figure, Figure) else FIGURES[check_figure(figure, FIGURES)]


def check_figure(name: Any, allowed: Collection[str]) -> str:
    """The name of a figure, one of those that are allowed; raises ValueError with close matches."""
    if isinstance(name, str) and name in allowed:
        return name
    hint = hints.suggestion(name, allowed) if isinstance(name, str) else ""
    raise ValueError(f"Invalid criterion {quoted(name)}. {hint}It must be one of {', '.join(allowed)}.")
