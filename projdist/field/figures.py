"""Figures: numbers of a map over a region, by which maps are measured, ranked and made better; one registry of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from projdist._typing import FloatArray
from projdist.matrices import (
    MEASURES,
    Measure,
    areal_scale,
    fisher,
    get_measure,
    log_anisotropy,
    log_areal_scale,
    mdt,
    principal_scales,
)
from projdist.numerics import get_criterion, mean, rms
from projdist.support import Registry, check_choice, check_text

# 0.1 ppm, in each unit: derivatives are good to 1e-10 and better, true differences begin at 1e-6.
_ROUNDING = {"ppm": 0.1, "deg": float(np.degrees(1e-7))}
_STATISTICS = ("rms", "mean", "max")


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A number of a map over a region, smaller is better; also one of your own.

    It is a `statistic` (rms, mean or max, by true area) of a `measure`, which is a name or a function of J that is
    never below 0, or the RMS of one; of the map as it is, or, with the measure fisher, of its best `version`, "scaled"
    or "affine". `aspect` is what of the map it knows, "" where nobody has said.

    >>> from projdist import sample
    >>> square = Figure(name="square", measure=lambda J: J[..., 0, 0] ** 2, statistic="max")
    >>> round(sample("plate-carree", "box:-10,0,10,60").figure(square).value, 6)
    4.0
    """

    name: str
    description: str = ""
    measure: Measure
    statistic: Literal["rms", "mean", "max"]
    aspect: Literal["distortion", "scales", "angles", "areas", ""] = ""
    version: Literal["", "scaled", "affine"] = ""
    source: str = ""

    def __post_init__(self) -> None:
        check_text("name of a figure", self.name)
        check_choice("statistic", self.statistic, _STATISTICS)
        object.__setattr__(self, "measure", get_measure(self.measure))
        if self.measure.needs_hessian:
            raise ValueError(f"Invalid figure '{self.name}'. Its measure must be one of J, not of second derivatives.")
        if self.version and not self.is_airy_kavrayskiy:
            raise ValueError(
                f"Invalid figure '{self.name}'. It must be the RMS of fisher, of which there are versions."
            )

    def __call__(self, J: FloatArray, weights: FloatArray) -> float:
        """The figure of Jacobians (n, 2, 2) with weights (n,); one of weight 0 counts for the largest value only."""
        if self.version == "scaled":
            return float(
                np.sqrt(max(mean(fisher(J) ** 2, weights) - 0.5 * mean(log_areal_scale(J), weights) ** 2, 0.0))
            )
        if self.version == "affine":
            counts = np.isfinite(fisher(J)) & (weights > 0)
            return rms(np.sqrt(mdt(J[counts], weights[counts]).distances), weights[counts])
        return get_criterion(self.statistic)(self.measure(J), np.ones(len(J)) if self.is_maximum else weights)

    @property
    def unit(self) -> str:
        """The measure's: ppm, deg, or "" for logarithms and ratios."""
        return self.measure.unit

    @property
    def essence(self) -> tuple[Measure, str, str]:
        """What makes it the number that it is, whatever it is called."""
        return self.measure, self.statistic, self.version

    @property
    def is_airy_kavrayskiy(self) -> bool:
        """Whether it is one of the Airy-Kavrayskiy errors."""
        return self.measure == MEASURES["fisher"] and self.statistic == "rms"

    @property
    def is_maximum(self) -> bool:
        """Whether it is the largest value of its measure, and no mean."""
        return self.statistic == "max"

    @property
    def may_vanish(self) -> bool:
        """Whether whole families may have none of it: angles, or areas, or something unknown."""
        return self.aspect in ("angles", "areas", "")

    @property
    def rounding(self) -> float:
        """What a map has at most that keeps true, to 0.1 ppm, what the figure is of."""
        return _ROUNDING.get(self.unit, 1e-7)

    def without_rounding(self, value: float) -> float:
        """A value to order maps by: 0 for all that are no more than rounding, which would order them."""
        return value if value > self.rounding else 0.0


AnyFigure = str | Figure | Measure | Callable[[FloatArray], FloatArray]


# ---- measures that have figures, and no names of their own ----------------------------------


