"""Figures of a map over a region, by which maps are ranked and optimised."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, cast, get_args

import numpy as np

from projdist import matrices
from projdist._typing import FloatArray
from projdist.earth import data_rows
from projdist.matrices import MEASURES, Measure, fisher, get_measure, log_anisotropy, log_areal_scale
from projdist.numerics import get_criterion, mean, rms
from projdist.support import Estimate, Registry, check_choice, check_text

# 0.1 ppm, in each unit: derivatives are good to 1e-10 and better, true differences begin at 1e-6.
_ROUNDING = {"ppm": 0.1, "deg": float(np.degrees(1e-7))}

_Statistic = Literal["rms", "mean", "max"]
_Aspect = Literal["distortion", "scales", "angles", "areas", ""]
_Version = Literal["", "scaled", "affine"]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A number of a map over a region, for which smaller is better; built in or your own.

    It is a `statistic` (rms, mean or max, by true area) of a `measure`: the name of one, or a function of J that is
    never below 0. The RMS of fisher may be taken after the best linear correction of a kind, the `version` "scaled" or
    "affine" of the map. `aspect` is the property of the map that is measured, "" if unknown.

    >>> from projdist import sample
    >>> square = Figure(name="square", measure=lambda J: J[..., 0, 0] ** 2, statistic="max")
    >>> round(sample("plate-carree", "box:-10,0,10,60").figure(square).value, 6)
    4.0
    """

    name: str
    description: str = ""
    measure: Measure
    statistic: _Statistic
    aspect: _Aspect = ""
    version: _Version = ""
    source: str = ""

    def __post_init__(self) -> None:
        check_text("name of a figure", self.name)
        check_choice("statistic", self.statistic, get_args(_Statistic))
        object.__setattr__(self, "measure", get_measure(self.measure))
        if self.measure.needs_hessian:
            raise ValueError(f"Invalid figure '{self.name}'. Its measure must be one of J, not of second derivatives.")
        if self.version and not self.is_airy_kavrayskiy:
            raise ValueError(
                f"Invalid figure '{self.name}'. It must be the RMS of fisher, of which there are versions."
            )

    def __call__(self, J: FloatArray, weights: FloatArray) -> float:
        """The figure of Jacobians (n, 2, 2) with weights (n,); those of weight 0 count for maxima only."""
        if self.version == "scaled":
            shift = mean(log_areal_scale(J), weights)
            return float(np.sqrt(max(mean(fisher(J) ** 2, weights) - 0.5 * shift**2, 0.0)))
        if self.version == "affine":
            counts = np.isfinite(fisher(J)) & (weights > 0)
            return rms(np.sqrt(matrices.mdt(J[counts], weights[counts]).distances), weights[counts])
        return get_criterion(self.statistic)(self.measure(J), np.ones(len(J)) if self.is_maximum else weights)

    @property
    def unit(self) -> str:
        """The measure's unit: ppm, deg, or "" for logarithms and ratios."""
        return self.measure.unit

    @property
    def essence(self) -> tuple[Measure, str, str]:
        """All that determines the value; figures that differ only in name have the same."""
        return self.measure, self.statistic, self.version

    @property
    def is_airy_kavrayskiy(self) -> bool:
        """True for the raw, the scaled and the affine Airy-Kavrayskiy error."""
        return self.measure == MEASURES["fisher"] and self.statistic == "rms"

    @property
    def is_maximum(self) -> bool:
        """True if it is the largest value of its measure, not a mean."""
        return self.statistic == "max"

    @property
    def rounding(self) -> float:
        """Largest value that rounding leaves on a map without this distortion."""
        return _ROUNDING.get(self.unit, 1e-7)

    def without_rounding(self, value: float) -> float:
        """The value, or 0 where it is only rounding, so that rounding does not order maps."""
        return value if value > self.rounding else 0.0


AnyFigure = str | Figure | Measure | Callable[[FloatArray], FloatArray]


class AiryKavrayskiy(NamedTuple):
    """The raw, scaled and affine errors, the largest of their estimated errors, and the MDT (2, 2)."""

    raw: float
    scaled: float
    affine: float
    error: float
    mdt: FloatArray


class GeometricMedian(NamedTuple):
    """The linear map T (2, 2) with the least mean Fisher distortion of T^-1 J, its error and whether it is unique."""

    T: FloatArray
    error: float  # the Fisher distortion between T and the true one
    unique: bool


class Spread(NamedTuple):
    """The mean and the median Fisher distortion by area."""

    mean: Estimate
    median: Estimate


# ---- measures that only figures use ---------------------------------------------------------


def _scales(J: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The principal scales a and b, NaN where the map is singular."""
    scales = matrices.principal_scales(J)
    a, b = np.moveaxis(np.where(scales[..., 1:] > 0, scales, np.nan), -1, 0)
    return a, b


def _log_scale(J: FloatArray) -> FloatArray:
    a, b = _scales(J)
    return np.maximum(np.abs(np.log(a)), np.abs(np.log(b)))


def _balance(J: FloatArray) -> FloatArray:
    a, b = _scales(J)
    return np.sqrt(0.5 * ((a / b - 1.0) ** 2 + (a * b - 1.0) ** 2))


def _angles_twice(J: FloatArray) -> FloatArray:
    return np.sqrt((2.0 * log_anisotropy(J) ** 2 + log_areal_scale(J) ** 2) / 3.0)


def _areas_twice(J: FloatArray) -> FloatArray:
    return np.sqrt((log_anisotropy(J) ** 2 + 2.0 * log_areal_scale(J) ** 2) / 3.0)


def _relative_scales(J: FloatArray) -> FloatArray:
    a, b = _scales(J)
    return 0.5 * (np.maximum(a, 1.0 / a) + np.maximum(b, 1.0 / b)) - 1.0


def _relative_area(J: FloatArray) -> FloatArray:
    s = matrices.areal_scale(J)
    s = np.where(s > 0, s, np.nan)
    return np.maximum(s, 1.0 / s) - 1.0


_OWN = {"airy_balance": _balance, "klingatsch_angles": _angles_twice, "klingatsch_areas": _areas_twice}
_OWN |= {"canters_ab": _relative_scales, "max_log_scale": _log_scale, "canters_ar": _relative_area}
_BY_NAME = MEASURES | {name: Measure(name, function) for name, function in _OWN.items()}

FIGURES: Registry[Figure] = Registry(
    "criterion",
    {row["name"]: Figure(**cast(Any, row | {"measure": _BY_NAME[row["measure"]]})) for row in data_rows("figures.csv")},
    rule="It must be one of airy_kavrayskiy, airy, max_scale_error_ppm, mean_omega, ... (see 'projdist list figures', "
    "or projdist.FIGURES), or a function of J.",
)


def get_figure(figure: AnyFigure) -> Figure:
    """The figure of a name or of a function of J, as every `criterion` is given.

    Parameters
    ----------
    figure : str, Figure, Measure or callable
        A name in `FIGURES`, or a function of Jacobians J (n, 2, 2), metre per metre, that returns values (n,) of at
        least 0, or NaN where they are undefined. The figure of a function is the mean by true area; for the RMS or the
        maximum pass `Figure(name=..., measure=function, statistic="rms")`, or "max".

    Returns
    -------
    Figure
        With its measure, statistic, unit and `source`.

    Raises
    ------
    ValueError
        For an unknown name, and for a measure of second derivatives.

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
