"""Pointwise measures of distortion by name.

Every measure is a function of matrices `J` of shape (..., 2, 2), and of their second
derivatives `H` of shape (..., 2, 2, 2) where it says so. A measure that is undefined at a
point is NaN there. `MEASURES` lists them by name; `get_measure` also takes the short
symbols (h, k, s, a, b, omega, theta), `scale@AZIMUTH`, and any callable of J.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from projdist._typing import FloatArray
from projdist.matrices.bending import flexion, skewness
from projdist.matrices.distortions import (
    airy,
    angular_distortion,
    areal_error_ppm,
    areal_scale,
    fisher,
    jordan,
    jordan_kavrayskiy,
    kavrayskiy,
    log_anisotropy,
    log_areal_scale,
    meridian_convergence,
    meridian_parallel_angle,
    meridional_scale,
    orientation,
    parallel_scale,
    scale_at,
    scale_error_ppm,
    tissot_semimajor,
    tissot_semiminor,
)
from projdist.support import listed_values, quoted, suggestion

__all__ = ["MEASURES", "Measure", "get_measure"]

_LIMITS = {
    "angular_distortion": (0.0, 180.0),
    "meridian_parallel_angle": (0.0, 90.0),
    "meridian_convergence": (-180.0, 180.0),
    "orientation": (-1.0, 1.0),
}


@dataclass(frozen=True)
class Measure:
    """A named pointwise measure.

    `function` takes J, or J and H where `needs_hessian`. `kind` says how values compare and
    are drawn: "ratio" is about 1 in the logarithm, "signed" about 0, "magnitude" from 0 up.
    """

    name: str
    function: Callable[..., FloatArray]
    symbol: str = ""
    unit: str = ""
    _: KW_ONLY
    kind: Literal["ratio", "signed", "magnitude"] = "magnitude"
    needs_hessian: bool = False

    def __call__(self, J: ArrayLike, H: ArrayLike | None = None) -> FloatArray:
        """Values of shape (...) for J of shape (..., 2, 2); raises ValueError where H is needed and missing."""
        J = np.asarray(J, dtype=float)
        if not self.needs_hessian:
            return self.function(J)
        if H is None:
            raise ValueError(f"Invalid call of measure '{self.name}'. It needs the second derivatives H as well.")
        return self.function(J, np.asarray(H, dtype=float))

    @property
    def bounded(self) -> bool:
        """Whether no map can make it arbitrarily large: angles and signs."""
        return self.unit == "deg" or self.name == "orientation"

    @property
    def limits(self) -> tuple[float, float]:
        """What no map can go beyond, infinite where there is none; of functions of users nothing is known."""
        if self.name in _LIMITS:
            return _LIMITS[self.name]
        positive = self.kind == "ratio" or (self.kind == "magnitude" and MEASURES.get(self.name) is self)
        return (0.0 if positive else -np.inf), np.inf

    @property
    def description(self) -> str:
        """The first line of the function's documentation."""
        return (self.function.__doc__ or "").strip().partition("\n")[0]


MEASURES: dict[str, Measure] = {
    measure.name: measure
    for measure in (
        Measure("fisher", fisher),
        Measure("meridional_scale", meridional_scale, "h", kind="ratio"),
        Measure("parallel_scale", parallel_scale, "k", kind="ratio"),
        Measure("areal_scale", areal_scale, "s", kind="ratio"),
        Measure("tissot_semimajor", tissot_semimajor, "a", kind="ratio"),
        Measure("tissot_semiminor", tissot_semiminor, "b", kind="ratio"),
        Measure("angular_distortion", angular_distortion, "omega", "deg"),
        Measure("meridian_parallel_angle", meridian_parallel_angle, "theta", "deg"),
        Measure("meridian_convergence", meridian_convergence, "convergence", "deg", kind="signed"),
        Measure("log_anisotropy", log_anisotropy, "ln(a/b)"),
        Measure("log_areal_scale", log_areal_scale, "ln(ab)", kind="signed"),
        Measure("airy", airy),
        Measure("kavrayskiy", kavrayskiy),
        Measure("jordan", jordan),
        Measure("jordan_kavrayskiy", jordan_kavrayskiy),
        Measure("scale_error_ppm", scale_error_ppm, "ppm", "ppm"),
        Measure("areal_error_ppm", areal_error_ppm, "", "ppm"),
        Measure("orientation", orientation, kind="signed"),
        Measure("flexion", flexion, needs_hessian=True),
        Measure("skewness", skewness, needs_hessian=True),
    )
}