def _scales(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """a and b, NaN where the map is singular."""
    scales = principal_scales(J)
    a, b = np.moveaxis(np.where(scales[..., 1:] > 0, scales, np.nan), -1, 0)
    return a, b


def _log_scale(J: FloatArray) -> FloatArray:
    """Largest |ln scale| over all directions."""
    a, b = _scales(J)
    return np.maximum(np.abs(np.log(a)), np.abs(np.log(b)))


def _balance(J: FloatArray) -> FloatArray:
    """sqrt(((a / b - 1)^2 + (a b - 1)^2) / 2)."""
    a, b = _scales(J)
    return np.sqrt(0.5 * ((a / b - 1.0) ** 2 + (a * b - 1.0) ** 2))


def _angles_twice(J: FloatArray) -> FloatArray:
    """sqrt((2 ln^2(a/b) + ln^2(ab)) / 3)."""
    return np.sqrt((2.0 * log_anisotropy(J) ** 2 + log_areal_scale(J) ** 2) / 3.0)


def _areas_twice(J: FloatArray) -> FloatArray:
    """sqrt((ln^2(a/b) + 2 ln^2(ab)) / 3)."""
    return np.sqrt((log_anisotropy(J) ** 2 + 2.0 * log_areal_scale(J) ** 2) / 3.0)


def _relative_scales(J: FloatArray) -> FloatArray:
    """(max(a, 1/a) + max(b, 1/b)) / 2 - 1."""
    a, b = _scales(J)
    return 0.5 * (np.maximum(a, 1.0 / a) + np.maximum(b, 1.0 / b)) - 1.0


def _relative_area(J: FloatArray) -> FloatArray:
    """By how much areas are too large or too small, max(s, 1/s) - 1."""
    s = areal_scale(J)
    s = np.where(s > 0, s, np.nan)
    return np.maximum(s, 1.0 / s) - 1.0


# ---- the registry ---------------------------------------------------------------------------

_OZERI = "Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications"
_KAVRAYSKIY = "Kavrayskiy 1934, Matematicheskaya kartografiya"
_AIRY = "Airy 1861, Explanation of a projection by balance of errors, Philosophical Magazine 22:409"
_TISSOT = "Tissot 1881, Memoire sur la representation des surfaces"
_CHEBYSHEV = "Chebyshev 1856, Sur la construction des cartes geographiques"
_CANTERS = "Canters & Decleir 1989, The World in Perspective"
_GOTT = "Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, Cartographica 42:297"
_KLINGATSCH = "weights of angles and areas as Klingatsch has them, of logarithms; not read in the original"

_FIGURES = {
    figure.name: figure
    for figure in (
        Figure(
            name="airy_kavrayskiy",
            description="RMS of sqrt(ln^2 a + ln^2 b) by true area.",
            measure=MEASURES["fisher"],
            statistic="rms",
            aspect="distortion",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy_kavrayskiy_scaled",
            description="The same after the best uniform scale.",
            measure=MEASURES["fisher"],
            statistic="rms",
            aspect="distortion",
            version="scaled",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy_kavrayskiy_affine",
            description="The same after the best linear map (MDT).",
            measure=MEASURES["fisher"],
            statistic="rms",
            aspect="distortion",
            version="affine",
            source=_OZERI,
        ),
        Figure(
            name="kavrayskiy",
            description="RMS of sqrt((ln^2 a + ln^2 b) / 2), as much of the literature has it.",
            measure=MEASURES["kavrayskiy"],
            statistic="rms",
            aspect="distortion",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="airy",
            description="RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2).",
            measure=MEASURES["airy"],
            statistic="rms",
            aspect="distortion",
            source=_AIRY,
        ),
        Figure(
            name="airy_balance",
            description="RMS of sqrt(((a/b - 1)^2 + (ab - 1)^2) / 2), Airy's balance of errors of shape and area.",
            measure=Measure("airy_balance", _balance),
            statistic="rms",
            aspect="distortion",
            source=_AIRY,
        ),
        Figure(
            name="jordan",
            description="RMS over all places and directions of scale - 1.",
            measure=MEASURES["jordan"],
            statistic="rms",
            aspect="distortion",
            source="Jordan 1896, Zeitschrift fuer Vermessungswesen 25:249",
        ),
        Figure(
            name="jordan_kavrayskiy",
            description="RMS over all places and directions of ln of the scale.",
            measure=MEASURES["jordan_kavrayskiy"],
            statistic="rms",
            aspect="distortion",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="klingatsch_angles",
            description="RMS of sqrt((2 ln^2(a/b) + ln^2(ab)) / 3): angles count twice.",
            measure=Measure("klingatsch_angles", _angles_twice),
            statistic="rms",
            aspect="distortion",
            source=_KLINGATSCH,
        ),
        Figure(
            name="klingatsch_areas",
            description="RMS of sqrt((ln^2(a/b) + 2 ln^2(ab)) / 3): areas count twice.",
            measure=Measure("klingatsch_areas", _areas_twice),
            statistic="rms",
            aspect="distortion",
            source=_KLINGATSCH,
        ),
        Figure(
            name="canters_ab",
            description="Mean of (max(a, 1/a) + max(b, 1/b)) / 2 - 1.",
            measure=Measure("canters_ab", _relative_scales),
            statistic="mean",
            aspect="distortion",
            source=_CANTERS,
        ),
        Figure(
            name="max_scale_error_ppm",
            description="Largest |scale - 1| in any direction.",
            measure=MEASURES["scale_error_ppm"],
            statistic="max",
            aspect="scales",
            source=_TISSOT,
        ),
        Figure(
            name="mean_scale_error_ppm",
            description="Mean over the area of the largest |scale - 1|.",
            measure=MEASURES["scale_error_ppm"],
            statistic="mean",
            aspect="scales",
            source=_TISSOT,
        ),
        Figure(
            name="rms_scale_error_ppm",
            description="RMS over the area of the largest |scale - 1|.",
            measure=MEASURES["scale_error_ppm"],
            statistic="rms",
            aspect="scales",
            source=_TISSOT,
        ),
        Figure(
            name="max_log_scale",
            description="Largest |ln scale| in any direction (Chebyshev's criterion).",
            measure=Measure("max_log_scale", _log_scale),
            statistic="max",
            aspect="scales",
            source=_CHEBYSHEV,
        ),
        Figure(
            name="angular_distortion",
            description="RMS of the maximum angular deformation.",
            measure=MEASURES["angular_distortion"],
            statistic="rms",
            aspect="angles",
            source=_TISSOT,
        ),
        Figure(
            name="max_omega",
            description="Largest angular deformation.",
            measure=MEASURES["angular_distortion"],
            statistic="max",
            aspect="angles",
            source=_TISSOT,
        ),
        Figure(
            name="mean_omega",
            description="Mean over the area of the angular deformation.",
            measure=MEASURES["angular_distortion"],
            statistic="mean",
            aspect="angles",
            source=_TISSOT,
        ),
        Figure(
            name="isotropy",
            description="RMS of ln(a/b).",
            measure=MEASURES["log_anisotropy"],
            statistic="rms",
            aspect="angles",
            source=_GOTT,
        ),
        Figure(
            name="kunimune_shape",
            description="Mean over the area of ln(a/b).",
            measure=MEASURES["log_anisotropy"],
            statistic="mean",
            aspect="angles",
            source="Kunimune, Map-Projections, output/parameters.txt",
        ),
        Figure(
            name="log_areal_scale",
            description="RMS of ln(ab).",
            measure=MEASURES["log_areal_scale"],
            statistic="rms",
            aspect="areas",
            source=_KAVRAYSKIY,
        ),
        Figure(
            name="max_areal_error_ppm",
            description="Largest |ab - 1|.",
            measure=MEASURES["areal_error_ppm"],
            statistic="max",
            aspect="areas",
            source=_TISSOT,
        ),
        Figure(
            name="mean_areal_error_ppm",
            description="Mean over the area of |ab - 1|.",
            measure=MEASURES["areal_error_ppm"],
            statistic="mean",
            aspect="areas",
            source=_TISSOT,
        ),
        Figure(
            name="canters_ar",
            description="Mean of max(s, 1/s) - 1.",
            measure=Measure("canters_ar", _relative_area),
            statistic="mean",
            aspect="areas",
            source=_CANTERS,
        ),
    )
}

FIGURES: Registry[Figure] = Registry(
    "criterion",
    _FIGURES,
    rule="It must be one of airy_kavrayskiy, airy, max_scale_error_ppm, mean_omega, ... (see 'projdist list figures', "
    "or projdist.FIGURES), or a function of J.",
)


def get_figure(figure: AnyFigure) -> Figure:
    """The figure of a name, of a function of J, or itself: what every `criterion` is.

    Parameters
    ----------
    figure : str, Figure, Measure or callable
        A name in `FIGURES`. A function takes Jacobians J (n, 2, 2), metre per metre, and gives values (n,) that are
        never below 0, and NaN where it is undefined: its figure is their mean by true area. For the RMS or the largest
        value there is `Figure(name=..., measure=function, statistic="rms")`, or "max".

    Returns
    -------
    Figure
        With its measure, statistic, unit and `source`.

    Raises
    ------
    ValueError
        For an unknown name, with close matches, and a measure of second derivatives.

    References
    ----------
    - Kavrayskiy 1934, Matematicheskaya kartografiya.
    - Airy 1861, Philosophical Magazine 22:409.
    - Tissot 1881, Memoire sur la representation des surfaces.
    - Chebyshev 1856, Sur la construction des cartes geographiques.
    - Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications.

    Examples
    --------
    >>> get_figure("airy").description
    'RMS of sqrt(((a - 1)^2 + (b - 1)^2) / 2).'
    """
    if isinstance(figure, Figure):
        return figure
    if callable(figure):
        measure = get_measure(figure)
        return Figure(name=measure.name, description=measure.description, measure=measure, statistic="mean")
    return FIGURES.named(figure)