ALIASES: dict[str, str] = {measure.symbol: measure.name for measure in MEASURES.values() if measure.symbol} | {
    "max_scale": "tissot_semimajor",
    "min_scale": "tissot_semiminor",
}


_ALLOWED = (
    "It must be one of fisher, h, k, s, a, b, omega, ... (see 'projdist list measures', or projdist.MEASURES), "
    "scale@AZIMUTH, or a function of J."
)


def get_measure(measure: str | Measure | Callable[[FloatArray], FloatArray]) -> Measure:
    """The measure of a name, a symbol, `scale@AZIMUTH`, or a function of J.

    Parameters
    ----------
    measure : str, Measure or callable
        A name in `MEASURES`; a short symbol, as h, k, s, a, b, omega, theta; the scale in an azimuth of so many degrees
        clockwise from north; or a function of J (..., 2, 2) that gives values (...). A measure stands for itself.

    Returns
    -------
    Measure
        A function of J (..., 2, 2), or of J and second derivatives (..., 2, 2, 2) where it needs them.

    Raises
    ------
    ValueError
        For an unknown name, with close matches, and an azimuth that is no number.

    References
    ----------
    Snyder 1987, Map Projections: A Working Manual, equations 4-9 (omega) and 4-14 (theta).
    Airy 1861, Philosophical Magazine 22:409 (airy); Jordan 1896 (jordan).
    Goldberg & Gott 2007, Flexion and Skewness in Map Projections of the Earth, section 3 (flexion, skewness).
    D. Ozeri, Riemannian Geometry Approach for Minimizing Distortion and its Applications (fisher).

    Examples
    --------
    Of scales 2 and 1, 2 asin(1 / 3) in degrees, and the root of (4 + 1) / 2 half way between their directions:

    >>> J = [[2.0, 0.0], [0.0, 1.0]]
    >>> [round(float(get_measure(name)(J)), 6) for name in ("omega", "scale@45")]
    [38.942441, 1.581139]
    """
    if isinstance(measure, Measure):
        return measure
    if callable(measure):
        return Measure(getattr(measure, "__name__", "custom"), measure)
    if not isinstance(measure, str):
        raise ValueError(f"Invalid measure {quoted(measure)}. {_ALLOWED}")
    name = ALIASES.get(measure, measure)
    if name in MEASURES:
        return MEASURES[name]
    if name.startswith("scale@"):
        return _scale_measure(name)
    hint = suggestion(measure, [*MEASURES, *ALIASES, "scale@AZIMUTH"])
    raise ValueError(f"Invalid measure {quoted(measure)}. {hint}{_ALLOWED}")


def listed_measures(measures: Any) -> list[Any]:
    """Measures as they are given: those of an iterable, one alone, or none for None."""
    return [] if measures is None else listed_values(measures, (str, Measure))


def _scale_measure(name: str) -> Measure:
    text = name.partition("@")[2]
    try:
        azimuth = float(text)
    except ValueError:
        azimuth = np.nan
    if not np.isfinite(azimuth):
        raise ValueError(
            f"Invalid azimuth {quoted(text)} in {quoted(name)}. It must be a number of degrees, as in scale@45."
        )

    def scale(J: FloatArray) -> FloatArray:
        """Scale in the given azimuth."""
        return scale_at(J, azimuth)

    return Measure(name, scale, kind="ratio")
